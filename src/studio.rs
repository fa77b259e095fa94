//! The window: an engineer chooses where gauges go, by eye and by number.
//!
//! This layer only shows and asks: what takes long runs in jobs on snapshots of the document.

mod advice;
mod commands;
mod confusions;
mod dialogs;
mod display;
mod drive;
mod expected;
mod fields;
mod form;
mod gauges;
mod helping;
mod inspector;
mod jobs;
mod kept;
mod labels;
mod latest;
mod live;
mod measure;
mod opening;
mod overlay;
mod palette;
pub mod picture;
mod recent;
mod recovery;
mod results;
mod saving;
mod stages;
mod theme;
mod toolbar;
mod tools;
mod touching;
mod trade;
mod viewport;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use egui::{CentralPanel, Panel};

use crate::budget::Quality;
use crate::cli;
use crate::design::{self, Design, Simulated};
use crate::document::Document;
use crate::feasible::Feasibility;
use crate::io::project_file::{self, LoadedProject};

pub use commands::Command;
pub use display::last_words;
pub use fields::Field;
pub use gauges::Way;
pub use stages::{Stage, Standing};
pub use tools::Tool;
pub use trade::Promise;
pub use viewport::{Pane, Section};

/// Something to tell the user that stays until it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    pub text: String,
    pub error: bool,
}

/// A finished simulation and the inputs it holds for.
#[derive(Clone)]
pub struct SimulationResult {
    pub simulated: Arc<Simulated>,
    pub key: String,
    /// What its elements, sites and touches hold for.
    elements: String,
    /// Read again from elements that were there.
    again: bool,
    pub quality: Quality,
    pub seconds: f64,
}

/// A finished design and the inputs it holds for.
#[derive(Clone)]
pub struct DesignResult {
    pub design: Arc<Design>,
    /// What it was computed from.
    pub inputs: design::Inputs,
    pub key: String,
    /// What its candidates and its selections hold for.
    keys: [String; 2],
    pub quality: Quality,
    pub seconds: f64,
}

/// The application.
pub struct Studio {
    pub document: Document,
    pub simulation: Option<SimulationResult>,
    /// Verdicts of the filters, and the inputs they hold for.
    pub feasibility: Option<(String, Arc<Feasibility>)>,
    pub design: Option<DesignResult>,
    pub messages: Vec<Message>,
    pub view: viewport::Viewport,
    touching: touching::Touching,
    dialog: Option<dialogs::Dialog>,
    /// The example to open once its user has said that changes may go.
    ask_example: Option<cli::examples::Example>,
    palette: Option<palette::Palette>,
    recovery: Option<recovery::Recovery>,
    recent: recent::Recent,
    jobs: jobs::Jobs,
    live: live::Live,
    drive: drive::Drive,
    /// The last results of each quality: what is asked for again after a change is often there.
    last: BTreeMap<Quality, drive::Last>,
    /// Numbers of the gauges that are picked, from zero.
    pub picked: Vec<usize>,
    by_hand: gauges::ByHand,
    expected: expected::Expecting,
    confusions: confusions::Confusions,
    /// Names of the kept selections that are shown.
    shown_kept: BTreeSet<String>,
    slow: fields::Slow,
    /// What was measured of the walls, and what for.
    advice: Option<(String, std::sync::Arc<crate::design::Advice>)>,
    /// Speed against accuracy, as measured.
    trade: trade::Trade,
    /// The stage whose settings are shown.
    pub stage: Stage,
    results: results::Tab,
    /// Where to save once what is being saved is.
    save_next: Option<PathBuf>,
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
        Self::around(Document::new(loaded, path))
    }

    /// Whether a job is running that somebody waits for.
    #[must_use]
    pub fn busy(&self) -> bool {
        !self.jobs.running.is_empty()
    }

    /// The strain and displacement under the applied touch, once computed.
    #[must_use]
    pub fn touched(&self) -> Option<&touching::Touched> {
        self.touching.result()
    }

    pub(crate) fn tell(&mut self, text: impl Into<String>) {
        self.messages.push(Message {
            text: text.into(),
            error: false,
        });
    }

    pub(crate) fn complain(&mut self, text: impl Into<String>) {
        self.messages.push(Message {
            text: text.into(),
            error: true,
        });
    }

    /// Takes in what jobs have brought, and starts what is next.
    fn collect(&mut self, ctx: &egui::Context) {
        self.collect_jobs(ctx);
        if let Some(error) = self.touching.collect(&self.document) {
            self.complain(error);
        }
        self.advance(ctx);
        self.refresh_feasibility(ctx);
        self.refresh_by_hand(ctx);
        self.refresh_expected(ctx);
        self.refresh_confusions(ctx);
        self.refresh_live(ctx);
        self.refresh_trade(ctx);
    }

    fn update_title(&mut self, ctx: &egui::Context) {
        let dirty = if self.document.is_dirty() {
            " · not saved"
        } else {
            ""
        };
        let title = format!("{}{dirty} – HapDef Studio", self.document.name());
        if title != self.title {
            self.title.clone_from(&title);
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn guard_close(&mut self, ctx: &egui::Context) {
        if ctx.input(|i| i.viewport().close_requested()) && self.document.is_dirty() && !self.quit {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.ask_quit = true;
        }
    }

    fn accept_drops(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_owned()));
        if let Some(path) = dropped {
            self.open_or_ask(ctx, &path);
        }
    }
}

impl eframe::App for Studio {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.accept_drops(&ctx);
        self.collect(&ctx);
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
        self.follow_lead();
        // A gesture has ended when nothing is held down any more.
        let focused = ctx.memory(egui::Memory::focused);
        let typing = ctx.egui_wants_keyboard_input() && focused == self.focused;
        self.focused = focused;
        if !ctx.input(|i| i.pointer.any_down()) && !typing {
            self.document.settle();
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
            let loaded = cli::open(path, unit)?;
            let is_project = project_file::is_project(path);
            (loaded, is_project.then(|| path.to_owned()))
        }
        None => (cli::bundled()?, None),
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
            studio.keep_trades_in(&home.join("trades"));
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

/// Qualities by their shown names.
pub(crate) fn quality_name(quality: Quality) -> &'static str {
    match quality {
        Quality::Draft => "Draft",
        Quality::Standard => "Standard",
        Quality::Reference => "Reference",
    }
}
