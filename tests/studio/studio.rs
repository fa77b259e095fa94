//! The real window: driven by its accessible names, rendered by a real wgpu adapter.
#![cfg(feature = "studio")]
#![allow(
    clippy::format_push_string,
    reason = "a small file is put together here"
)]

use crate::window;

use egui::{Modifiers, Pos2};
use egui_kittest::kittest::Queryable as _;
use glam::DVec3;
use hapdef::budget::Quality;
use hapdef::document::{Brush, Layer};
use hapdef::placement::{LostBy, SelectorKind};
use hapdef::project::SelectionKeys;
use hapdef::studio::{Field, Studio, UiCommand};
use image::RgbaImage;
use window::Window;

/// Pixels of a rectangle of the view that are clearly not its backdrop.
fn lit(picture: &RgbaImage, center: Pos2, radius: i64) -> usize {
    let mut count = 0;
    for dy in -radius..=radius {
        for dx in -radius..=radius {
            let p = picture.get_pixel((center.x as i64 + dx) as u32, (center.y as i64 + dy) as u32);
            count += usize::from(p.0[..3].iter().map(|&c| u32::from(c)).sum::<u32>() > 240);
        }
    }
    count
}

/// Mean brightness (0–255) of a square.
fn brightness(picture: &RgbaImage, center: Pos2, radius: i64) -> f64 {
    let mut sum = 0.0;
    for dy in -radius..=radius {
        for dx in -radius..=radius {
            let p = picture.get_pixel((center.x as i64 + dx) as u32, (center.y as i64 + dy) as u32);
            sum += p.0[..3].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
        }
    }
    sum / ((2 * radius + 1).pow(2) as f64)
}

/// Mean (blue - red) of a square: sea-green of the region and blue of compression are above grey.
fn blueness(picture: &RgbaImage, center: Pos2, radius: i64) -> f64 {
    let mut sum = 0.0;
    for dy in -radius..=radius {
        for dx in -radius..=radius {
            let p = picture.get_pixel((center.x as i64 + dx) as u32, (center.y as i64 + dy) as u32);
            sum += f64::from(p.0[2]) - f64::from(p.0[0]);
        }
    }
    sum / ((2 * radius + 1).pow(2) as f64)
}

/// No marker of a gauge, near or far, lies over what is looked at.
fn without_gauges(w: &mut Window) {
    let project = &mut w.session_mut().document.state.project;
    project.selection.sites.clear();
    w.harness.run_ok();
}

#[test]
fn the_limb_is_shown_and_bends_under_a_click() {
    let mut w = Window::open();
    without_gauges(&mut w);
    w.press("Front");
    // On the hoop at the front, between the columns.
    let hoop = w.place(31.83, 0.0, 60.0);
    let window = w.place(31.83, 0.0, 46.0);
    let before = w.picture();
    assert!(lit(&before, hoop, 6) > 150, "the hoop is drawn");
    let contrast = brightness(&before, hoop, 6) - brightness(&before, window, 6);
    assert!(
        contrast > 40.0,
        "through the window it is darker: {contrast}"
    );
    w.click(hoop);
    w.wait("the touch", 60, |s| {
        s.session.caches.touching.result().is_some()
    });
    let touched = w.session().caches.touching.result().unwrap();
    assert!(
        touched
            .touch
            .position
            .distance(DVec3::new(0.03183, 0.0, 0.060))
            < 2e-3
    );
    assert!(
        (0.2e-3..3e-3).contains(&touched.largest),
        "{}",
        touched.largest
    );
    assert_eq!(w.harness.state().view.field, Field::Strain);
    let after = w.picture();
    let changed = before
        .pixels()
        .zip(after.pixels())
        .filter(|(a, b)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 30))
        .count();
    assert!(
        changed > 8000,
        "the strain field is drawn: {changed} pixels changed"
    );
}

