//! Boxes as a project has them: two opposite corners (mm), and the direction they stand along.

use glam::DVec3;

use crate::limb::BoxMm;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::stance::Stance;
use crate::units;

/// What lies so near to a face is on it (m): corners in decimals are not exactly what they say.
const ON_FACE: f64 = 1e-9;

/// The box between two corners: along the file's axes, or where it has an axis of its own along the front, the right
/// and the up of a part of that axis.
#[must_use]
pub fn oriented(corners: &BoxMm, axis: Option<[f64; 3]>) -> OrientedBox {
    let [a, b] = corners.map(|corner| units::from_mm(DVec3::from_array(corner)));
    let stance = axis.map_or_else(Stance::default, |axis| {
        Stance::about(DVec3::from_array(axis))
    });
    OrientedBox {
        stance,
        lower: a.min(b),
        upper: a.max(b),
    }
}

/// The keys of a box: its corners, and its axis where it does not lie along the file's axes.
#[must_use]
pub fn keys(region: &OrientedBox) -> (BoxMm, Option<[f64; 3]>) {
    let (lower, upper, axis) = match region.along_axes() {
        Some((lower, upper)) => (lower, upper, None),
        None => (region.lower, region.upper, Some(region.stance.up())),
    };
    let corners = [lower, upper].map(|p| (p * 1e3).to_array());
    (corners, axis.map(|axis| axis.to_array()))
}

/// Whether a point (m) lies in a box or on its faces.
#[must_use]
pub fn contains(region: &OrientedBox, point: DVec3) -> bool {
    region.contains(point, ON_FACE)
}
