//! Sets of gauges judged by what runs live: the design's elastic model, matched to what a finer one reads.
//!
//! The estimator knows what the reference was made with (`Reference::off`), as live touch does: as drawn, that gauges are glued
//! just so; as built, how far off a workshop usually glues them; after known presses, how these gauges were really
//! glued, as far as the presses tell.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::budget::{Budget, Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::design::drawn::{MOVES, POINT, drawn_on, map_size};
use crate::design::known;
use crate::design::reference::{Reference, noisy, noisy_means};
use crate::design::{DesignError, Ground, Inputs, Simulated};
use crate::draw::normal;
use crate::elasticity::{Model, Touch};
use crate::evaluation::failures::{Draw, FailureRow, MOST_FAILED};
use crate::evaluation::{
    Candidate, Evaluation, Failures, Judging, JudgingForces, Matched, is_largest,
};
use crate::gauge::Gauge;
use crate::inference::calibration::SAMPLES;
use crate::inference::{AsDrawn, Deviations, KnownPress, Matching, ReadingErrors, calibrate};
use crate::mesh::TriMesh;
use crate::placement::expected_error::BLIND;
use crate::regression::folds::evenly;
use crate::statistics::mean;
use crate::uncertainty::{Gluing, Making, Uncertainty};
use crate::units;

/// Sites whose readings are known everywhere at the same time: those of more sets would fill the memory.
const MOST_SITES: usize = 60;
/// Touches that sets with lost gauges are judged on.
const FAILURE_TOUCHES: usize = 200;

/// Which draw the noise of the known presses is; then come two for each force, as drawn and as built.
const PRESS_DRAW: u64 = 4;
const FIRST_DRAW: u64 = 5;

/// Of what all channels drift by together.
const DRIFT_SEED: u64 = 0xd21f7;

/// What sets are judged with.
pub(in crate::design) struct ByMatching<'a> {
    pub inputs: &'a Inputs,
    pub simulated: &'a Simulated,
    pub reference: &'a Reference,
    /// Numbers of the streams of noise, one for each site of the reference.
    pub streams: &'a [u64],
    pub forces: &'a JudgingForces,
    pub budget: &'a Budget,
}

/// Readings of all sites of the reference under touches of one force, with noise.
struct Readings {
    force_n: f64,
    drawn: SignalMatrix,
    built: SignalMatrix,
}

/// What the gauges at some sites read of touches anywhere, by the design's model.
struct Everywhere {
    /// Of the reference, rising: a channel each.
    rows: Vec<usize>,
    drawn: AsDrawn,
    /// What gluing and the way touches are made put on the readings.
    deviations: Deviations,
    /// What the latter alone does, where it may be off: gauges that are glued just so have that too.
    made: Option<Deviations>,
}

