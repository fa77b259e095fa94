//! Opening files in the background: what is open stays until the new one is there, and on an error
//! whatever happens.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Context;

use super::drive::Finished;
use super::jobs::Task;
use super::viewport::Viewport;
use super::{Studio, drive, touching};
use crate::cli;
use crate::design::Inputs;
use crate::document::{Document, State};
use crate::io::mesh_file::read_mesh;
use crate::io::project_file::{self, LoadedProject};
use crate::job::Stop;
use crate::project::Unit;

/// A project ready to be shown.
pub(super) struct Opened {
    document: Document,
    view: Viewport,
    /// What the window showed when it was asked for: changes made since are not thrown away.
    before: State,
    /// What its user should know.
    said: Vec<String>,
    /// The file, where it belongs among the recent ones.
    recent: Option<PathBuf>,
    /// What it was kept aside by, and is not needed for any more.
    recovered: bool,
}

impl Opened {
    fn new(loaded: LoadedProject, path: Option<PathBuf>, before: State) -> Self {
        let document = Document::new(loaded, path);
        let body = document.state.project.part.body;
        let said = document.repairs.in_words(body);
        Self {
            view: Viewport::new(&document),
            document,
            before,
            said: (said.into_iter())
                .map(|said| format!("Taking the mesh in: {said}"))
                .collect(),
            recent: None,
            recovered: false,
        }
    }
}

impl Studio {
    /// Opens a project or mesh; on an error what is open stays open.
    pub fn open_path(&mut self, ctx: &Context, path: &Path, unit: Option<Unit>) {
        let before = self.document.state.clone();
        let path = path.to_owned();
        self.jobs.start(ctx, Task::Open, String::new(), move |_| {
            let loaded = cli::open(&path, unit).map_err(|e| Stop::Failed(format!("{e:#}")))?;
            let own = project_file::is_project(&path).then(|| path.clone());
            let opened = Opened {
                recent: Some(path),
                ..Opened::new(loaded, own, before)
            };
            Ok(Finished::Opened(Box::new(opened)))
        });
    }

    /// Takes the open mesh in again, with the body and the repairs the project now asks for. What was
    /// painted on other vertices is gone with them; on an error everything stays as it is.
    pub(super) fn take_in_again(&mut self, ctx: &Context) {
        let before = self.document.state.clone();
        let part = Arc::clone(&self.document.part);
        let mesh_path = self.document.mesh_path.clone();
        let path = self.document.path.clone();
        let saved = self.document.saved().clone();
        self.jobs.start(ctx, Task::Open, String::new(), move |_| {
            let keys = &before.project.part;
            let mesh = read_mesh(&mesh_path, keys.unit, keys.body, keys.repair())
                .map_err(|e| Stop::Failed(e.to_string()))?;
            let same = mesh.mesh.positions() == part.positions();
            let mut masks = mesh.groups;
            if same {
                masks.extend(before.masks.clone());
            }
            let mut project = before.project.clone();
            let before_painted = before.painted.is_some();
            let supports = project.supports.len();
            project.supports.retain(|s| {
                (s.vertices.as_ref()).is_none_or(|name| masks.contains_key(name))
            });
            let lost = supports - project.supports.len();
            let gone = |name: &mut Option<String>| {
                name.take_if(|name| !masks.contains_key(name)).is_some()
            };
            let regions = gone(&mut project.feasible.keep_out) | gone(&mut project.touch.region);
            let inputs = Inputs {
                project,
                part: Arc::new(mesh.mesh),
                painted: before.painted.clone().filter(|_| same),
                masks,
            };
            let loaded = LoadedProject {
                inputs,
                repairs: mesh.repairs,
                path: path.clone().unwrap_or_default(),
                mesh_path,
                bundled: false,
            };
            let mut opened = Opened::new(loaded, path, before);
            opened.document.compare_with(saved);
            if regions || (before_painted && !same) {
                let said = "What was painted was on other vertices, and is gone";
                opened.said.push(said.into());
            }
            if lost > 0 {
                opened.said.push(format!(
                    "{lost} supports were on painted vertices that this mesh does not have: they are gone. Hold the part anew"
                ));
            }
            Ok(Finished::Opened(Box::new(opened)))
        });
    }

    /// Opens what was kept aside in a folder of a project that came from `path`.
    pub(super) fn open_kept(
        &mut self,
        ctx: &Context,
        folder: PathBuf,
        project: PathBuf,
        path: Option<PathBuf>,
    ) {
        let before = self.document.state.clone();
        self.jobs.start(ctx, Task::Open, String::new(), move |_| {
            let mut loaded = project_file::load(&project).map_err(|error| {
                Stop::Failed(format!("The unsaved changes could not be read: {error}"))
            })?;
            let saved = path.as_ref().and_then(|p| project_file::load(p).ok());
            // The mesh lies where it lay; only the bundled one lies in the folder that goes.
            loaded.bundled = loaded.mesh_path.parent() == Some(folder.as_path());
            if loaded.bundled {
                loaded.mesh_path = "limb.glb".into();
                loaded.inputs.project.part.mesh = "limb.glb".into();
            } else if let Some(path) = &path {
                loaded.inputs.project.part.mesh =
                    project_file::relative_to(path, &loaded.mesh_path);
            }
            let mut opened = Opened::new(loaded, path.clone(), before);
            opened.document.compare_with(match saved {
                Some(saved) => Document::new(saved, path).state,
                None => State {
                    // Nothing on disk is this.
                    painted: None,
                    masks: crate::project::Masks::new(),
                    project: crate::project::Project::around("", None),
                },
            });
            opened.recovered = true;
            let said = "The unsaved changes were recovered. Save them to keep them";
            opened.said.push(said.into());
            Ok(Finished::Opened(Box::new(opened)))
        });
    }

    /// Replaces the open project; what was computed for the old one goes with it.
    pub(super) fn take_opened(&mut self, opened: Opened) {
        // A selection that ends meanwhile is nobody's change.
        let mut before = opened.before.clone();
        let sites = self.document.state.project.selection.sites.clone();
        before.project.selection.sites = sites;
        if self.document.state != before {
            self.complain(
                "The project was changed while the file was read, and nothing was opened: open it again",
            );
            return;
        }
        self.jobs.cancel(|task| task != Task::Export);
        self.document = opened.document;
        self.view = opened.view;
        self.touching = touching::Touching::default();
        self.drive = drive::Drive::following(self.drive.follow);
        self.simulation = None;
        self.last.clear();
        self.feasibility = None;
        self.design = None;
        self.picked.clear();
        self.shown_kept.clear();
        self.by_hand = super::gauges::ByHand::default();
        self.slow = None;
        for said in opened.said {
            self.tell(said);
        }
        if let Some(path) = opened.recent {
            self.recent.push(&path);
        }
        if opened.recovered {
            self.drop_left();
        }
    }
}
