//! Which selector chooses how many gauges, what it may spend, and what it chose.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::boxes;
use super::key::{SWITCH, ValueRange, from};
use super::keys::keys;
use super::ranges::{GAUGES, LENGTH, PLACES, ROOM};
use super::value::any;
use crate::evaluation::failures::MOST_FAILED;
use crate::gaussian_process::GpKernel;
use crate::limb::BoxMm;
use crate::placement::SelectorKind;
use crate::placement::constraints::{Loss, LostBy, Thorough};
use crate::regression::Hyper;
use crate::units;

any!(SelectorKind, LostBy);

keys! {
    /// Keys of the table `selection`.
    #[allow(
        clippy::struct_excessive_bools,
        reason = "keys of a file that do not depend on each other"
    )]
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct SelectionKeys in "selection" {
        selector: SelectorKind = SelectorKind::default(), "",
            ValueRange::Words(&["expected-error", "greedy-svr", "pca-qr", "entropy", "mutual-information"]),
            "whose sites are reported: \"expected-error\" (by matching, as live touch), or the paper's: \"greedy-svr\", \"pca-qr\", \"entropy\", \"mutual-information\"";
        sensors: usize = 10, "", GAUGES,
            "gauges to place";
        c_mm: f64 = Hyper::default().c, "mm", from(1e-9, 1e12),
            "C of greedy SVR's regression (targets in mm, features standardized): larger follows the touches more closely";
        epsilon_mm: f64 = Hyper::default().epsilon, "mm", from(0.0, 1e9),
            "its ε: errors below this cost nothing";
        gamma: f64 = Hyper::default().gamma, "", from(1e-12, 1e9),
            "its γ, of the Gaussian kernel on standardized signals";
        spacing_mm: f64 = 0.0, "mm", ROOM,
            "least distance between two gauges";
        #[serde(skip_serializing_if = "Vec::is_empty")]
        required_mm: Vec<[f64; 3]> = Vec::new(), "mm", PLACES,
            "places of gauges that must be there, [[x, y, z], …]; the nearest site is taken";
        #[serde(skip_serializing_if = "Option::is_none")]
        target_mm: Option<f64> = None, "mm", from(1e-9, 1e9),
            "error at which greedy SVR and expected error add no more gauges";
        #[serde(skip_serializing_if = "Option::is_none")]
        cost_budget: Option<f64> = None, "", from(1e-9, 1e15),
            "what all gauges together may cost: 1 each, or as in [[selection.cost]]";
        compare: bool = false, "", SWITCH,
            "let the other selectors choose too: a curve of errors for each of them, for the time that they take (minutes)";
        with_noise: bool = false, "", SWITCH,
            "choose from signals with the gauge's noise added";
        failure: f64 = 0.0, "", from(0.0, 1.0),
            "probability that gauges are lost when they are needed: expected error and greedy SVR then choose sites that can do without each other";
        lost: usize = Loss::default().gauges, "", ValueRange::Whole(1, MOST_FAILED as u64),
            "how many are lost together, any of them; greedy SVR weighs the loss of one only";
        lost_by: LostBy = Loss::default().by, "", ValueRange::Words(&["expected", "worst"]),
            "of all the gauges that may be lost: the mean over them counts (\"expected\"), or those whose loss is the \"worst\"";
        exchange: bool = Thorough::default().exchange, "", SWITCH,
            "exchange gauges one at a time after all are chosen, while that makes the set better; expected error always does, PCA-QR never";
        starts: usize = Thorough::default().starts, "", ValueRange::Whole(1, 20),
            "from how many first gauges a set is begun; the best set is kept, for the time that each of them takes";
        refine: bool = false, "", SWITCH,
            "move the gauges that expected error has chosen off the sites, along the surface and by their angle, while the expected error falls (strain only)";
    } with {
        /// Table `selection.gaussian_process`.
        gaussian_process: GaussianProcessKeys = GaussianProcessKeys::default();
        /// What a gauge costs inside a box, the last box counting; 1 elsewhere.
        #[serde(rename = "cost", skip_serializing_if = "Vec::is_empty")]
        costs: Vec<CostKeys> = Vec::new();
        /// The chosen sites, written by a design.
        #[serde(rename = "site", skip_serializing_if = "Vec::is_empty")]
        sites: Vec<ChosenSite> = Vec::new();
    }
}

impl SelectionKeys {
    /// Where gauges must be (m).
    pub fn required(&self) -> impl Iterator<Item = DVec3> {
        (self.required_mm.iter()).map(|place| units::from_mm(DVec3::from_array(*place)))
    }

    /// The least distance between gauges (m).
    #[must_use]
    pub fn spacing(&self) -> f64 {
        units::from_mm(self.spacing_mm)
    }

    /// What a gauge costs at each position (m).
    #[must_use]
    pub fn costs_at(&self, positions: &[DVec3]) -> Vec<f64> {
        let places: Vec<_> = (self.costs.iter().rev())
            .map(|keys| (boxes::oriented(&keys.box_mm, keys.box_axis), keys.cost))
            .collect();
        let cost = |p: &DVec3| {
            let inside = places.iter().find(|(place, _)| boxes::contains(place, *p));
            inside.map_or(1.0, |(_, cost)| *cost)
        };
        positions.iter().map(cost).collect()
    }

    /// Which gauges may be lost.
    #[must_use]
    pub fn loss(&self) -> Loss {
        Loss {
            gauges: self.lost,
            by: self.lost_by,
        }
    }
}

keys! {
    /// The kernel of entropy and mutual information.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct GaussianProcessKeys in "selection.gaussian_process" {
        #[serde(skip_serializing_if = "Option::is_none")]
        length_mm: Option<f64> = None, "mm", LENGTH,
            "length of the kernel of entropy and mutual information; searched when left out";
        #[serde(skip_serializing_if = "Option::is_none")]
        power: Option<f64> = None, "", from(1e-3, 2.0),
            "its power; searched when left out";
        noise: f64 = GpKernel::default().noise, "", from(0.0, 1e6),
            "variance of a measurement's noise over the field's";
    }
}

impl GaussianProcessKeys {
    /// Length (m) and power, where either is given; the other is then the paper's.
    #[must_use]
    pub fn given(&self) -> Option<(f64, f64)> {
        let paper = GpKernel::default();
        (self.length_mm.is_some() || self.power.is_some()).then(|| {
            (
                self.length_mm.map_or(paper.length_m, units::from_mm),
                self.power.unwrap_or(paper.power),
            )
        })
    }
}

keys! {
    /// Keys of a table `selection.cost`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct CostKeys in "selection.cost" {
        box_mm: BoxMm, "mm", PLACES,
            "a gauge in this box …";
        #[serde(default, skip_serializing_if = "Option::is_none")]
        box_axis: Option<[f64; 3]>, "", PLACES,
            "the box stands along this direction: its corners are along the front, the right and the up of a part of that axis";
        cost: f64, "", from(1e-9, 1e9),
            "… costs this";
    }
}

keys! {
    /// Keys of a table `selection.site`: a chosen gauge.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ChosenSite in "selection.site" {
        position_mm: [f64; 3], "mm", PLACES,
            "the middle of a chosen gauge";
        direction: [f64; 3], "", PLACES,
            "along which it measures, a unit vector";
    }
}

impl ChosenSite {
    /// The middle of the gauge (m).
    #[must_use]
    pub fn position(&self) -> DVec3 {
        units::from_mm(DVec3::from_array(self.position_mm))
    }
}
