//! Finding places on a surface: the nearest point, and what a ray hits. The tree is parry's.

use glam::DVec3;
use parry3d_f64::query::{
    PointQueryWithLocation, Ray, details::local_ray_intersection_with_triangle,
};
use parry3d_f64::shape::{CompositeShapeRef, TriMesh as ParryMesh, Triangle};

use super::point::SurfacePoint;
use crate::bounds::Bounds;

/// A bounding-volume tree over one surface; as immutable as the surface it was built from.
///
/// The tree has its tolerances for things about one across, so the surface is kept in it at that size.
#[derive(Debug)]
pub struct SurfaceIndex {
    tree: ParryMesh,
    centre: DVec3,
    /// Metres to one unit of the tree.
    size: f64,
}

impl SurfaceIndex {
    /// Over the triangles of a validated mesh, at their places or, where its vertices have moved, at others (m).
    ///
    /// # Panics
    /// When there are no triangles or they refer to missing vertices.
    #[must_use]
    pub fn of(mut positions: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let bounds = Bounds::around(positions.iter().copied());
        let centre = (bounds.lower + bounds.upper) / 2.0;
        let size = bounds.size().max_element();
        for p in &mut positions {
            *p = (*p - centre) / size;
        }
        let tree =
            ParryMesh::new(positions, triangles.to_vec()).expect("a validated mesh has triangles");
        Self { tree, centre, size }
    }

    fn scaled(&self, point: DVec3) -> DVec3 {
        (point - self.centre) / self.size
    }

    /// The nearest point of the surface and how far it is (m).
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> (SurfacePoint, f64) {
        let point = self.scaled(point);
        let (projection, (triangle, location)) =
            self.tree.project_local_point_and_get_location(point, false);
        let barycentric = location.barycentric_coordinates().unwrap_or([1.0 / 3.0; 3]);
        let at = SurfacePoint {
            triangle,
            barycentric,
        };
        (at, projection.point.distance(point) * self.size)
    }

    /// How far the surface is from a point (m), where it is nearer than `most` (m): the nearer that is, the faster.
    #[must_use]
    pub fn distance_within(&self, point: DVec3, most: f64) -> Option<f64> {
        let point = self.scaled(point);
        let (_, projection) =
            CompositeShapeRef(&self.tree).project_local_point(point, most / self.size, false)?;
        Some(projection.point.distance(point) * self.size)
    }

    /// As [`Self::nearest`], among some triangles only.
    ///
    /// # Panics
    /// When there are none.
    #[must_use]
    pub fn nearest_of(&self, triangles: &[u32], point: DVec3) -> (SurfacePoint, f64) {
        let point = self.scaled(point);
        let projections = triangles.iter().map(|&triangle| {
            let (projection, location) =
                (self.tree.triangle(triangle)).project_local_point_and_get_location(point, false);
            let squared = projection.point.distance_squared(point);
            (squared, triangle, location)
        });
        let nearest = projections.min_by(|a, b| a.0.total_cmp(&b.0));
        let (squared, triangle, location) = nearest.expect("there are triangles");
        let at = SurfacePoint {
            triangle,
            barycentric: location.barycentric_coordinates().unwrap_or([1.0 / 3.0; 3]),
        };
        (at, squared.sqrt() * self.size)
    }

    /// The triangles no farther than `radius` (m) from a point, of these or of all; nothing where it would be more than
    /// `most` of all.
    #[must_use]
    pub fn within(
        &self,
        of: Option<&[u32]>,
        point: DVec3,
        radius: f64,
        most: usize,
    ) -> Option<Vec<u32>> {
        let scaled = self.scaled(point);
        let squared = (radius / self.size).powi(2);
        let is_near = |triangle: &u32| {
            let (projection, _) =
                (self.tree.triangle(*triangle)).project_local_point_and_get_location(scaled, false);
            projection.point.distance_squared(scaled) <= squared
        };
        if let Some(of) = of {
            return Some(of.iter().copied().filter(is_near).collect());
        }
        let bounds: Vec<u32> = self.bounds_near(point, radius).take(most + 1).collect();
        (bounds.len() <= most).then(|| bounds.into_iter().filter(is_near).collect())
    }

