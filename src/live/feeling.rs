//! Whether anything touches: weighted squares against χ² of the channels, with a few samples of patience.

use crate::statistics::chi_squared_bound;

/// Samples in a row that make or end a touch.
pub(super) const BEGINS: u32 = 3;
const ENDS: u32 = 6;
/// Of the squares that a touch usually has: what is less is hardly the same touch; and the share of a sample in these.
const GONE: f64 = 0.4;
const USUAL: f64 = 0.01;
/// Seconds after which what no touch explains may be what one has left behind. A finger that comes to another is found sooner.
const STRANGE_S: f64 = 0.2;
/// Too few gauges to tell anything: place and force are three numbers.
const FEWEST: f64 = 3.0;
/// Standard deviations of χ² by which a touch is above what it has on the mean, when it begins and until it ends.
const BEGIN: f64 = 8.0;
const END: f64 = 4.0;

/// What the last samples say.
#[derive(Default)]
pub(super) struct Feeling {
    above: u32,
    below: u32,
    /// Weighted squares that the touch usually has, and has now; and those of the least of several by itself.
    usual: f64,
    now: f64,
    least: Option<f64>,
    pub touching: bool,
    /// Seconds since touches were found in what is felt.
    strange_s: f64,
}

/// What has become of a touch with a sample.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Turn {
    Same,
    Begins,
    Ends,
}

impl Feeling {
    /// Whether nothing touches, and nothing looks as if it were about to.
    pub fn at_rest(&self) -> bool {
        !self.touching && self.above == 0
    }

    /// Whether the touch is still clearly felt.
    pub fn clearly(&self) -> bool {
        self.touching && self.below == 0
    }

    /// Takes in a sample's weighted squares, and these with caution, over so many channels; of a touch that is known to be
    /// there still, or of what may go.
    pub fn take(&mut self, [plain, cautious]: [f64; 2], channels: usize, stays: bool) -> Turn {
        let channels = channels as f64;
        // A touch that stands goes on; what is left when most of it has gone, or when no touch reads so, may be what it hid.
        let usual = self.least.map_or(self.usual, |least| least.min(self.usual));
        let gone = !self.touching || self.strange_s >= STRANGE_S || plain < GONE * usual;
        let squares = if gone { cautious } else { plain };
        self.usual += (plain - self.usual) * if self.touching { USUAL } else { 1.0 };
        self.now = plain;
        let begins = channels >= FEWEST && squares > chi_squared_bound(channels, BEGIN);
        let ends = channels < FEWEST || (!stays && squares < chi_squared_bound(channels, END));
        self.above = if begins { self.above + 1 } else { 0 };
        self.below = if ends { self.below + 1 } else { 0 };
        if !self.touching && self.above >= BEGINS {
            self.touching = true;
            return Turn::Begins;
        }
        if self.touching && (self.below >= ENDS || channels < FEWEST) {
            return Turn::Ends;
        }
        Turn::Same
    }

    /// Whether touches were found in a sample, some seconds after the one before.
    pub fn found(&mut self, is_found: bool, step_s: f64) {
        let goes_on = self.touching && !is_found;
        self.strange_s = if goes_on {
            self.strange_s + step_s
        } else {
            0.0
        };
    }

    /// Touches explain the sample: several, of which the least would have so many weighted squares alone, or one.
    pub fn several(&mut self, least: Option<f64>) {
        if std::mem::replace(&mut self.least, least).is_some() && least.is_none() {
            // One of them has stayed.
            self.usual = self.now;
        }
    }

    /// Nothing touches.
    pub fn end(&mut self) {
        (self.above, self.below, self.touching, self.least) = (0, 0, false, None);
        self.strange_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of ten channels: a touch that stands, and then so many samples (10 ms) in which touches are found or none.
    fn turns(squares: [f64; 2], is_found: bool, samples: u32) -> Vec<Turn> {
        let mut feeling = Feeling::default();
        for k in 0..200 {
            // The longer it stands the less is known of the rest.
            feeling.take([200.0, if k < 10 { 200.0 } else { 12.0 }], 10, false);
            feeling.found(true, 0.01);
        }
        assert!(feeling.clearly());
        (0..samples)
            .map(|_| {
                feeling.found(is_found, 0.01);
                feeling.take(squares, 10, false)
            })
            .collect()
    }

    #[test]
    fn what_a_touch_may_have_hidden_is_no_touch_once_nothing_explains_it() {
        let ended = |turns: &[Turn]| turns.iter().position(|t| *t == Turn::Ends);
        // As much as before, and as little in doubt.
        assert_eq!(ended(&turns([180.0, 12.0], true, 100)), None);
        let left = turns([100.0, 7.0], false, 100);
        assert!((20..30).contains(&ended(&left).unwrap()));
        // Too much for what was hidden.
        assert_eq!(ended(&turns([3000.0, 190.0], false, 100)), None);
        // A moment in which another finger comes.
        assert_eq!(ended(&turns([180.0, 12.0], false, 15)), None);
        // Most of it has gone.
        assert_eq!(ended(&turns([70.0, 3.0], true, 10)), Some(5));
    }

    /// A finger that has stood for long, with little beside another: this one goes, and then the finger too.
    #[test]
    fn the_finger_that_stays_is_not_what_the_other_hid() {
        let mut feeling = Feeling::default();
        let mut take = |squares: [f64; 2], least: Option<f64>| {
            feeling.found(true, 0.01);
            let turn = feeling.take(squares, 10, false);
            feeling.several(least);
            turn
        };
        for k in 0..200 {
            take([5000.0, if k < 10 { 5000.0 } else { 400.0 }], Some(90.0));
        }
        for _ in 0..100 {
            assert!(take([90.0, 6.0], None) == Turn::Same);
        }
        let ends = (0..10).position(|_| take([30.0, 2.0], None) == Turn::Ends);
        assert_eq!(ends, Some(5));
    }
}
