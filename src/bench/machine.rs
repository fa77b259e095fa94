//! How a machine moves a tip about a limb that it turns: the paper's bench, and printers like it.

use glam::{DMat3, DVec3};

use crate::units;

/// One axis of a machine, and what its numbers mean.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineAxis {
    /// Its letter in G-code.
    pub letter: char,
    /// Its number where what it moves stands at zero (mm, degrees).
    pub zero: f64,
    /// 1 or -1: whether its number rises with what it moves.
    pub sign: f64,
    /// The smallest and largest number that it may be sent to.
    pub range: [f64; 2],
    /// How fast it travels (mm/s, degrees/s).
    pub speed: f64,
}

impl MachineAxis {
    /// Its number for a way (mm) or an angle (degrees).
    #[must_use]
    pub fn number(&self, way: f64) -> f64 {
        // As it is sent: three digits behind the point.
        units::to_thousandths(self.zero + self.sign * way)
    }

    /// The way or angle of a number.
    #[must_use]
    pub fn way(&self, number: f64) -> f64 {
        (number - self.zero) * self.sign
    }

    /// Whether it may be sent there.
    #[must_use]
    pub fn reaches(&self, number: f64) -> bool {
        (self.range[0]..=self.range[1]).contains(&number)
    }
}

/// What feels how hard the tip presses: a channel of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipSensor {
    /// The board's channel, from 0.
    pub channel: usize,
    /// N a count; below zero where counts fall under a force.
    pub newton_per_count: f64,
}

/// A machine. The limb stands on a table that turns about the table's z; the tip, a ball, comes towards that axis from
/// the table's x at angle 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// For people.
    pub name: String,
    /// Of the tip's middle from the axis of the table.
    pub radial: MachineAxis,
    /// Of the tip's middle along that axis.
    pub along: MachineAxis,
    /// What the table is turned by (degrees).
    pub rotary: MachineAxis,
    /// Of the tip to the side, where there is such an axis.
    pub lateral: Option<MachineAxis>,
    /// Of the tip (m).
    pub tip_radius: f64,
    /// What stays free between tip and limb while anything but the tip's approach moves (m).
    pub clearance: f64,
    /// The steepest that a surface may lean against the tip's way (radians).
    pub most_tilt: f64,
    /// What the tip presses with is felt by.
    pub sensor: Option<TipSensor>,
    /// Commands before the first move, and where there are any, those that find the axes' ends again.
    pub begin: Vec<String>,
    /// See [`Self::begin`]; without them a machine that was reset is not gone on with.
    pub home: Vec<String>,
}

/// Where the middle of the tip stands, about the axis of the table (m), and how far the table is turned (radians).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// From the axis.
    pub radial: f64,
    /// To the side.
    pub lateral: f64,
    /// Along the axis.
    pub along: f64,
    /// Of the table.
    pub angle: f64,
}

impl Pose {
    /// The middle of the tip as the table sees it (m).
    #[must_use]
    pub fn on_table(&self) -> DVec3 {
        turned(-self.angle) * DVec3::new(self.radial, self.lateral, self.along)
    }

    /// Where the tip comes from as the table sees it, of unit length.
    #[must_use]
    pub fn from(&self) -> DVec3 {
        turned(-self.angle) * DVec3::X
    }
}

fn turned(angle: f64) -> DMat3 {
    DMat3::from_rotation_z(angle)
}

impl Machine {
    /// How the tip rests on a point of the table's frame (m) whose outward normal is `normal`, by the way that the machine can
    /// come; the table's angle nearest to `near` (radians) that the rotary axis reaches.
    ///
    /// # Errors
    /// Why the machine does not get there, in a few words.
    pub fn pose(&self, at: DVec3, normal: DVec3, near: f64) -> Result<Pose, String> {
        let middle = at + normal * self.tip_radius;
        // With an axis to the side the surface is turned towards the tip, else only its place.
        let faces = if self.lateral.is_some() {
            normal
        } else {
            middle
        };
        let angle = self.nearest_turn(-faces.y.atan2(faces.x), near)?;
        let seen = turned(angle) * middle;
        let pose = Pose {
            radial: seen.x,
            lateral: if self.lateral.is_some() { seen.y } else { 0.0 },
            along: seen.z,
            angle,
        };
        let tilt = (turned(angle) * normal).angle_between(DVec3::X);
        if tilt > self.most_tilt {
            return Err(format!(
                "the surface leans {:.0}° off the tip's way",
                tilt.to_degrees()
            ));
        }
        for (axis, number) in self.numbers(&pose) {
            if !axis.reaches(number) {
                return Err(format!("{}{number:.1} is outside its range", axis.letter));
            }
        }
        Ok(pose)
    }

    /// The turn that comes to the same angle and that the rotary axis reaches with the shortest way.
    fn nearest_turn(&self, angle: f64, near: f64) -> Result<f64, String> {
        let full = std::f64::consts::TAU;
        let first = angle + full * ((near - angle) / full).round();
        [0.0, 1.0, -1.0, 2.0, -2.0]
            .map(|turns| first + full * turns)
            .into_iter()
            .find(|turn| self.rotary.reaches(self.rotary.number(turn.to_degrees())))
            .ok_or_else(|| {
                format!(
                    "{}{:.0} is outside its range",
                    self.rotary.letter,
                    self.rotary.number(first.to_degrees())
                )
            })
    }

