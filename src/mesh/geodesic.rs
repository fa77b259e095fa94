//! Distances over the surface, by fast marching.
//!
//! R. Kimmel and J. Sethian, "Computing geodesic paths on manifolds", PNAS 95 (1998). For a point
//! source the wave over a triangle is taken as circular instead of straight, around the source or around
//! the vertex that the way bends at last (the pseudo-sources of J. Mitchell, D. Mount and
//! C. Papadimitriou, SIAM J. Comput. 16, 1987): exact in a plane, slots included, but for the border of
//! their shadow.

mod wave;

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use crate::budget::{Cancelled, Watch, report};

use self::wave::{Help, Unfolded};
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
    March::over(mesh).distances(mesh, source, limit)
}

/// Distance from the nearest of some vertices to every vertex within `limit` (m); infinity beyond.
#[must_use]
pub fn from_vertices(mesh: &TriMesh, sources: &[u32], limit: f64) -> Vec<f64> {
    March::over(mesh).from_set(sources, limit)
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
    let march = March::over(mesh);
    let rows: Result<Vec<Vec<f64>>, Cancelled> = points
        .par_iter()
        .enumerate()
        .map(|(k, &source)| {
            report(watch, "Distances over the surface", k, points.len())?;
            let field = march.circles(mesh, source, f64::INFINITY);
            Ok(points
                .iter()
                .map(|&target| field.at(mesh, source, target))
                .collect())
        })
        .collect();
    Ok(rows?.concat())
}

/// Where a wave has come.
#[derive(Default)]
struct Waves {
    /// One value a vertex (m); infinite where it has not come.
    distance: Vec<f64>,
    /// The vertex around which the way to each vertex bends last; none where it is straight.
    bend: Vec<Option<u32>>,
}

impl Waves {
    /// What both ways have gone before they bend, if they bend at the same vertex: the circles are around
    /// that one.
    fn before(&self, a: u32, b: u32) -> f64 {
        match (self.bend[a as usize], self.bend[b as usize]) {
            (Some(one), Some(two)) if one == two => self.distance[one as usize],
            _ => 0.0,
        }
    }

    /// The distance of one point from the source: as a vertex of its own would get it from the sides of
    /// its triangle.
    fn at(&self, mesh: &TriMesh, source: SurfacePoint, target: SurfacePoint) -> f64 {
        let here = mesh.point(target);
        if source.triangle == target.triangle {
            return here.distance(mesh.point(source));
        }
        let corners = mesh.triangles()[target.triangle as usize];
        let p = corners.map(|v| mesh.positions()[v as usize]);
        let d = corners.map(|v| self.distance[v as usize]);
        let along = (0..3).map(|k| d[k] + here.distance(p[k]));
        let across = (0..3).filter_map(|k| {
            let l = (k + 1) % 3;
            let triangle = Unfolded::new(p[k], p[l], here);
            let before = self.before(corners[k], corners[l]);
            triangle
                .circular(d[k] - before, d[l] - before)
                .map(|d| d + before)
        });
        along.chain(across).fold(f64::INFINITY, f64::min)
    }
}

#[derive(PartialEq)]
struct QueueEntry {
    distance: f64,
    vertex: u32,
}
impl Eq for QueueEntry {}
impl Ord for QueueEntry {
    // Reversed, so that the heap gives the nearest first; ties by index keep the order fixed.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .distance
            .total_cmp(&self.distance)
            .then(other.vertex.cmp(&self.vertex))
    }
}
impl PartialOrd for QueueEntry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The corners around a point and how far they are.
fn seeds(mesh: &TriMesh, source: SurfacePoint) -> [(u32, f64); 3] {
    let origin = mesh.point(source);
    let corners = mesh.triangles()[source.triangle as usize];
    corners.map(|v| (v, origin.distance(mesh.positions()[v as usize])))
}

/// What a march needs to remember, kept between marches that stay small.
#[derive(Default)]
pub struct MarchScratch {
    waves: Waves,
    settled: Vec<bool>,
    /// Vertices that hold anything of the last march.
    reached: Vec<u32>,
}

impl MarchScratch {
    fn fit(&mut self, vertices: usize) {
        self.waves.distance.resize(vertices, f64::INFINITY);
        self.waves.bend.resize(vertices, None);
        self.settled.resize(vertices, false);
    }

