//! What readings are held against: the rest, what hums, and how the rest wanders.

use super::drift::Drift;
use super::hum::Hum;
use super::jumps::Jump;
use super::tare::Rest;
use super::tremble::Tremble;
use super::update::PipelineSettings;
use crate::inference::{Matching, ReadingErrors, SeveralTouches};
use crate::uncertainty::rounding;

/// Seconds after which what no touch explains is the rest, that has moved.
const STRANGE_S: f64 = 5.0;
/// Under touches, so many samples a second say all that there is to know of the rest.
const ENOUGH_HZ: f64 = 1000.0;
/// Seconds over which noise is told.
const NOISE_S: f64 = 8.0;

/// The rest and all that is known of it.
pub(super) struct KnownRest {
    /// Of every channel, when it was taken; absent before the first tare.
    pub rest: Option<Rest>,
    hum: Hum,
    /// How that wanders; absent where it is taken to stay.
    drift: Option<Drift>,
    /// Noise of each channel by itself (strain).
    pub noise: Vec<f64>,
    tremble: Tremble,
    /// Seconds since a touch explained what is felt.
    strange_s: f64,
    /// Seconds since a sample under touches was looked at.
    passed_s: f64,
}

/// What a sample is of.
pub(super) enum Under<'a> {
    /// Nothing, or something that may be about to begin.
    Nothing { at_rest: bool },
    /// Touches.
    Touches(&'a SeveralTouches),
    /// Something that touches do not explain.
    Strange,
    /// A touch that goes, or one that is just looked for.
    Unsure,
}

impl KnownRest {
    /// Before a tare, with this noise of each channel (strain).
    pub fn new(noise: Vec<f64>) -> Self {
        Self {
            rest: None,
            hum: Hum::default(),
            drift: None,
            noise,
            tremble: Tremble::default(),
            strange_s: 0.0,
            passed_s: 0.0,
        }
    }

    /// Takes a rest, with what hummed while it was taken.
    pub fn take(&mut self, rest: Rest, hum: Hum, settings: &PipelineSettings, rate: f64) {
        self.rest = Some(rest);
        self.hum = hum;
        self.tremble.forget();
        self.know_noise(settings);
        self.begin_to_drift(settings, rate);
    }

    /// Forgets all but the rest as it is now.
    pub fn begin_anew(&mut self, settings: &PipelineSettings, rate: f64) {
        self.rest = self.now(settings);
        // What hums has to be found again, and is noise until then.
        if let Some(rest) = &mut self.rest {
            for (c, noise) in rest.noise.iter_mut().enumerate() {
                *noise = noise.hypot(self.hum.rms(c));
            }
        }
        self.hum.forget();
        self.tremble.forget();
        self.know_noise(settings);
        self.begin_to_drift(settings, rate);
    }

    /// The rest as it is now.
    fn now(&self, settings: &PipelineSettings) -> Option<Rest> {
        let mut rest = self.rest.clone()?;
        let per_strain = settings.chain.counts_per_strain();
        if let Some(drift) = &self.drift {
            for (level, by) in rest.level.iter_mut().zip(drift.rest()) {
                *level += by * per_strain;
            }
            rest.drift = drift.speeds().map(|speed| speed * per_strain).collect();
        }
        Some(rest)
    }

    /// Takes what hums off a sample that comes some seconds after the one before. Its strain since the tare, and since the
    /// rest as it is now.
    pub fn strain(
        &mut self,
        step_s: f64,
        counts: &mut [f64],
        settings: &PipelineSettings,
        at_rest: bool,
    ) -> Option<[Vec<f64>; 2]> {
        (self.hum).take_off(step_s, counts, at_rest && self.rest.is_some());
        let per_strain = settings.chain.counts_per_strain();
        let pairs = counts.iter().zip(&self.rest.as_ref()?.level);
        let raw: Vec<f64> = pairs.map(|(c, r)| (c - r) / per_strain).collect();
        let strain = match &mut self.drift {
            Some(drift) => {
                drift.pass(step_s);
                raw.iter().zip(drift.rest()).map(|(x, b)| x - b).collect()
            }
            None => raw.clone(),
        };
        Some([raw, strain])
    }

    /// A channel has jumped: its rest is there from now on.
    pub fn jumped(&mut self, jump: &Jump, settings: &PipelineSettings, used: &[bool]) {
        if let Some(rest) = &mut self.rest {
            rest.level[jump.channel] += jump.by * settings.chain.counts_per_strain();
        }
        if let Some(drift) = &mut self.drift {
            drift.jumped(jump.channel, jump.variance, &self.noise, used);
        }
        self.tremble.forget();
    }

