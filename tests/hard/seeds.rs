//! Small sound files of every kind, to be spoiled, and those found before.
#![allow(
    clippy::format_push_string,
    reason = "files are put together here, once"
)]

use std::path::Path;

use hapdef::budget::unwatched;
use hapdef::cli::examples::Example;
use hapdef::dataset::SignalMatrix;
use hapdef::design::TrainingOutcome;
use hapdef::io::glb::write_glb;
use hapdef::io::touch_file::{self, TrainingOrigin};
use hapdef::io::trade_file::TradeRecord;
use hapdef::learning::{Family, MeasuredTouches, TrainingRequest, train};
use hapdef::mesh::TriMesh;
use hapdef::wire::{Hello, WireMessage, encode};

use super::reader::{NUMPY, PLACES, Reader, TABLE, packed, small};

/// A file larger than this is spoiled too slowly to be worth it.
const LARGEST: u64 = 300_000;
const MEASURED: &str = include_str!("../../assets/trade/trade.json");
/// Between two samples of a board.
const STEP_US: u32 = 10_000;
/// Points of a trade that are enough.
const POINTS: usize = 2;

/// Sound files for a reader.
pub fn of(reader: Reader) -> Vec<Vec<u8>> {
    match reader {
        Reader::Stl => vec![binary_stl(&small()), ascii_stl(&small(), 2)],
        Reader::Obj => vec![obj(&small())],
        Reader::Ply => ["ascii", "binary_little_endian", "binary_big_endian"]
            .map(|format| ply(&small(), format))
            .to_vec(),
        Reader::Gltf => vec![gltf()],
        Reader::Glb => vec![write_glb(&small()).expect("a sound mesh")],
        Reader::Msh => vec![msh_second(), msh_fourth(), msh_binary()],
        Reader::Inp => vec![inp()],
        Reader::Dat => vec![deck(), shells()],
        Reader::Project => vec![Example::Tube.project().into(), PROJECT.into()],
        Reader::Npz => vec![npz()],
        Reader::Arrays => vec![arrays(), counts()],
        Reader::Mask => vec![npy("|b1", "(5,)", &[1, 0, 1, 1, 0])],
        Reader::Csv => vec![TABLE.into()],
        Reader::Places => vec![PLACES.into()],
        Reader::Export => vec![EXPORT.into(), EXPORT.replace('.', ",").into(), wide(EXPORT)],
        Reader::Touches => vec![TOUCHES.into()],
        Reader::Sites => vec![SITES.into()],
        Reader::Presses => vec![PRESSES.into()],
        Reader::Trade => vec![trade()],
        Reader::Trained => [Family::Nearest, Family::KernelRidge].map(trained).to_vec(),
        Reader::Wire => vec![frames(true), lines()],
        Reader::Frames => vec![contents(&frames(false))],
        Reader::Recording => vec![frames(true), recorded_lines()],
    }
}

/// Files in a folder and below it that a reader may be given, in the order of their paths.
///
/// # Errors
/// The folder that cannot be read.
pub fn found(reader: Reader, folder: &Path) -> Result<Vec<Vec<u8>>, String> {
    let broken = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut entries: Vec<_> = std::fs::read_dir(folder)
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(broken)?;
    entries.sort_by_key(std::fs::DirEntry::path);
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.path();
        if path.is_dir() {
            files.extend(found(reader, &path)?);
        } else if is_for(reader, &path) && entry.metadata().is_ok_and(|m| m.len() <= LARGEST) {
            files.push(std::fs::read(&path).map_err(broken)?);
        }
    }
    Ok(files)
}

fn is_for(reader: Reader, path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match reader {
        // Their form is our own.
        Reader::Arrays | Reader::Mask | Reader::Frames => false,
        Reader::Wire => ending == Reader::Recording.ending(),
        _ => ending.eq_ignore_ascii_case(reader.ending()),
    }
}

fn binary_stl(mesh: &TriMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles().len() as u32).to_le_bytes());
    for t in 0..mesh.triangles().len() as u32 {
        bytes.extend([0; 12]);
        for p in mesh.corners(t) {
            for x in p.to_array() {
                bytes.extend((x as f32).to_le_bytes());
            }
        }
        bytes.extend([0; 2]);
    }
    bytes
}

