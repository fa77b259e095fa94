//! The load that a part carries in use: how far it gives way under it, and how much the wall is strained.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Deserialize;

use crate::budget::{Cancelled, unwatched};
use crate::elasticity::estimate::largest_principal;
use crate::elasticity::observe::Face;
use crate::elasticity::respond::{Quantity, respond};
use crate::elasticity::{Model, Push, Touch};
use crate::mesh::SurfacePoint;
use crate::units;

/// A force on a round pad of the surface. All loads of a study act at once.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServiceLoad {
    /// The pad's middle is where the surface is nearest to this (mm).
    pub at_mm: [f64; 3],
    /// Of the pad: the force is spread as a touch's is, q ∝ (1 - r²/a²)² (mm).
    pub radius_mm: f64,
    /// On the part (N).
    pub force_n: [f64; 3],
}

impl ServiceLoad {
    pub(super) fn check(&self) -> Result<(), String> {
        /// Forces (N) and places (mm) beyond these are slips of the pen.
        const MOST: f64 = 1e7;
        let numbers = self.at_mm.iter().chain(&self.force_n);
        if !numbers.into_iter().all(|v| v.abs() <= MOST) {
            return Err("[[service]] has a place (at_mm) or a force (force_n) that is no number or larger than 1e7".into());
        }
        if DVec3::from_array(self.force_n) == DVec3::ZERO {
            return Err("[[service]] has a force (force_n) of nothing".into());
        }
        if !(1e-3..=1e4).contains(&self.radius_mm) {
            return Err("[[service]] has a radius_mm that is not between 0.001 and 10000".into());
        }
        Ok(())
    }

    /// On a model's surface.
    fn push(&self, model: &dyn Model) -> Push {
        let force = DVec3::from_array(self.force_n);
        let (at, _) = model
            .index()
            .nearest(units::from_mm(DVec3::from_array(self.at_mm)));
        Push {
            touch: Touch {
                position: model.mesh().point(at),
                normal: model.mesh().normal(at),
                force: force.length(),
                tip_radius: units::from_mm(self.radius_mm),
            },
            force,
        }
    }
}

/// What a part does under all loads of a study together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ServiceResponse {
    /// How far the loads go along their forces, the mean over the forces (m).
    pub gives_way: f64,
    /// All forces (N).
    pub force: f64,
    /// How far the vertex goes that goes farthest (m).
    pub moves_most: f64,
    /// The largest principal strain at any of the places.
    pub strain: f64,
}

impl ServiceResponse {
    /// Of a model, its strains at some places (m) on the inside; nothing where there is no load.
    ///
    /// # Errors
    /// [`Cancelled`]: never, as nobody watches.
    pub fn of(
        model: &dyn Model,
        loads: &[ServiceLoad],
        places: &[DVec3],
    ) -> Result<Option<Self>, Cancelled> {
        if loads.is_empty() {
            return Ok(None);
        }
        let pushes: Vec<Push> = loads.iter().map(|load| load.push(model)).collect();
        let force: f64 = pushes.iter().map(|push| push.touch.force).sum();
        let UnderForces { work, vertices } = under_forces(model, &pushes);
        Ok(Some(Self {
            gives_way: work / force,
            force,
            moves_most: vertices.iter().map(|u| u.length()).fold(0.0, f64::max),
            strain: largest_strain(model, &pushes, places)?,
        }))
    }
}

/// What forces do to a part: forces times displacements (N m), and how every vertex moves (m).
struct UnderForces {
    work: f64,
    vertices: Vec<DVec3>,
}

fn under_forces(model: &dyn Model, pushes: &[Push]) -> UnderForces {
    // Where pads overlap, the forces on a degree of freedom are one.
    let mut forces = BTreeMap::new();
    for (dof, force) in pushes.iter().flat_map(|push| model.push(push)) {
        *forces.entry(dof).or_insert(0.0) += force;
    }
    let forces: Vec<(usize, f64)> = forces.into_iter().collect();
    let system = model.system();
    let solution = system.solve_dofs(&forces);
    let solved = system.widened(&[&solution]);
    let mut own = UnderForces {
        work: forces.iter().map(|&(dof, f)| f * solution[dof]).sum(),
        vertices: model.translations(&solved, 1).swap_remove(0),
    };
    if let Some(coarser) = model.coarser() {
        let coarse = under_forces(coarser.model, pushes);
        own.work = coarser.carried(own.work, coarse.work);
        for (fine, coarse) in own.vertices.iter_mut().zip(coarse.vertices) {
            *fine += coarser.share * (*fine - coarse);
        }
    }
    own
}

