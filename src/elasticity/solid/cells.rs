//! Finite cells: a part immersed in a grid whose cells may be larger than its walls.
//!
//! Shape functions live on whole cells, integrals reach only over the material in them (A. Düster, J. Parvizian,
//! Z. Yang and E. Rank 2008). Empty space keeps a trace of the material's stiffness, so that a cell with a sliver
//! of material in a corner does not make the whole singular. The grid stands along the axes of the file, or along those of
//! the boxes that hold the part where these are turned; points, gradients and displacements are the file's for everybody
//! else.

use std::sync::OnceLock;

use faer::{Accum, Mat, MatRef, Par};
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::cut::{Cell, CellCutter, CellMoments, Cutting};
use super::elements::{Elements, ShapeFunctions, dissected};
use super::grid::{CellGrid, CellIndex};
use super::isotropic::isotropic;
use super::lagrange::{Lagrange, gauss};
use crate::budget::{Cancelled, Watch, report};
use crate::elasticity::Material;
use crate::mesh::inside::SignedDistance;
use crate::mesh::stance::Stance;

/// The cells of a part.
pub struct FiniteCells {
    grid: CellGrid,
    /// Along which the grid stands: coordinates in it are those of this.
    stance: Stance,
    shapes: Lagrange,
    /// Where the cells with material lie, rising, and what they hold.
    places: Vec<CellIndex>,
    moments: Vec<CellMoments>,
    number: FxHashMap<CellIndex, u32>,
    /// Nodes of each cell, as many as it has shape functions.
    nodes: Vec<u32>,
    /// Where the nodes lie (m).
    positions: Vec<DVec3>,
    /// Gradients of the shape functions along the cell's coordinates at its Gauss points: rows 3 a + i.
    gradients: Mat<f64>,
    /// Of elimination: asked for by who plans and by who factors.
    order: OnceLock<Vec<u32>>,
}

/// Cells cut between two looks at whether to stop.
const CHUNK: usize = 256;
/// Stiffness of empty space over that of the material.
const TRACE: f64 = 1e-9;
/// Cells with less material than this share hold none.
const LEAST_SHARE: f64 = 1e-7;
/// Reading reaches into the material by this share of a cell, so that it ends in the cell that holds it.
const NUDGE: f64 = 1e-6;

impl FiniteCells {
    /// Cuts the cells of a grid that stands so.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        grid: CellGrid,
        stance: Stance,
        order: usize,
        surface: &SignedDistance,
        cutting: Cutting,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let shapes = Lagrange::new(order);
        let candidates = near_material(&grid, stance, surface);
        let cutter = CellCutter::new(surface, stance, cutting, order);
        let mut cells: Vec<(CellIndex, CellMoments)> = Vec::with_capacity(candidates.len());
        for (done, chunk) in candidates.chunks(CHUNK).enumerate() {
            report(watch, "Cutting cells", done * CHUNK, candidates.len())?;
            let cut: Vec<_> = chunk
                .par_iter()
                .map(|&(place, whole)| {
                    let moments = if whole {
                        CellMoments::full(2 * order + 1)
                    } else {
                        cutter.moments(&grid.cell(place))
                    };
                    (place, moments)
                })
                .collect();
            cells.extend(cut.into_iter().filter(|(_, m)| m.share() > LEAST_SHARE));
        }
        let (places, moments): (Vec<CellIndex>, Vec<CellMoments>) = cells.into_iter().unzip();
        let (nodes, lattice) = number_nodes(&places, order as u32);
        let positions = lattice
            .iter()
            .map(|&at| stance.place(node_position(&grid, &shapes, at)))
            .collect();
        Ok(Self {
            number: (0..).zip(&places).map(|(i, &place)| (place, i)).collect(),
            gradients: gradients(&shapes),
            grid,
            stance,
            shapes,
            places,
            moments,
            nodes,
            positions,
            order: OnceLock::new(),
        })
    }

    /// Cells with material.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.places.len()
    }

    /// Along which its cells stand.
    #[must_use]
    pub fn stance(&self) -> Stance {
        self.stance
    }

    /// The box of the cell of this number, in coordinates of the stance.
    #[must_use]
    pub fn cell(&self, number: usize) -> Cell {
        self.grid.cell(self.places[number])
    }

    /// Material of all cells (m³).
    #[must_use]
    pub fn volume(&self) -> f64 {
        (0..self.cells())
            .map(|c| self.cell(c).sides.element_product() * self.moments[c].share())
            .sum()
    }

    /// The cell with material that a point of the surface belongs to: its own, or the nearest around it. In coordinates of
    /// the stance.
    fn holding(&self, point: DVec3, outward: DVec3) -> u32 {
        let own = self.grid.place(point);
        let sides = self.grid.cell(own).sides;
        let inward = point - outward * (NUDGE * sides.min_element());
        if let Some(&cell) = self.number.get(&self.grid.place(inward)) {
            return cell;
        }
        let mut reach = 1;
        loop {
            let around = |i: u32| i.saturating_sub(reach)..=i + reach;
            let mut nearest: Option<(f64, u32)> = None;
            for z in around(own[2]) {
                for y in around(own[1]) {
                    for x in around(own[0]) {
                        let Some(&cell) = self.number.get(&[x, y, z]) else {
                            continue;
                        };
                        let off = self.cell(cell as usize).local(point).abs().max_element();
                        if nearest.is_none_or(|n| off < n.0) {
                            nearest = Some((off, cell));
                        }
                    }
                }
            }
            if let Some((_, cell)) = nearest {
                return cell;
            }
            reach *= 2;
        }
    }
}

