//! How large the pieces of a jig are.

use glam::DVec2;

/// What a gauge's film has around its grid (mm), along it (where its leads are) and across.
pub const FILM: DVec2 = DVec2::new(3.3, 1.5);

/// Of printed pieces (mm), for any printer with a nozzle of 0.4 mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Radius of the rod.
    pub rod: f64,
    /// How deep its flat is.
    pub flat: f64,
    /// Between pieces that slide, on each side.
    pub play: f64,
    /// The thinnest wall.
    pub wall: f64,
    /// Height of a ring.
    pub ring: f64,
    /// Side of the stem that a pad slides with.
    pub stem: f64,
    /// Length of its guide.
    pub guide: f64,
    /// Between pad and wall: film, wool, and the gauge.
    pub gap: f64,
    /// Of a pad around the gauge's film.
    pub margin: f64,
    /// Of a pad where it is thinnest.
    pub pad: f64,
    /// The longest piece that can be printed.
    pub longest: f64,
}

impl Default for Sizes {
    fn default() -> Self {
        Self {
            rod: 4.0,
            flat: 1.2,
            play: 0.2,
            wall: 1.6,
            ring: 6.0,
            stem: 4.0,
            guide: 8.0,
            gap: 1.5,
            margin: 1.5,
            pad: 2.0,
            longest: 200.0,
        }
    }
}

impl Sizes {
    /// For a part whose inside is so far (mm) from its axis where it is narrowest: slimmer in a narrow one.
    #[must_use]
    pub fn within(radius: f64) -> Self {
        let usual = Self::default();
        let share = (radius / 25.0).clamp(0.6, 1.0);
        Self {
            rod: usual.rod * share,
            flat: usual.flat * share,
            guide: usual.guide * share.max(0.75),
            ..usual
        }
    }

    /// Radius of a ring.
    #[must_use]
    pub fn ring_radius(&self) -> f64 {
        self.rod + self.play + 1.5 * self.wall
    }

    /// Half of what a guide measures across.
    #[must_use]
    pub fn guide_half(&self) -> f64 {
        self.stem / 2.0 + self.play + self.wall
    }

    /// Half of what a strut measures across at its ring, where those of other rings are near.
    #[must_use]
    pub fn strut_half(&self) -> f64 {
        1.25 * self.wall
    }

    /// Half length and width of a pad for a film of half these sizes.
    #[must_use]
    pub fn pad_half(&self, film: DVec2) -> DVec2 {
        film + DVec2::splat(self.margin)
    }
}
