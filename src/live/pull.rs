//! What lets go of a rest that was taken under it reads like a touch, but for its sign.

use crate::inference::{Contact, Matching};

/// Share of the weighted squares that it explains which a pull may leave over.
const LEFT: f64 = 0.25;

/// The pull that explains a reading (strain) best, as the touch that reads the opposite.
pub(super) fn find(matching: &mut Matching, strain: &[f64]) -> Contact {
    let turned: Vec<f64> = strain.iter().map(|x| -x).collect();
    matching.find(&turned)
}

/// Whether it is what is read, as far as one look can tell.
pub(super) fn explains(pull: &Contact) -> bool {
    pull.unexplained < LEFT * pull.strength
}
