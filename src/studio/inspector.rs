//! The right side: the settings of a stage, in the units of the project's file.

use std::sync::Arc;

use egui::{DragValue, RichText, Ui};
use glam::DVec3;

use super::action::{Change, FileAction};
use super::ask::Ask;
use super::commands::Command;
use super::form::{choice, count, number, percentage, rows};
use super::view::{Stage, Tab, Tool};
use crate::budget::{Limits, Quality};
use crate::dataset::Signal;
use crate::document::Layer;
use crate::evaluation::EstimatorKind;
use crate::io::examples::Example;
use crate::limb::BoxMm;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::unroll::Axis;
use crate::placement::{LostBy, SelectorKind};
use crate::plain;
use crate::project::{
    ANGLE_OFF, DRIFT, EDGE_NEIGHBOURS, FARTHEST, FORCES, GAIN_OFF, GAUGES, LOST, Lattice,
    PLACE_OFF, PartAxis, PartModel, Project, RegionKeys, STARTS, SupportKeys, SupportKind, TIP_OFF,
    TOUCHES, ToleranceKeys, boxes,
};
use crate::session::NOBODY_REDUCES;

/// What a stage is, and what for.
pub fn heading(stage: Stage, ui: &mut Ui) {
    ui.add_space(6.0);
    ui.heading(stage.name());
    ui.add(egui::Label::new(purpose(stage)).wrap());
    ui.add_space(4.0);
}

/// The settings of the stage that is looked at.
pub fn settings(ask: &mut Ask<'_>, ui: &mut Ui) {
    match ask.view.stage {
        Stage::Part => part_form(ask, ui),
        Stage::Supports => supports_form(ask, ui),
        Stage::Simulation => {
            ask.edit(|project| quality(ui, project));
            quality_promises(ask, ui);
            ask.edit(|project| {
                rows(ui, "Touch", |ui| touch(ui, project));
                rows(ui, "Signal and sites", |ui| sites(ui, project));
            });
        }
        Stage::Feasible => ask.edit(|project| {
            rows(ui, "Gauge", |ui| gauge(ui, project));
            rows(ui, "Room", |ui| feasible(ui, project));
        }),
        Stage::Candidates => ask.edit(|project| {
            rows(ui, "Reduction", |ui| candidates(ui, project));
        }),
        Stage::Selection => ask.edit(|project| {
            rows(ui, "Gauges", |ui| selection(ui, project));
            pins(ui, project);
            rows(ui, "Regression of greedy SVR", |ui| regression(ui, project));
        }),
        Stage::Evaluation => evaluation_form(ask, ui),
        Stage::Report => ask.button(ui, Command::Export),
        // It has a panel of its own.
        Stage::Live => {}
    }
}

/// What each quality was measured to cost and achieve.
fn quality_promises(ask: &mut Ask<'_>, ui: &mut Ui) {
    for quality in Quality::ALL {
        let chosen = quality == ask.session.quality();
        let text = RichText::new(ask.session.prediction_in_words(quality)).size(11.5);
        ui.add(egui::Label::new(if chosen { text } else { text.weak() }).wrap());
    }
    if ui.button("Speed against accuracy…").clicked() {
        ask.view.tab = Tab::Trade;
    }
}

fn part_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let from_file = !ask.session.document.bundled;
    let bodies = ask.session.document.repairs.bodies;
    let again = from_file && ask.session.document.asks_for_another_part();
    let mesh = &ask.session.document.mesh_path;
    let example = Example::of_mesh(mesh).filter(|_| !from_file);
    let file = || mesh.display().to_string();
    ui.weak(example.map_or_else(file, |example| example.name().to_owned()));
    let up = ask.view.camera.stance.up();
    let mut pressed = false;
    ask.edit(|project| {
        rows(ui, "Model", |ui| part(ui, project, up));
        if from_file {
            rows(ui, "Taking the mesh in", |ui| {
                pressed = taking_in(ui, project, bodies, again);
            });
        }
    });
    if pressed {
        ask.act(FileAction::TakeInAgain);
    }
    ask.button(ui, Command::Advise);
    advice_lines(ask, ui);
}

fn supports_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let part = Arc::clone(&ask.session.document.part);
    let stance = ask.view.camera.stance;
    // A slice at the lower end: a start that holds something on any part.
    let start = || stance.lower_end(&part, 0.05);
    ask.edit(|project| {
        rows(ui, "Material", |ui| material(ui, project));
        rows(ui, "Supports", |ui| supports(ui, project, start));
    });
    let paint = ui
        .button("Paint a support")
        .on_hover_text("Another support, on the vertices that you paint next");
    if paint.clicked() {
        ask.act(Change::AddPaintedSupport);
        ask.view.layer = Layer::Support;
        ask.view.take(Tool::Paint);
    }
}

