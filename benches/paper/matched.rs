//! Strain, as gauges read it: sites by expected error, read by matching, as designed and as built.

use std::fmt::Write as _;

use hapdef::budget::unwatched;
use hapdef::dataset::Signal;
use hapdef::design::{self, DesignError};
use hapdef::evaluation::{Chooser, EstimatorKind, Evaluation};
use hapdef::placement::{Selection, SelectorKind, SensorSet};

use crate::displaced::{Displaced, with_failed};
use crate::{FEW, LOST, MANY, Stages, cell};

pub const SELECTOR: SelectorKind = SelectorKind::ExpectedError;

/// Sets of few and of many gauges for the same touches, on the elements of the displacements.
pub fn judged(displaced: &Displaced, stages: &mut Stages) -> Result<Evaluation, DesignError> {
    let (mut inputs, budget) = (displaced.inputs.clone(), &displaced.budget);
    inputs.project.gauge.signal = Signal::Strain;
    inputs.project.evaluation.estimator = EstimatorKind::Matching;
    let simulated = design::simulate_again(&inputs, budget, &displaced.simulated, &unwatched)?;
    stages.end("simulating strain");
    let feasibility = design::filter(&inputs, &simulated);
    let reduced = design::reduce_sites(&inputs, &simulated, &feasibility, budget)?;
    stages.end("filtering and reducing sites");
    // Each number of gauges is chosen for by itself: gauges are exchanged at the end.
    let mut select = |gauges: usize| -> Result<Selection, DesignError> {
        inputs.project.selection.sensors = gauges;
        design::Choosing {
            inputs: &inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget,
            watch: &unwatched,
        }
        .select(SELECTOR)
    };
    let (few, many) = (select(FEW)?, select(MANY)?);
    stages.end("choosing by expected error");
    let sets: Vec<SensorSet> = [few.sets.last(), many.sets.last()]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    let selections = [Selection { sets, ..many }];
    let sites = design::sites_to_judge(EstimatorKind::Matching, &reduced, &selections);
    let reference = design::reference(&inputs, &simulated, &sites, budget, &unwatched)?;
    stages.end("measuring on a finer model");
    let evaluation = design::Choosing {
        inputs: &inputs,
        simulated: &simulated,
        reduced: &reduced,
        budget,
        watch: &unwatched,
    }
    .evaluate(&selections, &reference)?;
    stages.end("judging by matching");
    Ok(evaluation)
}

pub fn write(text: &mut String, found: &Evaluation) {
    text.push_str("### Strain by matching\n\nSites by expected error, gauges of 1 microstrain of noise, the same touches at several forces. As built: every gauge off by what `gauge.tolerance` says, of which matching knows no more than that; calibrated by twelve known presses made by hand. Blind: touches that move no gauge by three times its noise.\n\n| gauges | force (N) | as designed: mean / median / 95 % (mm) | as built (mm) | calibrated (mm) | blind |\n|---|---|---|---|---|---|\n");
    for gauges in [FEW, MANY] {
        for row in found.by_force(Chooser::from(SELECTOR).set(gauges)) {
            let _ = writeln!(
                text,
                "| {gauges} | {} | {:.2} / {:.2} / {:.2} | {:.2} | {} | {:.0} % |",
                row.force_n,
                row.error_mm,
                row.median_mm,
                row.p95_mm,
                row.as_built_mm,
                cell(row.calibrated_mm),
                100.0 * row.blind
            );
        }
    }
    if let Some((mean, worst)) = with_failed(found, SELECTOR, LOST, false) {
        let _ = writeln!(
            text,
            "\n{LOST} of {MANY} lost and left out, nothing else done: {mean:.2} mm, at worst {worst:.2}."
        );
    }
}
