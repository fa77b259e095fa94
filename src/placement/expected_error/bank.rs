//! What a set of gauges makes of the presses of a scene: a posterior over all places for each of them, and from it how
//! far off the estimate is. A gauge more is one more measurement, so that its worth is known without beginning again.
//!
//! Around every place the reading is linear in where the touch is (two coordinates) and how hard, so that the
//! posterior there is normal and a Kalman filter holds it (D. L. Alspach and H. W. Sorenson, Nonlinear Bayesian
//! estimation using Gaussian sum approximations, IEEE Trans. Automatic Control 17, 1972). Each place has its own
//! variance of the readings, and that variance its determinant. Where a press really is, the filter's covariance is
//! the Bayesian Cramér–Rao bound; what the other places get of the probability is the ambiguity.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use super::elliptic::mean_length;
use super::scene::{Place, Report, Scene};
use crate::lanes::{exponential, logarithm, wide};

/// Places whose probability is summed side by side.
const LANES: usize = 16;
/// Added to the cost of a place that a press already stands for.
const NEVER: f32 = 1e30;
/// Places nearer to a press than so many of their reaches are the press's own: around those beyond, the normal
/// distribution does not come as far as the press, which they would explain as well as its own place does.
pub(super) const OWN: f64 = 2.5;

/// The filters at all places, for one force.
struct Filters {
    /// Upper triangles of the covariances: along, along-across, along-force, across, across-force, force.
    covariances: [Vec<f32>; 6],
}

/// One press.
struct Press {
    /// Where each place thinks the touch is from its middle (mm, mm) and how hard it was (N), and its cost.
    estimates: [Vec<f32>; 3],
    costs: Vec<f32>,
    /// Blocks of places that may still be meant.
    blocks: Vec<u32>,
    /// The filter at the true place.
    covariance: Matrix3<f64>,
    estimate: Vector3<f64>,
    cost: f64,
}

/// All presses of a scene, read by the gauges of a set.
pub(super) struct Bank<'a> {
    scene: &'a Scene,
    /// Of the places.
    positions: [Vec<f32>; 3],
    filters: Vec<Filters>,
    presses: Vec<Press>,
    mass: f64,
    /// How many there are.
    gauges: usize,
}

/// What a site's reading does to the filters at all places, for one force.
#[derive(Default)]
pub(super) struct Rows {
    /// Of the reading over its deviation: by place and force.
    slopes: [Vec<f32>; 3],
    /// One over the deviation.
    scale: Vec<f32>,
    /// Half over the variance of what is predicted, and the logarithm that belongs to it.
    half: Vec<f32>,
    log: Vec<f32>,
    /// By how much the force is corrected, and one over its deviation after that.
    gain: Vec<f32>,
    sharpness: Vec<f32>,
}

