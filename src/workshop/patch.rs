//! A piece of the wall around a gauge, laid flat.
//!
//! It is unrolled from the gauge outwards (R. Schmidt, C. Grimm and B. Wyvill, "Interactive decal compositing with discrete
//! exponential maps", SIGGRAPH 2006), then every edge is given back its length as far as the others let it (stress
//! majorization, E. Gansner, Y. Koren and S. North, "Graph drawing by stress majorization", 2004): what can be laid flat
//! without stretching is.

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, DVec3};

use super::inner::Inner;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, geodesic};

/// Where the wall turns by more than this between two facets it has an edge (cosine).
const EDGE: f64 = 0.7;
/// Rounds in which edges are given back their lengths.
const ROUNDS: usize = 300;

/// A piece of the inner face in the plane, seen from inside: the gauge at the origin, the part's axis up.
pub struct Patch {
    /// m.
    pub flat: Vec<DVec2>,
    /// On the inner face (m).
    pub positions: Vec<DVec3>,
    /// Of these.
    pub triangles: Vec<[u32; 3]>,
    /// Pairs of vertices where the wall ends, or turns sharply.
    pub edges: Vec<[u32; 2]>,
    /// The most that an edge's length is off, as a share.
    pub stretch: f64,
    /// How far over the surface it goes (m).
    pub radius: f64,
    index: SurfaceIndex,
}

impl Patch {
    /// The wall within a distance over the surface (m) around a place.
    ///
    /// # Errors
    /// Where there is no wall.
    pub fn around(inner: &Inner, place: DVec3, radius: f64) -> Result<Self, String> {
        let mesh = &inner.mesh;
        let (source, _) = mesh.index().nearest(place);
        let far = geodesic::from_point(mesh, source, 1.5 * radius + 2.0 * mesh.mean_edge());
        let facets = grown(inner, source.triangle, |tri| {
            tri.iter().any(|&v| far[v as usize] <= radius)
                && tri.iter().all(|&v| far[v as usize].is_finite())
        });
        let mut number: BTreeMap<u32, u32> = BTreeMap::new();
        for &v in facets.iter().flat_map(|&t| &mesh.triangles()[t as usize]) {
            let next = number.len() as u32;
            number.entry(v).or_insert(next);
        }
        let mut of: Vec<u32> = vec![0; number.len()];
        for (&v, &k) in &number {
            of[k as usize] = v;
        }
        let triangles: Vec<[u32; 3]> = facets
            .iter()
            .map(|&t| mesh.triangles()[t as usize].map(|v| number[&v]))
            .collect();
        let positions: Vec<DVec3> = of.iter().map(|&v| mesh.positions()[v as usize]).collect();
        let distance: Vec<f64> = of.iter().map(|&v| far[v as usize]).collect();
        let frame = PatchFrame::at(inner, source);
        let pairs = pairs(&triangles);
        let normals: Vec<DVec3> = of.iter().map(|&v| mean_out(inner, v, &facets)).collect();
        let mut flat = unrolled(&frame, &positions, &normals, &distance, &pairs);
        relax(&mut flat, &positions, &pairs);
        settle(&mut flat, &frame, &positions, &triangles, &facets, source);
        let length = |&(a, b): &(u32, u32)| positions[a as usize].distance(positions[b as usize]);
        let off = |pair: &(u32, u32)| {
            let drawn = flat[pair.0 as usize].distance(flat[pair.1 as usize]);
            (drawn / length(pair) - 1.0).abs()
        };
        let stretch = pairs.keys().map(off).fold(0.0, f64::max);
        let edges = (pairs.iter())
            .filter(|(pair, count)| {
                **count == 1 && is_edge(inner, of[pair.0 as usize], of[pair.1 as usize])
            })
            .map(|(&(a, b), _)| [a, b])
            .collect();
        if triangles.is_empty() {
            return Err("there is no wall to glue a gauge to".into());
        }
        Ok(Self {
            index: SurfaceIndex::of(positions.clone(), &triangles),
            flat,
            positions,
            triangles,
            edges,
            stretch,
            radius,
        })
    }

    /// Where a point of the inner face (m) lies in the plane (m); nothing where it is not on the patch.
    #[must_use]
    pub fn lay(&self, place: DVec3) -> Option<DVec2> {
        /// What a point may be off the wall (m).
        const NEAR: f64 = 1e-3;
        let (at, off) = self.index.nearest(place);
        if off > NEAR {
            return None;
        }
        let tri = self.triangles[at.triangle as usize];
        let parts = tri.iter().zip(at.barycentric);
        Some(parts.map(|(&v, w)| self.flat[v as usize] * w).sum())
    }