fn evaluation_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let part = Arc::clone(&ask.session.document.part);
    let stance = ask.view.camera.stance;
    let start = || boxes::keys(&OrientedBox::around(&part, stance));
    ask.edit(|project| {
        let evaluation = &mut project.evaluation;
        rows(ui, "Judge", |ui| {
            choice(
                ui,
                "Estimator",
                &mut evaluation.estimator,
                &EstimatorKind::ALL,
                EstimatorKind::title,
                "What finds the touches that sets of gauges are judged by; matching (strain only) is what live touch does",
            );
        });
        let regions = &mut evaluation.regions;
        rows(ui, "Regions", |ui| regions_form(ui, regions, start));
    });
}

/// What was found of the walls, in words.
fn advice_lines(ask: &Ask<'_>, ui: &mut Ui) {
    let Some(advice) = ask.session.advice() else {
        return;
    };
    for line in &advice.words {
        ui.add(egui::Label::new(line).wrap());
    }
}

/// What a stage is for, in a sentence.
fn purpose(stage: Stage) -> &'static str {
    match stage {
        Stage::Part => "The part that gauges go into",
        Stage::Supports => "What the part is made of and where it is held",
        Stage::Simulation => "How the part deforms under every touch",
        Stage::Feasible => "Where a gauge can physically go",
        Stage::Candidates => "The few places that tell what all others would",
        Stage::Selection => "Which of the candidates get a gauge",
        Stage::Evaluation => "How well touches that nobody trained on are found",
        Stage::Report => "What a workshop needs to build it",
        Stage::Live => "Where and how hard the part is touched, now",
    }
}

/// How the mesh file is taken in; whether it is to be read again.
fn taking_in(ui: &mut Ui, project: &mut Project, bodies: usize, again: bool) -> bool {
    if bodies > 1 {
        count(
            ui,
            "Body",
            &mut project.part.body,
            0..=bodies - 1,
            "Which connected body of the file, 0 being the one with the largest surface",
        );
    }
    number(
        ui,
        "Weld",
        &mut project.part.weld_mm,
        0.0..=1e3,
        0.001,
        " mm",
        "Vertices nearer to each other than this are joined; 0 joins equal ones only",
    );
    number(
        ui,
        "Fill holes",
        &mut project.part.fill_holes_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Holes up to this far across are filled",
    );
    number(
        ui,
        "Straighten",
        &mut project.part.straighten_mm,
        0.0..=1e3,
        0.1,
        " mm",
        "A bent edge that turns a tetrahedron inside out is straightened where its node moves no farther than this",
    );
    if !again {
        return false;
    }
    ui.label("");
    let pressed = ui
        .button("Read the mesh again")
        .on_hover_text(
            "With this body and these repairs. What was painted on other vertices is lost",
        )
        .clicked();
    ui.end_row();
    pressed
}

fn model_name(model: PartModel) -> &'static str {
    match model {
        PartModel::Shell => "Shell",
        PartModel::Solid => "Solid",
    }
}

fn quality(ui: &mut Ui, project: &mut Project) {
    ui.horizontal(|ui| {
        ui.label("Quality");
        for quality in Quality::ALL {
            ui.selectable_value(&mut project.budget.quality, quality, quality.title());
        }
    })
    .response
    .on_hover_text("How much time may be spent for accuracy");
    if !project.budget.limits.are_none() {
        ui.horizontal(|ui| {
            ui.label("Limits of its own hold")
                .on_hover_text("budget.limits in the project's file");
            if ui.button("Lift limits").clicked() {
                project.budget.limits = Limits::default();
            }
        });
    }
    ui.add_space(4.0);
}

fn axis_name(axis: PartAxis) -> &'static str {
    match axis {
        PartAxis::Auto => "By its shape",
        PartAxis::Coordinate(Axis::X) => "x",
        PartAxis::Coordinate(Axis::Y) => "y",
        PartAxis::Coordinate(Axis::Z) => "z",
        PartAxis::Along(_) => "Direction",
    }
}

