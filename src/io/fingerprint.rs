//! Short keys of what something was computed from: the same on every machine and in every version.

use crate::design::Inputs;

/// Fowler, Noll and Vo's hash (FNV-1a), taken in byte by byte.
pub struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    pub fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// The part to the last bit, and its masks.
    pub fn add_part(&mut self, inputs: &Inputs) {
        for p in inputs.part.positions() {
            self.add(p.to_array().into_iter().flat_map(f64::to_le_bytes));
        }
        for triangle in inputs.part.triangles() {
            self.add(triangle.iter().flat_map(|v| v.to_le_bytes()));
        }
        let masks = inputs
            .masks
            .iter()
            .map(|(name, mask)| (name.as_str(), mask));
        let painted = inputs.painted.iter().map(|mask| ("painted", mask));
        for (name, mask) in masks.chain(painted) {
            self.add(name.bytes().chain(mask.iter().map(|&m| u8::from(m))));
        }
    }

    /// Numbers to the last bit.
    pub fn add_numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        for number in numbers {
            self.add(number.to_le_bytes());
        }
    }

    /// As it is shown and kept.
    #[must_use]
    pub fn hex(&self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_published_hash() {
        let of = |text: &str| {
            let mut key = Fingerprint::default();
            key.add(text.bytes());
            key.hex()
        };
        assert_eq!(of(""), "cbf29ce484222325");
        assert_eq!(of("foobar"), "85944171f73967e8");
    }
}
