//! How often a surface winds around a point: 1 inside a closed body, 0 outside, in between near its holes.
//!
//! The generalized winding number (A. Jacobson and others 2013) is the solid angle of all triangles over 4π.
//! Clusters of triangles far from the point count as dipoles at their centres of area (G. Barill and others,
//! "Fast winding numbers for soups and clouds", 2018): off by a few hundredths, at the worst, where the question is whether
//! there is more or less than a half.

use glam::DVec3;

use super::TriMesh;
use crate::bounds::Bounds;

/// A tree over the triangles of a surface.
pub struct Winding {
    nodes: Vec<Node>,
    /// Corners of the triangles in the order of the leaves (m).
    triangles: Vec<[DVec3; 3]>,
}

/// Triangles in a leaf, at most.
const LEAF: usize = 2;
/// A cluster is far at this many of its radii.
const FAR: f64 = 2.0;

/// Triangles longer than this share of the whole are halved: a cluster of long ones is near to everything.
const LONGEST: f64 = 0.02;

fn halve(triangle: [DVec3; 3], longest: f64, into: &mut Vec<[DVec3; 3]>) {
    let side = |i: usize| triangle[i].distance_squared(triangle[(i + 1) % 3]);
    let i = (0..3)
        .max_by(|&i, &j| side(i).total_cmp(&side(j)))
        .unwrap_or(0);
    if side(i) <= longest * longest {
        into.push(triangle);
        return;
    }
    let [a, b, c] = [triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]];
    let middle = a.midpoint(b);
    halve([a, middle, c], longest, into);
    halve([middle, b, c], longest, into);
}

struct Node {
    centre: DVec3,
    radius: f64,
    /// Σ of area × normal (m²).
    dipole: DVec3,
    /// Triangles from … to; the second child, or zero for a leaf (the first follows its parent).
    range: (u32, u32),
    second_child: u32,
}

impl Winding {
    /// Prepares winding numbers around a mesh.
    #[must_use]
    pub fn new(mesh: &TriMesh) -> Self {
        let (lower, upper) = mesh.bounds();
        let longest = (upper - lower).length() * LONGEST;
        let mut triangles = Vec::with_capacity(mesh.triangles().len());
        for t in 0..mesh.triangles().len() as u32 {
            halve(mesh.corners(t), longest, &mut triangles);
        }
        let mut nodes = Vec::with_capacity(triangles.len());
        let count = triangles.len();
        grow(&mut nodes, &mut triangles, 0, count);
        Self { nodes, triangles }
    }

    /// The winding number at a point.
    #[must_use]
    pub fn at(&self, point: DVec3) -> f64 {
        let mut angle = 0.0;
        let mut next = 0;
        // Depth first; a cluster that is far is skipped with all its children.
        let mut waiting = [0u32; 64];
        let mut depth = 0;
        loop {
            let node = &self.nodes[next as usize];
            let away = node.centre - point;
            let distance = away.length();
            let mut descend = false;
            if distance > FAR * node.radius {
                angle += node.dipole.dot(away) / distance.powi(3);
            } else if node.second_child == 0 {
                let range = node.range.0 as usize..node.range.1 as usize;
                angle += self.triangles[range]
                    .iter()
                    .map(|t| solid_angle(t, point))
                    .sum::<f64>();
            } else {
                descend = true;
            }
            if descend {
                waiting[depth] = node.second_child;
                depth += 1;
                next += 1;
            } else if depth == 0 {
                return angle / (4.0 * std::f64::consts::PI);
            } else {
                depth -= 1;
                next = waiting[depth];
            }
        }
    }
}

/// Builds the subtree over triangles from … to by halving along the longest side.
fn grow(nodes: &mut Vec<Node>, triangles: &mut [[DVec3; 3]], from: usize, to: usize) {
    let own = &mut triangles[from..to];
    let middle = |t: &[DVec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
    let area = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]) / 2.0;
    let total: f64 = own.iter().map(|t| area(t).length()).sum();
    let weighted: DVec3 = own.iter().map(|t| middle(t) * area(t).length()).sum();
    let centre = if total > 0.0 {
        weighted / total
    } else {
        middle(&own[0])
    };
    let corners = own.iter().flatten();
    let radius = corners.map(|p| p.distance(centre)).fold(0.0, f64::max);
    let number = nodes.len();
    nodes.push(Node {
        centre,
        radius,
        dipole: own.iter().map(area).sum(),
        range: (from as u32, to as u32),
        second_child: 0,
    });
    if own.len() <= LEAF {
        return;
    }
    let axis = Bounds::around(own.iter().map(middle)).size().max_position();
    let half = own.len() / 2;
    own.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
    grow(nodes, triangles, from, from + half);
    nodes[number].second_child = nodes.len() as u32;
    grow(nodes, triangles, from + half, to);
}

/// Solid angle of a triangle (A. van Oosterom and J. Strackee 1983), positive seen from behind.
pub(super) fn solid_angle(corners: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = corners.map(|p| p - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let scale = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * volume.atan2(scale)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A ball of radius 1 about the origin, of 8·4ⁿ triangles.
    pub fn ball(splits: usize) -> TriMesh {
        let mut triangles: Vec<[DVec3; 3]> = Vec::new();
        for x in [DVec3::X, DVec3::NEG_X] {
            for y in [DVec3::Y, DVec3::NEG_Y] {
                for z in [DVec3::Z, DVec3::NEG_Z] {
                    let out = x.x * y.y * z.z > 0.0;
                    triangles.push(if out { [x, y, z] } else { [x, z, y] });
                }
            }
        }
        for _ in 0..splits {
            let quarter = |[a, b, c]: [DVec3; 3]| {
                let m = |p: DVec3, q: DVec3| (p + q).normalize();
                let (ab, bc, ca) = (m(a, b), m(b, c), m(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            triangles = triangles.into_iter().flat_map(quarter).collect();
        }
        let positions: Vec<DVec3> = triangles.iter().flatten().copied().collect();
        let indices: Vec<[u32; 3]> = (0..triangles.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect();
        TriMesh::new(&positions, &indices, 0).unwrap().0
    }

    #[test]
    fn the_tree_says_what_all_triangles_say() {
        let mesh = ball(4);
        let winding = Winding::new(&mesh);
        for k in 0..200 {
            let r = 0.01 + 0.01 * f64::from(k);
            let a = 2.4 * f64::from(k);
            let p = DVec3::new(a.cos() * 0.6, a.sin() * 0.6, 0.8) * r;
            let all: f64 = (0..mesh.triangles().len() as u32)
                .map(|t| solid_angle(&mesh.corners(t), p))
                .sum();
            let all = all / (4.0 * std::f64::consts::PI);
            assert!(
                (winding.at(p) - all).abs() < 0.1,
                "{r} {} {all}",
                winding.at(p)
            );
            assert_eq!(winding.at(p) > 0.5, all > 0.5);
        }
    }
}
