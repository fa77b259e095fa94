//! What the gauges as they are, wherever a hand is just moving one, are expected to err by, and where on the limb: answered
//! by a worker at the pace of the hand.

use std::sync::Arc;

use super::Session;
use super::attention::Attention;
use super::jobs::Task;
use super::latest::{Desk, Latest};
use super::slot::{Slot, current};
use crate::design::{Expected, InHand};
use crate::document::ExpectedInputs;
use crate::evaluation::Judging;
use crate::io::report::robust_top;
use crate::job::{Reporter, Stop};
use crate::project::ChosenSite;

const BROKEN: &str = "An internal error stopped the expected error of the gauges. Please report it";

/// A set of gauges, one of which is in hand.
struct Question {
    /// What it is asked of, and the number that this goes by.
    ready: u64,
    in_hand: Arc<InHand>,
    sites: Vec<ChosenSite>,
    /// The same as sites of the simulation.
    set: Vec<usize>,
    moves: usize,
    /// Counts the questions that want an answer.
    number: u64,
    /// Whether the answer is known: the gauge is only taken in hand, so that its first move is answered as soon as all
    /// others.
    known: bool,
}

impl Question {
    /// Whether at most the gauge in hand is elsewhere.
    fn continues(&self, before: &Self) -> bool {
        let stays = |k: usize| k == self.moves || self.set[k] == before.set[k];
        (self.ready, self.moves, self.set.len()) == (before.ready, before.moves, before.set.len())
            && (0..self.set.len()).all(stays)
    }
}

/// What is expected of a set of gauges.
pub struct ExpectedOf {
    ready: u64,
    sites: Vec<ChosenSite>,
    /// Of the question.
    number: u64,
    pub expected: Expected,
    /// Where the colours of its map end (mm).
    pub top_mm: f64,
}

/// What is expected of the gauges, and the worker that says so.
#[derive(Default)]
pub struct Expecting {
    /// What sets are asked of.
    ready: Option<Slot<ExpectedInputs, Arc<InHand>>>,
    /// Counts what sets were asked of so far.
    number: u64,
    worker: Option<Latest<Question, ExpectedOf>>,
    /// What was asked last: of what, which sites, and which gauge of them moves.
    asked: Option<(u64, Vec<ChosenSite>, usize)>,
    /// How many questions wanted an answer.
    questions: u64,
    answer: Option<ExpectedOf>,
    /// Counts answers, so that whoever draws them knows when to do so anew.
    pub version: u64,
}

/// Answers questions on the same other gauges; returns the first that has others.
fn serve(first: Question, desk: &Desk<Question, ExpectedOf>) -> Option<Question> {
    let (ready, in_hand) = (first.ready, Arc::clone(&first.in_hand));
    let mut question = desk.latest(first);
    if question.ready != ready {
        return Some(question);
    }
    let hand = in_hand.hand(&question.set, question.moves);
    loop {
        if !question.known {
            let expected = in_hand.expected(&hand, &question.set, question.moves);
            desk.answer(Ok(ExpectedOf {
                ready,
                sites: question.sites.clone(),
                number: question.number,
                top_mm: robust_top(&expected.map_mm),
                expected,
            }));
        }
        let next = desk.wait()?;
        let next = desk.latest(next);
        if !next.continues(&question) {
            return Some(next);
        }
        question = next;
    }
}

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
        let expecting = &mut self.caches.expected;
        if !(expecting.ready.as_ref()).is_some_and(|ready| ready.holds_for(&inputs)) {
            expecting.number += 1;
        }
        expecting.ready = Some(Slot { inputs, value });
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
        let question = Question {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::{Quality, unwatched};
    use crate::design::{self, expected_errors};
    use crate::session::Wake;

    #[test]
    fn a_gauge_in_hand_is_answered_as_sets_are_judged() {
        let mut inputs = crate::io::opening::bundled().unwrap().inputs;
        inputs.project.budget.quality = Quality::Draft;
        let budget = Quality::Draft.budget();
        let simulated = Arc::new(design::simulate(&inputs, &budget, &unwatched).unwrap());
        let in_hand = Arc::new(InHand::new(&inputs, Arc::clone(&simulated), &unwatched).unwrap());
        let count = simulated.dataset.sites.len();
        let question = |k: usize| Question {
            ready: 1,
            in_hand: Arc::clone(&in_hand),
            sites: Vec::new(),
            set: [0, 1, 2 + k, 3, 4].map(|n| n * count / 12).to_vec(),
            moves: 2,
            number: 0,
            known: false,
        };
        assert!(question(5).continues(&question(0)));
        let other = Question {
            moves: 3,
            ..question(5)
        };
        assert!(!other.continues(&question(0)));
        let worker = Latest::start(&Wake::default(), BROKEN, serve);
        for k in [0, 4] {
            assert!(worker.ask(question(k)));
            let answer = loop {
                if let Some(reply) = worker.answers().next() {
                    break reply.unwrap();
                }
                std::thread::yield_now();
            };
            let expected = &answer.expected;
            let set = question(k).set;
            let judged = expected_errors(&inputs, &simulated, &[set], &unwatched).unwrap()[0];
            let off = expected.error_mm / judged - 1.0;
            assert!(off.abs() < 0.1, "{} {judged}", expected.error_mm);
            // The map is of the same size, a vertex of the part.
            assert_eq!(expected.map_mm.len(), inputs.part.positions().len());
            let largest = expected.map_mm.iter().copied().fold(0.0, f64::max);
            assert!(
                expected
                    .map_mm
                    .iter()
                    .all(|mm| mm.is_finite() && *mm >= 0.0)
            );
            assert!(largest > 0.5 * judged, "{largest} {judged}");
            assert!((0.0..=1.0).contains(&expected.blind));
            assert!(answer.top_mm > 0.0);
        }
        // Taking another gauge in hand tells nothing new; its first move does.
        let taken = |k: usize, known: bool| Question {
            moves: 3,
            known,
            ..question(k)
        };
        assert!(worker.ask(taken(4, true)) && worker.ask(taken(5, false)));
        let answer = loop {
            if let Some(reply) = worker.answers().next() {
                break reply.unwrap();
            }
            std::thread::yield_now();
        };
        let set = question(5).set;
        let alone = in_hand.expected(&in_hand.hand(&set, 3), &set, 3);
        assert_eq!(answer.expected, alone);
        assert!(worker.answers().next().is_none());
    }
}
