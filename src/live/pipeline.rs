//! From counts to touches: rest, strain, health, and the estimators, one sample at a time.

use std::sync::Arc;

use super::blind::Blind;
use super::checking::Checking;
use super::counting::Counting;
use super::departure::Departure;
use super::feeling::{Feeling, Turn};
use super::ground::{KnownRest, Under};
use super::health::Health;
use super::hum::Hum;
use super::jumps::Jumps;
use super::news::LiveNews;
use super::receiver::Sample;
use super::release::Release;
use super::tare::{Rest, Taring};
use super::trained::Trained;
use super::update::{GaugeModel, LiveUpdate, PipelineSettings};
use crate::inference::{Contact, Matching, SeveralTouches, TrainedLive};
use crate::learning::TouchEstimator;
use crate::units;
use crate::wire::Hello;

mod finding;
#[cfg(test)]
mod tests;

/// Samples, and seconds, between two searches everywhere: whichever is more.
const SEARCH_EVERY: u32 = 20;
const SEARCH_EVERY_S: f64 = 0.02;
/// A touch of which so much is left unexplained, over what it explains, is none.
const DOUBTFUL: f64 = 0.5;
/// What channels may move by during a tare (strain).
const SLACK: f64 = 1.5e-6;
/// A sample rate until it is known (Hz).
const RATE: f64 = 1000.0;
/// Between two samples of the slowest board, with room (s): after a longer break nothing is known of what passed.
const LONGEST_STEP_S: f64 = 1.5;

/// The state between samples.
pub struct Pipeline {
    /// Thresholds and constants.
    pub settings: PipelineSettings,
    matching: Matching,
    trained: Trained,
    taring: Option<Taring>,
    ground: KnownRest,
    /// What the project knows all to have drifted by together (strain).
    known_drift: f64,
    checking: Checking,
    jumps: Jumps,
    hello: Option<Hello>,
    last_time: Option<u64>,
    /// Samples a second, as measured.
    pub rate: f64,
    feeling: Feeling,
    counting: Counting,
    searched: u32,
    last: Option<Contact>,
    /// The reading of the last search everywhere, and what it found.
    search: Option<(Vec<f64>, Contact)>,
    release: Release,
    departure: Departure,
    /// Whether a touch has come and gone since the tare, and left the rest where it was.
    proved: bool,
    news: Vec<LiveNews>,
    blind: Blind,
}

impl Pipeline {
    /// Not tared, by a model of the gauges.
    #[must_use]
    pub fn new(model: impl Into<GaugeModel>, settings: PipelineSettings) -> Self {
        let model: GaugeModel = model.into();
        let gauges = model.map.channels();
        let noise = vec![settings.least_noise.max(1e-9); gauges];
        let known_drift = model.off.drift;
        let matching = model.matching(noise.clone(), &settings);
        Self {
            known_drift,
            counting: Counting::new(&matching),
            matching,
            ground: KnownRest::new(noise),
            settings,
            trained: Trained::default(),
            taring: None,
            checking: Checking::new(gauges),
            jumps: Jumps::default(),
            hello: None,
            last_time: None,
            rate: RATE,
            feeling: Feeling::default(),
            searched: 0,
            last: None,
            search: None,
            release: Release::default(),
            departure: Departure::default(),
            proved: false,
            news: Vec::new(),
            blind: Blind::default(),
        }
    }

    /// Another model of the same gauges, or other settings: after a calibration. What the board has said of
    /// itself stays.
    pub fn set_model(&mut self, model: impl Into<GaugeModel>, settings: PipelineSettings) {
        if settings.channels != self.settings.channels {
            // Other channels have another rest.
            (self.ground.rest, self.taring) = (None, None);
            self.counting.begin_anew();
        }
        let mut chain = settings.chain;
        if let Some(hello) = &self.hello {
            chain = chain.of_board(hello);
        }
        self.settings = PipelineSettings { chain, ..settings };
        let used = self.matching.used.clone();
        let model: GaugeModel = model.into();
        self.known_drift = model.off.drift;
        self.matching = model.matching(self.ground.noise.clone(), &self.settings);
        self.matching.used = used;
        self.counting = Counting::new(&self.matching);
        self.blind.forget();
        self.allow_for_drift();
        self.last = None;
    }

    /// What the estimator has to put up with.
    fn allow_for_drift(&mut self) {
        (self.ground).allow_for(self.known_drift, &mut self.matching.errors);
    }

    /// The trained estimators (normalized, raw) and which gauges they were trained with.
    pub fn set_trained(&mut self, trained: [Option<Arc<TrainedLive>>; 2], used: Vec<bool>) {
        (self.trained.model, self.trained.channels) = (trained, used);
    }

    /// An estimator that was learned from presses alone, or none.
    pub fn set_learned(&mut self, learned: Option<Arc<TouchEstimator>>) {
        self.trained.presses = learned;
    }

