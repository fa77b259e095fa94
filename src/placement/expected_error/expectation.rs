//! The error that a choice by expected error goes by: of a whole set, and of what is left of it where gauges may be
//! lost. Nothing is learned anew then: a lost gauge is left out of the posterior.

use rayon::prelude::*;

use super::bank::{Bank, TrialMemory};
use super::losses::Losses;
use super::scene::{Detail, SignalKnowledge, TouchScene};
use crate::budget::{Cancelled, Watch, report};
use crate::placement::constraints::{Constraints, LostBy, PartialSet, reached};
use crate::placement::exchange::{Criterion, gains};
use crate::placement::margin::Best;
use crate::placement::{PlacementError, Pool, SelectionRequest, SensorSet};

const SELECTING: &str = "Selecting by expected error";
/// Sites that are looked at in fine detail.
const PROMISING: usize = 64;
/// Of these, when the same gauge is looked at again.
const AGAIN: usize = 24;
/// And of these with gauges lost.
const WITH_LOSSES: usize = 48;

/// The criterion.
pub(super) struct Expectation<'a> {
    scenes: &'a Scenes,
    /// The first gauges of a set in which one gauge after the other is exchanged.
    begun: Option<(Vec<usize>, Banks<'a>)>,
    /// For each gauge of a set that was exchanged, the places that were promising for it when it was looked at first: the
    /// others have hardly changed since then.
    promising: Vec<Option<Vec<usize>>>,
    pool: &'a Pool<'a>,
    request: &'a SelectionRequest<'a>,
    losses: Option<Losses>,
}

/// The same touches in coarse and in fine detail.
pub(super) struct Scenes {
    coarse: TouchScene,
    fine: TouchScene,
}

impl Scenes {
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        known: &SignalKnowledge,
        detail: Detail,
        pool: &Pool,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let scene = |detail: Detail| TouchScene::new(pool.x, pool.targets, known, detail, watch);
        Ok(Self {
            coarse: scene(detail.coarse())?,
            fine: scene(detail)?,
        })
    }
}

/// What is expected of a set.
pub(super) struct ExpectedSet {
    /// With all gauges (mm).
    pub whole: f64,
    /// After each loss (mm).
    pub lost: Vec<f64>,
}

impl ExpectedSet {
    /// Of a set of a scene, and where gauges may be lost, of what is left of it in another of the same touches.
    ///
    /// # Errors
    /// [`Cancelled`] when `report` does so.
    pub fn of(
        scene: &TouchScene,
        losses: Option<(&Losses, &TouchScene)>,
        set: &[usize],
        report: &(dyn Fn() -> Result<(), Cancelled> + Sync),
    ) -> Result<Self, Cancelled> {
        report()?;
        let whole = Bank::of(scene, set).error();
        let Some((losses, scene)) = losses else {
            let lost = Vec::new();
            return Ok(Self { whole, lost });
        };
        let error = |lost: &Vec<usize>| -> Result<f64, Cancelled> {
            report()?;
            Ok(left(scene, seats(set, set.len()), lost).error())
        };
        let lost: Result<Vec<f64>, Cancelled> =
            losses.all(set.len()).par_iter().map(error).collect();
        Ok(Self { whole, lost: lost? })
    }

    /// As it counts (mm).
    pub fn weighed(self, constraints: &Constraints) -> f64 {
        constraints.weighed(self.whole, self.lost.into_iter())
    }
}

impl<'a> Expectation<'a> {
    /// Of touches in both details; `seed` is of the losses.
    pub fn new(
        scenes: &'a Scenes,
        pool: &'a Pool<'a>,
        request: &'a SelectionRequest<'a>,
        seed: u64,
    ) -> Self {
        Self {
            scenes,
            begun: None,
            promising: Vec::new(),
            pool,
            request,
            losses: Losses::of(request.constraints, seed),
        }
    }

    /// The touches in the detail that counts.
    pub fn scene(&self) -> &TouchScene {
        &self.scenes.fine
    }

    /// The criterion (mm) of a set.
    fn error(&self, set: &[usize]) -> Result<f64, Cancelled> {
        Ok(self.expected(set)?.weighed(self.request.constraints))
    }

    fn expected(&self, set: &[usize]) -> Result<ExpectedSet, Cancelled> {
        let losses = self.losses.as_ref().map(|l| (l, self.scene_of(l)));
        let report = || self.report(set.len());
        ExpectedSet::of(&self.scenes.fine, losses, set, &report)
    }

