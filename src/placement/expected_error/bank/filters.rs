//! The Kalman filters at all places at once, in blocks of places side by side.

use crate::lanes::{exponential, logarithm, wide};
use crate::placement::expected_error::scene::Report;

/// Places whose probability is summed side by side.
pub(super) const LANES: usize = 16;

/// The filters at all places, for one force.
pub(super) struct Filters {
    /// Upper triangles of the covariances: along, along-across, along-force, across, across-force, force.
    pub(super) covariances: [Vec<f32>; 6],
}

/// What a site's reading does to the filters at all places, for one force.
#[derive(Default)]
pub(in crate::placement::expected_error) struct Rows {
    /// Of the reading over its deviation: by place and force.
    pub(super) slopes: [Vec<f32>; 3],
    /// One over the deviation.
    pub(super) scale: Vec<f32>,
    /// Half over the variance of what is predicted, and the logarithm that belongs to it.
    pub(super) half: Vec<f32>,
    pub(super) log: Vec<f32>,
    /// By how much the force is corrected, and one over its deviation after that.
    pub(super) gain: Vec<f32>,
    pub(super) sharpness: Vec<f32>,
}

impl Rows {
    pub(super) fn with(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            slopes: [zeros(), zeros(), zeros()],
            scale: zeros(),
            half: zeros(),
            log: zeros(),
            gain: zeros(),
            sharpness: zeros(),
        }
    }
}

/// Fills in what a reading does to the filters at all places.
pub(super) fn predict(filters: &Filters, report: &Report, force: f32, rows: &mut Rows) {
    let count = report.value.len();
    let [xx, xy, xf, yy, yf, ff] = filters.covariances.each_ref().map(|c| &c[..count]);
    let [r0, r1, r2] = rows.slopes.each_mut().map(|r| &mut r[..count]);
    fill(
        [xx, xy, xf, yy, yf, ff],
        [
            report.value,
            report.slopes[0],
            report.slopes[1],
            report.variance,
        ],
        [
            r0,
            r1,
            r2,
            &mut rows.scale[..count],
            &mut rows.half[..count],
            &mut rows.log[..count],
            &mut rows.gain[..count],
            &mut rows.sharpness[..count],
        ],
        force,
    );
}

/// One over the deviation; nothing where there is none to know.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
pub(super) fn sharpness(variance: f32) -> f32 {
    if variance > 0.0 {
        variance.sqrt().recip()
    } else {
        0.0
    }
}

/// By how much the filters at all places correct along, across and force.
pub(super) fn corrections(filters: &Filters, rows: &Rows) -> [Vec<f32>; 3] {
    let [xx, xy, xf, yy, yf, _] = &filters.covariances;
    let count = xx.len();
    let (mut along, mut across) = (vec![0.0; count], vec![0.0; count]);
    for k in 0..count {
        let r = [0, 1, 2].map(|i: usize| rows.slopes[i][k]);
        let share = 2.0 * rows.half[k];
        along[k] = (xx[k] * r[0] + xy[k] * r[1] + xf[k] * r[2]) * share;
        across[k] = (xy[k] * r[0] + yy[k] * r[1] + yf[k] * r[2]) * share;
    }
    [along, across, rows.gain.clone()]
}

pub(super) fn shrink(filters: &mut Filters, rows: &Rows, gains: &[Vec<f32>; 3]) {
    const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    for (values, (i, j)) in filters.covariances.iter_mut().zip(ENTRIES) {
        for (k, value) in values.iter_mut().enumerate() {
            if rows.half[k] > 0.0 {
                *value -= gains[i][k] * gains[j][k] / (2.0 * rows.half[k]);
            }
        }
    }
}

/// Takes a reading into account at the places that may still be meant.
pub(super) fn correct(
    before: [&mut Vec<f32>; 4],
    rows: &Rows,
    gains: &[Vec<f32>; 3],
    blocks: &[u32],
    reading: f32,
) {
    let [r0, r1, r2] = rows.slopes.each_ref().map(|r| &r[..]);
    correct_blocks(
        before.map(Vec::as_mut_slice),
        [r0, r1, r2, &rows.scale, &rows.half, &rows.log],
        gains.each_ref().map(|g| &g[..]),
        blocks,
        reading,
    );
}

fn folded(lanes: [[f32; LANES]; 4]) -> [f64; 4] {
    lanes.map(|lane| lane.iter().map(|v| f64::from(*v)).sum())
}

