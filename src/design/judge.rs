//! The judge: a finer model, touches of its own, and gauges as a workshop glues them.

mod matched;

use std::ops::Range;

use rayon::prelude::*;

use super::as_built::{WORKSHOPS, gains, of_workshop, sites_as_built};
use super::choose::Choosing;
use super::drawn::proposed;
use super::known;
use super::layout::test_touches;
use super::presses::{self, Press, PressReadings};
use super::reference::{Reference, grid, regions};
use super::{DesignError, Inputs, MADE_SEED, NOISE_SEED, PRESS_SEED, ReducedSites, Simulated};
use crate::as_made::as_made;
use crate::budget::{Budget, Cancelled, Watch, Work};
use crate::dataset::{self, Dataset, Signal, SignalMatrix};
use crate::elasticity::Model;
use crate::elasticity::load::{Push, Touch};
use crate::elasticity::sensitivity::Sensitivity;
use crate::evaluation::{
    self, Candidate, Chooser, EstimatorKind, Evaluation, EvaluationTrial, Judging, JudgingForces,
};
use crate::gauge::Gauge;
use crate::mesh::TriMesh;
use crate::placement::Selection;
use crate::regression::folds::evenly;
use crate::uncertainty::Gluing;
use crate::units;

use self::matched::ByMatching;
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
    let tried = Tried {
        touches: test_touches(&mesh, inputs, budget.test_touches)?,
        presses: match inputs.project.judging().estimator() {
            EstimatorKind::Matching => Some(presses_on(&mesh, inputs)?),
            EstimatorKind::Svr => None,
        },
    };
    let mut reference = measured_by(&*model, inputs, simulated, sites, tried, watch)?;
    let work = model.system().work();
    reference.work += work;
    reference.element_mm = meshed.element_mm();
    Ok(reference)
}

/// Presses on a surface as somebody makes them who calibrates: a round for each workshop, one after the other.
fn presses_on(surface: &TriMesh, inputs: &Inputs) -> Result<Vec<Press>, DesignError> {
    let asked = proposed(surface, inputs)?;
    let hand = inputs.project.uncertainty().pressing;
    let seed = inputs.project.budget.seed.wrapping_add(PRESS_SEED);
    let round = |k| presses::by_hand(surface, asked.clone(), &hand, seed.wrapping_add(k));
    Ok((0..WORKSHOPS).flat_map(round).collect())
}

/// What gauges read under pushes (sites × pushes), over grids of this length and width (m) or at a point, and how many
/// right-hand sides that took.
fn read(
    model: &dyn Model,
    inputs: &Inputs,
    pushes: &[Push],
    gauges: &[Gauge],
    grid: Option<[f64; 2]>,
    watch: Watch,
) -> Result<(SignalMatrix, usize), Cancelled> {
    let Some(grid) = grid else {
        return dataset::measure(model, pushes, gauges, inputs.project.gauge.signal, watch);
    };
    let sensitivity = Sensitivity::new(model, gauges, grid, watch)?;
    let columns: Vec<Vec<f64>> = (pushes.par_iter())
        .map(|push| sensitivity.read_push(push))
        .collect();
    let values = (0..gauges.len()).flat_map(|g| columns.iter().map(move |column| column[g]));
    Ok((
        SignalMatrix::new(pushes.len(), values.collect()),
        gauges.len(),
    ))
}

/// What a set is tried on.
pub(super) struct Tried {
    pub touches: Vec<Touch>,
    /// What it is calibrated with before.
    pub presses: Option<Vec<Press>>,
}

