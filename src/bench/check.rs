//! A place that is pressed again and again: whatever a machine says of where it is, the limb's own answer there shows whether
//! steps were lost, the limb has slipped, or the board reads something else than it did.

use serde::{Deserialize, Serialize};

use super::plan::Planned;
use super::press::SampleMean;
use crate::units;

/// What the limb answers at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckedForce {
    /// Where the tip first felt it, before the place as planned (m).
    pub early: f64,
    /// Of each channel: counts a newton, or a millimetre of depth where the tip has no sensor.
    pub slopes: Vec<f64>,
    /// Standard deviations of those.
    pub deviations: Vec<f64>,
}

/// Where it is checked, and how often.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckPlace {
    /// The place.
    pub at: Planned,
    /// Presses between two checks.
    pub every: usize,
    /// What it answered at first, if that is known.
    pub answer: Option<CheckedForce>,
}

/// How a run is checked.
#[derive(Default)]
pub(super) struct Check {
    pub reference: Option<CheckPlace>,
    /// Whether what is pressed now is the reference.
    pub now: bool,
    /// Whether it was pressed since the run was begun, or the axes were found again.
    pub begun: bool,
    /// Whether what it answered at first is still to be confirmed by pressing it once more.
    pub fresh: bool,
    /// Presses between two checks just now: fewer where a machine begins anew more often than that.
    pub every: usize,
    /// Presses that were made since it last was as at first.
    pub since: Vec<(usize, Planned)>,
    /// Those that failed since then, and why.
    pub failed: Vec<(usize, Planned, String)>,
    /// Their readings: depth (mm), force (N) where it is known, and what changed against the rest (counts).
    steps: Vec<(f64, Option<f64>, Vec<f64>)>,
    /// Of a mean of a reading (counts).
    deviation: Vec<f64>,
    early: f64,
    /// How often the axes were found again since it was as at first.
    pub homed: u32,
}

impl CheckedForce {
    /// Straight lines through what was read at depths (mm) or forces (N).
    fn fit(early: f64, steps: &[(f64, Option<f64>, Vec<f64>)], deviation: &[f64]) -> Option<Self> {
        /// Readings that make a line.
        const LEAST: usize = 3;
        if steps.len() < LEAST {
            return None;
        }
        let pushed: Vec<f64> = steps.iter().map(|(mm, n, _)| n.unwrap_or(*mm)).collect();
        let count = pushed.len() as f64;
        let middle = pushed.iter().sum::<f64>() / count;
        let square: f64 = pushed.iter().map(|x| (x - middle).powi(2)).sum();
        if square <= 0.0 {
            return None;
        }
        let slope = |c: usize| {
            let along = pushed.iter().zip(steps);
            along.map(|(x, step)| (x - middle) * step.2[c]).sum::<f64>() / square
        };
        Some(Self {
            early,
            slopes: (0..deviation.len()).map(slope).collect(),
            deviations: deviation.iter().map(|d| d / square.sqrt()).collect(),
        })
    }

    /// What is not as it was, for people. `near` (m) is what the tip may come earlier or later.
    #[must_use]
    pub fn differs(&self, before: &Self, near: f64) -> Option<String> {
        /// Share of an answer that may change with wear, warmth and friction: about half a millimetre on a limb like the paper's.
        const SAME: f64 = 0.03;
        /// Deviations that are no noise.
        const SURE: f64 = 6.0;
        let earlier = self.early - before.early;
        if earlier.abs() > near {
            return Some(format!(
                "the tip meets it {:.2} mm {} than at first",
                units::mm(earlier.abs()),
                if earlier > 0.0 { "earlier" } else { "later" }
            ));
        }
        if self.slopes.len() != before.slopes.len() {
            return Some("the board has another number of channels".into());
        }
        let pairs = || self.slopes.iter().zip(&before.slopes);
        let off = norm(pairs().map(|(a, b)| a - b));
        let own = norm(before.slopes.iter().copied());
        let noise = norm(self.deviations.iter().chain(&before.deviations).copied());
        (off > (SAME * own).max(SURE * noise)).then(|| {
            format!(
                "the gauges answer by {:.0} % otherwise than at first",
                100.0 * off / own.max(f64::MIN_POSITIVE)
            )
        })
    }
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|v| v * v).sum::<f64>().sqrt()
}

impl Check {
    /// Whether the reference is to be pressed before anything else, `left` presses being still to be made.
    pub fn is_due(&self, left: usize) -> bool {
        let since = self.since.len();
        let due = !self.begun || since >= self.every || (left == 0 && since > 0);
        self.reference.is_some() && due
    }

    /// A press was made.
    pub fn made(&mut self, number: usize, planned: Planned) {
        if self.reference.is_some() {
            self.since.push((number, planned));
        }
    }

    /// A press failed. Whether the reference is pressed before that is believed.
    pub fn look_first(&mut self, number: usize, planned: Planned, why: &str) -> bool {
        let looks = self.reference.is_some();
        if looks {
            self.failed.push((number, planned, why.to_owned()));
            self.begun = false;
        }
        looks
    }

    /// The reference is pressed from now on.
    pub fn begin(&mut self) {
        self.now = true;
        self.steps.clear();
    }

    /// It was met there, before the place as planned (m).
    pub fn met(&mut self, early: f64) {
        self.early = early;
    }

    /// A reading of it, at a depth (m) and a force (N).
    pub fn read(&mut self, depth: f64, force: Option<f64>, reading: &SampleMean, rest: &[f64]) {
        let mean = reading.mean();
        let change = mean.iter().zip(rest).map(|(m, r)| m - r).collect();
        self.steps.push((units::mm(depth), force, change));
        self.deviation = reading.deviation_of_mean();
    }

    /// What it answered, or why it did not.
    pub fn answer(
        &self,
        failed: Option<String>,
        gauges: impl Fn(usize) -> bool,
    ) -> Result<CheckedForce, String> {
        if let Some(why) = failed {
            return Err(why);
        }
        let fit = CheckedForce::fit(self.early, &self.steps, &self.deviation);
        let mut answer = fit.ok_or("too little was read there")?;
        for channel in (0..answer.slopes.len()).filter(|c| !gauges(*c)) {
            (answer.slopes[channel], answer.deviations[channel]) = (0.0, 0.0);
        }
        Ok(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_a_line_and_differs_by_place_or_by_gauges() {
        let steps: Vec<_> = (0..8)
            .map(|k| {
                let n = 1.0 + f64::from(k);
                (
                    0.15 * f64::from(k),
                    Some(n),
                    vec![3.0 + 40.0 * n, -20.0 * n],
                )
            })
            .collect();
        let first = CheckedForce::fit(1e-4, &steps, &[0.1, 0.1]).unwrap();
        assert!((first.slopes[0] - 40.0).abs() < 1e-9 && (first.slopes[1] + 20.0).abs() < 1e-9);
        assert_eq!(first.differs(&first, 2e-4), None);
        let later = CheckedForce {
            early: -3e-4,
            ..first.clone()
        };
        assert!(
            later
                .differs(&first, 2e-4)
                .unwrap()
                .contains("0.40 mm later")
        );
        let other = CheckedForce {
            slopes: vec![40.0, -23.0],
            ..first.clone()
        };
        assert!(other.differs(&first, 2e-4).unwrap().contains("by 7 %"));
        // Noise is no change.
        let vague = CheckedForce {
            deviations: vec![1.0, 1.0],
            ..other
        };
        assert_eq!(vague.differs(&first, 2e-4), None);
        assert_eq!(CheckedForce::fit(0.0, &steps[..2], &[0.1, 0.1]), None);
    }
}
