//! The assembled and factored shell, ready for any number of touches.

use faer::dyn_stack::MemBuffer;
use glam::DVec3;
use rayon::prelude::*;

use super::element::Facet;
use super::load::{NodalForces, Touch, nodal_forces};
use super::solver::{BLOCK, Factor, FactorError, SymmetricMatrix};
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
    #[error("the model does not fit into memory: use a coarser mesh")]
    OutOfMemory,
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Results of the checks that a solved load is put through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadCheck {
    /// |sum of reactions + load| over the load.
    pub reaction_error: f64,
    /// |½ u·f - strain energy| over the energy.
    pub energy_error: f64,
}

/// A shell: mesh, section and supports, assembled once and factored once.
pub struct ShellModel<'a> {
    pub mesh: &'a TriMesh,
    pub section: Section,
    pub index: SurfaceIndex,
    /// Unknown of each freedom (6 a vertex), or `HELD`.
    unknowns: Vec<u32>,
    stiffness: SymmetricMatrix,
    factor: Factor,
    work: Work,
}

const HELD: u32 = u32::MAX;

impl<'a> ShellModel<'a> {
    /// Assembles and factors. `held` names the held freedoms of every vertex.
    ///
    /// # Errors
    /// [`ElasticError`] for values outside their range, and for parts that are not held.
    pub fn new(
        mesh: &'a TriMesh,
        section: Section,
        held: &[Freedoms],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        check_section(&section)?;
        check_held(mesh, held)?;
        report(watch, "Assembling", 0, 2)?;
        let unknowns = number_unknowns(held);
        let mut stiffness = pattern(mesh, &unknowns);
        assemble(mesh, &section, &unknowns, &mut stiffness);
        report(watch, "Factoring", 1, 2)?;
        let factor = Factor::new(&stiffness).map_err(|e| explain(mesh, &unknowns, e))?;
        report(watch, "Factoring", 2, 2)?;
        Ok(Self {
            mesh,
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

    /// Nodal forces of a touch.
    #[must_use]
    pub fn forces(&self, touch: &Touch) -> NodalForces {
        nodal_forces(self.mesh, &self.index, touch)
    }

    /// Displacements and rotations under one load: 6 × vertices, m and rad.
    #[must_use]
    pub fn solve(&self, forces: &NodalForces) -> Vec<f64> {
        self.solve_freedoms(&spread(forces))
    }

    /// As [`Self::solve`] for loads given by freedom (6 × vertex + component): N and N·m.
    #[must_use]
    pub fn solve_freedoms(&self, loads: &[(usize, f64)]) -> Vec<f64> {
        let n = self.unknowns();
        let mut block = vec![0.0; n * BLOCK];
        self.fill(loads, &mut block[..n]);
        self.factor
            .solve_block(&mut block, &mut self.factor.scratch());
        self.expand(&block[..n])
    }

    /// Solves all touches in blocks, spread over the rayon pool this is called in, and hands each
    /// block to `consume`: the first touch's number and, by rows, the displacement of every freedom
    /// (6 × vertices rows, [`BLOCK`] columns; columns beyond the last touch are zero). Results come
    /// back in the order of the touches.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn solve_touches<T: Send>(
        &self,
        touches: &[Touch],
        watch: Watch,
        consume: impl Fn(usize, &[f64]) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let n = self.unknowns();
        let done = std::sync::atomic::AtomicUsize::new(0);
        touches
            .par_chunks(BLOCK)
            .enumerate()
            .map_init(
                || Scratch {
                    memory: self.factor.scratch(),
                    block: vec![0.0; n * BLOCK],
                    rows: vec![0.0; self.unknowns.len() * BLOCK],
                },
                |scratch, (b, chunk)| {
                    let so_far = done.load(std::sync::atomic::Ordering::Relaxed);
                    report(watch, "Solving touches", so_far, touches.len())?;
                    scratch.block.fill(0.0);
                    for (touch, column) in chunk.iter().zip(scratch.block.chunks_exact_mut(n)) {
                        self.fill(&spread(&self.forces(touch)), column);
                    }
                    self.factor
                        .solve_block(&mut scratch.block, &mut scratch.memory);
                    self.transpose(&scratch.block, &mut scratch.rows);
                    done.fetch_add(chunk.len(), std::sync::atomic::Ordering::Relaxed);
                    Ok(consume(b * BLOCK, &scratch.rows))
                },
            )
            .collect()
    }

    /// Checks a solution against its load: reactions and energy.
    #[must_use]
    pub fn check(&self, forces: &NodalForces, displacement: &[f64]) -> LoadCheck {
        let mut internal = vec![0.0; displacement.len()];
        for (t, tri) in self.mesh.triangles().iter().enumerate() {
            let k = Facet::new(self.mesh.corners(t as u32), &self.section).stiffness(&self.section);
            let freedoms = element_freedoms(tri);
            let u = nalgebra::SVector::<f64, 18>::from_fn(|i, _| displacement[freedoms[i]]);
            let f = k * u;
            for i in 0..18 {
                internal[freedoms[i]] += f[i];
            }
        }
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
        LoadCheck {
            reaction_error: (reaction + load).length() / load.length().max(f64::MIN_POSITIVE),
            energy_error: (external - twice_energy).abs()
                / twice_energy.abs().max(f64::MIN_POSITIVE),
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
        self.fill(&spread(forces), &mut f);
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

    fn fill(&self, loads: &[(usize, f64)], column: &mut [f64]) {
        for &(freedom, force) in loads {
            let unknown = self.unknowns[freedom];
            if unknown != HELD {
                column[unknown as usize] += force;
            }
        }
    }

    fn expand(&self, column: &[f64]) -> Vec<f64> {
        self.unknowns
            .iter()
            .map(|&u| if u == HELD { 0.0 } else { column[u as usize] })
            .collect()
    }

    /// From unknowns by columns to freedoms by rows, so that what reads it works on whole rows.
    fn transpose(&self, block: &[f64], rows: &mut [f64]) {
        let n = self.unknowns();
        for (row, &unknown) in rows.chunks_exact_mut(BLOCK).zip(&self.unknowns) {
            if unknown == HELD {
                row.fill(0.0);
            } else {
                for (k, value) in row.iter_mut().enumerate() {
                    *value = block[k * n + unknown as usize];
                }
            }
        }
    }
}

struct Scratch {
    memory: MemBuffer,
    block: Vec<f64>,
    rows: Vec<f64>,
}

fn spread(forces: &NodalForces) -> Vec<(usize, f64)> {
    forces
        .iter()
        .flat_map(|&(v, f)| (0..3).map(move |c| (6 * v as usize + c, f[c])))
        .collect()
}

fn check_section(section: &Section) -> Result<(), ElasticError> {
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

/// Each connected piece must have its six rigid motions held.
fn check_held(mesh: &TriMesh, held: &[Freedoms]) -> Result<(), ElasticError> {
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