#[test]
fn what_moves_is_shaded_once_it_stands() {
    let mut w = Window::open();
    without_gauges(&mut w);
    w.press("Front");
    let mut turn = |by: f64, frames: Option<usize>| {
        let camera = &mut w.harness.state_mut().view.camera;
        camera.orbit(glam::DVec2::new(by, 0.0));
        match frames {
            Some(frames) => (0..frames).for_each(|_| w.harness.step()),
            None => {
                w.harness.run_ok();
            }
        }
        w.picture()
    };
    let before = turn(0.0, None);
    let moving = turn(40.0, Some(1));
    let stands = turn(0.0, None);
    let differing = |a: &RgbaImage, b: &RgbaImage| {
        let pairs = a.pixels().zip(b.pixels());
        pairs
            .filter(|(a, b)| (0..3).any(|c| a.0[c].abs_diff(b.0[c]) > 3))
            .count()
    };
    assert!(differing(&before, &moving) > 5000, "the limb turned");
    assert_eq!(differing(&stands, &turn(0.0, Some(3))), 0);
    if window::only_software() {
        let shaded = differing(&moving, &stands);
        assert!(
            shaded > 5000,
            "the frame after it is shaded: {shaded} pixels"
        );
    }
}

#[test]
fn painting_erasing_undo_and_redo() {
    let mut w = Window::open();
    without_gauges(&mut w);
    w.press("Front");
    w.press("Paint");
    let path: Vec<Pos2> = (0..8)
        .map(|k| w.place(31.0, -7.0 + 2.0 * f64::from(k), 60.0))
        .collect();
    w.drag(&path);
    let painted = w.painted().expect("a stroke paints");
    assert!(painted > 20 && painted < 600, "{painted}");
    let picture = w.picture();
    assert!(
        blueness(&picture, path[4], 4) > 15.0,
        "the region is tinted"
    );
    w.press("Erase");
    w.click(path[4]);
    assert!(w.painted().unwrap() < painted);
    w.harness
        .key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    w.harness.run_ok();
    assert_eq!(w.painted(), Some(painted));
    w.harness
        .key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    w.harness.run_ok();
    assert_eq!(w.painted(), None);
    w.harness
        .key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, egui::Key::Z);
    w.harness.run_ok();
    assert_eq!(w.painted(), Some(painted));
}

#[test]
fn from_the_limb_to_the_report() {
    let mut w = Window::open();
    w.press("Simulate");
    w.wait("the simulation", 120, |s| !s.busy());
    assert!(
        w.session().news.messages.is_empty(),
        "{:?}",
        w.session().news.messages
    );
    let sites = w
        .session()
        .results
        .simulation
        .as_ref()
        .unwrap()
        .value
        .simulated
        .dataset
        .sites
        .len();
    assert_eq!(sites, 3039);
    w.wait("the filters", 10, |s| {
        s.session.results.feasibility.is_some()
    });
    let selection = &mut w.session_mut().document.state.project.selection;
    (selection.sensors, selection.compare) = (5, true);
    w.harness.run_ok();
    w.press("Select gauges");
    w.wait("the selection", 300, |s| !s.busy());
    assert!(
        w.session().news.messages.is_empty(),
        "{:?}",
        w.session().news.messages
    );
    let design = &w.session().results.design.as_ref().unwrap().value.design;
    assert_eq!(design.chosen().len(), 5);
    assert!(
        design
            .evaluation
            .rows
            .iter()
            .any(|r| r.set.chooser.name() == "pca-qr")
    );
    // Wherever on the limb they are: from one side or from the other.
    let mut orange = 0;
    for side in ["Front", "Back"] {
        w.press(side);
        let picture = w.picture();
        let view = w.harness.state().view.rect;
        orange += (view.top() as u32..view.bottom() as u32)
            .flat_map(|y| (view.left() as u32..view.right() as u32).map(move |x| (x, y)))
            .filter(|&(x, y)| {
                let [r, g, b, _] = picture.get_pixel(x, y).0;
                r > 200 && (80..150).contains(&g) && b < 70
            })
            .count();
    }
    assert!(
        orange > 150,
        "the gauges are drawn: {orange} pixels of their colour"
    );
    // The error plot is there, by its name.
    assert_eq!(
        w.harness
            .get_all_by_label_contains("Error against number of gauges")
            .count(),
        2
    );
    let folder = tempfile::tempdir().unwrap();
    w.press("Export report…");
    let target = folder.path().join("report");
    w.type_path(&target);
    w.press("Export");
    w.wait("the export", 60, |s| {
        !s.busy() && !s.session.news.messages.is_empty()
    });
    assert!(
        target.join("report.html").exists(),
        "{:?}",
        w.session().news.messages
    );
    assert!(hapdef::io::project_file::load(&target.join("design.hapdef.toml")).is_ok());
}

