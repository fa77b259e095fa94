//! A factored stiffness, ready for any number of loads, whatever its elements are.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::rows::SparseRows;
use super::solver::{
    BLOCK, Cut, Factor, FactorError, ReducedBlock, Scaled, SolveBlock, SolveScratch,
    SymmetricMatrix, bytes_with,
};
use super::spare::Spare;
use crate::budget::{Cancelled, Watch, Work, report};
use crate::memory;
use crate::tally::{self, Done};

/// Share of the memory that blocks of right-hand sides in work may take together.
const SHARE: f64 = 0.25;

/// What a block of right-hand sides takes (bytes).
fn block_bytes(unknowns: f64) -> f64 {
    unknowns * (BLOCK * size_of::<f64>()) as f64
}

/// What blocks of right-hand sides take while loads are solved for (bytes): two a thread, the one that is solved and the one that
/// is kept for the next.
#[must_use]
pub fn bytes_in_work(unknowns: f64) -> f64 {
    let blocks = 2 * rayon::current_num_threads();
    (blocks as f64 * block_bytes(unknowns)).min(SHARE * memory::allowed())
}

/// Assembled once, factored once.
pub struct System {
    /// Unknown of each degree of freedom, or `HELD`.
    unknowns: Vec<u32>,
    stiffness: Scaled,
    factor: Factor,
    work: Work,
}

/// Which supernodes of solved blocks are read, and all above them.
pub(super) struct Needed(Vec<bool>);

impl Needed {
    /// Whether a supernode is.
    pub fn is_needed(&self, node: usize) -> bool {
        self.0[node]
    }

    /// Without what lies below a cut.
    pub fn above(mut self, cut: &Cut) -> Self {
        for (node, needed) in (0u32..).zip(&mut self.0) {
            *needed &= cut.is_above(node);
        }
        self
    }
}

pub(super) const HELD: u32 = u32::MAX;

/// Numbers the degrees of freedom that are not held.
pub(super) fn number_unknowns(held: impl Iterator<Item = bool>) -> Vec<u32> {
    let mut next = 0;
    held.map(|held| {
        if held {
            HELD
        } else {
            next += 1;
            next - 1
        }
    })
    .collect()
}

impl System {
    /// Factors a stiffness over the unknowns.
    pub(super) fn new(
        unknowns: Vec<u32>,
        stiffness: SymmetricMatrix,
        order: Option<Vec<usize>>,
        watch: Watch,
    ) -> Result<Self, FactorError> {
        tally::count(Done::Factorization, 1);
        let (factor, stiffness) = Factor::new(stiffness, order, watch)?;
        Ok(Self {
            factor,
            unknowns,
            stiffness,
            work: Work {
                assemblies: 1,
                factorizations: 1,
                ..Work::default()
            },
        })
    }

    /// What building cost.
    #[must_use]
    pub fn work(&self) -> Work {
        self.work
    }

