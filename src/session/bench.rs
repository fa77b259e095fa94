//! The test-bed: a plan of presses, and a machine, a simulated one or somebody that goes through it in the background.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::jobs::{Task, stop};
use super::slot::Slot;
use super::state::Session;
use super::state::bench::{Bench, HoldGuard, Orders, locked};
use super::state::pressing::{HandStep, PlanInputs, PlannedRun, PressingPlan};
use crate::bench::{Collector, CollectorNews, RunEnd};
use crate::budget::{Budget, Progress};
use crate::design::{Inputs, Sensing};
use crate::io::kept_model;
use crate::job::{Reporter, Stop};
use crate::link::{Address, BY_HAND, BenchOrder, Pace};
use crate::test_bed::{
    BenchRequest, HandOrder, HandRun, PressOrder, PressingRun, Ready, press_on_simulated,
};

impl Session {
    /// Chooses where is pressed, and shows it. Nothing moves.
    pub fn plan_presses(&mut self) {
        let Some(begin) = self.begin_bench() else {
            return;
        };
        let inputs = begin.inputs.clone();
        let held = HoldGuard::new(&self.bench.plans);
        let work = move |r: &Reporter| {
            let _held = held;
            begin.ready(r)
        };
        self.jobs.start(
            Task::PlanPresses,
            inputs,
            work,
            |s, inputs, (sensing, run)| {
                s.keep_sensing(&inputs, &sensing);
                if !s.bench.goes_on() {
                    *s.bench.locked() = Some(PressingPlan::new(inputs, run));
                }
            },
        );
    }

    /// Presses what is left of the plan: at the ports that are named, or on a simulated bench.
    pub fn press_plan(&mut self) {
        let Some(begin) = self.begin_bench() else {
            return;
        };
        let by = match self.pressed_by() {
            Ok(by) => by,
            Err(message) => return self.complain(message),
        };
        if !matches!(by, PressedBy::Simulated) {
            // One listens to a board, and only one.
            self.disconnect();
        }
        let by_hand = matches!(by, PressedBy::Hand(_));
        if by_hand {
            self.desk.bench.typed_n = self.desk.bench.asked.force_n;
        }
        let inbox = self.bench.take_orders(by_hand);
        let pressing = Arc::clone(&self.bench.pressing);
        let inputs = begin.inputs.clone();
        let held = HoldGuard::new(&self.bench.runs);
        let work = move |r: &Reporter| {
            let _held = held;
            let (sensing, run) = begin.ready(r)?;
            *locked(&pressing) = Some(PressingPlan::new(begin.inputs, run.clone()));
            let ended = go_through(&run, &by, &inbox, &pressing, r);
            let stopped = |why: &anyhow::Error| RunEnd::Stopped(format!("{why:#}"));
            let how = ended.as_ref().map_or_else(stopped, RunEnd::clone);
            if let Some(plan) = locked(&pressing).as_mut() {
                plan.end(&how);
            }
            match how {
                // Whoever stopped it need not be told that it is none.
                RunEnd::Stopped(why) if why != BY_HAND => Err(Stop::Failed(why)),
                _ => Ok(sensing),
            }
        };
        self.jobs
            .start(Task::Press, inputs, work, |s, inputs, sensing| {
                s.keep_sensing(&inputs, &sensing);
                let text = s.bench.look(|p| {
                    let [made, failed] = p.made_and_failed();
                    format!(
                        "{made} of {} presses are in {}; {failed} failed",
                        p.states.len(),
                        p.inputs.folder.display()
                    )
                });
                s.tell(text.unwrap_or_default());
            });
    }

    /// Tells the run that goes on.
    pub fn order_bench(&mut self, order: BenchOrder) {
        self.bench.order(order);
    }

    /// Tells whoever presses by hand.
    pub fn order_hand(&mut self, order: HandOrder) {
        self.bench.order_hand(order);
    }

