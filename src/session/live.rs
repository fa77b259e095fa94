//! Live touch: a board, or one that is simulated, and what its readings say of a touch.

mod feed;
mod known;
mod training;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::jobs::Task;
use super::slot::{Slot, current};
use super::{Event, Session};
use crate::board::{Faults, Script, SimulatedBoard, Truth, script_seed};
use crate::budget::Quality;
use crate::design::simulated_board::{options, places, simulated};
use crate::design::{self, Inputs, Sensing, Workshop};
use crate::document::SensingInputs;
use crate::inference::Known;
use crate::job::{Reporter, Stop};
use crate::link::{
    Address, BAUD, Command, Connection, Doorway, ENDING, Hosted, Listener, Pace, State, host,
    write_table,
};
use crate::live::{Estimator, Pipeline, Update};
use crate::project::LiveKeys;
use crate::session::drive::stop;
use training::{Pair, train};

pub use feed::{Feed, Recording, STRIPS_S, Shared, Strip};
pub use known::{LEAST as LEAST_KNOWN, WANTED as WANTED_KNOWN};

/// Smallest and largest force of the touches of a simulated board (N).
const FORCES_N: [f64; 2] = [2.0, 15.0];

/// What is to be listened to once the model is there.
#[derive(Clone, Debug, PartialEq)]
enum Target {
    Board(Address),
    Simulated,
}

/// Trained estimators, and the gauges that they were trained for.
type TrainedFor = (Vec<bool>, Pair);

/// A connection, and what is known of the gauges that it reads.
#[derive(Default)]
pub struct Live {
    /// The model of the gauges.
    sensing: Option<Slot<SensingInputs, Arc<Sensing>>>,
    connection: Option<Connection>,
    /// A simulated board of our own.
    hosted: Option<Hosted>,
    feed: Shared,
    target: Option<Target>,
    known: Vec<Known>,
    gathering: known::Gathering,
    trained: Option<Slot<SensingInputs, TrainedFor>>,
    /// For which gauges training was begun.
    training_for: Option<Vec<bool>>,
    /// The last recording that was begun.
    pub recorded: Option<PathBuf>,
    /// The settings that the pipeline has.
    applied: Option<LiveKeys>,
}

impl Live {
    /// What is heard at the moment.
    pub fn look<T>(&self, at: impl FnOnce(&Feed) -> T) -> Option<T> {
        self.feed.lock().ok().map(|feed| at(&feed))
    }

    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.connection.is_some()
    }

    /// Whether a board is to be listened to once the model of the gauges is there.
    #[must_use]
    pub fn is_preparing(&self) -> bool {
        self.target.is_some()
    }

    /// The simulated board of our own, to make things go wrong.
    #[must_use]
    pub fn simulated_board(&self) -> Option<&Hosted> {
        self.hosted.as_ref()
    }

    /// How the connection stands; nothing where there is none.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        self.connection.as_ref()?;
        self.look(|feed| feed.state.clone()).flatten()
    }

    /// What the last sample said.
    #[must_use]
    pub fn update(&self) -> Option<Update> {
        self.look(|feed| feed.update.clone()).flatten()
    }

    /// Where a simulated board is really touched (m, N).
    #[must_use]
    pub fn truth(&self) -> Option<(DVec3, f64)> {
        self.look(|feed| feed.truth).flatten()
    }

    /// How many known touches there are.
    #[must_use]
    pub fn known_touches(&self) -> usize {
        self.known.len()
    }

    /// Whether a known touch is being read, and whether off a simulated board.
    #[must_use]
    pub fn is_gathering(&self) -> (bool, bool) {
        (
            self.gathering.at.is_some() || self.gathering.from_board,
            self.gathering.from_board,
        )
    }

    fn send(&self, command: Command) {
        if let Some(connection) = &self.connection {
            connection.send(command);
        }
    }
}

impl Session {
    fn sensing(&self) -> Option<&Arc<Sensing>> {
        current(self.live.sensing.as_ref(), &self.document.sensing_inputs())
    }

