//! The part: its mesh and what is made of it, what it is made of, and how it is held.

use serde::{Deserialize, Serialize};

use super::PartAxis;
use super::boxes;
use super::key::{MASK, ValueRange, from, within};
use super::keys::keys;
use super::ranges::{LENGTH, PLACES, ROOM};
use super::value::any;
use crate::limb::BoxMm;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::repair::Repair;
use crate::mesh::unroll::Axis;
use crate::units;

any!(Unit, ElementKind, PartModel, SupportKind, Axis);

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

keys! {
    /// Keys of the table `part`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct Part in "part" {
        mesh: String, "", ValueRange::Any("a path, relative to the project file"),
            "the mesh: glTF/GLB, OBJ, STL, PLY, Gmsh, Abaqus or Ansys";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        unit: Option<Unit>, "", ValueRange::Words(&["mm", "cm", "m", "in"]),
            "unit of the mesh file: \"mm\", \"cm\", \"m\" or \"in\"; glTF is in metres and needs none, Ansys may say its own";
        #[serde(default)]
        body: usize, "", ValueRange::Whole(0, u32::MAX as u64),
            "which connected body of the file, 0 being the one with the largest surface";
        #[serde(default)]
        weld_mm: f64, "mm", ROOM,
            "vertices nearer to each other than this are joined; 0 joins only those that rounding has parted";
        #[serde(default)]
        fill_holes_mm: f64, "mm", ROOM,
            "holes up to this far across are filled";
        // What is usual is not serialized: the fingerprints of trades that were measured before this key still hold.
        #[serde(
            default = "defaults::straighten",
            skip_serializing_if = "defaults::is_usual_straighten"
        )]
        straighten_mm: f64, "mm", ROOM,
            "a bent edge that turns a tetrahedron inside out is straightened where its node moves no farther than this";
        #[serde(default, skip_serializing_if = "defaults::is_zero")]
        halve_mm: f64, "mm", ROOM,
            "edges longer than this are halved, so that there are vertices to paint on and to show fields at; 0 does so where triangles are large beside the part, 1000000 never";
        #[serde(default)]
        elements: ElementKind, "", ValueRange::Words(&["graded", "as-given"]),
            "\"graded\": computed on a mesh of its own, finer where the strain changes; \"as-given\": on the file's triangles";
        #[serde(default)]
        model: PartModel, "", ValueRange::Words(&["shell", "solid"]),
            "\"shell\": the mesh is the middle of a wall; \"solid\": it encloses a part with walls";
        #[serde(default = "defaults::thickness")]
        thickness_mm: f64, "mm", LENGTH,
            "thickness of the wall of a shell";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        inside: Option<String>, "", MASK,
            "where gauges can go, in place of what is found by itself (solids): a mask";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        outside: Option<String>, "", MASK,
            "where touches land, in place of what is found by itself (solids): a mask";
        #[serde(default)]
        axis: PartAxis, "", ValueRange::Any("auto, x, y, z or a direction [x, y, z]"),
            "which way is up for views, unrolling and new boxes: \"auto\" (by the part's shape), \"x\", \"y\", \"z\" or a direction [x, y, z]";
    }
}

impl Part {
    /// Of the wall of a shell (m).
    #[must_use]
    pub fn thickness(&self) -> f64 {
        units::from_mm(self.thickness_mm)
    }

    /// The repairs asked for when the mesh is read.
    #[must_use]
    pub fn repair(&self) -> Repair {
        Repair {
            weld: units::from_mm(self.weld_mm),
            fill_holes: units::from_mm(self.fill_holes_mm),
            straighten: units::from_mm(self.straighten_mm),
            halve: match self.elements {
                ElementKind::Graded => units::from_mm(self.halve_mm),
                // Those of the file are the elements.
                ElementKind::AsGiven => f64::INFINITY,
            },
        }
    }
}

/// What the elastic model is computed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ElementKind {
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

keys! {
    /// Keys of the table `material`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct MaterialKeys in "material" {
        youngs_modulus_gpa: f64 = 1.7, "GPa", from(1e-9, 1e6),
            "Young's modulus (printed nylon: 1.7)";
        poissons_ratio: f64 = 0.35, "", within(-1.0, 0.5),
            "Poisson's ratio (printed nylon: 0.35)";
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

keys! {
    /// Keys of a table `support`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct SupportKeys in "support" {
        #[serde(default)]
        kind: SupportKind, "", ValueRange::Words(&["clamped", "pinned", "symmetry"]),
            "what is held: \"clamped\" (no displacement, no rotation), \"pinned\" (no displacement) or \"symmetry\" (a mirror plane)";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        box_mm: Option<BoxMm>, "mm", PLACES,
            "every point of the part inside this box is held";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        box_axis: Option<[f64; 3]>, "", PLACES,
            "the box stands along this direction: its corners are along the front, the right and the up of a part of that axis";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        vertices: Option<String>, "", MASK,
            "instead of a box: a mask in the NPZ file beside this one, or a group of the mesh file";
        #[serde(default)]
        normal: Axis, "", ValueRange::Words(&["x", "y", "z"]),
            "of a symmetry plane; unused otherwise";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bedding_n_per_mm3: Option<f64>, "N/mm³", from(1e-6, 1e9),
            "how stiff what it is held by is: the pressure (N/mm²) that moves its surface by a millimetre (rubber of 1 mm: 5, plastic: 1000); none: it does not give way";
    }
}

impl SupportKeys {
    /// See [`crate::elasticity::Support::bedding`] (Pa/m). A mirror plane does not give way.
    #[must_use]
    pub fn bedding(&self) -> Option<f64> {
        let of = self
            .bedding_n_per_mm3
            .filter(|_| self.kind != SupportKind::Symmetry);
        of.map(units::from_n_per_mm3)
    }

    /// Clamps what lies inside a box.
    #[must_use]
    pub fn clamping(region: &OrientedBox) -> Self {
        let mut keys = Self {
            kind: SupportKind::Clamped,
            box_mm: None,
            box_axis: None,
            vertices: None,
            normal: Axis::Z,
            bedding_n_per_mm3: None,
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

    /// Whether a value is zero, and need not be written.
    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "serde asks with a reference"
    )]
    pub fn is_zero(value: &f64) -> bool {
        *value == 0.0
    }
}
