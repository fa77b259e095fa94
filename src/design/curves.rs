//! What a design found as curves with their names, for pages and windows alike.

use super::pipeline::Design;
use crate::evaluation::{EstimatorKind, Failures};
use crate::placement::SelectorKind;

/// Error against number of gauges for one selector and region.
#[must_use]
pub fn curve(design: &Design, selector: SelectorKind, region: &str) -> Vec<(f64, f64)> {
    design
        .evaluation
        .rows
        .iter()
        .filter(|r| r.set.chooser == selector.into() && r.region == region)
        .map(|r| (r.set.sensors as f64, r.error_mm))
        .collect()
}

/// The ways in which an estimator meets a failure: whether it is trained anew, and what that is called.
#[must_use]
pub fn failure_ways(by: EstimatorKind) -> &'static [(bool, &'static str)] {
    match by {
        EstimatorKind::Svr => &[
            (false, "Failed gauges, as trained with all"),
            (true, "Failed gauges, trained anew without them"),
        ],
        EstimatorKind::Matching => &[(false, "Failed gauges, left out")],
    }
}

/// Error against number of failed gauges.
#[must_use]
pub fn failure_curve(set: &Failures, retrained: bool) -> Vec<(f64, f64)> {
    set.rows
        .iter()
        .filter(|r| r.retrained == retrained || r.failed == 0)
        .map(|r| (r.failed as f64, r.error_mm))
        .collect()
}
