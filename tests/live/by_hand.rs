//! A limb that somebody presses by hand, with a scale and no machine: collected, stopped, gone on with, and learned from.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use glam::DVec3;
use serde_json::Value;

use crate::board::{Running, start};
use crate::calibrate::{hapdef, places};

/// When the first press comes, of a board that was started just before whoever listens to it (s).
const FIRST_S: f64 = 9.0;
const EVERY_S: f64 = 2.2;

/// How hard each is (N): a scale says it.
fn force(number: usize) -> f64 {
    6.0 + 0.5 * number as f64
}

/// A board that is pressed at some of the places, one after another, and its port.
fn pressed(folder: &Path, places: &[DVec3], numbers: std::ops::Range<usize>) -> (Running, String) {
    let name = format!("from-{}", numbers.start);
    let presses: Vec<(DVec3, f64)> = numbers.map(|k| (places[k], force(k))).collect();
    pressed_at(folder, &name, &presses)
}

/// A board that is pressed somewhere (mm) and so hard (N), and again elsewhere, and its port.
pub fn pressed_at(folder: &Path, name: &str, presses: &[(DVec3, f64)]) -> (Running, String) {
    let path = folder.join(format!("{name}.csv"));
    let mut text = String::from("start_s,duration_s,x_mm,y_mm,z_mm,force_n\n");
    for (k, (p, force)) in presses.iter().enumerate() {
        let start = FIRST_S + EVERY_S * k as f64;
        let _ = writeln!(
            text,
            "{start:.2},1.3,{:.3},{:.3},{:.3},{force}",
            p.x, p.y, p.z
        );
    }
    std::fs::write(&path, text).unwrap();
    let board = start(&[
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--seed",
        "4",
        "--bits",
        "16",
        "--rate",
        "200",
        "--tcp",
        "--script",
        path.to_str().unwrap(),
    ]);
    let port = board.json()["port"].as_str().unwrap().to_owned();
    (board, port)
}

/// Collects what is pressed on a board; what is typed is said beforehand. Its last line, and what it says.
fn collect(project: &Path, run: &Path, points: &Path, port: &str, typed: &str) -> (Value, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args([
            "collect",
            project.to_str().unwrap(),
            "--quality",
            "draft",
            "--by-hand",
        ])
        .args(["--board", port, "--out", run.to_str().unwrap()])
        .args(["--points", points.to_str().unwrap()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut typing = child.stdin.take().unwrap();
    typing.write_all(typed.as_bytes()).unwrap();
    let done = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    let last = String::from_utf8_lossy(&done.stdout);
    let last = last.lines().last().unwrap_or_else(|| panic!("{said}"));
    (serde_json::from_str(last).unwrap(), said)
}

#[test]
fn presses_by_hand_are_collected_stopped_and_gone_on_with() {
    const ALL: usize = 8;
    const FIRST: usize = 3;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    hapdef(&["limb", "--out", folder.path().to_str().unwrap()]).unwrap();
    let (project, run, points) = (at("limb.hapdef.toml"), at("run"), at("points.csv"));
    let places = places(ALL, 0.0);
    let rows = places
        .iter()
        .map(|p| format!("{:.3},{:.3},{:.3}\n", p.x, p.y, p.z));
    std::fs::write(
        &points,
        format!("x_mm,y_mm,z_mm\n{}", rows.collect::<String>()),
    )
    .unwrap();
    let typed = |numbers: std::ops::Range<usize>, then: &str| {
        let forces = numbers.map(|k| format!("{}\n", force(k)));
        format!("{}{then}", forces.collect::<String>())
    };

    // The model of the gauges is kept beside the project: whoever listens is there before the first press.
    let plan = [
        "--quality",
        "draft",
        "--places",
        "5",
        "--plan-only",
        "--out",
    ];
    let (elsewhere, of) = (at("elsewhere"), project.to_str().unwrap());
    hapdef(&[&["collect", of][..], &plan, &[elsewhere.to_str().unwrap()]].concat()).unwrap();

    let (board, port) = pressed(folder.path(), &places, 0..FIRST);
    let (said, words) = collect(&project, &run, &points, &port, &typed(0..FIRST, "stop\n"));
    assert_eq!(
        (&said["presses"], &said["pressed"]),
        (&ALL.into(), &FIRST.into()),
        "{words}"
    );
    assert!(words.contains("3 of 8 presses are kept"), "{words}");
    drop(board);

    let (_board, port) = pressed(folder.path(), &places, FIRST..ALL);
    // Words that are neither are passed over; the last place is not pressed where it was asked for.
    let last = places[ALL - 1];
    let typed = format!(
        "perhaps\n{}at 900 0 0\nat {:.3} {:.3} {:.3}\n{}",
        typed(FIRST..ALL - 1, ""),
        last.x,
        last.y,
        last.z - 3.0,
        typed(ALL - 1..ALL, "")
    );
    let (said, words) = collect(&project, &run, &points, &port, &typed);
    assert_eq!(said["pressed"], ALL, "{words}");
    assert!(
        words.contains("“perhaps” is no force, no place and no order"),
        "{words}"
    );
    assert!(words.contains("press 4 of 8: at"), "{words}");
    assert!(
        words.contains("(900.0, 0.0, 0.0) mm is not on the limb"),
        "{words}"
    );

    let table = at("d.csv");
    let out = at("d.npz");
    let (run, table) = (run.to_str().unwrap(), table.to_str().unwrap());
    hapdef(&[
        "dataset",
        run,
        "--out",
        out.to_str().unwrap(),
        "--csv",
        table,
    ])
    .unwrap();
    let text = std::fs::read_to_string(table).unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| {
        head.iter()
            .position(|h| *h == name)
            .unwrap_or_else(|| panic!("{head:?}"))
    };
    let columns = ["x_mm", "y_mm", "z_mm", "force_n", "temperature_c"].map(column);
    let rows: Vec<[f64; 5]> = lines
        .map(|line| {
            let words: Vec<f64> = line.split(',').map(|w| w.parse().unwrap()).collect();
            columns.map(|c| words[c])
        })
        .collect();
    assert_eq!(rows.len(), ALL);
    for (k, &[x, y, z, n, celsius]) in rows.iter().enumerate() {
        // On the wall beside what was asked for, where that is in a window.
        let far = |place: &DVec3| place.distance(DVec3::new(x, y, z));
        let nearest = (0..ALL).min_by(|&a, &b| far(&places[a]).total_cmp(&far(&places[b])));
        assert!(nearest == Some(k) && far(&places[k]) < 10.0, "{rows:?}");
        assert!((n - force(k)).abs() < 1e-9, "{rows:?}");
        assert!((22.0..24.0).contains(&celsius), "{rows:?}");
    }
    let [x, y, z, ..] = rows[ALL - 1];
    let moved = format!("this one is at ({x:.1}, {y:.1}, {z:.1}) mm");
    assert!(words.contains(&moved), "{moved}: {words}");
}
