//! The free coefficients solved for all at once.

use faer::Mat;

use super::factor::Shrinking;
use super::smo::WorkingSet;
use crate::lanes::wide;

/// More free points than this are left to the pair steps.
const MOST: usize = 1200;
/// Added to the kernel's diagonal where it is singular: along what it cannot see the step then goes to
/// the nearest bound. It changes the direction of the step, never the problem.
const RIDGE: f64 = 1e-9;

/// The work of one minimization among `free` of `points`, in entries of kernel rows that pair steps
/// could have gone through instead.
pub fn cost(free: usize, points: usize) -> f64 {
    if !(2..=MOST).contains(&free) {
        return f64::INFINITY;
    }
    let free = free as f64;
    0.1 * free * free * free + free * points as f64
}

/// Moves the free coefficients to the minimum of ½ βᵀKβ - yᵀβ + ε ‖β‖₁ with their sum kept, as far as
/// signs and bounds allow: whatever meets zero or its bound on the way stays there, and the rest goes on
/// without it. Ends where it is once `stop` says so.
pub fn minimize(block: &mut WorkingSet, free: &[usize], stop: &(dyn Fn() -> bool + Sync)) {
    let m = free.len();
    let mut kernel = Mat::from_fn(m, m, |a, b| block.row(free[a])[free[b]]);
    let mut state = FreePoints {
        slope: (free.iter())
            .map(|&i| block.f[i] + block.params.epsilon * block.beta[i].signum())
            .collect(),
        beta: free.iter().map(|&i| block.beta[i]).collect(),
        c: block.params.c,
        left: (0..m).collect(),
    };
    for i in 0..m {
        kernel[(i, i)] += RIDGE;
    }
    let Some(mut factor) = Shrinking::new(&kernel) else {
        return;
    };
    while state.left.len() >= 2 && !stop() {
        let Some(direction) = state.direction(&factor) else {
            break;
        };
        let blocked = state.advance(&kernel, &direction);
        let Some(k) = blocked else {
            break;
        };
        state.left.remove(k);
        factor.remove(k);
    }
    let by: Vec<f64> = (free.iter().zip(&state.beta))
        .map(|(&i, b)| b - block.beta[i])
        .collect();
    block.shift(free, &by);
}

/// The free points, and which of them still are.
struct FreePoints {
    slope: Vec<f64>,
    beta: Vec<f64>,
    c: f64,
    left: Vec<usize>,
}

impl FreePoints {
    /// -K⁻¹(g + λ1) over the points left, with λ so that the step sums to zero.
    fn direction(&self, factor: &Shrinking) -> Option<Vec<f64>> {
        let m = self.left.len() as f64;
        let mean = self.left.iter().map(|&i| self.slope[i]).sum::<f64>() / m;
        let mut down: Vec<f64> = self.left.iter().map(|&i| mean - self.slope[i]).collect();
        let mut level = vec![1.0; self.left.len()];
        factor.solve(&mut down);
        factor.solve(&mut level);
        let shift = -down.iter().sum::<f64>() / level.iter().sum::<f64>();
        for (d, l) in down.iter_mut().zip(&level) {
            *d += shift * l;
        }
        down.iter().all(|d| d.is_finite()).then_some(down)
    }

    /// Goes along the direction until the first coefficient meets zero or its bound, at most all the
    /// way; says which one did.
    fn advance(&mut self, kernel: &Mat<f64>, direction: &[f64]) -> Option<usize> {
        let (mut reach, mut blocked) = (1.0, None);
        for (k, (&i, &d)) in self.left.iter().zip(direction).enumerate() {
            let b = self.beta[i];
            let room = if d * b < 0.0 {
                b.abs()
            } else {
                self.c - b.abs()
            };
            if room < reach * d.abs() {
                (reach, blocked) = (room / d.abs(), Some(k));
            }
        }
        for (k, (&i, &d)) in self.left.iter().zip(direction).enumerate() {
            let moved = self.beta[i] + reach * d;
            let end = if d * self.beta[i] < 0.0 {
                0.0
            } else {
                self.c.copysign(self.beta[i])
            };
            self.beta[i] = if blocked == Some(k) { end } else { moved };
            if let Some(column) = kernel.col(i).try_as_col_major() {
                add(&mut self.slope, column.as_slice(), reach * d);
            }
        }
        blocked
    }
}

wide! {
    fn add<'a>(slope: &'a mut [f64], column: &'a [f64], by: f64) {
        for (s, k) in slope.iter_mut().zip(column) {
            *s += by * k;
        }
    }
}
