//! Judging given sites on touches that are held out.

use std::borrow::Cow;

use super::question::{
    Estimator, HeldOut, JudgedQuestion, MOST_PLACES, Parts, StudyQuestion, StudyVerdict,
};
use super::{Data, clump_note, constant_notes, repeat_note, templates};
use crate::budget::{Watch, report};
use crate::dataset::SignalMatrix;
use crate::evaluation::add_noise;
use crate::evaluation::failures::{FailureTrial, failures};
use crate::pca::PcaError;
use crate::placement::greedy_svr::GreedySvr;
use crate::placement::{PlacementError, Pool};
use crate::regression::folds::{Folds, evenly, hold_out, number_of};
use crate::regression::tune::{self, CrossValidation, TuningGrid, distances};
use crate::regression::{Hyper, PositionModel, scale};

/// Judges given sites.
///
/// # Errors
/// [`PlacementError`] for too few touches, for sites of which none changes from touch to touch, or when the watch asks for a stop.
pub fn evaluate(
    data: &Data,
    question: &StudyQuestion,
    watch: Watch,
) -> Result<StudyVerdict, PlacementError> {
    let svr = question.svr;
    let groups = match question.groups {
        Some(groups) => Cow::Borrowed(groups),
        None => Cow::Owned(svr.grouping.of(&data.targets)),
    };
    let places = number_of(&groups);
    if !question.divides(places) {
        let least = (places..=MOST_PLACES).find(|&n| question.divides(n));
        return Err(svr.too_few(&groups, least.unwrap_or(MOST_PLACES)));
    }
    let constant = constant_notes(&data.x, question.sites);
    if constant.len() == question.sites.len() {
        return Err(PcaError::Constant.into());
    }
    let noisy = add_noise(&data.x, question.noise, svr.seed);
    let folds = Folds::of_groups(&groups, svr.folds, svr.seed);
    // Another draw than the folds'.
    let draw = svr.seed.wrapping_add(0x7e57);
    let (mut test, train) = hold_out(&groups, question.tests(places), draw);
    let parts = Parts {
        groups: &groups,
        folds: &folds,
        train: &train,
        test: &test,
        signals: &noisy,
    };
    let judged = match question.estimator {
        Estimator::Svr => by_regression(data, question, &parts, watch)?,
        Estimator::Matching | Estimator::Nearest => {
            templates::judge(data, question, &parts, watch)?
        }
    };
    test.sort_unstable();
    let mut notes = constant;
    notes.extend(repeat_note(places, data.targets.len(), question.groups));
    if question.groups.is_none() {
        notes.extend(clump_note(svr, &data.targets));
    }
    notes.extend(judged.unfinished_note());
    Ok(StudyVerdict {
        criteria_mm: judged.criteria_mm,
        fold_of_touch: folds.of_touches(),
        errors: judged.errors,
        baseline: judged.baseline,
        failures: judged.failures,
        test_touches: test,
        places,
        notes,
    })
}

/// Judges by a regression trained for each set.
fn by_regression(
    data: &Data,
    question: &StudyQuestion,
    parts: &Parts,
    watch: Watch,
) -> Result<JudgedQuestion, PlacementError> {
    let svr = question.svr;
    let all: Vec<usize> = (0..parts.signals.rows()).collect();
    let prefixes: Vec<Vec<usize>> = (1..=question.sites.len())
        .map(|k| question.sites[..k].to_vec())
        .collect();
    let split = Split::new(parts.signals, &data.targets, parts.train, parts.test);
    let errors: Result<Vec<HeldOut>, PlacementError> = prefixes
        .iter()
        .map(|rows| split.judge(rows, question, watch))
        .collect();
    let errors = errors?;
    let baseline = question
        .baseline
        .then(|| split.judge(&all, question, watch))
        .transpose()?;
    let hyper = errors.last().and_then(|e| e.hyper).unwrap_or(svr.hyper);
    let failures = failures(
        &FailureTrial {
            train: &split.train.select_rows(question.sites),
            train_targets: &split.train_targets,
            test: &split.test.select_rows(question.sites),
            test_targets: &split.test_targets,
            hyper,
            effort: svr.effort,
            failed: question.failed,
            subsets: question.subsets,
            seed: svr.seed,
        },
        watch,
    )?;
    let criteria_mm = if question.groups.is_none() {
        let pool = Pool {
            x: parts.signals,
            targets: &data.targets,
            sites: &all,
            positions: &data.positions,
        };
        svr.criteria(&pool, &prefixes, watch)?
    } else {
        cross_validated(data, question, parts, &prefixes, watch)?
    };
    Ok(JudgedQuestion {
        criteria_mm,
        errors,
        baseline,
        failures,
    })
}