/// Of some triangles, in so many solids.
fn ascii_stl(mesh: &TriMesh, solids: u32) -> Vec<u8> {
    let mut text = String::new();
    for solid in 0..solids {
        text += &format!("solid limb{solid}\n");
        for t in 6 * solid..6 * solid + 6 {
            text += "facet normal 0 0 0\nouter loop\n";
            for p in mesh.corners(t) {
                text += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
            }
            text += "endloop\nendfacet\n";
        }
        text += &format!("endsolid limb{solid}\n");
    }
    text.into_bytes()
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::from("o limb\n");
    for p in mesh.positions() {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for (k, t) in mesh.triangles().iter().enumerate() {
        if k.is_multiple_of(20) {
            text += &format!("g group{k}\n");
        }
        let last = i64::from(t[2]) - mesh.positions().len() as i64;
        text += &format!("f {}//1 {} {last}\n", t[0] + 1, t[1] + 1);
    }
    text.into_bytes()
}

fn ply(mesh: &TriMesh, format: &str) -> Vec<u8> {
    let (v, f) = (mesh.positions().len(), mesh.triangles().len());
    let mut bytes = format!("ply\nformat {format} 1.0\ncomment limb\nelement vertex {v}\nproperty float x\nproperty float y\nproperty float z\nelement face {f}\nproperty list uchar int vertex_indices\nend_header\n").into_bytes();
    let little = format == "binary_little_endian";
    for p in mesh.positions() {
        for x in p.to_array() {
            match format {
                "ascii" => bytes.extend(format!("{x} ").bytes()),
                _ if little => bytes.extend((x as f32).to_le_bytes()),
                _ => bytes.extend((x as f32).to_be_bytes()),
            }
        }
        if format == "ascii" {
            bytes.push(b'\n');
        }
    }
    for t in mesh.triangles() {
        if format == "ascii" {
            bytes.extend(format!("3 {} {} {}\n", t[0], t[1], t[2]).bytes());
            continue;
        }
        bytes.push(3);
        for v in t {
            bytes.extend(if little {
                v.to_le_bytes()
            } else {
                v.to_be_bytes()
            });
        }
    }
    bytes
}

/// A glTF file whose buffer is a data URI.
fn gltf() -> Vec<u8> {
    br#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"part","mesh":0,"children":[1],"scale":[1,1,-1]},{"mesh":0,"translation":[0,0,1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":44,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA="}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]}"#.to_vec()
}

/// A block of 20 mm as six tetrahedra around its diagonal: corners (mm), and tetrahedra counted from one.
fn block() -> ([[f64; 3]; 8], [[usize; 4]; 6]) {
    let side = |bit: usize| if bit == 0 { 0.0 } else { 20.0 };
    let corners = std::array::from_fn(|k| [side(k & 1), side(k & 2), side(k & 4)]);
    // From the first corner to the last along the three axes, in every order.
    let ways = [[1, 2], [2, 4], [4, 1], [2, 1], [4, 2], [1, 4]];
    (corners, ways.map(|[a, b]| [1, 1 + a, 1 + a + b, 8]))
}

fn msh_second() -> Vec<u8> {
    let (corners, tetrahedra) = block();
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"foot\"\n$EndPhysicalNames\n$Nodes\n8\n",
    );
    for ([x, y, z], k) in corners.iter().zip(1..) {
        text += &format!("{k} {x} {y} {z}\n");
    }
    text += "$EndNodes\n$Elements\n7\n1 2 2 1 1 1 2 4\n";
    for ([a, b, c, d], k) in tetrahedra.iter().zip(2..) {
        text += &format!("{k} 4 2 2 1 {a} {b} {c} {d}\n");
    }
    (text + "$EndElements\n").into_bytes()
}

fn msh_fourth() -> Vec<u8> {
    let (corners, tetrahedra) = block();
    let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 8 1 8\n3 1 0 8\n");
    for k in 1..=8 {
        text += &format!("{k}\n");
    }
    for [x, y, z] in corners {
        text += &format!("{x} {y} {z}\n");
    }
    text += "$EndNodes\n$Elements\n1 6 1 6\n3 1 4 6\n";
    for ([a, b, c, d], k) in tetrahedra.iter().zip(1..) {
        text += &format!("{k} {a} {b} {c} {d}\n");
    }
    (text + "$EndElements\n").into_bytes()
}

fn inp() -> Vec<u8> {
    let (corners, tetrahedra) = block();
    let mut text = String::from("*HEADING\na block\n*NODE\n");
    for ([x, y, z], k) in corners.iter().zip(1..) {
        text += &format!("{k}, {x}, {y}, {z}\n");
    }
    text += "*ELEMENT, TYPE=C3D4, ELSET=all\n";
    for ([a, b, c, d], k) in tetrahedra.iter().zip(1..) {
        text += &format!("{k}, {a}, {b}, {c}, {d}\n");
    }
    text += "*NSET, NSET=foot\n1, 2, 3, 4\n*NSET, NSET=top, GENERATE\n5, 8, 1\n";
    text += "*MATERIAL, NAME=pa\n*ELASTIC\n1700., 0.39\n*BOUNDARY\nfoot, 1, 3\n8, 2\n";
    text.into_bytes()
}

