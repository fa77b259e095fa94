//! Sites that say the most about all others (A. Krause, A. Singh, C. Guestrin, JMLR 9, 2008; the paper's
//! Algorithm 4): the largest σ²(y | A) / σ²(y | all others).
//!
//! The denominator is one over the diagonal of the inverse covariance of what is not chosen. One inverse
//! is made; taking a location out of it is a rank-one change, of which only the diagonal and the columns
//! of chosen sites are ever needed.

use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Mat, Par, Side};

use super::constraints::PartialSet;
use super::exchange::{self, Criterion};
use super::information::{Conditional, Geometry, Observed, finish, grow, with_each};
use super::{PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind, SensorSet};
use crate::budget::{Cancelled, Watch, report};

/// The selector. The pool's sites must be the first locations of the geometry.
pub struct MutualInformation<'a> {
    /// The process.
    pub geometry: &'a Geometry,
}

const STAGE: &str = "Selecting by mutual information";

impl Selector for MutualInformation<'_> {
    fn kind(&self) -> SelectorKind {
        SelectorKind::MutualInformation
    }

    fn nested(&self) -> bool {
        true
    }

    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError> {
        let empty = self.geometry.field(pool, request, "Mutual information")?;
        let mut sought = InformationSought {
            geometry: self.geometry,
            inverse: Inverse::of(self.geometry, request.watch)?,
            request,
        };
        let rounds = exchange::rounds_asked(request.constraints);
        let chosen = exchange::search(&mut sought, pool, request, &empty, rounds)?;
        finish(
            SelectorKind::MutualInformation,
            "nats of mutual information",
            pool,
            request,
            self.geometry,
            chosen,
        )
    }
}

/// What a set of measurements says of all other locations, negative.
struct InformationSought<'a> {
    geometry: &'a Geometry,
    inverse: Inverse,
    request: &'a SelectionRequest<'a>,
}

/// A set of measurements: what it leaves uncertain, all locations beside it, and what it says of them (nats).
struct Informed<'a> {
    given: Conditional<'a>,
    noise: f64,
    rest: UnchosenRest<'a>,
    information: f64,
}

impl Observed for Informed<'_> {
    fn nats(&self) -> f64 {
        self.information
    }

    fn adds(&self, place: usize) -> f64 {
        0.5 * ((self.given.variance(place) + self.noise) * self.rest.diagonal[place]).ln()
    }

    fn is_uncertain(&self, place: usize) -> bool {
        self.given.uncertain(place)
    }

    fn take(&mut self, place: usize) {
        self.information += self.adds(place);
        self.given.observe(place);
        self.rest.remove(place);
    }
}

impl InformationSought<'_> {
    fn report(&self, chosen: usize) -> Result<(), Cancelled> {
        let wanted = self.request.constraints.sensors;
        report(self.request.watch, STAGE, chosen, wanted)
    }

    fn measured(&self, places: &[usize]) -> Result<Informed<'_>, Cancelled> {
        let covariance = &self.geometry.covariance;
        let mut measured = Informed {
            given: Conditional::nothing(covariance),
            noise: covariance.noise,
            rest: UnchosenRest::of(&self.inverse),
            information: 0.0,
        };
        for &place in places {
            self.report(places.len())?;
            measured.take(place);
        }
        Ok(measured)
    }
}

impl Criterion for InformationSought<'_> {
    const UNIT: &'static str = "nats";

    fn as_reported(value: f64) -> f64 {
        -value
    }

    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
        Ok(-self.measured(set)?.information)
    }

    fn screened(
        &mut self,
        others: &PartialSet,
        _: usize,
    ) -> Result<Vec<(usize, f64)>, PlacementError> {
        Ok(with_each(&self.measured(&others.chosen)?, others))
    }

    fn grow<'f>(
        &mut self,
        field: PartialSet<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
        let nothing = self.measured(&[])?;
        grow(nothing, field, |chosen| self.report(chosen), found)
    }
}

/// The inverse covariance (with noise) of all locations: its diagonal, and what it takes to know a column.
struct Inverse {
    /// L⁻¹ of the covariance.
    factor: Mat<f64>,
    diagonal: Vec<f64>,
}

