//! Who listens: the commands that it takes, and the events that it reports.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use glam::DVec3;

use super::timing::Timing;
use crate::link::counted_line::CountedLine;
use crate::link::{Address, HeldConnection, Port, Recorder, Truths};
use crate::live::{LiveNews, LiveUpdate, Pipeline, Receiver, Rest, Sample, Traffic, Unusable};
use crate::wire::{Hello, WireMessage, encode};

/// How the connection stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConnectionState {
    /// The port is open; nothing was understood yet.
    Waiting,
    Live,
    /// The port is open and has fallen silent.
    Silent,
    /// Unplugged; looked for again and again.
    Gone,
    /// The recording is over.
    Ended,
}

/// What is reported while listening.
pub enum SessionEvent<'a> {
    State(&'a ConnectionState),
    Hello(&'a Hello),
    Sample {
        sample: &'a Sample,
        update: &'a LiveUpdate,
        pipeline: &'a Pipeline,
    },
    /// Where a simulated board is really touched (m, N).
    Truth(Option<(DVec3, f64)>),
    /// What the clock of the machine that recorded said at a time of the board's (µs since 1970, µs).
    Clock {
        unix_us: u64,
        time_us: u64,
    },
    /// What the board says, or how a recording was; safe to show.
    Message(&'a str),
    /// What comes to pass with the rest and the gauges.
    News(LiveNews),
    /// Why nothing that comes can be used; each reason once.
    Trouble(&'a str),
    /// Why a recording could not begin, or ended by itself.
    Unrecorded(&'a str),
    /// After every look at the port.
    Turn {
        traffic: Traffic,
        timing: &'a Timing,
        pipeline: &'a Pipeline,
        recorder: Option<&'a Recorder>,
    },
}

impl SessionEvent<'_> {
    /// What it says to whoever looks on, where it says anything.
    #[must_use]
    pub fn words(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Message(text) | Self::Trouble(text) => Some(Cow::Borrowed(text)),
            Self::News(news) => Some(Cow::Owned(news.in_words())),
            _ => None,
        }
    }
}

/// What can be asked of a connection.
pub enum ListenerCommand {
    Tare,
    /// Samples a second.
    Rate(u16),
    Record(PathBuf),
    StopRecording,
    Do(Box<dyn FnOnce(&mut Pipeline) + Send>),
}

/// One who listens, on whatever thread it is run on.
pub struct Listener {
    pub(super) address: Address,
    /// The connection to it, where it is open already.
    pub(super) held: Option<HeldConnection>,
    pub(super) pipeline: Pipeline,
    pub(super) receiver: Receiver,
    pub(super) recorder: Option<Recorder>,
    /// Of a simulated board of our own.
    pub(super) truths: Option<Arc<Mutex<Truths>>>,
    pub(super) timing: Timing,
    pub(super) hello: Option<Hello>,
    /// The USB device at the port, as [`crate::link::PortInfo::identity`].
    pub(super) device: Option<String>,
    pub(super) rate: Option<u16>,
    pub(super) state: ConnectionState,
    /// When what is taken in just now came.
    pub(super) came: Instant,
    /// When the last sample came, or the board answered, or the port was opened.
    pub(super) last_arrival: Instant,
    /// Why nothing can be used, as far as it was told.
    pub(super) explained: Vec<Unusable>,
    /// How many channels were compared with those of the gauges.
    pub(super) compared: Option<usize>,
    /// What a recording brings in pieces: a rest, and the counts of a line.
    pub(super) rest: Rest,
    pub(super) line: CountedLine,
    /// Whether a recording has notes. Texts of the board are never taken for them then.
    pub(super) noted: bool,
    pub(super) measured: u64,
    pub(super) begun: Instant,
    pub(super) said: u16,
}

impl Listener {
    #[must_use]
    pub fn new(address: Address, pipeline: Pipeline) -> Self {
        Self {
            address,
            held: None,
            pipeline,
            receiver: Receiver::default(),
            recorder: None,
            truths: None,
            timing: Timing::default(),
            hello: None,
            device: None,
            rate: None,
            state: ConnectionState::Waiting,
            came: Instant::now(),
            last_arrival: Instant::now(),
            explained: Vec::new(),
            compared: None,
            rest: Rest::default(),
            line: CountedLine::default(),
            noted: false,
            measured: 0,
            begun: Instant::now(),
            said: 0,
        }
    }

    /// Samples a second that the board is asked for.
    #[must_use]
    pub fn at_rate(mut self, hertz: Option<u16>) -> Self {
        self.rate = hertz;
        self
    }

    /// Goes on with a connection that is open already.
    #[must_use]
    pub fn holding(mut self, held: Option<HeldConnection>) -> Self {
        self.begun = held.as_ref().map_or(self.begun, |held| held.since);
        self.held = held;
        self
    }

    /// Records from the beginning.
    #[must_use]
    pub fn recording(mut self, recorder: Option<Recorder>) -> Self {
        self.recorder = recorder;
        self
    }

    /// To a simulated board that says what really touches it.
    #[must_use]
    pub fn knowing(mut self, truths: Option<Arc<Mutex<Truths>>>) -> Self {
        self.truths = truths;
        self
    }

    pub(super) fn enter(&mut self, state: ConnectionState, tell: &mut impl FnMut(SessionEvent)) {
        self.state = state;
        tell(SessionEvent::State(&self.state));
    }

    pub(super) fn say(&mut self, port: &mut dyn Port, message: &WireMessage) {
        let mut bytes = Vec::new();
        encode(
            message,
            self.said,
            self.begun.elapsed().as_micros() as u32,
            12,
            &mut bytes,
        );
        self.said = self.said.wrapping_add(1);
        port.write(&bytes);
    }
}
