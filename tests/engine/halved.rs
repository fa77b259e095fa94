//! Meshes as CAD programs write them, a strip from rim to rim: their long edges are halved for what is shown and painted
//! a vertex, and nothing that is computed depends on it.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use hapdef::io::npz::NpzFile;
use hapdef::io::project_file;

const SIDES: usize = 32;

/// A tube of strips, held at its foot by a box or a mask, with this as a further line of its part.
fn tube(folder: &Path, line: &str, support: &str) -> std::path::PathBuf {
    let mut obj = String::new();
    for v in 0..2 * SIDES {
        let angle = std::f64::consts::TAU * (v % SIDES) as f64 / SIDES as f64;
        let (x, y, z) = (25.0 * angle.cos(), 25.0 * angle.sin(), 90 * (v / SIDES));
        let _ = writeln!(obj, "v {x:.9} {y:.9} {z}");
    }
    for i in 0..SIDES {
        let next = (i + 1) % SIDES;
        let [a, b, c, d] = [i, next, next + SIDES, i + SIDES].map(|v| v + 1);
        let _ = writeln!(obj, "f {a} {b} {c}\nf {a} {c} {d}");
    }
    std::fs::write(folder.join("tube.obj"), obj).unwrap();
    let path = folder.join("tube.hapdef.toml");
    let text = format!(
        "format = 1\n[part]\nmesh = \"tube.obj\"\nunit = \"mm\"\n{line}\n[[support]]\n{support}\n[touch]\ncount = 60\n"
    );
    std::fs::write(&path, text).unwrap();
    path
}

/// The dataset that the program makes of a project.
fn simulated(project: &Path) -> Vec<u8> {
    let out = project.with_file_name("data.npz");
    let run = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["simulate", "--quality", "draft", "--out"])
        .arg(&out)
        .arg(project)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(run.status.success(), "{said}");
    std::fs::read(out).unwrap()
}

const BOX: &str = "kind = \"clamped\"\nbox_mm = [[-30, -30, -1], [30, 30, 4]]";
const MASK: &str = "kind = \"clamped\"\nvertices = \"foot\"";

#[test]
fn there_is_much_to_paint_on_and_what_is_computed_stays() {
    let folder = tempfile::tempdir().unwrap();
    let whole = tube(folder.path(), "halve_mm = 1e6", BOX);
    let given = project_file::load(&whole).unwrap().inputs.part;
    assert_eq!(given.positions().len(), 2 * SIDES);
    let wanted = simulated(&whole);
    let by_itself = tube(folder.path(), "", BOX);
    let loaded = project_file::load(&by_itself).unwrap();
    let part = loaded.inputs.part;
    assert!(part.positions().len() > 1000, "{}", part.positions().len());
    assert!(
        loaded
            .repairs
            .in_words(0)
            .unwrap()
            .contains("long edges halved")
    );
    assert_eq!(part.as_given().positions(), given.positions());
    assert!(simulated(&by_itself) == wanted);
    // The file's own triangles are the elements: they stay.
    let own = tube(folder.path(), "elements = \"as-given\"", BOX);
    let own = project_file::load(&own).unwrap().inputs.part;
    assert_eq!(own.positions().len(), 2 * SIDES);
}

#[test]
fn masks_may_have_a_value_for_each_vertex_of_either() {
    let folder = tempfile::tempdir().unwrap();
    let keep = |mask: Vec<bool>| {
        let mut file = NpzFile::default();
        file.add("foot", &[mask.len()], &mask).unwrap();
        file.save(&folder.path().join("tube.hapdef.npz")).unwrap();
    };
    // Every second strip is held, from rim to rim.
    let strips: Vec<bool> = (0..2 * SIDES).map(|v| v % 4 < 2).collect();
    keep(strips.clone());
    let wanted = simulated(&tube(folder.path(), "halve_mm = 1e6", MASK));
    let project = tube(folder.path(), "", MASK);
    assert!(simulated(&project) == wanted);
    let inputs = project_file::load(&project).unwrap().inputs;
    assert!(inputs.masks["foot"].len() == inputs.part.positions().len());
    // What was painted between the file's vertices is held, too.
    let foot: Vec<bool> = (inputs.part.positions().iter())
        .map(|p| p.z < 0.004)
        .collect();
    keep(foot);
    let painted = simulated(&project);
    assert!(painted != wanted);
}
