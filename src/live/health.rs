//! Which channels can be trusted.

use serde::Serialize;

/// How a channel is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Health {
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
    last: [f64; 2],
    seen: u64,
    /// Samples in a row with the very same value.
    same: u64,
    /// Samples since one was at an end of the range.
    off_scale: Option<u64>,
    /// Running mean of squared second differences over six: the variance of white noise.
    tremble: f64,
    /// Looks in a row in which a touch that it should have felt left no trace.
    silent: u32,
    dead: bool,
}

/// What a channel is held against.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Ends of the converter's range.
    pub lowest: f64,
    pub highest: f64,
    /// Noise at rest (counts) of this channel, and what is usual.
    pub own_noise: f64,
    pub usual_noise: f64,
    /// Samples a second.
    pub rate: f64,
}

/// Seconds of the same value that are no chance, of holding an off-scale mark, and of the running mean.
const STUCK_S: f64 = 0.4;
const HOLD_S: f64 = 0.3;
const TREMBLE_S: f64 = 0.2;
/// Noise at rest (counts) from which a channel cannot stay at one value.
const TREMBLES: f64 = 0.35;
/// Times the usual noise.
const NOISY: f64 = 6.0;
/// Looks in a row.
const SILENT: u32 = 6;

impl Watcher {
    pub fn push(&mut self, count: f64, expected: &Expected) {
        let [a, b] = self.last;
        self.same = if self.seen > 0 && count == b {
            self.same + 1
        } else {
            0
        };
        if self.seen >= 2 {
            let second = (count - 2.0 * b + a).powi(2) / 6.0;
            // A single jump is a touch or a glitch, no noise.
            let second = second.min(100.0 * (self.tremble + expected.usual_noise.powi(2) + 1.0));
            self.tremble += (second - self.tremble) / (TREMBLE_S * expected.rate).max(1.0);
        }
        let at_end = count <= expected.lowest || count >= expected.highest;
        self.off_scale = if at_end {
            Some(0)
        } else {
            self.off_scale.map(|n| n + 1)
        };
        self.last = [b, count];
        self.seen += 1;
    }

    /// One look at a touch: whether this channel should have felt it, and whether it did.
    pub fn look(&mut self, should: bool, did: bool) {
        match (should, did) {
            (true, false) => self.silent += 1,
            (true, true) => (self.silent, self.dead) = (0, false),
            (false, _) => {}
        }
        self.dead |= self.silent >= SILENT;
    }

    #[must_use]
    pub fn is_dead(&self) -> bool {
        self.dead
    }

    /// It is known to be dead.
    pub fn mark_dead(&mut self) {
        (self.dead, self.silent) = (true, SILENT);
    }

    #[must_use]
    pub fn health(&self, expected: &Expected) -> Health {
        let within = |samples: u64, seconds: f64| (samples as f64) < seconds * expected.rate;
        if self.off_scale.is_some_and(|n| n == 0 || within(n, HOLD_S)) {
            Health::OffScale
        } else if expected.own_noise > TREMBLES && !within(self.same, STUCK_S) {
            Health::Stuck
        } else if self.tremble.sqrt() > NOISY * expected.usual_noise.max(0.5) {
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

    const EXPECTED: Expected = Expected {
        lowest: 0.0,
        highest: 4095.0,
        own_noise: 1.5,
        usual_noise: 1.5,
        rate: 1000.0,
    };

    fn after(values: impl Iterator<Item = f64>) -> Health {
        let mut watcher = Watcher::default();
        for v in values {
            watcher.push(v, &EXPECTED);
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

    #[test]
    fn a_channel_that_feels_nothing_is_dead_until_it_feels_again() {
        let mut watcher = Watcher::default();
        for _ in 0..10 {
            watcher.look(false, false);
        }
        assert!(watcher.health(&EXPECTED).is_good());
        for _ in 0..6 {
            watcher.look(true, false);
        }
        assert_eq!(watcher.health(&EXPECTED), Health::Dead);
        watcher.look(true, true);
        assert!(watcher.health(&EXPECTED).is_good());
    }
}
