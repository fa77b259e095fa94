//! What may be done to a mesh on its way in, each step only when asked for and each counted.

use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

use super::numbers::NumberMap;
use super::report::RepairReport;
use crate::bounds::Bounds;

/// Repairs that are asked for; without them only what must be is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repair {
    /// Vertices nearer to each other than this are joined (m); zero joins only those that rounding has parted.
    pub weld: f64,
    /// Holes up to this far across are filled (m).
    pub fill_holes: f64,
    /// The farthest that the node of an edge may be moved where a bent edge turns a tetrahedron inside out (m).
    pub straighten: f64,
    /// Edges longer than this are halved (m); zero: where triangles are large beside the part.
    pub halve: f64,
}

impl Default for Repair {
    fn default() -> Self {
        Self {
            weld: 0.0,
            fill_holes: 0.0,
            straighten: f64::INFINITY,
            halve: f64::INFINITY,
        }
    }
}

/// For each point the first of the points kept that it is joined with, and those kept. Points within
/// `tolerance` of a kept one join it.
pub(super) fn join_near(positions: &[DVec3], tolerance: f64) -> (Vec<u32>, Vec<DVec3>) {
    let bounds = Bounds::around(positions.iter().copied());
    let lower = bounds.lower;
    // Never so fine that cells far apart become one number.
    let size = tolerance.max(1e-15 * bounds.size().max_element());
    let cell = |p: DVec3| ((p - lower) / size).floor().as_i64vec3();
    let mut grid: NumberMap<I64Vec3, Vec<u32>> = NumberMap::default();
    let mut kept: Vec<DVec3> = Vec::new();
    let renumber = positions
        .iter()
        .map(|&p| {
            let home = cell(p);
            let near = (0..27)
                .flat_map(|k| {
                    let step = I64Vec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
                    grid.get(&home.wrapping_add(step)).into_iter().flatten()
                })
                .copied()
                .filter(|&v| kept[v as usize].distance(p) <= tolerance)
                .min();
            near.unwrap_or_else(|| {
                let v = kept.len() as u32;
                kept.push(p);
                grid.entry(home).or_default().push(v);
                v
            })
        })
        .collect();
    (renumber, kept)
}

/// Open sides of a surface that lie along each other without being joined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tear {
    /// Vertices within so much (m) of each other would have to be joined.
    pub within: f64,
    /// How many sides lie so.
    pub sides: usize,
    /// Whether the surface closes then.
    pub closes: bool,
}

