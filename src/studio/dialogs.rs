//! Opening, saving and exporting: a typed path always works; "Browse…" asks the desktop for a dialog.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use egui::Context;

use super::action::{Action, FileAction, WindowAction};
use super::ask::Ask;
use super::commands::UiCommand;
use super::view::{Backdrop, Floor, Picture};
use crate::document::Document;
use crate::io::examples::Example;
use crate::io::mesh_file::{ENDINGS, may_say_unit, needs_unit};
use crate::io::project_file;
use crate::project::Unit;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Purpose {
    Open,
    SaveAs,
    Export,
    Picture,
}

/// A dialog that asks for a path.
pub struct Dialog {
    purpose: Purpose,
    path: String,
    unit: Unit,
    /// The file says its unit, where it may.
    own_unit: bool,
    /// Of a picture: width and height in pixels, and what is behind the limb.
    size: [u32; 2],
    backdrop: Backdrop,
    /// The desktop's own dialog, while it is open.
    browsing: Option<Receiver<Option<PathBuf>>>,
    focused: bool,
}

impl Dialog {
    fn new(purpose: Purpose, path: String) -> Self {
        Self {
            purpose,
            path,
            unit: Unit::Millimetre,
            own_unit: true,
            size: [1920, 1080],
            backdrop: Backdrop::default(),
            browsing: None,
            focused: false,
        }
    }

    /// For a file that was dropped on the window: its path is typed already.
    pub fn open_dropped(path: &Path) -> Self {
        Self::new(Purpose::Open, path.display().to_string())
    }

    /// For a project or a mesh, beside the one that is open.
    pub fn open(document: &Document) -> Self {
        let folder = document.path.as_ref().and_then(|p| p.parent());
        Self::new(
            Purpose::Open,
            folder
                .map(|f| format!("{}/", f.display()))
                .unwrap_or_default(),
        )
    }

    /// For the project's file.
    pub fn save_as(document: &Document) -> Self {
        let path = document.path.clone().unwrap_or_else(|| {
            let stem = document
                .mesh_path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            document
                .mesh_path
                .with_file_name(format!("{stem}.hapdef.toml"))
        });
        Self::new(Purpose::SaveAs, path.display().to_string())
    }

    /// For the folder of a report.
    pub fn export(document: &Document) -> Self {
        let folder = document
            .path
            .as_ref()
            .and_then(|p| p.parent())
            .unwrap_or(Path::new(""));
        Self::new(Purpose::Export, folder.join("report").display().to_string())
    }

    /// For a picture of what the view shows.
    pub fn picture(document: &Document) -> Self {
        let mesh = document.path.as_ref().unwrap_or(&document.mesh_path);
        let name = mesh.file_name().unwrap_or_default().to_string_lossy();
        let stem = name.split('.').next().unwrap_or("limb");
        let path = mesh.with_file_name(format!("{stem}.png"));
        Self::new(Purpose::Picture, path.display().to_string())
    }

