//! Lines of fields of fixed width, as a Fortran format like (3i9,6e21.13e3) says.

use crate::io::mesh_file::words::{at, fortran, signed};
use crate::plain::quote;

/// Most fields of a line, and characters of a field.
const MOST: usize = 200;

/// The widths of the fields of a line: whole numbers first.
#[derive(Debug, PartialEq)]
pub struct FieldWidths {
    whole: Vec<usize>,
    real: Vec<usize>,
}

impl FieldWidths {
    /// Of the line that says it.
    ///
    /// # Errors
    /// A message naming the line that is no such format.
    pub fn of(text: &str, line: usize) -> Result<Self, String> {
        Self::parsed(text.trim()).ok_or_else(|| {
            at(
                line,
                &format!(
                    "{} is no format of fields that is read, such as (3i9,6e21.13e3) or (19i9)",
                    quote(text.trim())
                ),
            )
        })
    }

    fn parsed(text: &str) -> Option<Self> {
        let inner = text.strip_prefix('(')?.strip_suffix(')')?;
        let mut format = Self {
            whole: Vec::new(),
            real: Vec::new(),
        };
        for run in inner.split(',').map(str::trim) {
            let letter = run.find(|c: char| c.is_ascii_alphabetic())?;
            let count: usize = match &run[..letter] {
                "" => 1,
                digits => digits.parse().ok()?,
            };
            let after = &run[letter + 1..];
            let digits = after.split('.').next()?;
            let width: usize = digits.parse().ok()?;
            let runs = match run[letter..].chars().next()?.to_ascii_lowercase() {
                'i' if format.real.is_empty() => &mut format.whole,
                'e' | 'f' | 'g' | 'd' => &mut format.real,
                _ => return None,
            };
            if count > MOST || !(1..=MOST).contains(&width) || runs.len() + count > MOST {
                return None;
            }
            runs.extend(std::iter::repeat_n(width, count));
        }
        Some(format).filter(|format| !format.whole.is_empty())
    }

    /// How many numbers follow the whole ones at most.
    #[must_use]
    pub fn real_fields(&self) -> usize {
        self.real.len()
    }

    /// The numbers of a line: whole ones, then others. What is left blank between is zero; fields after the last that
    /// is filled are not there.
    ///
    /// # Errors
    /// A message naming the line.
    pub fn numbers(&self, text: &str, line: usize) -> Result<(Vec<i64>, Vec<f64>), String> {
        let text = text.trim_end();
        let mut start = 0;
        let mut field = |width: &usize| -> Option<Result<&str, String>> {
            (start < text.len()).then(|| {
                let end = (start + width).min(text.len());
                let field = text.get(start..end);
                start = end;
                field.map(str::trim).ok_or_else(|| {
                    at(
                        line,
                        "it holds bytes that are no text: the file is damaged there",
                    )
                })
            })
        };
        let mut whole = Vec::with_capacity(self.whole.len());
        for word in self.whole.iter().map_while(&mut field) {
            whole.push(match word? {
                "" => 0,
                word => signed(word, line)?,
            });
        }
        let mut real = Vec::with_capacity(self.real.len());
        for word in self.real.iter().map_while(&mut field) {
            real.push(match word? {
                "" => 0.0,
                word => fortran(word, line)?,
            });
        }
        if start < text.len() {
            return Err(at(
                line,
                "it holds more than the format of its block has fields for",
            ));
        }
        Ok((whole, real))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_of_ansys_are_read() {
        let nodes = FieldWidths::of("(1i9,3e20.9e3)", 1).unwrap();
        assert_eq!(nodes.whole, [9]);
        assert_eq!(nodes.real, [20; 3]);
        assert_eq!(FieldWidths::of(" (19i9)", 1).unwrap().whole, [9; 19]);
        assert_eq!(FieldWidths::of("(i10)", 1).unwrap().whole, [10]);
        for bad in [
            "",
            "()",
            "(9)",
            "(i)",
            "(999999999i9)",
            "(i0)",
            "(3e20.9)",
            "(i9,a8)",
            "N,1,0,0",
        ] {
            let said = FieldWidths::of(bad, 7).unwrap_err();
            assert!(said.starts_with("line 7"), "{said}");
        }
    }

    #[test]
    fn blanks_are_zero_and_missing_ends_are_missing() {
        let format = FieldWidths::of("(2i4,2e8.2)", 1).unwrap();
        let numbers = |text: &str| format.numbers(text, 5);
        assert_eq!(
            numbers("   1  -2    1.50 1.0D+01"),
            Ok((vec![1, -2], vec![1.5, 10.0]))
        );
        assert_eq!(numbers("   1"), Ok((vec![1], vec![])));
        assert_eq!(numbers("       2"), Ok((vec![0, 2], vec![])));
        assert!(numbers("   1   x").unwrap_err().contains("line 5"));
        assert!(numbers("   1   2     nan").is_err());
        assert!(numbers("   1   2     1.0     2.0     3.0").is_err());
        assert!(numbers("  é1   2").is_err());
    }
}
