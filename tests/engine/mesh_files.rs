//! Mesh files as others write them: every format reads the same part the same way, nothing of a file is dropped
//! without a word, and what is wrong is named with its place.

use std::fmt::Write as _;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use hapdef::design::{Inputs, open_solid};
use hapdef::io::mesh_file::{LoadedMesh, parse_mesh, read_mesh};
use hapdef::mesh::TriMesh;
use hapdef::mesh::repair::Repair;
use hapdef::project::{Masks, PartModel, Project, Unit};
use serde_json::{Value, json};

fn parsed(ending: &str, bytes: &[u8]) -> Result<LoadedMesh, String> {
    parse_mesh(bytes, ending, None, 1.0, 0, &Repair::default())
}

fn read(ending: &str, bytes: impl AsRef<[u8]>) -> LoadedMesh {
    parsed(ending, bytes.as_ref()).unwrap_or_else(|said| panic!("{ending}: {said}"))
}

/// What is said of a file that is refused: one screen, no dump.
fn refused(ending: &str, bytes: impl AsRef<[u8]>) -> String {
    let said = parsed(ending, bytes.as_ref())
        .err()
        .expect("the file is refused");
    let dump = ["\n\t", "Error:", "String:", "ParseError", "Some("];
    assert!(dump.iter().all(|d| !said.contains(d)), "{said}");
    assert!(said.len() < 1000, "{said}");
    said
}

/// A block of 4 by 3 by 2 with its eight corners, and its faces turned outward.
const BLOCK: [[usize; 4]; 6] = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
];

fn block() -> Vec<DVec3> {
    let end = |k: usize, bit: usize, length: f64| if k >> bit & 1 == 1 { length } else { 0.0 };
    (0..8)
        .map(|k| DVec3::new(end(k, 0, 4.0), end(k, 1, 3.0), end(k, 2, 2.0)))
        .collect()
}

fn block_triangles() -> Vec<[usize; 3]> {
    BLOCK
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect()
}

