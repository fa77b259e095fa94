//! Elements of a deck, and what they are by Ansys' numbers of their routines.

use std::collections::HashMap;

use crate::io::mesh_file::place::ElementName;
use crate::mesh::volume::Tetrahedron;

/// What is made of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    Tetrahedron,
    /// Of eight corners; those that are one may make a tetrahedron of it.
    Brick,
    Shell,
    /// Carries nothing of the part: contact, and surfaces for loads.
    Contact,
    Other,
}

/// A type of elements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Routine {
    pub name: String,
    pub used: Use,
}

impl Routine {
    /// Of what ET says: 187, or SOLID187.
    #[must_use]
    pub fn of(word: &str) -> Option<Self> {
        let digits = word.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let number: u32 = digits.parse().ok()?;
        let (family, used) = match number {
            92 | 187 | 285 => ("SOLID", Use::Tetrahedron),
            45 | 95 | 185 | 186 => ("SOLID", Use::Brick),
            63 | 93 | 181 | 281 => ("SHELL", Use::Shell),
            151..=156 => ("SURF", Use::Contact),
            169 | 170 => ("TARGE", Use::Contact),
            171..=178 => ("CONTA", Use::Contact),
            188 | 189 => ("BEAM", Use::Other),
            14 => ("COMBIN", Use::Other),
            21 => ("MASS", Use::Other),
            180 => ("LINK", Use::Other),
            184 => ("MPC", Use::Other),
            _ => ("element type ", Use::Other),
        };
        Some(Self {
            name: format!("{family}{number}"),
            used,
        })
    }
}

/// An element as the deck has it.
pub struct DeckElement {
    pub origin: ElementName,
    /// Line that it begins in.
    pub line: usize,
    /// Numbers of its type, material and section.
    pub kind: u64,
    pub material: u64,
    pub section: u64,
    /// The deck's numbers of its nodes, zero for one that is left out.
    pub nodes: Vec<u64>,
}

/// Where the nodes of a quadratic tetrahedron stand in one of ten nodes, on the edges as [`Tetrahedron`] has them.
const OF_TEN: [usize; 6] = [4, 5, 6, 7, 8, 9];
/// The same in a brick of twenty whose corners are one at K and L, and at M, N, O and P.
const OF_TWENTY: [usize; 6] = [8, 9, 11, 16, 17, 18];

impl DeckElement {
    /// The tetrahedron that it is; `places` are the nodes by the deck's numbers.
    ///
    /// # Errors
    /// A message naming the line where it is none, or names a node that is not there.
    pub fn tetrahedron(
        &self,
        routine: &Routine,
        places: &HashMap<u64, u32>,
    ) -> Result<Tetrahedron, String> {
        let (corners, middles) = match routine.used {
            Use::Brick if self.is_tetrahedral() => ([0, 1, 2, 4], OF_TWENTY),
            Use::Brick => return Err(self.is_no_tetrahedron(routine)),
            _ => ([0, 1, 2, 3], OF_TEN),
        };
        let corner = |k: usize| self.place(k, places);
        let mut tetrahedron = Tetrahedron {
            corners: [
                corner(corners[0])?,
                corner(corners[1])?,
                corner(corners[2])?,
                corner(corners[3])?,
            ],
            middles: [None; 6],
        };
        for (middle, k) in tetrahedron.middles.iter_mut().zip(middles) {
            if self.nodes.get(k).is_some_and(|&node| node != 0) {
                *middle = Some(self.place(k, places)?);
            }
        }
        Ok(tetrahedron)
    }

    /// The triangles of a shell, its nodes between corners left out.
    ///
    /// # Errors
    /// A message naming the line where a node is not there.
    pub fn triangles(&self, places: &HashMap<u64, u32>) -> Result<Vec<[u32; 3]>, String> {
        let corner = |k: usize| self.place(k, places);
        let (a, b, c) = (corner(0)?, corner(1)?, corner(2)?);
        // The last corner of a triangle is there twice, or not at all.
        match self.nodes.get(3) {
            Some(&last) if last != 0 && last != self.nodes[2] => {
                let d = corner(3)?;
                Ok(vec![[a, b, c], [a, c, d]])
            }
            _ => Ok(vec![[a, b, c]]),
        }
    }

