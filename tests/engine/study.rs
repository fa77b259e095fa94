//! `hapdef select` and `hapdef evaluate` on data without a part, through the real program.
#![allow(
    clippy::format_push_string,
    reason = "small files are put together here"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapdef::io::npz::NpzFile;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
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
    ends(arguments, 1, word);
}

/// Flags that cannot be meant.
fn misused(arguments: &[&str], word: &str) {
    ends(arguments, 2, word);
}

fn ends(arguments: &[&str], code: i32, word: &str) {
    let output = hapdef(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
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
    for selector in [
        "greedy-svr",
        "pca-qr",
        "entropy",
        "mutual-information",
        "expected-error",
    ] {
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
        // Nothing is trained for a choice by expected error, and nothing held out.
        let trained = selector != "expected-error";
        let folds = answer["fold_of_touch"].as_array().map(Vec::len);
        assert_eq!(folds, trained.then_some(TOUCHES), "{selector}");
        assert_eq!(answer["criterion"]["c_mm"].is_number(), trained);
        assert_eq!(answer["criterion"]["scatter_percent"].is_array(), !trained);
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
    assert!(!notes(&answer).contains("--max-steps"));
    // Regressions that were not let come to their end are no measure of the sites.
    let data = data.to_str().unwrap();
    let hurried = ["--sites", "3,9", "--max-steps", "1"];
    let answer = json(&[&["evaluate", "--data", data][..], &hurried].concat());
    assert!(notes(&answer).contains("--max-steps"), "{answer}");
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
    misused(&["select", "--data", data, "--gamma", "0"], "--gamma");
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

#[test]
fn what_the_data_do_not_bear_is_said_with_their_file() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let bare = dataset(folder.path(), false);
    let (data, bare) = (data.to_str().unwrap(), bare.to_str().unwrap());
    let out = folder.path().join("sites.csv");
    let cases: [(&str, &str, &[&str]); 8] = [
        ("select", bare, &["--selector", "entropy"]),
        ("select", bare, &["--spacing-mm", "5"]),
        ("select", bare, &["--inside", "0,0,0,1,1,1"]),
        ("select", bare, &["--out", out.to_str().unwrap()]),
        ("select", data, &["--sensors", "25"]),
        ("select", data, &["--require", "99"]),
        ("evaluate", data, &["--sites", "77"]),
        ("evaluate", data, &["--sites", "1,1"]),
    ];
    for (command, data, more) in cases {
        let arguments = [&[command, "--data", data][..], more].concat();
        refused(&arguments, &format!("{data}: "));
    }
    assert!(!out.exists());
    let one = hapdef(&[
        "select",
        "--data",
        data,
        "--selector",
        "pca-qr",
        "--sensors",
        "1",
    ]);
    let said = String::from_utf8(one.stdout).unwrap();
    assert!(said.starts_with("1 gauge"), "{said}");
    assert!(!said.contains("1 gauges"), "{said}");
}

/// The same plate with other places of touches (m) and signals, in a file of its own.
fn saved(folder: &Path, name: &str, x: &[f64], p: &[f64]) -> String {
    saved_with(folder, name, x, p, &signals().2)
}

/// As [`saved`], with sites at places of their own.
fn saved_with(folder: &Path, name: &str, x: &[f64], p: &[f64], s: &[f64]) -> String {
    let touches = p.len() / 3;
    let mut file = NpzFile::default();
    file.add("X", &[SITES, touches], x).unwrap();
    file.add("p_m", &[touches, 3], p).unwrap();
    file.add("site_m", &[SITES, 3], s).unwrap();
    let path = folder.join(name);
    file.save(&path).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The first touches of the plate.
fn first_touches(folder: &Path, count: usize) -> String {
    let (x, p, _) = signals();
    let rows = x.chunks(TOUCHES).flat_map(|row| &row[..count]);
    let x: Vec<f64> = rows.copied().collect();
    saved(folder, &format!("{count}.npz"), &x, &p[..3 * count])
}

fn notes(answer: &Value) -> String {
    let notes = answer["notes"].as_array().unwrap();
    let notes: Vec<&str> = notes.iter().map(|n| n.as_str().unwrap()).collect();
    notes.join("\n")
}

fn numbers(value: &Value) -> Vec<f64> {
    let values = value.as_array().unwrap();
    values.iter().map(|v| v.as_f64().unwrap()).collect()
}

const SELECTORS: [&str; 4] = ["greedy-svr", "pca-qr", "entropy", "mutual-information"];

#[test]
fn a_site_that_never_changes_is_chosen_only_where_it_must_be_and_ends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut x, p, _) = signals();
    x[3 * TOUCHES..4 * TOUCHES].fill(7e-4);
    x[9 * TOUCHES..10 * TOUCHES].fill(0.0);
    let data = saved(folder.path(), "c.npz", &x, &p);
    let data = data.as_str();
    for selector in SELECTORS {
        let base = ["select", "--data", data, "--selector", selector];
        let free = json(&[&base[..], &["--sensors", "6"]].concat());
        let chosen = indices(&free);
        assert_eq!(chosen.len(), 6, "{selector}");
        assert!(!chosen.contains(&3) && !chosen.contains(&9), "{selector}");
        assert!(
            notes(&free).contains("2 sites with the same report"),
            "{free}"
        );
        let bound = json(&[&base[..], &["--sensors", "4", "--require", "3"]].concat());
        let chosen = indices(&bound);
        assert_eq!((chosen.len(), chosen[0]), (4, 3), "{selector}");
        assert!(notes(&bound).contains("Site 3 must be there"), "{bound}");
        assert!(
            notes(&bound).contains("1 site with the same report"),
            "{bound}"
        );
        let mm = numbers(&bound["criterion_mm"]);
        assert!(mm[3] < 0.8 * mm[0], "{selector}: {mm:?}");
    }
    let judged = json(&["evaluate", "--data", data, "--sites", "3,0,5"]);
    let said = notes(&judged);
    assert!(said.contains("Site 3 reports the same"), "{said}");
    x.fill(1.0);
    let data = saved(folder.path(), "all.npz", &x, &p);
    let data = data.as_str();
    for selector in SELECTORS {
        refused(
            &["select", "--data", data, "--selector", selector],
            "no site's signal varies",
        );
    }
}

#[test]
fn spacing_that_cannot_be_met_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    for selector in SELECTORS {
        let answer = json(&[
            "select",
            "--data",
            data,
            "--selector",
            selector,
            "--sensors",
            "12",
            "--spacing-mm",
            "45",
        ]);
        let reached = indices(&answer).len();
        assert!((1..12).contains(&reached), "{selector}");
        assert_eq!(answer["achieved"]["stop_reason"], "no-room", "{selector}");
        let said = notes(&answer);
        assert!(
            said.contains(&format!("Only {reached} of 12 gauges fit"))
                && said.contains("nearer than 45 mm")
                && said.contains("lower the spacing"),
            "{selector}: {said}"
        );
    }
    refused(
        &["select", "--data", data, "--cost-budget", "0.5"],
        "raise the budget",
    );
    let out = "0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23";
    refused(&["select", "--data", data, "--keep-out", out], "kept out");
}

