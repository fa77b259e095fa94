//! Choosing and judging on signals alone, without a part behind them.

use std::borrow::Cow;

use glam::DVec3;
use serde::Serialize;

use crate::budget::Watch;
use crate::dataset::SignalMatrix;
use crate::evaluation::add_noise;
use crate::evaluation::failures::{FailureRow, FailureTrial, failures};
use crate::gaussian_process::{self, Covariance, Distances, GpKernel};
use crate::placement::entropy::Entropy;
use crate::placement::expected_error::{Detail, ExpectedError, Forces, Knowledge, ROUNDS};
use crate::placement::greedy_svr::{Audit, Comparison, GreedySvr};
use crate::placement::information::{Geometry, GeometrySummary};
use crate::placement::mutual_information::MutualInformation;
use crate::placement::pca_qr::PcaQr;
use crate::placement::{
    PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet, Wishes,
};
use crate::regression::folds::{Folds, evenly, hold_out, number_of};
use crate::regression::tune::{self, CrossValidation, Grid, distances};
use crate::regression::{Hyper, PositionModel, Standardizer, scale};

/// Signals of sites under touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Sites × touches, in any unit.
    pub x: SignalMatrix,
    /// Touch positions (mm).
    pub targets: Vec<[f64; 3]>,
    /// Site positions (m); empty where nobody knows them.
    pub positions: Vec<DVec3>,
    /// Cost of each site; empty where all cost the same.
    pub costs: Vec<f64>,
    /// Force of each touch (N) that the signals grow with; empty where they are what they are.
    pub forces: Vec<f64>,
}

/// How a choice is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub kind: SelectorKind,
    /// Greedy SVR's own, and what every choice's criterion in mm is computed with.
    pub svr: GreedySvr,
    /// The kernel of entropy and mutual information; searched when absent.
    pub kernel: Option<GpKernel>,
    /// β⁻¹ of a searched kernel.
    pub kernel_noise: f64,
    /// Standard deviation of the noise added to the signals before choosing, in their unit.
    pub noise: f64,
    /// How hard touches come (N), for signals whose force is known; a third to three times the middle force of the
    /// data when absent.
    pub forces: Option<[f64; 2]>,
    /// How many touches a choice by expected error looks at.
    pub detail: Detail,
}

impl Settings {
    /// What a choice by expected error is told of the signals.
    #[must_use]
    pub fn knowledge<'a>(&self, data: &'a Data) -> Knowledge<'a> {
        /// Forces that come, over the middle one of the data.
        const COMING: [f64; 2] = [1.0 / 3.0, 3.0];
        /// The hardest that is thought possible, over the hardest that comes.
        const POSSIBLE: f64 = 2.0;
        let coming = || {
            let mut sorted = data.forces.clone();
            sorted.sort_by(f64::total_cmp);
            COMING.map(|share| share * sorted[sorted.len() / 2])
        };
        let known = !data.forces.is_empty();
        Knowledge {
            noise: self.noise,
            variance: None,
            among: None,
            forces: known.then(|| {
                let coming = self.forces.unwrap_or_else(coming);
                Forces {
                    touches: &data.forces,
                    coming,
                    possible: POSSIBLE * coming[1],
                }
            }),
            seed: self.svr.seed,
        }
    }
}

/// A choice with what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    pub selection: Selection,
    pub geometry: Option<GeometrySummary>,
    /// Processor seconds of the distances, the search of the kernel, and the choice itself.
    pub seconds: ChoiceSeconds,
}

/// Seconds by the caller's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ChoiceSeconds {
    pub distances: f64,
    pub kernel_search: f64,
    pub selection: f64,
}

