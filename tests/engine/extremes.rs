//! The ends of every range: a right answer or a plain refusal, never a panic, never a number that is not
//! one.

use crate::coarse;

use std::path::Path;
use std::sync::Arc;

use coarse::limb;
use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::dataset::Signal;
use hapdef::design::{self, Design, DesignError, Inputs};
use hapdef::elasticity::Touch;
use hapdef::evaluation::EstimatorKind;
use hapdef::feasible::Filter;
use hapdef::given::{self, GivenSite};
use hapdef::io::artifacts::{self, Provenance};
use hapdef::io::report;
use hapdef::mesh::TriMesh;
use hapdef::placement::SelectorKind;
use hapdef::project::{ElementKind, Masks, Project, SiteLattice, SupportKeys, SupportKind};

fn budget() -> Budget {
    Budget {
        touches: 120,
        test_touches: 40,
        candidates: 12,
        selection_touches: 80,
        selection_candidates: 8,
        tuning_touches: 60,
        svr_steps: 20_000,
        map_triangles: 3000,
        ..Quality::Draft.budget()
    }
}

fn run(inputs: &Inputs) -> Result<Design, DesignError> {
    design::run(
        &design::DesignRequest {
            inputs,
            kinds: &SelectorKind::ALL,
            budget: &budget(),
        },
        &|| 0.0,
        &unwatched,
    )
}

/// The design ends, and every figure in it is a number.
fn sound(name: &str, inputs: &Inputs) -> Design {
    let design = run(inputs).unwrap_or_else(|e| panic!("{name}: {e}"));
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    assert!(
        finite(design.simulated.dataset.x.values()),
        "{name}: signals"
    );
    for row in &design.evaluation.rows {
        assert!(row.error_mm.is_finite(), "{name}: {row:?}");
    }
    for site in &design.simulated.dataset.sites {
        assert!(
            (site.gauge.direction.length() - 1.0).abs() < 1e-9,
            "{name}: direction"
        );
    }
    design
}

#[test]
fn forces_scale_signals_and_change_no_choice() {
    let base = sound("10 N", &limb());
    for (force, scale) in [(1e-9, 1e-10), (1e9, 1e8)] {
        let mut inputs = limb();
        inputs.project.touch.force_n = force;
        inputs.project.gauge.noise_microstrain = 1.0 * scale;
        inputs.project.gauge.range_microstrain = 30_000.0 * scale;
        let design = sound("force", &inputs);
        let ratio =
            design.simulated.dataset.x.values()[500] / base.simulated.dataset.x.values()[500];
        assert!((ratio / scale - 1.0).abs() < 1e-9, "{ratio:e}");
        // Expected error knows how hard touches come (touch.forces_n), which stays.
        for kind in SelectorKind::PAPER {
            assert_eq!(sets(&design, kind), sets(&base, kind), "{kind:?}");
        }
    }
}

fn sets(design: &Design, kind: SelectorKind) -> Vec<Vec<usize>> {
    let mut selections = design.selections.iter();
    let selection = selections.find(|s| s.selector == kind).unwrap();
    selection.sets.iter().map(|s| s.sites.clone()).collect()
}

#[test]
fn the_ends_of_the_project_are_sound() {
    type Change = fn(&mut Project);
    let cases: [(&str, Change); 14] = [
        ("one gauge", |p| p.selection.sensors = 1),
        ("no noise", |p| p.gauge.noise_microstrain = 0.0),
        ("displacement", |p| p.gauge.signal = Signal::Displacement),
        ("normal displacement", |p| {
            p.gauge.signal = Signal::NormalDisplacement;
        }),
        ("point tip", |p| p.touch.tip_radius_mm = 1e-6),
        ("tip larger than the limb", |p| p.touch.tip_radius_mm = 1e4),
        ("thin", |p| {
            p.part.thickness_mm = 0.01;
            p.gauge.range_microstrain = 1e12;
        }),
        ("thick", |p| {
            p.part.thickness_mm = 30.0;
            p.gauge.noise_microstrain = 0.0;
        }),
        ("nearly incompressible", |p| {
            p.material.poissons_ratio = 0.499;
        }),
        ("auxetic", |p| p.material.poissons_ratio = -0.9),
        ("no edge filter", |p| p.feasible.edge_neighbours = 0),
        ("all are neighbours", |p| {
            p.feasible.edge_neighbours = 1000;
            p.feasible.edge_radius_mm = 1e3;
        }),
        ("even lattice", |p| p.sites.lattice = SiteLattice::Even),
        ("C and ε at their ends", |p| {
            p.selection.c_mm = 1e9;
            p.selection.epsilon_mm = 0.0;
        }),
    ];
    for (name, change) in cases {
        let mut inputs = limb();
        change(&mut inputs.project);
        sound(name, &inputs);
    }
}

