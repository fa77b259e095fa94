//! What is to be kept computed, and how far that is.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::design::DesignStep;
use crate::document::DesignInputs;
use crate::project::ChosenSite;

/// How far the pipeline is to be kept computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::session) enum DriveGoal {
    Simulation,
    Design,
}

/// The running design's state, as its job shares it.
#[derive(Debug, Default)]
pub struct RunningDesign {
    /// What the selector in the lead has chosen so far.
    pub sites: Vec<ChosenSite>,
    pub step: Option<DesignStep>,
}

/// What is to be kept computed, and what becomes of it.
#[derive(Default)]
pub struct Drive {
    pub(in crate::session) goal: Option<DriveGoal>,
    /// Whether what a selection finds becomes the project's gauges: until one is moved by hand.
    pub take: bool,
    /// Whether a selection was asked for by hand and has not come yet.
    pub(in crate::session) pressed: bool,
    /// What the settings gave when they were looked at last.
    pub(in crate::session) seen: Option<DesignInputs>,
    pub(in crate::session) still_since: Option<Instant>,
    pub(in crate::session) making: Arc<Mutex<RunningDesign>>,
}

impl Drive {
    /// Whether gauges are on their way: what is computed leads to a selection.
    #[must_use]
    pub fn selects(&self) -> bool {
        self.goal == Some(DriveGoal::Design)
    }

    /// The step that the running design is at.
    #[must_use]
    pub fn step(&self) -> Option<DesignStep> {
        self.making.lock().ok().and_then(|making| making.step)
    }

    /// The gauges that the running design has chosen so far.
    pub(in crate::session) fn chosen(&self) -> Option<Vec<ChosenSite>> {
        let making = self.making.lock().ok()?;
        Some(making.sites.clone()).filter(|sites| !sites.is_empty())
    }
}
