//! Presses out of recordings of the test-bed.

use glam::DVec3;

use super::counted_line::{CountedLine, number};
use crate::bench::SampleMean;
use crate::live::{Input, Receiver};
use crate::wire::Hello;

/// A press that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchPress {
    /// In the plan.
    pub number: usize,
    /// On the limb (m).
    pub at: DVec3,
    /// Before it (counts).
    pub rest: Vec<f64>,
    /// What was read, from the first contact on.
    pub steps: Vec<Depth>,
    /// After it (counts).
    pub after: Vec<f64>,
    /// How hard it was (N), where that was told and not felt.
    pub force: Option<f64>,
    /// What board read it.
    pub board: Option<Hello>,
}

/// A reading at a depth.
#[derive(Clone, Debug, PartialEq)]
pub struct Depth {
    /// From the first contact (m).
    pub below: f64,
    /// On the board's clock (µs).
    pub time_us: u64,
    /// Mean of each channel (counts).
    pub counts: Vec<f64>,
    /// How warm the board was (°C), where it says that.
    pub temperature: Option<f64>,
}

/// All presses that were finished in a recording's bytes, in their order. What was cut off in the middle is none.
#[must_use]
pub fn bench_presses(bytes: &[u8]) -> Vec<BenchPress> {
    let mut scribe = PressScribe::default();
    let mut receiver = Receiver::default();
    receiver.push(bytes, 0, |input| scribe.take(input));
    // Boards say now and then how warm they are: before the first time it was as then.
    let unknown = (scribe.done.iter_mut().flat_map(|p| &mut p.steps))
        .filter(|step| step.temperature.is_none());
    unknown.for_each(|step| step.temperature = scribe.first_temperature);
    scribe.done
}

/// Of a run that presses one place again and again, only what stands between two such presses that were alike is believed.
#[derive(Default)]
struct PressScribe {
    board: Option<Hello>,
    open: Option<BenchPress>,
    /// What is read just now, with when it began.
    reading: Option<(String, SampleMean, u64)>,
    done: Vec<BenchPress>,
    /// Presses since that place was last found to be as at first, where there is such a place.
    doubted: Option<Vec<BenchPress>>,
    /// How warm the board said it is (°C).
    temperature: Option<f64>,
    first_temperature: Option<f64>,
    /// Of a board that prints lines.
    line: CountedLine,
}

impl PressScribe {
    fn take(&mut self, input: Input) {
        match input {
            Input::Hello(hello) => self.board = Some(hello),
            Input::Sample(sample) => self.sample(&sample.counts, sample.time_us),
            Input::Note { text, time_us } => match self.line.take(&text) {
                Some(counts) => self.sample(&counts, time_us),
                None => self.note(&text),
            },
            Input::Log { .. } | Input::Pong(_) => {}
        }
    }

    fn sample(&mut self, counts: &[f64], time_us: u64) {
        if let Some((_, reading, first)) = &mut self.reading {
            if reading.samples() == 0 {
                *first = time_us;
            }
            reading.push(counts);
        }
    }

    fn note(&mut self, text: &str) {
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        match word {
            "press" => self.open = self.begun(rest),
            "read" => self.reading = Some((rest.to_owned(), SampleMean::default(), 0)),
            "end" => self.close(),
            "force" => {
                if let Some(press) = &mut self.open {
                    press.force = rest.parse().ok();
                }
            }
            "temperature" => {
                self.temperature = number(rest);
                self.first_temperature = self.first_temperature.or(self.temperature);
            }
            "again" | "failed" => (self.open, self.reading) = (None, None),
            "pressed" => {
                let whole = |p: &BenchPress| !p.rest.is_empty() && !p.steps.is_empty();
                let to = self.doubted.as_mut().unwrap_or(&mut self.done);
                to.extend(self.open.take().filter(whole));
            }
            "check" => {
                (self.open, self.reading) = (None, None);
                self.doubted.get_or_insert_default();
            }
            "checked" => self.done.append(self.doubted.get_or_insert_default()),
            "moved" => self.doubted = Some(Vec::new()),
            _ => {}
        }
    }

