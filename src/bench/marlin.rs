//! The line protocol of Marlin: numbered lines with checksums, one at a time, sent again until they surely came through.
//!
//! Every line is `N<number> <command>*<sum>`, the sum being the exclusive or of all bytes before the star. The machine answers
//! `ok`, or `Resend: <number>` for the line that it wants next. Answers get lost as lines do: where a line is sent again that
//! had come through, the machine asks for the one behind it, and that is taken for its `ok`.

use std::collections::VecDeque;

/// Lines that can be sent again after others have followed.
const KEPT: usize = 16;
/// Microseconds without a word after which a line is sent again.
const PATIENCE: u64 = 4_000_000;
/// How often a line is sent in all.
const TRIES: u32 = 5;
/// The longest line that is looked at.
const LONGEST: usize = 512;

/// What came of listening.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MachineReply {
    /// The line came through, and this was said meanwhile.
    Done(Vec<String>),
    /// The machine has begun anew: it knows no longer where it is.
    Restarted,
    /// It will not go on; why, in its words or ours.
    Failed(String),
}

/// A line that is on its way.
#[derive(Clone, Debug)]
struct Sent {
    number: u32,
    bytes: Vec<u8>,
    since_us: u64,
    patience_us: u64,
    tries: u32,
}

/// One end of the line to a machine.
#[derive(Clone, Debug, Default)]
pub struct Marlin {
    /// Of the line that was sent last.
    number: u32,
    sent: Option<Sent>,
    /// The last lines, with their numbers: an answer that was damaged may have passed for another.
    before: VecDeque<(u32, Vec<u8>)>,
    /// Of the line that comes in.
    open: Vec<u8>,
    said: Vec<String>,
    /// Answers that belong to a line that was asked for again.
    stale: u32,
    /// Lines that were sent again.
    pub resent: u32,
}

