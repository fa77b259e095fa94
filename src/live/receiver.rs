//! Bytes in, samples out, whatever the board speaks.

use crate::wire::{Decoded, Decoder, Hello, LineReader, Refusal, TextLine, Timeline, WireMessage};

/// What was understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// What board it is.
    Hello(Hello),
    /// One sample of raw counts.
    Sample(Sample),
    /// Something that the board says.
    Log {
        /// 0 debug, 1 information, 2 warning, 3 error.
        level: u8,
        /// Its words, as they came.
        text: String,
        /// The board's clock (µs).
        time_us: u64,
    },
    /// Only a recording may say this: what was done while it was made.
    Note {
        /// Its words, as they were recorded.
        text: String,
        /// The board's clock (µs).
        time_us: u64,
    },
    /// The answer to the ping of this number.
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
    /// Bytes received.
    pub bytes: u64,
    /// Samples understood.
    pub samples: u64,
    /// Known to be missing from the sequence.
    pub lost: u64,
    /// Damaged, repeated, or not understood.
    pub refused: u64,
    /// That the board itself could not send.
    pub overruns: u32,
    /// What the board said last of its temperature (hundredths of a degree Celsius).
    pub temperature_centi: Option<i16>,
}

impl Traffic {
    /// What the board said last of its temperature (°C).
    #[must_use]
    pub fn temperature(&self) -> Option<f64> {
        self.temperature_centi.map(|centi| f64::from(centi) / 100.0)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Speech {
    #[default]
    Unknown,
    Frames,
    Lines,
}

/// Why nothing that comes can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// Frames that are refused.
    Refused(Refusal),
    /// Rows of numbers with commas that may be decimal ones.
    Commas,
    /// Rows of numbers that are as numbers with decimal commas would be, but may be counts.
    Fractions,
    /// Rows of numbers in which this one, from 1, is none.
    NoNumber(usize),
    /// Bytes that are neither frames nor rows of numbers.
    Neither,
    /// Frames, but no data among them.
    NoData,
    /// Bytes that are no frames, where frames came before.
    Changed,
}

impl Unusable {
    /// Whether waiting will not help.
    #[must_use]
    pub fn is_lasting(self) -> bool {
        match self {
            Self::Refused(why) => why.is_lasting(),
            Self::Commas | Self::NoNumber(_) => true,
            Self::Fractions | Self::Neither | Self::NoData | Self::Changed => false,
        }
    }

    /// For people, with what to do.
    #[must_use]
    pub fn in_words(self) -> Option<String> {
        let words = match self {
            Self::Refused(why) => return why.in_words(),
            Self::Commas => {
                "the board prints lines such as “1,5;2,5” or “1,05,2,50”, whose commas may be decimal ones: what is a number cannot be told. Print decimal points, or whole numbers with one sign alone between them"
            }
            Self::Fractions => {
                "every second number in the board's lines has as many digits, and more than those between: if commas are decimal ones, as in “1,25,1,50”, each number is taken for two. Print decimal points, or whole numbers"
            }
            Self::NoNumber(place) => {
                return Some(format!(
                    "the board prints lines whose number {place} is none (nan, inf or beyond 1e15): these lines are left out. See what ails that sensor, or print a count at the end of its range in its place: only its gauge is left out then"
                ));
            }
            Self::Neither => {
                "bytes come, but neither frames of the protocol nor lines of numbers: check the baud rate, and what the board prints"
            }
            Self::NoData => {
                "the board answers, but sends no readings: check what its firmware does after START"
            }
            Self::Changed => {
                "bytes still come, but no frames of the protocol any more: the board may have been restarted with another program, or at another baud rate. Connect again to take what it prints now"
            }
        };
        Some(words.to_owned())
    }
}

/// Rows of numbers in a row that make a board one of plain lines.
const ROWS: usize = 4;
/// Bytes without a frame among them that are no longer half a frame, or one that was damaged.
const UNREAD: u64 = 256;
/// Frames in a row, with a right sum and no row of numbers between them, that make it one of frames after all.
const FRAMES: usize = 3;

/// Finds out by itself whether frames or plain lines come. A board may print numbers while it starts: frames are
/// looked for even then.
#[derive(Default)]
pub struct Receiver {
    frames: Decoder,
    events: Vec<Decoded>,
    lines: LineReader,
    speech: Speech,
    rows: usize,
    /// Frames with a right sum since the last row of numbers.
    sound: usize,
    /// Bytes since the last frame with a right sum.
    unread: u64,
    time: Timeline,
    /// Why what came since the last sample was not used.
    doubt: Option<Unusable>,
    /// What came through so far.
    pub traffic: Traffic,
    /// What had come when the line was cut last.
    before: Traffic,
}

impl Receiver {
    /// Takes in bytes that arrived at `now_us` on the studio's clock.
    pub fn push(&mut self, bytes: &[u8], now_us: u64, mut tell: impl FnMut(Input)) {
        self.traffic.bytes += bytes.len() as u64;
        self.unread += bytes.len() as u64;
        let mut events = std::mem::take(&mut self.events);
        self.frames.push(bytes, |event| events.push(event));
        for event in events.drain(..) {
            self.take_event(event, &mut tell);
        }
        self.events = events;
        if self.speech != Speech::Frames {
            self.push_lines(bytes, now_us, tell);
        }
    }

