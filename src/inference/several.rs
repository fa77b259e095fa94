//! How many touches there are: none of them is known beforehand, so each number of them is weighed by its evidence, the
//! density of the reading over all touches that there may be of so many (`MacKay`, Neural Computation 4, 1992).
//!
//! One point, two, three, or an area; against them stands that a gauge says something else than it feels, and that the
//! reading is of nothing that is known. Two are searched for among all pairs of a coarse share of the map (`coarse`), then on all
//! templates one beside the other (`exchange`), and followed all together (`joint`). Where it was seen what touched before another
//! came, that one is told by itself (`before`).

mod answers;
mod before;
mod coarse;
mod density;
mod exchange;
mod joint;
mod known;
mod leeway;
mod odd;
mod spot;

use glam::DVec3;

use self::answers::{Answers, flat_of};
use self::coarse::{Coarse, Whitened};
use self::density::{of_nothing_known, sum_of};
use self::exchange::Exchange;
use self::joint::Joint;
use self::odd::GaugeProof;
use self::spot::{RADII, Spot};
use super::matching::modes::{stand_ins, widest};
use super::matching::weighed::Observation;
use super::matching::{Contact, Load, Matching};
use crate::inference::region::CredibleRegion;
use crate::mesh::SurfacePoint;
use crate::statistics::chi_squared_bound;

pub use self::before::{TouchesBefore, TouchesBeside};

/// Before anything is read, over each other. A pull is none of them: it is held against them by itself.
const ONE: f64 = 0.88;
const TWO: f64 = 0.06;
const THREE: f64 = 0.01;
const AREA: f64 = 0.03;
const ODD_GAUGE: f64 = 0.01;
/// That the model is worse where one of the gauges is than it says.
const WORSE_GAUGE: f64 = 0.1;
/// That it is so of all of them.
const WORSE_THERE: f64 = 0.03;
const UNCLEAR: f64 = 0.01;
const PULL: f64 = 0.01;
/// Several touches leave no more than this share of what a pull leaves that they are taken for.
const BETTER: f64 = 0.5;
/// One touch that is as sure as this need not be held against others.
const SURE: f64 = 0.995;
/// Starts that are gone from, and how many of where they lead are followed.
const PAIRS: usize = 16;
const SINGLES: usize = 4;
const FOLLOWED: usize = 8;
const AREAS: usize = 3;
const THIRDS: usize = 3;
/// With fewer gauges nothing is told but one touch.
const LEAST_CHANNELS: usize = 6;
/// One place with this share of the probability is the answer.
const CLEAR: f64 = 0.9;

/// What touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchKind {
    /// As many points as there are contacts.
    Points,
    /// One area, with its radius (m).
    Area(f64),
    /// Nothing that is known.
    Unclear,
}

/// All that touches, and how sure it is that there are so many.
#[derive(Clone, Debug, PartialEq)]
pub struct SeveralTouches {
    /// See [`TouchKind`].
    pub kind: TouchKind,
    /// Of there being so many, of this kind.
    pub probability: f64,
    /// The hardest first; one of an area, none of what is unclear.
    pub contacts: Vec<Contact>,
    /// Weighted squares that they do not explain.
    pub unexplained: f64,
    /// Probability of one point, of two, of three, of an area, and of nothing that is known.
    pub shares: [f64; 5],
}

impl SeveralTouches {
    /// How likely those of another answer are, by this one: that there are as many, of the same kind.
    #[must_use]
    pub fn share_of(&self, other: &Self) -> f64 {
        self.shares[other.which()]
    }

    /// Which of the shares is its own.
    fn which(&self) -> usize {
        match self.kind {
            TouchKind::Points => self.contacts.len().clamp(1, 3) - 1,
            TouchKind::Area(_) => 3,
            TouchKind::Unclear => 4,
        }
    }

    /// How many they are, where that is known.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        (self.kind != TouchKind::Unclear).then_some(self.contacts.len())
    }

    /// Whether both are as many, of the same kind.
    #[must_use]
    pub fn alike(&self, other: &Self) -> bool {
        let kind = |k| std::mem::discriminant(&k);
        kind(self.kind) == kind(other.kind) && self.count() == other.count()
    }

    /// One touch at a point, as sure as that; anything else is as likely, one over the other, as it is before anything is read.
    #[must_use]
    pub fn one(contact: Contact, probability: f64) -> Self {
        let others = [TWO, THREE, AREA, UNCLEAR];
        let all: f64 = others.iter().sum();
        let [two, three, area, unclear] = others.map(|p| (1.0 - probability) * p / all);
        Self {
            kind: TouchKind::Points,
            probability,
            contacts: vec![contact],
            unexplained: contact.unexplained,
            shares: [probability, two, three, area, unclear],
        }
    }
}

