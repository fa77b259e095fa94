//! `hapdef study submit`: a job script for an engine.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::cli::out;
use crate::cli::ranges::whole;
use crate::io::atomic;
use crate::io::study_folder::StudyFolder;
use crate::parameter_study::{Engine, UnitLimits};
use crate::statistics::quantile;

#[derive(Args, Debug, Clone)]
pub struct SubmitArgs {
    /// The study's folder, as `hapdef study plan` wrote it.
    pub folder: PathBuf,
    /// What carries the units to machines.
    #[arg(long, value_enum)]
    pub engine: EngineArg,
    /// Units that one task runs one after another: those of the fastest axis when left out, which often share a simulation,
    /// but 32 at most.
    #[arg(long, value_parser = whole(1, 100_000))]
    pub together: Option<usize>,
    /// Threads of a task.
    #[arg(long, default_value_t = 2, value_parser = whole(1, 1024))]
    pub threads: usize,
    /// Memory of a task (GB).
    #[arg(long, default_value_t = 8, value_parser = whole(1, 10_000))]
    pub memory: usize,
    /// Time limit of a task (minutes): four times what units took so far, or an hour, when left out.
    #[arg(long, value_parser = whole(1, 100_000))]
    pub minutes: Option<usize>,
    /// What runs hapdef on those machines.
    #[arg(long, default_value = "hapdef")]
    pub program: String,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineArg {
    Hyperqueue,
    Slurm,
    Parallel,
}

impl From<EngineArg> for Engine {
    fn from(arg: EngineArg) -> Self {
        match arg {
            EngineArg::Hyperqueue => Self::HyperQueue,
            EngineArg::Slurm => Self::Slurm,
            EngineArg::Parallel => Self::Parallel,
        }
    }
}

/// Units of a task that nobody has said the number of.
const MOST_TOGETHER: usize = 32;

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub(super) fn run(args: &SubmitArgs) -> anyhow::Result<()> {
    let folder = StudyFolder::open(&args.folder)?;
    let together = args
        .together
        .unwrap_or(folder.study.fastest().clamp(1, MOST_TOGETHER));
    let job = UnitLimits {
        units: folder.plan.units,
        together,
        minutes: args.minutes.unwrap_or_else(|| minutes(&folder, together)) as u32,
        memory_gb: args.memory as u32,
        threads: args.threads as u32,
    };
    let script = job.script(args.engine.into(), &args.program);
    let path = args.folder.join(script.name);
    atomic::write(&path, script.text.as_bytes())?;
    if args.json {
        let said = json!({ "script": path, "command": script.command, "folder": args.folder, "minutes": job.minutes, "together": together });
        return out::line(&said.to_string());
    }
    out::line(&format!(
        "cd {} && {}",
        args.folder.display(),
        script.command
    ))?;
    out::say(&format!("wrote {}", path.display()));
    Ok(())
}

/// Four times what nineteen of twenty units took so far, for as many as a task runs.
fn minutes(folder: &StudyFolder, together: usize) -> usize {
    const AN_HOUR: usize = 60;
    let known = (0..folder.plan.units).filter_map(|unit| folder.cost(unit));
    let mut seconds: Vec<f64> = known.map(|cost| cost.cpu_seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let Some(long) = quantile(&seconds, 0.95) else {
        return AN_HOUR;
    };
    ((4.0 * long * together as f64 / 60.0).ceil() as usize).max(1)
}
