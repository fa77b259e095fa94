//! An old estimator brought up to date by a few new presses: each channel's gain and rest are fitted anew.
//!
//! What changes on a skin between two days is mostly of its channels: an amplifier's gain, a rest that crept, a gauge that was glued
//! anew. A reading v' = g v + b of a channel is then what the estimator knows as v, and because features begin with
//! (v - middle) / spread, a new middle and a new spread say all of it: the file keeps its format and its known touches.
//!
//! The new presses are fitted in the sense of least squares over the errors that the estimator is expected to have at them, with
//! gains near one and rests near where they were (a Gaussian prior), by Gauss and Newton with K. Levenberg's damping. How wide
//! that prior is, or whether anything is changed at all, is chosen by presses that are left out.

use faer::Mat;
use faer::prelude::Solve;

use super::doubt::NORMAL_MEAN;
use super::estimator::{Estimate, TouchEstimator};
use super::lessons::{LearningError, MeasuredTouches, columns};
use super::score::Scores;
use crate::budget::{Watch, report};
use crate::regression::folds::{Folds, number_of};
use crate::statistics::mean;

/// What came of new presses.
#[derive(Clone, Debug, PartialEq)]
pub struct Updated {
    /// The estimator with its channels as they are now.
    pub estimator: TouchEstimator,
    /// How much more each channel reads than it did (1: as before); 1 for one that says nothing.
    pub gains: Vec<f64>,
    /// How far the rest of each has moved, in the unit of the readings.
    pub rests: Vec<f64>,
    /// The old estimator on the new presses.
    pub before: Scores,
    /// The new one on them, each judged by the others alone.
    pub after: Scores,
    /// The width of the prior that was taken: of gains, as a share, and of rests, over the channel's spread; nothing where
    /// the old estimator does as well.
    pub prior: Option<f64>,
}

/// Places that are needed.
pub const LEAST: usize = 5;
/// Widths that are tried: rests and gains may be off by so much.
const WIDTHS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// Parts that the presses are left out in.
const PARTS: usize = 5;

/// Fits channels to new presses.
///
/// # Errors
/// [`LearningError`] for too few places, or when the watch asks for a stop.
pub fn update(
    old: &TouchEstimator,
    lessons: &MeasuredTouches,
    seed: u64,
    watch: Watch,
) -> Result<Updated, LearningError> {
    let places = number_of(lessons.groups);
    if places < LEAST {
        return Err(LearningError::TooFewPresses {
            places,
            least: LEAST,
        });
    }
    let folds = Folds::of_groups(lessons.groups, PARTS.min(places), seed);
    let fit = UpdateFit { old, lessons };
    let all: Vec<usize> = (0..lessons.places_mm.len()).collect();
    let before = old.find(lessons.x);
    let mut best = (
        None,
        mean(&errors(&before, lessons.places_mm)),
        before.clone(),
    );
    for (k, width) in WIDTHS.into_iter().enumerate() {
        report(watch, "Fitting channels", k, WIDTHS.len())?;
        let mut answers = before.clone();
        for part in &folds.parts {
            let left = &folds.order[part.clone()];
            let learned: Vec<usize> = all.iter().copied().filter(|t| !left.contains(t)).collect();
            let changed = fit.with(&fit.solve(&learned, width));
            let said = changed.find(&lessons.x.select_columns(left));
            for (&t, answer) in left.iter().zip(said) {
                answers[t] = answer;
            }
        }
        let error = mean(&errors(&answers, lessons.places_mm));
        // What is no better than a hundredth is not worth a change.
        if error < best.1 * 0.99 {
            best = (Some(width), error, answers);
        }
    }
    let (prior, _, answers) = best;
    let change = prior.map_or_else(|| fit.nothing(), |width| fit.solve(&all, width));
    let mut estimator = fit.with(&change);
    estimator.doubt.factor *= wider(&answers, lessons.places_mm);
    let scores = |answers: &[Estimate]| Scores::of(answers, lessons.places_mm, lessons.forces);
    let spread = &old.inputs.spread;
    let mut gains = vec![1.0; old.channels()];
    let mut rests = vec![0.0; old.channels()];
    for (k, c) in old.inputs.live().into_iter().enumerate() {
        gains[c] = change.gains[k].exp();
        rests[c] = change.rests[k] * spread[c];
    }
    Ok(Updated {
        before: scores(&before),
        after: scores(&answers),
        estimator,
        gains,
        rests,
        prior,
    })
}

