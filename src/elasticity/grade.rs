//! The mesh that a part is computed on: laid on the part's surface, finer where the strain needs it.

use std::sync::Arc;

use glam::DVec3;

use super::estimate::{self, AccuracyTarget, Discretization, ModelSample};
use super::linearity::{Linearity, linearity};
use super::load::Touch;
use super::model::LoadCheck;
use super::recover::facet_errors;
use super::shell::check_held;
use super::support::{DofSet, HeldPart, Support, geometry};
use super::{ElasticError, Model as _, ShellModel, ShellSection, scope};
use crate::budget::{Watch, report};
use crate::mesh::TriMesh;
use crate::mesh::canonical::Canonical;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::remesh::{Remeshed, as_given, quarter, remesh};
use crate::mesh::surface::Surface;

/// A part ready to have elements laid on it. They are laid on its canonical form, and then carried to where the part
/// lies.
pub struct ShellGround {
    /// The part that elements are laid on.
    part: Arc<TriMesh>,
    held: HeldPart,
    surface: Surface,
    section: ShellSection,
    /// The canonical form; nothing where the part's own triangles are the elements.
    own: Option<Canonical>,
}

/// The elements, with the model built on them.
pub struct Graded {
    /// The elements.
    pub remeshed: Remeshed,
    /// What is held at each of their vertices.
    pub held: Vec<DofSet>,
    /// The factored model on them.
    pub model: ShellModel,
    /// How far it is from converged.
    pub estimate: Discretization,
    /// What linearity costs.
    pub linearity: Linearity,
    /// The worst balance over the sample of the loads.
    pub balance: LoadCheck,
    /// Assemblies and factorizations, and loads solved on the way here.
    pub models: u64,
    /// Loads solved on the way here.
    pub solves: u64,
}

/// Loads and places that the error is measured with, at most.
const LOADS: usize = 64;
pub(super) const PLACES: usize = 400;
/// Loads whose reactions and energy are added up element by element, at most.
pub(super) const CHECKED: usize = 16;
/// Facets × loads that the smoothed strain is built for, at most.
const RECOVERED: usize = 250_000;
/// A size may change by this factor in one pass.
const FINER: f64 = 0.3;
const COARSER: f64 = 2.5;
/// Vertices that remeshing lays per area over the squared size (an equilateral mesh of that very size
/// would have 1.155), and per length of free rim over the size.
const AREA: f64 = 1.4;
const RIM: f64 = 0.5;
/// Sizes of neighbours: one may be larger by this share of their distance.
const SLOPE: f64 = 0.35;
/// No element smaller than this share of the thickness (before halving): thin-shell theory sees nothing
/// there.
const LEAST_IN_THICKNESS: f64 = 0.3;
/// The error is an estimate: stop at this share of the tolerance.
const SAFETY: f64 = 0.6;

impl ShellGround {
    /// Cuts the part along its supports and finds its feature lines. With `as_given` the part's own
    /// triangles will be the elements.
    #[must_use]
    pub fn new(
        part: &Arc<TriMesh>,
        section: ShellSection,
        supports: &[Support],
        as_given: bool,
    ) -> Self {
        let (part, supports) = geometry(part, supports);
        let own = (!as_given).then(|| Canonical::of(&part));
        let held = match &own {
            None => HeldPart::uncut(&part, &supports),
            Some(own) => {
                let supports: Vec<Support> = supports.iter().map(|s| s.canonical(own)).collect();
                HeldPart::new(&own.mesh, &supports)
            }
        };
        let surface = Surface::new(&held.mesh, |e| held.is_border(e), |v| held.is_spot(v));
        Self {
            part,
            held,
            surface,
            section,
            own,
        }
    }

    /// Whether every piece of the part is held against all rigid motions.
    ///
    /// # Errors
    /// [`ElasticError`] saying what is loose.
    pub fn check_held(&self) -> Result<(), ElasticError> {
        check_held(&self.held.mesh, &self.held.held, &self.held.firm()).map_err(|error| match &self
            .own
        {
            Some(own) => as_in_the_file(error, own),
            None => error,
        })
    }

    /// Where thin-shell theory itself is off for this part and a tip of this radius (m).
    #[must_use]
    pub fn cautions(&self, tip_radius: f64) -> Vec<String> {
        scope::cautions(&self.surface, &self.section, tip_radius)
    }

