//! The most likely places: Gauss–Newton from the best templates, and the normal distribution around what it finds.

use std::borrow::Cow;

use glam::{DMat2, DVec3};
use nalgebra::Matrix3;

use super::weighed::{Observation, WeighedReading, WeighedTouch};
use super::{Contact, Load, Matching};
use crate::inference::deviation::{Nuisance, Nuisances, TouchDoubts};
use crate::inference::map::Slope;
use crate::inference::region::{CredibleRegion, DEVIATIONS};
use crate::mesh::SurfacePoint;

const STEPS: usize = 8;
/// Of the distance between templates, and of the force that presses: what a touch may move and turn by before what was
/// taken where it was is taken again.
const SETTLED: f64 = 0.1;
/// One place with this share of the probability is the answer; below it, the mean is.
const CLEAR: f64 = 0.9;

/// A most likely place, and the normal distribution around it.
#[derive(Clone, Copy)]
pub(in crate::inference) struct Mode {
    pub at: SurfacePoint,
    pub position: DVec3,
    pub force: f64,
    force_variance: f64,
    /// What else is known of the touch, and how sure its force along the surface is (N).
    about: TouchDoubts,
    drag_deviation: f64,
    pub covariance: DMat2,
    plane: [DVec3; 2],
    /// Half the weighted squares left over.
    pub cost: f64,
    /// Of the integral over its surroundings.
    pub log_evidence: f64,
}

impl Mode {
    /// The force along the surface (N).
    fn drag(&self) -> DVec3 {
        self.about.aside * self.force
    }
}

/// What is held while places around one are tried.
struct ModeTerms<'a> {
    weighed: WeighedTouch,
    nuisances: Vec<Nuisance>,
    /// What is known of the touch already: what it reads changes with the place too.
    about: TouchDoubts,
    /// The reading, with as much more as makes a touch that is known to be made so one that is made otherwise only by
    /// chance.
    reading: Cow<'a, [f64]>,
}