    fn begun(&self, text: &str) -> Option<BenchPress> {
        let mut words = text.split(' ');
        let number = words.next()?.parse().ok()?;
        let mm: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
        let [x, y, z, ..] = mm[..] else { return None };
        Some(BenchPress {
            number,
            at: DVec3::new(x, y, z) * 1e-3,
            rest: Vec::new(),
            steps: Vec::new(),
            after: Vec::new(),
            force: None,
            board: self.board.clone(),
        })
    }

    fn close(&mut self) {
        let (Some(press), Some((what, reading, time_us))) = (&mut self.open, self.reading.take())
        else {
            return;
        };
        if reading.samples() == 0 {
            return;
        }
        let counts = reading.mean();
        match what.split_once(' ') {
            None if what == "rest" => press.rest = counts,
            None if what == "after" => press.after = counts,
            Some(("depth", mm)) => {
                if let Ok(mm) = mm.parse::<f64>() {
                    press.steps.push(Depth {
                        below: mm * 1e-3,
                        time_us,
                        counts,
                        temperature: self.temperature,
                    });
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Recorder;
    use crate::live::Sample;

    /// A board that prints lines has no HELLO, and its samples are notes.
    #[test]
    fn presses_of_a_board_that_prints_lines_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-001.hapdrec");
        let mut recorder = Recorder::create(&path).unwrap();
        let sample = |recorder: &mut Recorder, k: f64| {
            let counts = (0..11).map(|c| 1700.5 + f64::from(c) * k).collect();
            recorder.sample(&Sample { time_us: 7, counts });
        };
        let press = |recorder: &mut Recorder, number: u32, end: &str| {
            recorder.own(&format!("press {number} 1.0 2.0 3.0 1.0 0.0 0.0"));
            for (what, k) in [("rest", 0.0), ("depth 0.1500", 1.0), ("after", 0.0)] {
                recorder.own(&format!("read {what}"));
                (0..3).for_each(|_| sample(recorder, k));
                recorder.own("end");
                sample(recorder, 99.0);
            }
            recorder.own(end);
        };
        press(&mut recorder, 4, "pressed 4");
        press(&mut recorder, 5, "failed 5 nothing was felt");
        press(&mut recorder, 6, "read");
        recorder.flush();
        let presses = bench_presses(&std::fs::read(&path).unwrap());
        assert_eq!(presses.len(), 1);
        let press = &presses[0];
        assert_eq!((press.number, press.at), (4, DVec3::new(1e-3, 2e-3, 3e-3)));
        assert_eq!(
            (press.rest[10], press.steps[0].counts[10]),
            (1700.5, 1710.5)
        );
        assert!((press.steps[0].below - 0.15e-3).abs() < 1e-12);
    }

    /// A machine that lost steps does not say so: what it pressed since its limb last answered as at first is left out.
    #[test]
    fn presses_that_were_not_checked_are_not_believed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part-001.hapdrec");
        let mut recorder = Recorder::create(&path).unwrap();
        let place = "1.0 2.0 3.0 1.0 0.0 0.0";
        let press = |recorder: &mut Recorder, what: &str, end: &str| {
            recorder.own(&format!("{what} {place}"));
            for what in ["rest", "depth 0.1500", "after"] {
                recorder.own(&format!("read {what}"));
                let counts = vec![1700.5; 11];
                recorder.sample(&Sample { time_us: 7, counts });
                recorder.own("end");
            }
            recorder.own(end);
        };
        press(&mut recorder, "check", "checked");
        press(&mut recorder, "press 0", "pressed 0");
        press(&mut recorder, "check", "checked");
        press(&mut recorder, "press 1", "pressed 1");
        press(&mut recorder, "check", "moved the tip meets it later");
        press(&mut recorder, "check", "checked");
        press(&mut recorder, "press 2", "pressed 2");
        press(&mut recorder, "check", "checked");
        press(&mut recorder, "press 3", "pressed 3");
        recorder.flush();
        let presses = bench_presses(&std::fs::read(&path).unwrap());
        let numbers: Vec<usize> = presses.iter().map(|p| p.number).collect();
        assert_eq!(numbers, [0, 2]);
    }
}
