//! What known presses show of a map beside the way that gauges are glued: a remainder, smooth over the surface.
//!
//! A model of the part is wrong in ways that no gauge's gain, place or direction makes up for: a wall that is thicker here,
//! supports that give way, elements that are too coarse. A press at p of which a channel reads x says what a newton reads
//! there, y = x/f, and so by how much the map g is off. As M. C. Kennedy and A. O'Hagan (J. R. Stat. Soc. B 63, 2001) do it,
//! what it is off by is a Gaussian process of its own beside the model,
//!
//! ```text
//! y(p) = g(p) + s(p) z(p) + s(p) ε,      z ~ GP(0, ρ² M(|p - q| / ℓ)),   ε ~ N(0, ν² + (σ / (f s))²)
//! ```
//!
//! with M Matérn's correlation of order 5/2 and s(p) half the channel's own reading and half that of all channels there
//! (root of the mean square), as a share of which errors of the model are counted everywhere else. ρ, ℓ and ν, which all
//! channels share, are where their posterior is highest. Far from all presses the map stays what the model says, and what
//! it may be off by (ρ s) is told to matching; where presses lie close, the map is what was measured.
//!
//! A press looks only at those nearest to it among the ones before it (A. V. Vecchia, J. R. Stat. Soc. B 50, 1988), and a
//! template only at the nearest presses: what lies behind these is hidden by them, and the time grows with the number of
//! presses, not with its cube.

use std::sync::Arc;

use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::calibration::KnownPress;
use super::map::ResponseMap;
use crate::budget::{Cancelled, Watch, report};
use crate::regression::folds::evenly;

/// Presses that a press is foreseen from while the settings are looked for, and that a template is read off.
const BEFORE: usize = 16;
const AROUND: usize = 32;
/// Presses by which the settings are looked for: of more, an even share.
const SEARCHED: usize = 800;
/// Of all readings (root of the mean square): no place is taken to be known better than by errors of a share of this.
const FLOOR: f64 = 1e-3;
/// The first step of the search, in natural logarithms, and the last.
const FIRST_STEP: f64 = 0.8;
const LAST_STEP: f64 = 0.1;

/// How far a map is off, and over which distance that changes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RemainderSettings {
    /// ρ: standard deviation of what is smooth, as a share of the reading.
    pub share: f64,
    /// ℓ (m).
    pub length: f64,
    /// ν: standard deviation of what each press has for itself, as a share of the reading.
    pub scatter: f64,
}

/// What presses show of a map.
pub struct Remainder {
    /// Of the process.
    pub settings: RemainderSettings,
    places: Vec<RemainderPlace>,
}

/// What is known at one place, in units of s: of each channel.
struct RemainderPlace {
    position: DVec3,
    /// y - g, and the variance that noise leaves of it; infinite of a channel that was not read.
    off: Vec<f64>,
    noise: Vec<f64>,
}

impl Remainder {
    /// Learned from presses in an order that means nothing, with this noise of a reading (strain, a channel each). Readings
    /// at one and the same place are taken together. Nothing where no press can be read.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn learn(
        map: &ResponseMap,
        known: &[KnownPress],
        noise: &[f64],
        watch: Watch,
    ) -> Result<Option<Self>, Cancelled> {
        let places = places(map, known, noise);
        if places.is_empty() {
            return Ok(None);
        }
        let (lower, upper) = map.mesh.bounds();
        let search = RemainderSearch::new(&places, (upper - lower).length());
        let settings = search.best(watch)?;
        Ok(Some(Self { settings, places }))
    }

    /// The map with what was learned, and by how much (standard deviation, strain a newton) each reading of it may be off,
    /// beside what it may be off already.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn add_to(
        &self,
        map: &ResponseMap,
        deviation: &ResponseMap,
        watch: Watch,
    ) -> Result<[ResponseMap; 2], Cancelled> {
        /// Templates between two reports.
        const PIECE: usize = 1024;
        let channels = map.channels();
        let positions = map.mesh.positions();
        let mut foreseen: Vec<Vec<[f64; 2]>> = Vec::with_capacity(positions.len());
        for (k, piece) in positions.chunks(PIECE).enumerate() {
            report(watch, "Learning the remainder", k * PIECE, positions.len())?;
            foreseen.par_extend(piece.par_iter().map(|&p| self.foreseen(p, channels)));
        }
        let scales = Scales::of(map);
        let vertices = positions.len();
        let mut values = Vec::with_capacity(map.values().len());
        let mut deviations = Vec::with_capacity(map.values().len());
        let mut push = |node: usize, ends: [usize; 2]| {
            let scale = scales.at(map.node(node));
            for c in 0..channels {
                // Over an edge, which is short beside ℓ, it is the mean of both ends.
                let at = |k: usize| f64::midpoint(foreseen[ends[0]][c][k], foreseen[ends[1]][c][k]);
                values.push(map.node(node)[c] + scale[c] * at(0));
                deviations.push(deviation.node(node)[c].hypot(scale[c] * at(1).max(0.0).sqrt()));
            }
        };
        for node in 0..vertices {
            push(node, [node, node]);
        }
        for (k, edge) in map.mesh.edges().iter().enumerate() {
            push(vertices + k, [edge.a as usize, edge.b as usize]);
        }
        Ok([values, deviations].map(|v| ResponseMap::of(Arc::clone(&map.mesh), channels, v)))
    }

    /// Mean and variance of z at a place, of each channel.
    fn foreseen(&self, at: DVec3, channels: usize) -> Vec<[f64; 2]> {
        let all = 0..self.places.len();
        let near = nearest(&self.places, all, at, AROUND);
        let RemainderSettings { share, length, .. } = self.settings;
        let prior = share * share;
        let block = CorrelationBlock::new(&self.places, &near, at, length);
        (0..channels)
            .map(|c| {
                let said = block.foresee(&self.places, &near, c, &self.settings);
                said.unwrap_or([0.0, prior])
            })
            .collect()
    }
}

