//! ε-support-vector regression.
//!
//! The dual in the coefficients β = α - α*: minimize ½ βᵀKβ - yᵀβ + ε ‖β‖₁ with Σβ = 0 and |β| ≤ C.
//! In β each pair step can cross zero, so that α and α* of one touch need no steps of their own.
//!
//! Three things share the work. Pairs of coefficients (`smo.rs`: second-order working sets as in R.-E.
//! Fan, P.-H. Chen, C.-J. Lin, JMLR 6, 2005) find out which coefficients lie at zero and at the bounds.
//! Those are left out (shrinking, as in C.-C. Chang and C.-J. Lin, LIBSVM, 2011), but by copying the
//! kernel of the rest into a block of its own: a step on a few hundred points then costs a tenth. What is
//! neither at zero nor at a bound is solved for all at once (`newton.rs`): smooth kernels are too
//! ill-conditioned for pairs.

mod factor;
mod newton;
mod problem;
mod smo;

use crate::tally::{self, Done};
use smo::WorkingSet;

pub use problem::{Problem, Start, SvrParams};

/// A fitted model in one coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct SvrFit {
    /// One a point; zero for those held out.
    pub beta: Vec<f64>,
    /// Added to every prediction.
    pub bias: f64,
    /// Prediction less target at every point, those held out included.
    pub residuals: Vec<f64>,
    /// Value of the dual objective as LIBSVM states it (to be minimized).
    pub objective: f64,
    /// Largest violation left.
    pub gap: f64,
    /// Steps it took.
    pub steps: usize,
    /// Whether the tolerance was met.
    pub converged: bool,
}

/// Fits all points, from `warm` (coefficients of a similar fit) or from zero.
#[must_use]
pub fn fit(kernel: &[f64], y: &[f64], params: &SvrParams, warm: Option<&[f64]>) -> SvrFit {
    let problem = Problem {
        kernel,
        y,
        held_out: 0..0,
    };
    let start = warm.map(|beta| Start { beta, f: None });
    solve(&problem, params, start, &|| false)
}

/// Fits the points that are not held out. `stop` is asked every millisecond or so; once it says yes the
/// fit ends where it is, not converged.
#[must_use]
pub fn solve(
    problem: &Problem,
    params: &SvrParams,
    start: Option<Start>,
    stop: &(dyn Fn() -> bool + Sync),
) -> SvrFit {
    tally::count(Done::Fit, 1);
    let mut block = WorkingSet::new(problem, params);
    if let Some(start) = start.filter(|s| s.beta.len() == problem.y.len()) {
        block.start(problem.y, start);
    }
    let mut effort = StepLimit {
        steps: 0,
        most: params.max_steps,
        stop,
    };
    let gap = descend(&mut block, params.tolerance, &mut effort);
    finish(&block, problem, params, gap, effort.steps)
}

/// Predictions from kernel rows between new points and the training points (m × n by rows).
#[must_use]
pub fn predict(fit: &SvrFit, kernel: &[f64]) -> Vec<f64> {
    let n = fit.beta.len();
    kernel
        .chunks_exact(n.max(1))
        .map(|row| fit.bias + row.iter().zip(&fit.beta).map(|(k, b)| k * b).sum::<f64>())
        .collect()
}

/// Steps taken so far, and what ends them.
struct StepLimit<'a> {
    steps: usize,
    most: usize,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl StepLimit<'_> {
    fn spent(&self) -> bool {
        self.steps >= self.most || (self.stop)()
    }
}

/// Steps between looks at what can be left out and what can be solved at once.
const ROUND: usize = 256;
/// A block is worth copying below this share of its parent.
const WORTH: f64 = 0.7;
/// A smaller block is first solved to this share of the violation it began with.
const PROGRESS: f64 = 0.1;

/// Lowers a block's violation to the tolerance; returns what is left of it.
fn descend(block: &mut WorkingSet, tolerance: f64, effort: &mut StepLimit) -> f64 {
    // A warm start is mostly right about who is free: it is worth solving for them before anything else.
    let mut fresh = true;
    // Work of pair steps since the free coefficients were last solved for.
    let mut work = 0.0;
    loop {
        let gap = block.gap();
        if gap <= tolerance || effort.spent() {
            return gap;
        }
        let keep = block.movable();
        if (keep.len() as f64) < WORTH * block.len() as f64 {
            let mut part = block.part(&keep);
            let wanted = tolerance.max(PROGRESS * gap);
            let before = effort.steps;
            descend(&mut part, wanted, effort);
            block.absorb(&keep, &part);
            if effort.steps > before {
                continue;
            }
        }
        let free = block.free();
        let cost = newton::cost(free.len(), block.len());
        if cost.is_finite() && (fresh || work > cost) {
            newton::minimize(block, &free, effort.stop);
            effort.steps += 1;
            (fresh, work) = (false, 0.0);
            continue;
        }
        fresh = false;
        let round = ROUND.max(block.len() / 4).min(effort.most - effort.steps);
        let taken = block.run(tolerance, round);
        effort.steps += taken;
        work += taken as f64 * block.len() as f64;
        if taken == 0 {
            return block.gap();
        }
    }
}