impl Marlin {
    /// Whether a line may be sent.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.sent.is_none()
    }

    /// Begins counting lines anew, on both sides.
    pub fn begin(&mut self, now_us: u64, out: &mut Vec<u8>) {
        let resent = self.resent;
        *self = Self {
            resent,
            ..Self::default()
        };
        // What the machine may have of a line that was cut off ends here.
        out.push(b'\n');
        self.put("M110 N0", 0, 0, now_us, out);
    }

    /// Sends a command that may take so long (µs) before it is answered. To be called when idle.
    pub fn order(&mut self, command: &str, takes_us: u64, now_us: u64, out: &mut Vec<u8>) {
        self.number += 1;
        self.put(command, self.number, takes_us, now_us, out);
    }

    /// Sends a command that the machine looks for in what comes in, past all that waits: without a number, and without an
    /// answer.
    pub fn shout(command: &str, out: &mut Vec<u8>) {
        out.extend_from_slice(command.as_bytes());
        out.push(b'\n');
    }

    /// Whatever is on its way is forgotten: the machine was told to drop all that it has.
    pub fn forget(&mut self) {
        self.sent = None;
        self.said.clear();
    }

    fn put(&mut self, command: &str, number: u32, takes_us: u64, now_us: u64, out: &mut Vec<u8>) {
        let bytes = line(number, command);
        out.extend_from_slice(&bytes);
        self.said.clear();
        self.before.push_back((number, bytes.clone()));
        if self.before.len() > KEPT {
            self.before.pop_front();
        }
        self.sent = Some(Sent {
            number,
            bytes,
            since_us: now_us,
            patience_us: PATIENCE + takes_us,
            tries: 1,
        });
    }

    /// Takes in what the machine says.
    pub fn push(&mut self, bytes: &[u8], now_us: u64, out: &mut Vec<u8>) -> Vec<MachineReply> {
        let mut replies = Vec::new();
        for &byte in bytes {
            if byte != b'\n' && byte != b'\r' {
                if self.open.len() < LONGEST {
                    self.open.push(byte);
                }
                continue;
            }
            let text = String::from_utf8_lossy(&self.open).trim().to_owned();
            self.open.clear();
            if !text.is_empty() {
                replies.extend(self.take(&text, now_us, out));
            }
        }
        replies
    }

    fn take(&mut self, text: &str, now_us: u64, out: &mut Vec<u8>) -> Option<MachineReply> {
        let lower = text.to_ascii_lowercase();
        if lower == "start" {
            self.sent = None;
            return Some(MachineReply::Restarted);
        }
        if let Some(number) = wanted(&lower) {
            return self.resend(number, now_us, out);
        }
        if lower == "ok" || lower.starts_with("ok ") {
            return self.ok(text);
        }
        if lower.starts_with("echo:busy") || lower.starts_with("busy:") {
            if let Some(sent) = &mut self.sent {
                sent.since_us = now_us;
            }
            return None;
        }
        if lower.starts_with("error:") || lower.starts_with("!!") {
            // “Line Number is not Last Line Number+1”, “expected line 106 got 105”, “Missing checksum”: what follows asks again.
            let of_lines = ["line", "checksum"];
            if !of_lines.iter().any(|what| lower.contains(what)) {
                self.sent = None;
                return Some(MachineReply::Failed(format!(
                    "it says {}",
                    crate::plain::quote(text)
                )));
            }
            return None;
        }
        self.said.push(text.to_owned());
        None
    }

    fn ok(&mut self, text: &str) -> Option<MachineReply> {
        // What stands behind it may be a report.
        if text.len() > 2 {
            self.said.push(text[2..].trim().to_owned());
        }
        if self.stale > 0 {
            self.stale -= 1;
            return None;
        }
        self.sent.take()?;
        Some(MachineReply::Done(std::mem::take(&mut self.said)))
    }

    /// The machine wants a line again, or the one behind it: then it has this one.
    fn resend(&mut self, number: u32, now_us: u64, out: &mut Vec<u8>) -> Option<MachineReply> {
        let sent = self.sent.as_mut()?;
        // A resend is closed by an answer of its own.
        self.stale += 1;
        if number == sent.number {
            return self.again(now_us, out);
        }
        if number == sent.number + 1 {
            self.sent = None;
            return Some(MachineReply::Done(std::mem::take(&mut self.said)));
        }
        // An ok that was of a line that it refused: that one and those behind it are sent in their order.
        if let Some(k) = self.before.iter().position(|(n, _)| *n == number) {
            let behind = self.before.len() - 1 - k;
            self.stale += behind as u32;
            let earlier: Vec<u8> = (self.before.iter().skip(k).take(behind))
                .flat_map(|(_, line)| line.iter().copied())
                .collect();
            out.extend(earlier);
            return self.again(now_us, out);
        }
        // A number that was damaged itself, or, when it comes again, a machine that counts otherwise: it is told where it is.
        // Lines say where to, not how far, so one that it had already does no harm.
        if sent.tries > 1 {
            let last = sent.number.saturating_sub(1);
            self.stale += 1;
            out.extend_from_slice(&line(last, &format!("M110 N{last}")));
        }
        self.again(now_us, out)
    }

    fn again(&mut self, now_us: u64, out: &mut Vec<u8>) -> Option<MachineReply> {
        let sent = self.sent.as_mut()?;
        if sent.tries >= TRIES {
            let tries = sent.tries;
            self.sent = None;
            return Some(MachineReply::Failed(format!(
                "a line was sent {tries} times, and never came through"
            )));
        }
        sent.tries += 1;
        sent.since_us = now_us;
        self.resent += 1;
        out.extend_from_slice(&sent.bytes);
        None
    }

    /// Sends again what was never answered. Answers of both may come then.
    pub fn look(&mut self, now_us: u64, out: &mut Vec<u8>) -> Option<MachineReply> {
        let sent = self.sent.as_ref()?;
        if now_us.saturating_sub(sent.since_us) < sent.patience_us {
            return None;
        }
        self.stale = 0;
        // What is left of a line that was cut off must not join this one.
        out.push(b'\n');
        self.again(now_us, out)
    }
}

