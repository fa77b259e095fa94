//! Material, and what the part is held by.

use std::sync::Arc;

use egui::Ui;

use super::super::action::ProjectChange;
use super::super::ask::Ask;
use super::super::form::{choice, number, rows};
use super::super::view::Tool;
use super::corners::{corners, names_along};
use crate::document::Layer;
use crate::mesh::oriented_box::OrientedBox;
use crate::project::{MaterialKeys, Project, SupportKeys, SupportKind};

/// The settings of material and supports.
pub fn supports_form(ask: &mut Ask<'_>, ui: &mut Ui) {
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
        ask.act(ProjectChange::AddPaintedSupport);
        ask.view.layer = Layer::Support;
        ask.view.take(Tool::Paint);
    }
}

fn material(ui: &mut Ui, project: &mut Project) {
    let keys = &mut project.material;
    let modulus = MaterialKeys::youngs_modulus_gpa();
    number(
        ui,
        "Young's modulus",
        &mut keys.youngs_modulus_gpa,
        modulus,
        0.01,
    );
    let ratio = MaterialKeys::poissons_ratio();
    number(
        ui,
        "Poisson's ratio",
        &mut keys.poissons_ratio,
        ratio,
        0.005,
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
            &SupportKeys::kind().sentence(),
        );
        if support.kind != SupportKind::Symmetry {
            bedding(ui, &label, &mut support.bedding_n_per_mm3);
        }
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

/// Whether a support gives way, and how stiff it is then.
fn bedding(ui: &mut Ui, support: &str, bedding: &mut Option<f64>) {
    /// What somebody begins with (N/mm³): hard rubber.
    const START: f64 = 50.0;
    let key = SupportKeys::bedding_n_per_mm3();
    let mut gives = bedding.is_some();
    // Every support has one: its name says which.
    ui.label("Gives way");
    let toggled = ui
        .checkbox(&mut gives, "")
        .on_hover_text(key.sentence())
        .accessible_name(format!("{support} gives way"));
    ui.end_row();
    if toggled.changed() {
        *bedding = gives.then_some(START);
    }
    if let Some(bedding) = bedding {
        number(ui, "Bedding", bedding, key, 1.0);
    }
}

fn kind_name(kind: SupportKind) -> &'static str {
    match kind {
        SupportKind::Clamped => "Clamped",
        SupportKind::Pinned => "Pinned",
        SupportKind::Symmetry => "Symmetry",
    }
}
