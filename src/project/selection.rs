//! Which selector chooses how many gauges, what it may spend, and what it chose.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::boxes;
use super::value::MM;
use crate::gaussian_process::GpKernel;
use crate::limb::BoxMm;
use crate::placement::SelectorKind;
use crate::placement::constraints::{Loss, LostBy, Thorough};
use crate::regression::Hyper;

/// Keys of the table `selection`.
#[allow(
    clippy::struct_excessive_bools,
    reason = "keys of a file that do not depend on each other"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SelectionKeys {
    /// Whose sites are reported.
    pub selector: SelectorKind,
    /// Gauges to place.
    pub sensors: usize,
    /// Settings of greedy SVR's regression (targets in mm, features standardized).
    pub c_mm: f64,
    /// ε: half-width of the tube without loss (mm).
    pub epsilon_mm: f64,
    /// γ of the Gaussian kernel.
    pub gamma: f64,
    /// Least distance between two gauges.
    pub spacing_mm: f64,
    /// Places of gauges that must be there; the nearest site is taken.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub required_mm: Vec<[f64; 3]>,
    /// Error at which greedy SVR and expected error add no more gauges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_mm: Option<f64>,
    /// What all gauges together may cost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cost_budget: Option<f64>,
    /// Whether the gauge's noise is added to the signals that sites are chosen from.
    pub with_noise: bool,
    /// Probability that gauges are lost, how many together, and whether the mean or the worst of such losses counts.
    pub failure: f64,
    /// How many gauges are lost together.
    pub lost: usize,
    /// What counts of all such losses.
    pub lost_by: LostBy,
    /// Whether the paper's selectors exchange gauges after all are chosen, as expected error does in any case.
    pub exchange: bool,
    /// From how many first gauges a set is begun, of which the best is kept.
    pub starts: usize,
    /// Whether gauges chosen by expected error are moved off the sites to where and how they serve best.
    pub refine: bool,
    /// Whether the other selectors choose too, to be compared.
    pub compare: bool,
    /// Table `selection.gaussian_process`.
    pub gaussian_process: GaussianProcessKeys,
    /// What a gauge costs inside a box, the last box counting; 1 elsewhere.
    #[serde(rename = "cost", skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostKeys>,
    /// The chosen sites, written by a design.
    #[serde(rename = "site", skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<ChosenSite>,
}

impl Default for SelectionKeys {
    fn default() -> Self {
        let hyper = Hyper::default();
        let (loss, thorough) = (Loss::default(), Thorough::default());
        Self {
            selector: SelectorKind::default(),
            sensors: 10,
            c_mm: hyper.c,
            epsilon_mm: hyper.epsilon,
            gamma: hyper.gamma,
            spacing_mm: 0.0,
            required_mm: Vec::new(),
            target_mm: None,
            cost_budget: None,
            with_noise: false,
            failure: 0.0,
            lost: loss.gauges,
            lost_by: loss.by,
            exchange: thorough.exchange,
            starts: thorough.starts,
            refine: false,
            compare: false,
            gaussian_process: GaussianProcessKeys::default(),
            costs: Vec::new(),
            sites: Vec::new(),
        }
    }
}

impl SelectionKeys {
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

/// The kernel of entropy and mutual information.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GaussianProcessKeys {
    /// Length and power of the kernel; searched by cross-validation when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// Power of the kernel, up to 2; searched when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power: Option<f64>,
    /// Variance of a measurement's noise over the field's.
    pub noise: f64,
}

impl Default for GaussianProcessKeys {
    fn default() -> Self {
        Self {
            length_mm: None,
            power: None,
            noise: GpKernel::default().noise,
        }
    }
}

impl GaussianProcessKeys {
    /// Length (m) and power, where either is given; the other is then the paper's.
    #[must_use]
    pub fn given(&self) -> Option<(f64, f64)> {
        let paper = GpKernel::default();
        (self.length_mm.is_some() || self.power.is_some()).then(|| {
            (
                self.length_mm.map_or(paper.length_m, |l| l * MM),
                self.power.unwrap_or(paper.power),
            )
        })
    }
}

/// Keys of a table `selection.cost`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostKeys {
    /// Gauges inside it (mm) …
    pub box_mm: BoxMm,
    /// As of a support.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub box_axis: Option<[f64; 3]>,
    /// … cost this.
    pub cost: f64,
}

/// Keys of a table `selection.site`: a chosen gauge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChosenSite {
    /// Its middle (mm).
    pub position_mm: [f64; 3],
    /// Unit direction along which it measures.
    pub direction: [f64; 3],
}
