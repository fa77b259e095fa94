//! Which sites gauges may have, and which they get.

use std::borrow::Cow;
use std::cell::LazyCell;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::known::{Known, detail};
use super::{DesignError, HEARD_SEED, Inputs, LEAST_TOUCHES, Shortage, Simulated};
use crate::budget::{Budget, Cancelled, Watch};
use crate::dataset::{Signal, SignalMatrix, Site};
use crate::elasticity::support::supported_vertices;
use crate::evaluation;
use crate::feasible::{Feasibility, FeasibleInput, blame, feasible};
use crate::gaussian_process::{self, Covariance, Distances, GpKernel};
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh, geodesic};
use crate::pca::Pca;
use crate::placement::candidates::{Candidates, reduce};
use crate::placement::entropy::Entropy;
use crate::placement::expected_error::{self, ExpectedError};
use crate::placement::greedy_svr::{self, GreedySvr};
use crate::placement::information::Geometry;
use crate::placement::mutual_information::MutualInformation;
use crate::placement::wishes::Thorough;
use crate::placement::{
    PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet, Wishes, lead,
    pca_qr,
};
use crate::project::{CostKeys, Elements};
use crate::regression::Grouping;
use crate::regression::folds::evenly;
use crate::regression::tune::Effort;

/// Filters the sites.
#[must_use]
pub fn filter(inputs: &Inputs, simulated: &Simulated) -> Feasibility {
    let looked = LookedAt::of(inputs, simulated);
    feasible(&looked.input(simulated), &inputs.project.feasible_rules())
}

/// Why so many gauges have no room.
fn shortage(
    inputs: &Inputs,
    simulated: &Simulated,
    feasibility: &Feasibility,
    wanted: usize,
) -> Shortage {
    let looked = LookedAt::of(inputs, simulated);
    let rules = inputs.project.feasible_rules();
    let more = wanted.saturating_sub(feasibility.sites().len());
    let blame = blame(&looked.input(simulated), &rules, feasibility, more);
    Shortage::of(inputs, feasibility, wanted, blame)
}

/// What the filters look at, beside the simulation.
struct LookedAt {
    index: SurfaceIndex,
    supported: Vec<u32>,
    painted: Option<Vec<bool>>,
    kept_out: Option<Vec<bool>>,
}

impl LookedAt {
    fn of(inputs: &Inputs, simulated: &Simulated) -> Self {
        let part = LazyCell::new(|| SurfaceIndex::new(&inputs.part));
        // Gauges that were moved off the lattice are no sites to choose.
        let sites = &simulated.dataset.sites[..simulated.lattice];
        let on = |mask: &Arc<Vec<bool>>| painted_sites(&inputs.part, &part, mask, sites);
        let named = inputs.project.feasible.keep_out.as_ref();
        Self {
            index: SurfaceIndex::new(&simulated.mesh),
            supported: supported_vertices(&simulated.held),
            painted: inputs.painted.as_ref().map(on),
            kept_out: named.and_then(|name| inputs.masks.get(name)).map(on),
        }
    }

    fn input<'a>(&'a self, simulated: &'a Simulated) -> FeasibleInput<'a> {
        FeasibleInput {
            mesh: &simulated.mesh,
            index: &self.index,
            supported: &self.supported,
            points: &simulated.points[..simulated.lattice],
            sites: &simulated.dataset.sites[..simulated.lattice],
            surroundings: simulated.surroundings.as_ref(),
            painted: self.painted.as_deref(),
            kept_out: self.kept_out.as_deref(),
        }
    }
}

/// Whether each site lies where the mask (one value a vertex of the part) is mostly set.
pub(super) fn painted_sites(
    part: &TriMesh,
    index: &SurfaceIndex,
    mask: &[bool],
    sites: &[Site],
) -> Vec<bool> {
    sites
        .iter()
        .map(|site| part.mostly_in(mask, index.nearest(site.position).0))
        .collect()
}

/// The reduction stage: candidates among the feasible sites, and the components they came from.
pub struct Reduced {
    pub feasible: Vec<usize>,
    /// Signals of the feasible sites.
    pub x: SignalMatrix,
    pub pca: Pca,
    pub candidates: Candidates,
    /// Made when a selector first asks for it.
    geometry: OnceLock<Located>,
    /// Candidates as numbered in the dataset, in the order of the pivots.
    pub sites: Vec<usize>,
}