    /// As [`Self::nearest`], for points that may lie on the triangle of the last one: those need no search.
    #[must_use]
    pub fn nearest_from(&self, guess: u32, point: DVec3) -> SurfacePoint {
        /// A point this near (in sizes of the surface) lies on a triangle.
        const ON_IT: f64 = 1e-13;
        let scaled = self.scaled(point);
        let (projection, location) =
            (self.tree.triangle(guess)).project_local_point_and_get_location(scaled, false);
        match location.barycentric_coordinates() {
            Some(barycentric) if projection.point.distance(scaled) < ON_IT => SurfacePoint {
                triangle: guess,
                barycentric,
            },
            _ => self.nearest(point).0,
        }
    }

    /// The first point a ray meets and its distance in units of `direction`.
    #[must_use]
    pub fn ray(&self, origin: DVec3, direction: DVec3) -> Option<(SurfacePoint, f64)> {
        let ray = Ray::new(self.scaled(origin), direction);
        let (triangle, time) =
            CompositeShapeRef(&self.tree).cast_local_ray(&ray, f64::MAX, false)?;
        let Triangle { a, b, c } = self.tree.triangle(triangle);
        let barycentric = local_ray_intersection_with_triangle(a, b, c, &ray)
            .map_or([1.0 / 3.0; 3], |(_, weights)| weights.to_array());
        let at = SurfacePoint {
            triangle,
            barycentric,
        };
        Some((at, time * self.size))
    }

    /// Triangles whose bounds come within `radius` of a point (m), in rising order.
    #[must_use]
    pub fn triangles_near(&self, point: DVec3, radius: f64) -> Vec<u32> {
        let mut triangles: Vec<u32> = self.bounds_near(point, radius).collect();
        triangles.sort_unstable();
        triangles
    }

    fn bounds_near(&self, point: DVec3, radius: f64) -> impl Iterator<Item = u32> {
        let (point, reach) = (self.scaled(point), DVec3::splat(radius / self.size));
        let (lower, upper) = (point - reach, point + reach);
        self.tree.bvh().leaves(move |node| {
            let aabb = node.aabb();
            aabb.mins.cmple(upper).all() && aabb.maxs.cmpge(lower).all()
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::TriMesh;

    #[test]
    fn rays_and_projections_land_where_they_should() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&p, &[[0, 1, 2]], 0).unwrap();
        let index = mesh.index();
        let (at, t) = index.ray(DVec3::new(0.2, 0.3, 2.0), DVec3::NEG_Z).unwrap();
        assert!((t - 2.0).abs() < 1e-12);
        assert!(mesh.point(at).distance(DVec3::new(0.2, 0.3, 0.0)) < 1e-12);
        let (at, d) = index.nearest(DVec3::new(-1.0, 0.5, 0.0));
        assert!((d - 1.0).abs() < 1e-12);
        assert!(mesh.point(at).distance(DVec3::new(0.0, 0.5, 0.0)) < 1e-12);
        assert!(index.ray(DVec3::splat(2.0), DVec3::X).is_none());
        for point in [DVec3::new(0.3, 0.4, 0.0), DVec3::new(3.0, -1.0, 2.0)] {
            assert_eq!(index.nearest_from(0, point), index.nearest(point).0);
            let (at, distance) = index.nearest(point);
            assert_eq!(index.nearest_of(&[0], point), (at, distance));
            assert_eq!(
                index.distance_within(point, 1.01 * distance + 1e-9),
                Some(distance)
            );
            assert_eq!(index.within(None, point, distance + 1e-9, 1), Some(vec![0]));
            assert_eq!(index.within(None, point, distance + 1e-9, 0), None);
            let none = (distance > 0.0).then(Vec::new);
            let nearer = index.within(Some(&[0]), point, 0.99 * distance, 0);
            assert_eq!(nearer.filter(|_| distance > 0.0), none);
        }
        assert_eq!(index.distance_within(DVec3::splat(3.0), 1.0), None);
        assert_eq!(index.triangles_near(DVec3::new(1.2, 0.0, 0.0), 0.3), [0]);
    }

    #[test]
    fn a_mesh_grows_its_index_once() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&p, &[[0, 1, 2]], 0).unwrap();
        let index = mesh.index();
        assert!(Arc::ptr_eq(index, mesh.index()));
        assert!(Arc::ptr_eq(index, mesh.clone().index()));
        // Another surface has another.
        let turned = mesh.turned_over();
        assert!(!Arc::ptr_eq(index, turned.index()));
    }
}