impl Matching {
    /// What is taken at a place while others around it are tried: for the force that is given, or else for the one that
    /// fits best there.
    fn terms<'a>(
        &self,
        observed: &'a Observation,
        at: SurfacePoint,
        force: Option<f64>,
        about: TouchDoubts,
    ) -> ModeTerms<'a> {
        let deviations = self.errors.deviations.as_ref();
        let own = deviations.map(|d| d.own.at(at));
        let shared = self.nuisances();
        let nuisances = shared.map_or_else(Vec::new, |n| n.at(at));
        let fitting = || self.fitting_force(observed, &self.map.at(at), own.as_deref(), &nuisances);
        let force = force.unwrap_or_else(fitting);
        let mut reading = Cow::Borrowed(observed.reading());
        if let Some(shared) = shared.filter(|_| about != TouchDoubts::default()) {
            let known = shared.reading(&about, at);
            for (x, known) in reading.to_mut().iter_mut().zip(known) {
                *x += force * known;
            }
        }
        ModeTerms {
            weighed: observed.weighed(own.as_deref(), &nuisances, force),
            nuisances,
            about,
            reading,
        }
    }

    pub(in crate::inference) fn nuisances(&self) -> Option<&Nuisances> {
        self.errors.deviations.as_ref()?.nuisances.as_ref()
    }

    /// What a newton reads at a place, and how that changes, of a touch about which so much is known.
    pub(in crate::inference) fn slope(&self, about: &TouchDoubts, at: SurfacePoint) -> Slope {
        let mut slope = self.map.slope(at);
        if let Some(shared) = self
            .nuisances()
            .filter(|_| *about != TouchDoubts::default())
        {
            shared.add(about, at, &mut slope);
        }
        slope
    }

    /// The force that fits best at a place with these readings a newton: its weights depend on it, and two turns
    /// settle them.
    pub(super) fn fitting_force(
        &self,
        observed: &Observation,
        g: &[f64],
        deviation: Option<&[f64]>,
        nuisances: &[Nuisance],
    ) -> f64 {
        let mut force = observed.first_force(g).clamp(0.0, self.most_force);
        for _ in 0..TURNS {
            let weighed = observed.weighed(deviation, nuisances, force);
            force = observed.measured(&weighed).fit(g, self.most_force).0;
        }
        force
    }

    /// The most likely place near a start. What depends on where, how hard and how the touch was made is taken there
    /// once more, and where it may have been made otherwise once again.
    pub(super) fn follow(
        &self,
        observed: &Observation,
        start: SurfacePoint,
        known: Option<(f64, TouchDoubts)>,
    ) -> Mode {
        let (force, about) = known.unzip();
        let about = about.unwrap_or_default();
        let mode = self.begin(observed, start, force, about);
        let settled = known.map(|_| (self.map.mesh.point(start), about));
        self.settle(observed, mode, settled)
    }

    /// The most likely place near a start, by what is taken there.
    pub(super) fn begin(
        &self,
        observed: &Observation,
        start: SurfacePoint,
        force: Option<f64>,
        about: TouchDoubts,
    ) -> Mode {
        let terms = self.terms(observed, start, force, about);
        self.descend(observed, &terms, start)
    }

    /// Goes on from where a place was found by what was taken elsewhere; no further where that was as good as here
    /// (`before`: where, and how the touch was made).
    pub(super) fn settle(
        &self,
        observed: &Observation,
        mut mode: Mode,
        mut before: Option<(DVec3, TouchDoubts)>,
    ) -> Mode {
        let turns = match &self.errors.deviations {
            None => 0,
            Some(deviations) if deviations.nuisances.is_none() => 1,
            Some(_) => TURNS,
        };
        for _ in 0..turns {
            // A touch that goes on is where it was.
            if let Some((place, about)) = &mut before {
                let moved = mode.position.distance(*place) > SETTLED * self.map.spacing();
                let turned = mode.about.aside.distance(about.aside) > SETTLED;
                if !moved && !turned {
                    break;
                }
                (*place, *about) = (mode.position, mode.about);
            }
            let terms = self.terms(observed, mode.at, Some(mode.force), mode.about);
            mode = self.descend(observed, &terms, mode.at);
        }
        mode
    }

    /// Gauss–Newton on place and force, with Levenberg's damping.
    fn descend(&self, observed: &Observation, terms: &ModeTerms, start: SurfacePoint) -> Mode {
        let measured = WeighedReading::of(&terms.weighed, &terms.reading);
        let map = &self.map;
        let mut at = start;
        let mut slope = self.slope(&terms.about, at);
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
            let next = self.slope(&terms.about, there);
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
        let whole = observed.measured(&terms.weighed);
        let (about, drag_deviation) = whole.about(&map.at(at), force, &terms.nuisances);
        Mode {
            about,
            drag_deviation,
            ..self.mode(&measured, at, &slope, force, cost + terms.weighed.log)
        }
    }

    fn mode(
        &self,
        measured: &WeighedReading,
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
            about: TouchDoubts::default(),
            drag_deviation: 0.0,
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
        let region = CredibleRegion::of_normal(mode.covariance, mode.plane);
        let load = Load {
            force: mode.force,
            variance: mode.force_variance,
            drag: mode.drag(),
            drag_deviation: mode.drag_deviation,
        };
        self.contact(measured, mode.at, load, region, mode.cost, narrow)
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
        // Of places that face apart from each other, what lies in the surface where the mean is put.
        let dragged: DVec3 = modes.iter().map(|m| m.drag() * (weight(m) / total)).sum();
        let drag = dragged.reject_from_normalized(self.map.mesh.normal(at));
        let apart = |m: &Mode| m.drag_deviation.powi(2) + m.drag().distance_squared(drag) / 2.0;
        let load = Load {
            force,
            variance,
            drag,
            drag_deviation: mean(&apart).sqrt(),
        };
        let stand_in = |m: &Mode| stand_ins(m.position, m.covariance, m.plane, weight(m));
        let places: Vec<(DVec3, f64)> = modes.iter().flat_map(stand_in).collect();
        let region =
            CredibleRegion::of_places(&places, self.map.mesh.point(at), self.map.mesh.normal(at));
        self.contact(measured, at, load, region, best.cost, false)
    }
}

/// Four places (m) that stand for a normal distribution around one, with a covariance (m²) in a plane: one deviation of √2
/// along each principal direction, either way.
pub(in crate::inference) fn stand_ins(
    centre: DVec3,
    covariance: DMat2,
    plane: [DVec3; 2],
    weight: f64,
) -> impl Iterator<Item = (DVec3, f64)> {
    let region = CredibleRegion::of_normal(covariance, plane);
    let scale = std::f64::consts::SQRT_2 / DEVIATIONS;
    region.axes.into_iter().flat_map(move |axis| {
        [1.0, -1.0].map(|sign| (centre + axis * (sign * scale), weight / 4.0))
    })
}

/// The larger eigenvalue (m²).
pub(in crate::inference) fn widest(covariance: DMat2) -> f64 {
    let (a, b, c) = (
        covariance.x_axis.x,
        covariance.x_axis.y,
        covariance.y_axis.y,
    );
    f64::midpoint(a, c) + ((a - c) / 2.0).hypot(b)
}

/// Turns in which a force and the weights that depend on it settle.
pub(super) const TURNS: usize = 2;
