//! Mains hum: found in what channels do at rest, and taken off.
//!
//! A line of known frequency is a cosine and a sine of each channel. They are fitted by least squares to a second of rest;
//! how the phase turns between its halves gives the frequency to a few millihertz. From then on they follow the signal
//! slowly (B. Widrow et al., Proc. IEEE 63, 1692, 1975), also under a touch: its ends are off by more than the rest ever
//! was, and move them no further than that. Where there is no second of rest they are looked for behind what touches
//! ([`behind`]).

mod behind;
mod line;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

pub(super) use self::line::HumSamples;

use self::line::{CLEAR, HumLine, waves};
use crate::statistics::{chi_squared_bound, mean};

/// Mains, and how many of its harmonics are looked for (Hz).
const MAINS: [f64; 2] = [50.0, 60.0];
const HARMONICS: u32 = 4;
/// A grid is off by so much at most (Hz), and what is slower is no hum.
const OFF: f64 = 0.5;
const SLOWEST: f64 = 5.0;
/// Seconds of rest that are looked at, the fewest that say anything, and the most samples.
const LOOKED_S: f64 = 1.0;
const LEAST_S: f64 = 0.3;
/// Seconds between two looks behind touches, while there has been no rest as long.
const BEHIND_S: f64 = 0.25;
const MOST: usize = 4000;
/// Lines at once.
const LINES: usize = 4;
/// The level that lines stand on is followed in so many radians of the slowest of them: a hand trembles at 6 to 12 Hz, and is to
/// be told from mains.
const LEVEL_RAD: f64 = 3.0;
/// Mean absolute value of what rounding to counts does.
const ROUNDING: f64 = 0.25;

/// What hums.
#[derive(Clone, Debug, Default)]
pub(super) struct Hum {
    lines: Vec<HumLine>,
    level: Level,
    /// What readings are off by at rest, without the lines (counts, mean of the absolute values).
    usual: Vec<f64>,
    now_s: f64,
    rested: HumSamples,
    /// The last samples, be they at rest or not, without the lines.
    recent: HumSamples,
    /// When lines were last looked for at rest, and behind touches.
    looked_s: f64,
    behind_s: f64,
}

impl Hum {
    /// Takes the lines off a sample (counts) that came some seconds after the one before, while nothing touches or
    /// something does.
    pub fn take_off(&mut self, seconds: f64, counts: &mut [f64], at_rest: bool) {
        self.now_s += seconds;
        if seconds <= 0.0 {
            // Nobody knows where its waves are.
            self.lines.clear();
            self.level = Level::default();
            self.rested.clear();
            self.recent.clear();
        }
        if at_rest {
            self.rested.push_back((self.now_s, counts.to_vec()));
            self.look();
        } else {
            self.rested.clear();
        }
        for line in &mut self.lines {
            line.phase = (line.phase + TAU * line.hertz * seconds) % TAU;
            let (sin, cos) = line.phase.sin_cos();
            for (count, [a, b]) in counts.iter_mut().zip(&line.waves) {
                *count -= a * cos + b * sin;
            }
        }
        self.follow(seconds, counts);
        self.recent.push_back((self.now_s, counts.to_vec()));
        keep_the_last(&mut self.recent);
        self.look_behind();
    }

    /// What is left of a sample (counts) moves the lines a little, and the level they stand on.
    fn follow(&mut self, seconds: f64, left: &[f64]) {
        if self.lines.is_empty() {
            self.level = Level::default();
            return;
        }
        let slowest = self.lines.iter().map(|line| line.hertz);
        let slowest = slowest.fold(f64::INFINITY, f64::min);
        let off = self
            .level
            .follow(seconds, LEVEL_RAD / (TAU * slowest), left);
        for line in &mut self.lines {
            line.follow(seconds, &off, &self.usual);
        }
    }

    /// Forgets all.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// What the lines put on readings (counts, rms) of every channel.
    pub fn rms(&self, channel: usize) -> f64 {
        let square = |line: &HumLine| {
            let [a, b] = line.waves.get(channel).copied().unwrap_or_default();
            f64::midpoint(a * a, b * b)
        };
        self.lines.iter().map(square).sum::<f64>().sqrt()
    }

    /// Looks for lines in so much rest as there is, now and then.
    fn look(&mut self) {
        keep_the_last(&mut self.rested);
        if !is_long(&self.rested) || self.now_s - self.looked_s < LOOKED_S {
            return;
        }
        self.looked_s = self.now_s;
        let (lines, mut left) = lines(&self.rested);
        (self.lines, self.usual) = (lines, scatter(&left));
        // The sample that is just coming is the last of these.
        left.pop_back();
        self.recent = left;
        let step = self
            .rested
            .iter()
            .rev()
            .take(2)
            .map(|r| r.0)
            .collect::<Vec<_>>();
        if let [last, before] = step[..] {
            for line in &mut self.lines {
                line.phase -= TAU * line.hertz * (last - before);
            }
        }
    }

    /// Looks for another line where there is no rest to look at.
    fn look_behind(&mut self) {
        let is_due = self.now_s - self.behind_s >= BEHIND_S && is_long(&self.recent);
        if !is_due || lasted(&self.rested) >= BEHIND_S || self.lines.len() >= LINES {
            return;
        }
        self.behind_s = self.now_s;
        let rate = rate(&self.recent);
        let near = unknown(&self.lines, rate);
        let known: Vec<f64> = self.lines.iter().map(|line| line.hertz).collect();
        let found = behind::line_near(&self.recent, rate, [&near, &known], &self.usual);
        if let Some(line) = found {
            self.lines.push(line);
            // It is still in these.
            self.recent.clear();
        }
    }

