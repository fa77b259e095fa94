//! The real program: what it writes, what it prints, and how it refuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Runs, expects the exit code and a message with all the given words, and no panic.
fn refused(arguments: &[&str], code: i32, words: &[&str]) {
    let output = hapdef(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    assert!(!message.contains("panicked"), "{message}");
    for word in words {
        assert!(
            message.contains(word),
            "{arguments:?} should say {word:?}: {message}"
        );
    }
}

/// The bundled project and mesh in a folder of their own, the project's text changed.
fn project(change: impl Fn(String) -> String) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    std::fs::copy(assets.join("limb.glb"), folder.path().join("limb.glb")).unwrap();
    let original = std::fs::read_to_string(assets.join("limb.hapdef.toml")).unwrap();
    let path = folder.path().join("p.hapdef.toml");
    let changed = change(original.clone());
    assert!(
        changed != original || original.is_empty(),
        "the change must change something"
    );
    std::fs::write(&path, changed).unwrap();
    (folder, path)
}

#[test]
fn the_bundled_limb_is_what_its_generator_writes() {
    let folder = tempfile::tempdir().unwrap();
    let output = hapdef(&["limb", "--out", text(folder.path())]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    for name in ["limb.glb", "limb.hapdef.toml"] {
        let made = std::fs::read(folder.path().join(name)).unwrap();
        let kept = std::fs::read(
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("assets")
                .join(name),
        )
        .unwrap();
        assert!(
            made == kept,
            "{name} differs from the bundled one: run `hapdef limb --out assets`"
        );
    }
}

#[test]
fn another_limb_of_the_family_is_written_and_held() {
    let folder = tempfile::tempdir().unwrap();
    let output = hapdef(&[
        "limb",
        "--out",
        text(folder.path()),
        "--arc",
        "200",
        "--taper",
        "0.8",
        "--columns",
        "3",
        "--hoops",
        "4",
        "--corner-radius",
        "3",
        "--clamp-rims",
        "4",
        "--no-sites",
        "--json",
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let figures: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(figures["triangles"].as_u64().unwrap() > 500);
    let project = folder.path().join("limb.hapdef.toml");
    let data = folder.path().join("d.npz");
    let output = hapdef(&[
        "simulate",
        text(&project),
        "--quality",
        "draft",
        "--out",
        text(&data),
        "--json",
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(data.exists());
}

#[test]
fn a_draft_design_leaves_everything_behind() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    let arguments = [
        "design",
        "--quality",
        "draft",
        "--sensors",
        "10",
        "--json",
        "--out",
        text(&out),
    ];
    let output = hapdef(&arguments);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let sites = summary["sites"].as_array().unwrap();
    assert_eq!(sites.len(), 10);
    for site in sites {
        assert!(site["index"].is_u64() && site["x_mm"].is_f64());
        let d: f64 = site["direction"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap().powi(2))
            .sum();
        assert!((d - 1.0).abs() < 1e-9);
        // On the mid-surface of the tube, to the facets' sagitta.
        let r = site["x_mm"]
            .as_f64()
            .unwrap()
            .hypot(site["y_mm"].as_f64().unwrap());
        assert!((r - 31.831).abs() < 0.05, "{r}");
    }
    let error = |selector: &str, sensors: u64, region: &str| {
        summary["evaluation"]
            .as_array()
            .unwrap()
            .iter()
            .find(|r| r["selector"] == selector && r["sensors"] == sensors && r["region"] == region)
            .unwrap_or_else(|| panic!("no row for {selector} {sensors} {region}"))["error_mm"]
            .as_f64()
            .unwrap()
    };
    for selector in ["greedy-svr", "pca-qr"] {
        assert!(error(selector, 10, "all touches") < 12.0);
        assert!(
            error(selector, 10, "away from the boundaries")
                < error(selector, 1, "away from the boundaries")
        );
    }
    assert_eq!(summary["quality"], "draft");
    assert!(summary["seconds"]["simulate"].as_f64().unwrap() > 0.0);
    assert_eq!(summary["achieved"]["work"]["factorizations"], 4);
    let html = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(html.matches("<svg").count() >= 7 && html.contains("unrolled"));
    assert!(
        !html.contains("http://")
            || html.matches("http://").count() == html.matches("http://www.w3.org/").count()
    );
    let csv = std::fs::read_to_string(out.join("sites.csv")).unwrap();
    assert!(csv.starts_with("x_mm,y_mm,z_mm,dx,dy,dz,") && csv.lines().count() == 11);
    // The written project reproduces the run.
    let again = folder.path().join("again");
    let project = out.join("design.hapdef.toml");
    let output = hapdef(&[
        "design",
        text(&project),
        "--sensors",
        "10",
        "--json",
        "--threads",
        "1",
        "--out",
        text(&again),
    ]);
    let repeated: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(repeated["sites"], summary["sites"]);
    assert_eq!(repeated["evaluation"], summary["evaluation"]);
    let bytes = |folder: &Path| std::fs::read(folder.join("dataset.npz")).unwrap();
    assert!(
        bytes(&out) == bytes(&again),
        "the dataset is the same to the byte"
    );
}

#[test]
fn bad_meshes_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let design = |path: &Path, code, words: &[&str]| {
        refused(
            &["design", text(path), "--unit", "mm", "--out", text(&out)],
            code,
            words,
        );
        assert!(!out.exists(), "nothing is written for a refused input");
    };
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    design(
        &folder.path().join("missing.glb"),
        1,
        &["missing.glb", "no such file"],
    );
    design(&file("empty.stl", b""), 1, &["empty.stl", "empty"]);
    let glb = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/limb.glb")).unwrap();
    design(
        &file("cut.glb", &glb[..glb.len() / 2]),
        1,
        &["cut.glb", "truncated"],
    );
    design(
        &file("nan.obj", b"v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n"),
        1,
        &["nan.obj"],
    );
    design(
        &file("none.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        1,
        &["none.obj", "no triangles"],
    );
    design(
        &file("limb.step", b"ISO-10303-21;"),
        1,
        &["limb.step", "glb, gltf, obj, ply, stl"],
    );
    // Held nowhere: the part is fine, the project is not.
    design(
        &file("free.obj", b"v 0 0 0\nv 50 0 0\nv 0 50 0\nf 1 2 3\n"),
        1,
        &["support"],
    );
    refused(
        &[
            "design",
            text(&folder.path().join("free.obj")),
            "--out",
            text(&out),
        ],
        1,
        &["free.obj", "--unit"],
    );
}

#[test]
fn bad_projects_are_refused_with_the_remedy() {
    let out = tempfile::tempdir().unwrap();
    let design = |change: &dyn Fn(String) -> String, words: &[&str]| {
        let (_keep, path) = project(change);
        let target = out.path().join("never");
        refused(
            &[
                "design",
                text(&path),
                "--quality",
                "draft",
                "--out",
                text(&target),
            ],
            1,
            words,
        );
        assert!(!target.exists());
    };
    design(
        &|t| t.replace("format = 1", "format = 9"),
        &["p.hapdef.toml", "newer version", "Update"],
    );
    design(
        &|t| t.replace("limb.glb", "gone.glb"),
        &["gone.glb", "no such file"],
    );
    design(
        &|t| t.replace("force_n = 10.0", "force_n = nan"),
        &["touch.force_n"],
    );
    design(
        &|t| t.replace("[touch]", "[touch"),
        &["p.hapdef.toml", "line"],
    );
    design(
        &|t| {
            t.replace("-0.01]", "-900.0]")
                .replace(", 5.01]", ", -800.0]")
                .replace("114.99]", "800.0]")
                .replace("120.01]", "900.0]")
        },
        &["held by a support", "support"],
    );
    design(
        &|t| t.replace("support_clearance_mm = 8.0", "support_clearance_mm = 800.0"),
        &["no site is feasible", "filters"],
    );
    design(
        &|t| t.replace("sensors = 10", "sensors = 3000"),
        &["3000 gauges", "fewer"],
    );
    design(
        &|t| t.replace("edge_margin_mm = 2.4", "edge_margin_mm = 50.0"),
        &["edge_margin_mm"],
    );
    design(
        &|t| t.replace("spacing_mm = 2.1", "spacing_mm = 0.05"),
        &["spacing_mm"],
    );
    design(
        &|t| t.replace("count = 4000", "count = 1"),
        &["touch.count"],
    );
}

#[test]
fn wrong_usage_is_two() {
    refused(&["design"], 2, &["--out"]);
    refused(
        &["design", "--out", "x", "--quality", "splendid"],
        2,
        &["draft"],
    );
    refused(&["no-such-command", "more"], 2, &[]);
    let help = hapdef(&["--help"]);
    assert!(help.status.success());
}
