//! Scores of a set with one more site, from cheap to nearly exact.
//!
//! A Gaussian kernel over A ∪ {m} is the kernel over A times the kernel over m, entry by entry, so that
//! the kernel between touches and landmarks is kept for A and multiplied for each candidate.

use std::ops::Range;

use faer::Mat;

use crate::dataset::SignalMatrix;
use crate::regression::admm::{self, AdmmSetting, AdmmState};
use crate::regression::folds::{Folds, evenly};
use crate::regression::{Hyper, kernel, lowrank};

/// Asked now and then whether to give up.
pub type GiveUp<'a> = &'a (dyn Fn() -> bool + Sync);

/// What one screen spends on a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenEffort {
    /// Most touches that it fits.
    pub touches: usize,
    /// Landmarks of the low-rank kernel, to begin with.
    pub landmarks: usize,
    /// Iterations of the fit.
    pub iterations: usize,
    /// When the score departs from the next by more than this share, more landmarks are taken …
    pub aim: f64,
    /// … up to so many.
    pub most_landmarks: usize,
}

impl ScreenEffort {
    /// With more or fewer landmarks.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        let scale = |landmarks: usize| ((landmarks as f64 * by) as usize).max(8);
        Self {
            landmarks: scale(self.landmarks),
            most_landmarks: scale(self.most_landmarks),
            ..self
        }
    }
}

/// From the one that looks at every candidate to the one that is nearly exact.
pub const LEVELS: [ScreenEffort; 4] = [
    ScreenEffort {
        touches: 1000,
        landmarks: 64,
        iterations: 10,
        aim: 0.05,
        most_landmarks: 160,
    },
    ScreenEffort {
        touches: usize::MAX,
        landmarks: 128,
        iterations: 12,
        aim: 0.02,
        most_landmarks: 300,
    },
    ScreenEffort {
        touches: usize::MAX,
        landmarks: 220,
        iterations: 20,
        aim: 0.01,
        most_landmarks: 500,
    },
    ScreenEffort {
        touches: usize::MAX,
        landmarks: 400,
        iterations: 40,
        aim: 0.004,
        most_landmarks: 1200,
    },
];

/// The touches, landmarks and targets of one level.
pub struct Sieve {
    /// What it spends.
    pub level: ScreenEffort,
    /// Standardized signals, sites × this level's touches.
    features: SignalMatrix,
    /// Places of the touches among all, and of the landmarks among the touches.
    places: Vec<usize>,
    landmarks: Vec<usize>,
    targets: Mat<f64>,
    parts: Vec<Range<usize>>,
    /// How many touches one of these stands for.
    weight: f64,
}

impl Sieve {
    /// Of signals (sites × touches) and targets in the order of the folds.
    #[must_use]
    pub fn new(level: ScreenEffort, z: &SignalMatrix, targets: &[[f64; 3]], folds: &Folds) -> Self {
        let (places, parts) = folds.thinned(level.touches);
        let n = places.len();
        Self {
            level,
            features: z.select_columns(&places),
            landmarks: evenly(n, level.landmarks),
            targets: Mat::from_fn(n, 3 * parts.len(), |i, j| targets[places[i]][j % 3]),
            weight: targets.len() as f64 / n as f64,
            places,
            parts,
        }
    }

    /// Takes half as many landmarks again, if there may be more.
    pub fn refine(&mut self) -> bool {
        let before = self.landmarks.len();
        let wanted = (before + before / 2).min(self.level.most_landmarks);
        self.landmarks = evenly(self.places.len(), wanted.max(before));
        self.landmarks.len() > before
    }

    /// The kernel over some sites.
    #[must_use]
    pub fn over(&self, sites: &[usize], gamma: f64) -> Mat<f64> {
        sites.iter().fold(self.nothing(), |cross, &site| {
            self.extended(&cross, site, gamma)
        })
    }

    /// The kernel over no site at all.
    #[must_use]
    pub fn nothing(&self) -> Mat<f64> {
        Mat::full(self.places.len(), self.landmarks.len(), 1.0)
    }

    /// The kernel between touches and landmarks with one more site.
    #[must_use]
    pub fn extended(&self, cross: &Mat<f64>, site: usize, gamma: f64) -> Mat<f64> {
        let row = self.features.row(site);
        let mut out = Mat::zeros(cross.nrows(), cross.ncols());
        for (j, &landmark) in self.landmarks.iter().enumerate() {
            let from = cross.col(j).try_as_col_major();
            let into = out.col_mut(j).try_as_col_major_mut();
            if let (Some(from), Some(into)) = (from, into) {
                kernel::extend(
                    from.as_slice(),
                    &row[landmark..=landmark],
                    row,
                    gamma,
                    into.as_slice_mut(),
                );
            }
        }
        out
    }

