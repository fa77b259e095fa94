//! What every gauge reads of one newton pressed anywhere: interpolated, with its slope, and as templates.
//!
//! The interpolation is quadratic: between nodes a tenth of the tip's diameter apart it leaves less than a
//! thousandth of the reading, below the noise of a hard touch. Templates need not lie so close.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::budget::{Cancelled, Watch, report};
use crate::elasticity::Touch;
use crate::elasticity::sensitivity::Sensitivity;
use crate::mesh::{SurfacePoint, TriMesh};
use crate::units;

/// Templates that are compared side by side.
pub(super) const LANES: usize = 64;

/// Readings per newton over a surface, quadratic on each triangle: known at its corners and the middles of
/// its sides. The corners are the templates that a reading is first compared with.
pub struct ResponseMap {
    /// The surface that it covers (m).
    pub mesh: Arc<TriMesh>,
    channels: usize,
    /// Nodes (vertices, then edges) × channels: strain a newton.
    values: Vec<f64>,
    /// Where the templates are (m), and the area that each stands for (m²).
    pub(super) places: Vec<DVec3>,
    pub(super) areas: Vec<f64>,
    /// Blocks of [`LANES`] templates: channel by channel, single precision, in microstrain a newton.
    pub(super) templates: Vec<f32>,
}

/// A reading per newton and how it changes over the surface.
pub struct Slope {
    /// Of each channel (strain a newton).
    pub reading: Vec<f64>,
    /// Change a metre along the two directions of the triangle's plane.
    pub change: Vec<DVec2>,
    /// These directions.
    pub plane: [DVec3; 2],
}

impl Slope {
    /// Of so many channels that read nothing.
    pub(super) fn zero(channels: usize) -> Self {
        Self {
            reading: vec![0.0; channels],
            change: vec![DVec2::ZERO; channels],
            plane: [DVec3::ZERO; 2],
        }
    }
}

