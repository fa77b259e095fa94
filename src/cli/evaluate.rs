//! `hapdef evaluate`: how well given sites find touches, from a dataset alone.

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use super::data::{
    CriterionArgs, DataArgs, KeptTogether, SplitArg, TouchGroups, criterion_json, site_json,
};
use super::out;
use super::progress::Bar;
use super::ranges::{between, misuse, whole};
use crate::io::cpu_seconds;
use crate::placement::greedy_svr::GreedySvr;
use crate::plain;
use crate::regression::Grouping;
use crate::study::{self, Data, Estimator, StudyVerdict};

/// What turns readings into places.
#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RegressionArg {
    /// A support vector regression trained for each set.
    #[default]
    Svr,
    /// Readings matched to those of the touches learned from.
    Matching,
    /// The mean of the nearest touches learned from.
    Nearest,
}

impl From<RegressionArg> for Estimator {
    fn from(arg: RegressionArg) -> Self {
        match arg {
            RegressionArg::Svr => Self::Svr,
            RegressionArg::Matching => Self::Matching,
            RegressionArg::Nearest => Self::Nearest,
        }
    }
}

#[derive(Args, Debug, Clone)]
pub struct EvaluateArgs {
    #[command(flatten)]
    pub data: DataArgs,
    /// The sites (zero-based, with commas), in the order of their importance.
    #[arg(long, value_delimiter = ',', required = true)]
    pub sites: Vec<usize>,
    #[command(flatten)]
    pub criterion: CriterionArgs,
    /// What turns readings into places. `matching` weighs by noise and by what the data scatter by, and scales
    /// touches by their force where `force_n` says it; `nearest` averages as many touches (1, 2, 4 or 8) as
    /// cross-validation finds best.
    #[arg(long, value_enum, default_value_t)]
    pub estimator: RegressionArg,
    /// Touches that are never divided between learning and judging: `place` (repeats of one place), `none` (each
    /// touch by itself), the name of an array of whole numbers in the NPZ, one a touch, or a CSV with a column
    /// `group` and a row a touch. An array `groups` in the NPZ is taken by itself.
    #[arg(long, value_name = "place|none|ARRAY|CSV")]
    pub groups: Option<String>,
    /// Search C, epsilon and gamma for each number of gauges instead of taking them as given.
    #[arg(long)]
    pub tune: bool,
    /// Share of the touches held out for the errors (the rest is learned from).
    #[arg(long, default_value_t = 0.15, value_parser = between(0.001, 0.95))]
    pub held_out: f64,
    /// Most failed gauges that are tried.
    #[arg(long, default_value_t = 5)]
    pub failed: usize,
    /// Most subsets of failed gauges that are tried; a regression is trained anew for each.
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
    args.check()?;
    let (data, mut notes) = args.data.load()?;
    let (svr, groups) = args.divided(&data)?;
    args.data.named(args.check_sites(&data))?;
    let question = study::StudyQuestion {
        sites: &args.sites,
        estimator: args.estimator.into(),
        groups: groups.as_ref().map(|g| &g.of_touches[..]),
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
        args.data.named(study::evaluate(&data, &question, &watch))
    });
    bar.finish();
    let verdict: StudyVerdict = result?;
    let usual = (args.estimator == RegressionArg::Svr && !args.tune)
        .then(|| args.criterion.paper_note())
        .flatten();
    if let Some(note) = &usual {
        out::say(&format!("note: {note}"));
    }
    notes.extend(usual);
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
            "estimator": question.estimator,
            "criterion": settings_json(&question, &data, groups.as_ref()),
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

impl EvaluateArgs {
    /// That no flag is given in vain.
    fn check(&self) -> anyhow::Result<()> {
        if self.groups.is_some() {
            let split = [
                ("--split", self.criterion.split == SplitArg::Touch),
                ("--place-mm", self.criterion.place_mm.is_some()),
            ];
            if let Some((flag, _)) = split.iter().find(|(_, given)| *given) {
                return Err(misuse(&format!(
                    "{flag} and --groups both say what stays together: leave one of them out"
                )));
            }
        }
        if self.estimator == RegressionArg::Svr {
            return Ok(());
        }
        let idle = self.criterion.of_regression().into_iter();
        match idle
            .chain([("--tune", self.tune)])
            .find(|(_, given)| *given)
        {
            Some((flag, _)) => {
                let estimator = self.estimator.to_possible_value();
                let name = estimator.map_or_else(String::new, |v| v.get_name().to_owned());
                Err(misuse(&format!(
                    "{flag} has no effect with --estimator {name}: leave it out"
                )))
            }
            None => Ok(()),
        }
    }

    fn check_sites(&self, data: &Data) -> anyhow::Result<()> {
        let count = data.x.rows();
        for (k, &site) in self.sites.iter().enumerate() {
            anyhow::ensure!(
                site < count,
                "--sites {site}: the data have only {}, counted from 0",
                plain::count(count, "site")
            );
            anyhow::ensure!(
                !self.sites[..k].contains(&site),
                "--sites {site} stands twice: every gauge has a site of its own"
            );
        }
        Ok(())
    }

    /// The regression with what it keeps together, and the groups that the user gave instead.
    fn divided(&self, data: &Data) -> anyhow::Result<(GreedySvr, Option<TouchGroups>)> {
        let mut svr = self.criterion.criterion(&data.targets)?;
        let said = self.criterion.split == SplitArg::Touch || self.criterion.place_mm.is_some();
        let kept = (self.data).kept(self.groups.as_deref(), said, data.targets.len())?;
        let groups = match kept {
            KeptTogether::Usual => None,
            KeptTogether::Touch => {
                svr.grouping = Grouping::Touch;
                None
            }
            KeptTogether::Given(groups) => Some(groups),
        };
        Ok((svr, groups))
    }
}

/// What was used beside the data: of the regression only where one was trained.
fn settings_json(
    question: &study::StudyQuestion,
    data: &Data,
    groups: Option<&TouchGroups>,
) -> Value {
    let mut used = if question.estimator == Estimator::Svr {
        criterion_json(question.svr)
    } else {
        json!({
            "folds": question.svr.folds,
            "split": question.svr.grouping.name(),
            "seed": question.svr.seed,
        })
    };
    used["noise"] = json!(question.noise);
    used["held_out"] = json!(question.held_out);
    if question.estimator == Estimator::Matching {
        used["forces"] = json!(!data.forces.is_empty());
    }
    if let Some(groups) = groups {
        used["split"] = json!("groups");
        used["groups"] = json!(groups.source);
    }
    used
}

fn print_table(verdict: &StudyVerdict) -> anyhow::Result<()> {
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
