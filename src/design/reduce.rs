//! The reduction stage: the feasible sites, which are reduced to candidates only where somebody asks for these.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::filter::shortage;
use super::{DesignError, Inputs, LEAST_TOUCHES, SELECTION_NOISE_SEED, Simulated};
use crate::budget::{Budget, Cancelled, Watch};
use crate::dataset::{Signal, SignalMatrix, Site};
use crate::evaluation;
use crate::feasible::Feasibility;
use crate::gaussian_process::{self, Covariance, Distances, GpKernel};
use crate::mesh::{SurfacePoint, geodesic};
use crate::pca::{Pca, PcaError};
use crate::placement::PlacementError;
use crate::placement::candidates::{Candidates, Reduction, reduce};
use crate::placement::information::Geometry;
use crate::regression::Standardizer;
use crate::regression::folds::evenly;

/// The feasible sites, and what selectors that ask for it make of them: once, whoever asks first.
pub struct ReducedSites {
    /// Feasible sites, as numbered in the dataset.
    pub feasible: Vec<usize>,
    /// Signals of the feasible sites.
    pub x: SignalMatrix,
    asked: ReductionRequest,
    components: OnceLock<Pca>,
    candidates: OnceLock<Arc<Candidates>>,
    geometry: OnceLock<Located>,
}

/// How a reduction is to be made.
struct ReductionRequest {
    reduction: Reduction,
    /// Most candidates.
    limit: usize,
    sensors: usize,
    /// Components that selectors pick by.
    components: usize,
}

/// A Gaussian process and where its locations are.
pub struct Located {
    /// The process over them.
    pub geometry: Geometry,
    /// The feasible ones among them, which come first: rows of the reduced signals.
    pub rows: Vec<usize>,
    /// All of them, as numbered in the dataset.
    pub sites: Vec<usize>,
}

impl ReducedSites {
    /// The components of the signals.
    ///
    /// # Errors
    /// [`PlacementError`] where there are none, or the watch asks for a stop.
    pub fn components(&self, watch: Watch) -> Result<&Pca, PlacementError> {
        if let Some(known) = self.components.get() {
            return Ok(known);
        }
        let made = Pca::new(&self.x, self.asked.components, watch)?;
        Ok(self.components.get_or_init(|| made))
    }

    /// The candidates among the feasible sites.
    ///
    /// # Errors
    /// As [`Self::components`].
    pub fn candidates(&self, watch: Watch) -> Result<&Arc<Candidates>, PlacementError> {
        if let Some(known) = self.candidates.get() {
            return Ok(known);
        }
        let ReductionRequest {
            reduction,
            limit,
            sensors,
            ..
        } = self.asked;
        let mut made = reduce(&self.x, reduction, limit, watch)?;
        if made.rows.len() < sensors {
            // The variance asked for needs fewer sites than there are gauges to place.
            let components = self.components(watch)?;
            made.rows = components.pivots(sensors.min(components.reach()));
            made.notes.push(format!(
                "Kept {} candidates, one a gauge: the variance asked for needs fewer.",
                made.rows.len()
            ));
        }
        Ok(self.candidates.get_or_init(|| Arc::new(made)))
    }

    /// The candidates as numbered in the dataset, in the order of the pivots; none before anybody asked for them.
    #[must_use]
    pub fn candidate_sites(&self) -> Vec<usize> {
        let rows = self.candidates.get().map_or(&[][..], |c| &c.rows);
        rows.iter().map(|&r| self.feasible[r]).collect()
    }

    /// The Gaussian process, made where no selector asked for it before.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn locate(
        &self,
        inputs: &Inputs,
        simulated: &Simulated,
        budget: &Budget,
        watch: Watch,
    ) -> Result<&Located, Cancelled> {
        if let Some(known) = self.geometry.get() {
            return Ok(known);
        }
        let made = geometry(inputs, simulated, self, budget, watch)?;
        Ok(self.geometry.get_or_init(|| made))
    }

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
        let away = |l: usize, p: DVec3| all[located.sites[l]].gauge.position.distance_squared(p);
        let measured: Vec<usize> = (gauges.iter())
            .filter_map(|&p| {
                (0..located.sites.len()).min_by(|&a, &b| away(a, p).total_cmp(&away(b, p)))
            })
            .collect();
        let variances = located.geometry.variances_given(&measured);
        Some((located.sites.clone(), variances))
    }
}

/// Takes the feasible sites for the reduction.
///
/// # Errors
/// [`DesignError`] where less is feasible than is asked for, for too few touches, and where no signal varies.
pub fn reduce_sites(
    inputs: &Inputs,
    simulated: &Simulated,
    feasibility: &Feasibility,
    budget: &Budget,
) -> Result<ReducedSites, DesignError> {
    let feasible = feasibility.sites();
    let sensors = inputs.project.selection.sensors;
    if sensors.max(1) > feasible.len() {
        return Err(shortage(inputs, simulated, feasibility, sensors).into());
    }
    enough_touches(inputs, simulated, budget)?;
    let x = simulated.dataset.x.select_rows(&feasible);
    if Standardizer::of(&x).deviation.iter().all(|d| *d <= 0.0) {
        return Err(PlacementError::from(PcaError::Constant).into());
    }
    Ok(ReducedSites {
        feasible,
        x,
        asked: ReductionRequest {
            reduction: inputs.project.reduction(),
            limit: budget.candidates.max(sensors),
            sensors,
            components: budget.selection_candidates.max(sensors),
        },
        components: OnceLock::new(),
        candidates: OnceLock::new(),
        geometry: OnceLock::new(),
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
    reduced: &ReducedSites,
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
        let x = noisy_signals(inputs, reduced).select_rows(&rows);
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

/// The signals of the feasible sites that selectors choose from, with noise where that is asked for.
pub(super) fn noisy_signals<'a>(
    inputs: &Inputs,
    reduced: &'a ReducedSites,
) -> Cow<'a, SignalMatrix> {
    let project = &inputs.project;
    let noise = if project.selection.with_noise && project.gauge.signal == Signal::Strain {
        project.uncertainty().of_channel()
    } else {
        0.0
    };
    let seed = project.budget.seed.wrapping_add(SELECTION_NOISE_SEED);
    evaluation::add_noise(&reduced.x, noise, seed)
}
