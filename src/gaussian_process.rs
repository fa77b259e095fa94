//! The paper's Gaussian process over the surface: what a gauge here says about the deformation there.
//!
//! k(x, x') = exp(-(d / l)^p) with the distance d over the surface, and β⁻¹ added to the variance of what
//! is measured. On a curved or slotted surface, or for p near two, this need not be a covariance: the
//! spectrum is looked at, and what is negative is clipped and said.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;
use serde::Serialize;

use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::pca::gram;

/// Parameters of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GpKernel {
    /// l (m).
    pub length_m: f64,
    /// p.
    pub power: f64,
    /// β⁻¹, in units of the variance of the field.
    pub noise: f64,
}

impl Default for GpKernel {
    /// The paper's.
    fn default() -> Self {
        Self {
            length_m: 0.033,
            power: 1.9,
            noise: 1e-3,
        }
    }
}

impl GpKernel {
    /// k at a distance (m).
    #[must_use]
    pub fn at(&self, distance: f64) -> f64 {
        if distance.is_finite() {
            (-(distance / self.length_m).powf(self.power)).exp()
        } else {
            0.0
        }
    }

    /// k between all of so many places; a distance (m) is the same both ways, and is looked at once.
    fn between_all(&self, count: usize, distance: impl Fn(usize, usize) -> f64 + Sync) -> Mat<f64> {
        let mut values = vec![0.0; count * count];
        values
            .par_chunks_exact_mut(count.max(1))
            .enumerate()
            .for_each(|(i, row)| {
                for (j, v) in row[..=i].iter_mut().enumerate() {
                    *v = self.at(distance(i, j));
                }
            });
        Mat::from_fn(count, count, |i, j| values[i.max(j) * count + i.min(j)])
    }
}

/// Symmetric distances between all locations (m), by rows; infinite between separate pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct Distances {
    count: usize,
    values: Vec<f64>,
    /// How they were measured, for people.
    pub kind: &'static str,
}

impl Distances {
    /// From any measure; the two directions are averaged.
    #[must_use]
    pub fn new(count: usize, kind: &'static str, measured: &[f64]) -> Self {
        let mean = |i: usize, j: usize| 0.5 * (measured[i * count + j] + measured[j * count + i]);
        let values = (0..count)
            .flat_map(|i| (0..count).map(move |j| (i, j)))
            .map(|(i, j)| if i == j { 0.0 } else { mean(i, j) })
            .collect();
        Self {
            count,
            values,
            kind,
        }
    }

    /// How many locations there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Between locations i and j (m).
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.values[i * self.count + j]
    }

    /// Between which lengths (m) of a kernel distances say anything: far below the nearest two locations, and far above
    /// those farthest apart, all lengths are the same.
    #[must_use]
    pub fn meaningful(&self) -> [f64; 2] {
        const BELOW: f64 = 0.2;
        const ABOVE: f64 = 20.0;
        let apart = || {
            self.values
                .iter()
                .copied()
                .filter(|d| *d > 0.0 && d.is_finite())
        };
        [
            BELOW * apart().fold(f64::INFINITY, f64::min),
            ABOVE * apart().fold(0.0, f64::max),
        ]
    }

    /// Locations nearer than `within` (m) to one of lower number.
    #[must_use]
    pub fn coinciding(&self, within: f64) -> usize {
        (0..self.count)
            .filter(|&i| (0..i).any(|j| self.at(i, j) < within))
            .count()
    }
}

/// A covariance between locations that has no negative part.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Without β⁻¹.
    pub k: Mat<f64>,
    /// β⁻¹: variance of a measurement's noise over the field's.
    pub noise: f64,
    /// Share of the spectrum that was negative and set to zero.
    pub clipped: f64,
}

/// A negative part below this is rounding.
const ROUNDING: f64 = 1e-9;

impl Covariance {
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(distances: &Distances, kernel: &GpKernel, watch: Watch) -> Result<Self, Cancelled> {
        report(watch, STAGE, 0, 3)?;
        let n = distances.count();
        let k = kernel.between_all(n, |i, j| distances.at(i, j));
        report(watch, STAGE, 1, 3)?;
        let noise = kernel.noise.max(0.0);
        // A factor is thirty times cheaper than a spectrum, and there is one if nothing is negative.
        let mut shifted = k.clone();
        for i in 0..n {
            shifted[(i, i)] += ROUNDING * n as f64;
        }
        if shifted.llt(Side::Lower).is_ok() {
            return Ok(Self {
                k,
                noise,
                clipped: 0.0,
            });
        }
        report(watch, STAGE, 2, 3)?;
        Ok(Self::clip(k, noise))
    }

