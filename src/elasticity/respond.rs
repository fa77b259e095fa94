//! What given outputs read under given loads, solving for whichever are fewer.
//!
//! With K the stiffness, F the loads and B what is read, the answer is B K⁻¹ F. K is symmetric, so it may
//! be had from a solution for every load or from one for every output (Maxwell–Betti reciprocity).

use rayon::prelude::*;

use super::load::{Push, Touch};
use super::observe::Observer;
use super::rows::Rows;
use super::solver::BLOCK;
use super::{Model, observe};
use crate::budget::{Cancelled, Watch};

/// Which side was solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// One solve a load.
    Loads,
    /// One solve an output, by reciprocity.
    Outputs,
}

/// What is read at the points of an observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading<'a> {
    /// Strain tensors: rows 3 i … 3 i + 2 are xx, yy, 2xy at point i.
    Strain,
    /// As [`Self::Strain`] for all points, then displacements: rows 3 (n + i) … are x, y, z at point i.
    StrainAndDisplacement,
    /// Strain along one direction a point (angle in its frame): row i; then displacements: rows n + 3 i ….
    GaugeAndDisplacement(&'a [f64]),
    /// Strain along one direction a point: row i.
    Gauge(&'a [f64]),
    /// Rows 3 i … 3 i + 2 are x, y, z at point i.
    Displacement,
}

/// Outputs × loads, as it came out of the solver.
pub struct Responses {
    loads: usize,
    rows: usize,
    /// Which side was cheaper and was solved for.
    pub side: Side,
    /// Right-hand sides solved.
    pub solves: usize,
    /// Which loads (outputs) a block holds and, by rows, outputs × its loads (its outputs × all loads).
    blocks: Vec<(Vec<u32>, Vec<f64>)>,
    /// Where each output is when outputs were solved for.
    found: Vec<(u32, u32)>,
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
        if self.side == Side::Outputs {
            let (block, place) = self.found[row];
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

impl Reading<'_> {
    /// Rows for so many points.
    fn rows(&self, points: usize) -> usize {
        match self {
            Self::Strain | Self::Displacement => 3 * points,
            Self::StrainAndDisplacement => 6 * points,
            Self::Gauge(_) => points,
            Self::GaugeAndDisplacement(_) => 4 * points,
        }
    }

    fn displaces(&self) -> bool {
        !matches!(self, Self::Strain | Self::Gauge(_))
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

/// Reads `observer`'s points under all touches, which may push in any direction ([`Push`]).
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn respond(
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    observer: &Observer,
    reading: Reading,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let side = if reading.rows(observer.frames().len()) < touches.len() {
        Side::Outputs
    } else {
        Side::Loads
    };
    respond_from(side, model, touches, observer, reading, watch)
}

/// As [`respond`], solving for the side that is named: both give the same to rounding.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn respond_from(
    side: Side,
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    observer: &Observer,
    reading: Reading,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let loads = touch_rows(model, touches);
    let mut responses = if side == Side::Outputs {
        by_outputs(model, &loads, &output_rows(observer, reading), watch)?
    } else {
        let rows = reading.rows(observer.frames().len());
        by_loads(model, &loads, rows, watch, |buffer, solved, keep| {
            match reading {
                Reading::Strain | Reading::StrainAndDisplacement => {
                    keep(observer.strain_into(solved, buffer));
                }
                Reading::Gauge(angles) | Reading::GaugeAndDisplacement(angles) => {
                    keep(&along_gauges(observer.strain_into(solved, buffer), angles));
                }
                Reading::Displacement => {}
            }
            if reading.displaces() {
                keep(observer.displacement_into(solved, buffer));
            }
        })?
    };
    if reading.displaces()
        && let (Some(from), Some(rows)) = (model.coarser(), observer.coarser_rows())
    {
        let loads = touch_rows(from.model, touches);
        let coarse = displacements(side, from.model, &loads, rows, watch)?;
        responses.solves += coarse.solves;
        responses.carried = Some(Box::new(Carried {
            first: responses.rows - coarse.rows,
            share: from.share,
            coarse,
        }));
    }
    Ok(responses)
}

/// Displacements by `rows` under loads.
fn displacements(
    side: Side,
    model: &dyn Model,
    loads: &Rows,
    rows: &Rows,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    if side == Side::Outputs {
        return by_outputs(model, loads, rows, watch);
    }
    by_loads(model, loads, rows.count(), watch, |buffer, solved, keep| {
        buffer.resize(rows.count() * BLOCK, 0.0);
        rows.apply(solved, buffer);
        keep(buffer);
    })
}

/// So many outputs from a solution for every load; `read` gives them of a solved block, [`BLOCK`] values each.
fn by_loads(
    model: &dyn Model,
    loads: &Rows,
    rows: usize,
    watch: Watch,
    read: impl Fn(&mut Vec<f64>, &[f64], &mut dyn FnMut(&[f64])) + Sync,
) -> Result<Responses, Cancelled> {
    let blocks =
        model
            .system()
            .solve_rows(loads, "Solving touches", watch, |buffer, columns, solved| {
                let width = columns.len();
                // At its full size from the start: this is where the memory of a dataset goes.
                let mut values = Vec::with_capacity(rows * width);
                read(buffer, solved, &mut |rows| {
                    for row in rows.chunks_exact(BLOCK) {
                        values.extend_from_slice(&row[..width]);
                    }
                });
                (columns.to_vec(), values)
            })?;
    Ok(Responses {
        loads: loads.count(),
        rows: if blocks.is_empty() { 0 } else { rows },
        side: Side::Loads,
        solves: loads.count(),
        blocks,
        found: Vec::new(),
        carried: None,
    })
}

/// Touches that ever other gauges are read under: their forces are laid on the model once, and each gauge is solved for.
pub struct Pressed<'a> {
    model: &'a dyn Model,
    loads: Rows,
}

impl<'a> Pressed<'a> {
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
        reading: Reading,
        watch: Watch,
    ) -> Result<Responses, Cancelled> {
        debug_assert!(!reading.displaces(), "displacements may be carried on");
        let outputs = output_rows(observer, reading);
        by_outputs(self.model, &self.loads, &outputs, watch)
    }
}

fn by_outputs(
    model: &dyn Model,
    loads: &Rows,
    outputs: &Rows,
    watch: Watch,
) -> Result<Responses, Cancelled> {
    let blocks =
        model
            .system()
            .solve_rows(outputs, "Solving sites", watch, |wide, rows, solved| {
                wide.resize(loads.count() * BLOCK, 0.0);
                loads.apply(solved, wide);
                let values = (0..rows.len())
                    .flat_map(|k| wide.iter().skip(k).step_by(BLOCK).copied())
                    .collect();
                (rows.to_vec(), values)
            })?;
    let mut found = vec![(0, 0); outputs.count()];
    for (b, (rows, _)) in blocks.iter().enumerate() {
        for (k, &row) in rows.iter().enumerate() {
            found[row as usize] = (b as u32, k as u32);
        }
    }
    Ok(Responses {
        loads: loads.count(),
        rows: outputs.count(),
        side: Side::Outputs,
        solves: outputs.count(),
        blocks,
        found,
        carried: None,
    })
}

/// The touches' nodal forces as rows over solved blocks.
fn touch_rows(model: &dyn Model, touches: &[impl Copy + Sync + Into<Push>]) -> Rows {
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
    let mut rows = Rows::default();
    for row in forces {
        rows.push(row);
    }
    rows
}

pub(super) fn output_rows(observer: &Observer, reading: Reading) -> Rows {
    let gauge = |angles: &[f64]| {
        let mut along = Rows::default();
        for (i, &angle) in (0u32..).zip(angles) {
            let weights = observe::along(angle);
            along.push((0..3).map(|k| (3 * i + k as u32, weights[k])));
        }
        along.times(&observer.strain_rows())
    };
    let both = |mut first: Rows| {
        let displacement = observer.displacement_rows();
        for row in 0..displacement.count() {
            first.push(displacement.row(row).iter().copied());
        }
        first
    };
    match reading {
        Reading::Strain => observer.strain_rows(),
        Reading::StrainAndDisplacement => both(observer.strain_rows()),
        Reading::Gauge(angles) => gauge(angles),
        Reading::GaugeAndDisplacement(angles) => both(gauge(angles)),
        Reading::Displacement => observer.displacement_rows().clone(),
    }
}
