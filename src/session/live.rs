//! Live touch: a board, or one that is simulated, and what its readings say of a touch.

pub(super) mod feed;
pub(super) mod gathering;
mod known;
pub(super) mod served;
mod streaming;
pub(super) mod training;
mod upkeep;

pub use feed::{Feed, Recording, STRIPS_S, Strip};
pub use gathering::{Awaited, Gathered};
pub use known::{LEAST as LEAST_KNOWN, WANTED as WANTED_KNOWN};
pub use served::USUAL_ADDRESS;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::desk::Desk;
use super::jobs::{Task, stop};
use super::news::Happening;
use super::slot::{Slot, current};
use super::state::Session;
use super::state::live::Target;
use crate::board::{
    ChannelFault, Faults, HardestUse, Illness, PressScript, RandomPresses, SimulatedBoard, Truth,
    script_seed,
};
use crate::design::simulated_board::{BoardRequest, LASTS_S, options, places, simulated};
use crate::design::{Inputs, Sensing, Workshop};
use crate::document::SensingInputs;
use crate::io::kept_model;
use crate::job::{Reporter, Stop};
use crate::link::{
    Address, BAUD, Connection, Doorway, ENDING, Listener, ListenerCommand, Pace, Truths, host,
};
use crate::live::{Pipeline, ShownEstimator};
use feed::FeedShared;

/// What may happen to a simulated board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mishap {
    /// For two seconds.
    Unplugged,
    /// To a gauge of its own for each illness.
    Ill(Illness),
    /// All gauges are well again.
    Recovery,
}

/// Smallest and largest force of the touches of a simulated board (N).
const FORCES_N: [f64; 2] = [2.0, 15.0];

impl Session {
    pub(super) fn sensing(&self) -> Option<&Arc<Sensing>> {
        current(self.live.sensing.as_ref(), &self.document.sensing_inputs())
    }

    /// Starts a job whose result is of the model of the gauges as they are now.
    pub(super) fn start_sensing<T: Send + 'static>(
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
        let pressed = self.desk.bench.asked.simulated.is_none() && self.bench.goes_on();
        if pressed && !address.is_recording() {
            return self.complain("A run goes on at the bench, and only one may listen to a board: stop pressing first");
        }
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

    /// Has something go wrong at the simulated board from now on, where there is one.
    pub fn let_happen(&mut self, mishap: Mishap) {
        const UNPLUGGED_S: f64 = 2.0;
        let Some(hosted) = self.live.simulated_board() else {
            return;
        };
        let now = hosted.seconds();
        let Ok(mut board) = hosted.board.lock() else {
            return;
        };
        let faults = board.faults_mut();
        match mishap {
            Mishap::Unplugged => faults.unplugged.push((now, now + UNPLUGGED_S)),
            Mishap::Ill(illness) => faults.channels.push(ChannelFault {
                channel: illness as usize,
                illness,
                from_s: now,
                until_s: f64::INFINITY,
            }),
            Mishap::Recovery => faults.channels.clear(),
        }
    }

