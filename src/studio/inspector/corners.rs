//! Boxes by their corners, along the axes that they stand by.

use egui::{DragValue, Ui};

use crate::limb::BoxMm;
use crate::project::FARTHEST;

/// What the edges of a box lie along: the file's axes, or with an axis of its own its front, right and up, which is
/// said over it.
pub fn names_along(ui: &mut Ui, box_axis: Option<[f64; 3]>) -> [&'static str; 3] {
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
pub fn corners(ui: &mut Ui, of: &str, names: [&str; 3], corners: &mut BoxMm) {
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
