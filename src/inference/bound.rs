//! How well any unbiased estimator can do: the Cramér–Rao bound of a reading with normal noise.

use nalgebra::{DMatrix, DVector};

use super::deviation::Nuisance;
use super::map::ResponseMap;
use crate::mesh::SurfacePoint;

/// Least rms errors of place (m) and force (N) for a touch of a force at a place, by the Fisher information
/// of x = f·(g(p) + Σ uₖ hₖ) + noise over the two directions of the surface, the force, and the nuisances h of the place,
/// whose u are normal with a deviation of one (for these it is the Bayesian bound; none where touches are made just as is
/// said). `noise` is a standard deviation for each channel (strain); a channel with an infinite one is not there.
#[must_use]
pub fn cramer_rao(
    map: &ResponseMap,
    at: SurfacePoint,
    force: f64,
    noise: &[f64],
    nuisances: &[Nuisance],
) -> (f64, f64) {
    let slope = map.slope(at);
    let unknowns = 3 + nuisances.len();
    let mut information = DMatrix::zeros(unknowns, unknowns);
    for k in 3..unknowns {
        information[(k, k)] = 1.0;
    }
    for (c, noise) in noise.iter().enumerate().filter(|(_, n)| n.is_finite()) {
        let change = slope.change[c] * force;
        let row = DVector::from_fn(unknowns, |k, _| match k {
            0 => change.x,
            1 => change.y,
            2 => slope.reading[c],
            _ => force * nuisances[k - 3].reading[c],
        }) / *noise;
        information += &row * row.transpose();
    }
    match information.try_inverse() {
        Some(covariance) => (
            (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt(),
            covariance[(2, 2)].max(0.0).sqrt(),
        ),
        None => (f64::INFINITY, f64::INFINITY),
    }
}
