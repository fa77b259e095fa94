//! Principal components of the signals, and the sites that carry them: PCA with pivoted QR.
//!
//! K. Manohar et al., "Data-driven sparse sensor placement for reconstruction" (2018), with the paper's
//! Algorithm 2: for each number of sensors the QR runs on as many components.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::eigen;
use crate::lanes::wide;
use crate::regression::Standardizer;

/// Why there are no components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PcaError {
    /// No signal varies.
    #[error("no site's signal varies over the touches: nothing can be told apart")]
    Constant,
    /// The iteration for eigenvalues did not converge.
    #[error(
        "the eigenvalues of the signals did not converge: check the dataset for values that are not finite"
    )]
    NoConvergence,
    /// The caller asked for a stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Signals about their means and their products: what components are computed from, as many as are asked for.
pub struct Spectrum {
    signals: SignalMatrix,
    /// Sites × sites or touches × touches, whichever is smaller: the two share their eigenvalues.
    gram: Mat<f64>,
}

impl Spectrum {
    /// Of signals (sites × touches), standardized here.
    ///
    /// # Errors
    /// [`PcaError`] for signals without variance.
    pub fn new(x: &SignalMatrix, watch: Watch) -> Result<Self, PcaError> {
        Self::of(Standardizer::of(x).apply(x), watch)
    }

    /// Of signals (sites × touches) that keep their size: a site that moves more counts for more.
    ///
    /// # Errors
    /// [`PcaError`] for signals without variance.
    pub fn unscaled(x: &SignalMatrix, watch: Watch) -> Result<Self, PcaError> {
        let centred = Standardizer {
            deviation: vec![1.0; x.rows()],
            ..Standardizer::of(x)
        };
        Self::of(centred.apply(x), watch)
    }

    fn of(signals: SignalMatrix, watch: Watch) -> Result<Self, PcaError> {
        report(watch, "Principal components", 0, 2)?;
        let (sites, touches) = (signals.rows(), signals.columns());
        let matrix = MatRef::from_row_major_slice(signals.values(), sites, touches);
        let gram = if sites <= touches {
            product(matrix)
        } else {
            product(matrix.transpose())
        };
        let trace: f64 = (0..gram.nrows()).map(|i| gram[(i, i)]).sum();
        if trace.is_nan() || trace <= 0.0 {
            return Err(PcaError::Constant);
        }
        Ok(Self { signals, gram })
    }

    /// The first `count` components, or all up to the numerical rank where there are no more.
    ///
    /// # Errors
    /// [`PcaError`] where they do not converge.
    pub fn components(&self, count: usize, watch: Watch) -> Result<Pca, PcaError> {
        report(watch, "Principal components", 1, 2)?;
        let found = eigen::leading(self.gram.as_ref(), count).ok_or(PcaError::NoConvergence)?;
        let (sites, touches) = (self.signals.rows(), self.signals.columns());
        let modes = if sites <= touches {
            found.vectors
        } else {
            let matrix = MatRef::from_row_major_slice(self.signals.values(), sites, touches);
            let modes = matrix * &found.vectors;
            Mat::from_fn(sites, found.values.len(), |i, k| {
                modes[(i, k)] / found.values[k].sqrt()
            })
        };
        report(watch, "Principal components", 2, 2)?;
        let share = |v: f64| v / touches as f64;
        Ok(Pca {
            modes,
            variances: found.values.into_iter().map(share).collect(),
            complete: found.complete,
            total: share((0..self.gram.nrows()).map(|i| self.gram[(i, i)]).sum()),
            sites,
        })
    }
}

/// Principal components of the signals of a [`Spectrum`].
pub struct Pca {
    /// Sites × components, by falling variance.
    modes: Mat<f64>,
    /// Variance of each component: of standardized signals in units of one site's.
    pub variances: Vec<f64>,
    /// The same of all components together, known or not.
    pub total: f64,
    /// No further component carries more than rounding.
    pub complete: bool,
    sites: usize,
}

