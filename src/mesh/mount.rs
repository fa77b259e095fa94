//! What a part is fastened to by a flat face: nothing comes to the part through there.

use glam::DVec3;

use super::TriMesh;

/// A face is flat where its normals add up to this share of its area at least, and where no corner lies farther from
/// its plane than this share of its size.
const FLAT: f64 = 0.98;
const LEVEL: f64 = 0.02;

/// A disc that something stands behind, as wide as the face that is fastened to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// m.
    pub centre: DVec3,
    /// Away from the part.
    pub normal: DVec3,
    /// m.
    pub radius: f64,
}

impl Mount {
    /// Behind some facets, where they lie in one plane.
    #[must_use]
    pub fn behind(mesh: &TriMesh, facets: &[u32]) -> Option<Self> {
        let area: f64 = facets.iter().map(|&t| mesh.facet_area(t)).sum();
        let sum = |value: &dyn Fn(u32) -> DVec3| -> DVec3 {
            (facets.iter().map(|&t| value(t) * mesh.facet_area(t))).sum::<DVec3>() / area
        };
        let normal = sum(&|t| mesh.facet_normal(t));
        if area <= 0.0 || normal.length() < FLAT {
            return None;
        }
        let normal = normal.normalize();
        let centre = sum(&|t| mesh.corners(t).iter().sum::<DVec3>() / 3.0);
        let corners = || facets.iter().flat_map(|&t| mesh.corners(t));
        let radius = corners().map(|p| p.distance(centre)).fold(0.0, f64::max);
        let level = |p: DVec3| (p - centre).dot(normal).abs() <= LEVEL * radius;
        corners().all(level).then_some(Self {
            centre,
            normal,
            radius,
        })
    }

    /// Whether a ball (m) that goes straight on from a place would have to come through.
    #[must_use]
    pub fn stops(&self, ball: DVec3, radius: f64, way: DVec3) -> bool {
        let height = (ball - self.centre).dot(self.normal);
        let climbs = way.dot(self.normal);
        let aside = |p: DVec3| {
            (p - self.centre)
                .reject_from_normalized(self.normal)
                .length()
        };
        let overlaps = height > -radius && aside(ball) < self.radius;
        let through = || climbs > 0.0 && aside(ball - way * (height / climbs)) < self.radius;
        overlaps || (height <= 0.0 && through())
    }
}
