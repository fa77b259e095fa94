//! Whether a jig's arm gets to a place.

use glam::DVec2;

use super::rod::{Interior, RodLine, cover};
use super::wall::{PressedGauge, Wall};
use crate::budget::{Cancelled, Watch};
use crate::gauge::Gauge;

/// The rods that get to most of a part.
pub struct RodReach {
    interior: Interior,
    lines: Vec<RodLine>,
}

impl RodReach {
    /// Of a part on which gauges may sit at these places, with a film of half these sizes (mm).
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(wall: Wall, places: &[Gauge], film: DVec2, watch: Watch) -> Result<Self, Cancelled> {
        /// Rods, one after another, and places that they are chosen by.
        const RODS: usize = 3;
        const PLACES: usize = 60;
        let interior = Interior::new(wall, places.iter().map(|g| g.position), film);
        let apart = places.len().div_ceil(PLACES).max(1);
        let some: Vec<PressedGauge> = (0..)
            .zip(places.iter().step_by(apart))
            .map(|(number, &gauge)| PressedGauge { number, gauge })
            .collect();
        let rods = cover(&interior, &some, RODS, watch)?;
        let lines = rods.into_iter().map(|rod| rod.line).collect();
        Ok(Self::of(interior, lines))
    }

    /// Of rods on these lines.
    #[must_use]
    pub fn of(interior: Interior, lines: Vec<RodLine>) -> Self {
        Self { interior, lines }
    }

    /// Whether an arm on one of the rods gets to a gauge.
    #[must_use]
    pub fn gets_to(&self, gauge: &Gauge) -> bool {
        let pressed = PressedGauge {
            number: 0,
            gauge: *gauge,
        };
        let mut lines = self.lines.iter();
        lines.any(|&line| self.interior.arm(line, &pressed).is_ok())
    }
}
