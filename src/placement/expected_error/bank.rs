//! What a set of gauges makes of the presses of a scene: a posterior over all places for each of them, and from it how
//! far off the estimate is. A gauge more is one more measurement, so that its worth is known without beginning again.
//!
//! Around every place the reading is linear in where the touch is (two coordinates) and how hard, so that the
//! posterior there is normal and a Kalman filter holds it (D. L. Alspach and H. W. Sorenson, Nonlinear Bayesian
//! estimation using Gaussian sum approximations, IEEE Trans. Automatic Control 17, 1972). Each place has its own
//! variance of the readings, and that variance its determinant. Where a press really is, the filter's covariance is
//! the Bayesian Cramér–Rao bound; what the other places get of the probability is the ambiguity.
//!
//! What all gauges feel together of a touch (its tip, a push along the surface, a drift) are more unknowns of each filter.
//! An estimator may allow for more of it than really comes. Its covariance C then is not how far off it is: with a prior
//! of unit variance for an unknown that really has t², that is less by (1 − t²) c cᵀ, c being C's column of the unknown.

mod filters;
mod single;
mod truth;
mod unknowns;

use glam::DVec3;
use rayon::prelude::*;

use self::filters::{
    FORCE, Lane, PlaceFilters, Thought, correct, corrections, predict, shrink, sum_masses_with,
};
pub(super) use self::filters::{MOST, PLAIN};
use self::single::Single;
use self::truth::{SiteReading, TrueFilters};
pub(super) use self::unknowns::{Unknowns, prior, row};
use super::elliptic::mean_length;
use super::scene::{LANES, ScenePlace, TouchScene};

/// Added to the cost of a place that a press already stands for.
const NEVER: f32 = 1e30;

/// One press.
#[derive(Clone)]
struct BankPress {
    /// Where each place thinks the touch is from its middle (mm, mm), how hard it was (N) and what else there is to
    /// find, block of places by block; and its cost.
    estimates: Vec<Lane>,
    costs: Vec<Lane>,
    /// Blocks of places that may still be meant.
    blocks: Vec<u32>,
}

/// Sites that are tried side by side: what is thought of a press then stays near while all of them ask for it, and is
/// megabytes for all presses.
const TILE: usize = 8;

/// Working memory of whoever tries gauges.
pub(super) struct TrialMemory(Vec<TriedGauge>);

/// What a gauge does to the filters at all places, for one force, and to those at the true places.
struct TriedGauge {
    places: filters::FilterRows,
    read: SiteReading,
}

/// All presses of a scene, read by the gauges of a set.
#[derive(Clone)]
pub(super) struct Bank<'a> {
    scene: &'a TouchScene,
    /// Of the places.
    positions: Vec<[Lane; 3]>,
    filters: Vec<PlaceFilters>,
    presses: Vec<BankPress>,
    truth: TrueFilters,
    mass: f64,
    /// How many there are.
    gauges: usize,
}

impl<'a> Bank<'a> {
    /// No gauge yet.
    pub fn new(scene: &'a TouchScene) -> Self {
        // Any force up to the hardest; or the one there is.
        let (mean, deviation) = scene.hardest.map_or((1.0, 0.0), |hardest| (0.0, hardest));
        let blocks = scene.places.len().div_ceil(LANES);
        let padded = |value: &dyn Fn(&ScenePlace) -> f64, rest: f32| -> Vec<Lane> {
            let mut values = vec![[rest; LANES]; blocks];
            for (lane, place) in values.as_flattened_mut().iter_mut().zip(&scene.places) {
                *lane = value(place) as f32;
            }
            values
        };
        let unknowns = PLAIN + scene.unknowns.len();
        let reaches = padded(&|p| p.reach, 1.0);
        let filters = || PlaceFilters::new(scene, &reaches, (deviation * deviation) as f32);
        // The same for all presses: there are hundreds of them, and a hand waits for this.
        let unlikely = padded(&|p| -p.mass.max(1e-12).ln(), NEVER);
        let mut thought = vec![[0.0; LANES]; unknowns * blocks];
        for block in thought.chunks_exact_mut(unknowns) {
            block[FORCE] = [mean as f32; LANES];
        }
        let presses = scene.around.iter().map(|around| {
            let mut costs = unlikely.clone();
            for &own in &around.own {
                costs.as_flattened_mut()[own as usize] = NEVER;
            }
            BankPress {
                estimates: thought.clone(),
                costs,
                blocks: (0..blocks as u32).collect(),
            }
        });
        let [x, y, z] = [0, 1, 2].map(|k| padded(&|p| p.position[k], 0.0));
        Self {
            positions: (0..blocks).map(|b| [x[b], y[b], z[b]]).collect(),
            filters: scene.levels.iter().map(|_| filters()).collect(),
            presses: presses.collect(),
            truth: TrueFilters::new(scene, mean),
            mass: scene.presses.iter().map(|p| p.mass).sum(),
            gauges: 0,
            scene,
        }
    }

