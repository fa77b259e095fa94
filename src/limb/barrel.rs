//! A limb of the kind of the paper's: a barrel-shaped shell with triangular windows, and a frame of rods in the same
//! body.
//!
//! The shell is a lattice laid flat that is bent about y twice, half a wall outwards and half a wall
//! inwards, with walls between the two along windows and ends. The frame grows out of cells that are left
//! open on the inner one. All join along shared points, so that the surface is closed whatever the sizes are.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

pub use super::barrel_spec::{BarrelSpec, FrameSpec};

use super::body::LimbBody;
use super::frame;
use super::lattice::{Foot, LimbLattice, Rim, incircle};
use super::{BoxMm, LimbError, range};
use crate::mesh::TriMesh;

impl BarrelSpec {
    /// The mesh (m) and the box of its support (mm), deterministic.
    ///
    /// # Errors
    /// [`LimbError`] where the parameters do not describe a limb.
    pub fn build(&self) -> Result<(TriMesh, Vec<BoxMm>), LimbError> {
        self.check()?;
        let lattice = LimbLattice::new(self);
        let feet: Vec<[Foot; 2]> = frame::columns(self, &lattice)
            .map(|column| [Rim::Low, Rim::High].map(|end| lattice.foot(column, end)))
            .collect();
        let open: BTreeSet<usize> = feet.iter().flatten().flat_map(|foot| foot.cells).collect();
        let mut body = self.shell(&lattice, &open);
        frame::grow(self, &lattice, &feet, &mut body);
        let positions: Vec<DVec3> = body.points.iter().map(|&p| p / 1000.0).collect();
        let (mesh, _) =
            TriMesh::new(&positions, &body.triangles, 0).map_err(|_| LimbError::Range {
                what: "the element size",
                rule: "above zero and small enough for the windows",
                value: self.element,
            })?;
        Ok((mesh, vec![self.support()]))
    }

    fn bend(&self, flat: DVec2, outwards: f64) -> DVec3 {
        let (sin, cos) = (flat.x / self.radius).sin_cos();
        let radius = self.radius_at(flat.y, outwards);
        DVec3::new(radius * sin, flat.y, radius * cos)
    }

