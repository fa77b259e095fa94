//! What is found from several starts, and what all of it says together.

use glam::DMat2;

use super::density::sum_of;
use super::joint::Joint;
use super::spot::Spot;
use crate::inference::map::ResponseMap;
use crate::inference::matching::modes::widest;
use crate::inference::matching::weighed::Observation;
use crate::inference::matching::{Contact, Matching};

/// Answers to one question, each with its own places, and the logarithm of their evidence together.
pub(super) struct Answers(pub Vec<Joint>);

impl Answers {
    /// Of what was found from several starts, which may be the same again.
    pub fn of(map: &ResponseMap, joints: impl Iterator<Item = Joint>) -> Self {
        let mut found: Vec<Joint> = joints.collect();
        found.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let mut apart: Vec<Joint> = Vec::with_capacity(found.len());
        for joint in found {
            if !apart.iter().any(|other| are_the_same(map, other, &joint)) {
                apart.push(joint);
            }
        }
        Self(apart)
    }

    /// The likeliest.
    pub fn best(&self) -> Option<&Joint> {
        self.0.first()
    }

    /// Logarithm of what all of them say together.
    pub fn log_evidence(&self) -> f64 {
        sum_of(self.0.iter().map(|j| j.log_evidence))
    }
}

impl Matching {
    /// One point: from the best places for one.
    pub(super) fn alone(&mut self, observed: &Observation, found: &Contact) -> Answers {
        self.score(observed);
        let modes = self.modes(observed);
        let at = self.map.mesh.index().nearest(found.position).0;
        let starts = modes
            .iter()
            .map(|mode| vec![Spot::point(mode.at, mode.force)]);
        let starts: Vec<_> = starts.chain([vec![Spot::point(at, found.force)]]).collect();
        self.joined_from(observed, starts.iter())
    }

    /// From several starts.
    pub(super) fn joined_from<'a>(
        &self,
        observed: &Observation,
        starts: impl Iterator<Item = &'a Vec<Spot>>,
    ) -> Answers {
        Answers::of(
            &self.map,
            starts.filter_map(|spots| self.joined(observed, spots, None)),
        )
    }
}

/// Whether the spots of both lie within what is known of one of them.
fn are_the_same(map: &ResponseMap, one: &Joint, other: &Joint) -> bool {
    /// Deviations, and metres that are no difference.
    const WITHIN: f64 = 2.0;
    const LEAST: f64 = 1e-3;
    let place = |spot: &Spot| map.mesh.point(spot.at);
    (0..one.spots.len()).all(|k| {
        let wide = WITHIN * widest(flat_of(one, k)).sqrt() + LEAST;
        let here = place(&one.spots[k]);
        other.spots.iter().any(|s| place(s).distance(here) < wide)
    })
}

/// Covariance of a spot's place in its plane (m²).
pub(super) fn flat_of(joint: &Joint, k: usize) -> DMat2 {
    let first = joint.first(k);
    let of = |i: usize, j: usize| joint.covariance[(first + i, first + j)];
    DMat2::from_cols_array(&[of(0, 0), of(1, 0), of(0, 1), of(1, 1)])
}
