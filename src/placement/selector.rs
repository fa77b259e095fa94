//! What every selector understands: what is asked of it, and that it chooses.

use super::constraints::Constraints;
use super::{PlacementError, Pool, Selection, SelectorKind, SensorSet};
use crate::budget::Watch;

/// What is asked of a selector.
pub struct SelectionRequest<'a> {
    /// What the set must keep to.
    pub constraints: &'a Constraints,
    /// Told of progress; may ask for a stop.
    pub watch: Watch<'a>,
    /// Called with each set as soon as it is known.
    pub found: &'a (dyn Fn(&SensorSet) + Sync),
}

/// Anything that chooses sites from a pool.
pub trait Selector: Sync {
    /// Which one it is.
    fn kind(&self) -> SelectorKind;

    /// Whether each set contains the one before it.
    fn nested(&self) -> bool;

    /// Sets for one gauge and more, as many as the constraints allow.
    ///
    /// # Errors
    /// [`PlacementError`] where the pool does not allow it.
    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError>;
}
