//! How much is spent at every stage: one value a knob.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::spent::{
    ELEMENTS_PERCENT, EXPECTED_PLACES, EXPECTED_PRESSES, FOLDS, Knob, MOST_CANDIDATES,
    SELECTION_CANDIDATES, SELECTION_TOUCHES, SIGNALS, SVR_TOLERANCE_MM, Spent, TOUCHES,
    TUNING_TOUCHES, UNEXPLAINED, USUAL, USUAL_UNEXPLAINED, VERTICES,
};
use crate::budget::{Budget, BudgetLimits, Quality};
use crate::dataset::Signal;
use crate::design::{Inputs, walled};
use crate::evaluation::EstimatorKind;
use crate::placement::SelectorKind;
use crate::plain;
use crate::project::{BadValue, Project};

/// A point of the trade: everything that says how much is spent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TradeSetting {
    /// The quality that what is no knob comes from. A setting without limits is that quality itself.
    pub quality: Quality,
    /// Added to the project's seed: how much an error moves when nothing else does.
    pub repeat: u64,
    /// Who chooses.
    pub selector: SelectorKind,
    /// What the sites report.
    pub signal: Signal,
    /// Share of the variance that candidates may leave unexplained.
    pub unexplained: f64,
    /// What finds the touches that the setting is judged by.
    pub estimator: EstimatorKind,
    /// Values of its own; absent where it is the quality as it is.
    pub limits: Option<Spent>,
}

impl TradeSetting {
    /// A quality by its name, with the project's own selector, signal, variance and estimator.
    #[must_use]
    pub fn named(project: &Project, quality: Quality) -> Self {
        Self {
            quality,
            repeat: 0,
            selector: project.selection.selector,
            signal: project.gauge.signal,
            unexplained: project.candidates.unexplained,
            estimator: project.judging().estimator(),
            limits: None,
        }
    }

    /// Where a sweep begins: cheap, and in the middle of every ladder.
    #[must_use]
    pub fn centre(project: &Project) -> Self {
        Self {
            unexplained: USUAL_UNEXPLAINED,
            limits: Some(USUAL),
            ..Self::named(project, Quality::Draft)
        }
        .canonical()
    }

    /// Where a sweep looks for accuracy: every ladder further up.
    #[must_use]
    pub fn fine(project: &Project) -> Self {
        let centre = Self::centre(project);
        let limits = centre.limits.map(|spent| Spent {
            vertices: 4800,
            touches: 1600,
            expected_places: 640,
            expected_presses: 192,
            selection_touches: 400,
            selection_candidates: 80,
            ..spent
        });
        Self { limits, ..centre }.canonical()
    }

    /// Makes a project compute at this setting. What that costs and achieves is that of the point where the setting
    /// answers the project ([`Self::answers`]); others also take [`Self::part`] and [`Self::budget`].
    pub fn apply(&self, project: &mut Project) {
        project.budget.quality = self.quality;
        project.budget.seed = project.budget.seed.wrapping_add(self.repeat);
        project.selection.selector = self.selector;
        project.selection.compare = false;
        project.gauge.signal = self.signal;
        if self.signal != Signal::Strain {
            project.gauge.directions = 1;
        }
        if project.judging().estimator() != self.estimator {
            project.evaluation.estimator = self.estimator;
        }
        if self.uses(Knob::Unexplained) {
            project.candidates.unexplained = self.unexplained;
        }
        project.budget.limits = self.budget_limits();
    }

    /// What a project that this was applied to may spend here: also what is measured but offered to nobody, because
    /// it was found to buy nothing.
    #[must_use]
    pub fn budget(&self, project: &Project) -> Budget {
        let mut budget = project.budget.budget();
        if let Some(spent) = self.limits {
            budget.point_tip = spent.point_tip;
            budget.folds = spent.folds;
            budget.svr_tolerance_mm = spent.svr_tolerance_mm;
        }
        budget
    }

