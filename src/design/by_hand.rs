//! Gauges moved by hand: judged as the selectors' own are, and put in their place.

use std::sync::Arc;

use super::judge::{JudgedOn, reference};
use super::{Design, DesignError, Inputs};
use crate::budget::Watch;
use crate::evaluation::{
    Candidate, Chooser, Evaluation, EvaluationRow, JudgedSet, Matched, MatchedRow, SetId,
};
use crate::placement::SensorSet;

/// Judges one set of sites (as numbered in the dataset) that nobody selected, as a design's own sets were:
/// with its test touches, its noise and, where it has a set of as many gauges by the selector in the lead,
/// the settings of that set's regression. Its rows are those of [`Chooser::Hand`].
///
/// # Errors
/// As [`reference()`].
pub fn judge_set(
    inputs: &Inputs,
    design: &Design,
    sites: &[usize],
    watch: Watch,
) -> Result<Evaluation, DesignError> {
    let (simulated, budget) = (&design.simulated, &design.budget);
    let reference = reference(inputs, simulated, sites, budget, watch)?;
    let rows = sites
        .iter()
        .filter_map(|s| reference.sites.binary_search(s).ok());
    let as_many = Chooser::from(design.chosen_by).set(sites.len());
    let own = design.evaluation.over_all(as_many);
    let set = Candidate {
        chooser: Chooser::Hand,
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
    let on = JudgedOn {
        inputs,
        simulated,
        reference: &reference,
        streams: &streams,
        budget,
        watch,
    };
    on.judge_as_asked(&sets)
}

impl Design {
    /// The same with other sites for its chosen set, put there by hand, and what they were judged to do
    /// ([`super::judge_set`]).
    #[must_use]
    pub fn with_hand(&self, sites: Vec<usize>, judged: &Evaluation) -> Self {
        let mut design = self.clone();
        design.by_hand = true;
        let old = self.chosen_id();
        let new = old.chooser.set(sites.len());
        // Sets that are as large and larger are no steps on the way to this one.
        let is_step = |sensors: usize| sensors < new.sensors;
        let selections = Arc::make_mut(&mut design.selections);
        if let Some(own) = selections.iter_mut().find(|s| s.selector == self.chosen_by) {
            own.achieved.cautions.push(
                "Gauges were moved by hand: the chosen set and its errors are those of the gauges as they are, not of the selector. What it says of ties, gaps and exchanges is of the set that it chose.".into(),
            );
            // Its figures for that set say nothing of this one.
            own.achieved.error_estimate = None;
            own.sets.pop();
            own.sets.retain(|set| is_step(set.sites.len()));
            own.sets.push(SensorSet {
                sites,
                criterion: None,
                criterion_mm: None,
                gap: None,
                margin: None,
                certificate: None,
                expected_mm: None,
            });
        }
        let evaluation = Arc::make_mut(&mut design.evaluation);
        forget(evaluation, |set| {
            set.chooser == old.chooser && set != old && !is_step(set.sensors)
        });
        replace_judged(evaluation, old, new, judged);
        design
    }
}

/// Leaves out what was judged of some sets.
fn forget(evaluation: &mut Evaluation, gone: impl Fn(SetId) -> bool) {
    evaluation.rows.retain(|r| !gone(r.set));
    evaluation.sets.retain(|s| !gone(s.set));
    evaluation.found.retain(|m| !gone(m.set));
    evaluation.matched.retain(|r| !gone(r.set));
}

/// Puts what was judged of one set in the place of another, as if it were that one with other gauges.
fn replace_judged(evaluation: &mut Evaluation, old: SetId, new: SetId, judged: &Evaluation) {
    let rows = judged.rows.iter().cloned();
    let rows = rows.map(|r| EvaluationRow { set: new, ..r });
    put_in_place(&mut evaluation.rows, |r| r.set == old, rows);
    let sets = judged.sets.iter().cloned();
    let sets = sets.map(|s| JudgedSet { set: new, ..s });
    put_in_place(&mut evaluation.sets, |s| s.set == old, sets);
    let found = judged.found.iter().cloned();
    let found = found.map(|m| Matched { set: new, ..m });
    put_in_place(&mut evaluation.found, |m| m.set == old, found);
    let matched = judged.matched.iter().cloned();
    let matched = matched.map(|r| MatchedRow { set: new, ..r });
    put_in_place(&mut evaluation.matched, |r| r.set == old, matched);
    if let Some(failed) = judged.failures.first() {
        for own in evaluation.failures.iter_mut().filter(|f| f.set == old) {
            own.set = new;
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
