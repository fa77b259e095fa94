//! Tetrahedra of a mesh that the user has, with displacements of any order on them.
//!
//! Their shape stays the quadratic one of the file. Quadratic displacements bend a wall that is one long tetrahedron
//! thick far too little, and halves of them have as many unknowns as order 4 on the same tetrahedra: on a limb with
//! walls of 0.9 mm and edges of 4 mm the displacement under a touch was 55 % too small as given, 35 % halved, and
//! 18, 6 and 2 % too small at orders 3, 4 and 5. So their order is raised.

use std::collections::{HashMap, HashSet};
use std::sync::{Arc, OnceLock};

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use glam::DVec3;

use super::dissection::{Dissection, Net};
use super::isotropic::isotropic;
use super::simplex::Simplex;
use super::{Elements, ShapeFunctions, neighbours};
use crate::elasticity::Material;
use crate::elasticity::solver::FactorPlan;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::volume::{FacePlace, VolumeMesh, jacobian, shapes};

/// Elements of one order on the user's tetrahedra.
pub struct OrderedTetrahedra {
    mesh: Arc<VolumeMesh>,
    simplex: Simplex,
    /// Where the nodes of the displacements lie (m), and which ones every tetrahedron has, one after the other.
    nodes: Vec<DVec3>,
    numbers: Vec<u32>,
    rule: Vec<RulePoint>,
    /// Finds the triangle of the surface that a point lies on.
    index: SurfaceIndex,
    /// For each of those its element and the places of its corners in it.
    places: Vec<FacePlace>,
    /// Asked for by every load.
    grain: f64,
    /// Of the mesh, for all orders.
    dissection: Arc<OnceLock<Dissection>>,
    plan: OnceLock<Option<FactorPlan>>,
}

/// A point of the rule, with the gradients of the displacements' shape functions there.
struct RulePoint {
    at: DVec3,
    weight: f64,
    gradients: Vec<DVec3>,
}

/// A node by the corners it lies between and how many steps of the lattice it is towards each, in the order of the
/// corners: the same in every tetrahedron that has it.
type NodeKey = [(u32, u8); 4];

fn key(corners: &[u32], steps: &[usize; 4]) -> NodeKey {
    /// Stands where there are less than four corners.
    const NONE: (u32, u8) = (u32::MAX, 0);
    let mut key: NodeKey = std::array::from_fn(|c| match steps[c] {
        0 => NONE,
        steps => (corners[c], steps as u8),
    });
    key.sort_unstable();
    key
}

/// The nodes of a mesh's displacements (m), and every tetrahedron's numbers of them.
fn numbered(mesh: &VolumeMesh, simplex: &Simplex) -> (Vec<DVec3>, Vec<u32>) {
    let count = simplex.lattice().len();
    // Where the nodes lie in a tetrahedron is the same in all.
    let weights: Vec<_> = (0..count).map(|n| shapes(simplex.place(n))).collect();
    let mut known: HashMap<NodeKey, u32> = HashMap::new();
    let mut nodes: Vec<DVec3> = Vec::new();
    let mut numbers = Vec::new();
    for tet in &mesh.tetrahedra {
        let p = tet.map(|n| mesh.nodes[n as usize]);
        for (steps, weights) in simplex.lattice().iter().zip(&weights) {
            let number = known.entry(key(&tet[..4], steps)).or_insert_with(|| {
                nodes.push(weights.iter().zip(&p).map(|((n, _), p)| *p * *n).sum());
                nodes.len() as u32 - 1
            });
            numbers.push(*number);
        }
    }
    (nodes, numbers)
}

/// What tetrahedra have in common: corners, edges and faces, with as many nodes as they have at order 4.
fn nets(mesh: &VolumeMesh) -> Vec<Net> {
    let mut known: HashMap<[u32; 4], usize> = HashMap::new();
    let mut nets: Vec<Net> = Vec::new();
    for (element, tet) in (0u32..).zip(&mesh.tetrahedra) {
        for taken in 1..15_u32 {
            let has = |corner: usize| taken >> corner & 1 == 1;
            let mut corners: [u32; 4] =
                std::array::from_fn(|c| if has(c) { tet[c] } else { u32::MAX });
            corners.sort_unstable();
            let at = *known.entry(corners).or_insert_with(|| {
                nets.push(Net {
                    elements: Vec::new(),
                    nodes: if taken.is_power_of_two() { 1 } else { 3 },
                });
                nets.len() - 1
            });
            nets[at].elements.push(element);
        }
    }
    nets.retain(|net| net.elements.len() > 1);
    nets
}

