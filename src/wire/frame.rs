//! Frames: type, sequence, time, payload and CRC-16, in COBS, ended by a zero.

use crc::{CRC_16_IBM_3740, Crc};

use super::{MOST_CHANNELS, VERSION};

/// Bytes before the payload and after it.
const HEAD: usize = 7;
const TAIL: usize = 2;
/// The longest frame before COBS: short enough that COBS adds one byte and no more.
const LONGEST: usize = 253;
/// The most bits of a count. As many channels as there may be then fit into a frame.
const MOST_BITS: usize = 24;
const _: () = assert!(MOST_CHANNELS * MOST_BITS <= 8 * (LONGEST - HEAD - TAIL));
const MAGIC: [u8; 4] = *b"HAPD";
const SUM: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
/// So many frames in a row that seem to come from the past are a board that has begun anew.
const BEGUN_ANEW: u32 = 16;

const HELLO: u8 = 0x01;
const DATA: u8 = 0x02;
const STATUS: u8 = 0x03;
const LOG: u8 = 0x04;
const PONG: u8 = 0x05;
const NOTE: u8 = 0x41;
const ASK_HELLO: u8 = 0x81;
const START: u8 = 0x82;
const STOP: u8 = 0x83;
const RATE: u8 = 0x84;
const PING: u8 = 0x85;

/// What a board is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    pub version: u8,
    /// Tells boards apart; the same after an unplug.
    pub board: u32,
    pub channels: u8,
    /// Of a sample.
    pub bits: u8,
    /// Reference of the converter and supply of the bridges (mV).
    pub reference_mv: u16,
    pub supply_mv: u16,
    /// Of the amplifiers, in thousandths.
    pub gain_milli: u32,
    /// Frames of data a second.
    pub rate_hz: u16,
    pub name: String,
}

/// One thing said on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Message {
    // From the board.
    Hello(Hello),
    /// Raw counts, a channel each.
    Data(Vec<u32>),
    Status {
        /// Frames that the board could not send in time.
        overruns: u32,
        /// Hundredths of a degree Celsius, where it is known.
        temperature_centi: Option<i16>,
    },
    Log {
        level: u8,
        text: String,
    },
    Pong(u32),
    // In a recording only.
    /// What the studio did while it recorded.
    Note(String),
    // From the studio.
    AskHello,
    Start,
    Stop,
    /// Frames of data a second.
    Rate(u16),
    Ping(u32),
}

impl Message {
    /// Whether a studio says it, and never a board.
    #[must_use]
    pub fn is_of_studio(&self) -> bool {
        kind(self) >= ASK_HELLO
    }
}

/// Why bytes between two zeros were no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// No COBS, or longer than any frame.
    Framing,
    /// The check sum does not fit.
    Damaged,
    /// Sound, but of no type or length that is known.
    Unknown,
    /// A HELLO of another version of the protocol.
    Version(u8),
    /// A HELLO with a value that nothing can be computed with.
    Value {
        name: &'static str,
        rule: &'static str,
        found: u32,
    },
    /// Data of another size (bytes) than the HELLO before them announces.
    Size { found: usize, announced: usize },
    /// Data before the board has said how many channels and bits they have.
    NoLayout,
    /// It was there already, or came after one that was sent later.
    Repeated,
}

impl Refusal {
    /// Whether it is the board that is wrong, or unknown to us: it will say the same again. What a bad line does
    /// passes, and so do data that came before their HELLO.
    #[must_use]
    pub fn is_lasting(self) -> bool {
        matches!(
            self,
            Self::Version(_) | Self::Value { .. } | Self::Size { .. }
        )
    }

