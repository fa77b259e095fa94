//! What is seen of a solution at given points of the surface: displacement and strain of one face.
//!
//! Both are linear in the degrees of freedom, so a set of points is a sparse operator in two stages: the strain
//! at the corners (averaged over the facets that meet there, which takes out most of the element's own
//! error), then its interpolation at the points.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use super::element::Facet;
use super::material::ShellSection;
use super::rows::SparseRows;
use super::solver::BLOCK;
use super::system::System;
use crate::mesh::{SurfacePoint, TriMesh};

/// A facet turned further than this from the mean normal at a corner is across a crease, where strains
/// are not continuous and must not be averaged (cos 30°).
const CREASE: f64 = 0.866;
/// What is added to a least-squares matrix, over its trace, so that it has an inverse.
const TINY: f64 = 1e-12;

/// Which face of the shell, as a height over the mid-surface in thicknesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Where the gauges are glued.
    Inside,
    /// The mid-surface.
    Middle,
    /// Where touches land.
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

/// The tangent frame of a site: columns are two directions in the surface and the outward normal.
pub type SiteFrame = DMat3;

/// Displacement and strain operators for a set of points on one face.
pub struct Observer {
    /// Strain (xx, yy, 2xy) at the corners in use, from the degrees of freedom.
    corners: SparseRows,
    /// Strain at the points in their frames, from the corners' strains.
    strains: SparseRows,
    /// Displacement (x, y, z) of the face at the points, from the degrees of freedom.
    displacements: SparseRows,
    /// The same of the coarser model that displacements are carried on from.
    coarser: Option<SparseRows>,
    frames: Vec<SiteFrame>,
}

impl Observer {
    /// On one face of a shell.
    pub(super) fn of_shell(
        mesh: &TriMesh,
        section: &ShellSection,
        system: &System,
        points: &[SurfacePoint],
        face: Face,
    ) -> Self {
        let z = face.height(section.thickness);
        let mut builder = CornerRows {
            mesh,
            section,
            system,
            z,
            rows: SparseRows::default(),
            known: BTreeMap::new(),
            frames: Vec::new(),
        };
        let mut strains = SparseRows::default();
        let mut displacements = SparseRows::default();
        let mut frames = Vec::with_capacity(points.len());
        for &at in points {
            let frame = tangent_frame(mesh.normal(at));
            let corners = builder.corners_of(at.triangle);
            for row in strain_rows(&builder.frames, corners, at, frame) {
                strains.push(row);
            }
            for row in displacement_rows(mesh, at, frame.z_axis * z) {
                displacements.push(placed(system, row));
            }
            frames.push(frame);
        }
        Self {
            corners: builder.rows,
            strains,
            displacements,
            coarser: None,
            frames,
        }
    }

    /// From strain rows (xx, yy, 2xy a point) and displacement rows (x, y, z) on solved blocks.
    pub(super) fn direct(
        strains: SparseRows,
        displacements: SparseRows,
        frames: Vec<SiteFrame>,
    ) -> Self {
        let mut same = SparseRows::default();
        for row in 0..strains.count() as u32 {
            same.push([(row, 1.0)]);
        }
        Self {
            corners: strains,
            strains: same,
            displacements,
            coarser: None,
            frames,
        }
    }

    /// The same, with the displacement rows of the coarser model that displacements are carried on from.
    pub(super) fn with_coarser(self, coarser: Option<SparseRows>) -> Self {
        Self { coarser, ..self }
    }

    /// The frames that strains are given in.
    #[must_use]
    pub fn frames(&self) -> &[SiteFrame] {
        &self.frames
    }

    /// The strain rows as one matrix on solved blocks, three (xx, yy, 2xy) a point.
    pub(super) fn strain_rows(&self) -> SparseRows {
        self.strains.times(&self.corners)
    }

    /// The displacement rows on solved blocks, three (x, y, z) a point.
    pub(super) fn displacement_rows(&self) -> &SparseRows {
        &self.displacements
    }

    /// As [`Self::displacement_rows`] of the coarser model, on blocks that it solved.
    pub(super) fn coarser_rows(&self) -> Option<&SparseRows> {
        self.coarser.as_ref()
    }

    /// Strains of a solved block: three rows (xx, yy, 2xy) of [`BLOCK`] values a point.
    pub(super) fn strain(&self, solved: &[f64]) -> Vec<f64> {
        let mut buffer = Vec::new();
        self.strain_into(solved, &mut buffer).to_vec()
    }

    /// As [`Self::strain`], in a buffer that is used again and again.
    pub(super) fn strain_into<'b>(
        &self,
        solved: &[f64],
        buffer: &'b mut Vec<f64>,
    ) -> &'b mut [f64] {
        let corners = self.corners.count() * BLOCK;
        let all = corners + self.strains.count() * BLOCK;
        if buffer.len() < all {
            buffer.resize(all, 0.0);
        }
        let (corners, strain) = buffer[..all].split_at_mut(corners);
        self.corners.apply(solved, corners);
        self.strains.apply(corners, strain);
        strain
    }

    /// Displacements of a solved block: three rows of [`BLOCK`] values a point.
    pub(super) fn displacement(&self, solved: &[f64]) -> Vec<f64> {
        let mut buffer = Vec::new();
        self.displacement_into(solved, &mut buffer).to_vec()
    }

    /// As [`Self::displacement`], in a buffer that is used again and again.
    pub(super) fn displacement_into<'b>(
        &self,
        solved: &[f64],
        buffer: &'b mut Vec<f64>,
    ) -> &'b mut [f64] {
        let rows = self.displacements.count() * BLOCK;
        if buffer.len() < rows {
            buffer.resize(rows, 0.0);
        }
        let displacement = &mut buffer[..rows];
        self.displacements.apply(solved, displacement);
        displacement
    }
}

