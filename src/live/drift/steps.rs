//! How far each channel walks by itself in a second, q², told at rest.
//!
//! Of a walk of variance q² a second the means x, y, z of three stretches of T seconds one after another have
//! E (x − 2 y + z)² = q² T, to which noise σ adds 6 σ²/m of m samples a stretch. What drifts at a steady speed adds
//! nothing: a channel that drifts more than the others is no channel that walks.

use crate::statistics::mean;

/// Seconds of a stretch.
pub(super) const STRETCH_S: f64 = 4.0;
/// What a channel walks by in a second before it is known (strain), for how many times that counts, and how many times are
/// remembered.
const USUAL: f64 = 0.1e-6;
const USUAL_COUNTS: f64 = 2.0;
const REMEMBERED: f64 = 30.0;

/// What the stretches of rest have told.
pub(super) struct Steps {
    /// Since when samples are added up, their sum (strain) and number.
    since_s: Option<f64>,
    sum: Vec<f64>,
    samples: f64,
    /// Means of the stretches before, the last one first, and how much noise is left in each (1/samples).
    before: Vec<(Vec<f64>, f64)>,
    /// Sum of what was told (strain² a second), each by its weight, and these.
    told: Vec<f64>,
    weight: Vec<f64>,
}

impl Steps {
    /// Of so many channels that nothing is known of.
    pub fn new(channels: usize) -> Self {
        Self {
            since_s: None,
            sum: vec![0.0; channels],
            samples: 0.0,
            before: Vec::new(),
            told: vec![0.0; channels],
            weight: vec![0.0; channels],
        }
    }

    /// q² of a channel (strain² a second).
    pub fn variance(&self, channel: usize) -> f64 {
        let told = self.told[channel] + USUAL_COUNTS * USUAL * USUAL;
        (told / (self.weight[channel] + USUAL_COUNTS)).max(0.0)
    }

    /// Takes the mean (strain) of some samples at rest, at a time, with the noise of one (strain).
    pub fn rested(
        &mut self,
        (read, samples): (&[f64], f64),
        now_s: f64,
        noise: &[f64],
        used: &[bool],
    ) {
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
        self.look_back(noise, used);
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
    fn look_back(&mut self, noise: &[f64], used: &[bool]) {
        let [(z, of_z), (y, of_y), (x, of_x)] = &self.before[..] else {
            return;
        };
        let left = of_x + 4.0 * of_y + of_z;
        let bend = |c: usize| x[c] - 2.0 * y[c] + z[c];
        let trusted: Vec<usize> = (0..noise.len()).filter(|&c| used[c]).collect();
        let count = trusted.len() as f64;
        if count < 2.0 {
            return;
        }
        let together = mean(&trusted.iter().map(|&c| bend(c)).collect::<Vec<_>>());
        let told: Vec<(usize, f64, f64)> = (trusted.into_iter())
            .map(|c| {
                // The mean has taken a share of each with it.
                let square = (bend(c) - together).powi(2) * count / (count - 1.0);
                let noisy = noise[c] * noise[c] * left;
                let walked = self.variance(c) * STRETCH_S;
                // χ² of one degree of freedom of all of it: the more of it is noise, the less it tells.
                let weight = (walked / (walked + noisy)).powi(2);
                (c, (square - noisy) / STRETCH_S, weight)
            })
            .collect();
        for (c, is, weight) in told.into_iter().filter(|(_, _, w)| w.is_finite()) {
            let kept = 1.0 - REMEMBERED.recip();
            self.told[c] = kept * self.told[c] + weight * is;
            self.weight[c] = kept * self.weight[c] + weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::draw::normal;

    /// Blocks of ten samples of 1 µε at 100 Hz, of channels that walk by `walk` and drift by 2 µε/s times 0.9 to 1.1.
    fn told(walk: f64, seconds: f64) -> Vec<f64> {
        const CHANNELS: usize = 8;
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let (mut steps, mut rest) = (Steps::new(CHANNELS), [0.0; CHANNELS]);
        let blocks = (seconds / 0.1).round() as usize;
        for k in 1..=blocks {
            let mut read = [0.0; CHANNELS];
            for (c, rest) in rest.iter_mut().enumerate() {
                let uneven = 0.9 + 0.2 * c as f64 / (CHANNELS - 1) as f64;
                *rest += 2e-7 * uneven + walk * 0.1_f64.sqrt() * normal(&mut rng);
                read[c] = *rest + 1e-6 / 10_f64.sqrt() * normal(&mut rng);
            }
            let now_s = 0.1 * k as f64;
            steps.rested((&read, 10.0), now_s, &[1e-6; CHANNELS], &[true; CHANNELS]);
        }
        (0..CHANNELS).map(|c| steps.variance(c).sqrt()).collect()
    }

    #[test]
    fn a_walk_is_told_from_an_uneven_drift() {
        for (walk, range) in [
            (0.0, 0.0..0.06e-6),
            (0.1e-6, 0.06e-6..0.15e-6),
            (1e-6, 0.7e-6..1.3e-6),
        ] {
            let told = told(walk, 120.0);
            let rms = mean(&told.iter().map(|q| q * q).collect::<Vec<_>>()).sqrt();
            assert!(range.contains(&rms), "{walk}: {rms}, {told:?}");
        }
    }

    #[test]
    fn nothing_is_told_across_a_touch_or_by_noise_alone() {
        let mut steps = Steps::new(2);
        let mut now_s = 0.0;
        for jump in [0.0, 50e-6, -30e-6] {
            // Never three stretches in a row.
            for _ in 0..80 {
                now_s += 0.1;
                steps.rested((&[jump, 0.0], 10.0), now_s, &[1e-6; 2], &[true; 2]);
            }
            steps.interrupted();
        }
        assert!((steps.variance(0).sqrt() - USUAL).abs() < 1e-12);
        for k in 0..1000 {
            now_s += 0.1;
            let read = [20e-6 * f64::from(k % 7 - 3), 0.0];
            steps.rested((&read, 10.0), now_s, &[100e-6; 2], &[true; 2]);
        }
        assert!(steps.variance(0).sqrt() < 2.0 * USUAL);
    }
}
