//! Touches that were there before another came. What is read of them has been seen: what their model lacks, how their gauges
//! are glued and how they lean is in it, so that what comes to it is told by itself, and by its own errors alone.
//!
//! ```text
//! x = Σ f (g(p) + l) + f' g(p') + e        l = (x₀ - Σ f₀ g(p₀)) / Σ f₀
//! ```
//!
//! with x₀ what was read before, p within millimetres of p₀, and shares of errors of x - x₀ instead of x.

use glam::{DMat2, DVec3};

use super::answers::Answers;
use super::density::sum_of;
use super::exchange::{Exchange, MOST};
use super::joint::Joint;
use super::known::KnownSpots;
use super::spot::Spot;
use super::{Several, SeveralTouches, TouchKind};
use crate::inference::matching::weighed::Observation;
use crate::inference::matching::{Contact, Matching};
use crate::inference::region::{CredibleRegion, DEVIATIONS};

#[cfg(test)]
mod tests;

/// What may become of touches: how far each moves (m, standard deviation), the share of its errors that what was read of it does
/// not hold then, since it leans otherwise and what a model lacks is another elsewhere; whether one more comes, and how likely
/// all that is.
#[derive(Clone, Copy)]
struct Course {
    moves: f64,
    doubt: f64,
    more: bool,
    prior: f64,
}

const STAY: Course = Course {
    moves: 2e-3,
    doubt: 0.25,
    more: false,
    prior: 0.79,
};
const MOVE_ON: Course = Course {
    moves: 15e-3,
    doubt: 0.7,
    more: false,
    prior: 0.1,
};
const ONE_MORE: Course = Course {
    more: true,
    prior: 0.1,
    ..STAY
};
/// That they have made place for any others from one moment to the next.
const ANEW: f64 = 0.01;
/// Places from which one more is followed.
const STARTS: usize = 3;
/// Turns in which forces of those before and the errors of what has come to them settle.
const TURNS: usize = 2;

/// Touches that were there, and what was read of them.
#[derive(Clone, Debug)]
pub struct TouchesBefore {
    contacts: Vec<Contact>,
    /// Of there having been so many.
    probability: f64,
    /// What was read (strain).
    reading: Vec<f64>,
    known: KnownSpots,
}

/// Touches that were there before and one more, as they are followed.
#[derive(Clone, Debug)]
pub struct TouchesBeside {
    before: TouchesBefore,
    spots: Vec<Spot>,
}

/// Touches by one of their courses.
struct Followed {
    before: TouchesBefore,
    answers: Answers,
    /// What channels are off by shares of (strain).
    sizes: Vec<f64>,
    /// Logarithm of its prior and its evidence.
    log: f64,
}

impl TouchesBeside {
    /// Those that were there before.
    #[must_use]
    pub fn before(&self) -> &TouchesBefore {
        &self.before
    }
}

impl TouchesBefore {
    /// Whether so much was read (strain), to a hundredth.
    #[cfg(test)]
    pub(crate) fn reads_about(&self, reading: &[f64]) -> bool {
        let size = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
        let pairs = self.reading.iter().zip(reading);
        let off: Vec<f64> = pairs.map(|(x, y)| x - y).collect();
        size(&off) < 1e-4 * size(reading)
    }

    /// Newtons of all of them.
    fn force(&self) -> f64 {
        self.known.spots.iter().map(|spot| spot.force).sum()
    }

    /// What channels are off by shares of (strain) where those before are so many times as hard as they were.
    fn sizes(&self, reading: &[f64], times: f64) -> Vec<f64> {
        let pairs = reading.iter().zip(&self.reading);
        pairs
            .map(|(x, was)| (x - times * was).hypot(self.known.doubt * times * was))
            .collect()
    }
}

impl Matching {
    /// Touches of which so much is read (strain), as those that another may come to; nothing of what is not points, or too many for
    /// one more to be searched for beside them.
    #[must_use]
    pub fn before(&self, touches: &SeveralTouches, reading: &[f64]) -> Option<TouchesBefore> {
        let contacts = &touches.contacts;
        let few = (1..=MOST).contains(&contacts.len());
        let points = touches.kind == TouchKind::Points;
        let spots = self.spots_of(touches);
        let force: f64 = spots.iter().map(|spot| spot.force).sum();
        if !few || !points || force <= 0.0 || !reading.iter().all(|x| x.is_finite()) {
            return None;
        }
        let model = self.reading_of_all(touches);
        let lacks = (reading.iter().zip(&model)).map(|(x, m)| (x - m) / force);
        Some(TouchesBefore {
            contacts: contacts.clone(),
            probability: touches.probability,
            reading: reading.to_vec(),
            known: KnownSpots {
                spots,
                lacks: lacks.collect(),
                moves: STAY.moves,
                doubt: STAY.doubt,
            },
        })
    }

