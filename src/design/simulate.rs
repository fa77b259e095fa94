//! From a project to the signals of its sites: the elastic model laid, checked and asked.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::ground::{
    Built, Ground, ground, large_motion, open_solid, overlapping_tetrahedra, short_of_memory,
    wide_tip,
};
use super::layout::{check_foreseen, check_memory, lay_out_sites, lay_out_touches};
use super::nearness::{Nearness, check_reach};
use super::on_supports::on_supports;
use super::{DesignError, Inputs, Meshed, SLOPE_TOUCHES};
use crate::budget::{Achieved, Budget, Cancelled, Quality, StopReason, Watch, Work};
use crate::dataset::{self, AskedSignals, Dataset, Surveyed};
use crate::elasticity::estimate::{AccuracyTarget, Discretization};
use crate::elasticity::linearity::Linearity;
use crate::elasticity::{DofSet, Model, Touch};
use crate::feasible::SiteSurroundings;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::plain::digits;
use crate::project::{ElementKind, PartModel, Project};
use crate::regression::folds::evenly;
use crate::units;

/// The elastic stage: the mesh that was computed on, the sites on it and the dataset.
#[derive(Clone)]
pub struct Simulated {
    /// The surface that gauges are glued to: the elements of a shell, the inside of a solid.
    pub mesh: Arc<TriMesh>,
    /// Size of the elements (mm).
    pub element_mm: f64,
    pub(super) meshed: Meshed,
    /// What is held at its vertices.
    pub held: Vec<DofSet>,
    /// Where the vertices of the part that is shown lie on it.
    pub carried: Vec<SurfacePoint>,
    /// How far the model is from converged.
    pub discretization: Discretization,
    /// How far gauges are moved until they read something else (m): see [`dataset::GluingSlopes::length_scale`].
    pub length_scale: f64,
    /// Where the sites lie on the mesh.
    pub points: Vec<SurfacePoint>,
    /// What lies before and behind the sites of a solid.
    pub surroundings: Option<SiteSurroundings>,
    /// The sites of the lattice, and after them gauges that were moved off it.
    pub dataset: Dataset,
    /// How many sites the lattice has.
    pub lattice: usize,
    /// Shared by all that have only other gauges off the lattice.
    mark: Arc<()>,
    /// Degrees of freedom.
    pub unknowns: usize,
    /// Of a shell.
    pub linearity: Option<Linearity>,
    /// What the solution was checked for.
    pub checks: Checks,
    /// Whether memory did not hold as many elements as were asked for.
    pub is_short: bool,
    /// What was reached, and at what effort.
    pub achieved: Achieved,
}

impl Simulated {
    /// The model, built anew: it is large and nobody keeps it.
    ///
    /// # Errors
    /// [`DesignError`] as when it was built first.
    pub fn model(&self) -> Result<Box<dyn Model>, DesignError> {
        self.meshed.model(&crate::budget::unwatched)
    }

    /// Whether two are of one simulation, whatever gauges were moved off its lattice.
    #[must_use]
    pub fn is_one_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mark, &other.mark)
    }

    /// What lies before and behind gauges on points of its mesh; as for its sites.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn surroundings_of(
        &self,
        points: &[SurfacePoint],
        watch: Watch,
    ) -> Result<Option<SiteSurroundings>, Cancelled> {
        let Some(known) = &self.surroundings else {
            return Ok(None);
        };
        let found = Ground::of(&self.meshed).surroundings(points, watch)?;
        // What is closed was opened for all of it.
        let opened = known.room.iter().all(|room| room.is_infinite());
        Ok(found.map(|found| if opened { found.open() } else { found }))
    }

    /// The same with these gauges off its lattice, in place of those that there were. It holds no more at once than the
    /// simulation itself has.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn with_gauges(
        mut self,
        gauges: &[&Surveyed],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let index = self.mesh.index();
        let at = |gauge: &&Surveyed| index.nearest(gauge.site.gauge.position).0;
        let points: Vec<SurfacePoint> = gauges.iter().map(at).collect();
        let around = self.surroundings_of(&points, watch)?;
        self.dataset.truncate(self.lattice);
        for gauge in gauges {
            self.dataset.push(gauge);
        }
        self.points.truncate(self.lattice);
        self.points.extend(points);
        if let (Some(all), Some(around)) = (&mut self.surroundings, around) {
            all.behind.truncate(self.lattice);
            all.behind.extend(around.behind);
            all.room.truncate(self.lattice);
            all.room.extend(around.room);
        }
        Ok(self)
    }
}

