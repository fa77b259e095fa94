//! PCA with pivoted QR as a selector: exact, deterministic, without a seed.

use super::wishes::Field;
use super::{PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet};
use crate::budget::{Achieved, StopReason, Work, report};
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

    fn select(&self, pool: &Pool, request: &Request) -> Result<Selection, PlacementError> {
        Field::new(pool, request.wishes)?;
        let pca = Pca::new(pool.x, request.watch)?;
        from_components(&pca, pool, request)
    }
}

/// As the selector, from components that are there already.
///
/// # Errors
/// [`PlacementError`] where the pool or the wishes do not allow it.
pub fn from_components(
    pca: &Pca,
    pool: &Pool,
    request: &Request,
) -> Result<Selection, PlacementError> {
    let wishes = request.wishes;
    if wishes.failure > 0.0 {
        return Err(PlacementError::Refused {
            selector: "PCA-QR",
            why: "its criterion is the span of the patterns, in which a lost gauge has no price; use greedy SVR to expect failures",
        });
    }
    let whole = Field::new(pool, wishes)?;
    let total: f64 = pca.variances.iter().sum();
    let mut sets: Vec<SensorSet> = Vec::new();
    for k in 1..=wishes.sensors {
        report(request.watch, "Selecting by PCA-QR", k - 1, wishes.sensors)?;
        let Some(chosen) = choose(pca, &whole, k) else {
            break;
        };
        let reach = k.min(pca.rank());
        let kept: f64 = pca.variances[..reach].iter().sum();
        let set = SensorSet {
            sites: chosen.sites(),
            criterion: 1.0 - kept / total,
            criterion_mm: None,
            gap: None,
        };
        (request.found)(&set);
        sets.push(set);
    }
    if sets.is_empty() {
        return Err(PlacementError::NoSites);
    }
    let short = sets.len() < wishes.sensors;
    Ok(Selection {
        selector: SelectorKind::PcaQr,
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
            notes: short
                .then(|| shortage(pca, &sets, wishes.sensors))
                .into_iter()
                .collect(),
        },
        sets,
    })
}

/// `count` sites by pivoting in as many components; none where not so many can be had.
fn choose<'a>(pca: &Pca, whole: &Field<'a>, count: usize) -> Option<Field<'a>> {
    let mut field = whole.clone();
    let mut pivoting = pca.pivoting(count);
    while field.chosen.len() < count {
        let open = field.open();
        let place = match open[..] {
            // What must be there is taken whatever it adds.
            [only] if field.is_required(only) => only,
            _ => pivoting.largest(open, |place, norm| field.worth(place, norm))?,
        };
        pivoting.take(place);
        field.add(place);
    }
    Some(field)
}

fn shortage(pca: &Pca, sets: &[SensorSet], wanted: usize) -> String {
    if sets.len() >= pca.rank() {
        format!(
            "The signals carry only {} independent patterns, so there is no choice of {wanted} sites.",
            pca.rank()
        )
    } else {
        format!(
            "Only {} gauges can be placed: spacing, cost or what must be there leaves no room for {wanted}.",
            sets.len()
        )
    }
}
