//! Readings under their covariance: weighted sums, and what they say of force and place.
//!
//! Channels are off each for itself, but for what all of them have drifted by together: C = D + δ² 1 1ᵀ with a diagonal
//! D. Its inverse is that of D less a matrix of rank one (J. Sherman and W. J. Morrison, Ann. Math. Statist. 21, 1950):
//! with W = D⁻¹ and κ = δ² / (1 + δ² 1ᵀ W 1),
//!
//! ```text
//! aᵀ C⁻¹ b = aᵀ W b - κ (1ᵀ W a) (1ᵀ W b)        ln |C| = ln |D| + ln (1 + δ² 1ᵀ W 1)
//! ```
//!
//! so that every sum stays one pass over the channels. Without a drift κ is zero.

use std::borrow::Cow;
use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use super::Errors;
use crate::inference::map::Slope;

/// What a drift that all channels share takes from weighted sums.
#[derive(Clone, Copy)]
struct Shared {
    /// κ.
    taken: f64,
    /// Half of what it adds to the logarithm of the determinant.
    log: f64,
}

impl Shared {
    /// `drift` is a variance (strain²).
    fn of(drift: f64, w: &[f64]) -> Self {
        let wider = 1.0 + drift * w.iter().sum::<f64>();
        Self {
            taken: drift / wider,
            log: 0.5 * wider.ln(),
        }
    }
}

/// A reading with its weights, ready to be compared.
pub(super) struct Measured<'a> {
    x: &'a [f64],
    w: &'a [f64],
    /// Weighted squares of a reading without a touch.
    pub squares: f64,
    /// κ, and the sum of the weighted readings.
    pub taken: f64,
    pub sum: f64,
}

impl<'a> Measured<'a> {
    /// With one over the variance of each channel, and the variance of what all have drifted by together.
    fn new(x: &'a [f64], w: &'a [f64], drift: f64) -> Self {
        let shared = Shared::of(drift, w);
        let (mut squares, mut sum) = (0.0, 0.0);
        for (x, w) in x.iter().zip(w) {
            squares += w * x * x;
            sum += w * x;
        }
        Self {
            x,
            w,
            squares: squares - shared.taken * sum * sum,
            taken: shared.taken,
            sum,
        }
    }

    /// Best force and half the squares left over at a place with these readings per newton.
    pub fn fit(&self, g: &[f64], most_force: f64) -> (f64, f64) {
        let (s, d) = self.products(g);
        let force = if d > 0.0 {
            (s / d).clamp(0.0, most_force)
        } else {
            0.0
        };
        (force, 0.5 * self.squares - force * (s - 0.5 * force * d))
    }

    /// Weighted product of the reading with those of a newton, and the squares of these.
    pub fn products(&self, g: &[f64]) -> (f64, f64) {
        let (mut s, mut d, mut sum) = (0.0, 0.0, 0.0);
        for ((x, w), g) in self.x.iter().zip(self.w).zip(g) {
            s += w * x * g;
            d += w * g * g;
            sum += w * g;
        }
        let taken = self.taken * sum;
        (s - taken * self.sum, d - taken * sum)
    }

    /// Normal equations of place (two directions) and force, and their right side.
    pub fn equations(&self, slope: &Slope, force: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let (mut rows, mut off) = (Vector3::zeros(), 0.0);
        for (c, (x, w)) in self.x.iter().zip(self.w).enumerate() {
            let change = slope.change[c] * force;
            let row = Vector3::new(change.x, change.y, slope.reading[c]);
            let left = x - force * slope.reading[c];
            normal += row * row.transpose() * *w;
            right += row * (w * left);
            rows += row * *w;
            off += w * left;
        }
        normal -= rows * rows.transpose() * self.taken;
        right -= rows * (self.taken * off);
        (normal, right)
    }
}

/// A reading, and what is known of its errors wherever the touch was.
pub(super) struct Observation<'a> {
    /// A channel that reads no strain is left out, and stands here as zero.
    x: Cow<'a, [f64]>,
    /// One over the variance of every channel, without gluing.
    pub w: Vec<f64>,
    /// Weighted squares of a reading without a touch.
    pub squares: f64,
    /// Variance of what all channels have drifted by together.
    pub drift: f64,
    /// See [`Shared::log`], without gluing.
    log: f64,
}

impl<'a> Observation<'a> {
    /// A reading with the weights that it has where gluing does not count.
    pub fn new(reading: &'a [f64], errors: &Errors, used: &[bool]) -> Self {
        if reading.iter().all(|&x| is_a_strain(x)) {
            return Self::of(Cow::Borrowed(reading), errors, used);
        }
        let trusted = |(x, used): (&f64, &bool)| *used && is_a_strain(*x);
        let used: Vec<bool> = reading.iter().zip(used).map(trusted).collect();
        let read = |&x: &f64| if is_a_strain(x) { x } else { 0.0 };
        let reading: Vec<f64> = reading.iter().map(read).collect();
        Self::of(Cow::Owned(reading), errors, &used)
    }

    fn of(x: Cow<'a, [f64]>, errors: &Errors, used: &[bool]) -> Self {
        let w = errors.weights(&x, used);
        let drift = errors.drift * errors.drift;
        Self {
            squares: Measured::new(&x, &w, drift).squares,
            log: Shared::of(drift, &w).log,
            x,
            w,
            drift,
        }
    }

    pub fn reading(&self) -> &[f64] {
        &self.x
    }

