//! One list of commands feeds menus and keys, and is carried out in one place.

use egui::{Context, Key, KeyboardShortcut, Modifiers};

use super::Studio;
use super::dialogs::Dialog;
use super::palette::Palette;
use super::viewport::Tool;
use crate::render::camera::Preset;

/// By how much a key makes the brush wider.
const BRUSH_STEP: f64 = 1.25;

/// Everything that can be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    Open,
    Save,
    SaveAs,
    Export,
    Quit,
    Undo,
    Redo,
    ClearPaint,
    FillPaint,
    InvertPaint,
    GrowPaint,
    ShrinkPaint,
    WiderBrush,
    NarrowerBrush,
    Palette,
    Simulate,
    Select,
    Cancel,
    Follow,
    Frame,
    Look(Preset),
    Tool(Tool),
}

impl Command {
    /// As menus and accessibility name it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "Open…",
            Self::Save => "Save",
            Self::SaveAs => "Save as…",
            Self::Export => "Export report…",
            Self::Quit => "Quit",
            Self::Undo => "Undo",
            Self::Redo => "Redo",
            Self::ClearPaint => "Clear painted region",
            Self::FillPaint => "Paint everything",
            Self::InvertPaint => "Invert painted region",
            Self::GrowPaint => "Grow painted region",
            Self::ShrinkPaint => "Shrink painted region",
            Self::WiderBrush => "Wider brush",
            Self::NarrowerBrush => "Narrower brush",
            Self::Palette => "Find a command…",
            Self::Simulate => "Simulate",
            Self::Select => "Select gauges",
            Self::Cancel => "Cancel all jobs",
            Self::Follow => "Follow changes",
            Self::Frame => "Frame the limb",
            Self::Look(preset) => preset.name(),
            Self::Tool(tool) => tool.name(),
        }
    }

    #[must_use]
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Open => "Open a project or a mesh",
            Self::Save => "Save the project",
            Self::SaveAs => "Save the project under another name",
            Self::Export => {
                "Write the placement report, the table of sites and the dataset into a folder"
            }
            Self::Quit => "Close the window",
            Self::Undo => "Take back the last change",
            Self::Redo => "Make the change again",
            Self::ClearPaint => "Every site that passes the filters may carry a gauge again",
            Self::FillPaint => "Gauges may go anywhere; erase from there",
            Self::InvertPaint => "What was painted is not, and what was not is",
            Self::GrowPaint | Self::ShrinkPaint => {
                "By a quarter of the brush's radius over the surface"
            }
            Self::WiderBrush | Self::NarrowerBrush => "The radius of the brush over the surface",
            Self::Palette => "Reach every command by a few letters of its name",
            Self::Simulate => "Compute how the limb deforms under all touches",
            Self::Select => "Filter, reduce, choose the gauges and judge them on unseen touches",
            Self::Cancel => "Stop whatever is being computed",
            Self::Follow => "Compute anew what a change has made stale, a draft first; on or off",
            Self::Frame => "Show the whole limb",
            Self::Look(_) => "Look from this side",
            Self::Tool(Tool::Touch) => "Click on the limb to press it there; drag to look around",
            Self::Tool(Tool::Paint) => "Drag over the limb to paint where gauges may go",
            Self::Tool(Tool::Erase) => "Drag over the limb to keep gauges away",
        }
    }

    #[must_use]
    pub fn shortcut(self) -> Option<KeyboardShortcut> {
        const CTRL: Modifiers = Modifiers::COMMAND;
        const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
        let plain = |key| Some(KeyboardShortcut::new(Modifiers::NONE, key));
        let ctrl = |key| Some(KeyboardShortcut::new(CTRL, key));
        match self {
            Self::Open => ctrl(Key::O),
            Self::Save => ctrl(Key::S),
            Self::SaveAs => Some(KeyboardShortcut::new(CTRL_SHIFT, Key::S)),
            Self::Export => ctrl(Key::E),
            Self::Quit => ctrl(Key::Q),
            Self::Undo => ctrl(Key::Z),
            Self::Redo => Some(KeyboardShortcut::new(CTRL_SHIFT, Key::Z)),
            Self::Simulate => plain(Key::F5),
            Self::Select => plain(Key::F6),
            Self::Cancel => plain(Key::Escape),
            Self::Frame => plain(Key::Home),
            Self::Look(Preset::Front) => plain(Key::Num1),
            Self::Look(Preset::Right) => plain(Key::Num3),
            Self::Look(Preset::Top) => plain(Key::Num7),
            Self::Tool(Tool::Touch) => plain(Key::T),
            Self::Tool(Tool::Paint) => plain(Key::B),
            Self::Tool(Tool::Erase) => plain(Key::X),
            Self::InvertPaint => ctrl(Key::I),
            Self::Palette => ctrl(Key::K),
            Self::NarrowerBrush => plain(Key::OpenBracket),
            Self::WiderBrush => plain(Key::CloseBracket),
            Self::Look(_)
            | Self::ClearPaint
            | Self::FillPaint
            | Self::GrowPaint
            | Self::ShrinkPaint
            | Self::Follow => None,
        }
    }

    /// Every command, the most specific shortcut first where keys are shared.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut all = vec![
            Self::SaveAs,
            Self::Save,
            Self::Open,
            Self::Export,
            Self::Quit,
            Self::Redo,
            Self::Undo,
            Self::ClearPaint,
            Self::FillPaint,
            Self::InvertPaint,
            Self::GrowPaint,
            Self::ShrinkPaint,
            Self::WiderBrush,
            Self::NarrowerBrush,
            Self::Palette,
            Self::Simulate,
            Self::Select,
            Self::Cancel,
            Self::Follow,
            Self::Frame,
        ];
        all.extend(Preset::ALL.map(Self::Look));
        all.extend(Tool::ALL.map(Self::Tool));
        all
    }
}

