//! How a part stands: which way is up for it, and where its front is. Views, unrolling and new boxes go by it.

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::TriMesh;

/// The directions of a part, of unit length and at right angles to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    up: DVec3,
    front: DVec3,
}

impl Stance {
    /// As the part's shape says.
    ///
    /// The axis is the direction that the surface faces least, as a tube's does: unlike the longest principal axis
    /// it does not lean to where a motor or a flange sticks out, and it is found on a short tube too. A direction
    /// of the file's coordinates is taken where it is hardly worse, and of several the longest, z before y before x.
    /// The end with the larger coordinate is up.
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        Self::about(SurfaceMoments::of(mesh).axis())
    }

    /// With a given direction up, of any length. The front of a part that stands along z is x, and so on around.
    #[must_use]
    pub fn about(up: DVec3) -> Self {
        let up = up.normalize_or(DVec3::Z);
        let along = DVec3::AXES[(up.abs().max_position() + 1) % 3];
        let front = (along - up * along.dot(up)).normalize();
        Self { up, front }
    }

    /// The part's axis.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Where somebody stands who looks at the part from in front.
    #[must_use]
    pub fn front(&self) -> DVec3 {
        self.front
    }

    /// To the right for who looks at the part from in front.
    #[must_use]
    pub fn right(&self) -> DVec3 {
        self.up.cross(self.front)
    }

    /// One of its directions, of unit length.
    #[must_use]
    pub fn direction(&self, direction: Direction) -> DVec3 {
        match direction {
            Direction::Front => self.front,
            Direction::Right => self.right(),
            Direction::Up => self.up,
        }
    }

    /// How far a point or a vector reaches to the front, to the right and up. For a part that stands along z these are
    /// its x, y and z.
    #[must_use]
    pub fn coordinates(&self, p: DVec3) -> DVec3 {
        DVec3::from_array(Direction::ALL.map(|d| self.direction(d).dot(p)))
    }

    /// The point or vector of such coordinates.
    #[must_use]
    pub fn place(&self, coordinates: DVec3) -> DVec3 {
        self.front * coordinates.x + self.right() * coordinates.y + self.up * coordinates.z
    }
}

/// As the axes of the file.
impl Default for Stance {
    fn default() -> Self {
        Self::about(DVec3::Z)
    }
}

/// The directions of a part, in the order of their coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Towards who looks at its front.
    Front,
    /// To the right of who looks at its front.
    Right,
    /// Upwards.
    Up,
}

impl Direction {
    /// All three, in the order of the coordinates.
    pub const ALL: [Self; 3] = [Self::Front, Self::Right, Self::Up];
}

/// Means over a surface.
struct SurfaceMoments {
    /// Of n nᵀ: along a direction, how much the surface faces it.
    facing: Matrix3<f64>,
    /// Of r rᵀ about the middle, in parts of the size: along a direction, its spread squared.
    spread: Matrix3<f64>,
}

impl SurfaceMoments {
    fn of(mesh: &TriMesh) -> Self {
        let (lower, upper) = mesh.bounds();
        let (middle, size) = ((lower + upper) / 2.0, (upper - lower).max_element());
        let (mut facing, mut spread) = (Matrix3::zeros(), Matrix3::zeros());
        let mut sum = Vector3::zeros();
        for t in 0..mesh.triangles().len() as u32 {
            let weight = mesh.facet_area(t) / mesh.area();
            let normal = vector(mesh.facet_normal(t));
            facing += normal * normal.transpose() * weight;
            let corners = mesh.corners(t).map(|p| vector((p - middle) / size));
            let total = corners[0] + corners[1] + corners[2];
            sum += total * (weight / 3.0);
            // Exact for a triangle: the mean of r rᵀ by its corners and their sum.
            let own: Matrix3<f64> = corners.iter().map(|c| c * c.transpose()).sum();
            spread += (own + total * total.transpose()) * (weight / 12.0);
        }
        Self {
            facing,
            spread: spread - sum * sum.transpose(),
        }
    }

    fn axis(&self) -> DVec3 {
        /// What a direction may be faced more than the one that is faced least, as a share of all. On a tube that
        /// is 8°: real limbs, which are no tubes, lean by less from how they were drawn.
        const HARDLY: f64 = 0.01;
        let eigen = SymmetricEigen::new(self.facing);
        let mut order = [0_usize, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let [least, next] = [order[0], order[1]].map(|k| eigen.eigenvalues[k]);
        let [first, second] = [order[0], order[1]].map(|k| {
            let v = eigen.eigenvectors.column(k);
            DVec3::new(v[0], v[1], v[2])
        });
        let free = |d: &DVec3| along(&self.facing, *d) <= least + HARDLY;
        let coordinate = [DVec3::Z, DVec3::Y, DVec3::X].into_iter().filter(free);
        if let Some(axis) = self.longest(&coordinate.collect::<Vec<_>>()) {
            return axis;
        }
        let axis = if next - least > HARDLY {
            first
        } else {
            self.longest_between(first, second)
        };
        if axis[axis.abs().max_position()] < 0.0 {
            -axis
        } else {
            axis
        }
    }

    /// The first direction that the part is about as long in as in any of them.
    fn longest(&self, directions: &[DVec3]) -> Option<DVec3> {
        /// Lengths that differ by less (5 %) are as good as each other: squared.
        const ABOUT: f64 = 1.1;
        let most = (directions.iter())
            .map(|&d| along(&self.spread, d))
            .fold(0.0, f64::max);
        (directions.iter().copied()).find(|&d| ABOUT * along(&self.spread, d) >= most)
    }

    /// Of all directions in a plane the longest; where all are about as long, the one that is nearest to z.
    fn longest_between(&self, a: DVec3, b: DVec3) -> DVec3 {
        let (aa, bb) = (along(&self.spread, a), along(&self.spread, b));
        let ab = vector(a).dot(&(self.spread * vector(b)));
        if (aa - bb).hypot(2.0 * ab) > 0.05 * (aa + bb) {
            let angle = 0.5 * (2.0 * ab).atan2(aa - bb);
            return a * angle.cos() + b * angle.sin();
        }
        let within = |d: DVec3| a * a.dot(d) + b * b.dot(d);
        // Of two directions at right angles one is at least half within any plane.
        let [z, y] = [DVec3::Z, DVec3::Y].map(within);
        let axis = if z.length() > 0.5 { z } else { y };
        axis.normalize_or(a)
    }
}

/// dᵀ M d.
fn along(moments: &Matrix3<f64>, d: DVec3) -> f64 {
    vector(d).dot(&(moments * vector(d)))
}

fn vector(d: DVec3) -> Vector3<f64> {
    Vector3::new(d.x, d.y, d.z)
}