    /// Takes the lines of some rest (s, counts) for what hums from its last sample on, and off these.
    pub fn begin(&mut self, rows: &HumSamples) -> HumSamples {
        self.forget();
        let (lines, left) = lines(rows);
        (self.lines, self.usual) = (lines, scatter(&left));
        left
    }
}

/// What every channel is without the lines (counts), and how fast that changes (counts a second): an α–β filter with double
/// poles (R. Benedict and G. Bordner, IRE Trans. Automatic Control 7, 1962).
#[derive(Clone, Debug, Default)]
struct Level {
    at: Vec<f64>,
    speed: Vec<f64>,
}

impl Level {
    /// What a sample (counts) that came some seconds (more than none) after the one before is off the level, which follows it
    /// within so many.
    fn follow(&mut self, seconds: f64, within_s: f64, left: &[f64]) -> Vec<f64> {
        if self.at.len() != left.len() {
            (self.at, self.speed) = (left.to_vec(), vec![0.0; left.len()]);
        }
        let kept = (-seconds / within_s).exp();
        let (alpha, beta) = (1.0 - kept * kept, (1.0 - kept) * (1.0 - kept));
        let channels = self.at.iter_mut().zip(&mut self.speed).zip(left);
        channels
            .map(|((at, speed), count)| {
                *at += *speed * seconds;
                let off = count - *at;
                *at += alpha * off;
                *speed += beta * off / seconds;
                off
            })
            .collect()
    }
}

/// Lets go of what is older than is looked at.
fn keep_the_last(rows: &mut HumSamples) {
    let last = rows.back().map_or(0.0, |row| row.0);
    while rows.len() > MOST || rows.front().is_some_and(|row| last - row.0 > LOOKED_S) {
        rows.pop_front();
    }
}

/// Seconds from the first to the last.
fn lasted(rows: &HumSamples) -> f64 {
    let ends = rows.front().zip(rows.back());
    ends.map_or(0.0, |(first, last)| last.0 - first.0)
}

/// Whether they are enough to look at.
fn is_long(rows: &HumSamples) -> bool {
    rows.len() == MOST || lasted(rows) > 0.95 * LOOKED_S
}

/// Samples a second.
fn rate(rows: &HumSamples) -> f64 {
    rows.len().saturating_sub(1) as f64 / lasted(rows)
}

/// The lines of some samples, with their phases at the last one, and what is left of the samples without them.
fn lines(rows: &HumSamples) -> (Vec<HumLine>, HumSamples) {
    let mut left = rows.clone();
    let mut found: Vec<HumLine> = Vec::new();
    let channels = rows.front().map_or(0, |row| row.1.len());
    if lasted(rows) < LEAST_S || channels == 0 {
        return (found, left);
    }
    let rate = rate(rows);
    while found.len() < LINES {
        let middle = level(&left);
        let best = (unknown(&found, rate).into_iter())
            .map(|hertz| (strength(&left, &middle, hertz), hertz))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((strength, hertz)) = best else {
            break;
        };
        // As χ² of two a channel.
        let free = 2.0 * channels as f64;
        if strength < chi_squared_bound(free, CLEAR) {
            break;
        }
        let line = HumLine::fitted(&left, &middle, hertz);
        line.take_from(&mut left);
        found.push(line);
    }
    (found, left)
}

/// Frequencies at which mains may show that are of no line yet.
fn unknown(lines: &[HumLine], rate: f64) -> Vec<f64> {
    let mut all = candidates(rate);
    all.retain(|hertz| lines.iter().all(|l| (l.hertz - hertz).abs() > 2.0 * OFF));
    all
}

/// Frequencies at which mains may show: what is faster than half the rate shows as a slower one.
fn candidates(rate: f64) -> Vec<f64> {
    let seen = |hertz: f64| (hertz - (hertz / rate).round() * rate).abs();
    (MAINS.into_iter())
        .flat_map(|mains| (1..=HARMONICS).map(move |k| seen(mains * f64::from(k))))
        .filter(|&hertz| hertz > SLOWEST && hertz < 0.49 * rate)
        .collect()
}

fn level(rows: &HumSamples) -> Vec<f64> {
    let channels = rows.front().map_or(0, |r| r.1.len());
    let of = |c: usize| mean(&rows.iter().map(|r| r.1[c]).collect::<Vec<_>>());
    (0..channels).map(of).collect()
}

/// What every channel of some samples is off its mean by (counts, mean of the absolute values).
fn scatter(rows: &HumSamples) -> Vec<f64> {
    let middle = level(rows);
    let of = |(c, middle): (usize, &f64)| {
        let off: Vec<f64> = rows.iter().map(|r| (r.1[c] - middle).abs()).collect();
        mean(&off).max(ROUNDING)
    };
    middle.iter().enumerate().map(of).collect()
}

/// Over the scatter of each channel: as χ² where there is noise alone, the largest near a frequency.
fn strength(rows: &HumSamples, level: &[f64], hertz: f64) -> f64 {
    let last = rows.back().map_or(0.0, |r| r.0);
    let count = rows.len() as f64;
    let variance = |c: usize| {
        let squares: f64 = rows.iter().map(|r| (r.1[c] - level[c]).powi(2)).sum();
        (squares / count).max(f64::MIN_POSITIVE)
    };
    let variances: Vec<f64> = (0..level.len()).map(variance).collect();
    let at = |hertz: f64| -> f64 {
        let waves = waves(rows.iter(), last, level, hertz);
        let squares = waves.iter().zip(&variances);
        squares
            .map(|([a, b], v)| count * (a * a + b * b) / (2.0 * v))
            .sum()
    };
    [-OFF, 0.0, OFF]
        .map(|off| at(hertz + off))
        .into_iter()
        .fold(0.0, f64::max)
}
