//! `hapdef design`: the whole pipeline.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::common::{Common, SelectorArg, prepare_folder};
use super::{out, progress::Bar};
use crate::design::{self, Design, DesignRequest};
use crate::evaluation::{Chooser, EvaluationRow, MatchedRow};
use crate::io::artifacts::{self, Provenance};
use crate::io::together::Together;
use crate::paper::SheetSize;
use crate::placement::{SelectorKind, SensorSet};
use crate::plain;
use crate::project::Project;

#[derive(Args, Debug, Clone)]
pub struct DesignArgs {
    #[command(flatten)]
    pub common: Common,
    /// Folder for report.html, sites.csv, design.json, dataset.npz, design.hapdef.toml and what the workshop is given.
    #[arg(long)]
    pub out: PathBuf,
    /// Gauges to place.
    #[arg(long)]
    pub sensors: Option<usize>,
    /// The selector whose sites are reported; all are evaluated.
    #[arg(long)]
    pub selector: Option<SelectorArg>,
    /// Keep this many candidates instead of as many as the project's variance needs.
    #[arg(long)]
    pub candidates: Option<usize>,
    /// The comparison of the paper, whatever the project says: its four selectors, judged by regression.
    #[arg(long)]
    pub paper: bool,
    /// Leave out what the workshop is given: report.pdf, template.pdf, wiring.csv, bill.csv, `hapd_config.h` and what goes with them.
    #[arg(long)]
    pub no_workshop: bool,
    /// Sheets of report.pdf and template.pdf: a4 or letter.
    #[arg(long, default_value = "a4")]
    pub sheet: SheetSize,
}

