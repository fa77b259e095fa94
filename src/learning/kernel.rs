//! Kernels between touches, of the squared distance d² of their features.

use faer::Mat;
use serde::{Deserialize, Serialize};

/// What two touches have in common, from one (the same) down to nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kernel {
    /// exp(-d²/2): every function of it is smooth without end.
    Gaussian,
    /// Matérn's of order 5/2, (1 + √5 d + 5/3 d²) exp(-√5 d): two derivatives, as much as a skin with edges and walls
    /// has (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.17).
    Matern,
}

impl Kernel {
    /// At a squared distance.
    #[must_use]
    pub fn at(self, squared: f64) -> f64 {
        match self {
            Self::Gaussian => (-0.5 * squared).exp(),
            Self::Matern => {
                let r = (5.0 * squared).sqrt();
                (1.0 + r + r * r / 3.0) * (-r).exp()
            }
        }
    }

    /// Its derivative by the squared distance.
    #[must_use]
    pub fn slope(self, squared: f64) -> f64 {
        match self {
            Self::Gaussian => -0.5 * (-0.5 * squared).exp(),
            Self::Matern => {
                let r = (5.0 * squared).sqrt();
                -5.0 / 6.0 * (1.0 + r) * (-r).exp()
            }
        }
    }

    /// Entry by entry of squared distances.
    #[must_use]
    pub fn of(self, mut squared: Mat<f64>) -> Mat<f64> {
        for column in squared.col_iter_mut() {
            for v in column.iter_mut() {
                *v = self.at(*v);
            }
        }
        squared
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_values() {
        for kernel in [Kernel::Gaussian, Kernel::Matern] {
            assert_eq!(kernel.at(0.0), 1.0);
            for squared in [1e-3, 0.3, 1.0, 7.0] {
                let step = 1e-6 * squared;
                let by = (kernel.at(squared + step) - kernel.at(squared - step)) / (2.0 * step);
                let slope = kernel.slope(squared);
                assert!(
                    (by - slope).abs() < 1e-6 * slope.abs(),
                    "{kernel:?} {squared}"
                );
            }
        }
    }
}
