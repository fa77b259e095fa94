//! Model matching: which touch, anywhere on the surface, makes the readings that were measured.
//!
//! A touch of force f at p makes x = f·g(p) + noise, with g known from the elastic model. For any p the best
//! force has a closed form, f = (x·W g)/(g·W g) with the noise's weights W, so that only the surface is
//! searched: all templates at once, then Gauss–Newton on the quadratic pieces of g from the best few. Where
//! the readings hardly tell places apart, the mean over the posterior of the templates is taken instead, with
//! flat priors on area and on force. It needs no training.
//!
//! Where it is known how gauges may be glued, a reading's variance is the template's own: it grows with the force and
//! with what a gauge that is a little off would read there, and its determinant counts.

use std::sync::Arc;

use glam::{DMat2, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::map::{LANES, ResponseMap};
use super::region::{DEVIATIONS, Region};
use crate::lanes::{logarithm, wide};
use crate::mesh::SurfacePoint;

/// A touch as it was inferred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// On the surface (m), and the outward normal there: a touch presses against it.
    pub position: DVec3,
    pub normal: DVec3,
    /// N, and its standard deviation.
    pub force: f64,
    pub force_deviation: f64,
    /// Where it may be.
    pub region: Region,
    /// Twice the gain in log-likelihood over no touch at all.
    pub strength: f64,
    /// Whether it is one narrow place, and not the mean of several or of a wide stretch.
    pub narrow: bool,
    /// Weighted squares that no touch explains; about channels - 3 where model and noise are right.
    pub unexplained: f64,
}

/// What is known of the readings' errors.
#[derive(Clone)]
pub struct Errors {
    /// Standard deviation of each channel's noise (strain).
    pub noise: Vec<f64>,
    /// Standard deviation of what gains, places and model are off by, over the reading: half of it from the
    /// channel's own reading, half from the mean square of all.
    pub relative: f64,
    /// Standard deviation a newton that gluing puts on each channel's reading, on the mesh of the readings; absent
    /// where gauges are known to be glued as the readings say.
    pub spread: Option<Arc<ResponseMap>>,
}

impl Errors {
    #[must_use]
    pub fn of_noise(noise: f64, channels: usize) -> Self {
        Self::of_noises(&vec![noise; channels])
    }

    /// Noise of each channel, and nothing else.
    #[must_use]
    pub fn of_noises(noise: &[f64]) -> Self {
        Self {
            noise: noise.to_vec(),
            relative: 0.0,
            spread: None,
        }
    }

    /// One over the variance of every channel for this reading; zero for a channel that is left out.
    #[must_use]
    pub fn weights(&self, reading: &[f64], used: &[bool]) -> Vec<f64> {
        let count = used.iter().filter(|u| **u).count().max(1) as f64;
        let squares = reading
            .iter()
            .zip(used)
            .filter(|(_, u)| **u)
            .map(|(x, _)| x * x);
        let mean = squares.sum::<f64>() / count;
        let weight = |((x, u), n): ((&f64, &bool), &f64)| {
            let off = self.relative.powi(2) * f64::midpoint(x * x, mean);
            if *u { (n * n + off).recip() } else { 0.0 }
        };
        reading
            .iter()
            .zip(used)
            .zip(&self.noise)
            .map(weight)
            .collect()
    }
}

/// The estimator, with its own working memory.
#[derive(Clone)]
pub struct Matching {
    pub map: Arc<ResponseMap>,
    pub errors: Errors,
    /// Channels that are trusted.
    pub used: Vec<bool>,
    /// The largest force that anybody presses with (N).
    pub most_force: f64,
    scores: Vec<f32>,
    /// The highest score of each block of templates.
    highest: Vec<f32>,
}

/// Places from which Gauss–Newton begins, and how far they are apart in templates.
const STARTS: usize = 4;
const APART: f64 = 3.0;
const STEPS: usize = 8;
/// Log-likelihoods so far below the best count for nothing.
const NOTHING: f64 = 14.0;
/// Beyond this deviation, in templates, their posterior takes the place of Gauss–Newton's normal one.
const BROAD: f64 = 1.0;
/// Turns in which a force and the weights that depend on it settle.
const TURNS: usize = 2;
/// One place with this share of the probability is the answer; below it, the mean is.
const CLEAR: f64 = 0.9;

