//! Candidates, and which of them get a gauge.

use egui::Ui;

use super::super::ask::Ask;
use super::super::form::{choice, count, number, percentage, rows, switch};
use crate::placement::{LostBy, SelectorKind};
use crate::plain;
use crate::project::{CandidateKeys, Project, SelectionKeys};
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
        CandidateKeys::unexplained(),
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
        count(ui, "Candidates", kept, CandidateKeys::count());
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
        &SelectionKeys::selector().sentence(),
    );
    count(
        ui,
        "Gauges",
        &mut project.selection.sensors,
        SelectionKeys::sensors(),
    );
    number(
        ui,
        "Least spacing",
        &mut project.selection.spacing_mm,
        SelectionKeys::spacing_mm(),
        0.1,
    );
    percentage(
        ui,
        "Chance of failure",
        &mut project.selection.failure,
        SelectionKeys::failure(),
    );
    losses(ui, project);
    switch(
        ui,
        "Compare selectors",
        &mut project.selection.compare,
        SelectionKeys::compare(),
    );
    beyond_greedy(ui, project);
    switch(
        ui,
        "With noise",
        &mut project.selection.with_noise,
        SelectionKeys::with_noise(),
    );
    switch(
        ui,
        "Refine places",
        &mut project.selection.refine,
        SelectionKeys::refine(),
    );
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
        count(ui, "Gauges lost", &mut keys.lost, SelectionKeys::lost());
    }
    choice(
        ui,
        "Which loss counts",
        &mut keys.lost_by,
        &LostBy::ALL,
        LostBy::title,
        &SelectionKeys::lost_by().sentence(),
    );
}

/// How far a choice goes beyond gauge after gauge, where a selector does so when it is asked to.
fn beyond_greedy(ui: &mut Ui, project: &mut Project) {
    let selectors = project.selectors();
    let keys = &mut project.selection;
    if selectors.iter().any(|k| k.exchanges_if_asked()) {
        switch(
            ui,
            "Exchange gauges",
            &mut keys.exchange,
            SelectionKeys::exchange(),
        );
    }
    if selectors.iter().any(|k| k.has_starts()) {
        count(
            ui,
            "First gauges",
            &mut keys.starts,
            SelectionKeys::starts(),
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
        SelectionKeys::c_mm(),
        1.0,
    );
    number(
        ui,
        "ε",
        &mut project.selection.epsilon_mm,
        SelectionKeys::epsilon_mm(),
        0.01,
    );
    number(
        ui,
        "γ",
        &mut project.selection.gamma,
        SelectionKeys::gamma(),
        0.005,
    );
}
