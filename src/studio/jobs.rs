//! What is computed in the background: several at once, each with its progress, and how those before ended.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{RichText, Ui};

use super::{Studio, quality_name, theme};
use crate::budget::Quality;
use crate::job::{Job, Outcome, Reporter, Stop};

use super::drive::Finished;

/// What a job is for. One of a kind runs at a time: starting another ends the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    Simulate(Quality),
    Filter,
    Design(Quality),
    Export,
    Open,
    /// How gauges put by hand do, quickly and truly.
    Estimate,
    /// Shell or solid.
    Advise,
    /// Speed against accuracy.
    Trade,
    Judge,
    /// What moves of gauges are asked of.
    Expect,
    /// The gauge that helps most, or least.
    Help,
    /// Touches that are taken for each other.
    Confuse,
    /// A field that takes a while.
    Field,
    Measure,
    Picture,
    Save,
    /// Of the live stage: the model of the gauges, a simulated board, the trained estimators, a calibration.
    Sense,
    Board,
    Train,
    Calibrate,
    Table,
}

impl Task {
    #[must_use]
    pub fn name(self) -> String {
        let at = |what: &str, quality: Quality| {
            format!("{what} ({})", quality_name(quality).to_lowercase())
        };
        match self {
            Self::Simulate(quality) => at("Simulate", quality),
            Self::Design(quality) => at("Select gauges", quality),
            Self::Filter => "Filter the sites".into(),
            Self::Export => "Export the report".into(),
            Self::Open => "Open".into(),
            Self::Estimate => "Estimate the error".into(),
            Self::Judge => "Judge the gauges".into(),
            Self::Expect => "Prepare the expected error".into(),
            Self::Help => "Look for a gauge".into(),
            Self::Confuse => "Look for confusions".into(),
            Self::Advise => "Measure the walls".into(),
            Self::Trade => "Measure the trade".into(),
            Self::Field => "Compute the field".into(),
            Self::Measure => "Measure".into(),
            Self::Picture => "Save the picture".into(),
            Self::Save => "Save".into(),
            Self::Sense => "Model the gauges".into(),
            Self::Board => "Make a simulated board".into(),
            Self::Train => "Train the estimators".into(),
            Self::Calibrate => "Calibrate".into(),
            Self::Table => "Write the table".into(),
        }
    }

    /// Whether it writes a file, and is not ended on the way.
    fn writes(self) -> bool {
        matches!(
            self,
            Self::Export | Self::Picture | Self::Save | Self::Table
        )
    }

    /// Whether it is over before anybody needs to hear of it.
    fn is_quiet(self) -> bool {
        matches!(
            self,
            Self::Filter
                | Self::Open
                | Self::Estimate
                | Self::Advise
                | Self::Expect
                | Self::Confuse
                | Self::Field
                | Self::Measure
                | Self::Save
        )
    }
}

pub(super) struct Running {
    pub task: Task,
    pub job: Job<Finished>,
    /// When its current step began, and which one that is.
    step: (&'static str, Instant),
}

impl Running {
    /// The step that it is at, and how much of that is done.
    pub fn progress(&self) -> (&'static str, f32) {
        let progress = self.job.progress();
        progress.map_or(("Starting", 0.0), |p| {
            (p.stage, p.done as f32 / p.total.max(1) as f32)
        })
    }

    /// What the bar says: the step, its share and about how long it still takes.
    fn in_words(&self) -> String {
        /// Before this nobody can tell how long it will take.
        const KNOWN: f32 = 0.04;
        let (step, share) = self.progress();
        let elapsed = self.job.elapsed().as_secs();
        let mut text = format!("{step}  {:.0} %  ·  {elapsed} s", 100.0 * share);
        if step == self.step.0 && share > KNOWN && share < 1.0 {
            let left = self.step.1.elapsed().as_secs_f32() * (1.0 - share) / share;
            let _ = write!(text, ", about {} left", duration(left));
        }
        text
    }
}

/// Seconds as people say them.
pub(super) fn duration(seconds: f32) -> String {
    if seconds < 90.0 {
        format!("{:.0} s", seconds.max(1.0))
    } else {
        format!("{:.0} min", seconds / 60.0)
    }
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    pub name: String,
    pub how: String,
    pub failed: bool,
    pub took: Duration,
}

/// Everything that runs and the last of what has run.
#[derive(Default)]
pub(super) struct Jobs {
    pub running: Vec<Running>,
    pub ended: Vec<Ended>,
}

impl Jobs {
    /// How many that have ended are remembered.
    const MEMORY: usize = 50;

    pub fn start(
        &mut self,
        ctx: &egui::Context,
        task: Task,
        key: String,
        work: impl FnOnce(&Reporter) -> Result<Finished, Stop> + Send + 'static,
    ) {
        self.cancel(|t| std::mem::discriminant(&t) == std::mem::discriminant(&task));
        let ctx = ctx.clone();
        let wake = move || ctx.request_repaint_after(Duration::from_millis(16));
        self.running.push(Running {
            task,
            job: Job::start(&task.name(), key, wake, work),
            step: ("", Instant::now()),
        });
    }

    pub fn runs(&self, task: Task) -> bool {
        self.running.iter().any(|r| r.task == task)
    }

    /// Ends jobs at once: what they still bring is dropped, and they stop at their next report.
    pub fn cancel(&mut self, which: impl Fn(Task) -> bool) -> Vec<(Task, String)> {
        let (gone, kept): (Vec<Running>, Vec<Running>) = self
            .running
            .drain(..)
            .partition(|r| which(r.task) && !r.task.writes());
        self.running = kept;
        for r in &gone {
            r.job.cancel();
            if !r.task.is_quiet() {
                self.remember(r, "cancelled".into(), false);
            }
        }
        gone.into_iter().map(|r| (r.task, r.job.key)).collect()
    }