/// A Gaussian process and where its locations are.
pub struct Located {
    pub geometry: Geometry,
    /// The feasible ones among them, which come first: rows of the reduced signals.
    pub rows: Vec<usize>,
    /// All of them, as numbered in the dataset.
    pub sites: Vec<usize>,
}

impl Reduced {
    /// The Gaussian process, where a selector asked for it.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.located().map(|g| &g.geometry)
    }

    /// The same with where its locations are.
    #[must_use]
    pub fn located(&self) -> Option<&Located> {
        self.geometry.get()
    }

    /// What the Gaussian process leaves uncertain (σ², 1 where nothing is known) at each of its locations
    /// (dataset sites) when there are gauges at some positions (m); each counts at the nearest location.
    #[must_use]
    pub fn uncertainty(&self, all: &[Site], gauges: &[DVec3]) -> Option<(Vec<usize>, Vec<f64>)> {
        let located = self.geometry.get()?;
        let away = |l: usize, p: DVec3| all[located.sites[l]].position.distance_squared(p);
        let measured: Vec<usize> = (gauges.iter())
            .filter_map(|&p| {
                (0..located.sites.len()).min_by(|&a, &b| away(a, p).total_cmp(&away(b, p)))
            })
            .collect();
        let variances = located.geometry.variances_given(&measured);
        Some((located.sites.clone(), variances))
    }
}

/// Reduces the feasible sites to candidates.
///
/// # Errors
/// [`DesignError`] where less is feasible than is asked for, and for too few touches.
pub fn reduce_sites(
    inputs: &Inputs,
    simulated: &Simulated,
    feasibility: &Feasibility,
    budget: &Budget,
    watch: Watch,
) -> Result<Reduced, DesignError> {
    let feasible = feasibility.sites();
    let sensors = inputs.project.selection.sensors;
    if sensors.max(1) > feasible.len() {
        return Err(shortage(inputs, simulated, feasibility, sensors).into());
    }
    enough_touches(inputs, simulated, budget)?;
    let x = simulated.dataset.x.select_rows(&feasible);
    let scored = budget.selection_candidates.max(sensors);
    let pca = Pca::new(&x, scored, watch).map_err(PlacementError::from)?;
    let limit = budget.candidates.max(sensors);
    let mut candidates = reduce(&x, inputs.project.reduction(), limit, watch)?;
    if candidates.rows.len() < sensors {
        // The variance asked for needs fewer sites than there are gauges to place.
        candidates.rows = pca.pivots(sensors.min(pca.reach()));
        candidates.notes.push(format!(
            "Kept {} candidates, one a gauge: the variance asked for needs fewer.",
            candidates.rows.len()
        ));
    }
    let sites = candidates.rows.iter().map(|&r| feasible[r]).collect();
    Ok(Reduced {
        feasible,
        x,
        pca,
        candidates,
        geometry: OnceLock::new(),
        sites,
    })
}

/// Refuses to learn from next to nothing, saying what took the touches.
fn enough_touches(
    inputs: &Inputs,
    simulated: &Simulated,
    budget: &Budget,
) -> Result<(), DesignError> {
    let touches = simulated.dataset.touches.len();
    if touches >= LEAST_TOUCHES {
        return Ok(());
    }
    let asked = &inputs.project.touch;
    let remedy = if asked.count < LEAST_TOUCHES {
        format!(
            "raise touch.count from {} to at least {LEAST_TOUCHES}",
            asked.count
        )
    } else if budget.touches < LEAST_TOUCHES {
        format!(
            "raise budget.limits.touches from {} to at least {LEAST_TOUCHES}",
            budget.touches
        )
    } else {
        format!(
            "hardly any place that was tried may be touched. Widen touch.region if there is one, or lower touch.edge_margin_mm ({} mm) or touch.reach_mm ({} mm)",
            asked.edge_margin_mm, asked.reach_mm
        )
    };
    Err(DesignError::TooFewTouches {
        touches,
        least: LEAST_TOUCHES,
        remedy,
    })
}

