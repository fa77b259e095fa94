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

use glam::DVec3;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use self::filters::{Filters, correct, corrections, predict, sharpness, shrink, sum_masses_with};
pub(super) use self::filters::{MOST, PLAIN, Rows};
use super::elliptic::mean_length;
use super::scene::{LANES, Neighbourhood, Place, Report, Scene};

/// Of all unknowns that there may be; zero of those that are not asked for.
pub(super) type Unknowns = SVector<f64, MOST>;
type Covariance = SMatrix<f64, MOST, MOST>;

/// Added to the cost of a place that a press already stands for.
const NEVER: f32 = 1e30;

/// One press.
#[derive(Clone)]
struct Press {
    /// Where each place thinks the touch is from its middle (mm, mm), how hard it was (N) and what else there is to
    /// find: one after the other, of all places; and its cost.
    estimates: Vec<f32>,
    costs: Vec<f32>,
    /// Blocks of places that may still be meant.
    blocks: Vec<u32>,
    /// The filter at the true place.
    covariance: Covariance,
    estimate: Unknowns,
    cost: f64,
}

/// All presses of a scene, read by the gauges of a set.
#[derive(Clone)]
pub(super) struct Bank<'a> {
    scene: &'a Scene,
    /// Of the places.
    positions: Vec<f32>,
    filters: Vec<Filters>,
    presses: Vec<Press>,
    mass: f64,
    /// How many there are.
    gauges: usize,
}

impl<'a> Bank<'a> {
    /// No gauge yet.
    pub fn new(scene: &'a Scene) -> Self {
        // Any force up to the hardest; or the one there is.
        let (mean, deviation) = scene.hardest.map_or((1.0, 0.0), |hardest| (0.0, hardest));
        let count = scene.places.len().next_multiple_of(LANES);
        let padded = |value: &dyn Fn(&Place) -> f64, rest: f32| -> Vec<f32> {
            let mut values: Vec<f32> = scene.places.iter().map(|p| value(p) as f32).collect();
            values.resize(count, rest);
            values
        };
        let unknowns = PLAIN + scene.unknowns.len();
        let reaches = padded(&|p| p.reach, 1.0);
        let filters = || Filters::new(scene, &reaches, (deviation * deviation) as f32);
        // The same for all presses: there are hundreds of them, and a hand waits for this.
        let unlikely = padded(&|p| -p.mass.max(1e-12).ln(), NEVER);
        let presses = scene.around.iter().map(|around| {
            let mut costs = unlikely.clone();
            for &own in &around.own {
                costs[own as usize] = NEVER;
            }
            let known = prior(scene, around);
            let mut estimates = vec![0.0; unknowns * count];
            estimates[2 * count..3 * count].fill(mean as f32);
            Press {
                estimates,
                costs,
                blocks: (0..(count / LANES) as u32).collect(),
                covariance: Covariance::from_diagonal(&known.component_mul(&known)),
                estimate: thought(mean),
                cost: -around.own_mass.ln(),
            }
        });
        Self {
            positions: (0..3)
                .flat_map(|k| padded(&|p| p.position[k], 0.0))
                .collect(),
            filters: scene.levels.iter().map(|_| filters()).collect(),
            presses: presses.collect(),
            mass: scene.presses.iter().map(|p| p.mass).sum(),
            gauges: 0,
            scene,
        }
    }

    /// With the gauges of a set.
    pub fn of(scene: &'a Scene, sites: &[usize]) -> Self {
        Self::seated(scene, sites.iter().copied().enumerate())
    }

    /// With gauges at some sites, each in a turn of its own (turn, site): where some of a set are lost, the others
    /// hear the noise that they heard with them.
    pub fn seated(scene: &'a Scene, seats: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut bank = Self::new(scene);
        for (turn, site) in seats {
            bank.take_turn(turn);
            bank.add(site);
        }
        bank
    }

    /// Working memory of [`Self::with`].
    pub fn rows(&self) -> Rows {
        Rows::with(PLAIN + self.scene.unknowns.len(), self.positions.len() / 3)
    }

