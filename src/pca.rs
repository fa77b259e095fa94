//! Principal components of the signals, and the sites that carry them: PCA with pivoted QR.
//!
//! K. Manohar et al., "Data-driven sparse sensor placement for reconstruction" (2018), with the paper's
//! Algorithm 2: for each number of sensors the QR runs on as many components.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};

use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::lanes::wide;
use crate::regression::Standardizer;

/// Eigenvalues below this share of the largest are rounding: the numerical rank ends there.
const RANK: f64 = 1e-12;

/// Why there are no components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PcaError {
    #[error("no site's signal varies over the touches: nothing can be told apart")]
    Constant,
    #[error(
        "the eigenvalues of the signals did not converge: check the dataset for values that are not finite"
    )]
    NoConvergence,
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Principal components of standardized signals.
pub struct Pca {
    /// Sites × components, by falling variance.
    modes: Mat<f64>,
    /// Variance of each component, in units of one site's.
    pub variances: Vec<f64>,
    sites: usize,
}

impl Pca {
    /// Components of signals (sites × touches), standardized here, up to the numerical rank.
    ///
    /// # Errors
    /// [`PcaError`] for signals without variance.
    pub fn new(x: &SignalMatrix, watch: Watch) -> Result<Self, PcaError> {
        report(watch, "Principal components", 0, 2)?;
        let z = Standardizer::of(x).apply(x);
        let (sites, touches) = (z.rows(), z.columns());
        let matrix = MatRef::from_row_major_slice(z.values(), sites, touches);
        // The smaller of the two Gram matrices has the same spectrum.
        let by_sites = sites <= touches;
        let gram = if by_sites {
            product(matrix)
        } else {
            product(matrix.transpose())
        };
        report(watch, "Principal components", 1, 2)?;
        let eigen = gram
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| PcaError::NoConvergence)?;
        let n = gram.nrows();
        let values: Vec<f64> = (0..n).rev().map(|k| eigen.S().column_vector()[k]).collect();
        let largest = values.first().copied().unwrap_or(0.0);
        if largest.is_nan() || largest <= 0.0 {
            return Err(PcaError::Constant);
        }
        let rank = values.iter().take_while(|&&v| v > RANK * largest).count();
        let vectors = Mat::from_fn(n, rank, |i, k| eigen.U()[(i, n - 1 - k)]);
        let modes = if by_sites {
            vectors
        } else {
            let mut modes = Mat::<f64>::zeros(sites, rank);
            matmul(
                modes.as_mut(),
                Accum::Replace,
                matrix,
                vectors.as_ref(),
                1.0,
                Par::Seq,
            );
            Mat::from_fn(sites, rank, |i, k| modes[(i, k)] / values[k].sqrt())
        };
        report(watch, "Principal components", 2, 2)?;
        Ok(Self {
            modes,
            variances: values[..rank].iter().map(|v| v / touches as f64).collect(),
            sites,
        })
    }

    /// Components that carry more than rounding.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.variances.len()
    }

    /// The sites that column-pivoted QR picks for `count` sensors from as many components, in the order
    /// of the pivots; fewer where the rank ends first. Ties go to the lower index.
    #[must_use]
    pub fn pivots(&self, count: usize) -> Vec<usize> {
        let mut pivoting = self.pivoting(count);
        let mut chosen = Vec::new();
        while let Some(best) = pivoting.largest(0..self.sites, |_, norm| norm) {
            pivoting.take(best);
            chosen.push(best);
            if chosen.len() == count {
                break;
            }
        }
        chosen
    }

    /// A QR with column pivoting in the first `count` components, step by step.
    #[must_use]
    pub fn pivoting(&self, count: usize) -> Pivoting {
        let k = count.min(self.rank());
        // Column i holds site i's weights in the first k components.
        let columns: Vec<f64> = (0..self.sites)
            .flat_map(|i| (0..k).map(move |c| self.modes[(i, c)]))
            .collect();
        Pivoting {
            norms: columns.chunks_exact(k.max(1)).map(|c| dot(c, c)).collect(),
            columns,
            components: k,
            taken: 0,
        }
    }
}

/// The columns of a QR with what was taken projected out.
pub struct Pivoting {
    components: usize,
    /// Site by site.
    columns: Vec<f64>,
    norms: Vec<f64>,
    taken: usize,
}

impl Pivoting {
    /// Of some sites the one with the largest worth of its squared norm, if any is left that is not
    /// rounding; of those equal to rounding the first.
    pub fn largest(
        &self,
        sites: impl IntoIterator<Item = usize>,
        worth: impl Fn(usize, f64) -> f64,
    ) -> Option<usize> {
        /// Squared norms start at most at one.
        const ROUNDING: f64 = 1e-24;
        const TIE: f64 = 1e-10;
        if self.taken == self.components {
            return None;
        }
        let mut best: Option<(usize, f64)> = None;
        for site in sites {
            let value = worth(site, self.norms[site]);
            if self.norms[site] > ROUNDING && best.is_none_or(|(_, b)| value > b * (1.0 + TIE)) {
                best = Some((site, value));
            }
        }
        best.map(|b| b.0)
    }

    /// Projects a site's column out of all others.
    pub fn take(&mut self, site: usize) {
        let k = self.components;
        let own = &self.columns[site * k..][..k];
        let length = dot(own, own).sqrt();
        self.taken += 1;
        if length == 0.0 {
            return;
        }
        let direction: Vec<f64> = own.iter().map(|v| v / length).collect();
        project_out(&mut self.columns, &direction, &mut self.norms);
        self.columns[site * k..][..k].fill(0.0);
        self.norms[site] = 0.0;
    }
}