/// The criterion (mm) of some sets with the regression as given, for folds of groups that only the user knows.
fn cross_validated(
    data: &Data,
    question: &StudyQuestion,
    parts: &Parts,
    sets: &[Vec<usize>],
    watch: Watch,
) -> Result<Vec<f64>, PlacementError> {
    let folds = parts.folds;
    let mut sums = vec![0.0; sets.len()];
    for part in &folds.parts {
        let (before, rest) = folds.order.split_at(part.start);
        let (test, after) = rest.split_at(part.len());
        let train = [before, after].concat();
        let split = Split::new(parts.signals, &data.targets, &train, test);
        for (k, (sum, rows)) in sums.iter_mut().zip(sets).enumerate() {
            report(watch, "Cross-validating", k, sets.len())?;
            *sum += split.with(rows, question.svr.hyper, question.svr).error_mm;
        }
    }
    let share = (folds.parts.len() as f64).recip();
    Ok(sums.into_iter().map(|sum| sum * share).collect())
}

/// Touches to learn from and touches to judge on.
struct Split {
    train: SignalMatrix,
    train_targets: Vec<[f64; 3]>,
    test: SignalMatrix,
    test_targets: Vec<[f64; 3]>,
}

impl Split {
    fn new(x: &SignalMatrix, targets: &[[f64; 3]], train: &[usize], test: &[usize]) -> Self {
        let pick = |touches: &[usize]| touches.iter().map(|&t| targets[t]).collect();
        Self {
            train: x.select_columns(train),
            train_targets: pick(train),
            test: x.select_columns(test),
            test_targets: pick(test),
        }
    }

    fn judge(
        &self,
        rows: &[usize],
        question: &StudyQuestion,
        watch: Watch,
    ) -> Result<HeldOut, PlacementError> {
        /// Touches that settings are searched on.
        const SEARCHED: usize = 1000;
        let svr = question.svr;
        let hyper = if question.tune {
            let train = self.train.select_rows(rows);
            let some = evenly(self.train_targets.len(), SEARCHED);
            let targets: Vec<[f64; 3]> = some.iter().map(|&t| self.train_targets[t]).collect();
            let validation = CrossValidation {
                folds: 3,
                seed: svr.seed,
                grouping: svr.grouping,
                effort: svr.effort,
            };
            let x = train.select_columns(&some);
            let grid = TuningGrid::default().scaled(scale::relative(&self.train_targets));
            tune::search(&x, &targets, &grid, &validation, watch)?
                .0
                .best()
        } else {
            svr.hyper
        };
        Ok(self.with(rows, hyper, svr))
    }

    /// Errors of a regression with these settings.
    fn with(&self, rows: &[usize], hyper: Hyper, svr: &GreedySvr) -> HeldOut {
        let train = self.train.select_rows(rows);
        let model = PositionModel::train(&train, &self.train_targets, &hyper, svr.effort);
        let predicted = model.predict(&self.test.select_rows(rows));
        HeldOut {
            hyper: Some(hyper),
            converged: Some(model.converged().0),
            ..HeldOut::of(rows.len(), distances(&predicted, &self.test_targets))
        }
    }
}