    /// Elements of one size, about as many vertices as asked for.
    #[must_use]
    pub fn even(&self, vertices: usize) -> Remeshed {
        if self.own.is_none() {
            return as_given(&self.surface);
        }
        let rim: f64 = self
            .held
            .mesh
            .boundary_edges()
            .map(|e| self.length(e))
            .sum();
        let size = even_size(self.held.mesh.area(), rim, vertices);
        self.of_size(size.max(LEAST_IN_THICKNESS * self.section.thickness))
    }

    /// A mesh of about one edge length (m) on the part's surface, whatever its elements are.
    #[must_use]
    pub fn of_size(&self, size: f64) -> Remeshed {
        self.remesh_sized(&|_| size)
    }

    /// A mesh of a size (m, at a place in the frame) where the part lies.
    fn remesh_sized(&self, size: &dyn Fn(DVec3) -> f64) -> Remeshed {
        self.outward(remesh(&self.surface, size))
    }

    /// What was laid on the canonical form, where the part lies.
    fn outward(&self, remeshed: Remeshed) -> Remeshed {
        match &self.own {
            Some(own) => remeshed.moved(|p| own.frame.outward(p)),
            None => remeshed,
        }
    }

    /// The part in its canonical order, where it lies: what is drawn on it at random does not depend on its file.
    #[must_use]
    pub fn in_order(&self) -> Arc<TriMesh> {
        match &self.own {
            Some(own) => own.where_it_lies(&self.part),
            None => Arc::clone(&self.part),
        }
    }

    /// The part that elements are laid on.
    #[must_use]
    pub fn part(&self) -> &Arc<TriMesh> {
        &self.part
    }

    /// Area of the surface (m²).
    #[must_use]
    pub fn area(&self) -> f64 {
        self.held.mesh.area()
    }

    fn length(&self, edge: &crate::mesh::Edge) -> f64 {
        let p = self.held.mesh.positions();
        p[edge.a as usize].distance(p[edge.b as usize])
    }

    /// Elements that were laid on this part before: its own triangles where they are these.
    #[must_use]
    pub fn known(&self, remeshed: Remeshed) -> Remeshed {
        let own = &self.surface.mesh;
        let is_own = self.own.is_none()
            && own.positions() == remeshed.mesh.positions()
            && own.triangles() == remeshed.mesh.triangles();
        if is_own {
            as_given(&self.surface)
        } else {
            remeshed
        }
    }

    /// The same elements, halved.
    #[must_use]
    pub fn halved(&self, remeshed: &Remeshed) -> Remeshed {
        match &self.own {
            Some(own) => {
                let inward = remeshed.moved(|p| own.frame.inward(p));
                self.outward(quarter(&self.surface, &inward))
            }
            None => quarter(&self.surface, remeshed),
        }
    }

    /// What is held at the vertices of a mesh on this ground.
    #[must_use]
    pub fn held(&self, remeshed: &Remeshed) -> Vec<DofSet> {
        remeshed
            .places
            .iter()
            .map(|&at| self.held.held_at(at))
            .collect()
    }

