//! `hapdef select` and `hapdef evaluate` on data without a part, through the real program.
#![allow(
    clippy::format_push_string,
    reason = "small files are put together here"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapdef::io::npz::NpzFile;
use serde_json::Value;

const SITES: usize = 24;
const TOUCHES: usize = 150;

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = hapdef(&[arguments, &["--json"]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn refused(arguments: &[&str], word: &str) {
    let output = hapdef(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    assert!(
        said.contains(word) && !said.contains("panicked"),
        "{word}: {said}"
    );
}

fn indices(value: &Value) -> Vec<u64> {
    let sites = value["sites"].as_array().unwrap();
    sites.iter().map(|s| s["index"].as_u64().unwrap()).collect()
}

/// A plate whose sites feel what presses near them.
fn signals() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let at = |k: usize, a: f64, b: f64| {
        [
            0.1 * ((k + 1) as f64 * a).fract(),
            0.06 * ((k + 1) as f64 * b).fract(),
            0.0,
        ]
    };
    let sites: Vec<[f64; 3]> = (0..SITES).map(|k| at(k, 0.6180, 0.4142)).collect();
    let touches: Vec<[f64; 3]> = (0..TOUCHES).map(|k| at(k, 0.7549, 0.5698)).collect();
    let x = sites
        .iter()
        .flat_map(|s| {
            touches.iter().map(move |t| {
                let d = (s[0] - t[0]).powi(2) + 2.0 * (s[1] - t[1]).powi(2);
                (-d / 0.0012).exp() + 0.3 * (30.0 * (s[0] - t[0])).sin()
            })
        })
        .collect();
    (x, touches.concat(), sites.concat())
}

fn dataset(folder: &Path, with_sites: bool) -> PathBuf {
    let (x, p, s) = signals();
    let mut file = NpzFile::default();
    file.add("X", &[SITES, TOUCHES], &x).unwrap();
    file.add("p_m", &[TOUCHES, 3], &p).unwrap();
    if with_sites {
        file.add("site_m", &[SITES, 3], &s).unwrap();
        let cost: Vec<f64> = (0..SITES).map(|k| 1.0 + (k % 3) as f64).collect();
        file.add("cost", &[SITES], &cost).unwrap();
    }
    let path = folder.join(if with_sites { "d.npz" } else { "bare.npz" });
    file.save(&path).unwrap();
    path
}

#[test]
fn every_selector_answers_in_the_same_shape() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    for selector in ["greedy-svr", "pca-qr", "entropy", "mutual-information"] {
        let arguments = [
            "select",
            "--data",
            data,
            "--selector",
            selector,
            "--sensors",
            "4",
            "--require",
            "7",
            "--keep-out",
            "1,2",
            "--spacing-mm",
            "8",
        ];
        let answer = json(&arguments);
        let chosen = indices(&answer);
        assert_eq!(chosen.len(), 4, "{selector}");
        assert_eq!(chosen[0], 7);
        assert!(!chosen.contains(&1) && !chosen.contains(&2));
        let criteria = answer["criterion_mm"].as_array().unwrap();
        assert_eq!(criteria.len(), 4);
        assert!(
            criteria.iter().all(|c| c.as_f64().unwrap() > 0.0),
            "{answer}"
        );
        assert!(answer["cpu_seconds"].is_number());
        assert!(answer["achieved"]["stop_reason"].is_string());
        assert_eq!(answer["fold_of_touch"].as_array().unwrap().len(), TOUCHES);
        let geometry = &answer["geometry"]["distance"];
        assert_eq!(
            geometry.is_string(),
            ["entropy", "mutual-information"].contains(&selector)
        );
        // The same again, to the byte, whatever the threads, but for the time it took.
        let mut again = json(&[&arguments[..], &["--threads", "1"]].concat());
        let mut first = answer.clone();
        for a in [&mut first, &mut again] {
            for key in [
                "cpu_seconds",
                "distance_cpu_seconds",
                "kernel_search_cpu_seconds",
                "criterion_cpu_seconds",
            ] {
                a[key] = Value::Null;
            }
        }
        assert_eq!(first, again);
    }
}

#[test]
fn metres_and_millimetres_are_the_same_model() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    let metres = json(&[
        "select",
        "--data",
        data,
        "--sensors",
        "3",
        "--target-unit",
        "m",
    ]);
    let millimetres = json(&[
        "select",
        "--data",
        data,
        "--sensors",
        "3",
        "--c",
        "20000",
        "--epsilon",
        "0.001",
        "--gamma",
        "0.002",
    ]);
    assert_eq!(metres["steps"], millimetres["steps"]);
    let few = json(&[
        "select",
        "--data",
        data,
        "--sensors",
        "9",
        "--cost-budget",
        "5",
    ]);
    let spent: f64 = indices(&few).iter().map(|k| 1.0 + (k % 3) as f64).sum();
    assert!(spent <= 5.0);
}