/// What strain components (xx, yy, 2xy) weigh in the strain along an angle of their frame.
#[must_use]
pub fn along(angle: f64) -> [f64; 3] {
    let (s, c) = angle.sin_cos();
    [c * c, s * s, c * s]
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
pub(super) fn turn(from: SiteFrame, to: SiteFrame) -> [[f64; 3]; 3] {
    let lay = DQuat::from_rotation_arc(from.z_axis, to.z_axis);
    let x = lay * from.x_axis;
    let (c, s) = (x.dot(to.x_axis), x.dot(to.y_axis));
    [
        [c * c, s * s, -c * s],
        [s * s, c * c, c * s],
        [2.0 * c * s, -2.0 * c * s, c * c - s * s],
    ]
}

/// Curvatures (11, 22, 12) of the surface at a vertex along its frame (1/m, positive where the outside is
/// convex): the change of the normal along the edges, in the least-squares sense.
fn curvature(mesh: &TriMesh, vertex: u32, facets: &[u32], frame: SiteFrame) -> [f64; 3] {
    let (here, normals) = (mesh.positions()[vertex as usize], mesh.vertex_normals());
    // Across a crease the mean normal belongs to neither side.
    if normals[vertex as usize].dot(frame.z_axis) < 0.98 {
        return [0.0; 3];
    }
    let mut gram = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for &t in facets {
        for v in mesh.triangles()[t as usize]
            .into_iter()
            .filter(|&v| v != vertex)
        {
            let (d, n) = (mesh.positions()[v as usize] - here, normals[v as usize]);
            if n.dot(frame.z_axis) < CREASE {
                continue;
            }
            let (x, y) = (d.dot(frame.x_axis), d.dot(frame.y_axis));
            let change = n - normals[vertex as usize];
            for (row, value) in [
                (nalgebra::Vector3::new(x, 0.0, y), change.dot(frame.x_axis)),
                (nalgebra::Vector3::new(0.0, y, x), change.dot(frame.y_axis)),
            ] {
                gram += row * row.transpose();
                right += row * value;
            }
        }
    }
    let least = TINY * gram.trace();
    (gram + nalgebra::Matrix3::from_diagonal_element(least.max(f64::MIN_POSITIVE)))
        .cholesky()
        .map_or([0.0; 3], |c| c.solve(&right).into())
}

/// How strains (xx, yy, 2xy) of the flat formula read at height z of a curved wall, where a fibre is 1 + z/R
/// times as long as on the mid-surface: ε = S ε S with S = (I + z B)^-½ (Flügge's exact metric; without it
/// the inside of a shell of t/R = 0.1 reads 5 % too little).
fn thickened([b11, b22, b12]: [f64; 3], z: f64) -> [[f64; 3]; 3] {
    /// A wall is never taken for curved more sharply than this share of its thickness allows.
    const SHORTEST: f64 = 0.5;
    let metric = nalgebra::Matrix2::new(1.0 + z * b11, z * b12, z * b12, 1.0 + z * b22);
    let eigen = metric.symmetric_eigen();
    let root = eigen
        .eigenvalues
        .map(|l| l.clamp(SHORTEST, 1.0 / SHORTEST).sqrt().recip());
    let q = eigen.eigenvectors;
    let s = q * nalgebra::Matrix2::from_diagonal(&root) * q.transpose();
    let (a, b, c) = (s[(0, 0)], s[(1, 1)], s[(0, 1)]);
    [
        [a * a, c * c, a * c],
        [c * c, b * b, b * c],
        [2.0 * a * c, 2.0 * b * c, a * b + c * c],
    ]
}

fn times(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Builds the corner stage: one entry for each vertex in use, or for a facet's own corner at a crease.
struct CornerRows<'m> {
    mesh: &'m TriMesh,
    section: &'m ShellSection,
    system: &'m System,
    z: f64,
    rows: SparseRows,
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
        let mesh = self.mesh;
        let total: f64 = facets.iter().map(|&t| self.mesh.facet_area(t)).sum();
        let curved = thickened(curvature(mesh, vertex, facets, frame), self.z);
        let mut rows: [BTreeMap<u32, f64>; 3] = Default::default();
        for &t in facets {
            let tri = self.mesh.triangles()[t as usize];
            let zeta = std::array::from_fn(|i| if tri[i] == vertex { 1.0 } else { 0.0 });
            let facet = Facet::new(self.mesh.corners(t), self.section);
            let strain = facet.strain(zeta, self.z);
            let turned = times(curved, turn(facet.frame, frame));
            let share = self.mesh.facet_area(t) / total;
            for (row, weights) in rows.iter_mut().zip(turned) {
                for i in 0..18 {
                    let value: f64 = (0..3).map(|k| weights[k] * strain[(k, i)]).sum();
                    *row.entry(6 * tri[i / 6] + (i % 6) as u32).or_default() += share * value;
                }
            }
        }
        for row in rows {
            self.rows.push(placed(self.system, row));
        }
    }
}

/// A row over degrees of freedom as a row over solved blocks: held degrees of freedom are zero.
fn placed(
    system: &System,
    row: impl IntoIterator<Item = (u32, f64)>,
) -> impl Iterator<Item = (u32, f64)> {
    row.into_iter().filter_map(|(dof, weight)| {
        let (place, scale) = system.place(dof as usize)?;
        Some((place, weight * scale))
    })
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
