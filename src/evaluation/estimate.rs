//! A quick estimate of the error of a set of gauges, for a hand that is still moving one.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use crate::dataset::SignalMatrix;
use crate::regression::Standardizer;
use crate::regression::kernel::{gaussian, squared_distances};

/// Ridges that are tried, in units of the kernel.
const RIDGES: [f64; 4] = [1e-5, 1e-4, 1e-3, 1e-2];

/// The mean error (mm) of kernel ridge regression when each touch is left out once, at the best of a few
/// ridges. Signals are sites × touches; targets in mm. The residual of a touch that was left out is known
/// without leaving it out: α / diag(A⁻¹), A = K + λ I (Rasmussen and Williams, Gaussian Processes for
/// Machine Learning, 2006, eq. 5.12). Infinite where there is nothing to learn from.
#[must_use]
pub fn leave_one_out(x: &SignalMatrix, targets: &[[f64; 3]], gamma: f64) -> f64 {
    let n = targets.len();
    if n < 3 || x.rows() == 0 {
        return f64::INFINITY;
    }
    let z = Standardizer::of(x).apply(x);
    let kernel = gaussian(&squared_distances(&z, &z), gamma);
    let mean: [f64; 3] = [0, 1, 2].map(|c| targets.iter().map(|t| t[c]).sum::<f64>() / n as f64);
    let centred = Mat::from_fn(n, 3, |i, c| targets[i][c] - mean[c]);
    let errors = RIDGES.iter().filter_map(|&ridge| {
        let a = Mat::from_fn(n, n, |i, j| {
            kernel[i * n + j] + if i == j { ridge } else { 0.0 }
        });
        let inverse = a.llt(Side::Lower).ok()?.inverse();
        let alpha = &inverse * &centred;
        let error = |i: usize| {
            let residual = |c: usize| alpha[(i, c)] / inverse[(i, i)];
            (residual(0).powi(2) + residual(1).powi(2) + residual(2).powi(2)).sqrt()
        };
        Some((0..n).map(error).sum::<f64>() / n as f64)
    });
    errors.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two gauges over a line of touches, and a third that says nothing.
    fn data() -> (SignalMatrix, Vec<[f64; 3]>) {
        let n = 40;
        let at = |t: usize| t as f64 / n as f64;
        let rows = (0..n)
            .map(|t| (3.0 * at(t)).sin())
            .chain((0..n).map(|t| (-(at(t) - 0.7).powi(2) * 9.0).exp()))
            .chain((0..n).map(|t| ((t * 7919) % 13) as f64));
        let x = SignalMatrix::new(n, rows.collect());
        (x, (0..n).map(|t| [100.0 * at(t), 0.0, 5.0]).collect())
    }

    #[test]
    fn it_is_what_leaving_out_one_by_one_gives() {
        let (x, targets) = data();
        let n = targets.len();
        let z = Standardizer::of(&x).apply(&x);
        let kernel = gaussian(&squared_distances(&z, &z), 0.3);
        let mean = targets.iter().map(|t| t[0]).sum::<f64>() / n as f64;
        let naive = RIDGES.map(|ridge| {
            let errors = (0..n).map(|out| {
                let kept: Vec<usize> = (0..n).filter(|&i| i != out).collect();
                let m = kept.len();
                let a = Mat::from_fn(m, m, |i, j| {
                    kernel[kept[i] * n + kept[j]] + if i == j { ridge } else { 0.0 }
                });
                let y = Mat::from_fn(m, 1, |i, _| targets[kept[i]][0] - mean);
                let alpha = a.llt(Side::Lower).unwrap().inverse() * y;
                let said: f64 = (0..m)
                    .map(|i| kernel[out * n + kept[i]] * alpha[(i, 0)])
                    .sum();
                (said + mean - targets[out][0]).abs()
            });
            errors.sum::<f64>() / n as f64
        });
        let best = naive.into_iter().fold(f64::INFINITY, f64::min);
        let quick = leave_one_out(&x, &targets, 0.3);
        assert!((quick - best).abs() < 1e-6 * best, "{quick} {best}");
    }

    #[test]
    fn a_gauge_that_says_nothing_is_worse() {
        let (x, targets) = data();
        let of = |rows: &[usize]| leave_one_out(&x.select_rows(rows), &targets, 0.3);
        assert!(of(&[0, 1]) < 0.2 * of(&[2]));
        assert!(of(&[]).is_infinite());
    }
}
