//! A project: everything a design depends on, as plain data in the units of its file.

mod axis;
pub mod boxes;
mod kept;
mod live;
mod masks;
mod part;
mod ranges;
mod selection;
mod value;

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::budget::{Budget, Limits, Quality};
use crate::dataset::Signal;
use crate::elasticity::{Material, Section};
use crate::evaluation::{EstimatorKind, Forces, Judging};
use crate::feasible::FeasibleRules;
use crate::limb::BoxMm;
use crate::mesh::reach::FINGERTIP;
use crate::placement::SelectorKind;
use crate::placement::candidates::Reduction;
use crate::regression::Hyper;
use crate::uncertainty::{Gluing, Making, Pressing, Uncertainty};

use value::MM;

pub use axis::PartAxis;
pub use kept::{Kept, KeptError, KeptFailure};
pub use live::{GluedKeys, LiveKeys};
pub use masks::Masks;
pub use part::{Elements, MaterialKeys, Part, PartModel, SupportKeys, SupportKind, Unit};
pub use ranges::{
    ANGLE_OFF, DRIFT, EDGE_NEIGHBOURS, FARTHEST, FORCE_OFF, FORCES, FRICTION, GAIN_OFF, GAUGES,
    LENGTH, LOST, PLACE_OFF, STARTS, TIP_OFF, TOUCHES,
};
pub use selection::{ChosenSite, CostKeys, GaussianProcessKeys, SelectionKeys};
pub use value::BadValue;

/// Version of the file format this program writes and the newest it reads.
pub const FORMAT: u32 = 1;

const MICRO: f64 = 1e-6;

/// The whole project.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Project {
    /// Version of the file's format.
    pub format: u32,
    /// Table `part`.
    pub part: Part,
    /// Table `material`.
    #[serde(default)]
    pub material: MaterialKeys,
    /// Tables `support`.
    #[serde(default, rename = "support")]
    pub supports: Vec<SupportKeys>,
    /// Table `touch`.
    #[serde(default)]
    pub touch: TouchKeys,
    /// Table `sites`.
    #[serde(default)]
    pub sites: SiteKeys,
    /// Table `gauge`.
    #[serde(default)]
    pub gauge: GaugeKeys,
    // As `touch.forces_n`.
    /// Table `calibration`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub calibration: CalibrationKeys,
    /// Table `feasible`.
    #[serde(default)]
    pub feasible: FeasibleKeys,
    /// Table `candidates`.
    #[serde(default)]
    pub candidates: CandidateKeys,
    /// Table `selection`.
    #[serde(default)]
    pub selection: SelectionKeys,
    /// Table `evaluation`.
    #[serde(default)]
    pub evaluation: EvaluationKeys,
    /// Table `budget`.
    #[serde(default)]
    pub budget: BudgetKeys,
    /// Table `live`.
    #[serde(default)]
    pub live: LiveKeys,
    /// Selections that were kept to be compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<Kept>,
}

/// Keys of the table `touch`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TouchKeys {
    /// Force of the touches that are simulated, along the inward normal (N).
    pub force_n: f64,
    // What is usual is not serialized: the fingerprints of trades that were measured before this key still hold.
    /// How hard touches come, the lightest and the hardest: evenly over the logarithm between.
    #[serde(skip_serializing_if = "are_usual_forces")]
    pub forces_n: [f64; 2],
    /// Radius over which the tip spreads the force as (1 - r²/a²)² (mm).
    pub tip_radius_mm: f64,
    /// How far off that is (standard deviation): larger tips, or smaller ones, touch too.
    #[serde(skip_serializing_if = "is_default")]
    pub tip_tolerance_mm: f64,
    /// How much of a touch's force acts along the surface beside what presses (%, rms, in any direction): friction.
    #[serde(skip_serializing_if = "is_default")]
    pub friction_percent: f64,
    /// Touches to simulate; lower qualities take fewer.
    pub count: usize,
    /// Least distance of a touch from a free edge (mm).
    pub edge_margin_mm: f64,
    /// Radius of the fingertip or stylus that comes: touches lie only where it gets to from outside.
    #[serde(skip_serializing_if = "is_usual_reach")]
    pub reach_mm: f64,
    /// Name of a mask (one value a vertex of the part): touches come only where it is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<String>,
}

/// The lightest and the hardest touch (N), where nothing else is said.
const FORCES_N: [f64; 2] = [2.0, 30.0];

/// Of whom touches the part, where nothing else is said: a fingertip.
const REACH_MM: f64 = FINGERTIP * 1e3;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes by reference"
)]
fn is_usual_reach(reach_mm: &f64) -> bool {
    *reach_mm == REACH_MM
}

