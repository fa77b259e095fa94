//! A recording as a port: its frames come as they came.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::port::{Got, Pace, Port};
use crate::memory;
use crate::plain;
use crate::wire::{Decoded, Decoder, WireMessage};

/// The longest that is waited for between two frames (µs): no board is slower than one sample a second, and a
/// clock that leapt would be waited for in vain.
const LONGEST_PAUSE: u32 = 2_000_000;
/// Bytes of memory for each byte of a recording, at most: itself, and where its frames are.
const GROWTH: f64 = 8.0;

struct Replay {
    bytes: Vec<u8>,
    /// Where each frame ends with what stands before it, and when it is due (µs from the first).
    frames: Vec<(usize, u64)>,
    /// The first that is not due yet, and where those before it end.
    next: usize,
    due: usize,
    sent: usize,
    pace: Pace,
    begun: Option<Instant>,
}

pub(super) fn open(path: &Path, pace: Pace) -> Result<Box<dyn Port>, String> {
    let bytes = whole(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let frames = frames(&bytes).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(Box::new(Replay {
        bytes,
        frames,
        next: 0,
        due: 0,
        sent: 0,
        pace,
        begun: None,
    }))
}

/// The largest recording that is read.
pub(super) fn most_bytes() -> f64 {
    memory::allowed() / GROWTH
}

/// All of an ordinary file that memory has room for: a pipe or a device could be waited for without an end.
fn whole(path: &Path) -> Result<Vec<u8>, String> {
    let unreadable = |e: std::io::Error| format!("the recording cannot be read ({e})");
    let about = std::fs::metadata(path).map_err(unreadable)?;
    if !about.is_file() {
        return Err("this is no file that a recording could be in".to_owned());
    }
    let size = about.len() as f64;
    if size > most_bytes() {
        return Err(format!(
            "the recording has {}, and at most {} are read with {} of memory. Allow more with --memory-gb",
            plain::needed(size),
            plain::allowed(memory::allowed() / GROWTH),
            plain::allowed(memory::allowed())
        ));
    }
    std::fs::read(path).map_err(unreadable)
}

/// What is known of a recording before it is replayed.
pub struct RecordingExtent {
    pub samples: usize,
    /// When its first sample came, where nothing in it tells: as long before it was last written to as it lasts (nanoseconds
    /// since 1970).
    pub began_ns: u64,
}

impl RecordingExtent {
    /// Reads how many samples a recording has.
    ///
    /// # Errors
    /// That it cannot be read, or is too large for memory.
    pub fn of(path: &Path) -> Result<Self, String> {
        let bytes = whole(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let (samples, lasted) = samples(&bytes);
        let written = std::fs::metadata(path).and_then(|about| about.modified());
        let written = written.unwrap_or_else(|_| SystemTime::now());
        let since = written.duration_since(UNIX_EPOCH).unwrap_or_default();
        Ok(Self {
            samples,
            began_ns: since.saturating_sub(lasted).as_nanos() as u64,
        })
    }
}

/// How many samples there are, and how long they last.
fn samples(bytes: &[u8]) -> (usize, Duration) {
    let mut decoder = Decoder::default();
    let (mut count, mut lasted, mut last) = (0, 0_u64, None::<u32>);
    decoder.push(bytes, |event| {
        if let Decoded::Message {
            time_us, message, ..
        } = event
        {
            let is_sample = match &message {
                WireMessage::Data(_) => true,
                WireMessage::Note(text) => text.starts_with("line "),
                _ => false,
            };
            if is_sample {
                let since = time_us.wrapping_sub(last.replace(time_us).unwrap_or(time_us));
                // A clock that went back began anew.
                lasted += if since < u32::MAX / 2 {
                    u64::from(since)
                } else {
                    0
                };
                count += 1;
            }
        }
    });
    (count, Duration::from_micros(lasted))
}

/// Where frames end and when they are due; the last one takes what stands behind it.
fn frames(bytes: &[u8]) -> Result<Vec<(usize, u64)>, String> {
    let mut frames = Vec::new();
    let mut decoder = Decoder::default();
    let (mut end, mut due, mut last) = (0_usize, 0_u64, None::<u32>);
    let mut why = None::<String>;
    for piece in bytes.split_inclusive(|&b| b == 0) {
        end += piece.len();
        decoder.push(piece, |event| match event {
            Decoded::Message { time_us, .. } => {
                due += u64::from(last.map_or(0, |last| step(last, time_us)));
                last = Some(time_us);
                frames.push((end, due));
            }
            Decoded::Refused(refusal) if why.is_none() => why = refusal.in_words(),
            _ => {}
        });
    }
    match frames.last_mut() {
        Some(last) => last.0 = bytes.len(),
        None => return Err(nothing(why)),
    }
    Ok(frames)
}

fn nothing(why: Option<String>) -> String {
    let said = "this is no recording, or an empty one";
    why.map_or(said.to_owned(), |why| format!("{said}: {why}"))
}

/// How long (µs) is waited from one frame's time to the next. A clock that went back began anew.
fn step(from: u32, to: u32) -> u32 {
    let step = to.wrapping_sub(from);
    if step < u32::MAX / 2 {
        step.min(LONGEST_PAUSE)
    } else {
        0
    }
}

impl Port for Replay {
    fn read(&mut self, buffer: &mut [u8]) -> Got {
        if self.sent == self.bytes.len() {
            return Got::Gone;
        }
        let since = self.begun.get_or_insert_with(Instant::now).elapsed();
        while let Some(&(end, due)) = self.frames.get(self.next)
            && (self.pace == Pace::Fast || Duration::from_micros(due) <= since)
        {
            (self.due, self.next) = (end, self.next + 1);
        }
        // In pieces: what stands between two frames may be longer than any buffer.
        let count = (self.due - self.sent).min(buffer.len());
        if count == 0 {
            std::thread::sleep(Duration::from_millis(1));
            return Got::Nothing;
        }
        buffer[..count].copy_from_slice(&self.bytes[self.sent..self.sent + count]);
        self.sent += count;
        Got::Bytes(count)
    }

    fn write(&mut self, _: &[u8]) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::encode;

    fn note(time_us: u32, sequence: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        encode(
            &WireMessage::Note("tare".into()),
            sequence,
            time_us,
            12,
            &mut bytes,
        );
        bytes
    }

    /// All that comes, and how long that took.
    fn replayed(bytes: &[u8], pace: Pace) -> (Vec<u8>, Duration) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        std::fs::write(&path, bytes).unwrap();
        let mut port = open(&path, pace).unwrap();
        let (mut buffer, mut all) = ([0; 1000], Vec::new());
        let begun = Instant::now();
        loop {
            match port.read(&mut buffer) {
                Got::Gone => return (all, begun.elapsed()),
                Got::Nothing => assert!(begun.elapsed().as_secs() < 10, "it hangs"),
                Got::Bytes(count) => all.extend(&buffer[..count]),
            }
        }
    }

    #[test]
    fn what_is_larger_than_memory_is_refused_in_numbers_that_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        let file = std::fs::File::create(&path).unwrap();
        file.set_len(1_234_500_000_000).unwrap();
        let Err(said) = open(&path, Pace::Fast) else {
            panic!("a terabyte was read");
        };
        assert!(said.contains("the recording has 1240 GB"), "{said}");
    }

    #[test]
    fn garbage_longer_than_any_buffer_is_passed_over() {
        let garbage = vec![0x41; 20_000];
        let all = [&note(0, 0)[..], &garbage, &[0], &note(9, 1), &garbage].concat();
        for pace in [Pace::Fast, Pace::Real] {
            assert_eq!(replayed(&all, pace).0, all);
        }
    }

    /// Two samples that are a tenth of a second and ten minutes apart, behind what has no time, in a file that was written to at a known
    /// moment.
    #[test]
    fn a_recording_began_as_long_before_it_was_written_as_it_lasts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        let framed = |message: WireMessage, sequence: u16, time_us: u32| {
            let mut bytes = Vec::new();
            encode(&message, sequence, time_us, 12, &mut bytes);
            bytes
        };
        // Counts are read as the board has said that it sends them.
        let hello = WireMessage::Hello(crate::wire::Hello {
            version: crate::wire::VERSION,
            board: 1,
            channels: 2,
            bits: 12,
            reference_mv: 3300,
            supply_mv: 3300,
            gain_milli: 100_000,
            rate_hz: 1000,
            name: "Board".into(),
        });
        let all = [
            framed(hello, 0, 0),
            framed(WireMessage::Data(vec![7; 2]), 1, 5_000_000),
            framed(WireMessage::Data(vec![7; 2]), 2, 5_100_000),
            framed(WireMessage::Note("line 0 1.5,2.5".into()), 3, 605_100_000),
        ];
        std::fs::write(&path, all.concat()).unwrap();
        let written = UNIX_EPOCH + Duration::from_secs(1_700_000_000);
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(written).unwrap();
        let extent = RecordingExtent::of(&path).unwrap();
        assert_eq!(extent.samples, 3);
        assert_eq!(extent.began_ns, 1_699_999_399_900_000_000);
    }

    /// A clock that leaps by half an hour, or goes back, is not waited for.
    #[test]
    fn a_clock_that_leaps_is_not_waited_for() {
        assert_eq!(step(10, 1010), 1000);
        assert_eq!(step(u32::MAX - 9, 990), 1000);
        assert_eq!(step(5_000_000, 0), 0);
        assert_eq!(step(0, 1_800_000_000), LONGEST_PAUSE);
        let leaps = [note(50_000_000, 0), note(0, 1), note(100_000, 2)].concat();
        let (all, took) = replayed(&leaps, Pace::Real);
        assert_eq!(all, leaps);
        assert!((Duration::from_millis(100)..Duration::from_secs(5)).contains(&took));
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path, why: &str| {
            let said = open(path, Pace::Fast).err().unwrap();
            assert!(said.contains(why), "{said}");
        };
        refused(folder.path(), "no file");
        let path = folder.path().join("sparse.hapdrec");
        std::fs::File::create(&path)
            .unwrap()
            .set_len(1 << 42)
            .unwrap();
        refused(&path, "--memory-gb");
        std::fs::write(&path, b"\0nothing\0").unwrap();
        refused(&path, "no recording");
    }
}
