//! Nearly solved ε-SVR on low-rank features: all folds of a cross-validation and all coordinates side
//! by side.
//!
//! minimize ½ ‖w‖² + C Σ |φᵢw + b - yᵢ|_ε by the over-relaxed alternating direction method of multipliers
//! (S. Boyd et al., 2011) with z = Φw + b - y: one factor a fold serves every iteration, and what the
//! iterations do are products with matrices as wide as folds × coordinates. The multipliers are the dual
//! coefficients of the exact problem, β = -ρu, which start it off.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Accum, Mat, MatRef, Par, Side};

use crate::lanes::wide;

/// Coordinates of a target.
const AXES: usize = 3;
/// Over-relaxation: between 1.5 and 1.8 is recommended.
const RELAX: f64 = 1.7;

/// What all candidates of a step share.
pub struct AdmmSetting {
    /// Targets, touches × (3 × folds): fold f has the columns 3f, 3f + 1, 3f + 2.
    pub y: Mat<f64>,
    /// Each fold's test touches.
    pub folds: Vec<Range<usize>>,
    /// Bound of the coefficients.
    pub c: f64,
    /// Half-width of the tube without loss.
    pub epsilon: f64,
    /// Penalty on z ≠ Φw + b - y.
    pub rho: f64,
}

/// Where the iteration stands: residuals and scaled multipliers, both touches × (3 × folds).
#[derive(Clone)]
pub struct AdmmState {
    /// Residuals.
    pub z: Mat<f64>,
    /// Scaled multipliers.
    pub u: Mat<f64>,
}

impl AdmmState {
    /// Where nothing is known yet.
    #[must_use]
    pub fn zero(setting: &AdmmSetting) -> Self {
        let (n, columns) = (setting.y.nrows(), setting.y.ncols());
        Self {
            z: Mat::zeros(n, columns),
            u: Mat::zeros(n, columns),
        }
    }
}

/// Mean over the folds of the mean Euclidean test error after so many iterations from `state`, which
/// moves along. Φ's last column is the bias; absent where the features are not finite, or where `stop`
/// (asked every few ten milliseconds) says so.
#[must_use]
pub fn iterate(
    setting: &AdmmSetting,
    phi: MatRef<f64>,
    state: &mut AdmmState,
    iterations: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<f64> {
    let factors = factor_folds(setting, phi, stop)?;
    let (n, r, columns) = (phi.nrows(), phi.ncols(), setting.y.ncols());
    let mut v = Mat::from_fn(n, columns, |i, j| {
        if setting.folds[j / AXES].contains(&i) {
            0.0
        } else {
            setting.y[(i, j)] + state.z[(i, j)] - state.u[(i, j)]
        }
    });
    let mut w = Mat::<f64>::zeros(r, columns);
    let mut p = Mat::<f64>::zeros(n, columns);
    for iteration in 0..iterations {
        if stop() {
            return None;
        }
        matmul(
            w.as_mut(),
            Accum::Replace,
            phi.transpose(),
            v.as_ref(),
            1.0,
            Par::Seq,
        );
        for (f, factor) in factors.iter().enumerate() {
            factor.solve_in_place(w.subcols_mut(f * AXES, AXES));
        }
        matmul(p.as_mut(), Accum::Replace, phi, w.as_ref(), 1.0, Par::Seq);
        if iteration + 1 < iterations {
            update(setting, p.as_ref(), state, &mut v);
        }
    }
    let error = test_error(setting, p.as_ref());
    update(setting, p.as_ref(), state, &mut v);
    error.is_finite().then_some(error)
}

/// (D/ρ + ΦᵀΦ)⁻¹ over each fold's training touches, D the identity without the bias.
fn factor_folds(
    setting: &AdmmSetting,
    phi: MatRef<f64>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Llt<f64>>> {
    let r = phi.ncols();
    let grams: Option<Vec<Mat<f64>>> = setting
        .folds
        .iter()
        .map(|fold| {
            if stop() {
                return None;
            }
            let part = phi.subrows(fold.start, fold.len());
            let mut gram = Mat::zeros(r, r);
            matmul(
                gram.as_mut(),
                Accum::Replace,
                part.transpose(),
                part,
                1.0,
                Par::Seq,
            );
            Some(gram)
        })
        .collect();
    let grams = grams?;
    let mut all = Mat::<f64>::zeros(r, r);
    for gram in &grams {
        all += gram;
    }
    for k in 0..r - 1 {
        all[(k, k)] += setting.rho.recip();
    }
    grams
        .iter()
        .map(|gram| (&all - gram).llt(Side::Lower).ok())
        .collect()
}

/// New residuals and multipliers from predictions, and the next right-hand side.
fn update(setting: &AdmmSetting, p: MatRef<f64>, state: &mut AdmmState, v: &mut Mat<f64>) {
    let limit = setting.c / setting.rho;
    for j in 0..p.ncols() {
        let fold = &setting.folds[j / AXES];
        let (p, y) = (p.col(j), setting.y.col(j));
        let (z, u, v) = (state.z.col_mut(j), state.u.col_mut(j), v.col_mut(j));
        let (Some(p), Some(y), Some(z), Some(u), Some(v)) = (
            p.try_as_col_major(),
            y.try_as_col_major(),
            z.try_as_col_major_mut(),
            u.try_as_col_major_mut(),
            v.try_as_col_major_mut(),
        ) else {
            unreachable!("whole matrices have columns that lie together")
        };
        let (p, y) = (p.as_slice(), y.as_slice());
        let (z, u, v) = (z.as_slice_mut(), u.as_slice_mut(), v.as_slice_mut());
        for part in [0..fold.start, fold.end..y.len()] {
            let (p, y) = (&p[part.clone()], &y[part.clone()]);
            let (z, u, v) = (&mut z[part.clone()], &mut u[part.clone()], &mut v[part]);
            relax(p, y, z, u, v, setting.epsilon, limit);
        }
    }
}

wide! {
    fn relax<'a>(
        p: &'a [f64],
        y: &'a [f64],
        z: &'a mut [f64],
        u: &'a mut [f64],
        v: &'a mut [f64],
        epsilon: f64,
        limit: f64,
    ) {
        for ((((p, y), z), u), v) in p.iter().zip(y).zip(z).zip(u).zip(v) {
            let relaxed = RELAX * p + (1.0 - RELAX) * (*z + y);
            let q = relaxed - y + *u;
            // The proximal map of C/ρ |·|_ε: free inside the tube, held on its wall.
            let beyond = (q.abs() - epsilon).clamp(0.0, limit).copysign(q);
            *z = q - beyond;
            *u = beyond;
            *v = y + *z - *u;
        }
    }
}

fn test_error(setting: &AdmmSetting, p: MatRef<f64>) -> f64 {
    let fold_error = |(f, fold): (usize, &Range<usize>)| {
        let sum: f64 = fold
            .clone()
            .map(|i| {
                (0..AXES)
                    .map(|a| (p[(i, f * AXES + a)] - setting.y[(i, f * AXES + a)]).powi(2))
                    .sum::<f64>()
                    .sqrt()
            })
            .sum();
        sum / fold.len().max(1) as f64
    };
    setting
        .folds
        .iter()
        .enumerate()
        .map(fold_error)
        .sum::<f64>()
        / setting.folds.len() as f64
}
