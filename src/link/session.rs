//! The thread that listens: opens, asks, reads, understands, records, and finds the board again.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver as Inbox, Sender, channel};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{Address, Got, Port, Recorder, old_note, ports};
use crate::live::{Doubt, Input, Pipeline, Receiver, Rest, Sample, Traffic, Update};
use crate::plain;
use crate::wire::{Hello, MOST_CHANNELS, Message, encode};

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

/// Between bytes that arrive and the touch that was computed from them.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    /// The last ones (µs), in a ring.
    ring: Vec<f32>,
    next: usize,
}

impl Timing {
    const KEPT: usize = 4096;

    fn push(&mut self, micros: f32) {
        if self.ring.len() < Self::KEPT {
            self.ring.push(micros);
        } else {
            self.ring[self.next] = micros;
        }
        self.next = (self.next + 1) % Self::KEPT;
    }

    /// The value (µs) that a share of the last samples stayed below.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<f32> {
        let mut sorted = self.ring.clone();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        Some(sorted[(share * last as f64).round() as usize])
    }
}

/// Asked again so often while nothing is understood; silence that is told; tries to find a board again.
const ASK: Duration = Duration::from_millis(400);
const SILENCE: Duration = Duration::from_millis(700);
const AGAIN: Duration = Duration::from_millis(150);
/// How long a board may take to be understood before it is said why it is not.
const PATIENCE: Duration = Duration::from_secs(3);
/// The most reasons that are told of one connection.
const REASONS: usize = 8;
/// How long another port has to say which board it is.
const WHO: Duration = Duration::from_millis(400);

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

    /// A recording that can be written no more has ended, and that is said.
    fn check_recording(&mut self, tell: &mut impl FnMut(Heard)) {
        if let Some(why) = self.recorder.as_mut().and_then(|r| r.failed.take()) {
            self.recorder = None;
            tell(Heard::Unrecorded(&why));
        }
    }

    fn flush_recording(&mut self, tell: &mut impl FnMut(Heard)) {
        if let Some(recorder) = &mut self.recorder {
            recorder.flush();
        }
        self.check_recording(tell);
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
            Command::Do(work) => work(&mut self.pipeline),
        }
    }

    fn record(&mut self, write: impl FnOnce(&mut Recorder)) {
        if let Some(recorder) = &mut self.recorder {
            write(recorder);
        }
    }

    /// A recording can be replayed on its own: it begins with the board and its rest.
    fn begin_recording(&mut self) {
        self.pipeline.begin_anew();
        let taring = self.pipeline.is_taring();
        if taring {
            self.pipeline.tare();
        }
        if let (Some(recorder), Some(hello)) = (&mut self.recorder, &self.hello) {
            recorder.hello(hello);
        }
        if let (Some(recorder), Some(rest)) = (&mut self.recorder, &self.pipeline.rest) {
            recorder.rest(rest);
        }
        let dead: Vec<usize> = self.pipeline.dead().collect();
        self.record(|r| {
            if taring {
                r.own("tare");
            }
            for k in dead {
                r.own(&format!("dead {k}"));
            }
        });
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
                None => tell(Heard::Message(&plain::message(&in_one_line(&text)))),
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
        let channels = self.pipeline.settings.channels.iter().enumerate();
        if let Some((gauge, channel)) =
            { channels }.find(|(_, c)| **c >= usize::from(hello.channels))
        {
            tell(Heard::Message(&format!(
                "gauge {} is on channel {channel}, but this board has only {} channels (from 0): nothing can be told of a touch. Correct “Channels of the gauges”, or channels in the project's table [live]",
                gauge + 1,
                hello.channels
            )));
        }
        if let Some(rate) = self
            .rate
            .filter(|&r| r != hello.rate_hz && self.hello.as_ref() != Some(&hello))
        {
            self.say(port, &Message::Rate(rate));
        }
        self.hello = Some(hello);
        self.say(port, &Message::Start);
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

    /// What the studio did when this was recorded.
    fn replay(&mut self, own: &str, time_us: u64, arrived: Instant, tell: &mut impl FnMut(Heard)) {
        let words: Vec<&str> = own.split_whitespace().collect();
        match words[..] {
            ["tare"] => self.pipeline.tare(),
            ["rest", k, level, noise] => {
                if let (Ok(k), Some(level), Some(noise)) =
                    (k.parse::<usize>(), number(level), number(noise))
                    && k == self.rest.level.len()
                {
                    self.rest.level.push(level);
                    self.rest.noise.push(noise);
                }
                if self.rest.level.len() == self.pipeline.settings.channels.len() {
                    self.pipeline.set_rest(std::mem::take(&mut self.rest));
                }
            }
            ["dead", k] => {
                if let Ok(k) = k.parse() {
                    self.pipeline.mark_dead(&[k]);
                }
            }
            ["truth", "none"] => tell(Heard::Truth(None)),
            ["truth", x, y, z, force] => {
                if let [Some(x), Some(y), Some(z), Some(force)] = [x, y, z, force].map(number) {
                    tell(Heard::Truth(Some((DVec3::new(x, y, z) * 1e-3, force))));
                }
            }
            ["part", from, values] => {
                self.gather(from, values);
            }
            ["line", values] => self.replay_line("0", values, time_us, arrived, tell),
            ["line", from, values] => self.replay_line(from, values, time_us, arrived, tell),
            _ => {}
        }
    }

    /// The end of a line of counts, with what was gathered of it before.
    fn replay_line(
        &mut self,
        from: &str,
        values: &str,
        time_us: u64,
        arrived: Instant,
        tell: &mut impl FnMut(Heard),
    ) {
        if self.gather(from, values) {
            let counts = std::mem::take(&mut self.line);
            self.measure(&Sample { time_us, counts }, arrived, tell);
        }
    }

    /// Counts of a line from one channel on; none of it is used where those before them are missing.
    fn gather(&mut self, from: &str, values: &str) -> bool {
        let from = from.parse().unwrap_or(usize::MAX);
        if from == 0 {
            self.line.clear();
        }
        let piece: Option<Vec<f64>> = values.split(',').map(number).collect();
        let piece = piece.filter(|p| from == self.line.len() && from + p.len() <= MOST_CHANNELS);
        if let Some(piece) = &piece {
            self.line.extend(piece);
        } else {
            self.line.clear();
        }
        piece.is_some()
    }

    /// The same board at the same port, or at another one. Nothing when it is no longer wanted.
    fn find_again(
        &mut self,
        stop: &AtomicBool,
        inbox: &Inbox<Command>,
        tell: &mut impl FnMut(Heard),
    ) -> Option<Box<dyn Port>> {
        while !stop.load(Ordering::Relaxed) {
            if let Ok(port) = self.address.open() {
                return Some(port);
            }
            if let Some(port) = self.at_another_port() {
                return Some(port);
            }
            while let Ok(command) = inbox.try_recv() {
                self.obey(command, &mut Nowhere, tell);
            }
            self.turn(tell);
            std::thread::sleep(AGAIN);
        }
        None
    }

    fn at_another_port(&mut self) -> Option<Box<dyn Port>> {
        let (Address::Serial { path, baud }, Some(board)) =
            (&self.address, self.hello.as_ref().map(|h| h.board))
        else {
            return None;
        };
        let (path, baud) = (path.clone(), *baud);
        for other in ports().into_iter().filter(|p| p.likely && p.path != path) {
            let address = Address::Serial {
                path: other.path,
                baud,
            };
            let Ok(mut port) = address.open() else {
                continue;
            };
            if self.asks(&mut *port) == Some(board) {
                self.address = address;
                return Some(port);
            }
        }
        None
    }

    /// Which board it is.
    fn asks(&mut self, port: &mut dyn Port) -> Option<u32> {
        self.say(port, &Message::AskHello);
        let (begun, mut receiver, mut buffer) = (Instant::now(), Receiver::default(), [0; 4096]);
        let mut found = None;
        while found.is_none() && begun.elapsed() < WHO {
            match port.read(&mut buffer) {
                Got::Gone => return None,
                Got::Nothing => {}
                Got::Bytes(count) => receiver.push(&buffer[..count], 0, |input| {
                    if let Input::Hello(hello) = input {
                        found = Some(hello.board);
                    }
                }),
            }
        }
        found
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

/// A text of a board cannot be taken for several of our own.
fn in_one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// For what is asked while there is no port.
struct Nowhere;

impl Port for Nowhere {
    fn read(&mut self, _: &mut [u8]) -> Got {
        Got::Gone
    }
    fn write(&mut self, _: &[u8]) {}
}

/// A listener on a thread of its own; it ends when this is dropped.
pub struct Connection {
    commands: Sender<Command>,
    stop: Arc<AtomicBool>,
}

impl Connection {
    /// Starts to listen. `tell` is called on the listening thread; `ended` at the end, with why it could not begin.
    ///
    /// # Errors
    /// When no thread can be had.
    pub fn start(
        listener: Listener,
        tell: impl FnMut(Heard) + Send + 'static,
        ended: impl FnOnce(Result<(), String>) + Send + 'static,
    ) -> Result<Self, String> {
        let (commands, inbox) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        std::thread::Builder::new()
            .name("board".into())
            .spawn(move || ended(listener.run(&stopping, &inbox, tell)))
            .map_err(|e| format!("the port cannot be listened to ({e})"))?;
        Ok(Self { commands, stop })
    }

    pub fn send(&self, command: Command) {
        // A listener that has ended hears nothing any more, and has said so.
        let _ = self.commands.send(command);
    }
}

impl Drop for Connection {
    /// Does not wait: a thread that is looking for an unplugged board may take a moment to hear of it.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpListener;
    use std::path::Path;

    use super::*;
    use crate::inference::ResponseMap;
    use crate::limb::LimbSpec;
    use crate::link::Pace;
    use crate::live::Settings;

    const GAUGES: usize = 4;

    fn pipeline() -> Pipeline {
        let spec = LimbSpec {
            element: 20.0,
            ..LimbSpec::default()
        };
        let mesh = spec.build().unwrap().0;
        let nodes = mesh.positions().len() + mesh.edges().len();
        let value = |k: usize| 1e-5 * (1.7 * k as f64).sin();
        let values = (0..nodes * GAUGES).map(value).collect();
        let map = ResponseMap::of(Arc::new(mesh), GAUGES, values);
        Pipeline::new(Arc::new(map), Settings::of(GAUGES))
    }

    fn hello() -> Hello {
        Hello {
            version: crate::wire::VERSION,
            board: 7,
            channels: 4,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 5000,
            gain_milli: 330_000,
            rate_hz: 1000,
            name: "limb\u{1b}[31m".into(),
        }
    }

    fn frames(messages: &[Message]) -> Vec<u8> {
        let mut bytes = vec![0];
        for (k, message) in (0..).zip(messages) {
            encode(message, k, 1000 * u32::from(k), 12, &mut bytes);
        }
        bytes
    }

    /// All that is heard there until it is over, and how it ended.
    fn heard(address: Address) -> (Vec<String>, Vec<Vec<f64>>, Result<(), String>) {
        let (mut said, mut counts) = (Vec::new(), Vec::new());
        let (stop, (_commands, inbox)) = (AtomicBool::new(false), channel());
        let ended = Listener::new(address, pipeline()).run(&stop, &inbox, |heard| match heard {
            Heard::State(State::Gone) => stop.store(true, Ordering::Relaxed),
            Heard::Hello(hello) => said.push(format!("hello {}", hello.name)),
            Heard::Message(text) => said.push(format!("message {text}")),
            Heard::Trouble(text) => said.push(format!("trouble {text}")),
            Heard::Truth(touch) => said.push(format!("truth {touch:?}")),
            Heard::Sample { sample, .. } => counts.push(sample.counts.clone()),
            _ => {}
        });
        (said, counts, ended)
    }

    fn of_board(bytes: Vec<u8>) -> Vec<String> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            stream.write_all(&bytes).unwrap();
            stream.shutdown(std::net::Shutdown::Write).unwrap();
            // Until the other side has taken it and is gone.
            let _ = std::io::copy(&mut stream, &mut std::io::sink());
        });
        heard(Address::Socket(address)).0
    }

    fn recording(path: &Path) -> Address {
        Address::Recording {
            path: path.to_owned(),
            pace: Pace::Fast,
        }
    }

    fn of_recording(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f64>>, Result<(), String>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        std::fs::write(&path, bytes).unwrap();
        heard(recording(&path))
    }

    fn log(text: &str) -> Message {
        Message::Log {
            level: 0,
            text: text.into(),
        }
    }

    #[test]
    fn text_of_a_board_is_shown_and_never_obeyed() {
        let said = of_board(frames(&[
            Message::Hello(hello()),
            log("hapdef truth 1 2 3 4"),
            log("hapdef dead 0"),
            log("hapdef line 1,2,3,4"),
            Message::Note("truth 1 2 3 4".into()),
            log("a\u{1b}]0;title\u{7}\nhapdef: b"),
        ]));
        let expected = [
            "hello limb\u{fffd}[31m",
            "message hapdef truth 1 2 3 4",
            "message hapdef dead 0",
            "message hapdef line 1,2,3,4",
            "message a\u{fffd}]0;title\u{fffd} hapdef: b",
        ];
        assert_eq!(said, expected);
    }

    #[test]
    fn notes_of_a_recording_are_obeyed_the_old_ones_too() {
        let data = Message::Data(vec![2000; 4]);
        let old = [Message::Hello(hello()), log("hapdef truth none"), data];
        let (said, counts, ended) = of_recording(&frames(&old));
        assert_eq!(said[1..], ["truth None"]);
        assert_eq!((counts.len(), ended), (1, Ok(())));
        let new = [
            Message::Note("truth none".into()),
            log("hapdef truth none"),
            Message::Note("line 1,2,3,4".into()),
        ];
        let (said, counts, _) = of_recording(&frames(&new));
        assert_eq!(said, ["truth None", "message hapdef truth none"]);
        assert_eq!(counts, [[1.0, 2.0, 3.0, 4.0]]);
    }

    #[test]
    fn lines_with_many_channels_are_recorded_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        let long = |k: usize| (k as f64 - 31.5) * 1e14 / 3.0 + 1e-9;
        let sample = Sample {
            time_us: 5,
            counts: (0..MOST_CHANNELS).map(long).collect(),
        };
        let mut recorder = Recorder::create(&path).unwrap();
        recorder.sample(&sample);
        drop(recorder);
        assert_eq!(heard(recording(&path)).1, [sample.counts]);
        // One whose middle is lost is not taken for one of fewer channels.
        let torn = ["part 0 1,2", "line 4 5,6", "line 0 1,2,x", "part 9", "line"];
        let torn = torn.map(|text| Message::Note(text.into()));
        assert!(of_recording(&frames(&torn)).1.is_empty());
    }

    #[test]
    fn a_board_that_cannot_be_used_says_why_once() {
        let deaf = Message::Hello(Hello {
            gain_milli: 0,
            ..hello()
        });
        let data = Message::Data(vec![2000; 4]);
        let said = of_board(frames(&[
            deaf.clone(),
            data.clone(),
            deaf.clone(),
            data,
            deaf,
        ]));
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("trouble ") && said[0].contains("gain"));
    }

    #[test]
    fn a_recording_without_a_reading_says_so() {
        let other = Message::Hello(Hello {
            version: 2,
            ..hello()
        });
        let garbage = [&frames(&[log("ready"), other])[..], &vec![0x41; 40_000]].concat();
        let (_, _, ended) = of_recording(&garbage);
        let said = ended.unwrap_err();
        assert!(
            said.contains("no reading") && said.contains("version 2"),
            "{said}"
        );
    }
}
