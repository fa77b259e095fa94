//! The tables of a project in the order of its file.

use super::keys::KeyTable;
use super::{
    BadValue, BudgetKeys, CalibrationKeys, CandidateKeys, ChosenSite, CostKeys, EvaluationKeys,
    FeasibleKeys, GaugeKeys, GaussianProcessKeys, GluedKeys, KeptError, KeptFailure, KeptSelection,
    Key, LiveKeys, MaterialKeys, Part, PressKeys, Project, RegionKeys, SelectionKeys, SiteKeys,
    SupportKeys, ToleranceKeys, TouchKeys,
};
use crate::budget::BudgetLimits;

/// How a table stands in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heading {
    /// What is in its brackets. Sites of kept selections have the keys of chosen ones, and brackets of their own.
    pub text: &'static str,
    /// Which of a list it is, from 0; nothing of a table that there is one of.
    pub of_list: Option<usize>,
}

impl Heading {
    /// A value that cannot be used, under the key as it stands here.
    pub(super) fn names(self, table: &dyn KeyTable, bad: BadValue) -> BadValue {
        let name = bad.key.strip_prefix(table.name());
        let key = name.map_or_else(|| bad.key.clone(), |name| format!("{}{name}", self.text));
        BadValue { key, ..bad }
    }
}

impl Project {
    /// Shows each table that the project has, in the order of the file.
    pub fn tables(&self, see: &mut dyn FnMut(Heading, &dyn KeyTable)) {
        one(see, &self.part);
        one(see, &self.material);
        list(see, "support", &self.supports);
        one(see, &self.touch);
        one(see, &self.sites);
        one(see, &self.gauge);
        one(see, &self.gauge.tolerance);
        one(see, &self.calibration);
        one(see, &self.feasible);
        one(see, &self.candidates);
        one(see, &self.selection);
        one(see, &self.selection.gaussian_process);
        list(see, "selection.cost", &self.selection.costs);
        list(see, "selection.site", &self.selection.sites);
        one(see, &self.evaluation);
        list(see, "evaluation.region", &self.evaluation.regions);
        one(see, &self.budget);
        // They are for those who measured what they buy: written where one is given.
        if !self.budget.limits.are_none() {
            one(see, &self.budget.limits);
        }
        one(see, &self.live);
        list(see, "live.glued", &self.live.glued);
        list(see, "live.press", &self.live.presses);
        for (k, kept) in self.kept.iter().enumerate() {
            nth(see, "kept", k, kept);
            list(see, "kept.site", &kept.sites);
            list(see, "kept.error", &kept.errors);
            list(see, "kept.failure", &kept.failures);
        }
    }
}

fn one(see: &mut dyn FnMut(Heading, &dyn KeyTable), table: &dyn KeyTable) {
    let heading = Heading {
        text: table.name(),
        of_list: None,
    };
    see(heading, table);
}

fn nth(
    see: &mut dyn FnMut(Heading, &dyn KeyTable),
    text: &'static str,
    k: usize,
    table: &dyn KeyTable,
) {
    let heading = Heading {
        text,
        of_list: Some(k),
    };
    see(heading, table);
}

fn list<T: KeyTable>(
    see: &mut dyn FnMut(Heading, &dyn KeyTable),
    text: &'static str,
    tables: &[T],
) {
    for (k, table) in tables.iter().enumerate() {
        nth(see, text, k, table);
    }
}

/// Every key that a project may have, in the order of the file.
#[must_use]
pub fn all_keys() -> Vec<&'static Key> {
    [
        Part::keys(),
        MaterialKeys::keys(),
        SupportKeys::keys(),
        TouchKeys::keys(),
        SiteKeys::keys(),
        GaugeKeys::keys(),
        ToleranceKeys::keys(),
        CalibrationKeys::keys(),
        FeasibleKeys::keys(),
        CandidateKeys::keys(),
        SelectionKeys::keys(),
        GaussianProcessKeys::keys(),
        CostKeys::keys(),
        ChosenSite::keys(),
        EvaluationKeys::keys(),
        RegionKeys::keys(),
        BudgetKeys::keys(),
        BudgetLimits::keys(),
        LiveKeys::keys(),
        GluedKeys::keys(),
        PressKeys::keys(),
        KeptSelection::keys(),
        KeptError::keys(),
        KeptFailure::keys(),
    ]
    .concat()
}

#[cfg(test)]
mod tests;
