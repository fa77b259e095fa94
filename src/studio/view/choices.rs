//! What can be chosen in the window: plain values with their names.

use std::collections::BTreeMap;

use egui::{Pos2, Vec2};
use glam::DVec3;

use crate::mesh::SurfacePoint;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::stance::Direction;
use crate::render::camera::Preset;
use crate::session::Ends;

/// One of the views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pane {
    Limb,
    Unrolled,
}

/// What is shown below the views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    #[default]
    Error,
    Failures,
    Compare,
    Gauges,
    Confusions,
    Reduction,
    Trade,
    Study,
    Live,
    Jobs,
}

impl Tab {
    pub const ALL: [Self; 10] = [
        Self::Error,
        Self::Failures,
        Self::Compare,
        Self::Gauges,
        Self::Confusions,
        Self::Reduction,
        Self::Trade,
        Self::Study,
        Self::Live,
        Self::Jobs,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "Error",
            Self::Failures => "Failures",
            Self::Compare => "Compare",
            Self::Gauges => "Gauge table",
            Self::Confusions => "Confusions",
            Self::Reduction => "Reduction",
            Self::Trade => "Trade",
            Self::Study => "Study",
            Self::Live => "Strains",
            Self::Jobs => "Jobs",
        }
    }

    /// Whether it shows what a design found.
    #[must_use]
    pub fn is_of_design(self) -> bool {
        matches!(self, Self::Error | Self::Failures | Self::Reduction)
    }
}

/// What colours the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Field {
    #[default]
    Region,
    Strain,
    Displacement,
    SignalToNoise,
    Error,
    /// By matching, of the gauges as they are; what they are blind to is marked.
    Expected,
    Uncertainty,
    Faces,
    Thickness,
}

impl Field {
    pub const ALL: [Self; 9] = [
        Self::Region,
        Self::Strain,
        Self::Displacement,
        Self::SignalToNoise,
        Self::Error,
        Self::Expected,
        Self::Uncertainty,
        Self::Faces,
        Self::Thickness,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Region => "Regions",
            Self::Strain => "Strain, inside",
            Self::Displacement => "Displacement",
            Self::SignalToNoise => "Signal to noise",
            Self::Error => "Localization error",
            Self::Expected => "Expected error",
            Self::Uncertainty => "GP variance",
            Self::Faces => "Faces",
            Self::Thickness => "Wall thickness",
        }
    }
}

/// Ranges of the colours that stay whatever the values are, in the legend's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges(BTreeMap<Field, (f64, f64)>);

impl Ranges {
    #[must_use]
    pub fn of(&self, field: Field) -> Option<(f64, f64)> {
        self.0.get(&field).copied()
    }

    /// Fixes a range, or lets it go. Bounds that are no numbers, endless or equal can be typed, but nothing can be
    /// coloured by them: they leave the range before.
    pub fn set(&mut self, field: Field, range: Option<(f64, f64)>) {
        match range {
            Some((low, high)) if (high - low).is_finite() && low != high => {
                self.0.insert(field, (low, high));
            }
            Some(_) => {}
            None => drop(self.0.remove(&field)),
        }
    }
}

/// What the pointer does on the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Touch,
    Gauges,
    Paint,
    Erase,
    Box,
    Lasso,
    Measure,
}

impl Tool {
    pub const ALL: [Self; 7] = [
        Self::Touch,
        Self::Gauges,
        Self::Paint,
        Self::Erase,
        Self::Box,
        Self::Lasso,
        Self::Measure,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "Touch",
            Self::Gauges => "Gauges",
            Self::Paint => "Paint",
            Self::Erase => "Erase",
            Self::Box => "Box",
            Self::Lasso => "Lasso",
            Self::Measure => "Measure",
        }
    }

    /// Whether it changes what is painted.
    #[must_use]
    pub fn paints(self) -> bool {
        matches!(self, Self::Paint | Self::Erase | Self::Box | Self::Lasso)
    }

    /// Whether it has a radius.
    #[must_use]
    pub fn is_brush(self) -> bool {
        matches!(self, Self::Paint | Self::Erase)
    }

    /// Whether a drag with the left button is its own and not a look around.
    #[must_use]
    pub fn drags(self) -> bool {
        self.paints() || self == Self::Gauges
    }
}

