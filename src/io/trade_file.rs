//! A measured trade as files: JSON to go on from, a table, and a plot.

mod plot;

use std::fmt::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::fingerprint::Fingerprint;
use super::table::Writing;
use super::together::Together;
use super::{FileError, atomic, source};
use crate::dataset::Signal;
use crate::design::Inputs;
use crate::placement::SelectorKind;
use crate::plain;
use crate::project::{BudgetKeys, LiveKeys, Project};
use crate::trade::{
    Bought, Knob, KnobReport, Measured, Spent, TradePoint, TradeSetting, front, knobs,
};

/// Everything that was measured of one project on one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TradeRecord {
    pub format: u32,
    /// Of the program: its figures are not those of another.
    pub version: String,
    /// What the points hold for ([`inputs_key`]).
    pub inputs: String,
    pub threads: usize,
    pub judge: TradeJudge,
    pub points: Vec<TradePoint>,
}

/// The model that all points were judged by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TradeJudge {
    pub element_mm: f64,
    pub unknowns: usize,
    pub touches: usize,
}

/// 2: settings say which estimator they are judged by, and what expected error looks at.
const FORMAT: u32 = 2;

impl TradeRecord {
    /// Nothing measured yet.
    #[must_use]
    pub fn new(inputs: &Inputs, threads: usize) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            inputs: inputs_key(inputs),
            threads,
            judge: TradeJudge::default(),
            points: Vec::new(),
        }
    }

    /// Whether its points hold for a project as it is.
    #[must_use]
    pub fn is_of(&self, inputs: &Inputs) -> bool {
        self.version == env!("CARGO_PKG_VERSION") && self.inputs == inputs_key(inputs)
    }

    /// From what [`TradeRecord::to_json`] wrote.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        #[derive(Deserialize)]
        #[serde(expecting = "a measured trade")]
        struct Head {
            format: u32,
        }
        // First: a record of another format need not have the rest.
        let Head { format } = serde_json::from_str(text).map_err(|e| plain::json(&e))?;
        if format != FORMAT {
            return Err(format!(
                "it is of format {format}, this version reads {FORMAT}"
            ));
        }
        serde_json::from_str(text).map_err(|e| plain::json(&e))
    }

    /// What goes into `trade.json`.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// A project with its knobs at one place and without what no figure depends on.
#[must_use]
pub fn without_knobs(project: &Project) -> Project {
    let largest_force_n = project.live.largest_force_n;
    let mut project = Project {
        budget: BudgetKeys {
            seed: project.budget.seed,
            ..BudgetKeys::default()
        },
        live: LiveKeys {
            largest_force_n,
            ..LiveKeys::default()
        },
        kept: Vec::new(),
        ..project.clone()
    };
    project.part.mesh.clear();
    project.selection.sites.clear();
    project.selection.selector = SelectorKind::default();
    project.selection.compare = false;
    project.gauge.signal = Signal::default();
    project.candidates.unexplained = 0.5;
    project
}

/// What a point's figures depend on beside its setting, as a key: the part to the last bit, and every key of the
/// project that is no knob and not at its default: a key that a later version adds leaves what was measured standing.
#[must_use]
pub fn inputs_key(inputs: &Inputs) -> String {
    let value = |project: &Project| serde_json::to_value(without_knobs(project)).ok();
    let said = value(&inputs.project);
    let defaults = value(&Project::around("", None)).unwrap_or_default();
    let said = said.and_then(|said| beside_defaults(said, &defaults));
    let mut key = Fingerprint::default();
    key.add(said.unwrap_or_default().to_string().bytes());
    key.add_part(inputs);
    key.hex()
}

/// What of a value is not as in `defaults`; nothing where all of it is. Lists are one whole.
fn beside_defaults(value: Value, defaults: &Value) -> Option<Value> {
    if value == *defaults {
        return None;
    }
    let Value::Object(table) = value else {
        return Some(value);
    };
    let others = table.into_iter().filter_map(|(name, value)| {
        let value = beside_defaults(value, defaults.get(&name).unwrap_or(&Value::Null))?;
        Some((name, value))
    });
    Some(Value::Object(others.collect()))
}

/// Reads what [`write()`] left in a folder; nothing where there is nothing.
///
/// # Errors
/// [`FileError`] for a file that is there and is no trade.
pub fn read(folder: &Path) -> Result<Option<TradeRecord>, FileError> {
    let path = folder.join("trade.json");
    let text = match source::read_text(&path) {
        Ok(text) => text,
        Err(FileError::Missing { .. }) => return Ok(None),
        Err(error) => return Err(error),
    };
    let broken = |m| {
        FileError::broken(
            &path,
            format!("this is no measured trade ({m}). Choose another folder"),
        )
    };
    TradeRecord::parse(&text).map(Some).map_err(broken)
}