    fn reach(&mut self, vertex: u32, distance: f64, bend: Option<u32>) {
        let v = vertex as usize;
        if self.waves.distance[v].is_infinite() {
            self.reached.push(vertex);
        }
        self.waves.distance[v] = distance;
        self.waves.bend[v] = bend;
    }

    fn clear(&mut self) {
        for v in self.reached.drain(..) {
            self.waves.distance[v as usize] = f64::INFINITY;
            self.waves.bend[v as usize] = None;
            self.settled[v as usize] = false;
        }
    }
}

/// How waves go over one mesh: made once, for many sources.
pub struct March {
    helps: Vec<Vec<Help>>,
    /// Vertices that a shortest way may bend around: at a rim, or with more than a full turn around them.
    bends: Vec<bool>,
}

impl March {
    /// Prepares distances over this mesh.
    #[must_use]
    pub fn over(mesh: &TriMesh) -> Self {
        Self {
            helps: wave::helps(mesh),
            bends: wave::bends(mesh),
        }
    }

    /// As [`from_point`], on the mesh it was made for.
    #[must_use]
    pub fn distances(&self, mesh: &TriMesh, source: SurfacePoint, limit: f64) -> Vec<f64> {
        self.circles(mesh, source, limit).distance
    }

    /// As [`from_vertices`], on the mesh it was made for.
    #[must_use]
    pub fn from_set(&self, sources: &[u32], limit: f64) -> Vec<f64> {
        let seeds: Vec<(u32, f64)> = sources.iter().map(|&v| (v, 0.0)).collect();
        self.run(&seeds, limit, Front::Straight).distance
    }

    /// From one point.
    fn circles(&self, mesh: &TriMesh, source: SurfacePoint, limit: f64) -> Waves {
        self.run(&seeds(mesh, source), limit, Front::Circular)
    }

    /// Vertices within `limit` of a point, with their distances (m), in no particular order: as
    /// [`Self::distances`], but whatever lies farther away costs nothing.
    #[must_use]
    pub fn near(
        &self,
        mesh: &TriMesh,
        source: SurfacePoint,
        limit: f64,
        scratch: &mut MarchScratch,
    ) -> Vec<(u32, f64)> {
        scratch.fit(self.helps.len());
        self.march(scratch, &seeds(mesh, source), limit, Front::Circular);
        let settled = (scratch.reached.iter()).filter(|&&v| scratch.settled[v as usize]);
        let near = settled
            .map(|&v| (v, scratch.waves.distance[v as usize]))
            .collect();
        scratch.clear();
        near
    }

    fn run(&self, seeds: &[(u32, f64)], limit: f64, front: Front) -> Waves {
        let mut scratch = MarchScratch::default();
        scratch.fit(self.helps.len());
        self.march(&mut scratch, seeds, limit, front);
        let MarchScratch {
            mut waves, settled, ..
        } = scratch;
        for (d, done) in waves.distance.iter_mut().zip(&settled) {
            if !done {
                *d = f64::INFINITY;
            }
        }
        waves
    }

    fn march(&self, scratch: &mut MarchScratch, seeds: &[(u32, f64)], limit: f64, front: Front) {
        /// Less than this share is no shorter way.
        const SHORTER: f64 = 1e-9;
        let mut heap = BinaryHeap::new();
        for &(vertex, distance) in seeds {
            if distance < scratch.waves.distance[vertex as usize] {
                scratch.reach(vertex, distance, None);
                heap.push(QueueEntry { distance, vertex });
            }
        }
        while let Some(QueueEntry { distance, vertex }) = heap.pop() {
            if scratch.settled[vertex as usize] || distance > limit {
                continue;
            }
            scratch.settled[vertex as usize] = true;
            for help in &self.helps[vertex as usize] {
                let other = scratch.settled[help.other as usize].then_some(help.other);
                let (reach, bend) = self.reach(&scratch.waves, front, vertex, help, other);
                // Also what was settled: near the source a wave may come late through one triangle.
                let target = help.target as usize;
                if reach < scratch.waves.distance[target] * (1.0 - SHORTER) && reach <= limit {
                    scratch.reach(help.target, reach, bend);
                    scratch.settled[target] = false;
                    heap.push(QueueEntry {
                        distance: reach,
                        vertex: help.target,
                    });
                }
            }
        }
    }