/// Where an open surface is torn: its open sides would be edges if vertices within a thousandth of its middle edge were
/// joined; nothing where none would. (The mean edge of a mesh with one vertex far away is longer than the part.)
pub(super) fn torn(positions: &[DVec3], triangles: &[[u32; 3]]) -> Option<Tear> {
    /// Of the middle edge.
    const NEAR: f64 = 1e-3;
    let within = one_digit(NEAR * middle_edge(positions, triangles)?);
    let open = open_sides(triangles);
    let vertices = ends_of(&open);
    let points: Vec<DVec3> = vertices.iter().map(|&v| positions[v as usize]).collect();
    let (joined, kept) = join_near(&points, within);
    if kept.len() == points.len() {
        return None;
    }
    let number = |v: u32| joined[vertices.partition_point(|&other| other < v)];
    let mut sides: NumberMap<(u32, u32), u32> = NumberMap::default();
    for [a, b] in open.into_iter().map(|side| side.map(number)) {
        if a != b {
            *sides.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let pairs = sides.values().filter(|&&count| count == 2).count();
    (pairs > 0).then_some(Tear {
        within,
        sides: 2 * pairs,
        closes: pairs == sides.len(),
    })
}

/// Joins vertices of open sides that rounding has parted, as where a circle that ends where it began has 2 sin π for
/// another zero: nobody tears a wall by a ten millionth of an edge. `numbers` are those of the points that the file's
/// vertices became. How many were joined; none where a triangle would be lost by it.
pub(super) fn join_rounded(
    positions: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
    numbers: &mut [u32],
) -> usize {
    const ROUNDING: f64 = 1e-7;
    let vertices = ends_of(&open_sides(triangles));
    let Some(edge) = middle_edge(positions, triangles).filter(|_| !vertices.is_empty()) else {
        return 0;
    };
    let points: Vec<DVec3> = vertices.iter().map(|&v| positions[v as usize]).collect();
    let (joined, kept) = join_near(&points, ROUNDING * edge);
    // The first of those that are joined stands for all.
    let mut first = vec![u32::MAX; kept.len()];
    for (&vertex, &point) in vertices.iter().zip(&joined) {
        let first = &mut first[point as usize];
        *first = (*first).min(vertex);
    }
    let stands_for = |v: u32| match vertices.binary_search(&v) {
        Ok(place) => first[joined[place] as usize],
        Err(_) => v,
    };
    let whole: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(stands_for)).collect();
    let is_lost = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
    if kept.len() == points.len() || whole.iter().any(is_lost) {
        return 0;
    }
    *triangles = whole;
    for number in numbers {
        *number = stands_for(*number);
    }
    points.len() - kept.len()
}

/// The vertices of some sides, each once, rising.
fn ends_of(sides: &[[u32; 2]]) -> Vec<u32> {
    let mut vertices: Vec<u32> = sides.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The median length of the triangles' sides; nothing where that is no length.
fn middle_edge(positions: &[DVec3], triangles: &[[u32; 3]]) -> Option<f64> {
    let side = |tri: &[u32; 3], i: usize| {
        let [a, b] = [tri[i], tri[(i + 1) % 3]].map(|v| positions[v as usize]);
        a.distance(b)
    };
    let mut lengths: Vec<f64> = triangles
        .iter()
        .flat_map(|tri| (0..3).map(move |i| side(tri, i)))
        .collect();
    let middle = lengths.len() / 2;
    (!lengths.is_empty())
        .then(|| *lengths.select_nth_unstable_by(middle, f64::total_cmp).1)
        .filter(|length| length.is_finite() && *length > 0.0)
}

/// A positive number with its first digit only.
fn one_digit(x: f64) -> f64 {
    let unit = 10f64.powf(x.log10().floor());
    // A digit that rounding has put a hair below itself is still that digit.
    (x / unit * (1.0 + 1e-9)).floor() * unit
}

/// Sides with a triangle on one side only, as that triangle runs along them.
fn open_sides(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides_of = |tri: &[u32; 3]| {
        let tri = *tri;
        (0..3).map(move |i| [tri[i], tri[(i + 1) % 3]])
    };
    let ends = |[a, b]: [u32; 2]| (a.min(b), a.max(b));
    let mut counts: NumberMap<(u32, u32), u32> = NumberMap::default();
    for side in triangles.iter().flat_map(sides_of) {
        *counts.entry(ends(side)).or_default() += 1;
    }
    triangles
        .iter()
        .flat_map(sides_of)
        .filter(|&side| counts[&ends(side)] == 1)
        .collect()
}

/// Whether the height of a triangle is below 1e-10 of its longest side: relative, so that it does not depend on the
/// unit.
pub(super) fn has_no_area(positions: &[DVec3], tri: [u32; 3]) -> bool {
    let [a, b, c] = tri.map(|v| positions[v as usize]);
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    (b - a).cross(c - a).length() <= 1e-10 * longest
}

/// Fills the holes that are asked for.
pub(super) fn fill_holes(
    positions: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    repair: &Repair,
    report: &mut RepairReport,
) {
    if repair.fill_holes <= 0.0 {
        return;
    }
    for rim in holes(positions, triangles, repair.fill_holes) {
        let before = positions.len();
        let filling = fill(positions, &rim).unwrap_or_else(|| fan(positions, &rim));
        // A seam of points in a line has no area to fill: it stays open, as what is said of open edges tells.
        if filling.iter().any(|&tri| has_no_area(positions, tri)) {
            positions.truncate(before);
            continue;
        }
        triangles.extend(filling);
        report.filled_holes += 1;
    }
}

/// A filling for rims that are too long for the best one: a fan round a new vertex in the middle.
fn fan(positions: &mut Vec<DVec3>, rim: &[u32]) -> Vec<[u32; 3]> {
    let middle = rim.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / rim.len() as f64;
    let centre = positions.len() as u32;
    positions.push(middle);
    (0..rim.len())
        .map(|i| [rim[i], rim[(i + 1) % rim.len()], centre])
        .collect()
}

/// Rims of holes no further across than `across` (m): closed lines of edges with a triangle on one side
/// only, in the winding of the triangles that would fill them. The longest rim of an open surface is
/// its border and never counts as a hole, however small it is.
fn holes(positions: &[DVec3], triangles: &[[u32; 3]], across: f64) -> Vec<Vec<u32>> {
    let mut rims = rims(triangles);
    let size = |rim: &Vec<u32>| {
        Bounds::around(rim.iter().map(|&v| positions[v as usize]))
            .size()
            .length()
    };
    rims.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
    // A lone rim may be the one hole of a nearly closed body; it is then shorter than the body is wide.
    let all: Vec<u32> = triangles.iter().flatten().copied().collect();
    if rims
        .first()
        .is_some_and(|border| size(border) > 0.99 * size(&all))
    {
        rims.remove(0);
    }
    rims.retain(|rim| size(rim) <= across);
    rims
}

fn rims(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    // A filling triangle runs along a rim the other way round than the triangle that is there.
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    for [a, b] in open_sides(triangles) {
        next.entry(b).or_default().push(a);
    }
    let mut starts: Vec<u32> = next.keys().copied().collect();
    starts.sort_unstable();
    let mut rims = Vec::new();
    let mut visited = std::collections::HashSet::new();
    for start in starts {
        if visited.contains(&start) {
            continue;
        }
        let mut rim = vec![start];
        let mut at = start;
        // Where rims touch in a vertex the way on is not known: leave them open.
        while let Some([only]) = next.get(&at).map(Vec::as_slice) {
            at = *only;
            // Round, or into a way that was walked before.
            if at == start || !visited.insert(at) {
                break;
            }
            rim.push(at);
        }
        if at == start && rim.len() >= 3 && rim.iter().all(|v| next.contains_key(v)) {
            for v in &rim {
                next.remove(v);
            }
            rims.push(rim);
        }
    }
    rims
}

/// Longest rim that is filled without a new vertex: the work grows with the cube of it.
const LONGEST: usize = 120;

/// Twice the area of three points, over the square of their longest side, below which they lie in a line; and what such a
/// triangle counts for instead.
const IN_LINE: f64 = 1e-6;
const NO_OTHER: f64 = 1e3;

/// The triangulation of a closed line with the least area (G. Barequet and M. Sharir, "Filling gaps in
/// the boundary of a polyhedron", Computer Aided Geometric Design 12 (1995)).
fn fill(positions: &[DVec3], rim: &[u32]) -> Option<Vec<[u32; 3]>> {
    let n = rim.len();
    if n > LONGEST {
        return None;
    }
    let p: Vec<DVec3> = rim.iter().map(|&v| positions[v as usize]).collect();
    let area = |i: usize, j: usize, k: usize| {
        let (u, v) = (p[j] - p[i], p[k] - p[i]);
        let longest = u.length_squared().max(v.length_squared());
        let twice = u.cross(v).length();
        // Three points in a line close nothing: only where there is no other way.
        if twice > IN_LINE * longest {
            twice
        } else {
            NO_OTHER * longest
        }
    };
    let mut least = vec![vec![0.0; n]; n];
    let mut split = vec![vec![0; n]; n];
    for span in 2..n {
        for i in 0..n - span {
            let k = i + span;
            let (mut best, mut at) = (f64::INFINITY, i + 1);
            for j in i + 1..k {
                let cost = least[i][j] + least[j][k] + area(i, j, k);
                if cost < best {
                    (best, at) = (cost, j);
                }
            }
            (least[i][k], split[i][k]) = (best, at);
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, k)) = open.pop() {
        if k > i + 1 {
            let j = split[i][k];
            triangles.push([rim[i], rim[j], rim[k]]);
            open.extend([(i, j), (j, k)]);
        }
    }
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::super::{MeshError, TriMesh};
    use super::*;

    /// A box without its lid, its corners torn apart by a hair where `torn`.
    fn open_box(torn: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corner =
            |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let quads = [
            [0, 2, 3, 1],
            [0, 1, 5, 4],
            [1, 3, 7, 5],
            [3, 2, 6, 7],
            [2, 0, 4, 6],
        ];
        let (mut p, mut t) = (Vec::new(), Vec::new());
        for (q, quad) in (0..).zip(quads) {
            let base = p.len() as u32;
            p.extend(quad.map(|k| corner(k) + DVec3::splat(torn * f64::from(q))));
            t.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
        (p, t)
    }

    #[test]
    fn one_vertex_far_away_asks_for_no_weld_that_would_melt_the_part() {
        let side = |k: u32| f64::from(k) * 1e-2;
        let mut points: Vec<DVec3> = (0..121)
            .map(|k| DVec3::new(side(k % 11), side(k / 11), 0.0))
            .collect();
        let mut triangles = Vec::new();
        for k in (0..110).filter(|k| k % 11 < 10) {
            triangles.extend([[k, k + 1, k + 12], [k, k + 12, k + 11]]);
        }
        points[60] = DVec3::splat(1e4);
        let mean = |sides: Vec<f64>| sides.iter().sum::<f64>() / sides.len() as f64;
        let sides = triangles.iter().flat_map(|t| {
            [0, 1, 2].map(|i| points[t[i] as usize].distance(points[t[(i + 1) % 3] as usize]))
        });
        assert!(mean(sides.collect()) > 100.0);
        let middle = middle_edge(&points, &triangles).unwrap();
        assert!((0.01..0.0142).contains(&middle), "{middle}");
        assert_eq!(torn(&points, &triangles), None);
    }

    #[test]
    fn what_rounding_has_parted_is_one() {
        let (p, t) = open_box(1e-10);
        let (mesh, report) = TriMesh::new(&p, &t, 0).unwrap();
        assert_eq!((report.bodies, report.joined_vertices), (1, 12));
        assert_eq!(mesh.boundary_edges().count(), 4);
        assert_eq!(report.torn, None);
    }

    #[test]
    fn a_seam_that_leaves_the_surface_open_is_told() {
        let (p, t) = open_box(1e-4);
        // Four walls around the bottom, all apart: eight sides below and eight upright ones, and four open at the top.
        let (_, report) = TriMesh::new(&p, &t, 0).unwrap();
        assert_eq!(report.torn, Some((1e-3, 16)));
        assert_eq!(report.closes_within, None);
        let words = report.in_words(0).unwrap();
        assert!(words.contains("16 open edges"), "{words}");
        assert!(words.contains("part.weld_mm = 1"), "{words}");
    }

    #[test]
    fn torn_corners_are_welded_only_when_asked() {
        let (p, t) = open_box(1e-6);
        let (_, apart) = TriMesh::new(&p, &t, 0).unwrap();
        assert_eq!(apart.bodies, 5);
        let weld = Repair {
            weld: 1e-4,
            ..Repair::default()
        };
        let (mesh, joined) = TriMesh::repaired(&p, &t, 0, &weld).unwrap();
        assert_eq!((joined.bodies, joined.joined_vertices), (1, 12));
        assert_eq!(mesh.boundary_edges().count(), 4);
        assert!((mesh.area() - 5.0).abs() < 1e-4);
    }

    #[test]
    fn a_hole_is_filled_only_when_asked_and_small() {
        let (p, t) = open_box(0.0);
        let fill = |across| {
            let repair = Repair {
                fill_holes: across,
                ..Repair::default()
            };
            TriMesh::repaired(&p, &t, 0, &repair).unwrap()
        };
        let (open, report) = fill(1.0);
        assert_eq!((open.boundary_edges().count(), report.filled_holes), (4, 0));
        let (closed, report) = fill(1.5);
        assert_eq!(
            (closed.boundary_edges().count(), report.filled_holes),
            (0, 1)
        );
        assert!((closed.area() - 6.0).abs() < 1e-12);
        // Closed, and so turned outward: every facet looks away from the middle.
        for t in 0..closed.triangles().len() as u32 {
            let middle = closed.corners(t).iter().sum::<DVec3>() / 3.0;
            assert!(closed.facet_normal(t).dot(middle - 0.5) > 0.0);
        }
    }

    #[test]
    fn a_weld_wider_than_the_part_is_refused() {
        let (p, t) = open_box(0.0);
        let weld = Repair {
            weld: 9.0,
            ..Repair::default()
        };
        assert_eq!(
            TriMesh::repaired(&p, &t, 0, &weld).unwrap_err(),
            MeshError::AllDegenerate
        );
    }
}
