//! The numbers after the header of a PLY file, one after the other, whatever their form.

use std::str::{Lines, SplitAsciiWhitespace};

use super::super::words::{at, number};
use super::header::{Form, PlyHeader, Scalar};
use crate::plain::{lines_before, quote};

pub struct Values<'b> {
    source: ValueSource<'b>,
    /// The element that is being read, and its number from 0.
    element: String,
    index: usize,
}

enum ValueSource<'b> {
    /// One element a line.
    Text {
        lines: Lines<'b>,
        words: SplitAsciiWhitespace<'b>,
        line: usize,
    },
    Binary {
        rest: &'b [u8],
        big_endian: bool,
    },
}

impl<'b> Values<'b> {
    pub fn of(body: &'b [u8], header: &PlyHeader) -> Result<Self, String> {
        let source = if header.form == Form::Text {
            let text = str::from_utf8(body).map_err(|e| {
                let line = header.lines + 1 + lines_before(body, e.valid_up_to());
                at(line, "this is not text")
            })?;
            ValueSource::Text {
                lines: text.lines(),
                words: "".split_ascii_whitespace(),
                line: header.lines,
            }
        } else {
            ValueSource::Binary {
                rest: body,
                big_endian: header.form == Form::BigEndian,
            }
        };
        Ok(Self {
            source,
            element: String::new(),
            index: 0,
        })
    }

    /// Goes to the next element.
    pub fn begin(&mut self, element: &str, index: usize) -> Result<(), String> {
        if index == 0 {
            element.clone_into(&mut self.element);
        }
        self.index = index;
        let ValueSource::Text { lines, words, line } = &mut self.source else {
            return Ok(());
        };
        for row in lines.by_ref() {
            *line += 1;
            if !row.trim_ascii().is_empty() {
                *words = row.split_ascii_whitespace();
                return Ok(());
            }
        }
        Err(self.wrong("is missing: the PLY file is truncated"))
    }

    /// The next number of the element.
    pub fn next(&mut self, scalar: Scalar) -> Result<f64, String> {
        let value = match &mut self.source {
            ValueSource::Text { words, line, .. } => {
                words.next().map(|word| number(word, *line)).transpose()?
            }
            ValueSource::Binary { rest, big_endian } => {
                let data = *rest;
                data.split_at_checked(scalar.size()).map(|(own, after)| {
                    *rest = after;
                    decoded(own, scalar, *big_endian)
                })
            }
        };
        value.ok_or_else(|| self.wrong("ends too early: the PLY file is truncated"))
    }

    /// The next list of the element.
    pub fn list(&mut self, count: Scalar, scalar: Scalar) -> Result<Vec<f64>, String> {
        let entries = self.next(count)?;
        if entries < 0.0 || entries.fract() != 0.0 {
            return Err(self.wrong(&format!("has a list of {entries} entries")));
        }
        // No more is laid out than there is.
        let mut list = Vec::new();
        for _ in 0..entries as u64 {
            list.push(self.next(scalar)?);
        }
        Ok(list)
    }

    /// Whether the element is at its end.
    pub fn finish(&mut self) -> Result<(), String> {
        let ValueSource::Text { words, .. } = &mut self.source else {
            return Ok(());
        };
        match words.next() {
            None => Ok(()),
            Some(word) => {
                let said = format!("goes on with {} where it should end", quote(word));
                Err(self.wrong(&said))
            }
        }
    }

    /// Whether the file is at its end.
    pub fn end(&mut self) -> Result<(), String> {
        match &mut self.source {
            ValueSource::Text { lines, line, .. } => {
                for row in lines.by_ref() {
                    *line += 1;
                    if !row.trim_ascii().is_empty() {
                        return Err(at(
                            *line,
                            "the file goes on, but its header announces no more: its numbers of elements are too small",
                        ));
                    }
                }
                Ok(())
            }
            // Some writers end with a line break, or fill up with zeros.
            ValueSource::Binary { rest, .. }
                if rest.iter().all(|b| *b == 0 || b.is_ascii_whitespace()) =>
            {
                Ok(())
            }
            ValueSource::Binary { rest, .. } => Err(format!(
                "the file goes on for {} bytes, but its header announces no more: its numbers of elements are too small",
                rest.len()
            )),
        }
    }

    /// What is wrong with the element that is being read, with its place.
    pub fn wrong(&self, what: &str) -> String {
        let said = format!("{} {} {what}", plain_name(&self.element), self.index);
        match &self.source {
            ValueSource::Text { line, .. } => at(*line, &said),
            ValueSource::Binary { .. } => said,
        }
    }
}

/// The name of an element: those of the format as they are, others are what the file says.
fn plain_name(name: &str) -> String {
    match name {
        "vertex" | "face" => name.to_owned(),
        _ => quote(name),
    }
}

fn decoded(bytes: &[u8], scalar: Scalar, big_endian: bool) -> f64 {
    let mut word = [0; 8];
    // The number's bytes come first, the lowest before the others.
    for (to, from) in word.iter_mut().zip(bytes) {
        *to = *from;
    }
    if big_endian {
        word[..bytes.len()].reverse();
    }
    let [a, b, c, d, ..] = word;
    match scalar {
        Scalar::I8 => i8::from_le_bytes([a]).into(),
        Scalar::U8 => a.into(),
        Scalar::I16 => i16::from_le_bytes([a, b]).into(),
        Scalar::U16 => u16::from_le_bytes([a, b]).into(),
        Scalar::I32 => i32::from_le_bytes([a, b, c, d]).into(),
        Scalar::U32 => u32::from_le_bytes([a, b, c, d]).into(),
        Scalar::F32 => f32::from_le_bytes([a, b, c, d]).into(),
        Scalar::F64 => f64::from_le_bytes(word),
    }
}
