//! How well a set of gauges finds a touch that nobody trained on.

pub mod estimate;
pub mod failures;
pub mod judging;
pub mod matched;
mod rows;

use std::borrow::Cow;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

pub use self::judging::{EstimatorKind, Forces, Judging};
pub use self::matched::{Matched, MatchedRow};
pub use self::rows::{EVERYWHERE, EvaluationRow, TouchRegion};

use self::failures::{FailureRow, FailureTrial, MOST_FAILED, failures};
use self::rows::Said;
use crate::budget::{Budget, Cancelled, Watch, Work, report};
use crate::dataset::{Signal, SignalMatrix};
use crate::draw::normal;
use crate::regression::folds::evenly;
use crate::regression::tune::{self, CrossValidation, Effort, Grid, distances};
use crate::regression::{Grouping, Hyper, PositionModel, scale};

/// Training on one model, judging on another: nothing here has seen the test touches.
pub struct Trial<'a> {
    /// What the sites report.
    pub signal: Signal,
    /// Signals of the sites of interest under the training touches (sites × touches).
    pub train: &'a SignalMatrix,
    /// Where the training touches were (mm).
    pub train_targets: &'a [[f64; 3]],
    /// The same sites under the test touches, from the finer model.
    pub test: &'a SignalMatrix,
    /// The same as a workshop would build them: a little off their places, directions and gains.
    pub workshop: &'a SignalMatrix,
    /// Where the test touches were (mm).
    pub test_targets: &'a [[f64; 3]],
    /// Regions of the test touches that errors are quoted for.
    pub regions: &'a [TouchRegion],
    /// Standard deviation of the noise added to training and test strain, and the numbers of the streams it
    /// is drawn from, one a site: the same stream gives the same noise in every trial.
    pub noise: f64,
    /// Number of the stream of noise of each site.
    pub streams: &'a [u64],
    /// Of noise and folds.
    pub seed: u64,
}

/// Settings are searched for these set sizes and for no others; a size between two takes the settings
/// of the smaller.
const TUNED_SIZES: [usize; 6] = [1, 2, 3, 5, 8, 13];

/// The name under which all candidates together are judged.
pub const BASELINE: &str = "all-candidates";

/// A set to judge: whose it is and which rows of the trial's matrices it has.
pub struct Candidate {
    /// Name of the selector.
    pub selector: String,
    /// Rows of the set's gauges.
    pub rows: Vec<usize>,
    /// Settings of its regression; searched where there are none.
    pub hyper: Option<Hyper>,
}

/// The outcome: rows by set and region, and each set's errors touch by touch (mm), as drawn and as a
/// workshop would build it.
#[derive(Clone, Default)]
pub struct Evaluation {
    /// What judged.
    pub judging: Judging,
    /// By matching: at the force in the middle.
    pub rows: Vec<EvaluationRow>,
    /// As drawn: for each set the error at each test touch (mm).
    pub errors: Vec<Vec<f64>>,
    /// The same as built (mm).
    pub built: Vec<Vec<f64>>,
    /// What is left of each selector's largest set when gauges fail.
    pub failures: Vec<Failures>,
    /// By matching: what was found of each set at each force, and what is quoted of that. The largest set of each
    /// selector has all forces, those before it the one in the middle.
    pub found: Vec<Matched>,
    /// By matching: rows by set, force and region.
    pub matched: Vec<MatchedRow>,
    /// What a reader must know of how sets were judged.
    pub notes: Vec<String>,
    /// What it took.
    pub work: Work,
}

/// Errors of one set with failed gauges.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failures {
    /// Name of the selector.
    pub selector: String,
    /// Gauges of the whole set.
    pub sensors: usize,
    /// Touches that were learned from; by matching, which learns from none, those that were judged.
    pub touches: usize,
    /// Rising in failed gauges.
    pub rows: Vec<FailureRow>,
}

/// Judges sets of sites, each with a regression tuned on the training touches.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn evaluate(
    trial: &Trial,
    sets: &[Candidate],
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, Cancelled> {
    let noisy = Noisy::new(trial);
    let mut evaluation = Evaluation::default();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let hypers = tune_sets(&noisy, trial, sets, budget, watch, &mut evaluation.work)?;
    let results: Result<Vec<_>, Cancelled> = sets
        .par_iter()
        .zip(&hypers)
        .map(|(set, hyper)| {
            let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            report(watch, "Evaluating", so_far, sets.len())?;
            Ok(judge(&noisy, trial, set, hyper, budget))
        })
        .collect();
    for (rows, [errors, built], work) in results? {
        evaluation.rows.extend(rows);
        evaluation.errors.push(errors);
        evaluation.built.push(built);
        evaluation.work += work;
    }
    evaluation.failures = fail(&noisy, trial, sets, &hypers, budget, watch)?;
    Ok(evaluation)
}

