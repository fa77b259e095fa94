//! What the workshop and the robot are given, read by somebody else's readers: PDF, glTF, XML and a C compiler.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use hapdef::io::mesh_file::read_mesh;
use hapdef::mesh::repair::Repair;
use hapdef::project::Unit;

fn hapdef(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.success(), said)
}

/// Sizes of a document's pages (mm), and how many bytes draw each.
fn pages(path: &Path) -> Vec<[f64; 3]> {
    let document = lopdf::Document::load(path).unwrap();
    (document.get_pages().values())
        .map(|&page| {
            let dictionary = document.get_dictionary(page).unwrap();
            let media = dictionary.get(b"MediaBox").unwrap().as_array().unwrap();
            let ends: Vec<f64> = media
                .iter()
                .map(|v| f64::from(v.as_float().unwrap()))
                .collect();
            let mm = |points: f64| points * 25.4 / 72.0;
            let drawn = document.get_page_content(page).len();
            [mm(ends[2] - ends[0]), mm(ends[3] - ends[1]), drawn as f64]
        })
        .collect()
}

/// Origins of the frames of a fragment (m).
fn frames(path: &Path) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(path).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    (document.descendants())
        .filter(|n| n.has_tag_name("origin"))
        .map(|n| {
            let numbers: Vec<f64> = n
                .attribute("xyz")
                .unwrap()
                .split(' ')
                .map(|w| w.parse().unwrap())
                .collect();
            numbers.try_into().unwrap()
        })
        .collect()
}

/// Names of a scene's nodes with a mesh, and the corners that they have in all.
fn scene(path: &Path) -> (Vec<String>, usize) {
    let (document, buffers, _) = gltf::import(path).unwrap();
    let mut corners = 0;
    let names = document.nodes().filter_map(|node| {
        let mesh = node.mesh()?;
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|b| Some(&buffers[b.index()]));
            let count = reader.read_positions().unwrap().count();
            assert_eq!(reader.read_colors(0).unwrap().into_rgb_f32().count(), count);
            assert!(
                reader
                    .read_indices()
                    .unwrap()
                    .into_u32()
                    .all(|i| (i as usize) < count)
            );
            corners += count;
        }
        Some(node.name().unwrap_or_default().to_owned())
    });
    (names.collect(), corners)
}

/// The middles of the chosen gauges as the table of sites has them (mm).
fn sites(folder: &Path) -> Vec<[f64; 3]> {
    let mut reader = csv::Reader::from_path(folder.join("sites.csv")).unwrap();
    (reader.records().flatten())
        .map(|row| [0, 1, 2].map(|k| row[k].parse().unwrap()))
        .collect()
}

