//! A simulated board that is recorded instead of listened to: in its own time, as fast as it can be computed.

use super::truths::Truths;
use super::{Recorder, replay};
use crate::board::{SimulatedBoard, Truth};
use crate::live::{Input, Receiver, Sample};
use crate::wire::{WireMessage, encode};
use crate::{memory, plain};

/// The board's time between two looks at it (µs), about as often as a port is looked at.
const TURN_US: u64 = 4000;

/// Refuses a recording that could not be read again: of so many seconds, from a board of this rate, with so many
/// channels of so many bits.
///
/// # Errors
/// A message that says how large it would become, and what to change.
pub fn check_length(seconds: f64, rate_hz: u16, channels: usize, bits: u8) -> Result<(), String> {
    let mut sample = Vec::new();
    encode(
        &WireMessage::Data(vec![0; channels]),
        0,
        0,
        bits,
        &mut sample,
    );
    let bytes = seconds * f64::from(rate_hz) * sample.len() as f64;
    let most = replay::most_bytes();
    if bytes <= most {
        return Ok(());
    }
    Err(format!(
        "{seconds} s at {rate_hz} Hz would be a recording of {}, and at most {} are read again with {} of memory. Lower --seconds or --rate, or allow more with --memory-gb",
        plain::needed(bytes),
        plain::allowed(most),
        plain::allowed(memory::allowed())
    ))
}

/// Writes into a recording what a simulated board sends in so many seconds of its own time, and where it is really
/// touched. `tell` hears what really happened at every sample. How many samples there are.
///
/// # Errors
/// When the recording can be written no more.
pub fn record(
    mut board: SimulatedBoard,
    recorder: Recorder,
    seconds: f64,
    mut tell: impl FnMut(Truth),
) -> Result<u64, String> {
    let end_us = (seconds * 1e6) as u64;
    let mut scribe = RecordScribe::new(recorder);
    let (mut now_us, mut plugged) = (0, false);
    while now_us <= end_us {
        if board.is_unplugged(now_us) {
            plugged = false;
        } else {
            let mut bytes = Vec::new();
            if !plugged {
                plugged = true;
                scribe.lose();
                board.restart(now_us);
            }
            // Asked again where the answer was spoilt on the way.
            if !scribe.greeted {
                board.receive(&greeting(), now_us, &mut bytes);
            }
            board.say(now_us, &mut bytes, |truth| {
                tell(truth);
                scribe.truths.push(truth);
            });
            scribe.take(&bytes, now_us);
        }
        if let Some(why) = scribe.recorder.failed.take() {
            return Err(why);
        }
        now_us += TURN_US;
    }
    scribe.end()
}

/// What one who listens says first.
fn greeting() -> Vec<u8> {
    let mut bytes = Vec::new();
    for (sequence, message) in (0..).zip([WireMessage::AskHello, WireMessage::Start]) {
        encode(&message, sequence, 0, 12, &mut bytes);
    }
    bytes
}

/// Understands the board's bytes as one who listens does, and writes them down.
struct RecordScribe {
    recorder: Recorder,
    receiver: Receiver,
    /// Whether the board has said what it is, without which nothing else is understood.
    greeted: bool,
    truths: Truths,
}

impl RecordScribe {
    fn new(recorder: Recorder) -> Self {
        Self {
            recorder,
            receiver: Receiver::default(),
            greeted: false,
            truths: Truths::default(),
        }
    }

    /// The plug was out.
    fn lose(&mut self) {
        self.receiver.reset();
        self.greeted = false;
    }

    fn take(&mut self, bytes: &[u8], now_us: u64) {
        let mut inputs = Vec::new();
        self.receiver
            .push(bytes, now_us, |input| inputs.push(input));
        for input in inputs {
            match input {
                Input::Hello(hello) => {
                    self.greeted = true;
                    self.recorder.hello(&hello);
                }
                Input::Sample(sample) => self.sample(&sample),
                Input::Log { .. } | Input::Note { .. } | Input::Pong(_) => {}
            }
        }
        self.recorder
            .temperature(self.receiver.traffic.temperature());
    }

    /// A sample behind what was true when it was taken.
    fn sample(&mut self, sample: &Sample) {
        if let Some(truth) = self.truths.at(sample.time_us) {
            self.recorder.truth(truth.place());
        }
        self.recorder.sample(sample);
    }

    fn end(mut self) -> Result<u64, String> {
        self.recorder.flush();
        match self.recorder.failed.take() {
            Some(why) => Err(why),
            None => Ok(self.recorder.samples),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::inference::Chain;
    use crate::wire::Hello;

    fn scribe(path: &Path) -> RecordScribe {
        let mut scribe = RecordScribe::new(Recorder::create(path).unwrap());
        let chain = Chain::default();
        scribe.recorder.hello(&Hello {
            version: crate::wire::VERSION,
            board: 1,
            channels: 2,
            bits: chain.bits,
            reference_mv: 3300,
            supply_mv: 3300,
            gain_milli: 100_000,
            rate_hz: 1000,
            name: "Board".into(),
        });
        scribe
    }

    fn truth(time_us: u64, force: Option<f64>) -> Truth {
        let touch = force.map(|force| crate::elasticity::Touch {
            position: glam::DVec3::X * 1e-3,
            normal: glam::DVec3::Z,
            force,
            tip_radius: 5e-3,
        });
        let pushes: Vec<_> = touch.iter().map(Into::into).collect();
        Truth::of(time_us, &pushes)
    }

    /// The truth stands before the first sample that it holds for, and once.
    #[test]
    fn the_truth_goes_with_the_samples() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("board.hapdrec");
        let mut scribe = scribe(&path);
        for (k, force) in [None, None, Some(5.0), Some(5.0), None].iter().enumerate() {
            scribe.truths.push(truth(1000 * k as u64, *force));
        }
        // The fourth is lost on the way, and the last comes twice.
        for k in [0, 1, 2, 4, 4] {
            scribe.sample(&Sample {
                time_us: 1000 * k,
                counts: vec![7.0, 9.0],
            });
        }
        assert_eq!(scribe.end(), Ok(5));
        let mut said = Vec::new();
        let mut receiver = Receiver::default();
        receiver.push(&std::fs::read(&path).unwrap(), 0, |input| match input {
            Input::Note { text, .. } => said.push(text),
            Input::Sample(sample) => said.push(sample.time_us.to_string()),
            _ => {}
        });
        let expected = [
            "truth none",
            "0",
            "1000",
            "truth 1.0000 0.0000 0.0000 5.00000",
            "2000",
            "truth none",
            "4000",
            "4000",
        ];
        assert_eq!(said, expected);
    }
}
