//! One more gauge: all open places scored by ever dearer scores, the last few exactly.

use rayon::prelude::*;

use super::exact::{ExactFits, JudgedFits};
use super::race::{RaceRules, Raced, Relation, Scored, race};
use super::screen::{GiveUp, LEVELS, ScreenBase, Sieve};
use super::settings::GreedySvr;
use crate::budget::{Cancelled, Progress, Work, report};
use crate::dataset::SignalMatrix;
use crate::placement::constraints::PartialSet;
use crate::placement::{PlacementError, Pool, SelectionRequest};
use crate::regression::features::Standardizer;
use crate::regression::folds::Folds;
use crate::regression::kernel;

/// Two candidates whose criteria differ by less than this share are tied; the lower place wins.
pub const TIE: f64 = 1e-9;
/// Candidates that go to each further score at once, and how many of them only to see how far the scores
/// depart: the cheapest score departs most.
const BATCHES: [(usize, usize); 3] = [(12, 4), (6, 2), (4, 2)];
/// Departure of a score that has not been compared yet.
const UNKNOWN: f64 = 0.01;

/// What one step found.
pub(super) struct GreedyStep {
    pub(super) place: usize,
    pub(super) error: f64,
    /// Share by which a better choice may still exist.
    pub(super) gap: f64,
    /// How far the next best is behind, as a share of the criterion.
    pub(super) margin: Option<f64>,
}

pub(super) struct GreedySearch<'a> {
    pub(super) settings: &'a GreedySvr,
    pub(super) request: &'a SelectionRequest<'a>,
    /// Standardized signals, places × touches in the order of the folds.
    pub(super) features: SignalMatrix,
    pub(super) constant: Vec<usize>,
    pub(super) judge: ExactFits<'a>,
    pub(super) sieves: Vec<Sieve>,
    /// The set chosen so far, and when failures are expected the same without each of its sites.
    pub(super) base: ScreenBase,
    pub(super) without: Vec<ScreenBase>,
    /// exp(-γ d²) over the chosen sites, touches × touches.
    pub(super) kernel: Vec<f64>,
    /// How each score related to the next in the last step.
    pub(super) relations: Vec<Relation>,
    pub(super) widest: f64,
    /// Whether this step's sets are hardly told apart: races are cut off then.
    pub(super) indistinct: bool,
    pub(super) exactly: usize,
    pub(super) converged: bool,
    pub(super) work: Work,
}

/// What a step knows of the candidates that it has not taken.
pub(super) struct SeenCandidates {
    /// Left behind, by the level of their score.
    pub(super) waiting: Vec<(usize, Scored)>,
    /// Fitted exactly.
    pub(super) compared: Vec<Scored>,
    /// How each score relates to the next.
    pub(super) relations: Vec<Relation>,
}

/// A candidate fitted exactly, with the kernel it was fitted on.
pub(super) struct Finalist {
    pub(super) place: usize,
    pub(super) judged: JudgedFits,
}

impl<'a> GreedySearch<'a> {
    pub(super) fn new(
        settings: &'a GreedySvr,
        pool: &'a Pool<'a>,
        request: &'a SelectionRequest<'a>,
        folds: &'a Folds,
    ) -> Self {
        let n = pool.targets.len();
        let standardizer = Standardizer::of(pool.x);
        let features = standardizer.apply(pool.x).select_columns(&folds.order);
        let targets: Vec<[f64; 3]> = folds.order.iter().map(|&t| pool.targets[t]).collect();
        let sieves: Vec<Sieve> = LEVELS
            .iter()
            .map(|&level| Sieve::new(level.scaled(settings.landmarks), &features, &targets, folds))
            .collect();
        Self {
            settings,
            request,
            features,
            constant: standardizer.constant_rows(),
            judge: ExactFits::new(settings.hyper, settings.effort, pool.targets, folds),
            base: ScreenBase::empty(&sieves),
            without: Vec::new(),
            sieves,
            kernel: vec![1.0; n * n],
            relations: Vec::new(),
            widest: 0.0,
            indistinct: false,
            exactly: 0,
            converged: true,
            work: Work::default(),
        }
    }

