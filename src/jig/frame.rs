//! Where a rod runs.

use glam::{DMat3, DVec2, DVec3};

use crate::mesh::stance::Stance;
use crate::units;

/// The end of the part that a jig is brought in at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Entry {
    /// The lower.
    Foot,
    /// The upper.
    Top,
}

impl Entry {
    /// As it is called in a sentence.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Foot => "foot",
            Self::Top => "top",
        }
    }
}

/// Millimetres from the middle of an opening: z along the rod into the part, x to the part's front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JigFrame {
    origin: DVec3,
    turn: DMat3,
}

impl JigFrame {
    /// At an end of a part, on a line beside its middle. `middle` and `end` are in the stance's coordinates (m): where the line
    /// runs, and how high the end is.
    #[must_use]
    pub fn at(entry: Entry, stance: Stance, middle: DVec2, end: f64) -> Self {
        let (x, z) = match entry {
            Entry::Foot => (stance.front(), stance.up()),
            Entry::Top => (stance.front(), -stance.up()),
        };
        Self {
            origin: stance.place(middle.extend(end)),
            turn: DMat3::from_cols(x, z.cross(x), z),
        }
    }

    /// The same beside it (mm along x and y).
    #[must_use]
    pub fn beside(&self, by: DVec2) -> Self {
        Self {
            origin: self.out_of(by.extend(0.0)),
            turn: self.turn,
        }
    }

    /// A point of the part (m) here (mm).
    #[must_use]
    pub fn here(&self, point: DVec3) -> DVec3 {
        units::mm(self.way(point - self.origin))
    }

    /// A direction of the part here.
    #[must_use]
    pub fn way(&self, direction: DVec3) -> DVec3 {
        self.turn.transpose() * direction
    }

    /// A point from here (mm) in the part (m).
    #[must_use]
    pub fn out_of(&self, point: DVec3) -> DVec3 {
        self.origin + units::from_mm(self.turn * point)
    }

    /// A direction from here in the part.
    #[must_use]
    pub fn way_out(&self, direction: DVec3) -> DVec3 {
        self.turn * direction
    }
}
