//! What given outputs read under given loads, in the way that takes least.
//!
//! With K the stiffness, F the loads and B what is read, the answer is B K⁻¹ F. K is symmetric, so it may
//! be had from a solution for every load or from one for every output (Maxwell–Betti reciprocity), or from one of them solved
//! above a cut of the elimination tree and the other divided out below it (`both.rs`).

use rayon::prelude::*;

use super::both::{Reaching, ReadBlocks};
use super::load::{Push, Touch};
use super::observe::Observer;
use super::rows::SparseRows;
use super::solver::BLOCK;
use super::system::System;
use super::{Model, observe};
use crate::budget::{Cancelled, Watch};

/// Which side was solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolvedSide {
    /// One solve a load.
    Loads,
    /// One solve an output, by reciprocity.
    Outputs,
    /// One solve a load above a cut of the elimination tree; the lower triangle is divided out of the outputs below it.
    LoadsAbove,
    /// As [`Self::LoadsAbove`] with loads and outputs changed about.
    OutputsAbove,
}

/// What is read at the points of an observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity<'a> {
    /// Strain tensors: rows 3 i … 3 i + 2 are xx, yy, 2xy at point i.
    Strain,
    /// As [`Self::Strain`] for all points, then displacements: rows 3 (n + i) … are x, y, z at point i.
    StrainAndDisplacement,
    /// Strain along one direction a point (angle in its frame): row i; then displacements: rows n + 3 i ….
    GaugeAndDisplacement(&'a [f64]),
    /// Strain along one direction a point: row i.
    Gauge(&'a [f64]),
    /// As [`Self::Gauge`] of points in pairs: row i is what gauge 2 i reads more than gauge 2 i + 1, times the number.
    GaugeDifference(&'a [f64], f64),
    /// Rows 3 i … 3 i + 2 are x, y, z at point i.
    Displacement,
}

/// Outputs × loads, as it came out of the solver.
pub struct Responses {
    loads: usize,
    rows: usize,
    /// Which side was solved for, all the way or above the cut: what took least.
    pub side: SolvedSide,
    /// Right-hand sides solved, those of one side only below the cut too.
    pub solves: usize,
    /// Which loads (outputs) a block holds and, by rows, outputs × its loads (its outputs × all loads).
    blocks: ReadBlocks,
    /// Where each output is when blocks are of outputs.
    found: Option<Vec<(u32, u32)>>,
    carried: Option<Box<Carried>>,
}

/// What displacements, from the row `first` on, are carried on from: those of a coarser model ([`super::model::Coarser`]).
struct Carried {
    first: usize,
    share: f64,
    coarse: Responses,
}

impl Responses {
    /// Number of outputs.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// One output under all loads, in their order; `into` has a place for each load.
    pub fn row_into(&self, row: usize, into: &mut [f64]) {
        self.own_row_into(row, into);
        if let Some(carried) = &self.carried
            && row >= carried.first
        {
            let mut coarse = vec![0.0; self.loads];
            (carried.coarse).row_into(row - carried.first, &mut coarse);
            for (fine, coarse) in into.iter_mut().zip(coarse) {
                *fine += carried.share * (*fine - coarse);
            }
        }
    }

    /// As its own model has it.
    fn own_row_into(&self, row: usize, into: &mut [f64]) {
        if let Some(found) = &self.found {
            let (block, place) = found[row];
            let values = &self.blocks[block as usize].1;
            into.copy_from_slice(&values[place as usize * self.loads..][..self.loads]);
            return;
        }
        for (columns, values) in &self.blocks {
            let part = &values[row * columns.len()..][..columns.len()];
            for (&load, &value) in columns.iter().zip(part) {
                into[load as usize] = value;
            }
        }
    }
}

impl Quantity<'_> {
    fn displaces(&self) -> bool {
        match self {
            Self::Strain | Self::Gauge(_) | Self::GaugeDifference(..) => false,
            Self::StrainAndDisplacement | Self::GaugeAndDisplacement(_) | Self::Displacement => {
                true
            }
        }
    }
}

/// Strain along one direction a point from its three components.
fn along_gauges(strain: &[f64], angles: &[f64]) -> Vec<f64> {
    let mut along = Vec::with_capacity(strain.len() / 3);
    for (s, &angle) in strain.chunks_exact(3 * BLOCK).zip(angles) {
        let w = observe::along(angle);
        along.extend(
            (0..BLOCK).map(|k| w[0] * s[k] + w[1] * s[BLOCK + k] + w[2] * s[2 * BLOCK + k]),
        );
    }
    along
}

/// Of gauges in pairs, what the first of each reads more than the second, so many times.
fn differences(along: &[f64], times: f64) -> Vec<f64> {
    let pairs = along.chunks_exact(2 * BLOCK);
    let difference = |pair: &[f64]| -> [f64; BLOCK] {
        std::array::from_fn(|k| times * (pair[k] - pair[BLOCK + k]))
    };
    pairs.flat_map(difference).collect()
}

/// Reads `observer`'s points under all touches, which may push in any direction ([`Push`]).
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn respond(
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    observer: &Observer,
    reading: Quantity,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    by(None, model, touches, observer, reading, watch)
}

/// As [`respond`], solving for the side that is named: all give the same to rounding.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn respond_from(
    side: SolvedSide,
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    observer: &Observer,
    reading: Quantity,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    by(Some(side), model, touches, observer, reading, watch)
}

