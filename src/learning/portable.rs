//! A trained estimator as a board computes it: one reading at a time, with tables of single or double precision, and
//! nothing kept between two readings.
//!
//! [`answer`] follows `io::touch_source`'s C line by line, with every number rounded as it is there, so that it is known
//! beforehand how far a board's answers are from the program's.

use faer::Mat;

use super::doubt::NEAR;
use super::machine::{AnswerRule, Regression};
use super::{Estimate, TouchEstimator};

/// How numbers are kept on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// `float`.
    Single,
    /// `double`.
    Double,
}

impl Precision {
    fn round(self, value: f64) -> f64 {
        match self {
            Self::Single => f64::from(value as f32),
            Self::Double => value,
        }
    }

    /// Bytes of a number.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Single => 4,
            Self::Double => 8,
        }
    }
}

/// The touches that are nearest to a reading, nearest first, as squared distance and number.
struct NearestTouches {
    most: usize,
    found: Vec<(f64, usize)>,
}

impl NearestTouches {
    fn take(&mut self, squared: f64, number: usize) {
        let full = self.found.len() == self.most;
        if full && self.found.last().is_none_or(|worst| squared >= worst.0) {
            return;
        }
        if full {
            self.found.pop();
        }
        let place = self.found.partition_point(|known| known.0 <= squared);
        self.found.insert(place, (squared, number));
    }
}

/// How many near touches have to be kept: for the radius, and for a mean of them.
#[must_use]
pub fn kept(machine: &Regression) -> usize {
    match machine.by {
        AnswerRule::Kernel { .. } => NEAR,
        AnswerRule::Nearest { count, .. } => count.max(NEAR),
    }
    .min(machine.points.nrows())
}

/// What a board makes of a reading (a number a channel).
#[must_use]
pub fn answer(estimator: &TouchEstimator, reading: &[f64], precision: Precision) -> Estimate {
    let r = |x: f64| precision.round(x);
    let features = features(estimator, reading, precision);
    let (outputs, near) = run(&estimator.place, &features, precision);
    let frame = &estimator.frame;
    let place_mm = [0, 1, 2].map(|a| {
        let axes = frame.axes.iter().zip(&outputs);
        let sum = axes.fold(0.0, |sum, (axis, out)| r(sum + r(out * r(axis[a]))));
        r(r(frame.middle[a]) + r(r(frame.size) * sum))
    });
    let doubt = &estimator.doubt;
    let off = near
        .iter()
        .take(NEAR)
        .fold(0.0, |sum, n| r(sum + r(doubt.off[n.1])));
    let first = near.first().map_or(0.0, |n| r(n.0.sqrt()));
    let strange = r(first / r(doubt.usual.max(f64::from(f32::MIN_POSITIVE)))).max(1.0);
    let expected = r(r(r(off / near.len().clamp(1, NEAR) as f64).sqrt()) * strange);
    Estimate {
        place_mm,
        radius_mm: r(expected * r(doubt.factor * frame.size)),
        force_n: estimator.force.as_ref().map(|force| {
            let (outputs, _) = run(&force.machine, &features, precision);
            r(r(force.scale.middle) + r(r(force.scale.size) * outputs[0])).max(0.0)
        }),
    }
}

fn features(estimator: &TouchEstimator, reading: &[f64], precision: Precision) -> Vec<f64> {
    let r = |x: f64| precision.round(x);
    let inputs = &estimator.inputs;
    let of = |c: usize| {
        let off = r(r(r(reading[c]) - r(inputs.middle[c])) / r(inputs.spread[c]));
        let bent = r(off.asinh());
        r(r(bent - r(inputs.standard.mean[c])) / r(inputs.standard.deviation[c]))
    };
    inputs.live().into_iter().map(of).collect()
}

/// The outputs of a machine and the touches near by.
fn run(
    machine: &Regression,
    features: &[f64],
    precision: Precision,
) -> (Vec<f64>, Vec<(f64, usize)>) {
    let r = |x: f64| precision.round(x);
    let asked: Vec<f64> = (features.iter().zip(&machine.lengths))
        .map(|(f, length)| r(f / r(*length)))
        .collect();
    let most = kept(machine);
    let mut near = NearestTouches {
        most,
        found: Vec::with_capacity(most),
    };
    let mut outputs = match &machine.by {
        AnswerRule::Kernel { bias, .. } => bias.iter().map(|b| r(*b)).collect(),
        AnswerRule::Nearest { outputs, .. } => vec![0.0; outputs.ncols()],
    };
    for i in 0..machine.points.nrows() {
        let squared = asked.iter().enumerate().fold(0.0, |sum, (j, q)| {
            let apart = r(q - r(machine.points[(i, j)]));
            r(sum + r(apart * apart))
        });
        near.take(squared, i);
        if let AnswerRule::Kernel {
            kernel, weights, ..
        } = &machine.by
        {
            let value = r(kernel.at(squared));
            for (k, out) in outputs.iter_mut().enumerate() {
                *out = r(*out + r(value * r(weights[(i, k)])));
            }
        }
    }
    if let AnswerRule::Nearest {
        outputs: known,
        count,
    } = &machine.by
    {
        outputs = mean(
            known,
            &near.found[..(*count).min(near.found.len())],
            precision,
        );
    }
    (outputs, near.found)
}

fn mean(known: &Mat<f64>, near: &[(f64, usize)], precision: Precision) -> Vec<f64> {
    let r = |x: f64| precision.round(x);
    let weight = |squared: f64| r(r(squared.sqrt()).max(r(1e-12)).recip());
    let total = near.iter().fold(0.0, |sum, n| r(sum + weight(n.0)));
    let of = |k: usize| {
        let sum = near
            .iter()
            .fold(0.0, |sum, n| r(sum + r(weight(n.0) * r(known[(n.1, k)]))));
        r(sum / total)
    };
    (0..known.ncols()).map(of).collect()
}

/// Readings to try a board's answers on: known touches, evenly chosen, and what lies halfway between them and the next.
#[must_use]
pub fn trials(estimator: &TouchEstimator, count: usize) -> Vec<Vec<f64>> {
    let machine = &estimator.place;
    let known = machine.points.nrows();
    let step = known.div_ceil(count.div_ceil(2).max(1)).max(1);
    let feature = |i: usize, j: usize| machine.points[(i, j)] * machine.lengths[j];
    let reading = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let (inputs, live) = (&estimator.inputs, estimator.inputs.live());
        let mut reading = inputs.middle.clone();
        for (j, &c) in live.iter().enumerate() {
            let bent = inputs.standard.mean[c] + inputs.standard.deviation[c] * of(j);
            reading[c] += inputs.spread[c] * bent.sinh();
        }
        reading
    };
    (0..known)
        .step_by(step)
        .flat_map(|i| {
            let next = (i + step) % known;
            let own = reading(&|j| feature(i, j));
            let between = reading(&|j| f64::midpoint(feature(i, j), feature(next, j)));
            [own, between]
        })
        .collect()
}
