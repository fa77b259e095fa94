//! The assembled and factored shell, ready for any number of touches.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::element::Facet;
use super::load::{NodalForces, Touch, nodal_forces};
use super::rows::Rows;
use super::solver::{BLOCK, Block, Factor, FactorError, SymmetricMatrix};
use super::{Freedoms, Section};
use crate::budget::{Cancelled, Watch, Work, report};
use crate::mesh::TriMesh;
use crate::mesh::locate::SurfaceIndex;

/// Why a model cannot be built or solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElasticError {
    #[error(
        "no triangle of the part is held by a support: move a support box onto the part (its points lie between {lower:.1} and {upper:.1} mm)"
    )]
    NothingHeld { lower: DVec3, upper: DVec3 },
    #[error(
        "the part can still move as a rigid body: the supports hold it, but not in every direction. Clamp it, or add supports"
    )]
    Loose,
    #[error(
        "the shell is not held anywhere near vertex {vertex} at {place:.1} mm: join it to the rest or support it"
    )]
    NotHeld { vertex: usize, place: DVec3 },
    #[error("{what} must be {rule}, but is {value}")]
    Value {
        what: &'static str,
        rule: &'static str,
        value: f64,
    },
    #[error(
        "every point of the part is held, so nothing can deform: make the support boxes smaller"
    )]
    AllHeld,
    #[error(
        "a triangle of the mesh near {place:.1} mm has no area, so nothing can be computed on it: repair the mesh there (part.weld_mm joins what lies too close)"
    )]
    NoArea { place: DVec3 },
    #[error("the model does not fit into memory: use a coarser mesh")]
    OutOfMemory,
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Results of the checks that a solved load is put through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadCheck {
    /// |sum of reactions + load| over the load.
    pub reaction_error: f64,
    /// |½ u·f - strain energy| over the energy.
    pub energy_error: f64,
}

/// A shell: mesh, section and supports, assembled once and factored once.
pub struct ShellModel {
    pub mesh: Arc<TriMesh>,
    pub section: Section,
    pub index: SurfaceIndex,
    /// Unknown of each freedom (6 a vertex), or `HELD`.
    unknowns: Vec<u32>,
    stiffness: SymmetricMatrix,
    factor: Factor,
    work: Work,
}

const HELD: u32 = u32::MAX;

