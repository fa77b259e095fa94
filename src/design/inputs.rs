//! What a design is made from.

use std::sync::Arc;

use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;
use crate::project::{Masks, Project};

/// What a design starts from.
#[derive(Clone)]
pub struct Inputs {
    /// What is asked for.
    pub project: Project,
    /// The part's surface (m).
    pub part: Arc<TriMesh>,
    /// One value a vertex of the part; absent when nothing was painted.
    pub painted: Option<Arc<Vec<bool>>>,
    /// Masks of the part's vertices that supports may name.
    pub masks: Masks,
}

impl Inputs {
    /// Which way the part stands.
    #[must_use]
    pub fn stance(&self) -> Stance {
        self.project.part.axis.stance(&self.part)
    }
}
