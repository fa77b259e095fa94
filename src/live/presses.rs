//! Presses one after another, each read while it is steady: for whoever asks for presses at known places.

use std::collections::VecDeque;

use super::update::LiveUpdate;
use crate::units;

/// Seconds that a press is read for, and that pass between two looks at it.
const READ_S: f64 = 0.5;
const LOOK_S: f64 = 0.1;
/// Seconds without a touch after which it is over.
const OVER_S: f64 = 0.15;
/// Both halves of what is read differ by so many standard deviations of noise at most, and by this share of the reading.
const DEVIATIONS: f64 = 5.0;
const SHARE: f64 = 0.02;

/// A press that is over.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedPress {
    /// When it was first and last felt (µs).
    pub from_us: u64,
    /// See [`Self::from_us`].
    pub until_us: u64,
    /// Strain of each channel in the mean, no number of one that was not trusted; nothing where it never stood still.
    pub reading: Option<Vec<f64>>,
}

/// Takes presses out of what is felt.
#[derive(Default)]
pub struct Presses {
    rows: VecDeque<(u64, Vec<f64>)>,
    /// When the press that goes on was first and last felt.
    felt: Option<[u64; 2]>,
    reading: Option<Vec<f64>>,
    looked_us: u64,
}

impl Presses {
    /// Whether something presses, and whether it has been read.
    #[must_use]
    pub fn state(&self) -> (bool, bool) {
        (self.felt.is_some(), self.reading.is_some())
    }

    /// Takes in a sample, with the noise of each channel (strain) and whether it is trusted; the press that is over by now.
    pub fn push(
        &mut self,
        update: &LiveUpdate,
        noise: &[f64],
        used: &[bool],
    ) -> Option<FinishedPress> {
        let now = update.time_us;
        if let (Some(_), Some(strain)) = (&update.touches, &update.strain) {
            let from = self.felt.map_or(now, |[from, _]| from);
            self.felt = Some([from, now]);
            self.rows.push_back((now, strain.clone()));
            self.look(now, noise, used);
            return None;
        }
        let [from_us, until_us] = self.felt?;
        if units::seconds_between(until_us, now) < OVER_S {
            return None;
        }
        let reading = self.reading.take();
        *self = Self::default();
        Some(FinishedPress {
            from_us,
            until_us,
            reading,
        })
    }

    /// Reads it, where it has stood still for long enough.
    fn look(&mut self, now: u64, noise: &[f64], used: &[bool]) {
        let old = |row: &(u64, Vec<f64>)| units::seconds_between(row.0, now) > READ_S;
        let mut lasted = false;
        while self.rows.front().is_some_and(old) {
            self.rows.pop_front();
            lasted = true;
        }
        if !lasted || units::seconds_between(self.looked_us, now) < LOOK_S || self.rows.len() < 4 {
            return;
        }
        self.looked_us = now;
        let half = self.rows.len() / 2;
        let [first, second] = [0..half, half..2 * half].map(|part| mean(self.rows.range(part)));
        let squares: f64 = second.iter().map(|x| x * x).sum();
        let rms = (squares / second.len().max(1) as f64).sqrt();
        let steady = (0..first.len()).filter(|&c| used[c]).all(|c| {
            let by_noise = DEVIATIONS * noise[c] * (2.0 / half as f64).sqrt();
            (first[c] - second[c]).abs() < by_noise + SHARE * rms
        });
        if steady {
            let all = mean(self.rows.iter());
            let trusted = |(c, x): (usize, f64)| if used[c] { x } else { f64::NAN };
            self.reading = Some(all.into_iter().enumerate().map(trusted).collect());
        }
    }
}

fn mean<'a>(rows: impl Iterator<Item = &'a (u64, Vec<f64>)> + Clone) -> Vec<f64> {
    let count = rows.clone().count().max(1) as f64;
    let mut sum = Vec::new();
    for (_, row) in rows {
        sum.resize(row.len(), 0.0);
        for (s, x) in sum.iter_mut().zip(row) {
            *s += x / count;
        }
    }
    sum
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::inference::{Contact, SeveralTouches};

    /// A newton that is felt somewhere.
    pub fn felt() -> SeveralTouches {
        SeveralTouches::one(Contact::of_finger(1.0), 1.0)
    }

    fn update(k: u64, strain: f64) -> LiveUpdate {
        LiveUpdate {
            strain: Some(vec![strain, -strain, 0.0]),
            touches: (strain != 0.0).then(felt),
            ..LiveUpdate::nothing(k * 10_000)
        }
    }

    #[test]
    fn a_press_is_read_where_it_stands_still() {
        let mut presses = Presses::default();
        let force = |k: u64| match k {
            0..50 | 250.. => 0.0,
            50..70 => 5e-6 * (k - 49) as f64,
            230..250 => 5e-6 * (250 - k) as f64,
            _ => 1e-4,
        };
        let used = [true, true, false];
        let over: Vec<FinishedPress> = (0..300)
            .filter_map(|k| presses.push(&update(k, force(k)), &[1e-7; 3], &used))
            .collect();
        assert_eq!(over.len(), 1);
        assert_eq!((over[0].from_us, over[0].until_us), (500_000, 2_490_000));
        let reading = over[0].reading.as_ref().unwrap();
        assert!((reading[0] - 1e-4).abs() < 2e-6 && (reading[1] + 1e-4).abs() < 2e-6);
        assert!(reading[2].is_nan());
    }

    #[test]
    fn what_never_stands_still_is_not_read() {
        let mut presses = Presses::default();
        let force = |k: u64| if k < 200 { 1e-6 * (k + 1) as f64 } else { 0.0 };
        let over =
            (0..300).find_map(|k| presses.push(&update(k, force(k)), &[1e-7; 3], &[true; 3]));
        assert_eq!(over.unwrap().reading, None);
    }
}
