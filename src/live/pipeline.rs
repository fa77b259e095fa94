//! From counts to a touch: rest, strain, health, and the estimators, one sample at a time.

use std::sync::Arc;

use glam::DVec3;

use super::health::{Expected, Health, Watcher};
use super::news::News;
use super::receiver::Sample;
use super::release::Release;
use super::tare::{Rest, Taring};
use super::update::{GaugeModel, Guess, Settings, Update};
use crate::inference::{Contact, Matching, Trained};
use crate::statistics::median;
use crate::uncertainty::rounding;
use crate::wire::Hello;

/// Samples in a row that make or end a touch.
const BEGINS: u32 = 3;
const ENDS: u32 = 6;
/// Samples between two searches everywhere, and seconds between two looks at who felt a touch.
const SEARCH_EVERY: u32 = 20;
const LOOK_S: f64 = 0.2;
/// A touch of which so much is left unexplained, over what it explains, is none.
const DOUBTFUL: f64 = 0.5;
/// What channels may move by during a tare (strain).
const SLACK: f64 = 1.5e-6;
/// A sample rate until it is known (Hz).
const RATE: f64 = 1000.0;

/// The state between samples.
pub struct Pipeline {
    /// Thresholds and constants.
    pub settings: Settings,
    matching: Matching,
    trained: [Option<Arc<Trained>>; 2],
    /// What the trained ones were trained with: with other channels they say nothing.
    trained_for: Vec<bool>,
    taring: Option<Taring>,
    /// Rest of every channel; absent before the first tare.
    pub rest: Option<Rest>,
    watchers: Vec<Watcher>,
    health: Vec<Health>,
    hello: Option<Hello>,
    last_time: Option<u64>,
    /// Samples a second, as measured.
    pub rate: f64,
    above: u32,
    below: u32,
    touching: bool,
    searched: u32,
    last: Option<Contact>,
    /// The reading of the last search everywhere, and what it found.
    search: Option<(Vec<f64>, Contact)>,
    last_look: u64,
    release: Release,
    news: Option<News>,
}

impl Pipeline {
    /// Not tared, by a model of the gauges.
    #[must_use]
    pub fn new(model: impl Into<GaugeModel>, settings: Settings) -> Self {
        let model: GaugeModel = model.into();
        let gauges = model.map.channels();
        let noise = vec![settings.least_noise.max(1e-9); gauges];
        Self {
            matching: model.matching(noise, &settings),
            settings,
            trained: [None, None],
            trained_for: Vec::new(),
            taring: None,
            rest: None,
            watchers: vec![Watcher::default(); gauges],
            health: vec![Health::Good; gauges],
            hello: None,
            last_time: None,
            rate: RATE,
            above: 0,
            below: 0,
            touching: false,
            searched: 0,
            last: None,
            search: None,
            last_look: 0,
            release: Release::default(),
            news: None,
        }
    }

    /// Another model of the same gauges, or other settings: after a calibration. What the board has said of
    /// itself stays.
    pub fn set_model(&mut self, model: impl Into<GaugeModel>, settings: Settings) {
        if settings.channels != self.settings.channels {
            // Other channels have another rest.
            (self.rest, self.taring) = (None, None);
        }
        let mut chain = settings.chain;
        if let Some(hello) = &self.hello {
            chain = chain.of_board(hello);
        }
        let noise = self.matching.errors.noise.clone();
        self.settings = Settings { chain, ..settings };
        let used = self.matching.used.clone();
        let model: GaugeModel = model.into();
        self.matching = model.matching(noise, &self.settings);
        self.matching.used = used;
        self.last = None;
    }

    /// The trained estimators (normalized, raw) and which gauges they were trained with.
    pub fn set_trained(&mut self, trained: [Option<Arc<Trained>>; 2], used: Vec<bool>) {
        (self.trained, self.trained_for) = (trained, used);
    }