fn errors(answers: &[Estimate], places_mm: &[[f64; 3]]) -> Vec<f64> {
    answers
        .iter()
        .zip(places_mm)
        .map(|(a, p)| off(a, p))
        .collect()
}

fn off(answer: &Estimate, place: &[f64; 3]) -> f64 {
    let squares = (0..3).map(|k| (answer.place_mm[k] - place[k]).powi(2));
    squares.sum::<f64>().sqrt()
}

/// By how much radii must be wider than they were thought to be, from answers to presses that were left out; as many presses
/// that are as expected stand beside them.
fn wider(answers: &[Estimate], places_mm: &[[f64; 3]]) -> f64 {
    const BEFOREHAND: f64 = 5.0;
    let over = answers.iter().zip(places_mm).map(|(a, p)| {
        let expected = NORMAL_MEAN * a.radius_mm;
        off(a, p) / expected.max(f64::MIN_POSITIVE)
    });
    let sum: f64 = over.sum();
    (sum + BEFOREHAND) / (answers.len() as f64 + BEFOREHAND)
}

/// What is fitted, a live channel each.
#[derive(Clone, Debug)]
struct ChannelUpdate {
    /// Logarithms of the gains.
    gains: Vec<f64>,
    /// Over the channel's spread.
    rests: Vec<f64>,
}

struct UpdateFit<'a> {
    old: &'a TouchEstimator,
    lessons: &'a MeasuredTouches<'a>,
}