    fn push_lines(&mut self, bytes: &[u8], now_us: u64, mut tell: impl FnMut(Input)) {
        let Self {
            lines,
            rows,
            sound,
            speech,
            traffic,
            doubt,
            ..
        } = self;
        lines.push(bytes, |reading| match reading {
            TextLine::Values(counts) => {
                (*rows, *sound) = (*rows + 1, 0);
                if *rows >= ROWS {
                    (*speech, *doubt) = (Speech::Lines, None);
                    traffic.samples += 1;
                    tell(Input::Sample(Sample {
                        time_us: now_us,
                        counts,
                    }));
                }
            }
            TextLine::Unclear => {
                (*rows, *doubt) = (0, Some(Unusable::Commas));
                traffic.refused += 1;
            }
            TextLine::NoNumber(place) => {
                *doubt = Some(Unusable::NoNumber(place));
                traffic.refused += 1;
            }
            TextLine::Other if *speech == Speech::Lines => traffic.refused += 1,
            TextLine::Other => *rows = 0,
        });
    }

    fn take_event(&mut self, event: Decoded, tell: &mut impl FnMut(Input)) {
        match event {
            Decoded::Lost(count) => self.traffic.lost += u64::from(count),
            Decoded::Refused(why) => self.refuse(why),
            Decoded::Message {
                time_us, message, ..
            } => self.take_message(time_us, message, tell),
        }
    }

    fn refuse(&mut self, why: Refusal) {
        if why.in_words().is_some() {
            self.believe_frames(matches!(why, Refusal::Version(_) | Refusal::Value { .. }));
        }
        // Before anything was understood it may well be lines.
        if self.speech != Speech::Frames {
            return;
        }
        self.traffic.refused += 1;
        if why.is_lasting() || (why == Refusal::NoLayout && self.doubt.is_none()) {
            self.doubt = Some(Unusable::Refused(why));
        }
    }

    fn take_message(&mut self, time_us: u32, message: WireMessage, tell: &mut impl FnMut(Input)) {
        if message.is_of_studio() {
            // An echo of our own, which lines may well have too.
            return;
        }
        let first = self.speech == Speech::Unknown;
        self.believe_frames(first || matches!(message, WireMessage::Hello(_)));
        if self.speech != Speech::Frames {
            return;
        }
        match message {
            WireMessage::Hello(hello) => tell(Input::Hello(hello)),
            WireMessage::Data(counts) => {
                self.traffic.samples += 1;
                self.doubt = None;
                let counts = counts.into_iter().map(f64::from).collect();
                tell(Input::Sample(Sample {
                    time_us: self.time.extend(time_us),
                    counts,
                }));
            }
            WireMessage::Status {
                overruns,
                temperature_centi,
            } => {
                self.traffic.overruns = overruns;
                self.traffic.temperature_centi = temperature_centi;
            }
            WireMessage::Log { level, text } => tell(Input::Log {
                level,
                text,
                time_us: self.time.extend(time_us),
            }),
            WireMessage::Note(text) => tell(Input::Note {
                text,
                time_us: self.time.extend(time_us),
            }),
            WireMessage::Pong(token) => tell(Input::Pong(token)),
            _ => {}
        }
    }

