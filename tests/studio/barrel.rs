//! The barrel of triangles: a closed solid of the paper's kind, written by this program and bundled with it.

#[cfg(feature = "studio")]
use crate::window;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use glam::DVec3;
use hapdef::cli::examples::Example;
use hapdef::io::mesh_file::parse_glb;
use hapdef::io::project_file;
use hapdef::limb::barrel::BarrelSpec;
use hapdef::mesh::TriMesh;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{PartAxis, PartModel};

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

fn bundled() -> TriMesh {
    parse_glb(Example::Barrel.mesh()).unwrap().mesh
}

/// Six times the volume between a triangle and the origin, positive where it faces away.
fn cone(mesh: &TriMesh, triangle: u32) -> f64 {
    let [a, b, c] = mesh.corners(triangle);
    a.dot(b.cross(c))
}

/// Distance of a point from the middle of the wall of the bundled barrel, outwards (mm).
fn off_the_wall(p: DVec3) -> f64 {
    let spec = BarrelSpec::default();
    let p = p * 1000.0;
    let x = 2.0 * p.y / spec.height - 1.0;
    p.x.hypot(p.z) - spec.radius * (1.0 - (1.0 - spec.ends) * x * x)
}

#[test]
fn its_surface_is_closed_and_goes_one_way_round_every_edge() {
    let mesh = bundled();
    let mut walked: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for t in mesh.triangles() {
        for k in 0..3 {
            *walked.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    for (&(a, b), &times) in &walked {
        assert_eq!(times, 1, "from {a} to {b}");
        assert!(walked.contains_key(&(b, a)), "from {b} to {a}");
    }
    for (v, around) in mesh.vertex_triangles().iter().enumerate() {
        // Every fan goes round its vertex once: as many edges as triangles, in one piece.
        let mut next: BTreeMap<u32, u32> = BTreeMap::new();
        for &t in around {
            let corners = mesh.triangles()[t as usize];
            let k = corners.iter().position(|&c| c as usize == v).unwrap();
            next.insert(corners[(k + 1) % 3], corners[(k + 2) % 3]);
        }
        let start = *next.keys().next().unwrap();
        let mut at = next[&start];
        let mut steps = 1;
        while at != start {
            at = next[&at];
            steps += 1;
        }
        assert_eq!(steps, around.len(), "vertex {v}");
    }
}

#[test]
fn it_faces_outward_and_weighs_what_its_walls_and_rods_do() {
    let mesh = bundled();
    let all = 0..mesh.triangles().len() as u32;
    let cm3 = all.map(|t| cone(&mesh, t)).sum::<f64>() / 6.0 * 1e6;
    // The wall is 1 mm of half the shell's area; four rods of a quarter metre in all their bends, and eight braces.
    assert!((40.0..50.0).contains(&cm3), "{cm3} cm³");
    let worst = (0..mesh.triangles().len() as u32)
        .map(|t| mesh.facet_area(t) * 2.0 / mesh.longest_side(t).powi(2))
        .fold(f64::INFINITY, f64::min);
    assert!(worst > 0.15, "a triangle {worst} as high as it is long");
}

#[test]
fn it_has_its_windows_and_one_handle_for_each_rod_and_brace() {
    let mesh = bundled();
    let spec = BarrelSpec::default();
    assert_eq!(spec.windows(), 64);
    let count = |n: usize| n as i64;
    let euler =
        count(mesh.positions().len()) - count(mesh.edges().len()) + count(mesh.triangles().len());
    let handles = 1 + spec.windows() + spec.frame.rods * (1 + spec.frame.braces);
    assert_eq!(euler, 2 - 2 * count(handles));
    assert!(mesh.triangles().len() < 20_000);
}

#[test]
fn it_stands_about_y_with_a_wall_of_a_millimetre_around_a_frame() {
    let mesh = bundled();
    let (low, high) = mesh.bounds();
    assert!(low.y.abs() < 1e-6 && (high.y - 0.14).abs() < 1e-6);
    assert!((low.x + high.x).abs() < 1e-6 && (low.z + high.z).abs() < 1e-6);
    let place = |p: &DVec3| off_the_wall(*p);
    let near = |off: f64, wanted: f64| (off - wanted).abs() < 0.05;
    let offs: Vec<f64> = mesh.positions().iter().map(place).collect();
    let outer = offs.iter().filter(|&&off| near(off, 0.5)).count();
    let inner = offs.iter().filter(|&&off| near(off, -0.5)).count();
    let frame = offs.iter().filter(|&&off| off < -1.0).count();
    // Four points on either rim lie in the middle of a foot, and are none of the surface.
    assert_eq!(outer, inner + 8);
    assert_eq!(outer + inner + frame, offs.len());
    assert!(frame > 1000, "{frame}");
}

/// The mesh byte for byte; the project but for its gauges, which take a Draft design.
#[test]
fn the_bundled_barrel_is_what_the_command_writes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let made = hapdef(&["limb", "--pattern", "triangles", "--no-sites", "--out", out]);
    let said = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success(), "{said}");
    let remedy = "differs from the bundled one: run `hapdef limb --pattern triangles --out assets`";
    let mesh = std::fs::read(folder.path().join("barrel.glb")).unwrap();
    assert!(mesh == Example::Barrel.mesh(), "barrel.glb {remedy}");
    let text = std::fs::read_to_string(folder.path().join("barrel.hapdef.toml")).unwrap();
    let written = project_file::parse(&text).unwrap();
    let mut bundled = project_file::parse(Example::Barrel.project()).unwrap();
    bundled.selection.sites.clear();
    assert!(written == bundled, "barrel.hapdef.toml {remedy}");
}

