//! `hapdef study` through the program: units that anybody may compute, and what is collected of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn hapdef(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(arguments)
        .output()
        .unwrap()
}

fn done(arguments: &[&str]) -> String {
    let output = hapdef(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    String::from_utf8(output.stdout).unwrap() + &said
}

fn refused(arguments: &[&str]) -> String {
    let output = hapdef(arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A coarse limb's project in a folder, quick to design for.
fn base(folder: &Path) {
    let out = folder.to_str().unwrap();
    done(&["limb", "--out", out, "--element", "6", "--no-sites"]);
    let path = folder.join("limb.hapdef.toml");
    let mut text = fs::read_to_string(&path).unwrap();
    for (from, to) in [
        ("count = 4000", "count = 120"),
        ("spacing_mm = 2.1", "spacing_mm = 5.1"),
        ("edge_radius_mm = 2.1", "edge_radius_mm = 4.0"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(path, text).unwrap();
}

const STUDY: &str = r#"format = 1
[base]
project = "limb.hapdef.toml"
quality = "draft"
[[axis]]
key = "part.thickness_mm"
values = [1.5, 2.0]
[[axis]]
key = "selection.sensors"
values = [3, 4, 0]
[[service]]
at_mm = [0, 30, 80]
radius_mm = 8
force_n = [0, -30, -40]
[aim]
minimize = ["mass_g", "as_built_10n_mm"]
[[aim.require]]
figure = "error_10n_mm"
at_most = 1e3
"#;

struct Study {
    folder: tempfile::TempDir,
}

impl Study {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        base(folder.path());
        fs::write(folder.path().join("study.toml"), text).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn plan(&self, out: &str) -> String {
        done(&[
            "study",
            "plan",
            &self.text("study.toml"),
            "--out",
            &self.text(out),
        ])
    }
}

#[test]
fn units_have_the_same_bytes_whoever_computes_them() {
    let study = Study::new(STUDY);
    let (one, other) = (study.text("one"), study.text("other"));
    assert!(study.plan("one").contains("6 units"));
    done(&["study", "run", &one, "--local", "--jobs", "2"]);
    let said = done(&["study", "collect", &one]);
    assert!(
        said.contains("6 of 6 units computed, 2 failed, 0 missing"),
        "{said}"
    );

    // Piece by piece, in another order, on one thread, one of them twice, and from another place.
    study.plan("other");
    done(&["study", "run", &other, "--units", "3-5", "--threads", "1"]);
    let some = done(&["study", "collect", &other, "--json"]);
    let some: Value = serde_json::from_str(some.lines().next().unwrap()).unwrap();
    assert_eq!((&some["done"], &some["missing"]), (&2.into(), &3.into()));
    done(&["study", "run", &other, "--unit", "4", "--again"]);
    let said = done(&["study", "run", &other, "--local"]);
    assert!(said.contains("3 units are there already"), "{said}");
    done(&["study", "collect", &other]);
    for name in [
        "results.csv",
        "results.json",
        "results.parquet",
        "study.html",
        "results/000004.json",
    ] {
        let read = |folder: &str| fs::read(study.path(folder).join(name)).unwrap();
        assert_eq!(read("one"), read("other"), "{name}");
    }

    let table = fs::read_to_string(study.path("one/results.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[0].starts_with("unit,part.thickness_mm,selection.sensors,state,gauges,"));
    assert!(rows[2].starts_with("1,1.5,4,done,4,"), "{}", rows[2]);
    // A thicker wall carries the load with less.
    let column = |row: &str, name: &str| -> f64 {
        let at = rows[0].split(',').position(|n| n == name).unwrap();
        row.split(',').nth(at).unwrap().parse().unwrap()
    };
    for name in [
        "service_gives_way_mm",
        "service_moves_most_mm",
        "service_microstrain",
    ] {
        let [thin, thick] = [rows[2], rows[5]].map(|row| column(row, name));
        assert!(thick > 0.0 && thick < 0.9 * thin, "{name}: {thin} {thick}");
    }
    assert!(rows[3].starts_with("2,1.5,0,failed,"), "{}", rows[3]);
    assert!(rows[3].contains("selection.sensors must be"), "{}", rows[3]);
    assert!(!table.contains("second"));
    // Numbers of gauges on one wall share its simulation.
    let costs = fs::read_to_string(study.path("one/costs.csv")).unwrap();
    let shared = costs
        .lines()
        .skip(1)
        .filter(|row| row.ends_with(",1"))
        .count();
    assert!(shared >= 1, "{costs}");

    let all: Value =
        serde_json::from_str(&fs::read_to_string(study.path("one/results.json")).unwrap()).unwrap();
    let figure = |unit: usize, name: &str| all["rows"][unit]["figures"][name].as_f64().unwrap();
    // Half as thick again weighs a third more, and gives way less.
    assert!((figure(3, "mass_g") / figure(0, "mass_g") - 2.0 / 1.5).abs() < 1e-9);
    assert!(figure(3, "gives_way_mm") < 0.8 * figure(0, "gives_way_mm"));
    assert_eq!(figure(0, "gives_way_mm"), figure(1, "gives_way_mm"));
    let front: Vec<bool> = (0..6)
        .map(|u| all["rows"][u]["front"].as_bool().unwrap())
        .collect();
    assert!(front[0] || front[1], "{front:?}");
    assert!(!front[2] && !front[5], "{front:?}");
}

/// Each unit by a process of its own: the first leaves its simulation for the others, the last takes it away; a damaged one
/// costs nothing but time.
#[test]
fn processes_share_a_simulation() {
    let text = STUDY
        .replace("values = [1.5, 2.0]", "values = [1.5]")
        .replace("[3, 4, 0]", "[3, 4, 5, 0]");
    let study = Study::new(&text);
    let kept = |folder: &str| -> Vec<PathBuf> {
        let listed = fs::read_dir(study.path(folder).join("shared"));
        listed.map_or(Vec::new(), |all| {
            all.map(|one| one.unwrap().path()).collect()
        })
    };
    let shared = |folder: &str, unit: usize| -> bool {
        let path = study.path(folder).join(format!("costs/{unit:06}.json"));
        let cost: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        cost["shared"].as_bool().unwrap()
    };
    for (name, damage) in [("whole", false), ("damaged", true)] {
        study.plan(name);
        let run = |unit: &str| done(&["study", "run", &study.text(name), "--unit", unit]);
        run("2");
        let [one] = &kept(name)[..] else {
            panic!("{:?}", kept(name));
        };
        if damage {
            let bytes = fs::read(one).unwrap();
            fs::write(one, &bytes[..bytes.len() / 2]).unwrap();
        }
        run("0");
        assert_eq!(kept(name).len(), 1);
        run("1");
        // The last one fails before it would need it.
        assert_eq!(kept(name).len(), 1);
        run("3");
        assert!(kept(name).is_empty());
        let found = [2, 0, 1].map(|unit| shared(name, unit));
        assert_eq!(found, [false, !damage, true], "{name}");
        done(&["study", "collect", &study.text(name)]);
    }
    study.plan("together");
    done(&["study", "run", &study.text("together"), "--local"]);
    assert!(kept("together").is_empty());
    done(&["study", "collect", &study.text("together")]);
    let read = |folder: &str| fs::read(study.path(folder).join("results.csv")).unwrap();
    assert!(read("whole") == read("together") && read("damaged") == read("together"));
}

#[test]
fn what_a_unit_finds_is_what_a_design_finds() {
    let one = STUDY
        .replace("values = [1.5, 2.0]", "values = [1.5]")
        .replace("[3, 4, 0]", "[4]");
    let study = Study::new(&one);
    study.plan("s");
    let folder = study.text("s");
    done(&["study", "run", &folder, "--unit", "0"]);
    done(&["study", "collect", &folder]);
    let all: Value =
        serde_json::from_str(&fs::read_to_string(study.path("s/results.json")).unwrap()).unwrap();
    let project = study.path("limb.hapdef.toml");
    let text = fs::read_to_string(&project)
        .unwrap()
        .replacen("sensors = 10", "sensors = 4", 1);
    fs::write(&project, text).unwrap();
    let out = study.text("report");
    let said = done(&[
        "design",
        project.to_str().unwrap(),
        "--quality",
        "draft",
        "--out",
        &out,
        "--json",
    ]);
    let design: Value = serde_json::from_str(said.lines().next().unwrap()).unwrap();
    for row in design["evaluation"].as_array().unwrap() {
        if row["sensors"] == 4 && row["region"] == "all touches" {
            let name = format!("error_{}n_mm", row["force_n"].as_f64().unwrap());
            assert_eq!(all["rows"][0]["figures"][&name], row["error_mm"], "{name}");
        }
    }
}

#[test]
fn limbs_of_the_family_are_varied_by_their_options() {
    let text = "format = 1\n[base]\nlimb = true\nquality = \"draft\"\n[[axis]]\nkey = \"limb.height\"\nvalues = [60, 1e9]\n[[axis]]\nkey = \"touch.count\"\nvalues = [60]\n";
    let study = Study::new(text);
    study.plan("s");
    let folder = study.text("s");
    done(&["study", "run", &folder, "--unit", "1"]);
    done(&["study", "collect", &folder]);
    let table = fs::read_to_string(study.path("s/results.csv")).unwrap();
    assert!(
        table.contains("1,1000000000.0,60,failed") && table.contains("height"),
        "{table}"
    );
    // Columns are of a regular grid, which has hoops too.
    let alone = text.replace("height\"\nvalues = [60, 1e9]", "columns\"\nvalues = [4]");
    fs::write(study.path("wrong.toml"), alone).unwrap();
    let wrong = [study.text("wrong.toml"), study.text("wrong")];
    let said = refused(&["study", "plan", &wrong[0], "--out", &wrong[1]]);
    assert!(
        said.contains("limb.columns …): one of them takes another axis beside it: limb.hoops"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_meant_is_refused_by_its_name() {
    let study = Study::new(STUDY);
    let plan = |text: String| {
        fs::write(study.path("wrong.toml"), text).unwrap();
        refused(&[
            "study",
            "plan",
            &study.text("wrong.toml"),
            "--out",
            &study.text("wrong"),
        ])
    };
    for (from, to, words) in [
        (
            "selection.sensors",
            "selection.colour",
            "selection.colour is no key",
        ),
        ("selection.sensors", "limb.columns", "set limb = true"),
        ("part.thickness_mm", "support.kind", "stands in a list"),
        ("limb.hapdef.toml", "other.toml", "other.toml"),
        ("minimize", "minimise", "minimise"),
        ("radius_mm = 8", "radius_mm = 0", "radius_mm"),
        (
            "values = [1.5, 2.0]",
            "from = 1.0\nto = 2.0",
            "needs a count",
        ),
    ] {
        let said = plan(STUDY.replace(from, to));
        assert!(said.contains(words), "{said}");
    }
    assert!(!study.path("wrong/plan.json").exists());

    study.plan("s");
    let folder = study.text("s");
    let said = refused(&["study", "run", &folder, "--unit", "6"]);
    assert!(said.contains("6 units"), "{said}");
    let said = refused(&["study", "collect", &study.text("nowhere")]);
    assert!(said.contains("no study was planned here"), "{said}");
    // Another study in the same folder, another base, another version.
    fs::write(study.path("study.toml"), STUDY.replace("[3, 4, 0]", "[3]")).unwrap();
    let said = refused(&["study", "plan", &study.text("study.toml"), "--out", &folder]);
    assert!(said.contains("another study"), "{said}");
    let project = study.path("limb.hapdef.toml");
    let text = fs::read_to_string(&project)
        .unwrap()
        .replacen("force_n = 10", "force_n = 11", 1);
    fs::write(&project, text).unwrap();
    let said = refused(&["study", "run", &folder, "--unit", "0"]);
    assert!(said.contains("has changed"), "{said}");
    let plan = study.path("s/plan.json");
    let text = fs::read_to_string(&plan)
        .unwrap()
        .replace(env!("CARGO_PKG_VERSION"), "9.9.9");
    fs::write(&plan, text).unwrap();
    let said = refused(&["study", "run", &folder, "--unit", "0"]);
    assert!(said.contains("9.9.9"), "{said}");
}

#[test]
fn a_mesh_that_has_changed_since_the_plan_is_not_taken_for_the_one_that_was_planned() {
    let study = Study::new(&STUDY.replace(
        "key = \"part.thickness_mm\"\nvalues = [1.5, 2.0]",
        "key = \"mesh\"\nvalues = [\"limb.glb\", \"other.glb\", \"none.glb\"]",
    ));
    fs::copy(study.path("limb.glb"), study.path("other.glb")).unwrap();
    assert!(study.plan("s").contains("9 units"));
    let folder = study.text("s");
    let mut bytes = fs::read(study.path("other.glb")).unwrap();
    let last = bytes.len() - 2;
    bytes[last] ^= 1;
    fs::write(study.path("other.glb"), bytes).unwrap();
    let said = refused(&["study", "run", &folder, "--unit", "3"]);
    assert!(said.contains("other.glb: the mesh has changed"), "{said}");
    // What never was there fails by its name alone, and the others go on.
    done(&["study", "run", &folder, "--units", "0-0"]);
    done(&["study", "run", &folder, "--units", "6-6"]);
    let said = done(&["study", "collect", &folder]);
    assert!(
        said.contains("2 of 9 units computed, 1 failed, 7 missing"),
        "{said}"
    );
    let said = refused(&["study", "plan", &study.text("study.toml"), "--out", &folder]);
    assert!(said.contains("other meshes"), "{said}");
}

#[test]
fn engines_get_a_script_and_one_command() {
    let study = Study::new(STUDY);
    study.plan("s");
    let folder = study.text("s");
    for engine in ["hyperqueue", "slurm", "parallel"] {
        let said = done(&[
            "study",
            "submit",
            &folder,
            "--engine",
            engine,
            "--program",
            "/opt/hapdef",
        ]);
        assert!(said.contains(&format!("cd {folder}")), "{said}");
    }
    // What an engine does with a task, done by a shell.
    let program = env!("CARGO_BIN_EXE_hapdef");
    done(&[
        "study",
        "submit",
        &folder,
        "--engine",
        "parallel",
        "--program",
        program,
        "--together",
        "5",
    ]);
    let task = Command::new("sh")
        .args(["study.parallel.sh", "1"])
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(
        task.status.success(),
        "{}",
        String::from_utf8_lossy(&task.stderr)
    );
    assert!(study.path("s/results/000005.json").exists());
    assert!(!study.path("s/results/000004.json").exists());
}