    /// A direction at a point of the inner face, in the plane and of unit length.
    #[must_use]
    pub fn turn(&self, place: DVec3, direction: DVec3) -> Option<DVec2> {
        let (at, _) = self.index.nearest(place);
        let tri = self.triangles[at.triangle as usize];
        let [a, b, c] = tri.map(|v| self.positions[v as usize]);
        let [p, q, r] = tri.map(|v| self.flat[v as usize]);
        let (u, v) = (b - a, c - a);
        // The facet's own coordinates of the direction.
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let (du, dv) = (direction.dot(u), direction.dot(v));
        let det = uu * vv - uv * uv;
        let (s, t) = ((vv * du - uv * dv) / det, (uu * dv - uv * du) / det);
        ((q - p) * s + (r - p) * t).try_normalize()
    }
}

/// Where it begins: up and to the right as seen from inside.
struct PatchFrame {
    place: DVec3,
    out: DVec3,
    right: DVec3,
    up: DVec3,
}

impl PatchFrame {
    fn at(inner: &Inner, source: SurfacePoint) -> Self {
        let out = inner.out(source);
        let stance = &inner.stance;
        let along = |d: DVec3| d.reject_from_normalized(out);
        let up = along(stance.up());
        // On a floor, up is to the front.
        let up = if up.length() > 0.1 {
            up
        } else {
            along(stance.front())
        };
        let up = up.normalize_or(out.any_orthonormal_vector());
        Self {
            place: inner.mesh.point(source),
            out,
            right: out.cross(up),
            up,
        }
    }

    /// A step along the surface whose outward normal is `out`, in the plane, its length kept.
    fn flatten(&self, step: DVec3, out: DVec3) -> DVec2 {
        let turn = glam::DQuat::from_rotation_arc(out, self.out);
        let turned = turn * step.reject_from_normalized(out);
        DVec2::new(turned.dot(self.right), turned.dot(self.up)).normalize_or_zero() * step.length()
    }
}

/// Facets that hang together with one over no sharp edge, as long as they are wanted; in their order.
fn grown(inner: &Inner, from: u32, wanted: impl Fn(&[u32; 3]) -> bool) -> Vec<u32> {
    let mesh = &inner.mesh;
    let mut taken = vec![false; mesh.triangles().len()];
    taken[from as usize] = true;
    let mut open = VecDeque::from([from]);
    while let Some(t) = open.pop_front() {
        for &e in &mesh.triangle_edges()[t as usize] {
            let edge = &mesh.edges()[e as usize];
            // Walls that meet at an edge are not one piece of paper.
            for &next in edge.triangles.iter().filter(|_| edge.triangles.len() == 2) {
                let sharp = inner.facet_out(t).dot(inner.facet_out(next)) < EDGE;
                if !taken[next as usize] && !sharp && wanted(&mesh.triangles()[next as usize]) {
                    taken[next as usize] = true;
                    open.push_back(next);
                }
            }
        }
    }
    (0..taken.len() as u32)
        .filter(|&t| taken[t as usize])
        .collect()
}

/// Whether the wall ends between two vertices, or turns sharply.
fn is_edge(inner: &Inner, a: u32, b: u32) -> bool {
    let mesh = &inner.mesh;
    let triangles: Vec<u32> = (mesh.vertex_triangles()[a as usize].iter().copied())
        .filter(|&t| mesh.triangles()[t as usize].contains(&b))
        .collect();
    match triangles[..] {
        [s, t] => inner.facet_out(s).dot(inner.facet_out(t)) < EDGE,
        _ => true,
    }
}

/// Outwards at a vertex, of the facets of the patch alone.
fn mean_out(inner: &Inner, vertex: u32, facets: &[u32]) -> DVec3 {
    let mesh = &inner.mesh;
    let own = mesh.vertex_triangles()[vertex as usize].iter().copied();
    let sum: DVec3 = own
        .filter(|t| facets.binary_search(t).is_ok())
        .map(|t| inner.facet_out(t) * mesh.facet_area(t))
        .sum();
    sum.normalize_or(DVec3::Z)
}