    /// A frame had a right sum: after some of them, or at once after one that cannot be chance, the board is one
    /// of frames.
    fn believe_frames(&mut self, surely: bool) {
        (self.sound, self.unread) = (self.sound + 1, 0);
        if surely || self.sound >= FRAMES {
            self.speech = Speech::Frames;
        }
    }

    /// Whether plain lines come, which cannot be asked anything.
    #[must_use]
    pub fn speaks_lines(&self) -> bool {
        self.speech == Speech::Lines
    }

    /// Whether its lines are as numbers with decimal commas would be.
    #[must_use]
    pub fn may_have_decimal_commas(&self) -> bool {
        self.speaks_lines() && self.lines.may_have_decimal_commas()
    }

    /// Why nothing that came since the last sample can be used, as far as that is known.
    #[must_use]
    pub fn unusable(&self) -> Option<Unusable> {
        let silent = self.traffic.samples == self.before.samples;
        let guess = match self.speech {
            Speech::Unknown if self.rows == 0 && self.traffic.bytes > self.before.bytes => {
                Some(Unusable::Neither)
            }
            Speech::Frames => Some(Unusable::NoData),
            _ => None,
        };
        let changed = self.speech == Speech::Frames && !silent && self.unread > UNREAD;
        let changed = changed.then_some(Unusable::Changed);
        self.doubt.or(guess.filter(|_| silent)).or(changed)
    }

