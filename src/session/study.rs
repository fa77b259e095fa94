//! A parameter study beside the project: its results, the limb of a unit, and a unit opened as a project.

use std::path::Path;
use std::sync::Arc;

use super::jobs::Task;
use super::opening::Opened;
use super::state::Session;
use super::state::study::{OpenStudy, UnitLimb};
use crate::io::opening;
use crate::io::study_folder::StudyFolder;
use crate::job::{Reporter, Stop};
use crate::parameter_study::Points;
use crate::varied::{CollectedUnits, UnitBase};

// As `map_err` hands it over.
#[allow(clippy::needless_pass_by_value)]
fn failed(why: anyhow::Error) -> Stop {
    if why.is::<crate::budget::Cancelled>() {
        Stop::Cancelled
    } else {
        Stop::Failed(format!("{why:#}"))
    }
}

impl Session {
    /// Reads the results of a study's folder, as far as it was computed.
    pub fn open_study(&mut self, folder: &Path) {
        let path = folder.to_owned();
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let read = || -> anyhow::Result<OpenStudy> {
                let folder = StudyFolder::open(&path)?;
                let base = UnitBase::new(&folder.study, &folder.home())?;
                // Plans of before have no meshes.
                let meshes = &folder.plan.meshes;
                let same = base.fingerprint()? == folder.plan.base
                    && (meshes.is_empty() || base.meshes(&folder.study) == *meshes);
                Ok(OpenStudy::new(
                    CollectedUnits::of(folder, &watch)?,
                    base,
                    same,
                ))
            };
            read().map_err(failed)
        };
        self.jobs
            .start(Task::OpenStudy, folder.to_owned(), work, |s, _, study| {
                s.study.limb = None;
                if !study.is_of_base {
                    s.tell("The study's base, or a mesh of its axes, has changed since it was planned: limbs and projects of its units are as these are now, and their figures as they were");
                }
                s.study.open = Some(Arc::new(study));
            });
    }

    /// Whether the limb of a unit is still to be made. One at a time: a pointer passes over many.
    #[must_use]
    pub fn needs_limb(&self, unit: usize) -> bool {
        let known = self.study.limb().is_some_and(|limb| limb.unit == unit);
        !known && !self.jobs.runs(Task::UnitLimb) && self.jobs.is_new(Task::UnitLimb, &unit)
    }

    /// Makes the limb of a unit, to be looked at.
    pub fn look_at_unit(&mut self, unit: usize) {
        let Some(study) = self.study.open().map(Arc::clone) else {
            return;
        };
        if !self.needs_limb(unit) {
            return;
        }
        let work = move |_: &Reporter| {
            let loaded = project_of(&study, unit).map_err(failed)?;
            let part = loaded.inputs.part;
            let stance = loaded.inputs.project.part.axis.stance(&part);
            Ok((study, part, stance))
        };
        self.jobs.start(
            Task::UnitLimb,
            unit,
            work,
            |s, unit, (study, mesh, stance)| {
                if s.study.open().is_some_and(|open| Arc::ptr_eq(open, &study)) {
                    s.study.limb = Some(Arc::new(UnitLimb { unit, mesh, stance }));
                }
            },
        );
    }

    /// Writes a unit as a project into the study's folder, and opens it in the place of what is open.
    pub fn open_unit(&mut self, unit: usize) {
        let Some(study) = self.study.open().map(Arc::clone) else {
            return;
        };
        self.open_with(move |before| {
            let folder = study.collected.folder.folder.join("opened");
            let values = values_of(&study, unit).map_err(failed)?;
            let of = &study.collected.folder.study;
            let written = study
                .base
                .write(of, &values, &folder, &format!("unit-{unit:06}"));
            let path = written.map_err(failed)?;
            let loaded = opening::open(&path, None).map_err(failed)?;
            Ok(Opened::new(loaded, Some(path.clone()), before).of_file(path))
        });
    }
}

fn values_of(study: &OpenStudy, unit: usize) -> anyhow::Result<Vec<toml::Value>> {
    let points = Points::of(&study.collected.folder.study).map_err(anyhow::Error::msg)?;
    Ok(points.values(unit))
}

fn project_of(
    study: &OpenStudy,
    unit: usize,
) -> anyhow::Result<crate::io::project_file::LoadedProject> {
    let values = values_of(study, unit)?;
    study.base.project(&study.collected.folder.study, &values)
}