/// Pairs of vertices with an edge, and how many triangles have it.
fn pairs(triangles: &[[u32; 3]]) -> BTreeMap<(u32, u32), u32> {
    let mut pairs = BTreeMap::new();
    for tri in triangles {
        for k in 0..3 {
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            *pairs.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    pairs
}

/// Each vertex from those that are nearer to the gauge.
fn unrolled(
    frame: &PatchFrame,
    positions: &[DVec3],
    normals: &[DVec3],
    distance: &[f64],
    pairs: &BTreeMap<(u32, u32), u32>,
) -> Vec<DVec2> {
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
    for &(a, b) in pairs.keys() {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_by(|&a, &b| {
        distance[a as usize]
            .total_cmp(&distance[b as usize])
            .then(a.cmp(&b))
    });
    let mut flat = vec![DVec2::ZERO; positions.len()];
    let mut done = vec![false; positions.len()];
    for &v in &order {
        let (p, n) = (positions[v as usize], normals[v as usize]);
        let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
        for &w in beside[v as usize].iter().filter(|w| done[**w as usize]) {
            let half = (n + normals[w as usize]).normalize_or(n);
            let step = p - positions[w as usize];
            let share = 1.0 / step.length().max(1e-12);
            sum += share * (flat[w as usize] + frame.flatten(step, half));
            weight += share;
        }
        flat[v as usize] = if weight > 0.0 {
            sum / weight
        } else {
            frame.flatten(p - frame.place, frame.out)
        };
        done[v as usize] = true;
    }
    flat
}

/// Gives edges back their lengths.
fn relax(flat: &mut [DVec2], positions: &[DVec3], pairs: &BTreeMap<(u32, u32), u32>) {
    let mut beside: Vec<Vec<(u32, f64)>> = vec![Vec::new(); flat.len()];
    for &(a, b) in pairs.keys() {
        let length = positions[a as usize].distance(positions[b as usize]);
        beside[a as usize].push((b, length));
        beside[b as usize].push((a, length));
    }
    for _ in 0..ROUNDS {
        for v in 0..flat.len() {
            let here = flat[v];
            let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
            for &(w, length) in &beside[v] {
                let there = flat[w as usize];
                let share = 1.0 / (length * length).max(1e-18);
                sum += share * (there + (here - there).normalize_or_zero() * length);
                weight += share;
            }
            if weight > 0.0 {
                flat[v] = sum / weight;
            }
        }
    }
}

/// Puts the gauge back to the origin, and up to where it was.
fn settle(
    flat: &mut [DVec2],
    frame: &PatchFrame,
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    facets: &[u32],
    source: SurfacePoint,
) {
    let Ok(own) = facets.binary_search(&source.triangle) else {
        return;
    };
    let tri = triangles[own].map(|v| v as usize);
    let middle: DVec2 = tri
        .iter()
        .zip(source.barycentric)
        .map(|(&v, w)| flat[v] * w)
        .sum();
    // The rotation that brings the facet nearest to how it lies in the frame.
    let (mut cos, mut sin) = (0.0, 0.0);
    for &v in &tri {
        let wanted = frame.flatten(positions[v] - frame.place, frame.out);
        let drawn = flat[v] - middle;
        cos += drawn.dot(wanted);
        sin += drawn.perp_dot(wanted);
    }
    let turn = DVec2::new(cos, sin).normalize_or(DVec2::X);
    for p in flat {
        *p = turn.rotate(*p - middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;
    use crate::mesh::sample;
    use crate::mesh::stance::Stance;

    /// Whether there is wall all along the straight way from the gauge, so that the shortest way is straight.
    fn in_sight(patch: &Patch, to: DVec2) -> bool {
        const STEPS: u32 = 30;
        (1..STEPS).all(|k| {
            let p = to * f64::from(k) / f64::from(STEPS);
            patch.triangles.iter().any(|tri| {
                let [a, b, c] = tri.map(|v| patch.flat[v as usize]);
                let sides = [(a, b), (b, c), (c, a)].map(|(a, b)| (b - a).perp_dot(p - a));
                sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
            })
        })
    }

    /// Distances on paper against those over the surface, by fast marching.
    fn worst(inner: &Inner, patch: &Patch, place: DVec3, radius: f64) -> f64 {
        let (source, _) = inner.mesh.index().nearest(place);
        let far = geodesic::from_point(&inner.mesh, source, radius);
        let mut worst: f64 = 0.0;
        let mut seen = 0;
        for (v, d) in far.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            let straight = patch.lay(inner.mesh.positions()[v]);
            if let Some(at) = straight.filter(|at| in_sight(patch, *at)) {
                worst = worst.max((at.length() - d).abs());
                seen += 1;
            }
        }
        assert!(seen > 20, "{seen}");
        worst
    }

    #[test]
    fn distances_on_paper_are_those_over_the_wall() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let stance = Stance::of(&mesh);
        let inner = Inner::outward(mesh, stance, Vec::new());
        for (k, at) in sample::random(&inner.mesh, 12, 5, |_| true)
            .into_iter()
            .enumerate()
        {
            let place = inner.mesh.point(at);
            let patch = Patch::around(&inner, place, 15e-3).unwrap();
            let off = crate::units::mm(worst(&inner, &patch, place, 12e-3));
            assert!(off < 0.3, "{k}: {off} mm");
            assert!(patch.stretch < 0.02, "{k}: {}", patch.stretch);
            assert!(patch.lay(place).unwrap().length() < 0.05e-3);
            // Up stays up, and right is right as seen from inside.
            let up = patch.turn(place, inner.stance.up()).unwrap();
            assert!((up - DVec2::Y).length() < 0.05, "{up}");
            let right = inner.out(at).cross(inner.stance.up());
            let right = patch.turn(place, right).unwrap();
            assert!((right - DVec2::X).length() < 0.05, "{right}");
        }
    }
}
