//! What a set of gauges makes of the presses of a scene: a posterior over all places for each of them, and from it how
//! far off the estimate is. A gauge more is one more measurement, so that its worth is known without beginning again.
//!
//! Around every place the reading is linear in where the touch is (two coordinates) and how hard, so that the
//! posterior there is normal and a Kalman filter holds it (D. L. Alspach and H. W. Sorenson, Nonlinear Bayesian
//! estimation using Gaussian sum approximations, IEEE Trans. Automatic Control 17, 1972). Each place has its own
//! variance of the readings, and that variance its determinant. Where a press really is, the filter's covariance is
//! the Bayesian Cramér–Rao bound; what the other places get of the probability is the ambiguity.

mod filters;

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

pub(super) use self::filters::Rows;
use self::filters::{
    Filters, LANES, correct, corrections, predict, sharpness, shrink, sum_masses_with,
};
use super::elliptic::mean_length;
use super::scene::{Place, Report, Scene};

/// Added to the cost of a place that a press already stands for.
const NEVER: f32 = 1e30;
/// Places nearer to a press than so many of their reaches are the press's own: around those beyond, the normal
/// distribution does not come as far as the press, which they would explain as well as its own place does.
pub(super) const OWN: f64 = 2.5;

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
