//! The assembled and factored shell, ready for any number of touches.

use std::sync::Arc;

use super::DofSet;
use super::bedding::VertexSprings;
use super::element::Facet;
use super::error::{ElasticError, range};
use super::load::{NodalForces, Push, Touch, nodal_forces, pushed};
use super::material::ShellSection;
use super::model::{LoadCheck, Model};
use super::observe::{Face, Observer};
use super::solver::{BLOCK, FactorError, SymmetricMatrix};
use super::system::{HELD, System, number_unknowns};
use crate::budget::{Cancelled, Watch, report};
use crate::mesh::{SurfacePoint, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// A shell: mesh, section and supports, assembled once and factored once.
pub struct ShellModel {
    /// The elements: facets of the mid-surface (m).
    pub mesh: Arc<TriMesh>,
    /// Material and thickness.
    pub section: ShellSection,
    system: System,
    springs: Vec<VertexSprings>,
}

impl ShellModel {
    /// Assembles and factors. `held` names the held degrees of freedom of every vertex.
    ///
    /// # Errors
    /// [`ElasticError`] for values outside their range, and for parts that are not held.
    pub fn new(
        mesh: &Arc<TriMesh>,
        section: ShellSection,
        held: &[DofSet],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        Self::on_springs(mesh, section, held, Vec::new(), watch)
    }

    /// As [`Self::new`], on springs beside what is held.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn on_springs(
        mesh: &Arc<TriMesh>,
        section: ShellSection,
        held: &[DofSet],
        springs: Vec<VertexSprings>,
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        check_section(&section)?;
        check_held(mesh, &with_springs(held, &springs), held)?;
        check_areas(mesh)?;
        report(watch, "Assembling", 0, 1)?;
        let unknowns = number_unknowns(held.iter().flat_map(|h| (0..6).map(|i| h.holds(i))));
        let mut stiffness = pattern(mesh, &unknowns);
        assemble(mesh, &section, &unknowns, &mut stiffness);
        stiffen(&springs, &unknowns, &mut stiffness);
        report(watch, "Factoring", 0, 1)?;
        let factored = System::new(unknowns.clone(), stiffness, None, watch);
        let system = factored.map_err(|e| explain(mesh, &unknowns, e))?;
        Ok(Self {
            mesh: Arc::clone(mesh),
            section,
            system,
            springs,
        })
    }

    /// Nodal forces of a touch.
    #[must_use]
    pub fn forces(&self, touch: &Touch) -> NodalForces {
        nodal_forces(&self.mesh, touch)
    }

    /// Displacements and rotations under one load: 6 × vertices, m and rad.
    #[must_use]
    pub fn solve(&self, forces: &NodalForces) -> Vec<f64> {
        self.system.solve_dofs(&by_dof(forces))
    }

    /// As [`Self::solve`] for several loads.
    #[must_use]
    pub fn solve_many(&self, loads: &[NodalForces]) -> Vec<Vec<f64>> {
        self.system
            .solve_loads(&loads.iter().map(by_dof).collect::<Vec<_>>())
    }

    /// Checks a solution against its load: reactions and energy.
    #[must_use]
    pub fn check(&self, forces: &NodalForces, displacement: &[f64]) -> LoadCheck {
        self.check_solved(std::slice::from_ref(forces), &[displacement])
    }

    /// Element by element, apart from the assembled matrix and its factor.
    fn check_solved(&self, loads: &[NodalForces], solutions: &[&[f64]]) -> LoadCheck {
        let dofs = self.system.dofs();
        let mut internal = vec![vec![0.0; dofs]; solutions.len()];
        for (t, tri) in self.mesh.triangles().iter().enumerate() {
            let k = Facet::new(self.mesh.corners(t as u32), &self.section).stiffness(&self.section);
            let place = element_freedoms(tri);
            for (internal, displacement) in internal.iter_mut().zip(solutions) {
                let u = nalgebra::SVector::<f64, 18>::from_fn(|i, _| displacement[place[i]]);
                let f = k * u;
                for i in 0..18 {
                    internal[place[i]] += f[i];
                }
            }
        }
        for (dof, k) in self.sprung() {
            for (internal, displacement) in internal.iter_mut().zip(solutions) {
                internal[dof] += k * displacement[dof];
            }
        }
        let mut worst = LoadCheck {
            reaction_error: 0.0,
            energy_error: 0.0,
        };
        for ((forces, displacement), internal) in loads.iter().zip(solutions).zip(&internal) {
            let check = self.balance(forces, displacement, internal);
            worst.reaction_error = worst.reaction_error.max(check.reaction_error);
            worst.energy_error = worst.energy_error.max(check.energy_error);
        }
        worst
    }

    /// Degrees of freedom that are free, on a spring (N/m, N·m/rad).
    fn sprung(&self) -> impl Iterator<Item = (usize, f64)> {
        let of_vertex = |s: &VertexSprings| {
            let (first, stiffness) = (6 * s.vertex as usize, s.stiffness);
            (0..6).map(move |i| (first + i, stiffness[i]))
        };
        let all = self.springs.iter().flat_map(of_vertex);
        all.filter(|&(dof, k)| k > 0.0 && !self.system.is_held(dof))
    }

    fn balance(&self, forces: &NodalForces, displacement: &[f64], internal: &[f64]) -> LoadCheck {
        // Held degrees of freedom carry the reactions: the internal force less what presses there directly.
        let mut reaction = DVec3::ZERO;
        for (dof, force) in by_dof(forces) {
            if self.system.is_held(dof) {
                reaction[dof % 6] -= force;
            }
        }
        for (dof, force) in internal.iter().enumerate() {
            if self.system.is_held(dof) && dof % 6 < 3 {
                reaction[dof % 6] += force;
            }
        }
        for (dof, k) in self.sprung().filter(|(dof, _)| dof % 6 < 3) {
            reaction[dof % 6] -= k * displacement[dof];
        }
        let load: DVec3 = forces.iter().map(|f| f.1).sum();
        let twice_energy: f64 = internal.iter().zip(displacement).map(|(f, u)| f * u).sum();
        let external: f64 = by_dof(forces)
            .iter()
            .map(|&(d, f)| displacement[d] * f)
            .sum();
        let energy_error = if external == 0.0 && twice_energy == 0.0 {
            0.0 // pressed on the support itself
        } else {
            (external - twice_energy).abs() / twice_energy.abs().max(f64::MIN_POSITIVE)
        };
        LoadCheck {
            reaction_error: (reaction + load).length() / load.length().max(f64::MIN_POSITIVE),
            energy_error,
        }
    }
}

