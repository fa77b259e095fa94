//! Tables keyed by numbers: places, edges and triangles are looked up millions of times while a mesh is taken in,
//! where the usual hash, made against keys chosen by an enemy of a server, takes most of the time.
//!
//! Nothing depends on the order of these tables: they are only asked.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

pub(crate) type NumberMap<K, V> = HashMap<K, V, BuildHasherDefault<NumberHasher>>;
pub(crate) type NumberSet<K> = HashSet<K, BuildHasherDefault<NumberHasher>>;

/// Multiplies into 128 bits and folds: numbers that differ in their high bits only, as coordinates do, are
/// parted as well as others.
#[derive(Clone, Copy, Default)]
pub(crate) struct NumberHasher(u64);

impl NumberHasher {
    fn take(&mut self, word: u64) {
        /// Two odd numbers without a pattern (the fractions of π and of the golden ratio).
        const START: u64 = 0x243f_6a88_85a3_08d3;
        const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
        let product = u128::from(self.0.rotate_left(23) ^ word ^ START) * u128::from(FACTOR);
        self.0 = (product as u64) ^ ((product >> 64) as u64);
    }
}

impl Hasher for NumberHasher {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.take(u64::from_le_bytes(word));
        }
    }

    fn write_u32(&mut self, number: u32) {
        self.take(number.into());
    }

    fn write_u64(&mut self, number: u64) {
        self.take(number);
    }

    fn write_usize(&mut self, number: usize) {
        self.take(number as u64);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::BuildHasher;

    #[test]
    fn places_on_a_grid_do_not_meet() {
        // Coordinates of a round grid end in many zeros: the hardest keys there are in practice.
        let mut low = NumberSet::default();
        let mut high = NumberSet::default();
        let hasher = BuildHasherDefault::<NumberHasher>::default();
        for x in 0..100_u32 {
            for y in 0..100_u32 {
                let key = [f64::from(x), f64::from(y) / 8.0, 0.0].map(f64::to_bits);
                let hash = hasher.hash_one(key);
                low.insert(hash & 0xf_ffff);
                high.insert(hash >> 44);
            }
        }
        // Chance alone lets about fifty of ten thousand meet in a million places.
        assert!(
            low.len() > 9_900 && high.len() > 9_900,
            "{} {}",
            low.len(),
            high.len()
        );
    }
}
