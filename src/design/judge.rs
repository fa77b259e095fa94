//! The judge: a finer model, touches of its own, and gauges as a workshop glues them.

mod matched;
mod presses;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::known;
use super::layout::touches_on;
use super::sense::{gauge_at, proposed};
use super::{
    Design, DesignError, Inputs, NOISE_SEED, PRESS_SEED, Reduced, Simulated, TEST_SEED,
    WORKSHOP_SEED,
};
use crate::budget::{Budget, Cancelled, Watch, Work};
use crate::dataset::{self, Dataset, Signal, SignalMatrix, Site};
use crate::elasticity::Model;
use crate::elasticity::load::Touch;
use crate::elasticity::sensitivity::{Gauge, Sensitivity};
use crate::evaluation::{self, Candidate, EstimatorKind, Evaluation, Judging, Region, Trial};
use crate::mesh::TriMesh;
use crate::placement::Selection;
use crate::project::Project;
use crate::regression::folds::evenly;
use crate::uncertainty::{Gluing, Uncertainty};

pub(super) use self::matched::ByMatching;
pub use self::presses::{Press, Pressed};
pub use crate::placement::expected_error::BLIND;

/// The judge: a model of finer elements, with touches of its own.
#[derive(Clone)]
pub struct Truth {
    pub touches: Vec<Touch>,
    pub regions: Vec<Region>,
    /// Element size of the truth (mm).
    pub element_mm: f64,
    pub work: Work,
    /// Dataset sites that were measured, rising, and their signals.
    pub sites: Vec<usize>,
    /// Where they are: gauges off the lattice may have moved under the same number.
    pub drawn: Vec<Site>,
    pub x: SignalMatrix,
    /// The same sites as a workshop would build them.
    pub workshop: SignalMatrix,
    /// How far off they are built, and all else that was known to be off when they were measured.
    pub off: Uncertainty,
    /// Length and width of the grids (m) that gauges read over; absent where they read at a point, as regressions
    /// learn from.
    pub grid: Option<[f64; 2]>,
    /// Known presses on the gauges as built, where an estimator learns from them.
    pub pressed: Option<Pressed>,
}

impl Truth {
    /// Whether it measures exactly these of all sites, in any order, built and pressed as far off as that, and what this
    /// estimator asks for beside.
    #[must_use]
    pub fn measures(
        &self,
        sites: &[usize],
        all: &[Site],
        off: &Uncertainty,
        project: &Project,
    ) -> bool {
        let mut rows = sites.to_vec();
        rows.sort_unstable();
        rows.dedup();
        let here = rows.iter().filter_map(|&s| all.get(s));
        let by = project.judging().estimator();
        let presses = by == EstimatorKind::Svr || self.pressed.is_some();
        let same = off.builds_as(&self.off) && grid(project) == self.grid;
        rows == self.sites && here.eq(&self.drawn) && same && presses
    }

    /// The same, judged in the regions that a project asks for.
    #[must_use]
    pub fn in_regions_of(&self, project: &Project) -> Self {
        Self {
            regions: regions(project, &self.touches),
            ..self.clone()
        }
    }
}

/// Measures sites on the truth: a mesh of half the element size, test touches drawn uniformly at random
/// with a seed of their own, so that they lie off any node and are nobody's training touches.
///
/// # Errors
/// [`DesignError`] as for [`simulate`].
pub fn truth(
    inputs: &Inputs,
    simulated: &Simulated,
    sites: &[usize],
    budget: &Budget,
    watch: Watch,
) -> Result<Truth, DesignError> {
    let (meshed, model) = simulated.meshed.truth(watch)?;
    let mesh = meshed.touched_surface();
    let seed = inputs.project.budget.seed.wrapping_add(TEST_SEED);
    let touches = touches_on(&mesh, inputs, budget.test_touches, seed, false)?;
    let grid = grid(&inputs.project);
    let mut truth = measured_by(&*model, inputs, simulated, sites, touches, grid, watch)?;
    if inputs.project.judging().estimator() == EstimatorKind::Matching {
        truth.press(&*model, &mesh, inputs, simulated, watch)?;
    }
    let work = model.system().work();
    truth.work += work;
    truth.element_mm = meshed.element_mm();
    Ok(truth)
}

