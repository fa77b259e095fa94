//! Boxes that stand as a part does, along directions of their own.

use glam::DVec3;

use super::TriMesh;
use super::stance::{Direction, Stance};
use crate::bounds::Bounds;

/// A box whose edges lie along the front, the right and the up of a stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// The directions of its edges.
    pub stance: Stance,
    /// Its corners (m), in the coordinates of the stance.
    pub lower: DVec3,
    /// Upper corner (m).
    pub upper: DVec3,
}

impl OrientedBox {
    /// A box (m) along the axes of the file.
    #[must_use]
    pub fn of_file(lower: DVec3, upper: DVec3) -> Self {
        Self {
            stance: Stance::default(),
            lower,
            upper,
        }
    }

    /// The box around a part as it stands.
    #[must_use]
    pub fn around(mesh: &TriMesh, stance: Stance) -> Self {
        let places = mesh.positions().iter().map(|&p| stance.coordinates(p));
        let Bounds { lower, upper } = Bounds::around(places);
        Self {
            stance,
            lower,
            upper,
        }
    }

    /// A box that reaches further on all sides (m).
    #[must_use]
    pub fn grown(self, by: f64) -> Self {
        Self {
            lower: self.lower - by,
            upper: self.upper + by,
            ..self
        }
    }

    /// Whether a point lies inside, or within `slack` (m) of it along its edges.
    #[must_use]
    pub fn contains(&self, p: DVec3, slack: f64) -> bool {
        let bounds = Bounds {
            lower: self.lower,
            upper: self.upper,
        };
        bounds.grown(slack).contains(self.stance.coordinates(p))
    }

    /// Its corners (m) in the file's coordinates, where it lies along the axes of the file.
    #[must_use]
    pub fn along_axes(&self) -> Option<(DVec3, DVec3)> {
        self.along(Stance::default())
    }

    /// Its corners (m) in the coordinates of a stance, where it lies along the directions of that.
    #[must_use]
    pub fn along(&self, stance: Stance) -> Option<(DVec3, DVec3)> {
        /// What rounding leaves between two directions that are the same.
        const SAME: f64 = 1e-9;
        let own = |d: &Direction| stance.coordinates(self.stance.direction(*d));
        let lies = |d: &Direction| own(d).abs().max_element() > 1.0 - SAME;
        Direction::ALL.iter().all(lies).then(|| {
            let corner = |c: DVec3| stance.coordinates(self.stance.place(c));
            let [a, b] = [self.lower, self.upper].map(corner);
            (a.min(b), a.max(b))
        })
    }

    /// Its faces where they go through the box around a part, in pieces no larger than `side` (m): the middle of each, the
    /// direction out of the box, and its area (m²).
    #[must_use]
    pub fn pieces_across(&self, part: &TriMesh, side: f64) -> Vec<(DVec3, DVec3, f64)> {
        const MOST: f64 = 512.0;
        let around = Self::around(part, self.stance);
        let (lower, upper) = (self.lower.max(around.lower), self.upper.min(around.upper));
        let pieces = ((upper - lower) / side)
            .ceil()
            .clamp(DVec3::ZERO, DVec3::splat(MOST));
        let step = (upper - lower) / pieces.max(DVec3::ONE);
        let mut found = Vec::new();
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            for (level, outward) in [(self.lower[axis], -1.0), (self.upper[axis], 1.0)] {
                if level <= around.lower[axis] || level >= around.upper[axis] {
                    continue;
                }
                let normal = self.stance.place(DVec3::AXES[axis] * outward);
                for i in 0..pieces[a] as u32 {
                    for j in 0..pieces[b] as u32 {
                        let mut at = DVec3::splat(level);
                        at[a] = lower[a] + (f64::from(i) + 0.5) * step[a];
                        at[b] = lower[b] + (f64::from(j) + 0.5) * step[b];
                        found.push((self.stance.place(at), normal, step[a] * step[b]));
                    }
                }
            }
        }
        found
    }

    /// The mirror image of a point (m), through the middle of the box across one of its directions.
    #[must_use]
    pub fn mirrored(&self, p: DVec3, across: Direction) -> DVec3 {
        let along = self.stance.direction(across);
        p + along * 2.0 * (self.middle(across) - p.dot(along))
    }

    /// How far its middle is along one of its directions (m).
    #[must_use]
    pub fn middle(&self, along: Direction) -> f64 {
        let [low, high] = self.span(along);
        f64::midpoint(low, high)
    }

    /// From where to where it reaches along one of its directions (m).
    #[must_use]
    pub fn span(&self, along: Direction) -> [f64; 2] {
        [self.lower, self.upper].map(|corner| corner[along as usize])
    }
}

impl Stance {
    /// The box around that share of the part's height which is lowest.
    #[must_use]
    pub fn lower_end(&self, mesh: &TriMesh, share: f64) -> OrientedBox {
        let height = |p: DVec3| p.dot(self.up());
        let whole = OrientedBox::around(mesh, *self);
        let level = whole.lower.z + share * (whole.upper.z - whole.lower.z);
        let ends = mesh.edges().iter().flat_map(|edge| {
            let [a, b] = [edge.a, edge.b].map(|v| mesh.positions()[v as usize]);
            let (a, b) = if height(a) < height(b) {
                (a, b)
            } else {
                (b, a)
            };
            let rise = height(b) - height(a);
            let within = if rise > 0.0 {
                ((level - height(a)) / rise).min(1.0)
            } else {
                1.0
            };
            (height(a) <= level)
                .then(|| [a, a.lerp(b, within)])
                .into_iter()
                .flatten()
        });
        let Bounds { lower, upper } = Bounds::around(ends.map(|p| self.coordinates(p)));
        OrientedBox {
            stance: *self,
            lower,
            upper,
        }
    }
}
