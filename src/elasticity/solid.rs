//! Three-dimensional elasticity of a closed part with walls.
//!
//! Elements with three displacements a node: cells of a grid that the part is immersed in (`cells`), or the
//! tetrahedra of a mesh that the user has (`tetrahedra`). Touches press on the true surface and gauges are read
//! there, wherever it crosses the elements.

pub mod cells;
pub mod cut;
pub mod dissection;
mod elements;
pub mod grid;
pub mod grip;
pub mod ground;
pub mod immersed;
pub mod isotropic;
pub mod lagrange;
pub mod orders;
mod piece;
pub mod pressed;
pub mod series;
pub mod simplex;
pub mod sizing;
pub mod tetrahedra;
pub mod tip;

use std::sync::Arc;

use faer::Mat;
use glam::DVec3;
use rayon::prelude::*;

pub use self::elements::{Elements, ShapeFunctions};

use self::grip::Grip;
use self::pressed::nodal_shares;
use super::Material;
use super::error::ElasticError;
use super::load::{Push, Touch, pressure};
use super::model::{Coarser, LoadCheck, Model};
use super::observe::{Face, Observer, tangent_frame};
use super::rows::SparseRows;
use super::solver::{BLOCK, FactorError, FactorPlan, SymmetricMatrix, bytes, check_bytes};
use super::system::{HELD, System, number_unknowns};
use crate::budget::{Cancelled, Watch, report};
use crate::memory;
use crate::mesh::{SurfacePoint, TriMesh};

/// A solid: elements, material and supports, assembled once and factored once.
pub struct SolidModel {
    mesh: Arc<TriMesh>,
    elements: Box<dyn Elements>,
    material: Material,
    grip: Grip,
    system: System,
    /// On elements of one order less, and the share of [`Coarser`].
    coarser: Option<(Box<Self>, f64)>,
    /// Displacements at the vertices of the surface, as rows over solved blocks.
    vertices: SparseRows,
    pieces: usize,
    /// For each facet of the surface, where a search for its element may begin.
    guesses: Vec<u32>,
}

impl SolidModel {
    /// Assembles and factors.
    ///
    /// # Errors
    /// [`ElasticError`] for values outside their range, and for parts that are not held.
    pub fn new(
        mesh: &Arc<TriMesh>,
        elements: Box<dyn Elements>,
        material: Material,
        grip: Grip,
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        material.check()?;
        let pieces = grip::check(&*elements, &grip)?;
        let unknowns = number_unknowns(grip.nodes.iter().flat_map(|h| (0..3).map(|i| h.holds(i))));
        let mut stiffness = pattern(&*elements, &unknowns)
            .map_err(|error| explain(&*elements, &unknowns, error))?;
        assemble(&*elements, &material, &unknowns, &mut stiffness, watch)?;
        grip.stiffen(&unknowns, &mut stiffness);
        report(watch, "Factoring", 0, 1)?;
        let order = in_unknowns(&elements.elimination(), &unknowns);
        let factored = System::new(unknowns.clone(), stiffness, Some(order), watch);
        let system = factored.map_err(|e| explain(&*elements, &unknowns, e))?;
        let mut model = Self {
            mesh: Arc::clone(mesh),
            elements,
            material,
            grip,
            system,
            coarser: None,
            vertices: SparseRows::default(),
            pieces,
            guesses: Vec::new(),
        };
        model.guesses = model.guesses();
        model.vertices = model.displacement_rows(&mesh.vertex_points());
        Ok(model)
    }

    /// The same, with displacements that are carried on from a coarser model of the same surface ([`Coarser`]).
    #[must_use]
    pub fn carried_on(self, coarser: Self, share: f64) -> Self {
        Self {
            coarser: Some((Box::new(coarser), share)),
            ..self
        }
    }

    /// What it was assembled from.
    #[must_use]
    pub fn elements(&self) -> &dyn Elements {
        &*self.elements
    }

    /// The shape functions at a point of the surface.
    fn shape(&self, at: SurfacePoint) -> ShapeFunctions {
        let point = self.mesh.point(at);
        self.elements
            .shape(point, self.mesh.facet_normal(at.triangle))
    }

