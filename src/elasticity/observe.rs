//! What is seen of a solution at given points of the surface: displacement and strain of one face.
//!
//! Both are linear in the freedoms, so a set of points is a sparse operator in two stages: the strain
//! at the corners (averaged over the facets that meet there, which takes out most of the element's own
//! error), then its interpolation at the points.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use super::element::Facet;
use super::solver::BLOCK;
use super::{Section, ShellModel};
use crate::mesh::{SurfacePoint, TriMesh};

/// A facet turned further than this from the mean normal at a corner is across a crease, where strains
/// are not continuous and must not be averaged (cos 30°).
const CREASE: f64 = 0.866;

/// Which face of the shell, as a height over the mid-surface in thicknesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Where the gauges are glued.
    Inside,
    Middle,
    Outside,
}

impl Face {
    /// Height over the mid-surface (m), along the outward normal.
    #[must_use]
    pub fn height(self, thickness: f64) -> f64 {
        match self {
            Self::Inside => -thickness / 2.0,
            Self::Middle => 0.0,
            Self::Outside => thickness / 2.0,
        }
    }
}

/// Rows of a sparse matrix, each a list of (column, weight).
#[derive(Default)]
struct Rows {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Rows {
    fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        self.entries.extend(row);
        self.starts.push(self.entries.len());
    }

    /// `into` (a row each of [`BLOCK`] values) = this matrix × `from` (rows of [`BLOCK`] values).
    fn apply(&self, from: &[f64], into: &mut [f64]) {
        for (out, range) in into.chunks_exact_mut(BLOCK).zip(self.starts.windows(2)) {
            out.fill(0.0);
            for &(column, weight) in &self.entries[range[0]..range[1]] {
                let row = &from[column as usize * BLOCK..][..BLOCK];
                for (o, x) in out.iter_mut().zip(row) {
                    *o += weight * x;
                }
            }
        }
    }

    fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }
}

/// The tangent frame of a site: columns are two directions in the surface and the outward normal.
pub type SiteFrame = DMat3;

/// Displacement and strain operators for a set of points on one face.
pub struct Observer {
    /// Strain (xx, yy, 2xy) at the corners in use, from the freedoms.
    corners: Rows,
    /// Strain at the points in their frames, from the corners' strains.
    strains: Rows,
    /// Displacement (x, y, z) of the face at the points, from the freedoms.
    displacements: Rows,
    frames: Vec<SiteFrame>,
}

/// The values of one block at all points: three rows a point, [`BLOCK`] columns.
pub struct Observed {
    /// Strain (xx, yy, 2xy) in each point's frame.
    pub strain: Vec<f64>,
    /// Displacement (x, y, z) (m).
    pub displacement: Vec<f64>,
}

impl Observer {
    #[must_use]
    pub fn new(model: &ShellModel, points: &[SurfacePoint], face: Face) -> Self {
        let z = face.height(model.section.thickness);
        let mut builder = CornerRows {
            mesh: model.mesh,
            section: model.section,
            z,
            rows: Rows::default(),
            known: BTreeMap::new(),
            frames: Vec::new(),
        };
        let mut strains = Rows::default();
        let mut displacements = Rows::default();
        let mut frames = Vec::with_capacity(points.len());
        for &at in points {
            let frame = tangent_frame(model.mesh.normal(at));
            let corners = builder.corners_of(at.triangle);
            for row in strain_rows(&builder.frames, corners, at, frame) {
                strains.push(row);
            }
            for row in displacement_rows(model.mesh, at, frame.z_axis * z) {
                displacements.push(row);
            }
            frames.push(frame);
        }
        Self {
            corners: builder.rows,
            strains,
            displacements,
            frames,
        }
    }

    /// The frames that strains are given in.
    #[must_use]
    pub fn frames(&self) -> &[SiteFrame] {
        &self.frames
    }

    /// Observes one block of solutions, as [`ShellModel::solve_touches`] hands it over.
    #[must_use]
    pub fn observe(&self, rows: &[f64]) -> Observed {
        Observed {
            strain: self.strain(rows),
            displacement: self.displacement(rows),
        }
    }

    /// Strains only.
    #[must_use]
    pub fn strain(&self, rows: &[f64]) -> Vec<f64> {
        let mut corners = vec![0.0; self.corners.count() * BLOCK];
        self.corners.apply(rows, &mut corners);
        let mut strain = vec![0.0; self.strains.count() * BLOCK];
        self.strains.apply(&corners, &mut strain);
        strain
    }

    /// Displacements only.
    #[must_use]
    pub fn displacement(&self, rows: &[f64]) -> Vec<f64> {
        let mut displacement = vec![0.0; self.displacements.count() * BLOCK];
        self.displacements.apply(rows, &mut displacement);
        displacement
    }

    /// Strain tensors (xx, yy, 2xy) at each point for a single solution (6 × vertices freedoms).
    #[must_use]
    pub fn strain_of(&self, displacement: &[f64]) -> Vec<[f64; 3]> {
        let rows = widen(displacement);
        let strain = self.strain(&rows);
        strain
            .chunks_exact(3 * BLOCK)
            .map(|s| [s[0], s[BLOCK], s[2 * BLOCK]])
            .collect()
    }