/// Checks all that a design left in a folder; `half` is what the inner face lies behind the sites (mm).
fn check(folder: &Path, gauges: usize, half: f64, size: [f64; 2]) {
    for document in ["report.pdf", "template.pdf"] {
        let pages = pages(&folder.join(document));
        assert!(pages.len() >= 2, "{document}: {pages:?}");
        for [width, height, drawn] in &pages {
            let ends = [width.min(*height), width.max(*height)];
            assert!(
                (ends[0] - size[0]).abs() < 0.1 && (ends[1] - size[1]).abs() < 0.1,
                "{document}: {ends:?}"
            );
            assert!(*drawn > 500.0, "{document}: an empty page");
        }
    }
    let places = sites(folder);
    assert_eq!(places.len(), gauges);
    let frames = frames(&folder.join("gauges.urdf"));
    for (site, frame) in places.iter().zip(&frames) {
        let off: f64 = (0..3)
            .map(|k| (site[k] - frame[k] * 1e3).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!((off - half).abs() < 0.01, "{off}");
    }
    assert_eq!(frames.len(), gauges);
    let (names, corners) = scene(&folder.join("scene.glb"));
    assert_eq!(names.len(), gauges + 1);
    assert!(names[0] == "limb" && names[gauges] == format!("gauge {gauges}"));
    assert!(corners > 500);
    let rows = |name: &str| {
        csv::Reader::from_path(folder.join(name))
            .unwrap()
            .records()
            .count()
    };
    assert_eq!(rows("wiring.csv"), gauges);
    assert!(rows("bill.csv") > 5 && rows("zones.csv") > 300);
    header(folder, gauges);
    jig(&folder.join("jig"), gauges);
}

/// Every piece that the table names is there, closed, and of a size that can be printed; every gauge is on it.
fn jig(folder: &Path, gauges: usize) {
    let mut table = csv::Reader::from_path(folder.join("jig.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let (by_hand, pieces): (Vec<_>, Vec<_>) =
        rows.iter().partition(|r| r[1].starts_with("by hand"));
    let of = |kind: &str| pieces.iter().filter(|r| r[1].starts_with(kind)).count();
    assert_eq!(of("ring-") + by_hand.len(), gauges);
    assert_eq!(of("ring-"), of("pad-"));
    // A rod that is longer than what can be printed comes in pieces, and stands in one seat.
    let rods = pieces.iter().filter(|r| r[1].starts_with("rod-"));
    let rods: BTreeSet<&str> = rods.filter_map(|r| r[1].split(['-', '.']).nth(1)).collect();
    assert_eq!(rods.len(), of("seat-"));
    for row in &pieces {
        let loaded = read_mesh(
            &folder.join(&row[1]),
            Some(Unit::Millimetre),
            0,
            Repair::default(),
        )
        .unwrap();
        let (low, high) = loaded.mesh.bounds();
        let size = (high - low) * 1e3;
        assert!(
            size.max_element() < 205.0 && size.min_element() > 1.5,
            "{}: {size}",
            &row[1]
        );
        assert!(low.z.abs() < 1e-9, "{} lies on the bed", &row[1]);
        let report = &loaded.repairs;
        let whole = (
            report.boundary_edges,
            report.non_manifold_edges,
            report.bodies,
        );
        assert_eq!(whole, (0, 0, 1), "{}", &row[1]);
        assert!(loaded.mesh.volume_enclosed() > 0.0, "{}", &row[1]);
    }
    let files = std::fs::read_dir(folder).unwrap().count();
    assert_eq!(files, pieces.len() + 1, "and nothing of an older jig");
}

/// A compiler reads the sketch's settings.
fn header(folder: &Path, gauges: usize) {
    let program = format!(
        "enum {{ A0 = 14, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12 }};\n#include \"hapd_config.h\"\n#include <stdio.h>\nint main(void) {{ static const unsigned char pins[] = HAPD_PINS; unsigned long b = HAPD_BOARD; const char n[] = HAPD_NAME; return !(sizeof pins == {gauges} && pins[1] == 15 && b > 0 && sizeof n > 2 && HAPD_SUPPLY_MV == 5000 && HAPD_GAIN_MILLI == 330000 && HAPD_REFERENCE_MV == 3300); }}\n"
    );
    std::fs::write(folder.join("try.c"), program).unwrap();
    let built = Command::new("cc")
        .args(["-Wall", "-Wextra", "-Werror", "try.c", "-o", "try"])
        .current_dir(folder)
        .output()
        .expect("a C compiler, which links Rust too: apt install gcc libc6-dev");
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    assert!(Command::new(folder.join("try")).status().unwrap().success());
}

#[test]
fn the_workshop_is_given_all_of_the_bundled_limb() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A piece of an older jig would be printed with the new ones.
    std::fs::create_dir_all(here.join("d/jig")).unwrap();
    std::fs::write(here.join("d/jig/ring-77.stl"), "").unwrap();
    let (made, said) = hapdef(here, &["design", "--quality", "draft", "--out", "d"]);
    assert!(made, "{said}");
    check(&here.join("d"), 10, 0.75, [210.0, 297.0]);
    let export = [
        "export",
        "d/design.hapdef.toml",
        "--gltf",
        "e.glb",
        "--urdf",
        "e.urdf",
        "--link",
        "shin",
        "--touch",
        "22.5,22.5,60",
    ];
    let (made, said) = hapdef(here, &export);
    assert!(made, "{said}");
    let (names, _) = scene(&here.join("e.glb"));
    assert_eq!((names.len(), names[11].as_str()), (12, "touch"));
    let own = frames(&here.join("d/gauges.urdf"));
    for (a, b) in own.iter().zip(frames(&here.join("e.urdf"))) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?} {b:?}");
    }
    // The same on other paper, and without any.
    let other = [
        "design",
        "--quality",
        "draft",
        "--out",
        "d",
        "--no-workshop",
    ];
    assert!(hapdef(here, &other).0);
    let (refused, said) = hapdef(here, &["export", "--link", "a"]);
    assert!(!refused && said.contains("say what to write"), "{said}");
    let far = [
        "export",
        "--gltf",
        "f.glb",
        "--touch",
        "500,0,0",
        "--quality",
        "draft",
    ];
    let (refused, said) = hapdef(here, &far);
    assert!(!refused && said.contains("off the limb"), "{said}");
}