/// The block in a binary file of Gmsh, with a physical group.
fn msh_binary() -> Vec<u8> {
    let (corners, tetrahedra) = block();
    let mut bytes = b"$MeshFormat\n4.1 1 8\n".to_vec();
    bytes.extend(1_i32.to_le_bytes());
    bytes.extend(
        b"\n$EndMeshFormat\n$PhysicalNames\n1\n3 4 \"body\"\n$EndPhysicalNames\n$Entities\n",
    );
    let sizes = |bytes: &mut Vec<u8>, all: &[u64]| {
        bytes.extend(all.iter().flat_map(|n| n.to_le_bytes()));
    };
    let ints = |bytes: &mut Vec<u8>, all: &[i32]| {
        bytes.extend(all.iter().flat_map(|n| n.to_le_bytes()));
    };
    let floats = |bytes: &mut Vec<u8>, all: &[f64]| {
        bytes.extend(all.iter().flat_map(|x| x.to_le_bytes()));
    };
    sizes(&mut bytes, &[0, 0, 0, 1]);
    ints(&mut bytes, &[1]);
    floats(&mut bytes, &[0.0; 6]);
    sizes(&mut bytes, &[1]);
    ints(&mut bytes, &[4]);
    sizes(&mut bytes, &[0]);
    bytes.extend(b"\n$EndEntities\n$Nodes\n");
    sizes(&mut bytes, &[1, 8, 1, 8]);
    ints(&mut bytes, &[3, 1, 0]);
    sizes(&mut bytes, &[8]);
    sizes(&mut bytes, &[1, 2, 3, 4, 5, 6, 7, 8]);
    for corner in corners {
        floats(&mut bytes, &corner);
    }
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    sizes(&mut bytes, &[1, 6, 1, 6]);
    ints(&mut bytes, &[3, 1, 4]);
    sizes(&mut bytes, &[6]);
    for (k, nodes) in (1..).zip(tetrahedra) {
        sizes(&mut bytes, &[k]);
        sizes(&mut bytes, &nodes.map(|n| n as u64));
    }
    bytes.extend(b"\n$EndElements\n");
    bytes
}

/// The block as Mechanical writes it, with material, component and what is held.
fn deck() -> Vec<u8> {
    let (corners, tetrahedra) = block();
    let mut text = String::from(
        "/com, Data in consistent NMM units.\n/units,MPA\n*set,tid,3\n/prep7\nnblock,3,,8\n(1i9,3e20.9e3)\n",
    );
    for (k, [x, y, z]) in (1..).zip(corners) {
        text += &format!("{k:9}{x:20.9}{y:20.9}{z:20.9}\n");
    }
    text += "-1\net,tid,285\net,2,174\neblock,19,solid,,6\n(19i9)\n";
    for (k, [a, b, c, d]) in (1..).zip(tetrahedra) {
        let head = [1, 3, 1, 1, 0, 0, 0, 0, 4, 0, k];
        text += &head.map(|n| format!("{n:9}")).concat();
        text += &format!("{a:9}{b:9}{c:9}{d:9}\n");
    }
    text += "-1\ntype,2\neblock,10,,,1\n(15i9)\n        9        2        2        2        0        1        2        4\n-1\n";
    text += "MPTEMP,R5.0, 1, 1,  22.0    ,\nMPDATA,R5.0, 1,EX  ,       1, 1,  1700.0    ,\nMP,NUXY,1,0.39\nMP,DENS,1,9e-10\n";
    text += "CMBLOCK,FOOT,NODE,        2\n(8i10)\n         1        -4\ncmsel,s,FOOT\nd,all,all\nnsel,all\n";
    text += "*if,x,eq,1,then\n/eof\n*endif\nd,8,uy\nsolve\nfini\n";
    text.into_bytes()
}

/// A sheet of two shells, by single commands.
fn shells() -> Vec<u8> {
    let mut text = String::from("/UNITS,SI\nET,1,SHELL181\nSECTYPE,1,SHELL\nSECDATA,2,1\n");
    for (k, [x, y]) in (1..).zip([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]]) {
        text += &format!("N,{k},{x}0,{y}0\n");
    }
    text +=
        "MP,EX,1,2e9\nE,1,2,3,4\nEN,7,2,5,6,3\nNSEL,S,LOC,X,0\nCM,rim,NODE\nD,ALL,ALL,0\nALLSEL\n";
    text.into_bytes()
}

