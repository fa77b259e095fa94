//! How far each channel walks by itself in a second, q², told at rest.
//!
//! Of a walk of variance q² a second the means x, y, z of three stretches of T seconds one after another have
//! E (x − 2 y + z)² = q² T, to which noise σ adds 6 σ²/m of m samples a stretch. What drifts at a steady speed adds
//! nothing: a channel that drifts more than the others is no channel that walks.

use crate::statistics::median;

/// Seconds of a stretch.
pub(super) const STRETCH_S: f64 = 4.0;
/// What a channel walks by in a second at least, and before it is known (strain), for how many times that counts, and how many
/// times are remembered.
const LEAST: f64 = 0.02e-6;
const USUAL: f64 = 0.1e-6;
const USUAL_COUNTS: f64 = 2.0;
const REMEMBERED: f64 = 30.0;
/// Standard deviations by which a bend counts at most: what comes and goes once is no walk.
const MOST: f64 = 4.0;

/// What the stretches of rest have told.
pub(super) struct Steps {
    /// Since when samples are added up, their sum (strain) and number.
    since_s: Option<f64>,
    sum: Vec<f64>,
    samples: f64,
    /// Means of the stretches before, the last one first, and how much noise is left in each (1/samples).
    before: Vec<(Vec<f64>, f64)>,
    /// Sum of what was told (strain² a second), each by its weight, and these.
    squares: Vec<f64>,
    weight: Vec<f64>,
    /// The channels that all of it is of.
    used: Vec<bool>,
}

impl Steps {
    /// Of so many channels that nothing is known of.
    pub fn new(channels: usize) -> Self {
        Self {
            since_s: None,
            sum: vec![0.0; channels],
            samples: 0.0,
            before: Vec::new(),
            squares: vec![0.0; channels],
            weight: vec![0.0; channels],
            used: Vec::new(),
        }
    }

    /// q² of a channel (strain² a second).
    pub fn variance(&self, channel: usize) -> f64 {
        let squares = self.squares[channel] + USUAL_COUNTS * USUAL * USUAL;
        (squares / (self.weight[channel] + USUAL_COUNTS)).max(LEAST * LEAST)
    }

    /// Takes the mean (strain) of some samples at rest, at a time, with the noise of one (strain), where each channel drifts by
    /// a factor of its own.
    pub fn rested(
        &mut self,
        (read, samples, now_s): (&[f64], f64, f64),
        noise: &[f64],
        used: &[bool],
        factors: &[f64],
    ) {
        if self.used != used {
            self.interrupted();
            self.used = used.to_vec();
        }
        for (sum, x) in self.sum.iter_mut().zip(read) {
            *sum += samples * x;
        }
        self.samples += samples;
        let since_s = *self.since_s.get_or_insert(now_s);
        if now_s - since_s < STRETCH_S {
            return;
        }
        let mean: Vec<f64> = self.sum.iter().map(|sum| sum / self.samples).collect();
        self.before.insert(0, (mean, self.samples.recip()));
        self.look_back(noise, factors);
        self.before.truncate(2);
        self.sum.fill(0.0);
        (self.samples, self.since_s) = (0.0, Some(now_s));
    }

    /// Something came between: stretches are no neighbours any more.
    pub fn interrupted(&mut self) {
        self.sum.fill(0.0);
        (self.samples, self.since_s) = (0.0, None);
        self.before.clear();
    }

