//! A minimum by limited-memory BFGS with a projected line search (J. Nocedal and S. J. Wright, Numerical Optimization,
//! 2006, algorithm 7.5): a few dozen unknowns within bounds, and a value that costs a factorization.

use crate::budget::Cancelled;

/// Pairs of steps and changes of the gradient that are kept.
const MEMORY: usize = 10;
/// A step has to bring this share of what the slope promises (Armijo).
const ENOUGH: f64 = 1e-4;
/// Most halvings of a step.
const HALVINGS: usize = 12;
/// It ends where a step brings less than this share of the value.
const LITTLE: f64 = 1e-6;

/// A value and its gradient; nothing where there is none at that place.
pub type Valued = Option<(f64, Vec<f64>)>;

/// The lowest place found from `start` within `bounds`, in at most so many steps; the start itself where nothing has a
/// value.
///
/// # Errors
/// [`Cancelled`] when the function is.
pub fn minimize(
    start: Vec<f64>,
    bounds: &[(f64, f64)],
    steps: usize,
    mut value: impl FnMut(&[f64]) -> Result<Valued, Cancelled>,
) -> Result<Vec<f64>, Cancelled> {
    let Some(mut here) = DescentPoint::at(start.clone(), &mut value)? else {
        return Ok(start);
    };
    let mut memory = Memory::default();
    for _ in 0..steps {
        let mut direction = memory.direction(&here.gradient);
        hold(&mut direction, &here, bounds);
        if dot(&direction, &here.gradient) >= 0.0 {
            memory = Memory::default();
            direction = here.gradient.iter().map(|g| -g).collect();
            hold(&mut direction, &here, bounds);
        }
        let Some(next) = descend(&here, &direction, bounds, &memory, &mut value)? else {
            break;
        };
        memory.learn(&here, &next);
        let gained = here.value - next.value;
        here = next;
        if gained < LITTLE * (1.0 + here.value.abs()) {
            break;
        }
    }
    Ok(here.at)
}

struct DescentPoint {
    at: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
}

impl DescentPoint {
    fn at(
        at: Vec<f64>,
        value: &mut impl FnMut(&[f64]) -> Result<Valued, Cancelled>,
    ) -> Result<Option<Self>, Cancelled> {
        let found = value(&at)?.filter(|(v, g)| v.is_finite() && g.iter().all(|g| g.is_finite()));
        Ok(found.map(|(value, gradient)| Self {
            at,
            value,
            gradient,
        }))
    }
}

/// The first of ever shorter steps that brings enough.
fn descend(
    here: &DescentPoint,
    direction: &[f64],
    bounds: &[(f64, f64)],
    memory: &Memory,
    value: &mut impl FnMut(&[f64]) -> Result<Valued, Cancelled>,
) -> Result<Option<DescentPoint>, Cancelled> {
    let longest = direction.iter().fold(0.0f64, |m, d| m.max(d.abs()));
    // Unknowns are logarithms: without a memory of the curvature no step is longer than one of them.
    let mut step = if memory.pairs.is_empty() {
        longest.max(1.0).recip()
    } else {
        1.0
    };
    for _ in 0..HALVINGS {
        let moved =
            |((x, d), (low, high)): ((&f64, &f64), &(f64, f64))| (x + step * d).clamp(*low, *high);
        let at: Vec<f64> = (here.at.iter().zip(direction).zip(bounds))
            .map(moved)
            .collect();
        let promised: f64 = (at.iter().zip(&here.at).zip(&here.gradient))
            .map(|((new, old), g)| (new - old) * g)
            .sum();
        let next = DescentPoint::at(at, value)?;
        if let Some(next) = next.filter(|n| n.value <= here.value + ENOUGH * promised) {
            return Ok(Some(next));
        }
        step *= 0.5;
    }
    Ok(None)
}

/// Unknowns at a bound that the direction leads beyond stay where they are.
fn hold(direction: &mut [f64], here: &DescentPoint, bounds: &[(f64, f64)]) {
    for ((d, x), (low, high)) in direction.iter_mut().zip(&here.at).zip(bounds) {
        if (x <= low && *d < 0.0) || (x >= high && *d > 0.0) {
            *d = 0.0;
        }
    }
}

/// What the last steps say of the curvature.
#[derive(Default)]
struct Memory {
    /// Step, change of the gradient, and one over their product; the latest last.
    pairs: Vec<(Vec<f64>, Vec<f64>, f64)>,
}

impl Memory {
    fn learn(&mut self, from: &DescentPoint, to: &DescentPoint) {
        let less =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let (step, change) = (less(&to.at, &from.at), less(&to.gradient, &from.gradient));
        let curvature = dot(&step, &change);
        if curvature > 1e-10 * (dot(&step, &step) * dot(&change, &change)).sqrt() {
            if self.pairs.len() == MEMORY {
                self.pairs.remove(0);
            }
            self.pairs.push((step, change, curvature.recip()));
        }
    }

    /// Newton's direction as far as it is known (two loops over the pairs).
    fn direction(&self, gradient: &[f64]) -> Vec<f64> {
        let mut d: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut shares = Vec::with_capacity(self.pairs.len());
        for (step, change, inverse) in self.pairs.iter().rev() {
            let share = inverse * dot(step, &d);
            add(&mut d, change, -share);
            shares.push(share);
        }
        if let Some((_, change, inverse)) = self.pairs.last() {
            let scale = (inverse * dot(change, change)).recip();
            for v in &mut d {
                *v *= scale;
            }
        }
        for ((step, change, inverse), share) in self.pairs.iter().zip(shares.iter().rev()) {
            let back = inverse * dot(change, &d);
            add(&mut d, step, share - back);
        }
        d
    }
}

fn add(to: &mut [f64], what: &[f64], times: f64) {
    for (t, w) in to.iter_mut().zip(what) {
        *t += times * w;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_bent_valley_is_found() {
        // Rosenbrock's.
        let mut asked = 0;
        let valley = |x: &[f64]| {
            asked += 1;
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            let value = a * a + 100.0 * b * b;
            Ok(Some((value, vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b])))
        };
        let at = minimize(vec![-1.2, 1.0], &[(-5.0, 5.0); 2], 200, valley).unwrap();
        assert!(
            (at[0] - 1.0).abs() < 1e-2 && (at[1] - 1.0).abs() < 2e-2,
            "{at:?}"
        );
        assert!(asked < 120, "{asked}");
    }

    #[test]
    fn bounds_hold_and_places_without_a_value_are_left() {
        let bowl = |x: &[f64]| {
            let value = (x[0] - 3.0).powi(2) + (x[1] + 1.0).powi(2);
            let known = x[1] > -2.0;
            Ok(known.then(|| (value, vec![2.0 * (x[0] - 3.0), 2.0 * (x[1] + 1.0)])))
        };
        let at = minimize(vec![0.0, 5.0], &[(-1.0, 2.0), (-9.0, 9.0)], 50, bowl).unwrap();
        assert!(
            (at[0] - 2.0).abs() < 1e-9 && (at[1] + 1.0).abs() < 1e-3,
            "{at:?}"
        );
    }
}