    /// The best place to add, taken; none when nothing may be added any more.
    pub(super) fn best_addition(
        &mut self,
        field: &PartialSet,
    ) -> Result<Option<GreedyStep>, PlacementError> {
        let open = field.open();
        if open.is_empty() {
            return Ok(None);
        }
        let before = self.base.error;
        let worth = |s: Scored| field.worth(s.place, before - s.error);
        let last = LEVELS.len() - 1;
        let mut left: Vec<(usize, Vec<Scored>)> = Vec::new();
        let mut scored = self.scores(0, &open, field.chosen.len())?;
        let promised = scored.iter().map(|s| s.error).fold(f64::INFINITY, f64::min);
        self.indistinct = self.settings.is_indistinct(promised);
        let mut relations = Vec::new();
        for level in 1..=last {
            let (batch, audits) = BATCHES[level - 1];
            let rules = self.rules(level - 1, batch, audits);
            let Raced {
                scored: next,
                rest,
                relation,
            } = race(&scored, &rules, &worth, |places| {
                self.scores(level, places, field.chosen.len())
                    .map(|s| s.iter().map(|s| s.error).collect())
            })?;
            left.push((level - 1, rest));
            relations.push(relation);
            scored = next;
        }
        let (winner, raced) = self.final_race(&scored, &worth, field.chosen.len())?;
        relations.push(raced.relation);
        left.push((last, raced.rest));
        let waiting = left
            .into_iter()
            .flat_map(|(level, rest)| rest.into_iter().map(move |s| (level, s)));
        self.exactly += raced.scored.len();
        let mut seen = SeenCandidates {
            waiting: waiting.collect(),
            compared: raced.scored,
            relations,
        };
        let step = field.chosen.len();
        let winner = if self.indistinct {
            winner
        } else {
            self.second_look(winner, &mut seen, &worth, step)?
        };
        let SeenCandidates {
            waiting,
            compared,
            relations,
        } = seen;
        let stop = || self.stopped(field.chosen.len());
        let own = self.expected(last, winner.place, winner.judged.error, &stop);
        let gap = waiting
            .iter()
            .map(|(level, s)| 1.0 - least_of(&relations[*level..], s.error) / own)
            .fold(0.0, f64::max);
        self.widest = self.widest.max(relations[last].deviation);
        let place = winner.place;
        let estimated = |(level, s): &(usize, Scored)| Scored {
            error: s.error * relations[*level..].iter().map(|r| r.ratio).product::<f64>(),
            ..*s
        };
        let rivals = compared.into_iter().filter(|s| s.place != place);
        let own_worth = worth(Scored { place, error: own });
        let margin = (rivals.chain(waiting.iter().map(estimated)))
            .map(|s| ((own_worth - worth(s)) / own).max(0.0))
            .min_by(f64::total_cmp);
        self.relations = relations;
        self.take(winner);
        self.refine(&[&field.chosen[..], &[place]].concat());
        Ok(Some(GreedyStep {
            place,
            error: own,
            gap,
            margin,
        }))
    }

    pub(super) fn rules(&self, from: usize, batch: usize, audits: usize) -> RaceRules {
        let seen = |k: usize| self.relations.get(k).map_or(UNKNOWN, |r| r.deviation);
        let later: f64 = (from + 1..LEVELS.len()).map(|k| seen(k).powi(2)).sum();
        RaceRules {
            least: batch,
            batch,
            audits,
            least_deviation: self.relations.get(from).map_or(0.0, |r| 0.5 * r.deviation),
            slack: later.sqrt(),
            most: self.most(from),
        }
    }

    /// Candidates that a race onto a level (the last: exact fits) may score at most.
    fn most(&self, level: usize) -> usize {
        /// Where sets are hardly told apart: nobody waits for a proof that there is no better one, and the gap says so.
        const MOST: [usize; LEVELS.len()] = [48, 24, 12, 6];
        if self.indistinct {
            MOST[level]
        } else {
            usize::MAX
        }
    }

    /// Scores on one level.
    pub(super) fn scores(
        &self,
        level: usize,
        places: &[usize],
        step: usize,
    ) -> Result<Vec<Scored>, Cancelled> {
        places
            .par_iter()
            .map(|&place| {
                self.report(step)?;
                let hyper = &self.settings.hyper;
                let stop = || self.stopped(step);
                let error = self.base.score(&self.sieves, level, place, hyper, &stop);
                let error = self.expected(level, place, error, &stop);
                // What was given up midway is no score.
                self.report(step)?;
                Ok(Scored { place, error })
            })
            .collect()
    }

