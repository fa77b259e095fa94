//! The report's figures where sets were judged by model matching: by force, and every one of them.

use std::fmt::Write as _;

use super::words::judged_on;
use crate::design::{BLIND, Design, PressReadings};
use crate::evaluation::MatchedRow;
use crate::io::svg::escape;

/// A figure that may not have been asked for (mm).
fn cell(mm: Option<f64>) -> String {
    mm.map_or("–".into(), |mm| format!("{mm:.2}"))
}

/// What the chosen gauges do at every force, over all touches.
pub(super) fn by_force(page: &mut String, design: &Design) {
    let mut rows = design.evaluation.by_force(design.chosen_id()).peekable();
    if rows.peek().is_none() {
        return;
    }
    page.push_str("<table><tr><th>Touches of</th><th>Mean error (mm)</th><th>Median (mm)</th><th>95 % (mm)</th><th>As built (mm)</th><th>Calibrated (mm)</th><th>Blind</th><th>Mean without blind (mm)</th></tr>");
    for r in rows {
        let _ = write!(page, "<tr><td>{} N</td>{}</tr>", r.force_n, figures(r));
    }
    page.push_str("</table>");
}

/// The cells of all figures of a row.
fn figures(r: &MatchedRow) -> String {
    format!(
        "<td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{:.1} %</td><td>{}</td>",
        r.error_mm,
        r.median_mm,
        r.p95_mm,
        r.as_built_mm,
        cell(r.calibrated_mm),
        100.0 * r.blind,
        cell(r.sighted_mm)
    )
}

/// How sets were judged, and every figure.
pub(super) fn errors(page: &mut String, design: &Design) {
    let reference = &design.reference;
    let workshops = reference.pressed.iter().flat_map(PressReadings::of_each);
    let presses: Vec<usize> = workshops.map(|of_one| of_one.len()).collect();
    let known = presses.first().copied().unwrap_or_default();
    let turns = match presses.len() {
        0 | 1 => String::new(),
        many => format!("; gauges of {many} workshops take turns over the touches"),
    };
    let _ = write!(
        page,
        "<p>Each reading is matched with the model ({:.2} mm elements), which needs no training; judged on {} touches that no selection has seen, {}. “As built”: every gauge {}, of which the model knows no more than that{turns}. “Calibrated”: the same gauges after {known} known presses, each made by hand {}. “Blind”: touches that move no gauge by more than {BLIND} times its noise.</p>",
        design.simulated.element_mm,
        reference.touches.len(),
        judged_on(design),
        reference.off.gluing.in_words(),
        reference.off.pressing.in_words()
    );
    page.push_str("<details><summary>Every figure</summary><table><tr><th>Selector</th><th>Gauges</th><th>Force (N)</th><th>Region</th><th>Touches</th><th>Mean (mm)</th><th>Median (mm)</th><th>95 % (mm)</th><th>As built (mm)</th><th>Calibrated (mm)</th><th>Blind</th><th>Mean without blind (mm)</th></tr>");
    for r in &design.evaluation.matched {
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{}</tr>",
            escape(r.set.chooser.title()),
            r.set.sensors,
            r.force_n,
            escape(&r.region),
            r.touches,
            figures(r)
        );
    }
    page.push_str("</table></details>");
}
