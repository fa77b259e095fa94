//! How much channels tremble at rest: off the mean of what they have just read, and not off what the rest is thought to
//! be. Where that is wrong, or a touch is too light to be felt, all readings are off by the same, which is no noise.

/// Seconds that the mean goes over: a mains hum is noise, and a drift is not.
const OVER_S: f64 = 0.1;
/// A sample tells at most of so many standard deviations: what begins or ends between two samples is no noise.
const MOST: f64 = 4.0;

/// The mean of what was read since the last touch.
#[derive(Default)]
pub(super) struct Tremble {
    mean: Vec<f64>,
    seconds: f64,
}

impl Tremble {
    /// Takes in a sample at rest, some seconds after the one before, and the noise of each channel as it was known (all in
    /// one unit). What each channel is off by noise alone, once there is a mean to be off from.
    pub fn off(&mut self, sample: &[f64], noise: &[f64], step_s: f64) -> Option<Vec<f64>> {
        if self.mean.len() != sample.len() {
            *self = Self {
                mean: sample.to_vec(),
                seconds: 0.0,
            };
            return None;
        }
        self.seconds += step_s;
        let share = (step_s / OVER_S.min(self.seconds)).clamp(0.0, 1.0);
        // A mean of few samples trembles too: of white noise, its own variance comes to that of the sample.
        let own = ((2.0 - share) / 2.0).sqrt();
        let mut off = Vec::with_capacity(sample.len());
        for ((mean, x), noise) in self.mean.iter_mut().zip(sample).zip(noise) {
            off.push((own * (x - *mean)).clamp(-MOST * noise, MOST * noise));
            *mean += share * (x - *mean);
        }
        (self.seconds >= OVER_S).then_some(off)
    }

    /// Something touches.
    pub fn forget(&mut self) {
        self.mean.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White noise of variance one, more or less (splitmix64).
    fn noise(k: u32) -> f64 {
        let even = |j: u64| {
            let mut z = (12 * u64::from(k) + j + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 40) as f64 / f64::from(1 << 24)
        };
        (0..12).map(even).sum::<f64>() - 6.0
    }

    fn variance(rate: f64, of: impl Fn(u32) -> f64) -> f64 {
        let mut tremble = Tremble::default();
        let offs = (0..20_000).filter_map(|k| tremble.off(&[of(k)], &[1.0], 1.0 / rate));
        let squares: Vec<f64> = offs.map(|off| off[0] * off[0]).collect();
        squares.iter().sum::<f64>() / squares.len() as f64
    }

    #[test]
    fn what_stays_is_no_noise_at_any_rate() {
        for rate in [10.0, 100.0, 1000.0, 4000.0] {
            let white = variance(rate, noise);
            assert!((0.9..1.1).contains(&white), "{rate} Hz: {white}");
            let off = variance(rate, |k| noise(k) + 30.0);
            assert!((off - white).abs() < 0.01, "{rate} Hz: {off}");
        }
        // Drift of a hundred deviations a second, and one jump of a thousand.
        let drift = variance(1000.0, |k| noise(k) + 0.01 * f64::from(k));
        assert!((0.9..2.2).contains(&drift), "{drift}");
        let jump = variance(1000.0, |k| noise(k) + if k > 9000 { 1000.0 } else { 0.0 });
        assert!((0.9..1.6).contains(&jump), "{jump}");
    }

    #[test]
    fn hum_is_noise() {
        let wave = |k: u32| (f64::from(k) * 0.05 * std::f64::consts::TAU).sin();
        let hum = variance(1000.0, wave);
        assert!((0.45..0.6).contains(&hum), "{hum}");
    }
}