    /// Forgets everything but the rest and which gauges were found dead, so that what follows depends on what
    /// follows alone: a recording that begins here says the same when it is replayed.
    pub fn begin_anew(&mut self) {
        let dead: Vec<usize> = self.dead().collect();
        self.watchers.fill(Watcher::default());
        self.health.fill(Health::Good);
        self.mark_dead(&dead);
        (self.last_time, self.last_look, self.rate) = (None, 0, RATE);
        self.end_touch();
    }

    /// Gauges that were found dead.
    pub fn dead(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.watchers.len()).filter(|&k| self.watchers[k].is_dead())
    }

    /// Takes gauges for dead until they are felt again.
    pub fn mark_dead(&mut self, gauges: &[usize]) {
        for &k in gauges {
            if let Some(watcher) = self.watchers.get_mut(k) {
                watcher.mark_dead();
            }
        }
    }

    /// What a board says of itself. Another board, or another gain, needs another tare.
    pub fn hello(&mut self, hello: &Hello) {
        let same = |h: &Hello| {
            Hello {
                rate_hz: 0,
                ..h.clone()
            } == Hello {
                rate_hz: 0,
                ..hello.clone()
            }
        };
        if !self.hello.as_ref().is_some_and(same) {
            // What was read before, of lines for instance, is none of it.
            (self.rest, self.taring) = (None, None);
        }
        self.settings.chain = self.settings.chain.of_board(hello);
        self.hello = Some(hello.clone());
        // What comes has nothing to do with what was.
        self.last_time = None;
        self.end_touch();
    }

    /// Takes what is read from now on for rest.
    pub fn tare(&mut self) {
        // What a drift may do in that time, and no touch that could be told.
        let slack = SLACK * self.settings.chain.counts_per_strain();
        self.taring = Some(Taring::over(self.settings.tare_s, slack));
        self.end_touch();
    }

    /// What has come to pass with the rest at the last sample.
    #[must_use]
    pub fn news(&self) -> Option<News> {
        self.news
    }

    /// Whether rest is being taken just now.
    #[must_use]
    pub fn is_taring(&self) -> bool {
        self.taring.is_some()
    }

    /// Of each gauge.
    #[must_use]
    pub fn health(&self) -> &[Health] {
        &self.health
    }

    /// Whether each gauge is trusted.
    #[must_use]
    pub fn used(&self) -> Vec<bool> {
        self.health.iter().map(|h| h.is_good()).collect()
    }

    /// Noise of each gauge (strain).
    #[must_use]
    pub fn noise(&self) -> &[f64] {
        &self.matching.errors.noise
    }

    fn end_touch(&mut self) {
        (self.above, self.below, self.touching) = (0, 0, false);
        (self.last, self.searched) = (None, 0);
        self.release.forget();
    }

    /// Takes a sample in and says what it means.
    pub fn push(&mut self, sample: &Sample) -> Update {
        self.news = None;
        let step_s = self.step(sample.time_us);
        let counts: Option<Vec<f64>> = (self.settings.channels.iter())
            .map(|&c| sample.counts.get(c).copied())
            .collect();
        let nothing = Update {
            time_us: sample.time_us,
            strain: None,
            contact: None,
            guesses: [None; 2],
            good: 0,
        };
        // A board with fewer channels than the project has gauges.
        let Some(counts) = counts else {
            return nothing;
        };
        self.watch(&counts);
        if let Some(taring) = &mut self.taring {
            let waited = taring.is_waiting();
            let rest = taring.push(sample.time_us, &counts);
            if taring.is_waiting() && !waited {
                self.news = Some(News::Waiting);
            }
            if let Some(rest) = rest {
                self.take_rest(rest);
            }
            return nothing;
        }
        let Some(rest) = &self.rest else {
            return nothing;
        };
        let per_strain = self.settings.chain.counts_per_strain();
        let strain: Vec<f64> = counts
            .iter()
            .zip(&rest.level)
            .map(|(c, r)| (c - r) / per_strain)
            .collect();
        for (used, health) in self.matching.used.iter_mut().zip(&self.health) {
            *used = health.is_good();
        }
        self.feel(&strain);
        let found = if self.touching {
            self.find(&strain)
        } else {
            None
        };
        self.last = found;
        if self.release.is_sure() {
            self.tare();
            self.news = Some(News::Released);
            return nothing;
        }
        // What no touch explains is a drift, and the rest follows it.
        let contact = found.filter(|c| c.unexplained < DOUBTFUL * c.strength);
        let guesses = if contact.is_some() {
            self.guess(&strain)
        } else {
            [None; 2]
        };
        if contact.is_some() {
            self.look(sample.time_us, &strain);
        } else if self.above == 0 || found.is_some() {
            self.follow_drift(&counts, step_s);
        }
        Update {
            time_us: sample.time_us,
            strain: Some(strain),
            contact,
            guesses,
            good: self.matching.used.iter().filter(|u| **u).count(),
        }
    }

    /// Seconds since the last sample; also keeps the rate.
    fn step(&mut self, time_us: u64) -> f64 {
        let step = self
            .last_time
            .map(|last| time_us.saturating_sub(last) as f64 * 1e-6);
        self.last_time = Some(time_us);
        match step {
            Some(step) if step > 0.0 && step < 1.0 => {
                // By the step, so that two samples that came together do not look like a fast board.
                let mean = self.rate.recip() + (step - self.rate.recip()) * 0.02;
                self.rate = mean.recip().clamp(1.0, 1e5);
                step
            }
            _ => 0.0,
        }
    }

    fn watch(&mut self, counts: &[f64]) {
        let noise = self.rest.as_ref().map(|r| &r.noise);
        let usual = noise.map_or(1.0, |n| median(n.iter().copied()).unwrap_or(0.0));
        let highest = f64::from(self.settings.chain.highest_count());
        let known = self.hello.is_some();
        for (k, (watcher, &count)) in self.watchers.iter_mut().zip(counts).enumerate() {
            let expected = Expected {
                // Of plain lines nobody knows the range.
                lowest: if known { 1.0 } else { f64::NEG_INFINITY },
                highest: if known { highest - 1.0 } else { f64::INFINITY },
                own_noise: noise.map_or(0.0, |n| n[k]),
                usual_noise: usual,
                rate: self.rate,
            };
            watcher.push(count, &expected);
            self.health[k] = watcher.health(&expected);
        }
    }

    /// Takes a rest that is known for what channels read untouched.
    pub fn set_rest(&mut self, rest: Rest) {
        self.take_rest(rest);
        self.end_touch();
    }

    fn take_rest(&mut self, rest: Rest) {
        self.rest = Some(rest);
        self.taring = None;
        self.take_noise();
    }

    /// Whether anything touches: weighted squares against χ² of the channels, with a few samples of patience.
    fn feel(&mut self, strain: &[f64]) {
        let used = strain
            .iter()
            .zip(&self.matching.errors.noise)
            .zip(&self.matching.used);
        let (mut squares, mut channels) = (0.0, 0.0_f64);
        for ((x, noise), _) in used.filter(|(_, u)| **u) {
            squares += (x / noise).powi(2);
            channels += 1.0;
        }
        let scatter = (2.0 * channels).sqrt();
        // Too few gauges to tell anything: place and force are three numbers.
        let begins = channels >= 3.0 && squares > channels + 8.0 * scatter;
        let ends = channels < 3.0 || squares < channels + 4.0 * scatter;
        self.above = if begins { self.above + 1 } else { 0 };
        self.below = if ends { self.below + 1 } else { 0 };
        if !self.touching && self.above >= BEGINS {
            (self.touching, self.searched) = (true, 0);
        } else if self.touching && (self.below >= ENDS || channels < 3.0) {
            self.end_touch();
        }
    }

    /// The touch; nothing where the reading is rather of something that lets go.
    fn find(&mut self, strain: &[f64]) -> Option<Contact> {
        let last = self
            .last
            .filter(|_| self.searched > 0 && self.searched < SEARCH_EVERY);
        let known = last.and_then(|last| {
            if last.narrow {
                self.matching.track(strain, &last)
            } else {
                let (reading, found) = self.search.as_ref()?;
                self.matching.hold(strain, reading, found)
            }
        });
        if let Some(contact) = known {
            self.searched += 1;
            return Some(contact);
        }
        self.searched = 1;
        let found = self.matching.find(strain);
        if self.release.is_seen(&mut self.matching, strain, &found) {
            return None;
        }
        self.search = Some((strain.to_vec(), found));
        Some(found)
    }

    fn guess(&self, strain: &[f64]) -> [Option<Guess>; 2] {
        if self.trained_for != self.matching.used {
            return [None; 2];
        }
        self.trained.each_ref().map(|trained| {
            trained.as_ref().map(|t| {
                let (place, force) = t.find(strain);
                Guess {
                    position: DVec3::from_array(place) * 1e-3,
                    force,
                }
            })
        })
    }

    /// Holds every gauge against what the others say of the touch.
    fn look(&mut self, time_us: u64, strain: &[f64]) {
        /// A reading of less than this share of what it should be is none; one that should be less than this
        /// share of the others' rms proves nothing, nor one that is near the noise.
        const NONE: f64 = 0.2;
        const CLEAR: f64 = 0.1;
        const ABOVE_NOISE: f64 = 15.0;
        /// Deviation of what a dead gauge reads, over its noise: its rest may have moved a little.
        const AT_REST: f64 = 4.0;
        if (time_us.saturating_sub(self.last_look) as f64) < LOOK_S * 1e6 {
            return;
        }
        self.last_look = time_us;
        let used = self.matching.used.clone();
        let count = used.iter().filter(|u| **u).count();
        if count < 5 {
            return;
        }
        let rms = (strain
            .iter()
            .zip(&used)
            .filter(|(_, u)| **u)
            .map(|(x, _)| x * x)
            .sum::<f64>()
            / count as f64)
            .sqrt();
        for k in 0..strain.len() {
            let trusted = matches!(self.health[k], Health::Good | Health::Dead);
            if !trusted || strain[k].abs() > 3.0 * rms {
                continue;
            }
            let suspicious =
                strain[k].abs() < ABOVE_NOISE * self.matching.errors.noise[k] + 0.1 * rms;
            // Only one that says nothing, or was found dead, is worth asking the others about.
            if !suspicious && used[k] {
                self.watchers[k].felt();
                continue;
            }
            self.matching.used[k] = false;
            let (others, without) = self.matching.find_with_evidence(strain);
            self.matching.used[k] = true;
            let (_, with) = self.matching.find_with_evidence(strain);
            self.matching.used.clone_from(&used);
            let (at, _) = self.matching.map.mesh.index().nearest(others.position);
            let should = self.matching.map.at(at)[k] * others.force;
            let noise = self.matching.errors.noise[k];
            if strain[k] / should > NONE {
                self.watchers[k].felt();
                continue;
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

    fn follow_drift(&mut self, counts: &[f64], step_s: f64) {
        /// Seconds over which noise is told.
        const NOISE_S: f64 = 8.0;
        let (Some(drift_s), Some(rest)) = (self.settings.drift_s, &mut self.rest) else {
            return;
        };
        let shares = [drift_s, NOISE_S].map(|s| (step_s / s).min(0.1));
        rest.follow(counts, shares, &self.matching.used);
        self.take_noise();
    }

    /// The noise of the rest, as strain.
    fn take_noise(&mut self) {
        let Some(rest) = &self.rest else {
            return;
        };
        let per_strain = self.settings.chain.counts_per_strain();
        for (noise, counts) in self.matching.errors.noise.iter_mut().zip(&rest.noise) {
            // What was measured has the rounding to counts in it, unless the channel stood still on one of them.
            *noise = (counts.max(rounding(1.0)) / per_strain).max(self.settings.least_noise);
        }
    }
}

/// Logarithm of the normal density of a value around zero.
fn log_normal(value: f64, deviation: f64) -> f64 {
    -0.5 * ((value / deviation).powi(2) + (std::f64::consts::TAU * deviation * deviation).ln())
}
