//! What can be opened: the limb inside the program, a project, a mesh.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;

use super::examples::Example;
use super::mesh_file::read_mesh;
use super::project_file::{self, LoadedProject};
use crate::design::Inputs;
use crate::project::{Project, Unit};

/// The limb that opens where nothing else is named, as a loaded project.
///
/// # Errors
/// None for the files this program was built with.
pub fn bundled() -> anyhow::Result<LoadedProject> {
    Example::Tube.open()
}

/// Opens a project or a mesh, by the file's ending.
///
/// # Errors
/// A message naming the file and the remedy.
pub fn open(path: &Path, unit: Option<Unit>) -> anyhow::Result<LoadedProject> {
    if project_file::is_project(path) {
        return Ok(project_file::load(path)?);
    }
    let file_name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut project = Project::around(&file_name, unit);
    let mut loaded = read_mesh(path, unit, project.part.body, project.part.repair())?;
    let taken = loaded.found.answer(&mut project, |_| false);
    project
        .check()
        .with_context(|| path.display().to_string())?;
    loaded.repairs.notes.extend(taken);
    Ok(LoadedProject {
        inputs: Inputs {
            project,
            part: Arc::new(loaded.mesh),
            painted: None,
            masks: loaded.groups,
        },
        repairs: loaded.repairs,
        path: path.with_extension("hapdef.toml"),
        mesh_path: path.to_owned(),
        bundled: false,
    })
}
