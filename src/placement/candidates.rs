//! Reduction of the feasible sites to candidates, by PCA with pivoted QR.

use serde::Serialize;

use super::PlacementError;
use crate::budget::{Watch, report};
use crate::dataset::SignalMatrix;
use crate::pca::{Pca, PcaError, Reconstruction, Spectrum};

/// When to stop keeping sites.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduction {
    /// As many as leave at most this share of the held-out variance unexplained.
    Unexplained(f64),
    /// So many.
    Count(usize),
}

/// One point of the curve: sites kept and the share of held-out variance they leave unexplained.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Sites kept.
    pub sites: usize,
    /// Share of the held-out variance that they leave unexplained.
    pub unexplained: f64,
}

/// The candidates and the curve that led to them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidates {
    /// Rows of the signals that were reduced, in the order of the pivots.
    pub rows: Vec<usize>,
    /// Rising in sites.
    pub curve: Vec<CurvePoint>,
    /// Share that they leave unexplained in the end; absent where none was measured.
    pub unexplained: Option<f64>,
    /// How the number came about, one sentence each.
    pub notes: Vec<String>,
}

/// Every how manyth touch is held out.
const HELD_OUT: usize = 7;
/// Components that are computed at first where nobody knows how many will be needed.
const FIRST: usize = 120;

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
    let spectrum = Spectrum::new(&x.select_columns(&train), watch)?;
    // More sites than touches to learn the map from cannot be judged.
    let most = x
        .rows()
        .min(limit)
        .min(train.len().saturating_sub(1))
        .max(1);
    let first = match reduction {
        Reduction::Count(count) => count,
        Reduction::Unexplained(_) => FIRST,
    };
    let judge = Reconstruction::new(x, &train, &test);
    report(watch, "Reducing to candidates", 1, 2)?;
    let mut curve = Curve {
        pca: spectrum.components(first.min(most), watch)?,
        spectrum: &spectrum,
        judge: &judge,
        points: Vec::new(),
        watch,
    };
    let mut notes = Vec::new();
    let count = match reduction {
        Reduction::Count(count) => {
            let allowed = curve.within(count.min(most))?;
            if count > allowed {
                notes.push(format!(
                    "{count} candidates were asked for; the signals and the budget allow {allowed}."
                ));
            }
            curve.sample(allowed)?;
            allowed
        }
        Reduction::Unexplained(target) => {
            let count = curve.smallest(target, most)?;
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
        rows: curve.pca.pivots(count),
        curve: curve.points,
        unexplained,
        notes,
    })
}

struct Curve<'a> {
    spectrum: &'a Spectrum,
    /// As many components as were needed so far.
    pca: Pca,
    judge: &'a Reconstruction,
    points: Vec<CurvePoint>,
    watch: Watch<'a>,
}

impl Curve<'_> {
    fn at(&self, sites: usize) -> Option<f64> {
        self.points
            .iter()
            .find(|p| p.sites == sites)
            .map(|p| p.unexplained)
    }

    /// So many sites, or the numerical rank where that is less.
    fn within(&mut self, sites: usize) -> Result<usize, PcaError> {
        if self.pca.reach() < sites && !self.pca.complete {
            let wanted = sites.max(2 * self.pca.reach());
            self.pca = self.spectrum.components(wanted, self.watch)?;
        }
        Ok(if self.pca.complete {
            sites.min(self.pca.reach())
        } else {
            sites
        })
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
    fn sample(&mut self, last: usize) -> Result<(), PcaError> {
        let mut count = 1;
        loop {
            count = self.within(count)?;
            self.evaluate(count);
            if count >= last {
                return Ok(());
            }
            count = above(count).min(last);
        }
    }

    /// The smallest count that reaches the target: up the ladder, then bisection of the last step.
    fn smallest(&mut self, target: f64, most: usize) -> Result<usize, PcaError> {
        let (mut below, mut count) = (0, 1);
        loop {
            let reached = self.within(count)?;
            if self.evaluate(reached) <= target {
                let (mut low, mut high) = (below, reached);
                while high - low > 1 {
                    let middle = usize::midpoint(low, high);
                    if self.evaluate(middle) <= target {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                return Ok(high);
            }
            if reached >= most || reached < count {
                return Ok(reached);
            }
            below = reached;
            count = above(reached).min(most);
        }
    }
}

/// The next rung of a ladder of counts.
fn above(count: usize) -> usize {
    count + count.div_ceil(3)
}
