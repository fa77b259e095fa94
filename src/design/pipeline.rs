//! The whole pipeline in one go, and what comes out of it.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::{
    Choosing, DesignError, Inputs, OnFound, ReducedSites, Reference, Simulated, evaluate,
    expected_errors, filter, reduce_sites, reference, refine, simulate, sites_to_judge,
};
use crate::budget::{Budget, Watch, Work};
use crate::evaluation::{Chooser, Evaluation, EvaluationRow, SetId};
use crate::feasible::Feasibility;
use crate::mesh::{TriMesh, scatter};
use crate::placement::candidates::Candidates;
use crate::placement::{Selection, SelectorKind, SensorSet};

/// Everything a design produced; what it shares with another costs nothing.
#[derive(Clone)]
pub struct Design {
    /// What might be spent.
    pub budget: Budget,
    /// The elastic stage.
    pub simulated: Arc<Simulated>,
    /// Which sites gauges fit on, and why not on the others.
    pub feasibility: Arc<Feasibility>,
    /// The feasible sites.
    pub reduced: Arc<ReducedSites>,
    /// What the feasible sites were reduced to; absent where nobody asked for that, and all of them are candidates.
    pub candidates: Option<Arc<Candidates>>,
    /// What each selector chose.
    pub selections: Arc<Vec<Selection>>,
    /// Whose sites are shown and reported.
    pub chosen_by: SelectorKind,
    /// Whether gauges of the chosen set were moved by hand.
    pub by_hand: bool,
    /// The model that judged.
    pub reference: Arc<Reference>,
    /// What it found.
    pub evaluation: Arc<Evaluation>,
    /// Time of each stage.
    pub seconds: Vec<StageTime>,
}

/// What is there already of a design: each as its stage would bring it anew from the same inputs.
#[derive(Clone, Default)]
pub struct KnownStages {
    /// Feasibility, and the sites that passed.
    pub reduced: Option<(Arc<Feasibility>, Arc<ReducedSites>)>,
    /// By the same selectors in the same order; of the simulation that goes with them, which has the gauges that were
    /// moved off its lattice.
    pub selections: Option<Arc<Vec<Selection>>>,
    /// Of the same simulation.
    pub reference: Option<Arc<Reference>>,
    /// Of these selections on this reference model, in whatever regions.
    pub evaluation: Option<Arc<Evaluation>>,
}

/// The steps of a design after its simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DesignStep {
    /// Filters and candidates.
    Reduce,
    /// The selectors.
    Select,
    /// The judge.
    Evaluate,
}

/// What a design tells while it is made. `clock` gives seconds since any fixed moment: the core has no
/// clock of its own.
#[derive(Clone, Copy)]
pub struct Hooks<'a> {
    /// Seconds since any fixed moment.
    pub clock: &'a dyn Fn() -> f64,
    /// Told of progress; may ask for a stop.
    pub watch: Watch<'a>,
    /// Told of each set as soon as it is known.
    pub found: OnFound<'a>,
    /// Told of each step as it begins.
    pub entered: &'a dyn Fn(DesignStep),
}

/// Seconds by the clock of one stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Name of the stage.
    pub stage: &'static str,
    /// Wall time (s).
    pub seconds: f64,
}

impl Design {
    /// How many sites are candidates: all feasible ones where they were not reduced.
    #[must_use]
    pub fn candidate_count(&self) -> usize {
        let reduced = self.candidates.as_ref();
        reduced.map_or(self.reduced.feasible.len(), |c| c.rows.len())
    }

    /// The selection that is shown and reported.
    #[must_use]
    pub fn chosen_selection(&self) -> Option<&Selection> {
        self.selections
            .iter()
            .find(|s| s.selector == self.chosen_by)
    }

    /// The chosen set: the project's selector at its number of gauges.
    #[must_use]
    pub fn chosen_set(&self) -> Option<&SensorSet> {
        self.chosen_selection().and_then(|s| s.sets.last())
    }

    /// The sites of [`Self::chosen_set`].
    #[must_use]
    pub fn chosen(&self) -> &[usize] {
        self.chosen_set().map_or(&[], |set| &set.sites)
    }