impl Model for ShellModel {
    fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    fn system(&self) -> &System {
        &self.system
    }

    fn push(&self, push: &Push) -> Vec<(usize, f64)> {
        by_dof(&pushed(&self.mesh, push))
    }

    fn observer(&self, points: &[SurfacePoint], face: Face) -> Observer {
        Observer::of_shell(&self.mesh, &self.section, &self.system, points, face)
    }

    fn check_all(&self, touches: &[Touch], solutions: &[Vec<f64>]) -> LoadCheck {
        let forces: Vec<NodalForces> = touches.iter().map(|t| self.forces(t)).collect();
        let solutions: Vec<&[f64]> = solutions.iter().map(Vec::as_slice).collect();
        self.check_solved(&forces, &solutions)
    }

    fn held(&self) -> Vec<bool> {
        let any = |v| (0..6).any(|i| self.system.is_held(6 * v + i));
        let mut held: Vec<bool> = (0..self.mesh.positions().len()).map(any).collect();
        for springs in &self.springs {
            held[springs.vertex as usize] = true;
        }
        held
    }

    fn pieces(&self) -> usize {
        let mut labels =
            crate::mesh::components(self.mesh.positions().len(), self.mesh.triangles());
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }

    fn translations(&self, solved: &[f64], columns: usize) -> Vec<Vec<DVec3>> {
        let at = |dof: usize, column: usize| {
            let place = self.system.place(dof);
            place.map_or(0.0, |(row, scale)| {
                solved[row as usize * BLOCK + column] * scale
            })
        };
        let field = |k| {
            let vertex = |v| DVec3::new(at(6 * v, k), at(6 * v + 1, k), at(6 * v + 2, k));
            (0..self.mesh.positions().len()).map(vertex).collect()
        };
        (0..columns).map(field).collect()
    }
}

