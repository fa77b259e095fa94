//! The window measured on a software adapter: `cargo bench --bench studio` writes `benches/studio.md`,
//! which `RESULTS.md` takes in.

mod timing;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use eframe::App as _;
use eframe::egui_wgpu::RenderState;
use egui::{Event, FullOutput, Modifiers, PointerButton, Pos2, RawInput, Rect, TexturesDelta};
use glam::{DVec2, DVec3};
use hapdef::budget::Quality;
use hapdef::cli;
use hapdef::design::{InHand, Inputs};
use hapdef::document::Layer;
use hapdef::io::project_file::LoadedProject;
use hapdef::io::study_folder::{StudyFolder, UnitCost, UnitOutcome};
use hapdef::mesh::TriMesh;
use hapdef::parameter_study::Points;
use hapdef::plain::robust_top;
use hapdef::project::{KeptError, KeptSelection, Masks, Project};
use hapdef::render::offscreen::{self, Canvas};
use hapdef::studio::{Studio, Tab, Tool};
use timing::{cpu_seconds, reference_seconds, thread_seconds};

const FILE: &str = "benches/studio.md";

const SIZE: [u32; 2] = [1440, 900];

/// The window on a software adapter, frame by frame, without anybody to look at it.
struct Window {
    state: RenderState,
    ctx: egui::Context,
    studio: Studio,
    events: Vec<Event>,
    /// Of frames that were not drawn.
    textures: TexturesDelta,
    time: f64,
}

impl Window {
    fn open(state: &RenderState, loaded: LoadedProject) -> Self {
        let mut window = Self::first(state, loaded);
        for _ in 0..30 {
            window.step();
        }
        window
    }

    fn first(state: &RenderState, loaded: LoadedProject) -> Self {
        let ctx = egui::Context::default();
        let mut cc = eframe::CreationContext::_new_kittest(ctx.clone());
        cc.wgpu_render_state = Some(state.clone());
        let studio = Studio::new(&cc, loaded, None).expect("an adapter");
        Self {
            state: state.clone(),
            ctx,
            studio,
            events: Vec::new(),
            textures: TexturesDelta::default(),
            time: 0.0,
        }
    }

    /// What the window's own thread does for a frame.
    fn output(&mut self) -> FullOutput {
        self.time += 1.0 / 60.0;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(
                Pos2::ZERO,
                egui::vec2(SIZE[0] as f32, SIZE[1] as f32),
            )),
            time: Some(self.time),
            events: std::mem::take(&mut self.events),
            ..RawInput::default()
        };
        let mut frame = eframe::Frame::_new_kittest();
        let studio = &mut self.studio;
        self.ctx.run_ui(input, |ui| studio.ui(ui, &mut frame))
    }

    fn step(&mut self) {
        let output = self.output();
        self.textures.append(output.textures_delta);
    }

    /// A whole frame, drawn.
    fn draw(&mut self, canvas: &Canvas) {
        let mut output = self.output();
        let mut textures = std::mem::take(&mut self.textures);
        textures.append(std::mem::take(&mut output.textures_delta));
        output.textures_delta = textures;
        canvas.paint(&self.ctx, output).expect("a picture");
    }

    fn hover(&mut self, at: Pos2) {
        self.events.push(Event::PointerMoved(at));
    }

    fn button(&mut self, pos: Pos2, pressed: bool) {
        self.events.push(Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
    }
}

fn main() {
    let mut page = String::new();
    let reference = reference_seconds();
    let _ = writeln!(
        page,
        "## The window\n\nThe figures of the window are remade by `cargo bench --bench studio` (a minute). Processor milliseconds of the whole process, the software adapter's threads among them, 1440 × 900 pixels; a 4000 × 4000 matrix product on one core took {reference:.1} s beside them (the reference). A bare frame draws the same triangles anew as the camera moves, with the whole window around them; once it stands, one more is drawn with light in corners and a floor (a software adapter leaves these out while something moves). Steps are what the window's own thread does beside drawing, over those of a frame in which nothing happens.\n"
    );
    start(&mut page);
    let state = offscreen::adapter().expect("an adapter: install mesa-vulkan-drivers");
    steps(&mut page, &state);
    overlay(&mut page, &state);
    study(&mut page, &state);
    estimate(&mut page);
    in_hand(&mut page, reference);
    std::fs::write(FILE, &page).expect("the file can be written");
    println!("{page}");
}