    /// Which of the judged sets [`Self::chosen_set`] is.
    #[must_use]
    pub fn chosen_id(&self) -> SetId {
        Chooser::from(self.chosen_by).set(self.chosen().len())
    }

    /// What the chosen set was found to do, over all touches.
    #[must_use]
    pub fn chosen_row(&self) -> Option<&EvaluationRow> {
        self.evaluation.over_all(self.chosen_id())
    }

    /// Errors touch by touch (mm) of a selector's set of so many gauges, beside the held-out touches of the reference model.
    #[must_use]
    pub fn touch_errors(&self, kind: SelectorKind, sensors: usize) -> Option<&[f64]> {
        let judged = self.evaluation.judged(Chooser::from(kind).set(sensors))?;
        Some(&judged.drawn)
    }

    /// The mean error (mm) around each vertex of a mesh that lies where the part does, for the chosen set.
    #[must_use]
    pub fn error_map(&self, mesh: &TriMesh) -> Option<Vec<f64>> {
        let errors = self.touch_errors(self.chosen_by, self.chosen().len())?;
        let places: Vec<(DVec3, DVec3)> = (self.reference.touches.iter())
            .map(|t| (t.position, t.normal))
            .collect();
        Some(scatter::to_vertices(mesh, &places, errors))
    }

    /// Share of the touches around each vertex of a mesh that the chosen gauges do not feel, of the lightest force (N) that
    /// was judged; absent where all are felt, or where nobody asked.
    #[must_use]
    pub fn blind_map(&self, mesh: &TriMesh) -> Option<(f64, Vec<f64>)> {
        let chosen = self.chosen_id();
        let found = self.evaluation.found.iter().filter(|m| m.set == chosen);
        let lightest = found.min_by(|a, b| a.force_n.total_cmp(&b.force_n))?;
        if !lightest.blind.contains(&true) {
            return None;
        }
        let blind: Vec<f64> = lightest
            .blind
            .iter()
            .map(|&b| f64::from(u8::from(b)))
            .collect();
        let places: Vec<(DVec3, DVec3)> = (self.reference.touches.iter())
            .map(|t| (t.position, t.normal))
            .collect();
        Some((
            lightest.force_n,
            scatter::to_vertices(mesh, &places, &blind),
        ))
    }

    /// What the Gaussian process leaves uncertain around each vertex of a mesh (σ², 1 where nothing is
    /// known) when there are gauges at some positions (m).
    #[must_use]
    pub fn uncertainty_map(&self, mesh: &TriMesh, gauges: &[DVec3]) -> Option<Vec<f64>> {
        let sites = &self.simulated.dataset.sites;
        let (locations, variances) = self.reduced.uncertainty(sites, gauges)?;
        let places: Vec<(DVec3, DVec3)> = (locations.iter())
            .map(|&s| (sites[s].gauge.position, sites[s].gauge.normal))
            .collect();
        Some(scatter::to_vertices(mesh, &places, &variances))
    }

    /// All counted work.
    #[must_use]
    pub fn work(&self) -> Work {
        let mut work = self.simulated.dataset.work;
        for selection in self.selections.iter() {
            work += selection.achieved.effort;
        }
        work += self.reference.work;
        work += self.evaluation.work;
        work
    }

    /// What may change a decision, in plain words, the weightiest first.
    #[must_use]
    pub fn cautions(&self) -> Vec<String> {
        let mut cautions = Vec::new();
        cautions.extend(
            self.chosen_selection()
                .map(|s| named(s, &s.achieved.cautions)),
        );
        cautions.push(self.evaluation.notes.clone());
        cautions.push(self.simulated.achieved.cautions.clone());
        if self.reference.element_mm >= self.simulated.element_mm {
            cautions.push(vec![
                "Judged on elements as large as the model's own: finer ones would not have fitted into memory, so the errors leave out what elements of this size cost.".into(),
            ]);
        }
        if (self.evaluation.rows.iter()).any(|r| r.converged == Some(false)) {
            cautions.push(vec![
                "Some regressions stopped at the effort allowed before they met their tolerance."
                    .into(),
            ]);
        }
        cautions.concat()
    }

