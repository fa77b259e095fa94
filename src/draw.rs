//! Random draws.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Standard normal.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// All subsets of `size` among `count`, in order, or `most` different ones drawn by the seed.
pub(crate) fn subsets(count: usize, size: usize, most: usize, seed: u64) -> Vec<Vec<usize>> {
    if binomial(count, size) <= most as u64 {
        let mut all = vec![Vec::new()];
        for _ in 0..size {
            all = all
                .into_iter()
                .flat_map(|s: Vec<usize>| {
                    let from = s.last().map_or(0, |l| l + 1);
                    (from..count).map(move |next| [&s[..], &[next]].concat())
                })
                .collect();
        }
        return all;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(size as u64));
    let mut drawn: Vec<Vec<usize>> = Vec::new();
    let mut places: Vec<usize> = (0..count).collect();
    while drawn.len() < most {
        places.shuffle(&mut rng);
        let mut subset = places[..size].to_vec();
        subset.sort_unstable();
        if !drawn.contains(&subset) {
            drawn.push(subset);
        }
    }
    drawn.sort();
    drawn
}

/// n over k; the largest number where that would be larger.
pub(crate) fn binomial(n: usize, k: usize) -> u64 {
    let mut value = 1u128;
    for i in 0..k.min(n) {
        value = value * (n - i) as u128 / (i + 1) as u128;
    }
    u64::try_from(value).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subsets_are_all_or_a_sample_without_repeats() {
        assert_eq!(subsets(5, 2, 10, 0).len(), 10);
        assert_eq!(subsets(5, 2, 10, 0)[9], [3, 4]);
        let few = subsets(10, 5, 20, 3);
        assert_eq!(few.len(), 20);
        assert!(few.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(few, subsets(10, 5, 20, 3));
        assert_ne!(few, subsets(10, 5, 20, 4));
        assert_eq!(binomial(10, 5), 252);
    }
}
