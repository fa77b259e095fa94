//! A surface that has been checked: finite, indexed, welded, of one orientation, with its neighbourhoods.
//!
//! Positions are in metres. Everything after this layer may index without checking again.

pub mod bends;
mod bodies;
pub mod canonical;
pub mod cut;
mod error;
mod facets;
pub mod flatten;
pub mod geodesic;
pub mod halve;
pub mod inside;
mod intake;
pub mod locate;
pub mod mount;
mod numbers;
mod orientation;
pub mod oriented_box;
mod point;
pub mod reach;
pub mod remesh;
pub mod repair;
mod report;
pub mod room;
pub mod sample;
pub mod scatter;
pub mod stance;
pub mod stretch;
pub mod surface;
mod thicken;
mod topology;
pub mod unroll;
pub mod volume;
pub mod walls;
pub mod winding;

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::bounds::Bounds;
use locate::SurfaceIndex;
use topology::Sides;
use volume::VolumeMesh;

pub use error::MeshError;
pub use facets::Facets;
pub use intake::TakenIn;
pub use point::SurfacePoint;
pub use report::RepairReport;
pub use topology::Edge;
pub(crate) use topology::components;

/// A validated triangle surface with its topology. Positions in metres; normals point outward as the
/// triangles wind.
#[derive(Clone, Debug)]
pub struct TriMesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    /// Index into `edges` of the edge opposite each corner.
    triangle_edges: Vec<[u32; 3]>,
    vertex_triangles: Vec<Vec<u32>>,
    vertex_normals: Vec<DVec3>,
    /// Sizes of the whole, which are asked for again and again.
    bounds: (DVec3, DVec3),
    area: f64,
    mean_edge: f64,
    /// The tetrahedra that it is the surface of, where it came with them.
    volume: Option<Arc<VolumeMesh>>,
    /// What it was before its long edges were halved.
    given: Option<Arc<Self>>,
    /// For each vertex that was added by that the two that it lies between, which come before it.
    parents: Vec<[u32; 2]>,
    /// It is open, and closes where vertices of its file within so much (m) of each other are joined.
    closes_within: Option<f64>,
    /// Where its points are found, once somebody has asked; copies share it.
    index: OnceLock<Arc<SurfaceIndex>>,
}

impl TriMesh {
    /// Builds the neighbourhoods of a surface that is known to be sound.
    pub(crate) fn from_checked(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let sides = Sides::of(&triangles);
        Self::with_sides(positions, triangles, sides)
    }

