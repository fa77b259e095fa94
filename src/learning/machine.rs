//! A fitted regression: known touches, and what is made of how near they are.

use faer::Mat;

use super::distance::{nearest, over, squared};
use super::kernel::Kernel;

/// A regression with one or more outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// What each feature is divided by before distances are taken.
    pub lengths: Vec<f64>,
    /// Known touches × features, over the lengths.
    pub points: Mat<f64>,
    /// How they answer.
    pub by: AnswerRule,
}

/// How known touches answer.
#[derive(Clone, Debug, PartialEq)]
pub enum AnswerRule {
    /// A sum of kernels.
    Kernel {
        /// Of the distance over the lengths.
        kernel: Kernel,
        /// Touches × outputs.
        weights: Mat<f64>,
        /// One an output.
        bias: Vec<f64>,
    },
    /// The mean of the nearest, weighted by one over their distance.
    Nearest {
        /// Touches × outputs.
        outputs: Mat<f64>,
        /// How many are averaged.
        count: usize,
    },
}

impl Regression {
    /// Squared distances, over the lengths, of touches (× features) to the known ones: touches × known.
    #[must_use]
    pub fn squared_distances(&self, features: &Mat<f64>) -> Mat<f64> {
        squared(&over(features, &self.lengths), &self.points)
    }

    /// The outputs of touches at these squared distances: touches × outputs.
    #[must_use]
    pub fn answer(&self, squared: &Mat<f64>) -> Mat<f64> {
        match &self.by {
            AnswerRule::Kernel {
                kernel,
                weights,
                bias,
            } => {
                let sums = kernel.of(squared.clone()) * weights;
                Mat::from_fn(sums.nrows(), sums.ncols(), |t, k| sums[(t, k)] + bias[k])
            }
            AnswerRule::Nearest { outputs, count } => {
                let mut answers = Mat::zeros(squared.nrows(), outputs.ncols());
                for t in 0..squared.nrows() {
                    let near = nearest((0..).zip(squared.row(t).iter().copied()), *count);
                    for (k, value) in mean_of(outputs, &near).into_iter().enumerate() {
                        answers[(t, k)] = value;
                    }
                }
                answers
            }
        }
    }
}

/// The mean of known outputs at some touches with their squared distances, weighted by one over the distance.
#[must_use]
pub fn mean_of(outputs: &Mat<f64>, near: &[(usize, f64)]) -> Vec<f64> {
    // A touch that is the same as a known one has its answer.
    let weight = |squared: f64| squared.sqrt().max(1e-12).recip();
    let total: f64 = near.iter().map(|n| weight(n.1)).sum();
    let mean = |k: usize| {
        let sum: f64 = (near.iter())
            .map(|&(i, squared)| weight(squared) * outputs[(i, k)])
            .sum();
        sum / total
    };
    (0..outputs.ncols()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_answer_by_how_near_they_are() {
        let machine = Regression {
            lengths: vec![2.0],
            points: Mat::from_fn(4, 1, |i, _| i as f64),
            by: AnswerRule::Nearest {
                outputs: Mat::from_fn(4, 1, |i, _| 10.0 * i as f64),
                count: 2,
            },
        };
        let ask = |at: f64| {
            let squared = machine.squared_distances(&Mat::from_fn(1, 1, |_, _| at));
            machine.answer(&squared)[(0, 0)]
        };
        assert!((ask(2.5) - 12.5).abs() < 1e-9, "{}", ask(2.5));
        assert!((ask(4.0) - 20.0).abs() < 1e-6);
    }
}
