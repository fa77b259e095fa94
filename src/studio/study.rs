//! The tab “Study”: what the units of a parameter study found, as a scatter plot and as parallel coordinates with one
//! selection, and the limb of the design under the pointer.

mod chosen;
mod folder;
mod limb;
mod lines;
mod plot;
mod raster;
mod side;

pub use chosen::StudyView;

use std::sync::Arc;

use egui::Ui;

use super::action::Compute;
use super::ask::Ask;
use super::paint::empty;
use folder::open_row;

/// Of the side with the design that is looked at.
const SIDE: f32 = 262.0;

/// The tab.
pub fn study_tab(ask: &mut Ask<'_>, view: &mut StudyView, ui: &mut Ui) {
    let Some(study) = ask.session.study.open().map(Arc::clone) else {
        return nothing_open(ask, view, ui);
    };
    if study.columns.is_empty() {
        return empty(
            ui,
            "The study has no axis, and nothing of it was computed yet",
        );
    }
    view.follow(&study);
    let kept: Arc<[bool]> = (0..study.collected.rows.len())
        .map(|unit| view.keeps(&study, unit))
        .collect();
    let size = ui.available_size();
    let plots = ((size.x - SIDE - 40.0) / 2.0).max(150.0);
    let mut hovered = None;
    ui.horizontal_top(|ui| {
        ui.allocate_ui(egui::vec2(plots, size.y), |ui| {
            ui.vertical(|ui| hovered = plot::scatter(view, &study, &kept, ui));
        });
        ui.separator();
        ui.allocate_ui(egui::vec2(plots, size.y), |ui| {
            ui.vertical(|ui| hovered = lines::parallel(view, &study, &kept, ui).or(hovered));
        });
        ui.separator();
        egui::ScrollArea::vertical()
            .id_salt("study side")
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.vertical(|ui| side::side(ask, view, (&study, &kept), ui))
            });
    });
    view.hovered = hovered;
    if let Some(unit) = view
        .looked_at()
        .filter(|&unit| ask.session.needs_limb(unit))
    {
        ask.act(Compute::LookAtUnit(unit));
    }
}

fn nothing_open(ask: &mut Ask<'_>, view: &mut StudyView, ui: &mut Ui) {
    empty(
        ui,
        "A study varies a project along axes and judges every design (hapdef study plan, then hapdef study run). Open its folder, at any moment, to see what it found",
    );
    ui.vertical_centered(|ui| open_row(ask, view, ui));
}
