//! Which gauges of a set may be lost.

use crate::draw::subsets;
use crate::placement::constraints::Constraints;

/// Sets of gauges that may be lost.
pub(super) struct Losses {
    /// How many together.
    pub gauges: usize,
    seed: u64,
    /// Whether there are so many that what is left is looked at in coarse detail.
    pub many: bool,
}

impl Losses {
    /// Nothing where no gauge may be lost.
    pub fn of(constraints: &Constraints, seed: u64) -> Option<Self> {
        /// From so many on they are many.
        const MANY: usize = 12;
        let losses = Self {
            gauges: constraints.loss.gauges,
            seed,
            many: false,
        };
        (constraints.failure > 0.0).then(|| Self {
            many: losses.all(constraints.sensors).len() > MANY,
            ..losses
        })
    }

    /// Numbers of the gauges lost, out of a set of so many: all that may be, or a sample.
    pub fn all(&self, count: usize) -> Vec<Vec<usize>> {
        /// All pairs of ten gauges.
        const MOST: usize = 45;
        subsets(count, self.gauges.min(count), MOST, self.seed)
    }
}
