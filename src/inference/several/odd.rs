//! One gauge may say something else than it feels. That is held against several touches; less so of one that was right lately.

use super::density::{log_density, log_of_anything, sum_of};
use crate::inference::matching::weighed::Observation;
use crate::inference::matching::{Contact, Matching, ReadingErrors};

/// Deviation of what a dead gauge reads, over its noise.
const AT_REST: f64 = 4.0;
/// How much less likely a gauge that was right is odd now, at most (logarithm of a hundred): it may break at any time. And the
/// share of one look in that.
const MOST: f64 = 4.6;
const ONE_LOOK: f64 = 0.1;

/// How much worse the model of a gauge may be than it says, and that of a place: it says a mean over all of them.
const WORSE: f64 = 4.0;
const WORSE_THERE: f64 = 3.0;

/// What touches before have proved of gauges.
#[derive(Clone)]
pub(super) struct GaugeProof {
    /// Logarithms of how much less likely each reads anything.
    less: Vec<f64>,
}

impl GaugeProof {
    /// Nothing is proved.
    pub fn none(gauges: usize) -> Self {
        Self {
            less: vec![0.0; gauges],
        }
    }

    /// Nothing is proved any more.
    pub fn forget(&mut self) {
        self.less.fill(0.0);
    }

    /// Of one touch that alone makes a reading (strain): how much likelier what each gauge reads is of it than of a gauge
    /// that reads anything.
    pub fn learn(&mut self, matching: &Matching, reading: &[f64], one: &Contact) {
        let observed = Observation::new(reading, &matching.errors, &matching.used);
        let at = matching.map.mesh.index().nearest(one.position).0;
        let of_newton = matching.slope(&one.about(), at).reading;
        let glued = (matching.errors.deviations.as_ref()).map(|d| d.own.at(at));
        for (c, less) in self.less.iter_mut().enumerate() {
            if observed.w[c] > 0.0 {
                let glued = glued.as_ref().map_or(0.0, |own| own[c] * one.force);
                let off = observed.w[c].recip().sqrt().hypot(glued);
                let right = log_density(reading[c] - one.force * of_newton[c], off);
                let any = log_of_anything(reading[c], matching.errors.noise[c]);
                *less += ONE_LOOK * ((right - any).clamp(0.0, MOST) - *less);
            }
        }
    }
}

impl Matching {
    /// Logarithms of the density of one point where a gauge reads nothing, or anything, and where the model of one is worse than
    /// it says.
    pub(super) fn with_one_gauge_off(
        &mut self,
        proof: &GaugeProof,
        reading: &[f64],
        found: &Contact,
    ) -> [f64; 2] {
        let used = self.used.clone();
        let weights = Observation::new(reading, &self.errors, &used).w;
        let trusted: Vec<usize> = (0..used.len()).filter(|&c| weights[c] > 0.0).collect();
        let (mut odd, mut worse) = (Vec::new(), Vec::new());
        for &c in &trusted {
            self.used[c] = false;
            let without = self.used.clone();
            let observed = Observation::new(reading, &self.errors, &without);
            let others = self.alone(&observed, found);
            self.used[c] = true;
            let (log, noise) = (others.log_evidence(), self.errors.noise[c]);
            odd.push(log + log_density(reading[c], AT_REST * noise));
            odd.push(log + log_of_anything(reading[c], noise) - proof.less[c]);
            let errors = self.errors.worse_at(c, WORSE, weights[c]);
            let observed = Observation::new(reading, &errors, &used);
            let answers = self.joined_from(&observed, others.0.iter().map(|one| &one.spots));
            worse.push(answers.log_evidence() - proof.less[c]);
        }
        [odd, worse].map(|logs| sum_of(logs.iter().copied()) - (logs.len() as f64).ln())
    }

