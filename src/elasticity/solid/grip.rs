//! How a solid is held: nodes that do not move, and facets of the true surface that are kept from moving.
//!
//! What a box holds is a volume, and the grid has planes along its sides: nodes of the cells inside are held as
//! they are. What is painted is a piece of surface, a line or a point somewhere in its cells: stiff springs all over
//! it hold it.

use std::collections::BTreeMap;

use glam::DVec3;

use super::elements::{Elements, ShapeFunctions};
use crate::bounds::Bounds;
use crate::elasticity::error::ElasticError;
use crate::elasticity::solver::SymmetricMatrix;
use crate::elasticity::system::HELD;
use crate::elasticity::{DofSet, Material};
use crate::mesh::{Edge, SurfacePoint, TriMesh};

/// What is held.
#[derive(Clone, Debug, Default)]
pub struct Grip {
    /// Held displacements of every node.
    pub nodes: Vec<DofSet>,
    springs: Vec<Spring>,
}

/// Springs along the held ones of x, y, z at a point of the surface.
#[derive(Clone, Debug)]
struct Spring {
    point: DVec3,
    shape: ShapeFunctions,
    held: DofSet,
    /// N/m.
    stiffness: f64,
}

/// Stiffness of the springs, in Young's moduli over the size of an element, a unit of area: they give a ten
/// thousandth of what the element beside them does.
const STIFF: f64 = 1e4;
/// A facet is held at the points of this rule on each of its pieces, which are smaller than half an element.
const RULE: [[f64; 3]; 3] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
/// A line is held at the points of this rule (Gauss, two points) on each of its pieces, likewise.
const LINE: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// The surface of a part in the elements that it is held by.
#[derive(Clone, Copy)]
pub struct HeldSurface<'a> {
    /// What springs stand on.
    pub elements: &'a dyn Elements,
    /// The surface itself.
    pub mesh: &'a TriMesh,
    /// Of the part: springs are as stiff as that asks for.
    pub material: &'a Material,
    /// Of an element (m).
    pub size: f64,
}

impl HeldSurface<'_> {
    /// Of springs (Pa/m) that hold as if nothing gave way.
    #[must_use]
    pub fn firm(&self) -> f64 {
        STIFF * self.material.youngs_modulus / self.size
    }
}

impl Grip {
    /// Nothing held yet.
    #[must_use]
    pub fn new(elements: &dyn Elements) -> Self {
        Self {
            nodes: vec![DofSet::default(); elements.nodes().len()],
            springs: Vec::new(),
        }
    }

    /// Holds all nodes of the elements whose middle `inside` says is held.
    pub fn hold_elements(&mut self, elements: &dyn Elements, inside: impl Fn(DVec3) -> DofSet) {
        for element in 0..elements.count() {
            let held = inside(elements.centre(element));
            if held.0 != 0 {
                for &node in elements.nodes_of(element) {
                    self.nodes[node as usize].0 |= held.0;
                }
            }
        }
    }

    /// Holds the nodes that lie inside; whether there are any.
    pub fn hold_nodes(
        &mut self,
        elements: &dyn Elements,
        held: DofSet,
        inside: impl Fn(DVec3) -> bool,
    ) -> bool {
        let mut any = false;
        for (node, &p) in self.nodes.iter_mut().zip(elements.nodes()) {
            if inside(p) {
                node.0 |= held.0;
                any = true;
            }
        }
        any
    }

    /// Holds a facet of a surface with springs of so much an area (Pa/m).
    pub fn hold_facet(&mut self, on: &HeldSurface, facet: u32, held: DofSet, bedding: f64) {
        let mesh = on.mesh;
        let longest = mesh.longest_side(facet);
        let splits = (2.0 * longest / on.size).ceil().clamp(1.0, 64.0) as usize;
        let pieces = crate::elasticity::load::pieces(splits);
        let area = mesh.facet_area(facet) / (splits * splits) as f64 / 3.0;
        let normal = mesh.facet_normal(facet);
        for piece in pieces {
            for weights in RULE {
                let at = SurfacePoint {
                    triangle: facet,
                    barycentric: std::array::from_fn(|i| {
                        (0..3).map(|k| weights[k] * piece[k][i]).sum()
                    }),
                };
                let stiffness = bedding * area;
                self.hold_point(on.elements, mesh.point(at), normal, held, stiffness);
            }
        }
    }

    /// Holds an edge of a surface with springs.
    pub fn hold_edge(&mut self, on: &HeldSurface, edge: &Edge, held: DofSet) {
        let mesh = on.mesh;
        let [a, b] = [edge.a, edge.b].map(|v| mesh.positions()[v as usize]);
        let length = a.distance(b);
        let pieces = (2.0 * length / on.size).ceil().clamp(1.0, 64.0) as usize;
        let normal = mesh.facet_normal(edge.triangles[0]);
        let stiffness = STIFF * on.material.youngs_modulus * length / (pieces * LINE.len()) as f64;
        for piece in 0..pieces {
            for along in LINE {
                let point = a.lerp(b, (piece as f64 + along) / pieces as f64);
                self.hold_point(on.elements, point, normal, held, stiffness);
            }
        }
    }

    /// Holds a vertex of a surface with a spring.
    pub fn hold_vertex(&mut self, on: &HeldSurface, vertex: u32, held: DofSet) {
        let mesh = on.mesh;
        let normal = mesh.facet_normal(mesh.vertex_triangles()[vertex as usize][0]);
        let stiffness = STIFF * on.material.youngs_modulus * on.size;
        let point = mesh.positions()[vertex as usize];
        self.hold_point(on.elements, point, normal, held, stiffness);
    }

