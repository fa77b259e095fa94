//! Distances over the surface, by fast marching.
//!
//! R. Kimmel and J. Sethian, "Computing geodesic paths on manifolds", PNAS 95 (1998). For a point
//! source the wave over a triangle is taken as circular (exact on a plane) instead of straight.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use crate::budget::{Cancelled, Watch, report};

use super::{SurfacePoint, TriMesh};

/// The shape of the wave that leaves the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Front {
    /// From one point: circles.
    Circular,
    /// From a set of vertices: straight fronts, as along an edge.
    Straight,
}

/// Distance from a point of the surface to every vertex within `limit` (m); infinity beyond.
#[must_use]
pub fn from_point(mesh: &TriMesh, source: SurfacePoint, limit: f64) -> Vec<f64> {
    let origin = mesh.point(source);
    let seeds: Vec<(u32, f64)> = mesh.triangles()[source.triangle as usize]
        .iter()
        .map(|&v| (v, origin.distance(mesh.positions()[v as usize])))
        .collect();
    march(mesh, &seeds, limit, Front::Circular)
}

/// Distance from the nearest of some vertices to every vertex within `limit` (m); infinity beyond.
#[must_use]
pub fn from_vertices(mesh: &TriMesh, sources: &[u32], limit: f64) -> Vec<f64> {
    let seeds: Vec<(u32, f64)> = sources.iter().map(|&v| (v, 0.0)).collect();
    march(mesh, &seeds, limit, Front::Straight)
}

/// Distances (m) from each of some points to each of the others, by rows; infinite between pieces that
/// do not hang together.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn between(
    mesh: &TriMesh,
    points: &[SurfacePoint],
    watch: Watch,
) -> Result<Vec<f64>, Cancelled> {
    let rows: Result<Vec<Vec<f64>>, Cancelled> = points
        .par_iter()
        .enumerate()
        .map(|(k, &source)| {
            report(watch, "Distances over the surface", k, points.len())?;
            let field = from_point(mesh, source, f64::INFINITY);
            Ok(points
                .iter()
                .map(|&target| at(mesh, &field, source, target))
                .collect())
        })
        .collect();
    Ok(rows?.concat())
}

/// The distance of one point from the source of a field of distances: as a vertex of its own would get
/// it from the sides of its triangle.
#[must_use]
pub fn at(mesh: &TriMesh, field: &[f64], source: SurfacePoint, target: SurfacePoint) -> f64 {
    let here = mesh.point(target);
    if source.triangle == target.triangle {
        return here.distance(mesh.point(source));
    }
    let corners = mesh.triangles()[target.triangle as usize];
    let p = corners.map(|v| mesh.positions()[v as usize]);
    let d = corners.map(|v| field[v as usize]);
    let along = (0..3).map(|k| d[k] + here.distance(p[k]));
    let across = (0..3).filter_map(|k| {
        let l = (k + 1) % 3;
        let triangle = Unfolded::new(p[k], p[l], here);
        triangle.circular(d[k], d[l])
    });
    along.chain(across).fold(f64::INFINITY, f64::min)
}

#[derive(PartialEq)]
struct Entry {
    distance: f64,
    vertex: u32,
}
impl Eq for Entry {}
impl Ord for Entry {
    // Reversed, so that the heap gives the nearest first; ties by index keep the order fixed.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .distance
            .total_cmp(&self.distance)
            .then(other.vertex.cmp(&self.vertex))
    }
}
impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

fn march(mesh: &TriMesh, seeds: &[(u32, f64)], limit: f64, front: Front) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; mesh.positions().len()];
    let mut settled = vec![false; distance.len()];
    let mut heap = BinaryHeap::new();
    for &(vertex, d) in seeds {
        if d < distance[vertex as usize] {
            distance[vertex as usize] = d;
            heap.push(Entry {
                distance: d,
                vertex,
            });
        }
    }
    while let Some(Entry {
        distance: d,
        vertex,
    }) = heap.pop()
    {
        if settled[vertex as usize] || d > limit {
            continue;
        }
        settled[vertex as usize] = true;
        for &t in &mesh.vertex_triangles()[vertex as usize] {
            let tri = mesh.triangles()[t as usize];
            for corner in 0..3 {
                let target = tri[corner];
                if settled[target as usize] {
                    continue;
                }
                let others = [tri[(corner + 1) % 3], tri[(corner + 2) % 3]];
                let reach = update(mesh, target, others, &distance, &settled, front);
                if reach < distance[target as usize] && reach <= limit {
                    distance[target as usize] = reach;
                    heap.push(Entry {
                        distance: reach,
                        vertex: target,
                    });
                }
            }
        }
    }
    for (d, done) in distance.iter_mut().zip(&settled) {
        if !done {
            *d = f64::INFINITY;
        }
    }
    distance
}

