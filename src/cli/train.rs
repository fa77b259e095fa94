//! `hapdef train`: an estimator of place and force from measured touches alone, as a file.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::common::{Common, QualityArg};
use super::data::{DataArgs, KeptTogether};
use super::listen::sensing_for;
use super::out;
use super::progress::Bar;
use super::ranges::whole;
use super::spared::Spared;
use super::train_update;
use crate::design::{
    Learned, PressLessons, Sensing, TeachingError, TrainingOutcome, TrialMethods, train_all,
};
use crate::io::project_file::LoadedProject;
use crate::io::{bench_folder, cpu_seconds, touch_file};
use crate::learning::score::ForceRow;
use crate::learning::{ByModel, Family, MeasuredTouches, Method, Scores, TrainingRequest};
use crate::plain;
use crate::regression::Grouping;
use crate::study::{self, Data};
use crate::uncertainty::HandPressing;

/// What turns readings into places.
#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MethodArg {
    /// The one that does best on touches that it has not learned from.
    #[default]
    Auto,
    /// ε-support-vector regression, as in the paper.
    Svr,
    /// The mean of the nearest known touches.
    Nearest,
    /// Kernel ridge regression.
    KernelRidge,
    /// A Gaussian process with a length a channel.
    GaussianProcess,
    /// Matching with the model of `--project`, whose gauges the presses calibrate.
    Matching,
    /// That, and what the presses show the model to be off by beside it, smooth over the surface.
    MatchingRemainder,
}

impl MethodArg {
    /// The one that is meant; nothing where all are tried.
    fn method(self) -> Option<Method> {
        Some(match self {
            Self::Auto => return None,
            Self::Svr => Family::Svr.into(),
            Self::Nearest => Family::Nearest.into(),
            Self::KernelRidge => Family::KernelRidge.into(),
            Self::GaussianProcess => Family::GaussianProcess.into(),
            Self::Matching => Method::Model(ByModel::Matching),
            Self::MatchingRemainder => Method::Model(ByModel::MatchingRemainder),
        })
    }
}

#[derive(Args, Debug, Clone)]
pub struct TrainArgs {
    #[command(flatten)]
    pub data: DataArgs,
    /// The estimator (.hapdtouch).
    #[arg(long)]
    pub out: PathBuf,
    /// Bring this estimator (.hapdtouch) up to date by a few new presses, instead of learning anew: gain and rest of each
    /// channel are fitted, as far as presses that are left out say that it helps.
    #[arg(long, conflicts_with_all = ["estimator", "train_touches"])]
    pub update: Option<PathBuf>,
    /// What turns readings into places.
    #[arg(long, value_enum, default_value_t)]
    pub estimator: MethodArg,
    /// The project whose part was pressed, with its gauges: matching with its model is tried too. The bundled limb where no
    /// file is named.
    #[arg(long, value_name = "PROJECT", num_args = 0..=1, conflicts_with = "update")]
    pub project: Option<Option<PathBuf>>,
    /// How much to spend on the model: draft, standard or reference.
    #[arg(long, requires = "project")]
    pub quality: Option<QualityArg>,
    /// The presses were made by hand: each is beside its place, and harder or lighter, by what the project says of a hand.
    #[arg(long, requires = "project")]
    pub by_hand: bool,
    /// Touches to learn from, drawn by the seed: a point of a learning curve. Eight tenths of the places when left out.
    #[arg(long, value_parser = whole(10, 1_000_000))]
    pub train_touches: Option<usize>,
    /// Touches that are never divided between learning and judging: `place` (repeats of one place), `none` (each
    /// touch by itself), the name of an array of whole numbers in the NPZ, one a touch, or a CSV with a column
    /// `group` and a row a touch. An array `groups` in the NPZ is taken by itself.
    #[arg(long, value_name = "place|none|ARRAY|CSV")]
    pub groups: Option<String>,
    /// Seed of the places that are learned from, chosen by and judged on.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Worker threads; all cores when left out. The result does not depend on it.
    #[arg(long, value_parser = super::common::threads)]
    pub threads: Option<usize>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &TrainArgs) -> anyhow::Result<()> {
    Spared::of_data(&args.data.data, args.data.touches.as_deref())
        .and(
            "the estimator that is brought up to date",
            args.update.as_deref(),
        )
        .check_result("--out", Some(&args.out))?;
    let (data, mut notes) = args.data.load()?;
    let (groups, note) = args.groups(&data)?;
    if let Some(note) = &note {
        out::say(&format!("note: {note}"));
    }
    notes.extend(note);
    if let Some(old) = &args.update {
        let asked = train_update::UpdateRequest {
            old,
            out: &args.out,
            seed: args.seed,
            json: args.json,
            fingerprint: touch_file::fingerprint(&data),
        };
        return in_pool(args.threads, || {
            train_update::run(&asked, &args.data, (&data, &groups), &notes)
        });
    }
    let before = cpu_seconds();
    let lessons = MeasuredTouches {
        x: &data.x,
        places_mm: &data.targets,
        forces: &data.forces,
        groups: &groups,
    };
    let (trained, limb) = trained(args, &lessons)?;
    let cpu = cpu_seconds() - before;
    for note in &trained.notes {
        out::say(&format!("note: {note}"));
    }
    notes.extend(trained.notes.iter().cloned());
    let name = args.data.data.file_name().unwrap_or_default();
    let origin = touch_file::TrainingOrigin {
        limb: limb.or(bench_folder::key_in(&args.data.data, bench_folder::LIMB)?),
        board: bench_folder::key_in(&args.data.data, bench_folder::BOARD)?,
        ..touch_file::TrainingOrigin::of(&trained, &data, &name.to_string_lossy(), args.seed)
    };
    touch_file::write(&args.out, origin, &trained.estimator)?;
    if args.json {
        return out::line(&json_of(&trained, &notes, cpu).to_string());
    }
    print(&trained, cpu)
}