/// Lays out sites and touches and simulates them.
///
/// # Errors
/// [`DesignError`] for values out of range and for parts that cannot be computed.
pub fn simulate(inputs: &Inputs, budget: &Budget, watch: Watch) -> Result<Simulated, DesignError> {
    let project = &inputs.project;
    project.check()?;
    let kept_out = project.feasible.keep_out.as_ref();
    Project::mask("feasible.keep_out", kept_out, &inputs.masks)?;
    let ground = ground(inputs, watch)?;
    ground.check(project)?;
    check_required(inputs)?;
    check_foreseen(inputs, budget)?;
    let layout = ground.site_layout();
    let sites = lay_out_sites(&layout, inputs)?;
    let count = project.touch.count.min(budget.touches);
    check_memory(sites.len(), count, project.gauge.signal)?;
    let touches = lay_out_touches(&ground.touch_layout(), inputs, budget)?;
    let places: Vec<DVec3> = sites.iter().map(|&at| layout.point(at)).collect();
    let target = AccuracyTarget::new(&touches, &places, &budget.elements);
    let built = ground.build(&target, watch)?;
    let checks = Checks::of(&built);
    let Built {
        meshed,
        model,
        estimate,
        linearity,
        is_short,
        models,
        solves,
        ..
    } = built;
    let known = JudgedElements {
        meshed,
        estimate,
        linearity,
        checks,
        is_short,
        // The last model is counted with the dataset.
        work: Work {
            assemblies: models - 1,
            factorizations: models - 1,
            solves,
            ..Work::default()
        },
    };
    let reader = SiteReader {
        inputs,
        budget,
        places: &places,
        watch,
    };
    reader.read(known, &*model, touches)
}

/// Refuses gauges that are required farther from the part than it is large.
///
/// # Errors
/// [`DesignError::Value`] naming the key.
pub fn check_required(inputs: &Inputs) -> Result<(), DesignError> {
    let what = "place of selection.required_mm";
    check_reach(&inputs.part, what, inputs.project.selection.required())
}

/// What has to be known of required gauges that are nowhere near the part.
fn required_off(inputs: &Inputs) -> Option<String> {
    /// In spacings of the sites.
    const OFF: f64 = 3.0;
    let most = OFF * inputs.project.sites.spacing();
    let near = Nearness::of(&inputs.part);
    let required = inputs.project.selection.required();
    let distances = required.map(|place| near.distance(place));
    let off: Vec<String> = (distances.enumerate())
        .filter(|&(_, distance)| distance > most)
        .map(|(number, distance)| format!("place {number} by {} mm", digits(units::mm(distance))))
        .collect();
    (!off.is_empty()).then(|| {
        format!(
            "Gauges are required (selection.required_mm, from 0) off the part: {}. The nearest sites are taken.",
            off.join(", ")
        )
    })
}

/// As [`simulate`] where only what gauges report has changed (`gauge.signal`, `gauge.directions`) since `last`: on
/// its elements, which need not be laid and judged again. Gives the same bytes as from the beginning.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_again(
    inputs: &Inputs,
    budget: &Budget,
    last: &Simulated,
    watch: Watch,
) -> Result<Simulated, DesignError> {
    let project = &inputs.project;
    project.check()?;
    let layout = Ground::of(&last.meshed).site_layout();
    let sites = lay_out_sites(&layout, inputs)?;
    check_memory(
        sites.len(),
        last.dataset.touches.len(),
        project.gauge.signal,
    )?;
    let places: Vec<DVec3> = sites.iter().map(|&at| layout.point(at)).collect();
    let known = JudgedElements {
        meshed: last.meshed.clone(),
        estimate: last.discretization,
        linearity: last.linearity,
        checks: last.checks,
        is_short: last.is_short,
        work: Work::default(),
    };
    let model = last.meshed.model(watch)?;
    let touches = last.dataset.touches.clone();
    let reader = SiteReader {
        inputs,
        budget,
        places: &places,
        watch,
    };
    reader.read(known, &*model, touches)
}

