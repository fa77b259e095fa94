//! What live touch goes by: what was learned from presses, or the project's model.

use std::sync::Arc;

use super::state::Session;
use super::state::learned::Learnt;
use crate::design::{Learned, Sensing};
use crate::learning::TouchEstimator;
use crate::live::{GaugeModel, PipelineSettings};

impl Session {
    /// The estimator that live touch goes by, where it was learned on the gauges as they are now.
    #[must_use]
    pub fn learnt(&self) -> Option<&Learnt> {
        let now = self.document.sensing_inputs();
        self.live.learnt.as_ref().filter(|l| l.of == now)
    }

    /// What live touch goes by: what presses have taught, or the project's model as it is calibrated.
    pub(super) fn gauge_model(&self, sensing: &Sensing) -> (GaugeModel, PipelineSettings) {
        let live = &self.document.state.project.live;
        let settings = live.settings(sensing.gauges.len());
        match self.learnt().map(|l| &l.file.estimator) {
            Some(Learned::Matching(taught)) => (taught.model(), taught.settings(settings)),
            _ => (sensing.map_for(live), settings),
        }
    }

    /// Whether live touch may go by what was learned from presses alone.
    #[must_use]
    pub fn learns_alone(&self) -> bool {
        let learnt = self.learnt().map(|l| &l.file.estimator);
        matches!(learnt, Some(Learned::Regression(_)))
    }

    /// What was learned from presses alone, where that is what live touch goes by.
    pub(super) fn learned_alone(&self) -> Option<Arc<TouchEstimator>> {
        match self.learnt().map(|l| &l.file.estimator) {
            Some(Learned::Regression(estimator)) => Some(Arc::new((**estimator).clone())),
            _ => None,
        }
    }
}
