//! The whole road, stage by stage: simulate, filter, reduce, select, evaluate.
//!
//! Each stage is a pure function of the ones before it, so that a caller can keep what has not changed.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::budget::{Achieved, Budget, Cancelled, Quality, StopReason, Watch, Work};
use crate::dataset::{self, Dataset, Signal, SignalMatrix, Site};
use crate::elasticity::estimate::Discretization;
use crate::elasticity::grade::{Graded, Ground};
use crate::elasticity::linearity::Linearity;
use crate::elasticity::load::Touch;
use crate::elasticity::model::{check_held, check_section};
use crate::elasticity::support::supported_vertices;
use crate::elasticity::{ElasticError, Freedoms, ShellModel};
use crate::evaluation::{self, Candidate, Evaluation, Region, Trial};
use crate::feasible::{Feasibility, FeasibleInput, feasible};
use crate::gaussian_process::{self, Covariance, Distances, GpKernel};
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::remesh::Remeshed;
use crate::mesh::unroll::Unrolling;
use crate::mesh::{SurfacePoint, TriMesh, geodesic, sample, scatter};
use crate::pca::Pca;
use crate::placement::candidates::{Candidates, reduce};
use crate::placement::entropy::Entropy;
use crate::placement::greedy_svr::{self, GreedySvr};
use crate::placement::information::Geometry;
use crate::placement::mutual_information::MutualInformation;
use crate::placement::{
    PlacementError, Pool, Request, Selection, Selector, SelectorKind, Wishes, pca_qr,
};
use crate::project::{BadValue, CostKeys, Elements, Lattice, Masks, Project};
use crate::regression::folds::evenly;
use crate::regression::tune::Effort;

/// Why a stage ended without a result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    #[error(transparent)]
    Value(#[from] BadValue),
    #[error(transparent)]
    Elastic(#[from] ElasticError),
    #[error(transparent)]
    Placement(#[from] PlacementError),
    #[error(
        "no touch lands on the part: lower touch.edge_margin_mm ({margin_mm} mm) or check the unit of the mesh (the part is {size_mm:.3} mm across)"
    )]
    NoTouches { margin_mm: f64, size_mm: f64 },
    #[error(
        "{count} sites at a spacing of {spacing_mm} mm are more than the {limit} this version handles: widen sites.spacing_mm or check the unit of the mesh (the part is {size_mm:.0} mm across)"
    )]
    TooManySites {
        count: usize,
        limit: usize,
        spacing_mm: f64,
        size_mm: f64,
    },
    #[error(
        "{what} {number} lies {distance_mm:.0} mm from the part, which is {size_mm:.0} mm across: check the unit of the mesh and of the points (mm)"
    )]
    OffThePart {
        what: &'static str,
        number: usize,
        distance_mm: f64,
        size_mm: f64,
    },
    #[error(
        "the direction of site {number} points out of the surface: a gauge lies in it, give dx, dy, dz along it"
    )]
    AcrossTheWall { number: usize },
    #[error(
        "the part is {size_mm:.3} mm across and its wall {thickness_mm:.3} mm thick: this is no shell. Check the unit of the mesh and part.thickness_mm"
    )]
    ThickerThanWide { size_mm: f64, thickness_mm: f64 },
    #[error(
        "no site fits on the part: lower sites.spacing_mm or check the unit of the mesh (the part is {size_mm:.3} mm across)"
    )]
    NoRoom { size_mm: f64 },
    #[error(
        "{needed_gb:.1} GB would be needed for {sites} sites × {touches} touches, more than the {limit_gb:.0} GB this version allows: lower touch.count or widen sites.spacing_mm"
    )]
    TooLarge {
        needed_gb: f64,
        limit_gb: f64,
        sites: usize,
        touches: usize,
    },
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl DesignError {
    /// Whether somebody asked for the stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Cancelled(_)
                | Self::Elastic(ElasticError::Cancelled(_))
                | Self::Placement(
                    PlacementError::Cancelled(_)
                        | PlacementError::Signals(crate::pca::PcaError::Cancelled(_))
                )
        )
    }
}

