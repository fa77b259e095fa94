//! What is kept computed: a goal, and the jobs that lead there. Draft answers come first, finer ones
//! follow while nothing moves; what no longer holds is ended, and only that is computed again.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use egui::Context;

use super::jobs::{Shared, Task};
use super::{DesignResult, SimulationResult, Studio, opening, saving};
use crate::budget::{Budget, Progress, Quality};
use crate::dataset::Site;
use crate::design::{self, Design, DesignError, Hooks, Inputs, Known, Simulated, StageTime, Step};
use crate::evaluation::Evaluation;
use crate::feasible::Feasibility;
use crate::io::artifacts::{self, as_chosen};
use crate::job::{Outcome, Reporter, Stop};
use crate::placement::{SelectorKind, SensorSet};
use crate::project::ChosenSite;

/// How long settings rest before what depends on them is computed again.
const STILL: Duration = Duration::from_millis(400);

/// What a job brings back.
pub(super) enum Finished {
    Simulation(Arc<Simulated>, Quality, f64, bool),
    Filtered(Arc<Feasibility>),
    Design(Arc<Design>, Box<Inputs>, Quality, f64),
    Exported(PathBuf),
    Estimate(f64),
    Judged(Arc<Evaluation>),
    InHand(Arc<design::InHand>),
    Helped(Box<super::helping::Helped>),
    Confused(Vec<crate::placement::expected_error::Pair>),
    Advised(Arc<crate::design::Advice>),
    Traded(Box<crate::io::trade_file::Record>),
    Field(Vec<f64>),
    /// Metres over the surface.
    Measured(f64),
    Pictured(PathBuf),
    Saved(Box<saving::Saved>),
    Opened(Box<opening::Opened>),
    Live(Box<super::live::Brought>),
}

/// The last results of a quality.
#[derive(Default)]
pub(super) struct Last {
    simulation: Option<SimulationResult>,
    design: Option<DesignResult>,
}

/// How far the road is to be kept computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Goal {
    Simulation,
    Design,
}

/// The running design's state, as its job shares it.
#[derive(Default)]
pub(super) struct Making {
    /// What the selector in the lead has chosen so far.
    pub sites: Vec<ChosenSite>,
    pub step: Option<Step>,
}

pub(super) struct Drive {
    goal: Option<Goal>,
    /// Whether a change starts what depends on it anew.
    pub follow: bool,
    /// Whether what a selection finds becomes the project's gauges: until one is moved by hand.
    pub take: bool,
    /// Whether a selection was asked for by hand and has not come yet.
    pressed: bool,
    /// What cannot be computed, from which inputs, and why.
    failed: Vec<(Task, String, String)>,
    seen: String,
    still_since: Option<Instant>,
    pub making: Shared<Making>,
}

impl Drive {
    /// Nothing asked for yet.
    pub fn following(follow: bool) -> Self {
        Self {
            goal: None,
            follow,
            take: false,
            pressed: false,
            failed: Vec::new(),
            seen: String::new(),
            still_since: None,
            making: Arc::default(),
        }
    }

    /// Nothing is to be computed until somebody asks again.
    pub fn rest(&mut self) {
        self.goal = None;
    }

    /// Why a task cannot be done from these inputs.
    pub fn failure(&self, task: Task, key: &str) -> Option<&str> {
        let failed = self.failed.iter().find(|(t, k, _)| *t == task && k == key);
        failed.map(|f| f.2.as_str())
    }

    pub fn fail(&mut self, task: Task, key: String, message: String) {
        self.failed.retain(|(t, _, _)| *t != task);
        self.failed.push((task, key, message));
    }
}

impl Studio {
    /// Simulates the project as it is now.
    pub fn simulate(&mut self, ctx: &Context) {
        self.ask(ctx, Goal::Simulation);
    }

    /// Selects and evaluates, simulating first where that is stale.
    pub fn select(&mut self, ctx: &Context) {
        self.drive.take = true;
        self.drive.pressed = true;
        self.ask(ctx, Goal::Design);
        // Where nothing is left to do, the gauges are at least those that were selected.
        if self.design_stands(self.quality()) {
            self.take_sites();
            self.drive.pressed = false;
        }
    }

