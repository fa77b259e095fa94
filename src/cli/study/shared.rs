//! Simulations that several units of a study need: whoever computes one first leaves it in the study's folder, for the
//! others, on any machine; the last of them takes it away.

use std::path::PathBuf;
use std::sync::Arc;

use toml::Value;

use crate::budget::{Budget, Watch};
use crate::design::{self, DesignError, Inputs, Simulated};
use crate::document::{Document, SimulationInputs};
use crate::io::kept_simulation;
use crate::io::project_file::LoadedProject;
use crate::io::study_folder::StudyFolder;
use crate::mesh::TriMesh;
use crate::parameter_study::{ParameterStudy, Points, Subject};
use crate::varied::UnitBase;

/// Values between which an axis is asked whether a simulation hangs on it: its first and its last.
const ENDS: [f64; 2] = [0.0, 1.0];

/// What a unit's simulation is made from.
pub(super) struct SimulationKey {
    inputs: SimulationInputs,
    part: Arc<TriMesh>,
}

impl SimulationKey {
    pub fn of(loaded: LoadedProject) -> Self {
        let part = Arc::clone(&loaded.inputs.part);
        let quality = loaded.inputs.project.budget.quality;
        Self {
            inputs: Document::new(loaded, None).simulation_inputs(quality),
            part,
        }
    }

    /// Whether both are of the same inputs on the same part: of another part the inputs say nothing.
    pub fn is(&self, other: &Self) -> bool {
        self.inputs == other.inputs
            && self.part.positions() == other.part.positions()
            && self.part.triangles() == other.part.triangles()
    }

    fn name(&self) -> String {
        kept_simulation::key(&format!("{:?}", self.inputs), &self.part)
    }
}

/// The last simulation, and who else of a study needs it.
#[derive(Default)]
pub(super) struct SharedSimulations {
    /// Whether a simulation hangs on each axis, once that was asked.
    hangs_on: Option<Vec<bool>>,
    last: Option<LastSimulation>,
}

struct LastSimulation {
    key: SimulationKey,
    simulated: Arc<Simulated>,
    /// Units that need it, and where it lies for them.
    needed_by: Vec<usize>,
    path: PathBuf,
}

impl SharedSimulations {
    /// The simulation of a unit's inputs, and whether it was there.
    ///
    /// # Errors
    /// As [`design::simulate`].
    pub fn simulated(
        &mut self,
        (folder, points, unit): (&StudyFolder, &Points, usize),
        base: &UnitBase,
        (inputs, key): (&Inputs, SimulationKey),
        watch: Watch,
    ) -> Result<(Arc<Simulated>, bool), DesignError> {
        if let Some(last) = self.last.as_ref().filter(|last| last.key.is(&key)) {
            return Ok((Arc::clone(&last.simulated), true));
        }
        self.last = None;
        let needed_by = self.needing((folder, points, unit), base, &key);
        let path = kept_simulation::path_in(&folder.shared(), &key.name());
        let budget = inputs.project.budget.budget();
        let kept = if needed_by.len() > 1 {
            read(&path, inputs, &budget, watch)?
        } else {
            None
        };
        let was_there = kept.is_some();
        let simulated = match kept {
            Some(kept) => kept,
            None => Arc::new(design::simulate(inputs, &budget, watch)?),
        };
        let others = needed_by.iter().any(|&k| k != unit && !folder.is_done(k));
        if !was_there && others {
            // Where there is no room for it, it is computed again.
            let made = std::fs::create_dir_all(folder.shared());
            let _ = made.is_ok() && kept_simulation::write(&path, &simulated).is_ok();
        }
        self.last = Some(LastSimulation {
            key,
            simulated: Arc::clone(&simulated),
            needed_by,
            path,
        });
        Ok((simulated, was_there))
    }

    /// A unit was written: where nobody needs its simulation any more, that goes.
    pub fn tidy(&self, folder: &StudyFolder) {
        let Some(last) = &self.last else {
            return;
        };
        if last.needed_by.len() > 1 && last.needed_by.iter().all(|&k| folder.is_done(k)) {
            let _ = std::fs::remove_file(&last.path);
            // Only where it is empty.
            let _ = std::fs::remove_dir(folder.shared());
        }
    }

    /// Units whose simulation is that of a unit, which is among them: those that have the same values of all that a
    /// simulation hangs on.
    fn needing(
        &mut self,
        (folder, points, unit): (&StudyFolder, &Points, usize),
        base: &UnitBase,
        key: &SimulationKey,
    ) -> Vec<usize> {
        let values = points.values(unit);
        let hangs_on = self
            .hangs_on
            .get_or_insert_with(|| hanging(base, &folder.study, &values, key));
        if hangs_on.iter().all(|hangs| *hangs) {
            return vec![unit];
        }
        let same = |k: &usize| {
            let others = points.values(*k);
            let mut pairs = others.iter().zip(&values).zip(&*hangs_on);
            pairs.all(|((a, b), hangs)| !hangs || a == b)
        };
        (0..points.count()).filter(same).collect()
    }
}

/// For each axis whether a simulation hangs on it, as far as a unit with other values of it tells.
fn hanging(
    base: &UnitBase,
    study: &ParameterStudy,
    values: &[Value],
    key: &SimulationKey,
) -> Vec<bool> {
    let changes = |axis: usize, share: f64| {
        let mut other = values.to_vec();
        other[axis] = study.axes[axis].at(share);
        // What cannot be had tells nothing.
        let project = base.project(study, &other);
        project.is_ok_and(|project| !SimulationKey::of(project).is(key))
    };
    let hangs = |axis: usize| {
        let of_project = matches!(study.axes[axis].subject(), Ok(Subject::Project(_)));
        !of_project || ENDS.iter().any(|&share| changes(axis, share))
    };
    (0..study.axes.len()).map(hangs).collect()
}

fn read(
    path: &std::path::Path,
    inputs: &Inputs,
    budget: &Budget,
    watch: Watch,
) -> Result<Option<Arc<Simulated>>, DesignError> {
    let Some(kept) = kept_simulation::read(path) else {
        return Ok(None);
    };
    Ok(design::simulate_kept(inputs, budget, kept, watch)?.map(Arc::new))
}
