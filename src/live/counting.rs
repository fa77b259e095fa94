//! How many touches there are, over time: two looks that say the same are believed, and in between all touches are followed
//! together.

use super::lately::Lately;
use crate::inference::{Contact, Matching, Several, SeveralTouches, TouchesBefore, TouchesBeside};
use crate::statistics::chi_squared_bound;
use crate::units;

/// Seconds between looks: while what is shown is what was seen, and while it is not. Of several that were seen again and again
/// up to so many: to look at them costs thirty times what it costs to look at one, and what comes or goes unsettles them.
const SETTLED_S: f64 = 0.2;
const LONG_SETTLED_S: f64 = 0.8;
const UNSETTLED_S: f64 = 0.05;
/// Seconds after which there is something to see of another that comes.
const SOON_S: f64 = 0.02;
/// What is shown is given up when it is less likely than this in so many looks in a row.
const DOUBTED: f64 = 0.1;
const LOOKS: u32 = 2;
/// A touch that is as likely the only one proves gauges.
const PROVED: f64 = 0.95;

/// Of the weighted squares that the last look left over: by so much more, and beyond so many deviations of χ², something
/// else has come to touch, or has gone.
const MORE: f64 = 1.5;
const BEYOND: f64 = 4.0;
/// Times the weighted squares of what nothing explained, from which on something else has come.
const GROWN: f64 = 2.0;

/// What is shown, and what may have to be.
pub(super) struct Counting {
    /// Where several are searched for.
    pub several: Several,
    /// Touches that are more than one point; absent while there is one.
    shown: Option<SeveralTouches>,
    /// What they are followed by, where it is known what touched before one of them came.
    beside: Option<TouchesBeside>,
    lately: Lately,
    /// Looks in a row that doubted it.
    doubted: u32,
    last_look: Option<u64>,
    /// Seconds until the next, while it is settled.
    settled_s: f64,
    sure_of_one: f64,
    /// Weighted squares up to which a sample is of what the last look saw.
    usual: f64,
    /// Weighted squares of the reading at the last look.
    felt: f64,
}

/// Weighted squares of a reading (strain) over the channels that are trusted.
fn squares(matching: &Matching, strain: &[f64]) -> f64 {
    let pairs = strain.iter().zip(&matching.errors.noise);
    let trusted = pairs.zip(&matching.used).filter(|(_, used)| **used);
    trusted.map(|((x, noise), _)| (x / noise).powi(2)).sum()
}

impl Counting {
    /// One touch, until more are seen.
    pub fn new(matching: &Matching) -> Self {
        Self {
            several: Several::new(matching),
            shown: None,
            beside: None,
            lately: Lately::default(),
            doubted: 0,
            last_look: None,
            settled_s: SETTLED_S,
            sure_of_one: 1.0,
            usual: 0.0,
            felt: 0.0,
        }
    }

    /// As if nothing had been seen before.
    pub fn begin_anew(&mut self) {
        self.end();
        self.several.forget();
    }

    /// Nothing touches any more, or something else does.
    pub fn end(&mut self) {
        (self.shown, self.beside, self.last_look) = (None, None, None);
        self.lately.forget();
        (self.doubted, self.usual, self.settled_s) = (0, 0.0, SETTLED_S);
    }

    /// The touches that go on, where they are more than one point, and whether they explain this sample (strain).
    pub fn track(
        &mut self,
        matching: &Matching,
        time_us: u64,
        strain: &[f64],
    ) -> Option<(SeveralTouches, bool)> {
        let shown = self.shown.as_ref()?;
        if shown.contacts.is_empty() {
            if squares(matching, strain) > GROWN * self.felt {
                self.end();
                return None;
            }
            return Some((shown.clone(), false));
        }
        let tracked = match &mut self.beside {
            Some(beside) => matching.track_beside(strain, beside, shown),
            None => matching.track_several(strain, shown),
        };
        let explained = tracked.is_some();
        if let Some(tracked) = tracked {
            let unexplained = shown.unexplained;
            // As far as the last look went: what is off little by little is off.
            self.shown = Some(SeveralTouches {
                unexplained,
                ..tracked
            });
        }
        let shown = self.shown.as_ref()?;
        self.lately.see(matching, time_us, strain, shown);
        Some((shown.clone(), explained))
    }

    /// One touch goes on.
    pub fn see_one(&mut self, matching: &Matching, time_us: u64, strain: &[f64], one: &Contact) {
        if self.shown.is_none() {
            let one = self.one(*one);
            self.lately.see(matching, time_us, strain, &one);
        }
    }

    /// The touches that were seen last, where they are more than one point.
    pub fn shown(&self) -> Option<&SeveralTouches> {
        self.shown.as_ref()
    }

    /// One touch, as sure as the last look was of that.
    pub fn one(&self, contact: Contact) -> SeveralTouches {
        SeveralTouches::one(contact, self.sure_of_one)
    }