/// The shortest way to `target` through one triangle: across the opposite side or along an edge.
fn update(
    mesh: &TriMesh,
    target: u32,
    others: [u32; 2],
    distance: &[f64],
    settled: &[bool],
    front: Front,
) -> f64 {
    let p = |v: u32| mesh.positions()[v as usize];
    let along = others
        .iter()
        .filter(|&&v| settled[v as usize])
        .map(|&v| distance[v as usize] + p(v).distance(p(target)))
        .fold(f64::INFINITY, f64::min);
    if !others.iter().all(|&v| settled[v as usize]) {
        return along;
    }
    let [da, db] = others.map(|v| distance[v as usize]);
    let triangle = Unfolded::new(p(others[0]), p(others[1]), p(target));
    let across = match front {
        Front::Circular => triangle.circular(da, db),
        Front::Straight => None,
    }
    .or_else(|| triangle.straight(da, db));
    across.map_or(along, |d| d.min(along))
}

/// A triangle laid flat: A at the origin, B at (c, 0), the target at (x, y) with y > 0.
struct Unfolded {
    c: f64,
    x: f64,
    y: f64,
}

impl Unfolded {
    fn new(a: DVec3, b: DVec3, target: DVec3) -> Self {
        let c = a.distance(b);
        let e = (b - a) / c;
        let x = (target - a).dot(e);
        Self {
            c,
            x,
            y: ((target - a) - e * x).length(),
        }
    }

    /// Through a virtual source below the side AB, at the distances given from A and B.
    fn circular(&self, da: f64, db: f64) -> Option<f64> {
        let sx = (da * da - db * db + self.c * self.c) / (2.0 * self.c);
        let below = da * da - sx * sx;
        if below < 0.0 {
            return None;
        }
        let sy = -below.sqrt();
        let crossing = sx + (self.x - sx) * (-sy) / (self.y - sy);
        (0.0..=self.c)
            .contains(&crossing)
            .then(|| (self.x - sx).hypot(self.y - sy))
    }

    /// A plane wave whose value is `da` at A and `db` at B, if it enters through the side AB.
    fn straight(&self, da: f64, db: f64) -> Option<f64> {
        let gx = (db - da) / self.c;
        let rest = 1.0 - gx * gx;
        if rest <= 0.0 {
            return None;
        }
        let gy = rest.sqrt();
        let crossing = self.x - self.y * gx / gy;
        (0.0..=self.c)
            .contains(&crossing)
            .then_some(da + gx * self.x + gy * self.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate(n: usize) -> TriMesh {
        let p: Vec<DVec3> = (0..=n)
            .flat_map(|j| (0..=n).map(move |i| DVec3::new(i as f64, j as f64, 0.0) / n as f64))
            .collect();
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let t: Vec<[u32; 3]> = (0..n)
            .flat_map(|j| {
                (0..n).flat_map(move |i| {
                    [
                        [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                        [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]
                })
            })
            .collect();
        TriMesh::new(&p, &t, 0).unwrap().0
    }

    #[test]
    fn circles_are_exact_on_a_plane() {
        let mesh = plate(20);
        let source = SurfacePoint {
            triangle: 211,
            barycentric: [0.2, 0.3, 0.5],
        };
        let origin = mesh.point(source);
        let d = from_point(&mesh, source, f64::INFINITY);
        let worst = mesh
            .positions()
            .iter()
            .zip(&d)
            .map(|(p, d)| (d - p.distance(origin)).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-2, "{worst}");
    }

    #[test]
    fn a_side_sends_straight_fronts() {
        let mesh = plate(10);
        let side: Vec<u32> = (0..=10).collect();
        let d = from_vertices(&mesh, &side, f64::INFINITY);
        for (p, d) in mesh.positions().iter().zip(&d) {
            assert!((d - p.y).abs() < 1e-12, "{p}: {d}");
        }
    }

    #[test]
    fn nothing_is_reached_beyond_the_limit() {
        let mesh = plate(10);
        let d = from_vertices(&mesh, &[0], 0.35);
        assert!(d.iter().all(|&d| d <= 0.35 || d.is_infinite()));
        assert!(d.iter().filter(|d| d.is_finite()).count() > 5);
    }
}