/// Puts `trade.json`, `trade.csv`, `trade.md` and `trade.svg` into a folder, all of one record.
///
/// # Errors
/// [`FileError`] naming what could not be written.
pub fn write(place: &Together, project: &Project, record: &TradeRecord) -> Result<(), FileError> {
    let files = [
        ("trade.json", record.to_json()),
        ("trade.csv", csv(project, record)),
        ("trade.md", markdown(project, record)),
        ("trade.svg", plot::plot(project, &record.points)),
    ];
    place.replace(|new| {
        (files.iter()).try_for_each(|(name, text)| atomic::write(&new.join(name), text.as_bytes()))
    })
}

/// A row a point: what it cost and achieved, and its setting. What nothing uses at a setting is left empty.
#[must_use]
pub fn csv(project: &Project, record: &TradeRecord) -> String {
    let best = front(project, &record.points);
    let columns = ["on_front"].into_iter().chain(FIGURES).chain(KEYS);
    let mut table = Writing::new(columns.chain(["failed"]));
    for point in &record.points {
        let on_front = best.iter().any(|p| std::ptr::eq(*p, point));
        let figures = point.measured().map_or_else(Default::default, figures);
        let failed = point.outcome.as_ref().err().cloned().unwrap_or_default();
        let setting = keys(&point.setting);
        let cells = std::iter::once(on_front.to_string()).chain(figures);
        table.row(cells.chain(setting).chain([failed]));
    }
    table.text()
}

const FIGURES: [&str; 11] = [
    "cpu_seconds",
    "seconds",
    "memory_mb",
    "error_mm",
    "median_mm",
    "p95_mm",
    "workshop_mm",
    "own_error_mm",
    "model_percent",
    "candidates",
    "judge_cpu_seconds",
];

fn figures(m: &Measured) -> [String; FIGURES.len()] {
    let memory = m.memory_mb.map(|mb| format!("{mb:.0}"));
    [
        format!("{:.2}", m.cpu_seconds),
        format!("{:.2}", m.seconds),
        memory.unwrap_or_default(),
        format!("{:.4}", m.error_mm),
        format!("{:.4}", m.median_mm),
        format!("{:.4}", m.p95_mm),
        format!("{:.4}", m.workshop_mm),
        format!("{:.4}", m.own_error_mm),
        format!("{:.3}", m.model_percent),
        m.candidates.to_string(),
        format!("{:.2}", m.judge_cpu_seconds),
    ]
}

const KEYS: [&str; 17] = [
    "quality",
    "repeat",
    "selector",
    "signal",
    "estimator",
    "unexplained",
    "vertices",
    "touches",
    "point_tip",
    "as_solid",
    "expected_places",
    "expected_presses",
    "selection_touches",
    "selection_candidates",
    "svr_tolerance_mm",
    "folds",
    "tuning_touches",
];

fn keys(s: &TradeSetting) -> [String; KEYS.len()] {
    let unexplained = s.uses(Knob::Unexplained).then(|| s.unexplained.to_string());
    let limit = |knob: Knob, value: fn(&Spent) -> String| match &s.limits {
        Some(spent) if s.uses(knob) => value(spent),
        _ => String::new(),
    };
    [
        s.quality.name().to_owned(),
        s.repeat.to_string(),
        s.selector.name().to_owned(),
        s.signal.name().to_owned(),
        s.estimator.name().to_owned(),
        unexplained.unwrap_or_default(),
        limit(Knob::Vertices, |l| l.vertices.to_string()),
        limit(Knob::Touches, |l| l.touches.to_string()),
        limit(Knob::PointTip, |l| l.point_tip.to_string()),
        limit(Knob::AsSolid, |l| l.as_solid.to_string()),
        limit(Knob::ExpectedPlaces, |l| l.expected_places.to_string()),
        limit(Knob::ExpectedPresses, |l| l.expected_presses.to_string()),
        limit(Knob::SelectionTouches, |l| l.selection_touches.to_string()),
        limit(Knob::SelectionCandidates, |l| {
            l.selection_candidates.to_string()
        }),
        limit(Knob::SvrTolerance, |l| l.svr_tolerance_mm.to_string()),
        limit(Knob::Folds, |l| l.folds.to_string()),
        limit(Knob::TuningTouches, |l| l.tuning_touches.to_string()),
    ]
}