impl ByMatching<'_> {
    /// Judges sets, each at the force in the middle; the largest of each selector at all forces, after a calibration,
    /// and with gauges lost.
    ///
    /// # Errors
    /// [`DesignError`] as for the design's simulation.
    pub fn judge(&self, sets: &[Candidate], watch: Watch) -> Result<Evaluation, DesignError> {
        let readings = self.readings();
        let middle = &readings[self.forces.middle()];
        let model = self.simulated.model()?;
        let ground = Ground::of(&self.simulated.meshed);
        let size = map_size(&ground, self.tip_radius(), self.budget.map_triangles);
        let mesh = ground.of_size(size);
        let mut work = model.system().work();
        let (mut found, mut failures) = (Vec::new(), Vec::new());
        for group in groups(sets) {
            let everywhere = self.everywhere(&*model, &sets[group.clone()], &mesh, watch)?;
            work.solves += (MOVES * everywhere.rows.len()) as u64;
            for k in group {
                report(watch, "Evaluating", k, sets.len())?;
                let set = MatchedSet::new(self, &everywhere, &sets[k]);
                if !is_largest(sets, k) {
                    found.push(set.found(middle, &[]));
                    continue;
                }
                let calibrated = set.calibrated(&everywhere);
                let all: Vec<Matched> = (readings.iter())
                    .map(|readings| set.found(readings, &calibrated))
                    .collect();
                let whole = &all[self.forces.middle()].errors;
                failures.extend(set.failures(middle, whole, watch)?);
                found.extend(all);
            }
        }
        let judging = Judging::Matching(self.forces.clone());
        Ok(Evaluation {
            failures,
            work,
            ..Evaluation::of_matched(judging, found, &self.reference.regions)
        })
    }

    fn tip_radius(&self) -> f64 {
        self.inputs.project.tip().1
    }

    /// What is known to be off.
    fn off(&self) -> Uncertainty {
        known::off(&self.inputs.project, self.simulated)
    }

    /// Signals of the reference for a force (N) in place of that of its touches: the model is linear.
    fn at_force(&self, x: &SignalMatrix, force_n: f64) -> SignalMatrix {
        x.scaled(force_n / self.inputs.project.tip().0)
    }

    fn readings(&self) -> Vec<Readings> {
        let readings = |(k, &force_n): (u64, &f64)| {
            let with_noise = |x: &SignalMatrix, draw: u64| {
                let x = self.at_force(x, force_n);
                let x = noisy(self.inputs, &x, draw, self.streams).into_owned();
                self.drifted(x, draw)
            };
            Readings {
                force_n,
                drawn: with_noise(&self.reference.x, FIRST_DRAW + 2 * k),
                built: with_noise(&self.reference.workshop, FIRST_DRAW + 2 * k + 1),
            }
        };
        (0..).zip(&self.forces.judged_n).map(readings).collect()
    }

    /// With what all channels have drifted by together, another amount for every touch.
    fn drifted(&self, x: SignalMatrix, draw: u64) -> SignalMatrix {
        let drift = self.off().drift;
        if drift <= 0.0 {
            return x;
        }
        let seed = self.inputs.project.budget.seed;
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(DRIFT_SEED));
        rng.set_stream(draw);
        let moved: Vec<f64> = (0..x.columns()).map(|_| drift * normal(&mut rng)).collect();
        let rows = (0..x.rows()).flat_map(|row| x.row(row).iter().zip(&moved));
        SignalMatrix::new(x.columns(), rows.map(|(x, moved)| x + moved).collect())
    }

    fn everywhere(
        &self,
        model: &dyn Model,
        sets: &[Candidate],
        mesh: &Arc<TriMesh>,
        watch: Watch,
    ) -> Result<Everywhere, Cancelled> {
        let mut rows: Vec<usize> = sets.iter().flat_map(|s| s.rows.iter().copied()).collect();
        rows.sort_unstable();
        rows.dedup();
        let sites = &self.simulated.dataset.sites;
        let gauges: Vec<Gauge> = (rows.iter())
            .map(|&row| sites[self.reference.sites[row]].gauge)
            .collect();
        let gauges = (&gauges[..], self.reference.grid.unwrap_or(POINT));
        let off = self.off();
        let tip = (self.tip_radius(), &off.making_at_most());
        let drawn = drawn_on(model, gauges, mesh, tip, watch)?;
        let exact = Uncertainty {
            gluing: Gluing::EXACT,
            ..off
        };
        Ok(Everywhere {
            deviations: drawn.deviations(&off),
            made: (off.making_allowed() != Making::EXACT).then(|| drawn.deviations(&exact)),
            rows,
            drawn,
        })
    }

    /// Which touches of a force (N) move no gauge of a set far enough to be told from noise.
    fn blind(&self, rows: &[usize], force_n: f64) -> Vec<bool> {
        let least = BLIND * self.off().of_channel();
        let x = self.at_force(&self.reference.x.select_rows(rows), force_n);
        (0..x.columns())
            .map(|touch| (0..x.rows()).all(|row| x.row(row)[touch].abs() <= least))
            .collect()
    }
}

