//! How well any unbiased estimator can do: the Cramér–Rao bound of a reading with normal noise.

use nalgebra::{Matrix3, Vector3};

use super::map::ResponseMap;
use crate::mesh::SurfacePoint;

/// Least rms errors of place (m) and force (N) for a touch of a force at a place, by the Fisher information
/// of x = f·g(p) + noise over the two directions of the surface and the force. `noise` is a standard
/// deviation for each channel (strain); a channel with an infinite one is not there.
#[must_use]
pub fn cramer_rao(map: &ResponseMap, at: SurfacePoint, force: f64, noise: &[f64]) -> (f64, f64) {
    let slope = map.slope(at);
    let mut information = Matrix3::zeros();
    for (c, noise) in noise.iter().enumerate().filter(|(_, n)| n.is_finite()) {
        let change = slope.change[c] * force;
        let row = Vector3::new(change.x, change.y, slope.reading[c]) / *noise;
        information += row * row.transpose();
    }
    match information.try_inverse() {
        Some(covariance) => (
            (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt(),
            covariance[(2, 2)].max(0.0).sqrt(),
        ),
        None => (f64::INFINITY, f64::INFINITY),
    }
}
