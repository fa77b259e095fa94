//! What else says where a touch is, for comparison: estimators that were trained on the model or on presses.

use std::sync::Arc;

use glam::DVec3;

use super::update::Guess;
use crate::dataset::SignalMatrix;
use crate::inference::TrainedLive;
use crate::learning::TouchEstimator;
use crate::units;

/// Those that there are.
#[derive(Default)]
pub(super) struct Trained {
    /// Normalized and raw.
    pub model: [Option<Arc<TrainedLive>>; 2],
    /// The channels that these were trained with: with others they say nothing.
    pub channels: Vec<bool>,
    /// What was learned from presses alone: by all channels.
    pub presses: Option<Arc<TouchEstimator>>,
}

impl Trained {
    /// What each says of a reading (strain), where these channels are used: normalized, raw, learned from presses.
    pub fn guess(&self, strain: &[f64], used: &[bool]) -> [Option<Guess>; 3] {
        let guess = |(place, force): ([f64; 3], f64)| Guess {
            position: units::from_mm(DVec3::from_array(place)),
            force,
        };
        let of_model = |k: usize| {
            let trained = self.model[k].as_ref();
            trained.filter(|_| self.channels == used)
        };
        let of_presses = (self.presses.as_ref()).filter(|_| used.iter().all(|u| *u));
        let answer = of_presses.and_then(|l| l.find(&SignalMatrix::new(1, strain.to_vec())).pop());
        [
            of_model(0).map(|t| guess(t.find(strain))),
            of_model(1).map(|t| guess(t.find(strain))),
            answer.map(|a| guess((a.place_mm, a.force_n.unwrap_or(0.0)))),
        ]
    }
}
