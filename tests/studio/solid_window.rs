//! A closed part in the real window: measured, corrected with the brush, pressed, designed and reported.
#![cfg(feature = "studio")]

use crate::window;

use std::path::{Path, PathBuf};
use std::process::Command;

use egui::{Key, Modifiers};
use glam::DVec3;
use hapdef::project::PartModel;
use hapdef::studio::{Field, Studio};
use window::Window;

/// A short limb with its wall, a few touches wide.
fn solid_limb(folder: &Path) -> PathBuf {
    let written = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["limb", "--solid", "--no-sites", "--thickness", "3"])
        .args(["--height", "60", "--columns", "4", "--hoops", "3", "--out"])
        .arg(folder)
        .status()
        .unwrap();
    assert!(written.success());
    let path = folder.join("limb.hapdef.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut project: toml::Table = text.parse().unwrap();
    for (table, key, value) in [
        ("touch", "count", toml::Value::from(150)),
        ("sites", "spacing_mm", toml::Value::from(6.0)),
        ("selection", "sensors", toml::Value::from(6)),
        ("budget", "quality", toml::Value::from("draft")),
    ] {
        let table = project[table].as_table_mut().unwrap();
        assert!(table.insert(key.into(), value).is_some(), "{key}");
    }
    std::fs::write(&path, toml::to_string(&project).unwrap()).unwrap();
    path
}

#[test]
fn a_solid_from_its_faces_to_its_report() {
    let mut w = Window::open();
    let folder = tempfile::tempdir().unwrap();
    w.open_file(&solid_limb(folder.path()), None);
    let state = w.harness.state();
    assert_eq!(
        state.session.document.state.project.part.model,
        PartModel::Solid
    );
    measured(&mut w);
    corrected(&mut w);

    // Pressed outside, it bends.
    w.press("Touch");
    let hoop = w.place(33.3, 0.0, 30.0);
    w.click(hoop);
    w.wait("the touch", 120, |s| {
        s.session.caches.touching.result().is_some()
    });
    assert!(w.session().caches.touching.result().unwrap().largest > 0.0);
    w.show("solid-3-touched");

    w.press("Select gauges");
    w.wait("the design", 400, |s| {
        s.session.results.design.is_some() && !s.busy()
    });
    let project = &w.session().document.state.project;
    assert_eq!(project.selection.sites.len(), 6);
    for site in &project.selection.sites {
        let p = DVec3::from_array(site.position_mm);
        let radius = p.truncate().length();
        assert!((radius - 30.33).abs() < 0.2, "a gauge off the inside: {p}");
    }
    w.show("solid-4-designed");
    w.press("Export report…");
    let report = folder.path().join("report");
    w.type_path(&report);
    w.press("Export");
    w.wait("the report", 120, |s| !s.busy());
    let text = std::fs::read_to_string(report.join("report.html")).unwrap();
    assert!(text.contains("<svg") && report.join("sites.csv").exists());
}

/// The faces are told apart, and in words what fits.
fn measured(w: &mut Window) {
    w.press("Front");
    w.key(Modifiers::NONE, Key::F4);
    let known = |s: &Studio| s.session.advice().is_some();
    w.wait("the advice", 120, known);
    w.harness.state_mut().view.field = Field::Faces;
    w.harness.run_ok();
    w.wait("the faces", 60, Studio::shows_field);
    let advice = w.session().advice().unwrap();
    assert!((advice.wall[1] - 3e-3).abs() < 1e-4, "{advice:?}");
    assert_eq!(advice.fits, PartModel::Solid);
    w.show("solid-1-faces");
}

/// What is outside is painted to be inside, measured anew, and taken back.
fn corrected(w: &mut Window) {
    let outside = |w: &Window, p: DVec3| side_at(w.harness.state(), p);
    let place = DVec3::new(33.33, 0.0, 30.0);
    assert!(outside(w, place) < 0.0, "it is outside");
    w.press("Paint");
    w.click_label("Layer");
    w.click_label("Inside face");
    let path: Vec<_> = (0..5)
        .map(|k| w.place(33.3, f64::from(k) - 2.0, 30.0))
        .collect();
    w.drag(&path);
    let known = |s: &Studio| s.session.advice().is_some() && !s.busy();
    w.wait("the faces anew", 120, known);
    w.harness.run_ok();
    assert!(outside(w, place) > 0.0, "the brush says it is inside");
    w.show("solid-2-corrected");
    w.key(Modifiers::COMMAND, Key::Z);
    w.wait("the faces as they were", 120, known);
    assert!(outside(w, place) < 0.0, "undone");
    w.harness.state_mut().view.field = Field::Region;
}

/// Which face the vertex of the part nearest to a place (mm) is on: -1 outside, 1 inside.
fn side_at(studio: &Studio, place: DVec3) -> f64 {
    use hapdef::mesh::walls::WallSide;
    let part = &studio.session.document.part;
    let distance = |v: &usize| part.positions()[*v].distance(place / 1000.0);
    let nearest = (0..part.positions().len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let faces = studio.session.advice().unwrap().faces.as_ref().unwrap();
    match faces.sides[nearest.unwrap()] {
        WallSide::Outside => -1.0,
        WallSide::Rim | WallSide::Frame => 0.0,
        WallSide::Inside => 1.0,
    }
}
