//! The Kalman filters at all places at once, in blocks of places side by side.

use std::array::from_fn;

use crate::lanes::{exponential, logarithm, wide};
use crate::placement::expected_error::scene::{LANES, NUISANCES, Report, Scene};

/// Unknowns that every touch has: along, across and force.
pub(in crate::placement::expected_error) const PLAIN: usize = 3;
/// No filter has more of them: those, nuisances of the touch, and a drift.
pub(in crate::placement::expected_error) const MOST: usize = PLAIN + NUISANCES + 1;
/// Which of them is the force.
const FORCE: usize = 2;

/// The filters at all places, for one force.
#[derive(Clone)]
pub(super) struct Filters {
    /// Unknowns of each.
    pub(super) unknowns: usize,
    /// Upper triangles of the covariances, entry by entry at all places: of along, across, force, and what else there is
    /// to find.
    pub(super) covariances: Vec<f32>,
    /// What a drift reads of one deviation; nothing where none is to be found.
    pub(super) drift: Option<f32>,
}

/// What a site's reading does to the filters at all places, for one force.
#[derive(Default)]
pub(in crate::placement::expected_error) struct Rows {
    /// Of the reading over its deviation: by each unknown at all places.
    pub(super) slopes: Vec<f32>,
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
    /// Of so many unknowns at so many places.
    pub(super) fn with(unknowns: usize, count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            slopes: vec![0.0; unknowns * count],
            scale: zeros(),
            half: zeros(),
            log: zeros(),
            gain: zeros(),
            sharpness: zeros(),
        }
    }
}

impl Filters {
    /// Before anything is read, at the places of a scene: within their reach (filled up with 1), with a force of some
    /// variance, and all else of unit variance.
    pub(super) fn new(scene: &Scene, reaches: &[f32], force: f32) -> Self {
        let unknowns = PLAIN + scene.unknowns.len();
        let squares: Vec<f32> = reaches.iter().map(|r| r * r).collect();
        let entry = |(i, j): (usize, usize)| match i {
            _ if i != j => vec![0.0; squares.len()],
            FORCE => vec![force; squares.len()],
            _ if i < FORCE => squares.clone(),
            _ => vec![1.0; squares.len()],
        };
        Self {
            unknowns,
            covariances: entries(unknowns).flat_map(entry).collect(),
            drift: scene
                .unknowns
                .iter()
                .find_map(|u| u.drift())
                .map(|d| d as f32),
        }
    }

    /// Variances of the force.
    pub(super) fn of_force(&self) -> &[f32] {
        let count = self.covariances.len() / entries(self.unknowns).count();
        &self.covariances[place_of(self.unknowns, FORCE, FORCE) * count..][..count]
    }
}

/// Entries of an upper triangle, as they are kept.
fn entries(unknowns: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..unknowns).flat_map(move |i| (i..unknowns).map(move |j| (i, j)))
}

/// Where the entry (i, j ≥ i) is kept.
const fn place_of(unknowns: usize, i: usize, j: usize) -> usize {
    i * unknowns + j - i * (i + 1) / 2
}

/// Fills in what a reading does to the filters at all places.
pub(super) fn predict(filters: &Filters, report: &Report, force: f32, rows: &mut Rows) {
    let into = [
        &mut rows.scale[..],
        &mut rows.half,
        &mut rows.log,
        &mut rows.gain,
        &mut rows.sharpness,
    ];
    fill(filters, report, &mut rows.slopes, into, force);
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

/// By how much the filters at all places correct each unknown.
pub(super) fn corrections(filters: &Filters, rows: &Rows) -> Vec<f32> {
    let count = rows.half.len();
    let mut gains = vec![0.0; filters.unknowns * count];
    spread(filters, rows, &mut gains);
    gains[FORCE * count..][..count].copy_from_slice(&rows.gain);
    gains
}

wide! {
    fn spread<'a>(filters: &'a Filters, rows: &'a Rows, gains: &'a mut [f32]) {
        let count = rows.half.len();
        let covariances = filters.covariances.chunks_exact(count.max(1));
        for ((i, j), values) in entries(filters.unknowns).zip(covariances) {
            let ways = [(i, j), (j, i)];
            for (i, j) in ways.into_iter().take(if i == j { 1 } else { 2 }) {
                let slopes = &rows.slopes[j * count..][..count];
                let terms = values.iter().zip(slopes).zip(&rows.half);
                for (gain, ((value, slope), half)) in gains[i * count..][..count].iter_mut().zip(terms) {
                    *gain += value * slope * 2.0 * half;
                }
            }
        }
    }
}

