//! Models with the sample loads solved on them, and the one that is taken.

use glam::DVec3;
use rayon::prelude::*;

use crate::budget::{Cancelled, Watch};
use crate::elasticity::estimate::{Discretization, ModelSample};
use crate::elasticity::grade::{CHECKED, subsample};
use crate::elasticity::load::Touch;
use crate::elasticity::model::{LoadCheck, Model as _};
use crate::elasticity::solid::SolidModel;
use crate::elasticity::solid::immersed::Fineness;

/// The cells, with the model built on them.
pub struct SolidGraded {
    /// Size or order of the elements.
    pub fineness: Fineness,
    /// The factored model.
    pub model: SolidModel,
    /// How far it is from converged.
    pub estimate: Discretization,
    /// The worst balance over the sample of the loads.
    pub balance: LoadCheck,
    /// Assemblies and factorizations on the way here.
    pub models: u64,
    /// Loads solved on the way here.
    pub solves: u64,
    /// Whether memory did not hold the next finer one.
    pub is_short: bool,
}

/// The error is an estimate: stop at this share of the tolerance.
pub(super) const SAFETY: f64 = 0.8;

/// A model with the sample loads solved on it.
pub(super) struct SolvedModel {
    pub(super) fineness: Fineness,
    pub(super) model: SolidModel,
    pub(super) sample: ModelSample,
}

impl SolvedModel {
    pub(super) fn of(
        fineness: Fineness,
        model: SolidModel,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        Ok(Self {
            sample: ModelSample::read(&model, touches, places, watch)?,
            fineness,
            model,
        })
    }

    /// As the one that is taken, after so many models.
    pub(super) fn graded(
        self,
        touches: &[Touch],
        estimate: Discretization,
        models: u64,
    ) -> SolidGraded {
        let checked = subsample(touches, CHECKED);
        let loads: Vec<_> = checked.par_iter().map(|t| self.model.load(t)).collect();
        let solutions = self.model.system().solve_loads(&loads);
        SolidGraded {
            balance: self.model.check_all(&checked, &solutions),
            fineness: self.fineness,
            model: self.model,
            estimate,
            models,
            solves: models * touches.len() as u64,
            is_short: false,
        }
    }
}
