//! How long it takes from bytes to a touch.

use crate::statistics::quantile;

/// Between bytes that arrive and the touch that was computed from them.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    /// The last ones (µs), in a ring.
    ring: Vec<f32>,
    next: usize,
}

impl Timing {
    const KEPT: usize = 4096;

    pub(super) fn push(&mut self, micros: f32) {
        if self.ring.len() < Self::KEPT {
            self.ring.push(micros);
        } else {
            self.ring[self.next] = micros;
        }
        self.next = (self.next + 1) % Self::KEPT;
    }

    /// The value (µs) that a share of the last samples stayed below.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<f32> {
        let mut sorted = self.ring.clone();
        sorted.sort_by(f32::total_cmp);
        quantile(&sorted, share)
    }
}