/// Where several touches are searched for: made once for a map; and what is known of its gauges by now.
#[derive(Clone)]
pub struct Several {
    coarse: std::sync::Arc<Coarse>,
    proof: GaugeProof,
}

impl Several {
    /// For an estimator's map.
    #[must_use]
    pub fn new(matching: &Matching) -> Self {
        Self {
            coarse: Coarse::new(&matching.map, &matching.errors).into(),
            proof: GaugeProof::none(matching.used.len()),
        }
    }

    /// Nothing is known of gauges any more.
    pub fn forget(&mut self) {
        self.proof.forget();
    }

    /// Only one touch makes a reading (strain): what gauges read of it proves them.
    pub fn learn(&mut self, matching: &Matching, reading: &[f64], one: &Contact) {
        self.proof.learn(matching, reading, one);
    }
}

impl Matching {
    /// How many touches make a reading (strain, a channel each), where and how hard each is. `one` is what was found
    /// where only one is looked for.
    pub fn count(&mut self, several: &Several, reading: &[f64], one: &Contact) -> SeveralTouches {
        self.count_with_evidence(several, reading, one).0
    }

    /// As [`Self::count`], and the logarithm of the reading's density over all that may touch; nothing where it is too light, or
    /// gauges are too few, to tell.
    fn count_with_evidence(
        &mut self,
        several: &Several,
        reading: &[f64],
        one: &Contact,
    ) -> (SeveralTouches, Option<f64>) {
        let used = self.used.clone();
        let observed = Observation::new(reading, &self.errors, &used);
        let channels = observed.w.iter().filter(|w| **w > 0.0).count();
        let alone = self.alone(&observed, one);
        let first = ONE.ln() + alone.log_evidence();
        let sure = match alone.best() {
            Some(best) => surely_one(best),
            // Too light to tell any others: as likely as it is before anything is read.
            None if channels < LEAST_CHANNELS || is_explained(one, channels) => ONE,
            // A single one would have to pull.
            None => 0.0,
        };
        let only_one = SeveralTouches::one(*one, sure);
        let is_told = channels >= LEAST_CHANNELS && first.is_finite();
        if channels < LEAST_CHANNELS || sure >= SURE {
            return (only_one, is_told.then_some(first));
        }
        let Several { coarse, proof } = several;
        let Some(whitened) = coarse.against(&observed, self.most_force) else {
            return (only_one, None);
        };
        let several = self.more_than_one(&observed, (coarse, &whitened), &alone);
        let nothing = UNCLEAR.ln() + of_nothing_known(&observed);
        let rival = several.iter().fold(nothing, |most, s| most.max(s.0));
        let ones = if rival > first {
            let [odd, worse] = self.with_one_gauge_off(proof, reading, one);
            let there = self.with_all_gauges_worse(reading, one);
            let off = [(odd, ODD_GAUGE), (worse, WORSE_GAUGE), (there, WORSE_THERE)];
            sum_of(
                off.into_iter()
                    .map(|(log, prior)| log + prior.ln())
                    .chain([first]),
            )
        } else {
            first
        };
        let [two, three, area] = &several;
        let logs = [ones, two.0, three.0, area.0, nothing];
        let all = sum_of(logs.into_iter());
        let shares = logs.map(|log| (log - all).exp());
        let which = (0..logs.len()).fold(0, |best, k| if logs[k] > logs[best] { k } else { best });
        let answer = match which {
            0 => SeveralTouches::one(*one, shares[0]),
            4 => SeveralTouches {
                kind: TouchKind::Unclear,
                contacts: Vec::new(),
                ..SeveralTouches::one(*one, shares[4])
            },
            k => self.touches(&observed, &several[k - 1].1.0, shares[k]),
        };
        (SeveralTouches { shares, ..answer }, Some(all))
    }