fn are_usual_forces(forces_n: &[f64; 2]) -> bool {
    *forces_n == FORCES_N
}

/// How sites are laid out on the inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Lattice {
    /// Spread evenly over any surface.
    #[default]
    Even,
    /// Rows and columns in the unrolled view.
    Unrolled,
}

/// Keys of the table `sites`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SiteKeys {
    /// Between possible gauge positions (mm).
    pub spacing_mm: f64,
    /// How they are laid out.
    pub lattice: Lattice,
}

/// Keys of the table `gauge`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaugeKeys {
    /// What a gauge reports.
    pub signal: Signal,
    /// Directions that a gauge may have at one place: the one with the largest strain, and others evenly
    /// turned from it.
    pub directions: usize,
    /// Standard deviation of a reading (microstrain).
    pub noise_microstrain: f64,
    /// What all channels have drifted by together since the rest was taken (standard deviation). A tare and a rest that
    /// follows take away what is slower than a touch, and what wanders faster is in the noise as it is measured: beside
    /// them nothing is left, unless touches last for minutes or warm the part.
    #[serde(skip_serializing_if = "is_default")]
    pub drift_microstrain: f64,
    /// Largest strain that gauge and amplifier can take (microstrain).
    pub range_microstrain: f64,
    /// Rms strain over noise that a site must reach.
    pub least_signal_to_noise: f64,
    /// Length of the measuring grid, along the gauge (mm).
    pub grid_length_mm: f64,
    /// Its width (mm).
    pub grid_width_mm: f64,
    /// Largest height of the surface over the gauge's plane (mm).
    pub flatness_mm: f64,
    // As `touch.forces_n`.
    /// Table `gauge.tolerance`.
    #[serde(skip_serializing_if = "ToleranceKeys::is_usual")]
    pub tolerance: ToleranceKeys,
}

/// How far off gauges are glued (standard deviations).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ToleranceKeys {
    /// Rms distance, in any direction along the surface.
    pub place_mm: f64,
    /// Of the direction (degrees).
    pub angle_deg: f64,
    /// Of the reading (%).
    pub gain_percent: f64,
}

impl ToleranceKeys {
    fn is_usual(&self) -> bool {
        *self == Self::default()
    }
}

/// How known presses are made that gauges are calibrated with (standard deviations).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CalibrationKeys {
    /// Rms distance from the place that is asked for, in any direction along the surface.
    pub place_mm: f64,
    /// Of the force that is asked for.
    pub force_percent: f64,
    /// Of the force along the surface, over the one that presses (rms, in any direction).
    #[serde(skip_serializing_if = "is_usual_tilt")]
    pub friction_percent: f64,
}

/// Of a hand that presses upright as well as it can: six degrees.
const TILT_PERCENT: f64 = 10.0;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn is_usual_tilt(percent: &f64) -> bool {
    *percent == TILT_PERCENT
}

/// Keys of the table `feasible`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeasibleKeys {
    /// Least distance over the surface from anything held (mm).
    pub support_clearance_mm: f64,
    /// k of the paper's centre-of-mass filter.
    pub edge_neighbours: usize,
    /// Its radius (mm).
    pub edge_radius_mm: f64,
    /// Name of the painted mask (one value a vertex) in the arrays beside the project file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub painted: Option<String>,
    /// Name of a mask of vertices that no gauge may go to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_out: Option<String>,
}

/// Keys of the table `candidates`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CandidateKeys {
    /// Share of the held-out variance that the candidates may leave unexplained.
    pub unexplained: f64,
    /// A fixed number of candidates instead.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
}

/// Keys of the table `evaluation`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationKeys {
    // As `touch.forces_n`.
    /// What finds the touches that sets of gauges are judged by.
    #[serde(skip_serializing_if = "is_default")]
    pub estimator: EstimatorKind,
    /// How hard these touches are, rising; by regression they are as hard as those that it learned from.
    #[serde(skip_serializing_if = "are_usual_judged_forces")]
    pub forces_n: Vec<f64>,
    /// Regions that errors are quoted for, beside all touches.
    #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<RegionKeys>,
}

/// How hard the touches are (N) that sets are judged by, where nothing else is said.
const JUDGED_N: [f64; 3] = [3.0, 10.0, 25.0];

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn are_usual_judged_forces(forces_n: &[f64]) -> bool {
    forces_n == JUDGED_N
}

/// Keys of a table `evaluation.region`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionKeys {
    /// For people.
    pub name: String,
    /// Touches inside it belong to the region (mm).
    pub box_mm: BoxMm,
    /// As of a support.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_axis: Option<[f64; 3]>,
}

