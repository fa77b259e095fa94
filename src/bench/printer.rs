//! A simulated printer: Marlin's line protocol, a planner that moves in its own time, and whatever goes wrong on request.

use std::collections::VecDeque;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::units;

/// What goes wrong; probabilities a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrinterFaults {
    /// A line never arrives.
    pub lose: f64,
    /// A byte of a line arrives as another.
    pub garble: f64,
    /// An answer never arrives.
    pub lose_answer: f64,
    /// A byte of an answer arrives as another.
    pub garble_answer: f64,
    /// It begins anew, and believes that it stands at zero.
    pub reset: f64,
    /// Every second step of a move is lost: it says that it is where it was sent to, after half of the way.
    pub stall: f64,
}

/// One axis of it.
#[derive(Clone, Copy, Debug)]
struct DriveAxis {
    letter: char,
    /// Where it really is, and where it believes to be (mm, degrees).
    real: f64,
    believed: f64,
    target: f64,
    /// Units a second.
    speed: f64,
    /// Share of its steps that are really made.
    kept: f64,
}

/// A printer without a port or a clock of its own.
pub struct SimulatedPrinter {
    drives: Vec<DriveAxis>,
    faults: PrinterFaults,
    rng: ChaCha8Rng,
    open: Vec<u8>,
    /// Lines that wait, as they came through.
    waiting: VecDeque<String>,
    expected: u32,
    now_us: u64,
    busy_us: u64,
    halted: bool,
    /// Lines that it took, and times that it began anew.
    pub lines: u64,
    /// See [`Self::lines`].
    pub restarts: u32,
}

/// Between two words that it is busy (µs).
const BUSY_US: u64 = 2_000_000;

impl SimulatedPrinter {
    /// With axes of these letters, each where it stands at first.
    #[must_use]
    pub fn new(
        axes: impl IntoIterator<Item = (char, f64)>,
        faults: PrinterFaults,
        seed: u64,
    ) -> Self {
        let drive = |(letter, at)| DriveAxis {
            letter,
            real: at,
            believed: at,
            target: at,
            speed: 10.0,
            kept: 1.0,
        };
        Self {
            drives: axes.into_iter().map(drive).collect(),
            faults,
            rng: ChaCha8Rng::seed_from_u64(seed),
            open: Vec::new(),
            waiting: VecDeque::new(),
            expected: 1,
            now_us: 0,
            busy_us: 0,
            halted: false,
            lines: 0,
            restarts: 0,
        }
    }

    /// Where an axis really is.
    #[must_use]
    pub fn real(&self, letter: char) -> Option<f64> {
        let drive = self.drives.iter().find(|d| d.letter == letter)?;
        Some(drive.real)
    }

    fn chance(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.rng.random::<f64>() < probability
    }

    /// Bytes from whoever drives it.
    pub fn receive(&mut self, bytes: &[u8], out: &mut Vec<u8>) {
        for &byte in bytes {
            if byte != b'\n' {
                self.open.push(byte);
                continue;
            }
            let mut line = std::mem::take(&mut self.open);
            if line.is_empty() {
                continue;
            }
            // What is looked for past all that waits. Nothing happens to these: they are short.
            match &line[..] {
                b"M112" => return self.halt(out),
                b"M410" => {
                    self.quick_stop();
                    continue;
                }
                _ => {}
            }
            if self.chance(self.faults.lose) {
                continue;
            }
            if self.chance(self.faults.garble) {
                let k = self.rng.random_range(0..line.len());
                line[k] ^= 1 << self.rng.random_range(0..7);
            }
            self.take(&line, out);
        }
    }

    fn halt(&mut self, out: &mut Vec<u8>) {
        self.halted = true;
        self.waiting.clear();
        self.stop_drives();
        out.extend_from_slice(b"Error:Printer halted. kill() called!\n");
    }

    fn stop_drives(&mut self) {
        for drive in &mut self.drives {
            drive.target = drive.believed;
        }
    }

    fn quick_stop(&mut self) {
        self.stop_drives();
        self.waiting.clear();
    }

    /// A line with its number and sum.
    fn take(&mut self, line: &[u8], out: &mut Vec<u8>) {
        if self.halted {
            return;
        }
        let last = self.expected.wrapping_sub(1);
        let text = String::from_utf8_lossy(line).into_owned();
        let Some((number, command)) = checked(&text) else {
            self.answer(
                &format!(
                    "Error:checksum mismatch, Last Line: {last}\nResend: {}\nok\n",
                    self.expected
                ),
                out,
            );
            return;
        };
        if command.starts_with("M110") {
            self.expected = number + 1;
        } else if number != self.expected {
            self.answer(
                &format!(
                    "Error:Line Number is not Last Line Number+1, Last Line: {last}\nResend: {}\nok\n",
                    self.expected
                ),
                out,
            );
            return;
        } else {
            self.expected += 1;
        }
        self.lines += 1;
        if self.chance(self.faults.reset) {
            self.restart(out);
            return;
        }
        self.waiting.push_back(command.to_owned());
        self.work(out);
    }

