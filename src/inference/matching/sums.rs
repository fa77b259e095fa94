//! Weighted sums that say what force fits best, and how much is left over.

/// Weighted sums of a reading and of what a newton reads at a place.
#[derive(Clone, Copy, Default)]
pub(in crate::inference) struct WeightedSums {
    /// Their product.
    pub s: f64,
    /// Squares of what a newton reads.
    pub d: f64,
    /// Squares of the reading.
    pub squares: f64,
    /// Half the logarithm of the covariance's determinant, over that without gluing.
    pub log: f64,
}

impl WeightedSums {
    /// Best force (N, at most `most_force`) and half the squares left over.
    pub fn fit(&self, most_force: f64) -> (f64, f64) {
        fit([self.s, self.d, self.squares], most_force)
    }
}

/// Best force and half the squares left over, by the weighted product of reading and template, the squares of the
/// template, and those of the reading.
pub(super) fn fit([s, d, squares]: [f64; 3], most_force: f64) -> (f64, f64) {
    let force = if d > 0.0 {
        (s / d).clamp(0.0, most_force)
    } else {
        0.0
    };
    (force, 0.5 * squares - force * (s - 0.5 * force * d))
}

/// A product of which only the logarithm counts: that is taken where it grows large, and not for every factor.
pub(super) struct Product {
    product: f64,
    log: f64,
}

impl Default for Product {
    fn default() -> Self {
        Self {
            product: 1.0,
            log: 0.0,
        }
    }
}

impl Product {
    /// One more factor.
    pub(super) fn times(&mut self, factor: f64) {
        const LARGE: f64 = 1e100;
        self.product *= factor;
        if self.product > LARGE {
            self.log += self.product.ln();
            self.product = 1.0;
        }
    }

    /// Natural logarithm of the product so far.
    pub(super) fn ln(&self) -> f64 {
        self.log + self.product.ln()
    }
}