impl OrderedTetrahedra {
    /// Of an order between 1 and [`super::simplex::HIGHEST`].
    #[must_use]
    pub fn new(mesh: &Arc<VolumeMesh>, order: usize) -> Self {
        Self::dissected(mesh, order, &Arc::default())
    }

    /// As [`Self::new`]; the order of elimination goes by a dissection that is found when it is first asked for, for all orders.
    #[must_use]
    pub fn dissected(
        mesh: &Arc<VolumeMesh>,
        order: usize,
        dissection: &Arc<OnceLock<Dissection>>,
    ) -> Self {
        let (triangles, places) = mesh.surface_places();
        let simplex = Simplex::new(order);
        let (nodes, numbers) = numbered(mesh, &simplex);
        let point = |(at, weight)| RulePoint {
            at,
            weight,
            gradients: simplex.at(at).into_iter().map(|(_, g)| g).collect(),
        };
        Self {
            index: SurfaceIndex::of(mesh.nodes.clone(), &triangles),
            rule: simplex.rule().into_iter().map(point).collect(),
            grain: mesh.mean_edge() / order as f64,
            mesh: Arc::clone(mesh),
            nodes,
            numbers,
            simplex,
            places,
            dissection: Arc::clone(dissection),
            plan: OnceLock::new(),
        }
    }

    /// What the factor of their stiffness will be; nothing where not even that fits into memory.
    #[must_use]
    pub fn plan(&self) -> Option<&FactorPlan> {
        let found = || FactorPlan::new(&neighbours(self), &self.dissect(), 3).ok();
        self.plan.get_or_init(found).as_ref()
    }

    /// The nodes in the order of elimination.
    fn dissect(&self) -> Vec<u32> {
        let dissection = self
            .dissection
            .get_or_init(|| Dissection::new(nets(&self.mesh), self.centres()));
        dissection.order(self.nodes.len(), |element| self.nodes_of(element))
    }

    /// Nodes on faces that are named by their corners in rising order.
    #[must_use]
    pub fn nodes_on(&self, faces: &HashSet<[u32; 3]>) -> Vec<u32> {
        let mut found = Vec::new();
        for (element, tet) in self.mesh.tetrahedra.iter().enumerate() {
            for opposite in 0..4 {
                let mut face = [1, 2, 3].map(|step| tet[(opposite + step) % 4]);
                face.sort_unstable();
                if faces.contains(&face) {
                    let nodes = self.nodes_of(element).iter().zip(self.simplex.lattice());
                    let on = nodes.filter(|(_, steps)| steps[opposite] == 0);
                    found.extend(on.map(|(&node, _)| node));
                }
            }
        }
        found
    }

    fn corners(&self, element: usize) -> [DVec3; 10] {
        self.mesh.tetrahedra[element].map(|n| self.mesh.nodes[n as usize])
    }

    /// Σ weight ∂a/∂xᵢ ∂b/∂xⱼ at (3 a + i, 3 b + j), over the element.
    fn products(&self, element: usize) -> Mat<f64> {
        let nodes = self.corners(element);
        let rows = 3 * self.simplex.lattice().len();
        let mut gradients = Mat::<f64>::zeros(rows, self.rule.len());
        let mut weighted = Mat::<f64>::zeros(rows, self.rule.len());
        for (q, point) in self.rule.iter().enumerate() {
            let jacobian = jacobian(&nodes, point.at);
            let inverse = jacobian.inverse().transpose();
            let weight = point.weight * jacobian.determinant();
            let gradients = gradients.col_as_slice_mut(q).chunks_exact_mut(3);
            let weighted = weighted.col_as_slice_mut(q).chunks_exact_mut(3);
            for ((own, weighted), gradient) in gradients.zip(weighted).zip(&point.gradients) {
                let gradient = inverse * *gradient;
                own.copy_from_slice(&gradient.to_array());
                weighted.copy_from_slice(&(weight * gradient).to_array());
            }
        }
        let mut products = Mat::<f64>::zeros(rows, rows);
        matmul(
            products.as_mut(),
            Accum::Replace,
            weighted.as_ref(),
            gradients.as_ref().transpose(),
            1.0,
            Par::Seq,
        );
        products
    }
}

impl Elements for OrderedTetrahedra {
    fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    fn count(&self) -> usize {
        self.mesh.tetrahedra.len()
    }

