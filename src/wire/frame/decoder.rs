//! Frames found in bytes, in whatever pieces these come.

use super::message::WireMessage;
use super::refusal::Refusal;
use super::{HEAD, LONGEST, SUM, TAIL, payload};

/// So many frames in a row that seem to come from the past are a board that has begun anew.
const BEGUN_ANEW: u32 = 16;

/// What the decoder makes of bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decoded {
    /// A message, sound and of a known kind.
    Message {
        /// Number of its frame, modulo 65536.
        sequence: u16,
        /// The board's clock; see [`crate::wire::Timeline`].
        time_us: u32,
        /// What it says.
        message: WireMessage,
    },
    /// So many frames are missing before the next one.
    Lost(u16),
    /// Bytes that were no message.
    Refused(Refusal),
}

/// Takes bytes in as they come, in whatever pieces.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    frame: Vec<u8>,
    /// What comes until the next zero or line feed is too long for any frame.
    overlong: bool,
    /// Channels and bits of a sample, once the board has said them.
    layout: Option<(usize, u8)>,
    last: Option<u16>,
    late: u32,
}

impl Decoder {
    /// Takes in bytes and tells what they are. Whatever they are, no more than one frame is held.
    pub fn push(&mut self, bytes: &[u8], mut tell: impl FnMut(Decoded)) {
        for &byte in bytes {
            if byte != 0 {
                self.keep(byte);
                continue;
            }
            if self.overlong {
                tell(Decoded::Refused(Refusal::Framing));
            } else if !self.frame.is_empty() {
                self.end_of_frame(&mut tell);
            }
            self.frame.clear();
            self.overlong = false;
        }
    }

    fn keep(&mut self, byte: u8) {
        if self.overlong {
            // A line that was longer than any frame ends here, and a frame may begin.
            self.overlong = byte != b'\n';
            return;
        }
        self.frame.push(byte);
        if self.frame.len() > LONGEST + 1 {
            self.make_room();
        }
    }

    /// The line was cut: what follows has nothing to do with what was before.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Longer than any frame, unless the line that was printed before it goes.
    fn make_room(&mut self) {
        let line = self.frame.iter().position(|&b| b == b'\n');
        self.frame
            .drain(..line.map_or(self.frame.len(), |at| at + 1));
        self.overlong = line.is_none();
    }

    fn end_of_frame(&mut self, tell: &mut impl FnMut(Decoded)) {
        match self.read_behind_text() {
            Ok((sequence, time_us, message)) => {
                if let Some(refused) = self.follow(sequence, &message, tell) {
                    return tell(Decoded::Refused(refused));
                }
                tell(Decoded::Message {
                    sequence,
                    time_us,
                    message,
                });
            }
            Err(refusal) => tell(Decoded::Refused(refusal)),
        }
    }

    /// What lies between two zeros. A board that has just printed lines sends no zero before its first frame, which
    /// then begins behind one of the line feeds.
    fn read_behind_text(&mut self) -> Result<(u16, u32, WireMessage), Refusal> {
        let starts = starts_behind_lines(&self.frame);
        if starts.is_empty() {
            return self.read();
        }
        let whole = self.frame.clone();
        let mut found = self.read();
        for start in starts {
            if !matches!(found, Err(Refusal::Framing | Refusal::Damaged)) {
                break;
            }
            self.frame.clear();
            self.frame.extend_from_slice(&whole[start..]);
            found = self.read();
        }
        found
    }

    fn read(&mut self) -> Result<(u16, u32, WireMessage), Refusal> {
        let length = cobs::decode_in_place(&mut self.frame).map_err(|_| Refusal::Framing)?;
        let frame = &self.frame[..length];
        let body = length.checked_sub(TAIL).filter(|&b| b >= HEAD);
        let body = body.ok_or(Refusal::Framing)?;
        let (body, sum) = frame.split_at(body);
        if SUM.checksum(body).to_le_bytes() != sum {
            return Err(Refusal::Damaged);
        }
        let sequence = u16::from_le_bytes([body[1], body[2]]);
        let time_us = u32::from_le_bytes([body[3], body[4], body[5], body[6]]);
        let message = payload::read(body[0], &body[HEAD..], self.layout);
        if matches!(message, Err(Refusal::Version(_) | Refusal::Value { .. })) {
            // Nobody knows any more how its data are laid out.
            self.layout = None;
        }
        Ok((sequence, time_us, message?))
    }

