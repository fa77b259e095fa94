//! What a user is told: the cause that it really is, and which key to change to what.

use crate::coarse;

use std::path::Path;
use std::process::Command;
use std::sync::{Arc, OnceLock};

use coarse::limb;
use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, DesignError, Inputs, SaidBy, Simulated};
use hapdef::elasticity::ElasticError;
use hapdef::elasticity::estimate::Discretization;
use hapdef::elasticity::linearity::Linearity;
use hapdef::feasible::Filter;
use hapdef::mesh::TriMesh;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, PartModel, Project, SupportKeys, SupportKind, Unit};

fn budget() -> Budget {
    Budget {
        touches: 60,
        ..Quality::Draft.budget()
    }
}

/// The coarse limb under its touches: the filters need no other.
fn simulated() -> &'static Simulated {
    static SIMULATED: OnceLock<Simulated> = OnceLock::new();
    SIMULATED.get_or_init(|| design::simulate(&limb(), &budget(), &unwatched).unwrap())
}

fn feasible(inputs: &Inputs) -> usize {
    design::filter(inputs, simulated()).sites().len()
}

/// Why the sites of a changed limb are too few.
fn refused(change: impl Fn(&mut Inputs)) -> (Option<Filter>, String) {
    let mut inputs = limb();
    change(&mut inputs);
    let verdicts = design::filter(&inputs, simulated());
    let result = design::reduce_sites(&inputs, simulated(), &verdicts, &budget());
    match result.err() {
        Some(DesignError::Shortage(s)) => (s.blamed, s.to_string()),
        other => panic!("{other:?}"),
    }
}

/// The number that a message says to change a key to.
fn asked_for(said: &str, key: &str) -> f64 {
    let after = said.split(key).nth(1).unwrap();
    let number = after.split(" to ").nth(1).unwrap();
    let number: String = number
        .chars()
        .take_while(|c| c.is_ascii_digit() || ".e-".contains(*c))
        .collect();
    number.trim_end_matches('.').parse().unwrap()
}

#[test]
fn each_filter_is_named_with_what_it_took_and_what_would_help() {
    type Change = fn(&mut Inputs);
    let cases: [(Filter, &str, Change); 5] = [
        (
            Filter::SupportClearance,
            "feasible.support_clearance_mm",
            |i| i.project.feasible.support_clearance_mm = 800.0,
        ),
        (Filter::Edge, "feasible.edge_radius_mm", |i| {
            i.project.feasible.edge_radius_mm = 0.0;
        }),
        (Filter::Noise, "gauge.least_signal_to_noise", |i| {
            i.project.gauge.noise_microstrain = 1e6;
        }),
        (Filter::Range, "gauge.range_microstrain", |i| {
            i.project.gauge.range_microstrain = 1e-9;
        }),
        (Filter::Painted, "feasible.painted", |i| {
            let none = vec![false; i.part.positions().len()];
            i.painted = Some(Arc::new(none));
        }),
    ];
    assert!(feasible(&limb()) > 20);
    for (filter, key, change) in cases {
        let (blamed, said) = refused(change);
        assert_eq!(blamed, Some(filter), "{said}");
        assert!(
            said.contains("no site is feasible") && said.contains(key),
            "{said}"
        );
        assert!(said.contains(&filter.label().to_lowercase()), "{said}");
        assert!(said.len() < 600, "{said}");
    }
}

#[test]
fn a_gauge_longer_than_the_part_is_to_be_smaller() {
    let (_, said) = refused(|i| i.project.gauge.grid_length_mm = 300.0);
    assert!(said.contains("smaller gauge"), "{said}");
    assert!(said.contains("gauge.grid_length_mm"), "{said}");
}

#[test]
fn what_is_asked_for_helps() {
    let (_, said) = refused(|i| i.project.feasible.support_clearance_mm = 800.0);
    let mut inputs = limb();
    inputs.project.feasible.support_clearance_mm =
        asked_for(&said, "feasible.support_clearance_mm");
    assert!(feasible(&inputs) >= 2, "{said}");

    let (_, said) = refused(|i| i.project.gauge.range_microstrain = 1e-9);
    let mut inputs = limb();
    inputs.project.gauge.range_microstrain = asked_for(&said, "gauge.range_microstrain");
    assert!(feasible(&inputs) >= 2, "{said}");
}

