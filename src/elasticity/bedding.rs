//! Supports that give way: springs all over what they hold (Winkler's bedding).
//!
//! A clamp that is screwed to plastic, a foot on rubber or a printed joint moves a little with what it holds. The traction
//! at a place is its bedding (Pa/m) times how far the surface moves there: of a shell its mid-surface, of a solid every face in the
//! support. Where a wall of thickness t turns, springs spread through it push back with a moment of bedding · t²/12 an area
//! and a radian.

use super::support::HeldPart;
use crate::mesh::{SurfacePoint, TriMesh};

/// Springs at a vertex of a shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexSprings {
    /// Its number.
    pub vertex: u32,
    /// Along and about x, y and z (N/m, N·m/rad); 0 where there is none.
    pub stiffness: [f64; 6],
}

impl HeldPart {
    /// The springs of supports that give way, of elements whose vertices lie at these places of the (cut) part: over the
    /// facets that belong to a support, along lines where it has no facets (the edge of a wall is as wide as that is
    /// thick), and at single vertices.
    #[must_use]
    pub fn springs(
        &self,
        mesh: &TriMesh,
        places: &[SurfacePoint],
        thickness: f64,
    ) -> Vec<VertexSprings> {
        let mut stiffness = vec![[0.0; 6]; places.len()];
        for (support, held, bedding) in self.beds() {
            let on: Vec<bool> = (places.iter())
                .map(|&at| self.belongs(at, support))
                .collect();
            for (springs, area) in stiffness.iter_mut().zip(areas(mesh, &on, thickness)) {
                for (i, spring) in springs.iter_mut().enumerate() {
                    if held.holds(i) {
                        let turning = if i < 3 { 1.0 } else { thickness.powi(2) / 12.0 };
                        *spring += bedding * area * turning;
                    }
                }
            }
        }
        let some = |springs: &[f64; 6]| springs.iter().any(|k| *k > 0.0);
        (0..)
            .zip(stiffness)
            .filter(|(_, springs)| some(springs))
            .map(|(vertex, stiffness)| VertexSprings { vertex, stiffness })
            .collect()
    }
}

/// Each vertex's share (m²) of what those that are `on` a support border.
fn areas(mesh: &TriMesh, on: &[bool], thickness: f64) -> Vec<f64> {
    let mut areas = vec![0.0; on.len()];
    let whole = |tri: &[u32; 3]| tri.iter().all(|&v| on[v as usize]);
    for (facet, tri) in (0..).zip(mesh.triangles()) {
        if whole(tri) {
            let third = mesh.facet_area(facet) / 3.0;
            for &v in tri {
                areas[v as usize] += third;
            }
        }
    }
    for edge in mesh.edges() {
        let ends = [edge.a, edge.b].map(|v| v as usize);
        let beside = || (edge.triangles.iter()).any(|&t| whole(&mesh.triangles()[t as usize]));
        if ends.iter().all(|&v| on[v]) && !beside() {
            let [a, b] = ends.map(|v| mesh.positions()[v]);
            let half = thickness * a.distance(b) / 2.0;
            for v in ends {
                areas[v] += half;
            }
        }
    }
    for (area, _) in areas
        .iter_mut()
        .zip(on)
        .filter(|(a, on)| **on && **a == 0.0)
    {
        *area = thickness.powi(2);
    }
    areas
}