impl Inverse {
    fn of(geometry: &Geometry, watch: Watch) -> Result<Self, PlacementError> {
        /// Least variance of a measurement: without any the inverse of a smooth field has no digits.
        const LEAST: f64 = 1e-8;
        let covariance = &geometry.covariance;
        let n = covariance.k.nrows();
        let mut a = covariance.k.clone();
        for i in 0..n {
            a[(i, i)] += covariance.noise.max(LEAST);
        }
        report(watch, STAGE, 0, 1)?;
        let llt = a.llt(Side::Lower).map_err(|_| PlacementError::Singular)?;
        report(watch, STAGE, 0, 1)?;
        let mut factor = Mat::zeros(n, n);
        invert_lower_triangular(factor.as_mut(), llt.L(), Par::Seq);
        let diagonal = (0..n)
            .map(|c| (c..n).map(|r| factor[(r, c)].powi(2)).sum())
            .collect();
        Ok(Self { factor, diagonal })
    }

    /// Of L⁻ᵀ L⁻¹.
    fn column(&self, place: usize) -> Vec<f64> {
        let n = self.diagonal.len();
        let own = self.factor.col(place);
        let entry = |c: usize| -> f64 {
            let from = place.max(c);
            (from..n).map(|r| self.factor[(r, c)] * own[r]).sum()
        };
        (0..n).map(entry).collect()
    }
}

/// The same of all locations not chosen.
struct UnchosenRest<'a> {
    all: &'a Inverse,
    diagonal: Vec<f64>,
    /// Columns taken out so far, scaled.
    removed: Vec<Vec<f64>>,
}

impl<'a> UnchosenRest<'a> {
    fn of(all: &'a Inverse) -> Self {
        Self {
            diagonal: all.diagonal.clone(),
            all,
            removed: Vec::new(),
        }
    }

    /// Takes a location out.
    fn remove(&mut self, place: usize) {
        // As it was, then the changes made so far.
        let mut column = self.all.column(place);
        for v in &self.removed {
            let share = v[place];
            for (c, v) in column.iter_mut().zip(v) {
                *c -= share * v;
            }
        }
        let scale = column[place].max(f64::MIN_POSITIVE).sqrt();
        for c in &mut column {
            *c /= scale;
        }
        for (d, c) in self.diagonal.iter_mut().zip(&column) {
            *d -= c * c;
        }
        self.removed.push(column);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::gaussian_process::{Covariance, Distances, GpKernel};

    #[test]
    fn what_is_left_has_the_inverse_of_what_is_left() {
        let n = 12;
        let d: Vec<f64> = (0..n)
            .flat_map(|i| (0..n).map(move |j| (f64::from(i) - f64::from(j)).abs() * 0.01))
            .collect();
        let distances = Distances::new(12, "along a line", &d);
        let kernel = GpKernel {
            noise: 0.01,
            ..GpKernel::default()
        };
        let geometry = Geometry {
            covariance: Covariance::new(&distances, &kernel, &unwatched).unwrap(),
            kernel,
            distance: distances.kind,
            coinciding: 0,
            map: Vec::new(),
        };
        let inverse = Inverse::of(&geometry, &unwatched).unwrap();
        let mut rest = UnchosenRest::of(&inverse);
        rest.remove(3);
        rest.remove(7);
        let left: Vec<usize> = (0..12).filter(|i| ![3, 7].contains(i)).collect();
        let mut small = Mat::from_fn(10, 10, |i, j| geometry.covariance.k[(left[i], left[j])]);
        for i in 0..10 {
            small[(i, i)] += 0.01;
        }
        let inverse = {
            use faer::linalg::solvers::Solve;
            small
                .llt(Side::Lower)
                .unwrap()
                .solve(Mat::<f64>::identity(10, 10))
        };
        for (k, &i) in left.iter().enumerate() {
            assert!((rest.diagonal[i] / inverse[(k, k)] - 1.0).abs() < 1e-9);
        }
    }
}
