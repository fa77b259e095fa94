//! The tab “Study” in the real window.
#![cfg(feature = "studio")]

use std::collections::BTreeMap;
use std::path::Path;

use hapdef::io::study_folder::{StudyFolder, UnitCost, UnitOutcome};
use hapdef::parameter_study::Points;
use hapdef::studio::Tab;

use crate::window;
use window::Window;

const STUDY: &str = r#"format = 1
[base]
limb = true
quality = "draft"
[[axis]]
key = "limb.thickness"
values = [1.2, 1.6, 2.0, 2.4]
[[axis]]
key = "selection.selector"
values = ["expected-error", "pca-qr"]
[[axis]]
key = "selection.sensors"
values = [4, 6, 8, 10]
[aim]
minimize = ["as_built_10n_mm", "mass_g"]
"#;

/// A study whose units found what is written here: thicker limbs are heavier and worse, more gauges better.
fn found(home: &Path) -> StudyFolder {
    let path = home.join("study.toml");
    std::fs::write(&path, STUDY).unwrap();
    let folder = StudyFolder::plan(&home.join("run"), &path, "base".into(), BTreeMap::new());
    let folder = folder.unwrap();
    let points = Points::of(&folder.study).unwrap();
    for unit in 0..folder.plan.units - 1 {
        let values = points.values(unit);
        let (wall, gauges) = (
            values[0].as_float().unwrap(),
            values[2].as_integer().unwrap() as f64,
        );
        let worse = if values[1].as_str() == Some("pca-qr") {
            1.3
        } else {
            1.0
        };
        let failed = unit == 5;
        let figures = vec![
            (
                "as_built_10n_mm".to_owned(),
                Some(worse * wall * 8.0 / gauges),
            ),
            ("mass_g".to_owned(), Some(14.0 * wall + 0.1 * gauges)),
        ];
        let outcome = UnitOutcome {
            version: folder.plan.version.clone(),
            study: folder.plan.study.clone(),
            base: folder.plan.base.clone(),
            unit,
            values: serde_json::Map::new(),
            figures: if failed { Vec::new() } else { figures },
            error: failed.then(|| "the wall is too thin".into()),
            cautions: Vec::new(),
        };
        let cost = UnitCost {
            unit,
            cpu_seconds: 1.0,
            seconds: 1.0,
            shared: false,
        };
        folder.write(&outcome, &cost).unwrap();
    }
    folder
}

#[test]
fn a_study_is_looked_at_and_a_design_of_it_opened() {
    let home = tempfile::tempdir().unwrap();
    let folder = found(home.path());
    let mut w = Window::open();
    w.harness.run_ok();
    w.click_label("Study");
    assert_eq!(w.harness.state().view.tab, Tab::Study);
    w.show("study-empty");
    w.session_mut().open_study(&folder.folder);
    w.wait("the study", 60, |s| s.session.study.open().is_some());
    let study = w.session().study.open().unwrap().clone();
    assert_eq!(study.collected.counts(), [30, 1, 1]);
    let front = study.collected.on_front();
    // Of thin walls with the better selector, each number of gauges is lighter or better than the next.
    assert_eq!(front, [0, 1, 2, 3]);
    w.show("study");

    // Picked by its name, its limb is made and shown.
    let said = |name: &str| study.columns[study.column(name).unwrap()].in_words(2);
    let label = format!("Unit 2: {} · {}", said("as_built_10n_mm"), said("mass_g"));
    w.click_label(&label);
    w.wait("the limb", 60, |s| {
        s.session.study.limb().is_some_and(|l| l.unit == 2)
    });
    w.show("study-picked");
    w.press("Open as project");
    w.wait("the project", 60, |s| s.session.document.path.is_some());
    let document = &w.session().document;
    let project = &document.state.project;
    assert_eq!(
        (project.part.thickness_mm, project.selection.sensors),
        (1.2, 8)
    );
    assert!(project.selection.sites.is_empty());
    assert!(
        document
            .path
            .as_ref()
            .unwrap()
            .ends_with("run/opened/unit-000002.hapdef.toml")
    );
    assert!(document.mesh_path.ends_with("run/opened/unit-000002.glb"));
    // The study stays beside it.
    assert!(w.session().study.open().is_some());
}

#[test]
fn a_folder_that_is_no_study_is_said_to_be_none() {
    let home = tempfile::tempdir().unwrap();
    let mut w = Window::open();
    w.session_mut().open_study(home.path());
    w.wait("the refusal", 60, |s| !s.busy());
    let news = &w.session().news.messages;
    assert!(
        news.iter()
            .any(|m| m.text.contains("no study was planned here")),
        "{news:?}"
    );
    assert!(w.session().study.open().is_none());
}