    /// A touch has gone, and left this (strain since the rest): the rest may have moved as far under it.
    pub fn left_behind(&mut self, strain: &[f64], used: &[bool]) {
        if let Some(drift) = &mut self.drift {
            drift.left_behind(strain, &self.noise, used);
        }
    }

    /// Weighted squares of a reading without a touch, and these with caution: see [`Drift::squares`].
    pub fn squares(&mut self, strain: &[f64], used: &[bool]) -> [f64; 2] {
        if let Some(drift) = &mut self.drift {
            return drift.squares(strain, &self.noise, used);
        }
        let trusted = (strain.iter().zip(&self.noise).zip(used)).filter(|(_, used)| **used);
        [trusted.map(|((x, noise), _)| (x / noise).powi(2)).sum(); 2]
    }

    /// What a sample says of the rest: its strain since the tare and since the rest, some seconds after the one before.
    /// Whether more is known of the rest now.
    pub fn follow(
        &mut self,
        [raw, strain]: [&[f64]; 2],
        under: &Under<'_>,
        (step_s, settings): (f64, &PipelineSettings),
        matching: &Matching,
    ) -> bool {
        let strange = matches!(under, Under::Strange);
        self.strange_s = if strange {
            self.strange_s + step_s
        } else {
            0.0
        };
        self.passed_s += step_s;
        if matches!(under, Under::Touches(_)) {
            // Boards keep no time to the microsecond.
            if self.passed_s < 0.9 / ENOUGH_HZ {
                return false;
            }
            self.passed_s = 0.0;
        }
        let Some(mut drift) = self.drift.take() else {
            return false;
        };
        let used = &matching.used;
        if !matches!(under, Under::Nothing { at_rest: true }) && !strange {
            self.tremble.forget();
        }
        let more = match under {
            Under::Touches(touches) => {
                let reading = matching.reading_of_all(touches);
                let ways = || matching.leeway_of_all(touches);
                drift.touched(touches, [raw, &reading], &self.noise, used, ways)
            }
            Under::Nothing { at_rest } => {
                if *at_rest {
                    self.tremble(strain, step_s, settings, used);
                }
                drift.rested(raw, &self.noise, used)
            }
            Under::Strange if self.strange_s > STRANGE_S => {
                self.tremble(strain, step_s, settings, used);
                drift.rested(raw, &self.noise, used)
            }
            Under::Strange | Under::Unsure => {
                drift.interrupted(&self.noise, used);
                false
            }
        };
        self.drift = Some(drift);
        more
    }

    /// Takes what channels do at rest for their noise.
    fn tremble(&mut self, strain: &[f64], step_s: f64, settings: &PipelineSettings, used: &[bool]) {
        let Some(rest) = &mut self.rest else {
            return;
        };
        let per_strain = settings.chain.counts_per_strain();
        let counts: Vec<f64> = strain.iter().map(|x| x * per_strain).collect();
        let Some(off) = self.tremble.off(&counts, &rest.noise, step_s) else {
            return;
        };
        rest.tremble(&off, (step_s / NOISE_S).min(0.1), used);
        self.know_noise(settings);
    }

    /// How the rest walks is not known yet.
    fn begin_to_drift(&mut self, settings: &PipelineSettings, rate: f64) {
        let per_strain = settings.chain.counts_per_strain();
        let rest = self.rest.as_ref().zip(settings.drift_s);
        self.drift = rest.map(|(rest, follows_s)| {
            let drift: Vec<f64> = rest.drift.iter().map(|d| d / per_strain).collect();
            Drift::new(&self.noise, &drift, follows_s, rate)
        });
        self.strange_s = 0.0;
    }

    /// The noise of the rest, as strain.
    fn know_noise(&mut self, settings: &PipelineSettings) {
        let Some(rest) = &self.rest else {
            return;
        };
        let per_strain = settings.chain.counts_per_strain();
        for (noise, counts) in self.noise.iter_mut().zip(&rest.noise) {
            // What was measured has the rounding to counts in it, unless the channel stood still on one of them.
            *noise = (counts.max(rounding(1.0)) / per_strain).max(settings.least_noise);
        }
    }

    /// What an estimator has to put up with, where the project knows all channels to have drifted by so much together
    /// (strain).
    pub fn allow_for(&self, known_drift: f64, errors: &mut ReadingErrors) {
        let (own, common) = (self.drift.as_ref())
            .map_or_else(|| (vec![0.0; self.noise.len()], 0.0), Drift::variances);
        for ((error, noise), own) in errors.noise.iter_mut().zip(&self.noise).zip(own) {
            *error = (noise * noise + own).sqrt();
        }
        errors.drift = known_drift.hypot(common.sqrt());
    }
}
