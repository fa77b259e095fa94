//! The window: an engineer chooses where gauges go, by eye and by number.
//!
//! This layer only shows and asks. What is computed is the session's; panels read it, change how it is looked at, and
//! leave actions (`action.rs`), which are carried out here.

mod action;
mod ask;
mod bench;
mod by_force;
mod commands;
mod confusions;
mod dialogs;
mod display;
mod execute;
mod fields;
mod form;
mod inspector;
mod jig;
mod jobs;
mod kept;
mod keys;
mod labels;
mod layout;
mod learned;
mod legend;
mod live;
mod measure;
mod menu;
mod nudge;
mod overlay;
mod paint;
mod palette;
pub mod picture;
mod recent;
mod recovery;
mod results;
mod run;
mod scene;
mod stages;
mod study;
mod theme;
mod toolbar;
mod tools;
mod trade;
mod view;
mod viewport;
mod words;

use std::path::{Path, PathBuf};

use egui::{CentralPanel, Context, Panel, ViewportCommand};

use crate::document::Document;
use crate::io::project_file::LoadedProject;
use crate::render::gpu;
use crate::session::{Attention, Colours, FieldKind, Happening, Session, Wake};
use action::WindowAction;
use ask::Ask;
use dialogs::Dialog;
use layout::Panels;
use paint::LimbLook;
use scene::PartScene;

pub use crate::session::Standing;
pub use commands::UiCommand;
pub use display::last_words;
pub use run::run;
pub use view::{Field, Pane, ScreenWay, SectionPlane, Stage, Tab, Tool, ViewState};

/// What is kept between runs.
#[derive(Default)]
struct KeptSettings {
    recovery: Option<recovery::Recovery>,
    recent: recent::Recent,
}

/// The window's frame, as it was last.
#[derive(Default)]
struct Frame {
    title: String,
    /// What had the keyboard.
    focused: Option<egui::Id>,
    /// What hands and eyes were at when the session was last told.
    attention: Attention,
    /// Whoever closes it has said that nothing need be saved.
    closes: bool,
}