#[test]
fn as_many_gauges_as_feasible_sites_and_one_more() {
    let mut inputs = limb();
    inputs.project.sites.spacing_mm = 22.0;
    inputs.project.feasible.edge_neighbours = 0;
    let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
    let feasible = design::filter(&inputs, &simulated).sites().len();
    assert!((3..100).contains(&feasible), "{feasible}");
    inputs.project.selection.sensors = feasible;
    let design = sound("all", &inputs);
    assert_eq!(design.chosen().len(), feasible);
    inputs.project.selection.sensors = feasible + 1;
    assert!(matches!(
        run(&inputs).err(),
        Some(DesignError::Shortage(s)) if (s.wanted, s.available) == (feasible + 1, feasible)
    ));
}

#[test]
fn noise_above_every_signal_leaves_no_site() {
    let mut inputs = limb();
    inputs.project.gauge.noise_microstrain = 1e6;
    let refused = run(&inputs).err();
    assert!(
        matches!(&refused, Some(DesignError::Shortage(s)) if s.blamed == Some(Filter::Noise)),
        "{refused:?}"
    );
}

#[test]
fn one_feasible_site_is_taken_and_a_second_is_refused() {
    let open = sound("all sites", &limb());
    let part = limb().part;
    let index = part.index();
    let one = open.reduced.feasible.iter().find_map(|&s| {
        let at = index
            .nearest(open.simulated.dataset.sites[s].gauge.position)
            .0;
        let mut mask = vec![false; part.positions().len()];
        for &v in &part.triangles()[at.triangle as usize] {
            mask[v as usize] = true;
        }
        let mut inputs = limb();
        inputs.painted = Some(Arc::new(mask));
        inputs.project.selection.sensors = 1;
        let left = design::filter(&inputs, &open.simulated).sites().len();
        (left == 1).then_some(inputs)
    });
    let mut inputs = one.expect("a triangle with one site");
    let design = sound("one site", &inputs);
    assert_eq!(design.chosen().len(), 1);
    assert_eq!(design.reduced.candidate_sites(), design.chosen());
    inputs.project.selection.sensors = 2;
    let refused = run(&inputs).err();
    assert!(
        matches!(&refused, Some(DesignError::Shortage(s)) if (s.wanted, s.available) == (2, 1)),
        "{refused:?}"
    );
}

#[test]
fn the_same_limb_at_a_micrometre_and_at_a_metre() {
    // Geometric similarity: lengths and tip times k, force times k²: strains stay. On the part's own
    // triangles, for remeshing takes other turns where two choices are equal.
    let limb = || {
        let mut inputs = limb();
        inputs.project.part.elements = ElementKind::AsGiven;
        inputs
    };
    let base = sound("limb", &limb());
    for k in [1e-5, 10.0] {
        let mut inputs = limb();
        let scaled: Vec<DVec3> = inputs.part.positions().iter().map(|&p| p * k).collect();
        inputs.part = Arc::new(TriMesh::new(&scaled, inputs.part.triangles(), 0).unwrap().0);
        let p = &mut inputs.project;
        for support in &mut p.supports {
            support.box_mm = support.box_mm.map(|b| b.map(|c| c.map(|x| x * k)));
        }
        p.part.thickness_mm *= k;
        p.touch.force_n *= k * k;
        p.touch.tip_radius_mm *= k;
        p.touch.edge_margin_mm *= k;
        p.touch.reach_mm *= k;
        p.sites.spacing_mm *= k;
        p.feasible.support_clearance_mm *= k;
        p.feasible.edge_radius_mm *= k;
        p.gauge.grid_length_mm *= k;
        p.gauge.grid_width_mm *= k;
        p.gauge.flatness_mm *= k;
        let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
        let (a, b) = (&base.simulated.dataset, &simulated.dataset);
        assert_eq!(a.sites.len(), b.sites.len());
        let difference = |r: usize| -> f64 {
            let (x, y) = (a.x.row(r), b.x.row(r));
            let apart: f64 = x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum();
            apart.sqrt() / x.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        let middle = a.sites.len() / 2;
        assert!(difference(middle) < 1e-6, "{k}: {:e}", difference(middle));
    }
}

#[test]
fn one_triangle_and_a_sliver() {
    let tri = |height: f64| {
        let p = [
            DVec3::ZERO,
            DVec3::new(0.05, 0.0, 0.0),
            DVec3::new(0.025, height, 0.0),
        ];
        let mut project = Project::around("t.glb", None);
        project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some([[-1.0, -0.001, -1.0], [51.0, 0.001, 1.0]]),
            box_axis: None,
            vertices: None,
            normal: hapdef::mesh::unroll::Axis::Z,
            bedding_n_per_mm3: None,
        });
        project.touch.edge_margin_mm = 0.0;
        project.feasible.support_clearance_mm = 0.0;
        project.feasible.edge_neighbours = 0;
        project.gauge.grid_length_mm = 0.1;
        project.gauge.grid_width_mm = 0.1;
        project.selection.sensors = 1;
        Inputs {
            project,
            part: Arc::new(TriMesh::new(&p, &[[0, 1, 2]], 0).unwrap().0),
            painted: None,
            masks: Masks::new(),
        }
    };
    sound("one triangle", &tri(0.04));
    // Aspect 1e4: too thin for a single site at the default spacing.
    assert!(run(&tri(5e-6)).is_err());
}

