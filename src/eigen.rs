//! The leading eigenpairs of a large symmetric matrix, without the others.
//!
//! faer's Lanczos iteration finds them (G. Golub and C. Van Loan, Matrix Computations, 4th ed., 10.3), where a dense
//! decomposition spends most of its time on the others. It starts from one vector, so that of equal eigenvalues it may see
//! but one: what was found is proved to be all there is above the smallest of it, for the rest of the matrix, subtracted
//! from that value, then has a Cholesky factor. Where it has none, or the iteration does not end, all are computed.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::matrix_free::eigen::{
    PartialEigenParams, partial_self_adjoint_eigen, partial_self_adjoint_eigen_scratch,
};
use faer::{Accum, Col, Mat, MatRef, Par, Side};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A dense decomposition is no more work for a matrix of so many rows, or for so large a share of its pairs (one in).
const SMALL: usize = 768;
const MANY: usize = 3;
/// Below this share of the largest eigenvalue all is rounding.
pub const RANK: f64 = 1e-12;
/// Residuals at which a pair counts as found, as a share of its eigenvalue: below what a dense decomposition leaves.
const FOUND: f64 = 1e-15;
/// How often the iteration is begun anew from what it has: eigenvalues that hardly fall are sooner found all together.
const RESTARTS: usize = 20;

/// Eigenpairs by falling value.
pub struct Leading {
    /// By falling value, none below [`RANK`] of the largest.
    pub values: Vec<f64>,
    /// One column a value.
    pub vectors: Mat<f64>,
    /// All others are rounding.
    pub complete: bool,
}

/// The `count` largest eigenvalues of a symmetric positive semidefinite matrix (both halves filled in)
/// that are more than rounding, or all of them where that is no more work. None where a decomposition did
/// not converge.
#[must_use]
pub fn leading(a: MatRef<f64>, count: usize) -> Option<Leading> {
    let n = a.nrows();
    if n <= SMALL || MANY * count > n {
        return dense(a);
    }
    let found = partial(a, count).filter(|found| nothing_above(a, found));
    found.or_else(|| dense(a))
}

fn dense(a: MatRef<f64>) -> Option<Leading> {
    let n = a.nrows();
    let eigen = a.self_adjoint_eigen(Side::Lower).ok()?;
    let s = eigen.S().column_vector();
    let largest = s[n - 1];
    let rank = (0..n)
        .take_while(|&k| s[n - 1 - k] > RANK * largest)
        .count();
    Some(Leading {
        values: (0..rank).map(|k| s[n - 1 - k]).collect(),
        vectors: Mat::from_fn(n, rank, |i, k| eigen.U()[(i, n - 1 - k)]),
        complete: true,
    })
}

