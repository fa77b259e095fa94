//! Frames: type, sequence, time, payload and CRC-16, in COBS, ended by a zero.

mod decoder;
mod message;
mod payload;
mod refusal;

use crc::{CRC_16_IBM_3740, Crc};

use super::MOST_CHANNELS;

pub use decoder::{Decoded, Decoder};
pub use message::{Hello, WireMessage};
pub use refusal::Refusal;

use payload::MOST_BITS;

/// Bytes before the payload and after it.
const HEAD: usize = 7;
const TAIL: usize = 2;
/// The longest frame before COBS: short enough that COBS adds one byte and no more.
const LONGEST: usize = 253;
const _: () = assert!(MOST_CHANNELS * MOST_BITS <= 8 * (LONGEST - HEAD - TAIL));
const SUM: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// Appends a message as a frame with the zero that ends it. Counts are packed with `bits` each; they, texts
/// and names are cut to what a frame holds.
pub fn encode(message: &WireMessage, sequence: u16, time_us: u32, bits: u8, out: &mut Vec<u8>) {
    let mut frame = vec![payload::kind(message)];
    frame.extend(sequence.to_le_bytes());
    frame.extend(time_us.to_le_bytes());
    payload::append(message, bits, &mut frame);
    frame.truncate(LONGEST - TAIL);
    frame.extend(SUM.checksum(&frame).to_le_bytes());
    let start = out.len();
    out.resize(start + cobs::max_encoding_length(frame.len()), 0);
    let length = cobs::encode(&frame, &mut out[start..]);
    out.truncate(start + length);
    out.push(0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::VERSION;

    pub(super) fn board() -> Hello {
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
        let frame = |message: &WireMessage, sequence, time| {
            let mut out = Vec::new();
            encode(message, sequence, time, 12, &mut out);
            hex(&out)
        };
        let spec = include_str!("../../assets/firmware/PROTOCOL.md");
        let counts: Vec<u32> = (0..12).map(|k| 2048 + 100 * k).collect();
        for (message, sequence, time) in [
            (WireMessage::Hello(board()), 0, 0),
            (WireMessage::Data(counts), 1, 1000),
            (WireMessage::Data(vec![0; 12]), 2, 2000),
            (
                WireMessage::Status {
                    overruns: 3,
                    temperature_centi: Some(2150),
                },
                3,
                3000,
            ),
            (WireMessage::Note("tare".into()), 4, 4000),
            (WireMessage::Start, 0, 0),
            (WireMessage::Rate(500), 1, 0),
        ] {
            let bytes = frame(&message, sequence, time);
            assert!(spec.contains(&bytes), "{message:?}: {bytes}");
        }
    }

    #[test]
    fn every_message_comes_through_in_whatever_pieces() {
        let counts: Vec<u32> = (0..12).map(|k| (k * 379) % 4096).collect();
        let all = [
            WireMessage::Hello(board()),
            WireMessage::Data(counts),
            WireMessage::Data(vec![0; 12]),
            WireMessage::Data(vec![4095; 12]),
            WireMessage::Status {
                overruns: 7,
                temperature_centi: None,
            },
            WireMessage::Log {
                level: 2,
                text: "bridge 3 open – µ".into(),
            },
            WireMessage::Pong(0x0102_0304),
            WireMessage::Note("rest 0 2048.5 1.25".into()),
            WireMessage::AskHello,
            WireMessage::Start,
            WireMessage::Stop,
            WireMessage::Rate(1000),
            WireMessage::Ping(9),
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
                    if let Decoded::Message { message, .. } = event {
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
        encode(&WireMessage::Data(vec![1234; 12]), 9, 77, 12, &mut out);
        assert_eq!(out.len(), 29);
    }
}
