//! Model matching: which touch, anywhere on the surface, makes the readings that were measured.
//!
//! A touch of force f at p makes x = f·g(p) + noise, with g known from the elastic model. For any p the best
//! force has a closed form, f = (x·W g)/(g·W g) with the noise's weights W, so that only the surface is
//! searched: all templates at once, then Gauss–Newton on the quadratic pieces of g from the best few. Where
//! the readings hardly tell places apart, the mean over the posterior of the templates is taken instead, with
//! flat priors on area and on force. It needs no training.
//!
//! Where it is known how gauges may be glued, a reading's variance is the template's own: it grows with the force and
//! with what a gauge that is a little off would read there, and its determinant counts.
//!
//! What all channels feel together is a covariance of low rank (`weighed`): what they have drifted by, a tip of another
//! size, a force along the surface, which is found with the place. A stiffness that is off is the same as another force,
//! and widens that alone.
//!
//! `errors` is what is off with readings, `weighed` how one is compared under it, `kernels` that for all templates at once;
//! `templates` and `modes` are what is made of it: the whole posterior, and the likeliest places.

mod errors;
mod find;
mod kernels;
mod leeway;
pub(super) mod modes;
mod sums;
mod templates;
pub(super) mod weighed;

use std::sync::Arc;

use glam::DVec3;

use super::deviation::TouchDoubts;
use super::map::{LANES, ResponseMap};
use super::region::CredibleRegion;
use crate::mesh::SurfacePoint;
use crate::statistics::chi_squared_bound;

pub use self::errors::ReadingErrors;

use self::weighed::Observation;

/// A touch as it was inferred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// On the surface (m), and the outward normal there: a touch presses against it.
    pub position: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// How hard it presses (N), and the standard deviation of that.
    pub force: f64,
    /// Force along the surface (N), and its standard deviation along either of two directions: zero, both, where touches
    /// are known to press straight in, and for a wide stretch of places a zero that may be off by all that is usual.
    pub drag: DVec3,
    /// See [`Self::drag`].
    pub drag_deviation: f64,
    /// Standard deviation of the force (N).
    pub force_deviation: f64,
    /// Where it may be.
    pub region: CredibleRegion,
    /// Twice the gain in log-likelihood over no touch at all.
    pub strength: f64,
    /// Whether it is one narrow place, and not the mean of several or of a wide stretch.
    pub narrow: bool,
    /// Weighted squares that no touch explains; about channels - 3 where model and noise are right.
    pub unexplained: f64,
}

impl Contact {
    /// What is known of it beside its place and how hard it presses. What was found of the tip is found again.
    pub(super) fn about(&self) -> TouchDoubts {
        if self.force > 0.0 {
            TouchDoubts {
                aside: self.drag / self.force,
                tip: 0.0,
            }
        } else {
            TouchDoubts::default()
        }
    }

    /// A finger at the origin that is felt clearly (N).
    #[cfg(test)]
    #[must_use]
    pub fn of_finger(force: f64) -> Self {
        Self {
            position: DVec3::ZERO,
            normal: DVec3::Z,
            force,
            drag: DVec3::ZERO,
            drag_deviation: 0.0,
            force_deviation: 0.1,
            region: CredibleRegion {
                axes: [DVec3::X, DVec3::Y],
                radius: 1e-3,
            },
            strength: 100.0,
            narrow: true,
            unexplained: 1.0,
        }
    }

    /// The whole force on the part (N): what presses, and what acts along the surface.
    #[must_use]
    pub fn on_part(&self) -> DVec3 {
        self.drag - self.normal * self.force
    }
}

/// How hard a touch at one place is.
#[derive(Clone, Copy)]
pub(super) struct Load {
    /// N, and the variance of that (N²).
    pub force: f64,
    pub variance: f64,
    /// As in [`Contact`].
    pub drag: DVec3,
    pub drag_deviation: f64,
}

/// The estimator, with its own working memory.
#[derive(Clone)]
pub struct Matching {
    /// What gauges read of a newton anywhere.
    pub map: Arc<ResponseMap>,
    /// What is known of the readings' errors.
    pub errors: ReadingErrors,
    /// Channels that are trusted.
    pub used: Vec<bool>,
    /// The largest force that anybody presses with (N).
    pub most_force: f64,
    scores: Vec<f32>,
    /// The highest score of each block of templates.
    highest: Vec<f32>,
}

impl Matching {
    /// All channels trusted. `most_force` is the largest force that anybody presses with (N).
    #[must_use]
    pub fn new(map: Arc<ResponseMap>, errors: ReadingErrors, most_force: f64) -> Self {
        Self {
            used: vec![true; map.channels()],
            scores: vec![0.0; map.templates.len() / map.channels().max(1)],
            highest: vec![0.0; map.templates.len() / map.channels().max(1) / LANES],
            map,
            errors,
            most_force,
        }
    }

