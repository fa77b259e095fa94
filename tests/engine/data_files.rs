//! Data files from elsewhere: what is read from them, and what is said of those that cannot be.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use hapdef::io::dataset_file::{self, GivenData};
use hapdef::io::npz::{NpzFile, read_mask};
use hapdef::io::points::{read_sites, read_touches};
use zip::write::SimpleFileOptions;

/// A folder to put small files into.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// An NPZ of arrays in NPY, packed as `numpy.savez_compressed` does.
    fn npz(&self, name: &str, arrays: &[(&str, &[u8])]) -> PathBuf {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (array, bytes) in arrays {
            zip.start_file(format!("{array}.npy"), SimpleFileOptions::default())
                .unwrap();
            zip.write_all(bytes).unwrap();
        }
        self.file(name, zip.finish().unwrap().into_inner())
    }
}

/// An array in NPY: its type as `NumPy` writes it, quotation marks included.
fn npy(kind: &str, fortran: bool, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let header = format!("{{'descr': {kind}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [
        &b"\x93NUMPY\x01\x00"[..],
        &length[..],
        header.as_bytes(),
        bytes,
    ]
    .concat()
}

fn floats(shape: &str, values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    npy("'<f8'", false, shape, &bytes)
}

/// Three touches, a few centimetres apart.
fn touches() -> Vec<u8> {
    floats("(3, 3)", &[0.0, 0.0, 0.0, 0.03, 0.0, 0.0, 0.0, 0.05, 0.01])
}

fn signals() -> Vec<u8> {
    floats("(2, 3)", &[1.0, 2.0, 3.0, 4.0, 6.0, 5.0])
}

#[track_caller]
fn says(error: impl std::fmt::Display, words: &[&str]) {
    let said = error.to_string();
    for word in words {
        assert!(said.contains(word), "{word:?} is missing: {said}");
    }
    assert!(said.len() < 2000, "{said}");
}

#[track_caller]
fn refused(path: &Path, touches: Option<&Path>, words: &[&str]) {
    says(dataset_file::read(path, touches).unwrap_err(), words);
}

#[test]
fn counts_and_floats_of_any_type_and_order_are_numbers() {
    let folder = Folder::new();
    let counts = [0u8, 1, 1, 2, 3, 100];
    let wide =
        |bytes: fn(u8) -> Vec<u8>| -> Vec<u8> { counts.iter().flat_map(|&v| bytes(v)).collect() };
    let cases: [(&str, Vec<u8>); 16] = [
        ("'|i1'", wide(|v| vec![v])),
        ("'|u1'", wide(|v| vec![v])),
        ("'<i2'", wide(|v| i16::from(v).to_le_bytes().into())),
        ("'>i2'", wide(|v| i16::from(v).to_be_bytes().into())),
        ("'<u2'", wide(|v| u16::from(v).to_le_bytes().into())),
        ("'>u2'", wide(|v| u16::from(v).to_be_bytes().into())),
        ("'<i4'", wide(|v| i32::from(v).to_le_bytes().into())),
        ("'>u4'", wide(|v| u32::from(v).to_be_bytes().into())),
        ("'<i8'", wide(|v| i64::from(v).to_le_bytes().into())),
        ("'<u8'", wide(|v| u64::from(v).to_le_bytes().into())),
        ("'>i8'", wide(|v| i64::from(v).to_be_bytes().into())),
        ("'<f4'", wide(|v| f32::from(v).to_le_bytes().into())),
        ("'>f4'", wide(|v| f32::from(v).to_be_bytes().into())),
        ("'<f8'", wide(|v| f64::from(v).to_le_bytes().into())),
        ("'>f8'", wide(|v| f64::from(v).to_be_bytes().into())),
        // Halves of 0, 1, 1, 2, 3 and 100.
        (
            "'<f2'",
            [0x0000u16, 0x3c00, 0x3c00, 0x4000, 0x4200, 0x5640]
                .iter()
                .flat_map(|h| h.to_le_bytes())
                .collect(),
        ),
    ];
    for (kind, bytes) in cases {
        let by_rows = npy(kind, false, "(2, 3)", &bytes);
        let path = folder.npz("c.npz", &[("X", &by_rows), ("p_m", &touches())]);
        let GivenData { data, .. } = dataset_file::read(&path, None).unwrap();
        assert_eq!(data.x.values(), counts.map(f64::from), "{kind}");
        let by_columns = npy(kind, true, "(2, 3)", &bytes);
        let path = folder.npz("f.npz", &[("X", &by_columns), ("p_m", &touches())]);
        let GivenData { data, .. } = dataset_file::read(&path, None).unwrap();
        let rows = [0.0, 1.0, 3.0, 1.0, 2.0, 100.0];
        assert_eq!(data.x.values(), rows, "{kind} in Fortran order");
    }
    let negative = npy("'<i2'", false, "(2, 3)", &[0xfe_u8, 0xff].repeat(6));
    let path = folder.npz("n.npz", &[("X", &negative), ("p_m", &touches())]);
    let GivenData { data, .. } = dataset_file::read(&path, None).unwrap();
    assert_eq!(data.x.values(), [-2.0; 6]);
}

