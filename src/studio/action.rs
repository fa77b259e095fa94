//! What panels and commands ask for: all of it is carried out here, and each says whether it can be taken back.

use std::path::PathBuf;

use glam::DVec3;

use super::commands::UiCommand;
use super::nudge::next_site;
use super::view::{Picture, ScreenWay, ViewState};
use crate::document::{Brush, Layer};
use crate::io::examples::Example;
use crate::link::BenchOrder;
use crate::mesh::SurfacePoint;
use crate::project::{ChosenSite, Project, Unit};
use crate::session::{Desk, Ends, Mishap, Session, Task};
use crate::test_bed::HandOrder;
use crate::trade::{TradeConstraint, TradeSetting};

/// Something to be done.
pub enum Action {
    Window(WindowAction),
    /// The project as a form has changed it.
    Edit(Box<Project>),
    /// What follows a hand that is still at work.
    Hand(HandAction),
    Change(ProjectChange),
    History(History),
    Compute(Compute),
    File(FileAction),
    Board(BoardAction),
    Bench(BenchAction),
    Desk(Box<Desk>),
    /// A message was read, by its number from zero.
    Dismiss(usize),
    Complain(&'static str),
}

/// What concerns the window alone.
pub enum WindowAction {
    Command(UiCommand),
    /// Come near to some points (m).
    Look(Vec<glam::DVec3>),
    /// Opens a file, or asks where something would be lost or is not known.
    OpenOrAsk(PathBuf),
    Picture(PathBuf, Picture),
    /// Opens what was left behind, or throws it away.
    Recover,
    DropLeft,
    /// Ends the program without saving.
    Close,
}

/// A stroke, an outline, a gauge that is dragged: gauges by their numbers from zero.
pub enum HandAction {
    /// Dabs of a brush of this radius (m).
    Dab(Layer, Brush, Vec<SurfacePoint>, f64),
    /// Vertices that were drawn around.
    Mark(Layer, Brush, Vec<u32>),
    PutGauge(usize, ChosenSite),
    AddGauge(ChosenSite),
}

/// A change of the project.
pub enum ProjectChange {
    Layer(Layer, LayerChange),
    AddPaintedSupport,
    PinGauges(Vec<usize>),
    RemoveGauges(Vec<usize>),
    /// One step that way on the screen, as this view shows the part.
    NudgeGauges(Vec<usize>, ScreenWay, Box<ViewState>),
    UseGauges(Vec<ChosenSite>),
    Keep,
    DeleteKept(usize),
    ApplySetting(Box<TradeSetting>),
    AskFor(TradeConstraint),
}

/// A change of a whole painted layer; lengths in m.
#[derive(Clone, Copy)]
pub enum LayerChange {
    Clear,
    Fill,
    Invert,
    Grow(f64),
    Shrink(f64),
}

/// The way through what was changed.
pub enum History {
    Undo,
    Redo,
    /// What changed since the last step becomes one.
    Settle,
}

/// What takes a while.
pub enum Compute {
    Simulate,
    Select,
    AddHelpful,
    FindSpare,
    MeasureWalls,
    MeasureTrade(usize),
    Press(SurfacePoint),
    LetGo,
    Distance(Ends),
    /// The limb of a unit of the study.
    LookAtUnit(usize),
    Cancel,
    End(Task),
}

/// What opens or writes files.
pub enum FileAction {
    Open(PathBuf, Option<Unit>),
    Example(Example),
    /// Reads the mesh again, with the repairs that the project asks for.
    TakeInAgain,
    SaveTo(PathBuf),
    Export(PathBuf),
    /// A recording as a table.
    WriteTable(PathBuf),
    /// A recording as messages.
    WriteMessages(PathBuf),
    /// The results in a study's folder.
    OpenStudy(PathBuf),
    /// A unit of the study that is open, as a project.
    OpenUnit(usize),
    /// An estimator that was learned from presses.
    OpenEstimator(PathBuf),
}

/// What concerns the board.
pub enum BoardAction {
    Connect(String),
    Simulated,
    /// Of the simulated board.
    Mishap(Mishap),
    Tare,
    ToggleRecording(String),
    /// Serves touches at this address.
    Serve(String),
    StopServing,
    Disconnect,
    /// Goes by the project's model again.
    CloseEstimator,
    TakeKnown,
    /// Where the next known touch is pressed (m).
    AskKnownAt(DVec3),
    UseKnown(usize, bool),
    DeleteKnown(usize),
    Calibrate,
    CalibrateFromBoard,
    StopTakingKnown,
}

/// What concerns the test-bed.
pub enum BenchAction {
    Plan,
    Press,
    Order(BenchOrder),
    /// Of whoever presses by hand.
    Hand(HandOrder),
    /// What was pressed teaches an estimator.
    Learn,
}

/// How an action can be taken back, or why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Undo {
    /// A step of undo of its own.
    Step,
    /// Part of a step of undo, which ends when the hand lets go or the field is left.
    WithTheHand,
    /// A step of undo once what was started has brought its result.
    WithTheResult,
    /// Not: it changes how things are shown, or what is computed, and nothing of the project.
    Harmless,
    /// Not: it is the way back itself, or forward.
    History,
    /// Not: what was written or sent has left the program.
    Outside,
    /// Not: another project has a history of its own. Whoever asks for it has said that changes may go.
    AnotherProject,
}

