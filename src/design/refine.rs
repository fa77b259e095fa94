//! Gauges moved off the lattice of sites, along the surface and by their angle, to where the criterion that chose them is
//! least.
//!
//! A pattern search within a reach of each gauge's own (V. Torczon, On the convergence of pattern search algorithms,
//! SIAM J. Optim. 7, 1997), in rounds. Moves of every gauge are first tried on a model of it: what it reads changes to
//! first order with its place, and with its angle as strain turns. The best that promises something is then computed
//! by the elastic model, where the gauge would be, and taken if the criterion falls; else the gauge's reach is halved.
//! What a gauge reads depends on no other gauge, so that one solution serves all moves of a round, and each is weighed
//! against the others as they are then.
//!
//! A fine lattice already follows the few presses that a choice looks at: on half the spacing the criterion of a Draft
//! falls by 4 % and what the judge finds does not. A move must therefore gain on many more presses too, with noise of
//! their own ([`FINE`]).
//!
//! It costs one factorization, and a round seven right-hand sides a gauge that still moves: for ten gauges two blocks of
//! 64, so at most 26 blocks in [`ROUNDS`] and to begin with, where the simulation of 4000 touches took 63.

mod room;

use std::sync::Arc;

use glam::DVec3;

use self::room::GaugeRoom;
use super::known::{FINE, KnownSimulation, detail};
use super::{Choosing, DesignError, DesignRequest, ReducedSites, Simulated};
use crate::budget::{Cancelled, Watch, Work, report};
use crate::dataset::{Move, Signal, Site, Surveyed, survey};
use crate::elasticity::Touch;
use crate::elasticity::respond::PressedModel;
use crate::gauge::Gauge;
use crate::placement::expected_error::{Moving, NUISANCES};
use crate::placement::{Constraints, Selection, SensorSet};
use crate::uncertainty::Making;
use crate::units;

const REFINING: &str = "Refining places";
/// Most rounds.
const ROUNDS: usize = 12;
/// How far a gauge may first be moved, as a share of the distance of sites, and turned.
const FIRST_STEP: f64 = 0.5;
const FIRST_TURN: f64 = 16.0;
/// Below both of these it rests (m, degrees): a workshop hits no place better.
const LEAST_STEP: f64 = 1e-4;
const LEAST_TURN: f64 = 1.0;
/// Share of the criterion that a move must gain.
const LEAST: f64 = 1e-4;
/// Ways that a gauge is tried to be moved in.
const WAYS: usize = 8;
/// Moves that are tried: every way unturned and turned either way, and turned on the spot.
const MOVES: usize = 3 * WAYS + 2;
/// Whose noise the presses that confirm a move have.
const CONFIRM_SEED: u64 = 0xc0f1;

/// Moves the gauges of the largest set of a choice by expected error to where it is expected to err least; gauges that
/// must be there stay. The simulation with these gauges off its lattice, which the set's sites are numbers of.
///
/// # Errors
/// [`DesignError`] when the watch asks for a stop, and as for the design's simulation.
pub fn refine(
    asked: &DesignRequest,
    simulated: Arc<Simulated>,
    reduced: &ReducedSites,
    selection: &mut Selection,
    watch: Watch,
) -> Result<Arc<Simulated>, DesignError> {
    let Some(set) = selection.sets.last_mut() else {
        return Ok(simulated);
    };
    let notes = &mut selection.achieved.notes;
    if simulated.dataset.signal != Signal::Strain {
        notes.push(
            "Places were not refined (selection.refine): only strain gauges are moved off the sites.".into(),
        );
        return Ok(simulated);
    }
    let from = asked.choosing(&simulated, reduced, watch);
    let refined = search(&from, &set.sites)?;
    selection.achieved.effort += refined.work;
    let moved: Vec<&MovingGauge> = refined.gauges.iter().filter(|g| g.moved).collect();
    if moved.is_empty() {
        notes.push("Refining places: none off the sites was better.".into());
        return Ok(simulated);
    }
    notes.push(refined.words(moved.len()));
    refined.put_into(set, simulated.lattice);
    selection.achieved.error_estimate = set.criterion;
    let gauges: Vec<&Surveyed> = moved.iter().map(|g| &g.now).collect();
    let whole = Arc::unwrap_or_clone(simulated).with_gauges(&gauges, watch)?;
    Ok(Arc::new(whole))
}

