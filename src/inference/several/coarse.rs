//! Where to begin: the best pairs of places on a coarse share of the map, all of them looked at, and the best areas.
//!
//! Here all channels are off by shares of the reading, the same for all touches, so that forces have a closed form: with
//! readings a, b of a newton at two places and y of both, whitened,
//!
//! ```text
//! f_a = (a·y b·b - b·y a·b) / (a·a b·b - (a·b)²)        gain = (f_a a·y + f_b b·y) / 2
//! ```

use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::joint::APART;
use super::spot::{RADII, Spot, nodes_near, pressed_over};
use crate::inference::deviation::TouchDoubts;
use crate::inference::map::{LANES, ResponseMap};
use crate::inference::matching::ReadingErrors;
use crate::inference::matching::weighed::Observation;
use crate::lanes::wide;
use crate::mesh::SurfacePoint;
use crate::mesh::sample::even;

/// Places of points and of areas, and sizes of these.
const PLACES: usize = 1280;
const CENTRES: usize = 320;
const SIZES: usize = 5;
/// What readings may be off by because touches are not at these places, over the reading.
const BETWEEN: f64 = 0.05;
/// Two starts are the same where both their places are nearer to each other than this (m).
const SAME: f64 = 8e-3;

/// A share of a map.
pub(super) struct Coarse {
    places: Vec<SurfacePoint>,
    positions: Vec<DVec3>,
    /// Of each place, what every channel reads of a newton (strain).
    readings: Vec<Vec<f64>>,
    areas: Vec<(SurfacePoint, f64, Vec<f64>)>,
    /// What gluing and the making of touches put on readings, over these, in the mean of all places.
    pub making: f64,
}

impl Coarse {
    /// A share of a map, with what its readings may be off by.
    pub fn new(map: &ResponseMap, errors: &ReadingErrors) -> Self {
        let places = even(&map.mesh, PLACES, 0, |_| true);
        let readings: Vec<Vec<f64>> = places.iter().map(|&at| map.at(at)).collect();
        let squares = |rows: &mut dyn Iterator<Item = Vec<f64>>| -> f64 {
            rows.flatten().map(|v| v * v).sum()
        };
        let off = errors.deviations.as_ref().map_or(0.0, |deviations| {
            squares(&mut places.iter().map(|&at| deviations.all.at(at)))
        });
        let all = squares(&mut readings.iter().cloned());
        let sizes: Vec<f64> = (0..SIZES)
            .map(|k| RADII[0] * (RADII[1] / RADII[0]).powf((k as f64 + 0.5) / SIZES as f64))
            .collect();
        let areas = even(&map.mesh, CENTRES, 0, |_| true)
            .par_iter()
            .flat_map_iter(|&at| {
                let (centre, normal) = (map.mesh.point(at), map.mesh.normal(at));
                let nodes = nodes_near(map, centre, RADII[1]);
                let pressed = |radius| pressed_over(map, &nodes, (centre, normal), radius);
                let sized = |&radius: &f64| (at, radius, pressed(radius));
                sizes.iter().map(sized).collect::<Vec<_>>()
            })
            .collect();
        Self {
            positions: places.iter().map(|&at| map.mesh.point(at)).collect(),
            places,
            readings,
            areas,
            making: (off / all.max(f64::MIN_POSITIVE)).sqrt(),
        }
    }

