//! Speed against accuracy: what was measured of this project, what it predicts, and whether that came true.

mod tab;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use egui::Context;

use super::drive::{Finished, stop};
use super::jobs::{Shared, Task, duration};
use super::{Studio, quality_name};
use crate::budget::{Progress, Quality};
use crate::design::{Design, Finest, Inputs};
use crate::io::ProcessMeter;
use crate::io::atomic;
use crate::io::trade_file::{Judge, Record};
use crate::job::{Reporter, Stop};
use crate::project::Project;
use crate::trade::{
    Asked, Knob, Measured, Point, Setting, Sweep, answer, clock, front, measure, standards,
};

/// The trade of the bundled limb, measured where this program was made.
const BUNDLED: &str = include_str!("../../assets/trade/trade.json");
/// Beyond this factor a prediction was wrong.
const WRONG: f64 = 2.0;

/// A stage that took less (s) was known already.
const KNOWN_S: f64 = 1e-4;

/// Where a trade was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Here,
    /// With the bundled limb.
    Elsewhere,
}

/// What is known of the open project.
pub(super) struct Trade {
    record: Option<(Arc<Record>, Place)>,
    /// What it was looked up for.
    key: String,
    /// Where trades are kept between runs.
    home: Option<PathBuf>,
    /// What the measurement that is running, or was ended, has so far.
    coming: Shared<Option<Record>>,
    /// How much longer things take here than where the trade was measured.
    pace: f64,
    /// The dial.
    asked_s: f64,
    asked_mm: f64,
    /// Settings to have measured in the end.
    count: usize,
    /// How the last prediction came out.
    promise: Option<Promise>,
}

impl Default for Trade {
    fn default() -> Self {
        Self {
            record: None,
            key: String::new(),
            home: None,
            coming: Arc::default(),
            pace: 1.0,
            asked_s: 10.0,
            asked_mm: 1.0,
            count: 40,
            promise: None,
        }
    }
}

impl Trade {
    /// As it is for another project: where trades are kept, how quick this machine is, and what was asked for.
    pub fn for_another_part(self) -> Self {
        Self {
            home: self.home,
            pace: self.pace,
            asked_s: self.asked_s,
            asked_mm: self.asked_mm,
            count: self.count,
            ..Self::default()
        }
    }
}

/// What was predicted of a run, and what it achieved.
#[derive(Clone, Debug, PartialEq)]
pub struct Promise {
    pub quality: Quality,
    /// By the clock, of the stages that ran anew and were measured.
    pub predicted_s: f64,
    pub achieved_s: f64,
    /// Mean errors (mm) as a design states its own.
    pub predicted_mm: f64,
    pub achieved_mm: f64,
}

impl Promise {
    /// Whether either was off by more than a factor of two.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        let off = |a: f64, b: f64| (a / b).ln().abs() > WRONG.ln();
        off(self.achieved_s, self.predicted_s) || off(self.achieved_mm, self.predicted_mm)
    }

    fn in_words(&self) -> String {
        format!(
            "predicted {:.2} mm in {:.1} s, achieved {:.2} mm in {:.1} s",
            self.predicted_mm, self.predicted_s, self.achieved_mm, self.achieved_s
        )
    }
}

impl Studio {
    /// Keeps measured trades in a folder from now on.
    pub fn keep_trades_in(&mut self, home: &Path) {
        self.trade.home = Some(home.to_owned());
        self.trade.key.clear();
    }

    /// Looks up what was measured of the project, when it has become another.
    pub(super) fn refresh_trade(&mut self, ctx: &Context) {
        self.take_ended();
        let key = self.document.trade_key();
        if key == self.trade.key || ctx.input(|i| i.pointer.any_down()) {
            return;
        }
        self.trade.key = key;
        self.trade.promise = None;
        let inputs = self.document.inputs();
        let kept = self
            .trade
            .home
            .as_deref()
            .and_then(|home| kept(home, &inputs));
        let bundled = || Record::parse(BUNDLED).ok().filter(|r| r.is_of(&inputs));
        self.trade.record = kept
            .map(|record| (Arc::new(record), Place::Here))
            .or_else(|| bundled().map(|record| (Arc::new(record), Place::Elsewhere)));
    }

    /// Takes in what a measurement had when it was ended.
    fn take_ended(&mut self) {
        if self.jobs.runs(Task::Trade) {
            return;
        }
        let ended = self
            .trade
            .coming
            .lock()
            .ok()
            .and_then(|mut coming| coming.take());
        if let Some(record) = ended
            && record.is_of(&self.document.inputs())
        {
            self.trade.record = Some((Arc::new(record), Place::Here));
        }
    }

