//! Which channels can be trusted.

use serde::Serialize;

/// How a channel is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Health {
    /// Nothing is wrong.
    #[default]
    Good,
    /// At the end of the converter's range: bridge, wiring or too hard a touch.
    OffScale,
    /// The same value again and again, where there ought to be noise.
    Stuck,
    /// Far noisier than the others.
    Noisy,
    /// Touches that it should feel leave no trace.
    Dead,
}

impl Health {
    /// Whether it can be trusted.
    #[must_use]
    pub fn is_good(self) -> bool {
        self == Self::Good
    }

    /// For people.
    #[must_use]
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::OffScale => "off-scale",
            Self::Stuck => "stuck",
            Self::Noisy => "noisy",
            Self::Dead => "dead",
        }
    }
}

/// Watches one channel's counts.
#[derive(Clone, Debug, Default)]
pub struct Watcher {
    seen: bool,
    last: f64,
    /// The last two without what hums, as far as that is known of them.
    steady: [Option<f64>; 2],
    /// Samples in a row with the very same value.
    same: u64,
    /// Samples since one was at an end of the range.
    off_scale: Option<u64>,
    /// Logarithm of the running median of what second differences say the deviation of white noise is. A median, so
    /// that the samples in which a touch begins or ends are no noise, however steep it is.
    tremble: f64,
    /// How much likelier it is dead than well, as the touches say that it should have felt since it last felt one:
    /// natural logarithm.
    silence: f64,
    dead: bool,
}

/// What a channel is held against.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedSignal {
    /// Ends of the converter's range.
    pub lowest: f64,
    /// Upper end of the converter's range (counts).
    pub highest: f64,
    /// Noise at rest (counts) of this channel, and what is usual.
    pub own_noise: f64,
    /// Usual noise at rest of all channels (counts).
    pub usual_noise: f64,
    /// Samples a second.
    pub rate: f64,
}

/// Seconds of the same value that are no chance, of holding an off-scale mark, and in which the running median may
/// rise or fall by a factor of e.
const STUCK_S: f64 = 0.4;
const HOLD_S: f64 = 0.3;
const TREMBLE_S: f64 = 0.25;
/// Median of the absolute value of a normal variable over its deviation.
pub(super) const MEDIAN_OF_NORMAL: f64 = 0.6745;
/// Noise at rest (counts) from which a channel cannot stay at one value.
const TREMBLES: f64 = 0.35;
/// Times the usual noise.
const NOISY: f64 = 6.0;
/// A channel is dead from here on: the sum of what single looks say (E. S. Page, Biometrika 41, 1954), of which none
/// says more than this. However clear one touch is, the model may be off there.
const SILENT: f64 = 24.0;
const MOST_OF_A_LOOK: f64 = 4.0;

impl Watcher {
    /// Looks at one more sample, of which so much is hum; nothing where that is not known, and what trembles not either.
    pub fn push(&mut self, count: f64, hum: Option<f64>, expected: &ExpectedSignal) {
        self.same = if self.seen && count == self.last {
            self.same + 1
        } else {
            0
        };
        let steady = hum.map(|hum| count - hum);
        if let ([Some(a), Some(b)], Some(c)) = (self.steady, steady) {
            let second = (c - 2.0 * b + a).abs() / 6.0_f64.sqrt() / MEDIAN_OF_NORMAL;
            let step = (TREMBLE_S * expected.rate).max(2.0).recip();
            let up = second > self.tremble.exp();
            // Between far less than counts can show and far more than a converter has.
            self.tremble = (self.tremble + if up { step } else { -step }).clamp(-3.0, 25.0);
        }
        let at_end = count <= expected.lowest || count >= expected.highest;
        self.off_scale = if at_end {
            Some(0)
        } else {
            self.off_scale.map(|n| n + 1)
        };
        (self.seen, self.last) = (true, count);
        self.steady = [self.steady[1], steady];
    }

    /// One look at a touch that it felt.
    pub fn felt(&mut self) {
        (self.silence, self.dead) = (0.0, false);
    }

    /// One look at a touch that left no trace although it should have: how much likelier that is where the channel is
    /// dead than where it is well (natural logarithm).
    pub fn silent(&mut self, likelier: f64) {
        let likelier = likelier.clamp(-MOST_OF_A_LOOK, MOST_OF_A_LOOK);
        self.silence = (self.silence + likelier).max(0.0);
        self.dead |= self.silence >= SILENT;
    }

    /// Whether touches leave no trace on it.
    #[must_use]
    pub fn is_dead(&self) -> bool {
        self.dead
    }

    /// It is known to be dead.
    pub fn mark_dead(&mut self) {
        (self.dead, self.silence) = (true, SILENT);
    }