    fn ask(&mut self, ctx: &Context, goal: Goal) {
        self.document.settle();
        self.drive.goal = self.drive.goal.max(Some(goal));
        self.drive.failed.clear();
        self.drive.seen = self.document.design_key();
        self.drive.still_since = None;
        self.advance(ctx);
    }

    pub(super) fn quality(&self) -> Quality {
        self.document.state.project.budget.quality
    }

    /// What may be spent.
    pub(super) fn budget(&self) -> Budget {
        self.document.state.project.budget.budget()
    }

    /// The simulation of a quality, where it holds for the project as it is.
    fn simulation_at(&self, quality: Quality) -> Option<Arc<Simulated>> {
        let last = self.last.get(&quality)?.simulation.as_ref()?;
        let holds = last.key == self.document.simulation_key_at(quality);
        holds.then(|| Arc::clone(&last.simulated))
    }

    /// Whether the shown simulation holds for the project as it is, in whatever quality it has.
    pub(super) fn simulation_holds(&self) -> Option<bool> {
        let s = self.simulation.as_ref()?;
        Some(s.key == self.document.simulation_key_at(s.quality))
    }

    /// As [`Self::simulation_holds`], of the design.
    pub(super) fn design_holds(&self) -> Option<bool> {
        let d = self.design.as_ref()?;
        Some(d.key == self.document.design_key_at(d.quality))
    }

    /// Whether there is a design of this quality or a better one that holds.
    fn design_stands(&self, quality: Quality) -> bool {
        self.design_holds() == Some(true)
            && self.design.as_ref().is_some_and(|d| d.quality >= quality)
    }

    /// Starts what is next on the way to the goal, when nothing moves.
    pub(super) fn advance(&mut self, ctx: &Context) {
        let Some(goal) = self.drive.goal else {
            return;
        };
        if self.document.asks_for_another_part() {
            return;
        }
        let key = self.document.design_key();
        if key != self.drive.seen {
            if !self.drive.follow {
                self.drive.rest();
                return;
            }
            self.drive.seen = key;
            self.drive.still_since = Some(Instant::now());
            self.end_outdated();
            self.show_last();
        }
        if let Some(since) = self.drive.still_since {
            let rest = STILL.saturating_sub(since.elapsed());
            if !rest.is_zero() {
                ctx.request_repaint_after(rest);
                return;
            }
            // Whatever ends the gesture is an event of its own.
            if is_moving(ctx) {
                return;
            }
            self.drive.still_since = None;
        }
        match self.next_task(goal) {
            Some(task) if self.jobs.runs(task) => {}
            Some(Task::Simulate(quality)) => self.start_simulation(ctx, quality),
            Some(Task::Design(quality)) => self.start_design(ctx, quality),
            _ if self.drive.follow => {}
            _ => self.drive.rest(),
        }
    }

    fn next_task(&self, goal: Goal) -> Option<Task> {
        let asked = self.quality();
        let reached = match goal {
            Goal::Simulation => self.simulation_at(asked).is_some(),
            Goal::Design => self.design_stands(asked),
        };
        if reached {
            return None;
        }
        let next = |quality: Quality| {
            if self.simulation_at(quality).is_none() {
                let key = self.document.simulation_key_at(quality);
                return Some((Task::Simulate(quality), key));
            }
            let design = goal == Goal::Design && !self.design_stands(quality);
            design.then(|| (Task::Design(quality), self.document.design_key_at(quality)))
        };
        let draft = Some(Quality::Draft).filter(|q| *q < asked).and_then(next);
        let (task, key) = draft.or_else(|| next(asked))?;
        self.drive.failure(task, &key).is_none().then_some(task)
    }