/// Below this neither folds nor held-out touches mean anything.
const LEAST_TOUCHES: usize = 20;
const MOST_SITES: usize = 50_000;
const MOST_GB: f64 = 8.0;
/// Vertices of the mesh that sites and touches are laid out on: the same for every quality.
pub const LAYOUT: usize = 3500;
/// Seeds of the independent draws, apart from each other.
const TEST_SEED: u64 = 0x7e57;
const NOISE_SEED: u64 = 0x0153;
const HEARD_SEED: u64 = 0x4ea8d;
const WORKSHOP_SEED: u64 = 0x30b0;

/// What a design starts from.
#[derive(Clone)]
pub struct Inputs {
    pub project: Project,
    pub part: Arc<TriMesh>,
    /// One value a vertex of the part; absent when nothing was painted.
    pub painted: Option<Arc<Vec<bool>>>,
    /// Masks of the part's vertices that supports may name.
    pub masks: Masks,
}

/// The elastic stage: the mesh that was computed on, the sites on it and the dataset.
pub struct Simulated {
    pub mesh: Arc<TriMesh>,
    /// What it was laid on, and where.
    ground: Ground,
    laid: Remeshed,
    /// What is held at its vertices.
    pub held: Vec<Freedoms>,
    /// Where the vertices of the part that is shown lie on it.
    pub carried: Vec<SurfacePoint>,
    pub discretization: Discretization,
    pub points: Vec<SurfacePoint>,
    pub dataset: Dataset,
    pub unknowns: usize,
    pub linearity: Linearity,
    pub checks: Checks,
    pub achieved: Achieved,
}

impl Simulated {
    /// The model, built anew: it is large and nobody keeps it.
    ///
    /// # Errors
    /// [`DesignError`] as when it was built first.
    pub fn model(&self) -> Result<ShellModel, DesignError> {
        Ok(self.ground.model(&self.laid, &crate::budget::unwatched)?)
    }
}

/// Lays out sites and touches and simulates them.
///
/// # Errors
/// [`DesignError`] for values out of range and for parts that cannot be computed.
pub fn simulate(inputs: &Inputs, budget: &Budget, watch: Watch) -> Result<Simulated, DesignError> {
    let project = &inputs.project;
    project.check()?;
    let ground = ground(inputs)?;
    let layout = layout(inputs, &ground);
    // First what cannot be computed at all: a part that nothing holds is the likeliest mistake.
    check_section(&project.section())?;
    check_held(&ground.held.mesh, &ground.held.held)?;
    let sites = lay_out_sites(&layout, project)?;
    check_memory(sites.len(), project.touch.count.min(budget.touches))?;
    let touches = lay_out_touches(&layout, project, budget)?;
    let places: Vec<DVec3> = sites.iter().map(|&at| layout.point(at)).collect();
    let graded = ground.grade(&touches, &places, &budget.elements, watch)?;
    let checks = Checks::of(&graded);
    let Graded {
        laid,
        held,
        model,
        estimate,
        linearity,
        models,
        solves,
        ..
    } = graded;
    let points: Vec<SurfacePoint> = places.iter().map(|&p| model.index.nearest(p).0).collect();
    let unknowns = model.unknowns();
    let gauge = &project.gauge;
    let (signal, directions) = (gauge.signal, gauge.directions);
    let mut dataset = dataset::simulate(&model, touches, &points, signal, directions, watch)?;
    dataset.work.assemblies += models - 1;
    dataset.work.factorizations += models - 1;
    dataset.work.solves += solves;
    let mut notes = if dataset.touches.len() < project.touch.count {
        vec![format!(
            "{} touches instead of the project's {}: the budget of this quality.",
            dataset.touches.len(),
            project.touch.count
        )]
    } else {
        Vec::new()
    };
    notes.extend(checks.distrust());
    notes.extend(cautions(&estimate, &linearity, &budget.elements));
    notes.extend(ground.cautions(project.tip().1));
    let carried = carry(&model, &inputs.part);
    drop(model);
    Ok(Simulated {
        achieved: Achieved {
            error_estimate: Some(estimate.strain_percent),
            unit: "% of a load's largest strain",
            effort: dataset.work,
            stop_reason: if estimate.meets(&budget.elements) {
                StopReason::Converged
            } else {
                StopReason::EffortSpent
            },
            notes,
        },
        mesh: Arc::clone(&laid.mesh),
        ground,
        laid,
        held,
        carried,
        discretization: estimate,
        points,
        dataset,
        unknowns,
        linearity,
        checks,
    })
}

