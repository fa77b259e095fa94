//! The window: an engineer chooses where gauges go, by eye and by number.
//!
//! This layer only shows and asks: what takes long runs in jobs on snapshots of the document.

mod advice;
mod commands;
mod confusions;
mod dialogs;
mod display;
mod expected;
mod fields;
mod form;
mod gauges;
mod inspector;
mod jobs;
mod kept;
mod labels;
mod live;
mod measure;
mod overlay;
mod palette;
pub mod picture;
mod recent;
mod recovery;
mod results;
mod stages;
mod theme;
mod toolbar;
mod tools;
mod trade;
mod viewport;

use std::cell::Cell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use eframe::egui_wgpu::RenderState;
use egui::{CentralPanel, Panel};

use crate::document::Document;
use crate::io::examples::Example;
use crate::io::opening;
use crate::io::project_file::{self, LoadedProject};
use crate::session::{Attention, Event, Session, Wake};

pub use commands::Command;
pub use display::last_words;
pub use fields::Field;
pub use gauges::Way;
pub use stages::{Stage, Standing};
pub use tools::Tool;
pub use viewport::{Pane, Section};

/// The application.
pub struct Studio {
    pub session: Session,
    pub view: viewport::Viewport,
    dialog: Option<dialogs::Dialog>,
    /// The example to open once its user has said that changes may go.
    ask_example: Option<Example>,
    palette: Option<palette::Palette>,
    recovery: Option<recovery::Recovery>,
    recent: recent::Recent,
    /// Numbers of the gauges that are picked, from zero.
    pub picked: Vec<usize>,
    /// The confusion that was clicked.
    looked_at: Option<usize>,
    /// Names of the kept selections that are shown.
    shown_kept: BTreeSet<String>,
    trade: trade::Dial,
    live_form: live::LiveForm,
    /// The stage whose settings are shown.
    pub stage: Stage,
    results: results::Tab,
    ask_quit: bool,
    quit: bool,
    title: String,
    /// What had the keyboard in the last frame.
    focused: Option<egui::Id>,
}

impl Studio {
    /// The window on a loaded project.
    ///
    /// # Errors
    /// When there is no graphics adapter.
    pub fn new(
        cc: &eframe::CreationContext,
        loaded: LoadedProject,
        path: Option<PathBuf>,
    ) -> Result<Self, String> {
        let Some(state) = &cc.wgpu_render_state else {
            return Err("no graphics adapter was found. Install a Vulkan driver (Debian: mesa-vulkan-drivers), or run `hapdef design --out DIR`, which needs none".into());
        };
        Ok(Self::on(state, &cc.egui_ctx, loaded, path))
    }

    /// The same on an adapter and a context of any kind.
    pub(crate) fn on(
        state: &RenderState,
        ctx: &egui::Context,
        loaded: LoadedProject,
        path: Option<PathBuf>,
    ) -> Self {
        crate::render::gpu::install(state);
        theme::apply(ctx);
        let waker = ctx.clone();
        let wake = Wake::new(move |wait| waker.request_repaint_after(wait));
        Self::around(Session::new(Document::new(loaded, path), wake))
    }

    /// The window around a session that nobody has looked at yet.
    fn around(session: Session) -> Self {
        Self {
            view: viewport::Viewport::new(&session.document, &session.shape),
            session,
            dialog: None,
            ask_example: None,
            palette: None,
            recovery: None,
            recent: recent::Recent::default(),
            picked: Vec::new(),
            looked_at: None,
            shown_kept: BTreeSet::new(),
            trade: trade::Dial::default(),
            live_form: live::LiveForm::default(),
            stage: Stage::default(),
            results: results::Tab::default(),
            ask_quit: false,
            quit: false,
            title: String::new(),
            focused: None,
        }
    }

    /// What hands and eyes are at.
    fn attention(&self, ctx: &egui::Context) -> Attention {
        let expected = self.view.field == Field::Expected;
        let confusions = expected || self.results == results::Tab::Confusions;
        Attention {
            hand: ctx.input(|i| i.pointer.any_down()) || !self.view.is_idle(),
            moved: self.view.moved_gauge(),
            picked: self.picked.first().copied(),
            expected: confusions || self.view.tool == Tool::Gauges,
            confusions,
            pointed: self.view.hover.filter(|_| expected),
        }
    }

    /// Has the session go on, and follows what has happened in it.
    fn advance(&mut self, ctx: &egui::Context) {
        let attention = self.attention(ctx);
        self.session.advance(&attention);
        self.follow();
    }

