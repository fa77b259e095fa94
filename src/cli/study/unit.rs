//! One unit of a study: its project, its design, and what is said of it.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::Map;

use crate::budget::Watch;
use crate::design::{self, DesignError, Simulated};
use crate::document::{Document, SimulationInputs};
use crate::io::cpu_seconds;
use crate::io::project_file::LoadedProject;
use crate::io::study_folder::{StudyFolder, UnitCost, UnitOutcome, plain};
use crate::mesh::TriMesh;
use crate::parameter_study::{Figure, ParameterStudy, Points, figures};
use crate::varied::UnitBase;

/// What units are made on: the base, and the last simulation, which the next unit may share.
pub struct Workbench {
    pub base: UnitBase,
    last: Option<MadeSimulation>,
}

/// A simulation with what it was made from.
struct MadeSimulation {
    inputs: SimulationInputs,
    part: Arc<TriMesh>,
    simulated: Arc<Simulated>,
}

impl MadeSimulation {
    /// Whether it is of these inputs on this part: of another part the inputs say nothing.
    fn is_of(&self, inputs: &SimulationInputs, part: &TriMesh) -> bool {
        self.inputs == *inputs
            && self.part.positions() == part.positions()
            && self.part.triangles() == part.triangles()
    }
}

impl Workbench {
    /// For the units of a study whose paths start from a folder.
    ///
    /// # Errors
    /// Where the base is not there.
    pub fn new(study: &ParameterStudy, home: &Path) -> anyhow::Result<Self> {
        Ok(Self {
            base: UnitBase::new(study, home)?,
            last: None,
        })
    }

    /// Computes a unit, one of so many beside each other, among whom the processor's time is divided.
    ///
    /// # Errors
    /// What is not the unit's own fault: a base that cannot be read any more, too little memory, a stop.
    pub fn compute(
        &mut self,
        (folder, points): (&StudyFolder, &Points),
        unit: usize,
        beside: usize,
        watch: Watch,
    ) -> anyhow::Result<(UnitOutcome, UnitCost)> {
        let (cpu, start) = (cpu_seconds(), Instant::now());
        let study = &folder.study;
        let values = points.values(unit);
        let named = study.axes.iter().zip(&values);
        let plan = &folder.plan;
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
            Ok(loaded) => match self.designed(loaded, study, watch, &mut shared) {
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

    /// The figures of a project's design and its cautions.
    fn designed(
        &mut self,
        loaded: LoadedProject,
        study: &ParameterStudy,
        watch: Watch,
        shared: &mut bool,
    ) -> Result<(Vec<Figure>, Vec<String>), DesignError> {
        loaded.inputs.project.check()?;
        let inputs = loaded.inputs.clone();
        let budget = inputs.project.budget.budget();
        let part = Arc::clone(&inputs.part);
        let key = Document::new(loaded, None).simulation_inputs(inputs.project.budget.quality);
        let known = self.last.take().filter(|made| made.is_of(&key, &part));
        *shared = known.is_some();
        let simulated = match known {
            Some(made) => made.simulated,
            None => Arc::new(design::simulate(&inputs, &budget, watch)?),
        };
        self.last = Some(MadeSimulation {
            inputs: key,
            part,
            simulated: Arc::clone(&simulated),
        });
        let kinds = inputs.project.selectors();
        let begun = Instant::now();
        let clock = || begun.elapsed().as_secs_f64();
        let design = design::run_from(&inputs, simulated, &kinds, &budget, &clock, watch)?;
        let found = figures(&inputs, &design, study.base.density_g_cm3)?;
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
