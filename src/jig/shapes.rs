//! Facetss that are cut out of each other and joined. The geometry is Manifold's, in its Rust port.

use glam::DVec3;
use manifold_rust::linalg::Vec3;
use manifold_rust::manifold::Manifold;
use manifold_rust::types::MeshGL64;

use crate::mesh::Facets;

/// A solid (mm).
pub type JigSolid = Manifold;

/// Facets of a circle.
const AROUND: i32 = 48;

fn vector(p: DVec3) -> Vec3 {
    Vec3::new(p.x, p.y, p.z)
}

/// A box between two corners.
#[must_use]
pub fn cuboid(from: DVec3, to: DVec3) -> JigSolid {
    JigSolid::cube(vector(to - from), false).translate(vector(from))
}

/// A cylinder along z around the origin, between two heights.
#[must_use]
pub fn cylinder(radius: f64, from: f64, to: f64) -> JigSolid {
    JigSolid::cylinder(to - from, radius, radius, AROUND).translate(Vec3::new(0.0, 0.0, from))
}

/// A cylinder along x at a place, between two distances.
#[must_use]
pub fn hole_along_x(radius: f64, x: [f64; 2], y: f64, z: f64) -> JigSolid {
    cylinder(radius, x[0], x[1])
        .rotate(0.0, 90.0, 0.0)
        .translate(Vec3::new(0.0, y, z))
}

/// A cylinder along y at a place, between two distances.
#[must_use]
pub fn hole_along_y(radius: f64, x: f64, y: [f64; 2], z: f64) -> JigSolid {
    cylinder(radius, -y[1], -y[0])
        .rotate(90.0, 0.0, 0.0)
        .translate(Vec3::new(x, 0.0, z))
}

/// Moved.
#[must_use]
pub fn moved(shape: &JigSolid, by: DVec3) -> JigSolid {
    shape.translate(vector(by))
}

/// Turned about z (radians).
#[must_use]
pub fn turned(shape: &JigSolid, angle: f64) -> JigSolid {
    shape.rotate(0.0, 0.0, angle.to_degrees())
}

/// What points say of a hull.
#[must_use]
pub fn hull(points: &[DVec3]) -> JigSolid {
    JigSolid::hull(&points.iter().map(|&p| vector(p)).collect::<Vec<_>>())
}

/// All of them as one.
#[must_use]
pub fn joined(shapes: Vec<JigSolid>) -> JigSolid {
    let mut shapes = shapes.into_iter();
    let first = shapes.next().unwrap_or_else(JigSolid::empty);
    shapes.fold(first, |all, next| all.union(&next))
}

/// A solid in a frame of its own put elsewhere: where its x, y and z point, and its origin.
#[must_use]
pub fn placed(shape: &JigSolid, [x, y, z]: [DVec3; 3], at: DVec3) -> JigSolid {
    let of = read(shape);
    let positions = of.positions.iter();
    let positions = positions.map(|p| at + x * p.x + y * p.y + z * p.z);
    closed(&Facets {
        positions: positions.collect(),
        triangles: of.triangles,
    })
}

/// A solid of triangles that close.
#[must_use]
pub fn closed(solid: &Facets) -> JigSolid {
    JigSolid::from_mesh_gl64(&MeshGL64 {
        num_prop: 3,
        vert_properties: solid.positions.iter().flat_map(DVec3::to_array).collect(),
        tri_verts: (solid.triangles.iter().flatten())
            .map(|&v| u64::from(v))
            .collect(),
        ..MeshGL64::default()
    })
}

/// Its triangles.
#[must_use]
pub fn read(shape: &JigSolid) -> Facets {
    let mesh = shape.get_mesh_gl64(-1);
    let each = (mesh.num_prop as usize).max(3);
    Facets {
        positions: (mesh.vert_properties.chunks_exact(each))
            .map(|p| DVec3::new(p[0], p[1], p[2]))
            .collect(),
        triangles: (mesh.tri_verts.chunks_exact(3))
            .map(|t| [t[0] as u32, t[1] as u32, t[2] as u32])
            .collect(),
    }
}