    /// Hangs up.
    pub fn disconnect(&mut self) {
        self.live.connection = None;
        self.live.hosted = None;
        self.live.target = None;
        self.live.feed = FeedShared::default();
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
                self.listen(&sensing, address, None);
            }
            (Target::Board(_), None) => self.make_sensing(),
            (Target::Simulated, known) => self.make_board(known),
        }
    }

    fn make_sensing(&mut self) {
        let sensing = self.to_sense();
        let work = move |r: &Reporter| Ok(Arc::new(sensing(r)?));
        self.start_sensing(Task::Sense, work, |s, inputs, value| {
            s.live.sensing = Some(Slot { inputs, value });
            s.go_on_connecting();
        });
    }

    /// Work that gets the model of the gauges as they are now: from beside the project, where it was kept.
    fn to_sense(&self) -> impl FnOnce(&Reporter) -> Result<Sensing, Stop> + Send + 'static {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        let project = self.document.path.clone();
        move |r| {
            let watch = |p| r.report(p);
            kept_model::sensing(&inputs, project.as_deref(), &budget, &watch).map_err(|e| stop(&e))
        }
    }

    fn make_board(&mut self, known: Option<Arc<Sensing>>) {
        let (inputs, anew) = (self.document.inputs(), self.to_sense());
        let work = move |r: &Reporter| {
            let sensing = match known {
                Some(sensing) => sensing,
                None => Arc::new(anew(r)?),
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
        let truths = Arc::new(Mutex::new(Truths::default()));
        let known = Arc::clone(&truths);
        let on_truth = move |truth: Truth| {
            if let Ok(mut known) = known.lock() {
                known.push(truth);
            }
        };
        match doorway()
            .open()
            .and_then(|door| host(board, door, on_truth))
        {
            Ok(hosted) => {
                let address = Address::parse(&hosted.port, BAUD, Pace::Real);
                self.live.hosted = Some(hosted);
                self.listen(sensing, address, Some(truths));
            }
            Err(message) => self.complain(message),
        }
    }

    fn listen(
        &mut self,
        sensing: &Arc<Sensing>,
        address: Address,
        truths: Option<Arc<Mutex<Truths>>>,
    ) {
        let live = self.document.state.project.live.clone();
        let (model, settings) = self.gauge_model(sensing);
        let mut pipeline = Pipeline::new(model, settings);
        pipeline.set_learned(self.learned_alone());
        let inputs = self.document.sensing_inputs();
        if let Some((used, trained)) = current(self.live.trained.as_ref(), &inputs) {
            pipeline.set_trained(trained.clone(), used.clone());
        }
        let feed = Arc::clone(&self.live.feed);
        let server = Arc::clone(&self.live.server);
        let (shared, over) = (Arc::clone(&feed), feed);
        let (wake, last) = (self.wake.clone(), self.wake.clone());
        let started = Connection::start(
            Listener::new(address, pipeline).knowing(truths),
            move |event| {
                served::hear(&server, &event);
                feed::hear(&shared, &event, &|| wake.now());
            },
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
                self.news.forget_board();
                self.news.happened(Happening::Connected);
            }
            Err(message) => self.complain(message),
        }
    }

    /// Changes what belongs to the desk.
    pub fn set_desk(&mut self, desk: Desk) {
        self.desk = desk;
        self.show_estimator(self.desk.estimator);
    }

    /// Shows another estimator.
    pub fn show_estimator(&mut self, estimator: ShownEstimator) {
        self.desk.estimator = estimator;
        if let Ok(mut feed) = self.live.feed.lock() {
            feed.estimator = estimator;
        }
    }

    /// Takes what is read now for rest.
    pub fn tare(&mut self) {
        self.live.send(ListenerCommand::Tare);
    }

    /// Begins to record raw counts.
    pub fn record(&mut self, path: &Path) {
        self.live.recorded = Some(path.to_owned());
        self.live.send(ListenerCommand::Record(path.to_owned()));
    }

    /// Ends the recording.
    pub fn stop_recording(&mut self) {
        self.live.send(ListenerCommand::StopRecording);
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
    let script = PressScript::random(
        places,
        RandomPresses::usual(FORCES_N, inputs.project.making()),
        script_seed(seed),
    );
    let asked = BoardRequest {
        workshop: Workshop::All,
        script,
        hardest: Some(HardestUse {
            force: FORCES_N[1],
            seconds: LASTS_S,
        }),
        options: options(inputs, sensing.gauges.len()),
        faults: Faults::default(),
    };
    simulated(inputs, sensing, asked, &|p| r.report(p)).map_err(|e| stop(&e))
}

fn doorway() -> Doorway {
    #[cfg(unix)]
    return Doorway::Terminal;
    #[cfg(not(unix))]
    return Doorway::Socket("127.0.0.1:0".into());
}
