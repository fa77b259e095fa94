//! Whole sessions in the real window, as an engineer has them who has read nothing.
#![cfg(feature = "studio")]

use crate::window;

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers};

use glam::DVec3;
use hapdef::design::Design;
use hapdef::document::Layer;
use hapdef::placement::SelectorKind;
use hapdef::project::ChosenSite;
use hapdef::studio::{Field, Stage, Standing, Tool};
use window::Window;

/// What the stages say, in the order of the pipeline.
fn standings(w: &Window) -> Vec<Standing> {
    Stage::ALL
        .map(|stage| w.harness.state().standing(stage))
        .to_vec()
}

fn gauges_of(w: &Window) -> Vec<ChosenSite> {
    let project = &w.session().document.state.project;
    project.selection.sites.clone()
}

fn gauges(w: &Window) -> usize {
    gauges_of(w).len()
}

/// The paper's task: where do ten gauges go in this limb, how well do they find a touch, what if some fail,
/// would fewer do, and what does the workshop get?
#[test]
fn the_whole_design_task() {
    let mut w = Window::open();
    let home = tempfile::tempdir().unwrap();
    w.harness.state_mut().keep_unsaved_in(home.path());
    w.harness.run_ok();

    // All selectors are to be seen beside each other.
    let document = &mut w.session_mut().document;
    document.state.project.selection.compare = true;
    w.harness.run_ok();

    // There is something to see and something to press.
    assert_eq!(standings(&w)[0], Standing::Current);
    assert_eq!(standings(&w)[2], Standing::Open);
    w.show("1-start");

    press_and_paint(&mut w);

    // One button leads to the answer; the stages fill in on the way.
    w.press("Touch");
    w.press("Select gauges");
    w.wait("the simulation", 120, |s| {
        s.session.results.simulation.is_some()
    });
    w.wait("the design", 300, |s| {
        s.session.results.design.is_some() && !s.busy()
    });
    for (stage, standing) in Stage::ALL.into_iter().zip(standings(&w)) {
        // Nothing was pressed, and no board is connected.
        let expected = match stage {
            Stage::Bench | Stage::Live => Standing::Open,
            _ => Standing::Current,
        };
        assert_eq!(standing, expected, "{stage:?}");
    }
    assert_eq!(gauges(&w), 10);
    let state = w.harness.state();
    let places = state.session.document.state.project.selection.sites.clone();
    for site in &places {
        // Nothing on the painted strip.
        let p = DVec3::from_array(site.position_mm);
        assert!(
            p.distance(DVec3::new(31.83, 0.0, p.z)) > 3.0 || p.z > 86.0 || p.z < 34.0,
            "{p}"
        );
    }
    let design = Arc::clone(&state.session.results.design.as_ref().unwrap().value.design);
    assert!(
        design
            .feasibility
            .taken()
            .iter()
            .any(|(f, n)| f.label() == "Kept out" && *n > 20)
    );
    w.press("Unrolled");
    w.show("3-selected");
    w.click_label("Failures");
    w.show("4-failures");
    w.harness.state_mut().view.field = Field::Error;
    w.wait(
        "the map of the error",
        60,
        hapdef::studio::Studio::shows_field,
    );
    w.show("5-error-map");
    w.harness.state_mut().view.field = Field::Uncertainty;
    w.harness.run_ok();
    w.wait("what is uncertain", 60, hapdef::studio::Studio::shows_field);
    w.show("6-uncertain");
    w.harness.state_mut().view.field = Field::Region;

    compare(&mut w, &design);
    by_hand(&mut w);
    out(&mut w, home.path());
}

/// The limb is pressed, and painted where a cable runs.
fn press_and_paint(w: &mut Window) {
    // Press the limb: it bends.
    w.press("Front");
    let hoop = w.place(31.83, 0.0, 60.0);
    w.click(hoop);
    w.wait("the touch", 60, |s| {
        s.session.caches.touching.result().is_some()
    });
    w.show("2-touch");

    // A cable runs along the front: no gauge may go there.
    w.press("Paint");
    w.key(Modifiers::NONE, Key::OpenBracket);
    w.harness.state_mut().view.layer = Layer::KeepOut;
    let path: Vec<_> = (0..9)
        .map(|k| w.place(31.83, 0.0, 40.0 + 5.0 * f64::from(k)))
        .collect();
    w.drag(&path);
    let kept_out = |w: &Window| {
        let layer = w.session().document.layer(Layer::KeepOut);
        layer.map(|m| m.iter().filter(|&&m| m).count())
    };
    let painted = kept_out(w).expect("a stroke paints");
    w.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(kept_out(w), None, "one stroke is one step");
    w.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(kept_out(w), Some(painted));
}