    fn remember(&mut self, r: &Running, how: String, failed: bool) {
        self.ended.push(Ended {
            name: r.job.name.clone(),
            how,
            failed,
            took: r.job.elapsed(),
        });
        if self.ended.len() > Self::MEMORY {
            self.ended.remove(0);
        }
    }

    /// Those that have ended since the last call.
    pub fn collect(&mut self) -> Vec<(Task, String, Outcome<Finished>)> {
        let mut out = Vec::new();
        let mut k = 0;
        while k < self.running.len() {
            let running = &mut self.running[k];
            let step = running.progress().0;
            if running.step.0 != step {
                running.step = (step, Instant::now());
            }
            match running.job.poll() {
                None => k += 1,
                Some(outcome) => {
                    let r = self.running.remove(k);
                    match &outcome {
                        Outcome::Done(_) if r.task.is_quiet() => {}
                        Outcome::Done(_) => self.remember(&r, "done".into(), false),
                        Outcome::Failed(message) => self.remember(&r, message.clone(), true),
                        Outcome::Cancelled => self.remember(&r, "cancelled".into(), false),
                    }
                    out.push((r.task, r.job.key, outcome));
                }
            }
        }
        out
    }
}

impl Studio {
    /// One line for each running job.
    pub(super) fn running_jobs(&mut self, ui: &mut Ui) {
        let mut cancel = None;
        for r in self.jobs.running.iter().filter(|r| !r.task.is_quiet()) {
            ui.horizontal(|ui| {
                let width = (ui.available_width() - 110.0).max(80.0);
                ui.add_sized(
                    [170.0, ui.spacing().interact_size.y],
                    egui::Label::new(&r.job.name).truncate(),
                );
                let bar = egui::ProgressBar::new(r.progress().1)
                    .text(r.in_words())
                    .desired_width((width - 180.0).max(60.0));
                ui.add(bar);
                let name = format!("Cancel: {}", r.job.name);
                let button = ui.add_enabled(!r.task.writes(), egui::Button::new("Cancel"));
                let button = button.on_disabled_hover_text("A file is being written");
                if button.accessible_name(name).clicked() {
                    cancel = Some(r.task);
                }
            });
            ui.ctx().request_repaint_after(Duration::from_millis(100));
        }
        if let Some(task) = cancel {
            self.end_jobs(|t| t == task);
        }
    }

    /// The tab: what runs, and how those before ended.
    pub(super) fn jobs_tab(&mut self, ui: &mut Ui) {
        let idle = self.jobs.running.iter().all(|r| r.task.is_quiet());
        if idle && self.jobs.ended.is_empty() {
            super::results::empty(
                ui,
                "Nothing was computed yet. Press “Simulate” or “Select gauges”",
            );
            return;
        }
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                self.running_jobs(ui);
                egui::Grid::new("ended jobs")
                    .num_columns(3)
                    .striped(true)
                    .spacing([18.0, 3.0])
                    .show(ui, |ui| {
                        for ended in self.jobs.ended.iter().rev() {
                            ui.label(&ended.name);
                            ui.monospace(format!("{:7.1} s", ended.took.as_secs_f64()));
                            let text = RichText::new(&ended.how);
                            ui.label(if ended.failed {
                                text.color(theme::ERROR)
                            } else {
                                text.weak()
                            });
                            ui.end_row();
                        }
                    });
            });
    }

    /// How the jobs that have ended did so, the latest last.
    #[must_use]
    pub fn ended_jobs(&self) -> &[Ended] {
        &self.jobs.ended
    }
}

/// What several threads share of a running design.
pub(super) type Shared<T> = Arc<std::sync::Mutex<T>>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Progress;

    fn endless(r: &Reporter) -> Result<Finished, Stop> {
        loop {
            let p = Progress {
                stage: "Turning",
                done: 1,
                total: 2,
            };
            if r.report(p).is_break() {
                return Err(Stop::Cancelled);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn several_run_at_once_and_one_of_a_kind() {
        let ctx = egui::Context::default();
        let mut jobs = Jobs::default();
        jobs.start(&ctx, Task::Simulate(Quality::Draft), "a".into(), endless);
        jobs.start(&ctx, Task::Design(Quality::Draft), "b".into(), endless);
        assert_eq!(jobs.running.len(), 2);
        jobs.start(&ctx, Task::Simulate(Quality::Standard), "c".into(), endless);
        assert_eq!(jobs.running.len(), 2);
        assert!(jobs.runs(Task::Simulate(Quality::Standard)));
        // Gone at once, whatever the thread still does.
        assert_eq!(jobs.cancel(|_| true).len(), 2);
        assert!(jobs.running.is_empty() && jobs.collect().is_empty());
        assert!(jobs.ended.iter().all(|e| e.how == "cancelled"));
    }

    #[test]
    fn a_panic_ends_as_a_message() {
        let ctx = egui::Context::default();
        let mut jobs = Jobs::default();
        let task = Task::Design(Quality::Draft);
        jobs.start(&ctx, task, "k".into(), |_| panic!("over a stone"));
        let ended = loop {
            let ended = jobs.collect();
            if !ended.is_empty() {
                break ended;
            }
        };
        assert!(
            matches!(&ended[0], (t, k, Outcome::Failed(m)) if *t == task && k == "k" && m.contains("stone"))
        );
        assert!(jobs.ended[0].failed);
    }
}