/// A most likely place, and the normal distribution around it.
#[derive(Clone, Copy)]
struct Mode {
    at: SurfacePoint,
    position: DVec3,
    force: f64,
    force_variance: f64,
    covariance: DMat2,
    plane: [DVec3; 2],
    /// Half the weighted squares left over.
    cost: f64,
    /// Of the integral over its surroundings.
    log_evidence: f64,
}

/// A reading with its weights, ready to be compared.
pub(super) struct Measured<'a> {
    pub x: &'a [f64],
    pub w: &'a [f64],
    pub squares: f64,
}

/// A reading, and what is known of its errors wherever the touch was.
struct Heard<'a> {
    x: &'a [f64],
    /// One over the variance of every channel, without gluing.
    w: Vec<f64>,
    /// Weighted squares of a reading without a touch.
    squares: f64,
}

/// The weights of a reading for a touch at one place, of one force.
struct Weighed {
    w: Vec<f64>,
    squares: f64,
    /// Half the logarithm of the variances' determinant, over that without gluing.
    log: f64,
}

impl Weighed {
    fn measured<'a>(&'a self, x: &'a [f64]) -> Measured<'a> {
        Measured {
            x,
            w: &self.w,
            squares: self.squares,
        }
    }
}

impl Measured<'_> {
    /// Best force and half the squares left over at a place with these readings per newton.
    fn fit(&self, g: &[f64], most_force: f64) -> (f64, f64) {
        let (mut s, mut d) = (0.0, 0.0);
        for ((x, w), g) in self.x.iter().zip(self.w).zip(g) {
            s += w * x * g;
            d += w * g * g;
        }
        let force = if d > 0.0 {
            (s / d).clamp(0.0, most_force)
        } else {
            0.0
        };
        (force, 0.5 * self.squares - force * (s - 0.5 * force * d))
    }
}

impl Matching {
    #[must_use]
    pub fn new(map: Arc<ResponseMap>, errors: Errors, most_force: f64) -> Self {
        Self {
            used: vec![true; map.channels()],
            scores: vec![0.0; map.templates.len() / map.channels().max(1)],
            highest: vec![0.0; map.templates.len() / map.channels().max(1) / LANES],
            map,
            errors,
            most_force,
        }
    }

    /// The touch that explains a reading (strain, a channel each) best.
    pub fn find(&mut self, reading: &[f64]) -> Contact {
        let measured = self.heard(reading);
        self.score(&measured);
        let mut modes = self.modes(&measured);
        modes.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let best = modes[0];
        let broad = BROAD * self.map.spacing();
        if widest(best.covariance) > broad * broad {
            return self.mean_of_templates(&measured, &best);
        }
        self.mean_of_modes(&measured, &modes)
    }

    /// As [`Self::find`] for a touch that goes on: from the place where it was, without looking everywhere.
    /// Nothing where that does not explain the reading any more, or no longer clearly.
    #[must_use]
    pub fn track(&self, reading: &[f64], last: &Contact) -> Option<Contact> {
        let measured = self.heard(reading);
        // Noise alone makes them differ by a few deviations of χ².
        let differs = 4.0 * (2.0 * self.used.len() as f64).sqrt();
        let explained = |cost: f64| 2.0 * cost <= last.unexplained + differs;
        let start = self.map.index.nearest(last.position).0;
        let mode = self.follow(&measured, start, Some(last.force));
        let broad = BROAD * self.map.spacing();
        (explained(mode.cost) && widest(mode.covariance) <= broad * broad)
            .then(|| self.contact_at(&measured, &mode, true))
    }

    /// What was found for another reading, where this one is the same but for its size and the noise of both: a
    /// wide posterior is worth no second look then.
    #[must_use]
    pub fn hold(&self, reading: &[f64], before: &[f64], found: &Contact) -> Option<Contact> {
        let channels = || {
            (reading
                .iter()
                .zip(before)
                .zip(&self.errors.noise)
                .zip(&self.used))
            .filter(|(_, u)| **u)
        };
        let (mut s, mut d) = (0.0, 0.0);
        for (((x, y), n), _) in channels() {
            s += x * y / (n * n);
            d += y * y / (n * n);
        }
        let size = s / d;
        let off = |(((x, y), n), _): (((&f64, &f64), &f64), &bool)| {
            ((x - size * y) / n).powi(2) / (1.0 + size * size)
        };
        let differs: f64 = channels().map(off).sum();
        let count = channels().count() as f64;
        let same = (0.5..2.0).contains(&size) && differs < count + 3.0 * (2.0 * count).sqrt();
        same.then_some(Contact {
            force: (found.force * size).min(self.most_force),
            force_deviation: found.force_deviation * size,
            ..*found
        })
    }