    fn follow(&mut self) {
        for event in self.session.news.take_events() {
            match event {
                Event::Opened { file, recovered } => self.show_opened(file.as_deref(), recovered),
                Event::Saved(file) => self.recent.push(&file),
                Event::Designed => self.results = results::Tab::Error,
                Event::GaugesReplaced => self.picked.clear(),
                Event::GaugeFound(number) => {
                    self.view.take(Tool::Gauges);
                    self.picked = vec![number];
                }
                Event::Connected => self.results = results::Tab::Live,
            }
        }
    }

    /// Another project is open: nothing that is shown or asked of the one before stays.
    fn show_opened(&mut self, file: Option<&Path>, recovered: bool) {
        self.view = viewport::Viewport::new(&self.session.document, &self.session.shape);
        self.picked.clear();
        self.looked_at = None;
        self.shown_kept.clear();
        self.dialog = None;
        self.ask_example = None;
        self.ask_quit = false;
        self.quit = false;
        self.live_form.record_to.clear();
        self.title.clear();
        if let Some(file) = file {
            self.recent.push(file);
        }
        if recovered {
            self.drop_left();
        }
    }

    /// Whether a job is running that somebody waits for.
    #[must_use]
    pub fn busy(&self) -> bool {
        self.session.busy()
    }

    fn update_title(&mut self, ctx: &egui::Context) {
        let dirty = if self.session.document.is_dirty() {
            " · not saved"
        } else {
            ""
        };
        let title = format!("{}{dirty} – HapDef Studio", self.session.document.name());
        if title != self.title {
            self.title.clone_from(&title);
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn guard_close(&mut self, ctx: &egui::Context) {
        if ctx.input(|i| i.viewport().close_requested())
            && self.session.document.is_dirty()
            && !self.quit
        {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.ask_quit = true;
        }
    }

    fn accept_drops(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_owned()));
        if let Some(path) = dropped {
            self.open_or_ask(&path);
        }
    }
}

impl eframe::App for Studio {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.accept_drops(&ctx);
        self.advance(&ctx);
        self.shortcuts(&ctx);
        Panel::top("menu").show(ui, |ui| self.menu(ui));
        Panel::bottom("messages")
            .show_separator_line(false)
            .show(ui, |ui| self.status(ui));
        Panel::left("stages")
            .default_size(216.0)
            .size_range(180.0..=320.0)
            .show(ui, |ui| self.stages(ui));
        Panel::right("inspector")
            .default_size(300.0)
            .size_range(250.0..=460.0)
            .show(ui, |ui| self.inspector(ui));
        Panel::bottom("results")
            .resizable(true)
            .default_size(260.0)
            .size_range(120.0..=520.0)
            .show(ui, |ui| self.results(ui));
        CentralPanel::no_frame().show(ui, |ui| self.viewport(ui));
        self.dialogs(&ctx);
        self.palette(&ctx);
        self.recovery_dialog(&ctx);
        // Another selector and its gauges are one step of undo.
        self.session.follow_lead();
        self.follow();
        // A gesture has ended when nothing is held down any more.
        let focused = ctx.memory(egui::Memory::focused);
        let typing = ctx.egui_wants_keyboard_input() && focused == self.focused;
        self.focused = focused;
        if !ctx.input(|i| i.pointer.any_down()) && !typing {
            self.session.document.settle();
        }
        self.update_title(&ctx);
        self.keep_unsaved(&ctx);
        self.guard_close(&ctx);
    }

    fn on_exit(&mut self) {
        // Whoever closes the window has saved, or said that it need not be.
        if let Some(recovery) = &mut self.recovery {
            recovery.close();
        }
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// A message in the user's terms when no window can be opened.
pub fn run(file: Option<&Path>, unit: Option<crate::project::Unit>) -> anyhow::Result<()> {
    let (loaded, path) = match file {
        Some(path) => {
            let loaded = opening::open(path, unit)?;
            let is_project = project_file::is_project(path);
            (loaded, is_project.then(|| path.to_owned()))
        }
        None => (opening::bundled()?, None),
    };
    let display = display::Display::named();
    let opened = Cell::new(false);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("HapDef Studio")
            .with_app_id("hapdef-studio")
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([960.0, 600.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    let open = |cc: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, Box<dyn std::error::Error + Send + Sync>> {
        let mut studio = Studio::new(cc, loaded, path)?;
        opened.set(true);
        display.opened();
        display.clone().end_with_it();
        if let Some(home) = eframe::storage_dir("hapdef-studio") {
            studio.keep_unsaved_in(&home.join("unsaved"));
            studio.keep_recent_in(&home);
            studio.session.keep_trades_in(&home.join("trades"));
            if let Some(path) = file {
                studio.recent.push(path);
            }
        }
        Ok(Box::new(studio))
    };
    let ended = eframe::run_native("hapdef-studio", options, Box::new(open));
    display::Display::closed();
    ended.map_err(|error| {
        anyhow::Error::msg(if opened.get() {
            display.ending(&error)
        } else {
            display.refusal(&error)
        })
    })
}
