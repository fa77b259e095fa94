//! Opening files in the background: what is open stays until the new one is there, and on an error whatever happens.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::jobs::Task;
use super::news::Happening;
use super::shape::PartShape;
use super::state::Session;
use crate::design::Inputs;
use crate::document::{Document, DocumentState};
use crate::io::examples::Example;
use crate::io::mesh_file::read_mesh;
use crate::io::project_file::{self, LoadedProject};
use crate::io::{mesh_file, opening};
use crate::job::Stop;
use crate::mesh::TriMesh;
use crate::plain;
use crate::project::Unit;

/// A project ready to take the place of the one that is open.
pub struct Opened {
    document: Document,
    shape: PartShape,
    /// What was open when it was asked for: changes made since are not thrown away.
    before: DocumentState,
    /// What its user should know.
    said: Vec<String>,
    /// The file, where it belongs among the recent ones.
    file: Option<PathBuf>,
    /// It is what had been kept aside, which is not needed for any more.
    recovered: bool,
}

impl Opened {
    #[must_use]
    pub fn new(loaded: LoadedProject, path: Option<PathBuf>, before: DocumentState) -> Self {
        let document = Document::new(loaded, path);
        let body = document.state.project.part.body;
        let said = document.repairs.in_words(body);
        Self {
            shape: PartShape::of(&document),
            document,
            before,
            said: (said.into_iter())
                .map(|said| format!("Taking the mesh in: {said}"))
                .collect(),
            file: None,
            recovered: false,
        }
    }
}

impl Opened {
    /// Of a file that belongs among the recent ones.
    pub(super) fn of_file(self, path: PathBuf) -> Self {
        Self {
            file: Some(path),
            ..self
        }
    }
}

impl Session {
    /// Reads a project in the background, and opens it when it is there.
    pub(super) fn open_with(
        &mut self,
        read: impl FnOnce(DocumentState) -> Result<Opened, Stop> + Send + 'static,
    ) {
        let before = self.document.state.clone();
        self.jobs.start(
            Task::Open,
            (),
            move |_| read(before),
            |session, (), opened| session.open(opened),
        );
    }

    /// Opens a project or mesh; on an error what is open stays open.
    pub fn open_path(&mut self, path: &Path, unit: Option<Unit>) {
        let path = path.to_owned();
        self.open_with(move |before| {
            let loaded = opening::open(&path, unit).map_err(|e| Stop::Failed(format!("{e:#}")))?;
            let own = project_file::is_project(&path).then(|| path.clone());
            Ok(Opened {
                file: Some(path),
                ..Opened::new(loaded, own, before)
            })
        });
    }

    /// Opens a limb of the program's own.
    pub fn open_example(&mut self, example: Example) {
        self.open_with(move |before| {
            let loaded = example.open().map_err(|e| Stop::Failed(format!("{e:#}")))?;
            Ok(Opened::new(loaded, None, before))
        });
    }

    /// Takes the open mesh in again, with the body and the repairs the project now asks for. What was painted on other
    /// vertices is gone with them; on an error everything stays as it is.
    pub fn take_in_again(&mut self) {
        let part = Arc::clone(&self.document.part);
        let mesh_path = self.document.mesh_path.clone();
        let path = self.document.path.clone();
        let saved = self.document.saved().clone();
        self.open_with(move |before| {
            let keys = &before.project.part;
            let mesh = read_mesh(&mesh_path, keys.unit, keys.body, keys.repair())
                .map_err(|e| Stop::Failed(e.to_string()))?;
            let mut opened = on_mesh(mesh, &part, before, mesh_path, path);
            opened.document.compare_with(saved);
            Ok(opened)
        });
    }

