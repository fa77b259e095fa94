//! Which set was judged: who chose it, and how many gauges it has.

use serde::{Serialize, Serializer};

use crate::placement::SelectorKind;

/// Who chose the gauges of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Chooser {
    /// A selector of the design.
    Selector(SelectorKind),
    /// Whoever moved gauges by hand.
    Hand,
    /// Nobody: all candidates together, the baseline of regressions.
    AllCandidates,
}

impl Chooser {
    /// As in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Selector(kind) => kind.name(),
            Self::Hand => "by-hand",
            Self::AllCandidates => "all-candidates",
        }
    }

    /// As read by people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Selector(kind) => kind.title(),
            Self::Hand => "By hand",
            Self::AllCandidates => "All candidates",
        }
    }

    /// Its set of so many gauges.
    #[must_use]
    pub fn set(self, sensors: usize) -> SetId {
        SetId {
            chooser: self,
            sensors,
        }
    }
}

impl From<SelectorKind> for Chooser {
    fn from(kind: SelectorKind) -> Self {
        Self::Selector(kind)
    }
}

impl Serialize for Chooser {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// One of the sets that were judged. A selector has one set for each number of gauges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct SetId {
    /// Who chose it.
    #[serde(rename = "selector")]
    pub chooser: Chooser,
    /// Gauges it has.
    pub sensors: usize,
}
