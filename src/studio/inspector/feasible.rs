//! The gauge, how it is glued, and the room that it needs.

use egui::Ui;

use super::super::ask::Ask;
use super::super::form::{count, number, rows};
use crate::project::{
    ANGLE_OFF, DRIFT, EDGE_NEIGHBOURS, GAIN_OFF, PLACE_OFF, Project, ToleranceKeys,
};

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
        0.0..=1e5,
        0.1,
        " µε",
        "Standard deviation of a reading, in microstrain",
    );
    number(
        ui,
        "Common drift",
        &mut gauge.drift_microstrain,
        DRIFT,
        0.1,
        " µε",
        "Standard deviation of what all channels drift by together while a touch lasts",
    );
    number(
        ui,
        "Range",
        &mut gauge.range_microstrain,
        1.0..=1e6,
        100.0,
        " µε",
        "Largest strain that gauge and amplifier can take, in microstrain",
    );
    number(
        ui,
        "Least signal to noise",
        &mut gauge.least_signal_to_noise,
        0.0..=1e6,
        0.1,
        "",
        "Rms strain over noise that a site must reach",
    );
    number(
        ui,
        "Grid length",
        &mut gauge.grid_length_mm,
        0.01..=1e3,
        0.1,
        " mm",
        "Of the measuring grid, along the gauge",
    );
    number(
        ui,
        "Grid width",
        &mut gauge.grid_width_mm,
        0.01..=1e3,
        0.1,
        " mm",
        "Across the gauge",
    );
    number(
        ui,
        "Flatness",
        &mut gauge.flatness_mm,
        0.0..=1e3,
        0.01,
        " mm",
        "Largest height of the surface over the gauge's plane",
    );
    gluing(ui, &mut gauge.tolerance);
}

/// How far off gauges are glued.
fn gluing(ui: &mut Ui, tolerance: &mut ToleranceKeys) {
    number(
        ui,
        "Place off",
        &mut tolerance.place_mm,
        PLACE_OFF,
        0.01,
        " mm",
        "How far from its place a gauge is glued, in any direction (standard deviation)",
    );
    number(
        ui,
        "Angle off",
        &mut tolerance.angle_deg,
        ANGLE_OFF,
        0.05,
        "°",
        "How far from its direction a gauge is glued (standard deviation)",
    );
    number(
        ui,
        "Gain off",
        &mut tolerance.gain_percent,
        GAIN_OFF,
        0.05,
        " %",
        "How far off the gain of a glued gauge is (standard deviation)",
    );
}

fn feasible(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "Support clearance",
        &mut project.feasible.support_clearance_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Least distance over the surface from anything held",
    );
    count(
        ui,
        "Edge neighbours",
        &mut project.feasible.edge_neighbours,
        EDGE_NEIGHBOURS,
        "k of the centre-of-mass filter",
    );
    number(
        ui,
        "Edge radius",
        &mut project.feasible.edge_radius_mm,
        0.0..=1e4,
        0.05,
        " mm",
        "How far the centre of mass of the neighbours may lie from a site",
    );
}