    fn title(&self) -> &'static str {
        match self.purpose {
            Purpose::Open => "Open a project or mesh",
            Purpose::SaveAs => "Save the project",
            Purpose::Export => "Export the report",
            Purpose::Picture => "Save a picture",
        }
    }

    fn verb(&self) -> &'static str {
        match self.purpose {
            Purpose::Open => "Open file",
            Purpose::SaveAs => "Save file",
            Purpose::Export => "Export",
            Purpose::Picture => "Save picture",
        }
    }

    fn hint(&self) -> &'static str {
        match self.purpose {
            Purpose::Open => {
                "NAME.hapdef.toml, or a mesh: cdb, dat, glb, gltf, inp, msh, obj, ply, stl"
            }
            Purpose::SaveAs => "NAME.hapdef.toml",
            Purpose::Picture => "NAME.png",
            Purpose::Export => {
                "A folder: the report, the sites, the data, and what workshop and robot need"
            }
        }
    }

    /// Whether the typed path is a mesh that does not say its unit.
    pub fn needs_unit(&self) -> bool {
        let path = Path::new(self.path.trim());
        self.purpose == Purpose::Open
            && path.extension().is_some()
            && !project_file::is_project(path)
            && needs_unit(path)
    }

    /// Whether it is a mesh that may say its unit.
    fn may_say_unit(&self) -> bool {
        self.purpose == Purpose::Open && may_say_unit(Path::new(self.path.trim()))
    }

    /// The unit that was chosen, where one is to be.
    fn chosen_unit(&self) -> Option<Unit> {
        let asked = self.needs_unit() || (self.may_say_unit() && !self.own_unit);
        asked.then_some(self.unit)
    }

    /// The choice of the file's unit, where there is one.
    fn unit_row(&mut self, ui: &mut egui::Ui) {
        let own = self.may_say_unit();
        if !own && !self.needs_unit() {
            return;
        }
        ui.horizontal(|ui| {
            ui.label("Unit of the file");
            if own {
                ui.selectable_value(&mut self.own_unit, true, "as it says");
            }
            for unit in Unit::ALL {
                let chosen = self.unit == unit && !(own && self.own_unit);
                if ui.selectable_label(chosen, unit.name()).clicked() {
                    self.unit = unit;
                    self.own_unit = false;
                }
            }
        });
    }

    fn browse(&mut self, ctx: &Context) {
        let (sender, receiver) = channel();
        let dialog = rfd::FileDialog::new().set_title(self.title());
        let purpose = self.purpose;
        let ctx = ctx.clone();
        // The desktop's dialog waits without an end: it must not hold up the window.
        std::thread::spawn(move || {
            let chosen = match purpose {
                Purpose::Open => {
                    let mut endings = vec!["toml"];
                    endings.extend(ENDINGS);
                    dialog
                        .add_filter("Projects and meshes", &endings)
                        .pick_file()
                }
                Purpose::SaveAs => dialog.set_file_name("limb.hapdef.toml").save_file(),
                Purpose::Export => dialog.pick_folder(),
                Purpose::Picture => dialog.set_file_name("limb.png").save_file(),
            };
            let _ = sender.send(chosen);
            ctx.request_repaint();
        });
        self.browsing = Some(receiver);
    }
}

/// The dialogs that are open.
#[derive(Default)]
pub struct Dialogs {
    pub path: Option<Dialog>,
    /// The example to open once its user has said that changes may go.
    pub example: Option<Example>,
    /// Whether to save before the program ends.
    pub quit: bool,
}

impl Dialogs {
    /// Whether any is open.
    #[must_use]
    pub fn any(&self) -> bool {
        self.path.is_some() || self.example.is_some() || self.quit
    }

    /// Shows those that are open.
    pub fn show(&mut self, ctx: &Context, ask: &mut Ask<'_>) {
        if let Some(mut dialog) = self.path.take()
            && dialog.show(ctx, ask)
        {
            self.path = Some(dialog);
        }
        if let Some(example) = self.example {
            self.ask_example(ctx, ask, example);
        }
        if self.quit {
            self.ask_quit(ctx, ask);
        }
    }

    fn ask_example(&mut self, ctx: &Context, ask: &mut Ask<'_>, example: Example) {
        let modal = egui::Modal::new(egui::Id::unique("example dialog")).show(ctx, |ui| {
            ui.heading(example.name());
            let text = format!(
                "{} has changes that are not saved; opening an example discards them",
                ask.session.document.name()
            );
            ui.colored_label(super::theme::ERROR, text);
            ui.horizontal(|ui| {
                if ui.button("Discard and open").clicked() {
                    self.example = None;
                    ask.act(FileAction::Example(example));
                }
                if ui.button("Go back").clicked() {
                    self.example = None;
                }
            });
        });
        if modal.should_close() {
            self.example = None;
        }
    }

