//! A touch that stands since the rest was taken while others come beside it and go: it may be the rest that is off. Where a
//! release reads like a touch elsewhere, one look cannot tell.

use super::pull;
use crate::inference::Matching;
use crate::statistics::chi_squared_bound;

/// Seconds for which a reading has to stay where it is before it is a level.
const LEVEL_S: f64 = 0.3;
/// Deviations of χ² by which a sample is off a level.
const OFF: f64 = 8.0;
/// Times that others have come and gone and left it as it was.
const RETURNS: u32 = 2;

/// What is read while others come and go.
#[derive(Clone, Debug, Default)]
pub(super) struct StandingTouch {
    /// The level that others come to (strain).
    level: Option<Vec<f64>>,
    /// Sum of what has been read since it was last another reading, and how long that is.
    sum: Vec<f64>,
    samples: f64,
    lasted_s: f64,
    /// Whether another level has been seen since.
    away: bool,
    returns: u32,
}

impl StandingTouch {
    /// Takes in a reading (strain) some seconds after the one before. Whether the touch that stands is rather a rest that is
    /// off: others have come and gone and left it just as it was, and one that lets go explains it better.
    pub fn is_rather_the_rest(
        &mut self,
        matching: &mut Matching,
        strain: &[f64],
        step_s: f64,
    ) -> bool {
        let mean: Vec<f64> = self.sum.iter().map(|sum| sum / self.samples).collect();
        if mean.is_empty() || is_off(matching, strain, &mean) {
            (self.sum, self.samples, self.lasted_s) = (strain.to_vec(), 1.0, 0.0);
            return false;
        }
        for (sum, x) in self.sum.iter_mut().zip(strain) {
            *sum += x;
        }
        self.samples += 1.0;
        let lasted_s = self.lasted_s;
        self.lasted_s += step_s;
        let is_level = lasted_s < LEVEL_S && self.lasted_s >= LEVEL_S;
        is_level && self.reached(matching, mean) && reads_like_a_pull(matching, strain)
    }

    /// A level is reached: whether it is the first one, and has been often enough.
    fn reached(&mut self, matching: &Matching, mean: Vec<f64>) -> bool {
        let Some(level) = &self.level else {
            self.level = Some(mean);
            return false;
        };
        if is_off(matching, &mean, level) {
            self.away = true;
            return false;
        }
        self.level = Some(mean);
        self.returns += u32::from(std::mem::take(&mut self.away));
        self.returns >= RETURNS
    }
}

/// Whether a reading is another one, by the noise of the channels that are trusted.
fn is_off(matching: &Matching, strain: &[f64], from: &[f64]) -> bool {
    let squares: Vec<f64> = squares_off(matching, strain, from).collect();
    squares.iter().sum::<f64>() > chi_squared_bound(squares.len() as f64, OFF)
}

/// What a reading is off another one by, in squares of the noise, of each channel that is trusted.
pub(super) fn squares_off(
    matching: &Matching,
    strain: &[f64],
    from: &[f64],
) -> impl Iterator<Item = f64> {
    let channels = strain.iter().zip(from).zip(&matching.errors.noise);
    let trusted = channels.zip(&matching.used).filter(|(_, used)| **used);
    trusted.map(|(((x, y), noise), _)| ((x - y) / noise).powi(2))
}

/// Whether something that lets go explains it better than a touch does.
fn reads_like_a_pull(matching: &mut Matching, strain: &[f64]) -> bool {
    let touch = matching.find(strain);
    let pull = pull::find(matching, strain);
    pull::explains(&pull) && pull.unexplained < touch.unexplained
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::ReadingErrors;
    use crate::inference::ResponseMap;
    use crate::inference::matching::tests::{CHANNELS, maps};
    use std::sync::Arc;

    /// Levels (times what is read of a newton at one place), a second each: when it is taken for the rest.
    fn taken(levels: &[f64], is_pull: bool) -> Option<usize> {
        let [map, _] = maps();
        let size = if is_pull { -1.0 } else { 1.0 };
        let at_one_node = map.values()[CHANNELS..2 * CHANNELS].iter();
        let reading: Vec<f64> = at_one_node.map(|g| size * g).collect();
        taken_of(map, levels, &reading)
    }

    /// Levels (times a reading), a second each: when it is taken for the rest.
    fn taken_of(map: Arc<ResponseMap>, levels: &[f64], reading: &[f64]) -> Option<usize> {
        let errors = ReadingErrors::of_noise(1e-7, CHANNELS);
        let mut matching = Matching::new(map, errors, 60.0);
        let mut standing = StandingTouch::default();
        let mut at = |size: f64| {
            let strain: Vec<f64> = reading.iter().map(|g| size * g).collect();
            standing.is_rather_the_rest(&mut matching, &strain, 0.01)
        };
        levels.iter().position(|&size| (0..100).any(|_| at(size)))
    }

    #[test]
    fn what_others_leave_as_it_was_is_the_rest_if_it_may_be_a_pull() {
        assert_eq!(taken(&[8.0, 12.0, 8.0, 5.0, 8.0, 8.0], true), Some(4));
        // One coming and going is no proof, nor is it where it has not come back.
        assert_eq!(taken(&[8.0, 12.0, 8.0, 8.0], true), None);
        assert_eq!(taken(&[8.0, 12.0, 8.5, 12.0, 9.0], true), None);
        // A touch that reads like no pull stands as long as it likes.
        assert_eq!(taken(&[8.0, 12.0, 8.0, 5.0, 8.0], false), None);
    }

    /// A touch at one place reads much like a pull at another.
    #[test]
    fn of_a_touch_and_a_pull_what_explains_it_better_is_believed() {
        let [map, _] = maps();
        let [here, there] = [[1e-6, 2e-6, -1e-6, 2e-6], [-1e-6, -1.5e-6, 1e-6, -2.5e-6]];
        let mut values = vec![1e-9; map.values().len()];
        values[..CHANNELS].copy_from_slice(&here);
        values[CHANNELS..2 * CHANNELS].copy_from_slice(&there);
        let map = Arc::new(ResponseMap::of(Arc::clone(&map.mesh), CHANNELS, values));
        let levels = [8.0, 12.0, 8.0, 5.0, 8.0, 8.0];
        assert_eq!(taken_of(Arc::clone(&map), &levels, &here), None);
        assert_eq!(taken_of(map, &levels, &there.map(|g| -g)), Some(4));
    }
}
