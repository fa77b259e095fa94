//! `hapdef collect`: a machine presses the limb at many places, and what the gauges read is written down.

mod args;
mod by_hand;

use std::collections::BTreeSet;
use std::io::BufRead as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::ensure;
use serde_json::json;

pub use self::args::CollectArgs;
use super::common::make_folder;
use super::listen::sensing_for;
use super::out;
use super::progress::Bar;
use super::spared::Spared;
use crate::bench::{Collector, CollectorNews, RunEnd};
use crate::link::{Address, BenchOrder, Pace};
use crate::plain;
use crate::test_bed::{Met, PressingRun, Ready, Round, RunGoal, press_on_simulated, pressed};

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &CollectArgs) -> anyhow::Result<()> {
    let loaded = args.common.load()?;
    loaded.inputs.project.check()?;
    Spared::of(&loaded).check("--out", Some(&args.out))?;
    let run = PressingRun::new(args.asked(), &loaded.inputs, &args.out)?;
    let ports = ports(args)?;
    make_folder(&args.out)?;
    let sensing = Arc::new(sensing_for(&args.common, &loaded)?);
    if args.by_hand {
        return by_hand::run(args, run, loaded.inputs, sensing);
    }
    let ready = Ready::new(run, loaded.inputs, sensing)?;
    for line in ready.in_words() {
        out::say(&line);
    }
    if args.plan_only {
        let reach = &ready.reach;
        let said = json!({ "presses": reach.presses.len(), "left_out": reach.left_out.len() });
        return out::line(&said.to_string());
    }
    out::say(&ready.checked_in_words());
    let mut presser = Presser::new(args, ports);
    let Some(mm) = args.until else {
        let ended = presser.press(&ready, ready.collector(), None)?;
        return finish(&ready, &presser, &ended, None);
    };
    let rounds = Rounds::new(&ready, args, mm);
    let first = args.common.in_pool(|| rounds.next())?;
    let ended = match &first.1 {
        Round::Press(numbers) => {
            let collector = ready.collector_of_rounds(numbers);
            presser.press(&ready, collector, Some(&rounds))?
        }
        Round::Over { .. } => RunEnd::Finished,
    };
    if let RunEnd::Stopped(_) = ended
        && let Err(why) = args.common.in_pool(|| rounds.next())
    {
        out::say(&format!("hapdef: what was reached cannot be told: {why:#}"));
    }
    let learned = rounds.last();
    if ended == RunEnd::Finished && learned.is_some_and(|(_, reached)| !reached) {
        out::say("all places are pressed, and the goal is not reached");
    }
    finish(&ready, &presser, &ended, learned)
}

/// A plan that learns, and what has failed of it.
struct Rounds<'a> {
    ready: &'a Ready,
    goal: RunGoal,
    failed: Mutex<BTreeSet<usize>>,
    /// What was reached when it was looked at last, and whether that is the goal.
    last: Mutex<Option<(Met, bool)>>,
}

impl<'a> Rounds<'a> {
    fn new(ready: &'a Ready, args: &CollectArgs, mm: f64) -> Self {
        Self {
            ready,
            goal: RunGoal {
                mm,
                round: args.round,
                in_order: args.in_order,
            },
            failed: Mutex::default(),
            last: Mutex::default(),
        }
    }

    fn last(&self) -> Option<(Met, bool)> {
        *self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self) -> MutexGuard<'_, BTreeSet<usize>> {
        self.failed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was reached, and what comes next.
    fn next(&self) -> anyhow::Result<(Met, Round)> {
        let failed = self.failed().clone();
        let bar = Bar::default();
        let watch = |p| bar.show(p);
        let next = self.ready.next_round(&self.goal, &failed, &watch);
        bar.finish();
        let (met, round) = next?;
        say_met(&met);
        let last = Some((met, round == Round::Over { met: true }));
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = last;
        Ok((met, round))
    }

    /// As an order. What is pressed and cannot be read back is not pressed again and again.
    fn order(&self, last: &BTreeSet<usize>) -> anyhow::Result<(BenchOrder, BTreeSet<usize>)> {
        let there = pressed(&self.ready.folder)?;
        self.failed().extend(last.difference(&there));
        let numbers = match self.next()?.1 {
            Round::Press(numbers) => numbers,
            Round::Over { .. } => BTreeSet::new(),
        };
        let presses = (self.ready.planned())
            .filter(|(number, _)| numbers.contains(number))
            .collect();
        Ok((BenchOrder::More(presses), numbers))
    }
}

