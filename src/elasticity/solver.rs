//! The sparse stiffness matrix: its pattern, its scaled factor, and solves in blocks.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side, Spec};

/// Right-hand sides solved together. Fixed, so that a load gives the same bytes in any company.
pub const BLOCK: usize = 64;

/// Why the factorization failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FactorError {
    /// A pivot that is not positive, at this row.
    NotPositive {
        row: usize,
    },
    OutOfMemory,
}

/// The lower triangle of a symmetric matrix, by columns.
pub struct SymmetricMatrix {
    pub columns: Vec<usize>,
    pub rows: Vec<usize>,
    pub values: Vec<f64>,
}

impl SymmetricMatrix {
    pub fn dimension(&self) -> usize {
        self.columns.len() - 1
    }

    /// Adds to the entry (row, column) of the lower triangle, which must be in the pattern.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let range = self.columns[column]..self.columns[column + 1];
        if let Ok(place) = self.rows[range.clone()].binary_search(&row) {
            self.values[range.start + place] += value;
        }
    }

    pub fn diagonal(&self, column: usize) -> f64 {
        // The diagonal is the first entry of its column in a lower triangle.
        self.values[self.columns[column]]
    }

    /// y = A x.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..self.dimension() {
            for k in self.columns[column]..self.columns[column + 1] {
                let (row, value) = (self.rows[k], self.values[k]);
                y[row] += value * x[column];
                if row != column {
                    y[column] += value * x[row];
                }
            }
        }
        y
    }
}

/// L Lᵀ of the matrix scaled to a unit diagonal.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    /// 1/√ of the diagonal.
    scale: Vec<f64>,
    /// Smallest pivot of the scaled matrix: near zero means nearly unheld.
    pub smallest_pivot: f64,
}

impl Factor {
    pub fn new(matrix: &SymmetricMatrix) -> Result<Self, FactorError> {
        let n = matrix.dimension();
        if let Some(row) =
            (0..n).find(|&c| matrix.diagonal(c) <= 0.0 || !matrix.diagonal(c).is_finite())
        {
            return Err(FactorError::NotPositive { row });
        }
        let scale: Vec<f64> = (0..n).map(|c| matrix.diagonal(c).sqrt().recip()).collect();
        let scaled = scaled(matrix, &scale);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::AUTO,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(
            scaled.symbolic(),
            Side::Lower,
            SymmetricOrdering::Amd,
            params,
        )
        .map_err(|_| FactorError::OutOfMemory)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| FactorError::OutOfMemory)?;
        let outcome = symbolic
            .factorize_numeric_llt::<f64>(
                &mut values,
                scaled.as_ref(),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            )
            .map(|_| ());
        if let Err(LltError::NonPositivePivot { index }) = outcome {
            return Err(FactorError::NotPositive {
                row: original_row(&symbolic, index),
            });
        }
        let smallest_pivot = smallest_pivot(&symbolic, &values);
        Ok(Self {
            symbolic,
            values,
            scale,
            smallest_pivot,
        })
    }

    pub fn dimension(&self) -> usize {
        self.scale.len()
    }

    /// Memory for solving one block; each thread has its own.
    pub fn scratch(&self) -> MemBuffer {
        MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(BLOCK, Par::Seq))
    }

    /// Solves in place for [`BLOCK`] right-hand sides, `n` × `BLOCK` by columns.
    pub fn solve_block(&self, block: &mut [f64], memory: &mut MemBuffer) {
        let n = self.dimension();
        let rescale = |block: &mut [f64]| {
            for column in block.chunks_exact_mut(n) {
                for (x, s) in column.iter_mut().zip(&self.scale) {
                    *x *= s;
                }
            }
        };
        rescale(block);
        LltRef::<'_, usize, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(block, n, BLOCK),
            Par::Seq,
            MemStack::new(memory),
        );
        rescale(block);
    }
}

fn scaled(matrix: &SymmetricMatrix, scale: &[f64]) -> SparseColMat<usize, f64> {
    let n = matrix.dimension();
    let mut values = matrix.values.clone();
    for column in 0..n {
        for k in matrix.columns[column]..matrix.columns[column + 1] {
            values[k] *= scale[column] * scale[matrix.rows[k]];
        }
    }
    let pattern =
        SymbolicSparseColMat::new_checked(n, n, matrix.columns.clone(), None, matrix.rows.clone());
    SparseColMat::new(pattern, values)
}

fn original_row(symbolic: &SymbolicCholesky<usize>, index: usize) -> usize {
    // The library counts from zero in one of its two forms and from one in the other.
    let permuted = match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(_) => index,
        SymbolicCholeskyRaw::Simplicial(_) => index.saturating_sub(1),
    };
    symbolic.perm().map_or(permuted, |p| p.arrays().0[permuted])
}

fn smallest_pivot(symbolic: &SymbolicCholesky<usize>, values: &[f64]) -> f64 {
    let mut smallest = f64::INFINITY;
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(s) => {
            let l = SupernodalLltRef::<'_, usize, f64>::new(s, values);
            for k in 0..s.n_supernodes() {
                let columns = l.supernode(k).val();
                for j in 0..columns.ncols() {
                    smallest = smallest.min(columns[(j, j)].powi(2));
                }
            }
        }
        SymbolicCholeskyRaw::Simplicial(s) => {
            for &start in &s.col_ptr()[..s.col_ptr().len() - 1] {
                smallest = smallest.min(values[start].powi(2));
            }
        }
    }
    smallest
}