    /// How the design came about, in plain words.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.simulated.achieved.notes.clone();
        notes.extend(self.candidates.iter().flat_map(|c| c.notes.clone()));
        for selection in self.selections.iter() {
            if selection.selector != self.chosen_by {
                notes.extend(named(selection, &selection.achieved.cautions));
            }
            notes.extend(named(selection, &selection.achieved.notes));
        }
        notes
    }

    /// All words, those that may change a decision first; at most three of them are to be read at once, and where there are
    /// doubts, those before them.
    #[must_use]
    pub fn words(&self) -> DesignWords {
        /// More than that nobody reads before a decision.
        const OPEN: usize = 3;
        let mut open = self.cautions();
        let room = OPEN.saturating_sub(self.doubts().len());
        let mut folded = open.split_off(open.len().min(room));
        folded.extend(self.notes());
        DesignWords { open, folded }
    }
}

/// What a design says of itself, sentence by sentence.
pub struct DesignWords {
    /// What may change a decision.
    pub open: Vec<String>,
    /// How the numbers came about; for whoever looks closer.
    pub folded: Vec<String>,
}

/// Words of a selection, with whose they are.
fn named(selection: &Selection, words: &[String]) -> Vec<String> {
    let title = selection.selector.title();
    words.iter().map(|w| format!("{title}: {w}")).collect()
}

/// Runs the whole pipeline. `clock` gives seconds since any fixed moment: the core has no clock of its own.
///
/// # Errors
/// [`DesignError`] from the stage that could not end.
pub fn run(
    inputs: &Inputs,
    kinds: &[SelectorKind],
    budget: &Budget,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let mut times = Stopwatch::new(clock);
    let simulated = Arc::new(simulate(inputs, budget, watch)?);
    times.lap("simulate");
    let mut design = run_from(inputs, simulated, kinds, budget, clock, watch)?;
    design.seconds.splice(0..0, times.stages);
    Ok(design)
}

/// Runs the pipeline from a simulation that is there already.
///
/// # Errors
/// [`DesignError`] from the stage that could not end.
pub fn run_from(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    kinds: &[SelectorKind],
    budget: &Budget,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let hooks = Hooks {
        clock,
        watch,
        found: &|_, _, _| (),
        entered: &|_| (),
    };
    run_step_by_step(
        inputs,
        simulated,
        kinds,
        budget,
        KnownStages::default(),
        &hooks,
    )
}

/// As [`run_from`], from what is known already, telling of every step.
///
/// # Errors
/// As [`run_from`].
pub fn run_step_by_step(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    kinds: &[SelectorKind],
    budget: &Budget,
    known: KnownStages,
    hooks: &Hooks,
) -> Result<Design, DesignError> {
    let watch = hooks.watch;
    let asked = inputs.project.selection.selector;
    let chosen_by = *kinds
        .iter()
        .find(|k| **k == asked)
        .or(kinds.first())
        .unwrap_or(&asked);
    let mut times = Stopwatch::new(hooks.clock);
    (hooks.entered)(DesignStep::Reduce);
    let (feasibility, reduced) = if let Some(known) = known.reduced {
        known
    } else {
        let feasibility = filter(inputs, &simulated);
        let reduced = reduce_sites(inputs, &simulated, &feasibility, budget)?;
        times.lap("filter");
        (Arc::new(feasibility), Arc::new(reduced))
    };
    let candidates = candidates(inputs, &reduced, kinds, &mut times, watch)?;
    (hooks.entered)(DesignStep::Select);
    let (simulated, selections) = if let Some(known) = known.selections {
        (simulated, known)
    } else {
        let from = Choosing {
            inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget,
            watch,
        };
        let mut chosen = select_all(&from, kinds, &mut times, hooks.found)?;
        let refined = finish_chosen(inputs, simulated, &reduced, &mut chosen, budget, hooks)?;
        if inputs.project.selection.refine {
            times.lap("refine places");
        }
        (refined, Arc::new(chosen))
    };
    (hooks.entered)(DesignStep::Evaluate);
    let judging = inputs.project.judging();
    let by = judging.estimator();
    let judged = sites_to_judge(by, &reduced, &selections);
    let off = super::known::off(&inputs.project, &simulated);
    let measured = (known.reference).filter(|t| {
        let all = &simulated.dataset.sites;
        t.measures(&judged, all, &off, &inputs.project)
    });
    let same = |e: &Arc<Evaluation>| measured.is_some() && e.judging == judging;
    let known = known.evaluation.filter(same);
    let reference = match measured {
        Some(known) => Arc::new(known.in_regions_of(&inputs.project)),
        None => Arc::new(reference(inputs, &simulated, &judged, budget, watch)?),
    };
    times.lap("truth");
    let evaluation = match known {
        Some(known) => known.in_regions(&reference.regions),
        None => evaluate(
            inputs,
            &simulated,
            &reduced,
            &selections,
            &reference,
            budget,
            watch,
        )?,
    };
    times.lap("evaluate");
    Ok(Design {
        budget: *budget,
        simulated,
        feasibility,
        reduced,
        candidates,
        chosen_by,
        by_hand: false,
        selections,
        reference,
        evaluation: Arc::new(evaluation),
        seconds: times.stages,
    })
}

