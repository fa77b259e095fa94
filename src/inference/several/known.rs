//! Spots of which it is known what they read.

use glam::DVec3;

use super::spot::Spot;
use crate::inference::map::ResponseMap;

/// Where they were, what is read of them beside their model, and how far both may be off by now.
#[derive(Clone, Debug)]
pub(super) struct KnownSpots {
    pub spots: Vec<Spot>,
    /// What their model lacks of a newton of them (strain).
    pub lacks: Vec<f64>,
    /// Standard deviation of how far each has moved (m).
    pub moves: f64,
    /// Share of the errors that is not held by what was read.
    pub doubt: f64,
}

impl KnownSpots {
    /// What a newton of one of them reads by the model (strain), with what that lacks.
    pub fn correct(&self, reading: &mut [f64]) {
        for (r, lack) in reading.iter_mut().zip(&self.lacks) {
            *r += lack;
        }
    }

    /// How far each of them is from where it was along the two directions of its plane, in deviations.
    pub fn off<'a>(
        &self,
        map: &ResponseMap,
        now: impl Iterator<Item = (&'a Spot, [DVec3; 2])>,
    ) -> Vec<f64> {
        let of_spot = |(was, (now, plane)): (&Spot, (&Spot, [DVec3; 2]))| {
            let moved = map.mesh.point(now.at) - map.mesh.point(was.at);
            plane.map(|way| moved.dot(way) / self.moves)
        };
        self.spots.iter().zip(now).flat_map(of_spot).collect()
    }

    /// Weighted squares of how far all of them are from where they were.
    pub fn moved(&self, map: &ResponseMap, now: &[Spot]) -> f64 {
        let pairs = self.spots.iter().zip(now);
        let far = |(was, is): (&Spot, &Spot)| {
            map.mesh
                .point(is.at)
                .distance_squared(map.mesh.point(was.at))
        };
        pairs.map(far).sum::<f64>() / self.moves.powi(2)
    }
}