    /// What the last three stretches tell.
    fn look_back(&mut self, noise: &[f64], factors: &[f64]) {
        let [(z, of_z), (y, of_y), (x, of_x)] = &self.before[..] else {
            return;
        };
        let left = of_x + 4.0 * of_y + of_z;
        let bend = |c: usize| x[c] - 2.0 * y[c] + z[c];
        let trusted: Vec<usize> = (0..noise.len()).filter(|&c| self.used[c]).collect();
        // What all do together is a drift. Of fewer channels nobody could tell.
        let Some(together) = median(trusted.iter().map(|&c| bend(c))) else {
            return;
        };
        if trusted.len() < 3 {
            return;
        }
        for c in trusted {
            let noisy = noise[c] * noise[c] * left;
            let walked = self.variance(c) * STRETCH_S;
            let most = MOST * MOST * (walked + noisy);
            let square = (bend(c) - factors[c] * together).powi(2).min(most);
            // χ² of one degree of freedom of all of it: the more of it is noise, the less it tells.
            let weight = (walked / (walked + noisy)).powi(2);
            if weight.is_finite() && square.is_finite() {
                let kept = 1.0 - REMEMBERED.recip();
                self.squares[c] = kept * self.squares[c] + weight * (square - noisy) / STRETCH_S;
                self.weight[c] = kept * self.weight[c] + weight;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::draw::normal;

    const CHANNELS: usize = 8;

    /// What is told of blocks of ten samples of 1 µε at 100 Hz, of channels that walk by so much and drift by 2 µε/s times 0.9 to 1.1;
    /// the first one stands still, and is off by `leaps` for a second after 30 s.
    fn found(walk: f64, leaps: f64, is_seen: bool) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let (mut steps, mut rest) = (Steps::new(CHANNELS), [0.0; CHANNELS]);
        for k in 1..=1200 {
            let mut read = [0.0; CHANNELS];
            for (c, rest) in rest.iter_mut().enumerate() {
                let uneven = 0.9 + 0.2 * c as f64 / (CHANNELS - 1) as f64;
                let own = if c == 0 { 0.0 } else { walk };
                *rest += 2e-7 * uneven + own * 0.1_f64.sqrt() * normal(&mut rng);
                read[c] = *rest + 1e-6 / 10_f64.sqrt() * normal(&mut rng);
            }
            let is_off = (300..310).contains(&k);
            read[0] += if is_off { leaps } else { 0.0 };
            let mut used = [true; CHANNELS];
            used[0] = !(is_off && is_seen);
            let now_s = 0.1 * f64::from(k);
            steps.rested(
                (&read, 10.0, now_s),
                &[1e-6; CHANNELS],
                &used,
                &[1.0; CHANNELS],
            );
        }
        (0..CHANNELS).map(|c| steps.variance(c).sqrt()).collect()
    }

    fn rms(steps: &[f64]) -> f64 {
        (steps.iter().map(|q| q * q).sum::<f64>() / steps.len() as f64).sqrt()
    }

    #[test]
    fn a_walk_is_told_from_an_uneven_drift() {
        for (walk, range) in [
            (0.0, 0.0..0.06e-6),
            (0.1e-6, 0.06e-6..0.15e-6),
            (1e-6, 0.7e-6..1.3e-6),
        ] {
            let steps = found(walk, 0.0, false);
            assert!(range.contains(&rms(&steps[1..])), "{walk}: {steps:?}");
            // One that stands still among others that walk.
            assert!(steps[0] < 0.06e-6 + 0.5 * walk, "{walk}: {steps:?}");
        }
    }

    #[test]
    fn a_channel_that_was_left_out_or_leapt_once_is_no_walker() {
        let still = found(0.0, 0.0, false);
        let left_out = found(0.0, 1000e-6, true);
        assert!(left_out.iter().all(|q| *q < 0.1e-6), "{left_out:?}");
        let leapt = found(0.0, 5e-6, false);
        assert!(leapt[0] < 0.5e-6, "{leapt:?}");
        assert!(
            rms(&leapt[1..]) < 1.5 * rms(&still[1..]),
            "{leapt:?} {still:?}"
        );
    }

    #[test]
    fn nothing_is_told_across_a_touch() {
        let mut steps = Steps::new(3);
        let mut now_s = 0.0;
        for jump in [0.0, 50e-6, -30e-6] {
            // Never three stretches in a row.
            for _ in 0..80 {
                now_s += 0.1;
                steps.rested(
                    (&[jump, 0.0, 0.0], 10.0, now_s),
                    &[1e-6; 3],
                    &[true; 3],
                    &[1.0; 3],
                );
            }
            steps.interrupted();
        }
        assert!((steps.variance(0).sqrt() - USUAL).abs() < 1e-12);
    }
}
