//! Which numbers a project may hold. Beyond these nobody can have meant them, and what is computed from them
//! would overflow, or never end, without a word.

mod live;

use std::ops::RangeInclusive;

use glam::DVec3;

use super::value::{BadValue, all_bounded, bounded, check, counted, number};
use super::{ChosenSite, PartAxis, Project, SupportKeys};
use crate::dataset::Signal;
use crate::elasticity::support::MOST;
use crate::evaluation::failures::MOST_FAILED;

/// How many gauges can be asked for, how many touches, and how many neighbours the edge filter looks at: in a
/// file as in the window.
pub const GAUGES: RangeInclusive<usize> = 1..=10_000;
/// `touch.count`.
pub const TOUCHES: RangeInclusive<usize> = 3..=1_000_000;
/// `feasible.edge_neighbours`.
pub const EDGE_NEIGHBOURS: RangeInclusive<usize> = 0..=1000;
/// How many gauges may be lost together, and from how many first gauges a set may be begun: likewise.
pub const LOST: RangeInclusive<usize> = 1..=MOST_FAILED;
/// `selection.starts`.
pub const STARTS: RangeInclusive<usize> = 1..=20;
/// How many forces sets may be judged at.
const JUDGED: RangeInclusive<usize> = 1..=20;
/// How hard touches may come (N), and how far off gauges may be glued (mm, degrees, percent): likewise.
pub const FORCES: RangeInclusive<f64> = 1e-3..=1e5;
/// How far off places may be (mm).
pub const PLACE_OFF: RangeInclusive<f64> = 0.0..=50.0;
/// How far off directions may be (degrees).
pub const ANGLE_OFF: RangeInclusive<f64> = 0.0..=45.0;
/// How far off gains may be (%).
pub const GAIN_OFF: RangeInclusive<f64> = 0.0..=50.0;
/// How far off a hand presses (percent of the force), how much larger or smaller tips are (mm), and how far all channels
/// drift together (µε): likewise.
pub const FORCE_OFF: RangeInclusive<f64> = 0.0..=50.0;
/// How far off the tip's radius may be (mm).
pub const TIP_OFF: RangeInclusive<f64> = 0.0..=50.0;
/// How much of a touch's force may act along the surface (%): more than presses would slide off.
pub const FRICTION: RangeInclusive<f64> = 0.0..=100.0;
/// `gauge.drift_microstrain`.
pub const DRIFT: RangeInclusive<f64> = 0.0..=1e6;

/// Of anything that is made (mm): from a nanometre to a kilometre.
pub const LENGTH: RangeInclusive<f64> = 1e-6..=1e6;
/// Of anything that may also not be there (mm).
const ROOM: RangeInclusive<f64> = 0.0..=1e6;
/// How far off a place may be (mm), either way.
pub const FARTHEST: f64 = 1e9;

