//! The Kalman filters at the places where presses really are, all presses side by side. They are few beside those of all
//! places, but every site that is tried asks each of them; and where one place is meant they are all that counts, so
//! that they are kept in doubles.

use std::array::from_fn;

use super::filters::{FORCE, MOST, PLAIN, entries, for_unknowns, place_of, square, triangle};
use super::unknowns::prior;
use crate::lanes::{logarithm_to_rounding, wide};
use crate::placement::expected_error::elliptic::mean_length;
use crate::placement::expected_error::scene::{Report, TouchScene};

/// Presses that are computed side by side.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// The filters of all presses, filled up to whole blocks.
#[derive(Clone)]
pub(super) struct TrueFilters {
    unknowns: usize,
    /// Upper triangles, block by block.
    covariances: Vec<Lanes>,
    /// Block by block, of each unknown.
    estimates: Vec<Lanes>,
    /// Minus the logarithm of what is left of the probability.
    costs: Vec<Lanes>,
    /// Of each press (N).
    forces: Vec<Lanes>,
    /// What each unknown of a press really is, over what is allowed for; nothing of the first ones.
    made: Vec<[Lanes; MOST]>,
}

/// What a site's reading makes of them.
#[derive(Clone, Default)]
pub(super) struct SiteReading {
    /// In units of the noise.
    pub readings: Vec<f32>,
    /// What presses cost with it.
    pub costs: Vec<f32>,
    /// How far off (mm) the estimate is expected to be with it.
    pub lengths: Vec<f64>,
    /// Its noise, of unit deviation.
    draws: Vec<Lanes>,
    /// Covariances of the reading with each unknown, the reading's variance, how far it is from what was predicted, and
    /// the cost.
    spread: Vec<Lanes>,
    predicted: Vec<Lanes>,
    off: Vec<Lanes>,
    cost: Vec<Lanes>,
}

impl TrueFilters {
    /// Nothing read yet; a press is thought to be as hard as `force` (N).
    pub fn new(scene: &TouchScene, force: f64) -> Self {
        let unknowns = PLAIN + scene.unknowns.len();
        let blocks = scene.presses.len().div_ceil(LANES);
        let mut filters = Self {
            unknowns,
            covariances: vec![[0.0; LANES]; triangle(unknowns) * blocks],
            estimates: vec![[0.0; LANES]; unknowns * blocks],
            costs: vec![[0.0; LANES]; blocks],
            forces: vec![[0.0; LANES]; blocks],
            made: vec![[[0.0; LANES]; MOST]; blocks],
        };
        for estimate in filters.estimates.chunks_exact_mut(unknowns) {
            estimate[FORCE] = [force; LANES];
        }
        let presses = scene.presses.len();
        for (k, around) in scene.around.iter().enumerate() {
            let (block, lane) = (k / LANES, k % LANES);
            let known = prior(scene, around);
            for i in 0..unknowns {
                let entry = block * triangle(unknowns) + place_of(unknowns, i, i);
                filters.covariances[entry][lane] = known[i].powi(2);
            }
            for i in PLAIN..unknowns {
                let made = scene.made()[(i - PLAIN) * presses + k];
                filters.made[block][i][lane] = f64::from(made);
            }
            filters.costs[block][lane] = -around.own_mass.ln();
        }
        for level in &scene.levels {
            for k in level.presses.clone() {
                filters.forces[k / LANES][k % LANES] = level.force;
            }
        }
        filters
    }

    /// The cost of a press.
    pub fn cost(&self, press: usize) -> f64 {
        self.costs[press / LANES][press % LANES]
    }

    /// Of where the estimate of a press is that is made with these gauges: along, along-across, across (mm²).
    pub fn off_by(&self, scene: &TouchScene, press: usize) -> [f64; 3] {
        let (block, lane, n) = (press / LANES, press % LANES, self.unknowns);
        let entry = |i, j| self.covariances[block * triangle(n) + place_of(n, i, j)][lane];
        let mut off = [entry(0, 0), entry(0, 1), entry(1, 1)];
        for (k, less) in less(scene).into_iter().enumerate().take(n).skip(PLAIN) {
            let [along, across] = [0, 1].map(|i| entry(i, k));
            off[0] -= less * along * along;
            off[1] -= less * along * across;
            off[2] -= less * across * across;
        }
        off
    }