    fn clip(k: Mat<f64>, noise: f64) -> Self {
        let n = k.nrows();
        let Ok(eigen) = k.self_adjoint_eigen(Side::Lower) else {
            return Self {
                k,
                noise,
                clipped: f64::NAN,
            };
        };
        let values: Vec<f64> = (0..n).map(|i| eigen.S().column_vector()[i]).collect();
        let negative: Vec<usize> = (0..n).filter(|&i| values[i] < 0.0).collect();
        let all: f64 = values.iter().map(|v| v.abs()).sum();
        let clipped = negative.iter().map(|&i| -values[i]).sum::<f64>() / all;
        // Adding back what is negative is cheaper than building the rest anew.
        let part = Mat::from_fn(n, negative.len(), |i, c| {
            eigen.U()[(i, negative[c])] * (-values[negative[c]]).sqrt()
        });
        let k = &k + &part * part.transpose();
        Self { k, noise, clipped }
    }

    /// What must be known before trusting choices made with it.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        /// Below this share it is rounding and the last digits of distances.
        const NEGLIGIBLE: f64 = 5e-5;
        if self.clipped > NEGLIGIBLE || self.clipped.is_nan() {
            vec![format!(
                "The kernel is no covariance on this surface: {:.2} % of its spectrum was negative and was set to zero. A smaller power gives a sounder model.",
                100.0 * self.clipped
            )]
        } else {
            Vec::new()
        }
    }
}

const STAGE: &str = "Covariance of the sites";

/// One point of the search: the kernel and the rms error of predicting sites left out, as a share of the
/// signals' own rms about their mean over the sites.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GpTrial {
    /// The kernel.
    pub kernel: GpKernel,
    /// Its error, as a share.
    pub error: f64,
}

/// Lengths that the search looks at first; while the best is at an end of them it goes on there.
pub const LENGTHS_M: [f64; 9] = [0.004, 0.007, 0.012, 0.018, 0.025, 0.033, 0.045, 0.065, 0.1];
/// Powers that the search tries.
pub const POWERS: [f64; 6] = [0.8, 1.0, 1.3, 1.6, 1.9, 2.0];
/// Most sites that the search uses.
const SEARCHED: usize = 500;

/// Signals that kernels are tried on: parts of the sites are left out and predicted from the others under every
/// touch (signals standardized over all).
struct TriedSignals<'a> {
    distances: &'a Distances,
    used: Vec<usize>,
    gram: Mat<f64>,
}

impl<'a> TriedSignals<'a> {
    fn new(x: &SignalMatrix, distances: &'a Distances) -> Self {
        let used: Vec<usize> = crate::regression::folds::evenly(x.rows(), SEARCHED);
        let scale = x.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let signals = x.select_rows(&used);
        let gram = gram(&signals.scaled(if scale > 0.0 { scale.recip() } else { 1.0 }));
        Self {
            distances,
            used,
            gram,
        }
    }

    /// All powers at these lengths (m).
    fn all(&self, lengths: &[f64], noise: f64, watch: Watch) -> Result<Vec<GpTrial>, Cancelled> {
        let of = |&length_m: &f64| {
            POWERS.map(|power| GpKernel {
                length_m,
                power,
                noise,
            })
        };
        let grid: Vec<GpKernel> = lengths.iter().flat_map(of).collect();
        grid.par_iter()
            .map(|kernel| {
                report(watch, "Fitting the Gaussian process", 0, 1)?;
                Ok(self.with(kernel))
            })
            .collect()
    }

    fn with(&self, kernel: &GpKernel) -> GpTrial {
        /// Every how manyth site is left out at once.
        const FOLDS: usize = 5;
        let used = &self.used;
        let k = kernel.between_all(used.len(), |i, j| self.distances.at(used[i], used[j]));
        let (mut wrong, mut all) = (0.0, 0.0);
        for fold in 0..FOLDS {
            let (test, train): (Vec<usize>, Vec<usize>) =
                (0..used.len()).partition(|i| i % FOLDS == fold);
            let (w, a) = prediction_error(&self.gram, &k, kernel.noise, &train, &test);
            wrong += w;
            all += a;
        }
        GpTrial {
            kernel: *kernel,
            error: (wrong / all).sqrt(),
        }
    }
}

/// One kernel tried as [`search`] tries those of its grid. Of a kernel that is no covariance between the sites the
/// error is no number.
#[must_use]
pub fn trial(x: &SignalMatrix, distances: &Distances, kernel: &GpKernel) -> GpTrial {
    TriedSignals::new(x, distances).with(kernel)
}

