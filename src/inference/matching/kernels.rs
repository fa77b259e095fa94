//! One reading against all templates: the two loops that matching spends its time in.
//!
//! Both go through blocks of [`LANES`] templates, channel by channel, in single precision and microstrain, and leave for
//! every template half of what a touch there explains of the weighted squares, and the highest of each block. They
//! differ in whose the weights are: the reading's, or each template's own.

use super::modes::TURNS;
use crate::inference::map::LANES;
use crate::lanes::{logarithm, wide};

wide! {
    /// For weights that all templates share: `scaled` is the reading times its `weights`, `shared` what a common drift
    /// takes (κ, and the sum of `scaled`); see [`super::weighed`].
    pub(super) fn score_templates<'a>(
        templates: &'a [f32],
        scaled: &'a [f32],
        weights: &'a [f32],
        shared: [f32; 2],
        most: f32,
        scores: &'a mut [f32],
        highest: &'a mut [f32],
    ) {
        let channels = scaled.len();
        let [taken, sum] = shared;
        let blocks = templates.chunks_exact(LANES * channels).zip(scores.chunks_exact_mut(LANES));
        for ((block, out), highest) in blocks.zip(highest) {
            let (mut s, mut d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
            let mut g = [0.0_f32; LANES];
            for (row, (&a, &w)) in block.chunks_exact(LANES).zip(scaled.iter().zip(weights)) {
                for k in 0..LANES {
                    s[k] += a * row[k];
                    d[k] += w * row[k] * row[k];
                }
                if taken > 0.0 {
                    for k in 0..LANES {
                        g[k] += w * row[k];
                    }
                }
            }
            if taken > 0.0 {
                for k in 0..LANES {
                    s[k] -= taken * sum * g[k];
                    d[k] = (d[k] - taken * g[k] * g[k]).max(f32::MIN_POSITIVE);
                }
            }
            for k in 0..LANES {
                let force = (s[k] / d[k]).max(0.0).min(most);
                out[k] = force * (s[k] - 0.5 * force * d[k]);
            }
            *highest = 0.0;
            for k in 0..LANES {
                *highest = highest.max(out[k]);
            }
        }
    }
}

wide! {
    /// For variances that grow with the force by what gluing spreads at each template: `maps` are templates and
    /// spreads, `reading` in microstrain, `weights` without gluing, `drift` the variance that all channels share.
    pub(super) fn score_with_gluing<'a>(
        maps: [&'a [f32]; 2],
        reading: &'a [f32],
        weights: &'a [f32],
        drift: f32,
        most: f32,
        scores: &'a mut [f32],
        highest: &'a mut [f32],
    ) {
        let [templates, spreads] = maps;
        let channels = reading.len();
        let mut nothing: f32 = reading.iter().zip(weights).map(|(x, w)| w * x * x).sum();
        let mut log_nothing = 0.0_f32;
        if drift > 0.0 {
            let sum: f32 = reading.iter().zip(weights).map(|(x, w)| w * x).sum();
            let wider = 1.0 + drift * weights.iter().sum::<f32>();
            nothing -= drift / wider * sum * sum;
            log_nothing = logarithm(wider);
        }
        let block = LANES * channels;
        let blocks = templates.chunks_exact(block).zip(spreads.chunks_exact(block));
        for (((block, gluing_deviation), out), highest) in
            blocks.zip(scores.chunks_exact_mut(LANES)).zip(highest)
        {
            let glued = GluedBlock { templates: block, spreads: gluing_deviation, reading, weights, drift };
            for (part, out) in out.chunks_exact_mut(PART).enumerate() {
                let at = part * PART;
                let mut force = glued.first_force(at, most);
                for _ in 0..TURNS {
                    let sums = glued.sums::<false>(at, &force);
                    force = sums.force(most);
                }
                let sums = glued.sums::<true>(at, &force);
                for k in 0..PART {
                    let left = sums.a[k] - force[k] * (2.0 * sums.s[k] - force[k] * sums.d[k]);
                    out[k] = 0.5 * (nothing - left - (sums.log[k] - log_nothing));
                }
            }
            *highest = f32::NEG_INFINITY;
            for k in 0..LANES {
                *highest = highest.max(out[k]);
            }
        }
    }
}

/// Templates whose sums are held in registers at a time.
const PART: usize = 32;
const _: () = assert!(LANES.is_multiple_of(PART), "parts fill a block");

