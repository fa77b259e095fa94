//! What each command does: to the view at once, to all else by asking.

use egui::{Context, Theme, ViewportCommand};

use super::action::{
    Action, BenchAction, BoardAction, Compute, FileAction, History, LayerChange, ProjectChange,
};
use super::ask::Ask;
use super::commands::{UiCommand, needs_part};
use super::dialogs::Dialog;
use super::layout::Panels;
use super::palette::Palette;
use super::scene::PartScene;
use super::view::{Gesture, Stage, Tab, Tool};
use crate::link::BenchOrder;
use crate::test_bed::HandOrder;

/// By how much a key makes the brush wider.
const BRUSH_STEP: f64 = 1.25;
/// By how much a key makes the window's text larger.
const ZOOM_STEP: f32 = 0.1;

/// Carries a command out, where it can be given now.
pub fn execute(
    command: UiCommand,
    ctx: &Context,
    ask: &mut Ask<'_>,
    scene: &PartScene,
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
        UiCommand::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
        UiCommand::Open
        | UiCommand::Example(_)
        | UiCommand::Save
        | UiCommand::SaveAs
        | UiCommand::Export
        | UiCommand::SavePicture
        | UiCommand::Palette => open_panel(command, ask, panels),
        UiCommand::DarkLight => ctx.set_theme(match ctx.theme() {
            Theme::Dark => Theme::Light,
            Theme::Light => Theme::Dark,
        }),
        UiCommand::LargerText => zoom(ctx, ZOOM_STEP),
        UiCommand::SmallerText => zoom(ctx, -ZOOM_STEP),
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
fn open_panel(command: UiCommand, ask: &mut Ask<'_>, panels: &mut Panels) {
    let document = &ask.session.document;
    let dialogs = &mut panels.dialogs;
    match (command, document.path.clone()) {
        (UiCommand::Open, _) => dialogs.path = Some(Dialog::open(document)),
        (UiCommand::Save, Some(path)) => ask.act(FileAction::SaveTo(path)),
        (UiCommand::Save | UiCommand::SaveAs, _) => dialogs.path = Some(Dialog::save_as(document)),
        (UiCommand::Export, _) => dialogs.path = Some(Dialog::export(document)),
        (UiCommand::SavePicture, _) => dialogs.path = Some(Dialog::picture(document)),
        (UiCommand::Example(example), _) if document.is_dirty() => {
            dialogs.example = Some(example);
        }
        (UiCommand::Example(example), _) => ask.act(FileAction::Example(example)),
        _ => panels.palette = Some(Palette::default()),
    }
}

/// What a command changes of how the session is looked at.
fn look_at(command: UiCommand, ask: &mut Ask<'_>, scene: &PartScene) {
    let (session, view) = (ask.session, &mut *ask.view);
    match command {
        UiCommand::WiderBrush => view.brush *= BRUSH_STEP,
        UiCommand::NarrowerBrush => view.brush /= BRUSH_STEP,
        UiCommand::Frame => view.frame(&session.document),
        UiCommand::FramePicked => {
            let all = session.gauge_places();
            let picked = view.picked.iter();
            let picked: Vec<_> = picked.filter_map(|&n| all.get(n).copied()).collect();
            scene.frame_points(view, &picked, &session.document);
        }
        UiCommand::SeeThrough => view.see_through = !view.see_through,
        UiCommand::Floor => view.floor = view.floor.toggled(),
        UiCommand::Section => scene.toggle_section(view),
        UiCommand::Unrolled => {
            view.unrolled_shown = !view.unrolled_shown;
            // What was begun in a view that goes ends with it.
            view.gesture = Gesture::None;
        }
        UiCommand::Jig => view.jig_shown = !view.jig_shown,
        UiCommand::Look(preset) => view.camera.look_from(preset),
        UiCommand::Tool(tool) => view.take(tool),
        UiCommand::Paint(layer) => {
            view.layer = layer;
            view.take(Tool::Paint);
        }
        UiCommand::Stage(stage) => view.stage = stage,
        UiCommand::Advise => view.stage = Stage::Part,
        UiCommand::SimulatedBoard => view.stage = Stage::Live,
        UiCommand::PlanPresses | UiCommand::PressPlan | UiCommand::LearnPresses => {
            view.stage = Stage::Bench;
        }
        UiCommand::MeasureTrade => view.tab = Tab::Trade,
        _ => {}
    }
}

/// What a command asks of the session.
fn asked_of_session(command: UiCommand, ask: &mut Ask<'_>, panels: &Panels) -> Option<Action> {
    let view = &mut *ask.view;
    let paint = |change: LayerChange| ProjectChange::Layer(view.layer, change);
    let by = view.brush / 4.0;
    Some(match command {
        UiCommand::Undo => History::Undo.into(),
        UiCommand::Redo => History::Redo.into(),
        UiCommand::Unrolled => History::Settle.into(),
        UiCommand::ClearPaint => paint(LayerChange::Clear).into(),
        UiCommand::FillPaint => paint(LayerChange::Fill).into(),
        UiCommand::InvertPaint => paint(LayerChange::Invert).into(),
        UiCommand::GrowPaint => paint(LayerChange::Grow(by)).into(),
        UiCommand::ShrinkPaint => paint(LayerChange::Shrink(by)).into(),
        UiCommand::Pin => ProjectChange::PinGauges(view.picked.clone()).into(),
        UiCommand::RemoveGauges => {
            ProjectChange::RemoveGauges(std::mem::take(&mut view.picked)).into()
        }
        UiCommand::Nudge(way) => {
            let seen = Box::new(view.clone());
            ProjectChange::NudgeGauges(view.picked.clone(), way, seen).into()
        }
        UiCommand::Keep => ProjectChange::Keep.into(),
        UiCommand::Simulate => Compute::Simulate.into(),
        UiCommand::Select => Compute::Select.into(),
        UiCommand::AddHelpful => Compute::AddHelpful.into(),
        UiCommand::FindSpare => Compute::FindSpare.into(),
        UiCommand::Advise => Compute::MeasureWalls.into(),
        UiCommand::MeasureTrade => Compute::MeasureTrade(panels.dial.count).into(),
        UiCommand::Cancel => Compute::Cancel.into(),
        UiCommand::SimulatedBoard => BoardAction::Simulated.into(),
        UiCommand::Tare => BoardAction::Tare.into(),
        UiCommand::Record => BoardAction::ToggleRecording(panels.live.record_to.clone()).into(),
        UiCommand::Disconnect => BoardAction::Disconnect.into(),
        UiCommand::PlanPresses => BenchAction::Plan.into(),
        UiCommand::PressPlan => BenchAction::Press.into(),
        UiCommand::LearnPresses => BenchAction::Learn.into(),
        UiCommand::PausePresses if ask.session.bench.paused => {
            BenchAction::Order(BenchOrder::Resume).into()
        }
        UiCommand::PausePresses => BenchAction::Order(BenchOrder::Pause).into(),
        UiCommand::StopPresses => BenchAction::Order(BenchOrder::Stop).into(),
        UiCommand::HaltMachine => BenchAction::Order(BenchOrder::Kill).into(),
        UiCommand::TakePress => {
            let typed = ask.session.desk.bench.typed_n;
            BenchAction::Hand(HandOrder::Force(typed)).into()
        }
        UiCommand::SkipPress => BenchAction::Hand(HandOrder::Skip).into(),
        UiCommand::Follow => {
            let mut desk = ask.session.desk.clone();
            desk.follow = !desk.follow;
            Action::Desk(Box::new(desk))
        }
        _ => return None,
    })
}
