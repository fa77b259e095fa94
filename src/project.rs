//! A project: everything a design depends on, as plain data in the units of its file.

mod axis;
pub mod boxes;
mod check;
mod gauge;
mod judging;
mod kept;
mod key;
mod keys;
mod live;
mod masks;
mod part;
mod press;
mod ranges;
mod selection;
mod tables;
mod touch;
mod value;

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::dataset::Signal;
use crate::elasticity::{Material, ShellSection};
use crate::evaluation::{EstimatorKind, Judging, JudgingForces};
use crate::feasible::FeasibleRules;
use crate::placement::SelectorKind;
use crate::placement::candidates::Reduction;
use crate::regression::Hyper;
use crate::uncertainty::{Gluing, HandPressing, Making, Uncertainty};
use crate::units;

use value::is_default;

pub use axis::PartAxis;
pub use gauge::{CalibrationKeys, GaugeKeys, ToleranceKeys};
pub use judging::{BudgetKeys, CandidateKeys, EvaluationKeys, RegionKeys};
pub use kept::{KeptError, KeptFailure, KeptSelection};
pub use key::{Key, Span, ValueRange};
pub use keys::KeyTable;
pub use live::{GluedKeys, LiveKeys};
pub use masks::Masks;
pub use part::{ElementKind, MaterialKeys, Part, PartModel, SupportKeys, SupportKind, Unit};
pub use press::PressKeys;
pub use ranges::FARTHEST;
pub use selection::{ChosenSite, CostKeys, GaussianProcessKeys, SelectionKeys};
pub use tables::{Heading, all_keys};
pub use touch::{FeasibleKeys, SiteKeys, SiteLattice, TouchKeys};
pub use value::{BadValue, Value};

/// Version of the file format this program writes and the newest it reads.
pub const FORMAT: u32 = 1;

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
    pub kept: Vec<KeptSelection>,
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
                halve_mm: 0.0,
                elements: ElementKind::Graded,
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
    pub fn section(&self) -> ShellSection {
        ShellSection {
            material: Material {
                youngs_modulus: self.material.youngs_modulus_gpa * 1e9,
                poissons_ratio: self.material.poissons_ratio,
            },
            thickness: self.part.thickness(),
        }
    }

    /// What a gauge needs, in SI units.
    #[must_use]
    pub fn feasible_rules(&self) -> FeasibleRules {
        let [grid_length, grid_width] = self.gauge.grid();
        FeasibleRules {
            // Film and tape are about twice as wide as the grid.
            pad: grid_width,
            support_clearance: units::from_mm(self.feasible.support_clearance_mm),
            // Sites at one place are neighbours of each other, which move no centre of mass.
            edge_neighbours: (self.feasible.edge_neighbours + 1) * self.gauge.directions - 1,
            edge_radius: units::from_mm(self.feasible.edge_radius_mm),
            grid_length,
            grid_width,
            flatness: units::from_mm(self.gauge.flatness_mm),
            noise: self.uncertainty().of_channel(),
            least_signal_to_noise: self.gauge.least_signal_to_noise,
            range: units::from_microstrain(self.gauge.range_microstrain),
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

    /// Asks for the comparison of the paper: selectors beside each other, judged by regression. A selector that the paper
    /// does not know gives way to the paper's own.
    pub fn compare_as_in_the_paper(&mut self) {
        self.evaluation.estimator = EstimatorKind::Svr;
        self.selection.compare = true;
        if !SelectorKind::PAPER.contains(&self.selection.selector) {
            self.selection.selector = SelectorKind::GreedySvr;
        }
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
            place: units::from_mm(tolerance.place_mm),
            angle: tolerance.angle_deg * PI / 180.0,
            gain: tolerance.gain_percent / 100.0,
        }
    }

    /// How a hand makes known presses.
    #[must_use]
    pub fn pressing(&self) -> HandPressing {
        HandPressing {
            place: units::from_mm(self.calibration.place_mm),
            force: self.calibration.force_percent / 100.0,
            friction: self.calibration.friction_percent / 100.0,
        }
    }

    /// How far off touches are made.
    #[must_use]
    pub fn making(&self) -> Making {
        Making {
            tip: units::from_mm(self.touch.tip_tolerance_mm),
            friction: self.touch.friction_percent / 100.0,
        }
    }

    /// Everything that is known to be off. What the elements leave is not: a simulation says that, and
    /// [`Uncertainty::with_elements`] takes it in.
    #[must_use]
    pub fn uncertainty(&self) -> Uncertainty {
        Uncertainty {
            noise: self.gauge.noise(),
            resolution: units::from_microstrain(self.gauge.resolution_microstrain),
            gluing: self.gluing(),
            model: self.live.model_error_of_any(),
            stiffness: self.live.stiffness_percent / 100.0,
            making: self.making(),
            allowed: self.live.friction_percent / 100.0,
            drift: units::from_microstrain(self.gauge.drift_microstrain),
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
        Judging::Matching(JudgingForces {
            most_n: self.live.largest_force_n.max(2.0 * hardest),
            judged_n,
        })
    }

    /// Radius (m) of the ball that touches have to get to the part by.
    #[must_use]
    pub fn fingertip(&self) -> f64 {
        units::from_mm(self.touch.reach_mm)
    }

    /// Force (N) and tip radius (m).
    #[must_use]
    pub fn tip(&self) -> (f64, f64) {
        (self.touch.force_n, units::from_mm(self.touch.tip_radius_mm))
    }
}
