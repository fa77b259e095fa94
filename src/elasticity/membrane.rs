//! The optimal membrane triangle with drilling freedoms, in the plane of the facet.
//!
//! C. A. Felippa, "A study of optimal membrane triangles with drilling freedoms", Comput. Methods Appl.
//! Mech. Engrg. 192 (2003) 2125–2168: the template's OPT instance, αb = 3/2, β0 = ½(1 - 4ν²).
//! Freedoms: (u, v, θz) at each corner.

use nalgebra::{Matrix3, SMatrix};

use super::material::ShellSection;

/// Stiffness of a membrane: u, v and θz at each of three nodes.
pub type Matrix9 = SMatrix<f64, 9, 9>;
/// Membrane strains (εx, εy, γxy) from these.
pub type Matrix3x9 = SMatrix<f64, 3, 9>;

const ALPHA_B: f64 = 1.5;
/// Below this the higher-order stiffness would vanish and the drilling freedoms with it (ν → ½).
const BETA_0_FLOOR: f64 = 0.01;
/// Felippa's β1 … β9.
const BETA: [f64; 9] = [1.0, 2.0, 1.0, 0.0, 1.0, -1.0, -1.0, -1.0, -2.0];

/// The membrane part of one facet.
pub struct Membrane {
    /// Constant strains, (1/V) Lᵀ.
    basic: Matrix3x9,
    /// Natural to Cartesian strains.
    to_cartesian: Matrix3<f64>,
    /// Natural deviatoric strains at the three corners, for the hierarchical rotations.
    corners: [Matrix3<f64>; 3],
    /// Hierarchical rotations from the degrees of freedom.
    rotations: SMatrix<f64, 3, 9>,
    beta_0: f64,
    area: f64,
}

impl Membrane {
    /// Corners `x`, `y` counter-clockwise (m).
    #[must_use]
    pub fn new(x: [f64; 3], y: [f64; 3], poissons_ratio: f64) -> Self {
        let [x12, x23, x31] = [x[0] - x[1], x[1] - x[2], x[2] - x[0]];
        let [y12, y23, y31] = [y[0] - y[1], y[1] - y[2], y[2] - y[0]];
        let (x21, x32, x13) = (-x12, -x23, -x31);
        let (y21, y32, y13) = (-y12, -y23, -y31);
        let area = (y21 * x13 - x21 * y13) / 2.0;
        let (l21, l32, l13) = (
            x21 * x21 + y21 * y21,
            x32 * x32 + y32 * y32,
            x13 * x13 + y13 * y13,
        );
        Self {
            basic: basic_strain([x12, x23, x31], [y12, y23, y31], area),
            to_cartesian: Matrix3::new(
                y23 * y13 * l21,
                y31 * y21 * l32,
                y12 * y32 * l13,
                x23 * x13 * l21,
                x31 * x21 * l32,
                x12 * x32 * l13,
                (y23 * x31 + x32 * y13) * l21,
                (y31 * x12 + x13 * y21) * l32,
                (y12 * x23 + x21 * y32) * l13,
            ) / (4.0 * area * area),
            corners: natural_corners([l21, l32, l13], area),
            rotations: SMatrix::<f64, 3, 9>::from_row_slice(&[
                x32,
                y32,
                4.0 * area,
                x13,
                y13,
                0.0,
                x21,
                y21,
                0.0, //
                x32,
                y32,
                0.0,
                x13,
                y13,
                4.0 * area,
                x21,
                y21,
                0.0, //
                x32,
                y32,
                0.0,
                x13,
                y13,
                0.0,
                x21,
                y21,
                4.0 * area,
            ]) / (4.0 * area),
            beta_0: (0.5 * (1.0 - 4.0 * poissons_ratio * poissons_ratio)).max(BETA_0_FLOOR),
            area,
        }
    }

    /// Stiffness (N/m, N, N·m by degree of freedom).
    #[must_use]
    pub fn stiffness(&self, section: &ShellSection) -> Matrix9 {
        let elastic = section.plane_stress();
        let volume = self.area * section.thickness;
        let basic = self.basic.transpose() * elastic * self.basic * volume;
        let natural = self.to_cartesian.transpose() * elastic * self.to_cartesian;
        let mut higher = Matrix3::zeros();
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let q = (self.corners[i] + self.corners[j]) / 2.0;
            higher += q.transpose() * natural * q;
        }
        let k = 0.75 * self.beta_0 * volume;
        basic + self.rotations.transpose() * higher * self.rotations * k
    }

    /// Strains (xx, yy, 2xy) at barycentric `zeta`, from the degrees of freedom (1/m and 1).
    #[must_use]
    pub fn strain(&self, zeta: [f64; 3]) -> Matrix3x9 {
        let q = self.corners[0] * zeta[0] + self.corners[1] * zeta[1] + self.corners[2] * zeta[2];
        self.basic + self.to_cartesian * q * self.rotations * (1.5 * self.beta_0.sqrt())
    }
}

fn basic_strain(x: [f64; 3], y: [f64; 3], area: f64) -> Matrix3x9 {
    let ([x12, x23, x31], [y12, y23, y31]) = (x, y);
    let (x21, x32, x13) = (-x12, -x23, -x31);
    let (y21, y32, y13) = (-y12, -y23, -y31);
    let a = ALPHA_B / 6.0;
    #[rustfmt::skip]
    let lumping = SMatrix::<f64, 9, 3>::from_row_slice(&[
        y23, 0.0, x32,
        0.0, x32, y23,
        a * y23 * (y13 - y21), a * x32 * (x31 - x12), 2.0 * a * (x31 * y13 - x12 * y21),
        y31, 0.0, x13,
        0.0, x13, y31,
        a * y31 * (y21 - y32), a * x13 * (x12 - x23), 2.0 * a * (x12 * y21 - x23 * y32),
        y12, 0.0, x21,
        0.0, x21, y12,
        a * y12 * (y32 - y13), a * x21 * (x23 - x31), 2.0 * a * (x23 * y32 - x31 * y13),
    ]);
    lumping.transpose() / (2.0 * area)
}

/// Felippa's Q1, Q2, Q3 from the squared side lengths (21, 32, 13).
fn natural_corners(side2: [f64; 3], area: f64) -> [Matrix3<f64>; 3] {
    let [b1, b2, b3, b4, b5, b6, b7, b8, b9] = BETA;
    let rows = [
        [[b1, b2, b3], [b4, b5, b6], [b7, b8, b9]],
        [[b9, b7, b8], [b3, b1, b2], [b6, b4, b5]],
        [[b5, b6, b4], [b8, b9, b7], [b2, b3, b1]],
    ];
    rows.map(|q| {
        Matrix3::from_fn(|side, rotation| 2.0 * area / 3.0 * q[side][rotation] / side2[side])
    })
}
