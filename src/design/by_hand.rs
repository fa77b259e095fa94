//! Gauges moved by hand: judged as the selectors' own are, and put in their place.

use std::sync::Arc;

use super::judge::{judge_as_asked, reference};
use super::{Design, DesignError, Inputs};
use crate::budget::Watch;
use crate::evaluation::{Candidate, Evaluation, EvaluationRow, Matched, MatchedRow};
use crate::placement::SensorSet;

/// Judges one set of sites (as numbered in the dataset) that nobody selected, as a design's own sets were:
/// with its test touches, its noise and, where it has a set of as many gauges by the selector in the lead,
/// the settings of that set's regression. Its name in the rows is `name`.
///
/// # Errors
/// As [`reference()`].
pub fn judge_set(
    inputs: &Inputs,
    design: &Design,
    sites: &[usize],
    name: &str,
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let (simulated, budget) = (&design.simulated, &design.budget);
    let reference = reference(inputs, simulated, sites, budget, watch)?;
    let rows = sites
        .iter()
        .filter_map(|s| reference.sites.binary_search(s).ok());
    let own = (design.evaluation.rows.iter())
        .find(|r| r.selector == design.lead.name() && r.sensors == sites.len());
    let set = Candidate {
        selector: name.to_owned(),
        rows: rows.collect(),
        hyper: own.and_then(|r| r.hyper),
    };
    // Sites that the design has measured keep their noise; others have streams beyond all of its own.
    let known = &design.reference.sites;
    let stream = |s: &usize| match known.binary_search(s) {
        Ok(row) => row as u64,
        Err(_) => (known.len() + s) as u64,
    };
    let streams: Vec<u64> = reference.sites.iter().map(stream).collect();
    let sets = [set];
    judge_as_asked(
        inputs, simulated, &reference, &sets, &streams, budget, watch,
    )
}

impl Design {
    /// The same with other sites for its chosen set, put there by hand, and what they were judged to do
    /// ([`super::judge_set`]).
    #[must_use]
    pub fn with_hand(&self, sites: Vec<usize>, judged: &Evaluation) -> Self {
        let mut design = self.clone();
        design.by_hand = true;
        let (name, old) = (self.lead.name(), self.chosen().len());
        let set = (self.selections.iter())
            .flat_map(|s| s.sets.iter().map(move |set| (s.selector, set.sites.len())))
            .position(|set| set == (self.lead, old));
        let count = sites.len();
        let selections = Arc::make_mut(&mut design.selections);
        if let Some(led) = selections.iter_mut().find(|s| s.selector == self.lead) {
            led.achieved.cautions.push(
                "Gauges were moved by hand: the chosen set and its errors are those of the gauges as they are, not of the selector. What it says of ties, gaps and exchanges is of the set that it chose.".into(),
            );
            // Its figures for that set say nothing of this one.
            led.achieved.error_estimate = None;
            if let Some(last) = led.sets.last_mut() {
                *last = SensorSet {
                    sites,
                    criterion: None,
                    criterion_mm: None,
                    gap: None,
                    margin: None,
                    certificate: None,
                    expected_mm: None,
                };
            }
        }
        let evaluation = Arc::make_mut(&mut design.evaluation);
        replace_rows(evaluation, (name, old), count, judged);
        if let (Some(k), Some(errors), Some(built)) =
            (set, judged.errors.first(), judged.built.first())
        {
            evaluation.errors[k].clone_from(errors);
            evaluation.built[k].clone_from(built);
        }
        design
    }
}

/// Puts what was judged of a set of `count` gauges in the place of a selector's set of so many (`old`).
fn replace_rows(
    evaluation: &mut Evaluation,
    (name, old): (&str, usize),
    count: usize,
    judged: &Evaluation,
) {
    let is_old = |selector: &str, sensors: usize| selector == name && sensors == old;
    let rows = judged.rows.iter().map(|r| EvaluationRow {
        selector: name.to_owned(),
        sensors: count,
        ..r.clone()
    });
    put_in_place(
        &mut evaluation.rows,
        |r| is_old(&r.selector, r.sensors),
        rows,
    );
    let found = judged.found.iter().map(|m| Matched {
        selector: name.to_owned(),
        sensors: count,
        ..m.clone()
    });
    put_in_place(
        &mut evaluation.found,
        |m| is_old(&m.selector, m.sensors),
        found,
    );
    let matched = judged.matched.iter().map(|r| MatchedRow {
        selector: name.to_owned(),
        sensors: count,
        ..r.clone()
    });
    put_in_place(
        &mut evaluation.matched,
        |r| is_old(&r.selector, r.sensors),
        matched,
    );
    if let Some(failed) = judged.failures.first() {
        for own in (evaluation.failures.iter_mut()).filter(|f| f.selector == name) {
            own.sensors = count;
            own.rows.clone_from(&failed.rows);
        }
    }
}

/// Puts others where some of a list are, which go; at its end where there are none.
fn put_in_place<T>(all: &mut Vec<T>, old: impl Fn(&T) -> bool, new: impl Iterator<Item = T>) {
    let at = all.iter().position(&old).unwrap_or(all.len());
    all.retain(|t| !old(t));
    all.splice(at..at, new);
}
