//! What outputs read of loads, with one side solved above a cut of the elimination tree and the other divided out below it
//! ([`super::solver::ReducedBlock`]).

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::rows::SparseRows;
use super::solver::{BLOCK, Cut, ReducedBlock, SolveScratch, common};
use super::spare::Spare;
use super::system::{Needed, System};
use crate::budget::{Cancelled, Watch, report};
use crate::memory;

/// Rows over solved blocks, in blocks of neighbours, with what of the factor they reach.
pub(super) struct Reaching<'a> {
    rows: &'a SparseRows,
    blocks: Vec<Reached>,
}

/// A block of rows, by their numbers, and the supernodes that they reach, rising.
struct Reached {
    rows: Vec<u32>,
    nodes: Vec<u32>,
}

/// What was read, block by block: the rows of one side that it holds, and values.
pub(super) type ReadBlocks = Vec<(Vec<u32>, Vec<f64>)>;

/// Multiplications that four ways take: to solve for one side or for the other, all the way or above the cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    pub one: f64,
    pub other: f64,
    pub one_above: f64,
    pub other_above: f64,
}

/// Rows that are kept while those of the other side pass by take this share of the memory that is allowed.
const KEPT: f64 = 0.125;
/// Blocks of either side that stand for all when costs are counted.
const SAMPLE: usize = 48;

impl<'a> Reaching<'a> {
    /// Of some rows over the solved blocks of a system.
    pub fn new(system: &System, rows: &'a SparseRows) -> Self {
        let blocks = rows.in_blocks().into_par_iter().map(|numbers| {
            let places = (numbers.iter()).flat_map(|&row| rows.row(row as usize).iter());
            Reached {
                nodes: system.reach(places.map(|entry| entry.0)),
                rows: numbers,
            }
        });
        Self {
            rows,
            blocks: blocks.collect(),
        }
    }

    /// The rows themselves.
    pub fn rows(&self) -> &SparseRows {
        self.rows
    }

    /// What is needed of solved blocks that all of it is read of.
    pub fn needed(&self, system: &System) -> Needed {
        system.needed(self.blocks.iter().flat_map(|block| &block.nodes))
    }

    /// Entries of the factor that all blocks meet on their way up.
    fn entries(&self, system: &System) -> f64 {
        let nodes = self.blocks.iter().flat_map(|block| &block.nodes);
        nodes.map(|&node| system.extent(node).1).sum()
    }

    /// Evenly chosen blocks, and how many each stands for.
    fn sample(&self) -> (impl Iterator<Item = &Reached>, f64) {
        let step = self.blocks.len().div_ceil(SAMPLE).max(1);
        let taken = self.blocks.len().div_ceil(step).max(1);
        let each = self.blocks.len() as f64 / taken as f64;
        (self.blocks.iter().step_by(step), each)
    }

    /// Multiplications of reading all rows in solved blocks of the other side.
    fn applied(&self, to: &Self) -> f64 {
        /// They take longer than those of a factor: next to nothing is used twice.
        const EACH: f64 = 3.0;
        let entries: usize = (0..self.rows.count())
            .map(|row| self.rows.row(row).len())
            .sum();
        EACH * entries as f64 * to.blocks.len() as f64
    }

    /// What the four ways take to read this side of another, which reads what is solved for this one cheaply.
    pub fn costs(&self, other: &Self, system: &System) -> Costs {
        let cut = system.cut();
        let [up, up_other] = [self, other].map(|side| side.entries(system));
        let down = |side: &Self, needed: &Needed| side.blocks.len() as f64 * system.entries(needed);
        let all = |side: &Self, read: &Self| down(side, &read.needed(system));
        let above = |side: &Self, up: f64, read: &Self| {
            let solved = up + down(side, &read.needed(system).above(&cut));
            let divided = read.below(&cut, system);
            BLOCK as f64 * (solved + divided) + side.products(read, &cut, system)
        };
        let block = BLOCK as f64;
        Costs {
            one: block * (up + all(self, other)),
            other: block * (up_other + all(other, self) + self.applied(other)),
            one_above: above(self, up, other),
            other_above: above(other, up_other, self),
        }
    }

    /// Entries of the factor that all blocks meet below a cut.
    fn below(&self, cut: &Cut, system: &System) -> f64 {
        let nodes = self.blocks.iter().flat_map(|block| &block.nodes);
        let below = nodes.filter(|&&node| !cut.is_above(node));
        below.map(|&node| system.extent(node).1).sum()
    }

    /// Multiplications of what this side, solved above a cut, and another one, divided below it, are multiplied with each other.
    fn products(&self, divided: &Self, cut: &Cut, system: &System) -> f64 {
        let (others, each_other) = divided.sample();
        let mut rows = 0.0;
        for other in others {
            let (nodes, above) = divided.reached(other, cut, system);
            let (own, each) = self.sample();
            for block in own {
                rows += each * each_other * above.len() as f64;
                common(&nodes, &block.nodes, |at, _| {
                    rows += each * each_other * system.extent(nodes[at]).0 as f64;
                });
            }
        }
        (BLOCK * BLOCK) as f64 * rows
    }

    /// The supernodes that a block reaches below a cut, and the rows above on which it leaves something.
    fn reached(&self, block: &Reached, cut: &Cut, system: &System) -> (Vec<u32>, Vec<u32>) {
        let below = block.nodes.iter().copied();
        let below: Vec<u32> = below.filter(|&node| !cut.is_above(node)).collect();
        let rows = block.rows.iter();
        let places = rows.flat_map(|&row| self.rows.row(row as usize).iter().map(|e| e.0));
        let above = system.rows_above(&below, places, cut);
        (below, above)
    }