    /// Logarithm of the density of one point where the model of all gauges is worse than it says.
    pub(super) fn with_all_gauges_worse(&mut self, reading: &[f64], found: &Contact) -> f64 {
        let errors = ReadingErrors {
            relative: WORSE_THERE * self.errors.relative,
            ..self.errors.clone()
        };
        let used = self.used.clone();
        let observed = Observation::new(reading, &errors, &used);
        self.alone(&observed, found).log_evidence()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use glam::DVec3;

    use crate::inference::matching::tests::{CHANNELS, maps};
    use crate::inference::plate::{gauged_plate, plate, read_touches};
    use crate::inference::{ResponseMap, Several, TouchKind};

    #[test]
    fn a_gauge_that_was_right_is_less_likely_odd_until_it_is_not() {
        let [map, _] = maps();
        let reading: Vec<f64> = map.node(1).iter().map(|g| 20.0 * g).collect();
        let errors = ReadingErrors::of_noise(1e-7, CHANNELS);
        let mut matching = Matching::new(map, errors, 60.0);
        let touch = matching.find(&reading);
        let mut proof = GaugeProof::none(CHANNELS);
        let [unproved, _] = matching.with_one_gauge_off(&proof, &reading, &touch);
        for _ in 0..40 {
            proof.learn(&matching, &reading, &touch);
        }
        let said = format!("{:?}", proof.less);
        assert!(proof.less.iter().all(|less| *less > 0.9 * MOST), "{said}");
        let [proved, _] = matching.with_one_gauge_off(&proof, &reading, &touch);
        assert!(proved < unproved - 1.0, "{proved} {unproved}");
        // One begins to read half as much again.
        let mut lying = reading;
        lying[2] *= 1.5;
        for _ in 0..40 {
            proof.learn(&matching, &lying, &touch);
        }
        let said = format!("{:?}", proof.less);
        assert!(proof.less[2] < 0.1 && proof.less[1] > 0.9 * MOST, "{said}");
        proof.forget();
        assert_eq!(proof.less, [0.0; CHANNELS]);
    }

    fn on(map: ResponseMap) -> (Matching, Several) {
        let errors = ReadingErrors {
            relative: 0.02,
            ..ReadingErrors::of_noise(1e-6, 8)
        };
        let matching = Matching::new(Arc::new(map), errors, 60.0);
        let several = Several::new(&matching);
        (matching, several)
    }

    #[test]
    fn one_touch_of_which_the_model_is_off_at_a_gauge_is_one() {
        let (mut matching, several) = on(gauged_plate());
        let reading = read_touches(&matching.map, &[(340, 20.0)]);
        let root = (reading.iter().map(|x| x * x).sum::<f64>() / 8.0).sqrt();
        let all = (0..8).flat_map(|c| [0.1, 0.15].map(|by| (c, by, false)));
        // What another gauge reads is no strain.
        for (gauge, by, broken) in all.chain([(2, 0.15, true)]) {
            let mut off = reading.clone();
            off[gauge] += by * root;
            if broken {
                off[(gauge + 4) % 8] = f64::NAN;
            }
            let one = matching.find(&off);
            let seen = matching.count(&several, &off, &one);
            let said = format!("{gauge} {by} {broken} {seen:?}");
            assert!(seen.count() == Some(1) && seen.probability > 0.7, "{said}");
        }
    }

    #[test]
    fn one_touch_of_which_the_model_is_off_at_all_gauges_is_one() {
        let (mut matching, several) = on(gauged_plate());
        let reading = read_touches(&matching.map, &[(340, 20.0)]);
        let root = (reading.iter().map(|x| x * x).sum::<f64>() / 8.0).sqrt();
        for turn in 0..6 {
            let by = |c: usize| 0.09 * root * (2.1 * c as f64 + f64::from(turn)).sin();
            let off: Vec<f64> = (0..8).map(|c| reading[c] + by(c)).collect();
            let one = matching.find(&off);
            let seen = matching.count(&several, &off, &one);
            assert_eq!(seen.count(), Some(1), "{turn} {seen:?}");
        }
    }

    #[test]
    fn a_light_touch_on_quiet_gauges_is_one() {
        let errors = ReadingErrors::of_noise(0.02e-6, 8);
        let mut matching = Matching::new(Arc::new(gauged_plate()), errors, 60.0);
        let several = Several::new(&matching);
        for force in [0.03, 0.3] {
            let reading = read_touches(&matching.map, &[(340, force)]);
            let one = matching.find(&reading);
            let seen = matching.count(&several, &reading, &one);
            assert!(seen.count() == Some(1), "{seen:?}");
            assert!(matches!(seen.kind, TouchKind::Points), "{seen:?}");
            assert!((seen.contacts[0].force - force).abs() < 0.01, "{seen:?}");
        }
    }

    #[test]
    fn what_no_single_touch_explains_is_not_one() {
        // Gauges that feel everything the same way, and read it the other way.
        let map = plate(30, 2e-3, |place| {
            std::array::from_fn::<_, 8, _>(|c| {
                let gauge = DVec3::new(8e-3 * c as f64, 29e-3, 0.0);
                10e-6 * (-(place - gauge).length() / 9e-3).exp()
            })
        });
        let reading: Vec<f64> = map.node(340).iter().map(|x| -20.0 * x).collect();
        let (mut matching, several) = on(map);
        let one = matching.find(&reading);
        let seen = matching.count(&several, &reading, &one);
        assert_eq!(seen.count(), None, "{seen:?}");
        // Nor where one that is found explains more than it leaves, and leaves far more than noise.
        let found = Contact {
            strength: 2e3,
            unexplained: 9e2,
            ..one
        };
        let seen = matching.count(&several, &reading, &found);
        assert_eq!(seen.count(), None, "{seen:?}");
    }
}
