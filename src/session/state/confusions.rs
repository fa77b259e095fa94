//! Which touches the gauges were found to take for each other, and the worker that finds what a press is taken for.

use std::sync::Arc;

use glam::DVec3;

use crate::design::InHand;
use crate::document::ExpectedInputs;
use crate::placement::expected_error::{Mistaken, MistakenPair};
use crate::project::ChosenSite;
use crate::session::latest::{Latest, LatestDesk};
use crate::session::slot::Slot;

pub(in crate::session) const BROKEN: &str =
    "An internal error stopped what a touch is taken for. Please report it";

/// What confusions depend on: the gauges, and what is expected of them.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) struct ConfusionInputs {
    pub(in crate::session) sites: Vec<ChosenSite>,
    pub(in crate::session) expected: ExpectedInputs,
}

/// What the press nearest to the pointer is taken for by a set.
pub(in crate::session) struct ConfusionQuestion {
    pub(in crate::session) in_hand: Arc<InHand>,
    pub(in crate::session) set: Vec<usize>,
    pub(in crate::session) press: usize,
    /// Of the press (m).
    pub(in crate::session) place: DVec3,
}

/// What a press is taken for.
pub struct TakenFor {
    pub(in crate::session) press: usize,
    /// Where it really is (m).
    pub place: DVec3,
    pub taken: Vec<Mistaken>,
}

/// Confusions, and the worker that finds what a press is taken for.
#[derive(Default)]
pub struct Confusions {
    pub(in crate::session) worker: Option<Latest<ConfusionQuestion, TakenFor>>,
    /// What is pointed at, and by which gauges: where neither has changed nothing is asked.
    pub(in crate::session) asked: Option<(usize, ConfusionInputs)>,
    pub(in crate::session) answer: Option<TakenFor>,
    /// The worst.
    pub(in crate::session) pairs: Option<Slot<ConfusionInputs, Arc<Vec<MistakenPair>>>>,
}

pub(in crate::session) fn serve(
    first: ConfusionQuestion,
    desk: &LatestDesk<ConfusionQuestion, TakenFor>,
) -> Option<ConfusionQuestion> {
    let question = desk.latest(first);
    desk.answer(Ok(TakenFor {
        press: question.press,
        place: question.place,
        taken: question.in_hand.taken_for(&question.set, question.press),
    }));
    desk.wait()
}
