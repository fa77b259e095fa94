//! Training: the families learn, the validation touches choose, the test touches have the last word.

use faer::Mat;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::distance::among;
use super::doubt::ErrorModel;
use super::estimator::{ForceEstimator, TouchEstimator};
use super::family::{Family, Method, TunedMethod};
use super::inputs::ChannelScales;
use super::lessons::{Division, KnownTouches, LearningError, MeasuredTouches, lengths};
use super::machine::Regression;
use super::score::Scores;
use super::targets::{Scale, TargetFrame};
use crate::budget::Watch;
use crate::plain;
use crate::statistics::mean;

/// What is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrainingRequest {
    /// The one family, or all.
    pub family: Option<Family>,
    /// Of the division.
    pub seed: u64,
    /// Touches to learn from; all of eight tenths of the places when absent.
    pub train_touches: Option<usize>,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedEstimator {
    /// The estimator that was chosen.
    pub estimator: TouchEstimator,
    /// Its family.
    pub family: Family,
    /// Every family's error on the validation touches.
    pub tried: Vec<MethodTrial>,
    /// On the test touches.
    pub scores: Scores,
    /// Mean error on the validation touches (mm).
    pub validation_mm: f64,
    /// Who was learned from, chosen by and judged on.
    pub division: Division,
    /// What a reader must know, one sentence each.
    pub notes: Vec<String>,
}

/// How a method did.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodTrial {
    /// The method.
    pub estimator: Method,
    /// Mean error on the validation touches (mm).
    pub validation_mm: f64,
}

/// Most touches that are learned from: a factor of their covariance grows with the cube of their number, and what more
/// of them bring hardly at all.
const MOST: usize = 6000;

/// Trains on measured touches.
///
/// # Errors
/// [`LearningError`] for touches that nothing can be learned from, or when the watch asks for a stop.
pub fn train(
    lessons: &MeasuredTouches,
    asked: &TrainingRequest,
    watch: Watch,
) -> Result<TrainedEstimator, LearningError> {
    let mut division = Division::draw(lessons.groups, asked.seed, asked.train_touches)?;
    let mut notes = Vec::new();
    if division.train.len() > MOST {
        notes.push(format!(
            "Of {} training touches {MOST} are learned from, drawn by the seed.",
            division.train.len()
        ));
        division.train.truncate(MOST);
    }
    let school = School::new(lessons, &division)?;
    notes.extend(school.note());
    let frame = TargetFrame::of(&school.places(&division.train)).ok_or(LearningError::OnePlace)?;
    let outputs = |touches: &[usize]| frame.apply(&school.places(touches));
    let lesson = SplitLesson {
        known: school.known(&division.train, outputs(&division.train)),
        others: school.known(&division.validation, outputs(&division.validation)),
    };
    let families = asked.family.map_or(Family::ALL.to_vec(), |f| vec![f]);
    let (chosen, tried) = lesson.choose(&families, watch)?;
    let doubt = lesson.error_model(&chosen, watch)?;
    let estimator = TouchEstimator {
        force: school.force(&division, &families, &mut notes, watch)?,
        inputs: school.inputs,
        place: chosen.machine,
        doubt,
        frame,
    };
    let at = |touches: &[usize]| touches.iter().map(|&t| lessons.places_mm[t]).collect();
    let test: Vec<[f64; 3]> = at(&division.test);
    let forces: Vec<f64> = (division.test.iter())
        .filter_map(|&t| lessons.forces.get(t).copied())
        .collect();
    let answers = estimator.find(&lessons.x.select_columns(&division.test));
    let size = estimator.frame.size;
    Ok(TrainedEstimator {
        family: chosen.family,
        tried: tried
            .iter()
            .map(|t| MethodTrial {
                estimator: t.0.into(),
                validation_mm: t.1 * size,
            })
            .collect(),
        scores: Scores::of(&answers, &test, &forces),
        validation_mm: chosen.error * size,
        estimator,
        division,
        notes,
    })
}

/// Touches as features.
struct School<'a> {
    lessons: &'a MeasuredTouches<'a>,
    inputs: ChannelScales,
    /// Touches × live channels.
    features: Mat<f64>,
}

impl<'a> School<'a> {
    /// Scaled as the training touches say.
    fn new(lessons: &'a MeasuredTouches<'a>, division: &Division) -> Result<Self, LearningError> {
        let inputs = ChannelScales::of(&lessons.x.select_columns(&division.train));
        if inputs.live().is_empty() {
            return Err(LearningError::NoSignal);
        }
        Ok(Self {
            features: inputs.apply(lessons.x),
            inputs,
            lessons,
        })
    }

