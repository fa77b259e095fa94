//! Points of a surface.

/// A point of the surface: a triangle and the weights of its corners (they sum to one).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Its number in the mesh.
    pub triangle: u32,
    /// One weight for each corner, in the triangle's order.
    pub barycentric: [f64; 3],
}
