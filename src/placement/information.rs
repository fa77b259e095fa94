//! What entropy and mutual information share: the geometry they know, and what is uncertain given some
//! measurements.

use serde::Serialize;

use super::constraints::{PartialSet, shortage};
use super::exchange::Exchanged;
use super::margin::Best;
use super::{PlacementError, Pool, Selection, SelectionRequest, SelectorKind, SensorSet, margin};
use crate::budget::{Achieved, Cancelled, StopReason, Work};
use crate::gaussian_process::{self, Covariance, GpKernel, GpTrial};
use crate::plain;

/// A Gaussian process over locations on the surface; the pool's sites come first, then those where no
/// gauge can go.
pub struct Geometry {
    /// Between all locations.
    pub covariance: Covariance,
    /// The kernel it was made with.
    pub kernel: GpKernel,
    /// How distances were measured, for people.
    pub distance: &'static str,
    /// Locations at the place of another.
    pub coinciding: usize,
    /// The search that the kernel came from; empty where it was given.
    pub map: Vec<GpTrial>,
}

/// The parts of a geometry that go into reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GeometrySummary {
    /// The kernel.
    pub kernel: GpKernel,
    /// How distances were measured, for people.
    pub distance: &'static str,
    /// Share of the spectrum that was negative and set to zero.
    pub clipped: f64,
    /// The search that the kernel came from; empty where it was given.
    pub map: Vec<GpTrial>,
}

impl Geometry {
    /// The parts that go into reports.
    #[must_use]
    pub fn summary(&self) -> GeometrySummary {
        GeometrySummary {
            kernel: self.kernel,
            distance: self.distance,
            clipped: self.covariance.clipped,
            map: self.map.clone(),
        }
    }

    /// σ² of the field at every location, given a measurement at some of them (1 where nothing is known).
    #[must_use]
    pub fn variances_given(&self, measured: &[usize]) -> Vec<f64> {
        let mut conditional = Conditional::nothing(&self.covariance);
        for &place in measured {
            conditional.observe(place);
        }
        (0..conditional.variances.len())
            .map(|place| conditional.variance(place))
            .collect()
    }

    /// Nothing chosen, with the constraints checked.
    pub(super) fn field<'a>(
        &self,
        pool: &'a Pool<'a>,
        request: &'a SelectionRequest<'a>,
        name: &'static str,
    ) -> Result<PartialSet<'a>, PlacementError> {
        if request.constraints.failure > 0.0 {
            return Err(PlacementError::Refused {
                selector: name,
                why: "it knows the geometry only and no error that a lost gauge would raise; use expected error or greedy SVR to expect failures",
            });
        }
        if pool.sites.len() > self.covariance.k.nrows() {
            return Err(PlacementError::Constraint {
                what: "the geometry does not know all sites",
            });
        }
        PartialSet::new(pool, request.constraints)
    }
}

/// Measurements at some places, as a criterion in nats sees them.
pub(super) trait Observed {
    /// Of all of them.
    fn nats(&self) -> f64;

    /// What one more adds.
    fn adds(&self, place: usize) -> f64;

    /// What one more is worth before it is weighed with its cost.
    fn gain(&self, place: usize) -> f64 {
        self.adds(place)
    }

    /// Whether anything is left to be measured there.
    fn is_uncertain(&self, place: usize) -> bool;

    fn take(&mut self, place: usize);
}

/// The criterion (nats, negative) with each open place of a field beside what was measured.
pub(super) fn with_each(measured: &impl Observed, others: &PartialSet) -> Vec<(usize, f64)> {
    let open = others.open().into_iter();
    open.filter(|&place| measured.is_uncertain(place))
        .map(|place| (place, -(measured.nats() + measured.adds(place))))
        .collect()
}

