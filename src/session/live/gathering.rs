//! What gauges read of known presses, taken as it comes in: how often the window is drawn has no part in it.

use glam::DVec3;

use crate::inference::calibration::SAMPLES;

/// Readings that are taken of a press: the first may still show the rise.
const READINGS: usize = 1 + SAMPLES;
/// Between two of them (µs of the board's clock): hum of the mains, at 50 or 60 Hz, is met at all its phases.
const APART_US: u64 = 13_000;

/// Where a press was, how hard (N), and what the gauges read of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Gathered {
    /// On the part (m).
    pub at: DVec3,
    /// N.
    pub force: f64,
    /// Strain, a channel each: the mean of [`SAMPLES`] readings.
    pub strain: Vec<f64>,
}

/// Which presses are being read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Awaited {
    /// None.
    #[default]
    Nothing,
    /// The one that is on, at this place (m) and as hard (N).
    Press(DVec3, f64),
    /// All whose place and force a simulated board tells, until somebody ends it; each once.
    Board,
}

/// Takes readings of known presses.
#[derive(Default)]
pub struct Gathering {
    awaited: Awaited,
    /// How the part is touched while these rows are taken, where the board tells it.
    truth: Option<(DVec3, f64)>,
    rows: Vec<Vec<f64>>,
    last_us: u64,
    /// Where the last press was that a board told of and was taken.
    read: Option<DVec3>,
    taken: Vec<Gathered>,
}

impl Gathering {
    /// Begins to read anew, or ends it. What was finished waits until somebody asks for it.
    pub fn begin(&mut self, awaited: Awaited) {
        *self = Self {
            awaited,
            taken: self.take(),
            ..Self::default()
        };
    }

    #[must_use]
    pub fn awaited(&self) -> Awaited {
        self.awaited
    }

    /// What was taken since somebody asked last.
    pub fn take(&mut self) -> Vec<Gathered> {
        std::mem::take(&mut self.taken)
    }

    /// A sample, and how the part is really touched (m, N) where the board tells it.
    pub fn hear(&mut self, time_us: u64, strain: &[f64], truth: Option<(DVec3, f64)>) {
        let press = match self.awaited {
            Awaited::Nothing => return,
            Awaited::Press(at, force) => Some((at, force)),
            Awaited::Board => self.standing(truth),
        };
        let Some((at, force)) = press else {
            return;
        };
        // A clock that began anew is another time too.
        if !self.rows.is_empty() && self.last_us.abs_diff(time_us) < APART_US {
            return;
        }
        self.last_us = time_us;
        self.rows.push(strain.to_vec());
        if self.rows.len() < READINGS {
            return;
        }
        let rows = std::mem::take(&mut self.rows);
        self.taken.push(Gathered {
            at,
            force,
            strain: mean(&rows[1..]),
        });
        match self.awaited {
            Awaited::Board => self.read = Some(at),
            _ => self.awaited = Awaited::Nothing,
        }
    }

    /// The touch that the board tells of, where its force stands still and it was not read yet.
    fn standing(&mut self, truth: Option<(DVec3, f64)>) -> Option<(DVec3, f64)> {
        if truth != self.truth {
            self.truth = truth;
            self.rows.clear();
            return None;
        }
        truth.filter(|(place, _)| self.read != Some(*place))
    }
}

/// The mean of rows; channels that not all of them have are left away.
fn mean(rows: &[Vec<f64>]) -> Vec<f64> {
    let channels = rows.iter().map(Vec::len).min().unwrap_or(0);
    let of = |c: usize| rows.iter().map(|row| row[c]).sum::<f64>() / rows.len() as f64;
    (0..channels).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: DVec3 = DVec3::new(0.01, 0.02, 0.03);

    fn of(awaited: Awaited) -> Gathering {
        let mut gathering = Gathering::default();
        gathering.begin(awaited);
        gathering
    }

    /// Samples a millisecond apart from `from_ms` on, each the number of its millisecond, while a touch has a force (N).
    fn hear(gathering: &mut Gathering, from_ms: u64, count: u64, force: impl Fn(u64) -> f64) {
        for ms in from_ms..from_ms + count {
            let touch = (force(ms) > 0.0).then(|| (HERE, force(ms)));
            gathering.hear(1000 * ms, &[ms as f64], touch);
        }
    }

    #[test]
    fn a_press_is_read_off_the_samples_however_seldom_somebody_looks() {
        let mut gathering = of(Awaited::Press(HERE, 5.0));
        hear(&mut gathering, 100, 1000, |_| 0.0);
        let taken = gathering.take();
        assert_eq!(taken.len(), 1);
        assert_eq!((taken[0].at, taken[0].force), (HERE, 5.0));
        // Nine readings, 13 ms apart, after the first.
        assert_eq!(taken[0].strain, [100.0 + 13.0 * 5.0]);
        assert_eq!(gathering.awaited(), Awaited::Nothing);
        assert_eq!(gathering.take(), []);
    }

    #[test]
    fn a_touch_of_the_board_is_read_once_and_only_while_its_force_stands_still() {
        let mut gathering = of(Awaited::Board);
        // It rises for half a second, stands for half a second, and goes down again.
        hear(&mut gathering, 0, 500, |ms| 0.01 * (ms + 1) as f64);
        assert_eq!(gathering.take(), []);
        hear(&mut gathering, 500, 500, |_| 7.0);
        hear(&mut gathering, 1000, 500, |ms| {
            7.0 - 0.01 * (ms - 999) as f64
        });
        hear(&mut gathering, 1500, 500, |_| 0.0);
        let taken = gathering.take();
        assert_eq!(taken.len(), 1, "{taken:?}");
        assert_eq!((taken[0].at, taken[0].force), (HERE, 7.0));
        assert_eq!(gathering.awaited(), Awaited::Board);
        // Too short for a reading.
        hear(&mut gathering, 2000, 100, |_| 3.0);
        assert_eq!(gathering.take(), []);
    }

    #[test]
    fn what_was_finished_outlives_the_end_and_what_was_not_does_not() {
        let mut gathering = of(Awaited::Press(HERE, 5.0));
        hear(&mut gathering, 0, 1000, |_| 0.0);
        gathering.begin(Awaited::Press(HERE, 6.0));
        hear(&mut gathering, 1000, 50, |_| 0.0);
        gathering.begin(Awaited::Nothing);
        hear(&mut gathering, 1050, 1000, |_| 0.0);
        let forces: Vec<f64> = gathering.take().iter().map(|g| g.force).collect();
        assert_eq!(forces, [5.0]);
    }

    #[test]
    fn a_slow_board_is_read_sample_by_sample() {
        let mut gathering = of(Awaited::Press(HERE, 5.0));
        for k in 0..READINGS as u64 {
            assert_eq!(gathering.take(), []);
            gathering.hear(100_000 * k, &[1.0, 2.0], None);
        }
        assert_eq!(gathering.take()[0].strain, [1.0, 2.0]);
    }
}