/// One gauge on its way.
struct MovingGauge {
    now: Surveyed,
    /// Where it was on the lattice.
    from: Gauge,
    /// Of the first step and turn, the share that it may be moved by now.
    reach: f64,
    moved: bool,
}

/// What came of it.
struct Refined {
    gauges: Vec<MovingGauge>,
    before_mm: f64,
    after_mm: f64,
    /// Where one place is meant.
    local_mm: f64,
    work: Work,
}

impl Refined {
    fn words(&self, moved: usize) -> String {
        let all = || self.gauges.iter().filter(|g| g.moved);
        let way = |g: &MovingGauge| units::mm(g.now.site.gauge.position.distance(g.from.position));
        let turn = |g: &MovingGauge| {
            let cos = g.now.site.gauge.direction.dot(g.from.direction);
            cos.abs().min(1.0).acos().to_degrees()
        };
        format!(
            "{moved} of {} gauges were moved off the sites, by {:.1} mm and {:.0}° at most: {:.2} mm instead of {:.2}. A certificate is of the sites, and sets of fewer gauges stay on them.",
            self.gauges.len(),
            all().map(way).fold(0.0, f64::max),
            all().map(turn).fold(0.0, f64::max),
            self.after_mm,
            self.before_mm
        )
    }

    /// The gauges that moved come after the sites of the lattice, in the order of the set.
    fn put_into(&self, set: &mut SensorSet, lattice: usize) {
        let moved = (self.gauges.iter().enumerate()).filter(|(_, g)| g.moved);
        for (place, (k, _)) in moved.enumerate() {
            set.sites[k] = lattice + place;
        }
        set.criterion = Some(self.after_mm);
        set.criterion_mm = Some(self.after_mm);
        // What was said of the choice of sites.
        (set.gap, set.margin) = (None, None);
        set.certificate = set.certificate.map(|c| c.refined(self.local_mm));
    }
}

fn search(from: &Choosing, set: &[usize]) -> Result<Refined, DesignError> {
    let Choosing {
        inputs,
        simulated,
        reduced,
        budget,
        watch,
    } = *from;
    let keys = &inputs.project.selection;
    let known = KnownSimulation::new(inputs, simulated);
    // Of gauges that move it is told seat by seat.
    let unasked = |_: usize, _: usize| 0.0;
    let shared = known.shared(&|_, _| [0.0; NUISANCES]);
    let own = known.knowledge(&unasked, &shared);
    let mut confirmed = known.knowledge(&unasked, &shared);
    confirmed.seed = own.seed.wrapping_add(CONFIRM_SEED);
    let constraints = Constraints {
        failure: keys.failure,
        loss: keys.loss(),
        ..Constraints::count(set.len())
    };
    let whole = Constraints::count(set.len());
    let (x, targets) = (&reduced.x, simulated.dataset.targets_mm());
    let seats = set.len();
    let criterion = Moving::new(
        x,
        &targets,
        &own,
        (detail(budget), seats + MOVES),
        &constraints,
        watch,
    )?;
    let confirming = Moving::new(x, &targets, &confirmed, (FINE, seats + 1), &whole, watch)?;
    let model = simulated.meshed.model(watch)?;
    let pressed = PressedModel::new(&*model, &simulated.dataset.touches);
    let chosen: Vec<Gauge> = set
        .iter()
        .map(|&s| simulated.dataset.sites[s].gauge)
        .collect();
    let making = inputs.project.uncertainty().making_allowed();
    let made = (&simulated.dataset.touches[..], &making);
    let (surveyed, solves) = survey(&pressed, &chosen, made, watch)?;
    let mut work = model.system().work();
    work.solves += solves as u64;
    let gauges = surveyed
        .into_iter()
        .zip(&chosen)
        .map(|(now, from)| MovingGauge {
            now,
            from: *from,
            reach: 1.0,
            moved: false,
        });
    let mut search = RefineSearch {
        room: GaugeRoom::new(inputs, simulated),
        known: &known,
        pressed: &pressed,
        made,
        gauges: gauges.collect(),
        fixed: keys.required_mm.len(),
        criterion,
        confirming,
        mm: [0.0; 2],
        round: 0,
        work,
        watch,
    };
    search.run()
}

