//! A plan that learns: a round of presses where they tell most, then another, until nine of ten presses that nothing has
//! learned from are found as near as was asked.
//!
//! Nine of ten, and not the mean: where a limb is held no gauge feels much, a press there is found anywhere, and one of them
//! among forty is the mean, however many more are learned from.

use std::collections::BTreeSet;

use anyhow::Context as _;
use glam::DVec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::dataset::{CollectedRun, Wanted};
use super::ready::{Ready, pressed};
use crate::budget::Watch;
use crate::dataset::SignalMatrix;
use crate::design::{PressLessons, Taught, most_telling};
use crate::learning::{ByModel, MeasuredTouches};
use crate::regression::Grouping;
use crate::regression::folds::number_of;
use crate::regression::tune::distances;
use crate::statistics::{mean, quantile};
use crate::uncertainty::HandPressing;

/// What a run is to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunGoal {
    /// How near nine of ten presses that nothing has learned from are to be found (mm).
    pub mm: f64,
    /// Presses between two looks.
    pub round: usize,
    /// Whether they come in the order of the plan, to compare, and not where they tell most.
    pub in_order: bool,
}

/// One in so many presses is never learned from, and a goal is met by as many of these at least.
const HELD_OUT: usize = 4;
const FEWEST: usize = 10;
/// Of the numbers of the presses that are held out.
const SEED: u64 = 0x401d;

/// How far it has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Met {
    /// Presses that were learned from, and others that were judged on.
    pub learned_from: usize,
    /// See [`Self::learned_from`].
    pub held_out: usize,
    /// How far off these are; none before there are any.
    pub errors: Option<PressErrors>,
}

/// How far off some presses are (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressErrors {
    /// On the mean.
    pub mean_mm: f64,
    /// Half of them.
    pub median_mm: f64,
    /// Nine of ten.
    pub p90_mm: f64,
}

/// What comes next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Round {
    /// These presses, by number.
    Press(BTreeSet<usize>),
    /// No more: the goal is met, or nothing is left.
    Over {
        /// Whether it is met.
        met: bool,
    },
}

impl Met {
    fn is_within(&self, goal: &RunGoal) -> bool {
        self.held_out >= FEWEST && self.errors.is_some_and(|e| e.p90_mm <= goal.mm)
    }
}

impl Ready {
    /// What was reached, and what is to be pressed next, of all but what has failed. It reads what is in the folder by now.
    ///
    /// # Errors
    /// A message in the user's terms: presses of a tip without a sensor, or recordings that cannot be read.
    pub fn next_round(
        &self,
        goal: &RunGoal,
        failed: &BTreeSet<usize>,
        watch: Watch,
    ) -> anyhow::Result<(Met, Round)> {
        anyhow::ensure!(
            self.machine.sensor.is_some(),
            "a plan that learns needs the force of every press, and the machine's tip has no sensor"
        );
        let done = pressed(&self.folder)?;
        let held_out = self.held_out();
        let (met, taught, known) = self.taught(&held_out, !done.is_empty(), watch)?;
        if met.is_within(goal) {
            return Ok((met, Round::Over { met: true }));
        }
        let free = |number: &usize| !done.contains(number) && !failed.contains(number);
        // In an order of chance, so that the first of them are of all of the limb.
        let judged = held_out.iter().copied().filter(free);
        let judging = (goal.round / HELD_OUT).max(1);
        let mut next: BTreeSet<usize> = judged.take(judging).collect();
        let learned: Vec<(usize, DVec3)> = (self.planned())
            .filter(|(number, _)| free(number) && !held_out.contains(number))
            .map(|(number, planned)| (number, planned.at))
            .collect();
        let places: Vec<DVec3> = learned.iter().map(|(_, at)| *at).collect();
        let count = goal.round.saturating_sub(judging).max(1);
        let chosen = if goal.in_order {
            (0..count.min(places.len())).collect()
        } else {
            most_telling(&taught, &places, &known, count, self.asked.force_n)
        };
        next.extend(chosen.into_iter().map(|k| learned[k].0));
        let round = if next.is_empty() {
            Round::Over { met: false }
        } else {
            Round::Press(next)
        };
        Ok((met, round))
    }

    /// The presses that are never learned from, in an order of chance: all of a place, or none, drawn by the project's seed.
    fn held_out(&self) -> Vec<usize> {
        let places = self.reach.presses.iter().map(|p| (p.at * 1e3).to_array());
        let of_place = Grouping::Place.of(&places.collect::<Vec<_>>());
        let mut places: Vec<usize> = (0..number_of(&of_place)).collect();
        let seed = self.inputs.project.budget.seed ^ SEED;
        places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        places.truncate(places.len().div_ceil(HELD_OUT));
        let presses = |place: &usize| {
            let of_place = of_place.iter().zip(&self.numbers);
            let place = *place;
            of_place
                .filter(move |(of, _)| **of == place)
                .map(|(_, number)| *number)
        };
        places.iter().flat_map(presses).collect()
    }

    /// Matching as the presses so far teach it, with their places (m), and how far off the others are then.
    fn taught(
        &self,
        held_out: &[usize],
        begun: bool,
        watch: Watch,
    ) -> anyhow::Result<(Met, Taught, Vec<DVec3>)> {
        let wanted = Wanted {
            least_force: Wanted::default().least_force.min(self.asked.force_n / 2.0),
            ..Wanted::default()
        };
        let collected = begun.then(|| CollectedRun::read(&self.folder, wanted));
        let nothing = || {
            (
                SignalMatrix::new(0, Vec::new()),
                Vec::new(),
                Vec::new(),
                Vec::new(),
            )
        };
        let (x, places, forces, numbers) =
            collected.transpose()?.map_or_else(nothing, |collected| {
                let (data, _) = collected.data();
                (data.x, data.targets, data.forces, collected.columns.groups)
            });
        let lessons = MeasuredTouches {
            x: &x,
            places_mm: &places,
            forces: &forces,
            groups: &[],
        };
        let is_judged = |t: &usize| held_out.contains(&(numbers[*t] as usize));
        let (judged, learned): (Vec<usize>, Vec<usize>) = (0..numbers.len()).partition(is_judged);
        let project = &self.inputs.project;
        let presses = PressLessons::new(&self.sensing, project, &lessons, HandPressing::EXACT)
            .with_context(|| self.folder.display().to_string())?;
        let taught = presses.teach(&learned, ByModel::MatchingRemainder, watch)?;
        let answers = taught.find(&x.select_columns(&judged));
        let said: Vec<[f64; 3]> = answers.iter().map(|a| a.place_mm).collect();
        let truth: Vec<[f64; 3]> = judged.iter().map(|&t| places[t]).collect();
        let met = Met {
            learned_from: learned.len(),
            held_out: judged.len(),
            errors: of(distances(&said, &truth)),
        };
        let place = |&t: &usize| DVec3::from_array(places[t]) * 1e-3;
        let known = learned.iter().map(place).collect();
        Ok((met, taught, known))
    }
}

/// Of the distances (mm) of some presses.
fn of(mut distances: Vec<f64>) -> Option<PressErrors> {
    distances.sort_by(f64::total_cmp);
    Some(PressErrors {
        median_mm: quantile(&distances, 0.5)?,
        p90_mm: quantile(&distances, 0.9)?,
        mean_mm: mean(&distances),
    })
}
