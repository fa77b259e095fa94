//! What jobs brought becomes what is shown, and the gauges that were chosen the project's.

use std::sync::Arc;

use super::jobs::Task;
use super::news::Happening;
use super::slot::{Slot, current};
use super::state::Session;
use super::state::results::{DesignResult, SimulationResult};
use crate::budget::Quality;
use crate::design::{self, Design};
use crate::document::{DesignInputs, SimulationInputs};
use crate::job::Reporter;

impl Session {
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
            self.news.happened(Happening::Designed);
        }
        self.follow_selector();
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
                self.follow_selector();
                if self.drive.take {
                    self.take_sites();
                }
            }
        }
        self.results.show_refined();
    }

    /// Another selector's sites are shown when the project names it: all are there already.
    pub fn follow_selector(&mut self) {
        let asked = self.document.state.project.selection.selector;
        let Some(result) = self.results.design.as_mut().map(|d| &mut d.value) else {
            return;
        };
        let has = result.design.selections.iter().any(|s| s.selector == asked);
        if result.design.chosen_by == asked || !has {
            return;
        }
        let mut design = Design::clone(&result.design);
        design.chosen_by = asked;
        result.design = Arc::new(design);
        result.snapshot.project.selection.selector = asked;
        self.results.version += 1;
        if self.drive.take && self.design_holds() == Some(true) {
            self.take_sites();
        }
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

    /// The project's gauges are those that the design chose.
    pub(super) fn take_sites(&mut self) {
        let Some(result) = &self.results.design else {
            return;
        };
        let sites = result.value.chosen_sites();
        if self.document.state.project.selection.sites != sites {
            if std::mem::take(&mut self.drive.pressed) {
                // Somebody asked for them: what was there before can be had back.
                self.document.settle();
                self.document.state.project.selection.sites = sites;
                self.document.settle();
            } else {
                self.document.adopt_sites(sites);
            }
            self.news.happened(Happening::GaugesReplaced);
        }
        self.drive.take = true;
    }
}