    /// Starts a job whose result is of the model of the gauges as they are now.
    fn start_sensing<T: Send + 'static>(
        &mut self,
        task: Task,
        work: impl FnOnce(&Reporter) -> Result<T, Stop> + Send + 'static,
        then: impl FnOnce(&mut Self, SensingInputs, T) + Send + 'static,
    ) {
        let inputs = self.document.sensing_inputs();
        self.jobs.start(task, inputs, work, |session, inputs, value| {
            if inputs == session.document.sensing_inputs() {
                return then(session, inputs, value);
            }
            session.live.target = None;
            session.tell("The model of the gauges was for settings that have changed since, and was dropped");
        });
    }

    /// Listens to a board, once the model of the gauges is there.
    pub fn connect(&mut self, text: &str) {
        let address = Address::parse(text.trim(), self.desk.baud, Pace::Real);
        self.disconnect();
        self.live.target = Some(Target::Board(address));
        self.go_on_connecting();
    }

    /// Starts a simulated board and listens to it.
    pub fn start_simulated_board(&mut self) {
        self.disconnect();
        self.live.target = Some(Target::Simulated);
        self.go_on_connecting();
    }

    /// Hangs up.
    pub fn disconnect(&mut self) {
        self.live.connection = None;
        self.live.hosted = None;
        self.live.target = None;
        self.live.gathering = known::Gathering::default();
        self.live.feed = Shared::default();
        self.show_estimator(self.desk.estimator);
    }

    fn go_on_connecting(&mut self) {
        let Some(target) = self.live.target.clone() else {
            return;
        };
        if self.document.state.project.selection.sites.is_empty() {
            self.live.target = None;
            return self.complain("There are no gauges yet: press “Select gauges”, or place them with the tool “Gauges”");
        }
        match (target, self.sensing().map(Arc::clone)) {
            (Target::Board(address), Some(sensing)) => {
                self.live.target = None;
                self.listen(&sensing, address);
            }
            (Target::Board(_), None) => self.make_sensing(),
            (Target::Simulated, known) => self.make_board(known),
        }
    }

    fn make_sensing(&mut self) {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let sensing = design::sensing(&inputs, &budget, &watch).map_err(|e| stop(&e))?;
            Ok(Arc::new(sensing))
        };
        self.start_sensing(Task::Sense, work, |s, inputs, value| {
            s.live.sensing = Some(Slot { inputs, value });
            s.go_on_connecting();
        });
    }

    fn make_board(&mut self, known: Option<Arc<Sensing>>) {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let sensing = match known {
                Some(sensing) => sensing,
                None => Arc::new(design::sensing(&inputs, &budget, &watch).map_err(|e| stop(&e))?),
            };
            let board = board(&inputs, &sensing, r)?;
            Ok((sensing, board))
        };
        self.start_sensing(Task::Board, work, |s, inputs, (sensing, board)| {
            let value = Arc::clone(&sensing);
            s.live.sensing = Some(Slot { inputs, value });
            if s.live.target == Some(Target::Simulated) {
                s.live.target = None;
                s.host(&sensing, board);
            }
        });
    }

    fn host(&mut self, sensing: &Arc<Sensing>, board: SimulatedBoard) {
        let feed = Arc::clone(&self.live.feed);
        let told = move |truth: Truth| {
            if let Ok(mut feed) = feed.lock() {
                feed.take_truth(&truth);
            }
        };
        match doorway().open().and_then(|door| host(board, door, told)) {
            Ok(hosted) => {
                let address = Address::parse(&hosted.port, BAUD, Pace::Real);
                self.live.hosted = Some(hosted);
                self.listen(sensing, address);
            }
            Err(message) => self.complain(message),
        }
    }

    fn listen(&mut self, sensing: &Arc<Sensing>, address: Address) {
        let live = self.document.state.project.live.clone();
        let mut pipeline =
            Pipeline::new(sensing.map_for(&live), live.settings(sensing.gauges.len()));
        let inputs = self.document.sensing_inputs();
        if let Some((used, trained)) = current(self.live.trained.as_ref(), &inputs) {
            pipeline.set_trained(trained.clone(), used.clone());
        }
        let feed = Arc::clone(&self.live.feed);
        let (told, over) = (Arc::clone(&feed), feed);
        let (wake, last) = (self.wake.clone(), self.wake.clone());
        let started = Connection::start(
            Listener::new(address, pipeline),
            move |heard| feed::hear(&told, &heard, &|| wake.now()),
            move |ended| {
                if let Ok(mut feed) = over.lock() {
                    feed.ended = Some(ended);
                }
                last.now();
            },
        );
        match started {
            Ok(connection) => {
                self.live.connection = Some(connection);
                self.live.applied = Some(live);
                self.news.happened(Event::Connected);
            }
            Err(message) => self.complain(message),
        }
    }

    /// Looks after the connection.
    pub(super) fn refresh_live(&mut self) {
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
        self.keep_trained();
        self.gather_known();
        if let (Some(_), Some(truth)) = (&self.live.hosted, self.live.look(|f| f.truth))
            && self.live.look(|f| f.recording.is_some()) == Some(true)
        {
            self.live.send(Command::Truth(truth));
        }
    }

    /// Settings that were changed, or brought back by undo, reach the pipeline.
    fn apply_settings(&mut self) {
        let live = &self.document.state.project.live;
        if self.live.applied.as_ref() == Some(live) {
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
    fn keep_trained(&mut self) {
        if !self.desk.compare && self.desk.estimator == Estimator::Matching {
            return;
        }
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let inputs = self.document.sensing_inputs();
        let trained = current(self.live.trained.as_ref(), &inputs);
        let done = trained.is_some_and(|(u, _)| *u == used);
        let begun = self.live.training_for.as_ref() == Some(&used) && self.jobs.runs(Task::Train);
        if used.iter().filter(|u| **u).count() < 3 || done || begun {
            return;
        }
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        self.live.training_for = Some(used.clone());
        self.start_training(sensing, used);
    }

    fn start_training(&mut self, sensing: Arc<Sensing>, used: Vec<bool>) {
        let inputs = self.document.inputs();
        let noise = self.live.look(|f| f.noise.first().copied()).flatten();
        let noise = noise.unwrap_or(1e-6);
        let count = if self.quality() == Quality::Draft {
            800
        } else {
            3200
        };
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let trained = train(&sensing, &inputs, &used, noise, count, &watch);
            Ok((used, trained.map_err(|e| stop(&e))?))
        };
        self.start_sensing(Task::Train, work, |s, inputs, (used, trained)| {
            s.live.trained = Some(Slot {
                inputs,
                value: (used.clone(), trained.clone()),
            });
            s.live
                .send(Command::Do(Box::new(move |p| p.set_trained(trained, used))));
        });
    }

    /// Shows another estimator.
    pub fn show_estimator(&mut self, estimator: Estimator) {
        self.desk.estimator = estimator;
        if let Ok(mut feed) = self.live.feed.lock() {
            feed.estimator = estimator;
        }
    }

    /// Takes what is read now for rest.
    pub fn tare(&mut self) {
        self.live.send(Command::Tare);
    }

    /// Replays a recording into a table beside it.
    pub fn write_table(&mut self, recording: &Path) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return self.complain("The table is made by the model of the gauges: connect first");
        };
        let live = self.document.state.project.live.clone();
        let recording = recording.to_owned();
        let work = move |_: &Reporter| {
            let settings = live.settings(sensing.gauges.len());
            let pipeline = Pipeline::new(sensing.map_for(&live), settings);
            let table = recording.with_extension("csv");
            write_table(&recording, &table, pipeline).map_err(|e| Stop::Failed(format!("{e:#}")))
        };
        // A file that was written is there whatever has changed since.
        self.jobs.start(Task::Table, (), work, |s, (), paths| {
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            s.tell(format!("The table is in {}", names.join(" and ")));
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

    /// Begins to record into a file of this name, or one of a new name beside the project; or ends the recording.
    pub fn toggle_recording(&mut self, name: &str) {
        if self.live.look(|f| f.recording.is_some()) == Some(true) {
            self.stop_recording();
        } else {
            let path = self.recording_path(name.trim());
            self.record(&path);
        }
    }

    fn recording_path(&self, name: &str) -> PathBuf {
        let own = self.document.path.as_ref().and_then(|p| p.parent());
        let folder = own.map_or_else(std::env::temp_dir, Path::to_path_buf);
        if !name.is_empty() {
            return folder.join(name).with_extension(ENDING);
        }
        let numbered = |n: usize| folder.join(format!("touches-{n}.{ENDING}"));
        let free = (1..10_000).find(|n| !numbered(*n).exists());
        numbered(free.unwrap_or(1))
    }
}

/// The simulated board of a project, with gauges as a workshop glues them.
fn board(inputs: &Inputs, sensing: &Sensing, r: &Reporter) -> Result<SimulatedBoard, Stop> {
    let seed = inputs.project.budget.seed;
    let places = places(inputs, sensing, seed).map_err(|e| stop(&e))?;
    let script = Script::random(places, FORCES_N, script_seed(seed));
    let made = simulated(
        inputs,
        sensing,
        Workshop::All,
        script,
        FORCES_N[1],
        options(inputs, sensing.gauges.len()),
        Faults::default(),
        &|p| r.report(p),
    );
    made.map_err(|e| stop(&e))
}

fn doorway() -> Doorway {
    #[cfg(unix)]
    return Doorway::Terminal;
    #[cfg(not(unix))]
    return Doorway::Socket("127.0.0.1:0".into());
}