wide! {
    fn project_out<'a>(columns: &'a mut [f64], direction: &'a [f64], norms: &'a mut [f64]) {
        for (column, norm) in columns.chunks_exact_mut(direction.len()).zip(norms) {
            let share = lanes_dot(column, direction);
            for (v, d) in column.iter_mut().zip(direction) {
                *v -= share * d;
            }
            *norm = lanes_dot(column, column);
        }
    }
}

/// Sums in eight lanes.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "only inlined code gets the instructions of its caller"
)]
fn lanes_dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = [0.0; 8];
    let (xs, ys) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = dot(xs.remainder(), ys.remainder());
    for (x, y) in xs.zip(ys) {
        for l in 0..8 {
            sum[l] += x[l] * y[l];
        }
    }
    rest + sum.iter().sum::<f64>()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Products of all pairs of rows (sites × sites).
#[must_use]
pub fn gram(x: &SignalMatrix) -> Mat<f64> {
    product(MatRef::from_row_major_slice(
        x.values(),
        x.rows(),
        x.columns(),
    ))
}

fn product(a: MatRef<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), a.nrows());
    matmul(c.as_mut(), Accum::Replace, a, a.transpose(), 1.0, Par::Seq);
    c
}

/// How much of the held-out variance of all sites the kept ones leave unexplained.
pub struct Reconstruction {
    train: Mat<f64>,
    held_out: Mat<f64>,
    total: f64,
}

impl Reconstruction {
    /// From signals (sites × touches): columns `train` to learn the linear map on, `test` to judge it.
    #[must_use]
    pub fn new(x: &SignalMatrix, train: &[usize], test: &[usize]) -> Self {
        let known = x.select_columns(train);
        let standardizer = Standardizer::of(&known);
        let known = standardizer.apply(&known);
        let unseen = standardizer.apply(&x.select_columns(test));
        let held_out = gram(&unseen);
        let total = (0..held_out.nrows()).map(|i| held_out[(i, i)]).sum();
        Self {
            train: gram(&known),
            held_out,
            total,
        }
    }

    /// ‖X - W `X_S‖²` / ‖X‖² on the held-out touches, W by least squares on the others (standardized).
    /// Absent where the kept sites are linearly dependent to rounding.
    #[must_use]
    pub fn unexplained(&self, kept: &[usize]) -> Option<f64> {
        let (k, n) = (kept.len(), self.train.nrows());
        let inner = Mat::from_fn(k, k, |i, j| self.train[(kept[i], kept[j])]);
        let cross = Mat::from_fn(k, n, |i, j| self.train[(kept[i], j)]);
        let weights = inner.llt(Side::Lower).ok()?.solve(&cross);
        let held_cross = Mat::from_fn(k, n, |i, j| self.held_out[(kept[i], j)]);
        let held_inner = Mat::from_fn(k, k, |i, j| self.held_out[(kept[i], kept[j])]);
        let spread = &held_inner * &weights;
        // tr(X Xᵀ) - 2 tr(Wᵀ X_S Xᵀ) + tr(Wᵀ X_S X_Sᵀ W)
        let mut rest = self.total;
        for j in 0..n {
            for i in 0..k {
                rest += weights[(i, j)] * (spread[(i, j)] - 2.0 * held_cross[(i, j)]);
            }
        }
        Some((rest / self.total).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;

    /// Three independent patterns over eight sites.
    fn signals(touches: usize) -> SignalMatrix {
        let wave = |i: usize, t: usize| {
            let t = t as f64;
            let parts = [(0.7 * t).sin(), (1.3 * t + 1.0).sin(), (2.9 * t).cos()];
            parts[i % 3] * (1.0 + i as f64) + if i >= 6 { parts[0] } else { 0.0 }
        };
        let values = (0..8)
            .flat_map(|i| (0..touches).map(move |t| wave(i, t)))
            .collect();
        SignalMatrix::new(touches, values)
    }

    #[test]
    fn both_gram_matrices_give_the_same_picks() {
        let (wide, tall) = (signals(40), signals(5));
        let pca = Pca::new(&wide, &unwatched).unwrap();
        assert_eq!(pca.rank(), 3);
        assert_eq!(pca.pivots(8).len(), 3, "picks end at the numerical rank");
        assert!(Pca::new(&tall, &unwatched).unwrap().rank() <= 4);
        let mut kinds: Vec<usize> = pca.pivots(3).iter().map(|i| i % 3).collect();
        kinds.sort_unstable();
        assert_eq!(kinds, [0, 1, 2]);
    }

    #[test]
    fn enough_sites_explain_all() {
        let x = signals(40);
        let (train, test): (Vec<usize>, Vec<usize>) = (0..40).partition(|t| t % 4 != 0);
        let judge = Reconstruction::new(&x, &train, &test);
        let pca = Pca::new(&x, &unwatched).unwrap();
        let curve: Vec<f64> = (1..=3)
            .map(|k| judge.unexplained(&pca.pivots(k)).unwrap())
            .collect();
        assert!(curve[0] > 0.3 && curve[0] < 0.9, "{curve:?}");
        assert!(curve[2] < 1e-12 && curve[1] > curve[2], "{curve:?}");
        assert!(judge.unexplained(&[0, 3]).is_none_or(|u| u > 0.3));
    }

    #[test]
    fn constant_signals_are_named() {
        let flat = SignalMatrix::new(3, vec![1.0; 6]);
        assert_eq!(Pca::new(&flat, &unwatched).err(), Some(PcaError::Constant));
    }
}