    fn guesses(&self) -> Vec<u32> {
        let facets = 0..self.mesh.triangles().len() as u32;
        let guess = |facet: u32| {
            let middle = self.mesh.corners(facet).iter().sum::<DVec3>() / 3.0;
            let mut guess = 0;
            let outward = self.mesh.facet_normal(facet);
            self.elements.find(middle, outward, &mut guess);
            guess
        };
        facets.into_par_iter().map(guess).collect()
    }

    /// A row over degrees of freedom as one over solved blocks: held degrees of freedom are zero.
    fn placed(&self, row: impl Iterator<Item = (usize, f64)>) -> impl Iterator<Item = (u32, f64)> {
        row.filter_map(|(dof, weight)| {
            let (place, scale) = self.system.place(dof)?;
            Some((place, weight * scale))
        })
    }

    /// Rows x, y, z of the displacement at each point.
    fn displacement_rows(&self, points: &[SurfacePoint]) -> SparseRows {
        let shapes: Vec<ShapeFunctions> = points.par_iter().map(|&at| self.shape(at)).collect();
        let mut rows = SparseRows::default();
        for shape in shapes {
            for axis in 0..3 {
                let entries = shape.nodes.iter().zip(&shape.values);
                rows.push(self.placed(entries.map(|(&n, v)| (3 * n as usize + axis, v.0))));
            }
        }
        rows
    }

    /// Rows xx, yy, 2xy of the strain at each point in its frame.
    fn strain_rows(&self, points: &[SurfacePoint], frames: &[glam::DMat3]) -> SparseRows {
        let shapes: Vec<ShapeFunctions> = points.par_iter().map(|&at| self.shape(at)).collect();
        let mut rows = SparseRows::default();
        for (shape, frame) in shapes.iter().zip(frames) {
            let (t, s) = (frame.x_axis, frame.y_axis);
            for component in 0..3 {
                let entries = shape.nodes.iter().zip(&shape.values).flat_map(|(&n, v)| {
                    let (along, aside) = (v.1.dot(t), v.1.dot(s));
                    (0..3).map(move |k| {
                        let weight = match component {
                            0 => along * t[k],
                            1 => aside * s[k],
                            _ => along * s[k] + aside * t[k],
                        };
                        (3 * n as usize + k, weight)
                    })
                });
                rows.push(self.placed(entries));
            }
        }
        rows
    }
}

impl Model for SolidModel {
    fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    fn system(&self) -> &System {
        &self.system
    }

    fn coarser(&self) -> Option<Coarser<'_>> {
        self.coarser.as_ref().map(|(model, share)| Coarser {
            model: &**model,
            share: *share,
        })
    }

    fn push(&self, push: &Push) -> Vec<(usize, f64)> {
        let force = push.force;
        let pressure = pressure(&self.mesh, &push.touch, self.elements.grain());
        let shares = nodal_shares(&*self.elements, &self.mesh, &self.guesses, &pressure);
        let along = |(node, share)| (0..3).map(move |i| (3 * node as usize + i, share * force[i]));
        shares.into_iter().flat_map(along).collect()
    }

    fn observer(&self, points: &[SurfacePoint], _: Face) -> Observer {
        let frames: Vec<_> = (points.iter())
            .map(|&at| tangent_frame(self.mesh.normal(at)))
            .collect();
        let strains = self.strain_rows(points, &frames);
        let coarser = self.coarser.as_ref();
        let coarser = coarser.map(|(model, _)| model.displacement_rows(points));
        Observer::direct(strains, self.displacement_rows(points), frames).with_coarser(coarser)
    }

    fn check_all(&self, touches: &[Touch], solutions: &[Vec<f64>]) -> LoadCheck {
        let mut reactions = vec![DVec3::ZERO; solutions.len()];
        let held = self.holding().into_par_iter();
        let of_elements: Vec<_> = held.map(|e| self.reactions(e, solutions)).collect();
        for own in of_elements {
            for (sum, own) in reactions.iter_mut().zip(own) {
                *sum += own;
            }
        }
        let energies = self.system.twice_energies(solutions);
        let mut worst = LoadCheck::default();
        let held = reactions.into_iter().zip(energies);
        for ((touch, u), (reaction, energy)) in touches.iter().zip(solutions).zip(held) {
            let check = self.balance(&self.load(touch), u, reaction, energy);
            worst.reaction_error = worst.reaction_error.max(check.reaction_error);
            worst.energy_error = worst.energy_error.max(check.energy_error);
        }
        worst
    }

    fn held(&self) -> Vec<bool> {
        // A vertex whose displacement no free node takes part in.
        let moves = |v: usize| (0..3).any(|i| !self.vertices.row(3 * v + i).is_empty());
        let by_nodes = (0..self.vertices.count() / 3).map(|v| !moves(v));
        let near = self.grip.near(&self.mesh);
        by_nodes
            .zip(near)
            .map(|(held, spring)| held || spring)
            .collect()
    }

    fn pieces(&self) -> usize {
        self.pieces
    }

    fn translations(&self, solved: &[f64], columns: usize) -> Vec<Vec<DVec3>> {
        let mut all = vec![0.0; self.vertices.count() * BLOCK];
        self.vertices.apply(solved, &mut all);
        let at = |row: usize, column: usize| all[row * BLOCK + column];
        let field = |c| {
            let vertex = |v| DVec3::new(at(3 * v, c), at(3 * v + 1, c), at(3 * v + 2, c));
            (0..self.vertices.count() / 3).map(vertex).collect()
        };
        (0..columns).map(field).collect()
    }
}

