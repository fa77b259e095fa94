//! What the pipeline is given, and what it answers.

use std::sync::Arc;

use glam::DVec3;

use crate::inference::{
    Chain, Contact, Deviations, Matching, ReadingErrors, ResponseMap, SeveralTouches,
};
use crate::uncertainty::{UNESTIMATED, Uncertainty};

/// Which estimator is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShownEstimator {
    /// Model matching.
    #[default]
    Matching,
    /// Regression on the readings over their norm.
    Normalized,
    /// Regression on the readings as they are: as in the paper.
    Raw,
    /// What was learned from presses alone, where there is one.
    Learned,
}

impl ShownEstimator {
    /// All, the default first.
    pub const ALL: [Self; 4] = [Self::Matching, Self::Normalized, Self::Raw, Self::Learned];

    /// For people.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Matching => "Model matching",
            Self::Normalized => "SVR on the normalized signal",
            Self::Raw => "SVR on the raw signal (paper)",
            Self::Learned => "Learned from presses",
        }
    }
}

/// What the pipeline must know beside the samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PipelineSettings {
    /// Gauge factor and active arms; what the board says of itself takes the place of the rest.
    pub chain: Chain,
    /// The board's channel of each gauge.
    pub channels: Vec<usize>,
    /// What model and gauges are off by, over the reading, where that is more than the model says of itself; see
    /// [`ReadingErrors::relative`].
    pub relative: f64,
    /// Noise of a reading below which it is never taken to be (strain).
    pub least_noise: f64,
    /// The largest force that anybody presses with (N).
    pub most_force: f64,
    /// Seconds in which the rest follows what channels read without a touch; nothing: never.
    pub drift_s: Option<f64>,
    /// Seconds of rest that a tare takes.
    pub tare_s: f64,
}

impl PipelineSettings {
    /// For so many gauges, the first channel for the first of them.
    #[must_use]
    pub fn of(gauges: usize) -> Self {
        Self {
            chain: Chain::default(),
            channels: (0..gauges).collect(),
            relative: UNESTIMATED,
            least_noise: 0.3e-6,
            most_force: 60.0,
            drift_s: Some(3.0),
            tare_s: 0.5,
        }
    }
}

/// Where and how hard, by an estimator that says no more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// m.
    pub position: DVec3,
    /// How hard (N).
    pub force: f64,
}

/// What one sample said.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveUpdate {
    /// The board's clock (µs).
    pub time_us: u64,
    /// Strain of each gauge since the tare; nothing before it.
    pub strain: Option<Vec<f64>>,
    /// By matching, while there is a touch: of several the hardest.
    pub contact: Option<Contact>,
    /// All that touch; absent where nothing does, and without a contact where nothing that is known does.
    pub touches: Option<SeveralTouches>,
    /// By the trained estimators, where they are trained and there is a touch: normalized, raw, learned from presses.
    pub guesses: [Option<Guess>; 3],
    /// Gauges that are trusted.
    pub good: usize,
    /// Share of the surface on which these do not feel a touch of [`super::LIGHT_N`]; nothing before the tare.
    pub blind: Option<f64>,
}

impl LiveUpdate {
    /// Before there is a rest, or of a board with too few channels.
    #[must_use]
    pub fn nothing(time_us: u64) -> Self {
        Self {
            time_us,
            strain: None,
            contact: None,
            touches: None,
            guesses: [None; 3],
            good: 0,
            blind: None,
        }
    }

    /// Where and how hard, by one of the estimators.
    #[must_use]
    pub fn by(&self, estimator: ShownEstimator) -> Option<Guess> {
        match estimator {
            ShownEstimator::Matching => self.contact.map(|c| Guess {
                position: c.position,
                force: c.force,
            }),
            ShownEstimator::Normalized => self.guesses[0],
            ShownEstimator::Raw => self.guesses[1],
            ShownEstimator::Learned => self.guesses[2],
        }
    }
}

/// What gauges read of a newton anywhere, and how far off that may be.
#[derive(Clone)]
pub struct GaugeModel {
    /// Readings as the gauges are thought to be glued.
    pub map: Arc<ResponseMap>,
    /// See [`ReadingErrors::deviations`].
    pub deviations: Option<Deviations>,
    /// What else is known to be off. Noise and resolution are read off the signals.
    pub off: Uncertainty,
}

impl From<Arc<ResponseMap>> for GaugeModel {
    /// Gauges just as the map says.
    fn from(map: Arc<ResponseMap>) -> Self {
        Self {
            map,
            deviations: None,
            off: Uncertainty::NONE,
        }
    }
}

impl GaugeModel {
    /// The estimator, with this noise of each channel (strain).
    pub(super) fn matching(self, noise: Vec<f64>, settings: &PipelineSettings) -> Matching {
        let channels = self.map.channels();
        let errors = ReadingErrors {
            noise,
            relative: settings.relative.max(self.off.elements),
            ..ReadingErrors::known(&self.off, channels, self.deviations)
        };
        Matching::new(self.map, errors, settings.most_force)
    }
}