    /// A reading against all of them.
    pub fn against(&self, observed: &Observation, most_force: f64) -> Option<Whitened> {
        let trusted: Vec<usize> = (0..observed.w.len())
            .filter(|&c| observed.w[c] > 0.0)
            .collect();
        let n = trusted.len();
        let x: Vec<f64> = trusted.iter().map(|&c| observed.reading()[c]).collect();
        let sizes: Vec<f64> = trusted.iter().map(|&c| observed.sizes()[c]).collect();
        let mean = sizes.iter().map(|x| x * x).sum::<f64>() / n as f64;
        let mut covariance = DMatrix::from_element(n, n, observed.drift);
        for (k, &c) in trusted.iter().enumerate() {
            covariance[(k, k)] += observed.w[c].recip() + off_between(sizes[k], mean, self.making);
        }
        let whitening = covariance.cholesky()?.l().try_inverse()?;
        let mut whitened = Whitened {
            reading: &whitening * DVector::from_column_slice(&x),
            points: Vec::new(),
            areas: Vec::new(),
            trusted,
            whitening,
            most_force,
        };
        whitened.points = (self.readings.iter()).map(|r| whitened.of(r)).collect();
        whitened.areas = (self.areas.iter())
            .map(|(_, _, r)| whitened.of(r))
            .collect();
        Some(whitened)
    }

    /// The best pairs, apart from each other.
    pub fn pairs(&self, whitened: &Whitened, count: usize) -> Vec<[SurfacePoint; 2]> {
        let blocks = whitened.blocks(&self.positions);
        let count_of = self.places.len();
        let mut best: Vec<(f32, usize, usize)> = (0..count_of)
            .map(|i| {
                let (gain, j) = best_partner(&blocks, i, count_of, whitened.most_force as f32);
                (gain, i, j)
            })
            .filter(|(gain, _, _)| *gain > 0.0)
            .collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut chosen: Vec<[usize; 2]> = Vec::with_capacity(count);
        let near = |i: usize, j: usize| self.positions[i].distance(self.positions[j]) < SAME;
        for (_, i, j) in best {
            let same =
                |[a, b]: &[usize; 2]| (near(*a, i) && near(*b, j)) || (near(*a, j) && near(*b, i));
            if !chosen.iter().any(same) {
                chosen.push([i, j]);
            }
            if chosen.len() == count {
                break;
            }
        }
        let places = chosen.into_iter();
        places.map(|pair| pair.map(|k| self.places[k])).collect()
    }

    /// The best areas, apart from each other.
    pub fn areas(&self, map: &ResponseMap, whitened: &Whitened, count: usize) -> Vec<Spot> {
        let gain = |(k, area): (usize, &DVector<f64>)| {
            let force = area.dot(&whitened.reading) / area.norm_squared();
            let force = force.clamp(0.0, whitened.most_force);
            let gain = force * (area.dot(&whitened.reading) - 0.5 * force * area.norm_squared());
            (gain > 0.0).then_some((gain, k, force))
        };
        let mut best: Vec<(f64, usize, f64)> =
            whitened.areas.iter().enumerate().filter_map(gain).collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut chosen: Vec<Spot> = Vec::with_capacity(count);
        for (_, k, force) in best {
            let (at, radius, _) = self.areas[k];
            let place = map.mesh.point(at);
            let new = |s: &Spot| map.mesh.point(s.at).distance(place) >= 2.0 * SAME;
            if chosen.len() < count && chosen.iter().all(new) {
                chosen.push(Spot {
                    at,
                    force,
                    radius: Some(radius),
                    about: TouchDoubts::default(),
                });
            }
        }
        chosen
    }
}

/// What a channel that reads x (strain) may be off by (strain²) because touches lie between places, and because of how they and
/// their gauges are made, with the mean square of all channels.
pub(super) fn off_between(x: f64, mean: f64, making: f64) -> f64 {
    (BETWEEN * BETWEEN + making * making) * f64::midpoint(x * x, mean)
}

/// A reading, and what is read of a newton at all places, under the covariance that they are compared by.
pub(super) struct Whitened {
    reading: DVector<f64>,
    points: Vec<DVector<f64>>,
    areas: Vec<DVector<f64>>,
    trusted: Vec<usize>,
    whitening: DMatrix<f64>,
    most_force: f64,
}

