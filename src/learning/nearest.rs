//! The mean of the nearest known touches: no model at all, and what any other has to beat.

use faer::Mat;

use super::distance::{among, nearest};
use super::lessons::{KnownTouches, lengths};
use super::machine::{AnswerRule, Regression, mean_of};
use crate::statistics::mean;

/// Touches that the number of neighbours is chosen on.
const SEARCHED: usize = 2000;
/// Most neighbours that are averaged.
const MOST: usize = 128;

/// The number of neighbours whose mean, place by place left out, is nearest.
#[must_use]
pub fn search(known: &KnownTouches) -> usize {
    let some = known.thinned(SEARCHED);
    let near = neighbours(&some, MOST);
    // All of them: noise has a pattern, so that one more may be worse where many more are better.
    let counts = (0..=MOST.ilog2()).map(|step| 1 << step);
    let error = |count: usize| mean(&lengths(&residuals(&some, &near, count)));
    let tried = counts.map(|count| (count, error(count)));
    let best = tried.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(1, |(count, _)| count)
}

/// The regression on all touches, of so many neighbours.
#[must_use]
pub fn fit(known: &KnownTouches, count: usize) -> Regression {
    Regression {
        lengths: vec![1.0; known.features.ncols()],
        points: known.features.clone(),
        by: AnswerRule::Nearest {
            outputs: known.outputs.clone(),
            count,
        },
    }
}

/// Its residuals at touches of places that it does not know: touches × outputs.
#[must_use]
pub fn left_out(known: &KnownTouches, count: usize) -> Mat<f64> {
    residuals(known, &neighbours(known, count), count)
}

/// The nearest touches of other groups, for each, with their squared distances.
fn neighbours(known: &KnownTouches, count: usize) -> Vec<Vec<(usize, f64)>> {
    let squared = among(&known.features);
    let near = |t: usize| {
        let others = (0..known.groups.len()).filter(|&i| known.groups[i] != known.groups[t]);
        nearest(others.map(|i| (i, squared[(i, t)])), count)
    };
    (0..known.groups.len()).map(near).collect()
}

fn residuals(known: &KnownTouches, near: &[Vec<(usize, f64)>], count: usize) -> Mat<f64> {
    let outputs = &known.outputs;
    let mut left = Mat::zeros(outputs.nrows(), outputs.ncols());
    for (t, near) in near.iter().enumerate() {
        let said = mean_of(outputs, &near[..count.min(near.len())]);
        for (k, said) in said.into_iter().enumerate() {
            left[(t, k)] = outputs[(t, k)] - said;
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_averaged_away_and_clean_readings_are_not() {
        let known = |noise: f64| KnownTouches {
            features: Mat::from_fn(200, 1, |t, _| (t * 61 % 200) as f64 / 200.0),
            outputs: Mat::from_fn(200, 1, |t, _| {
                let rough = (t * 7919 % 1000) as f64 / 500.0 - 1.0;
                (t * 61 % 200) as f64 / 200.0 + noise * rough
            }),
            groups: (0..200).collect(),
        };
        assert_eq!(search(&known(0.0)), 2);
        assert!(search(&known(0.5)) >= 8);
    }
}
