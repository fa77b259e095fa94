//! Speed against accuracy: what was measured of this project, and what that predicts.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::jobs::{Task, duration, stop};
use super::state::Session;
use super::state::trade::MeasuredOn;
use crate::budget::{Progress, Quality};
use crate::design::{Finest, Inputs};
use crate::io::trade_file::{TradeJudge, TradeRecord};
use crate::io::{ProcessMeter, atomic};
use crate::job::{Reporter, Stop};
use crate::project::Project;
use crate::trade::{Knob, Measured, Sweep, TradePoint, TradeSetting, clock, measure, standards};

/// The trade of the bundled limb, measured where this program was made.
const BUNDLED: &str = include_str!("../../assets/trade/trade.json");

impl Session {
    /// Keeps measured trades in a folder from now on.
    pub fn keep_trades_in(&mut self, home: &Path) {
        self.desk.trades = Some(home.to_owned());
        self.caches.trade.inputs = None;
    }

    /// Looks up what was measured of the project, when it has become another.
    pub(super) fn refresh_trade(&mut self) {
        self.take_ended();
        let inputs = self.document.trade_inputs();
        if self.caches.trade.inputs.as_ref() == Some(&inputs) {
            return;
        }
        let snapshot = self.document.inputs();
        let home = self.desk.trades.as_deref();
        let kept = home.and_then(|home| kept(home, &snapshot));
        let bundled = || {
            TradeRecord::parse(BUNDLED)
                .ok()
                .filter(|r| r.is_of(&snapshot))
        };
        let trade = &mut self.caches.trade;
        trade.inputs = Some(inputs);
        trade.promise = None;
        trade.record = kept
            .map(|record| (Arc::new(record), MeasuredOn::Here))
            .or_else(|| bundled().map(|record| (Arc::new(record), MeasuredOn::Elsewhere)));
    }

    /// Takes in what a measurement had when it was ended.
    fn take_ended(&mut self) {
        if self.jobs.runs(Task::Trade) {
            return;
        }
        let coming = self.caches.trade.coming.lock();
        let ended = coming.ok().and_then(|mut coming| coming.take());
        if let Some(record) = ended
            && record.is_of(&self.document.inputs())
        {
            self.caches.trade.record = Some((Arc::new(record), MeasuredOn::Here));
        }
    }

    /// What was measured of the project as it is, at a quality.
    pub(super) fn measured_at(&self, quality: Quality) -> Option<&Measured> {
        let project = &self.document.state.project;
        let (record, _) = self.caches.trade.record.as_ref()?;
        let limits = project.budget.limits_at(quality);
        let is_it = |p: &&TradePoint| p.setting.is_at(project, quality, &limits);
        record.points.iter().find(is_it)?.measured()
    }

    /// Predicted seconds by the clock and mean error (mm) of a quality on this machine.
    #[must_use]
    pub fn predicted(&self, quality: Quality) -> Option<(f64, f64)> {
        let m = self.measured_at(quality)?;
        Some((m.cpu_seconds * self.trade_clock(), m.error_mm))
    }

    /// Whether what is being measured is of the project as it is.
    fn measures_this(&self) -> bool {
        let inputs = self.caches.trade.inputs.as_ref();
        inputs.is_some_and(|inputs| self.jobs.runs_on(Task::Trade, inputs))
    }

    /// Whether what is known was measured with the bundled limb, where this program was made.
    pub(super) fn is_from_elsewhere(&self) -> bool {
        matches!(self.caches.trade.record, Some((_, MeasuredOn::Elsewhere)))
    }

    /// Seconds by the clock here a processor second where it was measured.
    #[must_use]
    pub fn trade_clock(&self) -> f64 {
        let pace = if self.is_from_elsewhere() && !self.measures_this() {
            self.desk.pace
        } else {
            1.0
        };
        clock(&self.measured_points()) * pace
    }

    /// What is measured, what is being measured included.
    #[must_use]
    pub fn measured_points(&self) -> Vec<TradePoint> {
        let trade = &self.caches.trade;
        let running = self.measures_this();
        let coming = trade.coming.lock().ok().filter(|_| running);
        let coming = coming.and_then(|c| Some(c.as_ref()?.points.clone()));
        match (coming, &trade.record) {
            (Some(coming), _) => coming,
            (None, Some((record, _))) => record.points.clone(),
            (None, None) => Vec::new(),
        }
    }

    /// How much was measured, and where.
    #[must_use]
    pub fn trade_in_words(&self) -> String {
        match &self.caches.trade.record {
            _ if self.jobs.runs(Task::Trade) => "Being measured".to_owned(),
            Some((r, MeasuredOn::Here)) => {
                format!("{} settings measured on this machine", r.points.len())
            }
            Some((r, MeasuredOn::Elsewhere)) => format!(
                "{} settings, measured where this program was made",
                r.points.len()
            ),
            None => "Not measured".to_owned(),
        }
    }