    /// The touches in the detail in which losses are looked at.
    fn scene_of(&self, losses: &Losses) -> &TouchScene {
        if losses.many {
            &self.scenes.coarse
        } else {
            &self.scenes.fine
        }
    }

    /// With the others of a set around the gauge of a number. Gauges are exchanged in their order: those before it stay
    /// as they are for the next one.
    fn around(&mut self, others: &[usize], number: usize) -> Banks<'a> {
        let begun = self.begun.take();
        let fits =
            |(sites, _): &(Vec<usize>, Banks)| sites.len() <= number && others.starts_with(sites);
        let empty = || (Vec::new(), Banks::new(self.scenes));
        let (mut sites, mut banks) = begun.filter(fits).unwrap_or_else(empty);
        for (turn, &site) in others[..number].iter().enumerate().skip(sites.len()) {
            banks.add(turn, site);
            sites.push(site);
        }
        let mut around = banks.clone();
        self.begun = Some((sites, banks));
        for (turn, site) in seats(others, number).skip(number) {
            around.add(turn, site);
        }
        around.take_turn(number);
        around
    }

    /// Those of the open places that are promising in coarse detail, in their order; one is `kept` in any case. `worth` says
    /// how much a gain counts.
    ///
    /// What is saved by that is worth more in presses: sets are chosen by rare touches that are taken for far ones, and
    /// few presses are soon fitted.
    fn promising(
        &self,
        banks: &Banks,
        chosen: usize,
        (open, kept): (&[usize], Option<usize>),
        worth: &dyn Fn(usize, f64) -> f64,
    ) -> Result<Vec<usize>, Cancelled> {
        if open.len() <= PROMISING {
            return Ok(open.to_vec());
        }
        let screened = self.look(&banks.coarse, open, chosen)?;
        let promising = foremost(screened, banks.coarse.error(), (worth, kept), PROMISING);
        let mut places: Vec<usize> = promising.into_iter().map(|p| p.0).collect();
        places.sort_unstable();
        Ok(places)
    }

    /// The promising places for the gauge of a number that is to be exchanged.
    fn promising_for(
        &mut self,
        banks: &Banks,
        (others, number): (&PartialSet, usize),
        here: usize,
    ) -> Result<Vec<usize>, Cancelled> {
        let open = others.open();
        if self.promising.len() <= number {
            self.promising.resize(number + 1, None);
        }
        if let Some(known) = &self.promising[number] {
            let still = |place: &usize| *place == here || open.binary_search(place).is_ok();
            return Ok(known.iter().copied().filter(still).collect());
        }
        // None of the open ones is dearer than what it replaces.
        let gain = |_: usize, gain: f64| gain;
        self.promising(banks, others.chosen.len(), (&open, Some(here)), &gain)
    }

    /// The criterion (mm) with the gauge of a number at some places more; where gauges may be lost, at those of them that
    /// are promising without that.
    fn scan(
        &self,
        banks: &Banks,
        (others, number): (&[usize], usize),
        (places, kept): (&[usize], Option<usize>),
        worth: &dyn Fn(usize, f64) -> f64,
    ) -> Result<Vec<(usize, f64)>, Cancelled> {
        let errors = self.look(&banks.fine, places, others.len())?;
        match &self.losses {
            None => Ok(errors),
            Some(losses) => {
                // Of those that losses make equal, the best without.
                let promising = foremost(errors, banks.fine.error(), (worth, kept), WITH_LOSSES);
                self.with_losses(losses, (others, number), &promising)
            }
        }
    }

    /// Expected error (mm) with a gauge at each of some places more, and none lost.
    fn look(
        &self,
        bank: &Bank,
        places: &[usize],
        chosen: usize,
    ) -> Result<Vec<(usize, f64)>, Cancelled> {
        let step = (chosen, self.request.constraints.sensors);
        let errors = scan(bank, places, self.request.watch, step)?;
        Ok(places.iter().copied().zip(errors).collect())
    }

    /// The criterion (mm) at places of which the error with all gauges is known.
    fn with_losses(
        &self,
        losses: &Losses,
        (others, number): (&[usize], usize),
        whole: &[(usize, f64)],
    ) -> Result<Vec<(usize, f64)>, Cancelled> {
        let scene = self.scene_of(losses);
        let places: Vec<usize> = whole.iter().map(|w| w.0).collect();
        let after = |lost: &Vec<usize>| -> Result<Vec<f64>, Cancelled> {
            self.report(others.len())?;
            let mut bank = left(scene, seats(others, number), lost);
            if lost.contains(&number) {
                return Ok(vec![bank.error(); whole.len()]);
            }
            bank.take_turn(number);
            let mut rows = bank.rows();
            Ok(bank.with(&places, &mut rows))
        };
        let all = losses.all(others.len() + 1);
        let errors: Result<Vec<Vec<f64>>, Cancelled> = all.par_iter().map(after).collect();
        let errors = errors?;
        let weighed = whole.iter().enumerate().map(|(k, &(place, whole))| {
            let lost = errors.iter().map(|after| after[k]);
            (place, self.request.constraints.weighed(whole, lost))
        });
        Ok(weighed.collect())
    }

    fn report(&self, chosen: usize) -> Result<(), Cancelled> {
        let wanted = self.request.constraints.sensors;
        report(self.request.watch, SELECTING, chosen.min(wanted), wanted)
    }

    /// What a set is expected to do when gauges are lost, in words; nothing where none may be.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn losses_note(&self, set: &[usize]) -> Result<Option<String>, Cancelled> {
        let constraints = self.request.constraints;
        let Some(losses) = self.losses.as_ref().filter(|_| !set.is_empty()) else {
            return Ok(None);
        };
        let lost = self.expected(set)?.lost;
        // In the detail that losses are looked at in: of another one, losing gauges may seem to help.
        let whole = left(self.scene_of(losses), seats(set, set.len()), &[]).error();
        let mean = lost.iter().sum::<f64>() / lost.len().max(1) as f64;
        let worst = lost.iter().copied().fold(0.0, f64::max);
        let counts = match constraints.loss.by {
            LostBy::Expected => "the mean",
            LostBy::Worst => "the worst",
        };
        Ok(Some(format!(
            "With all gauges {whole:.2} mm; with any {} lost {mean:.2} mm in the mean of {} cases and {worst:.2} mm in the worst. Counted: {counts}, with {:.0} %.",
            losses.gauges.min(set.len()),
            lost.len(),
            100.0 * constraints.failure
        )))
    }
}

