//! Kernel ridge regression: one length for all channels and one ridge, chosen by touches left out.

use std::convert::Infallible;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::distance::{among, median, over};
use super::kernel::Kernel;
use super::left_out;
use super::lessons::{KnownTouches, lengths as norms};
use super::machine::{AnswerRule, Regression};
use super::walk::walk;
use crate::statistics::mean;

/// A kernel, the length of each feature in it, and the noise over the variance of what is learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothness {
    /// The kernel.
    pub kernel: Kernel,
    /// One a feature.
    pub lengths: Vec<f64>,
    /// Over the variance of the outputs.
    pub noise: f64,
}

/// Touches that settings are searched on: their number is what a search costs, to the third power.
const SEARCHED: usize = 800;
/// Between two lengths that are tried, and between two ridges.
const LENGTH_STEP: f64 = std::f64::consts::SQRT_2;
const RIDGE_STEP: f64 = 4.0;
/// Where the search begins: the median distance between touches, and this ridge.
const FIRST_RIDGE: f64 = 1e-3;

/// The length and the ridge whose error, place by place left out, is smallest.
#[must_use]
pub fn search(known: &KnownTouches) -> Smoothness {
    let some = known.thinned(SEARCHED);
    let squared = among(&some.features);
    let usual = median(&squared);
    let of = |at: [i32; 2]| {
        let length = usual * LENGTH_STEP.powi(at[0]);
        (length, FIRST_RIDGE * RIDGE_STEP.powi(at[1]))
    };
    let error = |at: [i32; 2]| {
        let (length, ridge) = of(at);
        let scaled = Mat::from_fn(squared.nrows(), squared.ncols(), |i, j| {
            squared[(i, j)] / (length * length)
        });
        let covariance = noisy(Kernel::Gaussian.of(scaled), ridge);
        let left = left_out::residuals(&covariance, &some.outputs, &some.groups);
        Ok::<f64, Infallible>(left.map_or(f64::INFINITY, |left| mean(&norms(&left))))
    };
    let Ok((best, _)) = walk(&[[0, 0]], error);
    let (length, noise) = of(best);
    Smoothness {
        kernel: Kernel::Gaussian,
        lengths: vec![length; known.features.ncols()],
        noise,
    }
}

impl Smoothness {
    /// The regression on all touches; nothing where their covariance has no factor.
    #[must_use]
    pub fn fit(&self, known: &KnownTouches) -> Option<Regression> {
        let points = over(&known.features, &self.lengths);
        let covariance = noisy(self.kernel.of(among(&points)), self.noise);
        let weights = covariance.llt(Side::Lower).ok()?.solve(&known.outputs);
        Some(Regression {
            lengths: self.lengths.clone(),
            points,
            by: AnswerRule::Kernel {
                kernel: self.kernel,
                bias: vec![0.0; weights.ncols()],
                weights,
            },
        })
    }

    /// Its residuals at touches of places that it has not learned from: touches × outputs.
    #[must_use]
    pub fn left_out(&self, known: &KnownTouches) -> Option<Mat<f64>> {
        let points = over(&known.features, &self.lengths);
        let covariance = noisy(self.kernel.of(among(&points)), self.noise);
        left_out::residuals(&covariance, &known.outputs, &known.groups)
    }
}

/// A covariance with noise on its diagonal.
#[must_use]
pub fn noisy(mut covariance: Mat<f64>, noise: f64) -> Mat<f64> {
    for i in 0..covariance.nrows() {
        covariance[(i, i)] += noise;
    }
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave over one feature, with noise of this size.
    fn wave(by: f64, noise: f64) -> KnownTouches {
        let at = |t: usize| (t * 61 % 150) as f64 / 150.0 * by;
        let rough = |t: usize| ((t * 7919 % 1000) as f64 / 500.0 - 1.0) * noise;
        KnownTouches {
            features: Mat::from_fn(150, 1, |t, _| at(t)),
            outputs: Mat::from_fn(150, 1, |t, _| (9.0 * at(t) / by).sin() + rough(t)),
            groups: (0..150).collect(),
        }
    }

    #[test]
    fn the_length_follows_the_data_and_the_ridge_their_noise() {
        let plain = search(&wave(1.0, 0.1));
        let wide = search(&wave(1e4, 0.1));
        assert!((wide.lengths[0] / plain.lengths[0] / 1e4 - 1.0).abs() < 1e-9);
        assert_eq!(wide.noise, plain.noise);
        let quiet = search(&wave(1.0, 1e-4));
        assert!(
            quiet.noise < plain.noise / 50.0,
            "{} {}",
            quiet.noise,
            plain.noise
        );
    }
}