    /// The axes with their numbers at a pose; the tip's own way first.
    #[must_use]
    pub fn numbers(&self, pose: &Pose) -> Vec<(&MachineAxis, f64)> {
        let mut numbers = vec![
            (&self.radial, self.radial.number(units::mm(pose.radial))),
            (&self.along, self.along.number(units::mm(pose.along))),
            (&self.rotary, self.rotary.number(pose.angle.to_degrees())),
        ];
        if let Some(lateral) = &self.lateral {
            numbers.push((lateral, lateral.number(units::mm(pose.lateral))));
        }
        numbers
    }

    /// The pose of such numbers: radial, along, rotary and, where there is one, lateral.
    #[must_use]
    pub fn pose_of(&self, number: impl Fn(&MachineAxis) -> f64) -> Pose {
        let way = |axis: &MachineAxis| axis.way(number(axis));
        Pose {
            radial: units::from_mm(way(&self.radial)),
            along: units::from_mm(way(&self.along)),
            angle: way(&self.rotary).to_radians(),
            lateral: self
                .lateral
                .as_ref()
                .map_or(0.0, |axis| units::from_mm(way(axis))),
        }
    }

    /// The board that is read must have the channel of the tip.
    #[must_use]
    pub fn force(&self, counts: &[f64], rest: &[f64]) -> Option<f64> {
        let sensor = self.sensor?;
        let (count, rest) = (counts.get(sensor.channel)?, rest.get(sensor.channel)?);
        Some((count - rest) * sensor.newton_per_count)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn axis(letter: char, range: [f64; 2], speed: f64) -> MachineAxis {
        MachineAxis {
            letter,
            zero: 0.0,
            sign: 1.0,
            range,
            speed,
        }
    }

    /// The paper's bench: x and z of a printer, and a motor that turns the limb.
    pub fn paper() -> Machine {
        Machine {
            name: "Paper".into(),
            radial: MachineAxis {
                zero: 120.0,
                sign: -1.0,
                ..axis('X', [0.0, 119.0], 40.0)
            },
            along: axis('Z', [-10.0, 200.0], 10.0),
            rotary: axis('E', [-360.0, 360.0], 90.0),
            lateral: None,
            tip_radius: 4e-3,
            clearance: 8e-3,
            most_tilt: 0.5,
            sensor: Some(TipSensor {
                channel: 3,
                newton_per_count: 0.05,
            }),
            begin: vec!["G90".into()],
            home: vec!["G28".into()],
        }
    }

    #[test]
    fn the_tip_rests_on_the_place_and_comes_along_its_axis() {
        let mut machine = paper();
        let (at, normal) = (DVec3::new(0.0, 30e-3, 50e-3), DVec3::Y);
        let pose = machine.pose(at, normal, 0.0).unwrap();
        assert!((pose.radial - 34e-3).abs() < 1e-12 && (pose.along - 50e-3).abs() < 1e-12);
        assert!((pose.angle.to_degrees() + 90.0).abs() < 1e-9);
        assert!((pose.on_table() - DVec3::new(0.0, 34e-3, 50e-3)).length() < 1e-12);
        assert!((pose.from() - DVec3::Y).length() < 1e-12);
        let numbers: Vec<f64> = machine.numbers(&pose).iter().map(|n| n.1).collect();
        assert_eq!(numbers, [86.0, 50.0, -90.0]);
        let back = machine.pose_of(|axis| {
            let all = machine.numbers(&pose);
            all.iter().find(|n| n.0 == axis).unwrap().1
        });
        assert!((back.on_table() - pose.on_table()).length() < 1e-9);
        // A place beside the middle: without an axis to the side it is turned there, with one its surface faces the tip.
        let at = DVec3::new(20e-3, 10e-3, 0.0);
        let turned = machine.pose(at, DVec3::X, 0.0).unwrap();
        assert!(turned.lateral == 0.0 && turned.angle < -0.3);
        machine.lateral = Some(axis('Y', [-50.0, 50.0], 40.0));
        let aside = machine.pose(at, DVec3::X, 0.0).unwrap();
        assert!((aside.lateral - 10e-3).abs() < 1e-12 && aside.angle.abs() < 1e-12);
    }

    #[test]
    fn what_is_out_of_reach_is_said() {
        let machine = paper();
        let pose = |at: DVec3, normal: DVec3| machine.pose(at * 1e-3, normal, 0.0);
        let far = pose(DVec3::new(30.0, 0.0, 300.0), DVec3::X);
        assert!(far.is_err_and(|why| why.contains("Z300.0")));
        let steep = pose(
            DVec3::new(30.0, 0.0, 50.0),
            DVec3::new(1.0, 0.0, 1.0).normalize(),
        );
        assert!(steep.is_err_and(|why| why.contains("leans")));
        // The shortest way round, and never beyond the cable's end.
        let at = DVec3::new(-30e-3, 1e-3, 0.0);
        let normal = DVec3::NEG_X;
        for near in [-6.0, -3.0, 0.0, 3.0, 6.0] {
            let angle = machine.pose(at, normal, near).unwrap().angle;
            assert!(angle.to_degrees().abs() <= 360.0 && (angle - near).abs() < 3.5);
        }
    }
}
