//! What the gauges as they are, wherever a hand is just moving one, are expected to err by, and where on the limb.

use std::sync::Arc;

use super::attention::Attention;
use super::jobs::Task;
use super::latest::Latest;
use super::slot::{Slot, current, take_in};
use super::state::Session;
use super::state::expected::{BROKEN, ExpectedOf, HandQuestion, serve};
use crate::design::InHand;
use crate::document::ExpectedInputs;
use crate::evaluation::Judging;
use crate::job::{Reporter, Stop};

impl Session {
    /// What is expected of sets depends on; nothing where no simulation holds.
    pub(super) fn expected_inputs(&self) -> Option<ExpectedInputs> {
        let simulation = &self.results.simulation.as_ref()?.value;
        let simulated = &simulation.simulated;
        let off = &simulated.dataset.sites[simulated.lattice..];
        (self.simulation_holds() == Some(true))
            .then(|| self.document.expected_inputs(simulation.quality, off))
    }

    /// What sets are asked of, while it holds for the project and the simulation as they are.
    #[must_use]
    pub fn in_hand(&self) -> Option<Arc<InHand>> {
        let ready = self.caches.expected.ready.as_ref()?;
        current(Some(ready), &self.expected_inputs()?).map(Arc::clone)
    }

    /// Keeps what is expected of the gauges up to date while somebody looks at it.
    pub(super) fn refresh_expected(&mut self, attention: &Attention) {
        let expecting = &mut self.caches.expected;
        let answers: Vec<_> = expecting.worker.iter().flat_map(Latest::answers).collect();
        for answer in answers {
            match answer {
                Ok(answer) => {
                    expecting.answer = Some(answer);
                    expecting.version += 1;
                }
                Err(message) => self.news.complain(message),
            }
        }
        if !self.wants_expected(attention) {
            return;
        }
        let Some(inputs) = self.expected_inputs() else {
            return;
        };
        match current(self.caches.expected.ready.as_ref(), &inputs).map(Arc::clone) {
            Some(in_hand) => self.ask_expected(attention, &in_hand),
            None => self.start_expecting(attention, inputs),
        }
    }

    fn wants_expected(&self, attention: &Attention) -> bool {
        let by_hand =
            || self.is_matched() && self.design_holds() == Some(true) && !self.as_designed();
        let any = !self.document.state.project.selection.sites.is_empty();
        any && (attention.expected || attention.confusions || by_hand())
    }

    /// Whether sets of gauges are judged by matching.
    #[must_use]
    pub fn is_matched(&self) -> bool {
        matches!(self.document.state.project.judging(), Judging::Matching(_))
    }

    fn start_expecting(&mut self, attention: &Attention, inputs: ExpectedInputs) {
        let Some(simulation) = &self.results.simulation else {
            return;
        };
        if attention.hand || !self.jobs.is_new(Task::Expect, &inputs) {
            return;
        }
        let simulated = Arc::clone(&simulation.value.simulated);
        let snapshot = self.document.inputs();
        let work = move |r: &Reporter| {
            let in_hand = InHand::new(&snapshot, simulated, &|p| r.report(p));
            Ok(Arc::new(in_hand.map_err(|_| Stop::Cancelled)?))
        };
        self.jobs
            .start(Task::Expect, inputs, work, Self::take_in_hand);
    }

    /// What sets are asked of from now on.
    pub(super) fn take_in_hand(&mut self, inputs: ExpectedInputs, value: Arc<InHand>) {
        let now = self.expected_inputs();
        let expecting = &mut self.caches.expected;
        let known = (expecting.ready.as_ref()).map(|ready| ready.inputs.clone());
        take_in(&mut expecting.ready, Slot { inputs, value }, now.as_ref());
        if expecting.ready.as_ref().map(|ready| &ready.inputs) != known.as_ref() {
            expecting.number += 1;
        }
    }

    fn ask_expected(&mut self, attention: &Attention, in_hand: &Arc<InHand>) {
        let sites = &self.document.state.project.selection.sites;
        let moves = attention.moved.or(attention.picked).unwrap_or(0);
        let moves = moves.min(sites.len().saturating_sub(1));
        let expecting = &self.caches.expected;
        let ready = expecting.number;
        let asked = expecting.asked.as_ref();
        if asked
            .is_some_and(|(of, asked, number)| *of == ready && asked == sites && *number == moves)
        {
            return;
        }
        // The last answer, that is: one that is still to come would take its place.
        let known = (expecting.answer.as_ref()).is_some_and(|a| {
            a.number == expecting.questions && a.ready == ready && a.sites == *sites
        });
        let sites = sites.clone();
        self.caches.expected.asked = Some((ready, sites.clone(), moves));
        let Some(set) = self.simulated_sites() else {
            return;
        };
        self.caches.expected.questions += u64::from(!known);
        let question = HandQuestion {
            ready,
            in_hand: Arc::clone(in_hand),
            moves,
            sites,
            set,
            number: self.caches.expected.questions,
            known,
        };
        let worker = &mut self.caches.expected.worker;
        let worker = worker.get_or_insert_with(|| Latest::start(&self.wake, BROKEN, serve));
        // Where nobody answers any more the last answer is no longer of these gauges, and is not shown as theirs.
        worker.ask(question);
    }

    /// The newest answer: of the gauges as they are, or while one is moved, as they just were.
    #[must_use]
    pub fn expected(&self, moved: bool) -> Option<&ExpectedOf> {
        let expecting = &self.caches.expected;
        let answer = expecting.answer.as_ref()?;
        let sites = &self.document.state.project.selection.sites;
        let near = answer.sites == *sites || moved && answer.sites.len() == sites.len();
        let holds = near && answer.ready == expecting.number && self.in_hand().is_some();
        holds.then_some(answer)
    }

    /// The error (mm) that matching is expected to make with the gauges as they are, once it is known.
    #[must_use]
    pub fn expected_error(&self) -> Option<f64> {
        Some(self.expected(false)?.expected.error_mm)
    }
}
