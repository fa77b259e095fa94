//! What a computation may spend, what it did spend, and how it says so.
//!
//! Every long function of the core takes a [`Watch`], reports [`Progress`] to it and stops when it says
//! so; every result carries [`Work`] (what was counted) and [`Achieved`] (what was reached).

use std::ops::{AddAssign, ControlFlow};

use serde::{Serialize, Serializer};

/// How far one stage has come: `done` of `total` units of its own choosing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Name of the stage, for people.
    pub stage: &'static str,
    /// Units that are finished.
    pub done: usize,
    /// Units in all.
    pub total: usize,
}

/// Called from inside core loops, possibly from several threads at once; `Break` asks them to stop.
pub type Watch<'a> = &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync);

/// A watch that never stops anything.
pub fn unwatched(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The caller asked for a stop; nothing was produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Reports to the watch and turns its `Break` into an error for `?`.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn report(
    watch: Watch,
    stage: &'static str,
    done: usize,
    total: usize,
) -> Result<(), Cancelled> {
    match watch(Progress { stage, done, total }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Cancelled),
    }
}

/// Work counted by the core: tests and the speed-against-accuracy trade lean on these, not on a clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Work {
    /// Stiffness matrices assembled.
    pub assemblies: u64,
    /// Sparse factorizations.
    pub factorizations: u64,
    /// Right-hand sides solved.
    pub solves: u64,
    /// Entries of kernel matrices evaluated.
    pub kernel_evaluations: u64,
    /// Regression models fitted (one a coordinate).
    pub fits: u64,
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.assemblies += other.assemblies;
        self.factorizations += other.factorizations;
        self.solves += other.solves;
        self.kernel_evaluations += other.kernel_evaluations;
        self.fits += other.fits;
    }
}

/// Why a computation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The tolerance asked for was reached.
    Converged,
    /// The effort allowed was spent first.
    EffortSpent,
    /// The data carry no more information (numerical rank reached).
    Exhausted,
    /// What was asked for (spacing, what all may cost) leaves no room for more.
    NoRoom,
}

/// What was really reached, beside what was asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Achieved {
    /// In `unit`; absent where no estimate exists.
    pub error_estimate: Option<f64>,
    /// Unit of the estimate.
    pub unit: &'static str,
    /// What was counted on the way.
    pub effort: Work,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// What may change a decision, in plain words: the weightiest first.
    pub cautions: Vec<String>,
    /// How the number came about.
    pub notes: Vec<String>,
}

impl Achieved {
    /// All that there is to say, what may change a decision first.
    pub fn words(&self) -> impl Iterator<Item = &String> {
        self.cautions.iter().chain(&self.notes)
    }
}

/// The three named trades; each only builds an explicit [`Budget`].
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, serde::Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// Seconds: while something is still being tried out.
    Draft,
    /// The default: errors small beside those of the estimator.
    #[default]
    Standard,
    /// Minutes: to see whether Standard was enough.
    Reference,
}

/// Most triangles of the mesh that live touch knows the readings on: finer than a tip needs on all but large parts.
pub const MAP_TRIANGLES: usize = 30_000;

impl Quality {
    /// All, the cheapest first.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Standard, Self::Reference];

    /// As in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::Reference => "reference",
        }
    }

    /// As it is shown.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Draft => "Draft",
            Self::Standard => "Standard",
            Self::Reference => "Reference",
        }
    }

    /// The most each stage may spend. Counts in the project below these are kept.
    #[must_use]
    pub fn budget(self) -> Budget {
        match self {
            Self::Draft => Budget {
                quality: self,
                elements: ElementBudget {
                    vertices: 2400,
                    most_vertices: 6000,
                    effort: 2_400_000,
                    displacement_percent: 5.0,
                    strain_percent: 10.0,
                    passes: 1,
                },
                touches: 800,
                point_tip: false,
                test_touches: 300,
                candidates: 60,
                locations: 600,
                selection_touches: 400,
                selection_candidates: 40,
                expected_places: 240,
                expected_presses: 384,
                map_triangles: 12_000,
                folds: 3,
                tuning_touches: 300,
                failure_subsets: 4,
                failure_touches: 400,
                svr_steps: 300_000,
                svr_tolerance_mm: 0.1,
            },
            Self::Standard => Budget {
                quality: self,
                elements: ElementBudget {
                    vertices: 3000,
                    most_vertices: 24_000,
                    effort: 14_000_000,
                    displacement_percent: 2.0,
                    strain_percent: 5.0,
                    passes: 2,
                },
                touches: usize::MAX,
                point_tip: false,
                test_touches: 800,
                candidates: usize::MAX,
                locations: 4000,
                selection_touches: 4000,
                selection_candidates: 407,
                expected_places: 1024,
                expected_presses: 510,
                map_triangles: MAP_TRIANGLES,
                folds: 5,
                tuning_touches: 1000,
                failure_subsets: 12,
                failure_touches: 1200,
                svr_steps: 1_000_000,
                svr_tolerance_mm: 0.1,
            },
            Self::Reference => Budget {
                quality: self,
                elements: ElementBudget {
                    vertices: 10_000,
                    most_vertices: 80_000,
                    effort: 60_000_000,
                    displacement_percent: 1.0,
                    strain_percent: 2.0,
                    passes: 3,
                },
                touches: usize::MAX,
                point_tip: false,
                test_touches: 2000,
                candidates: usize::MAX,
                locations: 6000,
                selection_touches: 8000,
                selection_candidates: 1000,
                expected_places: 1600,
                expected_presses: 1020,
                map_triangles: MAP_TRIANGLES,
                folds: 5,
                tuning_touches: 1600,
                failure_subsets: 252,
                failure_touches: 4000,
                svr_steps: 10_000_000,
                svr_tolerance_mm: 0.02,
            },
        }
    }
}

