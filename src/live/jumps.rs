//! Gauges that jump from one sample to the next and stay there: a wire was pulled, glue has let go a little. They go on measuring
//! from another zero, which is their rest from then on.
//!
//! What has changed is held against any touch that comes (as A. S. Willsky and H. L. Jones, IEEE Trans. Automatic
//! Control 21, 108, 1976, hold it against no change): one channel far beyond its noise, and all others not at all, is no touch
//! where the map says that those would feel it too.

use std::collections::VecDeque;

use super::news::LiveNews;
use crate::inference::Matching;
use crate::statistics::chi_squared_bound;

/// Samples before a jump and after it that have to agree: a spike is none.
const BESIDE: usize = 3;
/// Deviations of its noise by which a channel jumps at least, and by which its samples bend at most.
const FAR: f64 = 12.0;
const STEADY: f64 = 4.0;
/// Times as much as its slope changes by that a channel jumps at least.
const KINK: f64 = 4.0;
/// Deviations of χ² by which the others have changed at most, and by which they do if a touch is to be seen in them; the model
/// may say three times as much as there is.
const STILL: f64 = 3.0;
const UNSEEN: f64 = 8.0;
const OFF: f64 = 1.0 / 3.0;
/// Seconds in which a touch may come at least.
const STEEPEST_S: f64 = 0.5e-3;
/// Seconds after a jump in which nobody is told of another.
const TOLD_S: f64 = 10.0;
/// Seconds after a jump within which a channel shows that it has failed.
const FAILS_S: f64 = 1.0;

/// A channel that has jumped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    pub channel: usize,
    /// By so much (strain), and how well that is known (strain²).
    pub by: f64,
    pub variance: f64,
    /// Whether it is the first for a while.
    is_news: bool,
}

impl Jump {
    /// What there is to say of it.
    pub fn news(&self) -> Option<LiveNews> {
        (self.is_news).then_some(LiveNews::Jumped(self.channel, self.by))
    }
}

/// Looks for jumps.
#[derive(Default)]
pub(super) struct Jumps {
    /// The last samples (strain since the tare).
    samples: VecDeque<Vec<f64>>,
    /// How many samples each channel has been trusted for: one that was stuck comes back to where it belongs.
    trusted: Vec<usize>,
    /// The last jump, and seconds since then.
    last: Option<Jump>,
    since_s: Option<f64>,
}

impl Jumps {
    /// Takes in a sample (strain since the tare) of channels with this noise (strain), while something touches or nothing does,
    /// some seconds after the one before. A jump is taken off it.
    pub fn take_off(
        &mut self,
        matching: &Matching,
        sample: &mut [f64],
        noise: &[f64],
        (touching, step_s): (bool, f64),
    ) -> Option<Jump> {
        self.since_s = self.since_s.map(|since| since + step_s);
        if step_s <= 0.0 {
            self.samples.clear();
        }
        if let Some(back) = self.failed(&matching.used) {
            sample[back.channel] -= back.by;
            return Some(back);
        }
        self.trusted.resize(sample.len(), 0);
        for (trusted, used) in self.trusted.iter_mut().zip(&matching.used) {
            *trusted = if *used { *trusted + 1 } else { 0 };
        }
        self.samples.push_back(sample.to_vec());
        if self.samples.len() > 2 * BESIDE {
            self.samples.pop_front();
        }
        // Under a touch nobody can tell another zero from glue that has let go, which reads less of it.
        if touching || self.samples.len() < 2 * BESIDE {
            return None;
        }
        let change: Vec<f64> = (0..sample.len()).map(|c| self.change(c)).collect();
        let channel = self.alone(&change, noise, &matching.used)?;
        let by = change[channel];
        // None comes within less.
        let may_be_touch = step_s > STEEPEST_S && is_touch(matching, noise, (channel, by));
        if may_be_touch {
            return None;
        }
        for later in self.samples.iter_mut().skip(BESIDE) {
            later[channel] -= by;
        }
        sample[channel] -= by;
        self.last = Some(Jump {
            channel,
            by,
            variance: of_change(noise[channel]),
            is_news: self.since_s.replace(0.0).is_none_or(|s| s > TOLD_S),
        });
        self.last
    }

