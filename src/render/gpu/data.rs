//! What the graphics adapter is given: vertices, what changes on them, and the uniforms of the shader.

use std::borrow::Cow;

use super::corners::LitCorners;
use crate::mesh::TriMesh;

/// A vertex of a [`Solid`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GpuVertex {
    /// m.
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// The share that lengths are off by as it is drawn.
    pub stretch: f32,
}

/// Triangles to be drawn.
pub struct Solid {
    pub vertices: Vec<GpuVertex>,
    /// Which of the vertices the last ones are once more, with the normal of another side of a sharp edge.
    pub again: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    /// Pairs of vertices between which a line is drawn: rims and sharp edges.
    pub edges: Vec<[u32; 2]>,
}

impl Solid {
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        let corners = LitCorners::of(mesh);
        let positions = mesh.positions();
        let again = corners.again.iter().map(|&v| &positions[v as usize]);
        let vertices = positions.iter().chain(again).zip(&corners.normals);
        Self {
            vertices: vertices
                .map(|(p, n)| GpuVertex {
                    position: p.as_vec3().to_array(),
                    normal: n.as_vec3().to_array(),
                    stretch: 0.0,
                })
                .collect(),
            triangles: corners.triangles,
            edges: corners.edges,
            again: corners.again,
        }
    }

    /// What changes, given a vertex of the mesh, for all vertices that are drawn.
    pub(super) fn spread<'a>(&self, shown: &'a [Shown]) -> Cow<'a, [Shown]> {
        if self.again.is_empty() {
            return shown.into();
        }
        let again = self.again.iter().map(|&v| shown[v as usize]);
        shown.iter().copied().chain(again).collect()
    }
}

/// What changes with field and region, a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Shown {
    /// Displacement (m).
    pub displacement: [f32; 3],
    /// Field, 0–1 over the legend's range.
    pub value: f32,
    /// 255 where a layer is: gauges may go (or what is blind, where that is marked), touches come, held, gauges
    /// must not go.
    pub region: [u8; 4],
}

/// The uniforms of the shader, as it names them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Uniforms {
    pub matrix: [[f32; 4]; 4],
    pub eye: [f32; 4],
    pub target_scale: [f32; 4],
    pub deform: [f32; 4],
    /// A plane: what lies on its positive side is cut away.
    pub section: [f32; 4],
    /// x: how much of the wall that faces the eye covers what is behind it, 1 for all; y: 1 where the first layer
    /// marks what is blind; z: how much an edge covers.
    pub look: [f32; 4],
    /// xyz: the direction up; w: the stretch above which lengths are marked as off, 0 for none.
    pub up: [f32; 4],
}
