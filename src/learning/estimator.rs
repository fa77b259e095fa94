//! A trained estimator: from a reading to place, radius and force.

use super::doubt::ErrorModel;
use super::family::Family;
use super::inputs::ChannelScales;
use super::machine::Regression;
use super::targets::{Scale, TargetFrame};
use crate::dataset::SignalMatrix;

/// What was learned, ready to answer.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchEstimator {
    /// How readings become features.
    pub inputs: ChannelScales,
    /// How outputs become places.
    pub frame: TargetFrame,
    /// Places from features.
    pub place: Regression,
    /// How far places may be off.
    pub doubt: ErrorModel,
    /// Forces from features, where forces were known.
    pub force: Option<ForceEstimator>,
}

/// What was learned of forces.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceEstimator {
    /// What it was chosen among.
    pub family: Family,
    /// How the output becomes a force.
    pub scale: Scale,
    /// Forces from features.
    pub machine: Regression,
}

/// What a reading says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Where it was touched (mm).
    pub place_mm: [f64; 3],
    /// The radius around it that nine of ten true places lie within (mm).
    pub radius_mm: f64,
    /// How hard (N), where forces were learned.
    pub force_n: Option<f64>,
}

impl TouchEstimator {
    /// How many channels a reading must have.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.inputs.channels()
    }

    /// Errors over the radius, of touches that were learned from, when they were left out: a sample.
    #[must_use]
    pub fn known_ratios(&self) -> Vec<f64> {
        self.doubt.known_ratios(&self.place.points)
    }

    /// What readings (channels × touches, in the unit that was learned from) say, touch by touch.
    #[must_use]
    pub fn find(&self, x: &SignalMatrix) -> Vec<Estimate> {
        let features = self.inputs.apply(x);
        let squared = self.place.squared_distances(&features);
        let places = self.frame.back(&self.place.answer(&squared));
        let radii = self.doubt.radii(&squared);
        let forces = self.force.as_ref().map(|force| {
            let squared = force.machine.squared_distances(&features);
            force.scale.back(&force.machine.answer(&squared))
        });
        (places.into_iter().zip(radii).enumerate())
            .map(|(t, (place_mm, radius))| Estimate {
                place_mm,
                radius_mm: radius * self.frame.size,
                force_n: forces.as_ref().map(|f| f[t]),
            })
            .collect()
    }
}