/// What the solution was checked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Checks {
    /// Worst over the sample of the loads: |sum of reactions + load| over the load, and
    /// |½ u·f - strain energy| over the energy.
    pub reaction_error: f64,
    pub energy_error: f64,
    /// Of the stiffness scaled to a unit diagonal; one over it bounds the condition from below.
    pub smallest_pivot: f64,
    /// Connected pieces of the model, each of them held against all six rigid motions.
    pub pieces_held: usize,
}

impl Checks {
    #[must_use]
    pub fn of(graded: &Graded) -> Self {
        Self {
            reaction_error: graded.balance.reaction_error,
            energy_error: graded.balance.energy_error,
            smallest_pivot: graded.model.smallest_pivot(),
            pieces_held: graded.model.pieces(),
        }
    }

    /// What makes the solution untrustworthy, in plain words.
    #[must_use]
    pub fn distrust(&self) -> Vec<String> {
        /// Beyond these, fewer than about five digits of a displacement can be right.
        const BALANCE: f64 = 1e-5;
        const PIVOT: f64 = 1e-11;
        let mut notes = Vec::new();
        let worst = self.reaction_error.max(self.energy_error);
        if worst.is_nan() || worst > BALANCE {
            notes.push(format!(
                "The solution is out of balance by {worst:.0e} of the load: do not trust it. Check thickness, unit and supports."
            ));
        }
        if self.smallest_pivot < PIVOT {
            notes.push(format!(
                "The model is nearly singular (smallest scaled pivot {:.0e}): the shell is very thin for its elements or barely held.",
                self.smallest_pivot
            ));
        }
        notes
    }
}

/// What the estimates of the model's own error ask to be said.
#[must_use]
pub fn cautions(
    discretization: &Discretization,
    linearity: &Linearity,
    aim: &crate::budget::Elements,
) -> Vec<String> {
    /// Beyond this change a linear answer is the wrong kind of answer (%).
    const NONLINEAR: f64 = 10.0;
    let mut notes = Vec::new();
    if discretization.strain_percent.is_nan() {
        notes.push(
            "No gauge lies farther than two tip radii from a touch: the mesh's error in strain could not be judged.".into(),
        );
    }
    if !discretization.meets(aim) {
        notes.push(format!(
            "The mesh leaves about {:.1} % error in displacement (asked: {:.0} %) and {:.1} % in strain (asked: {:.0} %): {}.",
            discretization.displacement_percent,
            aim.displacement_percent,
            discretization.strain_percent,
            aim.strain_percent,
            if *aim == Quality::Reference.budget().elements {
                "more vertices than this quality allows for so many touches would be needed"
            } else {
                "choose a higher quality, fewer touches, or part.elements = \"graded\""
            }
        ));
    }
    if linearity.beyond > 0 {
        notes.push(format!(
            "At {:.1} N the shell may snap or fold under {} of {} sampled touches: the linear answer says nothing there. Lower the force.",
            linearity.force_n, linearity.beyond, linearity.loads
        ));
    }
    if linearity.largest_percent.abs() > NONLINEAR {
        notes.push(format!(
            "At {:.1} N large displacements would change the answer by up to {:.0} % (half of the touches: less than {:.0} %): the model is linear.",
            linearity.force_n,
            linearity.largest_percent.abs(),
            linearity.median_percent
        ));
    }
    notes
}

/// The part with its supports, ready to have elements laid on it.
///
/// # Errors
/// [`DesignError`] for supports without a region.
pub fn ground(inputs: &Inputs) -> Result<Ground, DesignError> {
    let project = &inputs.project;
    if project.part.thickness_mm > size_mm(&inputs.part) {
        return Err(DesignError::ThickerThanWide {
            size_mm: size_mm(&inputs.part),
            thickness_mm: project.part.thickness_mm,
        });
    }
    let supports = project.supports(&inputs.masks)?;
    let as_given = project.part.elements == Elements::AsGiven;
    Ok(Ground::new(
        &inputs.part,
        project.section(),
        &supports,
        as_given,
    ))
}

/// The mesh that sites and touches are laid out on, the same for every quality: the part, or where its
/// triangles are too thin to measure distances on, even ones on its surface.
fn layout(inputs: &Inputs, ground: &Ground) -> Arc<TriMesh> {
    /// Height over length of a triangle, and the share of the area that may be thinner.
    const THIN: f64 = 0.1;
    const SHARE: f64 = 0.02;
    let part = &inputs.part;
    let thin: f64 = (0..part.triangles().len() as u32)
        .filter(|&t| part.thinness(t) < THIN)
        .map(|t| part.facet_area(t))
        .sum();
    if thin < SHARE * part.area() {
        Arc::clone(part)
    } else {
        ground.even(LAYOUT).mesh
    }
}