#[test]
fn too_few_touches_are_refused_with_how_many_would_do() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let one = first_touches(folder, 1);
    let one = one.as_str();
    for selector in SELECTORS {
        let arguments = ["select", "--data", one, "--selector", selector];
        refused(
            &[&arguments[..], &["--sensors", "2"]].concat(),
            "one touch only",
        );
    }
    refused(
        &["evaluate", "--data", one, "--sites", "0,1"],
        "one touch only",
    );
    // What is asked for is what does.
    let eleven = first_touches(folder, 11);
    let flags = ["evaluate", "--data", eleven.as_str(), "--sites", "0,1"];
    refused(&flags, "11 touches are too few");
    refused(&flags, "at least 12 are needed");
    let twelve = first_touches(folder, 12);
    let judged = json(&["evaluate", "--data", &twelve, "--sites", "0,1"]);
    assert_eq!(judged["test_touches"].as_array().unwrap().len(), 2);
    let all = dataset(folder, true);
    let all = all.to_str().unwrap();
    for selector in ["greedy-svr", "pca-qr"] {
        refused(
            &[
                "select",
                "--data",
                all,
                "--selector",
                selector,
                "--folds",
                "80",
            ],
            "at least 160 are needed, or fewer folds",
        );
    }
    // Touches that all lie at one place are one.
    let (x, _, _) = signals();
    let same = saved(folder, "same.npz", &x, &[0.01; 3 * TOUCHES]);
    refused(&["select", "--data", &same], "touches lie at one place");
    refused(
        &["evaluate", "--data", &same, "--sites", "0,1"],
        "one place",
    );
}