/// Failures of each selector's last set; the baseline of all candidates is none.
fn fail(
    noisy: &Noisy,
    trial: &Trial,
    sets: &[Candidate],
    hypers: &[Hyper],
    budget: &Budget,
    watch: Watch,
) -> Result<Vec<Failures>, Cancelled> {
    if budget.failure_subsets == 0 {
        return Ok(Vec::new());
    }
    let touches = evenly(trial.train_targets.len(), budget.failure_touches);
    let targets: Vec<[f64; 3]> = touches.iter().map(|&t| trial.train_targets[t]).collect();
    let train = noisy.train.select_columns(&touches);
    (0..sets.len())
        .filter(|&k| is_largest(sets, k) && sets[k].rows.len() > 1)
        .map(|k| {
            let set = &sets[k];
            let rows = failures(
                &FailureTrial {
                    train: &train.select_rows(&set.rows),
                    train_targets: &targets,
                    test: &noisy.test.select_rows(&set.rows),
                    test_targets: trial.test_targets,
                    hyper: hypers[k],
                    effort: tuning_effort(budget, trial),
                    failed: MOST_FAILED,
                    subsets: budget.failure_subsets,
                    seed: trial.seed,
                },
                watch,
            )?;
            Ok(Failures {
                selector: set.selector.clone(),
                sensors: set.rows.len(),
                touches: touches.len(),
                rows,
            })
        })
        .collect()
}

/// Whether a set is the last of its selector's, and so its largest; the baseline of all candidates is nobody's.
pub(crate) fn is_largest(sets: &[Candidate], k: usize) -> bool {
    let next = sets.get(k + 1);
    sets[k].selector != BASELINE && next.is_none_or(|next| next.selector != sets[k].selector)
}

/// The trial's signals with noise, the same noise for a site in every set it is part of.
struct Noisy<'a> {
    train: Cow<'a, SignalMatrix>,
    test: Cow<'a, SignalMatrix>,
    workshop: Cow<'a, SignalMatrix>,
}

impl<'a> Noisy<'a> {
    fn new(trial: &Trial<'a>) -> Self {
        let noise = if trial.signal == Signal::Strain {
            trial.noise
        } else {
            0.0
        };
        let add = |x: &'a SignalMatrix, draw: u64| {
            let stream = |row: usize| trial.streams[row];
            add_noise_by(x, noise, trial.seed.wrapping_add(draw), &stream)
        };
        Self {
            train: add(trial.train, 1),
            test: add(trial.test, 2),
            workshop: add(trial.workshop, 3),
        }
    }
}

/// Adds Gaussian noise of a standard deviation; every site has a stream of its own.
#[must_use]
pub fn add_noise(x: &SignalMatrix, deviation: f64, seed: u64) -> Cow<'_, SignalMatrix> {
    add_noise_by(x, deviation, seed, &|row| row as u64)
}

/// As [`add_noise`], with the number of each row's stream.
pub(crate) fn add_noise_by<'a>(
    x: &'a SignalMatrix,
    deviation: f64,
    seed: u64,
    stream: &dyn Fn(usize) -> u64,
) -> Cow<'a, SignalMatrix> {
    if deviation == 0.0 {
        return Cow::Borrowed(x);
    }
    let values = (0..x.rows())
        .flat_map(|row| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream(row));
            x.row(row)
                .iter()
                .map(move |v| v + deviation * normal(&mut rng))
                .collect::<Vec<_>>()
        })
        .collect();
    Cow::Owned(SignalMatrix::new(x.columns(), values))
}