    /// How much better than nothing a touch at each template explains the reading.
    fn score(&mut self, measured: &Heard) {
        let scaled: Vec<f32> = (measured.x.iter().zip(&measured.w))
            .map(|(x, w)| (w * x * 1e-6) as f32)
            .collect();
        let weights: Vec<f32> = measured.w.iter().map(|w| (w * 1e-12) as f32).collect();
        let most = self.most_force as f32;
        if let Some(spread) = &self.errors.spread {
            let reading: Vec<f32> = measured.x.iter().map(|x| (x * 1e6) as f32).collect();
            score_with_gluing(
                &self.map.templates,
                &spread.templates,
                &reading,
                &weights,
                most,
                &mut self.scores,
                &mut self.highest,
            );
            return;
        }
        score_templates(
            &self.map.templates,
            &scaled,
            &weights,
            most,
            &mut self.scores,
            &mut self.highest,
        );
    }

    /// The best templates, apart from each other, each followed to the best place near it.
    fn modes(&self, measured: &Heard) -> Vec<Mode> {
        let reach = APART * self.map.spacing();
        let mut starts: Vec<usize> = Vec::with_capacity(STARTS);
        for _ in 0..STARTS {
            let best = self.best_template(&|place| {
                let near = |&s: &usize| self.map.places[s].distance_squared(place) < reach * reach;
                !starts.iter().any(near)
            });
            starts.extend(best);
        }
        let mut modes: Vec<Mode> = Vec::with_capacity(STARTS);
        for start in starts {
            let at = self.map.index.nearest(self.map.places[start]).0;
            let mode = self.follow(measured, at, None);
            // Two starts may end at the same place.
            let same = |m: &Mode| m.position.distance(mode.position) < 0.5 * self.map.spacing();
            if !modes.iter().any(same) {
                modes.push(mode);
            }
        }
        modes
    }

    /// The template with the highest score among those at places that are `allowed`.
    fn best_template(&self, allowed: &dyn Fn(DVec3) -> bool) -> Option<usize> {
        let nodes = self.map.places.len();
        let (mut best, mut highest) = (None, f32::NEG_INFINITY);
        for (block, _) in self.highest.iter().enumerate() {
            if self.highest[block] <= highest {
                continue;
            }
            for node in block * LANES..((block + 1) * LANES).min(nodes) {
                if self.scores[node] > highest && allowed(self.map.places[node]) {
                    (best, highest) = (Some(node), self.scores[node]);
                }
            }
        }
        best
    }