    /// A model on a mesh laid on this ground.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn model(&self, remeshed: &Remeshed, watch: Watch) -> Result<ShellModel, ElasticError> {
        let firm: Vec<DofSet> = (remeshed.places.iter())
            .map(|&at| self.held.held_firmly_at(at))
            .collect();
        let springs = (self.held).springs(&remeshed.mesh, &remeshed.places, self.section.thickness);
        ShellModel::on_springs(&remeshed.mesh, self.section, &firm, springs, watch)
    }

    /// Lays elements for these touches, finer where their strain changes, until the error is small
    /// enough or the most vertices are spent.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn grade(&self, target: &AccuracyTarget, watch: Watch) -> Result<Graded, ElasticError> {
        let (as_given, aim) = (self.own.is_none(), target.aim);
        let most = aim.most_for(target.count);
        let touches = sample(target.touches);
        let places: Vec<DVec3> = subsample(target.places, PLACES);
        // A second round for a few more vertices would cost more than it brings.
        let near = 2 * most <= 3 * aim.vertices;
        let mut vertices = if near { most } else { aim.vertices };
        // The fine mesh halves this one: a quarter of the vertices.
        let mut coarse = SolvedMesh::new(self, self.even(vertices / 4), &touches, watch)?;
        let (mut models, mut solves) = (1, touches.len() as u64);
        let mut last = 0;
        loop {
            for pass in 0..if as_given { 0 } else { aim.passes } {
                report(watch, "Laying elements", pass, aim.passes)?;
                let remeshed = self.regraded(&coarse, vertices / 4);
                coarse = SolvedMesh::new(self, remeshed, &touches, watch)?;
                models += 1;
                solves += touches.len() as u64;
            }
            report(watch, "Laying elements", aim.passes, aim.passes)?;
            let fine = SolvedMesh::new(self, self.halved(&coarse.remeshed), &touches, watch)?;
            models += 1;
            solves += touches.len() as u64;
            let sample =
                |s: &SolvedMesh| ModelSample::of(&s.model, &touches, &s.solutions, &places);
            let estimate = estimate::between(&sample(&coarse), &sample(&fine), &touches, &places);
            if as_given {
                // The part's own triangles are the model; the halved ones only say how good they are.
                let estimate = estimate.of_the_coarser();
                return Ok(coarse.graded(self, &touches, estimate, models, solves));
            }
            // Where no place is far enough from a touch, the displacement alone decides.
            let excess = (estimate.displacement_percent / aim.displacement_percent)
                .max(estimate.strain_percent / aim.strain_percent)
                / SAFETY;
            // Where the least size holds everywhere, more vertices are asked for than are laid.
            let grown = coarse.remeshed.mesh.positions().len();
            let spent = vertices >= most || grown * 10 < last * 11;
            last = grown;
            if excess <= 1.0 || spent || excess.is_nan() {
                return Ok(fine.graded(self, &touches, estimate, models, solves));
            }
            // Errors fall about as one over the number of vertices.
            let more = (vertices as f64 * (1.2 * excess).clamp(1.5, 4.0)) as usize;
            vertices = more.min(most);
        }
    }

    /// Elements sized so that every one carries the same share of the error.
    fn regraded(&self, solved: &SolvedMesh, vertices: usize) -> Remeshed {
        let mesh = &solved.remeshed.mesh;
        let loads = (RECOVERED / mesh.triangles().len()).clamp(4, LOADS);
        let errors = facet_errors(&solved.model, &subsample(&solved.solutions, loads));
        let least = LEAST_IN_THICKNESS * self.section.thickness;
        let sizes = sizes(mesh, &errors, vertices, least);
        let inward = |&p: &DVec3| self.own.as_ref().map_or(p, |own| own.frame.inward(p));
        let positions = mesh.positions().iter().map(inward).collect();
        let index = SurfaceIndex::of(positions, mesh.triangles());
        self.remesh_sized(&|p| mesh.interpolate(&sizes, index.nearest(p).0))
    }
}

/// An error of the canonical form, with places and numbers of vertices as the file has them.
fn as_in_the_file(error: ElasticError, own: &Canonical) -> ElasticError {
    let outward = |place: DVec3| own.frame.outward(place);
    match error {
        ElasticError::NothingHeld { lower, upper } => ElasticError::NothingHeld {
            lower: outward(lower),
            upper: outward(upper),
        },
        ElasticError::NotHeld { vertex, place } => ElasticError::NotHeld {
            vertex: (own.numbers.get(vertex)).map_or(vertex, |&v| v as usize),
            place: outward(place),
        },
        other => other,
    }
}

/// Edge length (m) at which so many vertices lie on an area with free rims of some length.
pub(super) fn even_size(area: f64, rims: f64, vertices: usize) -> f64 {
    // Vertices for edges of length h: 1/h² times what the area takes, 1/h times what the rims take.
    let (a, b, n) = (AREA * area, RIM * rims, vertices.max(4) as f64);
    (b + (b * b + 4.0 * n * a).sqrt()) / (2.0 * n)
}

/// A mesh with its model and the sample loads solved on it.
struct SolvedMesh {
    remeshed: Remeshed,
    model: ShellModel,
    solutions: Vec<Vec<f64>>,
}

