//! Symmetric sparse matrices, and why one could not be factored.

/// Why the factorization failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FactorError {
    /// A pivot that is not positive.
    NotPositive {
        /// Which row it stands in.
        row: usize,
    },
    /// The allocator had no memory for it.
    OutOfMemory,
    /// The matrix and its factor would take more memory than they may.
    TooLarge {
        /// Of both together.
        bytes: f64,
    },
    /// Whoever waited for it asked to stop.
    Cancelled,
}

/// The lower triangle of a symmetric matrix, by columns.
pub struct SymmetricMatrix {
    /// Where each column begins in `rows` and `values`, and the end of the last: dimension + 1 of them.
    pub columns: Vec<usize>,
    /// Row of each entry, rising within a column, the diagonal first.
    pub rows: Vec<usize>,
    /// Value of each entry, beside its row.
    pub values: Vec<f64>,
}

impl SymmetricMatrix {
    /// Number of rows, and of columns.
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

    /// The entry on the diagonal of a column.
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
