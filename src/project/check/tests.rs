use super::*;
use crate::project::{ChosenSite, CostKeys, GluedKeys, RegionKeys};
use crate::uncertainty::{Gluing, HandPressing, Making};

fn project() -> Project {
    let mut project = Project::around("part.stl", None);
    project.selection.sites.push(ChosenSite {
        position_mm: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
    });
    project.selection.costs.push(CostKeys {
        box_mm: [[0.0; 3]; 2],
        box_axis: None,
        cost: 1.0,
    });
    project.evaluation.regions.push(RegionKeys {
        name: "all".into(),
        box_mm: [[0.0; 3]; 2],
        box_axis: None,
    });
    project
}

type Place = fn(&mut Project) -> &mut f64;

/// Every number of a project that may not be just any.
const NUMBERS: [(&str, Place); 42] = [
    ("part.thickness_mm", |p| &mut p.part.thickness_mm),
    ("part.weld_mm", |p| &mut p.part.weld_mm),
    ("part.fill_holes_mm", |p| &mut p.part.fill_holes_mm),
    ("part.straighten_mm", |p| &mut p.part.straighten_mm),
    ("material.youngs_modulus_gpa", |p| {
        &mut p.material.youngs_modulus_gpa
    }),
    ("material.poissons_ratio", |p| {
        &mut p.material.poissons_ratio
    }),
    ("touch.force_n", |p| &mut p.touch.force_n),
    ("touch.tip_radius_mm", |p| &mut p.touch.tip_radius_mm),
    ("touch.edge_margin_mm", |p| &mut p.touch.edge_margin_mm),
    ("touch.reach_mm", |p| &mut p.touch.reach_mm),
    ("touch.tip_tolerance_mm", |p| &mut p.touch.tip_tolerance_mm),
    ("touch.friction_percent", |p| &mut p.touch.friction_percent),
    ("gauge.drift_microstrain", |p| {
        &mut p.gauge.drift_microstrain
    }),
    ("calibration.place_mm", |p| &mut p.calibration.place_mm),
    ("calibration.force_percent", |p| {
        &mut p.calibration.force_percent
    }),
    ("calibration.friction_percent", |p| {
        &mut p.calibration.friction_percent
    }),
    ("live.stiffness_percent", |p| &mut p.live.stiffness_percent),
    ("live.friction_percent", |p| &mut p.live.friction_percent),
    ("sites.spacing_mm", |p| &mut p.sites.spacing_mm),
    ("gauge.noise_microstrain", |p| {
        &mut p.gauge.noise_microstrain
    }),
    ("gauge.range_microstrain", |p| {
        &mut p.gauge.range_microstrain
    }),
    ("gauge.grid_length_mm", |p| &mut p.gauge.grid_length_mm),
    ("gauge.flatness_mm", |p| &mut p.gauge.flatness_mm),
    ("gauge.tolerance.place_mm", |p| {
        &mut p.gauge.tolerance.place_mm
    }),
    ("gauge.tolerance.angle_deg", |p| {
        &mut p.gauge.tolerance.angle_deg
    }),
    ("gauge.tolerance.gain_percent", |p| {
        &mut p.gauge.tolerance.gain_percent
    }),
    ("touch.forces_n", |p| &mut p.touch.forces_n[0]),
    ("touch.forces_n", |p| &mut p.touch.forces_n[1]),
    ("evaluation.forces_n", |p| &mut p.evaluation.forces_n[0]),
    ("evaluation.forces_n", |p| &mut p.evaluation.forces_n[2]),
    ("feasible.support_clearance_mm", |p| {
        &mut p.feasible.support_clearance_mm
    }),
    ("feasible.edge_radius_mm", |p| {
        &mut p.feasible.edge_radius_mm
    }),
    ("candidates.unexplained", |p| &mut p.candidates.unexplained),
    ("selection.c_mm", |p| &mut p.selection.c_mm),
    ("selection.epsilon_mm", |p| &mut p.selection.epsilon_mm),
    ("selection.gamma", |p| &mut p.selection.gamma),
    ("selection.failure", |p| &mut p.selection.failure),
    ("selection.cost.cost", |p| &mut p.selection.costs[0].cost),
    ("selection.cost.box_mm", |p| {
        &mut p.selection.costs[0].box_mm[1][2]
    }),
    ("evaluation.region.box_mm", |p| {
        &mut p.evaluation.regions[0].box_mm[0][1]
    }),
    ("selection.site.position_mm", |p| {
        &mut p.selection.sites[0].position_mm[0]
    }),
    ("selection.site.direction", |p| {
        &mut p.selection.sites[0].direction[2]
    }),
];

#[test]
fn no_number_may_be_none_endless_or_absurd() {
    assert_eq!(project().check(), Ok(()));
    for (key, place) in NUMBERS {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            let mut project = project();
            *place(&mut project) = value;
            let said = project.check().map_err(|e| e.to_string());
            let said = said.expect_err(key);
            assert!(said.starts_with(key) && said.len() < 120, "{said}");
        }
    }
}