wide! {
    pub(super) fn sum_masses_with<'a>(
        before: [&'a [f32]; 4],
        row: [&'a [f32]; 4],
        after: [&'a [f32]; 4],
        positions: [&'a [f32]; 3],
        blocks: &'a [u32],
        reading: f32,
        own: f32,
    ) -> [f64; 4] {
        let mut sums = [[0.0_f32; LANES]; 4];
        let [along, across, force, cost] = before.map(|v| v.as_chunks::<LANES>().0);
        let [r0, r1, r2, scale] = row.map(|v| v.as_chunks::<LANES>().0);
        let [half, log, gain, sharpness] = after.map(|v| v.as_chunks::<LANES>().0);
        let [x, y, z] = positions.map(|v| v.as_chunks::<LANES>().0);
        for &block in blocks {
            let b = block as usize;
            let [along, across, force, cost] = [along[b], across[b], force[b], cost[b]];
            let [r0, r1, r2, scale] = [r0[b], r1[b], r2[b], scale[b]];
            let [half, log, gain, sharpness] = [half[b], log[b], gain[b], sharpness[b]];
            let [x, y, z] = [x[b], y[b], z[b]];
            for l in 0..LANES {
                let off = reading * scale[l] - (r0[l] * along[l] + r1[l] * across[l] + r2[l] * force[l]);
                let pulls = ((force[l] + gain[l] * off) * sharpness[l]).min(0.0);
                let costs = cost[l] + off * off * half[l] + log[l] + 0.5 * pulls * pulls;
                let w = exponential((own - costs).min(60.0));
                sums[0][l] += w;
                sums[1][l] += w * x[l];
                sums[2][l] += w * y[l];
                sums[3][l] += w * z[l];
            }
        }
        folded(sums)
    }
}

wide! {
    fn correct_blocks<'a>(
        before: [&'a mut [f32]; 4],
        row: [&'a [f32]; 6],
        gains: [&'a [f32]; 3],
        blocks: &'a [u32],
        reading: f32,
    ) {
        let [along, across, force, cost] = before.map(|v| v.as_chunks_mut::<LANES>().0);
        let [r0, r1, r2, scale, half, log] = row.map(|v| v.as_chunks::<LANES>().0);
        let [g0, g1, g2] = gains.map(|v| v.as_chunks::<LANES>().0);
        for &block in blocks {
            let b = block as usize;
            let (along, across) = (&mut along[b], &mut across[b]);
            let (force, cost) = (&mut force[b], &mut cost[b]);
            let [r0, r1, r2, scale] = [r0[b], r1[b], r2[b], scale[b]];
            let [half, log, g0, g1, g2] = [half[b], log[b], g0[b], g1[b], g2[b]];
            for l in 0..LANES {
                let predicted = r0[l] * along[l] + r1[l] * across[l] + r2[l] * force[l];
                let off = reading * scale[l] - predicted;
                cost[l] += off * off * half[l] + log[l];
                along[l] += g0[l] * off;
                across[l] += g1[l] * off;
                force[l] += g2[l] * off;
            }
        }
    }
}

wide! {
    fn fill<'a>(
        covariances: [&'a [f32]; 6],
        report: [&'a [f32]; 4],
        into: [&'a mut [f32]; 8],
        force: f32,
    ) {
        let count = report[0].len();
        let [xx, xy, xf, yy, yf, ff] = covariances.map(|c| &c[..count]);
        let [value, along, across, variance] = report.map(|r| &r[..count]);
        let [r0, r1, r2, scales, halves, logs, gains, sharp] = into.map(|i| &mut i[..count]);
        for k in 0..count {
            let variance = 1.0 + force * force * variance[k];
            let scale = variance.sqrt().recip();
            let r = [force * along[k] * scale, force * across[k] * scale, value[k] * scale];
            let spread = [
                xx[k] * r[0] + xy[k] * r[1] + xf[k] * r[2],
                xy[k] * r[0] + yy[k] * r[1] + yf[k] * r[2],
                xf[k] * r[0] + yf[k] * r[1] + ff[k] * r[2],
            ];
            // Never less than the noise: where signals are far above it, rounding would take more.
            let predicted = (1.0 + r[0] * spread[0] + r[1] * spread[1] + r[2] * spread[2]).max(1.0);
            let share = predicted.recip();
            [r0[k], r1[k], r2[k]] = r;
            scales[k] = scale;
            halves[k] = 0.5 * share;
            logs[k] = 0.5 * logarithm(predicted * variance);
            gains[k] = spread[2] * share;
            sharp[k] = sharpness(ff[k] - spread[2] * spread[2] * share);
        }
    }
}
