//! From strain to counts and back: gauge, bridge, amplifier, converter.

use serde::{Deserialize, Serialize};

use crate::units;
use crate::wire::Hello;

/// The electric constants between a gauge and its counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Chain {
    /// Supply of the bridge (V).
    pub supply_v: f64,
    /// Relative change of resistance over strain.
    pub gauge_factor: f64,
    /// Arms of the bridge that the strain changes: a gauge with a dummy is one.
    pub active_arms: u8,
    /// Of the amplifier.
    pub gain: f64,
    /// Of the converter.
    pub bits: u8,
    /// Full scale of the converter (V).
    pub reference_v: f64,
}

impl Default for Chain {
    /// A gauge with a dummy, MCP609 with a gain of 330, an Arduino Due.
    fn default() -> Self {
        Self {
            supply_v: 5.0,
            gauge_factor: 2.0,
            active_arms: 1,
            gain: 330.0,
            bits: 12,
            reference_v: 3.3,
        }
    }
}

impl Chain {
    /// Counts per strain: `V_ex` · GF · n/4 · G · 2^bits / `V_ref`.
    #[must_use]
    pub fn counts_per_strain(&self) -> f64 {
        let volts =
            self.supply_v * self.gauge_factor * f64::from(self.active_arms) / 4.0 * self.gain;
        volts * f64::from(1_u32 << self.bits) / self.reference_v
    }

    /// The end of the converter's range.
    #[must_use]
    pub fn highest_count(&self) -> u32 {
        (1_u32 << self.bits) - 1
    }

    /// What a board says of itself; gauge factor and arms it does not know.
    #[must_use]
    pub fn of_board(self, hello: &Hello) -> Self {
        Self {
            supply_v: units::from_thousandths(hello.supply_mv),
            gain: units::from_thousandths(hello.gain_milli),
            bits: hello.bits,
            reference_v: units::from_thousandths(hello.reference_mv),
            ..self
        }
    }

    /// Whether anything can be computed from it.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let positive = [
            self.supply_v,
            self.gauge_factor,
            self.gain,
            self.reference_v,
        ];
        positive.iter().all(|v| v.is_finite() && *v > 0.0)
            && (1..=4).contains(&self.active_arms)
            && (1..=24).contains(&self.bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resolution_is_that_of_the_data_sheets() {
        let due = Chain::default();
        let microstrain = |chain: Chain| 1e6 / chain.counts_per_strain();
        assert!((microstrain(due) - 0.977).abs() < 1e-3);
        let five_volts = Chain {
            reference_v: 5.0,
            ..due
        };
        assert!((microstrain(five_volts) - 1.480).abs() < 1e-3);
        let range = f64::from(five_volts.highest_count()) / 2.0 * microstrain(five_volts);
        assert!((range - 3030.0).abs() < 2.0);
    }
}
