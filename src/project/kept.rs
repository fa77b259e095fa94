//! Selections that were kept, with what was found out about them.

use serde::{Deserialize, Serialize};

use super::ChosenSite;
use crate::budget::Quality;

/// A selection with what was found out about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    pub name: String,
    /// The selector's name, or "by-hand".
    pub selector: String,
    pub quality: Quality,
    /// What all its gauges cost together, 1 each where nothing else is said.
    pub cost: f64,
    /// Of choosing it, by the clock.
    pub seconds: f64,
    #[serde(default, rename = "site", skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<ChosenSite>,
    #[serde(default, rename = "error", skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<KeptError>,
    #[serde(default, rename = "failure", skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<KeptFailure>,
}

/// Errors of a kept selection's first so many gauges, in a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptError {
    pub region: String,
    pub sensors: usize,
    pub mean_mm: f64,
    pub median_mm: f64,
    pub p95_mm: f64,
}

/// Mean error of a kept selection with failed gauges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFailure {
    pub failed: usize,
    pub retrained: bool,
    pub mean_mm: f64,
}
