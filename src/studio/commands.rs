//! One list of commands feeds menus, keys and palette: their names, keys, and when they can be given.

use egui::{Key, KeyboardShortcut, Modifiers};

use super::view::{Floor, ScreenWay, Stage, Tool, ViewState};
use crate::document::Layer;
use crate::io::examples::Example;
use crate::render::camera::Preset;
use crate::session::{HandStep, Session, Task};

/// Everything that can be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UiCommand {
    Open,
    Example(Example),
    Save,
    SaveAs,
    Export,
    SavePicture,
    Quit,
    Undo,
    Redo,
    ClearPaint,
    FillPaint,
    InvertPaint,
    GrowPaint,
    ShrinkPaint,
    WiderBrush,
    NarrowerBrush,
    Palette,
    Simulate,
    Select,
    Keep,
    Advise,
    MeasureTrade,
    Cancel,
    Follow,
    SimulatedBoard,
    Tare,
    Record,
    Disconnect,
    PlanPresses,
    PressPlan,
    LearnPresses,
    PausePresses,
    StopPresses,
    HaltMachine,
    TakePress,
    SkipPress,
    Pin,
    RemoveGauges,
    AddHelpful,
    FindSpare,
    Nudge(ScreenWay),
    Frame,
    FramePicked,
    SeeThrough,
    Section,
    Unrolled,
    Jig,
    Floor,
    DarkLight,
    LargerText,
    SmallerText,
    Look(Preset),
    Tool(Tool),
    Paint(Layer),
    Stage(Stage),
}

