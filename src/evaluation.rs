//! How well a set of gauges finds a touch that nobody trained on.

pub mod estimate;
pub mod failures;
pub mod judging;
pub mod matched;
mod rows;
mod set_id;

use std::borrow::Cow;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

pub use self::judging::{EstimatorKind, Judging, JudgingForces};
pub use self::matched::{Matched, MatchedRow};
pub use self::rows::{EVERYWHERE, EvaluationRow, JudgedSet, NamedRegion};
pub use self::set_id::{Chooser, SetId};

use self::failures::{FailureRow, FailureTrial, MOST_FAILED, failures};
use crate::budget::{Budget, Cancelled, Watch, Work, report};
use crate::dataset::{Signal, SignalMatrix};
use crate::draw::normal;
use crate::placement::SelectorKind;
use crate::regression::folds::evenly;
use crate::regression::tune::{self, CrossValidation, Effort, TuningGrid, distances};
use crate::regression::{Grouping, Hyper, PositionModel, scale};

/// Training on one model, judging on another: nothing here has seen the test touches.
pub struct EvaluationTrial<'a> {
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
    pub regions: &'a [NamedRegion],
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

/// A set to judge: whose it is and which rows of the trial's matrices it has.
pub struct Candidate {
    /// Who chose it.
    pub chooser: Chooser,
    /// Rows of the set's gauges.
    pub rows: Vec<usize>,
    /// Settings of its regression; searched where there are none.
    pub hyper: Option<Hyper>,
}

impl Candidate {
    /// Which set it is.
    #[must_use]
    pub fn id(&self) -> SetId {
        self.chooser.set(self.rows.len())
    }
}

/// The outcome: every set's errors touch by touch, and rows of them by set and region.
#[derive(Clone, Default)]
pub struct Evaluation {
    /// What judged.
    pub judging: Judging,
    /// By matching: at the force in the middle.
    pub rows: Vec<EvaluationRow>,
    /// Errors touch by touch; by matching, at the force in the middle.
    pub sets: Vec<JudgedSet>,
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
    /// The whole set.
    #[serde(flatten)]
    pub set: SetId,
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
    trial: &EvaluationTrial,
    sets: &[Candidate],
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, Cancelled> {
    let judge = Judge {
        noisy: Noisy::new(trial),
        trial,
        budget,
        watch,
    };
    let mut evaluation = Evaluation::default();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let hypers = judge.tune_sets(sets, &mut evaluation.work)?;
    let results: Result<Vec<_>, Cancelled> = sets
        .par_iter()
        .zip(&hypers)
        .map(|(set, hyper)| {
            let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            report(watch, "Evaluating", so_far, sets.len())?;
            Ok(judge.learn(set, hyper))
        })
        .collect();
    for (set, work) in results? {
        evaluation.rows.extend(set.rows(trial.regions));
        evaluation.sets.push(set);
        evaluation.work += work;
    }
    evaluation.failures = judge.fail(sets, &hypers)?;
    Ok(evaluation)
}

/// Whether a set is the last of its selector's, and so its largest; the baseline of all candidates is nobody's.
pub(crate) fn is_largest(sets: &[Candidate], k: usize) -> bool {
    let (chooser, next) = (sets[k].chooser, sets.get(k + 1));
    chooser != Chooser::AllCandidates && next.is_none_or(|next| next.chooser != chooser)
}

/// The trial's signals with noise, the same noise for a site in every set it is part of.
struct Noisy<'a> {
    train: Cow<'a, SignalMatrix>,
    test: Cow<'a, SignalMatrix>,
    workshop: Cow<'a, SignalMatrix>,
}

impl<'a> Noisy<'a> {
    fn new(trial: &EvaluationTrial<'a>) -> Self {
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

/// A search needs the order of the settings, not their last digit.
fn tuning_effort(budget: &Budget, trial: &EvaluationTrial) -> Effort {
    let effort = Effort {
        tolerance: budget.svr_tolerance_mm.max(0.1),
        max_steps: budget.svr_steps.min(200_000),
    };
    effort.scaled(scale::decade(trial.train_targets))
}

/// What sets are judged by.
struct Judge<'a> {
    noisy: Noisy<'a>,
    trial: &'a EvaluationTrial<'a>,
    budget: &'a Budget,
    watch: Watch<'a>,
}

impl Judge<'_> {
    /// The settings of each set's regression.
    fn tune_sets(&self, sets: &[Candidate], work: &mut Work) -> Result<Vec<Hyper>, Cancelled> {
        let (noisy, trial, budget) = (&self.noisy, self.trial, self.budget);
        let validation = CrossValidation {
            folds: budget.folds.min(3),
            seed: trial.seed,
            // Computed touches lie apart.
            grouping: Grouping::Touch,
            effort: tuning_effort(budget, trial),
        };
        let grid = TuningGrid::default().scaled(scale::decade(trial.train_targets));
        let columns = evenly(trial.train_targets.len(), budget.tuning_touches);
        let targets: Vec<[f64; 3]> = columns.iter().map(|&c| trial.train_targets[c]).collect();
        let mut hypers: Vec<Hyper> = Vec::with_capacity(sets.len());
        let mut known: Vec<(SetId, Hyper)> = Vec::new();
        for set in sets {
            let size = set.rows.len();
            let tuned = TUNED_SIZES
                .iter()
                .copied()
                .filter(|&t| t <= size)
                .max()
                .unwrap_or(size);
            let (own, smaller) = (set.id(), set.chooser.set(tuned));
            let reuse = (known.iter()).find(|(of, _)| *of == smaller && own != smaller);
            let hyper = if let Some(hyper) = set.hyper {
                hyper
            } else if let Some((_, hyper)) = reuse {
                Hyper {
                    gamma: hyper.gamma * tuned as f64 / size as f64,
                    ..*hyper
                }
            } else {
                let x = noisy.train.select_rows(&set.rows).select_columns(&columns);
                let (search, cost) = tune::search(&x, &targets, &grid, &validation, self.watch)?;
                *work += cost;
                known.push((own, search.best()));
                search.best()
            };
            hypers.push(hyper);
        }
        Ok(hypers)
    }

