//! The tab “Study”: what the units of a parameter study found, as a scatter plot and as parallel coordinates with one
//! selection, and the limb of the design under the pointer.

mod limb;
mod lines;
mod plot;
mod raster;
mod side;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use egui::{TextEdit, Ui};

use super::action::{Compute, FileAction};
use super::ask::Ask;
use super::commands::Command;
use super::paint::empty;
use crate::session::{OpenStudy, Task};
use raster::Raster;

/// Of the side with the design that is looked at.
const SIDE: f32 = 262.0;

/// What is chosen in the tab.
#[derive(Default)]
pub struct StudyView {
    folder: String,
    /// Columns of the scatter plot.
    across: [usize; 2],
    /// Columns of the lines.
    shown: Vec<usize>,
    /// What of a column is kept, from one value to another.
    ranges: BTreeMap<usize, [f64; 2]>,
    /// The unit that was clicked, and the one under the pointer.
    picked: Option<usize>,
    hovered: Option<usize>,
    dots: Raster,
    lines: Raster,
    thumbnail: limb::Thumbnail,
    /// The study that all of this is of.
    of: Option<Arc<OpenStudy>>,
}

impl StudyView {
    /// Begins anew where another study was opened.
    fn follow(&mut self, study: &Arc<OpenStudy>) {
        if self.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, study)) {
            return;
        }
        let folder = std::mem::take(&mut self.folder);
        let figures = |k: &usize| !study.columns[*k].is_axis;
        let asked = |k: &usize| study.columns[*k].is_asked;
        let all = || 0..study.columns.len();
        let minimize = &study.collected.folder.study.aim.minimize;
        let mut across = minimize.iter().filter_map(|name| study.column(name));
        let mut rest = all().filter(figures).chain(all());
        let y = across.next().or_else(|| rest.next()).unwrap_or(0);
        let x = across
            .next()
            .or_else(|| rest.find(|k| *k != y))
            .unwrap_or(y);
        *self = Self {
            folder,
            across: [x, y],
            shown: all()
                .filter(|k| study.columns[*k].is_axis || asked(k))
                .filter(|k| {
                    study.columns[*k]
                        .range()
                        .is_some_and(|[low, high]| low < high)
                })
                .collect(),
            of: Some(Arc::clone(study)),
            ..Self::default()
        };
    }

    /// Whether a unit lies in all ranges.
    fn keeps(&self, study: &OpenStudy, unit: usize) -> bool {
        self.ranges.iter().all(|(&column, [low, high])| {
            let value = study.columns[column].values[unit];
            (*low..=*high).contains(&value)
        })
    }

    /// The unit that is looked at.
    fn looked_at(&self) -> Option<usize> {
        self.hovered.or(self.picked)
    }
}

/// The tab.
pub fn study_tab(ask: &mut Ask<'_>, view: &mut StudyView, ui: &mut Ui) {
    let Some(study) = ask.session.study.open().map(Arc::clone) else {
        return nothing_open(ask, view, ui);
    };
    view.follow(&study);
    let kept: Vec<bool> = (0..study.collected.rows.len())
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
    if let Some(unit) = view.looked_at() {
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

/// Where a study's folder is typed.
fn open_row(ask: &mut Ask<'_>, view: &mut StudyView, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let name = ui.label("Study");
        let field = TextEdit::singleline(&mut view.folder)
            .desired_width(200.0)
            .hint_text("folder of hapdef study plan");
        let field = ui.add(field).labelled_by(name.id);
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let ready = !view.folder.trim().is_empty() && !ask.session.jobs.runs(Task::OpenStudy);
        let button = ui.add_enabled(ready, egui::Button::new("Open study"));
        if ready && (entered || button.clicked()) {
            ask.act(FileAction::OpenStudy(PathBuf::from(view.folder.trim())));
        }
        if ask.session.jobs.runs(Task::OpenStudy) {
            ui.spinner();
            ask.button(ui, Command::Cancel);
        }
    });
}
