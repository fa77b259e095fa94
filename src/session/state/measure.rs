//! A way over the part: its ends, and how long it is.

use crate::mesh::SurfacePoint;

/// Two points of the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    pub from: SurfacePoint,
    pub to: SurfacePoint,
}

/// How far two points are apart (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    pub straight: f64,
    /// Infinite where no way leads from one to the other; nothing while it is computed.
    pub over_surface: Option<f64>,
}