    fn budget_limits(&self) -> BudgetLimits {
        let Some(spent) = self.limits else {
            return BudgetLimits::default();
        };
        let used = |knob: Knob, count: usize| self.uses(knob).then_some(count);
        BudgetLimits {
            elements_percent: Some(ELEMENTS_PERCENT),
            vertices: Some(spent.vertices),
            touches: Some(spent.touches),
            candidates: used(Knob::Unexplained, MOST_CANDIDATES),
            expected_places: used(Knob::ExpectedPlaces, spent.expected_places),
            expected_presses: used(Knob::ExpectedPresses, spent.expected_presses),
            selection_touches: used(Knob::SelectionTouches, spent.selection_touches),
            selection_candidates: used(Knob::SelectionCandidates, spent.selection_candidates),
            tuning_touches: used(Knob::TuningTouches, spent.tuning_touches),
        }
    }

    /// The part as this setting takes it.
    ///
    /// # Errors
    /// [`BadValue`] where a solid is to be taken as one.
    pub fn part(&self, inputs: &Inputs) -> Result<Inputs, BadValue> {
        if !self.is_as_solid() {
            return Ok(inputs.clone());
        }
        walled(inputs).ok_or_else(|| BadValue {
            key: "part.model".into(),
            rule: "\"shell\" for its wall to be taken as a solid".into(),
            value: "\"solid\"".into(),
        })
    }

    /// Whether a shell's wall is taken as a solid.
    #[must_use]
    pub fn is_as_solid(&self) -> bool {
        self.limits.is_some_and(|spent| spent.as_solid)
    }

    /// How far (m) the face that touches press on lies above the project's own.
    #[must_use]
    pub fn raised(&self, project: &Project) -> f64 {
        if self.is_as_solid() {
            project.part.thickness() / 2.0
        } else {
            0.0
        }
    }

    /// Whether a project computes at this setting already, but for selectors that are compared.
    #[must_use]
    pub fn is_of(&self, project: &Project) -> bool {
        self.is_at(project, project.budget.quality, &project.budget.limits)
    }

    /// As [`Self::is_of`], at a quality and limits that need not be the project's.
    #[must_use]
    pub fn is_at(&self, project: &Project, quality: Quality, limits: &BudgetLimits) -> bool {
        self.answers(project)
            && (quality, *limits) == (self.quality, self.budget_limits())
            && self.selector == project.selection.selector
            && (self.unexplained == project.candidates.unexplained || !self.uses(Knob::Unexplained))
    }

    /// Whether a project can be computed so, and it answers the project's own question: with its signal and the
    /// estimator that it is judged by.
    #[must_use]
    pub fn answers(&self, project: &Project) -> bool {
        self.signal == project.gauge.signal
            && self.estimator == project.judging().estimator()
            && self.repeat == 0
            && self.limits.is_none_or(|spent| spent.is_offered())
    }

    /// Whether anything at this setting uses a knob. What greedy SVR scores and regressions are tuned on is nothing to
    /// expected error and matching; candidates are greedy SVR's, and the baseline of a regression.
    #[must_use]
    pub fn uses(&self, knob: Knob) -> bool {
        let greedy = self.selector == SelectorKind::GreedySvr;
        let trained = self.estimator == EstimatorKind::Svr;
        match knob {
            Knob::Vertices | Knob::Touches | Knob::AsSolid | Knob::Selector | Knob::Signal => true,
            Knob::Estimator => self.signal == Signal::Strain,
            Knob::ExpectedPlaces | Knob::ExpectedPresses => {
                self.selector == SelectorKind::ExpectedError
            }
            Knob::SelectionTouches | Knob::SelectionCandidates => greedy,
            Knob::Unexplained | Knob::SvrTolerance | Knob::Folds => greedy || trained,
            Knob::PointTip | Knob::TuningTouches => trained,
        }
    }

    /// The same with knobs that nothing uses at their usual places, so that equal work is one setting.
    #[must_use]
    pub fn canonical(mut self) -> Self {
        if self.signal != Signal::Strain {
            self.estimator = EstimatorKind::Svr;
        }
        let Some(mut spent) = self.limits else {
            return self;
        };
        let used = |knob| self.uses(knob);
        if !used(Knob::ExpectedPlaces) {
            spent.expected_places = USUAL.expected_places;
            spent.expected_presses = USUAL.expected_presses;
        }
        if !used(Knob::SelectionTouches) {
            spent.selection_touches = USUAL.selection_touches;
            spent.selection_candidates = USUAL.selection_candidates;
        }
        if !used(Knob::Folds) {
            spent.folds = USUAL.folds;
            spent.svr_tolerance_mm = USUAL.svr_tolerance_mm;
        }
        if !used(Knob::TuningTouches) {
            spent.tuning_touches = USUAL.tuning_touches;
            spent.point_tip = USUAL.point_tip;
        }
        if !used(Knob::Unexplained) {
            self.unexplained = USUAL_UNEXPLAINED;
        }
        spent.selection_touches = spent.selection_touches.min(spent.touches);
        spent.tuning_touches = spent.tuning_touches.min(spent.touches);
        self.limits = Some(spent);
        self
    }