fn by(
    side: Option<SolvedSide>,
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    observer: &Observer,
    reading: Quantity,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let loads = touch_rows(model, touches);
    let outputs = output_rows(observer, reading);
    let read: BlockReader = &|solved, buffer, keep| {
        match reading {
            Quantity::Strain | Quantity::StrainAndDisplacement => {
                keep(observer.strain_into(solved, buffer));
            }
            Quantity::Gauge(angles) | Quantity::GaugeAndDisplacement(angles) => {
                keep(&along_gauges(observer.strain_into(solved, buffer), angles));
            }
            Quantity::GaugeDifference(angles, times) => {
                let along = along_gauges(observer.strain_into(solved, buffer), angles);
                keep(&differences(&along, times));
            }
            Quantity::Displacement => {}
        }
        if reading.displaces() {
            keep(observer.displacement_into(solved, buffer));
        }
    };
    let mut responses = between(side, model.system(), &loads, (&outputs, read), watch)?;
    if reading.displaces()
        && let (Some(from), Some(outputs)) = (model.coarser(), observer.coarser_rows())
    {
        let loads = touch_rows(from.model, touches);
        let read: BlockReader = &|solved, buffer, keep| {
            buffer.resize(outputs.count() * BLOCK, 0.0);
            outputs.apply(solved, buffer);
            keep(buffer);
        };
        let coarse = between(side, from.model.system(), &loads, (outputs, read), watch)?;
        responses.solves += coarse.solves;
        responses.carried = Some(Box::new(Carried {
            first: responses.rows - coarse.rows,
            share: from.share,
            coarse,
        }));
    }
    Ok(responses)
}

/// Gives all outputs of a solved block, [`BLOCK`] values each, one part after the other, by way of a buffer.
type BlockReader<'a> = &'a (dyn Fn(&[f64], &mut Vec<f64>, &mut dyn FnMut(&[f64])) + Sync);

const TOUCHES: &str = "Solving touches";
const SITES: &str = "Solving sites";

