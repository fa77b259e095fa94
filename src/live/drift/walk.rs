//! What the rest of all channels is since a tare, and how it walks: each channel for itself, and all together at a speed
//! that changes, every one of them by a factor of its own.
//!
//! The state is (e, D, v, δ, m), 3 n + 2 numbers for n channels, and the rest b = e + (1 + δ) D. In a time Δ
//!
//! ```text
//! e ← e + w                w ~ N(0, diag(q²) Δ)
//! D ← D + v Δ + w'         w' ~ N(0, q_D² Δ)
//! v ← v + w″               w″ ~ N(0, q_v² Δ)
//! δ ← a δ + w‴             w‴ ~ N(0, u² (1 − a²)), a² = exp(−Δ/T), of which a touch says nothing
//! m ← k m + w⁗             w⁗ ~ N(0, s² (1 − k²)), k = exp(−Δ/S)
//! ```
//!
//! m is what a touch reads beside what its model says, of deviation s, and is read with b as long as it lasts. It goes slowly:
//! taken for noise, the rest would seem to be known better and better, and would follow it (a bias as a state of its own:
//! B. Friedland, IEEE Trans. Automatic Control 14, 359, 1969). Where the ways in which a touch may be another one are nearly those
//! in which the rest may be off, it would be moved far to explain a little.
//!
//! D is how far all have drifted since the last correction at rest: what lies before is in e. The mean of δ is nothing:
//! half as large a D with factors twice as large would be the same.
//!
//! How uneven channels are, u, is learned from what is known of all of them (a hierarchical model: A. Gelman, Bayesian
//! Analysis 1, 2006): where those that a touch does not hide drift alike, the others do so too. How far each walks by
//! itself, q, is told at rest ([`Steps`]): a channel that was thought to walk less than it does would be taken for an uneven one.

#[cfg(test)]
mod tests;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::steps::Steps;
use crate::statistics::{chi_squared_bound, mean, median};

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
/// What boards are like before anything is known of one: half of them are less uneven than the first, and the mean of u² is
/// the square of the second, with ln u normal. And the seconds at rest in which factors become others (T).
const HALF_UNEVEN: f64 = 0.05;
const UNEVEN: f64 = 0.1;
const CHANGES_S: f64 = 200.0;
/// Seconds in which what a touch reads beside its model becomes another (S).
const OTHER_S: f64 = 10.0;
/// Of so many directions of δ something has to be known before u is thought to be larger: a drift that has just begun tells nothing
/// yet.
const FEWEST: f64 = 2.0;
/// u is one of so many between these.
const LEAST_UNEVEN: f64 = 0.003;
const MOST_UNEVEN: f64 = 0.8;
const TRIED: u32 = 60;
/// Times as much or as little as was thought, from which on u² is another one.
const LESS: f64 = 1.1;
const MORE: f64 = 1.5;
/// The most by which a tare lets a channel differ (standard deviations).
const TARED_MOST: f64 = 3.0;

/// The rest of every channel and what is known of its steps.
pub(super) struct RestWalk {
    /// (e, D, v, δ, m).
    state: DVector<f64>,
    /// Its covariance, and what that was after the tare.
    pub covariance: DMatrix<f64>,
    start: DMatrix<f64>,
    /// q² of each channel (strain² a second), as corrections at rest have it and as its steps do, and the least.
    own: Vec<f64>,
    pub steps: Steps,
    least_own: Vec<f64>,
    /// u², as the covariance of δ has it.
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
        let mut covariance = DMatrix::zeros(3 * n + 2, 3 * n + 2);
        for (c, x) in noise.iter().enumerate() {
            covariance[(c, c)] = (TARED * x).powi(2);
        }
        covariance[(n, n)] = TARED_TOGETHER * TARED_TOGETHER;
        covariance[(n + 1, n + 1)] = SPEED * SPEED;
        spread_factors(&mut covariance, UNEVEN * UNEVEN);
        let mut walk = Self {
            state: DVector::zeros(3 * n + 2),
            start: covariance.clone(),
            covariance,
            own: least_own.clone(),
            steps: Steps::new(n),
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
        let Some(speed) = median(drift.iter().copied()).filter(|speed| speed.is_finite()) else {
            return;
        };
        self.state[n + 1] = speed;
        // How uneven they are is known as well as it shows how far they have gone.
        let shown = (SHOWN / (TARED_S * speed)).powi(2);
        if shown.is_finite() {
            let most = TARED_MOST * UNEVEN;
            let sound = drift.iter().enumerate().filter(|(_, d)| d.is_finite());
            for (c, d) in sound {
                self.tell_factor(c, (d / speed - 1.0).clamp(-most, most), shown);
            }
        }
    }

