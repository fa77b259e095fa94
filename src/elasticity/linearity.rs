//! What the linear model leaves out at a given force.
//!
//! The strain energy with Green–Lagrange membrane strains, expanded along the linear solution (W. T.
//! Koiter's asymptotic method): with u the linear displacement, e₁ and e₂ the linear and quadratic
//! membrane strains and N their forces,
//! U₃ = ∫ N(e₁)·e₂, U₄ = ½ ∫ N(e₂)·e₂ (and what bending at a slope adds), and the second displacement K u₂ = -U₃′(u) that relaxes it. The
//! displacement λ under the load, in units of the linear one, then obeys λ + α λ² + β λ³ = 1.

use glam::DVec3;
use serde::Serialize;

use super::element::{Facet, Matrix3x18};
use super::load::Touch;
use super::{Model, ShellModel, estimate};

/// What linearity costs at the largest force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Linearity {
    /// Largest change over the loads of the displacement under the load, from linear to finite
    /// displacements (%): negative where the shell stiffens.
    pub largest_percent: f64,
    /// The middle one of the changes' sizes (%).
    pub median_percent: f64,
    /// Loads at which the expansion has no answer: the shell snaps or folds.
    pub beyond: usize,
    /// Loads it was tried on.
    pub loads: usize,
    /// The largest force (N).
    pub force_n: f64,
}

/// Estimates it from solved loads.
#[must_use]
pub fn linearity(model: &ShellModel, touches: &[Touch], solutions: &[Vec<f64>]) -> Linearity {
    let second = Second::of_all(model, solutions);
    let relaxed = model
        .system()
        .solve_loads(&second.iter().map(|s| s.force.clone()).collect::<Vec<_>>());
    let mut changes = Vec::new();
    let mut beyond = 0;
    for ((touch, u), (second, u2)) in touches
        .iter()
        .zip(solutions)
        .zip(second.iter().zip(&relaxed))
    {
        let twice_energy = estimate::under_load(&model.load(touch), touch, u) * touch.force;
        if twice_energy <= 0.0 {
            continue; // pressed on the support itself
        }
        // K u₂ = -U₃′: the work of the relaxation.
        let work: f64 = second.force.iter().map(|&(i, f)| f * u2[i]).sum();
        match response(twice_energy, second.cubic, second.quartic - work / 2.0) {
            Some(lambda) => changes.push(100.0 * (lambda - 1.0)),
            None => beyond += 1,
        }
    }
    changes.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    Linearity {
        largest_percent: changes.last().copied().unwrap_or(0.0),
        median_percent: changes.get(changes.len() / 2).map_or(0.0, |c| c.abs()),
        beyond,
        loads: touches.len(),
        force_n: touches.iter().map(|t| t.force).fold(0.0, f64::max),
    }
}