    /// The criterion when one gauge of the set may have failed: the chance of it weighs what is left of the set.
    pub(super) fn expected(&self, level: usize, place: usize, error: f64, stop: GiveUp) -> f64 {
        let constraints = self.request.constraints;
        let hyper = &self.settings.hyper;
        let others = self.without.iter();
        let others = others.map(|base| base.score(&self.sieves, level, place, hyper, stop));
        constraints.weighed(error, others.chain(std::iter::once(self.base.error)))
    }

    /// Exact fits of the most promising until no other can be better by more than the tolerance, or the race is cut off.
    pub(super) fn final_race(
        &mut self,
        scored: &[Scored],
        worth: &dyn Fn(Scored) -> f64,
        step: usize,
    ) -> Result<(Finalist, Raced), PlacementError> {
        let mut rules = self.rules(LEVELS.len() - 1, 1, 0);
        rules.least = 3;
        rules.slack = -self.settings.tolerance;
        let mut best: Option<(f64, Finalist)> = None;
        let mut extended = vec![0.0; self.kernel.len()];
        let mut compared = 0;
        let raced = race(scored, &rules, worth, |places| {
            let mut errors = Vec::with_capacity(places.len());
            for &place in places {
                let finalist = self.finalist(place, step, &mut extended)?;
                compared += 1;
                let stop = || self.stopped(step);
                let exact = finalist.judged.error;
                let error = self.expected(LEVELS.len() - 1, place, exact, &stop);
                errors.push(error);
                let value = worth(Scored { place, error });
                let wins = best.as_ref().is_none_or(|(b, f)| {
                    value > b + TIE * b.abs() || (value >= b - TIE * b.abs() && place < f.place)
                });
                if wins {
                    best = Some((value, finalist));
                }
            }
            Ok(errors)
        })?;
        self.work += self.fitted(compared);
        let (_, winner) = best.ok_or(PlacementError::NoSites)?;
        Ok((winner, raced))
    }

    /// Looks again at what was left behind, now that it is known how far all scores depart, until nothing
    /// of it can be better than the winner by more than the tolerance.
    pub(super) fn second_look(
        &mut self,
        mut winner: Finalist,
        seen: &mut SeenCandidates,
        worth: &dyn Fn(Scored) -> f64,
        step: usize,
    ) -> Result<Finalist, PlacementError> {
        /// Looks, and places scored at once.
        const MOST: usize = 32;
        const BATCH: usize = 8;
        let SeenCandidates {
            waiting,
            compared,
            relations,
        } = seen;
        let last = LEVELS.len() - 1;
        let mut extended = vec![0.0; self.kernel.len()];
        for _ in 0..MOST {
            let stop = || self.stopped(step);
            let own = self.expected(last, winner.place, winner.judged.error, &stop);
            let bar = worth(Scored {
                place: winner.place,
                error: own * (1.0 - self.settings.tolerance),
            });
            let hope = |(level, s): &(usize, Scored)| {
                let error = least_of(&relations[*level..], s.error);
                let value = worth(Scored { error, ..*s });
                if value.is_nan() {
                    f64::NEG_INFINITY
                } else {
                    value
                }
            };
            waiting.sort_by(|a, b| hope(b).total_cmp(&hope(a)).then(a.1.place.cmp(&b.1.place)));
            let hopeful = waiting.iter().take_while(|w| hope(w) > bar).count();
            if hopeful == 0 {
                break;
            }
            if waiting[0].0 < last {
                let far: Vec<usize> = (0..hopeful)
                    .filter(|&k| waiting[k].0 < last)
                    .take(BATCH)
                    .collect();
                let places: Vec<usize> = far.iter().map(|&k| waiting[k].1.place).collect();
                for (k, scored) in far.into_iter().zip(self.scores(last, &places, step)?) {
                    waiting[k] = (last, scored);
                }
                continue;
            }
            let (_, scored) = waiting.remove(0);
            let finalist = self.finalist(scored.place, step, &mut extended)?;
            let stop = || self.stopped(step);
            let error = self.expected(last, scored.place, finalist.judged.error, &stop);
            let relation = &mut relations[last];
            let departed = (error / (scored.error * relation.ratio) - 1.0).abs();
            relation.deviation = relation.deviation.max(departed);
            self.exactly += 1;
            compared.push(Scored {
                place: scored.place,
                error,
            });
            self.work += self.fitted(1);
            let value = |place, error| worth(Scored { place, error });
            if value(scored.place, error) > value(winner.place, own) {
                winner = finalist;
            }
        }
        Ok(winner)
    }

