//! Selections that were kept, with what was found out about them.

use serde::{Deserialize, Serialize};

use super::ChosenSite;
use crate::budget::Quality;

/// A selection with what was found out about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// For people.
    pub name: String,
    /// The selector's name, or "by-hand".
    pub selector: String,
    /// Quality it was found at.
    pub quality: Quality,
    /// What all its gauges cost together, 1 each where nothing else is said.
    pub cost: f64,
    /// Of choosing it, by the clock.
    pub seconds: f64,
    /// Its gauges, in the order of their choice.
    #[serde(default, rename = "site", skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<ChosenSite>,
    /// What was found of it.
    #[serde(default, rename = "error", skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<KeptError>,
    /// What is left of it when gauges fail.
    #[serde(default, rename = "failure", skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<KeptFailure>,
}

/// Errors of a kept selection's first so many gauges, in a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptError {
    /// Name of the region, or of all touches.
    pub region: String,
    /// So many gauges, the first ones.
    pub sensors: usize,
    /// Mean error (mm).
    pub mean_mm: f64,
    /// Median error (mm).
    pub median_mm: f64,
    /// 95th percentile of the error (mm).
    pub p95_mm: f64,
}

/// Mean error of a kept selection with failed gauges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFailure {
    /// How many gauges failed.
    pub failed: usize,
    /// Whether the regression was retrained without them.
    pub retrained: bool,
    /// Mean error (mm).
    pub mean_mm: f64,
}
