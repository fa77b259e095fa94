//! The judge: a finer model, touches of its own, and gauges as a workshop glues them.

mod matched;

use rayon::prelude::*;

use super::as_built::{gains, sites_as_built};
use super::as_made::as_made;
use super::drawn::{gauge_at, proposed};
use super::known;
use super::layout::test_touches;
use super::presses::{self, Press, Pressed};
use super::reference::{Reference, grid, regions};
use super::{DesignError, Inputs, MADE_SEED, NOISE_SEED, PRESS_SEED, Reduced, Simulated};
use crate::budget::{Budget, Cancelled, Watch, Work};
use crate::dataset::{self, Dataset, Signal, SignalMatrix, Site};
use crate::elasticity::Model;
use crate::elasticity::load::{Push, Touch};
use crate::elasticity::sensitivity::{Gauge, Sensitivity};
use crate::evaluation::{self, Candidate, EstimatorKind, Evaluation, Judging, Trial};
use crate::mesh::TriMesh;
use crate::placement::Selection;
use crate::regression::folds::evenly;

pub(super) use self::matched::ByMatching;
pub use crate::placement::expected_error::BLIND;

/// Measures sites on the reference model: a mesh of half the element size, test touches drawn uniformly at random
/// with a seed of their own, so that they lie off any node and are nobody's training touches.
///
/// # Errors
/// [`DesignError`] as for [`super::simulate()`].
pub fn reference(
    inputs: &Inputs,
    simulated: &Simulated,
    sites: &[usize],
    budget: &Budget,
    watch: Watch,
) -> Result<Reference, DesignError> {
    let (meshed, model) = simulated.meshed.reference_model(watch)?;
    let mesh = meshed.touched_surface();
    let touches = test_touches(&mesh, inputs, budget.test_touches)?;
    let grid = grid(&inputs.project);
    let mut reference = measured_by(&*model, inputs, simulated, sites, touches, grid, watch)?;
    if inputs.project.judging().estimator() == EstimatorKind::Matching {
        reference.press(&*model, &mesh, inputs, simulated, watch)?;
    }
    let work = model.system().work();
    reference.work += work;
    reference.element_mm = meshed.element_mm();
    Ok(reference)
}

impl Reference {
    /// Presses on a surface of the model as somebody does who calibrates, and reads the gauges as they are built.
    fn press(
        &mut self,
        model: &dyn Model,
        surface: &TriMesh,
        inputs: &Inputs,
        simulated: &Simulated,
        watch: Watch,
    ) -> Result<(), DesignError> {
        let seed = inputs.project.budget.seed;
        let asked = proposed(surface, inputs)?;
        let hand = &self.off.pressing;
        let presses: Vec<Press> = (0..presses::ROUNDS)
            .flat_map(|round| {
                let seed = seed.wrapping_add(PRESS_SEED).wrapping_add(round);
                presses::by_hand(surface, asked.clone(), hand, seed)
            })
            .collect();
        let made: Vec<Touch> = presses.iter().map(|p| p.made).collect();
        let made = as_made(
            &made,
            &self.off.making_of_presses(),
            seed.wrapping_add(MADE_SEED + 1),
        );
        let built = sites_as_built(simulated, &self.sites, &self.off.gluing, seed);
        let (x, solves) = read(model, inputs, &made, &built, self.grid, watch)?;
        self.work.solves += solves as u64;
        self.pressed = Some(Pressed {
            presses,
            x: x.scaled_rows(gains(&self.sites, &self.off.gluing, seed)),
        });
        Ok(())
    }
}

/// What gauges read under pushes (sites × pushes), over grids of this length and width (m) or at a point, and how many
/// right-hand sides that took.
fn read(
    model: &dyn Model,
    inputs: &Inputs,
    pushes: &[Push],
    sites: &[Site],
    grid: Option<[f64; 2]>,
    watch: Watch,
) -> Result<(SignalMatrix, usize), Cancelled> {
    let Some(grid) = grid else {
        return dataset::measure(model, pushes, sites, inputs.project.gauge.signal, watch);
    };
    let gauges: Vec<Gauge> = sites.iter().map(|site| gauge_at(site, grid)).collect();
    let sensitivity = Sensitivity::new(model, &gauges, watch)?;
    let columns: Vec<Vec<f64>> = (pushes.par_iter())
        .map(|push| sensitivity.read_push(push))
        .collect();
    let values = (0..gauges.len()).flat_map(|g| columns.iter().map(move |column| column[g]));
    Ok((
        SignalMatrix::new(pushes.len(), values.collect()),
        gauges.len(),
    ))
}

