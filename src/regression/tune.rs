//! A model for the three coordinates, and the search for its settings by cross-validation.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::features::Standardizer;
use super::folds::Folds;
use super::kernel::{gaussian, squared_distances};
use super::places::Grouping;
use super::svr::{self, Problem, Start, SvrFit};
use crate::budget::{Cancelled, Progress, Watch, Work, report};
use crate::dataset::SignalMatrix;

/// Settings of the regression; targets are in millimetres, features standardized.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hyper {
    /// Bound of the coefficients (mm).
    pub c: f64,
    /// Half-width of the tube without loss (mm).
    pub epsilon: f64,
    /// Of the Gaussian kernel exp(-γ d²).
    pub gamma: f64,
}

impl Default for Hyper {
    /// What a trial found good with ten gauges on the bundled limb; for parts of another size see
    /// [`super::scale`].
    fn default() -> Self {
        Self {
            c: 200.0,
            epsilon: 0.1,
            gamma: 0.3,
        }
    }
}

/// Effort of one fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Tolerance of the optimality conditions (mm).
    pub tolerance: f64,
    /// Most steps.
    pub max_steps: usize,
}

impl Effort {
    /// For targets so many times as large.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self {
            tolerance: self.tolerance * by,
            ..self
        }
    }
}

impl Hyper {
    /// For targets so many times as large: the same model of them.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self {
            c: self.c * by,
            epsilon: self.epsilon * by,
            ..self
        }
    }

    /// For one fit of this effort.
    #[must_use]
    pub fn params(&self, effort: Effort) -> svr::SvrParams {
        svr::SvrParams {
            c: self.c,
            epsilon: self.epsilon,
            tolerance: effort.tolerance,
            max_steps: effort.max_steps,
        }
    }
}

/// Three fits, one a coordinate, on one kernel.
#[derive(Clone, Debug)]
pub struct PositionModel {
    standardizer: Standardizer,
    training: SignalMatrix,
    gamma: f64,
    fits: [SvrFit; 3],
    /// What the fits took.
    pub work: Work,
}

impl PositionModel {
    /// Trains on signals (sites × touches) and touch positions (mm).
    #[must_use]
    pub fn train(x: &SignalMatrix, targets: &[[f64; 3]], hyper: &Hyper, effort: Effort) -> Self {
        let standardizer = Standardizer::of(x);
        let training = standardizer.apply(x);
        let kernel = gaussian(&squared_distances(&training, &training), hyper.gamma);
        let params = hyper.params(effort);
        let fit = |axis: usize| {
            let y: Vec<f64> = targets.iter().map(|t| t[axis]).collect();
            svr::fit(&kernel, &y, &params, None)
        };
        let fits: Vec<SvrFit> = [0, 1, 2].into_par_iter().map(fit).collect();
        let work = Work {
            kernel_evaluations: kernel.len() as u64,
            fits: 3,
            ..Work::default()
        };
        Self {
            standardizer,
            training,
            gamma: hyper.gamma,
            fits: fits
                .try_into()
                .unwrap_or_else(|_| unreachable!("three axes")),
            work,
        }
    }

    /// Predicted positions (mm) for new signals (sites × touches).
    #[must_use]
    pub fn predict(&self, x: &SignalMatrix) -> Vec<[f64; 3]> {
        self.predict_without(x, &[])
    }

    /// As [`Self::predict`], with some sites (rows) that have failed and report their mean.
    #[must_use]
    pub fn predict_without(&self, x: &SignalMatrix, failed: &[usize]) -> Vec<[f64; 3]> {
        let features = self.standardizer.apply(x).with_zero_rows(failed);
        let kernel = gaussian(&squared_distances(&features, &self.training), self.gamma);
        let axes = [0, 1, 2].map(|a| svr::predict(&self.fits[a], &kernel));
        (0..x.columns())
            .map(|t| axes.each_ref().map(|a| a[t]))
            .collect()
    }

