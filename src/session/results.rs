//! What was computed of the project: the results that are shown, and the last ones of each quality.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::jobs::Task;
use super::slot::{Slot, current};
use super::{Event, Session};
use crate::budget::Quality;
use crate::design::{self, Design, Inputs, Simulated};
use crate::document::{DesignInputs, FilterInputs, SimulationInputs};
use crate::feasible::Feasibility;
use crate::io::artifacts::as_chosen;
use crate::job::Reporter;
use crate::placement::SelectorKind;
use crate::project::ChosenSite;

/// A finished simulation.
#[derive(Clone)]
pub struct SimulationResult {
    pub simulated: Arc<Simulated>,
    /// Read again from elements that were there.
    pub(super) again: bool,
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

/// Which design it is: what it was computed from, and whose gauges lead.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignMark {
    inputs: DesignInputs,
    lead: SelectorKind,
}

/// The last results of a quality.
#[derive(Default)]
struct Last {
    simulation: Option<Slot<SimulationInputs, SimulationResult>>,
    design: Option<Slot<DesignInputs, DesignResult>>,
}

/// What was computed of the project.
#[derive(Default)]
pub struct Results {
    pub simulation: Option<Slot<SimulationInputs, SimulationResult>>,
    /// Verdicts of the filters.
    pub feasibility: Option<Slot<FilterInputs, Arc<Feasibility>>>,
    pub design: Option<Slot<DesignInputs, DesignResult>>,
    /// What is asked for again after a change is often there.
    last: BTreeMap<Quality, Last>,
    /// Counts changes of simulation and design, so that whoever draws them knows when to do so anew.
    pub version: u64,
}

impl Results {
    pub(super) fn last_simulation(
        &self,
        quality: Quality,
    ) -> Option<&Slot<SimulationInputs, SimulationResult>> {
        self.last.get(&quality)?.simulation.as_ref()
    }

    pub(super) fn last_design(
        &self,
        quality: Quality,
    ) -> Option<&Slot<DesignInputs, DesignResult>> {
        self.last.get(&quality)?.design.as_ref()
    }

    fn show_simulation(&mut self, slot: Slot<SimulationInputs, SimulationResult>) {
        self.simulation = Some(slot);
        self.version += 1;
    }

    fn show_design(&mut self, slot: Slot<DesignInputs, DesignResult>) {
        self.design = Some(slot);
        self.version += 1;
        self.show_refined();
    }

    /// The simulation that is shown has the gauges that the design that is shown moved off its lattice.
    fn show_refined(&mut self) {
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
    pub(super) fn design_mark(&self) -> Option<DesignMark> {
        let shown = self.design.as_ref()?;
        Some(DesignMark {
            inputs: shown.inputs.clone(),
            lead: shown.value.design.lead,
        })
    }
}

impl Session {
    /// The simulation of a quality, where it holds for the project as it is.
    pub(super) fn simulation_at(&self, quality: Quality) -> Option<Arc<Simulated>> {
        let now = self.document.simulation_inputs(quality);
        let last = current(self.results.last_simulation(quality), &now)?;
        Some(Arc::clone(&last.simulated))
    }

    /// Whether the shown simulation holds for the project as it is, in whatever quality it has; nothing without one.
    #[must_use]
    pub fn simulation_holds(&self) -> Option<bool> {
        let shown = self.results.simulation.as_ref()?;
        Some(shown.holds_for(&self.document.simulation_inputs(shown.value.quality)))
    }

    /// As [`Self::simulation_holds`], of the design.
    #[must_use]
    pub fn design_holds(&self) -> Option<bool> {
        let shown = self.results.design.as_ref()?;
        Some(shown.holds_for(&self.document.design_inputs(shown.value.quality)))
    }

    fn better_simulation_holds(&self, than: Quality) -> bool {
        let shown = self.results.simulation.as_ref();
        shown.is_some_and(|s| s.value.quality > than) && self.simulation_holds() == Some(true)
    }

    fn better_design_holds(&self, than: Quality) -> bool {
        let shown = self.results.design.as_ref();
        shown.is_some_and(|d| d.value.quality > than) && self.design_holds() == Some(true)
    }

    pub(super) fn take_simulation(&mut self, inputs: SimulationInputs, value: SimulationResult) {
        let quality = value.quality;
        let slot = Slot { inputs, value };
        if !slot.holds_for(&self.document.simulation_inputs(quality)) {
            return self.dropped("simulation");
        }
        let last = self.results.last.entry(quality).or_default();
        last.simulation = Some(slot.clone());
        if !self.better_simulation_holds(quality) {
            self.results.show_simulation(slot);
        }
    }

