//! The part: its mesh and what is made of it, what it is made of, and how it is held.

use serde::{Deserialize, Serialize};

use super::PartAxis;
use super::boxes;
use super::value::MM;
use crate::limb::BoxMm;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::repair::Repair;
use crate::mesh::unroll::Axis;

/// Unit of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// mm.
    #[serde(rename = "mm")]
    Millimetre,
    /// cm.
    #[serde(rename = "cm")]
    Centimetre,
    /// m.
    #[serde(rename = "m")]
    Metre,
    /// in, 25.4 mm.
    #[serde(rename = "in")]
    Inch,
}

impl Unit {
    /// All, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Centimetre, Self::Metre, Self::Inch];

    /// How long it is (m).
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Metre => 1.0,
            Self::Inch => 0.0254,
        }
    }

    /// As in files and options.
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

/// Keys of the table `part`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Path of the mesh, relative to the project file.
    pub mesh: String,
    /// Unit of the mesh; glTF is in metres by its specification and needs none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Which connected body of the file, 0 being the largest.
    #[serde(default)]
    pub body: usize,
    /// Vertices nearer to each other than this are joined; zero joins equal ones only.
    #[serde(default)]
    pub weld_mm: f64,
    /// Holes up to this far across are filled.
    #[serde(default)]
    pub fill_holes_mm: f64,
    // What is usual is not serialized: the fingerprints of trades that were measured before this key still hold.
    /// The farthest that a node of a tetrahedron is moved where its bent edge turns it inside out.
    #[serde(
        default = "defaults::straighten",
        skip_serializing_if = "defaults::is_usual_straighten"
    )]
    pub straighten_mm: f64,
    /// What the elastic model is computed on.
    #[serde(default)]
    pub elements: Elements,
    /// Shell or solid.
    #[serde(default)]
    pub model: PartModel,
    /// Thickness of the wall of a shell (mm).
    #[serde(default = "defaults::thickness")]
    pub thickness_mm: f64,
    /// Of a solid: masks of the part's vertices that say where gauges can go and where touches land, where
    /// what is found by itself is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    /// Name of a mask of what is outside, where what is found by itself is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outside: Option<String>,
    /// Which way the part stands.
    #[serde(default)]
    pub axis: PartAxis,
}

impl Part {
    /// The repairs asked for when the mesh is read.
    #[must_use]
    pub fn repair(&self) -> Repair {
        Repair {
            weld: self.weld_mm * MM,
            fill_holes: self.fill_holes_mm * MM,
            straighten: self.straighten_mm * MM,
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

/// Keys of the table `material`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialKeys {
    /// Young's modulus, in gigapascals.
    pub youngs_modulus_gpa: f64,
    /// Above -1 and below 0.5.
    pub poissons_ratio: f64,
}

impl Default for MaterialKeys {
    fn default() -> Self {
        Self {
            youngs_modulus_gpa: 1.7,
            poissons_ratio: 0.35,
        }
    }
}

/// What a support holds.
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

/// Keys of a table `support`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportKeys {
    /// What it holds.
    #[serde(default)]
    pub kind: SupportKind,
    /// Every point of the part inside it is held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_mm: Option<BoxMm>,
    /// Where the box does not lie along the file's axes: the direction it stands along. Its corners are then along
    /// the front, the right and the up of a part of that axis, from the file's origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_axis: Option<[f64; 3]>,
    /// Instead of a box: a mask of the part's vertices, by its name in the arrays beside the project
    /// file, or a group of the mesh file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<String>,
    /// Normal of a symmetry plane; unused otherwise.
    #[serde(default)]
    pub normal: Axis,
}

impl SupportKeys {
    /// Clamps what lies inside a box.
    #[must_use]
    pub fn clamping(region: &OrientedBox) -> Self {
        let mut keys = Self {
            kind: SupportKind::Clamped,
            box_mm: None,
            box_axis: None,
            vertices: None,
            normal: Axis::Z,
        };
        keys.set_box(region);
        keys
    }

    /// Its box, where it has one.
    #[must_use]
    pub fn oriented_box(&self) -> Option<OrientedBox> {
        (self.box_mm.as_ref()).map(|corners| boxes::oriented(corners, self.box_axis))
    }

    /// Gives it a box: by the file's axes where the box lies along them.
    pub fn set_box(&mut self, region: &OrientedBox) {
        let (corners, axis) = boxes::keys(region);
        self.box_mm = Some(corners);
        self.box_axis = axis;
    }
}

/// What stands in place of a key that is left out.
pub(super) mod defaults {
    /// Of the wall (mm): the bundled limb's.
    pub fn thickness() -> f64 {
        1.5
    }

    /// More than edges of a sound mesh of a limb are bent.
    pub fn straighten() -> f64 {
        10.0
    }

    /// Whether a value (mm) is the usual one, and need not be written.
    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "serde asks with a reference"
    )]
    pub fn is_usual_straighten(millimetres: &f64) -> bool {
        *millimetres == straighten()
    }
}
