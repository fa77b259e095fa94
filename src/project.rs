//! A project: everything a design depends on, as plain data in the units of its file.

mod live;
mod ranges;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::budget::{Budget, Limits, Quality};
use crate::dataset::Signal;
use crate::elasticity::support::Region;
use crate::elasticity::{Freedoms, Material, Section, Support};
use crate::feasible::FeasibleRules;
use crate::gaussian_process::GpKernel;
use crate::limb::BoxMm;
use crate::mesh::repair::Repair;
use crate::mesh::unroll::Axis;
use crate::placement::SelectorKind;
use crate::placement::candidates::Reduction;
use crate::regression::Hyper;

use ranges::check;

pub use live::{GluedKeys, LiveKeys};
pub use ranges::{EDGE_NEIGHBOURS, FARTHEST, GAUGES, TOUCHES};

/// Version of the file format this program writes and the newest it reads.
pub const FORMAT: u32 = 1;

const MM: f64 = 1e-3;
const MICRO: f64 = 1e-6;

/// A value that cannot be used, by the key it stands under.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} must be {rule}, but is {value}")]
pub struct BadValue {
    pub key: String,
    pub rule: Cow<'static, str>,
    pub value: String,
}

/// The whole project.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Project {
    pub format: u32,
    pub part: Part,
    #[serde(default)]
    pub material: MaterialKeys,
    #[serde(default, rename = "support")]
    pub supports: Vec<SupportKeys>,
    #[serde(default)]
    pub touch: TouchKeys,
    #[serde(default)]
    pub sites: SiteKeys,
    #[serde(default)]
    pub gauge: GaugeKeys,
    #[serde(default)]
    pub feasible: FeasibleKeys,
    #[serde(default)]
    pub candidates: CandidateKeys,
    #[serde(default)]
    pub selection: SelectionKeys,
    #[serde(default)]
    pub evaluation: EvaluationKeys,
    #[serde(default)]
    pub budget: BudgetKeys,
    #[serde(default)]
    pub live: LiveKeys,
    /// Selections that were kept to be compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<Kept>,
}

/// Unit of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    #[serde(rename = "mm")]
    Millimetre,
    #[serde(rename = "cm")]
    Centimetre,
    #[serde(rename = "m")]
    Metre,
    #[serde(rename = "in")]
    Inch,
}

impl Unit {
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch];

    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Metre => 1.0,
            Self::Inch => 0.0254,
        }
    }

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Path of the mesh, relative to the project file.
    pub mesh: String,
    /// Unit of the mesh; glTF is in metres by its specification and needs none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    #[serde(default)]
    pub body: usize,
    /// Vertices nearer to each other than this are joined; zero joins equal ones only.
    #[serde(default)]
    pub weld_mm: f64,
    /// Holes up to this far across are filled.
    #[serde(default)]
    pub fill_holes_mm: f64,
    /// What the elastic model is computed on.
    #[serde(default)]
    pub elements: Elements,
    #[serde(default)]
    pub model: PartModel,
    #[serde(default = "defaults::thickness")]
    pub thickness_mm: f64,
    /// Of a solid: masks of the part's vertices that say where gauges can go and where touches land, where
    /// what is found by itself is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outside: Option<String>,
    /// The axis the part is unrolled about.
    #[serde(default)]
    pub axis: Axis,
}

impl Part {
    /// The repairs asked for when the mesh is read.
    #[must_use]
    pub fn repair(&self) -> Repair {
        Repair {
            weld: self.weld_mm * MM,
            fill_holes: self.fill_holes_mm * MM,
        }
    }
}

/// What the elastic model is computed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Elements {
    /// A mesh of its own on the part's surface, finer where the strain changes.
    #[default]
    Graded,
    /// The triangles of the mesh file.
    AsGiven,
}

