//! What the graphics adapter is given: vertices, what changes on them, and the uniforms of the shader.

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
    pub triangles: Vec<[u32; 3]>,
    /// Pairs of vertices between which a line is drawn: rims and sharp edges.
    pub edges: Vec<[u32; 2]>,
}

impl Solid {
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        let vertices = mesh.positions().iter().zip(mesh.vertex_normals());
        Self {
            vertices: vertices
                .map(|(p, n)| GpuVertex {
                    position: p.as_vec3().to_array(),
                    normal: n.as_vec3().to_array(),
                    stretch: 0.0,
                })
                .collect(),
            triangles: mesh.triangles().to_vec(),
            edges: edges(mesh),
        }
    }
}

/// Where the surface ends, branches, or turns by so much that nobody takes it for round.
fn edges(mesh: &TriMesh) -> Vec<[u32; 2]> {
    /// 40°: a circle of ten sides is round.
    const SHARP: f64 = 0.766;
    let drawn = mesh.edges().iter().filter(|edge| match edge.triangles[..] {
        [a, b] => mesh.facet_normal(a).dot(mesh.facet_normal(b)) < SHARP,
        _ => true,
    });
    drawn.map(|edge| [edge.a, edge.b]).collect()
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
