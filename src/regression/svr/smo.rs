//! Pair steps on a block of points whose kernel lies together in memory.

#![expect(
    clippy::inline_always,
    reason = "only inlined code gets the instructions of its caller"
)]

use std::borrow::Cow;

use super::problem::{Problem, Start, SvrParams};
use crate::lanes::wide;

/// Curvature below this is a duplicate point: LIBSVM's τ.
const TINY: f64 = 1e-12;
/// Values compared side by side.
const LANES: usize = 8;

/// Points with everything that is known about them.
pub struct WorkingSet<'a> {
    kernel: Cow<'a, [f64]>,
    diagonal: Vec<f64>,
    /// C, ε and when to stop.
    pub params: SvrParams,
    /// Bound of each coefficient: C, or zero for a point that is held out.
    bound: Vec<f64>,
    /// Coefficient of each point.
    pub beta: Vec<f64>,
    /// Kβ - y.
    pub f: Vec<f64>,
    /// f plus these is the slope when the coefficient grows (∞ at the upper bound) …
    up: Vec<f64>,
    /// … and when it shrinks (-∞ at the lower bound).
    down: Vec<f64>,
}

impl<'a> WorkingSet<'a> {
    /// All points, with coefficients of zero.
    pub fn new(problem: &Problem<'a>, params: &SvrParams) -> Self {
        let n = problem.y.len();
        let bound = |i| {
            if problem.held_out.contains(&i) {
                0.0
            } else {
                params.c
            }
        };
        let mut block = Self {
            kernel: Cow::Borrowed(problem.kernel),
            diagonal: (0..n).map(|i| problem.kernel[i * n + i]).collect(),
            params: *params,
            bound: (0..n).map(bound).collect(),
            beta: vec![0.0; n],
            f: problem.y.iter().map(|y| -y).collect(),
            up: vec![0.0; n],
            down: vec![0.0; n],
        };
        block.set_offsets();
        block
    }

    /// Moves to given coefficients, clipped to the bounds and balanced to Σβ = 0.
    pub fn start(&mut self, y: &[f64], start: Start) {
        let n = self.len();
        let clip = |(b, c): (&f64, &f64)| b.clamp(-c, *c);
        self.beta = start.beta.iter().zip(&self.bound).map(clip).collect();
        self.balance();
        if let Some(f) = start.f.filter(|f| f.len() == n) {
            self.f.copy_from_slice(f);
            let moved: Vec<f64> = self
                .beta
                .iter()
                .zip(start.beta)
                .map(|(a, b)| a - b)
                .collect();
            self.add_rows(&(0..n).collect::<Vec<_>>(), &moved);
        } else {
            self.f = y.iter().map(|y| -y).collect();
            let beta = self.beta.clone();
            self.add_rows(&(0..n).collect::<Vec<_>>(), &beta);
        }
        self.set_offsets();
    }

    /// Restores Σβ = 0 after clipping or rounding.
    fn balance(&mut self) {
        let mut excess: f64 = self.beta.iter().sum();
        for (b, &c) in self.beta.iter_mut().zip(&self.bound) {
            let moved = (*b - excess).clamp(-c, c);
            excess -= *b - moved;
            *b = moved;
            if excess == 0.0 {
                break;
            }
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.f.len()
    }

    /// The kernel between a point and all of the block.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.kernel[i * self.len()..][..self.len()]
    }

    fn set_offsets(&mut self) {
        for i in 0..self.len() {
            self.set_offset(i);
        }
    }

    /// What is added to f for the slopes of growing and shrinking a point's coefficient.
    #[inline(always)]
    fn set_offset(&mut self, i: usize) {
        let (b, c, e) = (self.beta[i], self.bound[i], self.params.epsilon);
        self.up[i] = if b >= c {
            f64::INFINITY
        } else if b >= 0.0 {
            e
        } else {
            -e
        };
        self.down[i] = if b <= -c {
            f64::NEG_INFINITY
        } else if b > 0.0 {
            e
        } else {
            -e
        };
    }