/// Adds to a field, one after the other, the open place that is worth the most, the first of equal ones, as long as there
/// is an uncertain one or one that must be there.
pub(super) fn grow<'f>(
    mut measured: impl Observed,
    mut field: PartialSet<'f>,
    report: impl Fn(usize) -> Result<(), Cancelled>,
    found: &dyn Fn(&SensorSet),
) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
    let mut sets = Vec::new();
    while !field.full() {
        report(field.chosen.len())?;
        let mut best = Best::default();
        for place in field.open() {
            if measured.is_uncertain(place) || field.is_required(place) {
                best.offer(place, field.worth(place, measured.gain(place)));
            }
        }
        let Some(place) = best.place() else {
            break;
        };
        measured.take(place);
        field.add(place);
        let set = SensorSet {
            sites: field.sites(),
            criterion: Some(measured.nats()),
            criterion_mm: None,
            gap: None,
            margin: best.margin(),
            certificate: None,
            expected_mm: None,
        };
        found(&set);
        sets.push(set);
    }
    Ok((field, sets))
}

/// Variances of all locations given what was measured: a partial Cholesky factor, a column a measurement.
pub(super) struct Conditional<'a> {
    covariance: &'a Covariance,
    columns: Vec<Vec<f64>>,
    variances: Vec<f64>,
}

impl<'a> Conditional<'a> {
    /// Before anything was measured: the variances of the field itself.
    pub fn nothing(covariance: &'a Covariance) -> Self {
        let n = covariance.k.nrows();
        Self {
            covariance,
            columns: Vec::new(),
            variances: (0..n).map(|i| covariance.k[(i, i)]).collect(),
        }
    }

    /// σ² of the field at a place, without noise.
    pub fn variance(&self, place: usize) -> f64 {
        self.variances[place].max(0.0)
    }

    /// Whether more than rounding is left to learn at a place.
    pub fn uncertain(&self, place: usize) -> bool {
        const PIVOT: f64 = 1e-10;
        self.variances[place] > PIVOT
    }

    /// Takes a noisy measurement at a place into account.
    pub fn observe(&mut self, place: usize) {
        let pivot = (self.variance(place) + self.covariance.noise).sqrt();
        if pivot == 0.0 {
            return;
        }
        let mut column: Vec<f64> = (0..self.variances.len())
            .map(|i| self.covariance.k[(i, place)])
            .collect();
        for known in &self.columns {
            let share = known[place];
            for (c, k) in column.iter_mut().zip(known) {
                *c -= share * k;
            }
        }
        for (c, v) in column.iter_mut().zip(&mut self.variances) {
            *c /= pivot;
            *v -= *c * *c;
        }
        self.columns.push(column);
    }
}

/// The selection from its sets, with what must be known of it.
pub(super) fn finish(
    selector: SelectorKind,
    criterion_unit: &'static str,
    pool: &Pool,
    request: &SelectionRequest,
    geometry: &Geometry,
    chosen: Exchanged,
) -> Result<Selection, PlacementError> {
    let Exchanged { field, sets, .. } = chosen;
    if sets.is_empty() {
        return Err(match field.closed() {
            Some(why) => PlacementError::NoRoom { why },
            None => PlacementError::NoSites,
        });
    }
    let wanted = request.constraints.sensors;
    let short = sets.len() < wanted;
    let no_room = field.closed();
    let stop_reason = match &no_room {
        Some(_) => StopReason::NoRoom,
        None if short => StopReason::Exhausted,
        None => StopReason::Converged,
    };
    let mut notes = geometry.covariance.notes();
    notes.extend(gaussian_process::edge_notes(&geometry.map));
    if geometry.coinciding > 0 {
        notes.push(format!(
            "{} at the place of another: of such sites only one is ever chosen.",
            plain::either(geometry.coinciding, "site lies", "sites lie")
        ));
    }
    notes.extend(field.constant_notes());
    notes.extend(chosen.notes);
    notes.extend(margin::ties(&sets, margin::TOLERANCE));
    let mut cautions = Vec::new();
    if let Some(why) = no_room {
        cautions.push(shortage(&why, sets.len(), wanted));
    } else if short {
        cautions.push(format!(
            "Only {} of {}: beyond them nothing uncertain is left that wishes allow.",
            sets.len(),
            plain::count(wanted, "gauge")
        ));
    }
    Ok(Selection {
        selector,
        criterion_unit,
        pool: pool.sites.len(),
        achieved: Achieved {
            error_estimate: None,
            unit: "",
            effort: Work::default(),
            stop_reason,
            cautions,
            notes,
        },
        sets,
    })
}