    fn setting(&self, hyper: &Hyper, rho: f64) -> AdmmSetting {
        AdmmSetting {
            y: self.targets.clone(),
            folds: self.parts.clone(),
            c: hyper.c * self.weight,
            epsilon: hyper.epsilon,
            rho: rho * self.weight,
        }
    }
}

/// A set of sites with all that the screens need to know of it.
pub struct ScreenBase {
    /// Kernel between touches and landmarks over the set, a level.
    crosses: Vec<Mat<f64>>,
    /// Residuals of its fits, touches × (3 × folds), in the order of the folds (mm).
    pub residuals: Mat<f64>,
    /// Their dual coefficients, likewise.
    pub beta: Mat<f64>,
    /// Its criterion (mm).
    pub error: f64,
}

impl ScreenBase {
    /// The empty set, which predicts the middle of the targets.
    #[must_use]
    pub fn empty(sieves: &[Sieve]) -> Self {
        let full = &sieves[sieves.len() - 1].targets;
        let n = full.nrows();
        let middle: Vec<f64> = (0..full.ncols())
            .map(|j| (0..n).map(|i| full[(i, j)]).sum::<f64>() / n as f64)
            .collect();
        let residuals = Mat::from_fn(n, full.ncols(), |i, j| middle[j] - full[(i, j)]);
        let lengths = (0..n).map(|i| {
            (0..3)
                .map(|a| residuals[(i, a)].powi(2))
                .sum::<f64>()
                .sqrt()
        });
        Self {
            crosses: sieves.iter().map(Sieve::nothing).collect(),
            error: lengths.sum::<f64>() / n as f64,
            beta: Mat::zeros(n, full.ncols()),
            residuals,
        }
    }

    /// A set whose fits left this criterion (mm), these residuals and these coefficients.
    #[must_use]
    pub fn of(
        sieves: &[Sieve],
        sites: &[usize],
        hyper: &Hyper,
        fitted: (f64, Mat<f64>, Mat<f64>),
    ) -> Self {
        let (error, residuals, beta) = fitted;
        Self {
            crosses: (sieves.iter())
                .map(|sieve| sieve.over(sites, hyper.gamma))
                .collect(),
            residuals,
            beta,
            error,
        }
    }

    /// Makes one level's kernel anew after its landmarks have changed.
    pub fn renew(&mut self, sieve: &Sieve, level: usize, sites: &[usize], gamma: f64) {
        self.crosses[level] = sieve.over(sites, gamma);
    }

    /// The penalty that suits errors of the size of this set's: C over half of it.
    #[must_use]
    pub fn rho(&self, hyper: &Hyper) -> f64 {
        hyper.c / (0.5 * self.error).max(f64::MIN_POSITIVE)
    }

    /// Criterion (mm) of this set with one more site on one level; infinite where it cannot be computed.
    #[must_use]
    pub fn score(
        &self,
        sieves: &[Sieve],
        level: usize,
        site: usize,
        hyper: &Hyper,
        stop: GiveUp,
    ) -> f64 {
        self.solved(sieves, level, site, hyper, stop).0
    }

    /// Criterion and dual coefficients (touches × (3 × folds)) on the last level, where an exact fit can
    /// start.
    #[must_use]
    pub fn nearly(
        &self,
        sieves: &[Sieve],
        site: usize,
        hyper: &Hyper,
        stop: GiveUp,
    ) -> (f64, AdmmState) {
        self.solved(sieves, sieves.len() - 1, site, hyper, stop)
    }

    fn solved(
        &self,
        sieves: &[Sieve],
        level: usize,
        site: usize,
        hyper: &Hyper,
        stop: GiveUp,
    ) -> (f64, AdmmState) {
        let sieve = &sieves[level];
        let rho = self.rho(hyper);
        let (n, columns) = (sieve.places.len(), self.beta.ncols());
        let mut state = AdmmState {
            z: Mat::from_fn(n, columns, |i, j| self.residuals[(sieve.places[i], j)]),
            u: Mat::from_fn(n, columns, |i, j| -self.beta[(sieve.places[i], j)] / rho),
        };
        let cross = sieve.extended(&self.crosses[level], site, hyper.gamma);
        let phi = lowrank::features(cross.as_ref(), &sieve.landmarks);
        let setting = sieve.setting(hyper, rho);
        let error = admm::iterate(
            &setting,
            phi.as_ref(),
            &mut state,
            sieve.level.iterations,
            stop,
        );
        (error.unwrap_or(f64::INFINITY), state)
    }

    /// This set with one more site, whose fits left these residuals and coefficients.
    #[must_use]
    pub fn with(
        &self,
        sieves: &[Sieve],
        site: usize,
        hyper: &Hyper,
        fitted: (f64, Mat<f64>, Mat<f64>),
    ) -> Self {
        let (error, residuals, beta) = fitted;
        Self {
            crosses: (sieves.iter().zip(&self.crosses))
                .map(|(sieve, cross)| sieve.extended(cross, site, hyper.gamma))
                .collect(),
            residuals,
            beta,
            error,
        }
    }
}