impl UiCommand {
    /// As menus and accessibility name it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "Open…",
            Self::Example(example) => example.name(),
            Self::Save => "Save",
            Self::SaveAs => "Save as…",
            Self::Export => "Export report…",
            Self::SavePicture => "Save picture…",
            Self::Quit => "Quit",
            Self::Undo => "Undo",
            Self::Redo => "Redo",
            Self::ClearPaint => "Clear painted layer",
            Self::FillPaint => "Fill painted layer",
            Self::InvertPaint => "Invert painted layer",
            Self::GrowPaint => "Grow painted layer",
            Self::ShrinkPaint => "Shrink painted layer",
            Self::WiderBrush => "Wider brush",
            Self::NarrowerBrush => "Narrower brush",
            Self::Palette => "Find a command…",
            Self::Simulate => "Simulate",
            Self::Select => "Select gauges",
            Self::Keep => "Keep this selection",
            Self::Advise => "Shell or solid?",
            Self::MeasureTrade => "Measure the trade",
            Self::Cancel => "Cancel all jobs",
            Self::SimulatedBoard => "Start a simulated board",
            Self::Tare => "Tare",
            Self::Record => "Record",
            Self::Disconnect => "Disconnect",
            Self::PlanPresses => "Plan presses",
            Self::PressPlan => "Press the plan",
            Self::LearnPresses => "Learn from the presses",
            Self::PausePresses => "Pause pressing",
            Self::StopPresses => "Stop pressing",
            Self::HaltMachine => "Halt the machine",
            Self::TakePress => "Take this press",
            Self::SkipPress => "Leave this place out",
            Self::Follow => "Follow changes",
            Self::Pin => "Pin picked gauges",
            Self::RemoveGauges => "Remove picked gauges",
            Self::AddHelpful => "Add the gauge that helps most",
            Self::FindSpare => "Find the gauge that helps least",
            Self::Nudge(ScreenWay::Left) => "Move picked gauges left",
            Self::Nudge(ScreenWay::Right) => "Move picked gauges right",
            Self::Nudge(ScreenWay::Up) => "Move picked gauges up",
            Self::Nudge(ScreenWay::Down) => "Move picked gauges down",
            Self::Frame => "Frame the limb",
            Self::FramePicked => "Frame picked gauges",
            Self::SeeThrough => "See-through",
            Self::Floor => "Shadow on the floor",
            Self::Section => "Section",
            Self::Unrolled => "Unrolled view",
            Self::Jig => "Jig",
            Self::DarkLight => "Dark or light",
            Self::LargerText => "Larger text",
            Self::SmallerText => "Smaller text",
            Self::Look(preset) => preset.name(),
            Self::Tool(tool) => tool.name(),
            Self::Paint(Layer::Feasible) => "Paint where gauges may go",
            Self::Paint(Layer::KeepOut) => "Paint where no gauge may go",
            Self::Paint(Layer::Support) => "Paint what is held",
            Self::Paint(Layer::Touch) => "Paint where touches come",
            Self::Paint(Layer::Often) => "Paint where touches come often",
            Self::Paint(Layer::Inside) => "Paint the inside face",
            Self::Paint(Layer::Outside) => "Paint the outside face",
            Self::Stage(Stage::Part) => "Go to part",
            Self::Stage(Stage::Supports) => "Go to supports and material",
            Self::Stage(Stage::Simulation) => "Go to simulation",
            Self::Stage(Stage::Feasible) => "Go to feasible region",
            Self::Stage(Stage::Candidates) => "Go to candidates",
            Self::Stage(Stage::Selection) => "Go to selection",
            Self::Stage(Stage::Evaluation) => "Go to evaluation",
            Self::Stage(Stage::Report) => "Go to report",
            Self::Stage(Stage::Bench) => "Go to bench",
            Self::Stage(Stage::Live) => "Go to live touch",
        }
    }

    /// As a button over the views names it, where there is little room.
    #[must_use]
    pub fn short_name(self) -> &'static str {
        match self {
            Self::ClearPaint => "Clear",
            Self::FillPaint => "Fill",
            Self::InvertPaint => "Invert",
            Self::GrowPaint => "Grow",
            Self::ShrinkPaint => "Shrink",
            Self::Frame => "Frame",
            Self::Unrolled => "Unrolled",
            Self::Pin => "Pin",
            Self::RemoveGauges => "Remove",
            Self::AddHelpful => "Add best",
            Self::FindSpare => "Find least",
            other => other.name(),
        }
    }

    #[must_use]
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Open => "Open a project or a mesh",
            Self::Example(_) => "Open a limb of the program's own",
            Self::Save => "Save the project",
            Self::SaveAs => "Save the project under another name",
            Self::Export => {
                "Write the placement report, the table of sites and the dataset into a folder"
            }
            Self::SavePicture => "Write what the 3D view shows into a PNG file of any size",
            Self::Quit => "Close the window",
            Self::Undo => "Take back the last change",
            Self::Redo => "Make the change again",
            Self::ClearPaint => "As if nothing had ever been painted on this layer",
            Self::FillPaint => "Paint every vertex of this layer; erase from there",
            Self::InvertPaint => "What was painted is not, and what was not is",
            Self::GrowPaint | Self::ShrinkPaint => {
                "By a quarter of the brush's radius over the surface"
            }
            Self::WiderBrush | Self::NarrowerBrush => "The radius of the brush over the surface",
            Self::Palette => "Reach every command by a few letters of its name",
            Self::Simulate => "Compute how the limb deforms under all touches",
            Self::Select => "Filter, reduce, choose the gauges and judge them on unseen touches",
            Self::Keep => "Keep the gauges as they are, to compare them with others",
            Self::MeasureTrade => {
                "Run this project at many settings and measure what each costs and achieves"
            }
            Self::Advise => {
                "Measure the walls, say whether shell or solid fits, and what each would cost"
            }
            Self::Cancel => {
                "Stop whatever is being computed; a run at the bench has a stop of its own"
            }
            Self::SimulatedBoard => {
                "Live touch without hardware: a truth with finer elements, and gauges as a workshop glues them"
            }
            Self::Tare => "Take what is read now for rest: nothing may touch the part",
            Self::Record => "Begin to record the raw counts of the board, or end it",
            Self::Disconnect => "Listen to the board no more",
            Self::PlanPresses => {
                "Choose where the machine presses, and see what it gets to; nothing moves"
            }
            Self::PressPlan => {
                "Press what is left of the plan, and write down what the board reads"
            }
            Self::LearnPresses => {
                "Estimators learn from what was pressed so far, with and without the model, and are judged on presses that none has learned from; live touch goes by the best"
            }
            Self::PausePresses => "Wait before the next press, or go on",
            Self::StopPresses => {
                "Stop what moves, take the tip back and end; what was pressed is kept"
            }
            Self::HaltMachine => {
                "Emergency stop: halts the machine where it is (M112). The tip stays where it is"
            }
            Self::TakePress => {
                "Write this press down, with the force that is told; where a sensor feels that, presses are taken by themselves"
            }
            Self::SkipPress => "Go on with the next place; this one stays to come",
            Self::Follow => "Compute anew what a change has made stale, a draft first; on or off",
            Self::Pin => "Selections must have a gauge there; pinned ones are let go",
            Self::RemoveGauges => "Take the picked gauges away",
            Self::AddHelpful => "At the free site with which the expected error is least",
            Self::FindSpare => {
                "Pick the gauge without which the expected error is least; Delete then takes it away"
            }
            Self::Nudge(_) => "To the next free site that way on the screen",
            Self::Frame => "Show the whole limb",
            Self::FramePicked => "Come near to the picked gauges",
            Self::SeeThrough => "See the inside through the walls in front",
            Self::Floor => "Show where the limb would stand, by its shadow; or nothing below it",
            Self::Section => "Cut a part of the limb away",
            Self::Unrolled => "Show the limb laid flat beside it",
            Self::Jig => "Show what presses the gauges to the wall while they are glued",
            Self::DarkLight => "Change between dark and light",
            Self::LargerText | Self::SmallerText => "Everything in the window",
            Self::Look(_) => "Look from this side",
            Self::Tool(Tool::Touch) => "Click on the limb to press it there; drag to look around",
            Self::Tool(Tool::Gauges) => {
                "Click a gauge to pick it, drag it elsewhere; Ctrl-click puts a new one"
            }
            Self::Tool(Tool::Paint) => "Drag over the limb to paint a layer",
            Self::Tool(Tool::Erase) => "Drag over the limb to take from a layer",
            Self::Tool(Tool::Box) => "Drag a box around what is to be painted; Ctrl erases",
            Self::Tool(Tool::Lasso) => "Draw around what is to be painted; Ctrl erases",
            Self::Tool(Tool::Measure) => "Click two points to see how far they are apart",
            Self::Paint(_) => "Take the brush for this layer",
            Self::Stage(_) => "Show the settings of this stage",
        }
    }

    #[must_use]
    pub fn shortcut(self) -> Option<KeyboardShortcut> {
        const CTRL: Modifiers = Modifiers::COMMAND;
        const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
        let plain = |key| Some(KeyboardShortcut::new(Modifiers::NONE, key));
        let ctrl = |key| Some(KeyboardShortcut::new(CTRL, key));
        let shifted = |key| Some(KeyboardShortcut::new(CTRL_SHIFT, key));
        match self {
            Self::Open => ctrl(Key::O),
            Self::Save => ctrl(Key::S),
            Self::SaveAs => shifted(Key::S),
            Self::Export => ctrl(Key::E),
            Self::SavePicture => shifted(Key::E),
            Self::Quit => ctrl(Key::Q),
            Self::Undo => ctrl(Key::Z),
            Self::Redo => shifted(Key::Z),
            Self::Advise => plain(Key::F4),
            Self::MeasureTrade => plain(Key::F10),
            Self::Simulate => plain(Key::F5),
            Self::Select => plain(Key::F6),
            Self::Keep => ctrl(Key::D),
            Self::Cancel => plain(Key::Escape),
            Self::SimulatedBoard => plain(Key::F7),
            Self::Tare => plain(Key::F8),
            Self::Record => plain(Key::F9),
            Self::HaltMachine => shifted(Key::X),
            Self::TakePress => ctrl(Key::Enter),
            Self::Pin => plain(Key::P),
            Self::RemoveGauges => plain(Key::Delete),
            Self::AddHelpful => plain(Key::A),
            Self::FindSpare => plain(Key::W),
            Self::Nudge(ScreenWay::Left) => plain(Key::ArrowLeft),
            Self::Nudge(ScreenWay::Right) => plain(Key::ArrowRight),
            Self::Nudge(ScreenWay::Up) => plain(Key::ArrowUp),
            Self::Nudge(ScreenWay::Down) => plain(Key::ArrowDown),
            Self::Frame => plain(Key::Home),
            Self::FramePicked => plain(Key::Period),
            Self::SeeThrough => plain(Key::H),
            Self::Section => plain(Key::C),
            Self::Unrolled => plain(Key::U),
            Self::Jig => plain(Key::J),
            Self::LargerText => ctrl(Key::Plus),
            Self::SmallerText => ctrl(Key::Minus),
            Self::Look(Preset::Front) => plain(Key::Num1),
            Self::Look(Preset::Right) => plain(Key::Num3),
            Self::Look(Preset::Top) => plain(Key::Num7),
            Self::Look(Preset::Back) => plain(Key::Num2),
            Self::Look(Preset::Left) => plain(Key::Num4),
            Self::Look(Preset::Bottom) => plain(Key::Num8),
            Self::Tool(Tool::Touch) => plain(Key::T),
            Self::Tool(Tool::Gauges) => plain(Key::G),
            Self::Tool(Tool::Paint) => plain(Key::B),
            Self::Tool(Tool::Erase) => plain(Key::X),
            Self::Tool(Tool::Box) => plain(Key::R),
            Self::Tool(Tool::Lasso) => plain(Key::L),
            Self::Tool(Tool::Measure) => plain(Key::M),
            Self::InvertPaint => ctrl(Key::I),
            Self::Palette => ctrl(Key::K),
            Self::NarrowerBrush => plain(Key::OpenBracket),
            Self::WiderBrush => plain(Key::CloseBracket),
            Self::ClearPaint
            | Self::FillPaint
            | Self::GrowPaint
            | Self::ShrinkPaint
            | Self::Example(_)
            | Self::Follow
            | Self::Disconnect
            | Self::PlanPresses
            | Self::PressPlan
            | Self::LearnPresses
            | Self::PausePresses
            | Self::StopPresses
            | Self::SkipPress
            | Self::Floor
            | Self::DarkLight
            | Self::Paint(_)
            | Self::Stage(_) => None,
        }
    }

    /// Every command, the most specific shortcut first where keys are shared.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut all = vec![
            Self::SaveAs,
            Self::Save,
            Self::Open,
            Self::SavePicture,
            Self::Export,
            Self::Quit,
            Self::Redo,
            Self::Undo,
            Self::ClearPaint,
            Self::FillPaint,
            Self::InvertPaint,
            Self::GrowPaint,
            Self::ShrinkPaint,
            Self::WiderBrush,
            Self::NarrowerBrush,
            Self::Palette,
            Self::Simulate,
            Self::Select,
            Self::Keep,
            Self::Advise,
            Self::MeasureTrade,
            Self::Cancel,
            Self::Follow,
            Self::SimulatedBoard,
            Self::Tare,
            Self::Record,
            Self::Disconnect,
            Self::PlanPresses,
            Self::PressPlan,
            Self::LearnPresses,
            Self::PausePresses,
            Self::StopPresses,
            Self::HaltMachine,
            Self::TakePress,
            Self::SkipPress,
            Self::Pin,
            Self::RemoveGauges,
            Self::AddHelpful,
            Self::FindSpare,
            Self::Frame,
            Self::FramePicked,
            Self::SeeThrough,
            Self::Section,
            Self::Unrolled,
            Self::Jig,
            Self::Floor,
            Self::DarkLight,
            Self::LargerText,
            Self::SmallerText,
        ];
        all.extend(Example::ALL.map(Self::Example));
        all.extend(ScreenWay::ALL.map(Self::Nudge));
        all.extend(Preset::ALL.map(Self::Look));
        all.extend(Tool::ALL.map(Self::Tool));
        all.extend(Layer::ALL.map(Self::Paint));
        all.extend(Stage::ALL.map(Self::Stage));
        all
    }
}