/// Chooses among all sites but those kept out.
///
/// # Errors
/// [`PlacementError`] where the data or the wishes do not allow it.
pub fn select(
    data: &Data,
    kept_out: &[usize],
    wishes: &Wishes,
    settings: &Settings,
    clock: &dyn Fn() -> f64,
    watch: Watch,
    found: &(dyn Fn(&SensorSet) + Sync),
) -> Result<Choice, PlacementError> {
    /// A choice that is not learned from needs signals that differ.
    const LEAST: usize = 2;
    let touches = data.targets.len();
    if touches < LEAST {
        return Err(PlacementError::TooFewTouches {
            touches,
            least: 2 * settings.svr.folds,
        });
    }
    // Expected error knows the noise; the others hear it.
    let heard = if settings.kind == SelectorKind::ExpectedError {
        0.0
    } else {
        settings.noise
    };
    let noisy = add_noise(&data.x, heard, settings.svr.seed);
    let open: Vec<usize> = (0..noisy.rows())
        .filter(|s| !kept_out.contains(s))
        .collect();
    if open.is_empty() {
        return Err(PlacementError::Wish {
            what: "every site is kept out: leave some to choose from",
        });
    }
    let place = |site: &usize| open.iter().position(|o| o == site);
    let required: Option<Vec<usize>> = wishes.required.iter().map(place).collect();
    let wishes = Wishes {
        required: required.ok_or(PlacementError::Wish {
            what: "a gauge that must be there is not among the sites, or is kept out",
        })?,
        costs: (!data.costs.is_empty()).then(|| open.iter().map(|&s| data.costs[s]).collect()),
        ..wishes.clone()
    };
    let x = if open.len() == noisy.rows() {
        noisy
    } else {
        Cow::Owned(noisy.select_rows(&open))
    };
    let positions: Vec<DVec3> = if data.positions.is_empty() {
        Vec::new()
    } else {
        open.iter().map(|&s| data.positions[s]).collect()
    };
    let pool = Pool {
        x: &x,
        targets: &data.targets,
        sites: &open,
        positions: &positions,
    };
    let request = Request {
        wishes: &wishes,
        watch,
        found,
    };
    let mut seconds = ChoiceSeconds::default();
    let geometry = match settings.kind {
        SelectorKind::Entropy | SelectorKind::MutualInformation => Some(straight(
            &pool,
            data,
            kept_out,
            settings,
            clock,
            &mut seconds,
            watch,
        )?),
        _ => None,
    };
    let before = clock();
    let geometry = geometry.as_ref();
    let selection = match (settings.kind, geometry) {
        (SelectorKind::Entropy, Some(geometry)) => Entropy { geometry }.select(&pool, &request),
        (SelectorKind::MutualInformation, Some(geometry)) => {
            MutualInformation { geometry }.select(&pool, &request)
        }
        (SelectorKind::PcaQr, _) => PcaQr.select(&pool, &request),
        (SelectorKind::ExpectedError, _) => ExpectedError {
            known: settings.knowledge(data),
            detail: settings.detail,
            rounds: ROUNDS,
        }
        .select(&pool, &request),
        _ => settings.svr.select(&pool, &request),
    }?;
    // The covariance is part of the choice.
    seconds.selection += clock() - before;
    Ok(Choice {
        selection,
        geometry: geometry.map(Geometry::summary),
        seconds,
    })
}

/// A geometry of straight lines: without a mesh nobody knows the way over the surface. Sites that are
/// kept out still count as locations.
fn straight(
    pool: &Pool,
    data: &Data,
    kept_out: &[usize],
    settings: &Settings,
    clock: &dyn Fn() -> f64,
    seconds: &mut ChoiceSeconds,
    watch: Watch,
) -> Result<Geometry, PlacementError> {
    /// Locations nearer than this share of the whole are one.
    const SAME: f64 = 1e-6;
    if pool.positions.is_empty() {
        return Err(PlacementError::Wish {
            what: "entropy and mutual information need the positions of the sites (site_m)",
        });
    }
    let before = clock();
    let mut places = pool.positions.to_vec();
    places.extend(kept_out.iter().filter_map(|&s| data.positions.get(s)));
    let n = places.len();
    let measured: Vec<f64> = places
        .iter()
        .flat_map(|a| places.iter().map(move |b| a.distance(*b)))
        .collect();
    let distances = Distances::new(
        n,
        "straight lines between the sites (there is no mesh)",
        &measured,
    );
    seconds.distances = clock() - before;
    let before = clock();
    let (kernel, map) = if let Some(kernel) = settings.kernel {
        (kernel, Vec::new())
    } else {
        let map = gaussian_process::search(pool.x, &distances, settings.kernel_noise, watch)?;
        (gaussian_process::best(&map).unwrap_or_default(), map)
    };
    seconds.kernel_search = clock() - before;
    let size = measured.iter().copied().fold(0.0, f64::max);
    let before = clock();
    let covariance = Covariance::new(&distances, &kernel, watch)?;
    seconds.selection = clock() - before;
    Ok(Geometry {
        covariance,
        kernel,
        distance: distances.kind,
        coinciding: distances.coinciding(SAME * size),
        map,
    })
}

/// Computes the criterion in mm of every set that has none, with the settings of greedy SVR; sets beyond
/// the first that reaches the wished error are dropped.
///
/// # Errors
/// [`PlacementError`] for too few touches, or when the watch asks for a stop.
pub fn add_criteria(
    data: &Data,
    selection: &mut Selection,
    wishes: &Wishes,
    settings: &Settings,
    watch: Watch,
) -> Result<(), PlacementError> {
    let noisy = add_noise(&data.x, settings.noise, settings.svr.seed);
    let all: Vec<usize> = (0..noisy.rows()).collect();
    let pool = Pool {
        x: &noisy,
        targets: &data.targets,
        sites: &all,
        positions: &data.positions,
    };
    let mut keep = selection.sets.len();
    for (k, set) in selection.sets.iter_mut().enumerate() {
        let error = match set.criterion_mm {
            Some(error) => error,
            None => settings
                .svr
                .criteria(&pool, std::slice::from_ref(&set.sites), watch)?[0],
        };
        set.criterion_mm = Some(error);
        if wishes.target_mm.is_some_and(|t| error <= t) {
            keep = k + 1;
            break;
        }
    }
    selection.sets.truncate(keep);
    Ok(())
}

