//! Remeshing: the same surface, the size asked for, well-shaped triangles, and every feature kept.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::Inputs;
use hapdef::io::mesh_file::read_mesh;
use hapdef::mesh::remesh::{as_given, quarter, remesh};
use hapdef::mesh::repair::Repair;
use hapdef::mesh::surface::Surface;
use hapdef::mesh::{Edge, TriMesh};
use hapdef::project::{Masks, Project, SupportKeys, SupportKind, Unit};

/// Angles in degrees: the smallest, and the one that a hundredth of all are below.
fn angles(mesh: &TriMesh) -> [f64; 2] {
    let mut all: Vec<f64> = (0..mesh.triangles().len() as u32)
        .map(|t| {
            let p = mesh.corners(t);
            (0..3)
                .map(|i| (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i]))
                .fold(f64::INFINITY, f64::min)
                .to_degrees()
        })
        .collect();
    all.sort_by(f64::total_cmp);
    [all[0], all[all.len() / 100]]
}

/// Share of the area in triangles with an angle below 10°.
fn thin_share(mesh: &TriMesh) -> f64 {
    let thin = |t: &u32| {
        let p = mesh.corners(*t);
        (0..3).any(|i| (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i]) < 0.1745)
    };
    let all = 0..mesh.triangles().len() as u32;
    all.filter(thin).map(|t| mesh.facet_area(t)).sum::<f64>() / mesh.area()
}

fn limb() -> Arc<TriMesh> {
    hapdef::cli::bundled().unwrap().inputs.part
}

fn plain(part: &Arc<TriMesh>) -> Surface {
    Surface::new(part, |_| false, |_| false)
}

fn length(mesh: &TriMesh, edge: &Edge) -> f64 {
    mesh.positions()[edge.a as usize].distance(mesh.positions()[edge.b as usize])
}

fn rim(mesh: &TriMesh) -> f64 {
    mesh.boundary_edges().map(|e| length(mesh, e)).sum()
}

/// The largest distance of the vertices of one mesh from the surface of the other.
fn away(mesh: &TriMesh, from: &TriMesh) -> f64 {
    let index = from.index();
    let distances = mesh.positions().iter().map(|&p| index.nearest(p).1);
    distances.fold(0.0, f64::max)
}

#[test]
fn the_limb_keeps_its_surface_its_rims_and_its_openings() {
    let part = limb();
    for h in [5e-3, 2e-3] {
        let new = remesh(&plain(&part), &|_: DVec3| h);
        let mesh = &new.mesh;
        assert!((mesh.area() / part.area() - 1.0).abs() < 2e-3);
        assert!((rim(mesh) / rim(&part) - 1.0).abs() < 2e-3);
        // The facets of the part are 0.025 mm off its cylinder.
        assert!(away(mesh, &part) < 3e-5 && away(&part, mesh) < 2e-4);
        let euler = |m: &TriMesh| {
            m.positions().len() as i64 + m.triangles().len() as i64 - m.edges().len() as i64
        };
        assert_eq!(euler(mesh), euler(&part), "openings");
        let [least, hundredth] = angles(mesh);
        assert!(least > 20.0 && hundredth > 28.0, "{least} {hundredth}");
        let long = mesh
            .edges()
            .iter()
            .map(|e| length(mesh, e))
            .fold(0.0, f64::max);
        assert!(long < 1.5 * h && mesh.mean_edge() > 0.75 * h, "{long}");
        let consistent = |e: &&Edge| e.triangles.len() == 2;
        for edge in mesh.edges().iter().filter(consistent) {
            let [s, t] = [edge.triangles[0], edge.triangles[1]];
            assert!(mesh.facet_normal(s).dot(mesh.facet_normal(t)) > 0.7);
        }
    }
}