#[test]
fn numbers_that_cannot_be_meant_are_refused_as_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    let wrong = [
        ("select", "--target-mm", "nan"),
        ("select", "--target-mm", "0"),
        ("select", "--cost-budget", "inf"),
        ("select", "--spacing-mm", "nan"),
        ("select", "--failure", "1.5"),
        ("select", "--power", "3"),
        ("select", "--length-mm", "nan"),
        ("select", "--kernel-noise", "inf"),
        ("select", "--inside", "0,0,0,nan,1,1"),
        ("select", "--selection-tolerance", "1"),
        ("select", "--landmarks", "0"),
        ("select", "--sensors", "0"),
        ("select", "--c", "1e300"),
        ("select", "--epsilon", "nan"),
        ("select", "--gamma", "inf"),
        ("select", "--tolerance", "0"),
        ("select", "--folds", "1"),
        ("select", "--max-steps", "0"),
        ("select", "--noise", "nan"),
        ("select", "--place-mm", "0"),
        ("evaluate", "--held-out", "nan"),
        ("evaluate", "--held-out", "1"),
        ("evaluate", "--subsets", "0"),
        ("evaluate", "--c", "nan"),
    ];
    for (command, flag, value) in wrong {
        let mut arguments = vec![command, "--data", data, flag, value];
        if command == "evaluate" {
            arguments.extend(["--sites", "0,1"]);
        }
        misused(&arguments, flag);
    }
    // Finite, but beyond what can be computed with for touches of this size.
    misused(&["select", "--data", data, "--c", "9e8"], "--c");
    // And finer than rounding, so that no fit would end.
    let finest = ["--c", "5e6", "--tolerance", "1e-12"];
    let finest: Vec<&str> = ["select", "--data", data]
        .into_iter()
        .chain(finest)
        .collect();
    misused(&finest, "--tolerance");
    refused(&["select", "--data", data, "--keep-out", "99"], "24 sites");
}

#[test]
fn sites_that_never_change_are_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let (mut file, path) = (NpzFile::default(), folder.path().join("same.npz"));
    let places: Vec<f64> = (0..60).map(|k| f64::from(k % 20) * 1e-3).collect();
    file.add("X", &[3, 20], &[7.5_f64; 60]).unwrap();
    file.add("p_m", &[20, 3], &places).unwrap();
    file.save(&path).unwrap();
    let data = path.to_str().unwrap();
    for estimator in ["svr", "matching", "nearest"] {
        let how = [
            "evaluate", "--data", data, "--sites", "0,2", "--noise", "1e-6",
        ];
        let arguments = [&how[..], &["--estimator", estimator]].concat();
        refused(&arguments, "no site's signal varies");
    }
}

#[test]
fn flags_without_effect_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    let idle: [(&str, &[&str]); 18] = [
        ("expected-error", &["--c", "100"]),
        ("expected-error", &["--epsilon", "1"]),
        ("expected-error", &["--gamma", "0.1"]),
        ("expected-error", &["--tolerance", "1"]),
        ("expected-error", &["--max-steps", "9"]),
        ("expected-error", &["--folds", "4"]),
        ("expected-error", &["--split", "touch"]),
        ("greedy-svr", &["--length-mm", "20"]),
        ("greedy-svr", &["--power", "1.5"]),
        ("greedy-svr", &["--kernel-noise", "0.1"]),
        ("greedy-svr", &["--no-criterion"]),
        ("pca-qr", &["--length-mm", "20"]),
        ("pca-qr", &["--landmarks", "2"]),
        ("entropy", &["--selection-tolerance", "0.1"]),
        ("mutual-information", &["--audit", "3"]),
        ("pca-qr", &["--no-criterion", "--target-mm", "5"]),
        ("pca-qr", &["--folds", "201", "--no-criterion"]),
        ("pca-qr", &["--split", "touch", "--place-mm", "5"]),
    ];
    for (selector, flags) in idle {
        let base = ["select", "--data", data, "--selector", selector];
        misused(&[&base[..], flags].concat(), flags[0]);
    }
}

