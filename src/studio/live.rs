//! The live stage: a board, or one that is simulated, and what its readings say of a touch.

mod feed;
mod form;
mod known;
mod shown;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use egui::Context;

use super::Studio;
use super::jobs::Task;
use crate::board::{Faults, Script, SimulatedBoard, script_seed};
use crate::budget::Quality;
use crate::cli::board;
use crate::design::{self, Sensing, Workshop};
use crate::inference::{Calibration, Features, Known, Lessons, Trained};
use crate::link::{
    Address, BAUD, Command, Connection, Hosted, Listener, Pace, PortInfo, State, host,
};
use crate::live::{Estimator, Pipeline, Update};
use crate::project::LiveKeys;
use crate::regression::Hyper;

pub use feed::{Feed, Shared};

/// What is to be listened to once the model is there.
#[derive(Clone, Debug, PartialEq)]
enum Wish {
    Board(Address),
    Simulated,
}

/// The live side of the studio.
pub(super) struct Live {
    /// The model of the gauges, and what it was made of.
    sensing: Option<(String, Arc<Sensing>)>,
    connection: Option<Connection>,
    /// A simulated board of our own.
    hosted: Option<Hosted>,
    feed: Shared,
    ports: Vec<PortInfo>,
    port: String,
    baud: u32,
    record_to: String,
    estimator: Estimator,
    compare: bool,
    wish: Option<Wish>,
    known: Vec<Known>,
    known_force: f64,
    gathering: known::Gathering,
    /// For the model of this key and these gauges.
    trained: Option<(String, Vec<bool>, Pair)>,
    /// For which gauges training was begun.
    training_for: Option<Vec<bool>>,
    forces: [f64; 2],
    /// The last recording that was begun.
    recorded: Option<PathBuf>,
    /// The settings that the pipeline has.
    applied: Option<LiveKeys>,
}

impl Default for Live {
    fn default() -> Self {
        Self {
            sensing: None,
            connection: None,
            hosted: None,
            feed: Shared::default(),
            ports: Vec::new(),
            port: String::new(),
            baud: BAUD,
            record_to: String::new(),
            estimator: Estimator::default(),
            compare: false,
            wish: None,
            known: Vec::new(),
            known_force: 10.0,
            gathering: known::Gathering::default(),
            trained: None,
            training_for: None,
            forces: [2.0, 15.0],
            recorded: None,
            applied: None,
        }
    }
}

/// The trained estimators: normalized, raw.
type Pair = [Option<Arc<Trained>>; 2];

/// What jobs of the live stage bring.
pub(super) enum Brought {
    Sensing(Arc<Sensing>),
    Board(Arc<Sensing>, Box<Mutex<Option<SimulatedBoard>>>),
    Trained(Vec<bool>, Pair),
    Calibrated(Calibration),
    /// The files that a table takes.
    Table(Vec<PathBuf>),
}

impl Live {
    /// As it is for another part: the port, what is shown and how hard it is pressed belong to the desk; the
    /// connection with its model, known touches, what was trained and recorded belong to the part before.
    pub fn for_another_part(self) -> Self {
        Self {
            feed: fresh_feed(self.estimator),
            ports: self.ports,
            port: self.port,
            baud: self.baud,
            estimator: self.estimator,
            compare: self.compare,
            known_force: self.known_force,
            forces: self.forces,
            ..Self::default()
        }
    }

    /// What is heard at the moment.
    pub fn look<T>(&self, at: impl FnOnce(&Feed) -> T) -> Option<T> {
        self.feed.lock().ok().map(|feed| at(&feed))
    }

    pub fn is_connected(&self) -> bool {
        self.connection.is_some()
    }

    fn send(&self, command: Command) {
        if let Some(connection) = &self.connection {
            connection.send(command);
        }
    }
}

impl Studio {
    /// The model depends on the part and on where the gauges are.
    fn sensing_key(&self) -> String {
        let project = &self.document.state.project;
        format!(
            "{} {:?} {} {} {:?}",
            self.document.simulation_key_at(self.quality()),
            project.selection.sites,
            project.gauge.grid_length_mm,
            project.gauge.grid_width_mm,
            (
                project.gluing(),
                project.touch.tip_tolerance_mm,
                project.gauge.drift_microstrain
            )
        )
    }

    fn sensing(&self) -> Option<&Arc<Sensing>> {
        let key = self.sensing_key();
        self.live
            .sensing
            .as_ref()
            .filter(|(k, _)| *k == key)
            .map(|(_, s)| s)
    }

    /// How the connection stands, for whoever asks from outside.
    #[must_use]
    pub fn live_state(&self) -> Option<State> {
        self.live.connection.as_ref()?;
        self.live.look(|feed| feed.state.clone()).flatten()
    }