    /// Ends what runs for settings that have changed.
    fn end_outdated(&mut self) {
        let document = &self.document;
        let outdated: Vec<Task> = (self.jobs.running.iter())
            .filter(|r| match r.task {
                Task::Simulate(q) => r.job.key != document.simulation_key_at(q),
                Task::Design(q) => r.job.key != document.design_key_at(q),
                _ => false,
            })
            .map(|r| r.task)
            .collect();
        self.jobs.cancel(|t| outdated.contains(&t));
    }

    fn start_simulation(&mut self, ctx: &Context, quality: Quality) {
        let inputs = self.document.inputs();
        let key = self.document.simulation_key_at(quality);
        let elements = self.document.elements_key_at(quality);
        let last = self
            .last
            .get(&quality)
            .and_then(|last| last.simulation.as_ref());
        let last = last.filter(|s| s.elements == elements);
        let last = last.map(|s| Arc::clone(&s.simulated));
        self.jobs
            .start(ctx, Task::Simulate(quality), key, move |r| {
                let start = Instant::now();
                let budget = inputs.project.budget.budget_at(quality);
                let watch = |p| r.report(p);
                let again = last.is_some();
                let simulated = match last {
                    // Only what gauges report has changed.
                    Some(last) => design::simulate_again(&inputs, &budget, &last, &watch),
                    None => design::simulate(&inputs, &budget, &watch),
                };
                let simulated = simulated.map_err(|e| stop(&e))?;
                let seconds = start.elapsed().as_secs_f64();
                Ok(Finished::Simulation(
                    Arc::new(simulated),
                    quality,
                    seconds,
                    again,
                ))
            });
    }

    fn start_design(&mut self, ctx: &Context, quality: Quality) {
        let Some(simulated) = self.simulation_at(quality) else {
            return;
        };
        let inputs = self.document.inputs();
        let key = self.document.design_key_at(quality);
        let (simulated, known) = self.known(quality, simulated);
        let last = self
            .last
            .get(&quality)
            .and_then(|last| last.simulation.as_ref());
        let seconds = last.map_or(0.0, |s| s.seconds);
        let making = Shared::<Making>::default();
        self.drive.making = Arc::clone(&making);
        self.jobs.start(ctx, Task::Design(quality), key, move |r| {
            let start = Instant::now();
            let mut design = make(&inputs, simulated, quality, known, &making, r)?;
            let stage = StageTime {
                stage: "simulate",
                seconds,
            };
            design.seconds.insert(0, stage);
            let seconds = start.elapsed().as_secs_f64();
            let inputs = Box::new(inputs);
            Ok(Finished::Design(Arc::new(design), inputs, quality, seconds))
        });
    }

    /// What of the last design of a quality still holds, and the simulation to go on from: where its gauges do, that
    /// which has those off the lattice.
    fn known(&self, quality: Quality, simulated: Arc<Simulated>) -> (Arc<Simulated>, Known) {
        let last = self
            .last
            .get(&quality)
            .and_then(|last| last.design.as_ref());
        let same = |d: &&DesignResult| d.design.simulated.is_one_with(&simulated);
        let Some(last) = last.filter(same) else {
            return (simulated, Known::default());
        };
        let design = &last.design;
        let reduced = self.document.candidates_key_at(quality) == last.keys[0];
        let selections = self.document.selection_key_at(quality) == last.keys[1];
        let known = Known {
            reduced: reduced
                .then(|| (Arc::clone(&design.feasibility), Arc::clone(&design.reduced))),
            selections: selections.then(|| Arc::clone(&design.selections)),
            truth: Some(Arc::clone(&design.truth)),
            evaluation: selections.then(|| Arc::clone(&design.evaluation)),
        };
        if selections {
            (Arc::clone(&design.simulated), known)
        } else {
            (simulated, known)
        }
    }

    /// The simulation that is shown has the gauges that the design that is shown moved off its lattice.
    fn show_refined(&mut self) {
        let (Some(simulation), Some(design)) = (&mut self.simulation, &self.design) else {
            return;
        };
        let refined = &design.design.simulated;
        if simulation.simulated.is_one_with(refined) && !Arc::ptr_eq(&simulation.simulated, refined)
        {
            simulation.simulated = Arc::clone(refined);
            self.expected.ask_again();
        }
    }

