//! The test-bed through the real programs: a plan is pressed on a simulated bench with faults, killed, gone on with, made a
//! dataset of, learned from, and what was learned is live.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

fn hapdef(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// What it says as one JSON object, or what it complains of.
fn said(folder: &Path, arguments: &[&str]) -> Value {
    let output = hapdef(folder, arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {complaint}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = hapdef(folder, arguments);
    assert!(!output.status.success(), "{arguments:?} was taken");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const COLLECT: [&str; 12] = [
    "collect",
    "--quality",
    "draft",
    "--simulate",
    "--places",
    "300",
    "--lose",
    "0.01",
    "--garble",
    "0.005",
    "--out",
    "run",
];

/// Bytes of the recordings of a run.
fn recorded(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder.join("run"));
    let lengths = entries.into_iter().flatten().flatten().filter_map(|e| {
        let ours = e.file_name().to_string_lossy().starts_with("part-");
        ours.then(|| e.metadata().map_or(0, |m| m.len()))
    });
    lengths.sum()
}

/// Begins a run, and kills it as soon as a good part of it is written.
fn kill_midway(folder: &Path) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(COLLECT)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while recorded(folder) < 500_000 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(child.try_wait().unwrap().is_none(), "it was over too soon");
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn from_the_plan_to_live_touch() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let begun = said(folder, &[&COLLECT[..], &["--plan-only"]].concat());
    let presses = begun["presses"].as_u64().unwrap();
    assert!(presses > 200, "{begun}");
    kill_midway(folder);
    let some = said(folder, &["dataset", "run", "--out", "some.npz", "--json"]);
    assert!(
        (5..presses).contains(&some["presses"].as_u64().unwrap()),
        "{some}"
    );
    let whole = said(folder, &COLLECT);
    assert_eq!(
        (&whole["pressed"], &whole["failed"]),
        (&begun["presses"], &Value::from(0)),
        "{whole}"
    );
    assert!(whole["lines_sent_again"].as_u64() > Some(100), "{whole}");
    assert!(whole["hardest_n"].as_f64() < Some(35.0), "{whole}");
    // Whoever asks for something else is not mixed in.
    let other = refused(folder, &[&COLLECT[..], &["--step", "0.3"]].concat());
    assert!(other.contains("other settings"), "{other}");

    let all = [
        "dataset", "run", "--out", "d.npz", "--depths", "all", "--csv", "d.csv", "--json",
    ];
    let data = said(folder, &all);
    assert_eq!(data["presses"], begun["presses"]);
    assert!(data["touches"].as_u64() > Some(5 * presses), "{data}");
    let rows = std::fs::read_to_string(folder.join("d.csv")).unwrap();
    assert_eq!(
        rows.lines().count() as u64,
        data["touches"].as_u64().unwrap() + 1
    );
    let keys = ["limb", "board", "machine"].map(|key| data[key].as_str().unwrap().len());
    assert!(keys.iter().all(|length| *length >= 8), "{data}");
    // Every reading with how warm the board was, which goes on saying that after the kill.
    let warm = rows.lines().map(|row| row.split(',').nth(7).unwrap());
    assert_eq!(warm.clone().next(), Some("temperature_c"));
    let celsius: Vec<f64> = warm.skip(1).map(|t| t.parse().unwrap()).collect();
    assert!(
        celsius.iter().all(|t| (22.0..24.0).contains(t)),
        "{celsius:?}"
    );

    said(
        folder,
        &["dataset", "run", "--out", "deepest.npz", "--json"],
    );
    let train = [
        "train",
        "--data",
        "deepest.npz",
        "--out",
        "m.hapdtouch",
        "--json",
    ];
    let trained = said(folder, &train);
    // Presses on held bosses hardly move a gauge: they are found anywhere, and are in the mean. Half of all are found as near
    // as this, by an estimator that knows nothing of the limb.
    assert!(trained["median_mm"].as_f64() < Some(5.0), "{trained}");
    let by_force = trained["by_force"].as_array().unwrap();
    let paper = by_force.iter().find(|row| row["from_n"] == 9.8).unwrap();
    assert!(paper["mean_mm"].as_f64() < Some(5.9), "{trained}");
    live(folder, 15.0);
    taught(folder, median(&trained));
    live(folder, 1.5);
}

fn median(trained: &Value) -> f64 {
    trained["median_mm"].as_f64().unwrap()
}

/// With the model of the limb the same presses end far nearer, a tenth of them nearly so, and the file is all that is needed.
fn taught(folder: &Path, alone: f64) {
    let train = [
        "train",
        "--data",
        "deepest.npz",
        "--out",
        "m.hapdtouch",
        "--project",
        "--quality",
        "draft",
        "--json",
    ];
    let all = said(folder, &train);
    assert_eq!(all["estimator"], "matching-remainder", "{all}");
    assert!(median(&all) < 0.1 * alone && median(&all) < 0.3, "{all}");
    assert!(all["coverage"].as_f64() > Some(0.75), "{all}");
    let paper = all["by_force"].as_array().unwrap();
    let paper = paper.iter().find(|row| row["from_n"] == 9.8).unwrap();
    assert!(paper["mean_mm"].as_f64() < Some(0.4), "{all}");
    let gluing = [&train[..], &["--estimator", "matching"]].concat();
    let gluing = said(folder, &gluing);
    assert!(median(&gluing) > 1.5 * median(&all), "{gluing} {all}");
    let few = said(folder, &[&train[..], &["--train-touches", "20"]].concat());
    assert!(median(&few) < 1.0, "{few}");
    assert!(
        few["estimator"].as_str().unwrap().starts_with("matching"),
        "{few}"
    );

    said(folder, &train);
    let predict = [
        "predict",
        "--model",
        "m.hapdtouch",
        "--data",
        "d.npz",
        "--json",
    ];
    let predicted = said(folder, &predict);
    assert_eq!(predicted["estimator"], "matching-remainder");
    assert!(median(&predicted) < 0.3, "{predicted}");
    let c = ["export-c", "--model", "m.hapdtouch", "--out", "c"];
    assert!(refused(folder, &c).contains("on no board yet"));
    // What cannot be learned by matching is said, and what was asked for by name is refused.
    let without = [
        "train",
        "--data",
        "deepest.npz",
        "--out",
        "n.hapdtouch",
        "--estimator",
        "matching",
    ];
    assert!(refused(folder, &without).contains("--project"));
}

/// What was learned finds touches on the same simulated limb to so many millimetres, and no other limb's.
fn live(folder: &Path, within: f64) {
    let script = "start_s,duration_s,x_mm,y_mm,z_mm,force_n\n3,1.5,22.5,22.5,60,15\n";
    std::fs::write(folder.join("s.csv"), script).unwrap();
    // Of the call before.
    let _ = std::fs::remove_file(folder.join("r.hapdrec"));
    let board = [
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--script",
        "s.csv",
        "--record",
        "r.hapdrec",
        "--rate",
        "200",
    ];
    said(folder, &board);
    let listen = [
        "listen",
        "r.hapdrec",
        "--fast",
        "--quality",
        "draft",
        "--model",
        "m.hapdtouch",
    ];
    let output = hapdef(folder, &listen);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let lines = String::from_utf8(output.stdout).unwrap();
    let found: Vec<f64> = (lines.lines())
        .filter_map(|line| {
            let line: Value = serde_json::from_str(line).unwrap();
            let place = ["x_mm", "y_mm", "z_mm"].map(|k| line[k].as_f64());
            let [Some(x), Some(y), Some(z)] = place else {
                return None;
            };
            // On the wall, the place of the script lies as far out as the part.
            Some((z - 60.0).hypot((y.atan2(x) - 45.0_f64.to_radians()) * 31.0))
        })
        .collect();
    assert!(found.len() > 100, "{}", found.len());
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!(mean < within, "{mean}");
    // What was learned on one limb is not believed on another.
    let text = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/limb.hapdef.toml"
    ));
    let text = text.unwrap();
    let (head, rest) = text.split_once("\nposition_mm = [").unwrap();
    let (x_mm, rest) = rest.split_once(',').unwrap();
    let x_mm = 0.5 + x_mm.parse::<f64>().unwrap();
    let moved = format!("{head}\nposition_mm = [{x_mm:.3},{rest}");
    std::fs::write(folder.join("other.hapdef.toml"), moved).unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/limb.glb");
    std::fs::copy(mesh, folder.join("limb.glb")).unwrap();
    let other = [&listen[..], &["--project", "other.hapdef.toml"]].concat();
    let why = refused(folder, &other);
    assert!(why.contains("another limb"), "{why}");
}