    /// Takes δ of a channel for a measured one.
    fn tell_factor(&mut self, channel: usize, is: f64, variance: f64) {
        let k = self.channels() + 2 + channel;
        let column = self.covariance.column(k).into_owned();
        let gain = &column / (column[k] + variance);
        self.state.axpy(is - self.state[k], &gain, 1.0);
        self.covariance.ger(-1.0, &gain, &column, 1.0);
        keep_a_covariance(&mut self.covariance);
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
        if !hidden {
            let kept = (-0.5 * seconds / CHANGES_S).exp();
            self.state.rows_mut(n + 2, n).scale_mut(kept);
        }
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
        if !hidden {
            let kept = (-0.5 * seconds / CHANGES_S).exp();
            keep(&mut p, n + 2, kept);
            spread_factors(&mut p, self.uneven * (1.0 - kept * kept));
        }
        let least = if hidden { HIDDEN * HIDDEN } else { 0.0 };
        for (c, own) in self.own.iter().enumerate() {
            p[(c, c)] += own.max(self.steps.variance(c)).max(least) * seconds;
        }
        p[(n, n)] += TOGETHER * TOGETHER * seconds;
        p[(n + 1, n + 1)] += HURRIES * HURRIES * seconds;
        p
    }

    /// Seconds of a touch go by that may read so far off what its model says (strain, standard deviations).
    pub fn go_off(&mut self, seconds: f64, by: &[f64]) {
        let m = 2 * self.channels() + 2;
        let kept = (-seconds / OTHER_S).exp();
        self.state.rows_range_mut(m..).scale_mut(kept);
        keep(&mut self.covariance, m, kept);
        for (c, by) in by.iter().enumerate() {
            self.covariance[(m + c, m + c)] += by * by * (1.0 - kept * kept);
        }
    }

    /// Nothing touches any more.
    pub fn let_go(&mut self) {
        let m = 2 * self.channels() + 2;
        self.state.rows_range_mut(m..).fill(0.0);
        keep(&mut self.covariance, m, 0.0);
    }