    /// What was measured of the project as it is, at a quality.
    fn measured_at(&self, quality: Quality) -> Option<&Measured> {
        let budget = &self.document.state.project.budget;
        let (record, _) = self.trade.record.as_ref()?;
        let limits = budget.limits_at(quality);
        let is_it = |p: &&Point| {
            p.setting
                .is_at(&self.document.state.project, quality, &limits)
        };
        record.points.iter().find(is_it)?.measured()
    }

    /// Predicted seconds by the clock and mean error (mm) of a quality on this machine.
    #[must_use]
    pub fn predicted(&self, quality: Quality) -> Option<(f64, f64)> {
        let m = self.measured_at(quality)?;
        Some((m.cpu_seconds * self.clock(), m.error_mm))
    }

    /// Whether what is being measured is of the project as it is.
    fn measures_this(&self) -> bool {
        let mut running = self.jobs.running.iter();
        running.any(|r| r.task == Task::Trade && r.job.key == self.trade.key)
    }

    /// Seconds by the clock here a processor second where it was measured.
    fn clock(&self) -> f64 {
        let pace = match self.trade.record {
            Some((_, Place::Elsewhere)) if !self.measures_this() => self.trade.pace,
            _ => 1.0,
        };
        clock(&self.points()) * pace
    }

    /// How the last prediction came out.
    #[must_use]
    pub fn promise(&self) -> Option<&Promise> {
        self.trade.promise.as_ref()
    }

    /// What the quality control says of a quality.
    pub(super) fn prediction_in_words(&self, quality: Quality) -> String {
        let one = if self.document.state.project.selection.compare {
            " for one selector"
        } else {
            ""
        };
        match self.predicted(quality) {
            Some((seconds, mm)) => {
                let elsewhere = matches!(self.trade.record, Some((_, Place::Elsewhere)));
                let place = if elsewhere && self.trade.pace == 1.0 {
                    " (measured elsewhere)"
                } else {
                    ""
                };
                let name = quality_name(quality);
                let time = duration(seconds as f32);
                format!("{name}: {mm:.2} mm in about {time}{one}{place}")
            }
            None => format!("{}: not measured yet", quality_name(quality)),
        }
    }

    /// Holds a finished design against what was predicted of it.
    pub(super) fn hold_to_promise(&mut self, design: &Design, quality: Quality) {
        let compared = self.document.state.project.selection.compare;
        let Some(m) = self.measured_at(quality) else {
            self.trade.promise = None;
            return;
        };
        let (mut predicted_s, mut achieved_s) = (0.0, 0.0);
        for stage in &m.stages {
            // Where others were compared, more was evaluated than was measured.
            let more = compared && stage.stage == "evaluate";
            // Of what was there already, or was only read again, the time says nothing.
            let again = self.simulation.as_ref().is_some_and(|s| s.again);
            let more = more || (again && stage.stage == "simulate");
            let ran = design
                .seconds
                .iter()
                .find(|s| s.stage == stage.stage && s.seconds > KNOWN_S);
            if let Some(ran) = ran.filter(|_| !more) {
                predicted_s += stage.seconds;
                achieved_s += ran.seconds;
            }
        }
        let select = format!("select {}", design.lead.name());
        if design.seconds.iter().all(|s| s.stage != select) {
            // What was there already took no time.
            self.trade.promise = None;
            return;
        }
        // As much of the whole as these stages took when it was measured.
        let share = predicted_s / m.seconds;
        let predicted_s = share * m.cpu_seconds * self.clock();
        let promise = Promise {
            quality,
            predicted_s,
            achieved_s,
            predicted_mm: m.own_error_mm,
            achieved_mm: design.chosen_row().map_or(f64::NAN, |r| r.error_mm),
        };
        let elsewhere = matches!(self.trade.record, Some((_, Place::Elsewhere)));
        // Of another machine's times nothing was promised here before the first run.
        if promise.is_broken() && !(elsewhere && self.trade.pace == 1.0) {
            self.tell(format!(
                "The prediction was off by more than a factor of two: {}. Other work may run on this machine; “Measure the trade” measures it anew",
                promise.in_words()
            ));
        }
        if elsewhere && predicted_s > 0.0 {
            self.trade.pace *= achieved_s / predicted_s;
        }
        self.trade.promise = Some(promise);
    }

    /// What is shown is no longer what was predicted last.
    pub(super) fn forget_promise(&mut self) {
        self.trade.promise = None;
    }

    /// The line of the evaluation: predicted beside achieved.
    pub(super) fn promise_line(&self) -> Option<String> {
        let quality = self.design.as_ref()?.quality;
        let promise = self.trade.promise.as_ref()?;
        (promise.quality == quality).then(|| promise.in_words())
    }

