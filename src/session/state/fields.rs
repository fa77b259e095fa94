//! Fields over the part that take a while, and what they depend on.

use std::sync::Arc;

use glam::DVec3;

use crate::session::slot::Slot;
use crate::session::state::results::DesignMark;

/// Which field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// The error (mm) that the design was found to make.
    Error,
    /// The share of the variance that the gauges leave.
    Uncertainty,
}

/// What a field was computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInputs {
    pub(in crate::session) kind: FieldKind,
    pub(in crate::session) design: DesignMark,
    /// Gauges (m), where it depends on where they are now.
    pub(in crate::session) gauges: Vec<DVec3>,
}

/// A field, a vertex of the part.
pub type FieldValues = Slot<FieldInputs, Arc<Vec<f64>>>;
