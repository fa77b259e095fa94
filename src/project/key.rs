//! One key of a project file: where it stands, its unit, its range and what it means.

use std::fmt;
use std::ops::RangeInclusive;

/// One key of a project file.
#[derive(Debug)]
pub struct Key {
    /// Its table and its name: `touch.force_n`.
    pub path: &'static str,
    /// Of its value; empty where it has none.
    pub unit: &'static str,
    /// What its value may be.
    pub range: ValueRange,
    /// What it means: part of a sentence that begins with a small letter where it can.
    pub help: &'static str,
}

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueRange {
    /// Numbers, and how far.
    Numbers(Span),
    /// Whole numbers from the first to the second.
    Whole(u64, u64),
    /// One of some words.
    Words(&'static [&'static str]),
    /// Anything of a kind, which is said in words.
    Any(&'static str),
}

/// Numbers between two bounds, each of which belongs to them or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    least: f64,
    most: f64,
    has_least: bool,
    has_most: bool,
}

/// `true` or `false`.
pub(super) const SWITCH: ValueRange = ValueRange::Words(&["true", "false"]);
/// The name of a mask.
pub(super) const MASK: ValueRange = ValueRange::Any(
    "the name of an array in the NPZ file beside the project, or of a group of the mesh file",
);
/// Words for people.
pub(super) const TEXT: ValueRange = ValueRange::Any("a text");

/// Numbers from one to another, both included.
pub(super) const fn from(least: f64, most: f64) -> ValueRange {
    ValueRange::Numbers(Span {
        least,
        most,
        has_least: true,
        has_most: true,
    })
}

/// Numbers above one and up to another.
pub(super) const fn above(least: f64, most: f64) -> ValueRange {
    ValueRange::Numbers(Span {
        least,
        most,
        has_least: false,
        has_most: true,
    })
}

/// Numbers between two, neither of them included.
pub(super) const fn within(least: f64, most: f64) -> ValueRange {
    ValueRange::Numbers(Span {
        least,
        most,
        has_least: false,
        has_most: false,
    })
}

impl Span {
    /// The lower bound.
    #[must_use]
    pub fn least(&self) -> f64 {
        self.least
    }

    /// The upper bound.
    #[must_use]
    pub fn most(&self) -> f64 {
        self.most
    }

    /// Whether a number lies in it; what is no number never does.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        let is_above = value > self.least || (self.has_least && value == self.least);
        let is_below = value < self.most || (self.has_most && value == self.most);
        is_above && is_below
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (least, most) = (number(self.least), number(self.most));
        match (self.has_least, self.has_most) {
            (true, true) => write!(f, "between {least} and {most}"),
            (false, true) => write!(f, "above {least} and at most {most}"),
            (true, false) => write!(f, "at least {least} and below {most}"),
            (false, false) => write!(f, "above {least} and below {most}"),
        }
    }
}

impl fmt::Display for ValueRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers(span) => span.fmt(f),
            Self::Whole(least, most) => write!(f, "whole, between {least} and {most}"),
            Self::Words(words) => f.write_str(&words.join(", ")),
            Self::Any(what) => f.write_str(what),
        }
    }
}

impl Key {
    /// Its table: what stands in brackets above it in the file.
    #[must_use]
    pub fn table(&self) -> &'static str {
        self.path.rsplit_once('.').map_or("", |(table, _)| table)
    }

    /// Its name within the table.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.path
            .rsplit_once('.')
            .map_or(self.path, |(_, name)| name)
    }

    /// The numbers that a control of the window offers: bounds that do not belong to them are stopped short of.
    #[must_use]
    pub fn numbers(&self) -> RangeInclusive<f64> {
        /// Share of the range at which a control stops before a bound.
        const SHORT: f64 = 1e-6;
        match self.range {
            ValueRange::Numbers(span) => {
                let short = |has: bool| {
                    if has {
                        0.0
                    } else {
                        SHORT * (span.most - span.least)
                    }
                };
                span.least + short(span.has_least)..=span.most - short(span.has_most)
            }
            ValueRange::Whole(least, most) => least as f64..=most as f64,
            ValueRange::Words(_) | ValueRange::Any(_) => f64::NEG_INFINITY..=f64::INFINITY,
        }
    }

    /// The whole numbers that a control of the window offers.
    #[must_use]
    pub fn counts(&self) -> RangeInclusive<usize> {
        match self.range {
            ValueRange::Whole(least, most) => least as usize..=most as usize,
            _ => 0..=usize::MAX,
        }
    }

    /// What it means, as a sentence begins.
    #[must_use]
    pub fn sentence(&self) -> String {
        let mut letters = self.help.chars();
        letters.next().map_or_else(String::new, |first| {
            first.to_uppercase().chain(letters).collect()
        })
    }
}

/// A number as people write it: nobody reads three hundred digits.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-4..1e7).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}
