//! The Gaussian kernel between touches, at the speed of the processor's widest lanes.

use crate::dataset::SignalMatrix;
use crate::lanes::wide;
use crate::tally::{self, Done};

/// exp(x) for x ≤ 0 to a few units in the last place; zero below about -708. Written without branches so
/// that it is computed in lanes, and so that it gives the same bytes on every machine.
#[inline(always)]
#[must_use]
fn exp(x: f64) -> f64 {
    /// 1.5 · 2⁵²: adding it rounds to an integer and leaves that integer in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    /// 1/k!, from the highest.
    const TAYLOR: [f64; 14] = [
        1.605_904_383_682_161_3e-10,
        2.087_675_698_786_809_7e-9,
        2.505_210_838_544_171_7e-8,
        2.755_731_922_398_589_3e-7,
        2.755_731_922_398_589_4e-6,
        2.480_158_730_158_73e-5,
        1.984_126_984_126_984e-4,
        1.388_888_888_888_889e-3,
        8.333_333_333_333_333e-3,
        4.166_666_666_666_666_4e-2,
        1.666_666_666_666_666_6e-1,
        0.5,
        1.0,
        1.0,
    ];
    let clipped = x.max(-708.0);
    let shifted = clipped * std::f64::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    let rest = (clipped - whole * LN2_HIGH) - whole * LN2_LOW;
    let mut sum = TAYLOR[0];
    for c in &TAYLOR[1..] {
        sum = sum * rest + c;
    }
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    if x < -708.0 { 0.0 } else { sum * power }
}

/// As [`exp`], in single precision; zero below about -87.
#[inline(always)]
#[must_use]
pub(crate) fn exp_single(x: f32) -> f32 {
    /// 1.5 · 2²³.
    const ROUND: f32 = 12_582_912.0;
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    const TAYLOR: [f32; 8] = [
        1.984_127e-4,
        1.388_888_9e-3,
        8.333_333e-3,
        4.166_666_8e-2,
        0.166_666_67,
        0.5,
        1.0,
        1.0,
    ];
    let clipped = x.max(-87.0);
    let shifted = clipped * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    let rest = (clipped - whole * LN2_HIGH) - whole * LN2_LOW;
    let mut sum = TAYLOR[0];
    for c in &TAYLOR[1..] {
        sum = sum * rest + c;
    }
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23));
    if x < -87.0 { 0.0 } else { sum * power }
}

wide! {
    fn exponentials<'a>(values: &'a mut [f64], gamma: f64) {
        for v in values {
            *v = exp(-gamma * *v);
        }
    }
}

/// exp(-γ d²), entry by entry.
#[must_use]
pub fn gaussian(squared: &[f64], gamma: f64) -> Vec<f64> {
    tally::count(Done::KernelEvaluation, squared.len());
    let mut values = squared.to_vec();
    exponentials(&mut values, gamma);
    values
}

wide! {
    fn add_squares<'a>(d: &'a mut [f64], rows: &'a [f64], columns: &'a [f64]) {
        for (out, &p) in d.chunks_exact_mut(columns.len().max(1)).zip(rows) {
            for (o, &q) in out.iter_mut().zip(columns) {
                *o += (p - q) * (p - q);
            }
        }
    }
}

/// Squared distances between the columns (touches) of two standardized matrices with the same rows:
/// `a` columns × `b` columns.
#[must_use]
pub fn squared_distances(a: &SignalMatrix, b: &SignalMatrix) -> Vec<f64> {
    let mut d = vec![0.0; a.columns() * b.columns()];
    for r in 0..a.rows() {
        add_squares(&mut d, a.row(r), b.row(r));
    }
    d
}

/// The kernel with one more signal, into `out`: a Gaussian kernel over a union is the product of the
/// kernels. `kernel` and `out` are `rows` × `columns`, by rows.
pub fn extend(kernel: &[f64], rows: &[f64], columns: &[f64], gamma: f64, out: &mut [f64]) {
    tally::count(Done::KernelEvaluation, out.len());
    multiply(kernel, rows, columns, gamma, out);
}

wide! {
    fn multiply<'a>(
        kernel: &'a [f64],
        rows: &'a [f64],
        columns: &'a [f64],
        gamma: f64,
        out: &'a mut [f64],
    ) {
        let m = columns.len().max(1);
        for ((out, old), &p) in (out.chunks_exact_mut(m).zip(kernel.chunks_exact(m))).zip(rows) {
            for ((o, k), &q) in out.iter_mut().zip(old).zip(columns) {
                *o = k * exp(-gamma * (p - q) * (p - q));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_right_to_the_last_digits() {
        for k in 0..200_000 {
            let x = -f64::from(k) * 0.00354;
            let (ours, theirs) = (exp(x), x.exp());
            assert!(
                (ours - theirs).abs() <= 8e-16 * theirs,
                "{x}: {ours} {theirs}"
            );
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(-1e9), 0.0);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
    }

    #[test]
    fn in_single_precision_too() {
        for k in 0..87_000 {
            let x = -(k as f32) * 1e-3;
            let (ours, theirs) = (exp_single(x), f64::from(x).exp() as f32);
            assert!(
                (ours - theirs).abs() <= 4e-7 * theirs,
                "{x}: {ours} {theirs}"
            );
        }
        assert_eq!(exp_single(0.0), 1.0);
        assert_eq!(exp_single(-1e9), 0.0);
    }

    #[test]
    fn kernels_multiply() {
        let a = SignalMatrix::new(3, vec![0.0, 1.0, 2.5]);
        let both = SignalMatrix::new(3, vec![0.0, 1.0, 2.5, -1.0, 0.5, 0.0]);
        let one = gaussian(&squared_distances(&a, &a), 0.3);
        let two = gaussian(&squared_distances(&both, &both), 0.3);
        let mut product = vec![0.0; 9];
        extend(&one, both.row(1), both.row(1), 0.3, &mut product);
        for (p, t) in product.iter().zip(&two) {
            assert!((p - t).abs() < 1e-15);
        }
    }
}
