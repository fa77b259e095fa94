//! `hapdef export-c`: the estimator as C, compiled and run here, answers as the program does.

use std::path::Path;
use std::process::{Command, Output};

use hapdef::dataset::SignalMatrix;
use hapdef::design::Learned;
use hapdef::io::touch_file;
use hapdef::learning::{Family, TouchEstimator};
use serde_json::Value;

use crate::hard::seeds::trained;

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

fn exported(model: &Path, out: &Path, precision: &str) -> Value {
    let (model, out) = (model.to_str().unwrap(), out.to_str().unwrap());
    let asked = [
        "export-c",
        "--model",
        model,
        "--out",
        out,
        "--precision",
        precision,
        "--json",
    ];
    let output = hapdef(&asked);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Compiles with everything that a compiler may complain of, and runs.
fn compiled_and_run(folder: &Path, sources: &[&str]) -> String {
    let strict = [
        "-std=c99",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-o",
        "tried",
    ];
    let compiled = Command::new("cc")
        .current_dir(folder)
        .args(strict)
        .args(sources)
        .arg("-lm")
        .output()
        .expect("a C compiler, which links Rust too: apt install gcc libc6-dev");
    assert!(
        compiled.status.success(),
        "{}",
        String::from_utf8_lossy(&compiled.stderr)
    );
    let run = Command::new(folder.join("tried")).output().unwrap();
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success(), "{said}");
    said
}

#[test]
fn c_answers_as_the_program_does() {
    for family in Family::ALL {
        let folder = tempfile::tempdir().unwrap();
        let model = folder.path().join("m.hapdtouch");
        std::fs::write(&model, trained(family)).unwrap();
        for precision in ["auto", "double"] {
            let out = folder.path().join(precision);
            let said = exported(&model, &out, precision);
            assert!(said["off_mm"].as_f64().unwrap() < 0.01, "{said}");
            assert!(said["flash_bytes"].as_u64().unwrap() > 0);
            let sources = ["touch_test.c", "touch.c"];
            println!("{family:?} {said}\n{}", compiled_and_run(&out, &sources));
        }
        // The trials that are written along might share a fault with what they try: here are readings of our own.
        let Learned::Regression(estimator) = touch_file::read(&model).unwrap().estimator else {
            panic!("{family:?} is a regression");
        };
        own_readings(&estimator, &folder.path().join("double"));
    }
}

/// Readings between and beyond all that was learned from, asked of the C and of the program.
fn own_readings(estimator: &TouchEstimator, folder: &Path) {
    let channels = estimator.channels();
    let (middle, spread) = (&estimator.inputs.middle, &estimator.inputs.spread);
    let reading = |t: usize, c: usize| {
        let wave = ((t * 37 + c * 11) % 101) as f64 / 50.0 - 1.0;
        middle[c] + 3.0 * spread[c] * wave
    };
    let count = 40;
    let values = (0..channels).flat_map(|c| (0..count).map(move |t| reading(t, c)));
    let right = estimator.find(&SignalMatrix::new(count, values.collect()));
    let rows: Vec<String> = (0..count)
        .map(|t| {
            (0..channels)
                .map(|c| format!("{:e}", reading(t, c)))
                .collect::<Vec<_>>()
                .join(", ")
        })
        .collect();
    let main = format!(
        "#include \"touch.h\"\n#include <stdio.h>\nstatic const touch_real readings[] = {{{}}};\nint main(void) {{\n  int i;\n  for (i = 0; i < {count}; i++) {{\n    touch_answer a;\n    touch_find(readings + {channels} * i, &a);\n    printf(\"%.9e %.9e %.9e %.9e %.9e\\n\", a.place_mm[0], a.place_mm[1], a.place_mm[2], a.radius_mm, a.force_n);\n  }}\n  return 0;\n}}\n",
        rows.join(",\n")
    );
    std::fs::write(folder.join("own.c"), main).unwrap();
    let said = compiled_and_run(folder, &["own.c", "touch.c"]);
    assert_eq!(said.lines().count(), count);
    for (line, right) in said.lines().zip(right) {
        let found: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
        let [x, y, z] = right.place_mm;
        let all = [x, y, z, right.radius_mm, right.force_n.unwrap_or(0.0)];
        for (found, right) in found.iter().zip(all) {
            assert!(
                (found - right).abs() < 1e-5 * right.abs().max(1.0),
                "{line} {all:?}"
            );
        }
    }
}

#[test]
fn what_is_no_estimator_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.hapdtouch");
    std::fs::write(&model, "nothing").unwrap();
    let (from, to) = (model.to_str().unwrap(), folder.path().join("c"));
    let refused = hapdef(&["export-c", "--model", from, "--out", to.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said.contains("trained estimator") && !to.exists(), "{said}");
}
