//! Quadratic tetrahedra of a mesh that the user has.

use std::sync::Arc;

use faer::Mat;
use glam::DVec3;

use super::{Elements, Shape};
use crate::elasticity::Material;
use crate::mesh::SurfacePoint;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::volume::{FacePlace, VolumeMesh, jacobian, shapes};

/// Elements on the user's nodes.
pub struct Tetrahedra {
    mesh: Arc<VolumeMesh>,
    /// Finds the triangle of the surface that a point lies on.
    index: SurfaceIndex,
    /// For each of those its element and the places of its corners in it.
    places: Vec<FacePlace>,
}

/// Points and weights exact for degree 5 over the unit tetrahedron (P. Keast 1986, fifteen points): what curved
/// sides need; straight ones need less.
fn rule() -> Vec<(DVec3, f64)> {
    let a = [
        (0.25, 0.030_283_678_097_089_183),
        (1.0 / 3.0, 0.006_026_785_714_285_717),
        (1.0 / 11.0, 0.011_645_249_086_028_967),
    ];
    let (b, w) = (0.066_550_153_573_664_28, 0.010_949_141_561_386_45);
    let mut points = vec![(DVec3::splat(a[0].0), a[0].1)];
    for &(x, weight) in &a[1..] {
        let y = 1.0 - 3.0 * x;
        for p in [[x, x, x], [y, x, x], [x, y, x], [x, x, y]] {
            points.push((DVec3::from_array(p), weight));
        }
    }
    let c = 0.5 - b;
    for p in [
        [c, b, b],
        [b, c, b],
        [b, b, c],
        [c, c, b],
        [c, b, c],
        [b, c, c],
    ] {
        points.push((DVec3::from_array(p), w));
    }
    points
}

impl Tetrahedra {
    #[must_use]
    pub fn new(mesh: &Arc<VolumeMesh>) -> Self {
        let (triangles, places) = mesh.surface_places();
        Self {
            index: SurfaceIndex::of(mesh.nodes.clone(), &triangles),
            mesh: Arc::clone(mesh),
            places,
        }
    }

    fn corners(&self, element: usize) -> [DVec3; 10] {
        self.mesh.tetrahedra[element].map(|n| self.mesh.nodes[n as usize])
    }
}

impl Elements for Tetrahedra {
    fn nodes(&self) -> &[DVec3] {
        &self.mesh.nodes
    }

    fn count(&self) -> usize {
        self.mesh.tetrahedra.len()
    }

    fn nodes_of(&self, element: usize) -> &[u32] {
        &self.mesh.tetrahedra[element]
    }

    fn grain(&self) -> f64 {
        self.mesh.mean_edge() / 2.0
    }

    fn centre(&self, element: usize) -> DVec3 {
        self.corners(element)[..4].iter().sum::<DVec3>() / 4.0
    }

    fn stiffness(&self, element: usize, material: &Material) -> Mat<f64> {
        let (lambda, mu) = material.lame();
        let nodes = self.corners(element);
        let mut k = Mat::zeros(30, 30);
        for (at, weight) in rule() {
            let jacobian = jacobian(&nodes, at);
            let inverse = jacobian.inverse().transpose();
            let gradients = shapes(at).map(|(_, g)| inverse * g);
            let weight = weight * jacobian.determinant();
            for (b, h) in gradients.iter().enumerate() {
                for (a, g) in gradients.iter().enumerate() {
                    let dot = g.dot(*h);
                    for j in 0..3 {
                        for i in 0..3 {
                            let own = if i == j { mu * dot } else { 0.0 };
                            k[(3 * a + i, 3 * b + j)] +=
                                weight * (lambda * g[i] * h[j] + mu * g[j] * h[i] + own);
                        }
                    }
                }
            }
        }
        k
    }

    fn shape(&self, _: SurfacePoint, point: DVec3, _: DVec3) -> Shape {
        let (at, _) = self.index.nearest(point);
        let (element, corners) = &self.places[at.triangle as usize];
        let place: DVec3 = (0..3).map(|i| corners[i] * at.barycentric[i]).sum();
        let nodes = self.corners(*element as usize);
        let inverse = jacobian(&nodes, place).inverse().transpose();
        Shape {
            element: *element,
            nodes: self.mesh.tetrahedra[*element as usize].to_vec(),
            values: shapes(place).map(|(n, g)| (n, inverse * g)).to_vec(),
        }
    }

    fn elimination(&self) -> Option<Vec<u32>> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_is_exact_for_degree_five() {
        for i in 0..=5 {
            for j in 0..=5 - i {
                for k in 0..=5 - i - j {
                    let f = |p: DVec3| p.x.powi(i) * p.y.powi(j) * p.z.powi(k);
                    let sum: f64 = rule().iter().map(|(p, w)| w * f(*p)).sum();
                    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
                    let exact =
                        factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
                    assert!((sum - exact).abs() < 1e-15, "{i} {j} {k}: {sum} {exact}");
                }
            }
        }
    }
}
