//! How much is spent at every stage: one value a knob.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::budget::{Budget, Limits, Quality};
use crate::dataset::Signal;
use crate::design::{Inputs, walled};
use crate::evaluation::EstimatorKind;
use crate::placement::SelectorKind;
use crate::project::{BadValue, Project};

/// A point of the trade: everything that says how much is spent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The quality that what is no knob comes from. A setting without limits is that quality itself.
    pub quality: Quality,
    /// Added to the project's seed: how much an error moves when nothing else does.
    pub repeat: u64,
    pub selector: SelectorKind,
    pub signal: Signal,
    /// Share of the variance that candidates may leave unexplained.
    pub unexplained: f64,
    /// What finds the touches that the setting is judged by.
    pub estimator: EstimatorKind,
    pub limits: Option<Spent>,
}

/// The knobs with values of their own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// Most vertices of the elastic model.
    pub vertices: usize,
    pub touches: usize,
    pub point_tip: bool,
    /// The wall of a shell as the solid that it is.
    pub as_solid: bool,
    /// What a choice by expected error looks at.
    pub expected_places: usize,
    pub expected_presses: usize,
    /// What greedy SVR scores.
    pub selection_touches: usize,
    pub selection_candidates: usize,
    /// Of regressions, where any are trained.
    pub svr_tolerance_mm: f64,
    pub folds: usize,
    pub tuning_touches: usize,
}

