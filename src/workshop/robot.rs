//! Gauges as frames of a robot's description.

use std::fmt::Write as _;

use glam::{DMat3, DVec3};

use super::inner::GluedGauge;

/// A frame at a gauge: its place (m), and the turn of its axes: x along the gauge, z from the inside to the outside.
#[must_use]
pub fn frame(glued: &GluedGauge) -> (DVec3, DMat3) {
    let z = glued.gauge.normal.normalize_or(DVec3::Z);
    let x = glued.gauge.direction.reject_from_normalized(z);
    let x = x.normalize_or(z.any_orthonormal_vector());
    (glued.gauge.position, DMat3::from_cols(x, z.cross(x), z))
}

/// Roll, pitch and yaw (radians) of a turn, as URDF has them: about the fixed axes x, y and z, one after the other.
#[must_use]
pub fn roll_pitch_yaw(turn: &DMat3) -> [f64; 3] {
    /// Of the cosine of the pitch: below, roll and yaw turn about the same axis.
    const LOCKED: f64 = 1e-9;
    let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
    let level = x.x.hypot(x.y);
    let pitch = (-x.z).atan2(level);
    if level < LOCKED {
        return [(-z.y).atan2(y.y), pitch, 0.0];
    }
    [y.z.atan2(z.z), pitch, x.y.atan2(x.x)]
}

/// The turn of a roll, a pitch and a yaw (radians).
#[must_use]
pub fn turn_of([roll, pitch, yaw]: [f64; 3]) -> DMat3 {
    DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll)
}

/// A URDF fragment with a link and a fixed joint for each gauge, on the link that the limb is.
#[must_use]
pub fn urdf(gauges: &[GluedGauge], robot: &str, link: &str) -> String {
    let (robot, link) = (escaped(robot), escaped(link));
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!-- A frame for each gauge: x along it, z from the inside to the outside. Metres and radians in the frame of \"{link}\".\n     Copy the links and joints into the robot's own description. -->\n<robot name=\"{robot}\">\n  <link name=\"{link}\"/>\n"
    );
    for glued in gauges {
        let (place, turn) = frame(glued);
        let [roll, pitch, yaw] = roll_pitch_yaw(&turn);
        let name = format!("{link}_gauge_{}", glued.number);
        let _ = write!(
            text,
            "  <link name=\"{name}\"/>\n  <joint name=\"{name}_joint\" type=\"fixed\">\n    <parent link=\"{link}\"/>\n    <child link=\"{name}\"/>\n    <origin xyz=\"{:.6} {:.6} {:.6}\" rpy=\"{roll:.6} {pitch:.6} {yaw:.6}\"/>\n  </joint>\n",
            place.x, place.y, place.z
        );
    }
    text.push_str("</robot>\n");
    text
}

/// Text inside an attribute; two dashes would end the comment.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace("--", "-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauge::Gauge;

    #[test]
    fn angles_are_those_of_the_turn() {
        for k in 0..200 {
            let a = f64::from(k);
            let angles = [a.sin() * 3.1, (1.7 * a).cos() * 1.57, (0.3 * a).sin() * 3.1];
            let turn = turn_of(angles);
            let again = turn_of(roll_pitch_yaw(&turn));
            assert!(
                (turn - again)
                    .to_cols_array()
                    .iter()
                    .all(|x| x.abs() < 1e-9),
                "{angles:?}"
            );
        }
        for pitch in [-1.0, 1.0] {
            let turn = turn_of([0.4, pitch * std::f64::consts::FRAC_PI_2, -0.9]);
            let again = turn_of(roll_pitch_yaw(&turn));
            assert!(
                (turn - again)
                    .to_cols_array()
                    .iter()
                    .all(|x| x.abs() < 1e-7)
            );
        }
    }

    #[test]
    fn a_frame_lies_along_its_gauge() {
        let glued = GluedGauge {
            number: 3,
            gauge: Gauge {
                position: DVec3::new(0.01, 0.02, 0.03),
                direction: DVec3::new(0.6, 0.0, 0.8),
                normal: DVec3::Y,
            },
            strain: [0.0; 2],
            rms: 0.0,
        };
        let (_, turn) = frame(&glued);
        assert!((turn * DVec3::X - glued.gauge.direction).length() < 1e-12);
        assert!((turn * DVec3::Z - glued.gauge.normal).length() < 1e-12);
        assert!((turn.determinant() - 1.0).abs() < 1e-12);
        let text = urdf(&[glued], "r\"obot", "shin");
        assert!(text.contains("<child link=\"shin_gauge_3\"/>") && text.contains("r&quot;obot"));
        assert!(
            text.contains("xyz=\"0.010000 0.020000 0.030000\""),
            "{text}"
        );
    }
}