/// Where the vertices of the part that is shown lie on the mesh that was computed on.
#[must_use]
pub fn carry(model: &ShellModel, part: &TriMesh) -> Vec<SurfacePoint> {
    let nearest = |&p: &DVec3| model.index.nearest(p).0;
    part.positions().iter().map(nearest).collect()
}

fn size_mm(mesh: &TriMesh) -> f64 {
    let (lower, upper) = mesh.bounds();
    (upper - lower).length() * 1000.0
}

/// The sites of a project on a mesh.
///
/// # Errors
/// [`DesignError`] where there would be none or far too many.
pub fn lay_out_sites(mesh: &TriMesh, project: &Project) -> Result<Vec<SurfacePoint>, DesignError> {
    let spacing = project.sites.spacing_mm * 1e-3;
    let estimate = mesh.area() / (spacing * spacing);
    let directions = project.gauge.directions;
    if estimate * directions as f64 > MOST_SITES as f64 {
        return Err(DesignError::TooManySites {
            count: estimate as usize * directions,
            limit: MOST_SITES,
            spacing_mm: project.sites.spacing_mm,
            size_mm: size_mm(mesh),
        });
    }
    let points = match project.sites.lattice {
        Lattice::Even => sample::even(mesh, estimate.round() as usize, project.budget.seed, |_| {
            true
        }),
        Lattice::Unrolled => {
            Unrolling::of(mesh, project.part.axis).lattice(&SurfaceIndex::new(mesh), spacing)
        }
    };
    if points.is_empty() {
        return Err(DesignError::NoRoom {
            size_mm: size_mm(mesh),
        });
    }
    // A place with several directions is as many sites.
    Ok(points
        .into_iter()
        .flat_map(|at| std::iter::repeat_n(at, directions))
        .collect())
}

fn lay_out_touches(
    mesh: &TriMesh,
    project: &Project,
    budget: &Budget,
) -> Result<Vec<Touch>, DesignError> {
    let count = project.touch.count.min(budget.touches);
    touches_on(mesh, project, count, project.budget.seed, true)
}

fn touches_on(
    mesh: &TriMesh,
    project: &Project,
    count: usize,
    seed: u64,
    even: bool,
) -> Result<Vec<Touch>, DesignError> {
    let margin = project.touch.edge_margin_mm * 1e-3;
    let touches = dataset::spread_touches(mesh, count, seed, margin, even, project.tip());
    if touches.is_empty() {
        return Err(DesignError::NoTouches {
            margin_mm: project.touch.edge_margin_mm,
            size_mm: size_mm(mesh),
        });
    }
    Ok(touches)
}

fn check_memory(sites: usize, touches: usize) -> Result<(), DesignError> {
    // The signal itself beside three strain components a site and touch; then the kernel of the
    // evaluation and its distances, on every thread.
    let kernels = 2 * touches * touches * rayon::current_num_threads();
    check_room(4 * sites, touches)?;
    check_room(kernels.div_ceil(touches.max(1)), touches).map_err(|error| match error {
        DesignError::TooLarge {
            needed_gb,
            limit_gb,
            touches,
            ..
        } => DesignError::TooLarge {
            needed_gb,
            limit_gb,
            sites,
            touches,
        },
        other => other,
    })
}

/// What a simulation will hold at its largest: about how many sites, how many touches, and the memory of
/// its strains and signals (GB), known before anything is allocated.
#[must_use]
pub fn expected_size(inputs: &Inputs, budget: &Budget) -> (usize, usize, f64) {
    let spacing = inputs.project.sites.spacing_mm * 1e-3;
    let places = (inputs.part.area() / (spacing * spacing)).round() as usize;
    let sites = places * inputs.project.gauge.directions;
    let touches = inputs.project.touch.count.min(budget.touches);
    let bytes = 4.0 * sites as f64 * touches as f64 * size_of::<f64>() as f64;
    (sites, touches, bytes / 1e9)
}