fn say_met(met: &Met) {
    if let Some(errors) = &met.errors {
        out::say(&format!(
            "learned from {}: of {} that nothing has learned from, half are found to {:.2} mm, nine of ten to {:.2}, on the mean {:.2}",
            plain::either(met.learned_from, "press", "presses"),
            plain::either(met.held_out, "other", "others"),
            errors.median_mm,
            errors.p90_mm,
            errors.mean_mm
        ));
    }
}

/// Printer and board, where they are real.
fn ports(args: &CollectArgs) -> anyhow::Result<Option<(Address, Address)>> {
    if args.simulate || args.plan_only || args.by_hand {
        return Ok(None);
    }
    let (Some(printer), Some(board)) = (&args.printer, &args.board) else {
        anyhow::bail!(
            "name the ports of both with --printer and --board, or press on a simulated bench with --simulate"
        );
    };
    let address = |text: &str, baud| Address::parse(text, baud, Pace::Real);
    let ports = (
        address(printer, args.printer_baud),
        address(board, args.board_baud),
    );
    for port in [&ports.0, &ports.1] {
        ensure!(
            !port.is_recording(),
            "{port}: a recording cannot be pressed"
        );
        port.check().map_err(anyhow::Error::msg)?;
    }
    Ok(Some(ports))
}

/// Presses, and keeps count.
struct Presser<'a> {
    args: &'a CollectArgs,
    ports: Option<(Address, Address)>,
    failed: usize,
    moves: u64,
    resent: u32,
    hardest: f64,
}

impl<'a> Presser<'a> {
    fn new(args: &'a CollectArgs, ports: Option<(Address, Address)>) -> Self {
        Self {
            args,
            ports,
            failed: 0,
            moves: 0,
            resent: 0,
            hardest: 0.0,
        }
    }

    /// Goes through what a collector has left, and through `rounds` of more.
    fn press(
        &mut self,
        ready: &Ready,
        mut collector: Collector,
        rounds: Option<&Rounds>,
    ) -> anyhow::Result<RunEnd> {
        if collector.left() == 0 {
            return Ok(RunEnd::Finished);
        }
        let all = ready.reach.presses.len();
        let mut done = ready.done.len();
        let mut failed = 0;
        // The collector waits for the next round.
        let waits = AtomicBool::new(false);
        let tell = |news: CollectorNews| match news {
            CollectorNews::Waits => waits.store(true, Ordering::Relaxed),
            CollectorNews::Say(text) => out::say(&format!("hapdef: {text}")),
            CollectorNews::Press { failed: None, .. } => {
                done += 1;
                if done.is_multiple_of(10) || done == all {
                    out::say(&format!("{done} of {all} presses"));
                }
            }
            CollectorNews::Press {
                number,
                failed: Some(why),
            } => {
                failed += 1;
                out::say(&format!("press {number} failed: {why}"));
            }
            CollectorNews::Answer(_) => {
                if let Err(error) = ready.keep(&news) {
                    out::say(&format!("hapdef: {error:#}"));
                }
            }
            CollectorNews::Discarded(none) => done = done.saturating_sub(none.len()),
            CollectorNews::Note(_) | CollectorNews::Keep | CollectorNews::Begun(_) => {}
        };
        let mut next = Next {
            rounds,
            waits: &waits,
            last: collector.planned_numbers().collect(),
        };
        let ended = if let Some((printer, board)) = &self.ports {
            let inbox = listen_for_orders();
            at_ports(
                ready,
                &mut collector,
                (printer, board),
                &inbox,
                &mut next,
                tell,
            )?
        } else {
            let bar = Bar::default();
            let pressing = || {
                let watch = |p| bar.show(p);
                let mut begun = false;
                let mut orders = || {
                    // What was computed for it is there.
                    if !std::mem::replace(&mut begun, true) {
                        bar.finish();
                    }
                    next.is_due().then(|| next.order())
                };
                press_on_simulated(ready, &mut collector, &watch, &mut orders, tell)
            };
            self.args.common.in_pool(pressing)?
        };
        self.failed += failed;
        self.moves += collector.moves;
        self.resent += collector.resent();
        self.hardest = self.hardest.max(collector.hardest);
        Ok(ended)
    }
}

/// The next round, when it is waited for.
struct Next<'a> {
    rounds: Option<&'a Rounds<'a>>,
    waits: &'a AtomicBool,
    /// The presses of the last one.
    last: BTreeSet<usize>,
}

