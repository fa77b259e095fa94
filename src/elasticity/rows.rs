//! Sparse rows that are applied to blocks of solutions.

use rayon::prelude::*;

use super::solver::BLOCK;

/// A sparse matrix by rows, each a list of (column, weight).
#[derive(Clone, Debug)]
pub(super) struct SparseRows {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Default for SparseRows {
    fn default() -> Self {
        Self {
            starts: vec![0],
            entries: Vec::new(),
        }
    }
}

impl SparseRows {
    /// Appends a row, given as (column, weight).
    pub fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        self.entries.extend(row);
        self.starts.push(self.entries.len());
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The entries of one row: (column, weight).
    pub fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[row]..self.starts[row + 1]]
    }

    /// The numbers of the rows by blocks: those that begin near each other share one.
    pub fn in_blocks(&self) -> Vec<Vec<u32>> {
        let first = |row: u32| self.row(row as usize).iter().map(|e| e.0).min();
        let mut order: Vec<u32> = (0..self.count() as u32).collect();
        order.sort_by_key(|&row| (first(row), row));
        order.chunks(BLOCK).map(<[u32]>::to_vec).collect()
    }

    /// `into` (a row each of [`BLOCK`] values) = this matrix × `from` (rows of [`BLOCK`] values).
    pub fn apply(&self, from: &[f64], into: &mut [f64]) {
        // With the widest vectors this processor has; sums in the same order on all of them.
        pulp::Arch::new().dispatch(|| {
            for (out, range) in into.chunks_exact_mut(BLOCK).zip(self.starts.windows(2)) {
                let mut sum = [0.0; BLOCK];
                for &(column, weight) in &self.entries[range[0]..range[1]] {
                    let row = &from[column as usize * BLOCK..][..BLOCK];
                    for (s, x) in sum.iter_mut().zip(row) {
                        *s += weight * x;
                    }
                }
                out.copy_from_slice(&sum);
            }
        });
    }

    /// This matrix × `other`, columns of a row in rising order.
    pub fn times(&self, other: &Self) -> Self {
        let row = |row: usize| -> Vec<(u32, f64)> {
            let terms = self.row(row).iter().flat_map(|&(middle, weight)| {
                let of = other.row(middle as usize).iter();
                of.map(move |&(column, value)| (column, weight * value))
            });
            let mut terms: Vec<(u32, f64)> = terms.collect();
            // What is added up stays in the order it came in.
            terms.sort_by_key(|term| term.0);
            terms.dedup_by(|next, sum| {
                let same = next.0 == sum.0;
                sum.1 += if same { next.1 } else { 0.0 };
                same
            });
            terms
        };
        let rows: Vec<_> = (0..self.count()).into_par_iter().map(row).collect();
        let mut product = Self::default();
        for row in rows {
            product.push(row);
        }
        product
    }
}