/// Outputs, as rows and as they are read of what is solved, under rows of loads, from the side that is named or the one that takes least.
fn between(
    side: Option<SolvedSide>,
    system: &System,
    loads: &SparseRows,
    (outputs, read): (&SparseRows, BlockReader),
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let of = |rows| Reaching::new(system, rows);
    let (reached_loads, reached_outputs) = (of(loads), of(outputs));
    let side = side.unwrap_or_else(|| {
        let costs = reached_loads.costs(&reached_outputs, system);
        let ways = [
            (SolvedSide::Loads, costs.one),
            (SolvedSide::Outputs, costs.other),
            (SolvedSide::LoadsAbove, costs.one_above),
            (SolvedSide::OutputsAbove, costs.other_above),
        ];
        let least = ways.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        least.map_or(SolvedSide::Loads, |way| way.0)
    });
    match side {
        SolvedSide::Loads => by_loads(system, loads, (&reached_outputs, read), watch),
        SolvedSide::Outputs => by_outputs(system, &reached_loads, outputs, watch),
        SolvedSide::LoadsAbove => {
            let place = |load, width, output| output * width + load;
            let blocks = reached_loads.read(&reached_outputs, system, TOUCHES, watch, place)?;
            Ok(of_loads(side, loads, outputs, blocks))
        }
        SolvedSide::OutputsAbove => {
            let place = |output, _, load| output * loads.count() + load;
            let blocks = reached_outputs.read(&reached_loads, system, SITES, watch, place)?;
            Ok(of_outputs(side, loads, outputs, blocks))
        }
    }
}

fn by_loads(
    system: &System,
    loads: &SparseRows,
    (reached, read): (&Reaching, BlockReader),
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let (outputs, needed) = (reached.rows(), reached.needed(system));
    let blocks = system.solve_rows(
        loads,
        Some(&needed),
        TOUCHES,
        watch,
        |buffer, columns, solved| {
            // At its full size from the start: this is where the memory of a dataset goes.
            let mut values = Vec::with_capacity(outputs.count() * columns.len());
            read(solved, buffer, &mut |rows| {
                for row in rows.chunks_exact(BLOCK) {
                    values.extend_from_slice(&row[..columns.len()]);
                }
            });
            (columns.to_vec(), values)
        },
    )?;
    Ok(of_loads(SolvedSide::Loads, loads, outputs, blocks))
}

fn by_outputs(
    system: &System,
    reached: &Reaching,
    outputs: &SparseRows,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let (loads, needed) = (reached.rows(), reached.needed(system));
    let blocks = system.solve_rows(
        outputs,
        Some(&needed),
        SITES,
        watch,
        |wide, rows, solved| {
            wide.resize(loads.count() * BLOCK, 0.0);
            loads.apply(solved, wide);
            let column = |k| wide.iter().skip(k).step_by(BLOCK).copied();
            (rows.to_vec(), (0..rows.len()).flat_map(column).collect())
        },
    )?;
    Ok(of_outputs(SolvedSide::Outputs, loads, outputs, blocks))
}

/// From blocks of loads, each outputs × its loads.
fn of_loads(
    side: SolvedSide,
    loads: &SparseRows,
    outputs: &SparseRows,
    blocks: ReadBlocks,
) -> Responses {
    Responses {
        loads: loads.count(),
        rows: outputs.count(),
        side,
        solves: solves(side, loads, outputs),
        blocks,
        found: None,
        carried: None,
    }
}

/// From blocks of outputs, each its outputs × loads.
fn of_outputs(
    side: SolvedSide,
    loads: &SparseRows,
    outputs: &SparseRows,
    blocks: ReadBlocks,
) -> Responses {
    let mut found = vec![(0, 0); outputs.count()];
    for (b, (rows, _)) in blocks.iter().enumerate() {
        for (k, &row) in rows.iter().enumerate() {
            found[row as usize] = (b as u32, k as u32);
        }
    }
    Responses {
        found: Some(found),
        ..of_loads(side, loads, outputs, blocks)
    }
}

fn solves(side: SolvedSide, loads: &SparseRows, outputs: &SparseRows) -> usize {
    match side {
        SolvedSide::Loads => loads.count(),
        SolvedSide::Outputs => outputs.count(),
        SolvedSide::LoadsAbove | SolvedSide::OutputsAbove => loads.count() + outputs.count(),
    }
}

