//! Features: standardized signals.

use crate::dataset::SignalMatrix;

/// Mean and standard deviation of each site's signal over the touches it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Standardizer {
    /// A site each.
    pub mean: Vec<f64>,
    /// Zero for a signal that is constant to rounding.
    pub deviation: Vec<f64>,
}

/// A signal whose spread is below this share of its size is constant: what varies is rounding.
const CONSTANT: f64 = 1e-10;

impl Standardizer {
    /// From signals, sites × touches.
    #[must_use]
    pub fn of(x: &SignalMatrix) -> Self {
        let n = x.columns().max(1) as f64;
        let (mean, deviation) = (0..x.rows())
            .map(|r| {
                let row = x.row(r);
                let mean = row.iter().sum::<f64>() / n;
                let variance = row.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
                let size = row.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let deviation = variance.sqrt();
                (
                    mean,
                    if deviation > CONSTANT * size {
                        deviation
                    } else {
                        0.0
                    },
                )
            })
            .unzip();
        Self { mean, deviation }
    }

    /// (x - mean) / deviation by rows; constant rows become zero.
    #[must_use]
    pub fn apply(&self, x: &SignalMatrix) -> SignalMatrix {
        let values = (0..x.rows())
            .flat_map(|r| {
                let (mean, deviation) = (self.mean[r], self.deviation[r]);
                let scale = if deviation > 0.0 {
                    deviation.recip()
                } else {
                    0.0
                };
                x.row(r).iter().map(move |v| (v - mean) * scale)
            })
            .collect();
        SignalMatrix::new(x.columns(), values)
    }

    /// The same for one sample (a value a row).
    #[must_use]
    pub fn apply_to(&self, sample: &[f64]) -> Vec<f64> {
        let standard = |((v, mean), deviation): ((&f64, &f64), &f64)| {
            let scale = if *deviation > 0.0 {
                deviation.recip()
            } else {
                0.0
            };
            (v - mean) * scale
        };
        (sample.iter().zip(&self.mean).zip(&self.deviation))
            .map(standard)
            .collect()
    }

    /// Rows whose signal is constant.
    #[must_use]
    pub fn constant_rows(&self) -> Vec<usize> {
        (0..self.deviation.len())
            .filter(|&r| self.deviation[r] == 0.0)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_not_taken_for_a_signal() {
        let x = SignalMatrix::new(3, vec![1.0, 1.0 + 1e-15, 1.0 - 1e-15, 0.0, 1.0, 2.0]);
        let s = Standardizer::of(&x);
        assert_eq!(s.constant_rows(), [0]);
        let z = s.apply(&x);
        assert_eq!(z.row(0), [0.0; 3]);
        assert!((z.row(1)[2] - 1.5f64.sqrt()).abs() < 1e-12);
    }
}
