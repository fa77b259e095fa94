//! Progress on stderr: a bar on a terminal; where there is none, a line for each stage.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::out;
use crate::budget::Progress;

/// A bar, or lines, that follow the stages of a run.
pub struct Bar {
    drawn: ProgressBar,
    stage: Mutex<&'static str>,
    /// Absent on a terminal.
    lines: Option<Mutex<LogLines>>,
}

impl Default for Bar {
    fn default() -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if terminal {
            ProgressDrawTarget::stderr_with_hz(10)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) =
            ProgressStyle::with_template("{msg:<28} {wide_bar} {percent:>3} %  {elapsed}")
        {
            bar.set_style(style);
        }
        Self {
            drawn: bar,
            stage: Mutex::new(""),
            lines: (!terminal).then(|| Mutex::new(LogLines::default())),
        }
    }
}

impl Bar {
    /// Shows one report; never asks for a stop.
    pub fn show(&self, progress: Progress) -> ControlFlow<()> {
        if let Some(lines) = &self.lines {
            let line = (lines.lock().ok()).and_then(|mut l| l.of(progress, Instant::now()));
            if let Some(line) = line {
                out::say(&line);
            }
            return ControlFlow::Continue(());
        }
        if let Ok(mut stage) = self.stage.lock()
            && *stage != progress.stage
        {
            *stage = progress.stage;
            self.drawn.set_message(progress.stage);
        }
        self.drawn.set_length(progress.total.max(1) as u64);
        self.drawn.set_position(progress.done as u64);
        ControlFlow::Continue(())
    }

    /// Takes the bar off the terminal.
    pub fn finish(&self) {
        self.drawn.finish_and_clear();
    }
}

/// Which reports become lines of a log: the first of every stage, and of a long one some more.
#[derive(Default)]
struct LogLines {
    last: Option<(&'static str, Instant)>,
    seen: Vec<&'static str>,
}

impl LogLines {
    /// Between two lines of one stage, and before a stage that was there already speaks again.
    const PAUSE: Duration = Duration::from_secs(15);

    fn of(&mut self, progress: Progress, now: Instant) -> Option<String> {
        let stage = progress.stage;
        let first = !self.seen.contains(&stage);
        let rested = |(_, at): (&str, Instant)| now.duration_since(at) >= Self::PAUSE;
        if !first && !self.last.is_none_or(rested) {
            return None;
        }
        if first {
            self.seen.push(stage);
        }
        self.last = Some((stage, now));
        let percent = 100 * progress.done / progress.total.max(1);
        Some(if percent == 0 {
            format!("{stage} …")
        } else {
            format!("{stage} … {percent} %")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_for_each_stage_and_now_and_then_one_more() {
        let mut lines = LogLines::default();
        let start = Instant::now();
        let mut at = |stage, done, seconds| {
            let progress = Progress {
                stage,
                done,
                total: 200,
            };
            lines.of(progress, start + Duration::from_secs(seconds))
        };
        assert_eq!(at("Meshing", 0, 0).as_deref(), Some("Meshing …"));
        assert_eq!(at("Meshing", 50, 1), None);
        assert_eq!(at("Solving", 0, 2).as_deref(), Some("Solving …"));
        assert_eq!(at("Meshing", 60, 3), None, "two stages in turns");
        assert_eq!(at("Solving", 100, 18).as_deref(), Some("Solving … 50 %"));
    }
}
