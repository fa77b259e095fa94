//! A recording as a port: its frames come as they came.

use std::path::Path;
use std::time::{Duration, Instant};

use super::{Got, Pace, Port};
use crate::wire::{Decoder, Event};

struct Replay {
    bytes: Vec<u8>,
    /// Where each frame ends, and the time it says of itself (µs).
    frames: Vec<(usize, u32)>,
    next: usize,
    sent: usize,
    pace: Pace,
    begun: Option<(Instant, u32)>,
}

pub(super) fn open(path: &Path, pace: Pace) -> Result<Box<dyn Port>, String> {
    let bytes = std::fs::read(path)
        .map_err(|e| format!("{}: the recording cannot be read ({e})", path.display()))?;
    let mut frames = Vec::new();
    let mut decoder = Decoder::default();
    let mut start = 0;
    while let Some(length) = bytes[start..].iter().position(|&b| b == 0) {
        let end = start + length + 1;
        decoder.push(&bytes[start..end], |event| {
            if let Event::Message { time_us, .. } = event {
                frames.push((end, time_us));
            }
        });
        start = end;
    }
    if frames.is_empty() {
        return Err(format!(
            "{}: this is no recording, or an empty one",
            path.display()
        ));
    }
    Ok(Box::new(Replay {
        bytes,
        frames,
        next: 0,
        sent: 0,
        pace,
        begun: None,
    }))
}

impl Port for Replay {
    fn read(&mut self, buffer: &mut [u8]) -> Got {
        if self.next >= self.frames.len() {
            return Got::Gone;
        }
        let (begun, first) = *self.begun.get_or_insert((Instant::now(), self.frames[0].1));
        let due = |time: u32| {
            Duration::from_micros(u64::from(time.wrapping_sub(first).min(u32::MAX / 2)))
        };
        let mut end = self.sent;
        while let Some(&(until, time)) = self.frames.get(self.next) {
            let waits = self.pace == Pace::Real
                && time.wrapping_sub(first) < u32::MAX / 2
                && due(time) > begun.elapsed();
            if waits || until - self.sent > buffer.len() {
                break;
            }
            (end, self.next) = (until, self.next + 1);
        }
        let count = end - self.sent;
        if count == 0 {
            std::thread::sleep(Duration::from_millis(1));
            return Got::Nothing;
        }
        buffer[..count].copy_from_slice(&self.bytes[self.sent..end]);
        self.sent = end;
        Got::Bytes(count)
    }

    fn write(&mut self, _: &[u8]) {}
}