/// Half of a channel's own square, half of the mean square of all channels.
struct Scales {
    /// What no square is below.
    floor: f64,
}

impl Scales {
    fn of(map: &ResponseMap) -> Self {
        let values = map.values();
        let squares: f64 = values.iter().map(|v| v * v).sum();
        Self {
            floor: FLOOR * FLOOR * squares / values.len().max(1) as f64,
        }
    }

    /// s of each channel, where a newton reads this.
    fn at(&self, reading: &[f64]) -> Vec<f64> {
        let squares: f64 = reading.iter().map(|g| g * g).sum();
        let mean = squares / reading.len().max(1) as f64;
        let scale = |g: &f64| f64::midpoint(g * g, mean).max(self.floor).sqrt();
        reading.iter().map(scale).collect()
    }
}

/// What presses say of the map at each place, those at one and the same place together: the force of each is its weight.
fn places(map: &ResponseMap, known: &[KnownPress], noise: &[f64]) -> Vec<RemainderPlace> {
    let scales = Scales::of(map);
    let channels = map.channels();
    let mut order: Vec<usize> = Vec::new();
    let mut of_place: std::collections::HashMap<[u64; 3], usize> = std::collections::HashMap::new();
    let mut sums: Vec<Vec<[f64; 2]>> = Vec::new();
    for (k, press) in known.iter().enumerate() {
        let key = map.mesh.point(press.at).to_array().map(f64::to_bits);
        let place = *of_place.entry(key).or_insert_with(|| {
            order.push(k);
            sums.push(vec![[0.0; 2]; channels]);
            sums.len() - 1
        });
        for (sum, x) in sums[place].iter_mut().zip(&press.reading) {
            if x.is_finite() {
                sum[0] += press.force * x;
                sum[1] += press.force * press.force;
            }
        }
    }
    let place = |(&k, sums): (&usize, &Vec<[f64; 2]>)| {
        let reading = map.at(known[k].at);
        let scale = scales.at(&reading);
        let read = |c: usize| sums[c][1] > 0.0;
        let off = |c: usize| (sums[c][0] / sums[c][1] - reading[c]) / scale[c];
        let left = |c: usize| (noise[c] / scale[c]).powi(2) / sums[c][1];
        let or = |c: usize, value: &dyn Fn(usize) -> f64, without: f64| {
            if read(c) { value(c) } else { without }
        };
        RemainderPlace {
            position: map.mesh.point(known[k].at),
            off: (0..channels).map(|c| or(c, &off, 0.0)).collect(),
            noise: (0..channels).map(|c| or(c, &left, f64::INFINITY)).collect(),
        }
    };
    order.iter().zip(&sums).map(place).collect()
}

/// The nearest of some places, nearest first; of two as near the first.
fn nearest(
    places: &[RemainderPlace],
    among: impl Iterator<Item = usize>,
    to: DVec3,
    most: usize,
) -> Vec<usize> {
    let mut all: Vec<(f64, usize)> = among
        .map(|k| (places[k].position.distance_squared(to), k))
        .collect();
    let nearer = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if all.len() > most {
        all.select_nth_unstable_by(most - 1, nearer);
        all.truncate(most);
    }
    all.sort_unstable_by(nearer);
    all.into_iter().map(|(_, k)| k).collect()
}

/// Matérn's correlation of order 5/2 at a distance in lengths.
#[must_use]
pub fn matern(distance: f64) -> f64 {
    let r = 5.0_f64.sqrt() * distance;
    (1.0 + r + r * r / 3.0) * (-r).exp()
}

/// Correlations among some places, and with one more.
struct CorrelationBlock {
    among: DMatrix<f64>,
    with: DVector<f64>,
}

