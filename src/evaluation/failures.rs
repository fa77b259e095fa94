//! What is left of a set of gauges when some of them have failed.

use rayon::prelude::*;
use serde::Serialize;

use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::draw::{binomial, subsets};
use crate::regression::tune::{Effort, distances};
use crate::regression::{Hyper, PositionModel};

/// A set with the touches to learn from and those to judge on.
pub struct FailureTrial<'a> {
    /// Signals of the set (gauges × touches).
    pub train: &'a SignalMatrix,
    /// Where the training touches were (mm).
    pub train_targets: &'a [[f64; 3]],
    /// Signals of the same gauges under the test touches (gauges × touches).
    pub test: &'a SignalMatrix,
    /// Where the test touches were (mm).
    pub test_targets: &'a [[f64; 3]],
    /// Tuned for the whole set; γ grows as gauges are lost, because distances shrink.
    pub hyper: Hyper,
    /// Of each fit.
    pub effort: Effort,
    /// Most failed gauges.
    pub failed: usize,
    /// Most subsets of failed gauges that are retrained for; ten times as many are tried without.
    pub subsets: usize,
    /// Of the draw of subsets.
    pub seed: u64,
}

/// Errors with a number of failed gauges (mm).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureRow {
    /// How many gauges failed.
    pub failed: usize,
    /// Whether the regression was trained anew without them; otherwise they report their mean.
    pub retrained: bool,
    /// Subsets tried, of all there are.
    pub subsets: usize,
    /// How many such subsets there are.
    pub of: u64,
    /// Mean over the subsets of the mean error, and the largest.
    pub error_mm: f64,
    /// The largest of these means (mm).
    pub worst_mm: f64,
}

/// Most gauges that fail together.
pub const MOST_FAILED: usize = 5;

/// Subsets of failed gauges that are tried: all there are, or so many of them drawn by a seed.
pub(crate) struct Draw {
    pub gauges: usize,
    pub failed: usize,
    /// Most subsets.
    pub most: usize,
    pub seed: u64,
}

impl Draw {
    /// What the loss of each subset leaves of a set of gauges, by its error (mm).
    ///
    /// # Errors
    /// [`Cancelled`] when `error` says so.
    pub(crate) fn row(
        &self,
        retrained: bool,
        error: impl Fn(&[usize]) -> Result<f64, Cancelled> + Sync,
    ) -> Result<FailureRow, Cancelled> {
        let subsets = subsets(self.gauges, self.failed, self.most, self.seed);
        let errors: Result<Vec<f64>, Cancelled> =
            subsets.par_iter().map(|lost| error(lost)).collect();
        let errors = errors?;
        Ok(FailureRow {
            failed: self.failed,
            retrained,
            subsets: errors.len(),
            of: binomial(self.gauges, self.failed),
            error_mm: errors.iter().sum::<f64>() / errors.len() as f64,
            worst_mm: errors.iter().copied().fold(0.0, f64::max),
        })
    }
}

impl FailureRow {
    /// With all gauges.
    pub(crate) fn unharmed(error_mm: f64) -> Self {
        Self {
            failed: 0,
            retrained: false,
            subsets: 1,
            of: 1,
            error_mm,
            worst_mm: error_mm,
        }
    }
}

/// Every subset of one to so many failed gauges: all where they are few, a seeded sample otherwise. The
/// first row has none failed.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn failures(trial: &FailureTrial, watch: Watch) -> Result<Vec<FailureRow>, Cancelled> {
    let gauges = trial.train.rows();
    let whole = PositionModel::train(trial.train, trial.train_targets, &trial.hyper, trial.effort);
    let mean = |p: &[[f64; 3]]| {
        let d = distances(p, trial.test_targets);
        d.iter().sum::<f64>() / d.len().max(1) as f64
    };
    let mut rows = vec![FailureRow::unharmed(mean(&whole.predict(trial.test)))];
    for failed in 1..=trial.failed.min(gauges.saturating_sub(1)) {
        for retrained in [false, true] {
            let draw = Draw {
                gauges,
                failed,
                most: trial.subsets * if retrained { 1 } else { 10 },
                seed: trial.seed,
            };
            rows.push(draw.row(retrained, |lost| {
                report(watch, "Failing gauges", failed - 1, trial.failed)?;
                Ok(mean(&if retrained {
                    trial.without(lost)
                } else {
                    whole.predict_without(trial.test, lost)
                }))
            })?);
        }
    }
    Ok(rows)
}

impl FailureTrial<'_> {
    /// Predictions of a regression that never knew the lost gauges.
    fn without(&self, lost: &[usize]) -> Vec<[f64; 3]> {
        let left: Vec<usize> = (0..self.train.rows())
            .filter(|g| !lost.contains(g))
            .collect();
        let hyper = Hyper {
            gamma: self.hyper.gamma * self.train.rows() as f64 / left.len() as f64,
            ..self.hyper
        };
        let train = self.train.select_rows(&left);
        let model = PositionModel::train(&train, self.train_targets, &hyper, self.effort);
        model.predict(&self.test.select_rows(&left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;

    #[test]
    fn a_lost_gauge_costs_most_where_nothing_replaces_it() {
        // Gauges 0 and 1 both report x, gauge 2 alone reports y, gauge 3 alone z.
        let point = |t: usize| {
            let t = t as f64;
            [(0.37 * t).sin(), (0.71 * t + 1.0).sin(), (1.3 * t).cos()]
        };
        let matrix = |touches: std::ops::Range<usize>| {
            let values = [0, 0, 1, 2]
                .into_iter()
                .flat_map(|a| touches.clone().map(move |t| point(t)[a]))
                .collect();
            SignalMatrix::new(touches.len(), values)
        };
        let targets = |touches: std::ops::Range<usize>| -> Vec<[f64; 3]> {
            touches.map(|t| point(t).map(|v| 10.0 * v)).collect()
        };
        let (train, test) = (matrix(0..200), matrix(200..260));
        let trial = FailureTrial {
            train: &train,
            train_targets: &targets(0..200),
            test: &test,
            test_targets: &targets(200..260),
            hyper: Hyper {
                c: 100.0,
                epsilon: 0.05,
                gamma: 0.2,
            },
            effort: Effort {
                tolerance: 0.01,
                max_steps: 1_000_000,
            },
            failed: 2,
            subsets: 6,
            seed: 0,
        };
        let rows = failures(&trial, &unwatched).unwrap();
        assert_eq!(rows.len(), 5);
        assert!(rows[0].error_mm < 0.5, "{rows:?}");
        let one = rows.iter().find(|r| r.failed == 1 && r.retrained).unwrap();
        // Losing one of the twins costs nothing, losing y or z costs about its spread.
        assert_eq!((one.subsets, one.of), (4, 4));
        assert!(
            one.worst_mm > 4.0 && one.error_mm < 0.6 * one.worst_mm,
            "{one:?}"
        );
        let silent = rows.iter().find(|r| r.failed == 1 && !r.retrained).unwrap();
        assert!(silent.error_mm > one.error_mm);
    }
}
