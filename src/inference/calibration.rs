//! How gauges were really glued, from a few touches whose place and force are known.
//!
//! A gauge that is off by a little reads x = f·(k g + a ∂g/∂s + b ∂g/∂t + c ∂g/∂φ): its gain, and how far it
//! was moved along itself, across itself and turned. These four are fitted for every channel alone by least
//! squares with normal priors, the same as maximum a posteriori. Few touches decide little, and then the priors
//! hold.

use std::sync::Arc;

use nalgebra::{Matrix4, Vector2, Vector4};
use serde::{Deserialize, Serialize};

use super::map::{ResponseMap, Slope};
use super::matching::{Errors, Measured, equations};
use crate::mesh::SurfacePoint;
use crate::uncertainty::Gluing;

/// What gauges read as drawn, and how that changes with the way they are glued.
pub struct AsDrawn {
    pub map: Arc<ResponseMap>,
    /// A millimetre along the gauge, a millimetre across it, and a degree.
    pub changes: [ResponseMap; 3],
}

impl AsDrawn {
    /// As the gauges really are.
    #[must_use]
    pub fn calibrated(&self, calibration: &Calibration) -> ResponseMap {
        self.glued(&calibration.glued)
    }

    /// For gauges with these gains, moved (mm) and turned (degrees) like that.
    #[must_use]
    pub fn glued(&self, glued: &[[f64; 4]]) -> ResponseMap {
        self.map.combined(&self.changes, glued)
    }

    /// How far off readings per newton are by gluing (standard deviations), at every node of the map and for every
    /// channel.
    #[must_use]
    pub fn spread(&self, gluing: &Gluing) -> ResponseMap {
        let mesh = &self.map.mesh;
        let nodes = mesh.positions().len() + mesh.edges().len();
        let mut values = Vec::with_capacity(nodes * self.map.channels());
        for node in 0..nodes {
            let [along, across, turned] = self.changes.each_ref().map(|m| m.node(node));
            let deviation = |(c, &reading): (usize, &f64)| {
                // From a millimetre and a degree to a metre and a radian.
                let (along, across) = (along[c] * 1e3, across[c] * 1e3);
                let variance = gluing.variance(reading, along, across, turned[c].to_degrees());
                variance.sqrt()
            };
            values.extend(self.map.node(node).iter().enumerate().map(deviation));
        }
        ResponseMap::of(Arc::clone(mesh), self.map.channels(), values)
    }

    /// Readings and slopes at one place for gauges that are glued like that.
    fn slope(&self, at: SurfacePoint, glued: &[[f64; 4]]) -> Slope {
        let mut slope = self.map.slope(at);
        let changes = self.changes.each_ref().map(|m| m.slope(at));
        for (c, factors) in glued.iter().enumerate() {
            slope.reading[c] *= factors[0];
            slope.change[c] *= factors[0];
            for (change, factor) in changes.iter().zip(&factors[1..]) {
                slope.reading[c] += factor * change.reading[c];
                slope.change[c] += change.change[c] * *factor;
            }
        }
        slope
    }

    /// What all four say of one newton at a place: readings as drawn and their changes, channel by channel.
    fn basis(&self, at: SurfacePoint) -> Vec<Vector4<f64>> {
        let [a, b, c] = self.changes.each_ref().map(|m| m.at(at));
        (self.map.at(at).into_iter().enumerate())
            .map(|(k, g)| Vector4::new(g, a[k], b[k], c[k]))
            .collect()
    }
}

/// A touch that was put where it was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    pub at: SurfacePoint,
    /// N.
    pub force: f64,
    /// Strain, a channel each.
    pub reading: Vec<f64>,
}

/// What was learned from known touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// For each channel its gain, millimetres along and across, and degrees.
    pub glued: Vec<[f64; 4]>,
    /// Standard deviation of each gain.
    pub deviations: Vec<f64>,
    /// What is still off, over the reading; see [`Errors::relative`].
    pub relative: f64,
    pub touches: usize,
}

