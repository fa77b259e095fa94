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
            let (mut s, mut d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
            for (row, (&x, &w)) in block.chunks_exact(LANES).zip(reading.iter().zip(weights)) {
                let trusted = if w > 0.0 { 1.0 } else { 0.0 };
                for k in 0..LANES {
                    s[k] += trusted * x * row[k];
                    d[k] += trusted * row[k] * row[k];
                }
            }
            let mut force = [0.0_f32; LANES];
            for k in 0..LANES {
                force[k] = (s[k] / d[k]).max(0.0).min(most);
            }
            for turn in 0..=TURNS {
                let (mut a, mut log) = ([0.0_f32; LANES], [0.0_f32; LANES]);
                (s, d) = ([0.0_f32; LANES], [f32::MIN_POSITIVE; LANES]);
                let (mut x_sum, mut g_sum) = ([0.0_f32; LANES], [0.0_f32; LANES]);
                let mut w_sum = [0.0_f32; LANES];
                let rows = block.chunks_exact(LANES).zip(gluing_deviation.chunks_exact(LANES));
                for ((row, gluing_deviation), (&x, &w)) in rows.zip(reading.iter().zip(weights)) {
                    let mut own = [0.0_f32; LANES];
                    for k in 0..LANES {
                        let off = force[k] * gluing_deviation[k];
                        let wider = 1.0 + w * off * off;
                        let w = w / wider;
                        own[k] = w;
                        s[k] += w * x * row[k];
                        d[k] += w * row[k] * row[k];
                        a[k] += w * x * x;
                        log[k] += logarithm(wider);
                    }
                    if drift > 0.0 {
                        for k in 0..LANES {
                            x_sum[k] += own[k] * x;
                            g_sum[k] += own[k] * row[k];
                            w_sum[k] += own[k];
                        }
                    }
                }
                if drift > 0.0 {
                    for k in 0..LANES {
                        let wider = 1.0 + drift * w_sum[k];
                        let taken = drift / wider;
                        s[k] -= taken * x_sum[k] * g_sum[k];
                        d[k] = (d[k] - taken * g_sum[k] * g_sum[k]).max(f32::MIN_POSITIVE);
                        a[k] -= taken * x_sum[k] * x_sum[k];
                        log[k] += logarithm(wider) - log_nothing;
                    }
                }
                for k in 0..LANES {
                    if turn == TURNS {
                        let left = a[k] - force[k] * (2.0 * s[k] - force[k] * d[k]);
                        out[k] = 0.5 * (nothing - left - log[k]);
                    } else {
                        force[k] = (s[k] / d[k]).max(0.0).min(most);
                    }
                }
            }
            *highest = f32::NEG_INFINITY;
            for k in 0..LANES {
                *highest = highest.max(out[k]);
            }
        }
    }
}