    /// Both faces of the wall, the inner one open where rods grow out of it, and what joins them along all edges.
    fn shell(&self, lattice: &LimbLattice, open: &BTreeSet<usize>) -> LimbBody {
        let mut body = LimbBody::default();
        for outwards in [self.wall / 2.0, -self.wall / 2.0] {
            (body.points).extend(lattice.points.iter().map(|&p| self.bend(p, outwards)));
        }
        let inner = lattice.points.len() as u32;
        // How often an edge is walked along less how often it is walked back.
        let mut walked: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for (cell, &quad) in lattice.quads.iter().enumerate() {
            // Cut alike on both faces, so that the wall is as thick between points as at them.
            let halves = body.halves(quad);
            body.triangles.extend(halves);
            if !open.contains(&cell) {
                let behind = halves.map(|[a, b, c]| [inner + c, inner + b, inner + a]);
                body.triangles.extend(behind);
            }
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) % 4]);
                *walked.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        for ((low, high), way) in walked.into_iter().filter(|&(_, way)| way != 0) {
            let (a, b) = if way > 0 { (low, high) } else { (high, low) };
            body.quad([b, a, inner + a, inner + b]);
        }
        body
    }

    /// The lower rim is clamped all round, below where rods grow from it.
    fn support(&self) -> BoxMm {
        const HAIR: f64 = 0.01;
        let wide = (self.radius + self.wall).ceil();
        let top = self.rim / 4.0;
        [[-wide, -HAIR, -wide], [wide, top, wide]]
    }

    fn check(&self) -> Result<(), LimbError> {
        range(
            "the radius",
            "from 1 to 10000 mm",
            self.radius,
            (1.0..=1e4).contains(&self.radius),
        )?;
        range(
            "the height",
            "from 1 to 10000 mm",
            self.height,
            (1.0..=1e4).contains(&self.height),
        )?;
        range(
            "the radius at the ends",
            "0.5 to 1 of the widest",
            self.ends,
            (0.5..=1.0).contains(&self.ends),
        )?;
        range(
            "the rim",
            "above zero and less than a third of the height",
            self.rim,
            0.0 < self.rim && self.rim < self.height / 3.0,
        )?;
        range(
            "the wall",
            "above zero and at most a fifth of the radius at the ends",
            self.wall,
            0.0 < self.wall && self.wall <= self.radius * self.ends / 5.0,
        )?;
        range(
            "the element size",
            "at least 1/400 of the limb",
            self.element,
            self.element >= self.radius.max(self.height) / 400.0,
        )?;
        self.check_windows()?;
        self.check_frame()
    }

    fn check_windows(&self) -> Result<(), LimbError> {
        range(
            "the number of triangles around",
            "3 to 100",
            self.around as f64,
            (3..=100).contains(&self.around),
        )?;
        range(
            "the number of rows",
            "1 to 100",
            self.rows as f64,
            (1..=100).contains(&self.rows),
        )?;
        range(
            "the corner radius",
            "zero or more",
            self.corner_radius,
            self.corner_radius >= 0.0,
        )?;
        let row = (self.height - 2.0 * self.rim) / self.rows as f64;
        let (_, inside) = incircle([
            DVec2::ZERO,
            DVec2::new(self.pitch(), 0.0),
            DVec2::new(self.pitch() / 2.0, row),
        ]);
        range(
            "the width of the bars",
            "above zero and small enough for windows with such corners",
            self.bar,
            0.0 < self.bar && self.bar / 2.0 + self.corner_radius < 0.95 * inside,
        )
    }

    fn check_frame(&self) -> Result<(), LimbError> {
        let frame = &self.frame;
        range(
            "the number of rods",
            "3 to 6",
            frame.rods as f64,
            (3..=6).contains(&frame.rods),
        )?;
        range(
            "the number of braces",
            "at most 20",
            frame.braces as f64,
            frame.braces <= 20,
        )?;
        range(
            "the radius of the rods",
            "above zero and less than half the rim",
            frame.rod_radius,
            0.0 < frame.rod_radius && frame.rod_radius < self.rim / 2.0,
        )?;
        range(
            "the radius of the braces",
            "above zero and less than that of the rods",
            frame.brace_radius,
            0.0 < frame.brace_radius && frame.brace_radius < frame.rod_radius,
        )?;
        let beside = frame.distance * (PI / frame.rods as f64).sin();
        let rim = self.radius_at(self.rim / 2.0, -self.wall / 2.0);
        range(
            "the distance of the rods from the axis",
            "such that they lie apart and have room to bend towards the rims",
            frame.distance,
            beside > 1.5 * frame.rod_radius && frame.distance + 3.0 * frame.rod_radius < rim,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_barrel_is_one_closed_body_with_its_windows_and_its_frame() {
        let spec = BarrelSpec::default();
        let (mesh, boxes) = spec.build().unwrap();
        assert_eq!(boxes.len(), 1);
        assert_eq!(mesh.boundary_edges().count(), 0);
        let count = |n: usize| n as i64;
        let (v, e, f) = (
            count(mesh.positions().len()),
            count(mesh.edges().len()),
            count(mesh.triangles().len()),
        );
        // A ring, and one handle more for each window, rod and brace.
        let frame = spec.frame.rods * (1 + spec.frame.braces);
        let handles = 1 + count(spec.windows()) + count(frame);
        assert_eq!(v - e + f, 2 - 2 * handles);
    }

    #[test]
    fn the_wall_is_as_thick_as_asked_and_its_ends_are_flat() {
        let spec = BarrelSpec::default();
        let middle = spec.radius_at(10.0, 0.0);
        let (_, slope) = spec.profile(10.0);
        let across = (spec.radius_at(10.0, 0.5) - middle) / slope.hypot(1.0);
        assert!((across - 0.5).abs() < 1e-12, "{across}");
        let (low, high) = spec.build().unwrap().0.bounds();
        assert_eq!([low.y, high.y], [0.0, 0.14]);
    }

    #[test]
    fn the_family_is_closed_whatever_its_sizes() {
        let base = BarrelSpec::default();
        for rods in 3..=6 {
            for (around, rows, element) in [(3, 1, 20.0), (7, 3, 5.0), (10, 5, 3.0)] {
                let spec = BarrelSpec {
                    around,
                    rows,
                    element,
                    bar: 6.0,
                    frame: FrameSpec {
                        rods,
                        braces: rods - 3,
                        ..base.frame.clone()
                    },
                    ..base.clone()
                };
                let (mesh, _) = spec.build().unwrap();
                assert_eq!(mesh.boundary_edges().count(), 0, "{spec:?}");
                assert!(mesh.volume_enclosed() > 0.0);
            }
        }
    }

    #[test]
    fn impossible_barrels_are_refused() {
        let base = BarrelSpec::default();
        let spoilt = [
            BarrelSpec {
                bar: 20.0,
                ..base.clone()
            },
            BarrelSpec {
                element: 0.0,
                ..base.clone()
            },
            BarrelSpec {
                wall: f64::NAN,
                ..base.clone()
            },
            BarrelSpec {
                rim: 70.0,
                ..base.clone()
            },
            BarrelSpec {
                frame: FrameSpec {
                    distance: 33.0,
                    ..base.frame.clone()
                },
                ..base.clone()
            },
        ];
        for spec in spoilt {
            assert!(spec.build().is_err(), "{spec:?}");
        }
    }
}
