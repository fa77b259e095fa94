//! The thread that listens: opens, asks, reads, understands, records, and finds the board again.

mod connection;
mod notes;
mod reconnect;
mod recording;
mod timing;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver as Inbox;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{Address, Got, Port, Recorder, old_note};
use crate::live::{Doubt, Input, Pipeline, Receiver, Rest, Sample, Traffic, Update};
use crate::plain;
use crate::wire::{Hello, Message, encode};

pub use connection::Connection;
pub use timing::Timing;

/// How the connection stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
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

/// What is told while listening.
pub enum Heard<'a> {
    State(&'a State),
    Hello(&'a Hello),
    Sample {
        sample: &'a Sample,
        update: &'a Update,
        pipeline: &'a Pipeline,
    },
    /// From a recording of a simulated board: where it is really touched (m, N).
    Truth(Option<(DVec3, f64)>),
    /// What the board says, or how a recording was; safe to show.
    Message(&'a str),
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

/// What can be asked of a connection.
pub enum Command {
    Tare,
    /// Samples a second.
    Rate(u16),
    Record(PathBuf),
    StopRecording,
    /// Where a simulated board is really touched, for the recording.
    Truth(Option<(DVec3, f64)>),
    Do(Box<dyn FnOnce(&mut Pipeline) + Send>),
}

/// Asked again so often while nothing is understood; silence that is told.
const ASK: Duration = Duration::from_millis(400);
const SILENCE: Duration = Duration::from_millis(700);
/// How long a board may take to be understood before it is said why it is not.
const PATIENCE: Duration = Duration::from_secs(3);
/// The most reasons that are told of one connection.
const REASONS: usize = 8;

/// One who listens, on whatever thread it is run on.
pub struct Listener {
    address: Address,
    pipeline: Pipeline,
    receiver: Receiver,
    recorder: Option<Recorder>,
    timing: Timing,
    hello: Option<Hello>,
    rate: Option<u16>,
    state: State,
    /// When the last sample came, or the port was opened.
    heard: Instant,
    /// Why nothing can be used, as far as it was told.
    explained: Vec<Doubt>,
    /// How many channels were compared with those of the gauges.
    compared: Option<usize>,
    /// What a recording brings in pieces: a rest, and the counts of a line.
    rest: Rest,
    line: Vec<f64>,
    /// Whether a recording has notes. Texts of the board are never taken for them then.
    noted: bool,
    measured: u64,
    begun: Instant,
    said: u16,
}

impl Listener {
    #[must_use]
    pub fn new(address: Address, pipeline: Pipeline) -> Self {
        Self {
            address,
            pipeline,
            receiver: Receiver::default(),
            recorder: None,
            timing: Timing::default(),
            hello: None,
            rate: None,
            state: State::Waiting,
            heard: Instant::now(),
            explained: Vec::new(),
            compared: None,
            rest: Rest::default(),
            line: Vec::new(),
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

    /// Records from the beginning.
    #[must_use]
    pub fn recording(mut self, recorder: Option<Recorder>) -> Self {
        self.recorder = recorder;
        self
    }

    /// Listens until it is told to stop, or a recording ends. Unplugged boards are waited for.
    ///
    /// # Errors
    /// When the port cannot be opened at first, or nothing in a recording can be used.
    pub fn run(
        mut self,
        stop: &AtomicBool,
        inbox: &Inbox<Command>,
        mut tell: impl FnMut(Heard),
    ) -> Result<(), String> {
        let mut port = self.address.open()?;
        if self.recorder.is_some() {
            self.begin_recording();
        }
        loop {
            self.enter(State::Waiting, &mut tell);
            self.listen(&mut *port, stop, inbox, &mut tell);
            self.flush_recording(&mut tell);
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if self.address.is_recording() {
                return self.end(&mut tell);
            }
            self.enter(State::Gone, &mut tell);
            match self.find_again(stop, inbox, &mut tell) {
                Some(again) => port = again,
                None => return Ok(()),
            }
        }
    }

    /// The recording is over; whether it was of any use.
    fn end(&mut self, tell: &mut impl FnMut(Heard)) -> Result<(), String> {
        let refused = self.receiver.traffic.refused;
        if self.measured > 0 {
            if refused > 0 {
                tell(Heard::Message(&format!(
                    "frames of the recording that are damaged or not understood, and were left out: {refused}"
                )));
            }
            self.enter(State::Ended, tell);
            return Ok(());
        }
        let why = self.receiver.doubt().and_then(Doubt::in_words);
        let why = why.map_or(String::new(), |why| format!(": {why}"));
        Err(format!(
            "{}: there is no reading in this recording that can be used{why}",
            self.address
        ))
    }

    fn enter(&mut self, state: State, tell: &mut impl FnMut(Heard)) {
        self.state = state;
        tell(Heard::State(&self.state));
    }

    /// Until the port is gone.
    fn listen(
        &mut self,
        port: &mut dyn Port,
        stop: &AtomicBool,
        inbox: &Inbox<Command>,
        tell: &mut impl FnMut(Heard),
    ) {
        self.receiver.reset();
        self.explained.clear();
        self.compared = None;
        (self.noted, self.heard) = (false, Instant::now());
        let mut buffer = vec![0; 16 * 1024];
        let mut inputs = Vec::new();
        let mut asked = None::<Instant>;
        while !stop.load(Ordering::Relaxed) {
            while let Ok(command) = inbox.try_recv() {
                self.obey(command, port, tell);
            }
            let live = self.state == State::Live;
            if !live && !self.receiver.speaks_lines() && asked.is_none_or(|t| t.elapsed() > ASK) {
                self.say(port, &Message::AskHello);
                asked = Some(Instant::now());
            }
            match port.read(&mut buffer) {
                Got::Gone => return,
                Got::Nothing => {}
                Got::Bytes(count) => {
                    let arrived = Instant::now();
                    let now_us = self.begun.elapsed().as_micros() as u64;
                    self.receiver
                        .push(&buffer[..count], now_us, |input| inputs.push(input));
                    for input in inputs.drain(..) {
                        self.take(input, arrived, port, tell);
                    }
                }
            }
            // Bytes that cannot be used are silence too.
            if self.state == State::Live && self.heard.elapsed() > SILENCE {
                self.enter(State::Silent, tell);
            }
            self.explain(tell);
            self.turn(tell);
        }
    }

    /// Says why nothing that comes can be used: at once where waiting will not help.
    fn explain(&mut self, tell: &mut impl FnMut(Heard)) {
        let Some(doubt) = self.receiver.doubt() else {
            return;
        };
        let due = doubt.is_lasting() || self.heard.elapsed() > PATIENCE;
        if !due || self.explained.contains(&doubt) || self.explained.len() >= REASONS {
            return;
        }
        self.explained.push(doubt);
        if let Some(words) = doubt.in_words() {
            tell(Heard::Trouble(&words));
        }
    }

    fn turn(&mut self, tell: &mut impl FnMut(Heard)) {
        self.check_recording(tell);
        tell(Heard::Turn {
            traffic: self.receiver.traffic,
            timing: &self.timing,
            pipeline: &self.pipeline,
            recorder: self.recorder.as_ref(),
        });
    }

    fn say(&mut self, port: &mut dyn Port, message: &Message) {
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

    fn obey(&mut self, command: Command, port: &mut dyn Port, tell: &mut impl FnMut(Heard)) {
        match command {
            Command::Tare => {
                self.pipeline.tare();
                self.record(|r| r.own("tare"));
            }
            Command::Rate(hertz) => {
                self.rate = Some(hertz);
                self.say(port, &Message::Rate(hertz));
            }
            Command::Record(path) => match Recorder::create(&path) {
                Ok(recorder) => {
                    self.recorder = Some(recorder);
                    self.begin_recording();
                }
                Err(why) => tell(Heard::Unrecorded(&why)),
            },
            Command::StopRecording => {
                self.flush_recording(tell);
                self.recorder = None;
            }
            Command::Truth(touch) => self.record(|r| r.truth(touch)),
            Command::Do(work) => {
                work(&mut self.pipeline);
                // The gauges may be on other channels now.
                self.compared = None;
            }
        }
    }

    fn take(
        &mut self,
        input: Input,
        arrived: Instant,
        port: &mut dyn Port,
        tell: &mut impl FnMut(Heard),
    ) {
        match input {
            Input::Hello(hello) => self.greet(hello, port, tell),
            Input::Sample(sample) => self.measure(&sample, arrived, tell),
            Input::Log {
                level,
                text,
                time_us,
            } => match old_note(level, &text).filter(|_| self.has_old_notes()) {
                Some(own) => self.replay(own, time_us, arrived, tell),
                None => tell(Heard::Message(&as_said(&text))),
            },
            Input::Note { text, time_us } if self.address.is_recording() => {
                self.noted = true;
                self.replay(&text, time_us, arrived, tell);
            }
            // What a board says is never a command.
            Input::Note { .. } | Input::Pong(_) => {}
        }
    }

    /// Recordings from before there were notes held texts in their place, and no other texts.
    fn has_old_notes(&self) -> bool {
        self.address.is_recording() && !self.noted
    }

    fn greet(&mut self, hello: Hello, port: &mut dyn Port, tell: &mut impl FnMut(Heard)) {
        self.pipeline.hello(&hello);
        self.record(|r| r.hello(&hello));
        tell(Heard::Hello(&Hello {
            name: plain::message(&in_one_line(&hello.name)),
            ..hello.clone()
        }));
        self.compare_channels(usize::from(hello.channels), tell);
        if let Some(rate) = self
            .rate
            .filter(|&r| r != hello.rate_hz && self.hello.as_ref() != Some(&hello))
        {
            self.say(port, &Message::Rate(rate));
        }
        self.hello = Some(hello);
        self.say(port, &Message::Start);
    }

    /// Says where a gauge is on a channel that does not come, whether a board has told how many there are or its
    /// lines show it; each number of channels once.
    fn compare_channels(&mut self, channels: usize, tell: &mut impl FnMut(Heard)) {
        if self.compared.replace(channels) == Some(channels) {
            return;
        }
        let mut gauges = self.pipeline.settings.channels.iter().enumerate();
        if let Some((gauge, channel)) = gauges.find(|(_, c)| **c >= channels) {
            let many = if channels == 1 { "" } else { "s" };
            tell(Heard::Message(&format!(
                "gauge {} is on channel {channel}, but this board has only {channels} channel{many} (from 0): nothing can be told of a touch. Correct “Channels of the gauges”, or channels in the project's table [live]",
                gauge + 1
            )));
        }
    }

    fn measure(&mut self, sample: &Sample, arrived: Instant, tell: &mut impl FnMut(Heard)) {
        self.measured += 1;
        if self.state != State::Live {
            self.enter(State::Live, tell);
        }
        if self.pipeline.rest.is_none() && !self.pipeline.is_taring() {
            self.pipeline.tare();
            self.record(|r| r.own("tare"));
        }
        self.compare_channels(sample.counts.len(), tell);
        let update = self.pipeline.push(sample);
        // What nobody touches is soon computed, and would hide the rest.
        if update.contact.is_some() {
            self.timing.push(arrived.elapsed().as_secs_f32() * 1e6);
        }
        self.record(|r| r.sample(sample));
        tell(Heard::Sample {
            sample,
            update: &update,
            pipeline: &self.pipeline,
        });
        // Not when it arrived: one that is slow to compute is not silent.
        self.heard = Instant::now();
    }
}

/// A text of a board cannot be taken for the studio's own words.
fn as_said(text: &str) -> String {
    let text = plain::message(&in_one_line(text)).replace(['“', '”'], "\"");
    format!("the board says: “{text}”")
}

/// A text of a board cannot be taken for several of our own.
fn in_one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests;
