//! Tetrahedra that the user has: nodes, quadratic elements, and the surface around them.

mod body;
mod straighten;

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::MeshError;
use crate::plain;
use crate::units;

pub use straighten::Straightened;

/// Edges of a tetrahedron that nodes 4 to 9 lie on, as Abaqus counts them.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
/// Faces by their corners, counter-clockwise from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// Ten-node tetrahedra. Linear ones get nodes at the middles of their edges: on the same elements quadratic
/// displacements bend where linear ones lock.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeMesh {
    /// m.
    pub nodes: Vec<DVec3>,
    /// Corners, then the nodes on [`EDGES`].
    pub tetrahedra: Vec<[u32; 10]>,
    /// Whether the file's were linear.
    pub from_linear: bool,
}

/// A tetrahedron as a file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tetrahedron {
    /// Its four corner nodes.
    pub corners: [u32; 4],
    /// The nodes on [`EDGES`], where it has some.
    pub middles: [Option<u32>; 6],
}

/// The tetrahedron behind a triangle of the surface, and where the triangle's corners are in it.
pub type FacePlace = (u32, [DVec3; 3]);

/// Why tetrahedra were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// It has no volume.
    #[error(
        "the tetrahedron has no volume (near {:.2} mm): repair the mesh in the program that wrote it",
        units::mm(*place)
    )]
    Flat {
        /// Which tetrahedron.
        element: usize,
        /// Where it lies (m).
        place: DVec3,
    },
    /// A bent edge turns it inside out.
    #[error(
        "an edge of the tetrahedron is bent so far that it is turned inside out there (near {:.2} mm), and straightening that edge would move its node by {}, more than the {} that are allowed: raise part.straighten_mm, or straighten it in the mesher",
        units::mm(*place),
        plain::length(*shift),
        plain::length(*most)
    )]
    Folded {
        /// Which tetrahedron.
        element: usize,
        /// Where it lies (m).
        place: DVec3,
        /// How far the node in the middle of the edge would move, and how far it may (m).
        shift: f64,
        /// How far a node may be moved (m).
        most: f64,
    },
    /// One of its middle nodes belongs elsewhere.
    #[error(
        "one of its nodes lies in the middle of two edges, or is a corner elsewhere: write the mesh anew"
    )]
    Astray {
        /// Which tetrahedron.
        element: usize,
    },
    /// It lies on the wrong side of a face that it shares.
    #[error(
        "the tetrahedron overlaps another one that it shares a face with (near {:.2} mm): mesh the part anew",
        units::mm(*place)
    )]
    Overlapping {
        /// Which tetrahedron.
        element: usize,
        /// Where it lies (m).
        place: DVec3,
    },
    /// Its neighbour has another middle node on a shared edge.
    #[error(
        "on one of its edges the tetrahedron has another middle node than its neighbour: join equal nodes in the program that wrote the mesh"
    )]
    Torn {
        /// Which tetrahedron.
        element: usize,
    },
    /// Its surface is no mesh.
    #[error(transparent)]
    Surface(#[from] MeshError),
}

impl VolumeError {
    /// Which tetrahedron it is about.
    #[must_use]
    pub fn element(&self) -> Option<usize> {
        match *self {
            Self::Flat { element, .. }
            | Self::Folded { element, .. }
            | Self::Astray { element }
            | Self::Overlapping { element, .. }
            | Self::Torn { element } => Some(element),
            Self::Surface(_) => None,
        }
    }
}

/// Nodes at the middles of edges, by their ends, the smaller one first.
type Middles = HashMap<(u32, u32), u32>;

/// An edge by its ends, the smaller one first.
fn edge(tet: &[u32], ends: [usize; 2]) -> (u32, u32) {
    let [a, b] = ends.map(|i| tet[i]);
    (a.min(b), a.max(b))
}

impl VolumeMesh {
    /// Of linear and quadratic tetrahedra; an edge without a node of its own shares that of its neighbour.
    ///
    /// # Errors
    /// [`VolumeError::Torn`] where two have different nodes on the same edge, which would move apart;
    /// [`VolumeError::Astray`] for a node that is on one edge and somewhere else too.
    pub fn of(nodes: Vec<DVec3>, tetrahedra: &[Tetrahedron]) -> Result<Self, VolumeError> {
        let mut middles = Middles::new();
        let mut owners: HashMap<u32, (u32, u32)> = HashMap::new();
        let corners: Vec<[u32; 4]> = tetrahedra.iter().map(|tet| tet.corners).collect();
        let mut is_corner = vec![false; nodes.len()];
        for &corner in corners.iter().flatten() {
            is_corner[corner as usize] = true;
        }
        for (element, tet) in tetrahedra.iter().enumerate() {
            for (&ends, middle) in EDGES.iter().zip(tet.middles) {
                let Some(middle) = middle else { continue };
                let edge = edge(&tet.corners, ends);
                if *middles.entry(edge).or_insert(middle) != middle {
                    return Err(VolumeError::Torn { element });
                }
                let astray = *owners.entry(middle).or_insert(edge) != edge;
                if astray || is_corner[middle as usize] {
                    return Err(VolumeError::Astray { element });
                }
            }
        }
        let from_linear = (tetrahedra.iter()).any(|tet| tet.middles.iter().any(Option::is_none));
        Ok(Self {
            from_linear,
            ..Self::completed(nodes, &corners, middles)
        })
    }