/// The Gaussian process over the feasible sites (first) and all others.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn geometry(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    budget: &Budget,
    watch: Watch,
) -> Result<Located, Cancelled> {
    /// Locations nearer than this are one (m).
    const SAME: f64 = 1e-6;
    let mut feasible = vec![false; simulated.lattice];
    for &site in &reduced.feasible {
        feasible[site] = true;
    }
    let others: Vec<usize> = (0..feasible.len()).filter(|&s| !feasible[s]).collect();
    let rows = evenly(reduced.feasible.len(), budget.locations);
    let mut order: Vec<usize> = rows.iter().map(|&r| reduced.feasible[r]).collect();
    let elsewhere = evenly(others.len(), budget.locations / 2);
    order.extend(elsewhere.iter().map(|&k| others[k]));
    let count = order.len();
    let places: Vec<SurfacePoint> = order.iter().map(|&s| simulated.points[s]).collect();
    let measured = geodesic::between(&simulated.mesh, &places, watch)?;
    let distances = Distances::new(count, "over the surface (fast marching)", &measured);
    let keys = &inputs.project.selection.gaussian_process;
    let noise = keys.noise;
    let (kernel, map) = if let Some((length_m, power)) = keys.given() {
        let kernel = GpKernel {
            length_m,
            power,
            noise,
        };
        (kernel, Vec::new())
    } else {
        let x = heard(inputs, reduced).select_rows(&rows);
        let map = gaussian_process::search(&x, &distances, noise, watch)?;
        (gaussian_process::best(&map).unwrap_or_default(), map)
    };
    let geometry = Geometry {
        covariance: Covariance::new(&distances, &kernel, watch)?,
        kernel,
        distance: distances.kind,
        coinciding: distances.coinciding(SAME),
        map,
    };
    Ok(Located {
        geometry,
        rows,
        sites: order,
    })
}

/// Sites that a selector may choose from, with what the project asks of the choice.
struct Offer<'a> {
    /// As numbered in the dataset.
    sites: &'a [usize],
    positions: Vec<DVec3>,
    wishes: Wishes,
}

impl<'a> Offer<'a> {
    fn new(
        inputs: &Inputs,
        simulated: &Simulated,
        sites: &'a [usize],
    ) -> Result<Self, DesignError> {
        let positions: Vec<DVec3> = (sites.iter())
            .map(|&s| simulated.dataset.sites[s].position)
            .collect();
        let keys = &inputs.project.selection;
        let near = |at: &[f64; 3]| nearest(&positions, *at).ok_or(PlacementError::NoSites);
        let required: Result<Vec<usize>, PlacementError> =
            keys.required_mm.iter().map(near).collect();
        let wishes = Wishes {
            sensors: keys.sensors,
            required: required?,
            spacing: keys.spacing_mm / 1000.0,
            costs: (!keys.costs.is_empty()).then(|| costs(&keys.costs, &positions)),
            budget: keys.cost_budget,
            target_mm: keys.target_mm,
            failure: keys.failure,
            loss: keys.loss(),
            thorough: Thorough {
                exchange: keys.exchange,
                starts: keys.starts,
            },
        };
        Ok(Self {
            sites,
            positions,
            wishes,
        })
    }

    /// What is chosen for signals of these sites under touches at some places (mm).
    fn choose(
        &self,
        x: &SignalMatrix,
        targets: &[[f64; 3]],
        (watch, found): Telling,
        selector: impl FnOnce(&Pool, &Request) -> Result<Selection, PlacementError>,
    ) -> Result<Selection, PlacementError> {
        let pool = Pool {
            x,
            targets,
            sites: self.sites,
            positions: &self.positions,
        };
        let request = Request {
            wishes: &self.wishes,
            watch,
            found,
        };
        selector(&pool, &request)
    }
}

/// Which of some positions (m) is nearest to a place (mm).
fn nearest(positions: &[DVec3], at_mm: [f64; 3]) -> Option<usize> {
    let at = DVec3::from_array(at_mm) / 1000.0;
    (0..positions.len()).min_by(|&a, &b| {
        (positions[a].distance_squared(at)).total_cmp(&positions[b].distance_squared(at))
    })
}