fn obj(p: &[DVec3], t: &[[usize; 3]]) -> String {
    let mut text = String::new();
    for p in p {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    text += "g block\n";
    for [a, b, c] in t {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    text
}

fn ascii_stl(name: &str, p: &[DVec3], t: &[[usize; 3]]) -> String {
    let mut text = format!("solid {name}\n");
    for corners in t {
        text += "facet normal 0 0 0\n outer loop\n";
        for p in corners.map(|v| p[v]) {
            writeln!(text, "  vertex {:e} {:e} {:e}", p.x, p.y, p.z).unwrap();
        }
        text += " endloop\nendfacet\n";
    }
    text + &format!("endsolid {name}\n")
}

fn binary_stl(p: &[DVec3], t: &[[usize; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((t.len() as u32).to_le_bytes());
    for corners in t {
        bytes.extend([0; 12]);
        let numbers = corners.map(|v| p[v].to_array()).into_iter().flatten();
        bytes.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply_header(form: &str, vertices: usize, faces: usize) -> String {
    format!(
        "ply\nformat {form} 1.0\ncomment a block\nelement vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn ascii_ply(p: &[DVec3], t: &[[usize; 3]]) -> String {
    let mut text = ply_header("ascii", p.len(), t.len());
    for p in p {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in t {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    text
}

fn binary_ply(big: bool, p: &[DVec3], t: &[[usize; 3]]) -> Vec<u8> {
    let form = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut bytes = ply_header(form, p.len(), t.len()).into_bytes();
    for x in p.iter().flat_map(DVec3::to_array) {
        bytes.extend(if big {
            x.to_be_bytes()
        } else {
            x.to_le_bytes()
        });
    }
    for corners in t {
        bytes.push(3);
        for v in corners.map(|v| v as i32) {
            bytes.extend(if big {
                v.to_be_bytes()
            } else {
                v.to_le_bytes()
            });
        }
    }
    bytes
}

/// A glTF file of one node, with its data in `data.bin` unless `uri` says otherwise.
fn gltf(p: &[DVec3], indices: &[u16], mode: u32) -> (Value, Vec<u8>) {
    let mut data: Vec<u8> = (p.iter().flat_map(DVec3::to_array))
        .flat_map(|x| (x as f32).to_le_bytes())
        .collect();
    let split = data.len();
    data.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    let file = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "block", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}],
        "buffers": [{"byteLength": data.len(), "uri": "data.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": split},
            {"buffer": 0, "byteOffset": split, "byteLength": data.len() - split}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": p.len(), "type": "VEC3",
             "min": [0.0, 0.0, 0.0], "max": [4.0, 3.0, 2.0]},
            {"bufferView": 1, "componentType": 5123, "count": indices.len(), "type": "SCALAR"}
        ]
    });
    (file, data)
}

/// Reads a glTF file that lies in a folder with its data.
fn beside(file: &Value, data: &[u8]) -> Result<LoadedMesh, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), data).unwrap();
    let text = file.to_string();
    let folder = Some(folder.path());
    parse_mesh(text.as_bytes(), "gltf", folder, 1.0, 0, &Repair::default())
}

fn glb(file: &Value, data: &[u8]) -> Vec<u8> {
    let mut file = file.clone();
    file["buffers"][0].as_object_mut().unwrap().remove("uri");
    let mut text = file.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut data = data.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let length = 12 + 8 + text.len() + 8 + data.len();
    for word in [2, length as u32, text.len() as u32] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

fn volume(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles().len() as u32)
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[test]
fn the_same_part_written_in_all_formats_reads_the_same() {
    let (p, t) = (block(), block_triangles());
    let indices: Vec<u16> = t.iter().flatten().map(|&v| v as u16).collect();
    let (file, data) = gltf(&p, &indices, 4);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), &data).unwrap();
    // The file, its bytes, and whether its vertices are numbered and named.
    let files: [(&str, Vec<u8>, bool, bool); 8] = [
        ("a.obj", obj(&p, &t).into(), true, true),
        ("b.stl", ascii_stl("block", &p, &t).into(), false, true),
        ("c.stl", binary_stl(&p, &t), false, false),
        ("d.ply", ascii_ply(&p, &t).into(), true, false),
        ("e.ply", binary_ply(false, &p, &t), true, false),
        ("f.ply", binary_ply(true, &p, &t), true, false),
        ("g.gltf", file.to_string().into(), true, true),
        ("h.glb", glb(&file, &data), true, true),
    ];
    for (name, bytes, numbered, named) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let units: Vec<Option<Unit>> = if name.contains(".gl") {
            vec![None]
        } else {
            Unit::ALL.map(Some).to_vec()
        };
        for unit in units {
            let loaded = read_mesh(&path, unit, 0, Repair::default()).unwrap();
            let metres = unit.map_or(1.0, Unit::metres);
            let mesh = &loaded.mesh;
            let about = |value: f64, wanted: f64| (value / wanted - 1.0).abs() < 1e-12;
            assert!(about(mesh.area(), 52.0 * metres.powi(2)), "{name}");
            assert!(about(volume(mesh), 24.0 * metres.powi(3)), "{name}");
            assert_eq!(
                (loaded.repairs.bodies, mesh.boundary_edges().count()),
                (1, 0)
            );
            assert_eq!(loaded.repairs.in_words(0), None, "{name}");
            assert_eq!(mesh.positions().len(), 8, "{name}");
            if numbered {
                let far = |(a, b): (&DVec3, &DVec3)| a.distance(*b * metres) > 1e-12 * metres;
                assert!(!mesh.positions().iter().zip(&p).any(far), "{name}");
            }
            let group = loaded.groups.get("block");
            assert_eq!(group.is_some(), named, "{name}");
            assert!(group.is_none_or(|mask| mask.iter().all(|&m| m)), "{name}");
        }
    }
}

#[test]
fn vertices_of_an_obj_stay_in_the_order_of_the_file() {
    // The faces use the vertices backward.
    let mut t = block_triangles();
    t.reverse();
    let p = block();
    let mesh = read("obj", obj(&p, &t)).mesh;
    assert_eq!(mesh.positions(), &p[..]);
    // Forward references and those from the end.
    let text = "f 3 1 2\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf -1 -2 -3\n";
    let mesh = read("obj", text).mesh;
    assert_eq!(mesh.positions()[3], DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh.triangles().len(), 2);
}

#[test]
fn coordinates_keep_what_the_file_says_of_them() {
    let far = DVec3::splat(1e6);
    let p: Vec<DVec3> = block().iter().map(|p| *p * 0.001 + far).collect();
    let t = block_triangles();
    for (ending, text) in [
        ("obj", obj(&p, &t)),
        ("stl", ascii_stl("far", &p, &t)),
        ("ply", ascii_ply(&p, &t)),
    ] {
        let mesh = read(ending, text).mesh;
        let missed = |q: &DVec3| !p.contains(q);
        assert!(!mesh.positions().iter().any(missed), "{ending}");
        assert_eq!(mesh.positions().len(), 8, "{ending}");
    }
}

