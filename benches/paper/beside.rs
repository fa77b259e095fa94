//! The paper's figures, and what is found here beside them.

use std::fmt::Write as _;

use hapdef::evaluation::{Chooser, Evaluation, MatchedRow};
use hapdef::placement::SelectorKind;

use crate::displaced::{Judged, baseline, row, with_failed};
use crate::matched::SELECTOR;
use crate::{FEW, LOST, MANY, cell};

/// The force (N) that strain is compared at.
const FORCE_N: f64 = 10.0;

/// One figure (mm).
struct Line {
    what: String,
    paper: &'static str,
    here: Option<f64>,
    aim: Option<f64>,
}

impl Line {
    fn write(&self, text: &mut String) {
        let aim = match (self.aim, self.here) {
            (Some(aim), Some(here)) if here <= aim => format!("{aim}: met"),
            (Some(aim), _) => format!("{aim}: missed"),
            (None, _) => "–".into(),
        };
        let here = cell(self.here);
        let _ = writeln!(text, "| {} | {} | {here} | {aim} |", self.what, self.paper);
    }
}

pub fn write(text: &mut String, displaced: &Judged, matched: &Evaluation) {
    text.push_str("Mean errors in mm. The paper's are of its own model's data, with settings tuned for all candidates; that of 2019 is of real gauges and a network that has learned 27 000 touches.\n\n| what | paper | here | aim |\n|---|---|---|---|\n");
    let own = by_regression(&displaced.on_own_model, "own data");
    let finer = by_regression(&displaced.evaluation, "finer model");
    let strain = by_matching(matched);
    for line in own.iter().chain(&finer).chain(&strain) {
        line.write(text);
    }
    text.push('\n');
}

/// As judged on some data.
fn by_regression(found: &Evaluation, on: &str) -> Vec<Line> {
    const GREEDY: SelectorKind = SelectorKind::GreedySvr;
    let error = |gauges: usize| row(found, GREEDY, gauges).map(|r| r.error_mm);
    let all = baseline(found);
    vec![
        Line {
            what: format!("displacement, greedy SVR, {FEW} gauges, {on}"),
            paper: "below 10",
            here: error(FEW),
            aim: Some(3.0),
        },
        Line {
            what: format!("displacement, greedy SVR, {MANY} gauges, {on}"),
            paper: "about 2.5",
            here: error(MANY),
            aim: Some(1.0),
        },
        Line {
            what: format!("the same, more where {LOST} of {MANY} have failed, trained anew"),
            paper: "about 5",
            here: more_by_loss(found, GREEDY, true),
            aim: None,
        },
        Line {
            what: format!(
                "displacement, all candidates ({}; the paper: 407), {on}",
                all.map_or(0, |r| r.set.sensors)
            ),
            paper: "0.6",
            here: all.map(|r| r.error_mm),
            aim: None,
        },
    ]
}

fn by_matching(found: &Evaluation) -> Vec<Line> {
    let rows = |gauges: usize| found.by_force(Chooser::from(SELECTOR).set(gauges));
    let at = |gauges: usize, of: fn(&MatchedRow) -> Option<f64>| {
        rows(gauges).find(|r| r.force_n == FORCE_N).and_then(of)
    };
    let said = |gauges: usize, how: &str| {
        format!("strain, expected error, matching, {gauges} gauges, {FORCE_N} N, {how}")
    };
    vec![
        Line {
            what: said(FEW, "as designed"),
            paper: "–",
            here: at(FEW, |r| Some(r.error_mm)),
            aim: None,
        },
        Line {
            what: said(MANY, "as designed"),
            paper: "–",
            here: at(MANY, |r| Some(r.error_mm)),
            aim: Some(1.0),
        },
        Line {
            what: said(MANY, "as built"),
            paper: "5 (2019)",
            here: at(MANY, |r| Some(r.as_built_mm)),
            aim: None,
        },
        Line {
            what: said(MANY, "as built and calibrated"),
            paper: "5 (2019)",
            here: at(MANY, |r| r.calibrated_mm),
            aim: None,
        },
        Line {
            what: format!("the same as designed, more where {LOST} of {MANY} are lost"),
            paper: "about 5",
            here: more_by_loss(found, SELECTOR, false),
            aim: None,
        },
    ]
}

/// What lost gauges add to the mean error of a selector's ten (mm).
fn more_by_loss(found: &Evaluation, kind: SelectorKind, retrained: bool) -> Option<f64> {
    let mean = |failed: usize| with_failed(found, kind, failed, retrained).map(|(mean, _)| mean);
    Some(mean(LOST)? - mean(0)?)
}
