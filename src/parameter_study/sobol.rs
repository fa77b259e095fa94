//! Sobol's sequence with the direction numbers of S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better
//! two-dimensional projections" (SIAM J. Sci. Comput. 30, 2008), shifted digit by digit at random, which keeps its parts
//! as evenly filled.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Degree, coefficients and first direction numbers of each dimension after the first.
const DIRECTIONS: [(u32, u32, &[u32]); 9] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
];
pub(super) const MOST_DIMENSIONS: usize = DIRECTIONS.len() + 1;
const BITS: u32 = 32;

/// The sequence in some dimensions.
pub(super) struct Sobol {
    directions: Vec<[u32; BITS as usize]>,
    shifts: Vec<u32>,
}

impl Sobol {
    /// In so many dimensions, shifted by what a seed draws.
    pub fn shifted(dimensions: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let all = (0..dimensions).map(|d| match d {
            0 => std::array::from_fn(|k| 1 << (31 - k)),
            _ => recurrence(DIRECTIONS[d - 1]),
        });
        Self {
            directions: all.collect(),
            shifts: (0..dimensions).map(|_| rng.random()).collect(),
        }
    }

    /// A point of it, each coordinate from 0 to 1.
    pub fn point(&self, number: u32) -> Vec<f64> {
        // In Gray code's order any point follows from its number alone.
        let gray = number ^ (number >> 1);
        let coordinate = |(directions, shift): (&[u32; BITS as usize], &u32)| {
            let bits = (0..BITS).filter(|k| gray >> k & 1 == 1);
            let all = bits.fold(*shift, |sum, k| sum ^ directions[k as usize]);
            f64::from(all) / f64::from(u32::MAX) * (1.0 - f64::EPSILON)
        };
        self.directions
            .iter()
            .zip(&self.shifts)
            .map(coordinate)
            .collect()
    }
}

/// Direction numbers by the recurrence of a primitive polynomial.
fn recurrence((degree, coefficients, first): (u32, u32, &[u32])) -> [u32; BITS as usize] {
    let s = degree as usize;
    let mut v = [0; BITS as usize];
    for k in 0..BITS as usize {
        v[k] = if k < s {
            first[k] << (31 - k)
        } else {
            let mut value = v[k - s] ^ (v[k - s] >> s);
            for j in 1..s {
                if coefficients >> (s - 1 - j) & 1 == 1 {
                    value ^= v[k - j];
                }
            }
            value
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_points_are_the_published_ones() {
        let plain = Sobol {
            shifts: vec![0; 3],
            ..Sobol::shifted(3, 0)
        };
        let expected = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
        ];
        for (number, point) in (0..).zip(expected) {
            for (found, right) in plain.point(number).iter().zip(point) {
                assert!((found - right).abs() < 1e-8, "{number}: {found} {right}");
            }
        }
    }

    /// Every pair of dimensions puts one of 2¹⁰ points into each of as many slices of either.
    #[test]
    fn every_dimension_is_filled_evenly() {
        let sobol = Sobol::shifted(MOST_DIMENSIONS, 7);
        let points: Vec<Vec<f64>> = (0..1024).map(|k| sobol.point(k)).collect();
        for d in 0..MOST_DIMENSIONS {
            let mut slices: Vec<usize> = points.iter().map(|p| (p[d] * 1024.0) as usize).collect();
            slices.sort_unstable();
            assert!(slices.into_iter().eq(0..1024), "dimension {d}");
        }
    }
}
