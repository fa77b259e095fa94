//! The project's model as live touch needs it: what its chosen gauges read of any touch.

mod kept;

use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::as_built::{as_built, workshop_draw};
use super::drawn::{drawn_on, map_size, proposed};
use super::layout::{lay_out_sites, lay_out_touches, test_touches, touches_on};
use super::nearness::check_on_part;
use super::{Built, DesignError, Ground, Inputs, Meshed, ground};
use crate::budget::{Budget, Cancelled, MAP_TRIANGLES, Watch};
use crate::dataset::SignalMatrix;
use crate::elasticity::estimate::AccuracyTarget;
use crate::elasticity::sensitivity::Sensitivity;
use crate::elasticity::{Model, Touch};
use crate::gauge::Gauge;
use crate::inference::{AsDrawn, Deviations};
use crate::live::GaugeModel;
use crate::mesh::TriMesh;
use crate::project::{ChosenSite, LiveKeys, Project};
use crate::uncertainty::{Gluing, Uncertainty};
use crate::units;

pub use kept::Computed;

/// A model of the chosen gauges, without the stiffness it came from.
pub struct Sensing {
    /// The gauges, a channel each.
    pub gauges: Vec<Gauge>,
    /// Length and width (m) of their grids.
    grid: [f64; 2],
    /// Where the project says that they lie.
    pub sites: Vec<ChosenSite>,
    /// What nodal forces make them read.
    pub sensitivity: Arc<Sensitivity>,
    /// Readings everywhere, as drawn and as they change with the way gauges are glued.
    pub drawn: Arc<AsDrawn>,
    /// What is known to be off.
    pub off: Uncertainty,
    /// What the project's tolerance of gluing, and the way touches are made, put on the readings, while nothing is known of these
    /// gauges.
    pub deviations: Deviations,
    /// Where known touches are best pressed: evenly over the part.
    pub proposed: Vec<Touch>,
    /// Mean edge of the elements (mm).
    pub element_mm: f64,
    /// Rms error of the strain that the elements leave (%).
    strain_percent: f64,
    /// Whether the elements are coarser than they should be, for want of memory.
    is_short: bool,
    budget: Budget,
    /// What was kept has no elements until somebody asks for them.
    meshed: OnceLock<Meshed>,
}

/// Readings of the model under touches of many forces: what the trained estimators learn from.
pub struct SimulatedLesson {
    /// Channels × touches, strain.
    pub x: SignalMatrix,
    /// Where each touch was (mm).
    pub places_mm: Vec<[f64; 3]>,
    /// How hard each was (N).
    pub forces: Vec<f64>,
}

/// What a workshop does to a gauge, for the truth of a simulated board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Workshop {
    /// Glued exactly as drawn.
    Exact,
    /// Gains off by the project's tolerance.
    Gains,
    /// Gains, places and directions off by it.
    #[default]
    All,
}

impl Workshop {
    /// What it leaves of a project's tolerance.
    #[must_use]
    pub fn of(self, gluing: Gluing) -> Gluing {
        match self {
            Self::Exact => Gluing::EXACT,
            Self::Gains => Gluing {
                gain: gluing.gain,
                ..Gluing::EXACT
            },
            Self::All => gluing,
        }
    }
}

/// The model of a project's chosen gauges, on the same elements as a design of the same quality.
///
/// # Errors
/// [`DesignError`] as for a simulation, and where no gauges are chosen.
pub fn sensing(inputs: &Inputs, budget: &Budget, watch: Watch) -> Result<Sensing, DesignError> {
    let gauged = GaugedModel::new(inputs, budget, watch)?;
    let model = &*gauged.built.model;
    let sensitivity = Sensitivity::new(model, &gauged.gauges, gauged.grid, watch)?;
    let drawn = gauged.drawn_on(&gauged.map_mesh, watch)?;
    let proposed = proposed(&drawn.map.mesh, inputs)?;
    let GaugedModel { built, off, .. } = gauged;
    Ok(Sensing {
        sites: inputs.project.selection.sites.clone(),
        gauges: gauged.gauges,
        grid: gauged.grid,
        sensitivity: Arc::new(sensitivity),
        deviations: drawn.deviations(&off),
        off,
        drawn: Arc::new(drawn),
        proposed,
        element_mm: built.meshed.element_mm(),
        strain_percent: built.estimate.strain_percent,
        is_short: built.is_short,
        budget: *budget,
        meshed: OnceLock::from(built.meshed),
    })
}

