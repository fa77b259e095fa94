//! Selections that are kept: named, shown beside each other, taken again.

use std::collections::BTreeSet;

use egui::{Color32, Painter, Stroke, TextEdit, Ui, vec2};
use glam::DVec3;

use super::action::ProjectChange;
use super::ask::Ask;
use super::paint::{LimbLook, empty};
use super::theme::kept_colour;
use super::view::Pane;
use crate::evaluation::EVERYWHERE;
use crate::project::KeptSelection;
use crate::session::chooser_title;

/// The tab: what is kept, side by side.
pub fn compare_tab(ask: &mut Ask<'_>, ui: &mut Ui) {
    if ask.project().kept.is_empty() {
        empty(
            ui,
            "Nothing kept yet. Press “Keep this selection”, change what you like, and keep the next to see both side by side",
        );
        return;
    }
    let mut asked = KeptAction::None;
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        egui::Grid::new("kept")
            .num_columns(10)
            .striped(true)
            .spacing([12.0, 4.0])
            .show(ui, |ui| {
                for title in [
                    "Show",
                    "Name",
                    "Chosen by",
                    "Quality",
                    "Gauges",
                    "Error (mm)",
                    "Median (mm)",
                    "3 failed (mm)",
                    "Cost",
                    "Time (s)",
                    "",
                ] {
                    ui.strong(title);
                }
                ui.end_row();
                let mut shown = ask.view.shown_kept.clone();
                ask.edit(|project| {
                    for (k, kept) in project.kept.iter_mut().enumerate() {
                        kept_row(ui, k, kept, &mut shown, &mut asked);
                    }
                });
                ask.view.shown_kept = shown;
            });
    });
    match asked {
        KeptAction::None => {}
        KeptAction::Use(k) => {
            let sites = ask.project().kept[k].sites.clone();
            ask.act(ProjectChange::UseGauges(sites));
        }
        KeptAction::Delete(k) => {
            // Its name stays among those shown: when the deletion is taken back, so is this.
            ask.act(ProjectChange::DeleteKept(k));
        }
    }
}

/// The sites of the kept selections that are shown, as rhombs.
pub fn paint_kept(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    let toward = look.view.camera.toward_eye();
    for (k, kept) in look.view.compared(look.project()) {
        for site in &kept.sites {
            let position = DVec3::from_array(site.position_mm) / 1000.0;
            let (on, _) = look.scene.index.nearest(position);
            let away = look.session.document.part.normal(on).dot(toward) < 0.0;
            let Some(at) = look.place_in(pane, position) else {
                continue;
            };
            let faint = pane == Pane::Limb && away;
            let ink = kept_colour(k).gamma_multiply(if faint { 0.45 } else { 1.0 });
            painter.add(rhomb(at, 8.0, ink));
        }
    }
}

fn rhomb(at: egui::Pos2, radius: f32, ink: Color32) -> egui::Shape {
    let around = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)];
    let corners = around.map(|(x, y)| at + vec2(x, y) * radius).to_vec();
    egui::Shape::closed_line(corners, Stroke::new(2.5, ink))
}

enum KeptAction {
    None,
    Use(usize),
    Delete(usize),
}

fn kept_row(
    ui: &mut Ui,
    k: usize,
    kept: &mut KeptSelection,
    shown: &mut BTreeSet<String>,
    asked: &mut KeptAction,
) {
    let name = kept.name.clone();
    let mut on = shown.contains(&name);
    ui.horizontal(|ui| {
        let tick = ui.checkbox(&mut on, "");
        if tick.accessible_name(format!("Show {name}")).changed() {
            if on {
                shown.insert(name.clone());
            } else {
                shown.remove(&name);
            }
        }
        let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
        ui.painter().add(rhomb(rect.center(), 6.0, kept_colour(k)));
    });
    let height = ui.spacing().interact_size.y;
    ui.add_sized([160.0, height], TextEdit::singleline(&mut kept.name))
        .accessible_name(format!("Name of kept selection {}", k + 1));
    if kept.name != name && shown.remove(&name) {
        shown.insert(kept.name.clone());
    }
    ui.label(chooser_title(&kept.selector));
    ui.label(kept.quality.title());
    ui.monospace(format!("{:>3}", kept.sites.len()));
    let last = (kept.errors.iter()).rev().find(|e| e.region == EVERYWHERE);
    let number = |value: Option<f64>| value.map_or("–".into(), |v| format!("{v:6.2}"));
    ui.monospace(number(last.map(|e| e.mean_mm)));
    ui.monospace(number(last.map(|e| e.median_mm)));
    let failed = kept.failures.iter().find(|f| f.failed == 3 && !f.retrained);
    ui.monospace(number(failed.map(|f| f.mean_mm)));
    ui.monospace(format!("{:5.1}", kept.cost));
    ui.monospace(format!("{:6.1}", kept.seconds));
    ui.horizontal(|ui| {
        let button = ui
            .button("Use")
            .on_hover_text("Make these the project's gauges");
        if button.accessible_name(format!("Use {name}")).clicked() {
            *asked = KeptAction::Use(k);
        }
        let button = ui.button("Delete");
        if button.accessible_name(format!("Delete {name}")).clicked() {
            *asked = KeptAction::Delete(k);
        }
    });
    ui.end_row();
}
