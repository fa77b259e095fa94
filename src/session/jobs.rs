//! What is computed in the background: several at once, each with its progress, what is done with what it brings, and how
//! those before ended.

use std::any::Any;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use super::wake::Wake;
use crate::budget::Quality;
use crate::design::DesignError;
use crate::job::{self, Job, Reporter, Stop};

/// Between two pictures: a report is seen in the next one.
const FRAME: Duration = Duration::from_millis(16);

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
    /// What presses the gauges.
    Jig,
    Measure,
    Picture,
    Save,
    /// Of the live stage: the model of the gauges, a simulated board, the trained estimators, a calibration.
    Sense,
    Board,
    Train,
    Calibrate,
    /// Whether known touches fit each other.
    CheckKnown,
    Table,
    Messages,
    /// Touches for others, at an address.
    Serve,
    /// Of the test-bed: a plan, and going through it.
    PlanPresses,
    Press,
    /// What presses teach, and an estimator that is read.
    Learn,
    OpenEstimator,
    /// Of a parameter study: its results, and the limb of a unit.
    OpenStudy,
    UnitLimb,
}

impl Task {
    #[must_use]
    pub fn name(self) -> String {
        let at =
            |what: &str, quality: Quality| format!("{what} ({})", quality.title().to_lowercase());
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
            Self::Jig => "Plan the jig".into(),
            Self::Measure => "Measure".into(),
            Self::Picture => "Save the picture".into(),
            Self::Save => "Save".into(),
            Self::Sense => "Model the gauges".into(),
            Self::Board => "Make a simulated board".into(),
            Self::Train => "Train the estimators".into(),
            Self::Calibrate => "Calibrate".into(),
            Self::CheckKnown => "Check the known touches".into(),
            Self::Table => "Write the table".into(),
            Self::Messages => "Write the messages".into(),
            Self::Serve => "Serve touches".into(),
            Self::PlanPresses => "Plan the presses".into(),
            Self::Press => "Press the limb".into(),
            Self::Learn => "Learn from the presses".into(),
            Self::OpenEstimator => "Open the estimator".into(),
            Self::OpenStudy => "Open the study".into(),
            Self::UnitLimb => "Make the limb of a unit".into(),
        }
    }

    /// Whether it writes a file, that is there whatever has changed since.
    #[must_use]
    pub fn writes(self) -> bool {
        self.is_not_ended() || matches!(self, Self::Table | Self::Messages)
    }

    /// Whether it is not ended on the way.
    #[must_use]
    pub fn is_not_ended(self) -> bool {
        matches!(self, Self::Export | Self::Picture | Self::Save)
    }

    /// Whether it is a step towards the goal that is kept computed.
    #[must_use]
    pub fn is_of_pipeline(self) -> bool {
        matches!(self, Self::Simulate(_) | Self::Design(_))
    }

    /// Whether it is over before anybody needs to hear of it.
    #[must_use]
    pub fn is_quiet(self) -> bool {
        matches!(
            self,
            Self::Filter
                | Self::Open
                | Self::Estimate
                | Self::Advise
                | Self::Expect
                | Self::Confuse
                | Self::CheckKnown
                | Self::Field
                | Self::UnitLimb
                | Self::Measure
                | Self::Save
                | Self::Serve
        )
    }
}

/// What is done with what a job brought.
type Finish<S> = Box<dyn FnOnce(&mut S) + Send>;

/// A job that runs.
pub struct Running<S> {
    pub task: Task,
    /// What it was started on.
    inputs: Box<dyn Any + Send>,
    /// The session it was started in, by its number.
    session: u64,
    job: Job<Finish<S>>,
    /// When its current step began, and which one that is.
    step: (&'static str, Instant),
}

impl<S: 'static> Running<S> {
    #[must_use]
    pub fn name(&self) -> &str {
        &self.job.name
    }

    /// Whether it was started on these inputs.
    #[must_use]
    pub fn is_on<I: PartialEq + 'static>(&self, inputs: &I) -> bool {
        self.inputs.downcast_ref::<I>() == Some(inputs)
    }

    /// The step that it is at, and how much of that is done.
    #[must_use]
    pub fn progress(&self) -> (&'static str, f32) {
        let progress = self.job.progress();
        progress.map_or(("Starting", 0.0), |p| {
            (p.stage, p.done as f32 / p.total.max(1) as f32)
        })
    }

    /// What the bar says: the step, its share and about how long it still takes.
    #[must_use]
    pub fn in_words(&self) -> String {
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

/// A stage's error as a job's end.
pub(super) fn stop(error: &DesignError) -> Stop {
    if error.is_cancelled() {
        Stop::Cancelled
    } else {
        Stop::Failed(error.to_string())
    }
}

/// Seconds as people say them.
#[must_use]
pub fn duration(seconds: f32) -> String {
    if seconds < 90.0 {
        format!("{:.0} s", seconds.max(1.0))
    } else {
        format!("{:.0} min", seconds / 60.0)
    }
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq)]
pub struct JobEnd {
    pub name: String,
    pub how: String,
    pub failed: bool,
    pub took: Duration,
}

