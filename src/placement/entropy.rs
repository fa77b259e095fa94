//! Sites of largest uncertainty (A. Krause, A. Singh, C. Guestrin, JMLR 9, 2008; the paper's Algorithm
//! 3): a partial Cholesky factor of the covariance, pivoted by what is still uncertain.

use super::exchange::{self, Criterion};
use super::information::{Conditional, Geometry, finish};
use super::lead::Best;
use super::wishes::Field;
use super::{PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet};
use crate::budget::{Cancelled, report};

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
        let empty = self.geometry.field(pool, request, "Entropy")?;
        let mut sought = Sought {
            geometry: self.geometry,
            request,
        };
        let rounds = exchange::rounds_asked(request.wishes);
        let chosen = exchange::search(&mut sought, pool, request, &empty, rounds)?;
        finish(
            SelectorKind::Entropy,
            "nats of entropy",
            pool,
            request,
            self.geometry,
            chosen,
        )
    }
}

/// The entropy of a set of measurements, negative.
struct Sought<'a> {
    geometry: &'a Geometry,
    request: &'a Request<'a>,
}

impl Sought<'_> {
    fn report(&self, chosen: usize) -> Result<(), Cancelled> {
        let wanted = self.request.wishes.sensors;
        report(self.request.watch, "Selecting by entropy", chosen, wanted)
    }

    /// What measurements at some places leave uncertain, and their entropy.
    fn given(&self, places: &[usize]) -> (Conditional<'_>, f64) {
        let mut given = Conditional::nothing(&self.geometry.covariance);
        let mut entropy = 0.0;
        for &place in places {
            entropy += self.entropy(&given, place);
            given.observe(place);
        }
        (given, entropy)
    }

    /// Of one measurement more: H = ½ ln(2πe σ²), in nats.
    fn entropy(&self, given: &Conditional, place: usize) -> f64 {
        let variance = given.variance(place) + self.geometry.covariance.noise;
        0.5 * (2.0 * std::f64::consts::PI * std::f64::consts::E * variance).ln()
    }
}

impl Criterion for Sought<'_> {
    const UNIT: &'static str = "nats";

    fn told(value: f64) -> f64 {
        -value
    }

    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
        self.report(set.len())?;
        Ok(-self.given(set).1)
    }

    fn screened(&mut self, others: &Field, _: usize) -> Result<Vec<(usize, f64)>, PlacementError> {
        self.report(others.chosen.len())?;
        let (given, entropy) = self.given(&others.chosen);
        let mut open = others.open();
        open.retain(|&place| given.uncertain(place));
        let with = |place: usize| (place, -(entropy + self.entropy(&given, place)));
        Ok(open.into_iter().map(with).collect())
    }

    fn grow<'f>(
        &mut self,
        mut field: Field<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(Field<'f>, Vec<SensorSet>), PlacementError> {
        let (mut given, mut entropy) = self.given(&[]);
        let noise = self.geometry.covariance.noise;
        let mut sets = Vec::new();
        while !field.full() {
            self.report(field.chosen.len())?;
            // The gain of a measurement over its own noise, ½ ln(1 + σ²/β⁻¹), never negative.
            let gain = |place: usize| (1.0 + given.variance(place) / noise.max(1e-12)).ln() / 2.0;
            let best = best(&field, &given, gain);
            let Some(place) = best.place() else {
                break;
            };
            entropy += self.entropy(&given, place);
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
            found(&set);
            sets.push(set);
        }
        Ok((field, sets))
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