/// As [`leading`], by iteration; nothing where it does not find that many.
fn partial(a: MatRef<f64>, count: usize) -> Option<Leading> {
    // Any start will do that leaves out no direction; the same each time.
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let start = Col::from_fn(a.nrows(), |_| rng.random_range(-1.0..1.0));
    let params = PartialEigenParams {
        max_restarts: RESTARTS,
        ..PartialEigenParams::default()
    };
    let scratch = partial_self_adjoint_eigen_scratch(&a, count, Par::Seq, params);
    let mut memory = MemBuffer::new(scratch);
    let mut vectors = Mat::zeros(a.nrows(), count);
    let mut values = vec![0.0; count];
    let found = partial_self_adjoint_eigen(
        vectors.as_mut(),
        &mut values,
        &a,
        start.as_ref(),
        FOUND,
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    // Those of largest magnitude, which fall; of a matrix of low rank the last ones are rounding.
    let largest = *values.first()?;
    let sound = found.n_converged_eigen == count && values.is_sorted_by(|a, b| a >= b);
    let rank = (values.iter()).take_while(|&&v| v > RANK * largest).count();
    sound.then(|| Leading {
        vectors: vectors.subcols(0, rank).to_owned(),
        complete: rank < count,
        values: values[..rank].to_vec(),
    })
}

/// Whether the matrix without the pairs found has no eigenvalue above the least of them (or above
/// rounding, where all were found).
fn nothing_above(a: MatRef<f64>, found: &Leading) -> bool {
    let Some(&largest) = found.values.first() else {
        return true;
    };
    let least = if found.complete {
        0.0
    } else {
        found.values[found.values.len() - 1]
    };
    let n = a.nrows();
    let scaled = Mat::from_fn(n, found.values.len(), |i, k| {
        found.vectors[(i, k)] * found.values[k]
    });
    let mut rest = Mat::from_fn(n, n, |i, j| {
        let own = if i == j { least + RANK * largest } else { 0.0 };
        if i >= j { own - a[(i, j)] } else { 0.0 }
    });
    triangular::matmul(
        rest.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        scaled.as_ref(),
        BlockStructure::Rectangular,
        found.vectors.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    rest.llt(Side::Lower).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix with given eigenvalues, in a basis that is no axis.
    fn with(values: &[f64]) -> Mat<f64> {
        let n = values.len();
        let any = Mat::from_fn(n, n, |i, j| {
            ((i * 37 + j * 101 + 3) as f64).sin() + f64::from(u8::from(i == j))
        });
        let q = any.qr().compute_thin_Q();
        let scaled = Mat::from_fn(n, n, |i, j| q[(i, j)] * values[j]);
        let a = scaled * q.transpose();
        Mat::from_fn(n, n, |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
    }

    /// Largest entry of A V - V Λ and of Vᵀ V - 1.
    fn departure(a: &Mat<f64>, found: &Leading) -> f64 {
        let v = &found.vectors;
        let scaled = Mat::from_fn(v.nrows(), v.ncols(), |i, j| v[(i, j)] * found.values[j]);
        let one = Mat::<f64>::identity(v.ncols(), v.ncols());
        let off = (a * v - scaled).norm_max() / found.values[0];
        off.max((v.transpose() * v - one).norm_max())
    }

    #[test]
    fn falling_values_are_found_by_the_iteration() {
        // One far away that a poor start would miss.
        let mut values: Vec<f64> = (0..400).map(|k| 0.8f64.powi(k)).collect();
        values[399] = 0.5;
        let a = with(&values);
        let found = partial(a.as_ref(), 40).unwrap();
        assert!(nothing_above(a.as_ref(), &found));
        values.sort_by(|a, b| b.total_cmp(a));
        for (got, want) in found.values.iter().zip(&values) {
            assert!((got - want).abs() < 5e-14, "{got} {want}");
        }
        assert!(departure(&a, &found) < 1e-13 && !found.complete);
        // What was left out is noticed.
        let short = Leading {
            values: [&found.values[..6], &found.values[7..]].concat(),
            vectors: Mat::from_fn(400, 39, |i, k| found.vectors[(i, k + usize::from(k > 5))]),
            complete: false,
        };
        assert!(!nothing_above(a.as_ref(), &short));
    }

    /// The iteration sees one of a pair; the proof sees that another is missing.
    #[test]
    fn equal_values_are_not_lost() {
        let mut values: Vec<f64> = (0..800).map(|k| 0.8f64.powi(k)).collect();
        values[11] = values[10];
        let a = with(&values);
        if let Some(found) = partial(a.as_ref(), 40) {
            let pair = (found.values.iter()).filter(|v| (*v - values[10]).abs() < 1e-14);
            assert_eq!(pair.count() == 2, nothing_above(a.as_ref(), &found));
        }
        let found = leading(a.as_ref(), 40).unwrap();
        for (got, want) in found.values.iter().zip(&values).take(40) {
            assert!((got - want).abs() < 5e-14, "{got} {want}");
        }
    }

    #[test]
    fn a_low_rank_is_seen_to_be_complete_and_a_flat_spectrum_is_done_densely() {
        let mut low = vec![0.0; 800];
        for (k, v) in low.iter_mut().take(25).enumerate() {
            *v = 1.0 + k as f64;
        }
        let a = with(&low);
        let found = leading(a.as_ref(), 60).unwrap();
        assert!(found.complete && found.values.len() == 25);
        assert!(departure(&a, &found) < 1e-12);
        let flat: Vec<f64> = (0..800).map(|k| 1.0 + f64::from(k) * 1e-3).collect();
        let a = with(&flat);
        let found = leading(a.as_ref(), 60).unwrap();
        assert!(found.complete && found.values.len() == 800);
        assert!((found.values[0] - 1.799).abs() < 1e-12 && departure(&a, &found) < 1e-12);
    }
}
