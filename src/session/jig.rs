//! The jig for the gauges as they are, while somebody looks at it.

use std::sync::Arc;

use super::attention::Attention;
use super::jobs::Task;
use super::slot::{Slot, current, take_in};
use super::state::Session;
use crate::jig::Jig;
use crate::job::{Reporter, Stop};
use crate::workshop::{Inner, jig_of};

impl Session {
    /// The jig for the chosen gauges, if it was planned.
    #[must_use]
    pub fn jig(&self) -> Option<&Arc<Jig>> {
        current(self.caches.jig.as_ref(), &self.document.jig_inputs())
    }

    /// Plans it anew while somebody looks at it, when no hand is changing anything.
    pub(super) fn refresh_jig(&mut self, attention: &Attention) {
        let chosen = !self.document.state.project.selection.sites.is_empty();
        let asked = attention.jig && attention.rests() && chosen;
        if !asked || self.jig().is_some() {
            return;
        }
        let inputs = self.document.jig_inputs();
        if !self.jobs.is_new(Task::Jig, &inputs) || self.jobs.runs_on(Task::Jig, &inputs) {
            return;
        }
        let snapshot = self.document.inputs();
        let work = move |r: &Reporter| {
            let watch = |progress| r.report(progress);
            let inner = Inner::of_project(&snapshot);
            let jig = jig_of(&snapshot, &inner, &watch).map_err(|_| Stop::Cancelled)?;
            Ok(Arc::new(jig))
        };
        self.jobs
            .start(Task::Jig, inputs, work, |s, inputs, value| {
                let now = s.document.jig_inputs();
                take_in(&mut s.caches.jig, Slot { inputs, value }, Some(&now));
            });
    }
}