/// The front and the knobs as tables to read.
#[must_use]
pub fn markdown(project: &Project, record: &TradeRecord) -> String {
    let count = record
        .points
        .iter()
        .filter(|p| p.measured().is_some())
        .count();
    let judge = &record.judge;
    let by = match project.judging().middle_n() {
        Some(force_n) => format!(
            "by model matching on {} touches of {force_n} N",
            judge.touches
        ),
        None => format!("by regression on {} touches", judge.touches),
    };
    let mut text = format!(
        "{count} settings of {} gauges on {}, judged {by} that none has seen, on elements of {:.2} mm ({} unknowns). CPU time is that of the whole pipeline with the chosen selector alone, up to the judged answer.\n\n| CPU time (s) | wall time | memory | mean error | median | settings |\n|---|---|---|---|---|---|\n",
        project.selection.sensors,
        project.gauge.signal.name(),
        judge.element_mm,
        judge.unknowns,
    );
    let best = front(project, &record.points);
    let named = (record.points.iter())
        .filter(|p| p.setting.limits.is_none() && !best.iter().any(|b| std::ptr::eq(*b, *p)));
    for point in thinned(&best).into_iter().chain(named) {
        let Some(m) = point.measured() else { continue };
        let memory = m
            .memory_mb
            .map_or_else(|| "–".into(), |mb| format!("{mb:.0} MB"));
        let _ = writeln!(
            text,
            "| {:.1} | {:.1} s | {memory} | {:.2} mm | {:.2} mm | {} |",
            m.cpu_seconds,
            m.seconds,
            m.error_mm,
            m.median_mm,
            point.setting.in_words()
        );
    }
    let (reports, spread) = knobs(&record.points);
    let _ = writeln!(
        text,
        "\nWhat one step of each knob brings (medians over pairs of settings that differ in it alone; the mean error with its standard error). With another seed and nothing else the mean error moves by {spread:.0} %.\n\n| knob | pairs | CPU time | mean error | median error | buys |\n|---|---|---|---|---|---|"
    );
    for r in &reports {
        let _ = writeln!(
            text,
            "| {} | {} | {:+.0} % | {:+.0} ± {:.0} % | {:+.0} % | {} |",
            r.knob.name(),
            r.pairs,
            r.cpu_percent,
            r.error_percent,
            r.scatter_percent,
            r.median_percent,
            bought(r)
        );
    }
    text
}

/// Those points of a front that are better than the last one kept by a figure that is worth a row.
fn thinned<'a>(front: &[&'a TradePoint]) -> Vec<&'a TradePoint> {
    const WORTH: f64 = 0.05;
    let mut kept: Vec<&TradePoint> = Vec::new();
    let mut last = f64::INFINITY;
    for (k, point) in front.iter().enumerate() {
        let error = point.measured().map_or(f64::INFINITY, |m| m.error_mm);
        if error < (1.0 - WORTH) * last || k + 1 == front.len() {
            kept.push(point);
            last = error;
        }
    }
    kept
}

fn bought(report: &KnobReport) -> &'static str {
    match report.bought {
        Bought::Accuracy => "accuracy",
        Bought::Unclear => "too little to tell",
        Bought::Nothing => "nothing",
        Bought::Idle => "nothing, and costs nothing",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_of_another_format_is_named_as_that() {
        let old = r#"{ "format": 1, "points": [{ "setting": { "estimator": "regression" } }] }"#;
        let said = TradeRecord::parse(old).unwrap_err();
        assert_eq!(said, "it is of format 1, this version reads 2");
    }

    #[test]
    fn what_is_quoted_of_a_record_stays_within_its_marks() {
        let said = TradeRecord::parse(r#"  "fo\\\"rm\u0007 of old""#).unwrap_err();
        let quoted = "“fo\\\\\\\"rm\\u{7} of old”";
        assert_eq!(
            said,
            format!("invalid type: string {quoted}, expected a measured trade at line 1 column 25")
        );
    }

    #[test]
    fn a_key_at_its_default_is_none() {
        let defaults = serde_json::json!({ "a": 1, "b": { "c": 2, "d": [3, 4] }, "e": null });
        let said = serde_json::json!({ "a": 1, "b": { "c": 2, "d": [3], "new": null }, "e": 5 });
        let kept = serde_json::json!({ "b": { "d": [3] }, "e": 5 });
        assert_eq!(beside_defaults(said, &defaults), Some(kept));
        assert_eq!(beside_defaults(defaults.clone(), &defaults), None);
    }

    #[test]
    fn tables_have_what_a_setting_hears() {
        let project = Project::around("a.stl", None);
        let centre = keys(&TradeSetting::centre(&project));
        let value = |key: &str| {
            let at = KEYS.iter().position(|k| *k == key).unwrap();
            centre[at].as_str()
        };
        assert_eq!(
            (value("estimator"), value("vertices")),
            ("matching", "2400")
        );
        assert_eq!((value("expected_places"), value("folds")), ("320", ""));
        assert_eq!((value("unexplained"), value("tuning_touches")), ("", ""));
    }
}
