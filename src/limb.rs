//! The families of limbs that the bundled ones belong to: a lattice tube of columns and hoops, and a barrel of
//! triangles with a frame inside ([`barrel`]).
//!
//! The tube is written in unrolled coordinates (s around, z up, in mm here, as a designer would state them) and
//! bent into a tube. The bundled limb was chosen by measurement among thirty of these.

use glam::{DVec2, DVec3};

use crate::bounds::Bounds;
use crate::mesh::TriMesh;

pub mod barrel;
mod barrel_spec;
mod body;
mod frame;
mod grid;
mod lattice;
mod spec;

use self::grid::LimbGrid;

pub use self::spec::{BoxMm, LimbError, LimbSpec, LimbSupport};

/// A rule of one parameter.
/// How long limbs may be.
const LENGTHS: &str = "from 1 to 100000 mm";

fn range(what: &'static str, rule: &'static str, value: f64, holds: bool) -> Result<(), LimbError> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(LimbError::Range { what, rule, value })
    }
}

impl LimbSpec {
    /// The mesh (m) and the boxes of its supports (mm), deterministic.
    ///
    /// # Errors
    /// [`LimbError`] where the parameters do not describe a limb.
    pub fn build(&self) -> Result<(TriMesh, Vec<BoxMm>), LimbError> {
        self.check()?;
        let mut grid = LimbGrid::new(self);
        grid.round_corners(self.corner_radius);
        let positions: Vec<DVec3> = grid.nodes.iter().map(|&p| self.bend(p)).collect();
        // Building through the same checks as any file: a generator is no exception.
        let (mesh, _) =
            TriMesh::new(&positions, &grid.triangles(), 0).map_err(|_| LimbError::Range {
                what: "the element size",
                rule: "above zero and small enough for the columns",
                value: self.element,
            })?;
        Ok((mesh, self.support_boxes()))
    }

    fn check(&self) -> Result<(), LimbError> {
        let positive = "above zero";
        let a_part =
            |what: &'static str, mm: f64| range(what, LENGTHS, mm, (1.0..=1e5).contains(&mm));
        a_part("the circumference", self.circumference)?;
        a_part("the height", self.height)?;
        range(
            "the taper",
            "between 0.2 and 5",
            self.taper,
            (0.2..=5.0).contains(&self.taper),
        )?;
        range(
            "the arc",
            "between 10 and 360 degrees",
            self.arc_degrees,
            (10.0..=360.0).contains(&self.arc_degrees),
        )?;
        let smallest = self.circumference.max(self.height) / 2000.0;
        range(
            "the element size",
            "at least 1/2000 of the limb",
            self.element,
            self.element >= smallest,
        )?;
        range(
            "the corner radius",
            "zero or more",
            self.corner_radius,
            self.corner_radius >= 0.0,
        )?;
        range(
            "the column width",
            positive,
            self.column_width,
            self.column_width > 0.0,
        )?;
        let stacked = self.hoops.windows(2).all(|w| w[0].1 < w[1].0);
        let proper = self.hoops.iter().all(|h| h.0 < h.1);
        let inside = self.hoops.first().is_some_and(|h| h.0 >= 0.0)
            && self.hoops.last().is_some_and(|h| h.1 <= self.height);
        if !(stacked && proper && inside) {
            return Err(LimbError::Hoops);
        }
        let mut centres = self.columns.clone();
        centres.sort_by(f64::total_cmp);
        let apart = centres.windows(2).all(|w| w[1] - w[0] > self.column_width);
        let within = centres
            .first()
            .is_some_and(|c| c - self.column_width / 2.0 >= 0.0)
            && centres
                .last()
                .is_some_and(|c| c + self.column_width / 2.0 <= self.circumference);
        let narrowest = self.narrowest_window(&centres);
        range(
            "the corner radius",
            "at most half the narrowest window",
            self.corner_radius,
            self.corner_radius <= narrowest / 2.0,
        )?;
        if apart && within {
            Ok(())
        } else {
            Err(LimbError::Columns)
        }
    }

    /// Smallest side of a window, from the columns' centres in rising order.
    fn narrowest_window(&self, centres: &[f64]) -> f64 {
        let between_hoops = self.hoops.windows(2).map(|w| w[1].0 - w[0].1);
        let between_columns = centres.windows(2).map(|w| w[1] - w[0] - self.column_width);
        let across_seam = match (self.closed(), centres) {
            (true, [first, .., last]) => first + self.circumference - last - self.column_width,
            _ => f64::INFINITY,
        };
        between_hoops
            .chain(between_columns)
            .fold(across_seam, f64::min)
    }

