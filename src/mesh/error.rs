//! Why a mesh is refused.

/// Why a mesh was refused, with the place and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There are no triangles.
    #[error("the mesh has no triangles: export it as a triangulated surface")]
    Empty,
    /// A coordinate is infinite or not a number.
    #[error(
        "vertex {vertex} of the mesh is not a finite point: repair the mesh in the program that wrote it"
    )]
    NotFinite {
        /// Of this vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but the mesh has {count} vertices: the file is damaged"
    )]
    BadIndex {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u64,
        /// Vertices there are.
        count: usize,
    },
    /// No triangle has an area.
    #[error(
        "every triangle of the mesh has zero area: check the unit and the export of the mesh file, and that part.weld_mm is small beside the part"
    )]
    AllDegenerate,
    /// The body asked for is not there.
    #[error("the mesh has {count} separate bodies, so body {body} does not exist: choose 0 to {}", count - 1)]
    NoSuchBody {
        /// The body asked for, from 0.
        body: usize,
        /// Bodies there are.
        count: usize,
    },
    /// More triangles than can be handled.
    #[error(
        "the mesh has {triangles} triangles, more than the {limit} this version handles: decimate it first"
    )]
    TooLarge {
        /// Triangles of the mesh.
        triangles: usize,
        /// The most there may be.
        limit: usize,
    },
}