/// Compares each step of greedy SVR's choice with other sites, by the criterion itself; sites as numbered
/// in the data.
///
/// # Errors
/// As [`select`].
pub fn audit(
    data: &Data,
    kept_out: &[usize],
    choice: &Choice,
    settings: &Settings,
    audit: Audit,
    watch: Watch,
) -> Result<Vec<Comparison>, PlacementError> {
    let noisy = add_noise(&data.x, settings.noise, settings.svr.seed);
    let open: Vec<usize> = (0..noisy.rows())
        .filter(|s| !kept_out.contains(s))
        .collect();
    let x = noisy.select_rows(&open);
    let pool = Pool {
        x: &x,
        targets: &data.targets,
        sites: &open,
        positions: &[],
    };
    let chosen = choice.selection.sets.last();
    let places: Vec<usize> = (chosen.iter().flat_map(|s| &s.sites))
        .filter_map(|site| open.binary_search(site).ok())
        .collect();
    let mut steps = settings.svr.audit(&pool, &places, audit, watch)?;
    for step in &mut steps {
        step.best_other = open[step.best_other];
    }
    Ok(steps)
}

/// The fold that each touch is tested in, so that anyone can compute the criterion again.
#[must_use]
pub fn folds(data: &Data, settings: &Settings) -> Vec<usize> {
    fold_of_touch(&settings.svr, &data.targets)
}

fn fold_of_touch(svr: &GreedySvr, targets: &[[f64; 3]]) -> Vec<usize> {
    Folds::of_groups(&svr.grouping.of(targets), svr.folds, svr.seed).of_touches()
}

/// How many groups of touches there are that are never divided between learning and judging.
#[must_use]
pub fn places(svr: &GreedySvr, targets: &[[f64; 3]]) -> usize {
    number_of(&svr.grouping.of(targets))
}

/// A word on touches that repeat places, where some do.
#[must_use]
pub fn place_note(svr: &GreedySvr, targets: &[[f64; 3]]) -> Option<String> {
    let (places, touches) = (places(svr, targets), targets.len());
    (places < touches).then(|| {
        format!(
            "{touches} touches lie at {places} places: none is learned from and judged on at the same place (--split touch divides them one by one)."
        )
    })
}

/// A word on each of the sites whose signal never changes.
fn constant_notes(x: &SignalMatrix, sites: &[usize]) -> Vec<String> {
    let constant = Standardizer::of(&x.select_rows(sites)).constant_rows();
    let said = |row: usize| {
        format!(
            "Site {} reports the same under every touch: it tells nothing.",
            sites[row]
        )
    };
    constant.into_iter().map(said).collect()
}

/// What is asked about given sites.
pub struct Question<'a> {
    pub sites: &'a [usize],
    pub svr: &'a GreedySvr,
    /// Standard deviation of the noise added to the signals, in their unit.
    pub noise: f64,
    /// Search the regression's settings for each number of gauges.
    pub tune: bool,
    /// Share of the touches held out.
    pub held_out: f64,
    pub failed: usize,
    pub subsets: usize,
    pub baseline: bool,
}

/// Errors on the touches held out (mm).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    pub sensors: usize,
    pub error_mm: f64,
    pub median_mm: f64,
    pub p95_mm: f64,
    pub hyper: Hyper,
    pub converged: bool,
}

/// The answers: for one gauge, two, … all of them in the order given.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Cross-validated over all touches.
    pub criteria_mm: Vec<f64>,
    pub fold_of_touch: Vec<usize>,
    pub errors: Vec<HeldOut>,
    pub baseline: Option<HeldOut>,
    pub failures: Vec<FailureRow>,
    /// The touches that were held out.
    pub test_touches: Vec<usize>,
    /// Groups of touches that were not divided.
    pub places: usize,
    pub notes: Vec<String>,
}