    /// What is to be thought of it now.
    #[must_use]
    pub fn health(&self, expected: &ExpectedSignal) -> Health {
        let within = |samples: u64, seconds: f64| (samples as f64) < seconds * expected.rate;
        if self.off_scale.is_some_and(|n| n == 0 || within(n, HOLD_S)) {
            Health::OffScale
        } else if expected.own_noise > TREMBLES && !within(self.same, STUCK_S) {
            Health::Stuck
        } else if self.tremble.exp() > NOISY * expected.usual_noise.max(0.5) {
            Health::Noisy
        } else if self.dead {
            Health::Dead
        } else {
            Health::Good
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: ExpectedSignal = ExpectedSignal {
        lowest: 0.0,
        highest: 4095.0,
        own_noise: 1.5,
        usual_noise: 1.5,
        rate: 1000.0,
    };

    fn after(values: impl Iterator<Item = f64>) -> Health {
        let mut watcher = Watcher::default();
        for v in values {
            watcher.push(v, Some(0.0), &EXPECTED);
        }
        watcher.health(&EXPECTED)
    }

    fn noise(k: u32) -> f64 {
        f64::from((k * 7919 + k * k * 31) % 7) - 3.0
    }

    #[test]
    fn each_illness_is_told_and_a_touch_is_none() {
        let rest = |k: u32| 2000.0 + noise(k);
        assert_eq!(after((0..2000).map(rest)), Health::Good);
        let touch = |k: u32| rest(k) + if k > 500 { 800.0 } else { 0.0 };
        assert_eq!(after((0..2000).map(touch)), Health::Good);
        let stuck = |k: u32| if k > 1000 { 2001.0 } else { rest(k) };
        assert_eq!(after((0..1300).map(stuck)), Health::Good);
        assert_eq!(after((0..1450).map(stuck)), Health::Stuck);
        assert_eq!(
            after((0..1000).map(|k| rest(k) + 20.0 * noise(k + 9))),
            Health::Noisy
        );
        let rail = |k: u32| if k == 990 { 4095.0 } else { rest(k) };
        assert_eq!(after((0..1000).map(rail)), Health::OffScale);
        assert_eq!(after((0..1400).map(rail)), Health::Good);
    }

    /// Fingers that drum, at the rates of the slowest and the quickest boards, are no noise; and noise is told within a
    /// second.
    #[test]
    fn steep_touches_are_no_noise_at_any_rate() {
        for rate in [100.0, 1000.0, 4000.0] {
            let expected = ExpectedSignal { rate, ..EXPECTED };
            for ramp_s in [0.002, 0.01, 0.08] {
                let mut watcher = Watcher::default();
                for k in 0..(5.0 * rate) as u32 {
                    let into = (f64::from(k) / rate) % 0.5;
                    let pressed = (into / ramp_s).min((0.4 - into) / ramp_s).clamp(0.0, 1.0);
                    let pressed = pressed * pressed * (3.0 - 2.0 * pressed);
                    let count = 2000.0 + noise(k % 997) + 1500.0 * pressed;
                    watcher.push(count, Some(0.0), &expected);
                    assert!(
                        watcher.health(&expected).is_good(),
                        "{rate} Hz {ramp_s} s {k}"
                    );
                }
                for k in 0..rate as u32 {
                    watcher.push(2000.0 + 20.0 * noise(k % 997), Some(0.0), &expected);
                }
                assert_eq!(
                    watcher.health(&expected),
                    Health::Noisy,
                    "{rate} Hz {ramp_s} s"
                );
            }
        }
    }

    /// Hum is as steep as noise where samples are few, and is none.
    #[test]
    fn what_hums_is_no_noise() {
        let expected = ExpectedSignal {
            rate: 200.0,
            ..EXPECTED
        };
        let hum = |k: u32| 60.0 * (f64::from(k) * 0.25 * std::f64::consts::TAU + 0.3).sin();
        let state = |known: fn(f64) -> Option<f64>| {
            let mut watcher = Watcher::default();
            for k in 0..600 {
                watcher.push(2000.0 + noise(k % 997) + hum(k), known(hum(k)), &expected);
            }
            watcher.health(&expected)
        };
        assert_eq!(state(Some), Health::Good);
        assert_eq!(state(|_| None), Health::Good);
        assert_eq!(state(|_| Some(0.0)), Health::Noisy);
    }

    #[test]
    fn a_channel_that_feels_nothing_is_dead_until_it_feels_again() {
        let mut watcher = Watcher::default();
        // Touches that it may well have left alone.
        for _ in 0..40 {
            watcher.silent(1.0);
            watcher.silent(-1.5);
        }
        assert!(watcher.health(&EXPECTED).is_good());
        for _ in 0..5 {
            watcher.silent(1e9);
        }
        assert!(watcher.health(&EXPECTED).is_good());
        watcher.silent(1e9);
        assert_eq!(watcher.health(&EXPECTED), Health::Dead);
        watcher.felt();
        assert!(watcher.health(&EXPECTED).is_good());
    }
}