/// What a gauge costs at each position (m).
pub(super) fn costs(boxes: &[CostKeys], positions: &[DVec3]) -> Vec<f64> {
    let cost = |p: &DVec3| {
        let inside = boxes.iter().rev().find(|b| b.contains(*p * 1000.0));
        inside.map_or(1.0, |b| b.cost)
    };
    positions.iter().map(cost).collect()
}

/// The signals of the feasible sites that selectors choose from, with noise where that is asked for.
fn heard<'a>(inputs: &Inputs, reduced: &'a Reduced) -> Cow<'a, SignalMatrix> {
    let project = &inputs.project;
    let noise = if project.selection.with_noise && project.gauge.signal == Signal::Strain {
        project.gauge.noise_microstrain * 1e-6
    } else {
        0.0
    };
    let seed = project.budget.seed.wrapping_add(HEARD_SEED);
    evaluation::add_noise(&reduced.x, noise, seed)
}

/// Told of every set as soon as it is found, with the sites it counts in.
pub type Found<'a> = &'a (dyn Fn(SelectorKind, &SensorSet, &[Site]) + Sync);

/// Runs one selector.
///
/// # Errors
/// [`DesignError`] where the pool does not allow it.
pub fn select(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    kind: SelectorKind,
    budget: &Budget,
    watch: Watch,
) -> Result<Selection, DesignError> {
    let unheard: Found = &|_, _, _| ();
    select_step_by_step(inputs, simulated, reduced, kind, budget, watch, unheard)
}

/// As [`select`], telling of every step.
///
/// # Errors
/// As [`select`].
pub fn select_step_by_step(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    kind: SelectorKind,
    budget: &Budget,
    watch: Watch,
    found: Found,
) -> Result<Selection, DesignError> {
    let mut selection = choose(inputs, simulated, reduced, kind, budget, watch, found)?;
    // Expected error is judged on a sample of presses, whose scatter counts beside what elements leave open: which of
    // its picks are firm is not known.
    if kind != SelectorKind::ExpectedError {
        let tolerance = model_tolerance(inputs, simulated);
        let firm = lead::within_model(&selection.sets, tolerance);
        selection.achieved.notes.extend(firm);
    }
    Ok(selection)
}

/// What elements leave open of any criterion, as a share: a pick that leads by less than twice this may be another
/// on other elements, and elements that are laid anew for a part may differ wherever the part differs at all. Zero
/// for the part's own triangles, which stay as they are.
#[must_use]
pub fn model_tolerance(inputs: &Inputs, simulated: &Simulated) -> f64 {
    if inputs.project.part.elements == Elements::AsGiven {
        return 0.0;
    }
    let percent = simulated.discretization.strain_percent;
    if percent.is_nan() {
        simulated.discretization.displacement_percent / 100.0
    } else {
        percent / 100.0
    }
}

fn choose(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    kind: SelectorKind,
    budget: &Budget,
    watch: Watch,
    found: Found,
) -> Result<Selection, DesignError> {
    let found = |set: &SensorSet| found(kind, set, &simulated.dataset.sites);
    let telling: Telling = (watch, &found);
    match kind {
        SelectorKind::ExpectedError => {
            select_by_expected_error(inputs, simulated, reduced, budget, telling)
        }
        SelectorKind::GreedySvr => select_by_svr(inputs, simulated, reduced, budget, telling),
        SelectorKind::PcaQr => select_by_pivots(inputs, simulated, reduced, telling),
        SelectorKind::Entropy | SelectorKind::MutualInformation => {
            select_by_geometry(inputs, simulated, reduced, kind, budget, telling)
        }
    }
}

/// Who is asked whether to go on, and told of each set.
type Telling<'a> = (Watch<'a>, &'a (dyn Fn(&SensorSet) + Sync));

fn select_by_pivots(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    telling: Telling,
) -> Result<Selection, DesignError> {
    let offer = Offer::new(inputs, simulated, &reduced.feasible)?;
    let x = heard(inputs, reduced);
    let with_noise = inputs.project.selection.with_noise;
    let targets = simulated.dataset.targets_mm();
    let selection = offer.choose(&x, &targets, telling, |pool, request| {
        if with_noise {
            pca_qr::PcaQr.select(pool, request)
        } else {
            pca_qr::from_components(&reduced.pca, pool, request)
        }
    })?;
    Ok(selection)
}

