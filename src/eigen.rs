//! The leading eigenpairs of a large symmetric matrix, without the others.
//!
//! Block Lanczos with full reorthogonalization (G. Golub and C. Van Loan, Matrix Computations, 4th ed.,
//! 10.3): products of matrices do the work, where a dense decomposition spends most of its time in
//! products with vectors. What was found is proved to be all there is above the smallest of it: the rest
//! of the matrix, subtracted from that value, has a Cholesky factor.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, Mat, MatRef, Par, Side};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Columns that are added at once.
const BLOCK: usize = 32;
/// Below this share of the largest eigenvalue all is rounding.
pub const RANK: f64 = 1e-12;
/// Residuals at which a pair counts as found, as a share of the largest eigenvalue: below what a dense
/// decomposition leaves.
const FOUND: f64 = 1e-15;
/// Residuals at which the iteration is given up: the eigenvalues hardly fall, and all are needed.
const HOPELESS: f64 = 1e-6;

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
/// that are more than rounding, or all of them where that is no more work. None where an iteration did
/// not converge.
#[must_use]
pub fn leading(a: MatRef<f64>, count: usize) -> Option<Leading> {
    let n = a.nrows();
    if n <= 24 * BLOCK || 3 * count > n {
        return dense(a);
    }
    let mut krylov = Krylov::new(a);
    // Twice the count is what it usually takes.
    let mut enough = (2 * count).max(12 * BLOCK);
    while krylov.size() + BLOCK <= n / 2 {
        krylov.grow();
        if krylov.size() < enough {
            continue;
        }
        enough += enough / 8;
        match krylov.search(count) {
            Ok(found) if nothing_above(a, &found) => return Some(found),
            Err(worst) if worst > HOPELESS => break,
            _ => {}
        }
    }
    dense(a)
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

/// An orthonormal basis that grows by products with the matrix, and the matrix in it.
struct Krylov<'a> {
    a: MatRef<'a, f64>,
    /// n × size.
    basis: Mat<f64>,
    /// size × size.
    projected: Mat<f64>,
    /// What the next block is made of, n × BLOCK, orthogonal to the basis; the last product's rest.
    rest: Mat<f64>,
}

impl<'a> Krylov<'a> {
    fn new(a: MatRef<'a, f64>) -> Self {
        // Any start will do that leaves out no direction; the same each time.
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let n = a.nrows();
        Self {
            a,
            basis: Mat::zeros(n, 0),
            projected: Mat::zeros(0, 0),
            rest: Mat::from_fn(n, BLOCK, |_, _| rng.random_range(-1.0..1.0)),
        }
    }

    fn size(&self) -> usize {
        self.basis.ncols()
    }

    fn grow(&mut self) {
        let (n, m) = (self.a.nrows(), self.size());
        let mut block = orthonormal(&self.rest);
        // A rest of rounding alone points anywhere, also back into the basis.
        remove(&self.basis, &mut block);
        let block = orthonormal(&block);
        self.basis
            .resize_with(n, m + BLOCK, |i, j| block[(i, j - m)]);
        let mut product = Mat::zeros(n, BLOCK);
        matmul(
            product.as_mut(),
            Accum::Replace,
            self.a,
            block.as_ref(),
            1.0,
            Par::Seq,
        );
        let mut inside = remove(&self.basis, &mut product);
        inside += remove(&self.basis, &mut product);
        self.projected.resize_with(m + BLOCK, m + BLOCK, |_, _| 0.0);
        for j in 0..BLOCK {
            for i in 0..m + BLOCK {
                self.projected[(i, m + j)] = inside[(i, j)];
                self.projected[(m + j, i)] = inside[(i, j)];
            }
        }
        self.rest = product;
    }

    /// The leading pairs, or by how much the worst of them misses (as a share of the largest value).
    fn search(&self, count: usize) -> Result<Leading, f64> {
        let (n, m) = (self.a.nrows(), self.size());
        let eigen = self.projected.self_adjoint_eigen(Side::Lower);
        let eigen = eigen.map_err(|_| f64::INFINITY)?;
        let s = eigen.S().column_vector();
        let largest = s[m - 1];
        let values: Vec<f64> = (0..count.min(m))
            .map(|k| s[m - 1 - k])
            .take_while(|&v| v > RANK * largest)
            .collect();
        let inner = Mat::from_fn(m, values.len(), |i, k| eigen.U()[(i, m - 1 - k)]);
        let rests = &self.rest * inner.as_ref().subrows(m - BLOCK, BLOCK);
        let worst = rests.col_iter().map(|c| c.norm_l2()).fold(0.0, f64::max);
        if worst > FOUND * largest {
            return Err(worst / largest);
        }
        let mut vectors = Mat::zeros(n, values.len());
        matmul(
            vectors.as_mut(),
            Accum::Replace,
            self.basis.as_ref(),
            inner.as_ref(),
            1.0,
            Par::Seq,
        );
        Ok(Leading {
            complete: values.len() < count,
            values,
            vectors,
        })
    }
}

/// Takes what lies in the basis out of a block, and says what that was (basis × block).
fn remove(basis: &Mat<f64>, block: &mut Mat<f64>) -> Mat<f64> {
    let inside = basis.transpose() * &*block;
    matmul(
        block.as_mut(),
        Accum::Add,
        basis.as_ref(),
        inside.as_ref(),
        -1.0,
        Par::Seq,
    );
    inside
}

fn orthonormal(block: &Mat<f64>) -> Mat<f64> {
    block.qr().compute_thin_Q()
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
        let q = orthonormal(&Mat::from_fn(n, n, |i, j| {
            ((i * 37 + j * 101 + 3) as f64).sin() + f64::from(u8::from(i == j))
        }));
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
        // A pair of equal ones, and one far away that a poor start would miss.
        let mut values: Vec<f64> = (0..400).map(|k| 0.8f64.powi(k)).collect();
        values[11] = values[10];
        values[399] = 0.5;
        let a = with(&values);
        let mut krylov = Krylov::new(a.as_ref());
        while krylov.size() < 160 {
            krylov.grow();
        }
        let found = krylov
            .search(40)
            .unwrap_or_else(|worst| panic!("{worst:e}"));
        assert!(nothing_above(a.as_ref(), &found));
        values.sort_by(|a, b| b.total_cmp(a));
        for (got, want) in found.values.iter().zip(&values) {
            assert!((got - want).abs() < 1e-14, "{got} {want}");
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
