//! What the documents are made from.

use crate::design::{Design, Inputs};
use crate::io::run::Provenance;
use crate::paper::Format;
use crate::workshop::{Inner, Landmarks, Wiring};

/// Everything that is known.
pub(super) struct Source<'a> {
    pub inputs: &'a Inputs,
    pub design: &'a Design,
    pub provenance: &'a Provenance<'a>,
    pub inner: Inner,
    pub wiring: Wiring,
    pub landmarks: Vec<Landmarks>,
    pub name: String,
    pub format: Format,
}
