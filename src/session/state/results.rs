//! What was computed of the project: the results that are shown, and the last ones of each quality.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::budget::Quality;
use crate::design::{Design, Inputs, Simulated};
use crate::document::{DesignInputs, FilterInputs, SimulationInputs};
use crate::feasible::Feasibility;
use crate::io::artifacts::as_chosen;
use crate::placement::SelectorKind;
use crate::project::ChosenSite;
use crate::session::slot::Slot;

/// A finished simulation.
#[derive(Clone)]
pub struct SimulationResult {
    pub simulated: Arc<Simulated>,
    /// Read again from elements that were there.
    pub(in crate::session) again: bool,
    pub quality: Quality,
    pub seconds: f64,
}

/// A finished design.
#[derive(Clone)]
pub struct DesignResult {
    pub design: Arc<Design>,
    /// What it was computed from, for whoever computes more of it.
    pub snapshot: Inputs,
    pub quality: Quality,
    pub seconds: f64,
}

impl DesignResult {
    /// The gauges that it chose, as a project keeps them.
    #[must_use]
    pub fn chosen_sites(&self) -> Vec<ChosenSite> {
        let sites = &self.design.simulated.dataset.sites;
        as_chosen(sites, self.design.chosen())
    }
}

/// Which design it is: what it was computed from, and whose gauges are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignMark {
    pub(in crate::session) inputs: DesignInputs,
    pub(in crate::session) chosen_by: SelectorKind,
}

/// The last results of a quality.
#[derive(Default)]
pub(in crate::session) struct Last {
    pub(in crate::session) simulation: Option<Slot<SimulationInputs, SimulationResult>>,
    pub(in crate::session) design: Option<Slot<DesignInputs, DesignResult>>,
}

/// What was computed of the project.
#[derive(Default)]
pub struct Results {
    pub simulation: Option<Slot<SimulationInputs, SimulationResult>>,
    /// Verdicts of the filters.
    pub feasibility: Option<Slot<FilterInputs, Arc<Feasibility>>>,
    pub design: Option<Slot<DesignInputs, DesignResult>>,
    /// What is asked for again after a change is often there.
    pub(in crate::session) last: BTreeMap<Quality, Last>,
    /// Counts changes of simulation and design, so that whoever draws them knows when to do so anew.
    pub version: u64,
}

impl Results {
    pub(in crate::session) fn last_simulation(
        &self,
        quality: Quality,
    ) -> Option<&Slot<SimulationInputs, SimulationResult>> {
        self.last.get(&quality)?.simulation.as_ref()
    }

    pub(in crate::session) fn last_design(
        &self,
        quality: Quality,
    ) -> Option<&Slot<DesignInputs, DesignResult>> {
        self.last.get(&quality)?.design.as_ref()
    }

    pub(in crate::session) fn show_simulation(
        &mut self,
        slot: Slot<SimulationInputs, SimulationResult>,
    ) {
        self.simulation = Some(slot);
        self.version += 1;
    }

    pub(in crate::session) fn show_design(&mut self, slot: Slot<DesignInputs, DesignResult>) {
        self.design = Some(slot);
        self.version += 1;
        self.show_refined();
    }

    /// The simulation that is shown has the gauges that the design that is shown moved off its lattice.
    pub(in crate::session) fn show_refined(&mut self) {
        let (Some(simulation), Some(design)) = (&mut self.simulation, &self.design) else {
            return;
        };
        let refined = &design.value.design.simulated;
        if simulation.value.simulated.is_one_with(refined) {
            simulation.value.simulated = Arc::clone(refined);
            self.version += 1;
        }
    }

    /// Which design is shown.
    pub(in crate::session) fn design_mark(&self) -> Option<DesignMark> {
        let shown = self.design.as_ref()?;
        Some(DesignMark {
            inputs: shown.inputs.clone(),
            chosen_by: shown.value.design.chosen_by,
        })
    }
}
