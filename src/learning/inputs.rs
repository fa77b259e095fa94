//! Readings made comparable: every channel by its own middle and spread.
//!
//! A gauge beside a touch reads a hundred times what it reads elsewhere. The inverse hyperbolic sine keeps what is
//! small as it is and takes the logarithm of what is large, of either sign, so that neither strong touches nor a channel
//! that jumps now and then outweighs the rest (N. L. Johnson, 1949). Middle and spread are the median and the median
//! absolute deviation, which no jump moves.

use faer::Mat;

use super::lessons::columns;
use crate::dataset::SignalMatrix;
use crate::regression::Standardizer;
use crate::statistics::{midpoint_median, quantile};

/// The median absolute deviation of a normal distribution, over its standard deviation.
const OF_NORMAL: f64 = 0.674_489_750_196_081_7;

/// What each channel is scaled by.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelScales {
    /// The median of each channel, in the unit of the readings.
    pub middle: Vec<f64>,
    /// The spread of each channel, in the same unit; zero for a channel that always reads the same.
    pub spread: Vec<f64>,
    /// What the inverse hyperbolic sine of each is standardized by.
    pub standard: Standardizer,
}

impl ChannelScales {
    /// Of readings (channels × touches).
    #[must_use]
    pub fn of(x: &SignalMatrix) -> Self {
        let plain = Standardizer::of(x);
        let middle: Vec<f64> = (0..x.rows())
            .map(|r| midpoint_median(x.row(r).to_vec()))
            .collect();
        let spread: Vec<f64> = (0..x.rows())
            .map(|r| variation(x.row(r), middle[r], plain.deviation[r]))
            .collect();
        let bent = bent(x, &middle, &spread);
        Self {
            standard: Standardizer::of(&bent),
            middle,
            spread,
        }
    }

    /// How many channels a reading has.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.middle.len()
    }

    /// Channels that say anything, in their order.
    #[must_use]
    pub fn live(&self) -> Vec<usize> {
        let deviation = &self.standard.deviation;
        (0..deviation.len())
            .filter(|&c| deviation[c] > 0.0)
            .collect()
    }

    /// Readings (channels × touches) as features: touches × live channels.
    #[must_use]
    pub fn apply(&self, x: &SignalMatrix) -> Mat<f64> {
        let scaled = self
            .standard
            .apply(&bent(x, &self.middle, &self.spread))
            .select_rows(&self.live());
        columns(&scaled)
    }
}

/// What a channel varies by: where more than half of its readings are the same (saturated, or touched seldom), their
/// deviation.
fn variation(row: &[f64], middle: f64, deviation: f64) -> f64 {
    if deviation == 0.0 {
        return 0.0;
    }
    let mut off: Vec<f64> = row.iter().map(|v| (v - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    let usual = quantile(&off, MOSTLY).unwrap_or(0.0);
    let robust = midpoint_median(off) / OF_NORMAL;
    // Rounding around a value that is held is no spread.
    if robust > HELD * usual {
        robust
    } else {
        deviation
    }
}

/// What nearly all of its readings are off by at most: a smaller spread than this share of it is the noise of a channel
/// that mostly rests, which is not to be blown up.
const MOSTLY: f64 = 0.95;
const HELD: f64 = 0.02;

fn bent(x: &SignalMatrix, middle: &[f64], spread: &[f64]) -> SignalMatrix {
    let bend = |(r, v): (usize, &f64)| {
        if spread[r] > 0.0 {
            ((v - middle[r]) / spread[r]).asinh()
        } else {
            0.0
        }
    };
    let columns = x.columns();
    let values = x.values().iter().enumerate();
    SignalMatrix::new(
        columns,
        values.map(|(k, v)| bend((k / columns, v))).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings() -> SignalMatrix {
        let value = |t: i32| f64::from(t * 37 % 101) - 50.0;
        let wave: Vec<f64> = (0..101).map(value).collect();
        let stuck = vec![7.25; 101];
        let rare: Vec<f64> = (0..101).map(|t| f64::from(t % 10 / 9) * value(t)).collect();
        SignalMatrix::new(101, [wave, stuck, rare].concat())
    }

    #[test]
    fn a_channel_that_is_stuck_says_nothing_and_one_that_mostly_rests_does() {
        let inputs = ChannelScales::of(&readings());
        assert_eq!(inputs.live(), [0, 2]);
        let features = inputs.apply(&readings());
        assert_eq!((features.nrows(), features.ncols()), (101, 2));
        let size = |c: usize| (0..101).map(|t| features[(t, c)].powi(2)).sum::<f64>() / 101.0;
        assert!((size(0) - 1.0).abs() < 1e-9 && (size(1) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_unit_of_the_readings_changes_nothing() {
        let x = readings();
        let plain = ChannelScales::of(&x).apply(&x);
        for by in [1e-6, 1e6] {
            let scaled = x.scaled(by);
            let same = ChannelScales::of(&scaled).apply(&scaled);
            assert!((&plain - &same).norm_max() < 1e-9);
        }
    }

    #[test]
    fn a_single_jump_does_not_silence_a_channel() {
        let mut values = readings().values().to_vec();
        values[5] = 1e9;
        let jumped = SignalMatrix::new(101, values);
        let features = ChannelScales::of(&jumped).apply(&jumped);
        let others = (0..101).filter(|&t| t != 5).map(|t| features[(t, 0)]);
        let (low, high) = others.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        assert!(high - low > 0.5, "{low} {high}");
    }
}
