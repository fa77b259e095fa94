//! What is known to be off between a touch on the model of a part and the readings that come from it: one description
//! for whoever chooses gauges, judges them, builds them, calibrates them or listens to them.
//!
//! Each cause is a term of its own, in its own unit, because each enters readings in its own way:
//!
//! | term | enters as |
//! |---|---|
//! | noise, resolution | a variance of each reading, the same for every touch |
//! | gluing | by the reading's slopes over the gauge's place and direction, and by its gain: grows with the force |
//! | elements | as if each gauge was glued off its place and its gain was off: grows with the force |
//! | model | elements that leave at least so much, where somebody says so |
//! | tip | by the reading's slope over the tip's radius: grows with the force |
//! | friction | by what a force along the surface reads there: grows with the force |
//! | drift | common to all channels: a matrix of rank one beside the diagonal |
//! | stiffness | a common factor of all readings, the same as another force: no place is worse for it, every force is |
//! | pressing | nothing that is read later; known presses are off by it while gauges are calibrated |
//!
//! Tip, friction and drift are felt by all gauges together: choice, matching and calibration know that, and tell them apart
//! from the place.

use std::f64::consts::PI;

use serde::Serialize;

/// A touch that moves no gauge by more than so many deviations of its noise is blind: it is noticed less than every
/// second time, if no more than three of a thousand readings at rest may be taken for a touch.
pub const BLIND: f64 = 3.0;

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
        format!(
            "{} mm and {}° off and its gain off by {} %",
            tidy(crate::units::mm(self.place)),
            tidy(self.angle.to_degrees()),
            tidy(self.gain * 100.0)
        )
    }
}

/// How far off a hand presses where and as hard as it was asked to (standard deviations).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HandPressing {
    /// Rms distance from the place that was asked for (m), in any direction along the surface.
    pub place: f64,
    /// Of the force, as a share of what was asked for.
    pub force: f64,
    /// Of the force along the surface, over the one that presses: rms, in any direction.
    pub friction: f64,
}

impl Default for HandPressing {
    /// A hand with a force gauge, at a mark on the part: 1 mm and 3 %, and six degrees off the upright.
    fn default() -> Self {
        Self {
            place: 1e-3,
            force: 0.03,
            friction: 0.1,
        }
    }
}

/// How far off touches are made beside where and how hard they press (standard deviations).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Making {
    /// Of the tip's radius (m).
    pub tip: f64,
    /// Of the force along the surface, over the one that presses: rms, in any direction.
    pub friction: f64,
}

impl Making {
    /// By the tip that there is said to be, straight in.
    pub const EXACT: Self = Self {
        tip: 0.0,
        friction: 0.0,
    };

    /// Variance that it puts on a reading that changes by so much a metre of the tip's radius, and by `shear` (root of
    /// the sum of the squares over two directions) where as much force acts along the surface as presses. To first order
    /// in both, in the square of the reading's unit.
    #[must_use]
    pub fn variance(&self, tip: f64, shear: f64) -> f64 {
        (self.tip * tip).powi(2) + (self.along_either() * shear).powi(2)
    }

    /// Of the force along the surface in either of two directions at right angles, over the force that presses.
    #[must_use]
    pub fn along_either(&self) -> f64 {
        self.friction / 2.0_f64.sqrt()
    }
}

/// A figure for a sentence.
fn tidy(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

impl HandPressing {
    /// A machine: just there, and just as hard.
    pub const EXACT: Self = Self {
        place: 0.0,
        force: 0.0,
        friction: 0.0,
    };

    /// How far off every press is, for a sentence.
    #[must_use]
    pub fn in_words(&self) -> String {
        format!(
            "{} mm beside its place, {} % too hard or too soft, and with {} % of its force along the surface",
            tidy(crate::units::mm(self.place)),
            tidy(self.force * 100.0),
            tidy(self.friction * 100.0)
        )
    }
}

/// What the elements are taken to leave, as a share of a reading, where nobody has estimated it.
pub const UNESTIMATED: f64 = 0.03;

/// How far a gauge is taken to be moved until it reads something else (m), where nobody knows.
const LENGTH_SCALE: f64 = 8e-3;

/// Everything that is known to be off (standard deviations).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Of each channel's noise (strain).
    pub noise: f64,
    /// What one count of the converter stands for (strain); zero where nobody knows it yet, or where the noise was
    /// measured behind the converter and has it.
    pub resolution: f64,
    /// How gauges are glued.
    pub gluing: Gluing,
    /// What the elements leave, as a share of a load's largest strain: matching takes as much of readings for wrong, half
    /// of the square from a channel's own and half from the mean of all.
    pub elements: f64,
    /// What the model is known to be off by whatever its elements are, as a share of a reading: both of the above are no less.
    pub model: f64,
    /// What they leave of single gauges: as if they were glued off by so much. A choice goes by it, because it must know
    /// which gauges are more off than others. Matching weighs by it no better (RESULTS.md, “What elements leave”).
    pub as_glued: Gluing,
    /// Of the factor by which the part is stiffer or softer than its model.
    pub stiffness: f64,
    /// How touches come to be made.
    pub making: Making,
    /// Of the force along the surface that whoever finds touches allows for, over the one that presses, where that is
    /// more than touches are said to have: fingers push aside, whatever a design was made for.
    pub allowed: f64,
    /// Of what all channels have drifted by together since the rest (strain).
    pub drift: f64,
    /// How known presses are made.
    pub pressing: HandPressing,
}

