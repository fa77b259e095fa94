//! A rest that was no rest: taken while something pressed, it shows as soon as that lets go. The readings are those of a
//! touch then, but for their sign, and nothing pulls at a limb. Two touches may read much like a pull at a third place:
//! they are held against it.

use super::long_touch::LongTouch;
use super::pull;
use super::standing::StandingTouch;
use crate::inference::{Contact, Matching, Several};
use crate::units;

/// Of what a pull explains, twice the logarithm of the likelihood: more than that of noise.
const CLEAR: f64 = 100.0;
/// A touch leaves at least so much more unexplained than a pull: nobody believes in pulls as long as a touch will do. Of a rest to
/// which nobody has come back so far it takes less: a touch that is missed once is no harm beside one that is shown for ever.
const WORSE: f64 = 40.0;
const WORSE_AT_FIRST: f64 = 20.0;
/// Looks in a row that make it sure, and seconds: of a rest to which nobody has come back so far none; but where a touch has
/// come and gone it is rather a gauge that says nothing.
const LOOKS: u32 = 3;
const PROVED_S: f64 = 1.0;
/// Seconds between two questions whether several touches would do: it takes long to look for them.
const ASK_S: f64 = 0.05;

/// Looks for a release.
#[derive(Clone, Debug, Default)]
pub struct Release {
    looks: u32,
    /// When it was first and last seen (µs).
    seen: [u64; 2],
    /// When it was asked whether several touches would do (µs), and whether a pull was likelier.
    asked: Option<(u64, bool)>,
    standing: StandingTouch,
    long: LongTouch,
}

impl Release {
    /// Whether what is felt is rather a rest that is off, and nobody has come back to so far, than a touch that stands; of a
    /// reading (strain) some seconds after the one before, in which touches are found or none.
    pub fn stands(
        &mut self,
        matching: &mut Matching,
        strain: &[f64],
        now: (bool, f64),
        proved: bool,
    ) -> bool {
        self.long.take(matching, strain, now);
        !proved && (self.standing).is_rather_the_rest(matching, strain, now.1)
    }

    /// Whether a reading (strain, at a time in µs) is rather of something that lets go than of the touch that explains it
    /// best, or of several, where the rest was proved or not.
    pub fn is_seen(
        &mut self,
        matching: &mut Matching,
        several: &Several,
        (time_us, strain): (u64, &[f64]),
        touch: &Contact,
        proved: bool,
    ) -> bool {
        let worse = if proved { WORSE } else { WORSE_AT_FIRST };
        // Else a pull would have to leave less than nothing.
        if touch.unexplained < worse || self.long.is_on(matching, strain) {
            self.looks = 0;
            return false;
        }
        let pull = pull::find(matching, strain);
        let better = pull.strength > CLEAR && touch.strength < pull.strength - worse;
        let seen = pull::explains(&pull) && better && {
            let lately = |at: u64| units::seconds_between(at, time_us) < ASK_S;
            // That it is a pull is asked until it is believed, at every sample.
            let stands = |likelier: bool| !likelier || self.looks >= LOOKS;
            if (self.asked).is_none_or(|(at, likelier)| !lately(at) || !stands(likelier)) {
                let likelier = matching.is_rather_a_pull(several, strain, [touch, &pull]);
                self.asked = Some((time_us, likelier));
            }
            self.asked.is_some_and(|(_, likelier)| likelier)
        };
        if seen {
            let first = if self.looks == 0 {
                time_us
            } else {
                self.seen[0]
            };
            self.seen = [first, time_us];
            self.looks += 1;
        } else {
            self.looks = 0;
        }
        seen
    }

    /// Whether it was seen often enough to be believed, of a rest that was proved or not.
    #[must_use]
    pub fn is_sure(&self, proved: bool) -> bool {
        let [first, last] = self.seen;
        let lasted = units::seconds_between(first, last);
        self.looks >= LOOKS && (!proved || lasted >= PROVED_S)
    }

    /// Begins anew.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where nobody has come back to the rest so far a pull is believed at once; where somebody has, only when it lasts.
    #[test]
    fn a_rest_that_was_proved_is_not_doubted_for_a_moment() {
        let seen = |looks: u32, ms: u64| Release {
            looks,
            seen: [5_000, 5_000 + 1000 * ms],
            ..Release::default()
        };
        assert!(!seen(LOOKS - 1, 5000).is_sure(false));
        assert!(seen(LOOKS, 2).is_sure(false));
        assert!(!seen(LOOKS, 900).is_sure(true));
        assert!(seen(LOOKS, 1000).is_sure(true));
    }
}
