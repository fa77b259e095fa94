//! What is learned from, and how it is divided.

use faer::Mat;

use crate::budget::Cancelled;
use crate::dataset::SignalMatrix;
use crate::plain;
use crate::regression::folds::{Folds, evenly, number_of};

/// Measured touches.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredTouches<'a> {
    /// Readings, channels × touches, in any unit.
    pub x: &'a SignalMatrix,
    /// Where each touch was (mm).
    pub places_mm: &'a [[f64; 3]],
    /// How hard each was (N); empty where nobody knows.
    pub forces: &'a [f64],
    /// The group of each, numbered from zero without gaps: none is divided between learning and judging.
    pub groups: &'a [usize],
}

/// Why nothing can be learned.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LearningError {
    /// Too few places to divide.
    #[error(
        "{} too few to learn from, to choose by and to judge on: at least {least} are needed (touches at one place count once)",
        plain::either(*.places, "place is", "places are")
    )]
    TooFewPlaces {
        /// Places there are.
        places: usize,
        /// Places needed.
        least: usize,
    },
    /// Too few presses to bring an estimator up to date by.
    #[error(
        "{} too few to bring an estimator up to date by: at least {least} are needed (presses at one place count once)",
        plain::either(*.places, "place is", "places are")
    )]
    TooFewPresses {
        /// Places there are.
        places: usize,
        /// Places needed.
        least: usize,
    },
    /// Fewer training touches than asked for.
    #[error(
        "--train-touches {asked}: eight tenths of the places have only {}",
        plain::either(*.available, "touch", "touches")
    )]
    TooFewTouches {
        /// Touches asked for.
        asked: usize,
        /// Training touches there are.
        available: usize,
    },
    /// No channel varies.
    #[error(
        "every channel reads the same under every touch: there is nothing to learn from. Check the board, and what X holds"
    )]
    NoSignal,
    /// All places are one.
    #[error("all touches that are learned from lie at one place: there is nothing to tell apart")]
    OnePlace,
    /// All touches are as hard.
    #[error("no estimator could be made of these touches: their readings are alike to rounding")]
    Singular,
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Places that are needed: a tenth of them is two to judge on.
pub const LEAST_PLACES: usize = 20;
/// Parts of a division: one is judged on, one is chosen by, the others are learned from.
const PARTS: usize = 10;

/// Which touches are learned from, chosen by and judged on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Division {
    /// In an order drawn by the seed, so that the first ones are a draw too.
    pub train: Vec<usize>,
    /// Touches that estimators are chosen by.
    pub validation: Vec<usize>,
    /// Touches that only the last word is said of.
    pub test: Vec<usize>,
}

impl Division {
    /// 80/10/10 by groups, drawn by a seed; of those to learn from only `most`, if that is said. Fewer are always
    /// among more, and validation and test stay as they are.
    ///
    /// # Errors
    /// [`LearningError`] for too few groups, or fewer touches to learn from than asked for.
    pub fn draw(groups: &[usize], seed: u64, most: Option<usize>) -> Result<Self, LearningError> {
        let places = number_of(groups);
        if places < LEAST_PLACES {
            return Err(LearningError::TooFewPlaces {
                places,
                least: LEAST_PLACES,
            });
        }
        let folds = Folds::of_groups(groups, PARTS, seed);
        let part = |k: usize| folds.order[folds.parts[k].clone()].to_vec();
        let mut train = folds.order[folds.parts[2].start..].to_vec();
        if let Some(asked) = most {
            let available = train.len();
            if asked > available {
                return Err(LearningError::TooFewTouches { asked, available });
            }
            train.truncate(asked);
        }
        Ok(Self {
            train,
            validation: part(1),
            test: part(0),
        })
    }
}

/// Known touches as a regression sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownTouches {
    /// Touches × features.
    pub features: Mat<f64>,
    /// Touches × outputs.
    pub outputs: Mat<f64>,
    /// The group of each touch: none is divided between learning and judging.
    pub groups: Vec<usize>,
}

impl KnownTouches {
    /// At most so many of the touches, evenly spaced: they come in no order.
    #[must_use]
    pub fn thinned(&self, most: usize) -> Self {
        self.some(&evenly(self.groups.len(), most))
    }

    /// Some of the touches, in the order given.
    #[must_use]
    pub fn some(&self, touches: &[usize]) -> Self {
        Self {
            features: rows(&self.features, touches),
            outputs: rows(&self.outputs, touches),
            groups: touches.iter().map(|&t| self.groups[t]).collect(),
        }
    }
}

/// A matrix of touches × channels, from channels × touches.
#[must_use]
pub fn columns(x: &SignalMatrix) -> Mat<f64> {
    Mat::from_fn(x.columns(), x.rows(), |t, c| x.row(c)[t])
}

/// Some of the rows of a matrix, in the order given.
#[must_use]
pub fn rows(of: &Mat<f64>, chosen: &[usize]) -> Mat<f64> {
    Mat::from_fn(chosen.len(), of.ncols(), |t, c| of[(chosen[t], c)])
}

/// Euclidean lengths of the rows of a matrix.
#[must_use]
pub fn lengths(of: &Mat<f64>) -> Vec<f64> {
    let length = |t: usize| {
        let squares = (0..of.ncols()).map(|c| of[(t, c)] * of[(t, c)]);
        squares.sum::<f64>().sqrt()
    };
    (0..of.nrows()).map(length).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_of_a_place_are_never_divided_and_all_are_used() {
        let groups: Vec<usize> = (0..400).map(|t| t * 7 % 80).collect();
        let drawn = Division::draw(&groups, 4, None).unwrap();
        let of = |touches: &[usize]| -> std::collections::HashSet<usize> {
            touches.iter().map(|&t| groups[t]).collect()
        };
        let sets = [of(&drawn.train), of(&drawn.validation), of(&drawn.test)];
        assert_eq!(
            sets.each_ref().map(std::collections::HashSet::len),
            [64, 8, 8]
        );
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            assert!(sets[a].is_disjoint(&sets[b]));
        }
        assert_eq!(drawn, Division::draw(&groups, 4, None).unwrap());
        assert_ne!(drawn, Division::draw(&groups, 5, None).unwrap());
    }

    #[test]
    fn a_point_of_a_learning_curve_is_a_part_of_the_next() {
        let groups: Vec<usize> = (0..200).collect();
        let all = Division::draw(&groups, 1, None).unwrap();
        let some = Division::draw(&groups, 1, Some(50)).unwrap();
        assert_eq!(some.train, all.train[..50]);
        assert_eq!(some.test, all.test);
        let said = Division::draw(&groups, 1, Some(161)).unwrap_err();
        assert!(said.to_string().contains("160 touches"), "{said}");
        let said = Division::draw(&groups[..19], 1, None).unwrap_err();
        assert!(said.to_string().contains("at least 20"), "{said}");
    }
}
