//! Changes that are not saved are kept aside, and offered again when the program ended without them
//! being saved.
//!
//! Every window has a folder of its own, locked while it lives: what lies in a folder whose lock can be
//! had was left behind.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use egui::{Context, Id, Modal};
use serde::{Deserialize, Serialize};

use super::action::WindowAction;
use super::ask::Ask;
use crate::document::{Document, DocumentState};
use crate::io::examples::write_bundled_mesh;
use crate::io::{atomic, project_file};

/// How long a change may go unkept.
const EVERY: Duration = Duration::from_secs(3);
const PROJECT: &str = "project.hapdef.toml";
const ORIGIN: &str = "origin.json";
const LOCK: &str = "lock";

/// Where a project that was kept aside came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecoveredFrom {
    name: String,
    /// The file it was opened from, if there was one.
    path: Option<PathBuf>,
}

/// What was left behind by a program that ended.
struct Left {
    folder: PathBuf,
    origin: RecoveredFrom,
    /// Ours as long as the offer stands.
    _lock: File,
}

/// What this window keeps aside.
pub struct Recovery {
    folder: PathBuf,
    _lock: Option<File>,
    kept: Option<DocumentState>,
    written: Instant,
    writing: Option<Receiver<Result<(), String>>>,
    left: Vec<Left>,
    /// The first of them is being opened, or could not be.
    asked: bool,
}

impl Recovery {
    /// In a folder of its own under `home`; looks for what others left there.
    pub fn new(home: &Path) -> Self {
        // Numbers of processes come around again.
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = now.map_or(0, |d| d.as_nanos());
        let folder = home.join(format!("window-{now}-{}", std::process::id()));
        let left = left_behind(home, &folder);
        let lock = fs::create_dir_all(&folder)
            .and_then(|()| File::create(folder.join(LOCK)))
            .ok()
            .filter(|lock| lock.try_lock().is_ok());
        Self {
            folder,
            _lock: lock,
            kept: None,
            written: Instant::now(),
            writing: None,
            left,
            asked: false,
        }
    }

    /// Nothing unsaved is left of this window.
    pub fn forget(&mut self) {
        // What is being written must not come back after it was removed.
        if let Some(writing) = self.writing.take() {
            let _ = writing.recv();
        }
        for name in [PROJECT, ORIGIN] {
            let _ = fs::remove_file(self.folder.join(name));
        }
        self.kept = None;
    }

    /// The end of the window: its folder goes with it.
    pub fn close(&mut self) {
        self.forget();
        let _ = fs::remove_dir_all(&self.folder);
    }

    fn write(&mut self, document: &Document) {
        let folder = self.folder.clone();
        let state = document.state.clone();
        let origin = RecoveredFrom {
            name: document.name(),
            path: document.path.as_deref().map(absolute),
        };
        let bundled = document.bundled;
        let mesh = if bundled {
            document.mesh_path.clone()
        } else {
            absolute(&document.mesh_path)
        };
        self.kept = Some(state.clone());
        self.written = Instant::now();
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            let _ = sender.send(keep(&folder, state, &origin, mesh, bundled));
        });
        self.writing = Some(receiver);
    }

    /// Keeps what has changed, when it is time; an error in the user's terms comes back.
    pub fn keep(&mut self, document: &Document, ctx: &Context) -> Option<String> {
        let failed = match self.writing.as_ref().map(Receiver::try_recv) {
            Some(Err(TryRecvError::Empty)) => return None,
            Some(Ok(Err(message))) => Some(message),
            _ => None,
        };
        self.writing = None;
        if document.asks_for_another_part() {
            // Masks of this mesh beside settings for another would be read by nobody.
        } else if !document.is_dirty() {
            if self.kept.is_some() {
                self.forget();
            }
        } else if self.kept.as_ref() != Some(&document.state) {
            let since = self.written.elapsed();
            if since >= EVERY {
                self.write(document);
            } else {
                ctx.request_repaint_after(EVERY.saturating_sub(since));
            }
        }
        failed.map(|message| format!("Unsaved changes could not be kept aside: {message}"))
    }

    fn offered(&self) -> Option<&Left> {
        self.left.first().filter(|_| !self.asked)
    }

    /// Whether somebody is being asked about what was left behind.
    #[must_use]
    pub fn offers(&self) -> bool {
        self.offered().is_some()
    }

    /// Offers what was left behind, one project at a time.
    pub fn show(&self, ctx: &Context, ask: &mut Ask<'_>) {
        let Some(left) = self.offered() else {
            return;
        };
        let modal = Modal::new(Id::unique("recovery dialog"));
        modal.show(ctx, |ui| {
            ui.set_width(420.0);
            ui.heading("Recover unsaved changes?");
            ui.label(format!(
                "The studio ended before the changes of {} were saved. They were kept aside.",
                left.origin.name
            ));
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                if ui.button("Recover changes").clicked() {
                    ask.act(WindowAction::Recover);
                }
                if ui.button("Discard them").clicked() {
                    ask.act(WindowAction::DropLeft);
                }
            });
        });
    }

    /// The first that was left, to be opened: its folder, its project and the file that this came from. Whether or not it
    /// can be read, it is offered once.
    pub fn take_left(&mut self) -> Option<(PathBuf, PathBuf, Option<PathBuf>)> {
        self.asked = true;
        let left = self.left.first()?;
        let project = left.folder.join(PROJECT);
        Some((left.folder.clone(), project, left.origin.path.clone()))
    }

    /// The first that was left is not needed any more.
    pub fn drop_left(&mut self) {
        if !self.left.is_empty() {
            let left = self.left.remove(0);
            self.asked = false;
            let _ = fs::remove_dir_all(&left.folder);
        }
    }
}

fn absolute(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

fn keep(
    folder: &Path,
    mut state: DocumentState,
    origin: &RecoveredFrom,
    mut mesh: PathBuf,
    bundled: bool,
) -> Result<(), String> {
    if bundled {
        mesh = write_bundled_mesh(folder, &mesh).map_err(|e| format!("{e:#}"))?;
    }
    let path = folder.join(PROJECT);
    state.project.part.mesh = project_file::relative_to(&path, &mesh);
    let painted = state.painted.as_ref().map(|m| m.as_slice());
    project_file::save(&path, &state.project, painted, &state.masks).map_err(|e| e.to_string())?;
    let text = serde_json::to_vec(origin).map_err(|e| e.to_string())?;
    atomic::write(&folder.join(ORIGIN), &text).map_err(|e| e.to_string())
}

/// What lies in folders whose windows have ended.
fn left_behind(home: &Path, own: &Path) -> Vec<Left> {
    let Ok(entries) = fs::read_dir(home) else {
        return Vec::new();
    };
    let mut left: Vec<Left> = entries
        .filter_map(|entry| {
            let folder = entry.ok()?.path();
            let lock = File::open(folder.join(LOCK))
                .ok()
                .filter(|_| folder != own)?;
            lock.try_lock().ok()?;
            let origin = fs::read(folder.join(ORIGIN))
                .ok()
                .and_then(|bytes| serde_json::from_slice(&bytes).ok());
            let Some(origin) = origin.filter(|_| folder.join(PROJECT).exists()) else {
                // Its window ended with everything saved, or before anything was kept.
                let _ = fs::remove_dir_all(&folder);
                return None;
            };
            Some(Left {
                folder,
                origin,
                _lock: lock,
            })
        })
        .collect();
    left.sort_by(|a, b| a.folder.cmp(&b.folder));
    left
}