impl ResponseMap {
    /// Presses one newton at every node of a mesh.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        sensitivity: &Sensitivity,
        mesh: Arc<TriMesh>,
        tip_radius: f64,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let read = |touch: &Touch| sensitivity.read(touch);
        let values = at_nodes(&mesh, tip_radius, &read, watch)?;
        Ok(Self::of(mesh, sensitivity.gauges(), values))
    }

    /// Pushes with one newton along x, y and z, whichever way the surface lies, at every node of a mesh.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn along_axes(
        sensitivity: &Sensitivity,
        mesh: &Arc<TriMesh>,
        tip_radius: f64,
        watch: Watch,
    ) -> Result<[Self; 3], Cancelled> {
        let read = |touch: &Touch| sensitivity.read_axes(touch);
        let values: Vec<DVec3> = at_nodes(mesh, tip_radius, &read, watch)?;
        Ok([0, 1, 2].map(|axis| {
            let along = values.iter().map(|v| v[axis]).collect();
            Self::of(Arc::clone(mesh), sensitivity.gauges(), along)
        }))
    }

    /// What presses straight in, from what pushes along the axes.
    #[must_use]
    pub fn pressing(axes: &[Self; 3]) -> Self {
        let [x, y, z] = axes;
        let values = x
            .normals()
            .into_iter()
            .enumerate()
            .flat_map(|(node, normal)| {
                let rows = x.node(node).iter().zip(y.node(node)).zip(z.node(node));
                rows.map(move |((x, y), z)| -normal.dot(DVec3::new(*x, *y, *z)))
            });
        Self::of(Arc::clone(&x.mesh), x.channels, values.collect())
    }

    /// From readings that are known at the vertices and the middles of the edges of a mesh (nodes ×
    /// channels, strain a newton).
    #[must_use]
    pub fn of(mesh: Arc<TriMesh>, channels: usize, values: Vec<f64>) -> Self {
        let templates = blocks(&values[..mesh.positions().len() * channels], channels);
        Self {
            places: mesh.positions().to_vec(),
            areas: vertex_areas(&mesh),
            channels,
            values,
            templates,
            mesh,
        }
    }

    /// Nodes (vertices, then edges) × channels: strain a newton.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// How many gauges it has.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// How far templates lie from each other (m).
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.mesh.mean_edge()
    }

    /// This map and others over the same mesh, with factors that each channel has for itself (first this
    /// map's, then the others').
    #[must_use]
    pub fn combined<const N: usize, const M: usize>(
        &self,
        others: &[Self; N],
        factors: &[[f64; M]],
    ) -> Self {
        debug_assert!(M == N + 1 && factors.len() == self.channels);
        let value = |(k, v): (usize, &f64)| {
            let factors = &factors[k % self.channels];
            let rest = others
                .iter()
                .zip(&factors[1..])
                .map(|(o, f)| f * o.values[k]);
            factors[0] * v + rest.sum::<f64>()
        };
        let values = self.values.iter().enumerate().map(value).collect();
        Self::of(Arc::clone(&self.mesh), self.channels, values)
    }

    /// Some of the channels, with factors, each channel of the new map a sum of channels of this one.
    #[must_use]
    pub fn mixed(&self, channels: &[Vec<(usize, f64)>]) -> Self {
        let nodes = self.values.len() / self.channels.max(1);
        let values = (0..nodes)
            .flat_map(|node| {
                let row = self.node(node);
                channels
                    .iter()
                    .map(|sum| sum.iter().map(|&(c, f)| f * row[c]).sum())
            })
            .collect();
        Self::of(Arc::clone(&self.mesh), channels.len(), values)
    }

    /// Share of the surface where a newton moves no channel by more than what it has to be moved by at `least` (strain);
    /// nothing for channels that are not looked at.
    #[must_use]
    pub fn unfelt(&self, least: &[Option<f64>]) -> f64 {
        let is_unfelt = |node: usize| {
            let mut channels = self.node(node).iter().zip(least);
            channels.all(|(reading, least)| least.is_none_or(|l| reading.abs() <= l))
        };
        let areas = self.areas.iter().enumerate();
        let unfelt: f64 = areas
            .filter(|(node, _)| is_unfelt(*node))
            .map(|(_, a)| a)
            .sum();
        unfelt / self.areas.iter().sum::<f64>()
    }

    /// Outward unit normals at all nodes.
    pub(super) fn normals(&self) -> Vec<DVec3> {
        node_normals(&self.mesh)
    }

    pub(super) fn node(&self, node: usize) -> &[f64] {
        &self.values[node * self.channels..][..self.channels]
    }

    /// The six nodes of a triangle: corners, then the middles of the sides that begin at them.
    fn nodes_of(&self, triangle: u32) -> [usize; 6] {
        let [a, b, c] = self.mesh.triangles()[triangle as usize].map(|v| v as usize);
        let first = self.mesh.positions().len();
        let [bc, ca, ab] =
            self.mesh.triangle_edges()[triangle as usize].map(|e| first + e as usize);
        [a, b, c, ab, bc, ca]
    }

    /// Readings per newton at a place.
    #[must_use]
    pub fn at(&self, at: SurfacePoint) -> Vec<f64> {
        let weights = shapes(at.barycentric);
        let mut reading = vec![0.0; self.channels];
        for (node, weight) in self.nodes_of(at.triangle).into_iter().zip(weights) {
            for (r, v) in reading.iter_mut().zip(self.node(node)) {
                *r += weight * v;
            }
        }
        reading
    }

    /// Readings per newton at a place, with their slopes in its triangle's plane.
    #[must_use]
    pub fn slope(&self, at: SurfacePoint) -> Slope {
        let (plane, gradients) = self.plane(at.triangle);
        let [a, b, c] = at.barycentric;
        let [ga, gb, gc] = gradients;
        let slopes = [
            ga * (4.0 * a - 1.0),
            gb * (4.0 * b - 1.0),
            gc * (4.0 * c - 1.0),
            (ga * b + gb * a) * 4.0,
            (gb * c + gc * b) * 4.0,
            (gc * a + ga * c) * 4.0,
        ];
        let weights = shapes(at.barycentric);
        let mut reading = vec![0.0; self.channels];
        let mut change = vec![DVec2::ZERO; self.channels];
        for (k, node) in self.nodes_of(at.triangle).into_iter().enumerate() {
            for ((r, d), v) in reading.iter_mut().zip(&mut change).zip(self.node(node)) {
                *r += weights[k] * v;
                *d += slopes[k] * *v;
            }
        }
        Slope {
            reading,
            change,
            plane,
        }
    }

    /// Two directions in a triangle's plane, and the gradients of the barycentric coordinates along them.
    fn plane(&self, triangle: u32) -> ([DVec3; 2], [DVec2; 3]) {
        let [a, b, c] = self.mesh.corners(triangle);
        let x = (b - a).normalize();
        let y = self.mesh.facet_normal(triangle).cross(x);
        let flat = |p: DVec3| DVec2::new((p - a).dot(x), (p - a).dot(y));
        let (b, c) = (flat(b), flat(c));
        let twice = b.perp_dot(c);
        let gb = DVec2::new(c.y, -c.x) / twice;
        let gc = DVec2::new(-b.y, b.x) / twice;
        ([x, y], [-(gb + gc), gb, gc])
    }
}

