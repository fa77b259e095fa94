//! Which triangles meet at which edges and vertices, and which belong together.

use super::numbers::NumberMap;

/// An edge between two vertices (`a < b`) and the triangles on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edge {
    pub a: u32,
    pub b: u32,
    pub triangles: Vec<u32>,
}

/// The edges of triangles.
pub(super) struct Sides {
    pub(super) edges: Vec<Edge>,
    /// The edge opposite each corner.
    pub(super) of_triangles: Vec<[u32; 3]>,
}

impl Sides {
    pub(super) fn of(triangles: &[[u32; 3]]) -> Self {
        let mut index: NumberMap<(u32, u32), u32> = NumberMap::default();
        index.reserve(triangles.len() * 3 / 2);
        let mut edges: Vec<Edge> = Vec::with_capacity(triangles.len() * 3 / 2);
        let of_triangles = triangles
            .iter()
            .enumerate()
            .map(|(t, tri)| {
                std::array::from_fn(|corner| {
                    let (p, q) = (tri[(corner + 1) % 3], tri[(corner + 2) % 3]);
                    let (a, b) = (p.min(q), p.max(q));
                    let e = *index.entry((a, b)).or_insert_with(|| {
                        edges.push(Edge {
                            a,
                            b,
                            triangles: Vec::with_capacity(2),
                        });
                        (edges.len() - 1) as u32
                    });
                    edges[e as usize].triangles.push(t as u32);
                    e
                })
            })
            .collect();
        Self {
            edges,
            of_triangles,
        }
    }
}

/// The representative of a vertex in a union-find forest, with its path halved.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

/// For each vertex the smallest vertex index it is connected to.
pub(crate) fn components(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    for tri in triangles {
        let first = root(&mut parent, tri[0]);
        let low = tri[1..].iter().fold(first, |low, &v| {
            let other = root(&mut parent, v);
            let (low, high) = (low.min(other), low.max(other));
            parent[high as usize] = low;
            low
        });
        parent[first as usize] = low;
    }
    (0..vertices as u32).map(|v| root(&mut parent, v)).collect()
}