fn follow(w: &mut Window) {
    w.wait("the change to be followed", 300, |s| {
        !s.busy() && s.standing(Stage::Evaluation) == Standing::Current
    });
}

/// Selections beside each other, and what is computed again for them.
fn compare(w: &mut Window, design: &Arc<Design>) {
    let places = gauges_of(w);
    // Another selector is there at once: all were run.
    w.press("Keep this selection");
    w.session_mut().document.state.project.selection.selector = SelectorKind::PcaQr;
    w.harness.run_ok();
    assert!(!w.harness.state().busy());
    let other = &w.session().document.state.project.selection.sites;
    assert_ne!(*other, places);
    w.press("Keep this selection");
    // From here on one selector is enough.
    let selection = &mut w.session_mut().document.state.project.selection;
    (selection.selector, selection.compare) = (SelectorKind::ExpectedError, false);
    w.harness.run_ok();
    follow(w);

    // Would five do? Only what depends on the number is computed again.
    w.session_mut().document.state.project.selection.sensors = 5;
    w.harness.run_ok();
    assert_eq!(standings(w)[5], Standing::Stale);
    assert_eq!(standings(w)[2], Standing::Current);
    follow(w);
    assert_eq!(gauges(w), 5);
    let five = &w.session().results.design.as_ref().unwrap().value.design;
    assert!(
        Arc::ptr_eq(&five.simulated, &design.simulated),
        "the simulation is the same one"
    );
    redo_outlives_results(w);
    w.press("Keep this selection");
    let kept = &w.session().document.state.project.kept;
    let error = |k: usize| {
        kept[k]
            .errors
            .iter()
            .rfind(|e| e.region == "all touches")
            .unwrap()
            .mean_mm
    };
    assert_eq!(kept.len(), 3);
    assert!(error(2) > error(0), "five find touches less well than ten");
    w.show("7-compare");
}

/// What is computed after an undo is no change of the user's: redo is still there when it has come.
fn redo_outlives_results(w: &mut Window) {
    let sensors = |w: &Window| w.session().document.state.project.selection.sensors;
    w.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(sensors(w), 10);
    follow(w);
    assert_eq!(gauges(w), 10);
    assert!(w.session().document.can_redo());
    w.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(sensors(w), 5);
    follow(w);
    assert_eq!(gauges(w), 5);
}

/// The place that the workshop cannot reach: a gauge is moved by hand and pinned.
fn by_hand(w: &mut Window) {
    w.press("Gauges");
    let sites = w.session().document.state.project.selection.sites.clone();
    // One that lies along a hoop, and along it.
    let along = sites.iter().position(|s| s.direction[2].abs() < 0.3);
    let gauge = along.expect("a gauge on a hoop");
    let [x, y, z] = sites[gauge].position_mm;
    let from = w.flat_place(x, y, z);
    let to = from + egui::vec2(24.0, 0.0);
    let path: Vec<_> = (0..=10).map(|k| from.lerp(to, k as f32 / 10.0)).collect();
    w.drag(&path);
    let moved = w.session().document.state.project.selection.sites[gauge].clone();
    assert_ne!(moved, sites[gauge], "the gauge follows the pointer");
    assert_eq!(w.harness.state().view.picked, [gauge]);
    assert_eq!(gauges(w), sites.len());
    // An estimate at once, the exact figure after it.
    let start = Instant::now();
    w.wait("an estimate", 20, |s| s.session.by_hand_error().0.is_some());
    eprintln!("estimate after {:?}", start.elapsed());
    w.wait("the exact error", 120, |s| {
        s.session.by_hand_error().1.is_some() && !s.busy()
    });
    let (Some(quick), Some(exact)) = w.session().by_hand_error() else {
        panic!("both are known")
    };
    // The one is of all forces as a workshop builds it, the other of one force as designed.
    assert!((0.5..2.0).contains(&(quick / exact)), "{quick} {exact}");
    judged_alike(w, exact);
    w.show("8-by-hand");
    // Pinned, it stays where it is in the next selection.
    w.press("Pin");
    assert_eq!(
        w.harness.state().view.picked,
        [gauge],
        "the button is over the view, not in it"
    );
    let pins = w
        .session()
        .document
        .state
        .project
        .selection
        .required_mm
        .len();
    assert_eq!(pins, 1);
    w.wait("the selection around the pin", 300, |s| {
        !s.busy() && s.standing(Stage::Evaluation) == Standing::Current
    });
    w.press("Select gauges");
    w.wait("the gauges", 300, |s| !s.busy());
    let at = DVec3::from_array(moved.position_mm);
    let sites = &w.session().document.state.project.selection.sites;
    let near = |s: &&ChosenSite| DVec3::from_array(s.position_mm).distance(at) < 0.01;
    assert!(sites.iter().any(|s| near(&s)), "{at} among {sites:?}");
}