#[test]
fn a_part_held_all_over_and_too_few_touches_are_refused() {
    let mut inputs = limb();
    inputs.project.supports[0].box_mm = Some([[-1e3; 3], [1e3; 3]]);
    let error = run(&inputs).err().unwrap().to_string();
    assert!(error.contains("every point of the part is held"), "{error}");
    for count in [3, 7, 19] {
        let mut inputs = limb();
        inputs.project.touch.count = count;
        let error = run(&inputs).err().unwrap().to_string();
        assert!(error.contains("too few to learn from"), "{error}");
    }
    let mut inputs = limb();
    inputs.project.touch.count = 1_000_000;
    let budget = Budget {
        touches: usize::MAX,
        ..budget()
    };
    let error = design::simulate(&inputs, &budget, &unwatched)
        .err()
        .unwrap();
    assert!(matches!(error, DesignError::TooLarge { .. }), "{error}");
}

#[test]
fn values_outside_their_range_are_named() {
    type Change = fn(&mut Project);
    let cases: [(Change, &str); 8] = [
        (|p| p.material.poissons_ratio = 0.5, "poissons_ratio"),
        (|p| p.part.thickness_mm = 0.0, "thickness_mm"),
        (|p| p.touch.count = 2, "touch.count"),
        (|p| p.selection.gamma = f64::INFINITY, "gamma"),
        (|p| p.touch.count = usize::MAX, "touch.count"),
        (|p| p.feasible.edge_neighbours = 100_000, "edge_neighbours"),
        (|p| p.candidates.unexplained = 1.0, "unexplained"),
        (
            |p| p.supports[0].box_mm = Some([[f64::NAN; 3]; 2]),
            "box_mm",
        ),
    ];
    for (change, key) in cases {
        let mut inputs = limb();
        change(&mut inputs.project);
        let error = run(&inputs)
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(error.contains(key), "{key}: {error}");
    }
}