wide! {
    /// What a reading leaves of the filters' covariances at all places.
    pub(super) fn shrink<'a>(filters: &'a mut Filters, rows: &'a Rows, gains: &'a [f32]) {
        let count = rows.half.len();
        let covariances = filters.covariances.chunks_exact_mut(count.max(1));
        for ((i, j), values) in entries(filters.unknowns).zip(covariances) {
            let [a, b] = [i, j].map(|i| &gains[i * count..][..count]);
            let terms = a.iter().zip(b).zip(&rows.half);
            for (value, ((a, b), half)) in values.iter_mut().zip(terms) {
                // Nothing where so much was predicted that half over it is no number any more.
                *value -= a * b / (2.0 * half).max(f32::MIN_POSITIVE);
            }
        }
    }
}

fn folded(lanes: [[f32; LANES]; 4]) -> [f64; 4] {
    lanes.map(|lane| lane.iter().map(|v| f64::from(*v)).sum())
}

/// Calls a function for as many unknowns as there are, so that its loops over them are unrolled.
macro_rules! for_unknowns {
    ($count:expr, $name:ident($($arg:expr),*)) => {
        match $count {
            PLAIN => $name::<PLAIN>($($arg),*),
            4 => $name::<4>($($arg),*),
            5 => $name::<5>($($arg),*),
            6 => $name::<6>($($arg),*),
            _ => $name::<MOST>($($arg),*),
        }
    };
}

