//! Selections that were kept, with what was found out about them.

use serde::{Deserialize, Serialize};

use super::ChosenSite;
use super::key::{SWITCH, TEXT, ValueRange, from};
use super::keys::keys;
use crate::budget::Quality;

/// Nobody waits longer, nothing costs more, and no limb is larger.
const FOUND: ValueRange = from(0.0, 1e15);
const COUNT: ValueRange = ValueRange::Whole(0, u32::MAX as u64);

keys! {
    /// A selection with what was found out about it.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct KeptSelection in "kept" {
        name: String, "", TEXT,
            "a selection that was kept to be compared";
        selector: String, "", ValueRange::Any("the name of a selector, or by-hand"),
            "who chose it";
        quality: Quality, "", ValueRange::Words(&["draft", "standard", "reference"]),
            "that it was found at";
        cost: f64, "", FOUND,
            "of all its gauges together, 1 each where nothing else is said";
        seconds: f64, "s", FOUND,
            "that choosing it took, by the clock";
    } with {
        /// Its gauges, in the order of their choice.
        #[serde(default, rename = "site", skip_serializing_if = "Vec::is_empty")]
        sites: Vec<ChosenSite>;
        /// What was found of it.
        #[serde(default, rename = "error", skip_serializing_if = "Vec::is_empty")]
        errors: Vec<KeptError>;
        /// What is left of it when gauges fail.
        #[serde(default, rename = "failure", skip_serializing_if = "Vec::is_empty")]
        failures: Vec<KeptFailure>;
    }
}

keys! {
    /// Errors of a kept selection's first so many gauges, in a region.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct KeptError in "kept.error" {
        region: String, "", TEXT,
            "name of the region, or of all touches";
        sensors: usize, "", COUNT,
            "so many gauges, the first ones";
        mean_mm: f64, "mm", FOUND,
            "mean error";
        median_mm: f64, "mm", FOUND,
            "median error";
        p95_mm: f64, "mm", FOUND,
            "95th percentile of the error";
    }
}

keys! {
    /// Mean error of a kept selection with failed gauges.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct KeptFailure in "kept.failure" {
        failed: usize, "", COUNT,
            "how many gauges failed";
        retrained: bool, "", SWITCH,
            "whether the regression was trained anew without them";
        mean_mm: f64, "mm", FOUND,
            "mean error";
    }
}
