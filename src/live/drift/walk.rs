//! What the rest of all channels is since a tare, and how it walks: each channel for itself, and all together at a speed
//! that changes, every one of them by a factor of its own.
//!
//! The state is (e, D, v, δ), 2 n + 2 numbers for n channels, and the rest b = e + (1 + δ) D. In a time Δ
//!
//! ```text
//! e ← e + w                w ~ N(0, diag(q²) Δ)
//! D ← D + v Δ + w'         w' ~ N(0, q_D² Δ)
//! v ← v + w″               w″ ~ N(0, q_v² Δ)
//! δ ← δ + w‴               w‴ ~ N(0, u² Δ/T), of which a touch says nothing
//! ```
//!
//! How uneven channels are, u, is learned from what is known of all of them (empirical Bayes: C. N. Morris, J. American Stat.
//! Association 78, 1983): where those that a touch does not hide drift alike, the others do so too.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

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
/// Seconds of a tare, as far as they show a drift, and how well they show how far a channel has gone (strain).
const TARED_S: f64 = 0.5;
const SHOWN: f64 = 0.4e-6;
/// Seconds at rest after which it is asked how far the rest has walked, and in which that is believed.
const WINDOW_S: f64 = 0.25;
const BELIEVED_S: f64 = 5.0;
/// u before anything is known, what it is believed to be where all drift alike and for how many channels that belief
/// counts, and the seconds at rest in which channels change in that.
const UNEVEN: f64 = 0.1;
const ALIKE: f64 = 0.02;
const BELIEF: f64 = 2.0;
const CHANGES_S: f64 = 200.0;
/// A direction of δ is told of where its variance is less than this share of u², and u is learned from so many at least.
const TOLD: f64 = 0.25;
const FEWEST: f64 = 4.0;

/// The rest of every channel and what is known of its steps.
pub(super) struct RestWalk {
    /// (e, D, v, δ).
    state: DVector<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// q² of each channel (strain² a second).
    own: Vec<f64>,
    least_own: Vec<f64>,
    /// u².
    uneven: f64,
    /// When the window began, and what the rest has been corrected by in it.
    pub rested_s: Option<f64>,
    walked: Vec<f64>,
    /// Seconds since u was asked for.
    asked_s: f64,
}

impl RestWalk {
    /// A channel of this noise (strain) at a rate (Hz) is followed within some seconds at rest, and drifts (strain a
    /// second) as it did while the tare was taken.
    pub fn new(noise: &[f64], drift: &[f64], follows_s: f64, rate: f64) -> Self {
        let n = noise.len();
        let least = |x: &f64| (x / (follows_s * rate.sqrt())).max(OWN).powi(2);
        let least_own: Vec<f64> = noise.iter().map(least).collect();
        let mut variances = DVector::from_element(2 * n + 2, UNEVEN * UNEVEN);
        for (c, x) in noise.iter().enumerate() {
            variances[c] = (TARED * x).powi(2);
        }
        variances[n] = TARED_TOGETHER * TARED_TOGETHER;
        variances[n + 1] = SPEED * SPEED;
        let mut walk = Self {
            state: DVector::zeros(2 * n + 2),
            covariance: DMatrix::from_diagonal(&variances),
            own: least_own.clone(),
            least_own,
            uneven: UNEVEN * UNEVEN,
            rested_s: None,
            walked: vec![0.0; n],
            asked_s: 0.0,
        };
        if drift.len() == n {
            walk.tared(drift);
        }
        walk
    }

    /// What a tare has shown of the drift (strain a second).
    fn tared(&mut self, drift: &[f64]) {
        let n = drift.len();
        let speed = mean(drift);
        self.state[n + 1] = speed;
        // How uneven they are is known as well as it shows how far they have gone.
        let shown = (SHOWN / (TARED_S * speed)).powi(2);
        if !shown.is_finite() {
            return;
        }
        for (c, d) in drift.iter().enumerate() {
            let at = n + 2 + c;
            let gain = self.covariance[(at, at)] / (self.covariance[(at, at)] + shown);
            self.state[at] = gain * (d / speed - 1.0);
            self.covariance[(at, at)] *= 1.0 - gain;
        }
    }

    fn channels(&self) -> usize {
        self.own.len()
    }

    /// 1 + δ of a channel.
    fn factor(&self, channel: usize) -> f64 {
        1.0 + self.state[self.channels() + 2 + channel]
    }