    /// A word on channels that say nothing.
    fn note(&self) -> Option<String> {
        let dead = self.inputs.channels() - self.features.ncols();
        (dead > 0).then(|| {
            format!(
                "{} the same under every training touch and {} left out.",
                plain::either(dead, "channel reads", "channels read"),
                if dead == 1 { "is" } else { "are" }
            )
        })
    }

    fn places(&self, touches: &[usize]) -> Vec<[f64; 3]> {
        touches.iter().map(|&t| self.lessons.places_mm[t]).collect()
    }

    fn known(&self, touches: &[usize], outputs: Mat<f64>) -> KnownTouches {
        KnownTouches {
            features: super::lessons::rows(&self.features, touches),
            outputs,
            groups: touches.iter().map(|&t| self.lessons.groups[t]).collect(),
        }
    }

    /// What is learned of forces, where they are known and differ.
    fn force(
        &self,
        division: &Division,
        families: &[Family],
        notes: &mut Vec<String>,
        watch: Watch,
    ) -> Result<Option<ForceEstimator>, LearningError> {
        if self.lessons.forces.is_empty() {
            return Ok(None);
        }
        let of = |touches: &[usize]| -> Vec<f64> {
            touches.iter().map(|&t| self.lessons.forces[t]).collect()
        };
        let Some(scale) = Scale::of(&of(&division.train)) else {
            notes.push("All touches are as hard: no force can be learned from them.".to_owned());
            return Ok(None);
        };
        let known = |touches: &[usize]| self.known(touches, scale.apply(&of(touches)));
        let lesson = SplitLesson {
            known: known(&division.train),
            others: known(&division.validation),
        };
        let (chosen, _) = lesson.choose(families, watch)?;
        Ok(Some(ForceEstimator {
            family: chosen.family,
            scale,
            machine: chosen.machine,
        }))
    }
}

/// What is learned from and what is chosen by.
struct SplitLesson {
    known: KnownTouches,
    others: KnownTouches,
}

/// A family with what it made of a lesson.
struct ChosenMethod {
    family: Family,
    settings: TunedMethod,
    machine: Regression,
    /// Mean error on the others, in the unit of the outputs.
    error: f64,
}

impl SplitLesson {
    /// The family that does best on the others, and how each did.
    fn choose(
        &self,
        families: &[Family],
        watch: Watch,
    ) -> Result<(ChosenMethod, Vec<(Family, f64)>), LearningError> {
        let learned: Result<Vec<Option<ChosenMethod>>, LearningError> = families
            .par_iter()
            .map(|&family| self.learn(family, watch))
            .collect();
        let learned: Vec<ChosenMethod> = learned?.into_iter().flatten().collect();
        let tried = learned.iter().map(|c| (c.family, c.error)).collect();
        let best = learned
            .into_iter()
            .min_by(|a, b| a.error.total_cmp(&b.error));
        best.map(|best| (best, tried))
            .ok_or(LearningError::Singular)
    }

    fn learn(&self, family: Family, watch: Watch) -> Result<Option<ChosenMethod>, LearningError> {
        let settings = family.search(&self.known, watch)?;
        let Some(machine) = settings.fit(&self.known, watch)? else {
            return Ok(None);
        };
        let error = mean(&self.errors(&machine));
        Ok(error.is_finite().then_some(ChosenMethod {
            family,
            settings,
            machine,
            error,
        }))
    }

    /// How far off a machine is at each of the others.
    fn errors(&self, machine: &Regression) -> Vec<f64> {
        let squared = machine.squared_distances(&self.others.features);
        lengths(&(machine.answer(&squared) - &self.others.outputs))
    }

    /// How far a chosen machine may be off.
    fn error_model(
        &self,
        chosen: &ChosenMethod,
        watch: Watch,
    ) -> Result<ErrorModel, LearningError> {
        let left = chosen.settings.left_out(&self.known, watch)?;
        let left = left.ok_or(LearningError::Singular)?;
        let machine = &chosen.machine;
        Ok(ErrorModel::learn(
            &among(&machine.points),
            &self.known.groups,
            &lengths(&left),
            &machine.squared_distances(&self.others.features),
            &self.errors(machine),
        ))
    }
}
