//! Touches that press on what is held.

use super::{DesignError, Inputs};
use crate::elasticity::support::HeldRegion;
use crate::elasticity::{Support, Touch};

/// A word where many touches press on what is held: they move next to nothing, so that no gauge can tell them
/// apart, and rule every mean.
pub(super) fn on_supports(
    inputs: &Inputs,
    touches: &[Touch],
) -> Result<Option<String>, DesignError> {
    /// Share of the touches from which it is worth a word.
    const WORTH: f64 = 0.05;
    let count = on_what_is_held(inputs, touches)?.len();
    Ok((count as f64 > WORTH * touches.len() as f64).then(|| {
        format!(
            "{count} of {} touches press on what a support holds: next to nothing moves there, and no gauge can tell where they are. Paint where touches come (touch.region), or go by the errors of a region ([[evaluation.region]]).",
            touches.len()
        )
    }))
}

/// Which touches press on what a support holds in all directions.
///
/// # Errors
/// [`DesignError::Value`] for a support that names no layer there is.
pub fn on_what_is_held(inputs: &Inputs, touches: &[Touch]) -> Result<Vec<usize>, DesignError> {
    let supports = inputs.project.supports(&inputs.masks)?;
    let holds = |s: &&Support| s.bedding.is_none() && (0..3).all(|i| s.held.holds(i));
    let held: Vec<&Support> = supports.iter().filter(holds).collect();
    let index = inputs.part.index();
    let is_held = |&k: &usize| {
        let touch = &touches[k];
        held.iter().any(|support| match &support.region {
            HeldRegion::Box(held) => held.contains(touch.position, 0.0),
            HeldRegion::Vertices(mask) => {
                let at = index.nearest(touch.position).0;
                inputs.part.mostly_in(mask, at)
            }
        })
    };
    Ok((0..touches.len()).filter(is_held).collect())
}
