//! What any elastic model answers, be it a shell or a solid: loads of touches, readings at points.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::load::{Push, Touch};
use super::observe::{Face, Observer};
use super::solver::BLOCK;
use super::system::System;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh};

/// Results of the checks that a solved load is put through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LoadCheck {
    /// |sum of reactions + load| over the load.
    pub reaction_error: f64,
    /// |½ u·f - strain energy| over the energy, of a solid that of the assembled stiffness.
    pub energy_error: f64,
}

/// A coarser model of the same part, on the same surface, from which displacements are carried on: where errors fall by about
/// the same share from one order of the elements to the next, u + s (u - u of the coarser one) is nearer to the converged
/// answer than either (B. Szabó and I. Babuška, Finite Element Analysis, 1991, chapter 4).
#[derive(Clone, Copy)]
pub struct Coarser<'a> {
    /// The coarser model.
    pub model: &'a dyn Model,
    /// s: of what changed from it to the finer one, so much is still to come.
    pub share: f64,
}

impl Coarser<'_> {
    /// What a displacement comes to.
    #[must_use]
    pub fn carried(&self, fine: f64, coarse: f64) -> f64 {
        fine + self.share * (fine - coarse)
    }
}

/// A factored model of a part. Touches press on the surface of its mesh, and points to read lie on it.
pub trait Model: Send + Sync {
    /// The surface (m).
    fn mesh(&self) -> &Arc<TriMesh>;

    /// Where points of the surface are found.
    fn index(&self) -> &SurfaceIndex {
        self.mesh().index()
    }

    /// The factored stiffness.
    fn system(&self) -> &System;

    /// What its displacements are carried on from, where there is such a model. Strains are not: they scatter by more
    /// than what is left of them.
    fn coarser(&self) -> Option<Coarser<'_>> {
        None
    }

    /// Forces of a push by degree of freedom (N).
    fn push(&self, push: &Push) -> Vec<(usize, f64)>;

    /// Forces of a touch by degree of freedom (N).
    fn load(&self, touch: &Touch) -> Vec<(usize, f64)> {
        self.push(&touch.into())
    }

    /// Operators that read displacement and strain at points of the surface. A shell is read on the
    /// face that is named, a solid where the points are.
    fn observer(&self, points: &[SurfacePoint], face: Face) -> Observer;

    /// The worst balance of forces and energies over solved loads.
    fn check_all(&self, touches: &[Touch], solutions: &[Vec<f64>]) -> LoadCheck;

    /// Whether anything is held at each vertex of the surface.
    fn held(&self) -> Vec<bool>;

    /// Connected pieces, each of which was found held.
    fn pieces(&self) -> usize;

    /// Translations (m) at every vertex of the surface under each column of a solved block, vertex by vertex.
    fn translations(&self, solved: &[f64], columns: usize) -> Vec<Vec<DVec3>>;
}

impl dyn Model + '_ {
    /// Displacements by degree of freedom under one touch, as its own elements have them.
    #[must_use]
    pub fn press(&self, touch: &Touch) -> Vec<f64> {
        self.system().solve_dofs(&self.load(touch))
    }

    /// How every vertex of the surface moves under each touch (m).
    #[must_use]
    pub fn moved(&self, touches: &[Touch]) -> Vec<Vec<DVec3>> {
        let mut moved = Vec::with_capacity(touches.len());
        for block in touches.chunks(BLOCK) {
            let loads: Vec<_> = block.iter().map(|t| self.load(t)).collect();
            let solutions = self.system().solve_loads(&loads);
            let solved = self.system().widened(&solutions);
            moved.extend(self.translations(&solved, block.len()));
        }
        if let Some(coarser) = self.coarser() {
            for (fine, coarse) in moved.iter_mut().zip(coarser.model.moved(touches)) {
                for (fine, coarse) in fine.iter_mut().zip(coarse) {
                    *fine += coarser.share * (*fine - coarse);
                }
            }
        }
        moved
    }
}
