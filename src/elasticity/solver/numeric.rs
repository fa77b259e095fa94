//! The numbers of the factor: each supernode gathers what those before it say, and is then factored as a dense
//! matrix (left-looking; T. A. Davis, Direct Methods for Sparse Linear Systems, 2006, chapter 4).
//!
//! The library's own does the same in one call that nobody can stop. What runs side by side here is cut by the
//! matrix, never by the number of threads, so that the factor is the same on any number of them.

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltError, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par, Spec};
use rayon::prelude::*;

use super::matrix::{FactorError, Scaled};
use crate::budget::{Watch, report};

/// Columns and rows that are worked on together.
const PANEL: usize = 128;
const ROWS: usize = 256;
/// Multiplications from which on it pays to share them out.
const SHARED: f64 = 4e6;
/// Progress is in so many parts of the multiplications.
const PARTS: usize = 1000;

/// Fills the values of the factor, for which there is room. `supernode` names the one that each row belongs to.
///
/// # Errors
/// [`FactorError::NotPositive`] with the row in the order of elimination, and [`FactorError::Cancelled`].
pub(super) fn factorize(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    matrix: &Scaled,
    supernode: &[u32],
    values: &mut Vec<f64>,
    watch: Watch,
) -> Result<(), FactorError> {
    let count = symbolic.n_supernodes();
    let starts = symbolic.col_ptr_for_val();
    let mut fronts = Fronts {
        symbolic,
        next: vec![0; count],
        waiting: vec![Vec::new(); count],
        local: vec![0; supernode.len()],
    };
    let mut meter = FactorMeter::new(symbolic, watch);
    for s in 0..count {
        // Not all at once: a large piece of new memory is slow to come.
        values.resize(starts[s + 1], 0.0);
        let (done, own) = values.split_at_mut(starts[s]);
        let begin = symbolic.supernode_begin()[s];
        let height = fronts.assemble(s, matrix, own);
        fronts.gather(s, done, own);
        let width = own.len() / height;
        dense(own, height, width, &mut meter).map_err(|stop| match stop {
            FactorError::NotPositive { row } => FactorError::NotPositive { row: begin + row },
            other => other,
        })?;
        fronts.pass_on(s, supernode);
    }
    Ok(())
}

/// What is between the supernodes while the factor grows.
struct Fronts<'a> {
    symbolic: &'a SymbolicSupernodalCholesky<usize>,
    /// Where in the pattern of each factored supernode the rows begin that it has not told yet.
    next: Vec<usize>,
    /// Factored supernodes whose next rows lie in this one.
    waiting: Vec<Vec<u32>>,
    /// Row of the present front, for its rows.
    local: Vec<u32>,
}

impl Fronts<'_> {
    /// Puts the entries of the matrix into a front; gives its height.
    fn assemble(&mut self, s: usize, matrix: &Scaled, own: &mut [f64]) -> usize {
        let node = self.symbolic.supernode(s);
        let (begin, end) = (node.start(), self.symbolic.supernode_end()[s]);
        let rows = (begin..end).chain(node.pattern().iter().copied());
        for (at, row) in rows.enumerate() {
            self.local[row] = at as u32;
        }
        let height = end - begin + node.pattern().len();
        for (column, into) in (begin..end).zip(own.chunks_exact_mut(height)) {
            for (row, value) in matrix.column(column) {
                into[self.local[row as usize] as usize] += value;
            }
        }
        height
    }

    /// Takes away what the supernodes waiting for this one say.
    fn gather(&self, s: usize, done: &[f64], own: &mut [f64]) {
        let begin = self.symbolic.supernode_begin()[s];
        let end = self.symbolic.supernode_end()[s];
        let height = own.len() / (end - begin);
        let panel = |number: usize, panel: &mut [f64], buffer: &mut Vec<f64>| {
            let first = begin + number * PANEL;
            let last = (first + PANEL).min(end);
            for &d in &self.waiting[s] {
                self.update(d as usize, first..last, done, panel, height, buffer);
            }
        };
        let cost = |&d: &u32| {
            let node = self.symbolic.supernode(d as usize);
            let rows = node.pattern().len() - self.next[d as usize];
            rows as f64 * (self.symbolic.supernode_end()[d as usize] - node.start()) as f64
        };
        let shared = self.waiting[s].iter().map(cost).sum::<f64>() * (end - begin) as f64 > SHARED;
        if shared && end - begin > PANEL {
            own.par_chunks_mut(PANEL * height)
                .enumerate()
                .for_each_init(Vec::new, |buffer, (k, p)| panel(k, p, buffer));
        } else {
            let mut buffer = Vec::new();
            for (k, p) in own.chunks_mut(PANEL * height).enumerate() {
                panel(k, p, &mut buffer);
            }
        }
    }

    /// What a factored supernode says of some columns, taken away from their panel.
    fn update(
        &self,
        d: usize,
        Range {
            start: first,
            end: last,
        }: Range<usize>,
        done: &[f64],
        panel: &mut [f64],
        height: usize,
        buffer: &mut Vec<f64>,
    ) {
        let node = self.symbolic.supernode(d);
        let width = self.symbolic.supernode_end()[d] - node.start();
        let left = &node.pattern()[self.next[d]..];
        let from = left.partition_point(|&r| r < first);
        let columns = left[from..].partition_point(|&r| r < last);
        if columns == 0 {
            return;
        }
        let rows = &left[from..];
        let starts = self.symbolic.col_ptr_for_val();
        let tall = width + node.pattern().len();
        let l = MatRef::from_column_major_slice(&done[starts[d]..starts[d + 1]], tall, width);
        let l = l.subrows(tall - rows.len(), rows.len());
        buffer.clear();
        buffer.resize(rows.len() * columns, 0.0);
        let mut product = MatMut::from_column_major_slice_mut(buffer, rows.len(), columns);
        matmul(
            product.rb_mut(),
            Accum::Replace,
            l,
            l.subrows(0, columns).transpose(),
            1.0,
            Par::Seq,
        );
        for (j, product) in buffer.chunks_exact(rows.len()).enumerate() {
            let into = &mut panel[(rows[j] - first) * height..][..height];
            for (&row, value) in rows[j..].iter().zip(&product[j..]) {
                into[self.local[row] as usize] -= value;
            }
        }
    }

    /// Lets the supernodes that waited for this one, and itself, wait for the next that they have rows in.
    fn pass_on(&mut self, s: usize, supernode: &[u32]) {
        let end = self.symbolic.supernode_end()[s];
        let mut descendants = std::mem::take(&mut self.waiting[s]);
        descendants.push(s as u32);
        for d in descendants {
            let pattern = self.symbolic.supernode(d as usize).pattern();
            let next = &mut self.next[d as usize];
            *next += pattern[*next..].partition_point(|&r| r < end);
            if let Some(&row) = pattern.get(*next) {
                self.waiting[supernode[row] as usize].push(d);
            }
        }
    }
}

