//! Errors touch by touch become rows: of all touches, and of each region.

use serde::Serialize;

use crate::regression::Hyper;
use crate::statistics::{mean, quantile};

/// A named part of the touches.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchRegion {
    /// For people.
    pub name: String,
    /// One value a test touch.
    pub contains: Vec<bool>,
}

impl TouchRegion {
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
    /// Selector's name, or "all-candidates" for the baseline.
    pub selector: String,
    /// Gauges of the set.
    pub sensors: usize,
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

/// What all rows of a set have in common.
pub(super) struct Said<'a> {
    pub(super) selector: &'a str,
    pub(super) sensors: usize,
    pub(super) hyper: Option<Hyper>,
    pub(super) converged: Option<bool>,
}

impl Said<'_> {
    /// A row for all touches, and one for each region that has any.
    pub(super) fn rows(&self, regions: &[TouchRegion], errors: [&[f64]; 2]) -> Vec<EvaluationRow> {
        let regions = quoted(regions, errors[0].len());
        regions.iter().map(|r| row(self, r, errors)).collect()
    }
}

/// What errors of so many touches are quoted for: all of them, and each region that has any.
pub(super) fn quoted(regions: &[TouchRegion], touches: usize) -> Vec<TouchRegion> {
    let everywhere = TouchRegion {
        name: EVERYWHERE.into(),
        contains: vec![true; touches],
    };
    std::iter::once(&everywhere)
        .chain(regions)
        .filter(|region| region.contains.contains(&true))
        .cloned()
        .collect()
}

pub(super) fn row(set: &Said, region: &TouchRegion, [errors, built]: [&[f64]; 2]) -> EvaluationRow {
    let (mut inside, built) = (region.within(errors), region.within(built));
    inside.sort_by(f64::total_cmp);
    let share = |q: f64| quantile(&inside, q).unwrap_or(f64::NAN);
    EvaluationRow {
        selector: set.selector.to_owned(),
        sensors: set.sensors,
        region: region.name.clone(),
        error_mm: mean(&inside),
        median_mm: share(0.5),
        p95_mm: share(0.95),
        workshop_mm: mean(&built),
        touches: inside.len(),
        hyper: set.hyper,
        converged: set.converged,
    }
}
