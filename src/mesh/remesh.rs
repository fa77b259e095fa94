//! A new mesh on the same surface, with the element size asked for at every place.
//!
//! M. Botsch and L. Kobbelt, "A remeshing approach to multiresolution modeling" (SGP 2004): split long
//! edges, collapse short ones, turn edges towards equal angles, move vertices along the surface; with a
//! size that varies over the surface and with feature lines kept.

mod flip;
mod working;

use std::collections::HashSet;
use std::sync::Arc;

use glam::DVec3;

use super::surface::{Mobility, Surface};
use super::{SurfacePoint, TriMesh};
use flip::flip;
use working::{Working, key};

const ROUNDS: usize = 8;
/// Edges longer than this times the wanted size are split, shorter than that collapsed.
const LONG: f64 = 4.0 / 3.0;
const SHORT: f64 = 4.0 / 5.0;
/// An edge may leave a feature line, and the surface, by this share of its length: about seven edges
/// round a circle, at least.
const SAGITTA: f64 = 0.11;
/// Steps of the queues of edges: lengths over what is wanted that differ by less are the same but for rounding.
const STEP: f64 = 1e-5;
/// Details smaller than this share of the wanted size are given up, feature lines among them.
const TINY: f64 = 0.2;

/// A mesh laid on a surface.
#[derive(Clone, Debug)]
pub struct Remeshed {
    /// The mesh (m).
    pub mesh: Arc<TriMesh>,
    /// Where on the part each vertex lies.
    pub places: Vec<SurfacePoint>,
    /// Edges on feature lines, smaller vertex first.
    pub lines: HashSet<(u32, u32)>,
}

impl Remeshed {
    /// The same mesh with its vertices elsewhere, such as in another frame.
    #[must_use]
    pub fn moved(&self, to: impl Fn(DVec3) -> DVec3) -> Self {
        let positions = self.mesh.positions().iter().map(|&p| to(p)).collect();
        let triangles = self.mesh.triangles().to_vec();
        Self {
            mesh: Arc::new(TriMesh::from_checked(positions, triangles)),
            places: self.places.clone(),
            lines: self.lines.clone(),
        }
    }
}

/// Lays a mesh of the given size (m, at a position) on the surface.
#[must_use]
pub fn remesh(surface: &Surface, size: &dyn Fn(DVec3) -> f64) -> Remeshed {
    let mut work = Working::new(surface, size);
    for round in 0..ROUNDS {
        split_long(&mut work, size);
        flip(&mut work);
        collapse_short(&mut work);
        flip(&mut work);
        smooth(&mut work, size, round);
    }
    flip(&mut work);
    remove_flat(&mut work);
    if work.triangles.iter().all(|&t| Working::is_nothing(t)) {
        return as_given(surface);
    }
    let (mesh, places, lines) = work.finish();
    Remeshed {
        mesh: Arc::new(mesh),
        places,
        lines,
    }
}

/// The part's own triangles as the mesh.
#[must_use]
pub fn as_given(surface: &Surface) -> Remeshed {
    let mesh = &surface.mesh;
    let lines = mesh.edges().iter().zip(&surface.features);
    Remeshed {
        mesh: Arc::clone(mesh),
        places: (0..mesh.positions().len() as u32)
            .filter_map(|v| surface.vertex(v))
            .collect(),
        lines: lines
            .filter(|(_, f)| **f)
            .map(|(e, _)| (e.a, e.b))
            .collect(),
    }
}

/// Splits every triangle into four, the new vertices on the smooth surface or the feature line.
#[must_use]
pub fn quarter(surface: &Surface, coarse: &Remeshed) -> Remeshed {
    let mesh = &coarse.mesh;
    let old = mesh.positions().len() as u32;
    let mut positions = mesh.positions().to_vec();
    let mut places = coarse.places.clone();
    let mut lines = HashSet::with_capacity(2 * coarse.lines.len());
    for (number, edge) in (old..).zip(mesh.edges()) {
        let [a, b] = [edge.a, edge.b].map(|v| mesh.positions()[v as usize]);
        let line = coarse.lines.contains(&(edge.a, edge.b));
        let (position, at) = middle_on(surface, a, b, line);
        positions.push(position);
        places.push(at);
        if line {
            lines.extend([key(edge.a, number), key(edge.b, number)]);
        }
    }
    settle_middles(mesh, &mut positions);
    let triangles = mesh
        .triangles()
        .iter()
        .zip(mesh.triangle_edges())
        .flat_map(|(tri, opposite)| quarters(tri, opposite, old))
        .collect();
    Remeshed {
        mesh: Arc::new(TriMesh::from_checked(positions, triangles)),
        places,
        lines,
    }
}

