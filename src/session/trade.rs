//! Speed against accuracy: what was measured of this project, what it predicts, and whether that came true.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::Session;
use super::drive::stop;
use super::jobs::{Task, duration};
use crate::budget::{Progress, Quality};
use crate::design::{Design, Finest, Inputs};
use crate::document::TradeInputs;
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
#[derive(Default)]
pub struct Trade {
    record: Option<(Arc<Record>, Place)>,
    /// What it was looked up for.
    inputs: Option<TradeInputs>,
    /// What the measurement that is running, or was ended, has so far.
    coming: Arc<Mutex<Option<Record>>>,
    /// How the last prediction came out.
    promise: Option<Promise>,
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

    /// Both figures, predicted and achieved.
    #[must_use]
    pub fn in_words(&self) -> String {
        format!(
            "predicted {:.2} mm in {:.1} s, achieved {:.2} mm in {:.1} s",
            self.predicted_mm, self.predicted_s, self.achieved_mm, self.achieved_s
        )
    }
}

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
        let bundled = || Record::parse(BUNDLED).ok().filter(|r| r.is_of(&snapshot));
        let trade = &mut self.caches.trade;
        trade.inputs = Some(inputs);
        trade.promise = None;
        trade.record = kept
            .map(|record| (Arc::new(record), Place::Here))
            .or_else(|| bundled().map(|record| (Arc::new(record), Place::Elsewhere)));
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
            self.caches.trade.record = Some((Arc::new(record), Place::Here));
        }
    }

    /// What was measured of the project as it is, at a quality.
    fn measured_at(&self, quality: Quality) -> Option<&Measured> {
        let project = &self.document.state.project;
        let (record, _) = self.caches.trade.record.as_ref()?;
        let limits = project.budget.limits_at(quality);
        let is_it = |p: &&Point| p.setting.is_at(project, quality, &limits);
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
    fn is_from_elsewhere(&self) -> bool {
        matches!(self.caches.trade.record, Some((_, Place::Elsewhere)))
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
    pub fn measured_points(&self) -> Vec<Point> {
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
            Some((r, Place::Here)) => {
                format!("{} settings measured on this machine", r.points.len())
            }
            Some((r, Place::Elsewhere)) => format!(
                "{} settings, measured where this program was made",
                r.points.len()
            ),
            None => "Not measured".to_owned(),
        }
    }

    /// How the last prediction came out.
    #[must_use]
    pub fn promise(&self) -> Option<&Promise> {
        self.caches.trade.promise.as_ref()
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

    /// What a finished design was predicted to be, and is; nothing where it was not measured, or was there already.
    fn promise_of(&self, design: &Design, quality: Quality) -> Option<Promise> {
        let compared = self.document.state.project.selection.compare;
        let m = self.measured_at(quality)?;
        let select = format!("select {}", design.lead.name());
        if design.seconds.iter().all(|s| s.stage != select) {
            // What was there already took no time.
            return None;
        }
        let again = (self.results.simulation.as_ref()).is_some_and(|s| s.value.again);
        let (mut predicted_s, mut achieved_s) = (0.0, 0.0);
        for stage in &m.stages {
            // Where others were compared, more was evaluated than was measured.
            let more = compared && stage.stage == "evaluate";
            // Of what was there already, or was only read again, the time says nothing.
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
        // As much of the whole as these stages took when it was measured.
        let share = predicted_s / m.seconds;
        Some(Promise {
            quality,
            predicted_s: share * m.cpu_seconds * self.trade_clock(),
            achieved_s,
            predicted_mm: m.own_error_mm,
            achieved_mm: design.chosen_row().map_or(f64::NAN, |r| r.error_mm),
        })
    }

    /// Holds a finished design against what was predicted of it.
    pub(super) fn hold_to_promise(&mut self, design: &Design, quality: Quality) {
        self.caches.trade.promise = None;
        let Some(promise) = self.promise_of(design, quality) else {
            return;
        };
        let elsewhere = self.is_from_elsewhere();
        // Of another machine's times nothing was promised here before the first run.
        if promise.is_broken() && !(elsewhere && self.desk.pace == 1.0) {
            self.tell(format!(
                "The prediction was off by more than a factor of two: {}. Other work may run on this machine; “Measure the trade” measures it anew",
                promise.in_words()
            ));
        }
        if elsewhere && promise.predicted_s > 0.0 {
            self.desk.pace *= promise.achieved_s / promise.predicted_s;
        }
        self.caches.trade.promise = Some(promise);
    }

    /// What is shown is no longer what was predicted last.
    pub(super) fn forget_promise(&mut self) {
        self.caches.trade.promise = None;
    }

    /// Predicted beside achieved, of the design that is shown.
    #[must_use]
    pub fn promise_line(&self) -> Option<String> {
        let quality = self.results.design.as_ref()?.value.quality;
        let promise = self.promise()?;
        (promise.quality == quality).then(|| promise.in_words())
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
        let here = here.filter(|r| r.1 == Place::Here && r.0.is_of(&snapshot));
        let record = here.map_or_else(|| Record::new(&snapshot, threads), |r| (*r.0).clone());
        let coming = Arc::<Mutex<Option<Record>>>::default();
        self.caches.trade.coming = Arc::clone(&coming);
        let home = self.desk.trades.clone();
        let work = move |r: &Reporter| sweep(&snapshot, record, count, home.as_deref(), &coming, r);
        let inputs = self.document.trade_inputs();
        self.jobs
            .start(Task::Trade, inputs, work, |s, inputs, record| {
                if s.caches.trade.inputs.as_ref() == Some(&inputs) {
                    s.desk.pace = 1.0;
                    s.caches.trade.record = Some((Arc::new(record), Place::Here));
                }
            });
    }

    /// Sets the project to a measured setting; what is kept computed follows.
    pub fn apply_setting(&mut self, setting: &Setting) {
        setting.apply(&mut self.document.state.project);
        self.document.settle();
    }

    /// Turns the dial: the setting of the front that keeps the promise, at once.
    pub fn ask_for(&mut self, asked: Asked) {
        let points = self.measured_points();
        match self.answer_to(asked, &points) {
            Ok((setting, said)) => {
                self.tell(said);
                self.apply_setting(&setting);
                self.select();
            }
            Err(why_not) => self.complain(why_not),
        }
    }

    fn answer_to(&self, asked: Asked, points: &[Point]) -> Result<(Setting, String), String> {
        if points.is_empty() {
            return Err(
                "Nothing is measured of this project yet. Press “Measure the trade” first".into(),
            );
        }
        let best = front(&self.document.state.project, points);
        let clock = self.trade_clock();
        if let Some((point, m)) = answer(&best, asked, clock).and_then(|p| Some((p, p.measured()?)))
        {
            let said = format!(
                "Set to {:.2} mm in about {:.1} s: {}",
                m.error_mm,
                m.cpu_seconds * clock,
                point.setting.in_words()
            );
            return Ok((point.setting, said));
        }
        let quickest = best.first().and_then(|p| p.measured());
        Err(quickest.map_or_else(
            || "No setting that was measured could be computed. Measure more of them".to_owned(),
            |m| {
                format!(
                    "No measured setting answers as quickly: the quickest took {:.1} s. Ask for more time, or measure more settings",
                    m.cpu_seconds * clock
                )
            },
        ))
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
    if Setting::centre(project).uses(Knob::Folds) {
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