#[test]
fn the_size_of_the_part_changes_nothing_but_the_size_of_the_errors() {
    let folder = tempfile::tempdir().unwrap();
    let (x, p, s) = signals();
    let asked = |by: f64| {
        let scaled = |of: &[f64]| -> Vec<f64> { of.iter().map(|v| v * by).collect() };
        let name = format!("{by}.npz");
        let data = saved_with(folder.path(), &name, &x, &scaled(&p), &scaled(&s));
        let chosen = json(&["select", "--data", &data, "--sensors", "3"]);
        let tuned = json(&["evaluate", "--data", &data, "--sites", "3,9,14", "--tune"]);
        let tuned = tuned["errors"].as_array().unwrap();
        let tuned: Vec<f64> = (tuned.iter())
            .map(|row| row["error_mm"].as_f64().unwrap())
            .collect();
        (indices(&chosen), numbers(&chosen["criterion_mm"]), tuned)
    };
    let off = |errors: &[f64], scaled: &[f64], by: f64| {
        let pairs = errors.iter().zip(scaled);
        pairs.fold(0.0, |most: f64, (e, s)| most.max((s / by / e - 1.0).abs()))
    };
    let (sites, criteria, tuned) = asked(1.0);
    // A power of two moves no digit; other factors move what fits leave open.
    for (by, within) in [(1.0 / 128.0, 1e-12), (0.01, 0.02), (100.0, 0.02)] {
        let (other_sites, other_criteria, other_tuned) = asked(by);
        assert_eq!(sites, other_sites, "{by}");
        assert!(off(&criteria, &other_criteria, by) < within, "{by}");
        assert!(off(&tuned, &other_tuned, by) < 5.0 * within, "{by}");
    }
    // What is given is taken as it is, and said where it cannot suit.
    let far = folder.path().join("100.npz");
    let far = far.to_str().unwrap();
    let given = json(&["select", "--data", far, "--sensors", "2", "--c", "200"]);
    assert_eq!(given["criterion"]["c_mm"], 200.0);
    assert!(notes(&given).contains("C (200 mm) is small"), "{given}");
}

/// A real skin that was pressed five times at each of 961 places: a tenth of the error goes where repeats are divided.
#[test]
fn a_measured_skin_is_judged_by_its_places() {
    let skin = "../shared/measured/eflesh_1.npz";
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(skin);
    if crate::is_missing(&path) {
        return;
    }
    let judge = |split: &str| {
        let data = path.to_str().unwrap();
        let base = ["evaluate", "--data", data, "--sites", "0,3,6,9,12,14"];
        json(&[&base[..], &["--estimator", "nearest", "--split", split]].concat())
    };
    let [together, apart] = ["place", "touch"].map(judge);
    assert_eq!(
        (&together["places"], &apart["places"]),
        (&961.into(), &4805.into())
    );
    // 1.69 and 1.46 mm when this was written.
    let last = |v: &Value| numbers(&v["criterion_mm"])[5];
    assert!(last(&together) > 1.1 * last(&apart), "{together} {apart}");
}

#[test]
fn repeats_of_a_place_are_judged_together() {
    /// Times that each place is pressed.
    const TURNS: usize = 3;
    let folder = tempfile::tempdir().unwrap();
    let places = TOUCHES / TURNS;
    let (x, p, _) = signals();
    // Each press is off by what a machine is off by, and deeper than the one before.
    let p: Vec<f64> = (0..TOUCHES)
        .flat_map(|t| {
            let place = &p[3 * (t % places)..][..3];
            let turn = (t / places) as f64;
            [place[0] + 2e-8 * turn, place[1], place[2] + 5e-4 * turn]
        })
        .collect();
    let x: Vec<f64> = x
        .chunks(TOUCHES)
        .enumerate()
        .flat_map(|(s, row)| {
            (0..TOUCHES).map(move |t| row[t % places] + 1e-4 * ((7 * s + t) as f64).sin())
        })
        .collect();
    let data = saved(folder.path(), "r.npz", &x, &p);
    let data = data.as_str();
    let judge = |split: &[&str]| {
        let base = ["evaluate", "--data", data, "--sites", "3,9,14"];
        json(&[&base[..], split].concat())
    };
    let (together, apart) = (judge(&[]), judge(&["--split", "touch"]));
    assert_eq!(together["places"], places);
    assert_eq!(together["criterion"]["split"], "place");
    assert!(notes(&together).contains("150 touches lie at 50 places"));
    let folds = together["fold_of_touch"].as_array().unwrap();
    assert!((places..TOUCHES).all(|t| folds[t] == folds[t - places]));
    let held: Vec<u64> = (together["test_touches"].as_array().unwrap().iter())
        .map(|t| t.as_u64().unwrap())
        .collect();
    assert_eq!(held.len(), 8 * TURNS);
    let again = |t: &u64| (t + places as u64) % TOUCHES as u64;
    assert!(held.iter().all(|t| held.contains(&again(t))));
    assert_eq!(apart["places"], TOUCHES);
    // What is asked for is what was told: the error looks smaller than it is.
    let last = |v: &Value| numbers(&v["criterion_mm"])[2];
    assert!(last(&together) > 1.3 * last(&apart), "{together} {apart}");
    // Greedy SVR's own criterion is that of the same folds.
    let chosen = json(&["select", "--data", data, "--sensors", "1"]);
    assert_eq!(chosen["fold_of_touch"], together["fold_of_touch"]);
    assert_eq!(chosen["counts"]["places"], places);
    assert!(notes(&chosen).contains("150 touches lie at 50 places"));
}