/// Whether a command can be given now.
#[must_use]
pub fn enabled(session: &Session, view: &ViewState, command: UiCommand) -> bool {
    match command {
        UiCommand::Undo => session.document.can_undo(),
        UiCommand::Redo => session.document.can_redo(),
        UiCommand::GrowPaint | UiCommand::ShrinkPaint => {
            session.document.layer(view.layer).is_some()
        }
        UiCommand::Cancel => session.busy(),
        UiCommand::Tare | UiCommand::Record | UiCommand::Disconnect => session.live.is_connected(),
        UiCommand::PlanPresses | UiCommand::PressPlan => session.bench.is_free(),
        UiCommand::LearnPresses => {
            session.bench.is_free()
                && session.bench.look(|p| p.made_and_failed()[0] > 0) == Some(true)
        }
        UiCommand::StopPresses => session.bench.goes_on(),
        UiCommand::PausePresses | UiCommand::HaltMachine => {
            session.bench.goes_on() && !session.bench.by_hand()
        }
        // Nobody takes a force that is not seen.
        UiCommand::TakePress => {
            view.stage == Stage::Bench && session.bench.step() == Some(HandStep::TellForce)
        }
        UiCommand::SkipPress => session
            .bench
            .step()
            .is_some_and(|step| step != HandStep::Wait),
        UiCommand::Export => session.results.design.is_some(),
        UiCommand::MeasureTrade => !session.jobs.runs(Task::Trade),
        UiCommand::Keep => !session.document.state.project.selection.sites.is_empty(),
        UiCommand::Paint(layer) if layer.is_face() => session.document.is_solid(),
        UiCommand::Pin | UiCommand::RemoveGauges | UiCommand::FramePicked | UiCommand::Nudge(_) => {
            !view.picked.is_empty()
        }
        UiCommand::AddHelpful | UiCommand::FindSpare => no_help(session, command).is_none(),
        _ => true,
    }
}