impl Action {
    /// How it can be taken back, or why not.
    #[must_use]
    pub fn undo(&self) -> Undo {
        match self {
            Self::Change(_) => Undo::Step,
            Self::Edit(_) | Self::Hand(_) => Undo::WithTheHand,
            Self::Compute(Compute::AddHelpful)
            | Self::Board(BoardAction::Calibrate | BoardAction::CalibrateFromBoard) => {
                Undo::WithTheResult
            }
            Self::Window(_)
            | Self::Compute(_)
            | Self::Desk(_)
            | Self::Dismiss(_)
            | Self::Complain(_) => Undo::Harmless,
            Self::History(_) => Undo::History,
            Self::File(
                FileAction::Open(..)
                | FileAction::Example(_)
                | FileAction::TakeInAgain
                | FileAction::OpenUnit(_),
            ) => Undo::AnotherProject,
            Self::File(_) | Self::Board(_) | Self::Bench(_) => Undo::Outside,
        }
    }

    /// Carries out what concerns the session; what is the window's comes back.
    pub fn apply(self, session: &mut Session) -> Option<WindowAction> {
        let undo = self.undo();
        match self {
            Self::Window(action) => return Some(action),
            Self::Edit(project) => session.document.state.project = *project,
            Self::Hand(action) => action.apply(session),
            Self::Change(change) => change.apply(session),
            Self::History(History::Undo) => session.undo(),
            Self::History(History::Redo) => session.redo(),
            Self::History(History::Settle) => session.document.settle(),
            Self::Compute(compute) => compute.apply(session),
            Self::File(action) => action.apply(session),
            Self::Board(action) => action.apply(session),
            Self::Bench(action) => action.apply(session),
            Self::Desk(desk) => session.set_desk(*desk),
            Self::Dismiss(number) => session.news.dismiss(number),
            Self::Complain(what) => session.complain(what),
        }
        if undo == Undo::Step {
            session.document.settle();
        }
        None
    }
}

impl HandAction {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Dab(layer, brush, places, radius) => {
                for place in places {
                    session.document.dab(layer, brush, place, radius);
                }
            }
            Self::Mark(layer, brush, vertices) => session.document.mark(layer, brush, vertices),
            Self::PutGauge(number, site) => session.put_gauge(number, &site),
            Self::AddGauge(site) => drop(session.add_gauge(site)),
        }
    }
}

impl ProjectChange {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Layer(layer, change) => change.apply(session, layer),
            Self::AddPaintedSupport => session.document.add_painted_support(),
            Self::PinGauges(numbers) => session.pin_gauges(&numbers),
            Self::RemoveGauges(numbers) => session.remove_gauges(&numbers),
            Self::NudgeGauges(numbers, way, view) => {
                for number in numbers {
                    if let Some(site) = next_site(session, &view, way, number) {
                        session.put_gauge(number, &site);
                    }
                }
            }
            Self::UseGauges(sites) => session.use_gauges(sites),
            Self::Keep => session.keep(),
            Self::DeleteKept(number) => session.delete_kept(number),
            Self::ApplySetting(setting) => session.apply_setting(&setting),
            Self::AskFor(asked) => session.ask_for(asked),
        }
    }
}

impl LayerChange {
    fn apply(self, session: &mut Session, layer: Layer) {
        let document = &mut session.document;
        match self {
            Self::Clear => document.clear(layer),
            Self::Fill => document.fill(layer),
            Self::Invert => document.invert(layer),
            Self::Grow(by) => document.grow(layer, by),
            Self::Shrink(by) => document.shrink(layer, by),
        }
    }
}

impl Compute {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Simulate => session.simulate(),
            Self::Select => session.select(),
            Self::AddHelpful => session.add_helpful(),
            Self::FindSpare => session.find_spare(),
            Self::MeasureWalls => session.measure_walls(),
            Self::MeasureTrade(count) => session.measure_trade(count),
            Self::Press(at) => session.press(at),
            Self::LetGo => session.let_go(),
            Self::Distance(ends) => session.measure(ends),
            Self::LookAtUnit(unit) => session.look_at_unit(unit),
            Self::Cancel => session.cancel(),
            Self::End(task) => drop(session.end_jobs(|t| t == task)),
        }
    }
}

impl FileAction {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Open(path, unit) => session.open_path(&path, unit),
            Self::Example(example) => session.open_example(example),
            Self::TakeInAgain => session.take_in_again(),
            Self::SaveTo(path) => session.save_to(&path),
            Self::Export(folder) => session.export(folder),
            Self::WriteTable(recording) => session.write_table(&recording),
            Self::WriteMessages(recording) => session.write_messages(&recording),
            Self::OpenStudy(folder) => session.open_study(&folder),
            Self::OpenUnit(unit) => session.open_unit(unit),
            Self::OpenEstimator(path) => session.open_estimator(&path),
        }
    }
}