/// What is moved by hand is judged by the rules of what was selected: the same set gives the same figure.
fn judged_alike(w: &Window, by_hand: f64) {
    let result = w.session().results.design.as_ref().unwrap();
    let (inputs, design) = (&result.value.snapshot, &result.value.design);
    let chosen = design.chosen();
    let judge = |sites: &[usize]| {
        let found = hapdef::design::judge_set(inputs, design, sites, &hapdef::budget::unwatched);
        let found = found.unwrap();
        found
            .rows
            .iter()
            .find(|r| r.region == "all touches")
            .unwrap()
            .error_mm
    };
    let own = design.chosen_row().unwrap().error_mm;
    let again = judge(chosen);
    assert!((again / own - 1.0).abs() < 1e-9, "{again} {own}");
    assert_ne!(again, by_hand);
}

/// Saved, pictured, reported; and what was not saved comes back after a crash.
fn out(w: &mut Window, home: &std::path::Path) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.hapdef.toml");
    w.key(Modifiers::COMMAND, Key::S);
    w.type_path(&path);
    w.save_file();
    assert!(
        !w.session().document.is_dirty(),
        "{:?}",
        w.session().news.messages
    );
    w.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::E);
    let picture = folder.path().join("arm.png");
    w.type_path(&picture);
    w.press("Save picture");
    w.wait("the picture", 60, |s| !s.busy());
    let image = image::open(&picture).unwrap().to_rgba8();
    assert_eq!(image.dimensions(), (1920, 1080));
    assert!(
        image.pixels().any(|p| p.0[0] > 200 && p.0[2] < 80),
        "gauges are on it"
    );
    w.press("Export report…");
    let report = folder.path().join("report");
    w.type_path(&report);
    w.press("Export");
    w.wait("the report", 60, |s| !s.busy());
    assert!(report.join("report.html").exists() && report.join("sites.csv").exists());
    w.show("9-reported");
    // A change, a crash, and another window.
    w.session_mut().document.state.project.touch.force_n = 7.5;
    let start = Instant::now();
    let kept = || {
        std::fs::read_dir(home)
            .unwrap()
            .filter_map(|f| Some(f.ok()?.path().join("origin.json")))
            .any(|f| f.exists())
    };
    while !kept() {
        assert!(start.elapsed() < Duration::from_secs(30));
        w.harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut again = Window::open();
    // The first window is still there, and its lock with it: it must be gone first.
    let gone = std::mem::replace(w, Window::open());
    drop(gone);
    again.harness.state_mut().keep_unsaved_in(home);
    again.harness.run_ok();
    again.press("Recover changes");
    again.wait("the changes", 60, |s| !s.busy());
    let document = &again.session().document;
    assert_eq!(document.state.project.touch.force_n, 7.5);
    assert_eq!(document.state.project.kept.len(), 3);
    assert_eq!(
        document.path.as_deref(),
        Some(path.canonicalize().unwrap().as_path())
    );
    assert!(document.is_dirty() && document.layer(Layer::KeepOut).is_some());
}

