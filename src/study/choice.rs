//! Choosing on signals alone.

use std::borrow::Cow;

use glam::DVec3;
use serde::Serialize;

use super::{ChoiceSettings, Data, forces_of, knowledge};
use crate::budget::Watch;
use crate::dataset::SignalMatrix;
use crate::evaluation::add_noise;
use crate::gaussian_process::{self, Covariance, Distances};
use crate::placement::entropy::Entropy;
use crate::placement::expected_error::{ExpectedError, ROUNDS, ReadingScatter};
use crate::placement::greedy_svr::{Audit, Comparison};
use crate::placement::information::{Geometry, GeometrySummary};
use crate::placement::mutual_information::MutualInformation;
use crate::placement::pca_qr::PcaQr;
use crate::placement::{
    Constraints, PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind,
    SensorSet,
};

/// A choice with what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// What was chosen.
    pub selection: Selection,
    /// The Gaussian process, where one chose.
    pub geometry: Option<GeometrySummary>,
    /// What a choice by expected error weighed.
    pub weighed: Option<WeighedErrors>,
    /// CPU time (s) of the distances, the search of the kernel, and the choice itself.
    pub seconds: ChoiceSeconds,
}

/// What a choice by expected error took to be off.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighedErrors {
    /// Standard deviation of the noise of a reading, beside what the data scatter by; in the unit of the signals.
    pub noise: f64,
    /// The lightest and the hardest touch that come (N); absent where the data do not say how hard touches were.
    pub forces_n: Option<[f64; 2]>,
    /// Of places, presses and noise.
    pub seed: u64,
    /// For each gauge of the last set: standard deviation of a reading about its template, as the data show it, over
    /// the rms of its readings (%).
    pub scatter_percent: Vec<f64>,
    /// Touches that repeat one before, from which a part of that is known.
    pub repeats: usize,
}

/// Seconds by the caller's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ChoiceSeconds {
    /// Of the distances (s).
    pub distances: f64,
    /// Of the search for the kernel (s).
    pub kernel_search: f64,
    /// Of the choice itself (s).
    pub selection: f64,
}

/// What is chosen from, and how: all sites but those kept out.
#[derive(Clone, Copy)]
pub struct ChoiceRequest<'a> {
    /// The signals, with where they are and what they are of.
    pub data: &'a Data,
    /// Sites that may not be chosen.
    pub kept_out: &'a [usize],
    /// What is asked of the choice.
    pub constraints: &'a Constraints,
    /// By whom, and at what effort.
    pub settings: &'a ChoiceSettings,
}

/// Chooses.
///
/// # Errors
/// [`PlacementError`] where the data or the constraints do not allow it.
pub fn select(
    asked: &ChoiceRequest,
    clock: &dyn Fn() -> f64,
    watch: Watch,
    found: &(dyn Fn(&SensorSet) + Sync),
) -> Result<Choice, PlacementError> {
    let ChoiceRequest {
        data,
        kept_out,
        constraints,
        settings,
    } = *asked;
    enough_touches(data, settings)?;
    let offer = AskedSites::new(data, kept_out, constraints, settings)?;
    let pool = Pool {
        x: &offer.x,
        targets: &data.targets,
        sites: &offer.open,
        positions: &offer.positions,
    };
    let request = SelectionRequest {
        constraints: &offer.constraints,
        watch,
        found,
    };
    let located = |seconds: &mut ChoiceSeconds| straight(asked, &pool, clock, seconds, watch);
    match settings.kind {
        SelectorKind::Entropy => by_geometry(located, clock, &|geometry| {
            Entropy { geometry }.select(&pool, &request)
        }),
        SelectorKind::MutualInformation => by_geometry(located, clock, &|geometry| {
            MutualInformation { geometry }.select(&pool, &request)
        }),
        SelectorKind::PcaQr => by_signals(clock, || PcaQr.select(&pool, &request)),
        SelectorKind::GreedySvr => by_signals(clock, || settings.svr.select(&pool, &request)),
        SelectorKind::ExpectedError => {
            let mut weighed = None;
            let choice = by_signals(clock, || {
                let (selection, what) = by_expected_error(&pool, &request, data, settings)?;
                weighed = Some(what);
                Ok(selection)
            })?;
            Ok(Choice { weighed, ..choice })
        }
    }
}