/// What was learned, and the key of the limb where there is a model of it.
fn trained(
    args: &TrainArgs,
    lessons: &MeasuredTouches,
) -> anyhow::Result<(TrainingOutcome, Option<String>)> {
    let method = args.estimator.method();
    let asked = TrainingRequest {
        family: match method {
            Some(Method::Regression(family)) => Some(family),
            _ => None,
        },
        seed: args.seed,
        train_touches: args.train_touches,
    };
    let ways = match method {
        None => ByModel::ALL.to_vec(),
        Some(Method::Model(way)) => vec![way],
        Some(Method::Regression(_)) => Vec::new(),
    };
    let by_model = matches!(method, Some(Method::Model(_)));
    let part = args.part(&ways, by_model)?;
    let bar = Bar::default();
    let watch = |p| bar.show(p);
    let mut notes = Vec::new();
    let trained = in_pool(args.threads, || {
        let presses = (part.as_ref()).map(|part| part.presses(lessons, args.by_hand));
        let presses = match presses.transpose() {
            Ok(presses) => presses,
            // Where the model was asked for by name, nothing else will do.
            Err(why) if by_model => return args.data.named(Err(why)),
            Err(why) => {
                notes.push(format!("Matching is not tried: {why}."));
                None
            }
        };
        let candidates = TrialMethods {
            regressions: !by_model,
            model: presses.as_ref().map(|presses| (presses, &ways[..])),
        };
        let trained = args
            .data
            .named(train_all(lessons, &asked, &candidates, &watch))?;
        Ok((trained, presses.is_some()))
    });
    bar.finish();
    let (mut trained, pressed) = trained?;
    trained.notes.extend(notes);
    // Of presses that are not on the part nobody knows which limb they are of.
    let part = part.filter(|_| pressed);
    Ok((trained, part.map(|part| part.limb)))
}

/// The part that was pressed, with its model.
struct TrainedPart {
    loaded: LoadedProject,
    sensing: Sensing,
    /// Its key.
    limb: String,
}

impl TrainedPart {
    fn presses<'a>(
        &'a self,
        lessons: &MeasuredTouches,
        by_hand: bool,
    ) -> Result<PressLessons<'a>, TeachingError> {
        let project = &self.loaded.inputs.project;
        let pressing = if by_hand {
            project.uncertainty().pressing
        } else {
            HandPressing::EXACT
        };
        PressLessons::new(&self.sensing, project, lessons, pressing)
    }
}

/// Runs `work` on as many threads as were asked for.
pub(super) fn in_pool<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> anyhow::Result<T> + Send,
) -> anyhow::Result<T> {
    Common {
        threads,
        ..Common::default()
    }
    .in_pool(work)
}

impl TrainArgs {
    /// The group of each touch, and a word where touches are taken for repeats of a place that are none to the digit.
    fn groups(&self, data: &Data) -> anyhow::Result<(Vec<usize>, Option<String>)> {
        let kept = (self.data).kept(self.groups.as_deref(), false, data.targets.len())?;
        Ok(match kept {
            KeptTogether::Usual => {
                let words = study::clump_words(&data.targets);
                let note = words.map(|words| format!("{words} (--groups none divides them)."));
                (Grouping::Place.of(&data.targets), note)
            }
            KeptTogether::Touch => (Grouping::Touch.of(&data.targets), None),
            KeptTogether::Given(groups) => (groups.of_touches, None),
        })
    }

