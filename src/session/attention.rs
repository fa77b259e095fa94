//! What whoever works with a session does at the moment: nothing is computed for which nobody asks, and nothing that a
//! hand is still changing.

use super::state::fields::FieldKind;
use crate::mesh::SurfacePoint;

/// What colours the part and takes a while to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    Field(FieldKind),
    Walls,
}

/// A look at the hands and eyes in front of a session. Without any, only what was commanded is computed.
// Each is a fact of its own, in any combination.
#[allow(clippy::struct_excessive_bools)]
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
    /// What colours the part, where that takes a while.
    pub colours: Option<Colours>,
    /// Somebody looks at the jig.
    pub jig: bool,
    /// The place whose mistakes are looked at.
    pub pointed: Option<SurfacePoint>,
}

impl Attention {
    /// The field that is looked at and takes a while.
    pub(super) fn field(&self) -> Option<FieldKind> {
        match self.colours {
            Some(Colours::Field(kind)) => Some(kind),
            _ => None,
        }
    }

    /// Whether nothing is being changed by hand.
    pub(super) fn rests(&self) -> bool {
        !self.hand && self.moved.is_none()
    }
}
