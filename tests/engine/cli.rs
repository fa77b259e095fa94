//! The real program: what it writes, what it prints, and how it refuses.
#![allow(
    clippy::format_push_string,
    reason = "small files are put together here"
)]

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
        // On the mid-surface of the tube, to the sagitta of elements of five millimetres.
        let r = site["x_mm"]
            .as_f64()
            .unwrap()
            .hypot(site["y_mm"].as_f64().unwrap());
        assert!((r - 31.831).abs() < 0.1, "{r}");
    }
    let error = |selector: &str, sensors: u64, region: &str| {
        summary["evaluation"]
            .as_array()
            .unwrap()
            .iter()
            .find(|r| {
                r["selector"] == selector
                    && r["sensors"] == sensors
                    && r["region"] == region
                    && r["force_n"] == 10.0
            })
            .unwrap_or_else(|| panic!("no row for {selector} {sensors} {region}"))["error_mm"]
            .as_f64()
            .unwrap()
    };
    let selector = "expected-error";
    assert!(error(selector, 10, "all touches") < 2.0);
    assert!(
        error(selector, 10, "away from the boundaries")
            < error(selector, 3, "away from the boundaries")
    );
    assert_eq!(summary["quality"], "draft");
    assert!(summary["seconds"]["simulate"].as_f64().unwrap() > 0.0);
    // Laid, laid anew, halved, the truth, and the elements that matching reads its map from.
    assert_eq!(summary["achieved"]["work"]["factorizations"], 5);
    let html = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(html.matches("<svg").count() >= 7 && html.contains("unrolled"));
    assert!(
        !html.contains("http://")
            || html.matches("http://").count() == html.matches("http://www.w3.org/").count()
    );
    let csv = std::fs::read_to_string(out.join("sites.csv")).unwrap();
    assert!(csv.starts_with("x_mm,y_mm,z_mm,dx,dy,dz,") && csv.lines().count() == 11);
    // Every file says which run it belongs to.
    let run = summary["run"].as_str().unwrap();
    let written = std::fs::read_to_string(out.join("design.json")).unwrap();
    let project = std::fs::read_to_string(out.join("design.hapdef.toml")).unwrap();
    assert!(html.contains(run) && written.contains(run) && project.contains(run));
    assert!(csv.lines().next().unwrap().ends_with(",run"));
    assert!(csv.lines().skip(1).all(|l| l.ends_with(run)), "{csv}");
    assert!(hapdef::io::npz::holds(&out.join("dataset.npz"), "run").unwrap());
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
    assert_eq!(repeated["run"], summary["run"]);
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
        &["limb.step", "glb, gltf, inp, msh, obj, ply, stl"],
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
    design(
        &|t| t + "\n[budget.limits]\ntouches = 1\n",
        &["budget.limits.touches", "between 3 and 1000000"],
    );
}

