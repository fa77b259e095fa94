//! The most likely places: Gauss–Newton from the best templates, and the normal distribution around what it finds.

use glam::{DMat2, DVec3};
use nalgebra::Matrix3;

use super::weighed::{Measured, Observation, Weighed};
use super::{Contact, Matching};
use crate::inference::map::Slope;
use crate::inference::region::{DEVIATIONS, Region};
use crate::mesh::SurfacePoint;

const STEPS: usize = 8;
/// One place with this share of the probability is the answer; below it, the mean is.
const CLEAR: f64 = 0.9;

/// A most likely place, and the normal distribution around it.
#[derive(Clone, Copy)]
pub(super) struct Mode {
    pub at: SurfacePoint,
    pub position: DVec3,
    pub force: f64,
    force_variance: f64,
    pub covariance: DMat2,
    plane: [DVec3; 2],
    /// Half the weighted squares left over.
    pub cost: f64,
    /// Of the integral over its surroundings.
    pub log_evidence: f64,
}

impl Matching {
    /// The weights for a touch at a place: of the force that is given, or else of the one that fits best.
    fn weighed_at(&self, observed: &Observation, at: SurfacePoint, force: Option<f64>) -> Weighed {
        let gluing_deviation = self.errors.gluing_deviation.as_ref().map(|s| s.at(at));
        let gluing_deviation = gluing_deviation.as_deref();
        let fitting = || self.fitting_force(observed, &self.map.at(at), gluing_deviation);
        observed.weighed(gluing_deviation, force.unwrap_or_else(fitting))
    }

    /// The force that fits best at a place with these readings a newton: its weights depend on it, and two turns
    /// settle them.
    pub(super) fn fitting_force(
        &self,
        observed: &Observation,
        g: &[f64],
        gluing_deviation: Option<&[f64]>,
    ) -> f64 {
        let mut force = observed.first_force(g).clamp(0.0, self.most_force);
        for _ in 0..TURNS {
            let weighed = observed.weighed(gluing_deviation, force);
            force = observed.measured(&weighed).fit(g, self.most_force).0;
        }
        force
    }

    /// The most likely place near a start. Weights that depend on where and how hard the touch was are taken there
    /// once more.
    pub(super) fn follow(
        &self,
        observed: &Observation,
        start: SurfacePoint,
        force: Option<f64>,
    ) -> Mode {
        let weighed = self.weighed_at(observed, start, force);
        let mode = self.descend(&observed.measured(&weighed), weighed.log, start);
        if self.errors.gluing_deviation.is_none() {
            return mode;
        }
        let weighed = self.weighed_at(observed, mode.at, Some(mode.force));
        self.descend(&observed.measured(&weighed), weighed.log, mode.at)
    }

