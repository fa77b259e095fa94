//! What of the results holds for the project as it is.

use std::sync::Arc;

use super::slot::current;
use super::state::Session;
use crate::budget::Quality;
use crate::design::Simulated;
use crate::document::FilterInputs;
use crate::feasible::Feasibility;

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

    pub(super) fn better_simulation_holds(&self, than: Quality) -> bool {
        let shown = self.results.simulation.as_ref();
        shown.is_some_and(|s| s.value.quality > than) && self.simulation_holds() == Some(true)
    }

    pub(super) fn better_design_holds(&self, than: Quality) -> bool {
        let shown = self.results.design.as_ref();
        shown.is_some_and(|d| d.value.quality > than) && self.design_holds() == Some(true)
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
}
