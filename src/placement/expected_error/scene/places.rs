//! Places that touches come to, chosen from all over the part, and what each of them stands for.

use glam::DVec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::around::longest;
use crate::bounds::Bounds;
use crate::draw::normal;

/// Forces that presses have, evenly between the lightest and the hardest by their logarithm.
const LEVELS: usize = 3;
/// What a place stands for reaches so far, over the distance of its neighbours: normal distributions around a lattice
/// of places then add up to an even one, to a few thousandths.
pub(super) const REACH: f64 = 0.65;

/// A place that a touch may come to.
#[derive(Clone, Copy, Debug)]
pub(in crate::placement::expected_error) struct ScenePlace {
    /// mm.
    pub position: DVec3,
    /// Standard deviation along the surface (mm) of where a touch is that this place stands for.
    pub reach: f64,
    /// How likely it is that a touch comes here.
    pub mass: f64,
}

/// Places nearer to a press than so many of their reaches are the press's own: around those beyond, the normal
/// distribution does not come as far as the press, which they would explain as well as its own place does.
pub(in crate::placement::expected_error) const OWN: f64 = 2.5;

/// What stands around a press.
#[derive(Clone, Debug)]
pub(in crate::placement::expected_error) struct Neighbourhood {
    /// The places that are its own.
    pub own: Vec<u32>,
    /// How likely it is that a touch comes to one of them.
    pub own_mass: f64,
    /// Standard deviation along the surface (mm) of where the press is, before anything is read.
    pub reach: f64,
}

impl Neighbourhood {
    pub(super) fn of(press: &ScenePlace, places: &[ScenePlace]) -> Self {
        let away = |p: &ScenePlace| p.position.distance_squared(press.position);
        let is_own = |p: &ScenePlace| away(p) <= (OWN * p.reach).powi(2);
        let own = || (places.iter().enumerate()).filter(|(_, p)| is_own(p));
        let mass: f64 = own().map(|(_, p)| p.mass).sum();
        let nearest = places.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        Self {
            own: own().map(|(k, _)| k as u32).collect(),
            own_mass: if mass > 0.0 { mass } else { press.mass },
            // As a disc of that radius.
            reach: nearest.map_or(1.0, |p| p.reach) * OWN / 2.0,
        }
    }
}

/// Presses of one force.
pub(in crate::placement::expected_error) struct ForceLevel {
    /// N; 1 where forces do not matter.
    pub force: f64,
    /// Of the presses.
    pub presses: std::ops::Range<usize>,
}

/// Every third of some places, then the next of every three, and so on: however data are ordered, each force comes
/// everywhere.
pub(super) fn in_turns(places: &[usize]) -> Vec<usize> {
    let turn = move |first: usize| places.iter().skip(first).step_by(LEVELS).copied();
    (0..LEVELS).flat_map(turn).collect()
}

/// A third of the presses for each force.
pub(super) fn levels(presses: usize, range: Option<[f64; 2]>) -> Vec<ForceLevel> {
    let Some([lightest, hardest]) = range else {
        return vec![ForceLevel {
            force: 1.0,
            presses: 0..presses,
        }];
    };
    (0..LEVELS)
        .map(|k| {
            let share = (k as f64 + 0.5) / LEVELS as f64;
            ForceLevel {
                force: lightest * (hardest / lightest).powf(share),
                presses: k * presses / LEVELS..(k + 1) * presses / LEVELS,
            }
        })
        .collect()
}

/// Noise of unit deviation: turns of gauges × presses.
pub(super) fn draws(turns: usize, presses: usize, seed: u64) -> Vec<f32> {
    const SEED: u64 = 0xd4a3;
    (0..turns)
        .flat_map(|turn| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(SEED));
            rng.set_stream(turn as u64);
            (0..presses)
                .map(move |_| normal(&mut rng) as f32)
                .collect::<Vec<_>>()
        })
        .collect()
}

/// At most `count` of some places, each as far as possible from those before it; the first is the one farthest from
/// the middle.
pub(super) fn farthest_first(positions: &[DVec3], among: &[usize], count: usize) -> Vec<usize> {
    let middle = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
    let mut away: Vec<f64> = (among.iter())
        .map(|&k| positions[k].distance_squared(middle))
        .collect();
    let count = count.min(among.len());
    let mut order = Vec::with_capacity(count);
    while order.len() < count {
        let mut next = 0;
        for k in 1..away.len() {
            if away[k] > away[next] {
                next = k;
            }
        }
        let first = order.is_empty();
        let centre = positions[among[next]];
        for (a, &k) in away.iter_mut().zip(among) {
            let here = positions[k].distance_squared(centre);
            *a = if first { here } else { a.min(here) };
        }
        away[next] = f64::NEG_INFINITY;
        order.push(among[next]);
    }
    order
}

/// Puts places into an order in which those that follow each other lie together: halves along the longest extent,
/// and each of them again.
pub(super) fn in_neighbourhoods(places: &mut [usize], positions: &[DVec3]) {
    if places.len() <= 2 {
        return;
    }
    let axis = longest(Bounds::around(places.iter().map(|&k| positions[k])).size());
    places.sort_by(|&a, &b| {
        positions[a][axis]
            .total_cmp(&positions[b][axis])
            .then(a.cmp(&b))
    });
    let (low, high) = places.split_at_mut(places.len() / 2);
    in_neighbourhoods(low, positions);
    in_neighbourhoods(high, positions);
}

/// Some of the places with what each stands for: the places that are nearest to it, each of which has some weight.
pub(super) fn standing(positions: &[DVec3], weights: &[f64], of: &[usize]) -> Vec<ScenePlace> {
    let nearest = |at: &DVec3| {
        let away = |k: &usize| positions[of[*k]].distance_squared(*at);
        (0..of.len()).min_by(|a, b| away(a).total_cmp(&away(b)))
    };
    let owners: Vec<Option<usize>> = positions.par_iter().map(nearest).collect();
    let mut masses = vec![0.0; of.len()];
    let all: f64 = weights.iter().sum();
    for (owner, weight) in owners.into_iter().zip(weights) {
        if let Some(owner) = owner {
            masses[owner] += weight / all;
        }
    }
    of.par_iter()
        .zip(masses)
        .map(|(&at, mass)| ScenePlace {
            position: positions[at],
            reach: REACH * spacing(positions, of.iter().copied(), at),
            mass,
        })
        .collect()
}

/// How far the nearest others are away (mm), of six the mean.
pub(super) fn spacing(positions: &[DVec3], of: impl Iterator<Item = usize>, at: usize) -> f64 {
    const OTHERS: usize = 6;
    let mut away: Vec<f64> = (of.filter(|&o| o != at))
        .map(|o| positions[o].distance(positions[at]))
        .collect();
    away.sort_by(f64::total_cmp);
    away.truncate(OTHERS);
    away.iter().sum::<f64>() / away.len().max(1) as f64
}
