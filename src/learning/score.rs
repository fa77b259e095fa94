//! How far answers are off on touches that nobody learned from.

use serde::{Deserialize, Serialize};

use super::estimator::Estimate;
use crate::regression::tune::distances;
use crate::statistics::{mean, quantile};

/// Errors on touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Mean distance between answers and true places (mm).
    pub mean_mm: f64,
    /// Median (mm).
    pub median_mm: f64,
    /// 95th percentile (mm).
    pub p95_mm: f64,
    /// Share of the touches that lie within the radius of their answer, which is made for nine of ten.
    pub coverage: f64,
    /// Mean error of the force (N), where forces are known.
    pub force_error_n: Option<f64>,
    /// The same by how hard touches were; empty where nobody knows.
    pub by_force: Vec<ForceRow>,
}

/// Errors on touches of some force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceRow {
    /// The least force (N).
    pub from_n: f64,
    /// Forces are below this (N); nothing in the last interval, which has no end.
    pub to_n: Option<f64>,
    /// How many touches.
    pub touches: usize,
    /// Mean error of the place (mm).
    pub mean_mm: f64,
    /// Mean error of the force (N).
    pub force_error_n: Option<f64>,
}

/// Where the paper divides forces (N).
const EDGES_N: [f64; 6] = [0.0, 0.5, 4.9, 9.8, 19.6, 34.3];

impl Scores {
    /// Of answers, at least one, to touches at true places (mm) of known forces (N), which may be left out.
    #[must_use]
    pub fn of(answers: &[Estimate], places_mm: &[[f64; 3]], forces: &[f64]) -> Self {
        let said: Vec<[f64; 3]> = answers.iter().map(|a| a.place_mm).collect();
        let errors = distances(&said, places_mm);
        let within = answers
            .iter()
            .zip(&errors)
            .filter(|(a, e)| **e <= a.radius_mm);
        let within = within.count();
        let force_errors: Vec<f64> = (answers.iter().zip(forces))
            .filter_map(|(a, f)| Some((a.force_n? - f).abs()))
            .collect();
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let share = |q: f64| quantile(&sorted, q).unwrap_or(f64::NAN);
        Self {
            mean_mm: mean(&errors),
            median_mm: share(0.5),
            p95_mm: share(0.95),
            coverage: within as f64 / answers.len() as f64,
            force_error_n: (!force_errors.is_empty()).then(|| mean(&force_errors)),
            by_force: by_force(&errors, &force_errors, forces),
        }
    }
}

/// The intervals that any touch lies in.
fn by_force(errors: &[f64], force_errors: &[f64], forces: &[f64]) -> Vec<ForceRow> {
    let row = |k: usize| {
        let (from_n, to_n) = (EDGES_N[k], EDGES_N.get(k + 1).copied());
        let inside = |f: f64| f >= from_n && to_n.is_none_or(|to| f < to);
        let touches: Vec<usize> = (0..forces.len()).filter(|&t| inside(forces[t])).collect();
        let of = |values: &[f64]| -> Vec<f64> {
            touches
                .iter()
                .filter_map(|&t| values.get(t).copied())
                .collect()
        };
        let force_errors = of(force_errors);
        (!touches.is_empty()).then(|| ForceRow {
            from_n,
            to_n,
            touches: touches.len(),
            mean_mm: mean(&of(errors)),
            force_error_n: (!force_errors.is_empty()).then(|| mean(&force_errors)),
        })
    };
    (0..EDGES_N.len()).filter_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_by_force_and_radii_are_counted() {
        let answer = |x: f64, radius_mm: f64, force: f64| Estimate {
            place_mm: [x, 0.0, 0.0],
            radius_mm,
            force_n: Some(force),
        };
        let answers = [
            answer(1.0, 2.0, 3.0),
            answer(4.0, 2.0, 12.0),
            answer(0.0, 0.0, 50.0),
        ];
        let scores = Scores::of(&answers, &[[0.0; 3]; 3], &[2.0, 10.0, 40.0]);
        assert!((scores.mean_mm - 5.0 / 3.0).abs() < 1e-12);
        assert!((scores.coverage - 2.0 / 3.0).abs() < 1e-12);
        assert!((scores.force_error_n.unwrap() - 13.0 / 3.0).abs() < 1e-12);
        let rows: Vec<(f64, usize, f64)> = (scores.by_force.iter())
            .map(|r| (r.from_n, r.touches, r.mean_mm))
            .collect();
        assert_eq!(rows, [(0.5, 1, 1.0), (9.8, 1, 4.0), (34.3, 1, 0.0)]);
        let without = Scores::of(&answers, &[[0.0; 3]; 3], &[]);
        assert!(without.by_force.is_empty() && without.force_error_n.is_none());
    }
}