/// What is under way between pressing and letting go.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Gesture {
    #[default]
    None,
    /// A stroke, and where its last dab was.
    Stroke(Pane, Pos2),
    /// The outline drawn so far.
    Outline(Pane, Vec<Pos2>),
    /// A gauge that is moved, by its number from zero, and where it was taken.
    Gauge(Pane, usize, Pos2),
}

/// A way on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScreenWay {
    Left,
    Right,
    Up,
    Down,
}

impl ScreenWay {
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Up, Self::Down];

    #[must_use]
    pub fn vector(self) -> Vec2 {
        match self {
            Self::Left => Vec2::LEFT,
            Self::Right => Vec2::RIGHT,
            Self::Up => Vec2::UP,
            Self::Down => Vec2::DOWN,
        }
    }
}

/// What is cut away so that the inside can be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// The side of the part that is cut away.
    pub side: Direction,
    /// That way, of unit length, and from where on (m).
    pub normal: DVec3,
    pub offset: f64,
    /// Cut away the other side instead.
    pub flip: bool,
}

impl SectionPlane {
    /// One half of a part, of which the box around it is given.
    #[must_use]
    pub fn halving(part: &OrientedBox, side: Direction, flip: bool) -> Self {
        Self {
            side,
            normal: part.stance.direction(side),
            offset: part.middle(side),
            flip,
        }
    }

    /// Normal n and d: what has n·p > d is cut away.
    #[must_use]
    pub fn plane(&self) -> (DVec3, f64) {
        let sign = if self.flip { -1.0 } else { 1.0 };
        (self.normal * sign, self.offset * sign)
    }

    #[must_use]
    pub fn cuts(&self, p: DVec3) -> bool {
        let (normal, d) = self.plane();
        normal.dot(p) > d
    }
}

/// The points that were clicked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    pub from: Option<SurfacePoint>,
    pub to: Option<SurfacePoint>,
}

impl Measure {
    /// Both of them.
    #[must_use]
    pub fn ends(&self) -> Option<Ends> {
        Some(Ends {
            from: self.from?,
            to: self.to?,
        })
    }

    /// Takes the next point: the first, the second, or the first of a new measurement.
    pub fn take(&mut self, place: Option<SurfacePoint>) {
        if self.from.is_some() && self.to.is_none() && place.is_some() {
            self.to = place;
        } else {
            (self.from, self.to) = (place, None);
        }
    }
}

/// What is asked of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The side to look from; three-quarters from above where there is none.
    pub view: Option<Preset>,
    pub backdrop: Backdrop,
    /// What is below it, unless a window shows that.
    pub floor: Floor,
}

/// What is below the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Floor {
    /// Its shadow, as if it stood there.
    #[default]
    Shadow,
    Nothing,
}

impl Floor {
    #[must_use]
    pub fn toggled(self) -> Self {
        match self {
            Self::Shadow => Self::Nothing,
            Self::Nothing => Self::Shadow,
        }
    }
}

/// What is behind the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backdrop {
    /// As in the window.
    #[default]
    Window,
    Dark,
    /// A light grey that prints well.
    Neutral,
    /// Nothing.
    Transparent,
}

impl Backdrop {
    pub const ALL: [Self; 4] = [Self::Window, Self::Dark, Self::Neutral, Self::Transparent];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Window => "As in the window",
            Self::Dark => "Dark",
            Self::Neutral => "Neutral",
            Self::Transparent => "Transparent",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_nothing_can_be_coloured_by_leave_the_range_before() {
        let field = Field::Strain;
        let mut ranges = Ranges::default();
        ranges.set(field, Some((f64::NAN, 1.0)));
        assert_eq!(ranges.of(field), None);
        ranges.set(field, Some((-2.0, 3.0)));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            ranges.set(field, Some((bad, 3.0)));
            ranges.set(field, Some((-2.0, bad)));
        }
        ranges.set(field, Some((f64::MIN, f64::MAX)));
        ranges.set(field, Some((3.0, 3.0)));
        assert_eq!(ranges.of(field), Some((-2.0, 3.0)));
        ranges.set(field, None);
        assert_eq!(ranges.of(field), None);
    }
}