    /// Two points, three, and an area, each with the logarithm of its prior and its evidence.
    fn more_than_one(
        &self,
        observed: &Observation,
        (coarse, whitened): (&Coarse, &Whitened),
        alone: &Answers,
    ) -> [(f64, Answers); 3] {
        let two = self.two(observed, (coarse, whitened), alone);
        let three = self.three(observed, coarse, &two);
        let areas = coarse.areas(&self.map, whitened, AREAS);
        let areas = areas
            .iter()
            .filter_map(|area| self.joined(observed, &[*area], None));
        let area = Answers::of(&self.map, areas);
        [
            (TWO.ln() + two.log_evidence(), two),
            (THREE.ln() + three.log_evidence(), three),
            (AREA.ln() + area.log_evidence(), area),
        ]
    }

    /// Whether a reading is rather of something that lets go than of touches, be they one, several or an area: `one` is
    /// what was found where one touch is looked for, `pull` where one is that reads the opposite.
    pub fn is_rather_a_pull(
        &mut self,
        several: &Several,
        reading: &[f64],
        [one, pull]: [&Contact; 2],
    ) -> bool {
        let used = self.used.clone();
        let turned: Vec<f64> = reading.iter().map(|x| -x).collect();
        let turned = Observation::new(&turned, &self.errors, &used);
        let pulled = PULL.ln() + self.alone(&turned, pull).log_evidence();
        let observed = Observation::new(reading, &self.errors, &used);
        let alone = self.alone(&observed, one);
        if ONE.ln() + alone.log_evidence() > pulled {
            return false;
        }
        // Where gauges are few several touches explain everything, a pull too.
        let channels = observed.w.iter().filter(|w| **w > 0.0).count();
        let coarse = &several.coarse;
        let whitened = coarse.against(&observed, self.most_force);
        let Some(whitened) = whitened.filter(|_| channels >= LEAST_CHANNELS) else {
            return true;
        };
        // And with more unknowns than a pull they would explain a little more of what the model lacks.
        let better = |(log, answers): &(f64, Answers)| {
            let left = answers.best().map_or(f64::INFINITY, |best| 2.0 * best.left);
            *log > pulled && left < BETTER * pull.unexplained
        };
        let touched = self.more_than_one(&observed, (coarse, &whitened), &alone);
        !touched.iter().any(better)
    }

    /// As [`Self::count`] for touches that go on: from where they were. Nothing where they do not explain the reading any
    /// more.
    #[must_use]
    pub fn track_several(&self, reading: &[f64], last: &SeveralTouches) -> Option<SeveralTouches> {
        /// Steps from one sample to the next.
        const STEPS: usize = 2;
        let observed = Observation::new(reading, &self.errors, &self.used);
        let start = self.spots_of(last);
        let joint = self.joined(&observed, &start, Some(STEPS))?;
        self.explains(&joint, last).then(|| SeveralTouches {
            shares: last.shares,
            ..self.touches(&observed, &[joint], last.probability)
        })
    }

    /// Whether what is left over may be noise beside what was left before.
    fn explains(&self, joint: &Joint, last: &SeveralTouches) -> bool {
        let differs = 4.0 * (2.0 * self.used.len() as f64).sqrt();
        2.0 * joint.left <= last.unexplained + differs
    }

    fn spots_of(&self, touches: &SeveralTouches) -> Vec<Spot> {
        let radius = match touches.kind {
            TouchKind::Area(radius) => Some(radius),
            TouchKind::Points | TouchKind::Unclear => None,
        };
        let spot = |contact: &Contact| Spot {
            at: self.map.mesh.index().nearest(contact.position).0,
            force: contact.force,
            radius,
            about: contact.about(),
        };
        touches.contacts.iter().map(spot).collect()
    }

    /// From the best pairs of a coarse share of the map, and from where one alone may be.
    fn two(
        &self,
        observed: &Observation,
        (coarse, whitened): (&Coarse, &Whitened),
        alone: &Answers,
    ) -> Answers {
        let exchange = Exchange::new(&self.map, observed, coarse.making, self.most_force);
        let pairs = coarse.pairs(whitened, PAIRS);
        let beside = alone.0.iter().take(SINGLES);
        let beside = beside.filter_map(|one| exchange.with_one_more(&one.spots));
        let beside: Vec<Vec<Spot>> = beside.collect();
        let starts = pairs.iter().map(|pair| pair.to_vec());
        let starts = starts.chain(beside.iter().map(|spots| places_of(spots)));
        let settled = exchange.settled(starts, FOLLOWED);
        // Near a gauge no template may read as the place between them that one alone has led to.
        self.joined_from(observed, settled.iter().chain(&beside))
    }