impl Elements for FiniteCells {
    fn nodes(&self) -> &[DVec3] {
        &self.positions
    }

    fn count(&self) -> usize {
        self.places.len()
    }

    fn nodes_of(&self, element: usize) -> &[u32] {
        let each = self.shapes.nodes();
        &self.nodes[element * each..][..each]
    }

    fn grain(&self) -> f64 {
        self.grid.largest_side() / 3.0
    }

    fn centre(&self, element: usize) -> DVec3 {
        self.stance.place(self.cell(element).centre())
    }

    fn stiffness(&self, element: usize, material: &Material) -> Mat<f64> {
        let cell = self.cell(element);
        let each = self.shapes.nodes();
        let mut weights = self.moments[element].weights();
        let rule = gauss(2 * self.shapes.order() + 1);
        let mut k = 0;
        for z in &rule {
            for y in &rule {
                for x in &rule {
                    weights[k] += TRACE * x.1 * y.1 * z.1;
                    k += 1;
                }
            }
        }
        let mut weighted = self.gradients.clone();
        for (column, weight) in weighted.col_iter_mut().zip(&weights) {
            for value in column.iter_mut() {
                *value *= weight;
            }
        }
        let mut gram = Mat::zeros(3 * each, 3 * each);
        let gradients: MatRef<f64> = self.gradients.as_ref();
        faer::linalg::matmul::matmul(
            &mut gram,
            Accum::Replace,
            &weighted,
            gradients.transpose(),
            1.0,
            Par::Seq,
        );
        let scale = 2.0 / cell.sides;
        let volume = cell.sides.element_product() / 8.0;
        let mut stiffness = isotropic(&gram, material, scale * volume.sqrt());
        if self.stance != Stance::default() {
            turn(&mut stiffness, self.stance);
        }
        stiffness
    }

    fn find(&self, point: DVec3, outward: DVec3, _: &mut u32) -> (u32, DVec3) {
        let [point, outward] = [point, outward].map(|v| self.stance.coordinates(v));
        let number = self.holding(point, outward);
        (number, self.cell(number as usize).local(point))
    }

    fn values(&self, place: DVec3, into: &mut Vec<f64>) {
        self.shapes.values(place, into);
    }

    fn shape(&self, point: DVec3, outward: DVec3) -> ShapeFunctions {
        let [point, outward] = [point, outward].map(|v| self.stance.coordinates(v));
        let number = self.holding(point, outward);
        let cell = self.cell(number as usize);
        let scale = 2.0 / cell.sides;
        let shapes = self.shapes.at(cell.local(point)).into_iter();
        let gradient = |g: DVec3| self.stance.place(g * scale);
        ShapeFunctions {
            element: number,
            nodes: self.nodes_of(number as usize).to_vec(),
            values: shapes.map(|(n, g)| (n, gradient(g))).collect(),
        }
    }

