//! What each result depends on, as plain data: equal inputs give equal results.
//!
//! A document has one part from its beginning to its end, so that none of them names it. Masks are shared: comparing
//! those that nobody has painted on since costs nothing.

use std::sync::Arc;

use super::{Document, Layer};
use crate::budget::{BudgetLimits, Quality};
use crate::dataset::{Signal, Site};
use crate::evaluation::Judging;
use crate::io::trade_file::without_knobs;
use crate::placement::SelectorKind;
use crate::project::{
    CalibrationKeys, CandidateKeys, ChosenSite, EvaluationKeys, FeasibleKeys, GaugeKeys,
    GaussianProcessKeys, MaterialKeys, Part, Project, SelectionKeys, SiteKeys, SupportKeys,
    ToleranceKeys, TouchKeys,
};

/// The vertices of a mask, where there is one.
type Mask = Option<Arc<Vec<bool>>>;

/// The supports, with what the masks they name hold.
type HeldSupports = Vec<(SupportKeys, Mask)>;

/// What the elastic model alone depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelInputs {
    /// Without the path of its mesh: saving under another name changes nothing that was computed.
    part: Part,
    material: MaterialKeys,
    held: HeldSupports,
}

/// What a simulation depends on beside what gauges report: its elements, sites and touches.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementInputs {
    model: ModelInputs,
    /// Without how hard touches come, which is for whoever chooses and judges: signals grow with the force. Of how far
    /// off they are made only whether they are at all: what signals change by is simulated then.
    touch: TouchKeys,
    region: Option<Mask>,
    often: Option<Mask>,
    sites: SiteKeys,
    quality: Quality,
    seed: u64,
    limits: BudgetLimits,
    /// A region that is not there cannot be computed with.
    keep_out_missing: bool,
}

/// How far off gauges are, and touches, and the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Off {
    tolerance: ToleranceKeys,
    drift_microstrain: f64,
    resolution_microstrain: f64,
    tip_tolerance_mm: f64,
    friction_percent: f64,
    allowed_percent: f64,
    model_error: f64,
}

impl Off {
    fn of(project: &Project) -> Self {
        Self {
            tolerance: project.gauge.tolerance,
            drift_microstrain: project.gauge.drift_microstrain,
            resolution_microstrain: project.gauge.resolution_microstrain,
            tip_tolerance_mm: project.touch.tip_tolerance_mm,
            friction_percent: project.touch.friction_percent,
            allowed_percent: project.live.friction_percent,
            model_error: project.live.model_error_of_any(),
        }
    }
}

/// What a simulation depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationInputs {
    pub elements: ElementInputs,
    signal: Signal,
    directions: usize,
}

/// What the verdicts of the filters depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterInputs {
    pub simulation: SimulationInputs,
    /// Without how far off gauges are glued, or drift: that decides nothing of where they can go.
    gauge: GaugeKeys,
    feasible: FeasibleKeys,
    painted: Mask,
    keep_out: Option<Mask>,
}

/// What the candidates depend on, and the Gaussian process over them.
#[derive(Clone, Debug, PartialEq)]
pub struct ReductionInputs {
    pub filter: FilterInputs,
    candidates: CandidateKeys,
    sensors: usize,
    with_noise: bool,
    gaussian_process: GaussianProcessKeys,
}

/// What the selections depend on: everything that is asked for, but neither the answer nor which selector's answer is
/// shown.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectionInputs {
    pub reduction: ReductionInputs,
    asked: SelectionKeys,
    /// One selector knows how hard touches come, and how far off all is that a project says it of.
    known: Option<([f64; 2], Off)>,
}

/// What a whole design depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignInputs {
    pub selection: SelectionInputs,
    evaluation: EvaluationKeys,
    off: Off,
    calibration: CalibrationKeys,
    /// One estimator knows how hard anybody presses.
    judging: Judging,
}

/// What is painted on all layers, and what is held.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintInputs {
    layers: [Mask; Layer::ALL.len()],
    held: HeldSupports,
}

/// What a measured trade of speed against accuracy holds for: everything but its knobs.
#[derive(Clone, Debug, PartialEq)]
pub struct TradeInputs {
    project: Project,
    paint: PaintInputs,
}