    /// The shortest way to what is helped: between the two that help, or straight from the first. Also the
    /// vertex around which it bends last.
    fn reach(
        &self,
        waves: &Waves,
        front: Front,
        vertex: u32,
        help: &Help,
        other: Option<u32>,
    ) -> (f64, Option<u32>) {
        let own = waves.distance[vertex as usize];
        let bend = if self.bends[vertex as usize] {
            Some(vertex)
        } else {
            waves.bend[vertex as usize]
        };
        let straight = (own + help.straight, bend);
        let Some(second) = other else {
            return straight;
        };
        let theirs = waves.distance[second as usize];
        let before = waves.before(vertex, second);
        let circle = match front {
            Front::Circular => help.triangle.circular(own - before, theirs - before),
            Front::Straight => None,
        };
        let across = circle
            .map(|d| d + before)
            .or_else(|| help.triangle.straight(own, theirs));
        match across {
            Some(d) if d < straight.0 => {
                let both = waves.bend[vertex as usize];
                (d, both.filter(|_| both == waves.bend[second as usize]))
            }
            _ => straight,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

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

    /// A coarse uneven sheet in the plane, 1 × 0.5, some of it cut away: cells three times as long as wide,
    /// their corners pushed about so that many triangles are obtuse.
    fn rough(keep: impl Fn(usize, usize) -> bool) -> TriMesh {
        let (columns, rows) = (16, 24);
        let push = |k: usize| 0.7 * ((k as f64 * 0.618_034).fract() - 0.5);
        let p: Vec<DVec3> = (0..=rows)
            .flat_map(|j| {
                (0..=columns).map(move |i| {
                    let inner = |k: usize, n: usize| f64::from(u8::from(k > 0 && k < n));
                    let k = j * (columns + 1) + i;
                    // The walls of a slot between columns 8 and 9 are straight.
                    let x_free = inner(i, columns) * f64::from(u8::from(i != 8 && i != 9));
                    let x = i as f64 + x_free * push(7 * k + 1);
                    let y = j as f64 + inner(j, rows) * push(13 * k + 5);
                    DVec3::new(x / columns as f64, 0.5 * y / rows as f64, 0.0)
                })
            })
            .collect();
        let at = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
        let mut t = Vec::new();
        for j in 0..rows {
            for i in (0..columns).filter(|&i| keep(i, j)) {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                t.push([a, b, c]);
                t.push([a, c, d]);
            }
        }
        TriMesh::new(&p, &t, 0).unwrap().0
    }

    /// Largest error of distances from a point over their true length, where that is above a tenth.
    fn worst(mesh: &TriMesh, source: SurfacePoint, truth: impl Fn(DVec3, DVec3) -> f64) -> f64 {
        let origin = mesh.point(source);
        let d = from_point(mesh, source, f64::INFINITY);
        (mesh.positions().iter().zip(&d))
            .map(|(&p, d)| (truth(origin, p), d))
            .filter(|(t, _)| *t > 0.1)
            .map(|(t, d)| (d / t - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn obtuse_and_coarse_triangles_do_not_lengthen_the_way() {
        let mesh = rough(|_, _| true);
        for triangle in [0, 100, 333, 700] {
            let source = SurfacePoint {
                triangle,
                barycentric: [0.2, 0.3, 0.5],
            };
            let off = worst(&mesh, source, DVec3::distance);
            assert!(off < 1e-6, "triangle {triangle}: {off}");
        }
    }

    #[test]
    fn ways_lead_around_the_end_of_a_slot() {
        // A slot in the middle, open below, up to three quarters of the height.
        let mesh = rough(|i, j| i != 8 || j >= 18);
        let tips: Vec<DVec3> = [18 * 17 + 8, 18 * 17 + 9]
            .map(|v: usize| rough(|_, _| true).positions()[v])
            .to_vec();
        let truth = |a: DVec3, b: DVec3| {
            let (left, right) = (tips[0], tips[1]);
            let crosses = |y: f64| y < left.y.min(right.y);
            // Only what lies well below the tips on the other side is hidden for certain.
            if a.x < left.x && b.x > right.x && crosses(b.y - 0.05) {
                let straight = |from: DVec3, to: DVec3| from.distance(to);
                straight(a, left) + straight(left, right) + straight(right, b)
            } else {
                0.0
            }
        };
        let source = SurfacePoint {
            triangle: 2 * (15 * 3 + 5),
            barycentric: [0.2, 0.3, 0.5],
        };
        let off = worst(&mesh, source, truth);
        assert!(off > 0.0 && off < 0.01, "{off}");
    }
}
