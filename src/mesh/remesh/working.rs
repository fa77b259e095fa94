//! A triangle mesh that can be edited in place: split, collapse, flip.

use std::collections::HashSet;

use glam::DVec3;

use crate::mesh::numbers::NumberSet;
use crate::mesh::surface::{Mobility, Surface};
use crate::mesh::{SurfacePoint, TriMesh};

/// A triangle that is no longer there.
const GONE: [u32; 3] = [u32::MAX; 3];

/// A vertex on its way.
#[derive(Clone, Copy, Debug)]
pub struct WorkingVertex {
    /// Where it is (m).
    pub position: DVec3,
    /// Where on the surface.
    pub at: SurfacePoint,
    /// Whether it may leave its feature line, or its place.
    pub mobility: Mobility,
    /// Edge length wanted here (m).
    pub size: f64,
}

/// The mesh while it is edited, on the surface that it must keep to.
pub struct Working<'s> {
    /// What vertices are projected onto.
    pub surface: &'s Surface,
    /// Those that were collapsed keep their numbers, without triangles.
    pub vertices: Vec<WorkingVertex>,
    /// Corners of each triangle; see [`Working::is_gone`].
    pub triangles: Vec<[u32; 3]>,
    /// Triangles round each vertex.
    pub around: Vec<Vec<u32>>,
    /// Edges on feature lines, smaller vertex first.
    pub lines: NumberSet<(u32, u32)>,
}

/// An edge by its vertices, the smaller number first.
pub fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

impl<'s> Working<'s> {
    /// Begins with the surface's own triangles; `size` is the edge length wanted at a place (both m).
    pub fn new(surface: &'s Surface, size: &dyn Fn(DVec3) -> f64) -> Self {
        let mesh = &surface.mesh;
        let vertices = (0..mesh.positions().len() as u32)
            .map(|v| {
                let position = mesh.positions()[v as usize];
                WorkingVertex {
                    position,
                    at: surface.vertex(v).unwrap_or(SurfacePoint {
                        triangle: 0,
                        barycentric: [1.0, 0.0, 0.0],
                    }),
                    mobility: surface.mobility[v as usize],
                    size: size(position),
                }
            })
            .collect();
        let lines = mesh
            .edges()
            .iter()
            .zip(&surface.features)
            .filter(|(_, f)| **f)
            .map(|(e, _)| (e.a, e.b))
            .collect();
        Self {
            surface,
            vertices,
            triangles: mesh.triangles().to_vec(),
            around: mesh.vertex_triangles().to_vec(),
            lines,
        }
    }

    /// Where a vertex is (m).
    pub fn position(&self, v: u32) -> DVec3 {
        self.vertices[v as usize].position
    }

    /// Distance of two vertices (m).
    pub fn length(&self, a: u32, b: u32) -> f64 {
        self.position(a).distance(self.position(b))
    }

    /// Edge length wanted between two vertices (m).
    pub fn wanted(&self, a: u32, b: u32) -> f64 {
        f64::midpoint(
            self.vertices[a as usize].size,
            self.vertices[b as usize].size,
        )
    }

    /// Whether an edge lies on a feature line.
    pub fn is_line(&self, a: u32, b: u32) -> bool {
        self.lines.contains(&key(a, b))
    }