#[test]
fn a_job_can_be_cancelled_and_bad_files_change_nothing() {
    let mut w = Window::open();
    w.session_mut().document.state.project.budget.quality = Quality::Standard;
    w.harness.run_ok();
    w.press("Simulate");
    w.wait("the job to report", 30, hapdef::studio::Studio::busy);
    w.press("Cancel: Simulate (draft)");
    w.wait("the cancelled job", 60, |s| !s.busy());
    assert!(w.session().results.simulation.is_none());
    let ended = w.session().jobs.ended();
    assert!(ended.iter().any(|e| e.how == "cancelled"), "{ended:?}");
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.glb");
    std::fs::write(&bad, b"glTF nonsense").unwrap();
    let before = w.session().document.inputs();
    w.open_file(&bad, None);
    let error = w
        .session()
        .news
        .messages
        .iter()
        .find(|m| m.error)
        .unwrap()
        .text
        .clone();
    assert!(error.contains("bad.glb"), "{error}");
    assert_eq!(w.session().document.state.project, before.project);
    // A part that nothing holds says so, and the window lives on.
    w.session_mut().document.state.project.supports.clear();
    w.harness.run_ok();
    w.press("Simulate");
    w.wait("the refusal", 60, |s| {
        !s.busy()
            && s.session
                .news
                .messages
                .iter()
                .any(|m| m.text.contains("support"))
    });
}

#[test]
fn results_survive_saving_and_undo_is_not_mistaken_for_them() {
    let mut w = Window::open();
    let key = w.session().document.simulation_inputs(Quality::Draft);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("elsewhere.hapdef.toml");
    w.session_mut().document.state.project.part.mesh = "other/limb.glb".into();
    assert_eq!(w.session().document.simulation_inputs(Quality::Draft), key);
    // A brush finer than the mesh leaves its mark and does not forbid everything in silence.
    w.press("Front");
    w.press("Paint");
    w.harness.state_mut().view.brush = 0.5e-3;
    let at = w.place(31.83, 0.6, 60.7);
    w.click(at);
    assert!(w.painted().unwrap() >= 1);
    // The bundled mesh is never written over another one.
    std::fs::write(folder.path().join("limb.glb"), b"mine").unwrap();
    w.harness
        .key_press_modifiers(Modifiers::COMMAND, egui::Key::S);
    w.harness.run_ok();
    w.type_path(&path);
    w.save_file();
    assert!(
        w.session()
            .news
            .messages
            .iter()
            .any(|m| m.error && m.text.contains("limb.glb"))
    );
    assert!(w.session().document.is_dirty());
    assert_eq!(
        std::fs::read(folder.path().join("limb.glb")).unwrap(),
        b"mine"
    );
}

#[test]
fn a_saved_project_opens_again() {
    let mut w = Window::open();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.hapdef.toml");
    w.press("Front");
    w.press("Paint");
    let at = w.place(31.83, 0.0, 60.0);
    w.click(at);
    let painted = w.painted().unwrap();
    w.harness
        .key_press_modifiers(Modifiers::COMMAND, egui::Key::S);
    w.harness.run_ok();
    w.type_path(&path);
    w.save_file();
    assert!(
        !w.session().document.is_dirty(),
        "{:?}",
        w.session().news.messages
    );
    w.session_mut().document.clear(Layer::Feasible);
    w.open_file(&path, None);
    assert_eq!(
        w.painted(),
        Some(painted),
        "{:?}",
        w.session().news.messages
    );
}

/// Two plates, the smaller one with a hole.
fn two_plates() -> String {
    let mut obj = String::new();
    let mut base = 0;
    for (size, n, hole) in [(80.0, 8, false), (40.0, 8, true)] {
        for j in 0..=n {
            for i in 0..=n {
                let step = size / f64::from(n);
                obj.push_str(&format!(
                    "v {} {} {}\n",
                    step * f64::from(i),
                    step * f64::from(j),
                    size
                ));
            }
        }
        for j in 0..n {
            for i in 0..n {
                if hole && i == 4 && j == 4 {
                    continue;
                }
                let a = base + j * (n + 1) + i + 1;
                obj.push_str(&format!("f {} {} {} {}\n", a, a + 1, a + n + 2, a + n + 1));
            }
        }
        base += (n + 1) * (n + 1);
    }
    obj
}