/// What is expected before anything is known: a gain of 1, and standard deviations of gain, millimetres and
/// degrees.
const BEFORE: [f64; 4] = [0.04, 0.8, 0.8, 3.0];
/// Model and gauges are never trusted better than this.
const LEAST: f64 = 0.002;

/// Fits all channels. How large the remaining errors are is what touches show that were left out of the fit.
#[must_use]
pub fn calibrate(drawn: &AsDrawn, known: &[Known], noise: &[f64]) -> Calibration {
    let bases: Vec<Vec<Vector4<f64>>> = known
        .iter()
        .map(|k| drawn.basis(k.at).into_iter().map(|b| b * k.force).collect())
        .collect();
    let mut relative = 0.03;
    let mut fits = Vec::new();
    // Weights need the size of the errors, and that the fits: both settle in a few turns.
    for _ in 0..8 {
        let errors = Errors {
            relative,
            ..Errors::of_noises(noise)
        };
        fits = fit(known, &bases, &errors);
        relative = still_off(known, &bases, &fits, noise);
    }
    // From few touches the size of the errors is itself uncertain, as is the fit: a prediction is wider.
    let weighed = Errors {
        relative,
        ..Errors::of_noises(noise)
    };
    Calibration {
        glued: fits.iter().map(|f| f.glued.into()).collect(),
        deviations: fits.iter().map(|f| f.covariance[(0, 0)].sqrt()).collect(),
        relative: relative.max(misplaced(drawn, known, &bases, &weighed))
            * (1.0 + 4.0 / known.len() as f64).sqrt(),
        touches: known.len(),
    }
}

/// The size of the relative errors at which the places that are found, for touches left out of the fit one
/// after the other, are as far off as the posterior says: a quarter of their squared Mahalanobis distances lies
/// above the upper quartile of χ² with two degrees of freedom. (A single touch far off would decide a mean.)
fn misplaced(
    drawn: &AsDrawn,
    known: &[Known],
    bases: &[Vec<Vector4<f64>>],
    errors: &Errors,
) -> f64 {
    /// -2 ln ¼.
    const QUARTILE: f64 = 2.772_588_722_239_781;
    let slopes: Vec<Slope> = (0..known.len())
        .map(|k| {
            let others = |i: &usize| *i != k;
            let rest: Vec<Known> = (0..known.len())
                .filter(others)
                .map(|i| known[i].clone())
                .collect();
            let bases: Vec<_> = (0..known.len())
                .filter(others)
                .map(|i| bases[i].clone())
                .collect();
            let fits = fit(&rest, &bases, errors);
            let glued: Vec<[f64; 4]> = fits.iter().map(|f| f.glued.into()).collect();
            drawn.slope(known[k].at, &glued)
        })
        .collect();
    let used = vec![true; errors.noise.len()];
    let excess = |relative: f64| {
        let errors = Errors {
            relative,
            ..Errors::of_noises(&errors.noise)
        };
        let mut squares = Vec::new();
        for (k, slope) in known.iter().zip(&slopes) {
            let w = errors.weights(&k.reading, &used);
            let measured = Measured {
                x: &k.reading,
                w: &w,
                squares: 0.0,
            };
            let (normal, right) = equations(&measured, slope, k.force);
            // The force is free: only the place counts.
            let (Some(inverse), true) = (normal.try_inverse(), normal[(2, 2)] > 0.0) else {
                continue;
            };
            let step = inverse * right;
            let place = Vector2::new(step[0], step[1]);
            if let Some(information) = inverse.fixed_view::<2, 2>(0, 0).into_owned().try_inverse() {
                squares.push(place.dot(&(information * place)));
            }
        }
        squares.sort_by(f64::total_cmp);
        let middle = squares.get((squares.len() * 3 / 4).min(squares.len().saturating_sub(1)));
        middle.map_or(0.0, |m| m - QUARTILE)
    };
    zero_of(excess)
}

