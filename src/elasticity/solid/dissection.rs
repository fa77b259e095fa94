//! An order of elimination for the nodes of any elements: nested dissection (A. George 1973).
//!
//! The elements are parted into two halves with few nodes between them (`bisect.rs`), each half likewise, down to single
//! elements. A node that elements of both halves have is eliminated after all nodes that only one half has. Where elements
//! part does not depend on how many nodes they have, so that one dissection serves all orders of shape functions.

mod bisect;
mod hypergraph;

use glam::DVec3;

use self::bisect::halves;
use self::hypergraph::{Hypergraph, merged};

pub use self::hypergraph::Net;

/// The pieces that elements are parted into, as a tree.
pub struct Dissection {
    /// For every element the piece that is it alone.
    leaves: Vec<u32>,
    /// For every piece the one that it is a half of, a larger number; the whole is its own.
    wholes: Vec<u32>,
}

/// A part of the tree: the elements in it with their pieces, and the wholes of all pieces. The last one is its root.
struct Branch {
    leaves: Vec<(u32, u32)>,
    wholes: Vec<u32>,
}

impl Dissection {
    /// Of elements around these points (m). A net is what some of them have in common, with the number of its nodes.
    #[must_use]
    pub fn new(nets: Vec<Net>, centres: Vec<DVec3>) -> Self {
        let mut leaves = vec![0; centres.len()];
        if leaves.is_empty() {
            return Self {
                leaves,
                wholes: Vec::new(),
            };
        }
        let branch = part(Hypergraph::new(nets, centres));
        for (element, piece) in branch.leaves {
            leaves[element as usize] = piece;
        }
        Self {
            leaves,
            wholes: branch.wholes,
        }
    }

    /// As [`Self::new`] of elements with so many nodes, of which `nodes_of` says which ones an element has.
    #[must_use]
    pub fn of<'a>(
        nodes: usize,
        nodes_of: impl Fn(usize) -> &'a [u32],
        centres: Vec<DVec3>,
    ) -> Self {
        let mut elements: Vec<Vec<u32>> = vec![Vec::new(); nodes];
        for element in 0..centres.len() {
            for &node in nodes_of(element) {
                elements[node as usize].push(element as u32);
            }
        }
        let nets = merged(
            elements
                .into_iter()
                .map(|elements| Net { elements, nodes: 1 }),
        );
        Self::new(nets, centres)
    }

    /// So many nodes in the order of elimination, where `nodes_of` says which ones an element has.
    #[must_use]
    pub fn order<'a>(&self, count: usize, nodes_of: impl Fn(usize) -> &'a [u32]) -> Vec<u32> {
        let mut pieces: Vec<Option<u32>> = vec![None; count];
        for (element, &leaf) in self.leaves.iter().enumerate() {
            for &node in nodes_of(element) {
                let piece = &mut pieces[node as usize];
                *piece = Some(piece.map_or(leaf, |other| self.both(other, leaf)));
            }
        }
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by_key(|&node| pieces[node as usize]);
        order
    }

    /// The smallest piece that two others are parts of.
    fn both(&self, mut one: u32, mut other: u32) -> u32 {
        while one != other {
            let smaller = if one < other { &mut one } else { &mut other };
            *smaller = self.wholes[*smaller as usize];
        }
        one
    }
}

fn part(piece: Hypergraph) -> Branch {
    if let [element] = piece.elements() {
        return Branch {
            leaves: vec![(*element, 0)],
            wholes: vec![0],
        };
    }
    let sides = halves(&piece);
    let [one, other] = [false, true].map(|side| piece.half(&sides, side));
    drop(piece);
    let (mut one, other) = (part(one), part(other));
    let first = one.wholes.len() as u32;
    one.leaves
        .extend(other.leaves.into_iter().map(|(e, at)| (e, first + at)));
    one.wholes
        .extend(other.wholes.into_iter().map(|at| first + at));
    let root = one.wholes.len() as u32;
    one.wholes[first as usize - 1] = root;
    one.wholes[root as usize - 1] = root;
    one.wholes.push(root);
    one
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of elements with one node between neighbours and one at each end.
    fn row(count: u32) -> (Vec<Net>, Vec<DVec3>, Vec<[u32; 2]>) {
        let net = |at: u32| Net {
            elements: vec![at, at + 1],
            nodes: 1,
        };
        let nodes = (0..count).map(|at| [at, at + 1]).collect();
        let centres = (0..count).map(|at| DVec3::X * f64::from(at)).collect();
        ((0..count - 1).map(net).collect(), centres, nodes)
    }

    #[test]
    fn every_node_once_and_the_middle_last() {
        let (nets, centres, nodes) = row(32);
        let order = Dissection::new(nets, centres).order(33, |e| &nodes[e]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..33));
        let middle = order[32];
        assert!((13..=19).contains(&middle), "{order:?}");
        // One half is eliminated after the other.
        let side = |node: &u32| *node < middle;
        let changes = order[..32]
            .windows(2)
            .filter(|w| side(&w[0]) != side(&w[1]));
        assert_eq!(changes.count(), 1, "{order:?}");
    }

    #[test]
    fn no_elements_and_nodes_of_none() {
        assert!(
            Dissection::new(Vec::new(), Vec::new())
                .order(0, |_| &[])
                .is_empty()
        );
        let one = Dissection::new(Vec::new(), vec![DVec3::ZERO]);
        assert_eq!(one.order(3, |_| &[0, 2]), [1, 0, 2]);
    }
}
