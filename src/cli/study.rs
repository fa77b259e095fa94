//! `hapdef study`: many designs beside each other, on one machine or many.

mod collect;
mod run;
mod shared;
mod submit;
mod unit;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::json;

use self::unit::Workbench;
use super::out;
use crate::io::study_folder::{StudyFolder, read_study};
use crate::plain;

pub use self::collect::StudyCollectArgs;
pub use self::run::RunArgs;
pub use self::submit::SubmitArgs;

/// Many designs of one base project, varied along axes.
#[derive(Args, Debug, Clone)]
pub struct StudyArgs {
    #[command(subcommand)]
    pub step: StudyCommand,
}

#[derive(Subcommand, Debug, Clone)]
pub enum StudyCommand {
    /// Numbers the units of a study and writes them into a folder.
    Plan(PlanArgs),
    /// Computes units of a folder; any of them, anywhere, as often as wanted.
    Run(RunArgs),
    /// Makes tables and a report of what was computed so far.
    Collect(StudyCollectArgs),
    /// Writes a job script for an engine that carries the units to machines, and says the command.
    Submit(SubmitArgs),
}

#[derive(Args, Debug, Clone)]
pub struct PlanArgs {
    /// The study (.toml).
    pub study: PathBuf,
    /// Folder for the units and what comes of them.
    #[arg(long)]
    pub out: PathBuf,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &StudyArgs) -> anyhow::Result<()> {
    match &args.step {
        StudyCommand::Plan(args) => plan(args),
        StudyCommand::Run(args) => run::run(args),
        StudyCommand::Collect(args) => collect::run(args),
        StudyCommand::Submit(args) => submit::run(args),
    }
}

fn plan(args: &PlanArgs) -> anyhow::Result<()> {
    let (study, _) = read_study(&args.study)?;
    let home = args.study.parent().unwrap_or(std::path::Path::new(""));
    // What no unit could use is found before anything is written.
    let bench = Workbench::new(&study, home)?;
    bench.base.check_axes(&study)?;
    let (base, meshes) = (bench.base.fingerprint()?, bench.base.meshes(&study));
    let folder = StudyFolder::plan(&args.out, &args.study, base, meshes)?;
    if args.json {
        return out::line(&json!({ "folder": args.out, "units": folder.plan.units }).to_string());
    }
    out::line(&format!(
        "{}: {}, counted from 0",
        args.out.display(),
        plain::count(folder.plan.units, "unit")
    ))?;
    out::say(&format!(
        "run them with: hapdef study run {} --local",
        args.out.display()
    ));
    Ok(())
}