/// Cross-validated grid search. Returns the map, by rising length and power. Where the best length is the first or the
/// last of [`LENGTHS_M`], which are those of a limb, it goes on beyond it, as far as distances say anything.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn search(
    x: &SignalMatrix,
    distances: &Distances,
    noise: f64,
    watch: Watch,
) -> Result<Vec<GpTrial>, Cancelled> {
    /// Lengths tried at once, each longer or shorter than the one before by this ratio.
    const MORE: i32 = 3;
    const RATIO: f64 = 1.5;
    let tried = TriedSignals::new(x, distances);
    let mut map = tried.all(&LENGTHS_M, noise, watch)?;
    let [least, most] = distances.meaningful();
    while let (Some(best), Some(first), Some(last)) = (best(&map), map.first(), map.last()) {
        let [first, last] = [first, last].map(|t| t.kernel.length_m);
        let beyond = |end: f64, sign: i32| (1..=MORE).map(move |k| end * RATIO.powi(sign * k));
        if best.length_m == first && first > least {
            let mut shorter: Vec<f64> = beyond(first, -1).collect();
            shorter.reverse();
            map.splice(0..0, tried.all(&shorter, noise, watch)?);
        } else if best.length_m == last && last < most {
            let longer: Vec<f64> = beyond(last, 1).collect();
            map.extend(tried.all(&longer, noise, watch)?);
        } else {
            break;
        }
    }
    Ok(map)
}

/// Words where the best length or power is an end of what was tried, which says no more than that it lies beyond. That
/// a power is two is none: above it there is no covariance.
#[must_use]
pub fn edge_notes(map: &[GpTrial]) -> Vec<String> {
    let (Some(best), Some(first), Some(last)) = (best(map), map.first(), map.last()) else {
        return Vec::new();
    };
    let far = if best.length_m == first.kernel.length_m {
        Some("short: sites say next to nothing of each other")
    } else if best.length_m == last.kernel.length_m {
        Some("long: all sites say nearly the same")
    } else {
        None
    };
    let length = far.map(|far| {
        format!(
            "The kernel's length is at the end of what was tried ({} mm), so {far}. Check the unit of the sites.",
            crate::plain::digits(crate::units::mm(best.length_m))
        )
    });
    let rough = (best.power == POWERS[0]).then(|| {
        format!(
            "The kernel's power is the lowest that was tried ({}): even sites that lie close say different things, as where noise is large or sites are given in the wrong order.",
            POWERS[0]
        )
    });
    length.into_iter().chain(rough).collect()
}

/// The kernel with the smallest error.
#[must_use]
pub fn best(trials: &[GpTrial]) -> Option<GpKernel> {
    trials
        .iter()
        .filter(|t| t.error.is_finite())
        .min_by(|a, b| a.error.total_cmp(&b.error))
        .map(|t| t.kernel)
}

/// Squared errors of predicting the test sites from the training sites over all touches, by a kernel between them
/// and its noise, and the squares of the test signals about the training mean. Only products of signals are
/// needed: with weights W (test × train) the prediction is μ + W (x - μ), μ the mean over the training sites.
fn prediction_error(
    gram: &Mat<f64>,
    k: &Mat<f64>,
    noise: f64,
    train: &[usize],
    test: &[usize],
) -> (f64, f64) {
    let (n, m) = (train.len(), test.len());
    // Where the kernel is no covariance the noise may be too little: such a kernel has no error.
    let own = Mat::from_fn(n, n, |i, j| {
        k[(train[i], train[j])] + if i == j { noise.max(ROUNDING) } else { 0.0 }
    });
    let cross = Mat::from_fn(n, m, |i, j| k[(train[i], test[j])]);
    let Ok(factor) = own.llt(Side::Lower) else {
        return (f64::NAN, 1.0);
    };
    let weights = factor.solve(&cross);
    // Prediction as a linear map of the training signals, the mean included.
    let rest = |j: usize| 1.0 - (0..n).map(|r| weights[(r, j)]).sum::<f64>();
    let rest: Vec<f64> = (0..m).map(rest).collect();
    let map = Mat::from_fn(n, m, |i, j| weights[(i, j)] + rest[j] / n as f64);
    let inner = Mat::from_fn(n, n, |i, j| gram[(train[i], train[j])]);
    let outer = Mat::from_fn(n, m, |i, j| gram[(train[i], test[j])]);
    let spread = &inner * &map;
    let mean_square = (0..n)
        .map(|i| (0..n).map(|j| inner[(i, j)]).sum::<f64>())
        .sum::<f64>()
        / (n * n) as f64;
    let (mut wrong, mut all) = (0.0, 0.0);
    for j in 0..m {
        let own = gram[(test[j], test[j])];
        let mut error = own;
        let mut with_mean = 0.0;
        for i in 0..n {
            error += map[(i, j)] * (spread[(i, j)] - 2.0 * outer[(i, j)]);
            with_mean += outer[(i, j)] / n as f64;
        }
        wrong += error.max(0.0);
        all += own - 2.0 * with_mean + mean_square;
    }
    (wrong, all)
}

#[cfg(test)]
mod tests;
