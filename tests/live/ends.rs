//! The whole pipeline at its ends, through the program: a right answer or a plain refusal.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

/// A coarse limb's project in a folder, with lines of it replaced.
fn project(folder: &Path, changes: &[(&str, &str)]) -> String {
    let out = folder.to_str().unwrap();
    let made = hapdef(&["limb", "--out", out, "--element", "6", "--no-sites"]);
    assert!(made.status.success(), "{made:?}");
    let path = folder.join("limb.hapdef.toml");
    let mut text = std::fs::read_to_string(&path).unwrap();
    let usual = [
        ("count = 4000", "count = 200"),
        ("spacing_mm = 2.1", "spacing_mm = 4.1"),
        ("edge_radius_mm = 2.1", "edge_radius_mm = 4.0"),
        ("sensors = 10", "sensors = 3"),
    ];
    for (from, to) in usual.iter().chain(changes) {
        assert!(text.contains(from), "{from} is not in the project");
        text = text.replacen(from, to, 1);
    }
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn design(folder: &Path, changes: &[(&str, &str)], more: &[&str]) -> Result<Value, String> {
    let project = project(folder, changes);
    let out = folder.join("report");
    let mut arguments = vec!["design", &project, "--json"];
    if !more.contains(&"--quality") {
        arguments.extend(["--quality", "draft"]);
    }
    let out_name = out.to_str().unwrap().to_owned();
    arguments.extend(["--out", &out_name]);
    arguments.extend(more);
    let done = hapdef(&arguments);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(!said.contains("panicked"), "{said}");
    if done.status.success() {
        Ok(serde_json::from_slice(&done.stdout).unwrap())
    } else {
        assert_eq!(done.status.code(), Some(1), "{said}");
        assert!(said.lines().any(|l| l.starts_with("hapdef: ")), "{said}");
        Err(said)
    }
}

/// Every error that is stated is a number, and there is one for each of so many gauges.
fn sound(summary: &Value, gauges: usize) {
    assert_eq!(summary["sites"].as_array().unwrap().len(), gauges);
    let rows = summary["evaluation"].as_array().unwrap();
    assert!(!rows.is_empty());
    for row in rows {
        assert!(
            row["error_mm"].as_f64().is_some_and(f64::is_finite),
            "{row}"
        );
    }
}

#[test]
fn one_gauge_and_as_many_as_candidates() {
    let folder = tempfile::tempdir().unwrap();
    sound(
        &design(folder.path(), &[("sensors = 3", "sensors = 1")], &[]).unwrap(),
        1,
    );
    let all = [
        ("sensors = 3", "sensors = 12"),
        ("unexplained = 0.01", "unexplained = 0.01\ncount = 12"),
    ];
    let summary = design(folder.path(), &all, &[]).unwrap();
    sound(&summary, 12);
    assert_eq!(summary["counts"]["candidates"], 12);
}

#[test]
fn three_touches_and_forty_thousand() {
    let folder = tempfile::tempdir().unwrap();
    let few = design(folder.path(), &[("count = 200", "count = 3")], &[]).unwrap_err();
    assert!(few.contains("3 touches are too few"), "{few}");
    let many = [("count = 200", "count = 40000")];
    let summary = design(folder.path(), &many, &[]).unwrap();
    sound(&summary, 3);
    let notes = summary["achieved"]["notes"].to_string();
    assert!(notes.contains("instead of the project's 40000"), "{notes}");
    // Where all of them are asked for, memory is the limit, and that is said before it is taken.
    let refused = design(folder.path(), &many, &["--quality", "standard"]);
    let refused = refused.map_or_else(|said| said, |_| String::new());
    assert!(refused.contains("lower touch.count"), "{refused}");
}

#[test]
fn noise_of_zero_and_above_the_signal() {
    let folder = tempfile::tempdir().unwrap();
    let none = [("noise_microstrain = 1.0", "noise_microstrain = 0.0")];
    sound(&design(folder.path(), &none, &[]).unwrap(), 3);
    let all = [("noise_microstrain = 1.0", "noise_microstrain = 1000000.0")];
    let refused = design(folder.path(), &all, &[]).unwrap_err();
    assert!(refused.contains("no site is feasible"), "{refused}");
    // Where no signal to noise is asked for, the noise is learned from: nothing can be told, and that is the answer.
    let deaf = [
        ("noise_microstrain = 1.0", "noise_microstrain = 1000000.0"),
        ("least_signal_to_noise = 3.0", "least_signal_to_noise = 0.0"),
    ];
    let summary = design(folder.path(), &deaf, &[]).unwrap();
    sound(&summary, 3);
    let rows = summary["evaluation"].as_array().unwrap();
    let worst = rows
        .iter()
        .map(|r| r["error_mm"].as_f64().unwrap())
        .fold(0.0, f64::max);
    assert!(
        worst > 30.0,
        "nothing can be told, but the error is {worst} mm"
    );
}

#[test]
fn forces_of_a_billionth_and_of_a_billion_newtons() {
    let folder = tempfile::tempdir().unwrap();
    let faint = [
        ("force_n = 10.0", "force_n = 1e-9"),
        ("noise_microstrain = 1.0", "noise_microstrain = 1e-10"),
    ];
    sound(&design(folder.path(), &faint, &[]).unwrap(), 3);
    let huge = [
        ("force_n = 10.0", "force_n = 1e9"),
        ("noise_microstrain = 1.0", "noise_microstrain = 1e8"),
        ("range_microstrain = 30000.0", "range_microstrain = 1e20"),
    ];
    let summary = design(folder.path(), &huge, &[]).unwrap();
    sound(&summary, 3);
    // The figures are those of a linear model far beyond where it holds, and say so.
    let doubts = summary["doubts"].to_string();
    assert!(doubts.contains("Lower the force"), "{doubts}");
}

#[test]
fn no_time_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path(), &[]);
    let out = folder.path().join("trade");
    let out = out.to_str().unwrap();
    let none = hapdef(&["trade", &project, "--out", out, "--points", "0"]);
    assert!(none.status.success(), "{none:?}");
    let asked = hapdef(&["trade", &project, "--out", out, "--within-s", "0"]);
    let said = String::from_utf8_lossy(&asked.stderr);
    assert_eq!(asked.status.code(), Some(1));
    assert!(said.contains("nothing is measured there yet"), "{said}");
}

