//! What a gauge is, how it is glued, and how it is calibrated.

use serde::{Deserialize, Serialize};

use super::key::{ValueRange, from};
use super::keys::keys;
use super::ranges::{FRICTION, LENGTH, OFF_MM, OFF_PERCENT, ROOM};
use super::value::{any, is_default};
use crate::dataset::Signal;
use crate::units;

any!(Signal);

keys! {
    /// Keys of the table `gauge`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct GaugeKeys in "gauge" {
        signal: Signal = Signal::Strain, "", ValueRange::Words(&["strain", "displacement", "normal-displacement"]),
            "what a site reports: strain is what a gauge measures, displacement what the paper used";
        directions: usize = 1, "", ValueRange::Whole(1, 4),
            "that a gauge may have at one place: 1 along the largest strain, 2 also across it, up to 4";
        noise_microstrain: f64 = 1.0, "µε", from(0.0, 1e12),
            "standard deviation of a reading";
        // Of a simulated board it is what its bits and its gain make it.
        #[serde(skip_serializing_if = "is_default")]
        resolution_microstrain: f64 = 0.0, "µε", from(0.0, 1e6),
            "what one count of the converter stands for; 0 where the noise is that of counts already";
        // A tare and a rest that follows take away what is slower than a touch, and what wanders faster is in the noise
        // as it is measured: beside them nothing is left, unless touches last for minutes or warm the part.
        #[serde(skip_serializing_if = "is_default")]
        drift_microstrain: f64 = 0.0, "µε", from(0.0, 1e6),
            "standard deviation of what all channels drift by together while a touch lasts";
        range_microstrain: f64 = 30_000.0, "µε", from(1e-12, 1e30),
            "largest strain that gauge and amplifier can take";
        least_signal_to_noise: f64 = 3.0, "", from(0.0, 1e12),
            "rms strain over noise that a site must reach";
        grid_length_mm: f64 = 5.0, "mm", LENGTH,
            "of the measuring grid, along the gauge";
        grid_width_mm: f64 = 2.0, "mm", LENGTH,
            "of the measuring grid, across the gauge";
        flatness_mm: f64 = 0.3, "mm", ROOM,
            "largest height of the surface over the gauge's plane";
    } with {
        // As `touch.forces_n`.
        /// Table `gauge.tolerance`.
        #[serde(skip_serializing_if = "ToleranceKeys::is_usual")]
        tolerance: ToleranceKeys = ToleranceKeys::default();
    }
}

impl GaugeKeys {
    /// Length and width of the measuring grid (m).
    #[must_use]
    pub fn grid(&self) -> [f64; 2] {
        [self.grid_length_mm, self.grid_width_mm].map(units::from_mm)
    }

    /// Standard deviation of a reading, a strain.
    #[must_use]
    pub fn noise(&self) -> f64 {
        units::from_microstrain(self.noise_microstrain)
    }
}

keys! {
    /// How far off gauges are glued (standard deviations).
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct ToleranceKeys in "gauge.tolerance" {
        place_mm: f64 = 1.0, "mm", OFF_MM,
            "how far from its place a gauge is glued, in any direction (standard deviation)";
        angle_deg: f64 = 3.0, "°", from(0.0, 45.0),
            "how far from its direction a gauge is glued (standard deviation)";
        gain_percent: f64 = 3.0, "%", OFF_PERCENT,
            "how far off the gain of a glued gauge is (standard deviation)";
    }
}

impl ToleranceKeys {
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

keys! {
    /// How known presses are made that gauges are calibrated with (standard deviations).
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct CalibrationKeys in "calibration" {
        place_mm: f64 = 1.0, "mm", OFF_MM,
            "how far beside its place a known touch is pressed, in any direction (standard deviation)";
        force_percent: f64 = 3.0, "%", OFF_PERCENT,
            "how much too hard or too soft a known touch is pressed (standard deviation)";
        #[serde(skip_serializing_if = "is_usual_tilt")]
        friction_percent: f64 = TILT_PERCENT, "%", FRICTION,
            "how much of a known touch's force pushes along the surface, over what presses (rms, in any direction)";
    }
}

/// Of a hand that presses upright as well as it can: six degrees.
const TILT_PERCENT: f64 = 10.0;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn is_usual_tilt(percent: &f64) -> bool {
    *percent == TILT_PERCENT
}