    /// A reading with its weights where gluing does not count.
    fn heard<'a>(&self, reading: &'a [f64]) -> Heard<'a> {
        let w = self.errors.weights(reading, &self.used);
        Heard {
            squares: reading.iter().zip(&w).map(|(x, w)| w * x * x).sum(),
            x: reading,
            w,
        }
    }

    /// The weights for a touch of a force, where gauges glued otherwise would read so much else (a newton).
    fn weighed(heard: &Heard, spread: Option<&[f64]>, force: f64) -> Weighed {
        let Some(spread) = spread else {
            return Weighed {
                w: heard.w.clone(),
                squares: heard.squares,
                log: 0.0,
            };
        };
        let mut log = 0.0;
        let weight = |(w, s): (&f64, &f64)| {
            let wider = 1.0 + w * (force * s).powi(2);
            log += 0.5 * wider.ln();
            w / wider
        };
        let w: Vec<f64> = heard.w.iter().zip(spread).map(weight).collect();
        Weighed {
            squares: heard.x.iter().zip(&w).map(|(x, w)| w * x * x).sum(),
            w,
            log,
        }
    }

    /// The weights for a touch at a place: of the force that is given, or else of the one that fits best.
    fn weighed_at(&self, heard: &Heard, at: SurfacePoint, force: Option<f64>) -> Weighed {
        let spread = self.errors.spread.as_ref().map(|s| s.at(at));
        let spread = spread.as_deref();
        let fitting = || self.fitting_force(heard, &self.map.at(at), spread);
        Self::weighed(heard, spread, force.unwrap_or_else(fitting))
    }

    /// The force that fits best at a place with these readings a newton: its weights depend on it, and two turns
    /// settle them.
    fn fitting_force(&self, heard: &Heard, g: &[f64], spread: Option<&[f64]>) -> f64 {
        let mut force = first_force(heard, g).clamp(0.0, self.most_force);
        for _ in 0..TURNS {
            let weighed = Self::weighed(heard, spread, force);
            force = weighed.measured(heard.x).fit(g, self.most_force).0;
        }
        force
    }

    /// The most likely place near a start. Weights that depend on where and how hard the touch was are taken there
    /// once more.
    fn follow(&self, heard: &Heard, start: SurfacePoint, force: Option<f64>) -> Mode {
        let weighed = self.weighed_at(heard, start, force);
        let mode = self.descend(&weighed.measured(heard.x), weighed.log, start);
        if self.errors.spread.is_none() {
            return mode;
        }
        let weighed = self.weighed_at(heard, mode.at, Some(mode.force));
        self.descend(&weighed.measured(heard.x), weighed.log, mode.at)
    }

    /// Gauss–Newton on place and force, with Levenberg's damping.
    fn descend(&self, measured: &Measured, log: f64, start: SurfacePoint) -> Mode {
        let map = &self.map;
        let mut at = start;
        let mut slope = map.slope(at);
        let (mut force, mut cost) = measured.fit(&slope.reading, self.most_force);
        let mut damping = 1e-4;
        for _ in 0..STEPS {
            let (normal, gradient) = equations(measured, &slope, force);
            let mut damped = normal;
            for k in 0..3 {
                damped[(k, k)] *= 1.0 + damping;
            }
            let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                break;
            };
            let length = step[0].hypot(step[1]);
            // No farther than the quadratic pieces can be trusted.
            let within = (3.0 * map.spacing() / length.max(f64::MIN_POSITIVE)).min(1.0);
            let moved = slope.plane[0] * (step[0] * within) + slope.plane[1] * (step[1] * within);
            let there = map.index.nearest(map.mesh.point(at) + moved).0;
            let next = map.slope(there);
            let (next_force, next_cost) = measured.fit(&next.reading, self.most_force);
            if next_cost < cost {
                let gained = cost - next_cost;
                (at, slope, force, cost) = (there, next, next_force, next_cost);
                damping *= 0.1;
                if gained < 1e-4 {
                    break;
                }
            } else {
                // Nothing left to gain by going on.
                if length < 1e-6 {
                    break;
                }
                damping = (damping * 20.0).max(1e-3);
            }
        }
        self.mode(measured, at, &slope, force, cost + log)
    }

    fn mode(
        &self,
        measured: &Measured,
        at: SurfacePoint,
        slope: &super::map::Slope,
        force: f64,
        cost: f64,
    ) -> Mode {
        let (mut normal, _) = equations(measured, slope, force);
        // What is known before anything is measured: the touch is on the part, and nobody presses harder.
        let (lower, upper) = self.map.mesh.bounds();
        let size = (upper - lower).length_squared() / 4.0;
        normal[(0, 0)] += size.recip();
        normal[(1, 1)] += size.recip();
        normal[(2, 2)] += self.most_force.powi(-2);
        let covariance = normal.try_inverse().unwrap_or_else(Matrix3::identity);
        Mode {
            at,
            position: self.map.mesh.point(at),
            force,
            force_variance: covariance[(2, 2)],
            covariance: DMat2::from_cols_array(&[
                covariance[(0, 0)],
                covariance[(1, 0)],
                covariance[(0, 1)],
                covariance[(1, 1)],
            ]),
            plane: slope.plane,
            cost,
            log_evidence: -cost + 0.5 * covariance.determinant().max(f64::MIN_POSITIVE).ln(),
        }
    }

    /// A mode alone, with its normal distribution.
    fn contact_at(&self, measured: &Heard, mode: &Mode, narrow: bool) -> Contact {
        let region = Region::of_normal(mode.covariance, mode.plane);
        let force = (mode.force, mode.force_variance);
        self.contact(measured, mode.at, force, region, mode.cost, narrow)
    }

    /// Where one narrow place is far likelier than all others, that one; otherwise their mean.
    fn mean_of_modes(&self, measured: &Heard, modes: &[Mode]) -> Contact {
        let best = modes[0];
        let weight = |m: &Mode| (m.log_evidence - best.log_evidence).exp();
        let total: f64 = modes.iter().map(weight).sum();
        if 1.0 / total >= CLEAR {
            return self.contact_at(measured, &best, true);
        }
        let mean = |value: &dyn Fn(&Mode) -> f64| {
            modes.iter().map(|m| weight(m) * value(m)).sum::<f64>() / total
        };
        let centre: DVec3 = modes.iter().map(|m| m.position * (weight(m) / total)).sum();
        let at = self.map.index.nearest(centre).0;
        let force = mean(&|m| m.force);
        let variance = mean(&|m| m.force_variance + (m.force - force).powi(2));
        let places: Vec<(DVec3, f64)> = modes.iter().flat_map(|m| spread(m, weight(m))).collect();
        let region = Region::of_places(&places, self.map.mesh.point(at), self.map.mesh.normal(at));
        self.contact(measured, at, (force, variance), region, best.cost, false)
    }

    /// Mean, spread and region over all templates, each with the area it stands for.
    fn mean_of_templates(&self, measured: &Heard, best: &Mode) -> Contact {
        let map = &self.map;
        let highest = self.highest.iter().fold(0.0_f32, |m, s| m.max(*s));
        let highest = f64::from(highest).max(0.5 * measured.squares - best.cost);
        let floor = (highest - NOTHING - 1e-5 * highest) as f32;
        let mut places = Vec::new();
        let (mut total, mut centre, mut force, mut squares) = (0.0, DVec3::ZERO, 0.0, 0.0);
        for (node, _) in self.scores[..map.places.len()]
            .iter()
            .enumerate()
            .filter(|(_, s)| **s >= floor)
        {
            let (mean, variance, log_likelihood) = self.force_at(measured, node);
            let weight = map.areas[node] * (log_likelihood - highest).exp();
            places.push((map.places[node], weight));
            total += weight;
            centre += map.places[node] * weight;
            force += weight * mean;
            squares += weight * (mean * mean + variance);
        }
        if total <= 0.0 {
            return self.contact_at(measured, best, false);
        }
        let at = map.index.nearest(centre / total).0;
        let force = force / total;
        let variance = (squares / total - force * force).max(0.0);
        let region = Region::of_places(&places, map.mesh.point(at), map.mesh.normal(at));
        self.contact(measured, at, (force, variance), region, best.cost, false)
    }

    /// Mean and variance of the force at a place, and the log-likelihood with the force integrated out.
    fn force_at(&self, heard: &Heard, node: usize) -> (f64, f64, f64) {
        let g = self.map.node(node);
        let spread = self.errors.spread.as_ref().map(|s| s.node(node));
        let force = spread.map_or(0.0, |_| self.fitting_force(heard, g, spread));
        let weighed = Self::weighed(heard, spread, force);
        let d: f64 = g.iter().zip(&weighed.w).map(|(g, w)| w * g * g).sum();
        let (force, cost) = weighed.measured(heard.x).fit(g, self.most_force);
        // A force is never known worse than that it lies between nothing and the most.
        let variance = d.max(12.0 * self.most_force.powi(-2)).recip();
        (
            force,
            variance,
            0.5 * heard.squares - cost - weighed.log + 0.5 * variance.ln(),
        )
    }

    fn contact(
        &self,
        measured: &Heard,
        at: SurfacePoint,
        force: (f64, f64),
        region: Region,
        cost: f64,
        narrow: bool,
    ) -> Contact {
        Contact {
            position: self.map.mesh.point(at),
            normal: self.map.mesh.normal(at),
            force: force.0,
            force_deviation: force.1.sqrt(),
            region,
            strength: measured.squares - 2.0 * cost,
            narrow,
            unexplained: 2.0 * cost,
        }
    }
}