    /// Whether every fit met its tolerance, and the largest violation left (mm).
    #[must_use]
    pub fn converged(&self) -> (bool, f64) {
        let gap = self.fits.iter().map(|f| f.gap).fold(0.0, f64::max);
        (self.fits.iter().all(|f| f.converged), gap)
    }
}

/// Euclidean distances between predicted and true positions (mm).
#[must_use]
pub fn distances(predicted: &[[f64; 3]], truth: &[[f64; 3]]) -> Vec<f64> {
    let distance =
        |(p, t): (&[f64; 3], &[f64; 3])| (0..3).map(|a| (p[a] - t[a]).powi(2)).sum::<f64>().sqrt();
    predicted.iter().zip(truth).map(distance).collect()
}

/// One point of a search: the settings and their cross-validated error (mm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TuningTrial {
    /// The settings.
    pub hyper: Hyper,
    /// Cross-validated error (mm).
    pub error_mm: f64,
}

/// The outcome of a search: the best settings and every trial, in order.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TuningSearch {
    /// Every trial, in order.
    pub trials: Vec<TuningTrial>,
}

impl TuningSearch {
    /// The settings with the smallest error; of those within a hundredth of it the smallest C, which is
    /// the smoothest model and the cheapest.
    #[must_use]
    pub fn best(&self) -> Hyper {
        let smallest = self
            .trials
            .iter()
            .map(|t| t.error_mm)
            .fold(f64::INFINITY, f64::min);
        self.trials
            .iter()
            .filter(|t| t.error_mm <= 1.01 * smallest)
            .min_by(|a, b| {
                a.hyper
                    .c
                    .total_cmp(&b.hyper.c)
                    .then(a.error_mm.total_cmp(&b.error_mm))
            })
            .map_or_else(Hyper::default, |t| t.hyper)
    }
}

/// The values a search looks at. γ is multiplied by 10 / sensors, because the squared distance between
/// standardized signals grows with their number. The default is for parts of the bundled limb's size.
#[derive(Clone, Debug, PartialEq)]
pub struct TuningGrid {
    /// Values of C (mm).
    pub c: Vec<f64>,
    /// Values of ε (mm).
    pub epsilon: Vec<f64>,
    /// Values of γ for ten gauges.
    pub gamma: Vec<f64>,
}

impl Default for TuningGrid {
    fn default() -> Self {
        Self {
            c: vec![20.0, 200.0, 2000.0],
            epsilon: vec![0.1, 0.3, 1.0],
            gamma: vec![0.02, 0.06, 0.2, 0.6, 2.0],
        }
    }
}

impl TuningGrid {
    /// For targets so many times as large.
    #[must_use]
    pub fn scaled(mut self, by: f64) -> Self {
        for value in self.c.iter_mut().chain(&mut self.epsilon) {
            *value *= by;
        }
        self
    }
}

/// What cross-validation spends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossValidation {
    /// Number of folds.
    pub folds: usize,
    /// Of the folds.
    pub seed: u64,
    /// What is never divided between folds.
    pub grouping: Grouping,
    /// Of each fit.
    pub effort: Effort,
}