impl Pca {
    /// At least the first `count` components of signals (sites × touches), or all up to the numerical
    /// rank where there are no more.
    ///
    /// # Errors
    /// [`PcaError`] for signals without variance.
    pub fn new(x: &SignalMatrix, count: usize, watch: Watch) -> Result<Self, PcaError> {
        Spectrum::new(x, watch)?.components(count, watch)
    }

    /// Components that are known: the numerical rank where that is all of them.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.variances.len()
    }

    /// The sites that column-pivoted QR picks for `count` sensors from as many components, in the order
    /// of the pivots; fewer where the rank ends first. Ties go to the lower index.
    #[must_use]
    pub fn pivots(&self, count: usize) -> Vec<usize> {
        let mut pivoting = self.pivoting(count);
        let mut chosen = Vec::new();
        while let Some((best, _)) = pivoting.largest(0..self.sites, |_, norm| norm) {
            pivoting.take(best);
            chosen.push(best);
            if chosen.len() == count {
                break;
            }
        }
        chosen
    }

    /// What signals (sites × touches) rebuilt from `count` pivots by as many components lack, as the paper's authors
    /// measure it: Σ‖r - x‖ / Σ‖x‖ over the touches, r the rebuilt x. Nothing there is centred or squared, so that this
    /// is no share of variance, and far larger than one; nor does it fall with every site more.
    #[must_use]
    pub fn norms_missed(&self, x: &SignalMatrix, count: usize) -> f64 {
        let kept = self.pivots(count);
        let modes = self.modes.subcols(0, kept.len());
        let inner = Mat::from_fn(kept.len(), kept.len(), |i, c| modes[(kept[i], c)]);
        let known = Mat::from_fn(kept.len(), x.columns(), |i, t| x.row(kept[i])[t]);
        let shares = inner.partial_piv_lu().solve(&known);
        let rebuilt = modes * &shares;
        let (mut missed, mut all) = (0.0, 0.0);
        for t in 0..x.columns() {
            let (mut off, mut size) = (0.0, 0.0);
            for i in 0..x.rows() {
                let value = x.row(i)[t];
                off += (rebuilt[(i, t)] - value).powi(2);
                size += value * value;
            }
            missed += f64::sqrt(off);
            all += f64::sqrt(size);
        }
        missed / all
    }

    /// A QR with column pivoting in the first `count` components, step by step.
    #[must_use]
    pub fn pivoting(&self, count: usize) -> Pivoting {
        let k = count.min(self.reach());
        // Column i holds site i's weights in the first k components.
        let columns: Vec<f64> = (0..self.sites)
            .flat_map(|i| (0..k).map(move |c| self.modes[(i, c)]))
            .collect();
        let norms: Vec<f64> = columns.chunks_exact(k.max(1)).map(|c| dot(c, c)).collect();
        Pivoting {
            began: norms.clone(),
            norms,
            columns,
            components: k,
            panel: Vec::new(),
            taken: 0,
        }
    }
}

/// The columns of a QR with column pivoting. Norms are kept as if what was taken were projected out of
/// all columns; it is, a panel at a time, as in LAPACK's `geqp3` (G. Quintana-Ortí, X. Sun and
/// C. Bischof, SIAM J. Sci. Comput. 19, 1998).
pub struct Pivoting {
    components: usize,
    /// Site by site, without the directions of earlier panels.
    columns: Vec<f64>,
    /// Squared norms now, and when the panel began.
    norms: Vec<f64>,
    began: Vec<f64>,
    /// Orthonormal directions of this panel, one after the other.
    panel: Vec<f64>,
    taken: usize,
}

impl Pivoting {
    /// Directions in a panel.
    const PANEL: usize = 32;
    /// A norm that fell below this share of what it was when the panel began is computed anew.
    const FELL: f64 = 1e-3;

