//! The stage “Bench” in the real window, on a simulated bench.
#![cfg(feature = "studio")]

use std::path::Path;
use std::time::{Duration, Instant};

use hapdef::budget::Quality;
use hapdef::session::PressState;
use hapdef::studio::{Stage, Standing};
use hapdef::test_bed::pressed;

use crate::window;
use window::Window;

const PLACES: usize = 32;

/// The bundled limb at the bench, into a folder.
fn at_the_bench(folder: &Path) -> Window {
    let mut w = Window::open();
    let session = w.session_mut();
    session.document.state.project.budget.quality = Quality::Draft;
    session.desk.bench.folder = folder.display().to_string();
    session.desk.bench.asked.places = PLACES;
    w.harness.run_ok();
    w.stage("Bench");
    w
}

fn made(w: &Window) -> usize {
    w.session()
        .bench
        .look(|p| p.made_and_failed()[0])
        .unwrap_or(0)
}

fn standing(w: &Window) -> Standing {
    w.harness.state().standing(Stage::Bench)
}

#[test]
fn a_run_is_planned_paused_stopped_and_gone_on_with() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("run");
    let mut w = at_the_bench(&folder);
    assert_eq!(standing(&w), Standing::Open);
    w.press("Plan presses");
    w.wait("the plan", 240, |s| s.session.bench.look(|_| ()).is_some());
    let all = w.session().bench.look(|p| p.states.len()).unwrap();
    assert!((PLACES * 2 / 3..=PLACES).contains(&all), "{all} places");
    assert!(made(&w) == 0 && standing(&w) == Standing::Open);
    w.show("bench-plan");
    // As long as nothing was pressed, another plan takes its place; and none is pressed while one is made.
    w.session_mut().desk.bench.asked.places = PLACES / 2;
    w.session_mut().plan_presses();
    w.session_mut().press_plan();
    w.wait("the other plan", 60, |s| !s.busy());
    let fewer = w.session().bench.look(|p| p.states.len()).unwrap();
    assert!(fewer <= PLACES / 2 && !w.session().bench.goes_on());
    let news = &w.session().news.messages;
    assert!(
        news.iter().any(|m| m.text.contains("or is planned")),
        "{news:?}"
    );
    w.session_mut().desk.bench.asked.places = PLACES;

    w.press("Press the plan");
    w.wait("some presses", 240, |s| {
        s.session.bench.look(|p| p.made_and_failed()[0] >= 5) == Some(true)
    });
    assert_eq!(standing(&w), Standing::Running);
    w.press("Pause pressing");
    // The one that goes on is ended, and none is begun.
    w.wait("the pause", 60, |s| {
        s.session
            .bench
            .look(|p| !p.checking && !p.states.contains(&PressState::Now))
            == Some(true)
    });
    let before = made(&w);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(700) {
        w.harness.step();
    }
    assert!(w.session().bench.goes_on() && made(&w) == before);
    w.show("bench-paused");

    w.press("Pause pressing");
    w.wait("more presses", 60, |s| {
        s.session.bench.look(|p| p.made_and_failed()[0] > before) == Some(true)
    });
    w.press("Stop pressing");
    w.wait("the stop", 60, |s| !s.session.bench.goes_on() && !s.busy());
    let said = w.session().bench.look(|p| p.said.join("; ")).unwrap();
    assert!(said.contains("stopped by hand"), "{said}");
    // What the folder holds is what the window believes, but for what was not checked yet.
    let kept = pressed(&folder).unwrap().len();
    assert!(
        kept <= made(&w) && made(&w) < all,
        "{kept} of {} of {all}",
        made(&w)
    );

    w.press("Press the plan");
    w.wait("all presses", 240, |s| {
        !s.busy()
            && s.session
                .bench
                .look(|p| p.made_and_failed()[0] == p.states.len())
                == Some(true)
    });
    assert_eq!(pressed(&folder).unwrap().len(), all);
    assert_eq!(standing(&w), Standing::Current);
    w.show("bench-pressed");
    learn(&mut w, &folder);

    // Other gauges are another run: it is not mixed into this one.
    w.session_mut().document.state.project.selection.sites.pop();
    w.harness.run_ok();
    assert_eq!(standing(&w), Standing::Stale);
    w.press("Plan presses");
    w.wait("the refusal", 240, |s| !s.busy());
    let news = &w.session().news.messages;
    assert!(
        news.iter().any(|m| m.text.contains("other gauges")),
        "{news:?}"
    );
    assert_eq!(pressed(&folder).unwrap().len(), all);
}

