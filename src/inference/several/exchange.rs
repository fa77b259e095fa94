//! From starts on a coarse share of the map to its own templates: each spot in turn goes to the template at which all of them
//! together explain most, the others held where they are, until none goes on (block coordinate ascent). A descent along
//! slopes stays on its side of a window or of a ridge, and near a gauge readings change faster than coarse places lie apart.
//!
//! Here all channels are off by shares of the reading, as for the coarse places. With readings a of a newton at a template,
//! B of the other spots and y of all, and h = Bᵀ C⁻¹ a,
//!
//! ```text
//! K = (Bᵀ C⁻¹ B)⁻¹      F = K Bᵀ C⁻¹ y      f = (a·C⁻¹y - F·h) / (a·C⁻¹a - h·K h)
//! ```
//!
//! is the force at the template, and F - f K h are the others' beside it.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::coarse;
use super::joint::APART;
use super::spot::Spot;
use crate::inference::map::{LANES, ResponseMap};
use crate::inference::matching::weighed::Observation;
use crate::lanes::wide;
use crate::mesh::SurfacePoint;
use crate::units::{microstrain2, per_microstrain, per_microstrain2};

/// Times that every spot is looked at again.
const ROUNDS: usize = 3;
/// Half of the weighted squares that it takes to go on.
const GAINED: f64 = 0.01;
/// Spots that one is exchanged beside, at most.
pub(super) const MOST: usize = 2;

/// A reading, and what its channels are weighed by.
pub(super) struct Exchange<'a> {
    map: &'a ResponseMap,
    reading: &'a [f64],
    /// One over the variance of each channel (strain⁻²), but for what all drift by.
    weights: Vec<f64>,
    /// κ (strain²) of C⁻¹ = W - κ W 1 1ᵀ W (J. Sherman and W. J. Morrison 1950).
    taken: f64,
    most_force: f64,
}

/// A place, with what is read of a newton there (strain), and the force (N) that suits it.
#[derive(Clone)]
struct Place {
    at: SurfacePoint,
    position: DVec3,
    reading: Vec<f64>,
    force: f64,
}

/// Places, and half of how much of the weighted squares they explain together.
struct Explained {
    places: Vec<Place>,
    gain: f64,
}

impl Explained {
    fn spots(&self) -> Vec<Spot> {
        let places = self.places.iter();
        places
            .map(|place| Spot::point(place.at, place.force))
            .collect()
    }

    /// Whether it lies at the same places as another, in any order.
    fn lies_at(&self, other: &Self) -> bool {
        let there = |place: &Place| other.places.iter().any(|o| o.at == place.at);
        self.places.iter().all(there)
    }
}

impl<'a> Exchange<'a> {
    /// Of channels that are off by such a share of the reading beside their noise.
    pub fn new(
        map: &'a ResponseMap,
        observed: &'a Observation,
        making: f64,
        most_force: f64,
    ) -> Self {
        let reading = observed.reading();
        let trusted = || (observed.sizes().iter().zip(&observed.w)).filter(|(_, w)| **w > 0.0);
        let mean = trusted().map(|(x, _)| x * x).sum::<f64>() / trusted().count().max(1) as f64;
        let weight = |(x, w): (&f64, &f64)| {
            let variance = w.recip() + coarse::off_between(*x, mean, making);
            if *w > 0.0 { variance.recip() } else { 0.0 }
        };
        let weights: Vec<f64> = (observed.sizes().iter().zip(&observed.w))
            .map(weight)
            .collect();
        Self {
            map,
            reading,
            taken: observed.drift / (1.0 + observed.drift * weights.iter().sum::<f64>()),
            weights,
            most_force,
        }
    }

    /// Where spots go from several starts, so many at most: those that explain most, each with the forces that suit it.
    pub fn settled(
        &self,
        starts: impl Iterator<Item = Vec<SurfacePoint>>,
        most: usize,
    ) -> Vec<Vec<Spot>> {
        let mut settled: Vec<Explained> = starts
            .map(|start| self.settle(&start))
            .filter(|settled| settled.gain > 0.0)
            .collect();
        settled.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut apart: Vec<Explained> = Vec::with_capacity(most);
        for next in settled {
            if apart.len() < most && !apart.iter().any(|other| other.lies_at(&next)) {
                apart.push(next);
            }
        }
        apart.iter().map(Explained::spots).collect()
    }