    /// b of every channel so many seconds later (strain).
    pub fn rest(&self, seconds: f64) -> impl Iterator<Item = f64> + '_ {
        let n = self.channels();
        let together = self.state[n] + seconds * self.state[n + 1];
        (0..n).map(move |c| self.state[c] + self.factor(c) * together)
    }

    /// What every channel drifts by now (strain a second).
    pub fn speeds(&self) -> impl Iterator<Item = f64> + '_ {
        let n = self.channels();
        (0..n).map(move |c| self.factor(c) * self.state[n + 1])
    }

    /// Seconds go by, under a touch or none.
    pub fn pass(&mut self, seconds: f64, hidden: bool) {
        let n = self.channels();
        self.covariance = self.later(seconds, hidden);
        self.state[n] += seconds * self.state[n + 1];
        self.asked_s += seconds;
        if self.asked_s >= WINDOW_S {
            self.asked_s = 0.0;
            self.learn_unevenness();
        }
    }

    /// The state's covariance some seconds later.
    fn later(&self, seconds: f64, hidden: bool) -> DMatrix<f64> {
        let n = self.channels();
        let mut p = self.covariance.clone();
        // D by v: a row and then a column.
        let speed = p.row(n + 1) * seconds;
        let mut together = p.row_mut(n);
        together += speed;
        let speed = p.column(n + 1) * seconds;
        let mut together = p.column_mut(n);
        together += speed;
        let changed = if hidden { 0.0 } else { seconds / CHANGES_S };
        for c in n + 2..2 * n + 2 {
            p[(c, c)] += changed * self.uneven;
        }
        let least = if hidden { HIDDEN * HIDDEN } else { 0.0 };
        for (c, own) in self.own.iter().enumerate() {
            p[(c, c)] += own.max(least) * seconds;
        }
        p[(n, n)] += TOGETHER * TOGETHER * seconds;
        p[(n + 1, n + 1)] += HURRIES * HURRIES * seconds;
        p
    }

    /// ∂b/∂state: channels × (2 n + 2).
    fn jacobian(&self) -> DMatrix<f64> {
        let n = self.channels();
        DMatrix::from_fn(n, 2 * n + 2, |c, k| {
            if k == c {
                1.0
            } else if k == n {
                self.factor(c)
            } else if k == n + 2 + c {
                self.state[n]
            } else {
                0.0
            }
        })
    }

    /// The covariance of b so many seconds later (strain²).
    pub fn rest_covariance(&self, seconds: f64, hidden: bool) -> DMatrix<f64> {
        let by = self.jacobian();
        &by * self.later(seconds, hidden) * by.transpose()
    }

    /// Corrects the rest by what readings are off from it without a touch, with their variances (strain, strain²) and the
    /// ways in which the touch may be another one. By how much b is another then (strain); nothing where the readings are
    /// farther off than so many standard deviations of χ².
    pub fn correct(
        &mut self,
        (off, most): (&[f64], f64),
        variance: &[f64],
        used: &[bool],
        ways: &[Vec<f64>],
    ) -> Option<Vec<f64>> {
        let trusted: Vec<usize> = (0..off.len()).filter(|&k| used[k]).collect();
        let of_trusted = |values: &[f64]| {
            DVector::from_iterator(trusted.len(), trusted.iter().map(|&c| values[c]))
        };
        let by = self.jacobian();
        // What is read depends on the state, trusted × (2 n + 2).
        let seen = by.select_rows(&trusted) * &self.covariance;
        let mut inner = &seen * by.select_rows(&trusted).transpose();
        inner += DMatrix::from_diagonal(&of_trusted(variance));
        for way in ways {
            let way = of_trusted(way);
            inner.ger(1.0, &way, &way, 1.0);
        }
        let (factor, off) = (inner.cholesky()?, of_trusted(off));
        let count = trusted.len() as f64;
        if off.dot(&factor.solve(&off)) > count + most * (2.0 * count).sqrt() {
            return None;
        }
        let gain = factor.solve(&seen);
        let correction = gain.tr_mul(&off);
        if correction.iter().any(|c| !c.is_finite()) {
            return None;
        }
        self.covariance -= seen.tr_mul(&gain);
        keep_a_covariance(&mut self.covariance);
        let before: Vec<f64> = self.rest(0.0).collect();
        self.state += correction;
        Some(self.rest(0.0).zip(before).map(|(b, was)| b - was).collect())
    }

    /// Takes a correction at rest for what the rest walks by.
    pub fn learn(&mut self, correction: &[f64], now_s: f64) {
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
            self.believe(window);
            self.rested_s = Some(now_s);
            self.walked.fill(0.0);
        }
    }

    fn believe(&mut self, window: f64) {
        let together = mean(&self.walked);
        let covariance = self.rest_covariance(0.0, false);
        let share = (window / BELIEVED_S).min(1.0);
        for c in 0..self.channels() {
            let alone = self.walked[c] - together * self.factor(c);
            let seen = (alone * alone - 2.0 * covariance[(c, c)]).max(0.0) / window;
            self.own[c] += share * (seen.max(self.least_own[c]) - self.own[c]);
        }
    }

    /// u² from what is known of δ: from those directions of it that readings have told of, as many as they are. Where it is
    /// less than was thought, every δ is known better by as much: what a tighter prior says beside the one before is a
    /// measurement of nothing, δ = 0 ± r.
    fn learn_unevenness(&mut self) {
        let n = self.channels();
        let known = self.covariance.view((n + 2, n + 2), (n, n));
        let known = SymmetricEigen::new(known.into_owned());
        let along = known.eigenvectors.tr_mul(&self.state.rows(n + 2, n));
        let pairs = known.eigenvalues.iter().zip(along.iter());
        let told = pairs.filter(|(variance, _)| **variance < TOLD * self.uneven);
        let (count, squares) = told.fold((0.0, 0.0), |(count, sum), (variance, along)| {
            (count + 1.0, sum + along * along + variance)
        });
        if count < FEWEST {
            return;
        }
        let uneven = (squares + BELIEF * ALIKE * ALIKE) / (count + BELIEF);
        let tighter = uneven.recip() - self.uneven.recip();
        self.uneven = uneven;
        if tighter <= 0.0 {
            return;
        }
        for k in n + 2..2 * n + 2 {
            let column = self.covariance.column(k).into_owned();
            let gain = &column / (column[k] + tighter.recip());
            self.state.axpy(-self.state[k], &gain, 1.0);
            self.covariance.ger(-1.0, &gain, &column, 1.0);
        }
        keep_a_covariance(&mut self.covariance);
    }
}

