//! Greedy support-vector regression: the paper's Algorithm 1.
//!
//! Each step adds the site with which the cross-validated error of the regression is smallest; the
//! criterion is the mean over folds of the mean Euclidean error (mm). The algorithm is the plain one:
//! every candidate is fitted exactly, starting from the coefficients of the set chosen so far; a candidate
//! is given up as soon as the folds done already make it worse than the best (errors are not negative,
//! so that this is exact).

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::{PlacementError, Pool, Selection, Selector, SelectorKind, SensorSet, check_pool};
use crate::budget::{Achieved, Cancelled, StopReason, Watch, Work, report};
use crate::dataset::SignalMatrix;
use crate::regression::Hyper;
use crate::regression::features::{Standardizer, gaussian, squared_distances};
use crate::regression::tune::{Effort, Fold};

/// Settings of the selector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreedySvr {
    pub hyper: Hyper,
    pub folds: usize,
    pub seed: u64,
    pub effort: Effort,
}

/// Two candidates whose criteria differ by less than this share are tied; the lower site wins.
pub const TIE: f64 = 1e-9;

/// Candidates scored against the same bound.
const BATCH: usize = 16;

impl Selector for GreedySvr {
    fn kind(&self) -> SelectorKind {
        SelectorKind::GreedySvr
    }

    fn nested(&self) -> bool {
        true
    }

    fn select(
        &self,
        pool: &Pool,
        sensors: usize,
        watch: Watch,
    ) -> Result<Selection, PlacementError> {
        check_pool(pool, sensors)?;
        let least = 2 * self.folds.max(2);
        if pool.targets.len() < least {
            return Err(PlacementError::TooFewTouches {
                touches: pool.targets.len(),
                least,
            });
        }
        let mut search = Search::new(self, pool);
        let mut sets: Vec<SensorSet> = Vec::with_capacity(sensors);
        for step in 0..sensors {
            let (winner, criterion) = search.best_addition(step, sensors, watch)?;
            search.add(winner);
            sets.push(SensorSet {
                sites: search.chosen.iter().map(|&i| pool.sites[i]).collect(),
                criterion,
            });
        }
        Ok(Selection {
            selector: SelectorKind::GreedySvr,
            criterion_unit: "mm, cross-validated",
            pool: pool.sites.len(),
            achieved: Achieved {
                error_estimate: sets.last().map(|s| s.criterion),
                unit: "mm",
                effort: search.work(),
                stop_reason: if search.converged {
                    StopReason::Converged
                } else {
                    StopReason::EffortSpent
                },
                notes: search.notes(),
            },
            sets,
        })
    }
}

struct Search<'a> {
    settings: &'a GreedySvr,
    pool: &'a Pool<'a>,
    features: SignalMatrix,
    constant: Vec<usize>,
    folds: Vec<Fold>,
    chosen: Vec<usize>,
    /// exp(-γ d²) over the chosen sites, touches × touches.
    kernel: Vec<f64>,
    /// Coefficients of the chosen set, a fold: where the next step starts from.
    warm: Vec<Option<[Vec<f64>; 3]>>,
    /// Whether every winner's fits met their tolerance.
    converged: bool,
    fits: AtomicU64,
    kernel_evaluations: AtomicU64,
}

impl<'a> Search<'a> {
    fn new(settings: &'a GreedySvr, pool: &'a Pool<'a>) -> Self {
        let n = pool.targets.len();
        let standardizer = Standardizer::of(pool.x);
        let folds = Fold::all(n, settings.folds, settings.seed);
        Self {
            settings,
            pool,
            features: standardizer.apply(pool.x),
            constant: standardizer.constant_rows(),
            warm: vec![None; folds.len()],
            folds,
            chosen: Vec::new(),
            kernel: vec![1.0; n * n],
            converged: true,
            fits: AtomicU64::new(0),
            kernel_evaluations: AtomicU64::new(0),
        }
    }

