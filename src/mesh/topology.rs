//! Which triangles meet at which edges and vertices, and which belong together.

/// An edge between two vertices (`a < b`) and the triangles on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its vertex of the lower number.
    pub a: u32,
    /// Its vertex of the higher number.
    pub b: u32,
    /// One at a free rim, two inside, more where shells are joined.
    pub triangles: Vec<u32>,
}

/// The edges of triangles.
pub(super) struct Sides {
    pub(super) edges: Vec<Edge>,
    /// The edge opposite each corner.
    pub(super) of_triangles: Vec<[u32; 3]>,
}

impl Sides {
    /// Edges are numbered as triangles first come to them.
    pub(super) fn of(triangles: &[[u32; 3]]) -> Self {
        let mut edges: Vec<Edge> = Vec::with_capacity(triangles.len() * 3 / 2);
        let mut of_triangles = vec![[0; 3]; triangles.len()];
        for (side, first) in first_sides(triangles).into_iter().enumerate() {
            let (t, corner, first) = (side / 3, side % 3, first as usize);
            if first == side {
                let (a, b) = ends(triangles, side);
                of_triangles[t][corner] = edges.len() as u32;
                edges.push(Edge {
                    a,
                    b,
                    triangles: Vec::with_capacity(2),
                });
            } else {
                of_triangles[t][corner] = of_triangles[first / 3][first % 3];
            }
            let edge = &mut edges[of_triangles[t][corner] as usize];
            edge.triangles.push(t as u32);
        }
        Self {
            edges,
            of_triangles,
        }
    }
}

/// The lower and the higher vertex of a side; there are three a triangle, opposite its corners.
fn ends(triangles: &[[u32; 3]], side: usize) -> (u32, u32) {
    let (tri, corner) = (triangles[side / 3], side % 3);
    let (p, q) = (tri[(corner + 1) % 3], tri[(corner + 2) % 3]);
    (p.min(q), p.max(q))
}

/// For each side the first one between the same vertices. Those with the same lower vertex are brought together by
/// counting them, which takes a third of the time of a table of all.
fn first_sides(triangles: &[[u32; 3]]) -> Vec<u32> {
    let count = 3 * triangles.len();
    let highest = triangles.iter().flatten().max();
    let vertices = highest.map_or(0, |&v| v as usize + 1);
    let mut starts = vec![0u32; vertices + 1];
    for side in 0..count {
        starts[ends(triangles, side).0 as usize + 1] += 1;
    }
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut together = vec![(0, 0); count];
    for side in 0..count {
        let (low, high) = ends(triangles, side);
        let place = &mut next[low as usize];
        together[*place as usize] = (high, side as u32);
        *place += 1;
    }
    let mut first = vec![0; count];
    for range in starts.windows(2) {
        let sides = &mut together[range[0] as usize..range[1] as usize];
        sides.sort_unstable();
        for same in sides.chunk_by(|x, y| x.0 == y.0) {
            for &(_, side) in same {
                first[side as usize] = same[0].1;
            }
        }
    }
    first
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// A fan about its last vertex, one about its first, and three triangles on one edge.
    #[test]
    fn edges_are_numbered_as_triangles_come_to_them() {
        let about_last = (0..40).map(|k| [k, k + 1, 100]);
        let about_first = (50..90).map(|k| [k + 1, 0, k]);
        let triangles: Vec<[u32; 3]> = (about_last.chain(about_first))
            .chain([[3, 4, 95], [4, 3, 96]])
            .collect();
        let sides = Sides::of(&triangles);
        let mut numbers: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        let mut around: Vec<Vec<u32>> = Vec::new();
        for (t, tri) in (0u32..).zip(&triangles) {
            for corner in 0..3 {
                let (p, q) = (tri[(corner + 1) % 3], tri[(corner + 2) % 3]);
                let new = numbers.len();
                let e = *numbers.entry((p.min(q), p.max(q))).or_insert(new);
                assert_eq!(sides.of_triangles[t as usize][corner] as usize, e);
                around.resize(numbers.len(), Vec::new());
                around[e].push(t);
            }
        }
        let found: Vec<Vec<u32>> = sides.edges.iter().map(|e| e.triangles.clone()).collect();
        assert_eq!(found, around);
        for (&(a, b), &e) in &numbers {
            assert_eq!((sides.edges[e].a, sides.edges[e].b), (a, b));
        }
        assert!(Sides::of(&[]).edges.is_empty());
    }
}
