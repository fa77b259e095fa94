//! Which touches the gauges take for each other: for the place that is pointed at, and the worst of all.

use std::sync::Arc;

use super::attention::Attention;
use super::jobs::Task;
use super::latest::Latest;
use super::slot::{Slot, current, take_in};
use super::state::Session;
use super::state::confusions::{BROKEN, ConfusionInputs, ConfusionQuestion, TakenFor, serve};
use crate::design::InHand;
use crate::job::{Reporter, Stop};
use crate::mesh::SurfacePoint;
use crate::placement::expected_error::MistakenPair;

impl Session {
    fn confusion_inputs(&self) -> Option<ConfusionInputs> {
        let sites = self.document.state.project.selection.sites.clone();
        (!sites.is_empty()).then_some(())?;
        Some(ConfusionInputs {
            sites,
            expected: self.expected_inputs()?,
        })
    }

    /// Looks for confusions while somebody looks at them.
    pub(super) fn refresh_confusions(&mut self, attention: &Attention) {
        self.collect_taken();
        let looked_at = attention.confusions || attention.pointed.is_some();
        if !looked_at || !attention.rests() {
            return;
        }
        let (Some(in_hand), Some(inputs), Some(set)) = (
            self.in_hand(),
            self.confusion_inputs(),
            self.simulated_sites(),
        ) else {
            return;
        };
        if let Some(at) = attention.pointed {
            self.ask_taken(&in_hand, &set, &inputs, at);
        }
        let known = current(self.caches.confusions.pairs.as_ref(), &inputs).is_some();
        if known || !self.jobs.is_new(Task::Confuse, &inputs) {
            return;
        }
        let work = move |r: &Reporter| {
            let pairs = in_hand.worst_pairs(&set, &|p| r.report(p));
            Ok(Arc::new(pairs.map_err(|_| Stop::Cancelled)?))
        };
        self.jobs
            .start(Task::Confuse, inputs, work, |s, inputs, value| {
                let now = s.confusion_inputs();
                let pairs = &mut s.caches.confusions.pairs;
                take_in(pairs, Slot { inputs, value }, now.as_ref());
            });
    }

    fn collect_taken(&mut self) {
        let confusions = &mut self.caches.confusions;
        let answers: Vec<_> = confusions.worker.iter().flat_map(Latest::answers).collect();
        for answer in answers {
            match answer {
                Ok(answer) => confusions.answer = Some(answer),
                Err(message) => self.news.complain(message),
            }
        }
    }

    /// Asks what the place that is pointed at is taken for.
    fn ask_taken(
        &mut self,
        in_hand: &Arc<InHand>,
        set: &[usize],
        inputs: &ConfusionInputs,
        at: SurfacePoint,
    ) {
        let Some((press, place)) = in_hand.press_near(self.document.part.point(at)) else {
            return;
        };
        let confusions = &mut self.caches.confusions;
        let asked = confusions.asked.as_ref();
        if asked.is_some_and(|(p, of)| *p == press && of == inputs) {
            return;
        }
        if asked.is_some_and(|(_, of)| of != inputs) {
            // Of other gauges.
            confusions.answer = None;
        }
        confusions.asked = Some((press, inputs.clone()));
        let worker = &mut confusions.worker;
        let worker = worker.get_or_insert_with(|| Latest::start(&self.wake, BROKEN, serve));
        worker.ask(ConfusionQuestion {
            in_hand: Arc::clone(in_hand),
            set: set.to_vec(),
            press,
            place,
        });
    }

    /// What a touch at a place of the part is taken for, once that is known.
    #[must_use]
    pub fn taken_for(&self, at: SurfacePoint) -> Option<&TakenFor> {
        let answer = self.caches.confusions.answer.as_ref()?;
        let (press, _) = self.in_hand()?.press_near(self.document.part.point(at))?;
        (press == answer.press).then_some(answer)
    }

    /// The worst confusions of the gauges as they are, the worst first, once they are known.
    #[must_use]
    pub fn worst_confusions(&self) -> Option<Arc<Vec<MistakenPair>>> {
        let pairs = self.caches.confusions.pairs.as_ref();
        current(pairs, &self.confusion_inputs()?).map(Arc::clone)
    }
}