/// Elements with what is known of them.
pub(super) struct JudgedElements {
    pub meshed: Meshed,
    pub estimate: Discretization,
    pub linearity: Option<Linearity>,
    pub checks: Checks,
    /// Whether memory did not hold as many as were asked for.
    pub is_short: bool,
    /// What laying and judging them took.
    pub work: Work,
}

/// Reads what sites at some places report.
pub(super) struct SiteReader<'a> {
    pub inputs: &'a Inputs,
    pub budget: &'a Budget,
    /// Where sites are (m).
    pub places: &'a [DVec3],
    pub watch: Watch<'a>,
}

impl SiteReader<'_> {
    /// What the sites report of touches on a model, with everything that its reader must know.
    fn read(
        &self,
        known: JudgedElements,
        model: &dyn Model,
        touches: Vec<Touch>,
    ) -> Result<Simulated, DesignError> {
        let project = &self.inputs.project;
        let points: Vec<SurfacePoint> = (self.places.iter())
            .map(|&p| model.index().nearest(p).0)
            .collect();
        let unknowns = model.system().dimension();
        let asked = AskedSignals {
            signal: project.gauge.signal,
            directions: project.gauge.directions,
            slope_touches: &evenly(touches.len(), SLOPE_TOUCHES),
            making: &project.uncertainty().making_allowed(),
        };
        let mut dataset = dataset::simulate(model, touches, &points, &asked, self.watch)?;
        dataset.work += known.work;
        self.finish(known, (dataset, unknowns))
    }

    /// A simulation of what was read on elements of so many unknowns, with everything that its reader must know.
    pub(super) fn finish(
        &self,
        known: JudgedElements,
        (dataset, unknowns): (Dataset, usize),
    ) -> Result<Simulated, DesignError> {
        let Self {
            inputs,
            budget,
            places,
            watch,
        } = *self;
        let JudgedElements {
            meshed,
            estimate,
            linearity,
            checks,
            is_short,
            ..
        } = known;
        let project = &inputs.project;
        let mut notes = if dataset.touches.len() < project.touch.count {
            vec![format!(
                "{} touches instead of the project's {}: the budget of this quality.",
                dataset.touches.len(),
                project.touch.count
            )]
        } else {
            Vec::new()
        };
        let mut cautious = checks.distrust();
        cautious.extend(cautions(&estimate, linearity.as_ref(), project, budget));
        cautious.extend(meshed.cautions(project.tip().1));
        cautious.extend(large_motion(&inputs.part, &estimate, linearity.as_ref()));
        cautious.extend(wide_tip(&inputs.part, project.tip().1));
        cautious.extend(open_solid(inputs));
        cautious.extend(overlapping_tetrahedra(inputs));
        cautious.extend(required_off(inputs));
        cautious.extend(on_supports(inputs, &dataset.touches)?);
        cautious.extend(short_of_memory(is_short));
        let (mesh, held) = meshed.gauge_surface();
        let index = mesh.index();
        let points: Vec<SurfacePoint> = places.iter().map(|&p| index.nearest(p).0).collect();
        let ground = Ground::of(&meshed);
        let surroundings = ground.surroundings(&points, watch)?;
        notes.extend(ground.left_out(surroundings.as_ref()));
        let surroundings = surroundings.map(SiteSurroundings::opened);
        let carried = carry(&mesh, &inputs.part);
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
                cautions: cautious,
                notes,
            },
            element_mm: meshed.element_mm(),
            mesh,
            meshed,
            held,
            carried,
            discretization: estimate,
            length_scale: (dataset.slopes.as_ref()).map_or(f64::NAN, |slopes| {
                slopes.length_scale(&|site| dataset.x.row(site))
            }),
            points,
            surroundings,
            lattice: dataset.sites.len(),
            mark: Arc::default(),
            dataset,
            unknowns,
            linearity,
            checks,
            is_short,
        })
    }
}

