//! What each command does: to the view at once, to all else by asking.

use egui::{Context, Theme, ViewportCommand};

use super::action::{
    Action, BenchAction, BoardAction, Change, Compute, FileAction, History, LayerChange,
};
use super::ask::Ask;
use super::commands::{Command, needs_part};
use super::dialogs::Dialog;
use super::layout::Panels;
use super::palette::Palette;
use super::scene::Scene;
use super::view::{Gesture, Stage, Tab, Tool};
use crate::link::BenchOrder;

/// By how much a key makes the brush wider.
const BRUSH_STEP: f64 = 1.25;
/// By how much a key makes the window's text larger.
const ZOOM_STEP: f32 = 0.1;

/// Carries a command out, where it can be given now.
pub fn execute(
    command: Command,
    ctx: &Context,
    ask: &mut Ask<'_>,
    scene: &Scene,
    panels: &mut Panels,
) {
    if !ask.enabled(command) {
        return;
    }
    if needs_part(command) && ask.session.document.asks_for_another_part() {
        return ask.act(Action::Complain(
            "The body or the repairs were changed, but the mesh was not read again: press “Read the mesh again” (right side, Part and material), or undo",
        ));
    }
    match command {
        Command::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
        Command::Open
        | Command::Example(_)
        | Command::Save
        | Command::SaveAs
        | Command::Export
        | Command::SavePicture
        | Command::Palette => open_panel(command, ask, panels),
        Command::DarkLight => ctx.set_theme(match ctx.theme() {
            Theme::Dark => Theme::Light,
            Theme::Light => Theme::Dark,
        }),
        Command::LargerText => zoom(ctx, ZOOM_STEP),
        Command::SmallerText => zoom(ctx, -ZOOM_STEP),
        command => {
            look_at(command, ask, scene);
            if let Some(action) = asked_of_session(command, ask, panels) {
                ask.act(action);
            }
        }
    }
}

fn zoom(ctx: &Context, by: f32) {
    ctx.set_zoom_factor((ctx.zoom_factor() + by).clamp(0.5, 3.0));
}

/// Commands that ask for more.
fn open_panel(command: Command, ask: &mut Ask<'_>, panels: &mut Panels) {
    let document = &ask.session.document;
    let dialogs = &mut panels.dialogs;
    match (command, document.path.clone()) {
        (Command::Open, _) => dialogs.path = Some(Dialog::open(document)),
        (Command::Save, Some(path)) => ask.act(FileAction::SaveTo(path)),
        (Command::Save | Command::SaveAs, _) => dialogs.path = Some(Dialog::save_as(document)),
        (Command::Export, _) => dialogs.path = Some(Dialog::export(document)),
        (Command::SavePicture, _) => dialogs.path = Some(Dialog::picture(document)),
        (Command::Example(example), _) if document.is_dirty() => {
            dialogs.example = Some(example);
        }
        (Command::Example(example), _) => ask.act(FileAction::Example(example)),
        _ => panels.palette = Some(Palette::default()),
    }
}

/// What a command changes of how the session is looked at.
fn look_at(command: Command, ask: &mut Ask<'_>, scene: &Scene) {
    let (session, view) = (ask.session, &mut *ask.view);
    match command {
        Command::WiderBrush => view.brush *= BRUSH_STEP,
        Command::NarrowerBrush => view.brush /= BRUSH_STEP,
        Command::Frame => view.frame(&session.document),
        Command::FramePicked => {
            let all = session.gauge_places();
            let picked = view.picked.iter();
            let picked: Vec<_> = picked.filter_map(|&n| all.get(n).copied()).collect();
            scene.frame_points(view, &picked, &session.document);
        }
        Command::SeeThrough => view.see_through = !view.see_through,
        Command::Section => scene.toggle_section(view),
        Command::Unrolled => {
            view.unrolled_shown = !view.unrolled_shown;
            // What was begun in a view that goes ends with it.
            view.gesture = Gesture::None;
        }
        Command::Jig => view.jig_shown = !view.jig_shown,
        Command::Look(preset) => view.camera.look_from(preset),
        Command::Tool(tool) => view.take(tool),
        Command::Paint(layer) => {
            view.layer = layer;
            view.take(Tool::Paint);
        }
        Command::Stage(stage) => view.stage = stage,
        Command::Advise => view.stage = Stage::Part,
        Command::SimulatedBoard => view.stage = Stage::Live,
        Command::PlanPresses | Command::PressPlan | Command::LearnPresses => {
            view.stage = Stage::Bench;
        }
        Command::MeasureTrade => view.tab = Tab::Trade,
        _ => {}
    }
}

/// What a command asks of the session.
fn asked_of_session(command: Command, ask: &mut Ask<'_>, panels: &Panels) -> Option<Action> {
    let view = &mut *ask.view;
    let paint = |change: LayerChange| Change::Layer(view.layer, change);
    let by = view.brush / 4.0;
    Some(match command {
        Command::Undo => History::Undo.into(),
        Command::Redo => History::Redo.into(),
        Command::Unrolled => History::Settle.into(),
        Command::ClearPaint => paint(LayerChange::Clear).into(),
        Command::FillPaint => paint(LayerChange::Fill).into(),
        Command::InvertPaint => paint(LayerChange::Invert).into(),
        Command::GrowPaint => paint(LayerChange::Grow(by)).into(),
        Command::ShrinkPaint => paint(LayerChange::Shrink(by)).into(),
        Command::Pin => Change::PinGauges(view.picked.clone()).into(),
        Command::RemoveGauges => Change::RemoveGauges(std::mem::take(&mut view.picked)).into(),
        Command::Nudge(way) => {
            let seen = Box::new(view.clone());
            Change::NudgeGauges(view.picked.clone(), way, seen).into()
        }
        Command::Keep => Change::Keep.into(),
        Command::Simulate => Compute::Simulate.into(),
        Command::Select => Compute::Select.into(),
        Command::AddHelpful => Compute::AddHelpful.into(),
        Command::FindSpare => Compute::FindSpare.into(),
        Command::Advise => Compute::MeasureWalls.into(),
        Command::MeasureTrade => Compute::MeasureTrade(panels.dial.count).into(),
        Command::Cancel => Compute::Cancel.into(),
        Command::SimulatedBoard => BoardAction::Simulated.into(),
        Command::Tare => BoardAction::Tare.into(),
        Command::Record => BoardAction::ToggleRecording(panels.live.record_to.clone()).into(),
        Command::Disconnect => BoardAction::Disconnect.into(),
        Command::PlanPresses => BenchAction::Plan.into(),
        Command::PressPlan => BenchAction::Press.into(),
        Command::LearnPresses => BenchAction::Learn.into(),
        Command::PausePresses if ask.session.bench.paused => {
            BenchAction::Order(BenchOrder::Resume).into()
        }
        Command::PausePresses => BenchAction::Order(BenchOrder::Pause).into(),
        Command::StopPresses => BenchAction::Order(BenchOrder::Stop).into(),
        Command::HaltMachine => BenchAction::Order(BenchOrder::Kill).into(),
        Command::Follow => {
            let mut desk = ask.session.desk.clone();
            desk.follow = !desk.follow;
            Action::Desk(Box::new(desk))
        }
        _ => return None,
    })
}