    /// What a site reads of all presses as the gauge of a turn, and what that makes of the filters.
    ///
    /// Noise is of the turn and not of the site: else the sites with the luckiest noise would be chosen.
    pub fn read(&self, scene: &TouchScene, (site, turn): (usize, usize), into: &mut SiteReading) {
        into.fit(self.costs.len(), self.unknowns);
        for (k, draw) in scene.draws(turn).iter().enumerate() {
            into.draws[k / LANES][k % LANES] = f64::from(*draw);
        }
        let drift = scene.unknowns.iter().find_map(|u| u.drift());
        let task = TruthTask {
            report: &scene.at_presses.of(site),
            drift: drift.unwrap_or(0.0),
            less: less(scene),
        };
        weigh(self, &task, into);
    }

    /// Takes a reading into account.
    pub fn take(&mut self, read: &SiteReading) {
        let n = self.unknowns;
        let covariances = self.covariances.chunks_exact_mut(triangle(n));
        let filters = covariances.zip(self.estimates.chunks_exact_mut(n));
        for (b, (covariance, estimate)) in filters.enumerate() {
            let (predicted, off) = (&read.predicted[b], &read.off[b]);
            let spread = &read.spread[b * n..(b + 1) * n];
            for (i, j) in entries(n) {
                let entry = &mut covariance[place_of(n, i, j)];
                for l in 0..LANES {
                    entry[l] -= spread[i][l] * spread[j][l] / predicted[l];
                }
            }
            for (estimate, spread) in estimate.iter_mut().zip(spread) {
                for l in 0..LANES {
                    estimate[l] += spread[l] * (off[l] / predicted[l]);
                }
            }
        }
        self.costs.clone_from(&read.cost);
    }
}

/// How much less each unknown really varies than is allowed for, in squares; nothing of the first ones.
fn less(scene: &TouchScene) -> [f64; MOST] {
    let mut less = [0.0; MOST];
    for (less, unknown) in less.iter_mut().skip(PLAIN).zip(&scene.unknowns) {
        *less = 1.0 - unknown.made().powi(2);
    }
    less
}

impl SiteReading {
    fn fit(&mut self, blocks: usize, unknowns: usize) {
        let count = blocks * LANES;
        self.readings.resize(count, 0.0);
        self.costs.resize(count, 0.0);
        self.lengths.resize(count, 0.0);
        self.spread.resize(unknowns * blocks, [0.0; LANES]);
        for lanes in [
            &mut self.draws,
            &mut self.predicted,
            &mut self.off,
            &mut self.cost,
        ] {
            lanes.resize(blocks, [0.0; LANES]);
        }
    }
}

/// What a gauge reads of all presses, and what there is to know of its unknowns.
struct TruthTask<'a> {
    report: &'a Report<'a>,
    /// What a drift reads of one deviation.
    drift: f64,
    /// How much less each unknown really varies than is allowed for, in squares.
    less: [f64; MOST],
}