/// Refuses data that nothing can be learned from: a choice needs signals that differ at the least.
fn enough_touches(data: &Data, settings: &ChoiceSettings) -> Result<(), PlacementError> {
    const LEAST: usize = 2;
    let touches = data.targets.len();
    if touches < LEAST {
        return Err(PlacementError::TooFewTouches {
            touches,
            least: 2 * settings.svr.folds,
        });
    }
    Ok(())
}

/// The sites that may be chosen, with what is asked of the choice among them.
struct AskedSites<'a> {
    /// As numbered in the data.
    open: Vec<usize>,
    /// Their signals, as the selector is to see them.
    x: Cow<'a, SignalMatrix>,
    /// m; empty where nobody knows them.
    positions: Vec<DVec3>,
    /// As numbered among the open sites.
    constraints: Constraints,
}

impl<'a> AskedSites<'a> {
    fn new(
        data: &'a Data,
        kept_out: &[usize],
        constraints: &Constraints,
        settings: &ChoiceSettings,
    ) -> Result<Self, PlacementError> {
        // Expected error knows the noise; to the others it is added.
        let added = if settings.kind == SelectorKind::ExpectedError {
            0.0
        } else {
            settings.noise
        };
        let noisy = add_noise(&data.x, added, settings.svr.seed);
        let open: Vec<usize> = (0..noisy.rows())
            .filter(|s| !kept_out.contains(s))
            .collect();
        if open.is_empty() {
            return Err(PlacementError::Constraint {
                what: "every site is kept out: leave some to choose from",
            });
        }
        let constraints = among(constraints, &open, &data.costs)?;
        let positions: Vec<DVec3> = if data.positions.is_empty() {
            Vec::new()
        } else {
            open.iter().map(|&s| data.positions[s]).collect()
        };
        let x = if open.len() == noisy.rows() {
            noisy
        } else {
            Cow::Owned(noisy.select_rows(&open))
        };
        Ok(Self {
            open,
            x,
            positions,
            constraints,
        })
    }
}

/// Constraints by the numbers of the sites that are open, with what those cost.
fn among(
    constraints: &Constraints,
    open: &[usize],
    costs: &[f64],
) -> Result<Constraints, PlacementError> {
    let place = |site: &usize| open.iter().position(|o| o == site);
    let required: Option<Vec<usize>> = constraints.required.iter().map(place).collect();
    Ok(Constraints {
        required: required.ok_or(PlacementError::Constraint {
            what: "a gauge that must be there is not among the sites, or is kept out",
        })?,
        costs: (!costs.is_empty()).then(|| open.iter().map(|&s| costs[s]).collect()),
        ..constraints.clone()
    })
}

/// A choice by the signals alone.
fn by_signals(
    clock: &dyn Fn() -> f64,
    choose: impl FnOnce() -> Result<Selection, PlacementError>,
) -> Result<Choice, PlacementError> {
    let before = clock();
    let selection = choose()?;
    Ok(Choice {
        selection,
        geometry: None,
        weighed: None,
        seconds: ChoiceSeconds {
            selection: clock() - before,
            ..ChoiceSeconds::default()
        },
    })
}

/// A choice by a Gaussian process over the sites.
fn by_geometry(
    located: impl FnOnce(&mut ChoiceSeconds) -> Result<Geometry, PlacementError>,
    clock: &dyn Fn() -> f64,
    choose: &dyn Fn(&Geometry) -> Result<Selection, PlacementError>,
) -> Result<Choice, PlacementError> {
    let mut seconds = ChoiceSeconds::default();
    let geometry = located(&mut seconds)?;
    let before = clock();
    let selection = choose(&geometry)?;
    // The covariance is part of the choice.
    seconds.selection += clock() - before;
    Ok(Choice {
        selection,
        geometry: Some(geometry.summary()),
        weighed: None,
        seconds,
    })
}

