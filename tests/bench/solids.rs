//! Closed solids with closed forms.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::immersed::{Fineness, Immersed};
use hapdef::elasticity::support::Region;
use hapdef::elasticity::{Freedoms, Material, Model as _, Support, Touch};
use hapdef::mesh::TriMesh;

/// A surface of quadrangles (each counter-clockwise from outside), cut in two.
pub fn of_quads(positions: &[DVec3], quads: &[[u32; 4]]) -> Arc<TriMesh> {
    let triangles: Vec<[u32; 3]> = (quads.iter())
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Arc::new(TriMesh::new(positions, &triangles, 0).unwrap().0)
}

/// A block from the origin, placed by `place`.
pub fn block(sides: DVec3, place: impl Fn(DVec3) -> DVec3) -> Arc<TriMesh> {
    let positions: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * sides)
        .map(place)
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    of_quads(&positions, &quads)
}

/// A tube about z between two radii, of `n` flat sides.
pub fn tube(inner: f64, outer: f64, length: f64, n: u32) -> Arc<TriMesh> {
    let ring = |r: f64, z: f64| {
        (0..n).map(move |i| {
            let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            DVec3::new(r * a.cos(), r * a.sin(), z)
        })
    };
    let positions: Vec<DVec3> = ring(outer, 0.0)
        .chain(ring(outer, length))
        .chain(ring(inner, 0.0))
        .chain(ring(inner, length))
        .collect();
    let quads: Vec<[u32; 4]> = (0..n)
        .flat_map(|i| {
            let j = (i + 1) % n;
            [
                [i, j, n + j, n + i],
                [2 * n + j, 2 * n + i, 3 * n + i, 3 * n + j],
                [j, i, 2 * n + i, 2 * n + j],
                [n + i, n + j, 3 * n + j, 3 * n + i],
            ]
        })
        .collect();
    of_quads(&positions, &quads)
}

/// All displacements held in a box.
pub fn clamp(lower: DVec3, upper: DVec3) -> Support {
    Support {
        region: Region::Box { lower, upper },
        held: Freedoms::ALL,
    }
}

pub fn model(
    part: &Arc<TriMesh>,
    material: Material,
    supports: &[Support],
    fineness: &Fineness,
) -> SolidModel {
    let immersed = Immersed::new(part, material, supports);
    immersed.model(part, fineness, &unwatched).unwrap()
}

/// Displacement under a touch, along it, a newton (m/N).
pub fn under(m: &SolidModel, touch: &Touch) -> f64 {
    let load = m.load(touch);
    let u = m.system().solve_freedoms(&load);
    load.iter().map(|&(i, f)| f * u[i]).sum::<f64>() / (touch.force * touch.force)
}

/// Strain at a place on the surface along a direction under a touch.
pub fn strain_along(m: &SolidModel, touch: &Touch, place: DVec3, direction: DVec3) -> f64 {
    let u = m.system().solve_freedoms(&m.load(touch));
    let observer = m.observer(&[m.index().nearest(place).0], Face::Inside);
    let frame = observer.frames()[0];
    let [xx, yy, xy] = observer.strain_of(m, &u)[0];
    let (x, y) = (direction.dot(frame.x_axis), direction.dot(frame.y_axis));
    xx * x * x + yy * y * y + xy * x * y
}
