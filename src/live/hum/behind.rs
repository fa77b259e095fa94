//! Hum that begins behind a touch, or is taken for one itself: there is no second of rest to look for it in.
//!
//! In a stretch of two periods a channel is a wave over a parabola, which is all that a hand does meanwhile. A touch comes or goes
//! in few stretches, and what hums does so in all of them, at one phase: the medians of their waves are held against their
//! scatter.

use std::f64::consts::{PI, TAU};

use super::line::{CLEAR, HumLine, HumSamples, turned};
use crate::statistics::{chi_squared_bound, median};

/// Periods of a stretch, the fewest samples that tell a wave from a parabola, and the fewest stretches.
const PERIODS: f64 = 2.0;
const SAMPLES: f64 = 8.0;
const STRETCHES: usize = 8;
/// So many samples a second are enough for the harmonics of mains.
const ENOUGH_HZ: f64 = 1000.0;
/// A grid is off by less (Hz), unless it falls apart.
const OFF: f64 = 0.2;
/// Of what the later half of the stretches has, in the earlier one: less where it is off in frequency by so much.
const MOST: f64 = 0.6;
/// Of normal numbers: the variance of a median over that of a mean, their deviation over the median of absolute values, and their
/// variance over the square of the mean of these.
const OF_MEDIAN: f64 = PI / 2.0;
const OF_ABSOLUTE: f64 = 1.4826;
const OF_NOISE: f64 = PI / 2.0;

/// The largest line near some frequencies (Hz) in samples at a rate (Hz), with its phase at the last one, if there is any that is
/// clear and larger than what is left of known lines; without lines samples are usually off by so much (counts, mean of the
/// absolute values).
pub(super) fn line_near(
    rows: &HumSamples,
    rate: f64,
    [near, known]: [&[f64]; 2],
    usual: &[f64],
) -> Option<HumLine> {
    let together = (rate / ENOUGH_HZ).floor().max(1.0) as usize;
    let (rows, rate) = (decimated(rows, together), rate / together as f64);
    let tried = near
        .iter()
        .flat_map(|hertz| [-OFF, 0.0, OFF].map(|off| hertz + off));
    let found = tried.filter_map(|hertz| Stretches::of(&rows, rate, hertz));
    // A large line shows at its harmonics too, but as a smaller one.
    let clear = found.filter(|stretches| stretches.is_clear(usual));
    let best = clear.max_by(|a, b| a.size().total_cmp(&b.size()))?;
    let left = (known.iter()).filter_map(|&hertz| Stretches::of(&rows, rate, hertz));
    if left
        .map(|stretches| stretches.size())
        .any(|left| left > best.size())
    {
        return None;
    }
    let nearer = Stretches::of(&rows, rate, best.hertz + best.faster_by())?;
    // Their last mean is of a while before the last sample.
    let since_s = 0.5 * (together - 1) as f64 / (rate * together as f64);
    let waves = nearer.medians(0..nearer.sure());
    let phase = TAU * nearer.hertz * since_s;
    Some(HumLine::new(nearer.hertz, phase, waves))
}

/// Means of so many samples each, the last of them whole: what is faster takes long to look through, and touches wait for it.
fn decimated(rows: &HumSamples, together: usize) -> HumSamples {
    let skipped = rows.len() % together;
    let means = (0..rows.len() / together).map(|k| {
        let first = skipped + k * together;
        let some = || rows.range(first..first + together);
        let count = together as f64;
        let channels = 0..rows[first].1.len();
        let mean = |c: usize| some().map(|row| row.1[c]).sum::<f64>() / count;
        let at = some().map(|row| row.0).sum::<f64>() / count;
        (at, channels.map(mean).collect())
    });
    means.collect()
}

/// The waves of one frequency in stretches of samples, one after the other.
struct Stretches {
    hertz: f64,
    /// Samples and seconds of each.
    samples: usize,
    lasts_s: f64,
    /// Of each stretch and channel, cosine and sine with phases from the last sample (counts).
    waves: Vec<Vec<[f64; 2]>>,
}

impl Stretches {
    /// Nothing where there are too few.
    fn of(rows: &HumSamples, rate: f64, hertz: f64) -> Option<Self> {
        let samples = (PERIODS * rate / hertz).max(SAMPLES).ceil() as usize;
        let last_s = rows.back()?.0;
        let mut waves = Vec::new();
        // From the last one back.
        for k in 1..=rows.len() / samples {
            let end = rows.len() - (k - 1) * samples;
            let stretch: Vec<&(f64, Vec<f64>)> = rows.range(end - samples..end).collect();
            waves.push(wave_of(&stretch, last_s, hertz)?);
        }
        (waves.len() >= STRETCHES).then_some(Self {
            hertz,
            samples,
            lasts_s: samples as f64 / rate,
            waves,
        })
    }

    fn channels(&self) -> usize {
        self.waves.first().map_or(0, Vec::len)
    }

    /// Of each channel, over some of the stretches.
    fn medians(&self, stretches: std::ops::Range<usize>) -> Vec<[f64; 2]> {
        let of = |c: usize, part: usize| {
            median(self.waves[stretches.clone()].iter().map(|w| w[c][part])).unwrap_or(0.0)
        };
        let all = 0..self.channels();
        all.map(|c| [of(c, 0), of(c, 1)]).collect()
    }