impl ShellModel {
    /// Assembles and factors. `held` names the held freedoms of every vertex.
    ///
    /// # Errors
    /// [`ElasticError`] for values outside their range, and for parts that are not held.
    pub fn new(
        mesh: &Arc<TriMesh>,
        section: Section,
        held: &[Freedoms],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        check_section(&section)?;
        check_held(mesh, held)?;
        check_areas(mesh)?;
        report(watch, "Assembling", 0, 2)?;
        let unknowns = number_unknowns(held);
        let mut stiffness = pattern(mesh, &unknowns);
        assemble(mesh, &section, &unknowns, &mut stiffness);
        report(watch, "Factoring", 1, 2)?;
        let factor = Factor::new(&stiffness).map_err(|e| explain(mesh, &unknowns, e))?;
        report(watch, "Factoring", 2, 2)?;
        Ok(Self {
            mesh: Arc::clone(mesh),
            section,
            index: SurfaceIndex::new(mesh),
            unknowns,
            stiffness,
            factor,
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
    pub fn unknowns(&self) -> usize {
        self.factor.dimension()
    }

    /// Smallest pivot of the stiffness scaled to a unit diagonal; its reciprocal bounds the
    /// conditioning from below.
    #[must_use]
    pub fn smallest_pivot(&self) -> f64 {
        self.factor.smallest_pivot
    }

    /// Connected pieces of the mesh, each of which was found held.
    #[must_use]
    pub fn pieces(&self) -> usize {
        let mut labels =
            crate::mesh::components(self.mesh.positions().len(), self.mesh.triangles());
        labels.sort_unstable();
        labels.dedup();
        labels.len()
    }

    /// Nodal forces of a touch.
    #[must_use]
    pub fn forces(&self, touch: &Touch) -> NodalForces {
        nodal_forces(&self.mesh, &self.index, touch)
    }

    /// Displacements and rotations under one load: 6 × vertices, m and rad.
    #[must_use]
    pub fn solve(&self, forces: &NodalForces) -> Vec<f64> {
        self.solve_freedoms(&spread(forces))
    }

    /// As [`Self::solve`] for loads given by freedom (6 × vertex + component): N and N·m.
    #[must_use]
    pub fn solve_freedoms(&self, loads: &[(usize, f64)]) -> Vec<f64> {
        let mut block = self.factor.block();
        self.load(&mut block, 0, loads);
        self.factor.solve(&mut block);
        self.column(&block, 0)
    }

    /// As [`Self::solve`] for several loads.
    #[must_use]
    pub fn solve_many(&self, loads: &[NodalForces]) -> Vec<Vec<f64>> {
        self.solve_loads(&loads.iter().map(spread).collect::<Vec<_>>())
    }

    /// As [`Self::solve_freedoms`] for several loads, one block at a time.
    #[must_use]
    pub fn solve_loads(&self, loads: &[Vec<(usize, f64)>]) -> Vec<Vec<f64>> {
        let mut solutions = Vec::with_capacity(loads.len());
        let mut block = self.factor.block();
        for chunk in loads.chunks(BLOCK) {
            block.clear();
            for (column, load) in chunk.iter().enumerate() {
                self.load(&mut block, column, load);
            }
            self.factor.solve(&mut block);
            solutions.extend((0..chunk.len()).map(|column| self.column(&block, column)));
        }
        solutions
    }

    /// One column of a solved block, by freedom.
    fn column(&self, block: &Block, column: usize) -> Vec<f64> {
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

    fn load(&self, block: &mut Block, column: usize, loads: &[(usize, f64)]) {
        for &(freedom, force) in loads {
            let unknown = self.unknowns[freedom];
            if unknown != HELD {
                self.factor.load(block, unknown as usize, column, force);
            }
        }
    }

    /// Solutions by freedom, at most [`BLOCK`], as the first columns of a solved block.
    pub(super) fn widened(&self, solutions: &[impl AsRef<[f64]>]) -> Vec<f64> {
        let mut rows = vec![0.0; self.unknowns() * BLOCK];
        for (column, displacement) in solutions.iter().enumerate() {
            for (freedom, &u) in displacement.as_ref().iter().enumerate() {
                if let Some((row, scale)) = self.place(freedom) {
                    rows[row as usize * BLOCK + column] = u / scale;
                }
            }
        }
        rows
    }

    /// Where a freedom stands in a solved block and what its value there is to be multiplied with;
    /// nothing where it is held.
    pub(super) fn place(&self, freedom: usize) -> Option<(u32, f64)> {
        let unknown = self.unknowns[freedom];
        (unknown != HELD).then(|| {
            let unknown = unknown as usize;
            (self.factor.order[unknown], self.factor.scale[unknown])
        })
    }

    /// Solves for every row of `loads` (its entries by solver row, as [`Self::place`] gives them) and
    /// hands each block to `consume`: a buffer of the thread's own, which rows the block holds, column by
    /// column, and the solved block. The rows are taken in an order in which neighbours share blocks; blocks come back in that order,
    /// which does not depend on the threads.
    pub(super) fn solve_rows<T: Send>(
        &self,
        loads: &Rows,
        stage: &'static str,
        watch: Watch,
        consume: impl Fn(&mut Vec<f64>, &[u32], &[f64]) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let first = |row: u32| loads.row(row as usize).iter().map(|e| e.0).min();
        let mut order: Vec<u32> = (0..loads.count() as u32).collect();
        order.sort_by_key(|&row| (first(row), row));
        let done = std::sync::atomic::AtomicUsize::new(0);
        order
            .par_chunks(BLOCK)
            .map_init(
                || (self.factor.block(), Vec::new()),
                |(block, buffer), chunk| {
                    let so_far = done.load(std::sync::atomic::Ordering::Relaxed);
                    report(watch, stage, so_far, order.len())?;
                    block.clear();
                    for (column, &row) in chunk.iter().enumerate() {
                        for &(place, value) in loads.row(row as usize) {
                            self.factor.load_place(block, place, column, value);
                        }
                    }
                    self.factor.solve(block);
                    done.fetch_add(chunk.len(), std::sync::atomic::Ordering::Relaxed);
                    Ok(consume(buffer, chunk, &block.rows))
                },
            )
            .collect()
    }

    /// Checks a solution against its load: reactions and energy.
    #[must_use]
    pub fn check(&self, forces: &NodalForces, displacement: &[f64]) -> LoadCheck {
        self.check_solved(std::slice::from_ref(forces), &[displacement])
    }

    /// The worst of the checks of several solved touches.
    #[must_use]
    pub fn check_all(&self, touches: &[Touch], solutions: &[Vec<f64>]) -> LoadCheck {
        let forces: Vec<NodalForces> = touches.iter().map(|t| self.forces(t)).collect();
        let solutions: Vec<&[f64]> = solutions.iter().map(Vec::as_slice).collect();
        self.check_solved(&forces, &solutions)
    }

    /// Element by element, apart from the assembled matrix and its factor.
    fn check_solved(&self, loads: &[NodalForces], solutions: &[&[f64]]) -> LoadCheck {
        let freedoms = self.unknowns.len();
        let mut internal = vec![vec![0.0; freedoms]; solutions.len()];
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

    fn balance(&self, forces: &NodalForces, displacement: &[f64], internal: &[f64]) -> LoadCheck {
        // Held freedoms carry the reactions: the internal force less what presses there directly.
        let mut reaction = DVec3::ZERO;
        for (freedom, force) in spread(forces) {
            if self.unknowns[freedom] == HELD {
                reaction[freedom % 6] -= force;
            }
        }
        for (freedom, force) in internal.iter().enumerate() {
            if self.unknowns[freedom] == HELD && freedom % 6 < 3 {
                reaction[freedom % 6] += force;
            }
        }
        let load: DVec3 = forces.iter().map(|f| f.1).sum();
        let twice_energy: f64 = internal.iter().zip(displacement).map(|(f, u)| f * u).sum();
        let external: f64 = spread(forces)
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

    /// ‖K u - f‖ / ‖f‖ over the unknowns.
    #[must_use]
    pub fn residual(&self, forces: &NodalForces, displacement: &[f64]) -> f64 {
        let mut u = vec![0.0; self.unknowns()];
        for (freedom, &unknown) in self.unknowns.iter().enumerate() {
            if unknown != HELD {
                u[unknown as usize] = displacement[freedom];
            }
        }
        let mut f = vec![0.0; self.unknowns()];
        for (freedom, force) in spread(forces) {
            if self.unknowns[freedom] != HELD {
                f[self.unknowns[freedom] as usize] += force;
            }
        }
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let r: Vec<f64> = self
            .stiffness
            .multiply(&u)
            .iter()
            .zip(&f)
            .map(|(a, b)| a - b)
            .collect();
        norm(&r) / norm(&f)
    }
}

pub(super) fn spread(forces: &NodalForces) -> Vec<(usize, f64)> {
    forces
        .iter()
        .flat_map(|&(v, f)| (0..3).map(move |c| (6 * v as usize + c, f[c])))
        .collect()
}

/// Material and thickness within their ranges.
///
/// # Errors
/// [`ElasticError::Value`] naming the one that is not.
pub fn check_section(section: &Section) -> Result<(), ElasticError> {
    let range = |what, rule, value: f64, ok: bool| {
        if ok && value.is_finite() {
            Ok(())
        } else {
            Err(ElasticError::Value { what, rule, value })
        }
    };
    let Section {
        material,
        thickness,
    } = *section;
    let e = material.youngs_modulus;
    let nu = material.poissons_ratio;
    range("Young's modulus in Pa", "above zero", e, e > 0.0)?;
    range(
        "Poisson's ratio",
        "above -1 and below 0.5",
        nu,
        nu > -1.0 && nu < 0.5,
    )?;
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
        let place = mesh.corners(t)[0] * 1000.0;
        Err(ElasticError::NoArea { place })
    })
}

/// Each connected piece must have its six rigid motions held.
///
/// # Errors
/// [`ElasticError`] saying what is loose.
pub fn check_held(mesh: &TriMesh, held: &[Freedoms]) -> Result<(), ElasticError> {
    let (lower, upper) = mesh.bounds();
    if held.iter().all(|h| h.0 == 0) {
        return Err(ElasticError::NothingHeld {
            lower: lower * 1000.0,
            upper: upper * 1000.0,
        });
    }
    if held.iter().all(|h| *h == Freedoms::ALL) {
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
            let place = mesh.positions()[vertex] * 1000.0;
            return Err(ElasticError::NotHeld { vertex, place });
        }
        if values.min() < 1e-10 * values.max() {
            return Err(ElasticError::Loose);
        }
    }
    Ok(())
}

/// Σ over held freedoms of the outer product of what the six rigid motions do there.
fn rigid_gram(
    mesh: &TriMesh,
    held: &[Freedoms],
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

fn number_unknowns(held: &[Freedoms]) -> Vec<u32> {
    let mut next = 0;
    held.iter()
        .flat_map(|h| (0..6).map(|i| h.holds(i)))
        .map(|held| {
            if held {
                HELD
            } else {
                next += 1;
                next - 1
            }
        })
        .collect()
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
fn assemble(mesh: &TriMesh, section: &Section, unknowns: &[u32], into: &mut SymmetricMatrix) {
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
        FactorError::NotPositive { row } => {
            let freedom = unknowns.iter().position(|&u| u as usize == row);
            let vertex = freedom.unwrap_or(0) / 6;
            ElasticError::NotHeld {
                vertex,
                place: mesh.positions()[vertex] * 1000.0,
            }
        }
    }
}
