//! Where a gauge is, by what a person can measure with callipers and a tape.

use glam::DVec3;

use super::inner::{GluedGauge, Inner};
use crate::mesh::flatten::Flat;

/// Another gauge nearby.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearbyGauge {
    /// Its number.
    pub number: usize,
    /// Straight from middle to middle (m).
    pub distance: f64,
}

/// Of one gauge.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmarks {
    /// From the lowest point of the part, along its axis (m).
    pub above_foot: f64,
    /// From its highest.
    pub below_top: f64,
    /// About the axis from the part's front, towards its right (degrees, -180 to 180).
    pub around_deg: f64,
    /// Of the gauge's middle from the nearest edge of the wall, straight (m), and that edge's nearest point (m).
    pub from_edge: Option<(f64, DVec3)>,
    /// How its direction is turned from the part's axis, clockwise as seen from inside (degrees, -90 to 90).
    pub turned_deg: f64,
    /// The nearest of the others, nearest first.
    pub neighbours: Vec<NearbyGauge>,
}

/// Of each gauge, in their order.
#[must_use]
pub fn landmarks(inner: &Inner) -> Vec<Landmarks> {
    let rims = rims(inner);
    let heights = inner
        .mesh
        .positions()
        .iter()
        .map(|p| inner.stance.coordinates(*p).z);
    let (foot, top) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| {
        (l.min(z), h.max(z))
    });
    let flat = Flat::of(&inner.mesh, inner.stance);
    let axis = flat.axis_point();
    (inner.gauges.iter())
        .map(|glued| of(inner, glued, &rims, (foot, top), axis))
        .collect()
}

fn of(
    inner: &Inner,
    glued: &GluedGauge,
    rims: &[[DVec3; 2]],
    (foot, top): (f64, f64),
    axis: Option<DVec3>,
) -> Landmarks {
    /// Of the others that are told.
    const NEAREST: usize = 3;
    let stance = &inner.stance;
    let height = stance.coordinates(glued.gauge.position).z;
    // A tube is walked around about its own axis, anything else about the origin of the file.
    let arm = glued.gauge.position - axis.unwrap_or(DVec3::ZERO);
    let around = arm.dot(stance.right()).atan2(arm.dot(stance.front()));
    let mut neighbours: Vec<NearbyGauge> = (inner.gauges.iter())
        .filter(|other| other.number != glued.number)
        .map(|other| NearbyGauge {
            number: other.number,
            distance: other.gauge.position.distance(glued.gauge.position),
        })
        .collect();
    neighbours.sort_by(|a, b| {
        a.distance
            .total_cmp(&b.distance)
            .then(a.number.cmp(&b.number))
    });
    neighbours.truncate(NEAREST);
    let nearest = |[a, b]: &[DVec3; 2]| {
        let along = *b - *a;
        let share = (glued.gauge.position - *a).dot(along) / along.length_squared().max(1e-30);
        let at = *a + along * share.clamp(0.0, 1.0);
        (at.distance(glued.gauge.position), at)
    };
    Landmarks {
        above_foot: height - foot,
        below_top: top - height,
        around_deg: around.to_degrees(),
        from_edge: rims.iter().map(nearest).min_by(|a, b| a.0.total_cmp(&b.0)),
        turned_deg: turned(inner, glued).to_degrees(),
        neighbours,
    }
}

/// Clockwise from up, as seen from inside: a gauge has no front and back.
fn turned(inner: &Inner, glued: &GluedGauge) -> f64 {
    let flat = |d: DVec3| d.reject_from_normalized(glued.gauge.normal);
    let up = flat(inner.stance.up());
    let up = if up.length() > 0.1 {
        up
    } else {
        flat(inner.stance.front())
    };
    let (up, right) = (
        up.normalize_or_zero(),
        glued.gauge.normal.cross(up).normalize_or_zero(),
    );
    let angle = glued
        .gauge
        .direction
        .dot(right)
        .atan2(glued.gauge.direction.dot(up));
    let half = std::f64::consts::FRAC_PI_2;
    if angle > half {
        angle - 2.0 * half
    } else if angle <= -half {
        angle + 2.0 * half
    } else {
        angle
    }
}

/// Where the wall ends, or turns sharply.
fn rims(inner: &Inner) -> Vec<[DVec3; 2]> {
    /// Cosine of the angle of a sharp edge.
    const EDGE: f64 = 0.7;
    let mesh = &inner.mesh;
    (mesh.edges().iter())
        .filter(|edge| match edge.triangles[..] {
            [s, t] => mesh.facet_normal(s).dot(mesh.facet_normal(t)) < EDGE,
            _ => true,
        })
        .map(|edge| [edge.a, edge.b].map(|v| mesh.positions()[v as usize]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauge::Gauge;
    use crate::limb::LimbSpec;
    use crate::mesh::stance::Stance;

    #[test]
    fn a_gauge_is_found_by_what_can_be_measured() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let stance = Stance::of(&mesh);
        let (low, high) = mesh.bounds();
        let gauge = |number: usize, z: f64, turned: f64| {
            let angle = 0.3 * number as f64;
            let out = stance.front() * angle.cos() + stance.right() * angle.sin();
            let right = out.cross(stance.up());
            GluedGauge {
                number,
                gauge: Gauge {
                    position: out * 31.8e-3 + stance.up() * z,
                    direction: stance.up() * turned.cos() + right * turned.sin(),
                    normal: out,
                },
                strain: [0.0; 2],
                rms: 0.0,
            }
        };
        let gauges = vec![
            gauge(1, 0.03, 0.2),
            gauge(2, 0.05, -0.4),
            gauge(3, 0.09, 3.0),
        ];
        let inner = Inner::outward(mesh, stance, gauges);
        let found = landmarks(&inner);
        assert!((found[0].above_foot - (0.03 - low.z)).abs() < 1e-9);
        assert!((found[0].above_foot + found[0].below_top - (high.z - low.z)).abs() < 1e-9);
        assert!(
            (found[1].around_deg - 0.6_f64.to_degrees()).abs() < 0.5,
            "{}",
            found[1].around_deg
        );
        let turned: Vec<f64> = found.iter().map(|l| l.turned_deg.to_radians()).collect();
        assert!((turned[0] - 0.2).abs() < 1e-9 && (turned[1] + 0.4).abs() < 1e-9);
        assert!((turned[2] - (3.0 - std::f64::consts::PI)).abs() < 1e-9);
        assert_eq!(found[0].neighbours[0].number, 2);
        assert!(
            found
                .iter()
                .all(|l| l.from_edge.is_some_and(|e| e.0 < 0.03))
        );
    }
}
