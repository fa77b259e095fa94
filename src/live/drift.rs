//! How the rest of the channels wanders, also while something touches: a Kalman filter over time (R. E. Kalman, J. Basic
//! Eng. 82, 1960).
//!
//! The rest b of all channels walks ([`walk`]): each for itself, by glue and amplifier, all together at a speed, by
//! temperature, and of what is loaded a share, by creep.
//!
//! Untouched, b is what is read. Under a touch, x = b + r̂ + J θ + n with r̂ its reading and J the ways in which it may be
//! another touch: with so wide a spread of θ as makes them free, S = P + R + J Jᵀ, and the rest follows only what no
//! touch would explain. So a touch may stand as long as it likes while all channels drift.

mod creep;
mod misfit;
mod steps;
#[cfg(test)]
mod tests;
mod walk;

use std::collections::VecDeque;

use nalgebra::DMatrix;

use super::feeling::BEGINS;
use crate::inference::SeveralTouches;

use self::creep::Creep;
use self::misfit::{EstimatedTouch, Misfit};
use self::walk::RestWalk;

/// Seconds that samples are gathered for before the rest is corrected by their mean.
const BLOCK_S: f64 = 0.01;
/// Seconds that rest has to last before it is believed: the beginning of a slow touch is none.
const BELIEVED_S: f64 = 0.2;
/// The same of the first rest after a load: until then nobody knows what that hid, and another touch would go unfelt.
const SOON_S: f64 = 0.06;
/// Samples that have to follow rest before it is believed, however long they take: as many as a touch has before it is felt.
const FOLLOWED_BY: f64 = BEGINS as f64;
/// As long before a touch nothing of it is felt yet: what a rest that was too short to be believed says.
const BEFORE_S: f64 = 0.05;
/// Standard deviations, and strain, by which rest may be off from what follows it: beyond them a touch goes or comes.
const STEADY: f64 = 5.0;
const STEADY_BY: f64 = 1.5e-6;
/// Standard deviations by which noise alone makes it differ.
const USUAL: f64 = 2.0;

/// By how much a channel may bend because it creeps (strain), where it is asked how far it walks.
const CREEPS: f64 = 0.1e-6;

/// Under a touch, standard deviations of χ² beyond which what is left is of another touch than was found, and not of a
/// rest that has moved: that goes slowly.
const SUDDEN: f64 = 8.0;

/// Weighted squares by which it has to be likelier that a touch moves than that it stands: its estimate goes a little way with
/// the noise, and seems so.
const MOVES: f64 = 10.0;

/// Of the variance that a touch leaves of the rest: what it hid is not to be taken for another touch.
const CAUTION: f64 = 16.0;

/// Samples at rest whose mean is to be believed.
struct RestBlock {
    ends_s: f64,
    mean: Vec<f64>,
    samples: f64,
}

/// What is known of the rest since a tare (strain), as of a little while ago, and what that says of now.
pub(super) struct Drift {
    walk: RestWalk,
    creep: Creep,
    misfit: Misfit,
    /// Seconds since the tare, and as of when the walk is.
    now_s: f64,
    as_of_s: f64,
    /// Samples that are being gathered since a time, and blocks that are not believed yet.
    gathered: Vec<f64>,
    samples: f64,
    since_s: f64,
    waiting: VecDeque<RestBlock>,
    /// Whether the last samples were of a touch, and whether any at rest were believed since the last one.
    under_touch: bool,
    believed: bool,
    /// P of b as of now, and (P + R)⁻¹ of the channels that were used, row by row; zeros for the others. Then the same with
    /// caution.
    ahead: DMatrix<f64>,
    weights: [Vec<f64>; 2],
    weighed_for: Vec<bool>,
}

impl Drift {
    /// After a tare with this noise of each channel (strain) and, where it showed, its drift (strain a second), where the
    /// rest of a channel follows it within `follows_s` seconds at a rate (Hz).
    pub fn new(noise: &[f64], drift: &[f64], follows_s: f64, rate: f64) -> Self {
        let channels = noise.len();
        let walk = RestWalk::new(noise, drift, follows_s, rate);
        Self {
            ahead: walk.rest_covariance(0.0, false),
            walk,
            creep: Creep::new(channels),
            misfit: Misfit::default(),
            now_s: 0.0,
            as_of_s: 0.0,
            gathered: vec![0.0; channels],
            samples: 0.0,
            since_s: 0.0,
            waiting: VecDeque::new(),
            under_touch: false,
            believed: false,
            weights: [Vec::new(), Vec::new()],
            weighed_for: Vec::new(),
        }
    }

