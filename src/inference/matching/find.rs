//! From a reading to the touch: the likeliest places, or the mean over all where that is what is known.

use super::modes::{Mode, widest};
use super::weighed::Observation;
use super::{Contact, Matching};
use crate::inference::deviation::TouchDoubts;

impl Matching {
    /// The touch that explains a reading (strain, a channel each) best.
    pub fn find(&mut self, reading: &[f64]) -> Contact {
        self.find_with_evidence(reading).0
    }

    /// As [`Self::find`], and the logarithm of the reading's density over all touches there may be, but for a constant
    /// that depends neither on the reading nor on the channels that are trusted.
    pub fn find_with_evidence(&mut self, reading: &[f64]) -> (Contact, f64) {
        let measured = Observation::new(reading, &self.errors, &self.used);
        self.score(&measured);
        let mut modes = self.modes(&measured);
        modes.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let best = modes[0];
        let over_best: f64 = (modes.iter().map(|m| m.log_evidence - best.log_evidence))
            .map(f64::exp)
            .sum();
        let evidence = best.log_evidence + over_best.ln() + measured.log_density();
        let broad = BROAD * self.map.spacing();
        let contact = if widest(best.covariance) > broad * broad {
            self.mean_of_templates(&measured, &best)
        } else {
            self.mean_of_modes(&measured, &modes)
        };
        (contact, evidence)
    }

    /// As [`Self::find`] for a touch that goes on: from the place where it was, without looking everywhere.
    /// Nothing where that does not explain the reading any more, or no longer clearly.
    #[must_use]
    pub fn track(&self, reading: &[f64], last: &Contact) -> Option<Contact> {
        let measured = Observation::new(reading, &self.errors, &self.used);
        // Noise alone makes them differ by a few deviations of χ².
        let differs = 4.0 * (2.0 * self.used.len() as f64).sqrt();
        let explained = |cost: f64| 2.0 * cost <= last.unexplained + differs;
        let start = self.map.mesh.index().nearest(last.position).0;
        let mode = self.follow(&measured, start, Some((last.force, last.about())));
        let broad = BROAD * self.map.spacing();
        (explained(mode.cost) && widest(mode.covariance) <= broad * broad)
            .then(|| self.contact_at(&measured, &mode, true))
    }
}

impl Matching {
    /// The best templates, apart from each other, each followed to the best place near it. There is one at least: the
    /// first template where none says anything.
    pub(in crate::inference) fn modes(&self, measured: &Observation) -> Vec<Mode> {
        let reach = APART * self.map.spacing();
        let mut starts: Vec<usize> = Vec::with_capacity(STARTS);
        for _ in 0..STARTS {
            let best = self.best_template(&|place| {
                let near = |&s: &usize| self.map.places[s].distance_squared(place) < reach * reach;
                !starts.iter().any(near)
            });
            starts.extend(best);
        }
        if starts.is_empty() {
            starts.push(0);
        }
        let begin = |&start: &usize| {
            let start = self.map.mesh.vertex_point(start);
            self.begin(measured, start, None, TouchDoubts::default())
        };
        let begun: Vec<Mode> = starts.iter().map(begin).collect();
        let best = begun
            .iter()
            .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
        let least = best.map_or(f64::NEG_INFINITY, |best| {
            best.log_evidence - HOPELESS - best.cost.max(0.0)
        });
        // Of numbers that are none all count.
        let may_count = |m: &Mode| m.log_evidence.total_cmp(&least).is_ge();
        let mut modes: Vec<Mode> = Vec::with_capacity(STARTS);
        for mode in begun.into_iter().filter(may_count) {
            let mode = self.settle(measured, mode, None);
            // Two starts may end at the same place.
            let same = |m: &Mode| m.position.distance(mode.position) < 0.5 * self.map.spacing();
            if !modes.iter().any(same) {
                modes.push(mode);
            }
        }
        modes
    }
}

/// Places from which Gauss–Newton begins, and how far they are apart in templates.
const STARTS: usize = 4;

const APART: f64 = 3.0;

/// A place that explains a reading so much worse than the best, and by as much as that leaves unexplained, will not be
/// the best one once both are settled, nor count beside it.
const HOPELESS: f64 = 40.0;

/// Beyond this deviation, in templates, their posterior takes the place of Gauss–Newton's normal one.
const BROAD: f64 = 1.0;
