//! Solids at the edge: right, or refused in plain words.

use crate::bench;

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use bench::solids::{block, clamp, model, under};
use glam::DVec3;
use hapdef::budget::{Progress, Quality, Watch, unwatched};
use hapdef::design::{self, Inputs};
use hapdef::elasticity::solid::ground::SolidGround;
use hapdef::elasticity::solid::immersed::{Fineness, Immersed};
use hapdef::elasticity::{ElasticError, Material, Touch};
use hapdef::limb::LimbSpec;
use hapdef::mesh::TriMesh;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, PartModel, Project, SupportKeys, SupportKind, Unit};

const SOFT: Material = Material {
    youngs_modulus: 2e9,
    poissons_ratio: 0.0,
};

/// A bar 10 × 1 × 1, times a scale, fixed at one end and pressed at its other end: stretched by its own length
/// over its stiffness.
fn squeezed(scale: f64, cells: f64) -> f64 {
    let part = block(DVec3::new(10.0, 1.0, 1.0) * scale, |p| p);
    let far = DVec3::splat(100.0 * scale);
    let support = clamp(-far, far.with_x(2.0 * scale));
    let fineness = Fineness::of(cells * scale, 0.5 * scale);
    let m = model(&part, SOFT, &[support], &fineness);
    let touch = Touch {
        position: DVec3::new(10.0, 0.5, 0.5) * scale,
        normal: DVec3::X,
        force: 1.0,
        tip_radius: 10.0 * scale,
    };
    under(&m, &touch) * SOFT.youngs_modulus * scale / 8.0
}

#[test]
fn any_size_and_few_cells() {
    for scale in [1e-7, 1e-3, 1.0, 100.0] {
        for cells in [0.9, 2.5, 20.0] {
            let ratio = squeezed(scale, cells);
            // One cell for the whole bar cuts its edges a little.
            let most = if cells > 10.0 { 0.06 } else { 0.01 };
            assert!((ratio - 1.0).abs() < most, "{scale} {cells}: {ratio}");
        }
    }
}

#[test]
fn a_wall_of_a_hundredth_of_a_cell_bends() {
    // A strip 20 × 10 mm, 0.1 mm thin, in cells of 10 mm, across them.
    let wall = 1e-4;
    let turn = glam::DQuat::from_axis_angle(DVec3::new(0.2, 1.0, 0.1).normalize(), 0.4);
    let part = block(DVec3::new(0.02, 0.01, wall), |p| {
        turn * (p - DVec3::new(0.01, 0.005, 0.0))
    });
    let far = DVec3::splat(1.0);
    let support = clamp(-far, far.with_x(-0.004));
    let m = model(&part, SOFT, &[support], &Fineness::of(0.01, wall));
    let touch = Touch {
        position: turn * DVec3::new(0.008, 0.0, wall),
        normal: turn * DVec3::Z,
        force: 1e-6,
        tip_radius: 0.001,
    };
    // The same strip in cells of a few walls, which bend as a beam (see `solids.rs`).
    let fine = model(
        &part,
        SOFT,
        &[clamp(-far, far.with_x(-0.004))],
        &Fineness::of(0.0012, wall),
    );
    let ratio = under(&m, &touch) / under(&fine, &touch);
    assert!((0.5..1.1).contains(&ratio), "{ratio}");
}

/// Several surfaces in one file.
fn together(parts: &[&TriMesh]) -> Arc<TriMesh> {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let first = positions.len() as u32;
        positions.extend_from_slice(part.positions());
        triangles.extend(part.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    Arc::new(TriMesh::new(&positions, &triangles, 0).unwrap().0)
}

#[test]
fn two_bodies_that_touch_are_one() {
    // Two halves of the bar share a face; the whole has none.
    let half = |from: f64| {
        let place = move |p: DVec3| p + DVec3::X * from;
        block(DVec3::new(5.0, 1.0, 1.0), place)
    };
    let (one, two) = (half(0.0), half(5.0));
    let both = together(&[&one, &two]);
    let support = clamp(DVec3::splat(-100.0), DVec3::new(2.0, 100.0, 100.0));
    let touch = Touch {
        position: DVec3::new(10.0, 0.5, 1.0),
        normal: DVec3::Z,
        force: 1.0,
        tip_radius: 0.3,
    };
    let fineness = Fineness::of(0.7, 0.5);
    let whole = block(DVec3::new(10.0, 1.0, 1.0), |p| p);
    let joined = under(
        &model(&both, SOFT, std::slice::from_ref(&support), &fineness),
        &touch,
    );
    let exact = under(&model(&whole, SOFT, &[support], &fineness), &touch);
    assert!((joined / exact - 1.0).abs() < 0.01, "{joined} {exact}");
}

#[test]
fn a_cavity_holds_no_material() {
    // A block with a hollow whose surface faces inward, as in a file of a cast part.
    let outer = block(DVec3::splat(0.04), |p| p);
    let hollow = block(DVec3::splat(0.03), |p| p + DVec3::splat(0.005)).turned_over();
    let mut positions = outer.positions().to_vec();
    positions.extend_from_slice(hollow.positions());
    let mut triangles = outer.triangles().to_vec();
    triangles.extend(hollow.triangles().iter().map(|t| t.map(|v| v + 8)));
    let loaded = TriMesh::new(&positions, &triangles, 0).unwrap();
    assert_eq!(loaded.1.bodies, 1, "a hollow belongs to the body around it");
    let part = Arc::new(loaded.0);
    let support = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.004));
    let immersed = Immersed::new(&part, SOFT, &[support]);
    let cells = immersed
        .cells(&Fineness::of(0.009, 0.005), &unwatched)
        .unwrap();
    let volume = 0.04_f64.powi(3) - 0.03_f64.powi(3);
    assert!(
        (cells.volume() / volume - 1.0).abs() < 0.01,
        "{}",
        cells.volume()
    );
}

