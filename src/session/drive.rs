//! What is kept computed: a goal, and the jobs that lead there. Draft answers come first, finer ones follow while nothing
//! moves; what no longer holds is ended, and only that is computed again.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::attention::Attention;
use super::jobs::{Task, stop};
use super::state::Session;
use super::state::drive::{DriveGoal, RunningDesign};
use super::state::results::{DesignResult, SimulationResult};
use crate::budget::{Progress, Quality};
use crate::dataset::Site;
use crate::design::{
    self, Design, DesignRequest, Hooks, Inputs, KnownStages, Simulated, StageTime,
};
use crate::io::artifacts::as_chosen;
use crate::job::{Reporter, Stop};
use crate::placement::{SelectorKind, SensorSet};
use crate::project::ChosenSite;

/// How long settings rest before what depends on them is computed again.
const STILL: Duration = Duration::from_millis(400);

impl Session {
    /// Simulates the project as it is now.
    pub fn simulate(&mut self) {
        self.ask(DriveGoal::Simulation);
    }

    /// Selects and evaluates, simulating first where that is stale.
    pub fn select(&mut self) {
        self.drive.take = true;
        self.drive.pressed = true;
        self.ask(DriveGoal::Design);
        // Where nothing is left to do, the gauges are at least those that were selected.
        if self.design_stands(self.quality()) {
            self.take_sites();
            self.drive.pressed = false;
        }
    }

    fn ask(&mut self, goal: DriveGoal) {
        self.document.settle();
        self.drive.goal = self.drive.goal.max(Some(goal));
        self.jobs.forget_failures();
        self.drive.seen = Some(self.document.design_inputs(self.quality()));
        self.drive.still_since = None;
        self.go_on(&Attention::default());
    }

    /// Whether there is a design of this quality or a better one that holds.
    fn design_stands(&self, quality: Quality) -> bool {
        self.design_holds() == Some(true)
            && (self.results.design.as_ref()).is_some_and(|d| d.value.quality >= quality)
    }

    /// Starts what is next on the way to the goal, when nothing moves.
    pub(super) fn go_on(&mut self, attention: &Attention) {
        let Some(goal) = self.drive.goal else {
            return;
        };
        if self.document.asks_for_another_part() {
            return;
        }
        let now = Some(self.document.design_inputs(self.quality()));
        if now != self.drive.seen {
            if !self.desk.follow {
                self.drive.goal = None;
                return;
            }
            self.drive.seen = now;
            self.drive.still_since = Some(Instant::now());
            self.end_outdated();
            self.show_last();
        }
        if let Some(since) = self.drive.still_since {
            let rest = STILL.saturating_sub(since.elapsed());
            if !rest.is_zero() {
                return self.wake.after(rest);
            }
            // Whatever ends the gesture is an event of its own.
            if attention.hand {
                return;
            }
            self.drive.still_since = None;
        }
        match self.next_task(goal) {
            Some(task) if self.jobs.runs(task) => {}
            Some(Task::Simulate(quality)) => self.start_simulation(quality),
            Some(Task::Design(quality)) => self.start_design(quality),
            _ if self.desk.follow => {}
            _ => self.drive.goal = None,
        }
    }

    fn next_task(&self, goal: DriveGoal) -> Option<Task> {
        let asked = self.quality();
        let draft = Some(Quality::Draft).filter(|q| *q < asked);
        let next = |quality| self.next_task_at(goal, quality);
        let reached = match goal {
            DriveGoal::Simulation => self.simulation_at(asked).is_some(),
            DriveGoal::Design => self.design_stands(asked),
        };
        let task = if reached {
            None
        } else {
            draft.and_then(next).or_else(|| next(asked))
        };
        task.filter(|task| self.pipeline_failure(*task).is_none())
    }

    fn next_task_at(&self, goal: DriveGoal, quality: Quality) -> Option<Task> {
        if self.simulation_at(quality).is_none() {
            return Some(Task::Simulate(quality));
        }
        let design = goal == DriveGoal::Design && !self.design_stands(quality);
        design.then_some(Task::Design(quality))
    }

    /// Why a task of the pipeline cannot be done with the project as it is.
    #[must_use]
    pub fn pipeline_failure(&self, task: Task) -> Option<&str> {
        match task {
            Task::Simulate(q) => {
                let inputs = self.document.simulation_inputs(q);
                self.jobs.failure(task, &inputs)
            }
            Task::Design(q) => self.jobs.failure(task, &self.document.design_inputs(q)),
            _ => None,
        }
    }

    /// Ends what runs for settings that have changed.
    fn end_outdated(&mut self) {
        let document = &self.document;
        self.jobs.cancel_running(|r| match r.task {
            Task::Simulate(q) => !r.is_on(&document.simulation_inputs(q)),
            Task::Design(q) => !r.is_on(&document.design_inputs(q)),
            _ => false,
        });
    }

