//! How the rest walks: each channel for itself, and all together at a speed. Learned while nothing touches.

use nalgebra::DMatrix;

use crate::statistics::mean;

/// What a channel walks by in a second at least, and what all do together beside their speed (strain): a workshop is never
/// quite still.
const OWN: f64 = 0.03e-6;
const TOGETHER: f64 = 0.2e-6;
/// Of what a touch hides of a channel, at least: nobody sees that it stays.
const HIDDEN: f64 = 0.1e-6;
/// The speed at which all drift together (strain a second) as a tare leaves it, and what that changes by in a second.
const SPEED: f64 = 2e-6;
const HURRIES: f64 = 0.05e-6;
/// Of a channel's noise, and of what all may have drifted by (strain): how well a tare knows the rest.
const TARED: f64 = 0.3;
const TARED_TOGETHER: f64 = 1e-6;
/// Seconds of a tare, as far as they show a drift.
const TARED_S: f64 = 0.5;
/// Seconds at rest after which it is asked how far the rest has walked, and in which that is believed.
const WINDOW_S: f64 = 0.25;
const BELIEVED_S: f64 = 5.0;
/// How far channels differ in what a temperature does to them (standard deviation, and at most), how well it is known where
/// one has gone (strain), and how many windows are remembered.
const UNEVEN: f64 = 0.1;
const DIFFERS: [f64; 2] = [0.2, 3.0];
const SHOWN: f64 = 0.4e-6;
const WINDOWS: f64 = 400.0;

/// Steps of the rest in a second, and how steadily it drifts.
pub(super) struct RestWalk {
    /// q² of each channel (strain² a second).
    own: Vec<f64>,
    least_own: Vec<f64>,
    /// v, of the drift along the pattern (strain a second).
    pub speed: f64,
    /// s: what each channel drifts by where all drift by one, in the mean.
    pub pattern: Vec<f64>,
    /// What each channel has moved by at rest, and what all have in the mean (strain): where these are few, all move alike.
    each: Vec<f64>,
    all: f64,
    /// How far all have drifted under a touch (strain): what is wrong with the pattern goes with that.
    hidden: f64,
    /// When the window began, and what the rest has been corrected by in it.
    pub rested_s: Option<f64>,
    walked: Vec<f64>,
}

impl RestWalk {
    /// A channel of this noise (strain) at a rate (Hz) is followed within some seconds at rest, and drifts (strain a
    /// second) as it did while the tare was taken.
    pub fn new(noise: &[f64], drift: &[f64], follows_s: f64, rate: f64) -> Self {
        let least = |n: &f64| (n / (follows_s * rate.sqrt())).max(OWN).powi(2);
        let least_own: Vec<f64> = noise.iter().map(least).collect();
        let mut walk = Self {
            own: least_own.clone(),
            least_own,
            speed: mean(drift),
            pattern: vec![1.0; noise.len()],
            each: vec![0.0; noise.len()],
            all: 0.0,
            hidden: 0.0,
            rested_s: None,
            walked: vec![0.0; noise.len()],
        };
        if drift.len() == noise.len() {
            let moved: Vec<f64> = drift.iter().map(|d| TARED_S * d).collect();
            walk.learn_pattern(&moved);
        }
        walk
    }

    /// What each channel drifts by where all drift by one, from how far they have moved (strain).
    fn learn_pattern(&mut self, moved: &[f64]) {
        let kept = 1.0 - WINDOWS.recip();
        self.all = kept * self.all + mean(moved);
        let prior = (SHOWN / UNEVEN).copysign(self.all);
        for ((each, pattern), moved) in self.each.iter_mut().zip(&mut self.pattern).zip(moved) {
            *each = kept * *each + moved;
            *pattern = ((prior + *each) / (prior + self.all)).clamp(DIFFERS[0], DIFFERS[1]);
        }
    }

