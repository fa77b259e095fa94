//! PCA with pivoted QR as a selector: exact, deterministic, without a seed.

use super::constraints::{self, Constraints, PartialSet};
use super::{
    PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind, SensorSet, margin,
};
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

    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError> {
        PartialSet::new(pool, request.constraints)?;
        let pca = Pca::new(pool.x, request.constraints.sensors, request.watch)?;
        from_components(&pca, pool, request)
    }
}

/// As the selector, from components that are there already, at least one a gauge.
///
/// # Errors
/// [`PlacementError`] where the pool or the constraints do not allow it.
pub fn from_components(
    pca: &Pca,
    pool: &Pool,
    request: &SelectionRequest,
) -> Result<Selection, PlacementError> {
    let constraints = request.constraints;
    if constraints.failure > 0.0 {
        return Err(PlacementError::Refused {
            selector: "PCA-QR",
            why: "its criterion is the span of the patterns, in which a lost gauge has no price; use expected error or greedy SVR to expect failures",
        });
    }
    let whole = PartialSet::new(pool, constraints)?;
    let mut sets: Vec<SensorSet> = Vec::new();
    let mut no_room = None;
    for k in counts(constraints.sensors, constraints.target_mm.is_some()) {
        report(
            request.watch,
            "Selecting by PCA-QR",
            k - 1,
            constraints.sensors,
        )?;
        let (mut field, mut margin) = choose(pca, &whole, k);
        let mut chosen = field.sites();
        let all = chosen.len() == k;
        if !all {
            no_room = field.closed();
        }
        // Where so many cannot be had, as many as can.
        let mut wanted = k;
        while chosen.len() < wanted {
            wanted = chosen.len();
            (field, margin) = choose(pca, &whole, wanted);
            chosen = field.sites();
        }
        if sets.last().is_none_or(|s| s.sites.len() < chosen.len()) && !chosen.is_empty() {
            let reach = chosen.len().min(pca.reach());
            let kept: f64 = pca.variances[..reach].iter().sum();
            let set = SensorSet {
                sites: chosen,
                criterion: Some((1.0 - kept / pca.total).max(0.0)),
                criterion_mm: None,
                gap: None,
                margin,
                certificate: None,
                expected_mm: None,
            };
            (request.found)(&set);
            sets.push(set);
        }
        if !all {
            break;
        }
    }
    if sets.is_empty() {
        return Err(match no_room {
            Some(why) => PlacementError::NoRoom { why },
            None => PlacementError::NoSites,
        });
    }
    if sets.is_empty() {
        return Err(
            no_room.map_or(PlacementError::NoSites, |why| PlacementError::NoRoom {
                why,
            }),
        );
    }
    Ok(Selection {
        selector: SelectorKind::PcaQr,
        criterion_unit: "share of variance beyond the components",
        pool: pool.sites.len(),
        achieved: achieved(pca, &whole, constraints, &sets, no_room),
        sets,
    })
}

/// How the choice ended, and what has to be known of it.
fn achieved(
    pca: &Pca,
    whole: &PartialSet,
    constraints: &Constraints,
    sets: &[SensorSet],
    no_room: Option<String>,
) -> Achieved {
    let reached = sets.last().map_or(0, |s| s.sites.len());
    let wanted = constraints.sensors;
    let short = reached < wanted;
    Achieved {
        error_estimate: None,
        unit: "",
        effort: Work::default(),
        stop_reason: match &no_room {
            Some(_) => StopReason::NoRoom,
            None if short => StopReason::Exhausted,
            None => StopReason::Converged,
        },
        cautions: (no_room.map(|why| constraints::shortage(&why, reached, wanted)))
            .or_else(|| short.then(|| shortage(pca, reached, wanted)))
            .into_iter()
            .collect(),
        notes: (whole.constant_notes().into_iter())
            .chain(margin::ties(sets, margin::TOLERANCE))
            .chain(constraints.thorough.is_asked().then(|| AS_IT_IS.to_owned()))
            .collect(),
    }
}

const AS_IT_IS: &str =
    "Pivots have no criterion of a whole set: exchange and several starts change nothing here.";

/// Every number of gauges has a choice of its own. Beyond what anyone compares one by one there is only
/// the number asked for; on the way to an error, numbers half as large again each.
fn counts(most: usize, on_the_way: bool) -> Vec<usize> {
    const EACH: usize = 40;
    let mut counts: Vec<usize> = (1..=most.min(EACH)).collect();
    while let Some(&last) = counts.last().filter(|&&last| last < most) {
        let next = if on_the_way { last + last / 2 } else { most };
        counts.push(next.min(most));
    }
    counts
}

/// `count` sites by pivoting in as many components; fewer where not so many can be had.
/// With how far the least certain pick was ahead of the next.
fn choose<'a>(pca: &Pca, whole: &PartialSet<'a>, count: usize) -> (PartialSet<'a>, Option<f64>) {
    let mut field = whole.clone();
    let mut pivoting = pca.pivoting(count);
    let mut least: Option<f64> = None;
    while field.chosen.len() < count {
        let open = field.open();
        let next = match open[..] {
            // What must be there is taken whatever it adds.
            [only] if field.is_required(only) => Some((only, f64::INFINITY)),
            _ => pivoting.largest(open, |place, norm| field.worth(place, norm)),
        };
        let Some((place, margin)) = next else {
            break;
        };
        if margin.is_finite() {
            least = Some(least.map_or(margin, |l| l.min(margin)));
        }
        pivoting.take(place);
        field.add(place);
    }
    (field, least)
}

fn shortage(pca: &Pca, reached: usize, wanted: usize) -> String {
    if pca.complete && reached >= pca.reach() {
        format!(
            "The signals carry only {} independent patterns, so there is no choice of {wanted} sites.",
            pca.reach()
        )
    } else {
        format!(
            "Only {reached} gauges can be placed: spacing, cost or what must be there leaves no room for {wanted}."
        )
    }
}
