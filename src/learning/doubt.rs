//! How far an answer may be off: learned from touches that were left out, where the readings are alike.
//!
//! What a regression leaves differs from place to place (light touches, edges, what wears). An answer is therefore
//! thought to be off as the known touches nearest to it were, when they were left out, and farther where no known touch
//! is as near as they usually are. One factor makes a radius of it that nine answers of ten lie within (a conformal
//! prediction with local scores: J. Lei et al., 2018). Touches that the settings were not learned from say by how much
//! those that they were learned from flatter.

use faer::Mat;

use super::distance::{nearest, squared};
use super::lessons::rows;
use crate::regression::folds::evenly;
use crate::statistics::{mean, quantile};

/// Neighbours that say how far an answer is off.
pub const NEAR: usize = 30;
/// The share of answers that lie within the radius.
pub const SHARE: f64 = 0.9;
/// The mean error over the radius that [`SHARE`] of them lie within, of errors that are normal in two dimensions:
/// √(π/2) over √(2 ln 10).
pub const NORMAL_MEAN: f64 = 0.584;
/// Touches nearer than this share of all know their surroundings.
const USUAL: f64 = 0.95;
/// Touches that are thought to be as far off as those learned from, beside those that were chosen by.
const BEFOREHAND: f64 = 5.0;

/// What was learned of errors, in the units of the outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel {
    /// The squared error at each known touch when its place was left out.
    pub off: Vec<f64>,
    /// Distance to the nearest known touch, over the lengths, within which most touches are.
    pub usual: f64,
    /// The radius over the expected error.
    pub factor: f64,
}

impl ErrorModel {
    /// From squared distances among known touches, their groups and their errors when they were left out; and from
    /// squared distances of others (others × known) with their errors.
    #[must_use]
    pub fn learn(
        among: &Mat<f64>,
        groups: &[usize],
        errors: &[f64],
        others: &Mat<f64>,
        their_errors: &[f64],
    ) -> Self {
        let near: Vec<Vec<(usize, f64)>> = (0..errors.len())
            .map(|t| {
                let apart = (0..errors.len()).filter(|&i| groups[i] != groups[t]);
                nearest(apart.map(|i| (i, among[(i, t)])), NEAR)
            })
            .collect();
        let mut first: Vec<f64> = near
            .iter()
            .filter_map(|n| Some(n.first()?.1.sqrt()))
            .collect();
        first.sort_by(f64::total_cmp);
        let mut doubt = Self {
            off: errors.iter().map(|e| e * e).collect(),
            usual: quantile(&first, USUAL).unwrap_or(1.0),
            factor: 1.0,
        };
        let over = |error: f64, expected: f64| error / expected.max(f64::MIN_POSITIVE);
        let mut ratios: Vec<f64> = (near.iter().zip(errors))
            .map(|(near, &error)| over(error, doubt.expected(near)))
            .collect();
        let theirs = doubt.radii(others);
        let their_ratios = their_errors.iter().zip(theirs).map(|(&e, s)| over(e, s));
        let own = mean(&ratios);
        let sum = their_ratios.sum::<f64>() + BEFOREHAND * own;
        let flattered = sum / (own * (their_errors.len() as f64 + BEFOREHAND));
        ratios.sort_by(f64::total_cmp);
        let within = quantile(&ratios, SHARE).unwrap_or(1.0);
        // Where nothing was off at all there is nothing to scale.
        let factor = within * flattered;
        doubt.factor = if factor.is_finite() { factor } else { 1.0 };
        doubt
    }

    /// The radius around each answer that nine of ten lie within, from squared distances (touches × known).
    #[must_use]
    pub fn radii(&self, squared: &Mat<f64>) -> Vec<f64> {
        let of = |t: usize| {
            let near = nearest((0..).zip(squared.row(t).iter().copied()), NEAR);
            self.factor * self.expected(&near)
        };
        (0..squared.nrows()).map(of).collect()
    }

    /// Errors of known touches (at these points, over the lengths) when they were left out, over the radius that would have been
    /// given them: a sample, evenly drawn.
    #[must_use]
    pub fn known_ratios(&self, points: &Mat<f64>) -> Vec<f64> {
        const SAMPLE: usize = 500;
        let some = evenly(points.nrows(), SAMPLE);
        let squared = squared(&rows(points, &some), points);
        let mut ratios: Vec<f64> = (some.iter().enumerate())
            .map(|(row, &t)| {
                let others = (0..).zip(squared.row(row).iter().copied());
                let near = nearest(others.filter(|&(i, _)| i != t), NEAR);
                self.off[t].sqrt() / self.expected(&near).max(f64::MIN_POSITIVE)
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let within = quantile(&ratios, SHARE)
            .unwrap_or(1.0)
            .max(f64::MIN_POSITIVE);
        ratios.into_iter().map(|r| r / within).collect()
    }

    /// The root mean square error that is expected with these neighbours, nearest first.
    fn expected(&self, near: &[(usize, f64)]) -> f64 {
        let Some((_, first)) = near.first() else {
            return 0.0;
        };
        let sum: f64 = near.iter().map(|&(i, _)| self.off[i]).sum();
        let strange = (first.sqrt() / self.usual.max(f64::MIN_POSITIVE)).max(1.0);
        (sum / near.len() as f64).sqrt() * strange
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::distance::{among, squared};

    #[test]
    fn radii_follow_the_errors_around_and_grow_where_nothing_is_known() {
        let n = 400;
        let points = Mat::from_fn(n, 1, |t, _| (t * 149 % n) as f64 / n as f64);
        // Errors ten times as large in the upper half.
        let size = |x: f64| if x < 0.5 { 0.1 } else { 1.0 };
        let error = |t: usize| size(points[(t, 0)]) * ((t * 7919 % 1000) as f64 / 1000.0);
        let errors: Vec<f64> = (0..n).map(error).collect();
        let groups: Vec<usize> = (0..n).collect();
        let others = Mat::from_fn(3, 1, |t, _| [0.2, 0.8, 3.0][t]);
        let apart = squared(&others, &points);
        let doubt = ErrorModel::learn(&among(&points), &groups, &errors, &apart, &[0.05, 0.5, 0.5]);
        let radii = doubt.radii(&apart);
        assert!((0.06..0.15).contains(&radii[0]), "{radii:?}");
        assert!((0.6..1.5).contains(&radii[1]), "{radii:?}");
        assert!(radii[2] > 100.0 * radii[1], "{radii:?}");
        let own = doubt.radii(&squared(&points, &points));
        let within = (0..n).filter(|&t| errors[t] <= own[t]).count() as f64 / n as f64;
        assert!((within - 0.9).abs() < 0.06, "{within}");
        // Others that were farther off say that the known ones flatter.
        let wary = ErrorModel::learn(
            &among(&points),
            &groups,
            &errors,
            &apart,
            &[0.15, 1.5, 150.0],
        );
        assert!(wary.factor > doubt.factor);
    }
}