/// What the chosen gauges read where some places (m) are, as [`sensing`] knows it everywhere: enough to compare presses there with
/// many models of a part.
///
/// # Errors
/// As [`sensing`].
pub fn drawn_at(
    inputs: &Inputs,
    budget: &Budget,
    places: &[DVec3],
    watch: Watch,
) -> Result<AsDrawn, DesignError> {
    let gauged = GaugedModel::new(inputs, budget, watch)?;
    let around = around(&gauged.map_mesh, places);
    Ok(gauged.drawn_on(&around, watch)?)
}

/// Of a mesh the triangles nearest to some places (m), with two rings of those around them. There it has the normals that it has as
/// a whole, also on a neighbour that is as near.
fn around(mesh: &Arc<TriMesh>, places: &[DVec3]) -> Arc<TriMesh> {
    let nearest = places.iter().map(|&place| mesh.index().nearest(place).0);
    let mut kept: HashSet<u32> = nearest.map(|at| at.triangle).collect();
    for _ in 0..2 {
        let corners = (kept.iter()).flat_map(|&t| mesh.triangles()[t as usize]);
        let of_corner = |corner: u32| &mesh.vertex_triangles()[corner as usize];
        kept = corners.flat_map(of_corner).copied().collect();
    }
    let part = mesh.part_of(|t| kept.contains(&t));
    part.map_or_else(|| Arc::clone(mesh), |(part, _)| Arc::new(part))
}

/// A project's chosen gauges on a model of its part, before anything is pressed.
struct GaugedModel {
    built: Built,
    gauges: Vec<Gauge>,
    /// Length and width (m) of their grids.
    grid: [f64; 2],
    /// What readings are known on, where they are known everywhere.
    map_mesh: Arc<TriMesh>,
    tip_radius: f64,
    off: Uncertainty,
}

impl GaugedModel {
    fn new(inputs: &Inputs, budget: &Budget, watch: Watch) -> Result<Self, DesignError> {
        let project = &inputs.project;
        project.check()?;
        if project.selection.sites.is_empty() {
            return Err(DesignError::NoGauges);
        }
        check_chosen(inputs)?;
        let (ground, built) = graded_model(inputs, budget, watch)?;
        let tip_radius = project.tip().1;
        Ok(Self {
            gauges: chosen_gauges(project, &*built.model),
            grid: project.gauge.grid(),
            map_mesh: ground.of_size(map_size(&ground, tip_radius, MAP_TRIANGLES)),
            tip_radius,
            off: (project.uncertainty()).with_elements(built.estimate.strain_percent),
            built,
        })
    }

    /// What the gauges read of presses on a mesh.
    fn drawn_on(&self, mesh: &Arc<TriMesh>, watch: Watch) -> Result<AsDrawn, Cancelled> {
        let gauges = (&self.gauges[..], self.grid);
        let tip = (self.tip_radius, &self.off.making_at_most());
        drawn_on(&*self.built.model, gauges, mesh, tip, watch)
    }
}

/// Refuses chosen gauges ([[selection.site]]) that lie on no surface of the part.
///
/// # Errors
/// [`DesignError::OffThePart`] for the first that does.
pub fn check_chosen(inputs: &Inputs) -> Result<(), DesignError> {
    let sites = inputs.project.selection.sites.iter();
    let places = sites.map(ChosenSite::position);
    check_on_part(&inputs.part, "gauge of [[selection.site]]", places)
}

/// The elements that a design of this project and budget has, with the model on them.
fn graded_model(
    inputs: &Inputs,
    budget: &Budget,
    watch: Watch,
) -> Result<(Ground, Built), DesignError> {
    let ground = ground(inputs, watch)?;
    ground.check(&inputs.project)?;
    let even = ground.site_layout();
    let touches = lay_out_touches(&ground.touch_layout(), inputs, budget)?;
    let sites = lay_out_sites(&even, inputs)?;
    let places: Vec<DVec3> = sites.iter().map(|&at| even.point(at)).collect();
    let target = AccuracyTarget::new(&touches, &places, &budget.elements);
    let built = ground.build(&target, watch)?;
    Ok((ground, built))
}

/// The chosen gauges on the model's own surface.
fn chosen_gauges(project: &Project, model: &dyn Model) -> Vec<Gauge> {
    let on = |site: &ChosenSite| {
        let (at, _) = model.index().nearest(site.position());
        Gauge::on(model.mesh(), at, DVec3::from_array(site.direction))
    };
    project.selection.sites.iter().map(on).collect()
}

