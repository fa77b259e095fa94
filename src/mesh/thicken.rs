//! The closed solid around a mid-surface.

use glam::DVec3;

use super::TriMesh;

impl TriMesh {
    /// The body of a wall of this thickness (m) about the surface: both its faces, and its rims closed.
    #[must_use]
    pub fn thickened(&self, thickness: f64) -> Self {
        let count = self.positions().len() as u32;
        let face = |height: f64| {
            let both = self.positions().iter().zip(self.vertex_normals());
            both.map(move |(p, n)| *p + *n * height)
        };
        let positions: Vec<DVec3> = face(thickness / 2.0)
            .chain(face(-thickness / 2.0))
            .collect();
        let mut triangles = self.triangles().to_vec();
        triangles.extend(
            self.triangles()
                .iter()
                .map(|&[a, b, c]| [a + count, c + count, b + count]),
        );
        for edge in self.boundary_edges() {
            let tri = self.triangles()[edge.triangles[0] as usize];
            // Along the way the triangle winds, so that the rim faces away from it.
            let along = (0..3).any(|i| tri[i] == edge.a && tri[(i + 1) % 3] == edge.b);
            let (a, b) = if along {
                (edge.a, edge.b)
            } else {
                (edge.b, edge.a)
            };
            triangles.push([a, a + count, b]);
            triangles.push([b, a + count, b + count]);
        }
        Self::from_checked(positions, triangles)
    }
}

#[cfg(test)]
mod tests {
    use crate::limb::LimbSpec;

    #[test]
    fn a_thick_limb_is_closed_and_holds_its_area_times_its_wall() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let solid = mesh.thickened(1.5e-3);
        assert_eq!(solid.boundary_edges().count(), 0);
        let volume: f64 = (0..solid.triangles().len() as u32)
            .map(|t| {
                let [a, b, c] = solid.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let expected = mesh.area() * 1.5e-3;
        assert!(
            (volume / expected - 1.0).abs() < 2e-3,
            "{volume} {expected}"
        );
    }
}