    /// The kernel with one more site: a Gaussian kernel over a union is the product of the kernels.
    fn extended_kernel(&self, candidate: usize) -> Vec<f64> {
        let row = self.features.select_rows(&[candidate]);
        let mut kernel = gaussian(&squared_distances(&row, &row), self.settings.hyper.gamma);
        for (k, old) in kernel.iter_mut().zip(&self.kernel) {
            *k *= old;
        }
        self.kernel_evaluations
            .fetch_add(kernel.len() as u64, Ordering::Relaxed);
        kernel
    }

    /// Scores every site not chosen yet and returns the best with its criterion (mm).
    fn best_addition(
        &self,
        step: usize,
        steps: usize,
        watch: Watch,
    ) -> Result<(usize, f64), PlacementError> {
        let open: Vec<usize> = (0..self.pool.sites.len())
            .filter(|i| !self.chosen.contains(i) && !self.constant.contains(i))
            .collect();
        if open.is_empty() {
            return Err(PlacementError::TooFewSites {
                wanted: steps,
                available: step,
            });
        }
        let done = AtomicUsize::new(0);
        let mut bound = f64::INFINITY;
        let mut scores = Vec::with_capacity(open.len());
        // The bound moves between batches of fixed size only, so that the work counted does not depend
        // on which thread was first.
        for batch in open.chunks(BATCH) {
            let batch: Result<Vec<f64>, Cancelled> = batch
                .par_iter()
                .map(|&candidate| {
                    let total = self.pool.sites.len();
                    let so_far = step * total + done.fetch_add(1, Ordering::Relaxed);
                    report(watch, "Selecting by greedy SVR", so_far, steps * total)?;
                    Ok(self.score(candidate, bound))
                })
                .collect();
            scores.extend(batch?);
            bound = scores.iter().copied().fold(f64::INFINITY, f64::min);
        }
        let smallest = scores.iter().copied().fold(f64::INFINITY, f64::min);
        let winner = scores
            .iter()
            .position(|&s| s <= smallest * (1.0 + TIE))
            .unwrap_or(0);
        Ok((open[winner], scores[winner]))
    }

    /// Mean error over the folds, or infinity once it cannot win any more.
    fn score(&self, candidate: usize, bound: f64) -> f64 {
        let kernel = self.extended_kernel(candidate);
        let params = self.settings.hyper.params(self.settings.effort);
        let count = self.folds.len() as f64;
        let mut sum = 0.0;
        for (fold, warm) in self.folds.iter().zip(&self.warm) {
            let mut start = warm.clone();
            let error = fold.error(&kernel, self.pool.targets, &params, &mut start);
            sum += error.mm;
            self.fits.fetch_add(3, Ordering::Relaxed);
            // A tie must survive.
            if sum / count > bound * (1.0 + 2.0 * TIE) {
                return f64::INFINITY;
            }
        }
        sum / count
    }

    fn add(&mut self, winner: usize) {
        self.kernel = self.extended_kernel(winner);
        let params = self.settings.hyper.params(self.settings.effort);
        for (fold, warm) in self.folds.iter().zip(&mut self.warm) {
            // For its coefficients, the next step's start, and to know whether the winner's fits ended.
            let error = fold.error(&self.kernel, self.pool.targets, &params, warm);
            self.converged &= error.converged;
        }
        self.fits
            .fetch_add(3 * self.folds.len() as u64, Ordering::Relaxed);
        self.chosen.push(winner);
    }

    fn work(&self) -> Work {
        Work {
            kernel_evaluations: self.kernel_evaluations.load(Ordering::Relaxed),
            fits: self.fits.load(Ordering::Relaxed),
            ..Work::default()
        }
    }

    fn notes(&self) -> Vec<String> {
        if self.constant.is_empty() {
            Vec::new()
        } else {
            vec![format!(
                "{} sites report the same under every touch and were left out.",
                self.constant.len()
            )]
        }
    }
}
