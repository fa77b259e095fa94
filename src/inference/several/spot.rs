//! What is pressed at one place: a point, or an area; what every channel reads of it, and how that changes.

use glam::{DVec2, DVec3};

use crate::inference::deviation::{Nuisance, TouchDoubts};
use crate::inference::map::ResponseMap;
use crate::inference::matching::Matching;
use crate::mesh::SurfacePoint;

/// Radii of areas (m). What is smaller is a point: a finger's tip.
pub(super) const RADII: [f64; 2] = [8e-3, 36e-3];
/// How unevenly an area presses, over its pressure in the mean (standard deviation, each of the ways of
/// [`uneven_over`]): no palm is a ball.
const UNEVEN: f64 = 0.3;
/// How far an area is moved (m) and widened to see how its readings change: as far as its edge takes to pass templates.
const MOVED: f64 = 1e-3;
const WIDENED: f64 = 0.08;

/// One of several.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub at: SurfacePoint,
    /// N.
    pub force: f64,
    /// Of an area (m); absent for a point.
    pub radius: Option<f64>,
    pub about: TouchDoubts,
}

/// What is read of a newton there.
pub(super) struct Felt {
    pub reading: Vec<f64>,
    /// Change a metre along the two directions of the plane and, of an area, with the logarithm of its radius.
    pub columns: Vec<Vec<f64>>,
    pub plane: [DVec3; 2],
}

impl Spot {
    /// A point that is pressed as hard as that (N).
    pub fn point(at: SurfacePoint, force: f64) -> Self {
        Self {
            at,
            force,
            radius: None,
            about: TouchDoubts::default(),
        }
    }

    /// Unknowns that it has beside its force.
    pub fn places(&self) -> usize {
        2 + usize::from(self.radius.is_some())
    }

    /// Somewhere else: by metres along the plane's directions, and by the logarithm of the radius; no farther than `most` (m).
    pub fn moved(&self, map: &ResponseMap, plane: [DVec3; 2], step: &[f64], most: f64) -> Self {
        let along = DVec2::new(step[0], step[1]).clamp_length_max(most);
        let place = map.mesh.point(self.at) + plane[0] * along.x + plane[1] * along.y;
        let wider = |radius: f64| {
            let by = step[2].clamp(-0.3, 0.3).exp();
            (radius * by).clamp(RADII[0], RADII[1])
        };
        Self {
            at: map.mesh.index().nearest(place).0,
            radius: self.radius.map(wider),
            ..*self
        }
    }
}

impl Matching {
    /// What is read of a newton at a spot, and how that changes with it.
    pub(super) fn felt(&self, spot: &Spot) -> Felt {
        if let Some(radius) = spot.radius {
            return self.felt_over(spot, radius);
        }
        let slope = self.slope(&spot.about, spot.at);
        let column = |k: usize| slope.change.iter().map(|d| d[k]).collect();
        Felt {
            columns: vec![column(0), column(1)],
            reading: slope.reading,
            plane: slope.plane,
        }
    }

    fn felt_over(&self, spot: &Spot, radius: f64) -> Felt {
        let map = &self.map;
        let (centre, normal) = (map.mesh.point(spot.at), map.mesh.normal(spot.at));
        let first = normal.any_orthonormal_vector();
        let plane = [first, normal.cross(first)];
        let known = (self.nuisances()).map(|n| n.reading(&spot.about, spot.at));
        let nodes = nodes_near(map, centre, radius * WIDENED.exp() + MOVED);
        let pressed = |centre, radius| pressed_over(map, &nodes, (centre, normal), radius);
        let mut reading = pressed(centre, radius);
        if let Some(known) = known {
            for (r, k) in reading.iter_mut().zip(known) {
                *r += k;
            }
        }
        let change = |before: Vec<f64>, after: Vec<f64>, by: f64| -> Vec<f64> {
            let pairs = after.iter().zip(&before);
            pairs.map(|(a, b)| (a - b) / (2.0 * by)).collect()
        };
        let mut columns: Vec<Vec<f64>> = (plane.iter())
            .map(|way| {
                let [before, after] = [-MOVED, MOVED].map(|by| pressed(centre + *way * by, radius));
                change(before, after, MOVED)
            })
            .collect();
        let [before, after] = [-WIDENED, WIDENED].map(|by: f64| pressed(centre, radius * by.exp()));
        columns.push(change(before, after, WIDENED));
        Felt {
            reading,
            columns,
            plane,
        }
    }