#[test]
fn a_file_of_several_bodies_asks_which_and_repairs_when_told() {
    let mut w = Window::open();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.obj");
    std::fs::write(&path, two_plates()).unwrap();
    w.open_file(&path, Some(hapdef::project::Unit::Millimetre));
    let said = &w.session().news.messages[0].text;
    assert!(said.contains("body 0 of 2"), "{said}");
    let triangles = |w: &Window| w.session().document.part.as_given().triangles().len();
    assert_eq!(triangles(&w), 128);
    let part = &mut w.session_mut().document.state.project.part;
    part.body = 1;
    part.fill_holes_mm = 10.0;
    w.harness.run_ok();
    // Nothing is computed on one part and labelled as another.
    w.press("Simulate");
    let state = w.harness.state();
    assert!(
        !state.busy()
            && state
                .session
                .news
                .messages
                .last()
                .unwrap()
                .text
                .contains("read again")
    );
    w.stage("Part");
    w.press("Read the mesh again");
    w.wait("the mesh", 60, |s| !s.busy());
    assert!(w.session().document.is_dirty());
    assert_eq!(triangles(&w), 128, "126 and the two that fill the hole");
    let document = &w.session().document;
    assert_eq!(document.repairs.filled_holes, 1);
    let (_, upper) = document.part.bounds();
    assert!((upper.x - 0.04).abs() < 1e-9 && !document.asks_for_another_part());
    // Hold what is painted: a support that undoes.
    let at = hapdef::mesh::SurfacePoint {
        triangle: 0,
        barycentric: [1.0 / 3.0; 3],
    };
    w.stage("Supports and material");
    w.press("Paint a support");
    assert_eq!(w.harness.state().view.layer, Layer::Support);
    let document = &mut w.session_mut().document;
    document.dab(Layer::Support, Brush::Paint, at, 0.02);
    document.settle();
    w.harness.run_ok();
    let state = &w.session().document.state;
    assert_eq!(
        state.project.supports[0].vertices.as_deref(),
        Some("support-1")
    );
    assert!(state.painted.is_none() && state.masks.contains_key("support-1"));
    w.session_mut().document.state.project.budget.quality = Quality::Draft;
    w.press("Simulate");
    w.wait("the simulation", 120, |s| !s.busy());
    assert!(w.session().results.simulation.is_some());
    // The quality, the stroke, and the support itself.
    for _ in 0..3 {
        w.session_mut().document.undo();
    }
    assert!(w.session().document.state.project.supports.is_empty());
}

#[test]
fn the_palette_reaches_every_command() {
    let mut window = Window::open();
    let painted = |w: &Window| {
        let mask = w.session().document.state.painted.clone();
        mask.map(|m| m.iter().filter(|&&m| m).count())
    };
    let vertices = window.session().document.part.positions().len();
    for (letters, expected) in [
        ("invert", Some(0)),
        ("fill painted", Some(vertices)),
        ("undo", Some(0)),
        ("clrpnt", None),
    ] {
        window
            .harness
            .key_press_modifiers(Modifiers::COMMAND, egui::Key::K);
        window.harness.run_ok();
        window
            .harness
            .get_by_label("Find a command")
            .type_text(letters);
        window.harness.run_ok();
        window.harness.key_press(egui::Key::Enter);
        window.harness.run_ok();
        assert_eq!(painted(&window), expected, "{letters}");
        assert!(window.harness.query_by_label("Find a command").is_none());
    }
    // Keys of single letters and brackets are the window's again.
    let brush = window.harness.state().view.brush;
    window.harness.key_press(egui::Key::CloseBracket);
    window.harness.run_ok();
    assert!(window.harness.state().view.brush > 1.2 * brush);
}

#[test]
fn what_was_not_saved_is_offered_again() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::open();
    window.harness.state_mut().keep_unsaved_in(home.path());
    window.harness.run_ok();
    assert!(!asks(&window), "nothing was left yet");
    {
        let document = &mut window.session_mut().document;
        document.state.project.selection.sensors = 7;
        document.invert(Layer::Feasible);
        document.shrink(Layer::Feasible, 0.0);
        document.fill(Layer::Feasible);
    }
    let kept = || {
        let folders = std::fs::read_dir(home.path()).unwrap();
        folders
            .filter_map(|f| Some(f.ok()?.path().join("origin.json")))
            .any(|f| f.exists())
    };
    window.wait("changes to be kept", 30, |_| kept());
    // Killed: nobody says goodbye.
    drop(window);
    let mut window = Window::open();
    window.harness.state_mut().keep_unsaved_in(home.path());
    window.harness.run_ok();
    assert!(asks(&window));
    window.press("Recover changes");
    window.wait("the changes", 60, |s| !s.busy());
    let document = &window.session().document;
    assert_eq!(document.state.project.selection.sensors, 7);
    assert!(document.state.painted.as_ref().unwrap().iter().all(|&m| m));
    assert!(document.is_dirty() && document.bundled && document.path.is_none());
    // It is kept again, since it is not saved yet; and gone when the window is closed.
    window.wait("changes to be kept again", 30, |_| kept());
    eframe::App::on_exit(window.harness.state_mut());
    drop(window);
    assert_eq!(std::fs::read_dir(home.path()).unwrap().count(), 0);
}