impl Next<'_> {
    fn is_due(&self) -> bool {
        self.rounds.is_some() && self.waits.swap(false, Ordering::Relaxed)
    }

    /// It, or that it cannot be had, and all ends.
    fn order(&mut self) -> BenchOrder {
        let order = self.rounds.map(|rounds| rounds.order(&self.last));
        match order {
            Some(Ok((order, numbers))) => {
                self.last = numbers;
                order
            }
            Some(Err(why)) => BenchOrder::GiveUp(no_round(&why)),
            None => BenchOrder::More(Vec::new()),
        }
    }
}

/// Why a run ends before its goal.
fn no_round(why: &anyhow::Error) -> String {
    format!("the next presses cannot be chosen: {why:#}")
}

/// At real ports nobody waits while the next round is thought of: samples, and orders to stop, go on being heard.
fn at_ports(
    ready: &Ready,
    collector: &mut Collector,
    ports: (&Address, &Address),
    inbox: &Receiver<BenchOrder>,
    next: &mut Next<'_>,
    tell: impl FnMut(CollectorNews),
) -> anyhow::Result<RunEnd> {
    std::thread::scope(|scope| {
        let (answers, answered) = channel();
        let mut orders = || {
            if let (true, Some(rounds)) = (next.is_due(), next.rounds) {
                let (answers, last) = (answers.clone(), next.last.clone());
                scope.spawn(move || answers.send(rounds.order(&last)));
            }
            match answered.try_recv() {
                Ok(Ok((order, numbers))) => {
                    next.last = numbers;
                    Some(order)
                }
                Ok(Err(why)) => Some(BenchOrder::GiveUp(no_round(&why))),
                Err(_) => inbox.try_recv().ok(),
            }
        };
        ready.press_at(collector, ports, &mut orders, tell)
    })
}

fn listen_for_orders() -> Receiver<BenchOrder> {
    let (orders, inbox) = channel();
    obey_signals(orders.clone());
    obey_stdin(orders);
    inbox
}

/// Ctrl-C and a request to end take the tip back before the program ends.
fn obey_signals(orders: Sender<BenchOrder>) {
    let stop = move || {
        let _ = orders.send(BenchOrder::Stop);
    };
    if ctrlc::set_handler(stop).is_err() {
        out::say("Ctrl-C does not take the tip back here: write stop");
    }
}

/// Lines on standard input: pause, resume, stop, kill.
fn obey_stdin(orders: Sender<BenchOrder>) {
    out::say(
        "write pause, resume, stop (takes the tip back) or kill (halts the machine) and press Enter",
    );
    let listen = move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            let order = match line.trim() {
                "pause" => BenchOrder::Pause,
                "resume" => BenchOrder::Resume,
                "stop" => BenchOrder::Stop,
                "kill" => BenchOrder::Kill,
                "" => continue,
                other => {
                    out::say(&format!("{} is no order", plain::quote(other)));
                    continue;
                }
            };
            if orders.send(order).is_err() {
                return;
            }
        }
    };
    // Without a thread there are no orders, and all else works.
    let _ = std::thread::Builder::new()
        .name("orders".into())
        .spawn(listen);
}

fn finish(
    ready: &Ready,
    pressing: &Presser<'_>,
    ended: &RunEnd,
    learned: Option<(Met, bool)>,
) -> anyhow::Result<()> {
    let (presses, done) = (ready.reach.presses.len(), pressed(&ready.folder)?.len());
    let mut said = json!({
        "presses": presses,
        "pressed": done,
        "failed": pressing.failed,
        "moves": pressing.moves,
        "lines_sent_again": pressing.resent,
        "hardest_n": pressing.hardest,
    });
    if let Some((met, reached)) = learned {
        said["until_mm"] = json!(pressing.args.until);
        said["met"] = json!(reached);
        said["learned_from"] = json!(met.learned_from);
        said["held_out"] = json!(met.held_out);
        said["held_out_mm"] = json!(met.errors.map(|e| e.mean_mm));
        said["held_out_median_mm"] = json!(met.errors.map(|e| e.median_mm));
        said["held_out_p90_mm"] = json!(met.errors.map(|e| e.p90_mm));
    }
    out::line(&said.to_string())?;
    match ended {
        RunEnd::Finished => Ok(()),
        RunEnd::Stopped(why) => anyhow::bail!(
            "{why}. {done} of {presses} presses are kept; the same command goes on with the rest"
        ),
    }
}