    /// Some spots, and one more where it explains most beside them; nothing where none does.
    pub fn with_one_more(&self, spots: &[Spot]) -> Option<Vec<Spot>> {
        let places: Vec<Place> = spots.iter().map(|spot| self.place(spot.at)).collect();
        let another = self.with_another(places)?;
        (another.gain > 0.0).then(|| another.spots())
    }

    /// Places and forces (N) of one more that explains most beside spots of which it is known what a newton reads (strain), the
    /// best first, apart from each other.
    pub fn beside(&self, known: &[(Spot, Vec<f64>)], count: usize) -> Vec<Spot> {
        let place = |(spot, reading): &(Spot, Vec<f64>)| Place {
            reading: reading.clone(),
            ..self.place(spot.at)
        };
        let places: Vec<Place> = known.iter().map(place).collect();
        let Some(mut held) = self.hold(&places) else {
            return Vec::new();
        };
        let mut found = Vec::with_capacity(count);
        while found.len() < count {
            let (gain, node) = best_beside(&self.map.templates, &self.map.places, &held);
            if gain <= 0.0 {
                break;
            }
            held.positions.push(self.map.places[node]);
            let at = self.map.mesh.vertex_point(node);
            let all = [&places[..], &[self.place(at)]].concat();
            let with_it = self.explained(all).places;
            found.extend(with_it.last().map(|p| Spot::point(at, p.force)));
        }
        found
    }

    /// Where spots go from a start.
    fn settle(&self, start: &[SurfacePoint]) -> Explained {
        let mut best = self.explained(start.iter().map(|&at| self.place(at)).collect());
        // Until all of them have been looked at and none has gone on.
        let mut idle = 0;
        for _ in 0..ROUNDS * start.len() {
            best.places.rotate_left(1);
            let others = &best.places[..start.len() - 1];
            let next = self.with_another(others.to_vec());
            if let Some(next) = next.filter(|next| next.gain > best.gain + GAINED) {
                // The one that has gone on is where it is best.
                (best, idle) = (next, 1);
            } else {
                idle += 1;
            }
            if idle == start.len() {
                break;
            }
        }
        best
    }

    fn place(&self, at: SurfacePoint) -> Place {
        Place {
            at,
            position: self.map.mesh.point(at),
            reading: self.map.at(at),
            force: 0.0,
        }
    }

    /// Some places that are held, and the best one beside them as the last.
    fn with_another(&self, mut places: Vec<Place>) -> Option<Explained> {
        let held = self.hold(&places)?;
        let (gain, node) = best_beside(&self.map.templates, &self.map.places, &held);
        (gain > 0.0).then(|| {
            places.push(self.place(self.map.mesh.vertex_point(node)));
            self.explained(places)
        })
    }

    /// C⁻¹ times a value for each channel.
    fn weighed(&self, values: &[f64]) -> Vec<f64> {
        let alone: Vec<f64> = (values.iter().zip(&self.weights))
            .map(|(v, w)| v * w)
            .collect();
        let shared = self.taken * alone.iter().sum::<f64>();
        let pairs = alone.iter().zip(&self.weights);
        pairs.map(|(v, w)| v - shared * w).collect()
    }

    /// Bᵀ C⁻¹ B and Bᵀ C⁻¹ y.
    fn products(&self, places: &[Place]) -> (DMatrix<f64>, DVector<f64>) {
        let weighed: Vec<Vec<f64>> = (places.iter())
            .map(|place| self.weighed(&place.reading))
            .collect();
        let count = places.len();
        (
            DMatrix::from_fn(count, count, |i, j| dot(&weighed[i], &places[j].reading)),
            DVector::from_fn(count, |i, _| dot(&weighed[i], self.reading)),
        )
    }

