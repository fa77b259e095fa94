//! What is done with the answers of the place that is pressed again and again.

use std::collections::VecDeque;

use super::super::check::CheckPlace;
use super::super::plan::Planned;
use super::{Collector, CollectorNews, Phase, RESTARTS, RunEnd};
use crate::plain;

impl Collector {
    /// Presses a reference too: first of all, again and again, and last of all.
    #[must_use]
    pub fn checked_at(mut self, reference: CheckPlace) -> Self {
        self.check.every = reference.every;
        self.check.reference = Some(reference);
        self
    }

    /// The reference was pressed.
    pub(super) fn checked(
        &mut self,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        self.check.now = false;
        self.phase = Phase::Retract;
        let tip = self.machine.sensor.map(|s| s.channel);
        let near = 1.5 * self.limits.step.max(1e-4);
        let failed = self.failed.take();
        let answer = (self.check).answer(failed, |channel| Some(channel) != tip);
        let Some(reference) = &mut self.check.reference else {
            return;
        };
        let most = reference.every;
        let off = match (answer, &reference.answer) {
            (Err(why), Some(_)) => Some(why),
            (Err(why), None) => {
                self.end(RunEnd::Stopped(format!(
                    "the place that is to be pressed again and again cannot be pressed at all: {why}: look how the limb is mounted, and whether the tip and its sensor work"
                )));
                return;
            }
            (Ok(now), Some(before)) => now.differs(before, near),
            (Ok(now), None) => {
                // Steps may be lost on the way to the first of all, too: it is believed when it is repeated, from home if there is
                // one.
                reference.answer = Some(now);
                self.check.fresh = true;
                if !self.machine.home.is_empty() {
                    self.open(true, now_us, out);
                }
                return;
            }
        };
        let confirmed = std::mem::take(&mut self.check.fresh);
        match off {
            None => {
                if let Some(answer) = reference.answer.as_ref().filter(|_| confirmed) {
                    tell(CollectorNews::Answer(answer.clone()));
                }
                tell(CollectorNews::Note("checked".into()));
                self.check.begun = true;
                self.check.since.clear();
                self.check.homed = 0;
                self.restarts = 0;
                self.check.every = (2 * self.check.every).min(most);
                for (number, planned, why) in std::mem::take(&mut self.check.failed) {
                    self.failed(number, planned, why, tell);
                }
                if self.plan.is_empty() {
                    self.through(tell);
                }
            }
            Some(why) => {
                if confirmed {
                    reference.answer = None;
                }
                self.moved(&why, now_us, out, tell);
            }
        }
    }

    /// Whether what was pressed since the last check was right will never be known: it is pressed again. How many those are.
    pub(super) fn doubt(&mut self, why: &str, tell: &mut dyn FnMut(CollectorNews)) -> usize {
        if self.check.reference.is_none() {
            return 0;
        }
        tell(CollectorNews::Note(format!("moved {why}")));
        let mut plan = VecDeque::from(std::mem::take(&mut self.check.since));
        let discarded: Vec<usize> = plan.iter().map(|(number, _)| *number).collect();
        let doubted = discarded.len();
        let failed = std::mem::take(&mut self.check.failed);
        plan.extend(failed.into_iter().map(|(number, at, _)| (number, at)));
        self.failures = 0;
        plan.append(&mut self.plan);
        self.plan = plan;
        self.check.begun = false;
        if doubted > 0 {
            self.check.every = (doubted / 2).max(1);
            tell(CollectorNews::Discarded(discarded));
        }
        doubted
    }

    /// The reference is not as it was.
    fn moved(
        &mut self,
        why: &str,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        let discarded = match self.doubt(why, tell) {
            0 => String::new(),
            n => format!(
                ", and {} made since it last was as at first {} not believed",
                plain::either(n, "press", "presses"),
                if n == 1 { "is" } else { "are" }
            ),
        };
        let what =
            format!("the place that is pressed again and again is not as it was: {why}{discarded}");
        self.check.homed += 1;
        if self.machine.home.is_empty() || self.check.homed > RESTARTS {
            self.end(RunEnd::Stopped(format!(
                "{what}. A motor lost steps, the limb slipped, or a gauge is off: find the axes again and look how the limb stands"
            )));
            return;
        }
        tell(CollectorNews::Say(format!(
            "{what}; the axes are sent home"
        )));
        self.open(true, now_us, out);
    }

    /// A press failed, and not because the machine stands where it should not: it is tried once more at the end.
    pub(super) fn failed(
        &mut self,
        number: usize,
        planned: Planned,
        why: String,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        if self.failed_before.insert(number) {
            let text = format!("press {number} failed: {why}. It is tried again at the end");
            tell(CollectorNews::Say(text));
            self.plan.push_back((number, planned));
        } else {
            let failed = Some(why);
            tell(CollectorNews::Press { number, failed });
        }
    }
}
