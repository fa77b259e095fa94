//! Ranges of the table [live].

use crate::project::Project;
use crate::project::value::{BadValue, check};

impl Project {
    pub(super) fn check_live(&self) -> Result<(), BadValue> {
        let live = &self.live;
        for (key, rule, value, most) in [
            (
                "live.gauge_factor",
                "above 0 and at most 10000",
                live.gauge_factor,
                1e4,
            ),
            (
                "live.largest_force_n",
                "above 0 and at most 1000000",
                live.largest_force_n,
                1e6,
            ),
        ] {
            check(key, rule, value, value > 0.0 && value <= most)?;
        }
        let arms = f64::from(live.active_arms);
        check(
            "live.active_arms",
            "between 1 and 4",
            arms,
            (1.0..=4.0).contains(&arms),
        )?;
        check(
            "live.stiffness_percent",
            "between 0 and 50",
            live.stiffness_percent,
            (0.0..=50.0).contains(&live.stiffness_percent),
        )?;
        check(
            "live.friction_percent",
            "between 0 and 100",
            live.friction_percent,
            (0.0..=100.0).contains(&live.friction_percent),
        )?;
        let error = live.model_error;
        check(
            "live.model_error",
            "between 0 and 1",
            error,
            (0.0..=1.0).contains(&error),
        )?;
        check(
            "live.drift_s",
            "zero or more",
            live.drift_s,
            live.drift_s >= 0.0,
        )?;
        let most = crate::wire::MOST_CHANNELS;
        for &channel in &live.channels {
            check(
                "live.channels",
                "channels between 0 and 63",
                channel as f64,
                channel < most,
            )?;
        }
        if let Some((first, second, channel)) = live.shared_channel() {
            return Err(BadValue {
                key: "live.channels".to_owned(),
                rule: "another channel for each gauge".into(),
                value: format!("{channel} for gauges {} and {}", first + 1, second + 1),
            });
        }
        for glued in &live.glued {
            let sound = [
                glued.gain,
                glued.along_mm,
                glued.across_mm,
                glued.turned_degrees,
            ];
            check(
                "live.glued.gain",
                "a number above zero, and the other keys finite",
                glued.gain,
                glued.gain > 0.0 && sound.iter().all(|v| v.is_finite()),
            )?;
            for &value in glued.site.iter().flatten() {
                let rule = "three millimetres and three parts of a direction, all of them numbers";
                check("live.glued.site", rule, value, value.is_finite())?;
            }
            for &value in glued.covariance.iter().flatten() {
                let known = value.abs() <= MOST_DOUBT;
                check(
                    "live.glued.covariance",
                    "ten numbers between -1e6 and 1e6",
                    value,
                    known,
                )?;
            }
        }
        Ok(())
    }
}

/// Of a covariance: of more nobody would call gauges calibrated.
const MOST_DOUBT: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::ChosenSite;

    #[test]
    fn a_channel_belongs_to_one_gauge() {
        let mut project = Project::around("limb.stl", None);
        project.live.channels = vec![4, 2, 0, 2];
        let said = project.check_live().unwrap_err().to_string();
        let expected =
            "live.channels must be another channel for each gauge, but is 2 for gauges 2 and 4";
        assert_eq!(said, expected);
        project.live.channels = vec![4, 2, 0, 1];
        project.check_live().unwrap();
        let site = ChosenSite {
            position_mm: [1.0, 2.0, 3.0],
            direction: [0.0, 0.0, 1.0],
        };
        project.live.check_gauges(&vec![site.clone(); 4]).unwrap();
        let said = project
            .live
            .check_gauges(&vec![site; 5])
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("live.channels") && said.contains("4 for 5 gauges"),
            "{said}"
        );
        for bad in [0.0, -1.0, 1e300, f64::NAN, f64::INFINITY] {
            project.live.gauge_factor = bad;
            assert!(project.check_live().is_err(), "{bad}");
        }
    }
}
