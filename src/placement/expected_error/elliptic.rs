//! The mean length of a normal vector in the plane, and how it changes with the covariance.
//!
//! E|e| = √(π/2)/(2π)·∮ √(uᵀCu) dφ over all directions u. With the larger eigenvalue λ of C, the smaller μ and
//! m = 1 − μ/λ that is √(2λ/π)·E(m), and its derivatives by λ and μ are (K − D)/√(2πλ) and D/√(2πλ), with the complete
//! elliptic integrals of first and second kind K and E, and D = (K − E)/m.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Matrix2;

/// Parameters above this are as good as one: nothing is left across.
const FLAT: f64 = 1.0 - 1e-14;

/// E|e| for a normal e of mean zero and covariance [[a, b], [b, c]].
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[must_use]
#[inline(always)]
pub fn mean_length(a: f64, b: f64, c: f64) -> f64 {
    let (large, small) = Ellipse::of(a, b, c).eigenvalues();
    let m = (1.0 - small / large).clamp(0.0, 1.0);
    let length = (2.0 * large / PI).sqrt() * second_kind(m);
    if large > 0.0 { length } else { 0.0 }
}

/// [`mean_length`] and its derivative G by the covariance: what a small symmetric change dC adds is tr(G dC).
pub(super) fn mean_length_and_slope(a: f64, b: f64, c: f64) -> (f64, Matrix2<f64>) {
    let ellipse = Ellipse::of(a, b, c);
    let (large, small) = ellipse.eigenvalues();
    if large <= 0.0 {
        return (0.0, Matrix2::zeros());
    }
    let m = (1.0 - small / large).clamp(0.0, FLAT);
    let (first, tail) = first_kind(m);
    let scale = first / (TAU * large).sqrt();
    // By λ it is scale·(1/2 − tail/m), by μ scale·(1/2 + tail/m): in one expression, so that a circle needs no axes.
    let apart = if m > 0.0 {
        scale * tail / (m * ellipse.half)
    } else {
        0.0
    };
    let uneven = Matrix2::new(a - ellipse.middle, b, b, c - ellipse.middle);
    let slope = Matrix2::identity() * (scale / 2.0) - uneven * apart;
    let length = (2.0 * large / PI).sqrt() * first * (1.0 - m / 2.0 - tail);
    (length, slope)
}

/// The mean of the eigenvalues of a covariance, and half their difference.
struct Ellipse {
    middle: f64,
    half: f64,
}

impl Ellipse {
    #[allow(
        clippy::inline_always,
        reason = "part of loops that are compiled for several instruction sets"
    )]
    #[inline(always)]
    fn of(a: f64, b: f64, c: f64) -> Self {
        Self {
            middle: 0.5 * (a + c),
            half: (((a - c) / 2.0).powi(2) + b * b).sqrt(),
        }
    }

    /// The larger and the smaller.
    #[allow(
        clippy::inline_always,
        reason = "part of loops that are compiled for several instruction sets"
    )]
    #[inline(always)]
    fn eigenvalues(&self) -> (f64, f64) {
        let small = (self.middle - self.half).max(0.0);
        (self.middle + self.half, small)
    }
}

/// The complete elliptic integral of the second kind by its parameter m = k² of 0 to 1.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn second_kind(m: f64) -> f64 {
    let (first, tail) = first_kind(m);
    let second = first * (1.0 - m / 2.0 - tail);
    if m > FLAT { 1.0 } else { second }
}

/// The complete elliptic integral of the first kind K by its parameter m = k² < 1, and what 1 − E/K is beyond m/2: by
/// arithmetic–geometric means (Abramowitz and Stegun, 17.6.3 and 17.6.4).
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn first_kind(m: f64) -> (f64, f64) {
    /// Enough for doubles: the difference squares at every step. As many for every parameter, so that some can be computed
    /// side by side.
    const STEPS: usize = 6;
    let (mut a, mut g) = (1.0, (1.0 - m).sqrt());
    let (mut tail, mut power) = (0.0, 1.0);
    for _ in 0..STEPS {
        let c = (a - g) / 2.0;
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
        tail += power * c * c;
        power *= 2.0;
    }
    (FRAC_PI_2 / a, tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_normal_distribution() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(mean_length(4.0, 0.0, 4.0), 2.0 * (PI / 2.0).sqrt());
        near(mean_length(9.0, 0.0, 0.0), 3.0 * (2.0 / PI).sqrt());
        // E(3/4) = 1.211056027568459 (Abramowitz and Stegun, table 17.1).
        near(second_kind(0.75), 1.211_056_027_568_459);
        // Turned by any angle the same.
        near(mean_length(2.5, 1.5, 2.5), mean_length(4.0, 0.0, 1.0));
    }

    #[test]
    fn lengths_are_integrals_over_all_directions() {
        const PARTS: usize = 4000;
        for [a, b, c] in [[2.0, 0.3, 1.0], [5.0, -1.9, 0.8], [1.0, 0.0, 1.0]] {
            let sum: f64 = (0..PARTS)
                .map(|k| {
                    let (sin, cos) = (TAU * k as f64 / PARTS as f64).sin_cos();
                    (a * cos * cos + 2.0 * b * cos * sin + c * sin * sin).sqrt()
                })
                .sum();
            let integral = (PI / 2.0).sqrt() * sum / PARTS as f64;
            assert!((mean_length(a, b, c) - integral).abs() < 1e-9);
        }
    }

    #[test]
    fn slopes_are_those_of_the_length() {
        const STEP: f64 = 1e-6;
        for [a, b, c] in [
            [4.0, 0.0, 4.0],
            [4.0, 1e-9, 4.0],
            [2.0, 0.3, 1.0],
            [5.0, -1.9, 0.8],
            [9.0, 0.0, 1e-2],
        ] {
            let (length, slope) = mean_length_and_slope(a, b, c);
            assert!((length - mean_length(a, b, c)).abs() < 1e-12);
            let by = |da: f64, db: f64, dc: f64| {
                let at = |s: f64| mean_length(a + s * da, b + s * db, c + s * dc);
                (at(STEP) - at(-STEP)) / (2.0 * STEP)
            };
            let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-6 * (1.0 + y.abs()), "{x} {y}");
            near(slope[(0, 0)], by(1.0, 0.0, 0.0));
            near(2.0 * slope[(0, 1)], by(0.0, 1.0, 0.0));
            near(slope[(1, 1)], by(0.0, 0.0, 1.0));
        }
    }
}
