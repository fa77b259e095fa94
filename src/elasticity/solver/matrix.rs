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

    /// Adds to entries of a column that stand side by side in the pattern, from the one in this row on.
    pub fn add_run(&mut self, row: usize, column: usize, values: impl Iterator<Item = f64>) {
        let range = self.columns[column]..self.columns[column + 1];
        let found = self.rows[range.clone()].binary_search(&row);
        debug_assert!(found.is_ok(), "({row}, {column}) is not in the pattern");
        if let Ok(place) = found {
            let into = self.values[range.start + place..range.end].iter_mut();
            for (into, value) in into.zip(values) {
                *into += value;
            }
        }
    }

    /// The entry on the diagonal of a column.
    pub fn diagonal(&self, column: usize) -> f64 {
        // The diagonal is the first entry of its column in a lower triangle.
        self.values[self.columns[column]]
    }
}

/// The lower triangle with rows and columns in the order of elimination, scaled to a unit diagonal.
pub struct Scaled {
    columns: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

/// Bytes of an entry of each of the two.
const AN_ENTRY: usize = size_of::<usize>() + size_of::<f64>();
const A_SCALED_ENTRY: usize = size_of::<u32>() + size_of::<f64>();

impl Scaled {
    /// `order` is where each row stands in the order of elimination. The matrix goes: its factor needs the memory.
    pub fn new(matrix: SymmetricMatrix, scale: &[f64], order: &[u32]) -> Self {
        let n = matrix.dimension();
        let SymmetricMatrix {
            columns: starts,
            rows: below,
            values: entries,
        } = matrix;
        let each = |visit: &mut dyn FnMut(u32, u32, f64)| {
            for column in 0..n {
                let (at, by) = (order[column], scale[column]);
                for k in starts[column]..starts[column + 1] {
                    let row = below[k];
                    let other = order[row];
                    let value = entries[k] * by * scale[row];
                    visit(at.min(other), at.max(other), value);
                }
            }
        };
        let mut columns = vec![0; n + 1];
        each(&mut |column, _, _| columns[column as usize + 1] += 1);
        for column in 0..n {
            columns[column + 1] += columns[column];
        }
        let mut next = columns.clone();
        let mut rows = vec![0; columns[n]];
        let mut values = vec![0.0; columns[n]];
        each(&mut |column, row, value| {
            let at = next[column as usize];
            (rows[at], values[at]) = (row, value);
            next[column as usize] += 1;
        });
        Self {
            columns,
            rows,
            values,
        }
    }

    /// Entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// The rows and values of a column.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (u32, f64)> {
        let range = self.columns[column]..self.columns[column + 1];
        let rows = self.rows[range.clone()].iter().copied();
        rows.zip(self.values[range].iter().copied())
    }

    /// xᵀ A x of several x side by side, `count` to a row.
    pub fn quadratic(&self, x: &[f64], count: usize) -> Vec<f64> {
        let of = |row: usize| &x[row * count..][..count];
        let mut sums = vec![0.0; count];
        for column in 0..self.columns.len() - 1 {
            for (row, value) in self.column(column) {
                let row = row as usize;
                let value = if row == column { value } else { 2.0 * value };
                for (sum, (x, y)) in sums.iter_mut().zip(of(row).iter().zip(of(column))) {
                    *sum += value * x * y;
                }
            }
        }
        sums
    }

    /// y = A x.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..self.columns.len() - 1 {
            for (row, value) in self.column(column) {
                let row = row as usize;
                y[row] += value * x[column];
                if row != column {
                    y[column] += value * x[row];
                }
            }
        }
        y
    }
}

/// Memory that a matrix of so many entries takes until it is scaled.
#[must_use]
pub fn bytes(entries: f64) -> f64 {
    entries * (AN_ENTRY + A_SCALED_ENTRY) as f64
}

/// Memory of a matrix of so many entries and of its factor at their largest: until it is scaled, and while it is factored.
#[must_use]
pub fn bytes_with(factor: f64, entries: f64) -> f64 {
    let scaled = entries * A_SCALED_ENTRY as f64;
    bytes(entries).max(scaled + factor * size_of::<f64>() as f64)
}
