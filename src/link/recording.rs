//! Recordings: the board's own frames, written as they come, with what the studio did between them.
//!
//! A recording is a stream of the protocol: HELLO, DATA, and NOTE frames, which no board sends. It is only ever
//! appended to, so that a program that is killed loses the last moment and no more.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::live::{Rest, Sample};
use crate::wire::{Hello, WireMessage, encode};

/// How long a sample may wait in memory.
const FLUSH: Duration = Duration::from_millis(100);
/// What notes began with when they were LOG frames of level 0.
const OLD_NOTE: &str = "hapdef ";
/// How far the board's clock may leave that of the machine before that is written again (µs), and for how long samples may
/// come later than they should by it: what waited somewhere on the way is soon made up for.
const APART_US: u64 = 500_000;
const LATE_US: u64 = 10_000_000;
/// A temperature is written again when it has changed by this (°C).
const WARMER: f64 = 0.1;
/// Values of a line that surely fit into one frame.
const VALUES: usize = 8;

/// A recording being written.
pub struct Recorder {
    pub path: PathBuf,
    file: File,
    pending: Vec<u8>,
    flushed: Instant,
    sequence: u16,
    /// Channels and bits of a sample, once a board has said them; one that prints lines never does.
    layout: Option<(usize, u8)>,
    time_us: u64,
    clock: RecordedClock,
    /// What was written last (°C).
    temperature: Option<f64>,
    pub samples: u64,
    pub bytes: u64,
    /// Why it ended by itself.
    pub failed: Option<String>,
}

impl Recorder {
    /// Begins a recording; never over an older one.
    ///
    /// # Errors
    /// A message that says which file and why.
    pub fn create(path: &Path) -> Result<Self, String> {
        let file = File::create_new(path).map_err(|e| match e.kind() {
            std::io::ErrorKind::AlreadyExists if path.is_dir() => {
                format!("{}: this is a folder. Name a file in it", path.display())
            }
            std::io::ErrorKind::AlreadyExists => format!(
                "{}: there is a recording of this name already. Choose another",
                path.display()
            ),
            _ => format!("{}: the recording cannot be begun ({e})", path.display()),
        })?;
        Ok(Self::begun(path, file))
    }

    fn begun(path: &Path, file: File) -> Self {
        Self {
            path: path.to_owned(),
            file,
            pending: Vec::new(),
            flushed: Instant::now(),
            sequence: 0,
            layout: None,
            time_us: 0,
            clock: RecordedClock::default(),
            temperature: None,
            samples: 0,
            bytes: 0,
            failed: None,
        }
    }

    fn put(&mut self, message: &WireMessage) {
        let before = self.pending.len();
        let bits = self.layout.map_or(12, |(_, bits)| bits);
        encode(
            message,
            self.sequence,
            self.time_us as u32,
            bits,
            &mut self.pending,
        );
        self.bytes += (self.pending.len() - before) as u64;
        self.sequence = self.sequence.wrapping_add(1);
        if self.flushed.elapsed() >= FLUSH {
            self.flush();
        }
    }

    /// What the board says of itself; its samples have this many channels and bits from now on.
    pub fn hello(&mut self, hello: &Hello) {
        self.layout = Some((usize::from(hello.channels), hello.bits));
        self.put(&WireMessage::Hello(hello.clone()));
    }

    pub fn sample(&mut self, sample: &Sample) {
        self.time_us = sample.time_us;
        self.samples += 1;
        let fits = self.layout.is_some_and(|(channels, bits)| {
            let whole = |c: &f64| c.fract() == 0.0 && *c >= 0.0 && *c < f64::from(1_u32 << bits);
            sample.counts.len() == channels && sample.counts.iter().all(whole)
        });
        if fits {
            let counts = sample.counts.iter().map(|c| *c as u32).collect();
            self.put(&WireMessage::Data(counts));
        } else {
            self.line(&sample.counts);
        }
    }

    /// When the sample at a time of the board's clock came (µs since 1970): it is written where the board's clock does not
    /// tell it by itself.
    pub fn clock(&mut self, time_us: u64, unix_us: u64) {
        if self.clock.is_news(time_us, unix_us) {
            self.note_clock(time_us, unix_us);
        }
    }

    /// As [`Self::clock`], where a recording has told it.
    pub fn note_clock(&mut self, time_us: u64, unix_us: u64) {
        self.time_us = time_us;
        self.own(&format!("clock {unix_us}"));
    }

    /// How warm the board said it is (°C), where it does: it is written where it is news.
    pub fn temperature(&mut self, celsius: Option<f64>) {
        let is_news = |now: &f64| {
            self.temperature
                .is_none_or(|last| (now - last).abs() >= WARMER)
        };
        if let Some(now) = celsius.filter(is_news) {
            self.temperature = Some(now);
            self.own(&format!("temperature {now:.2}"));
        }
    }

    /// Plain lines may hold anything, and more than a frame does.
    fn line(&mut self, counts: &[f64]) {
        let last = counts.len().saturating_sub(1) / VALUES;
        for (k, piece) in counts.chunks(VALUES).enumerate() {
            // As short as can be read back, and with an exponent where it would be long.
            let words: Vec<String> = piece.iter().map(|v| format!("{v:?}")).collect();
            let what = if k == last { "line" } else { "part" };
            self.own(&format!("{what} {} {}", k * VALUES, words.join(",")));
        }
    }