/// The force that fits best where all channels are off alike: where each has variances of its own, one begins here.
fn first_force(heard: &Heard, g: &[f64]) -> f64 {
    let trusted = || {
        heard
            .x
            .iter()
            .zip(g)
            .zip(&heard.w)
            .filter(|(_, w)| **w > 0.0)
    };
    let s: f64 = trusted().map(|((x, g), _)| x * g).sum();
    let d: f64 = trusted().map(|((_, g), _)| g * g).sum();
    if d > 0.0 { s / d } else { 0.0 }
}

/// Normal equations of place (two directions) and force, and their right side.
pub(super) fn equations(
    measured: &Measured,
    slope: &super::map::Slope,
    force: f64,
) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (c, (x, w)) in measured.x.iter().zip(measured.w).enumerate() {
        let change = slope.change[c] * force;
        let row = Vector3::new(change.x, change.y, slope.reading[c]);
        normal += row * row.transpose() * *w;
        right += row * (w * (x - force * slope.reading[c]));
    }
    (normal, right)
}

/// Four places that stand for a mode: one deviation of √2 along each principal direction, either way.
fn spread(mode: &Mode, weight: f64) -> impl Iterator<Item = (DVec3, f64)> {
    let region = Region::of_normal(mode.covariance, mode.plane);
    let scale = std::f64::consts::SQRT_2 / DEVIATIONS;
    let position = mode.position;
    region.axes.into_iter().flat_map(move |axis| {
        [1.0, -1.0].map(|sign| (position + axis * (sign * scale), weight / 4.0))
    })
}

