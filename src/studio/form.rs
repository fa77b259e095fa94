//! Rows of a form: a label, and a control that is known by it.

use std::ops::RangeInclusive;

use egui::{ComboBox, DragValue, Grid, Ui};

use crate::project::Key;

/// A group of rows under a heading.
pub(super) fn rows(ui: &mut Ui, title: &str, content: impl FnOnce(&mut Ui)) {
    ui.add_space(4.0);
    ui.strong(title);
    Grid::new(title)
        .num_columns(2)
        .spacing([10.0, 5.0])
        .min_col_width(96.0)
        .show(ui, content);
    ui.add_space(6.0);
}

/// One row: a label and a number that is a key of the project, which says its unit, its range and what it means.
pub(super) fn number(ui: &mut Ui, label: &str, value: &mut f64, key: &Key, speed: f64) {
    quantity(
        ui,
        label,
        value,
        key.numbers(),
        (speed, key.unit),
        &key.sentence(),
    );
}

/// One row: a label and any number, with what dragging changes it by and its unit.
pub(super) fn quantity(
    ui: &mut Ui,
    label: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    (speed, unit): (f64, &str),
    help: &str,
) {
    let name = ui.label(label);
    ui.add(
        DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(speed)
            .max_decimals(4)
            .suffix(suffix(unit)),
    )
    .labelled_by(name.id)
    .on_hover_text(help);
    ui.end_row();
}

/// A unit as it stands behind a number: with a space, but for degrees.
fn suffix(unit: &str) -> String {
    match unit {
        "" | "°" => unit.to_owned(),
        unit => format!(" {unit}"),
    }
}

/// One row: a label and a share, shown in percent.
pub(super) fn percentage(ui: &mut Ui, label: &str, share: &mut f64, key: &Key) {
    let mut percent = 100.0 * *share;
    let shares = key.numbers();
    let range = 100.0 * shares.start()..=100.0 * shares.end();
    quantity(ui, label, &mut percent, range, (0.05, "%"), &key.sentence());
    // Not every frame: a hundredfold and back is not always the same number.
    if (percent - 100.0 * *share).abs() > 0.0 {
        *share = percent / 100.0;
    }
}

/// One row: a label and a count.
pub(super) fn count(ui: &mut Ui, label: &str, value: &mut usize, key: &Key) {
    counted(ui, label, value, key.counts(), &key.sentence());
}

/// One row: a label and a count in a range of its own.
pub(super) fn counted(
    ui: &mut Ui,
    label: &str,
    value: &mut usize,
    range: RangeInclusive<usize>,
    help: &str,
) {
    let name = ui.label(label);
    ui.add(
        DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(1.0),
    )
    .labelled_by(name.id)
    .on_hover_text(help);
    ui.end_row();
}

/// One row: a label and a tick.
pub(super) fn switch(ui: &mut Ui, label: &str, value: &mut bool, key: &Key) {
    let name = ui.label(label);
    ui.checkbox(value, "")
        .on_hover_text(key.sentence())
        .labelled_by(name.id)
        .accessible_name(label);
    ui.end_row();
}

/// One row: a label and a choice.
pub(super) fn choice<T: PartialEq + Copy>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    all: &[T],
    name: impl Fn(T) -> &'static str,
    help: &str,
) {
    ui.label(label);
    ComboBox::new(label, "")
        .selected_text(name(*value))
        .width(120.0)
        .show_ui(ui, |ui| {
            for &option in all {
                ui.selectable_value(value, option, name(option));
            }
        })
        .response
        .accessible_name(label)
        .on_hover_text(help);
    ui.end_row();
}
