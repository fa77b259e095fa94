//! Parts made of bricks: as a closed surface, and as tetrahedra of any fineness that fill the very same part.
//!
//! The tetrahedra share nothing with a grid of cells: neither elements nor quadrature nor how the surface is found.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::immersed::{Fineness, Immersed};
use hapdef::elasticity::{Material, Support};
use hapdef::mesh::TriMesh;
use hapdef::mesh::volume::VolumeMesh;

/// A brick as six tetrahedra around the diagonal from its first corner to its last; corners are counted in binary,
/// x in the lowest bit.
pub const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 5, 1, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 6, 4, 7],
];

/// Bricks between coordinates along three axes, of which some are kept, placed by a map that is linear in each.
pub struct Bricks {
    pub axes: [Vec<f64>; 3],
    pub keep: fn(DVec3) -> bool,
    pub place: fn(DVec3) -> DVec3,
}

impl Bricks {
    /// The same part of bricks of at most these sides (in coordinates).
    fn split(&self, sides: DVec3) -> [Vec<f64>; 3] {
        std::array::from_fn(|axis| {
            let mut all = vec![self.axes[axis][0]];
            for ends in self.axes[axis].windows(2) {
                let n = ((ends[1] - ends[0]) / sides[axis]).ceil().max(1.0) as u32;
                all.extend(
                    (1..=n).map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / f64::from(n)),
                );
            }
            all
        })
    }

    /// Where a point given by coordinates lies: linear between the corners of its brick.
    fn at(&self, c: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let ends: [(f64, f64, f64); 3] = std::array::from_fn(|axis| {
            let all = &self.axes[axis];
            let k = all
                .partition_point(|&x| x <= c[axis])
                .clamp(1, all.len() - 1);
            let (a, b) = (all[k - 1], all[k]);
            (a, b, (c[axis] - a) / (b - a))
        });
        for corner in 0..8 {
            let (mut point, mut weight) = (DVec3::ZERO, 1.0);
            for axis in 0..3 {
                let (a, b, t) = ends[axis];
                let upper = corner >> axis & 1 == 1;
                point[axis] = if upper { b } else { a };
                weight *= if upper { t } else { 1.0 - t };
            }
            sum += (self.place)(point) * weight;
        }
        sum
    }

    /// The part as tetrahedra of bricks of at most these sides (in coordinates).
    pub fn filled(&self, sides: DVec3) -> Arc<TriMesh> {
        let axes = self.split(sides);
        let mut numbers: HashMap<[usize; 3], u32> = HashMap::new();
        let (mut nodes, mut corners) = (Vec::new(), Vec::new());
        let same = |p: DVec3| (p * 1e9).round().to_array().map(|x| x as i64);
        let mut known: HashMap<[i64; 3], u32> = HashMap::new();
        for k in 0..axes[2].len() - 1 {
            for j in 0..axes[1].len() - 1 {
                for i in 0..axes[0].len() - 1 {
                    let at =
                        |c: [usize; 3]| DVec3::new(axes[0][c[0]], axes[1][c[1]], axes[2][c[2]]);
                    if !(self.keep)((at([i, j, k]) + at([i + 1, j + 1, k + 1])) / 2.0) {
                        continue;
                    }
                    let brick: [u32; 8] = std::array::from_fn(|b| {
                        let c = [i + (b & 1), j + (b >> 1 & 1), k + (b >> 2)];
                        *numbers.entry(c).or_insert_with(|| {
                            // Where the part closes on itself two coordinates are one place.
                            let p = self.at(at(c));
                            *known.entry(same(p)).or_insert_with(|| {
                                nodes.push(p);
                                nodes.len() as u32 - 1
                            })
                        })
                    });
                    corners.extend(TETRAHEDRA.map(|t| t.map(|n| brick[n])));
                }
            }
        }
        let volume = VolumeMesh::of_linear(nodes, &corners).checked().unwrap();
        let (piece, surface, _) = volume.body(0).unwrap();
        Arc::new(surface.around(piece))
    }

    /// The part as a closed surface of its bricks' faces.
    pub fn surface(&self) -> Arc<TriMesh> {
        let filled = self.filled(DVec3::INFINITY);
        Arc::new(
            TriMesh::new(filled.positions(), filled.triangles(), 0)
                .unwrap()
                .0,
        )
    }

    /// The model on tetrahedra of bricks of at most these sides.
    pub fn model(&self, sides: DVec3, material: Material, supports: &[Support]) -> SolidModel {
        let part = self.filled(sides);
        let immersed = Immersed::new(&part, material, supports);
        let size = sides.min_element();
        immersed
            .model(&part, &Fineness::of(size, size), &unwatched)
            .unwrap()
    }
}

/// Coordinates of a part that is one brick along an axis.
pub fn ends(a: f64, b: f64) -> Vec<f64> {
    vec![a, b]
}