#[test]
fn the_same_bytes_with_one_two_and_eight_threads() {
    let folder = tempfile::tempdir().unwrap();
    let files = |threads: &str| {
        let all = [("compare = false", "compare = true")];
        let summary = design(folder.path(), &all, &["--threads", threads, "--seed", "7"]).unwrap();
        let read = |name: &str| std::fs::read(folder.path().join("report").join(name)).unwrap();
        let (data, sites) = (read("dataset.npz"), read("sites.csv"));
        (
            data,
            sites,
            summary["selections"].clone(),
            summary["evaluation"].clone(),
        )
    };
    let one = files("1");
    for threads in ["2", "8"] {
        assert!(files(threads) == one, "{threads} threads");
    }
}

/// Constant counts from every gauge, before and after a press that would have been felt: no touch is made up.
#[test]
fn all_channels_dead() {
    use hapdef::inference::ResponseMap;
    use hapdef::live::{Pipeline, PipelineSettings, Sample};
    use std::sync::Arc;

    const GAUGES: usize = 4;
    let (mesh, _) = hapdef::limb::LimbSpec {
        element: 6.0,
        ..hapdef::limb::LimbSpec::default()
    }
    .build()
    .unwrap();
    let nodes = mesh.positions().len() + mesh.edges().len();
    let value = |k: usize| 1e-5 * (1.7 * k as f64).sin();
    let values = (0..nodes * GAUGES).map(value).collect();
    let map = Arc::new(ResponseMap::of(Arc::new(mesh), GAUGES, values));
    let mut pipeline = Pipeline::new(map, PipelineSettings::of(GAUGES));
    pipeline.tare();
    for k in 0..4000_u64 {
        let sample = Sample {
            time_us: k * 1000,
            counts: vec![32_768.0; GAUGES],
        };
        let update = pipeline.push(&sample);
        assert!(update.contact.is_none(), "sample {k}: {update:?}");
        assert!(update.guesses.iter().flatten().next().is_none());
    }
}

