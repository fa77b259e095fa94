//! The window: an engineer chooses where gauges go, by eye and by number.
//!
//! This layer only shows and asks. What takes long runs in jobs on snapshots of the document; opening a
//! file and applying the filters still run here, between gestures.

mod commands;
mod dialogs;
mod fields;
mod inspector;
mod overlay;
mod palette;
pub mod picture;
mod recent;
mod recovery;
mod results;
mod stages;
mod theme;
mod touching;
mod viewport;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use eframe::egui_wgpu::RenderState;
use egui::{CentralPanel, Panel};

use crate::budget::Quality;
use crate::cli;
use crate::dataset::Site;
use crate::design::{self, Design, DesignError, Simulated, StageTime};
use crate::document::Document;
use crate::feasible::Feasibility;
use crate::io::artifacts::as_chosen;
use crate::io::project_file::{self, LoadedProject};
use crate::job::{Job, Outcome, Reporter, Stop};
use crate::placement::{SelectorKind, SensorSet};
use crate::project::ChosenSite;

pub use commands::Command;
pub use fields::Field;
pub use viewport::Tool;

/// Something to tell the user that stays until it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    pub text: String,
    pub error: bool,
}

/// A finished simulation with the filters' verdicts, and the inputs they hold for.
pub struct SimulationResult {
    pub simulated: Arc<Simulated>,
    pub key: String,
    pub seconds: f64,
}

/// A finished design and the inputs it holds for.
pub struct DesignResult {
    pub design: Arc<Design>,
    /// What it was computed from.
    pub inputs: design::Inputs,
    pub key: String,
    pub seconds: f64,
}

