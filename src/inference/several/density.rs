//! Densities of readings, by their logarithms.

use std::f64::consts::TAU;

use crate::inference::matching::weighed::Observation;

/// Readings that there are (strain).
const LEAST: f64 = 1e-8;
const LARGEST: f64 = 1e-2;

/// Logarithm of the density of a reading of which nothing is known, not even how large it is (H. Jeffreys 1946: evenly over
/// the logarithm of that), but for 2π to the power of half the channels.
pub(super) fn of_nothing_known(observed: &Observation) -> f64 {
    /// A step is well below what ten channels leave of how large they are.
    const STEP: f64 = 0.2;
    let sizes = (LARGEST / LEAST).ln();
    let steps = (sizes / STEP) as u32;
    let of_size = |size: f64| -> f64 {
        let trusted = (observed.reading().iter().zip(&observed.w)).filter(|(_, w)| **w > 0.0);
        let of_channel = trusted.map(|(x, w)| log_density(*x, size.hypot(w.recip().sqrt())));
        of_channel.sum()
    };
    let logs = (0..steps).map(|k| of_size(LEAST * (STEP * (f64::from(k) + 0.5)).exp()));
    sum_of(logs.collect::<Vec<_>>().into_iter()) - f64::from(steps).ln()
}

/// The same of a single channel that may read anything: 1 / (2 |x| ln(b/a)), but for √2π.
pub(super) fn log_of_anything(value: f64, noise: f64) -> f64 {
    let sizes = (LARGEST / LEAST).ln();
    0.5 * TAU.ln() - (2.0 * sizes * value.abs().max(noise)).ln()
}

/// Logarithm of a normal density around zero, but for √2π.
pub(super) fn log_density(value: f64, deviation: f64) -> f64 {
    -0.5 * (value / deviation).powi(2) - deviation.ln()
}

/// Logarithm of a sum of exponentials.
pub(super) fn sum_of(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}
