//! An estimator that was learned from presses: what it was chosen among, and how far off it is.

use egui::{Grid, Label, RichText, Ui};

use crate::plain;
use crate::session::Learnt;

/// Its figures, on touches that it has not learned from.
pub fn estimator_shown(ui: &mut Ui, learnt: &Learnt) {
    let origin = &learnt.file.header.origin;
    let wrapped = |ui: &mut Ui, text: RichText| {
        ui.add(Label::new(text).wrap());
    };
    let name = learnt.path.file_name().unwrap_or_default();
    let text = format!("Live touch goes by {}", name.to_string_lossy());
    ui.add(Label::new(text).wrap())
        .on_hover_text(learnt.path.display().to_string());
    let text = format!(
        "{}, learned from {}; on presses that nobody has learned from: mean {:.2} mm, median {:.2}, 95 % {:.2}; {:.0} % within their radius (made for 90 %)",
        in_words(origin.estimator.name()),
        plain::either(origin.train_touches, "touch", "touches"),
        origin.test.mean_mm,
        origin.test.median_mm,
        origin.test.p95_mm,
        100.0 * origin.test.coverage
    );
    wrapped(ui, RichText::new(text));
    if !origin.test.by_force.is_empty() {
        by_force(ui, learnt);
    }
    ui.collapsing("Estimators that were tried", |ui| tried(ui, learnt));
}

fn by_force(ui: &mut Ui, learnt: &Learnt) {
    Grid::new("errors by force").striped(true).show(ui, |ui| {
        for head in ["Force", "Touches", "Place", "Force off"] {
            ui.strong(head);
        }
        ui.end_row();
        for row in &learnt.file.header.origin.test.by_force {
            let to = row.to_n.map_or("…".to_owned(), |to| format!("{to}"));
            ui.label(format!("{}–{to} N", row.from_n));
            ui.label(row.touches.to_string());
            ui.label(format!("{:.2} mm", row.mean_mm));
            ui.label((row.force_error_n).map_or("–".to_owned(), |f| format!("{f:.2} N")));
            ui.end_row();
        }
    });
}

fn tried(ui: &mut Ui, learnt: &Learnt) {
    Grid::new("tried estimators").striped(true).show(ui, |ui| {
        for trial in &learnt.file.header.origin.tried {
            ui.label(in_words(trial.estimator.name()));
            ui.label(format!("{:.2} mm", trial.validation_mm));
            ui.end_row();
        }
    });
    ui.weak("Mean error on the presses that they were chosen by");
}

/// For people.
fn in_words(name: &str) -> &str {
    match name {
        "svr" => "Support vectors",
        "nearest" => "Nearest presses",
        "kernel-ridge" => "Kernel ridge",
        "gaussian-process" => "Gaussian process",
        "matching" => "Matching, gauges calibrated",
        "matching-remainder" => "Matching, map corrected",
        other => other,
    }
}