#[test]
fn a_link_of_a_robot_is_designed_on_in_its_own_frame() {
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/meshes/poppy_humanoid_l_shin_visual.STL");
    if crate::is_missing(&mesh) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir_all(here.join("urdf/robots")).unwrap();
    std::fs::create_dir_all(here.join("urdf/meshes")).unwrap();
    std::fs::copy(mesh, here.join("urdf/meshes/l_shin.STL")).unwrap();
    // As in the robot's own description.
    let robot = "<robot name=\"Poppy_Humanoid\"><link name=\"l_thigh\"/><link name=\"l_shin\"><visual><origin xyz=\"0 0 0\" rpy=\"0 0 0\"/><geometry><mesh filename=\"package://meshes/l_shin.STL\"/></geometry></visual></link></robot>";
    std::fs::write(here.join("urdf/robots/Poppy.URDF"), robot).unwrap();
    let project = "format = 1\n[part]\nmesh = \"urdf/robots/Poppy.URDF#l_shin\"\nmodel = \"solid\"\n[[support]]\nkind = \"clamped\"\nbox_mm = [[-40.0, -180.0, -50.0], [30.0, -150.0, 5.0]]\n[selection]\nsensors = 6\n[touch]\ncount = 150\n";
    std::fs::write(here.join("shin.hapdef.toml"), project).unwrap();
    let design = [
        "design",
        "shin.hapdef.toml",
        "--quality",
        "draft",
        "--sheet",
        "letter",
        "--out",
        "d",
    ];
    let (made, said) = hapdef(here, &design);
    assert!(made, "{said}");
    check(&here.join("d"), 6, 0.0, [215.9, 279.4]);
    let text = std::fs::read_to_string(here.join("d/gauges.urdf")).unwrap();
    assert!(text.contains("<parent link=\"l_shin\"/>"), "{text}");
    // What was designed opens again.
    let again = ["export", "d/design.hapdef.toml", "--urdf", "again.urdf"];
    let (made, said) = hapdef(here, &again);
    assert!(made, "{said}");
    assert_eq!(frames(&here.join("again.urdf")).len(), 6);
}

const ROBOT: &str = r#"<?xml version="1.0"?><robot name="r">
    <link name="base"/>
    <link name="thigh"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
    <link name="shin"><visual><origin xyz="0 0 0.1" rpy="0 0 1.5707963267948966"/>
      <geometry><mesh filename="package://r_description/meshes/shin.stl" scale="0.001 0.001 -0.001"/></geometry></visual></link>
    <link name="foot"><collision><geometry><mesh filename="foot.dae"/></geometry></collision></link></robot>"#;