/// Where the ladders begin, and where a knob stands that nothing uses.
const USUAL: Spent = Spent {
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
const USUAL_UNEXPLAINED: f64 = 0.05;

/// Of what was found to buy nothing beyond and is offered to nobody.
const FIXED_FOLDS: usize = 3;
const FIXED_TOLERANCE_MM: f64 = 0.1;
const FIXED_TUNING: usize = 100;

impl Spent {
    /// Whether a project can ask for it.
    fn is_offered(&self) -> bool {
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
    Vertices,
    Touches,
    PointTip,
    AsSolid,
    Unexplained,
    Selector,
    ExpectedPlaces,
    ExpectedPresses,
    SelectionTouches,
    SelectionCandidates,
    SvrTolerance,
    Folds,
    TuningTouches,
    Signal,
    Estimator,
}

const VERTICES: [usize; 7] = [300, 600, 1200, 2400, 4800, 9600, 19_200];
const TOUCHES: [usize; 6] = [100, 200, 400, 800, 1600, 3200];
const UNEXPLAINED: [f64; 5] = [0.2, 0.1, 0.05, 0.02, 0.01];
const EXPECTED_PLACES: [usize; 5] = [80, 160, 320, 640, 1280];
const EXPECTED_PRESSES: [usize; 5] = [24, 48, 96, 192, 384];
const SELECTION_TOUCHES: [usize; 5] = [50, 100, 200, 400, 800];
const SELECTION_CANDIDATES: [usize; 5] = [20, 40, 80, 160, 320];
const SVR_TOLERANCE_MM: [f64; 4] = [1.0, 0.3, 0.1, 0.02];
const FOLDS: [usize; 3] = [2, 3, 5];
const TUNING_TOUCHES: [usize; 4] = [50, 100, 300, 1000];
const SIGNALS: [Signal; 3] = [
    Signal::Strain,
    Signal::NormalDisplacement,
    Signal::Displacement,
];
/// Estimated error of displacements (%) below which no vertices are added, however many are allowed.
const ELEMENTS_PERCENT: f64 = 0.5;
/// No fewer candidates than the variance that they are to explain asks for.
const MOST_CANDIDATES: usize = 100_000;

impl Knob {
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

impl Setting {
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

    fn budget_limits(&self) -> Limits {
        let Some(spent) = self.limits else {
            return Limits::default();
        };
        let used = |knob: Knob, count: usize| self.uses(knob).then_some(count);
        Limits {
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
            project.part.thickness_mm * 1e-3 / 2.0
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
    pub fn is_at(&self, project: &Project, quality: Quality, limits: &Limits) -> bool {
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
            let percent = (self.unexplained * 1000.0).round() / 10.0;
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
fn beside<T: Copy + PartialOrd>(ladder: &[T], now: T, with: impl Fn(T) -> Setting) -> Vec<Setting> {
    // Ladders fall where less is dearer.
    let falls = ladder.first() > ladder.last();
    let before = |&&step: &&T| if falls { step > now } else { step < now };
    let after = |&&step: &&T| if falls { step < now } else { step > now };
    let below = ladder.iter().rfind(before);
    let above = ladder.iter().find(after);
    below.into_iter().chain(above).map(|&s| with(s)).collect()
}

fn others<T: Copy + PartialEq>(all: &[T], now: T, with: impl Fn(T) -> Setting) -> Vec<Setting> {
    all.iter()
        .filter(|&&x| x != now)
        .map(|&x| with(x))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_answers_a_project_can_be_asked_of_it() {
        let project = Project::around("a.stl", None);
        let mut settings = vec![
            Setting::centre(&project),
            Setting::fine(&project),
            Setting::named(&project, Quality::Draft),
        ];
        for k in 0..2 {
            let around: Vec<Setting> = (Knob::ALL.iter())
                .flat_map(|&knob| settings[k].neighbours(knob))
                .collect();
            settings.extend(around);
        }
        let mut answering = 0;
        for setting in settings.iter().filter(|s| s.answers(&project)) {
            let mut applied = project.clone();
            setting.apply(&mut applied);
            assert_eq!(
                setting.budget(&applied),
                applied.budget.budget(),
                "{setting:?}"
            );
            assert!(setting.is_of(&applied));
            applied.check().unwrap();
            answering += 1;
        }
        assert!(answering > 20, "{answering}");
    }

    #[test]
    fn knobs_that_nothing_hears_stay_where_they_are() {
        let project = Project::around("a.stl", None);
        let centre = Setting::centre(&project);
        let offered = |s: &Setting| -> Vec<Knob> {
            let turns = |knob: &Knob| !s.neighbours(*knob).is_empty();
            Knob::ALL.into_iter().filter(turns).collect()
        };
        assert_eq!(
            offered(&centre),
            [
                Knob::Vertices,
                Knob::Touches,
                Knob::AsSolid,
                Knob::Selector,
                Knob::ExpectedPlaces,
                Knob::ExpectedPresses,
                Knob::Signal,
                Knob::Estimator
            ]
        );
        // The paper's way has the knobs of its regressions, and their way back ends where it began.
        let mut paper = project.clone();
        paper.evaluation.estimator = EstimatorKind::Svr;
        paper.selection.selector = SelectorKind::GreedySvr;
        let trained = Setting::centre(&paper);
        for knob in [
            Knob::Unexplained,
            Knob::SelectionTouches,
            Knob::Folds,
            Knob::TuningTouches,
        ] {
            assert!(offered(&trained).contains(&knob), "{knob:?}");
            let turned = trained.neighbours(knob)[0];
            let back = Setting {
                selector: centre.selector,
                estimator: centre.estimator,
                ..turned
            };
            assert_eq!(back.canonical(), centre, "{knob:?}");
        }
        assert!(!centre.in_words().contains("folds") && trained.in_words().contains("folds"));
        // More places than there are touches are no other setting.
        let few = Setting {
            limits: centre.limits.map(|s| Spent { touches: 100, ..s }),
            ..centre
        }
        .canonical();
        assert_eq!(few.neighbours(Knob::ExpectedPlaces).len(), 0);
        assert_eq!(few.neighbours(Knob::Touches).len(), 1);
    }

    #[test]
    fn a_setting_is_judged_by_its_own_estimator() {
        let project = Project::around("a.stl", None);
        let centre = Setting::centre(&project);
        assert_eq!(centre.estimator, EstimatorKind::Matching);
        for setting in [centre, centre.neighbours(Knob::Estimator)[0]] {
            let mut applied = project.clone();
            setting.apply(&mut applied);
            assert_eq!(applied.judging().estimator(), setting.estimator);
        }
        // What nobody uses is left as the project has it.
        let mut applied = project.clone();
        centre.apply(&mut applied);
        assert_eq!(applied.candidates, project.candidates);
        assert_eq!(applied.evaluation, project.evaluation);
        let limits = applied.budget.limits;
        assert_eq!(
            (limits.selection_touches, limits.tuning_touches),
            (None, None)
        );
        // Sites that report displacements are judged by regression, whatever is asked for.
        let shifted = centre.neighbours(Knob::Signal)[0];
        shifted.apply(&mut applied);
        assert_eq!(applied.judging().estimator(), shifted.estimator);
    }
}