#[test]
fn an_empty_region_and_one_that_is_kept_out_are_told_apart() {
    let (_, said) = refused(|i| {
        let none = vec![false; i.part.positions().len()];
        i.painted = Some(Arc::new(none));
    });
    assert!(said.contains("nothing is painted"), "{said}");
    let (blamed, said) = refused(|i| {
        let all = vec![true; i.part.positions().len()];
        i.masks.insert("cable".into(), Arc::new(all));
        i.project.feasible.keep_out = Some("cable".into());
    });
    assert_eq!(blamed, Some(Filter::KeptOut), "{said}");
    assert!(said.contains("feasible.keep_out"), "{said}");
}

#[test]
fn more_gauges_than_sites_are_told_how_many_there_are() {
    let left = feasible(&limb());
    let (_, said) = refused(|i| i.project.selection.sensors = 5000);
    assert!(
        said.contains("5000 gauges") && said.contains(&left.to_string()),
        "{said}"
    );
    assert!(said.contains("selection.sensors"), "{said}");
}

#[test]
fn too_few_touches_are_told_where_they_went() {
    let mut inputs = limb();
    inputs.project.touch.count = 11;
    let few = design::simulate(&inputs, &budget(), &unwatched).unwrap();
    let verdicts = design::filter(&inputs, &few);
    let error = design::reduce_sites(&inputs, &few, &verdicts, &budget()).err();
    let said = error.unwrap().to_string();
    assert!(
        said.contains("touch.count from 11 to at least 20"),
        "{said}"
    );
}

/// A square plate of 80 mm as CAD programs write it: two triangles, every vertex on its rim.
#[test]
fn a_plate_of_two_triangles_is_touched_all_over_but_its_margin() {
    let side = 0.08;
    let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
    let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
    let mut project = Project::around("plate.stl", Some(Unit::Millimetre));
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-1.0, -1.0, -1.0], [1.0, 81.0, 1.0]]),
        box_axis: None,
        vertices: None,
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    project.sites.spacing_mm = 8.0;
    let part = TriMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]], 0)
        .unwrap()
        .0;
    let mut inputs = Inputs {
        project,
        part: Arc::new(part),
        painted: None,
        masks: Masks::new(),
    };
    let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
    let touches = &simulated.dataset.touches;
    assert_eq!(touches.len(), 60);
    let margin = inputs.project.touch.edge_margin_mm * 1e-3;
    let away = |x: f64| x.min(side - x);
    for touch in touches {
        let p = touch.position;
        assert!(away(p.x).min(away(p.y)) > 0.9 * margin, "{p}");
    }
    let near = touches.iter().any(|t| away(t.position.x) < 0.01);
    assert!(near, "the plate is touched near its rim too");
    // A margin wider than the plate is the margin's fault.
    inputs.project.touch.edge_margin_mm = 50.0;
    let error = design::simulate(&inputs, &budget(), &unwatched).err();
    let said = error.unwrap().to_string();
    assert!(said.contains("edge_margin_mm (50 mm)"), "{said}");
    // A region without a vertex is the region's.
    inputs.project.touch.edge_margin_mm = 2.4;
    inputs.project.touch.region = Some("grip".into());
    inputs.masks.insert("grip".into(), Arc::new(vec![false; 4]));
    let error = design::simulate(&inputs, &budget(), &unwatched).err();
    let said = error.unwrap().to_string();
    assert!(
        said.contains("touch.region") && said.contains("empty"),
        "{said}"
    );
}

#[test]
fn sites_wider_apart_than_the_part_are_told_so() {
    let mut inputs = limb();
    inputs.project.sites.lattice = hapdef::project::SiteLattice::Even;
    inputs.project.sites.spacing_mm = 5000.0;
    let error = design::simulate(&inputs, &budget(), &unwatched).err();
    let said = error.unwrap().to_string();
    assert!(
        said.contains("5000 mm (sites.spacing_mm)") && said.contains("Lower it to less than"),
        "{said}"
    );
}