/// Refuses a dense result of `rows` × `columns` that cannot be held, before it is allocated.
///
/// # Errors
/// [`DesignError::TooLarge`].
pub fn check_room(rows: usize, columns: usize) -> Result<(), DesignError> {
    let needed_gb = rows as f64 * columns as f64 * size_of::<f64>() as f64 / 1e9;
    if needed_gb > MOST_GB {
        return Err(DesignError::TooLarge {
            needed_gb,
            limit_gb: MOST_GB,
            sites: rows / 4,
            touches: columns,
        });
    }
    Ok(())
}

/// Filters the sites.
#[must_use]
pub fn filter(inputs: &Inputs, simulated: &Simulated) -> Feasibility {
    let mesh = &simulated.mesh;
    let painted = inputs
        .painted
        .as_ref()
        .map(|mask| painted_sites(&inputs.part, mask, &simulated.dataset));
    feasible(
        &FeasibleInput {
            mesh,
            index: &SurfaceIndex::new(mesh),
            supported: &supported_vertices(&simulated.held),
            points: &simulated.points,
            sites: &simulated.dataset.sites,
            painted: painted.as_deref(),
        },
        &inputs.project.feasible_rules(),
    )
}

/// Whether each site lies where the mask (one value a vertex of the part) is mostly set.
fn painted_sites(part: &TriMesh, mask: &[bool], dataset: &Dataset) -> Vec<bool> {
    let index = SurfaceIndex::new(part);
    let values: Vec<f64> = mask.iter().map(|&m| f64::from(u8::from(m))).collect();
    dataset
        .sites
        .iter()
        .map(|site| part.interpolate(&values, index.nearest(site.position).0) >= 0.5)
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
    geometry: OnceLock<(Geometry, Vec<usize>)>,
    /// Candidates as numbered in the dataset, in the order of the pivots.
    pub sites: Vec<usize>,
}

impl Reduced {
    /// The Gaussian process, where a selector asked for it.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.geometry.get().map(|g| &g.0)
    }
}

/// Reduces the feasible sites to candidates.
///
/// # Errors
/// [`DesignError`] where nothing is feasible.
pub fn reduce_sites(
    inputs: &Inputs,
    simulated: &Simulated,
    feasibility: &Feasibility,
    budget: &Budget,
    watch: Watch,
) -> Result<Reduced, DesignError> {
    let feasible = feasibility.sites();
    let sensors = inputs.project.selection.sensors;
    if feasible.is_empty() {
        return Err(PlacementError::NoSites.into());
    }
    if sensors > feasible.len() {
        return Err(PlacementError::TooFewSites {
            wanted: sensors,
            available: feasible.len(),
        }
        .into());
    }
    let touches = simulated.dataset.touches.len();
    if touches < LEAST_TOUCHES {
        return Err(PlacementError::TooFewTouches {
            touches,
            least: LEAST_TOUCHES,
        }
        .into());
    }
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

/// The Gaussian process over the feasible sites (first) and all others, and how many of the feasible
/// ones it knows: rows of the reduced signals.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn geometry(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    budget: &Budget,
    watch: Watch,
) -> Result<(Geometry, Vec<usize>), Cancelled> {
    /// Locations nearer than this are one (m).
    const SAME: f64 = 1e-6;
    let mut feasible = vec![false; simulated.points.len()];
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
    Ok((geometry, rows))
}

/// What is asked of a selector beside the count: the project's wishes, by places in a pool of sites.
fn wishes(inputs: &Inputs, positions: &[DVec3]) -> Result<Wishes, DesignError> {
    let keys = &inputs.project.selection;
    let nearest = |at: &[f64; 3]| {
        let at = DVec3::from_array(*at) / 1000.0;
        (0..positions.len())
            .min_by(|&a, &b| {
                (positions[a].distance_squared(at)).total_cmp(&positions[b].distance_squared(at))
            })
            .ok_or(PlacementError::NoSites)
    };
    let required: Result<Vec<usize>, PlacementError> =
        keys.required_mm.iter().map(nearest).collect();
    Ok(Wishes {
        sensors: keys.sensors,
        required: required?,
        spacing: keys.spacing_mm / 1000.0,
        costs: (!keys.costs.is_empty()).then(|| costs(&keys.costs, positions)),
        budget: keys.cost_budget,
        target_mm: keys.target_mm,
        failure: keys.failure,
    })
}

