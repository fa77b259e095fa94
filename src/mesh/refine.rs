//! Splits every triangle into four, with new vertices on the smooth surface and not on the chords.
//!
//! The new point is the middle of the cubic of a PN triangle (Vlachos et al., "Curved PN triangles",
//! I3D 2001); across a crease the middle of the edge itself is kept.

use glam::DVec3;

use super::TriMesh;

/// Cosine of the dihedral angle beyond which an edge is a crease (30°).
const CREASE: f64 = 0.866;

/// One 1:4 refinement: edge lengths halve, old vertices keep their numbers.
#[must_use]
pub fn refine(mesh: &TriMesh) -> TriMesh {
    let old = mesh.positions().len() as u32;
    let mut positions = mesh.positions().to_vec();
    positions.extend((0..mesh.edges().len()).map(|e| midpoint(mesh, e)));
    let triangles = mesh
        .triangles()
        .iter()
        .zip(mesh.triangle_edges())
        .flat_map(|(&[a, b, c], opposite)| {
            let [bc, ca, ab] = opposite.map(|e| old + e);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .collect();
    TriMesh::from_checked(positions, triangles)
}

fn midpoint(mesh: &TriMesh, edge: usize) -> DVec3 {
    let edge = &mesh.edges()[edge];
    let [a, b] = [edge.a, edge.b].map(|v| mesh.positions()[v as usize]);
    let middle = (a + b) / 2.0;
    let smooth = match edge.triangles[..] {
        [_] => true,
        [s, t] => mesh.facet_normal(s).dot(mesh.facet_normal(t)) > CREASE,
        _ => false,
    };
    let [na, nb] = [edge.a, edge.b].map(|v| mesh.vertex_normals()[v as usize]);
    if !smooth || na.dot(nb) < CREASE {
        return middle;
    }
    middle - ((b - a).dot(na) * na + (a - b).dot(nb) * nb) / 8.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_points_of_a_cylinder_lie_on_the_cylinder() {
        let (n, m) = (24, 6);
        let p: Vec<DVec3> = (0..=m)
            .flat_map(|j| {
                (0..n).map(move |i| {
                    let a = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
                    DVec3::new(a.cos(), a.sin(), f64::from(j) * 0.25)
                })
            })
            .collect();
        let at = |i: i32, j: i32| (j * n + i % n) as u32;
        let t: Vec<[u32; 3]> = (0..m)
            .flat_map(|j| {
                (0..n).flat_map(move |i| {
                    [
                        [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                        [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]
                })
            })
            .collect();
        let fine = refine(&TriMesh::new(&p, &t, 0).unwrap().0);
        assert_eq!(fine.triangles().len(), 4 * t.len());
        let worst = fine
            .positions()
            .iter()
            .map(|p| (p.truncate().length() - 1.0).abs())
            .fold(0.0, f64::max);
        // Chord midpoints would be off by 1 - cos(7.5°) = 8.6e-3.
        assert!(worst < 1.5e-3, "{worst}");
    }

    #[test]
    fn a_plane_and_a_crease_keep_their_shape() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.0, 0.0, 1.0)];
        let (mesh, _) = TriMesh::new(&p, &[[0, 1, 2], [0, 3, 1]], 0).unwrap();
        let fine = refine(&mesh);
        assert!((fine.area() - mesh.area()).abs() < 1e-12);
    }
}