    fn nodes_of(&self, element: usize) -> &[u32] {
        let count = self.simplex.lattice().len();
        &self.numbers[element * count..][..count]
    }

    fn grain(&self) -> f64 {
        self.grain
    }

    fn centre(&self, element: usize) -> DVec3 {
        self.corners(element)[..4].iter().sum::<DVec3>() / 4.0
    }

    fn stiffness(&self, element: usize, material: &Material) -> Mat<f64> {
        isotropic(&self.products(element), material, DVec3::ONE)
    }

    fn find(&self, point: DVec3, _: DVec3, guess: &mut u32) -> (u32, DVec3) {
        let at = self.index.nearest_from(*guess, point);
        *guess = at.triangle;
        let (element, corners) = &self.places[at.triangle as usize];
        let place = (0..3).map(|i| corners[i] * at.barycentric[i]).sum();
        (*element, place)
    }

    fn values(&self, place: DVec3, into: &mut Vec<f64>) {
        self.simplex.values(place, into);
    }

    fn shape(&self, point: DVec3, outward: DVec3) -> ShapeFunctions {
        let (element, place) = self.find(point, outward, &mut 0);
        let nodes = self.corners(element as usize);
        let inverse = jacobian(&nodes, place).inverse().transpose();
        let values = self.simplex.at(place).into_iter();
        ShapeFunctions {
            element,
            nodes: self.nodes_of(element as usize).to_vec(),
            values: values.map(|(n, g)| (n, inverse * g)).collect(),
        }
    }

    fn elimination(&self) -> Vec<u32> {
        self.dissect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra with a face in common, one edge of it curved.
    fn pair() -> Arc<VolumeMesh> {
        let corners = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::new(1.0, 1.0, 1.0),
        ];
        let mut mesh = VolumeMesh::of_linear(corners.to_vec(), &[[0, 1, 2, 3], [1, 2, 3, 4]])
            .checked()
            .unwrap();
        let middle = mesh.tetrahedra[0][5];
        mesh.nodes[middle as usize] += DVec3::new(0.05, 0.05, -0.03);
        Arc::new(mesh.checked().unwrap())
    }

    #[test]
    fn neighbours_share_the_nodes_between_them_at_any_order() {
        for order in 1..=5 {
            let elements = OrderedTetrahedra::new(&pair(), order);
            let each = Simplex::count(order);
            let shared = (order + 1) * (order + 2) / 2;
            assert_eq!(elements.nodes().len(), 2 * each - shared, "{order}");
        }
        // Of order 2 they are the mesh's own.
        let mesh = pair();
        let elements = OrderedTetrahedra::new(&mesh, 2);
        let known = |p: &DVec3| mesh.nodes.iter().any(|q| q.distance(*p) < 1e-15);
        assert!(elements.nodes().iter().all(known));
        assert_eq!(elements.nodes_of(0).len(), 10);
    }

    #[test]
    fn rigid_motions_cost_nothing_and_a_stretch_what_it_should() {
        let material = Material {
            youngs_modulus: 2.0,
            poissons_ratio: 0.3,
        };
        let (lambda, mu) = material.lame();
        for order in 2..=5 {
            let elements = OrderedTetrahedra::new(&pair(), order);
            let energy = |field: &dyn Fn(DVec3) -> DVec3| -> (f64, f64) {
                let mut energy = 0.0;
                let mut volume = 0.0;
                for element in 0..elements.count() {
                    let k = elements.stiffness(element, &material);
                    let nodes = elements.nodes_of(element);
                    let u: Vec<f64> = (nodes.iter())
                        .flat_map(|&n| field(elements.nodes()[n as usize]).to_array())
                        .collect();
                    for i in 0..u.len() {
                        for j in 0..u.len() {
                            energy += 0.5 * u[i] * k[(i, j)] * u[j];
                        }
                    }
                    let p = elements.corners(element);
                    volume += (elements.rule.iter())
                        .map(|q| q.weight * jacobian(&p, q.at).determinant())
                        .sum::<f64>();
                }
                (energy, volume)
            };
            let (turned, _) = energy(&|p: DVec3| DVec3::new(1.0 - p.y, 2.0 + p.x, 0.0));
            assert!(turned.abs() < 1e-10, "{order}: {turned}");
            let (stretched, volume) = energy(&|p: DVec3| DVec3::new(p.x, 0.0, 0.0));
            let exact = 0.5 * (lambda + 2.0 * mu) * volume;
            assert!((stretched / exact - 1.0).abs() < 1e-10, "{order}");
        }
    }
}
