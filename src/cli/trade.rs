//! `hapdef trade`: speed against accuracy, measured on the part.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::common::{Common, QualityArg, make_folder};
use super::out;
use super::progress::Bar;
use crate::budget::Quality;
use crate::design::Finest;
use crate::io::project_file::LoadedProject;
use crate::io::together::Together;
use crate::io::trade_file::{self, TradeJudge, TradeRecord};
use crate::io::{ProcessMeter, project_file};
use crate::trade::{Sweep, TradeConstraint, TradePoint, answer, clock, front, measure};

#[derive(Args, Debug, Clone)]
pub struct TradeArgs {
    #[command(flatten)]
    pub common: Common,
    /// Folder for trade.json, trade.csv, trade.md and trade.svg. What is there already is gone on from.
    #[arg(long)]
    pub out: PathBuf,
    /// Settings to have measured in the end, those that are there included.
    #[arg(long, default_value_t = 70)]
    pub points: usize,
    /// Begin no further setting after so many seconds.
    #[arg(long)]
    pub seconds: Option<f64>,
    /// Qualities to measure by their names beside the walk; `--qualities` without any leaves them out.
    #[arg(long, value_delimiter = ',', num_args = 0.., default_values = ["draft", "standard"])]
    pub qualities: Vec<QualityArg>,
    /// Measure nothing more: the most accurate setting that answers within so many seconds, as a project
    /// (answer.hapdef.toml).
    #[arg(long, conflicts_with = "of_the_best_mm")]
    pub within_s: Option<f64>,
    /// Measure nothing more: the quickest setting whose error is within so many mm of the best.
    #[arg(long)]
    pub of_the_best_mm: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &TradeArgs) -> anyhow::Result<()> {
    let mut loaded = args.common.load()?;
    loaded.inputs.project.check()?;
    make_folder(&args.out)?;
    let threads = args.common.in_pool(|| Ok(rayon::current_num_threads()))?;
    let asked = match (args.within_s, args.of_the_best_mm) {
        (Some(seconds), _) => Some(TradeConstraint::Within(seconds)),
        (None, Some(mm)) => Some(TradeConstraint::OfTheBest(mm)),
        (None, None) => None,
    };
    if let Some(asked) = asked {
        let record = known(&args.out, &loaded, threads)?;
        super::common::prepare_folder(&mut loaded, &args.out)?;
        return reply(args, &loaded, &record, asked);
    }
    // To the end: two that measure into one folder would write over each other's points.
    let place = Together::claim(&args.out)?;
    let mut record = known(&args.out, &loaded, threads)?;
    args.common
        .in_pool(|| sweep(args, &loaded, &place, &mut record))?;
    anyhow::ensure!(
        !record.points.is_empty() || args.points == 0,
        "nothing was measured: the time was over before the first setting. Give more with --seconds"
    );
    if args.common.json {
        return out::line(&serde_json::to_string(&record)?);
    }
    out::line(trade_file::markdown(&loaded.inputs.project, &record).trim_end())?;
    for name in ["trade.json", "trade.csv", "trade.md", "trade.svg"] {
        out::say(&format!("wrote {}", args.out.join(name).display()));
    }
    Ok(())
}

/// What was measured in a folder for the same inputs.
fn known(folder: &Path, loaded: &LoadedProject, threads: usize) -> anyhow::Result<TradeRecord> {
    let record = trade_file::read(folder)?;
    let Some(record) = record else {
        return Ok(TradeRecord::new(&loaded.inputs, threads));
    };
    anyhow::ensure!(
        record.is_of(&loaded.inputs),
        "{}: the trade in it was measured for another part, other settings or by another version. Choose another folder",
        folder.join("trade.json").display()
    );
    anyhow::ensure!(
        record.threads == threads,
        "{}: the trade in it was measured with {} threads, not {threads}: times do not compare. Use --threads {} or another folder",
        folder.join("trade.json").display(),
        record.threads,
        record.threads
    );
    Ok(record)
}

