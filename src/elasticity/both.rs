//! What outputs read of loads, with the lower triangle of the stiffness divided out of both ([`super::solver::Reduced`]).

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::rows::Rows;
use super::solver::{BLOCK, Reduced, Scratch, common};
use super::system::{Needed, System};
use crate::budget::{Cancelled, Watch, report};
use crate::memory;

/// Rows over solved blocks, in blocks of neighbours, with what of the factor they reach.
pub(super) struct Reaching<'a> {
    rows: &'a Rows,
    blocks: Vec<Reach>,
}

/// A block of rows, by their numbers, and the supernodes that they reach, rising.
struct Reach {
    rows: Vec<u32>,
    nodes: Vec<u32>,
}

/// What was read, block by block: the rows of one side that it holds, and values.
pub(super) type Blocks = Vec<(Vec<u32>, Vec<f64>)>;

/// Multiplications that three ways take: to solve for one side, for the other, and to divide out of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs {
    pub one: f64,
    pub other: f64,
    pub both: f64,
}

/// Rows that are kept while those of the other side pass by take this share of the memory that is allowed.
const KEPT: f64 = 0.125;
/// Blocks of either side that stand for all when costs are counted.
const SAMPLE: usize = 48;

impl<'a> Reaching<'a> {
    /// Of some rows over the solved blocks of a system.
    pub fn new(system: &System, rows: &'a Rows) -> Self {
        let blocks = rows.in_blocks().into_par_iter().map(|numbers| {
            let places = (numbers.iter()).flat_map(|&row| rows.row(row as usize).iter());
            Reach {
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
    pub fn rows(&self) -> &Rows {
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
    fn sample(&self) -> (impl Iterator<Item = &Reach>, f64) {
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

    /// What the three ways take to read this side of another, which reads what is solved for this one cheaply.
    pub fn costs(&self, other: &Self, system: &System) -> Costs {
        let [up, up_other] = [self, other].map(|side| side.entries(system));
        let down = |side: &Self, read: &Self| {
            side.blocks.len() as f64 * system.entries(&read.needed(system))
        };
        let (own, each) = self.sample();
        let mut shared = 0.0;
        for block in own {
            let (others, each_other) = other.sample();
            for beside in others {
                common(&block.nodes, &beside.nodes, |at, _| {
                    shared += each * each_other * system.extent(block.nodes[at]).0 as f64;
                });
            }
        }
        let block = BLOCK as f64;
        Costs {
            one: block * (up + down(self, other)),
            other: block * (up_other + down(other, self) + self.applied(other)),
            both: block * (up + up_other + block * shared),
        }
    }

    /// What each row, as a load, does by what it moves: fᵀ K⁻¹ f = |L⁻¹ f|².
    pub fn works(&self, system: &System) -> Vec<f64> {
        let of_block = |(scratch, own): &mut (Scratch, Reduced), block: &Reach| {
            system.reduce((self.rows, &block.rows), &block.nodes, scratch, own);
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
    fn runs(&self, system: &System) -> Vec<&[Reach]> {
        let room = KEPT * memory::allowed() / (BLOCK * size_of::<f64>()) as f64;
        let rows = |block: &Reach| -> f64 {
            let nodes = block.nodes.iter();
            nodes.map(|&node| system.extent(node).0 as f64).sum()
        };
        let (mut runs, mut from, mut taken) = (Vec::new(), 0, 0.0);
        for (at, block) in self.blocks.iter().enumerate() {
            let more = rows(block);
            if taken + more > room && at > from {
                runs.push(&self.blocks[from..at]);
                (from, taken) = (at, 0.0);
            }
            taken += more;
        }
        runs.push(&self.blocks[from..]);
        runs
    }

    /// For every block of this side which rows it holds and, by rows of `width` values each, what `kept` gives with it:
    /// `place` says where the value of a column of the block (of so many) and a row of `kept` stands.
    pub fn read(
        &self,
        kept: &Self,
        system: &System,
        stage: &'static str,
        watch: Watch,
        place: impl Fn(usize, usize, usize) -> usize + Sync,
    ) -> Result<Blocks, Cancelled> {
        let empty = |block: &Reach| vec![0.0; block.rows.len() * kept.rows.count()];
        let mut read: Vec<Vec<f64>> = self.blocks.iter().map(empty).collect();
        let runs = kept.runs(system);
        let all = runs.len() * self.rows.count();
        let done = AtomicUsize::new(0);
        for run in runs {
            let reduced: Result<Vec<Reduced>, Cancelled> = (run.par_iter())
                .map_init(Scratch::default, |scratch, block| {
                    report(watch, stage, done.load(Ordering::Relaxed), all)?;
                    let mut reduced = Reduced::default();
                    let rows = (kept.rows, &block.rows[..]);
                    system.reduce(rows, &block.nodes, scratch, &mut reduced);
                    Ok(reduced)
                })
                .collect();
            let reduced = reduced?;
            let streamed = self.blocks.par_iter().zip(&mut read);
            let begin = || {
                (
                    Scratch::default(),
                    Reduced::default(),
                    vec![0.0; BLOCK * BLOCK],
                )
            };
            streamed.try_for_each_init(begin, |(scratch, own, tile), (block, values)| {
                report(watch, stage, done.load(Ordering::Relaxed), all)?;
                let rows = (self.rows, &block.rows[..]);
                system.reduce(rows, &block.nodes, scratch, own);
                let width = block.rows.len();
                for (other, reach) in reduced.iter().zip(run) {
                    own.times(other, tile);
                    for (column, tile) in tile.chunks_exact(BLOCK).take(width).enumerate() {
                        for (&row, &value) in reach.rows.iter().zip(tile) {
                            values[place(column, width, row as usize)] = value;
                        }
                    }
                }
                done.fetch_add(width, Ordering::Relaxed);
                Ok(())
            })?;
        }
        let numbers = self.blocks.iter().map(|block| block.rows.clone());
        Ok(numbers.zip(read).collect())
    }
}
