//! Choosing sites.

pub mod candidates;
pub mod constraints;
pub mod entropy;
mod exchange;
pub mod expected_error;
pub mod greedy_svr;
pub mod information;
pub mod margin;
pub mod mutual_information;
pub mod pca_qr;
mod selector;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::budget::{Achieved, Cancelled};
use crate::dataset::SignalMatrix;
use crate::pca::PcaError;
use crate::plain;
pub use constraints::{Constraints, LostBy};
pub use expected_error::Certificate;
pub use selector::{SelectionRequest, Selector};

/// The selectors a project can name.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum SelectorKind {
    /// Least error that model matching is expected to make; the default.
    #[default]
    ExpectedError,
    /// The paper's Algorithm 1.
    GreedySvr,
    /// Pivots of a QR factorization of the principal components.
    PcaQr,
    /// Entropy of a Gaussian process.
    Entropy,
    /// Mutual information of a Gaussian process.
    MutualInformation,
}

impl SelectorKind {
    /// All, the default first.
    pub const ALL: [Self; 5] = [
        Self::ExpectedError,
        Self::GreedySvr,
        Self::PcaQr,
        Self::Entropy,
        Self::MutualInformation,
    ];

    /// Those that the paper compares.
    pub const PAPER: [Self; 4] = [
        Self::GreedySvr,
        Self::PcaQr,
        Self::Entropy,
        Self::MutualInformation,
    ];

    /// Whether it chooses among candidates that the feasible sites are reduced to; the others among all of them.
    #[must_use]
    pub fn wants_candidates(self) -> bool {
        self == Self::GreedySvr
    }

    /// Whether it weighs what is left of a set where a gauge is lost.
    #[must_use]
    pub fn weighs_losses(self) -> bool {
        matches!(self, Self::ExpectedError | Self::GreedySvr)
    }

    /// Whether it weighs that several gauges are lost together.
    #[must_use]
    pub fn weighs_losses_together(self) -> bool {
        self == Self::ExpectedError
    }

    /// Whether it exchanges gauges where it is asked to: expected error does in any case, and PCA-QR has no criterion of
    /// a set.
    #[must_use]
    pub fn exchanges_if_asked(self) -> bool {
        !matches!(self, Self::ExpectedError | Self::PcaQr)
    }

    /// Whether it can begin sets from several first gauges.
    #[must_use]
    pub fn has_starts(self) -> bool {
        self != Self::PcaQr
    }

    /// As in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::GreedySvr => "greedy-svr",
            Self::PcaQr => "pca-qr",
            Self::Entropy => "entropy",
            Self::MutualInformation => "mutual-information",
            Self::ExpectedError => "expected-error",
        }
    }

    /// As read by people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::GreedySvr => "Greedy SVR",
            Self::PcaQr => "PCA-QR",
            Self::Entropy => "Entropy",
            Self::MutualInformation => "Mutual information",
            Self::ExpectedError => "Expected error",
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
    /// Where they are (m); empty when nobody knows.
    pub positions: &'a [DVec3],
}

/// The sites chosen for one number of gauges.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorSet {
    /// As numbered in the dataset, in the order they were chosen.
    pub sites: Vec<usize>,
    /// The selector's own criterion, in its own unit; absent where no selector chose the set.
    pub criterion: Option<f64>,
    /// Cross-validated error of the regression (mm), where it was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub criterion_mm: Option<f64>,
    /// Share of the criterion by which a better choice of this step may still exist; absent where the
    /// choice is exact by its nature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,
    /// How far the last pick was ahead of the next best site, as a share of the criterion (greedy SVR) or of what
    /// the pick adds to it; where each set is chosen for itself, of the least certain of its picks. Absent where
    /// there was no choice.
    #[serde(rename = "lead", skip_serializing_if = "Option::is_none")]
    pub margin: Option<f64>,
    /// How far the set is at most from the best of as many gauges; only of the last set of a choice by expected error.
    #[serde(flatten)]
    pub certificate: Option<Certificate>,
    /// The error (mm) that is expected over presses and noise that the set was not chosen by: those that it was chosen by
    /// flatter it. Of the set that is shown; absent where nobody has looked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_mm: Option<f64>,
}

impl SensorSet {
    /// How far the set is at most from the best one, in words; absent where nothing is known of that.
    #[must_use]
    pub fn certified(&self) -> Option<String> {
        Some(self.certificate?.words(self.promised_mm()?))
    }

    /// The error (mm) that can be promised of it: over presses that it was not chosen by, where that is known.
    #[must_use]
    pub fn promised_mm(&self) -> Option<f64> {
        self.expected_mm.or(self.criterion_mm)
    }
}

/// What a selector chose: one set for each number of gauges from one up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Selection {
    /// Who chose.
    pub selector: SelectorKind,
    /// Rising in gauges; a choice that is not nested exchanges some from set to set.
    pub sets: Vec<SensorSet>,
    /// Unit of the criterion.
    pub criterion_unit: &'static str,
    /// How many sites there were to choose from.
    pub pool: usize,
    /// What was reached, and at what effort.
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
    /// There is nothing to choose from.
    #[error("there is no site to choose from: all are left out, or there are none")]
    NoSites,
    /// Fewer sites than gauges asked for.
    #[error(
        "{} asked for, but only {} to choose from: ask for fewer gauges or allow more sites",
        plain::either(*.wanted, "gauge was", "gauges were"),
        plain::either(*.available, "site is there", "sites are there")
    )]
    TooFewSites {
        /// Gauges asked for.
        wanted: usize,
        /// Sites there are.
        available: usize,
    },
    /// Too few touches to train on.
    #[error("{} too few to learn from: ask for at least {least}", plain::either(*.touches, "touch is", "touches are"))]
    TooFewTouches {
        /// Touches there are.
        touches: usize,
        /// Touches needed.
        least: usize,
    },
    /// Too few places to divide into folds.
    #[error(
        "{places} places are too few to learn from and to judge on in {folds} folds: at least {least} are needed, or fewer folds (the {touches} touches are repeats of them, which are never divided)"
    )]
    TooFewPlaces {
        /// Places there are.
        places: usize,
        /// Touches at these places.
        touches: usize,
        /// Folds asked for.
        folds: usize,
        /// Places needed.
        least: usize,
    },
    /// Too few touches to divide into folds.
    #[error(
        "{touches} touches are too few to learn from and to judge on in {folds} folds: at least {least} are needed, or fewer folds"
    )]
    TooFewForFolds {
        /// Touches there are.
        touches: usize,
        /// Folds asked for.
        folds: usize,
        /// Touches needed.
        least: usize,
    },
    /// Constraints leave no site.
    #[error("no gauge can be placed: {why}")]
    NoRoom {
        /// Which ones, and what to change.
        why: String,
    },
    /// The covariance cannot be factored.
    #[error(
        "the covariance of the sites is singular: raise the noise of the Gaussian process or merge sites that lie together"
    )]
    Singular,
    /// A constraint contradicts itself.
    #[error("{what}")]
    Constraint {
        /// Which one, and what to change.
        what: &'static str,
    },
    /// A constraint that this selector cannot heed.
    #[error("{selector} cannot take this into account: {why}")]
    Refused {
        /// Its name, for people.
        selector: &'static str,
        /// Which constraint, and what to use instead.
        why: &'static str,
    },
    /// The signals have no components.
    #[error(transparent)]
    Signals(#[from] PcaError),
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
