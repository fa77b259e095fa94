//! Simulations that several units of a study need: whoever computes one first leaves it in the study's folder, for the
//! others, on any machine; the last of them takes it away.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::budget::{Budget, Watch};
use crate::design::{self, DesignError, Inputs, Simulated};
use crate::document::{Document, SimulationInputs};
use crate::io::kept_simulation;
use crate::io::project_file::LoadedProject;
use crate::io::study_folder::StudyFolder;
use crate::mesh::TriMesh;
use crate::parameter_study::{ParameterStudy, Points, Subject};

/// Keys of a project that its simulation knows nothing of, by how they begin. For keys that it may know of, or not, the
/// simulations' own keys decide.
const AFTER: [&str; 6] = [
    "selection.",
    "candidates.",
    "evaluation.",
    "calibration.",
    "feasible.",
    "live.",
];

/// What a unit's simulation is made from.
pub(super) struct SimulationKey {
    inputs: SimulationInputs,
    /// Places (mm) that gauges must be at: a simulation has a word where they are far off.
    required_mm: Vec<[f64; 3]>,
    part: Arc<TriMesh>,
}

impl SimulationKey {
    pub fn of(loaded: LoadedProject) -> Self {
        let part = Arc::clone(&loaded.inputs.part);
        let quality = loaded.inputs.project.budget.quality;
        let required_mm = loaded.inputs.project.selection.required_mm.clone();
        Self {
            required_mm,
            inputs: Document::new(loaded, None).simulation_inputs(quality),
            part,
        }
    }

    /// Whether both are of the same inputs on the same part: of another part the inputs say nothing.
    pub fn is(&self, other: &Self) -> bool {
        self.inputs == other.inputs
            && self.required_mm == other.required_mm
            && self.part.positions() == other.part.positions()
            && self.part.triangles() == other.part.triangles()
    }

    fn name(&self) -> String {
        let inputs = format!("{:?} {:?}", self.inputs, self.required_mm);
        kept_simulation::key(&inputs, &self.part)
    }
}

/// A unit of a study.
#[derive(Clone, Copy)]
pub struct StudyUnit<'a> {
    pub folder: &'a StudyFolder,
    pub points: &'a Points<'a>,
    pub unit: usize,
    /// Those that are computed on the same bench next: nothing is left in the folder for them.
    pub ahead: &'a [usize],
}

/// The last simulation, and who else of a study needs it.
#[derive(Default)]
pub(super) struct SharedSimulations {
    last: Option<LastSimulation>,
}

struct LastSimulation {
    key: SimulationKey,
    simulated: Arc<Simulated>,
    /// Other units that need it, as far as they are missing, the nearest last; and where it lies for them.
    missing: Vec<usize>,
    path: PathBuf,
}

impl SharedSimulations {
    /// The simulation of a unit's inputs, and whether it was there.
    ///
    /// # Errors
    /// As [`design::simulate`].
    pub fn simulated(
        &mut self,
        at: StudyUnit,
        (inputs, key): (&Inputs, SimulationKey),
        watch: Watch,
    ) -> Result<(Arc<Simulated>, bool), DesignError> {
        if let Some(last) = self.last.as_ref().filter(|last| last.key.is(&key)) {
            return Ok((Arc::clone(&last.simulated), true));
        }
        self.last = None;
        let folder = at.folder;
        let mut others = others(&folder.study, at.points, at.unit);
        others.retain(|other| !at.ahead.contains(other));
        let path = kept_simulation::path_in(&folder.shared(), &key.name());
        let budget = inputs.project.budget.budget();
        let kept = if others.is_empty() {
            None
        } else {
            read(&path, inputs, &budget, watch)?
        };
        let was_there = kept.is_some();
        // Of another program, or damaged: it is written anew.
        let is_unreadable = kept.is_none() && path.exists();
        let simulated = match kept {
            Some(kept) => kept,
            None => Arc::new(design::simulate(inputs, &budget, watch)?),
        };
        let mut last = LastSimulation {
            key,
            simulated: Arc::clone(&simulated),
            missing: others,
            path,
        };
        let is_missing = is_unreadable || !last.path.exists();
        if !was_there && last.is_needed(folder) && is_missing {
            // Where there is no room for it, it is computed again.
            let made = std::fs::create_dir_all(folder.shared());
            let _ = made.is_ok() && kept_simulation::write(&last.path, &simulated).is_ok();
        }
        self.last = Some(last);
        Ok((simulated, was_there))
    }

    /// A unit was written: where nobody needs its simulation any more, that goes.
    pub fn tidy(&mut self, folder: &StudyFolder) {
        if let Some(last) = &mut self.last
            && !last.is_needed(folder)
        {
            let _ = std::fs::remove_file(&last.path);
            // Only where it is empty.
            let _ = std::fs::remove_dir(folder.shared());
        }
    }
}

impl LastSimulation {
    /// Whether any other unit needs it still. What is there is not asked for again.
    fn is_needed(&mut self, folder: &StudyFolder) -> bool {
        while self
            .missing
            .last()
            .is_some_and(|&unit| folder.is_done(unit))
        {
            self.missing.pop();
        }
        !self.missing.is_empty()
    }
}

/// Other units that have the same values of all that a simulation may know of, the next one last.
fn others(study: &ParameterStudy, points: &Points, unit: usize) -> Vec<usize> {
    let matters: Vec<bool> = (study.axes.iter())
        .map(|axis| match axis.subject() {
            Ok(Subject::Project(key)) => !AFTER.iter().any(|after| key.path.starts_with(after)),
            _ => true,
        })
        .collect();
    if matters.iter().all(|matters| *matters) {
        return Vec::new();
    }
    let values = points.values(unit);
    let same = |k: &usize| {
        let others = points.values(*k);
        let mut pairs = others.iter().zip(&values).zip(&matters);
        *k != unit && pairs.all(|((a, b), matters)| !matters || a == b)
    };
    let count = points.count();
    // Units are computed in their order: of all that are missing the next one is the likeliest.
    let backwards = (0..count).map(|k| (unit + count - k) % count);
    backwards.filter(same).collect()
}

fn read(
    path: &Path,
    inputs: &Inputs,
    budget: &Budget,
    watch: Watch,
) -> Result<Option<Arc<Simulated>>, DesignError> {
    let Some(kept) = kept_simulation::read(path) else {
        return Ok(None);
    };
    Ok(design::simulate_kept(inputs, budget, kept, watch)?.map(Arc::new))
}
