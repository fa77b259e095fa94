//! Press after press, as a plan says: what the machine is told next, from what it and the board say.

mod checking;
mod motion;
mod phases;
mod talk;
mod watch;

use std::collections::{BTreeSet, VecDeque};

use self::motion::Motion;
use super::check::{Check, CheckedForce};
use super::machine::Machine;
use super::marlin::Marlin;
use super::plan::Planned;
use super::press::{PressLimits, SampleMean};
use crate::units;

/// What whoever drives it is told.
#[derive(Clone, Debug, PartialEq)]
pub enum CollectorNews {
    /// To be written down between the samples.
    Note(String),
    /// The sample that was given last belongs to a reading: it is to be written down.
    Keep,
    /// A press begins: its number in the plan, or none where it is that which is pressed again and again.
    Begun(Option<usize>),
    /// A press is over: its number, and why it is none if it is none.
    Press {
        /// In the plan, from 0.
        number: usize,
        /// Why it failed.
        failed: Option<String>,
    },
    /// What the limb answered where it is pressed again and again, when it was pressed there for the first time.
    Answer(CheckedForce),
    /// These presses that were over are none: they are made again.
    Discarded(Vec<usize>),
    /// All of the plan is pressed, and whether there is more is waited for.
    Waits,
    /// For people.
    Say(String),
}

/// How it ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// All presses of the plan were tried.
    Finished,
    /// Something is wrong, and the tip was taken back if that was possible.
    Stopped(String),
}

/// Seconds without a sample after which the board is silent, while the tip is near the limb and before the first one (µs).
const SILENT_US: u64 = 500_000;
const FIRST_US: u64 = 10_000_000;
/// A tip that is out of the way reads no force larger than this (N).
const FREE_N: f64 = 1.0;
/// Presses in a row that fail before something is wrong with the bench rather than with them.
const FAILURES: usize = 5;
/// How fast the tip goes into the limb, and near it (mm/s).
const SLOW: f64 = 1.0;
const NEARING: f64 = 15.0;
/// Share of all presses that may fail before that is so too.
const FAIL: f64 = 0.25;
/// How often a machine is homed after it began anew, before a press is over.
const RESTARTS: u32 = 5;

/// Where in a press it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The machine is told what it must know; nothing moves.
    Opening,
    Retract,
    Turn,
    Rest,
    Approach,
    Seek,
    Feel,
    Step,
    Read,
    Withdraw,
    After,
    /// The tip is taken back because something is wrong.
    Escape,
    Over,
}

/// What is waited for.
enum Doing {
    /// Commands one after the other.
    Orders(VecDeque<String>),
    Moving(Motion),
    /// Samples from a time until a time (µs).
    Reading {
        from_us: u64,
        until_us: u64,
        reading: SampleMean,
        kept: bool,
    },
    Nothing,
}

/// Goes through a plan.
pub struct Collector {
    machine: Machine,
    limits: PressLimits,
    marlin: Marlin,
    /// What is still to be pressed, with its numbers.
    plan: VecDeque<(usize, Planned)>,
    check: Check,
    retreat: f64,
    phase: Phase,
    doing: Doing,
    /// Of the tip's middle from the table's axis, as it was sent last, and before that (m).
    radial: f64,
    came_from: f64,
    /// Of the press that goes on, and of the last one that had any (counts).
    rest: Vec<f64>,
    last_rest: Vec<f64>,
    rest_deviation: Vec<f64>,
    /// Of a sample of the tip's sensor (N).
    tip_noise: f64,
    /// Where it was first felt (m from the axis).
    contact: f64,
    /// Of the last two readings (N), and where the first of them was taken (m from the axis).
    forces: [Option<f64>; 2],
    read_from: Option<f64>,
    failed: Option<String>,
    /// Why all of it ends, while the tip is still taken back.
    wrong: Option<String>,
    failures: usize,
    /// Presses that failed once, and are tried once more.
    failed_before: BTreeSet<usize>,
    /// Presses that were tried, and that failed.
    tried: [usize; 2],
    restarts: u32,
    sample_us: Option<u64>,
    begun_us: Option<u64>,
    paused: bool,
    /// Whether the end of the plan is not the end, and whether it is waited there.
    more: bool,
    waits: bool,
    ended: Option<RunEnd>,
    /// Moves that were made and found to be right.
    pub moves: u64,
    /// The hardest that was felt (N).
    pub hardest: f64,
}

impl Collector {
    /// For these presses, each with its number; `retreat` (m) as [`super::MachineReach::retreat`].
    #[must_use]
    pub fn new(
        machine: Machine,
        limits: PressLimits,
        plan: impl IntoIterator<Item = (usize, Planned)>,
        retreat: f64,
    ) -> Self {
        Self {
            machine,
            limits,
            marlin: Marlin::default(),
            plan: plan.into_iter().collect(),
            check: Check::default(),
            retreat,
            phase: Phase::Opening,
            doing: Doing::Nothing,
            radial: retreat,
            came_from: retreat,
            tip_noise: 0.0,
            rest: Vec::new(),
            last_rest: Vec::new(),
            rest_deviation: Vec::new(),
            contact: 0.0,
            forces: [None; 2],
            read_from: None,
            failed: None,
            wrong: None,
            failures: 0,
            failed_before: BTreeSet::new(),
            tried: [0; 2],
            restarts: 0,
            sample_us: None,
            begun_us: None,
            paused: false,
            more: false,
            waits: false,
            ended: None,
            moves: 0,
            hardest: 0.0,
        }
    }

