//! One unit of a study: its project, its design, and what is said of it.

use std::path::Path;
use std::time::Instant;

use serde_json::Map;

use super::shared::{SharedSimulations, SimulationKey, StudyUnit};
use crate::budget::Watch;
use crate::design::{self, DesignError, DesignRequest};
use crate::io::cpu_seconds;
use crate::io::project_file::LoadedProject;
use crate::io::study_folder::{StudyFolder, UnitCost, UnitOutcome, plain};
use crate::parameter_study::{Figure, ParameterStudy, figures};
use crate::varied::UnitBase;

/// What units are made on: the base, and simulations that several of them need.
pub struct Workbench {
    pub base: UnitBase,
    shared: SharedSimulations,
}

impl Workbench {
    /// For the units of a study whose paths start from a folder.
    ///
    /// # Errors
    /// Where the base is not there.
    pub fn new(study: &ParameterStudy, home: &Path) -> anyhow::Result<Self> {
        Ok(Self {
            base: UnitBase::new(study, home)?,
            shared: SharedSimulations::default(),
        })
    }

    /// Computes a unit, one of so many beside each other, among whom the processor's time is divided.
    ///
    /// # Errors
    /// What is not the unit's own fault: a base that cannot be read any more, too little memory, a stop.
    pub fn compute(
        &mut self,
        at: StudyUnit,
        beside: usize,
        watch: Watch,
    ) -> anyhow::Result<(UnitOutcome, UnitCost)> {
        let (cpu, start) = (cpu_seconds(), Instant::now());
        let (study, unit) = (&at.folder.study, at.unit);
        let values = at.points.values(unit);
        let named = study.axes.iter().zip(&values);
        let plan = &at.folder.plan;
        let mut outcome = UnitOutcome {
            version: plan.version.clone(),
            study: plan.study.clone(),
            base: plan.base.clone(),
            unit,
            values: named
                .map(|(a, v)| (a.key.clone(), plain(v)))
                .collect::<Map<_, _>>(),
            figures: Vec::new(),
            error: None,
            cautions: Vec::new(),
        };
        let mut shared = false;
        match self.base.project(study, &values) {
            Err(error) if self.base.is_gone() => return Err(error),
            Err(error) => outcome.error = Some(self.base.without_home(&format!("{error:#}"))),
            Ok(loaded) => match self.designed(loaded, at, watch, &mut shared) {
                Ok((figures, cautions)) => {
                    (outcome.figures, outcome.cautions) = (figures, cautions);
                }
                Err(error) if is_ours(&error) => return Err(error.into()),
                Err(error) => outcome.error = Some(error.to_string()),
            },
        }
        let cost = UnitCost {
            unit,
            cpu_seconds: (cpu_seconds() - cpu) / beside as f64,
            seconds: start.elapsed().as_secs_f64(),
            shared,
        };
        Ok((outcome, cost))
    }

    /// A unit was written: what nobody needs any more is taken away.
    pub fn tidy(&mut self, folder: &StudyFolder) {
        self.shared.tidy(folder);
    }

    /// The figures of a project's design and its cautions.
    fn designed(
        &mut self,
        loaded: LoadedProject,
        at: StudyUnit,
        watch: Watch,
        shared: &mut bool,
    ) -> Result<(Vec<Figure>, Vec<String>), DesignError> {
        loaded.inputs.project.check()?;
        let inputs = loaded.inputs.clone();
        let budget = inputs.project.budget.budget();
        let made_from = (&inputs, SimulationKey::of(loaded));
        design::check_required(&inputs)?;
        let simulated = (self.shared).simulated(at, made_from, watch)?;
        *shared = simulated.1;
        let begun = Instant::now();
        let clock = || begun.elapsed().as_secs_f64();
        let asked = DesignRequest {
            inputs: &inputs,
            kinds: &inputs.project.selectors(),
            budget: &budget,
        };
        let design = design::run_from(&asked, simulated.0, &clock, watch)?;
        let found = figures(&inputs, &design, &at.folder.study)?;
        Ok((found, design.cautions()))
    }
}

/// Whether a failure is of this machine and moment, and not of the unit.
fn is_ours(error: &DesignError) -> bool {
    let memory = match error {
        DesignError::Elastic(error) => error.is_memory(),
        DesignError::TooLarge { .. } => true,
        _ => false,
    };
    memory || error.is_cancelled()
}
