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

/// Gathers samples until they are quiet for a while.
#[derive(Clone, Debug)]
pub struct Taring {
    seconds: f64,
    /// What channels may move by in that time (counts): a drift is no touch.
    slack: f64,
    begun_us: Option<u64>,
    rows: Vec<(u64, Vec<f64>)>,
    waiting: bool,
}

/// Fewer samples say nothing of the noise, and more are not needed.
const FEWEST: usize = 12;
const MOST: usize = 100_000;
/// Parts of a rest that are compared, so that a tap in its middle shows, and deviations of their means by which they may
/// differ.
const PARTS: usize = 4;
const QUIET: f64 = 5.0;
/// Seconds of unrest after which it is taken for rest: a limb that is never still has to do with what it has.
const PATIENCE_S: f64 = 8.0;

impl Taring {
    /// For so many seconds of the samples' own time, in which channels may move by so many counts.
    #[must_use]
    pub fn over(seconds: f64, slack: f64) -> Self {
        Self {
            seconds,
            slack,
            begun_us: None,
            rows: Vec::new(),
            waiting: false,
        }
    }

    /// Whether something has moved, and is waited for.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.waiting
    }

    /// Takes a sample in; the rest when there were enough that are quiet. While they are not, the oldest part is let go.
    pub fn push(&mut self, time_us: u64, counts: &[f64]) -> Option<Rest> {
        let since = |from: u64| time_us.abs_diff(from) as f64 * 1e-6;
        let begun = *self.begun_us.get_or_insert(time_us);
        self.rows.push((time_us, counts.to_vec()));
        let lasted = since(self.rows[0].0) >= self.seconds && self.rows.len() >= FEWEST;
        if !lasted && self.rows.len() < MOST {
            return None;
        }
        let rows: Vec<&[f64]> = self.rows.iter().map(|(_, counts)| &counts[..]).collect();
        if is_quiet(&rows, self.slack) || since(begun) > PATIENCE_S + self.seconds {
            return Some(rest(&rows));
        }
        self.waiting = true;
        self.rows.drain(..self.rows.len().div_ceil(PARTS));
        None
    }
}

/// Whether all channels stay where they are: each part of some samples has the same level, but for what noise and a drift
/// make of it.
fn is_quiet(rows: &[&[f64]], slack: f64) -> bool {
    let parts: Vec<&[&[f64]]> = rows.chunks(rows.len().div_ceil(PARTS)).collect();
    (0..rows[0].len()).all(|c| {
        let levels: Vec<f64> = parts.iter().map(|part| level(part, c)).collect();
        let deviations: Vec<f64> = parts.iter().map(|part| noise_deviation(part, c)).collect();
        let of_mean = mean(&deviations) * (2.0 / parts[0].len() as f64).sqrt();
        let highest = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = levels.iter().copied().fold(f64::INFINITY, f64::min);
        highest - lowest <= QUIET * of_mean + slack
    })
}

/// Medians, so that a few wild samples count for nothing, and noise from differences of neighbours, so that a
/// drift counts for nothing.
fn rest(rows: &[&[f64]]) -> Rest {
    let channels = rows[0].len();
    Rest {
        level: (0..channels).map(|c| level(rows, c)).collect(),
        noise: (0..channels).map(|c| noise_deviation(rows, c)).collect(),
    }
}

/// Finer than a count: the mean of what lies near the median.
fn level(rows: &[&[f64]], channel: usize) -> f64 {
    let column = || rows.iter().map(|row| row[channel]);
    let middle = median(column()).unwrap_or(0.0);
    let most = 4.0 * noise_deviation(rows, channel).max(1.0);
    let near: Vec<f64> = column().filter(|v| (v - middle).abs() <= most).collect();
    mean(&near)
}

/// Standard deviation of the noise by differences of neighbours.
fn noise_deviation(rows: &[&[f64]], channel: usize) -> f64 {
    let squares: f64 = rows
        .windows(2)
        .map(|w| (w[1][channel] - w[0][channel]).powi(2))
        .sum();
    (squares / (2.0 * (rows.len() - 1).max(1) as f64)).sqrt()
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
        let mut taring = Taring::over(0.3985, 25.0);
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
        assert!(!taring.is_waiting());
    }

    /// A tap, while the rest is taken, over noise and a slow drift.
    #[test]
    fn a_tap_is_no_rest() {
        for from in [0, 100, 300, 420] {
            let mut taring = Taring::over(0.5, 1.0);
            let taken = (0..3000_u32).find_map(|k| {
                let noise = f64::from((k * 7919 + k * k * 31) % 7) - 3.0;
                let risen = f64::from(k.saturating_sub(from).min(50)) / 50.0;
                let touch = if k < from + 400 { 8.0 * risen } else { 0.0 };
                let counts = [2000.0 + noise + touch + 1e-3 * f64::from(k), 700.0 - noise];
                taring.push(1000 * u64::from(k), &counts)
            });
            let level = taken.unwrap().level[0];
            assert!((level - 2001.0).abs() < 1.5, "{from}: {level}");
            assert!(taring.is_waiting(), "{from}");
        }
    }

    #[test]
    fn what_is_never_still_is_taken_as_it_is() {
        let mut taring = Taring::over(0.5, 1.0);
        let counts = |k: u32| 2000.0 + 20.0 * f64::from(k % 1700) / 50.0;
        let taken =
            (0..20_000_u32).find(|&k| taring.push(1000 * u64::from(k), &[counts(k)]).is_some());
        let seconds = f64::from(taken.unwrap()) * 1e-3;
        assert!(
            (PATIENCE_S..PATIENCE_S + 2.0).contains(&seconds),
            "{seconds}"
        );
    }
}
