//! What the chosen gauges do at each force, as drawn, as built and calibrated: the figures of the report.

use egui::{Grid, RichText, ScrollArea, Ui};

use crate::design::{BLIND, Design};
use crate::evaluation::MatchedRow;

/// Titles of the columns, and what each says.
const COLUMNS: [(&str, &str); 6] = [
    ("Force", "How hard the touches were"),
    (
        "As drawn",
        "Mean error of gauges that are where they were drawn",
    ),
    (
        "95 %",
        "Nineteen of twenty touches are found better, as drawn",
    ),
    (
        "As built",
        "Mean error as a workshop glues them, not calibrated",
    ),
    (
        "Calibrated",
        "The same gauges after known presses made by hand",
    ),
    ("Blind", ""),
];

/// Whether there is anything to show: a judge by regression has one force.
pub fn has_forces(design: &Design) -> bool {
    rows(design).next().is_some()
}

fn rows(design: &Design) -> impl Iterator<Item = &MatchedRow> {
    design.evaluation.by_force(design.chosen_id())
}

/// The table, over all touches; of the gauges as they were selected, which is said where they have been moved since.
pub fn force_table(design: &Design, is_moved: bool, ui: &mut Ui) {
    let as_selected = if is_moved { " as selected" } else { "" };
    let count = design.chosen().len();
    let title = format!("{count} gauges{as_selected}, all touches (mm)");
    ui.label(RichText::new(title).strong());
    ScrollArea::both().id_salt("by force").show(ui, |ui| {
        Grid::new("by force")
            .num_columns(COLUMNS.len())
            .striped(true)
            .spacing([10.0, 3.0])
            .show(ui, |ui| {
                for (title, says) in COLUMNS {
                    let says = match says {
                        "" => format!(
                            "Touches that move no gauge by more than {BLIND} times its noise"
                        ),
                        says => says.to_owned(),
                    };
                    ui.strong(title).on_hover_text(says);
                }
                ui.end_row();
                for row in rows(design) {
                    cells(row, ui);
                    ui.end_row();
                }
            });
    });
}

fn cells(row: &MatchedRow, ui: &mut Ui) {
    ui.label(format!("{} N", row.force_n));
    for mm in [
        Some(row.error_mm),
        Some(row.p95_mm),
        Some(row.as_built_mm),
        row.calibrated_mm,
    ] {
        ui.monospace(mm.map_or_else(|| "–".into(), |mm| format!("{mm:.2}")));
    }
    ui.monospace(format!("{:.1} %", 100.0 * row.blind));
}