/// Where a falling function is zero, between what is never trusted and all.
fn zero_of(excess: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (LEAST, 1.0);
    if excess(low) <= 0.0 {
        return low;
    }
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

struct Fit {
    glued: Vector4<f64>,
    covariance: Matrix4<f64>,
}

fn fit(known: &[Known], bases: &[Vec<Vector4<f64>>], errors: &Errors) -> Vec<Fit> {
    let used = vec![true; errors.noise.len()];
    let weights: Vec<Vec<f64>> = known
        .iter()
        .map(|k| errors.weights(&k.reading, &used))
        .collect();
    let prior = Matrix4::from_diagonal(&Vector4::from(BEFORE.map(|s| s.powi(-2))));
    (0..errors.noise.len())
        .map(|c| {
            let mut normal = prior;
            let mut right = prior * Vector4::x();
            for ((k, basis), weights) in known.iter().zip(bases).zip(&weights) {
                normal += basis[c] * basis[c].transpose() * weights[c];
                right += basis[c] * (weights[c] * k.reading[c]);
            }
            let covariance = normal.try_inverse().unwrap_or_else(Matrix4::identity);
            Fit {
                glued: covariance * right,
                covariance,
            }
        })
        .collect()
}

/// The size of the relative errors at which the residuals are as large as they ought to be: each is divided by
/// what the fit has left of it (one less its leverage), and then is what it were had the touch been left out.
fn still_off(known: &[Known], bases: &[Vec<Vector4<f64>>], fits: &[Fit], noise: &[f64]) -> f64 {
    let used = vec![true; fits.len()];
    let count = (known.len() * fits.len()) as f64;
    let excess = |relative: f64| {
        let errors = Errors {
            relative,
            ..Errors::of_noises(noise)
        };
        let mut sum = 0.0;
        for (k, basis) in known.iter().zip(bases) {
            let weights = errors.weights(&k.reading, &used);
            for (c, fit) in fits.iter().enumerate() {
                let off = k.reading[c] - basis[c].dot(&fit.glued);
                let share = (weights[c] * basis[c].dot(&(fit.covariance * basis[c]))).min(0.9);
                sum += weights[c] * off * off / (1.0 - share).powi(2);
            }
        }
        sum - count
    };
    zero_of(excess)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DVec3;

    use super::*;
    use crate::mesh::TriMesh;

    /// Two channels on one triangle, with the same readings per newton at all its six nodes.
    fn map(mesh: &Arc<TriMesh>, readings: [f64; 2]) -> ResponseMap {
        ResponseMap::of(Arc::clone(mesh), 2, readings.repeat(6))
    }

    #[test]
    fn the_spread_is_that_of_gauges_glued_so() {
        const DIRECTIONS: u32 = 8;
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        let mesh = Arc::new(mesh);
        let drawn = AsDrawn {
            map: Arc::new(map(&mesh, [2e-6, -1e-6])),
            changes: [[3e-7, 0.0], [-4e-7, 1e-7], [1e-7, 2e-7]].map(|c| map(&mesh, c)),
        };
        let gluing = Gluing::default();
        // Every way of being off as far as a workshop is, each as likely as its opposite.
        let mut squares = [0.0; 2];
        let at = SurfacePoint {
            triangle: 0,
            barycentric: [0.2, 0.3, 0.5],
        };
        for k in 0..4 * DIRECTIONS {
            let (s, c) = (TAU * f64::from(k / 4) / f64::from(DIRECTIONS)).sin_cos();
            let [turn, gain] = [k % 2, k / 2 % 2].map(|bit| 2.0 * f64::from(bit) - 1.0);
            let off = [
                1.0 + gluing.gain * gain,
                gluing.place * 1e3 * c,
                gluing.place * 1e3 * s,
                gluing.angle.to_degrees() * turn,
            ];
            let built = drawn.glued(&[off, off]).at(at);
            for ((square, built), drawn) in squares.iter_mut().zip(built).zip(drawn.map.at(at)) {
                *square += (built - drawn).powi(2) / f64::from(4 * DIRECTIONS);
            }
        }
        let spread = drawn.spread(&gluing).at(at);
        for (spread, square) in spread.into_iter().zip(squares) {
            assert!((spread - square.sqrt()).abs() < 1e-9 * spread, "{spread}");
        }
        let exact = drawn.spread(&Gluing::EXACT).at(at);
        assert!(exact.iter().all(|&v| v == 0.0));
    }
}