    /// Takes in what jobs have brought.
    pub(super) fn collect_jobs(&mut self, ctx: &Context) {
        for (task, key, outcome) in self.jobs.collect() {
            match outcome {
                Outcome::Done(finished) => self.finished(ctx, finished, key),
                Outcome::Failed(message) => {
                    self.complain(format!("{}: {message}", task.name()));
                    self.drive.fail(task, key, message);
                }
                Outcome::Cancelled => {}
            }
            ctx.request_repaint();
        }
        if !self.jobs.runs(Task::Save)
            && let Some(path) = self.save_next.take()
        {
            self.save_to(ctx, &path);
        }
    }

    fn finished(&mut self, ctx: &egui::Context, finished: Finished, key: String) {
        match finished {
            Finished::Simulation(simulated, quality, seconds, again) => {
                if key == self.document.simulation_key_at(quality) {
                    self.take_simulation(simulated, quality, key, (seconds, again));
                } else {
                    self.dropped("simulation");
                }
            }
            Finished::Filtered(verdicts) => {
                if Some(&key) == self.shown_feasible_key().as_ref() {
                    self.feasibility = Some((key, verdicts));
                }
            }
            Finished::Design(design, inputs, quality, seconds) => {
                if key == self.document.design_key_at(quality) {
                    self.take_design(design, *inputs, quality, seconds);
                } else {
                    self.dropped("selection");
                }
            }
            Finished::Exported(folder) => {
                let report = folder.join("report.html");
                self.tell(format!("The report is in {}", report.display()));
            }
            Finished::Opened(opened) => self.take_opened(*opened),
            Finished::Saved(saved) => self.take_saved(*saved),
            Finished::Live(brought) => self.take_live(ctx, *brought, key),
            Finished::Estimate(mm) if key == self.by_hand_key() => {
                self.by_hand.estimate = Some(mm);
            }
            Finished::Judged(found) if key == self.by_hand_key() => {
                self.by_hand.exact = Some(found);
            }
            // Of gauges that have moved on.
            Finished::Estimate(_) | Finished::Judged(..) => {}
            Finished::InHand(in_hand) => self.take_in_hand(key, in_hand),
            Finished::Helped(helped) => self.take_help(*helped, &key),
            Finished::Confused(pairs) => self.take_confusions(key, pairs),
            Finished::Traded(record) => self.take_trade(*record, &key),
            Finished::Advised(advice) => self.advice = Some((key, advice)),
            Finished::Field(values) => self.slow = Some((key, Arc::new(values))),
            Finished::Measured(over) => self.measured(&key, over),
            Finished::Pictured(path) => self.tell(format!("The picture is in {}", path.display())),
        }
    }

    pub(super) fn dropped(&mut self, what: &str) {
        self.tell(format!(
            "The {what} was for settings that have changed since, and was dropped"
        ));
    }

    fn take_simulation(
        &mut self,
        simulated: Arc<Simulated>,
        quality: Quality,
        key: String,
        (seconds, again): (f64, bool),
    ) {
        let result = SimulationResult {
            simulated,
            key,
            elements: self.document.elements_key_at(quality),
            again,
            quality,
            seconds,
        };
        self.last.entry(quality).or_default().simulation = Some(result.clone());
        let better = self
            .simulation
            .as_ref()
            .is_some_and(|s| s.quality > quality);
        if !(better && self.simulation_holds() == Some(true)) {
            self.simulation = Some(result);
        }
    }