impl SolvedMesh {
    fn new(
        ground: &ShellGround,
        remeshed: Remeshed,
        touches: &[Touch],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        let model = ground.model(&remeshed, watch)?;
        let loads: Vec<_> = touches.iter().map(|t| model.forces(t)).collect();
        Ok(Self {
            solutions: model.solve_many(&loads),
            remeshed,
            model,
        })
    }

    fn graded(
        self,
        ground: &ShellGround,
        touches: &[Touch],
        estimate: Discretization,
        models: u64,
        solves: u64,
    ) -> Graded {
        Graded {
            linearity: linearity(&self.model, touches, &self.solutions),
            balance: self.model.check_all(
                &subsample(touches, CHECKED),
                &subsample(&self.solutions, CHECKED),
            ),
            held: ground.held(&self.remeshed),
            remeshed: self.remeshed,
            model: self.model,
            estimate,
            models,
            solves,
        }
    }
}

/// Touches that stand for all: evenly through the list, and the strongest.
pub(super) fn sample(touches: &[Touch]) -> Vec<Touch> {
    let mut sample: Vec<Touch> = subsample(touches, LOADS - 1);
    let strongest = touches.iter().max_by(|a, b| a.force.total_cmp(&b.force));
    if let Some(strongest) = strongest
        && sample.iter().all(|t| t.force < strongest.force)
    {
        sample.push(*strongest);
    }
    sample
}

/// At most `count` of the items, evenly through the list.
pub(super) fn subsample<T: Clone>(items: &[T], count: usize) -> Vec<T> {
    let step = items.len().div_ceil(count.max(1)).max(1);
    items.iter().step_by(step).cloned().collect()
}

/// Wanted edge length (m) at each vertex: equal errors for all elements (the error of strain falls with h,
/// its square times area with h⁴), changing gradually, for about as many vertices as asked for.
fn sizes(mesh: &TriMesh, errors: &[f64], vertices: usize, least: f64) -> Vec<f64> {
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let count = mesh.positions().len();
    let (mut logs, mut weights) = (vec![0.0; count], vec![0.0; count]);
    for (t, tri) in mesh.triangles().iter().enumerate() {
        let area = mesh.facet_area(t as u32);
        let now = (area * 4.0 / 3f64.sqrt()).sqrt();
        let change = (mean / errors[t].max(1e-12 * mean).max(f64::MIN_POSITIVE)).powf(0.25);
        let wanted = now * change.clamp(FINER, COARSER);
        for &v in tri {
            logs[v as usize] += area * wanted.max(f64::MIN_POSITIVE).ln();
            weights[v as usize] += area;
        }
    }
    let mut sizes: Vec<f64> = logs
        .iter()
        .zip(&weights)
        .map(|(l, w)| (l / w).exp())
        .collect();
    for _ in 0..3 {
        let inside: f64 = mesh
            .triangles()
            .iter()
            .enumerate()
            .map(|(t, tri)| {
                let size: f64 = tri.iter().map(|&v| sizes[v as usize]).sum::<f64>() / 3.0;
                AREA * mesh.facet_area(t as u32) / (size * size)
            })
            .sum();
        let rims: f64 = mesh
            .boundary_edges()
            .map(|e| {
                let ends = [e.a, e.b].map(|v| v as usize);
                let length = mesh.positions()[ends[0]].distance(mesh.positions()[ends[1]]);
                RIM * length / f64::midpoint(sizes[ends[0]], sizes[ends[1]])
            })
            .sum();
        // As many as asked for: inside / s² + rims / s.
        let n = vertices.max(4) as f64;
        let scale = (rims + (rims * rims + 4.0 * n * inside).sqrt()) / (2.0 * n);
        for size in &mut sizes {
            *size = (*size * scale).max(least);
        }
        limit_slope(mesh, &mut sizes);
    }
    sizes
}

fn limit_slope(mesh: &TriMesh, sizes: &mut [f64]) {
    const SWEEPS: usize = 30;
    for _ in 0..SWEEPS {
        let mut changed = false;
        for edge in mesh.edges() {
            let (a, b) = (edge.a as usize, edge.b as usize);
            let rise = SLOPE * mesh.positions()[a].distance(mesh.positions()[b]);
            for (i, j) in [(a, b), (b, a)] {
                if sizes[i] > sizes[j] + rise {
                    sizes[i] = sizes[j] + rise;
                    changed = true;
                }
            }
        }
        if !changed {
            return;
        }
    }
}
