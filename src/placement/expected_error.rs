//! Gauges for the estimator that reads them: sites with which matching is expected to be least far off.
//!
//! The criterion is the error in mm that model matching (`inference::matching`) is expected to make, over where
//! touches come, how hard they are, and what is off: noise, gluing, the model itself. Gauges are added one by one,
//! always the best of all sites (`bank`), and then exchanged for better ones while there are any.

/// Rounds of exchange.
pub const ROUNDS: usize = 4;

mod bank;
mod elliptic;
mod exchange;
mod scene;

use rayon::prelude::*;

pub use self::elliptic::mean_length;
pub use self::scene::{Detail, Forces, Knowledge, Scene, Variance};

use self::bank::{Bank, Rows};
use super::lead::{self, Best};
use super::wishes::{Field, shortage};
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
        let mut field = Field::new(pool, request.wishes)?;
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
        let exchanged = exchange::exchange(&scenes, pool, request, &field, self.rounds)?;
        let mut notes = field.constant_notes();
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
            }
        }
        notes.extend(lead::ties(&sets, lead::TOLERANCE));
        let wanted = request.wishes.sensors;
        let why = field.closed();
        let short = why.is_some();
        if let Some(why) = why {
            notes.push(shortage(&why, sets.len(), wanted));
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
