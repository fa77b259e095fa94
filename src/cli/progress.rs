//! Progress bars on a terminal's stderr; silence where there is none.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::budget::Progress;

/// A bar that follows the stages of a run.
pub struct Bar {
    bar: ProgressBar,
    stage: Mutex<&'static str>,
}

impl Default for Bar {
    fn default() -> Self {
        let target = if std::io::stderr().is_terminal() {
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
            bar,
            stage: Mutex::new(""),
        }
    }
}

impl Bar {
    /// Shows one report; never asks for a stop.
    pub fn show(&self, progress: Progress) -> ControlFlow<()> {
        if let Ok(mut stage) = self.stage.lock()
            && *stage != progress.stage
        {
            *stage = progress.stage;
            self.bar.set_message(progress.stage);
        }
        self.bar.set_length(progress.total.max(1) as u64);
        self.bar.set_position(progress.done as u64);
        ControlFlow::Continue(())
    }

    /// Takes the bar off the terminal.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