/// Sets after one another, as many at a time as have few enough sites together; each at least alone.
fn groups(sets: &[Candidate]) -> Vec<Range<usize>> {
    let mut groups: Vec<Range<usize>> = Vec::new();
    let mut rows: BTreeSet<usize> = BTreeSet::new();
    for (k, set) in sets.iter().enumerate() {
        let next = k + 1;
        rows.extend(&set.rows);
        match groups.last_mut() {
            Some(group) if rows.len() <= MOST_SITES => group.end = next,
            _ => {
                rows = set.rows.iter().copied().collect();
                groups.push(k..next);
            }
        }
    }
    groups
}

/// One set, and the estimators that its gauges are read with.
struct MatchedSet<'a> {
    trial: &'a ByMatching<'a>,
    candidate: &'a Candidate,
    /// Its channels among those that are known everywhere.
    channels: Vec<Vec<(usize, f64)>>,
    drawn: Matching,
    built: Matching,
}

impl<'a> MatchedSet<'a> {
    fn new(trial: &'a ByMatching<'a>, everywhere: &Everywhere, candidate: &'a Candidate) -> Self {
        let channel = |row: &usize| Some(vec![(everywhere.rows.binary_search(row).ok()?, 1.0)]);
        let channels: Vec<Vec<(usize, f64)>> = candidate.rows.iter().filter_map(channel).collect();
        let map = Arc::new(everywhere.drawn.map.mixed(&channels));
        let errors = |deviations: Option<&Deviations>| {
            let deviations = deviations.map(|d| d.mixed(&channels));
            ReadingErrors::known(&trial.off(), channels.len(), deviations)
        };
        let exact = errors(everywhere.made.as_ref());
        let glued = errors(Some(&everywhere.deviations));
        let most_n = trial.forces.most_n;
        Self {
            drawn: Matching::new(Arc::clone(&map), exact, most_n),
            built: Matching::new(map, glued, most_n),
            trial,
            candidate,
            channels,
        }
    }

    /// What is found of the set at one force.
    fn found(&self, readings: &Readings, calibrated: &[Matching]) -> Matched {
        let rows = &self.candidate.rows;
        let touches = &self.trial.reference.touches;
        let errors = |matching: &Matching, x: &SignalMatrix| {
            errors_mm(matching, &x.select_rows(rows), touches)
        };
        Matched {
            set: self.candidate.id(),
            force_n: readings.force_n,
            errors: errors(&self.drawn, &readings.drawn),
            built: errors(&self.built, &readings.built),
            calibrated: (!calibrated.is_empty())
                .then(|| taking_turns(calibrated, &readings.built.select_rows(rows), touches)),
            blind: self.trial.blind(rows, readings.force_n),
        }
    }

    /// The estimator after the known presses on the gauges of each workshop, where there are any.
    fn calibrated(&self, everywhere: &Everywhere) -> Vec<Matching> {
        let trial = self.trial;
        let Some(pressed) = &trial.reference.pressed else {
            return Vec::new();
        };
        let drawn = everywhere.drawn.mixed(&self.channels);
        let samples = SAMPLES as f64;
        let x = noisy_means(trial.inputs, &pressed.x, samples, PRESS_DRAW, trial.streams);
        let x = trial.drifted(x.into_owned(), PRESS_DRAW);
        let x = x.select_rows(&self.candidate.rows);
        let known = |k: usize| {
            let press = &pressed.presses[k];
            KnownPress {
                at: drawn.map.mesh.index().nearest(press.asked.position).0,
                force: press.asked.force,
                reading: reading(&x, k),
            }
        };
        (pressed.of_each())
            .map(|presses| self.calibrated_by(&drawn, &presses.map(known).collect::<Vec<_>>()))
            .collect()
    }

    fn calibrated_by(&self, drawn: &AsDrawn, known: &[KnownPress]) -> Matching {
        let (before, off) = (&self.built.errors, self.trial.off());
        let calibration = calibrate(drawn, known, &before.noise, &off);
        let errors = ReadingErrors {
            relative: calibration.relative,
            deviations: Some(drawn.deviations_of(&calibration.doubts, &off)),
            ..before.clone()
        };
        let map = Arc::new(drawn.calibrated(&calibration));
        Matching::new(map, errors, self.trial.forces.most_n)
    }

