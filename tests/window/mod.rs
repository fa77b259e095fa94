//! The real window in a test: driven by its accessible names, rendered by a real wgpu adapter.
#![allow(dead_code, reason = "each test uses some of it")]

use std::path::Path;
use std::time::{Duration, Instant};

use eframe::egui_wgpu::wgpu;
use egui::{Event, Modifiers, PointerButton, Pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::DVec3;
use hapdef::budget::Quality;
use hapdef::cli;
use hapdef::session::Session;
use hapdef::studio::Studio;
use image::RgbaImage;

fn adapters() -> Vec<wgpu::Adapter> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

/// What is missing is said, with what to install: a test that passes without having looked is none.
pub fn need_adapter() {
    assert!(
        !adapters().is_empty(),
        "no graphics adapter: tests/run.sh installs mesa-vulkan-drivers"
    );
}

/// Whether every adapter here is the processor itself.
pub fn only_software() -> bool {
    let is_software = |a: &wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
    adapters().iter().all(is_software)
}

pub struct Window {
    pub harness: Harness<'static, Studio>,
}

impl Window {
    pub fn open() -> Self {
        need_adapter();
        let harness = Harness::builder()
            .with_size([1440.0, 900.0])
            .with_theme(egui::Theme::Dark)
            .with_max_steps(120)
            .with_step_dt(1.0 / 60.0)
            .with_render_cursor(false)
            .wgpu()
            .build_eframe(|cc| {
                let mut loaded = cli::bundled().unwrap();
                loaded.inputs.project.budget.quality = Quality::Draft;
                Studio::new(cc, loaded, None).unwrap()
            });
        Self { harness }
    }

    /// The open project and what was computed of it.
    pub fn session(&self) -> &Session {
        &self.harness.state().session
    }

    /// The same, to be changed as from the outside.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.harness.state_mut().session
    }

    /// Presses “Save file” and waits until it is done, or refused.
    pub fn save_file(&mut self) {
        self.press("Save file");
        self.wait("the file", 60, |s| !s.busy());
    }

    pub fn press(&mut self, name: &str) {
        self.harness
            .get_by_role_and_label(egui::Role::Button, name)
            .click();
        self.harness.run_ok();
    }

    /// Looks at a stage.
    pub fn stage(&mut self, name: &str) {
        let label = format!("Stage: {name}");
        self.harness.get_by_label_contains(&label).click();
        self.harness.run_ok();
    }

    /// Opens a file and waits until it is there, or was refused.
    pub fn open_file(&mut self, path: &Path, unit: Option<hapdef::project::Unit>) {
        self.harness.state_mut().session.open_path(path, unit);
        self.wait("the file", 60, |s| !s.busy());
    }

    /// Replaces the path in the open dialog.
    pub fn type_path(&mut self, path: &Path) {
        self.harness.get_by_label("Path").focus();
        self.harness
            .key_press_modifiers(Modifiers::COMMAND, egui::Key::A);
        self.harness
            .get_by_label("Path")
            .type_text(&path.display().to_string());
        self.harness.run_ok();
    }

    pub fn wait(&mut self, what: &str, seconds: u64, done: impl Fn(&Studio) -> bool) {
        let start = Instant::now();
        while !done(self.harness.state()) {
            assert!(
                start.elapsed().as_secs() < seconds,
                "timed out waiting for {what}: {:?}",
                self.harness.state().session.news.messages
            );
            self.harness.step();
            // What is waited for is computed beside this, and needs the processors more.
            std::thread::sleep(Duration::from_millis(25));
        }
        self.harness.run_ok();
    }

    /// Every control that is there has a name.
    pub fn assert_named(&self, place: &str) {
        let controls = [
            egui::Role::Button,
            egui::Role::CheckBox,
            egui::Role::ComboBox,
            egui::Role::Slider,
            egui::Role::SpinButton,
            egui::Role::TextInput,
        ];
        let mut seen = 0;
        for role in controls {
            for node in self.harness.query_all_by(|n| n.role() == role) {
                let node = node.accesskit_node();
                seen += 1;
                let label = node.label().or(node.value());
                assert!(
                    label.is_some_and(|l| !l.trim().is_empty()),
                    "{place}: a {role:?} has no name"
                );
            }
        }
        assert!(seen > 20);
    }

    pub fn picture(&mut self) -> RgbaImage {
        self.harness.render().unwrap()
    }

    /// Where a point of the limb (mm) is in the window.
    pub fn place(&self, x: f64, y: f64, z: f64) -> Pos2 {
        self.harness
            .state()
            .view
            .place(DVec3::new(x, y, z) / 1000.0)
            .unwrap()
    }

    pub fn click(&mut self, at: Pos2) {
        self.drag(&[at]);
    }

    pub fn drag(&mut self, path: &[Pos2]) {
        self.harness.hover_at(path[0]);
        self.harness.step();
        let button = |pos, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.harness.event(button(path[0], true));
        for &p in path {
            self.harness.hover_at(p);
        }
        self.harness.event(button(path[path.len() - 1], false));
        self.harness.run_ok();
    }

    pub fn painted(&self) -> Option<usize> {
        let mask = self
            .harness
            .state()
            .session
            .document
            .state
            .painted
            .as_ref()?;
        Some(mask.iter().filter(|&&m| m).count())
    }
}

/// A command of the palette or of a key.
impl Window {
    pub fn key(&mut self, modifiers: Modifiers, key: egui::Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_ok();
    }

    /// Clicks whatever has a label, of any role.
    pub fn click_label(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        self.harness.run_ok();
    }

    /// Where a point of the limb (mm) is in the unrolled view.
    pub fn flat_place(&self, x: f64, y: f64, z: f64) -> Pos2 {
        let p = DVec3::new(x, y, z) / 1000.0;
        self.harness.state().flat_place(p).unwrap()
    }

    /// Writes what the window shows into the folder that `HAPDEF_PICTURES` names, if it does.
    pub fn show(&mut self, name: &str) {
        if let Some(folder) = std::env::var_os("HAPDEF_PICTURES") {
            let path = Path::new(&folder).join(format!("{name}.png"));
            self.picture().save(&path).unwrap();
        }
    }
}
