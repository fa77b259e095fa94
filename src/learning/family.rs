//! The families of regressions: how each is searched, fitted and asked about touches that it has not seen.

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::lessons::KnownTouches;
use super::machine::Regression;
use super::ridge::{self, Smoothness};
use super::{gaussian_process, nearest, svr};
use crate::budget::{Cancelled, Watch, report};
use crate::regression::Hyper;

/// A family of regressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// ε-support-vector regression, as in the paper.
    Svr,
    /// The mean of the nearest known touches.
    Nearest,
    /// Kernel ridge regression with one length for all channels.
    KernelRidge,
    /// A Gaussian process with a length a channel.
    GaussianProcess,
}

impl Family {
    /// All; of two that do as well the first is taken.
    pub const ALL: [Self; 4] = [
        Self::GaussianProcess,
        Self::KernelRidge,
        Self::Svr,
        Self::Nearest,
    ];

    /// As in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Svr => "svr",
            Self::Nearest => "nearest",
            Self::KernelRidge => "kernel-ridge",
            Self::GaussianProcess => "gaussian-process",
        }
    }

    fn stage(self) -> &'static str {
        match self {
            Self::Svr => "Support vector regression",
            Self::Nearest => "Nearest neighbours",
            Self::KernelRidge => "Kernel ridge regression",
            Self::GaussianProcess => "Gaussian process",
        }
    }

    /// The settings that do best on known touches, each judged without its own place.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn search(self, known: &KnownTouches, watch: Watch) -> Result<TunedMethod, Cancelled> {
        report(watch, self.stage(), 0, 1)?;
        Ok(match self {
            Self::Svr => TunedMethod::Svr(svr::search(known, self.stage(), watch)?),
            Self::Nearest => TunedMethod::Nearest(nearest::search(known)),
            Self::KernelRidge => TunedMethod::Smooth(ridge::search(known)),
            Self::GaussianProcess => {
                TunedMethod::Smooth(gaussian_process::learn(known, self.stage(), watch)?)
            }
        })
    }
}

/// How readings become places: by a regression, or by matching with a model of the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Method {
    /// From the readings alone.
    Regression(Family),
    /// With a model.
    Model(ByModel),
}

/// What presses teach a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ByModel {
    /// How the gauges are glued.
    Matching,
    /// That, and a remainder, smooth over the surface.
    MatchingRemainder,
}

impl ByModel {
    /// Both; of two that do as well the first is taken.
    pub const ALL: [Self; 2] = [Self::Matching, Self::MatchingRemainder];
}

impl Method {
    /// As in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Regression(family) => family.name(),
            Self::Model(ByModel::Matching) => "matching",
            Self::Model(ByModel::MatchingRemainder) => "matching-remainder",
        }
    }
}

impl From<Family> for Method {
    fn from(family: Family) -> Self {
        Self::Regression(family)
    }
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub enum TunedMethod {
    /// Of support vectors, for outputs of size one.
    Svr(Hyper),
    /// How many neighbours are averaged.
    Nearest(usize),
    /// Of kernel ridge regression and Gaussian processes.
    Smooth(Smoothness),
}

impl TunedMethod {
    /// The regression on all known touches; nothing where it cannot be computed.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn fit(&self, known: &KnownTouches, watch: Watch) -> Result<Option<Regression>, Cancelled> {
        match self {
            Self::Svr(hyper) => svr::fit(known, hyper, watch).map(Some),
            Self::Nearest(count) => Ok(Some(nearest::fit(known, *count))),
            Self::Smooth(smoothness) => Ok(smoothness.fit(known)),
        }
    }

    /// Its residuals at the known touches, each without what is known of its place: touches × outputs.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn left_out(
        &self,
        known: &KnownTouches,
        watch: Watch,
    ) -> Result<Option<Mat<f64>>, Cancelled> {
        match self {
            Self::Svr(hyper) => svr::left_out(known, hyper, watch).map(Some),
            Self::Nearest(count) => Ok(Some(nearest::left_out(known, *count))),
            Self::Smooth(smoothness) => Ok(smoothness.left_out(known)),
        }
    }
}