/// A round plate (clamped outside 40 mm of 50 mm) pressed in its middle, as a project: its deflection is
/// known in closed form for any thickness and Poisson's ratio.
fn plate(thickness: f64, nu: f64, sliver: f64) -> (Inputs, f64) {
    let (spokes, rings, outer, clear) = (120, 10, 50.0, 40.0);
    let mut p = vec![DVec3::ZERO];
    for ring in 1..=rings {
        for k in 0..spokes {
            let a = f64::from(k) / f64::from(spokes) * std::f64::consts::TAU;
            let mut r = outer * f64::from(ring) / f64::from(rings);
            if sliver > 0.0 && ring == 3 {
                // This ring lies a hair outside the one before it.
                r = outer * 2.0 / f64::from(rings) + sliver;
            }
            p.push(DVec3::new(a.cos(), a.sin(), 0.0) * r * 1e-3);
        }
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * spokes + k % spokes;
    let mut t: Vec<[u32; 3]> = (0..spokes).map(|k| [0, at(1, k), at(1, k + 1)]).collect();
    for ring in 1..rings as u32 {
        for k in 0..spokes {
            let [a, b, c, d] = [
                at(ring, k),
                at(ring + 1, k),
                at(ring + 1, k + 1),
                at(ring, k + 1),
            ];
            t.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut project = Project::around("plate.glb", None);
    project.part.thickness_mm = thickness;
    project.material.poissons_ratio = nu;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: None,
        box_axis: None,
        vertices: Some("rim".into()),
        normal: hapdef::mesh::unroll::Axis::Z,
        bedding_n_per_mm3: None,
    });
    let part = TriMesh::new(&p, &t, 0).unwrap().0;
    let rim = part
        .positions()
        .iter()
        .map(|p| p.length() > clear * (1.0 - 1e-6) * 1e-3);
    let mut masks = Masks::new();
    masks.insert("rim".into(), Arc::new(rim.collect()));
    let s = project.section();
    let inputs = Inputs {
        project,
        part: Arc::new(part),
        painted: None,
        masks,
    };
    // 1 N in the middle, tip 4 mm: m = a²/4 is the tip's mean squared radius, and the mean of
    // r² ln r over it is had by quadrature; deflection 20 mm from the middle needs only m.
    let (big, r, m) = (clear * 1e-3, 20e-3, 4e-6_f64);
    let bending = ((r * r + m) * (r / big).ln()
        + (big * big + m) * (big * big - r * r) / (2.0 * big * big))
        / (8.0 * std::f64::consts::PI * s.bending_stiffness());
    let shear = (big / r).ln() / (2.0 * std::f64::consts::PI * s.shear_stiffness());
    (inputs, bending + shear)
}

fn pressed(inputs: &Inputs) -> Result<given::GivenAnswer, DesignError> {
    let touch = Touch {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        force: 1.0,
        tip_radius: 4e-3,
    };
    let site = GivenSite {
        position: DVec3::new(0.0, 20e-3, 0.0),
        direction: DVec3::Y,
    };
    given::answer(
        inputs,
        &[touch],
        &[site],
        &Quality::Draft.budget().clone(),
        &unwatched,
    )
}

fn deflection(inputs: &Inputs) -> f64 {
    let answer = pressed(inputs).unwrap();
    let pair = answer.pairs().next().unwrap();
    assert!(pair.strain.is_finite() && answer.checks.reaction_error < 1e-4);
    -pair.displacement.z
}

#[test]
fn a_plate_of_any_thickness_deflects_as_theory_says() {
    // Thickness over radius from 1e-1 to 1e-6.
    for thickness in [4.0, 1.0, 0.1, 4e-3, 4e-4, 4e-5] {
        let (inputs, known) = plate(thickness, 0.3, 0.0);
        let ratio = deflection(&inputs) / known;
        println!("t {thickness} mm: {ratio:.4}");
        assert!((ratio - 1.0).abs() < 0.02, "t {thickness} mm: {ratio}");
    }
}

#[test]
fn a_plate_of_any_poissons_ratio_deflects_as_theory_says() {
    for nu in [-0.9, 0.0, 0.45, 0.499] {
        let (inputs, known) = plate(1.0, nu, 0.0);
        let ratio = deflection(&inputs) / known;
        println!("ν {nu}: {ratio:.4}");
        assert!((ratio - 1.0).abs() < 0.02, "ν {nu}: {ratio}");
    }
}

#[test]
fn slivers_of_the_file_do_not_reach_the_answer() {
    // A ring of triangles 1 mm long and down to 0.1 µm high: aspect 1e4.
    for sliver in [1e-2, 1e-4] {
        let (inputs, known) = plate(1.0, 0.3, sliver);
        let thinnest = (0..inputs.part.triangles().len() as u32)
            .map(|t| inputs.part.thinness(t))
            .fold(1.0, f64::min);
        let ratio = deflection(&inputs) / known;
        println!("thinnest {thinnest:.0e}: {ratio:.4}");
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn millimetres_taken_for_metres_and_the_other_way_are_refused_in_plain_words() {
    let scaled = |k: f64| {
        let mut inputs = limb();
        let points: Vec<DVec3> = inputs.part.positions().iter().map(|&p| p * k).collect();
        inputs.part = Arc::new(TriMesh::new(&points, inputs.part.triangles(), 0).unwrap().0);
        inputs
    };
    for k in [1e3, 1e-3] {
        let error = run(&scaled(k)).err().expect("refused").to_string();
        assert!(
            error.contains("the unit of the mesh") || error.contains("support box"),
            "{error}"
        );
    }
    // The supports' boxes moved along, so that only the sizes are wrong.
    for k in [1e3, 1e-3] {
        let mut inputs = scaled(k);
        for support in &mut inputs.project.supports {
            support.box_mm = support.box_mm.map(|b| b.map(|c| c.map(|x| x * k)));
        }
        let error = run(&inputs).err().expect("refused").to_string();
        assert!(error.contains("unit of the mesh"), "{error}");
    }
}

#[test]
fn a_second_body_that_nothing_holds_is_left_out_or_named() {
    let near = limb();
    let mut points = near.part.positions().to_vec();
    let mut triangles = near.part.triangles().to_vec();
    let base = points.len() as u32;
    points.extend([0.5, 0.51, 0.52].map(|x| DVec3::new(x, 0.01 * (x - 0.5).sin(), 0.0)));
    triangles.push([base, base + 1, base + 2]);
    let (kept, report) = TriMesh::new(&points, &triangles, 0).unwrap();
    assert_eq!(
        (report.bodies, kept.positions().len()),
        (2, near.part.positions().len())
    );
    let mut inputs = limb();
    inputs.part = Arc::new(TriMesh::new(&points, &triangles, 1).unwrap().0);
    let error = run(&inputs).err().expect("nothing holds it").to_string();
    assert!(error.contains("support"), "{error}");
}

#[test]
fn touches_off_the_part_are_projected_or_refused() {
    let (inputs, _) = plate(1.0, 0.3, 0.0);
    let at = |height: f64, x: f64| {
        let touch = Touch {
            position: DVec3::new(x, 0.0, height),
            normal: DVec3::Z,
            force: 1.0,
            tip_radius: 4e-3,
        };
        let site = GivenSite {
            position: DVec3::new(0.0, 20e-3, -0.5e-3),
            direction: DVec3::Y,
        };
        given::answer(
            &inputs,
            &[touch],
            &[site],
            &Quality::Draft.budget(),
            &unwatched,
        )
    };
    let answer = at(3e-3, 0.0).unwrap();
    assert!((answer.rows.touch_distances[0] - 3e-3).abs() < 1e-9);
    assert!((answer.rows.site_distances[0] - 0.5e-3).abs() < 1e-9);
    let straight = at(0.0, 0.0).unwrap();
    let strain = |a: &given::GivenAnswer| a.pairs().next().unwrap().strain;
    assert!((strain(&answer) / strain(&straight) - 1.0).abs() < 1e-9);
    // Pressed on what is held: nothing moves, and that is no error.
    let held = at(0.0, 0.047).unwrap();
    assert!(strain(&held).abs() < 1e-6 * strain(&straight).abs());
    let error = at(5.0, 0.0).err().expect("5 m away").to_string();
    assert!(
        error.contains("touch 0") && error.contains("unit"),
        "{error}"
    );
}

#[test]
fn a_tip_larger_than_the_part_presses_all_of_it() {
    let (inputs, _) = plate(1.0, 0.3, 0.0);
    let touch = |tip_radius| Touch {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        force: 1.0,
        tip_radius,
    };
    let site = GivenSite {
        position: DVec3::ZERO,
        direction: DVec3::Y,
    };
    let budget = Quality::Draft.budget();
    let answer = given::answer(
        &inputs,
        &[touch(10.0), touch(20.0)],
        &[site],
        &budget,
        &unwatched,
    );
    let answer = answer.unwrap();
    let down: Vec<f64> = answer.pairs().map(|p| -p.displacement.z).collect();
    // 1 N over a disc of 50 mm, of which 40 mm are free: q R⁴ / 64 D with q = 1 N over all of it.
    let s = inputs.project.section();
    let known =
        0.04_f64.powi(4) / (std::f64::consts::PI * 0.05 * 0.05) / (64.0 * s.bending_stiffness());
    for w in down {
        assert!((w / known - 1.0).abs() < 0.03, "{w:e} {known:e}");
    }
}

#[test]
fn a_million_triangles_are_taken_in_and_computed_on() {
    let n = 708u32;
    let p: Vec<DVec3> = (0..=n)
        .flat_map(|j| (0..=n).map(move |i| DVec3::new(f64::from(i), f64::from(j), 0.0) * 1e-4))
        .collect();
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let t: Vec<[u32; 3]> = (0..n)
        .flat_map(|j| {
            (0..n).flat_map(move |i| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
        })
        .collect();
    assert!(t.len() > 1_000_000);
    let mut project = Project::around("plate.glb", None);
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-1.0, -1.0, -1.0], [80.0, 10.0, 1.0]]),
        box_axis: None,
        vertices: None,
        normal: hapdef::mesh::unroll::Axis::Z,
        bedding_n_per_mm3: None,
    });
    let inputs = Inputs {
        project,
        part: Arc::new(TriMesh::new(&p, &t, 0).unwrap().0),
        painted: None,
        masks: Masks::new(),
    };
    let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
    let vertices = simulated.mesh.positions().len();
    assert!((1500..8000).contains(&vertices), "{vertices}");
    assert!(simulated.dataset.x.values().iter().all(|x| x.is_finite()));
}

