//! Where something stands in a file.

use std::fmt;

/// A line of a text, counted from 1, or a byte of what is no text, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePlace {
    Line(usize),
    Byte(usize),
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// An element as its file names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ElementName {
    pub number: u64,
    pub place: FilePlace,
}

impl ElementName {
    /// Of an element that begins in a line.
    #[must_use]
    pub fn in_line(number: u64, line: usize) -> Self {
        Self {
            number,
            place: FilePlace::Line(line),
        }
    }
}

impl fmt::Display for ElementName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, element {}", self.place, self.number)
    }
}