    /// What is really looked at: no more places and presses than there are touches.
    fn looked_at(mut self) -> Self {
        if let Some(spent) = &mut self.limits {
            spent.expected_places = spent.expected_places.min(spent.touches);
            spent.expected_presses = spent.expected_presses.min(spent.touches);
        }
        self
    }

    /// The settings one step away along a knob: none where nothing uses it.
    #[must_use]
    pub fn neighbours(&self, knob: Knob) -> Vec<Self> {
        let mut found: Vec<Self> = match self.limits {
            Some(spent) if self.uses(knob) => self.turned(knob, spent),
            _ => Vec::new(),
        };
        for setting in &mut found {
            *setting = setting.canonical();
        }
        found.retain(|s| s.looked_at() != self.looked_at());
        found
    }

    fn turned(&self, knob: Knob, spent: Spent) -> Vec<Self> {
        let with = |spent: Spent| Self {
            limits: Some(spent),
            ..*self
        };
        match knob {
            Knob::Vertices => beside(&VERTICES, spent.vertices, |vertices| {
                with(Spent { vertices, ..spent })
            }),
            Knob::Touches => beside(&TOUCHES, spent.touches, |touches| {
                with(Spent { touches, ..spent })
            }),
            Knob::PointTip => vec![with(Spent {
                point_tip: !spent.point_tip,
                ..spent
            })],
            Knob::AsSolid => vec![with(Spent {
                as_solid: !spent.as_solid,
                ..spent
            })],
            Knob::Unexplained => beside(&UNEXPLAINED, self.unexplained, |unexplained| Self {
                unexplained,
                ..*self
            }),
            Knob::Selector => others(&SelectorKind::ALL, self.selector, |selector| Self {
                selector,
                ..*self
            }),
            Knob::ExpectedPlaces => beside(&EXPECTED_PLACES, spent.expected_places, |places| {
                with(Spent {
                    expected_places: places,
                    ..spent
                })
            }),
            Knob::ExpectedPresses => beside(&EXPECTED_PRESSES, spent.expected_presses, |presses| {
                with(Spent {
                    expected_presses: presses,
                    ..spent
                })
            }),
            Knob::SelectionTouches => {
                beside(&SELECTION_TOUCHES, spent.selection_touches, |touches| {
                    with(Spent {
                        selection_touches: touches,
                        ..spent
                    })
                })
            }
            Knob::SelectionCandidates => {
                let now = spent.selection_candidates;
                beside(&SELECTION_CANDIDATES, now, |candidates| {
                    with(Spent {
                        selection_candidates: candidates,
                        ..spent
                    })
                })
            }
            Knob::SvrTolerance => beside(&SVR_TOLERANCE_MM, spent.svr_tolerance_mm, |mm| {
                with(Spent {
                    svr_tolerance_mm: mm,
                    ..spent
                })
            }),
            Knob::Folds => beside(&FOLDS, spent.folds, |folds| with(Spent { folds, ..spent })),
            Knob::TuningTouches => beside(&TUNING_TOUCHES, spent.tuning_touches, |touches| {
                with(Spent {
                    tuning_touches: touches,
                    ..spent
                })
            }),
            Knob::Signal => others(&SIGNALS, self.signal, |signal| Self { signal, ..*self }),
            Knob::Estimator => others(&EstimatorKind::ALL, self.estimator, |estimator| Self {
                estimator,
                ..*self
            }),
        }
    }

