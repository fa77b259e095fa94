//! What judges the gauges, and where.

use std::sync::Arc;

use egui::Ui;

use super::super::ask::Ask;
use super::super::form::{choice, rows};
use super::corners::{corners, names_along};
use crate::evaluation::EstimatorKind;
use crate::limb::BoxMm;
use crate::mesh::oriented_box::OrientedBox;
use crate::project::{EvaluationKeys, Project, RegionKeys, boxes};

/// The settings of the evaluation.
pub fn evaluation_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let part = Arc::clone(&ask.session.document.part);
    let stance = ask.view.camera.stance;
    let start = || boxes::keys(&OrientedBox::around(&part, stance));
    ask.edit(|project| {
        rows(ui, "Judge", |ui| {
            choice(
                ui,
                "Estimator",
                &mut project.evaluation.estimator,
                &EstimatorKind::ALL,
                EstimatorKind::title,
                &EvaluationKeys::estimator().sentence(),
            );
            as_in_the_paper(ui, project);
        });
        let evaluation = &mut project.evaluation;
        let regions = &mut evaluation.regions;
        rows(ui, "Regions", |ui| regions_form(ui, regions, start));
    });
}

/// One press for the comparison that the paper makes.
fn as_in_the_paper(ui: &mut Ui, project: &mut Project) {
    const HELP: &str = "The paper's selectors beside each other, judged by support vector regression (minutes at Standard): sets the estimator, the selector and “Compare selectors”; undo takes it back";
    ui.label("");
    if ui
        .button("Compare as in the paper")
        .on_hover_text(HELP)
        .clicked()
    {
        project.compare_as_in_the_paper();
    }
    ui.end_row();
}

/// The regions that errors are quoted for, with a new one beginning as the box that `start` gives.
pub fn regions_form(
    ui: &mut Ui,
    regions: &mut Vec<RegionKeys>,
    start: impl FnOnce() -> (BoxMm, Option<[f64; 3]>),
) {
    let mut removed = None;
    for (k, region) in regions.iter_mut().enumerate() {
        let number = k + 1;
        let name = ui.label(format!("Region {number}"));
        ui.text_edit_singleline(&mut region.name)
            .labelled_by(name.id);
        ui.end_row();
        let names = names_along(ui, region.box_axis);
        corners(ui, &format!("Region {number}"), names, &mut region.box_mm);
        ui.label("");
        let button = ui.button("Remove");
        if button
            .accessible_name(format!("Remove region {number}"))
            .clicked()
        {
            removed = Some(k);
        }
        ui.end_row();
    }
    if let Some(k) = removed {
        regions.remove(k);
    }
    let button = ui
        .button("Add region")
        .on_hover_text("Errors are quoted for it beside all touches");
    if button.clicked() {
        let (box_mm, box_axis) = start();
        regions.push(RegionKeys {
            name: format!("region {}", regions.len() + 1),
            box_mm,
            box_axis,
        });
    }
    ui.end_row();
}
