//! Where something stands in a file.

use std::fmt;

/// A line of a text, counted from 1, or a byte of what is no text, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Line(usize),
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// An element as its file names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    pub number: u64,
    pub place: Place,
}

impl Origin {
    /// Of an element that begins in a line.
    #[must_use]
    pub fn in_line(number: u64, line: usize) -> Self {
        Self {
            number,
            place: Place::Line(line),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, element {}", self.place, self.number)
    }
}