    /// All edges, each once, by rising vertex numbers.
    pub fn edges(&self) -> Vec<(u32, u32)> {
        let mut edges: Vec<(u32, u32)> = self
            .triangles
            .iter()
            .filter(|t| **t != GONE)
            .flat_map(|&[a, b, c]| [key(a, b), key(b, c), key(c, a)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Triangles on an edge.
    pub fn on_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> {
        let around = self.around[a as usize].iter().copied();
        around.filter(move |&t| self.triangles[t as usize].contains(&b))
    }

    /// Whether two vertices are the ends of an edge.
    pub fn is_edge(&self, a: u32, b: u32) -> bool {
        self.on_edge(a, b).next().is_some()
    }

    /// The two triangles on an edge; nothing where there are not just two.
    pub fn pair_on_edge(&self, a: u32, b: u32) -> Option<[u32; 2]> {
        let mut on = self.on_edge(a, b);
        match (on.next(), on.next(), on.next()) {
            (Some(s), Some(t), None) => Some([s, t]),
            _ => None,
        }
    }

    /// Unit normal times twice the area of a triangle with one vertex moved.
    pub fn normal_with(&self, t: u32, moved: u32, to: DVec3) -> DVec3 {
        let [a, b, c] =
            self.triangles[t as usize].map(|v| if v == moved { to } else { self.position(v) });
        (b - a).cross(c - a)
    }

    /// Unit normal times twice the area (m²) of a triangle.
    pub fn normal(&self, t: u32) -> DVec3 {
        self.normal_with(t, u32::MAX, DVec3::ZERO)
    }

    /// Vertices that share an edge with this one, by rising number.
    pub fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut near: Vec<u32> = self.around[v as usize]
            .iter()
            .flat_map(|&t| self.triangles[t as usize])
            .filter(|&w| w != v)
            .collect();
        near.sort_unstable();
        near.dedup();
        near
    }

    /// Puts a vertex into the middle of an edge; its number.
    pub fn split(&mut self, a: u32, b: u32, size: &dyn Fn(DVec3) -> f64) -> u32 {
        let middle = self.position(a).midpoint(self.position(b));
        let line = self.is_line(a, b);
        let at = if line {
            self.surface.project_to_line(middle)
        } else {
            None
        }
        .unwrap_or_else(|| self.surface.project(middle));
        let placed = self.surface.place(at);
        // Far from the edge it would belong to another wall.
        let near = placed.distance(middle) < 0.3 * self.length(a, b);
        let position = if near { placed } else { middle };
        let m = self.vertices.len() as u32;
        self.vertices.push(WorkingVertex {
            position,
            at,
            mobility: if line { Mobility::Line } else { Mobility::Free },
            size: size(position),
        });
        self.around.push(Vec::new());
        let on: Vec<u32> = self.on_edge(a, b).collect();
        for t in on {
            let tri = self.triangles[t as usize];
            let new = self.triangles.len() as u32;
            self.triangles.push(tri.map(|v| if v == a { m } else { v }));
            self.triangles[t as usize] = tri.map(|v| if v == b { m } else { v });
            self.around[b as usize].retain(|&s| s != t);
            self.around[b as usize].push(new);
            self.around[m as usize].extend([t, new]);
            if let Some(&opposite) = tri.iter().find(|&&v| v != a && v != b) {
                self.around[opposite as usize].push(new);
            }
        }
        if self.lines.remove(&key(a, b)) {
            self.lines.insert(key(a, m));
            self.lines.insert(key(m, b));
        }
        m
    }

    /// Whether `gone` may be drawn into `kept` without changing what the surface is. What is `tiny` may go
    /// although it lies on a feature line.
    pub fn may_collapse(&self, gone: u32, kept: u32, tiny: bool) -> bool {
        let line = self.is_line(gone, kept);
        let allowed = match self.vertices[gone as usize].mobility {
            Mobility::Fixed => tiny,
            Mobility::Line => line || tiny,
            Mobility::Free => true,
        };
        let rank = |v: u32| self.vertices[v as usize].mobility;
        // A line is never drawn into what lies beside it, nor bent back onto itself.
        let folds = || {
            let mut near = self.neighbours(gone).into_iter();
            near.any(|v| self.is_line(gone, v) && self.is_line(kept, v))
        };
        let beside = rank(gone) != Mobility::Free && rank(kept) == Mobility::Free;
        if !allowed || beside || (!line && rank(gone) != Mobility::Free && folds()) {
            return false;
        }
        self.links(gone, kept)
    }

    /// The link condition: only the triangles on the edge lie between the two, so that drawing them
    /// together joins nothing else.
    pub fn links(&self, gone: u32, kept: u32) -> bool {
        let near = self.neighbours(gone);
        let common = self
            .neighbours(kept)
            .iter()
            .filter(|v| near.binary_search(v).is_ok())
            .count();
        common == self.on_edge(gone, kept).count()
    }

    /// Whether a triangle was taken out; the others keep their numbers.
    pub fn is_gone(&self, t: u32) -> bool {
        Self::is_nothing(self.triangles[t as usize])
    }

    /// Whether these corners stand for a triangle that was taken out.
    pub fn is_nothing(triangle: [u32; 3]) -> bool {
        triangle == GONE
    }

    /// Takes a triangle out.
    pub fn drop_triangle(&mut self, t: u32) {
        let tri = std::mem::replace(&mut self.triangles[t as usize], GONE);
        for v in tri {
            self.around[v as usize].retain(|&s| s != t);
        }
    }

    /// Draws `gone` into `kept`.
    pub fn collapse(&mut self, gone: u32, kept: u32) {
        for t in std::mem::take(&mut self.around[gone as usize]) {
            let tri = self.triangles[t as usize];
            if tri.contains(&kept) {
                self.triangles[t as usize] = GONE;
                for v in tri.into_iter().filter(|&v| v != gone) {
                    self.around[v as usize].retain(|&s| s != t);
                }
            } else {
                self.triangles[t as usize] = tri.map(|v| if v == gone { kept } else { v });
                self.around[kept as usize].push(t);
            }
        }
        if self.vertices[gone as usize].mobility != Mobility::Free {
            let along = self.lines.remove(&key(gone, kept));
            for v in self.neighbours(kept) {
                if self.lines.remove(&key(gone, v)) {
                    self.lines.insert(key(kept, v));
                }
            }
            if !along {
                // Two lines were joined here.
                self.vertices[kept as usize].mobility = Mobility::Fixed;
            }
        }
    }

    /// Turns the edge between two triangles to their other diagonal.
    pub fn flip(&mut self, a: u32, b: u32, [s, t]: [u32; 2], [c, d]: [u32; 2]) {
        // s has a, b, c and t has b, a, d; afterwards s has a, d, c and t has b, c, d.
        let turn = |tri: [u32; 3], from: u32, to: u32| tri.map(|v| if v == from { to } else { v });
        self.triangles[s as usize] = turn(self.triangles[s as usize], b, d);
        self.triangles[t as usize] = turn(self.triangles[t as usize], a, c);
        self.around[b as usize].retain(|&x| x != s);
        self.around[a as usize].retain(|&x| x != t);
        self.around[d as usize].push(s);
        self.around[c as usize].push(t);
    }

    /// The mesh as it stands, with each vertex's place on the surface and the feature lines.
    pub fn finish(self) -> (TriMesh, Vec<SurfacePoint>, HashSet<(u32, u32)>) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        let (mut positions, mut places) = (Vec::new(), Vec::new());
        for (v, vertex) in self.vertices.iter().enumerate() {
            if !self.around[v].is_empty() {
                number[v] = positions.len() as u32;
                positions.push(vertex.position);
                places.push(vertex.at);
            }
        }
        let triangles = self
            .triangles
            .iter()
            .filter(|t| **t != GONE)
            .map(|t| t.map(|v| number[v as usize]))
            .collect();
        let lines = self
            .lines
            .iter()
            .map(|&(a, b)| key(number[a as usize], number[b as usize]))
            .collect();
        (TriMesh::from_checked(positions, triangles), places, lines)
    }
}