fn asks(window: &Window) -> bool {
    let dialog = window.harness.query_by_label("Recover unsaved changes?");
    dialog.is_some()
}

/// The bundled limb simulated, and its sites filtered.
fn simulated() -> Window {
    let mut w = Window::open();
    w.press("Simulate");
    w.wait("the simulation", 120, |s| !s.busy());
    w.wait("the filters", 20, |s| {
        s.session.results.feasibility.is_some()
    });
    w
}

fn gauges(w: &Window) -> Vec<hapdef::project::ChosenSite> {
    let project = &w.session().document.state.project;
    project.selection.sites.clone()
}

fn expected(w: &mut Window) -> f64 {
    w.wait("what is expected", 60, |s| {
        s.session.expected_error().is_some()
    });
    w.session().expected_error().unwrap()
}

#[test]
fn the_expected_error_and_its_map_follow_the_hand() {
    let mut w = simulated();
    w.press("Gauges");
    let before = expected(&mut w);
    assert!(before > 0.05 && before < 30.0, "{before}");
    for label in ["Expected error: ", "% blind at "] {
        assert!(w.harness.query_by_label_contains(label).is_some());
    }
    w.harness.state_mut().view.field = Field::Expected;
    w.wait("the map", 20, Studio::shows_field);
    w.press("Unrolled");
    let [x, y, z] = gauges(&w)[2].position_mm;
    let from = w.flat_place(x, y, z);
    let map = w.picture();
    let path: Vec<Pos2> = (0..=10)
        .map(|k| from + egui::vec2(3.0 * k as f32, 0.0))
        .collect();
    let sites = gauges(&w);
    w.drag(&path);
    assert_ne!(gauges(&w)[2], sites[2], "the gauge follows the pointer");
    let after = expected(&mut w);
    assert_ne!(after, before);
    let moved = w.picture();
    let both = map.pixels().zip(moved.pixels());
    let changed = both.filter(|(a, b)| a != b).count();
    assert!(changed > 1000, "the map follows: {changed} pixels changed");
    // One move is one step; the figure is what it was, but for the order in which gauges are taken in.
    w.key(Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(gauges(&w), sites);
    let again = expected(&mut w);
    assert!((again / before - 1.0).abs() < 0.02, "{again} {before}");
    w.click_label("Confusions");
    w.wait("the confusions", 60, |s| {
        s.session.worst_confusions().is_some()
    });
    let pairs = w.session().worst_confusions().unwrap();
    if !pairs.is_empty() {
        let target = w.harness.state().view.camera.target;
        w.click_label("Confusion 1");
        let looked_at = w.harness.state().view.camera.target;
        assert_ne!(looked_at, target, "it looks there");
    }
    w.assert_named("the confusions");
}

#[test]
fn the_jig_is_drawn_in_the_limb_while_it_is_asked_for() {
    let mut w = Window::open();
    w.harness.run();
    let before = w.picture();
    w.key(Modifiers::NONE, egui::Key::J);
    w.wait("the jig", 60, |s| s.session.jig().is_some());
    let jig = w.session().jig().unwrap();
    let arms: usize = jig.stacks.iter().map(|s| s.arms.len()).sum();
    assert_eq!(arms + jig.left_out.len(), gauges(&w).len());
    assert!(arms >= 8, "{arms}");
    w.show("jig");
    let shown = w.picture();
    let both = before.pixels().zip(shown.pixels());
    let changed = both.filter(|(a, b)| a != b).count();
    assert!(changed > 3000, "{changed} pixels changed");
    // Another set of gauges has another jig; without any there is none.
    without_gauges(&mut w);
    assert!(w.session().jig().is_none());
    w.key(Modifiers::NONE, egui::Key::J);
    assert!(!w.harness.state().view.jig_shown);
}

#[test]
fn one_key_adds_the_gauge_that_helps_most() {
    let w = Window::open();
    assert!(!w.harness.state().enabled(UiCommand::AddHelpful));
    drop(w);
    let mut w = simulated();
    w.press("Gauges");
    let before = expected(&mut w);
    let sites = gauges(&w);
    w.key(Modifiers::NONE, egui::Key::A);
    w.wait("the gauge", 120, |s| !s.busy());
    assert_eq!(gauges(&w).len(), sites.len() + 1);
    assert_eq!(w.harness.state().view.picked, [sites.len()]);
    let after = expected(&mut w);
    assert!(after < before, "{after} {before}");
    w.key(Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(gauges(&w), sites);
}

#[test]
fn one_key_finds_the_gauge_that_helps_least() {
    let w = Window::open();
    assert!(!w.harness.state().enabled(UiCommand::FindSpare));
    drop(w);
    let mut w = simulated();
    let sites = gauges(&w);
    w.key(Modifiers::NONE, egui::Key::W);
    w.wait("the gauge", 120, |s| !s.busy());
    let picked = w.harness.state().view.picked.clone();
    assert_eq!(picked.len(), 1);
    assert_eq!(gauges(&w), sites, "it is marked, not taken");
    w.key(Modifiers::NONE, egui::Key::Delete);
    let mut left = sites.clone();
    left.remove(picked[0]);
    assert_eq!(gauges(&w), left);
    w.key(Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(gauges(&w), sites);
}

/// Whether a control of the form is there, by its role and its name.
fn offers(w: &Window, role: egui::Role, name: &str) -> bool {
    w.harness.query_by_role_and_label(role, name).is_some()
}

/// Changes what is asked of the choice, as one step.
fn ask(w: &mut Window, how: impl FnOnce(&mut SelectionKeys)) {
    let document = &mut w.session_mut().document;
    how(&mut document.state.project.selection);
    document.settle();
    w.harness.run_ok();
}

#[test]
fn losses_exchange_and_starts_are_offered_where_they_are_heeded() {
    use egui::Role::{CheckBox, ComboBox, SpinButton};
    let mut w = Window::open();
    w.stage("Selection");
    let lost = (SpinButton, "Gauges lost");
    let counts = (ComboBox, "Which loss counts");
    let exchange = (CheckBox, "Exchange gauges");
    let starts = (SpinButton, "First gauges");
    for (selector, failure, [several, loss, exchanges, begins]) in [
        (
            SelectorKind::ExpectedError,
            0.0,
            [false, false, false, true],
        ),
        (SelectorKind::ExpectedError, 0.3, [true, true, false, true]),
        (SelectorKind::GreedySvr, 0.3, [false, true, true, true]),
        (SelectorKind::Entropy, 0.0, [false, false, true, true]),
        (SelectorKind::PcaQr, 0.0, [false; 4]),
    ] {
        ask(&mut w, |keys| {
            (keys.selector, keys.failure, keys.compare) = (selector, failure, false);
        });
        for ((role, name), offered) in [
            (lost, several),
            (counts, loss),
            (exchange, exchanges),
            (starts, begins),
        ] {
            assert_eq!(offers(&w, role, name), offered, "{selector:?}: {name}");
        }
    }
    // What greedy SVR refuses can be taken back.
    ask(&mut w, |keys| {
        (keys.selector, keys.failure, keys.lost) = (SelectorKind::GreedySvr, 0.3, 2);
    });
    assert!(offers(&w, lost.0, lost.1));
    w.assert_named("the losses");
    // As the rows beside them, they change the project and are undone.
    let keys = |w: &Window| w.session().document.state.project.selection.clone();
    let ticks = w.harness.get_by_role_and_label(exchange.0, exchange.1);
    ticks.click();
    w.harness.run_ok();
    assert!(keys(&w).exchange);
    w.key(Modifiers::COMMAND, egui::Key::Z);
    assert!(!keys(&w).exchange);
    w.harness.get_by_role_and_label(counts.0, counts.1).click();
    w.harness.run_ok();
    w.click_label(LostBy::Worst.title());
    assert_eq!(keys(&w).lost_by, LostBy::Worst);
    w.key(Modifiers::COMMAND, egui::Key::Z);
    assert_eq!(keys(&w).lost_by, LostBy::Expected);
}

#[test]
fn the_stage_of_candidates_says_where_all_sites_are_some() {
    let mut w = Window::open();
    w.stage("Candidates");
    let said = |w: &Window| w.harness.query_by_label("all are candidates").is_some();
    assert!(said(&w));
    ask(&mut w, |keys| keys.selector = SelectorKind::GreedySvr);
    assert!(!said(&w));
}
