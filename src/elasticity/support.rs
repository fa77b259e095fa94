//! Where and how the shell is held.

use glam::DVec3;

use crate::mesh::TriMesh;

/// The held ones among the six freedoms of a node: displacement x, y, z, rotation x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Freedoms(pub u8);

impl Freedoms {
    pub const ALL: Self = Self(0b11_1111);
    pub const DISPLACEMENTS: Self = Self(0b00_0111);

    /// Held freedoms by index, 0–5.
    #[must_use]
    pub fn of(indices: &[usize]) -> Self {
        Self(indices.iter().fold(0, |mask, i| mask | 1 << i))
    }

    #[must_use]
    pub fn holds(self, index: usize) -> bool {
        self.0 >> index & 1 == 1
    }

    /// A mirror plane normal to axis 0, 1 or 2: no displacement through it, no rotation within it.
    #[must_use]
    pub fn symmetry(axis: usize) -> Self {
        let in_plane = (0..3).filter(|&a| a != axis).map(|a| a + 3);
        Self(in_plane.fold(1 << axis, |mask, i| mask | 1 << i))
    }
}

/// A box (m) inside which every vertex has some freedoms held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    pub lower: DVec3,
    pub upper: DVec3,
    pub held: Freedoms,
}

/// What each vertex of the mesh has held, from all supports together.
#[must_use]
pub fn held_freedoms(mesh: &TriMesh, supports: &[Support]) -> Vec<Freedoms> {
    mesh.positions()
        .iter()
        .map(|&p| {
            let inside = supports
                .iter()
                .filter(|s| p.cmpge(s.lower).all() && p.cmple(s.upper).all());
            Freedoms(inside.fold(0, |mask, s| mask | s.held.0))
        })
        .collect()
}

/// Vertices with anything held.
#[must_use]
pub fn supported_vertices(held: &[Freedoms]) -> Vec<u32> {
    (0..held.len() as u32)
        .filter(|&v| held[v as usize].0 != 0)
        .collect()
}