    /// For people, with what to do; nothing for what any line brings now and then.
    #[must_use]
    pub fn in_words(self) -> Option<String> {
        match self {
            Self::Framing | Self::Damaged | Self::Unknown | Self::Repeated => None,
            Self::Version(version) => Some(format!(
                "the board speaks version {version} of the protocol, and this program version {VERSION}: bring the older of the two up to date"
            )),
            Self::Value { name, rule, found } => Some(format!(
                "the board's HELLO cannot be used: {name} must be {rule}, but is {found}. Correct it in the firmware"
            )),
            Self::Size { found, announced } => Some(format!(
                "the board's DATA have {found} bytes, but the channels and bits of its HELLO take {announced}. Correct the one or the other in the firmware"
            )),
            Self::NoLayout => Some(
                "the board sends DATA, but no HELLO that says how many channels and bits they have. It must answer HELLO?"
                    .to_owned(),
            ),
        }
    }
}

/// What the decoder makes of bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    Message {
        sequence: u16,
        /// The board's clock; see [`super::Timeline`].
        time_us: u32,
        message: Message,
    },
    /// So many frames are missing before the next one.
    Lost(u16),
    Refused(Refusal),
}

/// Appends a message as a frame with the zero that ends it. Counts are packed with `bits` each; they, texts
/// and names are cut to what a frame holds.
pub fn encode(message: &Message, sequence: u16, time_us: u32, bits: u8, out: &mut Vec<u8>) {
    let mut frame = vec![kind(message)];
    frame.extend(sequence.to_le_bytes());
    frame.extend(time_us.to_le_bytes());
    payload(message, bits, &mut frame);
    frame.truncate(LONGEST - TAIL);
    frame.extend(SUM.checksum(&frame).to_le_bytes());
    let start = out.len();
    out.resize(start + cobs::max_encoding_length(frame.len()), 0);
    let length = cobs::encode(&frame, &mut out[start..]);
    out.truncate(start + length);
    out.push(0);
}

fn kind(message: &Message) -> u8 {
    match message {
        Message::Hello(_) => HELLO,
        Message::Data(_) => DATA,
        Message::Status { .. } => STATUS,
        Message::Log { .. } => LOG,
        Message::Pong(_) => PONG,
        Message::Note(_) => NOTE,
        Message::AskHello => ASK_HELLO,
        Message::Start => START,
        Message::Stop => STOP,
        Message::Rate(_) => RATE,
        Message::Ping(_) => PING,
    }
}

fn payload(message: &Message, bits: u8, out: &mut Vec<u8>) {
    match message {
        Message::Hello(h) => {
            out.extend(MAGIC);
            out.push(h.version);
            out.extend(h.board.to_le_bytes());
            out.extend([h.channels, h.bits]);
            out.extend(h.reference_mv.to_le_bytes());
            out.extend(h.supply_mv.to_le_bytes());
            out.extend(h.gain_milli.to_le_bytes());
            out.extend(h.rate_hz.to_le_bytes());
            out.extend(h.name.bytes());
        }
        Message::Data(counts) => pack(counts, bits, out),
        Message::Status {
            overruns,
            temperature_centi,
        } => {
            out.extend(overruns.to_le_bytes());
            out.extend(temperature_centi.unwrap_or(i16::MAX).to_le_bytes());
        }
        Message::Log { level, text } => {
            out.push(*level);
            out.extend(text.bytes());
        }
        Message::Note(text) => out.extend(text.bytes()),
        Message::Pong(token) | Message::Ping(token) => out.extend(token.to_le_bytes()),
        Message::Rate(hertz) => out.extend(hertz.to_le_bytes()),
        Message::AskHello | Message::Start | Message::Stop => {}
    }
}

/// Bytes of so many counts.
fn packed(channels: usize, bits: u8) -> usize {
    (channels * usize::from(bits)).div_ceil(8)
}

/// Counts one after the other, the lowest bits first.
fn pack(counts: &[u32], bits: u8, out: &mut Vec<u8>) {
    let (mut held, mut filled) = (0_u64, 0_u32);
    for &count in counts {
        let mask = (1_u64 << bits) - 1;
        held |= (u64::from(count) & mask) << filled;
        filled += u32::from(bits);
        while filled >= 8 {
            out.push(held as u8);
            held >>= 8;
            filled -= 8;
        }
    }
    if filled > 0 {
        out.push(held as u8);
    }
}