/// A tube of so many triangles.
fn tube(triangles: usize) -> LoadedProject {
    let around = ((triangles as f64 * 0.75).sqrt() as usize).max(8);
    let high = triangles / (2 * around);
    let p: Vec<DVec3> = (0..=high)
        .flat_map(|j| {
            (0..around).map(move |i| {
                let a = i as f64 / around as f64 * std::f64::consts::TAU;
                let z = 0.12 * j as f64 / high as f64;
                DVec3::new(0.03 * a.cos(), 0.03 * a.sin(), z)
            })
        })
        .collect();
    let at = |i: usize, j: usize| (j * around + i % around) as u32;
    let t: Vec<[u32; 3]> = (0..high)
        .flat_map(|j| {
            (0..around).flat_map(move |i| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
        })
        .collect();
    let (mesh, repairs) = TriMesh::new(&p, &t, 0).expect("a tube");
    let mut project = Project::around("tube.stl", None);
    project.budget.quality = Quality::Draft;
    LoadedProject {
        inputs: Inputs {
            project,
            part: Arc::new(mesh),
            painted: None,
            masks: Masks::new(),
        },
        repairs,
        path: PathBuf::from("tube.hapdef.toml"),
        mesh_path: PathBuf::from("tube.stl"),
        bundled: false,
    }
}

/// Processor milliseconds of one of several repetitions.
fn milliseconds(times: usize, mut work: impl FnMut(usize)) -> f64 {
    let start = cpu_seconds();
    for k in 0..times {
        work(k);
    }
    1e3 * (cpu_seconds() - start) / times as f64
}

/// Those of this thread alone, and of the longest one.
fn own_milliseconds(times: usize, mut work: impl FnMut(usize)) -> [f64; 2] {
    let (mut all, mut longest) = (0.0, 0.0_f64);
    for k in 0..times {
        let start = thread_seconds();
        work(k);
        let taken = 1e3 * (thread_seconds() - start);
        (all, longest) = (all + taken, longest.max(taken));
    }
    [all / times as f64, longest]
}

/// A frame that draws all triangles anew, as the camera moves.
fn bare_frame(window: &mut Window) -> f64 {
    let state = window.state.clone();
    let canvas = Canvas::new(&state, SIZE).expect("room for a picture");
    milliseconds(24, |_| {
        window.studio.view.camera.orbit(DVec2::new(3.0, 0.0));
        window.draw(&canvas);
    })
}

/// The frame that follows where the camera stands, with light in corners and a floor.
fn still_frame(window: &mut Window) -> f64 {
    const TIMES: usize = 12;
    let state = window.state.clone();
    let canvas = Canvas::new(&state, SIZE).expect("room for a picture");
    let mut taken = 0.0;
    for _ in 0..TIMES {
        window.studio.view.camera.orbit(DVec2::new(3.0, 0.0));
        window.draw(&canvas);
        taken += milliseconds(1, |_| window.draw(&canvas));
    }
    taken / TIMES as f64
}

fn steps(page: &mut String, state: &RenderState) {
    let _ = writeln!(
        page,
        "\n| triangles | bare frame | once it stands, with light | a frame's steps without an event | brush step | with the unrolled view | box of 1000 vertices | pick | plots with eight curves |\n|---|---|---|---|---|---|---|---|---|"
    );
    for triangles in [50_000, 4_560, 200_000] {
        let mut window = Window::open(state, tube(triangles));
        // Once, so that the adapter has compiled what it draws with.
        still_frame(&mut window);
        let bare = bare_frame(&mut window);
        let still = still_frame(&mut window);
        let nothing = milliseconds(400, |_| window.step());
        window.studio.view.take(Tool::Measure);
        let pick = milliseconds(400, |k| {
            let at = on_the_part(&window, k);
            window.hover(at);
            window.step();
        });
        let brush = stroke(&mut window);
        window.studio.view.unrolled_shown = true;
        window.step();
        let both = stroke(&mut window);
        window.studio.view.unrolled_shown = false;
        let boxed = boxes(&mut window);
        let plots = plots(&mut window);
        let over = |x: f64| {
            let own = (x - nothing).max(0.0);
            format!("{own:.2} ms ({:.3})", own / bare)
        };
        let _ = writeln!(
            page,
            "| {triangles} | {bare:.1} ms | {still:.1} ms | {nothing:.2} ms | {} | {} | {} | {} | {} |",
            over(brush),
            over(both),
            over(boxed),
            over(pick),
            over(plots)
        );
    }
    page.push_str("\nIn brackets: over the bare frame. Aim: a brush step, a pick and a plot update under 4 ms at 200 000 triangles.\n");
}

/// A place of the window where the part is.
fn on_the_part(window: &Window, k: usize) -> Pos2 {
    let rect = window.studio.view.rect;
    let along = (k % 40) as f32 / 40.0;
    rect.center() + egui::vec2(0.0, (along - 0.5) * 0.4 * rect.height())
}

/// One step of a stroke over what is not painted yet: the pointer moves, and everything that shows it is
/// made ready.
fn stroke(window: &mut Window) -> f64 {
    const STROKES: usize = 10;
    window.studio.view.take(Tool::Paint);
    let mut taken = 0.0;
    for _ in 0..STROKES {
        window.studio.session.document.clear(Layer::Feasible);
        let from = on_the_part(window, 0);
        window.hover(from);
        window.step();
        window.button(from, true);
        window.step();
        taken += milliseconds(39, |k| {
            let at = on_the_part(window, k + 1);
            window.hover(at);
            window.step();
        });
        let to = on_the_part(window, 39);
        window.button(to, false);
        window.step();
        let painted = window.studio.session.document.layer(Layer::Feasible);
        assert!(painted.is_some_and(|m| m.iter().filter(|&&m| m).count() > 20));
    }
    taken / STROKES as f64
}

/// A box around a part of what is seen, from pressing to letting go.
fn boxes(window: &mut Window) -> f64 {
    window.studio.view.take(Tool::Box);
    let vertices = window.studio.session.document.part.positions().len();
    // About a thousand vertices of the wall in front.
    let side = (1000.0 / vertices as f32).sqrt().min(0.4) * 200.0;
    let from = window.studio.view.rect.center();
    let to = from + egui::vec2(side, side);
    let taken = milliseconds(40, |_| {
        window.studio.session.document.clear(Layer::Feasible);
        window.hover(from);
        window.button(from, true);
        window.step();
        window.hover(to);
        window.button(to, false);
        window.step();
    });
    window.studio.session.document.clear(Layer::Feasible);
    window.step();
    taken / 2.0
}

/// A frame with the plots of what was kept.
fn plots(window: &mut Window) -> f64 {
    let state = &mut window.studio.session.document.state;
    state.project.kept = (0..8)
        .map(|k| KeptSelection {
            name: format!("selection {k}"),
            selector: "by-hand".into(),
            quality: Quality::Draft,
            cost: 1.0,
            seconds: 1.0,
            sites: Vec::new(),
            errors: (1..=20)
                .map(|sensors| KeptError {
                    region: "all touches".into(),
                    sensors,
                    mean_mm: 40.0 / (sensors + k) as f64,
                    median_mm: 1.0,
                    p95_mm: 9.0,
                })
                .collect(),
            failures: Vec::new(),
        })
        .collect();
    window.studio.show_kept(0..8);
    window.step();
    milliseconds(400, |k| {
        let kept = &mut window.studio.session.document.state.project.kept[0];
        kept.errors[k % 20].mean_mm += 0.1;
        window.step();
    })
}

/// What moves over the limb while the limb itself stays: the scene is not drawn again.
fn overlay(page: &mut String, state: &RenderState) {
    let mut window = Window::open(state, tube(50_000));
    let whole = bare_frame(&mut window);
    window.studio.view.take(Tool::Measure);
    let canvas = Canvas::new(state, SIZE).expect("room for a picture");
    let live = milliseconds(48, |k| {
        let at = on_the_part(&window, k);
        window.hover(at);
        window.draw(&canvas);
    });
    let _ = writeln!(
        page,
        "\n50 000 triangles with something moving over them: {live:.1} ms a frame, against {whole:.1} ms where the scene is drawn anew each time: {:.1} times the rate (aim: twice).",
        whole / live
    );
}

/// A study of a hundred thousand designs: frames in which nothing happens, in which the pointer goes over the designs, and in
/// which a range grows.
fn study(page: &mut String, state: &RenderState) {
    const UNITS: usize = 100_000;
    let home = tempfile::tempdir().expect("a folder");
    let folder = many_designs(home.path(), UNITS);
    let mut window = Window::open(state, cli::bundled().expect("the bundled limb"));
    window.studio.view.tab = Tab::Study;
    let (cpu, clock) = (cpu_seconds(), Instant::now());
    window.studio.session.open_study(&folder);
    while window.studio.session.study.open().is_none() {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let read = clock.elapsed().as_secs_f64();
    // Until the pictures are there.
    for _ in 0..40 {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(25));
    }
    let [still, _] = own_milliseconds(60, |_| window.step());
    let over = |k: usize| Pos2::new(270.0 + 4.0 * k as f32, 760.0);
    let [pointed, _] = own_milliseconds(48, |k| {
        window.hover(over(k));
        window.step();
    });
    // Up along the first axis of the lines.
    let along = |k: usize| Pos2::new(583.0, 840.0 - 2.0 * k as f32);
    window.hover(along(0));
    window.button(along(0), true);
    let [ranged, longest] = own_milliseconds(40, |k| {
        window.hover(along(k + 2));
        window.step();
        // As fast as a screen shows them.
        std::thread::sleep(std::time::Duration::from_millis(8));
    });
    window.button(along(42), false);
    let _ = writeln!(
        page,
        "\nA study of {UNITS} designs in its tab: read in {read:.0} s ({:.0} processor s, in the background); a frame's steps take the window's own thread {still:.1} ms without an event, {pointed:.1} ms where the pointer goes over the designs, and {ranged:.1} ms ({longest:.1} at most) where a range follows the pointer and all are drawn anew beside it.",
        cpu_seconds() - cpu
    );
}

/// A folder with the results of so many units, which somebody made up.
fn many_designs(home: &std::path::Path, units: usize) -> PathBuf {
    let path = home.join("study.toml");
    let text = format!(
        "format = 1\ncombine = \"sobol\"\ncount = {units}\n[base]\nlimb = true\n[[axis]]\nkey = \"limb.thickness\"\nfrom = 1.0\nto = 3.0\n[[axis]]\nkey = \"touch.force_n\"\nfrom = 1.0\nto = 20.0\n[[axis]]\nkey = \"material.youngs_modulus_gpa\"\nfrom = 1.0\nto = 4.0\n[aim]\nminimize = [\"error_mm\", \"mass_g\"]\n"
    );
    std::fs::write(&path, text).expect("a study");
    let base = "base".to_owned();
    let folder = StudyFolder::plan(&home.join("run"), &path, base, BTreeMap::new());
    let folder = folder.expect("a plan");
    let points = Points::of(&folder.study).expect("points");
    for unit in 0..units {
        let of = |k: usize| points.values(unit)[k].as_float().unwrap_or(0.0);
        let figures = [
            ("error_mm", of(1) / of(2)),
            ("mass_g", of(0) * of(1).sqrt()),
        ];
        let outcome = UnitOutcome {
            version: folder.plan.version.clone(),
            study: folder.plan.study.clone(),
            base: folder.plan.base.clone(),
            unit,
            values: serde_json::Map::new(),
            figures: figures
                .map(|(name, value)| (name.to_owned(), Some(value)))
                .to_vec(),
            error: None,
            cautions: Vec::new(),
        };
        let cost = UnitCost {
            unit,
            cpu_seconds: 1.0,
            seconds: 1.0,
            shared: false,
        };
        folder.write(&outcome, &cost).expect("a result");
    }
    folder.folder
}

/// What a hand that moves a gauge waits for: ten gauges at Draft.
fn estimate(page: &mut String) {
    let mut inputs = cli::bundled().expect("the bundled limb").inputs;
    inputs.project.budget.quality = Quality::Draft;
    let budget = Quality::Draft.budget();
    let simulated = hapdef::design::simulate(&inputs, &budget, &hapdef::budget::unwatched)
        .expect("the bundled limb can be simulated");
    let sites: Vec<usize> = (0..10).map(|k| 300 * k).collect();
    let wall = Instant::now();
    let taken = milliseconds(5, |_| {
        let error = hapdef::design::estimate(&inputs, &simulated.dataset, &sites, 0.1);
        assert!(error.is_finite());
    });
    let _ = writeln!(
        page,
        "\nThe estimate of ten gauges when one of them is moved: {taken:.0} ms of processor time, {:.0} ms by the clock (aim: 200 ms); it is made twice the first time, for the selection it is scaled to.",
        1e3 * wall.elapsed().as_secs_f64() / 5.0
    );
}

/// What the window's worker does from a move of one of ten gauges to its expected error and the map, at Standard.
fn in_hand(page: &mut String, reference: f64) {
    const MOVES: usize = 40;
    let mut inputs = cli::bundled().expect("the bundled limb").inputs;
    inputs.project.budget.quality = Quality::Standard;
    let budget = Quality::Standard.budget();
    let simulated = hapdef::design::simulate(&inputs, &budget, &hapdef::budget::unwatched)
        .expect("the bundled limb can be simulated");
    let count = simulated.dataset.sites.len();
    let wall = Instant::now();
    let ready = InHand::new(&inputs, Arc::new(simulated), &hapdef::budget::unwatched)
        .expect("nobody stops it");
    let ready_s = wall.elapsed().as_secs_f64();
    let mut set: Vec<usize> = (0..10).map(|k| k * count / 10).collect();
    let taken_up = milliseconds(MOVES, |k| {
        std::hint::black_box(ready.hand(&set, k % set.len()));
    });
    let hand = ready.hand(&set, 4);
    let wall = Instant::now();
    let taken = milliseconds(MOVES, |k| {
        set[4] = (4 * count / 10 + 13 * k) % count;
        let expected = ready.expected(&hand, &set, 4);
        assert!(expected.error_mm.is_finite() && robust_top(&expected.map_mm) > 0.0);
    });
    let moved = 1e3 * wall.elapsed().as_secs_f64() / MOVES as f64;
    let _ = writeln!(
        page,
        "\nOne of ten gauges in hand at Standard, {count} sites: from a move to the expected error and its map {taken:.1} ms of processor time ({:.4} of the reference), {moved:.1} ms by the clock (aim: 50 ms); {taken_up:.1} ms ({:.4}) when it is picked, before it moves; {ready_s:.1} s once for each simulation. All of it on threads of its own, none on the window's.",
        1e-3 * taken / reference,
        1e-3 * taken_up / reference
    );
}

/// From nothing to what is drawn first, beside the adapter's own start.
fn start(page: &mut String) {
    let (wall, before) = (Instant::now(), cpu_seconds());
    let state = offscreen::adapter().expect("an adapter");
    let (adapter, adapter_wall) = (cpu_seconds() - before, wall.elapsed());
    let mut window = Window::first(&state, cli::bundled().expect("the bundled limb"));
    let canvas = Canvas::new(&state, SIZE).expect("room for a picture");
    window.draw(&canvas);
    let _ = writeln!(
        page,
        "\nStart to the first picture on the bundled limb: {:.0} ms of processor time ({:.0} ms by the clock) beside the adapter's own start ({:.0} ms; aim: under 1 s).",
        1e3 * (cpu_seconds() - before - adapter),
        1e3 * wall.elapsed().saturating_sub(adapter_wall).as_secs_f64(),
        1e3 * adapter
    );
}
