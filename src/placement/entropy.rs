//! Sites of largest uncertainty (A. Krause, A. Singh, C. Guestrin, JMLR 9, 2008; the paper's Algorithm
//! 3): a partial Cholesky factor of the covariance, pivoted by what is still uncertain.

use super::constraints::PartialSet;
use super::exchange::{self, Criterion};
use super::information::{Conditional, Geometry, Observed, finish, grow, with_each};
use super::{PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind, SensorSet};
use crate::budget::{Cancelled, report};

/// The selector. The pool's sites must be the first locations of the geometry.
pub struct Entropy<'a> {
    /// The process.
    pub geometry: &'a Geometry,
}

impl Selector for Entropy<'_> {
    fn kind(&self) -> SelectorKind {
        SelectorKind::Entropy
    }

    fn nested(&self) -> bool {
        true
    }

    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError> {
        let empty = self.geometry.field(pool, request, "Entropy")?;
        let mut sought = EntropySought {
            geometry: self.geometry,
            request,
        };
        let rounds = exchange::rounds_asked(request.constraints);
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
struct EntropySought<'a> {
    geometry: &'a Geometry,
    request: &'a SelectionRequest<'a>,
}

impl EntropySought<'_> {
    fn report(&self, chosen: usize) -> Result<(), Cancelled> {
        let wanted = self.request.constraints.sensors;
        report(self.request.watch, "Selecting by entropy", chosen, wanted)
    }

    fn measured(&self, places: &[usize]) -> Entropies<'_> {
        let covariance = &self.geometry.covariance;
        let mut measured = Entropies {
            given: Conditional::nothing(covariance),
            noise: covariance.noise,
            entropy: 0.0,
        };
        for &place in places {
            measured.take(place);
        }
        measured
    }
}

/// A set of measurements: what it leaves uncertain, and its entropy (nats).
struct Entropies<'a> {
    given: Conditional<'a>,
    noise: f64,
    entropy: f64,
}

impl Observed for Entropies<'_> {
    fn nats(&self) -> f64 {
        self.entropy
    }

    /// Of one measurement more: H = ½ ln(2πe σ²).
    fn adds(&self, place: usize) -> f64 {
        let variance = self.given.variance(place) + self.noise;
        0.5 * (2.0 * std::f64::consts::PI * std::f64::consts::E * variance).ln()
    }

    /// The gain of a measurement over its own noise, ½ ln(1 + σ²/β⁻¹), never negative.
    fn gain(&self, place: usize) -> f64 {
        (1.0 + self.given.variance(place) / self.noise.max(1e-12)).ln() / 2.0
    }

    fn is_uncertain(&self, place: usize) -> bool {
        self.given.uncertain(place)
    }

    fn take(&mut self, place: usize) {
        self.entropy += self.adds(place);
        self.given.observe(place);
    }
}

impl Criterion for EntropySought<'_> {
    const UNIT: &'static str = "nats";

    fn as_reported(value: f64) -> f64 {
        -value
    }

    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
        self.report(set.len())?;
        Ok(-self.measured(set).entropy)
    }

    fn screened(
        &mut self,
        others: &PartialSet,
        _: usize,
    ) -> Result<Vec<(usize, f64)>, PlacementError> {
        self.report(others.chosen.len())?;
        Ok(with_each(&self.measured(&others.chosen), others))
    }

    fn grow<'f>(
        &mut self,
        field: PartialSet<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
        grow(
            self.measured(&[]),
            field,
            |chosen| self.report(chosen),
            found,
        )
    }
}
