//! How much of the surface is blind: where a light touch moves no gauge that is trusted far enough above its noise.

use crate::inference::Matching;
use crate::uncertainty::BLIND;

/// A light touch (N), as designs are judged by where nothing else is asked for.
pub const LIGHT_N: f64 = 3.0;
/// Blind share that is worth a word, and by how much more it has to be for another.
const MUCH: f64 = 0.1;
/// Seconds that it stays so before it is told, and that it is better before it may be told again: gauges that are left out for a
/// moment are none of it.
const LASTS_S: f64 = 0.5;
const FORGOTTEN_S: f64 = 10.0;
/// A noise that is this many times what it was, or the inverse, is another one.
const OTHER: f64 = 1.25;

/// The blind share, which is looked at again when other gauges are trusted or their noise is another.
#[derive(Default)]
pub(super) struct Blind {
    /// Gauges that it is of, and their noise (strain).
    used: Vec<bool>,
    noise: Vec<f64>,
    share: Option<f64>,
    /// As it was told last, and seconds for which it has been worse and better than that.
    said: f64,
    worse_s: f64,
    better_s: f64,
}

impl Blind {
    /// After another rest or model, and where a recording begins: what follows depends on what follows alone.
    pub fn forget(&mut self) {
        self.share = None;
    }

    /// What was found, where it is still of these gauges and about this noise.
    fn known(&self, used: &[bool], noise: &[f64]) -> Option<f64> {
        let as_before = |(is, was): (&f64, &f64)| (was / OTHER..=was * OTHER).contains(is);
        let same = self.used == used && noise.iter().zip(&self.noise).all(as_before);
        self.share.filter(|_| same)
    }

    /// Share of the surface, by the noise of each gauge (strain).
    pub fn look(&mut self, matching: &Matching, noise: &[f64]) -> f64 {
        if let Some(share) = self.known(&matching.used, noise) {
            return share;
        }
        self.used.clone_from(&matching.used);
        self.noise.clear();
        self.noise.extend(noise);
        let least = |(noise, used): (&f64, &bool)| used.then_some(BLIND * noise / LIGHT_N);
        let least: Vec<Option<f64>> = noise.iter().zip(&self.used).map(least).collect();
        let share = matching.map.unfelt(&least);
        self.share = Some(share);
        share
    }

    /// A share, so many seconds after the last one, where that is worth a word.
    pub fn news(&mut self, share: f64, step_s: f64) -> Option<f64> {
        let since = |is: bool, before: f64| if is { before + step_s } else { 0.0 };
        self.worse_s = since(share > self.said + MUCH, self.worse_s);
        self.better_s = since(share < self.said - MUCH, self.better_s);
        let is_news = self.worse_s >= LASTS_S;
        if is_news || self.better_s >= FORGOTTEN_S {
            // What has become better is worth a word when it becomes as bad again.
            (self.said, self.worse_s, self.better_s) = (share, 0.0, 0.0);
        }
        is_news.then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::inference::{ReadingErrors, ResponseMap};
    use crate::mesh::TriMesh;

    #[test]
    fn what_no_gauge_feels_is_blind() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]], 0).unwrap();
        // The first gauge feels two corners and the second another one; the last is felt by none.
        let mut values = vec![0.0; 2 * (4 + 5)];
        for (node, channel) in [(0, 0), (1, 0), (2, 1)] {
            values[2 * node + channel] = -1e-5;
        }
        let map = Arc::new(ResponseMap::of(Arc::new(mesh), 2, values));
        let mut matching = Matching::new(map, ReadingErrors::of_noise(1e-6, 2), 50.0);
        let mut blind = Blind::default();
        let mut near = |matching: &Matching, noise: f64, share: f64| {
            let found = blind.look(matching, &[noise; 2]);
            assert!((found - share).abs() < 1e-12, "{found}");
        };
        near(&matching, 9e-6, 1.0 / 6.0);
        matching.used[1] = false;
        near(&matching, 9e-6, 0.5);
        matching.used[1] = true;
        near(&matching, 9e-6, 1.0 / 6.0);
        // A noise that hides all of it, once it is clearly another.
        near(&matching, 11e-6, 1.0 / 6.0);
        near(&matching, 12e-6, 1.0);
        near(&matching, 9e-6, 1.0 / 6.0);
    }

    #[test]
    fn what_lasts_is_told_once_until_it_was_better_for_long() {
        let mut blind = Blind::default();
        let mut told = |seconds: f64, share: f64| {
            let samples = (100.0 * seconds) as usize;
            (0..samples)
                .filter(|_| blind.news(share, 0.01).is_some())
                .count()
        };
        // At first, of more, and of less that was better for a moment.
        assert_eq!([told(0.4, 0.3), told(0.05, 0.0)], [0, 0]);
        assert_eq!([told(5.0, 0.3), told(5.0, 0.35), told(5.0, 0.5)], [1, 0, 1]);
        assert_eq!([told(5.0, 0.2), told(5.0, 0.5)], [0, 0]);
        assert_eq!([told(20.0, 0.2), told(5.0, 0.5)], [0, 1]);
        // Of what comes and goes nobody is told.
        let flickers = (0..40).map(|_| told(0.2, 0.9) + told(0.2, 0.5));
        assert_eq!(flickers.sum::<usize>(), 0);
    }
}
