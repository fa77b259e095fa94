//! ε-support-vector regression by sequential minimal optimization.
//!
//! The dual in the coefficients β = α - α*: minimize ½ βᵀKβ - yᵀβ + ε ‖β‖₁ with Σβ = 0 and |β| ≤ C.
//! Second-order working sets as in R.-E. Fan, P.-H. Chen, C.-J. Lin, JMLR 6 (2005), and shrinking as in
//! LIBSVM (C.-C. Chang and C.-J. Lin, 2011); in β each pair step can cross zero, so that α and α* of one
//! touch need no steps of their own.

/// Settings of one fit. `c` bounds the coefficients, `epsilon` and `tolerance` are in the target's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvrParams {
    pub c: f64,
    pub epsilon: f64,
    /// Largest violation of the optimality conditions at which the fit counts as converged.
    pub tolerance: f64,
    pub max_steps: usize,
}

/// A fitted model in one coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub beta: Vec<f64>,
    pub bias: f64,
    /// Value of the dual objective as LIBSVM states it (to be minimized).
    pub objective: f64,
    /// Largest violation left.
    pub gap: f64,
    pub steps: usize,
    pub converged: bool,
}

/// Curvature below this is a duplicate point: LIBSVM's τ.
const TINY: f64 = 1e-12;
/// Steps between looks at what can be shrunk.
const SHRINK_EVERY: usize = 1000;

/// Fits on a precomputed kernel matrix (n × n by rows, symmetric) to targets `y`, starting from `warm`
/// (coefficients of a similar fit, feasible for this C) or from zero.
#[must_use]
pub fn fit(kernel: &[f64], y: &[f64], params: &SvrParams, warm: Option<&[f64]>) -> Fit {
    let mut solver = Solver::new(kernel, y, params, warm);
    let (gap, steps) = solver.run();
    solver.finish(gap, steps)
}

/// Predictions from kernel rows between new points and the training points (m × n by rows).
#[must_use]
pub fn predict(fit: &Fit, kernel: &[f64]) -> Vec<f64> {
    let n = fit.beta.len();
    kernel
        .chunks_exact(n.max(1))
        .map(|row| fit.bias + row.iter().zip(&fit.beta).map(|(k, b)| k * b).sum::<f64>())
        .collect()
}

struct Solver<'a> {
    kernel: &'a [f64],
    y: &'a [f64],
    params: SvrParams,
    n: usize,
    beta: Vec<f64>,
    /// Kβ - y, kept up to date for the active points.
    f: Vec<f64>,
    active: Vec<u32>,
}

/// The pair to move: β_up grows, β_down shrinks.
struct Pair {
    up: usize,
    down: usize,
    curvature: f64,
}

impl<'a> Solver<'a> {
    fn new(kernel: &'a [f64], y: &'a [f64], params: &SvrParams, warm: Option<&[f64]>) -> Self {
        let n = y.len();
        let mut solver = Self {
            kernel,
            y,
            params: *params,
            n,
            beta: vec![0.0; n],
            f: y.iter().map(|y| -y).collect(),
            active: (0..n as u32).collect(),
        };
        if let Some(warm) = warm.filter(|w| w.len() == n) {
            let c = params.c;
            solver.beta = warm.iter().map(|b| b.clamp(-c, c)).collect();
            solver.balance();
            solver.recompute(&(0..n as u32).collect::<Vec<_>>());
        }
        solver
    }

    /// Restores Σβ = 0 after clamping or rounding.
    fn balance(&mut self) {
        let mut excess: f64 = self.beta.iter().sum();
        let c = self.params.c;
        for b in &mut self.beta {
            let moved = (*b - excess).clamp(-c, c);
            excess -= *b - moved;
            *b = moved;
            if excess == 0.0 {
                break;
            }
        }
    }