    /// What is left of the set when gauges are lost, and left out without anything else: none for a single gauge. A
    /// sample of the touches says what a loss adds to the errors of all touches, `whole` (mm).
    fn failures(
        &self,
        readings: &Readings,
        whole: &[f64],
        watch: Watch,
    ) -> Result<Option<Failures>, Cancelled> {
        let (reference, most) = (self.trial.reference, self.trial.budget.failure_subsets);
        let gauges = self.channels.len();
        if most == 0 || gauges < 2 {
            return Ok(None);
        }
        let sample = evenly(reference.touches.len(), FAILURE_TOUCHES);
        let touches: Vec<Touch> = sample.iter().map(|&t| reference.touches[t]).collect();
        let x = readings.drawn.select_rows(&self.candidate.rows);
        let x = x.select_columns(&sample);
        let sampled: Vec<f64> = sample.iter().map(|&t| whole[t]).collect();
        let apart = mean(whole) - mean(&sampled);
        let mut rows = vec![FailureRow::unharmed(mean(whole))];
        for failed in 1..=MOST_FAILED.min(gauges - 1) {
            let draw = Draw {
                gauges,
                failed,
                most,
                seed: self.trial.inputs.project.budget.seed,
            };
            rows.push(draw.row(false, |lost| {
                report(watch, "Failing gauges", failed - 1, MOST_FAILED)?;
                let mut matching = self.drawn.clone();
                for &channel in lost {
                    matching.used[channel] = false;
                }
                Ok(apart + mean(&errors_mm(&matching, &x, &touches)))
            })?);
        }
        Ok(Some(Failures {
            set: self.candidate.id(),
            touches: sample.len(),
            rows,
        }))
    }
}

/// What all channels read of one touch.
fn reading(x: &SignalMatrix, touch: usize) -> Vec<f64> {
    (0..x.rows()).map(|row| x.row(row)[touch]).collect()
}

/// How far from where they were (mm) touches are found by what gauges read of them (channels × touches).
fn errors_mm(matching: &Matching, x: &SignalMatrix, touches: &[Touch]) -> Vec<f64> {
    let error = |matching: &mut Matching, (t, touch): (usize, &Touch)| {
        let found = matching.find(&reading(x, t));
        units::mm(found.position.distance(touch.position))
    };
    let touches = touches.par_iter().enumerate();
    touches.map_init(|| matching.clone(), error).collect()
}

/// As [`errors_mm`] by the estimators of several workshops' gauges, which take turns from touch to touch as the gauges do:
/// the mean over the touches is that over the workshops too, and each touch is looked for once, so that errors spread as
/// those of one estimator do.
fn taking_turns(estimators: &[Matching], x: &SignalMatrix, touches: &[Touch]) -> Vec<f64> {
    let mut errors = vec![0.0; touches.len()];
    for (turn, matching) in estimators.iter().enumerate() {
        let its: Vec<usize> = (turn..touches.len()).step_by(estimators.len()).collect();
        let looked_for: Vec<Touch> = its.iter().map(|&t| touches[t]).collect();
        let found = errors_mm(matching, &x.select_columns(&its), &looked_for);
        for (touch, error) in its.into_iter().zip(found) {
            errors[touch] = error;
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Chooser;

    #[test]
    fn sets_go_together_as_long_as_they_have_few_sites() {
        let set = |rows: Range<usize>| Candidate {
            chooser: Chooser::Hand,
            rows: rows.collect(),
            hyper: None,
        };
        // Sets within one another have no more sites than the largest.
        let nested: Vec<Candidate> = (1..50).map(|n| set(0..n)).collect();
        assert_eq!(groups(&nested).len(), 1);
        let apart = [set(0..40), set(40..60), set(60..61), set(0..100), set(0..1)];
        assert_eq!(groups(&apart), [0..2, 2..3, 3..4, 4..5]);
        assert!(groups(&[]).is_empty());
    }
}
