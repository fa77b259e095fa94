//! A touch that has stood for a while goes: what changes in that moment is what it read, and what is left is the rest. What the
//! rest has drifted by under a touch is hardly told from where and how hard it presses; but no drift is as quick as a hand.

use super::standing::squares_off;
use crate::inference::{Contact, Matching};
use crate::statistics::chi_squared_bound;

/// Seconds that a touch stands before it may have hidden what is worth it.
const STANDS_S: f64 = 5.0;
/// Seconds that make out what it reads, and how hard it was thought to press.
const READS_S: f64 = 1.0;
/// Of the size of what it reads: what makes another reading of it, and what is still the same one.
const OTHER: f64 = 0.3;
const SAME: f64 = 0.05;
/// Deviations of χ² beyond which it is no noise.
const NOISE: f64 = 8.0;
/// Samples, and seconds, for which the other reading has to stay where it is; and seconds within which a hand lets go.
const CALM: f64 = 6.0;
const CALM_S: f64 = 0.06;
const LONGEST_S: f64 = 1.0;
/// Seconds within which a hand has come, and the share of its squares from which on a reading that changes is still of all of it.
const COMES_S: f64 = 1.0;
const GOES_ON: f64 = 0.7;
/// Seconds that make out what was read before, and the share of its squares that may have been there.
const BEFORE_S: f64 = 0.5;
const SUDDEN: f64 = 0.3;
/// By what share of its size what has gone may differ from what has come.
const LIKE: f64 = 0.4;
/// Of what has changed, the share that the touch which has gone may leave over.
const LEFT: f64 = 0.1;
/// The whole touch has gone where what has gone pressed so much of it, or where it was so far from what is left (m).
const WHOLE: f64 = 0.8;
const ELSEWHERE: f64 = 0.02;
/// What a rest may move by in a second under touches, and at most (strain), beside a share of what loads it.
const SPEED: f64 = 1e-6;
const MOST: f64 = 100e-6;
const CREEPS: f64 = 0.05;

/// One touch that stands.
#[derive(Clone, Debug, Default)]
pub(super) struct Departure {
    /// What was read before anything touched (strain), of so many seconds.
    before: Vec<f64>,
    before_s: f64,
    /// What it reads (strain), and how hard it is thought to press (N).
    level: Vec<f64>,
    force: f64,
    stood_s: f64,
    /// Since the rest was last seen, and then when it came to this level.
    hidden_s: f64,
    began_s: f64,
    /// Whether it came at once, as a hand does and no drift, and what it read then (strain).
    came: bool,
    arrived: Vec<f64>,
    /// Whether one touch is found in it.
    is_one: bool,
    leaving: Option<Leaving>,
}

/// Its reading is another one.
#[derive(Clone, Debug)]
struct Leaving {
    lasts_s: f64,
    /// The mean of what it has come to (strain), of so many samples in so many seconds.
    new: Vec<f64>,
    samples: f64,
    calm_s: f64,
}

impl Departure {
    /// Takes in a reading (strain) some seconds after the one before, and how hard the one touch presses that is found in
    /// it. Whether the touch that stood has just gone, so that all that is left is the rest.
    pub fn is_over(
        &mut self,
        matching: &mut Matching,
        strain: &[f64],
        (force, step_s): (Option<f64>, f64),
    ) -> bool {
        self.hidden_s += step_s;
        let size = self.size(matching);
        if self.level.is_empty() || differs(matching, strain, &self.level, OTHER * OTHER * size) {
            if self.stood_s < STANDS_S {
                self.begin(matching, strain);
                return false;
            }
        } else {
            self.stand(matching, strain, force, step_s);
            return false;
        }
        let leaving = (self.leaving).get_or_insert_with(|| Leaving::to(strain));
        let same = SAME * SAME * size;
        if !leaving.is_calm(matching, strain, same, step_s) {
            if leaving.lasts_s > LONGEST_S {
                self.begin(matching, strain);
            }
            return false;
        }
        let left = std::mem::take(&mut leaving.new);
        let is_over = self.has_gone(matching, &left);
        self.begin(matching, strain);
        is_over
    }

    /// How much it reads, as far as that is not the rest that has moved since it came.
    fn size(&self, matching: &Matching) -> f64 {
        let now = size(matching, &self.level);
        let there = !self.arrived.is_empty();
        there
            .then(|| size(matching, &self.arrived))
            .map_or(now, |then| then.min(now))
    }