    /// The best forces at some places. Nothing is explained where one of them would pull, or press too hard.
    fn explained(&self, mut places: Vec<Place>) -> Explained {
        let (products, with_reading) = self.products(&places);
        let forces = products.cholesky().map(|c| c.solve(&with_reading));
        let is_possible = |force: &f64| *force > 0.0 && *force <= self.most_force;
        let possible = forces.filter(|forces| forces.iter().all(is_possible));
        let gain = possible.map_or(0.0, |forces| {
            for (place, force) in places.iter_mut().zip(forces.iter()) {
                place.force = *force;
            }
            0.5 * forces.dot(&with_reading)
        });
        Explained { places, gain }
    }

    /// Some places, beside which another is searched for.
    fn hold(&self, others: &[Place]) -> Option<HeldPlaces> {
        debug_assert!(others.len() <= MOST, "no more are held in the inner loop");
        let (products, with_reading) = self.products(others);
        let inverse = products.cholesky()?.inverse();
        let forces = &inverse * with_reading;
        let single = |values: &[f64]| -> Vec<f32> {
            let weighed = self.weighed(values).into_iter();
            weighed.map(|v| per_microstrain(v) as f32).collect()
        };
        let of_other = |k: usize| {
            others
                .get(k)
                .map_or_else(|| vec![0.0; self.reading.len()], |p| single(&p.reading))
        };
        // K (N²) and F (N) hold no strain, and are not scaled.
        let known = |i: usize, j: usize| inverse.get((i, j)).map_or(0.0, |v| *v as f32);
        Some(HeldPlaces {
            positions: others.iter().map(|place| place.position).collect(),
            weights: (self.weights.iter())
                .map(|w| per_microstrain2(*w) as f32)
                .collect(),
            taken: microstrain2(self.taken) as f32,
            reading: single(self.reading),
            readings: [0, 1].map(of_other),
            inverse: [[known(0, 0), known(0, 1)], [known(1, 0), known(1, 1)]],
            forces: [0, 1].map(|k| forces.get(k).map_or(0.0, |f| *f as f32)),
            most_force: self.most_force as f32,
        })
    }
}