fn unpack(bytes: &[u8], channels: usize, bits: u8) -> Vec<u32> {
    let (mut held, mut filled) = (0_u64, 0_u32);
    let mut bytes = bytes.iter();
    let mask = (1_u64 << bits) - 1;
    (0..channels)
        .map(|_| {
            while filled < u32::from(bits) {
                held |= u64::from(bytes.next().copied().unwrap_or(0)) << filled;
                filled += 8;
            }
            let count = (held & mask) as u32;
            held >>= bits;
            filled -= u32::from(bits);
            count
        })
        .collect()
}

/// Takes bytes in as they come, in whatever pieces.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    frame: Vec<u8>,
    /// What comes until the next zero is too long for any frame.
    overlong: bool,
    /// Channels and bits of a sample, once the board has said them.
    layout: Option<(usize, u8)>,
    last: Option<u16>,
    late: u32,
}

impl Decoder {
    /// Takes in bytes and tells what they are. Whatever they are, no more than one frame is held.
    pub fn push(&mut self, bytes: &[u8], mut tell: impl FnMut(Event)) {
        for &byte in bytes {
            if byte != 0 {
                if !self.overlong && self.frame.len() > LONGEST {
                    self.make_room();
                }
                if !self.overlong {
                    self.frame.push(byte);
                }
                continue;
            }
            if self.overlong {
                tell(Event::Refused(Refusal::Framing));
            } else if !self.frame.is_empty() {
                self.end_of_frame(&mut tell);
            }
            self.frame.clear();
            self.overlong = false;
        }
    }

    /// The line was cut: what follows has nothing to do with what was before.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Longer than any frame, unless what was printed before it goes.
    fn make_room(&mut self) {
        let printed = printed(&self.frame);
        self.frame.drain(..printed);
        self.overlong = printed == 0;
    }

    fn end_of_frame(&mut self, tell: &mut impl FnMut(Event)) {
        match self.read_behind_text() {
            Ok((sequence, time_us, message)) => {
                if let Some(refused) = self.follow(sequence, &message, tell) {
                    return tell(Event::Refused(refused));
                }
                tell(Event::Message {
                    sequence,
                    time_us,
                    message,
                });
            }
            Err(refusal) => tell(Event::Refused(refusal)),
        }
    }

    /// What lies between two zeros. A board that has just printed lines sends no zero before its first frame.
    fn read_behind_text(&mut self) -> Result<(u16, u32, Message), Refusal> {
        let printed = printed(&self.frame);
        if printed == 0 {
            return self.read();
        }
        let whole = self.frame.clone();
        let mut found = self.read();
        // The last line feed may be the first byte of the frame.
        for start in [printed, printed - 1] {
            if !matches!(found, Err(Refusal::Framing | Refusal::Damaged)) {
                break;
            }
            self.frame.clear();
            self.frame.extend_from_slice(&whole[start..]);
            found = self.read();
        }
        found
    }

    fn read(&mut self) -> Result<(u16, u32, Message), Refusal> {
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
        let message = message(body[0], &body[HEAD..], self.layout);
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
        message: &Message,
        tell: &mut impl FnMut(Event),
    ) -> Option<Refusal> {
        if let Message::Hello(hello) = message {
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
            tell(Event::Lost(gap));
        }
        (self.last, self.late) = (Some(sequence), 0);
        None
    }
}

/// Bytes at the beginning that are lines of text.
fn printed(bytes: &[u8]) -> usize {
    let text = bytes
        .iter()
        .take_while(|b| b.is_ascii_graphic() || b.is_ascii_whitespace())
        .count();
    let last = bytes[..text].iter().rposition(|&b| b == b'\n');
    last.map_or(0, |at| at + 1)
}

