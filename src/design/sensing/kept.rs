//! What is kept of a model of chosen gauges, so that the next start need not compute it.

use std::sync::{Arc, OnceLock};

use super::Sensing;
use crate::budget::Budget;
use crate::design::drawn::proposed;
use crate::design::{DesignError, Inputs};
use crate::elasticity::sensitivity::Sensitivity;
use crate::gauge::Gauge;
use crate::inference::AsDrawn;

/// The results of an elastic model for chosen gauges: all of a [`Sensing`] that takes long.
pub struct Computed {
    /// The gauges, a channel each.
    pub gauges: Vec<Gauge>,
    /// What nodal forces make them read.
    pub sensitivity: Arc<Sensitivity>,
    /// Readings everywhere.
    pub drawn: Arc<AsDrawn>,
    /// Mean edge of the elements (mm).
    pub element_mm: f64,
    /// Rms error of the strain that the elements leave (%).
    pub strain_percent: f64,
}

impl Sensing {
    /// What took long; nothing of elements that are coarser than was asked for because memory was short, which may not be
    /// so the next time.
    #[must_use]
    pub fn to_keep(&self) -> Option<Computed> {
        (!self.is_short).then(|| Computed {
            gauges: self.gauges.clone(),
            sensitivity: Arc::clone(&self.sensitivity),
            drawn: Arc::clone(&self.drawn),
            element_mm: self.element_mm,
            strain_percent: self.strain_percent,
        })
    }

    /// The model of a project's gauges, computed from the same project before.
    ///
    /// # Errors
    /// [`DesignError`] where no touch lands on the part.
    pub fn from_kept(
        kept: Computed,
        inputs: &Inputs,
        budget: &Budget,
    ) -> Result<Self, DesignError> {
        let project = &inputs.project;
        let off = project.uncertainty().with_elements(kept.strain_percent);
        Ok(Self {
            sites: project.selection.sites.clone(),
            gauges: kept.gauges,
            grid: project.gauge.grid(),
            sensitivity: kept.sensitivity,
            deviations: kept.drawn.deviations(&off),
            off,
            proposed: proposed(&kept.drawn.map.mesh, inputs)?,
            drawn: kept.drawn,
            element_mm: kept.element_mm,
            strain_percent: kept.strain_percent,
            is_short: false,
            budget: *budget,
            meshed: OnceLock::new(),
        })
    }
}