impl Truth {
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

/// Length and width of the grids (m) that a project's gauges are judged with: those that live touch reads them over, and
/// none where a regression has learned from points.
pub(super) fn grid(project: &Project) -> Option<[f64; 2]> {
    let keys = &project.gauge;
    let matching = project.judging().estimator() == EstimatorKind::Matching;
    matching.then_some([keys.grid_length_mm * 1e-3, keys.grid_width_mm * 1e-3])
}

/// What gauges read under touches (sites × touches), over grids of this length and width (m) or at a point, and how many
/// right-hand sides that took.
fn read(
    model: &dyn Model,
    inputs: &Inputs,
    touches: &[Touch],
    sites: &[Site],
    grid: Option<[f64; 2]>,
    watch: Watch,
) -> Result<(SignalMatrix, usize), Cancelled> {
    let Some(grid) = grid else {
        return dataset::measure(model, touches, sites, inputs.project.gauge.signal, watch);
    };
    let gauges: Vec<Gauge> = sites.iter().map(|site| gauge_at(site, grid)).collect();
    let sensitivity = Sensitivity::new(model, &gauges, watch)?;
    let columns: Vec<Vec<f64>> = touches.par_iter().map(|t| sensitivity.read(t)).collect();
    let values = (0..gauges.len()).flat_map(|g| columns.iter().map(move |column| column[g]));
    Ok((
        SignalMatrix::new(touches.len(), values.collect()),
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
) -> Result<Truth, DesignError> {
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
    let (signals, solves) = read(model, inputs, &touches, &gauges, grid, watch)?;
    let half =
        |k: usize| signals.select_rows(&(k * rows.len()..(k + 1) * rows.len()).collect::<Vec<_>>());
    let (x, workshop) = (half(0), half(1));
    let workshop = workshop.scaled_rows(gains(&rows, &off.gluing, seed));
    Ok(Truth {
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

/// Sites of a dataset as a workshop glues their gauges.
fn sites_as_built(simulated: &Simulated, sites: &[usize], gluing: &Gluing, seed: u64) -> Vec<Site> {
    let all = &simulated.dataset.sites;
    let built = |&s: &usize| as_built(&all[s], gluing, seed, s);
    sites.iter().map(built).collect()
}

/// The gains that these gauges end up with.
fn gains(sites: &[usize], gluing: &Gluing, seed: u64) -> impl Iterator<Item = f64> {
    sites
        .iter()
        .map(move |&s| workshop_draw(gluing, seed, s).gain)
}

/// What a workshop does to one gauge: where it is moved to and how far it is turned (radians), and its
/// gain.
pub(super) struct WorkshopDraw {
    toward: f64,
    turned: f64,
    pub gain: f64,
}

/// Off by as much as is usual for the workshop, in any direction and either way: the same for a site in whatever
/// set it is.
pub(super) fn workshop_draw(gluing: &Gluing, seed: u64, site: usize) -> WorkshopDraw {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(WORKSHOP_SEED));
    rng.set_stream(site as u64);
    let mut sign = || if rng.random::<bool>() { 1.0 } else { -1.0 };
    let (turned, gain) = (gluing.angle * sign(), 1.0 + gluing.gain * sign());
    WorkshopDraw {
        toward: std::f64::consts::TAU * rng.random::<f64>(),
        turned,
        gain,
    }
}

pub(super) fn as_built(site: &Site, gluing: &Gluing, seed: u64, number: usize) -> Site {
    let draw = workshop_draw(gluing, seed, number);
    let across = site.normal.cross(site.direction);
    let along = |angle: f64| site.direction * angle.cos() + across * angle.sin();
    Site {
        position: site.position + along(draw.toward) * gluing.place,
        direction: along(draw.turned),
        ..*site
    }
}

fn regions(project: &Project, touches: &[Touch]) -> Vec<Region> {
    project
        .evaluation
        .regions
        .iter()
        .map(|region| {
            let [a, b] = region.box_mm.map(DVec3::from_array);
            let (lower, upper) = (a.min(b), a.max(b));
            let inside = |t: &Touch| {
                let p = t.position * 1000.0;
                p.cmpge(lower).all() && p.cmple(upper).all()
            };
            Region {
                name: region.name.clone(),
                contains: touches.iter().map(inside).collect(),
            }
        })
        .collect()
}

/// Judges selections on the truth by the project's estimator; by regression with all candidates as the baseline, where
/// there are any.
///
/// # Errors
/// [`DesignError`] when the watch asks for a stop, and as for the design's simulation.
pub fn evaluate(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    selections: &[Selection],
    truth: &Truth,
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let row_of = |site: &usize| truth.sites.binary_search(site).ok();
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
    let streams: Vec<u64> = (0..truth.sites.len() as u64).collect();
    judge_as_asked(inputs, simulated, truth, &sets, &streams, budget, watch)
}

/// Judges one set of sites (as numbered in the dataset) that nobody selected, as a design's own sets were:
/// with its test touches, its noise and, where it has a set of as many gauges by the selector in the lead,
/// the settings of that set's regression. Its name in the rows is `name`.
///
/// # Errors
/// As [`truth`].
pub fn judge_set(
    inputs: &Inputs,
    design: &Design,
    sites: &[usize],
    name: &str,
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let (simulated, budget) = (&design.simulated, &design.budget);
    let truth = truth(inputs, simulated, sites, budget, watch)?;
    let rows = sites
        .iter()
        .filter_map(|s| truth.sites.binary_search(s).ok());
    let own = (design.evaluation.rows.iter())
        .find(|r| r.selector == design.lead.name() && r.sensors == sites.len());
    let set = Candidate {
        selector: name.to_owned(),
        rows: rows.collect(),
        hyper: own.and_then(|r| r.hyper),
    };
    // Sites that the design has measured keep their noise; others have streams beyond all of its own.
    let known = &design.truth.sites;
    let stream = |s: &usize| match known.binary_search(s) {
        Ok(row) => row as u64,
        Err(_) => (known.len() + s) as u64,
    };
    let streams: Vec<u64> = truth.sites.iter().map(stream).collect();
    let sets = [set];
    judge_as_asked(inputs, simulated, &truth, &sets, &streams, budget, watch)
}

/// Judges sets by the estimator that the project asks for.
fn judge_as_asked(
    inputs: &Inputs,
    simulated: &Simulated,
    truth: &Truth,
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
            truth,
            streams,
            forces,
            budget,
        };
        return trial.judge(sets, watch);
    }
    let mut found = judge(inputs, simulated, truth, sets, streams, budget, watch)?;
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
    truth: &Truth,
    sets: &[Candidate],
    streams: &[u64],
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, Cancelled> {
    let train = simulated.dataset.x.select_rows(&truth.sites);
    let test_targets: Vec<[f64; 3]> = truth
        .touches
        .iter()
        .map(|t| (t.position * 1000.0).to_array())
        .collect();
    evaluation::evaluate(
        &Trial {
            signal: simulated.dataset.signal,
            train: &train,
            train_targets: &simulated.dataset.targets_mm(),
            test: &truth.x,
            workshop: &truth.workshop,
            test_targets: &test_targets,
            regions: &truth.regions,
            noise: inputs.project.gauge.noise_microstrain * 1e-6,
            streams,
            seed: inputs.project.budget.seed.wrapping_add(NOISE_SEED),
        },
        sets,
        budget,
        watch,
    )
}

/// Signals with the noise that the evaluation draws: `draw` tells training (1), test (2) and workshop (3) apart.
pub(super) fn noisy<'a>(
    inputs: &Inputs,
    x: &'a SignalMatrix,
    draw: u64,
    streams: &[u64],
) -> std::borrow::Cow<'a, SignalMatrix> {
    let noise = inputs.project.gauge.noise_microstrain * 1e-6;
    let seed = inputs.project.budget.seed.wrapping_add(NOISE_SEED);
    evaluation::add_noise_by(x, noise, seed.wrapping_add(draw), &|row| streams[row])
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
        inputs.project.gauge.noise_microstrain * 1e-6
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

#[cfg(test)]
mod tests {
    use super::*;

    fn site() -> Site {
        Site {
            position: DVec3::new(0.01, 0.02, 0.03),
            normal: DVec3::Z,
            direction: DVec3::X,
            rms_strain: 0.0,
            peak_strain: 0.0,
        }
    }

    #[test]
    fn a_gauge_is_off_by_what_the_project_says() {
        let gluing = Gluing {
            place: 2e-3,
            angle: 0.1,
            gain: 0.05,
        };
        for number in 0..20 {
            let built = as_built(&site(), &gluing, 7, number);
            assert!((built.position.distance(site().position) - 2e-3).abs() < 1e-12);
            assert!((built.direction.angle_between(DVec3::X) - 0.1).abs() < 1e-9);
            let gain = workshop_draw(&gluing, 7, number).gain;
            assert!(((gain - 1.0).abs() - 0.05).abs() < 1e-12);
            // Another workshop is off the same way, by another amount.
            let usual = as_built(&site(), &Gluing::default(), 7, number);
            let [a, b] = [built, usual].map(|s| (s.position - site().position).normalize());
            assert!(a.distance(b) < 1e-9);
            assert_eq!(as_built(&site(), &Gluing::EXACT, 7, number), site());
        }
    }

    #[test]
    fn what_another_workshop_built_was_not_measured() {
        let truth = Truth {
            touches: Vec::new(),
            regions: Vec::new(),
            element_mm: 1.0,
            work: Work::default(),
            sites: vec![2, 5],
            drawn: vec![site(); 2],
            x: SignalMatrix::default(),
            workshop: SignalMatrix::default(),
            off: Uncertainty::default(),
            grid: None,
            pressed: None,
        };
        let usual = Uncertainty::default();
        let other = Uncertainty {
            gluing: Gluing::EXACT,
            ..usual
        };
        let mut project = Project::around("limb.stl", None);
        project.evaluation.estimator = EstimatorKind::Svr;
        let mut all = vec![site(); 6];
        assert!(truth.measures(&[5, 2, 5], &all, &usual, &project));
        assert!(!truth.measures(&[5, 3], &all, &usual, &project));
        assert!(!truth.measures(&[5, 2], &all, &other, &project));
        project.evaluation.estimator = EstimatorKind::Matching;
        let matched = Truth {
            grid: grid(&project),
            pressed: Some(Pressed {
                presses: Vec::new(),
                x: SignalMatrix::default(),
            }),
            ..truth.clone()
        };
        assert!(!truth.measures(&[5, 2], &all, &usual, &project));
        assert!(matched.measures(&[5, 2], &all, &usual, &project));
        // A gauge off the lattice may lie elsewhere now.
        all[5].position.x += 1e-4;
        assert!(!matched.measures(&[5, 2], &all, &usual, &project));
        all[5] = site();
        project.gauge.grid_length_mm += 1.0;
        assert!(!matched.measures(&[5, 2], &all, &usual, &project));
    }
}
