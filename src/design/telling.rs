//! Where presses tell most: a choice by the error that they take off the map, weighed by what that does to places.
//!
//! What is not known of the map is a Gaussian process (`inference::remainder`). A press at q takes
//! cov(z(p), z(q))² / (var z(q) + ν² + n(q)) off the variance at p, n being what the noise of the reading leaves of it (active
//! learning by the integrated variance: D. A. Cohn, Neural Networks 9, 1996). A place counts by how much of its error the map is
//! to blame for: where no gauge feels much, no press makes it better.

use glam::DVec3;
use nalgebra::DMatrix;

use super::taught::Taught;
use crate::inference::remainder::{RemainderSettings, matern};
use crate::inference::{ReadingErrors, cramer_rao};
use crate::regression::folds::evenly;

/// What is thought of a map that nothing was learned of: as [`crate::inference::remainder`] does beforehand, the length as a
/// share of the part.
const SHARE: f64 = 0.05;
const LENGTH: f64 = 0.15;
const SCATTER: f64 = 0.02;

/// Places that are looked at: of more an even share.
const LOOKED_AT: usize = 400;
/// Presses that are counted: of more an even share leaves hardly more open.
const KNOWN: usize = 800;
/// No place is thought to be worse known than this (m), so that those which no gauge sees are not pressed for ever.
const WORST: f64 = 5e-3;

/// So many of the places (m), by number, that tell most when they are pressed with a force (N), where others were pressed
/// already (m); the most telling first.
#[must_use]
pub fn most_telling(
    taught: &Taught,
    places: &[DVec3],
    pressed: &[DVec3],
    count: usize,
    force: f64,
) -> Vec<usize> {
    let count = count.min(LOOKED_AT);
    let some = evenly(places.len(), LOOKED_AT);
    let settings = settings(taught);
    let known = evenly(pressed.len(), KNOWN);
    let all: Vec<DVec3> = (some.iter().map(|&k| places[k]))
        .chain(known.iter().map(|&k| pressed[k]))
        .collect();
    let mut unknown = MapUnknown::new(taught, &all, settings, force);
    for k in some.len()..all.len() {
        unknown.press(k);
    }
    let weights: Vec<f64> = (all[..some.len()].iter())
        .map(|&p| blamed_on_map(taught, p, force, &settings))
        .collect();
    let mut chosen: Vec<usize> = Vec::new();
    for _ in 0..count.min(some.len()) {
        let free = (0..some.len()).filter(|k| !chosen.contains(k));
        let gains = free.map(|k| (unknown.gain(k, &weights), k));
        // Of two that tell as much the first.
        let Some((_, best)) = gains.reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
            break;
        };
        unknown.press(best);
        chosen.push(best);
    }
    chosen.into_iter().map(|k| some[k]).collect()
}

/// As they were learned, or as they are thought to be beforehand.
fn settings(taught: &Taught) -> RemainderSettings {
    let (lower, upper) = taught.map.mesh.bounds();
    taught.known.remainder.unwrap_or(RemainderSettings {
        share: SHARE,
        length: LENGTH * (upper - lower).length(),
        scatter: SCATTER,
    })
}

/// What the map is to blame for, of the squared error (m²) of a touch of a force (N) at a place (m).
fn blamed_on_map(taught: &Taught, place: DVec3, force: f64, settings: &RemainderSettings) -> f64 {
    let RemainderSettings { share, scatter, .. } = *settings;
    squared_error(taught, place, force, share.hypot(scatter))
        - squared_error(taught, place, force, scatter)
}

/// The bound of the squared error (m²) of a touch of a force (N) at a place (m), where the map is off by a share of the reading.
fn squared_error(taught: &Taught, place: DVec3, force: f64, relative: f64) -> f64 {
    let (at, _) = taught.map.mesh.index().nearest(place);
    let reading: Vec<f64> = taught.map.at(at).iter().map(|g| force * g).collect();
    let channels = reading.len();
    let errors = ReadingErrors {
        relative,
        noise: vec![taught.known.noise; channels],
        ..ReadingErrors::of_noise(taught.known.noise, channels)
    };
    let own = taught.own.at(at);
    let noise: Vec<f64> = (errors.weights(&reading, &vec![true; channels]).iter())
        .zip(own)
        .map(|(w, own)| (w.recip() + (force * own).powi(2)).sqrt())
        .collect();
    let (error, _) = cramer_rao(&taught.map, at, force, &noise, &[]);
    error.min(WORST).powi(2)
}

