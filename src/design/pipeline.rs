//! The whole pipeline in one go, and what comes out of it.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::{
    Choosing, DesignError, DesignRequest, OnFound, ReducedSites, Reference, Simulated,
    expected_errors, filter, reduce_sites, refine, simulate, sites_to_judge,
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
    asked: &DesignRequest,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let mut times = Stopwatch::new(clock);
    let simulated = Arc::new(simulate(asked.inputs, asked.budget, watch)?);
    times.lap("simulate");
    let mut design = run_from(asked, simulated, clock, watch)?;
    design.seconds.splice(0..0, times.stages);
    Ok(design)
}

/// Runs the pipeline from a simulation that is there already.
///
/// # Errors
/// [`DesignError`] from the stage that could not end.
pub fn run_from(
    asked: &DesignRequest,
    simulated: Arc<Simulated>,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let hooks = Hooks {
        clock,
        watch,
        found: &|_, _, _| (),
        entered: &|_| (),
    };
    run_step_by_step(asked, simulated, KnownStages::default(), &hooks)
}

/// As [`run_from`], from what is known already, telling of every step.
///
/// # Errors
/// As [`run_from`].
pub fn run_step_by_step(
    asked: &DesignRequest,
    simulated: Arc<Simulated>,
    known: KnownStages,
    hooks: &Hooks,
) -> Result<Design, DesignError> {
    let mut run = Run {
        asked,
        hooks,
        times: Stopwatch::new(hooks.clock),
    };
    (hooks.entered)(DesignStep::Reduce);
    let (feasibility, reduced) = match known.reduced {
        Some(known) => known,
        None => run.reduce(&simulated)?,
    };
    let candidates = run.candidates(&reduced)?;
    (hooks.entered)(DesignStep::Select);
    let (simulated, selections) = match known.selections {
        Some(known) => (simulated, known),
        None => run.select(simulated, &reduced)?,
    };
    (hooks.entered)(DesignStep::Evaluate);
    let from = asked.choosing(&simulated, &reduced, hooks.watch);
    let (reference, evaluation) =
        run.judge(&from, &selections, (known.reference, known.evaluation))?;
    Ok(Design {
        budget: *asked.budget,
        seconds: run.times.stages,
        chosen_by: asked.chosen_by(),
        by_hand: false,
        simulated,
        feasibility,
        reduced,
        candidates,
        selections,
        reference,
        evaluation,
    })
}

/// A design on its way.
struct Run<'a> {
    asked: &'a DesignRequest<'a>,
    hooks: &'a Hooks<'a>,
    times: Stopwatch<'a>,
}

impl Run<'_> {
    fn reduce(
        &mut self,
        simulated: &Simulated,
    ) -> Result<(Arc<Feasibility>, Arc<ReducedSites>), DesignError> {
        let inputs = self.asked.inputs;
        let feasibility = filter(inputs, simulated);
        let reduced = reduce_sites(inputs, simulated, &feasibility, self.asked.budget)?;
        self.times.lap("filter");
        Ok((Arc::new(feasibility), Arc::new(reduced)))
    }

    /// The candidates, where somebody asks for them.
    fn candidates(
        &mut self,
        reduced: &ReducedSites,
    ) -> Result<Option<Arc<Candidates>>, DesignError> {
        let DesignRequest { inputs, kinds, .. } = self.asked;
        if !inputs.project.wants_candidates(kinds) {
            return Ok(None);
        }
        let known = !reduced.candidate_sites().is_empty();
        let candidates = Arc::clone(reduced.candidates(self.hooks.watch)?);
        if !known {
            self.times.lap("reduce");
        }
        Ok(Some(candidates))
    }

    /// What the selectors choose, and the simulation with the gauges that were moved off its lattice.
    fn select(
        &mut self,
        simulated: Arc<Simulated>,
        reduced: &ReducedSites,
    ) -> Result<(Arc<Simulated>, Arc<Vec<Selection>>), DesignError> {
        let from = (self.asked).choosing(&simulated, reduced, self.hooks.watch);
        let mut chosen = Vec::new();
        for &kind in self.asked.kinds {
            chosen.push(from.select_step_by_step(kind, self.hooks.found)?);
            self.times.lap(match kind {
                SelectorKind::GreedySvr => "select greedy-svr",
                SelectorKind::PcaQr => "select pca-qr",
                SelectorKind::Entropy => "select entropy",
                SelectorKind::MutualInformation => "select mutual-information",
                SelectorKind::ExpectedError => "select expected-error",
            });
        }
        let refined = self.finish_chosen(simulated, reduced, &mut chosen)?;
        if self.asked.inputs.project.selection.refine {
            self.times.lap("refine places");
        }
        Ok((refined, Arc::new(chosen)))
    }

    /// Moves the gauges chosen by expected error off the lattice, where that is asked for, and says what is expected of
    /// them over presses that they were not chosen by; the simulation with them.
    fn finish_chosen(
        &self,
        simulated: Arc<Simulated>,
        reduced: &ReducedSites,
        chosen: &mut [Selection],
    ) -> Result<Arc<Simulated>, DesignError> {
        let (kind, hooks) = (SelectorKind::ExpectedError, self.hooks);
        let inputs = self.asked.inputs;
        let mut chosen = chosen.iter_mut().filter(|s| s.selector == kind);
        let is_refined = inputs.project.selection.refine;
        let Some(selection) = chosen.next() else {
            return Ok(simulated);
        };
        let simulated = if is_refined {
            refine(self.asked, simulated, reduced, selection, hooks.watch)?
        } else {
            simulated
        };
        if let Some(last) = selection.sets.last_mut() {
            let sets = [last.sites.clone()];
            let expected = expected_errors(inputs, &simulated, &sets, hooks.watch)?;
            last.expected_mm = expected.first().copied();
            if is_refined {
                (hooks.found)(kind, last, &simulated.dataset.sites);
            }
        }
        Ok(simulated)
    }

    /// What the judge's model reads, and what it finds; what is known of both is taken where it is of the same.
    fn judge(
        &mut self,
        from: &Choosing,
        selections: &[Selection],
        (reference, evaluation): (Option<Arc<Reference>>, Option<Arc<Evaluation>>),
    ) -> Result<(Arc<Reference>, Arc<Evaluation>), DesignError> {
        let (inputs, simulated) = (from.inputs, from.simulated);
        let judging = inputs.project.judging();
        let judged = sites_to_judge(judging.estimator(), from.reduced, selections);
        let off = super::known::off(&inputs.project, simulated);
        let measured = reference.filter(|t| {
            let all = &simulated.dataset.sites;
            t.measures(&judged, all, &off, &inputs.project)
        });
        let is_same = |e: &Arc<Evaluation>| measured.is_some() && e.judging == judging;
        let known = evaluation.filter(is_same);
        let reference = match measured {
            Some(known) => known.in_regions_of(&inputs.project),
            None => super::reference(inputs, simulated, &judged, from.budget, from.watch)?,
        };
        self.times.lap("truth");
        let evaluation = match known {
            Some(known) => known.in_regions(&reference.regions),
            None => from.evaluate(selections, &reference)?,
        };
        self.times.lap("evaluate");
        Ok((Arc::new(reference), Arc::new(evaluation)))
    }
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
