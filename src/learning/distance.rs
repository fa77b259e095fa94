//! Distances between touches.

use faer::Mat;

use crate::statistics::midpoint_median;

/// Squared Euclidean distances between the rows of two matrices: rows of `a` × rows of `b`. By one product of matrices,
/// so that what is left of two that are the same is rounding (10⁻¹⁶ of their squared lengths).
#[must_use]
pub fn squared(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let (of_a, of_b) = (squares(a), squares(b));
    let mut product = a * b.transpose();
    for (column, b) in product.col_iter_mut().zip(&of_b) {
        for (v, a) in column.iter_mut().zip(&of_a) {
            *v = (a + b - 2.0 * *v).max(0.0);
        }
    }
    product
}

/// As [`squared`], among the rows of one matrix: symmetric, and zero on its diagonal.
#[must_use]
pub fn among(a: &Mat<f64>) -> Mat<f64> {
    let mut all = squared(a, a);
    for i in 0..all.nrows() {
        all[(i, i)] = 0.0;
        for j in 0..i {
            all[(j, i)] = all[(i, j)];
        }
    }
    all
}

/// The median distance between different rows; one where nothing is apart.
#[must_use]
pub fn median(squared: &Mat<f64>) -> f64 {
    let n = squared.nrows();
    let apart = (0..n).flat_map(|j| (0..j).map(move |i| (i, j)));
    let values: Vec<f64> = apart
        .map(|(i, j)| squared[(i, j)])
        .filter(|&d| d > 0.0)
        .collect();
    let middle = midpoint_median(values).sqrt();
    if middle.is_normal() { middle } else { 1.0 }
}

/// Each column over a length of its own.
#[must_use]
pub fn over(features: &Mat<f64>, lengths: &[f64]) -> Mat<f64> {
    Mat::from_fn(features.nrows(), features.ncols(), |t, c| {
        features[(t, c)] / lengths[c]
    })
}

/// The `count` smallest of some values with their places, nearest first; the one of lower number where two are the same.
#[must_use]
pub fn nearest(values: impl Iterator<Item = (usize, f64)>, count: usize) -> Vec<(usize, f64)> {
    let mut all: Vec<(usize, f64)> = values.collect();
    let order = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
    if count < all.len() {
        all.select_nth_unstable_by(count, order);
        all.truncate(count);
    }
    all.sort_by(order);
    all
}

fn squares(a: &Mat<f64>) -> Vec<f64> {
    let mut sums = vec![0.0; a.nrows()];
    for column in a.col_iter() {
        for (sum, v) in sums.iter_mut().zip(column.iter()) {
            *sum += v * v;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_gives_the_distances() {
        let a = Mat::from_fn(7, 3, |i, j| ((i * 5 + j * 3) % 7) as f64);
        let d = among(&a);
        for (i, j) in [(0, 3), (2, 6), (5, 1)] {
            let plain: f64 = (0..3).map(|c| (a[(i, c)] - a[(j, c)]).powi(2)).sum();
            assert!((d[(i, j)] - plain).abs() < 1e-12);
            assert_eq!(d[(i, j)], d[(j, i)]);
        }
        assert_eq!(d[(4, 4)], 0.0);
        assert_eq!(median(&Mat::zeros(4, 4)), 1.0);
        let near = nearest([3.0, 1.0, 2.0, 1.0].into_iter().enumerate(), 2);
        assert_eq!(near, [(1, 1.0), (3, 1.0)]);
    }
}