#[test]
fn arrays_of_anything_else_are_refused_in_words() {
    let folder = Folder::new();
    for (kind, word) in [
        ("'<c16'", "complex numbers"),
        ("'<U5'", "text"),
        ("'|S5'", "text"),
        ("'|O'", "Python objects"),
        ("'<M8[s]'", "times"),
        ("'<f16'", "extended precision"),
        ("'|V8'", "raw bytes"),
        ("[('a', '<f8'), ('b', '<f8')]", "named fields"),
        ("'<q7'", "unknown type"),
    ] {
        let x = npy(kind, false, "(2, 3)", &[0; 96]);
        let path = folder.npz("x.npz", &[("X", &x), ("p_m", &touches())]);
        refused(&path, None, &["x.npz", "“X”", word, "float64"]);
    }
    let path = folder.npz("other.npz", &[("signals", &signals())]);
    refused(&path, None, &["no array “X”", "“signals”"]);
    let path = folder.file("single.npz", signals());
    refused(&path, None, &["single.npz", "NPZ", "numpy.savez"]);
}

#[test]
fn an_array_is_not_taken_before_it_is_known_to_fit() {
    let folder = Folder::new();
    // A thousand bytes that announce a terabyte; a shape whose product is no number; one that unpacks for ever.
    for (shape, words) in [
        ("(1000000, 1000000)", ["--memory-gb", "1000000 × 1000000"]),
        ("(4294967296, 4294967296)", ["--memory-gb", "announces"]),
        ("(2, 3)", ["more follows", "6 numbers"]),
        ("(2, 30000)", ["of its 60000 numbers", "Write it again"]),
    ] {
        let x = npy("'<f8'", false, shape, &vec![0; 400_000]);
        let path = folder.npz("bomb.npz", &[("X", &x), ("p_m", &touches())]);
        refused(
            &path,
            None,
            &[&["bomb.npz", "“X”"][..], &words[..]].concat(),
        );
    }
    // Brackets that a reader of Python would follow down, and a header that is longer than the file.
    let deep = npy(&"(".repeat(60_000), false, "(2, 3)", &[]);
    let path = folder.npz("deep.npz", &[("X", &deep)]);
    refused(&path, None, &["deep.npz", "“X”"]);
    let long = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'";
    let path = folder.npz("long.npz", &[("X", long)]);
    refused(&path, None, &["long.npz", "header"]);
}

#[test]
fn the_budget_of_memory_holds_for_datasets() {
    let folder = Folder::new();
    let x = npy("'<f8'", false, "(2000, 2000)", &[]);
    let path = folder.npz("large.npz", &[("X", &x), ("p_m", &touches())]);
    let output = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["select", "--memory-gb", "0.1", "--data"])
        .arg(&path)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    says(&said, &["large.npz", "2000 × 2000", "--memory-gb"]);
}

#[test]
fn a_mask_is_zeros_and_ones_of_any_type() {
    let folder = Folder::new();
    let counts = npy("'<i4'", false, "(2,)", &[1, 0, 0, 0, 0, 0, 0, 0]);
    let path = folder.npz("m.npz", &[("held", &counts)]);
    assert_eq!(read_mask(&path, "held").unwrap(), [true, false]);
    let labels = npy("'|u1'", false, "(3,)", &[0, 1, 2]);
    let path = folder.npz("l.npz", &[("held", &labels)]);
    let error = read_mask(&path, "held").unwrap_err();
    says(error, &["l.npz", "“held”", "vertex 2"]);
}