impl DesignArgs {
    /// What is asked for on the command line goes before what the project says.
    fn change(&self, project: &mut Project) {
        if let Some(sensors) = self.sensors {
            project.selection.sensors = sensors;
        }
        if let Some(selector) = self.selector {
            project.selection.selector = selector.into();
        }
        if self.candidates.is_some() {
            project.candidates.count = self.candidates;
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &DesignArgs) -> anyhow::Result<()> {
    let mut loaded = args.common.load()?;
    let project = &mut loaded.inputs.project;
    args.change(project);
    let paper = args.paper.then(|| as_in_the_paper(project));
    project.check()?;
    let existed = args.out.exists();
    prepare_folder(&mut loaded, &args.out)?;
    // Before anything is computed: what nobody else may write into meanwhile.
    let report = Together::claim(&args.out)?;
    let project = &loaded.inputs.project;
    let kinds = paper.unwrap_or_else(|| project.selectors());
    let budget = project.budget.budget();
    let bar = Bar::default();
    let start = Instant::now();
    let inputs = loaded.inputs.clone();
    let asked = DesignRequest {
        inputs: &inputs,
        kinds: &kinds,
        budget: &budget,
    };
    let design = args.common.in_pool(|| {
        let clock = || start.elapsed().as_secs_f64();
        Ok(design::run(&asked, &clock, &|p| bar.show(p))?)
    });
    bar.finish();
    if design.is_err() && !existed {
        // Made to find out early that it can be; a refused design leaves nothing behind.
        let _ = std::fs::remove_dir_all(&args.out);
    }
    let design = design?;
    let provenance = Provenance {
        mesh_path: &loaded.mesh_path,
        version: env!("CARGO_PKG_VERSION"),
        taken_in: loaded.repairs.in_words(loaded.inputs.project.part.body),
    };
    let files = artifacts::write_into(
        &report,
        &loaded.inputs,
        &design,
        &provenance,
        (!args.no_workshop).then_some(args.sheet),
    )?;
    if args.common.json {
        return out::line(&artifacts::summary(&loaded.inputs, &design).to_string());
    }
    print_summary(&design)?;
    for file in files {
        out::say(&format!("wrote {}", file.display()));
    }
    Ok(())
}

/// Makes a project compare as the paper does, and says which selectors choose.
fn as_in_the_paper(project: &mut Project) -> Vec<SelectorKind> {
    project.compare_as_in_the_paper();
    SelectorKind::PAPER.to_vec()
}

fn print_summary(design: &Design) -> anyhow::Result<()> {
    let candidates = design.candidates.as_ref().map_or_else(
        || "all of them candidates".to_owned(),
        |c| plain::count(c.rows.len(), "candidate"),
    );
    out::line(&format!(
        "{} inside sites, {} feasible, {candidates}, {} touches",
        design.simulated.lattice,
        design.reduced.feasible.len(),
        design.simulated.dataset.touches.len()
    ))?;
    for (filter, count) in design.feasibility.taken() {
        let label = filter.label().to_lowercase();
        out::line(&format!("{count:>6} taken: {label}"))?;
    }
    print_gauges(design)?;
    if let Some(words) = design.chosen_set().and_then(SensorSet::certified) {
        out::line(&words)?;
    }
    let chosen = design.chosen().len();
    print_forces(design)?;
    for row in design.evaluation.rows.iter().filter(|r| tells(r, chosen)) {
        out::line(&format!(
            "{:>14}, {:>3} gauges, {:<26} {:7.2} mm mean {:7.2} mm median",
            row.set.chooser.name(),
            row.set.sensors,
            row.region,
            row.error_mm,
            row.median_mm
        ))?;
    }
    for doubt in design.doubts() {
        out::line(&format!("NOT TO BE TRUSTED: {}", doubt.words))?;
    }
    let words = design.words();
    for note in &words.open {
        out::line(&format!("note: {note}"))?;
    }
    if !words.folded.is_empty() {
        let more = plain::count(words.folded.len(), "more note");
        out::line(&format!("{more} on how this came about in the report"))?;
    }
    let total: f64 = design.seconds.iter().map(|s| s.seconds).sum();
    out::say(&format!("{total:.1} s"));
    Ok(())
}

/// What matching does with the chosen gauges at every force that it was judged at.
fn print_forces(design: &Design) -> anyhow::Result<()> {
    for row in design.evaluation.by_force(design.chosen_id()) {
        let calibrated = row.calibrated_mm;
        let calibrated = calibrated.map_or(String::new(), |mm| format!(", {mm:.2} mm calibrated"));
        out::line(&format!(
            "touches of {} N, by matching: {:.2} mm mean as drawn{}, {:.2} mm as built{calibrated}",
            row.force_n,
            row.error_mm,
            without_blind(row),
            row.as_built_mm
        ))?;
    }
    if let Some(force) = design.evaluation.judging.middle_n() {
        out::line(&format!("touches of {force} N:"))?;
    }
    Ok(())
}

/// The error of the touches that are felt, where many are not.
fn without_blind(row: &MatchedRow) -> String {
    /// Share of the touches.
    const MANY: f64 = 0.01;
    let sighted = row.sighted_mm.filter(|_| row.blind >= MANY);
    sighted.map_or(String::new(), |mm| {
        let percent = 100.0 * row.blind;
        format!(" ({mm:.2} mm without the {percent:.0} % that move no gauge)")
    })
}

fn print_gauges(design: &Design) -> anyhow::Result<()> {
    out::line("gauge       x        y        z (mm)   direction")?;
    for (number, &s) in (1..).zip(design.chosen()) {
        let site = &design.simulated.dataset.sites[s];
        let (p, d) = (site.gauge.position * 1000.0, site.gauge.direction);
        out::line(&format!(
            "{number:>5} {:8.2} {:8.2} {:8.2}   {:+.3} {:+.3} {:+.3}",
            p.x, p.y, p.z, d.x, d.y, d.z
        ))?;
    }
    Ok(())
}

/// Whether a row stands in the summary: those of as many gauges as were chosen, and of the paper's five and ten to
/// compare with.
fn tells(row: &EvaluationRow, chosen: usize) -> bool {
    [5, 10, chosen].contains(&row.set.sensors) || row.set.chooser == Chooser::AllCandidates
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::EstimatorKind;

    #[test]
    fn the_paper_knows_four_selectors_and_one_estimator() {
        let mut project = Project::around("limb.stl", None);
        project.evaluation.estimator = EstimatorKind::Matching;
        project.selection.compare = false;
        for (asked, led) in [
            (SelectorKind::Entropy, SelectorKind::Entropy),
            (SelectorKind::ExpectedError, SelectorKind::GreedySvr),
        ] {
            project.selection.selector = asked;
            let kinds = as_in_the_paper(&mut project);
            assert_eq!(kinds, SelectorKind::PAPER);
            assert_eq!(project.selection.selector, led);
            assert_eq!(project.judging().estimator(), EstimatorKind::Svr);
        }
    }
}