/// With every kind of key that the bundled one has not.
const PROJECT: &str = r#"format = 1
[part]
mesh = "part.stl"
unit = "mm"
weld_mm = 0.01
fill_holes_mm = 3.0
elements = "as-given"
model = "solid"
axis = "x"
[[support]]
kind = "symmetry"
box_mm = [[-1e3, -1e3, -1], [1e3, 1e3, 1]]
normal = "z"
[[support]]
kind = "pinned"
vertices = "foot"
[touch]
region = "grip"
[feasible]
painted = "painted"
keep_out = "cable"
[candidates]
count = 40
[selection]
selector = "entropy"
sensors = 3
required_mm = [[1, 2, 3], [4, 5, 6.5]]
target_mm = 2.5
cost_budget = 4.0
failure = 0.1
[[selection.cost]]
box_mm = [[0, 0, 0], [1, 1, 1]]
cost = 2.0
[selection.gaussian_process]
length_mm = 12.0
power = 1.5
[budget]
quality = "draft"
[budget.limits]
vertices = 300
touches = 60
candidates = 20
[live]
channels = [2, 0, 1]
"#;

const EXPORT: &str = "Node Number\tX Location (mm)\tY Location (mm)\tZ Location (mm)\tTotal Deformation (mm)\n1\t0.5\t1.5\t2.5\t0.001\n2\t3.5\t4.5\t5.5\t2.5e-3\n";
const TOUCHES: &str =
    "x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm\n31.8,0,60,1,0,0,10,5\n0,31.8,40,0,1,0,2.5,3\n";
const PRESSES: &str =
    "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n0.1,0.5,31.8,0,60,5\n0.9,0.3,0,31.8,40,2.5\n";
const SITES: &str = "x_mm,y_mm,z_mm,dx,dy,dz\n30.3,0,50,0,0,1\n0,30.3,70,1,0,1\n";

/// Text as Windows likes to write it.
fn wide(text: &str) -> Vec<u8> {
    let units = text.encode_utf16().flat_map(u16::to_le_bytes);
    [0xff, 0xfe].into_iter().chain(units).collect()
}

/// An array as `NumPy` writes it.
fn npy(kind: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // Values begin at a multiple of 64 bytes.
    while !(NUMPY.len() + 5 + header.len()).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = NUMPY.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.into_bytes());
    bytes.extend(values);
    bytes
}

fn doubles(shape: &str, values: impl Iterator<Item = f64>) -> Vec<u8> {
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    npy("<f8", shape, &bytes)
}

/// Signals of four sites under six touches; where the touches and the sites were; what the sites cost.
fn parts() -> [Vec<u8>; 4] {
    let wave = |k: i32| (0.7 * f64::from(k)).sin();
    [
        doubles("(4, 6)", (0..24).map(wave)),
        doubles("(6, 3)", (0..18).map(|k| 0.01 * wave(k))),
        doubles("(4, 3)", (0..12).map(|k| 0.02 * wave(k))),
        doubles("(4,)", (1..5).map(f64::from)),
    ]
}

/// Where the six touches were, as an array of its own.
pub fn places_of_six() -> Vec<u8> {
    parts()[1].clone()
}

fn arrays() -> Vec<u8> {
    parts().concat()
}

/// Raw counts as a board gives them.
fn counts() -> Vec<u8> {
    let raw: Vec<u8> = (0..24_i16).flat_map(|k| (37 * k).to_le_bytes()).collect();
    [npy("<i2", "(4, 6)", &raw), places_of_six()].concat()
}

fn npz() -> Vec<u8> {
    let [x, p, site, cost] = parts();
    let named = [
        ("X", &x[..]),
        ("p_m", &p[..]),
        ("site_m", &site[..]),
        ("cost", &cost[..]),
    ];
    packed(&named).expect("sound arrays")
}

fn trade() -> Vec<u8> {
    let mut record = TradeRecord::parse(MEASURED).expect("the bundled trade");
    record.points.truncate(POINTS);
    record.to_json().into_bytes()
}

