//! A simulation that was computed elsewhere, from what was costly of it: its elements, its signals and how far off they are.
//! What follows from the inputs follows again.

use glam::DVec3;

use super::ground::{Ground, ground};
use super::layout::lay_out_sites;
use super::simulate::{Checks, JudgedElements, SiteReader};
use super::{DesignError, Inputs, Meshed, Simulated};
use crate::budget::{Budget, Watch, Work};
use crate::dataset::Dataset;
use crate::elasticity::estimate::Discretization;
use crate::elasticity::linearity::Linearity;
use crate::elasticity::solid::immersed::Fineness;
use crate::mesh::remesh::Remeshed;

/// The elements of a simulation.
#[derive(Clone)]
pub enum KeptElements {
    /// Facets of a shell.
    Shell(Remeshed),
    /// How fine the cells or tetrahedra of a solid are.
    Solid(Fineness),
}

/// What was costly of a simulation.
pub struct KeptSimulation {
    /// What it was computed on.
    pub elements: KeptElements,
    /// See [`Simulated::discretization`].
    pub estimate: Discretization,
    /// Of a shell.
    pub linearity: Option<Linearity>,
    /// What the solution was checked for.
    pub checks: Checks,
    /// The sites of the lattice under all touches.
    pub dataset: Dataset,
    /// Degrees of freedom.
    pub unknowns: usize,
}

impl Simulated {
    /// What it was computed on.
    #[must_use]
    pub fn kept_elements(&self) -> KeptElements {
        match &self.meshed {
            Meshed::Shell(_, remeshed) => KeptElements::Shell(remeshed.clone()),
            Meshed::Solid(_, fineness) => KeptElements::Solid(*fineness),
        }
    }
}

/// The simulation of some inputs that was kept of the same inputs; nothing where it is of others.
///
/// # Errors
/// [`DesignError`] as [`super::simulate`].
pub fn simulate_kept(
    inputs: &Inputs,
    budget: &Budget,
    kept: KeptSimulation,
    watch: Watch,
) -> Result<Option<Simulated>, DesignError> {
    let project = &inputs.project;
    project.check()?;
    let ground = ground(inputs, watch)?;
    ground.check(project)?;
    let layout = ground.site_layout();
    let sites = lay_out_sites(&layout, inputs)?;
    let places: Vec<DVec3> = sites.iter().map(|&at| layout.point(at)).collect();
    let same_sites = kept.dataset.sites.len() == places.len();
    let meshed = match (ground, kept.elements) {
        (Ground::Shell(shell), KeptElements::Shell(remeshed)) if same_sites => {
            let remeshed = shell.known(remeshed);
            Meshed::Shell(shell, remeshed)
        }
        (Ground::Solid(solid), KeptElements::Solid(fineness)) if same_sites => {
            Meshed::Solid(solid, fineness)
        }
        _ => return Ok(None),
    };
    let known = JudgedElements {
        meshed,
        estimate: kept.estimate,
        linearity: kept.linearity,
        checks: kept.checks,
        is_short: false,
        // Counted with what is kept.
        work: Work::default(),
    };
    let read = (kept.dataset, kept.unknowns);
    let reader = SiteReader {
        inputs,
        budget,
        places: &places,
        watch,
    };
    reader.finish(known, read).map(Some)
}