    fn row(&self, i: usize) -> &'a [f64] {
        &self.kernel[i * self.n..][..self.n]
    }

    fn recompute(&mut self, points: &[u32]) {
        let support: Vec<usize> = (0..self.n).filter(|&j| self.beta[j] != 0.0).collect();
        for &i in points {
            let row = self.row(i as usize);
            let sum: f64 = support.iter().map(|&j| row[j] * self.beta[j]).sum();
            self.f[i as usize] = sum - self.y[i as usize];
        }
    }

    /// Slope of the objective when β_i grows; infinite at the upper bound.
    fn slope_up(&self, i: usize) -> f64 {
        let b = self.beta[i];
        if b >= self.params.c {
            f64::INFINITY
        } else {
            self.f[i] + if b >= 0.0 { self.params.epsilon } else { -self.params.epsilon }
        }
    }

    /// Slope of the objective, seen from below, when β_i shrinks; minus infinity at the lower bound.
    fn slope_down(&self, i: usize) -> f64 {
        let b = self.beta[i];
        if b <= -self.params.c {
            f64::NEG_INFINITY
        } else {
            self.f[i] + if b > 0.0 { self.params.epsilon } else { -self.params.epsilon }
        }
    }

    fn run(&mut self) -> (f64, usize) {
        let mut steps = 0;
        loop {
            let (gap, pair) = self.select();
            let done = gap <= self.params.tolerance || pair.is_none();
            if done && self.active.len() < self.n {
                self.unshrink();
                continue;
            }
            let Some(pair) = pair.filter(|_| !done && steps < self.params.max_steps) else {
                if self.active.len() < self.n {
                    self.unshrink();
                    return (self.select().0, steps);
                }
                return (gap, steps);
            };
            self.step(&pair);
            steps += 1;
            if steps.is_multiple_of(SHRINK_EVERY) && gap < 1e3 * self.params.tolerance {
                self.shrink();
            }
        }
    }

    /// The steepest point to grow and, for it, the point to shrink that promises the most.
    fn select(&self) -> (f64, Option<Pair>) {
        let mut up = usize::MAX;
        let mut lowest = f64::INFINITY;
        for &i in &self.active {
            let slope = self.slope_up(i as usize);
            if slope < lowest {
                lowest = slope;
                up = i as usize;
            }
        }
        if up == usize::MAX {
            return (0.0, None);
        }
        let row = self.row(up);
        let own = row[up];
        let mut highest = f64::NEG_INFINITY;
        let mut best: Option<Pair> = None;
        let mut best_gain = 0.0;
        for &j in &self.active {
            let j = j as usize;
            let slope = self.slope_down(j);
            highest = highest.max(slope);
            let difference = slope - lowest;
            if difference > 0.0 {
                let curvature = (own + self.kernel[j * self.n + j] - 2.0 * row[j]).max(TINY);
                let gain = difference * difference / curvature;
                if gain > best_gain {
                    best_gain = gain;
                    best = Some(Pair {
                        up,
                        down: j,
                        curvature,
                    });
                }
            }
        }
        (highest - lowest, best)
    }

    /// Exact minimum along the pair's direction: a parabola with a kink where either coefficient
    /// crosses zero, up to the bounds.
    fn step(&mut self, pair: &Pair) {
        let (i, j) = (pair.up, pair.down);
        let (bi, bj) = (self.beta[i], self.beta[j]);
        let limit = (self.params.c - bi).min(self.params.c + bj);
        let mut slope = self.slope_up(i) - self.slope_down(j);
        let mut at = 0.0;
        let mut kinks = [if bi < 0.0 { -bi } else { f64::INFINITY }, if bj > 0.0 { bj } else { f64::INFINITY }];
        kinks.sort_by(f64::total_cmp);
        let mut step = limit;
        for kink in kinks.into_iter().chain([f64::INFINITY]) {
            let end = kink.min(limit);
            let minimum = at - slope / pair.curvature;
            if minimum <= end {
                step = minimum.max(at);
                break;
            }
            if end >= limit {
                break;
            }
            // Past a kink the slope has grown by the parabola and by 2ε.
            slope += pair.curvature * (end - at) + 2.0 * self.params.epsilon;
            at = end;
            if slope >= 0.0 {
                step = at;
                break;
            }
        }
        self.beta[i] = snap(bi + step, self.params.c);
        self.beta[j] = snap(bj - step, self.params.c);
        let (ri, rj) = (self.row(i), self.row(j));
        if self.active.len() == self.n {
            for ((f, a), b) in self.f.iter_mut().zip(ri).zip(rj) {
                *f += step * (a - b);
            }
        } else {
            for &k in &self.active {
                let k = k as usize;
                self.f[k] += step * (ri[k] - rj[k]);
            }
        }
    }

    /// Leaves out points that sit at a bound or at zero and pull nowhere.
    fn shrink(&mut self) {
        let lowest = self.active.iter().map(|&i| self.slope_up(i as usize)).fold(f64::INFINITY, f64::min);
        let highest = self.active.iter().map(|&i| self.slope_down(i as usize)).fold(f64::NEG_INFINITY, f64::max);
        let c = self.params.c;
        let mut active = std::mem::take(&mut self.active);
        active.retain(|&i| {
            let i = i as usize;
            let b = self.beta[i];
            let fixed = b == 0.0 || b.abs() >= c;
            !(fixed && self.slope_up(i) > highest && self.slope_down(i) < lowest)
        });
        self.active = active;
    }

    fn unshrink(&mut self) {
        let mut left_out = vec![true; self.n];
        for &i in &self.active {
            left_out[i as usize] = false;
        }
        let points: Vec<u32> = (0..self.n as u32).filter(|&i| left_out[i as usize]).collect();
        self.recompute(&points);
        self.active = (0..self.n as u32).collect();
    }

    fn finish(self, gap: f64, steps: usize) -> Fit {
        let epsilon = self.params.epsilon;
        let (mut sum, mut free) = (0.0, 0usize);
        for i in 0..self.n {
            if self.beta[i] != 0.0 && self.beta[i].abs() < self.params.c {
                sum += self.f[i] + epsilon * self.beta[i].signum();
                free += 1;
            }
        }
        let bias = if free > 0 {
            -sum / free as f64
        } else {
            let lowest = (0..self.n).map(|i| self.slope_up(i)).fold(f64::INFINITY, f64::min);
            let highest = (0..self.n).map(|i| self.slope_down(i)).fold(f64::NEG_INFINITY, f64::max);
            if lowest.is_finite() && highest.is_finite() {
                -f64::midpoint(lowest, highest)
            } else {
                0.0
            }
        };
        // ½ βᵀKβ - yᵀβ = ½ βᵀ(f - y).
        let objective = (0..self.n)
            .map(|i| 0.5 * self.beta[i] * (self.f[i] - self.y[i]) + epsilon * self.beta[i].abs())
            .sum();
        Fit {
            converged: gap <= self.params.tolerance,
            beta: self.beta,
            bias,
            objective,
            gap: gap.max(0.0),
            steps,
        }
    }
}

/// Bounds and zero are met exactly, so that comparing with them is safe.
fn snap(beta: f64, c: f64) -> f64 {
    if beta.abs() < 1e-14 * c {
        0.0
    } else if beta >= c * (1.0 - 1e-14) {
        c
    } else if beta <= -c * (1.0 - 1e-14) {
        -c
    } else {
        beta
    }
}
