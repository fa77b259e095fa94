//! Which touches a set of gauges takes for each other: the posterior over all places for a press that is read without
//! noise. Noise then decides between places that read alike, so that what is said here is the middle of what happens.

use glam::DVec3;
use rayon::prelude::*;

use super::bank::Bank;
use super::scene::{OWN, TouchScene};
use crate::budget::{Cancelled, Watch, report};

/// Where a press could be taken to be, beside where it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Mistaken {
    /// mm.
    pub place_mm: DVec3,
    /// From the press.
    pub apart_mm: f64,
    /// Probability.
    pub share: f64,
}

/// Two places of which the first is taken for the second.
#[derive(Clone, Debug, PartialEq)]
pub struct MistakenPair {
    /// Where the touch is (mm).
    pub from_mm: DVec3,
    /// Where it is taken to be.
    pub taken: Mistaken,
}

impl MistakenPair {
    /// What the confusion adds to the expected error of a press there (mm).
    #[must_use]
    pub fn cost_mm(&self) -> f64 {
        self.taken.share * self.taken.apart_mm
    }

    /// Whether it says next to the same as another, in whichever direction.
    fn repeats(&self, other: &Self, near_mm: f64) -> bool {
        let ends = [self.from_mm, self.taken.place_mm];
        let [a, b] = [other.from_mm, other.taken.place_mm];
        let near = |p: DVec3, q: DVec3| p.distance(q) <= near_mm;
        near(ends[0], a) && near(ends[1], b) || near(ends[0], b) && near(ends[1], a)
    }
}

/// The probability of each place of a scene for one of its presses, were it as hard as a force (N): they sum to one.
#[must_use]
pub fn posterior(scene: &TouchScene, set: &[usize], press: usize, force: f64) -> Vec<f64> {
    let costs = Bank::costs(scene, set, press, force);
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = costs.iter().map(|c| (least - c).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}

/// What a press of some force (N) could be taken for, the likeliest first: places that stand together are one.
#[must_use]
pub fn taken_for(scene: &TouchScene, set: &[usize], press: usize, force: f64) -> Vec<Mistaken> {
    /// Below this nobody needs to know.
    const LEAST: f64 = 0.01;
    const MOST: usize = 6;
    /// Places that are less likely add nothing to their neighbours.
    const NOTHING: f64 = 1e-4;
    let shares = posterior(scene, set, press, force);
    let here = scene.presses[press].position;
    let elsewhere = |k: &usize| {
        let place = &scene.places[*k];
        shares[*k] > NOTHING && place.position.distance(here) > OWN * place.reach
    };
    let mut order: Vec<usize> = (0..shares.len()).filter(elsewhere).collect();
    order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]).then(a.cmp(&b)));
    let mut found: Vec<Mistaken> = Vec::new();
    for k in order {
        let place = &scene.places[k];
        let near = |m: &&mut Mistaken| m.place_mm.distance(place.position) <= OWN * place.reach;
        match found.iter_mut().find(near) {
            Some(known) => known.share += shares[k],
            None => found.push(Mistaken {
                place_mm: place.position,
                apart_mm: place.position.distance(here),
                share: shares[k],
            }),
        }
    }
    found.retain(|m| m.share >= LEAST);
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found.truncate(MOST);
    found
}

/// The confusions that cost most at a force (N), the worst first; those that say the same are one.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn worst_pairs(
    scene: &TouchScene,
    set: &[usize],
    force: f64,
    watch: Watch,
) -> Result<Vec<MistakenPair>, Cancelled> {
    const MOST: usize = 8;
    /// Ends of pairs that are nearer than so many reaches say the same.
    const NEAR: f64 = 4.0;
    let worst = |press: usize| -> Result<Option<MistakenPair>, Cancelled> {
        report(watch, "Looking for confusions", 0, 1)?;
        let pairs = taken_for(scene, set, press, force).into_iter();
        let pairs = pairs.map(|taken| MistakenPair {
            from_mm: scene.presses[press].position,
            taken,
        });
        Ok(pairs.max_by(|a, b| a.cost_mm().total_cmp(&b.cost_mm())))
    };
    let found: Result<Vec<Option<MistakenPair>>, Cancelled> = (0..scene.presses.len())
        .into_par_iter()
        .map(worst)
        .collect();
    let mut all: Vec<MistakenPair> = found?.into_iter().flatten().collect();
    // Stable: those of equal cost stay in the order of the presses.
    all.sort_by(|a, b| b.cost_mm().total_cmp(&a.cost_mm()));
    let reach: f64 = scene.places.iter().map(|p| p.reach).sum();
    let near = NEAR * reach / scene.places.len().max(1) as f64;
    let mut worst: Vec<MistakenPair> = Vec::new();
    for pair in all {
        if worst.len() == MOST {
            break;
        }
        if !worst.iter().any(|w| pair.repeats(w, near)) {
            worst.push(pair);
        }
    }
    Ok(worst)
}

#[cfg(test)]
mod tests {
    use super::super::hand::tests::plate;
    use super::*;
    use crate::budget::unwatched;

    #[test]
    fn the_posterior_sums_to_one_and_knows_the_place() {
        let scene = plate();
        let sets: [&[usize]; 3] = [&[], &[0], &[0, 1, 2, 3, 4]];
        for press in [0, 17, 42] {
            for set in sets {
                let sum: f64 = posterior(&scene, set, press, 8.0).iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum}");
            }
            // Five gauges that all hear it leave no doubt.
            let shares = posterior(&scene, &[0, 1, 2, 3, 4], press, 8.0);
            let here = scene.presses[press].position;
            let near = scene.places.iter().zip(&shares);
            let own: f64 = near
                .filter(|(p, _)| p.position.distance(here) <= 2.0 * OWN * p.reach)
                .map(|(_, share)| share)
                .sum();
            assert!(own > 0.95, "{own}");
        }
    }

    #[test]
    fn one_gauge_cannot_tell_which_side_of_it_was_touched() {
        let scene = plate();
        let pairs = worst_pairs(&scene, &[0], 8.0, &unwatched).unwrap();
        assert!(!pairs.is_empty() && pairs.len() <= 8);
        for pair in &pairs {
            assert!(pair.taken.share > 0.0 && pair.taken.share <= 1.0);
            let apart = pair.from_mm.distance(pair.taken.place_mm);
            assert!((apart - pair.taken.apart_mm).abs() < 1e-9);
        }
        let costs: Vec<f64> = pairs.iter().map(MistakenPair::cost_mm).collect();
        assert!(costs.is_sorted_by(|a, b| a >= b), "{costs:?}");
        let few = worst_pairs(&scene, &[0, 1, 2, 3, 4], 8.0, &unwatched).unwrap();
        let cost = |pairs: &[MistakenPair]| pairs.first().map_or(0.0, MistakenPair::cost_mm);
        assert!(cost(&few) < cost(&pairs));
    }

    #[test]
    fn confusions_are_the_same_on_any_number_of_threads() {
        let scene = plate();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            pool.install(|| worst_pairs(&scene, &[0, 2], 8.0, &unwatched).unwrap())
        };
        assert_eq!(with(1), with(2));
    }
}
