//! Live touch in the real window: a simulated board from start to replay.
#![cfg(feature = "studio")]

use crate::board::start;
use crate::window;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;
use std::time::Instant;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::design;
use hapdef::link::{Address, BAUD, ConnectionState, Listener, Pace, SessionEvent};
use hapdef::live::{LiveUpdate, Pipeline};
use hapdef::session::Session;
use hapdef::studio::Studio;

use egui_kittest::kittest::Queryable as _;
use window::Window;

/// One look at a touch whose force stands still: what was said, and the truth.
fn next_touch(w: &mut Window, after: Option<DVec3>) -> (LiveUpdate, DVec3, f64) {
    let found = std::cell::RefCell::new(None);
    w.wait("a touch", 40, |s: &Studio| {
        let truth = s.session.live.truth();
        if let (Some((place, force)), Some(update)) = (truth, s.session.live.update())
            && Some(place) != after
            && (12e-3..108e-3).contains(&place.z)
            && update.contact.is_some_and(|c| c.force > 0.25 * force)
            && force > 2.0
        {
            let mut seen = found.borrow_mut();
            let seen: &mut Vec<(LiveUpdate, DVec3, f64)> = seen.get_or_insert_with(Vec::new);
            seen.push((update, place, force));
            // The same force a few looks in a row: neither rising nor falling.
            return seen.len() > 6
                && seen
                    .iter()
                    .rev()
                    .take(6)
                    .all(|(_, p, f)| *p == place && (*f - force).abs() < 1e-9);
        }
        false
    });
    let seen = found.into_inner().unwrap();
    seen.into_iter().next_back().unwrap()
}

#[test]
fn a_simulated_board_from_start_to_replay() {
    let mut w = Window::open();
    let folder = tempfile::tempdir().unwrap();
    w.stage("Live");
    w.press("Start a simulated board");
    w.wait("the board", 120, |s| {
        s.session.live.state() == Some(ConnectionState::Live)
    });
    w.wait("the tare", 20, |s| {
        s.session.live.update().is_some_and(|u| u.strain.is_some())
    });
    w.press("Tare");
    w.wait("another tare", 20, |s| {
        s.session.live.update().is_some_and(|u| u.strain.is_none())
    });
    w.wait("its end", 20, |s| {
        s.session.live.update().is_some_and(|u| u.strain.is_some())
    });

    // As drawn, the gauges are known as well as a workshop glues; known touches show how they really are.
    w.session_mut().calibrate_from_board();
    w.wait("known touches", 90, |s| {
        s.session.known_touches() >= 12 && !s.session.document.state.project.live.glued.is_empty()
    });
    let off = w.session().document.state.project.live.model_error;
    assert!(off < 0.1, "still off by {off}");
    let (mut errors, mut held, mut before) = (Vec::new(), 0, None);
    for _ in 0..6 {
        let (update, place, force) = next_touch(&mut w, before);
        before = Some(place);
        let contact = update.contact.unwrap();
        let error = contact.position.distance(place);
        errors.push(error * 1e3);
        held += usize::from(error <= 1.5 * contact.region.radius);
        assert!(
            (contact.force - force).abs() < 0.25 * force + 1.0,
            "{} for {force} N",
            contact.force
        );
    }
    errors.sort_by(f64::total_cmp);
    assert!(
        errors[3] < 3.0 && held >= 4,
        "{errors:?} mm, {held} of 6 within the region"
    );
    if let Some(path) = std::env::var_os("HAPDEF_PICTURES") {
        w.picture().save(Path::new(&path).join("live.png")).unwrap();
    }

    compare(&mut w);
    known(&mut w);
    unplug(&mut w);
    let seen = record(&mut w, &folder.path().join("touches.hapdrec"));
    replay(&mut w, &folder.path().join("touches.hapdrec"), &seen);
    recall(&mut w, &folder.path().join("pressed.hapdef.toml"));
}

