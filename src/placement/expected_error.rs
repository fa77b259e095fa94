//! Gauges for the estimator that reads them: sites with which matching is expected to be least far off.
//!
//! The criterion is the error in mm that model matching (`inference::matching`) is expected to make, over where
//! touches come, how hard they are, and what is off: noise, gluing, the model itself. Gauges are added one by one,
//! always the best of all sites (`bank`), and then exchanged for better ones while there are any. How far what comes out
//! of that can be from the best set says `certificate`.

/// Rounds of exchange.
pub const ROUNDS: usize = 4;

mod bank;
mod certificate;
mod elliptic;
mod exchange;
mod hand;
mod mistaken;
mod scene;

use rayon::prelude::*;

pub use self::certificate::{ASSUMES, Certificate, certify};
pub use self::elliptic::mean_length;
pub use self::hand::{BLIND, Hand, blind, least_helpful, most_helpful};
pub use self::mistaken::{Mistaken, Pair, posterior, taken_for, worst_pairs};
pub use self::scene::{
    Detail, Forces, Knowledge, Reading, Scatter, Scene, Template, Variance, templates,
};

use self::bank::{Bank, Rows};
use super::lead::{self, Best};
use super::wishes::{Field, shortage, unreached};
use super::{PlacementError, Pool, Request, Selection, Selector, SelectorKind, SensorSet};
use crate::budget::{Achieved, Cancelled, StopReason, Watch, Work, report};

/// The selector.
pub struct ExpectedError<'a> {
    pub known: Knowledge<'a>,
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

    fn select(&self, pool: &Pool, request: &Request) -> Result<Selection, PlacementError> {
        let watch = request.watch;
        if request.wishes.failure > 0.0 {
            return Err(PlacementError::Refused {
                selector: "Expected error",
                why: "it weighs noise and gluing, and no gauge that is lost; use greedy SVR to expect failures",
            });
        }
        let empty = Field::new(pool, request.wishes)?;
        let mut field = empty.clone();
        let scenes = Scenes::new(pool, self, watch)?;
        let mut banks = scenes.banks(&[]);
        let mut sets: Vec<SensorSet> = Vec::new();
        let mut before = banks.fine.error();
        while !field.full() && !reached(&sets, request) {
            let step = (field.chosen.len(), request.wishes.sensors);
            report(watch, SELECTING, step.0, step.1)?;
            let open = field.open();
            let errors = banks.scan(&open, watch, step)?;
            let mut best = Best::default();
            for (place, error) in errors {
                best.offer(place, field.worth(place, before - error));
            }
            let Some(place) = best.place() else { break };
            banks.add(place);
            field.add(place);
            before = banks.fine.error();
            let set = set_of(pool, &field.chosen, before, best.lead());
            (request.found)(&set);
            sets.push(set);
        }
        let exchanged = exchange::exchange(&scenes, request, &empty, &field.chosen, self.rounds)?;
        let mut notes = field.constant_notes();
        let mut places = field.chosen.clone();
        if let (Some(last), Some((chosen, error))) = (sets.last_mut(), exchanged) {
            let gained = before - error;
            if gained > 0.0 {
                notes.push(format!(
                    "{} of {} gauges were exchanged after all were chosen: {:.2} mm instead of {:.2}.",
                    chosen.iter().filter(|c| !field.chosen.contains(c)).count(),
                    chosen.len(),
                    error,
                    before
                ));
                *last = set_of(pool, &chosen, error, None);
                (request.found)(last);
                places = chosen;
            }
        }
        if let Some(last) = sets.last_mut() {
            let (allowed, required) = (empty.allowed(), &request.wishes.required);
            last.certificate = certify(&scenes.fine, &allowed, required, &places, watch)?;
        }
        let mut cautions = Vec::from_iter(unreached(&sets, request.wishes));
        notes.extend(lead::ties(&sets, lead::TOLERANCE));
        let wanted = request.wishes.sensors;
        let why = field.closed();
        let short = why.is_some();
        if let Some(why) = why {
            cautions.push(shortage(&why, sets.len(), wanted));
        }
        Ok(Selection {
            selector: SelectorKind::ExpectedError,
            criterion_unit: "mm expected error",
            pool: pool.sites.len(),
            achieved: Achieved {
                error_estimate: sets.last().and_then(|s| s.criterion),
                unit: "mm expected error",
                effort: Work::default(),
                stop_reason: if short {
                    StopReason::NoRoom
                } else {
                    StopReason::Converged
                },
                cautions,
                notes,
            },
            sets,
        })
    }
}

const SELECTING: &str = "Selecting by expected error";

/// Whether the wished error is reached.
fn reached(sets: &[SensorSet], request: &Request) -> bool {
    let error = sets.last().and_then(|s| s.criterion);
    let target = request.wishes.target_mm;
    matches!((error, target), (Some(error), Some(target)) if error <= target)
        && sets.len() >= request.wishes.required.len()
}

