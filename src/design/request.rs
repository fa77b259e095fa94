//! What a design is asked for.

use super::{Choosing, Inputs, ReducedSites, Simulated};
use crate::budget::{Budget, Watch};
use crate::placement::SelectorKind;

/// What a design is to be made from, by whom, and what may be spent on it.
#[derive(Clone, Copy)]
pub struct DesignRequest<'a> {
    /// What the user asks for.
    pub inputs: &'a Inputs,
    /// The selectors that choose, in this order.
    pub kinds: &'a [SelectorKind],
    /// What may be spent.
    pub budget: &'a Budget,
}

impl DesignRequest<'_> {
    /// The selectors' part of it.
    pub(super) fn choosing<'a>(
        &'a self,
        simulated: &'a Simulated,
        reduced: &'a ReducedSites,
        watch: Watch<'a>,
    ) -> Choosing<'a> {
        Choosing {
            inputs: self.inputs,
            simulated,
            reduced,
            budget: self.budget,
            watch,
        }
    }

    /// Whose sites are shown and reported: the selector that the project names, where it is among those that choose.
    pub(super) fn chosen_by(&self) -> SelectorKind {
        let named = self.inputs.project.selection.selector;
        if self.kinds.contains(&named) {
            named
        } else {
            self.kinds.first().copied().unwrap_or(named)
        }
    }
}
