//! The test-bed: a plan of presses, and a machine, or a simulated one, that goes through it in the background.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::jobs::{Task, stop};
use super::slot::Slot;
use super::state::Session;
use super::state::bench::{HoldGuard, PlanInputs, PressingPlan, locked};
use crate::bench::{Collector, CollectorNews, RunEnd};
use crate::budget::{Budget, Progress};
use crate::design::{Inputs, Sensing};
use crate::io::kept_model;
use crate::job::{Reporter, Stop};
use crate::link::{Address, BY_HAND, BenchOrder, Pace};
use crate::test_bed::{BenchRequest, PressingRun, Ready, press_on_simulated};

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
            |s, inputs, (sensing, ready)| {
                s.keep_sensing(&inputs, &sensing);
                if !s.bench.goes_on() {
                    *s.bench.locked() = Some(PressingPlan::new(inputs, ready));
                }
            },
        );
    }

    /// Presses what is left of the plan: at the ports that are named, or on a simulated bench.
    pub fn press_plan(&mut self) {
        let Some(begin) = self.begin_bench() else {
            return;
        };
        let ports = match self.bench_ports() {
            Ok(ports) => ports,
            Err(message) => return self.complain(message),
        };
        if ports.is_some() {
            // One listens to a board, and only one.
            self.disconnect();
        }
        let (orders, inbox) = channel();
        self.bench.orders = Some(orders);
        self.bench.paused = false;
        let pressing = Arc::clone(&self.bench.pressing);
        let inputs = begin.inputs.clone();
        let held = HoldGuard::new(&self.bench.runs);
        let work = move |r: &Reporter| {
            let _held = held;
            let (sensing, ready) = begin.ready(r)?;
            let plan = PressingPlan::new(begin.inputs, Arc::clone(&ready));
            *locked(&pressing) = Some(plan);
            let ended = press(&ready, ports.as_ref(), &inbox, &pressing, r);
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

    fn bench_ports(&self) -> Result<Option<(Address, Address)>, String> {
        let desk = &self.desk.bench;
        if desk.asked.simulated.is_some() {
            return Ok(None);
        }
        let port = |text: &str, what: &str, baud| match text.trim() {
            "" => Err(format!(
                "Name the {what}'s port, or press on a simulated bench"
            )),
            text => Ok(Address::parse(text, baud, Pace::Real)),
        };
        let printer = port(&desk.printer, "printer", desk.printer_baud)?;
        let board = port(&desk.board, "board", self.desk.baud)?;
        if let Some(recording) = [&printer, &board].into_iter().find(|p| p.is_recording()) {
            return Err(format!("{recording}: a recording cannot be pressed"));
        }
        Ok(Some((printer, board)))
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
    fn ready(&self, r: &Reporter) -> Result<(Arc<Sensing>, Arc<Ready>), Stop> {
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
        let ready = Ready::new(run, self.project.clone(), Arc::clone(&sensing)).map_err(failed)?;
        Ok((sensing, Arc::new(ready)))
    }
}

/// Goes through what is left. A job that is ended takes the tip back first.
fn press(
    ready: &Ready,
    ports: Option<&(Address, Address)>,
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
        let plan = locked(pressing);
        let [made, failed] = plan.as_ref().map_or([0; 2], PressingPlan::made_and_failed);
        drop(plan);
        let progress = Progress {
            stage: "Pressing",
            done: made + failed,
            total: ready.numbers.len(),
        };
        if r.report(progress).is_break() && !std::mem::replace(&mut ended, true) {
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
    if let Some((printer, board)) = ports {
        return ready.press_at(&mut collector, (printer, board), &mut orders, tell);
    }
    let watch = |p| r.report(p);
    press_on_simulated(ready, &mut collector, &watch, &mut orders, tell)
}
