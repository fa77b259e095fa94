//! A strain gauge on a surface: the same value among the sites of a data set, on a model, on the wall and in a jig.

use glam::DVec3;

use crate::mesh::{SurfacePoint, TriMesh};

/// A strain gauge, as far as it is a place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// The middle of its grid (m).
    pub position: DVec3,
    /// Unit direction in the surface, along which it measures.
    pub direction: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
}

impl Gauge {
    /// At a point of a mesh, along the part of a direction that lies in its surface; along any where none does.
    #[must_use]
    pub fn on(mesh: &TriMesh, at: SurfacePoint, direction: DVec3) -> Self {
        let normal = mesh.normal(at);
        let flat = (direction - normal * direction.dot(normal)).try_normalize();
        Self {
            position: mesh.point(at),
            direction: flat.unwrap_or_else(|| normal.any_orthonormal_vector()),
            normal,
        }
    }

    /// In the surface, a quarter turn from the direction.
    #[must_use]
    pub fn across(&self) -> DVec3 {
        self.normal.cross(self.direction)
    }

    /// Moved along and across itself (m), in the plane that touches the surface.
    #[must_use]
    pub fn moved(&self, along: f64, across: f64) -> Self {
        Self {
            position: self.position + self.direction * along + self.across() * across,
            ..*self
        }
    }

    /// Turned about the normal (radians).
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self {
            direction: self.direction * cos + self.across() * sin,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_and_turns_are_in_the_surface() {
        let gauge = Gauge {
            position: DVec3::new(0.01, 0.02, 0.03),
            direction: DVec3::X,
            normal: DVec3::Z,
        };
        let moved = gauge.moved(1e-3, 2e-3);
        assert!(moved.position.distance(DVec3::new(0.011, 0.022, 0.03)) < 1e-12);
        assert_eq!((moved.direction, moved.normal), (DVec3::X, DVec3::Z));
        let turned = gauge.turned(std::f64::consts::FRAC_PI_2);
        assert!(turned.direction.distance(gauge.across()) < 1e-12);
        assert_eq!(turned.position, gauge.position);
    }

    #[test]
    fn on_a_mesh_it_lies_in_the_surface() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].to_vec();
        let mesh = TriMesh::from_checked(corners, vec![[0, 1, 2]]);
        let at = mesh.index().nearest(DVec3::new(0.2, 0.3, 0.5)).0;
        let gauge = Gauge::on(&mesh, at, DVec3::new(1.0, 0.0, 5.0));
        assert!(gauge.position.distance(DVec3::new(0.2, 0.3, 0.0)) < 1e-12);
        assert!(gauge.direction.distance(DVec3::X) < 1e-12);
        let upright = Gauge::on(&mesh, at, DVec3::Z);
        assert!(upright.direction.is_normalized() && upright.direction.dot(DVec3::Z).abs() < 1e-12);
    }
}
