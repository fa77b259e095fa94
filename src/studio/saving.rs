//! Saving in the background: what is changed meanwhile is not saved yet, and is known not to be.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Context;

use super::Studio;
use super::drive::Finished;
use super::jobs::Task;
use crate::cli::examples::write_bundled_mesh;
use crate::document::State;
use crate::io::project_file;
use crate::job::Stop;
use crate::mesh::TriMesh;

/// What lies on disk now.
pub(super) struct Saved {
    path: PathBuf,
    mesh: PathBuf,
    state: State,
    /// What was open: another file may have been opened meanwhile.
    part: Arc<TriMesh>,
}

impl Studio {
    pub(super) fn save_to(&mut self, ctx: &Context, path: &Path) {
        self.document.settle();
        let path = project_file::with_ending(path);
        if self.jobs.runs(Task::Save) {
            // One after the other: the later must not be overtaken.
            self.save_next = Some(path);
            return;
        }
        let mut state = self.document.state.clone();
        let part = Arc::clone(&self.document.part);
        let (bundled, mesh) = (self.document.bundled, self.document.mesh_path.clone());
        self.jobs.start(ctx, Task::Save, String::new(), move |_| {
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
            Ok(Finished::Saved(Box::new(Saved {
                path,
                mesh,
                state,
                part,
            })))
        });
    }

    pub(super) fn take_saved(&mut self, saved: Saved) {
        self.recent.push(&saved.path);
        if Arc::ptr_eq(&saved.part, &self.document.part) {
            self.document.saved_as(saved.path, saved.mesh, saved.state);
        }
    }
}

/// Writes a bundled mesh into a folder, which is made where it is missing.
pub(super) fn bundled_mesh_in(folder: &Path, mesh: &Path) -> Result<PathBuf, String> {
    if !folder.as_os_str().is_empty() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    write_bundled_mesh(folder, mesh).map_err(|e| format!("{e:#}"))
}