    /// Measures the trade of the project in the background, going on from what is known of it.
    pub fn measure_trade(&mut self, ctx: &Context) {
        self.results = super::results::Tab::Trade;
        if self.jobs.runs(Task::Trade) {
            return;
        }
        self.refresh_trade(ctx);
        let inputs = self.document.inputs();
        let threads = rayon::current_num_threads();
        let here = self.trade.record.as_ref();
        let here = here.filter(|r| r.1 == Place::Here && r.0.is_of(&inputs));
        let record = here.map_or_else(|| Record::new(&inputs, threads), |r| (*r.0).clone());
        let coming = Shared::<Option<Record>>::default();
        self.trade.coming = Arc::clone(&coming);
        let (count, home) = (self.trade.count, self.trade.home.clone());
        let key = self.trade.key.clone();
        self.jobs.start(ctx, Task::Trade, key, move |r| {
            sweep(&inputs, record, count, home.as_deref(), &coming, r)
                .map(|record| Finished::Traded(Box::new(record)))
        });
    }

    /// Takes in a finished measurement, and of one that was ended what it had.
    pub(super) fn take_trade(&mut self, record: Record, key: &str) {
        if key == self.trade.key {
            self.trade.pace = 1.0;
            self.trade.record = Some((Arc::new(record), Place::Here));
        }
    }

    /// Sets the project to a measured setting; what is kept computed follows.
    pub fn apply_setting(&mut self, setting: &Setting) {
        setting.apply(&mut self.document.state.project);
        self.document.settle();
    }

    /// Turns the dial: the setting of the front that keeps the promise, at once.
    pub fn ask_for(&mut self, ctx: &Context, asked: Asked) {
        let points = self.points();
        if points.is_empty() {
            return self.complain(
                "Nothing is measured of this project yet. Press “Measure the trade” first",
            );
        }
        let best = front(&self.document.state.project, &points);
        let clock = self.clock();
        let Some((point, m)) = answer(&best, asked, clock).and_then(|p| Some((p, p.measured()?)))
        else {
            let quickest = best.first().and_then(|p| p.measured());
            return self.complain(quickest.map_or_else(
                || "No setting that was measured could be computed. Measure more of them".to_owned(),
                |m| {
                    format!(
                        "No measured setting answers as quickly: the quickest took {:.1} s. Ask for more time, or measure more settings",
                        m.cpu_seconds * clock
                    )
                },
            ));
        };
        self.tell(format!(
            "Set to {:.2} mm in about {:.1} s: {}",
            m.error_mm,
            m.cpu_seconds * clock,
            point.setting.in_words()
        ));
        self.apply_setting(&point.setting);
        self.select(ctx);
    }
}

/// What an earlier run has kept of these inputs.
fn kept(home: &Path, inputs: &Inputs) -> Option<Record> {
    let text = std::fs::read_to_string(file(home, inputs)).ok()?;
    let record = Record::parse(&text).ok()?;
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
    if Setting::centre(project).hears(Knob::Folds) {
        vec![Quality::Draft]
    } else {
        standards()
    }
}

/// Measures until so many points are known. What there is when it is ended is kept on disk and in `coming`.
fn sweep(
    inputs: &Inputs,
    mut record: Record,
    count: usize,
    home: Option<&Path>,
    coming: &Mutex<Option<Record>>,
    r: &Reporter,
) -> Result<Record, Stop> {
    let show = |record: &Record| {
        if let Ok(mut coming) = coming.lock() {
            *coming = Some(record.clone());
        }
    };
    let walk = Sweep::new(&inputs.project, qualities(&inputs.project));
    let left = |record: &Record| count.saturating_sub(record.points.len());
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
    record.judge = Judge {
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

    #[test]
    fn a_prediction_off_by_more_than_two_is_broken() {
        let kept = Promise {
            quality: Quality::Draft,
            predicted_s: 10.0,
            achieved_s: 19.0,
            predicted_mm: 4.0,
            achieved_mm: 2.1,
        };
        assert!(!kept.is_broken());
        let slow = Promise {
            achieved_s: 21.0,
            ..kept.clone()
        };
        let quick = Promise {
            achieved_s: 4.9,
            ..kept.clone()
        };
        let wrong = Promise {
            achieved_mm: 8.1,
            ..kept.clone()
        };
        assert!(slow.is_broken() && quick.is_broken() && wrong.is_broken());
        assert_eq!(
            slow.in_words(),
            "predicted 4.00 mm in 10.0 s, achieved 2.10 mm in 21.0 s"
        );
    }
}
