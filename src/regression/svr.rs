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

/// State of the active points lies together in memory, in the order of `active`; what is left out keeps
/// only its coefficient.
struct Solver<'a> {
    kernel: &'a [f64],
    diagonal: Vec<f64>,
    y: &'a [f64],
    params: SvrParams,
    n: usize,
    /// Coefficients by point.
    beta: Vec<f64>,
    active: Vec<u32>,
    /// Kβ - y of the active points.
    f: Vec<f64>,
    /// f plus these is the slope when the coefficient grows (∞ at the upper bound) …
    up: Vec<f64>,
    /// … and when it shrinks (-∞ at the lower bound).
    down: Vec<f64>,
    gains: Vec<f64>,
}

/// The pair to move, by place among the active points: `β_grow` grows, `β_shrink` shrinks.
struct Pair {
    grow: usize,
    shrink: usize,
}

impl<'a> Solver<'a> {
    fn new(kernel: &'a [f64], y: &'a [f64], params: &SvrParams, warm: Option<&[f64]>) -> Self {
        let n = y.len();
        let mut solver = Self {
            kernel,
            diagonal: (0..n).map(|i| kernel[i * n + i]).collect(),
            y,
            params: *params,
            n,
            beta: vec![0.0; n],
            active: Vec::new(),
            f: Vec::new(),
            up: Vec::new(),
            down: Vec::new(),
            gains: vec![0.0; n],
        };
        if let Some(warm) = warm.filter(|w| w.len() == n) {
            let c = params.c;
            solver.beta = warm.iter().map(|b| b.clamp(-c, c)).collect();
            solver.balance();
        }
        solver.activate_all();
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

    /// Makes every point active, computing anew what was left out.
    fn activate_all(&mut self) {
        let mut known = vec![None; self.n];
        for (&i, &f) in self.active.iter().zip(&self.f) {
            known[i as usize] = Some(f);
        }
        let support: Vec<usize> = (0..self.n).filter(|&j| self.beta[j] != 0.0).collect();
        self.f = (0..self.n)
            .map(|i| {
                known[i].unwrap_or_else(|| {
                    let row = self.row(i);
                    support.iter().map(|&j| row[j] * self.beta[j]).sum::<f64>() - self.y[i]
                })
            })
            .collect();
        self.active = (0..self.n as u32).collect();
        (self.up, self.down) = (0..self.n).map(|i| self.offsets(i)).unzip();
    }

    /// What is added to f for the slopes of growing and shrinking a point's coefficient.
    fn offsets(&self, point: usize) -> (f64, f64) {
        let (b, c, e) = (self.beta[point], self.params.c, self.params.epsilon);
        let up = if b >= c {
            f64::INFINITY
        } else if b >= 0.0 {
            e
        } else {
            -e
        };
        let down = if b <= -c {
            f64::NEG_INFINITY
        } else if b > 0.0 {
            e
        } else {
            -e
        };
        (up, down)
    }

    fn run(&mut self) -> (f64, usize) {
        let mut steps = 0;
        loop {
            let (gap, pair) = self.select();
            let ended = gap <= self.params.tolerance || steps >= self.params.max_steps;
            match pair.filter(|_| !ended) {
                Some(pair) => {
                    self.step(&pair);
                    steps += 1;
                    if steps.is_multiple_of(SHRINK_EVERY) {
                        self.shrink();
                    }
                }
                None if self.active.len() < self.n => {
                    self.activate_all();
                    if steps >= self.params.max_steps {
                        return (self.select().0, steps);
                    }
                }
                None => return (gap, steps),
            }
        }
    }

    /// The largest violation, and the steepest point to grow with, for it, the point to shrink that
    /// promises the most.
    fn select(&mut self) -> (f64, Option<Pair>) {
        let lowest = minimum(self.f.iter().zip(&self.up).map(|(f, u)| f + u));
        if lowest == f64::INFINITY {
            return (0.0, None);
        }
        let Some(grow) = self
            .f
            .iter()
            .zip(&self.up)
            .position(|(f, u)| f + u <= lowest)
        else {
            return (0.0, None);
        };
        let point = self.active[grow] as usize;
        let (row, own) = (self.row(point), self.diagonal[point]);
        let whole = self.active.len() == self.n;
        let gains = &mut self.gains[..self.active.len()];
        let gain = |f: f64, down: f64, diagonal: f64, k: f64| {
            let difference = (f + down - lowest).max(0.0);
            difference * difference / (own + diagonal - 2.0 * k).max(TINY)
        };
        if whole {
            for (((g, f), d), (q, k)) in gains
                .iter_mut()
                .zip(&self.f)
                .zip(&self.down)
                .zip(self.diagonal.iter().zip(row))
            {
                *g = gain(*f, *d, *q, *k);
            }
        } else {
            for (((g, f), d), &i) in gains
                .iter_mut()
                .zip(&self.f)
                .zip(&self.down)
                .zip(&self.active)
            {
                *g = gain(*f, *d, self.diagonal[i as usize], row[i as usize]);
            }
        }
        let highest = -minimum(self.f.iter().zip(&self.down).map(|(f, d)| -(f + d)));
        let best = -minimum(gains.iter().map(|g| -g));
        let pair = gains
            .iter()
            .position(|&g| g >= best)
            .filter(|_| best > 0.0)
            .map(|shrink| Pair { grow, shrink });
        (highest - lowest, pair)
    }

    /// Exact minimum along the pair's direction: a parabola with a kink where either coefficient
    /// crosses zero, up to the bounds.
    fn step(&mut self, pair: &Pair) {
        let [i, j] = [pair.grow, pair.shrink].map(|k| self.active[k] as usize);
        let (ri, rj) = (self.row(i), self.row(j));
        let line = Line {
            slope: self.f[pair.grow] + self.up[pair.grow]
                - self.f[pair.shrink]
                - self.down[pair.shrink],
            curvature: (self.diagonal[i] + self.diagonal[j] - 2.0 * ri[j]).max(TINY),
            kinks: [-self.beta[i], self.beta[j]],
            jump: 2.0 * self.params.epsilon,
            limit: (self.params.c - self.beta[i]).min(self.params.c + self.beta[j]),
        };
        let step = line.minimum();
        self.beta[i] = snap(self.beta[i] + step, self.params.c);
        self.beta[j] = snap(self.beta[j] - step, self.params.c);
        if self.active.len() == self.n {
            for ((f, a), b) in self.f.iter_mut().zip(ri).zip(rj) {
                *f += step * (a - b);
            }
        } else {
            for (f, &k) in self.f.iter_mut().zip(&self.active) {
                *f += step * (ri[k as usize] - rj[k as usize]);
            }
        }
        for (place, point) in [(pair.grow, i), (pair.shrink, j)] {
            (self.up[place], self.down[place]) = self.offsets(point);
        }
    }

    /// Leaves out points that sit at a bound or at zero and pull nowhere.
    fn shrink(&mut self) {
        let lowest = minimum(self.f.iter().zip(&self.up).map(|(f, u)| f + u));
        let highest = -minimum(self.f.iter().zip(&self.down).map(|(f, d)| -(f + d)));
        let c = self.params.c;
        let keep: Vec<usize> = (0..self.active.len())
            .filter(|&k| {
                let b = self.beta[self.active[k] as usize];
                let fixed = b == 0.0 || b.abs() >= c;
                let idle = self.f[k] + self.up[k] > highest && self.f[k] + self.down[k] < lowest;
                !(fixed && idle)
            })
            .collect();
        if keep.len() < self.active.len() {
            self.active = keep.iter().map(|&k| self.active[k]).collect();
            for list in [&mut self.f, &mut self.up, &mut self.down] {
                *list = keep.iter().map(|&k| list[k]).collect();
            }
        }
    }

    fn finish(self, gap: f64, steps: usize) -> Fit {
        let epsilon = self.params.epsilon;
        let (mut sum, mut free) = (0.0, 0usize);
        for (b, f) in self.beta.iter().zip(&self.f) {
            if *b != 0.0 && b.abs() < self.params.c {
                sum += f + epsilon * b.signum();
                free += 1;
            }
        }
        let bias = if free > 0 {
            -sum / free as f64
        } else {
            let lowest = minimum(self.f.iter().zip(&self.up).map(|(f, u)| f + u));
            let highest = -minimum(self.f.iter().zip(&self.down).map(|(f, d)| -(f + d)));
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

/// A convex function along a pair's direction: a parabola that gains slope at each kink.
struct Line {
    slope: f64,
    curvature: f64,
    /// Only those ahead (above zero) count.
    kinks: [f64; 2],
    jump: f64,
    limit: f64,
}

impl Line {
    fn minimum(&self) -> f64 {
        let mut kinks = self.kinks.map(|k| if k > 0.0 { k } else { f64::INFINITY });
        kinks.sort_by(f64::total_cmp);
        let (mut at, mut slope) = (0.0, self.slope);
        for end in kinks.into_iter().chain([f64::INFINITY]) {
            let minimum = at - slope / self.curvature;
            if minimum <= end {
                return minimum.clamp(at, self.limit.max(at));
            }
            if end >= self.limit {
                break;
            }
            slope += self.curvature * (end - at) + self.jump;
            at = end;
            if slope >= 0.0 {
                return at;
            }
        }
        self.limit
    }
}

/// Smallest of the values, in lanes that the processor can take together.
fn minimum(values: impl Iterator<Item = f64>) -> f64 {
    const LANES: usize = 8;
    let mut lanes = [f64::INFINITY; LANES];
    for (k, v) in values.enumerate() {
        let lane = &mut lanes[k % LANES];
        *lane = if v < *lane { v } else { *lane };
    }
    lanes.into_iter().fold(f64::INFINITY, f64::min)
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
            let residuals = predict(&fit, &kernel);
            for i in 0..80 {
                let r = y[i] - residuals[i];
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
        assert!(!fit.converged && fit.steps == 10 && fit.gap > 1e-9);
    }

    #[test]
    fn a_step_stops_at_kinks_and_bounds() {
        let line = Line {
            slope: -3.0,
            curvature: 1.0,
            kinks: [1.0, f64::INFINITY],
            jump: 1.0,
            limit: 10.0,
        };
        assert!((line.minimum() - 2.0).abs() < 1e-15); // -3 + 1 + 1 = -1 left after the kink at 1
        assert!((Line { jump: 5.0, ..line }.minimum() - 1.0).abs() < 1e-15);
    }
}
