//! The gauge, how it is glued, and the room that it needs.

use egui::Ui;

use super::super::ask::Ask;
use super::super::form::{count, number, rows, switch};
use crate::project::{FeasibleKeys, GaugeKeys, Project, ToleranceKeys};

/// The settings of the feasible region.
pub fn feasible_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    ask.edit(|project| {
        rows(ui, "Gauge", |ui| gauge(ui, project));
        rows(ui, "Room", |ui| feasible(ui, project));
    });
}

fn gauge(ui: &mut Ui, project: &mut Project) {
    let gauge = &mut project.gauge;
    number(
        ui,
        "Noise",
        &mut gauge.noise_microstrain,
        GaugeKeys::noise_microstrain(),
        0.1,
    );
    number(
        ui,
        "Common drift",
        &mut gauge.drift_microstrain,
        GaugeKeys::drift_microstrain(),
        0.1,
    );
    number(
        ui,
        "Range",
        &mut gauge.range_microstrain,
        GaugeKeys::range_microstrain(),
        100.0,
    );
    number(
        ui,
        "Least signal to noise",
        &mut gauge.least_signal_to_noise,
        GaugeKeys::least_signal_to_noise(),
        0.1,
    );
    number(
        ui,
        "Grid length",
        &mut gauge.grid_length_mm,
        GaugeKeys::grid_length_mm(),
        0.1,
    );
    number(
        ui,
        "Grid width",
        &mut gauge.grid_width_mm,
        GaugeKeys::grid_width_mm(),
        0.1,
    );
    number(
        ui,
        "Flatness",
        &mut gauge.flatness_mm,
        GaugeKeys::flatness_mm(),
        0.01,
    );
    gluing(ui, &mut gauge.tolerance);
}

/// How far off gauges are glued.
fn gluing(ui: &mut Ui, tolerance: &mut ToleranceKeys) {
    number(
        ui,
        "Place off",
        &mut tolerance.place_mm,
        ToleranceKeys::place_mm(),
        0.01,
    );
    number(
        ui,
        "Angle off",
        &mut tolerance.angle_deg,
        ToleranceKeys::angle_deg(),
        0.05,
    );
    number(
        ui,
        "Gain off",
        &mut tolerance.gain_percent,
        ToleranceKeys::gain_percent(),
        0.05,
    );
}

fn feasible(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "Support clearance",
        &mut project.feasible.support_clearance_mm,
        FeasibleKeys::support_clearance_mm(),
        0.1,
    );
    count(
        ui,
        "Edge neighbours",
        &mut project.feasible.edge_neighbours,
        FeasibleKeys::edge_neighbours(),
    );
    number(
        ui,
        "Edge radius",
        &mut project.feasible.edge_radius_mm,
        FeasibleKeys::edge_radius_mm(),
        0.05,
    );
    switch(
        ui,
        "Within a jig's reach",
        &mut project.feasible.jig,
        FeasibleKeys::jig(),
    );
}
