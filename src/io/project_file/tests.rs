use std::fmt::Write as _;

use super::*;
use crate::mesh::unroll::Axis;
use crate::project::{
    ChosenSite, CostKeys, KeptError, KeptFailure, KeptSelection, PartAxis, RegionKeys, SupportKeys,
    SupportKind, Unit,
};

fn full() -> Project {
    let mut p = Project::around("a \"part\".stl", Some(Unit::Inch));
    p.supports.push(SupportKeys {
        kind: SupportKind::Symmetry,
        box_mm: Some([[0.0, 1e-3, -2.0], [1.0, 2.0, 3.0]]),
        box_axis: Some([0.1, -2.0, 1.0 / 3.0]),
        vertices: None,
        normal: Axis::X,
        bedding_n_per_mm3: None,
    });
    p.supports.push(SupportKeys {
        kind: SupportKind::Pinned,
        box_mm: None,
        box_axis: None,
        vertices: Some("rim \"left\"".into()),
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    p.part.axis = PartAxis::Along([0.1, 1.0 / 3.0, -2.0]);
    p.candidates.count = Some(407);
    p.budget.limits = crate::budget::BudgetLimits {
        elements_percent: Some(2.5),
        vertices: Some(1500),
        touches: Some(700),
        candidates: Some(90),
        expected_places: Some(500),
        expected_presses: Some(120),
        selection_touches: Some(300),
        selection_candidates: Some(50),
        tuning_touches: Some(200),
    };
    p.feasible.painted = Some("painted".into());
    p.feasible.keep_out = Some("connector".into());
    p.touch.region = Some("grip".into());
    p.touch.forces_n = [0.5, 12.0];
    p.gauge.tolerance = crate::project::ToleranceKeys {
        place_mm: 0.4,
        angle_deg: 1.0 / 3.0,
        gain_percent: 0.0,
    };
    p.gauge.drift_microstrain = 1.0 / 3.0;
    p.touch.tip_tolerance_mm = 0.75;
    p.touch.friction_percent = 12.5;
    p.touch.reach_mm = 1.25;
    p.calibration = crate::project::CalibrationKeys {
        place_mm: 0.0,
        force_percent: 7.5,
        friction_percent: 2.5,
    };
    (p.live.stiffness_percent, p.live.friction_percent) = (12.5, 35.0);
    p.selection.sites.push(ChosenSite {
        position_mm: [0.1, 1.0 / 3.0, -7e-17],
        direction: [0.0, 0.0, 1.0],
    });
    p.selection.with_noise = true;
    p.selection.compare = false;
    p.selection.lost = 2;
    p.selection.lost_by = crate::placement::LostBy::Worst;
    p.selection.exchange = true;
    p.selection.starts = 3;
    p.selection.refine = true;
    p.selection.cost_budget = Some(12.5);
    p.selection.costs.push(CostKeys {
        box_mm: [[0.0; 3], [1.0; 3]],
        box_axis: Some([1.0, 0.0, 0.5]),
        cost: 2.5,
    });
    p.kept.push(KeptSelection {
        name: "greedy \"ten\"".into(),
        selector: "by-hand".into(),
        quality: crate::budget::Quality::Draft,
        cost: 3.5,
        seconds: 12.25,
        sites: p.selection.sites.clone(),
        errors: vec![KeptError {
            region: "all touches".into(),
            sensors: 1,
            mean_mm: 3.0,
            median_mm: 1.5,
            p95_mm: 9.0,
        }],
        failures: vec![KeptFailure {
            failed: 2,
            retrained: true,
            mean_mm: 5.5,
        }],
    });
    p.live.channels = vec![3, 1, 2];
    p.live.glued.push(glued());
    let mut press = crate::project::PressKeys::new(glam::DVec3::X, 4.5, &[1e-6, f64::NAN, -3e-5]);
    press.used = false;
    press.board = Some("0000002a".into());
    p.live.presses.push(press);
    p.evaluation.estimator = crate::evaluation::EstimatorKind::Matching;
    p.evaluation.forces_n = vec![0.5, 1.0 / 3.0 + 1.0];
    p.evaluation.regions.push(RegionKeys {
        name: "middle".into(),
        box_mm: [[-1.0; 3], [1.0; 3]],
        box_axis: Some([0.0, 1.0, -0.25]),
    });
    p
}

fn glued() -> crate::project::GluedKeys {
    crate::project::GluedKeys {
        gain: 1.03,
        along_mm: -0.25,
        across_mm: 1.5,
        turned_degrees: -3.25,
        covariance: Some([1e-9, -0.5, 0.0, 1.0 / 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
        site: Some([1.0, -2.5, 1.0 / 3.0, 0.0, 0.6, 0.8]),
    }
}

#[test]
fn what_is_written_reads_back_the_same() {
    for project in [Project::around("limb.glb", None), full()] {
        let text = to_text(&project);
        assert_eq!(parse(&text).as_ref(), Ok(&project), "{text}");
    }
}

#[test]
fn a_file_from_before_a_key_means_what_is_usual() {
    let project = Project::around("limb.glb", None);
    let old: String = to_text(&project)
        .split_inclusive('\n')
        .filter(|line| {
            let new = [
                "straighten_mm",
                "forces_n",
                "[gauge.tolerance]",
                "place_mm",
                "angle_deg",
                "gain_percent",
                "tip_tolerance_mm",
                "friction_percent",
                "reach_mm",
                "drift_microstrain",
                "[calibration]",
                "force_percent",
                "stiffness_percent",
                "estimator",
            ];
            !new.iter().any(|key| line.starts_with(key))
        })
        .collect();
    assert!(!old.contains("tolerance") && !old.contains("forces_n"));
    assert_eq!(parse(&old), Ok(project));
}

#[test]
fn a_newer_or_foreign_file_is_refused_with_the_remedy() {
    let text = to_text(&full()).replace("format = 1", "format = 2");
    assert!(parse(&text).unwrap_err().contains("newer version"));
    assert!(parse("[part]\n").unwrap_err().contains("format"));
    let typo = to_text(&full()).replace("force_n", "force");
    let message = parse(&typo).unwrap_err();
    assert!(
        message.contains("force") && message.contains("line"),
        "{message}"
    );
    let negative = to_text(&full()).replace("force_n = 10.0", "force_n = -1.0");
    let message = parse(&negative).unwrap_err();
    let line = 1 + negative
        .lines()
        .position(|l| l.starts_with("force_n"))
        .unwrap();
    assert!(
        message.starts_with(&format!("line {line}: touch.force_n ")),
        "{message}"
    );
}

#[test]
fn paths_are_kept_relative() {
    let project = Path::new("/home/a/work/p.hapdef.toml");
    assert_eq!(
        relative_to(project, Path::new("/home/a/work/limb.glb")),
        "limb.glb"
    );
    assert_eq!(
        relative_to(project, Path::new("/home/a/mesh/limb.glb")),
        "../mesh/limb.glb"
    );
}

/// Set for a program that is to die while it saves here.
const DIE_SAVING: &str = "HAPDEF_TEST_DIE_SAVING";

/// A sheet of nine vertices, and a project on it that can be told from another by all of its parts.
fn numbered(folder: &Path, number: u8) -> (Project, Vec<bool>, Masks) {
    let mut obj = String::new();
    for k in 0..9 {
        let _ = writeln!(obj, "v {} {} 0", 10 * (k % 3), 10 * (k / 3));
    }
    for [a, b, c, d] in [[1, 2, 5, 4], [2, 3, 6, 5], [4, 5, 8, 7], [5, 6, 9, 8]] {
        let _ = writeln!(obj, "f {a} {b} {c}\nf {a} {c} {d}");
    }
    std::fs::write(folder.join("sheet.obj"), obj).unwrap();
    let mask = |from: u8| -> Vec<bool> {
        (0..9)
            .map(|v| (v + from + number).is_multiple_of(3))
            .collect()
    };
    let mut project = Project::around("sheet.obj", Some(Unit::Millimetre));
    project.touch.force_n = f64::from(number);
    // Masks of as many values as the file has vertices.
    project.part.halve_mm = 1e6;
    project.feasible.keep_out = Some("keep-out".into());
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: None,
        box_axis: None,
        vertices: Some("support-1".into()),
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    let masks = [("keep-out", mask(1)), ("support-1", mask(2))];
    let masks = masks.map(|(name, mask)| (name.to_owned(), Arc::new(mask)));
    (project, mask(0), masks.into_iter().collect())
}

/// A project of one part, with lines of its own.
fn small(lines: &str) -> String {
    format!("format = 1\n[part]\nmesh = \"a.stl\"\nunit = \"mm\"\n{lines}\n")
}

#[test]
fn what_is_wrong_in_a_long_line_is_said_without_the_line() {
    let long = "x".repeat(200_000);
    let said = parse(&small(&format!("model = \"{long}\" nonsense"))).unwrap_err();
    assert!(said.contains("line 5, column 200012: "), "{said}");
    assert!(said.len() < 400, "{said}");
    // What it is, and what it should be.
    let said = parse(&small(&format!("model = \"{long}\""))).unwrap_err();
    assert!(
        said.contains("unknown variant") && said.contains("solid"),
        "{said}"
    );
    assert!(said.len() < 500, "{said}");
    let said = parse(&small("thickness_mm = \"é\" é")).unwrap_err();
    assert!(said.contains("line 5, column 20"), "{said}");
}

#[test]
fn a_mesh_of_a_name_without_an_end_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.hapdef.toml");
    for name in [
        format!("{}.stl", "x".repeat(200_000)),
        format!("{}gone.stl", "x/".repeat(700)),
        "\\u001b[31mred.stl".to_owned(),
    ] {
        std::fs::write(&path, small("").replace("a.stl", &name)).unwrap();
        let said = load(&path).err().unwrap().to_string();
        let reason = ["too long. Check the path", "there is no such file"];
        assert!(reason.iter().any(|r| said.contains(r)), "{said}");
        assert!(said.contains(".stl: ") && said.len() < 400, "{said}");
        assert!(!said.contains('\u{1b}'), "{said}");
    }
}

/// What the program that is killed does; nothing in an ordinary run of the tests.
#[test]
fn saved_until_killed() {
    if let Some(path) = std::env::var_os(DIE_SAVING) {
        let path = PathBuf::from(path);
        let (project, painted, masks) = numbered(path.parent().unwrap(), 2);
        save(&path, &project, Some(&painted), &masks).unwrap();
    }
}

#[test]
fn killed_at_any_step_project_and_masks_are_the_old_or_the_new_together() {
    let mut seen = Vec::new();
    for at in 1..=2 * atomic::tests::STEPS {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.hapdef.toml");
        let (project, painted, masks) = numbered(folder.path(), 1);
        save(&path, &project, Some(&painted), &masks).unwrap();
        let died = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "io::project_file::tests::saved_until_killed"])
            .env(atomic::tests::DIE_AT, at.to_string())
            .env(DIE_SAVING, &path)
            .output()
            .unwrap();
        assert!(!died.status.success(), "step {at} was not reached");
        let found = load(&path)
            .unwrap_or_else(|e| panic!("step {at}: {e}"))
            .inputs;
        let number = found.project.touch.force_n as u8;
        let (_, painted, masks) = numbered(folder.path(), number);
        assert_eq!(*found.painted.unwrap(), painted, "step {at}");
        for (name, mask) in masks {
            assert_eq!(found.masks[&name], mask, "step {at}: {name}");
        }
        seen.push(number);
    }
    let new = seen.iter().position(|&n| n == 2).unwrap();
    assert_eq!(new as u32, 2 * atomic::tests::STEPS - 2, "{seen:?}");
    assert!(seen[new..].iter().all(|&n| n == 2));
}

#[test]
fn a_backup_finds_its_own_masks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sheet.hapdef.toml");
    for number in [1, 2] {
        let (project, painted, masks) = numbered(folder.path(), number);
        save(&path, &project, Some(&painted), &masks).unwrap();
    }
    std::fs::rename(folder.path().join("sheet.hapdef.toml.bak"), &path).unwrap();
    let found = load(&path).unwrap().inputs;
    assert_eq!(found.project.touch.force_n, 1.0);
    assert_eq!(*found.painted.unwrap(), numbered(folder.path(), 1).1);
}
