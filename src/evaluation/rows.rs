//! Errors touch by touch become rows: of all touches, and of each region.

use serde::Serialize;

use super::set_id::SetId;
use crate::regression::Hyper;
use crate::statistics::{mean, quantile};

/// A named part of the touches.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRegion {
    /// For people.
    pub name: String,
    /// One value a test touch.
    pub contains: Vec<bool>,
}

impl NamedRegion {
    /// Of one value a test touch, those inside.
    pub(super) fn within<T: Copy>(&self, values: &[T]) -> Vec<T> {
        (values.iter().zip(&self.contains))
            .filter_map(|(&v, &inside)| inside.then_some(v))
            .collect()
    }
}

/// Errors of one set of sites in one region (mm).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EvaluationRow {
    /// Which set.
    #[serde(flatten)]
    pub set: SetId,
    /// Name of the region, or of all touches.
    pub region: String,
    /// Mean Euclidean error.
    pub error_mm: f64,
    /// Median error (mm).
    pub median_mm: f64,
    /// 95th percentile of the error (mm).
    pub p95_mm: f64,
    /// Mean error of the set as a workshop would build it, read with the regression trained for the
    /// ideal one, or with a model that knows no more of it than how far off gauges usually are.
    pub workshop_mm: f64,
    /// Test touches in the region.
    pub touches: usize,
    /// Settings of the regression, where it was one.
    pub hyper: Option<Hyper>,
    /// Whether the regression met its tolerance, where it was one.
    pub converged: Option<bool>,
}

/// The region of all touches.
pub const EVERYWHERE: &str = "all touches";

/// Errors of one set touch by touch (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedSet {
    /// Which set.
    pub set: SetId,
    /// Settings of the regression, where it was one.
    pub hyper: Option<Hyper>,
    /// Whether the regression met its tolerance, where it was one.
    pub converged: Option<bool>,
    /// As drawn.
    pub drawn: Vec<f64>,
    /// As a workshop would build it.
    pub built: Vec<f64>,
}

impl JudgedSet {
    /// A row for all touches, and one for each region that has any.
    pub(super) fn rows(&self, regions: &[NamedRegion]) -> Vec<EvaluationRow> {
        let regions = quoted(regions, self.drawn.len());
        regions.iter().map(|region| self.row(region)).collect()
    }

    pub(super) fn row(&self, region: &NamedRegion) -> EvaluationRow {
        let mut drawn = region.within(&self.drawn);
        drawn.sort_by(f64::total_cmp);
        let share = |q: f64| quantile(&drawn, q).unwrap_or(f64::NAN);
        EvaluationRow {
            set: self.set,
            region: region.name.clone(),
            error_mm: mean(&drawn),
            median_mm: share(0.5),
            p95_mm: share(0.95),
            workshop_mm: mean(&region.within(&self.built)),
            touches: drawn.len(),
            hyper: self.hyper,
            converged: self.converged,
        }
    }
}

/// What errors of so many touches are quoted for: all of them, and each region that has any.
pub(super) fn quoted(regions: &[NamedRegion], touches: usize) -> Vec<NamedRegion> {
    let everywhere = NamedRegion {
        name: EVERYWHERE.into(),
        contains: vec![true; touches],
    };
    std::iter::once(&everywhere)
        .chain(regions)
        .filter(|region| region.contains.contains(&true))
        .cloned()
        .collect()
}
