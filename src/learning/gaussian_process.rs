//! A Gaussian process whose lengths, one a channel, follow the data: those are taken under which what was measured is
//! likeliest (automatic relevance determination; Rasmussen and Williams, 2006, sections 5.1 and 5.4.1).
//!
//! All outputs share kernel and noise; the variance of each is what makes it likeliest, in closed form. Lengths of a
//! hundred channels are more than a hundred touches can tell: their logarithms are drawn to their mean, as far as
//! `APART` says.

use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};

use super::distance::{among, median, over};
use super::kernel::Kernel;
use super::lbfgs::{self, Valued};
use super::lessons::KnownTouches;
use super::ridge::{Smoothness, noisy};
use crate::budget::{Cancelled, Watch, report};

/// Touches that lengths are learned from: their number is what a step costs, to the third power.
const LEARNED: usize = 800;
/// Most steps.
const STEPS: usize = 50;
/// Standard deviation of the logarithms of lengths around their mean that is thought likely beforehand.
const APART: f64 = 0.7;
/// Least and largest noise over the variance of the outputs.
const NOISE: [f64; 2] = [1e-8, 4.0];
/// Where the search begins.
const FIRST_NOISE: f64 = 1e-2;
/// Lengths lie within so many factors of e around the median distance.
const REACH: f64 = 8.0;

/// Lengths and noise under which the outputs are likeliest.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn learn(
    known: &KnownTouches,
    stage: &'static str,
    watch: Watch,
) -> Result<Smoothness, Cancelled> {
    let some = known.thinned(LEARNED);
    let channels = some.features.ncols();
    let usual = median(&among(&some.features)).ln();
    let mut start = vec![usual; channels];
    start.push(FIRST_NOISE.ln());
    let mut bounds = vec![(usual - REACH, usual + REACH); channels];
    bounds.push((NOISE[0].ln(), NOISE[1].ln()));
    let mut steps = 0;
    let found = lbfgs::minimize(start, &bounds, STEPS, |at| {
        report(watch, stage, steps, STEPS.max(steps + 1))?;
        steps += 1;
        Ok(surprise(&some, at))
    })?;
    let (noise, lengths) = found.split_last().unwrap_or((&0.0, &[]));
    Ok(Smoothness {
        kernel: KERNEL,
        lengths: lengths.iter().map(|l| l.exp()).collect(),
        noise: noise.exp(),
    })
}

const KERNEL: Kernel = Kernel::Matern;

/// Minus the logarithm of how likely the outputs are at logarithms of lengths and, last, of the noise, and its
/// gradient; nothing where the covariance has no factor.
fn surprise(known: &KnownTouches, at: &[f64]) -> Valued {
    let (noise, logs) = at.split_last()?;
    let noise = noise.exp();
    let lengths: Vec<f64> = logs.iter().map(|l| l.exp()).collect();
    let points = over(&known.features, &lengths);
    let squared = among(&points);
    let factor = noisy(KERNEL.of(squared.clone()), noise)
        .llt(Side::Lower)
        .ok()?;
    let (n, outputs) = (known.outputs.nrows() as f64, known.outputs.ncols() as f64);
    let alpha = factor.solve(&known.outputs);
    let variances: Vec<f64> = (0..alpha.ncols())
        .map(|k| (known.outputs.col(k).transpose() * alpha.col(k)) / n)
        .collect();
    let half_determinant: f64 = factor
        .L()
        .diagonal()
        .column_vector()
        .iter()
        .map(|l| l.ln())
        .sum();
    let log_variances: f64 = variances.iter().map(|v| v.ln()).sum();
    let middle = logs.iter().sum::<f64>() / logs.len().max(1) as f64;
    let drawn: f64 = logs.iter().map(|l| (l - middle).powi(2)).sum();
    let value =
        0.5 * n * log_variances + outputs * half_determinant + 0.5 * drawn / (APART * APART);

    // Twice the derivative by each entry of the covariance.
    let scaled = Mat::from_fn(alpha.nrows(), alpha.ncols(), |t, k| {
        alpha[(t, k)] / variances[k]
    });
    let by_entry = factor.inverse() * outputs - scaled * alpha.transpose();
    let trace: f64 = by_entry.diagonal().column_vector().iter().sum();
    let mut gradient = by_length(&points, &squared, by_entry);
    for (g, l) in gradient.iter_mut().zip(logs) {
        *g += (l - middle) / (APART * APART);
    }
    gradient.push(0.5 * noise * trace);
    Some((value, gradient))
}

/// The derivative by the logarithm of each length, from twice the one by each entry of the covariance: with G the one by
/// squared distances, -Σ Gij (xi - xj)² for each feature x, over all pairs at once.
fn by_length(points: &Mat<f64>, squared: &Mat<f64>, mut by_entry: Mat<f64>) -> Vec<f64> {
    for (column, d) in by_entry.col_iter_mut().zip(squared.col_iter()) {
        for (g, d) in column.iter_mut().zip(d.iter()) {
            *g *= KERNEL.slope(*d);
        }
    }
    let sums: Vec<f64> = by_entry.col_iter().map(|c| c.iter().sum()).collect();
    let product = &by_entry * points;
    let of = |c: usize| {
        let pairs = points.col(c).iter().zip(product.col(c).iter()).zip(&sums);
        -2.0 * pairs.map(|((x, p), sum)| x * (sum * x - p)).sum::<f64>()
    };
    (0..points.ncols()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;

    /// Two outputs of three features, the last of which says nothing.
    fn known() -> KnownTouches {
        let at = |t: usize, c: usize| ((t * [7, 11, 23][c] % 97) as f64 / 97.0 - 0.5) * 4.0;
        KnownTouches {
            features: Mat::from_fn(97, 3, at),
            outputs: Mat::from_fn(97, 2, |t, k| {
                (at(t, 0) * 1.3).sin() + k as f64 * (at(t, 1) * 0.4).cos()
            }),
            groups: (0..97).collect(),
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_value() {
        let known = known();
        let at = [0.1, 0.5, -0.2, -3.0];
        let (_, gradient) = surprise(&known, &at).unwrap();
        for k in 0..4 {
            let moved = |by: f64| {
                let mut at = at;
                at[k] += by;
                surprise(&known, &at).unwrap().0
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!(
                (slope - gradient[k]).abs() < 1e-3 * slope.abs().max(1.0),
                "{k}: {slope} {gradient:?}"
            );
        }
    }

    #[test]
    fn a_channel_that_says_nothing_gets_the_longest_length() {
        let found = learn(&known(), "Learning", &unwatched).unwrap();
        let [first, second, idle] = found.lengths[..] else {
            panic!("three lengths")
        };
        assert!(
            idle > 1.5 * second && second > first,
            "{first} {second} {idle}"
        );
        assert!(found.noise < 1e-3, "{}", found.noise);
    }
}