/// Every control that can be reached has a name, with every tool and at every stage.
#[test]
fn every_control_has_a_name() {
    let mut w = Window::open();
    w.press("Section");
    for stage in Stage::ALL {
        w.harness.state_mut().view.stage = stage;
        w.harness.run_ok();
        w.assert_named(&format!("{stage:?}"));
    }
    for tool in Tool::ALL {
        w.harness.state_mut().view.take(tool);
        w.harness.run_ok();
        w.assert_named(&format!("{tool:?}"));
    }
}

#[test]
fn an_idle_window_rests() {
    let mut w = Window::open();
    w.press("Unrolled");
    w.press("See-through");
    let rests = |w: &mut Window| {
        // As many frames as an animation may take, and then none is asked for.
        for _ in 0..120 {
            w.harness.step();
        }
        let wanted = w.harness.output().viewport_output.values();
        wanted.map(|v| v.repaint_delay).min().unwrap()
    };
    assert!(rests(&mut w) > Duration::from_secs(1));
    let hoop = w.place(31.83, 0.0, 60.0);
    w.click(hoop);
    w.wait("the touch", 60, |s| {
        s.session.caches.touching.result().is_some()
    });
    assert!(rests(&mut w) > Duration::from_secs(1));
}

/// Pictures that were looked at and found right, at half size: a change in them is to be looked at again
/// (`HAPDEF_REVIEW=1 cargo test --test studio reviewed` writes them anew).
#[test]
fn reviewed_pictures_stay_as_they_are() {
    let mut w = Window::open();
    reviewed(&mut w, "start");
    w.press("Unrolled");
    w.press("See-through");
    reviewed(&mut w, "see-through");
    w.press("See-through");
    w.press("Section");
    w.press("Paint");
    reviewed(&mut w, "section");
    w.press("Section");
    w.press("Touch");
    w.press("Front");
    let hoop = w.place(31.83, 0.0, 60.0);
    w.click(hoop);
    w.wait("the touch", 60, |s| {
        s.session.caches.touching.result().is_some()
    });
    w.harness.remove_cursor();
    reviewed(&mut w, "touch");
}

/// Compares what the window shows with the reviewed picture of that name.
fn reviewed(w: &mut Window, name: &str) {
    /// Of 255: what another version of the driver may differ by, on average and in a block of 8 × 8 pixels.
    const MEAN: f64 = 0.5;
    const BLOCK: f64 = 16.0;
    w.harness.run_ok();
    let whole = w.picture();
    let (width, height) = (whole.width() / 2, whole.height() / 2);
    let filter = image::imageops::FilterType::Triangle;
    let shown = image::imageops::resize(&whole, width, height, filter);
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reviewed");
    let path = folder.join(format!("{name}.png"));
    if std::env::var_os("HAPDEF_REVIEW").is_some() {
        shown.save(&path).unwrap();
        return;
    }
    let before = image::open(&path).unwrap().to_rgba8();
    assert_eq!(before.dimensions(), shown.dimensions());
    let off = |x: u32, y: u32| {
        let (a, b) = (before.get_pixel(x, y).0, shown.get_pixel(x, y).0);
        (0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0
    };
    let (mut all, mut worst) = (0.0, (0.0, 0, 0));
    for y in (0..height / 8).map(|k| 8 * k) {
        for x in (0..width / 8).map(|k| 8 * k) {
            let inside = (0..64).map(|k| off(x + k % 8, y + k / 8));
            let block = inside.sum::<f64>() / 64.0;
            all += block / f64::from((width / 8) * (height / 8));
            if block > worst.0 {
                worst = (block, x, y);
            }
        }
    }
    if all > MEAN || worst.0 > BLOCK {
        let aside = std::env::temp_dir().join(format!("hapdef-{name}.png"));
        shown.save(&aside).unwrap();
        panic!(
            "{name} looks otherwise: {all:.2} on average, {:.0} at ({}, {}) of the half-size picture; see {}",
            worst.0,
            worst.1,
            worst.2,
            aside.display()
        );
    }
}