    /// The work of so many exact fits.
    pub(super) fn fitted(&self, sets: usize) -> Work {
        Work {
            kernel_evaluations: (sets * self.kernel.len()) as u64,
            fits: (sets * 3 * self.judge.folds.parts.len()) as u64,
            ..Work::default()
        }
    }

    pub(super) fn finalist(
        &self,
        place: usize,
        step: usize,
        extended: &mut [f64],
    ) -> Result<Finalist, Cancelled> {
        self.report(step)?;
        let hyper = &self.settings.hyper;
        let row = self.features.row(place);
        kernel::extend(&self.kernel, row, row, hyper.gamma, extended);
        let stop = || self.stopped(step);
        let (_, state) = self.base.nearly(&self.sieves, place, hyper, &stop);
        let beta = faer::Scale(-self.base.rho(hyper)) * &state.u;
        let progress = self.progress(step);
        let judged = self
            .judge
            .judge(extended, Some(&beta), progress, self.request.watch)?;
        Ok(Finalist { place, judged })
    }

    pub(super) fn take(&mut self, winner: Finalist) {
        let Finalist { place, judged } = winner;
        let hyper = self.settings.hyper;
        let row = self.features.row(place);
        let mut extended = vec![0.0; self.kernel.len()];
        kernel::extend(&self.kernel, row, row, hyper.gamma, &mut extended);
        self.kernel = extended;
        self.converged &= judged.converged;
        let (residuals, beta) = judged.matrices();
        let grown = self
            .base
            .with(&self.sieves, place, &hyper, (judged.error, residuals, beta));
        let before = std::mem::replace(&mut self.base, grown);
        if self.request.constraints.failure > 0.0 {
            self.without = self
                .without
                .par_iter()
                .map(|base| {
                    let (error, state) = base.nearly(&self.sieves, place, &hyper, &|| false);
                    let beta = faer::Scale(-base.rho(&hyper)) * &state.u;
                    base.with(&self.sieves, place, &hyper, (error, state.z, beta))
                })
                .collect();
            self.without.push(before);
        }
    }

    /// Takes more landmarks on the levels whose scores departed too far from the next.
    pub(super) fn refine(&mut self, chosen: &[usize]) {
        let gamma = self.settings.hyper.gamma;
        for level in 0..LEVELS.len() {
            let sieve = &mut self.sieves[level];
            if self.relations[level].deviation <= sieve.level.aim || !sieve.refine() {
                continue;
            }
            self.base.renew(sieve, level, chosen, gamma);
            for (k, base) in self.without.iter_mut().enumerate() {
                let mut others = chosen.to_vec();
                others.remove(k);
                base.renew(sieve, level, &others, gamma);
            }
        }
    }

    pub(super) fn progress(&self, step: usize) -> Progress {
        Progress {
            stage: "Selecting by greedy SVR",
            done: step,
            total: self.request.constraints.sensors,
        }
    }

    pub(super) fn report(&self, step: usize) -> Result<(), Cancelled> {
        let Progress { stage, done, total } = self.progress(step);
        report(self.request.watch, stage, done, total)
    }

    pub(super) fn stopped(&self, step: usize) -> bool {
        self.report(step).is_err()
    }
}

/// The least that the criterion may be for a score, through all relations from it to the criterion.
fn least_of(relations: &[Relation], error: f64) -> f64 {
    let ratio: f64 = relations.iter().map(|r| r.ratio).product();
    let deviation = relations
        .iter()
        .map(|r| r.deviation.powi(2))
        .sum::<f64>()
        .sqrt();
    Relation { ratio, deviation }.least(error)
}
