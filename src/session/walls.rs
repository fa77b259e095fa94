//! Shell or solid: what was measured of the part's walls.

use std::sync::Arc;

use super::attention::{Attention, Colours};
use super::jobs::{Task, stop};
use super::slot::{Slot, current, take_in};
use super::state::Session;
use crate::budget::Watch;
use crate::design::{self, Advice, DesignError, Inputs};
use crate::job::Reporter;

impl Session {
    /// What is known of the part as it is, if it was measured.
    #[must_use]
    pub fn advice(&self) -> Option<&Arc<Advice>> {
        current(self.caches.walls.as_ref(), &self.document.wall_inputs())
    }

    /// Measures the walls anew while somebody looks at them, when no hand is painting.
    pub(super) fn refresh_walls(&mut self, attention: &Attention) {
        let looked_at = attention.colours == Some(Colours::Walls) && !attention.hand;
        let inputs = self.document.wall_inputs();
        if looked_at && self.advice().is_none() && self.jobs.is_new(Task::Advise, &inputs) {
            // Whoever paints waits for the colours, and not for models.
            self.start_advice(design::advise_by_walls);
        }
    }

    /// Measures the walls in the background, and what models would cost by solving the first ones, unless that is under way.
    pub fn measure_walls(&mut self) {
        self.start_advice(design::advise);
    }

    fn start_advice(&mut self, advise: fn(&Inputs, Watch) -> Result<Advice, DesignError>) {
        let inputs = self.document.wall_inputs();
        if self.jobs.runs_on(Task::Advise, &inputs) {
            return;
        }
        let snapshot = self.document.inputs();
        let work = move |r: &Reporter| {
            let watch = |progress| r.report(progress);
            let advice = advise(&snapshot, &watch).map_err(|e| stop(&e))?;
            Ok(Arc::new(advice))
        };
        self.jobs
            .start(Task::Advise, inputs, work, |s, inputs, value| {
                let now = s.document.wall_inputs();
                take_in(&mut s.caches.walls, Slot { inputs, value }, Some(&now));
            });
    }
}