    /// Nothing touches, some seconds after the sample before.
    pub fn rest(&mut self, strain: &[f64], step_s: f64) {
        if self.before.is_empty() {
            self.before = strain.to_vec();
        }
        self.before_s += step_s;
        approach(
            &mut self.before,
            strain,
            step_s,
            BEFORE_S.min(self.before_s),
        );
    }

    /// Another touch stands, that reads so.
    fn begin(&mut self, matching: &Matching, strain: &[f64]) {
        let came = self.came && size(matching, strain) > GOES_ON * size(matching, &self.level);
        *self = Self {
            before: std::mem::take(&mut self.before),
            before_s: self.before_s,
            level: strain.to_vec(),
            hidden_s: self.hidden_s,
            began_s: self.hidden_s,
            came,
            arrived: if came {
                std::mem::take(&mut self.arrived)
            } else {
                Vec::new()
            },
            ..Self::default()
        };
    }

    /// It goes on.
    fn stand(&mut self, matching: &Matching, strain: &[f64], force: Option<f64>, step_s: f64) {
        self.leaving = None;
        self.is_one = force.is_some();
        self.stood_s += step_s;
        let within_s = READS_S.min(self.stood_s);
        approach(&mut self.level, strain, step_s, within_s);
        let force = [force.unwrap_or(self.force)];
        approach(
            std::slice::from_mut(&mut self.force),
            &force,
            step_s,
            within_s,
        );
        self.came |= self.began_s < COMES_S && self.stood_s > CALM_S && self.is_sudden(matching);
        if self.came && self.arrived.is_empty() && self.stood_s > READS_S {
            self.arrived.clone_from(&self.level);
        }
    }

    /// Whether what stands was not there just before, as what drifts would have been.
    fn is_sudden(&self, matching: &Matching) -> bool {
        let there = size(matching, &self.before);
        !self.before.is_empty() && there < SUDDEN * size(matching, &self.level)
    }

    /// Whether a reading (strain) is of a touch that came at once and has not gone: as little as is known of the rest by now, it
    /// is there.
    pub fn stays(&self, matching: &Matching, strain: &[f64]) -> bool {
        let same = || OTHER * OTHER * self.size(matching);
        self.came && !differs(matching, strain, &self.level, same())
    }

    /// Whether all of it has gone, where this (strain) is left: what has come, or else a touch that leaves no other behind.
    fn has_gone(&self, matching: &mut Matching, left: &[f64]) -> bool {
        let gone: Vec<f64> = self.level.iter().zip(left).map(|(a, b)| a - b).collect();
        let is_first = self.began_s < COMES_S && !self.arrived.is_empty();
        let like = LIKE * LIKE * size(matching, &self.arrived);
        if is_first && !differs(matching, &gone, &self.arrived, like) {
            return true;
        }
        self.is_one
            && self.may_have_drifted(matching, left)
            && self.leaves_no_other(matching, [&gone, left])
    }

    /// Whether the rest may be as far off as what is left (strain).
    fn may_have_drifted(&self, matching: &Matching, left: &[f64]) -> bool {
        let drift = (SPEED * self.hidden_s).min(MOST);
        let may_drift = self.level.iter().zip(left).zip(&matching.used);
        may_drift
            .filter(|(_, used)| **used)
            .all(|((level, left), _)| left.abs() < drift + CREEPS * level.abs())
    }

    /// Whether what has gone (strain) is a touch, and what is left is no lighter one at its place.
    fn leaves_no_other(&self, matching: &mut Matching, [gone, left]: [&[f64]; 2]) -> bool {
        let touch = matching.find(gone);
        if touch.unexplained > LEFT * touch.strength {
            return false;
        }
        let is_elsewhere = |left: &Contact| touch.position.distance(left.position) > ELSEWHERE;
        touch.force > WHOLE * self.force || is_elsewhere(&matching.find(left))
    }
}

impl Leaving {
    fn to(strain: &[f64]) -> Self {
        Self {
            lasts_s: 0.0,
            new: strain.to_vec(),
            samples: 0.0,
            calm_s: 0.0,
        }
    }

