//! Drives a test-bed: a printer and a board at their ports, or both simulated in their own time.

use std::time::{Duration, Instant};

use super::port::{Got, Port};
use super::{Address, Recorder};
use crate::bench::{Collector, CollectorNews, ContactLaw, Planned, RunEnd, SimulatedPrinter};
use crate::board::SimulatedBoard;
use crate::live::{Input, Receiver};
use crate::wire::{Hello, WireMessage, encode};

/// What whoever watches a bench may want.
#[derive(Clone, Debug, PartialEq)]
pub enum BenchOrder {
    /// Waits before the next press.
    Pause,
    /// Goes on.
    Resume,
    /// Stops at once and takes the tip back.
    Stop,
    /// Halts the machine where it is.
    Kill,
    /// Presses these too, each with its number; none: that was all.
    More(Vec<(usize, Planned)>),
    /// Takes the tip back and ends, for this reason: what comes next cannot be had.
    GiveUp(String),
}

/// How a run ends that somebody has stopped, and whose tip is back.
pub const BY_HAND: &str = "it was stopped by hand";
/// Simulated time between two looks (µs).
const TURN_US: u64 = 5000;
/// Samples a second that a board is asked for: readings are means over a sixth of a second.
const RATE_HZ: u16 = 200;

/// Understands the board and writes down what belongs to readings.
struct BenchWriter {
    receiver: Receiver,
    recorder: Recorder,
    hello: Option<Hello>,
    sequence: u16,
}

impl BenchWriter {
    fn new(recorder: Recorder) -> Self {
        Self {
            receiver: Receiver::default(),
            recorder,
            hello: None,
            sequence: 0,
        }
    }

    /// What a board is told at first.
    fn greeting(&mut self) -> Vec<u8> {
        let mut bytes = vec![0];
        for message in [
            WireMessage::AskHello,
            WireMessage::Rate(RATE_HZ),
            WireMessage::Start,
        ] {
            encode(&message, self.sequence, 0, 12, &mut bytes);
            self.sequence = self.sequence.wrapping_add(1);
        }
        bytes
    }

    /// Bytes of the board.
    fn board(
        &mut self,
        bytes: &[u8],
        now_us: u64,
        collector: &mut Collector,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        let mut inputs = Vec::new();
        self.receiver
            .push(bytes, now_us, |input| inputs.push(input));
        for input in inputs {
            match input {
                Input::Hello(hello) => {
                    if self.hello.as_ref() != Some(&hello) {
                        self.recorder.hello(&hello);
                        self.hello = Some(hello);
                    }
                }
                Input::Sample(sample) => {
                    let recorder = &mut self.recorder;
                    collector.felt(&sample.counts, now_us, out, &mut |news| {
                        if news == CollectorNews::Keep {
                            recorder.sample(&sample);
                        } else {
                            note(recorder, &news);
                            tell(news);
                        }
                    });
                }
                Input::Log { .. } | Input::Note { .. } | Input::Pong(_) => {}
            }
        }
        self.recorder
            .temperature(self.receiver.traffic.temperature());
    }

    /// What the collector says without a sample.
    fn hear(&mut self, news: CollectorNews, tell: &mut dyn FnMut(CollectorNews)) {
        note(&mut self.recorder, &news);
        tell(news);
    }

    fn end(mut self, ended: Option<RunEnd>) -> Result<RunEnd, String> {
        self.recorder.flush();
        match self.recorder.failed.take() {
            Some(why) => Err(why),
            None => Ok(ended.unwrap_or(RunEnd::Stopped("it was left".into()))),
        }
    }
}

/// Notes are lines of a recording.
fn note(recorder: &mut Recorder, news: &CollectorNews) {
    /// Characters that surely fit into a frame.
    const FITS: usize = 150;
    if let CollectorNews::Note(text) = news {
        recorder.own(&text.chars().take(FITS).collect::<String>());
        // A press that is written down is not lost, however the run ends.
        if text.starts_with("pressed") || text.starts_with("checked") {
            recorder.flush();
        }
    }
}

