//! What has been a touch for long is no rest that is off. Something that lets go shows at once, and by all that it read; a
//! touch that stands is looked at a thousand times, and what its model lacks may make it look like a pull now and then.

use super::standing::squares_off;
use crate::inference::Matching;

/// Seconds after which a touch is one.
const LONG_S: f64 = 5.0;
/// Share of its size by which a reading is another one: more than a hand makes that trembles or rolls.
const OTHER: f64 = 0.5;
/// Seconds within which the level follows what is read: a drift makes no other reading of it.
const FOLLOWS_S: f64 = 5.0;

/// What is read, and for how long that has been a touch.
#[derive(Clone, Debug, Default)]
pub(super) struct LongTouch {
    /// Strain of every channel.
    level: Vec<f64>,
    lasted_s: f64,
}

impl LongTouch {
    /// Takes in a reading (strain) some seconds after the one before, in which a touch is found or none.
    pub fn take(&mut self, matching: &Matching, strain: &[f64], (is_found, step_s): (bool, f64)) {
        if self.is_another(matching, strain) {
            (self.level, self.lasted_s) = (strain.to_vec(), 0.0);
            return;
        }
        let share = (step_s / FOLLOWS_S).min(1.0);
        for (level, x) in self.level.iter_mut().zip(strain) {
            *level += share * (x - *level);
        }
        self.lasted_s += if is_found { step_s } else { 0.0 };
    }

    /// Whether a reading is of what has been a touch for long.
    pub fn is_on(&self, matching: &Matching, strain: &[f64]) -> bool {
        self.lasted_s >= LONG_S && !self.is_another(matching, strain)
    }

    fn is_another(&self, matching: &Matching, strain: &[f64]) -> bool {
        let size = |x: &[f64], from: &[f64]| squares_off(matching, x, from).sum::<f64>();
        let nothing = vec![0.0; strain.len()];
        self.level.is_empty()
            || size(strain, &self.level) > OTHER * OTHER * size(&self.level, &nothing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::matching::tests::{CHANNELS, maps};

    #[test]
    fn what_has_long_been_a_touch_is_one_until_it_reads_otherwise() {
        let [map, _] = maps();
        let newton = map.values()[CHANNELS..2 * CHANNELS].to_vec();
        let matching = Matching::new(map, ReadingErrors::of_noise(1e-7, CHANNELS), 60.0);
        let of = |force: f64| newton.iter().map(|g| force * g).collect::<Vec<f64>>();
        let mut long = LongTouch::default();
        let mut take = |force: f64, is_found: bool, seconds: usize| {
            for _ in 0..10 * seconds {
                long.take(&matching, &of(force), (is_found, 0.1));
            }
            long.is_on(&matching, &of(force))
        };
        assert!(!take(8.0, true, 4));
        // What nothing explains is no touch yet.
        assert!(!take(8.0, false, 60));
        assert!(take(8.0, true, 10));
        // A hand that presses less, and one that lets go.
        assert!(take(6.0, true, 1));
        assert!(!long.is_on(&matching, &of(-8.0)));
        assert!(!long.is_on(&matching, &of(2.0)));
    }
}