impl Default for Uncertainty {
    /// A workshop's gluing and a hand's presses on elements that nobody has judged, and nothing else.
    fn default() -> Self {
        Self {
            noise: 0.0,
            resolution: 0.0,
            gluing: Gluing::default(),
            elements: UNESTIMATED,
            model: 0.0,
            as_glued: as_glued(UNESTIMATED, LENGTH_SCALE),
            stiffness: 0.0,
            making: Making::EXACT,
            allowed: 0.0,
            drift: 0.0,
            pressing: HandPressing::default(),
        }
    }
}

impl Uncertainty {
    /// Everything just as it is said to be.
    pub const NONE: Self = Self {
        noise: 0.0,
        resolution: 0.0,
        gluing: Gluing::EXACT,
        elements: 0.0,
        model: 0.0,
        as_glued: Gluing::EXACT,
        stiffness: 0.0,
        making: Making::EXACT,
        allowed: 0.0,
        drift: 0.0,
        pressing: HandPressing::EXACT,
    };

    /// With what the elements are estimated to leave, in percent of the strain; not a number where that is not known. No less
    /// than the model is known to be off by.
    #[must_use]
    pub fn with_elements(self, percent: f64) -> Self {
        Self {
            elements: share(percent).max(self.model),
            ..self
        }
    }

    /// With what they are estimated to leave of single gauges, in percent of what these read, if they read something else
    /// when they are moved by `length_scale` (m); not numbers where that is not known.
    #[must_use]
    pub fn with_elements_of_gauges(self, percent: f64, length_scale: f64) -> Self {
        let known = length_scale.is_finite();
        Self {
            as_glued: as_glued(
                share(percent).max(self.model),
                if known { length_scale } else { LENGTH_SCALE },
            ),
            ..self
        }
    }

    /// How far off gauges are by gluing and by elements.
    #[must_use]
    pub fn of_gauges(&self) -> Gluing {
        let (glued, elements) = (&self.gluing, &self.as_glued);
        Gluing {
            place: glued.place.hypot(elements.place),
            angle: glued.angle.hypot(elements.angle),
            gain: glued.gain.hypot(elements.gain),
        }
    }

    /// How far off touches may be made, as far as whoever finds them knows.
    #[must_use]
    pub fn making_allowed(&self) -> Making {
        Making {
            friction: self.making.friction.max(self.allowed),
            ..self.making
        }
    }

    /// How far off known presses are made, beside their place and force.
    #[must_use]
    pub fn making_of_presses(&self) -> Making {
        Making {
            friction: self.pressing.friction,
            ..self.making
        }
    }

    /// The most that any of them is off by.
    #[must_use]
    pub fn making_at_most(&self) -> Making {
        let allowed = self.making_allowed();
        Making {
            friction: allowed.friction.max(self.pressing.friction),
            ..allowed
        }
    }

    /// Standard deviation of a channel that nobody touches (strain): of its noise, and of what is rounded to counts.
    #[must_use]
    pub fn of_channel(&self) -> f64 {
        self.noise.hypot(rounding(self.resolution))
    }

    /// Whether gauges are built, pressed and read alike, whatever noise and elements are: what was measured on them and
    /// judged for one holds for the other.
    #[must_use]
    pub fn builds_as(&self, other: &Self) -> bool {
        let built = |off: &Self| (off.gluing, off.making, off.allowed, off.drift, off.pressing);
        built(self) == built(other)
    }
}

