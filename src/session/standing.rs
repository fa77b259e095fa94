//! The stages of the pipeline, and how each stands.

use super::jobs::Task;
use super::state::Session;
use crate::budget::Quality;
use crate::design::DesignStep;
use crate::link::ConnectionState;

/// Where no sites are left out as candidates, and what would leave some out.
pub const NOBODY_REDUCES: &str = "Nobody asks for fewer: greedy SVR chooses among candidates, a judge by regression compares sets with all of them together, and a fixed number may be asked for";

/// The stages, in the order of the pipeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    Part,
    Supports,
    #[default]
    Simulation,
    Feasible,
    Candidates,
    Selection,
    Evaluation,
    Report,
    Bench,
    Live,
}

impl Stage {
    pub const ALL: [Self; 10] = [
        Self::Part,
        Self::Supports,
        Self::Simulation,
        Self::Feasible,
        Self::Candidates,
        Self::Selection,
        Self::Evaluation,
        Self::Report,
        Self::Bench,
        Self::Live,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Part => "Part",
            Self::Supports => "Supports and material",
            Self::Simulation => "Simulation",
            Self::Feasible => "Feasible region",
            Self::Candidates => "Candidates",
            Self::Selection => "Selection",
            Self::Evaluation => "Evaluation",
            Self::Report => "Report",
            Self::Bench => "Bench",
            Self::Live => "Live",
        }
    }
}

/// How a stage stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    Open,
    Running,
    Current,
    /// Holds, and a finer one is asked for.
    Draft,
    Stale,
    Failed(String),
}

impl Session {
    /// How a stage stands.
    #[must_use]
    pub fn standing(&self, stage: Stage) -> Standing {
        match stage {
            Stage::Part => self.part_standing(),
            Stage::Supports if self.document.state.project.supports.is_empty() => Standing::Open,
            Stage::Supports => Standing::Current,
            Stage::Simulation => {
                let held = (self.results.simulation.as_ref()).map(|s| s.value.quality);
                self.standing_of(&Task::Simulate, self.simulation_holds(), held, None)
            }
            Stage::Feasible => self.feasible_standing(),
            Stage::Candidates => self.design_standing(DesignStep::Reduce),
            Stage::Selection => self.design_standing(DesignStep::Select),
            Stage::Evaluation => self.design_standing(DesignStep::Evaluate),
            Stage::Bench => self.bench_standing(),
            Stage::Live => self.live_standing(),
            Stage::Report if self.results.design.is_none() => Standing::Open,
            Stage::Report => match self.design_standing(DesignStep::Evaluate) {
                Standing::Failed(_) | Standing::Running => Standing::Stale,
                other => other,
            },
        }
    }

    fn part_standing(&self) -> Standing {
        match self.document.misshapen() {
            _ if self.document.asks_for_another_part() => Standing::Stale,
            Some(why) => Standing::Failed(why.to_owned()),
            None => Standing::Current,
        }
    }

    fn bench_standing(&self) -> Standing {
        let runs = |task| self.jobs.runs(task);
        if self.bench.goes_on() || runs(Task::Press) || runs(Task::PlanPresses) {
            return Standing::Running;
        }
        let made = self
            .bench
            .look(|p| (p.made_and_failed()[0], p.states.len()));
        match made {
            None | Some((0, _)) => Standing::Open,
            Some(_) if !self.plan_holds() => Standing::Stale,
            Some((made, all)) if made == all => Standing::Current,
            Some(_) => Standing::Draft,
        }
    }

    fn live_standing(&self) -> Standing {
        match self.live.state() {
            _ if [Task::Sense, Task::Board]
                .iter()
                .any(|t| self.jobs.runs(*t)) =>
            {
                Standing::Running
            }
            Some(ConnectionState::Live | ConnectionState::Ended) => Standing::Current,
            Some(ConnectionState::Waiting) => Standing::Running,
            Some(ConnectionState::Silent) => Standing::Failed("the board has fallen silent".into()),
            Some(ConnectionState::Gone) => Standing::Failed("unplugged".into()),
            None => Standing::Open,
        }
    }

    fn feasible_standing(&self) -> Standing {
        let shown = self.results.simulation.as_ref();
        if self.jobs.runs(Task::Filter) {
            Standing::Running
        } else if self.results.feasibility.is_none() {
            Standing::Open
        } else if self.current_verdicts().is_none() {
            Standing::Stale
        } else if shown.is_some_and(|s| s.value.quality < self.quality()) {
            Standing::Draft
        } else {
            Standing::Current
        }
    }

    fn design_standing(&self, step: DesignStep) -> Standing {
        let held = self.results.design.as_ref().map(|d| d.value.quality);
        self.standing_of(&Task::Design, self.design_holds(), held, Some(step))
    }

    /// `holds` says whether there is a result and whether it is of the project as it is; `step` which step
    /// of the job is meant.
    fn standing_of(
        &self,
        task: &dyn Fn(Quality) -> Task,
        holds: Option<bool>,
        held: Option<Quality>,
        step: Option<DesignStep>,
    ) -> Standing {
        let qualities = Quality::ALL;
        let running = qualities.iter().any(|&q| self.jobs.runs(task(q)));
        let at = self.drive.step();
        if running && (step.is_none() || step == at) {
            return Standing::Running;
        }
        let failed = (qualities.iter()).find_map(|&q| self.pipeline_failure(task(q)));
        if let Some(message) = failed.filter(|_| step.is_none() || step == at) {
            return Standing::Failed(message.to_owned());
        }
        match holds {
            None => Standing::Open,
            Some(false) => Standing::Stale,
            Some(true) if held < Some(self.quality()) => Standing::Draft,
            Some(true) => Standing::Current,
        }
    }
}
