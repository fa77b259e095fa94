//! Sites that say the most about all others (A. Krause, A. Singh, C. Guestrin, JMLR 9, 2008; the paper's
//! Algorithm 4): the largest σ²(y | A) / σ²(y | all others).
//!
//! The denominator is one over the diagonal of the inverse covariance of what is not chosen. One inverse
//! is made; taking a location out of it is a rank-one change, of which only the diagonal and the columns
//! of chosen sites are ever needed.

use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Mat, Par, Side};

use super::information::{Conditional, Geometry, finish};
use super::lead::Best;
use super::{PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet};
use crate::budget::{Watch, report};

/// The selector. The pool's sites must be the first locations of the geometry.
pub struct MutualInformation<'a> {
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

    fn select(&self, pool: &Pool, request: &Request) -> Result<Selection, PlacementError> {
        let mut field = self.geometry.field(pool, request, "Mutual information")?;
        let covariance = &self.geometry.covariance;
        let noise = covariance.noise;
        let mut given = Conditional::nothing(covariance);
        let mut rest = Rest::of(self.geometry, request.watch)?;
        let mut sets = Vec::new();
        let mut information = 0.0;
        while !field.full() {
            report(
                request.watch,
                STAGE,
                field.chosen.len(),
                request.wishes.sensors,
            )?;
            let gain =
                |place: usize| 0.5 * ((given.variance(place) + noise) * rest.diagonal[place]).ln();
            let open = field.open();
            let mut best = Best::default();
            for &place in &open {
                let value = field.worth(place, gain(place));
                let possible = given.uncertain(place) || field.is_required(place);
                if possible {
                    best.offer(place, value);
                }
            }
            let Some(place) = best.place() else {
                break;
            };
            information += gain(place);
            given.observe(place);
            rest.remove(place);
            field.add(place);
            let set = SensorSet {
                sites: field.sites(),
                criterion: Some(information),
                criterion_mm: None,
                gap: None,
                lead: best.lead(),
                certificate: None,
            };
            (request.found)(&set);
            sets.push(set);
        }
        finish(
            SelectorKind::MutualInformation,
            "nats of mutual information",
            pool,
            request,
            self.geometry,
            &field,
            sets,
        )
    }
}

/// The inverse covariance (with noise) of all locations not chosen: its diagonal, and what it takes to
/// know a column.
struct Rest {
    /// L⁻¹ of the covariance of all locations.
    inverse_factor: Mat<f64>,
    diagonal: Vec<f64>,
    /// Columns taken out so far, scaled.
    removed: Vec<Vec<f64>>,
}

impl Rest {
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
        let factor = a.llt(Side::Lower).map_err(|_| PlacementError::Singular)?;
        report(watch, STAGE, 0, 1)?;
        let mut inverse_factor = Mat::zeros(n, n);
        invert_lower_triangular(inverse_factor.as_mut(), factor.L(), Par::Seq);
        let diagonal = (0..n)
            .map(|c| (c..n).map(|r| inverse_factor[(r, c)].powi(2)).sum())
            .collect();
        Ok(Self {
            inverse_factor,
            diagonal,
            removed: Vec::new(),
        })
    }

    /// Takes a location out.
    fn remove(&mut self, place: usize) {
        let n = self.diagonal.len();
        // Column of L⁻ᵀ L⁻¹, then the changes made so far.
        let own = self.inverse_factor.col(place);
        let mut column: Vec<f64> = (0..n)
            .map(|c| {
                let from = place.max(c);
                (from..n)
                    .map(|r| self.inverse_factor[(r, c)] * own[r])
                    .sum()
            })
            .collect();
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
        let mut rest = Rest::of(&geometry, &unwatched).unwrap();
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
