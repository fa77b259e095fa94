//! The stiffness of an isotropic material from products of gradients.

use faer::Mat;
use glam::DVec3;

use crate::elasticity::Material;

/// From the integrals Gᵢⱼ = ∫ ∂ᵢM ∂ⱼN for every two shape functions M and N, at (3 m + i, 3 n + j), to the stiffness
/// λ Gᵢⱼ + μ (Gⱼᵢ + δᵢⱼ tr G), in the same places (N/m for integrals in m). Integrals that were taken along other
/// coordinates are first multiplied by `scale` in each.
#[must_use]
pub fn isotropic(gram: &Mat<f64>, material: &Material, scale: DVec3) -> Mat<f64> {
    let (lambda, mu) = material.lame();
    let scale = scale.to_array();
    let mut stiffness = Mat::zeros(gram.nrows(), gram.ncols());
    for n in 0..gram.ncols() / 3 {
        let from: [&[f64]; 3] = std::array::from_fn(|j| gram.col_as_slice(3 * n + j));
        for j in 0..3 {
            let into = stiffness.col_as_slice_mut(3 * n + j).chunks_exact_mut(3);
            for (m, into) in into.enumerate() {
                let g = |i: usize, j: usize| from[j][3 * m + i] * scale[i] * scale[j];
                for (i, into) in into.iter_mut().enumerate() {
                    *into = lambda * g(i, j) + mu * g(j, i);
                }
                into[j] += mu * (g(0, 0) + g(1, 1) + g(2, 2));
            }
        }
    }
    stiffness
}
