//! Bytes in, samples out, whatever the board speaks.

use crate::wire::{Decoder, Event, Hello, LineReader, Message, Reading, Timeline};

/// What was understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    Hello(Hello),
    Sample(Sample),
    Log {
        level: u8,
        text: String,
        time_us: u64,
    },
    Pong(u32),
}

/// One reading of all channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The board's clock, or the studio's where the board has none (µs).
    pub time_us: u64,
    /// Raw, a value a channel.
    pub counts: Vec<f64>,
}

/// What came through so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    pub bytes: u64,
    pub samples: u64,
    /// Known to be missing from the sequence.
    pub lost: u64,
    /// Damaged, repeated, or not understood.
    pub refused: u64,
    /// That the board itself could not send.
    pub overruns: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Speech {
    #[default]
    Unknown,
    Frames,
    Lines,
}

/// Rows of numbers in a row that make a board one of plain lines.
const ROWS: usize = 4;

/// Finds out by itself whether frames or plain lines come.
#[derive(Default)]
pub struct Receiver {
    frames: Decoder,
    lines: LineReader,
    speech: Speech,
    rows: usize,
    time: Timeline,
    pub traffic: Traffic,
}

impl Receiver {
    /// Takes in bytes that arrived at `now_us` on the studio's clock.
    pub fn push(&mut self, bytes: &[u8], now_us: u64, mut tell: impl FnMut(Input)) {
        self.traffic.bytes += bytes.len() as u64;
        if self.speech != Speech::Lines {
            let Self {
                frames,
                time,
                traffic,
                speech,
                ..
            } = self;
            frames.push(bytes, |event| {
                take_event(event, time, traffic, speech, &mut tell);
            });
        }
        if self.speech != Speech::Frames {
            self.push_lines(bytes, now_us, tell);
        }
    }

    fn push_lines(&mut self, bytes: &[u8], now_us: u64, mut tell: impl FnMut(Input)) {
        let Self {
            lines,
            rows,
            speech,
            traffic,
            ..
        } = self;
        lines.push(bytes, |reading| match reading {
            Reading::Values(counts) => {
                *rows += 1;
                if *rows >= ROWS {
                    *speech = Speech::Lines;
                    traffic.samples += 1;
                    tell(Input::Sample(Sample {
                        time_us: now_us,
                        counts,
                    }));
                }
            }
            Reading::Other if *speech == Speech::Lines => traffic.refused += 1,
            Reading::Other => *rows = 0,
        });
    }

    /// Whether plain lines come, which cannot be asked anything.
    #[must_use]
    pub fn speaks_lines(&self) -> bool {
        self.speech == Speech::Lines
    }

    /// The line was cut; the counters go on.
    pub fn reset(&mut self) {
        *self = Self {
            traffic: self.traffic,
            ..Self::default()
        };
    }
}

fn take_event(
    event: Event,
    time: &mut Timeline,
    traffic: &mut Traffic,
    speech: &mut Speech,
    tell: &mut impl FnMut(Input),
) {
    match event {
        Event::Lost(count) => traffic.lost += u64::from(count),
        // Before anything was understood it may well be lines.
        Event::Refused(_) if *speech == Speech::Unknown => {}
        Event::Refused(_) => traffic.refused += 1,
        Event::Message {
            time_us, message, ..
        } => {
            *speech = Speech::Frames;
            match message {
                Message::Hello(hello) => tell(Input::Hello(hello)),
                Message::Data(counts) => {
                    traffic.samples += 1;
                    let counts = counts.into_iter().map(f64::from).collect();
                    tell(Input::Sample(Sample {
                        time_us: time.extend(time_us),
                        counts,
                    }));
                }
                Message::Status { overruns, .. } => traffic.overruns = overruns,
                Message::Log { level, text } => tell(Input::Log {
                    level,
                    text,
                    time_us: time.extend(time_us),
                }),
                Message::Pong(token) => tell(Input::Pong(token)),
                // What a studio says; an echo of our own.
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::encode;

    fn inputs(bytes: &[u8]) -> (Vec<Input>, Traffic) {
        let mut receiver = Receiver::default();
        let mut all = Vec::new();
        for piece in bytes.chunks(7) {
            receiver.push(piece, 5, |i| all.push(i));
        }
        (all, receiver.traffic)
    }

    #[test]
    fn lines_are_found_by_themselves() {
        let row = |text: String, k: u32| text + &format!("{k},{},{}\r\n", 2 * k, 3 * k);
        let text = (0..10).fold(String::new(), row);
        let (all, traffic) = inputs(format!("booting\nok\n{text}").as_bytes());
        assert_eq!(traffic.samples, 7);
        let first = Sample {
            time_us: 5,
            counts: vec![3.0, 6.0, 9.0],
        };
        assert_eq!(all[0], Input::Sample(first));
    }

    #[test]
    fn frames_are_found_behind_anything_and_lines_in_them_are_none() {
        let hello = Hello {
            version: 1,
            board: 7,
            channels: 2,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 5000,
            gain_milli: 330_000,
            rate_hz: 1000,
            name: "1,2\n1,2\n1,2\n1,2\n1,2\n".into(),
        };
        let mut bytes = b"garbage\n\0".to_vec();
        encode(&Message::Hello(hello), 0, 0, 12, &mut bytes);
        for k in 0..5_u32 {
            let counts = vec![100 + k, 200];
            encode(
                &Message::Data(counts),
                k as u16 + 1,
                1000 * k,
                12,
                &mut bytes,
            );
        }
        // The fourth is damaged.
        let at = bytes.len() - 12;
        bytes[at] ^= 0x10;
        let (all, traffic) = inputs(&bytes);
        assert_eq!(traffic.samples, 4);
        assert_eq!((traffic.refused, traffic.lost), (1, 0));
        assert!(matches!(all[0], Input::Hello(_)) && all.len() == 5);
    }
}