impl Criterion for Expectation<'_> {
    const ROUNDED: bool = true;
    const UNIT: &'static str = "mm";

    fn of(&mut self, set: &[usize]) -> Result<f64, PlacementError> {
        Ok(self.error(set)?)
    }

    fn screened(
        &mut self,
        others: &PartialSet,
        number: usize,
    ) -> Result<Vec<(usize, f64)>, PlacementError> {
        let bank = Bank::seated(&self.scenes.coarse, seats(&others.chosen, number));
        Ok(self.look(&bank, &others.open(), others.chosen.len())?)
    }

    /// Compared with what is there in the same look: to rounding, the way a set was added up counts.
    fn better_for(
        &mut self,
        others: &PartialSet,
        (set, number): (&[usize], usize),
        _: f64,
    ) -> Result<Option<(usize, f64)>, PlacementError> {
        let here = set[number];
        let banks = self.around(&others.chosen, number);
        let places = self.promising_for(&banks, (others, number), here)?;
        let gain = |_: usize, gain: f64| gain;
        let places = (&places[..], Some(here));
        let errors = self.scan(&banks, (&others.chosen, number), places, &gain)?;
        self.promising[number] = Some(best_of(&errors, here));
        let now = errors.iter().find(|(place, _)| *place == here);
        let value = now.map_or(f64::INFINITY, |(_, error)| *error);
        let best = errors.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.filter(|(_, error)| gains(value, *error)))
    }

    fn grow<'f>(
        &mut self,
        mut field: PartialSet<'f>,
        found: &dyn Fn(&SensorSet),
    ) -> Result<(PartialSet<'f>, Vec<SensorSet>), PlacementError> {
        let mut banks = Banks::new(self.scenes);
        let mut sets: Vec<SensorSet> = Vec::new();
        let mut before = self.error(&[])?;
        self.promising.clear();
        while !field.full() && !reached(&sets, self.request.constraints) {
            let others = (&field.chosen[..], field.chosen.len());
            let worth = |place: usize, gain: f64| field.worth(place, gain);
            let places = self.promising(&banks, others.1, (&field.open(), None), &worth)?;
            let errors = self.scan(&banks, others, (&places, None), &worth)?;
            let mut best = Best::default();
            for (place, error) in errors {
                best.offer(place, field.worth(place, before - error));
            }
            let Some(place) = best.place() else { break };
            banks.add(field.chosen.len(), place);
            field.add(place);
            before = match self.losses {
                Some(_) => self.error(&field.chosen)?,
                None => banks.fine.error(),
            };
            let set = set_of(self.pool, &field.chosen, before, best.margin());
            found(&set);
            sets.push(set);
        }
        Ok((field, sets))
    }
}

