//! A rest that was no rest: taken while something pressed, it shows as soon as that lets go. The readings are those of a
//! touch then, but for their sign, and nothing pulls at a limb.

use crate::inference::{Contact, Matching};

/// Of what a pull explains, twice the logarithm of the likelihood: more than that of noise.
const CLEAR: f64 = 100.0;
/// A pull leaves no more than this share of it unexplained, and a touch at least so much more: nobody believes in pulls
/// as long as a touch will do.
const EXPLAINED: f64 = 0.25;
const WORSE: f64 = 40.0;
/// Looks in a row that make it sure.
const LOOKS: u32 = 3;

/// Looks for a release.
#[derive(Clone, Debug, Default)]
pub struct Release {
    looks: u32,
}

impl Release {
    /// Whether a reading (strain) is rather of something that lets go than of the touch that explains it best.
    pub fn is_seen(&mut self, matching: &mut Matching, strain: &[f64], touch: &Contact) -> bool {
        // A pull would have to leave less than nothing.
        if touch.unexplained < WORSE {
            self.looks = 0;
            return false;
        }
        let turned: Vec<f64> = strain.iter().map(|x| -x).collect();
        let pull = matching.find(&turned);
        let explained = pull.unexplained < EXPLAINED * pull.strength;
        let seen = pull.strength > CLEAR && explained && touch.strength < pull.strength - WORSE;
        self.looks = if seen { self.looks + 1 } else { 0 };
        seen
    }

    /// Whether it was seen often enough to be believed.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.looks >= LOOKS
    }

    /// Begins anew.
    pub fn forget(&mut self) {
        self.looks = 0;
    }
}
