//! Supports that give way, against a rigid body on springs.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::Inputs;
use hapdef::elasticity::Touch;
use hapdef::given::{self, GivenSite};
use hapdef::mesh::TriMesh;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, PartModel, Project, SupportKeys, SupportKind};

/// Of the strip and the block (m), which are 100 mm long.
const WIDE: f64 = 0.02;
/// How much of it is held (m), from one end.
const HELD: f64 = 0.02;
/// Of the strip.
const THICK: f64 = 3e-3;
const FORCE: f64 = 3.0;

/// A strip of 100 × 20 mm as a shell of 3 mm, or a block that is 20 mm high as a solid: held over 20 mm of its length at the
/// bottom.
fn part(model: PartModel, modulus_gpa: f64, bedding: Option<f64>) -> Inputs {
    let flat = |i: u32, j: u32, z: f64| DVec3::new(f64::from(i) * 0.01, f64::from(j) * 0.01, z);
    let sheet = |z: f64| (0..11).flat_map(move |i| (0..3).map(move |j| flat(i, j, z)));
    let mut positions: Vec<DVec3> = sheet(0.0).collect();
    let number = |i: u32, j: u32| 3 * i + j;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let quads = (0..10).flat_map(|i| (0..2).map(move |j| (i, j)));
    for (i, j) in quads {
        let [a, b] = [number(i, j), number(i + 1, j)];
        triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    if model == PartModel::Solid {
        positions.extend(sheet(WIDE));
        let up: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| v + 33)).collect();
        for t in &mut triangles {
            t.reverse();
        }
        triangles.extend(up);
        let rim: Vec<u32> = (0..10)
            .map(|i| number(i, 0))
            .chain((0..2).map(|j| number(10, j)))
            .chain((1..=10).rev().map(|i| number(i, 2)))
            .chain((1..=2).rev().map(|j| number(0, j)))
            .collect();
        for (k, &a) in rim.iter().enumerate() {
            let b = rim[(k + 1) % rim.len()];
            triangles.extend([[a, b, b + 33], [a, b + 33, a + 33]]);
        }
    }
    let mut project = Project::around("part.glb", None);
    project.part.model = model;
    project.part.thickness_mm = THICK * 1e3;
    project.material.youngs_modulus_gpa = modulus_gpa;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-1.0, -1.0, -1.0], [HELD * 1e3, 21.0, 1e-3]]),
        box_axis: None,
        vertices: None,
        normal: Axis::Z,
        bedding_n_per_mm3: bedding,
    });
    Inputs {
        project,
        part: Arc::new(TriMesh::new(&positions, &triangles, 0).unwrap().0),
        painted: None,
        masks: Masks::new(),
    }
}

/// How far the middle of the part moves down (m) at some places along it, pressed at one.
fn moved(inputs: &Inputs, pressed: f64, along: [f64; 2]) -> [f64; 2] {
    let top = match inputs.project.part.model {
        PartModel::Shell => 0.0,
        PartModel::Solid => WIDE,
    };
    let at = |x: f64| DVec3::new(x, WIDE / 2.0, top);
    let touch = Touch {
        position: at(pressed),
        normal: DVec3::Z,
        force: FORCE,
        tip_radius: 3e-3,
    };
    let sites = along.map(|x| GivenSite {
        position: at(x),
        direction: DVec3::X,
    });
    let budget = Quality::Draft.budget();
    let answer = given::answer(inputs, &[touch], &sites, &budget, &unwatched).unwrap();
    assert!(answer.checks.reaction_error < 1e-6, "{:?}", answer.checks);
    assert!(answer.checks.energy_error < 1e-6, "{:?}", answer.checks);
    let mut pairs: Vec<_> = answer.pairs().collect();
    pairs.sort_by_key(|pair| pair.site);
    [0, 1].map(|k| -pairs[k].displacement.z)
}

/// A body that is far stiffer than what holds it sinks by F / (b A) and turns about the middle of what is held.
#[test]
fn a_stiff_part_moves_as_a_rigid_body_on_springs() {
    const BEDDING: f64 = 20.0;
    let b = BEDDING * 1e9;
    let area = HELD * WIDE;
    // A wall is held through its thickness too.
    let shell = area * (HELD.powi(2) + THICK.powi(2)) / 12.0;
    let solid = area * HELD.powi(2) / 12.0;
    for (model, modulus_gpa, turning) in [
        (PartModel::Shell, 1e5, shell),
        (PartModel::Solid, 1e3, solid),
    ] {
        let inputs = part(model, modulus_gpa, Some(BEDDING));
        let pressed = 0.07;
        let along = [0.03, 0.09];
        let arm = pressed - HELD / 2.0;
        let found = moved(&inputs, pressed, along);
        for (x, found) in along.into_iter().zip(found) {
            let right = FORCE / b * (1.0 / area + arm * (x - HELD / 2.0) / turning);
            println!("{model:?} at {x}: {found:.3e} m, rigid body {right:.3e}");
            assert!(
                (found / right - 1.0).abs() < 0.02,
                "{model:?}: {found} {right}"
            );
        }
    }
}

#[test]
fn what_gives_way_less_and_less_holds_at_last() {
    for model in [PartModel::Shell, PartModel::Solid] {
        let of = |bedding| moved(&part(model, 2.0, bedding), 0.07, [0.03, 0.09])[1];
        let firm = of(None);
        let given = [10.0, 1e3, 1e7].map(|bedding| of(Some(bedding)) / firm - 1.0);
        println!("{model:?}: {given:?} more than held firmly");
        assert!(given[0] > given[1] && given[1] > given[2], "{given:?}");
        assert!(given[0] > 0.1 && given[2].abs() < 0.02, "{given:?}");
    }
}