/// A block of templates, what gluing spreads at each (a newton), and the reading that is compared with them.
struct GluedBlock<'a> {
    templates: &'a [f32],
    spreads: &'a [f32],
    reading: &'a [f32],
    weights: &'a [f32],
    drift: f32,
}

/// Weighted sums of a part of a block: of reading times template, squares of templates, and, where they are asked for,
/// squares of the reading and the logarithm of what variances have grown by.
struct BlockSums {
    s: [f32; PART],
    d: [f32; PART],
    a: [f32; PART],
    log: [f32; PART],
}

impl BlockSums {
    #[allow(
        clippy::inline_always,
        reason = "part of a loop that is compiled for several instruction sets"
    )]
    #[inline(always)]
    fn force(&self, most: f32) -> [f32; PART] {
        let mut force = [0.0; PART];
        for k in 0..PART {
            force[k] = (self.s[k] / self.d[k]).max(0.0).min(most);
        }
        force
    }
}

#[allow(
    clippy::inline_always,
    reason = "parts of a loop that is compiled for several instruction sets"
)]
impl GluedBlock<'_> {
    /// The part of a channel's row that begins `at` a lane of the block.
    #[inline(always)]
    fn part(rows: &[f32], channel: usize, at: usize) -> &[f32; PART] {
        let row = rows[channel * LANES + at..].first_chunk();
        row.expect("blocks are whole")
    }

    /// The force that fits best where all channels are off alike.
    #[inline(always)]
    fn first_force(&self, at: usize, most: f32) -> [f32; PART] {
        let mut sums = BlockSums {
            s: [0.0; PART],
            d: [f32::MIN_POSITIVE; PART],
            a: [0.0; PART],
            log: [0.0; PART],
        };
        for (channel, (&x, &w)) in self.reading.iter().zip(self.weights).enumerate() {
            let trusted = if w > 0.0 { 1.0 } else { 0.0 };
            let row = Self::part(self.templates, channel, at);
            for k in 0..PART {
                sums.s[k] += trusted * x * row[k];
                sums.d[k] += trusted * row[k] * row[k];
            }
        }
        sums.force(most)
    }

    /// The sums by the weights that a touch of these forces has.
    #[inline(always)]
    fn sums<const LAST: bool>(&self, at: usize, force: &[f32; PART]) -> BlockSums {
        let (mut s, mut d) = ([0.0_f32; PART], [f32::MIN_POSITIVE; PART]);
        let (mut a, mut log) = ([0.0_f32; PART], [0.0_f32; PART]);
        let mut widened = [1.0_f32; PART];
        let (mut x_sum, mut g_sum, mut w_sum) = ([0.0_f32; PART], [0.0_f32; PART], [0.0_f32; PART]);
        let channels = self.reading.len();
        for (channel, (&x, &w)) in self.reading.iter().zip(self.weights).enumerate() {
            let row = Self::part(self.templates, channel, at);
            let spread = Self::part(self.spreads, channel, at);
            let mut own = [0.0_f32; PART];
            for k in 0..PART {
                let off = force[k] * spread[k];
                let wider = 1.0 + w * off * off;
                own[k] = w / wider;
                let weighed = own[k] * row[k];
                s[k] += weighed * x;
                d[k] += weighed * row[k];
                if LAST {
                    a[k] += own[k] * x * x;
                    widened[k] *= wider;
                }
            }
            // A logarithm for two: of more, the product might leave the range.
            if LAST && (channel % 2 == 1 || channel + 1 == channels) {
                for k in 0..PART {
                    log[k] += logarithm(widened[k]);
                }
                widened = [1.0; PART];
            }
            if self.drift > 0.0 {
                for k in 0..PART {
                    x_sum[k] += own[k] * x;
                    g_sum[k] += own[k] * row[k];
                    w_sum[k] += own[k];
                }
            }
        }
        if self.drift > 0.0 {
            for k in 0..PART {
                let wider = 1.0 + self.drift * w_sum[k];
                let taken = self.drift / wider;
                s[k] -= taken * x_sum[k] * g_sum[k];
                d[k] = (d[k] - taken * g_sum[k] * g_sum[k]).max(f32::MIN_POSITIVE);
                a[k] -= taken * x_sum[k] * x_sum[k];
                if LAST {
                    log[k] += logarithm(wider);
                }
            }
        }
        BlockSums { s, d, a, log }
    }
}
