//! The bench: what is asked of it, its plan, and who gives orders to whoever goes through that.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::pressing::{HandStep, PressingPlan};
use crate::link::BenchOrder;
use crate::test_bed::{BenchRequest, HandOrder, PressOrder};

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
    /// How hard the last press by hand was (N), where that is told.
    pub typed_n: f64,
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
            typed_n: BenchRequest::default().force_n,
        }
    }
}

/// To whoever presses: a machine or somebody.
pub(in crate::session) enum Orders {
    Machine(Sender<BenchOrder>),
    Hand(Sender<PressOrder>),
}

/// The bench: its plan, shared with whoever goes through it, and who gives that orders.
#[derive(Default)]
pub struct Bench {
    pub(in crate::session) pressing: Arc<Mutex<Option<PressingPlan>>>,
    pub(in crate::session) orders: Option<Orders>,
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

    /// Whether somebody presses by hand.
    #[must_use]
    pub fn by_hand(&self) -> bool {
        self.goes_on() && matches!(self.orders, Some(Orders::Hand(_)))
    }

    /// What whoever presses by hand is to do next.
    #[must_use]
    pub fn step(&self) -> Option<HandStep> {
        let hand = self.look(|plan| plan.hand).flatten();
        hand.filter(|_| self.by_hand()).map(|(step, _)| step)
    }

    /// Whether it can be said where the press of now is.
    #[must_use]
    pub fn takes_place(&self) -> bool {
        self.step().is_some_and(|step| step != HandStep::Wait)
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
        // Nobody is there any more to be told once it has ended.
        let _ = match (&self.orders, order) {
            (Some(Orders::Machine(orders)), order) => orders.send(order).is_ok(),
            (Some(Orders::Hand(orders)), BenchOrder::Stop | BenchOrder::Kill) => {
                orders.send(HandOrder::Stop.into()).is_ok()
            }
            _ => false,
        };
    }

    /// Tells whoever presses by hand, of the press that is asked for.
    pub(in crate::session) fn order_hand(&self, order: HandOrder) {
        if let Some(Orders::Hand(orders)) = &self.orders {
            let number = self.look(PressingPlan::asked_for).flatten();
            let _ = orders.send(PressOrder { number, order });
        }
    }
}

/// What others have left of it, whatever befell them.
pub(in crate::session) fn locked(
    pressing: &Mutex<Option<PressingPlan>>,
) -> MutexGuard<'_, Option<PressingPlan>> {
    pressing.lock().unwrap_or_else(PoisonError::into_inner)
}