/// Rounds of presses where they tell most, until those that nothing has learned from are found near enough.
#[test]
fn a_plan_that_learns_ends_when_it_knows_enough() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let collect = |until: &'static str, more: &[&'static str]| {
        let asked = [
            "collect",
            "--quality",
            "draft",
            "--simulate",
            "--places",
            "120",
            "--out",
            "run",
            "--round",
            "12",
            "--until",
            until,
        ];
        said(folder, &[&asked[..], more].concat())
    };
    let met = collect("1.5", &[]);
    let pressed = met["pressed"].as_u64().unwrap();
    assert_eq!(met["met"], true, "{met}");
    // Before all that there are.
    assert!((20..115).contains(&pressed), "{met}");
    assert!(
        met["held_out"].as_u64() >= Some(10) && met["held_out_p90_mm"].as_f64() <= Some(1.5),
        "{met}"
    );
    assert_eq!(
        met["learned_from"].as_u64().unwrap() + met["held_out"].as_u64().unwrap(),
        pressed
    );
    // Nothing more is pressed, and the same is said, when it is asked again.
    let again = collect("1.5", &[]);
    assert_eq!(again["moves"], 0);
    for key in ["pressed", "learned_from", "held_out", "held_out_mm", "met"] {
        assert_eq!(again[key], met[key], "{key}");
    }
    // What cannot be reached ends with the plan.
    let all = collect("0.001", &["--in-order"]);
    assert_eq!(
        (&all["met"], &all["pressed"]),
        (&Value::from(false), &all["presses"])
    );
    assert!(all["held_out"].as_u64() > Some(20), "{all}");
}