fn message(kind: u8, payload: &[u8], layout: Option<(usize, u8)>) -> Result<Message, Refusal> {
    let unknown = Err(Refusal::Unknown);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ok(match (kind, payload) {
        (HELLO, _) => Message::Hello(hello(payload)?),
        (DATA, _) => {
            let (channels, bits) = layout.ok_or(Refusal::NoLayout)?;
            let (found, announced) = (payload.len(), packed(channels, bits));
            if found != announced {
                return Err(Refusal::Size { found, announced });
            }
            Message::Data(unpack(payload, channels, bits))
        }
        (STATUS, &[a, b, c, d, t, u]) => Message::Status {
            overruns: u32::from_le_bytes([a, b, c, d]),
            temperature_centi: Some(i16::from_le_bytes([t, u])).filter(|&t| t != i16::MAX),
        },
        (LOG, [level, rest @ ..]) => Message::Log {
            level: *level,
            text: text(rest),
        },
        (NOTE, _) => Message::Note(text(payload)),
        (PONG, &[a, b, c, d]) => Message::Pong(u32::from_le_bytes([a, b, c, d])),
        (PING, &[a, b, c, d]) => Message::Ping(u32::from_le_bytes([a, b, c, d])),
        (RATE, &[a, b]) => Message::Rate(u16::from_le_bytes([a, b])),
        (ASK_HELLO, []) => Message::AskHello,
        (START, []) => Message::Start,
        (STOP, []) => Message::Stop,
        _ => return unknown,
    })
}

fn hello(payload: &[u8]) -> Result<Hello, Refusal> {
    let rest = payload.strip_prefix(&MAGIC).ok_or(Refusal::Unknown)?;
    // The version first: another one may have another length.
    let (&version, rest) = rest.split_first().ok_or(Refusal::Unknown)?;
    if version != VERSION {
        return Err(Refusal::Version(version));
    }
    let (head, name) = rest.split_at_checked(16).ok_or(Refusal::Unknown)?;
    let pair = |k: usize| u16::from_le_bytes([head[k], head[k + 1]]);
    let four = |k: usize| u32::from_le_bytes([head[k], head[k + 1], head[k + 2], head[k + 3]]);
    let hello = Hello {
        version,
        board: four(0),
        channels: head[4],
        bits: head[5],
        reference_mv: pair(6),
        supply_mv: pair(8),
        gain_milli: four(10),
        rate_hz: pair(14),
        name: String::from_utf8_lossy(name).into_owned(),
    };
    usable(&hello).map(|()| hello)
}

