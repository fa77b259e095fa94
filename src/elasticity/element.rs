//! A flat shell facet in space: membrane and bending in its own frame, turned to global degrees of freedom.
//!
//! Global degrees of freedom a node: displacement (x, y, z) then rotation (x, y, z).

use glam::{DMat3, DVec3};
use nalgebra::SMatrix;

use super::bending::Bending;
use super::material::ShellSection;
use super::membrane::{Matrix3x9, Matrix9, Membrane};

/// Stiffness of a facet: six degrees of freedom at each of three nodes.
pub type Matrix18 = SMatrix<f64, 18, 18>;
/// Strains (εx, εy, γxy) from the degrees of freedom of a facet.
pub type Matrix3x18 = SMatrix<f64, 3, 18>;

/// Local degrees of freedom (u, v, θz) and (w, θx, θy) of a node within its six.
const MEMBRANE: [usize; 3] = [0, 1, 5];
const BENDING: [usize; 3] = [2, 3, 4];

/// One facet.
pub struct Facet {
    /// Columns: the local x, y and normal directions.
    pub frame: DMat3,
    membrane: Membrane,
    bending: Bending,
}

impl Facet {
    /// Corners in space (m), counter-clockwise seen from outside.
    #[must_use]
    pub fn new(corners: [DVec3; 3], section: &ShellSection) -> Self {
        let e1 = (corners[1] - corners[0]).normalize();
        let e3 = e1.cross(corners[2] - corners[0]).normalize();
        let frame = DMat3::from_cols(e1, e3.cross(e1), e3);
        let local = corners.map(|p| frame.transpose() * (p - corners[0]));
        let (x, y) = (local.map(|p| p.x), local.map(|p| p.y));
        Self {
            frame,
            membrane: Membrane::new(x, y, section.material.poissons_ratio),
            bending: Bending::new(x, y, section),
        }
    }

    /// Stiffness in global degrees of freedom.
    #[must_use]
    pub fn stiffness(&self, section: &ShellSection) -> Matrix18 {
        let mut local = Matrix18::zeros();
        scatter(&mut local, &self.membrane.stiffness(section), MEMBRANE);
        scatter(&mut local, &self.bending.stiffness(section), BENDING);
        self.turn_stiffness(&local)
    }

    /// Strains (xx, yy, 2xy) in the local frame at barycentric `zeta` and height `z` above the
    /// mid-surface (m), from global degrees of freedom.
    #[must_use]
    pub fn strain(&self, zeta: [f64; 3], z: f64) -> Matrix3x18 {
        let mut local = Matrix3x18::zeros();
        scatter_rows(&mut local, &self.membrane.strain(zeta), MEMBRANE);
        scatter_rows(&mut local, &(self.bending.curvature(zeta) * z), BENDING);
        let mut global = Matrix3x18::zeros();
        for block in 0..6 {
            for row in 0..3 {
                let l = DVec3::from_array(std::array::from_fn(|c| local[(row, 3 * block + c)]));
                let g = self.frame * l;
                for (c, value) in g.to_array().into_iter().enumerate() {
                    global[(row, 3 * block + c)] = value;
                }
            }
        }
        global
    }

    fn turn_stiffness(&self, local: &Matrix18) -> Matrix18 {
        let r = nalgebra::Matrix3::from_column_slice(&self.frame.to_cols_array());
        let mut global = Matrix18::zeros();
        for i in 0..6 {
            for j in 0..6 {
                let block = local.fixed_view::<3, 3>(3 * i, 3 * j);
                let turned = r * block * r.transpose();
                global
                    .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                    .copy_from(&turned);
            }
        }
        global
    }
}

fn scatter(into: &mut Matrix18, part: &Matrix9, dofs: [usize; 3]) {
    for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
        let place = |k: usize| 6 * (k / 3) + dofs[k % 3];
        into[(place(i), place(j))] = part[(i, j)];
    }
}

fn scatter_rows(into: &mut Matrix3x18, part: &Matrix3x9, dofs: [usize; 3]) {
    for j in 0..9 {
        for i in 0..3 {
            into[(i, 6 * (j / 3) + dofs[j % 3])] = part[(i, j)];
        }
    }
}