    /// Takes the tip back and waits until it is, as the program ends: for a while, a machine may be gone.
    pub fn leave_bench(&mut self) {
        const WAIT: Duration = Duration::from_secs(15);
        // What is only being made ready does not begin any more.
        self.jobs.cancel(|task| task == Task::Press);
        self.bench.order(BenchOrder::Stop);
        let begun = Instant::now();
        while self.bench.goes_on() && begun.elapsed() < WAIT {
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Whether the plan that is shown is what is asked for now.
    #[must_use]
    pub fn plan_holds(&self) -> bool {
        let now = self.plan_inputs();
        self.bench.look(|p| p.inputs == now) == Some(true)
    }

    /// Where a run goes: as it is named, beside the project.
    #[must_use]
    pub fn bench_folder(&self) -> PathBuf {
        let own = self.document.path.as_ref().and_then(|p| p.parent());
        let beside = own.map_or_else(std::env::temp_dir, Path::to_path_buf);
        let name = self.desk.bench.folder.trim();
        beside.join(if name.is_empty() { "presses" } else { name })
    }

    fn plan_inputs(&self) -> PlanInputs {
        let desk = &self.desk.bench;
        let path = |text: &str| Some(PathBuf::from(text.trim())).filter(|p| p.as_os_str() != "");
        PlanInputs {
            sensing: self.document.sensing_inputs(),
            asked: BenchRequest {
                machine: path(&desk.machine),
                points: path(&desk.points),
                ..desk.asked.clone()
            },
            folder: self.bench_folder(),
        }
    }

    /// All that it takes to make a run ready, where one can be begun.
    fn begin_bench(&mut self) -> Option<Begin> {
        if self.document.state.project.selection.sites.is_empty() {
            self.complain("There are no gauges yet: press “Select gauges”, or place them with the tool “Gauges”");
            return None;
        }
        if !self.bench.is_free() {
            self.complain("A run goes on, or is planned: stop it before another one is begun");
            return None;
        }
        Some(Begin {
            inputs: self.plan_inputs(),
            project: self.document.inputs(),
            path: self.document.path.clone(),
            budget: self.budget(),
            known: self.sensing().map(Arc::clone),
        })
    }

    fn pressed_by(&self) -> Result<PressedBy, String> {
        let desk = &self.desk.bench;
        if desk.asked.simulated.is_some() {
            return Ok(PressedBy::Simulated);
        }
        let port = |text: &str, what: &str, baud| -> Result<Address, String> {
            let address = match text.trim() {
                "" => Err(format!(
                    "Name the {what}'s port, or press on a simulated bench"
                )),
                text => Ok(Address::parse(text, baud, Pace::Real)),
            }?;
            if address.is_recording() {
                return Err(format!("{address}: a recording cannot be pressed"));
            }
            Ok(address)
        };
        let board = || port(&desk.board, "board", self.desk.baud);
        if desk.asked.by_hand {
            return Ok(PressedBy::Hand(board()?));
        }
        let printer = port(&desk.printer, "printer", desk.printer_baud)?;
        Ok(PressedBy::Machine(printer, board()?))
    }

    fn keep_sensing(&mut self, inputs: &PlanInputs, sensing: &Arc<Sensing>) {
        self.live.sensing = Some(Slot {
            inputs: inputs.sensing.clone(),
            value: Arc::clone(sensing),
        });
    }
}

/// A run that is to be made ready.
struct Begin {
    inputs: PlanInputs,
    project: Inputs,
    path: Option<PathBuf>,
    budget: Budget,
    known: Option<Arc<Sensing>>,
}

impl Begin {
    fn ready(&self, r: &Reporter) -> Result<(Arc<Sensing>, PlannedRun), Stop> {
        let failed = |why: anyhow::Error| Stop::Failed(format!("{why:#}"));
        let folder = &self.inputs.folder;
        std::fs::create_dir_all(folder)
            .map_err(|e| Stop::Failed(format!("{}: {e}", folder.display())))?;
        let run =
            PressingRun::new(self.inputs.asked.clone(), &self.project, folder).map_err(failed)?;
        let watch = |p| r.report(p);
        let sensing = if let Some(sensing) = &self.known {
            Arc::clone(sensing)
        } else {
            let path = self.path.as_deref();
            let made = kept_model::sensing(&self.project, path, &self.budget, &watch);
            Arc::new(made.map_err(|e| stop(&e))?)
        };
        let (project, of) = (self.project.clone(), Arc::clone(&sensing));
        let run = if self.inputs.asked.by_hand {
            PlannedRun::Hand(Arc::new(HandRun::new(run, project, of).map_err(failed)?))
        } else {
            PlannedRun::Machine(Arc::new(Ready::new(run, project, of).map_err(failed)?))
        };
        Ok((sensing, run))
    }
}

/// What presses, and where it is.
enum PressedBy {
    Simulated,
    /// Printer and board.
    Machine(Address, Address),
    /// Board.
    Hand(Address),
}

/// What whoever presses is told.
struct OrderInbox {
    machine: Receiver<BenchOrder>,
    hand: Receiver<PressOrder>,
}

impl Bench {
    /// Orders go to the next run from now on.
    fn take_orders(&mut self, by_hand: bool) -> OrderInbox {
        let (to_machine, machine) = channel();
        let (to_hand, hand) = channel();
        self.orders = Some(if by_hand {
            Orders::Hand(to_hand)
        } else {
            Orders::Machine(to_machine)
        });
        self.paused = false;
        OrderInbox { machine, hand }
    }
}

/// Goes through what is left. A job that is ended takes the tip back first.
fn go_through(
    run: &PlannedRun,
    by: &PressedBy,
    inbox: &OrderInbox,
    pressing: &Mutex<Option<PressingPlan>>,
    r: &Reporter,
) -> anyhow::Result<RunEnd> {
    match (run, by) {
        (PlannedRun::Hand(run), PressedBy::Hand(board)) => {
            press_by_hand(run, board, &inbox.hand, pressing, r)
        }
        (PlannedRun::Machine(ready), PressedBy::Machine(printer, board)) => {
            press(ready, Some((printer, board)), &inbox.machine, pressing, r)
        }
        (PlannedRun::Machine(ready), _) => press(ready, None, &inbox.machine, pressing, r),
        (PlannedRun::Hand(_), _) => anyhow::bail!("name the port of the board that is pressed"),
    }
}

/// Says how far a run is, and whether its job was ended.
fn is_ended(pressing: &Mutex<Option<PressingPlan>>, r: &Reporter) -> bool {
    let plan = locked(pressing);
    let [made, failed] = plan.as_ref().map_or([0; 2], PressingPlan::made_and_failed);
    let total = plan.as_ref().map_or(0, |plan| plan.states.len());
    drop(plan);
    let progress = Progress {
        stage: "Pressing",
        done: made + failed,
        total,
    };
    r.report(progress).is_break()
}

/// Somebody goes through what is left.
fn press_by_hand(
    run: &HandRun,
    board: &Address,
    inbox: &Receiver<PressOrder>,
    pressing: &Mutex<Option<PressingPlan>>,
    r: &Reporter,
) -> anyhow::Result<RunEnd> {
    /// How often it is asked whether the job was ended.
    const EVERY: Duration = Duration::from_millis(50);
    if run.plan.left.is_empty() {
        return Ok(RunEnd::Finished);
    }
    if let Some(plan) = locked(pressing).as_mut() {
        plan.hand = Some((HandStep::Wait, None));
    }
    let (mut stopped, mut asked) = (false, Instant::now());
    let mut orders = || {
        // Each time it is asked the window is drawn.
        let ended = asked.elapsed() > EVERY && {
            asked = Instant::now();
            is_ended(pressing, r)
        };
        let order = if ended {
            Some(HandOrder::Stop.into())
        } else {
            inbox.try_recv().ok()
        };
        stopped |= order.is_some_and(|said| said.order == HandOrder::Stop);
        order
    };
    run.press_at(board.clone(), (&mut orders, false), |says| {
        if let Some(plan) = locked(pressing).as_mut() {
            plan.hear_hand(&says, run.plan.meant_n);
        }
    })?;
    Ok(if stopped {
        RunEnd::Stopped(BY_HAND.into())
    } else {
        RunEnd::Finished
    })
}

/// A machine goes through what is left.
fn press(
    ready: &Ready,
    ports: Option<(&Address, &Address)>,
    inbox: &Receiver<BenchOrder>,
    pressing: &Mutex<Option<PressingPlan>>,
    r: &Reporter,
) -> anyhow::Result<RunEnd> {
    let mut collector: Collector = ready.collector();
    if collector.left() == 0 {
        return Ok(RunEnd::Finished);
    }
    let mut ended = false;
    let mut orders = || {
        if is_ended(pressing, r) && !std::mem::replace(&mut ended, true) {
            return Some(BenchOrder::Stop);
        }
        inbox.try_recv().ok()
    };
    let tell = |news: CollectorNews| {
        let kept = ready.keep(&news);
        if let Some(plan) = locked(pressing).as_mut() {
            if let Err(why) = kept {
                plan.say(format!("{why:#}"));
            }
            plan.hear(news);
        }
    };
    if let Some(ports) = ports {
        return ready.press_at(&mut collector, ports, &mut orders, tell);
    }
    let watch = |p| r.report(p);
    press_on_simulated(ready, &mut collector, &watch, &mut orders, tell)
}
