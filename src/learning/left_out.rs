//! What a kernel regression says of touches whose place it has not learned from, without fitting it anew.
//!
//! Leaving out the touches g of one place, the residuals there are (A⁻¹)gg⁻¹ αg, with A = K + noise and α = A⁻¹ y
//! (Rasmussen and Williams, 2006, eq. 5.12, for a block in place of one touch).

use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};

use crate::regression::folds::members;

/// Target less prediction at every touch, each predicted from the touches of other groups alone: touches × outputs.
/// `covariance` is K with the noise on its diagonal. Nothing where that has no factor.
#[must_use]
pub fn residuals(covariance: &Mat<f64>, outputs: &Mat<f64>, groups: &[usize]) -> Option<Mat<f64>> {
    let factor = covariance.llt(Side::Lower).ok()?;
    let inverse = factor.inverse();
    let alpha = factor.solve(outputs);
    let mut left = Mat::zeros(outputs.nrows(), outputs.ncols());
    for group in members(groups) {
        if let [touch] = group[..] {
            for k in 0..outputs.ncols() {
                left[(touch, k)] = alpha[(touch, k)] / inverse[(touch, touch)];
            }
            continue;
        }
        let block = Mat::from_fn(group.len(), group.len(), |i, j| {
            inverse[(group[i], group[j])]
        });
        let right = Mat::from_fn(group.len(), outputs.ncols(), |i, k| alpha[(group[i], k)]);
        let solved = block.llt(Side::Lower).ok()?.solve(&right);
        for (i, &touch) in group.iter().enumerate() {
            for k in 0..outputs.ncols() {
                left[(touch, k)] = solved[(i, k)];
            }
        }
    }
    Some(left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::distance::among;
    use crate::learning::kernel::Kernel;
    use crate::learning::lessons::rows;

    #[test]
    fn it_is_what_leaving_out_place_by_place_gives() {
        let n = 30;
        let x = Mat::from_fn(n, 2, |t, c| ((t * 7 + c * 3) as f64 * 0.61).sin());
        let y = Mat::from_fn(n, 2, |t, k| x[(t, 0)].powi(2) + k as f64 * x[(t, 1)]);
        let groups: Vec<usize> = (0..n).map(|t| if t < 12 { t / 3 } else { t - 8 }).collect();
        let noise = 0.01;
        let mut k = Kernel::Matern.of(among(&x));
        for i in 0..n {
            k[(i, i)] += noise;
        }
        let quick = residuals(&k, &y, &groups).unwrap();
        for out in [0, 2, 9] {
            let kept: Vec<usize> = (0..n).filter(|&t| groups[t] != out).collect();
            let inner = Mat::from_fn(kept.len(), kept.len(), |i, j| k[(kept[i], kept[j])]);
            let weights = inner.llt(Side::Lower).unwrap().solve(&rows(&y, &kept));
            for t in (0..n).filter(|&t| groups[t] == out) {
                for c in 0..2 {
                    let said: f64 = (0..kept.len())
                        .map(|i| k[(t, kept[i])] * weights[(i, c)])
                        .sum();
                    assert!((y[(t, c)] - said - quick[(t, c)]).abs() < 1e-9);
                }
            }
        }
    }
}
