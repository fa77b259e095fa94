//! The face of the wall that gauges are glued to, beside the surface that is computed with.

use glam::DVec3;

use crate::gauge::Gauge;
use crate::mesh::TriMesh;
use crate::project::{Part, PartModel};

/// Where the wall's inner face lies from the surface that is computed with: of a shell half of its thickness from the
/// mid-surface, of a solid it is that surface itself, whose normals look into the hollow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InnerFace {
    looks_in: bool,
    /// m.
    depth: f64,
}

impl InnerFace {
    /// Normals look outwards, and it is the very surface that is computed with.
    pub const OUTWARD: Self = Self {
        looks_in: false,
        depth: 0.0,
    };

    /// Of a part.
    #[must_use]
    pub fn of(part: &Part) -> Self {
        match part.model {
            PartModel::Solid => Self {
                looks_in: true,
                depth: 0.0,
            },
            PartModel::Shell => Self {
                looks_in: false,
                depth: 0.5 * part.thickness(),
            },
        }
    }

    /// From the inside to the outside, of a normal of the surface.
    #[must_use]
    pub fn out(&self, normal: DVec3) -> DVec3 {
        if self.looks_in { -normal } else { normal }
    }

    /// A gauge of the surface that is computed with, on the inner face; its normal is from the inside to the outside.
    #[must_use]
    pub fn gauge(&self, gauge: &Gauge) -> Gauge {
        let out = self.out(gauge.normal);
        Gauge {
            position: gauge.position - out * self.depth,
            normal: out,
            ..*gauge
        }
    }

    /// The face (m), of the surface that is computed with.
    #[must_use]
    pub fn mesh(&self, computed: &TriMesh) -> TriMesh {
        computed.offset(-self.depth)
    }
}