/// The program on the bundled project with a line of it changed: exit code and what it says.
fn design_with(from: &str, to: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    std::fs::copy(assets.join("limb.glb"), folder.path().join("limb.glb")).unwrap();
    let text = std::fs::read_to_string(assets.join("limb.hapdef.toml")).unwrap();
    assert!(text.contains(from));
    let path = folder.path().join("p.hapdef.toml");
    std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let out = folder.path().join("out");
    let done = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["design", path.to_str().unwrap(), "--out"])
        .arg(&out)
        .output()
        .unwrap();
    assert!(!out.exists());
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    (done.status.code(), said)
}

#[test]
fn numbers_that_nobody_means_are_refused_by_their_key() {
    let cases = [
        (
            "tip_radius_mm = 5.0",
            "tip_radius_mm = 1e-20",
            "touch.tip_radius_mm",
        ),
        (
            "spacing_mm = 0.0",
            "required_mm = [[nan, 0, 0]]\nspacing_mm = 0.0",
            "selection.required_mm",
        ),
        ("force_n = 10.0", "force_n = 1e300", "touch.force_n"),
    ];
    for (from, to, key) in cases {
        let (code, said) = design_with(from, to);
        assert_eq!(code, Some(1), "{said}");
        assert!(
            said.contains("p.hapdef.toml") && said.contains(key),
            "{said}"
        );
        assert!(said.len() < 400, "{said}");
    }
}

#[test]
fn what_bounds_the_elements_is_what_is_to_be_changed() {
    let left = Discretization {
        displacement_mm: 0.1,
        displacement_percent: 9.0,
        strain_percent: 20.0,
        reading_percent: 20.0,
        loads: 20,
        places: 100,
    };
    let of_shell = Linearity {
        largest_percent: 0.1,
        median_percent: 0.1,
        beyond: 0,
        loads: 20,
        force_n: 10.0,
    };
    let said = |quality: Quality, change: &dyn Fn(&mut Project)| {
        let mut project = limb().project;
        project.budget.quality = quality;
        change(&mut project);
        let budget = project.budget.budget();
        design::cautions(&left, Some(&of_shell), &project, &budget).remove(0)
    };
    let standard = said(Quality::Standard, &|_| ());
    assert!(standard.contains("a higher quality"), "{standard}");
    // Elements are graded already, and there is no quality above this one.
    let reference = said(Quality::Reference, &|_| ());
    for said in [&standard, &reference] {
        assert!(!said.contains("part.elements"), "{said}");
        assert!(said.contains("budget.limits.vertices"), "{said}");
    }
    assert!(!reference.contains("higher quality"), "{reference}");
    let limited = said(Quality::Draft, &|p| {
        p.budget.limits.vertices = Some(1500);
    });
    assert!(
        limited.contains("budget.limits.vertices from 1500"),
        "{limited}"
    );
    let as_given = said(Quality::Draft, &|p| {
        p.part.elements = hapdef::project::ElementKind::AsGiven;
    });
    assert!(
        as_given.contains("part.elements = \"graded\""),
        "{as_given}"
    );
}

/// Two faces of a box a hair apart are no solid, until they are joined.
#[test]
fn an_open_solid_that_welding_closes_is_told_the_key() {
    let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let faces = [
        [0, 2, 3, 1],
        [0, 1, 5, 4],
        [1, 3, 7, 5],
        [3, 2, 6, 7],
        [2, 0, 4, 6],
        [4, 5, 7, 6],
    ];
    let block = |gap: f64| {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for (k, face) in (0_u32..).zip(faces) {
            let first = 4 * k;
            let apart = DVec3::splat(gap * f64::from(k));
            positions.extend(face.map(|v| 0.02 * corner(v) + apart));
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        TriMesh::new(&positions, &triangles, 0).unwrap().0
    };
    let inputs = |part: TriMesh| {
        let mut project = Project::around("block.stl", Some(Unit::Millimetre));
        project.part.model = PartModel::Solid;
        project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some([[-1.0, -1.0, -1.0], [21.0, 21.0, 1.0]]),
            box_axis: None,
            vertices: None,
            normal: Axis::Z,
            bedding_n_per_mm3: None,
        });
        Inputs {
            project,
            part: Arc::new(part),
            painted: None,
            masks: Masks::new(),
        }
    };
    let torn = inputs(block(2e-6));
    let refused = design::ground(&torn, &unwatched).err().unwrap().to_string();
    assert!(refused.contains("part.weld_mm = 0.02)"), "{refused}");
    let advice = design::advise(&torn, &unwatched).unwrap().words.join(" ");
    assert!(advice.contains("part.weld_mm = 0.02)"), "{advice}");
    // Where there is nothing to join, nothing is said of it.
    let open = block(0.0).part_of(|t| t > 1).unwrap().0;
    let refused = design::ground(&inputs(open), &unwatched).err().unwrap();
    let refused = refused.to_string();
    assert!(refused.contains("encloses nothing"), "{refused}");
    assert!(!refused.contains("weld"), "{refused}");
}