    fn take_design(&mut self, design: Arc<Design>, inputs: Inputs, quality: Quality, seconds: f64) {
        let keys = [
            self.document.candidates_key_at(quality),
            self.document.selection_key_at(quality),
        ];
        self.hold_to_promise(&design, quality);
        let feasibility = Arc::clone(&design.feasibility);
        let first = self.design.is_none();
        let result = DesignResult {
            key: self.document.design_key_at(quality),
            keys,
            design,
            inputs,
            quality,
            seconds,
        };
        self.last.entry(quality).or_default().design = Some(result.clone());
        self.design = Some(result);
        self.show_refined();
        if self.shown_feasible_key() == Some(self.document.feasible_key_at(quality)) {
            self.feasibility = Some((self.document.feasible_key_at(quality), feasibility));
        }
        if first {
            self.results = super::results::Tab::Error;
        }
        self.follow_lead();
        // Gauges that undo has brought back may be those of this very design.
        self.drive.take |= self.as_designed();
        if self.drive.take {
            self.take_sites();
        }
    }

    /// Shows what is there already of the project as it is: after a change was taken back, most often.
    fn show_last(&mut self) {
        self.forget_promise();
        for quality in Quality::ALL {
            let Some(last) = self.last.get(&quality) else {
                continue;
            };
            let (simulation, design) = (last.simulation.clone(), last.design.clone());
            let shown = |q: Quality| q > quality;
            if let Some(s) = simulation
                && s.key == self.document.simulation_key_at(quality)
                && !(self.simulation_holds() == Some(true)
                    && self.simulation.as_ref().is_some_and(|s| shown(s.quality)))
            {
                self.simulation = Some(s);
            }
            if let Some(d) = design
                && d.key == self.document.design_key_at(quality)
                && !(self.design_holds() == Some(true)
                    && self.design.as_ref().is_some_and(|d| shown(d.quality)))
            {
                self.design = Some(d);
                self.follow_lead();
                if self.drive.take {
                    self.take_sites();
                }
            }
        }
        self.show_refined();
    }

    /// The project's gauges are those that the design chose.
    pub(super) fn take_sites(&mut self) {
        let Some(result) = &self.design else {
            return;
        };
        let design = &result.design;
        let sites = as_chosen(&design.simulated.dataset.sites, design.chosen());
        if self.document.state.project.selection.sites != sites {
            if std::mem::take(&mut self.drive.pressed) {
                // Somebody asked for them: what was there before can be had back.
                self.document.settle();
                self.document.state.project.selection.sites = sites;
                self.document.settle();
            } else {
                self.document.adopt_sites(sites);
            }
            self.picked.clear();
        }
        self.drive.take = true;
    }

    /// Another selector's sites are shown when the project names it: all are there already.
    pub(super) fn follow_lead(&mut self) {
        let asked = self.document.state.project.selection.selector;
        let Some(result) = &mut self.design else {
            return;
        };
        let has = result.design.selections.iter().any(|s| s.selector == asked);
        if result.design.lead == asked || !has {
            return;
        }
        let mut design = Design::clone(&result.design);
        design.lead = asked;
        result.design = Arc::new(design);
        result.inputs.project.selection.selector = asked;
        if self.drive.take && self.design_holds() == Some(true) {
            self.take_sites();
        }
    }

    /// The gauges to draw: those of the running selection as far as it has come where there is no draft of
    /// it, else the project's.
    pub(super) fn gauges(&self) -> Vec<ChosenSite> {
        let running = self.drive.take
            && self.design_holds() != Some(true)
            && (self.jobs.running.iter()).any(|r| matches!(r.task, Task::Design(_)));
        let making = running
            .then(|| self.drive.making.lock().ok().map(|m| m.sites.clone()))
            .flatten()
            .filter(|sites| !sites.is_empty());
        making.unwrap_or_else(|| self.document.state.project.selection.sites.clone())
    }

    /// The key of the filters' verdicts on the simulation that is shown, where it holds.
    pub(super) fn shown_feasible_key(&self) -> Option<String> {
        let quality = self.simulation.as_ref()?.quality;
        (self.simulation_holds() == Some(true)).then(|| self.document.feasible_key_at(quality))
    }