/// Sites as a model reads them under touches and known presses: as drawn, and as workshops glue them. The size of its
/// elements is for the caller to say.
pub(super) fn measured_by(
    model: &dyn Model,
    inputs: &Inputs,
    simulated: &Simulated,
    sites: &[usize],
    Tried { touches, presses }: Tried,
    watch: Watch,
) -> Result<Reference, DesignError> {
    let (project, grid) = (&inputs.project, grid(&inputs.project));
    let mut rows = sites.to_vec();
    rows.sort_unstable();
    rows.dedup();
    let all = &simulated.dataset.sites;
    let drawn: Vec<Gauge> = rows.iter().map(|&s| all[s].gauge).collect();
    let (off, seed) = (known::off(project, simulated), project.budget.seed);
    let built = |w| sites_as_built(simulated, &rows, &off.gluing, of_workshop(seed, w));
    // All kinds of gauges in one measurement: the loads are solved for once.
    let gauges: Vec<Gauge> = (drawn.iter().copied())
        .chain((0..WORKSHOPS).flat_map(built))
        .collect();
    let mut pushes = as_made(&touches, &off.making, seed.wrapping_add(MADE_SEED));
    if let Some(presses) = &presses {
        let made: Vec<Touch> = presses.iter().map(|p| p.made).collect();
        let making = off.making_of_presses();
        pushes.extend(as_made(&made, &making, seed.wrapping_add(MADE_SEED + 1)));
    }
    let (signals, solves) = read(model, inputs, &pushes, &gauges, grid, watch)?;
    let columns = |of: Range<usize>| of.collect::<Vec<_>>();
    let x = signals.select_rows(&columns(0..rows.len()));
    let x = x.select_columns(&columns(0..touches.len()));
    let of_workshops = OfWorkshops::new(&signals, &rows, &off.gluing, seed);
    let each = presses.as_ref().map_or(0, |p| p.len() / WORKSHOPS as usize);
    Ok(Reference {
        workshop: of_workshops.read(0..touches.len(), |k| k % WORKSHOPS as usize),
        pressed: presses.map(|presses| PressReadings {
            x: of_workshops.read(touches.len()..pushes.len(), |k| k / each.max(1)),
            presses,
        }),
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
        off,
        grid,
    })
}

/// What gauges read as each of the workshops glues them.
struct OfWorkshops<'a> {
    /// As drawn, then workshop after workshop (sites × pushes).
    signals: &'a SignalMatrix,
    /// The gains that the gauges end up with, workshop by workshop.
    gains: Vec<Vec<f64>>,
}

impl<'a> OfWorkshops<'a> {
    fn new(signals: &'a SignalMatrix, sites: &[usize], gluing: &Gluing, seed: u64) -> Self {
        let gains = |w| gains(sites, gluing, of_workshop(seed, w)).collect();
        Self {
            signals,
            gains: (0..WORKSHOPS).map(gains).collect(),
        }
    }

    /// What is read of some of the pushes (sites × pushes), each by the gauges of the workshop whose turn it is.
    fn read(&self, pushes: Range<usize>, turn: impl Fn(usize) -> usize) -> SignalMatrix {
        let sites = self.gains[0].len();
        let rows = (0..sites).flat_map(|site| {
            pushes.clone().enumerate().map({
                let turn = &turn;
                move |(k, push)| {
                    let workshop = turn(k);
                    let row = self.signals.row((1 + workshop) * sites + site);
                    row[push] * self.gains[workshop][site]
                }
            })
        });
        SignalMatrix::new(pushes.len(), rows.collect())
    }
}

impl Choosing<'_> {
    /// Judges selections on the reference model by the project's estimator; by regression with all candidates as the
    /// baseline, where there are any.
    ///
    /// # Errors
    /// [`DesignError`] when the watch asks for a stop, and as for the design's simulation.
    pub fn evaluate(
        &self,
        selections: &[Selection],
        reference: &Reference,
    ) -> Result<Evaluation, DesignError> {
        let row_of = |site: &usize| reference.sites.binary_search(site).ok();
        let set = |chooser, sites: &[usize]| Candidate {
            chooser,
            rows: sites.iter().filter_map(row_of).collect(),
            hyper: None,
        };
        let mut sets: Vec<Candidate> = (selections.iter())
            .flat_map(|by| by.sets.iter().map(|s| set(by.selector.into(), &s.sites)))
            .collect();
        let all = self.reduced.candidate_sites();
        if self.inputs.project.judging() == Judging::Svr && !all.is_empty() {
            sets.push(set(Chooser::AllCandidates, &all));
        }
        let streams: Vec<u64> = (0..reference.sites.len() as u64).collect();
        let on = JudgedOn {
            inputs: self.inputs,
            simulated: self.simulated,
            reference,
            streams: &streams,
            budget: self.budget,
            watch: self.watch,
        };
        on.judge_as_asked(&sets)
    }
}