    /// From the best two, where these leave something over.
    fn three(&self, observed: &Observation, coarse: &Coarse, two: &Answers) -> Answers {
        let exchange = Exchange::new(&self.map, observed, coarse.making, self.most_force);
        let channels = observed.w.iter().filter(|w| **w > 0.0).count();
        let over = |joint: &&Joint| 2.0 * joint.left > channels.saturating_sub(6) as f64 + 6.0;
        let begun = two.0.iter().take(THIRDS).filter(over);
        let starts = begun.filter_map(|two| exchange.with_one_more(&two.spots));
        let settled = exchange.settled(starts.map(|spots| places_of(&spots)), FOLLOWED);
        self.joined_from(observed, settled.iter())
    }

    fn touches(
        &self,
        observed: &Observation,
        answers: &[Joint],
        probability: f64,
    ) -> SeveralTouches {
        let best = &answers[0];
        let mut contacts: Vec<Contact> = (0..best.spots.len())
            .map(|k| self.contact_of(observed, answers, k))
            .collect();
        contacts.sort_by(|a, b| b.force.total_cmp(&a.force));
        let radius = best.spots.iter().find_map(|s| s.radius);
        SeveralTouches {
            kind: radius.map_or(TouchKind::Points, TouchKind::Area),
            probability,
            contacts,
            unexplained: 2.0 * best.left,
            shares: [0.0; 5],
        }
    }

    /// One of the spots of the best answer; where others are nearly as likely, with a region that holds theirs.
    fn contact_of(&self, observed: &Observation, answers: &[Joint], k: usize) -> Contact {
        let best = &answers[0];
        let spot = &best.spots[k];
        let place = self.map.mesh.point(spot.at);
        let all = sum_of(answers.iter().map(|j| j.log_evidence));
        let weight = |joint: &Joint| (joint.log_evidence - all).exp();
        let flat = flat_of(best, k);
        let region = if weight(best) >= CLEAR {
            CredibleRegion::of_normal(flat, best.planes[k])
        } else {
            let of_answer = |joint: &Joint| {
                let away = |i: &usize| self.map.mesh.point(joint.spots[*i].at).distance(place);
                let nearest = (0..joint.spots.len())
                    .min_by(|a, b| away(a).total_cmp(&away(b)))
                    .unwrap_or(0);
                let centre = self.map.mesh.point(joint.spots[nearest].at);
                stand_ins(
                    centre,
                    flat_of(joint, nearest),
                    joint.planes[nearest],
                    weight(joint),
                )
            };
            let places: Vec<(DVec3, f64)> = answers.iter().flat_map(of_answer).collect();
            CredibleRegion::of_places(&places, place, self.map.mesh.normal(spot.at))
        };
        let of_force = best.first(k) + spot.places();
        let load = Load {
            force: spot.force,
            variance: best.covariance[(of_force, of_force)],
            drag: spot.about.aside * spot.force,
            drag_deviation: best.drag_deviations[k],
        };
        let narrow = widest(flat) <= self.map.spacing().powi(2);
        self.contact(observed, spot.at, load, region, best.left, narrow)
    }
}

fn places_of(spots: &[Spot]) -> Vec<SurfacePoint> {
    spots.iter().map(|spot| spot.at).collect()
}

/// How sure one touch is at least: whatever else there is besides would have to be found in as much room as this was,
/// and could explain no more than what this leaves over.
fn surely_one(best: &Joint) -> f64 {
    let log_room = best.log_evidence - best.log_likelihood();
    let others = (1.0 - ONE) / ONE * (best.left + log_room).exp();
    (1.0 + others).recip()
}

/// Whether what one touch leaves over may be noise, and is less than what it explains.
fn is_explained(one: &Contact, channels: usize) -> bool {
    /// Deviations of χ².
    const BEYOND: f64 = 4.0;
    let noise = chi_squared_bound(channels as f64, BEYOND);
    one.unexplained < one.strength.min(noise)
}
