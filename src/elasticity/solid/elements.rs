//! What a solid model is made of: elements with shapes, whatever they are cut from.

use faer::Mat;
use glam::DVec3;

use super::dissection::Dissection;
use crate::elasticity::Material;

/// What a displacement at a point is made of.
#[derive(Clone, Debug)]
pub struct ShapeFunctions {
    /// The element that holds the point.
    pub element: u32,
    /// Its nodes.
    pub nodes: Vec<u32>,
    /// Value and gradient (1/m) of each node's shape function.
    pub values: Vec<(f64, DVec3)>,
}

/// Elements with three displacements a node.
pub trait Elements: Send + Sync {
    /// Where the nodes lie (m).
    fn nodes(&self) -> &[DVec3];

    /// How many elements there are.
    fn count(&self) -> usize;

    /// The nodes of an element, in its own order.
    fn nodes_of(&self, element: usize) -> &[u32];

    /// How far apart points may be for the smallest elements (m).
    fn grain(&self) -> f64;

    /// A point in the middle of an element (m).
    fn centre(&self, element: usize) -> DVec3;

    /// Stiffness (N/m) over the nodes' displacements: row 3 a + i.
    fn stiffness(&self, element: usize, material: &Material) -> Mat<f64>;

    /// The element that a point of the surface (m) with this outward normal belongs to, and its place there in the
    /// element's own coordinates. `guess` is what a search leaves to the next one nearby.
    fn find(&self, point: DVec3, outward: DVec3, guess: &mut u32) -> (u32, DVec3);

    /// Values of an element's shape functions at a place in it, in the order of its nodes.
    fn values(&self, place: DVec3, into: &mut Vec<f64>);

    /// The shape functions at a point of the surface (m) with this outward normal.
    fn shape(&self, point: DVec3, outward: DVec3) -> ShapeFunctions;

    /// The points in the middle of all elements (m).
    fn centres(&self) -> Vec<DVec3> {
        (0..self.count())
            .map(|element| self.centre(element))
            .collect()
    }

    /// Nodes in a good order of elimination.
    fn elimination(&self) -> Vec<u32>;

    /// Entries of all elements' matrices: what assembling costs.
    fn entries(&self) -> f64 {
        let of = |element| (3.0 * self.nodes_of(element).len() as f64).powi(2);
        (0..self.count()).map(of).sum()
    }
}

/// The nodes of elements in an order of elimination that parts them by what they have in common.
#[must_use]
pub fn dissected(elements: &dyn Elements) -> Vec<u32> {
    let (nodes, nodes_of) = (elements.nodes().len(), |e| elements.nodes_of(e));
    Dissection::of(nodes, nodes_of, elements.centres()).order(nodes, nodes_of)
}
