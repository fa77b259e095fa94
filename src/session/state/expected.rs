//! What sets of gauges are expected to err by, and the worker that says so at the pace of the hand.

use std::sync::Arc;

use crate::design::{ExpectedInHand, InHand};
use crate::document::ExpectedInputs;
use crate::plain::robust_top;
use crate::project::ChosenSite;
use crate::session::latest::{Latest, LatestDesk};
use crate::session::slot::Slot;

pub(in crate::session) const BROKEN: &str =
    "An internal error stopped the expected error of the gauges. Please report it";

/// A set of gauges, one of which is in hand.
pub(in crate::session) struct HandQuestion {
    /// What it is asked of, and the number that this goes by.
    pub(in crate::session) ready: u64,
    pub(in crate::session) in_hand: Arc<InHand>,
    pub(in crate::session) sites: Vec<ChosenSite>,
    /// The same as sites of the simulation.
    pub(in crate::session) set: Vec<usize>,
    pub(in crate::session) moves: usize,
    /// Counts the questions that want an answer.
    pub(in crate::session) number: u64,
    /// Whether the answer is known: the gauge is only taken in hand, so that its first move is answered as soon as all
    /// others.
    pub(in crate::session) known: bool,
}

impl HandQuestion {
    /// Whether at most the gauge in hand is elsewhere.
    pub(in crate::session) fn continues(&self, before: &Self) -> bool {
        let stays = |k: usize| k == self.moves || self.set[k] == before.set[k];
        (self.ready, self.moves, self.set.len()) == (before.ready, before.moves, before.set.len())
            && (0..self.set.len()).all(stays)
    }
}

/// What is expected of a set of gauges.
pub struct ExpectedOf {
    pub(in crate::session) ready: u64,
    pub(in crate::session) sites: Vec<ChosenSite>,
    /// Of the question.
    pub(in crate::session) number: u64,
    pub expected: ExpectedInHand,
    /// Where the colours of its map end (mm).
    pub top_mm: f64,
}

/// What is expected of the gauges, and the worker that says so.
#[derive(Default)]
pub struct Expecting {
    /// What sets are asked of.
    pub(in crate::session) ready: Option<Slot<ExpectedInputs, Arc<InHand>>>,
    /// Counts what sets were asked of so far.
    pub(in crate::session) number: u64,
    pub(in crate::session) worker: Option<Latest<HandQuestion, ExpectedOf>>,
    /// What was asked last: of what, which sites, and which gauge of them moves.
    pub(in crate::session) asked: Option<(u64, Vec<ChosenSite>, usize)>,
    /// How many questions wanted an answer.
    pub(in crate::session) questions: u64,
    pub(in crate::session) answer: Option<ExpectedOf>,
    /// Counts answers, so that whoever draws them knows when to do so anew.
    pub version: u64,
}

/// Answers questions on the same other gauges; returns the first that has others.
pub(in crate::session) fn serve(
    first: HandQuestion,
    desk: &LatestDesk<HandQuestion, ExpectedOf>,
) -> Option<HandQuestion> {
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
        let question = |k: usize| HandQuestion {
            ready: 1,
            in_hand: Arc::clone(&in_hand),
            sites: Vec::new(),
            set: [0, 1, 2 + k, 3, 4].map(|n| n * count / 12).to_vec(),
            moves: 2,
            number: 0,
            known: false,
        };
        assert!(question(5).continues(&question(0)));
        let other = HandQuestion {
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
        let taken = |k: usize, known: bool| HandQuestion {
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
