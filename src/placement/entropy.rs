//! Sites of largest uncertainty (A. Krause, A. Singh, C. Guestrin, JMLR 9, 2008; the paper's Algorithm
//! 3): a partial Cholesky factor of the covariance, pivoted by what is still uncertain.

use super::information::{Conditional, Geometry, finish};
use super::lead::Best;
use super::wishes::Field;
use super::{PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet};
use crate::budget::report;

/// The selector. The pool's sites must be the first locations of the geometry.
pub struct Entropy<'a> {
    pub geometry: &'a Geometry,
}

impl Selector for Entropy<'_> {
    fn kind(&self) -> SelectorKind {
        SelectorKind::Entropy
    }

    fn nested(&self) -> bool {
        true
    }

    fn select(&self, pool: &Pool, request: &Request) -> Result<Selection, PlacementError> {
        let mut field = self.geometry.field(pool, request, "Entropy")?;
        let mut given = Conditional::nothing(&self.geometry.covariance);
        let noise = self.geometry.covariance.noise;
        let mut sets = Vec::new();
        let mut entropy = 0.0;
        while !field.full() {
            report(
                request.watch,
                "Selecting by entropy",
                field.chosen.len(),
                request.wishes.sensors,
            )?;
            // The gain of a measurement over its own noise, ½ ln(1 + σ²/β⁻¹), never negative.
            let gain = |place: usize| (1.0 + given.variance(place) / noise.max(1e-12)).ln() / 2.0;
            let best = best(&field, &given, gain);
            let Some(place) = best.place() else {
                break;
            };
            // H = ½ ln(2πe σ²), in nats.
            let variance = given.variance(place) + noise;
            entropy += 0.5 * (2.0 * std::f64::consts::PI * std::f64::consts::E * variance).ln();
            given.observe(place);
            field.add(place);
            let set = SensorSet {
                sites: field.sites(),
                criterion: Some(entropy),
                criterion_mm: None,
                gap: None,
                lead: best.lead(),
                certificate: None,
            };
            (request.found)(&set);
            sets.push(set);
        }
        finish(
            SelectorKind::Entropy,
            "nats of entropy",
            pool,
            request,
            self.geometry,
            &field,
            sets,
        )
    }
}

/// The open place that is worth the most, the first of equal ones; none where nothing uncertain is left.
fn best(field: &Field, given: &Conditional, gain: impl Fn(usize) -> f64) -> Best {
    let open = field.open();
    let only = matches!(open[..], [only] if field.is_required(only));
    let mut best = Best::default();
    for place in open {
        if only || given.uncertain(place) {
            best.offer(place, field.worth(place, gain(place)));
        }
    }
    best
}