    /// The expected error (mm) of the set.
    pub fn error(&self) -> f64 {
        let errors = self.errors();
        let weighed = errors.iter().zip(&self.scene.presses);
        weighed.map(|(e, p)| e * p.mass).sum::<f64>() / self.mass
    }

    /// The part of [`Self::error`] (mm) that is left where one place is meant.
    pub fn local(&self) -> f64 {
        let places = self.presses.iter().zip(&self.scene.presses);
        let off = |press: &Press| local(&self.off_by(|i, j| press.covariance[(i, j)]));
        let weighed = places.map(|(press, place)| place.mass * off(press));
        weighed.sum::<f64>() / self.mass
    }

    /// Expected error (mm) of each press.
    pub fn errors(&self) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.presses.len());
        for (filters, level) in self.filters.iter().zip(&self.scene.levels) {
            let nothing = Rows {
                sharpness: filters.of_force().iter().map(|&v| sharpness(v)).collect(),
                ..self.rows()
            };
            errors.extend(level.presses.clone().map(|k| {
                let press = &self.presses[k];
                let total = masses_with(press, &nothing, &self.positions, 0.0, press.cost as f32);
                self.error_of(k, &self.off_by(|i, j| press.covariance[(i, j)]), total)
            }));
        }
        errors
    }

    /// The expected error (mm) of the set with one more gauge.
    pub fn with(&self, site: usize, rows: &mut Rows) -> f64 {
        let mut sum = 0.0;
        for (filters, level) in self.filters.iter().zip(&self.scene.levels) {
            predict(
                filters,
                &self.scene.at_places.of(site),
                level.force as f32,
                rows,
            );
            for k in level.presses.clone() {
                sum += self.scene.presses[k].mass * self.error_with(site, k, level.force, rows);
            }
        }
        sum / self.mass
    }

    /// Adds a gauge.
    pub fn add(&mut self, site: usize) {
        let mut rows = self.rows();
        let (scene, turn) = (self.scene, self.gauges);
        for (filters, level) in self.filters.iter_mut().zip(&scene.levels) {
            let report = scene.at_places.of(site);
            predict(filters, &report, level.force as f32, &mut rows);
            let gains = corrections(filters, &rows);
            let first = level.presses.start;
            let presses = self.presses[level.presses.clone()].par_iter_mut();
            presses.enumerate().for_each(|(k, press)| {
                let (own, reading) = Own::of(scene, (site, turn), first + k, level.force);
                let (covariance, estimate, cost) = own.corrected(press);
                (press.covariance, press.estimate, press.cost) = (covariance, estimate, cost);
                press.correct(&rows, &gains, reading as f32);
                press.close();
            });
            shrink(filters, &rows, &gains);
        }
        self.gauges += 1;
    }

    /// Expected error (mm) of a press of some force (N) with a gauge at a site more, of which the rows are.
    fn error_with(&self, site: usize, press: usize, force: f64, rows: &Rows) -> f64 {
        let (own, reading) = Own::of(self.scene, (site, self.gauges), press, force);
        let known = &self.presses[press];
        let weighed = own.weighed(known);
        let total = masses_with(
            known,
            rows,
            &self.positions,
            reading as f32,
            weighed.cost as f32,
        );
        let entry = |i: usize, j: usize| {
            known.covariance[(i, j)] - weighed.spread[i] * weighed.spread[j] / weighed.predicted
        };
        self.error_of(press, &self.off_by(entry), total)
    }

    /// Of where an estimate is that has this covariance for whoever makes it: along, along-across, across (mm²).
    fn off_by(&self, covariance: impl Fn(usize, usize) -> f64) -> [f64; 3] {
        let mut off = [covariance(0, 0), covariance(0, 1), covariance(1, 1)];
        for (k, unknown) in self.scene.unknowns.iter().enumerate() {
            let [along, across] = [0, 1].map(|i| covariance(i, PLAIN + k));
            let less = 1.0 - unknown.made().powi(2);
            off[0] -= less * along * along;
            off[1] -= less * along * across;
            off[2] -= less * across * across;
        }
        off
    }

    /// From how far off the filter at the true place is, and the probability (over the one there) and its first moments of all
    /// others.
    fn error_of(&self, press: usize, off: &[f64; 3], [mass, x, y, z]: [f64; 4]) -> f64 {
        let there = self.scene.presses[press].position;
        let own = (1.0 + mass).recip();
        let elsewhere = (DVec3::new(x, y, z) - there * mass) * own;
        (elsewhere.length_squared() + (own * local(off)).powi(2)).sqrt()
    }

    /// Which turn the next gauge has: a set hears the same noise whichever of its gauges is added last.
    pub(super) fn take_turn(&mut self, turn: usize) {
        self.gauges = turn;
    }

    /// Expected error (mm) of each press with one more gauge.
    pub(super) fn errors_with(&self, site: usize, rows: &mut Rows) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.presses.len());
        for (filters, level) in self.filters.iter().zip(&self.scene.levels) {
            let report = self.scene.at_places.of(site);
            predict(filters, &report, level.force as f32, rows);
            let rows = &*rows;
            let error = |k| self.error_with(site, k, level.force, rows);
            errors.extend(level.presses.clone().map(error));
        }
        errors
    }

    /// What each place costs (minus the logarithm of its probability, up to what is the same for all) when the gauges
    /// of a set read a press of some force (N) without noise.
    pub(super) fn costs(scene: &Scene, set: &[usize], press: usize, force: f64) -> Vec<f64> {
        let mut filters: Vec<Press> = scene
            .places
            .iter()
            .map(|place| Press::at_rest(scene, place))
            .collect();
        for &site in set {
            let (there, here) = (scene.at_presses.of(site), scene.at_places.of(site));
            let reading = force * f64::from(there.value[press]);
            for (k, filter) in filters.iter_mut().enumerate() {
                let own = Own::at_place(scene, &here, k, (force, reading));
                (filter.covariance, filter.estimate, filter.cost) = own.corrected(filter);
            }
        }
        filters.iter().map(Press::cost_without_pulls).collect()
    }
}

