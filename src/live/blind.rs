//! How much of the surface is blind: where a light touch moves no gauge that is trusted far enough above its noise.

use crate::inference::Matching;
use crate::uncertainty::BLIND;

/// A light touch (N), as designs are judged by where nothing else is asked for.
pub const LIGHT_N: f64 = 3.0;
/// Blind share that is worth a word, and by how much more it has to be for another.
const MUCH: f64 = 0.1;

/// A noise that is this many times what it was, or the inverse, is another one.
const OTHER: f64 = 1.25;

/// The blind share, which is looked at again when other gauges are trusted or their noise is another.
#[derive(Default)]
pub(super) struct Blind {
    /// Gauges that it is of, and their noise (strain).
    used: Vec<bool>,
    noise: Vec<f64>,
    share: Option<f64>,
    said: f64,
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

    /// Share of the surface, and whether that is news, by the noise of each gauge (strain).
    pub fn look(&mut self, matching: &Matching, noise: &[f64]) -> (f64, bool) {
        if let Some(share) = self.known(&matching.used, noise) {
            return (share, false);
        }
        self.used.clone_from(&matching.used);
        self.noise.clear();
        self.noise.extend(noise);
        let least = |(noise, used): (&f64, &bool)| used.then_some(BLIND * noise / LIGHT_N);
        let least: Vec<Option<f64>> = noise.iter().zip(&self.used).map(least).collect();
        let share = matching.map.unfelt(&least);
        self.share = Some(share);
        let is_news = share > self.said + MUCH;
        // What has become better is worth a word when it becomes as bad again.
        self.said = if is_news {
            share
        } else {
            self.said.min(share + MUCH)
        };
        (share, is_news)
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
    fn what_no_gauge_feels_any_more_is_told_once() {
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
        let noise = [9e-6; 2];
        let near = |found: (f64, bool), share: f64, is_news: bool| {
            assert!(
                (found.0 - share).abs() < 1e-12 && found.1 == is_news,
                "{found:?}"
            );
        };
        near(blind.look(&matching, &noise), 1.0 / 6.0, true);
        near(blind.look(&matching, &noise), 1.0 / 6.0, false);
        matching.used[1] = false;
        near(blind.look(&matching, &noise), 0.5, true);
        matching.used[1] = true;
        near(blind.look(&matching, &noise), 1.0 / 6.0, false);
        // A noise that hides all of it, once it is clearly another; then as before, and again.
        near(blind.look(&matching, &[11e-6; 2]), 1.0 / 6.0, false);
        near(blind.look(&matching, &[12e-6; 2]), 1.0, true);
        near(blind.look(&matching, &noise), 1.0 / 6.0, false);
        near(blind.look(&matching, &[12e-6; 2]), 1.0, true);
    }
}
