//! The Kalman filters at all places at once, in blocks of places side by side.

use std::array::from_fn;

use crate::lanes::{exponential, logarithm, wide};
use crate::placement::expected_error::scene::{LANES, NUISANCES, Report, TouchScene};

/// Unknowns that every touch has: along, across and force.
pub(in crate::placement::expected_error) const PLAIN: usize = 3;
/// No filter has more of them: those, nuisances of the touch, and a drift.
pub(in crate::placement::expected_error) const MOST: usize = PLAIN + NUISANCES + 1;
/// Places side by side.
pub(super) type Lane = [f32; LANES];

/// Which of them is the force.
pub(super) const FORCE: usize = 2;

/// The filters at all places, for one force.
#[derive(Clone)]
pub(super) struct PlaceFilters {
    /// Unknowns of each.
    unknowns: usize,
    /// Upper triangles of the covariances, block by block: of along, across, force, and what else there is to find.
    covariances: Vec<Lane>,
    /// What a drift reads of one deviation; nothing where none is to be found.
    drift: Option<f32>,
}

/// What a site's reading does to the filters at all places, for one force.
pub(super) struct FilterRows {
    /// Block by block: of the reading over its deviation, by each unknown.
    slopes: Vec<Lane>,
    /// Of each block.
    said: Vec<BlockReading>,
}

/// What there is to know of a reading at the places of a block, whatever it is.
#[derive(Clone)]
struct BlockReading {
    /// One over the deviation.
    scale: Lane,
    /// Half over the variance of what is predicted, and the logarithm that belongs to it.
    half: Lane,
    log: Lane,
    /// By how much the force is corrected, and one over its deviation after that.
    gain: Lane,
    sharpness: Lane,
}

impl BlockReading {
    const NOTHING: Self = Self {
        scale: [0.0; LANES],
        half: [0.0; LANES],
        log: [0.0; LANES],
        gain: [0.0; LANES],
        sharpness: [0.0; LANES],
    };
}

impl PlaceFilters {
    /// Before anything is read, at the places of a scene: within their reach (filled up with 1), with a force of some
    /// variance, and all else of unit variance.
    pub(super) fn new(scene: &TouchScene, reaches: &[Lane], force: f32) -> Self {
        let unknowns = PLAIN + scene.unknowns.len();
        let entry = |reaches: &Lane, (i, j): (usize, usize)| match i {
            _ if i != j => [0.0; LANES],
            FORCE => [force; LANES],
            _ if i < FORCE => reaches.map(|r| r * r),
            _ => [1.0; LANES],
        };
        let block = |reaches| entries(unknowns).map(move |at| entry(reaches, at));
        Self {
            unknowns,
            covariances: reaches.iter().flat_map(block).collect(),
            drift: scene
                .unknowns
                .iter()
                .find_map(|u| u.drift())
                .map(|d| d as f32),
        }
    }

    fn blocks(&self) -> usize {
        self.covariances.len() / triangle(self.unknowns)
    }

    /// Room for what a reading does to them.
    pub(super) fn rows(&self) -> FilterRows {
        let blocks = self.blocks();
        FilterRows {
            slopes: vec![[0.0; LANES]; self.unknowns * blocks],
            said: vec![BlockReading::NOTHING; blocks],
        }
    }

    /// What is to be known of no reading at all.
    pub(super) fn unread(&self) -> FilterRows {
        let mut rows = self.rows();
        let blocks = self.covariances.chunks_exact(triangle(self.unknowns));
        for (said, covariance) in rows.said.iter_mut().zip(blocks) {
            said.sharpness = covariance[place_of(self.unknowns, FORCE, FORCE)].map(sharpness);
        }
        rows
    }
}

/// Entries of an upper triangle, as they are kept.
pub(super) fn entries(unknowns: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..unknowns).flat_map(move |i| (i..unknowns).map(move |j| (i, j)))
}

/// How many there are.
pub(super) const fn triangle(unknowns: usize) -> usize {
    unknowns * (unknowns + 1) / 2
}

/// Where the entry (i, j) is kept.
pub(super) const fn place_of(unknowns: usize, i: usize, j: usize) -> usize {
    let (i, j) = if i < j { (i, j) } else { (j, i) };
    i * unknowns + j - i * (i + 1) / 2
}

/// A covariance of some filters side by side, by row and column: looked up before it is used, so that no loop over places
/// has to ask whether an entry is there.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
pub(super) fn square<const N: usize, T>(triangle: &[T]) -> [[&T; N]; N] {
    from_fn(|i| from_fn(|j| &triangle[place_of(N, i, j)]))
}