    /// Gauss–Newton on place and force, with Levenberg's damping.
    fn descend(&self, measured: &Measured, log: f64, start: SurfacePoint) -> Mode {
        let map = &self.map;
        let mut at = start;
        let mut slope = map.slope(at);
        let (mut force, mut cost) = measured.fit(&slope.reading, self.most_force);
        let mut damping = 1e-4;
        for _ in 0..STEPS {
            let (normal, gradient) = measured.equations(&slope, force);
            let mut damped = normal;
            for k in 0..3 {
                damped[(k, k)] *= 1.0 + damping;
            }
            let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                break;
            };
            let length = step[0].hypot(step[1]);
            if !length.is_finite() {
                break;
            }
            // No farther than the quadratic pieces can be trusted.
            let within = (3.0 * map.spacing() / length.max(f64::MIN_POSITIVE)).min(1.0);
            let moved = slope.plane[0] * (step[0] * within) + slope.plane[1] * (step[1] * within);
            let there = map.mesh.index().nearest(map.mesh.point(at) + moved).0;
            let next = map.slope(there);
            let (next_force, next_cost) = measured.fit(&next.reading, self.most_force);
            if next_cost < cost {
                let gained = cost - next_cost;
                (at, slope, force, cost) = (there, next, next_force, next_cost);
                damping *= 0.1;
                if gained < 1e-4 {
                    break;
                }
            } else {
                // Nothing left to gain by going on.
                if length < 1e-6 {
                    break;
                }
                damping = (damping * 20.0).max(1e-3);
            }
        }
        self.mode(measured, at, &slope, force, cost + log)
    }

    fn mode(
        &self,
        measured: &Measured,
        at: SurfacePoint,
        slope: &Slope,
        force: f64,
        cost: f64,
    ) -> Mode {
        let (mut normal, _) = measured.equations(slope, force);
        // What is known before anything is measured: the touch is on the part, and nobody presses harder.
        let (lower, upper) = self.map.mesh.bounds();
        let size = (upper - lower).length_squared() / 4.0;
        normal[(0, 0)] += size.recip();
        normal[(1, 1)] += size.recip();
        normal[(2, 2)] += self.most_force.powi(-2);
        let covariance = normal.try_inverse().unwrap_or_else(Matrix3::identity);
        Mode {
            at,
            position: self.map.mesh.point(at),
            force,
            force_variance: covariance[(2, 2)],
            covariance: DMat2::from_cols_array(&[
                covariance[(0, 0)],
                covariance[(1, 0)],
                covariance[(0, 1)],
                covariance[(1, 1)],
            ]),
            plane: slope.plane,
            cost,
            log_evidence: -cost + 0.5 * covariance.determinant().max(f64::MIN_POSITIVE).ln(),
        }
    }

    /// A mode alone, with its normal distribution.
    pub(super) fn contact_at(&self, measured: &Observation, mode: &Mode, narrow: bool) -> Contact {
        let region = Region::of_normal(mode.covariance, mode.plane);
        let force = (mode.force, mode.force_variance);
        self.contact(measured, mode.at, force, region, mode.cost, narrow)
    }

    /// Where one narrow place is far likelier than all others, that one; otherwise their mean.
    pub(super) fn mean_of_modes(&self, measured: &Observation, modes: &[Mode]) -> Contact {
        let best = modes[0];
        let weight = |m: &Mode| (m.log_evidence - best.log_evidence).exp();
        let total: f64 = modes.iter().map(weight).sum();
        if 1.0 / total >= CLEAR {
            return self.contact_at(measured, &best, true);
        }
        let mean = |value: &dyn Fn(&Mode) -> f64| {
            modes.iter().map(|m| weight(m) * value(m)).sum::<f64>() / total
        };
        let centre: DVec3 = modes.iter().map(|m| m.position * (weight(m) / total)).sum();
        let at = self.map.mesh.index().nearest(centre).0;
        let force = mean(&|m| m.force);
        let variance = mean(&|m| m.force_variance + (m.force - force).powi(2));
        let places: Vec<(DVec3, f64)> =
            modes.iter().flat_map(|m| stand_ins(m, weight(m))).collect();
        let region = Region::of_places(&places, self.map.mesh.point(at), self.map.mesh.normal(at));
        self.contact(measured, at, (force, variance), region, best.cost, false)
    }
}

/// Four places that stand for a mode: one deviation of √2 along each principal direction, either way.
fn stand_ins(mode: &Mode, weight: f64) -> impl Iterator<Item = (DVec3, f64)> {
    let region = Region::of_normal(mode.covariance, mode.plane);
    let scale = std::f64::consts::SQRT_2 / DEVIATIONS;
    let position = mode.position;
    region.axes.into_iter().flat_map(move |axis| {
        [1.0, -1.0].map(|sign| (position + axis * (sign * scale), weight / 4.0))
    })
}

/// The larger eigenvalue (m²).
pub(super) fn widest(covariance: DMat2) -> f64 {
    let (a, b, c) = (
        covariance.x_axis.x,
        covariance.x_axis.y,
        covariance.y_axis.y,
    );
    f64::midpoint(a, c) + ((a - c) / 2.0).hypot(b)
}

/// Turns in which a force and the weights that depend on it settle.
pub(super) const TURNS: usize = 2;
