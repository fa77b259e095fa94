//! PCA with pivoted QR as a selector: exact, deterministic, without a seed.

use super::{PlacementError, Pool, Selection, Selector, SelectorKind, SensorSet, check_pool};
use crate::budget::{Achieved, StopReason, Watch, Work, report};
use crate::pca::Pca;

/// The selector; it has no settings.
pub struct PcaQr;

impl Selector for PcaQr {
    fn kind(&self) -> SelectorKind {
        SelectorKind::PcaQr
    }

    fn nested(&self) -> bool {
        false
    }

    fn select(
        &self,
        pool: &Pool,
        sensors: usize,
        watch: Watch,
    ) -> Result<Selection, PlacementError> {
        check_pool(pool, sensors)?;
        let pca = Pca::new(pool.x, watch)?;
        from_components(&pca, pool, sensors, watch)
    }
}

/// As the selector, from components that are there already.
///
/// # Errors
/// [`PlacementError`] where the pool does not allow it.
pub fn from_components(
    pca: &Pca,
    pool: &Pool,
    sensors: usize,
    watch: Watch,
) -> Result<Selection, PlacementError> {
    check_pool(pool, sensors)?;
    let reach = sensors.min(pca.rank());
    let total: f64 = pca.variances.iter().sum();
    let mut sets = Vec::with_capacity(reach);
    for k in 1..=reach {
        report(watch, "Selecting by PCA-QR", k - 1, reach)?;
        let kept: f64 = pca.variances[..k].iter().sum();
        sets.push(SensorSet {
            sites: pca.pivots(k).into_iter().map(|i| pool.sites[i]).collect(),
            criterion: 1.0 - kept / total,
        });
    }
    let short = reach < sensors;
    Ok(Selection {
        selector: SelectorKind::PcaQr,
        sets,
        criterion_unit: "share of variance beyond the components",
        pool: pool.sites.len(),
        achieved: Achieved {
            error_estimate: None,
            unit: "",
            effort: Work::default(),
            stop_reason: if short {
                StopReason::Exhausted
            } else {
                StopReason::Converged
            },
            notes: if short {
                vec![format!(
                    "The signals carry only {reach} independent patterns, so there is no choice of {sensors} sites."
                )]
            } else {
                Vec::new()
            },
        },
    })
}