    /// Squares of all medians (counts²).
    fn size(&self) -> f64 {
        let medians = self.medians(0..self.waves.len());
        medians.iter().flatten().map(|part| part * part).sum()
    }

    /// Whether squares of the medians over their variances, χ² of two a channel, are more than of noise.
    fn is_clear(&self, usual: &[f64]) -> bool {
        let count = self.waves.len() as f64;
        let medians = self.medians(0..self.waves.len());
        let squares = medians.iter().enumerate().map(|(c, middle)| {
            let apart = |part: usize| {
                let off = self.waves.iter().map(|w| (w[c][part] - middle[part]).abs());
                (OF_ABSOLUTE * median(off).unwrap_or(0.0)).powi(2)
            };
            // A few stretches may happen to be alike, the more so where counts are coarse.
            let noise = usual.get(c).map_or(0.0, |usual| OF_NOISE * usual * usual);
            let least = 2.0 * noise / self.samples as f64;
            let variance = OF_MEDIAN * f64::midpoint(apart(0), apart(1)).max(least) / count;
            (middle[0].powi(2) + middle[1].powi(2)) / variance.max(f64::MIN_POSITIVE)
        });
        let free = 2.0 * medians.len() as f64;
        squares.sum::<f64>() > chi_squared_bound(free, CLEAR) && self.lasts()
    }

    /// How many stretches, from the last one back, are surely of what hums: half of them, where these are enough.
    fn sure(&self) -> usize {
        let half = self.waves.len() / 2;
        if half < STRETCHES {
            self.waves.len()
        } else {
            half
        }
    }

    /// Medians of the earlier half of so many stretches, and of the later one.
    fn halves(&self, stretches: usize) -> [Vec<[f64; 2]>; 2] {
        let half = stretches / 2;
        [half..2 * half, 0..half].map(|part| self.medians(part))
    }

    /// Whether the earlier half has most of what the later one has: where it has begun in between, medians are of this and that.
    fn lasts(&self) -> bool {
        let [earlier, later] = self.halves(self.waves.len());
        let dot = |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 {
            let parts = a.iter().flatten().zip(b.iter().flatten());
            parts.map(|(a, b)| a * b).sum()
        };
        dot(&earlier, &later) > MOST * dot(&later, &later)
    }

    /// By how much more (Hz) what hums turns from the earlier half of the sure stretches to the later one, over all channels.
    fn faster_by(&self) -> f64 {
        let [earlier, later] = self.halves(self.sure());
        let half_s = (self.sure() / 2) as f64 * self.lasts_s;
        -turned(&earlier, &later) / TAU / half_s
    }
}

/// Cosine and sine of every channel in a stretch of samples that is a wave over a parabola, by least squares.
fn wave_of(stretch: &[&(f64, Vec<f64>)], last_s: f64, hertz: f64) -> Option<Vec<[f64; 2]>> {
    let parabola = parabola_of(stretch)?;
    let [cosine, sine] = [0.0, PI / 2.0].map(|turned| {
        let angle = |row: &&(f64, Vec<f64>)| TAU * hertz * (row.0 - last_s) - turned;
        let mut wave: Vec<f64> = stretch.iter().map(|row| angle(row).cos()).collect();
        free_of(&mut wave, &parabola);
        wave
    });
    let [cc, cs, ss] = [
        dot(&cosine, &cosine),
        dot(&cosine, &sine),
        dot(&sine, &sine),
    ];
    let determinant = cc * ss - cs * cs;
    // A wave that is next to a parabola is none that can be told.
    if determinant.is_nan() || determinant < 0.1 * cc * ss {
        return None;
    }
    let read = |c: usize, by: &[f64]| -> f64 {
        let values = stretch.iter().map(|row| row.1[c]);
        values.zip(by).map(|(x, b)| x * b).sum()
    };
    let of = |c: usize| {
        let [x, y] = [read(c, &cosine), read(c, &sine)];
        [
            (ss * x - cs * y) / determinant,
            (cc * y - cs * x) / determinant,
        ]
    };
    let channels = stretch.first()?.1.len();
    Some((0..channels).map(of).collect())
}

/// Orthogonal directions of unit length of all parabolas over a stretch of samples.
fn parabola_of(stretch: &[&(f64, Vec<f64>)]) -> Option<Vec<Vec<f64>>> {
    let (first, last) = (stretch.first()?.0, stretch.last()?.0);
    let middle = f64::midpoint(first, last);
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for power in 0..3 {
        let since = stretch.iter().map(|row| (row.0 - middle) / (last - first));
        let mut own: Vec<f64> = since.map(|t| t.powi(power)).collect();
        free_of(&mut own, &directions);
        let length = dot(&own, &own).sqrt();
        for v in &mut own {
            *v /= length;
        }
        directions.push(own);
    }
    Some(directions)
}

/// Takes off what values have of some directions of unit length.
fn free_of(values: &mut [f64], directions: &[Vec<f64>]) {
    for direction in directions {
        let share = dot(values, direction);
        for (v, d) in values.iter_mut().zip(direction) {
            *v -= share * d;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
