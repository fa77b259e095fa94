//! Mesh files with everything wrong that chance can make wrong: each is refused in words or taken in as a
//! sound surface; nothing panics, nothing hangs.
//!
//! A few thousand files a format in the ordinary run; a million with
//! `HAPDEF_FUZZ=1000000 cargo test --test fuzz -- --nocapture`. Every file is made from its number alone.

#![allow(
    clippy::format_push_string,
    reason = "files are put together here, once"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use hapdef::io::glb::write_glb;
use hapdef::io::mesh_file::{LoadedMesh, parse_mesh};
use hapdef::limb::LimbSpec;
use hapdef::mesh::TriMesh;
use hapdef::mesh::repair::Repair;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

fn count() -> u64 {
    std::env::var("HAPDEF_FUZZ")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(3000)
}

fn small() -> TriMesh {
    let spec = LimbSpec {
        element: 40.0,
        ..LimbSpec::default()
    };
    spec.build().unwrap().0
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

fn ascii_stl(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::from("solid limb\n");
    for t in 0..12 {
        text += "facet normal 0 0 0\nouter loop\n";
        for p in mesh.corners(t) {
            text += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid limb\n").into_bytes()
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    let mut text = String::from("o limb\n");
    for p in mesh.positions() {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for (k, t) in mesh.triangles().iter().enumerate() {
        if k % 20 == 0 {
            text += &format!("g group{k}\n");
        }
        text += &format!(
            "f {}//1 {} {}\n",
            t[0] + 1,
            t[1] + 1,
            i64::from(t[2]) - mesh.positions().len() as i64
        );
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

const WORDS: [&str; 14] = [
    "nan",
    "inf",
    "-1",
    "0",
    "4294967295",
    "1e400",
    "-2147483649",
    "\n",
    " ",
    "99999999999999999999",
    "/",
    "1e-320",
    "{",
    "]",
];

/// One to three changes: bits, bytes, numbers, words, blocks taken out, doubled or cut off.
fn spoiled(seed: &[u8], number: u64) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let mut bytes = seed.to_vec();
    for _ in 0..rng.random_range(1..=3) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.random_range(0..bytes.len());
        let length = rng.random_range(1..=16usize).min(bytes.len() - at);
        match rng.random_range(0..9) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random(),
            2 => {
                let extreme = [0u32, 1, 0x7f80_0000, 0xffff_ffff, 0x7fff_ffff, 0x7fc0_0000];
                let word = extreme[rng.random_range(0..extreme.len())].to_le_bytes();
                for (b, w) in bytes[at..].iter_mut().zip(word) {
                    *b = w;
                }
            }
            3 => {
                let word = WORDS[rng.random_range(0..WORDS.len())].bytes();
                bytes.splice(at..at + length, word);
            }
            4 => {
                bytes.drain(at..at + length);
            }
            5 => {
                let copy = bytes[at..at + length].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, copy);
            }
            6 => bytes.truncate(at),
            7 => {
                let to = rng.random_range(0..bytes.len());
                bytes.swap(at, to);
            }
            _ => {
                // Digits are where counts and indices are.
                if let Some(k) = bytes[at..].iter().position(u8::is_ascii_digit) {
                    bytes[at + k] = b'0' + rng.random_range(0..10u8);
                }
            }
        }
    }
    bytes
}

/// Whether what was accepted is a surface: everything that the rest of the program relies on.
fn check(loaded: &LoadedMesh) -> Result<(), String> {
    let mesh = &loaded.mesh;
    if mesh.triangles().is_empty() {
        return Err("no triangle".into());
    }
    if let Some(p) = mesh.positions().iter().find(|p| !p.is_finite()) {
        return Err(format!("a vertex at {p}"));
    }
    let vertices = mesh.positions().len() as u32;
    let mut used = vec![false; vertices as usize];
    for (t, tri) in (0..).zip(mesh.triangles()) {
        if tri.iter().any(|&v| v >= vertices)
            || tri[0] == tri[1]
            || tri[1] == tri[2]
            || tri[2] == tri[0]
        {
            return Err(format!("triangle {tri:?} of {vertices} vertices"));
        }
        for &v in tri {
            used[v as usize] = true;
        }
        let normal = mesh.facet_normal(t);
        if (normal.length() - 1.0).abs() > 1e-6 || mesh.facet_area(t) <= 0.0 {
            return Err(format!("triangle {t} has normal {normal}"));
        }
    }
    if !used.iter().all(|&u| u) {
        return Err("a vertex without a triangle".into());
    }
    for edge in mesh.edges() {
        if edge.a >= edge.b || edge.triangles.is_empty() {
            return Err(format!("{edge:?}"));
        }
    }
    if loaded
        .groups
        .values()
        .any(|mask| mask.len() != vertices as usize)
    {
        return Err("a group of another size".into());
    }
    Ok(())
}

fn fuzz(name: &str, ending: &str, seed: &[u8]) {
    let (accepted, refused) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let whole = parse_mesh(seed, ending, None, 1.0, 0, &Repair::default());
    check(&whole.unwrap_or_else(|e| panic!("{name}: the file itself: {e}"))).unwrap();
    let bad: Vec<String> = (0..count())
        .into_par_iter()
        .filter_map(|number| {
            let bytes = spoiled(seed, number);
            let repair = Repair {
                weld: if number % 3 == 0 { 1e-3 } else { 0.0 },
                fill_holes: if number % 5 == 0 { 0.05 } else { 0.0 },
            };
            let body = usize::from(number % 7 == 0);
            let parse = || parse_mesh(&bytes, ending, None, 1.0, body, &repair);
            match catch_unwind(AssertUnwindSafe(parse)) {
                Err(_) => Some(format!("{name} {number}: panic")),
                Ok(Err(message)) => {
                    refused.fetch_add(1, Ordering::Relaxed);
                    message
                        .is_empty()
                        .then(|| format!("{name} {number}: no message"))
                }
                Ok(Ok(loaded)) => {
                    accepted.fetch_add(1, Ordering::Relaxed);
                    check(&loaded)
                        .err()
                        .map(|e| format!("{name} {number}: {e}"))
                }
            }
        })
        .collect();
    println!("{name}: {accepted:?} accepted, {refused:?} refused");
    assert!(
        bad.is_empty(),
        "{}: {:?}",
        bad.len(),
        &bad[..bad.len().min(5)]
    );
    assert!(refused.into_inner() > 0 && accepted.into_inner() > 0);
}

/// The libraries that parse may panic on hostile bytes; that is caught and is no noise worth having.
fn quiet() {
    std::panic::set_hook(Box::new(|_| {}));
}

#[test]
fn spoiled_files_of_every_format_are_refused_or_sound() {
    let mesh = small();
    let files: [(&str, &str, Vec<u8>); 8] = [
        ("STL, binary", "stl", binary_stl(&mesh)),
        ("STL, text", "stl", ascii_stl(&mesh)),
        ("OBJ", "obj", obj(&mesh)),
        ("PLY, text", "ply", ply(&mesh, "ascii")),
        (
            "PLY, little-endian",
            "ply",
            ply(&mesh, "binary_little_endian"),
        ),
        ("PLY, big-endian", "ply", ply(&mesh, "binary_big_endian")),
        ("GLB", "glb", write_glb(&mesh).unwrap()),
        ("glTF", "gltf", gltf()),
    ];
    for (name, _, seed) in &files {
        println!("{name}: {} bytes", seed.len());
    }
    let hook = std::panic::take_hook();
    quiet();
    let result = catch_unwind(|| {
        for (name, ending, seed) in &files {
            fuzz(name, ending, seed);
        }
    });
    std::panic::set_hook(hook);
    if let Err(panic) = result {
        std::panic::resume_unwind(panic);
    }
}