/// The best of some places, rising, and one that stays among them.
fn best_of(errors: &[(usize, f64)], here: usize) -> Vec<usize> {
    let keep = |_: usize, gain: f64| gain;
    let best = foremost(errors.to_vec(), 0.0, (&keep, Some(here)), AGAIN);
    let mut places: Vec<usize> = best.into_iter().map(|p| p.0).collect();
    places.sort_unstable();
    places
}

fn set_of(pool: &Pool, chosen: &[usize], error: f64, margin: Option<f64>) -> SensorSet {
    SensorSet {
        sites: chosen.iter().map(|&p| pool.sites[p]).collect(),
        criterion: Some(error),
        criterion_mm: Some(error),
        gap: None,
        margin,
        certificate: None,
        expected_mm: None,
    }
}

/// The turns and sites of the gauges of a set in which the one of a number is left free.
fn seats(others: &[usize], number: usize) -> impl Iterator<Item = (usize, usize)> {
    let seat = move |(k, &site): (usize, &usize)| (k + usize::from(k >= number), site);
    others.iter().enumerate().map(seat)
}

/// What is left when the gauges of some turns are lost.
fn left<'a>(
    scene: &'a TouchScene,
    seats: impl Iterator<Item = (usize, usize)>,
    lost: &[usize],
) -> Bank<'a> {
    Bank::seated(scene, seats.filter(|(turn, _)| !lost.contains(turn)))
}

/// At most so many of the places, those that promise most for the error (mm) there would be with each, the best first.
fn foremost(
    mut errors: Vec<(usize, f64)>,
    before: f64,
    (worth, kept): (&dyn Fn(usize, f64) -> f64, Option<usize>),
    most: usize,
) -> Vec<(usize, f64)> {
    let rank = |&(place, error): &(usize, f64)| (Some(place) != kept, worth(place, before - error));
    errors.sort_by(|a, b| {
        let ((a_free, a_worth), (b_free, b_worth)) = (rank(a), rank(b));
        let by_worth = b_worth.total_cmp(&a_worth).then(a.0.cmp(&b.0));
        a_free.cmp(&b_free).then(by_worth)
    });
    errors.truncate(most);
    errors
}

/// A set in both details.
#[derive(Clone)]
struct Banks<'a> {
    coarse: Bank<'a>,
    fine: Bank<'a>,
}

impl<'a> Banks<'a> {
    /// No gauge yet.
    fn new(scenes: &'a Scenes) -> Self {
        Self {
            coarse: Bank::new(&scenes.coarse),
            fine: Bank::new(&scenes.fine),
        }
    }

    fn take_turn(&mut self, turn: usize) {
        self.coarse.take_turn(turn);
        self.fine.take_turn(turn);
    }

    /// The gauge of a turn.
    fn add(&mut self, turn: usize, site: usize) {
        self.take_turn(turn);
        self.coarse.add(site);
        self.fine.add(site);
    }
}

/// Expected error (mm) with each of some places more.
pub(super) fn scan(
    bank: &Bank,
    open: &[usize],
    watch: Watch,
    step: (usize, usize),
) -> Result<Vec<f64>, Cancelled> {
    /// Places between two looks at the watch.
    const PIECE: usize = 64;
    let piece = |places: &[usize]| -> Result<Vec<f64>, Cancelled> {
        report(watch, SELECTING, step.0, step.1)?;
        let mut rows: TrialMemory = bank.rows();
        Ok(bank.with(places, &mut rows))
    };
    let pieces: Result<Vec<Vec<f64>>, Cancelled> = open.par_chunks(PIECE).map(piece).collect();
    Ok(pieces?.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauge_looked_at_again_keeps_its_place_and_the_best_others() {
        let errors: Vec<(usize, f64)> = (0..100).map(|k| (k, (k as f64 - 50.0).abs())).collect();
        let places = best_of(&errors, 3);
        assert_eq!(places.len(), AGAIN);
        assert_eq!(places[0], 3);
        let others: Vec<usize> = (50 - 11..50 + 12).collect();
        assert_eq!(places[1..], others);
    }
}