/// A box (mm) as the mesh of a project, its last vertex moved; what the program says to it.
fn boxed(folder: &Path, sides: [f64; 3], last: [f64; 3], model: &str) -> String {
    use std::fmt::Write as _;

    let mut text = String::new();
    for k in 0..8_u32 {
        let corner: [f64; 3] = std::array::from_fn(|i| f64::from(k >> i & 1) * sides[i]);
        let [x, y, z] = if k == 7 { last } else { corner };
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c, d] in [
        [1, 3, 4, 2],
        [5, 6, 8, 7],
        [1, 2, 6, 5],
        [3, 7, 8, 4],
        [1, 5, 7, 3],
        [2, 4, 8, 6],
    ] {
        let _ = writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}");
    }
    std::fs::write(folder.join("box.obj"), text).unwrap();
    let project = folder.join("box.hapdef.toml");
    let keys = format!(
        "format = 1\n[part]\nmesh = \"box.obj\"\nunit = \"mm\"\nmodel = \"{model}\"\nthickness_mm = 1.5\n[[support]]\nkind = \"clamped\"\nbox_mm = [[-1, -1, -1], [1, 1e6, 1e6]]\n[budget]\nquality = \"draft\"\n"
    );
    std::fs::write(&project, keys).unwrap();
    let out = folder.join("x.npz");
    let done = hapdef(&[
        "simulate",
        project.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(1), "{said}");
    // It is refused before anything is computed.
    assert!(!said.contains("Assembling") && !out.exists(), "{said}");
    said
}

/// One vertex in a wrong place asks for more than any machine has: it is named before anything is begun.
#[test]
fn one_vertex_far_away() {
    let folder = tempfile::tempdir().unwrap();
    let sides = [60.0, 30.0, 20.0];
    for model in ["shell", "solid"] {
        let said = boxed(folder.path(), sides, [1e7, 30.0, 20.0], model);
        let words = [
            "one vertex",
            "10000000.000",
            "9999940.000",
            "remove or move it",
        ];
        for word in words {
            assert!(said.contains(word), "{word} is not in: {said}");
        }
    }
    // Too large as a whole, and nothing is far from the rest: as many sites as that are refused by their number.
    let large = boxed(folder.path(), [6e4, 3e4, 2e4], [6e4, 3e4, 2e4], "shell");
    assert!(large.contains("sites at a spacing"), "{large}");
}

/// A part that is next to nothing but long has no elements of its own scale.
#[test]
fn a_part_as_thin_as_a_thread() {
    let folder = tempfile::tempdir().unwrap();
    let sides = [1e7, 5e-3, 5e-3];
    for model in ["shell", "solid"] {
        let said = boxed(folder.path(), sides, sides, model);
        assert!(said.contains("too slender"), "{said}");
        assert!(said.contains("10000000.000 mm"), "{said}");
    }
}

/// Where the machine has no memory left in the middle of the work, whatever may be taken: a message and no abort.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_ends_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("limb");
    // Two million triangles in 200 MB of address space.
    let done = Command::new("sh")
        .args(["-c", "ulimit -v 200000 && exec \"$@\"", "sh"])
        .arg(env!("CARGO_BIN_EXE_hapdef"))
        .args(["limb", "--element", "0.15", "--no-sites"])
        .args(["--memory-gb", "100", "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.starts_with("hapdef: the machine has no "), "{said}");
    assert!(said.contains("MB of memory left. Lower"), "{said}");
    assert!(!out.exists());
}

/// What lies where files are to be written may be anybody's, and may be no file at all: it stays, and nothing waits.
#[cfg(target_os = "linux")]
#[test]
fn what_is_no_file_is_neither_read_nor_written_over() {
    use hapdef::cli::examples::write_bundled_mesh;
    use hapdef::io::trade_file;
    use rustix::fs::{CWD, Mode, mkfifoat};

    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (mesh, trade) = (at("limb.glb"), at("trade.json"));
    let refused = |word: &str| {
        let said = write_bundled_mesh(folder.path(), Path::new("limb.glb"))
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("limb.glb") && said.contains("another folder"),
            "{said}"
        );
        let said = trade_file::read(folder.path()).unwrap_err().to_string();
        assert!(said.contains("trade.json") && said.contains(word), "{said}");
    };
    for path in [&mesh, &trade] {
        std::fs::create_dir(path).unwrap();
    }
    refused("this is a folder");
    for path in [&mesh, &trade] {
        std::fs::remove_dir(path).unwrap();
        mkfifoat(CWD, path, Mode::RUSR | Mode::WUSR).unwrap();
    }
    refused("this is a pipe");
    for path in [&mesh, &trade] {
        std::fs::remove_file(path).unwrap();
    }
    assert!(trade_file::read(folder.path()).unwrap().is_none());
    for _ in 0..2 {
        assert_eq!(
            write_bundled_mesh(folder.path(), Path::new("limb.glb")).unwrap(),
            mesh
        );
    }
}
