//! Gauges for the estimator that reads them: sites with which matching is expected to be least far off.
//!
//! The criterion is the error in mm that model matching (`inference::matching`) is expected to make, over where
//! touches come, how hard they are, and what is off: noise, gluing, the model itself. Gauges are added one by one,
//! always the best of all sites (`bank`), and then exchanged for better ones while there are any. Where gauges may be
//! lost, what is left of the set counts too (`expectation`). How far what comes out of that can be from the best set
//! says `certificate`.

mod bank;
mod certificate;
mod elliptic;
mod expectation;
mod hand;
mod losses;
mod mistaken;
mod moving;
mod scene;

pub use self::certificate::{ASSUMES, Certificate, certify};
pub use self::elliptic::mean_length;
pub use self::hand::{BLIND, GaugeInHand, blind, least_helpful, most_helpful};
pub use self::mistaken::{Mistaken, MistakenPair, posterior, taken_for, worst_pairs};
pub use self::moving::Moving;
pub use self::scene::{
    Detail, NUISANCES, ReadingScatter, SceneForces, SharedUnknowns, SignalKnowledge, SiteSignal,
    Template, TouchScene, Variance, templates,
};
pub use super::exchange::ROUNDS;

use self::bank::Bank;
use self::expectation::{Expectation, Scenes, scan};
use super::constraints::{PartialSet, shortage, unreached};
use super::exchange::{self, Exchanged};
use super::margin;
use super::{PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind};
use crate::budget::{Achieved, Cancelled, StopReason, Work};

/// The selector.
pub struct ExpectedError<'a> {
    /// Noise, forces, and what else is off.
    pub known: SignalKnowledge<'a>,
    /// How many places and presses are looked at.
    pub detail: Detail,
    /// How often each gauge may be exchanged after all are chosen; none where sets must contain one another.
    pub rounds: usize,
}

impl Selector for ExpectedError<'_> {
    fn kind(&self) -> SelectorKind {
        SelectorKind::ExpectedError
    }

    fn nested(&self) -> bool {
        self.rounds == 0
    }

    fn select(&self, pool: &Pool, request: &SelectionRequest) -> Result<Selection, PlacementError> {
        let empty = PartialSet::new(pool, request.constraints)?;
        let scenes = Scenes::new(&self.known, self.detail, pool, request.watch)?;
        let mut expectation = Expectation::new(&scenes, pool, request, self.known.seed);
        let mut chosen = exchange::search(&mut expectation, pool, request, &empty, self.rounds)?;
        certify_last(&expectation, request, &empty, &mut chosen)?;
        let losses = expectation.losses_note(&chosen.places)?;
        chosen.notes.extend(losses);
        as_selection(pool, request, chosen)
    }
}

/// Puts beside the last set how far it is at most from the best one.
fn certify_last(
    expectation: &Expectation,
    request: &SelectionRequest,
    empty: &PartialSet,
    chosen: &mut Exchanged,
) -> Result<(), Cancelled> {
    let Some(last) = chosen.sets.last_mut() else {
        return Ok(());
    };
    let (allowed, required) = (empty.allowed(), &request.constraints.required);
    let (scene, watch) = (expectation.scene(), request.watch);
    last.certificate = certify(scene, &allowed, required, &chosen.places, watch)?;
    Ok(())
}

/// The selection, with what must be known of it.
fn as_selection(
    pool: &Pool,
    request: &SelectionRequest,
    chosen: Exchanged,
) -> Result<Selection, PlacementError> {
    let Exchanged { field, sets, .. } = chosen;
    let mut notes = field.constant_notes();
    notes.extend(chosen.notes);
    notes.extend(margin::ties(&sets, margin::TOLERANCE));
    let mut cautions = Vec::from_iter(unreached(&sets, request.constraints));
    let mut stop_reason = StopReason::Converged;
    match field.closed() {
        Some(why) if sets.is_empty() => return Err(PlacementError::NoRoom { why }),
        Some(why) => {
            cautions.push(shortage(&why, sets.len(), request.constraints.sensors));
            stop_reason = StopReason::NoRoom;
        }
        None if sets.is_empty() => return Err(PlacementError::NoSites),
        None => {}
    }
    Ok(Selection {
        selector: SelectorKind::ExpectedError,
        criterion_unit: "mm expected error",
        pool: pool.sites.len(),
        achieved: Achieved {
            error_estimate: sets.last().and_then(|s| s.criterion),
            unit: "mm expected error",
            effort: Work::default(),
            stop_reason,
            cautions,
            notes,
        },
        sets,
    })
}

