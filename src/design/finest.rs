//! One judge for many designs: a model finer than any of theirs, built once, and touches that are nobody's.

use glam::DVec3;

use super::judge::{JudgedOn, Tried, measured_by};
use super::layout::{lay_out_sites, touches_on};
use super::{Design, DesignError, Inputs, Meshed, Reference, Simulated, ground};
use crate::budget::{Budget, ElementBudget, Watch};
use crate::elasticity::estimate::AccuracyTarget;
use crate::elasticity::{Model, Touch};
use crate::evaluation::{Candidate, EvaluationRow, Judging};

/// Touches of its own that it judges by.
pub const JUDGED: usize = 1500;
/// Their seed, apart from those of training and of a design's own tests.
const JUDGE_SEED: u64 = 0x41d6e;
/// Touches that its elements are graded for.
const GRADED_FOR: usize = 200;
/// Finer than the finest that a project can ask for by a quality.
const FINEST: ElementBudget = ElementBudget {
    vertices: 12_000,
    most_vertices: 36_000,
    effort: usize::MAX,
    displacement_percent: 0.5,
    strain_percent: 1.0,
    passes: 2,
};

/// The judge.
pub struct Finest {
    meshed: Meshed,
    model: Box<dyn Model>,
    touches: Vec<Touch>,
}

/// Errors (mm) over the judge's touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgedErrors {
    /// Mean (mm).
    pub mean_mm: f64,
    /// Median (mm).
    pub median_mm: f64,
    /// 95th percentile (mm).
    pub p95_mm: f64,
    /// Mean as a workshop would build it.
    pub workshop_mm: f64,
}

impl Finest {
    /// Lays the finest elements and presses on them. Neither signal nor selection matter.
    ///
    /// # Errors
    /// [`DesignError`] as for a simulation.
    pub fn new(inputs: &Inputs, watch: Watch) -> Result<Self, DesignError> {
        let project = &inputs.project;
        project.check()?;
        let ground = ground(inputs, watch)?;
        ground.check(project)?;
        let layout = ground.site_layout();
        let places: Vec<DVec3> = (lay_out_sites(&layout, inputs)?.iter())
            .map(|&at| layout.point(at))
            .collect();
        let surface = ground.touch_layout();
        let sample = touches_on(
            &surface,
            inputs,
            GRADED_FOR,
            project.budget.seed,
            (true, false),
        )?;
        let coarse = ground
            .build(&AccuracyTarget::new(&sample, &places, &FINEST), watch)?
            .meshed;
        let (meshed, model) = coarse.reference_model(watch)?;
        let surface = meshed.touched_surface();
        let seed = project.budget.seed.wrapping_add(JUDGE_SEED);
        Ok(Self {
            touches: touches_on(&surface, inputs, JUDGED, seed, (false, true))?,
            meshed,
            model,
        })
    }

    /// Size of its elements (mm).
    #[must_use]
    pub fn element_mm(&self) -> f64 {
        self.meshed.element_mm()
    }

    /// Degrees of freedom of the judge's model.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.model.system().dimension()
    }

    /// How many touches it judges on.
    #[must_use]
    pub fn touches(&self) -> usize {
        self.touches.len()
    }

    /// How a design's chosen gauges find the judge's touches by the project's estimator: with the regression that the
    /// design has trained, of which nothing is tuned here, or with its elastic model matched to each reading, at the
    /// force that sets are compared at. A design whose touches press on a face that lies `raised` (m) above the judge's
    /// is asked for places on that face.
    ///
    /// # Errors
    /// [`DesignError`] as for the design's simulation.
    pub fn judge(
        &self,
        inputs: &Inputs,
        design: &Design,
        raised: f64,
        watch: Watch,
    ) -> Result<JudgedErrors, DesignError> {
        let (simulated, chosen) = (&*design.simulated, design.chosen());
        let mut reference = self.reference(inputs, simulated, chosen, watch)?;
        for touch in &mut reference.touches {
            touch.position += touch.normal * raised;
        }
        let sets = [Candidate {
            chooser: design.chosen_by.into(),
            rows: rows_of(&reference, chosen),
            hyper: design.chosen_row().and_then(|r| r.hyper),
        }];
        let budget = Budget {
            failure_subsets: 0,
            ..design.budget
        };
        let streams: Vec<u64> = reference.sites.iter().map(|&s| s as u64).collect();
        let on = JudgedOn {
            inputs,
            simulated,
            reference: &reference,
            streams: &streams,
            budget: &budget,
            watch,
        };
        let found = match &inputs.project.judging().at_middle() {
            Judging::Svr => on.by_regression(&sets)?,
            Judging::Matching(forces) => on.by_matching(forces, &sets)?,
        };
        let everywhere = found.rows.first();
        let of = |figure: fn(&EvaluationRow) -> f64| everywhere.map_or(f64::NAN, figure);
        Ok(JudgedErrors {
            mean_mm: of(|r| r.error_mm),
            median_mm: of(|r| r.median_mm),
            p95_mm: of(|r| r.p95_mm),
            workshop_mm: of(|r| r.workshop_mm),
        })
    }

    fn reference(
        &self,
        inputs: &Inputs,
        simulated: &Simulated,
        sites: &[usize],
        watch: Watch,
    ) -> Result<Reference, DesignError> {
        let tried = Tried {
            touches: self.touches.clone(),
            presses: None,
        };
        let reference = measured_by(&*self.model, inputs, simulated, sites, tried, watch)?;
        Ok(Reference {
            element_mm: self.element_mm(),
            ..reference
        })
    }
}

/// The rows of a reference that some sites have.
fn rows_of(reference: &Reference, sites: &[usize]) -> Vec<usize> {
    let row = |s: &usize| reference.sites.binary_search(s).ok();
    sites.iter().filter_map(row).collect()
}