impl UpdateFit<'_> {
    fn nothing(&self) -> ChannelUpdate {
        let live = self.old.inputs.live().len();
        ChannelUpdate {
            gains: vec![0.0; live],
            rests: vec![0.0; live],
        }
    }

    /// The old estimator with its channels changed.
    fn with(&self, change: &ChannelUpdate) -> TouchEstimator {
        let mut changed = self.old.clone();
        let inputs = &mut changed.inputs;
        for (k, c) in self.old.inputs.live().into_iter().enumerate() {
            let gain = change.gains[k].exp();
            // v' = g v + b: what lay at the middle reads so now.
            inputs.middle[c] = gain * inputs.middle[c] + change.rests[k] * inputs.spread[c];
            inputs.spread[c] *= gain;
        }
        changed
    }

    /// Least squares over some of the presses, with a prior of a width.
    fn solve(&self, presses: &[usize], width: f64) -> ChannelUpdate {
        const STEPS: usize = 12;
        let mut damping = 1e-2;
        let mut change = self.nothing();
        let mut cost = self.cost(&change, presses, width);
        for _ in 0..STEPS {
            let step = self.step(&change, presses, width, damping);
            let tried = ChannelUpdate {
                gains: added(&change.gains, &step[..change.gains.len()]),
                rests: added(&change.rests, &step[change.gains.len()..]),
            };
            let new = self.cost(&tried, presses, width);
            if new < cost {
                let done = cost - new < 1e-4 * cost;
                (change, cost) = (tried, new);
                damping *= 0.2;
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        change
    }

    fn cost(&self, change: &ChannelUpdate, presses: &[usize], width: f64) -> f64 {
        let (residuals, _) = self.residuals(&self.with(change), presses);
        let own = change.gains.iter().chain(&change.rests);
        let own: f64 = own.map(|v| (v / width).powi(2)).sum();
        residuals.iter().map(|r| r * r).sum::<f64>() + own
    }

    /// Errors of places, and of forces where both are known, over what is expected of them; and the features.
    fn residuals(&self, changed: &TouchEstimator, presses: &[usize]) -> (Vec<f64>, Mat<f64>) {
        let features = changed
            .inputs
            .apply(&self.lessons.x.select_columns(presses));
        (self.of_features(&features, presses), features)
    }

    fn of_features(&self, features: &Mat<f64>, presses: &[usize]) -> Vec<f64> {
        /// What a force is expected to be off by, of itself and at least (N).
        const FORCE: [f64; 2] = [0.1, 0.3];
        let old = self.old;
        let squared = old.place.squared_distances(features);
        let places = old.frame.back(&old.place.answer(&squared));
        let radii = old.doubt.radii(&squared);
        let mut all = Vec::with_capacity(4 * presses.len());
        for ((&t, place), radius) in presses.iter().zip(&places).zip(radii) {
            let expected = (NORMAL_MEAN * radius * old.frame.size).max(f64::MIN_POSITIVE);
            let truth = &self.lessons.places_mm[t];
            all.extend((0..3).map(|k| (place[k] - truth[k]) / expected));
        }
        if let (Some(force), false) = (&old.force, self.lessons.forces.is_empty()) {
            let squared = force.machine.squared_distances(features);
            let said = force.scale.back(&force.machine.answer(&squared));
            for (&t, said) in presses.iter().zip(said) {
                let truth = self.lessons.forces[t];
                all.push((said - truth) / (FORCE[0] * truth.abs()).max(FORCE[1]));
            }
        }
        all
    }

    /// A damped step of gains and rests. A change of a channel moves its own feature alone, so that slopes over features are
    /// enough.
    fn step(
        &self,
        change: &ChannelUpdate,
        presses: &[usize],
        width: f64,
        damping: f64,
    ) -> Vec<f64> {
        let changed = self.with(change);
        let (residuals, features) = self.residuals(&changed, presses);
        let live = changed.inputs.live();
        let (n, count) = (live.len(), presses.len());
        let raw = columns(&self.lessons.x.select_columns(presses));
        let mut slopes = Mat::<f64>::zeros(residuals.len(), 2 * n);
        for (k, &c) in live.iter().enumerate() {
            let slope = self.slope(&features, presses, k);
            let inputs = &changed.inputs;
            let deviation = inputs.standard.deviation[c];
            let gain = change.gains[k].exp();
            for (row, value) in slope.iter().enumerate() {
                let t = press_of(row, count);
                let z = (raw[(t, c)] - inputs.middle[c]) / inputs.spread[c];
                let bend = 1.0 / (deviation * z.hypot(1.0));
                // z = (v' - b) / (g s) - m / s: by ln g it changes by minus itself and the middle, by b / s by -1 / g.
                let by_gain = -(z + self.old.inputs.middle[c] / self.old.inputs.spread[c]);
                slopes[(row, k)] = value * bend * by_gain;
                slopes[(row, n + k)] = -value * bend / gain;
            }
        }
        let theta: Vec<f64> = change.gains.iter().chain(&change.rests).copied().collect();
        let mut normal = slopes.transpose() * &slopes;
        let mut right = Mat::<f64>::zeros(2 * n, 1);
        for i in 0..2 * n {
            let sum: f64 = (0..residuals.len())
                .map(|r| slopes[(r, i)] * residuals[r])
                .sum();
            right[(i, 0)] = -sum - theta[i] / width.powi(2);
            normal[(i, i)] += width.powi(-2);
            normal[(i, i)] *= 1.0 + damping;
        }
        let solved = normal.partial_piv_lu().solve(&right);
        (0..2 * n).map(|i| solved[(i, 0)]).collect()
    }

    /// How residuals change with a feature, by central differences.
    fn slope(&self, features: &Mat<f64>, presses: &[usize], k: usize) -> Vec<f64> {
        const STEP: f64 = 1e-4;
        let moved = |by: f64| {
            let mut moved = features.clone();
            for t in 0..moved.nrows() {
                moved[(t, k)] += by;
            }
            self.of_features(&moved, presses)
        };
        let (forth, back) = (moved(STEP), moved(-STEP));
        let both = forth.iter().zip(&back);
        both.map(|(f, b)| (f - b) / (2.0 * STEP)).collect()
    }
}

/// Which press a residual is of: three a press, and then one.
fn press_of(row: usize, presses: usize) -> usize {
    if row < 3 * presses {
        row / 3
    } else {
        row - 3 * presses
    }
}

fn added(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;
    use crate::learning::{Family, TrainingRequest, train};

    const CHANNELS: usize = 6;

    /// Presses on a square plate whose channels read what lies near them.
    fn presses(count: usize, seed: u64) -> (SignalMatrix, Vec<[f64; 3]>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let places: Vec<[f64; 3]> = (0..count)
            .map(|_| [60.0 * rng.random::<f64>(), 60.0 * rng.random::<f64>(), 0.0])
            .collect();
        let gauge = |c: usize| {
            let turn = c as f64 * 1.05;
            [30.0 + 25.0 * turn.cos(), 30.0 + 25.0 * turn.sin()]
        };
        let mut values = Vec::new();
        for c in 0..CHANNELS {
            let [x, y] = gauge(c);
            values.extend(places.iter().map(|p| {
                let far = (p[0] - x).powi(2) + (p[1] - y).powi(2);
                500.0 * (-far / 800.0).exp() - 40.0
            }));
        }
        (SignalMatrix::new(count, values), places)
    }

    fn changed(x: &SignalMatrix) -> SignalMatrix {
        let columns = x.columns();
        let gains = [1.15, 0.85, 1.0, 1.25, 0.9, 1.05];
        let rests = [30.0, 0.0, -25.0, 10.0, 0.0, 40.0];
        let values = x.values().iter().enumerate();
        let value = |(k, v): (usize, &f64)| gains[k / columns] * v + rests[k / columns];
        SignalMatrix::new(columns, values.map(value).collect())
    }

    fn lessons<'a>(
        x: &'a SignalMatrix,
        places_mm: &'a [[f64; 3]],
        groups: &'a [usize],
    ) -> MeasuredTouches<'a> {
        MeasuredTouches {
            x,
            places_mm,
            forces: &[],
            groups,
        }
    }

    #[test]
    fn a_few_presses_find_gains_and_rests_that_have_changed() {
        let groups: Vec<usize> = (0..500).collect();
        let (x, places) = presses(500, 1);
        let asked = TrainingRequest {
            family: Some(Family::KernelRidge),
            ..TrainingRequest::default()
        };
        let old = train(&lessons(&x, &places, &groups), &asked, &unwatched).unwrap();
        let (new_x, new_places) = presses(15, 2);
        let new_x = changed(&new_x);
        let few = lessons(&new_x, &new_places, &groups[..15]);
        let found = update(&old.estimator, &few, 0, &unwatched).unwrap();
        assert!(found.prior.is_some());
        // On presses that nobody has seen.
        let (x, places) = presses(200, 3);
        let x = changed(&x);
        let error = |of: &TouchEstimator| mean(&errors(&of.find(&x), &places));
        let (before, after) = (error(&old.estimator), error(&found.estimator));
        assert!(before > 3.0 && after < 0.35 * before, "{before} {after}");
        // Where only places are known, a gain that all channels share hardly shows; how they differ does.
        let ratio = found.gains[3] / found.gains[1];
        assert!((ratio / (1.25 / 0.85) - 1.0).abs() < 0.25, "{ratio}");
        assert!((found.after.mean_mm / after - 1.0).abs() < 1.0);
    }

    #[test]
    fn what_is_as_it_was_is_left() {
        let groups: Vec<usize> = (0..500).collect();
        let (x, places) = presses(500, 1);
        let old = train(
            &lessons(&x, &places, &groups),
            &TrainingRequest {
                family: Some(Family::KernelRidge),
                ..TrainingRequest::default()
            },
            &unwatched,
        )
        .unwrap();
        let (x, places) = presses(12, 5);
        let few = lessons(&x, &places, &groups[..12]);
        let found = update(&old.estimator, &few, 0, &unwatched).unwrap();
        let off = |g: f64| (g - 1.0).abs();
        assert!(
            found.gains.iter().all(|&g| off(g) < 0.02),
            "{:?}",
            found.gains
        );
        let said = update(
            &old.estimator,
            &lessons(&x, &places, &[0; 12]),
            0,
            &unwatched,
        );
        let said = said.unwrap_err().to_string();
        assert!(said.contains("at least 5"), "{said}");
    }
}