/// Search by k-fold cross-validation on signals (sites × touches) and positions (mm): γ and C on the
/// whole grid at the middle ε, then ε at the best of them.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn search(
    x: &SignalMatrix,
    targets: &[[f64; 3]],
    grid: &TuningGrid,
    validation: &CrossValidation,
    watch: Watch,
) -> Result<(TuningSearch, Work), Cancelled> {
    let groups = validation.grouping.of(targets);
    let folds = Folds::of_groups(&groups, validation.folds, validation.seed);
    let z = Standardizer::of(x).apply(x).select_columns(&folds.order);
    let axis = |a: usize| folds.order.iter().map(|&t| targets[t][a]).collect();
    let bench = TuningFolds {
        squared: squared_distances(&z, &z),
        targets: [0, 1, 2].map(axis),
        folds,
        effort: validation.effort,
        watch,
    };
    let relative = 10.0 / x.rows().max(1) as f64;
    let middle = grid.epsilon[grid.epsilon.len() / 2];
    let columns: Result<Vec<Vec<TuningTrial>>, Cancelled> = grid
        .gamma
        .par_iter()
        .map(|g| bench.column(g * relative, middle, &grid.c))
        .collect();
    let mut search = TuningSearch {
        trials: columns?.into_iter().flatten().collect(),
    };
    let best = search.best();
    let others: Vec<f64> = grid
        .epsilon
        .iter()
        .copied()
        .filter(|&e| e != middle)
        .collect();
    let more: Result<Vec<Vec<TuningTrial>>, Cancelled> = others
        .par_iter()
        .map(|&e| bench.column(best.gamma, e, &[best.c]))
        .collect();
    search.trials.extend(more?.into_iter().flatten());
    let work = Work {
        kernel_evaluations: (bench.squared.len() * (grid.gamma.len() + others.len())) as u64,
        fits: (3 * bench.folds.parts.len() * search.trials.len()) as u64,
        ..Work::default()
    };
    Ok((search, work))
}

/// What all trials of one search share; touches in the order of their folds.
struct TuningFolds<'a> {
    squared: Vec<f64>,
    targets: [Vec<f64>; 3],
    folds: Folds,
    effort: Effort,
    watch: Watch<'a>,
}

impl TuningFolds<'_> {
    /// Trials over rising C on one kernel, each starting from the one before.
    fn column(&self, gamma: f64, epsilon: f64, c: &[f64]) -> Result<Vec<TuningTrial>, Cancelled> {
        let kernel = gaussian(&self.squared, gamma);
        let mut warm: Vec<Option<[Vec<f64>; 3]>> = vec![None; self.folds.parts.len()];
        let mut trials = Vec::with_capacity(c.len());
        for (k, &c) in c.iter().enumerate() {
            report(self.watch, STAGE, k, 3)?;
            let hyper = Hyper { c, epsilon, gamma };
            let sum = (0..warm.len())
                .map(|f| self.error(&kernel, f, &hyper, &mut warm[f]))
                .sum::<f64>();
            report(self.watch, STAGE, k, 3)?;
            let error_mm = sum / self.folds.parts.len() as f64;
            trials.push(TuningTrial { hyper, error_mm });
        }
        Ok(trials)
    }

    /// Mean Euclidean error (mm) on a fold's test touches of fits on all others, starting from and
    /// leaving behind the coefficients in `warm`.
    fn error(
        &self,
        kernel: &[f64],
        fold: usize,
        hyper: &Hyper,
        warm: &mut Option<[Vec<f64>; 3]>,
    ) -> f64 {
        let held_out = self.folds.parts[fold].clone();
        let now = Progress {
            stage: STAGE,
            done: 0,
            total: 3,
        };
        let stop = || (self.watch)(now).is_break();
        let fits = [0, 1, 2].map(|axis| {
            let problem = Problem {
                kernel,
                y: &self.targets[axis],
                held_out: held_out.clone(),
            };
            let start = warm.as_ref().map(|w| Start {
                beta: &w[axis],
                f: None,
            });
            svr::solve(&problem, &hyper.params(self.effort), start, &stop)
        });
        let error = mean_distance(&fits, held_out);
        *warm = Some(fits.map(|f| f.beta));
        error
    }
}

const STAGE: &str = "Tuning the regression";

/// Mean Euclidean length of the residuals of some fits (one a coordinate) at some points.
#[must_use]
pub fn mean_distance(fits: &[SvrFit], at: std::ops::Range<usize>) -> f64 {
    let count = at.len().max(1) as f64;
    let length = |i: usize| {
        fits.iter()
            .map(|f| f.residuals[i].powi(2))
            .sum::<f64>()
            .sqrt()
    };
    at.map(length).sum::<f64>() / count
}
