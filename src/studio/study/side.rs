//! The design that is looked at: its limb, its values and figures; and those that no other beats.

use std::fmt::Write as _;

use egui::{Grid, RichText, Sense, Ui, vec2};

use super::super::action::FileAction;
use super::super::ask::Ask;
use super::super::theme;
use super::chosen::{FRONT, StudyView};
use super::folder::open_row;
use crate::plain;
use crate::session::{OpenStudy, Task};

/// Of the picture of a limb.
const PICTURE: f32 = 116.0;
/// Designs on the front that are listed.
const LISTED: usize = 40;

/// The side.
pub fn side(
    ask: &mut Ask<'_>,
    view: &mut StudyView,
    (study, kept): (&OpenStudy, &[bool]),
    ui: &mut Ui,
) {
    let [done, failed, missing] = study.collected.counts();
    let mut words = format!("{done} designs are judged");
    if failed > 0 {
        let _ = write!(words, ", {failed} failed");
    }
    if missing > 0 {
        let _ = write!(words, ", {missing} missing");
    }
    ui.add(egui::Label::new(RichText::new(words).strong()).wrap());
    if let Some(unit) = view.looked_at() {
        one(ask, view, study, unit, ui);
    } else {
        let text = "Point at a design to see its limb; click to keep it here";
        ui.add(egui::Label::new(RichText::new(text).weak()).wrap());
    }
    ui.add_space(4.0);
    front(view, study, kept, ui);
    ui.add_space(6.0);
    ui.collapsing("Another study", |ui| open_row(ask, view, ui));
}

fn one(ask: &mut Ask<'_>, view: &mut StudyView, study: &OpenStudy, unit: usize, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.strong(format!("Unit {unit}"));
        if study.collected.rows[unit].on_front {
            ui.label(RichText::new("on the front").color(FRONT));
        }
        let button = egui::Button::new("Open as project");
        let button = ui
            .add_enabled(!ask.session.document.is_dirty(), button)
            .on_hover_text("Writes this design as a project into the study's folder, and opens it")
            .on_disabled_hover_text("The project that is open is not saved: save it first");
        if button.clicked() {
            ask.act(FileAction::OpenUnit(unit));
        }
    });
    let row = &study.collected.rows[unit];
    if let Some(why) = row.outcome.as_ref().and_then(|o| o.error.as_ref()) {
        ui.add(egui::Label::new(RichText::new(why).color(theme::ERROR)).wrap());
    }
    ui.horizontal_top(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(PICTURE, PICTURE), Sense::hover());
        // The one before stays until this one is there.
        let waits = ask.session.jobs.runs(Task::UnitLimb);
        let limb = ask.session.study.limb();
        if let Some(limb) = limb.filter(|limb| limb.unit == unit || waits) {
            view.thumbnail.show(limb, rect, ui);
        }
        Grid::new("unit")
            .num_columns(2)
            .spacing([8.0, 2.0])
            .show(ui, |ui| {
                let shown = study.columns.iter().filter(|c| c.is_axis || c.is_asked);
                for column in shown {
                    ui.label(RichText::new(&column.name).size(11.0).weak());
                    ui.add(
                        egui::Label::new(RichText::new(column.in_words(unit)).size(11.0))
                            .truncate(),
                    );
                    ui.end_row();
                }
            });
    });
    ui.collapsing("All figures", |ui| {
        Grid::new("figures")
            .num_columns(2)
            .spacing([8.0, 2.0])
            .show(ui, |ui| {
                for column in study.columns.iter().filter(|c| !c.is_axis) {
                    ui.label(RichText::new(&column.name).size(11.0));
                    ui.add(
                        egui::Label::new(RichText::new(column.in_words(unit)).size(11.0))
                            .truncate(),
                    );
                    ui.end_row();
                }
            });
    });
}

/// Designs that no other beats, for those who do not point.
fn front(view: &mut StudyView, study: &OpenStudy, kept: &[bool], ui: &mut Ui) {
    let [x, y] = view.across.map(|k| &study.columns[k]);
    let mut units: Vec<usize> = study.collected.on_front();
    units.retain(|&unit| kept[unit]);
    units.sort_by(|a, b| y.values[*a].total_cmp(&y.values[*b]));
    if units.is_empty() {
        return;
    }
    ui.strong(format!(
        "On the front: {}",
        plain::count(units.len(), "design")
    ));
    for &unit in units.iter().take(LISTED) {
        let words = format!("Unit {unit}: {} · {}", y.in_words(unit), x.in_words(unit));
        let chosen = view.picked == Some(unit);
        if ui
            .selectable_label(chosen, RichText::new(words).small())
            .clicked()
        {
            view.picked = (!chosen).then_some(unit);
        }
    }
    if units.len() > LISTED {
        ui.weak(format!("and {} more", units.len() - LISTED));
    }
}