    /// What was found for another reading, where this one is the same but for its size and the noise of both: a
    /// wide posterior is worth no second look then.
    #[must_use]
    pub fn hold(&self, reading: &[f64], before: &[f64], found: &Contact) -> Option<Contact> {
        let channels = || {
            (reading
                .iter()
                .zip(before)
                .zip(&self.errors.noise)
                .zip(&self.used))
            .filter(|(_, u)| **u)
        };
        let (mut s, mut d) = (0.0, 0.0);
        for (((x, y), n), _) in channels() {
            s += x * y / (n * n);
            d += y * y / (n * n);
        }
        let size = s / d;
        let off = |(((x, y), n), _): (((&f64, &f64), &f64), &bool)| {
            ((x - size * y) / n).powi(2) / (1.0 + size * size)
        };
        let differs: f64 = channels().map(off).sum();
        let count = channels().count() as f64;
        let same = (0.5..2.0).contains(&size) && differs < chi_squared_bound(count, 3.0);
        same.then_some(Contact {
            force: (found.force * size).min(self.most_force),
            force_deviation: found.force_deviation * size,
            drag: found.drag * size,
            drag_deviation: found.drag_deviation * size,
            ..*found
        })
    }

    pub(super) fn contact(
        &self,
        measured: &Observation,
        at: SurfacePoint,
        load: Load,
        region: CredibleRegion,
        cost: f64,
        narrow: bool,
    ) -> Contact {
        Contact {
            position: self.map.mesh.point(at),
            normal: self.map.mesh.normal(at),
            force: load.force,
            drag: load.drag,
            drag_deviation: load.drag_deviation,
            // What the whole part is stiffer or softer by is another force, at the same place.
            force_deviation: load
                .variance
                .sqrt()
                .hypot(self.errors.stiffness * load.force),
            region,
            strength: measured.squares - 2.0 * cost,
            narrow,
            unexplained: 2.0 * cost,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::inference::Deviations;
    use crate::mesh::TriMesh;

    pub(crate) const CHANNELS: usize = 4;

    /// What some gauges read on one triangle, and what gluing spreads there: about a microstrain a newton.
    pub(crate) fn maps() -> [Arc<ResponseMap>; 2] {
        let corners = [DVec3::ZERO, DVec3::X * 0.01, DVec3::Y * 0.01];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        let mesh = Arc::new(mesh);
        let map = |size: f64, by: f64| {
            let value = |k: usize| size * (1.0 + (by * (k + 1) as f64).sin());
            let values = (0..6 * CHANNELS).map(value).collect();
            Arc::new(ResponseMap::of(Arc::clone(&mesh), CHANNELS, values))
        };
        [map(1e-6, 1.7), map(0.2e-6, 2.3)]
    }

    #[test]
    fn what_is_no_reading_ends_nothing() {
        let [map, gluing_deviation] = maps();
        for gluing_deviation in [None, Some(gluing_deviation)] {
            let errors = ReadingErrors {
                deviations: gluing_deviation.map(Deviations::of_gluing),
                drift: 0.5e-6,
                ..ReadingErrors::of_noise(1e-6, CHANNELS)
            };
            let mut matching = Matching::new(Arc::clone(&map), errors, 50.0);
            for bad in [f64::NAN, f64::INFINITY, -1e300, 1e3] {
                for count in 1..=CHANNELS {
                    let mut reading = [4e-6, 8e-6, 2e-6, 6e-6];
                    reading[..count].fill(bad);
                    let found = matching.find(&reading);
                    assert!(found.position.is_finite(), "{bad} {count}");
                    assert!(
                        matching
                            .track(&reading, &found)
                            .is_none_or(|c| c.force >= 0.0)
                    );
                }
            }
        }
    }

    #[test]
    fn a_stiffness_that_is_off_is_a_force_that_is_off() {
        let [map, _] = maps();
        let found = |stiffness: f64| {
            let errors = ReadingErrors {
                stiffness,
                ..ReadingErrors::of_noise(1e-7, CHANNELS)
            };
            let g: Vec<f64> = map.node(1).iter().map(|g| 20.0 * g).collect();
            Matching::new(Arc::clone(&map), errors, 60.0).find(&g)
        };
        let (sure, unsure) = (found(0.0), found(0.1));
        assert_eq!(sure.position, unsure.position);
        let expected = sure.force_deviation.hypot(0.1 * sure.force);
        assert!((unsure.force_deviation - expected).abs() < 1e-12);
    }
}
