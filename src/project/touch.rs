//! Who touches the part, where and how hard, and where gauges may sit under it.

use serde::{Deserialize, Serialize};

use super::key::{MASK, SWITCH, ValueRange, from};
use super::keys::keys;
use super::ranges::{FORCES, FRICTION, LENGTH, OFF_MM, ROOM};
use super::value::{any, is_default};
use crate::mesh::reach::FINGERTIP;
use crate::units;

keys! {
    /// Keys of the table `touch`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct TouchKeys in "touch" {
        force_n: f64 = 10.0, "N", from(1e-12, 1e12),
            "force of the touches that are simulated, pressed along the inward normal";
        // What is usual is not serialized: the fingerprints of trades that were measured before this key still hold.
        #[serde(skip_serializing_if = "are_usual_forces")]
        forces_n: [f64; 2] = FORCES_N, "N", FORCES,
            "how hard touches come, the lightest and the hardest: evenly over the logarithm between";
        tip_radius_mm: f64 = 5.0, "mm", LENGTH,
            "the tip spreads the force over this radius, as (1 - r²/a²)²";
        #[serde(skip_serializing_if = "is_default")]
        tip_tolerance_mm: f64 = 0.0, "mm", OFF_MM,
            "how far off the tip's radius is (standard deviation): larger tips and smaller ones touch too";
        #[serde(skip_serializing_if = "is_default")]
        friction_percent: f64 = 0.0, "%", FRICTION,
            "how much of a touch's force drags along the surface, beside what presses (rms, in any direction)";
        count: usize = 4000, "", ValueRange::Whole(3, 1_000_000),
            "touches that are simulated; lower qualities take fewer";
        edge_margin_mm: f64 = 2.4, "mm", ROOM,
            "least distance of a touch from a free edge";
        #[serde(skip_serializing_if = "is_usual_reach")]
        reach_mm: f64 = REACH_MM, "mm", ROOM,
            "radius of the fingertip that comes from outside: touches lie only where it gets to, not on what stands behind windows that it does not fit through";
        #[serde(skip_serializing_if = "Option::is_none")]
        region: Option<String> = None, "", MASK,
            "touches come only here: a mask in the NPZ file beside this one, or a group of the mesh file";
        #[serde(skip_serializing_if = "Option::is_none")]
        often: Option<String> = None, "", MASK,
            "touches come more often here: a mask in the NPZ file beside this one, or a group of the mesh file";
        #[serde(skip_serializing_if = "is_usually_often")]
        often_times: f64 = OFTEN_TIMES, "", from(1.0, 1e3),
            "how many times as many touches come to a piece of the surface in touch.often as to one beside it";
    }
}

impl TouchKeys {
    /// How far touches keep from edges (m).
    #[must_use]
    pub fn edge_margin(&self) -> f64 {
        units::from_mm(self.edge_margin_mm)
    }
}

/// The lightest and the hardest touch (N), where nothing else is said.
const FORCES_N: [f64; 2] = [2.0, 30.0];

/// Of whom touches the part, where nothing else is said: a fingertip.
const REACH_MM: f64 = FINGERTIP * 1e3;

/// How much more touches come to where they come often, where nothing else is said.
const OFTEN_TIMES: f64 = 4.0;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes by reference"
)]
fn is_usually_often(times: &f64) -> bool {
    *times == OFTEN_TIMES
}

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
pub enum SiteLattice {
    /// Spread evenly over any surface.
    #[default]
    Even,
    /// Rows and columns in the unrolled view.
    Unrolled,
}
any!(SiteLattice);

keys! {
    /// Keys of the table `sites`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct SiteKeys in "sites" {
        spacing_mm: f64 = 2.1, "mm", LENGTH,
            "between the possible gauge positions on the inside";
        lattice: SiteLattice = SiteLattice::Even, "", ValueRange::Words(&["even", "unrolled"]),
            "how they are laid out: \"even\" (any surface) or \"unrolled\" (rows and columns about the axis)";
    }
}

impl SiteKeys {
    /// Between possible gauges (m).
    #[must_use]
    pub fn spacing(&self) -> f64 {
        units::from_mm(self.spacing_mm)
    }
}

keys! {
    /// Keys of the table `feasible`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct FeasibleKeys in "feasible" {
        support_clearance_mm: f64 = 8.0, "mm", ROOM,
            "least distance of a gauge over the surface from anything held";
        edge_neighbours: usize = 20, "", ValueRange::Whole(0, 1000),
            "k of the paper's centre-of-mass filter: so many neighbours of a site";
        edge_radius_mm: f64 = 2.1, "mm", ROOM,
            "how far the centre of mass of these neighbours may lie from the site";
        jig: bool = false, "", SWITCH,
            "gauges go only where the arm of a printed jig gets to them, straight along a rod through the part";
        #[serde(skip_serializing_if = "Option::is_none")]
        painted: Option<String> = None, "", MASK,
            "gauges go only here: what was painted, an array in the NPZ file beside this one";
        #[serde(skip_serializing_if = "Option::is_none")]
        keep_out: Option<String> = None, "", MASK,
            "no gauge goes here: a mask in the NPZ file beside this one, or a group of the mesh file";
    }
}