    /// Filters anew when anything they depend on has changed and no stroke is under way.
    pub(super) fn refresh_feasibility(&mut self, ctx: &Context) {
        if ctx.input(|i| i.pointer.any_down()) || self.view.is_stroking() {
            return;
        }
        let Some(key) = self.shown_feasible_key() else {
            return;
        };
        let known = self.feasibility.as_ref().is_some_and(|(k, _)| *k == key);
        let under_way =
            (self.jobs.running.iter()).any(|r| r.task == Task::Filter && r.job.key == key);
        let failed = self.drive.failure(Task::Filter, &key).is_some();
        let Some(simulation) = self
            .simulation
            .as_ref()
            .filter(|_| !known && !under_way && !failed)
        else {
            return;
        };
        let simulated = Arc::clone(&simulation.simulated);
        let inputs = self.document.inputs();
        self.jobs.start(ctx, Task::Filter, key, move |_| {
            Ok(Finished::Filtered(Arc::new(design::filter(
                &inputs, &simulated,
            ))))
        });
    }

    /// Writes the report and what belongs to it into a folder.
    pub fn export(&mut self, ctx: &Context, folder: PathBuf) {
        let Some(result) = &self.design else {
            self.complain("There is no design to report yet. Press “Select gauges” first");
            return;
        };
        let design = if self.as_designed() || self.document.state.project.selection.sites.is_empty()
        {
            Arc::clone(&result.design)
        } else if let Some(design) = self.design_by_hand() {
            Arc::new(design)
        } else {
            return self.complain(
                "The gauges are not those that were selected, and are not judged yet: wait until their error is shown, or press “Select gauges”, and export again",
            );
        };
        let inputs = result.inputs.clone();
        let (bundled, mesh) = (self.document.bundled, self.document.mesh_path.clone());
        let taken_in = self.document.repairs.in_words(inputs.project.part.body);
        self.jobs.start(ctx, Task::Export, String::new(), move |_| {
            let mesh_path = if bundled {
                saving::bundled_mesh_in(&folder, &mesh).map_err(Stop::Failed)?
            } else {
                mesh
            };
            let provenance = artifacts::Provenance {
                mesh_path: &mesh_path,
                version: env!("CARGO_PKG_VERSION"),
                taken_in,
            };
            artifacts::write_all(&folder, &inputs, &design, &provenance)
                .map_err(|e| Stop::Failed(e.to_string()))?;
            Ok(Finished::Exported(folder))
        });
    }

    /// Ends whatever runs, at once; what is over before anybody notices goes on.
    pub fn cancel(&mut self) {
        let quick = |task| {
            matches!(
                task,
                Task::Filter | Task::Field | Task::Expect | Task::Confuse
            )
        };
        let ended = self.end_jobs(|task| !quick(task));
        if !ended.is_empty() {
            self.tell(format!("Cancelled: {}", ended.join(", ")));
        }
    }

    /// Ends some jobs, and does not begin them again by itself; their names.
    pub(super) fn end_jobs(&mut self, which: impl Fn(Task) -> bool) -> Vec<String> {
        let ended = self.jobs.cancel(which);
        for (task, key) in &ended {
            match task {
                Task::Simulate(_) | Task::Design(_) => self.drive.rest(),
                task => self.drive.fail(*task, key.clone(), "cancelled".into()),
            }
        }
        ended.into_iter().map(|(task, _)| task.name()).collect()
    }
}

/// Everything after the simulation.
fn make(
    inputs: &Inputs,
    simulated: Arc<Simulated>,
    quality: Quality,
    known: Known,
    making: &Mutex<Making>,
    r: &Reporter,
) -> Result<Design, Stop> {
    let start = Instant::now();
    let first = inputs.project.selection.selector;
    let kinds = inputs.project.selectors();
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
    let budget = inputs.project.budget.budget_at(quality);
    design::run_step_by_step(inputs, simulated, &kinds, &budget, known, &hooks)
        .map_err(|e| stop(&e))
}

/// Whether a hand is at the settings.
fn is_moving(ctx: &Context) -> bool {
    ctx.input(|i| i.pointer.any_down())
}

/// A stage's error as a job's end.
pub(super) fn stop(error: &DesignError) -> Stop {
    if error.is_cancelled() {
        Stop::Cancelled
    } else {
        Stop::Failed(error.to_string())
    }
}
