//! Recordings: the board's own frames, written as they come, with what the studio did between them.
//!
//! A recording is a stream of the protocol: HELLO, DATA, and LOG frames of level 0 whose text begins with
//! “hapdef”. It is only ever appended to, so that a program that is killed loses the last moment and no more.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::live::{Rest, Sample};
use crate::wire::{Hello, Message, encode};

/// How long a sample may wait in memory.
const FLUSH: Duration = Duration::from_millis(100);
/// What texts of our own begin with.
const OWN: &str = "hapdef ";

/// A recording being written.
pub struct Recorder {
    pub path: PathBuf,
    file: File,
    pending: Vec<u8>,
    flushed: Instant,
    sequence: u16,
    bits: u8,
    /// Whether a board has said what its samples look like; one that prints lines never does.
    greeted: bool,
    time_us: u64,
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
            std::io::ErrorKind::AlreadyExists => format!(
                "{}: there is a recording of this name already. Choose another",
                path.display()
            ),
            _ => format!("{}: the recording cannot be begun ({e})", path.display()),
        })?;
        Ok(Self {
            path: path.to_owned(),
            file,
            pending: Vec::new(),
            flushed: Instant::now(),
            sequence: 0,
            bits: 12,
            greeted: false,
            time_us: 0,
            samples: 0,
            bytes: 0,
            failed: None,
        })
    }

    fn put(&mut self, message: &Message) {
        let before = self.pending.len();
        encode(
            message,
            self.sequence,
            self.time_us as u32,
            self.bits,
            &mut self.pending,
        );
        self.bytes += (self.pending.len() - before) as u64;
        self.sequence = self.sequence.wrapping_add(1);
        if self.flushed.elapsed() >= FLUSH {
            self.flush();
        }
    }

    /// What the board says of itself; its samples have this many bits from now on.
    pub fn hello(&mut self, hello: &Hello) {
        (self.bits, self.greeted) = (hello.bits, true);
        self.put(&Message::Hello(hello.clone()));
    }

    pub fn sample(&mut self, sample: &Sample) {
        self.time_us = sample.time_us;
        self.samples += 1;
        let whole = |c: &f64| c.fract() == 0.0 && *c >= 0.0 && *c < f64::from(1_u32 << self.bits);
        if self.greeted && sample.counts.iter().all(whole) {
            let counts = sample.counts.iter().map(|c| *c as u32).collect();
            self.put(&Message::Data(counts));
        } else {
            // Plain lines may hold anything.
            let words: Vec<String> = sample.counts.iter().map(f64::to_string).collect();
            self.own(&format!("line {}", words.join(",")));
        }
    }

    /// What was done: “tare”, “rest …”, “truth …”.
    pub fn own(&mut self, text: &str) {
        self.put(&Message::Log {
            level: 0,
            text: format!("{OWN}{text}"),
        });
    }

    /// Where the rest lay when the recording began, so that it can be replayed from there.
    pub fn rest(&mut self, rest: &Rest) {
        for (k, (level, noise)) in rest.level.iter().zip(&rest.noise).enumerate() {
            self.own(&format!("rest {k} {level} {noise}"));
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

impl Drop for Recorder {
    fn drop(&mut self) {
        self.flush();
    }
}

/// A text of our own in a recording, without its mark.
#[must_use]
pub fn note(level: u8, text: &str) -> Option<&str> {
    (level == 0).then(|| text.strip_prefix(OWN)).flatten()
}
