//! The criterion itself: every fold and coordinate fitted to the tolerance.

use std::sync::atomic::{AtomicBool, Ordering};

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use crate::budget::{Cancelled, Progress, Watch};
use crate::regression::Hyper;
use crate::regression::folds::Folds;
use crate::regression::svr::{self, Problem, Start, SvrFit};
use crate::regression::tune::{Effort, mean_distance};

/// Largest tolerance, as a share of the targets' spread.
const RELATIVE: f64 = 2e-3;

/// What all exact fits of one search share; touches in the order of the folds.
pub struct ExactFits<'a> {
    /// Coordinates of the touches (mm), an axis each.
    pub targets: [Vec<f64>; 3],
    /// What the criterion is cross-validated over.
    pub folds: &'a Folds,
    /// C, ε and γ of every fit.
    pub hyper: Hyper,
    /// Tolerance and most steps of every fit.
    pub effort: Effort,
}

/// Fits of one set: 3 × folds of them, fold by fold.
pub struct JudgedFits {
    /// The criterion (mm).
    pub error: f64,
    fits: Vec<SvrFit>,
    /// Whether all fits reached their tolerance.
    pub converged: bool,
}

impl JudgedFits {
    /// Residuals and dual coefficients, touches × (3 × folds).
    #[must_use]
    pub fn matrices(&self) -> (Mat<f64>, Mat<f64>) {
        let n = self.fits[0].beta.len();
        (
            Mat::from_fn(n, self.fits.len(), |i, j| self.fits[j].residuals[i]),
            Mat::from_fn(n, self.fits.len(), |i, j| self.fits[j].beta[i]),
        )
    }
}

impl<'a> ExactFits<'a> {
    /// Of targets (mm) in the order of the touches.
    #[must_use]
    pub fn new(hyper: Hyper, effort: Effort, targets: &[[f64; 3]], folds: &'a Folds) -> Self {
        let axis = |a: usize| folds.order.iter().map(|&t| targets[t][a]).collect();
        Self {
            targets: [0, 1, 2].map(axis),
            folds,
            hyper,
            effort,
        }
    }

    /// Largest standard deviation of a coordinate of the targets (mm).
    #[must_use]
    pub fn target_deviation(&self) -> f64 {
        let deviation = |y: &Vec<f64>| {
            let n = y.len().max(1) as f64;
            let mean = y.iter().sum::<f64>() / n;
            (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
        };
        self.targets.iter().map(deviation).fold(0.0, f64::max)
    }

    /// The criterion on a kernel (touches × touches), from the dual coefficients of similar fits where
    /// there are some.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn judge(
        &self,
        kernel: &[f64],
        start: Option<&Mat<f64>>,
        progress: Progress,
        watch: Watch,
    ) -> Result<JudgedFits, Cancelled> {
        let start = start.map(|beta| self.prepared(kernel, beta));
        let cancelled = AtomicBool::new(false);
        let stop = || {
            if watch(progress).is_break() {
                cancelled.store(true, Ordering::Relaxed);
            }
            cancelled.load(Ordering::Relaxed)
        };
        // A tolerance larger than what there is to learn would be met by learning nothing.
        let mut params = self.hyper.params(self.effort);
        params.tolerance = params.tolerance.min(RELATIVE * self.target_deviation());
        let fits: Vec<SvrFit> = (0..3 * self.folds.parts.len())
            .into_par_iter()
            .map(|j| {
                let problem = Problem {
                    kernel,
                    y: &self.targets[j % 3],
                    held_out: self.folds.parts[j / 3].clone(),
                };
                let start = start.as_ref().and_then(|(beta, f)| {
                    Some(Start {
                        beta: beta.col(j).try_as_col_major()?.as_slice(),
                        f: Some(f.col(j).try_as_col_major()?.as_slice()),
                    })
                });
                svr::solve(&problem, &params, start, &stop)
            })
            .collect();
        if cancelled.load(Ordering::Relaxed) {
            return Err(Cancelled);
        }
        let by_fold = fits.chunks_exact(3).zip(&self.folds.parts);
        let sum: f64 = by_fold
            .map(|(fits, part)| mean_distance(fits, part.clone()))
            .sum();
        Ok(JudgedFits {
            error: sum / self.folds.parts.len() as f64,
            converged: fits.iter().all(|f| f.converged),
            fits,
        })
    }

    /// Coefficients clipped to what is allowed, and their Kβ - y: one product for all fits.
    fn prepared(&self, kernel: &[f64], beta: &Mat<f64>) -> (Mat<f64>, Mat<f64>) {
        let n = beta.nrows();
        let c = self.hyper.c;
        let beta = Mat::from_fn(n, beta.ncols(), |i, j| {
            if self.folds.parts[j / 3].contains(&i) {
                0.0
            } else {
                beta[(i, j)].clamp(-c, c)
            }
        });
        let mut f = Mat::from_fn(n, beta.ncols(), |i, j| -self.targets[j % 3][i]);
        matmul(
            f.as_mut(),
            Accum::Add,
            MatRef::from_column_major_slice(kernel, n, n),
            beta.as_ref(),
            1.0,
            Par::Seq,
        );
        (beta, f)
    }
}
