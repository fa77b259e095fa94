//! Background jobs: a core function on an immutable snapshot, on a thread of its own, behind a panic
//! boundary, with progress and cancel.

use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::budget::Progress;

/// How a job ended.
pub enum Outcome<T> {
    Done(T),
    /// In the user's terms.
    Failed(String),
    Cancelled,
}

/// What a job's function returns when it could not finish.
pub enum Stop {
    Cancelled,
    Failed(String),
}

#[derive(Default)]
struct JobShared {
    cancel: AtomicBool,
    progress: Mutex<Option<Progress>>,
}

/// Handed to the job's function: where it reports and learns that it should stop.
#[derive(Clone)]
pub struct Reporter {
    shared: Arc<JobShared>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Reporter {
    /// For the core's watch.
    pub fn report(&self, progress: Progress) -> ControlFlow<()> {
        if let Ok(mut slot) = self.shared.progress.lock() {
            *slot = Some(progress);
        }
        (self.wake)();
        if self.shared.cancel.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// A running job and the way to its result.
pub struct Job<T> {
    pub name: String,
    shared: Arc<JobShared>,
    result: Receiver<Outcome<T>>,
    started: Instant,
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work` on a thread of its own; `wake` is called when there is something to show.
    #[must_use]
    pub fn start(
        name: &str,
        wake: impl Fn() + Send + Sync + 'static,
        work: impl FnOnce(&Reporter) -> Result<T, Stop> + Send + 'static,
    ) -> Self {
        let shared = Arc::new(JobShared::default());
        let reporter = Reporter {
            shared: Arc::clone(&shared),
            wake: Arc::new(wake),
        };
        let (sender, result) = channel();
        let failed_to_start = sender.clone();
        let spawned = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                let outcome = match catch_unwind(AssertUnwindSafe(|| work(&reporter))) {
                    Ok(Ok(value)) => Outcome::Done(value),
                    Ok(Err(Stop::Cancelled)) => Outcome::Cancelled,
                    Ok(Err(Stop::Failed(message))) => Outcome::Failed(message),
                    Err(panic) => Outcome::Failed(describe_panic(&*panic)),
                };
                // Nobody listens any more when the window was closed meanwhile.
                let _ = sender.send(outcome);
                (reporter.wake)();
            });
        if let Err(error) = spawned {
            let _ = failed_to_start.send(Outcome::Failed(format!(
                "the job could not be started: {error}"
            )));
        }
        Self {
            name: name.to_owned(),
            shared,
            result,
            started: Instant::now(),
        }
    }

    /// Asks the job to stop; it answers at its next report.
    pub fn cancel(&self) {
        self.shared.cancel.store(true, Ordering::Relaxed);
    }

    #[must_use]
    pub fn is_cancelling(&self) -> bool {
        self.shared.cancel.load(Ordering::Relaxed)
    }

    /// The latest report.
    #[must_use]
    pub fn progress(&self) -> Option<Progress> {
        self.shared.progress.lock().ok().and_then(|p| *p)
    }

    #[must_use]
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// The outcome, once there is one.
    #[must_use]
    pub fn poll(&self) -> Option<Outcome<T>> {
        match self.result.try_recv() {
            Ok(outcome) => Some(outcome),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Outcome::Failed(
                "the job ended without a result. Start it again".into(),
            )),
        }
    }
}

fn describe_panic(panic: &(dyn Any + Send)) -> String {
    let message = panic
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into());
    format!(
        "an internal error stopped this job ({message}). Nothing else was lost; please report it"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<T: Send + 'static>(job: &Job<T>) -> Outcome<T> {
        loop {
            if let Some(outcome) = job.poll() {
                return outcome;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn step(k: usize) -> Progress {
        Progress {
            stage: "Counting",
            done: k,
            total: 100,
        }
    }

    #[test]
    fn a_job_reports_and_returns() {
        let job = Job::start(
            "count",
            || (),
            |r| {
                let _ = r.report(step(42));
                Ok(7)
            },
        );
        assert!(matches!(wait(&job), Outcome::Done(7)));
        assert_eq!(job.progress(), Some(step(42)));
    }

    #[test]
    fn cancel_is_heard_at_the_next_report() {
        let job = Job::<()>::start(
            "spin",
            || (),
            |r| {
                for k in 0.. {
                    if r.report(step(k)).is_break() {
                        return Err(Stop::Cancelled);
                    }
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(())
            },
        );
        job.cancel();
        assert!(matches!(wait(&job), Outcome::Cancelled));
    }

    #[test]
    fn a_panic_is_a_message() {
        let job = Job::<()>::start("fall", || (), |_| panic!("over a stone"));
        let Outcome::Failed(message) = wait(&job) else {
            panic!("a panic must fail the job")
        };
        assert!(message.contains("over a stone"));
    }
}
