//! The surface that elements are laid on: a part's triangles, its feature lines and its smooth normals.
//!
//! Feature lines are what a new mesh must keep: free rims, creases, joints of more than two walls, and
//! lines the caller marks (where a support begins). Between them the surface is smooth: a point on a
//! facet is placed on the cubic patch through its corners (Vlachos et al., "Curved PN triangles", I3D
//! 2001), so that finer elements find the curvature and not the facets of the file.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::Polyline;

use super::{Edge, SurfacePoint, TriMesh};

/// Facets that meet at a sharper angle than this are joined by a crease (cos 30°).
const CREASE: f64 = 0.866;
/// A feature line that turns more sharply than this has a corner there (cos 35°).
const TURN: f64 = 0.82;
/// The patch may leave its facet by no more than this share of the facet's height: long facets of a file
/// beside a fillet are flat, whatever their corners' normals say.
const BULGE: f64 = 0.1;

/// How a point of the surface may move along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mobility {
    /// In any direction.
    Free,
    /// Along its feature line.
    Line,
    /// Not at all.
    Fixed,
}

/// A part seen as a smooth surface with feature lines.
pub struct Surface {
    /// The part (m).
    pub mesh: Arc<TriMesh>,
    /// For each edge of the part whether it is on a feature line.
    pub features: Vec<bool>,
    /// For each vertex of the part.
    pub mobility: Vec<Mobility>,
    lines: Option<FeatureLines>,
    /// Normals at the corners of each facet, not averaged across creases.
    normals: Vec<[DVec3; 3]>,
}

struct FeatureLines {
    tree: Polyline,
    /// Edge of the part that each segment is.
    edges: Vec<u32>,
    centre: DVec3,
    size: f64,
}

impl Surface {
    /// `line` names the edges of the part that are feature lines beside rims and creases, `spot` the
    /// vertices that must stay where they are.
    #[must_use]
    pub fn new(
        mesh: &Arc<TriMesh>,
        line: impl Fn(&Edge) -> bool,
        spot: impl Fn(u32) -> bool,
    ) -> Self {
        let facet_normals: Vec<DVec3> = (0..mesh.triangles().len() as u32)
            .map(|t| mesh.facet_normal(t))
            .collect();
        // The normal of a facet without height says nothing; remeshing takes such facets out.
        let flat = |t: u32| mesh.thinness(t) < 1e-6;
        let features: Vec<bool> = mesh
            .edges()
            .iter()
            .map(|edge| {
                let smooth = match edge.triangles[..] {
                    [s, t] => {
                        flat(s)
                            || flat(t)
                            || facet_normals[s as usize].dot(facet_normals[t as usize]) > CREASE
                    }
                    _ => false,
                };
                !smooth || line(edge)
            })
            .collect();
        Self {
            mobility: mobility(mesh, &features, spot),
            lines: FeatureLines::new(mesh, &features),
            normals: corner_normals(mesh, &facet_normals),
            features,
            mesh: Arc::clone(mesh),
        }
    }

    /// Where a point of a facet lies on the smooth surface (m).
    #[must_use]
    pub fn place(&self, at: SurfacePoint) -> DVec3 {
        let flat = self.mesh.point(at);
        let corners = self.mesh.corners(at.triangle);
        let normals = self.normals[at.triangle as usize];
        let bulge = bulge(corners, normals, at.barycentric);
        let longest = (0..3)
            .map(|i| corners[i].distance(corners[(i + 1) % 3]))
            .fold(0.0, f64::max);
        let height = 2.0 * self.mesh.facet_area(at.triangle) / longest;
        let size = bulge.length();
        if size > BULGE * height {
            return flat;
        }
        flat + bulge
    }

    /// The smooth unit normal at a point of a facet.
    #[must_use]
    pub fn normal(&self, at: SurfacePoint) -> DVec3 {
        let normals = self.normals[at.triangle as usize];
        let blend: DVec3 = (0..3).map(|i| normals[i] * at.barycentric[i]).sum();
        blend
            .try_normalize()
            .unwrap_or_else(|| self.mesh.facet_normal(at.triangle))
    }

    /// The point of the surface nearest to `p`.
    #[must_use]
    pub fn project(&self, p: DVec3) -> SurfacePoint {
        self.mesh.index().nearest(p).0
    }

