//! ε-support-vector regression as the paper's, its settings in units of the outputs, and searched from there.

use faer::Mat;

use super::distance::among;
use super::kernel::Kernel;
use super::lessons::{KnownTouches, lengths as norms};
use super::machine::{AnswerRule, Regression};
use super::walk::walk;
use crate::budget::{Cancelled, Watch, report};
use crate::regression::folds::Folds;
use crate::regression::kernel::gaussian;
use crate::regression::scale::USUAL_SPREAD_MM;
use crate::regression::svr::{Problem, solve};
use crate::regression::{Hyper, SvrFit, SvrParams};
use crate::statistics::mean;

/// Touches that settings are searched on.
const SEARCHED: usize = 500;
/// Parts of the cross-validation.
const FOLDS: usize = 4;
/// Factors between two settings of C, ε and γ that are tried.
const STEPS: [f64; 3] = [4.0, 4.0, 2.0];
/// Violation of the optimality conditions that is left, over the size of the outputs: a twentieth of a millimetre on
/// the bundled limb.
const TOLERANCE: f64 = 1e-3;
/// Most steps of a fit that is compared, and of the one that is kept.
const SHORT: usize = 20_000;
const LONG: usize = 200_000;

/// The paper's settings (C 20, ε 1e-6, targets in metres), for outputs of size one.
#[must_use]
pub fn paper() -> Hyper {
    const C_MM: f64 = 20e3;
    const EPSILON_MM: f64 = 1e-3;
    Hyper {
        c: C_MM / USUAL_SPREAD_MM,
        epsilon: EPSILON_MM / USUAL_SPREAD_MM,
        gamma: 2e-3,
    }
}

/// The settings whose error, cross-validated place by place, is smallest: from the paper's and from the usual ones.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn search(known: &KnownTouches, stage: &'static str, watch: Watch) -> Result<Hyper, Cancelled> {
    let some = known.thinned(SEARCHED);
    // A kernel of standardized features falls with their number.
    let usual = Hyper::default().scaled(USUAL_SPREAD_MM.recip());
    let gamma = usual.gamma * 10.0 / known.features.ncols().max(1) as f64;
    let usual = Hyper { gamma, ..usual };
    let bench = SvrFolds::new(&some);
    let mut best = (paper(), bench.error(&paper(), watch)?);
    let mut tried = 0;
    let at = |steps: [i32; 3]| Hyper {
        c: usual.c * STEPS[0].powi(steps[0]),
        epsilon: usual.epsilon * STEPS[1].powi(steps[1]),
        gamma: usual.gamma * STEPS[2].powi(steps[2]),
    };
    let (found, error) = walk(&[[0; 3]], |steps| {
        report(watch, stage, tried, 40.max(tried + 1))?;
        tried += 1;
        bench.error(&at(steps), watch)
    })?;
    if error < best.1 {
        best = (at(found), error);
    }
    Ok(best.0)
}

/// What all trials of a search share; touches in the order of their folds.
struct SvrFolds {
    squared: Vec<f64>,
    outputs: Vec<Vec<f64>>,
    folds: Folds,
}

impl SvrFolds {
    fn new(known: &KnownTouches) -> Self {
        let folds = Folds::of_groups(&dense(&known.groups), FOLDS, 0);
        let ordered = known.some(&folds.order);
        Self {
            squared: flat(&among(&ordered.features)),
            outputs: ordered
                .outputs
                .col_iter()
                .map(|c| c.iter().copied().collect())
                .collect(),
            folds,
        }
    }

    /// Residuals where each fold is held out: touches × outputs, in the order of the folds.
    fn residuals(
        &self,
        hyper: &Hyper,
        max_steps: usize,
        watch: Watch,
    ) -> Result<Mat<f64>, Cancelled> {
        let kernel = gaussian(&self.squared, hyper.gamma);
        let mut left = Mat::zeros(self.folds.order.len(), self.outputs.len());
        for part in &self.folds.parts {
            for (k, y) in self.outputs.iter().enumerate() {
                let problem = Problem {
                    kernel: &kernel,
                    y,
                    held_out: part.clone(),
                };
                let fit = solve(&problem, &params(hyper, max_steps), None, &stop(watch));
                report(watch, STAGE, 0, 1)?;
                for t in part.clone() {
                    left[(t, k)] = -fit.residuals[t];
                }
            }
        }
        Ok(left)
    }

