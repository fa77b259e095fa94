//! A sheet and what is drawn on it.

use std::str::FromStr;

use glam::{DVec2, Vec2Swizzles as _};

use super::text::{Typeface, width_mm};

/// Sizes of sheets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SheetSize {
    /// 210 × 297 mm.
    #[default]
    A4,
    /// 8½ × 11 inches.
    Letter,
}

impl SheetSize {
    /// Width and height (mm).
    #[must_use]
    pub fn size(self) -> DVec2 {
        match self {
            Self::A4 => DVec2::new(210.0, 297.0),
            Self::Letter => DVec2::new(215.9, 279.4),
        }
    }
}

impl FromStr for SheetSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().as_str() {
            "a4" => Ok(Self::A4),
            "letter" => Ok(Self::Letter),
            _ => Err("sheets are a4 or letter".into()),
        }
    }
}

/// Red, green, blue.
pub type Ink = [u8; 3];

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetLine {
    /// Its colour.
    pub ink: Ink,
    /// mm.
    pub width: f64,
    /// Lengths of its pieces and of what is between them (mm); none for a whole line.
    pub dash: Option<[f64; 2]>,
}

impl SheetLine {
    /// A whole line.
    #[must_use]
    pub const fn new(ink: Ink, width: f64) -> Self {
        let dash = None;
        Self { ink, width, dash }
    }
}

/// Where words stand about their place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// They begin there.
    Left,
    /// Their middle is there.
    Middle,
    /// They end there.
    Right,
}

/// Words on one line.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedWords {
    /// Of their base line (mm).
    pub at: DVec2,
    /// What they say.
    pub text: String,
    /// Height of the type (mm).
    pub size: f64,
    /// Their typeface.
    pub face: Typeface,
    /// Their colour.
    pub ink: Ink,
    /// How they stand about their place.
    pub align: Align,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Lines from point to point (mm).
    Path {
        /// In their order.
        points: Vec<DVec2>,
        /// Whether the last is joined to the first.
        closed: bool,
        /// What is inside.
        fill: Option<Ink>,
        /// Along it.
        line: Option<SheetLine>,
    },
    /// Words.
    Words(PlacedWords),
}

/// A sheet of paper: places are millimetres from its upper left corner, to the right and down.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Width and height (mm).
    pub size: DVec2,
    /// What is drawn, one over the other.
    pub items: Vec<Item>,
}

impl Sheet {
    /// An empty one.
    #[must_use]
    pub fn new(format: SheetSize) -> Self {
        Self {
            size: format.size(),
            items: Vec::new(),
        }
    }

    /// An empty one that lies on its side.
    #[must_use]
    pub fn lying(format: SheetSize) -> Self {
        Self {
            size: format.size().yx(),
            items: Vec::new(),
        }
    }

    /// A line through points.
    pub fn line(&mut self, points: impl IntoIterator<Item = DVec2>, line: SheetLine) {
        self.items.push(Item::Path {
            points: points.into_iter().collect(),
            closed: false,
            fill: None,
            line: Some(line),
        });
    }

    /// A closed shape.
    pub fn shape(
        &mut self,
        points: impl IntoIterator<Item = DVec2>,
        fill: Option<Ink>,
        line: Option<SheetLine>,
    ) {
        self.items.push(Item::Path {
            points: points.into_iter().collect(),
            closed: true,
            fill,
            line,
        });
    }

    /// A circle, as a polygon that is within a hundredth of a millimetre of one.
    pub fn circle(&mut self, at: DVec2, radius: f64, fill: Option<Ink>, line: Option<SheetLine>) {
        const OFF: f64 = 0.01;
        let sides = (std::f64::consts::PI / (2.0 * OFF / radius.max(OFF)).sqrt()).ceil();
        let sides = sides.clamp(12.0, 360.0) as usize;
        let corner = |k: usize| {
            at + radius * DVec2::from_angle(std::f64::consts::TAU * k as f64 / sides as f64)
        };
        self.shape((0..sides).map(corner), fill, line);
    }

    /// Words; where they end (mm from the left).
    pub fn words(&mut self, words: PlacedWords) -> f64 {
        let end = words.at.x + width_mm(&words.text, words.size, words.face);
        self.items.push(Item::Words(words));
        end
    }

    /// Plain words from a place on.
    pub fn say(&mut self, at: DVec2, text: &str, size: f64, align: Align) {
        self.words(PlacedWords {
            at,
            text: text.to_owned(),
            size,
            face: Typeface::Text,
            ink: [0x1d, 0x24, 0x30],
            align,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_round_to_a_hundredth() {
        let mut sheet = Sheet::new(SheetSize::A4);
        sheet.circle(DVec2::new(50.0, 50.0), 20.0, None, None);
        let Item::Path { points, .. } = &sheet.items[0] else {
            panic!()
        };
        let middle = (points[0] + points[1]) / 2.0;
        assert!(middle.distance(DVec2::splat(50.0)) > 20.0 - 0.011);
        assert_eq!("Letter".parse::<SheetSize>(), Ok(SheetSize::Letter));
        assert!("a3".parse::<SheetSize>().is_err());
    }
}