/// What sets are judged on: the same for all of them.
#[derive(Clone, Copy)]
pub(super) struct JudgedOn<'a> {
    pub inputs: &'a Inputs,
    pub simulated: &'a Simulated,
    pub reference: &'a Reference,
    /// Of the noise, one a site of the reference.
    pub streams: &'a [u64],
    pub budget: &'a Budget,
    pub watch: Watch<'a>,
}

impl JudgedOn<'_> {
    /// Judges sets by the estimator that the project asks for.
    pub fn judge_as_asked(&self, sets: &[Candidate]) -> Result<Evaluation, DesignError> {
        let project = &self.inputs.project;
        if let Judging::Matching(forces) = &project.judging() {
            return self.by_matching(forces, sets);
        }
        let mut found = self.by_regression(sets)?;
        if project.evaluation.estimator != EstimatorKind::Svr {
            found.notes.push(format!(
                "Judged by regression, although evaluation.estimator asks for matching: that knows strain only, and gauge.signal is {}.",
                project.gauge.signal.name()
            ));
        }
        Ok(found)
    }

    /// Judges sets by matching readings, at these forces.
    pub fn by_matching(
        &self,
        forces: &JudgingForces,
        sets: &[Candidate],
    ) -> Result<Evaluation, DesignError> {
        let trial = ByMatching {
            inputs: self.inputs,
            simulated: self.simulated,
            reference: self.reference,
            streams: self.streams,
            forces,
            budget: self.budget,
        };
        trial.judge(sets, self.watch)
    }

    /// Judges sets by regression.
    pub fn by_regression(&self, sets: &[Candidate]) -> Result<Evaluation, Cancelled> {
        let (dataset, reference) = (&self.simulated.dataset, self.reference);
        let train = dataset.x.select_rows(&reference.sites);
        let test_targets: Vec<[f64; 3]> = reference
            .touches
            .iter()
            .map(|t| units::mm(t.position).to_array())
            .collect();
        let project = &self.inputs.project;
        evaluation::evaluate(
            &EvaluationTrial {
                signal: dataset.signal,
                train: &train,
                train_targets: &dataset.targets_mm(),
                test: &reference.x,
                workshop: &reference.workshop,
                test_targets: &test_targets,
                regions: &reference.regions,
                noise: project.uncertainty().of_channel(),
                streams: self.streams,
                seed: project.budget.seed.wrapping_add(NOISE_SEED),
            },
            sets,
            self.budget,
            self.watch,
        )
    }
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
    reduced: &ReducedSites,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_push_is_read_by_the_gauges_whose_turn_it_is() {
        const PUSHES: usize = 6;
        let (sites, gluing) = ([4, 9], Gluing::default());
        let rows = (1 + WORKSHOPS as usize) * sites.len();
        let values = (0..rows * PUSHES).map(|k| k as f64).collect();
        let signals = SignalMatrix::new(PUSHES, values);
        let read = OfWorkshops::new(&signals, &sites, &gluing, 5).read(2..PUSHES, |k| k % 3);
        for (k, push) in (2..PUSHES).enumerate() {
            let workshop = k % 3;
            let seed = of_workshop(5, workshop as u64);
            for (row, gain) in gains(&sites, &gluing, seed).enumerate() {
                let there = signals.row((1 + workshop) * sites.len() + row)[push];
                assert_eq!(read.row(row)[k], gain * there);
            }
        }
        // They are not all glued alike.
        let gained = |workshop| gains(&[0, 1, 2, 3], &gluing, of_workshop(5, workshop));
        assert!(!gained(0).eq(gained(1)) || !gained(1).eq(gained(2)));
    }
}
