//! Saving and reporting in the background: what is changed meanwhile is not saved yet, and is known not to be.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::jobs::Task;
use super::news::Happening;
use super::state::Session;
use crate::design::Design;
use crate::document::DocumentState;
use crate::io::artifacts::{self, Provenance};
use crate::io::examples::write_bundled_mesh;
use crate::io::project_file;
use crate::job::Stop;

/// What lies on disk now.
struct Saved {
    path: PathBuf,
    mesh: PathBuf,
    state: DocumentState,
}

impl Session {
    /// Saves the project into a file.
    pub fn save_to(&mut self, path: &Path) {
        self.document.settle();
        let path = project_file::with_ending(path);
        if self.jobs.runs(Task::Save) {
            // One after the other: the later must not be overtaken.
            self.save_next = Some(path);
            return;
        }
        let mut state = self.document.state.clone();
        let (bundled, mesh) = (self.document.bundled, self.document.mesh_path.clone());
        let work = move |_: &_| {
            let folder = path.parent().unwrap_or(Path::new(""));
            let mesh = if bundled {
                bundled_mesh_in(folder, &mesh).map_err(Stop::Failed)?
            } else {
                mesh
            };
            state.project.part.mesh = project_file::relative_to(&path, &mesh);
            let painted = state.painted.as_ref().map(|m| m.as_slice());
            project_file::save(&path, &state.project, painted, &state.masks)
                .map_err(|e| Stop::Failed(e.to_string()))?;
            Ok(Saved { path, mesh, state })
        };
        // Another project may have been opened meanwhile.
        let session = self.jobs.session();
        self.jobs
            .start(Task::Save, session, work, |s, session, saved| {
                s.news.happened(Happening::Saved(saved.path.clone()));
                if s.jobs.session() == session {
                    s.document.saved_as(saved.path, saved.mesh, saved.state);
                }
            });
    }

    /// Whether something is being saved, and is to be saved again.
    pub(super) fn is_saving_twice(&self) -> bool {
        self.save_next.is_some()
    }

    /// Saves what waited for another save to end.
    pub(super) fn save_waiting(&mut self) {
        if !self.jobs.runs(Task::Save)
            && let Some(path) = self.save_next.take()
        {
            self.save_to(&path);
        }
    }

    /// The design to report: with the gauges as they are.
    fn design_to_report(&self) -> Result<Arc<Design>, &'static str> {
        let Some(result) = &self.results.design else {
            return Err("There is no design to report yet. Press “Select gauges” first");
        };
        if self.as_designed() || self.document.state.project.selection.sites.is_empty() {
            return Ok(Arc::clone(&result.value.design));
        }
        let by_hand = self.design_by_hand().map(Arc::new);
        by_hand.ok_or("The gauges are not those that were selected, and are not judged yet: wait until their error is shown, or press “Select gauges”, and export again")
    }

    /// Writes the report and what belongs to it into a folder.
    pub fn export(&mut self, folder: PathBuf) {
        let design = match self.design_to_report() {
            Ok(design) => design,
            Err(why) => return self.complain(why),
        };
        let Some(inputs) = (self.results.design.as_ref()).map(|d| d.value.snapshot.clone()) else {
            return;
        };
        let (bundled, mesh) = (self.document.bundled, self.document.mesh_path.clone());
        let taken_in = self.document.repairs.in_words(inputs.project.part.body);
        let work = move |_: &_| {
            let mesh_path = if bundled {
                bundled_mesh_in(&folder, &mesh).map_err(Stop::Failed)?
            } else {
                mesh
            };
            let provenance = Provenance {
                mesh_path: &mesh_path,
                version: env!("CARGO_PKG_VERSION"),
                taken_in,
            };
            artifacts::write_all(&folder, &inputs, &design, &provenance)
                .map_err(|e| Stop::Failed(e.to_string()))?;
            Ok(folder.join("report.html"))
        };
        self.jobs.start(Task::Export, (), work, |s, (), report| {
            s.tell(format!("The report is in {}", report.display()));
        });
    }
}

/// Writes a bundled mesh into a folder, which is made where it is missing.
fn bundled_mesh_in(folder: &Path, mesh: &Path) -> Result<PathBuf, String> {
    if !folder.as_os_str().is_empty() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    write_bundled_mesh(folder, mesh).map_err(|e| format!("{e:#}"))
}