    /// What a spot may have about it. Of an area its size is searched for, and how it presses is known by and large.
    pub(super) fn nuisances_of(&self, spot: &Spot) -> Vec<Nuisance> {
        let mut all = self.nuisances().map_or_else(Vec::new, |n| n.at(spot.at));
        if let Some(radius) = spot.radius {
            all.retain(|n| n.tip == 0.0);
            all.extend(
                uneven_over(&self.map, spot.at, radius).map(|reading| Nuisance {
                    force: DVec3::ZERO,
                    tip: 0.0,
                    reading,
                }),
            );
        }
        all
    }
}

/// Nodes within a distance of a place (m).
pub(super) fn nodes_near(map: &ResponseMap, place: DVec3, within: f64) -> Vec<usize> {
    let near = |node: &usize| map.places[*node].distance_squared(place) < within * within;
    (0..map.places.len()).filter(near).collect()
}

/// What is read of a newton (along the normal at the centre) that presses over an area, by H. Hertz's pressure
/// √(1 - r²/R²), everywhere against the surface: at these nodes, beyond which it does not reach.
pub(super) fn pressed_over(
    map: &ResponseMap,
    nodes: &[usize],
    (centre, normal): (DVec3, DVec3),
    radius: f64,
) -> Vec<f64> {
    let mut sum = vec![0.0; map.channels()];
    let mut force = 0.0;
    for (node, pressure, facing) in pressures(map, nodes, (centre, normal), radius) {
        force += pressure * facing;
        for (s, g) in sum.iter_mut().zip(map.node(node)) {
            *s += pressure * g;
        }
    }
    if force > 0.0 {
        for s in &mut sum {
            *s /= force;
        }
    }
    sum
}

/// Every node of some that an area presses on, with its share of the pressure and how far it faces the centre's way.
fn pressures<'a>(
    map: &'a ResponseMap,
    nodes: &'a [usize],
    (centre, normal): (DVec3, DVec3),
    radius: f64,
) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
    let normals = map.mesh.vertex_normals();
    nodes.iter().filter_map(move |&node| {
        let inside = 1.0 - map.places[node].distance_squared(centre) / (radius * radius);
        let facing = normals[node].dot(normal);
        (inside > 0.0 && facing > 0.0).then(|| (node, map.areas[node] * inside.sqrt(), facing))
    })
}

/// What is read of a newton more of the ways in which an area may press unevenly, as far as is usual: more on one side, more
/// on two sides that face each other, more in the middle, each with as little on the rest of it.
fn uneven_over(
    map: &ResponseMap,
    at: SurfacePoint,
    radius: f64,
) -> impl Iterator<Item = Vec<f64>> + use<> {
    let (centre, normal) = (map.mesh.point(at), map.mesh.normal(at));
    let first = normal.any_orthonormal_vector();
    let second = normal.cross(first);
    let nodes = nodes_near(map, centre, radius);
    let mut readings: [Vec<f64>; 5] = std::array::from_fn(|_| vec![0.0; map.channels()]);
    let (mut even, mut force, mut forces) = (vec![0.0; map.channels()], 0.0, [0.0; 5]);
    for (node, pressure, facing) in pressures(map, &nodes, (centre, normal), radius) {
        let off = (map.places[node] - centre) / radius;
        let (x, y, r2) = (off.dot(first), off.dot(second), off.length_squared());
        let ways = [x, y, x * x - y * y, 2.0 * x * y, 2.0 * r2 - 1.0];
        force += pressure * facing;
        for (channel, g) in map.node(node).iter().enumerate() {
            even[channel] += pressure * g;
            for (reading, way) in readings.iter_mut().zip(ways) {
                reading[channel] += way * pressure * g;
            }
        }
        for (sum, way) in forces.iter_mut().zip(ways) {
            *sum += way * pressure * facing;
        }
    }
    // The force stays what it is.
    let force = f64::max(force, f64::MIN_POSITIVE);
    for (reading, of_way) in readings.iter_mut().zip(forces) {
        for (r, e) in reading.iter_mut().zip(&even) {
            *r = UNEVEN * (*r - of_way / force * e) / force;
        }
    }
    readings.into_iter()
}