    /// What is foreseen of a quality.
    #[must_use]
    pub fn prediction_in_words(&self, quality: Quality) -> String {
        let name = quality.title();
        let Some((seconds, mm)) = self.predicted(quality) else {
            return format!("{name}: not measured yet");
        };
        let one = if self.document.state.project.selection.compare {
            " for one selector"
        } else {
            ""
        };
        let place = if self.is_from_elsewhere() && self.desk.pace == 1.0 {
            " (measured elsewhere)"
        } else {
            ""
        };
        let time = duration(seconds as f32);
        format!("{name}: {mm:.2} mm in about {time}{one}{place}")
    }

    /// Measures the trade of the project in the background until so many settings are known, going on from what is known
    /// of it.
    pub fn measure_trade(&mut self, count: usize) {
        if self.jobs.runs(Task::Trade) {
            return;
        }
        self.refresh_trade();
        let snapshot = self.document.inputs();
        let threads = rayon::current_num_threads();
        let here = self.caches.trade.record.as_ref();
        let here = here.filter(|r| r.1 == MeasuredOn::Here && r.0.is_of(&snapshot));
        let record = here.map_or_else(|| TradeRecord::new(&snapshot, threads), |r| (*r.0).clone());
        let coming = Arc::<Mutex<Option<TradeRecord>>>::default();
        self.caches.trade.coming = Arc::clone(&coming);
        let home = self.desk.trades.clone();
        let work = move |r: &Reporter| sweep(&snapshot, record, count, home.as_deref(), &coming, r);
        let inputs = self.document.trade_inputs();
        self.jobs
            .start(Task::Trade, inputs, work, |s, inputs, record| {
                if s.caches.trade.inputs.as_ref() == Some(&inputs) {
                    s.desk.pace = 1.0;
                    s.caches.trade.record = Some((Arc::new(record), MeasuredOn::Here));
                }
            });
    }
}

/// What an earlier run has kept of these inputs.
fn kept(home: &Path, inputs: &Inputs) -> Option<TradeRecord> {
    let text = std::fs::read_to_string(file(home, inputs)).ok()?;
    let record = TradeRecord::parse(&text).ok()?;
    let threads = rayon::current_num_threads();
    (record.is_of(inputs) && record.threads == threads).then_some(record)
}

fn file(home: &Path, inputs: &Inputs) -> PathBuf {
    home.join(format!(
        "{}.json",
        crate::io::trade_file::inputs_key(inputs)
    ))
}

/// Qualities that are measured by their names: at Standard regressions alone would take a quarter of an hour.
fn qualities(project: &Project) -> Vec<Quality> {
    if TradeSetting::centre(project).uses(Knob::Folds) {
        vec![Quality::Draft]
    } else {
        standards()
    }
}

/// Measures until so many points are known. What there is when it is ended is kept on disk and in `coming`.
fn sweep(
    inputs: &Inputs,
    mut record: TradeRecord,
    count: usize,
    home: Option<&Path>,
    coming: &Mutex<Option<TradeRecord>>,
    r: &Reporter,
) -> Result<TradeRecord, Stop> {
    let show = |record: &TradeRecord| {
        if let Ok(mut coming) = coming.lock() {
            *coming = Some(record.clone());
        }
    };
    let walk = Sweep::new(&inputs.project, qualities(&inputs.project));
    let left = |record: &TradeRecord| count.saturating_sub(record.points.len());
    if walk.next(&record.points, left(&record)).is_none() {
        return Err(Stop::Failed(format!(
            "all {} settings are measured already. Ask for more of them",
            record.points.len()
        )));
    }
    let laying = |p: Progress| {
        r.report(Progress {
            stage: "Laying the judge's elements",
            ..p
        })
    };
    let judge = Finest::new(inputs, &laying).map_err(|e| stop(&e))?;
    record.judge = TradeJudge {
        element_mm: judge.element_mm(),
        unknowns: judge.unknowns(),
        touches: judge.touches(),
    };
    let meter = ProcessMeter::default();
    while let Some(setting) = walk.next(&record.points, left(&record)) {
        let done = record.points.len();
        let watch = |_: Progress| {
            r.report(Progress {
                stage: "Measuring settings",
                done,
                total: count.max(done + 1),
            })
        };
        let point = measure(inputs, &setting, &judge, &meter, &watch).map_err(|e| stop(&e))?;
        record.points.push(point);
        show(&record);
        if let Some(home) = home {
            // What is measured is kept for the next time; where that cannot be, it is still shown.
            let _ = std::fs::create_dir_all(home);
            let _ = atomic::write(&file(home, inputs), record.to_json().as_bytes());
        }
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_is_measured_where_no_regression_is_trained() {
        let mut project = Project::around("a.stl", None);
        assert_eq!(qualities(&project), standards());
        project.evaluation.estimator = crate::evaluation::EstimatorKind::Svr;
        assert_eq!(qualities(&project), [Quality::Draft]);
    }
}
