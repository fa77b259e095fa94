//! Greedy support-vector regression: the paper's Algorithm 1.
//!
//! Each step adds the site with which the cross-validated error of the regression is smallest; the
//! criterion is the mean over folds of the mean Euclidean error (mm). Fitting every candidate exactly
//! would take hours at the paper's size. Instead every candidate gets a cheap score of the same
//! regression (`screen.rs`), the promising ones dearer ones, and the last few the criterion itself
//! (`exact.rs`). How many go on depends on how far the scores were seen to depart from each other
//! (`race.rs`): what cannot win even then is left behind.

mod audit;
mod exact;
mod notes;
mod race;
mod screen;
mod search;
mod sets;
mod settings;

pub use self::audit::{Audit, Comparison};
pub use self::search::TIE;
pub use self::settings::{GreedySvr, TOLERANCE};

use self::search::GreedySearch;
use super::constraints::{PartialSet, reached, shortage, unreached};
use super::exchange::{self, Exchanged};
use super::{PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind};
use crate::budget::{Achieved, StopReason};

impl Selector for GreedySvr {
    fn kind(&self) -> SelectorKind {
        SelectorKind::GreedySvr
    }

    fn nested(&self) -> bool {
        true
    }

    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError> {
        let constraints = request.constraints;
        if constraints.failure > 0.0 && constraints.loss.gauges > 1 {
            return Err(PlacementError::Refused {
                selector: "Greedy SVR",
                why: "it weighs the loss of one gauge, not of several together; use expected error for that",
            });
        }
        let folds = self.split(pool.targets)?;
        let empty = PartialSet::new(pool, constraints)?;
        let mut search = GreedySearch::new(self, pool, request, &folds);
        let rounds = exchange::rounds_asked(constraints);
        let chosen = exchange::search(&mut search, pool, request, &empty, rounds)?;
        let Exchanged { field, sets, .. } = chosen;
        let ended = field.full() || reached(&sets, constraints);
        let mut cautions = Vec::new();
        match field.closed().filter(|_| !ended) {
            Some(why) if sets.is_empty() => return Err(PlacementError::NoRoom { why }),
            Some(why) => cautions.push(shortage(&why, sets.len(), constraints.sensors)),
            None if sets.is_empty() => return Err(PlacementError::NoSites),
            None => {}
        }
        cautions.extend(unreached(&sets, constraints));
        let mut notes = field.constant_notes();
        notes.extend(chosen.notes);
        notes.extend(self::notes::notes(&search, &sets));
        Ok(Selection {
            selector: SelectorKind::GreedySvr,
            criterion_unit: "mm, cross-validated",
            pool: pool.sites.len(),
            achieved: Achieved {
                error_estimate: sets.last().and_then(|s| s.criterion),
                unit: "mm",
                effort: search.work,
                stop_reason: match (ended, search.converged) {
                    (false, _) => StopReason::NoRoom,
                    (true, false) => StopReason::EffortSpent,
                    (true, true) => StopReason::Converged,
                },
                cautions,
                notes,
            },
            sets,
        })
    }
}