/// How fine an elastic model is to be and what it may cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ElementBudget {
    /// Vertices to begin with, and the most whatever the number of loads.
    pub vertices: usize,
    /// Most vertices, however few the loads are.
    pub most_vertices: usize,
    /// The most vertices × loads.
    #[serde(serialize_with = "or_null")]
    pub effort: usize,
    /// Estimated errors at which no more are added (%): rms over the loads of the displacement under the
    /// load, and of the strain beyond two tip radii over the load's largest.
    pub displacement_percent: f64,
    /// Estimated error of the strain (%) at which no more elements are added.
    pub strain_percent: f64,
    /// How often elements are laid anew by the error of the last ones.
    pub passes: usize,
}

impl ElementBudget {
    /// The most vertices for this many loads.
    #[must_use]
    pub fn most_for(&self, loads: usize) -> usize {
        (self.effort / loads.max(1)).clamp(self.vertices, self.most_vertices)
    }
}

/// A limit as it is written for others: nothing where there is none.
#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn or_null<S: Serializer>(limit: &usize, serializer: S) -> Result<S::Ok, S::Error> {
    let limit = Some(*limit).filter(|&limit| limit != usize::MAX);
    limit.serialize(serializer)
}

/// An explicit budget: the largest effort each stage may spend, and the tolerances it works to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Budget {
    /// The quality that it is of.
    pub quality: Quality,
    /// Size of the elastic model. The reference model that accuracy is quoted against always has elements of half
    /// their size; of a solid two thirds.
    pub elements: ElementBudget,
    /// Most touches the model is asked for.
    #[serde(serialize_with = "or_null")]
    pub touches: usize,
    /// Whether the tip is taken as a point where the model learns; what judges it has the tip as it is.
    pub point_tip: bool,
    /// Unseen touches that evaluation uses.
    pub test_touches: usize,
    /// Most candidates kept by the reduction.
    #[serde(serialize_with = "or_null")]
    pub candidates: usize,
    /// Most sites that the Gaussian process knows; half as many again where no gauge can go.
    pub locations: usize,
    /// Most touches that greedy SVR scores its candidates on.
    pub selection_touches: usize,
    /// Most candidates that greedy SVR scores.
    pub selection_candidates: usize,
    /// Places that a choice by expected error compares readings with, and presses that it is tried on.
    pub expected_places: usize,
    /// Presses that a choice by expected error is tried on.
    pub expected_presses: usize,
    /// Most triangles of the mesh on which an evaluation knows what gauges read of touches anywhere.
    pub map_triangles: usize,
    /// Folds of every cross-validation.
    pub folds: usize,
    /// Most touches that hyper-parameters are searched on.
    pub tuning_touches: usize,
    /// Most subsets of failed gauges that the regression is trained anew for, and on how many touches.
    pub failure_subsets: usize,
    /// Touches that such a regression is retrained on.
    pub failure_touches: usize,
    /// Most SMO steps of one fit.
    pub svr_steps: usize,
    /// Largest violation of the optimality conditions at which a fit counts as converged, in mm of
    /// the target.
    pub svr_tolerance_mm: f64,
}
/// Limits in place of a quality's own, each where it is given: the knobs of speed against accuracy that a
/// measured setting turns (`hapdef trade`), without those that were found to buy nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BudgetLimits {
    /// Estimated error of the displacement (%) at which no elements are added; that of strains follows it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elements_percent: Option<f64>,
    /// Most vertices of the elastic model, whatever the number of touches; cells of a solid in proportion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Most touches the model is asked for, and most candidates that the reduction keeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touches: Option<usize>,
    /// Most candidates that the reduction keeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidates: Option<usize>,
    /// Most places and presses that a choice by expected error looks at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_places: Option<usize>,
    /// Most presses that a choice by expected error is tried on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_presses: Option<usize>,
    /// Most touches and candidates that greedy SVR scores.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub selection_touches: Option<usize>,
    /// Most candidates that greedy SVR scores.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub selection_candidates: Option<usize>,
    /// Most touches that hyper-parameters are searched on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tuning_touches: Option<usize>,
}

impl BudgetLimits {
    /// Whether none is given.
    #[must_use]
    pub fn are_none(&self) -> bool {
        *self == Self::default()
    }
}

impl Budget {
    /// The same with limits in place of some of its own.
    #[must_use]
    pub fn within(mut self, limits: &BudgetLimits) -> Self {
        if let Some(percent) = limits.elements_percent {
            let elements = &mut self.elements;
            elements.strain_percent *= percent / elements.displacement_percent;
            elements.displacement_percent = percent;
        }
        if let Some(vertices) = limits.vertices {
            self.elements.vertices = self.elements.vertices.min(vertices);
            self.elements.most_vertices = vertices;
            self.elements.effort = usize::MAX;
        }
        let counts = [
            (&mut self.touches, limits.touches),
            (&mut self.candidates, limits.candidates),
            (&mut self.expected_places, limits.expected_places),
            (&mut self.expected_presses, limits.expected_presses),
            (&mut self.selection_touches, limits.selection_touches),
            (&mut self.selection_candidates, limits.selection_candidates),
            (&mut self.tuning_touches, limits.tuning_touches),
        ];
        for (own, limit) in counts {
            *own = limit.unwrap_or(*own);
        }
        self
    }
}
