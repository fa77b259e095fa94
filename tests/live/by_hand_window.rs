//! Presses by hand in the window: it shows where, and takes force and place from whoever presses.
#![cfg(feature = "studio")]

use glam::DVec3;

use hapdef::budget::Quality;
use hapdef::link::{BenchPress, bench_presses};
use hapdef::session::{HandStep, PressState};

use crate::by_hand::pressed_at;
use crate::window::Window;

/// On the ring that is seen from in front, and beside it.
const ASKED: [DVec3; 3] = [
    DVec3::new(31.83, 0.0, 60.0),
    DVec3::new(31.2, 6.0, 60.0),
    DVec3::new(31.2, -6.0, 60.0),
];
/// Where the second is pressed in truth.
const ELSEWHERE: DVec3 = DVec3::new(30.9, 8.0, 57.0);
const FORCES: [f64; 2] = [9.0, 11.5];

fn step(w: &Window) -> Option<HandStep> {
    w.session().bench.step()
}

/// Waits until a press is over, and says how hard it was.
fn tell(w: &mut Window, force: f64) {
    w.wait("the press", 30, |s| {
        s.session.bench.step() == Some(HandStep::TellForce)
    });
    w.session_mut().desk.bench.typed_n = force;
    w.harness.run_ok();
}

#[test]
fn the_window_shows_where_to_press_and_takes_force_and_place() {
    let home = tempfile::tempdir().unwrap();
    let (folder, points) = (home.path().join("run"), home.path().join("points.csv"));
    let rows = ASKED.map(|p| format!("{:.3},{:.3},{:.3}\n", p.x, p.y, p.z));
    std::fs::write(&points, format!("x_mm,y_mm,z_mm\n{}", rows.concat())).unwrap();

    let mut w = Window::open();
    let session = w.session_mut();
    session.document.state.project.budget.quality = Quality::Draft;
    let desk = &mut session.desk.bench;
    (desk.asked.by_hand, desk.asked.simulated) = (true, None);
    desk.points = points.display().to_string();
    desk.folder = folder.display().to_string();
    w.harness.run_ok();
    w.stage("Bench");
    w.press("Press the plan");
    let asked = |w: &Window, what: &str| {
        let news = &w.session().news.messages;
        assert!(news.iter().any(|m| m.text.contains(what)), "{news:?}");
    };
    asked(&w, "Name the board's port");
    // The model of the gauges is made before there is a board: it is listened to at once.
    w.press("Plan presses");
    w.wait("the plan", 240, |s| s.session.bench.look(|_| ()).is_some());
    w.show("by-hand-plan");

    let (_board, port) = pressed_at(
        home.path(),
        "window",
        &[(ASKED[0], FORCES[0]), (ELSEWHERE, FORCES[1])],
    );
    w.session_mut().desk.bench.board = port;
    w.harness.run_ok();
    w.press("Press the plan");
    w.wait("the first place", 30, |s| {
        s.session.bench.step() == Some(HandStep::Press)
    });
    w.assert_named("the bench by hand");
    w.show("by-hand-press");
    tell(&mut w, FORCES[0]);
    w.show("by-hand-force");
    w.press("Take this press");
    w.wait("the second place", 30, |s| {
        s.session.bench.look(|p| p.states.clone())
            == Some(vec![PressState::Made, PressState::Now, PressState::ToCome])
    });
    tell(&mut w, FORCES[1]);
    // A click that means no press of a simulated touch: it says where the hand was.
    let there = w.place(ELSEWHERE.x, ELSEWHERE.y, ELSEWHERE.z);
    w.click(there);
    w.wait("the place", 30, |s| {
        s.session
            .bench
            .look(|p| p.hand.is_some_and(|(_, moved)| moved.is_some()))
            == Some(true)
    });
    w.show("by-hand-moved");
    w.press("Take this press");
    w.wait("the third place", 30, |s| {
        s.session.bench.look(|p| p.made_and_failed()[0] == 2) == Some(true)
            && s.session.bench.step() == Some(HandStep::Press)
    });
    w.press("Leave this place out");
    w.wait("the end", 30, |s| !s.session.bench.goes_on() && !s.busy());
    assert_eq!(step(&w), None);
    w.show("by-hand-over");

    let parts = std::fs::read_dir(&folder)
        .unwrap()
        .map(|f| f.unwrap().path());
    let recordings = parts.filter(|p| p.extension().is_some_and(|e| e == "hapdrec"));
    let read: Vec<BenchPress> = recordings
        .flat_map(|p| bench_presses(&std::fs::read(p).unwrap()))
        .collect();
    assert_eq!(read.len(), 2, "{read:?}");
    for (press, (number, at)) in read
        .iter()
        .zip([ASKED[0], ELSEWHERE].into_iter().enumerate())
    {
        assert_eq!(press.number, number);
        assert_eq!(press.force, Some(FORCES[number]));
        let off = (press.at * 1e3).distance(at);
        assert!(off < 1.5, "press {number} is {off} mm off");
    }
}