/// What a gauge costs at each position (m).
fn costs(boxes: &[CostKeys], positions: &[DVec3]) -> Vec<f64> {
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
    let targets = simulated.dataset.targets_mm();
    let positions = |sites: &[usize]| -> Vec<DVec3> {
        sites
            .iter()
            .map(|&s| simulated.dataset.sites[s].position)
            .collect()
    };
    if kind == SelectorKind::GreedySvr {
        return select_by_svr(inputs, simulated, reduced, budget, watch);
    }
    let places = positions(&reduced.feasible);
    let x = heard(inputs, reduced);
    let pool = Pool {
        x: &x,
        targets: &targets,
        sites: &reduced.feasible,
        positions: &places,
    };
    let wishes = wishes(inputs, &places)?;
    let request = Request {
        wishes: &wishes,
        watch,
        found: &|_| (),
    };
    if kind == SelectorKind::PcaQr && inputs.project.selection.with_noise {
        return Ok(pca_qr::PcaQr.select(&pool, &request)?);
    }
    if kind == SelectorKind::PcaQr {
        return Ok(pca_qr::from_components(&reduced.pca, &pool, &request)?);
    }
    let (geometry, rows) = if let Some(known) = reduced.geometry.get() {
        known
    } else {
        let made = geometry(inputs, simulated, reduced, budget, watch)?;
        reduced.geometry.get_or_init(|| made)
    };
    let x = reduced.x.select_rows(rows);
    let known: Vec<usize> = rows.iter().map(|&r| reduced.feasible[r]).collect();
    let places = positions(&known);
    let wishes = self::wishes(inputs, &places)?;
    let pool = Pool {
        x: &x,
        targets: &targets,
        sites: &known,
        positions: &places,
    };
    let request = Request {
        wishes: &wishes,
        ..request
    };
    let mut selection = if kind == SelectorKind::Entropy {
        Entropy { geometry }.select(&pool, &request)?
    } else {
        MutualInformation { geometry }.select(&pool, &request)?
    };
    if known.len() < reduced.feasible.len() {
        selection.achieved.notes.push(format!(
            "Chosen from {} of {} feasible sites, evenly taken.",
            known.len(),
            reduced.feasible.len()
        ));
    }
    Ok(selection)
}