/// The known touches lie in the project's file with the board that read them, and are there again when it is opened.
fn recall(w: &mut Window, path: &Path) {
    let presses = w.session().document.state.project.live.presses.clone();
    assert!(presses.len() >= 12 && presses.iter().all(|p| p.board.is_some()));
    w.session_mut().save_to(path);
    w.wait("the file", 20, |_| path.is_file());
    w.session_mut().open_path(path, None);
    w.wait("the project", 30, |s| s.session.known_touches() == 0);
    assert_eq!(w.session().document.path.as_deref(), Some(path));
    assert_eq!(w.session().document.state.project.live.presses, presses);
    w.stage("Live");
    w.press("Start a simulated board");
    w.wait("the touches of before", 120, |s| {
        s.session.known_touches() == presses.len()
    });
    another_board(w);
}

/// What one board has read of touches says nothing of what another reads, and is there again with its own.
fn another_board(w: &mut Window) {
    let known = w.session().known_touches();
    let number = |s: &Session| s.live.look(|f| f.hello.as_ref().map(|h| h.board));
    let own = number(w.session()).flatten().unwrap();
    let other = start(&[
        "board",
        "--simulate",
        "--quality",
        "draft",
        "--seed",
        "5",
        "--tcp",
    ]);
    let port = other.json()["port"].as_str().unwrap().to_owned();
    w.session_mut().connect(&port);
    w.wait("the other board", 60, |s| {
        number(&s.session)
            .flatten()
            .is_some_and(|board| board != own)
    });
    assert_eq!(w.session().known_touches(), 0);
    assert_eq!(
        w.session().document.state.project.live.presses.len(),
        known,
        "kept for the board that read them"
    );
    w.press("Disconnect");
    w.press("Start a simulated board");
    w.wait("its own touches", 60, |s| {
        number(&s.session).flatten() == Some(own) && s.session.known_touches() == known
    });
}

/// All three estimators beside each other; the trained ones learn in the background.
fn compare(w: &mut Window) {
    w.harness.get_by_label("Compare all").click();
    w.harness.get_by_label("Known touches").click();
    w.harness.run_ok();
    w.wait("the trained ones", 120, |s| {
        s.session
            .live
            .update()
            .is_some_and(|u| u.guesses[..2].iter().all(Option::is_some))
    });
    if let Some(path) = std::env::var_os("HAPDEF_PICTURES") {
        w.picture()
            .save(Path::new(&path).join("live-compare.png"))
            .unwrap();
    }
    w.assert_named("live");
    w.harness.get_by_label("Compare all").click();
    w.harness.run_ok();
}

/// Known touches are checked beside each other, left out, taken in again and deleted; a click on the limb says where the
/// next one is pressed.
fn known(w: &mut Window) {
    let counts = |w: &Window| (w.session().known_touches(), w.session().known_used());
    let of_list = |w: &Window, number: usize| {
        let mut list = w.session().known_list();
        list.find(|(n, _)| *n == number).unwrap().1.clone()
    };
    let (count, used) = counts(w);
    assert!(count >= 12 && used == count);
    w.wait("a look at all", 90, |s| {
        s.session
            .known_list()
            .all(|(_, touch)| touch.misfit.is_some())
    });
    let mut misfits: Vec<f64> = (w.session().known_list())
        .map(|(_, touch)| touch.misfit.unwrap())
        .collect();
    misfits.sort_by(f64::total_cmp);
    assert!(misfits[count / 2] < 4.0, "{misfits:?}");
    if let Some(path) = std::env::var_os("HAPDEF_PICTURES") {
        let path = Path::new(&path).join("live-known.png");
        w.picture().save(path).unwrap();
    }

    let click = |w: &mut Window, name: &str| {
        w.harness.get_by_label(name).click_accesskit();
        w.harness.run_ok();
    };
    click(w, "Known touch 2");
    assert_eq!(counts(w), (count, count - 1));
    assert!(!of_list(w, 1).used);
    w.harness.get_by_label_contains("1 left out");
    click(w, "Known touch 2");
    assert_eq!(counts(w), (count, count));
    let second = of_list(w, 1);
    click(w, "Delete known touch 1");
    assert_eq!(counts(w), (count - 1, count - 1));
    assert_eq!(of_list(w, 0).press.at, second.press.at);

    let proposed = w.session().proposed_touch().unwrap();
    click(w, "Click on the limb says where");
    w.click(w.place(31.83, 0.0, 60.0));
    w.harness.run_ok();
    let asked = w.session().proposed_touch().unwrap();
    assert!(
        asked.distance(proposed) > 1e-3 && asked.distance(DVec3::new(31.83e-3, 0.0, 60e-3)) < 2e-3
    );
    click(w, "Click on the limb says where");
}