#[test]
fn an_open_surface_is_no_solid() {
    let (mesh, _) = LimbSpec::default().build().unwrap();
    let mut project = Project::around("limb.glb", Some(Unit::Metre));
    project.part.model = PartModel::Solid;
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-80.0, -80.0, -1.0], [80.0, 80.0, 6.0]]),
        box_axis: None,
        vertices: None,
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    let inputs = Inputs {
        project,
        part: Arc::new(mesh),
        painted: None,
        masks: Masks::new(),
    };
    let budget = Quality::Draft.budget();
    let error = design::simulate(&inputs, &budget, &unwatched)
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.contains("encloses nothing") && error.contains("shell"),
        "{error}"
    );
    // The advice says the same before anything is computed.
    let advice = design::advise(&inputs, &unwatched).unwrap();
    assert!(!advice.closed && advice.fits == PartModel::Shell);
    // Thickened, it is one, and its faces are found.
    let mut solid = inputs.clone();
    solid.part = Arc::new(inputs.part.thickened(2e-3));
    let advice = design::advise(&solid, &unwatched).unwrap();
    assert!(
        advice.closed && (advice.wall[1] - 2e-3).abs() < 1e-4,
        "{advice:?}"
    );
    // Nothing held, and everything.
    let loose = |z: [f64; 2]| {
        let mut inputs = solid.clone();
        inputs.project.supports[0].box_mm = Some([[-80.0, -80.0, z[0]], [80.0, 80.0, z[1]]]);
        inputs.project.touch.count = 40;
        design::simulate(&inputs, &budget, &unwatched)
            .err()
            .unwrap()
            .to_string()
    };
    assert!(loose([200.0, 300.0]).contains("support"));
    assert!(loose([-1.0, 300.0]).contains("every point of the part is held"));
}

/// A fork 20 × 10 × 10 mm whose prongs are a slit of 0.2 mm apart.
fn fork() -> Arc<TriMesh> {
    let outline = [
        [0.0, 0.0],
        [4.0, 0.0],
        [20.0, 0.0],
        [20.0, 4.9],
        [4.0, 4.9],
        [4.0, 5.1],
        [20.0, 5.1],
        [20.0, 10.0],
        [4.0, 10.0],
        [0.0, 10.0],
    ];
    let level = |z: f64| outline.map(|[x, y]| DVec3::new(x, y, z) * 1e-3);
    let positions = [level(0.0), level(10.0)].concat();
    let caps = [
        [0, 1, 4],
        [0, 4, 5],
        [0, 5, 9],
        [5, 8, 9],
        [1, 2, 3],
        [1, 3, 4],
        [5, 6, 7],
        [5, 7, 8],
    ];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for [a, b, c] in caps {
        triangles.push([a, c, b]);
        triangles.push([a + 10, b + 10, c + 10]);
    }
    for i in 0..10 {
        let j = (i + 1) % 10;
        triangles.extend([[i, j, j + 10], [i, j + 10, i + 10]]);
    }
    Arc::new(TriMesh::new(&positions, &triangles, 0).unwrap().0)
}

#[test]
fn a_slit_narrower_than_a_cell_is_named() {
    let support = clamp(DVec3::splat(-1.0), DVec3::new(2e-3, 1.0, 1.0));
    let ground = SolidGround::new(&fork(), SOFT, &[support], &|_| None, &unwatched).unwrap();
    let said = |size: f64| ground.cautions(&ground.fineness(size)).join(" ");
    assert!(said(2e-3).contains("half a cell"), "{}", said(2e-3));
    assert!(!said(3e-4).contains("half a cell"), "{}", said(3e-4));
}

/// Every stage says how far it is, and stops when it is told to.
#[test]
fn every_stage_can_be_stopped() {
    let part = block(DVec3::new(0.04, 0.04, 0.002), |p| p);
    let support = clamp(DVec3::splat(-1.0), DVec3::new(0.004, 1.0, 1.0));
    let build = |watch: Watch| {
        let supports = std::slice::from_ref(&support);
        let ground = SolidGround::new(&part, SOFT, supports, &|_| None, watch)?;
        ground.model(&ground.fineness(2e-3), watch).map(|_| ())
    };
    let seen = Mutex::new(Vec::new());
    let all = |p: Progress| {
        seen.lock().unwrap().push((p.stage, p.done, p.total));
        ControlFlow::Continue(())
    };
    build(&all).unwrap();
    let seen = seen.into_inner().unwrap();
    for stage in [
        "Measuring walls",
        "Cutting cells",
        "Assembling",
        "Factoring",
    ] {
        let of: Vec<_> = seen.iter().filter(|s| s.0 == stage).collect();
        assert!(of.len() > 1, "{stage}: {of:?}");
        let (_, done, total) = *of[of.len() / 2];
        assert!(done <= total, "{stage}");
        let stop = |p: Progress| {
            if p.stage == stage && p.done >= done {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let error = build(&stop).err();
        assert!(
            matches!(error, Some(ElasticError::Cancelled(_))),
            "{stage}: {error:?}"
        );
    }
}