/// How far off (mm) an estimate of this covariance is: along, along-across, across.
fn local(&[along, both, across]: &[f64; 3]) -> f64 {
    mean_length(along, both, across)
}

/// Deviations of what is known of a press before anything is read: along, across (mm), force (N), and the rest.
pub(super) fn prior(scene: &Scene, around: &Neighbourhood) -> Unknowns {
    within(scene, around.reach)
}

/// The same of a touch within some reach (mm).
fn within(scene: &Scene, reach: f64) -> Unknowns {
    let mut known = Unknowns::zeros();
    known.fixed_rows_mut::<2>(0).fill(reach);
    known[2] = scene.hardest.unwrap_or(0.0);
    known.rows_mut(PLAIN, scene.unknowns.len()).fill(1.0);
    known
}

/// What is thought of a touch of which nothing was read: as hard as that, in the middle of its place.
fn thought(force: f64) -> Unknowns {
    let mut thought = Unknowns::zeros();
    thought[2] = force;
    thought
}

/// What a site's reading of a press of some force says of each unknown, over the reading's deviation, and the square of
/// that.
pub(super) fn row(scene: &Scene, report: &Report, press: usize, force: f64) -> (Unknowns, f64) {
    let variance = 1.0 + force * force * f64::from(report.variance[press]);
    let mut row = Unknowns::zeros();
    row[0] = force * f64::from(report.slopes[0][press]);
    row[1] = force * f64::from(report.slopes[1][press]);
    row[2] = f64::from(report.value[press]);
    let mut nuisances = report.nuisances();
    for (entry, unknown) in row.iter_mut().skip(PLAIN).zip(&scene.unknowns) {
        let mut of_touch = || nuisances.next().map_or(0.0, |n| f64::from(n[press]));
        *entry = unknown.drift().unwrap_or_else(|| force * of_touch());
    }
    (row * variance.sqrt().recip(), variance)
}

impl Press {
    /// Takes a reading into account at all places that may still be meant.
    fn correct(&mut self, rows: &Rows, gains: &[f32], reading: f32) {
        let Self {
            estimates,
            costs,
            blocks,
            ..
        } = self;
        correct(estimates, costs, rows, gains, blocks, reading);
    }