/// Judges given sites.
///
/// # Errors
/// [`PlacementError`] for too few touches, or when the watch asks for a stop.
pub fn evaluate(data: &Data, question: &Question, watch: Watch) -> Result<Verdict, PlacementError> {
    let svr = question.svr;
    let groups = svr.grouping.of(&data.targets);
    let places = number_of(&groups);
    if !question.divides(places) {
        let least = (places..=MOST_PLACES).find(|&n| question.divides(n));
        return Err(svr.too_few(&groups, least.unwrap_or(MOST_PLACES)));
    }
    let noisy = add_noise(&data.x, question.noise, svr.seed);
    let all: Vec<usize> = (0..noisy.rows()).collect();
    let pool = Pool {
        x: &noisy,
        targets: &data.targets,
        sites: &all,
        positions: &data.positions,
    };
    let prefixes: Vec<Vec<usize>> = (1..=question.sites.len())
        .map(|k| question.sites[..k].to_vec())
        .collect();
    let criteria_mm = svr.criteria(&pool, &prefixes, watch)?;
    // Another draw than the folds'.
    let draw = svr.seed.wrapping_add(0x7e57);
    let (mut test, train) = hold_out(&groups, question.tests(places), draw);
    let split = Split::new(&noisy, &data.targets, &train, &test);
    let errors: Result<Vec<HeldOut>, PlacementError> = prefixes
        .iter()
        .map(|rows| split.judge(rows, question, watch))
        .collect();
    let errors = errors?;
    let baseline = question
        .baseline
        .then(|| split.judge(&all, question, watch))
        .transpose()?;
    let hyper = errors.last().map_or(svr.hyper, |e| e.hyper);
    let failures = failures(
        &FailureTrial {
            train: &split.train.select_rows(question.sites),
            train_targets: &split.train_targets,
            test: &split.test.select_rows(question.sites),
            test_targets: &split.test_targets,
            hyper,
            effort: svr.effort,
            failed: question.failed,
            subsets: question.subsets,
            seed: svr.seed,
        },
        watch,
    )?;
    test.sort_unstable();
    let mut notes = constant_notes(&noisy, question.sites);
    notes.extend(place_note(svr, &data.targets));
    Ok(Verdict {
        criteria_mm,
        fold_of_touch: fold_of_touch(svr, &data.targets),
        errors,
        baseline,
        failures,
        test_touches: test,
        places,
        notes,
    })
}

/// More places than any data have.
const MOST_PLACES: usize = 10_000_000;

impl Question<'_> {
    /// How many of so many places are held out.
    fn tests(&self, places: usize) -> usize {
        (self.held_out * places as f64).round() as usize
    }

    /// Whether so many places leave some to judge on and enough to learn from.
    fn divides(&self, places: usize) -> bool {
        let tests = self.tests(places);
        tests > 0 && places.saturating_sub(tests) >= 2 * self.svr.folds
    }
}

/// Touches to learn from and touches to judge on.
struct Split {
    train: SignalMatrix,
    train_targets: Vec<[f64; 3]>,
    test: SignalMatrix,
    test_targets: Vec<[f64; 3]>,
}

impl Split {
    fn new(x: &SignalMatrix, targets: &[[f64; 3]], train: &[usize], test: &[usize]) -> Self {
        let pick = |touches: &[usize]| touches.iter().map(|&t| targets[t]).collect();
        Self {
            train: x.select_columns(train),
            train_targets: pick(train),
            test: x.select_columns(test),
            test_targets: pick(test),
        }
    }

    fn judge(
        &self,
        rows: &[usize],
        question: &Question,
        watch: Watch,
    ) -> Result<HeldOut, PlacementError> {
        /// Touches that settings are searched on.
        const SEARCHED: usize = 1000;
        let svr = question.svr;
        let train = self.train.select_rows(rows);
        let hyper = if question.tune {
            let some = evenly(self.train_targets.len(), SEARCHED);
            let targets: Vec<[f64; 3]> = some.iter().map(|&t| self.train_targets[t]).collect();
            let validation = CrossValidation {
                folds: 3,
                seed: svr.seed,
                grouping: svr.grouping,
                effort: svr.effort,
            };
            let x = train.select_columns(&some);
            let grid = Grid::default().scaled(scale::relative(&self.train_targets));
            tune::search(&x, &targets, &grid, &validation, watch)?
                .0
                .best()
        } else {
            svr.hyper
        };
        let model = PositionModel::train(&train, &self.train_targets, &hyper, svr.effort);
        let predicted = model.predict(&self.test.select_rows(rows));
        let mut errors = distances(&predicted, &self.test_targets);
        errors.sort_by(f64::total_cmp);
        let last = errors.len() - 1;
        let quantile = |q: f64| errors[(q * last as f64).round() as usize];
        Ok(HeldOut {
            sensors: rows.len(),
            error_mm: errors.iter().sum::<f64>() / errors.len() as f64,
            median_mm: quantile(0.5),
            p95_mm: quantile(0.95),
            hyper,
            converged: model.converged().0,
        })
    }
}