/// What is known of the part's walls depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct WallInputs {
    /// What a model would cost, and how far off it would be, hangs on all of it.
    model: ModelInputs,
    spacing_mm: f64,
    tip_radius_mm: f64,
    reach_mm: f64,
    quality: Quality,
    limits: BudgetLimits,
    touches: usize,
    inside: Mask,
    outside: Mask,
}

/// What the error that is expected of gauges is asked of: the simulation, and what is said of gauges and touches.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedInputs {
    pub simulation: SimulationInputs,
    gauge: GaugeKeys,
    touch: TouchKeys,
    largest_force_n: f64,
    allowed_percent: f64,
    model_error: f64,
    /// Gauges off the lattice are of one design alone.
    off_lattice: Vec<Site>,
}

/// What the model of the gauges that live touch works with depends on: the simulation's inputs, and how the gauges are.
#[derive(Clone, Debug, PartialEq)]
pub struct SensingInputs {
    simulation: SimulationInputs,
    sites: Vec<ChosenSite>,
    grid_mm: [f64; 2],
    off: Off,
    /// What known presses are allowed to have along the surface (%).
    pressed_aside_percent: f64,
}

/// What a jig for the chosen gauges depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct JigInputs {
    sites: Vec<ChosenSite>,
    grid_mm: [f64; 2],
    part: Part,
}

impl Document {
    /// What a jig for the chosen gauges depends on now.
    #[must_use]
    pub fn jig_inputs(&self) -> JigInputs {
        let p = &self.state.project;
        JigInputs {
            sites: p.selection.sites.clone(),
            grid_mm: [p.gauge.grid_length_mm, p.gauge.grid_width_mm],
            part: Part {
                mesh: String::new(),
                ..p.part.clone()
            },
        }
    }

    fn mask(&self, name: &str) -> Mask {
        self.state.masks.get(name).cloned()
    }

    fn held(&self) -> HeldSupports {
        let mask = |s: &SupportKeys| self.mask(s.vertices.as_ref()?);
        let supports = &self.state.project.supports;
        supports.iter().map(|s| (s.clone(), mask(s))).collect()
    }

    /// What the elastic model depends on now.
    #[must_use]
    pub fn model_inputs(&self) -> ModelInputs {
        let project = &self.state.project;
        ModelInputs {
            part: Part {
                mesh: String::new(),
                ..project.part.clone()
            },
            material: project.material.clone(),
            held: self.held(),
        }
    }

    /// What the elements, sites and touches of a quality depend on now.
    #[must_use]
    pub fn element_inputs(&self, quality: Quality) -> ElementInputs {
        let p = &self.state.project;
        let keep_out = p.feasible.keep_out.as_ref();
        let usual = TouchKeys::default();
        ElementInputs {
            model: self.model_inputs(),
            touch: TouchKeys {
                forces_n: usual.forces_n,
                tip_tolerance_mm: f64::from(p.touch.tip_tolerance_mm > 0.0),
                friction_percent: f64::from(p.uncertainty().making_allowed().friction > 0.0),
                ..p.touch.clone()
            },
            region: p.touch.region.as_ref().map(|name| self.mask(name)),
            often: p.touch.often.as_ref().map(|name| self.mask(name)),
            sites: p.sites.clone(),
            quality,
            seed: p.budget.seed,
            limits: p.budget.limits_at(quality),
            keep_out_missing: keep_out.is_some_and(|name| !self.state.masks.contains_key(name)),
        }
    }

    /// What a simulation of a quality, which need not be the project's, depends on now.
    #[must_use]
    pub fn simulation_inputs(&self, quality: Quality) -> SimulationInputs {
        let gauge = &self.state.project.gauge;
        SimulationInputs {
            elements: self.element_inputs(quality),
            signal: gauge.signal,
            directions: gauge.directions,
        }
    }