struct RefineSearch<'a> {
    room: GaugeRoom<'a>,
    known: &'a KnownSimulation<'a>,
    pressed: &'a PressedModel<'a>,
    /// The touches that are pressed, and how far off they are made.
    made: (&'a [Touch], &'a Making),
    gauges: Vec<MovingGauge>,
    /// How many of them, the first, must stay where they are.
    fixed: usize,
    /// What the gauges were chosen by; seats beyond theirs are for moves that are tried.
    criterion: Moving<'a>,
    /// The same on many presses, none lost.
    confirming: Moving<'a>,
    /// Of the gauges as they are, by either (mm).
    mm: [f64; 2],
    round: usize,
    work: Work,
    watch: Watch<'a>,
}

impl RefineSearch<'_> {
    fn run(&mut self) -> Result<Refined, DesignError> {
        for k in 0..self.gauges.len() {
            self.sit(k);
        }
        let set: Vec<usize> = (0..self.gauges.len()).collect();
        self.mm = self.errors(&set)?;
        let before_mm = self.mm[0];
        for round in 0..ROUNDS {
            self.round = round;
            if !(self.fixed..self.gauges.len()).any(|k| self.goes_on(k)) {
                break;
            }
            self.try_all()?;
        }
        Ok(Refined {
            local_mm: self.criterion.local(&set),
            gauges: std::mem::take(&mut self.gauges),
            before_mm,
            after_mm: self.mm[0],
            work: self.work,
        })
    }

    fn goes_on(&self, k: usize) -> bool {
        let [step, turn] = self.reach(k);
        step >= LEAST_STEP || turn >= LEAST_TURN.to_radians()
    }

    /// How far a gauge may be moved (m) and turned (radians) now.
    fn reach(&self, k: usize) -> [f64; 2] {
        let reach = self.gauges[k].reach;
        let step = FIRST_STEP * self.room.spacing;
        [reach * step, reach * FIRST_TURN.to_radians()]
    }

    /// Every gauge that goes on is moved once, or may be moved half as far from now on.
    fn try_all(&mut self) -> Result<(), DesignError> {
        let mut asked = Vec::new();
        for k in self.fixed..self.gauges.len() {
            if !self.goes_on(k) {
                continue;
            }
            self.report()?;
            match self.promising(k) {
                Some(site) => asked.push((k, site)),
                None => self.gauges[k].reach /= 2.0,
            }
        }
        if asked.is_empty() {
            return Ok(());
        }
        let gauges: Vec<Gauge> = asked.iter().map(|(_, site)| site.gauge).collect();
        let (found, solves) = survey(self.pressed, &gauges, self.made, self.watch)?;
        self.work.solves += solves as u64;
        let sites: Vec<Site> = found.iter().map(|gauge| gauge.site).collect();
        let allowed = self.room.allowed_wholly(&sites, self.watch)?;
        for (((k, _), gauge), allowed) in asked.into_iter().zip(found).zip(allowed) {
            let clear = allowed && self.keeps_clear(k, gauge.site.gauge.position);
            if !(clear && self.takes(k, gauge)?) {
                self.gauges[k].reach /= 2.0;
            }
        }
        Ok(())
    }

    /// The move of a gauge that promises most, where one promises anything.
    fn promising(&mut self, k: usize) -> Option<Site> {
        let now = self.gauges[k].now.site;
        let [step, turn] = self.reach(k);
        let moves = moves(step, turn).into_iter();
        let tried: Vec<(Move, Site)> = moves
            .filter_map(|to| Some((to, self.room.moved(&now, to)?)))
            .filter(|(_, site)| self.keeps_clear(k, site.gauge.position))
            .collect();
        let sites: Vec<Site> = tried.iter().map(|(_, site)| *site).collect();
        let allowed = self.room.allowed(&sites);
        let tried: Vec<(Move, Site)> = (tried.into_iter().zip(allowed))
            .filter_map(|(tried, allowed)| allowed.then_some(tried))
            .collect();
        let count = self.gauges.len();
        let mut seats = vec![k];
        for (seat, (to, _)) in (count..).zip(&tried) {
            let gauge = &self.gauges[k].now;
            let x = gauge.after(*to);
            seat_in(&mut self.criterion, self.known, seat, &x, gauge);
            seats.push(seat);
        }
        let set: Vec<usize> = (0..count).collect();
        let errors = self.criterion.with_each(&set, k, &seats);
        let (here, there) = errors.split_first()?;
        let best = (tried.iter().zip(there)).min_by(|a, b| a.1.total_cmp(b.1))?;
        (*best.1 < here * (1.0 - LEAST)).then_some(best.0.1)
    }

    /// Whether a gauge may go to a place (m) for all that the others, and what it costs, have to say.
    fn keeps_clear(&self, k: usize, to: DVec3) -> bool {
        let from = self.gauges[k].now.site.gauge.position;
        let mut others = (self.gauges.iter().enumerate()).filter(|(other, _)| *other != k);
        others.all(|(_, other)| {
            self.room
                .keeps_apart(from, to, other.now.site.gauge.position)
        }) && self.room.is_no_dearer(self.gauges[k].from.position, to)
    }

    /// Puts a gauge in the stead of another if the set gains by it.
    fn takes(&mut self, k: usize, gauge: Surveyed) -> Result<bool, DesignError> {
        let count = self.gauges.len();
        for moving in [&mut self.criterion, &mut self.confirming] {
            seat_in(moving, self.known, count, &gauge.x, &gauge);
        }
        let with: Vec<usize> = (0..count).map(|g| if g == k { count } else { g }).collect();
        let [own, confirmed] = self.errors(&with)?;
        let gains = own < self.mm[0] * (1.0 - LEAST) && confirmed < self.mm[1];
        if gains {
            self.mm = [own, confirmed];
            self.gauges[k].now = gauge;
            self.gauges[k].moved = true;
            self.sit(k);
        }
        Ok(gains)
    }

    /// The gauge of a number takes its own seat as it is now.
    fn sit(&mut self, k: usize) {
        let gauge = &self.gauges[k].now;
        for moving in [&mut self.criterion, &mut self.confirming] {
            seat_in(moving, self.known, k, &gauge.x, gauge);
        }
    }

    fn errors(&self, set: &[usize]) -> Result<[f64; 2], DesignError> {
        let report = || self.report();
        Ok([
            self.criterion.error(set, &report)?,
            self.confirming.error(set, &report)?,
        ])
    }

    fn report(&self) -> Result<(), Cancelled> {
        report(self.watch, REFINING, self.round, ROUNDS)
    }
}

