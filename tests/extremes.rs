//! The ends of every range: a right answer or a plain refusal, never a panic, never a number that is not
//! one.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::dataset::Signal;
use hapdef::design::{self, Design, DesignError, Inputs};
use hapdef::limb::LimbSpec;
use hapdef::mesh::TriMesh;
use hapdef::placement::{PlacementError, SelectorKind};
use hapdef::project::{Lattice, Project, SupportKeys, SupportKind};

fn budget() -> Budget {
    Budget {
        touches: 120,
        test_touches: 40,
        candidates: 12,
        selection_touches: 80,
        selection_candidates: 8,
        tuning_touches: 60,
        svr_steps: 20_000,
        ..Quality::Draft.budget()
    }
}

fn limb() -> Inputs {
    let mut inputs = hapdef::cli::bundled().unwrap().inputs;
    let coarse = LimbSpec {
        element: 5.0,
        ..LimbSpec::default()
    };
    inputs.part = Arc::new(coarse.build().unwrap().0);
    // No multiple of it falls on a window's edge, where rounding would decide.
    inputs.project.sites.spacing_mm = 4.1;
    inputs.project.feasible.edge_radius_mm = 4.0;
    inputs.project.selection.sensors = 2;
    inputs
}

fn run(inputs: &Inputs) -> Result<Design, DesignError> {
    design::run(inputs, &SelectorKind::ALL, &budget(), &|| 0.0, &unwatched)
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
            (site.direction.length() - 1.0).abs() < 1e-9,
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
        assert_eq!(design.chosen(), base.chosen());
    }
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
        ("even lattice", |p| p.sites.lattice = Lattice::Even),
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
    inputs.project.sites.spacing_mm = 14.0;
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
        Some(DesignError::Placement(PlacementError::TooFewSites { .. }))
    ));
}

#[test]
fn noise_above_every_signal_leaves_no_site() {
    let mut inputs = limb();
    inputs.project.gauge.noise_microstrain = 1e6;
    assert_eq!(
        run(&inputs).err(),
        Some(DesignError::Placement(PlacementError::NoSites))
    );
}

#[test]
fn the_same_limb_at_a_micrometre_and_at_a_metre() {
    // Geometric similarity: lengths and tip times k, force times k²: strains stay.
    let base = sound("limb", &limb());
    for k in [1e-5, 10.0] {
        let mut inputs = limb();
        let scaled: Vec<DVec3> = inputs.part.positions().iter().map(|&p| p * k).collect();
        inputs.part = Arc::new(TriMesh::new(&scaled, inputs.part.triangles(), 0).unwrap().0);
        let p = &mut inputs.project;
        for support in &mut p.supports {
            support.box_mm = support.box_mm.map(|c| c.map(|x| x * k));
        }
        p.part.thickness_mm *= k;
        p.touch.force_n *= k * k;
        p.touch.tip_radius_mm *= k;
        p.touch.edge_margin_mm *= k;
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
            box_mm: [[-1.0, -0.001, -1.0], [51.0, 0.001, 1.0]],
            normal: hapdef::mesh::unroll::Axis::Z,
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
        }
    };
    sound("one triangle", &tri(0.04));
    // Aspect 1e4: too thin for a single site at the default spacing.
    assert!(run(&tri(5e-6)).is_err());
}

#[test]
fn a_part_held_all_over_and_too_few_touches_are_refused() {
    let mut inputs = limb();
    inputs.project.supports[0].box_mm = [[-1e3; 3], [1e3; 3]];
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
        (|p| p.supports[0].box_mm[0][1] = f64::NAN, "box_mm"),
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