/// Presses a plan on a simulated bench, as fast as it can be computed. `orders` is asked for the next one at every look.
///
/// # Errors
/// When the recording can be written no more.
pub fn press_simulated(
    collector: &mut Collector,
    (mut printer, contact): (SimulatedPrinter, &ContactLaw),
    mut board: SimulatedBoard,
    recorder: Recorder,
    orders: &mut dyn FnMut() -> Option<BenchOrder>,
    mut tell: impl FnMut(CollectorNews),
) -> Result<RunEnd, String> {
    let mut desk = BenchWriter::new(recorder);
    let mut paused = false;
    let (mut now_us, mut said, mut sent) = (0, Vec::new(), Vec::new());
    board.receive(&desk.greeting(), now_us, &mut sent);
    while collector.ended().is_none() {
        let mut out = Vec::new();
        while let Some(order) = orders() {
            paused = match &order {
                BenchOrder::Pause => true,
                BenchOrder::Resume => false,
                BenchOrder::Stop
                | BenchOrder::Kill
                | BenchOrder::More(_)
                | BenchOrder::GiveUp(_) => paused,
            };
            obey(collector, order, now_us, &mut out);
        }
        if paused {
            // Its own time goes on, no faster than anybody's.
            std::thread::sleep(Duration::from_micros(TURN_US));
        }
        desk.board(&sent, now_us, collector, &mut out, &mut tell);
        let bytes = std::mem::take(&mut said);
        collector.receive(&bytes, now_us, &mut out, &mut |n| desk.hear(n, &mut tell));
        collector.look(now_us, &mut out, &mut |n| desk.hear(n, &mut tell));
        printer.receive(&out, &mut said);
        now_us += TURN_US;
        printer.say(now_us, &mut said);
        let real =
            |axis: &crate::bench::MachineAxis| printer.real(axis.letter).unwrap_or(axis.zero);
        board.press(contact.push(&contact.machine.pose_of(real)));
        sent.clear();
        if desk.hello.is_none() {
            board.receive(&desk.greeting(), now_us, &mut sent);
        }
        board.say(now_us, &mut sent, |_| {});
        if desk.recorder.failed.is_some() {
            collector.stop("the recording cannot be written", now_us, &mut Vec::new());
            break;
        }
    }
    desk.end(collector.ended().cloned())
}

/// Presses a plan with a printer and a board at their ports. `orders` is asked for the next one at every look.
///
/// # Errors
/// When a port cannot be opened, or the recording can be written no more.
pub fn press_at_ports(
    collector: &mut Collector,
    (printer, board): (&Address, &Address),
    recorder: Recorder,
    orders: &mut dyn FnMut() -> Option<BenchOrder>,
    mut tell: impl FnMut(CollectorNews),
) -> Result<RunEnd, String> {
    /// How long a machine that begins anew when its port is opened may take to do so.
    const BOOT: Duration = Duration::from_secs(2);
    let mut printer = printer.open()?;
    let mut board = board.open()?;
    let mut desk = BenchWriter::new(recorder);
    let mut buffer = [0_u8; 4096];
    let begun = Instant::now();
    let now = || begun.elapsed().as_micros() as u64;
    while begun.elapsed() < BOOT {
        let _ = printer.read(&mut buffer);
    }
    board.write(&desk.greeting());
    let mut asked = now();
    while collector.ended().is_none() {
        let mut out = Vec::new();
        while let Some(order) = orders() {
            obey(collector, order, now(), &mut out);
        }
        let bytes = got(&mut *board, &mut buffer);
        let bytes = bytes.unwrap_or_default();
        desk.board(&bytes, now(), collector, &mut out, &mut tell);
        if desk.hello.is_none() && !desk.receiver.speaks_lines() && now() - asked > 500_000 {
            asked = now();
            board.write(&desk.greeting());
        }
        // What must be said at once is not kept back by what is waited for.
        printer.write(&std::mem::take(&mut out));
        match got(&mut *printer, &mut buffer) {
            Some(bytes) => {
                collector.receive(&bytes, now(), &mut out, &mut |n| desk.hear(n, &mut tell));
            }
            None => collector.unplugged(),
        }
        collector.look(now(), &mut out, &mut |n| desk.hear(n, &mut tell));
        printer.write(&out);
        if desk.recorder.failed.is_some() {
            let mut out = Vec::new();
            collector.stop("the recording cannot be written", now(), &mut out);
            printer.write(&out);
        }
    }
    desk.end(collector.ended().cloned())
}

fn obey(collector: &mut Collector, order: BenchOrder, now_us: u64, out: &mut Vec<u8>) {
    match order {
        BenchOrder::Pause => collector.pause(true),
        BenchOrder::Resume => collector.pause(false),
        BenchOrder::Stop => collector.stop(BY_HAND, now_us, out),
        BenchOrder::Kill => collector.kill(out),
        BenchOrder::More(presses) => collector.go_on(presses),
        BenchOrder::GiveUp(why) => collector.stop(&why, now_us, out),
    }
}

/// What came; nothing where the other side is gone.
fn got(port: &mut dyn Port, buffer: &mut [u8]) -> Option<Vec<u8>> {
    match port.read(buffer) {
        Got::Bytes(count) => Some(buffer[..count].to_vec()),
        Got::Nothing => Some(Vec::new()),
        Got::Gone => None,
    }
}
