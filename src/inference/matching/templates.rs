//! All templates at once: how well each explains a reading, and what they say together.

use glam::DVec3;

use super::kernels::{score_templates, score_with_gluing};
use super::modes::{Mode, TURNS};
use super::weighed::Observation;
use super::{Contact, Load, Matching};
use crate::inference::map::LANES;
use crate::inference::region::CredibleRegion;
use crate::units::{microstrain, microstrain2, per_microstrain, per_microstrain2};

/// Log-likelihoods so far below the best count for nothing.
const NOTHING: f64 = 14.0;

/// Of more templates than these that a reading leaves possible, an even share stands for all: where thousands are as
/// likely, their mean is known to a share of a template.
const LOOKED_AT: usize = 4096;

impl Matching {
    /// How much better than nothing a touch at each template explains the reading. Single precision is in microstrain.
    pub(in crate::inference) fn score(&mut self, observed: &Observation) {
        let weights: Vec<f32> = (observed.w.iter())
            .map(|w| per_microstrain2(*w) as f32)
            .collect();
        let most = self.most_force as f32;
        // To begin with, each channel may be off for itself by what all of them feel together.
        if let Some(deviations) = &self.errors.deviations {
            let reading: Vec<f32> = observed
                .reading()
                .iter()
                .map(|x| microstrain(*x) as f32)
                .collect();
            score_with_gluing(
                [&self.map.templates, &deviations.all.templates],
                &reading,
                &weights,
                microstrain2(observed.drift) as f32,
                most,
                &mut self.scores,
                &mut self.highest,
            );
            return;
        }
        let scaled: Vec<f32> = (observed.reading().iter().zip(&observed.w))
            .map(|(x, w)| per_microstrain(w * x) as f32)
            .collect();
        let [taken, sum] = observed.drifted();
        score_templates(
            &self.map.templates,
            &scaled,
            &weights,
            [microstrain2(taken) as f32, per_microstrain(sum) as f32],
            most,
            &mut self.scores,
            &mut self.highest,
        );
    }