wide! {
    /// The probability (over that of the true place) and its first moments, summed over some blocks of places: what is
    /// thought of each unknown there and what the place costs, before a reading.
    pub(super) fn sum_masses_with<'a>(
        estimates: &'a [f32],
        cost: &'a [f32],
        rows: &'a Rows,
        positions: &'a [f32],
        blocks: &'a [u32],
        reading: f32,
        own: f32,
    ) -> [f64; 4] {
        for_unknowns!(estimates.len() / cost.len().max(1), sum_of(estimates, cost, rows, positions, blocks, reading, own))
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn sum_of<const N: usize>(
    estimates: &[f32],
    cost: &[f32],
    rows: &Rows,
    positions: &[f32],
    blocks: &[u32],
    reading: f32,
    own: f32,
) -> [f64; 4] {
    let mut sums = [[0.0_f32; LANES]; 4];
    let [scale, half, log, gain, sharpness, cost] = [
        &rows.scale[..],
        &rows.half,
        &rows.log,
        &rows.gain,
        &rows.sharpness,
        cost,
    ]
    .map(|v| v.as_chunks::<LANES>().0);
    let [estimates, slopes, positions] =
        [estimates, &rows.slopes, positions].map(|v| v.as_chunks::<LANES>().0);
    // Blocks of one row.
    let row = cost.len();
    for &block in blocks {
        let b = block as usize;
        let estimates: [&[f32; LANES]; N] = from_fn(|i| &estimates[i * row + b]);
        let slopes: [&[f32; LANES]; N] = from_fn(|i| &slopes[i * row + b]);
        let [scale, half, log, gain] = [&scale[b], &half[b], &log[b], &gain[b]];
        let [sharpness, cost] = [&sharpness[b], &cost[b]];
        let [x, y, z]: [&[f32; LANES]; 3] = from_fn(|k| &positions[k * row + b]);
        for l in 0..LANES {
            let mut predicted = 0.0;
            for i in 0..N {
                predicted += slopes[i][l] * estimates[i][l];
            }
            let off = reading * scale[l] - predicted;
            let pulls = ((estimates[FORCE][l] + gain[l] * off) * sharpness[l]).min(0.0);
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

wide! {
    /// Takes a reading into account at the places of some blocks.
    pub(super) fn correct<'a>(
        estimates: &'a mut [f32],
        cost: &'a mut [f32],
        rows: &'a Rows,
        gains: &'a [f32],
        blocks: &'a [u32],
        reading: f32,
    ) {
        let cost = cost.as_chunks_mut::<LANES>().0;
        let estimates = estimates.as_chunks_mut::<LANES>().0;
        let [scale, half, log] = [&rows.scale, &rows.half, &rows.log].map(|v| v.as_chunks::<LANES>().0);
        let [slopes, gains] = [&rows.slopes, gains].map(|v| v.as_chunks::<LANES>().0);
        let row = cost.len();
        for &block in blocks {
            let b = block as usize;
            let mut off = [0.0_f32; LANES];
            for l in 0..LANES {
                off[l] = reading * scale[b][l];
            }
            for at in (b..estimates.len()).step_by(row) {
                let (estimate, slope) = (&estimates[at], &slopes[at]);
                for l in 0..LANES {
                    off[l] -= slope[l] * estimate[l];
                }
            }
            let (cost, half, log) = (&mut cost[b], &half[b], &log[b]);
            for l in 0..LANES {
                cost[l] += off[l] * off[l] * half[l] + log[l];
            }
            for at in (b..estimates.len()).step_by(row) {
                let (estimate, gain) = (&mut estimates[at], &gains[at]);
                for l in 0..LANES {
                    estimate[l] += gain[l] * off[l];
                }
            }
        }
    }
}

wide! {
    fn fill<'a>(
        filters: &'a Filters,
        report: &'a Report<'a>,
        slopes: &'a mut [f32],
        into: [&'a mut [f32]; 5],
        force: f32,
    ) {
        for_unknowns!(filters.unknowns, fill_of(filters, report, slopes, into, force));
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn fill_of<const N: usize>(
    filters: &Filters,
    report: &Report,
    slopes: &mut [f32],
    into: [&mut [f32]; 5],
    force: f32,
) {
    let covariances = filters.covariances.as_chunks::<LANES>().0;
    let plain = [report.slopes[0], report.slopes[1], report.value];
    let mut by: [&[[f32; LANES]]; N] = [&[]; N];
    for (by, row) in by
        .iter_mut()
        .zip(plain.into_iter().chain(report.nuisances()))
    {
        *by = row.as_chunks::<LANES>().0;
    }
    let drift = filters.drift.unwrap_or(0.0);
    let variances = report.variance.as_chunks::<LANES>().0;
    let [scales, halves, logs, gains, sharps] = into.map(|v| v.as_chunks_mut::<LANES>().0);
    let slopes = slopes.as_chunks_mut::<LANES>().0;
    // Blocks of one row.
    let row = variances.len();
    for (b, variance) in variances.iter().enumerate() {
        let mut scale = [0.0_f32; LANES];
        for l in 0..LANES {
            scale[l] = (1.0 + force * force * variance[l]).sqrt().recip();
        }
        let mut rows = [[drift; LANES]; N];
        for i in 0..N {
            // Readings grow with the force; along and across change them the more, and the force itself by its unit.
            let by_force = if i == FORCE { 1.0 } else { force };
            if let Some(row) = by[i].get(b) {
                for l in 0..LANES {
                    rows[i][l] = by_force * row[l];
                }
            }
            for l in 0..LANES {
                rows[i][l] *= scale[l];
            }
            slopes[i * row + b] = rows[i];
        }
        let mut spread = [[0.0_f32; LANES]; N];
        for i in 0..N {
            for j in i..N {
                let covariance = &covariances[place_of(N, i, j) * row + b];
                for l in 0..LANES {
                    spread[i][l] += covariance[l] * rows[j][l];
                }
                if i != j {
                    for l in 0..LANES {
                        spread[j][l] += covariance[l] * rows[i][l];
                    }
                }
            }
        }
        let mut predicted = [1.0_f32; LANES];
        for i in 0..N {
            for l in 0..LANES {
                predicted[l] += rows[i][l] * spread[i][l];
            }
        }
        let force_variance = &covariances[place_of(N, FORCE, FORCE) * row + b];
        let corrected = &spread[FORCE];
        // Not written where they go at once: what may lie behind one reference is not known to lie behind no other.
        let [mut half, mut log, mut gain, mut sharp] = [[0.0_f32; LANES]; 4];
        for l in 0..LANES {
            // Never less than the noise: where signals are far above it, rounding would take more.
            let predicted = predicted[l].max(1.0);
            let share = predicted.recip();
            half[l] = 0.5 * share;
            log[l] = 0.5 * logarithm(predicted / (scale[l] * scale[l]));
            gain[l] = corrected[l] * share;
            sharp[l] = sharpness(force_variance[l] - corrected[l] * corrected[l] * share);
        }
        (scales[b], halves[b], logs[b], gains[b], sharps[b]) = (scale, half, log, gain, sharp);
    }
}