    /// Holds a piece of a face in the part, so large (m²) that a point stands for it.
    pub fn hold_piece(
        &mut self,
        on: &HeldSurface,
        (point, normal, area): (DVec3, DVec3, f64),
        held: DofSet,
    ) {
        let stiffness = on.firm() * area;
        self.hold_point(on.elements, point, normal, held, stiffness);
    }

    /// `stiffness` in N/m; `normal` out of the surface there.
    fn hold_point(
        &mut self,
        elements: &dyn Elements,
        point: DVec3,
        normal: DVec3,
        held: DofSet,
        stiffness: f64,
    ) {
        self.springs.push(Spring {
            point,
            shape: elements.shape(point, normal),
            held,
            stiffness,
        });
    }

    /// Adds the springs to a stiffness.
    pub(super) fn stiffen(&self, unknowns: &[u32], into: &mut SymmetricMatrix) {
        for spring in &self.springs {
            let shape = &spring.shape;
            for axis in (0..3).filter(|&i| spring.held.holds(i)) {
                for (&a, va) in shape.nodes.iter().zip(&shape.values) {
                    for (&b, vb) in shape.nodes.iter().zip(&shape.values) {
                        let (row, column) = (
                            unknowns[3 * a as usize + axis],
                            unknowns[3 * b as usize + axis],
                        );
                        if row != HELD && column != HELD && row >= column {
                            let k = spring.stiffness * va.0 * vb.0;
                            into.add(row as usize, column as usize, k);
                        }
                    }
                }
            }
        }
    }

    /// What the springs push back with (N) at unknowns that are free. What they do to a node that is held goes into what
    /// holds it.
    pub(super) fn reaction(&self, displacement: &[f64], is_held: impl Fn(usize) -> bool) -> DVec3 {
        let mut force = DVec3::ZERO;
        for spring in &self.springs {
            for axis in (0..3).filter(|&i| spring.held.holds(i)) {
                let (mut u, mut free) = (0.0, 0.0);
                for (&node, value) in spring.shape.nodes.iter().zip(&spring.shape.values) {
                    let dof = 3 * node as usize + axis;
                    u += value.0 * displacement[dof];
                    if !is_held(dof) {
                        free += value.0;
                    }
                }
                force[axis] -= spring.stiffness * u * free;
            }
        }
        force
    }

    /// The vertices of a surface that have springs on a facet around them.
    pub(super) fn near(&self, mesh: &TriMesh) -> Vec<bool> {
        let mut near = vec![false; mesh.positions().len()];
        for spring in &self.springs {
            let at = mesh.index().nearest(spring.point).0;
            for v in mesh.triangles()[at.triangle as usize] {
                near[v as usize] = true;
            }
        }
        near
    }

    /// Whether nothing is held at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.springs.is_empty() && self.nodes.iter().all(|h| h.0 == 0)
    }
}

/// Each connected piece must have its six rigid motions held. Says how many pieces there are.
///
/// # Errors
/// [`ElasticError`] saying what is loose.
pub fn check(elements: &dyn Elements, grip: &Grip) -> Result<usize, ElasticError> {
    let nodes = elements.nodes();
    let Bounds { lower, upper } = Bounds::around(nodes.iter().copied());
    if grip.is_empty() {
        return Err(ElasticError::NothingHeld { lower, upper });
    }
    if grip.nodes.iter().all(|h| h.0 & 7 == 7) {
        return Err(ElasticError::AllHeld);
    }
    let labels = labels(elements);
    let size = (upper - lower).length().max(f64::MIN_POSITIVE);
    let mut grams: BTreeMap<u32, nalgebra::Matrix6<f64>> = BTreeMap::new();
    let mut hold = |label: u32, point: DVec3, held: DofSet| {
        let gram = grams.entry(label).or_insert_with(nalgebra::Matrix6::zeros);
        let r = (point - nodes[0]) / size;
        for i in (0..3).filter(|&i| held.holds(i)) {
            let mut row = nalgebra::Vector6::zeros();
            row[i] = 1.0;
            for axis in 0..3 {
                row[3 + axis] = DVec3::AXES[axis].cross(r)[i];
            }
            *gram += row * row.transpose();
        }
    };
    for (node, &held) in grip.nodes.iter().enumerate() {
        hold(labels[node], nodes[node], held);
    }
    for spring in &grip.springs {
        hold(
            labels[spring.shape.nodes[0] as usize],
            spring.point,
            spring.held,
        );
    }
    for (&label, gram) in &grams {
        let values = gram.symmetric_eigenvalues();
        if values.max() == 0.0 {
            let (vertex, place) = (label as usize, nodes[label as usize]);
            return Err(ElasticError::NotHeld { vertex, place });
        }
        if values.min() < 1e-10 * values.max() {
            return Err(ElasticError::Loose);
        }
    }
    Ok(grams.len())
}

/// For each node the smallest node it is connected to through elements.
fn labels(elements: &dyn Elements) -> Vec<u32> {
    let fans: Vec<[u32; 3]> = (0..elements.count())
        .flat_map(|e| {
            let nodes = elements.nodes_of(e);
            (1..nodes.len()).map(|k| [nodes[0], nodes[k], nodes[k]])
        })
        .collect();
    crate::mesh::components(elements.nodes().len(), &fans)
}