fn finish(
    block: &WorkingSet,
    problem: &Problem,
    params: &SvrParams,
    gap: f64,
    steps: usize,
) -> SvrFit {
    let epsilon = params.epsilon;
    let (mut sum, mut free) = (0.0, 0usize);
    for i in block.free() {
        sum += block.f[i] + epsilon * block.beta[i].signum();
        free += 1;
    }
    let bias = if free > 0 {
        -sum / free as f64
    } else {
        let (lowest, highest) = block.slopes();
        if lowest.is_finite() && highest.is_finite() {
            -f64::midpoint(lowest, highest)
        } else {
            0.0
        }
    };
    // ½ βᵀKβ - yᵀβ = ½ βᵀ(f - y).
    let objective = (block.beta.iter().zip(&block.f))
        .zip(problem.y)
        .map(|((b, f), y)| 0.5 * b * (f - y) + epsilon * b.abs())
        .sum();
    SvrFit {
        converged: gap <= params.tolerance,
        residuals: block.f.iter().map(|f| f + bias).collect(),
        beta: block.beta.clone(),
        bias,
        objective,
        gap: gap.max(0.0),
        steps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(n: usize) -> (Vec<f64>, Vec<f64>) {
        let x: Vec<f64> = (0..n).map(|i| i as f64 / n as f64 * 6.0).collect();
        let kernel = x
            .iter()
            .flat_map(|a| x.iter().map(move |b| (-(a - b) * (a - b)).exp()))
            .collect();
        let y = x.iter().map(|x| x.sin() + 0.1 * (17.0 * x).cos()).collect();
        (kernel, y)
    }

    fn params(c: f64) -> SvrParams {
        SvrParams {
            c,
            epsilon: 0.05,
            tolerance: 1e-9,
            max_steps: 1_000_000,
        }
    }

    #[test]
    fn the_optimality_conditions_hold() {
        let (kernel, y) = problem(80);
        for c in [0.1, 1.0, 10.0] {
            let fit = fit(&kernel, &y, &params(c), None);
            assert!(fit.converged && fit.gap <= 1e-9);
            assert!(fit.beta.iter().sum::<f64>().abs() < 1e-9 * c);
            let predicted = predict(&fit, &kernel);
            for i in 0..80 {
                let r = y[i] - predicted[i];
                assert!((r + fit.residuals[i]).abs() < 1e-9);
                let b = fit.beta[i];
                // Inside the tube no coefficient; on its wall a free one; beyond it the bound.
                if b == 0.0 {
                    assert!(r.abs() <= 0.05 + 1e-8);
                } else if b.abs() < c {
                    assert!((r - 0.05 * b.signum()).abs() < 1e-8);
                } else {
                    assert!(r * b.signum() >= 0.05 - 1e-8);
                }
            }
        }
    }

    #[test]
    fn points_held_out_are_predicted_and_never_learned_from() {
        let (kernel, y) = problem(80);
        let mut other = y.clone();
        for v in &mut other[20..40] {
            *v += 7.0;
        }
        let fit_with = |y: &[f64]| {
            let problem = Problem {
                kernel: &kernel,
                y,
                held_out: 20..40,
            };
            solve(&problem, &params(1.0), None, &|| false)
        };
        let (a, b) = (fit_with(&y), fit_with(&other));
        assert_eq!(a.beta, b.beta);
        assert!(a.beta[20..40].iter().all(|&b| b == 0.0));
        for i in 20..40 {
            assert!((a.residuals[i] - b.residuals[i] - 7.0).abs() < 1e-12);
        }
        // The same as a fit on the others alone.
        let rest: Vec<usize> = (0..20).chain(40..80).collect();
        let small: Vec<f64> = rest
            .iter()
            .flat_map(|&i| rest.iter().map(move |&j| (i, j)))
            .map(|(i, j)| kernel[i * 80 + j])
            .collect();
        let targets: Vec<f64> = rest.iter().map(|&i| y[i]).collect();
        let alone = fit(&small, &targets, &params(1.0), None);
        assert!((alone.objective / a.objective - 1.0).abs() < 1e-8);
    }

    #[test]
    fn a_warm_start_ends_at_the_same_place_sooner() {
        let (kernel, y) = problem(200);
        let cold = fit(&kernel, &y, &params(10.0), None);
        let near = fit(&kernel, &y, &params(8.0), None);
        let warm = fit(&kernel, &y, &params(10.0), Some(&near.beta));
        assert!((warm.objective / cold.objective - 1.0).abs() < 1e-9);
        assert!(warm.steps < cold.steps, "{} {}", warm.steps, cold.steps);
    }

    #[test]
    fn effort_is_bounded_and_said() {
        let (kernel, y) = problem(200);
        let short = SvrParams {
            max_steps: 10,
            ..params(1e6)
        };
        let fit = fit(&kernel, &y, &short, None);
        assert!(!fit.converged && fit.steps <= 11 && fit.gap > 1e-9);
    }
}
