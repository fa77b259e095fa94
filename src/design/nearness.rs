//! How far points that somebody gave lie from a part, and whether they can be meant for it.

use glam::DVec3;

use super::DesignError;
use crate::mesh::TriMesh;
use crate::mesh::locate::SurfaceIndex;

/// What lies farther from the part than this share of its size is on no surface of it.
pub const OFF: f64 = 0.05;

/// Whether points can be meant for a part: none lies farther from it than it is large.
///
/// # Errors
/// [`DesignError::OffThePart`] for the first that does; `what` it is.
pub fn check_reach(
    part: &TriMesh,
    what: &'static str,
    points: impl Iterator<Item = DVec3>,
) -> Result<(), DesignError> {
    Nearness::of(part).check(what, points, 1.0)
}

/// Whether points can be meant for the surface of a part: none lies off it by more than [`OFF`] of its size.
///
/// # Errors
/// [`DesignError::OffThePart`] for the first that does; `what` it is.
pub fn check_on_part(
    part: &TriMesh,
    what: &'static str,
    points: impl Iterator<Item = DVec3>,
) -> Result<(), DesignError> {
    Nearness::of(part).check(what, points, OFF)
}

/// How far from a part points lie.
pub struct Nearness<'a> {
    index: &'a SurfaceIndex,
    lower: DVec3,
    upper: DVec3,
    /// Diagonal of the part's box (m).
    pub size: f64,
}

impl<'a> Nearness<'a> {
    /// To this part.
    #[must_use]
    pub fn of(part: &'a TriMesh) -> Self {
        let (lower, upper) = part.bounds();
        Self {
            index: part.index(),
            lower,
            upper,
            size: (upper - lower).length(),
        }
    }

    /// That a point, by its number and what it is, lies so far off (m).
    #[must_use]
    pub fn off(&self, what: &'static str, number: usize, distance: f64) -> DesignError {
        DesignError::OffThePart {
            what,
            number,
            distance,
            size: self.size,
        }
    }

    /// From the part (m); of what is out of reach, from the box around it. The box is asked first: very far
    /// out squares are no numbers any more, and the nearest place is not found.
    #[must_use]
    pub fn distance(&self, point: DVec3) -> f64 {
        if !point.is_finite() {
            return f64::INFINITY;
        }
        let beyond = (point - point.clamp(self.lower, self.upper)).abs();
        let widest = beyond.max_element();
        if widest > self.size {
            widest * (beyond / widest).length()
        } else {
            self.index.nearest(point).1
        }
    }

    /// Refuses the first point that lies farther off than so many sizes of the part.
    fn check(
        &self,
        what: &'static str,
        points: impl Iterator<Item = DVec3>,
        sizes: f64,
    ) -> Result<(), DesignError> {
        for (number, point) in points.enumerate() {
            let distance = self.distance(point);
            if distance > sizes * self.size {
                return Err(self.off(what, number, distance));
            }
        }
        Ok(())
    }
}