/// Touches that ever other gauges are read under: their forces are laid on the model once, and each gauge is solved for.
pub struct PressedModel<'a> {
    model: &'a dyn Model,
    loads: SparseRows,
}

impl<'a> PressedModel<'a> {
    /// These touches as loads of a model.
    #[must_use]
    pub fn new(model: &'a dyn Model, touches: &[Touch]) -> Self {
        let loads = touch_rows(model, touches);
        Self { model, loads }
    }

    /// The model they press.
    #[must_use]
    pub fn model(&self) -> &'a dyn Model {
        self.model
    }

    /// How many there are.
    #[must_use]
    pub fn touches(&self) -> usize {
        self.loads.count()
    }

    /// Reads strains at an observer's points under all of them.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn read(
        &self,
        observer: &Observer,
        reading: Quantity,
        watch: Watch,
    ) -> Result<Responses, Cancelled> {
        debug_assert!(!reading.displaces(), "displacements may be carried on");
        let outputs = output_rows(observer, reading);
        let system = self.model.system();
        by_outputs(system, &Reaching::new(system, &self.loads), &outputs, watch)
    }
}

/// How far a part gives way under each touch, along its force (m): the mean under the tip.
#[must_use]
pub fn gives_way(model: &dyn Model, touches: &[Touch]) -> Vec<f64> {
    let loads = touch_rows(model, touches);
    let works = Reaching::new(model.system(), &loads).works(model.system());
    let mut gives: Vec<f64> = (works.iter().zip(touches))
        .map(|(work, touch)| work / touch.force)
        .collect();
    if let Some(coarser) = model.coarser() {
        for (fine, coarse) in gives.iter_mut().zip(gives_way(coarser.model, touches)) {
            *fine = coarser.carried(*fine, coarse);
        }
    }
    gives
}

/// The touches' nodal forces as rows over solved blocks.
fn touch_rows(model: &dyn Model, touches: &[impl Copy + Sync + Into<Push>]) -> SparseRows {
    let forces: Vec<Vec<(u32, f64)>> = touches
        .par_iter()
        .map(|&touch| {
            (model.push(&touch.into()).into_iter())
                .filter_map(|(dof, force)| {
                    let (place, scale) = model.system().place(dof)?;
                    Some((place, force * scale))
                })
                .collect()
        })
        .collect();
    let mut rows = SparseRows::default();
    for row in forces {
        rows.push(row);
    }
    rows
}

pub(super) fn output_rows(observer: &Observer, reading: Quantity) -> SparseRows {
    let weighed = |(i, angle): (u32, f64), times: f64| {
        let weights = observe::along(angle);
        (0..3).map(move |k| (3 * i + k as u32, times * weights[k]))
    };
    let gauge = |angles: &[f64]| {
        let mut along = SparseRows::default();
        for of in (0u32..).zip(angles.iter().copied()) {
            along.push(weighed(of, 1.0));
        }
        along.times(&observer.strain_rows())
    };
    let difference = |angles: &[f64], times: f64| {
        let mut along = SparseRows::default();
        for (i, pair) in (0u32..).zip(angles.chunks_exact(2)) {
            let more = weighed((2 * i, pair[0]), times);
            along.push(more.chain(weighed((2 * i + 1, pair[1]), -times)));
        }
        along.times(&observer.strain_rows())
    };
    let both = |mut first: SparseRows| {
        let displacement = observer.displacement_rows();
        for row in 0..displacement.count() {
            first.push(displacement.row(row).iter().copied());
        }
        first
    };
    match reading {
        Quantity::Strain => observer.strain_rows(),
        Quantity::StrainAndDisplacement => both(observer.strain_rows()),
        Quantity::Gauge(angles) => gauge(angles),
        Quantity::GaugeAndDisplacement(angles) => both(gauge(angles)),
        Quantity::GaugeDifference(angles, times) => difference(angles, times),
        Quantity::Displacement => observer.displacement_rows().clone(),
    }
}