#[test]
fn sites_are_reduced_only_where_somebody_asks_for_candidates() {
    let inputs = limb();
    assert_eq!(inputs.project.evaluation.estimator, EstimatorKind::Matching);
    let simulated = Arc::new(design::simulate(&inputs, &budget(), &unwatched).unwrap());
    let chosen = |inputs: &Inputs, kind: SelectorKind| {
        let simulated = Arc::clone(&simulated);
        design::run_from(
            &design::DesignRequest {
                inputs,
                kinds: &[kind],
                budget: &budget(),
            },
            simulated,
            &|| 0.0,
            &unwatched,
        )
        .unwrap()
    };
    let reduces = |design: &Design| design.seconds.iter().any(|s| s.stage == "reduce");
    // Expected error chooses among all feasible sites, and matching compares with no others.
    let all = chosen(&inputs, SelectorKind::ExpectedError);
    let feasible = all.reduced.feasible.len();
    assert!(all.candidates.is_none() && all.reduced.candidate_sites().is_empty());
    assert!(!reduces(&all) && all.candidate_count() == feasible);
    let summary = artifacts::summary(&inputs, &all);
    assert_eq!(summary["counts"]["candidates"], feasible);
    assert!(summary["unexplained"].is_null());
    let written = Provenance {
        mesh_path: Path::new("limb.obj"),
        version: "",
        taken_in: None,
    };
    let page = report::html(&inputs, &all, &written);
    assert!(page.contains("feasible, all of them candidates"));
    assert!(!page.contains("left unexplained"));
    // Greedy SVR asks for candidates, and so does a judge by regression or a number of them.
    let mut trained = inputs.clone();
    trained.project.evaluation.estimator = EstimatorKind::Svr;
    let mut counted = inputs.clone();
    counted.project.candidates.count = Some(9);
    for (inputs, kind, count) in [
        (&inputs, SelectorKind::GreedySvr, None),
        (&trained, SelectorKind::PcaQr, None),
        (&counted, SelectorKind::ExpectedError, Some(9)),
    ] {
        let design = chosen(inputs, kind);
        let kept = design.candidates.as_ref().unwrap().rows.len();
        assert!(reduces(&design) && kept < feasible && kept == design.candidate_count());
        assert!(count.is_none_or(|count| count == kept), "{kept}");
        let page = report::html(inputs, &design, &written);
        assert!(page.contains("left unexplained") && !page.contains("The paper's comparison"));
    }
    let four = design::run_from(
        &design::DesignRequest {
            inputs: &trained,
            kinds: &SelectorKind::PAPER,
            budget: &budget(),
        },
        Arc::clone(&simulated),
        &|| 0.0,
        &unwatched,
    );
    let page = report::html(&trained, &four.unwrap(), &written);
    let (_, section) = page.split_once("The paper's comparison").unwrap();
    let table = section.split_once("</table>").unwrap().0;
    for kind in SelectorKind::PAPER {
        assert!(table.contains(kind.title()), "{table}");
    }
    assert!(!table.contains("NaN") && table.contains(" / "), "{table}");
    no_more_than_three_notes_are_read_at_once(all);
}

/// What cannot be trusted counts among them.
fn no_more_than_three_notes_are_read_at_once(mut design: Design) {
    let cautions = (0..5).map(|k| format!("caution {k}")).collect();
    let simulated = Arc::make_mut(&mut design.simulated);
    simulated.achieved.cautions = cautions;
    simulated.discretization.displacement_percent = 1.0;
    let (sound, all) = (design.doubts().len(), design.words());
    assert_eq!(all.open.len(), 3 - sound.min(3));
    Arc::make_mut(&mut design.simulated)
        .discretization
        .displacement_percent = 90.0;
    let words = design.words();
    assert_eq!(design.doubts().len(), sound + 1);
    assert_eq!(words.open.len(), 3 - (sound + 1).min(3));
    assert_eq!(
        words.open.len() + words.folded.len(),
        all.open.len() + all.folded.len()
    );
}
