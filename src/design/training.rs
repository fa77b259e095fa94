//! Training on presses of a part that there is a model of: regressions and matching learn from the same touches, are chosen by
//! the same others, and the last word is said on the same third ones.

use super::taught::{PressLessons, Taught};
use crate::budget::Watch;
use crate::dataset::SignalMatrix;
use crate::learning::lessons::Division;
use crate::learning::still::over_radius;
use crate::learning::train::MethodTrial;
use crate::learning::{
    ByModel, Estimate, Family, LearningError, MeasuredTouches, Method, Scores, TouchEstimator,
    TrainedEstimator, TrainingRequest, train,
};
use crate::regression::tune::distances;
use crate::statistics::{mean, midpoint_median};

/// An estimator that was learned.
#[derive(Clone)]
pub enum Learned {
    /// From readings alone.
    Regression(Box<TouchEstimator>),
    /// With a model of the part.
    Matching(Box<Taught>),
}

impl std::fmt::Debug for Learned {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let kind = match self {
            Self::Regression(_) => "Regression",
            Self::Matching(_) => "Matching",
        };
        write!(f, "{kind} of {} channels", self.channels())
    }
}

impl Learned {
    /// How many channels a reading has.
    #[must_use]
    pub fn channels(&self) -> usize {
        match self {
            Self::Regression(estimator) => estimator.channels(),
            Self::Matching(taught) => taught.channels(),
        }
    }

    /// Errors over the radius, of touches that were left out when it learned.
    #[must_use]
    pub fn known_ratios(&self) -> Vec<f64> {
        match self {
            Self::Regression(estimator) => estimator.known_ratios(),
            Self::Matching(taught) => taught.ratios.clone(),
        }
    }

    /// What readings (channels × touches, in the unit that was learned from) say, touch by touch.
    #[must_use]
    pub fn find(&self, x: &SignalMatrix) -> Vec<Estimate> {
        match self {
            Self::Regression(estimator) => estimator.find(x),
            Self::Matching(taught) => taught.find(x),
        }
    }
}

/// What came of a training.
pub struct TrainingOutcome {
    /// The estimator that was chosen.
    pub estimator: Learned,
    /// How it answers.
    pub method: Method,
    /// What finds forces, where they were learned by a regression.
    pub force: Option<Family>,
    /// Every method's error on the validation touches.
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

/// Who is tried.
pub struct TrialMethods<'a> {
    /// Regressions: the one that is asked for, or all.
    pub regressions: bool,
    /// Matching in these ways, by presses of a part that there is a model of.
    pub model: Option<(&'a PressLessons<'a>, &'a [ByModel])>,
}

/// Trains on measured touches; of all candidates the one is taken that does best on the validation touches: by the mean of its
/// errors, and of two whose means differ by no more than chance lets them by the median.
///
/// # Errors
/// [`LearningError`] for touches that nothing can be learned from, or when the watch asks for a stop.
pub fn train_all(
    lessons: &MeasuredTouches,
    asked: &TrainingRequest,
    candidates: &TrialMethods,
    watch: Watch,
) -> Result<TrainingOutcome, LearningError> {
    let alone = (candidates.regressions).then(|| train(lessons, asked, watch));
    let mut best: Option<TrainingOutcome> =
        match alone {
            // With a model more can be learned than without.
            Some(Err(
                LearningError::NoSignal | LearningError::OnePlace | LearningError::Singular,
            )) if candidates.model.is_some() => None,
            alone => alone.transpose()?.map(Into::into),
        };
    let Some((presses, ways)) = candidates.model else {
        return best.ok_or(LearningError::Singular);
    };
    let division = Division::draw(lessons.groups, asked.seed, asked.train_touches)?;
    let of = |touches: &[usize]| -> Vec<[f64; 3]> {
        touches.iter().map(|&t| lessons.places_mm[t]).collect()
    };
    let truth = of(&division.validation);
    let off = |answers: &[Estimate]| errors(answers, &truth);
    let x = lessons.x.select_columns(&division.validation);
    let mut leading = (best.as_ref()).map(|best| off(&best.estimator.find(&x)));
    let mut tried = best.as_ref().map_or(Vec::new(), |b| b.tried.clone());
    for &way in ways {
        let mut taught = presses.teach(&division.train, way, watch)?;
        let answers = taught.find(&x);
        let found = off(&answers);
        let validation_mm = mean(&found);
        taught.ratios = over_radius(&answers, &truth);
        let method = Method::Model(way);
        tried.push(MethodTrial {
            estimator: method,
            validation_mm,
        });
        if leading.as_ref().is_some_and(|led| !is_nearer(&found, led)) {
            continue;
        }
        leading = Some(found);
        let forces: Vec<f64> = division.test.iter().map(|&t| lessons.forces[t]).collect();
        let answers = taught.find(&lessons.x.select_columns(&division.test));
        best = Some(TrainingOutcome {
            scores: Scores::of(&answers, &of(&division.test), &forces),
            estimator: Learned::Matching(Box::new(taught)),
            method,
            force: None,
            tried: Vec::new(),
            validation_mm,
            division: division.clone(),
            notes: Vec::new(),
        });
    }
    let best = best.ok_or(LearningError::Singular)?;
    Ok(TrainingOutcome { tried, ..best })
}

fn errors(answers: &[Estimate], places_mm: &[[f64; 3]]) -> Vec<f64> {
    let said: Vec<[f64; 3]> = answers.iter().map(|a| a.place_mm).collect();
    distances(&said, places_mm)
}

/// Whether one estimator is off by less than another, by their errors on the same touches. By the mean, where the means differ by
/// more than chance lets them; else by the middle one, for a mean may hang on one touch that no gauge feels.
fn is_nearer(one: &[f64], other: &[f64]) -> bool {
    let differences: Vec<f64> = one.iter().zip(other).map(|(a, b)| a - b).collect();
    let middle = mean(&differences);
    let squares = differences.iter().map(|d| (d - middle).powi(2));
    let count = differences.len() as f64;
    let chance = (squares.sum::<f64>() / (count - 1.0).max(1.0) / count).sqrt();
    if middle.abs() > chance {
        return middle < 0.0;
    }
    let median = |of: &[f64]| midpoint_median(of.to_vec());
    median(one) < median(other)
}

impl From<TrainedEstimator> for TrainingOutcome {
    fn from(trained: TrainedEstimator) -> Self {
        Self {
            force: trained.estimator.force.as_ref().map(|f| f.family),
            estimator: Learned::Regression(Box::new(trained.estimator)),
            method: trained.family.into(),
            tried: trained.tried,
            scores: trained.scores,
            validation_mm: trained.validation_mm,
            division: trained.division,
            notes: trained.notes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_touch_that_nobody_feels_decides_nothing() {
        let old = [0.5, 0.6, 0.7, 0.4, 30.0, 0.5];
        let nearer = [0.2, 0.3, 0.3, 0.2, 34.0, 0.2];
        assert!(is_nearer(&nearer, &old) && !is_nearer(&old, &nearer));
        // What is better everywhere is so by the mean.
        let best = old.map(|e| 0.9 * e - 0.1);
        assert!(is_nearer(&best, &old) && !is_nearer(&old, &best));
        assert!(!is_nearer(&old, &old));
    }
}
