//! The numbers of a section of version 4.1, which stand there as text or as bytes.

use super::section::{MshSection, RecordWords};
use crate::io::mesh_file::place::FilePlace;

/// Numbers one after the other, in records. What fails is a message naming the place.
pub trait Stream {
    /// Where the section begins.
    fn head(&self) -> FilePlace;

    /// Where the record that is read stands.
    fn place(&self) -> FilePlace;

    fn name(&self) -> &str;

    /// Goes on to the next record.
    fn begin(&mut self) -> Result<(), String>;

    /// A tag or a dimension.
    fn int(&mut self) -> Result<i64, String>;

    /// A count, or the number of a node or an element.
    fn size(&mut self) -> Result<u64, String>;

    fn number(&mut self) -> Result<f64, String>;

    /// Refuses what is left of the record.
    fn end(&mut self) -> Result<(), String>;

    /// So many numbers of nodes, in records of their own.
    fn tags(&mut self, count: u64) -> Result<Vec<u64>, String>;

    /// Refuses a count of things that the section has no room for, before any is read.
    fn announced(&self, count: u64, what: &str) -> Result<(), String>;

    /// Refuses what follows when all that was announced has been read.
    fn finish(self, count: u64, what: &str) -> Result<(), String>;
}

/// A section of text: each record is a line.
pub struct TextRecords<'t> {
    section: MshSection<'t>,
    record: Option<RecordWords<'t>>,
}

impl<'t> TextRecords<'t> {
    #[must_use]
    pub fn of(section: MshSection<'t>) -> Self {
        Self {
            section,
            record: None,
        }
    }

    /// The record that is read, the first where none has been begun.
    fn record(&mut self) -> Result<&mut RecordWords<'t>, String> {
        let record = match self.record.take() {
            Some(record) => record,
            None => self.section.record()?,
        };
        Ok(self.record.insert(record))
    }
}

impl Stream for TextRecords<'_> {
    fn head(&self) -> FilePlace {
        FilePlace::Line(self.section.first_line())
    }

    fn place(&self) -> FilePlace {
        let line = self.record.as_ref().map(|record| record.line);
        FilePlace::Line(line.unwrap_or(self.section.first_line()))
    }

    fn name(&self) -> &str {
        self.section.name
    }

    fn begin(&mut self) -> Result<(), String> {
        self.record = Some(self.section.record()?);
        Ok(())
    }

    fn int(&mut self) -> Result<i64, String> {
        self.record()?.signed()
    }

    fn size(&mut self) -> Result<u64, String> {
        self.record()?.whole()
    }

    fn number(&mut self) -> Result<f64, String> {
        self.record()?.number()
    }

    fn end(&mut self) -> Result<(), String> {
        self.record.take().map_or(Ok(()), RecordWords::ends)
    }

    fn tags(&mut self, count: u64) -> Result<Vec<u64>, String> {
        let mut tags = Vec::new();
        while (tags.len() as u64) < count {
            let mut record = self.section.record()?;
            tags.push(record.whole()?);
            while (tags.len() as u64) < count && record.goes_on() {
                tags.push(record.whole()?);
            }
            record.ends()?;
        }
        Ok(tags)
    }

    fn announced(&self, count: u64, what: &str) -> Result<(), String> {
        let line = self.record.as_ref().map(|record| record.line);
        let line = line.unwrap_or(self.section.first_line());
        self.section.announced(count, what, line)
    }

    fn finish(self, count: u64, what: &str) -> Result<(), String> {
        self.section.finish(count, what)
    }
}