    /// What the last sample said.
    #[must_use]
    pub fn live_update(&self) -> Option<Update> {
        self.live.look(|feed| feed.update.clone()).flatten()
    }

    /// Where a simulated board is really touched (m, N).
    #[must_use]
    pub fn live_truth(&self) -> Option<(glam::DVec3, f64)> {
        self.live.look(|feed| feed.truth).flatten()
    }

    /// The simulated board of our own, to make things go wrong.
    #[must_use]
    pub fn simulated_board(&self) -> Option<&Hosted> {
        self.live.hosted.as_ref()
    }

    /// Listens to a board, once the model of the gauges is there.
    pub fn connect(&mut self, ctx: &Context, text: &str) {
        let address = Address::parse(text.trim(), self.live.baud, Pace::Real);
        self.disconnect();
        self.live.wish = Some(Wish::Board(address));
        self.go_on_connecting(ctx);
    }

    /// Starts a simulated board and listens to it.
    pub fn start_simulated_board(&mut self, ctx: &Context) {
        self.disconnect();
        self.live.wish = Some(Wish::Simulated);
        self.go_on_connecting(ctx);
    }

    /// Hangs up.
    pub fn disconnect(&mut self) {
        self.live.connection = None;
        self.live.hosted = None;
        self.live.wish = None;
        self.live.gathering = known::Gathering::default();
        self.live.feed = fresh_feed(self.live.estimator);
    }

    fn go_on_connecting(&mut self, ctx: &Context) {
        let Some(wish) = self.live.wish.clone() else {
            return;
        };
        if self.document.state.project.selection.sites.is_empty() {
            self.live.wish = None;
            return self.complain("There are no gauges yet: press “Select gauges”, or place them with the tool “Gauges”");
        }
        match (wish, self.sensing().map(Arc::clone)) {
            (Wish::Board(address), Some(sensing)) => {
                self.live.wish = None;
                self.listen(ctx, &sensing, address);
            }
            (Wish::Board(_), None) => self.make_sensing(ctx),
            (Wish::Simulated, known) => self.make_board(ctx, known),
        }
    }

    fn make_sensing(&mut self, ctx: &Context) {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        self.jobs
            .start(ctx, Task::Sense, self.sensing_key(), move |r| {
                let watch = |p| r.report(p);
                let sensing =
                    design::sense(&inputs, &budget, &watch).map_err(|e| super::drive::stop(&e))?;
                Ok(super::drive::Finished::Live(Box::new(Brought::Sensing(
                    Arc::new(sensing),
                ))))
            });
    }

    fn make_board(&mut self, ctx: &Context, known: Option<Arc<Sensing>>) {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        let forces = self.live.forces;
        self.jobs
            .start(ctx, Task::Board, self.sensing_key(), move |r| {
                let watch = |p| r.report(p);
                let stop = |e| super::drive::stop(&e);
                let sensing = match known {
                    Some(sensing) => sensing,
                    None => Arc::new(design::sense(&inputs, &budget, &watch).map_err(stop)?),
                };
                let seed = inputs.project.budget.seed;
                let places = board::places(&inputs, &sensing, seed).map_err(stop)?;
                let script = Script::random(places, forces, script_seed(seed));
                let options = board::options(&inputs, sensing.gauges.len());
                let made = board::simulated(
                    &inputs,
                    &sensing,
                    Workshop::All,
                    script,
                    forces[1],
                    options,
                    Faults::default(),
                    &watch,
                );
                let made = Box::new(Mutex::new(Some(made.map_err(stop)?)));
                Ok(super::drive::Finished::Live(Box::new(Brought::Board(
                    sensing, made,
                ))))
            });
    }

    /// What a job of this stage has brought.
    pub(super) fn take_live(&mut self, ctx: &Context, brought: Brought, key: String) {
        if let Brought::Table(paths) = brought {
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            return self.tell(format!("The table is in {}", names.join(" and ")));
        }
        if key != self.sensing_key() {
            self.live.wish = None;
            return self.tell(
                "The model of the gauges was for settings that have changed since, and was dropped",
            );
        }
        match brought {
            Brought::Sensing(sensing) => {
                self.live.sensing = Some((key, sensing));
                self.go_on_connecting(ctx);
            }
            Brought::Board(sensing, board) => {
                self.live.sensing = Some((key, Arc::clone(&sensing)));
                let board = board.lock().ok().and_then(|mut b| b.take());
                if let Some(board) = board.filter(|_| self.live.wish == Some(Wish::Simulated)) {
                    self.live.wish = None;
                    self.host(ctx, &sensing, board);
                }
            }
            Brought::Trained(used, trained) => {
                self.live.trained = Some((key, used.clone(), trained.clone()));
                self.live
                    .send(Command::Do(Box::new(move |p| p.set_trained(trained, used))));
            }
            // Told above: a file that was written is there whatever has changed since.
            Brought::Table(_) => {}
            Brought::Calibrated(calibration) => self.take_calibration(&calibration),
        }
    }

