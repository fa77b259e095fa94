//! Vertices at sharp edges, once for each side: walls are lit smoothly as far as they are round, and edges stay sharp.

use glam::DVec3;

use crate::mesh::{Edge, TriMesh};

/// Cosine of the turn from which an edge is sharp: 40°, as a circle of ten sides is round.
const SHARP: f64 = 0.766;

/// The corners of a mesh as they are lit.
pub(super) struct LitCorners {
    /// One a vertex, those of `again` behind the mesh's own.
    pub normals: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Which vertex of the mesh each one behind them is once more.
    pub again: Vec<u32>,
    /// Where the surface ends, branches, or turns by so much that nobody takes it for round.
    pub edges: Vec<[u32; 2]>,
}

/// Whether two facets that share an edge are of one wall.
fn is_round(mesh: &TriMesh, [a, b]: [u32; 2]) -> bool {
    mesh.facet_normal(a).dot(mesh.facet_normal(b)) >= SHARP
}

impl LitCorners {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let ends = |edge: &&Edge| match edge.triangles[..] {
            [a, b] => !is_round(mesh, [a, b]),
            _ => true,
        };
        let drawn: Vec<&Edge> = mesh.edges().iter().filter(ends).collect();
        let mut divided = vec![false; mesh.positions().len()];
        for edge in drawn.iter().filter(|edge| edge.triangles.len() > 1) {
            divided[edge.a as usize] = true;
            divided[edge.b as usize] = true;
        }
        let mut corners = Self {
            normals: mesh.vertex_normals().to_vec(),
            triangles: mesh.triangles().to_vec(),
            again: Vec::new(),
            edges: drawn.iter().map(|edge| [edge.a, edge.b]).collect(),
        };
        for vertex in (0..).zip(divided).filter_map(|(v, d)| d.then_some(v)) {
            corners.divide(mesh, vertex);
        }
        corners
    }

    /// Gives each wall around a vertex one of its own; the first keeps the mesh's.
    fn divide(&mut self, mesh: &TriMesh, vertex: u32) {
        let facets = &mesh.vertex_triangles()[vertex as usize];
        let walls = walls_around(mesh, vertex, facets);
        for wall in 0..=walls.iter().copied().max().unwrap_or(0) {
            let of_wall = || facets.iter().zip(&walls).filter(|(_, w)| **w == wall);
            let normal: DVec3 = of_wall().map(|(&t, _)| weighted(mesh, t, vertex)).sum();
            let normal = normal.normalize_or_zero();
            if wall == 0 {
                self.normals[vertex as usize] = normal;
                continue;
            }
            let new = self.normals.len() as u32;
            self.normals.push(normal);
            self.again.push(vertex);
            for (&facet, _) in of_wall() {
                for corner in &mut self.triangles[facet as usize] {
                    if *corner == vertex {
                        *corner = new;
                    }
                }
            }
        }
    }
}

/// A facet's normal by its angle at a corner, as [`TriMesh::vertex_normals`] weighs them.
fn weighted(mesh: &TriMesh, facet: u32, corner: u32) -> DVec3 {
    let tri = mesh.triangles()[facet as usize];
    let at = |v: u32| mesh.positions()[v as usize];
    let mut others = tri.iter().filter(|&&v| v != corner).map(|&v| at(v));
    let (Some(a), Some(b)) = (others.next(), others.next()) else {
        return DVec3::ZERO;
    };
    let angle = (a - at(corner)).angle_between(b - at(corner));
    mesh.facet_normal(facet) * angle
}

/// Which wall each of the facets around a vertex is of, numbered in their order: those that meet in an edge which is not
/// sharp are of one.
fn walls_around(mesh: &TriMesh, vertex: u32, facets: &[u32]) -> Vec<usize> {
    let has = |facet: u32, v: u32| mesh.triangles()[facet as usize].contains(&v);
    let beside = |facet: u32| {
        let others = mesh.triangles()[facet as usize].into_iter();
        others.filter(move |&v| v != vertex)
    };
    let mut walls = vec![usize::MAX; facets.len()];
    let mut count = 0;
    for first in 0..facets.len() {
        if walls[first] != usize::MAX {
            continue;
        }
        let mut waiting = vec![first];
        while let Some(k) = waiting.pop() {
            walls[k] = count;
            for other in beside(facets[k]) {
                let mut across = (0..facets.len()).filter(|&j| j != k && has(facets[j], other));
                let (next, none) = (across.next(), across.next());
                if let (Some(j), None) = (next, none)
                    && walls[j] == usize::MAX
                    && is_round(mesh, [facets[k], facets[j]])
                {
                    waiting.push(j);
                }
            }
        }
        count += 1;
    }
    walls
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube, its corners once.
    fn cube() -> TriMesh {
        let corners: Vec<DVec3> = (0..8)
            .map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)))
            .collect();
        let triangles = [
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        TriMesh::new(&corners, &triangles, 0).unwrap().0
    }

    #[test]
    fn every_face_of_a_cube_has_its_own_corners() {
        let mesh = cube();
        let corners = LitCorners::of(&mesh);
        assert_eq!(corners.again.len(), 16);
        for (t, tri) in (0..).zip(&corners.triangles) {
            for (&corner, &before) in tri.iter().zip(&mesh.triangles()[t as usize]) {
                let normal = corners.normals[corner as usize];
                assert!(
                    normal.distance(mesh.facet_normal(t)) < 1e-12,
                    "{t}: {normal}"
                );
                let own = mesh.positions().len() as u32;
                let of = corner
                    .checked_sub(own)
                    .map_or(corner, |k| corners.again[k as usize]);
                assert_eq!(of, before);
            }
        }
    }

    #[test]
    fn what_is_round_stays_whole() {
        // A tube of twelve sides: turns of 30°.
        let at = |k: u32| {
            let around = glam::DVec2::from_angle(std::f64::consts::TAU * f64::from(k % 12) / 12.0);
            around.extend(f64::from(k / 12))
        };
        let next = |k: u32| k / 12 * 12 + (k + 1) % 12;
        let triangles: Vec<[u32; 3]> = (0..12)
            .flat_map(|k| [[k, next(k), next(k) + 12], [k, next(k) + 12, k + 12]])
            .collect();
        let mesh = TriMesh::new(&(0..24).map(at).collect::<Vec<_>>(), &triangles, 0)
            .unwrap()
            .0;
        let corners = LitCorners::of(&mesh);
        assert!(corners.again.is_empty());
        assert_eq!(corners.normals, mesh.vertex_normals());
        assert_eq!(corners.triangles, mesh.triangles());
        // Its rims are drawn.
        assert_eq!(corners.edges.len(), 24);
    }
}