    /// Unknown displacements and rotations.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.factor.dimension()
    }

    /// Memory that the matrix and its factor take while it is factored (bytes).
    #[must_use]
    pub fn bytes(&self) -> f64 {
        bytes_with(self.factor.entries(), self.stiffness.entries() as f64)
    }

    /// Freedoms, held ones too.
    #[must_use]
    pub fn dofs(&self) -> usize {
        self.unknowns.len()
    }

    /// Whether a degree of freedom is held.
    #[must_use]
    pub fn is_held(&self, dof: usize) -> bool {
        self.unknowns[dof] == HELD
    }

    /// Smallest pivot of the stiffness scaled to a unit diagonal; its reciprocal bounds the
    /// conditioning from below.
    #[must_use]
    pub fn smallest_pivot(&self) -> f64 {
        self.factor.smallest_pivot
    }

    /// The solution, by degree of freedom, for loads by degree of freedom (N, and N·m on rotations).
    #[must_use]
    pub fn solve_dofs(&self, loads: &[(usize, f64)]) -> Vec<f64> {
        let mut block = self.factor.block();
        self.load(&mut block, 0, loads);
        tally::count(Done::Solve, 1);
        self.factor.solve(&mut block);
        self.column(&block, 0)
    }

    /// As [`Self::solve_dofs`] for several loads, one block at a time.
    #[must_use]
    pub fn solve_loads(&self, loads: &[Vec<(usize, f64)>]) -> Vec<Vec<f64>> {
        let mut solutions = Vec::with_capacity(loads.len());
        let mut block = self.factor.block();
        for chunk in loads.chunks(BLOCK) {
            self.factor.clear(&mut block);
            for (column, load) in chunk.iter().enumerate() {
                self.load(&mut block, column, load);
            }
            tally::count(Done::Solve, chunk.len());
            self.factor.solve(&mut block);
            solutions.extend((0..chunk.len()).map(|column| self.column(&block, column)));
        }
        solutions
    }

    /// One column of a solved block, by degree of freedom.
    fn column(&self, block: &SolveBlock, column: usize) -> Vec<f64> {
        self.unknowns
            .iter()
            .map(|&u| {
                if u == HELD {
                    return 0.0;
                }
                let row = self.factor.order[u as usize] as usize;
                block.rows[row * BLOCK + column] * self.factor.scale[u as usize]
            })
            .collect()
    }

    fn load(&self, block: &mut SolveBlock, column: usize, loads: &[(usize, f64)]) {
        for &(dof, force) in loads {
            let unknown = self.unknowns[dof];
            if unknown != HELD {
                self.factor.load(block, unknown as usize, column, force);
            }
        }
    }

    /// Solutions by degree of freedom, at most `BLOCK`, as the first columns of a solved block.
    pub fn widened(&self, solutions: &[impl AsRef<[f64]>]) -> Vec<f64> {
        let mut rows = vec![0.0; self.dimension() * BLOCK];
        for (column, displacement) in solutions.iter().enumerate() {
            for (dof, &u) in displacement.as_ref().iter().enumerate() {
                if let Some((row, scale)) = self.place(dof) {
                    rows[row as usize * BLOCK + column] = u / scale;
                }
            }
        }
        rows
    }

    /// Where a degree of freedom stands in a solved block and what its value there is to be multiplied with;
    /// nothing where it is held.
    #[must_use]
    pub fn place(&self, dof: usize) -> Option<(u32, f64)> {
        let unknown = self.unknowns[dof];
        (unknown != HELD).then(|| {
            let unknown = unknown as usize;
            (self.factor.order[unknown], self.factor.scale[unknown])
        })
    }

    /// Solves for every row of `loads` (its entries by solver row, as [`Self::place`] gives them) and
    /// hands each block to `consume`: a buffer that may hold anything, which rows the block holds, column by
    /// column, and the solved block, or what is needed of it. The rows are taken in an order in which neighbours share blocks; blocks come back in that order,
    /// which does not depend on the threads.
    pub(super) fn solve_rows<T: Send>(
        &self,
        loads: &SparseRows,
        needed: Option<&Needed>,
        stage: &'static str,
        watch: Watch,
        consume: impl Fn(&mut Vec<f64>, &[u32], &[f64]) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let done = AtomicUsize::new(0);
        let spare = Spare::default();
        let of_chunk = |chunk: &Vec<u32>| {
            report(watch, stage, done.load(Ordering::Relaxed), loads.count())?;
            let begin = || (self.factor.block(), Vec::new());
            spare.with(begin, |(block, buffer)| {
                let is_needed = |s: usize| needed.is_none_or(|needed| needed.is_needed(s));
                self.solve_block((loads, chunk), is_needed, block);
                done.fetch_add(chunk.len(), Ordering::Relaxed);
                Ok(consume(buffer, chunk, &block.rows))
            })
        };
        let blocks = loads.in_blocks();
        let in_turn = self.in_turn(blocks.len());
        (blocks.par_iter().with_min_len(in_turn).map(of_chunk)).collect()
    }

    /// The lower triangle divided out of some rows of `loads`, one column each, below a cut: of the supernodes that they reach
    /// there, with the rows above on which they leave something ([`Factor::reduce`]).
    pub(super) fn reduce(
        &self,
        (loads, rows): (&SparseRows, &[u32]),
        reached: (&[u32], &[u32]),
        cut: &Cut,
        scratch: &mut SolveScratch,
        into: &mut ReducedBlock,
    ) {
        let values = rows.iter().enumerate().flat_map(|(column, &row)| {
            let row = loads.row(row as usize).iter();
            row.map(move |&(place, value)| (place, column, value))
        });
        tally::count(Done::Solve, rows.len());
        self.factor.reduce(reached, cut, values, scratch, into);
    }

    /// How many of so many blocks are taken one after the other, so that those in work together take no more than a share of the
    /// memory, on however many threads.
    pub(super) fn in_turn(&self, blocks: usize) -> usize {
        let at_once = (SHARE * memory::allowed() / block_bytes(self.dimension() as f64)).max(1.0);
        ((blocks as f64 / at_once).ceil() as usize).max(1)
    }

    /// An empty block.
    pub(super) fn block(&self) -> SolveBlock {
        self.factor.block()
    }

    /// Fills a block with some rows of `loads`, one column each, and solves for what is needed; of what is not, it holds the rows
    /// with the lower triangle divided out.
    pub(super) fn solve_block(
        &self,
        (loads, rows): (&SparseRows, &[u32]),
        is_needed: impl Fn(usize) -> bool,
        block: &mut SolveBlock,
    ) {
        self.factor.clear(block);
        for (column, &row) in rows.iter().enumerate() {
            for &(place, value) in loads.row(row as usize) {
                self.factor.load_place(block, place, column, value);
            }
        }
        tally::count(Done::Solve, rows.len());
        self.factor.solve_for(is_needed, block);
    }

    /// What is read of a block that is solved above a cut ([`Factor::read`]).
    pub(super) fn read(
        &self,
        reduced: &ReducedBlock,
        solved: (&[f64], &[u32]),
        gathered: &mut Vec<f64>,
        into: &mut [f64],
    ) {
        self.factor.read(reduced, solved, gathered, into);
    }

    /// Where the elimination tree is cut ([`Factor::cut`]).
    pub(super) fn cut(&self) -> Cut {
        self.factor.cut()
    }

    /// With nothing above.
    pub(super) fn cut_at_the_root(&self) -> Cut {
        Cut::at_the_root(self.factor.supernodes_count())
    }

    /// The rows above a cut on which something is left ([`Factor::rows_above`]).
    pub(super) fn rows_above(
        &self,
        nodes: &[u32],
        rows: impl Iterator<Item = u32>,
        cut: &Cut,
    ) -> Vec<u32> {
        self.factor.rows_above(nodes, rows, cut)
    }

    /// The supernodes that right-hand sides in these rows of solved blocks reach, rising.
    pub(super) fn reach(&self, rows: impl Iterator<Item = u32>) -> Vec<u32> {
        self.factor.reach(rows)
    }

    /// What is needed where these supernodes are, with all above them.
    pub(super) fn needed<'a>(&self, nodes: impl Iterator<Item = &'a u32>) -> Needed {
        let mut needed = vec![false; self.factor.supernodes_count()];
        for &node in nodes {
            needed[node as usize] = true;
        }
        Needed(needed)
    }

    /// Entries of the factor in what is needed.
    pub(super) fn entries(&self, needed: &Needed) -> f64 {
        let nodes = (0u32..).zip(&needed.0).filter(|(_, needed)| **needed);
        nodes.map(|(node, _)| self.extent(node).1).sum()
    }

    /// Columns of a supernode, and entries of the factor in them.
    pub(super) fn extent(&self, node: u32) -> (usize, f64) {
        self.factor.extent(node)
    }

    /// Twice the energy (J) of displacements by degree of freedom.
    #[must_use]
    pub fn twice_energies(&self, displacements: &[Vec<f64>]) -> Vec<f64> {
        let count = displacements.len();
        let mut side_by_side = vec![0.0; self.dimension() * count];
        for (column, displacement) in displacements.iter().enumerate() {
            for (dof, &u) in displacement.iter().enumerate() {
                if let Some((row, scale)) = self.place(dof) {
                    side_by_side[row as usize * count + column] = u / scale;
                }
            }
        }
        self.stiffness.quadratic(&side_by_side, count)
    }

    /// ‖K u - f‖ / ‖f‖ over the unknowns.
    #[must_use]
    pub fn residual(&self, loads: &[(usize, f64)], displacement: &[f64]) -> f64 {
        let (mut u, mut f) = (vec![0.0; self.dimension()], vec![0.0; self.dimension()]);
        for (dof, &displaced) in displacement.iter().enumerate() {
            if let Some((row, scale)) = self.place(dof) {
                u[row as usize] = displaced / scale;
            }
        }
        for &(dof, force) in loads {
            if let Some((row, _)) = self.place(dof) {
                f[row as usize] += force;
            }
        }
        let mut left = 0.0;
        let product = self.stiffness.multiply(&u);
        for (&row, scale) in self.factor.order.iter().zip(&self.factor.scale) {
            left += (product[row as usize] / scale - f[row as usize]).powi(2);
        }
        left.sqrt() / f.iter().map(|f| f * f).sum::<f64>().sqrt()
    }
}