    /// What the filters' verdicts on the simulation of a quality depend on now.
    #[must_use]
    pub fn filter_inputs(&self, quality: Quality) -> FilterInputs {
        let p = &self.state.project;
        FilterInputs {
            simulation: self.simulation_inputs(quality),
            gauge: GaugeKeys {
                tolerance: ToleranceKeys::default(),
                drift_microstrain: GaugeKeys::default().drift_microstrain,
                ..p.gauge.clone()
            },
            feasible: p.feasible.clone(),
            painted: self.state.painted.clone(),
            keep_out: p.feasible.keep_out.as_ref().map(|name| self.mask(name)),
        }
    }

    /// What the candidates of a quality depend on now.
    #[must_use]
    pub fn reduction_inputs(&self, quality: Quality) -> ReductionInputs {
        let p = &self.state.project;
        ReductionInputs {
            filter: self.filter_inputs(quality),
            candidates: p.candidates.clone(),
            sensors: p.selection.sensors,
            with_noise: p.selection.with_noise,
            gaussian_process: p.selection.gaussian_process.clone(),
        }
    }

    /// What the selections of a quality depend on now.
    #[must_use]
    pub fn selection_inputs(&self, quality: Quality) -> SelectionInputs {
        let p = &self.state.project;
        // Where all of them choose, another in the lead changes nothing.
        let selector = if p.selection.compare {
            SelectorKind::default()
        } else {
            p.selection.selector
        };
        let knows = p.selectors().contains(&SelectorKind::ExpectedError);
        SelectionInputs {
            reduction: self.reduction_inputs(quality),
            asked: SelectionKeys {
                sites: Vec::new(),
                selector,
                ..p.selection.clone()
            },
            known: knows.then_some((p.touch.forces_n, Off::of(p))),
        }
    }

    /// What a design of a quality depends on now.
    #[must_use]
    pub fn design_inputs(&self, quality: Quality) -> DesignInputs {
        let p = &self.state.project;
        DesignInputs {
            selection: self.selection_inputs(quality),
            evaluation: p.evaluation.clone(),
            off: Off::of(p),
            calibration: p.calibration,
            judging: p.judging(),
        }
    }

    /// What is painted, and what is held, now.
    #[must_use]
    pub fn paint_inputs(&self) -> PaintInputs {
        PaintInputs {
            layers: Layer::ALL.map(|layer| self.layer(layer).cloned()),
            held: self.held(),
        }
    }

    /// What a measured trade holds for now.
    #[must_use]
    pub fn trade_inputs(&self) -> TradeInputs {
        TradeInputs {
            project: without_knobs(&self.state.project),
            paint: self.paint_inputs(),
        }
    }

    /// What is known of the walls depends on now.
    #[must_use]
    pub fn wall_inputs(&self) -> WallInputs {
        let p = &self.state.project;
        WallInputs {
            model: self.model_inputs(),
            spacing_mm: p.sites.spacing_mm,
            tip_radius_mm: p.touch.tip_radius_mm,
            reach_mm: p.touch.reach_mm,
            quality: p.budget.quality,
            limits: p.budget.limits,
            touches: p.touch.count,
            inside: self.layer(Layer::Inside).cloned(),
            outside: self.layer(Layer::Outside).cloned(),
        }
    }

    /// What is expected of gauges on a simulation of a quality, with some sites off its lattice, depends on now.
    #[must_use]
    pub fn expected_inputs(&self, quality: Quality, off_lattice: &[Site]) -> ExpectedInputs {
        let p = &self.state.project;
        ExpectedInputs {
            simulation: self.simulation_inputs(quality),
            gauge: p.gauge.clone(),
            touch: p.touch.clone(),
            largest_force_n: p.live.largest_force_n,
            allowed_percent: p.live.friction_percent,
            model_error: p.live.model_error_of_any(),
            off_lattice: off_lattice.to_vec(),
        }
    }

    /// What the model of the gauges depends on now.
    #[must_use]
    pub fn sensing_inputs(&self) -> SensingInputs {
        let p = &self.state.project;
        SensingInputs {
            simulation: self.simulation_inputs(p.budget.quality),
            sites: p.selection.sites.clone(),
            grid_mm: [p.gauge.grid_length_mm, p.gauge.grid_width_mm],
            off: Off::of(p),
            pressed_aside_percent: p.calibration.friction_percent,
        }
    }
}
