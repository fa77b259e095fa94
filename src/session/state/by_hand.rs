//! What is known of gauges that no selector put where they are.

use std::sync::Arc;

use crate::evaluation::Evaluation;
use crate::project::ChosenSite;
use crate::session::state::results::DesignMark;

/// What the errors of gauges that were put by hand depend on: the gauges, and the design that they are judged like.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) struct HandInputs {
    pub(in crate::session) of: Option<DesignMark>,
    pub(in crate::session) sites: Vec<ChosenSite>,
}

/// What is known of gauges that no selector put where they are.
#[derive(Default)]
pub struct ByHand {
    pub(in crate::session) inputs: Option<HandInputs>,
    /// Mean error (mm), quickly.
    pub(in crate::session) estimate: Option<f64>,
    pub(in crate::session) exact: Option<Arc<Evaluation>>,
}

impl ByHand {
    /// As judged on unseen touches.
    #[must_use]
    pub fn exact(&self) -> Option<&Arc<Evaluation>> {
        self.exact.as_ref()
    }
}
