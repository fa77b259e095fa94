//! What is asked about given sites, and what the answer holds.

use serde::Serialize;

use crate::dataset::SignalMatrix;
use crate::evaluation::failures::FailureRow;
use crate::placement::greedy_svr::GreedySvr;
use crate::regression::Hyper;
use crate::regression::folds::Folds;
use crate::statistics::{mean, quantile};

/// What turns readings into places, learned from data alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// A support vector regression trained for each set.
    #[default]
    Svr,
    /// Readings matched to those of known touches, weighted by noise and by what the data scatter by.
    Matching,
    /// The mean of the nearest known touches.
    Nearest,
}

/// What is asked about given sites.
pub struct StudyQuestion<'a> {
    /// Rows of the data, in the order of their importance.
    pub sites: &'a [usize],
    /// What turns readings into places.
    pub estimator: Estimator,
    /// The group of each touch, numbered from zero without gaps: none is divided between learning and judging. Where
    /// nobody says, by the regression's grouping.
    pub groups: Option<&'a [usize]>,
    /// Settings of regression, folds and seed.
    pub svr: &'a GreedySvr,
    /// Standard deviation of the noise added to the signals, in their unit. Regression learns from noisy signals;
    /// templates are as they were measured, and what is compared with them is noisy.
    pub noise: f64,
    /// Search the regression's settings for each number of gauges.
    pub tune: bool,
    /// Share of the touches held out.
    pub held_out: f64,
    /// Most failed gauges to try.
    pub failed: usize,
    /// Most subsets of failed gauges to try.
    pub subsets: usize,
    /// Whether all sites together are judged too.
    pub baseline: bool,
}

/// Errors on the touches held out (mm).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// So many gauges, the first ones.
    pub sensors: usize,
    /// Mean (mm).
    pub error_mm: f64,
    /// Median (mm).
    pub median_mm: f64,
    /// 95th percentile (mm).
    pub p95_mm: f64,
    /// Of the regression, and whether its fit ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hyper: Option<Hyper>,
    /// Whether the regression's fit converged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<bool>,
    /// How many nearest touches are averaged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<usize>,
}

impl HeldOut {
    /// Of errors (mm), at least one, by an estimator without settings.
    pub(super) fn of(sensors: usize, mut errors: Vec<f64>) -> Self {
        errors.sort_by(f64::total_cmp);
        let share = |q: f64| quantile(&errors, q).unwrap_or(f64::NAN);
        Self {
            sensors,
            error_mm: mean(&errors),
            median_mm: share(0.5),
            p95_mm: share(0.95),
            hyper: None,
            converged: None,
            neighbours: None,
        }
    }
}

/// The answers: for one gauge, two, … all of them in the order given.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyVerdict {
    /// Cross-validated over all touches.
    pub criteria_mm: Vec<f64>,
    /// The fold that each touch is tested in.
    pub fold_of_touch: Vec<usize>,
    /// On the touches held out.
    pub errors: Vec<HeldOut>,
    /// The same with all sites of the data, where that was asked for.
    pub baseline: Option<HeldOut>,
    /// What is left of all sites given when some fail.
    pub failures: Vec<FailureRow>,
    /// The touches that were held out.
    pub test_touches: Vec<usize>,
    /// Groups of touches that were not divided.
    pub places: usize,
    /// What a reader must know, one sentence each.
    pub notes: Vec<String>,
}

/// What an estimator makes of a question.
pub(super) struct JudgedQuestion {
    pub(super) criteria_mm: Vec<f64>,
    pub(super) errors: Vec<HeldOut>,
    pub(super) baseline: Option<HeldOut>,
    pub(super) failures: Vec<FailureRow>,
}

impl JudgedQuestion {
    /// That regressions ended before they were done.
    pub(super) fn unfinished_note(&self) -> Option<String> {
        let mut found = self.errors.iter().chain(&self.baseline);
        let unfinished = found.any(|e| e.converged == Some(false));
        unfinished.then(|| "Some regressions stopped at the effort allowed before they met their tolerance: errors and criterion are not what these sites can do. Allow more steps (--max-steps), or lower C.".into())
    }
}

/// Which touches are learned from, and which are judged on.
pub(super) struct Parts<'a> {
    pub(super) groups: &'a [usize],
    /// Of the criterion.
    pub(super) folds: &'a Folds,
    pub(super) train: &'a [usize],
    pub(super) test: &'a [usize],
    /// The signals with noise.
    pub(super) signals: &'a SignalMatrix,
}

/// More places than any data have.
pub(super) const MOST_PLACES: usize = 10_000_000;

impl StudyQuestion<'_> {
    /// How many of so many places are held out.
    pub(super) fn tests(&self, places: usize) -> usize {
        (self.held_out * places as f64).round() as usize
    }

    /// Whether so many places leave some to judge on and enough to learn from.
    pub(super) fn divides(&self, places: usize) -> bool {
        let tests = self.tests(places);
        tests > 0 && places.saturating_sub(tests) >= 2 * self.svr.folds
    }
}