    /// Logarithm of the density of a reading that is just what was expected, without gluing. Channels that are left
    /// out have none.
    pub fn log_density(&self) -> f64 {
        let trusted = self.w.iter().filter(|w| **w > 0.0);
        trusted.map(|w| 0.5 * (w / TAU).ln()).sum::<f64>() - self.log
    }

    /// As it is compared where gluing does not count.
    pub fn unglued(&self) -> Measured<'_> {
        Measured::new(&self.x, &self.w, self.drift)
    }

    /// The weights for a touch of a force, where gauges glued otherwise would read so much else (a newton).
    pub fn weighed(&self, gluing_deviation: Option<&[f64]>, force: f64) -> Weighed {
        let Some(gluing_deviation) = gluing_deviation else {
            return Weighed {
                w: self.w.clone(),
                log: 0.0,
            };
        };
        let mut log = 0.0;
        let weight = |(w, s): (&f64, &f64)| {
            let wider = 1.0 + w * (force * s).powi(2);
            log += 0.5 * wider.ln();
            w / wider
        };
        let w: Vec<f64> = self.w.iter().zip(gluing_deviation).map(weight).collect();
        Weighed {
            log: log + Shared::of(self.drift, &w).log - self.log,
            w,
        }
    }

    pub fn measured<'b>(&'b self, weighed: &'b Weighed) -> Measured<'b> {
        Measured::new(&self.x, &weighed.w, self.drift)
    }

    /// The force that fits best where all channels are off alike: where each has variances of its own, one begins
    /// here.
    pub fn first_force(&self, g: &[f64]) -> f64 {
        let trusted = || (self.x.iter().zip(g).zip(&self.w)).filter(|(_, w)| **w > 0.0);
        let s: f64 = trusted().map(|((x, g), _)| x * g).sum();
        let d: f64 = trusted().map(|((_, g), _)| g * g).sum();
        if d > 0.0 { s / d } else { 0.0 }
    }
}

/// Whether a reading is one at all: a number, and none that the squares of single precision would not hold.
fn is_a_strain(x: f64) -> bool {
    x.abs() <= 1e6
}

/// The weights of a reading for a touch at one place, of one force.
pub(super) struct Weighed {
    w: Vec<f64>,
    /// Half the logarithm of the covariance's determinant, over that without gluing.
    pub log: f64,
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    const X: [f64; 4] = [3.0, -1.0, 2.0, 0.5];
    const G: [f64; 4] = [1.0, -0.5, 0.25, 0.2];

    fn errors(drift: f64) -> Errors {
        Errors {
            drift,
            ..Errors::of_noises(&[0.5, 1.0, 2.0, 0.25])
        }
    }

    /// One over the covariance, and its determinant, the long way.
    fn dense(variances: &[f64], drift: f64) -> (DMatrix<f64>, f64) {
        let diagonal = DMatrix::from_diagonal(&DVector::from_column_slice(variances));
        let covariance = diagonal.add_scalar(drift * drift);
        let determinant = covariance.determinant();
        (covariance.try_inverse().unwrap(), determinant)
    }

    #[test]
    fn a_common_drift_is_a_covariance_of_rank_one() {
        let errors = errors(3.0);
        let observed = Observation::new(&X, &errors, &[true; 4]);
        let gluing_deviation = [0.3, 0.1, 0.0, 0.7];
        let force = 2.0;
        let variances: Vec<f64> = (errors.noise.iter().zip(gluing_deviation))
            .map(|(n, s)| n * n + f64::powi(force * s, 2))
            .collect();
        let (inverse, determinant) = dense(&variances, 3.0);
        let squares: Vec<f64> = errors.noise.iter().map(|n| n * n).collect();
        let (plain, without) = dense(&squares, 3.0);
        let (x, g) = (
            DVector::from_column_slice(&X),
            DVector::from_column_slice(&G),
        );
        let weighed = observed.weighed(Some(&gluing_deviation), force);
        let measured = observed.measured(&weighed);
        let (s, d) = measured.products(&G);
        assert!((s - x.dot(&(&inverse * &g))).abs() < 1e-12);
        assert!((d - g.dot(&(&inverse * &g))).abs() < 1e-12);
        assert!((measured.squares - x.dot(&(&inverse * &x))).abs() < 1e-12);
        assert!((observed.squares - x.dot(&(&plain * &x))).abs() < 1e-12);
        assert!((weighed.log - 0.5 * (determinant / without).ln()).abs() < 1e-12);
    }

    #[test]
    fn what_all_channels_share_says_nothing_where_they_may_have_drifted() {
        let (still, drifting) = (errors(0.0), errors(1e6));
        let shifted = X.map(|x| x + 5.0);
        let force = |errors: &Errors, x: &[f64]| {
            let observed = Observation::new(x, errors, &[true; 4]);
            observed.unglued().fit(&G, 100.0).0
        };
        assert!((force(&drifting, &shifted) - force(&drifting, &X)).abs() < 1e-6);
        assert!((force(&still, &shifted) - force(&still, &X)).abs() > 0.1);
    }

    #[test]
    fn a_channel_that_reads_no_number_is_one_that_is_not_there() {
        let errors = errors(0.3);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
            let reading = [X[0], bad, X[2], X[3]];
            let observed = Observation::new(&reading, &errors, &[true; 4]);
            let without = Observation::new(&X, &errors, &[true, false, true, true]);
            let fits = [&observed, &without].map(|h| h.unglued().fit(&G, 100.0).0);
            assert_eq!(fits[0], fits[1]);
        }
    }
}
