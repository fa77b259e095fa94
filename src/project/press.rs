//! Known presses as a project keeps them.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::key::{SWITCH, ValueRange, above, from};
use super::keys::keys;
use super::ranges::PLACES;
use crate::units;
use crate::wire::MOST_CHANNELS;

keys! {
    /// A press at a known place, as hard as is known, that calibrated the gauges or was looked at for it.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct PressKeys in "live.press" {
        position_mm: [f64; 3], "mm", PLACES,
            "where a known press was asked for";
        force_n: f64, "N", above(0.0, 1e6),
            "how hard";
        reading_microstrain: Vec<f64>, "µε", from(-1e9, 1e9),
            "what each gauge read of it; of those that are untrusted it says nothing";
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        untrusted: Vec<usize>, "", ValueRange::Whole(0, MOST_CHANNELS as u64 - 1),
            "gauges, from 0, that were not trusted during it";
        #[serde(default = "is_used")]
        used: bool, "", SWITCH,
            "whether the gauges are calibrated with it";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        board: Option<String>, "", ValueRange::Any("the number of a board, in hexadecimal"),
            "the board that read it";
    }
}

fn is_used() -> bool {
    true
}

impl PressKeys {
    /// A press at a place (m), of a force (N), with what each gauge read (strain): no number where it was not trusted.
    #[must_use]
    pub fn new(at: DVec3, force_n: f64, reading: &[f64]) -> Self {
        let trusted = |x: &f64| {
            if x.is_finite() {
                units::microstrain(*x)
            } else {
                0.0
            }
        };
        let untrusted = reading.iter().enumerate().filter(|(_, x)| !x.is_finite());
        Self {
            position_mm: units::mm(at).to_array(),
            force_n,
            reading_microstrain: reading.iter().map(trusted).collect(),
            untrusted: untrusted.map(|(gauge, _)| gauge).collect(),
            used: true,
            board: None,
        }
    }

    /// Where it was asked for (m).
    #[must_use]
    pub fn position(&self) -> DVec3 {
        units::from_mm(DVec3::from_array(self.position_mm))
    }

    /// What each gauge read (strain); no number where it was not trusted.
    #[must_use]
    pub fn reading(&self) -> Vec<f64> {
        let all = self.reading_microstrain.iter().enumerate();
        all.map(|(gauge, x)| {
            if self.untrusted.contains(&gauge) {
                f64::NAN
            } else {
                units::from_microstrain(*x)
            }
        })
        .collect()
    }

    /// Whether a board of this number may have read it.
    #[must_use]
    pub fn may_be_of(&self, board: &str) -> bool {
        self.board.as_deref().is_none_or(|own| own == board)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_comes_back() {
        let press = PressKeys::new(
            DVec3::new(0.01, 0.0, -0.02),
            5.0,
            &[1e-6, f64::NAN, -2.5e-4],
        );
        assert_eq!(press.untrusted, [1]);
        let read = press.reading();
        assert!(
            read[1].is_nan() && (read[0] - 1e-6).abs() < 1e-15 && (read[2] + 2.5e-4).abs() < 1e-12
        );
        assert!(press.position().distance(DVec3::new(0.01, 0.0, -0.02)) < 1e-12);
        assert!(press.may_be_of("0000002a"));
        let of_board = PressKeys {
            board: Some("0000002a".into()),
            ..press
        };
        assert!(of_board.may_be_of("0000002a") && !of_board.may_be_of("0000002b"));
    }
}
