//! Whether every gauge does what it should: by itself, and as the others say of a touch.

use super::health::{ExpectedSignal, Health, Watcher};
use super::left_out::LeftOut;
use super::news::LiveNews;
use super::tare::Rest;
use crate::inference::Matching;
use crate::statistics::median;
use crate::units;

/// Seconds between two looks at who felt a touch.
const LOOK_S: f64 = 0.2;
/// With fewer gauges nothing is said of one of them.
const FEWEST: usize = 5;
/// Seconds of a touch before it is looked at: what it leaves on a gauge in the mean shows far better than in one sample.
const STAYS_S: f64 = 0.05;
/// A gauge whose mean under a touch is so many deviations off its rest, and this share of the others' rms, which may come
/// over from them, feels something.
const FELT: f64 = 6.0;
const COMES_OVER: f64 = 0.02;
/// A reading of less than this share of what it should be is none; one that should be less than this share of the others'
/// rms proves nothing, nor one that is near the noise.
const NONE: f64 = 0.2;
const CLEAR: f64 = 0.1;
const ABOVE_NOISE: f64 = 15.0;
/// A channel whose mean is so many deviations of its noise from an end of the range is cut off there now and then, and reads too
/// little; no more than a share of the range, where the noise is large.
const NEAR_END: f64 = 3.0;
const NEAR_END_MOST: f64 = 0.02;
/// Deviation of what a dead gauge reads, over its noise: its rest may have moved a little.
const AT_REST: f64 = 4.0;

/// Watches every gauge.
pub(super) struct Checking {
    watchers: Vec<Watcher>,
    pub health: Vec<Health>,
    last_look: u64,
    since: TouchMean,
    left_out: LeftOut,
    /// Noise of most channels (counts), asked for anew after so many samples.
    usual: Option<f64>,
    until: u32,
}

/// What gauges have read since the last look, while something touches.
#[derive(Default)]
struct TouchMean {
    begun_us: Option<u64>,
    sum: Vec<f64>,
    samples: f64,
}

impl TouchMean {
    fn take(&mut self, time_us: u64, strain: &[f64]) {
        if self.begun_us.is_none() {
            (self.begun_us, self.sum) = (Some(time_us), vec![0.0; strain.len()]);
            self.samples = 0.0;
        }
        for (sum, x) in self.sum.iter_mut().zip(strain) {
            *sum += x;
        }
        self.samples += 1.0;
    }

    /// Whether a gauge's mean, of which the rms of all is `rms` (strain), is off its rest, known as well as that: its noise
    /// in every sample and what the rest may be off by in all of them (strain).
    fn is_felt(&self, gauge: usize, rms: f64, [noise, rest]: [f64; 2]) -> bool {
        let deviation = (noise / self.samples.sqrt()).hypot(rest);
        (self.sum[gauge] / self.samples).abs() > FELT * deviation + COMES_OVER * rms
    }
}

/// Samples in which nobody's noise changes by much.
const SOME: u32 = 64;

impl Checking {
    /// All gauges are good until they show otherwise.
    pub fn new(gauges: usize) -> Self {
        Self {
            watchers: vec![Watcher::default(); gauges],
            health: vec![Health::Good; gauges],
            last_look: 0,
            since: TouchMean::default(),
            left_out: LeftOut::default(),
            usual: None,
            until: 0,
        }
    }

    /// Forgets all but which gauges were found dead, and what has been told.
    pub fn begin_anew(&mut self) {
        let dead: Vec<usize> = self.dead().collect();
        *self = Self {
            left_out: std::mem::take(&mut self.left_out),
            ..Self::new(self.health.len())
        };
        for k in dead {
            self.mark_dead(k);
        }
    }

