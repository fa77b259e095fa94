//! Where a mesh is too coarse: the strain of each facet against the smoothed field.
//!
//! O. C. Zienkiewicz and J. Z. Zhu, "A simple error estimator and adaptive procedure for practical
//! engineering analysis", Int. J. Numer. Methods Eng. 24 (1987). It decides where elements go; how large
//! the error is, is measured (see [`super::estimate`]).

use glam::DVec3;
use rayon::prelude::*;

use super::ShellModel;
use super::element::Facet;

/// Facets turned further than this from each other share no strain (cos 30°).
const CREASE: f64 = 0.866;
/// A strain tensor in space: xx, yy, zz, yz, zx, xy.
type Tensor = [f32; 6];
/// Strains of a facet under one load: three corners, inside and outside.
type FacetStrain = [[Tensor; 2]; 3];

/// For each facet the mean over the loads of the squared distance between its strain and the smoothed
/// one, over the whole strain of the load: an error density times area.
#[must_use]
pub fn facet_errors(model: &ShellModel, solutions: &[Vec<f64>]) -> Vec<f64> {
    let mesh = &model.mesh;
    let strains: Vec<Vec<FacetStrain>> = (0..mesh.triangles().len() as u32)
        .into_par_iter()
        .map(|t| facet_strains(model, t, solutions))
        .collect();
    let totals: Vec<f64> = (0..solutions.len())
        .map(|load| {
            (0..strains.len())
                .map(|t| mesh.facet_area(t as u32) * size2(&strains[t][load]))
                .sum()
        })
        .collect();
    let normals: Vec<DVec3> = (0..strains.len() as u32)
        .map(|t| mesh.facet_normal(t))
        .collect();
    let areas: Vec<f64> = (0..strains.len() as u32)
        .map(|t| mesh.facet_area(t))
        .collect();
    (0..strains.len())
        .into_par_iter()
        .map(|t| {
            let tri = mesh.triangles()[t];
            // Who shares each corner: facet, which of its corners, share of the area.
            let shared = tri.map(|v| {
                let near: Vec<(usize, usize, f64)> = mesh.vertex_triangles()[v as usize]
                    .iter()
                    .map(|&s| s as usize)
                    .filter(|&s| normals[s].dot(normals[t]) > CREASE)
                    .map(|s| {
                        let corner = mesh.triangles()[s].iter().position(|&w| w == v);
                        (s, corner.unwrap_or(0), areas[s])
                    })
                    .collect();
                let total: f64 = near.iter().map(|n| n.2).sum();
                (near, total)
            });
            let mut error = 0.0;
            for (load, total) in totals.iter().enumerate().filter(|(_, t)| **t > 0.0) {
                let mut apart = 0.0;
                for (corner, (near, sum)) in shared.iter().enumerate() {
                    for face in 0..2 {
                        let own = &strains[t][load][corner][face];
                        for k in 0..6 {
                            let mean: f64 = near
                                .iter()
                                .map(|&(s, c, a)| a * f64::from(strains[s][load][c][face][k]))
                                .sum::<f64>()
                                / sum;
                            apart += (mean - f64::from(own[k])).powi(2);
                        }
                    }
                }
                error += areas[t] * apart / total;
            }
            error / solutions.len().max(1) as f64
        })
        .collect()
}

fn size2(strain: &FacetStrain) -> f64 {
    strain
        .iter()
        .flatten()
        .flatten()
        .map(|&x| f64::from(x).powi(2))
        .sum()
}

fn facet_strains(model: &ShellModel, t: u32, solutions: &[Vec<f64>]) -> Vec<FacetStrain> {
    let facet = Facet::new(model.mesh.corners(t), &model.section);
    let tri = model.mesh.triangles()[t as usize];
    let half = model.section.thickness / 2.0;
    let operators: [[_; 2]; 3] = std::array::from_fn(|corner| {
        let zeta = std::array::from_fn(|i| if i == corner { 1.0 } else { 0.0 });
        [-half, half].map(|z| facet.strain(zeta, z))
    });
    let (e, n) = (facet.frame.x_axis, facet.frame.y_axis);
    solutions
        .iter()
        .map(|u| {
            let local =
                nalgebra::SVector::<f64, 18>::from_fn(|i, _| u[6 * tri[i / 6] as usize + i % 6]);
            operators.map(|faces| faces.map(|b| in_space(e, n, b * local)))
        })
        .collect()
}

/// The tensor of strains (xx, yy, 2xy) along two directions.
fn in_space(e: DVec3, n: DVec3, strain: nalgebra::Vector3<f64>) -> Tensor {
    let entry = |i: usize, j: usize| {
        strain.x * e[i] * e[j]
            + strain.y * n[i] * n[j]
            + strain.z / 2.0 * (e[i] * n[j] + n[i] * e[j])
    };
    [
        entry(0, 0),
        entry(1, 1),
        entry(2, 2),
        entry(1, 2),
        entry(2, 0),
        entry(0, 1),
    ]
    .map(|x| x as f32)
}