impl BoardAction {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Connect(address) => session.connect(&address),
            Self::Simulated => session.start_simulated_board(),
            Self::Mishap(mishap) => session.let_happen(mishap),
            Self::Tare => session.tare(),
            Self::ToggleRecording(name) => session.toggle_recording(&name),
            Self::Serve(address) => session.serve_touches(&address),
            Self::StopServing => session.stop_serving(),
            Self::Disconnect => session.disconnect(),
            Self::CloseEstimator => session.close_estimator(),
            Self::TakeKnown => session.take_known(),
            Self::AskKnownAt(at) => session.ask_known_at(at),
            Self::UseKnown(number, used) => session.use_known(number, used),
            Self::DeleteKnown(number) => session.delete_known(number),
            Self::StopTakingKnown => session.stop_taking_known(),
            Self::Calibrate => session.start_calibration(),
            Self::CalibrateFromBoard => session.calibrate_from_board(),
        }
    }
}

impl BenchAction {
    fn apply(self, session: &mut Session) {
        match self {
            Self::Plan => session.plan_presses(),
            Self::Press => session.press_plan(),
            Self::Order(order) => session.order_bench(order),
            Self::Hand(order) => session.order_hand(order),
            Self::Learn => session.learn_from_presses(),
        }
    }
}

impl From<WindowAction> for Action {
    fn from(action: WindowAction) -> Self {
        Self::Window(action)
    }
}

impl From<HandAction> for Action {
    fn from(action: HandAction) -> Self {
        Self::Hand(action)
    }
}

impl From<ProjectChange> for Action {
    fn from(action: ProjectChange) -> Self {
        Self::Change(action)
    }
}

impl From<History> for Action {
    fn from(action: History) -> Self {
        Self::History(action)
    }
}

impl From<Compute> for Action {
    fn from(action: Compute) -> Self {
        Self::Compute(action)
    }
}

impl From<FileAction> for Action {
    fn from(action: FileAction) -> Self {
        Self::File(action)
    }
}

impl From<BoardAction> for Action {
    fn from(action: BoardAction) -> Self {
        Self::Board(action)
    }
}

impl From<BenchAction> for Action {
    fn from(action: BenchAction) -> Self {
        Self::Bench(action)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::io::opening::bundled;
    use crate::session::Wake;

    fn opened() -> Session {
        let document = Document::new(bundled().unwrap(), None);
        Session::new(document, Wake::default())
    }

    /// What says that it is a step of undo can be taken back, and gives what was there before.
    #[test]
    fn a_step_of_undo_is_taken_back() {
        let place = SurfacePoint {
            triangle: 7,
            barycentric: [1.0, 0.0, 0.0],
        };
        let site = ChosenSite {
            position_mm: [30.0, 0.0, 60.0],
            direction: [0.0, 0.0, 1.0],
        };
        let edit = |session: &Session| {
            let mut project = session.document.state.project.clone();
            project.touch.force_n += 1.0;
            Action::Edit(Box::new(project))
        };
        let actions: [&dyn Fn(&Session) -> Action; 9] = [
            &edit,
            &|_| HandAction::Dab(Layer::KeepOut, Brush::Paint, vec![place], 6e-3).into(),
            &|_| HandAction::Mark(Layer::KeepOut, Brush::Paint, vec![1, 2, 3]).into(),
            &|_| HandAction::PutGauge(0, site.clone()).into(),
            &|_| HandAction::AddGauge(site.clone()).into(),
            &|_| ProjectChange::Layer(Layer::KeepOut, LayerChange::Fill).into(),
            &|_| ProjectChange::PinGauges(vec![0]).into(),
            &|_| ProjectChange::UseGauges(vec![site.clone()]).into(),
            &|_| ProjectChange::Keep.into(),
        ];
        for (k, action) in actions.iter().enumerate() {
            let mut session = opened();
            let before = session.document.state.clone();
            let action = action(&session);
            let undo = action.undo();
            assert!(action.apply(&mut session).is_none());
            assert!(session.document.state != before, "action {k} does nothing");
            match undo {
                Undo::Step => assert!(session.document.can_undo(), "action {k}"),
                other => assert_eq!(other, Undo::WithTheHand, "action {k}"),
            }
            session.undo();
            assert!(session.document.state == before, "action {k}");
        }
    }

    /// What says that it is harmless changes nothing of the project.
    #[test]
    fn what_is_harmless_changes_nothing() {
        let desk = Desk {
            follow: false,
            ..Desk::default()
        };
        let actions = [
            Compute::LetGo.into(),
            Compute::Cancel.into(),
            Action::Desk(Box::new(desk)),
            Action::Dismiss(0),
            Action::Complain("something"),
        ];
        let mut session = opened();
        let before = session.document.state.clone();
        for action in actions {
            assert_eq!(action.undo(), Undo::Harmless);
            assert!(action.apply(&mut session).is_none());
            assert!(session.document.state == before && !session.document.can_undo());
        }
    }
}