    fn ask_quit(&mut self, ctx: &Context, ask: &mut Ask<'_>) {
        let modal = egui::Modal::new(egui::Id::unique("quit dialog")).show(ctx, |ui| {
            ui.heading("Save before closing?");
            ui.label(format!(
                "{} has changes that are not saved.",
                ask.session.document.name()
            ));
            ui.horizontal(|ui| {
                if ui.button("Save and keep open").clicked() {
                    self.quit = false;
                    ask.command(UiCommand::Save);
                }
                if ui.button("Close without saving").clicked() {
                    ask.act(WindowAction::Close);
                }
                if ui.button("Go back").clicked() {
                    self.quit = false;
                }
            });
        });
        if modal.should_close() {
            self.quit = false;
        }
    }
}

impl Dialog {
    /// Shows it; whether it stays open.
    fn show(&mut self, ctx: &Context, ask: &mut Ask<'_>) -> bool {
        if let Some(chosen) = self.browsing.as_ref().and_then(|r| r.try_recv().ok()) {
            self.browsing = None;
            if let Some(path) = chosen {
                self.path = path.display().to_string();
            }
        }
        let (mut confirmed, mut closed) = (false, false);
        let modal = egui::Modal::new(egui::Id::unique("path dialog")).show(ctx, |ui| {
            ui.set_width(480.0);
            ui.heading(self.title());
            ui.add_space(4.0);
            confirmed |= self.path_row(ui);
            ui.weak(self.hint());
            self.unit_row(ui);
            if self.purpose == Purpose::Picture {
                self.picture_row(ui);
            }
            let discards = self.purpose == Purpose::Open && ask.session.document.is_dirty();
            if discards {
                let text = format!(
                    "{} has changes that are not saved; opening another file discards them",
                    ask.session.document.name()
                );
                ui.colored_label(super::theme::ERROR, text);
            }
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                confirmed |= self.confirm_button(ui, discards);
                let browse = ui.add_enabled(self.browsing.is_none(), egui::Button::new("Browse…"));
                if browse.clicked() {
                    self.browse(ctx);
                }
                closed |= ui.button("Cancel").clicked();
            });
        });
        closed |= modal.should_close();
        if confirmed && !self.path.trim().is_empty() {
            ask.act(self.action());
            return false;
        }
        !closed
    }

    /// The path as it is typed; whether Enter was pressed.
    fn path_row(&mut self, ui: &mut egui::Ui) -> bool {
        let hint = self.hint();
        let field = egui::TextEdit::singleline(&mut self.path)
            .hint_text(hint)
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("Path");
        if !self.focused {
            field.request_focus();
            self.focused = true;
        }
        field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter))
    }

    fn picture_row(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            let names = ["Width in pixels", "Height in pixels"];
            for (name, side) in names.into_iter().zip(&mut self.size) {
                ui.add(egui::DragValue::new(side).range(16..=16384).suffix(" px"))
                    .accessible_name(name);
            }
            egui::ComboBox::new("Backdrop", "Backdrop")
                .selected_text(self.backdrop.name())
                .show_ui(ui, |ui| {
                    for backdrop in Backdrop::ALL {
                        ui.selectable_value(&mut self.backdrop, backdrop, backdrop.name());
                    }
                });
        });
    }

    fn confirm_button(&self, ui: &mut egui::Ui, discards: bool) -> bool {
        let ready = !self.path.trim().is_empty();
        let verb = if discards {
            "Discard and open"
        } else {
            self.verb()
        };
        ui.add_enabled(ready, egui::Button::new(verb)).clicked()
    }

    /// What was asked for.
    fn action(&self) -> Action {
        let path = PathBuf::from(self.path.trim());
        match self.purpose {
            Purpose::Open => FileAction::Open(path, self.chosen_unit()).into(),
            Purpose::SaveAs => FileAction::SaveTo(path).into(),
            Purpose::Export => FileAction::Export(path).into(),
            Purpose::Picture => {
                WindowAction::Picture(path.with_extension("png"), self.as_seen()).into()
            }
        }
    }

    /// From where the view shows it.
    fn as_seen(&self) -> Picture {
        Picture {
            size: self.size,
            view: None,
            backdrop: self.backdrop,
            floor: Floor::default(),
        }
    }
}