impl CorrelationBlock {
    fn new(places: &[RemainderPlace], near: &[usize], at: DVec3, length: f64) -> Self {
        let position = |k: usize| places[near[k]].position;
        let count = near.len();
        let mut among = DMatrix::identity(count, count);
        for i in 0..count {
            for j in 0..i {
                let m = matern(position(i).distance(position(j)) / length);
                (among[(i, j)], among[(j, i)]) = (m, m);
            }
        }
        let with = DVector::from_fn(count, |k, _| matern(position(k).distance(at) / length));
        Self { among, with }
    }

    /// Mean and variance of a channel's z there. Nothing where numbers overflow.
    fn foresee(
        &self,
        places: &[RemainderPlace],
        near: &[usize],
        channel: usize,
        settings: &RemainderSettings,
    ) -> Option<[f64; 2]> {
        let prior = settings.share * settings.share;
        let own = settings.scatter * settings.scatter;
        let read: Vec<usize> = (0..near.len())
            .filter(|&k| places[near[k]].noise[channel].is_finite())
            .collect();
        if read.is_empty() {
            return Some([0.0, prior]);
        }
        let count = read.len();
        let mut covariance =
            DMatrix::from_fn(count, count, |i, j| prior * self.among[(read[i], read[j])]);
        for (k, &i) in read.iter().enumerate() {
            covariance[(k, k)] += own + places[near[i]].noise[channel];
        }
        let factor = covariance.cholesky()?;
        let with = DVector::from_fn(count, |k, _| prior * self.with[read[k]]);
        let off = DVector::from_fn(count, |k, _| places[near[read[k]]].off[channel]);
        let weights = factor.solve(&with);
        let said = [weights.dot(&off), prior - weights.dot(&with)];
        said.iter().all(|v| v.is_finite()).then_some(said)
    }
}

/// The search for settings.
struct RemainderSearch<'a> {
    places: &'a [RemainderPlace],
    /// The places that are foreseen, each from these before it.
    before: Vec<(usize, Vec<usize>)>,
    /// Of the part (m).
    size: f64,
}

/// What is thought of ρ, ℓ over the part's size, and ν before anything is seen: the middle, and how many times more or
/// less it may well be (natural logarithm).
const USUAL: [(f64, f64); 3] = [(0.05, 1.5), (0.15, 1.0), (0.02, 1.5)];

impl<'a> RemainderSearch<'a> {
    fn new(places: &'a [RemainderPlace], size: f64) -> Self {
        let searched = evenly(places.len(), SEARCHED);
        let before = (0..searched.len())
            .into_par_iter()
            .map(|k| {
                let earlier = searched[..k].iter().copied();
                let k = searched[k];
                (k, nearest(places, earlier, places[k].position, BEFORE))
            })
            .collect();
        Self {
            places,
            before,
            size,
        }
    }

    fn settings(&self, logs: [f64; 3]) -> RemainderSettings {
        let [share, length, scatter] = logs.map(f64::exp);
        RemainderSettings {
            share,
            length: length * self.size,
            scatter,
        }
    }

    /// The settings whose posterior is highest: along one direction after the other, in ever smaller steps.
    fn best(&self, watch: Watch) -> Result<RemainderSettings, Cancelled> {
        let mut best = USUAL.map(|(middle, _)| f64::ln(middle));
        let mut highest = self.posterior(best);
        let mut step = FIRST_STEP;
        while step >= LAST_STEP {
            report(watch, "Learning how far the model is off", 0, 1)?;
            let before = highest;
            for k in 0..best.len() {
                for sign in [1.0, -1.0] {
                    let mut tried = best;
                    tried[k] += sign * step;
                    let found = self.posterior(tried);
                    if found > highest {
                        (best, highest) = (tried, found);
                        break;
                    }
                }
            }
            if highest <= before {
                step /= 2.0;
            }
        }
        Ok(self.settings(best))
    }

    /// Logarithm of the posterior density, but for a constant.
    fn posterior(&self, logs: [f64; 3]) -> f64 {
        let settings = self.settings(logs);
        let said: Vec<f64> = (self.before.par_iter())
            .map(|(k, before)| self.likelihood(*k, before, &settings))
            .collect();
        let prior: f64 = (logs.iter().zip(USUAL))
            .map(|(log, (middle, wide))| -0.5 * ((log - middle.ln()) / wide).powi(2))
            .sum();
        said.iter().sum::<f64>() + prior
    }

    /// Of what was read at one place, by what was read before it.
    fn likelihood(&self, k: usize, before: &[usize], settings: &RemainderSettings) -> f64 {
        let place = &self.places[k];
        let block = CorrelationBlock::new(self.places, before, place.position, settings.length);
        let own = settings.scatter * settings.scatter;
        let channels = (0..place.off.len()).filter(|&c| place.noise[c].is_finite());
        channels
            .map(|c| {
                let Some([mean, variance]) = block.foresee(self.places, before, c, settings) else {
                    return f64::NEG_INFINITY;
                };
                let variance = variance.max(0.0) + own + place.noise[c];
                -0.5 * ((place.off[c] - mean).powi(2) / variance + variance.ln())
            })
            .sum()
    }
}

#[cfg(test)]
mod tests;
