//! One judge for many designs: a model finer than any of theirs, built once, and touches that are nobody's.

use std::sync::Arc;

use glam::DVec3;

use super::judge::{errors_mm, judge, measured_by, noisy};
use super::known;
use super::layout::{lay_out_sites, touches_on};
use super::sense::{POINT, drawn_on, gauge_at, map_size};
use super::{Design, DesignError, Ground, Inputs, Laid, Simulated, Truth, ground};
use crate::budget::{Budget, Elements, Watch};
use crate::dataset::Signal;
use crate::elasticity::sensitivity::Gauge;
use crate::elasticity::{Model, Touch};
use crate::evaluation::{Candidate, EvaluationRow, mean};
use crate::inference::{Errors, Matching};

/// Touches of its own that it judges by.
pub const JUDGED: usize = 1500;
/// Their seed, apart from those of training and of a design's own tests.
const JUDGE_SEED: u64 = 0x41d6e;
/// Touches that its elements are laid for.
const LAID_FOR: usize = 200;
/// Finer than the finest that a project can ask for by a quality.
const FINEST: Elements = Elements {
    vertices: 12_000,
    most_vertices: 36_000,
    effort: usize::MAX,
    displacement_percent: 0.5,
    strain_percent: 1.0,
    passes: 2,
};

/// The judge.
pub struct Finest {
    laid: Laid,
    model: Box<dyn Model>,
    touches: Vec<Touch>,
}

/// Errors (mm) over the judge's touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    pub mean_mm: f64,
    pub median_mm: f64,
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
        let layout = ground.site_layout(&inputs.part);
        let places: Vec<DVec3> = (lay_out_sites(&layout, project)?.iter())
            .map(|&at| layout.point(at))
            .collect();
        let surface = ground.touch_layout(&inputs.part);
        let sample = touches_on(&surface, inputs, LAID_FOR, project.budget.seed, true)?;
        let laid = ground.build(&sample, &places, &FINEST, watch)?.laid;
        let (laid, model) = ground.truth(&laid, watch)?;
        let surface = ground.touched_surface(&laid);
        let seed = project.budget.seed.wrapping_add(JUDGE_SEED);
        Ok(Self {
            touches: touches_on(&surface, inputs, JUDGED, seed, false)?,
            laid,
            model,
        })
    }

    /// Size of its elements (mm).
    #[must_use]
    pub fn element_mm(&self) -> f64 {
        Ground::element_mm(&self.laid)
    }

    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.model.system().dimension()
    }

    #[must_use]
    pub fn touches(&self) -> usize {
        self.touches.len()
    }

    /// How a design's chosen gauges find the judge's touches with the regression that the design has trained:
    /// nothing is tuned here. A design whose touches press on a face that lies `raised` (m) above the judge's is
    /// asked for places on that face.
    ///
    /// # Errors
    /// [`DesignError`] when the watch asks for a stop.
    pub fn judge(
        &self,
        inputs: &Inputs,
        design: &Design,
        raised: f64,
        watch: Watch,
    ) -> Result<Judged, DesignError> {
        let mut truth = self.truth(inputs, &design.simulated, design.chosen(), watch)?;
        for touch in &mut truth.touches {
            touch.position += touch.normal * raised;
        }
        let set = Candidate {
            selector: design.lead.name().to_owned(),
            rows: rows_of(&truth, design.chosen()),
            hyper: design.chosen_row().and_then(|r| r.hyper),
        };
        let budget = Budget {
            failure_subsets: 0,
            ..design.budget
        };
        let streams: Vec<u64> = truth.sites.iter().map(|&s| s as u64).collect();
        let simulated = &design.simulated;
        let found = judge(inputs, simulated, &truth, &[set], &streams, &budget, watch)?;
        let everywhere = found.rows.first();
        let of = |figure: fn(&EvaluationRow) -> f64| everywhere.map_or(f64::NAN, figure);
        Ok(Judged {
            mean_mm: of(|r| r.error_mm),
            median_mm: of(|r| r.median_mm),
            p95_mm: of(|r| r.p95_mm),
            workshop_mm: of(|r| r.workshop_mm),
        })
    }

    /// As [`Self::judge`], with the design's elastic model matched to each reading ([`matching`]) instead of a
    /// regression.
    ///
    /// # Errors
    /// [`DesignError`] as for the design's simulation.
    pub fn judge_matching(
        &self,
        inputs: &Inputs,
        design: &Design,
        matching: &Matching,
        watch: Watch,
    ) -> Result<Judged, DesignError> {
        let truth = self.truth(inputs, &design.simulated, design.chosen(), watch)?;
        let streams: Vec<u64> = truth.sites.iter().map(|&s| s as u64).collect();
        let [x, workshop] =
            [(&truth.x, 2), (&truth.workshop, 3)].map(|(x, draw)| noisy(inputs, x, draw, &streams));
        let mut errors = errors_mm(matching, &x, &self.touches);
        let built = errors_mm(matching, &workshop, &self.touches);
        let (mean_mm, workshop_mm) = (mean(&errors), mean(&built));
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[(share * (errors.len() - 1) as f64).round() as usize];
        Ok(Judged {
            mean_mm,
            median_mm: at(0.5),
            p95_mm: at(0.95),
            workshop_mm,
        })
    }

    fn truth(
        &self,
        inputs: &Inputs,
        simulated: &Simulated,
        sites: &[usize],
        watch: Watch,
    ) -> Result<Truth, DesignError> {
        let touches = self.touches.clone();
        let truth = measured_by(&*self.model, inputs, simulated, sites, touches, None, watch)?;
        Ok(Truth {
            element_mm: self.element_mm(),
            ..truth
        })
    }
}

/// The rows of a truth that some sites have.
fn rows_of(truth: &Truth, sites: &[usize]) -> Vec<usize> {
    let row = |s: &usize| truth.sites.binary_search(s).ok();
    sites.iter().filter_map(row).collect()
}

/// A design's elastic model, ready to be matched to what its chosen gauges read, in the order of their numbers in
/// the dataset. Gauges here read at a point, as those of a design do, and may be glued as far off as the project says.
///
/// # Errors
/// [`DesignError`] as for the design's simulation.
pub fn matching(inputs: &Inputs, design: &Design, watch: Watch) -> Result<Matching, DesignError> {
    let project = &inputs.project;
    debug_assert_eq!(project.gauge.signal, Signal::Strain);
    let simulated = &design.simulated;
    let model = simulated.model()?;
    let mut sites = design.chosen().to_vec();
    sites.sort_unstable();
    let gauges: Vec<Gauge> = (sites.iter())
        .map(|&s| gauge_at(&simulated.dataset.sites[s], POINT))
        .collect();
    let off = known::off(project, simulated);
    let (force, tip) = project.tip();
    let mesh = simulated.ground.of_size(map_size(&simulated.ground, tip));
    let drawn = drawn_on(&*model, &gauges, &mesh, (tip, off.tip), watch)?;
    let errors = Errors::known(&off, gauges.len(), Some(Arc::new(drawn.spread(&off))));
    let hardest = project.live.largest_force_n.max(2.0 * force);
    Ok(Matching::new(drawn.map, errors, hardest))
}
