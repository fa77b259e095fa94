//! What is pressed, and what is in the way.

use std::sync::Arc;

use crate::gauge::Gauge;
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;

/// A gauge that is to be pressed to its wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedGauge {
    /// By which its pieces are named.
    pub number: usize,
    /// On the inner face; its normal is from the inside to the outside.
    pub gauge: Gauge,
}

/// A part, as far as a jig meets it.
#[derive(Clone)]
pub struct Wall {
    /// The face that gauges are glued to (m).
    pub face: Arc<TriMesh>,
    /// All that is in the way (m): of a shell its inner face, of a solid all of its surface.
    pub part: Arc<TriMesh>,
    /// Which way it stands.
    pub stance: Stance,
}