fn set_of(pool: &Pool, chosen: &[usize], error: f64, lead: Option<f64>) -> SensorSet {
    SensorSet {
        sites: chosen.iter().map(|&p| pool.sites[p]).collect(),
        criterion: Some(error),
        criterion_mm: Some(error),
        gap: None,
        lead,
        certificate: None,
    }
}

/// The same touches in coarse and in fine detail.
struct Scenes {
    coarse: Scene,
    fine: Scene,
}

impl Scenes {
    fn new(pool: &Pool, selector: &ExpectedError, watch: Watch) -> Result<Self, Cancelled> {
        let scene = |detail| Scene::new(pool.x, pool.targets, &selector.known, detail, watch);
        Ok(Self {
            coarse: scene(selector.detail.coarse())?,
            fine: scene(selector.detail)?,
        })
    }

    fn banks(&self, sites: &[usize]) -> Banks<'_> {
        Banks {
            coarse: Bank::of(&self.coarse, sites),
            fine: Bank::of(&self.fine, sites),
        }
    }
}

struct Banks<'a> {
    coarse: Bank<'a>,
    fine: Bank<'a>,
}

impl Banks<'_> {
    fn add(&mut self, site: usize) {
        self.coarse.add(site);
        self.fine.add(site);
    }

    /// Expected error (mm) with one place more: of all open ones, or while much is uncertain, of those that are
    /// promising in coarse detail.
    fn scan(
        &self,
        open: &[usize],
        watch: Watch,
        step: (usize, usize),
    ) -> Result<Vec<(usize, f64)>, Cancelled> {
        /// Share of the places from which many are uncertain.
        const MUCH: f64 = 0.05;
        const PROMISING: usize = 48;
        let errors = |bank: &Bank, places: &[usize]| -> Result<Vec<(usize, f64)>, Cancelled> {
            let errors = scan(bank, places, watch, step)?;
            Ok(places.iter().copied().zip(errors).collect())
        };
        if open.len() <= PROMISING || self.fine.open_share() < MUCH {
            return errors(&self.fine, open);
        }
        let mut screened = errors(&self.coarse, open)?;
        screened.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let mut promising: Vec<usize> = screened.iter().take(PROMISING).map(|s| s.0).collect();
        promising.sort_unstable();
        errors(&self.fine, &promising)
    }
}

/// Expected error (mm) with each of some places more.
fn scan(
    bank: &Bank,
    open: &[usize],
    watch: Watch,
    step: (usize, usize),
) -> Result<Vec<f64>, Cancelled> {
    /// Places between two looks at the watch.
    const PIECE: usize = 64;
    let piece = |places: &[usize]| -> Result<Vec<f64>, Cancelled> {
        report(watch, SELECTING, step.0, step.1)?;
        let mut rows: Rows = bank.rows();
        Ok(places.iter().map(|&p| bank.with(p, &mut rows)).collect())
    };
    let pieces: Result<Vec<Vec<f64>>, Cancelled> = open.par_chunks(PIECE).map(piece).collect();
    Ok(pieces?.concat())
}

/// The expected error (mm) of a set of sites, and of each press.
#[must_use]
pub fn expected(scene: &Scene, sites: &[usize]) -> (f64, Vec<f64>) {
    let bank = Bank::of(scene, sites);
    (bank.error(), bank.errors())
}

/// The part of the expected error (mm) of a set of sites that is left where one place is meant: its Bayesian
/// Cramér–Rao bound.
#[must_use]
pub fn local(scene: &Scene, sites: &[usize]) -> f64 {
    Bank::of(scene, sites).local()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;
    use crate::placement::Wishes;

    fn chosen(
        targets: &[[f64; 3]],
        wishes: &Wishes,
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
        let request = Request {
            wishes,
            watch: &unwatched,
            found: &|_| {},
        };
        let selector = ExpectedError {
            known: Knowledge {
                noise: 0.0,
                variance: None,
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
            let selection = chosen(&targets, &Wishes::count(3), ROUNDS).unwrap();
            assert_eq!(selection.sets.len(), 3);
            for set in &selection.sets {
                let error = set.criterion.unwrap();
                assert!(error.is_finite() && error >= 0.0, "{targets:?} {error}");
            }
        }
    }

    #[test]
    fn failures_are_refused() {
        let wishes = Wishes {
            failure: 0.3,
            ..Wishes::count(3)
        };
        let refused = chosen(&in_a_line(9), &wishes, ROUNDS);
        assert!(matches!(refused, Err(PlacementError::Refused { .. })));
    }

    #[test]
    fn an_exchange_costs_nothing_more() {
        let costs = [1.0, 5.0, 2.0, 9.0, 3.0, 4.0];
        let wishes = Wishes {
            costs: Some(costs.to_vec()),
            ..Wishes::count(3)
        };
        let cost = |rounds: usize| -> f64 {
            let selection = chosen(&in_a_line(30), &wishes, rounds).unwrap();
            let sites = &selection.sets.last().unwrap().sites;
            sites.iter().map(|&s| costs[s]).sum()
        };
        assert!(cost(ROUNDS) <= cost(0));
    }
}