impl Simulated {
    /// How thick the walls of a solid usually are, as measured (m).
    #[must_use]
    pub fn usual_wall(&self) -> Option<f64> {
        Ground::of(&self.meshed).usual_wall()
    }
}

/// What the solution was checked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Checks {
    /// Worst over the sample of the loads: |sum of reactions + load| over the load, and
    /// |½ u·f - strain energy| over the energy.
    pub reaction_error: f64,
    /// |½ u·f - strain energy| over the energy, the worst over the sample of the loads.
    pub energy_error: f64,
    /// Of the stiffness scaled to a unit diagonal; one over it bounds the condition from below.
    pub smallest_pivot: f64,
    /// Connected pieces of the model, each of them held against all six rigid motions.
    pub pieces_held: usize,
}

impl Checks {
    /// The checks of a model as it was built.
    #[must_use]
    pub fn of(built: &Built) -> Self {
        Self {
            reaction_error: built.balance.reaction_error,
            energy_error: built.balance.energy_error,
            smallest_pivot: built.model.system().smallest_pivot(),
            pieces_held: built.model.pieces(),
        }
    }

    /// What makes the solution untrustworthy, in plain words.
    #[must_use]
    pub fn distrust(&self) -> Vec<String> {
        self.doubts().into_iter().map(|d| d.words).collect()
    }
}

/// What the estimates of the model's own error ask to be said.
#[must_use]
pub fn cautions(
    discretization: &Discretization,
    linearity: Option<&Linearity>,
    project: &Project,
    budget: &Budget,
) -> Vec<String> {
    /// Beyond this change a linear answer is the wrong kind of answer (%).
    const NONLINEAR: f64 = 10.0;
    let aim = &budget.elements;
    let mut notes = Vec::new();
    if discretization.strain_percent.is_nan() {
        notes.push(
            "No gauge lies farther than two tip radii from a touch: the mesh's error in strain could not be judged.".into(),
        );
    }
    if discretization.displacement_percent.is_nan() {
        notes.push(
            "The error of the mesh could not be judged: finer elements would be too many.".into(),
        );
    } else if !discretization.meets(aim) {
        notes.push(format!(
            "The mesh leaves about {:.1} % error in displacement (asked: {} %) and {:.1} % in strain (asked: {} %): {}.",
            discretization.displacement_percent,
            digits(aim.displacement_percent),
            discretization.strain_percent,
            digits(aim.strain_percent),
            finer(project, budget)
        ));
    }
    let Some(linearity) = linearity else {
        return notes;
    };
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

/// What makes the error of the elements smaller: whatever it is that bounds their number.
fn finer(project: &Project, budget: &Budget) -> String {
    let part = &project.part;
    if part.model == PartModel::Shell && part.elements == ElementKind::AsGiven {
        return "let elements be laid where they are wanted (part.elements = \"graded\"), or refine the mesh in the program that wrote it".into();
    }
    match project.budget.limits_at(budget.quality).vertices {
        Some(vertices) => format!("raise budget.limits.vertices from {vertices}, or leave it out"),
        None if budget.quality == Quality::Reference => {
            "give fewer touches, or say how many vertices there may be (budget.limits.vertices)".into()
        }
        None => "choose a higher quality or fewer touches, or say how many vertices there may be (budget.limits.vertices)".into(),
    }
}

/// Where the vertices of the part that is shown lie on the mesh that was computed on (`from`).
#[must_use]
pub fn carry(from: &TriMesh, part: &TriMesh) -> Vec<SurfacePoint> {
    let nearest = |&p: &DVec3| from.index().nearest(p).0;
    part.positions().iter().map(nearest).collect()
}
