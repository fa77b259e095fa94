//! A trained machine made for answering one sample at a time: several outputs on one kernel.
//!
//! It answers in single precision: with coefficients of a few hundred millimetres that leaves about a micrometre.

use rayon::prelude::*;

use super::features::Standardizer;
use super::kernel::{exp_single, gaussian, squared_distances};
use super::svr::{self, SvrParams};
use crate::dataset::SignalMatrix;
use crate::lanes::wide;

/// Support vectors that are compared side by side.
const LANES: usize = 64;

/// The support vectors of several regressions that share their kernel, in the order in which one sample needs
/// them.
#[derive(Clone, Debug)]
pub struct Predictor {
    standardizer: Standardizer,
    gamma: f64,
    support_vectors: usize,
    biases: Vec<f64>,
    /// Blocks of [`LANES`] support vectors: feature by feature, then output by output their coefficients.
    blocks: Vec<f32>,
}

impl Predictor {
    /// Trains one regression for each row of `targets` (outputs × samples) on signals (features × samples).
    #[must_use]
    pub fn train(x: &SignalMatrix, targets: &[Vec<f64>], params: &[SvrParams], gamma: f64) -> Self {
        let standardizer = Standardizer::of(x);
        let training = standardizer.apply(x);
        let kernel = gaussian(&squared_distances(&training, &training), gamma);
        let fits: Vec<svr::SvrFit> = (targets.par_iter().zip(params))
            .map(|(y, params)| svr::fit(&kernel, y, params, None))
            .collect();
        let support: Vec<usize> = (0..x.columns())
            .filter(|&t| fits.iter().any(|f| f.beta[t] != 0.0))
            .collect();
        let mut blocks = Vec::new();
        for chunk in support.chunks(LANES) {
            let mut row = |value: &dyn Fn(usize) -> f64| {
                blocks.extend((0..LANES).map(|k| chunk.get(k).map_or(0.0, |&t| value(t) as f32)));
            };
            for feature in 0..x.rows() {
                row(&|t| training.row(feature)[t]);
            }
            for fit in &fits {
                row(&|t| fit.beta[t]);
            }
        }
        Self {
            standardizer,
            gamma,
            support_vectors: support.len(),
            biases: fits.iter().map(|f| f.bias).collect(),
            blocks,
        }
    }

    /// Points that it keeps.
    #[must_use]
    pub fn support_vectors(&self) -> usize {
        self.support_vectors
    }

    /// All outputs for one sample (a value a feature).
    #[must_use]
    pub fn predict(&self, sample: &[f64]) -> Vec<f64> {
        let standard = self.standardizer.apply_to(sample);
        let features: Vec<f32> = standard.into_iter().map(|v| v as f32).collect();
        let mut outputs = self.biases.clone();
        add_kernels(&self.blocks, &features, self.gamma as f32, &mut outputs);
        outputs
    }
}

wide! {
    fn add_kernels<'a>(blocks: &'a [f32], sample: &'a [f32], gamma: f32, outputs: &'a mut [f64]) {
        for block in blocks.chunks_exact(LANES * (sample.len() + outputs.len())) {
            let (vectors, coefficients) = block.split_at(LANES * sample.len());
            let mut kernel = [0.0_f32; LANES];
            for (row, &x) in vectors.chunks_exact(LANES).zip(sample) {
                for k in 0..LANES {
                    let d = row[k] - x;
                    kernel[k] += d * d;
                }
            }
            for k in 0..LANES {
                kernel[k] = exp_single(-gamma * kernel[k]);
            }
            for (row, output) in coefficients.chunks_exact(LANES).zip(outputs.iter_mut()) {
                let mut sums = [0.0_f32; 16];
                for part in 0..LANES / 16 {
                    for k in 0..16 {
                        sums[k] += row[16 * part + k] * kernel[16 * part + k];
                    }
                }
                *output += f64::from(sums.iter().sum::<f32>());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_at_a_time_is_the_same_as_all_at_once() {
        let n = 150;
        let value = |f: usize, t: usize| ((f * 7 + t * 13) as f64 * 0.37).sin() * (f + 1) as f64;
        let x = SignalMatrix::new(n, (0..5 * n).map(|k| value(k / n, k % n)).collect());
        let y: Vec<f64> = (0..n)
            .map(|t| x.row(0)[t] * 3.0 + x.row(1)[t].powi(2))
            .collect();
        let z: Vec<f64> = y.iter().map(|y| 5.0 - 0.1 * y).collect();
        let params = SvrParams {
            c: 50.0,
            epsilon: 0.01,
            tolerance: 1e-6,
            max_steps: 1_000_000,
        };
        let predictor = Predictor::train(&x, &[y.clone(), z.clone()], &[params, params], 0.3);
        assert!(predictor.support_vectors() > 20);
        let standard = Standardizer::of(&x).apply(&x);
        let kernel = gaussian(&squared_distances(&standard, &standard), 0.3);
        for (output, target) in [y, z].iter().enumerate() {
            let fit = svr::fit(&kernel, target, &params, None);
            let all = svr::predict(&fit, &kernel);
            for t in 0..n {
                let sample: Vec<f64> = (0..5).map(|f| x.row(f)[t]).collect();
                let one = predictor.predict(&sample)[output];
                assert!((one - all[t]).abs() < 2e-4, "{one} {}", all[t]);
            }
        }
    }
}