/// Solves λ + α λ² + β λ³ = 1 for the root that grows from λ = 0.
fn response(twice_energy: f64, cubic: f64, quartic: f64) -> Option<f64> {
    const STEPS: usize = 400;
    const MOST: f64 = 2.0;
    let alpha = 3.0 * cubic / twice_energy;
    let beta = 2.0 * alpha * alpha + 4.0 * quartic / twice_energy;
    let load = |l: f64| l + alpha * l * l + beta * l * l * l;
    let mut low = 0.0;
    for k in 1..=STEPS {
        let high = MOST * k as f64 / STEPS as f64;
        if load(high) < load(low) {
            return None; // past a limit point
        }
        if load(high) >= 1.0 {
            let (mut a, mut b) = (low, high);
            for _ in 0..60 {
                let middle = f64::midpoint(a, b);
                if load(middle) < 1.0 {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            return Some(f64::midpoint(a, b));
        }
        low = high;
    }
    None
}

/// The terms of higher order along one linear solution.
struct Second {
    /// U₃ and U₄ (J).
    cubic: f64,
    quartic: f64,
    /// -U₃′ by degree of freedom (N).
    force: Vec<(usize, f64)>,
}

impl Second {
    /// For several solutions at once: what belongs to a facet is built once for all of them.
    fn of_all(model: &ShellModel, solutions: &[Vec<f64>]) -> Vec<Self> {
        let mut terms: Vec<LinearityTerms> =
            solutions.iter().map(|u| LinearityTerms::new(u)).collect();
        let membrane = model.section.plane_stress() * model.section.thickness;
        let bending = model.section.plane_stress() * (model.section.thickness.powi(3) / 12.0);
        for (t, tri) in (0..).zip(model.mesh.triangles()) {
            let facet = Facet::new(model.mesh.corners(t), &model.section);
            let frame = facet.frame;
            // The element's own mean membrane strain, so that what it can relax is relaxed.
            let mean = facet.strain([1.0 / 3.0; 3], 0.0);
            let (gradients, area) =
                shape_gradients(model.mesh.corners(t), frame.x_axis, frame.y_axis);
            let part = FacetPart {
                tri: *tri,
                normal: frame.z_axis,
                curvature: facet.strain([1.0 / 3.0; 3], 1.0) - mean,
                mean,
                gradients,
                area,
                membrane,
                bending,
            };
            for (terms, u) in terms.iter_mut().zip(solutions) {
                part.add(u, terms);
            }
        }
        terms.into_iter().map(LinearityTerms::finish).collect()
    }
}

/// Sums over the facets for one solution.
struct LinearityTerms {
    cubic: f64,
    quartic: f64,
    force: Vec<f64>,
}

impl LinearityTerms {
    fn new(u: &[f64]) -> Self {
        Self {
            cubic: 0.0,
            quartic: 0.0,
            force: vec![0.0; u.len()],
        }
    }

    fn finish(self) -> Second {
        Second {
            cubic: self.cubic,
            quartic: self.quartic,
            force: self.force.into_iter().enumerate().collect(),
        }
    }
}

/// One facet, ready for any solution.
struct FacetPart {
    tri: [u32; 3],
    normal: DVec3,
    /// Mean membrane strain and curvature from the facet's degrees of freedom.
    mean: Matrix3x18,
    curvature: Matrix3x18,
    gradients: [[f64; 2]; 3],
    area: f64,
    membrane: nalgebra::Matrix3<f64>,
    bending: nalgebra::Matrix3<f64>,
}

impl FacetPart {
    fn add(&self, u: &[f64], into: &mut LinearityTerms) {
        let place = |i: usize| 6 * self.tri[i / 6] as usize + i % 6;
        let own = nalgebra::SVector::<f64, 18>::from_fn(|i, _| u[place(i)]);
        let moved = self.tri.map(|v| DVec3::from_slice(&u[6 * v as usize..]));
        // ∂u/∂x and ∂u/∂y, constant on the facet.
        let [dx, dy]: [DVec3; 2] =
            std::array::from_fn(|k| (0..3).map(|i| moved[i] * self.gradients[i][k]).sum());
        let square = nalgebra::Vector3::new(dx.dot(dx) / 2.0, dy.dot(dy) / 2.0, dx.dot(dy));
        let n1 = self.membrane * (self.mean * own);
        let n2 = self.membrane * square;
        into.cubic += self.area * n1.dot(&square);
        into.quartic += self.area * n2.dot(&square) / 2.0;
        // What bends at a slope bends more than its displacement along the normal says:
        // κ² = w″² (1 + w′²).
        let bent = self.curvature * own;
        let slope = dx.dot(self.normal).powi(2) + dy.dot(self.normal).powi(2);
        into.quartic += self.area * bent.dot(&(self.bending * bent)) * slope / 2.0;
        // N(e₂)·e₁(δ) + N(e₁)·δe₂, with δe₂ the product of gradients.
        let from_second = self.mean.transpose() * n2 * self.area;
        for i in 0..18 {
            into.force[place(i)] -= from_second[i];
        }
        for i in 0..3 {
            let [gx, gy] = self.gradients[i];
            let from_first = dx * (n1.x * gx + n1.z * gy) + dy * (n1.y * gy + n1.z * gx);
            for c in 0..3 {
                into.force[6 * self.tri[i] as usize + c] -= from_first[c] * self.area;
            }
        }
    }
}

/// Derivatives along two directions of the linear shape functions of a facet (1/m), and its area (m²).
fn shape_gradients(p: [DVec3; 3], x: DVec3, y: DVec3) -> ([[f64; 2]; 3], f64) {
    let flat = p.map(|q| [(q - p[0]).dot(x), (q - p[0]).dot(y)]);
    let twice = flat[1][0] * flat[2][1] - flat[2][0] * flat[1][1];
    let gradients = std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        [
            (flat[j][1] - flat[k][1]) / twice,
            (flat[k][0] - flat[j][0]) / twice,
        ]
    });
    (gradients, twice / 2.0)
}