    /// The way back of a jump after which the channel has turned out to be stuck, noisy or at an end of its range: its rest is
    /// where it was, should it recover.
    fn failed(&mut self, used: &[bool]) -> Option<Jump> {
        let lately = self.since_s.is_some_and(|since| since < FAILS_S);
        let jump = self.last.filter(|jump| lately && !used[jump.channel])?;
        self.last = None;
        self.samples.clear();
        Some(Jump {
            by: -jump.by,
            is_news: false,
            ..jump
        })
    }

    /// By how much a channel has changed between the two samples in the middle (strain), beside what it goes on by: a press
    /// that comes slowly.
    fn change(&self, channel: usize) -> f64 {
        let [before, after] = [0, BESIDE].map(|from| self.line(from, channel));
        after.0 - before.0 - BESIDE as f64 * f64::midpoint(before.1, after.1)
    }

    /// Mean and slope of a channel, over the samples from one on.
    fn line(&self, from: usize, channel: usize) -> (f64, f64) {
        let [a, b, c] = [0, 1, 2].map(|k| self.samples[from + k][channel]);
        ((a + b + c) / 3.0, (c - a) / 2.0)
    }

    /// How far the samples from one on are off a line.
    fn bend(&self, from: usize, channel: usize) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| self.samples[from + k][channel]);
        (a - 2.0 * b + c).abs() / 6.0_f64.sqrt()
    }

    /// The one channel that has changed, between the two samples in the middle.
    fn alone(&self, change: &[f64], noise: &[f64], used: &[bool]) -> Option<usize> {
        let far = |c: &usize| used[*c] && change[*c].abs() > FAR * noise[*c];
        let mut jumped = (0..change.len()).filter(far);
        let channel = jumped.next().filter(|_| jumped.next().is_none())?;
        if self.trusted[channel] < 2 * BESIDE {
            return None;
        }
        let bends = [0, BESIDE].map(|from| self.bend(from, channel));
        // Where a press begins its slope is another one.
        let kink = self.line(BESIDE, channel).1 - self.line(0, channel).1;
        let steady = bends.iter().all(|bend| *bend < STEADY * noise[channel])
            && change[channel].abs() > KINK * kink.abs();
        let count = used.iter().filter(|used| **used).count() as f64 - 1.0;
        let still = others(change, noise, used, channel) < chi_squared_bound(count, STILL);
        (steady && still && count > 0.0).then_some(channel)
    }
}

/// Weighted squares of what all channels but one change by.
fn others(change: &[f64], noise: &[f64], used: &[bool], but: usize) -> f64 {
    let all = change.iter().zip(noise).zip(used).enumerate();
    all.filter(|(c, (_, used))| **used && *c != but)
        .map(|(_, ((change, noise), _))| change * change / of_change(*noise))
        .sum()
}

/// Variance of what changes (strain²), of two means of three and two slopes.
fn of_change(noise: f64) -> f64 {
    noise * noise * (2.0 / 3.0 + 9.0 / 4.0)
}

