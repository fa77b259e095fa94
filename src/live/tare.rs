//! What channels read at rest, how much they tremble, and how that drifts.

use crate::statistics::{mean, median};

/// Rest of every channel: counts and the standard deviation of their noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rest {
    /// Mean of each channel (counts).
    pub level: Vec<f64>,
    /// Standard deviation of each channel (counts).
    pub noise: Vec<f64>,
}

/// Gathers samples at rest.
#[derive(Clone, Debug)]
pub struct Taring {
    seconds: f64,
    begun_us: Option<u64>,
    rows: Vec<Vec<f64>>,
}

/// Fewer samples say nothing of the noise, and more are not needed.
const FEWEST: usize = 12;
const MOST: usize = 100_000;

impl Taring {
    /// For so many seconds of the samples' own time.
    #[must_use]
    pub fn over(seconds: f64) -> Self {
        Self {
            seconds,
            begun_us: None,
            rows: Vec::new(),
        }
    }

    /// Takes a sample in; the rest when there are enough.
    pub fn push(&mut self, time_us: u64, counts: &[f64]) -> Option<Rest> {
        let begun = *self.begun_us.get_or_insert(time_us);
        self.rows.push(counts.to_vec());
        let lasted = time_us.abs_diff(begun) as f64 * 1e-6 >= self.seconds;
        let enough = lasted && self.rows.len() >= FEWEST;
        (enough || self.rows.len() >= MOST).then(|| rest(&self.rows))
    }
}

/// Medians, so that a few wild samples count for nothing, and noise from differences of neighbours, so that a
/// drift counts for nothing.
fn rest(rows: &[Vec<f64>]) -> Rest {
    let channels = rows[0].len();
    let column = |c: usize| rows.iter().map(move |row| row[c]);
    let level = |c: usize| {
        let middle = median(column(c)).unwrap_or(0.0);
        // Finer than a count: the mean of what lies near the median.
        let near: Vec<f64> = column(c)
            .filter(|v| (v - middle).abs() <= 4.0 * noise_deviation(rows, c).max(1.0))
            .collect();
        mean(&near)
    };
    Rest {
        level: (0..channels).map(level).collect(),
        noise: (0..channels).map(|c| noise_deviation(rows, c)).collect(),
    }
}

/// Standard deviation of the noise by differences of neighbours.
fn noise_deviation(rows: &[Vec<f64>], channel: usize) -> f64 {
    let squares: f64 = rows
        .windows(2)
        .map(|w| (w[1][channel] - w[0][channel]).powi(2))
        .sum();
    (squares / (2.0 * (rows.len() - 1) as f64)).sqrt()
}

impl Rest {
    /// Follows a slow drift by a share of what channels are off, and takes what they wander for noise by
    /// another share: what has drifted lately will go on drifting. Channels that are not `trusted` stay.
    pub fn follow(&mut self, counts: &[f64], shares: [f64; 2], trusted: &[bool]) {
        for (k, count) in counts.iter().enumerate().filter(|(k, _)| trusted[*k]) {
            let off = count - self.level[k];
            let variance = self.noise[k] * self.noise[k];
            self.noise[k] = (variance + shares[1] * (off * off - variance))
                .max(0.0)
                .sqrt();
            self.level[k] += shares[0] * off;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_is_found_among_wild_samples_and_drift() {
        let mut taring = Taring::over(0.3985);
        let mut rest = None;
        for k in 0..400_u32 {
            let noise = f64::from((k * 7919) % 13) - 6.0;
            let wild = if k % 97 == 5 { 3000.0 } else { 0.0 };
            rest = taring.push(
                1000 * u64::from(k),
                &[100.0 + noise, 50.0 + 0.05 * f64::from(k), 7.0 + wild],
            );
        }
        let rest = rest.unwrap();
        assert!((rest.level[0] - 100.0).abs() < 0.2, "{rest:?}");
        assert!((rest.noise[0] - 3.74).abs() < 0.6, "{rest:?}");
        assert!(rest.noise[1] < 0.1);
        assert!((rest.level[2] - 7.0).abs() < 1e-9);
    }
}