impl Whitened {
    /// What all channels read, whitened.
    fn of(&self, reading: &[f64]) -> DVector<f64> {
        let picked = self.trusted.iter().map(|&c| reading[c]);
        &self.whitening * DVector::from_iterator(self.trusted.len(), picked)
    }

    fn blocks(&self, positions: &[DVec3]) -> PlaceBlocks {
        let channels = self.reading.len();
        let padded = positions.len().div_ceil(LANES) * LANES;
        let mut blocks = PlaceBlocks {
            channels,
            readings: vec![0.0; padded * channels],
            places: vec![0.0; padded * 3],
            // What fills up the last block explains nothing.
            products: vec![-1.0; padded],
            squares: vec![1.0; padded],
        };
        for (k, (point, place)) in self.points.iter().zip(positions).enumerate() {
            let (block, lane) = (k / LANES, k % LANES);
            for (c, v) in point.iter().enumerate() {
                blocks.readings[(block * channels + c) * LANES + lane] = *v as f32;
            }
            for (c, v) in place.to_array().into_iter().enumerate() {
                blocks.places[(block * 3 + c) * LANES + lane] = v as f32;
            }
            blocks.products[k] = point.dot(&self.reading) as f32;
            blocks.squares[k] = point.norm_squared().max(1e-30) as f32;
        }
        blocks
    }
}

/// All places in blocks of [`LANES`], channel by channel, in single precision.
struct PlaceBlocks {
    channels: usize,
    readings: Vec<f32>,
    places: Vec<f32>,
    products: Vec<f32>,
    squares: Vec<f32>,
}

wide! {
    /// The place after the `i`-th of `count` that together with it explains most, and half of how much of the squares.
    fn best_partner<'a>(blocks: &'a PlaceBlocks, i: usize, count: usize, most: f32) -> (f32, usize) {
        let channels = blocks.channels;
        let (block, lane) = (i / LANES, i % LANES);
        let own: Vec<f32> = (0..channels)
            .map(|c| blocks.readings[(block * channels + c) * LANES + lane])
            .collect();
        let place = [0, 1, 2].map(|c| blocks.places[(block * 3 + c) * LANES + lane]);
        let (s, d) = (blocks.products[i], blocks.squares[i]);
        let apart = (APART * APART) as f32;
        let mut best = (0.0, i);
        for other in block..count.div_ceil(LANES) {
            let readings = &blocks.readings[other * channels * LANES..][..channels * LANES];
            let places = &blocks.places[other * 3 * LANES..][..3 * LANES];
            let products = &blocks.products[other * LANES..][..LANES];
            let squares = &blocks.squares[other * LANES..][..LANES];
            let (mut both, mut away) = ([0.0_f32; LANES], [0.0_f32; LANES]);
            for (row, a) in readings.chunks_exact(LANES).zip(&own) {
                for k in 0..LANES {
                    both[k] += a * row[k];
                }
            }
            for (row, a) in places.chunks_exact(LANES).zip(&place) {
                for k in 0..LANES {
                    away[k] += (row[k] - a) * (row[k] - a);
                }
            }
            let mut gains = [0.0_f32; LANES];
            let mut highest = 0.0_f32;
            for k in 0..LANES {
                let (t, e, c) = (products[k], squares[k], both[k]);
                // Two places that read the same cannot be told apart.
                let determinant = (d * e - c * c).max(0.01 * d * e);
                let first = (s * e - t * c) / determinant;
                let second = (t * d - s * c) / determinant;
                let gain = 0.5 * (first * s + second * t);
                let least = if first < second { first } else { second };
                let largest = if first < second { second } else { first };
                let possible = least > 0.0 && largest < most && away[k] >= apart;
                gains[k] = if possible { gain } else { 0.0 };
                highest = if gains[k] > highest { gains[k] } else { highest };
            }
            if highest > best.0 {
                for k in 0..LANES {
                    if gains[k] > best.0 {
                        best = (gains[k], other * LANES + k);
                    }
                }
            }
        }
        best
    }
}