    /// ∂b/∂state: channels × (3 n + 2).
    fn jacobian(&self) -> DMatrix<f64> {
        let n = self.channels();
        DMatrix::from_fn(n, 3 * n + 2, |c, k| {
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

    /// What readings without a touch are expected to be off from the rest by, where they have these variances (strain²) and
    /// the touch may be another one in some ways; nothing where rounding has left no covariance.
    fn innovation(&self, variance: &[f64], used: &[bool], ways: &[Vec<f64>]) -> Option<Innovation> {
        let trusted: Vec<usize> = (0..used.len()).filter(|&k| used[k]).collect();
        let n = self.channels();
        let mut by = self.jacobian();
        // Of nothing that touches m is nothing, and certain.
        by.columns_mut(2 * n + 2, n).fill_with_identity();
        let seen = by.select_rows(&trusted) * &self.covariance;
        let mut inner = &seen * by.select_rows(&trusted).transpose();
        inner += DMatrix::from_diagonal(&among(variance, &trusted));
        for way in ways {
            let way = among(way, &trusted);
            inner.ger(1.0, &way, &way, 1.0);
        }
        Some(Innovation {
            factor: inner.cholesky()?,
            trusted,
            seen,
        })
    }

    /// By how many weighted squares, as χ², one reading that is off from the rest without a touch is likelier than another.
    pub fn likelier_by(
        &self,
        [off, than]: [&[f64]; 2],
        variance: &[f64],
        used: &[bool],
        ways: &[Vec<f64>],
    ) -> f64 {
        let expected = self.innovation(variance, used, ways);
        expected.map_or(0.0, |e| e.squares(than) - e.squares(off))
    }

    /// As far as readings without a touch (strain, with their variances, strain²) are more off from the rest than was thought
    /// possible, it is known less well: of so many times the variance at most. What one correction would leave of it otherwise
    /// is in directions of which the filter was wrongly sure, and would be taken for a touch (adaptive fading: Q. Xia, M. Rao,
    /// Y. Ying and X. Shen, Automatica 30, 1994).
    pub fn inflate(&mut self, off: &[f64], variance: &[f64], used: &[bool], most: f64) {
        let Some(expected) = self.innovation(variance, used, &[]) else {
            return;
        };
        let count = expected.trusted.len().max(1) as f64;
        let share = (expected.squares(off) / count).clamp(1.0, most);
        let n = self.channels();
        let more = self.rest_covariance(0.0, false) * (share - 1.0);
        let mut own = self.covariance.view_mut((0, 0), (n, n));
        own += more;
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
        let Some(expected) = self.innovation(variance, used, ways) else {
            // Rounding has made it none: what a tare knows is known again.
            (self.covariance, self.uneven) = (self.start.clone(), UNEVEN * UNEVEN);
            return None;
        };
        let count = expected.trusted.len() as f64;
        if expected.squares(off) > chi_squared_bound(count, most) {
            return None;
        }
        let off = among(off, &expected.trusted);
        let Innovation { factor, seen, .. } = expected;
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

    /// Some samples at rest, as [`Steps::rested`] takes them.
    pub fn rested(&mut self, read: (&[f64], f64, f64), noise: &[f64], used: &[bool]) {
        let factors: Vec<f64> = (0..self.channels()).map(|c| self.factor(c)).collect();
        self.steps.rested(read, noise, used, &factors);
    }

    /// The rest is where it is: what all have drifted until now is taken for each channel's own.
    pub fn settle(&mut self) {
        let n = self.channels();
        let by = self.jacobian();
        let mut into = DMatrix::identity(3 * n + 2, 3 * n + 2);
        into.rows_mut(0, n).copy_from(&by);
        into[(n, n)] = 0.0;
        let rest: Vec<f64> = self.rest(0.0).collect();
        self.state.rows_mut(0, n).copy_from_slice(&rest);
        self.state[n] = 0.0;
        self.covariance = &into * &self.covariance * into.transpose();
        keep_a_covariance(&mut self.covariance);
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

    /// u² by what readings have told of δ. Where it is less than was thought, every δ is known better by as much: what a
    /// tighter prior says beside the one before is a measurement of nothing, δ = 0 ± r. Where it is more, they are known
    /// worse.
    fn learn_unevenness(&mut self) {
        let Some((uneven, known)) = self.expected_unevenness() else {
            return;
        };
        if uneven < self.uneven / LESS {
            let tighter = uneven.recip() - self.uneven.recip();
            for c in 0..self.channels() {
                self.tell_factor(c, 0.0, tighter.recip());
            }
            self.uneven = uneven;
        } else if uneven > MORE * self.uneven && known >= FEWEST {
            spread_factors(&mut self.covariance, uneven - self.uneven);
            self.uneven = uneven;
        }
    }

    /// The mean of u² by what is known of δ and of boards at all. Of the directions of δ that are independent each has been
    /// measured, as m ± r, beside what u² says of it: m is normal of variance u² + r². With it the number of directions that are
    /// known; nothing of a single channel.
    fn expected_unevenness(&self) -> Option<(f64, f64)> {
        let n = self.channels();
        if n < 2 {
            return None;
        }
        let known = self.covariance.view((n + 2, n + 2), (n, n));
        let known = SymmetricEigen::new(known.into_owned());
        let along = known.eigenvectors.tr_mul(&self.state.rows(n + 2, n));
        // One of them is the mean, of which there is nothing to tell.
        let mean = known.eigenvalues.imin();
        let share = |k: usize| (1.0 - known.eigenvalues[k] / self.uneven).clamp(1e-6, 1.0);
        let directions = (0..n).filter(|&k| k != mean);
        let count: f64 = directions.clone().map(share).sum();
        let measured: Vec<[f64; 2]> = directions
            .map(|k| {
                let share = share(k);
                let r2 = self.uneven * (share.recip() - 1.0);
                [(along[k] / share).powi(2), r2]
            })
            .collect();
        let usual = (UNEVEN / HALF_UNEVEN).ln();
        let unlikely = |u: f64| {
            let of = |[square, r2]: &[f64; 2]| (u * u + r2).ln() + square / (u * u + r2);
            measured.iter().map(of).sum::<f64>() + (u / HALF_UNEVEN).ln().powi(2) / usual
        };
        let tried: Vec<[f64; 2]> = (0..TRIED)
            .map(|k| {
                let share = f64::from(k) / f64::from(TRIED - 1);
                let u = LEAST_UNEVEN * (MOST_UNEVEN / LEAST_UNEVEN).powf(share);
                [u * u, unlikely(u)]
            })
            .collect();
        let least = tried.iter().map(|t| t[1]).fold(f64::INFINITY, f64::min);
        let likely = |t: &[f64; 2]| (0.5 * (least - t[1])).exp();
        let sum: f64 = tried.iter().map(likely).sum();
        let uneven = tried.iter().map(|t| t[0] * likely(t)).sum::<f64>() / sum;
        Some((uneven, count))
    }
}

/// How far readings are expected to be off: the channels that are trusted, what is read of the state (trusted × (3 n + 2)),
/// and the covariance of it all.
struct Innovation {
    trusted: Vec<usize>,
    seen: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl Innovation {
    /// Weighted squares of what readings are off by (strain): as χ².
    fn squares(&self, off: &[f64]) -> f64 {
        let off = among(off, &self.trusted);
        off.dot(&self.factor.solve(&off))
    }
}

/// The values of some of the channels.
fn among(values: &[f64], channels: &[usize]) -> DVector<f64> {
    DVector::from_iterator(channels.len(), channels.iter().map(|&c| values[c]))
}

/// Keeps a share of as many states as there are channels, from one on.
fn keep(p: &mut DMatrix<f64>, from: usize, share: f64) {
    let n = (p.nrows() - 2) / 3;
    p.rows_mut(from, n).scale_mut(share);
    p.columns_mut(from, n).scale_mut(share);
}

/// Makes the factors of all channels uncertain by so much more (variance), and not their mean.
fn spread_factors(p: &mut DMatrix<f64>, variance: f64) {
    let n = (p.nrows() - 2) / 3;
    for i in 0..n {
        for j in 0..n {
            let of_both = f64::from(u8::from(i == j)) - (n as f64).recip();
            p[(n + 2 + i, n + 2 + j)] += variance * of_both;
        }
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