    /// Displacements (m) at each point for a single solution.
    #[must_use]
    pub fn displacement_of(&self, displacement: &[f64]) -> Vec<DVec3> {
        let rows = widen(displacement);
        let u = self.displacement(&rows);
        u.chunks_exact(3 * BLOCK)
            .map(|s| DVec3::new(s[0], s[BLOCK], s[2 * BLOCK]))
            .collect()
    }
}

fn widen(displacement: &[f64]) -> Vec<f64> {
    let mut rows = vec![0.0; displacement.len() * BLOCK];
    for (row, &u) in rows.chunks_exact_mut(BLOCK).zip(displacement) {
        row[0] = u;
    }
    rows
}

/// Two directions across a normal: the first as near to "around z" as there is one.
#[must_use]
pub fn tangent_frame(normal: DVec3) -> SiteFrame {
    let seed = if normal.z.abs() < 0.9 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    let first = seed.cross(normal).normalize();
    DMat3::from_cols(first, normal.cross(first), normal)
}

/// Turns strain components (xx, yy, 2xy) from one tangent frame into another, the planes laid onto each
/// other by the smallest rotation.
fn turn(from: SiteFrame, to: SiteFrame) -> [[f64; 3]; 3] {
    let lay = DQuat::from_rotation_arc(from.z_axis, to.z_axis);
    let x = lay * from.x_axis;
    let (c, s) = (x.dot(to.x_axis), x.dot(to.y_axis));
    [
        [c * c, s * s, -c * s],
        [s * s, c * c, c * s],
        [2.0 * c * s, -2.0 * c * s, c * c - s * s],
    ]
}

/// Builds the corner stage: one entry for each vertex in use, or for a facet's own corner at a crease.
struct CornerRows<'m> {
    mesh: &'m TriMesh,
    section: Section,
    z: f64,
    rows: Rows,
    known: BTreeMap<(u32, Option<u32>), u32>,
    frames: Vec<SiteFrame>,
}

impl CornerRows<'_> {
    fn corners_of(&mut self, triangle: u32) -> [u32; 3] {
        let tri = self.mesh.triangles()[triangle as usize];
        std::array::from_fn(|corner| self.corner(triangle, tri[corner]))
    }

    fn corner(&mut self, triangle: u32, vertex: u32) -> u32 {
        let normal = self.mesh.vertex_normals()[vertex as usize];
        let around = &self.mesh.vertex_triangles()[vertex as usize];
        let smooth = around
            .iter()
            .all(|&t| self.mesh.facet_normal(t).dot(normal) > CREASE);
        let key = (vertex, (!smooth).then_some(triangle));
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let (frame, facets) = if smooth {
            (tangent_frame(normal), around.clone())
        } else {
            (
                tangent_frame(self.mesh.facet_normal(triangle)),
                vec![triangle],
            )
        };
        self.push_average(vertex, frame, &facets);
        self.frames.push(frame);
        let number = (self.frames.len() - 1) as u32;
        self.known.insert(key, number);
        number
    }

    /// The mean over facets, weighted by area, of their strains at the vertex.
    fn push_average(&mut self, vertex: u32, frame: SiteFrame, facets: &[u32]) {
        let total: f64 = facets.iter().map(|&t| self.mesh.facet_area(t)).sum();
        let mut rows: [BTreeMap<u32, f64>; 3] = Default::default();
        for &t in facets {
            let tri = self.mesh.triangles()[t as usize];
            let zeta = std::array::from_fn(|i| if tri[i] == vertex { 1.0 } else { 0.0 });
            let facet = Facet::new(self.mesh.corners(t), &self.section);
            let strain = facet.strain(zeta, self.z);
            let turned = turn(facet.frame, frame);
            let share = self.mesh.facet_area(t) / total;
            for (row, weights) in rows.iter_mut().zip(turned) {
                for i in 0..18 {
                    let value: f64 = (0..3).map(|k| weights[k] * strain[(k, i)]).sum();
                    *row.entry(6 * tri[i / 6] + (i % 6) as u32).or_default() += share * value;
                }
            }
        }
        for row in rows {
            self.rows.push(row);
        }
    }
}

fn strain_rows(
    frames: &[SiteFrame],
    corners: [u32; 3],
    at: SurfacePoint,
    frame: SiteFrame,
) -> [Vec<(u32, f64)>; 3] {
    let mut rows: [Vec<(u32, f64)>; 3] = Default::default();
    for (corner, zeta) in corners.into_iter().zip(at.barycentric) {
        let turned = turn(frames[corner as usize], frame);
        for (row, weights) in rows.iter_mut().zip(turned) {
            row.extend((0..3).map(|k| (3 * corner + k as u32, zeta * weights[k])));
        }
    }
    rows
}

/// u + θ × r at the point, with r from the mid-surface to the face.
fn displacement_rows(mesh: &TriMesh, at: SurfacePoint, r: DVec3) -> [Vec<(u32, f64)>; 3] {
    let mut rows: [Vec<(u32, f64)>; 3] = Default::default();
    let tri = mesh.triangles()[at.triangle as usize];
    for (vertex, zeta) in tri.into_iter().zip(at.barycentric) {
        for (axis, row) in rows.iter_mut().enumerate() {
            row.push((6 * vertex + axis as u32, zeta));
            for k in 0..3 {
                // (e_k × r) along this axis.
                let arm = DVec3::AXES[k].cross(r)[axis];
                if arm != 0.0 {
                    row.push((6 * vertex + 3 + k as u32, zeta * arm));
                }
            }
        }
    }
    rows
}