    /// Some seconds go by.
    pub fn pass(&mut self, seconds: f64) {
        self.now_s += seconds;
    }

    /// The rest of every channel now (strain since the tare).
    pub fn rest(&self) -> impl Iterator<Item = f64> + '_ {
        self.walk.rest(self.now_s - self.as_of_s)
    }

    /// What every channel drifts by just now (strain a second).
    pub fn speeds(&self) -> impl Iterator<Item = f64> + '_ {
        self.walk.speeds()
    }

    /// Weighted squares of a reading without a touch, over the channels that are used: as χ². Then the same with caution: as
    /// far as a touch may have hidden more of the rest than is thought.
    pub fn squares(&mut self, strain: &[f64], noise: &[f64], used: &[bool]) -> [f64; 2] {
        if self.weighed_for != used {
            self.weigh(noise, used);
        }
        self.weights.each_ref().map(|weights| {
            let rows = weights.chunks_exact(strain.len().max(1));
            let row = |row: &[f64]| row.iter().zip(strain).map(|(w, x)| w * x).sum::<f64>();
            rows.zip(strain).map(|(w, x)| x * row(w)).sum()
        })
    }

    /// Variance of each channel for itself and of all together (strain²): P ≈ diag(own) + common.
    pub fn variances(&self) -> (Vec<f64>, f64) {
        let n = self.ahead.nrows();
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        let count = (n * n.saturating_sub(1) / 2).max(1) as f64;
        let common = (pairs.map(|at| self.ahead[at]).sum::<f64>() / count).max(0.0);
        let own = |i: usize| (self.ahead[(i, i)] - common).max(0.0);
        ((0..n).map(own).collect(), common)
    }

    /// A sample at rest (strain since the tare): whether more is known of the rest now.
    pub fn rested(&mut self, strain: &[f64], noise: &[f64], used: &[bool]) -> bool {
        if std::mem::replace(&mut self.under_touch, false) {
            self.forget();
        }
        let Some((mean, samples)) = self.gather(strain) else {
            return false;
        };
        self.waiting.push_back(RestBlock {
            ends_s: self.now_s,
            mean,
            samples,
        });
        let ago_s = if self.creep.loaded {
            SOON_S
        } else {
            BELIEVED_S
        };
        self.believe(ago_s, noise, used);
        self.weigh(noise, used);
        true
    }

    /// Takes what was read at rest so many seconds ago, and has been steady since.
    fn believe(&mut self, ago_s: f64, noise: &[f64], used: &[bool]) {
        let until = self.now_s - ago_s;
        let old = |block: &RestBlock| block.ends_s <= until;
        while self.waiting.front().is_some_and(old) && self.following() >= FOLLOWED_BY {
            let strays = self.strays(noise, used);
            let Some(block) = self.waiting.pop_front() else {
                return;
            };
            let Some(strays) = strays else {
                self.walk.steps.interrupted();
                continue;
            };
            self.believed = true;
            let was_loaded = self.creep.loaded;
            self.go_on_to(block.ends_s, None);
            let off = block.mean.iter().zip(self.walk.rest(0.0));
            let off: Vec<f64> = off.map(|(x, b)| x - b).collect();
            let of_mean = noise.iter().map(|n| n * n / block.samples);
            let variance: Vec<f64> = of_mean.zip(strays).map(|(n, s)| n + s).collect();
            if was_loaded {
                self.walk.inflate(&off, &variance, used, CAUTION);
            }
            let off = (&off[..], f64::INFINITY);
            let bends = self.creep.bends_by(steps::STRETCH_S);
            if bends < CREEPS {
                let read = (&block.mean[..], block.samples, block.ends_s);
                self.walk.rested(read, noise, used);
            }
            if let Some(correction) = self.walk.correct(off, &variance, used, &[]) {
                self.walk.settle();
                self.walk.learn(&correction, self.as_of_s);
            }
        }
    }

    /// Samples that wait after the oldest block.
    fn following(&self) -> f64 {
        self.waiting.iter().skip(1).map(|b| b.samples).sum()
    }

    /// By how much more than noise the oldest block that waits is off from those after it (strain², a channel): the end of a
    /// touch that goes slowly is hardly a rest. Nothing where it is none at all.
    fn strays(&self, noise: &[f64], used: &[bool]) -> Option<Vec<f64>> {
        let mut blocks = self.waiting.iter();
        let first = blocks.next()?;
        let count: f64 = blocks.clone().map(|b| b.samples).sum();
        let of_channel = |c: usize| {
            let sum: f64 = blocks.clone().map(|b| b.samples * b.mean[c]).sum();
            let deviation = noise[c] * (first.samples.recip() + count.recip()).sqrt();
            let off = (first.mean[c] - sum / count).abs();
            let usual = USUAL * deviation;
            let is_steady = off < STEADY * deviation + STEADY_BY;
            is_steady.then(|| (off * off - usual * usual).max(0.0))
        };
        let channels = 0..first.mean.len();
        let stays = |c: usize| !used[c] || count == 0.0;
        channels
            .map(|c| if stays(c) { Some(0.0) } else { of_channel(c) })
            .collect()
    }

    /// A sample (strain since the tare) under a touch, and what that reads of it, with the ways in which it may be another touch
    /// (columns of J, strain). Whether more is known of the rest now.
    pub fn touched(
        &mut self,
        touches: &SeveralTouches,
        [strain, reading]: [&[f64]; 2],
        noise: &[f64],
        used: &[bool],
        ways: impl Fn() -> Vec<Vec<f64>>,
    ) -> bool {
        if !std::mem::replace(&mut self.under_touch, true) {
            self.interrupted(noise, used);
        }
        let left = strain.iter().zip(reading).map(|(x, r)| x - r);
        let both: Vec<f64> = left.chain(strain.iter().copied()).collect();
        let Some((mut mean, samples)) = self.gather(&both) else {
            return false;
        };
        // As it came: what is loaded is no other because the estimate wanders, and what that is beside the ways in which the touch
        // may be another one would seem to be seen.
        let hardest = touches.contacts.first();
        let as_it_came = hardest.and_then(|touch| self.misfit.reading(touch.force));
        let read: Vec<f64> = strain.iter().zip(self.rest()).map(|(x, b)| x - b).collect();
        let load = load_of(as_it_came.as_deref().unwrap_or(reading), &read);
        let off = misfit::off_by(touches, load, [reading, &read]);
        self.go_on_to(self.now_s, Some([load, &off]));
        let rest: Vec<f64> = self.walk.rest(0.0).collect();
        for (x, rest) in mean.iter_mut().zip(rest.iter().chain(&rest)) {
            *x -= rest;
        }
        let read = mean.split_off(rest.len());
        let measured = |doubt: &[f64]| -> Vec<f64> {
            let noise = noise.iter().zip(doubt);
            noise.map(|(n, d)| n * n / samples + d).collect()
        };
        let corrected = if let Some(touch) = EstimatedTouch::of(touches, [&mean, &read]) {
            self.correct_under(touch, measured, used, ways)
        } else {
            let variance = measured(&misfit::doubt_of(reading));
            let off = (&mean[..], SUDDEN);
            self.walk.correct(off, &variance, used, &ways()).is_some()
        };
        if !corrected {
            self.misfit.forget();
        }
        self.weigh(noise, used);
        true
    }

    /// Corrects the rest under one touch that stands still or, where that is clearly likelier, moves as it is estimated to.
    /// Whether it explains what is read.
    fn correct_under(
        &mut self,
        touch: EstimatedTouch<'_>,
        measured: impl Fn(&[f64]) -> Vec<f64>,
        used: &[bool],
        ways: impl Fn() -> Vec<Vec<f64>>,
    ) -> bool {
        let Some(beyond) = self.misfit.beyond(touch, &ways) else {
            return true;
        };
        let variance = measured(&beyond.doubt);
        let either = [&beyond.moving[..], &beyond.standing[..]];
        let moves = (self.walk).likelier_by(either, &variance, used, &beyond.ways) > MOVES;
        if beyond.harder || (moves && !beyond.stays) {
            self.misfit.came(touch, ways());
            return true;
        }
        let off = if moves { either[0] } else { either[1] };
        let off = (off, SUDDEN);
        (self.walk)
            .correct(off, &variance, used, &beyond.ways)
            .is_some()
    }

    /// Something comes: of a rest that was too short to be believed, what was read well before says what there is to
    /// know.
    pub fn interrupted(&mut self, noise: &[f64], used: &[bool]) {
        if !self.believed && !self.waiting.is_empty() {
            self.believe(BEFORE_S, noise, used);
            self.weigh(noise, used);
        }
        self.forget();
    }

    /// A channel has jumped, by as much as is known so well (strain²), and its samples are as if it had not.
    pub fn jumped(&mut self, channel: usize, variance: f64, noise: &[f64], used: &[bool]) {
        self.walk.covariance[(channel, channel)] += variance;
        self.forget();
        self.weigh(noise, used);
    }

    /// Every channel's rest may have moved as far as this (strain), unseen.
    pub fn left_behind(&mut self, strain: &[f64], noise: &[f64], used: &[bool]) {
        for (channel, by) in strain.iter().enumerate().filter(|(c, _)| used[*c]) {
            self.walk.covariance[(channel, channel)] += by * by;
        }
        self.weigh(noise, used);
    }

    /// Nothing is known of what was gathered.
    fn forget(&mut self) {
        self.waiting.clear();
        self.misfit.forget();
        self.walk.steps.interrupted();
        (self.samples, self.walk.rested_s, self.believed) = (0.0, None, false);
    }

    /// The mean of a block, when it is full.
    fn gather(&mut self, values: &[f64]) -> Option<(Vec<f64>, f64)> {
        if self.samples == 0.0 {
            self.gathered = vec![0.0; values.len()];
        }
        self.samples += 1.0;
        for (sum, value) in self.gathered.iter_mut().zip(values) {
            *sum += value;
        }
        if self.now_s - self.since_s < BLOCK_S {
            return None;
        }
        self.since_s = self.now_s;
        let samples = std::mem::take(&mut self.samples);
        let mean = self.gathered.iter().map(|sum| sum / samples).collect();
        Some((mean, samples))
    }

    /// The rest as of another time, under a load until then that may read so far beside its model (both strain), or none.
    fn go_on_to(&mut self, time_s: f64, under: Option<[&[f64]; 2]>) {
        let seconds = (time_s - self.as_of_s).max(0.0);
        self.as_of_s = time_s;
        self.walk.pass(seconds, under.is_some());
        if let Some([_, off]) = under {
            self.walk.go_off(seconds, off);
        } else {
            self.walk.let_go();
        }
        let load = under.map(|[load, _]| load);
        self.creep.grow(&mut self.walk.covariance, load, seconds);
    }

    fn weigh(&mut self, noise: &[f64], used: &[bool]) {
        let ahead_s = self.now_s - self.as_of_s;
        self.ahead = self.walk.rest_covariance(ahead_s, self.under_touch);
        // Whether anything touches is asked of what would be left if it let go now.
        let mut after = self.ahead.clone();
        self.creep.let_go(&mut after);
        self.weights[0] = weights(&after, noise, used);
        let hid = if self.creep.loaded { CAUTION } else { 1.0 };
        self.weights[1] = weights(&(after * hid), noise, used);
        self.weighed_for = used.to_vec();
    }
}