impl Sensing {
    /// The truth of a simulated board: finer elements, and gauges as a workshop glues them, with
    /// the gains they ended up with.
    ///
    /// # Errors
    /// [`DesignError`] as for a simulation.
    pub fn reference(
        &self,
        inputs: &Inputs,
        gluing: &Gluing,
        seed: u64,
        watch: Watch,
    ) -> Result<(Sensitivity, Vec<f64>), DesignError> {
        let (_, model) = self.meshed(inputs, watch)?.reference_model(watch)?;
        let gauges: Vec<Gauge> = (self.gauges.iter().enumerate())
            .map(|(k, gauge)| as_built(gauge, gluing, seed, k))
            .collect();
        let gain = |k: usize| workshop_draw(gluing, seed, k).gain;
        let gains = (0..gauges.len()).map(gain).collect();
        Ok((Sensitivity::new(&*model, &gauges, self.grid, watch)?, gains))
    }

    /// The model that the gauges were read on.
    ///
    /// # Errors
    /// [`DesignError`] as for a simulation.
    pub fn model(&self, inputs: &Inputs, watch: Watch) -> Result<Box<dyn Model>, DesignError> {
        self.meshed(inputs, watch)?.model(watch)
    }

    /// The elements, laid anew where the results on them were kept: `inputs` are those that they were laid for.
    fn meshed(&self, inputs: &Inputs, watch: Watch) -> Result<&Meshed, DesignError> {
        if let Some(meshed) = self.meshed.get() {
            return Ok(meshed);
        }
        let (_, built) = graded_model(inputs, &self.budget, watch)?;
        Ok(self.meshed.get_or_init(|| built.meshed))
    }

    /// Evenly spread touches with forces drawn evenly from half a newton to the hardest of the paper's.
    ///
    /// # Errors
    /// [`DesignError`] where no touch lands on the part.
    pub fn lessons(
        &self,
        inputs: &Inputs,
        count: usize,
        seed: u64,
    ) -> Result<SimulatedLesson, DesignError> {
        const FORCES: [f64; 2] = [0.5, 34.3];
        const SEED: u64 = 0x1e55;
        let touches = self.touches(inputs, count, seed.wrapping_add(SEED), true)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(SEED));
        let forces: Vec<f64> = (touches.iter())
            .map(|_| FORCES[0] + (FORCES[1] - FORCES[0]) * rng.random::<f64>())
            .collect();
        let read =
            |(touch, &force): (&Touch, &f64)| self.sensitivity.read(&Touch { force, ..*touch });
        let columns: Vec<Vec<f64>> = touches.par_iter().zip(&forces).map(read).collect();
        let values = (0..self.gauges.len()).flat_map(|c| columns.iter().map(move |x| x[c]));
        Ok(SimulatedLesson {
            x: SignalMatrix::new(touches.len(), values.collect()),
            places_mm: touches
                .iter()
                .map(|t| units::mm(t.position).to_array())
                .collect(),
            forces,
        })
    }

    /// The touches that a design of this quality is judged on.
    ///
    /// # Errors
    /// [`DesignError`] as for a simulation, and where none lands on the part.
    pub fn judged_touches(
        &self,
        inputs: &Inputs,
        budget: &Budget,
        watch: Watch,
    ) -> Result<Vec<Touch>, DesignError> {
        let (meshed, _) = self.meshed(inputs, watch)?.reference_model(watch)?;
        test_touches(&meshed.touched_surface(), inputs, budget.test_touches)
    }

    /// Touches on the part's surface for training, evenly spread, or for tests, at random.
    ///
    /// # Errors
    /// [`DesignError`] where none lands on the part.
    pub fn touches(
        &self,
        inputs: &Inputs,
        count: usize,
        seed: u64,
        even: bool,
    ) -> Result<Vec<Touch>, DesignError> {
        touches_on(&self.drawn.map.mesh, inputs, count, seed, (even, true))
    }
}

impl Sensing {
    /// What gauges read as the project knows them to be glued.
    #[must_use]
    pub fn map_for(&self, live: &LiveKeys) -> GaugeModel {
        let off = Uncertainty {
            stiffness: live.stiffness_percent / 100.0,
            allowed: live.friction_percent / 100.0,
            ..self.off
        };
        let Some(glued) = live.glued(&self.sites) else {
            return GaugeModel {
                map: Arc::clone(&self.drawn.map),
                deviations: Some(self.deviations.clone()),
                off,
            };
        };
        let doubts = live.doubts(&self.sites);
        let deviations = doubts.map(|doubts| self.drawn.deviations_of(&doubts, &off));
        GaugeModel {
            map: Arc::new(self.drawn.glued(&glued)),
            deviations,
            // What known touches have shown says more than what the elements were estimated to leave.
            off: Uncertainty {
                elements: 0.0,
                ..off
            },
        }
    }
}