    /// The point of the feature lines nearest to `p`, as a point of a facet beside the line.
    #[must_use]
    pub fn project_to_line(&self, p: DVec3) -> Option<SurfacePoint> {
        let lines = self.lines.as_ref()?;
        let (_, (segment, location)) = lines
            .tree
            .project_local_point_and_get_location((p - lines.centre) / lines.size, false);
        let edge = &self.mesh.edges()[lines.edges[segment as usize] as usize];
        let weights = location.barycentric_coordinates();
        let triangle = *edge.triangles.first()?;
        let tri = self.mesh.triangles()[triangle as usize];
        let barycentric = tri.map(|v| match v {
            v if v == edge.a => weights[0],
            v if v == edge.b => weights[1],
            _ => 0.0,
        });
        Some(SurfacePoint {
            triangle,
            barycentric,
        })
    }

    /// The point of the surface that a vertex of the part is.
    #[must_use]
    pub fn vertex(&self, vertex: u32) -> Option<SurfacePoint> {
        let &triangle = self.mesh.vertex_triangles()[vertex as usize].first()?;
        let tri = self.mesh.triangles()[triangle as usize];
        Some(SurfacePoint {
            triangle,
            barycentric: tri.map(|v| if v == vertex { 1.0 } else { 0.0 }),
        })
    }
}

impl FeatureLines {
    fn new(mesh: &TriMesh, features: &[bool]) -> Option<Self> {
        let edges: Vec<u32> = (0..features.len() as u32)
            .filter(|&e| features[e as usize])
            .collect();
        if edges.is_empty() {
            return None;
        }
        let (lower, upper) = mesh.bounds();
        let (centre, size) = ((lower + upper) / 2.0, (upper - lower).max_element());
        let mut points = Vec::with_capacity(2 * edges.len());
        let mut segments = Vec::with_capacity(edges.len());
        for &e in &edges {
            let edge = &mesh.edges()[e as usize];
            segments.push([points.len() as u32, points.len() as u32 + 1]);
            for v in [edge.a, edge.b] {
                points.push((mesh.positions()[v as usize] - centre) / size);
            }
        }
        Some(Self {
            tree: Polyline::new(points, Some(segments)),
            edges,
            centre,
            size,
        })
    }
}

fn mobility(mesh: &TriMesh, features: &[bool], spot: impl Fn(u32) -> bool) -> Vec<Mobility> {
    let mut ends: Vec<Vec<u32>> = vec![Vec::new(); mesh.positions().len()];
    for (edge, _) in mesh.edges().iter().zip(features).filter(|(_, f)| **f) {
        ends[edge.a as usize].push(edge.b);
        ends[edge.b as usize].push(edge.a);
    }
    ends.iter()
        .enumerate()
        .map(|(v, ends)| match ends[..] {
            _ if spot(v as u32) => Mobility::Fixed,
            [] => Mobility::Free,
            [a, b] => {
                let [p, a, b] = [v, a as usize, b as usize].map(|v| mesh.positions()[v]);
                let straight = (p - a).normalize_or_zero().dot((b - p).normalize_or_zero());
                if straight > TURN {
                    Mobility::Line
                } else {
                    Mobility::Fixed
                }
            }
            _ => Mobility::Fixed,
        })
        .collect()
}

/// Averaged by area, so that a large flat facet beside a narrow one keeps its direction, over the facets
/// round the corner that are not across a crease from this one.
fn corner_normals(mesh: &TriMesh, facet_normals: &[DVec3]) -> Vec<[DVec3; 3]> {
    mesh.triangles()
        .iter()
        .enumerate()
        .map(|(t, tri)| {
            tri.map(|v| {
                let own = facet_normals[t];
                let sum: DVec3 = mesh.vertex_triangles()[v as usize]
                    .iter()
                    .filter(|&&s| facet_normals[s as usize].dot(own) > CREASE)
                    .map(|&s| facet_normals[s as usize] * mesh.facet_area(s))
                    .sum();
                sum.try_normalize().unwrap_or(own)
            })
        })
        .collect()
}

/// How far the PN patch is from the flat facet at barycentric coordinates `w`.
fn bulge(p: [DVec3; 3], n: [DVec3; 3], w: [f64; 3]) -> DVec3 {
    // Control points beside corner i on the side towards j, relative to the flat facet.
    let side = |i: usize, j: usize| -(p[j] - p[i]).dot(n[i]) / 3.0 * n[i];
    let mut edges = DVec3::ZERO;
    let mut sum = DVec3::ZERO;
    for i in 0..3 {
        for j in (0..3).filter(|&j| j != i) {
            let b = side(i, j);
            edges += 3.0 * w[i] * w[i] * w[j] * b;
            sum += b;
        }
    }
    // Vlachos' centre point: E + (E - V)/2 with E the mean of the six, V the corners' mean.
    edges + 6.0 * w[0] * w[1] * w[2] * (sum / 6.0 * 1.5)
}
