//! A line that hums: a cosine and a sine of one frequency in every channel.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// Over what noise would do, in deviations: then it is a line.
pub(super) const CLEAR: f64 = 12.0;
/// Seconds in which a line follows the signal.
const FOLLOWS_S: f64 = 0.3;
/// So far (Hz) from where it was found a line may go at most: one that shows below the frequencies of a hand is not to be drawn
/// after a tremble.
const STRAYS: f64 = 0.5;
/// What is off by more than so many times what is usual at rest is a touch that comes or goes, and moves a line no further.
const UNUSUAL: f64 = 4.0;

/// Samples: when (s), and what every channel read.
pub(in crate::live) type HumSamples = VecDeque<(f64, Vec<f64>)>;

/// One frequency.
#[derive(Clone, Debug)]
pub(super) struct HumLine {
    pub hertz: f64,
    /// Its frequency when it was found.
    found: f64,
    /// At the last sample (rad).
    pub phase: f64,
    /// Of its cosine and its sine in every channel (counts).
    pub waves: Vec<[f64; 2]>,
}

/// Cosine and sine of every channel at a frequency, in some of the samples, with phases from the last one.
pub(super) fn waves<'a>(
    rows: impl Iterator<Item = &'a (f64, Vec<f64>)>,
    last_s: f64,
    level: &[f64],
    hertz: f64,
) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; level.len()];
    let mut count = 0.0;
    for (at, values) in rows {
        let (sin, cos) = (TAU * hertz * (at - last_s)).sin_cos();
        for ((sum, value), level) in sums.iter_mut().zip(values).zip(level) {
            sum[0] += (value - level) * cos;
            sum[1] += (value - level) * sin;
        }
        count += 1.0;
    }
    (sums.into_iter().map(|s| s.map(|v| 2.0 * v / count))).collect()
}

/// By how much (rad) waves turn from some to others, over all channels.
pub(super) fn turned(from: &[[f64; 2]], to: &[[f64; 2]]) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for ([ac, a_s], [bc, b_s]) in from.iter().zip(to) {
        re += ac * bc + a_s * b_s;
        im += ac * b_s - a_s * bc;
    }
    im.atan2(re)
}

impl HumLine {
    /// One that has just been found.
    pub fn new(hertz: f64, phase: f64, waves: Vec<[f64; 2]>) -> Self {
        Self {
            hertz,
            found: hertz,
            phase,
            waves,
        }
    }

    /// The line near a frequency that fits samples best.
    pub fn fitted(rows: &HumSamples, level: &[f64], mut hertz: f64) -> Self {
        let (first, last) = (rows[0].0, rows[rows.len() - 1].0);
        let half = rows.len() / 2;
        for _ in 0..3 {
            let halves = [(0, half), (half, 2 * half)];
            let [a, b] = halves.map(|(from, to)| waves(rows.range(from..to), last, level, hertz));
            let turned = turned(&a, &b).clamp(-0.9 * PI, 0.9 * PI);
            hertz -= turned / TAU / (0.5 * (last - first));
        }
        Self::new(hertz, 0.0, waves(rows.iter(), last, level, hertz))
    }

    /// Goes a little way with what a sample is off the level (counts), beside what is usual; and where all channels turn alike,
    /// its frequency does: a loop of second order, critically damped (F. Gardner, Phaselock Techniques, 2005).
    pub fn follow(&mut self, seconds: f64, off: &[f64], usual: &[f64]) {
        let follows = (seconds / FOLLOWS_S).min(0.1);
        let (sin, cos) = self.phase.sin_cos();
        let (mut turned, mut size) = (0.0, 0.0);
        for (([a, b], off), usual) in self.waves.iter_mut().zip(off).zip(usual) {
            let most = UNUSUAL * usual;
            let by = 2.0 * follows * off.max(-most).min(most);
            turned += by * (*b * cos - *a * sin);
            // What hardly hums tells nothing of its frequency.
            size += *a * *a + *b * *b + usual * usual;
            (*a, *b) = (*a + by * cos, *b + by * sin);
        }
        if size > 0.0 {
            let hertz = self.hertz + turned / size / (4.0 * FOLLOWS_S) / TAU;
            self.hertz = hertz.clamp(self.found - STRAYS, self.found + STRAYS);
        }
    }

    /// Takes the line off samples of which its phase is that of the last one.
    pub fn take_from(&self, rows: &mut HumSamples) {
        let last = rows.back().map_or(0.0, |r| r.0);
        for (at, values) in rows {
            let (sin, cos) = (TAU * self.hertz * (*at - last)).sin_cos();
            for (value, [a, b]) in values.iter_mut().zip(&self.waves) {
                *value -= a * cos + b * sin;
            }
        }
    }
}