#[test]
fn what_a_barrel_cannot_have_is_refused_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    for (option, value, word) in [
        ("--taper", "0.8", "--taper"),
        ("--column-width", "30", "width of the bars"),
        ("--thickness", "20", "the wall"),
    ] {
        let arguments = ["limb", "--pattern", "triangles", "--no-sites", "--out", out];
        let refused = hapdef(&[&arguments[..], &[option, value]].concat());
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(1), "{said}");
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn both_examples_open_and_their_meshes_go_where_they_are_saved() {
    let folder = tempfile::tempdir().unwrap();
    for example in Example::ALL {
        let loaded = example.open().unwrap();
        assert!(loaded.bundled);
        let written =
            hapdef::cli::examples::write_bundled_mesh(folder.path(), &loaded.mesh_path).unwrap();
        assert_eq!(std::fs::read(&written).unwrap(), example.mesh());
        assert_eq!(written.file_name(), loaded.mesh_path.file_name());
        assert_eq!(
            loaded.mesh_path,
            Path::new(&loaded.inputs.project.part.mesh)
        );
    }
    let barrel = Example::Barrel.open().unwrap().inputs;
    assert_eq!(barrel.project.part.model, PartModel::Solid);
    assert_eq!(barrel.project.part.axis, PartAxis::Coordinate(Axis::Y));
    assert_eq!(PartAxis::Auto.stance(&barrel.part).up(), DVec3::Y);
    // One rim is held, and something of the part lies there.
    let [low, high] = barrel.project.supports[0].box_mm.unwrap().map(DVec3::from);
    let held = |p: &&DVec3| (**p * 1000.0).cmpge(low).all() && (**p * 1000.0).cmple(high).all();
    assert!(barrel.part.positions().iter().filter(held).count() > 100);
}

#[cfg(feature = "studio")]
#[test]
fn the_window_opens_the_barrel_as_an_example() {
    use hapdef::studio::UiCommand;

    let mut w = window::Window::open();
    let ctx = w.harness.ctx.clone();
    let barrel = UiCommand::Example(Example::Barrel);
    w.harness.state_mut().execute(&ctx, barrel);
    w.wait("the barrel", 60, |s| {
        s.session.document.mesh_path == Path::new("barrel.glb")
    });
    let document = &w.session().document;
    assert!(document.bundled && document.is_solid());
}
