//! What stands in a frame: a message as bytes, and bytes as a message.

use super::message::{Hello, WireMessage};
use super::refusal::Refusal;
use crate::wire::{MOST_CHANNELS, VERSION};

pub(super) const HELLO: u8 = 0x01;
const DATA: u8 = 0x02;
const STATUS: u8 = 0x03;
const LOG: u8 = 0x04;
const PONG: u8 = 0x05;
const NOTE: u8 = 0x41;
pub(super) const ASK_HELLO: u8 = 0x81;
const START: u8 = 0x82;
const STOP: u8 = 0x83;
const RATE: u8 = 0x84;
const PING: u8 = 0x85;

/// The byte that tells what a message is.
pub(super) fn kind(message: &WireMessage) -> u8 {
    match message {
        WireMessage::Hello(_) => HELLO,
        WireMessage::Data(_) => DATA,
        WireMessage::Status { .. } => STATUS,
        WireMessage::Log { .. } => LOG,
        WireMessage::Pong(_) => PONG,
        WireMessage::Note(_) => NOTE,
        WireMessage::AskHello => ASK_HELLO,
        WireMessage::Start => START,
        WireMessage::Stop => STOP,
        WireMessage::Rate(_) => RATE,
        WireMessage::Ping(_) => PING,
    }
}

/// Whether messages of this kind exist.
pub(super) fn is_known(kind: u8) -> bool {
    matches!(kind, HELLO..=PONG | NOTE | ASK_HELLO..=PING)
}

/// Appends what follows the head of a message's frame.
pub(super) fn append(message: &WireMessage, bits: u8, out: &mut Vec<u8>) {
    match message {
        WireMessage::Hello(h) => {
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
        WireMessage::Data(counts) => pack(counts, bits, out),
        WireMessage::Status {
            overruns,
            temperature_centi,
        } => {
            out.extend(overruns.to_le_bytes());
            out.extend(temperature_centi.unwrap_or(i16::MAX).to_le_bytes());
        }
        WireMessage::Log { level, text } => {
            out.push(*level);
            out.extend(text.bytes());
        }
        WireMessage::Note(text) => out.extend(text.bytes()),
        WireMessage::Pong(token) | WireMessage::Ping(token) => out.extend(token.to_le_bytes()),
        WireMessage::Rate(hertz) => out.extend(hertz.to_le_bytes()),
        WireMessage::AskHello | WireMessage::Start | WireMessage::Stop => {}
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

/// The message of a kind, as far as it can be used; data are laid out by channels and bits.
pub(super) fn read(
    kind: u8,
    payload: &[u8],
    layout: Option<(usize, u8)>,
) -> Result<WireMessage, Refusal> {
    let unknown = Err(Refusal::Unknown);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ok(match (kind, payload) {
        (HELLO, _) => WireMessage::Hello(hello(payload)?),
        (DATA, _) => {
            let (channels, bits) = layout.ok_or(Refusal::NoLayout)?;
            let (found, announced) = (payload.len(), packed(channels, bits));
            if found != announced {
                return Err(Refusal::Size { found, announced });
            }
            WireMessage::Data(unpack(payload, channels, bits))
        }
        (STATUS, &[a, b, c, d, t, u]) => WireMessage::Status {
            overruns: u32::from_le_bytes([a, b, c, d]),
            temperature_centi: Some(i16::from_le_bytes([t, u])).filter(|&t| t != i16::MAX),
        },
        (LOG, [level, rest @ ..]) => WireMessage::Log {
            level: *level,
            text: text(rest),
        },
        (NOTE, _) => WireMessage::Note(text(payload)),
        (PONG, &[a, b, c, d]) => WireMessage::Pong(u32::from_le_bytes([a, b, c, d])),
        (PING, &[a, b, c, d]) => WireMessage::Ping(u32::from_le_bytes([a, b, c, d])),
        (RATE, &[a, b]) => WireMessage::Rate(u16::from_le_bytes([a, b])),
        (ASK_HELLO, []) => WireMessage::AskHello,
        (START, []) => WireMessage::Start,
        (STOP, []) => WireMessage::Stop,
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

/// The most bits of a count. As many channels as there may be then fit into a frame.
pub(super) const MOST_BITS: usize = 24;

pub(super) const MAGIC: [u8; 4] = *b"HAPD";

impl WireMessage {
    /// Whether a studio says it, and never a board.
    #[must_use]
    pub fn is_of_studio(&self) -> bool {
        kind(self) >= ASK_HELLO
    }
}