/// Noticed, and found again once it is plugged in.
fn unplug(w: &mut Window) {
    // Until it was seen: a window that waits for the processor may miss a second.
    pull(w, f64::INFINITY);
    // Where the terminal is given to another board of these tests meanwhile, that one is found, and tried.
    w.wait("the unplug", 30, |s| {
        s.session.live.state() != Some(ConnectionState::Live)
    });
    assert!(
        w.session().live.update().is_none(),
        "no touch is shown of a board that is gone"
    );
    pull(w, 0.0);
    w.wait("the plug", 30, |s| {
        s.session.live.state() == Some(ConnectionState::Live)
    });
    // The rest is still known.
    w.wait("strains", 30, |s| {
        s.session.live.update().is_some_and(|u| u.strain.is_some())
    });
}

/// Takes the board's plug out from now on for so long (s), or puts it back.
fn pull(w: &Window, seconds: f64) {
    let hosted = w.session().live.simulated_board().unwrap();
    let now = hosted.seconds();
    let mut board = hosted.board.lock().unwrap();
    board.faults_mut().unplugged = vec![(now, now + seconds)];
}

/// What the window saw while it was recording.
fn record(w: &mut Window, path: &Path) -> BTreeMap<u64, LiveUpdate> {
    w.wait("no touch", 20, |s| {
        s.session.live.update().is_some_and(|u| u.contact.is_none())
            && s.session.live.truth().is_none()
    });
    w.session_mut().record(path);
    let seen = std::cell::RefCell::new(BTreeMap::new());
    let begun = Instant::now();
    w.wait("a few touches", 30, |s| {
        if let Some(update) = s.session.live.update() {
            seen.borrow_mut().insert(update.time_us, update);
        }
        begun.elapsed().as_secs_f64() > 4.0
    });
    w.session_mut().stop_recording();
    w.wait("the file", 10, |_| {
        std::fs::metadata(path).is_ok_and(|m| m.len() > 50_000)
    });
    seen.into_inner()
}

/// The recording says the very same, in the window's own thread and in another.
fn replay(w: &mut Window, path: &Path, seen: &BTreeMap<u64, LiveUpdate>) {
    let inputs = w.session().document.inputs();
    let budget = inputs.project.budget.budget();
    let sensing = design::sensing(&inputs, &budget, &unwatched).unwrap();
    let live = &inputs.project.live;
    let pipeline = Pipeline::new(sensing.map_for(live), live.settings(sensing.gauges.len()));
    let address = Address::parse(&path.display().to_string(), BAUD, Pace::Fast);
    let mut again = BTreeMap::new();
    let mut truths = 0;
    let (_commands, inbox) = channel();
    Listener::new(address, pipeline)
        .run(&AtomicBool::new(false), &inbox, |heard| match heard {
            SessionEvent::Sample { update, .. } => {
                again.insert(update.time_us, update.clone());
            }
            SessionEvent::Truth(Some(_)) => truths += 1,
            _ => {}
        })
        .unwrap();
    let (mut compared, mut touches) = (0, 0);
    for (time, update) in seen {
        let Some(other) = again.get(time) else {
            continue;
        };
        assert_eq!(update.contact, other.contact, "at {time} µs");
        assert_eq!(update.strain, other.strain);
        assert_eq!(update.blind, other.blind);
        compared += 1;
        touches += usize::from(update.contact.is_some());
    }
    assert!(
        compared > 50 && touches > 10 && truths > 0,
        "{compared} compared, {touches} of them touches, {truths} truths"
    );

    w.session_mut().write_table(path);
    w.wait("the table", 60, |s| !s.busy());
    let table = std::fs::read_to_string(path.with_extension("csv")).unwrap();
    assert_eq!(table.lines().count(), again.len() + 1);
    w.session_mut().connect(&path.display().to_string());
    w.wait("the replay", 60, |s| {
        s.session.live.update().is_some_and(|u| u.contact.is_some())
    });
    w.wait("its end", 60, |s| s.session.live.state().is_none());
}