fn select_by_svr(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    budget: &Budget,
    watch: Watch,
) -> Result<Selection, DesignError> {
    let all = simulated.dataset.targets_mm();
    let sensors = inputs.project.selection.sensors;
    let limit = budget.selection_candidates.max(sensors);
    let rows = if reduced.sites.len() > limit {
        reduced.pca.pivots(limit)
    } else {
        reduced.candidates.rows.clone()
    };
    let sites: Vec<usize> = rows.iter().map(|&r| reduced.feasible[r]).collect();
    let touches = evenly(all.len(), budget.selection_touches);
    let heard = heard(inputs, reduced);
    let x = heard.select_rows(&rows).select_columns(&touches);
    let targets: Vec<[f64; 3]> = touches.iter().map(|&t| all[t]).collect();
    let positions: Vec<DVec3> = sites
        .iter()
        .map(|&s| simulated.dataset.sites[s].position)
        .collect();
    let pool = Pool {
        x: &x,
        targets: &targets,
        sites: &sites,
        positions: &positions,
    };
    let wishes = wishes(inputs, &positions)?;
    let selector = GreedySvr {
        hyper: inputs.project.hyper(),
        folds: budget.folds,
        seed: inputs.project.budget.seed,
        effort: Effort {
            tolerance: budget.svr_tolerance_mm,
            max_steps: budget.svr_steps,
        },
        tolerance: greedy_svr::TOLERANCE,
        landmarks: 1.0,
    };
    let request = Request {
        wishes: &wishes,
        watch,
        found: &|_| (),
    };
    let mut selection = selector.select(&pool, &request)?;
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

/// The judge: a model of half the element size, with touches of its own.
pub struct Truth {
    pub touches: Vec<Touch>,
    pub regions: Vec<Region>,
    /// Element size of the truth (mm).
    pub element_mm: f64,
    pub work: Work,
    /// Dataset sites that were measured, rising, and their signals.
    pub sites: Vec<usize>,
    pub x: SignalMatrix,
    /// The same sites as a workshop would build them.
    pub workshop: SignalMatrix,
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
    let project = &inputs.project;
    let laid = simulated.ground.halved(&simulated.laid);
    let mesh = &laid.mesh;
    let seed = project.budget.seed.wrapping_add(TEST_SEED);
    let touches = touches_on(mesh, project, budget.test_touches, seed, false)?;
    let model = simulated.ground.model(&laid, watch)?;
    let mut rows = sites.to_vec();
    rows.sort_unstable();
    rows.dedup();
    // Both kinds of gauges in one measurement: the loads are solved for once.
    let drawn = rows.iter().map(|&s| simulated.dataset.sites[s]);
    let built =
        (rows.iter().zip(drawn.clone())).map(|(&s, site)| as_built(&site, project.budget.seed, s));
    let gauges: Vec<Site> = drawn.clone().chain(built).collect();
    let (signals, solves) =
        dataset::measure(&model, &touches, &gauges, project.gauge.signal, watch)?;
    let half =
        |k: usize| signals.select_rows(&(k * rows.len()..(k + 1) * rows.len()).collect::<Vec<_>>());
    let (x, workshop) = (half(0), half(1));
    let gains = (rows.iter()).map(|&s| workshop_draw(project.budget.seed, s).gain);
    let workshop = workshop.scaled_rows(gains);
    let mut work = model.work();
    work.solves += solves as u64;
    Ok(Truth {
        regions: regions(project, &touches),
        element_mm: mesh.mean_edge() * 1000.0,
        touches,
        work,
        sites: rows,
        x,
        workshop,
    })
}

/// What a workshop does to one gauge: where it is moved to and how far it is turned (radians), and its
/// gain.
struct WorkshopDraw {
    toward: f64,
    turned: f64,
    gain: f64,
}

/// Off by 1 mm in any direction, by 3° either way, and by 3 % either way: the same for a site in whatever
/// set it is.
fn workshop_draw(seed: u64, site: usize) -> WorkshopDraw {
    const TURN: f64 = 3.0 * std::f64::consts::PI / 180.0;
    const GAIN: f64 = 0.03;
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(WORKSHOP_SEED));
    rng.set_stream(site as u64);
    let mut sign = || if rng.random::<bool>() { 1.0 } else { -1.0 };
    let (turned, gain) = (TURN * sign(), 1.0 + GAIN * sign());
    WorkshopDraw {
        toward: std::f64::consts::TAU * rng.random::<f64>(),
        turned,
        gain,
    }
}

fn as_built(site: &Site, seed: u64, number: usize) -> Site {
    const OFF: f64 = 1e-3;
    let draw = workshop_draw(seed, number);
    let across = site.normal.cross(site.direction);
    let along = |angle: f64| site.direction * angle.cos() + across * angle.sin();
    Site {
        position: site.position + along(draw.toward) * OFF,
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

/// Judges selections, with all candidates as the baseline, on the truth.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn evaluate(
    inputs: &Inputs,
    simulated: &Simulated,
    reduced: &Reduced,
    selections: &[Selection],
    truth: &Truth,
    budget: &Budget,
    watch: Watch,
) -> Result<Evaluation, Cancelled> {
    let row_of = |site: &usize| truth.sites.binary_search(site).ok();
    let mut sets = Vec::new();
    for selection in selections {
        for set in &selection.sets {
            sets.push(Candidate {
                selector: selection.selector.name().to_owned(),
                rows: set.sites.iter().filter_map(row_of).collect(),
            });
        }
    }
    sets.push(Candidate {
        selector: "all-candidates".to_owned(),
        rows: reduced.sites.iter().filter_map(row_of).collect(),
    });
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
            seed: inputs.project.budget.seed.wrapping_add(NOISE_SEED),
        },
        &sets,
        budget,
        watch,
    )
}

/// Every site that the evaluation of some selections looks at.
#[must_use]
pub fn sites_to_judge(reduced: &Reduced, selections: &[Selection]) -> Vec<usize> {
    let chosen = selections
        .iter()
        .flat_map(|s| &s.sets)
        .flat_map(|s| &s.sites);
    reduced.sites.iter().chain(chosen).copied().collect()
}

/// Everything a design produced.
pub struct Design {
    pub budget: Budget,
    pub simulated: Arc<Simulated>,
    pub feasibility: Feasibility,
    pub reduced: Reduced,
    /// The project's selector first.
    pub selections: Vec<Selection>,
    pub truth: Truth,
    pub evaluation: Evaluation,
    pub seconds: Vec<StageTime>,
}