#[test]
fn the_size_is_followed_from_place_to_place() {
    let part = limb();
    let size = |p: DVec3| if p.z < 0.06 { 1.5e-3 } else { 4e-3 };
    let mesh = remesh(&plain(&part), &size).mesh;
    let mean = |low: f64, high: f64| {
        let near = mesh.edges().iter().filter(|e| {
            let z = mesh.positions()[e.a as usize].z;
            (low..high).contains(&z)
        });
        let (sum, count) = near.fold((0.0, 0), |(s, n), e| (s + length(&mesh, e), n + 1));
        sum / f64::from(count)
    };
    assert!(
        (1.1e-3..1.7e-3).contains(&mean(0.0, 0.05)),
        "{}",
        mean(0.0, 0.05)
    );
    assert!(
        (3e-3..4.4e-3).contains(&mean(0.07, 0.12)),
        "{}",
        mean(0.07, 0.12)
    );
}

#[test]
fn halving_finds_the_curved_surface_and_not_the_chords() {
    // A coarse tube: 16 facets round, whose chords are 1.9 % inside the circle.
    let (n, m) = (16u32, 5u32);
    let p: Vec<DVec3> = (0..=m)
        .flat_map(|j| {
            (0..n).map(move |i| {
                let a = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
                DVec3::new(a.cos(), a.sin(), f64::from(j) * 0.4)
            })
        })
        .collect();
    let at = |i: u32, j: u32| j * n + i % n;
    let t: Vec<[u32; 3]> = (0..m)
        .flat_map(|j| {
            (0..n).flat_map(move |i| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
        })
        .collect();
    let part = Arc::new(TriMesh::new(&p, &t, 0).unwrap().0);
    let surface = plain(&part);
    let fine = quarter(&surface, &as_given(&surface));
    assert_eq!(fine.mesh.triangles().len(), 4 * t.len());
    let inner = |q: &&DVec3| q.z > 0.1 && q.z < 1.9;
    let worst = fine
        .mesh
        .positions()
        .iter()
        .filter(inner)
        .map(|q| (q.truncate().length() - 1.0).abs())
        .fold(0.0, f64::max);
    assert!(worst < 5e-3, "{worst}");
}

#[test]
fn halving_gives_back_the_corners_of_openings() {
    // Windows with corners of 3 mm, and elements of twice that: what they cut off is material too much.
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/slotted/shell.obj");
    let loaded = read_mesh(&file, Some(Unit::Millimetre), 0, Repair::default()).unwrap();
    let part = Arc::new(loaded.mesh);
    let surface = plain(&part);
    let coarse = remesh(&surface, &|_: DVec3| 6.5e-3);
    let fine = quarter(&surface, &coarse);
    let excess = [&coarse, &fine].map(|remeshed| remeshed.mesh.area() - part.area());
    println!(
        "area too much: {:.0} and {:.0} mm²",
        excess[0] * 1e6,
        excess[1] * 1e6
    );
    // Without it nothing comes back at all.
    assert!(excess[1] < 0.6 * excess[0], "{excess:?}");
}

#[test]
fn creases_and_lines_that_are_marked_stay() {
    // An L of two plates, and a line across one of them.
    let p: Vec<DVec3> = (0..=4)
        .flat_map(|i| {
            let x = f64::from(i);
            [
                DVec3::new(x, 0.0, 3.0),
                DVec3::new(x, 0.0, 0.0),
                DVec3::new(x, 3.0, 0.0),
            ]
        })
        .collect();
    let t: Vec<[u32; 3]> = (0..4)
        .flat_map(|i| {
            let [a, b, c] = [3 * i, 3 * i + 1, 3 * i + 2];
            [
                [a, b, a + 3],
                [a + 3, b, b + 3],
                [b, c, b + 3],
                [b + 3, c, c + 3],
            ]
        })
        .collect();
    let part = Arc::new(TriMesh::new(&p, &t, 0).unwrap().0);
    let across = |e: &Edge| {
        let at = |v: u32| part.positions()[v as usize];
        at(e.a).x == 2.0 && at(e.b).x == 2.0
    };
    let surface = Surface::new(&part, across, |_| false);
    let new = remesh(&surface, &|_: DVec3| 0.7);
    let on = |test: &dyn Fn(DVec3) -> bool| -> f64 {
        let mesh = &new.mesh;
        let lines = new.lines.iter();
        lines
            .map(|&(a, b)| [a, b].map(|v| mesh.positions()[v as usize]))
            .filter(|e| e.iter().all(|&p| test(p)))
            .map(|[a, b]| a.distance(b))
            .sum()
    };
    assert!(
        (on(&|p| p.y == 0.0 && p.z == 0.0) - 4.0).abs() < 1e-9,
        "crease"
    );
    assert!(
        (on(&|p| (p.x - 2.0).abs() < 1e-12) - 6.0).abs() < 1e-9,
        "marked"
    );
    assert!((new.mesh.area() - 24.0).abs() < 1e-9);
}

/// Parts as CAD programs leave them. They are not part of this repository.
#[test]
fn real_limbs_are_remeshed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes");
    let names = [
        "poppy_humanoid_2015_l_shin_hires.STL",
        "poppy_humanoid_l_shin_visual.STL",
        "poppy_humanoid_l_thigh_visual.STL",
    ];
    for name in names {
        let path = folder.join(name);
        if crate::is_missing(&path) {
            continue;
        }
        let loaded = read_mesh(&path, Some(Unit::Metre), 0, Repair::default()).unwrap();
        assert_eq!(loaded.repairs.bodies, 9);
        let part = Arc::new(loaded.mesh);
        let new = remesh(&plain(&part), &|_: DVec3| 4e-3);
        let [before, after] = [thin_share(&part), thin_share(&new.mesh)];
        println!(
            "{name}: {} slivers of {}; now {} triangles; below 10° were {:.1} % of the area and are {:.2} %; {:.2} mm away",
            loaded.repairs.slivers,
            part.triangles().len(),
            new.mesh.triangles().len(),
            100.0 * before,
            100.0 * after,
            away(&new.mesh, &part) * 1e3
        );
        assert!(after < 0.02 && before > 10.0 * after, "{before} {after}");
        assert!(away(&new.mesh, &part) < 0.6e-3);
        assert!((new.mesh.area() / part.area() - 1.0).abs() < 0.06);
        computed(part);
    }
}