    fn host(&mut self, ctx: &Context, sensing: &Arc<Sensing>, board: SimulatedBoard) {
        let feed = Arc::clone(&self.live.feed);
        let told = move |truth: crate::board::Truth| {
            if let Ok(mut feed) = feed.lock() {
                feed.take_truth(&truth);
            }
        };
        match doorway().open().and_then(|door| host(board, door, told)) {
            Ok(hosted) => {
                let address = Address::parse(&hosted.port, BAUD, Pace::Real);
                self.live.hosted = Some(hosted);
                self.listen(ctx, sensing, address);
            }
            Err(message) => self.complain(message),
        }
    }

    fn listen(&mut self, ctx: &Context, sensing: &Arc<Sensing>, address: Address) {
        let live = self.document.state.project.live.clone();
        let mut pipeline =
            Pipeline::new(sensing.map_for(&live), live.settings(sensing.gauges.len()));
        let key = self.sensing_key();
        if let Some((_, used, trained)) = self.live.trained.as_ref().filter(|t| t.0 == key) {
            pipeline.set_trained(trained.clone(), used.clone());
        }
        let feed = Arc::clone(&self.live.feed);
        let (told, over) = (Arc::clone(&feed), feed);
        let (wake, last) = (ctx.clone(), ctx.clone());
        let started = Connection::start(
            Listener::new(address, pipeline),
            move |heard| feed::hear(&told, &heard, &|| wake.request_repaint()),
            move |ended| {
                if let Ok(mut feed) = over.lock() {
                    feed.ended = Some(ended);
                }
                last.request_repaint();
            },
        );
        match started {
            Ok(connection) => {
                self.live.connection = Some(connection);
                self.live.applied = Some(live);
                self.results = super::results::Tab::Live;
            }
            Err(message) => self.complain(message),
        }
    }

    /// Looks after the connection once a frame.
    pub(super) fn refresh_live(&mut self, ctx: &Context) {
        let (messages, ended) = match self.live.feed.lock() {
            Ok(mut feed) => (std::mem::take(&mut feed.messages), feed.ended.take()),
            Err(_) => return,
        };
        for message in messages {
            self.tell(format!("Board: {message}"));
        }
        match ended {
            // A recording that is over stays as it was at its end.
            Some(Ok(())) => self.live.connection = None,
            Some(Err(message)) => {
                self.disconnect();
                self.complain(message);
            }
            None => {}
        }
        if !self.live.is_connected() {
            return;
        }
        self.apply_settings();
        self.keep_trained(ctx);
        self.gather_known(ctx);
        if let (Some(_), Some(truth)) = (&self.live.hosted, self.live.look(|f| f.truth))
            && self.live.look(|f| f.recording.is_some()) == Some(true)
        {
            self.live.send(Command::Truth(truth));
        }
    }

    /// Settings that were changed, or brought back by undo, reach the pipeline.
    fn apply_settings(&mut self) {
        let live = &self.document.state.project.live;
        if !self.live.is_connected() || self.live.applied.as_ref() == Some(live) {
            return;
        }
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let live = live.clone();
        self.live.applied = Some(live.clone());
        self.live.send(Command::Do(Box::new(move |pipeline| {
            let settings = live.settings(sensing.gauges.len());
            pipeline.set_model(sensing.map_for(&live), settings);
        })));
    }

    /// The trained estimators are trained when they are wanted, and again when gauges fail or recover.
    fn keep_trained(&mut self, ctx: &Context) {
        let wanted = self.live.compare || self.live.estimator != Estimator::Matching;
        if !wanted || !self.live.is_connected() {
            return;
        }
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let key = self.sensing_key();
        let trained = self.live.trained.as_ref();
        let done = trained.is_some_and(|(k, u, _)| *k == key && *u == used);
        let begun = self.live.training_for.as_ref() == Some(&used) && self.jobs.runs(Task::Train);
        if used.iter().filter(|u| **u).count() < 3 || done || begun {
            return;
        }
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        self.live.training_for = Some(used.clone());
        let inputs = self.document.inputs();
        let noise = self
            .live
            .look(|f| f.noise.first().copied())
            .flatten()
            .unwrap_or(1e-6);
        let count = if self.quality() == Quality::Draft {
            800
        } else {
            3200
        };
        self.jobs
            .start(ctx, Task::Train, self.sensing_key(), move |r| {
                let watch = |p| r.report(p);
                let trained = train(&sensing, &inputs, &used, noise, count, &watch)
                    .map_err(|e| super::drive::stop(&e))?;
                Ok(super::drive::Finished::Live(Box::new(Brought::Trained(
                    used, trained,
                ))))
            });
    }

