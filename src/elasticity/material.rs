//! What a part is made of.

use super::error::{ElasticError, range};

/// An isotropic linear elastic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio, above -1 and below 0.5.
    pub poissons_ratio: f64,
}

impl Material {
    /// Lamé's λ and μ (Pa).
    #[must_use]
    pub fn lame(&self) -> (f64, f64) {
        let Self {
            youngs_modulus: e,
            poissons_ratio: nu,
        } = *self;
        let mu = e / (2.0 * (1.0 + nu));
        (2.0 * mu * nu / (1.0 - 2.0 * nu), mu)
    }

    /// Both values within their ranges.
    ///
    /// # Errors
    /// [`ElasticError::Value`] naming the one that is not.
    pub fn check(&self) -> Result<(), ElasticError> {
        let (e, nu) = (self.youngs_modulus, self.poissons_ratio);
        range("Young's modulus in Pa", "above zero", e, e > 0.0)?;
        let rule = "above -1 and below 0.5";
        range("Poisson's ratio", rule, nu, nu > -1.0 && nu < 0.5)
    }
}

/// A shell of one thickness whose mid-surface is the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellSection {
    /// What it is made of.
    pub material: Material,
    /// Thickness (m).
    pub thickness: f64,
}

impl ShellSection {
    /// Plane-stress matrix (Pa) for strains (xx, yy, 2xy).
    #[must_use]
    pub fn plane_stress(&self) -> nalgebra::Matrix3<f64> {
        let Material {
            youngs_modulus: e,
            poissons_ratio: nu,
        } = self.material;
        let c = e / (1.0 - nu * nu);
        nalgebra::Matrix3::new(
            c,
            c * nu,
            0.0,
            c * nu,
            c,
            0.0,
            0.0,
            0.0,
            c * (1.0 - nu) / 2.0,
        )
    }

    /// Bending stiffness D = E t³ / 12 (1 - ν²) (N·m).
    #[must_use]
    pub fn bending_stiffness(&self) -> f64 {
        let Material {
            youngs_modulus: e,
            poissons_ratio: nu,
        } = self.material;
        e * self.thickness.powi(3) / (12.0 * (1.0 - nu * nu))
    }

    /// Transverse shear stiffness κ G t with κ = 5/6 (N/m).
    #[must_use]
    pub fn shear_stiffness(&self) -> f64 {
        let Material {
            youngs_modulus: e,
            poissons_ratio: nu,
        } = self.material;
        5.0 / 6.0 * e / (2.0 * (1.0 + nu)) * self.thickness
    }
}