    /// Learns from the training touches and is tried on the others.
    fn learn(&self, set: &Candidate, hyper: &Hyper) -> (JudgedSet, Work) {
        let (noisy, trial, budget) = (&self.noisy, self.trial, self.budget);
        let effort = Effort {
            tolerance: budget.svr_tolerance_mm,
            max_steps: budget.svr_steps,
        };
        let effort = effort.scaled(scale::decade(trial.train_targets));
        let train = noisy.train.select_rows(&set.rows);
        let model = PositionModel::train(&train, trial.train_targets, hyper, effort);
        let predicted = model.predict(&noisy.test.select_rows(&set.rows));
        let built = model.predict(&noisy.workshop.select_rows(&set.rows));
        let judged = JudgedSet {
            set: set.id(),
            hyper: Some(*hyper),
            converged: Some(model.converged().0),
            drawn: distances(&predicted, trial.test_targets),
            built: distances(&built, trial.test_targets),
        };
        (judged, model.work)
    }

    /// Failures of each selector's last set; the baseline of all candidates is none.
    fn fail(&self, sets: &[Candidate], hypers: &[Hyper]) -> Result<Vec<Failures>, Cancelled> {
        let (noisy, trial, budget) = (&self.noisy, self.trial, self.budget);
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
                    self.watch,
                )?;
                Ok(Failures {
                    set: set.id(),
                    touches: touches.len(),
                    rows,
                })
            })
            .collect()
    }
}

impl Evaluation {
    /// The same errors, quoted for other regions of the same test touches.
    #[must_use]
    pub fn in_regions(&self, regions: &[NamedRegion]) -> Self {
        let (sets, found) = (self.sets.iter(), self.found.iter());
        Self {
            rows: sets.flat_map(|set| set.rows(regions)).collect(),
            matched: found.flat_map(|m| m.rows(regions)).collect(),
            ..self.clone()
        }
    }

    /// Of what was found by matching: rows and errors of every set are those at the force in the middle.
    #[must_use]
    pub(crate) fn of_matched(
        judging: Judging,
        found: Vec<Matched>,
        regions: &[NamedRegion],
    ) -> Self {
        let middle = judging.middle_n();
        let in_middle = found.iter().filter(|m| Some(m.force_n) == middle);
        let sets: Vec<JudgedSet> = in_middle.map(Matched::judged).collect();
        Self {
            rows: sets.iter().flat_map(|set| set.rows(regions)).collect(),
            sets,
            matched: found.iter().flat_map(|m| m.rows(regions)).collect(),
            found,
            judging,
            ..Self::default()
        }
    }

    /// What was found of a set, over all touches and in each region.
    pub fn of(&self, set: SetId) -> impl Iterator<Item = &EvaluationRow> {
        self.rows.iter().filter(move |r| r.set == set)
    }

    /// What was found of a set over all touches.
    #[must_use]
    pub fn over_all(&self, set: SetId) -> Option<&EvaluationRow> {
        self.of(set).find(|r| r.region == EVERYWHERE)
    }

    /// What was found of all candidates together in a region.
    #[must_use]
    pub fn baseline(&self, region: &str) -> Option<&EvaluationRow> {
        let of_all = |r: &&EvaluationRow| r.set.chooser == Chooser::AllCandidates;
        (self.rows.iter().filter(of_all)).find(|r| r.region == region)
    }

    /// Errors of a set touch by touch.
    #[must_use]
    pub fn judged(&self, set: SetId) -> Option<&JudgedSet> {
        self.sets.iter().find(|judged| judged.set == set)
    }

    /// What is left of a selector's largest set when gauges fail.
    #[must_use]
    pub fn failures_of(&self, selector: SelectorKind) -> Option<&Failures> {
        (self.failures.iter()).find(|f| f.set.chooser == selector.into())
    }

    /// What was found of a set by matching over all touches, a row for each force.
    pub fn by_force(&self, set: SetId) -> impl Iterator<Item = &MatchedRow> {
        let of_set = move |r: &&MatchedRow| r.set == set && r.region == EVERYWHERE;
        self.matched.iter().filter(of_set)
    }
}