/// What a project limits is spent no further, and only that.
#[test]
fn limits_of_a_project_hold() {
    let vertices = |limits: &str| {
        let (folder, path) = project(|t| t.replace("count = 4000", "count = 60") + limits);
        let out = folder.path().join("x.npz");
        let run = hapdef(&[
            "simulate",
            text(&path),
            "--quality",
            "draft",
            "--json",
            "--out",
            text(&out),
        ]);
        assert!(run.status.success(), "{run:?}");
        let said: Value = serde_json::from_slice(&run.stdout).unwrap();
        said["vertices"].as_u64().unwrap()
    };
    let free = vertices("\n");
    let few = vertices("\n[budget.limits]\nvertices = 900\n");
    let fine = vertices("\n[budget.limits]\nelements_percent = 1.0\n");
    assert!(few <= 1000, "{few}");
    assert!(few < free && free < fine, "{few} {free} {fine}");
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

const TOUCHES: &str =
    "x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm\n31.8,0,60,1,0,0,10,5\n0,33.331,58,0,1,0,5,5\n";

#[test]
fn given_points_are_answered_pair_by_pair() {
    let (folder, project) = project(|t| t.replace("\"standard\"", "\"draft\""));
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let touches = file("t.csv", TOUCHES);
    let sites = file(
        "s.csv",
        "x_mm,y_mm,z_mm,dx,dy,dz\n30,8,60,0,0,1\n30,8,60,-0.26,0.97,0\n30,-8,31,0,0,1\n",
    );
    let (out, vtu) = (folder.path().join("r.csv"), folder.path().join("f.vtu"));
    let run = |out: &Path| {
        hapdef(&[
            "simulate",
            text(&project),
            "--touches",
            text(&touches),
            "--sites",
            text(&sites),
            "--out",
            text(out),
            "--vtu",
            text(&vtu),
            "--json",
        ])
    };
    let output = run(&out);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(
        summary["discretization"]["strain_percent"]
            .as_f64()
            .unwrap()
            > 0.0
    );
    assert!(summary["checks"]["reaction_error"].as_f64().unwrap() < 1e-6);
    assert!(summary["linearity"]["loads"] == 2);
    let result = std::fs::read_to_string(&out).unwrap();
    let mut lines = result.lines();
    assert_eq!(
        lines.next().unwrap(),
        "touch,site,ux_mm,uy_mm,uz_mm,strain,touch_distance_mm,site_distance_mm"
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    let order: Vec<(f64, f64)> = rows.iter().map(|r| (r[0], r[1])).collect();
    assert_eq!(
        order,
        [(0., 0.), (0., 1.), (0., 2.), (1., 0.), (1., 1.), (1., 2.)]
    );
    // Pressed inward at x = 31.8: what lies beside it moves to smaller x.
    assert!(rows[0][2] < -0.01 && rows[0][2] == rows[1][2]);
    assert!(rows[0][5] != rows[1][5], "the strain is along the gauge");
    assert!(
        rows[3][6] > 1.4 && rows[3][6] < 1.6,
        "1.5 mm off the mid-surface"
    );
    assert!((rows[0][7] - (31.831 - 30f64.hypot(8.0))).abs() < 0.1);
    // The same bytes again, on one thread; and as arrays.
    let again = folder.path().join("again.csv");
    let output = hapdef(&[
        "simulate",
        text(&project),
        "--touches",
        text(&touches),
        "--sites",
        text(&sites),
        "--out",
        text(&again),
        "--threads",
        "1",
    ]);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("estimated error of the mesh"));
    assert_eq!(std::fs::read_to_string(&again).unwrap(), result);
    assert!(run(&folder.path().join("r.npz")).status.success());
    let fields = std::fs::read_to_string(&vtu).unwrap();
    assert!(fields.contains("displacement_mm_touch_1") && fields.ends_with("</VTKFile>\n"));
}

#[test]
fn given_points_that_make_no_sense_are_refused() {
    let (folder, project) = project(|t| t.replace("\"standard\"", "\"draft\""));
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let touches = file("t.csv", TOUCHES);
    let out = folder.path().join("r.csv");
    let simulate = |touches: &Path, sites: &Path, out: &Path, words: &[&str]| {
        let arguments = [
            "simulate",
            text(&project),
            "--touches",
            text(touches),
            "--sites",
            text(sites),
            "--out",
            text(out),
        ];
        refused(&arguments, 1, words);
        assert!(!out.exists());
    };
    let good = file("good.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n30,8,60,0,0,1\n");
    let through = file("through.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n31.8,0,60,1,0,0\n");
    simulate(&touches, &through, &out, &["site 0", "lies in it"]);
    let far = file("far.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n30000,8,60,0,0,1\n");
    simulate(&touches, &far, &out, &["site 0", "unit"]);
    simulate(
        &touches,
        &folder.path().join("no.csv"),
        &out,
        &["no.csv", "no such file"],
    );
    simulate(&good, &good, &out, &["good.csv", "nx"]);
    simulate(
        &touches,
        &good,
        &folder.path().join("r.txt"),
        &["r.txt", ".csv or .npz"],
    );
    // Touches without sites: wrong usage.
    let arguments = [
        "simulate",
        text(&project),
        "--touches",
        text(&touches),
        "--out",
        text(&out),
    ];
    refused(&arguments, 2, &["--sites"]);
}

#[test]
fn supports_by_mask_and_by_group_of_the_mesh_file() {
    let folder = tempfile::tempdir().unwrap();
    // A strip of two groups: the left one is held.
    let mut obj = String::from("o strip\n");
    for i in 0..=20 {
        for y in [0, 5, 10] {
            obj += &format!("v {} {y} 0\n", 5 * i);
        }
    }
    for (name, range) in [("held", 0..4), ("free", 4..20)] {
        obj += &format!("g {name}\n");
        for i in range {
            for k in 1..=2 {
                let a = 3 * i + k;
                obj += &format!("f {} {} {} {}\n", a, a + 3, a + 4, a + 1);
            }
        }
    }
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    file("strip.obj", &obj);
    let project = |support: &str| {
        format!(
            "format = 1\n[part]\nmesh = \"strip.obj\"\nunit = \"mm\"\nthickness_mm = 1.0\n[budget]\nquality = \"draft\"\n[[support]]\n{support}\n"
        )
    };
    let touches = file(
        "t.csv",
        "x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm\n98,5,0,0,0,1,1,2\n",
    );
    let sites = file("s.csv", "x_mm,y_mm,z_mm,dx,dy,dz\n98,5,0,1,0,0\n");
    let deflection = |name: &str, support: &str| -> f64 {
        let path = file(name, &project(support));
        let out = folder.path().join("r.csv");
        let output = hapdef(&[
            "simulate",
            text(&path),
            "--touches",
            text(&touches),
            "--sites",
            text(&sites),
            "--out",
            text(&out),
        ]);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let result = std::fs::read_to_string(&out).unwrap();
        result
            .lines()
            .nth(1)
            .unwrap()
            .split(',')
            .nth(4)
            .unwrap()
            .parse()
            .unwrap()
    };
    let by_box = deflection("box.hapdef.toml", "box_mm = [[-1, -1, -1], [20, 11, 1]]");
    let by_group = deflection("group.hapdef.toml", "vertices = \"held\"");
    // A strip of 78 mm: F L³ / 3 E I, a little less for its width.
    let known = 78f64.powi(3) / (3.0 * 1700.0 * 10.0 / 12.0);
    assert!(
        (by_box / by_group - 1.0).abs() < 0.01,
        "{by_box} {by_group}"
    );
    assert!((-by_box / known - 1.0).abs() < 0.05, "{by_box} {known}");
    let missing = file("missing.hapdef.toml", &project("vertices = \"nothing\""));
    let out = folder.path().join("never.csv");
    let arguments = [
        "simulate",
        text(&missing),
        "--touches",
        text(&touches),
        "--sites",
        text(&sites),
        "--out",
        text(&out),
    ];
    refused(&arguments, 1, &["support.vertices", "nothing", "held"]);
    let both = file(
        "both.hapdef.toml",
        &project("vertices = \"held\"\nbox_mm = [[0, 0, 0], [1, 1, 1]]"),
    );
    let arguments = ["simulate", text(&both), "--out", "x.npz"];
    refused(&arguments, 1, &["one region"]);
}

/// Runs with its stdout sent somewhere: what it said on stderr, and its exit code.
fn sent_to(stdout: impl Into<std::process::Stdio>, arguments: &[&str]) -> (String, Option<i32>) {
    let output = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .stdout(stdout)
        .stderr(std::process::Stdio::piped())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (said, output.status.code())
}

/// Commands that print an answer and are quick.
fn quick(folder: &Path) -> [Vec<&str>; 3] {
    let out = text(folder);
    [
        vec!["limb", "--out", out, "--element", "6", "--no-sites"],
        vec!["--help"],
        vec!["--version"],
    ]
}

#[test]
fn a_reader_that_leaves_ends_a_command_quietly() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in quick(folder.path()) {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let (said, code) = sent_to(writer, &arguments);
        assert_eq!((said.as_str(), code), ("", Some(0)), "{arguments:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_answer_that_does_not_fit_on_the_disk_is_a_message() {
    let full = || std::fs::File::options().write(true).open("/dev/full");
    let folder = tempfile::tempdir().unwrap();
    for arguments in quick(folder.path()) {
        let (said, code) = sent_to(full().unwrap(), &arguments);
        assert_eq!(code, Some(1), "{arguments:?}: {said}");
        let starts = said.starts_with("hapdef: the answer could not be printed");
        assert!(starts && !said.contains("panicked"), "{said}");
        // Nor does a stderr that nobody can read stop anything.
        let run = Command::new(env!("CARGO_BIN_EXE_hapdef"))
            .args(&arguments)
            .stdout(std::process::Stdio::null())
            .stderr(full().unwrap())
            .status();
        assert_eq!(run.unwrap().code(), Some(0), "{arguments:?}");
    }
    let wrong = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["design", "missing.stl", "--out", text(folder.path())])
        .stderr(full().unwrap())
        .status();
    assert_eq!(wrong.unwrap().code(), Some(1));
}

#[test]
fn threads_that_no_machine_has_are_wrong_usage() {
    let words = ["--threads", "from 1 to 1024"];
    for threads in ["0", "1025", "20000", "-3", "two"] {
        let flag = format!("--threads={threads}");
        refused(&["design", "--out", "x", &flag], 2, &words);
        refused(&["select", "--data", "x.npz", &flag], 2, &words);
    }
}

#[cfg(all(feature = "studio", target_os = "linux"))]
#[test]
fn without_a_display_it_says_what_to_do() {
    let output = hapdef(&[]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    for word in ["DISPLAY", "`hapdef design --out DIR`"] {
        assert!(said.contains(word), "{said}");
    }
    assert!(!said.contains(".rs") && !said.contains(".."), "{said}");
}

#[test]
fn a_summary_tells_of_the_gauges_that_were_asked_for_and_other_files_are_left_alone() {
    let (folder, project) = project(|t| {
        t.replace("\"standard\"", "\"draft\"")
            .replace("count = 4000", "count = 200")
            .replace("spacing_mm = 2.1", "spacing_mm = 4.1")
            .replace("compare = true", "compare = false")
    });
    let out = folder.path().join("report");
    let design = |sensors: &str| {
        let arguments = ["design", text(&project), "--selector", "pca-qr", "--out"];
        let more = [text(&out), "--sensors", sensors];
        let run = hapdef(&[&arguments[..], &more].concat());
        assert!(run.status.success(), "{run:?}");
        String::from_utf8_lossy(&run.stdout).into_owned()
    };
    let said = design("8");
    assert!(said.contains("pca-qr,   8 gauges"), "{said}");
    // What is somebody's own stays, and so does what he has made of the project.
    let own = out.join("notes.txt");
    std::fs::write(&own, "own").unwrap();
    let written = out.join("design.hapdef.toml");
    let changed = std::fs::read_to_string(&written).unwrap() + "# changed\n";
    std::fs::write(&written, &changed).unwrap();
    let said = design("6");
    assert!(said.contains("pca-qr,   6 gauges"), "{said}");
    assert_eq!(std::fs::read_to_string(&own).unwrap(), "own");
    let backup = out.join("design.hapdef.toml.bak");
    assert_eq!(std::fs::read_to_string(backup).unwrap(), changed);
    let mut names: Vec<String> = (std::fs::read_dir(&out).unwrap())
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let files = "bill.csv dataset.npz design.hapdef.toml design.hapdef.toml.bak design.json gauges.urdf hapd_config.h jig notes.txt report.html report.pdf scene.glb sites.csv template.pdf wiring.csv zones.csv";
    assert_eq!(names.join(" "), files);
}

#[test]
fn a_folder_that_another_writes_into_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("trade");
    std::fs::create_dir(&out).unwrap();
    let other = hapdef::io::together::Together::claim(&out).unwrap();
    for command in ["trade", "design"] {
        let words = [text(&out), "another hapdef", "choose another folder"];
        refused(&[command, "--out", text(&out)], 1, &words);
    }
    drop(other);
    // Asking what was measured disturbs nobody, and answers at once.
    let arguments = ["trade", "--within-s", "10", "--out", text(&out)];
    refused(&arguments, 1, &["nothing is measured there yet"]);
}

#[test]
fn rows_that_are_off_are_listed_and_left_out() {
    let (folder, project) = project(|t| t.replace("\"standard\"", "\"draft\""));
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let touches = file("t.csv", &format!("{TOUCHES}80,0,60,1,0,0,10,5\n"));
    // Along the wall; 20° out of it; 45°; and far away, below a remark.
    let sites = file(
        "s.csv",
        "x_mm,y_mm,z_mm,dx,dy,dz\n31.8,0,60,0,0,1\n31.8,0,60,0.342,0,0.94\n31.8,0,60,1,0,1\n# away\n31.8,0,1e6,0,0,1\n",
    );
    let run = |out: &Path, more: &[&str]| {
        let given = [
            "simulate",
            text(&project),
            "--touches",
            text(&touches),
            "--sites",
            text(&sites),
            "--out",
            text(out),
        ];
        hapdef(&[&given[..], more].concat())
    };
    let out = folder.path().join("r.csv");
    let output = run(&out, &["--json"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    for words in [
        "t.csv, line 4: touch 2 lies",
        "s.csv, line 4: the direction of site 2 points 45° out",
        "s.csv, line 6: site 3 lies",
        "s.csv, line 3: site 1: its direction points 20° out",
        "1 of 3 touches and 2 of 4 sites left out",
    ] {
        let lines = said.lines().filter(|line| line.contains(words)).count();
        assert_eq!(lines, 1, "{words}: {said}");
    }
    let result = std::fs::read_to_string(&out).unwrap();
    let (remarks, rows): (Vec<&str>, Vec<&str>) =
        result.lines().skip(1).partition(|l| l.starts_with('#'));
    assert_eq!(remarks.len(), 3, "{result}");
    let answered: Vec<String> = (rows.iter())
        .map(|row| row.split(',').take(2).collect::<Vec<_>>().join(","))
        .collect();
    assert_eq!(answered, ["0,0", "0,1", "1,0", "1,1"]);
    // Laid into the surface, the second reads what the first does.
    let strain = |row: &str| row.split(',').nth(5).unwrap().parse::<f64>().unwrap();
    assert!(
        (strain(rows[0]) / strain(rows[1]) - 1.0).abs() < 0.02,
        "{result}"
    );
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["left_out"].as_array().unwrap().len(), 3);
    assert_eq!(summary["left_out"][1]["line"], 4);
    // As arrays, the rows keep their places.
    let arrays = folder.path().join("r.npz");
    assert!(run(&arrays, &[]).status.success());
    let arrays = zip::ZipArchive::new(std::fs::File::open(&arrays).unwrap()).unwrap();
    for name in [
        "touch_left_out.npy",
        "site_left_out.npy",
        "site_angle_deg.npy",
    ] {
        assert!(arrays.index_for_name(name).is_some(), "{name}");
    }
    // Asked to be strict, it stops at the first, before anything is computed or written.
    let never = folder.path().join("never.csv");
    let output = run(&never, &["--strict"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("t.csv, line 4: touch 2 lies"), "{said}");
    assert!(!said.contains("site 2") && !never.exists(), "{said}");
}