    /// The part of the project, where one is named and asked for.
    fn part(&self, ways: &[ByModel], needed: bool) -> anyhow::Result<Option<TrainedPart>> {
        if ways.is_empty() {
            return Ok(None);
        }
        let Some(project) = &self.project else {
            anyhow::ensure!(
                !needed,
                "matching needs a model of the part that was pressed: name its project with --project"
            );
            return Ok(None);
        };
        let common = Common {
            project: project.clone(),
            quality: self.quality,
            threads: self.threads,
            ..Common::default()
        };
        let loaded = common.load()?;
        Spared::of(&loaded).check("--out", Some(&self.out))?;
        loaded.inputs.project.check()?;
        let limb = bench_folder::limb_key(&loaded.inputs);
        let pressed = bench_folder::key_in(&self.data.data, bench_folder::LIMB)?;
        anyhow::ensure!(
            pressed.is_none_or(|pressed| pressed == limb),
            "{}: these presses are of another limb, or of other gauges, than the project's",
            plain::path(&self.data.data)
        );
        let sensing = sensing_for(&common, &loaded)?;
        Ok(Some(TrainedPart {
            loaded,
            sensing,
            limb,
        }))
    }
}

fn json_of(trained: &TrainingOutcome, notes: &[String], cpu_seconds: f64) -> serde_json::Value {
    let Scores {
        mean_mm,
        median_mm,
        p95_mm,
        coverage,
        force_error_n,
        by_force,
    } = &trained.scores;
    let (force, remainder) = match &trained.estimator {
        Learned::Matching(taught) => (Some(trained.method), taught.known.remainder),
        Learned::Regression(_) => (trained.force.map(Method::from), None),
    };
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "estimator": trained.method,
        "force_estimator": force,
        "validation_mm": trained.validation_mm,
        "test_mm": mean_mm,
        "median_mm": median_mm,
        "p95_mm": p95_mm,
        "force_error_n": force_error_n,
        "coverage": coverage,
        "train_touches": trained.division.train.len(),
        "validation_touches": trained.division.validation.len(),
        "test_touches": trained.division.test.len(),
        "channels": trained.estimator.channels(),
        "remainder": remainder.map(|r| json!({
            "share": r.share,
            "length_mm": r.length * 1e3,
            "scatter": r.scatter,
        })),
        "by_force": by_force,
        "tried": trained.tried,
        "cpu_seconds": cpu_seconds,
        "notes": notes,
    })
}

fn print(trained: &TrainingOutcome, cpu_seconds: f64) -> anyhow::Result<()> {
    for trial in &trained.tried {
        out::line(&format!(
            "{:<18} {:>8.3} mm on the validation touches",
            trial.estimator.name(),
            trial.validation_mm
        ))?;
    }
    out::line(&format!(
        "{} is taken: learned from {}, {cpu_seconds:.0} s of processor time",
        trained.method.name(),
        plain::either(trained.division.train.len(), "touch", "touches")
    ))?;
    print_scores(&trained.scores, trained.division.test.len())
}

/// Errors, and a table of them by force.
pub(super) fn print_scores(scores: &Scores, touches: usize) -> anyhow::Result<()> {
    out::line(&format!(
        "on {touches} test touches: mean {:.3} mm, median {:.3}, 95 % {:.3}; {:.0} % within their radius (made for 90 %)",
        scores.mean_mm,
        scores.median_mm,
        scores.p95_mm,
        100.0 * scores.coverage
    ))?;
    if scores.by_force.is_empty() {
        return Ok(());
    }
    out::line("force (N)     touches  place (mm)  force (N)   the paper's")?;
    for row in &scores.by_force {
        out::line(&force_line(row))?;
    }
    Ok(())
}

/// The paper's mean errors of place (mm) and amplitude (N), by the least force of the interval (N).
const PAPER: [(f64, f64, f64); 4] = [
    (0.5, 25.43, 1.05),
    (4.9, 11.95, 1.19),
    (9.8, 5.90, 1.42),
    (19.6, 4.48, 1.54),
];

fn force_line(row: &ForceRow) -> String {
    let to = row
        .to_n
        .map_or_else(|| "…".to_owned(), |to| format!("{to}"));
    let force = row
        .force_error_n
        .map_or_else(|| "–".to_owned(), |f| format!("{f:.3}"));
    let paper = PAPER.iter().find(|p| p.0 == row.from_n);
    let paper = paper.map_or_else(String::new, |(_, mm, n)| format!("{mm} mm, {n} N"));
    format!(
        "{:<12} {:>8} {:>11.3} {force:>10}   {paper}",
        format!("{}–{to}", row.from_n),
        row.touches,
        row.mean_mm
    )
}
