//! Choosing and judging on signals alone, without a part behind them.

mod choice;
mod judge;
mod question;
mod templates;

use glam::DVec3;

use crate::dataset::SignalMatrix;
use crate::gaussian_process::GpKernel;
use crate::placement::SelectorKind;
use crate::placement::expected_error::{Detail, SceneForces, SignalKnowledge, Variance};
use crate::placement::greedy_svr::GreedySvr;
use crate::plain;
use crate::regression::folds::{Folds, number_of};
use crate::regression::places::clumps;
use crate::regression::{Grouping, Standardizer};
use crate::statistics::median;

pub use self::choice::{
    Choice, ChoiceRequest, ChoiceSeconds, WeighedErrors, add_criteria, audit, select,
};
pub use self::judge::evaluate;
pub use self::question::{Estimator, HeldOut, StudyQuestion, StudyVerdict};

/// Signals of sites under touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Data {
    /// Sites × touches, in any unit.
    pub x: SignalMatrix,
    /// Touch positions (mm).
    pub targets: Vec<[f64; 3]>,
    /// Site positions (m); empty where nobody knows them.
    pub positions: Vec<DVec3>,
    /// Cost of each site; empty where all cost the same.
    pub costs: Vec<f64>,
    /// Force of each touch (N) that the signals grow with; empty where they are what they are.
    pub forces: Vec<f64>,
}

/// How a choice is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChoiceSettings {
    /// Who chooses.
    pub kind: SelectorKind,
    /// Greedy SVR's own, and what every choice's criterion in mm is computed with.
    pub svr: GreedySvr,
    /// The kernel of entropy and mutual information; searched when absent.
    pub kernel: Option<GpKernel>,
    /// β⁻¹ of a searched kernel.
    pub kernel_noise: f64,
    /// Standard deviation of the noise added to the signals before choosing, in their unit.
    pub noise: f64,
    /// How hard touches come (N), for signals whose force is known; a third to three times the middle force of the
    /// data when absent.
    pub forces: Option<[f64; 2]>,
    /// How many touches a choice by expected error looks at.
    pub detail: Detail,
}

/// What is known of signals beside their values, where each touch has a force (N) or none has; of forces that come, a
/// third to three times the middle one where nobody says.
fn knowledge<'a>(
    forces: &'a [f64],
    coming: Option<[f64; 2]>,
    noise: f64,
    seed: u64,
    variance: Variance<'a>,
) -> SignalKnowledge<'a> {
    /// The hardest that is thought possible, over the hardest that comes.
    const POSSIBLE: f64 = 2.0;
    let hardest = forces.iter().copied().fold(0.0, f64::max);
    let forces = usual_forces(forces).map(|usual| {
        let coming = coming.unwrap_or(usual);
        SceneForces {
            touches: forces,
            coming,
            possible: POSSIBLE * coming[1].max(hardest),
        }
    });
    SignalKnowledge {
        noise,
        variance: Some(variance),
        shared: None,
        density: None,
        among: None,
        forces,
        seed,
    }
}

/// The lightest and the hardest touch (N) that are taken to come, from those of data; nothing where data have none.
fn usual_forces(forces: &[f64]) -> Option<[f64; 2]> {
    /// Over the middle force.
    const COMING: [f64; 2] = [1.0 / 3.0, 3.0];
    let middle = median(forces.iter().copied())?;
    Some(COMING.map(|share| share * middle))
}

/// The force of each touch, where data say it.
fn forces_of(data: &Data) -> Option<&[f64]> {
    (!data.forces.is_empty()).then_some(&data.forces[..])
}

/// The fold that each touch is tested in, so that anyone can compute the criterion again.
#[must_use]
pub fn folds(data: &Data, settings: &ChoiceSettings) -> Vec<usize> {
    fold_of_touch(&settings.svr, &data.targets)
}

fn fold_of_touch(svr: &GreedySvr, targets: &[[f64; 3]]) -> Vec<usize> {
    Folds::of_groups(&svr.grouping.of(targets), svr.folds, svr.seed).of_touches()
}

/// How many groups of touches there are that are never divided between learning and judging.
#[must_use]
pub fn places(svr: &GreedySvr, targets: &[[f64; 3]]) -> usize {
    number_of(&svr.grouping.of(targets))
}

/// Words on touches that repeat places, where some do.
#[must_use]
pub fn place_notes(svr: &GreedySvr, targets: &[[f64; 3]]) -> Vec<String> {
    let repeat = repeat_note(places(svr, targets), targets.len(), None);
    repeat.into_iter().chain(clump_note(svr, targets)).collect()
}

/// A word on touches that repeat places less exactly than a machine does.
fn clump_note(svr: &GreedySvr, targets: &[[f64; 3]]) -> Option<String> {
    if svr.grouping != Grouping::Place {
        return None;
    }
    clump_words(targets).map(|words| format!("{words} (--place-mm sets another distance)."))
}

/// What touches that lie in clumps are taken for, without the stop at its end.
#[must_use]
pub fn clump_words(targets: &[[f64; 3]]) -> Option<String> {
    let clumps = clumps(targets)?;
    Some(format!(
        "The touches lie in {} clumps, far apart for their size: those within {} mm are taken for one place that was pressed again and again",
        clumps.count,
        plain::digits(clumps.apart_mm)
    ))
}

/// A word on each of the sites whose signal never changes.
fn constant_notes(x: &SignalMatrix, sites: &[usize]) -> Vec<String> {
    let constant = Standardizer::of(&x.select_rows(sites)).constant_rows();
    let said = |row: usize| {
        format!(
            "Site {} reports the same under every touch: it tells nothing.",
            sites[row]
        )
    };
    constant.into_iter().map(said).collect()
}

/// A word on touches that are kept together by groups of the user, or because they repeat places.
fn repeat_note(places: usize, touches: usize, given: Option<&[usize]>) -> Option<String> {
    if places == touches {
        return None;
    }
    Some(if given.is_some() {
        format!(
            "{touches} touches are of {places} groups: none is learned from and judged on in the same group (--groups none divides them one by one)."
        )
    } else {
        format!(
            "{touches} touches lie at {places} places: none is learned from and judged on at the same place (--split touch divides them one by one)."
        )
    })
}