    /// At the end of the plan it waits for more ([`Self::go_on`]), with its tip out of the way, and says so.
    #[must_use]
    pub fn waiting_for_more(mut self) -> Self {
        self.more = true;
        self
    }

    /// Presses these too; where there are none, it is over.
    pub fn go_on(&mut self, more: impl IntoIterator<Item = (usize, Planned)>) {
        self.plan.extend(more);
        self.more = !self.plan.is_empty();
        if std::mem::take(&mut self.waits) && !self.more {
            self.end(RunEnd::Finished);
        }
    }

    /// Nothing of the plan is left.
    fn through(&mut self, tell: &mut dyn FnMut(CollectorNews)) {
        if !self.more {
            self.end(RunEnd::Finished);
            return;
        }
        self.phase = Phase::Retract;
        self.doing = Doing::Nothing;
        if !std::mem::replace(&mut self.waits, true) {
            tell(CollectorNews::Waits);
        }
    }

    /// How it ended, once it has.
    #[must_use]
    pub fn ended(&self) -> Option<&RunEnd> {
        self.ended.as_ref()
    }

    /// Presses that are still to be made, the one that goes on included.
    #[must_use]
    pub fn left(&self) -> usize {
        self.plan.len()
    }

    /// The numbers of what is still to be pressed.
    pub fn planned_numbers(&self) -> impl Iterator<Item = usize> {
        self.plan.iter().map(|(number, _)| *number)
    }

    /// What is pressed now, or next.
    fn planned(&self) -> Option<Planned> {
        match &self.check.reference {
            Some(reference) if self.check.now => Some(reference.at),
            _ => self.plan.front().map(|(_, planned)| *planned),
        }
    }

    /// Lines that had to be sent again.
    #[must_use]
    pub fn resent(&self) -> u32 {
        self.marlin.resent
    }

    /// Waits, or goes on, before the next press.
    pub fn pause(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Ends it as soon as the tip is out of the way: the machine stops at once.
    pub fn stop(&mut self, why: &str, now_us: u64, out: &mut Vec<u8>) {
        self.escape(why.to_owned(), now_us, out);
    }

    /// Cuts the machine's power to its motors, wherever it is. Nothing is taken back.
    pub fn kill(&mut self, out: &mut Vec<u8>) {
        Marlin::shout("M112", out);
        self.end(RunEnd::Stopped(
            "the machine was told to halt (M112): reset it before the next run, and look where the tip is".into(),
        ));
    }

    /// The machine's port is gone.
    pub fn unplugged(&mut self) {
        self.lose("the machine's port is gone", &mut Vec::new());
    }

    fn end(&mut self, how: RunEnd) {
        self.ended.get_or_insert(how);
        self.phase = Phase::Over;
        self.doing = Doing::Nothing;
    }

    /// Something is wrong: stops what moves, and takes the tip back.
    fn escape(&mut self, why: String, now_us: u64, out: &mut Vec<u8>) {
        if matches!(self.phase, Phase::Escape | Phase::Over) {
            return;
        }
        self.wrong = Some(why);
        if self.phase == Phase::Opening {
            self.give_up();
            return;
        }
        self.phase = Phase::Escape;
        Marlin::shout("M410", out);
        self.marlin.forget();
        self.go_radial(self.retreat, now_us, out);
    }

    /// It ends as it stands.
    fn give_up(&mut self) {
        let why = self.wrong.take().unwrap_or_default();
        self.end(RunEnd::Stopped(why));
    }

    /// The machine cannot be believed any more: it is told to stop, and nothing is taken back.
    fn lose(&mut self, why: &str, out: &mut Vec<u8>) {
        Marlin::shout("M410", out);
        let before = self.wrong.take();
        let also = before.map_or(String::new(), |b| format!("{b}; and "));
        self.end(RunEnd::Stopped(format!(
            "{also}{why}. Look where the tip is before the next run"
        )));
    }

    /// Says what the machine must know before it moves.
    fn open(&mut self, home: bool, now_us: u64, out: &mut Vec<u8>) {
        self.phase = Phase::Opening;
        let home = self.machine.home.iter().filter(|_| home);
        let orders = home.chain(&self.machine.begin).cloned().collect();
        self.marlin.begin(now_us, out);
        self.doing = Doing::Orders(orders);
    }

    fn go(&mut self, targets: Vec<(char, f64, f64)>, now_us: u64, out: &mut Vec<u8>) {
        self.doing = Doing::Moving(Motion::begin(targets, &mut self.marlin, now_us, out));
    }

    fn go_radial(&mut self, radial: f64, now_us: u64, out: &mut Vec<u8>) {
        self.came_from = std::mem::replace(&mut self.radial, radial);
        let axis = &self.machine.radial;
        let speed = match self.phase {
            Phase::Seek | Phase::Step => axis.speed.min(SLOW),
            Phase::Approach => axis.speed.min(NEARING),
            _ => axis.speed,
        };
        let target = (axis.letter, axis.number(units::mm(radial)), speed);
        self.go(vec![target], now_us, out);
    }
}

#[cfg(test)]
mod tests;