/// The candidates, where somebody asks for them.
fn candidates(
    inputs: &Inputs,
    reduced: &ReducedSites,
    kinds: &[SelectorKind],
    times: &mut Stopwatch,
    watch: Watch,
) -> Result<Option<Arc<Candidates>>, DesignError> {
    if !inputs.project.wants_candidates(kinds) {
        return Ok(None);
    }
    let known = !reduced.candidate_sites().is_empty();
    let candidates = Arc::clone(reduced.candidates(watch)?);
    if !known {
        times.lap("reduce");
    }
    Ok(Some(candidates))
}

fn select_all(
    from: &Choosing,
    kinds: &[SelectorKind],
    times: &mut Stopwatch,
    found: OnFound,
) -> Result<Vec<Selection>, DesignError> {
    let mut selections = Vec::new();
    for &kind in kinds {
        selections.push(from.select_step_by_step(kind, found)?);
        times.lap(match kind {
            SelectorKind::GreedySvr => "select greedy-svr",
            SelectorKind::PcaQr => "select pca-qr",
            SelectorKind::Entropy => "select entropy",
            SelectorKind::MutualInformation => "select mutual-information",
            SelectorKind::ExpectedError => "select expected-error",
        });
    }
    Ok(selections)
}

/// Moves the gauges chosen by expected error off the lattice, where that is asked for, and says what is expected of them over
/// presses that they were not chosen by; the simulation with them.
fn finish_chosen(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    reduced: &ReducedSites,
    chosen: &mut [Selection],
    budget: &Budget,
    hooks: &Hooks,
) -> Result<Arc<Simulated>, DesignError> {
    let kind = SelectorKind::ExpectedError;
    let mut chosen = chosen.iter_mut().filter(|s| s.selector == kind);
    let asked = inputs.project.selection.refine;
    let Some(selection) = chosen.next() else {
        return Ok(simulated);
    };
    let simulated = if asked {
        refine(inputs, simulated, reduced, selection, budget, hooks.watch)?
    } else {
        simulated
    };
    if let Some(last) = selection.sets.last_mut() {
        let sets = [last.sites.clone()];
        let expected = expected_errors(inputs, &simulated, &sets, hooks.watch)?;
        last.expected_mm = expected.first().copied();
        if asked {
            (hooks.found)(kind, last, &simulated.dataset.sites);
        }
    }
    Ok(simulated)
}

struct Stopwatch<'a> {
    clock: &'a dyn Fn() -> f64,
    last: f64,
    stages: Vec<StageTime>,
}

impl<'a> Stopwatch<'a> {
    fn new(clock: &'a dyn Fn() -> f64) -> Self {
        Self {
            clock,
            last: clock(),
            stages: Vec::new(),
        }
    }

    fn lap(&mut self, stage: &'static str) {
        let now = (self.clock)();
        self.stages.push(StageTime {
            stage,
            seconds: now - self.last,
        });
        self.last = now;
    }
}
