//! Calibration without a window: from a recording of presses, and from a board that is pressed.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use glam::DVec3;
use serde_json::Value;

/// Runs the program; what it prints.
pub fn hapdef(arguments: &[&str]) -> Result<String, String> {
    let done = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap();
    if done.status.success() {
        return Ok(String::from_utf8(done.stdout).unwrap());
    }
    Err(String::from_utf8_lossy(&done.stderr).into_owned())
}

/// Places around the limb (mm), evenly enough.
pub fn places(count: usize, turned: f64) -> Vec<DVec3> {
    (0..count)
        .map(|k| {
            let angle = TAU * (0.381_966 * k as f64 + turned);
            let z = 18.0 + 84.0 * (k as f64 + 0.5) / count as f64;
            DVec3::new(32.0 * angle.cos(), 32.0 * angle.sin(), z)
        })
        .collect()
}

/// Presses of a newton and a half of a second each, one after another.
fn script(path: &Path, places: &[DVec3], force: f64) {
    let mut text = String::from("start_s,duration_s,x_mm,y_mm,z_mm,force_n\n");
    for (k, p) in places.iter().enumerate() {
        let start = 3.0 + 1.6 * k as f64;
        let _ = writeln!(text, "{start},1.1,{:.3},{:.3},{:.3},{force}", p.x, p.y, p.z);
    }
    std::fs::write(path, text).unwrap();
}

fn record(script: &Path, recording: &Path, seed: &str) {
    record_with(script, recording, seed, &[]);
}

fn record_with(script: &Path, recording: &Path, seed: &str, more: &[&str]) {
    let mut arguments = vec![
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--seed",
        seed,
        "--bits",
        "16",
        "--rate",
        "200",
        "--script",
        script.to_str().unwrap(),
        "--record",
        recording.to_str().unwrap(),
    ];
    arguments.extend(more);
    hapdef(&arguments).unwrap();
}

/// Mean distance (mm) of what is found in a recording from where it was pressed.
fn error(recording: &Path, project: Option<&Path>, table: &Path) -> f64 {
    let mut arguments = vec![
        "listen",
        recording.to_str().unwrap(),
        "--fast",
        "--quality",
        "draft",
        "--csv",
        table.to_str().unwrap(),
    ];
    if let Some(project) = project {
        arguments.extend(["--project", project.to_str().unwrap()]);
    }
    hapdef(&arguments).unwrap();
    let text = std::fs::read_to_string(table).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| head.iter().position(|h| *h == name).unwrap();
    let [at, was, force] = ["x_mm", "true_x_mm", "true_force_n"].map(column);
    let place = |row: &[Option<f64>]| Some(DVec3::new(row[0]?, row[1]?, row[2]?));
    let off: Vec<f64> = (text.lines().skip(1))
        .filter_map(|line| {
            let row: Vec<Option<f64>> = line.split(',').map(|w| w.parse().ok()).collect();
            row[force].filter(|f| *f > 7.9)?;
            Some(place(&row[at..])?.distance(place(&row[was..])?))
        })
        .collect();
    assert!(off.len() > 1000, "{}", off.len());
    off.iter().sum::<f64>() / off.len() as f64
}

#[test]
fn presses_by_hand_show_how_gauges_are_glued() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let known = places(14, 0.0);
    script(&at("known.csv"), &known, 10.0);
    record(&at("known.csv"), &at("known.hapdrec"), "4");
    // Somebody pressed the sixth place two centimetres off.
    let mut told = known.clone();
    told[5].z += 20.0;
    script(&at("told.csv"), &told, 10.0);
    let calibrate = |points: &str, out: &str, more: &[&str]| {
        let (points, out) = (at(points), at(out));
        let recording = at("known.hapdrec");
        let mut arguments = vec![
            "calibrate",
            "--recording",
            recording.to_str().unwrap(),
            "--presses",
            points.to_str().unwrap(),
            "--quality",
            "draft",
            "--json",
            "--out",
            out.to_str().unwrap(),
        ];
        arguments.extend(more);
        hapdef(&arguments).map(|said| serde_json::from_str::<Value>(&said).unwrap())
    };
    let table = at("presses.csv");
    let said = calibrate(
        "told.csv",
        "found.hapdef.toml",
        &["--table", table.to_str().unwrap()],
    )
    .unwrap();
    let presses = said["presses"].as_array().unwrap();
    let left: Vec<usize> = (0..14).filter(|&k| presses[k]["used"] == false).collect();
    println!("{said}");
    assert_eq!(left, [5]);
    assert!(presses[5]["misfit"].as_f64().unwrap() > 4.0);
    let unknown: Vec<f64> = (said["unknown_percent"].as_array().unwrap().iter())
        .map(|v| v.as_f64().unwrap())
        .collect();
    assert!(unknown.windows(2).all(|w| w[1] <= w[0]) && unknown[0] < 10.0);
    let rows = std::fs::read_to_string(&table).unwrap();
    assert_eq!(rows.lines().count(), 15);

    script(&at("others.csv"), &places(20, 0.17), 8.0);
    record(&at("others.csv"), &at("others.hapdrec"), "4");
    let others = at("others.hapdrec");
    let before = error(&others, None, &at("before.csv"));
    let after = error(&others, Some(&at("found.hapdef.toml")), &at("after.csv"));
    println!("{before:.2} mm before, {after:.2} mm after");
    assert!(after < 1.0 && after < 0.6 * before);

    // Nothing goes over a project that is none, and too few presses are none.
    script(&at("few.csv"), &known[..3], 10.0);
    let why = calibrate("few.csv", "few.hapdef.toml", &[]).unwrap_err();
    assert!(
        why.contains("takes 4 presses") && !at("few.hapdef.toml").exists(),
        "{why}"
    );
    // The points of another day.
    script(&at("wrong.csv"), &places(14, 0.5), 10.0);
    let why = calibrate("wrong.csv", "wrong.hapdef.toml", &[]).unwrap_err();
    assert!(
        why.contains("of other places") && !at("wrong.hapdef.toml").exists(),
        "{why}"
    );
}

