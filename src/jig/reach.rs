//! Whether a jig's arm gets to a place.

use glam::DVec2;

use super::rod::{Line, Site, cover};
use super::wall::{PressedGauge, Wall};
use crate::budget::{Cancelled, Watch};

/// The rods that get to most of a part.
pub struct RodReach {
    site: Site,
    lines: Vec<Line>,
}

impl RodReach {
    /// Of a part on which gauges may sit at these places, with a film of half these sizes (mm).
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        wall: Wall,
        places: &[PressedGauge],
        film: DVec2,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        /// Rods, one after another, and places that they are chosen by.
        const RODS: usize = 3;
        const PLACES: usize = 60;
        let site = Site::new(wall, places, film);
        let apart = places.len().div_ceil(PLACES).max(1);
        let some: Vec<PressedGauge> = (0..)
            .zip(places.iter().step_by(apart))
            .map(|(number, place)| PressedGauge { number, ..*place })
            .collect();
        let rods = cover(&site, &some, RODS, watch)?;
        let lines = rods.into_iter().map(|rod| rod.line).collect();
        Ok(Self::of(site, lines))
    }

    /// Of rods on these lines.
    #[must_use]
    pub fn of(site: Site, lines: Vec<Line>) -> Self {
        Self { site, lines }
    }

    /// Whether an arm on one of the rods gets to a gauge.
    #[must_use]
    pub fn gets_to(&self, gauge: &PressedGauge) -> bool {
        let mut lines = self.lines.iter();
        lines.any(|&line| self.site.arm(line, gauge).is_ok())
    }
}