fn largest_strain(model: &dyn Model, pushes: &[Push], places: &[DVec3]) -> Result<f64, Cancelled> {
    let points: Vec<SurfacePoint> = places.iter().map(|&p| model.index().nearest(p).0).collect();
    let observer = model.observer(&points, Face::Inside);
    let responses = respond(model, pushes, &observer, Quantity::Strain, &unwatched)?;
    let mut row = vec![0.0; pushes.len()];
    let mut together = |k: usize| -> f64 {
        responses.row_into(k, &mut row);
        row.iter().sum()
    };
    let principal =
        (0..points.len()).map(|i| largest_principal([0, 1, 2].map(|k| together(3 * i + k))));
    Ok(principal.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::elasticity::{DofSet, Material, ShellModel, ShellSection};
    use crate::mesh::TriMesh;

    const LENGTH: f64 = 0.1;
    const WIDTH: f64 = 0.01;
    const THICKNESS: f64 = 0.002;
    const YOUNG: f64 = 1.7e9;

    /// A cantilever along x, clamped at x = 0.
    fn cantilever() -> ShellModel {
        let (along, across) = (60_u32, 6_u32);
        let points: Vec<DVec3> = (0..=along)
            .flat_map(|i| {
                (0..=across).map(move |j| {
                    let share = |k: u32, of: u32| f64::from(k) / f64::from(of);
                    DVec3::new(LENGTH * share(i, along), WIDTH * share(j, across), 0.0)
                })
            })
            .collect();
        let at = |i: u32, j: u32| i * (across + 1) + j;
        let triangles: Vec<[u32; 3]> = (0..along)
            .flat_map(|i| (0..across).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                [
                    [at(i, j), at(i + 1, j), at(i, j + 1)],
                    [at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)],
                ]
            })
            .collect();
        let mesh = Arc::new(TriMesh::new(&points, &triangles, 0).unwrap().0);
        let held: Vec<DofSet> = (mesh.positions().iter())
            .map(|p| {
                if p.x < 1e-9 {
                    DofSet::ALL
                } else {
                    DofSet::default()
                }
            })
            .collect();
        let section = ShellSection {
            material: Material {
                youngs_modulus: YOUNG,
                // No bending across, so that it is the beam of the books.
                poissons_ratio: 0.0,
            },
            thickness: THICKNESS,
        };
        ShellModel::new(&mesh, section, &held, &unwatched).unwrap()
    }

    fn load(x_mm: f64, force_n: [f64; 3]) -> ServiceLoad {
        ServiceLoad {
            at_mm: [x_mm, 5.0, 0.0],
            radius_mm: 2.0,
            force_n,
        }
    }

    fn said(model: &ShellModel, loads: &[ServiceLoad]) -> ServiceResponse {
        let places: Vec<DVec3> = (1..60)
            .map(|k| DVec3::new(LENGTH * f64::from(k) / 60.0, WIDTH / 2.0, 0.0))
            .collect();
        ServiceResponse::of(model, loads, &places).unwrap().unwrap()
    }

    #[test]
    fn a_cantilever_does_what_a_beam_does() {
        let model = cantilever();
        let (force, arm) = (0.5, 0.09);
        let found = said(&model, &[load(1e3 * arm, [0.0, 0.0, -force])]);
        let bending = YOUNG * WIDTH * THICKNESS.powi(3) / 12.0;
        let gives = force * arm.powi(3) / (3.0 * bending);
        let end = gives + force * arm * arm / (2.0 * bending) * (LENGTH - arm);
        // At the place nearest to the clamp.
        let strain = force * (arm - LENGTH / 60.0) * THICKNESS / 2.0 / bending;
        for (found, beam) in [
            (found.gives_way, gives),
            (found.force, force),
            (found.moves_most, end),
            (found.strain, strain),
        ] {
            assert!((found / beam - 1.0).abs() < 0.02, "{found} {beam}");
        }
    }

    #[test]
    fn loads_act_together() {
        let model = cantilever();
        let one = said(&model, &[load(90.0, [0.0, 0.1, -0.4])]);
        let parts = [load(90.0, [0.0, 0.1, 0.0]), load(90.0, [0.0, 0.0, -0.4])];
        let both = said(&model, &parts);
        for ratio in [both.moves_most / one.moves_most, both.strain / one.strain] {
            assert!((ratio - 1.0).abs() < 1e-9, "{one:?} {both:?}");
        }
        let against = [load(90.0, [0.0, 0.0, -0.4]), load(90.0, [0.0, 0.0, 0.4])];
        assert!(said(&model, &against).moves_most < 1e-9 * one.moves_most);
        assert_eq!(ServiceResponse::of(&model, &[], &[]).unwrap(), None);
    }

    #[test]
    fn slips_of_the_pen_are_refused() {
        for (bad, part) in [
            (load(f64::NAN, [1.0, 0.0, 0.0]), "at_mm"),
            (load(0.0, [0.0; 3]), "of nothing"),
            (load(0.0, [1e9, 0.0, 0.0]), "force_n"),
        ] {
            assert!(bad.check().is_err_and(|e| e.contains(part)), "{bad:?}");
        }
        let flat = ServiceLoad {
            radius_mm: 0.0,
            ..load(0.0, [1.0, 0.0, 0.0])
        };
        assert!(flat.check().is_err_and(|e| e.contains("radius_mm")));
    }
}