wide! {
    fn weigh<'a>(filters: &'a TrueFilters, task: &'a TruthTask<'a>, into: &'a mut SiteReading) {
        for_unknowns!(filters.unknowns, weigh_all(filters, task, into));
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn weigh_all<const N: usize>(filters: &TrueFilters, task: &TruthTask, into: &mut SiteReading) {
    let Report {
        value,
        slopes,
        variance,
        ..
    } = task.report;
    let of_drift = [1.0_f32; LANES];
    let mut by: [&[[f32; LANES]]; N] = [&[]; N];
    // What grows with the force, and what does not.
    let (mut times, mut plus) = ([0.0; N], [task.drift; N]);
    let of_touch = [slopes[0], slopes[1], value].into_iter();
    let of_touch = of_touch.chain(task.report.nuisances());
    for (i, row) in of_touch.enumerate().take(N) {
        by[i] = row.as_chunks().0;
        (times[i], plus[i]) = if i == FORCE { (0.0, 1.0) } else { (1.0, 0.0) };
    }
    let variances = variance.as_chunks::<LANES>().0;
    let covariances = filters.covariances.chunks_exact(triangle(N));
    let estimates = filters.estimates.as_chunks::<N>().0;
    for (b, (covariance, estimate)) in covariances.zip(estimates).enumerate() {
        let row_of: [&[f32; LANES]; N] = from_fn(|i| by[i].get(b).unwrap_or(&of_drift));
        let (variance, force) = (&variances[b], &filters.forces[b]);
        let (made, draws, known) = (&filters.made[b], &into.draws[b], &filters.costs[b]);
        let covariance = square::<N, Lanes>(covariance);
        let mut own = WeighedPresses::<N>::NOTHING;
        for l in 0..LANES {
            let dev = (1.0 + force[l] * force[l] * f64::from(variance[l])).sqrt();
            let scale = dev.recip();
            let mut row = [0.0; N];
            let mut noise = draws[l];
            for i in 0..N {
                row[i] = (times[i] * force[l] + plus[i]) * f64::from(row_of[i][l]) * scale;
                noise += row[i] * made[i][l];
            }
            let reading = force[l] * f64::from(row_of[FORCE][l]) + dev * noise;
            let (mut predicted, mut off) = (1.0, reading * scale);
            let mut spread = [0.0; N];
            for i in 0..N {
                for j in 0..N {
                    spread[i] += covariance[i][j][l] * row[j];
                }
                predicted += row[i] * spread[i];
                off -= row[i] * estimate[i][l];
            }
            // Never less than the noise: rounding would take more.
            let predicted = predicted.max(1.0);
            let log = logarithm_to_rounding(predicted * dev * dev);
            let cost = known[l] + off * off / (2.0 * predicted) + 0.5 * log;
            let left = |i: usize, j: usize| covariance[i][j][l] - spread[i] * spread[j] / predicted;
            let [mut along, mut both, mut across] = [left(0, 0), left(0, 1), left(1, 1)];
            for k in PLAIN..N {
                let (of_along, of_across) = (left(0, k), left(1, k));
                along -= task.less[k] * of_along * of_along;
                both -= task.less[k] * of_along * of_across;
                across -= task.less[k] * of_across * of_across;
            }
            own.reading[l] = reading;
            own.length[l] = mean_length(along, both, across);
            (own.predicted[l], own.off[l], own.cost[l]) = (predicted, off, cost);
            for i in 0..N {
                own.spread[i][l] = spread[i];
            }
        }
        own.put(into, b);
    }
}

/// What a reading of the presses of a block makes of their filters.
struct WeighedPresses<const N: usize> {
    reading: Lanes,
    length: Lanes,
    predicted: Lanes,
    off: Lanes,
    cost: Lanes,
    spread: [Lanes; N],
}

impl<const N: usize> WeighedPresses<N> {
    const NOTHING: Self = Self {
        reading: [0.0; LANES],
        length: [0.0; LANES],
        predicted: [0.0; LANES],
        off: [0.0; LANES],
        cost: [0.0; LANES],
        spread: [[0.0; LANES]; N],
    };

    #[allow(
        clippy::inline_always,
        reason = "part of loops that are compiled for several instruction sets"
    )]
    #[inline(always)]
    fn put(&self, into: &mut SiteReading, block: usize) {
        let of = block * LANES..(block + 1) * LANES;
        for (out, value) in into.readings[of.clone()].iter_mut().zip(self.reading) {
            *out = value as f32;
        }
        for (out, value) in into.costs[of.clone()].iter_mut().zip(self.cost) {
            *out = value as f32;
        }
        into.lengths[of].copy_from_slice(&self.length);
        into.spread[block * N..(block + 1) * N].copy_from_slice(&self.spread);
        (into.predicted[block], into.off[block]) = (self.predicted, self.off);
        into.cost[block] = self.cost;
    }
}