    /// What each row, as a load, does by what it moves: fᵀ K⁻¹ f = |L⁻¹ f|².
    pub fn works(&self, system: &System) -> Vec<f64> {
        let cut = system.cut_at_the_root();
        let of_block = |(scratch, own): &mut (SolveScratch, ReducedBlock), block: &Reached| {
            let reached = (&block.nodes[..], &[][..]);
            system.reduce((self.rows, &block.rows), reached, &cut, scratch, own);
            own.squares()
        };
        let blocks = self.blocks.par_iter();
        let found: Vec<[f64; BLOCK]> = blocks.map_init(Default::default, of_block).collect();
        let mut works = vec![0.0; self.rows.count()];
        for (block, squares) in self.blocks.iter().zip(found) {
            for (&row, square) in block.rows.iter().zip(squares) {
                works[row as usize] = square;
            }
        }
        works
    }

    /// Runs of blocks that fit into the memory for what is kept.
    fn runs(&self, cut: &Cut, system: &System) -> Vec<&[Reached]> {
        let rows = |block: &Reached| -> f64 {
            let (nodes, above) = self.reached(block, cut, system);
            let below = nodes.iter().map(|&node| system.extent(node).0);
            (below.sum::<usize>() + above.len()) as f64
        };
        let sizes: Vec<f64> = self.blocks.par_iter().map(rows).collect();
        let room = KEPT * memory::allowed() / (BLOCK * size_of::<f64>()) as f64;
        let (mut runs, mut from, mut taken) = (Vec::new(), 0, 0.0);
        for (at, more) in sizes.into_iter().enumerate() {
            if taken + more > room && at > from {
                runs.push(&self.blocks[from..at]);
                (from, taken) = (at, 0.0);
            }
            taken += more;
        }
        runs.push(&self.blocks[from..]);
        runs
    }

    /// This side, solved above the cut, and another that is divided below it and `kept`. For every block of this side which
    /// rows it holds and, by rows of `width` values each, what `kept` gives with it:
    /// `place` says where the value of a column of the block (of so many) and a row of `kept` stands.
    pub fn read(
        &self,
        kept: &Self,
        system: &System,
        stage: &'static str,
        watch: Watch,
        place: impl Fn(usize, usize, usize) -> usize + Sync,
    ) -> Result<ReadBlocks, Cancelled> {
        let cut = system.cut();
        let needed = kept.needed(system).above(&cut);
        let empty = |block: &Reached| Mutex::new(vec![0.0; block.rows.len() * kept.rows.count()]);
        let read: Vec<Mutex<Vec<f64>>> = self.blocks.iter().map(empty).collect();
        let runs = kept.runs(&cut, system);
        let all = runs.len() * self.rows.count();
        let done = AtomicUsize::new(0);
        let spare = Spare::default();
        for run in runs {
            let divided = kept.divided(run, &cut, system, &|| {
                report(watch, stage, done.load(Ordering::Relaxed), all)
            })?;
            let begin = || (system.block(), Vec::new(), vec![0.0; BLOCK * BLOCK]);
            let of_block = |(block, values): (&Reached, &Mutex<Vec<f64>>)| {
                report(watch, stage, done.load(Ordering::Relaxed), all)?;
                let mut values = values.lock().unwrap_or_else(PoisonError::into_inner);
                let width = block.rows.len();
                spare.with(begin, |(solved, gathered, tile)| {
                    let rows = (self.rows, &block.rows[..]);
                    system.solve_block(rows, |node| needed.is_needed(node), solved);
                    for (other, reach) in divided.iter().zip(run) {
                        system.read(other, (&solved.rows, &block.nodes), gathered, tile);
                        for (column, tile) in tile.chunks_exact(BLOCK).take(width).enumerate() {
                            for (&row, &value) in reach.rows.iter().zip(tile) {
                                values[place(column, width, row as usize)] = value;
                            }
                        }
                    }
                });
                done.fetch_add(width, Ordering::Relaxed);
                Ok(())
            };
            let in_turn = system.in_turn(self.blocks.len());
            let blocks = self.blocks.par_iter().zip(&read).with_min_len(in_turn);
            blocks.try_for_each(of_block)?;
        }
        let blocks = self.blocks.iter().zip(read).map(|(block, values)| {
            let values = values.into_inner().unwrap_or_else(PoisonError::into_inner);
            (block.rows.clone(), values)
        });
        Ok(blocks.collect())
    }

    /// Some blocks of this side with the lower triangle divided out below a cut.
    fn divided(
        &self,
        run: &[Reached],
        cut: &Cut,
        system: &System,
        go_on: &(dyn Fn() -> Result<(), Cancelled> + Sync),
    ) -> Result<Vec<ReducedBlock>, Cancelled> {
        let divide = |scratch: &mut SolveScratch, block: &Reached| {
            go_on()?;
            let mut reduced = ReducedBlock::default();
            let (nodes, above) = self.reached(block, cut, system);
            let rows = (self.rows, &block.rows[..]);
            system.reduce(rows, (&nodes, &above), cut, scratch, &mut reduced);
            Ok(reduced)
        };
        let blocks = run.par_iter().map_init(SolveScratch::default, divide);
        blocks.collect()
    }
}
