//! The report's figures where sets were judged by regression, and the paper's comparison among them.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::words::judged_on;
use crate::design::Design;
use crate::evaluation::{Chooser, EstimatorKind};
use crate::io::svg::escape;
use crate::placement::SelectorKind;
use crate::regression::Hyper;

/// Numbers of gauges that the paper compares.
const SIZES: [usize; 2] = [5, 10];

/// What the paper compares: its four selectors, each set read by a regression of its own. Nothing where other ones were
/// asked for.
pub(super) fn comparison(page: &mut String, design: &Design) {
    let by_regression = design.evaluation.judging.estimator() == EstimatorKind::Svr;
    let chose = |kind: &SelectorKind| design.selections.iter().any(|s| s.selector == *kind);
    if !by_regression || !SelectorKind::PAPER.iter().all(chose) {
        return;
    }
    let rows = &design.evaluation.rows;
    let sizes: BTreeSet<usize> = (SIZES.into_iter())
        .filter(|size| rows.iter().any(|r| r.set.sensors == *size))
        .chain([design.chosen().len()])
        .collect();
    page.push_str("<h2>The paper's comparison</h2><p>Four selectors, each set read by a support vector regression that was trained for it. Mean, median and 95 % of the error (mm) on unseen touches.</p><table><tr><th>Selector</th><th>Region</th>");
    for size in &sizes {
        let _ = write!(page, "<th>{size} gauges</th>");
    }
    page.push_str("</tr>");
    let mut regions: Vec<&str> = Vec::new();
    for row in rows {
        if !regions.contains(&row.region.as_str()) {
            regions.push(&row.region);
        }
    }
    for region in regions {
        for kind in SelectorKind::PAPER {
            let of = |size: &usize| errors_of(design, kind, *size, region);
            let cells: String = sizes.iter().map(of).collect();
            let (title, region) = (escape(kind.title()), escape(region));
            let _ = write!(page, "<tr><td>{title}</td><td>{region}</td>{cells}</tr>");
        }
    }
    page.push_str("</table>");
}

/// The cell of a selector's set of so many gauges in a region.
fn errors_of(design: &Design, kind: SelectorKind, size: usize, region: &str) -> String {
    let mut rows = design.evaluation.of(Chooser::from(kind).set(size));
    let row = rows.find(|r| r.region == region);
    let figures = row.map_or("–".into(), |r| {
        format!("{:.2} / {:.2} / {:.2}", r.error_mm, r.median_mm, r.p95_mm)
    });
    format!("<td>{figures}</td>")
}

/// How sets were judged, and every figure.
pub(super) fn errors(page: &mut String, design: &Design) {
    let _ = write!(
        page,
        "<p>Trained on {} touches of the model ({:.2} mm elements); judged on {} touches that no selection or training has seen, {}. “As built”: every gauge {}, read with the regression trained for the ideal one.</p><details><summary>Every figure</summary><table><tr><th>Selector</th><th>Gauges</th><th>Region</th><th>Mean (mm)</th><th>Median (mm)</th><th>95 % (mm)</th><th>As built (mm)</th><th>Touches</th><th>C (mm)</th><th>ε (mm)</th><th>γ</th></tr>",
        design.simulated.dataset.touches.len(),
        design.simulated.element_mm,
        design.reference.touches.len(),
        judged_on(design),
        design.reference.off.gluing.in_words()
    );
    for r in &design.evaluation.rows {
        let [c, epsilon, gamma] = settings_of(r.hyper);
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{c}</td><td>{epsilon}</td><td>{gamma}</td></tr>",
            escape(r.set.chooser.title()),
            r.set.sensors,
            escape(&r.region),
            r.error_mm,
            r.median_mm,
            r.p95_mm,
            r.workshop_mm,
            r.touches
        );
    }
    page.push_str("</table></details>");
}

/// C, ε and γ of a regression.
fn settings_of(hyper: Option<Hyper>) -> [String; 3] {
    hyper.map_or_else(
        || ["–"; 3].map(Into::into),
        |h| {
            [
                h.c.to_string(),
                h.epsilon.to_string(),
                format!("{:.3}", h.gamma),
            ]
        },
    )
}