pub(super) fn by_dof(forces: &NodalForces) -> Vec<(usize, f64)> {
    forces
        .iter()
        .flat_map(|&(v, f)| (0..3).map(move |c| (6 * v as usize + c, f[c])))
        .collect()
}

/// Material and thickness within their ranges.
///
/// # Errors
/// [`ElasticError::Value`] naming the one that is not.
pub fn check_section(section: &ShellSection) -> Result<(), ElasticError> {
    section.material.check()?;
    let thickness = section.thickness;
    range(
        "the thickness in m",
        "above zero",
        thickness,
        thickness > 0.0,
    )
}

fn check_areas(mesh: &TriMesh) -> Result<(), ElasticError> {
    /// Height over length below which rounding decides the normal.
    const FLAT: f64 = 1e-11;
    let flat = (0..mesh.triangles().len() as u32).find(|&t| {
        let thinness = mesh.thinness(t);
        thinness.is_nan() || thinness < FLAT
    });
    flat.map_or(Ok(()), |t| {
        let place = mesh.corners(t)[0];
        Err(ElasticError::NoArea { place })
    })
}

/// Each connected piece must have its six rigid motions held, by springs too; `firm` is what does not give way.
///
/// # Errors
/// [`ElasticError`] saying what is loose.
pub fn check_held(mesh: &TriMesh, held: &[DofSet], firm: &[DofSet]) -> Result<(), ElasticError> {
    let (lower, upper) = mesh.bounds();
    if held.iter().all(|h| h.0 == 0) {
        return Err(ElasticError::NothingHeld { lower, upper });
    }
    if firm.iter().all(|h| *h == DofSet::ALL) {
        return Err(ElasticError::AllHeld);
    }
    let labels = crate::mesh::components(mesh.positions().len(), mesh.triangles());
    let mut roots: Vec<u32> = labels.clone();
    roots.sort_unstable();
    roots.dedup();
    let size = (upper - lower).length().max(f64::MIN_POSITIVE);
    for root in roots {
        let members = (0..labels.len()).filter(|&v| labels[v] == root);
        let gram = rigid_gram(mesh, held, members, size);
        let values = gram.symmetric_eigenvalues();
        if values.max() == 0.0 {
            let vertex = root as usize;
            let place = mesh.positions()[vertex];
            return Err(ElasticError::NotHeld { vertex, place });
        }
        if values.min() < 1e-10 * values.max() {
            return Err(ElasticError::Loose);
        }
    }
    Ok(())
}

/// What is held at every vertex, by springs too.
fn with_springs(held: &[DofSet], springs: &[VertexSprings]) -> Vec<DofSet> {
    let mut held = held.to_vec();
    for spring in springs {
        let sprung = (0..6).filter(|&i| spring.stiffness[i] > 0.0);
        let sprung: Vec<usize> = sprung.collect();
        held[spring.vertex as usize].0 |= DofSet::of(&sprung).0;
    }
    held
}

/// Adds springs to a stiffness.
fn stiffen(springs: &[VertexSprings], unknowns: &[u32], into: &mut SymmetricMatrix) {
    for spring in springs {
        for (i, &k) in spring.stiffness.iter().enumerate() {
            let unknown = unknowns[6 * spring.vertex as usize + i];
            if unknown != HELD && k > 0.0 {
                into.add(unknown as usize, unknown as usize, k);
            }
        }
    }
}

