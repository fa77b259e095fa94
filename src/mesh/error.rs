//! Why a mesh is refused.

/// Why a mesh was refused, with the place and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error("the mesh has no triangles: export it as a triangulated surface")]
    Empty,
    #[error(
        "vertex {vertex} of the mesh is not a finite point: repair the mesh in the program that wrote it"
    )]
    NotFinite { vertex: usize },
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but the mesh has {count} vertices: the file is damaged"
    )]
    BadIndex {
        triangle: usize,
        vertex: u64,
        count: usize,
    },
    #[error(
        "every triangle of the mesh has zero area: check the unit and the export of the mesh file, and that part.weld_mm is small beside the part"
    )]
    AllDegenerate,
    #[error("the mesh has {count} separate bodies, so body {body} does not exist: choose 0 to {}", count - 1)]
    NoSuchBody { body: usize, count: usize },
    #[error(
        "the mesh has {triangles} triangles, more than the {limit} this version handles: decimate it first"
    )]
    TooLarge { triangles: usize, limit: usize },
}
