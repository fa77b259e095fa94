//! Features whose products are nearly the kernel: a Nyström approximation on landmark touches.
//!
//! With landmarks L the kernel is close to K(n, L) K(L, L)⁻¹ K(L, n) = Φ Φᵀ with Φ = K(n, L) R⁻ᵀ and
//! K(L, L) = R Rᵀ: C. Williams and M. Seeger, 2001. The factor is a pivoted Cholesky in double precision,
//! cut where it reaches rounding, as S. Fine and K. Scheinberg, JMLR 2, 2001.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt_pivoting::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par, Spec};

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
    let (mut pivots, mut places) = (vec![0_usize; n], vec![0_usize; n]);
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<usize, f64>(
        n,
        Par::Seq,
        Spec::default(),
    ));
    let factored = cholesky_in_place(
        a.as_mut(),
        &mut pivots,
        &mut places,
        Par::Seq,
        MemStack::new(&mut memory),
        Spec::default(),
    );
    // What is no kernel has no features: nothing is learned from it.
    let found = factored.map_or(0, |(info, _)| info.rank);
    // Pivots fall, and those below the cut are rounding.
    let rank = (0..found).take_while(|&k| a[(k, k)].powi(2) > CUT).count();
    pivots.truncate(rank);
    let factor = Mat::from_fn(rank, rank, |i, j| if i >= j { a[(i, j)] } else { 0.0 });
    (factor, pivots)
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

    /// More landmarks than are factored at once.
    #[test]
    fn many_landmarks_are_factored_in_blocks() {
        const N: usize = 400;
        let k = |a: usize, b: usize| (-(a.abs_diff(b) as f64 / 1.3).powi(2)).exp();
        let landmarks: Vec<usize> = (0..N).filter(|n| n % 7 != 3).collect();
        let cross = Mat::from_fn(N, landmarks.len(), |i, j| k(i, landmarks[j]));
        let phi = features(cross.as_ref(), &landmarks);
        assert!(phi.ncols() > 256);
        for &i in &landmarks {
            for &j in &landmarks {
                let product: f64 = (0..phi.ncols() - 1)
                    .map(|c| phi[(i, c)] * phi[(j, c)])
                    .sum();
                assert!((product - k(i, j)).abs() < 1e-6, "{i} {j}: {product}");
            }
        }
    }
}