#[test]
fn expected_error_knows_noise_and_forces() {
    let folder = tempfile::tempdir().unwrap();
    let data = dataset(folder.path(), true);
    let data = data.to_str().unwrap();
    let asked = |more: &[&str]| {
        let fixed = [
            "select",
            "--data",
            data,
            "--selector",
            "expected-error",
            "--sensors",
            "5",
        ];
        let answer = json(&[&fixed[..], more].concat());
        let criteria = answer["criterion_mm"].as_array().unwrap();
        criteria
            .iter()
            .map(|c| c.as_f64().unwrap())
            .collect::<Vec<_>>()
    };
    let (quiet, loud) = (asked(&["--noise", "0.001"]), asked(&["--noise", "0.1"]));
    // More gauges are better, and noise is worse.
    assert!(quiet.windows(2).all(|w| w[1] < w[0]), "{quiet:?}");
    assert!(
        quiet.iter().zip(&loud).all(|(q, l)| q < l),
        "{quiet:?} {loud:?}"
    );
    let deaf = ["--selector", "expected-error", "--sensors", "2", "--noise"];
    let deaf = |noise: &str| {
        notes(&json(
            &[&["select", "--data", data][..], &deaf, &[noise]].concat(),
        ))
    };
    assert!(deaf("1e6").contains("--noise is in the unit of the signals"));
    assert!(!deaf("0.1").contains("--noise is in the unit"));
    let flags = [
        "select",
        "--data",
        data,
        "--selector",
        "pca-qr",
        "--forces-n",
        "1,10",
    ];
    misused(&flags, "--forces-n has no effect");
    let flags = [
        "select",
        "--data",
        data,
        "--selector",
        "expected-error",
        "--forces-n",
        "10,1",
    ];
    misused(&flags, "LIGHTEST,HARDEST");
    let flags = [
        "select",
        "--data",
        data,
        "--selector",
        "expected-error",
        "--forces-n",
        "1,10",
    ];
    misused(&flags, "--forces-n needs data");
}