/// How the mesh is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PartModel {
    /// The mesh is the mid-surface of a shell.
    #[default]
    Shell,
    /// The mesh encloses a solid with walls.
    Solid,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialKeys {
    pub youngs_modulus_gpa: f64,
    pub poissons_ratio: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SupportKind {
    /// No displacement, no rotation.
    #[default]
    Clamped,
    /// No displacement.
    Pinned,
    /// A mirror plane, normal to `normal`.
    Symmetry,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportKeys {
    #[serde(default)]
    pub kind: SupportKind,
    /// Every point of the part inside it is held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_mm: Option<BoxMm>,
    /// Instead of a box: a mask of the part's vertices, by its name in the arrays beside the project
    /// file, or a group of the mesh file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<String>,
    #[serde(default)]
    pub normal: Axis,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TouchKeys {
    pub force_n: f64,
    pub tip_radius_mm: f64,
    pub count: usize,
    pub edge_margin_mm: f64,
    /// Name of a mask (one value a vertex of the part): touches come only where it is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<String>,
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

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SiteKeys {
    pub spacing_mm: f64,
    pub lattice: Lattice,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaugeKeys {
    pub signal: Signal,
    /// Directions that a gauge may have at one place: the one with the largest strain, and others evenly
    /// turned from it.
    pub directions: usize,
    pub noise_microstrain: f64,
    pub range_microstrain: f64,
    pub least_signal_to_noise: f64,
    pub grid_length_mm: f64,
    pub grid_width_mm: f64,
    pub flatness_mm: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeasibleKeys {
    pub support_clearance_mm: f64,
    pub edge_neighbours: usize,
    pub edge_radius_mm: f64,
    /// Name of the painted mask (one value a vertex) in the arrays beside the project file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub painted: Option<String>,
    /// Name of a mask of vertices that no gauge may go to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep_out: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CandidateKeys {
    pub unexplained: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SelectionKeys {
    pub selector: SelectorKind,
    pub sensors: usize,
    /// Settings of greedy SVR's regression (targets in mm, features standardized).
    pub c_mm: f64,
    pub epsilon_mm: f64,
    pub gamma: f64,
    /// Least distance between two gauges.
    pub spacing_mm: f64,
    /// Places of gauges that must be there; the nearest site is taken.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub required_mm: Vec<[f64; 3]>,
    /// Error at which greedy SVR adds no more gauges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_mm: Option<f64>,
    /// What all gauges together may cost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cost_budget: Option<f64>,
    /// Whether the gauge's noise is added to the signals that sites are chosen from.
    pub with_noise: bool,
    /// Probability that one gauge has failed.
    pub failure: f64,
    /// Whether the other selectors choose too, to be compared.
    pub compare: bool,
    pub gaussian_process: GaussianProcessKeys,
    /// What a gauge costs inside a box, the last box counting; 1 elsewhere.
    #[serde(rename = "cost", skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostKeys>,
    /// The chosen sites, written by a design.
    #[serde(rename = "site", skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<ChosenSite>,
}

/// The kernel of entropy and mutual information.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaussianProcessKeys {
    /// Length and power of the kernel; searched by cross-validation when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power: Option<f64>,
    pub noise: f64,
}

impl Default for GaussianProcessKeys {
    fn default() -> Self {
        Self {
            length_mm: None,
            power: None,
            noise: GpKernel::default().noise,
        }
    }
}

impl GaussianProcessKeys {
    /// Length (m) and power, where either is given; the other is then the paper's.
    #[must_use]
    pub fn given(&self) -> Option<(f64, f64)> {
        let paper = GpKernel::default();
        (self.length_mm.is_some() || self.power.is_some()).then(|| {
            (
                self.length_mm.map_or(paper.length_m, |l| l * MM),
                self.power.unwrap_or(paper.power),
            )
        })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChosenSite {
    pub position_mm: [f64; 3],
    pub direction: [f64; 3],
}

/// A selection with what was found out about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    pub name: String,
    /// The selector's name, or "by-hand".
    pub selector: String,
    pub quality: Quality,
    /// What all its gauges cost together, 1 each where nothing else is said.
    pub cost: f64,
    /// Of choosing it, by the clock.
    pub seconds: f64,
    #[serde(default, rename = "site", skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<ChosenSite>,
    #[serde(default, rename = "error", skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<KeptError>,
    #[serde(default, rename = "failure", skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<KeptFailure>,
}

/// Errors of a kept selection's first so many gauges, in a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptError {
    pub region: String,
    pub sensors: usize,
    pub mean_mm: f64,
    pub median_mm: f64,
    pub p95_mm: f64,
}

/// Mean error of a kept selection with failed gauges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFailure {
    pub failed: usize,
    pub retrained: bool,
    pub mean_mm: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationKeys {
    /// Regions that errors are quoted for, beside all touches.
    #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<RegionKeys>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionKeys {
    pub name: String,
    pub box_mm: BoxMm,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostKeys {
    pub box_mm: BoxMm,
    pub cost: f64,
}

impl CostKeys {
    #[must_use]
    pub fn contains(&self, at_mm: DVec3) -> bool {
        let [a, b] = self.box_mm.map(DVec3::from_array);
        at_mm.cmpge(a.min(b)).all() && at_mm.cmple(a.max(b)).all()
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BudgetKeys {
    pub quality: Quality,
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

mod defaults {
    pub fn thickness() -> f64 {
        1.5
    }
}

impl Default for MaterialKeys {
    fn default() -> Self {
        Self {
            youngs_modulus_gpa: 1.7,
            poissons_ratio: 0.35,
        }
    }
}
impl Default for TouchKeys {
    fn default() -> Self {
        Self {
            force_n: 10.0,
            tip_radius_mm: 5.0,
            count: 4000,
            edge_margin_mm: 2.4,
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
            range_microstrain: 30_000.0,
            least_signal_to_noise: 3.0,
            grid_length_mm: 5.0,
            grid_width_mm: 2.0,
            flatness_mm: 0.3,
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
impl Default for CandidateKeys {
    fn default() -> Self {
        Self {
            unexplained: 0.01,
            count: None,
        }
    }
}
impl Default for SelectionKeys {
    fn default() -> Self {
        let hyper = Hyper::default();
        Self {
            selector: SelectorKind::GreedySvr,
            sensors: 10,
            c_mm: hyper.c,
            epsilon_mm: hyper.epsilon,
            gamma: hyper.gamma,
            spacing_mm: 0.0,
            required_mm: Vec::new(),
            target_mm: None,
            cost_budget: None,
            with_noise: false,
            failure: 0.0,
            compare: true,
            gaussian_process: GaussianProcessKeys::default(),
            costs: Vec::new(),
            sites: Vec::new(),
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
                elements: Elements::Graded,
                model: PartModel::Shell,
                thickness_mm: defaults::thickness(),
                inside: None,
                outside: None,
                axis: Axis::Z,
            },
            material: MaterialKeys::default(),
            supports: Vec::new(),
            touch: TouchKeys::default(),
            sites: SiteKeys::default(),
            gauge: GaugeKeys::default(),
            feasible: FeasibleKeys::default(),
            candidates: CandidateKeys::default(),
            selection: SelectionKeys::default(),
            evaluation: EvaluationKeys::default(),
            budget: BudgetKeys::default(),
            live: LiveKeys::default(),
            kept: Vec::new(),
        }
    }

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

    /// The names of all masks that the project refers to, beside what is painted.
    pub fn mask_names(&mut self) -> impl Iterator<Item = &mut String> {
        self.mask_keys().map(|(_, name)| name)
    }

    /// The same with the key that each stands under.
    pub fn mask_keys(&mut self) -> impl Iterator<Item = (&'static str, &mut String)> {
        let supports = self.supports.iter_mut();
        let supports = supports.map(|s| ("support.vertices", s.vertices.as_mut()));
        let others = [
            ("part.inside", self.part.inside.as_mut()),
            ("part.outside", self.part.outside.as_mut()),
            ("touch.region", self.touch.region.as_mut()),
            ("feasible.keep_out", self.feasible.keep_out.as_mut()),
        ];
        supports
            .chain(others)
            .filter_map(|(key, name)| Some((key, name?)))
    }

    /// A mask that the project names.
    ///
    /// # Errors
    /// [`BadValue`] where there is none of that name.
    pub fn mask<'a>(
        key: &str,
        name: Option<&String>,
        masks: &'a Masks,
    ) -> Result<Option<&'a Arc<Vec<bool>>>, BadValue> {
        let Some(name) = name else {
            return Ok(None);
        };
        let found = masks.get(name).ok_or_else(|| BadValue {
            key: key.into(),
            rule: "the name of an array beside the project file or of a group of the mesh file"
                .into(),
            value: format!("\"{name}\" (there is {})", names(masks)),
        })?;
        Ok(Some(found))
    }

    /// The supports, with the masks of the part's vertices that some of them name.
    ///
    /// # Errors
    /// [`BadValue`] for a support without a region, or with a mask that is not there.
    pub fn supports(&self, masks: &Masks) -> Result<Vec<Support>, BadValue> {
        let axis = |a: Axis| [Axis::X, Axis::Y, Axis::Z].iter().position(|&b| a == b);
        let held = |s: &SupportKeys| match s.kind {
            SupportKind::Clamped => Freedoms::ALL,
            SupportKind::Pinned => Freedoms::DISPLACEMENTS,
            SupportKind::Symmetry => Freedoms::symmetry(axis(s.normal).unwrap_or(2)),
        };
        self.supports
            .iter()
            .map(|s| {
                Ok(Support {
                    region: region(s, masks)?,
                    held: held(s),
                })
            })
            .collect()
    }

    #[must_use]
    pub fn feasible_rules(&self) -> FeasibleRules {
        FeasibleRules {
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

    #[must_use]
    pub fn hyper(&self) -> Hyper {
        Hyper {
            c: self.selection.c_mm,
            epsilon: self.selection.epsilon_mm,
            gamma: self.selection.gamma,
        }
    }

    /// Force (N) and tip radius (m).
    #[must_use]
    pub fn tip(&self) -> (f64, f64) {
        (self.touch.force_n, self.touch.tip_radius_mm * MM)
    }
}

/// Masks of the part's vertices by name: arrays beside the project file, and groups of the mesh file.
pub type Masks = BTreeMap<String, Arc<Vec<bool>>>;

fn names(masks: &Masks) -> String {
    if masks.is_empty() {
        "none".into()
    } else {
        masks.keys().cloned().collect::<Vec<_>>().join(", ")
    }
}

fn region(support: &SupportKeys, masks: &Masks) -> Result<Region, BadValue> {
    match (&support.box_mm, &support.vertices) {
        (Some(corners), None) => {
            let [a, b] = corners.map(|p| DVec3::from_array(p) * MM);
            Ok(Region::Box {
                lower: a.min(b),
                upper: a.max(b),
            })
        }
        (None, Some(name)) => {
            let mask = Project::mask("support.vertices", Some(name), masks)?;
            let mask = mask.map(Arc::clone).unwrap_or_default();
            Ok(Region::Vertices(mask))
        }
        (both, _) => Err(BadValue {
            key: "support".into(),
            rule: "given one region: box_mm or vertices".into(),
            value: if both.is_some() {
                "given both"
            } else {
                "given neither"
            }
            .into(),
        }),
    }
}