    /// The flattest slope upward and the steepest downward: between them lies the violation.
    pub fn slopes(&self) -> (f64, f64) {
        let up = self.f.iter().zip(&self.up).map(|(f, u)| f + u);
        let down = self.f.iter().zip(&self.down).map(|(f, d)| f + d);
        (
            up.fold(f64::INFINITY, f64::min),
            down.fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Largest violation of the optimality conditions.
    pub fn gap(&self) -> f64 {
        let (lowest, highest) = self.slopes();
        if lowest.is_finite() && highest.is_finite() {
            highest - lowest
        } else {
            0.0
        }
    }

    /// Points that neither sit at zero nor at a bound.
    pub fn free(&self) -> Vec<usize> {
        (0..self.len())
            .filter(|&i| self.beta[i] != 0.0 && self.beta[i].abs() < self.bound[i])
            .collect()
    }

    /// Points that are free or would gain by moving; the others sit at a bound or at zero and pull
    /// nowhere.
    pub fn movable(&self) -> Vec<usize> {
        let (lowest, highest) = self.slopes();
        (0..self.len())
            .filter(|&i| {
                let b = self.beta[i];
                let fixed = b == 0.0 || b.abs() >= self.bound[i];
                let idle = self.f[i] + self.up[i] > highest && self.f[i] + self.down[i] < lowest;
                !(fixed && idle)
            })
            .collect()
    }

    /// Some of the points as a block of their own.
    pub fn part(&self, keep: &[usize]) -> WorkingSet<'static> {
        let pick = |list: &[f64]| -> Vec<f64> { keep.iter().map(|&k| list[k]).collect() };
        let mut kernel = Vec::with_capacity(keep.len() * keep.len());
        for &k in keep {
            let row = self.row(k);
            kernel.extend(keep.iter().map(|&j| row[j]));
        }
        WorkingSet {
            kernel: Cow::Owned(kernel),
            diagonal: pick(&self.diagonal),
            params: self.params,
            bound: pick(&self.bound),
            beta: pick(&self.beta),
            f: pick(&self.f),
            up: pick(&self.up),
            down: pick(&self.down),
        }
    }

    /// Takes over what a part has found.
    pub fn absorb(&mut self, keep: &[usize], part: &WorkingSet) {
        let moved: Vec<f64> = (keep.iter().zip(&part.beta))
            .map(|(&k, b)| b - self.beta[k])
            .collect();
        self.shift(keep, &moved);
    }

    /// Adds to some coefficients.
    pub fn shift(&mut self, points: &[usize], by: &[f64]) {
        for (&i, b) in points.iter().zip(by) {
            self.beta[i] = snap(self.beta[i] + b, self.bound[i]);
            self.set_offset(i);
        }
        self.add_rows(points, by);
    }

    /// f += Σ by · row of the point.
    fn add_rows(&mut self, points: &[usize], by: &[f64]) {
        let moved: Vec<(usize, f64)> = (points.iter().copied().zip(by.iter().copied()))
            .filter(|&(_, b)| b != 0.0)
            .collect();
        add_rows(&mut self.f, &self.kernel, &moved);
    }

    /// At most so many pair steps; how many there were before the violation was small enough.
    pub fn run(&mut self, tolerance: f64, most: usize) -> usize {
        run(self, tolerance, most)
    }

    #[inline(always)]
    fn steps(&mut self, tolerance: f64, most: usize) -> usize {
        for taken in 0..most {
            let Some((grow, lowest)) = least(&self.f, &self.up) else {
                return taken;
            };
            let (shrink, gain, highest) = self.partner(grow, lowest);
            if gain <= 0.0 || highest - lowest <= tolerance {
                return taken;
            }
            self.step(grow, shrink);
        }
        most
    }

    /// For the point that grows, the one to shrink that promises the most: its place, the gain, and the
    /// steepest slope of all.
    #[inline(always)]
    fn partner(&self, grow: usize, lowest: f64) -> (usize, f64, f64) {
        let n = self.len();
        let own = self.diagonal[grow];
        let mut best = [0.0; LANES];
        let mut place = [0u64; LANES];
        let mut highest = [f64::NEG_INFINITY; LANES];
        let mut at = [0u64; LANES];
        for (l, a) in at.iter_mut().enumerate() {
            *a = l as u64;
        }
        let chunks = (self
            .f
            .chunks_exact(LANES)
            .zip(self.down.chunks_exact(LANES)))
        .zip(self.diagonal.chunks_exact(LANES))
        .zip(self.row(grow).chunks_exact(LANES));
        for (((f, d), q), k) in chunks {
            for l in 0..LANES {
                let slope = f[l] + d[l];
                let difference = (slope - lowest).max(0.0);
                let gain = difference * difference / (own + q[l] - 2.0 * k[l]).max(TINY);
                highest[l] = if slope > highest[l] {
                    slope
                } else {
                    highest[l]
                };
                let better = gain > best[l];
                best[l] = if better { gain } else { best[l] };
                place[l] = if better { at[l] } else { place[l] };
                at[l] += LANES as u64;
            }
        }
        let (mut gain, mut shrink, mut top) = (0.0, 0, f64::NEG_INFINITY);
        for l in 0..LANES {
            top = highest[l].max(top);
            let wins = best[l] > gain || (best[l] == gain && gain > 0.0 && place[l] < shrink);
            if wins {
                (gain, shrink) = (best[l], place[l]);
            }
        }
        let row = self.row(grow);
        for i in n - n % LANES..n {
            let slope = self.f[i] + self.down[i];
            let difference = (slope - lowest).max(0.0);
            let promised =
                difference * difference / (own + self.diagonal[i] - 2.0 * row[i]).max(TINY);
            top = top.max(slope);
            if promised > gain {
                (gain, shrink) = (promised, i as u64);
            }
        }
        (shrink as usize, gain, top)
    }

    /// Exact minimum along the pair's direction: a parabola with a kink where either coefficient
    /// crosses zero, up to the bounds.
    #[inline(always)]
    fn step(&mut self, i: usize, j: usize) {
        let n = self.len();
        let kernel = &self.kernel;
        let (ri, rj) = (&kernel[i * n..][..n], &kernel[j * n..][..n]);
        let line = KinkedLine {
            slope: self.f[i] + self.up[i] - self.f[j] - self.down[j],
            curvature: (self.diagonal[i] + self.diagonal[j] - 2.0 * ri[j]).max(TINY),
            kinks: [-self.beta[i], self.beta[j]],
            jump: 2.0 * self.params.epsilon,
            limit: (self.bound[i] - self.beta[i]).min(self.bound[j] + self.beta[j]),
        };
        let step = line.minimum();
        self.beta[i] = snap(self.beta[i] + step, self.bound[i]);
        self.beta[j] = snap(self.beta[j] - step, self.bound[j]);
        for ((f, a), b) in self.f.iter_mut().zip(ri).zip(rj) {
            *f += step * (a - b);
        }
        self.set_offset(i);
        self.set_offset(j);
    }
}

wide! {
    fn run<'a, 'b>(block: &'a mut WorkingSet<'b>, tolerance: f64, most: usize) -> usize {
        block.steps(tolerance, most)
    }
}

wide! {
    /// Four rows at a time, so that f is not read and written for each.
    fn add_rows<'a>(f: &'a mut [f64], kernel: &'a [f64], moved: &'a [(usize, f64)]) {
        let n = f.len();
        let mut quads = moved.chunks_exact(4);
        for quad in &mut quads {
            let rows = [0, 1, 2, 3].map(|k| &kernel[quad[k].0 * n..][..n]);
            let by = [0, 1, 2, 3].map(|k| quad[k].1);
            for ((((f, a), b), c), d) in
                (f.iter_mut().zip(rows[0]).zip(rows[1]).zip(rows[2])).zip(rows[3])
            {
                *f += (by[0] * a + by[1] * b) + (by[2] * c + by[3] * d);
            }
        }
        for &(i, b) in quads.remainder() {
            for (f, k) in f.iter_mut().zip(&kernel[i * n..][..n]) {
                *f += b * k;
            }
        }
    }
}