/// The four triangles of a split one; middles of edges are numbered from `old` on.
fn quarters(&[a, b, c]: &[u32; 3], opposite: &[u32; 3], old: u32) -> [[u32; 3]; 4] {
    let [bc, ca, ab] = opposite.map(|e| old + e);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Puts middles back onto their edges wherever moving them to the surface turned a triangle over.
fn settle_middles(mesh: &TriMesh, positions: &mut [DVec3]) {
    const ROUNDS: usize = 4;
    let old = mesh.positions().len() as u32;
    for _ in 0..ROUNDS {
        let mut moved = false;
        for (t, (tri, opposite)) in (0..).zip(mesh.triangles().iter().zip(mesh.triangle_edges())) {
            let (normal, area) = (mesh.facet_normal(t), mesh.facet_area(t));
            let sound = quarters(tri, opposite, old).iter().all(|part| {
                let [a, b, c] = part.map(|v| positions[v as usize]);
                (b - a).cross(c - a).dot(normal) > 0.1 * area
            });
            if sound {
                continue;
            }
            for &e in opposite {
                let edge = &mesh.edges()[e as usize];
                let ends = [edge.a, edge.b].map(|v| mesh.positions()[v as usize]);
                let middle = ends[0].midpoint(ends[1]);
                moved |= positions[(old + e) as usize] != middle;
                positions[(old + e) as usize] = middle;
            }
        }
        if !moved {
            return;
        }
    }
}

/// The middle of an edge, moved onto the smooth surface or the feature line where that is near.
fn middle_on(surface: &Surface, a: DVec3, b: DVec3, line: bool) -> (DVec3, SurfacePoint) {
    /// How far that may be, as a share of the edge. Large elements cut off rounded corners of openings: over a quarter
    /// of a circle a chord is 0.207 from its arc. Were that not given back, coarse and fine elements would share the
    /// fault, and what changes between them would say nothing of it.
    const NEAR_SURFACE: f64 = 0.2;
    const NEAR_LINE: f64 = 0.4;
    let middle = a.midpoint(b);
    let at = if line {
        surface.project_to_line(middle)
    } else {
        None
    }
    .unwrap_or_else(|| surface.project(middle));
    let placed = surface.place(at);
    let near = if line { NEAR_LINE } else { NEAR_SURFACE };
    if placed.distance(middle) < near * a.distance(b) {
        (placed, at)
    } else {
        (middle, at)
    }
}

/// Takes out what has no height to speak of and that nothing before could better: needles are drawn
/// together along their short edge, caps give their long edge to their apex, whatever line it was on.
fn remove_flat(work: &mut Working) {
    const FLAT: f64 = 0.01;
    const PASSES: usize = 5;
    for _ in 0..PASSES {
        let mut changed = false;
        for t in 0..work.triangles.len() as u32 {
            if work.is_gone(t) || thinness(work, t, u32::MAX, DVec3::ZERO) > FLAT {
                continue;
            }
            let tri = work.triangles[t as usize];
            let side = |i: usize| work.length(tri[i], tri[(i + 1) % 3]);
            let by = |i: &usize, j: &usize| side(*i).total_cmp(&side(*j));
            let short = (0..3).min_by(by).unwrap_or(0);
            let long = (0..3).max_by(by).unwrap_or(0);
            changed |= if side(short) < 0.1 * side(long) {
                collapse_anyhow(work, tri[short], tri[(short + 1) % 3])
            } else {
                give_to_apex(work, t, tri[long], tri[(long + 1) % 3], tri[(long + 2) % 3])
            };
        }
        if !changed {
            return;
        }
    }
}

fn collapse_anyhow(work: &mut Working, a: u32, b: u32) -> bool {
    let rank = |v: u32| work.vertices[v as usize].mobility;
    let (gone, kept) = if rank(a) > rank(b) { (b, a) } else { (a, b) };
    let joins = work.links(gone, kept);
    if joins {
        work.collapse(gone, kept);
    }
    joins
}

/// The edge a–b of a flat triangle whose apex lies on it: the apex takes its place.
fn give_to_apex(work: &mut Working, t: u32, a: u32, b: u32, apex: u32) -> bool {
    let on: Vec<u32> = work.on_edge(a, b).collect();
    let line = work.is_line(a, b);
    match on[..] {
        [_] => work.drop_triangle(t),
        [s, u] => {
            let other = if s == t { u } else { s };
            let across = work.triangles[other as usize]
                .into_iter()
                .find(|&v| v != a && v != b);
            let Some(d) = across.filter(|&d| d != apex && !work.is_edge(apex, d)) else {
                return false;
            };
            work.flip(a, b, [t, other], [apex, d]);
        }
        _ => return false,
    }
    if line {
        work.lines.remove(&key(a, b));
        work.lines.extend([key(a, apex), key(apex, b)]);
        work.vertices[apex as usize].mobility = Mobility::Fixed;
    }
    true
}

fn split_long(work: &mut Working, size: &dyn Fn(DVec3) -> f64) {
    /// Doublings of the number of vertices in one round: far more than any size needs twice.
    const PASSES: usize = 12;
    for _ in 0..PASSES {
        let mut long: Vec<(f64, u32, u32)> = work
            .edges()
            .into_iter()
            .filter_map(|(a, b)| {
                let excess = work.length(a, b) / work.wanted(a, b);
                (excess > LONG).then_some((stepped(excess), a, b))
            })
            .collect();
        if long.is_empty() {
            return;
        }
        long.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        for (_, a, b) in long {
            work.split(a, b, size);
        }
    }
}

/// The step that an edge's length over what is wanted stands on: edges of one step come by their vertices.
fn stepped(excess: f64) -> f64 {
    (excess / STEP).round()
}

fn collapse_short(work: &mut Working) {
    let mut short: Vec<(f64, u32, u32)> = work
        .edges()
        .into_iter()
        .filter_map(|(a, b)| {
            let excess = work.length(a, b) / work.wanted(a, b);
            (excess < SHORT).then_some((stepped(excess), a, b))
        })
        .collect();
    short.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (_, a, b) in short {
        // Earlier collapses may have taken the edge, or made it long enough.
        let there = work.is_edge(a, b);
        if !there || work.length(a, b) >= SHORT * work.wanted(a, b) {
            continue;
        }
        let rank = |v: u32| work.vertices[v as usize].mobility;
        let order = if rank(a) > rank(b) {
            [(b, a), (a, b)]
        } else {
            [(a, b), (b, a)]
        };
        let tiny = work.length(a, b) < TINY * work.wanted(a, b);
        for (gone, kept) in order {
            if work.may_collapse(gone, kept, tiny) && keeps_shape(work, gone, kept, tiny) {
                work.collapse(gone, kept);
                break;
            }
        }
    }
}

/// Whether drawing `gone` into `kept` turns no triangle over, makes no edge too long and stays near the
/// surface.
fn keeps_shape(work: &Working, gone: u32, kept: u32, tiny: bool) -> bool {
    let to = work.position(kept);
    let detail = TINY * work.wanted(gone, kept);
    let slack = if tiny { detail } else { 0.0 };
    for &t in &work.around[gone as usize] {
        if work.triangles[t as usize].contains(&kept) {
            continue;
        }
        let (old, new) = (work.normal(t), work.normal_with(t, gone, to));
        let thin = thinness(work, t, u32::MAX, DVec3::ZERO);
        // A sliver's normal says little.
        let speck = tiny && (thin < 0.05 || old.length() < detail * detail);
        if !speck && old.dot(new) <= 0.7 * old.length() * new.length() {
            return false;
        }
        if thinness(work, t, gone, to) < 0.02_f64.min(thin) {
            return false;
        }
    }
    work.neighbours(gone)
        .into_iter()
        .filter(|&v| v != kept)
        .all(|v| {
            let length = work.length(v, kept);
            let line = work.is_line(gone, v);
            if length > LONG * work.wanted(v, kept) {
                return false;
            }
            let middle = work.position(v).midpoint(to);
            let at = if line {
                work.surface.project_to_line(middle)
            } else {
                None
            }
            .unwrap_or_else(|| work.surface.project(middle));
            work.surface.mesh.point(at).distance(middle) <= slack.max(SAGITTA * length)
        })
}

/// Twice the area over the squared longest side of a triangle with one vertex moved: 0.87 at best.
fn thinness(work: &Working, t: u32, moved: u32, to: DVec3) -> f64 {
    let p = work.triangles[t as usize].map(|v| if v == moved { to } else { work.position(v) });
    let longest = (0..3)
        .map(|i| p[i].distance_squared(p[(i + 1) % 3]))
        .fold(0.0, f64::max);
    (p[1] - p[0]).cross(p[2] - p[0]).length() / longest.max(f64::MIN_POSITIVE)
}

/// Moves vertices along the surface towards the middle of what surrounds them.
fn smooth(work: &mut Working, size: &dyn Fn(DVec3) -> f64, round: usize) {
    for v in 0..work.vertices.len() as u32 {
        if work.around[v as usize].is_empty() {
            continue;
        }
        let target = match work.vertices[v as usize].mobility {
            Mobility::Fixed => None,
            Mobility::Free => free_target(work, v),
            Mobility::Line => line_target(work, v),
        };
        if let Some((position, at)) = target
            && turns_nothing_over(work, v, position)
        {
            let vertex = &mut work.vertices[v as usize];
            (vertex.position, vertex.at) = (position, at);
            if round + 1 < ROUNDS {
                vertex.size = size(position);
            }
        }
    }
}

fn free_target(work: &Working, v: u32) -> Option<(DVec3, SurfacePoint)> {
    let here = work.position(v);
    let (mut sum, mut weights, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
    for &t in &work.around[v as usize] {
        let tri = work.triangles[t as usize];
        let n = work.normal(t);
        let size: f64 = tri.iter().map(|&w| work.vertices[w as usize].size).sum();
        // Area over the area wanted: graded meshes keep their grading.
        let weight = n.length() / (size * size);
        let centre: DVec3 = tri.iter().map(|&w| work.position(w)).sum::<DVec3>() / 3.0;
        sum += centre * weight;
        weights += weight;
        normal += n;
    }
    let normal = normal.try_normalize()?;
    let step = sum / weights - here;
    let target = here + step - normal * normal.dot(step);
    let at = work.surface.project(target);
    let placed = work.surface.place(at);
    let near = placed.distance(target) < 0.3 * work.vertices[v as usize].size;
    let same_wall = work.surface.mesh.facet_normal(at.triangle).dot(normal) > 0.5;
    (placed.is_finite() && near && same_wall).then_some((placed, at))
}

fn line_target(work: &Working, v: u32) -> Option<(DVec3, SurfacePoint)> {
    let ends: Vec<u32> = work
        .neighbours(v)
        .into_iter()
        .filter(|&w| work.is_line(v, w))
        .collect();
    let [a, b] = ends[..] else { return None };
    let here = work.position(v);
    let (p, q) = (work.position(a), work.position(b));
    let (hp, hq) = (work.wanted(v, a), work.wanted(v, b));
    // Distances in proportion to the sizes wanted on either side.
    let target = (p * hq + q * hp) / (hp + hq);
    let at = work.surface.project_to_line(here.midpoint(target))?;
    let placed = work.surface.mesh.point(at);
    (placed.distance(target) < 0.5 * p.distance(q)).then_some((placed, at))
}

fn turns_nothing_over(work: &Working, v: u32, to: DVec3) -> bool {
    work.around[v as usize].iter().all(|&t| {
        let (old, new) = (work.normal(t), work.normal_with(t, v, to));
        new.dot(old) > 0.5 * new.length() * old.length()
            && thinness(work, t, v, to)
                > 0.05_f64.min(0.9 * thinness(work, t, u32::MAX, DVec3::ZERO))
    })
}