/// The elastic model on the upper part of a limb as it comes, held below.
fn computed(part: Arc<TriMesh>) {
    let (lower, upper) = part.bounds();
    let mut project = Project::around("limb.stl", Some(Unit::Metre));
    project.part.thickness_mm = 2.8;
    project.touch.count = 60;
    project.sites.spacing_mm = 8.0;
    let (low, mut high) = (lower * 1000.0 - 1.0, upper * 1000.0 + 1.0);
    high.y = low.y + 0.3 * (high.y - low.y);
    project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([low.to_array(), high.to_array()]),
        box_axis: None,
        vertices: None,
        normal: hapdef::mesh::unroll::Axis::Z,
        bedding_n_per_mm3: None,
    });
    let inputs = Inputs {
        project,
        part,
        painted: None,
        masks: Masks::new(),
    };
    let budget = Quality::Draft.budget();
    let simulated = hapdef::design::simulate(&inputs, &budget, &unwatched).unwrap();
    let estimate = simulated.discretization;
    println!(
        "  computed on {} vertices: {estimate:.2?}",
        simulated.mesh.positions().len()
    );
    assert!(simulated.checks.reaction_error < 1e-6 && simulated.checks.energy_error < 1e-6);
    assert!(simulated.dataset.x.values().iter().all(|x| x.is_finite()));
    assert!(estimate.strain_percent < 20.0);
    // A closed limb with thick walls is no thin shell everywhere, and that is said.
    assert!((simulated.achieved.words()).any(|n| n.contains("thin-shell")));
}