    /// Whether touches that leave so much unexplained are what the last look saw.
    pub fn is_settled(&self, unexplained: f64) -> bool {
        self.doubted == 0 && unexplained <= self.usual
    }

    /// Whether it is time to look again at touches that leave so much unexplained.
    pub fn is_due(&self, time_us: u64, unexplained: f64) -> bool {
        let changing = SOON_S..SETTLED_S;
        let changes = (self.lately.left_s(time_us)).is_some_and(|s| changing.contains(&s));
        let wait = if self.is_settled(unexplained) && !changes {
            self.settled_s
        } else {
            UNSETTLED_S
        };
        let since = |last: u64| units::seconds_between(last, time_us);
        self.last_look.is_none_or(|last| since(last) >= wait)
    }

    /// Looks how many there are, where `one` is what was found where only one is looked for.
    pub fn look(&mut self, matching: &mut Matching, time_us: u64, strain: &[f64], one: &Contact) {
        (self.last_look, self.felt) = (Some(time_us), squares(matching, strain));
        let (seen, beside) = self.count(matching, strain, one);
        let channels = matching.used.iter().filter(|u| **u).count() as f64;
        let noise = chi_squared_bound(channels, BEYOND);
        self.usual = MORE * seen.unexplained + noise;
        let point = SeveralTouches::one(*one, 1.0);
        // Not where it is one because a gauge is odd.
        let explained = one.unexplained < noise;
        let surely_one = seen.alike(&point) && seen.probability > PROVED;
        if surely_one && explained && self.shown.is_none() {
            self.several.learn(matching, strain, one);
        }
        let shown = self.shown.as_ref().unwrap_or(&point);
        let again = self.shown.is_some() && seen.alike(shown);
        self.settled_s = if again {
            (2.0 * self.settled_s).min(LONG_SETTLED_S)
        } else {
            SETTLED_S
        };
        let share = seen.share_of(shown);
        self.doubted = if share < DOUBTED { self.doubted + 1 } else { 0 };
        if seen.alike(shown) || self.doubted >= LOOKS {
            self.doubted = 0;
            self.sure_of_one = seen.probability;
            self.shown = (!seen.alike(&point)).then_some(seen);
            self.beside = beside;
        } else if let Some(shown) = &mut self.shown {
            shown.probability = share;
        } else {
            self.sure_of_one = share;
        }
    }

    /// How many there are, by what touched before and by itself.
    fn count(
        &self,
        matching: &mut Matching,
        strain: &[f64],
        one: &Contact,
    ) -> (SeveralTouches, Option<TouchesBeside>) {
        let lately = self.lately.before(matching);
        let earlier = self.beside.as_ref().map(TouchesBeside::before);
        let before: Vec<&TouchesBefore> = earlier.into_iter().chain(&lately).collect();
        matching.count_after(&self.several, strain, one, &before)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::plate::{CHANNELS, gauged_plate, read_touches};

    const STEP_US: u64 = 5_000;
    const TWO: [(usize, f64); 2] = [(95, 8.0), (610, 12.0)];

    /// Times of looks (s) at a reading that stands for so long, as the pipeline asks for them.
    fn looks(
        counting: &mut Counting,
        matching: &mut Matching,
        reading: &[f64],
        times: std::ops::Range<u64>,
    ) -> Vec<f64> {
        let mut at = Vec::new();
        for time_us in times.step_by(STEP_US as usize) {
            let left = match counting.track(matching, time_us, reading) {
                Some((touches, true)) => touches.unexplained,
                Some((_, false)) => f64::INFINITY,
                None => matching.find(reading).unexplained,
            };
            if counting.is_due(time_us, left) {
                let one = matching.find(reading);
                counting.look(matching, time_us, reading, &one);
                at.push(1e-6 * time_us as f64);
            }
        }
        at
    }

    #[test]
    fn two_that_stand_are_looked_at_ever_less_and_a_third_at_once() {
        let map = Arc::new(gauged_plate());
        let errors = ReadingErrors::of_noise(1e-6, CHANNELS);
        let mut matching = Matching::new(Arc::clone(&map), errors, 60.0);
        let mut counting = Counting::new(&matching);
        let two = read_touches(&map, &TWO);
        let at = looks(&mut counting, &mut matching, &two, 0..5_000_000);
        assert_eq!(counting.shown().and_then(SeveralTouches::count), Some(2));
        let last = at.windows(2).last().map(|w| w[1] - w[0]);
        assert!(at.len() < 11 && at[1] < 0.1, "{at:?}");
        assert!(
            last.is_some_and(|s| (s - LONG_SETTLED_S).abs() < 0.01),
            "{at:?}"
        );
        let three = read_touches(&map, &[TWO[0], TWO[1], (772, 9.0)]);
        let begun = 5_100_000;
        let at = looks(&mut counting, &mut matching, &three, begun..begun + 300_000);
        let passed = at[0] - 1e-6 * begun as f64;
        assert!(passed < UNSETTLED_S, "{at:?}");
        assert_ne!(counting.shown().and_then(SeveralTouches::count), Some(2));
    }
}
