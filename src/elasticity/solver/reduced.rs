//! Right-hand sides that the lower triangle is divided out of, as far as the elimination tree carries them.
//!
//! With K = L Lᵀ, what outputs B read of loads F is B K⁻¹ F = (L⁻¹ Bᵀ)ᵀ (L⁻¹ F). A load and an output at single places reach only
//! the supernodes above theirs, and have only the last of these in common: two short ways up the tree and a product take
//! much less than a way up and a way down through all of it.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

/// Right-hand sides solved together. Fixed, so that a load gives the same bytes in any company.
pub const BLOCK: usize = 64;

/// One block of them.
#[derive(Default)]
pub struct Reduced {
    /// The supernodes that are reached, rising, and the row here at which the rows of each begin.
    nodes: Vec<u32>,
    pub(super) starts: Vec<usize>,
    /// Row-major, rows × [`BLOCK`].
    pub(super) rows: Vec<f64>,
}

/// What a thread keeps between blocks.
#[derive(Default)]
pub struct Scratch {
    /// By supernode, the row at which its rows begin in a block that reaches it.
    pub(super) starts: Vec<u32>,
    pub(super) below: Vec<f64>,
}

impl Scratch {
    pub(super) fn lay_out(&mut self, count: usize, block: &Reduced) {
        self.starts.resize(count, 0);
        for (&node, &start) in block.nodes.iter().zip(&block.starts) {
            self.starts[node as usize] = start as u32;
        }
    }
}

impl Reduced {
    /// Makes room for supernodes with so many rows each, all zero.
    pub(super) fn lay_out(&mut self, nodes: &[u32], rows: impl Fn(u32) -> usize) {
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.starts.clear();
        self.starts.push(0);
        let mut count = 0;
        for &node in nodes {
            count += rows(node);
            self.starts.push(count);
        }
        self.rows.clear();
        self.rows.resize(count * BLOCK, 0.0);
    }

    /// The square of each column.
    pub fn squares(&self) -> [f64; BLOCK] {
        let mut sums = [0.0; BLOCK];
        for row in self.rows.chunks_exact(BLOCK) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += value * value;
            }
        }
        sums
    }

    /// `into` (by rows, one for each column of this block) = the products of its columns with those of another. What is added up
    /// for a pair of columns, and in which order, does not depend on the others of their blocks: a supernode that only those
    /// reach adds zero.
    pub fn times(&self, other: &Self, into: &mut [f64]) {
        into.fill(0.0);
        let mut product = MatMut::from_row_major_slice_mut(into, BLOCK, BLOCK);
        common(&self.nodes, &other.nodes, |own, others| {
            let [left, right] = [(self, own), (other, others)].map(|(block, at)| {
                let rows = &block.rows[block.starts[at] * BLOCK..block.starts[at + 1] * BLOCK];
                MatRef::from_row_major_slice(rows, rows.len() / BLOCK, BLOCK)
            });
            matmul(
                product.as_mut(),
                Accum::Add,
                left.transpose(),
                right,
                1.0,
                Par::Seq,
            );
        });
    }
}

/// Calls `each` with the places of what two rising lists have in common.
pub fn common(one: &[u32], other: &[u32], mut each: impl FnMut(usize, usize)) {
    let (mut i, mut j) = (0, 0);
    while let (Some(a), Some(b)) = (one.get(i), other.get(j)) {
        match a.cmp(b) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                each(i, j);
                (i, j) = (i + 1, j + 1);
            }
        }
    }
}
