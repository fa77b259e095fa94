//! What comes to pass with the rest and the gauges, for whoever looks on.

use super::blind::LIGHT_N;
use super::health::Health;
use crate::uncertainty::BLIND;
use crate::units;

/// What a pipeline has to say beside what touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LiveNews {
    /// Something moves while the rest is taken.
    Waiting,
    /// What moved is still, and the rest is taken.
    Still,
    /// It never was still, and is taken for rest as it is.
    Restless,
    /// The rest was taken under a touch that has let go.
    Released,
    /// On this share of the surface a light touch is not felt.
    Blind(f64),
    /// A gauge (from 0) has jumped by so much (strain).
    Jumped(usize, f64),
    /// A gauge (from 0) is left out for what ails it, or is trusted again.
    Gauge(usize, Health),
}

impl LiveNews {
    /// Whether this says how it is now with what the other has told of.
    #[must_use]
    pub fn follows(self, earlier: Self) -> bool {
        let of_rest = |news| {
            matches!(
                news,
                Self::Waiting | Self::Still | Self::Restless | Self::Released
            )
        };
        match (self, earlier) {
            (Self::Gauge(now, _), Self::Gauge(then, _))
            | (Self::Jumped(now, _), Self::Jumped(then, _)) => now == then,
            (Self::Blind(_), Self::Blind(_)) => true,
            _ => of_rest(self) && of_rest(earlier),
        }
    }

    /// For people, with what to do.
    #[must_use]
    pub fn in_words(self) -> String {
        let words = match self {
            Self::Waiting => {
                "the gauges move: the rest is taken as soon as they are still. Do not touch the limb"
            }
            Self::Still => "the gauges are still: the rest is taken",
            Self::Restless => {
                "the gauges are never still: what they read on the mean is taken for rest. Tare again when nothing moves the limb"
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
            Self::Gauge(gauge, health) => return of_gauge(gauge + 1, health),
        };
        words.to_owned()
    }
}

/// How a gauge (from 1) is, with what to do.
fn of_gauge(gauge: usize, health: Health) -> String {
    let ails = match health {
        Health::Good => return format!("gauge {gauge} is trusted again"),
        Health::OffScale => {
            "reads the end of the converter's range: see to its bridge and its wires, or touch less hard"
        }
        Health::Stuck => "does not change at all: see to its wires and its amplifier",
        Health::Noisy => {
            "is far noisier than the others: see to its wires, and what they run beside"
        }
        Health::Dead => "feels no touch that it should feel: see to its glue and its wires",
    };
    format!("gauge {gauge} is left out. It {ails}")
}