/// Whether any touch that a limb bears may change a channel by so much (strain), and the others by no more than their noise.
fn is_touch(matching: &Matching, noise: &[f64], (channel, by): (usize, f64)) -> bool {
    let count = matching.used.iter().filter(|used| **used).count() as f64 - 1.0;
    let unseen = chi_squared_bound(count, UNSEEN);
    let places = matching.map.values().chunks_exact(noise.len());
    // As hard as it would have to be.
    let mut touches = places.map(|gains| (gains, by / gains[channel]));
    touches.any(|(gains, force)| {
        let change: Vec<f64> = gains.iter().map(|gain| OFF * force * gain).collect();
        (0.0..=matching.most_force).contains(&force)
            && others(&change, noise, &matching.used, channel) < unseen
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::matching::tests::{CHANNELS, maps};

    const NOISE: f64 = 1e-7;

    /// So many samples, with what is read in each beside noise: the jumps, and when each was found.
    fn jumps(samples: usize, read: impl Fn(usize) -> Vec<f64>) -> Vec<(usize, Jump)> {
        jumps_where(samples, read, |_| true)
    }

    /// The same, where the second gauge is trusted in some samples.
    fn jumps_where(
        samples: usize,
        read: impl Fn(usize) -> Vec<f64>,
        trusted: impl Fn(usize) -> bool,
    ) -> Vec<(usize, Jump)> {
        let [map, _] = maps();
        let errors = ReadingErrors::of_noise(NOISE, CHANNELS);
        let mut matching = Matching::new(map, errors, 60.0);
        let mut looked = Jumps::default();
        let mut off = vec![0.0; CHANNELS];
        let mut found = Vec::new();
        for k in 0..samples {
            let noise = |c: usize| NOISE * ((7 * k + 3 * c) % 5) as f64 / 2.0;
            let mut sample: Vec<f64> = read(k).iter().zip(&off).map(|(x, o)| x - o).collect();
            for (c, x) in sample.iter_mut().enumerate() {
                *x += noise(c);
            }
            let step_s = if k == 0 { 0.0 } else { 0.01 };
            matching.used[1] = trusted(k);
            let touching = read(k).iter().all(|x| *x != 0.0);
            let jump = looked.take_off(
                &matching,
                &mut sample,
                &[NOISE; CHANNELS],
                (touching, step_s),
            );
            if let Some(jump) = jump {
                off[jump.channel] += jump.by;
                found.push((k, jump));
            }
        }
        found
    }

    fn one_channel(channel: usize, strain: f64) -> Vec<f64> {
        let mut read = vec![0.0; CHANNELS];
        read[channel] = strain;
        read
    }

    #[test]
    fn a_gauge_that_jumps_goes_on_from_there() {
        // Up, and back while nobody wants to hear of it.
        let strain = |k| if (20..60).contains(&k) { 30e-6 } else { 0.0 };
        let found = jumps(100, |k| one_channel(1, strain(k)));
        let [(up_at, up), (down_at, down)] = found[..] else {
            panic!("{found:?}");
        };
        assert_eq!([up_at, down_at], [22, 62]);
        assert!(up.channel == 1 && down.channel == 1);
        assert!((up.by - 30e-6).abs() < 6.0 * NOISE && (down.by + 30e-6).abs() < 6.0 * NOISE);
        assert!(up.is_news && !down.is_news);
    }

    #[test]
    fn under_a_press_nobody_can_tell() {
        let [map, _] = maps();
        let reading = &map.values()[..CHANNELS];
        let found = jumps(100, |k| {
            let jumped = one_channel(2, if k < 40 { 0.0 } else { -30e-6 });
            let pairs = reading.iter().zip(jumped);
            pairs.map(|(g, jumped)| 4.0 * g + jumped).collect()
        });
        assert_eq!(found, []);
    }

    #[test]
    fn a_gauge_that_was_stuck_comes_back_and_has_not_jumped() {
        let stuck = |k: usize| one_channel(1, if k < 40 { 30e-6 } else { 0.0 });
        assert_eq!(jumps_where(100, stuck, |k| k >= 40), []);
        assert_eq!(jumps_where(100, stuck, |_| true).len(), 1);
    }

    /// It stays at a value that it cannot leave, and is found to; afterwards it reads what it should.
    #[test]
    fn a_gauge_that_jumps_and_fails_has_its_rest_where_it_was() {
        let read = |k: usize| one_channel(1, if (40..80).contains(&k) { 30e-6 } else { 0.0 });
        let found = jumps_where(120, read, |k| !(60..80).contains(&k));
        let [(at, jump), (back_at, back)] = found[..] else {
            panic!("{found:?}");
        };
        assert_eq!([at, back_at], [42, 60]);
        assert!(jump.by + back.by == 0.0 && back.channel == 1 && !back.is_news);
    }

    #[test]
    fn spikes_and_slow_changes_are_no_jumps() {
        let spike = |k| if k == 20 || k == 21 { 30e-6 } else { 0.0 };
        assert_eq!(jumps(60, |k| one_channel(1, spike(k))), []);
        let slow = |k: usize| 30e-6 * (k.clamp(20, 30) - 20) as f64 / 10.0;
        assert_eq!(jumps(60, |k| one_channel(1, slow(k))), []);
    }

    /// However steep it is, and however little of it the others feel.
    #[test]
    fn a_touch_that_comes_or_goes_is_no_jump() {
        let [map, _] = maps();
        for reading in map.values().chunks(CHANNELS) {
            for force in [0.02, 0.2, 2.0] {
                let size = |k| if (20..60).contains(&k) { force } else { 0.0 };
                let found = jumps(100, |k| reading.iter().map(|g| size(k) * g).collect());
                assert_eq!(found, []);
            }
        }
    }
}