#[test]
fn an_obj_that_is_cut_off_is_refused_with_its_line() {
    let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 3\n";
    for (end, line) in [
        ("f 1 2", "line 6"),
        ("f 1", "line 6"),
        ("f", "line 6"),
        ("v 1 2", "line 6"),
        ("f 1 2 0\n", "line 6"),
        ("f 1 2 -9\n", "line 6"),
        ("f 1 2 1.7\n", "line 6"),
        ("f 1 2 9\nf 1 2 3\n", "line 6"),
        ("v 1 2 x\n", "line 6"),
        ("v inf 2 2\n", "line 6"),
    ] {
        let said = refused("obj", format!("{start}{end}"));
        assert!(said.contains(line), "{end}: {said}");
    }
    // A number may be cut as well, and only the missing end of the line says so.
    let notes = read("obj", start.trim_end()).repairs.notes;
    assert!(
        notes.len() == 1 && notes[0].contains("cut off"),
        "{notes:?}"
    );
}

#[test]
fn what_an_obj_has_beside_faces_is_said() {
    let text = "# C:\\part\\\nmtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 \\\n 3//1\nl 1 2\np 1\nsurf 0 1 0 1\nff 1 2 3\n";
    let repairs = read("obj", text).repairs;
    let said = repairs.in_words(0).unwrap();
    for part in ["2 lines and points", "curve", "line 12", "“ff”"] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

#[test]
fn a_seam_without_area_is_not_filled_with_triangles_of_none() {
    // A square whose upper side has a vertex in the middle that the triangle above it knows nothing of.
    let obj = b"v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 0 1 0\nv 1 2 0\nv 1 1 3\n\
        f 1 2 4\nf 2 3 4\nf 1 4 5\nf 5 3 6\nf 1 7 2\nf 2 7 3\nf 3 7 6\nf 6 7 5\nf 5 7 1\n";
    let repair = Repair {
        fill_holes: 1.0,
        ..Repair::default()
    };
    let loaded = parse_mesh(obj, "obj", None, 1e-3, 0, &repair).unwrap();
    let mesh = &loaded.mesh;
    for t in 0..mesh.triangles().len() as u32 {
        assert!(mesh.facet_area(t) > 0.0, "{:?}", mesh.corners(t));
    }
    assert_eq!(mesh.boundary_edges().count(), 3, "the seam stays open");
}

#[test]
fn all_solids_of_an_stl_are_read() {
    let (p, t) = (block(), block_triangles());
    let moved: Vec<DVec3> = p.iter().map(|p| *p + 9.0 * DVec3::X).collect();
    let text = ascii_stl("left", &p, &t) + "\n" + &ascii_stl("right side", &moved, &t);
    let loaded = read("stl", &text);
    assert_eq!(loaded.repairs.bodies, 2);
    let second = parse_mesh(text.as_bytes(), "stl", None, 1.0, 1, &Repair::default())
        .unwrap_or_else(|said| panic!("{said}"));
    let named: Vec<&str> = (loaded.groups.keys().chain(second.groups.keys()))
        .map(String::as_str)
        .collect();
    assert_eq!(named, ["left", "right side"]);
}

#[test]
fn what_is_wrong_with_an_stl_is_named_with_its_line() {
    let text = ascii_stl("block", &block(), &block_triangles());
    let changed = |from: &str, to: &str| refused("stl", text.replacen(from, to, 1));
    let said = changed("vertex 0e0 0e0 0e0", "vertex 0e0 0e0");
    assert!(said.contains("line 4") && said.contains("three"), "{said}");
    let said = changed("vertex 0e0 0e0 0e0", "vertex 0e0 0e0 O");
    assert!(said.contains("line 4") && said.contains("“O”"), "{said}");
    let said = changed(" endloop\n", "");
    assert!(
        said.contains("line 7") && said.contains("endfacet"),
        "{said}"
    );
    let said = changed("endsolid block\n", "");
    assert!(
        said.contains("endsolid") && said.contains("line 85"),
        "{said}"
    );
    let said = refused("stl", text.clone() + "facet normal 0 0 0\n");
    assert!(said.contains("line 87"), "{said}");

    let mut bytes = binary_stl(&block(), &block_triangles());
    bytes[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let said = refused("stl", &bytes);
    assert!(said.contains("triangle 2"), "{said}");
    bytes.pop();
    let said = refused("stl", &bytes);
    assert!(
        said.contains("12 triangles") && said.contains("683 bytes"),
        "{said}"
    );
}

#[test]
fn a_ply_holds_what_its_header_announces() {
    let (p, t) = (block(), block_triangles());
    let text = ascii_ply(&p, &t);
    let changed = |from: &str, to: &str| refused("ply", text.replacen(from, to, 1));
    for (said, part) in [
        (changed("face 12", "face 11"), "line 30"),
        (changed("vertex 8", "vertex 7"), "line"),
        (changed("face 12", "face 13"), "truncated"),
        (changed("4 3 2\n", "4 3 2 7\n"), "line 18"),
        (changed("4 3 2\n", "4 3\n"), "line 18"),
        (changed("4 3 2\n", "4 3 x\n"), "line 18"),
        (changed("3 0 2 3", "3 0 2 1.7"), "1.7"),
        (changed("3 0 2 3", "3 0 2 8"), "line 19"),
        (changed("3 0 2 3", "3 0 2 -1"), "line 19"),
        (changed("property double x", "property quad x"), "line 5"),
        (changed("element face", "element vertex"), "twice"),
        (changed("end_header", "end"), "line 10"),
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    for big in [false, true] {
        let mut bytes = binary_ply(big, &p, &t);
        let said = refused("ply", &bytes[..bytes.len() - 1]);
        assert!(said.contains("face 11"), "{said}");
        bytes.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        let said = refused("ply", &bytes);
        assert!(said.contains("13 bytes"), "{said}");
    }
    let extra = text.replace(
        "end_header",
        "element edge 1\nproperty int vertex1\nend_header",
    ) + "0\n";
    let notes = read("ply", extra).repairs.notes;
    assert!(notes.len() == 1 && notes[0].contains("“edge”"), "{notes:?}");
}

#[test]
fn counts_that_a_file_cannot_hold_are_refused_before_anything_is_laid_out() {
    for form in ["ascii", "binary_little_endian"] {
        for (vertices, faces) in [(usize::MAX, 1), (8, usize::MAX / 2), (4_000_000_000, 12)] {
            let said = refused("ply", ply_header(form, vertices, faces));
            assert!(said.contains("announces"), "{said}");
        }
        let none = format!("ply\nformat {form} 1.0\nelement vertex 4000000000\nend_header\n");
        assert!(refused("ply", none).contains("properties"));
    }
    let (p, indices) = (block(), [0, 1, 2]);
    for (accessor, count) in [(0_usize, 1_u64 << 60), (1, 1 << 40), (0, 9), (1, 6)] {
        let (mut file, data) = gltf(&p, &indices, 4);
        file["accessors"][accessor]["count"] = json!(count);
        let said = beside(&file, &data).err().unwrap();
        assert!(
            said.contains("meshes[0].primitives[0]") && said.len() < 1000,
            "{said}"
        );
    }
}

#[test]
fn strips_and_fans_are_triangles_and_points_are_said() {
    let square = [
        DVec3::ZERO,
        DVec3::new(4.0, 0.0, 0.0),
        DVec3::new(4.0, 3.0, 0.0),
        DVec3::new(0.0, 3.0, 0.0),
    ];
    // A strip that begins anew, and a fan.
    let drawn = [
        (5, vec![0, 1, 3, 2]),
        (5, vec![0, 0, 1, 3, 2]),
        (6, vec![0, 1, 2, 3]),
    ];
    for (mode, indices) in drawn {
        let (file, data) = gltf(&square, &indices, mode);
        let loaded = beside(&file, &data).unwrap_or_else(|said| panic!("{said}"));
        assert!((loaded.mesh.area() - 12.0).abs() < 1e-12, "{mode}");
        assert_eq!(loaded.repairs.degenerate_triangles, 0);
        assert_eq!(loaded.repairs.flipped_triangles, 0, "{mode}");
    }
    let (mut file, data) = gltf(&square, &[0, 1, 2], 4);
    let mut lines = file["meshes"][0]["primitives"][0].clone();
    lines["mode"] = json!(1);
    let primitives = file["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives.push(lines);
    let notes = beside(&file, &data)
        .unwrap_or_else(|e| panic!("{e}"))
        .repairs
        .notes;
    assert!(notes.len() == 1 && notes[0].contains("lines"), "{notes:?}");
    let (file, data) = gltf(&square, &[0, 1, 2, 3], 4);
    let said = beside(&file, &data).err().unwrap();
    assert!(said.contains("4 corners"), "{said}");
}

#[test]
fn strips_of_a_ply_are_read() {
    let vertices = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n2 1 0\n3 0 0\n";
    let head = "ply\nformat ascii 1.0\nelement vertex 7\nproperty double x\nproperty double y\nproperty double z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    // Two squares, and after a break a triangle beside them.
    let loaded = read("ply", format!("{head}{vertices}10 0 1 2 3 -1 1 4 3 5 -1\n"));
    assert!((loaded.mesh.area() - 2.0).abs() < 1e-12);
    assert_eq!(loaded.repairs.flipped_triangles, 0);
    assert!(loaded.repairs.notes.is_empty(), "{:?}", loaded.repairs);
    let said = refused("ply", format!("{head}{vertices}4 0 1 2 7\n"));
    assert!(said.contains("vertex 7"), "{said}");
}

#[test]
fn what_a_gltf_makes_of_a_mesh_besides_is_noted() {
    let (mut file, data) = gltf(&block(), &[0, 1, 2, 1, 3, 2], 4);
    file["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    file["skins"] = json!([{ "joints": [0] }]);
    file["nodes"][0]["skin"] = json!(0);
    let loaded = beside(&file, &data).unwrap_or_else(|said| panic!("{said}"));
    let notes = loaded.repairs.notes.join("; ");
    assert!(notes.contains("EXT_mesh_gpu_instancing"), "{notes}");
    assert!(notes.contains("1 mesh of the file with joints"), "{notes}");
}

#[test]
fn accessors_that_cannot_be_right_are_refused() {
    let (p, indices) = (block(), [0, 1, 2, 1, 3, 2]);
    let change = |path: &[&str], value: Value| {
        let (mut file, data) = gltf(&p, &indices, 4);
        let place = path
            .iter()
            .fold(&mut file, |at, key| match key.parse::<usize>() {
                Ok(index) => &mut at[index],
                Err(_) => &mut at[*key],
            });
        *place = value;
        beside(&file, &data).err().expect("refused")
    };
    for (path, value) in [
        (&["accessors", "0", "type"], json!("VEC2")),
        (&["accessors", "0", "type"], json!("VEC4")),
        (&["accessors", "0", "componentType"], json!(5125)),
        (&["accessors", "1", "type"], json!("VEC2")),
        (&["accessors", "1", "componentType"], json!(5126)),
        (&["accessors", "1", "componentType"], json!(5122)),
        (&["accessors", "0", "byteOffset"], json!(12)),
        (&["bufferViews", "0", "byteStride"], json!(4)),
        (&["bufferViews", "1", "byteOffset"], json!(4_000)),
    ] {
        let said = change(path, value);
        assert!(said.contains("accessor"), "{path:?}: {said}");
    }
}

#[test]
fn a_gltf_takes_its_data_from_beside_it_and_below_only() {
    let indices = [0, 1, 2];
    let (file, data) = gltf(&block(), &indices, 4);
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("here");
    std::fs::create_dir_all(here.join("sub")).unwrap();
    for name in ["out.bin", "here/in.bin", "here/a b.bin", "here/sub/in.bin"] {
        std::fs::write(folder.path().join(name), &data).unwrap();
    }
    let with = |uri: &str| {
        let mut file = file.clone();
        file["buffers"][0]["uri"] = json!(uri);
        let text = file.to_string();
        parse_mesh(
            text.as_bytes(),
            "gltf",
            Some(&here),
            1.0,
            0,
            &Repair::default(),
        )
    };
    for uri in ["in.bin", "./in.bin", "sub/in.bin", "a%20b.bin"] {
        assert!(with(uri).is_ok(), "{uri}");
    }
    let absolute = folder.path().join("out.bin").display().to_string();
    let mut outside = vec![
        "../out.bin".to_owned(),
        "sub/../../out.bin".into(),
        "%2e%2e/out.bin".into(),
        "..\\out.bin".into(),
        "/dev/zero".into(),
        "http://example.org/a.bin".into(),
        format!("file://{absolute}"),
        absolute,
        "none.bin".into(),
        "sub".into(),
        String::new(),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../out.bin", here.join("link.bin")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", here.join("zero.bin")).unwrap();
        outside.extend(["link.bin".to_owned(), "zero.bin".into()]);
    }
    for uri in outside {
        assert!(with(&uri).is_err(), "{uri} was read");
    }
    let within = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=";
    let (mut file, _) = gltf(&block()[..3], &indices, 4);
    // Some leave out what fills the last letters, and some the bytes that fill the last word but count them.
    for left_out in [0, 1, 4] {
        file["buffers"][0]["uri"] = json!(within[..within.len() - left_out]);
        let area = read("gltf", file.to_string()).mesh.area();
        assert!((area - 0.5).abs() < 1e-12, "{left_out}: {area}");
    }
}

#[test]
fn a_damaged_file_says_one_thing_and_no_backtrace() {
    let (mut file, data) = gltf(&block(), &[0, 1, 2], 4);
    // What the library that checks it stumbles over.
    file["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(7);
    let said = beside(&file, &data).err().unwrap();
    assert!(said.contains("accessor 7"), "{said}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.gltf");
    std::fs::write(&path, file.to_string()).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .arg("design")
        .arg(&path)
        .arg("--out")
        .arg(folder.path().join("out"))
        .env("RUST_BACKTRACE", "1")
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(1), "{words}");
    assert!(words.contains("damaged.gltf"), "{words}");
    assert!(
        !words.contains("panicked") && words.lines().count() == 1,
        "{words}"
    );
}

/// The block with its faces torn apart by a hair.
fn torn(gap: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corners = block();
    let (mut p, mut t) = (Vec::new(), Vec::new());
    for (k, face) in (0u32..).zip(BLOCK) {
        let base = 4 * k;
        p.extend(face.map(|v| corners[v] + DVec3::splat(gap * f64::from(k))));
        t.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    (p, t)
}

#[test]
fn a_mesh_that_closes_when_it_is_welded_says_so() {
    let (p, t) = torn(2e-4);
    let (_, report) = TriMesh::new(&p, &t, 0).unwrap();
    let within = report.closes_within.expect("the gaps are small");
    let said = report.in_words(0).unwrap();
    assert!(said.contains("part.weld_mm = 3)"), "{said}");
    let weld = Repair {
        weld: within,
        ..Repair::default()
    };
    let (mesh, report) = TriMesh::repaired(&p, &t, 0, &weld).unwrap();
    assert_eq!(mesh.boundary_edges().count(), 0);
    assert_eq!((report.closes_within, report.bodies), (None, 1));
    // Wide gaps are no seams, and a shell is open because it is one.
    let (p, t) = torn(0.1);
    assert_eq!(TriMesh::new(&p, &t, 0).unwrap().1.closes_within, None);
    let (p, t) = torn(0.0);
    assert_eq!(TriMesh::new(&p, &t[2..], 0).unwrap().1.closes_within, None);
}

#[test]
fn a_solid_with_open_edges_says_how_many() {
    let (p, t) = torn(0.0);
    let inputs = |triangles: &[[u32; 3]], model: PartModel| {
        let mut project = Project::around("block.stl", Some(Unit::Millimetre));
        project.part.model = model;
        Inputs {
            project,
            part: Arc::new(TriMesh::new(&p, triangles, 0).unwrap().0),
            painted: None,
            masks: Masks::new(),
        }
    };
    let said = open_solid(&inputs(&t[1..], PartModel::Solid)).unwrap();
    assert!(said.contains("3 edges"), "{said}");
    assert_eq!(open_solid(&inputs(&t, PartModel::Solid)), None);
    assert_eq!(open_solid(&inputs(&t[1..], PartModel::Shell)), None);
}

#[test]
fn groups_of_a_welded_mesh_take_no_longer_than_the_mesh() {
    let side = 220;
    let mut text = String::new();
    for k in 0..side * side {
        writeln!(text, "v {} {} 0", k % side, k / side).unwrap();
    }
    for k in 0..side * (side - 1) {
        if k == 0 || k == side * (side / 2) {
            writeln!(text, "g half{k}").unwrap();
        }
        if k % side + 1 < side {
            let (a, b) = (k + 1, k + 1 + side);
            writeln!(text, "f {a} {} {} {b}", a + 1, b + 1).unwrap();
        }
    }
    let weld = Repair {
        weld: 1e-3,
        ..Repair::default()
    };
    let begun = Instant::now();
    let loaded = parse_mesh(text.as_bytes(), "obj", None, 1.0, 0, &weld)
        .unwrap_or_else(|said| panic!("{said}"));
    assert!(
        begun.elapsed() < Duration::from_secs(2),
        "{:?}",
        begun.elapsed()
    );
    let first = loaded.groups["half0"].iter().filter(|&&m| m).count();
    assert_eq!(first, side * (side / 2 + 1));
}