    fn start_simulation(&mut self, quality: Quality) {
        let snapshot = self.document.inputs();
        let inputs = self.document.simulation_inputs(quality);
        let last = self.results.last_simulation(quality);
        let last = last.filter(|s| s.inputs.elements == inputs.elements);
        let last = last.map(|s| Arc::clone(&s.value.simulated));
        let work = move |r: &Reporter| {
            let start = Instant::now();
            let budget = snapshot.project.budget.budget_at(quality);
            let watch = |p| r.report(p);
            let again = last.is_some();
            let simulated = match last {
                // Only what gauges report has changed.
                Some(last) => design::simulate_again(&snapshot, &budget, &last, &watch),
                None => design::simulate(&snapshot, &budget, &watch),
            };
            Ok(SimulationResult {
                simulated: Arc::new(simulated.map_err(|e| stop(&e))?),
                again,
                quality,
                seconds: start.elapsed().as_secs_f64(),
            })
        };
        let task = Task::Simulate(quality);
        self.jobs.start(task, inputs, work, Self::take_simulation);
    }

    fn start_design(&mut self, quality: Quality) {
        let Some(simulated) = self.simulation_at(quality) else {
            return;
        };
        let snapshot = self.document.inputs();
        let (simulated, known) = self.known(quality, simulated);
        let last = self.results.last_simulation(quality);
        let simulate_s = last.map_or(0.0, |s| s.value.seconds);
        let making = Arc::<Mutex<RunningDesign>>::default();
        self.drive.making = Arc::clone(&making);
        let work = move |r: &Reporter| {
            let start = Instant::now();
            let mut design = make(&snapshot, simulated, quality, known, &making, r)?;
            let stage = StageTime {
                stage: "simulate",
                seconds: simulate_s,
            };
            design.seconds.insert(0, stage);
            Ok(DesignResult {
                design: Arc::new(design),
                snapshot,
                quality,
                seconds: start.elapsed().as_secs_f64(),
            })
        };
        let inputs = self.document.design_inputs(quality);
        let task = Task::Design(quality);
        self.jobs.start(task, inputs, work, Self::take_design);
    }

    /// What of the last design of a quality still holds, and the simulation to go on from: where its gauges do, that
    /// which has those off the lattice.
    fn known(&self, quality: Quality, simulated: Arc<Simulated>) -> (Arc<Simulated>, KnownStages) {
        let last = self.results.last_design(quality);
        let last = last.filter(|d| d.value.design.simulated.is_one_with(&simulated));
        let Some(last) = last else {
            return (simulated, KnownStages::default());
        };
        let design = &last.value.design;
        let now = self.document.selection_inputs(quality);
        let reduced = last.inputs.selection.reduction == now.reduction;
        let selections = last.inputs.selection == now;
        let known = KnownStages {
            reduced: reduced
                .then(|| (Arc::clone(&design.feasibility), Arc::clone(&design.reduced))),
            selections: selections.then(|| Arc::clone(&design.selections)),
            reference: Some(Arc::clone(&design.reference)),
            evaluation: selections.then(|| Arc::clone(&design.evaluation)),
        };
        if selections {
            (Arc::clone(&design.simulated), known)
        } else {
            (simulated, known)
        }
    }

    /// The gauges to draw: those of the running selection as far as it has come where there is no draft of it, else the
    /// project's.
    #[must_use]
    pub fn gauges(&self) -> Vec<ChosenSite> {
        let of_design = |task| matches!(task, Task::Design(_));
        let running = self.drive.take
            && self.design_holds() != Some(true)
            && self.jobs.running().iter().any(|r| of_design(r.task));
        let making = running.then(|| self.drive.chosen()).flatten();
        making.unwrap_or_else(|| self.document.state.project.selection.sites.clone())
    }

    /// Ends whatever runs, at once; what is over before anybody notices goes on.
    pub fn cancel(&mut self) {
        let quick = |task| {
            matches!(
                task,
                Task::Filter | Task::Field | Task::Expect | Task::Confuse | Task::UnitLimb
            )
        };
        // A run at the bench has a stop of its own.
        let ended = self.end_jobs(|task| !quick(task) && task != Task::Press);
        if !ended.is_empty() {
            self.tell(format!("Cancelled: {}", ended.join(", ")));
        }
    }

    /// Ends some jobs, and does not begin them again by itself; their names.
    pub fn end_jobs(&mut self, which: impl Fn(Task) -> bool) -> Vec<String> {
        let ended = self.jobs.end(which);
        if ended.iter().any(|task| task.is_of_pipeline()) {
            self.drive.goal = None;
        }
        ended.into_iter().map(Task::name).collect()
    }
}

/// Everything after the simulation.
fn make(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    quality: Quality,
    known: KnownStages,
    making: &Mutex<RunningDesign>,
    r: &Reporter,
) -> Result<Design, Stop> {
    let start = Instant::now();
    let first = inputs.project.selection.selector;
    let hooks = Hooks {
        clock: &|| start.elapsed().as_secs_f64(),
        watch: &|p: Progress| r.report(p),
        found: &|kind: SelectorKind, set: &SensorSet, sites: &[Site]| {
            if kind == first
                && let Ok(mut making) = making.lock()
            {
                making.sites = as_chosen(sites, &set.sites);
            }
        },
        entered: &|step| {
            if let Ok(mut making) = making.lock() {
                making.step = Some(step);
            }
        },
    };
    let asked = DesignRequest {
        inputs,
        kinds: &inputs.project.selectors(),
        budget: &inputs.project.budget.budget_at(quality),
    };
    design::run_step_by_step(&asked, simulated, known, &hooks).map_err(|e| stop(&e))
}