/// What a job brings back.
enum Finished {
    Simulation(Arc<Simulated>, f64),
    Design(Arc<Design>, f64),
    Exported(PathBuf),
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
    palette: Option<palette::Palette>,
    recovery: Option<recovery::Recovery>,
    recent: recent::Recent,
    job: Option<Job<Finished>>,
    /// What the running selection has chosen so far.
    making: Arc<Mutex<Vec<ChosenSite>>>,
    results: results::Tab,
    ask_quit: bool,
    quit: bool,
    title: String,
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
        let document = Document::new(loaded, path);
        let view = viewport::Viewport::new(&document);
        Self {
            document,
            simulation: None,
            feasibility: None,
            design: None,
            messages: Vec::new(),
            view,
            touching: touching::Touching::default(),
            dialog: None,
            palette: None,
            recovery: None,
            recent: recent::Recent::default(),
            job: None,
            making: Arc::default(),
            results: results::Tab::default(),
            ask_quit: false,
            quit: false,
            title: String::new(),
        }
    }

    /// The gauges to draw: those of the running selection as far as it has come, else the project's.
    pub(super) fn gauges(&self) -> Vec<ChosenSite> {
        let making = (self.job.as_ref())
            .and_then(|_| self.making.lock().ok())
            .map(|making| making.clone())
            .filter(|making| !making.is_empty());
        making.unwrap_or_else(|| self.document.state.project.selection.sites.clone())
    }

    /// Whether a job is running.
    #[must_use]
    pub fn busy(&self) -> bool {
        self.job.is_some()
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

    fn start(
        &mut self,
        ctx: &egui::Context,
        name: &str,
        key: String,
        work: impl FnOnce(&Reporter) -> Result<Finished, Stop> + Send + 'static,
    ) {
        if self.job.is_some() {
            self.complain("Another job is running. Cancel it or wait for it to end");
            return;
        }
        let ctx = ctx.clone();
        let wake = move || ctx.request_repaint_after(std::time::Duration::from_millis(16));
        self.job = Some(Job::start(name, key, wake, work));
    }

    /// Simulates the project as it is now.
    pub fn simulate(&mut self, ctx: &egui::Context) {
        self.document.settle();
        let inputs = self.document.inputs();
        let budget = inputs.project.budget.quality.budget();
        self.start(ctx, "Simulate", self.document.simulation_key(), move |r| {
            let start = Instant::now();
            let simulated =
                design::simulate(&inputs, &budget, &|p| r.report(p)).map_err(|e| stop(&e))?;
            Ok(Finished::Simulation(
                Arc::new(simulated),
                start.elapsed().as_secs_f64(),
            ))
        });
    }

    /// Selects and evaluates, simulating first where that is stale.
    pub fn select(&mut self, ctx: &egui::Context) {
        self.document.settle();
        let inputs = self.document.inputs();
        let budget = inputs.project.budget.quality.budget();
        let current = self
            .simulation
            .as_ref()
            .filter(|s| s.key == self.document.simulation_key())
            .map(|s| Arc::clone(&s.simulated));
        let making = Arc::new(Mutex::new(Vec::new()));
        self.making = Arc::clone(&making);
        self.start(
            ctx,
            "Select gauges",
            self.document.selection_key(),
            move |r| {
                let start = Instant::now();
                let clock = || start.elapsed().as_secs_f64();
                let watch = |p| r.report(p);
                let first = inputs.project.selection.selector;
                let kinds: Vec<SelectorKind> = std::iter::once(first)
                    .chain(SelectorKind::ALL.into_iter().filter(|&k| k != first))
                    .collect();
                let anew = current.is_none();
                let simulated = match current {
                    Some(simulated) => simulated,
                    None => {
                        Arc::new(design::simulate(&inputs, &budget, &watch).map_err(|e| stop(&e))?)
                    }
                };
                let found = |kind, set: &SensorSet, sites: &[Site]| {
                    if kind == first
                        && let Ok(mut making) = making.lock()
                    {
                        *making = as_chosen(sites, &set.sites);
                    }
                };
                let simulate_seconds = clock();
                let mut design = design::run_step_by_step(
                    &inputs, simulated, &kinds, &budget, &clock, &watch, &found,
                )
                .map_err(|e| stop(&e))?;
                if anew {
                    let stage = StageTime {
                        stage: "simulate",
                        seconds: simulate_seconds,
                    };
                    design.seconds.insert(0, stage);
                }
                Ok(Finished::Design(
                    Arc::new(design),
                    start.elapsed().as_secs_f64(),
                ))
            },
        );
    }

    /// Writes the report and what belongs to it into a folder.
    pub fn export(&mut self, ctx: &egui::Context, folder: PathBuf) {
        let Some(result) = &self.design else {
            self.complain("There is no design to report yet. Press “Select gauges” first");
            return;
        };
        let design = Arc::clone(&result.design);
        let inputs = result.inputs.clone();
        let mesh_path = match self.settled_mesh(&folder) {
            Ok(path) => path,
            Err(message) => return self.complain(message),
        };
        self.start(ctx, "Export the report", String::new(), move |_| {
            let provenance = crate::io::artifacts::Provenance {
                mesh_path: &mesh_path,
                version: env!("CARGO_PKG_VERSION"),
            };
            crate::io::artifacts::write_all(&folder, &inputs, &design, &provenance)
                .map_err(|e| Stop::Failed(e.to_string()))?;
            Ok(Finished::Exported(folder))
        });
    }

    /// A path under which a saved project finds its mesh: the bundled limb is written beside it.
    pub(crate) fn settled_mesh(&self, folder: &std::path::Path) -> Result<PathBuf, String> {
        if !self.document.bundled {
            return Ok(self.document.mesh_path.clone());
        }
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        cli::write_bundled_mesh(folder).map_err(|e| format!("{e:#}"))
    }

    pub fn cancel(&mut self) {
        if let Some(job) = &self.job {
            job.cancel();
        }
    }

    /// Takes in what jobs have brought, and refreshes what is cheap to derive.
    fn collect(&mut self, ctx: &egui::Context) {
        if let Some(outcome) = self.job.as_ref().and_then(Job::poll) {
            let job = self.job.take();
            self.making = Arc::default();
            let (name, key) = job.map(|j| (j.name, j.key)).unwrap_or_default();
            match outcome {
                Outcome::Done(finished) => self.finished(ctx, finished, key),
                Outcome::Failed(message) => self.complain(format!("{name}: {message}")),
                Outcome::Cancelled => self.tell(format!("{name} was cancelled")),
            }
        }
        if let Some(error) = self.touching.collect(&self.document) {
            self.complain(error);
        }
        let dragging = ctx.input(|i| i.pointer.any_down()) || self.view.is_stroking();
        self.refresh_feasibility(dragging);
    }

    fn finished(&mut self, ctx: &egui::Context, finished: Finished, key: String) {
        match finished {
            Finished::Simulation(simulated, seconds) => {
                if key == self.document.simulation_key() {
                    self.simulation = Some(SimulationResult {
                        simulated,
                        key,
                        seconds,
                    });
                } else {
                    self.tell(
                        "The simulation was for settings that have changed since, and was dropped",
                    );
                }
            }
            Finished::Design(design, seconds) => self.take_design(design, key, seconds),
            Finished::Exported(folder) => {
                self.tell(format!(
                    "The report is in {}",
                    folder.join("report.html").display()
                ));
            }
        }
        ctx.request_repaint();
    }

    fn take_design(&mut self, design: Arc<Design>, key: String, seconds: f64) {
        if key != self.document.selection_key() {
            self.tell("The selection was for settings that have changed since, and was dropped");
            return;
        }
        self.simulation = Some(SimulationResult {
            simulated: Arc::clone(&design.simulated),
            key: self.document.simulation_key(),
            seconds: design
                .seconds
                .iter()
                .find(|s| s.stage == "simulate")
                .map_or_else(
                    || self.simulation.as_ref().map_or(0.0, |s| s.seconds),
                    |s| s.seconds,
                ),
        });
        self.document.state.project.selection.sites =
            as_chosen(&design.simulated.dataset.sites, design.chosen());
        self.document.settle();
        self.results = results::Tab::Error;
        self.design = Some(DesignResult {
            design,
            inputs: self.document.inputs(),
            key,
            seconds,
        });
    }

    /// Filters anew when anything they depend on has changed and no stroke is under way.
    fn refresh_feasibility(&mut self, dragging: bool) {
        let Some(simulation) = &self.simulation else {
            return;
        };
        if simulation.key != self.document.simulation_key() || dragging {
            return;
        }
        let key = self.document.feasible_key();
        if self
            .feasibility
            .as_ref()
            .is_none_or(|(known, _)| *known != key)
        {
            let verdicts = design::filter(&self.document.inputs(), &simulation.simulated);
            self.feasibility = Some((key, Arc::new(verdicts)));
        }
    }

    /// Replaces the open project; what was computed for the old one goes with it.
    pub(crate) fn replace(&mut self, loaded: LoadedProject, path: Option<PathBuf>) {
        self.cancel();
        self.document = Document::new(loaded, path);
        self.view = viewport::Viewport::new(&self.document);
        self.touching = touching::Touching::default();
        self.simulation = None;
        self.feasibility = None;
        self.design = None;
        let repairs = self.document.repairs;
        if let Some(said) = repairs.in_words(self.document.state.project.part.body) {
            self.tell(format!("Taking the mesh in: {said}"));
        }
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
            self.open_or_ask(&path);
        }
    }
}

/// A stage's error as a job's end.
fn stop(error: &DesignError) -> Stop {
    if error.is_cancelled() {
        Stop::Cancelled
    } else {
        Stop::Failed(error.to_string())
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
        // A gesture has ended when nothing is held down any more.
        if !ctx.input(|i| i.pointer.any_down()) && !ctx.egui_wants_keyboard_input() {
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
        if let Some(home) = eframe::storage_dir("hapdef-studio") {
            studio.keep_unsaved_in(&home.join("unsaved"));
            studio.keep_recent_in(&home);
            if let Some(path) = file {
                studio.recent.push(path);
            }
        }
        Ok(Box::new(studio))
    };
    eframe::run_native("hapdef-studio", options, Box::new(open)).map_err(|error| {
        anyhow::anyhow!(
            "the window cannot be opened: {error}. It needs a display (X11 or Wayland) and a Vulkan driver (Debian: mesa-vulkan-drivers libxcursor1 libxi6 libxkbcommon-x11-0). Without a display, run `hapdef design --out DIR`"
        )
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