    pub(super) fn take_design(&mut self, inputs: DesignInputs, value: DesignResult) {
        let quality = value.quality;
        let slot = Slot { inputs, value };
        if !slot.holds_for(&self.document.design_inputs(quality)) {
            return self.dropped("selection");
        }
        self.hold_to_promise(&slot.value.design, quality);
        let feasibility = Arc::clone(&slot.value.design.feasibility);
        let first = self.results.design.is_none();
        let last = self.results.last.entry(quality).or_default();
        last.design = Some(slot.clone());
        self.results.show_design(slot);
        let filter = self.document.filter_inputs(quality);
        if self.shown_filter_inputs().as_ref() == Some(&filter) {
            self.results.feasibility = Some(Slot {
                inputs: filter,
                value: feasibility,
            });
        }
        if first {
            self.news.happened(Event::Designed);
        }
        self.follow_lead();
        // Gauges that undo has brought back may be those of this very design.
        self.drive.take |= self.as_designed();
        if self.drive.take {
            self.take_sites();
        }
    }

    /// Shows what is there already of the project as it is: after a change was taken back, most often.
    pub(super) fn show_last(&mut self) {
        self.forget_promise();
        for quality in Quality::ALL {
            let simulation = self.results.last_simulation(quality).cloned();
            let now = self.document.simulation_inputs(quality);
            if let Some(slot) = simulation.filter(|s| s.holds_for(&now))
                && !self.better_simulation_holds(quality)
            {
                self.results.show_simulation(slot);
            }
            let design = self.results.last_design(quality).cloned();
            let now = self.document.design_inputs(quality);
            if let Some(slot) = design.filter(|d| d.holds_for(&now))
                && !self.better_design_holds(quality)
            {
                self.results.show_design(slot);
                self.follow_lead();
                if self.drive.take {
                    self.take_sites();
                }
            }
        }
        self.results.show_refined();
    }

    /// Another selector's sites are shown when the project names it: all are there already.
    pub fn follow_lead(&mut self) {
        let asked = self.document.state.project.selection.selector;
        let Some(result) = self.results.design.as_mut().map(|d| &mut d.value) else {
            return;
        };
        let has = result.design.selections.iter().any(|s| s.selector == asked);
        if result.design.lead == asked || !has {
            return;
        }
        let mut design = Design::clone(&result.design);
        design.lead = asked;
        result.design = Arc::new(design);
        result.snapshot.project.selection.selector = asked;
        self.results.version += 1;
        if self.drive.take && self.design_holds() == Some(true) {
            self.take_sites();
        }
    }

    /// What the filters' verdicts on the simulation that is shown depend on, where it holds.
    #[must_use]
    pub fn shown_filter_inputs(&self) -> Option<FilterInputs> {
        let quality = self.results.simulation.as_ref()?.value.quality;
        (self.simulation_holds() == Some(true)).then(|| self.document.filter_inputs(quality))
    }

    /// The filters' verdicts, while they hold for the project as it is.
    #[must_use]
    pub fn current_verdicts(&self) -> Option<&Arc<Feasibility>> {
        current(
            self.results.feasibility.as_ref(),
            &self.shown_filter_inputs()?,
        )
    }

    /// Filters anew when anything that the verdicts depend on has changed.
    pub(super) fn refresh_feasibility(&mut self) {
        let (Some(inputs), Some(simulation)) =
            (self.shown_filter_inputs(), &self.results.simulation)
        else {
            return;
        };
        let known = current(self.results.feasibility.as_ref(), &inputs).is_some();
        if known || !self.jobs.is_new(Task::Filter, &inputs) {
            return;
        }
        let simulated = Arc::clone(&simulation.value.simulated);
        let snapshot = self.document.inputs();
        let work = move |_: &Reporter| Ok(Arc::new(design::filter(&snapshot, &simulated)));
        self.jobs
            .start(Task::Filter, inputs, work, |s, inputs, value| {
                if s.shown_filter_inputs().as_ref() == Some(&inputs) {
                    s.results.feasibility = Some(Slot { inputs, value });
                }
            });
    }

    pub(super) fn dropped(&mut self, what: &str) {
        self.tell(format!(
            "The {what} was for settings that have changed since, and was dropped"
        ));
    }
}