#[test]
fn required_places_are_places() {
    for bad in [f64::NAN, f64::INFINITY, 1e160] {
        let mut project = project();
        project.selection.required_mm = vec![[0.0; 3], [bad, 0.0, 0.0]];
        let said = project.check().unwrap_err().to_string();
        assert!(said.starts_with("selection.required_mm"), "{said}");
    }
}

#[test]
fn a_tip_has_a_size() {
    for radius in [1e-20, 1e-7, 0.0, -0.0] {
        let mut project = project();
        project.touch.tip_radius_mm = radius;
        let said = project.check().unwrap_err().to_string();
        assert!(said.contains("between 1e-6 and 1000000"), "{said}");
    }
}

#[test]
fn the_lightest_touch_comes_first() {
    let mut project = project();
    project.touch.forces_n = [5.0, 5.0];
    assert_eq!(project.check(), Ok(()));
    project.touch.forces_n = [30.0, 2.0];
    let said = project.check().unwrap_err().to_string();
    let expected = "touch.forces_n must be the lightest force and then the hardest, but is [30, 2]";
    assert_eq!(said, expected);
}

#[test]
fn sets_are_judged_at_some_forces_each_harder_than_the_one_before() {
    let mut project = project();
    for judged in [vec![7.0], vec![0.001, 1e5]] {
        project.evaluation.forces_n = judged;
        assert_eq!(project.check(), Ok(()));
    }
    let many: Vec<f64> = (1..=21).map(f64::from).collect();
    for (judged, said) in [
        (Vec::new(), "[]"),
        (vec![3.0, 3.0], "[3, 3]"),
        (vec![10.0, 3.0, 25.0], "[10, 3, 25]"),
        (many, "[1, 2, 3, 4, …]"),
    ] {
        project.evaluation.forces_n = judged;
        let refused = project.check().unwrap_err().to_string();
        let expected = format!(
            "evaluation.forces_n must be 1 to 20 forces, each harder than the one before, but is {said}"
        );
        assert_eq!(refused, expected);
    }
}

#[test]
fn gluing_is_exact_to_much_too_far_and_usually_that_of_the_paper() {
    let mut project = project();
    assert_eq!(project.gluing(), Gluing::default());
    let tolerance = &mut project.gauge.tolerance;
    (tolerance.place_mm, tolerance.angle_deg) = (0.0, 0.0);
    tolerance.gain_percent = 0.0;
    assert_eq!(project.check(), Ok(()));
    assert_eq!(project.gluing(), Gluing::EXACT);
    project.gauge.tolerance.angle_deg = 45.1;
    let said = project.check().unwrap_err().to_string();
    let expected = "gauge.tolerance.angle_deg must be between 0 and 45, but is 45.1";
    assert_eq!(said, expected);
}

#[test]
fn what_is_off_is_what_the_keys_say() {
    let mut project = project();
    let usual = project.uncertainty();
    assert_eq!((usual.drift, usual.making), (0.0, Making::EXACT));
    assert_eq!(usual.resolution, 0.0);
    assert_eq!(usual.pressing, HandPressing::default());
    project.gauge.noise_microstrain = 2.0;
    project.gauge.drift_microstrain = 3.0;
    project.gauge.tolerance.place_mm = 0.5;
    project.touch.tip_tolerance_mm = 0.25;
    project.touch.friction_percent = 15.0;
    project.calibration.place_mm = 2.0;
    project.calibration.force_percent = 10.0;
    project.calibration.friction_percent = 5.0;
    project.live.friction_percent = 30.0;
    project.live.stiffness_percent = 20.0;
    project.live.model_error = 0.08;
    assert_eq!(project.check(), Ok(()));
    let off = project.uncertainty();
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}");
    close(off.noise, 2e-6);
    close(off.drift, 3e-6);
    close(off.gluing.place, 0.5e-3);
    close(off.making.tip, 0.25e-3);
    close(off.making.friction, 0.15);
    close(off.pressing.place, 2e-3);
    close(off.pressing.force, 0.1);
    close(off.making_of_presses().friction, 0.05);
    close(off.making_allowed().friction, 0.3);
    close(off.stiffness, 0.2);
    close(off.model, 0.08);
    // What a calibration found is of the gauges that are glued.
    project.live.glued.push(GluedKeys {
        gain: 1.0,
        along_mm: 0.0,
        across_mm: 0.0,
        turned_degrees: 0.0,
        covariance: None,
        site: None,
    });
    close(project.uncertainty().model, 0.0);
}

#[test]
fn a_seed_can_be_written_and_read() {
    let mut project = project();
    project.budget.seed = i64::MAX as u64;
    assert_eq!(project.check(), Ok(()));
    project.budget.seed += 1;
    assert!(project.check().is_err());
}

#[test]
fn a_channel_belongs_to_one_gauge() {
    let mut project = Project::around("limb.stl", None);
    project.live.channels = vec![4, 2, 0, 2];
    let said = project.check().unwrap_err().to_string();
    let expected =
        "live.channels must be another channel for each gauge, but is 2 for gauges 2 and 4";
    assert_eq!(said, expected);
    project.live.channels = vec![4, 2, 0, 1];
    project.check().unwrap();
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
        assert!(project.check().is_err(), "{bad}");
    }
}
