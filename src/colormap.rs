//! Perceptual colour maps that work for colour-blind eyes, one table for shader, legend and files.

/// A map from 0–1 to sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorMap {
    /// For magnitudes: dark blue to yellow.
    Viridis,
    /// For signed values: blue through near-white to orange-brown, zero in the middle.
    BlueOrange,
}

/// Entries of a table.
pub const TABLE: usize = 256;

impl ColorMap {
    /// sRGB-encoded colour, components 0–1.
    #[must_use]
    pub fn at(self, t: f64) -> [f64; 3] {
        let t = t.clamp(0.0, 1.0);
        match self {
            Self::Viridis => viridis(t),
            Self::BlueOrange => blue_orange(t),
        }
    }

    /// As bytes, alpha last.
    #[must_use]
    pub fn table(self) -> Vec<[u8; 4]> {
        (0..TABLE)
            .map(|k| {
                let [r, g, b] = self
                    .at(k as f64 / (TABLE - 1) as f64)
                    .map(|c| (c * 255.0).round() as u8);
                [r, g, b, 255]
            })
            .collect()
    }
}

/// Viridis (S. van der Walt and N. Smith) through its anchors, linear between them.
fn viridis(t: f64) -> [f64; 3] {
    const ANCHORS: [[u8; 3]; 11] = [
        [68, 1, 84],
        [72, 36, 117],
        [65, 68, 135],
        [53, 95, 141],
        [42, 120, 142],
        [33, 145, 140],
        [34, 168, 132],
        [68, 191, 112],
        [122, 209, 81],
        [189, 223, 38],
        [253, 231, 37],
    ];
    between(&ANCHORS, t)
}

fn blue_orange(t: f64) -> [f64; 3] {
    const ANCHORS: [[u8; 3]; 7] = [
        [8, 48, 107],
        [33, 113, 181],
        [124, 176, 218],
        [240, 240, 236],
        [253, 174, 97],
        [217, 95, 14],
        [127, 39, 4],
    ];
    between(&ANCHORS, t)
}

fn between(anchors: &[[u8; 3]], t: f64) -> [f64; 3] {
    let x = t * (anchors.len() - 1) as f64;
    let k = (x.floor() as usize).min(anchors.len() - 2);
    let f = x - k as f64;
    std::array::from_fn(|c| {
        let (a, b) = (f64::from(anchors[k][c]), f64::from(anchors[k + 1][c]));
        (a + (b - a) * f) / 255.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_gets_lighter_all_the_way() {
        let light = |t: f64| {
            let [r, g, b] = ColorMap::Viridis.at(t);
            0.21 * r + 0.72 * g + 0.07 * b
        };
        assert!((1..=50).all(|k| light(f64::from(k) / 50.0) > light(f64::from(k - 1) / 50.0)));
        assert_eq!(ColorMap::BlueOrange.table().len(), TABLE);
    }
}
