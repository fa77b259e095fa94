//! What channels read at rest, how much they tremble, and how that drifts.

use super::health::MEDIAN_OF_NORMAL;
use super::hum::{Hum, HumSamples};
use super::news::LiveNews;
use crate::statistics::{mean, median};
use crate::units;

/// Rest of every channel: counts and the standard deviation of their noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rest {
    /// Mean of each channel (counts).
    pub level: Vec<f64>,
    /// Standard deviation of each channel (counts).
    pub noise: Vec<f64>,
    /// What each channel drifts by (counts a second); empty where that is not known.
    pub drift: Vec<f64>,
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
    /// What is worth a word since the last sample.
    news: Option<LiveNews>,
    /// What hummed while the rest was taken.
    pub(super) hum: Hum,
}

/// Fewer samples say nothing of the noise, and more are not needed.
const FEWEST: usize = 12;
const MOST: usize = 100_000;
/// Parts of a rest that are compared, so that a tap in its middle shows, and deviations of their means by which they may
/// differ.
const PARTS: usize = 4;
const QUIET: f64 = 5.0;
/// Times the slack that a steady drift may be.
const CLIMBS: f64 = 3.0;
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
            news: None,
            hum: Hum::default(),
        }
    }

    /// That something moves and is waited for, or that it is waited for no more. A rest that was there at once is no news.
    #[must_use]
    pub fn news(&self) -> Option<LiveNews> {
        self.news
    }

    /// Takes a sample in; the rest when there were enough that are quiet. While they are not, the oldest part is let go.
    pub fn push(&mut self, time_us: u64, counts: &[f64]) -> Option<Rest> {
        self.news = None;
        let since = |from: u64| units::seconds(time_us.abs_diff(from));
        let begun = *self.begun_us.get_or_insert(time_us);
        self.rows.push((time_us, counts.to_vec()));
        let lasted = since(self.rows[0].0) >= self.seconds && self.rows.len() >= FEWEST;
        if !lasted && self.rows.len() < MOST {
            return None;
        }
        let first = self.rows[0].0;
        let timed = |(at, row): &(u64, Vec<f64>)| (units::seconds(at.abs_diff(first)), row.clone());
        let left = self.hum.begin(&self.rows.iter().map(timed).collect());
        let quiet = is_quiet(&left, self.slack);
        if quiet || since(begun) > PATIENCE_S + self.seconds {
            self.rows.clear();
            let over = if quiet {
                LiveNews::Still
            } else {
                LiveNews::Restless
            };
            self.news = self.waiting.then_some(over);
            return Some(rest(&left));
        }
        if !self.waiting {
            self.waiting = true;
            self.news = Some(LiveNews::Waiting);
        }
        self.rows.drain(..self.rows.len().div_ceil(PARTS));
        None
    }
}

/// Whether all channels stay where they are, or drift steadily: each part of some samples lies on one line with the
/// others, but for what noise makes of it, and the line is no steeper than a few times `slack` within them.
fn is_quiet(rows: &HumSamples, slack: f64) -> bool {
    let counts: Vec<&[f64]> = rows.iter().map(|r| &r.1[..]).collect();
    let parts: Vec<&[&[f64]]> = counts.chunks(counts.len().div_ceil(PARTS)).collect();
    (0..counts[0].len()).all(|c| {
        let levels: Vec<f64> = parts.iter().map(|part| level(part, c)).collect();
        let deviations: Vec<f64> = parts.iter().map(|part| noise_deviation(part, c)).collect();
        let of_mean = mean(&deviations) * (2.0 / parts[0].len() as f64).sqrt();
        let steps = (levels.len() - 1).max(1) as f64;
        let climbs = levels[levels.len() - 1] - levels[0];
        let along = |(k, v): (usize, &f64)| v - climbs * k as f64 / steps;
        let left: Vec<f64> = levels.iter().enumerate().map(along).collect();
        let highest = left.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = left.iter().copied().fold(f64::INFINITY, f64::min);
        let noise = QUIET * of_mean;
        highest - lowest <= noise + slack / 2.0 && climbs.abs() <= noise + CLIMBS * slack
    })
}

/// As it is at the last of some samples (s, counts). Medians, so that a few wild samples count for nothing; noise from
/// differences of neighbours, so that a drift counts for nothing, or where that is more from what they scatter by around it.
fn rest(rows: &HumSamples) -> Rest {
    let lasted = rows.back().map_or(0.0, |r| r.0) - rows.front().map_or(0.0, |r| r.0);
    let counts: Vec<&[f64]> = rows.iter().map(|r| &r.1[..]).collect();
    let mut rest = Rest::default();
    for c in 0..counts[0].len() {
        let quarter = counts.len().div_ceil(4);
        let ends = [&counts[..quarter], &counts[counts.len() - quarter..]];
        let [before, after] = ends.map(|part| level(part, c));
        let drift = (after - before) / (0.75 * lasted).max(f64::MIN_POSITIVE);
        let level = level(&counts, c);
        let off =
            |(at, row): &(f64, Vec<f64>)| (row[c] - level - drift * (at - lasted / 2.0)).abs();
        let scatter = median(rows.iter().map(off)).unwrap_or(0.0) / MEDIAN_OF_NORMAL;
        rest.level.push(level + drift * lasted / 2.0);
        rest.noise.push(noise_deviation(&counts, c).max(scatter));
        rest.drift.push(drift);
    }
    rest
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
    /// Takes what channels are off at rest (counts) for noise, by a share. Channels that are not `trusted` stay.
    pub fn tremble(&mut self, off: &[f64], share: f64, trusted: &[bool]) {
        let pairs = self.noise.iter_mut().zip(off).zip(trusted);
        for ((noise, off), _) in pairs.filter(|(_, trusted)| **trusted) {
            let variance = *noise * *noise;
            *noise = (variance + share * (off * off - variance)).max(0.0).sqrt();
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
        assert!((rest.noise[0] - 3.74).abs() < 0.8, "{rest:?}");
        assert!(rest.noise[1] < 0.1);
        assert!((rest.level[2] - 7.0).abs() < 1e-9);
        assert_eq!(taring.news(), None);
    }

    /// A tap, while the rest is taken, over noise and a slow drift.
    #[test]
    fn a_tap_is_no_rest() {
        for from in [0, 100, 300, 420] {
            let mut taring = Taring::over(0.5, 1.0);
            let mut news = Vec::new();
            let taken = (0..3000_u32).find_map(|k| {
                let noise = f64::from((k * 7919 + k * k * 31) % 7) - 3.0;
                let risen = f64::from(k.saturating_sub(from).min(50)) / 50.0;
                let touch = if k < from + 400 { 8.0 * risen } else { 0.0 };
                let counts = [2000.0 + noise + touch + 1e-3 * f64::from(k), 700.0 - noise];
                let rest = taring.push(1000 * u64::from(k), &counts);
                news.extend(taring.news());
                rest
            });
            let level = taken.unwrap().level[0];
            assert!((level - 2001.0).abs() < 2.0, "{from}: {level}");
            assert_eq!(news, [LiveNews::Waiting, LiveNews::Still], "{from}");
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
        assert_eq!(taring.news(), Some(LiveNews::Restless));
    }
}