fn tetrahedron() -> String {
    let corners = [[0, 0, 0], [30, 0, 0], [0, 20, 0], [0, 0, 10]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let mut text = String::from("solid t\n");
    for face in faces {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        for k in face {
            let [x, y, z]: [i32; 3] = corners[k];
            let _ = writeln!(text, "vertex {x} {y} {z}");
        }
        text.push_str("endloop\nendfacet\n");
    }
    text + "endsolid t\n"
}

#[test]
fn a_link_is_read_in_its_own_frame() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(at("r_description/meshes")).unwrap();
    std::fs::create_dir_all(at("r_description/urdf")).unwrap();
    std::fs::write(at("r_description/meshes/shin.stl"), tetrahedron()).unwrap();
    let urdf = at("r_description/urdf/r.urdf");
    std::fs::write(&urdf, ROBOT).unwrap();
    let named = |link: &str| PathBuf::from(format!("{}#{link}", urdf.display()));
    let read = |path: &Path| read_mesh(path, None, 0, Repair::default());
    let loaded = read(&named("shin")).unwrap();
    let (low, high) = loaded.mesh.bounds();
    // Mirrored in z, turned by a right angle, and lifted.
    assert!(
        (low - DVec3::new(-0.02, 0.0, 0.09)).length() < 1e-9,
        "{low}"
    );
    assert!(
        (high - DVec3::new(0.0, 0.03, 0.1)).length() < 1e-9,
        "{high}"
    );
    assert!(loaded.mesh.volume_enclosed() > 0.0);
    let refused = |path: &Path| read(path).err().unwrap().to_string();
    assert!(
        refused(&urdf).contains("robot.urdf#LINK, of shin, foot"),
        "{}",
        refused(&urdf)
    );
    assert!(refused(&named("arm")).contains("no link “arm”"));
    assert!(refused(&named("foot")).contains("foot.dae is not there"));
    std::fs::write(at("r_description/urdf/foot.dae"), "<COLLADA/>").unwrap();
    assert!(
        refused(&named("foot")).contains("convert it"),
        "{}",
        refused(&named("foot"))
    );
    std::fs::write(&urdf, ROBOT.replace("0 0 0.1", "0 0")).unwrap();
    assert!(refused(&named("shin")).contains("three numbers"));
    std::fs::write(&urdf, "<sdf/>").unwrap();
    assert!(refused(&named("shin")).contains("begins with <robot>"));
}

/// Touches as a robot's recording, read by the format's own library.
#[cfg(feature = "mcap")]
#[test]
fn touches_are_messages_in_an_mcap_file() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let script = "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n3,1.5,22.5,22.5,60,15\n";
    std::fs::write(here.join("s.csv"), script).unwrap();
    let board = [
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--script",
        "s.csv",
        "--record",
        "r.hapdrec",
        "--rate",
        "200",
    ];
    let (made, said) = hapdef(here, &board);
    assert!(made, "{said}");
    let listen = [
        "listen",
        "r.hapdrec",
        "--fast",
        "--quality",
        "draft",
        "--mcap",
        "t.mcap",
    ];
    let (made, said) = hapdef(here, &listen);
    assert!(made, "{said}");
    let bytes = std::fs::read(here.join("t.mcap")).unwrap();
    let (mut samples, mut hardest, mut near) = (0, 0.0_f64, 0);
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let value: serde_json::Value = serde_json::from_slice(&message.data).unwrap();
        match message.channel.topic.as_str() {
            "/touch/contacts" => samples += 1,
            "/touch/wrench" => {
                // In the contact's frame a touch pushes against z.
                hardest = hardest.min(value["wrench"]["force"]["z"].as_f64().unwrap());
            }
            "/tf" => {
                assert_eq!(value["parent_frame_id"], "limb");
                let at = ["x", "y", "z"].map(|k| value["translation"][k].as_f64().unwrap());
                let off = DVec3::from_array(at).distance(DVec3::new(0.0225, 0.0225, 0.06));
                near += u32::from(off < 5e-3);
            }
            other => panic!("{other}"),
        }
    }
    assert!(samples > 800 && near > 200, "{samples}, {near}");
    // As it comes and goes it is less, and no sample of these shows more.
    assert!((hardest + 15.0).abs() < 3.0, "{hardest}");
    let (again, said) = hapdef(here, &listen);
    assert!(!again && said.contains("not written over"), "{said}");
}