    /// Leaves out blocks of places that are so unlikely that no more gauges will bring them back.
    fn close(&mut self) {
        /// In logarithms of the probability over that of the true place.
        const UNLIKELY: f64 = 30.0;
        let (costs, limit) = (&self.costs, (self.cost + UNLIKELY) as f32);
        let likely = |block: &u32| {
            let first = *block as usize * LANES;
            costs[first..first + LANES].iter().any(|c| *c < limit)
        };
        self.blocks.retain(likely);
    }

    /// A touch around a place of which nothing was read yet; it compares itself with no other place.
    fn at_rest(scene: &Scene, place: &Place) -> Self {
        let known = within(scene, place.reach);
        Self {
            estimates: Vec::new(),
            costs: Vec::new(),
            blocks: Vec::new(),
            covariance: Covariance::from_diagonal(&known.component_mul(&known)),
            estimate: thought(if scene.hardest.is_some() { 0.0 } else { 1.0 }),
            cost: -place.mass.max(1e-12).ln(),
        }
    }

    /// What a touch costs that would have to pull, beside what it costs already.
    fn cost_without_pulls(&self) -> f64 {
        let variance = self.covariance[(2, 2)];
        let pulls = if variance > 0.0 {
            (self.estimate[2] / variance.sqrt()).min(0.0)
        } else {
            0.0
        };
        self.cost + 0.5 * pulls * pulls
    }
}

/// What is measured at the true place.
struct Own {
    row: Unknowns,
    reading: f64,
    variance: f64,
}

/// A reading beside what was thought of a press.
struct Weighed {
    /// Covariance of the reading with each unknown.
    spread: Unknowns,
    /// Variance of the reading.
    predicted: f64,
    /// How far the reading is from what was predicted.
    off: f64,
    /// What the press costs with it.
    cost: f64,
}

impl Own {
    /// A site's reading of a press, as the filter at the true place takes it.
    /// The reading is that of the gauge of a turn.
    fn of(scene: &Scene, (site, turn): (usize, usize), press: usize, force: f64) -> (Self, f64) {
        let report = scene.at_presses.of(site);
        let (row, variance) = row(scene, &report, press, force);
        let deviation = variance.sqrt();
        // Of the gauge's turn and not of its site: else the sites with the luckiest noise would be chosen.
        let draw = scene.draw(turn, press);
        let made = |k: usize| row[PLAIN + k] * f64::from(scene.made(k, press));
        let made: f64 = (0..scene.unknowns.len()).map(made).sum();
        let value = f64::from(report.value[press]);
        let reading = force * value + deviation * (made + f64::from(draw));
        let own = Self {
            row,
            reading: reading / deviation,
            variance,
        };
        (own, reading)
    }

    fn weighed(&self, press: &Press) -> Weighed {
        let spread = press.covariance * self.row;
        // Never less than the noise: rounding would take more.
        let predicted = (1.0 + self.row.dot(&spread)).max(1.0);
        let off = self.reading - self.row.dot(&press.estimate);
        let log = 0.5 * (predicted * self.variance).ln();
        Weighed {
            cost: press.cost + off * off / (2.0 * predicted) + log,
            spread,
            predicted,
            off,
        }
    }

    fn corrected(&self, press: &Press) -> (Covariance, Unknowns, f64) {
        let Weighed {
            spread,
            predicted,
            off,
            cost,
        } = self.weighed(press);
        (
            press.covariance - spread * spread.transpose() / predicted,
            press.estimate + spread * (off / predicted),
            cost,
        )
    }

    /// What a site would measure of a touch of some force (N) around a place, for a reading (in units of the noise).
    fn at_place(scene: &Scene, here: &Report, place: usize, (force, reading): (f64, f64)) -> Self {
        let (row, variance) = row(scene, here, place, force);
        Self {
            row,
            reading: reading / variance.sqrt(),
            variance,
        }
    }
}

/// Probability over that of the true place, and its first moments, of all places.
fn masses_with(press: &Press, rows: &Rows, positions: &[f32], reading: f32, own: f32) -> [f64; 4] {
    let Press {
        estimates,
        costs,
        blocks,
        ..
    } = press;
    sum_masses_with(estimates, costs, rows, positions, blocks, reading, own)
}

#[cfg(test)]
mod tests;
