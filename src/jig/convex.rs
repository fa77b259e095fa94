//! Whether convex bodies meet each other or a part, also while they move. The geometry is parry's.

use glam::{DVec2, DVec3};
use parry3d_f64::math::Pose;
use parry3d_f64::query::intersection_test;
use parry3d_f64::shape::{ConvexPolyhedron, TriMesh as ParryMesh};

use super::frame::JigFrame;
use crate::mesh::TriMesh;

/// The hull of these points (mm).
pub type Hull = Vec<DVec3>;

/// A part that is in the way, in a frame.
pub struct Obstacle {
    mesh: ParryMesh,
}

impl Obstacle {
    /// Nothing for a part without triangles.
    #[must_use]
    pub fn new(part: &TriMesh, frame: &JigFrame) -> Option<Self> {
        let places = part.positions().iter().map(|&p| frame.here(p)).collect();
        let mesh = ParryMesh::new(places, part.triangles().to_vec()).ok()?;
        Some(Self { mesh })
    }

    /// Whether a body meets the part, seen from a line beside the frame's (mm). What is flat does not.
    #[must_use]
    pub fn meets(&self, body: &[DVec3], beside: DVec2) -> bool {
        let Some(hull) = ConvexPolyhedron::from_convex_hull(body) else {
            return false;
        };
        let at = Pose::from_translation(beside.extend(0.0));
        intersection_test(&at, &hull, &Pose::IDENTITY, &self.mesh)
            .ok()
            .is_none_or(|found| found.intersecting)
    }
}

/// Whether two bodies meet.
#[must_use]
pub fn meet(one: &[DVec3], other: &[DVec3]) -> bool {
    // Most do not even where the boxes around them are looked at, which takes no hull.
    if let (Some((a, b)), Some((c, d))) = (around(one), around(other))
        && (b.cmplt(c).any() || d.cmplt(a).any())
    {
        return false;
    }
    let hull = |points: &[DVec3]| ConvexPolyhedron::from_convex_hull(points);
    let (Some(one), Some(other)) = (hull(one), hull(other)) else {
        return false;
    };
    let here = Pose::IDENTITY;
    let found = intersection_test(&here, &one, &here, &other).ok();
    found.is_none_or(|found| found.intersecting)
}

/// The least and the largest coordinates of points (mm).
fn around(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let of = |pick: fn(DVec3, DVec3) -> DVec3| points.iter().copied().reduce(pick);
    of(DVec3::min).zip(of(DVec3::max))
}

/// All that a body passes on a straight way.
#[must_use]
pub fn swept(body: &[DVec3], by: DVec3) -> Hull {
    body.iter().flat_map(|&p| [p, p + by]).collect()
}

/// The corners of a box: from and to along x, y and z, turned about z by an angle (radians).
#[must_use]
pub fn block(from: DVec3, to: DVec3, angle: f64) -> Hull {
    let turn = DVec2::from_angle(angle);
    (0..8)
        .map(|k| {
            let of = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            let flat = DVec2::new(of(0, from.x, to.x), of(1, from.y, to.y));
            turn.rotate(flat).extend(of(2, from.z, to.z))
        })
        .collect()
}

/// A round bar along z, as a prism around it.
#[must_use]
pub fn bar(radius: f64, from: f64, to: f64) -> Hull {
    const SIDES: u32 = 32;
    let around = radius / (std::f64::consts::PI / f64::from(SIDES)).cos();
    (0..SIDES)
        .flat_map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(SIDES);
            let flat = DVec2::from_angle(angle) * around;
            [flat.extend(from), flat.extend(to)]
        })
        .collect()
}

/// The corners of the convex hull of points in a plane, around it (A. M. Andrew 1979).
#[must_use]
pub fn outline(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut around = half(&mut points.iter().copied());
    around.extend(half(&mut points.iter().rev().copied()));
    around
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_meet_where_they_do() {
        let cube = block(DVec3::ZERO, DVec3::ONE, 0.0);
        let beyond: Hull = cube.iter().map(|p| *p + DVec3::X * 1.5).collect();
        assert!(!meet(&cube, &beyond));
        assert!(meet(&swept(&cube, DVec3::X), &beyond));
        // Turned by an eighth it reaches farther.
        let turned = block(DVec3::splat(-0.5), DVec3::splat(0.5), 0.0);
        let beside: Hull = turned.iter().map(|p| *p + DVec3::X * 1.1).collect();
        assert!(!meet(&turned, &beside));
        let eighth = block(
            DVec3::splat(-0.5),
            DVec3::splat(0.5),
            std::f64::consts::FRAC_PI_4,
        );
        assert!(meet(&eighth, &beside));
        assert!(meet(&bar(2.0, 0.0, 5.0), &cube));
    }

    #[test]
    fn a_hull_is_the_corners_around() {
        let inside = [(0.5, 0.5), (0.2, 0.7), (0.5, 0.0)];
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let all = inside.iter().chain(&corners);
        let found = outline(all.map(|&p| DVec2::from(p)).collect());
        assert_eq!(found, corners.map(DVec2::from));
    }
}