/// What was pressed teaches an estimator; it is kept as a file, and live touch goes by it.
fn learn(w: &mut Window, folder: &Path) {
    w.press("Learn from the presses");
    w.wait("the estimator", 240, |s| !s.busy());
    let learnt = w.session().learnt().expect("something was learned");
    let path = folder.join("estimator-1.hapdtouch");
    assert!(learnt.path == path && path.is_file());
    let origin = &learnt.file.header.origin;
    assert!(
        origin.estimator.name().starts_with("matching") && origin.tried.len() == 6,
        "{origin:?}"
    );
    assert!(
        origin.test.median_mm < 1.5 && origin.limb.is_some(),
        "{origin:?}"
    );
    w.show("bench-learned");

    w.stage("Live");
    w.press("Start a simulated board");
    let mut off = Vec::new();
    let found = std::cell::RefCell::new(&mut off);
    w.wait("touches", 240, |s| {
        let live = &s.session.live;
        if let (Some((place, force)), Some(contact)) =
            (live.truth(), live.update().and_then(|u| u.contact))
            && force > 2.0
        {
            found
                .borrow_mut()
                .push(contact.position.distance(place) * 1e3);
        }
        found.borrow().len() >= 20
    });
    off.sort_by(f64::total_cmp);
    assert!(off[off.len() / 2] < 2.0, "{off:?}");
    w.show("live-learned");

    // Which board it was learned with is known, and so is what is no estimator.
    w.press("Disconnect");
    w.session_mut().close_estimator();
    assert!(w.session().learnt().is_none());
    w.session_mut().open_estimator(&folder.join("bench.json"));
    w.wait("the refusal", 30, |s| !s.busy());
    assert!(w.session().learnt().is_none());
    let news = &w.session().news.messages;
    assert!(
        news.iter()
            .any(|m| m.error && m.text.contains("bench.json")),
        "{news:?}"
    );
    w.session_mut().open_estimator(&path);
    w.wait("the estimator", 30, |s| !s.busy());
    assert!(w.session().learnt().is_some());
    w.stage("Bench");
}

#[test]
fn the_emergency_stop_works_at_any_moment_and_leaving_takes_the_tip_back() {
    let home = tempfile::tempdir().unwrap();
    let mut w = at_the_bench(&home.path().join("run"));
    w.press("Press the plan");
    w.wait("a press", 240, |s| {
        s.session.bench.goes_on() && {
            s.session
                .bench
                .look(|p| p.states.contains(&PressState::Now))
                == Some(true)
        }
    });
    // Whatever is open.
    w.key(egui::Modifiers::COMMAND, egui::Key::K);
    let keys = egui::Modifiers::COMMAND | egui::Modifiers::SHIFT;
    w.key(keys, egui::Key::X);
    w.wait("the halt", 30, |s| !s.session.bench.goes_on());
    let said = w.session().bench.look(|p| p.said.join("; ")).unwrap();
    assert!(said.contains("M112"), "{said}");
    w.wait("the end of the job", 30, |s| !s.busy());
    w.key(egui::Modifiers::NONE, egui::Key::Escape);

    w.press("Press the plan");
    w.wait("a press", 240, |s| {
        s.session
            .bench
            .look(|p| p.states.contains(&PressState::Now))
            == Some(true)
    });
    w.session_mut().leave_bench();
    assert!(!w.session().bench.goes_on());
    let said = w.session().bench.look(|p| p.said.join("; ")).unwrap();
    assert!(said.contains("stopped by hand"), "{said}");
}