impl Studio {
    /// Whether a command can be given now.
    #[must_use]
    pub fn enabled(&self, command: Command) -> bool {
        match command {
            Command::Undo => self.document.can_undo(),
            Command::Redo => self.document.can_redo(),
            Command::ClearPaint | Command::GrowPaint | Command::ShrinkPaint => {
                self.document.state.painted.is_some()
            }
            Command::Cancel => self.busy(),
            Command::Export => self.design.is_some(),
            _ => true,
        }
    }

    /// Whether a command that turns something on or off has it on.
    fn is_on(&self, command: Command) -> bool {
        match command {
            Command::Follow => self.drive.follow,
            _ => false,
        }
    }

    /// Carries a command out.
    pub fn execute(&mut self, ctx: &Context, command: Command) {
        if !self.enabled(command) {
            return;
        }
        let needs_part = matches!(
            command,
            Command::Simulate | Command::Select | Command::Export | Command::Save | Command::SaveAs
        );
        if needs_part && self.document.asks_for_another_part() {
            self.complain(
                "The body or the repairs were changed, but the mesh was not read again: press “Read the mesh again” (right side, Part and material), or undo",
            );
            return;
        }
        match command {
            Command::Open => self.dialog = Some(Dialog::open(&self.document)),
            Command::Save => match self.document.path.clone() {
                Some(path) => self.save_to(&path),
                None => self.dialog = Some(Dialog::save_as(&self.document)),
            },
            Command::SaveAs => self.dialog = Some(Dialog::save_as(&self.document)),
            Command::Export => self.dialog = Some(Dialog::export(&self.document)),
            Command::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Command::Undo => self.document.undo(),
            Command::Redo => self.document.redo(),
            Command::ClearPaint => self.document.clear_paint(),
            Command::FillPaint => self.document.fill_paint(),
            Command::InvertPaint => self.document.invert_paint(),
            Command::GrowPaint => self.document.grow_paint(self.view.brush / 4.0),
            Command::ShrinkPaint => self.document.shrink_paint(self.view.brush / 4.0),
            Command::WiderBrush => self.view.brush *= BRUSH_STEP,
            Command::NarrowerBrush => self.view.brush /= BRUSH_STEP,
            Command::Palette => self.palette = Some(Palette::default()),
            Command::Simulate => self.simulate(ctx),
            Command::Select => self.select(ctx),
            Command::Cancel => self.cancel(),
            Command::Follow => self.drive.follow = !self.drive.follow,
            Command::Frame => self.view.frame(&self.document),
            Command::Look(preset) => self.view.camera.look_from(preset),
            Command::Tool(tool) => self.view.take(tool),
        }
    }

    pub(super) fn shortcuts(&mut self, ctx: &Context) {
        if self.dialog.is_some() || self.ask_quit || self.palette.is_some() {
            return;
        }
        let typing = ctx.egui_wants_keyboard_input();
        for command in Command::all() {
            let Some(shortcut) = command.shortcut() else {
                continue;
            };
            // Single keys belong to a text field while it has the focus.
            let single = shortcut.modifiers == Modifiers::NONE;
            if !(typing && single) && ctx.input_mut(|i| i.consume_shortcut(&shortcut)) {
                self.execute(ctx, command);
            }
        }
    }

    /// A button or menu entry for a command.
    pub(super) fn button(&mut self, ui: &mut egui::Ui, command: Command) {
        let mut button = egui::Button::new(command.name()).selected(self.is_on(command));
        if let Some(shortcut) = command.shortcut() {
            button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut));
        }
        let response = ui
            .add_enabled(self.enabled(command), button)
            .accessible_name(command.name())
            .on_hover_text(command.tooltip());
        if response.clicked() {
            let ctx = ui.ctx().clone();
            self.execute(&ctx, command);
        }
    }

    pub(super) fn menu(&mut self, ui: &mut egui::Ui) {
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| {
                self.button(ui, Command::Open);
                self.recent_menu(ui);
                ui.separator();
                for command in [Command::Save, Command::SaveAs] {
                    self.button(ui, command);
                }
                ui.separator();
                self.button(ui, Command::Export);
                ui.separator();
                self.button(ui, Command::Quit);
            });
            ui.menu_button("Edit", |ui| {
                for command in [Command::Undo, Command::Redo] {
                    self.button(ui, command);
                }
                ui.separator();
                for tool in Tool::ALL {
                    self.button(ui, Command::Tool(tool));
                }
                ui.separator();
                for command in [
                    Command::ClearPaint,
                    Command::FillPaint,
                    Command::InvertPaint,
                    Command::GrowPaint,
                    Command::ShrinkPaint,
                ] {
                    self.button(ui, command);
                }
                ui.separator();
                self.button(ui, Command::Palette);
            });
            ui.menu_button("View", |ui| {
                self.button(ui, Command::Frame);
                for preset in Preset::ALL {
                    self.button(ui, Command::Look(preset));
                }
                ui.separator();
                ui.horizontal(egui::widgets::global_theme_preference_buttons);
            });
            ui.menu_button("Run", |ui| {
                for command in [Command::Simulate, Command::Select, Command::Cancel] {
                    self.button(ui, command);
                }
                ui.separator();
                self.button(ui, Command::Follow);
            });
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let state = if self.document.is_dirty() {
                    "not saved"
                } else {
                    "saved"
                };
                ui.weak(format!("{} · {state}", self.document.name()));
            });
        });
    }
}