/// One over the deviation; nothing where there is none to know.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn sharpness(variance: f32) -> f32 {
    if variance > 0.0 {
        variance.sqrt().recip()
    } else {
        0.0
    }
}

fn folded(lanes: [Lane; 4]) -> [f64; 4] {
    lanes.map(|lane| {
        let mut all = lane.map(f64::from);
        let mut count = LANES;
        while count > 1 {
            count /= 2;
            for l in 0..count {
                all[l] += all[l + count];
            }
        }
        all[0]
    })
}

/// Calls a function for as many unknowns as there are, so that its loops over them are unrolled.
///
/// In these functions all that is computed of one place stands in one loop over the places of a block, and goes into
/// arrays of that loop's own: it is what compilers make vectors of. What may lie behind one reference is not known to lie
/// behind no other.
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
pub(super) use for_unknowns;

/// What is thought of a press at some places.
pub(super) struct Thought<'a> {
    /// Block by block, of each unknown.
    pub estimates: &'a [Lane],
    /// What each place costs, before a reading.
    pub costs: &'a [Lane],
    /// Blocks that may still be meant.
    pub blocks: &'a [u32],
}

wide! {
    /// The probability (over that of the true place) and its first moments, summed over some blocks of places, with a
    /// reading; `own` is the cost of the true place.
    pub(super) fn sum_masses_with<'a>(
        unknowns: usize,
        thought: Thought<'a>,
        rows: &'a FilterRows,
        positions: &'a [[Lane; 3]],
        reading: f32,
        own: f32,
    ) -> [f64; 4] {
        for_unknowns!(unknowns, sum_of(&thought, rows, positions, reading, own))
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn sum_of<const N: usize>(
    thought: &Thought,
    rows: &FilterRows,
    positions: &[[Lane; 3]],
    reading: f32,
    own: f32,
) -> [f64; 4] {
    let mut sums = [[0.0_f32; LANES]; 4];
    let [estimates, slopes] = [thought.estimates, &rows.slopes].map(|v| v.as_chunks::<N>().0);
    for &block in thought.blocks {
        let b = block as usize;
        let (estimates, slopes, cost) = (&estimates[b], &slopes[b], &thought.costs[b]);
        let (said, [x, y, z]) = (&rows.said[b], &positions[b]);
        for l in 0..LANES {
            let mut predicted = 0.0;
            for i in 0..N {
                predicted += slopes[i][l] * estimates[i][l];
            }
            let off = reading * said.scale[l] - predicted;
            let pulls = ((estimates[FORCE][l] + said.gain[l] * off) * said.sharpness[l]).min(0.0);
            let costs = cost[l] + off * off * said.half[l] + said.log[l] + 0.5 * pulls * pulls;
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
    /// Takes a reading into account at the places of some blocks: what is thought of each unknown there (block by block),
    /// and what places cost.
    pub(super) fn correct<'a>(
        unknowns: usize,
        estimates: &'a mut [Lane],
        costs: &'a mut [Lane],
        rows: &'a FilterRows,
        gains: &'a [Lane],
        blocks: &'a [u32],
        reading: f32,
    ) {
        for_unknowns!(unknowns, correct_of(estimates, costs, rows, gains, blocks, reading));
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn correct_of<const N: usize>(
    estimates: &mut [Lane],
    costs: &mut [Lane],
    rows: &FilterRows,
    gains: &[Lane],
    blocks: &[u32],
    reading: f32,
) {
    let estimates = estimates.as_chunks_mut::<N>().0;
    let [slopes, gains] = [&rows.slopes, gains].map(|v| v.as_chunks::<N>().0);
    for &block in blocks {
        let b = block as usize;
        let (slopes, gains, said) = (&slopes[b], &gains[b], &rows.said[b]);
        let (mut estimate, mut cost) = (estimates[b], costs[b]);
        for l in 0..LANES {
            let mut off = reading * said.scale[l];
            for i in 0..N {
                off -= slopes[i][l] * estimate[i][l];
            }
            cost[l] += off * off * said.half[l] + said.log[l];
            for i in 0..N {
                estimate[i][l] += gains[i][l] * off;
            }
        }
        (estimates[b], costs[b]) = (estimate, cost);
    }
}

wide! {
    /// Fills in what a reading of presses of some force (N) does to the filters at all places.
    pub(super) fn predict<'a>(
        filters: &'a PlaceFilters,
        report: &'a Report<'a>,
        force: f32,
        rows: &'a mut FilterRows,
    ) {
        for_unknowns!(filters.unknowns, predict_of(filters, report, force, rows));
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn predict_of<const N: usize>(
    filters: &PlaceFilters,
    report: &Report,
    force: f32,
    rows: &mut FilterRows,
) {
    let plain = [report.slopes[0], report.slopes[1], report.value];
    let drift = [filters.drift.unwrap_or(0.0); LANES];
    let mut by: [&[Lane]; N] = [&[]; N];
    // Readings grow with the force; along and across change them the more, and the force itself by its unit. A drift is
    // what it is.
    let mut times = [1.0; N];
    let of_touch = plain.into_iter().chain(report.nuisances());
    for (i, ((by, times), row)) in by.iter_mut().zip(&mut times).zip(of_touch).enumerate() {
        *by = row.as_chunks::<LANES>().0;
        *times = if i == FORCE { 1.0 } else { force };
    }
    let variances = report.variance.as_chunks::<LANES>().0;
    let blocks = filters.covariances.chunks_exact(triangle(N));
    let slopes = rows.slopes.as_chunks_mut::<N>().0.iter_mut();
    let out = slopes.zip(&mut rows.said);
    for (b, ((covariance, variance), (slopes, said))) in blocks.zip(variances).zip(out).enumerate()
    {
        let by: [&Lane; N] = from_fn(|i| by[i].get(b).unwrap_or(&drift));
        let covariance = square::<N, Lane>(covariance);
        let mut own_slopes = [[0.0; LANES]; N];
        let mut own = BlockReading::NOTHING;
        for l in 0..LANES {
            let scale = (1.0 + force * force * variance[l]).sqrt().recip();
            let mut row = [0.0; N];
            for i in 0..N {
                row[i] = times[i] * by[i][l] * scale;
                own_slopes[i][l] = row[i];
            }
            let mut predicted = 1.0;
            let mut corrected = 0.0;
            for i in 0..N {
                let mut spread = 0.0;
                for j in 0..N {
                    spread += covariance[i][j][l] * row[j];
                }
                predicted += row[i] * spread;
                if i == FORCE {
                    corrected = spread;
                }
            }
            // Never less than the noise: where signals are far above it, rounding would take more.
            let predicted = predicted.max(1.0);
            let share = predicted.recip();
            own.scale[l] = scale;
            own.half[l] = 0.5 * share;
            own.log[l] = 0.5 * logarithm(predicted / (scale * scale));
            own.gain[l] = corrected * share;
            let known = covariance[FORCE][FORCE][l];
            own.sharpness[l] = sharpness(known - corrected * corrected * share);
        }
        (*slopes, *said) = (own_slopes, own);
    }
}

/// By how much the filters at all places correct each unknown, block by block.
pub(super) fn corrections(filters: &PlaceFilters, rows: &FilterRows) -> Vec<Lane> {
    let mut gains = vec![[0.0; LANES]; rows.slopes.len()];
    gains_into(filters, rows, &mut gains);
    gains
}

wide! {
    fn gains_into<'a>(filters: &'a PlaceFilters, rows: &'a FilterRows, gains: &'a mut [Lane]) {
        for_unknowns!(filters.unknowns, gains_of(filters, rows, gains));
    }
}

#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
fn gains_of<const N: usize>(filters: &PlaceFilters, rows: &FilterRows, gains: &mut [Lane]) {
    let blocks = filters.covariances.chunks_exact(triangle(N));
    let rows = rows.slopes.as_chunks::<N>().0.iter().zip(&rows.said);
    for ((covariance, (slopes, said)), gains) in blocks.zip(rows).zip(gains.as_chunks_mut().0) {
        let covariance = square::<N, Lane>(covariance);
        let mut own = [[0.0; LANES]; N];
        for l in 0..LANES {
            for i in 0..N {
                let mut spread = 0.0;
                for j in 0..N {
                    spread += covariance[i][j][l] * slopes[j][l];
                }
                own[i][l] = spread * (2.0 * said.half[l]);
            }
        }
        *gains = own;
    }
}

wide! {
    /// What a reading leaves of the filters' covariances at all places.
    pub(super) fn shrink<'a>(filters: &'a mut PlaceFilters, rows: &'a FilterRows, gains: &'a [Lane]) {
        let unknowns = filters.unknowns;
        let blocks = filters.covariances.chunks_exact_mut(triangle(unknowns));
        let gains = gains.chunks_exact(unknowns);
        for ((covariance, said), gains) in blocks.zip(&rows.said).zip(gains) {
            let mut share = [0.0; LANES];
            for l in 0..LANES {
                // Nothing where so much was predicted that half over it is no number any more.
                share[l] = (2.0 * said.half[l]).max(f32::MIN_POSITIVE);
            }
            for ((i, j), entry) in entries(unknowns).zip(covariance) {
                let mut own = *entry;
                for l in 0..LANES {
                    own[l] -= gains[i][l] * gains[j][l] / share[l];
                }
                *entry = own;
            }
        }
    }
}
