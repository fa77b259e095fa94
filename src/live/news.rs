//! What comes to pass with the rest, for whoever looks on.

use super::blind::LIGHT_N;
use crate::uncertainty::BLIND;
use crate::units;

/// What a pipeline has to say of its rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestNews {
    /// Something moves while the rest is taken.
    Waiting,
    /// The rest was taken under a touch that has let go.
    Released,
    /// On this share of the surface a light touch is not felt.
    Blind(f64),
    /// A gauge (from 0) has jumped by so much (strain).
    Jumped(usize, f64),
}

impl RestNews {
    /// For people, with what to do.
    #[must_use]
    pub fn in_words(self) -> String {
        let words = match self {
            Self::Waiting => {
                "the gauges move: the rest is taken as soon as they are still. Do not touch the limb"
            }
            Self::Released => {
                "the rest was taken while something pressed: it is taken again. Where this comes with every touch, the gauges are wired the wrong way round"
            }
            Self::Blind(share) => {
                return format!(
                    "a touch of {LIGHT_N} N is not felt on {:.0} % of the surface: it moves no gauge that is trusted by {BLIND} times its noise there. See which gauges are left out, and what makes the others noisy",
                    100.0 * share
                );
            }
            Self::Jumped(gauge, by) => {
                return format!(
                    "gauge {} has jumped by {:.0} microstrain and goes on from there: see to its wires and its glue",
                    gauge + 1,
                    units::microstrain(by)
                );
            }
        };
        words.to_owned()
    }
}