    /// Shows another estimator.
    pub fn show_estimator(&mut self, estimator: Estimator) {
        self.live.estimator = estimator;
        if let Ok(mut feed) = self.live.feed.lock() {
            feed.estimator = estimator;
        }
    }

    /// Takes what is read now for rest.
    pub fn tare(&mut self) {
        self.live.send(Command::Tare);
    }

    /// Replays a recording into a table beside it.
    pub fn write_table(&mut self, ctx: &Context, recording: &Path) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return self.complain("The table is made by the model of the gauges: connect first");
        };
        let live = self.document.state.project.live.clone();
        let recording = recording.to_owned();
        self.jobs
            .start(ctx, Task::Table, self.sensing_key(), move |_| {
                let settings = live.settings(sensing.gauges.len());
                let pipeline = Pipeline::new(sensing.map_for(&live), settings);
                let table = recording.with_extension("csv");
                let tables = crate::cli::listen::write_table(&recording, &table, pipeline)
                    .map_err(|e| crate::job::Stop::Failed(format!("{e:#}")))?;
                Ok(super::drive::Finished::Live(Box::new(Brought::Table(
                    tables,
                ))))
            });
    }

    /// Begins to record raw counts.
    pub fn record(&mut self, path: &Path) {
        self.live.recorded = Some(path.to_owned());
        self.live.send(Command::Record(path.to_owned()));
    }

    /// Ends the recording.
    pub fn stop_recording(&mut self) {
        self.live.send(Command::StopRecording);
        if let Ok(mut feed) = self.live.feed.lock() {
            feed.recording = None;
        }
    }
}

/// Where nothing was heard yet, for an estimator that is shown.
fn fresh_feed(estimator: Estimator) -> Shared {
    let feed = Shared::default();
    if let Ok(mut heard) = feed.lock() {
        heard.estimator = estimator;
    }
    feed
}

fn doorway() -> crate::link::Doorway {
    #[cfg(unix)]
    return crate::link::Doorway::Terminal;
    #[cfg(not(unix))]
    return crate::link::Doorway::Socket("127.0.0.1:0".into());
}

/// Both trained estimators (normalized, raw) on touches of the model, evenly spread, with forces from half a
/// newton to the hardest of the paper.
fn train(
    sensing: &Sensing,
    inputs: &design::Inputs,
    used: &[bool],
    noise: f64,
    count: usize,
    watch: crate::budget::Watch,
) -> Result<[Option<Arc<Trained>>; 2], design::DesignError> {
    const JITTER: f64 = 0.03;
    crate::budget::report(watch, "Training", 0, 3)?;
    let lesson = sensing.lessons(inputs, count, inputs.project.budget.seed)?;
    let lessons = Lessons {
        x: &lesson.x,
        places_mm: &lesson.places_mm,
        forces: &lesson.forces,
        used,
        noise,
        jitter: JITTER,
        seed: inputs.project.budget.seed,
    };
    let keys = &inputs.project.selection;
    let hyper = Hyper {
        c: keys.c_mm,
        epsilon: keys.epsilon_mm,
        gamma: keys.gamma,
    };
    crate::budget::report(watch, "Training", 1, 3)?;
    let normalized = Trained::train(Features::Normalized, &lessons, &hyper);
    crate::budget::report(watch, "Training", 2, 3)?;
    let raw = Trained::train(
        Features::Raw,
        &Lessons {
            jitter: 0.0,
            ..lessons
        },
        &hyper,
    );
    Ok([Some(Arc::new(normalized)), Some(Arc::new(raw))])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::SurfacePoint;

    #[test]
    fn known_touches_stay_with_their_part_and_the_port_with_the_desk() {
        let live = Live {
            port: "/dev/ttyACM3".into(),
            baud: 9600,
            known_force: 12.5,
            known: vec![Known {
                at: SurfacePoint {
                    triangle: 7,
                    barycentric: [1.0, 0.0, 0.0],
                },
                force: 12.5,
                reading: vec![1e-6],
            }],
            record_to: "old-part.hapdrec".into(),
            recorded: Some("old-part.hapdrec".into()),
            training_for: Some(vec![true]),
            ..Live::default()
        };
        let live = live.for_another_part();
        assert_eq!((live.port.as_str(), live.baud), ("/dev/ttyACM3", 9600));
        assert_eq!(live.known_force, 12.5);
        assert!(live.known.is_empty() && live.sensing.is_none() && live.trained.is_none());
        assert!(live.record_to.is_empty() && live.recorded.is_none());
        assert!(live.training_for.is_none() && live.applied.is_none());
    }
}
