//! What may be spent, and on what: the knobs with their ladders.

use serde::{Deserialize, Serialize};

use crate::dataset::Signal;

/// The knobs with values of their own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// Most vertices of the elastic model.
    pub vertices: usize,
    /// Most touches that the model is asked for.
    pub touches: usize,
    /// Whether the tip is taken as a point where the model learns.
    pub point_tip: bool,
    /// The wall of a shell as the solid that it is.
    pub as_solid: bool,
    /// What a choice by expected error looks at.
    pub expected_places: usize,
    /// Presses that a choice by expected error is tried on.
    pub expected_presses: usize,
    /// What greedy SVR scores.
    pub selection_touches: usize,
    /// Most candidates that greedy SVR scores.
    pub selection_candidates: usize,
    /// Of regressions, where any are trained.
    pub svr_tolerance_mm: f64,
    /// Folds of cross-validations.
    pub folds: usize,
    /// Most touches that settings are searched on.
    pub tuning_touches: usize,
}

/// Where the ladders begin, and where a knob stands that nothing uses.
pub(super) const USUAL: Spent = Spent {
    vertices: 2400,
    touches: 400,
    point_tip: false,
    as_solid: false,
    expected_places: 320,
    expected_presses: 96,
    selection_touches: 200,
    selection_candidates: 40,
    svr_tolerance_mm: FIXED_TOLERANCE_MM,
    folds: FIXED_FOLDS,
    tuning_touches: FIXED_TUNING,
};
pub(super) const USUAL_UNEXPLAINED: f64 = 0.05;

/// Of what was found to buy nothing beyond and is offered to nobody.
const FIXED_FOLDS: usize = 3;
const FIXED_TOLERANCE_MM: f64 = 0.1;
const FIXED_TUNING: usize = 100;

impl Spent {
    /// Whether a project can ask for it.
    pub(super) fn is_offered(&self) -> bool {
        !self.as_solid
            && !self.point_tip
            && self.folds == FIXED_FOLDS
            && self.tuning_touches == FIXED_TUNING.min(self.touches)
            && self.svr_tolerance_mm == FIXED_TOLERANCE_MM
    }
}

/// What can be turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// Vertices of the elastic model.
    Vertices,
    /// Touches that the model is asked for.
    Touches,
    /// The tip as a point, or as it is.
    PointTip,
    /// A shell's wall taken as a solid.
    AsSolid,
    /// Variance that candidates may leave unexplained.
    Unexplained,
    /// Who chooses.
    Selector,
    /// Places that expected error compares.
    ExpectedPlaces,
    /// Presses that expected error is tried on.
    ExpectedPresses,
    /// Touches that greedy SVR scores on.
    SelectionTouches,
    /// Candidates that greedy SVR scores.
    SelectionCandidates,
    /// Tolerance of regressions.
    SvrTolerance,
    /// Folds of cross-validations.
    Folds,
    /// Touches that settings are searched on.
    TuningTouches,
    /// What the sites report.
    Signal,
    /// What locates the touches.
    Estimator,
}

pub(super) const VERTICES: [usize; 7] = [300, 600, 1200, 2400, 4800, 9600, 19_200];
pub(super) const TOUCHES: [usize; 6] = [100, 200, 400, 800, 1600, 3200];
pub(super) const UNEXPLAINED: [f64; 5] = [0.2, 0.1, 0.05, 0.02, 0.01];
pub(super) const EXPECTED_PLACES: [usize; 5] = [80, 160, 320, 640, 1280];
pub(super) const EXPECTED_PRESSES: [usize; 5] = [24, 48, 96, 192, 384];
pub(super) const SELECTION_TOUCHES: [usize; 5] = [50, 100, 200, 400, 800];
pub(super) const SELECTION_CANDIDATES: [usize; 5] = [20, 40, 80, 160, 320];
pub(super) const SVR_TOLERANCE_MM: [f64; 4] = [1.0, 0.3, 0.1, 0.02];
pub(super) const FOLDS: [usize; 3] = [2, 3, 5];
pub(super) const TUNING_TOUCHES: [usize; 4] = [50, 100, 300, 1000];
pub(super) const SIGNALS: [Signal; 3] = [
    Signal::Strain,
    Signal::NormalDisplacement,
    Signal::Displacement,
];
/// Estimated error of displacements (%) below which no vertices are added, however many are allowed.
pub(super) const ELEMENTS_PERCENT: f64 = 0.5;
/// No fewer candidates than the variance that they are to explain asks for.
pub(super) const MOST_CANDIDATES: usize = 100_000;

impl Knob {
    /// All, in the order of reports.
    pub const ALL: [Self; 15] = [
        Self::Vertices,
        Self::Touches,
        Self::PointTip,
        Self::AsSolid,
        Self::Unexplained,
        Self::Selector,
        Self::ExpectedPlaces,
        Self::ExpectedPresses,
        Self::SelectionTouches,
        Self::SelectionCandidates,
        Self::SvrTolerance,
        Self::Folds,
        Self::TuningTouches,
        Self::Signal,
        Self::Estimator,
    ];

    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertices of the model",
            Self::Touches => "touches of the model",
            Self::PointTip => "tip model: a point",
            Self::AsSolid => "shell taken as a solid",
            Self::Unexplained => "variance left unexplained",
            Self::Selector => "selector: the estimator's own",
            Self::ExpectedPlaces => "places that expected error compares",
            Self::ExpectedPresses => "presses that expected error tries",
            Self::SelectionTouches => "touches that greedy SVR scores on",
            Self::SelectionCandidates => "candidates that greedy SVR scores",
            Self::SvrTolerance => "tolerance of regressions",
            Self::Folds => "folds",
            Self::TuningTouches => "touches that settings are searched on",
            Self::Signal => "signal: displacements",
            Self::Estimator => "estimator: matching",
        }
    }
}
