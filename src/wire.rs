//! What board and studio say to each other: frames in COBS with a CRC-16, or plain lines of numbers.
//!
//! `assets/firmware/PROTOCOL.md` is the specification; this is its encoder and decoder, without any port.

mod frame;
mod lines;

pub use frame::{Decoded, Decoder, Hello, Refusal, WireMessage, encode};
pub use lines::{LineReader, TextLine};

/// Version of the protocol.
pub const VERSION: u8 = 1;
/// The most channels a board may have.
pub const MOST_CHANNELS: usize = 64;

/// Microseconds of a board that count in 32 bits, made to go on where they begin again (every 72 minutes).
#[derive(Clone, Copy, Debug, Default)]
pub struct Timeline {
    last: Option<u64>,
}

impl Timeline {
    /// The time of a frame (µs) on a line that does not begin again. A frame may be a little older than
    /// the one before it.
    pub fn extend(&mut self, time_us: u32) -> u64 {
        const TURN: u64 = 1 << 32;
        let Some(last) = self.last else {
            self.last = Some(u64::from(time_us));
            return u64::from(time_us);
        };
        let base = last - last % TURN + u64::from(time_us);
        // The nearest of the times that look like this.
        let near = |t: &u64| t.abs_diff(last);
        let candidates = [base.checked_sub(TURN), Some(base), Some(base + TURN)];
        let time = candidates
            .into_iter()
            .flatten()
            .min_by_key(near)
            .unwrap_or(base);
        self.last = Some(time.max(last));
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_where_its_count_begins_again() {
        let mut line = Timeline::default();
        let top = u32::MAX;
        assert_eq!(line.extend(top - 500), u64::from(top - 500));
        assert_eq!(line.extend(499), u64::from(top) + 500);
        // One that came late.
        assert_eq!(line.extend(top - 10), u64::from(top - 10));
        assert_eq!(line.extend(1499), u64::from(top) + 1500);
        // From the very beginning.
        let mut young = Timeline::default();
        for time in [0, 1000, 43_000_000, 44_000_000] {
            assert_eq!(young.extend(time), u64::from(time));
        }
        // Turn after turn.
        let mut now = line.extend(2_000_000_000);
        for _ in 0..10 {
            now += 2_000_000_000;
            assert_eq!(line.extend(now as u32), now);
        }
    }
}