    /// Forgets everything but the rest and which gauges were found dead, so that what follows depends on what
    /// follows alone: a recording that begins here says the same when it is replayed.
    pub fn begin_anew(&mut self) {
        self.checking.begin_anew();
        (self.last_time, self.rate) = (None, RATE);
        self.blind.forget();
        self.ground.begin_anew(&self.settings, self.rate);
        self.allow_for_drift();
        self.end_touch();
        self.counting.begin_anew();
    }

    /// Gauges that were found dead.
    pub fn dead(&self) -> impl Iterator<Item = usize> + '_ {
        self.checking.dead()
    }

    /// Takes gauges for dead until they are felt again.
    pub fn mark_dead(&mut self, gauges: &[usize]) {
        for &k in gauges {
            self.checking.mark_dead(k);
        }
    }

    /// Rest of every channel; absent before the first tare.
    #[must_use]
    pub fn rest(&self) -> Option<&Rest> {
        self.ground.rest.as_ref()
    }

    /// Takes a rest that is known for what channels read untouched.
    pub fn set_rest(&mut self, rest: Rest) {
        self.take_rest(rest, Hum::default());
        self.end_touch();
    }

    fn take_rest(&mut self, rest: Rest, hum: Hum) {
        self.ground.take(rest, hum, &self.settings, self.rate);
        (self.taring, self.proved) = (None, false);
        self.jumps = Jumps::default();
        self.blind.forget();
        self.allow_for_drift();
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
            (self.ground.rest, self.taring) = (None, None);
            self.counting.begin_anew();
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

    /// What has come to pass with the rest and the gauges at the last sample.
    #[must_use]
    pub fn news(&self) -> &[LiveNews] {
        &self.news
    }

    /// Whether rest is being taken just now.
    #[must_use]
    pub fn is_taring(&self) -> bool {
        self.taring.is_some()
    }

    /// Of each gauge.
    #[must_use]
    pub fn health(&self) -> &[Health] {
        &self.checking.health
    }

    /// Whether each gauge is trusted.
    #[must_use]
    pub fn used(&self) -> Vec<bool> {
        self.checking.used()
    }

    /// Noise of each gauge (strain).
    #[must_use]
    pub fn noise(&self) -> &[f64] {
        &self.ground.noise
    }

    fn end_touch(&mut self) {
        self.feeling.end();
        self.counting.end();
        self.checking.end_touch();
        (self.last, self.searched) = (None, 0);
        self.release.forget();
        self.departure = Departure::default();
    }

    /// Takes a sample in and says what it means.
    pub fn push(&mut self, sample: &Sample) -> LiveUpdate {
        self.news.clear();
        let step_s = self.step(sample.time_us);
        let counts: Option<Vec<f64>> = (self.settings.channels.iter())
            .map(|&c| sample.counts.get(c).copied())
            .collect();
        let nothing = LiveUpdate::nothing(sample.time_us);
        // A board with fewer channels than the project has gauges.
        let Some(mut counts) = counts else {
            return nothing;
        };
        if self.taring.is_some() {
            self.watch(&counts, None);
            self.go_on_taring(sample.time_us, &counts);
            return nothing;
        }
        let at_rest = self.feeling.at_rest();
        let came = counts.clone();
        let strains = (self.ground).strain(step_s, &mut counts, &self.settings, at_rest);
        self.watch(&came, Some(&counts));
        let Some([mut raw, mut strain]) = strains else {
            return nothing;
        };
        self.matching.used = self.checking.used();
        let blind = self.blind.look(&self.matching, &self.ground.noise);
        let news = self.blind.news(blind, step_s);
        self.news.extend(news.map(LiveNews::Blind));
        self.news.extend(self.checking.news(step_s));
        self.take_jumps_off(step_s, &mut raw, &mut strain);
        self.feel(&strain);
        let (touches, explained) = if self.feeling.touching {
            self.find(sample.time_us, &strain)
        } else {
            (None, false)
        };
        let is_found = touches.as_ref().is_some_and(|t| !t.contacts.is_empty());
        // What is hardly felt is not strange because nothing was found in it.
        let passed_s = if self.feeling.clearly() { step_s } else { 0.0 };
        self.feeling.found(is_found, passed_s);
        if let (Some(touches), true) = (&touches, explained) {
            self.tell_least_of_several(touches);
        }
        let now = (is_found, step_s);
        let stands = self.feeling.touching
            && (self.release).stands(&mut self.matching, &strain, now, self.proved);
        if stands || self.release.is_sure(self.proved) {
            self.tare();
            self.news.push(LiveNews::Released);
            return nothing;
        }
        let contact = (touches.as_ref()).and_then(|t| t.contacts.first().copied());
        let one = contact.filter(|_| touches.as_ref().is_some_and(|t| t.contacts.len() == 1));
        let now = (one.map(|c| c.force), step_s);
        if !self.feeling.touching {
            self.departure.rest(&strain, step_s);
        } else if (self.departure).is_over(&mut self.matching, &strain, now) {
            self.leave(&strain);
            return LiveUpdate {
                strain: Some(strain),
                good: self.matching.used.iter().filter(|u| **u).count(),
                blind: Some(blind),
                ..nothing
            };
        }
        let guess = |_| self.trained.guess(&strain, &self.matching.used);
        let guesses = contact.map_or([None; 3], guess);
        if self.last.is_some() && contact.is_some() {
            let read = (&strain[..], &self.ground.noise[..]);
            (self.checking).look(&mut self.matching, sample.time_us, read);
        } else {
            // What gauges read of several touches says nothing of one.
            self.checking.end_touch();
        }
        self.follow(
            [&raw, &strain],
            touches.as_ref().map(|t| (t, explained)),
            step_s,
        );
        LiveUpdate {
            strain: Some(strain),
            contact,
            touches,
            guesses,
            good: self.matching.used.iter().filter(|u| **u).count(),
            blind: Some(blind),
            ..nothing
        }
    }

    /// Looks at every channel of a sample, as it came and without what hums.
    fn watch(&mut self, counts: &[f64], steady: Option<&[f64]>) {
        let known = self.hello.is_some();
        let highest = known.then(|| f64::from(self.settings.chain.highest_count()));
        let rest = self.ground.rest.as_ref();
        (self.checking).watch((counts, steady), rest, self.rate, highest);
    }

    /// Where several touches explain a sample, any of them may be what stays.
    fn tell_least_of_several(&mut self, touches: &SeveralTouches) {
        let each = self.matching.readings_of(touches).into_iter();
        let used = &self.matching.used;
        let squares = each.map(|reading| self.ground.squares(&reading, used)[0]);
        let several = touches.contacts.len() > 1;
        let least = several.then(|| squares.fold(f64::INFINITY, f64::min));
        self.feeling.several(least);
    }

    /// Takes off a sample (strain since the tare, and since the rest) what a gauge has jumped by.
    fn take_jumps_off(&mut self, step_s: f64, raw: &mut [f64], strain: &mut [f64]) {
        let (matching, noise) = (&self.matching, &self.ground.noise);
        let now = (self.feeling.touching, step_s);
        let Some(jump) = self.jumps.take_off(matching, raw, noise, now) else {
            return;
        };
        strain[jump.channel] -= jump.by;
        (self.ground).jumped(&jump, &self.settings, &self.matching.used);
        self.news.extend(jump.news());
    }

    fn go_on_taring(&mut self, time_us: u64, counts: &[f64]) {
        let Some(taring) = &mut self.taring else {
            return;
        };
        let rest = taring.push(time_us, counts);
        self.news.extend(taring.news());
        if let Some(rest) = rest {
            let hum = std::mem::take(&mut taring.hum);
            self.take_rest(rest, hum);
        }
    }

    /// Whether anything touches.
    fn feel(&mut self, strain: &[f64]) {
        let used = &self.matching.used;
        let squares = self.ground.squares(strain, used);
        let channels = used.iter().filter(|u| **u).count();
        let stays = self.departure.stays(&self.matching, strain);
        match self.feeling.take(squares, channels, stays) {
            Turn::Same => {}
            Turn::Begins => self.searched = 0,
            Turn::Ends => {
                self.proved |= self.last.is_some() || self.counting.shown().is_some();
                self.end_touch();
            }
        }
    }

    /// A touch has gone, and all that it leaves (strain) is the rest.
    fn leave(&mut self, strain: &[f64]) {
        self.ground.left_behind(strain, &self.matching.used);
        self.proved = true;
        self.end_touch();
    }

    /// What the sample says of the rest, where it is of touches that explain it or of none.
    fn follow(&mut self, strains: [&[f64]; 2], seen: Option<(&SeveralTouches, bool)>, step_s: f64) {
        let touching = self.feeling.touching;
        let (touches, explained) = seen.unzip();
        let under = match touches {
            // What is hardly felt any more is neither.
            Some(touches) if explained == Some(true) && self.feeling.clearly() => {
                Under::Touches(touches)
            }
            Some(touches) if !touches.contacts.is_empty() => Under::Unsure,
            // Whatever it is, it is no rest that has moved.
            _ if touching && self.departure.stays(&self.matching, strains[1]) => Under::Unsure,
            _ if touching => Under::Strange,
            _ => Under::Nothing {
                at_rest: self.feeling.at_rest(),
            },
        };
        let timed = (step_s, &self.settings);
        let more = (self.ground).follow(strains, &under, timed, &self.matching);
        // Under a touch, what goes on is what that hides: no channel tells more of it than the others.
        if more && !touching {
            self.allow_for_drift();
        }
    }

    /// Seconds since the last sample; also keeps the rate.
    fn step(&mut self, time_us: u64) -> f64 {
        let step = self
            .last_time
            .map(|last| units::seconds_between(last, time_us));
        self.last_time = Some(time_us);
        match step {
            Some(step) if step > 0.0 && step < LONGEST_STEP_S => {
                // By the step, so that two samples that came together do not look like a fast board.
                let mean = self.rate.recip() + (step - self.rate.recip()) * 0.02;
                self.rate = mean.recip().clamp(1.0, 1e5);
                step
            }
            _ => 0.0,
        }
    }
}