/// What is read of one newton that presses at every node of a mesh, node by node.
fn at_nodes<T: Send>(
    mesh: &TriMesh,
    tip_radius: f64,
    read: &(dyn Fn(&Touch) -> Vec<T> + Sync),
    watch: Watch,
) -> Result<Vec<T>, Cancelled> {
    /// Nodes between two reports.
    const PIECE: usize = 512;
    let all: Vec<(DVec3, DVec3)> = nodes(mesh).into_iter().zip(node_normals(mesh)).collect();
    let mut values = Vec::new();
    for (k, piece) in all.chunks(PIECE).enumerate() {
        report(watch, "Pressing everywhere", k * PIECE, all.len())?;
        values.par_extend(piece.par_iter().flat_map_iter(|&(position, normal)| {
            read(&Touch {
                position,
                normal,
                force: 1.0,
                tip_radius,
            })
        }));
    }
    Ok(values)
}

/// Quadratic shape functions: corners, then middles of the sides that begin at them.
fn shapes([a, b, c]: [f64; 3]) -> [f64; 6] {
    [
        a * (2.0 * a - 1.0),
        b * (2.0 * b - 1.0),
        c * (2.0 * c - 1.0),
        4.0 * a * b,
        4.0 * b * c,
        4.0 * c * a,
    ]
}

/// Vertices, then the middles of the edges.
pub(super) fn nodes(mesh: &TriMesh) -> Vec<DVec3> {
    let p = mesh.positions();
    let middles = mesh
        .edges()
        .iter()
        .map(|e| (p[e.a as usize] + p[e.b as usize]) / 2.0);
    p.iter().copied().chain(middles).collect()
}

fn node_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let n = mesh.vertex_normals();
    let middle = |e: &crate::mesh::Edge| {
        (n[e.a as usize] + n[e.b as usize])
            .try_normalize()
            .unwrap_or(n[e.a as usize])
    };
    n.iter()
        .copied()
        .chain(mesh.edges().iter().map(middle))
        .collect()
}

/// The areas around the vertices: each triangle is shared by its corners.
fn vertex_areas(mesh: &TriMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions().len()];
    for (t, corners) in (0..).zip(mesh.triangles()) {
        for &v in corners {
            areas[v as usize] += mesh.facet_area(t) / 3.0;
        }
    }
    areas
}

fn blocks(values: &[f64], channels: usize) -> Vec<f32> {
    let nodes = values.len() / channels.max(1);
    let mut templates = vec![0.0; nodes.div_ceil(LANES) * LANES * channels];
    for node in 0..nodes {
        let (block, lane) = (node / LANES, node % LANES);
        for c in 0..channels {
            let value = units::microstrain(values[node * channels + c]);
            templates[(block * channels + c) * LANES + lane] = value as f32;
        }
    }
    templates
}
