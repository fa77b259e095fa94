//! What really touches a simulated board, brought together with the samples that feel it.

use std::collections::VecDeque;

use crate::board::Truth;

/// Of samples that nobody took: a minute of the quickest boards.
const MOST: usize = 300_000;

/// What was true at samples that have not come through yet.
#[derive(Default)]
pub struct Truths {
    waiting: VecDeque<Truth>,
    /// As it was said last.
    last: Option<Truth>,
}

impl Truths {
    /// What is true at the next sample.
    pub fn push(&mut self, truth: Truth) {
        if self.waiting.len() >= MOST {
            self.waiting.pop_front();
        }
        self.waiting.push_back(truth);
    }

    /// What is true at a sample of this time, where that is something new. Samples before it that were lost on the way leave
    /// nothing.
    pub(super) fn at(&mut self, time_us: u64) -> Option<Truth> {
        let mut truth = None;
        while let Some(next) = self.waiting.front()
            && next.time_us <= time_us
        {
            truth = self.waiting.pop_front();
        }
        let truth = truth?;
        let new = self.last.is_none_or(|last| last.touch != truth.touch);
        self.last = Some(truth);
        new.then_some(truth)
    }

    /// What is true is new to whoever begins to listen now.
    pub(super) fn begin_anew(&mut self) {
        self.last = None;
    }
}