    /// Whether a brick's corners are one at K and L, and at M, N, O and P.
    fn is_tetrahedral(&self) -> bool {
        match self.nodes[..] {
            [_, _, k, l, m, n, o, p, ..] => k == l && [n, o, p] == [m; 3],
            _ => false,
        }
    }

    fn is_no_tetrahedron(&self, routine: &Routine) -> String {
        let mut corners: Vec<u64> = self.nodes.iter().take(8).copied().collect();
        corners.sort_unstable();
        corners.dedup();
        let shape = match corners.len() {
            8 => "hexahedron",
            6 => "prism",
            5 => "pyramid",
            _ => "solid of another shape",
        };
        format!(
            "{}: the element is a {shape} ({}): only tetrahedra are computed on. Mesh the part with them (SOLID187)",
            self.origin, routine.name
        )
    }

    /// Our number of its node `k`.
    fn place(&self, k: usize, places: &HashMap<u64, u32>) -> Result<u32, String> {
        let node = self.nodes.get(k).copied().unwrap_or_default();
        places.get(&node).copied().ok_or_else(|| {
            if node == 0 {
                format!("{}: a corner of the element is missing", self.origin)
            } else {
                format!(
                    "{}: the element names node {node}, which is not there",
                    self.origin
                )
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element(nodes: &[u64]) -> DeckElement {
        DeckElement {
            origin: ElementName::in_line(29, 12),
            line: 12,
            kind: 1,
            material: 1,
            section: 1,
            nodes: nodes.to_vec(),
        }
    }

    /// Nodes numbered from ten on.
    fn places() -> HashMap<u64, u32> {
        (10..40).zip(0..).collect()
    }

    #[test]
    fn bricks_may_be_tetrahedra() {
        let brick = Routine::of("SOLID186").unwrap();
        let linear = element(&[10, 11, 12, 12, 13, 13, 13, 13]);
        let tetrahedron = linear.tetrahedron(&brick, &places()).unwrap();
        assert_eq!(tetrahedron.corners, [0, 1, 2, 3]);
        assert_eq!(tetrahedron.middles, [None; 6]);
        let nodes = [
            10, 11, 12, 12, 13, 13, 13, 13, 20, 21, 12, 22, 13, 13, 13, 13, 23, 24, 25, 25,
        ];
        let quadratic = element(&nodes).tetrahedron(&brick, &places()).unwrap();
        assert_eq!(quadratic.middles, [10, 11, 12, 13, 14, 15].map(Some));
        for (nodes, shape) in [
            ([10, 11, 12, 13, 14, 15, 16, 17], "hexahedron"),
            ([10, 11, 12, 12, 14, 15, 16, 16], "prism"),
            ([10, 11, 12, 13, 14, 14, 14, 14], "pyramid"),
        ] {
            let said = element(&nodes).tetrahedron(&brick, &places()).unwrap_err();
            assert!(said.starts_with("line 12, element 29"), "{said}");
            assert!(said.contains(shape) && said.contains("SOLID186"), "{said}");
        }
    }

    #[test]
    fn nodes_may_be_left_out_between_corners_only() {
        let ten = Routine::of("187").unwrap();
        let nodes = [10, 11, 12, 13, 20, 0, 21, 22, 23, 24];
        let found = element(&nodes).tetrahedron(&ten, &places()).unwrap();
        assert_eq!(found.middles[1], None);
        assert_eq!(found.middles[2], Some(11));
        for (nodes, word) in [([10, 11, 0, 13], "missing"), ([10, 11, 12, 99], "node 99")] {
            let said = element(&nodes).tetrahedron(&ten, &places()).unwrap_err();
            assert!(said.contains(word), "{said}");
        }
    }

    #[test]
    fn shells_are_triangles_or_two() {
        let triangles = |nodes: &[u64]| element(nodes).triangles(&places()).unwrap();
        assert_eq!(triangles(&[10, 11, 12, 12]), [[0, 1, 2]]);
        assert_eq!(triangles(&[10, 11, 12, 13]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&[10, 11, 12]).len(), 1);
        assert_eq!(Routine::of("CONTA174").unwrap().used, Use::Contact);
        assert_eq!(Routine::of("226").unwrap().name, "element type 226");
        assert_eq!(Routine::of("tid"), None);
    }
}