/// Of an estimate in percent, or where there is none.
fn share(percent: f64) -> f64 {
    if percent.is_nan() {
        UNESTIMATED
    } else {
        (percent / 100.0).clamp(0.0, 1.0)
    }
}

/// A share of the readings that elements leave: half of its square as a gain that is off and half as a place. That is how
/// readings of finer elements differ (RESULTS.md, “What elements leave”).
fn as_glued(share: f64, length_scale: f64) -> Gluing {
    Gluing {
        place: share * length_scale,
        angle: 0.0,
        gain: share / 2.0_f64.sqrt(),
    }
}

/// Standard deviation of what is rounded to whole counts, in the unit of `count`: evenly spread over one of them.
#[must_use]
pub fn rounding(count: f64) -> f64 {
    count / 12.0_f64.sqrt()
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
        let words = HandPressing::default().in_words();
        assert_eq!(
            words,
            "1 mm beside its place, 3 % too hard or too soft, and with 10 % of its force along the surface"
        );
    }

    #[test]
    fn a_count_is_a_twelfth_of_a_variance() {
        let count = 1000;
        let off = |k: i32| ((f64::from(k) + 0.5) / f64::from(count) - 0.5).powi(2);
        let variance = (0..count).map(off).sum::<f64>() / f64::from(count);
        assert!((rounding(3.0) - 3.0 * variance.sqrt()).abs() < 1e-6);
        let both = Uncertainty {
            noise: 3e-6,
            resolution: 12.0_f64.sqrt() * 4e-6,
            ..Uncertainty::default()
        };
        assert!((both.of_channel() - 5e-6).abs() < 1e-15);
    }

    #[test]
    fn elements_that_nobody_judged_are_not_perfect() {
        let off = Uncertainty::default();
        assert_eq!(off.with_elements(f64::NAN).elements, UNESTIMATED);
        assert_eq!(off.with_elements(0.0).elements, 0.0);
        assert_eq!(off.with_elements(1e9).elements, 1.0);
        assert_eq!(off.with_elements(f64::INFINITY).elements, 1.0);
        let with = |percent: f64| off.with_elements_of_gauges(percent, 5e-3).as_glued;
        assert_eq!(with(f64::NAN), as_glued(UNESTIMATED, 5e-3));
        assert_eq!(with(0.0), Gluing::EXACT);
        assert_eq!(with(f64::INFINITY), as_glued(1.0, 5e-3));
        assert_eq!(off.with_elements_of_gauges(f64::NAN, f64::NAN), off);
        // A model that is known to be worse than its elements say.
        let poor = Uncertainty { model: 0.1, ..off };
        assert_eq!(poor.with_elements(4.0).elements, 0.1);
        assert_eq!(poor.with_elements(20.0).elements, 0.2);
        let of_gauges = poor.with_elements_of_gauges(4.0, 5e-3).as_glued;
        assert_eq!(of_gauges, as_glued(0.1, 5e-3));
        assert_eq!(off.with_elements_of_gauges(f64::NAN, f64::INFINITY), off);
    }

    #[test]
    fn elements_leave_their_share_of_readings_that_change_over_their_length() {
        let (share, length) = (0.04, 5e-3);
        let exact = Uncertainty::NONE.with_elements_of_gauges(100.0 * share, length);
        // A reading of one and slopes that bring it to nothing over the length, whichever way they lie.
        let (sin, cos) = 0.7_f64.sin_cos();
        let (along, across) = (cos / length, sin / length);
        let variance = exact.of_gauges().variance(1.0, along, across, 9.0);
        assert!((variance.sqrt() - share).abs() < 1e-12);
        // Beside gluing, squares add.
        let both = Uncertainty {
            gluing: Gluing::default(),
            ..exact
        };
        let sum = variance + Gluing::default().variance(1.0, along, across, 9.0);
        let together = both.of_gauges().variance(1.0, along, across, 9.0);
        assert!((together / sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn noise_builds_nothing_anew() {
        let off = Uncertainty::default();
        let noisier = Uncertainty {
            noise: 1.0,
            elements: 0.2,
            ..off
        };
        assert!(off.builds_as(&noisier));
        let pressed = Uncertainty {
            pressing: HandPressing::EXACT,
            ..off
        };
        assert!(!off.builds_as(&pressed));
    }
}