    /// (s, z) in mm to a point in metres.
    fn bend(&self, p: DVec2) -> DVec3 {
        let angle = (p.x - self.circumference / 2.0) / self.radius();
        let radius = self.radius() * (1.0 + (self.taper - 1.0) * p.y / self.height);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), p.y) / 1000.0
    }

    /// The boxes around the held patches (mm), a hair larger so that rounding keeps the rim inside.
    fn support_boxes(&self) -> Vec<BoxMm> {
        const HAIR: f64 = 0.01;
        self.support_patches()
            .iter()
            .map(|&[s0, s1, z0, z1]| {
                let steps = 360;
                let corners = (0..=steps).flat_map(|i| {
                    let s = s0 + (s1 - s0) * f64::from(i) / f64::from(steps);
                    [z0, z1].map(|z| self.bend(DVec2::new(s, z)) * 1000.0)
                });
                let around = Bounds::around(corners).grown(HAIR);
                let round = |p: DVec3| p.to_array().map(|x| (x * 1000.0).round() / 1000.0);
                [around.lower, around.upper].map(round)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bundled_limb_has_its_published_size() {
        let (mesh, boxes) = LimbSpec::default().build().unwrap();
        assert_eq!(mesh.positions().len(), 2724);
        // 20 columns' and hoops' worth of the unrolled 200 × 120 mm: 13 360 mm², facets a little less.
        assert!(
            (mesh.area() * 1e6 - 13_360.0).abs() < 15.0,
            "{}",
            mesh.area() * 1e6
        );
        assert_eq!(boxes.len(), 4);
        let finer = LimbSpec {
            element: 2.0,
            ..LimbSpec::default()
        };
        assert_eq!(finer.build().unwrap().0.positions().len(), 4096);
    }

    #[test]
    fn the_surface_faces_outward_and_has_sixteen_windows() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        for t in 0..mesh.triangles().len() as u32 {
            let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
            assert!(mesh.facet_normal(t).dot(middle.with_z(0.0)) > 0.0);
        }
        let (v, e, f) = (
            mesh.positions().len() as i64,
            mesh.edges().len() as i64,
            mesh.triangles().len() as i64,
        );
        // A tube has Euler characteristic 0; each window takes one away.
        assert_eq!(v - e + f, -16);
    }

    #[test]
    fn the_family_reaches_arcs_tapers_grids_and_round_corners() {
        let open = LimbSpec {
            arc_degrees: 180.0,
            taper: 0.7,
            corner_radius: 4.0,
            support: LimbSupport::Rims { depth: 5.0 },
            ..LimbSpec::default()
        };
        let (mesh, boxes) = open.build().unwrap();
        assert_eq!(boxes.len(), 2);
        assert!(mesh.boundary_edges().count() > 0);
        let fine = LimbSpec {
            element: 1.0,
            ..LimbSpec::default()
        };
        let sharp = fine.build().unwrap().0.area();
        let round = LimbSpec {
            corner_radius: 4.0,
            ..fine
        };
        // Each of the 64 corners gains (1 - π/4) r².
        let gain = 64.0 * (1.0 - std::f64::consts::FRAC_PI_4) * 16.0 * 1e-6;
        let grown = round.build().unwrap().0.area() - sharp;
        // Chords add a little; one corner of the 64 left out would take 1.6 %.
        assert!((grown / gain - 1.0).abs() < 0.03, "{grown} of {gain}");
        let tangled = LimbSpec {
            corner_radius: 9.0,
            ..LimbSpec::default()
        };
        assert!(tangled.build().is_err());
        assert!(LimbSpec::default().grid(6, 4, 8.0).build().is_ok());
    }

    #[test]
    fn impossible_limbs_are_refused() {
        let thin = LimbSpec {
            element: 0.0,
            ..LimbSpec::default()
        };
        assert!(thin.build().is_err());
        let crossed = LimbSpec {
            hoops: vec![(0.0, 30.0), (20.0, 40.0)],
            ..LimbSpec::default()
        };
        assert_eq!(crossed.build().unwrap_err(), LimbError::Hoops);
    }
}