fn sweep(
    args: &TradeArgs,
    loaded: &LoadedProject,
    place: &Together,
    record: &mut TradeRecord,
) -> anyhow::Result<()> {
    let project = &loaded.inputs.project;
    let qualities: Vec<Quality> = args.qualities.iter().map(|&q| q.into()).collect();
    let sweep = Sweep::new(project, qualities);
    let start = Instant::now();
    let next = |points: &[TradePoint]| {
        let over = args
            .seconds
            .is_some_and(|s| start.elapsed().as_secs_f64() > s);
        let left = if over {
            0
        } else {
            args.points.saturating_sub(points.len())
        };
        sweep.next(points, left)
    };
    if next(&record.points).is_none() {
        return Ok(trade_file::write(place, project, record)?);
    }
    let bar = Bar::default();
    let watch = |p| -> ControlFlow<()> { bar.show(p) };
    out::say("laying the judge's elements");
    let judge = Finest::new(&loaded.inputs, &watch)?;
    record.judge = TradeJudge {
        element_mm: judge.element_mm(),
        unknowns: judge.unknowns(),
        touches: judge.touches(),
    };
    // Time may be over before the first setting: what is known by now is in the folder all the same.
    trade_file::write(place, project, record)?;
    let meter = ProcessMeter::default();
    while let Some(setting) = next(&record.points) {
        let point = measure(&loaded.inputs, &setting, &judge, &meter, &watch)?;
        bar.finish();
        say(record.points.len() + 1, &point);
        record.points.push(point);
        // What is measured is kept, whenever this is stopped.
        trade_file::write(place, project, record)?;
    }
    Ok(())
}

fn say(number: usize, point: &TradePoint) {
    let words = point.setting.in_words();
    out::say(&match &point.outcome {
        Ok(m) => format!(
            "{number:>3}  {:7.1} s  {:7.2} mm  {words}",
            m.cpu_seconds, m.error_mm
        ),
        Err(message) => format!("{number:>3}  {words}: {message}"),
    });
}

/// Writes the project that keeps a promise.
fn reply(
    args: &TradeArgs,
    loaded: &LoadedProject,
    record: &TradeRecord,
    asked: TradeConstraint,
) -> anyhow::Result<()> {
    let (TradeConstraint::Within(wish) | TradeConstraint::OfTheBest(wish)) = asked;
    anyhow::ensure!(
        wish >= 0.0,
        "--within-s and --of-the-best-mm take zero or more, not {wish}"
    );
    let inputs = &loaded.inputs;
    let best = front(&inputs.project, &record.points);
    anyhow::ensure!(
        !best.is_empty(),
        "{}: nothing is measured there yet. Run `hapdef trade --out` without --within-s and --of-the-best-mm first",
        args.out.display()
    );
    let quickest = best.first().and_then(|p| p.measured());
    let pace = clock(&record.points);
    let Some((point, m)) = answer(&best, asked, pace).and_then(|p| Some((p, p.measured()?))) else {
        let least = quickest.map_or(f64::NAN, |m| m.cpu_seconds * pace);
        anyhow::bail!(
            "no measured setting answers as quickly: the quickest took {least:.1} s. Ask for more time, or measure more points"
        );
    };
    let path = args.out.join("answer.hapdef.toml");
    let mut project = inputs.project.clone();
    point.setting.apply(&mut project);
    project.part.mesh = project_file::relative_to(&path, &loaded.mesh_path);
    let painted = inputs.painted.as_ref().map(|m| m.as_slice());
    project_file::save(&path, &project, painted, &inputs.masks)?;
    if args.common.json {
        out::line(&serde_json::to_string(point)?)?;
    } else {
        out::line(&format!(
            "{:.2} mm mean, {:.2} mm median, in {:.1} s ({:.1} s of processors): {}",
            m.error_mm,
            m.median_mm,
            m.cpu_seconds * pace,
            m.cpu_seconds,
            point.setting.in_words()
        ))?;
    }
    out::say(&format!("wrote {}", path.display()));
    Ok(())
}
