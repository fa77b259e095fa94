//! Small solids that stand for things in a scene.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use crate::mesh::Facets;

/// A plate of a size (m) whose middle is at a place.
#[must_use]
pub fn plate(place: DVec3, turn: &DMat3, size: DVec3) -> Facets {
    let corner = |k: u32| {
        let sign = |bit: u32| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
        place + *turn * (size * DVec3::new(sign(0), sign(1), sign(2)))
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Facets {
        positions: (0..8).map(corner).collect(),
        triangles: faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// An arrow whose tip is at a place, pointing along `way`, of a length (m).
#[must_use]
pub fn arrow(tip: DVec3, way: DVec3, length: f64) -> Facets {
    const SIDES: u32 = 24;
    /// Along the arrow from its tip, and radius, over its length.
    const RINGS: [(f64, f64); 4] = [(0.35, 0.12), (0.35, 0.045), (1.0, 0.045), (1.0, 0.0)];
    let (u, v) = way.any_orthonormal_pair();
    let mut solid = Facets {
        positions: vec![tip],
        triangles: Vec::new(),
    };
    for (back, radius) in RINGS {
        for k in 0..SIDES {
            let angle = TAU * f64::from(k) / f64::from(SIDES);
            let side = (u * angle.cos() + v * angle.sin()) * (radius * length);
            solid.positions.push(tip - way * (back * length) + side);
        }
    }
    let at = |ring: u32, k: u32| 1 + ring * SIDES + k % SIDES;
    for k in 0..SIDES {
        solid.triangles.push([0, at(0, k), at(0, k + 1)]);
        for ring in 0..RINGS.len() as u32 - 1 {
            let [a, b, c, d] = [
                at(ring, k),
                at(ring + 1, k),
                at(ring + 1, k + 1),
                at(ring, k + 1),
            ];
            solid.triangles.push([a, b, c]);
            solid.triangles.push([a, c, d]);
        }
    }
    solid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solids_look_outwards() {
        let turn = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_z(1.1);
        let plate = plate(DVec3::new(1.0, 2.0, 3.0), &turn, DVec3::new(2.0, 3.0, 0.5));
        assert!((plate.volume() - 3.0).abs() < 1e-12, "{}", plate.volume());
        let arrow = arrow(DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.6, 0.0, 0.8), 10.0);
        let cone = TAU / 2.0 * 1.44 * 3.5 / 3.0;
        let shaft = TAU / 2.0 * 0.2025 * 6.5;
        assert!(
            (arrow.volume() / (cone + shaft) - 1.0).abs() < 0.02,
            "{}",
            arrow.volume()
        );
    }
}