/// Memory in words: digits that are read, and what is too much reads so.
#[test]
fn memory_is_said_in_digits_that_are_read() {
    let said = ElasticError::TooLarge {
        needed: 8_000.3e6,
        limit: 8e9,
    };
    let said = said.to_string();
    assert!(
        said.contains("8.01 GB") && said.contains("the 8 GB"),
        "{said}"
    );
    assert!(said.contains("budget.limits.vertices"), "{said}");
    let said = DesignError::TooLarge {
        needed: 3_053.123e9,
        limit: 0.1e9,
        sites: 10,
        touches: 20,
        said_by: SaidBy::Tables,
    };
    let said = said.to_string();
    assert!(
        said.contains("3060 GB") && said.contains("the 0.1 GB"),
        "{said}"
    );
}

#[test]
fn advice_has_digits_that_are_read() {
    let mut inputs = limb();
    inputs.project.part.thickness_mm = 1.0 / 0.6;
    let words = design::advise(&inputs, &unwatched).unwrap().words;
    assert!(words[0].contains("1.67 mm thick"), "{words:?}");
    // Counts are whole; of everything measured three digits.
    let digits = |word: &str| word.chars().filter(char::is_ascii_digit).count();
    let numbers = words
        .iter()
        .take(3)
        .flat_map(|w| w.split([' ', '(', ')', ',']));
    let measured = numbers.filter(|w| w.contains('.') && w.parse::<f64>().is_ok());
    for number in measured {
        assert!(
            digits(number.trim_start_matches(['0', '.'])) <= 3,
            "{number}"
        );
    }
}

#[test]
fn a_gauge_that_is_required_off_the_part_is_refused_or_said() {
    let required = |at: [f64; 3]| {
        let mut inputs = limb();
        inputs.project.selection.required_mm = vec![[22.5, 22.5, 60.0], at];
        design::simulate(&inputs, &budget(), &unwatched)
    };
    let said = required([900.0, 0.0, 40.0]).err().unwrap().to_string();
    assert!(
        said.starts_with("place of selection.required_mm 1 lies"),
        "{said}"
    );
    let off = required([60.0, 0.0, 40.0]).unwrap().achieved.cautions;
    let said = off.iter().find(|c| c.contains("selection.required_mm"));
    assert!(said.is_some_and(|s| s.contains("place 1 by")), "{off:?}");
    let near = required([22.5, -22.5, 60.0]).unwrap().achieved.cautions;
    assert!(!near.iter().any(|c| c.contains("required")), "{near:?}");
}

#[test]
fn advice_on_a_mesh_with_holes_does_not_call_it_closed_without_a_word() {
    let mut inputs = limb();
    let thick = inputs.part.thickened(4e-3);
    let holes: Vec<[u32; 3]> = (thick.triangles().iter().enumerate())
        .filter(|(k, _)| k % 200 != 7)
        .map(|(_, t)| *t)
        .collect();
    let (open, _) = TriMesh::new(thick.positions(), &holes, 0).unwrap();
    assert!(open.boundary_edges().count() > 10);
    inputs.part = Arc::new(open);
    inputs.project.part.model = PartModel::Solid;
    let advice = design::advise(&inputs, &unwatched).unwrap();
    let words = advice.words.concat();
    assert!(!advice.closed || words.contains("open edges"), "{words}");
}