    /// As [`Self::count`] where it is known what touched before: whether that goes on, or another has come to it. Of several
    /// that touched one after the other the later ones are held against all that the earlier ones say. With the touches as they
    /// are followed where another has come.
    pub fn count_after(
        &mut self,
        several: &Several,
        reading: &[f64],
        one: &Contact,
        before: &[&TouchesBefore],
    ) -> (SeveralTouches, Option<TouchesBeside>) {
        let (mut seen, evidence) = self.count_with_evidence(several, reading, one);
        let mut beside = None;
        let Some(mut anew) = evidence else {
            return (seen, beside);
        };
        for before in before {
            let follow = |course| self.followed(several, reading, before, course);
            let more = follow(ONE_MORE);
            // Where there were not so many nothing is known of what was there.
            let unknown = 1.0 - before.probability * (1.0 - ANEW);
            let logs = [follow(STAY).log, follow(MOVE_ON).log, more.log];
            let together = sum_of(logs.into_iter().chain([unknown.ln() + anew]));
            anew = together;
            let share = (more.log - together).exp();
            let with_it = before.contacts.len();
            let mut shares = seen.shares.map(|s| (1.0 - share) * s);
            let is_seen = seen.which() == with_it && shares[with_it] > share;
            shares[with_it] += share;
            let is_most = shares.iter().all(|s| *s <= shares[with_it]);
            if is_most
                && !is_seen
                && let Some(best) = more.answers.best()
            {
                seen = self.told_beside(reading, &more);
                beside = Some(TouchesBeside {
                    spots: best.spots.clone(),
                    before: more.before,
                });
            }
            (seen.probability, seen.shares) = (shares[seen.which()], shares);
        }
        (seen, beside)
    }

    /// The touches of a course.
    fn told_beside(&self, reading: &[f64], course: &Followed) -> SeveralTouches {
        let sizes = Some(course.sizes.clone());
        let observed = Observation::sized(reading, sizes, &self.errors, &self.used);
        self.touches_beside(&observed, &course.before, &course.answers.0, 0.0)
    }

    /// As [`Self::track_several`] for touches of which some were there before.
    pub fn track_beside(
        &self,
        reading: &[f64],
        beside: &mut TouchesBeside,
        last: &SeveralTouches,
    ) -> Option<SeveralTouches> {
        const STEPS: usize = 2;
        let before = &beside.before;
        let times = times_of(before, &beside.spots);
        let sizes = Some(before.sizes(reading, times));
        let observed = Observation::sized(reading, sizes, &self.errors, &self.used);
        let joint = self.joined_with(&observed, Some(&before.known), &beside.spots, Some(STEPS))?;
        let explained = self.explains(&joint, last);
        explained.then(|| {
            let answers = std::slice::from_ref(&joint);
            let found = self.touches_beside(&observed, before, answers, last.probability);
            beside.spots.clone_from(&joint.spots);
            SeveralTouches {
                shares: last.shares,
                ..found
            }
        })
    }

    /// Those before by a course that they may have taken.
    fn followed(
        &self,
        several: &Several,
        reading: &[f64],
        before: &TouchesBefore,
        course: Course,
    ) -> Followed {
        let mut before = before.clone();
        (before.known.moves, before.known.doubt) = (course.moves, course.doubt);
        let mut sizes = before.sizes(reading, 1.0);
        let mut answers = Answers(Vec::new());
        for _ in 0..TURNS {
            let of = Some(sizes.clone());
            let observed = Observation::sized(reading, of, &self.errors, &self.used);
            let starts = self.starts_beside(several, &observed, &before.known, course.more);
            let known = Some(&before.known);
            let joined =
                (starts.iter()).filter_map(|start| self.joined_with(&observed, known, start, None));
            answers = Answers::of(&self.map, joined);
            let Some(best) = answers.best() else {
                break;
            };
            sizes = before.sizes(reading, times_of(&before, &best.spots));
        }
        Followed {
            log: (before.probability * course.prior).ln() + answers.log_evidence(),
            before,
            answers,
            sizes,
        }
    }

    fn starts_beside(
        &self,
        several: &Several,
        observed: &Observation,
        known: &KnownSpots,
        more: bool,
    ) -> Vec<Vec<Spot>> {
        if !more {
            return vec![known.spots.clone()];
        }
        let felt = |spot: &Spot| {
            let mut reading = self.felt(spot).reading;
            known.correct(&mut reading);
            (*spot, reading)
        };
        let beside: Vec<(Spot, Vec<f64>)> = known.spots.iter().map(felt).collect();
        let making = several.coarse.making;
        let exchange = Exchange::new(&self.map, observed, making, self.most_force);
        let found = exchange.beside(&beside, STARTS);
        let with = |one: &Spot| [&known.spots[..], &[*one]].concat();
        found.iter().map(with).collect()
    }

    /// The touches of an answer: of those before also what was not known of them then.
    fn touches_beside(
        &self,
        observed: &Observation,
        before: &TouchesBefore,
        answers: &[Joint],
        probability: f64,
    ) -> SeveralTouches {
        let mut found = self.touches(observed, answers, probability);
        let best = &answers[0];
        for (k, was) in before.contacts.iter().enumerate() {
            let place = self.map.mesh.point(best.spots[k].at);
            let now = (found.contacts.iter_mut()).find(|c| c.position == place);
            if let Some(now) = now {
                let plane = best.planes[k];
                let flat = flat_in(&now.region, plane) + flat_in(&was.region, plane);
                now.region = CredibleRegion::of_normal(flat, plane);
                let share = now.force / was.force;
                now.force_deviation = now.force_deviation.hypot(share * was.force_deviation);
            }
        }
        found
    }
}

/// How many times as hard touches are as they were.
fn times_of(before: &TouchesBefore, now: &[Spot]) -> f64 {
    let now: f64 = now
        .iter()
        .take(before.contacts.len())
        .map(|s| s.force)
        .sum();
    now / before.force()
}

/// Covariance (m²) of the normal distribution of a region, in a plane.
fn flat_in(region: &CredibleRegion, plane: [DVec3; 2]) -> DMat2 {
    let mut flat = DMat2::ZERO;
    for axis in region.axes {
        let along = plane.map(|way| axis.dot(way) / DEVIATIONS);
        let along = glam::DVec2::from_array(along);
        flat += DMat2::from_cols(along * along.x, along * along.y);
    }
    flat
}