/// Σ over held degrees of freedom of the outer product of what the six rigid motions do there.
fn rigid_gram(
    mesh: &TriMesh,
    held: &[DofSet],
    members: impl Iterator<Item = usize>,
    size: f64,
) -> nalgebra::Matrix6<f64> {
    let centre = mesh.positions()[0];
    let mut gram = nalgebra::Matrix6::zeros();
    for v in members {
        let r = (mesh.positions()[v] - centre) / size;
        for i in (0..6).filter(|&i| held[v].holds(i)) {
            let mut row = nalgebra::Vector6::zeros();
            if i < 3 {
                row[i] = 1.0;
                for axis in 0..3 {
                    row[3 + axis] = DVec3::AXES[axis].cross(r)[i];
                }
            } else {
                row[i] = 1.0;
            }
            gram += row * row.transpose();
        }
    }
    gram
}

/// The lower triangle's pattern from the mesh's edges: every vertex couples with itself and its
/// neighbours.
fn pattern(mesh: &TriMesh, unknowns: &[u32]) -> SymmetricMatrix {
    let mut coupled: Vec<Vec<u32>> = (0..mesh.positions().len() as u32)
        .map(|v| vec![v])
        .collect();
    for edge in mesh.edges() {
        coupled[edge.a as usize].push(edge.b);
        coupled[edge.b as usize].push(edge.a);
    }
    let mut columns = vec![0];
    let mut rows = Vec::new();
    for (v, list) in coupled.iter_mut().enumerate() {
        list.sort_unstable();
        for i in 0..6 {
            let column = unknowns[6 * v + i];
            if column == HELD {
                continue;
            }
            let below = list
                .iter()
                .flat_map(|&w| (0..6).map(move |k| unknowns[6 * w as usize + k]))
                .filter(|&row| row != HELD && row >= column);
            rows.extend(below.map(|row| row as usize));
            columns.push(rows.len());
        }
    }
    let values = vec![0.0; rows.len()];
    SymmetricMatrix {
        columns,
        rows,
        values,
    }
}

fn element_freedoms(tri: &[u32; 3]) -> [usize; 18] {
    std::array::from_fn(|i| 6 * tri[i / 6] as usize + i % 6)
}

/// Element matrices on the rayon pool, added up in the order of the triangles.
fn assemble(mesh: &TriMesh, section: &ShellSection, unknowns: &[u32], into: &mut SymmetricMatrix) {
    const CHUNK: usize = 4096;
    for (c, chunk) in mesh.triangles().chunks(CHUNK).enumerate() {
        let elements: Vec<_> = (0..chunk.len())
            .into_par_iter()
            .map(|k| Facet::new(mesh.corners((c * CHUNK + k) as u32), section).stiffness(section))
            .collect();
        for (tri, k) in chunk.iter().zip(&elements) {
            let place = element_freedoms(tri).map(|d| unknowns[d]);
            for j in 0..18 {
                for i in 0..18 {
                    if place[j] != HELD && place[i] != HELD && place[i] >= place[j] {
                        into.add(place[i] as usize, place[j] as usize, k[(i, j)]);
                    }
                }
            }
        }
    }
}

fn explain(mesh: &TriMesh, unknowns: &[u32], error: FactorError) -> ElasticError {
    match error {
        FactorError::OutOfMemory => ElasticError::OutOfMemory,
        FactorError::Cancelled => ElasticError::Cancelled(Cancelled),
        FactorError::TooLarge { bytes } => ElasticError::TooLarge {
            needed: bytes,
            limit: crate::memory::allowed(),
        },
        FactorError::NotPositive { row } => {
            let dof = unknowns.iter().position(|&u| u as usize == row);
            let vertex = dof.unwrap_or(0) / 6;
            ElasticError::NotHeld {
                vertex,
                place: mesh.positions()[vertex],
            }
        }
    }
}