    /// Opens what was kept aside in a folder of a project that came from `path`.
    pub fn open_kept(&mut self, folder: PathBuf, project: PathBuf, path: Option<PathBuf>) {
        self.open_with(move |before| {
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
                None => DocumentState {
                    // Nothing on disk is this.
                    painted: None,
                    masks: crate::project::Masks::new(),
                    project: crate::project::Project::around("", None),
                },
            });
            opened.recovered = true;
            let said = "The unsaved changes were recovered. Save them to keep them";
            opened.said.push(said.into());
            Ok(opened)
        });
    }

    /// Puts another project in this one's place. Only what is named here, which belongs to the desk, goes over to it:
    /// whatever else is known or under way was of the one before.
    fn replace(&mut self, document: Document, shape: PartShape) {
        let next = Self::shaped(document, shape, self.wake.clone());
        let old = std::mem::replace(self, next);
        self.jobs = old.jobs.for_another_session();
        self.desk = old.desk;
        self.news = old.news;
        self.study = old.study;
        self.show_estimator(self.desk.estimator);
    }

    /// Puts a project in the place of the one that is open, and says so; it stays open where changes would be lost.
    pub fn open(&mut self, opened: Opened) {
        // A selection that ends meanwhile is nobody's change.
        let mut before = opened.before.clone();
        let sites = self.document.state.project.selection.sites.clone();
        before.project.selection.sites = sites;
        if self.document.state != before {
            return self.complain(
                "The project was changed while the file was read, and nothing was opened: open it again",
            );
        }
        if self.bench.goes_on() {
            return self.complain(
                "A run goes on at the bench, and nothing was opened: stop pressing, then open it again",
            );
        }
        if self.is_saving_twice() {
            // What waits to be saved would be the new project, in the old one's place.
            return self.complain(
                "The project is still being saved, and nothing was opened: open the file again",
            );
        }
        let was_live = self.live.is_connected();
        let was_served = self.live.served_at;
        let would_serve = self.jobs.runs(Task::Serve);
        self.replace(opened.document, opened.shape);
        self.news.leave();
        for said in opened.said {
            self.tell(said);
        }
        if was_live {
            self.tell("The board was hung up: its readings were taken for the part that was open before. Connect again");
        }
        if would_serve {
            self.tell(
                "Touches are not served: they would have been of the part that was open before",
            );
        }
        if let Some(address) = was_served {
            self.tell(format!("Touches are not served at ws://{address} any more: they were of the part that was open before"));
        }
        self.news.happened(Happening::Opened {
            file: opened.file,
            recovered: opened.recovered,
        });
    }
}

/// The project as it was on a mesh that was taken in again, where `part` was it before.
fn on_mesh(
    mesh: mesh_file::LoadedMesh,
    part: &TriMesh,
    before: DocumentState,
    mesh_path: PathBuf,
    path: Option<PathBuf>,
) -> Opened {
    let same = mesh.mesh.positions() == part.positions();
    let mut masks = mesh.groups;
    if same {
        masks.extend(before.masks.clone());
    }
    let mut project = before.project.clone();
    let before_painted = before.painted.is_some();
    let supports = project.supports.len();
    project
        .supports
        .retain(|s| (s.vertices.as_ref()).is_none_or(|name| masks.contains_key(name)));
    let lost = supports - project.supports.len();
    let gone = |name: &mut Option<String>| name.take_if(|name| !masks.contains_key(name)).is_some();
    let regions = gone(&mut project.feasible.keep_out)
        | gone(&mut project.touch.region)
        | gone(&mut project.touch.often)
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
    opened
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::KnownPress;
    use crate::link::BAUD;
    use crate::session::Wake;
    use crate::session::slot::Slot;
    use crate::session::state::live::KnownTouch;

    fn session() -> Session {
        let document = Document::new(opening::bundled().unwrap(), None);
        Session::new(document, Wake::default())
    }

    fn another(session: &Session) -> Opened {
        let before = session.document.state.clone();
        Opened::new(opening::bundled().unwrap(), None, before)
    }

    #[test]
    fn what_is_known_of_one_part_is_not_said_of_another() {
        let mut s = session();
        s.desk.baud = 9600;
        s.desk.follow = false;
        s.drive.take = true;
        s.caches.touching.version = 7;
        s.results.version = 7;
        s.live.recorded = Some("old-part.hapdrec".into());
        s.complain("stays to be read");
        s.tell("the old part is done");
        let pressed = KnownTouch {
            press: KnownPress {
                at: s.document.inputs().part.vertex_point(0),
                force: 5.0,
                reading: vec![1e-4; 10],
            },
            used: true,
            misfit: None,
            board: None,
        };
        s.live.known.push(Slot {
            inputs: s.document.sensing_inputs(),
            value: pressed,
        });
        assert_eq!(s.known_touches(), 1);
        let opened = another(&s);
        s.open(opened);
        // The same project opened again is another limb on the desk, and may be glued otherwise.
        assert_eq!(s.known_touches(), 0);
        assert!(!s.drive.take && s.live.recorded.is_none());
        assert_eq!((s.caches.touching.version, s.results.version), (0, 0));
        // What is of the desk stays.
        assert!(s.desk.baud != BAUD && !s.desk.follow);
        let texts: Vec<&str> = s.news.messages.iter().map(|m| &*m.text).collect();
        assert!(texts.contains(&"stays to be read") && !texts.contains(&"the old part is done"));
        let opened = Happening::Opened {
            file: None,
            recovered: false,
        };
        assert_eq!(s.news.take_events(), [opened]);
    }

    #[test]
    fn what_waits_to_be_saved_is_not_another_project() {
        let mut s = session();
        let old = Arc::clone(&s.document.part);
        s.save_next = Some("old.hapdef.toml".into());
        let opened = another(&s);
        s.open(opened);
        assert!(Arc::ptr_eq(&old, &s.document.part));
        let said = &s.news.messages[0];
        assert!(said.error && said.text.contains("still being saved"));
    }
}
