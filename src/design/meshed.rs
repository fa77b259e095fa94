//! A part with elements on it.

use std::sync::Arc;

use super::DesignError;
use crate::budget::Watch;
use crate::elasticity::solid::ground::SolidGround;
use crate::elasticity::solid::immersed::Fineness;
use crate::elasticity::{DofSet, Model, grade};
use crate::mesh::TriMesh;
use crate::mesh::remesh::Remeshed;
use crate::units;

/// Elements together with what they were laid on: triangles of a shell, cells or tetrahedra of a solid.
#[derive(Clone)]
pub enum Meshed {
    /// Facets of a shell.
    Shell(Arc<grade::ShellGround>, Remeshed),
    /// Cells or tetrahedra of a solid.
    Solid(Arc<SolidGround>, Fineness),
}

impl Meshed {
    /// The surface that gauges are glued to, and what is held at its vertices.
    #[must_use]
    pub fn gauge_surface(&self) -> (Arc<TriMesh>, Vec<DofSet>) {
        match self {
            Self::Shell(shell, remeshed) => (Arc::clone(&remeshed.mesh), shell.held(remeshed)),
            Self::Solid(solid, _) => (Arc::clone(&solid.inside), solid.inside_held.clone()),
        }
    }

    /// The surface that touches press on.
    #[must_use]
    pub fn touched_surface(&self) -> Arc<TriMesh> {
        match self {
            Self::Shell(_, remeshed) => Arc::clone(&remeshed.mesh),
            Self::Solid(solid, _) => Arc::clone(&solid.outside),
        }
    }

    /// Where the theory is off for this part, these elements and a tip of this radius (m).
    #[must_use]
    pub fn cautions(&self, tip_radius: f64) -> Vec<String> {
        match self {
            Self::Shell(shell, _) => shell.cautions(tip_radius),
            Self::Solid(solid, fineness) => solid.cautions(fineness),
        }
    }

    /// Size of the elements (mm): mean edge of triangles, largest side of cells.
    #[must_use]
    pub fn element_mm(&self) -> f64 {
        match self {
            Self::Shell(_, remeshed) => units::mm(remeshed.mesh.mean_edge()),
            Self::Solid(_, fineness) => {
                units::mm(fineness.size) / f64::from(1 << fineness.halvings)
            }
        }
    }

    /// Finer elements, for the reference model: half as large for a shell, two thirds for a solid, its own tetrahedra one order
    /// higher.
    fn finer(&self) -> Self {
        match self {
            Self::Shell(shell, remeshed) => Self::Shell(Arc::clone(shell), shell.halved(remeshed)),
            Self::Solid(solid, fineness) => Self::Solid(Arc::clone(solid), solid.finer(fineness)),
        }
    }

    /// The model on these elements.
    ///
    /// # Errors
    /// [`DesignError`] for what cannot be computed.
    pub fn model(&self, watch: Watch) -> Result<Box<dyn Model>, DesignError> {
        Ok(match self {
            Self::Shell(shell, remeshed) => Box::new(shell.model(remeshed, watch)?),
            Self::Solid(solid, fineness) => Box::new(solid.model(fineness, watch)?),
        })
    }

    /// The model that others are judged by, with its elements: finer ones, or where those do not fit into memory
    /// the same.
    ///
    /// # Errors
    /// [`DesignError`] for what cannot be computed.
    pub fn reference_model(&self, watch: Watch) -> Result<(Self, Box<dyn Model>), DesignError> {
        let finer = self.finer();
        match finer.model(watch) {
            Ok(model) => Ok((finer, model)),
            Err(DesignError::Elastic(error)) if error.is_memory() => {
                Ok((self.clone(), self.model(watch)?))
            }
            Err(error) => Err(error),
        }
    }
}