/// Sites as a model reads them under touches, over grids of this length and width (m) or at a point. The size of its
/// elements is for the caller to say.
pub(super) fn measured_by(
    model: &dyn Model,
    inputs: &Inputs,
    simulated: &Simulated,
    sites: &[usize],
    touches: Vec<Touch>,
    grid: Option<[f64; 2]>,
    watch: Watch,
) -> Result<Reference, DesignError> {
    let project = &inputs.project;
    let mut rows = sites.to_vec();
    rows.sort_unstable();
    rows.dedup();
    // Both kinds of gauges in one measurement: the loads are solved for once.
    let all = &simulated.dataset.sites;
    let drawn: Vec<Site> = rows.iter().map(|&s| all[s]).collect();
    let (off, seed) = (known::off(project, simulated), project.budget.seed);
    let built = sites_as_built(simulated, &rows, &off.gluing, seed);
    let gauges: Vec<Site> = drawn.iter().copied().chain(built).collect();
    let pushes = as_made(&touches, &off.making, seed.wrapping_add(MADE_SEED));
    let (signals, solves) = read(model, inputs, &pushes, &gauges, grid, watch)?;
    let half =
        |k: usize| signals.select_rows(&(k * rows.len()..(k + 1) * rows.len()).collect::<Vec<_>>());
    let (x, workshop) = (half(0), half(1));
    let workshop = workshop.scaled_rows(gains(&rows, &off.gluing, seed));
    Ok(Reference {
        regions: regions(project, &touches),
        element_mm: f64::NAN,
        touches,
        work: Work {
            solves: solves as u64,
            ..Work::default()
        },
        sites: rows,
        drawn,
        x,
        workshop,
        off,
        grid,
        pressed: None,
    })
}

/// Judges selections on the reference model by the project's estimator; by regression with all candidates as the baseline, where
/// there are any.
///
/// # Errors
/// [`DesignError`] when the watch asks for a stop, and as for the design's simulation.
pub fn evaluate(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    selections: &[Selection],
    reference: &Reference,
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let row_of = |site: &usize| reference.sites.binary_search(site).ok();
    let mut sets = Vec::new();
    for selection in selections {
        for set in &selection.sets {
            sets.push(Candidate {
                selector: selection.selector.name().to_owned(),
                rows: set.sites.iter().filter_map(row_of).collect(),
                hyper: None,
            });
        }
    }
    let all = reduced.candidate_sites();
    if inputs.project.judging() == Judging::Svr && !all.is_empty() {
        sets.push(Candidate {
            selector: evaluation::BASELINE.to_owned(),
            rows: all.iter().filter_map(row_of).collect(),
            hyper: None,
        });
    }
    let streams: Vec<u64> = (0..reference.sites.len() as u64).collect();
    judge_as_asked(inputs, simulated, reference, &sets, &streams, budget, watch)
}

/// Judges sets by the estimator that the project asks for.
pub(super) fn judge_as_asked(
    inputs: &Inputs,
    simulated: &Simulated,
    reference: &Reference,
    sets: &[Candidate],
    streams: &[u64],
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let project = &inputs.project;
    if let Judging::Matching(forces) = &project.judging() {
        let trial = ByMatching {
            inputs,
            simulated,
            reference,
            streams,
            forces,
            budget,
        };
        return trial.judge(sets, watch);
    }
    let mut found = judge(inputs, simulated, reference, sets, streams, budget, watch)?;
    if project.evaluation.estimator != EstimatorKind::Svr {
        found.notes.push(format!(
            "Judged by regression, although evaluation.estimator asks for matching: that knows strain only, and gauge.signal is {}.",
            project.gauge.signal.name()
        ));
    }
    Ok(found)
}

/// Judges sets by regression.
pub(super) fn judge(
    inputs: &Inputs,
    simulated: &Simulated,
    reference: &Reference,
    sets: &[Candidate],
    streams: &[u64],
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, Cancelled> {
    let train = simulated.dataset.x.select_rows(&reference.sites);
    let test_targets: Vec<[f64; 3]> = reference
        .touches
        .iter()
        .map(|t| (t.position * 1000.0).to_array())
        .collect();
    evaluation::evaluate(
        &Trial {
            signal: simulated.dataset.signal,
            train: &train,
            train_targets: &simulated.dataset.targets_mm(),
            test: &reference.x,
            workshop: &reference.workshop,
            test_targets: &test_targets,
            regions: &reference.regions,
            noise: inputs.project.uncertainty().of_channel(),
            streams,
            seed: inputs.project.budget.seed.wrapping_add(NOISE_SEED),
        },
        sets,
        budget,
        watch,
    )
}

/// An estimate of the mean error (mm) of a set of sites, from the training touches alone: quick, and good
/// for comparing sets that differ little.
#[must_use]
pub fn estimate(inputs: &Inputs, dataset: &Dataset, sites: &[usize], gamma: f64) -> f64 {
    /// Touches that are learned from.
    const TOUCHES: usize = 400;
    let all = dataset.targets_mm();
    let touches = evenly(all.len(), TOUCHES);
    let targets: Vec<[f64; 3]> = touches.iter().map(|&t| all[t]).collect();
    let x = dataset.x.select_rows(sites).select_columns(&touches);
    let noise = if dataset.signal == Signal::Strain {
        inputs.project.uncertainty().of_channel()
    } else {
        0.0
    };
    let seed = inputs.project.budget.seed.wrapping_add(NOISE_SEED);
    let x = evaluation::add_noise(&x, noise, seed);
    evaluation::estimate::leave_one_out(&x, &targets, gamma)
}

/// Every site that the evaluation of some selections looks at: of the candidates that nobody chose, those that a
/// regression has for a baseline.
#[must_use]
pub fn sites_to_judge(
    by: EstimatorKind,
    reduced: &Reduced,
    selections: &[Selection],
) -> Vec<usize> {
    let mut sites = match by {
        EstimatorKind::Svr => reduced.candidate_sites(),
        EstimatorKind::Matching => Vec::new(),
    };
    let chosen = selections
        .iter()
        .flat_map(|s| &s.sets)
        .flat_map(|s| &s.sites);
    sites.extend(chosen);
    sites
}