/// What is not known of the map at some places: a covariance.
struct MapUnknown {
    covariance: DMatrix<f64>,
    /// Variance of what a press at each of them has for itself.
    own: Vec<f64>,
}

impl MapUnknown {
    /// Before anything is pressed.
    fn new(taught: &Taught, places: &[DVec3], settings: RemainderSettings, force: f64) -> Self {
        let prior = settings.share * settings.share;
        let covariance = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            prior * matern(places[i].distance(places[j]) / settings.length)
        });
        let own = |&place: &DVec3| {
            let reading = taught.map.at(taught.map.mesh.index().nearest(place).0);
            let squares: f64 = reading.iter().map(|g| (force * g).powi(2)).sum();
            let read = squares / reading.len().max(1) as f64;
            settings.scatter.powi(2) + taught.known.noise.powi(2) / read.max(f64::MIN_POSITIVE)
        };
        Self {
            own: places.iter().map(own).collect(),
            covariance,
        }
    }

    fn read(&self, k: usize) -> f64 {
        self.covariance[(k, k)] + self.own[k] + f64::MIN_POSITIVE
    }

    /// What is left after a press at one of them.
    fn press(&mut self, k: usize) {
        let column = self.covariance.column(k).into_owned();
        let read = self.read(k);
        self.covariance.ger(-1.0 / read, &column, &column, 1.0);
    }

    /// What a press at one of them takes off, over the first of them with these weights.
    fn gain(&self, k: usize, weights: &[f64]) -> f64 {
        let column = self.covariance.column(k);
        let squares: f64 = (column.iter().zip(weights)).map(|(c, w)| w * c * c).sum();
        squares / self.read(k)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::design::TaughtKnowledge;
    use crate::inference::ResponseMap;
    use crate::inference::plate::plate;

    /// A plate of 60 mm with gauges at its corners, of which nothing was learned.
    fn taught() -> Taught {
        let corners = [[0.0, 0.0], [0.06, 0.0], [0.0, 0.06], [0.06, 0.06]];
        let map = plate(13, 5e-3, |p| {
            corners.map(|[x, y]| 1e-5 * (-(p.x - x).hypot(p.y - y).powi(2) / 2e-3).exp())
        });
        let nothing = vec![0.0; map.values().len()];
        let own = ResponseMap::of(Arc::clone(&map.mesh), map.channels(), nothing);
        Taught {
            map: Arc::new(map),
            own: Arc::new(own),
            tip: None,
            axes: None,
            known: TaughtKnowledge {
                noise: 1e-7,
                relative: 0.02,
                most_force: 60.0,
                tip: 0.0,
                friction: 0.0,
                drift: 0.0,
                stiffness: 0.0,
                remainder: None,
            },
            ratios: Vec::new(),
        }
    }

    #[test]
    fn what_was_pressed_is_not_pressed_again_and_presses_keep_apart() {
        let taught = taught();
        let places = taught.map.mesh.positions().to_vec();
        let half: Vec<DVec3> = places.iter().copied().filter(|p| p.x < 0.03).collect();
        let chosen = most_telling(&taught, &places, &half, 8, 20.0);
        let right = chosen.iter().filter(|&&k| places[k].x >= 0.03).count();
        assert!(right >= 7, "{right} of {chosen:?}");
        let apart = |a: usize, b: usize| places[a].distance(places[b]);
        for (i, &a) in chosen.iter().enumerate() {
            assert!(chosen[..i].iter().all(|&b| a != b && apart(a, b) > 4e-3));
        }
        assert_eq!(chosen, most_telling(&taught, &places, &half, 8, 20.0));
        assert_eq!(most_telling(&taught, &places[..3], &[], 8, 20.0).len(), 3);
        assert!(most_telling(&taught, &[], &half, 8, 20.0).is_empty());
    }

    #[test]
    fn a_place_that_the_map_finds_badly_is_pressed_first() {
        let taught = taught();
        // Beside a gauge, and where all of them feel little of each other.
        let places = [DVec3::new(0.005, 0.005, 0.0), DVec3::new(0.03, 0.03, 0.0)];
        let settings = settings(&taught);
        let blamed = places.map(|p| blamed_on_map(&taught, p, 20.0, &settings));
        let worse = usize::from(blamed[1] > blamed[0]);
        assert_eq!(most_telling(&taught, &places, &[], 1, 20.0), [worse]);
        assert!(blamed.iter().all(|e| *e > 0.0 && *e <= WORST * WORST));
    }
}
