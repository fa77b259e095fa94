//! The window on the desktop.

use std::cell::Cell;
use std::path::Path;

use super::{Studio, display};
use crate::io::{opening, project_file};

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
        if let Some(home) = eframe::storage_dir("hapdef-studio") {
            studio.keep_unsaved_in(&home.join("unsaved"));
            studio.keep_recent_in(&home);
            studio.session.keep_trades_in(&home.join("trades"));
            if let Some(path) = file {
                studio.remember(path);
            }
        }
        Ok(Box::new(studio))
    };
    // Before there is a window: the display may go while it is made.
    if display.answers() {
        display.opened();
        display.clone().end_with_it();
    }
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