    /// The template with the highest score among those at places that are `allowed`.
    pub(super) fn best_template(&self, allowed: &dyn Fn(DVec3) -> bool) -> Option<usize> {
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

    /// Mean, spread and region over all templates, each with the area it stands for.
    pub(super) fn mean_of_templates(&self, observed: &Observation, best: &Mode) -> Contact {
        let map = &self.map;
        let highest = self.highest.iter().fold(0.0_f32, |m, s| m.max(*s));
        let highest = f64::from(highest).max(0.5 * observed.squares - best.cost);
        let floor = (highest - NOTHING - 1e-5 * highest) as f32;
        let possible: Vec<usize> = (0..map.places.len())
            .filter(|&node| self.scores[node] >= floor)
            .collect();
        let mut places = Vec::new();
        let (mut total, mut centre, mut force, mut squares) = (0.0, DVec3::ZERO, 0.0, 0.0);
        for node in even_share(&possible) {
            let (mean, variance, log_likelihood) = self.force_at(observed, node);
            let weight = map.areas[node] * (log_likelihood - highest).exp();
            places.push((map.places[node], weight));
            total += weight;
            centre += map.places[node] * weight;
            force += weight * mean;
            squares += weight * (mean * mean + variance);
        }
        if total <= 0.0 || !total.is_finite() {
            return self.contact_at(observed, best, false);
        }
        let at = map.mesh.index().nearest(centre / total).0;
        let force = force / total;
        let variance = (squares / total - force * force).max(0.0);
        let region = CredibleRegion::of_places(&places, map.mesh.point(at), map.mesh.normal(at));
        let load = Load {
            force,
            variance,
            drag: DVec3::ZERO,
            drag_deviation: self.errors.usual_drag() * force,
        };
        self.contact(observed, at, load, region, best.cost, false)
    }

    /// Mean and variance of the force at a place, and the log-likelihood with the force integrated out.
    fn force_at(&self, observed: &Observation, node: usize) -> (f64, f64, f64) {
        let g = self.map.node(node);
        let deviation = self.errors.deviations.as_ref().map(|d| d.all.node(node));
        let mut force = deviation.map_or(0.0, |_| observed.first_force(g));
        force = force.clamp(0.0, self.most_force);
        for _ in 0..deviation.map_or(0, |_| TURNS) {
            force = observed.sums(g, deviation, force).fit(self.most_force).0;
        }
        let sums = observed.sums(g, deviation, force);
        let (force, cost) = sums.fit(self.most_force);
        // A force is never known worse than that it lies between nothing and the most.
        let variance = sums.d.max(12.0 * self.most_force.powi(-2)).recip();
        (
            force,
            variance,
            0.5 * observed.squares - cost - sums.log + 0.5 * variance.ln(),
        )
    }
}

/// All of a list, or of a long one a share of it: by multiples of the golden section, for every so many-th would be a
/// row of a regular mesh and miss the next.
fn even_share(all: &[usize]) -> impl Iterator<Item = usize> {
    /// 2³² divided by the golden section (D. Knuth, The Art of Computer Programming 3, 6.4).
    const GOLDEN: u32 = 2_654_435_769;
    let share = all.len().div_ceil(LOOKED_AT).max(1) as u32;
    (all.iter().enumerate())
        .filter(move |(k, _)| (*k as u32).wrapping_mul(GOLDEN) <= u32::MAX / share)
        .map(|(_, &node)| node)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::ReadingErrors;
    use super::super::tests::{CHANNELS, maps};
    use super::*;
    use crate::inference::Deviations;
    use crate::inference::plate::plate;

    /// What a touch at a template explains, in double precision and one by one.
    fn explained(matching: &Matching, observed: &Observation, node: usize) -> f64 {
        let g = matching.map.node(node);
        let deviations = matching.errors.deviations.as_ref();
        let deviation = deviations.map(|d| d.all.node(node));
        let force = matching.fitting_force(observed, g, deviation, &[]);
        let weighed = observed.weighed(deviation, &[], force);
        let measured = observed.measured(&weighed);
        let (s, d) = measured.products(g);
        let left = measured.squares - force * (2.0 * s - force * d);
        0.5 * (observed.squares - left) - weighed.log
    }

    #[test]
    fn where_nothing_is_known_a_share_of_the_templates_says_what_all_say() {
        let map = Arc::new(plate(150, 1e-3, |_| [0.0; CHANNELS]));
        let errors = ReadingErrors::of_noise(1e-6, CHANNELS);
        let mut matching = Matching::new(Arc::clone(&map), errors, 50.0);
        let observed = Observation::new(&[0.0; CHANNELS], &matching.errors, &matching.used);
        matching.score(&observed);
        let start = map.mesh.vertex_point(0);
        let best = matching.follow(&observed, start, None);
        let said = matching.mean_of_templates(&observed, &best);
        let middle = DVec3::new(74.5e-3, 74.5e-3, 0.0);
        assert!(map.places.len() > 4 * LOOKED_AT);
        assert!(said.position.distance(middle) < 1e-3, "{}", said.position);
    }

    #[test]
    fn all_at_once_are_scored_as_one_by_one() {
        let [map, gluing_deviation] = maps();
        let reading = [9e-6, 4e-6, 7e-6, 2e-6];
        for drift in [0.0, 1e-6, 20e-6] {
            for gluing_deviation in [None, Some(Arc::clone(&gluing_deviation))] {
                let errors = ReadingErrors {
                    deviations: gluing_deviation.map(Deviations::of_gluing),
                    drift,
                    ..ReadingErrors::of_noise(1e-6, CHANNELS)
                };
                let mut matching = Matching::new(Arc::clone(&map), errors, 50.0);
                let observed = Observation::new(&reading, &matching.errors, &matching.used);
                matching.score(&observed);
                for node in 0..matching.map.places.len() {
                    let expected = explained(&matching, &observed, node);
                    let score = f64::from(matching.scores[node]);
                    assert!(
                        (score - expected).abs() < 1e-3 * (1.0 + observed.squares),
                        "{score} {expected} {drift}"
                    );
                }
            }
        }
    }
}