    /// With the gauges of a set.
    pub fn of(scene: &'a TouchScene, sites: &[usize]) -> Self {
        Self::seated(scene, sites.iter().copied().enumerate())
    }

    /// With gauges at some sites, each in a turn of its own (turn, site): where some of a set are lost, the others
    /// hear the noise that they heard with them.
    pub fn seated(scene: &'a TouchScene, seats: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut bank = Self::new(scene);
        for (turn, site) in seats {
            bank.take_turn(turn);
            bank.add(site);
        }
        bank
    }

    /// Working memory of [`Self::with`].
    pub fn rows(&self) -> TrialMemory {
        TrialMemory((0..TILE).map(|_| self.tried()).collect())
    }

    fn tried(&self) -> TriedGauge {
        TriedGauge {
            places: self.filters[0].rows(),
            read: SiteReading::default(),
        }
    }

    /// The expected error (mm) of the set.
    pub fn error(&self) -> f64 {
        let errors = self.errors();
        let weighed = errors.iter().zip(&self.scene.presses);
        weighed.map(|(e, p)| e * p.mass).sum::<f64>() / self.mass
    }

    /// The part of [`Self::error`] (mm) that is left where one place is meant.
    pub fn local(&self) -> f64 {
        let presses = self.scene.presses.iter().enumerate();
        let weighed = presses.map(|(k, press)| press.mass * self.length(k));
        weighed.sum::<f64>() / self.mass
    }

    /// How far off (mm) a press is expected to be found where its own place is meant.
    fn length(&self, press: usize) -> f64 {
        let [along, both, across] = self.truth.off_by(self.scene, press);
        mean_length(along, both, across)
    }

