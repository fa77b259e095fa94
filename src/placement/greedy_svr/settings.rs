//! The settings of greedy SVR, and the criterion that they stand for.

use super::exact::ExactFits;
use crate::budget::{Progress, Watch};
use crate::placement::{PlacementError, Pool};
use crate::regression::features::Standardizer;
use crate::regression::folds::{Folds, number_of};
use crate::regression::tune::Effort;
use crate::regression::{Grouping, Hyper, kernel};

/// Settings of the selector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreedySvr {
    /// Settings of the regression.
    pub hyper: Hyper,
    /// Folds of the criterion.
    pub folds: usize,
    /// Of the folds and landmarks.
    pub seed: u64,
    /// What is never divided between folds.
    pub grouping: Grouping,
    /// Of each fit.
    pub effort: Effort,
    /// A choice may be worse than the best by this share of the criterion; where that comes near to the tube by more, which the
    /// gap of a step says.
    pub tolerance: f64,
    /// Landmarks of the screens, relative to what suits most data: fewer are faster, and more has to be
    /// fitted exactly.
    pub landmarks: f64,
}

/// The default of [`GreedySvr::tolerance`].
pub const TOLERANCE: f64 = 0.002;
impl GreedySvr {
    /// Whether sets of this criterion (mm) are hardly told apart: a regression does not see what is within its tube ε, so that
    /// where criteria come near to that, how far they differ is chance. Data without noise get there.
    pub(super) fn is_indistinct(&self, error: f64) -> bool {
        /// In tubes.
        const NEAR: f64 = 3.0;
        error < NEAR * self.hyper.epsilon
    }

    /// The folds of the criterion over touches at these positions (mm).
    ///
    /// # Errors
    /// [`PlacementError`] where there are too few for so many folds.
    pub fn split(&self, targets: &[[f64; 3]]) -> Result<Folds, PlacementError> {
        let groups = self.grouping.of(targets);
        let least = 2 * self.folds.max(2);
        if number_of(&groups) < least {
            return Err(self.too_few(&groups, least));
        }
        Ok(Folds::of_groups(&groups, self.folds, self.seed))
    }

    /// That there are fewer groups of touches than the least.
    pub(crate) fn too_few(&self, groups: &[usize], least: usize) -> PlacementError {
        let (places, touches, folds) = (number_of(groups), groups.len(), self.folds);
        if places < touches {
            PlacementError::TooFewPlaces {
                places,
                touches,
                folds,
                least,
            }
        } else {
            PlacementError::TooFewForFolds {
                touches,
                folds,
                least,
            }
        }
    }

    /// The criterion of given sets (places in the pool): mean over folds of the mean Euclidean error
    /// (mm), fitted to the tolerance.
    ///
    /// # Errors
    /// [`PlacementError`] for too few touches, or when the watch asks for a stop.
    pub fn criteria(
        &self,
        pool: &Pool,
        sets: &[Vec<usize>],
        watch: Watch,
    ) -> Result<Vec<f64>, PlacementError> {
        let folds = self.split(pool.targets)?;
        let features = Standardizer::of(pool.x)
            .apply(pool.x)
            .select_columns(&folds.order);
        let judge = ExactFits::new(self.hyper, self.effort, pool.targets, &folds);
        let n = pool.targets.len();
        // Most sets are the one before with one more site.
        let (mut known, mut whole) = (Vec::new(), vec![1.0; n * n]);
        let mut next = vec![0.0; n * n];
        let mut errors = Vec::with_capacity(sets.len());
        for (k, set) in sets.iter().enumerate() {
            if !set.starts_with(&known) {
                known.clear();
                whole.fill(1.0);
            }
            for &place in &set[known.len()..] {
                let row = features.row(place);
                kernel::extend(&whole, row, row, self.hyper.gamma, &mut next);
                std::mem::swap(&mut whole, &mut next);
            }
            known.clone_from(set);
            let progress = Progress {
                stage: "Judging the choice",
                done: k,
                total: sets.len(),
            };
            errors.push(judge.judge(&whole, None, progress, watch)?.error);
        }
        Ok(errors)
    }
}