#[test]
fn sites_are_judged_with_failures_and_a_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let answer = json(&[
        "evaluate",
        "--data",
        data.to_str().unwrap(),
        "--sites",
        "3,9,14,20",
        "--baseline",
        "--tune",
        "--failed",
        "2",
        "--noise",
        "0.001",
    ]);
    let errors = answer["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 4);
    let mean = |v: &Value| v["error_mm"].as_f64().unwrap();
    assert!(mean(&errors[3]) < mean(&errors[0]));
    assert!(mean(&answer["baseline"]) < mean(&errors[3]));
    assert_eq!(answer["criterion_mm"].as_array().unwrap().len(), 4);
    let failures = answer["failures"].as_array().unwrap();
    assert_eq!(failures.len(), 5);
    assert!(
        failures
            .iter()
            .skip(1)
            .all(|f| mean(f) >= mean(&failures[0]) * 0.99)
    );
    assert_eq!(answer["test_touches"].as_array().unwrap().len(), 23);
}

#[test]
fn a_csv_says_the_same_as_an_npz() {
    let folder = tempfile::tempdir().unwrap();
    let npz = dataset(folder.path(), true);
    let (x, p, s) = signals();
    let mut text = String::from("x_mm,y_mm,z_mm,cost");
    for t in 0..TOUCHES {
        text += &format!(",t{t}");
    }
    text.push('\n');
    for k in 0..SITES {
        let place: Vec<String> = s[3 * k..3 * k + 3]
            .iter()
            .map(|v| (v * 1e3).to_string())
            .collect();
        let row: Vec<String> = x[k * TOUCHES..(k + 1) * TOUCHES]
            .iter()
            .map(f64::to_string)
            .collect();
        text += &format!("{},{},{}\n", place.join(","), 1 + k % 3, row.join(","));
    }
    let csv = folder.path().join("d.csv");
    std::fs::write(&csv, text).unwrap();
    let touches = folder.path().join("t.csv");
    let rows: Vec<String> = p
        .chunks(3)
        .map(|p| format!("{},{},{}", p[0] * 1e3, p[1] * 1e3, p[2] * 1e3))
        .collect();
    std::fs::write(&touches, format!("x_mm,y_mm,z_mm\n{}\n", rows.join("\n"))).unwrap();
    let a = json(&["select", "--data", npz.to_str().unwrap(), "--sensors", "3"]);
    let b = json(&[
        "select",
        "--data",
        csv.to_str().unwrap(),
        "--touches",
        touches.to_str().unwrap(),
        "--sensors",
        "3",
    ]);
    assert_eq!(indices(&a), indices(&b));
}

#[test]
fn what_cannot_be_done_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    let bare = dataset(folder.path(), false);
    let bare = bare.to_str().unwrap();
    refused(
        &["select", "--data", bare, "--selector", "entropy"],
        "site_m",
    );
    refused(&["select", "--data", bare, "--spacing-mm", "5"], "site_m");
    refused(&["select", "--data", data, "--sensors", "25"], "25 gauges");
    refused(&["select", "--data", data, "--gamma", "0"], "--gamma");
    refused(&["select", "--data", data, "--require", "99"], "24 sites");
    refused(
        &[
            "select",
            "--data",
            data,
            "--selector",
            "pca-qr",
            "--failure",
            "0.2",
        ],
        "greedy SVR",
    );
    refused(&["evaluate", "--data", data, "--sites", "1,1"], "twice");
    refused(&["evaluate", "--data", data, "--sites", "77"], "24 sites");
    refused(&["select", "--data", "nowhere.npz"], "no such file");
    let broken = folder.path().join("b.npz");
    std::fs::write(&broken, b"PK but not really").unwrap();
    refused(&["select", "--data", broken.to_str().unwrap()], "NPZ");
    let mut file = NpzFile::default();
    file.add("X", &[2, 3], &[1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0])
        .unwrap();
    file.add("p_m", &[3, 3], &[0.0; 9]).unwrap();
    let wild = folder.path().join("w.npz");
    file.save(&wild).unwrap();
    refused(
        &["select", "--data", wild.to_str().unwrap()],
        "site 0 under touch 2",
    );
}
