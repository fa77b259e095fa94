//! Opening files in the background: what is open stays until the new one is there, and on an error
//! whatever happens.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Context;

use super::drive::Finished;
use super::jobs::Task;
use super::viewport::Viewport;
use super::{
    Stage, Studio, confusions, drive, expected, gauges, jobs, live, recent, results, touching,
    trade,
};
use crate::cli;
use crate::cli::examples::Example;
use crate::design::Inputs;
use crate::document::{Document, State};
use crate::io::mesh_file::read_mesh;
use crate::io::project_file::{self, LoadedProject};
use crate::job::Stop;
use crate::plain;
use crate::project::Unit;

/// A project ready to be shown.
pub(super) struct Opened {
    document: Document,
    /// Made where nobody waits for it.
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

    /// Opens a limb of the program's own.
    pub(super) fn open_example(&mut self, ctx: &Context, example: Example) {
        let before = self.document.state.clone();
        self.jobs.start(ctx, Task::Open, String::new(), move |_| {
            let loaded = example.open().map_err(|e| Stop::Failed(format!("{e:#}")))?;
            let opened = Opened::new(loaded, None, before);
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
            let regions = gone(&mut project.feasible.keep_out)
                | gone(&mut project.touch.region)
                | gone(&mut project.part.inside)
                | gone(&mut project.part.outside);
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
                    "Gone, with painted vertices that this mesh does not have: {}. Hold the part anew",
                    plain::count(lost, "support")
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
                let name = loaded.mesh_path.file_name().unwrap_or_default().to_owned();
                loaded.inputs.project.part.mesh = name.to_string_lossy().into_owned();
                loaded.mesh_path = name.into();
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
        if self.save_next.is_some() {
            // What waits to be saved would be the new project, in the old one's place.
            self.complain(
                "The project is still being saved, and nothing was opened: open the file again",
            );
            return;
        }
        self.jobs.cancel(|task| task != Task::Export);
        let was_live = self.live.is_connected();
        self.go_over_to(opened.document, opened.view);
        for said in opened.said {
            self.tell(said);
        }
        if was_live {
            self.tell("The board was hung up: its readings were taken for the part that was open before. Connect again");
        }
        if let Some(path) = opened.recent {
            self.recent.push(&path);
        }
        if opened.recovered {
            self.drop_left();
        }
    }

    /// The window with nothing known of its project yet.
    pub(super) fn around(document: Document) -> Self {
        let view = Viewport::new(&document);
        Self::showing(document, view)
    }

    fn showing(document: Document, view: Viewport) -> Self {
        Self {
            document,
            view,
            simulation: None,
            feasibility: None,
            design: None,
            messages: Vec::new(),
            touching: touching::Touching::default(),
            dialog: None,
            ask_example: None,
            palette: None,
            recovery: None,
            recent: recent::Recent::default(),
            jobs: jobs::Jobs::default(),
            live: live::Live::default(),
            drive: drive::Drive::following(true),
            last: BTreeMap::new(),
            picked: Vec::new(),
            by_hand: gauges::ByHand::default(),
            expected: expected::Expecting::default(),
            confusions: confusions::Confusions::default(),
            shown_kept: BTreeSet::new(),
            slow: None,
            advice: None,
            trade: trade::Trade::default(),
            stage: Stage::default(),
            results: results::Tab::default(),
            save_next: None,
            ask_quit: false,
            quit: false,
            title: String::new(),
            focused: None,
        }
    }

    /// Shows another project. Only what is named here, which belongs to the window and the desk it stands on,
    /// goes over to it: whatever else is known or under way was of the one before.
    fn go_over_to(&mut self, document: Document, view: Viewport) {
        let old = std::mem::replace(self, Self::showing(document, view));
        self.messages = old.messages;
        self.palette = old.palette;
        self.recovery = old.recovery;
        self.recent = old.recent;
        self.jobs = old.jobs;
        self.live = old.live.for_another_part();
        self.drive = drive::Drive::following(old.drive.follow);
        self.trade = old.trade.for_another_part();
        self.stage = old.stage;
        self.results = old.results;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Advice, Cost};
    use crate::mesh::SurfacePoint;
    use crate::project::PartModel;

    /// The window without a screen, on the bundled limb.
    fn studio() -> Studio {
        Studio::around(Document::new(cli::bundled().unwrap(), None))
    }

    fn another(studio: &Studio) -> Opened {
        let before = studio.document.state.clone();
        Opened::new(cli::bundled().unwrap(), None, before)
    }

    fn advice() -> Advice {
        let cost = Cost {
            model: PartModel::Shell,
            order: None,
            element_mm: 2.0,
            unknowns: 1e4,
            seconds: 1.0,
            memory_gb: 0.1,
            error_percent: 1.0,
            theory_percent: 1.0,
        };
        Advice {
            closed: false,
            wall_mm: [1.5; 3],
            radius_mm: [20.0; 2],
            size_mm: 120.0,
            walls: 0.0,
            fits: PartModel::Shell,
            costs: [cost; 2],
            words: vec!["of the part before".into()],
            faces: None,
        }
    }

    #[test]
    fn what_is_known_of_one_part_is_not_said_of_another() {
        let mut s = studio();
        s.advice = Some((s.document.walls_key(), Arc::new(advice())));
        s.slow = Some(("Error".into(), Arc::new(vec![1.0])));
        s.picked = vec![3];
        s.shown_kept.insert("ten".into());
        s.dialog = Some(super::super::dialogs::Dialog::save_as(&s.document));
        let at = SurfacePoint {
            triangle: 5,
            barycentric: [1.0, 0.0, 0.0],
        };
        s.view.measure.from = Some(at);
        s.view.hover = Some(at);
        s.title = "before".into();
        s.stage = Stage::Live;
        s.tell("stays to be read");
        let opened = another(&s);
        s.take_opened(opened);
        assert!(s.advice.is_none() && s.slow.is_none());
        assert!(s.picked.is_empty() && s.shown_kept.is_empty());
        assert!(s.dialog.is_none(), "it would save in the old one's place");
        assert!(s.view.measure.from.is_none() && s.view.hover.is_none());
        assert!(s.title.is_empty());
        // What is of the window stays.
        assert_eq!(s.stage, Stage::Live);
        assert_eq!(s.messages[0].text, "stays to be read");
    }

    #[test]
    fn what_waits_to_be_saved_is_not_another_project() {
        let mut s = studio();
        let old = Arc::clone(&s.document.part);
        s.save_next = Some("old.hapdef.toml".into());
        let opened = another(&s);
        s.take_opened(opened);
        assert!(Arc::ptr_eq(&old, &s.document.part));
        let said = &s.messages[0];
        assert!(said.error && said.text.contains("still being saved"));
    }
}
