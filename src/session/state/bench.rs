//! A run of the test-bed: what is planned of it, how each press stands, and who gives it orders.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::bench::{CollectorNews, RunEnd};
use crate::document::SensingInputs;
use crate::link::BenchOrder;
use crate::test_bed::{BenchRequest, Ready};

/// What is typed at the bench, none of it a project's.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchDesk {
    pub asked: BenchRequest,
    /// Of the run: beside the project where it is empty.
    pub folder: String,
    /// The machine's file: the paper's bench where it is empty.
    pub machine: String,
    /// A table of places: even ones where it is empty.
    pub points: String,
    /// Ports of a real bench.
    pub printer: String,
    pub board: String,
    pub printer_baud: u32,
}

impl Default for BenchDesk {
    fn default() -> Self {
        Self {
            // Nothing moves that is not asked for by its port.
            asked: BenchRequest {
                simulated: Some(crate::test_bed::Flaws::default()),
                ..BenchRequest::default()
            },
            folder: String::new(),
            machine: String::new(),
            points: String::new(),
            printer: String::new(),
            board: String::new(),
            printer_baud: crate::link::BAUD,
        }
    }
}

/// What a plan is of.
#[derive(Clone, PartialEq)]
pub struct PlanInputs {
    pub sensing: SensingInputs,
    pub asked: BenchRequest,
    pub folder: PathBuf,
}

/// How a press stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PressState {
    ToCome,
    Now,
    Made,
    Failed(String),
}

/// A plan, and how far it has come.
pub struct PressingPlan {
    pub inputs: PlanInputs,
    pub ready: Arc<Ready>,
    /// In the order of its presses.
    pub states: Vec<PressState>,
    /// What was last said of it, the newest last.
    pub said: Vec<String>,
    /// Of what was pressed: that which is pressed again and again is pressed just now.
    pub checking: bool,
    /// How many of them are made, and how many failed: asked at every look of whoever presses.
    counts: [usize; 2],
}

impl PressingPlan {
    /// How many words of it are kept.
    const SAID: usize = 6;

    pub(in crate::session) fn new(inputs: PlanInputs, ready: Arc<Ready>) -> Self {
        let state = |number: &usize| {
            if ready.done.contains(number) {
                PressState::Made
            } else {
                PressState::ToCome
            }
        };
        let states: Vec<PressState> = ready.numbers.iter().map(state).collect();
        let made = states.iter().filter(|s| **s == PressState::Made).count();
        Self {
            inputs,
            states,
            said: Vec::new(),
            checking: false,
            counts: [made, 0],
            ready,
        }
    }

    /// Presses that were made, and that failed.
    #[must_use]
    pub fn made_and_failed(&self) -> [usize; 2] {
        self.counts
    }

    pub(in crate::session) fn say(&mut self, text: impl Into<String>) {
        self.said.push(text.into());
        if self.said.len() > Self::SAID {
            self.said.remove(0);
        }
    }

    fn set(&mut self, number: usize, state: PressState) {
        // Numbers rise with the order of the presses.
        if let Ok(k) = self.ready.numbers.binary_search(&number) {
            let counted = |state: &PressState| match state {
                PressState::Made => Some(0),
                PressState::Failed(_) => Some(1),
                PressState::ToCome | PressState::Now => None,
            };
            if let Some(kind) = counted(&self.states[k]) {
                self.counts[kind] -= 1;
            }
            if let Some(kind) = counted(&state) {
                self.counts[kind] += 1;
            }
            self.states[k] = state;
        }
    }

    /// Nothing is pressed just now.
    fn let_go(&mut self) {
        self.checking = false;
        for state in &mut self.states {
            if *state == PressState::Now {
                *state = PressState::ToCome;
            }
        }
    }

    pub(in crate::session) fn hear(&mut self, news: CollectorNews) {
        match news {
            CollectorNews::Begun(number) => {
                self.let_go();
                match number {
                    Some(number) => self.set(number, PressState::Now),
                    None => self.checking = true,
                }
            }
            CollectorNews::Press { number, failed } => {
                let state = failed.map_or(PressState::Made, PressState::Failed);
                self.set(number, state);
            }
            CollectorNews::Discarded(numbers) => {
                for number in numbers {
                    self.set(number, PressState::ToCome);
                }
            }
            CollectorNews::Say(text) => self.say(text),
            CollectorNews::Answer(_)
            | CollectorNews::Note(_)
            | CollectorNews::Keep
            | CollectorNews::Waits => {}
        }
    }

    pub(in crate::session) fn end(&mut self, ended: &RunEnd) {
        self.let_go();
        match ended {
            RunEnd::Finished => self.say("all presses were tried"),
            RunEnd::Stopped(why) => self.say(why),
        }
    }
}

/// The bench: its plan, shared with whoever goes through it, and who gives that orders.
#[derive(Default)]
pub struct Bench {
    pub(in crate::session) pressing: Arc<Mutex<Option<PressingPlan>>>,
    pub(in crate::session) orders: Option<Sender<BenchOrder>>,
    pub paused: bool,
    /// Whether a run is made ready or pressed: until its thread has ended, whatever has become of its job.
    pub(in crate::session) runs: Arc<AtomicBool>,
    /// Likewise, a plan.
    pub(in crate::session) plans: Arc<AtomicBool>,
}

/// Something goes on as long as this is held.
pub(in crate::session) struct HoldGuard(Arc<AtomicBool>);

impl HoldGuard {
    pub fn new(what: &Arc<AtomicBool>) -> Self {
        what.store(true, Ordering::SeqCst);
        Self(Arc::clone(what))
    }
}

impl Drop for HoldGuard {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

impl Bench {
    pub(in crate::session) fn locked(&self) -> MutexGuard<'_, Option<PressingPlan>> {
        locked(&self.pressing)
    }

    /// What is planned, and how far it has come.
    #[must_use]
    pub fn look<T>(&self, at: impl FnOnce(&PressingPlan) -> T) -> Option<T> {
        self.locked().as_ref().map(at)
    }

    /// Whether a machine may be moving, or soon will.
    #[must_use]
    pub fn goes_on(&self) -> bool {
        self.runs.load(Ordering::SeqCst)
    }

    /// Whether another run or plan may begin.
    #[must_use]
    pub fn is_free(&self) -> bool {
        !self.goes_on() && !self.plans.load(Ordering::SeqCst)
    }

    /// Tells whoever presses.
    pub(in crate::session) fn order(&mut self, order: BenchOrder) {
        match &order {
            BenchOrder::Pause => self.paused = true,
            BenchOrder::Resume => self.paused = false,
            BenchOrder::Stop | BenchOrder::Kill | BenchOrder::More(_) | BenchOrder::GiveUp(_) => {}
        }
        if let Some(orders) = &self.orders {
            // Nobody is there any more to be told once it has ended.
            let _ = orders.send(order);
        }
    }
}

/// What others have left of it, whatever befell them.
pub(in crate::session) fn locked(
    pressing: &Mutex<Option<PressingPlan>>,
) -> MutexGuard<'_, Option<PressingPlan>> {
    pressing.lock().unwrap_or_else(PoisonError::into_inner)
}