    /// Gauges that were found dead.
    pub fn dead(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.watchers.len()).filter(|&k| self.watchers[k].is_dead())
    }

    /// Takes a gauge for dead until it is felt again.
    pub fn mark_dead(&mut self, gauge: usize) {
        if let Some(watcher) = self.watchers.get_mut(gauge) {
            watcher.mark_dead();
        }
    }

    /// Whether each gauge is trusted.
    pub fn used(&self) -> Vec<bool> {
        self.health.iter().map(|h| h.is_good()).collect()
    }

    /// Counts of a sample as they came and, where that is known, without what hums, at a rate (Hz), with the highest that
    /// the board can send where it has said so.
    pub fn watch(
        &mut self,
        (counts, steady): (&[f64], Option<&[f64]>),
        rest: Option<&Rest>,
        rate: f64,
        highest: Option<f64>,
    ) {
        let noise = rest.map(|r| &r.noise);
        self.until = self.until.saturating_sub(1);
        if self.until == 0 || self.usual.is_none() || noise.is_none() {
            self.usual = noise.map(|n| median(n.iter().copied()).unwrap_or(0.0));
            self.until = SOME;
        }
        // Before there is a rest, nobody knows what is noisy.
        let usual = self.usual.unwrap_or(f64::INFINITY);
        for (k, (watcher, &count)) in self.watchers.iter_mut().zip(counts).enumerate() {
            let own_noise = noise.map_or(0.0, |n| n[k]);
            let [lowest, highest] = whole_range(highest, own_noise);
            let expected = ExpectedSignal {
                lowest,
                highest,
                own_noise,
                usual_noise: usual,
                rate,
            };
            let hum = steady.map(|steady| count - steady[k]);
            watcher.push(count, hum, &expected);
            self.health[k] = watcher.health(&expected);
        }
    }

    /// What there is to say of gauges, some seconds after the last sample.
    pub fn news(&mut self, step_s: f64) -> impl Iterator<Item = LiveNews> + '_ {
        self.left_out.news(&self.health, step_s)
    }

    /// The touch is over.
    pub fn end_touch(&mut self) {
        self.since = TouchMean::default();
    }

    /// Holds every gauge against what the others say of the one touch that there is; `noise` (strain) is that of a single
    /// sample of each.
    pub fn look(
        &mut self,
        matching: &mut Matching,
        time_us: u64,
        (strain, noise): (&[f64], &[f64]),
    ) {
        let used = matching.used.clone();
        let count = used.iter().filter(|u| **u).count();
        self.since.take(time_us, strain);
        let since = |at: u64| units::seconds_between(at, time_us);
        let stays = self.since.begun_us.is_some_and(|at| since(at) >= STAYS_S);
        if since(self.last_look) < LOOK_S || !stays || count < FEWEST {
            return;
        }
        self.last_look = time_us;
        let mean = std::mem::take(&mut self.since);
        let trusted = strain.iter().zip(&used).filter(|(_, u)| **u);
        let rms = (trusted.map(|(x, _)| x * x).sum::<f64>() / count as f64).sqrt();
        for k in 0..strain.len() {
            let trusted = matches!(self.health[k], Health::Good | Health::Dead);
            if !trusted || strain[k].abs() > 3.0 * rms {
                continue;
            }
            let all = matching.errors.noise[k];
            let own = (all * all - noise[k] * noise[k]).max(0.0).sqrt();
            let rest = own.hypot(matching.errors.drift);
            // Only one that says nothing, or was found dead, is worth asking the others about.
            if used[k] && mean.is_felt(k, rms, [noise[k], rest]) {
                self.watchers[k].felt();
                continue;
            }
            self.ask_the_others(k, matching, strain, rms);
        }
    }

    fn ask_the_others(&mut self, k: usize, matching: &mut Matching, strain: &[f64], rms: f64) {
        let was_used = matching.used[k];
        matching.used[k] = false;
        let (others, without) = matching.find_with_evidence(strain);
        let count = matching.used.iter().filter(|u| **u).count() + 1;
        matching.used[k] = true;
        let (_, with) = matching.find_with_evidence(strain);
        matching.used[k] = was_used;
        let (at, _) = matching.map.mesh.index().nearest(others.position);
        let should = matching.map.at(at)[k] * others.force;
        let noise = matching.errors.noise[k];
        if strain[k] / should > NONE {
            self.watchers[k].felt();
            return;
        }
        let clear = should.abs() > ABOVE_NOISE * noise && should.abs() > CLEAR * rms;
        // Some touch may well leave it alone: only where none explains its silence is it ill.
        let explained = others.unexplained < 2.0 * count as f64 + 10.0;
        if clear && explained {
            let dead = without + log_normal(strain[k], AT_REST * noise);
            self.watchers[k].silent(dead - with);
        }
    }
}

/// Counts between which a channel of some noise is never cut off, of a range up to the highest.
fn whole_range(highest: Option<f64>, noise: f64) -> [f64; 2] {
    // Of plain lines nobody knows the range.
    highest.map_or([f64::NEG_INFINITY, f64::INFINITY], |highest| {
        let near = 1.0 + (NEAR_END * noise).min(NEAR_END_MOST * highest);
        [near, highest - near]
    })
}

/// Logarithm of the normal density of a value around zero.
fn log_normal(value: f64, deviation: f64) -> f64 {
    -0.5 * ((value / deviation).powi(2) + (std::f64::consts::TAU * deviation * deviation).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel that reads evenly around some counts: whether it is left out.
    fn is_off_scale(around: f64, highest: Option<f64>) -> bool {
        let rest = Rest {
            level: vec![2000.0],
            noise: vec![5.0],
            drift: Vec::new(),
        };
        let mut checking = Checking::new(1);
        for k in 0..100 {
            let count = around + f64::from(k % 3) - 1.0;
            checking.watch((&[count], Some(&[count])), Some(&rest), 1000.0, highest);
        }
        checking.health[0] == Health::OffScale
    }

    #[test]
    fn a_channel_is_left_out_before_its_noise_is_cut_off() {
        for (around, is_out) in [(4085.0, true), (4070.0, false), (10.0, true), (25.0, false)] {
            assert_eq!(is_off_scale(around, Some(4095.0)), is_out, "{around}");
        }
        assert!(!is_off_scale(4085.0, None));
        // Of one that trembles much most of the range stays.
        assert_eq!(whole_range(Some(4095.0), 500.0)[0], 1.0 + 0.02 * 4095.0);
    }
}