    fn with_sides(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, sides: Sides) -> Self {
        let Sides {
            edges,
            of_triangles: triangle_edges,
        } = sides;
        let mut around = vec![0; positions.len()];
        for &v in triangles.iter().flatten() {
            around[v as usize] += 1;
        }
        let mut vertex_triangles: Vec<Vec<u32>> =
            around.into_iter().map(Vec::with_capacity).collect();
        for (t, tri) in triangles.iter().enumerate() {
            for &v in tri {
                vertex_triangles[v as usize].push(t as u32);
            }
        }
        let vertex_normals = vertex_normals(&positions, &triangles);
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let area = |t| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a).length() / 2.0
        };
        let length = |e: &Edge| positions[e.a as usize].distance(positions[e.b as usize]);
        let Bounds { lower, upper } = Bounds::around(positions.iter().copied());
        Self {
            bounds: (lower, upper),
            area: triangles.iter().map(area).sum(),
            mean_edge: edges.iter().map(length).sum::<f64>() / edges.len() as f64,
            positions,
            triangles,
            edges,
            triangle_edges,
            vertex_triangles,
            vertex_normals,
            volume: None,
            given: None,
            parents: Vec::new(),
            closes_within: None,
            index: OnceLock::new(),
        }
    }

    /// The same surface, known to be that of tetrahedra.
    #[must_use]
    pub fn around(self, volume: VolumeMesh) -> Self {
        Self {
            volume: Some(Arc::new(volume)),
            ..self
        }
    }

    /// The tetrahedra that it is the surface of, where it came with them.
    #[must_use]
    pub fn volume(&self) -> Option<&Arc<VolumeMesh>> {
        self.volume.as_ref()
    }

    /// The surface is open, and closes where vertices of its file within so much (m) of each other are joined.
    #[must_use]
    pub fn closes_within(&self) -> Option<f64> {
        self.closes_within
    }

    /// The tree that finds places on it: grown when it is first asked for, and kept.
    ///
    /// # Panics
    /// Never: a mesh has triangles, and its indices were checked.
    #[must_use]
    pub fn index(&self) -> &Arc<SurfaceIndex> {
        let grown = || SurfaceIndex::of(self.positions.clone(), &self.triangles);
        self.index.get_or_init(|| Arc::new(grown()))
    }

    /// Places of the vertices (m).
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }
    /// Vertices of each triangle, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
    /// Every edge once.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }
    /// Edges of each triangle, by their numbers.
    #[must_use]
    pub fn triangle_edges(&self) -> &[[u32; 3]] {
        &self.triangle_edges
    }
    /// Triangles around each vertex.
    #[must_use]
    pub fn vertex_triangles(&self) -> &[Vec<u32>] {
        &self.vertex_triangles
    }
    /// Unit normals, averaged by corner angle.
    #[must_use]
    pub fn vertex_normals(&self) -> &[DVec3] {
        &self.vertex_normals
    }

    /// The same surface moved along its normals (m); against them where that is less than nothing.
    #[must_use]
    pub fn offset(&self, by: f64) -> Self {
        let both = self.positions.iter().zip(&self.vertex_normals);
        let moved = both.map(|(p, n)| *p + *n * by).collect();
        Self::from_checked(moved, self.triangles.clone())
    }

    /// The same surface with its inside out.
    #[must_use]
    pub fn turned_over(&self) -> Self {
        let turned = self.triangles.iter().map(|&[a, b, c]| [a, c, b]);
        Self::from_checked(self.positions.clone(), turned.collect())
    }

    /// The triangles that are kept, with their vertices' numbers in this mesh; nothing where none is.
    #[must_use]
    pub fn part_of(&self, keep: impl Fn(u32) -> bool) -> Option<(Self, Vec<u32>)> {
        let mut number = vec![u32::MAX; self.positions.len()];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (_, tri) in (0u32..).zip(&self.triangles).filter(|(t, _)| keep(*t)) {
            triangles.push(tri.map(|v| {
                if number[v as usize] == u32::MAX {
                    number[v as usize] = vertices.len() as u32;
                    vertices.push(v);
                }
                number[v as usize]
            }));
        }
        let positions = vertices
            .iter()
            .map(|&v| self.positions[v as usize])
            .collect();
        (!triangles.is_empty()).then(|| (Self::from_checked(positions, triangles), vertices))
    }

    /// The three corners of a triangle (m).
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Unit normal of a facet.
    #[must_use]
    pub fn facet_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Area of a facet (m²).
    #[must_use]
    pub fn facet_area(&self, triangle: u32) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() / 2.0
    }

    /// The longest side of a facet (m).
    #[must_use]
    pub fn longest_side(&self, triangle: u32) -> f64 {
        let p = self.corners(triangle);
        let side = |i: usize| p[i].distance(p[(i + 1) % 3]);
        (0..3).map(side).fold(0.0, f64::max)
    }

    /// The point of the surface at a vertex; in the first triangle where none has it.
    #[must_use]
    pub fn vertex_point(&self, vertex: usize) -> SurfacePoint {
        let around = &self.vertex_triangles[vertex];
        let triangle = around.first().copied().unwrap_or(0);
        let corners = self.triangles[triangle as usize];
        SurfacePoint {
            triangle,
            barycentric: corners.map(|c| f64::from(u8::from(c as usize == vertex))),
        }
    }

    /// A point of the surface at each vertex, in order.
    #[must_use]
    pub fn vertex_points(&self) -> Vec<SurfacePoint> {
        let vertices = 0..self.vertex_triangles.len();
        vertices.map(|v| self.vertex_point(v)).collect()
    }

    /// Height of a facet over its longest side.
    #[must_use]
    pub fn thinness(&self, triangle: u32) -> f64 {
        let p = self.corners(triangle);
        let longest = (0..3)
            .map(|i| p[i].distance_squared(p[(i + 1) % 3]))
            .fold(0.0, f64::max);
        2.0 * self.facet_area(triangle) / longest
    }

    /// Area of the whole surface (m²).
    #[must_use]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// What a closed surface encloses (m³).
    #[must_use]
    pub fn volume_enclosed(&self) -> f64 {
        let origin = self.bounds().0;
        let cone = |t: u32| {
            let [a, b, c] = self.corners(t).map(|p| p - origin);
            a.dot(b.cross(c))
        };
        let sum: f64 = (0..self.triangles.len() as u32).map(cone).sum();
        sum.abs() / 6.0
    }

    /// Mean edge length (m): the element size that figures are quoted for.
    #[must_use]
    pub fn mean_edge(&self) -> f64 {
        self.mean_edge
    }

    /// Lower and upper corner of the axis-aligned box around the surface (m).
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// Edges with a triangle on one side only: the free rims of the surface.
    pub fn boundary_edges(&self) -> impl Iterator<Item = &Edge> {
        self.edges.iter().filter(|e| e.triangles.len() == 1)
    }

    /// Vertices on a free rim.
    #[must_use]
    pub fn boundary_vertices(&self) -> Vec<bool> {
        let mut boundary = vec![false; self.positions.len()];
        for edge in self.boundary_edges() {
            boundary[edge.a as usize] = true;
            boundary[edge.b as usize] = true;
        }
        boundary
    }

    /// The position at barycentric coordinates of a triangle (m).
    #[must_use]
    pub fn point(&self, at: SurfacePoint) -> DVec3 {
        let corners = self.corners(at.triangle);
        (0..3).map(|i| corners[i] * at.barycentric[i]).sum()
    }

    /// The smoothed unit normal at a point, from the vertex normals; at a vertex on a crease the facet's own.
    #[must_use]
    pub fn normal(&self, at: SurfacePoint) -> DVec3 {
        /// Vertex normals turned further than this from the facet belong to a crease (cos 30°).
        const CREASE: f64 = 0.866;
        let tri = self.triangles[at.triangle as usize];
        let own = self.facet_normal(at.triangle);
        let blend: DVec3 = (0..3)
            .map(|i| {
                let smooth = self.vertex_normals[tri[i] as usize];
                let normal = if smooth.dot(own) < CREASE {
                    own
                } else {
                    smooth
                };
                normal * at.barycentric[i]
            })
            .sum();
        blend
            .try_normalize()
            .unwrap_or_else(|| self.facet_normal(at.triangle))
    }

    /// Whether a point lies where a mask (one value a vertex) is mostly set.
    #[must_use]
    pub fn mostly_in(&self, mask: &[bool], at: SurfacePoint) -> bool {
        let corners = self.triangles[at.triangle as usize];
        let set = |(v, w): (u32, f64)| if mask[v as usize] { w } else { 0.0 };
        corners
            .into_iter()
            .zip(at.barycentric)
            .map(set)
            .sum::<f64>()
            >= 0.5
    }

    /// Linear interpolation of a value given at the vertices.
    #[must_use]
    pub fn interpolate(&self, values: &[f64], at: SurfacePoint) -> f64 {
        let tri = self.triangles[at.triangle as usize];
        (0..3)
            .map(|i| values[tri[i] as usize] * at.barycentric[i])
            .sum()
    }
}

fn vertex_normals(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for tri in triangles {
        let p = tri.map(|v| positions[v as usize]);
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for i in 0..3 {
            let (u, v) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
            normals[tri[i] as usize] += normal * u.angle_between(v);
        }
    }
    normals.iter().map(|n| n.normalize_or_zero()).collect()
}