#[cfg(target_os = "linux")]
#[test]
fn pipes_and_devices_are_refused_before_they_are_opened() {
    let folder = Folder::new();
    let pipe = |name: &str| {
        let path = folder.path(name);
        let mode = rustix::fs::Mode::from_raw_mode(0o600);
        rustix::fs::mkfifoat(rustix::fs::CWD, &path, mode).unwrap();
        path
    };
    let (npz, csv, touched) = (pipe("d.npz"), pipe("d.csv"), pipe("t.csv"));
    let good = folder.file("good.csv", "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n");
    refused(&npz, None, &["d.npz", "pipe"]);
    refused(&csv, Some(&good), &["d.csv", "pipe"]);
    refused(&good, Some(&touched), &["t.csv", "pipe"]);
    says(read_touches(&touched).unwrap_err(), &["t.csv", "pipe"]);
    says(read_sites(&touched).unwrap_err(), &["t.csv", "pipe"]);
    says(read_mask(&npz, "held").unwrap_err(), &["d.npz", "pipe"]);
    let exports = folder.path("exports");
    std::fs::create_dir(&exports).unwrap();
    std::fs::write(exports.join("1.txt"), "").unwrap();
    std::os::unix::fs::symlink(&npz, exports.join("2.txt")).unwrap();
    refused(&exports, Some(&good), &["2.txt", "pipe"]);
}

const TOUCHES: &str = "x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm\n";

#[test]
fn directions_of_any_size_are_directions() {
    let folder = Folder::new();
    let rows = "1,2,3,1e200,0,0,1,5\n1,2,3,0,-1e-320,0,1,5\n1,2,3,3e-200,0,4e-200,1,5\n";
    let path = folder.file("t.csv", format!("{TOUCHES}{rows}"));
    let touches = read_touches(&path).unwrap();
    let expected = [DVec3::X, DVec3::NEG_Y, DVec3::new(0.6, 0.0, 0.8)];
    for (touch, normal) in touches.iter().zip(expected) {
        assert!(touch.normal.distance(normal) < 1e-12, "{}", touch.normal);
    }
    let path = folder.file("s.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n1,2,3,0,1e300,0\n");
    assert_eq!(read_sites(&path).unwrap()[0].direction, DVec3::Y);
    for (row, word) in [
        ("1,2,3,0,0,0,1,5", "nx, ny, nz"),
        ("1,2,3,inf,0,0,1,5", "“nx” is “inf”"),
        ("1,2,3,1,0,0,1e300,5", "force_n"),
        ("1,2,3,1,0,0,1,1e-320", "tip_radius_mm"),
        ("1,2,3,1,0,0,1,1e160", "tip_radius_mm"),
    ] {
        let path = folder.file("t.csv", format!("{TOUCHES}# a remark\r\n\r\n{row}\r\n"));
        says(read_touches(&path).unwrap_err(), &["t.csv", "line 4", word]);
    }
}

#[test]
fn a_point_farther_than_the_part_is_large_is_named() {
    let folder = Folder::new();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for name in ["limb.glb", "limb.hapdef.toml"] {
        std::fs::copy(assets.join(name), folder.path(name)).unwrap();
    }
    let near = folder.file("near.csv", format!("{TOUCHES}31.8,0,60,1,0,0,5,4\n"));
    let sites = folder.file("s.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n30,8,60,0,0,1\n");
    let simulate = |touches: &Path, sites: &Path, words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_hapdef"))
            .arg("simulate")
            .arg(folder.path("limb.hapdef.toml"))
            .arg("--touches")
            .arg(touches)
            .arg("--sites")
            .arg(sites)
            .arg("--out")
            .arg(folder.path("r.csv"))
            .arg("--strict")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(!said.contains("inf mm"), "{said}");
        says(&said, words);
        assert!(!folder.path("r.csv").exists());
    };
    for (x, distance) in [
        ("1e160", "1.0e160 mm"),
        ("-1e90", "1.0e90 mm"),
        ("5000", " mm from"),
    ] {
        let rows = format!("{TOUCHES}31.8,0,60,1,0,0,5,4\n# far\n{x},0,60,1,0,0,5,4\n");
        let touches = folder.file("far.csv", rows);
        simulate(
            &touches,
            &sites,
            &["far.csv, line 4: touch 1", distance, "across"],
        );
    }
    let far = folder.file("far.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n30,8,1e200,0,0,1\n");
    simulate(&near, &far, &["far.csv, line 2: site 0", "1.0e200 mm"]);
}

/// A CSV of two sites under three touches, and the touches.
fn tables(folder: &Folder, touches: [&str; 3]) -> (PathBuf, PathBuf) {
    let signals = "x_mm,y_mm,z_mm,a,b,c\n1,0,0,1,2,3\n0,40,0,3,2,1\n";
    let mut text = String::from("x_mm,y_mm,z_mm\r\n");
    for row in touches {
        text.push_str(row);
        text.push_str("\r\n");
    }
    (folder.file("d.csv", signals), folder.file("t.csv", text))
}