/// Place and value of the smallest sum, the first of equal ones; none where all are infinite.
#[inline(always)]
fn least(f: &[f64], up: &[f64]) -> Option<(usize, f64)> {
    let mut best = [f64::INFINITY; LANES];
    let mut place = [0u64; LANES];
    let mut at = [0u64; LANES];
    for (l, a) in at.iter_mut().enumerate() {
        *a = l as u64;
    }
    for (f, u) in f.chunks_exact(LANES).zip(up.chunks_exact(LANES)) {
        for l in 0..LANES {
            let value = f[l] + u[l];
            let better = value < best[l];
            best[l] = if better { value } else { best[l] };
            place[l] = if better { at[l] } else { place[l] };
            at[l] += LANES as u64;
        }
    }
    let (mut lowest, mut first) = (f64::INFINITY, 0u64);
    for l in 0..LANES {
        if best[l] < lowest || (best[l] == lowest && place[l] < first) {
            (lowest, first) = (best[l], place[l]);
        }
    }
    for i in f.len() - f.len() % LANES..f.len() {
        if f[i] + up[i] < lowest {
            (lowest, first) = (f[i] + up[i], i as u64);
        }
    }
    (lowest < f64::INFINITY).then_some((first as usize, lowest))
}

/// A convex function along a pair's direction: a parabola that gains slope at each kink.
struct KinkedLine {
    slope: f64,
    curvature: f64,
    /// Only those ahead (above zero) count.
    kinks: [f64; 2],
    jump: f64,
    limit: f64,
}

impl KinkedLine {
    #[inline(always)]
    fn minimum(&self) -> f64 {
        let [a, b] = self.kinks.map(|k| if k > 0.0 { k } else { f64::INFINITY });
        let (mut at, mut slope) = (0.0, self.slope);
        for end in [a.min(b), a.max(b), f64::INFINITY] {
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

/// Bounds and zero are met exactly, so that comparing with them is safe.
#[inline(always)]
pub fn snap(beta: f64, c: f64) -> f64 {
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

    #[test]
    fn a_step_stops_at_kinks_and_bounds() {
        let line = KinkedLine {
            slope: -3.0,
            curvature: 1.0,
            kinks: [1.0, f64::INFINITY],
            jump: 1.0,
            limit: 10.0,
        };
        assert!((line.minimum() - 2.0).abs() < 1e-15); // -3 + 1 + 1 = -1 left after the kink at 1
        assert!((KinkedLine { jump: 5.0, ..line }.minimum() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_first_of_equal_values_wins() {
        let mut f = vec![3.0; 37];
        for i in [5, 13, 21, 36] {
            f[i] = -1.0;
        }
        assert_eq!(least(&f, &vec![0.5; 37]), Some((5, -0.5)));
        assert_eq!(least(&f, &vec![f64::INFINITY; 37]), None);
    }
}
