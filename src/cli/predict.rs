//! `hapdef predict`: what a trained estimator makes of readings, and how far that is off.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::data::DataArgs;
use super::spared::Spared;
use super::{out, train};
use crate::design::Learned;
use crate::io::table::Writing;
use crate::io::{atomic, touch_file};
use crate::learning::{Estimate, Scores, Still};

#[derive(Args, Debug, Clone)]
pub struct PredictArgs {
    /// The estimator (.hapdtouch), as `hapdef train` writes it.
    #[arg(long)]
    pub model: PathBuf,
    #[command(flatten)]
    pub data: DataArgs,
    /// Answers as a CSV, a row a touch: `x_mm,y_mm,z_mm,radius_mm` and, where forces were learned, `force_n`.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &PredictArgs) -> anyhow::Result<()> {
    Spared::of_data(&args.data.data, args.data.touches.as_deref())
        .and("the estimator", Some(&args.model))
        .check_result("--out", args.out.as_deref())?;
    let file = touch_file::read(&args.model)?;
    let (data, mut notes) = args.data.load_to_answer()?;
    let fits = file.check_channels(data.x.rows());
    args.data.named(fits.map_err(anyhow::Error::msg))?;
    if file.header.origin.fingerprint == touch_file::fingerprint(&data) {
        let note = "The estimator was trained on these touches: most of them are no test of it.";
        out::say(&format!("note: {note}"));
        notes.push(note.to_owned());
    }
    let answers = file.estimator.find(&data.x);
    let scores = Scores::of(&answers, &data.targets, &data.forces);
    let still = Still::of(&file.estimator.known_ratios(), &answers, &data.targets);
    if let Some(path) = &args.out {
        atomic::write(path, table(&answers).as_bytes())?;
    }
    if args.json {
        let summary = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "estimator": file.header.origin.estimator,
            "touches": answers.len(),
            "test_mm": scores.mean_mm,
            "median_mm": scores.median_mm,
            "p95_mm": scores.p95_mm,
            "coverage": scores.coverage,
            "force_error_n": scores.force_error_n,
            "by_force": scores.by_force,
            "holds": still.map(|s| s.holds()),
            "holds_probability": still.map(|s| s.probability),
            "notes": notes,
        });
        return out::line(&summary.to_string());
    }
    train::print_scores(&scores, answers.len())?;
    let cure = match &file.estimator {
        Learned::Regression(_) => "Bring it up to date with hapdef train --update",
        Learned::Matching(_) => "Train it again with new presses (hapdef train --project)",
    };
    still.map_or(Ok(()), |still| out::line(&still.words(cure)))
}

fn table(answers: &[Estimate]) -> String {
    let forces = answers.iter().any(|a| a.force_n.is_some());
    let names = ["x_mm", "y_mm", "z_mm", "radius_mm", "force_n"];
    let mut table = Writing::new(names.into_iter().take(if forces { 5 } else { 4 }));
    for answer in answers {
        let numbers = answer.place_mm.into_iter().chain([answer.radius_mm]);
        let all = numbers.chain(answer.force_n);
        table.row(all.map(|v| format!("{v:.4}")));
    }
    table.text()
}
