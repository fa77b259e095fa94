//! What has to be known of a choice: settings with which nothing can be learned, ties, and how exact it is.

use super::search::GreedySearch;
use crate::placement::{SensorSet, margin};
use crate::regression::Hyper;
use crate::regression::folds::evenly;

/// What has to be known of sets that a search found.
pub(super) fn notes(search: &GreedySearch, sets: &[SensorSet]) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(degenerate(search).or_else(|| out_of_scale(search)));
    notes.extend(margin::ties(sets, search.settings.tolerance));
    if !search.converged {
        notes.push(
            "Some fits stopped at the effort allowed before they met their tolerance: the criterion is not exact. Allow more steps, or lower C.".into(),
        );
    }
    let gap = sets.iter().filter_map(|s| s.gap).fold(0.0, f64::max);
    notes.push(format!(
        "{} sets were fitted exactly; the screens departed from them by at most {:.2} %, so that a better choice of a step could be better by at most {:.2} %.",
        search.exactly,
        100.0 * search.widest,
        100.0 * gap
    ));
    notes
}

/// What makes the regression unable to learn anything.
fn degenerate(search: &GreedySearch) -> Option<String> {
    /// Off the diagonal all kernel values within this of one, or of zero.
    const SAME: f64 = 1e-9;
    /// Rows looked at.
    const ROWS: usize = 64;
    let n = search.judge.targets[0].len();
    let Hyper { gamma, epsilon, .. } = search.settings.hyper;
    let target_deviation = search.judge.target_deviation();
    if target_deviation <= epsilon {
        return Some(format!(
            "The targets spread over {target_deviation:.1e} mm only and lie inside the tube (ε is {epsilon} mm): nothing is learned. Check the unit of the targets or lower ε."
        ));
    }
    let (mut least, mut most) = (1.0f64, 0.0f64);
    for &i in &evenly(n, ROWS) {
        for (j, &k) in search.kernel[i * n..][..n].iter().enumerate() {
            if i != j {
                (least, most) = (least.min(k), most.max(k));
            }
        }
    }
    if least > 1.0 - SAME {
        Some(format!(
            "The kernel is degenerate: at γ = {gamma:.1e} every touch looks like every other, and all predictions are one constant. Raise γ."
        ))
    } else if most < SAME {
        Some(format!(
            "The kernel is degenerate: at γ = {gamma:.1e} no touch looks like any other, and unseen touches are all predicted at one point. Lower γ."
        ))
    } else {
        None
    }
}

/// That C or ε, which are in millimetres, were meant for parts of another size.
fn out_of_scale(search: &GreedySearch) -> Option<String> {
    /// The least C and the largest ε over the spread of the targets at which most of it can be learned: a
    /// tenth and ten times of what suits the bundled limb.
    const LEAST_C: f64 = 0.5;
    const LARGEST_EPSILON: f64 = 0.03;
    let Hyper { c, epsilon, .. } = search.settings.hyper;
    let target_deviation = search.judge.target_deviation();
    let (what, way) = if epsilon > LARGEST_EPSILON * target_deviation {
        (format!("ε ({epsilon} mm) is wide"), "lower it")
    } else if c < LEAST_C * target_deviation {
        (format!("C ({c} mm) is small"), "raise it")
    } else {
        return None;
    };
    Some(format!(
        "{what} for touches that spread over {target_deviation:.3} mm: {way} in proportion to the part, or less is learned than could be."
    ))
}
