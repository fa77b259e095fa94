//! Reduction of the feasible sites to candidates, by PCA with pivoted QR.

use serde::Serialize;

use super::PlacementError;
use crate::budget::{Watch, report};
use crate::dataset::SignalMatrix;
use crate::pca::{Pca, Reconstruction};

/// When to stop keeping sites.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduction {
    /// As many as leave at most this share of the held-out variance unexplained.
    Unexplained(f64),
    Count(usize),
}

/// One point of the curve: sites kept and the share of held-out variance they leave unexplained.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    pub sites: usize,
    pub unexplained: f64,
}

/// The candidates and the curve that led to them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidates {
    /// Rows of the signals that were reduced, in the order of the pivots.
    pub rows: Vec<usize>,
    /// Rising in sites.
    pub curve: Vec<CurvePoint>,
    pub unexplained: Option<f64>,
    pub notes: Vec<String>,
}

/// Every how manyth touch is held out.
const HELD_OUT: usize = 7;

/// Reduces signals (sites × touches). A seventh of the touches is held out: neither the components nor the
/// linear map that the unexplained share is measured with have seen them.
///
/// # Errors
/// [`PlacementError`] where there is nothing to reduce.
pub fn reduce(
    x: &SignalMatrix,
    reduction: Reduction,
    limit: usize,
    watch: Watch,
) -> Result<Candidates, PlacementError> {
    if x.rows() == 0 {
        return Err(PlacementError::NoSites);
    }
    let (test, train): (Vec<usize>, Vec<usize>) =
        (0..x.columns()).partition(|t| t % HELD_OUT == HELD_OUT / 2);
    report(watch, "Reducing to candidates", 0, 2)?;
    // Neither the picks nor the map have seen the touches they are judged on.
    let pca = &Pca::new(&x.select_columns(&train), watch)?;
    let judge = Reconstruction::new(x, &train, &test);
    report(watch, "Reducing to candidates", 1, 2)?;
    let mut curve = Curve {
        pca,
        judge: &judge,
        points: Vec::new(),
    };
    // More sites than touches to learn the map from cannot be judged.
    let most = pca
        .rank()
        .min(limit)
        .min(train.len().saturating_sub(1))
        .max(1);
    let mut notes = Vec::new();
    let count = match reduction {
        Reduction::Count(count) => {
            if count > most {
                notes.push(format!(
                    "{count} candidates were asked for; the signals and the budget allow {most}."
                ));
            }
            curve.sample(count.min(most));
            count.min(most)
        }
        Reduction::Unexplained(target) => {
            let count = curve.smallest(target, most);
            if curve.at(count).is_none_or(|u| u > target) {
                notes.push(format!(
                    "{count} candidates leave {:.2} % unexplained instead of {:.2} %: the budget or the data end there.",
                    100.0 * curve.at(count).unwrap_or(f64::NAN),
                    100.0 * target
                ));
            }
            count
        }
    };
    report(watch, "Reducing to candidates", 2, 2)?;
    let unexplained = curve.at(count);
    curve.points.sort_by_key(|p| p.sites);
    Ok(Candidates {
        rows: pca.pivots(count),
        curve: curve.points,
        unexplained,
        notes,
    })
}

struct Curve<'a> {
    pca: &'a Pca,
    judge: &'a Reconstruction,
    points: Vec<CurvePoint>,
}

impl Curve<'_> {
    fn at(&self, sites: usize) -> Option<f64> {
        self.points
            .iter()
            .find(|p| p.sites == sites)
            .map(|p| p.unexplained)
    }

    /// The unexplained share with so many sites; linear dependence counts as no gain.
    fn evaluate(&mut self, sites: usize) -> f64 {
        if let Some(known) = self.at(sites) {
            return known;
        }
        match self.judge.unexplained(&self.pca.pivots(sites)) {
            Some(unexplained) => {
                self.points.push(CurvePoint { sites, unexplained });
                unexplained
            }
            None => f64::INFINITY,
        }
    }

    /// A geometric ladder of counts up to `last`.
    fn sample(&mut self, last: usize) {
        for count in ladder(last) {
            self.evaluate(count);
        }
    }

    /// The smallest count that reaches the target: up the ladder, then bisection of the last step.
    fn smallest(&mut self, target: f64, most: usize) -> usize {
        let mut below = 0;
        for count in ladder(most) {
            if self.evaluate(count) <= target {
                let (mut low, mut high) = (below, count);
                while high - low > 1 {
                    let middle = usize::midpoint(low, high);
                    if self.evaluate(middle) <= target {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                return high;
            }
            below = count;
        }
        most
    }
}

fn ladder(last: usize) -> Vec<usize> {
    let mut counts = vec![1];
    while counts[counts.len() - 1] < last {
        let next = counts[counts.len() - 1];
        counts.push((next + next.div_ceil(3)).min(last));
    }
    counts
}
