//! One part with a named piece, written in every format that names pieces: its vertices are the same in all of them, in
//! every unit, and so are the vertices of a mask that was painted on it.

use std::fmt::Write as _;

use glam::DVec3;
use hapdef::io::mesh_file::read_mesh;
use hapdef::io::project_file;
use hapdef::mesh::repair::Repair;
use hapdef::project::Unit;
use serde_json::json;

/// A block of 4 by 3 by 2, with the two triangles of its lid last.
const FACES: [[usize; 4]; 6] = [
    [0, 2, 3, 1],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [4, 5, 7, 6],
];
const SIZE: [f64; 3] = [4.0, 3.0, 2.0];
/// Of the twelve triangles, those that are not the lid's.
const REST: usize = 10;

fn corners() -> Vec<[f64; 3]> {
    let end = |k: usize, bit: usize| if k >> bit & 1 == 1 { SIZE[bit] } else { 0.0 };
    (0..8).map(|k| [0, 1, 2].map(|bit| end(k, bit))).collect()
}

fn triangles() -> Vec<[usize; 3]> {
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    FACES.into_iter().flat_map(halves).collect()
}

/// The triangles of each piece, counted from one, with its name.
fn pieces() -> [(&'static str, Vec<[usize; 3]>); 2] {
    let all = triangles();
    let from_one = |t: &[[usize; 3]]| t.iter().map(|t| t.map(|v| v + 1)).collect();
    [
        ("rest", from_one(&all[..REST])),
        ("lid", from_one(&all[REST..])),
    ]
}

fn obj() -> String {
    let mut text = String::new();
    for [x, y, z] in corners() {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for (name, of_piece) in pieces() {
        let _ = writeln!(text, "g {name}");
        for [a, b, c] in of_piece {
            let _ = writeln!(text, "f {a} {b} {c}");
        }
    }
    text
}

fn stl() -> String {
    let (mut text, p) = (String::new(), corners());
    for (name, of_piece) in pieces() {
        let _ = writeln!(text, "solid {name}");
        for t in of_piece {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in t.map(|v| p[v - 1]) {
                let _ = writeln!(text, "vertex {x} {y} {z}");
            }
            text += "endloop\nendfacet\n";
        }
        let _ = writeln!(text, "endsolid {name}");
    }
    text
}

/// Two nodes that share their vertices, with the buffer beside the file.
fn gltf() -> (String, Vec<u8>) {
    let floats = corners().into_iter().flatten();
    let mut data: Vec<u8> = floats.flat_map(|x| (x as f32).to_le_bytes()).collect();
    let indices = triangles().into_iter().flatten();
    data.extend(indices.flat_map(|i| (i as u16).to_le_bytes()));
    let accessor = |view: usize, count: usize| json!({"bufferView": view, "componentType": 5123, "count": count, "type": "SCALAR"});
    let primitive = |indices: usize| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": indices}]});
    let file = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "rest", "mesh": 0}, {"name": "lid", "mesh": 1}],
        "meshes": [primitive(1), primitive(2)],
        "buffers": [{"byteLength": data.len(), "uri": "data.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 6 * REST},
            {"buffer": 0, "byteOffset": 96 + 6 * REST, "byteLength": 12}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": SIZE},
            accessor(1, 3 * REST),
            accessor(2, 6)
        ]
    });
    (file.to_string(), data)
}

fn msh_second() -> String {
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"rest\"\n2 2 \"lid\"\n$EndPhysicalNames\n$Nodes\n8\n",
    );
    for ([x, y, z], k) in corners().into_iter().zip(1..) {
        let _ = writeln!(text, "{k} {x} {y} {z}");
    }
    text += "$EndNodes\n$Elements\n12\n";
    let mut k = 0;
    for ((_, of_piece), tag) in pieces().into_iter().zip(1..) {
        for [a, b, c] in of_piece {
            k += 1;
            let _ = writeln!(text, "{k} 2 2 {tag} {tag} {a} {b} {c}");
        }
    }
    text + "$EndElements\n"
}