    fn elimination(&self) -> Vec<u32> {
        self.order.get_or_init(|| dissected(self)).clone()
    }
}

/// A stiffness over displacements along a stance becomes one over those along the file's axes.
fn turn(stiffness: &mut Mat<f64>, stance: Stance) {
    let across = |stiffness: &mut Mat<f64>| {
        for mut column in stiffness.col_iter_mut() {
            for m in 0..column.nrows() / 3 {
                let along = DVec3::from_array(std::array::from_fn(|i| column[3 * m + i]));
                for (i, turned) in stance.place(along).to_array().into_iter().enumerate() {
                    column[3 * m + i] = turned;
                }
            }
        }
    };
    // R K, and with what that is the other way round R (R K)ᵀ = R K Rᵀ.
    across(stiffness);
    *stiffness = stiffness.transpose().to_owned();
    across(stiffness);
}

fn gradients(shapes: &Lagrange) -> Mat<f64> {
    let rule = gauss(2 * shapes.order() + 1);
    let count = rule.len();
    let mut table = Mat::zeros(3 * shapes.nodes(), count.pow(3));
    for (q, mut column) in table.col_iter_mut().enumerate() {
        let at = [q % count, q / count % count, q / count / count].map(|i| rule[i].0);
        for (a, (_, gradient)) in shapes.at(DVec3::from_array(at)).into_iter().enumerate() {
            for i in 0..3 {
                column[3 * a + i] = gradient[i];
            }
        }
    }
    table
}

/// Cells that may hold material, rising, and whether they are full of it: blocks of cells that the surface does not
/// reach are taken or left as one.
fn near_material(
    grid: &CellGrid,
    stance: Stance,
    surface: &SignedDistance,
) -> Vec<(CellIndex, bool)> {
    let mut found = Vec::new();
    let mut blocks = vec![([0; 3], grid.counts())];
    while let Some((from, to)) = blocks.pop() {
        let block = grid.span(from, to);
        let distance = surface.at(stance.place(block.centre()));
        let apart = distance.abs() > block.reach();
        let single = (0..3).all(|i| to[i] - from[i] == 1);
        if apart && distance > 0.0 {
            continue;
        }
        if apart || single {
            for z in from[2]..to[2] {
                for y in from[1]..to[1] {
                    found.extend((from[0]..to[0]).map(|x| ([x, y, z], apart)));
                }
            }
            continue;
        }
        let longest = (0..3).max_by_key(|&i| to[i] - from[i]).unwrap_or(0);
        let half = u32::midpoint(from[longest], to[longest]);
        let (mut end, mut start) = (to, from);
        end[longest] = half;
        start[longest] = half;
        blocks.push((from, end));
        blocks.push((start, to));
    }
    found.sort_unstable_by_key(|(at, _)| [at[2], at[1], at[0]]);
    found
}

/// Nodes of every cell, and the lattice places of all nodes.
fn number_nodes(cells: &[CellIndex], order: u32) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut known: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    let mut lattice = Vec::new();
    let mut nodes = Vec::new();
    for cell in cells {
        for k in 0..=order {
            for j in 0..=order {
                for i in 0..=order {
                    let at = [
                        cell[0] * order + i,
                        cell[1] * order + j,
                        cell[2] * order + k,
                    ];
                    let number = *known.entry(at).or_insert_with(|| {
                        lattice.push(at);
                        lattice.len() as u32 - 1
                    });
                    nodes.push(number);
                }
            }
        }
    }
    (nodes, lattice)
}

fn node_position(grid: &CellGrid, shapes: &Lagrange, at: [u32; 3]) -> DVec3 {
    let order = shapes.order() as u32;
    let counts = grid.counts();
    let cell: CellIndex = std::array::from_fn(|i| (at[i] / order).min(counts[i] - 1));
    let within: [f64; 3] =
        std::array::from_fn(|i| shapes.points()[(at[i] - cell[i] * order) as usize]);
    let cell = grid.cell(cell);
    cell.lower + cell.sides * (DVec3::from_array(within) + 1.0) / 2.0
}