/// What loads the channels, where a touch is thought to read so (strain): what is read, if that touch leaves more of it than it
/// explains. Where place and force are hardly told apart, the means of both may be of a touch that reads a thousand times as much.
fn load_of<'a>(reading: &'a [f64], read: &'a [f64]) -> &'a [f64] {
    let left = reading.iter().zip(read).map(|(r, x)| (x - r) * (x - r));
    let all = read.iter().map(|x| x * x);
    if left.sum::<f64>() < all.sum::<f64>() {
        reading
    } else {
        read
    }
}

/// P of some of the channels.
fn among(covariance: &DMatrix<f64>, channels: &[usize]) -> DMatrix<f64> {
    let n = channels.len();
    DMatrix::from_fn(n, n, |i, j| covariance[(channels[i], channels[j])])
}

/// (P + R)⁻¹ of the channels that are used, row by row; zeros for the others.
fn weights(covariance: &DMatrix<f64>, noise: &[f64], used: &[bool]) -> Vec<f64> {
    let n = noise.len();
    let trusted: Vec<usize> = (0..n).filter(|&k| used[k]).collect();
    let mut inner = among(covariance, &trusted);
    for (k, &c) in trusted.iter().enumerate() {
        inner[(k, k)] += noise[c] * noise[c];
    }
    let mut weights = vec![0.0; n * n];
    if let Some(inverse) = inner.cholesky().map(|c| c.inverse()) {
        for (i, &a) in trusted.iter().enumerate() {
            for (j, &b) in trusted.iter().enumerate() {
                weights[a * n + b] = inverse[(i, j)];
            }
        }
    }
    weights
}
