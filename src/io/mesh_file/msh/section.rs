//! The sections of a Gmsh file, record by record: one line each.

use std::str::SplitWhitespace;

use glam::DVec3;

use crate::io::mesh_file::words::{number, signed, whole};
use crate::plain::quote;

/// The lines between `$Name` and `$EndName`.
pub struct MshSection<'t> {
    pub name: &'t str,
    /// Number of the line `$Name`.
    begins: usize,
    lines: &'t [&'t str],
    /// Lines of it that were read.
    read: usize,
}

impl<'t> MshSection<'t> {
    /// The section that begins in a line (counted from zero), and the line after its end. Nothing where it is not
    /// ended.
    fn at(lines: &'t [&'t str], start: usize, name: &'t str) -> Option<(Self, usize)> {
        let body = &lines[start + 1..];
        let is_end = |line: &&str| line.trim().strip_prefix("$End") == Some(name);
        let length = body.iter().position(is_end)?;
        let section = Self {
            name,
            begins: start + 1,
            lines: &body[..length],
            read: 0,
        };
        Some((section, start + length + 2))
    }

    /// Number of its first line in the file.
    #[must_use]
    pub fn first_line(&self) -> usize {
        self.begins + 1
    }

    /// The next line that is not empty, with its number.
    pub fn following(&mut self) -> Option<RecordWords<'t>> {
        while let Some(&line) = self.lines.get(self.read) {
            self.read += 1;
            if !line.trim().is_empty() {
                return Some(RecordWords::of(line, self.begins + self.read));
            }
        }
        None
    }

    /// The next record.
    ///
    /// # Errors
    /// A message naming the line where the section ends too early.
    pub fn record(&mut self) -> Result<RecordWords<'t>, String> {
        let ends = self.begins + self.lines.len() + 1;
        self.following().ok_or_else(|| {
            format!(
                "line {ends}: ${} ends before all is there that it announces: the file was cut, or a count in it is wrong",
                self.name
            )
        })
    }

    /// Refuses a count of things that the section has no lines for, before any is read.
    ///
    /// # Errors
    /// A message naming the line of the count.
    pub fn announced(&self, count: u64, what: &str, line: usize) -> Result<(), String> {
        let left = self.lines.len() - self.read;
        if count <= left as u64 {
            return Ok(());
        }
        Err(format!(
            "line {line}: {count} {what} are announced, but ${} has no more than {left}: the file was cut, or the count is wrong",
            self.name
        ))
    }

    /// Refuses what follows when all that was announced has been read.
    ///
    /// # Errors
    /// A message naming the line where it goes on.
    pub fn finish(mut self, count: u64, what: &str) -> Result<(), String> {
        match self.following() {
            None => Ok(()),
            Some(more) => Err(format!(
                "line {}: ${} goes on after the {count} {what} that it announces: correct the count, or remove what is too much",
                more.line, self.name
            )),
        }
    }
}

/// The words of one line.
pub struct RecordWords<'t> {
    /// Its number in the file.
    pub line: usize,
    words: SplitWhitespace<'t>,
}

impl<'t> RecordWords<'t> {
    /// Of a line and its number.
    #[must_use]
    pub fn of(text: &'t str, line: usize) -> Self {
        Self {
            line,
            words: text.split_whitespace(),
        }
    }

    fn word(&mut self) -> Result<&'t str, String> {
        let line = self.line;
        let short =
            || format!("line {line}: a number is missing at its end: the file was cut there");
        self.words.next().ok_or_else(short)
    }

    /// A whole number.
    ///
    /// # Errors
    /// A message naming the line, as from all of these.
    pub fn whole(&mut self) -> Result<u64, String> {
        whole(self.word()?, self.line)
    }

    pub fn signed(&mut self) -> Result<i64, String> {
        signed(self.word()?, self.line)
    }

    pub fn number(&mut self) -> Result<f64, String> {
        number(self.word()?, self.line)
    }

    pub fn point(&mut self) -> Result<DVec3, String> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    /// Passes over numbers that are not needed.
    pub fn skip(&mut self, count: u64) -> Result<(), String> {
        (0..count).try_for_each(|_| self.number().map(drop))
    }

    /// What is left of the line, one blank between words.
    #[must_use]
    pub fn rest(self) -> String {
        self.words.collect::<Vec<_>>().join(" ")
    }

    /// Whether the line holds more.
    pub fn goes_on(&self) -> bool {
        self.words.clone().next().is_some()
    }

    /// Refuses what is left of the line.
    pub fn ends(mut self) -> Result<(), String> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(format!(
                "line {}: {} stands where the line should end",
                self.line,
                quote(word)
            )),
        }
    }
}

/// The sections of a file.
pub struct Sections<'t> {
    all: Vec<MshSection<'t>>,
}

impl<'t> Sections<'t> {
    /// Finds them.
    ///
    /// # Errors
    /// A message naming the line of one that is not ended, and of what stands outside of all.
    pub fn of(lines: &'t [&'t str]) -> Result<Self, String> {
        let mut all = Vec::new();
        let mut at = 0;
        while let Some(&line) = lines.get(at) {
            let line = line.trim();
            if let Some(name) = line.strip_prefix('$') {
                let (section, next) = MshSection::at(lines, at, name).ok_or_else(|| {
                    let what = match name.strip_prefix("End") {
                        None => "is not ended: the file was cut",
                        Some(_) => "ends a section that was not begun: the file is damaged",
                    };
                    format!("line {}: {} {what}", at + 1, quote(line))
                })?;
                all.push(section);
                at = next;
            } else if line.is_empty() {
                at += 1;
            } else {
                return Err(format!(
                    "line {}: {} stands outside of all sections: the file is damaged there",
                    at + 1,
                    quote(line)
                ));
            }
        }
        Ok(Self { all })
    }

    /// Takes out the one section of a name, where there is one.
    ///
    /// # Errors
    /// A message where there is a second one.
    pub fn take_any(&mut self, name: &str) -> Result<Option<MshSection<'t>>, String> {
        if self.all.iter().any(|section| section.name == name) {
            return self.take(name).map(Some);
        }
        Ok(None)
    }

    /// Takes out the one section of a name.
    ///
    /// # Errors
    /// A message where there is none, or a second one.
    pub fn take(&mut self, name: &str) -> Result<MshSection<'t>, String> {
        let missing = || format!("the section ${name} is missing: the file was cut or is damaged");
        let is_it = |section: &MshSection| section.name == name;
        let found = self.all.iter().position(is_it).ok_or_else(missing)?;
        let section = self.all.remove(found);
        match self.all.iter().find(|s| is_it(s)) {
            None => Ok(section),
            Some(second) => Err(format!(
                "line {}: ${name} is there a second time (first in line {}): write one mesh into a file",
                second.begins, section.begins
            )),
        }
    }

    /// Names of those that were not taken.
    #[must_use]
    pub fn rest(&self) -> Vec<&'t str> {
        self.all.iter().map(|section| section.name).collect()
    }
}
