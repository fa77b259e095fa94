//! A touch: a force pressed onto the surface by a tip that spreads it smoothly.

use glam::DVec3;

use crate::mesh::locate::SurfaceIndex;
use crate::mesh::{SurfacePoint, TriMesh};

/// One applied force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Where the tip's axis meets the surface (m).
    pub position: DVec3,
    /// Outward unit normal: the force pushes along its opposite.
    pub normal: DVec3,
    /// Magnitude (N).
    pub force: f64,
    /// Radius over which the tip spreads the force, q ∝ (1 - r²/a²)² (m).
    pub tip_radius: f64,
}

/// Forces on the nodes: vertex and force (N); they sum to the touch's force to rounding.
pub type NodalForces = Vec<(u32, DVec3)>;

/// A facet within reach of the tip is integrated with at least this many pieces along the tip's radius.
const PIECES_PER_RADIUS: f64 = 4.0;
/// Facets turned further than this away from the touched one belong to another wall (cos 75°).
const SAME_WALL: f64 = 0.26;

/// The nodal forces of a touch, by quadrature of the tip's pressure with the linear shape functions.
#[must_use]
pub fn nodal_forces(mesh: &TriMesh, index: &SurfaceIndex, touch: &Touch) -> NodalForces {
    let (at, _) = index.nearest(touch.position);
    let centre = mesh.point(at);
    let mut weights: Vec<(u32, f64)> = Vec::new();
    for t in index.triangles_near(centre, touch.tip_radius) {
        if mesh.facet_normal(t).dot(touch.normal) > SAME_WALL {
            integrate(mesh, t, centre, touch, &mut weights);
        }
    }
    let total: f64 = weights.iter().map(|w| w.1).sum();
    // A tip smaller than the quadrature can see is a point force.
    let weights = if total > 0.0 {
        merge(weights, total)
    } else {
        concentrated(mesh, at)
    };
    let force = -touch.normal * touch.force;
    weights.into_iter().map(|(v, w)| (v, force * w)).collect()
}

fn concentrated(mesh: &TriMesh, at: SurfacePoint) -> Vec<(u32, f64)> {
    mesh.triangles()[at.triangle as usize]
        .into_iter()
        .zip(at.barycentric)
        .collect()
}

/// Adds the pressure on one facet, split into equal pieces with the three-point rule on each.
fn integrate(mesh: &TriMesh, t: u32, centre: DVec3, touch: &Touch, into: &mut Vec<(u32, f64)>) {
    let corners = mesh.corners(t);
    let longest = (0..3)
        .map(|i| corners[i].distance(corners[(i + 1) % 3]))
        .fold(0.0, f64::max);
    let n = (PIECES_PER_RADIUS * longest / touch.tip_radius)
        .ceil()
        .clamp(1.0, 64.0) as usize;
    let mut sums = [0.0; 3];
    for piece in pieces(n) {
        for k in 0..3 {
            let mut zeta = [0.0; 3];
            for i in 0..3 {
                zeta[i] = f64::midpoint(piece[k][i], piece[(k + 1) % 3][i]);
            }
            let p: DVec3 = (0..3).map(|i| corners[i] * zeta[i]).sum();
            let r2 = p.distance_squared(centre) / touch.tip_radius.powi(2);
            if r2 < 1.0 {
                let q = (1.0 - r2).powi(2);
                for i in 0..3 {
                    sums[i] += q * zeta[i];
                }
            }
        }
    }
    let piece_area = mesh.facet_area(t) / (n * n) as f64 / 3.0;
    let tri = mesh.triangles()[t as usize];
    for i in 0..3 {
        if sums[i] > 0.0 {
            into.push((tri[i], sums[i] * piece_area));
        }
    }
}

/// The n² equal triangles of a split facet, by the barycentric coordinates of their corners.
fn pieces(n: usize) -> impl Iterator<Item = [[f64; 3]; 3]> {
    let at = move |i: usize, j: usize| {
        let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
        [1.0 - u - v, u, v]
    };
    (0..n).flat_map(move |i| {
        (0..n - i).flat_map(move |j| {
            let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let down = [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            std::iter::once(up).chain((i + j + 1 < n).then_some(down))
        })
    })
}

fn merge(mut weights: Vec<(u32, f64)>, total: f64) -> Vec<(u32, f64)> {
    weights.sort_by_key(|w| w.0);
    let mut merged: Vec<(u32, f64)> = Vec::new();
    for (v, w) in weights {
        match merged.last_mut() {
            Some(last) if last.0 == v => last.1 += w / total,
            _ => merged.push((v, w / total)),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;

    #[test]
    fn a_touch_keeps_its_force_and_its_place() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let index = SurfaceIndex::new(&mesh);
        let position = mesh.corners(700).iter().sum::<DVec3>() / 3.0;
        let normal = position.with_z(0.0).normalize();
        for tip_radius in [1e-6, 1e-3, 5e-3, 0.5] {
            let touch = Touch {
                position,
                normal,
                force: 10.0,
                tip_radius,
            };
            let forces = nodal_forces(&mesh, &index, &touch);
            let sum: DVec3 = forces.iter().map(|f| f.1).sum();
            assert!(sum.distance(-normal * 10.0) < 1e-12);
            if tip_radius < 2e-3 {
                let middle: DVec3 = forces
                    .iter()
                    .map(|&(v, f)| mesh.positions()[v as usize] * f.length() / 10.0)
                    .sum();
                assert!(middle.distance(position) < 3e-4, "{tip_radius}");
            }
        }
    }
}
