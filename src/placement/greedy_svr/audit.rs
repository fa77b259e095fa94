//! Was each step's choice the best? Exact fits of what was not chosen.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::race::Scored;
use super::screen::LEVELS;
use super::search::GreedySearch;
use super::settings::GreedySvr;
use crate::budget::Watch;
use crate::placement::{Constraints, PlacementError, Pool, SelectionRequest};

/// How many others are compared at each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Audit {
    /// The best by the second screen, which sees all touches.
    pub top: usize,
    /// Drawn at random from the rest.
    pub random: usize,
    /// Of that draw.
    pub seed: u64,
}

/// One step compared with what it could have been.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Gauges with this step's.
    pub sensors: usize,
    /// The criterion (mm) with the site that was chosen.
    pub chosen_mm: f64,
    /// The least with one of the others instead, and which (by place in the pool).
    pub best_other_mm: f64,
    /// Place in the pool of the best other site.
    pub best_other: usize,
    /// Sites that were fitted exactly.
    pub compared: usize,
    /// Largest departure of the last screen from the exact fit, as a share.
    pub departure: f64,
    /// Every fit met its tolerance.
    pub converged: bool,
}

impl Comparison {
    /// By how much the choice is worse than the best that was looked at, as a share; not above zero when
    /// it is the best.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.chosen_mm / self.best_other_mm - 1.0
    }
}

impl GreedySvr {
    /// Compares each step of a choice (places in the pool, in order) with others by the criterion itself.
    ///
    /// # Errors
    /// [`PlacementError`] for too few touches, or when the watch asks for a stop.
    pub fn audit(
        &self,
        pool: &Pool,
        chosen: &[usize],
        audit: Audit,
        watch: Watch,
    ) -> Result<Vec<Comparison>, PlacementError> {
        let constraints = Constraints::count(chosen.len());
        let request = SelectionRequest {
            constraints: &constraints,
            watch,
            found: &|_| (),
        };
        let folds = self.split(pool.targets)?;
        let mut search = GreedySearch::new(self, pool, &request, &folds);
        (0..chosen.len())
            .map(|step| search.compare(chosen, step, audit))
            .collect()
    }
}

impl GreedySearch<'_> {
    fn compare(
        &mut self,
        chosen: &[usize],
        step: usize,
        audit: Audit,
    ) -> Result<Comparison, PlacementError> {
        let mut extended = vec![0.0; self.kernel.len()];
        let winner = self.finalist(chosen[step], step, &mut extended)?;
        let mut comparison = Comparison {
            sensors: step + 1,
            chosen_mm: winner.judged.error,
            best_other_mm: f64::INFINITY,
            best_other: chosen[step],
            compared: 0,
            departure: 0.0,
            converged: winner.judged.converged,
        };
        for place in self.others(&chosen[..=step], audit)? {
            let other = self.finalist(place, step, &mut extended)?.judged;
            let screened = self.scores(LEVELS.len() - 1, &[place], step)?[0].error;
            let departure = (screened / other.error - 1.0).abs();
            comparison.departure = comparison.departure.max(departure);
            comparison.converged &= other.converged;
            comparison.compared += 1;
            if other.error < comparison.best_other_mm {
                comparison.best_other_mm = other.error;
                comparison.best_other = place;
            }
        }
        self.take(winner);
        Ok(comparison)
    }

    /// The most promising places that were not chosen, and some of the rest.
    fn others(&self, chosen: &[usize], audit: Audit) -> Result<Vec<usize>, PlacementError> {
        let open: Vec<usize> = (0..self.features.rows())
            .filter(|p| !chosen.contains(p) && !self.constant.contains(p))
            .collect();
        let mut scored = self.scores(1, &open, chosen.len() - 1)?;
        scored.sort_by(|a, b| a.error.total_cmp(&b.error).then(a.place.cmp(&b.place)));
        let rest = scored.split_off(audit.top.min(scored.len()));
        let mut rest: Vec<Scored> = rest;
        let mut rng = ChaCha8Rng::seed_from_u64(audit.seed.wrapping_add(chosen.len() as u64));
        rest.shuffle(&mut rng);
        rest.truncate(audit.random);
        Ok(scored.iter().chain(&rest).map(|s| s.place).collect())
    }
}
