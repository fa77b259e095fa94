//! Features whose products are nearly the kernel: a Nyström approximation on landmark touches.
//!
//! With landmarks L the kernel is close to K(n, L) K(L, L)⁻¹ K(L, n) = Φ Φᵀ with Φ = K(n, L) R⁻ᵀ and
//! K(L, L) = R Rᵀ: C. Williams and M. Seeger, 2001. The factor is a pivoted Cholesky in double precision,
//! cut where it reaches rounding, as S. Fine and K. Scheinberg, JMLR 2, 2001.

use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par};

/// Pivots of the landmarks' own kernel below this are rounding.
const CUT: f64 = 1e-10;

/// Φ (touches × rank + 1), its last column ones for the bias, from the kernel between all touches and
/// the landmarks (touches × landmarks) and the landmarks' places among the touches.
#[must_use]
pub fn features(cross: MatRef<f64>, landmarks: &[usize]) -> Mat<f64> {
    let own = Mat::from_fn(landmarks.len(), landmarks.len(), |i, j| {
        cross[(landmarks[i], j)]
    });
    let (factor, pivots) = pivoted_cholesky(own);
    let rank = pivots.len();
    let mut phi = Mat::zeros(cross.nrows(), rank + 1);
    for (k, &p) in pivots.iter().enumerate() {
        phi.col_mut(k).copy_from(cross.col(p));
    }
    phi.col_mut(rank).fill(1.0);
    solve_lower_triangular_in_place(
        factor.as_ref(),
        phi.subcols_mut(0, rank).transpose_mut(),
        Par::Seq,
    );
    phi
}

/// Lower factor of a positive semidefinite matrix in the order of its pivots, up to its numerical rank.
fn pivoted_cholesky(mut a: Mat<f64>) -> (Mat<f64>, Vec<usize>) {
    let n = a.nrows();
    let mut pivots: Vec<usize> = (0..n).collect();
    let mut rank = 0;
    while rank < n {
        let best = (rank..n).fold(rank, |b, i| if a[(i, i)] > a[(b, b)] { i } else { b });
        if a[(best, best)] <= CUT {
            break;
        }
        swap(&mut a, rank, best);
        pivots.swap(rank, best);
        let pivot = a[(rank, rank)].sqrt();
        a[(rank, rank)] = pivot;
        for i in rank + 1..n {
            a[(i, rank)] /= pivot;
        }
        for j in rank + 1..n {
            let factor = a[(j, rank)];
            let (done, rest) = a.as_mut().split_at_col_mut(j);
            let (column, mut target) = (done.col(rank), rest.col_mut(0));
            for i in j..n {
                target[i] -= factor * column[i];
            }
        }
        rank += 1;
    }
    pivots.truncate(rank);
    let factor = Mat::from_fn(rank, rank, |i, j| if i >= j { a[(i, j)] } else { 0.0 });
    (factor, pivots)
}

/// Exchanges two rows and columns of the lower triangle.
fn swap(a: &mut Mat<f64>, i: usize, j: usize) {
    if i == j {
        return;
    }
    let n = a.nrows();
    let at = |r: usize, c: usize| if r >= c { (r, c) } else { (c, r) };
    for k in (0..n).filter(|&k| k != i && k != j) {
        let (p, q) = (a[at(i, k)], a[at(j, k)]);
        (a[at(i, k)], a[at(j, k)]) = (q, p);
    }
    let (p, q) = (a[(i, i)], a[(j, j)]);
    (a[(i, i)], a[(j, j)]) = (q, p);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_features_are_the_kernel_where_landmarks_suffice() {
        let x: Vec<f64> = (0..60).map(|i| f64::from(i) * 0.05).collect();
        let landmarks: Vec<usize> = (0..60).step_by(2).collect();
        let k = |a: f64, b: f64| (-(a - b) * (a - b)).exp();
        let cross = Mat::from_fn(60, landmarks.len(), |i, j| k(x[i], x[landmarks[j]]));
        let phi = features(cross.as_ref(), &landmarks);
        assert!(phi.ncols() < landmarks.len(), "cut at the numerical rank");
        for i in 0..60 {
            for j in 0..60 {
                let product: f64 = (0..phi.ncols() - 1)
                    .map(|c| phi[(i, c)] * phi[(j, c)])
                    .sum();
                assert!((product - k(x[i], x[j])).abs() < 1e-6);
            }
            assert_eq!(phi[(i, phi.ncols() - 1)], 1.0);
        }
    }
}