/// A limb that was printed thicker, of softer nylon or on softer feet than its project says.
#[test]
fn presses_say_how_stiff_and_how_thick_the_part_is_and_how_it_is_held() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    hapdef(&["limb", "--out", folder.path().to_str().unwrap()]).unwrap();
    let drawn = std::fs::read_to_string(at("limb.hapdef.toml")).unwrap();
    script(&at("known.csv"), &places(16, 0.0), 10.0);
    let fitted = |name: &str, made: &str, fit: &str| -> Value {
        let printed = at(&format!("{name}.hapdef.toml"));
        std::fs::write(&printed, made).unwrap();
        let recording = at(&format!("{name}.hapdrec"));
        record_with(
            &at("known.csv"),
            &recording,
            "4",
            &[printed.to_str().unwrap()],
        );
        let project = at("limb.hapdef.toml");
        let said = hapdef(&[
            "calibrate",
            "--recording",
            recording.to_str().unwrap(),
            "--presses",
            at("known.csv").to_str().unwrap(),
            "--project",
            project.to_str().unwrap(),
            "--quality",
            "draft",
            "--machine",
            "--fit",
            fit,
            "--json",
            "--out",
            at("fitted.hapdef.toml").to_str().unwrap(),
        ]);
        println!("{name}: {said:?}");
        serde_json::from_str(&said.unwrap()).unwrap()
    };
    let within = |found: &Value, right: f64, share: f64| {
        let [value, deviation] = ["value", "deviation"].map(|k| found[k].as_f64().unwrap());
        assert!((value / right - 1.0).abs() < share, "{value} for {right}");
        assert!(deviation > 0.0 && deviation < share * right, "{deviation}");
        value
    };
    let saved = |key: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(at("fitted.hapdef.toml")).unwrap();
        let lines = text
            .lines()
            .filter_map(|l| l.strip_prefix(key)?.strip_prefix(" = "));
        let number = |l: &str| l.split(' ').next().unwrap().parse().unwrap();
        lines.map(number).collect()
    };
    let thick = drawn.replace("thickness_mm = 1.5 ", "thickness_mm = 1.7 ");
    let found = fitted("thick", &thick, "thickness");
    let thickness = within(&found["thickness_mm"], 1.7, 0.05);
    assert_eq!(saved("thickness_mm"), [thickness]);
    assert_eq!(saved("youngs_modulus_gpa"), [1.7]);

    let soft = drawn.replace("youngs_modulus_gpa = 1.7 ", "youngs_modulus_gpa = 1.2 ");
    let found = fitted("soft", &soft, "stiffness");
    let modulus = within(&found["youngs_modulus_gpa"], 1.2, 0.05);
    assert_eq!(saved("youngs_modulus_gpa"), [modulus]);
    assert_eq!(saved("thickness_mm"), [1.5]);
    // What the material is softer by is not told of the gauges again.
    let gains = saved("gain");
    let gain = gains.iter().sum::<f64>() / gains.len() as f64;
    assert!(gains.len() == 10 && (gain - 1.0).abs() < 0.03, "{gains:?}");

    // The same on feet of rubber: which of both it is shows in where gauges are off.
    let loose = soft.replace("[[support]]\n", "[[support]]\nbedding_n_per_mm3 = 3.0\n");
    let found = fitted("loose", &loose, "stiffness,supports");
    let modulus = within(&found["youngs_modulus_gpa"], 1.2, 0.05);
    assert_eq!(saved("youngs_modulus_gpa"), [modulus]);
    let bedding = within(&found["bedding_n_per_mm3"], 3.0, 0.2);
    assert_eq!(saved("bedding_n_per_mm3"), [bedding; 4]);
    // Feet that are screwed to steel.
    let found = fitted("firm", &drawn, "supports");
    assert_eq!(found["bedding_n_per_mm3"], "firm");
    assert_eq!(saved("bedding_n_per_mm3"), [0.0; 0]);
}