/// What could not be computed, from which inputs, and why.
struct Failure {
    task: Task,
    inputs: Box<dyn Any + Send>,
    message: String,
}

/// A job that has ended: what is to be done, or why it cannot be.
pub(super) struct EndedJob<S> {
    pub task: Task,
    pub session: u64,
    pub inputs: Box<dyn Any + Send>,
    pub result: job::Outcome<Finish<S>>,
}

/// Everything that runs, the last of what has run, and what could not be computed, for an owner of this type.
pub struct Jobs<S> {
    running: Vec<Running<S>>,
    ended: Vec<JobEnd>,
    failed: Vec<Failure>,
    wake: Wake,
    /// The session that jobs are started in.
    session: u64,
}

impl<S: 'static> Jobs<S> {
    /// How many that have ended are remembered.
    const MEMORY: usize = 50;

    pub(super) fn new(wake: Wake) -> Self {
        Self {
            running: Vec::new(),
            ended: Vec::new(),
            failed: Vec::new(),
            wake,
            session: 0,
        }
    }

    /// As they are for another session: what writes a file goes on, and what has ended stays to be read.
    pub(super) fn for_another_session(mut self) -> Self {
        self.cancel(|task| !task.writes());
        Self {
            session: self.session + 1,
            failed: Vec::new(),
            ..self
        }
    }

    /// The session that jobs are started in: what a job brings for another is dropped.
    pub(super) fn session(&self) -> u64 {
        self.session
    }

    /// Starts `work` on a thread of its own; `then` is given what it brings, where that is still wanted. One of a kind
    /// runs at a time: another one before it is ended.
    pub fn start<I, T>(
        &mut self,
        task: Task,
        inputs: I,
        work: impl FnOnce(&Reporter) -> Result<T, Stop> + Send + 'static,
        then: impl FnOnce(&mut S, I, T) + Send + 'static,
    ) where
        I: Clone + PartialEq + Send + 'static,
        T: Send + 'static,
    {
        self.cancel(|t| std::mem::discriminant(&t) == std::mem::discriminant(&task));
        let wake = self.wake.clone();
        let own = inputs.clone();
        let work = move |reporter: &Reporter| -> Result<Finish<S>, Stop> {
            let value = work(reporter)?;
            Ok(Box::new(move |session: &mut S| {
                then(session, own, value);
            }))
        };
        self.running.push(Running {
            task,
            inputs: Box::new(inputs),
            session: self.session,
            job: Job::start(&task.name(), move || wake.after(FRAME), work),
            step: ("", Instant::now()),
        });
    }

    /// What runs, in the order that it was started in.
    #[must_use]
    pub fn running(&self) -> &[Running<S>] {
        &self.running
    }

    /// How those that have ended did so, the latest last.
    #[must_use]
    pub fn ended(&self) -> &[JobEnd] {
        &self.ended
    }

    #[must_use]
    pub fn runs(&self, task: Task) -> bool {
        self.running.iter().any(|r| r.task == task)
    }

    /// Whether a task runs on these inputs.
    #[must_use]
    pub fn runs_on<I: PartialEq + 'static>(&self, task: Task, inputs: &I) -> bool {
        let mut running = self.running.iter();
        running.any(|r| r.task == task && r.is_on(inputs))
    }

    /// Why a task cannot be done from these inputs.
    #[must_use]
    pub fn failure<I: PartialEq + 'static>(&self, task: Task, inputs: &I) -> Option<&str> {
        let on = |f: &&Failure| f.task == task && f.inputs.downcast_ref::<I>() == Some(inputs);
        self.failed.iter().find(on).map(|f| f.message.as_str())
    }

    /// Whether a task on these inputs needs to be started: it neither runs nor has failed.
    pub(super) fn is_new<I: PartialEq + 'static>(&self, task: Task, inputs: &I) -> bool {
        !self.runs_on(task, inputs) && self.failure(task, inputs).is_none()
    }

    pub(super) fn fail(&mut self, task: Task, inputs: Box<dyn Any + Send>, message: String) {
        self.failed.retain(|f| f.task != task);
        self.failed.push(Failure {
            task,
            inputs,
            message,
        });
    }

    /// What could not be computed may be tried again.
    pub(super) fn forget_failures(&mut self) {
        self.failed.clear();
    }

    /// Ends jobs at once: what they still bring is dropped, and they stop at their next report.
    pub(super) fn cancel(&mut self, which: impl Fn(Task) -> bool) -> Vec<Running<S>> {
        self.cancel_running(|r| which(r.task))
    }

    /// As [`Self::cancel`], by all that is known of what runs.
    pub(super) fn cancel_running(
        &mut self,
        which: impl Fn(&Running<S>) -> bool,
    ) -> Vec<Running<S>> {
        let (gone, kept): (Vec<Running<S>>, Vec<Running<S>>) = self
            .running
            .drain(..)
            .partition(|r| which(r) && !r.task.is_not_ended());
        self.running = kept;
        for r in &gone {
            r.job.cancel();
            if !r.task.is_quiet() {
                self.remember(r, "cancelled".into(), false);
            }
        }
        gone
    }

    /// Ends jobs, and does not let them begin again by themselves; which they were. Those of the pipeline begin again only
    /// when somebody asks for them.
    pub(super) fn end(&mut self, which: impl Fn(Task) -> bool) -> Vec<Task> {
        let gone = self.cancel(which);
        let tasks = gone.iter().map(|r| r.task).collect();
        for r in gone.into_iter().filter(|r| !r.task.is_of_pipeline()) {
            self.fail(r.task, r.inputs, "cancelled".into());
        }
        tasks
    }

    fn remember(&mut self, r: &Running<S>, how: String, failed: bool) {
        self.ended.push(JobEnd {
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
    pub(super) fn collect(&mut self) -> Vec<EndedJob<S>> {
        let mut out = Vec::new();
        let mut k = 0;
        while k < self.running.len() {
            let running = &mut self.running[k];
            let step = running.progress().0;
            if running.step.0 != step {
                running.step = (step, Instant::now());
            }
            let Some(result) = running.job.poll() else {
                k += 1;
                continue;
            };
            let r = self.running.remove(k);
            match &result {
                job::Outcome::Done(_) if r.task.is_quiet() => {}
                job::Outcome::Done(_) => self.remember(&r, "done".into(), false),
                job::Outcome::Failed(message) => self.remember(&r, message.clone(), true),
                job::Outcome::Cancelled => self.remember(&r, "cancelled".into(), false),
            }
            out.push(EndedJob {
                task: r.task,
                session: r.session,
                inputs: r.inputs,
                result,
            });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Progress;

    fn endless(r: &Reporter) -> Result<(), Stop> {
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

    fn nothing<I>((): &mut (), _: I, (): ()) {}

    #[test]
    fn several_run_at_once_and_one_of_a_kind() {
        let mut jobs = Jobs::new(Wake::default());
        jobs.start(Task::Simulate(Quality::Draft), "a", endless, nothing);
        jobs.start(Task::Judge, 7, endless, nothing);
        assert_eq!(jobs.running().len(), 2);
        jobs.start(Task::Simulate(Quality::Standard), "c", endless, nothing);
        assert_eq!(jobs.running().len(), 2);
        let simulate = Task::Simulate(Quality::Standard);
        assert!(jobs.runs(simulate) && jobs.runs_on(simulate, &"c"));
        // Neither other inputs nor those of another kind.
        assert!(!jobs.runs_on(simulate, &"a") && !jobs.runs_on(simulate, &7));
        // Gone at once, whatever the thread still does.
        assert_eq!(jobs.end(|_| true).len(), 2);
        assert!(jobs.running().is_empty() && jobs.collect().is_empty());
        assert!(jobs.ended().iter().all(|e| e.how == "cancelled"));
        // What was cancelled does not begin again by itself; with other inputs it may.
        assert!(!jobs.is_new(Task::Judge, &7) && jobs.is_new(Task::Judge, &8));
        jobs.forget_failures();
        assert!(jobs.is_new(Task::Judge, &7));
    }

    #[test]
    fn a_panic_ends_as_a_message() {
        let mut jobs = Jobs::new(Wake::default());
        let task = Task::Design(Quality::Draft);
        let fall = |_: &Reporter| -> Result<(), Stop> { panic!("over a stone") };
        jobs.start(task, "k", fall, nothing);
        let ended = loop {
            let ended = jobs.collect();
            if !ended.is_empty() {
                break ended;
            }
        };
        assert_eq!(ended[0].inputs.downcast_ref(), Some(&"k"));
        assert!(
            matches!(&ended[0].result, job::Outcome::Failed(m) if ended[0].task == task && m.contains("stone"))
        );
        assert!(jobs.ended()[0].failed);
    }
}
