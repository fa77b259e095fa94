//! Candidates, and which of them get a gauge.

use egui::Ui;

use super::super::ask::Ask;
use super::super::form::{choice, count, number, percentage, rows};
use crate::placement::{LostBy, SelectorKind};
use crate::plain;
use crate::project::{GAUGES, LOST, Project, STARTS};
use crate::session::NOBODY_REDUCES;

/// The settings of the candidates.
pub fn candidates_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    ask.edit(|project| rows(ui, "Reduction", |ui| candidates(ui, project)));
}

/// The settings of the selection.
pub fn selection_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    ask.edit(|project| {
        rows(ui, "Gauges", |ui| selection(ui, project));
        pins(ui, project);
        rows(ui, "Regression of greedy SVR", |ui| regression(ui, project));
    });
}

fn candidates(ui: &mut Ui, project: &mut Project) {
    percentage(
        ui,
        "Unexplained",
        &mut project.candidates.unexplained,
        0.01..=99.0,
        "Share of the held-out variance that the candidates may leave unexplained",
    );
    let mut fixed = project.candidates.count.is_some();
    let name = ui.label("Fixed number");
    let tick = ui
        .checkbox(&mut fixed, "")
        .on_hover_text("Keep so many candidates, whatever they leave unexplained")
        .labelled_by(name.id)
        .accessible_name("Fixed number");
    ui.end_row();
    if tick.changed() {
        project.candidates.count = fixed.then_some(160);
    }
    if let Some(kept) = &mut project.candidates.count {
        count(
            ui,
            "Candidates",
            kept,
            1..=100_000,
            "How many of the feasible sites are kept",
        );
    }
    if !project.wants_candidates(&project.selectors()) {
        ui.label("Feasible sites");
        ui.weak("all are candidates").on_hover_text(NOBODY_REDUCES);
        ui.end_row();
    }
}

fn selection(ui: &mut Ui, project: &mut Project) {
    choice(
        ui,
        "Selector",
        &mut project.selection.selector,
        &SelectorKind::ALL,
        SelectorKind::title,
        "Whose sites are shown and reported",
    );
    count(
        ui,
        "Gauges",
        &mut project.selection.sensors,
        GAUGES,
        "How many gauges to place",
    );
    number(
        ui,
        "Least spacing",
        &mut project.selection.spacing_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Between any two gauges",
    );
    percentage(
        ui,
        "Chance of failure",
        &mut project.selection.failure,
        0.0..=100.0,
        "That gauges are lost when they are needed: expected error and greedy SVR then choose sites that can do without each other",
    );
    losses(ui, project);
    let name = ui.label("Compare selectors");
    ui.checkbox(&mut project.selection.compare, "")
        .on_hover_text("Let the other selectors choose too: a curve of errors for each of them, for the time that they take")
        .labelled_by(name.id)
        .accessible_name("Compare selectors");
    ui.end_row();
    beyond_greedy(ui, project);
    let name = ui.label("With noise");
    ui.checkbox(&mut project.selection.with_noise, "")
        .on_hover_text("Choose from signals with the gauge's noise added")
        .labelled_by(name.id)
        .accessible_name("With noise");
    ui.end_row();
    let name = ui.label("Refine places");
    ui.checkbox(&mut project.selection.refine, "")
        .on_hover_text("Move the gauges that “Expected error” has chosen off the sites, along the surface and by their angle, while the expected error falls. Strain only")
        .labelled_by(name.id)
        .accessible_name("Refine places");
    ui.end_row();
}

/// Which gauges may be lost, where that is weighed.
fn losses(ui: &mut Ui, project: &mut Project) {
    let selectors = project.selectors();
    let keys = &mut project.selection;
    let some = |weighs: fn(SelectorKind) -> bool| selectors.iter().any(|&k| weighs(k));
    if keys.failure <= 0.0 || !some(SelectorKind::weighs_losses) {
        return;
    }
    // What a selector refuses is shown too: else nobody could take it back.
    if some(SelectorKind::weighs_losses_together) || keys.lost > 1 {
        count(
            ui,
            "Gauges lost",
            &mut keys.lost,
            LOST,
            "How many are lost together, any of them. Greedy SVR weighs the loss of one only",
        );
    }
    choice(
        ui,
        "Which loss counts",
        &mut keys.lost_by,
        &LostBy::ALL,
        LostBy::title,
        "Of all the gauges that may be lost: the mean over them, or those whose loss is the worst",
    );
}

/// How far a choice goes beyond gauge after gauge, where a selector does so when it is asked to.
fn beyond_greedy(ui: &mut Ui, project: &mut Project) {
    let selectors = project.selectors();
    let keys = &mut project.selection;
    if selectors.iter().any(|k| k.exchanges_if_asked()) {
        let name = ui.label("Exchange gauges");
        ui.checkbox(&mut keys.exchange, "")
            .on_hover_text("Exchange gauges one at a time after all are chosen, while that makes the set better. Expected error always does, PCA-QR never")
            .labelled_by(name.id)
            .accessible_name("Exchange gauges");
        ui.end_row();
    }
    if selectors.iter().any(|k| k.has_starts()) {
        count(
            ui,
            "First gauges",
            &mut keys.starts,
            STARTS,
            "From how many first gauges a set is begun; the best set is kept, for the time that each of them takes",
        );
    }
}

/// Places that must have a gauge, and the way to be rid of them.
fn pins(ui: &mut Ui, project: &mut Project) {
    let pinned = project.selection.required_mm.len();
    if pinned == 0 {
        return;
    }
    ui.horizontal(|ui| {
        ui.label(plain::either(
            pinned,
            "place must have a gauge",
            "places must have a gauge",
        ));
        if ui.button("Release all pins").clicked() {
            project.selection.required_mm.clear();
        }
    });
}

fn regression(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "C",
        &mut project.selection.c_mm,
        1e-3..=1e9,
        1.0,
        " mm",
        "Of greedy SVR's regression: larger follows the touches more closely",
    );
    number(
        ui,
        "ε",
        &mut project.selection.epsilon_mm,
        0.0..=1e3,
        0.01,
        " mm",
        "Errors below this cost nothing",
    );
    number(
        ui,
        "γ",
        &mut project.selection.gamma,
        1e-9..=1e6,
        0.005,
        "",
        "Of the Gaussian kernel on standardized signals",
    );
}
