//! Tables in CSV: the first line names the columns, and every message the line and the column.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::{FileError, source};
use crate::plain::quote;

/// The longest line that is read (bytes): a row of a million numbers and more.
const LINE: usize = 1 << 25;

/// A table with named columns.
pub struct NamedTable {
    path: PathBuf,
    text: String,
    names: csv::StringRecord,
}

impl NamedTable {
    /// Reads the whole table and takes its first line apart.
    ///
    /// # Errors
    /// [`FileError`] naming the file and what is wrong with its first line.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let mut text = source::read_text(path)?;
        // Programs that write tables like to begin them with a byte-order mark.
        if text.starts_with('\u{feff}') {
            text.remove(0);
        }
        if let Some(long) = text.lines().position(|l| l.len() > LINE) {
            let what = format!(
                "line {} is longer than {} MB: this is no table",
                long + 1,
                LINE >> 20
            );
            return Err(FileError::broken(path, what));
        }
        let mut table = Self {
            path: path.to_owned(),
            text,
            names: csv::StringRecord::new(),
        };
        let names = reader(&table.text).headers().cloned();
        table.names = names.map_err(|e| table.unreadable(&e))?;
        if table.names.is_empty() {
            return Err(table.wrong("the file is empty: its first line must name the columns"));
        }
        Ok(table)
    }

    /// What the columns are called.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter()
    }

    /// What a column is called.
    #[must_use]
    pub fn name(&self, column: usize) -> &str {
        self.names.get(column).unwrap_or_default()
    }

    /// The column of a name, where there is one.
    ///
    /// # Errors
    /// [`FileError`] when there are two.
    pub fn column(&self, name: &str) -> Result<Option<usize>, FileError> {
        let mut found = (0..).zip(&self.names).filter(|(_, n)| *n == name);
        match (found.next(), found.next()) {
            (Some(_), Some(_)) => {
                Err(self.wrong(format!("the column {name} stands twice in the first line")))
            }
            (first, _) => Ok(first.map(|(k, _)| k)),
        }
    }

    /// The columns of these names.
    ///
    /// # Errors
    /// [`FileError`] for the first that is missing, with what it may be due to.
    pub fn columns<const N: usize>(&self, names: &[&str; N]) -> Result<[usize; N], FileError> {
        let mut columns = [0; N];
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self
                .column(name)?
                .ok_or_else(|| self.missing(name, names))?;
        }
        Ok(columns)
    }

    fn missing(&self, name: &str, names: &[&str]) -> FileError {
        let other = [';', '\t']
            .into_iter()
            .find(|&mark| self.names.len() == 1 && self.names[0].contains(mark));
        if let Some(mark) = other {
            let mark = if mark == ';' { "semicolons" } else { "tabs" };
            return self.wrong(format!(
                "the columns are parted by {mark}: save the table with commas between columns, and points in numbers"
            ));
        }
        self.wrong(format!(
            "the column {name} is missing: the first line must name {}",
            names.join(",")
        ))
    }

    /// The rows below the first line.
    pub fn rows(&self) -> impl Iterator<Item = Result<TableRow<'_>, FileError>> {
        reader(&self.text)
            .into_records()
            .map(move |record| self.row(record))
    }

    fn row(&self, record: csv::Result<csv::StringRecord>) -> Result<TableRow<'_>, FileError> {
        let cells = record.map_err(|e| self.unreadable(&e))?;
        Ok(TableRow {
            table: self,
            line: self.line(cells.position()),
            cells,
        })
    }

    /// The line that a row stands in: remarks, blank lines and what is left of the last line's end come
    /// between a position and its row.
    fn line(&self, position: Option<&csv::Position>) -> u64 {
        position.map_or(1, |position| {
            let rest = self.text.get(position.byte() as usize..).unwrap_or("");
            let between = rest
                .lines()
                .take_while(|l| l.is_empty() || l.starts_with('#'));
            position.line() + between.count() as u64
        })
    }

    fn unreadable(&self, error: &csv::Error) -> FileError {
        match error.kind() {
            csv::ErrorKind::UnequalLengths {
                pos,
                expected_len,
                len,
            } => {
                let line = self.line(pos.as_ref());
                let hint = if len > expected_len {
                    ": a comma begins the next column, so that numbers need decimal points"
                } else {
                    ""
                };
                self.wrong(format!(
                    "line {line}: there are {len} values for the {expected_len} columns that the first line names{hint}"
                ))
            }
            _ => self.wrong(format!("this is not a readable table ({error})")),
        }
    }

    /// An error of the table as a whole.
    #[must_use]
    pub fn wrong(&self, what: impl Display) -> FileError {
        FileError::broken(&self.path, what)
    }
}

fn reader(text: &str) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes())
}

/// One row of a table.
pub struct TableRow<'a> {
    table: &'a NamedTable,
    line: u64,
    cells: csv::StringRecord,
}

impl TableRow<'_> {
    /// The line it stands in, from 1.
    #[must_use]
    pub fn line(&self) -> u64 {
        self.line
    }

    /// What stands in a column.
    #[must_use]
    pub fn text(&self, column: usize) -> &str {
        self.cells.get(column).unwrap_or_default()
    }

    /// The finite number in a column.
    ///
    /// # Errors
    /// [`FileError`] naming file, line and column.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        let text = self.text(column);
        let what = match text.parse::<f64>() {
            Ok(number) if number.is_finite() => return Ok(number),
            Ok(number) if number.is_infinite() => format!("is {}: it must be finite", quote(text)),
            _ if text.is_empty() => "is empty".to_owned(),
            _ => format!("is {}, which is no number", quote(text)),
        };
        let name = quote(self.table.name(column));
        Err(self.wrong(format!("{name} {what}")))
    }

    /// The finite numbers in some columns.
    ///
    /// # Errors
    /// As [`TableRow::number`].
    pub fn numbers<const N: usize>(&self, columns: &[usize; N]) -> Result<[f64; N], FileError> {
        let mut numbers = [0.0; N];
        for (number, &column) in numbers.iter_mut().zip(columns) {
            *number = self.number(column)?;
        }
        Ok(numbers)
    }

    /// An error in this row.
    #[must_use]
    pub fn wrong(&self, what: impl Display) -> FileError {
        self.table.wrong(format!("line {}: {what}", self.line))
    }
}

/// A table that is written.
pub struct Writing(csv::Writer<Vec<u8>>);

impl Writing {
    /// With these columns.
    #[must_use]
    pub fn new(columns: impl IntoIterator<Item = impl AsRef<[u8]>>) -> Self {
        let mut table = Self(csv::Writer::from_writer(Vec::new()));
        table.row(columns);
        table
    }

    /// Adds a row.
    ///
    /// # Panics
    /// When it has not as many cells as there are columns.
    pub fn row(&mut self, cells: impl IntoIterator<Item = impl AsRef<[u8]>>) {
        self.0
            .write_record(cells)
            .expect("as many cells as columns, into memory");
    }

    /// What is written.
    #[must_use]
    pub fn text(self) -> String {
        let bytes = self.0.into_inner().unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_know_their_lines_whatever_ends_them() {
        for end in ["\n", "\r\n"] {
            let text = ["a,b", "1,2", "# a remark", "", "3,4", "5,6"].join(end);
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.csv");
            std::fs::write(&path, format!("\u{feff}{text}")).unwrap();
            let table = NamedTable::read(&path).unwrap();
            let lines: Vec<u64> = table.rows().map(|row| row.unwrap().line()).collect();
            assert_eq!(lines, [2, 5, 6], "{end:?}");
        }
    }
}