/// The plate pressed on a grid of 15 × 10 places, so many times each, with signals that are off by normal errors, in a
/// file of its own; where forces are known the signals grow with them.
fn pressed_again(folder: &Path, turns: usize, deviation: f64, forces: bool) -> String {
    const PLACES: usize = 150;
    let sites = signals().2;
    let touches = turns * PLACES;
    let place = |t: usize| {
        let k = t % PLACES;
        [
            0.1 * ((k / 10) as f64 + 0.5) / 15.0,
            0.06 * ((k % 10) as f64 + 0.5) / 10.0,
        ]
    };
    let force = |t: usize| if forces { 1.0 + (t % 7) as f64 } else { 1.0 };
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let x: Vec<f64> = (0..SITES * touches)
        .map(|k| {
            let (s, t) = (&sites[3 * (k / touches)..], k % touches);
            let away = [s[0] - place(t)[0], s[1] - place(t)[1]];
            let d = away[0] * away[0] + 2.0 * away[1] * away[1];
            let clean = (-d / 0.0012).exp() + 0.3 * (30.0 * away[0]).sin();
            let off: f64 = rng.sample(StandardNormal);
            force(t) * (clean + deviation * off)
        })
        .collect();
    let p: Vec<f64> = (0..touches)
        .flat_map(|t| [place(t)[0], place(t)[1], 0.0])
        .collect();
    let mut file = NpzFile::default();
    file.add("X", &[SITES, touches], &x).unwrap();
    file.add("p_m", &[touches, 3], &p).unwrap();
    // Tenths of the plate, numbered somehow.
    let strip: Vec<f64> = (0..touches)
        .map(|t| (t % PLACES / 15) as f64 - 3.0)
        .collect();
    file.add("strip", &[touches], &strip).unwrap();
    if forces {
        let force: Vec<f64> = (0..touches).map(force).collect();
        file.add("force_n", &[touches], &force).unwrap();
    }
    let path = folder.join(format!("{turns}-{deviation}-{forces}.npz"));
    file.save(&path).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Five sites by expected error, with what is promised of them.
fn promised(data: &str, more: &[&str]) -> (String, f64, Value) {
    let fixed = ["select", "--data", data, "--selector", "expected-error"];
    let answer = json(&[&fixed[..], &["--sensors", "5"], more].concat());
    let sites: Vec<String> = indices(&answer).iter().map(u64::to_string).collect();
    let promised = *numbers(&answer["criterion_mm"]).last().unwrap();
    (sites.join(","), promised, answer)
}

/// What an estimator does on places that it has not seen.
fn held_out(data: &str, sites: &str, estimator: &str, more: &[&str]) -> Value {
    let fixed = ["evaluate", "--data", data, "--sites", sites];
    let how = ["--estimator", estimator, "--held-out", "0.25"];
    json(&[&fixed[..], &how, &["--failed", "1"], more].concat())
}

fn last_error(answer: &Value) -> f64 {
    let errors = answer["errors"].as_array().unwrap();
    errors.last().unwrap()["error_mm"].as_f64().unwrap()
}

#[test]
fn what_scattering_data_promise_is_what_matching_does() {
    let folder = tempfile::tempdir().unwrap();
    // With repeats that tell how far a press scatters, and without any.
    for turns in [3, 1] {
        let data = pressed_again(folder.path(), turns, 0.05, false);
        let (sites, promised, answer) = promised(&data, &["--noise", "0.001"]);
        let done = held_out(&data, &sites, "matching", &["--noise", "0.001"]);
        // Over all places, a fifth of them unseen in turn.
        let ratio = promised / numbers(&done["criterion_mm"])[4];
        assert!((0.7..1.3).contains(&ratio), "{turns}: {promised} {done}");
        let weighed = &answer["criterion"];
        assert_eq!(weighed["noise"], 0.001);
        assert_eq!(weighed["repeats"], 150 * (turns - 1));
        assert!(weighed["forces_n"].is_null());
        assert!(notes(&answer).contains("force_n"), "{answer}");
        let scatter = numbers(&weighed["scatter_percent"]);
        assert_eq!(scatter.len(), 5);
        assert!(
            scatter.iter().all(|s| (5.0..120.0).contains(s)),
            "{scatter:?}"
        );
    }
    // Without noise it is said that none was given.
    let data = pressed_again(folder.path(), 1, 0.05, false);
    assert!(notes(&promised(&data, &[]).2).contains("--noise"));
}

#[test]
fn estimators_are_judged_alike() {
    let folder = tempfile::tempdir().unwrap();
    let data = pressed_again(folder.path(), 2, 0.02, false);
    let sites = "3,9,14,20,6";
    let middle = 30.0;
    for estimator in ["matching", "nearest", "svr"] {
        let answer = held_out(&data, sites, estimator, &["--baseline"]);
        assert_eq!(answer["estimator"], estimator);
        assert!(last_error(&answer) < middle / 2.0, "{answer}");
        let criteria = numbers(&answer["criterion_mm"]);
        assert_eq!(criteria.len(), 5);
        assert!(criteria[4] < criteria[0], "{criteria:?}");
        // Places are whole, whoever judges: the same ones are held out.
        assert_eq!(answer["places"], 150);
        assert_eq!(answer["test_touches"].as_array().unwrap().len(), 76);
        assert_eq!(answer["criterion"]["c_mm"].is_number(), estimator == "svr");
        let error = &answer["errors"][4];
        assert_eq!(error["hyper"].is_object(), estimator == "svr");
        assert_eq!(error["neighbours"].is_number(), estimator == "nearest");
        assert!(answer["baseline"]["error_mm"].as_f64().unwrap() > 0.0);
        assert!(answer["failures"].as_array().unwrap().len() >= 2);
    }
    let idle: [&[&str]; 3] = [&["--c", "9"], &["--tune"], &["--max-steps", "9"]];
    for flags in idle {
        let base = ["evaluate", "--data", &data, "--sites", sites];
        let how = ["--estimator", "nearest"];
        misused(&[&base[..], &how, flags].concat(), flags[0]);
    }
}

#[test]
fn forces_scale_what_is_matched() {
    let folder = tempfile::tempdir().unwrap();
    let data = pressed_again(folder.path(), 2, 0.02, true);
    let (sites, promised, answer) = promised(&data, &["--noise", "0.01", "--forces-n", "1,7"]);
    let forces = numbers(&answer["criterion"]["forces_n"]);
    assert_eq!(forces, [1.0, 7.0]);
    assert!(promised > 0.0);
    let with = held_out(&data, &sites, "matching", &["--noise", "0.01"]);
    assert_eq!(with["criterion"]["forces"], true);
    // Neighbours know no force: a hard touch here reads as a light one elsewhere.
    let nearest = held_out(&data, &sites, "nearest", &["--noise", "0.01"]);
    assert!(last_error(&with) < last_error(&nearest), "{with} {nearest}");
}

#[test]
fn groups_of_the_user_are_never_divided() {
    let folder = tempfile::tempdir().unwrap();
    let data = pressed_again(folder.path(), 2, 0.02, false);
    let sites = "3,9";
    let group = |t: usize| t % 150 / 15;
    for estimator in ["matching", "svr"] {
        let answer = held_out(
            &data,
            sites,
            estimator,
            &["--groups", "strip", "--folds", "3"],
        );
        assert_eq!(answer["places"], 10);
        assert_eq!(answer["criterion"]["groups"], "strip");
        let held = answer["test_touches"].as_array().unwrap();
        let is_held = |t: usize| held.contains(&Value::from(t));
        let folds = answer["fold_of_touch"].as_array().unwrap();
        for t in 0..300 {
            let whole = (0..300).any(|other| is_held(other) && group(other) == group(t));
            assert_eq!(is_held(t), whole, "{t}");
            assert_eq!(folds[t], folds[group(t) * 15], "{t}");
        }
    }
    let apart = held_out(&data, sites, "matching", &["--groups", "none"]);
    assert_eq!(apart["places"], 300);
    let places = held_out(&data, sites, "nearest", &["--groups", "place"]);
    assert_eq!(places["places"], 150);
    // By a table, and by an array of that name without asking.
    let rows: Vec<String> = (0..300).map(|t| (t % 150 / 15).to_string()).collect();
    let table = folder.path().join("g.csv");
    std::fs::write(&table, format!("group\n{}\n", rows.join("\n"))).unwrap();
    let table = table.to_str().unwrap();
    let by = |groups: &str| {
        let how = ["--groups", groups, "--folds", "3"];
        held_out(&data, sites, "matching", &how)
    };
    let (by_table, by_array) = (by(table), by("strip"));
    assert_eq!(by_table["errors"], by_array["errors"]);
    let (x, p, _) = signals();
    let mut file = NpzFile::default();
    file.add("X", &[SITES, TOUCHES], &x).unwrap();
    file.add("p_m", &[TOUCHES, 3], &p).unwrap();
    let groups: Vec<f64> = (0..TOUCHES).map(|t| (t / 5) as f64).collect();
    file.add("groups", &[TOUCHES], &groups).unwrap();
    file.add("odd", &[TOUCHES], &vec![0.5; TOUCHES]).unwrap();
    file.add("few", &[3], &[1.0, 2.0, 3.0]).unwrap();
    let named = folder.path().join("named.npz");
    file.save(&named).unwrap();
    let named = named.to_str().unwrap();
    let taken = held_out(named, sites, "nearest", &[]);
    assert_eq!(taken["criterion"]["groups"], "groups");
    assert_eq!(taken["places"], 30);
    let said = held_out(named, sites, "nearest", &["--split", "touch"]);
    assert_eq!(said["places"], TOUCHES);
    let base = ["evaluate", "--data", named, "--sites", sites, "--groups"];
    refused(&[&base[..], &["odd"]].concat(), "whole numbers");
    refused(&[&base[..], &["few"]].concat(), "one is needed a touch");
    refused(&[&base[..], &["nothing"]].concat(), "nothing");
    misused(
        &[&base[..], &["few", "--split", "touch"]].concat(),
        "--split",
    );
}
