//! Whether anything touches: weighted squares against χ² of the channels, with a few samples of patience.

/// Samples in a row that make or end a touch.
const BEGINS: u32 = 3;
const ENDS: u32 = 6;
/// Of the squares that a touch usually has: what is less is hardly the same touch; and the share of a sample in these.
const GONE: f64 = 0.25;
const USUAL: f64 = 0.01;
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
    /// Weighted squares that the touch usually has.
    usual: f64,
    pub touching: bool,
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

    /// Takes in a sample's weighted squares, and these with caution, over so many channels.
    pub fn take(&mut self, [plain, cautious]: [f64; 2], channels: usize) -> Turn {
        let channels = channels as f64;
        // A touch that stands goes on; what is left when most of it has gone may be what it hid.
        let gone = !self.touching || plain < GONE * self.usual;
        let squares = if gone { cautious } else { plain };
        self.usual += (plain - self.usual) * if self.touching { USUAL } else { 1.0 };
        let scatter = (2.0 * channels).sqrt();
        let begins = channels >= FEWEST && squares > channels + BEGIN * scatter;
        let ends = channels < FEWEST || squares < channels + END * scatter;
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

    /// Nothing touches.
    pub fn end(&mut self) {
        (self.above, self.below, self.touching) = (0, 0, false);
    }
}
