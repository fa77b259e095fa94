//! A closed surface while it is put together: points, triangles, and tubes swept from ring to ring.

use std::collections::BTreeSet;

use glam::DVec3;

/// Corners of the section of a tube. As many points lie around two by two cells of a grid, so that a tube grows out
/// of such a patch without a point of its own.
pub(super) const CORNERS: usize = 8;

/// A section of a tube, anticlockwise against the way it is swept.
pub(super) type Ring = [u32; CORNERS];

/// The steps from a point of a grid to those around it, from the lower left on, anticlockwise.
pub(super) const AROUND: [(isize, isize); CORNERS] = [
    (-1, -1),
    (0, -1),
    (1, -1),
    (1, 0),
    (1, 1),
    (0, 1),
    (-1, 1),
    (-1, 0),
];

/// Points (mm) and triangles that face outward.
#[derive(Default)]
pub(super) struct LimbBody {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl LimbBody {
    /// Adds a point (mm); its number.
    pub fn add(&mut self, point: DVec3) -> u32 {
        self.points.push(point);
        (self.points.len() - 1) as u32
    }

    /// The two triangles of a quadrilateral, cut along its shorter diagonal.
    pub fn halves(&self, [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
        let length = |i: u32, j: u32| self.points[i as usize].distance(self.points[j as usize]);
        // Diagonals of the same length are told alike, whatever rounding made of them.
        if length(a, c) <= length(b, d) * (1.0 + 1e-9) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    }

    /// Adds a quadrilateral as two triangles; its corners run anticlockwise as seen from outside.
    pub fn quad(&mut self, corners: [u32; 4]) {
        let halves = self.halves(corners);
        self.triangles.extend(halves);
    }

    /// A regular section about a centre, its corners where those of [`AROUND`] point along two axes.
    pub fn ring(&mut self, centre: DVec3, [across, up]: [DVec3; 2], radius: f64) -> Ring {
        std::array::from_fn(|i| {
            let angle = (i as f64 - 3.0) * std::f64::consts::FRAC_PI_4;
            let (sin, cos) = angle.sin_cos();
            self.add(centre + radius * (cos * across + sin * up))
        })
    }

    /// The middle of a section's corners.
    pub fn middle(&self, ring: &Ring) -> DVec3 {
        let sum: DVec3 = ring.iter().map(|&p| self.points[p as usize]).sum();
        sum / CORNERS as f64
    }

    /// The wall of a tube through sections, but for what is left open: the side after a corner, after a section.
    pub fn sweep(&mut self, rings: &[Ring], open: &BTreeSet<(usize, usize)>) {
        for (j, pair) in rings.windows(2).enumerate() {
            for i in (0..CORNERS).filter(|&i| !open.contains(&(j, i))) {
                let next = (i + 1) % CORNERS;
                self.quad([pair[0][i], pair[0][next], pair[1][next], pair[1][i]]);
            }
        }
    }
}