#[test]
fn places_that_cannot_be_meant_are_named() {
    let folder = Folder::new();
    let read = |touches| {
        let (data, touches) = tables(&folder, touches);
        dataset_file::read(&data, Some(&touches))
    };
    let good = read(["0,0,0", "30,0,0", "0,50,10"]).unwrap();
    assert!(good.notes.is_empty(), "{:?}", good.notes);
    let far = read(["0,0,0", "30,0,1e308", "0,50,10"]).unwrap_err();
    says(far, &["t.csv", "line 3", "1.0e308 mm"]);
    let wide = read(["0,0,0", "30000,0,0", "0,50000,10000"]).unwrap_err();
    says(wide, &["t.csv", "touches", "50000 mm", "millimetres"]);
    let one = read(["7,8,9"; 3]).unwrap_err();
    says(one, &["t.csv", "all 3 touches", "one place"]);
    // A dataset whose touches are in metres is read as one of a pinprick.
    let small = read(["0,0,0", "0.03,0,0", "0,0.05,0.01"]).unwrap();
    says(&small.notes[0], &["40 mm", "0.05 mm", "unit"]);
}

#[test]
fn positions_in_millimetres_are_not_taken_for_metres() {
    let folder = Folder::new();
    let sites = |places: &[f64; 6]| {
        let arrays = [
            ("X", signals()),
            ("p_m", touches()),
            ("site_m", floats("(2, 3)", places)),
        ];
        let arrays: Vec<(&str, &[u8])> = arrays.iter().map(|(n, b)| (*n, &b[..])).collect();
        dataset_file::read(&folder.npz("d.npz", &arrays), None)
    };
    let good = sites(&[0.0, 0.0, 0.0, 0.04, 0.0, 0.16]).unwrap();
    assert!(good.notes.is_empty(), "{:?}", good.notes);
    for places in [
        [0.0, 0.0, 0.0, 40.0, 0.0, 160.0],
        [0.0, 0.0, 0.0, 4.0, 0.0, 8.0],
    ] {
        let words = ["d.npz", "site_m is in metres", "divide it by 1000"];
        says(sites(&places).unwrap_err(), &words);
    }
    let wild = sites(&[0.0, 0.0, 0.0, 0.04, f64::NAN, 0.16]).unwrap_err();
    says(wild, &["site_m[1, 1] is NaN"]);
    let x = floats("(2, 3)", &[1.0, 2.0, 3.0, 4.0, 1e200, 5.0]);
    let path = folder.npz("x.npz", &[("X", &x), ("p_m", &touches())]);
    refused(&path, None, &["site 1 under touch 1", "1e200"]);
    let one = [
        ("X", floats("(2, 1)", &[1.0, 2.0])),
        ("p_m", floats("(1, 3)", &[0.0; 3])),
    ];
    let path = folder.npz("one.npz", &[("X", &one[0].1), ("p_m", &one[1].1)]);
    refused(&path, None, &["one.npz", "one touch only"]);
}

/// A part of 10 mm, all of it written in millimetres, is a part of 10 m to whoever reads metres.
#[test]
fn places_that_agree_on_a_part_of_ten_metres_are_doubted() {
    let folder = Folder::new();
    let read = |size: f64, with_sites: bool| {
        let places = [0.0, 0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 1.0, 0.2].map(|x| x * size);
        let mut arrays = vec![("X", signals()), ("p_m", floats("(3, 3)", &places))];
        if with_sites {
            arrays.push(("site_m", floats("(2, 3)", &places[3..])));
        }
        let arrays: Vec<(&str, &[u8])> = arrays.iter().map(|(n, b)| (*n, &b[..])).collect();
        let read = dataset_file::read(&folder.npz("d.npz", &arrays), None);
        read.unwrap().notes
    };
    for with_sites in [true, false] {
        let notes = read(10.0, with_sites);
        assert_eq!(notes.len(), 1, "{notes:?}");
        says(&notes[0], &["10000 mm", "p_m is in metres", "by 1000"]);
        assert_eq!(notes[0].contains("site_m is in"), with_sites, "{notes:?}");
        // An arm, and a fingertip.
        assert_eq!(read(1.2, with_sites), Vec::<String>::new());
        assert_eq!(read(0.01, with_sites), Vec::<String>::new());
    }
}