    /// Expected error (mm) of each press.
    pub fn errors(&self) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.presses.len());
        for (filters, level) in self.filters.iter().zip(&self.scene.levels) {
            let nothing = filters.unread();
            errors.extend(level.presses.clone().map(|k| {
                let cost = self.truth.cost(k) as f32;
                let total = self.masses_with(k, &nothing, 0.0, cost);
                self.error_of(k, self.length(k), total)
            }));
        }
        errors
    }

    /// The expected error (mm) of the set with one more gauge, at each of some sites.
    pub fn with(&self, sites: &[usize], rows: &mut TrialMemory) -> Vec<f64> {
        let mut sums = vec![0.0; sites.len()];
        self.each_with(sites, rows, |which, press, error| {
            sums[which] += self.scene.presses[press].mass * error;
        });
        sums.into_iter().map(|sum| sum / self.mass).collect()
    }

    /// Expected error (mm) of each press with one more gauge.
    pub(super) fn errors_with(&self, site: usize) -> Vec<f64> {
        let mut errors = vec![0.0; self.presses.len()];
        let mut rows = TrialMemory(vec![self.tried()]);
        self.each_with(&[site], &mut rows, |_, press, error| errors[press] = error);
        errors
    }

    /// Tells of each of some sites and each press in its order the expected error (mm) with a gauge more there.
    fn each_with(
        &self,
        sites: &[usize],
        TrialMemory(rows): &mut TrialMemory,
        mut tell: impl FnMut(usize, usize, f64),
    ) {
        let scene = self.scene;
        for (tile, sites) in sites.chunks(rows.len()).enumerate() {
            let first = tile * rows.len();
            for (tried, &site) in rows.iter_mut().zip(sites) {
                self.truth.read(scene, (site, self.gauges), &mut tried.read);
            }
            for (filters, level) in self.filters.iter().zip(&scene.levels) {
                for (tried, &site) in rows.iter_mut().zip(sites) {
                    let report = scene.at_places.of(site);
                    predict(filters, &report, level.force as f32, &mut tried.places);
                }
                for k in level.presses.clone() {
                    for (t, tried) in rows[..sites.len()].iter().enumerate() {
                        tell(first + t, k, self.error_with(k, tried));
                    }
                }
            }
        }
    }

    /// Expected error (mm) of a press with a gauge that is tried.
    fn error_with(&self, press: usize, TriedGauge { places, read }: &TriedGauge) -> f64 {
        let (reading, cost) = (read.readings[press], read.costs[press]);
        let total = self.masses_with(press, places, reading, cost);
        self.error_of(press, read.lengths[press], total)
    }

    /// Adds a gauge.
    pub fn add(&mut self, site: usize) {
        let TriedGauge {
            mut places,
            mut read,
        } = self.tried();
        let scene = self.scene;
        self.truth.read(scene, (site, self.gauges), &mut read);
        self.truth.take(&read);
        let report = scene.at_places.of(site);
        for (filters, level) in self.filters.iter_mut().zip(&scene.levels) {
            predict(filters, &report, level.force as f32, &mut places);
            let gains = corrections(filters, &places);
            let (first, truth) = (level.presses.start, &self.truth);
            let presses = self.presses[level.presses.clone()].par_iter_mut();
            presses.enumerate().for_each(|(k, press)| {
                press.correct(&places, &gains, read.readings[first + k]);
                press.close(truth.cost(first + k));
            });
            shrink(filters, &places, &gains);
        }
        self.gauges += 1;
    }

    /// The probability of all places over that of the true one of a press, which costs `own`, and its first moments.
    fn masses_with(
        &self,
        press: usize,
        rows: &filters::FilterRows,
        reading: f32,
        own: f32,
    ) -> [f64; 4] {
        let press = &self.presses[press];
        let thought = Thought {
            estimates: &press.estimates,
            costs: &press.costs,
            blocks: &press.blocks,
        };
        let unknowns = PLAIN + self.scene.unknowns.len();
        sum_masses_with(unknowns, thought, rows, &self.positions, reading, own)
    }

    /// From how far off (mm) the filter at the true place is, and the probability (over the one there) and its first moments of all
    /// others.
    fn error_of(&self, press: usize, length: f64, [mass, x, y, z]: [f64; 4]) -> f64 {
        let there = self.scene.presses[press].position;
        let own = (1.0 + mass).recip();
        let elsewhere = (DVec3::new(x, y, z) - there * mass) * own;
        (elsewhere.length_squared() + (own * length).powi(2)).sqrt()
    }

    /// Which turn the next gauge has: a set hears the same noise whichever of its gauges is added last.
    pub(super) fn take_turn(&mut self, turn: usize) {
        self.gauges = turn;
    }

    /// What each place costs (minus the logarithm of its probability, up to what is the same for all) when the gauges
    /// of a set read a press of some force (N) without noise.
    pub(super) fn costs(scene: &TouchScene, set: &[usize], press: usize, force: f64) -> Vec<f64> {
        let places = scene.places.iter();
        let mut filters: Vec<Single> = places.map(|p| Single::at_rest(scene, p)).collect();
        for &site in set {
            let (there, here) = (scene.at_presses.of(site), scene.at_places.of(site));
            let reading = force * f64::from(there.value[press]);
            for (place, filter) in filters.iter_mut().enumerate() {
                filter.correct(scene, (&here, place), (force, reading));
            }
        }
        filters.iter().map(Single::cost_without_pulls).collect()
    }
}

impl BankPress {
    /// Takes a reading into account at all places that may still be meant.
    fn correct(&mut self, rows: &filters::FilterRows, gains: &[Lane], reading: f32) {
        let Self {
            estimates,
            costs,
            blocks,
        } = self;
        let unknowns = estimates.len() / costs.len().max(1);
        correct(unknowns, estimates, costs, rows, gains, blocks, reading);
    }

    /// Leaves out blocks of places that are so unlikely beside the cost of the true one that no more gauges will bring
    /// them back.
    fn close(&mut self, own: f64) {
        /// In logarithms of the probability over that of the true place.
        const UNLIKELY: f64 = 30.0;
        let (costs, limit) = (&self.costs, (own + UNLIKELY) as f32);
        let likely = |block: &u32| costs[*block as usize].iter().any(|c| *c < limit);
        self.blocks.retain(likely);
    }
}

#[cfg(test)]
mod tests;