/// What three channels learned of touches along a line, and how hard they were.
pub fn trained(family: Family) -> Vec<u8> {
    const TOUCHES: usize = 24;
    let at = |t: usize| (t * 7 % TOUCHES) as f64;
    let value = |k: usize| (0.2 * at(k % TOUCHES) + (k / TOUCHES) as f64).sin();
    let x = SignalMatrix::new(TOUCHES, (0..3 * TOUCHES).map(value).collect());
    let places: Vec<[f64; 3]> = (0..TOUCHES).map(|t| [at(t), 0.0, 1.0]).collect();
    let forces: Vec<f64> = (0..TOUCHES).map(|t| 1.0 + at(t)).collect();
    let lessons = MeasuredTouches {
        x: &x,
        places_mm: &places,
        forces: &forces,
        groups: &(0..TOUCHES).collect::<Vec<_>>(),
    };
    let asked = TrainingRequest {
        family: Some(family),
        ..TrainingRequest::default()
    };
    let learned: TrainingOutcome = train(&lessons, &asked, &unwatched)
        .expect("enough to learn from")
        .into();
    let origin = TrainingOrigin {
        data: "d.npz".into(),
        fingerprint: "0".into(),
        touches: TOUCHES,
        train_touches: learned.division.train.len(),
        seed: 0,
        estimator: learned.method,
        validation_mm: learned.validation_mm,
        tried: learned.tried,
        test: learned.scores,
        limb: None,
        board: None,
        update: None,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.hapdtouch");
    touch_file::write(&path, origin, &learned.estimator).expect("it can be written");
    std::fs::read(&path).expect("it was written")
}

/// A board that greets, rests, is touched and says something, as it goes over the wire; with what the studio
/// writes into a recording or without.
fn frames(notes: bool) -> Vec<u8> {
    const SAMPLES: u32 = 160;
    let hello = Hello {
        version: hapdef::wire::VERSION,
        board: 7,
        channels: 6,
        bits: 12,
        reference_mv: 3300,
        supply_mv: 5000,
        gain_milli: 330_000,
        rate_hz: 100,
        name: "Simulated board".into(),
    };
    let log = |text: &str| WireMessage::Log {
        level: 0,
        text: text.into(),
    };
    let mut said = vec![WireMessage::Hello(hello)];
    if notes {
        said.extend(["hapdef tare", "hapdef dead 5", "hapdef truth 31.8 0 60 5"].map(log));
    }
    let pressed = |k: u32| if k > 100 { 40 } else { 0 };
    said.extend((0..SAMPLES).map(|k| {
        let count = |c: u32| 2000 + 10 * c + (k * 7 + c) % 3 + pressed(k) * (c + 1) / 3;
        WireMessage::Data((0..6).map(count).collect())
    }));
    said.push(WireMessage::Status {
        overruns: 1,
        temperature_centi: Some(2150),
    });
    said.extend([
        WireMessage::Pong(9),
        WireMessage::Rate(500),
        WireMessage::AskHello,
    ]);
    said.push(log("touched"));
    let mut bytes = vec![0];
    for (k, message) in (0_u32..).zip(&said) {
        encode(message, k as u16, STEP_US * k, 12, &mut bytes);
    }
    bytes
}

/// What frames hold, each behind its length, without their check sums; those of data but for a few left out.
fn contents(bytes: &[u8]) -> Vec<u8> {
    const KEPT: usize = 20;
    /// Bytes of the check sum.
    const SUM: usize = 2;
    let unpacked = |frame: &[u8]| {
        let mut frame = frame.to_vec();
        let length = cobs::decode_in_place(&mut frame).ok()?;
        frame.truncate(length.saturating_sub(SUM));
        Some(frame)
    };
    let whole: Vec<Vec<u8>> = bytes
        .split(|&b| b == 0)
        .filter(|frame| !frame.is_empty())
        .filter_map(unpacked)
        .collect();
    let last = whole.len().saturating_sub(KEPT);
    let kept = whole.iter().take(KEPT).chain(&whole[last..]);
    let behind = |frame: &Vec<u8>| -> Vec<u8> {
        let length = std::iter::once(frame.len() as u8);
        length.chain(frame.iter().copied()).collect()
    };
    kept.flat_map(behind).collect()
}

/// A sketch that prints numbers, among other things.
fn lines() -> Vec<u8> {
    let row = |k: u32| format!("{k},{},-{}.5\t{k}\r\n", 2 * k, 3 * k);
    let rows: String = (0..20).map(row).collect();
    format!("booting\r\n1.5\n2;5\n{rows}").into_bytes()
}

/// What a recording of a board that prints lines looks like.
fn recorded_lines() -> Vec<u8> {
    let mut bytes = vec![0];
    for k in 0..160_u32 {
        let text = match k {
            0 => "hapdef rest 0 512.5 0.25".to_owned(),
            1 => "hapdef truth none".to_owned(),
            _ => format!("hapdef line {k},{},3.5,-4,5,6", k % 5),
        };
        let message = WireMessage::Log { level: 0, text };
        encode(&message, k as u16, STEP_US * k, 12, &mut bytes);
    }
    bytes
}