/// Keys of the table `budget`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BudgetKeys {
    /// How much to spend.
    pub quality: Quality,
    /// Of every random draw.
    pub seed: u64,
    /// In place of some of the quality's own.
    #[serde(skip_serializing_if = "Limits::are_none")]
    pub limits: Limits,
}

impl BudgetKeys {
    /// What may be spent.
    #[must_use]
    pub fn budget(&self) -> Budget {
        self.budget_at(self.quality)
    }

    /// As [`Self::budget`] at a quality that need not be the project's: its limits are those of its own.
    #[must_use]
    pub fn budget_at(&self, quality: Quality) -> Budget {
        quality.budget().within(&self.limits_at(quality))
    }

    /// The limits that hold at a quality.
    #[must_use]
    pub fn limits_at(&self, quality: Quality) -> Limits {
        if quality == self.quality {
            self.limits
        } else {
            Limits::default()
        }
    }
}

impl Default for TouchKeys {
    fn default() -> Self {
        Self {
            force_n: 10.0,
            forces_n: FORCES_N,
            tip_radius_mm: 5.0,
            tip_tolerance_mm: 0.0,
            friction_percent: 0.0,
            count: 4000,
            edge_margin_mm: 2.4,
            reach_mm: REACH_MM,
            region: None,
        }
    }
}
impl Default for SiteKeys {
    fn default() -> Self {
        Self {
            spacing_mm: 2.1,
            lattice: Lattice::Even,
        }
    }
}
impl Default for GaugeKeys {
    fn default() -> Self {
        Self {
            signal: Signal::Strain,
            directions: 1,
            noise_microstrain: 1.0,
            drift_microstrain: 0.0,
            range_microstrain: 30_000.0,
            least_signal_to_noise: 3.0,
            grid_length_mm: 5.0,
            grid_width_mm: 2.0,
            flatness_mm: 0.3,
            tolerance: ToleranceKeys::default(),
        }
    }
}
impl Default for ToleranceKeys {
    fn default() -> Self {
        Self {
            place_mm: 1.0,
            angle_deg: 3.0,
            gain_percent: 3.0,
        }
    }
}
impl Default for CalibrationKeys {
    fn default() -> Self {
        Self {
            place_mm: 1.0,
            force_percent: 3.0,
            friction_percent: TILT_PERCENT,
        }
    }
}
impl Default for FeasibleKeys {
    fn default() -> Self {
        Self {
            support_clearance_mm: 8.0,
            edge_neighbours: 20,
            edge_radius_mm: 2.1,
            painted: None,
            keep_out: None,
        }
    }
}
impl Default for EvaluationKeys {
    fn default() -> Self {
        Self {
            estimator: EstimatorKind::default(),
            forces_n: JUDGED_N.to_vec(),
            regions: Vec::new(),
        }
    }
}
impl Default for CandidateKeys {
    fn default() -> Self {
        Self {
            unexplained: 0.01,
            count: None,
        }
    }
}
impl Project {
    /// A project around a mesh, everything else by default and nothing held yet.
    #[must_use]
    pub fn around(mesh: &str, unit: Option<Unit>) -> Self {
        Self {
            format: FORMAT,
            part: Part {
                mesh: mesh.to_owned(),
                unit,
                body: 0,
                weld_mm: 0.0,
                fill_holes_mm: 0.0,
                straighten_mm: part::defaults::straighten(),
                elements: Elements::Graded,
                model: PartModel::Shell,
                thickness_mm: part::defaults::thickness(),
                inside: None,
                outside: None,
                axis: PartAxis::Auto,
            },
            material: MaterialKeys::default(),
            supports: Vec::new(),
            touch: TouchKeys::default(),
            sites: SiteKeys::default(),
            gauge: GaugeKeys::default(),
            calibration: CalibrationKeys::default(),
            feasible: FeasibleKeys::default(),
            candidates: CandidateKeys::default(),
            selection: SelectionKeys::default(),
            evaluation: EvaluationKeys::default(),
            budget: BudgetKeys::default(),
            live: LiveKeys::default(),
            kept: Vec::new(),
        }
    }

    /// Material and thickness of a shell.
    #[must_use]
    pub fn section(&self) -> Section {
        Section {
            material: Material {
                youngs_modulus: self.material.youngs_modulus_gpa * 1e9,
                poissons_ratio: self.material.poissons_ratio,
            },
            thickness: self.part.thickness_mm * MM,
        }
    }