fn select_by_geometry(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    kind: SelectorKind,
    budget: &Budget,
    telling: Telling,
) -> Result<Selection, DesignError> {
    let located = if let Some(known) = reduced.geometry.get() {
        known
    } else {
        let made = geometry(inputs, simulated, reduced, budget, telling.0)?;
        reduced.geometry.get_or_init(|| made)
    };
    let Located { geometry, rows, .. } = located;
    let known: Vec<usize> = rows.iter().map(|&r| reduced.feasible[r]).collect();
    let offer = Offer::new(inputs, simulated, &known)?;
    let x = reduced.x.select_rows(rows);
    let targets = simulated.dataset.targets_mm();
    let mut selection = offer.choose(&x, &targets, telling, |pool, request| {
        if kind == SelectorKind::Entropy {
            Entropy { geometry }.select(pool, request)
        } else {
            MutualInformation { geometry }.select(pool, request)
        }
    })?;
    if known.len() < reduced.feasible.len() {
        selection.achieved.notes.push(format!(
            "Chosen from {} of {} feasible sites, evenly taken.",
            known.len(),
            reduced.feasible.len()
        ));
    }
    Ok(selection)
}

fn select_by_expected_error(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    budget: &Budget,
    telling: Telling,
) -> Result<Selection, DesignError> {
    let known = Known::new(inputs, simulated);
    let variance = |row: usize, touch: usize| known.variance(reduced.feasible[row], touch);
    let selector = ExpectedError {
        known: known.knowledge(&variance),
        detail: detail(budget),
        rounds: expected_error::ROUNDS,
    };
    let offer = Offer::new(inputs, simulated, &reduced.feasible)?;
    let targets = simulated.dataset.targets_mm();
    let selection = offer.choose(&reduced.x, &targets, telling, |pool, request| {
        selector.select(pool, request)
    })?;
    Ok(selection)
}

/// The feasible sites nearest to the places where gauges must be: rows of the reduced signals.
fn required_rows(inputs: &Inputs, simulated: &Simulated, reduced: &Reduced) -> Vec<usize> {
    let positions: Vec<DVec3> = (reduced.feasible.iter())
        .map(|&s| simulated.dataset.sites[s].position)
        .collect();
    let required = inputs.project.selection.required_mm.iter();
    required.filter_map(|&at| nearest(&positions, at)).collect()
}

fn select_by_svr(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    budget: &Budget,
    telling: Telling,
) -> Result<Selection, DesignError> {
    let all = simulated.dataset.targets_mm();
    let sensors = inputs.project.selection.sensors;
    let limit = budget.selection_candidates.max(sensors);
    let mut rows = if reduced.sites.len() > limit {
        reduced.pca.pivots(limit)
    } else {
        reduced.candidates.rows.clone()
    };
    // A place that must have a gauge is a candidate whether or not the reduction kept it.
    for row in required_rows(inputs, simulated, reduced) {
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    let sites: Vec<usize> = rows.iter().map(|&r| reduced.feasible[r]).collect();
    let touches = evenly(all.len(), budget.selection_touches);
    let heard = heard(inputs, reduced);
    let x = heard.select_rows(&rows).select_columns(&touches);
    let targets: Vec<[f64; 3]> = touches.iter().map(|&t| all[t]).collect();
    let selector = GreedySvr {
        hyper: inputs.project.hyper(),
        folds: budget.folds,
        seed: inputs.project.budget.seed,
        // Computed touches lie apart.
        grouping: Grouping::Touch,
        effort: Effort {
            tolerance: budget.svr_tolerance_mm,
            max_steps: budget.svr_steps,
        },
        tolerance: greedy_svr::TOLERANCE,
        landmarks: 1.0,
    };
    let offer = Offer::new(inputs, simulated, &sites)?;
    let mut selection = offer.choose(&x, &targets, telling, |pool, request| {
        selector.select(pool, request)
    })?;
    if touches.len() < all.len() || sites.len() < reduced.sites.len() {
        selection.achieved.notes.push(format!(
            "Scored on {} of {} touches and {} of {} candidates.",
            touches.len(),
            all.len(),
            sites.len(),
            reduced.sites.len()
        ));
    }
    Ok(selection)
}