fn msh_fourth() -> String {
    let mut text = String::from(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"rest\"\n2 9 \"lid\"\n$EndPhysicalNames\n$Entities\n0 0 2 0\n1 0 0 0 4 3 2 1 7 0\n2 0 0 2 4 3 2 1 9 0\n$EndEntities\n$Nodes\n1 8 1 8\n2 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n",
    );
    for [x, y, z] in corners() {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    text += "$EndNodes\n$Elements\n2 12 1 12\n";
    let mut k = 0;
    for ((_, of_piece), entity) in pieces().into_iter().zip(1..) {
        let _ = writeln!(text, "2 {entity} 2 {}", of_piece.len());
        for [a, b, c] in of_piece {
            k += 1;
            let _ = writeln!(text, "{k} {a} {b} {c}");
        }
    }
    text + "$EndElements\n"
}

/// Solid: the six tetrahedra around the block's diagonal, with the lid as a set of nodes.
fn inp() -> String {
    let mut text = String::from("*NODE\n");
    for ([x, y, z], k) in corners().into_iter().zip(1..) {
        let _ = writeln!(text, "{k}, {x}, {y}, {z}");
    }
    text += "*ELEMENT, TYPE=C3D4, ELSET=all\n";
    for ([a, b], k) in [[1, 2], [2, 4], [4, 1], [2, 1], [4, 2], [1, 4]]
        .into_iter()
        .zip(1..)
    {
        let _ = writeln!(text, "{k}, 1, {}, {}, 8", 1 + a, 1 + a + b);
    }
    text + "*NSET, NSET=lid\n5, 6\n7, 8\n"
}

/// Shells of Ansys, with a component of elements for each piece. The deck says no unit.
fn deck() -> String {
    let mut text = String::from("/prep7\net,1,181\n");
    for ([x, y, z], k) in corners().into_iter().zip(1..) {
        let _ = writeln!(text, "n,{k},{x},{y},{z}");
    }
    for (_, of_piece) in pieces() {
        for [a, b, c] in of_piece {
            let _ = writeln!(text, "e,{a},{b},{c},{c}");
        }
    }
    text += "CMBLOCK,REST,ELEM,2\n(8i10)\n         1       -10\nCMBLOCK,LID,ELEM,2\n(8i10)\n        11        12\n";
    text
}

/// Formats without names, which masks are painted on by the vertices' order.
fn ply() -> String {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n",
    );
    for [x, y, z] in corners() {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    for [a, b, c] in triangles() {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    text
}

/// Name, contents, and whether it names pieces; units of glTF are metres.
fn files() -> (Vec<(&'static str, String, bool)>, Vec<u8>) {
    let (gltf, data) = gltf();
    let files = vec![
        ("a.obj", obj(), true),
        ("b.stl", stl(), true),
        ("c.gltf", gltf, true),
        ("d.msh", msh_second(), true),
        ("e.msh", msh_fourth(), true),
        ("f.inp", inp(), true),
        ("g.dat", deck(), true),
        ("h.cdb", deck(), true),
        ("i.ply", ply(), false),
    ];
    (files, data)
}

fn ends(name: &str, ending: &str) -> bool {
    name.rsplit('.').next() == Some(ending)
}

#[test]
fn a_named_piece_is_the_same_in_all_formats_and_units() {
    let (files, data) = files();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), data).unwrap();
    for (name, text, named) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let units: Vec<Option<Unit>> = if ends(name, "gltf") {
            vec![None]
        } else {
            Unit::ALL.map(Some).to_vec()
        };
        for unit in units {
            let loaded = read_mesh(&path, unit, 0, Repair::default());
            let loaded = loaded.unwrap_or_else(|said| panic!("{name}: {said}"));
            let metres = unit.map_or(1.0, Unit::metres);
            let p = loaded.mesh.positions();
            // The surface of tetrahedra has the middles of their edges too.
            let solid = ends(name, "inp");
            let of = (p.len(), loaded.mesh.triangles().len());
            assert_eq!(of, if solid { (26, 48) } else { (8, 12) }, "{name}");
            assert!(
                (loaded.mesh.area() / (52.0 * metres * metres) - 1.0).abs() < 1e-12,
                "{name}"
            );
            let group = loaded.groups.get("lid").or(loaded.groups.get("LID"));
            assert_eq!(group.is_some(), named, "{name}: {:?}", loaded.groups.keys());
            let on_top = |p: &DVec3| (p.z - 2.0 * metres).abs() < 1e-9 * metres;
            let Some(group) = group else { continue };
            for corner in corners() {
                let there = DVec3::from_array(corner) * metres;
                let vertex = p.iter().position(|q| q.distance(there) < 1e-9 * metres);
                assert_eq!(group[vertex.unwrap()], on_top(&there), "{name}");
            }
            let members = group.iter().filter(|m| **m).count();
            assert!(solid || members == 4, "{name}: {members}");
        }
    }
}

/// A mask in the NPZ beside the project goes by the order of the file's vertices, whatever the order in which its faces
/// use them.
#[test]
fn a_painted_mask_lies_on_the_same_vertices_in_all_formats() {
    let (files, data) = files();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("data.bin"), data).unwrap();
    for (name, text, _) in files {
        // Their vertices have no order of the file's, or are not those of the surface.
        if ends(name, "stl") || ends(name, "inp") {
            continue;
        }
        std::fs::write(folder.path().join(name), text).unwrap();
        let unit = if ends(name, "gltf") {
            ""
        } else {
            "unit = \"mm\"\n"
        };
        let project = format!(
            "format = 1\n[part]\nmesh = \"{name}\"\n{unit}[[support]]\nkind = \"clamped\"\nvertices = \"painted\"\n"
        );
        let at = folder.path().join("p.hapdef.toml");
        std::fs::write(&at, project).unwrap();
        let mut masks = hapdef::io::npz::NpzFile::default();
        let painted: [bool; 8] = [true, false, false, true, true, false, false, false];
        masks.add("painted", &[8], &painted).unwrap();
        masks.save(&folder.path().join("p.hapdef.npz")).unwrap();
        let loaded = project_file::load(&at).unwrap_or_else(|said| panic!("{name}: {said}"));
        let p = loaded.inputs.part.positions();
        let metres = if ends(name, "gltf") { 1.0 } else { 1e-3 };
        let mask = &loaded.inputs.masks["painted"];
        for (k, corner) in corners().into_iter().enumerate() {
            let there = DVec3::from_array(corner) * metres;
            let vertex = p.iter().position(|q| q.distance(there) < 1e-6 * metres);
            assert_eq!(mask[vertex.unwrap()], painted[k], "{name}, vertex {k}");
        }
    }
}
