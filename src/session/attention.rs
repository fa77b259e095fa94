//! What whoever works with a session does at the moment: nothing is computed for which nobody asks, and nothing that a
//! hand is still changing.

use crate::mesh::SurfacePoint;

/// A look at the hands and eyes in front of a session. Without any, only what was commanded is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attention {
    /// A hand is at the settings or on the part: what depends on them waits until it lets go.
    pub hand: bool,
    /// A gauge that follows the hand, by its number from zero.
    pub moved: Option<usize>,
    /// The first of the gauges that are picked, from zero.
    pub picked: Option<usize>,
    /// Somebody looks at what the gauges are expected to err by.
    pub expected: bool,
    /// Somebody looks at the worst confusions.
    pub confusions: bool,
    /// The place whose mistakes are looked at.
    pub pointed: Option<SurfacePoint>,
}

impl Attention {
    /// Whether nothing is being changed by hand.
    pub(super) fn rests(&self) -> bool {
        !self.hand && self.moved.is_none()
    }
}