impl Rows {
    fn with(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            slopes: [zeros(), zeros(), zeros()],
            scale: zeros(),
            half: zeros(),
            log: zeros(),
            gain: zeros(),
            sharpness: zeros(),
        }
    }
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
        let filters = || Filters {
            covariances: [
                padded(&|p| p.reach.powi(2), 1.0),
                vec![0.0; count],
                vec![0.0; count],
                padded(&|p| p.reach.powi(2), 1.0),
                vec![0.0; count],
                vec![(deviation * deviation) as f32; count],
            ],
        };
        // The same for all presses: there are hundreds of them, and a hand waits for this.
        let unlikely = padded(&|p| -p.mass.max(1e-12).ln(), NEVER);
        let presses = scene.presses.iter().map(|press| {
            let own = |p: &Place| p.position.distance(press.position) <= OWN * p.reach;
            let mut own_mass: f64 = scene.places.iter().filter(|p| own(p)).map(|p| p.mass).sum();
            if own_mass <= 0.0 {
                own_mass = press.mass;
            }
            let mut costs = unlikely.clone();
            for (cost, place) in costs.iter_mut().zip(&scene.places) {
                if own(place) {
                    *cost = NEVER;
                }
            }
            let known = prior(scene, press);
            Press {
                estimates: [vec![0.0; count], vec![0.0; count], vec![mean as f32; count]],
                costs,
                blocks: (0..(count / LANES) as u32).collect(),
                covariance: Matrix3::from_diagonal(&known.component_mul(&known)),
                estimate: Vector3::new(0.0, 0.0, mean),
                cost: -own_mass.ln(),
            }
        });
        Self {
            positions: [
                padded(&|p| p.position.x, 0.0),
                padded(&|p| p.position.y, 0.0),
                padded(&|p| p.position.z, 0.0),
            ],
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

    /// Share of the places, over all presses, that may still be meant.
    pub fn open_share(&self) -> f64 {
        let open: usize = self.presses.iter().map(|p| p.blocks.len()).sum();
        (open * LANES) as f64 / (self.presses.len() * self.positions[0].len()).max(1) as f64
    }

    /// Working memory of [`Self::with`].
    pub fn rows(&self) -> Rows {
        Rows::with(self.positions[0].len())
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
        let weighed = places.map(|(press, place)| place.mass * local(&press.covariance));
        weighed.sum::<f64>() / self.mass
    }

    /// Expected error (mm) of each press.
    pub fn errors(&self) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.presses.len());
        for (filters, level) in self.filters.iter().zip(&self.scene.levels) {
            let nothing = Rows {
                sharpness: filters.covariances[5]
                    .iter()
                    .map(|&v| sharpness(v))
                    .collect(),
                ..self.rows()
            };
            errors.extend(level.presses.clone().map(|k| {
                let press = &self.presses[k];
                let total = masses_with(press, &nothing, &self.positions, 0.0, press.cost as f32);
                self.error_of(k, &press.covariance, total)
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
                let press = &self.presses[k];
                let (own, reading) = self.own(k, site, level.force);
                let (covariance, _, cost) = own.corrected(press);
                let total = masses_with(press, rows, &self.positions, reading as f32, cost as f32);
                sum += self.scene.presses[k].mass * self.error_of(k, &covariance, total);
            }
        }
        sum / self.mass
    }

    /// Adds a gauge.
    pub fn add(&mut self, site: usize) {
        let mut rows = self.rows();
        for level in 0..self.filters.len() {
            let force = self.scene.levels[level].force;
            let report = self.scene.at_places.of(site);
            predict(&self.filters[level], &report, force as f32, &mut rows);
            let gains = corrections(&self.filters[level], &rows);
            for k in self.scene.levels[level].presses.clone() {
                let (own, reading) = self.own(k, site, force);
                let press = &mut self.presses[k];
                let (covariance, estimate, cost) = own.corrected(press);
                (press.covariance, press.estimate, press.cost) = (covariance, estimate, cost);
                let [along, across, force] = press.estimates.each_mut();
                let before = [along, across, force, &mut press.costs];
                correct(before, &rows, &gains, &press.blocks, reading as f32);
                press.close();
            }
            shrink(&mut self.filters[level], &rows, &gains);
        }
        self.gauges += 1;
    }

    /// A site's reading of a press, as the filter at the true place takes it.
    fn own(&self, press: usize, site: usize, force: f64) -> (Own, f64) {
        let report = self.scene.at_presses.of(site);
        let (row, variance) = row(&report, press, force);
        let deviation = variance.sqrt();
        let value = f64::from(report.value[press]);
        // Of the gauge's turn and not of its site: else the sites with the luckiest noise would be chosen.
        let draw = self.scene.draw(self.gauges, press);
        let reading = force * value + deviation * f64::from(draw);
        let own = Own {
            row,
            reading: reading / deviation,
            log: 0.5 * variance.ln(),
        };
        (own, reading)
    }

    /// From the covariance at the true place, and the probability (over the one there) and its first moments of all
    /// others.
    fn error_of(&self, press: usize, covariance: &Matrix3<f64>, [mass, x, y, z]: [f64; 4]) -> f64 {
        let there = self.scene.presses[press].position;
        let own = (1.0 + mass).recip();
        let elsewhere = (DVec3::new(x, y, z) - there * mass) * own;
        elsewhere.length().hypot(own * local(covariance))
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
            errors.extend(level.presses.clone().map(|k| {
                let press = &self.presses[k];
                let (own, reading) = self.own(k, site, level.force);
                let (covariance, _, cost) = own.corrected(press);
                let total = masses_with(press, rows, &self.positions, reading as f32, cost as f32);
                self.error_of(k, &covariance, total)
            }));
        }
        errors
    }

    /// What each place costs (minus the logarithm of its probability, up to what is the same for all) when the gauges
    /// of a set read a press of some force (N) without noise.
    pub(super) fn costs(scene: &Scene, set: &[usize], press: usize, force: f64) -> Vec<f64> {
        let mut filters: Vec<Press> = scene
            .places
            .iter()
            .map(|place| Press::at_rest(place, scene.hardest))
            .collect();
        for &site in set {
            let (there, here) = (scene.at_presses.of(site), scene.at_places.of(site));
            let reading = force * f64::from(there.value[press]);
            for (k, filter) in filters.iter_mut().enumerate() {
                let own = Own::at_place(&here, k, force, reading);
                (filter.covariance, filter.estimate, filter.cost) = own.corrected(filter);
            }
        }
        filters.iter().map(Press::cost_without_pulls).collect()
    }
}