    /// Takes in a reading (strain), some seconds after the one before. Whether it has stayed where it is, within so many
    /// squares of the noise, for long enough.
    fn is_calm(&mut self, matching: &Matching, strain: &[f64], same: f64, step_s: f64) -> bool {
        let lasts_s = self.lasts_s + step_s;
        if differs(matching, strain, &self.new, same) {
            *self = Self::to(strain);
        }
        self.lasts_s = lasts_s;
        self.samples += 1.0;
        self.calm_s += step_s;
        for (new, x) in self.new.iter_mut().zip(strain) {
            *new += (x - *new) / self.samples;
        }
        self.samples >= CALM && self.calm_s >= CALM_S
    }
}

/// Lets a mean follow what is read, within so many seconds.
fn approach(mean: &mut [f64], read: &[f64], step_s: f64, within_s: f64) {
    let share = (step_s / within_s.max(f64::MIN_POSITIVE)).min(1.0);
    for (mean, x) in mean.iter_mut().zip(read) {
        *mean += share * (x - *mean);
    }
}

/// Squares of the noise.
fn size(matching: &Matching, strain: &[f64]) -> f64 {
    let nothing = vec![0.0; strain.len()];
    squares_off(matching, strain, &nothing).sum()
}

/// Whether a reading is off another one by more than so many squares of the noise, and more than noise.
fn differs(matching: &Matching, strain: &[f64], from: &[f64], squares: f64) -> bool {
    let channels = matching.used.iter().filter(|used| **used).count() as f64;
    let off: f64 = squares_off(matching, strain, from).sum();
    off > squares.max(chi_squared_bound(channels, NOISE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::matching::tests::{CHANNELS, maps};

    const STEP_S: f64 = 0.01;

    /// A touch at one place, and what is thought of it.
    struct Hand {
        matching: Matching,
        newton: Vec<f64>,
        departure: Departure,
        drifted: f64,
    }

    impl Hand {
        fn at_rest() -> Self {
            let [map, _] = maps();
            let mut hand = Self {
                newton: map.values()[CHANNELS..2 * CHANNELS].to_vec(),
                matching: Matching::new(map, ReadingErrors::of_noise(1e-7, CHANNELS), 60.0),
                departure: Departure::default(),
                drifted: 0.0,
            };
            hand.rests(0.0);
            hand
        }

        fn strain(&self, force: f64) -> Vec<f64> {
            let drift = [1.0, -0.5, 0.7, 0.2].map(|way| way * self.drifted);
            self.newton
                .iter()
                .zip(drift)
                .map(|(g, d)| force * g + d)
                .collect()
        }

        fn rests(&mut self, force: f64) {
            let strain = self.strain(force);
            (0..100).for_each(|_| self.departure.rest(&strain, STEP_S));
        }

        /// Presses for so long, with what nobody knows of the rest's drift (strain a second); whether it is ever over, and whether it stays at the end.
        fn presses(&mut self, force: f64, seconds: f64, drift: f64) -> [bool; 2] {
            let mut over = false;
            for _ in 0..(seconds / STEP_S) as usize {
                self.drifted += drift * STEP_S;
                let strain = self.strain(force);
                let now = (Some(force), STEP_S);
                over |= self.departure.is_over(&mut self.matching, &strain, now);
            }
            let stays = self.departure.stays(&self.matching, &self.strain(force));
            [over, stays]
        }
    }

    #[test]
    fn what_has_come_at_once_stays_until_it_goes_however_the_rest_drifts() {
        let mut hand = Hand::at_rest();
        assert_eq!(hand.presses(8.0, 60.0, 0.2e-6), [false, true]);
        // What is left is as much as a touch of newtons.
        assert!(hand.drifted > 10e-6);
        assert!(hand.presses(0.0, 0.2, 0.0)[0]);
    }

    #[test]
    fn a_hand_that_eases_has_not_gone() {
        let mut hand = Hand::at_rest();
        assert_eq!(hand.presses(8.0, 20.0, 0.0), [false, true]);
        assert_eq!(hand.presses(4.0, 20.0, 0.0), [false, false]);
    }

    #[test]
    fn what_was_there_before_it_was_felt_has_not_come() {
        let mut hand = Hand::at_rest();
        hand.rests(6.0);
        assert_eq!(hand.presses(8.0, 20.0, 0.0), [false, false]);
    }
}