    /// How far the pattern may be off.
    fn doubt(&self) -> f64 {
        SHOWN / (SHOWN / UNEVEN + self.all.abs())
    }

    /// P after a tare.
    pub fn after_tare(noise: &[f64]) -> DMatrix<f64> {
        let n = noise.len();
        DMatrix::from_fn(n + 1, n + 1, |i, j| match (i, j) {
            (i, j) if i == n && j == n => SPEED * SPEED,
            (i, j) if i == n || j == n => 0.0,
            (i, j) if i == j => (TARED * noise[i]).powi(2) + TARED_TOGETHER * TARED_TOGETHER,
            _ => TARED_TOGETHER * TARED_TOGETHER,
        })
    }

    /// How far a steady drift moves all in some seconds, in the mean (strain).
    pub fn moves(&self, seconds: f64) -> f64 {
        self.speed * seconds
    }

    /// P some seconds later, under a touch or none.
    pub fn grow(&self, covariance: &mut DMatrix<f64>, seconds: f64, hidden: bool) {
        let (n, s) = (self.own.len(), &self.pattern);
        let of_speed = covariance[(n, n)];
        let with_speed: Vec<f64> = (0..n).map(|i| covariance[(i, n)]).collect();
        let together = TOGETHER * TOGETHER * seconds + of_speed * seconds * seconds;
        let least = if hidden { HIDDEN * HIDDEN } else { 0.0 };
        let after = self.hidden + self.moves(seconds).abs();
        let uneven = self.doubt().powi(2) * (after * after - self.hidden * self.hidden);
        for i in 0..n {
            for j in 0..n {
                let along = s[i] * with_speed[j] + s[j] * with_speed[i];
                covariance[(i, j)] += together * s[i] * s[j] + along * seconds;
            }
            covariance[(i, i)] += self.own[i].max(least) * seconds + uneven;
            let with = with_speed[i] + seconds * s[i] * of_speed;
            (covariance[(i, n)], covariance[(n, i)]) = (with, with);
        }
        covariance[(n, n)] += HURRIES * HURRIES * seconds;
    }

    /// All have drifted (strain, in the mean) under a touch, or without one.
    pub fn drifted(&mut self, along: f64, hidden: bool) {
        self.hidden = if hidden {
            self.hidden + along.abs()
        } else {
            0.0
        };
    }

    /// Takes a correction at rest for what the rest walks by.
    pub fn learn(&mut self, correction: &[f64], covariance: &DMatrix<f64>, now_s: f64) {
        let Some(begun) = self.rested_s else {
            self.rested_s = Some(now_s);
            self.walked.fill(0.0);
            return;
        };
        for (walked, c) in self.walked.iter_mut().zip(correction) {
            *walked += c;
        }
        let window = now_s - begun;
        if window >= WINDOW_S {
            self.believe(covariance, window);
            self.rested_s = Some(now_s);
            self.walked.fill(0.0);
        }
    }

    fn believe(&mut self, covariance: &DMatrix<f64>, window: f64) {
        let count = self.own.len().max(1) as f64;
        let together = self.walked.iter().sum::<f64>() / count;
        let share = |seconds: f64| (window / seconds).min(1.0);
        for (c, walked) in self.walked.iter().enumerate() {
            let alone = walked - together * self.pattern[c];
            let seen = (alone * alone - 2.0 * covariance[(c, c)]).max(0.0) / window;
            self.own[c] += share(BELIEVED_S) * (seen.max(self.least_own[c]) - self.own[c]);
        }
        // The steady drift has been taken off before.
        let steadily = self.speed * window;
        let pairs = self.walked.iter().zip(&self.pattern);
        let moved: Vec<f64> = pairs.map(|(walked, s)| walked + s * steadily).collect();
        self.learn_pattern(&moved);
    }

    /// What every channel drifts by now (strain a second).
    pub fn drift(&self) -> impl Iterator<Item = f64> + '_ {
        self.pattern.iter().map(|s| s * self.speed)
    }
}
