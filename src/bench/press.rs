//! How a place is pressed, and what is read meanwhile.

/// How far and how hard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressLimits {
    /// Between two readings (m).
    pub step: f64,
    /// Of the tip into the limb, from where it was first felt (m).
    pub depth: f64,
    /// The force that is enough (N).
    pub enough: f64,
    /// The force that is never exceeded (N).
    pub most_force: f64,
    /// The force that is a contact (N).
    pub felt: f64,
    /// How far before the place the tip begins to look for it, and how far behind it gives up (m).
    pub before: f64,
    /// See [`Self::before`].
    pub behind: f64,
    /// What is waited after a move, and how long a reading is (µs).
    pub settle_us: u64,
    /// See [`Self::settle_us`].
    pub read_us: u64,
}

impl Default for PressLimits {
    /// As the paper's bench: 0.15 mm a step, to 2 mm or a force that its skin was pressed with.
    fn default() -> Self {
        Self {
            step: 0.15e-3,
            depth: 2e-3,
            enough: 25.0,
            most_force: 35.0,
            felt: 0.25,
            before: 3e-3,
            behind: 2e-3,
            settle_us: 150_000,
            read_us: 150_000,
        }
    }
}

/// Samples of a time, by channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleMean {
    count: usize,
    sums: Vec<f64>,
    squares: Vec<f64>,
}

impl SampleMean {
    /// Takes in a sample. One with another number of channels is of another board.
    pub fn push(&mut self, counts: &[f64]) {
        if self.count == 0 {
            self.sums = vec![0.0; counts.len()];
            self.squares = vec![0.0; counts.len()];
        }
        if counts.len() != self.sums.len() {
            return;
        }
        self.count += 1;
        for (k, c) in counts.iter().enumerate() {
            self.sums[k] += c;
            self.squares[k] += c * c;
        }
    }

    /// How many samples it has.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.count
    }

    /// Of each channel.
    #[must_use]
    pub fn mean(&self) -> Vec<f64> {
        let count = self.count.max(1) as f64;
        self.sums.iter().map(|s| s / count).collect()
    }

    /// Standard deviation of a channel's samples.
    #[must_use]
    pub fn deviation_of(&self, channel: usize) -> f64 {
        let of_mean = self.deviation_of_mean();
        let one = of_mean.get(channel).copied().unwrap_or(0.0);
        one * (self.count.max(1) as f64).sqrt()
    }

    /// Standard deviation of each channel's mean; never below what a converter's step leaves of it.
    #[must_use]
    pub fn deviation_of_mean(&self) -> Vec<f64> {
        /// Of a count that is rounded.
        const ROUNDING: f64 = 0.29;
        let count = self.count.max(1) as f64;
        let of = |(sum, squares): (&f64, &f64)| {
            let mean = sum / count;
            let variance = (squares / count - mean * mean).max(0.0);
            ((variance + ROUNDING * ROUNDING) / count).sqrt()
        };
        self.sums.iter().zip(&self.squares).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_a_mean_with_its_deviation() {
        let mut reading = SampleMean::default();
        for k in 0..100 {
            reading.push(&[10.0 + f64::from(k % 2), 5.0]);
            // Not of this board.
            reading.push(&[1.0]);
        }
        assert_eq!((reading.samples(), reading.mean()), (100, vec![10.5, 5.0]));
        let off = reading.deviation_of_mean();
        assert!((off[0] - 0.058).abs() < 0.001 && (off[1] - 0.029).abs() < 0.001);
    }
}