/// The larger eigenvalue (m²).
fn widest(covariance: DMat2) -> f64 {
    let (a, b, c) = (
        covariance.x_axis.x,
        covariance.x_axis.y,
        covariance.y_axis.y,
    );
    f64::midpoint(a, c) + ((a - c) / 2.0).hypot(b)
}

wide! {
    fn score_templates<'a>(
        templates: &'a [f32],
        scaled: &'a [f32],
        weights: &'a [f32],
        most: f32,
        scores: &'a mut [f32],
        highest: &'a mut [f32],
    ) {
        let channels = scaled.len();
        let blocks = templates.chunks_exact(LANES * channels).zip(scores.chunks_exact_mut(LANES));
        for ((block, out), highest) in blocks.zip(highest) {
            let (mut s, mut d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
            for (row, (&a, &w)) in block.chunks_exact(LANES).zip(scaled.iter().zip(weights)) {
                for k in 0..LANES {
                    s[k] += a * row[k];
                    d[k] += w * row[k] * row[k];
                }
            }
            for k in 0..LANES {
                let force = (s[k] / d[k]).max(0.0).min(most);
                out[k] = force * (s[k] - 0.5 * force * d[k]);
            }
            *highest = 0.0;
            for k in 0..LANES {
                *highest = highest.max(out[k]);
            }
        }
    }
}

wide! {
    /// As [`score_templates`], with variances that grow with the force by what gluing spreads: `reading` in
    /// microstrain, `weights` without gluing.
    fn score_with_gluing<'a>(
        templates: &'a [f32],
        spreads: &'a [f32],
        reading: &'a [f32],
        weights: &'a [f32],
        most: f32,
        scores: &'a mut [f32],
        highest: &'a mut [f32],
    ) {
        let channels = reading.len();
        let nothing: f32 = reading.iter().zip(weights).map(|(x, w)| w * x * x).sum();
        let block = LANES * channels;
        let blocks = templates.chunks_exact(block).zip(spreads.chunks_exact(block));
        for (((block, spread), out), highest) in
            blocks.zip(scores.chunks_exact_mut(LANES)).zip(highest)
        {
            let (mut s, mut d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
            for (row, (&x, &w)) in block.chunks_exact(LANES).zip(reading.iter().zip(weights)) {
                let trusted = if w > 0.0 { 1.0 } else { 0.0 };
                for k in 0..LANES {
                    s[k] += trusted * x * row[k];
                    d[k] += trusted * row[k] * row[k];
                }
            }
            let mut force = [0.0_f32; LANES];
            for k in 0..LANES {
                force[k] = (s[k] / d[k]).max(0.0).min(most);
            }
            for turn in 0..=TURNS {
                let (mut a, mut log) = ([0.0_f32; LANES], [0.0_f32; LANES]);
                (s, d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
                let rows = block.chunks_exact(LANES).zip(spread.chunks_exact(LANES));
                for ((row, spread), (&x, &w)) in rows.zip(reading.iter().zip(weights)) {
                    for k in 0..LANES {
                        let off = force[k] * spread[k];
                        let wider = 1.0 + w * off * off;
                        let w = w / wider;
                        s[k] += w * x * row[k];
                        d[k] += w * row[k] * row[k];
                        a[k] += w * x * x;
                        log[k] += logarithm(wider);
                    }
                }
                for k in 0..LANES {
                    if turn == TURNS {
                        let left = a[k] - force[k] * (2.0 * s[k] - force[k] * d[k]);
                        out[k] = 0.5 * (nothing - left - log[k]);
                    } else {
                        force[k] = (s[k] / d[k]).max(0.0).min(most);
                    }
                }
            }
            *highest = f32::NEG_INFINITY;
            for k in 0..LANES {
                *highest = highest.max(out[k]);
            }
        }
    }
}