    /// What was done: “tare”, “rest …”, “truth …”, “clock …”, “temperature …”.
    pub fn own(&mut self, text: &str) {
        self.put(&WireMessage::Note(text.to_owned()));
    }

    /// Where the rest lay when the recording began, so that it can be replayed from there.
    pub fn rest(&mut self, rest: &Rest) {
        for (k, (level, noise)) in rest.level.iter().zip(&rest.noise).enumerate() {
            let drift = rest.drift.get(k).copied().unwrap_or(0.0);
            self.own(&format!("rest {k} {level} {noise} {drift}"));
        }
    }

    /// Where a simulated board is really touched.
    pub fn truth(&mut self, touch: Option<(DVec3, f64)>) {
        match touch {
            Some((p, force)) => {
                let p = p * 1e3;
                self.own(&format!(
                    "truth {:.4} {:.4} {:.4} {force:.5}",
                    p.x, p.y, p.z
                ));
            }
            None => self.own("truth none"),
        }
    }

    /// Everything so far reaches the file.
    pub fn flush(&mut self) {
        self.flushed = Instant::now();
        if let Err(e) = self.file.write_all(&self.pending)
            && self.failed.is_none()
        {
            self.failed = Some(format!(
                "{}: the recording ended, because nothing more can be written ({e})",
                self.path.display()
            ));
        }
        self.pending.clear();
    }
}

/// What this machine's clock says at times of the board's, as far as it was written.
#[derive(Default)]
struct RecordedClock {
    /// µs since 1970 at a time of the board's (µs).
    written: Option<(u64, u64)>,
    /// The time of the board's since which samples have come late.
    late_us: Option<u64>,
}

impl RecordedClock {
    /// Whether a sample came otherwise than is written.
    fn is_news(&mut self, time_us: u64, unix_us: u64) -> bool {
        let told = self.written.and_then(|(unix, board)| {
            let since = time_us.checked_sub(board)?;
            Some(unix + since)
        });
        let is_late = told.is_some_and(|told| unix_us > told + APART_US);
        let late_us = *self.late_us.get_or_insert(time_us);
        if !is_late {
            self.late_us = None;
        }
        let lasts = is_late && time_us.saturating_sub(late_us) > LATE_US;
        let is_news = lasts || told.is_none_or(|told| unix_us + APART_US < told);
        if is_news {
            *self = Self {
                written: Some((unix_us, time_us)),
                late_us: None,
            };
        }
        is_news
    }
}

impl Drop for Recorder {
    /// One that was begun and never written to leaves nothing that would be in the way of the next.
    fn drop(&mut self) {
        self.flush();
        if self.bytes == 0 {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// A note in a recording that was made before there were notes, without its mark. Of a live board it is a text as
/// any other.
#[must_use]
pub fn old_note(level: u8, text: &str) -> Option<&str> {
    (level == 0).then(|| text.strip_prefix(OLD_NOTE)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::{Input, Receiver};

    #[test]
    fn one_that_was_never_written_to_is_not_in_the_way() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        drop(Recorder::create(&path).unwrap());
        let mut recorder = Recorder::create(&path).unwrap();
        recorder.own("tare");
        drop(recorder);
        assert!(std::fs::metadata(&path).unwrap().len() > 10);
        assert!(Recorder::create(&path).is_err_and(|e| e.contains("already")));
        let nowhere = folder.path().join("none").join("a.hapdrec");
        assert!(Recorder::create(&nowhere).is_err_and(|e| e.contains("cannot be begun")));
    }

    /// At the first sample, when the board's clock has left this machine's for good, and when either is set anew.
    #[test]
    fn the_clock_is_written_where_it_is_news() {
        const S: u64 = 1_000_000;
        let mut clock = RecordedClock::default();
        let mut is_news = |board: u64, unix: u64| clock.is_news(board, unix);
        assert!(is_news(S, 100 * S) && !is_news(2 * S, 101 * S));
        // What waited for three seconds comes at once.
        assert!(!is_news(3 * S, 105 * S) && !is_news(4 * S, 105 * S) && !is_news(6 * S, 105 * S));
        // Late from here on.
        let late: Vec<bool> = (7..=20).map(|k| is_news(k * S, (k + 102) * S)).collect();
        assert_eq!(late.iter().position(|news| *news), Some(11), "{late:?}");
        // This machine's clock is set back; the board begins anew.
        assert!(is_news(21 * S, 50 * S) && is_news(5, 51 * S));
        assert!(!is_news(S, 52 * S));
    }

    #[test]
    fn a_temperature_is_written_where_it_is_news() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hapdrec");
        let mut recorder = Recorder::create(&path).unwrap();
        for celsius in [None, Some(21.5), Some(21.55), Some(21.62), None, Some(21.5)] {
            recorder.temperature(celsius);
        }
        drop(recorder);
        let (mut receiver, mut said) = (Receiver::default(), Vec::new());
        receiver.push(&std::fs::read(&path).unwrap(), 0, |input| {
            if let Input::Note { text, .. } = input {
                said.push(text);
            }
        });
        let wanted = ["21.50", "21.62", "21.50"].map(|c| format!("temperature {c}"));
        assert_eq!(said, wanted);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_said() {
        let full = Path::new("/dev/full");
        let file = File::options().write(true).open(full).unwrap();
        let mut recorder = Recorder::begun(full, file);
        recorder.own("tare");
        recorder.flush();
        let said = recorder.failed.take().unwrap();
        assert!(
            said.contains("/dev/full") && said.contains("space"),
            "{said}"
        );
    }
}