    /// How far a knob is turned up; settings of one rank are not compared.
    #[must_use]
    pub fn rank(&self, knob: Knob) -> f64 {
        let of = |value: fn(&Spent) -> f64| self.limits.as_ref().map_or(f64::NAN, value);
        match knob {
            Knob::Vertices => of(|s| s.vertices as f64),
            Knob::Touches => of(|s| s.touches as f64),
            Knob::PointTip => of(|s| f64::from(u8::from(s.point_tip))),
            Knob::AsSolid => of(|s| f64::from(u8::from(s.as_solid))),
            Knob::Unexplained => -self.unexplained,
            Knob::Selector => f64::from(u8::from(self.selector == own_selector(self.estimator))),
            Knob::ExpectedPlaces => of(|s| s.expected_places as f64),
            Knob::ExpectedPresses => of(|s| s.expected_presses as f64),
            Knob::SelectionTouches => of(|s| s.selection_touches as f64),
            Knob::SelectionCandidates => of(|s| s.selection_candidates as f64),
            Knob::SvrTolerance => of(|s| -s.svr_tolerance_mm),
            Knob::Folds => of(|s| s.folds as f64),
            Knob::TuningTouches => of(|s| s.tuning_touches as f64),
            Knob::Signal => f64::from(u8::from(self.signal != Signal::Strain)),
            Knob::Estimator => f64::from(u8::from(self.estimator == EstimatorKind::Matching)),
        }
    }

    /// The one knob that two settings differ in.
    #[must_use]
    pub fn differs_in(&self, other: &Self) -> Option<Knob> {
        let mut one = Knob::ALL
            .into_iter()
            .filter(|&knob| self.neighbours(knob).contains(other));
        let knob = one.next()?;
        one.next().is_none().then_some(knob)
    }

    /// In words, for tables and tooltips.
    #[must_use]
    pub fn in_words(&self) -> String {
        let Some(spent) = &self.limits else {
            return format!("the quality “{}”", self.quality.name());
        };
        let mut words = format!("{} vertices, {} touches", spent.vertices, spent.touches);
        if self.uses(Knob::Unexplained) {
            let percent = plain::digits(100.0 * self.unexplained);
            let _ = write!(words, ", {percent} % unexplained");
        }
        let _ = write!(words, ", {}", self.selector.title());
        if self.uses(Knob::ExpectedPlaces) {
            let (places, presses) = (spent.expected_places, spent.expected_presses);
            let _ = write!(words, " on {places} places × {presses} presses");
        }
        if self.uses(Knob::SelectionTouches) {
            let (touches, candidates) = (spent.selection_touches, spent.selection_candidates);
            let _ = write!(words, " on {touches} touches × {candidates} candidates");
        }
        if self.uses(Knob::Folds) {
            let _ = write!(words, ", {} folds", spent.folds);
        }
        if self.uses(Knob::TuningTouches) {
            let _ = write!(words, ", tuned on {}", spent.tuning_touches);
        }
        if self.uses(Knob::SvrTolerance) {
            let _ = write!(words, ", to {} mm", spent.svr_tolerance_mm);
        }
        if spent.as_solid {
            words += ", as a solid";
        }
        if spent.point_tip {
            words += ", point tip";
        }
        format!("{words}, {}, {}", self.signal.name(), self.estimator.name())
    }
}

/// The selector that chooses for an estimator.
fn own_selector(estimator: EstimatorKind) -> SelectorKind {
    match estimator {
        EstimatorKind::Matching => SelectorKind::ExpectedError,
        EstimatorKind::Svr => SelectorKind::GreedySvr,
    }
}

/// The steps of a ladder below and above a value; the ends of the ladder have one.
fn beside<T: Copy + PartialOrd>(
    ladder: &[T],
    now: T,
    with: impl Fn(T) -> TradeSetting,
) -> Vec<TradeSetting> {
    // Ladders fall where less is dearer.
    let falls = ladder.first() > ladder.last();
    let before = |&&step: &&T| if falls { step > now } else { step < now };
    let after = |&&step: &&T| if falls { step < now } else { step > now };
    let below = ladder.iter().rfind(before);
    let above = ladder.iter().find(after);
    below.into_iter().chain(above).map(|&s| with(s)).collect()
}

fn others<T: Copy + PartialEq>(
    all: &[T],
    now: T,
    with: impl Fn(T) -> TradeSetting,
) -> Vec<TradeSetting> {
    all.iter()
        .filter(|&&x| x != now)
        .map(|&x| with(x))
        .collect()
}

#[cfg(test)]
mod tests;