impl SolidModel {
    /// Degrees of freedom of an element.
    fn dofs_of(&self, element: usize) -> Vec<usize> {
        let nodes = self.elements.nodes_of(element).iter();
        nodes
            .flat_map(|&n| (0..3).map(move |i| 3 * n as usize + i))
            .collect()
    }

    /// The elements that held degrees of freedom are of.
    fn holding(&self) -> Vec<usize> {
        let is_held = |&dof: &usize| self.system.is_held(dof);
        let holds = |&element: &usize| self.dofs_of(element).iter().any(is_held);
        (0..self.elements.count()).filter(holds).collect()
    }

    /// The force (N) on the held degrees of freedom of an element under each solution.
    fn reactions(&self, element: usize, solutions: &[Vec<f64>]) -> Vec<DVec3> {
        let stiffness = self.elements.stiffness(element, &self.material);
        let dofs = self.dofs_of(element);
        let reaction = |u: &Vec<f64>| {
            let mut reaction = DVec3::ZERO;
            for (i, &held) in dofs.iter().enumerate() {
                if self.system.is_held(held) {
                    let row = stiffness.col_as_slice(i).iter().zip(&dofs);
                    reaction[held % 3] += row.map(|(k, &dof)| k * u[dof]).sum::<f64>();
                }
            }
            reaction
        };
        solutions.iter().map(reaction).collect()
    }

    /// From what elements hold with (N) and twice the energy of all (J).
    fn balance(
        &self,
        load: &[(usize, f64)],
        u: &[f64],
        by_elements: DVec3,
        twice_energy: f64,
    ) -> LoadCheck {
        let (mut reaction, mut total) = (by_elements, DVec3::ZERO);
        let mut external = 0.0;
        for &(dof, force) in load {
            total[dof % 3] += force;
            external += force * u[dof];
            if self.system.is_held(dof) {
                reaction[dof % 3] -= force;
            }
        }
        let held = self.grip.reaction(u, |dof| self.system.is_held(dof));
        let energy_error = if external == 0.0 && twice_energy == 0.0 {
            0.0 // pressed on the support itself
        } else {
            (external - twice_energy).abs() / twice_energy.abs().max(f64::MIN_POSITIVE)
        };
        LoadCheck {
            reaction_error: (reaction + held + total).length()
                / total.length().max(f64::MIN_POSITIVE),
            energy_error,
        }
    }
}

/// The unknowns of nodes, one node after the other.
fn in_unknowns(nodes: &[u32], unknowns: &[u32]) -> Vec<usize> {
    let of = |&n: &u32| unknowns[3 * n as usize..][..3].iter();
    let all = nodes.iter().flat_map(of);
    all.filter(|&&u| u != HELD).map(|&u| u as usize).collect()
}

