//! What is read of the touches that are shown, while no other comes to them: all of it the same but for its size.

use crate::inference::{Matching, SeveralTouches, TouchesBefore};
use crate::statistics::chi_squared_bound;
use crate::units;

/// Seconds that are averaged over.
const OVER_S: f64 = 0.1;
/// Samples, and seconds, from which on it is known.
const LEAST: u32 = 4;
const LEAST_S: f64 = 0.02;
/// Seconds for which it is known after something else was read; it may be another touch that comes slowly.
const HELD_S: f64 = 0.5;
/// Deviations of χ² by which something else is read, and the share of a reading by which nobody presses evenly.
const OFF: f64 = 4.0;
const UNEVEN: f64 = 3e-3;
/// As likely as that it has to be that there are so many.
const LIKELY: f64 = 0.5;

/// The mean of what is read.
#[derive(Default)]
pub(super) struct Lately {
    touches: Option<SeveralTouches>,
    /// Sum of the readings (strain), the variance of noise in it over that of one, and the last reading over the sum.
    sum: Vec<f64>,
    variance: f64,
    size: f64,
    samples: u32,
    begun_us: u64,
    last_us: u64,
    /// When something else was read first, while it is.
    left_us: Option<u64>,
}

impl Lately {
    /// Nothing touches.
    pub fn forget(&mut self) {
        (self.touches, self.left_us) = (None, None);
    }

    /// A sample (strain), and the touches that are shown with it.
    pub fn see(
        &mut self,
        matching: &Matching,
        time_us: u64,
        strain: &[f64],
        touches: &SeveralTouches,
    ) {
        let same = self.touches.as_ref().is_some_and(|t| t.alike(touches));
        if !same {
            self.begin(time_us, strain, touches);
            return;
        }
        let (size, is_off) = self.against(matching, strain);
        if is_off {
            let left_us = *self.left_us.get_or_insert(time_us);
            if units::seconds_between(left_us, time_us) > HELD_S {
                self.begin(time_us, strain, touches);
            }
            return;
        }
        self.left_us = None;
        let passed = units::seconds_between(self.last_us, time_us);
        let stays = (1.0 - passed / OVER_S).max(0.0);
        for (sum, x) in self.sum.iter_mut().zip(strain) {
            *sum = stays * *sum + x;
        }
        self.variance = stays * stays * self.variance + 1.0;
        // As hard as the last one was.
        self.size = size / (stays + size);
        (self.samples, self.last_us) = (self.samples.saturating_add(1), time_us);
        self.touches = Some(touches.clone());
    }

    /// Seconds for which something else has been read.
    pub fn left_s(&self, time_us: u64) -> Option<f64> {
        let left = self.left_us?;
        Some(units::seconds_between(left, time_us))
    }

    fn begin(&mut self, time_us: u64, strain: &[f64], touches: &SeveralTouches) {
        *self = Self {
            touches: Some(touches.clone()),
            sum: strain.to_vec(),
            variance: 1.0,
            size: 1.0,
            samples: 1,
            begun_us: time_us,
            last_us: time_us,
            left_us: None,
        };
    }

    /// A reading over the sum, and whether it is another one.
    fn against(&self, matching: &Matching, strain: &[f64]) -> (f64, bool) {
        let trusted = || {
            let pairs = strain.iter().zip(&self.sum).zip(&matching.errors.noise);
            let used = pairs.zip(&matching.used).filter(|(_, used)| **used);
            used.map(|(((x, y), noise), _)| (*x, *y, noise.hypot(UNEVEN * x)))
        };
        let product: f64 = trusted().map(|(x, y, n)| x * y / (n * n)).sum();
        let squares: f64 = trusted().map(|(_, y, n)| (y / n).powi(2)).sum();
        let size = product / squares;
        let variance = 1.0 + size * size * self.variance;
        let off: f64 = trusted()
            .map(|(x, y, n)| ((x - size * y) / n).powi(2))
            .sum();
        let count = trusted().count() as f64;
        let is_off = off > variance * chi_squared_bound(count, OFF);
        (size, is_off || size.is_nan() || size <= 0.0)
    }

    /// The touches, and what was read of them, where something else is read now.
    pub fn before(&self, matching: &Matching) -> Option<TouchesBefore> {
        let passed = units::seconds_between(self.begun_us, self.last_us);
        let is_known = self.left_us.is_some() && self.samples >= LEAST && passed >= LEAST_S;
        let touches = self
            .touches
            .as_ref()
            .filter(|t| t.probability >= LIKELY && is_known)?;
        let reading: Vec<f64> = self.sum.iter().map(|sum| self.size * sum).collect();
        matching.before(touches, &reading)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::plate::{CHANNELS, gauged_plate, read_touches};

    const STEP_US: u64 = 5_000;
    const FORCE: f64 = 10.0;

    struct Bench {
        matching: Matching,
        lately: Lately,
        time_us: u64,
    }

    impl Bench {
        fn new() -> Self {
            let errors = ReadingErrors::of_noise(1e-6, CHANNELS);
            Self {
                matching: Matching::new(Arc::new(gauged_plate()), errors, 60.0),
                lately: Lately::default(),
                time_us: 1_000_000,
            }
        }

        /// Samples of touches, taken for one; whether it is known after them what touched before.
        fn read(&mut self, touches: &[(usize, f64)], samples: u32) -> Option<TouchesBefore> {
            let reading = read_touches(&self.matching.map, touches);
            let one = SeveralTouches::one(self.matching.find(&reading), 1.0);
            for _ in 0..samples {
                self.time_us += STEP_US;
                (self.lately).see(&self.matching, self.time_us, &reading, &one);
            }
            self.lately.before(&self.matching)
        }
    }

    #[test]
    fn what_was_read_is_known_once_something_else_is_and_for_a_while() {
        let mut bench = Bench::new();
        // While it becomes harder it is the same.
        for k in 1..=10 {
            assert!(
                bench
                    .read(&[(370, 0.1 * f64::from(k) * FORCE)], 1)
                    .is_none()
            );
        }
        let both = [(370, FORCE), (612, 4.0)];
        let before = bench.read(&both, 1).unwrap();
        let read = read_touches(&bench.matching.map, &[(370, FORCE)]);
        assert!(before.reads_about(&read), "{before:?}");
        assert!(bench.read(&both, 90).is_some());
        // Later that is how it is.
        assert!(bench.read(&both, 20).is_none());
    }

    #[test]
    fn what_comes_back_is_the_same() {
        let mut bench = Bench::new();
        bench.read(&[(370, FORCE)], 20);
        assert!(bench.read(&[(375, FORCE)], 1).is_some());
        assert!(bench.read(&[(370, FORCE)], 1).is_none());
    }

    #[test]
    fn a_moment_or_a_doubt_is_not_enough() {
        let mut bench = Bench::new();
        bench.read(&[(370, FORCE)], 3);
        assert!(bench.read(&[(375, FORCE)], 1).is_none());
        let reading = read_touches(&bench.matching.map, &[(370, FORCE)]);
        let doubted = SeveralTouches::one(bench.matching.find(&reading), 0.4);
        bench.lately.forget();
        for k in 0..20 {
            (bench.lately).see(&bench.matching, k * STEP_US, &reading, &doubted);
        }
        assert!(bench.read(&[(375, FORCE)], 1).is_none());
    }
}