/// Seconds by the clock of one stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageTime {
    pub stage: &'static str,
    pub seconds: f64,
}

impl Design {
    /// The chosen set: the project's selector at its number of gauges.
    #[must_use]
    pub fn chosen(&self) -> &[usize] {
        self.selections
            .first()
            .and_then(|s| s.sets.last())
            .map_or(&[], |set| &set.sites)
    }

    /// Errors touch by touch (mm) of a selector's set of so many gauges, beside the truth's touches.
    #[must_use]
    pub fn touch_errors(&self, kind: SelectorKind, sensors: usize) -> Option<&[f64]> {
        let mut sets = (self.selections.iter())
            .flat_map(|s| s.sets.iter().map(|set| (s.selector, set.sites.len())));
        let k = sets.position(|set| set == (kind, sensors))?;
        self.evaluation.errors.get(k).map(Vec::as_slice)
    }

    /// The mean error (mm) around each vertex of a mesh that lies where the part does, for the chosen set.
    #[must_use]
    pub fn error_map(&self, mesh: &TriMesh) -> Option<Vec<f64>> {
        let kind = self.selections.first()?.selector;
        let errors = self.touch_errors(kind, self.chosen().len())?;
        let places: Vec<(DVec3, DVec3)> = (self.truth.touches.iter())
            .map(|t| (t.position, t.normal))
            .collect();
        Some(scatter::to_vertices(mesh, &places, errors))
    }

    /// All counted work.
    #[must_use]
    pub fn work(&self) -> Work {
        let mut work = self.simulated.dataset.work;
        for selection in &self.selections {
            work += selection.achieved.effort;
        }
        work += self.truth.work;
        work += self.evaluation.work;
        work
    }

    /// What the reader of any figure must know.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.simulated.achieved.notes.clone();
        notes.extend(self.reduced.candidates.notes.iter().cloned());
        for selection in &self.selections {
            let title = selection.selector.title();
            notes.extend(
                selection
                    .achieved
                    .notes
                    .iter()
                    .map(|n| format!("{title}: {n}")),
            );
        }
        if self.evaluation.rows.iter().any(|r| !r.converged) {
            notes.push(
                "Some regressions stopped at the effort allowed before they met their tolerance."
                    .into(),
            );
        }
        notes
    }
}

/// Runs the whole road. `clock` gives seconds since any fixed moment: the core has no clock of its own.
///
/// # Errors
/// [`DesignError`] from the stage that could not end.
pub fn run(
    inputs: &Inputs,
    kinds: &[SelectorKind],
    budget: &Budget,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let mut times = Stopwatch::new(clock);
    let simulated = Arc::new(simulate(inputs, budget, watch)?);
    times.lap("simulate");
    let mut design = run_from(inputs, simulated, kinds, budget, clock, watch)?;
    design.seconds.splice(0..0, times.stages);
    Ok(design)
}

/// Runs the road from a simulation that is there already.
///
/// # Errors
/// [`DesignError`] from the stage that could not end.
pub fn run_from(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    kinds: &[SelectorKind],
    budget: &Budget,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<Design, DesignError> {
    let mut times = Stopwatch::new(clock);
    let feasibility = filter(inputs, &simulated);
    times.lap("filter");
    let reduced = reduce_sites(inputs, &simulated, &feasibility, budget, watch)?;
    times.lap("reduce");
    let mut selections = Vec::new();
    for &kind in kinds {
        selections.push(select(inputs, &simulated, &reduced, kind, budget, watch)?);
        times.lap(match kind {
            SelectorKind::GreedySvr => "select greedy-svr",
            SelectorKind::PcaQr => "select pca-qr",
            SelectorKind::Entropy => "select entropy",
            SelectorKind::MutualInformation => "select mutual-information",
        });
    }
    let judged = sites_to_judge(&reduced, &selections);
    let truth = truth(inputs, &simulated, &judged, budget, watch)?;
    times.lap("truth");
    let evaluation = evaluate(
        inputs,
        &simulated,
        &reduced,
        &selections,
        &truth,
        budget,
        watch,
    )?;
    times.lap("evaluate");
    Ok(Design {
        budget: *budget,
        simulated,
        feasibility,
        reduced,
        selections,
        truth,
        evaluation,
        seconds: times.stages,
    })
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
