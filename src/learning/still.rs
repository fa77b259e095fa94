//! Whether a skin still is what an estimator was trained on, from a few presses.

use super::doubt::NORMAL_MEAN;
use super::estimator::Estimate;
use crate::regression::tune::distances;
use crate::statistics::mean;

/// What a few presses say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Still {
    /// Presses there were.
    pub presses: usize,
    /// Of them, those that lie outside the radius of their answer, which one of ten may.
    pub outside: usize,
    /// Mean error over the expected one.
    pub over_expected: f64,
    /// How probable errors as large as these are where nothing has changed.
    pub probability: f64,
}

/// Below this probability it is no more what it was.
pub const DOUBTED: f64 = 0.01;

impl Still {
    /// Of answers to presses at true places (mm). Errors over the radius of each are compared with `known` ones, of
    /// touches that were left out when the estimator learned, by their ranks (H. B. Mann and D. R. Whitney 1947): no
    /// distribution is assumed. Nothing where fewer than five of either are there.
    #[must_use]
    pub fn of(known: &[f64], answers: &[Estimate], places_mm: &[[f64; 3]]) -> Option<Self> {
        const LEAST: usize = 5;
        if answers.len().min(known.len()) < LEAST {
            return None;
        }
        let over = over_radius(answers, places_mm);
        Some(Self {
            presses: over.len(),
            outside: over.iter().filter(|&&r| r > 1.0).count(),
            over_expected: mean(&over) / NORMAL_MEAN,
            probability: as_large(&over, known),
        })
    }

    /// Whether it may be what it was.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.probability >= DOUBTED
    }

    /// As it is said, with what to do where it is no more what it was.
    #[must_use]
    pub fn words(&self, cure: &str) -> String {
        let Self {
            presses,
            outside,
            over_expected,
            probability,
        } = self;
        let seen = format!(
            "{outside} of {presses} presses lie outside the radius of their answer, and errors are {over_expected:.1} times those expected"
        );
        if self.holds() {
            format!("{seen}: the skin may well be what it was when the estimator was trained")
        } else {
            format!(
                "{seen} (probability {probability:.1e} where nothing has changed): the skin is no longer what the estimator was trained on. {cure}"
            )
        }
    }
}

/// How far answers are from the true places (mm), over the radius of each.
#[must_use]
pub fn over_radius(answers: &[Estimate], places_mm: &[[f64; 3]]) -> Vec<f64> {
    let said: Vec<[f64; 3]> = answers.iter().map(|a| a.place_mm).collect();
    let errors = distances(&said, places_mm);
    let over = |(e, a): (&f64, &Estimate)| e / a.radius_mm.max(f64::MIN_POSITIVE);
    errors.iter().zip(answers).map(over).collect()
}

/// The probability of ranks as high as those of `new` among `known`, where both are drawn alike: one-sided, by the normal
/// approximation with ties at half.
fn as_large(new: &[f64], known: &[f64]) -> f64 {
    let (n, m) = (new.len() as f64, known.len() as f64);
    let above = |a: f64, b: f64| match a.total_cmp(&b) {
        std::cmp::Ordering::Greater => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Less => 0.0,
    };
    let wins: f64 = new
        .iter()
        .map(|&a| known.iter().map(|&b| above(a, b)).sum::<f64>())
        .sum();
    let deviation = (n * m * (n + m + 1.0) / 12.0).sqrt();
    let z = (wins - n * m / 2.0 - 0.5) / deviation.max(f64::MIN_POSITIVE);
    upper_tail(z)
}

/// Of the normal distribution.
fn upper_tail(z: f64) -> f64 {
    libm::erfc(z / std::f64::consts::SQRT_2) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_the_tables() {
        for (z, p) in [
            (0.0, 0.5),
            (1.0, 0.158_655),
            (2.326_35, 0.01),
            (-1.0, 0.841_345),
        ] {
            assert!((upper_tail(z) - p).abs() < 1e-5, "{z}");
        }
    }

    #[test]
    fn errors_that_are_alike_are_believed_and_larger_ones_are_not() {
        let known: Vec<f64> = (0..400).map(|k| f64::from(k * 149 % 400) / 400.0).collect();
        let alike: Vec<f64> = (0..10)
            .map(|k| f64::from(k * 37 % 10) / 10.0 + 0.05)
            .collect();
        assert!(as_large(&alike, &known) > 0.3);
        let larger: Vec<f64> = alike.iter().map(|v| 3.0 * v).collect();
        assert!(as_large(&larger, &known) < DOUBTED);
    }
}
