//! A whole session without a window: open, change, run, drop what is stale, cancel, undo, save, connect.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::coarse;
use hapdef::board::Illness;
use hapdef::budget::Quality;
use hapdef::document::Document;
use hapdef::io::opening::bundled;
use hapdef::io::project_file::LoadedProject;
use hapdef::session::{Attention, Happening, Mishap, Opened, Session, Task, Wake};

/// A session on a limb so coarse that a simulation ends soon.
fn limb() -> LoadedProject {
    let mut loaded = bundled().unwrap();
    loaded.inputs = coarse::limb();
    let project = &mut loaded.inputs.project;
    project.budget.quality = Quality::Draft;
    project.touch.count = 60;
    loaded
}

fn session() -> Session {
    Session::new(Document::new(limb(), None), Wake::default())
}

fn advance_until(session: &mut Session, what: &str, done: impl Fn(&Session) -> bool) {
    let start = Instant::now();
    while !done(session) {
        assert!(
            start.elapsed() < Duration::from_mins(2),
            "timed out waiting for {what}: {:?}",
            session.news.messages
        );
        session.advance(&Attention::default());
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn until_idle(session: &mut Session) {
    advance_until(session, "all jobs", |s| !s.busy());
}

fn said(session: &Session, words: &str) -> bool {
    let messages = &session.news.messages;
    messages.iter().any(|m| m.text.contains(words))
}

#[test]
fn what_is_run_holds_until_what_it_depends_on_changes() {
    let mut s = session();
    s.simulate();
    until_idle(&mut s);
    assert_eq!(s.simulation_holds(), Some(true));
    assert!(s.news.messages.is_empty(), "{:?}", s.news.messages);
    // The filters follow by themselves.
    advance_until(&mut s, "the filters", |s| s.current_verdicts().is_some());

    // A change that nothing of it depends on, and one that all depends on.
    s.document.state.project.selection.sensors += 1;
    s.document.settle();
    assert_eq!(s.simulation_holds(), Some(true));
    let thickness = s.document.state.project.part.thickness_mm;
    s.desk.follow = false;
    s.document.state.project.part.thickness_mm = 2.0 * thickness;
    s.document.settle();
    assert_eq!(s.simulation_holds(), Some(false));
    assert!(s.current_verdicts().is_none());
    s.advance(&Attention::default());
    assert!(!s.busy(), "nothing begins by itself");
    // Undone, what was there is right again.
    s.undo();
    assert_eq!(s.document.state.project.part.thickness_mm, thickness);
    assert_eq!(s.simulation_holds(), Some(true));
    assert!(s.current_verdicts().is_some());
}

#[test]
fn what_comes_too_late_is_dropped_and_what_is_cancelled_does_not_come() {
    let mut s = session();
    s.desk.follow = false;
    s.simulate();
    assert!(s.jobs.runs(Task::Simulate(Quality::Draft)));
    // Nobody follows: the job goes on, but nobody wants what it brings.
    s.document.state.project.part.thickness_mm *= 1.5;
    until_idle(&mut s);
    assert!(said(&s, "settings that have changed since"));
    assert!(s.results.simulation.is_none());

    s.simulate();
    s.cancel();
    assert!(!s.busy() && said(&s, "Cancelled: Simulate (draft)"));
    for _ in 0..20 {
        s.advance(&Attention::default());
    }
    assert!(!s.busy() && s.results.simulation.is_none());
    let ended = s.jobs.ended();
    assert!(ended.iter().any(|e| e.how == "cancelled"), "{ended:?}");
}

#[test]
fn a_hand_at_the_settings_is_waited_for() {
    let mut s = session();
    s.simulate();
    until_idle(&mut s);
    s.document.state.project.part.thickness_mm *= 1.5;
    let hand = Attention {
        hand: true,
        ..Attention::default()
    };
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(600) {
        s.advance(&hand);
        assert!(!s.busy());
    }
    s.advance(&Attention::default());
    assert!(s.jobs.runs(Task::Simulate(Quality::Draft)));
    s.cancel();
}

#[test]
fn another_project_takes_the_place_of_all_that_was_known() {
    let mut s = session();
    s.simulate();
    until_idle(&mut s);
    s.measure_walls();
    until_idle(&mut s);
    assert!(s.advice().is_some());
    let before = s.document.state.clone();
    // What still runs for the old one brings nothing to the new one.
    s.document.state.project.touch.tip_radius_mm *= 1.1;
    let changed = Opened::new(bundled().unwrap(), None, before);
    s.open(changed);
    assert!(said(&s, "was changed while the file was read"));
    let before = s.document.state.clone();
    s.simulate();
    s.news.tell("The report is in a folder");
    // Even of the very same part: what was measured of it belongs to the session that is gone.
    s.open(Opened::new(limb(), None, before));
    assert!(s.results.simulation.is_none() && !s.busy());
    for _ in 0..50 {
        s.advance(&Attention::default());
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(s.results.simulation.is_none());
    assert!(s.advice().is_none());
    // So does what was told of it, but not what went wrong.
    assert!(!said(&s, "The report is in"));
    assert!(said(&s, "was changed while the file was read"));
    let opened = |e: &Happening| matches!(e, Happening::Opened { .. });
    assert!(s.news.take_events().iter().any(opened));
}

#[test]
fn what_is_saved_opens_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.hapdef.toml");
    let mut s = Session::new(Document::new(bundled().unwrap(), None), Wake::default());
    s.document.state.project.touch.force_n = 7.5;
    s.save_to(&path);
    assert!(s.document.is_dirty());
    until_idle(&mut s);
    assert!(!s.document.is_dirty(), "{:?}", s.news.messages);
    assert_eq!(s.news.take_events(), [Happening::Saved(path.clone())]);

    let mut again = session();
    again.open_path(&path, None);
    until_idle(&mut again);
    assert_eq!(again.document.state.project.touch.force_n, 7.5);
    assert_eq!(again.document.path.as_deref(), Some(path.as_path()));
    // What cannot be read leaves what is open.
    again.open_path(Path::new("nowhere.hapdef.toml"), None);
    until_idle(&mut again);
    assert!(said(&again, "nowhere.hapdef.toml"));
    assert_eq!(again.document.path.as_deref(), Some(path.as_path()));
}

#[test]
fn a_board_is_listened_to_by_the_model_of_the_gauges() {
    let mut s = session();
    let sites = std::mem::take(&mut s.document.state.project.selection.sites);
    s.connect("nowhere.hapdrec");
    assert!(said(&s, "There are no gauges yet") && !s.live.is_preparing());
    s.document.state.project.selection.sites = sites;
    s.connect("nowhere.hapdrec");
    assert!(s.live.is_preparing());
    // What was to be listened to is not there: that is said, and nothing is connected.
    advance_until(&mut s, "the end", |s| said(s, "nowhere.hapdrec"));
    assert!(!s.live.is_connected() && !s.live.is_preparing());
}

#[test]
fn what_happens_to_a_simulated_board_is_its_own() {
    let mut s = session();
    // Without a board nothing happens.
    s.let_happen(Mishap::Unplugged);
    s.start_simulated_board();
    advance_until(&mut s, "the board", |s| s.live.is_connected());
    let faults = |s: &Session| {
        let hosted = s.live.simulated_board().unwrap();
        let mut board = hosted.board.lock().unwrap();
        let faults = board.faults_mut();
        (faults.unplugged.len(), faults.channels.len())
    };
    assert_eq!(faults(&s), (0, 0));
    s.let_happen(Mishap::Ill(Illness::Dead));
    s.let_happen(Mishap::Ill(Illness::Stuck));
    s.let_happen(Mishap::Unplugged);
    assert_eq!(faults(&s), (1, 2));
    s.let_happen(Mishap::Recovery);
    assert_eq!(faults(&s), (1, 0));
    s.disconnect();
    assert!(s.live.simulated_board().is_none() && !s.live.is_connected());
}