/// Places that are held while another is searched for, in single precision and microstrain.
struct HeldPlaces {
    positions: Vec<DVec3>,
    weights: Vec<f32>,
    taken: f32,
    /// C⁻¹ y and the columns of C⁻¹ B.
    reading: Vec<f32>,
    readings: [Vec<f32>; MOST],
    /// K and F.
    inverse: [[f32; MOST]; MOST],
    forces: [f32; MOST],
    most_force: f32,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Templates whose sums are held in registers at a time.
const PART: usize = 16;
const _: () = assert!(LANES.is_multiple_of(PART), "parts fill a block");

wide! {
    /// Half of how much more of the weighted squares the best template beside others explains than they do alone, and which
    /// it is.
    fn best_beside<'a>(templates: &'a [f32], places: &'a [DVec3], held: &'a HeldPlaces) -> (f32, usize) {
        let channels = held.reading.len();
        let [[k00, k01], [k10, k11]] = held.inverse;
        let ([f0, f1], most) = (held.forces, held.most_force);
        let mut best = (0.0_f32, 0);
        for (block, rows) in templates.chunks_exact(LANES * channels).enumerate() {
            for at in (0..LANES).step_by(PART) {
                let (mut s, mut d) = ([0.0_f32; PART], [f32::MIN_POSITIVE; PART]);
                let (mut h0, mut h1, mut g) = ([0.0_f32; PART], [0.0_f32; PART], [0.0_f32; PART]);
                for c in 0..channels {
                    let row = &rows[c * LANES + at..][..PART];
                    let (p, w) = (held.reading[c], held.weights[c]);
                    let [q0, q1] = [held.readings[0][c], held.readings[1][c]];
                    for k in 0..PART {
                        s[k] += p * row[k];
                        h0[k] += q0 * row[k];
                        h1[k] += q1 * row[k];
                        g[k] += w * row[k];
                        d[k] += w * row[k] * row[k];
                    }
                }
                let mut gains = [0.0_f32; PART];
                let mut highest = 0.0_f32;
                for k in 0..PART {
                    let own = d[k] - held.taken * g[k] * g[k];
                    let c0 = k00 * h0[k] + k01 * h1[k];
                    let c1 = k10 * h0[k] + k11 * h1[k];
                    let left = s[k] - f0 * h0[k] - f1 * h1[k];
                    // Two places that read the same cannot be told apart.
                    let beside = (own - c0 * h0[k] - c1 * h1[k]).max(0.01 * own);
                    let force = left / beside;
                    let (o0, o1) = (f0 - force * c0, f1 - force * c1);
                    let least = o0.min(o1);
                    let largest = o0.max(o1).max(force);
                    let is_possible = force > 0.0 && least >= 0.0 && largest <= most;
                    gains[k] = if is_possible { 0.5 * force * left } else { 0.0 };
                    highest = highest.max(gains[k]);
                }
                if highest > best.0 {
                    for k in 0..PART {
                        let node = block * LANES + at + k;
                        if gains[k] > best.0 && node < places.len() {
                            let away = |p: &DVec3| p.distance_squared(places[node]) >= APART * APART;
                            if held.positions.iter().all(away) {
                                best = (gains[k], node);
                            }
                        }
                    }
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::plate::{CHANNELS, gauged_plate, read_touches};

    #[test]
    fn the_inner_loop_finds_what_trying_all_finds() {
        let map = gauged_plate();
        let errors = ReadingErrors {
            drift: 2e-6,
            ..ReadingErrors::of_noise(1e-6, CHANNELS)
        };
        for touches in [
            vec![(95, 8.0), (610, 12.0)],
            vec![(95, 8.0), (610, 12.0), (772, 9.0)],
        ] {
            let reading = read_touches(&map, &touches);
            let observed = Observation::new(&reading, &errors, &[true; CHANNELS]);
            let exchange = Exchange::new(&map, &observed, 0.05, 60.0);
            let at = |node: usize| exchange.place(map.mesh.vertex_point(node));
            // Of which the first is not where it is held.
            let nodes = [97, 610].into_iter().take(touches.len() - 1);
            let others: Vec<Place> = nodes.map(at).collect();
            let held = exchange.hold(&others).unwrap();
            let (gain, node) = best_beside(&map.templates, &map.places, &held);
            let alone = exchange.explained(others.clone()).gain;
            let more = |node: &usize| {
                let away = |p: &Place| p.position.distance(map.places[*node]) >= APART;
                let all: Vec<Place> = others.iter().cloned().chain([at(*node)]).collect();
                others
                    .iter()
                    .all(away)
                    .then(|| exchange.explained(all).gain - alone)
            };
            let tried = (0..map.places.len()).filter_map(|n| more(&n).map(|gain| (n, gain)));
            let best = tried.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            assert_eq!(node, best.0);
            assert!(
                (f64::from(gain) / best.1 - 1.0).abs() < 1e-3,
                "{gain} {best:?}"
            );
        }
    }

    #[test]
    fn spots_go_to_where_they_are_from_far_away() {
        let map = gauged_plate();
        let touches = [(95, 8.0), (610, 12.0)];
        let reading = read_touches(&map, &touches);
        let errors = ReadingErrors::of_noise(1e-6, CHANNELS);
        let observed = Observation::new(&reading, &errors, &[true; CHANNELS]);
        let exchange = Exchange::new(&map, &observed, 0.0, 60.0);
        let is_found = |found: &[Spot]| {
            touches.iter().all(|&(node, force)| {
                let is_there = |spot: &Spot| {
                    let off = map.mesh.point(spot.at).distance(map.places[node]);
                    off < 1e-6 && (spot.force - force).abs() < 0.01 * force
                };
                found.iter().any(is_there)
            })
        };
        let start = |nodes: [usize; 2]| nodes.map(|node| map.mesh.vertex_point(node)).to_vec();
        // One of them is twenty millimetres off; and two starts that lead to the same are one.
        let starts = [start([105, 610]), start([103, 610])];
        let found = exchange.settled(starts.into_iter(), 4);
        assert!(found.len() == 1 && is_found(&found[0]), "{found:?}");
        let one = Spot::point(map.mesh.vertex_point(610), 1.0);
        let both = exchange.with_one_more(&[one]).unwrap();
        assert!(is_found(&both), "{both:?}");
        // Where nobody presses so hard nothing is explained.
        let exchange = Exchange::new(&map, &observed, 0.0, 1e-6);
        assert!(
            exchange
                .settled([start([95, 610])].into_iter(), 1)
                .is_empty()
        );
    }
}
