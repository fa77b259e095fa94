//! The thread that listens: opens, asks, reads, understands, records, and finds the board again.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver as Inbox, Sender, channel};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{Address, Got, Port, Recorder, note, ports};
use crate::live::{Input, Pipeline, Receiver, Rest, Sample, Traffic, Update};
use crate::wire::{Hello, Message, encode};

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
    /// What the board says, or what happened to a recording.
    Message(&'a str),
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
    /// A rest that a recording brings.
    rest: Rest,
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
            rest: Rest::default(),
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

    /// Listens until it is told to stop, or a recording ends. Unplugged boards are waited for.
    ///
    /// # Errors
    /// When the port cannot be opened at first.
    pub fn run(
        mut self,
        stop: &AtomicBool,
        inbox: &Inbox<Command>,
        mut tell: impl FnMut(Heard),
    ) -> Result<(), String> {
        let mut port = self.address.open()?;
        loop {
            self.enter(State::Waiting, &mut tell);
            self.listen(&mut *port, stop, inbox, &mut tell);
            if let Some(recorder) = &mut self.recorder {
                recorder.flush();
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if self.address.is_recording() {
                self.enter(State::Ended, &mut tell);
                return Ok(());
            }
            self.enter(State::Gone, &mut tell);
            match self.find_again(stop, inbox, &mut tell) {
                Some(again) => port = again,
                None => return Ok(()),
            }
        }
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
        let mut buffer = vec![0; 16 * 1024];
        let mut inputs = Vec::new();
        let (mut asked, mut heard) = (None::<Instant>, Instant::now());
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
                Got::Nothing if live && heard.elapsed() > SILENCE => {
                    self.enter(State::Silent, tell);
                }
                Got::Nothing => {}
                Got::Bytes(count) => {
                    let arrived = Instant::now();
                    let now_us = self.begun.elapsed().as_micros() as u64;
                    self.receiver
                        .push(&buffer[..count], now_us, |input| inputs.push(input));
                    for input in inputs.drain(..) {
                        if matches!(input, Input::Sample(_)) {
                            heard = arrived;
                        }
                        self.take(input, arrived, port, tell);
                    }
                }
            }
            let (traffic, recorder) = (self.receiver.traffic, self.recorder.as_ref());
            tell(Heard::Turn {
                traffic,
                timing: &self.timing,
                pipeline: &self.pipeline,
                recorder,
            });
        }
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
                Err(message) => tell(Heard::Message(&message)),
            },
            Command::StopRecording => self.recorder = None,
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
            } => match note(level, &text) {
                Some(own) => self.replay(own, time_us, arrived, tell),
                None => tell(Heard::Message(&text)),
            },
            Input::Pong(_) => {}
        }
    }

    fn greet(&mut self, hello: Hello, port: &mut dyn Port, tell: &mut impl FnMut(Heard)) {
        self.pipeline.hello(&hello);
        self.record(|r| r.hello(&hello));
        tell(Heard::Hello(&hello));
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
        if let Some(message) = self.recorder.as_mut().and_then(|r| r.failed.take()) {
            self.recorder = None;
            tell(Heard::Message(&message));
        }
        tell(Heard::Sample {
            sample,
            update: &update,
            pipeline: &self.pipeline,
        });
    }

    /// What the studio did when this was recorded.
    fn replay(&mut self, own: &str, time_us: u64, arrived: Instant, tell: &mut impl FnMut(Heard)) {
        let words: Vec<&str> = own.split_whitespace().collect();
        let number = |text: &str| text.parse::<f64>().ok().filter(|v| v.is_finite());
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
            ["line", values] => {
                let counts: Option<Vec<f64>> = values.split(',').map(number).collect();
                if let Some(counts) = counts {
                    self.measure(&Sample { time_us, counts }, arrived, tell);
                }
            }
            _ => {}
        }
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
