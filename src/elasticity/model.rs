//! What any elastic model answers, be it a shell or a solid: loads of touches, readings at points.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::load::{Push, Touch};
use super::observe::{Face, Observer};
use super::system::System;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh};

/// Results of the checks that a solved load is put through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LoadCheck {
    /// |sum of reactions + load| over the load.
    pub reaction_error: f64,
    /// |½ u·f - strain energy| over the energy.
    pub energy_error: f64,
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
    /// Displacements by degree of freedom under one touch.
    #[must_use]
    pub fn press(&self, touch: &Touch) -> Vec<f64> {
        self.system().solve_dofs(&self.load(touch))
    }
}
