//! Densities of readings, by their logarithms.

use std::f64::consts::TAU;

use crate::inference::matching::weighed::Observation;

/// Readings that there are (strain).
const LEAST: f64 = 1e-8;
const LARGEST: f64 = 1e-2;

/// Logarithm of the density of a reading of which nothing is known, not even how large it is (H. Jeffreys 1946: evenly over
/// the logarithm of that), but for 2π to the power of half the channels.
pub(super) fn of_nothing_known(observed: &Observation) -> f64 {
    /// As fine as what ten channels leave of how large they are: the sum is that of the integral.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;

    const NOISE: f64 = 1e-8;

    #[test]
    fn what_may_be_anything_is_something_once() {
        let step = 1.001_f64;
        let sizes = (LARGEST / LEAST).ln() / step.ln();
        let mass = |k: i32| {
            let x = LEAST * step.powi(k);
            2.0 * x * (step - 1.0) * log_of_anything(x, NOISE).exp() / TAU.sqrt()
        };
        let all: f64 = (0..sizes as i32).map(mass).sum();
        assert!((all - 1.0).abs() < 2e-3, "{all}");
    }

    #[test]
    fn a_reading_of_one_channel_is_that_of_anything() {
        let errors = ReadingErrors::of_noise(NOISE, 1);
        for x in [[1e-6], [-40e-6], [300e-6]] {
            let observed = Observation::new(&x, &errors, &[true]);
            let [all, one] = [of_nothing_known(&observed), log_of_anything(x[0], NOISE)];
            assert!((all - one).abs() < 0.05, "{all} {one}");
        }
    }
}