    /// Of some sites the one with the largest worth of its squared norm, if any is left that is not
    /// rounding; of those equal to rounding the first. With how far it is ahead of the next, as a share.
    pub fn largest(
        &mut self,
        sites: impl IntoIterator<Item = usize> + Clone,
        worth: impl Fn(usize, f64) -> f64,
    ) -> Option<(usize, f64)> {
        let best = self.best(sites.clone(), &worth);
        let fell = |(site, _): (usize, f64)| self.norms[site] < Self::FELL * self.began[site];
        if self.panel.is_empty() || !best.is_none_or(fell) {
            return best;
        }
        self.flush();
        self.best(sites, &worth)
    }

    fn best(
        &self,
        sites: impl IntoIterator<Item = usize>,
        worth: impl Fn(usize, f64) -> f64,
    ) -> Option<(usize, f64)> {
        /// Squared norms start at most at one.
        const ROUNDING: f64 = 1e-24;
        const TIE: f64 = 1e-10;
        if self.taken == self.components {
            return None;
        }
        let (mut best, mut second): (Option<(usize, f64)>, Option<f64>) = (None, None);
        for site in sites {
            let value = worth(site, self.norms[site]);
            // What is no number is nothing either.
            let possible = self.norms[site] > ROUNDING && !value.is_nan();
            if !possible {
                continue;
            }
            let behind = match best {
                Some((_, b)) if value <= b * (1.0 + TIE) => Some(value),
                _ => best.replace((site, value)).map(|(_, b)| b),
            };
            if let Some(behind) = behind {
                second = Some(second.map_or(behind, |s| s.max(behind)));
            }
        }
        let lead = |value: f64| second.map_or(f64::INFINITY, |s| (1.0 - s / value).max(0.0));
        best.map(|(site, value)| (site, lead(value)))
    }

    /// Projects a site's column out of all others.
    pub fn take(&mut self, site: usize) {
        let k = self.components;
        self.taken += 1;
        let mut own = self.columns[site * k..][..k].to_vec();
        // Twice, so that rounding does not point back.
        for _ in 0..2 {
            for direction in self.panel.chunks_exact(k.max(1)) {
                let share = dot(&own, direction);
                for (v, d) in own.iter_mut().zip(direction) {
                    *v -= share * d;
                }
            }
        }
        let length = dot(&own, &own).sqrt();
        if length == 0.0 {
            return;
        }
        for v in &mut own {
            *v /= length;
        }
        lower_norms(&self.columns, &own, &mut self.norms);
        self.panel.extend(own);
        self.columns[site * k..][..k].fill(0.0);
        (self.norms[site], self.began[site]) = (0.0, 0.0);
        if self.panel.len() == Self::PANEL * k {
            self.flush();
        }
    }

    /// Takes the panel out of all columns and computes their norms.
    fn flush(&mut self) {
        let (k, sites) = (self.components, self.norms.len());
        let panel = MatRef::from_column_major_slice(&self.panel, k, self.panel.len() / k);
        let mut columns = MatMut::from_column_major_slice_mut(&mut self.columns, k, sites);
        let shares = panel.transpose() * columns.as_ref();
        matmul(
            columns.as_mut(),
            Accum::Add,
            panel,
            shares.as_ref(),
            -1.0,
            Par::Seq,
        );
        for (norm, column) in self.norms.iter_mut().zip(self.columns.chunks_exact(k)) {
            *norm = dot(column, column);
        }
        self.began.copy_from_slice(&self.norms);
        self.panel.clear();
    }
}

wide! {
    fn lower_norms<'a>(columns: &'a [f64], direction: &'a [f64], norms: &'a mut [f64]) {
        for (column, norm) in columns.chunks_exact(direction.len()).zip(norms) {
            let share = lanes_dot(column, direction);
            *norm = (*norm - share * share).max(0.0);
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
    let n = a.nrows();
    let mut c = Mat::zeros(n, n);
    triangular::matmul(
        c.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    for j in 1..n {
        for i in 0..j {
            c[(i, j)] = c[(j, i)];
        }
    }
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
mod tests;