fn tune_sets(
    noisy: &Noisy,
    trial: &Trial,
    sets: &[Candidate],
    budget: &Budget,
    watch: Watch,
    work: &mut Work,
) -> Result<Vec<Hyper>, Cancelled> {
    let validation = CrossValidation {
        folds: budget.folds.min(3),
        seed: trial.seed,
        // Computed touches lie apart.
        grouping: Grouping::Touch,
        effort: tuning_effort(budget, trial),
    };
    let grid = Grid::default().scaled(scale::decade(trial.train_targets));
    let columns = evenly(trial.train_targets.len(), budget.tuning_touches);
    let targets: Vec<[f64; 3]> = columns.iter().map(|&c| trial.train_targets[c]).collect();
    let mut hypers: Vec<Hyper> = Vec::with_capacity(sets.len());
    let mut known: Vec<(String, usize, Hyper)> = Vec::new();
    for set in sets {
        let size = set.rows.len();
        let tuned = TUNED_SIZES
            .iter()
            .copied()
            .filter(|&t| t <= size)
            .max()
            .unwrap_or(size);
        let reuse = known
            .iter()
            .find(|k| k.0 == set.selector && k.1 == tuned && size != tuned);
        let hyper = if let Some(hyper) = set.hyper {
            hyper
        } else if let Some((_, _, hyper)) = reuse {
            Hyper {
                gamma: hyper.gamma * tuned as f64 / size as f64,
                ..*hyper
            }
        } else {
            let x = noisy.train.select_rows(&set.rows).select_columns(&columns);
            let (search, cost) = tune::search(&x, &targets, &grid, &validation, watch)?;
            *work += cost;
            known.push((set.selector.clone(), size, search.best()));
            search.best()
        };
        hypers.push(hyper);
    }
    Ok(hypers)
}

/// A search needs the order of the settings, not their last digit.
fn tuning_effort(budget: &Budget, trial: &Trial) -> Effort {
    let effort = Effort {
        tolerance: budget.svr_tolerance_mm.max(0.1),
        max_steps: budget.svr_steps.min(200_000),
    };
    effort.scaled(scale::decade(trial.train_targets))
}

fn judge(
    noisy: &Noisy,
    trial: &Trial,
    set: &Candidate,
    hyper: &Hyper,
    budget: &Budget,
) -> (Vec<EvaluationRow>, [Vec<f64>; 2], Work) {
    let effort = Effort {
        tolerance: budget.svr_tolerance_mm,
        max_steps: budget.svr_steps,
    };
    let effort = effort.scaled(scale::decade(trial.train_targets));
    let train = noisy.train.select_rows(&set.rows);
    let model = PositionModel::train(&train, trial.train_targets, hyper, effort);
    let predicted = model.predict(&noisy.test.select_rows(&set.rows));
    let errors = distances(&predicted, trial.test_targets);
    let built = model.predict(&noisy.workshop.select_rows(&set.rows));
    let built = distances(&built, trial.test_targets);
    let said = Said {
        selector: &set.selector,
        sensors: set.rows.len(),
        hyper: Some(*hyper),
        converged: Some(model.converged().0),
    };
    let rows = said.rows(trial.regions, [&errors, &built]);
    (rows, [errors, built], model.work)
}

impl Evaluation {
    /// The same errors, quoted for other regions of the same test touches.
    #[must_use]
    pub fn in_regions(&self, regions: &[TouchRegion]) -> Self {
        let whole = self.rows.iter().filter(|r| r.region == EVERYWHERE);
        let rows = whole.zip(self.errors.iter().zip(&self.built));
        let rows = rows.flat_map(|(row, (errors, built))| {
            let said = Said {
                selector: &row.selector,
                sensors: row.sensors,
                hyper: row.hyper,
                converged: row.converged,
            };
            said.rows(regions, [errors, built])
        });
        let found = self.found.iter();
        Self {
            rows: rows.collect(),
            matched: found.flat_map(|m| m.rows(regions)).collect(),
            ..self.clone()
        }
    }
}

impl Evaluation {
    /// Of what was found by matching: rows and errors of every set are those at the force in the middle.
    #[must_use]
    pub(crate) fn of_matched(
        judging: Judging,
        found: Vec<Matched>,
        regions: &[TouchRegion],
    ) -> Self {
        let middle = judging.middle_n();
        let of_set = || found.iter().filter(move |m| Some(m.force_n) == middle);
        Self {
            rows: of_set()
                .flat_map(|m| m.said().rows(regions, [&m.errors, &m.built]))
                .collect(),
            errors: of_set().map(|m| m.errors.clone()).collect(),
            built: of_set().map(|m| m.built.clone()).collect(),
            matched: found.iter().flat_map(|m| m.rows(regions)).collect(),
            found,
            judging,
            ..Self::default()
        }
    }

    /// What was found of a set by matching over all touches, a row for each force.
    pub fn by_force(&self, selector: &str, sensors: usize) -> impl Iterator<Item = &MatchedRow> {
        let of_set = move |r: &&MatchedRow| {
            r.selector == selector && r.sensors == sensors && r.region == EVERYWHERE
        };
        self.matched.iter().filter(of_set)
    }
}
