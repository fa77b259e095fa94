//! What gauges that were put somewhere by hand do to the error.

use std::sync::Arc;

use super::attention::Attention;
use super::jobs::{Task, stop};
use super::state::Session;
use super::state::by_hand::{ByHand, HandInputs};
use crate::design;
use crate::evaluation::EVERYWHERE;
use crate::job::{Reporter, Stop};

impl Session {
    fn hand_inputs(&self) -> HandInputs {
        HandInputs {
            of: self.results.design_mark(),
            sites: self.document.state.project.selection.sites.clone(),
        }
    }

    /// Whether what is known of gauges put by hand is of these very ones and of the design that is shown.
    #[must_use]
    pub fn knows_hand(&self) -> bool {
        self.design_holds() == Some(true)
            && self.caches.by_hand.inputs.as_ref() == Some(&self.hand_inputs())
    }

    /// The design with the gauges as they were put by hand, once they are judged.
    pub(super) fn design_by_hand(&self) -> Option<design::Design> {
        let judged = self.caches.by_hand.exact().filter(|_| self.knows_hand())?;
        let design = &self.results.design.as_ref()?.value.design;
        Some(design.with_hand(self.gauge_sites()?, judged))
    }

    /// Mean errors (mm) of gauges that were put somewhere by hand: estimated, and on unseen touches.
    #[must_use]
    pub fn by_hand_error(&self) -> (Option<f64>, Option<f64>) {
        if !self.knows_hand() {
            return (None, None);
        }
        let exact = self.caches.by_hand.exact();
        let row = exact.and_then(|e| e.rows.iter().find(|r| r.region == EVERYWHERE));
        let estimate = if self.is_matched() {
            self.expected_error()
        } else {
            self.caches.by_hand.estimate
        };
        (estimate, row.map(|r| r.error_mm))
    }

    /// Finds out about gauges that were put somewhere by hand: an estimate at once, the exact error when they rest.
    pub(super) fn refresh_by_hand(&mut self, attention: &Attention) {
        let none = self.document.state.project.selection.sites.is_empty();
        if self.design_holds() != Some(true) || none || self.as_designed() {
            return;
        }
        let inputs = self.hand_inputs();
        if self.caches.by_hand.inputs.as_ref() != Some(&inputs) {
            self.caches.by_hand = ByHand {
                inputs: Some(inputs.clone()),
                ..ByHand::default()
            };
            if self.gauge_sites().is_none() {
                let key = Box::new(inputs.clone());
                self.jobs.fail(Task::Judge, key, "no site".into());
                self.complain("A gauge lies at none of the sites that were simulated, and its error cannot be told: move it with the tool “Gauges”, or press “Select gauges”");
            }
            self.start_estimate(&inputs);
        }
        let known = self.caches.by_hand.exact.is_some();
        if attention.rests() && !known && self.jobs.is_new(Task::Judge, &inputs) {
            self.start_judging(inputs);
        }
    }

    /// By regression; what is expected of matching is known anyway.
    fn start_estimate(&mut self, inputs: &HandInputs) {
        if self.is_matched() {
            return;
        }
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.results.design) else {
            return;
        };
        let design = Arc::clone(&result.value.design);
        let snapshot = result.value.snapshot.clone();
        let work = move |_: &Reporter| {
            let (exact, count) = (design.chosen_row(), design.chosen().len() as f64);
            let tuned = exact.and_then(|r| r.hyper).map(|h| h.gamma * count);
            let gamma = tuned.unwrap_or(1.0) / sites.len().max(1) as f64;
            let dataset = &design.simulated.dataset;
            let of = |sites: &[usize]| design::estimate(&snapshot, dataset, sites, gamma);
            // What the estimate is off by for the chosen set it is off by for its neighbours.
            let factor = exact.map_or(1.0, |r| r.error_mm / of(design.chosen()));
            Ok(of(&sites) * factor)
        };
        let inputs = inputs.clone();
        self.jobs
            .start(Task::Estimate, inputs, work, |s, inputs, mm| {
                // Not of gauges that have moved on.
                if s.caches.by_hand.inputs.as_ref() == Some(&inputs) {
                    s.caches.by_hand.estimate = Some(mm);
                }
            });
    }

    fn start_judging(&mut self, inputs: HandInputs) {
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.results.design) else {
            return;
        };
        let design = Arc::clone(&result.value.design);
        let snapshot = result.value.snapshot.clone();
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let found = design::judge_set(&snapshot, &design, &sites, &watch);
            let found = found.map_err(|e| stop(&e))?;
            if found.rows.is_empty() {
                return Err(Stop::Failed("no test touch lies in any region".into()));
            }
            Ok(Arc::new(found))
        };
        self.jobs
            .start(Task::Judge, inputs, work, |s, inputs, found| {
                if s.caches.by_hand.inputs.as_ref() == Some(&inputs) {
                    s.caches.by_hand.exact = Some(found);
                }
            });
    }
}
