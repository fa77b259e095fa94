//! A Cholesky factor that rows and columns can be taken out of.

use faer::{Mat, Side};

use crate::lanes::wide;

/// L of A = L Lᵀ, its columns one after the other without what lies above the diagonal.
pub struct Shrinking {
    columns: Vec<Vec<f64>>,
}

impl Shrinking {
    /// Absent where the matrix is not positive definite.
    pub fn new(a: &Mat<f64>) -> Option<Self> {
        let factor = a.llt(Side::Lower).ok()?;
        let l = factor.L();
        let columns = (0..a.nrows())
            .map(|j| (j..a.nrows()).map(|i| l[(i, j)]).collect())
            .collect();
        Some(Self { columns })
    }

    /// Takes row and column `k` out of A: what stood below the diagonal in L's column k goes into the
    /// rest as a rank-one update, which cannot fail.
    pub fn remove(&mut self, k: usize) {
        let gone = self.columns.remove(k);
        for (j, column) in self.columns[..k].iter_mut().enumerate() {
            column.remove(k - j);
        }
        let mut x = gone[1..].to_vec();
        for (j, column) in self.columns[k..].iter_mut().enumerate() {
            let rest = &mut x[j..];
            let (diagonal, lead) = (column[0], rest[0]);
            let r = diagonal.hypot(lead);
            rotate(
                &mut column[1..],
                &mut rest[1..],
                r / diagonal,
                lead / diagonal,
            );
            column[0] = r;
        }
    }

    /// A⁻¹ b, in place.
    pub fn solve(&self, b: &mut [f64]) {
        for (j, column) in self.columns.iter().enumerate() {
            let (head, tail) = b[j..].split_at_mut(1);
            head[0] /= column[0];
            subtract(tail, &column[1..], head[0]);
        }
        for (j, column) in self.columns.iter().enumerate().rev() {
            let (head, tail) = b[j..].split_at_mut(1);
            head[0] = (head[0] - product(tail, &column[1..])) / column[0];
        }
    }
}

wide! {
    fn rotate<'a>(column: &'a mut [f64], x: &'a mut [f64], c: f64, s: f64) {
        let over = c.recip();
        for (l, x) in column.iter_mut().zip(x) {
            *l = (*l + s * *x) * over;
            *x = c * *x - s * *l;
        }
    }
}

wide! {
    fn subtract<'a>(b: &'a mut [f64], column: &'a [f64], by: f64) {
        for (b, l) in b.iter_mut().zip(column) {
            *b -= by * l;
        }
    }
}

wide! {
    fn product<'a>(b: &'a [f64], column: &'a [f64]) -> f64 {
        let mut sum = [0.0; 8];
        let (bs, ls) = (b.chunks_exact(8), column.chunks_exact(8));
        let rest: f64 = (bs.remainder().iter().zip(ls.remainder())).map(|(b, l)| b * l).sum();
        for (b, l) in bs.zip(ls) {
            for k in 0..8 {
                sum[k] += b[k] * l[k];
            }
        }
        rest + sum.iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_the_factor_of_what_is_left() {
        let n = 30;
        let entry = |i: usize, j: usize| {
            let d = i as f64 - j as f64;
            (-0.05 * d * d).exp() + if i == j { 0.01 } else { 0.0 }
        };
        let mut left: Vec<usize> = (0..n).collect();
        let mut factor = Shrinking::new(&Mat::from_fn(n, n, entry)).unwrap();
        for k in [29, 0, 13, 5, 20] {
            let k = k.min(left.len() - 1);
            left.remove(k);
            factor.remove(k);
            let right: Vec<f64> = (0..left.len()).map(|i| (i as f64).sin()).collect();
            let mut solved = right.clone();
            factor.solve(&mut solved);
            for (r, &i) in left.iter().enumerate() {
                let back: f64 = left
                    .iter()
                    .zip(&solved)
                    .map(|(&j, v)| entry(i, j) * v)
                    .sum();
                assert!((back - right[r]).abs() < 1e-9, "{k}: {back} {}", right[r]);
            }
            assert_eq!(factor.columns.len(), left.len());
        }
    }
}