#[test]
fn what_is_wrong_in_a_table_is_named_with_its_cause() {
    let folder = Folder::new();
    let data = "x_mm,y_mm,z_mm,a,b,c\n1,0,0,1,2,3\n0,40,0,3,2,1\n";
    let good = "x_mm,y_mm,z_mm\n0,0,0\n30,0,0\n0,50,10\n";
    let cases: [(&str, &str, &[&str]); 12] = [
        (data, "x_mm;y_mm;z_mm\n1;2;3\n", &["t.csv", "semicolons"]),
        (data, "x_mm\ty_mm\tz_mm\n1\t2\t3\n", &["t.csv", "tabs"]),
        (
            data,
            "x_mm,y_mm,z_mm\n1,5,2,3\n",
            &["t.csv", "line 2", "4 values for the 3"],
        ),
        (
            data,
            "x_mm,y_mm,z_mm,x_mm\n1,2,3,4\n",
            &["t.csv", "x_mm stands twice"],
        ),
        (data, "x_mm,y_mm\n1,2\n", &["t.csv", "z_mm is missing"]),
        (data, "x_mm,y_mm,z_mm\n", &["t.csv", "no row"]),
        (data, "", &["t.csv", "empty"]),
        (
            data,
            "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n",
            &["d.csv", "3 columns (from “a”)", "2 touches"],
        ),
        (
            "x_mm,y_mm,z_mm,a,b,c\n1,0,0,1,two,3\n",
            good,
            &["d.csv", "line 2", "“b” is “two”"],
        ),
        (
            "x_mm,y_mm,z_mm,a,b,c\n1,0,0,1,nan,3\n",
            good,
            &["d.csv", "line 2", "“b” is “nan”"],
        ),
        (
            "x_mm,y_mm,z_mm,a,b,c\n\n1,0,0,1,,3\n",
            good,
            &["d.csv", "line 3", "“b” is empty"],
        ),
        (
            "x_mm,y_mm,z_mm,cost,a,b,c\n1,0,0,-1,1,2,3\n",
            good,
            &["d.csv", "cost of site 0"],
        ),
    ];
    for (data, touches, words) in cases {
        let data = folder.file("d.csv", data);
        let touches = folder.file("t.csv", touches);
        refused(&data, Some(&touches), words);
    }
    let escapes = folder.file("t.csv", "x_mm,y_mm,z_mm\n1,2,\u{1b}[31mred\n");
    let error = dataset_file::read(&folder.path("d.csv"), Some(&escapes)).unwrap_err();
    assert!(!error.to_string().contains('\u{1b}'), "{error}");
}

#[test]
fn exports_of_other_meshes_and_units_are_not_joined() {
    let header =
        "Node Number\tX Location (mm)\tY Location (mm)\tZ Location (mm)\tTotal Deformation (m)\n";
    let first = format!("{header}1\t0\t0\t0\t5\n2\t40\t0\t0\t6\n");
    let cases = [
        (
            format!("{header}1\t0\t0\t0\t5\n2\t50\t0\t0\t6\n"),
            "different meshes",
        ),
        (first.replace("(m)", "(mm)"), "“mm”"),
        (
            first.replace("\n2\t", "\n1.7\t"),
            "line 3: “1.7” is no number of a node",
        ),
        (
            first.replace("\t6\n", "\tnan\n"),
            "line 3: “nan” is no number",
        ),
        (
            first.replace("\t6\n", "\n"),
            "line 3: there are 4 values for the 5 columns",
        ),
        (
            format!("{header}7\t0\t0\t0\t5\n"),
            "no node stands in every export",
        ),
    ];
    let folder = Folder::new();
    let exports = folder.path("exports");
    std::fs::create_dir(&exports).unwrap();
    std::fs::write(exports.join("1.txt"), &first).unwrap();
    let touches = folder.file("t.csv", "x_mm,y_mm,z_mm\n0,0,0\n30,0,0\n");
    for (second, word) in cases {
        std::fs::write(exports.join("2.txt"), second).unwrap();
        refused(&exports, Some(&touches), &["exports", word]);
    }
    for name in ["../t.csv", "/etc/hostname", "", "1.txt"] {
        let text = format!("x_mm,y_mm,z_mm,file\n0,0,0,1.txt\n30,0,0,{name}\n");
        let touches = folder.file("t.csv", text);
        refused(&exports, Some(&touches), &["t.csv", "touch 1"]);
    }
}

#[test]
fn what_the_program_writes_it_reads() {
    let folder = Folder::new();
    let mut file = NpzFile::default();
    file.add("X", &[1, 2], &[1.0f32, 2.0]).unwrap();
    file.add("p_m", &[2, 3], &[0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
        .unwrap();
    let path = folder.path("w.npz");
    file.save(&path).unwrap();
    let GivenData { data, notes } = dataset_file::read(&path, None).unwrap();
    assert_eq!(data.x.values(), [1.0, 2.0]);
    assert_eq!(data.targets[1], [100.0, 0.0, 0.0]);
    assert!(notes.is_empty());
}
