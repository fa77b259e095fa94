//! Greedy SVR's criterion of whole sets, for choices that are not made gauge by gauge alone.

use super::exact::JudgedFits;
use super::screen::ScreenBase;
use super::search::GreedySearch;
use crate::budget::Cancelled;
use crate::placement::constraints::{PartialSet, reached};
use crate::placement::exchange::Criterion;
use crate::placement::{PlacementError, SensorSet};
use crate::regression::kernel;

impl Criterion for GreedySearch<'_> {
    const UNIT: &'static str = "mm";

    /// Fitted from the beginning, so that a set has one criterion however it was come to.
    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
        let whole = self.error(set)?;
        let mut lost = Vec::new();
        if self.request.constraints.failure > 0.0 {
            for number in 0..set.len() {
                lost.push(self.error(&without(set, number))?);
            }
        }
        Ok(self.request.constraints.weighed(whole, lost.into_iter()))
    }

    fn screened(
        &mut self,
        others: &PartialSet,
        _: usize,
    ) -> Result<Vec<(usize, f64)>, PlacementError> {
        self.stand_on(&others.chosen)?;
        let scored = self.scores(0, &others.open(), others.chosen.len())?;
        Ok(scored.into_iter().map(|s| (s.place, s.error)).collect())
    }

    fn best_for(&mut self, others: &PartialSet, _: usize) -> Result<Option<usize>, PlacementError> {
        self.stand_on(&others.chosen)?;
        Ok(self.best_addition(others)?.map(|step| step.place))
    }

    fn grow<'f>(
        &mut self,
        mut field: PartialSet<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
        self.stand_on(&[])?;
        let mut sets: Vec<SensorSet> = Vec::new();
        while !field.full() && !reached(&sets, self.request.constraints) {
            let Some(step) = self.best_addition(&field)? else {
                break;
            };
            field.add(step.place);
            let set = SensorSet {
                sites: field.sites(),
                criterion: Some(step.error),
                criterion_mm: Some(step.error),
                gap: Some(step.gap),
                margin: step.margin,
                certificate: None,
                expected_mm: None,
            };
            found(&set);
            sets.push(set);
        }
        Ok((field, sets))
    }
}

impl GreedySearch<'_> {
    /// The cross-validated error (mm) with all gauges of a set.
    fn error(&mut self, set: &[usize]) -> Result<f64, Cancelled> {
        if set.is_empty() {
            return Ok(ScreenBase::empty(&self.sieves).error);
        }
        let kernel = self.kernel_over(set);
        Ok(self.fitted_to(&kernel, set.len(), false)?.error)
    }

    /// Goes on from a set, whoever has chosen it.
    fn stand_on(&mut self, set: &[usize]) -> Result<(), Cancelled> {
        self.kernel = self.kernel_over(set);
        self.base = self.base_of(set)?;
        self.without.clear();
        if self.request.constraints.failure > 0.0 {
            for number in 0..set.len() {
                let base = self.base_of(&without(set, number))?;
                self.without.push(base);
            }
        }
        Ok(())
    }

    fn base_of(&mut self, set: &[usize]) -> Result<ScreenBase, Cancelled> {
        if set.is_empty() {
            return Ok(ScreenBase::empty(&self.sieves));
        }
        let kernel = self.kernel_over(set);
        let judged = self.fitted_to(&kernel, set.len(), true)?;
        let (residuals, beta) = judged.matrices();
        let fitted = (judged.error, residuals, beta);
        Ok(ScreenBase::of(
            &self.sieves,
            set,
            &self.settings.hyper,
            fitted,
        ))
    }

    /// Exact fits on a kernel, from the coefficients of the set that was looked at last where they may begin there.
    fn fitted_to(
        &mut self,
        kernel: &[f64],
        step: usize,
        from_last: bool,
    ) -> Result<JudgedFits, Cancelled> {
        let start = from_last.then_some(&self.base.beta);
        let progress = self.progress(step.min(self.request.constraints.sensors));
        let judged = self
            .judge
            .judge(kernel, start, progress, self.request.watch)?;
        self.converged &= judged.converged;
        self.work += self.fitted(1);
        Ok(judged)
    }

    /// exp(-γ d²) over some sites, touches × touches.
    fn kernel_over(&self, set: &[usize]) -> Vec<f64> {
        let size = self.kernel.len();
        let (mut whole, mut next) = (vec![1.0; size], vec![0.0; size]);
        for &place in set {
            let row = self.features.row(place);
            kernel::extend(&whole, row, row, self.settings.hyper.gamma, &mut next);
            std::mem::swap(&mut whole, &mut next);
        }
        whole
    }
}

fn without(set: &[usize], number: usize) -> Vec<usize> {
    let others = set.iter().enumerate().filter(|(k, _)| *k != number);
    others.map(|(_, &place)| place).collect()
}
