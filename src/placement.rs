//! Choosing sites.

pub mod candidates;
pub mod greedy_svr;
pub mod pca_qr;

use serde::{Deserialize, Serialize};

use crate::budget::{Achieved, Cancelled, Watch};
use crate::dataset::SignalMatrix;
use crate::pca::PcaError;

/// The selectors a project can name.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum SelectorKind {
    #[default]
    GreedySvr,
    PcaQr,
}

impl SelectorKind {
    pub const ALL: [Self; 2] = [Self::GreedySvr, Self::PcaQr];

    /// As in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::GreedySvr => "greedy-svr",
            Self::PcaQr => "pca-qr",
        }
    }

    /// As read by people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::GreedySvr => "Greedy SVR",
            Self::PcaQr => "PCA-QR",
        }
    }
}

/// What a selector chooses from.
pub struct Pool<'a> {
    /// Signals of the pool's sites (sites × touches).
    pub x: &'a SignalMatrix,
    /// Touch positions (mm).
    pub targets: &'a [[f64; 3]],
    /// The pool's sites, as numbered in the dataset.
    pub sites: &'a [usize],
}

/// The sites chosen for one number of gauges.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorSet {
    /// As numbered in the dataset, in the order they were chosen.
    pub sites: Vec<usize>,
    /// The selector's own criterion, in its own unit.
    pub criterion: f64,
}

/// What a selector chose: one set for each number of gauges from one up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    pub selector: SelectorKind,
    pub sets: Vec<SensorSet>,
    pub criterion_unit: &'static str,
    /// How many sites there were to choose from.
    pub pool: usize,
    pub achieved: Achieved,
}

impl Selection {
    /// The set of the given size, or the largest there is.
    #[must_use]
    pub fn set(&self, sensors: usize) -> Option<&SensorSet> {
        self.sets.get(sensors.checked_sub(1)?).or(self.sets.last())
    }
}

/// Why nothing could be chosen.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlacementError {
    #[error(
        "no site is feasible: relax the filters that took the most sites, or paint a larger region"
    )]
    NoSites,
    #[error(
        "{wanted} gauges were asked for, but only {available} sites can be chosen from: ask for fewer gauges or relax the filters"
    )]
    TooFewSites { wanted: usize, available: usize },
    #[error("{touches} touches are too few to learn from: ask for at least {least}")]
    TooFewTouches { touches: usize, least: usize },
    #[error(transparent)]
    Signals(#[from] PcaError),
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Anything that chooses sites from a pool.
pub trait Selector: Sync {
    fn kind(&self) -> SelectorKind;

    /// Whether each set contains the one before it.
    fn nested(&self) -> bool;

    /// Sets for 1 … `sensors` gauges.
    ///
    /// # Errors
    /// [`PlacementError`] where the pool does not allow it.
    fn select(
        &self,
        pool: &Pool,
        sensors: usize,
        watch: Watch,
    ) -> Result<Selection, PlacementError>;
}

/// Refuses impossible counts, the same way for every selector.
fn check_pool(pool: &Pool, sensors: usize) -> Result<(), PlacementError> {
    if pool.sites.is_empty() {
        return Err(PlacementError::NoSites);
    }
    if sensors > pool.sites.len() {
        return Err(PlacementError::TooFewSites {
            wanted: sensors,
            available: pool.sites.len(),
        });
    }
    Ok(())
}