/// A choice by expected error: what readings are off by is what the data scatter by, beside the noise.
fn by_expected_error(
    pool: &Pool,
    request: &SelectionRequest,
    data: &Data,
    settings: &ChoiceSettings,
) -> Result<(Selection, WeighedErrors), PlacementError> {
    let (noise, seed) = (settings.noise, settings.svr.seed);
    let scatter = ReadingScatter::of(pool.x, pool.targets, forces_of(data));
    let variance = |row: usize, touch: usize| scatter.variance(row, touch);
    let known = knowledge(&data.forces, settings.forces, noise, seed, &variance);
    let forces_n = known.forces.map(|f| f.coming);
    let selector = ExpectedError {
        known,
        detail: settings.detail,
        rounds: ROUNDS,
    };
    let mut selection = selector.select(pool, request)?;
    if forces_n.is_none() {
        selection.achieved.notes.push(NO_FORCES.to_owned());
    }
    if noise <= 0.0 {
        selection.achieved.notes.push(NO_NOISE.to_owned());
    }
    if settings.forces.is_none() {
        selection.achieved.notes.extend(drowned(pool.x, noise));
    }
    let chosen = selection.sets.last().map_or(&[][..], |set| &set.sites[..]);
    let rows = chosen
        .iter()
        .filter_map(|site| pool.sites.iter().position(|s| s == site));
    let weighed = WeighedErrors {
        noise,
        forces_n,
        seed,
        scatter_percent: rows.map(|row| 100.0 * scatter.share(row)).collect(),
        repeats: scatter.repeats(),
    };
    Ok((selection, weighed))
}

/// What is said where noise hides all that the signals tell: most often it was given in another unit.
fn drowned(x: &SignalMatrix, noise: f64) -> Option<String> {
    let range = |row: &[f64]| {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = row
            .iter()
            .fold(ends, |(low, high), &v| (low.min(v), high.max(v)));
        high - low
    };
    let widest = (0..x.rows()).map(|r| range(x.row(r))).fold(0.0, f64::max);
    (noise > widest).then(|| {
        format!(
            "The noise given ({noise:.3e}) is more than any site's signal changes by over all touches ({widest:.3e}): there is next to nothing to choose by. --noise is in the unit of the signals."
        )
    })
}

const NO_FORCES: &str = "The data do not say how hard touches were (force_n): readings are compared as they are, and what differs with the force counts as scatter.";
const NO_NOISE: &str =
    "No noise was given (--noise): what is weighed is what the data themselves scatter by.";

/// A geometry of straight lines: without a mesh nobody knows the way over the surface. Sites that are
/// kept out still count as locations.
fn straight(
    asked: &ChoiceRequest,
    pool: &Pool,
    clock: &dyn Fn() -> f64,
    seconds: &mut ChoiceSeconds,
    watch: Watch,
) -> Result<Geometry, PlacementError> {
    /// Locations nearer than this share of the whole are one.
    const SAME: f64 = 1e-6;
    let settings = asked.settings;
    if pool.positions.is_empty() {
        return Err(PlacementError::Constraint {
            what: "entropy and mutual information need the positions of the sites (site_m)",
        });
    }
    let before = clock();
    let mut places = pool.positions.to_vec();
    let kept_out = asked.kept_out.iter();
    places.extend(kept_out.filter_map(|&s| asked.data.positions.get(s)));
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
/// the first that reaches the error asked for are dropped.
///
/// # Errors
/// [`PlacementError`] for too few touches, or when the watch asks for a stop.
pub fn add_criteria(
    asked: &ChoiceRequest,
    selection: &mut Selection,
    watch: Watch,
) -> Result<(), PlacementError> {
    let ChoiceRequest { data, settings, .. } = *asked;
    let target_mm = asked.constraints.target_mm;
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
        if target_mm.is_some_and(|t| error <= t) {
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
    asked: &ChoiceRequest,
    choice: &Choice,
    audit: Audit,
    watch: Watch,
) -> Result<Vec<Comparison>, PlacementError> {
    let ChoiceRequest { data, settings, .. } = *asked;
    let noisy = add_noise(&data.x, settings.noise, settings.svr.seed);
    let open: Vec<usize> = (0..noisy.rows())
        .filter(|s| !asked.kept_out.contains(s))
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
