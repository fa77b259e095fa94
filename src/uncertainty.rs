//! What is known to be off between a gauge as it was drawn and the reading that comes from it: one description for
//! whoever chooses gauges, judges them or builds them.

use std::f64::consts::PI;

use serde::Serialize;

/// How far off a workshop glues a gauge (standard deviations).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gluing {
    /// Rms distance from where it belongs (m), in any direction along the surface.
    pub place: f64,
    /// From its direction (radians).
    pub angle: f64,
    /// Of its gain, as a share of the reading.
    pub gain: f64,
}

impl Default for Gluing {
    /// The workshop of the paper: 1 mm, 3° and 3 %.
    fn default() -> Self {
        Self {
            place: 1e-3,
            angle: 3.0 * PI / 180.0,
            gain: 0.03,
        }
    }
}

impl Gluing {
    /// Every gauge as it was drawn.
    pub const EXACT: Self = Self {
        place: 0.0,
        angle: 0.0,
        gain: 0.0,
    };

    /// Variance that gluing puts on a reading: of the reading itself, what it changes by a metre along the gauge and
    /// across it, and a radian. To first order in all of them, in the square of the reading's unit.
    #[must_use]
    pub fn variance(&self, reading: f64, along: f64, across: f64, turned: f64) -> f64 {
        let place = self.place.powi(2) / 2.0 * (along * along + across * across);
        place + (self.angle * turned).powi(2) + (self.gain * reading).powi(2)
    }

    /// How far off every gauge is, for a sentence.
    #[must_use]
    pub fn in_words(&self) -> String {
        let tidy = |v: f64| (v * 100.0).round() / 100.0;
        format!(
            "{} mm and {}° off and its gain off by {} %",
            tidy(self.place * 1e3),
            tidy(self.angle.to_degrees()),
            tidy(self.gain * 100.0)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_off_in_any_direction_counts_half_for_each() {
        let place = Gluing {
            place: 2.0,
            ..Gluing::EXACT
        };
        // Over all directions the mean of (2 cos φ · 3 + 2 sin φ · 4)².
        let count = 360;
        let square = |k: i32| {
            let (s, c) = (2.0 * PI * f64::from(k) / f64::from(count)).sin_cos();
            (2.0 * (3.0 * c + 4.0 * s)).powi(2)
        };
        let mean = (0..count).map(square).sum::<f64>() / f64::from(count);
        assert!((place.variance(7.0, 3.0, 4.0, 5.0) - mean).abs() < 1e-9);
        let rest = Gluing {
            angle: 0.5,
            gain: 0.1,
            ..Gluing::EXACT
        };
        assert!((rest.variance(7.0, 3.0, 4.0, 6.0) - (9.0 + 0.49)).abs() < 1e-12);
        assert_eq!(Gluing::EXACT.variance(7.0, 3.0, 4.0, 5.0), 0.0);
    }

    #[test]
    fn the_usual_workshop_in_words() {
        let words = Gluing::default().in_words();
        assert_eq!(words, "1 mm and 3° off and its gain off by 3 %");
    }
}