    /// Of linear tetrahedra.
    #[must_use]
    pub fn of_linear(nodes: Vec<DVec3>, corners: &[[u32; 4]]) -> Self {
        Self::completed(nodes, corners, Middles::new())
    }

    /// With the nodes on all edges, those that are known already and new ones on the others.
    fn completed(mut nodes: Vec<DVec3>, corners: &[[u32; 4]], mut middles: Middles) -> Self {
        let tetrahedra = corners
            .iter()
            .map(|tet| {
                std::array::from_fn(|k| {
                    if k < 4 {
                        return tet[k];
                    }
                    let (a, b) = edge(tet, EDGES[k - 4]);
                    *middles.entry((a, b)).or_insert_with(|| {
                        nodes.push((nodes[a as usize] + nodes[b as usize]) / 2.0);
                        nodes.len() as u32 - 1
                    })
                })
            })
            .collect();
        Self {
            nodes,
            tetrahedra,
            from_linear: true,
        }
    }

    /// Turns elements to positive volumes and checks them with straight edges: what bent ones do is
    /// [`Self::straighten`]'s.
    ///
    /// # Errors
    /// [`VolumeError`] naming the element that is none.
    pub fn checked(mut self) -> Result<Self, VolumeError> {
        for (element, tet) in self.tetrahedra.iter_mut().enumerate() {
            let p = tet.map(|n| self.nodes[n as usize]);
            let volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
            let longest = EDGES
                .iter()
                .map(|&[a, b]| p[a].distance(p[b]))
                .fold(0.0, f64::max);
            let place = p[0];
            if volume.is_nan() || volume.abs() <= 1e-9 * longest.powi(3) {
                return Err(VolumeError::Flat { element, place });
            }
            if volume < 0.0 {
                tet.swap(1, 2);
                // The nodes on the edges 01 and 02, and on 13 and 23, change places with them.
                tet.swap(4, 6);
                tet.swap(8, 9);
            }
        }
        match self.overlapping() {
            None => Ok(self),
            Some(element) => Err(VolumeError::Overlapping {
                element,
                place: self.nodes[self.tetrahedra[element][0] as usize],
            }),
        }
    }

    /// The first tetrahedron of positive volume on that side of a face where another one lies already.
    fn overlapping(&self) -> Option<usize> {
        let mut taken = HashSet::with_capacity(2 * self.tetrahedra.len());
        self.tetrahedra.iter().position(|tet| {
            FACES
                .iter()
                .any(|face| !taken.insert(side_of(face.map(|i| tet[i]))))
        })
    }

    /// Nodes, and where the tetrahedra were linear those on the edges between them.
    #[must_use]
    pub fn with_middles(&self, nodes: &[u32]) -> Vec<u32> {
        let mut set: HashSet<u32> = nodes.iter().copied().collect();
        if self.from_linear {
            for tet in &self.tetrahedra {
                for (k, ends) in EDGES.iter().enumerate() {
                    if ends.iter().all(|&e| set.contains(&tet[e])) {
                        set.insert(tet[4 + k]);
                    }
                }
            }
        }
        let mut all: Vec<u32> = set.into_iter().collect();
        all.sort_unstable();
        all
    }

    /// Mean distance between corners (m).
    #[must_use]
    pub fn mean_edge(&self) -> f64 {
        let length = |t: &[u32; 10]| -> f64 {
            let p = t.map(|n| self.nodes[n as usize]);
            EDGES.iter().map(|&[a, b]| p[a].distance(p[b])).sum()
        };
        let total: f64 = self.tetrahedra.iter().map(length).sum();
        total / (6 * self.tetrahedra.len()) as f64
    }

    /// Faces with one tetrahedron, by their corners and the nodes on the edges between them (01, 12, 20).
    fn boundary(&self) -> Vec<[u32; 6]> {
        self.boundary_of()
            .into_iter()
            .map(|(_, _, face)| face)
            .collect()
    }