/// The application.
pub struct Studio {
    pub session: Session,
    pub view: ViewState,
    scene: PartScene,
    panels: Panels,
    kept: KeptSettings,
    frame: Frame,
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
        gpu::install(state);
        theme::apply(&cc.egui_ctx);
        let waker = cc.egui_ctx.clone();
        let wake = Wake::new(move |wait| waker.request_repaint_after(wait));
        Ok(Self::around(Session::new(
            Document::new(loaded, path),
            wake,
        )))
    }

    /// The window around a session that nobody has looked at yet.
    fn around(session: Session) -> Self {
        Self {
            view: ViewState::of(&session.document),
            scene: PartScene::of(&session.document, &session.shape),
            session,
            panels: Panels::default(),
            kept: KeptSettings::default(),
            frame: Frame::default(),
        }
    }

    /// Keeps unsaved changes in a folder from now on, and offers what was left there.
    pub fn keep_unsaved_in(&mut self, home: &Path) {
        self.kept.recovery = Some(recovery::Recovery::new(home));
    }

    /// Keeps the list of recent files in a folder from now on.
    pub fn keep_recent_in(&mut self, home: &Path) {
        self.kept.recent = recent::Recent::kept_in(home);
    }

    /// Puts a file among the recent ones.
    fn remember(&mut self, file: &Path) {
        self.kept.recent.push(file);
    }

    /// Whether a job is running that somebody waits for.
    #[must_use]
    pub fn busy(&self) -> bool {
        self.session.busy()
    }

    /// How a stage stands.
    #[must_use]
    pub fn standing(&self, stage: Stage) -> Standing {
        self.session.standing(stage)
    }

    /// Whether colours with a legend are shown.
    #[must_use]
    pub fn shows_field(&self) -> bool {
        self.scene.shows_field()
    }

    /// Where a point of the limb (m) appears in the unrolled view, in points.
    #[must_use]
    pub fn flat_place(&self, p: glam::DVec3) -> Option<egui::Pos2> {
        self.scene.flat_place(&self.view, p)
    }

    /// Where a stroke at a point of the part (m) is repeated.
    #[must_use]
    pub fn image(&self, p: glam::DVec3) -> Option<glam::DVec3> {
        self.scene.image(&self.view, p)
    }

    /// Shows kept selections by their numbers, beside those that are shown already.
    pub fn show_kept(&mut self, numbers: impl IntoIterator<Item = usize>) {
        let kept = &self.session.document.state.project.kept;
        let names = numbers
            .into_iter()
            .filter_map(|n| Some(kept.get(n)?.name.clone()));
        self.view.shown_kept.extend(names);
    }

    /// Whether a command can be given now.
    #[must_use]
    pub fn enabled(&self, command: UiCommand) -> bool {
        commands::enabled(&self.session, &self.view, command)
    }

    /// What hands and eyes are at.
    fn attention(&self, ctx: &Context) -> Attention {
        let view = &self.view;
        let expected = view.field == Field::Expected;
        let confusions = expected || view.tab == Tab::Confusions;
        Attention {
            hand: ctx.input(|i| i.pointer.any_down()) || !view.is_idle(),
            moved: view.moved_gauge(),
            picked: view.picked.first().copied(),
            expected: confusions || view.tool == Tool::Gauges,
            confusions,
            colours: match view.field {
                Field::Error => Some(Colours::Field(FieldKind::Error)),
                Field::Uncertainty => Some(Colours::Field(FieldKind::Uncertainty)),
                Field::Faces | Field::Thickness => Some(Colours::Walls),
                _ => None,
            },
            jig: view.jig_shown,
            pointed: view.hover.filter(|_| expected),
        }
    }

    /// Has the session go on, and follows what has happened in it.
    fn advance(&mut self, ctx: &Context) {
        let attention = self.attention(ctx);
        self.session.advance(&attention);
        self.frame.attention = attention;
        self.follow();
    }

    /// Has the next frame come at once where the session must hear of something that is looked at only now.
    fn look_again(&self, ctx: &Context) {
        if self.attention(ctx) != self.frame.attention {
            ctx.request_repaint();
        }
    }

    fn follow(&mut self) {
        for event in self.session.news.take_events() {
            match event {
                Happening::Opened { file, recovered } => {
                    self.show_opened(file.as_deref(), recovered);
                }
                Happening::Saved(file) => self.remember(&file),
                Happening::Kept(name) => {
                    self.view.shown_kept.insert(name);
                    self.view.tab = Tab::Compare;
                }
                Happening::Designed => self.view.tab = Tab::Error,
                Happening::GaugesReplaced => self.view.picked.clear(),
                Happening::GaugeFound(number) => {
                    self.view.take(Tool::Gauges);
                    self.view.picked = vec![number];
                }
                Happening::Connected => self.view.tab = Tab::Live,
            }
        }
    }

    /// Another project is open: nothing that is shown or asked of the one before stays.
    fn show_opened(&mut self, file: Option<&Path>, recovered: bool) {
        let (stage, tab) = (self.view.stage, self.view.tab);
        self.view = ViewState {
            stage,
            tab,
            ..ViewState::of(&self.session.document)
        };
        self.scene = PartScene::of(&self.session.document, &self.session.shape);
        self.frame = Frame::default();
        self.panels.dialogs = dialogs::Dialogs::default();
        self.panels.live.record_to.clear();
        if let Some(file) = file {
            self.kept.recent.push(file);
        }
        if let Some(recovery) = self.kept.recovery.as_mut().filter(|_| recovered) {
            recovery.drop_left();
        }
    }

    /// Lets a panel ask, and carries out what it asked for.
    fn asking<T>(
        &mut self,
        ctx: &Context,
        panel: impl FnOnce(&mut Ask<'_>, &mut PartScene, &mut Panels, &KeptSettings) -> T,
    ) -> T {
        let mut ask = Ask::new(&self.session, &mut self.view);
        let answer = panel(&mut ask, &mut self.scene, &mut self.panels, &self.kept);
        let actions = ask.into_actions();
        for action in actions {
            ctx.request_repaint();
            if let Some(action) = action.apply(&mut self.session) {
                self.apply(ctx, action);
            }
            self.follow();
        }
        answer
    }

    /// Carries out what concerns the window.
    fn apply(&mut self, ctx: &Context, action: WindowAction) {
        match action {
            WindowAction::Command(command) => self.execute(ctx, command),
            WindowAction::Look(points) => {
                (self.scene).frame_points(&mut self.view, &points, &self.session.document);
            }
            WindowAction::OpenOrAsk(path) => self.open_or_ask(&path),
            WindowAction::Picture(path, picture) => {
                let (session, view, scene) = (&mut self.session, &self.view, &mut self.scene);
                picture::save(session, view, scene, ctx, path, &picture);
            }
            WindowAction::Recover => {
                let left = self
                    .kept
                    .recovery
                    .as_mut()
                    .and_then(recovery::Recovery::take_left);
                if let Some((folder, project, path)) = left {
                    self.session.open_kept(folder, project, path);
                }
            }
            WindowAction::DropLeft => {
                if let Some(recovery) = &mut self.kept.recovery {
                    recovery.drop_left();
                }
            }
            WindowAction::Close => {
                self.frame.closes = true;
                ctx.send_viewport_cmd(ViewportCommand::Close);
            }
        }
    }

    /// Opens a file, or asks where something would be lost or is not known.
    fn open_or_ask(&mut self, path: &Path) {
        if path.extension().is_some_and(|e| e == crate::link::ENDING) {
            self.view.stage = Stage::Live;
            return self.session.connect(&path.display().to_string());
        }
        let dialog = Dialog::open_dropped(path);
        if dialog.needs_unit() || self.session.document.is_dirty() {
            self.panels.dialogs.path = Some(dialog);
        } else {
            self.session.open_path(path, None);
        }
    }

    /// Carries a command out.
    pub fn execute(&mut self, ctx: &Context, command: UiCommand) {
        self.asking(ctx, |ask, scene, panels, _| {
            execute::execute(command, ctx, ask, scene, panels);
        });
    }

    /// Everything but what lies over the panels.
    fn panels(&mut self, ui: &mut egui::Ui) {
        let ctx = &ui.ctx().clone();
        Panel::top("menu").show(ui, |ui| {
            self.asking(ctx, |ask, _, _, kept| menu::menu(ask, &kept.recent, ui));
        });
        Panel::bottom("messages")
            .show_separator_line(false)
            .show(ui, |ui| {
                self.asking(ctx, |ask, _, _, _| jobs::status(ask, ui));
            });
        Panel::left("stages")
            .default_size(216.0)
            .size_range(180.0..=320.0)
            .show(ui, |ui| {
                self.asking(ctx, |ask, _, _, _| stages::stages(ask, ui));
            });
        Panel::right("inspector")
            .default_size(300.0)
            .size_range(250.0..=460.0)
            .show(ui, |ui| {
                self.asking(ctx, |ask, _, panels, _| panels.inspector(ask, ui));
            });
        Panel::bottom("results")
            .resizable(true)
            .default_size(260.0)
            .size_range(120.0..=520.0)
            .show(ui, |ui| {
                self.asking(ctx, |ask, _, panels, _| panels.results(ask, ui));
            });
        CentralPanel::no_frame().show(ui, |ui| self.views(ctx, ui));
    }

    /// The bar over the views, the views, and what the tool in hand needs.
    fn views(&mut self, ctx: &Context, ui: &mut egui::Ui) {
        // The views cover everything below the bar: nothing is painted behind them.
        ui.spacing_mut().item_spacing.y = 0.0;
        self.asking(ctx, |ask, scene, _, _| toolbar::toolbar(ask, scene, ui));
        ui.reset_style();
        let panes = self.asking(ctx, |ask, scene, _, _| viewport::show(scene, ui, ask));
        self.scene.build(&self.session, &self.view);
        layout::draw(self.look(), ui, &panes);
        let limb = self.view.rect;
        self.asking(ctx, |ask, scene, _, _| {
            toolbar::options(ask, scene, ui, limb);
        });
    }

    /// All that a picture is made of.
    fn look(&self) -> LimbLook<'_> {
        LimbLook {
            session: &self.session,
            view: &self.view,
            scene: &self.scene,
        }
    }

    /// What is open over the panels.
    fn over(&mut self, ctx: &Context) {
        self.asking(ctx, |ask, _, panels, kept| {
            panels.over(ctx, ask, kept.recovery.as_ref());
        });
    }

    /// Keys are commands while nothing is open over the panels.
    fn keys(&mut self, ctx: &Context) {
        // The emergency stop works whatever is open.
        self.asking(ctx, |ask, _, _, _| keys::halt(ctx, ask));
        let offers = (self.kept.recovery.as_ref()).is_some_and(recovery::Recovery::offers);
        if self.panels.is_covered() || offers {
            return;
        }
        self.asking(ctx, |ask, _, _, _| keys::shortcuts(ctx, ask));
    }

    /// A gesture has ended when nothing is held down any more: what it changed is one step of undo.
    fn settle(&mut self, ctx: &Context) {
        // Another selector and its gauges are one step of undo.
        self.session.follow_selector();
        self.follow();
        let focused = ctx.memory(egui::Memory::focused);
        let typing = ctx.egui_wants_keyboard_input() && focused == self.frame.focused;
        self.frame.focused = focused;
        if !ctx.input(|i| i.pointer.any_down()) && !typing {
            self.session.document.settle();
        }
    }

    fn update_title(&mut self, ctx: &Context) {
        let document = &self.session.document;
        let dirty = if document.is_dirty() {
            " · not saved"
        } else {
            ""
        };
        let title = format!("{}{dirty} – HapDef Studio", document.name());
        if title != self.frame.title {
            self.frame.title.clone_from(&title);
            ctx.send_viewport_cmd(ViewportCommand::Title(title));
        }
    }

    fn guard_close(&mut self, ctx: &Context) {
        let closes = ctx.input(|i| i.viewport().close_requested());
        if closes && self.session.document.is_dirty() && !self.frame.closes {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.panels.dialogs.quit = true;
        }
    }

    fn accept_drops(&mut self, ctx: &Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_owned()));
        if let Some(path) = dropped {
            self.open_or_ask(&path);
        }
    }

    fn keep_unsaved(&mut self, ctx: &Context) {
        let recovery = self.kept.recovery.as_mut();
        let failed = recovery.and_then(|r| r.keep(&self.session.document, ctx));
        if let Some(failed) = failed {
            self.session.complain(failed);
        }
    }
}

impl eframe::App for Studio {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.accept_drops(&ctx);
        self.advance(&ctx);
        self.keys(&ctx);
        self.panels(ui);
        self.over(&ctx);
        self.settle(&ctx);
        self.look_again(&ctx);
        self.update_title(&ctx);
        self.keep_unsaved(&ctx);
        self.guard_close(&ctx);
    }

    fn on_exit(&mut self) {
        self.session.leave_bench();
        // Whoever closes the window has saved, or said that it need not be.
        if let Some(recovery) = &mut self.kept.recovery {
            recovery.close();
        }
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }
}
