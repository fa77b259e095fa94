//! `hapdef evaluate`: how well given sites find touches, from a dataset alone.

use clap::Args;
use serde_json::json;

use super::data::{CriterionArgs, DataArgs, criterion_json, site_json};
use super::out;
use super::progress::Bar;
use super::ranges::{between, whole};
use crate::io::cpu_seconds;
use crate::study::{self, Verdict};

#[derive(Args, Debug, Clone)]
pub struct EvaluateArgs {
    #[command(flatten)]
    pub data: DataArgs,
    /// The sites (zero-based, with commas), in the order of their importance.
    #[arg(long, value_delimiter = ',', required = true)]
    pub sites: Vec<usize>,
    #[command(flatten)]
    pub criterion: CriterionArgs,
    /// Search C, epsilon and gamma for each number of gauges instead of taking them as given.
    #[arg(long)]
    pub tune: bool,
    /// Share of the touches held out for the errors (the rest is learned from).
    #[arg(long, default_value_t = 0.15, value_parser = between(0.001, 0.95))]
    pub held_out: f64,
    /// Most failed gauges that are tried.
    #[arg(long, default_value_t = 5)]
    pub failed: usize,
    /// Most subsets of failed gauges that the regression is trained anew for.
    #[arg(long, default_value_t = 20, value_parser = whole(1, 100_000))]
    pub subsets: usize,
    /// Also the error with all sites of the dataset.
    #[arg(long)]
    pub baseline: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let (data, mut notes) = args.data.load()?;
    let svr = args.criterion.criterion(&data.targets)?;
    for (k, &site) in args.sites.iter().enumerate() {
        anyhow::ensure!(
            site < data.x.rows(),
            "--sites {site}: there are only {} sites",
            data.x.rows()
        );
        anyhow::ensure!(
            !args.sites[..k].contains(&site),
            "--sites {site} stands twice: every gauge has a site of its own"
        );
    }
    let question = study::Question {
        sites: &args.sites,
        svr: &svr,
        noise: args.criterion.noise,
        tune: args.tune,
        held_out: args.held_out,
        failed: args.failed,
        subsets: args.subsets,
        baseline: args.baseline,
    };
    let bar = Bar::default();
    let before = cpu_seconds();
    let result = args.criterion.in_pool(|| {
        let watch = |p| bar.show(p);
        Ok(study::evaluate(&data, &question, &watch)?)
    });
    bar.finish();
    let verdict: Verdict = result?;
    for note in &verdict.notes {
        out::say(&format!("note: {note}"));
    }
    notes.extend(verdict.notes.iter().cloned());
    if args.criterion.json {
        let sites: Vec<_> = args.sites.iter().map(|&s| site_json(&data, s)).collect();
        let summary = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "sites": sites,
            "criterion_mm": verdict.criteria_mm,
            "criterion": criterion_json(&svr),
            "fold_of_touch": verdict.fold_of_touch,
            "errors": verdict.errors,
            "baseline": verdict.baseline,
            "failures": verdict.failures,
            "test_touches": verdict.test_touches,
            "places": verdict.places,
            "cpu_seconds": cpu_seconds() - before,
            "notes": notes,
        });
        return out::line(&summary.to_string());
    }
    print_table(&verdict)
}

fn print_table(verdict: &Verdict) -> anyhow::Result<()> {
    out::line("gauges  criterion  held out: mean  median     95 %  (mm)")?;
    for (error, criterion) in verdict.errors.iter().zip(&verdict.criteria_mm) {
        out::line(&format!(
            "{:>6}  {criterion:>9.3}  {:>14.3}  {:>6.3}  {:>7.3}",
            error.sensors, error.error_mm, error.median_mm, error.p95_mm
        ))?;
    }
    for row in &verdict.failures {
        out::line(&format!(
            "{} failed, {}: {:.2} mm, at worst {:.2} ({} of {} subsets)",
            row.failed,
            if row.retrained {
                "trained anew"
            } else {
                "as trained"
            },
            row.error_mm,
            row.worst_mm,
            row.subsets,
            row.of
        ))?;
    }
    Ok(())
}