/// The expected error (mm) of a set of sites, and of each press.
#[must_use]
pub fn expected(scene: &TouchScene, sites: &[usize]) -> (f64, Vec<f64>) {
    let bank = Bank::of(scene, sites);
    (bank.error(), bank.errors())
}

/// The part of the expected error (mm) of a set of sites that is left where one place is meant: its Bayesian
/// Cramér–Rao bound.
#[must_use]
pub fn local(scene: &TouchScene, sites: &[usize]) -> f64 {
    Bank::of(scene, sites).local()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;
    use crate::placement::constraints::{Constraints, Loss, LostBy};

    fn chosen(
        targets: &[[f64; 3]],
        constraints: &Constraints,
        rounds: usize,
    ) -> Result<Selection, PlacementError> {
        let signal = |k: usize| (1.7 * (k + 1) as f64).sin();
        let values = (0..6 * targets.len()).map(signal).collect();
        let x = SignalMatrix::new(targets.len(), values);
        let pool = Pool {
            x: &x,
            targets,
            sites: &[0, 1, 2, 3, 4, 5],
            positions: &[],
        };
        let request = SelectionRequest {
            constraints,
            watch: &unwatched,
            found: &|_| {},
        };
        let selector = ExpectedError {
            known: SignalKnowledge {
                noise: 0.0,
                variance: None,
                shared: None,
                density: None,
                among: None,
                forces: None,
                seed: 1,
            },
            detail: Detail::default(),
            rounds,
        };
        selector.select(&pool, &request)
    }

    fn in_a_line(touches: usize) -> Vec<[f64; 3]> {
        (0..touches).map(|t| [3.0 * t as f64, 0.0, 7.0]).collect()
    }

    #[test]
    fn few_touches_and_odd_ones_have_an_error() {
        for targets in [in_a_line(2), in_a_line(3), in_a_line(40), vec![[1.3; 3]; 4]] {
            let selection = chosen(&targets, &Constraints::count(3), ROUNDS).unwrap();
            assert_eq!(selection.sets.len(), 3);
            for set in &selection.sets {
                let error = set.criterion.unwrap();
                assert!(error.is_finite() && error >= 0.0, "{targets:?} {error}");
            }
        }
    }

    #[test]
    fn a_failure_counts_as_what_is_left_does() {
        let targets = in_a_line(40);
        let error = |failure: f64, loss: Loss| -> f64 {
            let constraints = Constraints {
                required: vec![0, 1, 2, 3],
                failure,
                loss,
                ..Constraints::count(4)
            };
            let selection = chosen(&targets, &constraints, ROUNDS).unwrap();
            let said = selection.achieved.notes.iter().any(|n| n.contains("lost"));
            assert_eq!(said, failure > 0.0);
            selection.sets.last().unwrap().criterion.unwrap()
        };
        let loss = |gauges: usize, by: LostBy| Loss { gauges, by };
        let whole = error(0.0, Loss::default());
        let one = error(0.5, loss(1, LostBy::Expected));
        let two = error(0.5, loss(2, LostBy::Expected));
        let worst = error(0.5, loss(1, LostBy::Worst));
        let all = error(0.5, loss(9, LostBy::Expected));
        assert!(whole <= one && one <= two && one <= worst && two <= all);
        assert!(all.is_finite() && whole < all);
    }

    #[test]
    fn an_exchange_costs_nothing_more() {
        let costs = [1.0, 5.0, 2.0, 9.0, 3.0, 4.0];
        let constraints = Constraints {
            costs: Some(costs.to_vec()),
            ..Constraints::count(3)
        };
        let cost = |rounds: usize| -> f64 {
            let selection = chosen(&in_a_line(30), &constraints, rounds).unwrap();
            let sites = &selection.sets.last().unwrap().sites;
            sites.iter().map(|&s| costs[s]).sum()
        };
        assert!(cost(ROUNDS) <= cost(0));
    }
}
