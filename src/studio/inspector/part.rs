//! The part: its model, how it stands, and how its mesh is taken in.

use egui::{DragValue, Ui};
use glam::DVec3;

use super::super::action::FileAction;
use super::super::ask::Ask;
use super::super::commands::UiCommand;
use super::super::form::{choice, counted, number, rows};
use crate::io::examples::Example;
use crate::mesh::unroll::Axis;
use crate::project::{Part, PartAxis, PartModel, Project};

/// The settings of the part.
pub fn part_form(ask: &mut Ask<'_>, ui: &mut Ui) {
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
    ask.button(ui, UiCommand::Advise);
    advice_lines(ask, ui);
}

/// How the mesh file is taken in; whether it is to be read again.
fn taking_in(ui: &mut Ui, project: &mut Project, bodies: usize, again: bool) -> bool {
    if bodies > 1 {
        counted(
            ui,
            "Body",
            &mut project.part.body,
            0..=bodies - 1,
            &Part::body().sentence(),
        );
    }
    number(
        ui,
        "Weld",
        &mut project.part.weld_mm,
        Part::weld_mm(),
        0.001,
    );
    number(
        ui,
        "Fill holes",
        &mut project.part.fill_holes_mm,
        Part::fill_holes_mm(),
        0.1,
    );
    number(
        ui,
        "Straighten",
        &mut project.part.straighten_mm,
        Part::straighten_mm(),
        0.1,
    );
    number(
        ui,
        "Halve edges",
        &mut project.part.halve_mm,
        Part::halve_mm(),
        0.1,
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

fn part(ui: &mut Ui, project: &mut Project, up: DVec3) {
    choice(
        ui,
        "Taken as",
        &mut project.part.model,
        &[PartModel::Shell, PartModel::Solid],
        model_name,
        &Part::model().sentence(),
    );
    if project.part.model == PartModel::Shell {
        number(
            ui,
            "Thickness",
            &mut project.part.thickness_mm,
            Part::thickness_mm(),
            0.01,
        );
    }
    axis(ui, &mut project.part.axis, up);
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
    choice(ui, "Axis", axis, &all, axis_name, &Part::axis().sentence());
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

fn axis_name(axis: PartAxis) -> &'static str {
    match axis {
        PartAxis::Auto => "By its shape",
        PartAxis::Coordinate(Axis::X) => "x",
        PartAxis::Coordinate(Axis::Y) => "y",
        PartAxis::Coordinate(Axis::Z) => "z",
        PartAxis::Along(_) => "Direction",
    }
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
