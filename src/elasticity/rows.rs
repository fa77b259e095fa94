//! Sparse rows that are applied to blocks of solutions.

use std::collections::BTreeMap;

use super::solver::BLOCK;

/// A sparse matrix by rows, each a list of (column, weight).
#[derive(Clone, Debug)]
pub(super) struct Rows {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Default for Rows {
    fn default() -> Self {
        Self {
            starts: vec![0],
            entries: Vec::new(),
        }
    }
}

impl Rows {
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
        let mut product = Self::default();
        for row in 0..self.count() {
            let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
            for &(middle, weight) in self.row(row) {
                for &(column, value) in other.row(middle as usize) {
                    *sum.entry(column).or_default() += weight * value;
                }
            }
            product.push(sum);
        }
        product
    }
}