impl Project {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`BadValue`] for the first that cannot be used.
    pub fn check(&self) -> Result<(), BadValue> {
        self.check_model()?;
        self.check_forces()?;
        self.check_judged()?;
        self.check_room()?;
        self.check_counts()?;
        self.check_selection()?;
        self.check_limits()?;
        self.check_live()?;
        self.check_places()?;
        self.check_kept()
    }

    fn check_model(&self) -> Result<(), BadValue> {
        let (part, touch) = (&self.part, &self.touch);
        all_bounded([
            ("part.thickness_mm", part.thickness_mm, LENGTH),
            ("part.weld_mm", part.weld_mm, ROOM),
            ("part.fill_holes_mm", part.fill_holes_mm, ROOM),
            ("part.straighten_mm", part.straighten_mm, ROOM),
            (
                "material.youngs_modulus_gpa",
                self.material.youngs_modulus_gpa,
                1e-9..=1e6,
            ),
            ("touch.force_n", touch.force_n, 1e-12..=1e12),
            ("touch.tip_radius_mm", touch.tip_radius_mm, LENGTH),
        ])?;
        let nu = self.material.poissons_ratio;
        check(
            "material.poissons_ratio",
            "above -1 and below 0.5",
            nu,
            nu > -1.0 && nu < 0.5,
        )
    }

    fn check_forces(&self) -> Result<(), BadValue> {
        let [lightest, hardest] = self.touch.forces_n;
        for force in [lightest, hardest] {
            bounded("touch.forces_n", force, &FORCES)?;
        }
        if lightest <= hardest {
            return Ok(());
        }
        Err(BadValue {
            key: "touch.forces_n".to_owned(),
            rule: "the lightest force and then the hardest".into(),
            value: format!("[{}, {}]", number(lightest), number(hardest)),
        })
    }

    fn check_judged(&self) -> Result<(), BadValue> {
        let forces = &self.evaluation.forces_n;
        let rising = forces.windows(2).all(|pair| pair[0] < pair[1]);
        for &force in forces {
            bounded("evaluation.forces_n", force, &FORCES)?;
        }
        if rising && JUDGED.contains(&forces.len()) {
            return Ok(());
        }
        let listed: Vec<String> = forces.iter().take(4).map(|&f| number(f)).collect();
        let more = if forces.len() > listed.len() {
            ", …"
        } else {
            ""
        };
        Err(BadValue {
            key: "evaluation.forces_n".to_owned(),
            rule: format!(
                "{} to {} forces, each harder than the one before",
                JUDGED.start(),
                JUDGED.end()
            )
            .into(),
            value: format!("[{}{more}]", listed.join(", ")),
        })
    }

    fn check_room(&self) -> Result<(), BadValue> {
        let (gauge, room) = (&self.gauge, &self.feasible);
        let (tolerance, hand) = (&gauge.tolerance, &self.calibration);
        all_bounded([
            ("touch.edge_margin_mm", self.touch.edge_margin_mm, ROOM),
            ("touch.reach_mm", self.touch.reach_mm, ROOM),
            (
                "touch.tip_tolerance_mm",
                self.touch.tip_tolerance_mm,
                TIP_OFF,
            ),
            (
                "touch.friction_percent",
                self.touch.friction_percent,
                FRICTION,
            ),
            ("calibration.place_mm", hand.place_mm, PLACE_OFF),
            ("calibration.force_percent", hand.force_percent, FORCE_OFF),
            (
                "calibration.friction_percent",
                hand.friction_percent,
                FRICTION,
            ),
            ("gauge.drift_microstrain", gauge.drift_microstrain, DRIFT),
            ("sites.spacing_mm", self.sites.spacing_mm, LENGTH),
            (
                "gauge.noise_microstrain",
                gauge.noise_microstrain,
                0.0..=1e12,
            ),
            (
                "gauge.range_microstrain",
                gauge.range_microstrain,
                1e-12..=1e30,
            ),
            (
                "gauge.least_signal_to_noise",
                gauge.least_signal_to_noise,
                0.0..=1e12,
            ),
            ("gauge.grid_length_mm", gauge.grid_length_mm, LENGTH),
            ("gauge.grid_width_mm", gauge.grid_width_mm, LENGTH),
            ("gauge.flatness_mm", gauge.flatness_mm, ROOM),
            ("gauge.tolerance.place_mm", tolerance.place_mm, PLACE_OFF),
            ("gauge.tolerance.angle_deg", tolerance.angle_deg, ANGLE_OFF),
            (
                "gauge.tolerance.gain_percent",
                tolerance.gain_percent,
                GAIN_OFF,
            ),
            (
                "feasible.support_clearance_mm",
                room.support_clearance_mm,
                ROOM,
            ),
            ("feasible.edge_radius_mm", room.edge_radius_mm, ROOM),
        ])
    }

    fn check_counts(&self) -> Result<(), BadValue> {
        let kept = self.candidates.count.unwrap_or(1);
        let counts = [
            ("touch.count", self.touch.count, TOUCHES),
            ("selection.sensors", self.selection.sensors, GAUGES),
            ("selection.lost", self.selection.lost, LOST),
            ("selection.starts", self.selection.starts, STARTS),
            ("candidates.count", kept, 1..=100_000),
            (
                "feasible.edge_neighbours",
                self.feasible.edge_neighbours,
                EDGE_NEIGHBOURS,
            ),
            ("gauge.directions", self.gauge.directions, 1..=4),
            ("support", self.supports.len(), 0..=MOST),
        ];
        for (key, count, range) in counts {
            counted(key, count, &range)?;
        }
        let directions = self.gauge.directions;
        check(
            "gauge.directions",
            "1 for displacements, which have no direction of a gauge",
            directions as f64,
            directions == 1 || self.gauge.signal == Signal::Strain,
        )?;
        let largest = i64::MAX as u64;
        if self.budget.seed > largest {
            return Err(BadValue {
                key: "budget.seed".into(),
                rule: "at most 9223372036854775807, the largest whole number of a project file"
                    .into(),
                value: self.budget.seed.to_string(),
            });
        }
        Ok(())
    }

    fn check_selection(&self) -> Result<(), BadValue> {
        let selection = &self.selection;
        let process = &selection.gaussian_process;
        all_bounded([
            ("selection.c_mm", selection.c_mm, 1e-9..=1e12),
            ("selection.epsilon_mm", selection.epsilon_mm, 0.0..=1e9),
            ("selection.gamma", selection.gamma, 1e-12..=1e9),
            ("selection.spacing_mm", selection.spacing_mm, ROOM),
            ("selection.failure", selection.failure, 0.0..=1.0),
            ("selection.gaussian_process.noise", process.noise, 0.0..=1e6),
        ])?;
        let optional = [
            ("selection.target_mm", selection.target_mm, 1e-9..=1e9),
            ("selection.cost_budget", selection.cost_budget, 1e-9..=1e15),
            (
                "selection.gaussian_process.length_mm",
                process.length_mm,
                LENGTH,
            ),
            (
                "selection.gaussian_process.power",
                process.power,
                1e-3..=2.0,
            ),
        ];
        for (key, value, range) in optional {
            if let Some(value) = value {
                bounded(key, value, &range)?;
            }
        }
        for keys in &selection.costs {
            bounded("selection.cost.cost", keys.cost, &(1e-9..=1e9))?;
        }
        let share = self.candidates.unexplained;
        check(
            "candidates.unexplained",
            "above 0 and below 1",
            share,
            share > 0.0 && share < 1.0,
        )
    }

    fn check_limits(&self) -> Result<(), BadValue> {
        const MANY: usize = 1_000_000;
        // Every press has a filter at every place.
        const LOOKED_AT: usize = 5000;
        let limits = &self.budget.limits;
        let counts = [
            ("budget.limits.vertices", limits.vertices, 100..=MANY),
            ("budget.limits.touches", limits.touches, 3..=MANY),
            ("budget.limits.candidates", limits.candidates, 2..=100_000),
            (
                "budget.limits.expected_places",
                limits.expected_places,
                20..=LOOKED_AT,
            ),
            (
                "budget.limits.expected_presses",
                limits.expected_presses,
                12..=LOOKED_AT,
            ),
            (
                "budget.limits.selection_touches",
                limits.selection_touches,
                10..=MANY,
            ),
            (
                "budget.limits.selection_candidates",
                limits.selection_candidates,
                2..=100_000,
            ),
            (
                "budget.limits.tuning_touches",
                limits.tuning_touches,
                10..=MANY,
            ),
        ];
        for (key, count, range) in counts {
            if let Some(count) = count {
                counted(key, count, &range)?;
            }
        }
        let percent = limits.elements_percent.unwrap_or(1.0);
        bounded("budget.limits.elements_percent", percent, &(1e-6..=1e6))
    }

    fn check_axes(&self) -> Result<(), BadValue> {
        if let PartAxis::Along(direction) = self.part.axis {
            check_direction("part.axis", direction)?;
        }
        let supports = self.supports.iter().map(|s| s.box_axis);
        let regions = self.evaluation.regions.iter().map(|r| r.box_axis);
        let costs = self.selection.costs.iter().map(|c| c.box_axis);
        let axes = (supports.map(|axis| ("support.box_axis", axis)))
            .chain(regions.map(|axis| ("evaluation.region.box_axis", axis)))
            .chain(costs.map(|axis| ("selection.cost.box_axis", axis)));
        for (key, direction) in axes {
            if let Some(direction) = direction {
                check_direction(key, direction)?;
            }
        }
        let is_alone = |s: &SupportKeys| s.box_axis.is_some() && s.box_mm.is_none();
        if self.supports.iter().any(is_alone) {
            return Err(BadValue {
                key: "support.box_axis".to_owned(),
                rule: "given beside box_mm, which it turns".into(),
                value: "given without it".into(),
            });
        }
        Ok(())
    }

    fn check_places(&self) -> Result<(), BadValue> {
        self.check_axes()?;
        let supports = self.supports.iter().filter_map(|s| s.box_mm.as_ref());
        let regions = self.evaluation.regions.iter().map(|r| &r.box_mm);
        let costs = self.selection.costs.iter().map(|c| &c.box_mm);
        let boxes = (supports.map(|b| ("support.box_mm", b)))
            .chain(regions.map(|b| ("evaluation.region.box_mm", b)))
            .chain(costs.map(|b| ("selection.cost.box_mm", b)));
        for (key, corners) in boxes {
            for corner in corners {
                check_place(key, corner)?;
            }
        }
        for at in &self.selection.required_mm {
            check_place("selection.required_mm", at)?;
        }
        check_sites("selection.site", &self.selection.sites)
    }

    fn check_kept(&self) -> Result<(), BadValue> {
        for kept in &self.kept {
            check_sites("kept.site", &kept.sites)?;
            let own = [("kept.cost", kept.cost), ("kept.seconds", kept.seconds)];
            let errors = kept.errors.iter().flat_map(|e| {
                [
                    ("kept.error.mean_mm", e.mean_mm),
                    ("kept.error.median_mm", e.median_mm),
                    ("kept.error.p95_mm", e.p95_mm),
                ]
            });
            let failures = (kept.failures.iter()).map(|f| ("kept.failure.mean_mm", f.mean_mm));
            for (key, value) in own.into_iter().chain(errors).chain(failures) {
                bounded(key, value, &(0.0..=1e15))?;
            }
        }
        Ok(())
    }
}

fn check_sites(table: &str, sites: &[ChosenSite]) -> Result<(), BadValue> {
    for site in sites {
        check_place(&format!("{table}.position_mm"), &site.position_mm)?;
        let length = DVec3::from_array(site.direction).length();
        check(
            &format!("{table}.direction"),
            "a direction, numbers that are not all zero",
            length,
            (1e-6..=1e6).contains(&length),
        )?;
    }
    Ok(())
}

fn check_place(key: &str, place: &[f64; 3]) -> Result<(), BadValue> {
    for &value in place {
        let near = value.abs() <= FARTHEST;
        check(key, "made of numbers between -1e9 and 1e9", value, near)?;
    }
    Ok(())
}

fn check_direction(key: &str, direction: [f64; 3]) -> Result<(), BadValue> {
    /// Below this a direction is nobody's.
    const LEAST: f64 = 1e-6;
    check_place(key, &direction)?;
    if direction.iter().any(|x| x.abs() >= LEAST) {
        return Ok(());
    }
    Err(BadValue {
        key: key.to_owned(),
        rule: "a direction, whose numbers are not all 0".into(),
        value: format!("[{}]", direction.map(number).join(", ")),
    })
}

#[cfg(test)]
mod tests;