/// Which way the part stands; `up` is how it does.
fn axis(ui: &mut Ui, axis: &mut PartAxis, up: DVec3) {
    let direction = if let PartAxis::Along(direction) = *axis {
        direction
    } else {
        up.to_array()
    };
    let all = [
        PartAxis::Auto,
        PartAxis::Coordinate(Axis::X),
        PartAxis::Coordinate(Axis::Y),
        PartAxis::Coordinate(Axis::Z),
        PartAxis::Along(direction),
    ];
    choice(
        ui,
        "Axis",
        axis,
        &all,
        axis_name,
        "What is up for the part: views, unrolling and new supports follow it",
    );
    match axis {
        PartAxis::Coordinate(_) => {}
        PartAxis::Auto => {
            ui.label("Found");
            let [x, y, z] = up.to_array();
            ui.label(format!("{x:.2}, {y:.2}, {z:.2}"));
            ui.end_row();
        }
        PartAxis::Along(direction) => {
            ui.label("Direction");
            ui.horizontal(|ui| {
                for (value, name) in direction.iter_mut().zip(["x", "y", "z"]) {
                    ui.add(DragValue::new(value).speed(0.01).max_decimals(4))
                        .accessible_name(format!("Axis, {name}"));
                }
            });
            ui.end_row();
        }
    }
}

fn part(ui: &mut Ui, project: &mut Project, up: DVec3) {
    choice(
        ui,
        "Taken as",
        &mut project.part.model,
        &[PartModel::Shell, PartModel::Solid],
        model_name,
        "Shell: the mesh is the middle of a wall. Solid: the mesh encloses a part with walls",
    );
    if project.part.model == PartModel::Shell {
        number(
            ui,
            "Thickness",
            &mut project.part.thickness_mm,
            1e-4..=1e4,
            0.01,
            " mm",
            "Of the shell; the mesh is its mid-surface",
        );
    }
    axis(ui, &mut project.part.axis, up);
}

fn material(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "Young's modulus",
        &mut project.material.youngs_modulus_gpa,
        1e-6..=1e4,
        0.01,
        " GPa",
        "Printed nylon: 1.7 GPa",
    );
    number(
        ui,
        "Poisson's ratio",
        &mut project.material.poissons_ratio,
        -0.99..=0.499,
        0.005,
        "",
        "Printed nylon: 0.35",
    );
}

/// The supports, with a new one beginning as the box that `start` gives.
fn supports(ui: &mut Ui, project: &mut Project, start: impl FnOnce() -> OrientedBox) {
    let mut removed = None;
    for (k, support) in project.supports.iter_mut().enumerate() {
        let number = k + 1;
        let kinds = [
            SupportKind::Clamped,
            SupportKind::Pinned,
            SupportKind::Symmetry,
        ];
        let label = format!("Support {number}");
        choice(
            ui,
            &label,
            &mut support.kind,
            &kinds,
            kind_name,
            "Clamped: no displacement, no rotation. Pinned: no displacement. Symmetry: a mirror plane",
        );
        if let Some(name) = &support.vertices {
            ui.label("Vertices");
            ui.label(name);
            ui.end_row();
        }
        if let Some(held) = &mut support.box_mm {
            let names = names_along(ui, support.box_axis);
            corners(ui, &format!("Support {number}"), names, held);
        }
        ui.label("");
        if ui
            .button("Remove")
            .accessible_name(format!("Remove support {number}"))
            .clicked()
        {
            removed = Some(k);
        }
        ui.end_row();
    }
    if let Some(k) = removed {
        project.supports.remove(k);
    }
    if ui
        .button("Add support")
        .on_hover_text("Everything inside a box is held")
        .clicked()
    {
        /// What lies on the box's faces is meant (m).
        const ROOM: f64 = 1e-5;
        let held = start().grown(ROOM);
        project.supports.push(SupportKeys::clamping(&held));
    }
    ui.end_row();
}

