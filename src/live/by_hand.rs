//! Presses that somebody makes by hand, out of what a board sends: the rest just before each, and half a second of it that
//! stood still.

use std::collections::VecDeque;

use super::presses::Presses;
use super::receiver::Sample;
use super::update::LiveUpdate;
use crate::units;

/// How long the rest before a press is read (s).
const REST_S: f64 = 0.4;
/// A finger is on its way for so long before it is felt (s): that is no rest.
const ONSET_S: f64 = 0.2;
/// How long a press is read.
const READ_S: f64 = 0.5;
/// What is more than a mean needs is not kept.
const MOST: usize = 4096;

/// What was read of a press.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandPress {
    /// Before it.
    pub rest: Vec<Sample>,
    /// While it stood still.
    pub pressed: Vec<Sample>,
}

/// What there is to say of a press.
#[derive(Clone, Debug, PartialEq)]
pub enum HandNews {
    /// It stood still, and was read: it may be let go.
    Read,
    /// It is over.
    Over(HandPress),
    /// It is over, and never stood still, or came before there was any rest.
    Unsteady,
}

/// Takes presses as they come.
#[derive(Default)]
pub struct HandPresses {
    presses: Presses,
    rest: VecDeque<Sample>,
    during: VecDeque<Sample>,
    read: Option<HandPress>,
}

impl HandPresses {
    /// Whether a press is on.
    #[must_use]
    pub fn is_felt(&self) -> bool {
        self.presses.state().0
    }

    /// Takes in a sample with what was made of it, the noise of each gauge (strain) and whether it is trusted.
    pub fn take(
        &mut self,
        sample: &Sample,
        update: &LiveUpdate,
        noise: &[f64],
        used: &[bool],
    ) -> Option<HandNews> {
        let (was_felt, was_read) = self.presses.state();
        let over = self.presses.push(update, noise, used);
        let (is_felt, is_read) = self.presses.state();
        if over.is_some() {
            self.during.clear();
            let read = self.read.take();
            return Some(match read.filter(|r| !r.rest.is_empty()) {
                Some(read) => HandNews::Over(read),
                None => HandNews::Unsteady,
            });
        }
        if !is_felt {
            keep(&mut self.rest, sample, REST_S + ONSET_S);
            return None;
        }
        if !was_felt {
            let onset = |s: &Sample| units::seconds_between(s.time_us, sample.time_us) < ONSET_S;
            while self.rest.back().is_some_and(onset) {
                self.rest.pop_back();
            }
        }
        keep(&mut self.during, sample, READ_S);
        if is_read && !was_read {
            self.read = Some(HandPress {
                rest: self.rest.drain(..).collect(),
                pressed: self.during.iter().cloned().collect(),
            });
            return Some(HandNews::Read);
        }
        None
    }
}

/// Keeps the samples of the last seconds.
fn keep(samples: &mut VecDeque<Sample>, sample: &Sample, span_s: f64) {
    samples.push_back(sample.clone());
    let old = |s: &Sample| units::seconds_between(s.time_us, sample.time_us) > span_s;
    while samples.len() > MOST || samples.front().is_some_and(old) {
        samples.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::presses::tests::felt;

    /// A hundred samples a second: strain by the number of the sample, felt from `felt` on.
    fn fed(presses: &mut HandPresses, strain: impl Fn(u64) -> f64, count: u64) -> Vec<HandNews> {
        let at = |k: u64| {
            let strain = strain(k);
            let update = LiveUpdate {
                strain: Some(vec![strain]),
                touches: (strain > 5e-6).then(felt),
                ..LiveUpdate::nothing(k * 10_000)
            };
            let sample = Sample {
                time_us: k * 10_000,
                counts: vec![2000.0 + strain * 1e6],
            };
            (sample, update)
        };
        (0..count)
            .filter_map(|k| {
                let (sample, update) = at(k);
                presses.take(&sample, &update, &[1e-7], &[true])
            })
            .collect()
    }

    #[test]
    fn a_press_is_read_with_the_rest_before_its_onset() {
        // It rises for a fifth of a second, of which the first part is not felt yet.
        let strain = |k: u64| match k {
            0..100 | 240.. => 0.0,
            100..120 => 5e-6 * (k - 99) as f64,
            _ => 1e-4,
        };
        let mut presses = HandPresses::default();
        let news = fed(&mut presses, strain, 300);
        let [HandNews::Read, HandNews::Over(press)] = &news[..] else {
            panic!("{news:?}");
        };
        let mean = |of: &[Sample]| of.iter().map(|s| s.counts[0]).sum::<f64>() / of.len() as f64;
        assert!(
            (mean(&press.rest) - 2000.0).abs() < 1e-9,
            "{:?}",
            press.rest
        );
        assert!(press.rest.len() > 30 && press.pressed.len() > 30);
        assert!((mean(&press.pressed) - 2100.0).abs() < 3.0);
    }

    #[test]
    fn what_never_stands_still_or_had_no_rest_before_is_not_taken() {
        let rising = |k: u64| {
            if (100..=220).contains(&k) {
                1e-5 * (k - 99) as f64
            } else {
                0.0
            }
        };
        assert_eq!(
            fed(&mut HandPresses::default(), rising, 300),
            [HandNews::Unsteady]
        );
        let at_once = |k: u64| if k < 100 { 1e-4 } else { 0.0 };
        let news = fed(&mut HandPresses::default(), at_once, 200);
        assert_eq!(news, [HandNews::Read, HandNews::Unsteady]);
    }
}
