//! A plan of presses: how each of them stands, and what whoever presses by hand is waited for.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use crate::bench::{CollectorNews, RunEnd};
use crate::document::SensingInputs;
use crate::test_bed::{BenchRequest, HandRun, HandSays, Ready};

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

/// What goes through a plan.
#[derive(Clone)]
pub enum PlannedRun {
    Machine(Arc<Ready>),
    Hand(Arc<HandRun>),
}

impl PlannedRun {
    /// The number in the folder's plan of each press, rising, and whether it is there already.
    pub(in crate::session) fn numbers(&self) -> Vec<(usize, bool)> {
        match self {
            Self::Machine(ready) => {
                let numbers = ready.numbers.iter();
                numbers.map(|n| (*n, ready.done.contains(n))).collect()
            }
            Self::Hand(run) => (0..run.plan.places.len())
                .map(|number| (number, !run.plan.left.contains(&number)))
                .collect(),
        }
    }

    /// Where each press is (m) and the wall's normal there, in the order of the plan.
    #[must_use]
    pub fn places(&self) -> Vec<(DVec3, DVec3)> {
        match self {
            Self::Machine(ready) => {
                let presses = ready.reach.presses.iter();
                presses.map(|press| (press.at, press.normal)).collect()
            }
            Self::Hand(run) => run.plan.places.clone(),
        }
    }

    /// For people, a line each.
    #[must_use]
    pub fn in_words(&self) -> Vec<String> {
        match self {
            Self::Machine(ready) => {
                let mut lines = ready.in_words();
                lines.push(ready.checked_in_words());
                lines
            }
            Self::Hand(run) => run.in_words(),
        }
    }
}

/// What whoever presses by hand is to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandStep {
    /// Nothing: the board's rest is taken.
    Wait,
    Press,
    LetGo,
    /// To tell how hard it was.
    TellForce,
}

/// A plan, and how far it has come.
pub struct PressingPlan {
    pub inputs: PlanInputs,
    pub run: PlannedRun,
    /// Where each press is (m) and the wall's normal there, in the order of the presses.
    pub places: Vec<(DVec3, DVec3)>,
    /// In the order of its presses.
    pub states: Vec<PressState>,
    /// What was last said of it, the newest last.
    pub said: Vec<String>,
    /// Of what was pressed: that which is pressed again and again is pressed just now.
    pub checking: bool,
    /// By hand, while it goes on: what is to be done, and where this press is (m) if not where it was asked for.
    pub hand: Option<(HandStep, Option<DVec3>)>,
    /// By hand, the number of the press that was asked for last.
    asked_for: Option<usize>,
    numbers: Vec<usize>,
    /// How many of them are made, and how many failed: asked at every look of whoever presses.
    counts: [usize; 2],
}

impl PressingPlan {
    /// How many words of it are kept.
    const SAID: usize = 6;

    pub(in crate::session) fn new(inputs: PlanInputs, run: PlannedRun) -> Self {
        let numbered = run.numbers();
        let state = |&(_, done): &(usize, bool)| {
            if done {
                PressState::Made
            } else {
                PressState::ToCome
            }
        };
        let made = numbered.iter().filter(|(_, done)| *done).count();
        Self {
            inputs,
            places: run.places(),
            states: numbered.iter().map(state).collect(),
            said: Vec::new(),
            checking: false,
            hand: None,
            asked_for: None,
            numbers: numbered.into_iter().map(|(number, _)| number).collect(),
            counts: [made, 0],
            run,
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
        if let Ok(k) = self.numbers.binary_search(&number) {
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

    /// What whoever presses by hand is told, with the force that is meant (N).
    pub(in crate::session) fn hear_hand(&mut self, says: &HandSays, meant_n: f64) {
        let moved = self.hand.and_then(|(_, moved)| moved);
        match says {
            HandSays::Press { number, .. } => {
                self.let_go();
                self.set(*number, PressState::Now);
                self.hand = Some((HandStep::Press, None));
                self.asked_for = Some(*number);
            }
            HandSays::Moved(at) => {
                let step = self.hand.map_or(HandStep::Press, |(step, _)| step);
                self.hand = Some((step, *at));
            }
            HandSays::Wait => {
                self.hand = Some((HandStep::Wait, moved));
                // What is said meanwhile is of whichever is next.
                self.asked_for = None;
            }
            HandSays::LetGo => self.hand = Some((HandStep::LetGo, moved)),
            HandSays::HowHard => self.hand = Some((HandStep::TellForce, moved)),
            HandSays::Taken(number, _) => self.set(*number, PressState::Made),
            HandSays::Unsteady => {
                self.hand = Some((HandStep::Press, moved));
                self.say(says.in_words(meant_n));
            }
            HandSays::OffTheWall(_)
            | HandSays::NothingWaits
            | HandSays::TakenAlready
            | HandSays::Board(_) => {
                self.say(says.in_words(meant_n));
            }
        }
    }

    /// The number in the plan of the press that was asked for last, by hand.
    pub(in crate::session) fn asked_for(&self) -> Option<usize> {
        self.asked_for
    }

    pub(in crate::session) fn end(&mut self, ended: &RunEnd) {
        self.let_go();
        self.hand = None;
        match ended {
            RunEnd::Finished => self.say("all presses were tried"),
            RunEnd::Stopped(why) => self.say(why),
        }
    }
}