/// The regions that errors are quoted for, with a new one beginning as the box that `start` gives.
fn regions_form(
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

/// What the edges of a box lie along: the file's axes, or with an axis of its own its front, right and up, which is
/// said over it.
fn names_along(ui: &mut Ui, box_axis: Option<[f64; 3]>) -> [&'static str; 3] {
    let Some(axis) = box_axis else {
        return ["x", "y", "z"];
    };
    ui.label("along");
    let [x, y, z] = axis.map(|x| format!("{x:.3}"));
    ui.label("front, right, up").on_hover_text(format!(
        "The box stands along [{x}, {y}, {z}], as the part did when it was made"
    ));
    ui.end_row();
    ["front", "right", "up"]
}

/// Two opposite corners of a box (mm).
fn corners(ui: &mut Ui, of: &str, names: [&str; 3], corners: &mut BoxMm) {
    for (end, corner) in ["from", "to"].into_iter().zip(corners) {
        ui.label(format!("{end} (mm)"));
        ui.horizontal(|ui| {
            for (axis, value) in names.into_iter().zip(corner) {
                // As far as a project may name places: what is typed may be no number at all.
                let number = DragValue::new(value).range(-FARTHEST..=FARTHEST);
                let number = number.clamp_existing_to_range(false);
                ui.add(number.speed(0.1).max_decimals(2))
                    .accessible_name(format!("{of} {end} {axis}"));
            }
        });
        ui.end_row();
    }
}

fn kind_name(kind: SupportKind) -> &'static str {
    match kind {
        SupportKind::Clamped => "Clamped",
        SupportKind::Pinned => "Pinned",
        SupportKind::Symmetry => "Symmetry",
    }
}

fn touch(ui: &mut Ui, project: &mut Project) {
    let solid = project.part.model == PartModel::Solid;
    let touch = &mut project.touch;
    number(
        ui,
        "Force",
        &mut touch.force_n,
        1e-9..=1e9,
        0.1,
        " N",
        "Pressed along the inward normal",
    );
    let [lightest, hardest] = &mut touch.forces_n;
    let (least, most) = (*lightest, *hardest);
    number(
        ui,
        "Lightest touch",
        lightest,
        *FORCES.start()..=most,
        0.1,
        " N",
        "How hard touches come: from here to the hardest, evenly over the logarithm",
    );
    number(
        ui,
        "Hardest touch",
        hardest,
        least..=*FORCES.end(),
        0.1,
        " N",
        "How hard touches come: from the lightest to here, evenly over the logarithm",
    );
    number(
        ui,
        "Tip radius",
        &mut touch.tip_radius_mm,
        1e-3..=1e3,
        0.1,
        " mm",
        "The tip spreads the force smoothly over this radius",
    );
    number(
        ui,
        "Tip radius off",
        &mut touch.tip_tolerance_mm,
        TIP_OFF,
        0.01,
        " mm",
        "How much larger or smaller tips are that touch (standard deviation)",
    );
    count(
        ui,
        "Touches",
        &mut touch.count,
        TOUCHES,
        "Simulated touches; lower qualities take fewer",
    );
    number(
        ui,
        "Edge margin",
        &mut touch.edge_margin_mm,
        0.0..=1e3,
        0.1,
        " mm",
        "Least distance of a touch from a free edge",
    );
    if solid {
        number(
            ui,
            "Fingertip",
            &mut touch.reach_mm,
            0.0..=1e3,
            0.5,
            " mm",
            "Radius of the ball that comes from outside: touches lie only where it gets to, not on what stands behind windows it does not fit through. The field “Faces” shows where",
        );
    }
}

fn sites(ui: &mut Ui, project: &mut Project) {
    let gauge = &mut project.gauge;
    choice(
        ui,
        "Signal",
        &mut gauge.signal,
        &Signal::ALL,
        signal_name,
        "What a site reports: strain is what a gauge measures, displacement what the paper used",
    );
    if gauge.signal == Signal::Strain {
        count(
            ui,
            "Directions",
            &mut gauge.directions,
            1..=4,
            "That a gauge may have at one place: 1 along the largest strain, 2 also across it",
        );
    } else {
        gauge.directions = 1;
    }
    number(
        ui,
        "Site spacing",
        &mut project.sites.spacing_mm,
        0.01..=1e4,
        0.05,
        " mm",
        "Of the possible gauge positions on the inside",
    );
    let name = |l| match l {
        Lattice::Even => "Even",
        Lattice::Unrolled => "Rows and columns",
    };
    choice(
        ui,
        "Lattice",
        &mut project.sites.lattice,
        &[Lattice::Even, Lattice::Unrolled],
        name,
        "Even suits any surface; rows and columns suit tubes",
    );
    let mut seed = project.budget.seed as usize;
    let before = seed;
    count(
        ui,
        "Seed",
        &mut seed,
        0..=usize::MAX >> 12,
        "Of every random draw: the same seed gives the same design",
    );
    if seed != before {
        project.budget.seed = seed as u64;
    }
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

fn signal_name(signal: Signal) -> &'static str {
    match signal {
        Signal::Displacement => "Displacement",
        Signal::NormalDisplacement => "Normal displacement",
        Signal::Strain => "Strain",
    }
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
        .on_hover_text("Let the other selectors choose too: four curves of errors instead of one, for the time that they take")
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
