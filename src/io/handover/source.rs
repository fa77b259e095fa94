//! What the documents are made from.

use crate::design::{Design, Inputs};
use crate::io::run::Provenance;
use crate::jig::Jig;
use crate::paper::SheetSize;
use crate::workshop::{Inner, Landmarks, Wiring};

/// Everything that is known.
pub(super) struct HandoverSource<'a> {
    pub inputs: &'a Inputs,
    pub design: &'a Design,
    pub provenance: &'a Provenance<'a>,
    pub inner: Inner,
    pub jig: Jig,
    pub wiring: Wiring,
    pub landmarks: Vec<Landmarks>,
    pub name: String,
    /// The key of the run.
    pub run: String,
    pub format: SheetSize,
}

impl HandoverSource<'_> {
    /// What must be bought: what is, how much, and what about it.
    pub fn bill(&self) -> Vec<[String; 3]> {
        let mut bill = crate::workshop::bill(&self.wiring);
        let rods = self.jig.stacks.len();
        if rods > 0 {
            let item = |what: &str, count: String, about: &str| [what.into(), count, about.into()];
            let arms: usize = self.jig.stacks.iter().map(|s| s.arms.len()).sum();
            bill.extend([
                item(
                    "nail of 3 mm",
                    rods.to_string(),
                    "through the rod of the jig, below its seat",
                ),
                item(
                    "filament of 1.75 mm, a piece of 15 mm",
                    arms.to_string(),
                    "through the stem of a pad",
                ),
                item(
                    "cord (m)",
                    format!("{:.1}", 0.3 * arms as f64),
                    "from the pads to the end of the rod",
                ),
            ]);
        }
        bill
    }
}