    /// Where a message stands among those before it; what must not be used is refused.
    fn follow(
        &mut self,
        sequence: u16,
        message: &WireMessage,
        tell: &mut impl FnMut(Decoded),
    ) -> Option<Refusal> {
        if let WireMessage::Hello(hello) = message {
            self.layout = Some((usize::from(hello.channels), hello.bits));
            // A board that has begun anew counts from where it likes.
            (self.last, self.late) = (Some(sequence), 0);
            return None;
        }
        let gap = self
            .last
            .map_or(0, |last| sequence.wrapping_sub(last).wrapping_sub(1));
        if gap >= 0x8000 && self.late < BEGUN_ANEW {
            self.late += 1;
            return Some(Refusal::Repeated);
        }
        if gap > 0 && gap < 0x8000 {
            tell(Decoded::Lost(gap));
        }
        (self.last, self.late) = (Some(sequence), 0);
        None
    }
}

/// Where a frame may begin behind lines that were printed, whatever bytes these have.
fn starts_behind_lines(bytes: &[u8]) -> Vec<usize> {
    // The first byte of a frame in COBS says where its first zero was, and the second is the kind of message.
    let begins = |at: &usize| {
        bytes
            .get(at + 1)
            .is_some_and(|&kind| payload::is_known(kind))
    };
    let feeds = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n');
    feeds.map(|(at, _)| at + 1).filter(begins).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::payload::HELLO;
    use super::super::tests::board;
    use super::*;
    use crate::wire::encode;

    fn events(bytes: &[u8]) -> Vec<Decoded> {
        let mut decoder = Decoder::default();
        let mut all = Vec::new();
        decoder.push(bytes, |e| all.push(e));
        all
    }

    #[test]
    fn gaps_repeats_and_new_beginnings_are_told_apart() {
        let hello = WireMessage::Hello(board());
        let data = WireMessage::Data(vec![5; 12]);
        let mut bytes = Vec::new();
        encode(&hello, 65_530, 0, 12, &mut bytes);
        for sequence in [65_531, 65_535, 0, 0, 65_531, 1] {
            encode(&data, sequence, 0, 12, &mut bytes);
        }
        let met: Vec<String> = (events(&bytes).iter())
            .map(|event| match event {
                Decoded::Message { sequence, .. } => sequence.to_string(),
                Decoded::Lost(n) => format!("lost {n}"),
                Decoded::Refused(why) => format!("{why:?}"),
            })
            .collect();
        let expected = [
            "65530", "65531", "lost 3", "65535", "0", "Repeated", "Repeated", "1",
        ];
        assert_eq!(met, expected);
        // A board that begins anew and whose hello was lost is heard again soon.
        for sequence in 0..40 {
            encode(&data, 40_000 + sequence, 0, 12, &mut bytes);
        }
        let decoded = events(&bytes)
            .into_iter()
            .filter(|e| matches!(e, Decoded::Message { .. }));
        assert!(decoded.count() > 25);
    }

    #[test]
    fn data_without_a_layout_are_refused_and_floods_are_not_kept() {
        let mut bytes = Vec::new();
        encode(&WireMessage::Data(vec![5; 12]), 0, 0, 12, &mut bytes);
        assert_eq!(events(&bytes), [Decoded::Refused(Refusal::NoLayout)]);
        let mut decoder = Decoder::default();
        decoder.push(&vec![0x41; 1_000_000], |e| panic!("{e:?}"));
        assert!(decoder.frame.capacity() < 1024);
        let mut met = Vec::new();
        decoder.push(&[0], |e| met.push(e));
        assert_eq!(met, [Decoded::Refused(Refusal::Framing)]);
    }

    /// A HELLO as its bytes on the wire, after something was done to its payload.
    fn hello_with(change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
        let mut frame = vec![HELLO, 0, 0, 0, 0, 0, 0];
        let mut said = Vec::new();
        payload::append(&WireMessage::Hello(board()), 12, &mut said);
        change(&mut said);
        frame.extend(said);
        frame.extend(SUM.checksum(&frame).to_le_bytes());
        let mut out = vec![0; cobs::max_encoding_length(frame.len())];
        let length = cobs::encode(&frame, &mut out);
        out.truncate(length);
        out.push(0);
        out
    }

    #[test]
    fn a_hello_that_cannot_be_used_says_why_and_its_data_are_not_believed() {
        let none = |name| Refusal::Value {
            name,
            rule: "above zero",
            found: 0,
        };
        let zero = |from: usize, to: usize| hello_with(|p| p[from..to].fill(0));
        let shorter = hello_with(|p| {
            p.truncate(4);
            p.push(9);
        });
        let cases = [
            (hello_with(|p| p[4] = 2), Refusal::Version(2)),
            (shorter, Refusal::Version(9)),
            (zero(11, 13), none("V_ref")),
            (zero(13, 15), none("V_ex")),
            (zero(15, 19), none("gain")),
            (hello_with(|p| p.truncate(20)), Refusal::Unknown),
        ];
        let mut sound = Vec::new();
        encode(&WireMessage::Hello(board()), 0, 0, 12, &mut sound);
        let mut data = Vec::new();
        encode(&WireMessage::Data(vec![5; 12]), 1, 0, 12, &mut data);
        for (bytes, refusal) in cases {
            let all = [&sound[..], &bytes, &data].concat();
            let said = events(&all);
            assert_eq!(said[1], Decoded::Refused(refusal));
            let trusted = matches!(said[2], Decoded::Message { .. });
            assert_eq!(trusted, refusal == Refusal::Unknown, "{:?}", said[2]);
            assert_eq!(refusal.in_words().is_some(), refusal.is_lasting());
        }
        let Decoded::Refused(why) = events(&hello_with(|p| p[10] = 25))[0] else {
            panic!("25 bits were believed");
        };
        let said = why.in_words().unwrap();
        assert!(said.contains("bits must be between 1 and 24, but is 25"));
    }

    #[test]
    fn a_frame_behind_printed_lines_is_found() {
        let hello = WireMessage::Hello(board());
        let texts = [
            "1,2,3\n",
            "ready\r\n\n",
            "T = 25 °C\r\n",
            "\u{1b}[0;32mI (29) boot: ESP-IDF\u{1b}[0m\n",
            &"2000 2001 2002\r\n".repeat(100),
            &format!("{}\nready\n", "=".repeat(400)),
        ];
        let longest: Vec<String> = (250..=260).map(|n| "=".repeat(n) + "\n").collect();
        let longest = longest.iter().map(String::as_str);
        for text in texts.into_iter().chain(longest) {
            let mut bytes = text.as_bytes().to_vec();
            encode(&hello, 0, 0, 12, &mut bytes);
            let found = events(&bytes);
            let is_hello =
                |e: &Decoded| matches!(e, Decoded::Message { message, .. } if *message == hello);
            assert!(found.len() == 1 && is_hello(&found[0]), "{text}: {found:?}");
        }
    }

    #[test]
    fn data_of_another_size_say_so() {
        let mut bytes = Vec::new();
        encode(&WireMessage::Hello(board()), 0, 0, 12, &mut bytes);
        encode(&WireMessage::Data(vec![5; 11]), 1, 0, 12, &mut bytes);
        let refusal = Refusal::Size {
            found: 17,
            announced: 18,
        };
        assert_eq!(events(&bytes)[1], Decoded::Refused(refusal));
    }

    /// Bytes flipped, dropped, doubled: what comes through was sent, and sound frames come through.
    #[test]
    fn a_bad_line_loses_frames_and_never_shows_a_wrong_one() {
        const FRAMES: u32 = 60_000;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let counts = |k: u32| -> Vec<u32> { (0..12).map(|c| (k * 31 + c * 517) % 4096).collect() };
        let mut decoder = Decoder::default();
        let mut hello = Vec::new();
        encode(&WireMessage::Hello(board()), u16::MAX, 0, 12, &mut hello);
        let (mut good, mut refused, mut lost) = (0_u32, 0_u32, 0_u32);
        let mut tell = |event: Decoded| match event {
            Decoded::Message {
                time_us,
                message: WireMessage::Data(found),
                ..
            } => {
                good += 1;
                assert_eq!(found, counts(time_us), "frame {time_us}");
            }
            Decoded::Message { .. } => {}
            Decoded::Lost(n) => lost += u32::from(n),
            Decoded::Refused(_) => refused += 1,
        };
        decoder.push(&hello, &mut tell);
        for k in 0..FRAMES {
            let mut bytes = Vec::new();
            encode(&WireMessage::Data(counts(k)), k as u16, k, 12, &mut bytes);
            let mut sent = Vec::new();
            for mut byte in bytes {
                let fate: f64 = rng.random();
                if fate < 1e-4 {
                    continue;
                }
                if fate < 2e-4 {
                    byte ^= 1 << rng.random_range(0..8);
                }
                sent.push(byte);
                if (2e-4..3e-4).contains(&fate) {
                    sent.push(byte);
                }
            }
            decoder.push(&sent, &mut tell);
        }
        // About one frame in a hundred is hit.
        assert!(good > FRAMES * 97 / 100 && good < FRAMES, "{good}");
        assert!(refused > 100, "{refused}");
        assert!(
            lost.abs_diff(FRAMES - good) < 20,
            "{lost} of {}",
            FRAMES - good
        );
    }
}