    /// What a gauge needs, in SI units.
    #[must_use]
    pub fn feasible_rules(&self) -> FeasibleRules {
        FeasibleRules {
            // Film and tape are about twice as wide as the grid.
            pad: self.gauge.grid_width_mm * MM,
            support_clearance: self.feasible.support_clearance_mm * MM,
            // Sites at one place are neighbours of each other, which move no centre of mass.
            edge_neighbours: (self.feasible.edge_neighbours + 1) * self.gauge.directions - 1,
            edge_radius: self.feasible.edge_radius_mm * MM,
            grid_length: self.gauge.grid_length_mm * MM,
            grid_width: self.gauge.grid_width_mm * MM,
            flatness: self.gauge.flatness_mm * MM,
            noise: self.gauge.noise_microstrain * MICRO,
            least_signal_to_noise: self.gauge.least_signal_to_noise,
            range: self.gauge.range_microstrain * MICRO,
        }
    }

    /// When the reduction stops keeping sites.
    #[must_use]
    pub fn reduction(&self) -> Reduction {
        self.candidates.count.map_or(
            Reduction::Unexplained(self.candidates.unexplained),
            Reduction::Count,
        )
    }

    /// The selectors that choose, the one whose sites are shown first.
    #[must_use]
    pub fn selectors(&self) -> Vec<SelectorKind> {
        let first = self.selection.selector;
        let others = SelectorKind::ALL
            .into_iter()
            .filter(|&k| self.selection.compare && k != first);
        std::iter::once(first).chain(others).collect()
    }

    /// Whether the feasible sites are reduced to candidates where some selectors choose: one of them chooses among
    /// these, the judge compares sets with all of them together, or so many of them are asked for.
    #[must_use]
    pub fn wants_candidates(&self, selectors: &[SelectorKind]) -> bool {
        selectors.iter().any(|k| k.wants_candidates())
            || self.judging() == Judging::Svr
            || self.candidates.count.is_some()
    }

    /// Settings of greedy SVR's regression.
    #[must_use]
    pub fn hyper(&self) -> Hyper {
        Hyper {
            c: self.selection.c_mm,
            epsilon: self.selection.epsilon_mm,
            gamma: self.selection.gamma,
        }
    }

    /// How far off a workshop glues the gauges.
    #[must_use]
    pub fn gluing(&self) -> Gluing {
        let tolerance = &self.gauge.tolerance;
        Gluing {
            place: tolerance.place_mm * MM,
            angle: tolerance.angle_deg * PI / 180.0,
            gain: tolerance.gain_percent / 100.0,
        }
    }

    /// How a hand makes known presses.
    #[must_use]
    pub fn pressing(&self) -> Pressing {
        Pressing {
            place: self.calibration.place_mm * MM,
            force: self.calibration.force_percent / 100.0,
            friction: self.calibration.friction_percent / 100.0,
        }
    }

    /// How far off touches are made.
    #[must_use]
    pub fn making(&self) -> Making {
        Making {
            tip: self.touch.tip_tolerance_mm * MM,
            friction: self.touch.friction_percent / 100.0,
        }
    }

    /// Everything that is known to be off. What the elements leave is not: a simulation says that, and
    /// [`Uncertainty::with_elements`] takes it in. Nor is the converter's resolution, which the board knows.
    #[must_use]
    pub fn uncertainty(&self) -> Uncertainty {
        Uncertainty {
            noise: self.gauge.noise_microstrain * MICRO,
            gluing: self.gluing(),
            stiffness: self.live.stiffness_percent / 100.0,
            making: self.making(),
            allowed: self.live.friction_percent / 100.0,
            drift: self.gauge.drift_microstrain * MICRO,
            pressing: self.pressing(),
            ..Uncertainty::default()
        }
    }

    /// How sets of gauges are judged. Matching knows strain only: sites that report displacements are judged by
    /// regression whatever is asked for.
    #[must_use]
    pub fn judging(&self) -> Judging {
        let asked = (self.evaluation.estimator, self.gauge.signal);
        if asked != (EstimatorKind::Matching, Signal::Strain) {
            return Judging::Svr;
        }
        let judged_n = self.evaluation.forces_n.clone();
        let hardest = judged_n.iter().copied().fold(0.0, f64::max);
        Judging::Matching(Forces {
            most_n: self.live.largest_force_n.max(2.0 * hardest),
            judged_n,
        })
    }

    /// Radius (m) of the ball that touches have to get to the part by.
    #[must_use]
    pub fn fingertip(&self) -> f64 {
        self.touch.reach_mm * MM
    }

    /// Force (N) and tip radius (m).
    #[must_use]
    pub fn tip(&self) -> (f64, f64) {
        (self.touch.force_n, self.touch.tip_radius_mm * MM)
    }
}