/// How far off (mm) an estimate of this covariance is.
fn local(covariance: &Matrix3<f64>) -> f64 {
    mean_length(covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)])
}

/// Deviations of what is known of a press before anything is read: along, across (mm) and force (N).
pub(super) fn prior(scene: &Scene, press: &Place) -> Vector3<f64> {
    // As a disc of that radius.
    let reach = nearest(&scene.places, press.position).reach * OWN / 2.0;
    Vector3::new(reach, reach, scene.hardest.unwrap_or(0.0))
}

/// What a site's reading of a press of some force says of along, across and force, over the reading's deviation, and
/// the square of that.
pub(super) fn row(report: &Report, press: usize, force: f64) -> (Vector3<f64>, f64) {
    let variance = 1.0 + force * force * f64::from(report.variance[press]);
    let slope = |k: usize| force * f64::from(report.slopes[k][press]);
    let row = Vector3::new(slope(0), slope(1), f64::from(report.value[press]));
    (row / variance.sqrt(), variance)
}

impl Press {
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
    fn at_rest(place: &Place, hardest: Option<f64>) -> Self {
        let (mean, deviation) = hardest.map_or((1.0, 0.0), |hardest| (0.0, hardest));
        let along = place.reach * place.reach;
        Self {
            estimates: [Vec::new(), Vec::new(), Vec::new()],
            costs: Vec::new(),
            blocks: Vec::new(),
            covariance: Matrix3::from_diagonal(&Vector3::new(along, along, deviation * deviation)),
            estimate: Vector3::new(0.0, 0.0, mean),
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
    row: Vector3<f64>,
    reading: f64,
    log: f64,
}

impl Own {
    fn corrected(&self, press: &Press) -> (Matrix3<f64>, Vector3<f64>, f64) {
        let spread = press.covariance * self.row;
        // Never less than the noise: rounding would take more.
        let predicted = (1.0 + self.row.dot(&spread)).max(1.0);
        let off = self.reading - self.row.dot(&press.estimate);
        let cost = press.cost + off * off / (2.0 * predicted) + 0.5 * predicted.ln() + self.log;
        (
            press.covariance - spread * spread.transpose() / predicted,
            press.estimate + spread * (off / predicted),
            cost,
        )
    }

    /// What a site would measure of a touch of some force (N) around a place, for a reading (in units of the noise).
    fn at_place(here: &Report, place: usize, force: f64, reading: f64) -> Self {
        let variance = 1.0 + force * force * f64::from(here.variance[place]);
        let deviation = variance.sqrt();
        let slope = |axis: usize| force * f64::from(here.slopes[axis][place]);
        let value = f64::from(here.value[place]);
        Self {
            row: Vector3::new(slope(0), slope(1), value) / deviation,
            reading: reading / deviation,
            log: 0.5 * variance.ln(),
        }
    }
}

fn nearest(places: &[Place], position: DVec3) -> Place {
    let away = |p: &&Place| p.position.distance_squared(position);
    let nearest = places.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.copied().unwrap_or(Place {
        position,
        reach: 1.0,
        mass: 1.0,
    })
}

/// Fills in what a reading does to the filters at all places.
fn predict(filters: &Filters, report: &Report, force: f32, rows: &mut Rows) {
    let count = report.value.len();
    let [xx, xy, xf, yy, yf, ff] = filters.covariances.each_ref().map(|c| &c[..count]);
    let [r0, r1, r2] = rows.slopes.each_mut().map(|r| &mut r[..count]);
    fill(
        [xx, xy, xf, yy, yf, ff],
        [
            report.value,
            report.slopes[0],
            report.slopes[1],
            report.variance,
        ],
        [
            r0,
            r1,
            r2,
            &mut rows.scale[..count],
            &mut rows.half[..count],
            &mut rows.log[..count],
            &mut rows.gain[..count],
            &mut rows.sharpness[..count],
        ],
        force,
    );
}

/// One over the deviation; nothing where there is none to know.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn sharpness(variance: f32) -> f32 {
    if variance > 0.0 {
        variance.sqrt().recip()
    } else {
        0.0
    }
}

/// By how much the filters at all places correct along, across and force.
fn corrections(filters: &Filters, rows: &Rows) -> [Vec<f32>; 3] {
    let [xx, xy, xf, yy, yf, _] = &filters.covariances;
    let count = xx.len();
    let (mut along, mut across) = (vec![0.0; count], vec![0.0; count]);
    for k in 0..count {
        let r = [0, 1, 2].map(|i: usize| rows.slopes[i][k]);
        let share = 2.0 * rows.half[k];
        along[k] = (xx[k] * r[0] + xy[k] * r[1] + xf[k] * r[2]) * share;
        across[k] = (xy[k] * r[0] + yy[k] * r[1] + yf[k] * r[2]) * share;
    }
    [along, across, rows.gain.clone()]
}

fn shrink(filters: &mut Filters, rows: &Rows, gains: &[Vec<f32>; 3]) {
    const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    for (values, (i, j)) in filters.covariances.iter_mut().zip(ENTRIES) {
        for (k, value) in values.iter_mut().enumerate() {
            if rows.half[k] > 0.0 {
                *value -= gains[i][k] * gains[j][k] / (2.0 * rows.half[k]);
            }
        }
    }
}

/// Takes a reading into account at the places that may still be meant.
fn correct(
    before: [&mut Vec<f32>; 4],
    rows: &Rows,
    gains: &[Vec<f32>; 3],
    blocks: &[u32],
    reading: f32,
) {
    let [r0, r1, r2] = rows.slopes.each_ref().map(|r| &r[..]);
    correct_blocks(
        before.map(Vec::as_mut_slice),
        [r0, r1, r2, &rows.scale, &rows.half, &rows.log],
        gains.each_ref().map(|g| &g[..]),
        blocks,
        reading,
    );
}

/// Probability over that of the true place, and its first moments, of all places.
fn masses_with(
    press: &Press,
    rows: &Rows,
    positions: &[Vec<f32>; 3],
    reading: f32,
    own: f32,
) -> [f64; 4] {
    let [along, across, force] = &press.estimates;
    sum_masses_with(
        [along, across, force, &press.costs],
        [
            &rows.slopes[0],
            &rows.slopes[1],
            &rows.slopes[2],
            &rows.scale,
        ],
        [&rows.half, &rows.log, &rows.gain, &rows.sharpness],
        [&positions[0], &positions[1], &positions[2]],
        &press.blocks,
        reading,
        own,
    )
}

fn folded(lanes: [[f32; LANES]; 4]) -> [f64; 4] {
    lanes.map(|lane| lane.iter().map(|v| f64::from(*v)).sum())
}

wide! {
    fn sum_masses_with<'a>(
        before: [&'a [f32]; 4],
        row: [&'a [f32]; 4],
        after: [&'a [f32]; 4],
        positions: [&'a [f32]; 3],
        blocks: &'a [u32],
        reading: f32,
        own: f32,
    ) -> [f64; 4] {
        let mut sums = [[0.0_f32; LANES]; 4];
        let [along, across, force, cost] = before.map(|v| v.as_chunks::<LANES>().0);
        let [r0, r1, r2, scale] = row.map(|v| v.as_chunks::<LANES>().0);
        let [half, log, gain, sharpness] = after.map(|v| v.as_chunks::<LANES>().0);
        let [x, y, z] = positions.map(|v| v.as_chunks::<LANES>().0);
        for &block in blocks {
            let b = block as usize;
            let [along, across, force, cost] = [along[b], across[b], force[b], cost[b]];
            let [r0, r1, r2, scale] = [r0[b], r1[b], r2[b], scale[b]];
            let [half, log, gain, sharpness] = [half[b], log[b], gain[b], sharpness[b]];
            let [x, y, z] = [x[b], y[b], z[b]];
            for l in 0..LANES {
                let off = reading * scale[l] - (r0[l] * along[l] + r1[l] * across[l] + r2[l] * force[l]);
                let pulls = ((force[l] + gain[l] * off) * sharpness[l]).min(0.0);
                let costs = cost[l] + off * off * half[l] + log[l] + 0.5 * pulls * pulls;
                let w = exponential((own - costs).min(60.0));
                sums[0][l] += w;
                sums[1][l] += w * x[l];
                sums[2][l] += w * y[l];
                sums[3][l] += w * z[l];
            }
        }
        folded(sums)
    }
}

wide! {
    fn correct_blocks<'a>(
        before: [&'a mut [f32]; 4],
        row: [&'a [f32]; 6],
        gains: [&'a [f32]; 3],
        blocks: &'a [u32],
        reading: f32,
    ) {
        let [along, across, force, cost] = before.map(|v| v.as_chunks_mut::<LANES>().0);
        let [r0, r1, r2, scale, half, log] = row.map(|v| v.as_chunks::<LANES>().0);
        let [g0, g1, g2] = gains.map(|v| v.as_chunks::<LANES>().0);
        for &block in blocks {
            let b = block as usize;
            let (along, across) = (&mut along[b], &mut across[b]);
            let (force, cost) = (&mut force[b], &mut cost[b]);
            let [r0, r1, r2, scale] = [r0[b], r1[b], r2[b], scale[b]];
            let [half, log, g0, g1, g2] = [half[b], log[b], g0[b], g1[b], g2[b]];
            for l in 0..LANES {
                let predicted = r0[l] * along[l] + r1[l] * across[l] + r2[l] * force[l];
                let off = reading * scale[l] - predicted;
                cost[l] += off * off * half[l] + log[l];
                along[l] += g0[l] * off;
                across[l] += g1[l] * off;
                force[l] += g2[l] * off;
            }
        }
    }
}

wide! {
    fn fill<'a>(
        covariances: [&'a [f32]; 6],
        report: [&'a [f32]; 4],
        into: [&'a mut [f32]; 8],
        force: f32,
    ) {
        let count = report[0].len();
        let [xx, xy, xf, yy, yf, ff] = covariances.map(|c| &c[..count]);
        let [value, along, across, variance] = report.map(|r| &r[..count]);
        let [r0, r1, r2, scales, halves, logs, gains, sharp] = into.map(|i| &mut i[..count]);
        for k in 0..count {
            let variance = 1.0 + force * force * variance[k];
            let scale = variance.sqrt().recip();
            let r = [force * along[k] * scale, force * across[k] * scale, value[k] * scale];
            let spread = [
                xx[k] * r[0] + xy[k] * r[1] + xf[k] * r[2],
                xy[k] * r[0] + yy[k] * r[1] + yf[k] * r[2],
                xf[k] * r[0] + yf[k] * r[1] + ff[k] * r[2],
            ];
            // Never less than the noise: where signals are far above it, rounding would take more.
            let predicted = (1.0 + r[0] * spread[0] + r[1] * spread[1] + r[2] * spread[2]).max(1.0);
            let share = predicted.recip();
            [r0[k], r1[k], r2[k]] = r;
            scales[k] = scale;
            halves[k] = 0.5 * share;
            logs[k] = 0.5 * logarithm(predicted * variance);
            gains[k] = spread[2] * share;
            sharp[k] = sharpness(ff[k] - spread[2] * spread[2] * share);
        }
    }
}