/// Why one of the commands that look for a gauge cannot be given now.
fn no_help(session: &Session, command: UiCommand) -> Option<&'static str> {
    match command {
        UiCommand::AddHelpful => session.no_helpful(),
        UiCommand::FindSpare => session.no_spare(),
        _ => None,
    }
}

/// What is said of a command that cannot be given.
#[must_use]
pub fn why_not(session: &Session, command: UiCommand) -> &'static str {
    no_help(session, command).unwrap_or(command.tooltip())
}

/// Whether a command that turns something on or off has it on.
#[must_use]
pub fn is_on(session: &Session, view: &ViewState, command: UiCommand) -> bool {
    match command {
        UiCommand::Follow => session.desk.follow,
        UiCommand::SeeThrough => view.see_through,
        UiCommand::Floor => view.floor == Floor::Shadow,
        UiCommand::Section => view.section.is_some(),
        UiCommand::Unrolled => view.unrolled_shown,
        UiCommand::Jig => view.jig_shown,
        UiCommand::PausePresses => session.bench.paused && session.bench.goes_on(),
        UiCommand::Tool(tool) => view.tool == tool,
        _ => false,
    }
}

/// Whether a command works on what the file holds, which must be the part that the project asks for.
#[must_use]
pub fn needs_part(command: UiCommand) -> bool {
    matches!(
        command,
        UiCommand::Simulate
            | UiCommand::Select
            | UiCommand::Export
            | UiCommand::Save
            | UiCommand::SaveAs
    )
}