    /// As [`Self::boundary`], with the tetrahedron and which of its faces it is.
    fn boundary_of(&self) -> Vec<(u32, usize, [u32; 6])> {
        let mut faces: HashMap<[u32; 3], Option<(u32, usize)>> = HashMap::new();
        for (element, tet) in (0u32..).zip(&self.tetrahedra) {
            for (side, face) in FACES.iter().enumerate() {
                let mut key = face.map(|i| tet[i]);
                key.sort_unstable();
                faces
                    .entry(key)
                    .and_modify(|f| *f = None)
                    .or_insert(Some((element, side)));
            }
        }
        let mut found: Vec<(u32, usize)> = faces.into_values().flatten().collect();
        found.sort_unstable();
        let nodes = |(element, side): (u32, usize)| {
            let tet = &self.tetrahedra[element as usize];
            let [a, b, c] = FACES[side];
            let all = [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
            (element, side, all.map(|i| tet[i]))
        };
        found.into_iter().map(nodes).collect()
    }

    /// The surface as triangles of nodes, four a face.
    fn surface_triangles(&self) -> Vec<[u32; 3]> {
        let split =
            |[a, b, c, ab, bc, ca]: [u32; 6]| [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        self.boundary().into_iter().flat_map(split).collect()
    }

    /// For every triangle of `surface_triangles` its tetrahedron and the places of its corners in that.
    #[must_use]
    pub fn surface_places(&self) -> (Vec<[u32; 3]>, Vec<FacePlace>) {
        let mut places = Vec::new();
        for (element, side, _) in self.boundary_of() {
            let [a, b, c] = FACES[side].map(node_place);
            let (ab, bc, ca) = (a.midpoint(b), b.midpoint(c), c.midpoint(a));
            for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                places.push((element, corners));
            }
        }
        (self.surface_triangles(), places)
    }

    /// Every tetrahedron in eight, new nodes where its shape functions put them.
    #[must_use]
    pub fn refined(&self) -> Self {
        // The old nodes stay; between two of them, the same for all elements that share both, is a new one.
        let mut nodes = self.nodes.clone();
        let mut between: HashMap<(u32, u32), u32> = HashMap::new();
        let mut tetrahedra = Vec::with_capacity(8 * self.tetrahedra.len());
        for tet in &self.tetrahedra {
            let p = tet.map(|n| self.nodes[n as usize]);
            for child in CHILDREN {
                tetrahedra.push(std::array::from_fn(|k| {
                    if k < 4 {
                        return tet[child[k]];
                    }
                    let [a, b] = EDGES[k - 4].map(|i| child[i]);
                    let (m, n) = (tet[a].min(tet[b]), tet[a].max(tet[b]));
                    *between.entry((m, n)).or_insert_with(|| {
                        nodes.push(position(&p, node_place(a).midpoint(node_place(b))));
                        nodes.len() as u32 - 1
                    })
                }));
            }
        }
        Self {
            nodes,
            tetrahedra,
            from_linear: self.from_linear,
        }
    }
}

/// The children of a tetrahedron by its nodes: at its corners, and the octahedron between in four.
const CHILDREN: [[usize; 4]; 8] = [
    [0, 4, 6, 7],
    [4, 1, 5, 8],
    [6, 5, 2, 9],
    [7, 8, 9, 3],
    [4, 5, 6, 8],
    [4, 6, 7, 8],
    [6, 7, 8, 9],
    [5, 6, 8, 9],
];

/// A face by its nodes in rising order, and which of its two sides they are counter-clockwise from.
fn side_of(face: [u32; 3]) -> ([u32; 3], bool) {
    let mut nodes = face;
    nodes.sort_unstable();
    let least = face.iter().position(|&n| n == nodes[0]).unwrap_or(0);
    (nodes, face[(least + 1) % 3] == nodes[1])
}

fn middle(a: usize, b: usize) -> usize {
    let on = |e: &[usize; 2]| e.contains(&a) && e.contains(&b);
    4 + EDGES.iter().position(on).unwrap_or(0)
}

/// Where a node lies in the unit tetrahedron 0, x, y, z.
#[must_use]
pub fn node_place(node: usize) -> DVec3 {
    let corner = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    if node < 4 {
        corner[node]
    } else {
        let [a, b] = EDGES[node - 4];
        corner[a].midpoint(corner[b])
    }
}

/// Values and gradients (in the unit tetrahedron) of the ten shape functions.
#[must_use]
pub fn shapes(at: DVec3) -> [(f64, DVec3); 10] {
    let l = [1.0 - at.x - at.y - at.z, at.x, at.y, at.z];
    let g = [DVec3::NEG_ONE, DVec3::X, DVec3::Y, DVec3::Z];
    std::array::from_fn(|k| {
        if k < 4 {
            (l[k] * (2.0 * l[k] - 1.0), g[k] * (4.0 * l[k] - 1.0))
        } else {
            let [a, b] = EDGES[k - 4];
            (4.0 * l[a] * l[b], (g[a] * l[b] + g[b] * l[a]) * 4.0)
        }
    })
}

/// Where a place of the unit tetrahedron is (m).
#[must_use]
pub fn position(nodes: &[DVec3; 10], at: DVec3) -> DVec3 {
    shapes(at)
        .iter()
        .zip(nodes)
        .map(|((n, _), p)| *p * *n)
        .sum()
}

/// ∂x/∂ξ: columns are the derivatives along the unit tetrahedron's axes.
#[must_use]
pub fn jacobian(nodes: &[DVec3; 10], at: DVec3) -> glam::DMat3 {
    let mut columns = [DVec3::ZERO; 3];
    for ((_, gradient), p) in shapes(at).iter().zip(nodes) {
        for (i, column) in columns.iter_mut().enumerate() {
            *column += *p * gradient[i];
        }
    }
    glam::DMat3::from_cols(columns[0], columns[1], columns[2])
}

#[cfg(test)]
mod tests;
