//! Right-hand sides that the lower triangle is divided out of below a cut of the elimination tree.
//!
//! What outputs B read of loads F is B K⁻¹ F with K = L Lᵀ. With the rows in two parts, those below a cut of the tree (1) and
//! those above (2), y = L⁻¹ F and u = K⁻¹ F, it is zᵀ y₁ + rᵀ u₂: z = L₁₁⁻¹ B₁ᵀ is what is divided out of the outputs below, and
//! r = B₂ᵀ - L₂₁ z what that leaves above, on few rows, because an output at a single place reaches one branch
//! only. So a load takes a way up the tree and one down again as far as the cut, not into the many branches below it, and an
//! output a short way up to the cut, not through the large supernodes above.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

/// Right-hand sides solved together. Fixed, so that a load gives the same bytes in any company.
pub const BLOCK: usize = 64;

/// Rows above the cut are multiplied by those of the same so many: which others there are must not change how sums are taken.
const TOGETHER: u32 = 128;

/// One block of them.
#[derive(Default)]
pub struct ReducedBlock {
    /// The supernodes below the cut that are reached, rising, and the row here at which the rows of each begin.
    nodes: Vec<u32>,
    pub(super) starts: Vec<usize>,
    /// The rows above on which anything is left, rising, in the order of elimination. They stand after the others.
    above: Vec<u32>,
    /// Row-major, rows × [`BLOCK`].
    pub(super) rows: Vec<f64>,
}

/// What a thread keeps between blocks.
#[derive(Default)]
pub struct SolveScratch {
    /// By supernode below the cut, the row at which its rows begin in a block that reaches it.
    pub(super) starts: Vec<u32>,
    /// By row above, where it stands in a block that leaves something there.
    pub(super) places: Vec<u32>,
    pub(super) below: Vec<f64>,
}

impl SolveScratch {
    pub(super) fn lay_out(&mut self, (nodes, rows): (usize, usize), block: &ReducedBlock) {
        self.starts.resize(nodes, 0);
        self.places.resize(rows, 0);
        for (&node, &start) in block.nodes.iter().zip(&block.starts) {
            self.starts[node as usize] = start as u32;
        }
        for (&row, place) in block.above.iter().zip(block.below() as u32..) {
            self.places[row as usize] = place;
        }
    }
}

impl ReducedBlock {
    /// Makes room for supernodes with so many rows each, and for rows above, all zero.
    pub(super) fn lay_out(&mut self, nodes: &[u32], above: &[u32], rows: impl Fn(u32) -> usize) {
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.above.clear();
        self.above.extend_from_slice(above);
        self.starts.clear();
        self.starts.push(0);
        let mut count = 0;
        for &node in nodes {
            count += rows(node);
            self.starts.push(count);
        }
        self.rows.clear();
        self.rows.resize((count + above.len()) * BLOCK, 0.0);
    }

    /// How many rows are of supernodes below.
    fn below(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
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

    /// `into` (by rows, one for each column of a solved block) = what the columns of this one read there. The block is solved above
    /// the cut; below, the lower triangle is divided out of it, where it reaches `nodes`. `begin` is the first row of a
    /// supernode in it, `gathered` a buffer. What is added up for a pair of columns, and in which order, does not depend on
    /// the others of their blocks: a row that only those reach adds zero.
    pub(super) fn read(
        &self,
        (solved, nodes): (&[f64], &[u32]),
        begin: impl Fn(u32) -> usize,
        gathered: &mut Vec<f64>,
        into: &mut [f64],
    ) {
        into.fill(0.0);
        common(&self.nodes, nodes, |at, _| {
            let own = &self.rows[self.starts[at] * BLOCK..self.starts[at + 1] * BLOCK];
            let solved = &solved[begin(self.nodes[at]) * BLOCK..][..own.len()];
            add_product(solved, own, into);
        });
        let (mut own, together) = (&self.rows[self.below() * BLOCK..], |a: &u32, b: &u32| {
            a / TOGETHER == b / TOGETHER
        });
        for rows in self.above.chunk_by(together) {
            gathered.clear();
            for &row in rows {
                gathered.extend_from_slice(&solved[row as usize * BLOCK..][..BLOCK]);
            }
            let (these, others) = own.split_at(gathered.len());
            own = others;
            if rows.len() > 1 {
                add_product(gathered, these, into);
            } else {
                // Sums of one product are rounded otherwise than those of several.
                let mut padded = [0.0; 2 * BLOCK];
                padded[..BLOCK].copy_from_slice(these);
                gathered.resize(2 * BLOCK, 0.0);
                add_product(gathered, &padded, into);
            }
        }
    }
}

/// Adds leftᵀ right, of rows of [`BLOCK`] values each, to [`BLOCK`] × [`BLOCK`] values by rows.
fn add_product(left: &[f64], right: &[f64], into: &mut [f64]) {
    let [left, right] =
        [left, right].map(|rows| MatRef::from_row_major_slice(rows, rows.len() / BLOCK, BLOCK));
    let into = MatMut::from_row_major_slice_mut(into, BLOCK, BLOCK);
    matmul(into, Accum::Add, left.transpose(), right, 1.0, Par::Seq);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Of rows above, each with values of its own.
    fn above(rows: &[u32], empty: &[u32]) -> ReducedBlock {
        let of = |row: &u32| -> [f64; BLOCK] {
            let is_empty = empty.contains(row);
            std::array::from_fn(|k| {
                if is_empty {
                    0.0
                } else {
                    f64::from(*row + k as u32).sin()
                }
            })
        };
        ReducedBlock {
            nodes: Vec::new(),
            starts: vec![0],
            above: rows.to_vec(),
            rows: rows.iter().flat_map(of).collect(),
        }
    }

    #[test]
    fn rows_that_only_others_reach_change_no_bit() {
        let solved: Vec<f64> = (0..400 * BLOCK).map(|k| (0.7 * k as f64).cos()).collect();
        let read = |block: &ReducedBlock| {
            let mut into = vec![0.0; BLOCK * BLOCK];
            block.read((&solved, &[]), |_| 0, &mut Vec::new(), &mut into);
            into.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        };
        let alone = read(&above(&[3, 128, 300, 301], &[]));
        let empty = [2, 64, 127, 129, 130, 200, 255, 302, 383];
        let mut rows: Vec<u32> = [3, 128, 300, 301].into_iter().chain(empty).collect();
        rows.sort_unstable();
        assert_eq!(alone, read(&above(&rows, &empty)));
        let naive: f64 = ([3_u32, 128, 300, 301].iter())
            .map(|&row| solved[row as usize * BLOCK + 5] * f64::from(row + 9).sin())
            .sum();
        assert!((f64::from_bits(alone[5 * BLOCK + 9]) - naive).abs() < 1e-12);
    }
}