/// What rounding makes of it must stay a covariance.
fn keep_a_covariance(p: &mut DMatrix<f64>) {
    for i in 0..p.nrows() {
        for j in 0..i {
            let mean = f64::midpoint(p[(i, j)], p[(j, i)]);
            (p[(i, j)], p[(j, i)]) = (mean, mean);
        }
        p[(i, i)] = p[(i, i)].max(1e-20);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 10;
    const NOISE: f64 = 1e-6;
    const STEP_S: f64 = 0.01;

    /// A walk that has followed drifts (strain a second) for so many seconds, by blocks whose noise is small; the first
    /// `hidden` channels are read for three seconds only.
    fn followed(speeds: &[f64; N], seconds: f64, hidden: usize) -> RestWalk {
        let mut walk = RestWalk::new(&[NOISE; N], &[], 3.0, 200.0);
        let variance = [NOISE * NOISE / 2.0; N];
        let mut used = [true; N];
        for k in 1..=(seconds / STEP_S) as u32 {
            let now = f64::from(k) * STEP_S;
            if now > 3.0 {
                used[..hidden].fill(false);
            }
            walk.pass(STEP_S, now > 3.0);
            let wave = |c: usize| 0.7 * NOISE * (f64::from(k) * (1.3 + c as f64)).sin();
            let read = (0..N).map(|c| speeds[c] * now + wave(c));
            let off: Vec<f64> = read.zip(walk.rest(0.0)).map(|(x, b)| x - b).collect();
            let corrected = walk.correct((&off, f64::INFINITY), &variance, &used, &[]);
            assert!(corrected.is_some());
        }
        walk
    }

    /// Three channels that nobody reads for two minutes drift as the others are seen to; their uncertainty says so.
    #[test]
    fn what_is_hidden_drifts_as_the_others_do() {
        let walk = followed(&[2e-6; N], 120.0, 3);
        let covariance = walk.rest_covariance(0.0, true);
        for (c, rest) in walk.rest(0.0).take(3).enumerate() {
            let off = (rest - 240e-6).abs();
            let deviation = covariance[(c, c)].sqrt();
            assert!(
                deviation < 4e-6 && off < 2.0 * deviation,
                "{c}: {off} of {deviation}"
            );
        }
    }

    #[test]
    fn channels_that_drift_unevenly_are_told() {
        let speeds: [f64; N] = std::array::from_fn(|c| if c % 2 == 0 { 2.4e-6 } else { 1.6e-6 });
        let walk = followed(&speeds, 20.0, 0);
        let mean = mean(&speeds);
        for (speed, found) in speeds.iter().zip(walk.speeds()) {
            assert!((found - speed).abs() < 0.05 * mean, "{found}");
        }
        assert!(walk.uneven.sqrt() > 0.1, "{}", walk.uneven.sqrt());
        let even = followed(&[2e-6; N], 20.0, 0);
        assert!(even.uneven.sqrt() < 0.03, "{}", even.uneven.sqrt());
    }

    #[test]
    fn what_comes_at_once_is_no_drift() {
        let mut walk = followed(&[0.0; N], 5.0, 0);
        let before: Vec<f64> = walk.rest(0.0).collect();
        let mut jump = [0.0; N];
        jump[3] = 40e-6;
        let refused = walk.correct((&jump, 8.0), &[NOISE * NOISE; N], &[true; N], &[]);
        assert!(refused.is_none() && walk.rest(0.0).eq(before));
        // Where it is a way in which the touch may be another one, it says nothing of the rest.
        let ways = [vec![0.0; N], jump.map(|x| 10.0 * x).to_vec()];
        let taken = walk.correct((&jump, 8.0), &[NOISE * NOISE; N], &[true; N], &ways);
        assert!(taken.is_some_and(|by| by.iter().all(|b| b.abs() < 0.5e-6)));
    }
}
