//! What sets and judges are called in a report.

use crate::design::Design;

/// What the touches that judge are computed on: where a finer model would not have fitted, on one like the design's.
pub(super) fn judged_on(design: &Design) -> String {
    /// Sizes that differ by less are the same.
    const SAME: f64 = 0.99;
    let (own, truth) = (design.simulated.element_mm, design.truth.element_mm);
    if truth < SAME * own {
        format!("drawn off the nodes of a finer model ({truth:.2} mm)")
    } else {
        format!("drawn off the nodes of a model with elements of the same size ({truth:.2} mm)")
    }
}