    /// The line was cut; the counters go on.
    pub fn reset(&mut self) {
        *self = Self {
            traffic: self.traffic,
            before: self.traffic,
            ..Self::default()
        };
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
    fn lines_with_a_number_that_is_none_are_told_of_and_the_others_go_on() {
        let mut receiver = Receiver::default();
        let mut samples = 0;
        let rows = "1,2\n".repeat(8) + &"1,nan\n".repeat(3);
        receiver.push(rows.as_bytes(), 0, |_| samples += 1);
        assert_eq!((samples, receiver.traffic.refused), (5, 3));
        let words = receiver.unusable().and_then(Unusable::in_words).unwrap();
        assert!(words.contains("number 2 is none"), "{words}");
        assert!(receiver.unusable().is_some_and(Unusable::is_lasting));
        receiver.push(b"1,2\n", 0, |_| samples += 1);
        assert_eq!((samples, receiver.unusable()), (6, None));
    }

    fn hello() -> Hello {
        Hello {
            version: 1,
            board: 7,
            channels: 2,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 5000,
            gain_milli: 330_000,
            rate_hz: 1000,
            name: "limb".into(),
        }
    }

    fn greeting(hello: Hello) -> Vec<u8> {
        let mut bytes = vec![0];
        encode(&WireMessage::Hello(hello), 0, 0, 12, &mut bytes);
        bytes
    }

    fn data(from: u16, to: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        for k in from..to {
            let counts = vec![100 + u32::from(k % 9), 200];
            encode(
                &WireMessage::Data(counts),
                k,
                1000 * u32::from(k),
                12,
                &mut bytes,
            );
        }
        bytes
    }

    /// A board that prints numbers while it starts is one of frames all the same.
    #[test]
    fn frames_are_heard_behind_numeric_lines() {
        let boot = b"1,2,3\n2,3,4\n3,4,5\n4,5,6\n5,6,7\n6,7,8\n";
        // It sends no zero before its first frame.
        let greeted = &greeting(hello())[1..];
        let (all, _) = inputs(&[&boot[..], greeted, &data(1, 5000)].concat());
        let pairs = |i: &&Input| matches!(i, Input::Sample(s) if s.counts.len() == 2);
        assert_eq!(all.iter().filter(pairs).count(), 4999);
        // Where its HELLO was said before anybody listened, it is soon known that one must be asked for.
        let mut receiver = Receiver::default();
        receiver.push(boot, 0, |_| {});
        assert!(receiver.speaks_lines());
        receiver.push(&data(1, 9), 0, |_| {});
        assert!(!receiver.speaks_lines());
        assert_eq!(
            receiver.unusable(),
            Some(Unusable::Refused(Refusal::NoLayout))
        );
    }

    #[test]
    fn an_echo_of_the_studio_does_not_hide_lines() {
        let mut bytes = vec![0];
        encode(&WireMessage::AskHello, 0, 0, 12, &mut bytes);
        bytes.extend(b"\n1 2\n2 3\n3 4\n4 5\n5 6\n");
        assert_eq!(inputs(&bytes).1.samples, 2);
    }

    #[test]
    fn what_cannot_be_used_says_why() {
        let doubt = |bytes: &[u8]| {
            let mut receiver = Receiver::default();
            receiver.push(bytes, 0, |_| {});
            receiver.unusable()
        };
        let refused = |doubt: Option<Unusable>| match doubt {
            Some(Unusable::Refused(why)) => why.in_words().unwrap(),
            other => panic!("{other:?}"),
        };
        let other = greeting(Hello {
            version: 3,
            ..hello()
        });
        // What comes behind it takes nothing from the reason.
        let said = refused(doubt(&[&other[..], &data(1, 9)].concat()));
        assert!(said.contains("version 3"), "{said}");
        let deaf = greeting(Hello {
            gain_milli: 0,
            ..hello()
        });
        let said = refused(doubt(&[&deaf[..], &data(1, 9)].concat()));
        assert!(said.contains("gain must be above zero"), "{said}");
        let wide = greeting(Hello {
            channels: 3,
            ..hello()
        });
        let said = refused(doubt(&[&wide[..], &data(1, 9)].concat()));
        assert!(
            said.contains("3 bytes") && said.contains("take 5"),
            "{said}"
        );
        assert_eq!(doubt(b"1,5;2,5\n1,6;2,4\n"), Some(Unusable::Commas));
        assert_eq!(doubt(b"\x81\xf3\x17 ready\n"), Some(Unusable::Neither));
        assert_eq!(doubt(&greeting(hello())), Some(Unusable::NoData));
        assert_eq!(doubt(&[&greeting(hello())[..], &data(1, 9)].concat()), None);
        let framed = [&greeting(hello())[..], &data(1, 9)].concat();
        let mut receiver = Receiver::default();
        for (bytes, doubt) in [
            (framed, None),
            (b"2011,1987,2004\n".repeat(20), Some(Unusable::Changed)),
            (data(9, 12), None),
        ] {
            receiver.push(&bytes, 0, |_| {});
            assert_eq!(receiver.unusable(), doubt);
        }
        assert_eq!(doubt(b"1,2\n"), None);
        assert_eq!(doubt(b""), None);
    }

    #[test]
    fn frames_are_found_behind_anything_and_lines_in_them_are_none() {
        let named = Hello {
            name: "1,2\n1,2\n1,2\n1,2\n1,2\n".into(),
            ..hello()
        };
        let mut bytes = [&b"garbage\n"[..], &greeting(named), &data(1, 6)].concat();
        // The last one is damaged.
        let at = bytes.len() - 12;
        bytes[at] ^= 0x10;
        let (all, traffic) = inputs(&bytes);
        assert_eq!(traffic.samples, 4);
        assert_eq!((traffic.refused, traffic.lost), (1, 0));
        assert!(matches!(all[0], Input::Hello(_)) && all.len() == 5);
    }
}
