//! One body of several, with the surface around it.

use std::collections::HashMap;

use super::{VolumeError, VolumeMesh};
use crate::mesh::{MeshError, TriMesh, components};

impl VolumeMesh {
    /// The piece of connected tetrahedra with the largest, second … surface, with its surface and how many
    /// pieces there are. Every face of a tetrahedron is four triangles of the surface.
    ///
    /// # Errors
    /// [`VolumeError`] where there is no such piece.
    pub fn body(&self, body: usize) -> Result<(Self, TriMesh, usize), VolumeError> {
        let fans: Vec<[u32; 3]> = (self.tetrahedra.iter())
            .flat_map(|t| (1..10).map(|k| [t[0], t[k], t[k]]))
            .collect();
        let labels = components(self.nodes.len(), &fans);
        let mut areas: HashMap<u32, f64> = HashMap::new();
        for face in self.boundary() {
            let [a, b, c] = [face[0], face[1], face[2]].map(|n| self.nodes[n as usize]);
            *areas.entry(labels[face[0] as usize]).or_default() += (b - a).cross(c - a).length();
        }
        let mut by_area: Vec<(u32, f64)> = areas.into_iter().collect();
        by_area.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let count = by_area.len();
        let &(label, _) = by_area
            .get(body)
            .ok_or(MeshError::NoSuchBody { body, count })?;
        let mut number = HashMap::new();
        let mut nodes = Vec::new();
        let tetrahedra = (self.tetrahedra.iter())
            .filter(|t| labels[t[0] as usize] == label)
            .map(|t| {
                t.map(|n| {
                    *number.entry(n).or_insert_with(|| {
                        nodes.push(self.nodes[n as usize]);
                        nodes.len() as u32 - 1
                    })
                })
            })
            .collect();
        let piece = Self {
            nodes,
            tetrahedra,
            from_linear: self.from_linear,
        };
        let (surface, _) = TriMesh::new(&piece.nodes, &piece.surface_triangles(), 0)?;
        Ok((piece, surface, count))
    }
}