/// Whether strains can be computed from what a board says of itself.
fn usable(hello: &Hello) -> Result<(), Refusal> {
    const ABOVE: &str = "above zero";
    let channels = (1..=MOST_CHANNELS).contains(&usize::from(hello.channels));
    let bits = (1..=MOST_BITS).contains(&usize::from(hello.bits));
    let reference = u32::from(hello.reference_mv);
    let supply = u32::from(hello.supply_mv);
    let gain = hello.gain_milli;
    let values = [
        (
            "channels",
            "between 1 and 64",
            u32::from(hello.channels),
            channels,
        ),
        ("bits", "between 1 and 24", u32::from(hello.bits), bits),
        ("V_ref", ABOVE, reference, reference > 0),
        ("V_ex", ABOVE, supply, supply > 0),
        ("gain", ABOVE, gain, gain > 0),
    ];
    match values.into_iter().find(|(.., fits)| !fits) {
        Some((name, rule, found, _)) => Err(Refusal::Value { name, rule, found }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn board() -> Hello {
        Hello {
            version: VERSION,
            board: 0xC0FF_EE01,
            channels: 12,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 5000,
            gain_milli: 330_000,
            rate_hz: 1000,
            name: "shin, left".into(),
        }
    }

    fn events(bytes: &[u8]) -> Vec<Event> {
        let mut decoder = Decoder::default();
        let mut all = Vec::new();
        decoder.push(bytes, |e| all.push(e));
        all
    }

    fn hex(bytes: &[u8]) -> String {
        bytes
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// The frames that the specification shows, byte for byte: firmware is tested against the same.
    #[test]
    fn the_frames_of_the_specification() {
        let frame = |message: &Message, sequence, time| {
            let mut out = Vec::new();
            encode(message, sequence, time, 12, &mut out);
            hex(&out)
        };
        let spec = include_str!("../../assets/firmware/PROTOCOL.md");
        let counts: Vec<u32> = (0..12).map(|k| 2048 + 100 * k).collect();
        for (message, sequence, time) in [
            (Message::Hello(board()), 0, 0),
            (Message::Data(counts), 1, 1000),
            (Message::Data(vec![0; 12]), 2, 2000),
            (
                Message::Status {
                    overruns: 3,
                    temperature_centi: Some(2150),
                },
                3,
                3000,
            ),
            (Message::Note("tare".into()), 4, 4000),
            (Message::Start, 0, 0),
            (Message::Rate(500), 1, 0),
        ] {
            let bytes = frame(&message, sequence, time);
            assert!(spec.contains(&bytes), "{message:?}: {bytes}");
        }
    }

    #[test]
    fn every_message_comes_through_in_whatever_pieces() {
        let counts: Vec<u32> = (0..12).map(|k| (k * 379) % 4096).collect();
        let all = [
            Message::Hello(board()),
            Message::Data(counts),
            Message::Data(vec![0; 12]),
            Message::Data(vec![4095; 12]),
            Message::Status {
                overruns: 7,
                temperature_centi: None,
            },
            Message::Log {
                level: 2,
                text: "bridge 3 open – µ".into(),
            },
            Message::Pong(0x0102_0304),
            Message::Note("rest 0 2048.5 1.25".into()),
            Message::AskHello,
            Message::Start,
            Message::Stop,
            Message::Rate(1000),
            Message::Ping(9),
        ];
        let mut bytes = vec![0x55, 0x00, 0x00];
        for (k, message) in (0..).zip(&all) {
            encode(message, k, 1000 * u32::from(k), 12, &mut bytes);
        }
        for piece in [1, 2, 7, 4096] {
            let mut decoder = Decoder::default();
            let mut found = Vec::new();
            for part in bytes.chunks(piece) {
                decoder.push(part, |event| {
                    if let Event::Message { message, .. } = event {
                        found.push(message);
                    }
                });
            }
            assert_eq!(found, all);
        }
    }

    #[test]
    fn twelve_channels_take_twenty_nine_bytes() {
        let mut out = Vec::new();
        encode(&Message::Data(vec![1234; 12]), 9, 77, 12, &mut out);
        assert_eq!(out.len(), 29);
    }

    #[test]
    fn gaps_repeats_and_new_beginnings_are_told_apart() {
        let hello = Message::Hello(board());
        let data = Message::Data(vec![5; 12]);
        let mut bytes = Vec::new();
        encode(&hello, 65_530, 0, 12, &mut bytes);
        for sequence in [65_531, 65_535, 0, 0, 65_531, 1] {
            encode(&data, sequence, 0, 12, &mut bytes);
        }
        let told: Vec<String> = (events(&bytes).iter())
            .map(|event| match event {
                Event::Message { sequence, .. } => sequence.to_string(),
                Event::Lost(n) => format!("lost {n}"),
                Event::Refused(why) => format!("{why:?}"),
            })
            .collect();
        let expected = [
            "65530", "65531", "lost 3", "65535", "0", "Repeated", "Repeated", "1",
        ];
        assert_eq!(told, expected);
        // A board that begins anew and whose hello was lost is heard again soon.
        for sequence in 0..40 {
            encode(&data, 40_000 + sequence, 0, 12, &mut bytes);
        }
        let heard = events(&bytes)
            .into_iter()
            .filter(|e| matches!(e, Event::Message { .. }));
        assert!(heard.count() > 25);
    }

    #[test]
    fn data_without_a_layout_are_refused_and_floods_are_not_kept() {
        let mut bytes = Vec::new();
        encode(&Message::Data(vec![5; 12]), 0, 0, 12, &mut bytes);
        assert_eq!(events(&bytes), [Event::Refused(Refusal::NoLayout)]);
        let mut decoder = Decoder::default();
        decoder.push(&vec![0x41; 1_000_000], |e| panic!("{e:?}"));
        assert!(decoder.frame.capacity() < 1024);
        let mut told = Vec::new();
        decoder.push(&[0], |e| told.push(e));
        assert_eq!(told, [Event::Refused(Refusal::Framing)]);
    }

    /// A HELLO as its bytes on the wire, after something was done to its payload.
    fn hello_with(change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
        let mut frame = vec![HELLO, 0, 0, 0, 0, 0, 0];
        let mut said = Vec::new();
        payload(&Message::Hello(board()), 12, &mut said);
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
        encode(&Message::Hello(board()), 0, 0, 12, &mut sound);
        let mut data = Vec::new();
        encode(&Message::Data(vec![5; 12]), 1, 0, 12, &mut data);
        for (bytes, refusal) in cases {
            let all = [&sound[..], &bytes, &data].concat();
            let said = events(&all);
            assert_eq!(said[1], Event::Refused(refusal));
            let trusted = matches!(said[2], Event::Message { .. });
            assert_eq!(trusted, refusal == Refusal::Unknown, "{:?}", said[2]);
            assert_eq!(refusal.in_words().is_some(), refusal.is_lasting());
        }
        let Event::Refused(why) = events(&hello_with(|p| p[10] = 25))[0] else {
            panic!("25 bits were believed");
        };
        let said = why.in_words().unwrap();
        assert!(said.contains("bits must be between 1 and 24, but is 25"));
    }

    #[test]
    fn a_frame_behind_printed_lines_is_found() {
        let hello = Message::Hello(board());
        for text in ["1,2,3\n", "ready\r\n\n", &"2000 2001 2002\r\n".repeat(100)] {
            let mut bytes = text.as_bytes().to_vec();
            encode(&hello, 0, 0, 12, &mut bytes);
            let found = events(&bytes);
            let is_hello =
                |e: &Event| matches!(e, Event::Message { message, .. } if *message == hello);
            assert!(found.len() == 1 && is_hello(&found[0]), "{text}: {found:?}");
        }
    }

    #[test]
    fn data_of_another_size_say_so() {
        let mut bytes = Vec::new();
        encode(&Message::Hello(board()), 0, 0, 12, &mut bytes);
        encode(&Message::Data(vec![5; 11]), 1, 0, 12, &mut bytes);
        let refusal = Refusal::Size {
            found: 17,
            announced: 18,
        };
        assert_eq!(events(&bytes)[1], Event::Refused(refusal));
    }

    /// Bytes flipped, dropped, doubled: what comes through was sent, and sound frames come through.
    #[test]
    fn a_bad_line_loses_frames_and_never_shows_a_wrong_one() {
        const FRAMES: u32 = 60_000;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let counts = |k: u32| -> Vec<u32> { (0..12).map(|c| (k * 31 + c * 517) % 4096).collect() };
        let mut decoder = Decoder::default();
        let mut hello = Vec::new();
        encode(&Message::Hello(board()), u16::MAX, 0, 12, &mut hello);
        let (mut good, mut refused, mut lost) = (0_u32, 0_u32, 0_u32);
        let mut tell = |event: Event| match event {
            Event::Message {
                time_us,
                message: Message::Data(found),
                ..
            } => {
                good += 1;
                assert_eq!(found, counts(time_us), "frame {time_us}");
            }
            Event::Message { .. } => {}
            Event::Lost(n) => lost += u32::from(n),
            Event::Refused(_) => refused += 1,
        };
        decoder.push(&hello, &mut tell);
        for k in 0..FRAMES {
            let mut bytes = Vec::new();
            encode(&Message::Data(counts(k)), k as u16, k, 12, &mut bytes);
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
