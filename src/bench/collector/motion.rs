//! One move: sent, waited for, and believed only when the machine says by itself that it is there.

use super::super::marlin::{Marlin, position_in};
use crate::units;

/// How far a position may be off what it was sent to (mm, degrees): reports have two digits.
const NEAR: f64 = 0.02;
/// Reports that may say something else before it is believed: answers may be of an earlier question.
const ASKED: u32 = 4;
/// What a move may take beyond its way (µs).
const SPARE_US: u64 = 60_000_000;

/// What came of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Moved {
    NotYet,
    There,
    Wrong(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MotionStage {
    /// The axis of this number is on its way.
    Axis(usize),
    Finishing,
    Asking,
}

/// A move of some axes, one after the other: letter, number, speed (mm/s, degrees/s).
#[derive(Clone, Debug)]
pub(super) struct Motion {
    targets: Vec<(char, f64, f64)>,
    stage: MotionStage,
    asked: u32,
    late_us: u64,
    /// An axis that was stopped on its way, with the ends of that way: where it stands is asked.
    stopped: Option<(char, [f64; 2])>,
    /// Where it was found to stand.
    pub found: Option<f64>,
}

impl Motion {
    /// Sends the first axis.
    pub fn begin(
        targets: Vec<(char, f64, f64)>,
        marlin: &mut Marlin,
        now_us: u64,
        out: &mut Vec<u8>,
    ) -> Self {
        /// The longest way that an axis has (mm, degrees).
        const LONGEST: f64 = 1000.0;
        let longest = targets.iter().map(|t| LONGEST / t.2).sum::<f64>();
        let motion = Self {
            targets,
            stage: MotionStage::Axis(0),
            asked: 0,
            late_us: now_us + SPARE_US + units::microseconds(longest),
            stopped: None,
            found: None,
        };
        motion.send(0, marlin, now_us, out);
        motion
    }

    /// Finds out where an axis stands that was stopped on a way between two numbers.
    pub fn stopped(
        axis: char,
        way: [f64; 2],
        marlin: &mut Marlin,
        now_us: u64,
        out: &mut Vec<u8>,
    ) -> Self {
        marlin.order("M400", 0, now_us, out);
        Self {
            targets: Vec::new(),
            stage: MotionStage::Finishing,
            asked: 0,
            late_us: now_us + SPARE_US,
            stopped: Some((axis, way)),
            found: None,
        }
    }

    fn send(&self, k: usize, marlin: &mut Marlin, now_us: u64, out: &mut Vec<u8>) {
        let (letter, number, speed) = self.targets[k];
        let order = format!("G1 {letter}{number:.3} F{:.0}", speed * 60.0);
        marlin.order(&order, 0, now_us, out);
    }

    /// Whether it is still on its way, and not stopped already.
    pub fn may_be_stopped(&self) -> bool {
        self.stopped.is_none()
    }

    /// Whether it should long have ended.
    pub fn is_late(&self, now_us: u64) -> bool {
        now_us > self.late_us
    }

    /// The last line was answered, and this was said meanwhile.
    pub fn take(
        &mut self,
        said: &[String],
        marlin: &mut Marlin,
        now_us: u64,
        out: &mut Vec<u8>,
    ) -> Moved {
        match self.stage {
            MotionStage::Axis(k) if k + 1 < self.targets.len() => {
                self.stage = MotionStage::Axis(k + 1);
                self.send(k + 1, marlin, now_us, out);
            }
            MotionStage::Axis(_) => {
                self.stage = MotionStage::Finishing;
                marlin.order("M400", 0, now_us, out);
            }
            MotionStage::Finishing => self.ask(marlin, now_us, out),
            MotionStage::Asking => {
                if let Some((axis, way)) = self.stopped {
                    self.found = position_in(said, axis).filter(|at| between(*at, way));
                }
                let Some(off) = self.off(said) else {
                    return Moved::There;
                };
                if self.asked >= ASKED {
                    return Moved::Wrong(off);
                }
                self.ask(marlin, now_us, out);
            }
        }
        Moved::NotYet
    }

    fn ask(&mut self, marlin: &mut Marlin, now_us: u64, out: &mut Vec<u8>) {
        self.stage = MotionStage::Asking;
        self.asked += 1;
        marlin.order("M114", 0, now_us, out);
    }

    /// What is not as it was sent.
    fn off(&self, said: &[String]) -> Option<String> {
        if let Some((axis, [from, to])) = self.stopped {
            return self.found.is_none().then(|| {
                format!("the machine was stopped between {axis}{from:.2} and {axis}{to:.2}, and does not say that it is there")
            });
        }
        self.targets.iter().find_map(|&(letter, number, _)| {
            match position_in(said, letter) {
                Some(at) if (at - number).abs() <= NEAR => None,
                Some(at) => Some(format!(
                    "the machine says that it is at {letter}{at:.2}, and it was sent to {letter}{number:.2}"
                )),
                None => Some(format!(
                    "the machine does not say where its axis {letter} is (M114)"
                )),
            }
        })
    }
}

fn between(at: f64, [from, to]: [f64; 2]) -> bool {
    (from.min(to) - NEAR..=from.max(to) + NEAR).contains(&at)
}