/// Puts a gauge into a seat that reads `x`, and is off as `like` is.
fn seat_in(moving: &mut Moving, known: &KnownSimulation, seat: usize, x: &[f64], like: &Surveyed) {
    let variance = |touch: usize| known.variance_of(x[touch], Some(&like.slopes), 0, touch);
    let felt = |touch: usize| known.felt_of(&like.making, 0, touch);
    moving.seat(seat, x, &variance, &felt);
}

/// All moves of a length (m) and an angle (radians): on a circle, unturned and turned, and turned alone.
fn moves(step: f64, turn: f64) -> Vec<Move> {
    let way = |way: usize, turn: f64| {
        let (sin, cos) = (std::f64::consts::TAU * way as f64 / WAYS as f64).sin_cos();
        Move {
            along: step * cos,
            across: step * sin,
            turn,
        }
    };
    let still = |turn: f64| Move {
        along: 0.0,
        across: 0.0,
        turn,
    };
    let ways = [0.0, turn, -turn].into_iter();
    let moved = ways.flat_map(|turn| (0..WAYS).map(move |w| (w, turn)));
    let moved = moved.map(|(w, turn)| way(w, turn));
    moved.chain([still(turn), still(-turn)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_is_as_long_as_the_others() {
        let all = moves(2e-3, 0.1);
        assert_eq!(all.len(), MOVES);
        for to in &all {
            let way = to.along.hypot(to.across);
            let still = way == 0.0 && to.turn != 0.0;
            assert!(still || (way - 2e-3).abs() < 1e-15, "{to:?}");
            assert!(to.turn == 0.0 || to.turn.abs() == 0.1);
        }
        let around: f64 = all.iter().map(|to| to.along + to.across + to.turn).sum();
        assert!(around.abs() < 1e-15);
    }
}