    fn error(&self, hyper: &Hyper, watch: Watch) -> Result<f64, Cancelled> {
        Ok(mean(&norms(&self.residuals(hyper, SHORT, watch)?)))
    }
}

const STAGE: &str = "Support vectors";

/// The regression on all touches, and whether all its fits ended within their tolerance.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn fit(known: &KnownTouches, hyper: &Hyper, watch: Watch) -> Result<Regression, Cancelled> {
    let kernel = gaussian(&flat(&among(&known.features)), hyper.gamma);
    let mut fits: Vec<SvrFit> = Vec::with_capacity(known.outputs.ncols());
    for column in known.outputs.col_iter() {
        let y: Vec<f64> = column.iter().copied().collect();
        let problem = Problem {
            kernel: &kernel,
            y: &y,
            held_out: 0..0,
        };
        fits.push(solve(&problem, &params(hyper, LONG), None, &stop(watch)));
        report(watch, STAGE, fits.len(), known.outputs.ncols())?;
    }
    // exp(-γ d²) as exp(-(d/l)²/2).
    let length = (2.0 * hyper.gamma).sqrt().recip();
    let lengths = vec![length; known.features.ncols()];
    Ok(Regression {
        points: super::distance::over(&known.features, &lengths),
        lengths,
        by: AnswerRule::Kernel {
            kernel: Kernel::Gaussian,
            weights: Mat::from_fn(known.features.nrows(), fits.len(), |t, k| fits[k].beta[t]),
            bias: fits.iter().map(|f| f.bias).collect(),
        },
    })
}

/// Its residuals at touches of places that it has not learned from, by folds: touches × outputs.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn left_out(known: &KnownTouches, hyper: &Hyper, watch: Watch) -> Result<Mat<f64>, Cancelled> {
    let bench = SvrFolds::new(known);
    let ordered = bench.residuals(hyper, LONG, watch)?;
    let mut left = Mat::zeros(ordered.nrows(), ordered.ncols());
    for (place, &touch) in bench.folds.order.iter().enumerate() {
        for k in 0..ordered.ncols() {
            left[(touch, k)] = ordered[(place, k)];
        }
    }
    Ok(left)
}

fn params(hyper: &Hyper, max_steps: usize) -> SvrParams {
    SvrParams {
        c: hyper.c,
        epsilon: hyper.epsilon,
        tolerance: TOLERANCE,
        max_steps,
    }
}

fn stop(watch: Watch) -> impl Fn() -> bool + Sync {
    move || report(watch, STAGE, 0, 1).is_err()
}

/// Groups numbered anew without gaps.
fn dense(groups: &[usize]) -> Vec<usize> {
    let mut numbers = std::collections::HashMap::new();
    let number = |group: &usize| {
        let next = numbers.len();
        *numbers.entry(*group).or_insert(next)
    };
    groups.iter().map(number).collect()
}

/// A symmetric matrix as one list.
fn flat(of: &Mat<f64>) -> Vec<f64> {
    of.col_iter().flat_map(|c| c.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;

    fn known(by: f64) -> KnownTouches {
        let at = |t: usize| (t * 37 % 80) as f64 / 80.0;
        KnownTouches {
            features: Mat::from_fn(80, 2, |t, c| (3.0 * at(t) + c as f64).sin()),
            outputs: Mat::from_fn(80, 1, |t, _| by * (at(t) - 0.5)),
            groups: (0..80).map(|t| 2 * t).collect(),
        }
    }

    #[test]
    fn a_search_is_no_worse_than_the_paper_and_left_out_is_what_it_says() {
        let known = known(3.0);
        let found = search(&known, "Learning", &unwatched).unwrap();
        let bench = SvrFolds::new(&known.thinned(SEARCHED));
        let error = |hyper: &Hyper| bench.error(hyper, &unwatched).unwrap();
        assert!(error(&found) <= error(&paper()));
        let left = left_out(&known, &found, &unwatched).unwrap();
        let errors = mean(&norms(&left));
        assert!(errors < 0.05 && errors > 0.0, "{errors}");
        let machine = fit(&known, &found, &unwatched).unwrap();
        let answers = machine.answer(&machine.squared_distances(&known.features));
        assert!((&answers - &known.outputs).norm_max() < 0.1);
    }
}