    fn restart(&mut self, out: &mut Vec<u8>) {
        self.restarts += 1;
        self.expected = 1;
        self.waiting.clear();
        self.open.clear();
        for drive in &mut self.drives {
            (drive.believed, drive.target) = (0.0, 0.0);
        }
        out.extend_from_slice(b"start\necho:Marlin 2.1.2 (simulated)\n");
    }

    /// An answer, as far as it comes through.
    fn answer(&mut self, text: &str, out: &mut Vec<u8>) {
        for line in text.split_inclusive('\n') {
            if self.chance(self.faults.lose_answer) {
                continue;
            }
            let mut bytes = line.as_bytes().to_vec();
            if self.chance(self.faults.garble_answer) {
                let k = self.rng.random_range(0..bytes.len());
                bytes[k] ^= 1 << self.rng.random_range(0..7);
            }
            out.extend(bytes);
        }
    }

    fn moves(&self) -> bool {
        self.drives.iter().any(|d| d.believed != d.target)
    }

    /// Does what waits, as far as that needs no time.
    fn work(&mut self, out: &mut Vec<u8>) {
        while let Some(command) = self.waiting.front().cloned() {
            let waits = self.moves() && !command.starts_with('N');
            // The planner of this one holds a single move.
            if waits && !matches!(command.get(..4), Some("M114")) {
                return;
            }
            self.waiting.pop_front();
            self.execute(&command, out);
        }
    }

    fn execute(&mut self, command: &str, out: &mut Vec<u8>) {
        let mut words = command.split_whitespace();
        let code = words.next().unwrap_or_default();
        let values: Vec<(char, f64)> = words
            .filter_map(|w| Some((w.chars().next()?, w.get(1..)?.parse().ok()?)))
            .collect();
        match code {
            "G0" | "G1" => self.plan(&values),
            "G28" => {
                for drive in &mut self.drives {
                    let named = command
                        .split_whitespace()
                        .any(|w| w.starts_with(drive.letter));
                    if named || command == "G28" {
                        // The switch is found whatever was believed.
                        (drive.real, drive.believed, drive.target) = (0.0, 0.0, 0.0);
                    }
                }
            }
            "G92" => {
                for drive in &mut self.drives {
                    if let Some((_, v)) = values.iter().find(|v| v.0 == drive.letter) {
                        (drive.believed, drive.target) = (*v, *v);
                    }
                }
            }
            "M114" => {
                let each: Vec<String> = (self.drives.iter())
                    .map(|d| format!("{}:{:.2} ", d.letter, d.target))
                    .collect();
                let report = each.concat();
                self.answer(&format!("{report}Count X:0 Y:0 Z:0\n"), out);
            }
            _ => {}
        }
        self.answer("ok\n", out);
    }

    fn plan(&mut self, values: &[(char, f64)]) {
        let feed = values.iter().find(|v| v.0 == 'F').map(|v| v.1 / 60.0);
        let stalls = self.chance(self.faults.stall);
        for drive in &mut self.drives {
            let Some((_, to)) = values.iter().find(|v| v.0 == drive.letter) else {
                continue;
            };
            if let Some(feed) = feed {
                drive.speed = feed.max(0.1);
            }
            // Every second step is lost on this way, and it knows nothing of it.
            drive.kept = if stalls { 0.5 } else { 1.0 };
            drive.target = *to;
        }
    }

    /// Lets time pass until `now_us`, and says what there is to say.
    pub fn say(&mut self, now_us: u64, out: &mut Vec<u8>) {
        let seconds = units::seconds_between(self.now_us, now_us);
        self.now_us = now_us;
        if self.halted {
            return;
        }
        for drive in &mut self.drives {
            let way = drive.target - drive.believed;
            let step = way.abs().min(drive.speed * seconds).copysign(way);
            drive.believed = if way.abs() <= drive.speed * seconds {
                drive.target
            } else {
                drive.believed + step
            };
            drive.real += drive.kept * step;
        }
        self.work(out);
        if self.waiting.is_empty() {
            self.busy_us = now_us;
        } else if now_us - self.busy_us > BUSY_US {
            self.busy_us = now_us;
            self.answer("echo:busy: processing\n", out);
        }
    }
}

/// The number and the command of a line whose sum is right.
fn checked(text: &str) -> Option<(u32, &str)> {
    let (body, sum) = text.rsplit_once('*')?;
    let own = body.bytes().fold(0_u8, |sum, byte| sum ^ byte);
    if sum.trim().parse::<u8>() != Ok(own) {
        return None;
    }
    let (number, command) = body.strip_prefix('N')?.split_once(' ')?;
    Some((number.parse().ok()?, command.trim()))
}
