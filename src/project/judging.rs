//! What is kept for the choice, what sets of gauges are judged by, and what may be spent on all of it.

use serde::{Deserialize, Serialize};

use super::key::{TEXT, ValueRange, from, within};
use super::keys::keys;
use super::ranges::{FORCES, PLACES};
use super::value::{any, is_default};
use crate::budget::{Budget, BudgetLimits, Quality};
use crate::evaluation::EstimatorKind;
use crate::limb::BoxMm;

any!(EstimatorKind, Quality);

keys! {
    /// Keys of the table `candidates`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct CandidateKeys in "candidates" {
        unexplained: f64 = 0.01, "", within(0.0, 1.0),
            "share of the held-out variance that the candidates may leave unexplained";
        #[serde(skip_serializing_if = "Option::is_none")]
        count: Option<usize> = None, "", ValueRange::Whole(1, 100_000),
            "a fixed number of candidates instead";
    }
}

keys! {
    /// Keys of the table `evaluation`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct EvaluationKeys in "evaluation" {
        // As `touch.forces_n`.
        #[serde(skip_serializing_if = "is_default")]
        estimator: EstimatorKind = EstimatorKind::default(), "", ValueRange::Words(&["matching", "svr"]),
            "what finds the touches that sets of gauges are judged by: \"matching\" (as live touch; strain only) or \"svr\" (the paper's)";
        #[serde(skip_serializing_if = "are_usual_judged_forces")]
        forces_n: Vec<f64> = JUDGED_N.to_vec(), "N", FORCES,
            "how hard these touches are, by matching, rising; by regression they are as hard as those that it learned from";
    } with {
        /// Regions that errors are quoted for, beside all touches.
        #[serde(rename = "region", skip_serializing_if = "Vec::is_empty")]
        regions: Vec<RegionKeys> = Vec::new();
    }
}

/// How hard the touches are (N) that sets are judged by, where nothing else is said.
const JUDGED_N: [f64; 3] = [3.0, 10.0, 25.0];

fn are_usual_judged_forces(forces_n: &[f64]) -> bool {
    forces_n == JUDGED_N
}

keys! {
    /// Keys of a table `evaluation.region`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct RegionKeys in "evaluation.region" {
        name: String, "", TEXT,
            "errors are quoted for it, beside all touches";
        box_mm: BoxMm, "mm", PLACES,
            "touches inside it belong to the region";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        box_axis: Option<[f64; 3]>, "", PLACES,
            "the box stands along this direction: its corners are along the front, the right and the up of a part of that axis";
    }
}

keys! {
    /// Keys of the table `budget`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct BudgetKeys in "budget" {
        quality: Quality = Quality::default(), "", ValueRange::Words(&["draft", "standard", "reference"]),
            "how much to spend for accuracy";
        // The largest whole number of a TOML file.
        seed: u64 = 0, "", ValueRange::Whole(0, i64::MAX as u64),
            "of every random draw: the same seed gives the same design";
    } with {
        /// In place of some of the quality's own.
        #[serde(skip_serializing_if = "BudgetLimits::are_none")]
        limits: BudgetLimits = BudgetLimits::default();
    }
}

const MANY: u64 = 1_000_000;
/// Every press has a filter at every place.
const LOOKED_AT: u64 = 5000;

keys! {
    BudgetLimits in "budget.limits" {
        elements_percent, "%", from(1e-6, 1e6),
            "estimated error of displacements at which no elements are added; that of strains follows it";
        vertices, "", ValueRange::Whole(100, MANY),
            "most vertices of the elastic model, whatever the number of touches; cells of a solid in proportion";
        touches, "", ValueRange::Whole(3, MANY),
            "most touches that the model is asked for";
        candidates, "", ValueRange::Whole(2, 100_000),
            "most candidates that the reduction keeps, where greedy SVR or a judge by regression asks for it";
        expected_places, "", ValueRange::Whole(20, LOOKED_AT),
            "most places that a choice by expected error compares readings with";
        expected_presses, "", ValueRange::Whole(12, LOOKED_AT),
            "most presses that it is tried on";
        selection_touches, "", ValueRange::Whole(10, MANY),
            "most touches that greedy SVR scores on";
        selection_candidates, "", ValueRange::Whole(2, 100_000),
            "most candidates that it scores";
        tuning_touches, "", ValueRange::Whole(10, MANY),
            "most touches that hyper-parameters are searched on";
    }
}

impl BudgetKeys {
    /// What may be spent.
    #[must_use]
    pub fn budget(&self) -> Budget {
        self.budget_at(self.quality)
    }

    /// As [`Self::budget`] at a quality that need not be the project's: its limits are those of its own.
    #[must_use]
    pub fn budget_at(&self, quality: Quality) -> Budget {
        quality.budget().within(&self.limits_at(quality))
    }

    /// The limits that hold at a quality.
    #[must_use]
    pub fn limits_at(&self, quality: Quality) -> BudgetLimits {
        if quality == self.quality {
            self.limits
        } else {
            BudgetLimits::default()
        }
    }
}