/// Factors the columns of a front, panel by panel: its first rows are symmetric, those below hang on.
fn dense(
    front: &mut [f64],
    height: usize,
    width: usize,
    meter: &mut FactorMeter,
) -> Result<(), FactorError> {
    let scratch = cholesky_in_place_scratch::<f64>(PANEL, Par::Seq, Spec::default());
    let mut memory = MemBuffer::try_new(scratch).map_err(|_| FactorError::OutOfMemory)?;
    for first in (0..width).step_by(PANEL) {
        let columns = PANEL.min(width - first);
        let (before, rest) = front.split_at_mut(first * height);
        let before = MatRef::from_column_major_slice(before, height, first);
        let before = before.subrows(first, height - first);
        let panel =
            MatMut::from_column_major_slice_mut(&mut rest[..columns * height], height, columns);
        let mut panel = panel.subrows_mut(first, height - first);
        let pivot_rows = before.subrows(0, columns).transpose();
        let update = |(at, mut rows): (usize, MatMut<'_, f64>)| {
            let before = before.subrows(at, rows.nrows());
            matmul(
                rows.rb_mut(),
                Accum::Add,
                before,
                pivot_rows,
                -1.0,
                Par::Seq,
            );
        };
        let shared = (height - first) as f64 * (columns * (first + columns)) as f64 > SHARED;
        if first > 0 {
            each_rows(panel.rb_mut(), shared, update);
        }
        let (mut top, below) = panel.split_at_row_mut(columns);
        cholesky_in_place(
            top.rb_mut(),
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        )
        .map_err(
            |LltError::NonPositivePivot { index }| FactorError::NotPositive { row: first + index },
        )?;
        let top = top.rb();
        each_rows(below, shared, |(_, rows)| {
            solve_lower_triangular_in_place(top, rows.transpose_mut(), Par::Seq);
        });
        meter.advance(height, columns)?;
    }
    Ok(())
}

/// Works on all rows of a panel, some at a time.
fn each_rows(
    panel: MatMut<'_, f64>,
    shared: bool,
    work: impl Fn((usize, MatMut<'_, f64>)) + Send + Sync,
) {
    let mut parts = Vec::new();
    let (mut rest, mut at) = (panel, 0);
    while rest.nrows() > ROWS {
        let (part, below) = rest.split_at_row_mut(ROWS);
        parts.push((at, part));
        (rest, at) = (below, at + ROWS);
    }
    if rest.nrows() > 0 {
        parts.push((at, rest));
    }
    if shared {
        parts.into_par_iter().for_each(work);
    } else {
        parts.into_iter().for_each(work);
    }
}

/// Multiplications that a factor takes, about.
pub(super) fn multiplications(symbolic: &SymbolicSupernodalCholesky<usize>) -> f64 {
    let cost = |s: usize| {
        let node = symbolic.supernode(s);
        let width = symbolic.supernode_end()[s] - node.start();
        FactorMeter::cost(width + node.pattern().len(), width)
    };
    (0..symbolic.n_supernodes()).map(cost).sum()
}

/// How far the factor is, by its multiplications.
struct FactorMeter<'a> {
    watch: Watch<'a>,
    total: f64,
    done: f64,
    said: usize,
}

impl<'a> FactorMeter<'a> {
    fn new(symbolic: &SymbolicSupernodalCholesky<usize>, watch: Watch<'a>) -> Self {
        Self {
            watch,
            total: multiplications(symbolic),
            done: 0.0,
            said: 0,
        }
    }

    fn cost(height: usize, columns: usize) -> f64 {
        (height * height) as f64 * columns as f64
    }

    fn advance(&mut self, height: usize, columns: usize) -> Result<(), FactorError> {
        self.done += Self::cost(height, columns);
        let part = ((PARTS as f64 * self.done / self.total) as usize).min(PARTS);
        if part > self.said {
            self.said = part;
            report(self.watch, "Factoring", part, PARTS).map_err(|_| FactorError::Cancelled)?;
        }
        Ok(())
    }
}