/// The nodes that each node shares an element with, in rising order, itself among them.
fn neighbours(elements: &dyn Elements) -> Vec<Vec<u32>> {
    let mut coupled: Vec<Vec<u32>> = vec![Vec::new(); elements.nodes().len()];
    for element in 0..elements.count() {
        let nodes = elements.nodes_of(element);
        for &node in nodes {
            coupled[node as usize].extend_from_slice(nodes);
        }
    }
    for list in &mut coupled {
        list.sort_unstable();
        list.dedup();
        list.shrink_to_fit();
    }
    coupled
}

/// What the factor of elements' stiffness will be.
fn plan(elements: &dyn Elements) -> Result<FactorPlan, FactorError> {
    FactorPlan::new(&neighbours(elements), &elements.elimination(), 3)
}

/// The lower triangle's pattern: nodes that share an element are coupled.
fn pattern(elements: &dyn Elements, unknowns: &[u32]) -> Result<SymmetricMatrix, FactorError> {
    let mut coupled = neighbours(elements);
    let couples: f64 = coupled.iter().map(|list| list.len() as f64).sum();
    check_bytes(bytes(couples * 9.0 / 2.0))?;
    let mut columns = vec![0];
    let mut rows = Vec::new();
    for (node, list) in coupled.iter_mut().enumerate() {
        for i in 0..3 {
            let column = unknowns[3 * node + i];
            if column == HELD {
                continue;
            }
            let below = list
                .iter()
                .flat_map(|&n| &unknowns[3 * n as usize..][..3])
                .filter(|&&row| row != HELD && row >= column);
            rows.extend(below.map(|&row| row as usize));
            columns.push(rows.len());
        }
        *list = Vec::new();
    }
    let values = vec![0.0; rows.len()];
    Ok(SymmetricMatrix {
        columns,
        rows,
        values,
    })
}

/// Elements whose matrices are there at the same time.
const AT_ONCE: usize = 512;

/// Element matrices on the rayon pool, added up in the order of the elements.
fn assemble(
    elements: &dyn Elements,
    material: &Material,
    unknowns: &[u32],
    into: &mut SymmetricMatrix,
    watch: Watch,
) -> Result<(), ElasticError> {
    for first in (0..elements.count()).step_by(AT_ONCE) {
        report(watch, "Assembling", first, elements.count())?;
        let last = (first + AT_ONCE).min(elements.count());
        let matrices: Vec<Mat<f64>> = (first..last)
            .into_par_iter()
            .map(|e| elements.stiffness(e, material))
            .collect();
        for (element, k) in (first..last).zip(&matrices) {
            let nodes = elements.nodes_of(element);
            let places: Vec<u32> = (nodes.iter())
                .flat_map(|&n| unknowns[3 * n as usize..][..3].iter().copied())
                .collect();
            for (j, &column) in places.iter().enumerate().filter(|p| *p.1 != HELD) {
                // The unknowns of a node follow each other in every column that has them.
                let nodes = places
                    .chunks_exact(3)
                    .zip(k.col_as_slice(j).chunks_exact(3));
                for (rows, k) in nodes {
                    let below = |row: &u32| *row != HELD && *row >= column;
                    let Some(first) = rows.iter().copied().find(below) else {
                        continue;
                    };
                    let own = rows.iter().zip(k).filter(|(row, _)| below(row));
                    into.add_run(first as usize, column as usize, own.map(|(_, k)| *k));
                }
            }
        }
    }
    Ok(())
}

fn explain(elements: &dyn Elements, unknowns: &[u32], error: FactorError) -> ElasticError {
    match error {
        FactorError::OutOfMemory => ElasticError::OutOfMemory,
        FactorError::Cancelled => ElasticError::Cancelled(Cancelled),
        FactorError::TooLarge { bytes } => ElasticError::TooLarge {
            needed: bytes,
            limit: memory::allowed(),
        },
        FactorError::NotPositive { row } => {
            let dof = unknowns.iter().position(|&u| u as usize == row);
            let vertex = dof.unwrap_or(0) / 3;
            ElasticError::NotHeld {
                vertex,
                place: elements.nodes()[vertex],
            }
        }
    }
}
