//! A flat square that tests press on, with gauges that read what they say.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;

use super::ResponseMap;
use super::map::nodes;
use crate::mesh::TriMesh;

/// In z = 0 and from the origin on, so many vertices a side that lie so far from each other (m), and what its gauges read of a
/// newton at a place.
pub(crate) fn plate<const CHANNELS: usize>(
    side: u32,
    step: f64,
    read: impl Fn(DVec3) -> [f64; CHANNELS],
) -> ResponseMap {
    let points: Vec<DVec3> = (0..side * side)
        .map(|k| DVec3::new(f64::from(k % side), f64::from(k / side), 0.0) * step)
        .collect();
    let squares = (0..side * (side - 1)).filter(|k| (k + 1) % side != 0);
    let triangles: Vec<[u32; 3]> = squares
        .flat_map(|k| [[k, k + 1, k + side], [k + 1, k + side + 1, k + side]])
        .collect();
    let (mesh, _) = TriMesh::new(&points, &triangles, 0).unwrap();
    let values = nodes(&mesh).into_iter().flat_map(read).collect();
    ResponseMap::of(Arc::new(mesh), CHANNELS, values)
}

/// Gauges of [`gauged_plate`].
pub(crate) const CHANNELS: usize = 8;

/// A plate of 58 mm whose gauges, in a circle, feel what is near them, one way on one side and the other way on the other.
pub(crate) fn gauged_plate() -> ResponseMap {
    let gauge = |c: usize| {
        let turn = 0.61 * TAU * c as f64;
        DVec3::new(29e-3 + 20e-3 * turn.cos(), 29e-3 + 20e-3 * turn.sin(), 0.0)
    };
    plate(30, 2e-3, |place| {
        std::array::from_fn::<_, CHANNELS, _>(|c| {
            let off = (place - gauge(c)) / 9e-3;
            20e-6 * (off.x + 0.4) * (-off.length()).exp()
        })
    })
}

/// What gauges read (strain) of touches at nodes, each with its force (N).
pub(crate) fn read_touches(map: &ResponseMap, touches: &[(usize, f64)]) -> Vec<f64> {
    let of = |c: usize| touches.iter().map(|&(node, f)| f * map.node(node)[c]).sum();
    (0..map.channels()).map(of).collect()
}