/// A line with its number and checksum.
fn line(number: u32, command: &str) -> Vec<u8> {
    let text = format!("N{number} {command}");
    let sum = text.bytes().fold(0_u8, |sum, byte| sum ^ byte);
    format!("{text}*{sum}\n").into_bytes()
}

/// The line that a machine wants again.
fn wanted(lower: &str) -> Option<u32> {
    let rest = lower.strip_prefix("resend").or(lower.strip_prefix("rs "))?;
    let digits: String = rest
        .chars()
        .skip_while(|c| !c.is_ascii_digit())
        .take_while(char::is_ascii_digit)
        .collect();
    digits.parse().ok()
}

/// Where a machine says that an axis is: of the first report (`X:1.00 Y:2.00 … Count …`) that names it.
#[must_use]
pub fn position_in(said: &[String], axis: char) -> Option<f64> {
    said.iter().rev().find_map(|line| {
        // Behind it are steps of motors.
        let report = line.split("Count").next()?;
        let at = report.find(&format!("{axis}:"))?;
        let text: String = report[at + 2..]
            .trim_start()
            .chars()
            .take_while(|c| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'))
            .collect();
        text.parse().ok().filter(|v: &f64| v.is_finite())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(said: &[&str]) -> MachineReply {
        MachineReply::Done(said.iter().map(|s| (*s).to_owned()).collect())
    }

    /// A machine whose first line has been taken.
    fn begun() -> Marlin {
        let (mut marlin, mut out) = (Marlin::default(), Vec::new());
        marlin.begin(0, &mut out);
        assert_eq!(out, b"\nN0 M110 N0*125\n");
        assert_eq!(marlin.push(b"ok\n", 0, &mut out), [done(&[])]);
        marlin
    }

    #[test]
    fn a_line_is_numbered_and_summed_as_the_firmware_does() {
        // From Marlin's own documentation of M110 and of checksums.
        assert_eq!(line(3, "T0"), b"N3 T0*57\n");
        assert_eq!(line(4, "G92 E0"), b"N4 G92 E0*67\n");
    }

    #[test]
    fn what_is_asked_for_again_is_sent_again_and_its_own_ok_is_no_answer() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        let sent = std::mem::take(&mut out);
        let garbled = b"Error:checksum mismatch, Last Line: 0\nResend: 1\nok\n";
        assert_eq!(marlin.push(garbled, 0, &mut out), []);
        assert_eq!((out.clone(), marlin.is_idle()), (sent, false));
        assert_eq!(marlin.push(b"ok P15 B3\n", 0, &mut out).len(), 1);
        assert_eq!(marlin.resent, 1);
    }

    #[test]
    fn a_machine_that_counts_otherwise_is_told_where_it_is() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        let sent = std::mem::take(&mut out);
        let asks = b"Error: expected line 359 got 1\nResend:359\nok\n";
        assert_eq!(marlin.push(asks, 0, &mut out), []);
        assert_eq!(std::mem::take(&mut out), sent);
        assert_eq!(marlin.push(asks, 0, &mut out), []);
        assert_eq!(out, [line(0, "M110 N0"), sent].concat());
        // Its answer to that is none to the line.
        assert_eq!(marlin.push(b"ok\n", 0, &mut out), []);
        assert_eq!(marlin.push(b"ok\n", 0, &mut out), [done(&[])]);
    }

    /// As `OctoPrint`'s virtual printer says it.
    #[test]
    fn complaints_of_lines_in_other_words_are_no_end() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        let refused = b"Error: Missing checksum\nResend:1\nok\n";
        assert_eq!(marlin.push(refused, 0, &mut out), []);
        let had = b"Error: expected line 2 got 1\nResend:2\nok\n";
        assert_eq!(marlin.push(had, 0, &mut out), [done(&[])]);
    }

    #[test]
    fn an_ok_that_was_lost_is_known_by_what_is_wanted_next() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        assert_eq!(marlin.look(PATIENCE - 1, &mut out), None);
        out.clear();
        assert_eq!(marlin.look(PATIENCE, &mut out), None);
        assert_eq!(out, [b"\n".as_slice(), &line(1, "G1 X1")].concat());
        let replies = marlin.push(b"Resend: 2\nok\n", PATIENCE, &mut out);
        assert_eq!(replies, [done(&[])]);
        marlin.order("G1 X2", 0, PATIENCE, &mut out);
        assert_eq!(marlin.push(b"ok\n", PATIENCE, &mut out), [done(&[])]);
    }

    #[test]
    fn a_line_that_was_refused_while_its_answer_passed_for_an_ok_is_sent_before_the_next() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        let first = std::mem::take(&mut out);
        // “Resend: 1” was damaged on its way.
        marlin.push(b"R?send: 1\nok\n", 0, &mut out);
        marlin.order("M400", 0, 0, &mut out);
        let second = std::mem::take(&mut out);
        let replies = marlin.push(b"Resend: 1\nok\nok\n", 0, &mut out);
        assert_eq!((replies, out.clone()), (vec![], [first, second].concat()));
        assert_eq!(marlin.push(b"ok\n", 0, &mut out), [done(&[])]);
    }

    #[test]
    fn a_machine_that_is_busy_is_waited_for_and_one_that_is_dumb_is_not() {
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("M400", 0, 0, &mut out);
        let mut now = 0;
        for _ in 0..10 {
            now += PATIENCE - 1;
            assert_eq!(marlin.look(now, &mut out), None);
            marlin.push(b"echo:busy: processing\n", now, &mut out);
        }
        let ended = (1..10).find_map(|k| marlin.look(now + k * PATIENCE, &mut out));
        assert!(
            matches!(ended, Some(MachineReply::Failed(why)) if why.contains("never came through"))
        );
    }

    #[test]
    fn a_restart_a_halt_and_a_foreign_line_are_told() {
        for (said, part) in [
            (
                "Error:Printer halted. kill() called!\n".to_owned(),
                "Printer halted",
            ),
            ("Resend: 77\n".repeat(5), "never came through"),
        ] {
            let (mut marlin, mut out) = (begun(), Vec::new());
            marlin.order("G1 X1", 0, 0, &mut out);
            let replies = marlin.push(said.as_bytes(), 0, &mut out);
            assert!(matches!(&replies[..], [MachineReply::Failed(why)] if why.contains(part)));
        }
        let (mut marlin, mut out) = (begun(), Vec::new());
        marlin.order("G1 X1", 0, 0, &mut out);
        let replies = marlin.push(b"start\necho: Marlin 2.1\n", 0, &mut out);
        assert_eq!(replies, [MachineReply::Restarted]);
    }

    #[test]
    fn positions_are_found_in_reports_of_several_firmwares() {
        let said = |text: &str| vec!["echo:x".to_owned(), text.to_owned()];
        for text in [
            "X:12.50 Y:0.00 Z:-3.25 E:90.00 Count X:1000 Y:0 Z:-1300",
            "C: X:12.50 Y:0.00 Z:-3.25 E:90.00 Count A:1 B:2 C:3",
            "X: 12.5000 Y: 0 Z: -3.25 A:0.00 E: 90 Count X: 1 Y: 2 Z: 3",
        ] {
            let report = said(text);
            let at = ['X', 'Z', 'E'].map(|axis| position_in(&report, axis));
            assert_eq!(at, [Some(12.5), Some(-3.25), Some(90.0)], "{text}");
        }
        assert_eq!(position_in(&said("X:nan"), 'X'), None);
    }
}
