//! Boxes along the axes.

use glam::DVec3;

/// A box by its corners, in whatever unit they have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub lower: DVec3,
    pub upper: DVec3,
}

impl Bounds {
    /// Around nothing: it grows by every point that is put into it.
    pub const NOTHING: Self = Self {
        lower: DVec3::INFINITY,
        upper: DVec3::NEG_INFINITY,
    };

    /// The smallest around some points.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::NOTHING, Self::with)
    }

    /// With any two corners that lie opposite each other.
    #[must_use]
    pub fn between(corners: [DVec3; 2]) -> Self {
        Self::around(corners)
    }

    /// The smallest around this one and a point.
    #[must_use]
    pub fn with(self, point: DVec3) -> Self {
        Self {
            lower: self.lower.min(point),
            upper: self.upper.max(point),
        }
    }

    /// One that reaches further on all sides.
    #[must_use]
    pub fn grown(self, by: f64) -> Self {
        Self {
            lower: self.lower - by,
            upper: self.upper + by,
        }
    }

    /// Its edges.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.upper - self.lower
    }

    /// Whether a point lies inside or on its faces.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.lower).all() && point.cmple(self.upper).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_belong_to_a_box() {
        let corners = [DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 2.0, 3.0)];
        let bounds = Bounds::between(corners);
        assert_eq!(bounds.size(), DVec3::new(1.0, 3.0, 3.0));
        assert!(corners.iter().all(|&c| bounds.contains(c)));
        assert!(!bounds.contains(DVec3::new(1.1, 0.0, 1.0)));
        assert!(bounds.grown(0.2).contains(DVec3::new(1.1, 0.0, 1.0)));
        assert!(!Bounds::NOTHING.contains(DVec3::ZERO));
    }
}
