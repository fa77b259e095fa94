//! The discrete Kirchhoff–Mindlin triangle, in the plane of the facet.
//!
//! I. Katili, "A new discrete Kirchhoff–Mindlin element based on Mindlin–Reissner plate theory and
//! assumed shear strain fields, part I: DKT", Int. J. Numer. Methods Eng. 36 (1993) 1859–1883. It tends
//! to the discrete Kirchhoff triangle as the plate gets thin and keeps transverse shear when it does not.
//! Freedoms: (w, θx, θy) at each corner; a normal fibre at height z moves by z (θy, -θx).

use nalgebra::{Matrix2, RowSVector, SMatrix, Vector2};

use super::material::ShellSection;
use super::membrane::{Matrix3x9, Matrix9};

/// Corners of the sides: 12, 23, 31.
const SIDES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

/// The bending part of one facet.
pub struct Bending {
    /// Derivatives of the linear shape functions.
    dx: [f64; 3],
    dy: [f64; 3],
    /// Direction cosines of the sides.
    cosine: [f64; 3],
    sine: [f64; 3],
    /// Shear influence of each side, 12 D / (κ G t L²).
    phi: [f64; 3],
    /// The quadratic rotation along each side, from the degrees of freedom.
    side_rotation: [RowSVector<f64, 9>; 3],
    area: f64,
}

impl Bending {
    /// Corners `x`, `y` counter-clockwise (m).
    #[must_use]
    pub fn new(x: [f64; 3], y: [f64; 3], section: &ShellSection) -> Self {
        let twice = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        let mut element = Self {
            dx: [y[1] - y[2], y[2] - y[0], y[0] - y[1]].map(|b| b / twice),
            dy: [x[2] - x[1], x[0] - x[2], x[1] - x[0]].map(|c| c / twice),
            cosine: [0.0; 3],
            sine: [0.0; 3],
            phi: [0.0; 3],
            side_rotation: [RowSVector::zeros(); 3],
            area: twice / 2.0,
        };
        let ratio = 12.0 * section.bending_stiffness() / section.shear_stiffness();
        for (k, (i, j)) in SIDES.into_iter().enumerate() {
            let (lx, ly) = (x[j] - x[i], y[j] - y[i]);
            let length = lx.hypot(ly);
            let (c, s) = (lx / length, ly / length);
            (element.cosine[k], element.sine[k]) = (c, s);
            element.phi[k] = ratio / (length * length);
            // Katili's eq. for Δβ: the assumed shear strain equals the true one on average.
            let scale = -1.5 / (1.0 + element.phi[k]);
            let row = &mut element.side_rotation[k];
            row[3 * i] = -scale / length;
            row[3 * j] = scale / length;
            for n in [i, j] {
                // β = (θy, -θx) along the side.
                row[3 * n + 1] = -scale * s / 2.0;
                row[3 * n + 2] = scale * c / 2.0;
            }
        }
        element
    }

    /// Stiffness (N/m, N, N·m by degree of freedom), integrated exactly.
    #[must_use]
    pub fn stiffness(&self, section: &ShellSection) -> Matrix9 {
        let bending = section.plane_stress() * (section.thickness.powi(3) / 12.0);
        let shear = section.shear_stiffness();
        let mut k = Matrix9::zeros();
        for (i, j) in SIDES {
            let mut zeta = [0.0; 3];
            zeta[i] = 0.5;
            zeta[j] = 0.5;
            let b = self.curvature(zeta);
            let g = self.shear(zeta);
            k += (b.transpose() * bending * b + g.transpose() * g * shear) * (self.area / 3.0);
        }
        k
    }

    /// Curvatures (βx,x, βy,y, βx,y + βy,x) at barycentric `zeta`; strain at height z is z times these.
    #[must_use]
    pub fn curvature(&self, zeta: [f64; 3]) -> Matrix3x9 {
        let mut b = Matrix3x9::zeros();
        for n in 0..3 {
            let (dx, dy) = (self.dx[n], self.dy[n]);
            b[(0, 3 * n + 2)] = dx;
            b[(1, 3 * n + 1)] = -dy;
            b[(2, 3 * n + 2)] = dy;
            b[(2, 3 * n + 1)] = -dx;
        }
        for (k, (i, j)) in SIDES.into_iter().enumerate() {
            let px = 4.0 * (self.dx[i] * zeta[j] + self.dx[j] * zeta[i]);
            let py = 4.0 * (self.dy[i] * zeta[j] + self.dy[j] * zeta[i]);
            let (c, s) = (self.cosine[k], self.sine[k]);
            let mode = nalgebra::Vector3::new(px * c, py * s, py * c + px * s);
            b += mode * self.side_rotation[k];
        }
        b
    }

    /// Assumed transverse shear strains (xz, yz) at barycentric `zeta`.
    fn shear(&self, zeta: [f64; 3]) -> SMatrix<f64, 2, 9> {
        let mut g = SMatrix::<f64, 2, 9>::zeros();
        for n in 0..3 {
            // The two sides that meet at corner n.
            let (k, m) = (n, (n + 2) % 3);
            let sides = Matrix2::new(self.cosine[k], self.sine[k], self.cosine[m], self.sine[m]);
            let Some(inverse) = sides.try_inverse() else {
                continue;
            };
            for (column, side) in [(0, k), (1, m)] {
                let tangential = self.side_rotation[side] * (-2.0 / 3.0 * self.phi[side]);
                let direction: Vector2<f64> = inverse.column(column).into();
                g += direction * tangential * zeta[n];
            }
        }
        g
    }
}
