//! A tube-like part laid flat: the angle about an axis becomes a length, the height stays.

use glam::{DVec2, DVec3};

use super::SurfacePoint;
use super::TriMesh;
use super::locate::SurfaceIndex;
use super::stance::Stance;

/// Cylinder coordinates about an axis of the part. `s` runs from 0 to the circumference at the mean
/// radius, with the seam opposite to `zero`; lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unrolling {
    /// A point of the axis (m).
    pub origin: DVec3,
    /// Unit direction of the axis, upwards.
    pub axis: DVec3,
    /// Direction of the middle of the unrolled strip, at right angles to the axis.
    pub zero: DVec3,
    /// Mean radius (m): what turns an angle into a length.
    pub radius: f64,
    /// Lowest and highest point along the axis, relative to `origin` (m).
    pub height: (f64, f64),
}

/// An axis of the file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    #[default]
    Z,
}

impl Axis {
    /// Its unit direction.
    #[must_use]
    pub fn direction(self) -> DVec3 {
        match self {
            Self::X => DVec3::X,
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }
}

impl Unrolling {
    /// The axis runs through the centre of the circle that fits the outermost vertices best (least squares,
    /// Kåsa), so that an open arc is unrolled about its own centre, and a frame inside counts for nothing. The
    /// middle of the strip is the part's front.
    #[must_use]
    pub fn of(mesh: &TriMesh, stance: Stance) -> Self {
        let (direction, zero, side) = (stance.up(), stance.front(), stance.right());
        let flat: Vec<DVec2> = mesh
            .positions()
            .iter()
            .map(|p| DVec2::new(p.dot(zero), p.dot(side)))
            .collect();
        let along: Vec<f64> = (mesh.positions().iter())
            .map(|p| p.dot(direction))
            .collect();
        let height = (along.iter()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &z| {
            (l.min(z), h.max(z))
        });
        let (centre, _) = fit_circle(&flat);
        let (centre, radius) = fit_circle(&outermost(&flat, &along, height, centre));
        Self {
            origin: zero * centre.x + side * centre.y,
            axis: direction,
            zero,
            radius,
            height,
        }
    }

    /// (s, z) of a point (m).
    #[must_use]
    pub fn flat(&self, p: DVec3) -> DVec2 {
        let r = p - self.origin;
        let angle = r.dot(self.axis.cross(self.zero)).atan2(r.dot(self.zero));
        DVec2::new(
            (angle + std::f64::consts::PI) * self.radius,
            r.dot(self.axis),
        )
    }

    /// The full turn as a length (m).
    #[must_use]
    pub fn circumference(&self) -> f64 {
        std::f64::consts::TAU * self.radius
    }

    /// The outermost surface point at (s, z), if the part has one there.
    #[must_use]
    pub fn lift(&self, index: &SurfaceIndex, flat: DVec2) -> Option<SurfacePoint> {
        let angle = flat.x / self.radius - std::f64::consts::PI;
        let outward = self.zero * angle.cos() + self.axis.cross(self.zero) * angle.sin();
        let far = 100.0 * (self.radius + self.height.1 - self.height.0);
        let start = self.origin + self.axis * flat.y + outward * far;
        let (at, distance) = index.ray(start, -outward)?;
        // Beyond the axis the ray would come out on the other side of the limb.
        (distance < far).then_some(at)
    }

    /// A square lattice of `spacing` (m) in (s, z), carried onto the part, row by row: it begins half a
    /// step from the seam and from the lower end.
    #[must_use]
    pub fn lattice(&self, index: &SurfaceIndex, spacing: f64) -> Vec<SurfacePoint> {
        let steps = |length: f64| {
            (0..(length / spacing + 0.5).floor() as usize).map(move |i| (i as f64 + 0.5) * spacing)
        };
        steps(self.height.1 - self.height.0)
            .flat_map(|z| {
                steps(self.circumference())
                    .filter_map(move |s| self.lift(index, DVec2::new(s, self.height.0 + z)))
            })
            .collect()
    }
}

/// Of points around a centre, with their heights, those that none lies far outside of.
fn outermost(
    points: &[DVec2],
    along: &[f64],
    (low, high): (f64, f64),
    centre: DVec2,
) -> Vec<DVec2> {
    const SECTORS: f64 = 36.0;
    const LEVELS: f64 = 32.0;
    /// Of the farthest radius nearby: what is nearer to the axis is not of the same wall.
    const SAME_WALL: f64 = 0.8;
    let level = LEVELS / (high - low).max(f64::MIN_POSITIVE);
    let cell = |p: &DVec2, z: f64| -> (u32, u32) {
        let turn = (p - centre).to_angle() / std::f64::consts::TAU + 0.5;
        ((turn * SECTORS) as u32, ((z - low) * level) as u32)
    };
    let mut farthest = std::collections::BTreeMap::<(u32, u32), f64>::new();
    for (p, &z) in points.iter().zip(along) {
        let radius = farthest.entry(cell(p, z)).or_default();
        *radius = radius.max(p.distance(centre));
    }
    (points.iter().zip(along))
        .filter(|&(p, &z)| p.distance(centre) >= SAME_WALL * farthest[&cell(p, z)])
        .map(|(p, _)| *p)
        .collect()
}

fn fit_circle(points: &[DVec2]) -> (DVec2, f64) {
    let n = points.len() as f64;
    let mean = points.iter().sum::<DVec2>() / n;
    let (mut uu, mut uv, mut vv, mut ur, mut vr) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let d = *p - mean;
        let r = d.length_squared();
        uu += d.x * d.x;
        uv += d.x * d.y;
        vv += d.y * d.y;
        ur += d.x * r;
        vr += d.y * r;
    }
    let det = uu * vv - uv * uv;
    // Points on a line (a flat part seen edge-on) have no circle: keep their middle.
    let offset = if det > 1e-9 * (uu + vv).powi(2) {
        DVec2::new(ur * vv - vr * uv, vr * uu - ur * uv) / (2.0 * det)
    } else {
        DVec2::ZERO
    };
    let centre = mean + offset;
    let radius = points.iter().map(|p| p.distance(centre)).sum::<f64>() / n;
    (centre, radius)
}
