//! How gauges were really glued, from a few touches whose place and force are known.
//!
//! A gauge that is off by a little reads f·bᵀθ of a touch, with b = (g, ∂g/∂s, ∂g/∂t, ∂g/∂φ) at its place and θ = (gain,
//! millimetres along and across, degrees). Known presses are off themselves: a hand is a millimetre beside the place and
//! some per cent too hard. So each press k has unknowns of its own, u = (two steps along the surface, a share of
//! the force; the tip's radius, and two shares of it along the surface, where these are off), and with the slopes J over
//! them
//!
//! ```text
//! x = B θ + J u + n,    u ~ N(0, S),  n ~ N(0, D)        (all channels of one press)
//! ```
//!
//! which is the model of errors in variables, linearized as by F. R. Helmert (Die Ausgleichungsrechnung nach der Methode
//! der kleinsten Quadrate, 1872; W. A. Fuller, Measurement Error Models, 1987). With u integrated out the residuals of a
//! press are correlated over the channels,
//!
//! ```text
//! V = D + J S Jᵀ + δ² 1 1ᵀ,      (P + Σ Bᵀ V⁻¹ B) (θ - θ₀) = Σ Bᵀ V⁻¹ (x - B θ₀),
//! ```
//!
//! with δ a common drift, θ₀ = (1, 0, 0, 0) and the prior P that the workshop's gluing is: least squares of all gauges
//! together. J depends on θ and is taken anew a few times. One unknown more is the factor by which the part is stiffer
//! or softer, which all gauges share.
//!
//! D has a share of the readings that model and elements leave. Its size is where the squares of all residuals
//! r = x - B θ₀, rᵀ(V + B P⁻¹ Bᵀ)⁻¹r, are as many as there are readings; what the elements are estimated to leave counts
//! as some readings more, because a few presses say little of it. What is not known afterwards is the inverse of the normal
//! matrix: never more than before, so that presses that say nothing leave everything as it was.

pub mod judged;
pub mod likeliest;
pub mod part;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix4, Vector4};
use serde::{Deserialize, Serialize};

use super::drawn::{
    AsDrawn, AsGlued, GluingCovariance, covariance, gluing_covariance, upper_triangle,
};
use super::map::{ResponseMap, Slope};
use super::matching::ReadingErrors;
use crate::mesh::SurfacePoint;
use crate::uncertainty::Uncertainty;

/// A touch that was put where it was asked for, or nearly: see [`crate::uncertainty::HandPressing`].
#[derive(Clone, Debug, PartialEq)]
pub struct KnownPress {
    /// Where it was asked for.
    pub at: SurfacePoint,
    /// N.
    pub force: f64,
    /// Strain, a channel each: the mean of [`SAMPLES`]. No number of a channel that could not be trusted then.
    pub reading: Vec<f64>,
}

/// What was learned from known touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// How the gauge of each channel is glued.
    pub glued: Vec<AsGlued>,
    /// What is not known of these.
    pub doubts: Vec<GluingCovariance>,
    /// Standard deviation of each gain.
    pub deviations: Vec<f64>,
    /// What is still off beside that, over the reading; see [`ReadingErrors::relative`].
    pub relative: f64,
    /// Known touches it was learned from.
    pub touches: usize,
}

/// Samples that the reading of a known touch is the mean of: whoever takes one, and whoever foresees what known touches
/// will show, takes as many.
pub const SAMPLES: usize = 9;

/// Noise of such a mean (strain), by that of a sample, channel by channel.
#[must_use]
pub fn noise_of_mean(noise: &[f64]) -> Vec<f64> {
    noise.iter().map(|n| n / (SAMPLES as f64).sqrt()).collect()
}

/// Model and gauges are never trusted better than this.
const LEAST: f64 = 0.002;
/// Channels that a touch must have been read by: place and force are three numbers.
const FEWEST: usize = 3;
/// Variance of a channel that was not read (strain²): it says nothing.
const UNREAD: f64 = 1.0;
/// Times that the slopes are taken at what was found.
const TURNS: usize = 3;
/// Readings that the estimate of the elements' error counts for.
const BEFORE: f64 = 10.0;

/// Fits all channels to known touches with this noise of a sample (strain, a channel each); `off` is what is known of everything
/// else that is off. Channels that read no numbers say nothing, nor do touches of which hardly any channel does.
#[must_use]
pub fn calibrate(
    drawn: &AsDrawn,
    known: &[KnownPress],
    noise: &[f64],
    off: &Uncertainty,
) -> Calibration {
    let noise = &noise_of_mean(noise);
    let known = sound(known);
    let Fitted {
        glued,
        relative,
        fit,
    } = fitted(drawn, &known, noise, off);
    let channels = noise.len();
    let doubts = fit.map_or_else(
        || vec![gluing_covariance(&off.gluing); channels],
        |fit| fit.doubts(channels),
    );
    Calibration {
        glued,
        deviations: doubts.iter().map(|d| d[0].max(0.0).sqrt()).collect(),
        doubts,
        relative,
        touches: known.len(),
    }
}

/// The touches that enough channels have read.
fn sound(known: &[KnownPress]) -> Vec<&KnownPress> {
    let read = |k: &&KnownPress| k.reading.iter().filter(|x| x.is_finite()).count() >= FEWEST;
    known.iter().filter(read).collect()
}

/// What was fitted, with the share of the readings that the model leaves.
struct Fitted {
    glued: Vec<AsGlued>,
    relative: f64,
    /// Nothing where numbers overflow.
    fit: Option<CalibrationFit>,
}

/// By the noise of each press (strain, a channel each).
fn fitted(drawn: &AsDrawn, known: &[&KnownPress], noise: &[f64], off: &Uncertainty) -> Fitted {
    let mut fitted = Fitted {
        glued: vec![AsGlued::DRAWN; noise.len()],
        relative: off.elements.max(LEAST),
        fit: None,
    };
    for _ in 0..TURNS {
        let presses: Vec<ComparedPress> = (known.iter())
            .map(|k| ComparedPress::new(drawn, k, &fitted.glued, off))
            .collect();
        let least = Least {
            presses: &presses,
            noise,
            off,
        };
        fitted.relative = least.share_left();
        let Some(fit) = least.fit(fitted.relative) else {
            break;
        };
        fitted.glued = fit.glued();
        fitted.fit = Some(fit);
    }
    fitted
}

/// Unknowns of one gauge: gain, along, across, turned.
const PER_GAUGE: usize = 4;

/// One press, ready to be compared.
struct ComparedPress {
    /// What is expected, of channels that were not read.
    reading: Vec<f64>,
    read: Vec<bool>,
    /// What each of θ says of each channel.
    basis: Vec<Vector4<f64>>,
    /// Slopes over the place and the share of the force, and over all else that is off with the way it was made, each
    /// times its standard deviation: channels × these.
    moved: DMatrix<f64>,
}

impl ComparedPress {
    fn new(drawn: &AsDrawn, known: &KnownPress, glued: &[AsGlued], off: &Uncertainty) -> Self {
        let basis = drawn.basis(known.at);
        let pairs = known.reading.iter().zip(&basis);
        let or_expected = |(x, b): (&f64, &Vector4<f64>)| {
            if x.is_finite() {
                *x
            } else {
                known.force * b[0]
            }
        };
        let read_or_expected = pairs.map(or_expected).collect();
        let Slope {
            reading, change, ..
        } = drawn.slope(known.at, glued);
        // In any direction: half of the square along each of two.
        let place = off.pressing.place / 2.0_f64.sqrt() * known.force;
        let force = off.pressing.force * known.force;
        let made = drawn.nuisances(off.making_of_presses()).at(known.at);
        Self {
            reading: read_or_expected,
            read: known.reading.iter().map(|x| x.is_finite()).collect(),
            basis: basis.into_iter().map(|b| b * known.force).collect(),
            moved: DMatrix::from_fn(reading.len(), 3 + made.len(), |c, k| match k {
                0 => place * change[c].x,
                1 => place * change[c].y,
                2 => force * reading[c],
                _ => known.force * made[k - 3].reading[c],
            }),
        }
    }

    /// As drawn, on a part as stiff as its model.
    fn expected(&self) -> DVector<f64> {
        DVector::from_iterator(self.basis.len(), self.basis.iter().map(|b| b[0]))
    }

    /// Covariance of its residuals, factored.
    fn covariance(&self, errors: &ReadingErrors, drift: f64) -> Option<Cholesky<f64, Dyn>> {
        let weights = errors.weights(&self.reading, &self.read);
        let mut covariance = &self.moved * self.moved.transpose();
        covariance.add_scalar_mut(drift * drift);
        for (c, w) in weights.iter().enumerate() {
            covariance[(c, c)] += if self.read[c] { w.recip() } else { UNREAD };
        }
        covariance.cholesky()
    }

    /// The unknowns that a channel's reading depends on, and by how much: its own four, and the common factor.
    fn unknowns(&self, channel: usize) -> [(usize, f64); PER_GAUGE + 1] {
        let basis = &self.basis[channel];
        std::array::from_fn(|k| {
            if k == PER_GAUGE {
                (PER_GAUGE * self.basis.len(), basis[0])
            } else {
                (PER_GAUGE * channel + k, basis[k])
            }
        })
    }

    /// Adds what it says to the normal equations; its weighted squares.
    fn add_to(
        &self,
        normal: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
        inverse: &DMatrix<f64>,
    ) -> f64 {
        let left = DVector::from_column_slice(&self.reading) - self.expected();
        let weighed = inverse * &left;
        let rows: Vec<_> = (0..self.basis.len()).map(|c| self.unknowns(c)).collect();
        for (a, row) in rows.iter().enumerate() {
            for &(i, by) in row {
                right[i] += by * weighed[a];
                for (b, other) in rows.iter().enumerate() {
                    for &(j, and) in other {
                        normal[(i, j)] += by * inverse[(a, b)] * and;
                    }
                }
            }
        }
        left.dot(&weighed)
    }
}

/// The least squares of all presses.
struct Least<'a> {
    presses: &'a [ComparedPress],
    noise: &'a [f64],
    off: &'a Uncertainty,
}

/// What they say.
struct CalibrationFit {
    /// Of θ - θ₀, channel by channel, and of the common factor.
    found: DVector<f64>,
    /// The normal matrix.
    normal: Cholesky<f64, Dyn>,
    /// Weighted squares of all residuals, with those that the unknowns were drawn for.
    squares: f64,
}

impl Least<'_> {
    /// Solves with a share of the readings that the model leaves; nothing where numbers overflow.
    fn fit(&self, relative: f64) -> Option<CalibrationFit> {
        let errors = ReadingErrors {
            relative,
            ..ReadingErrors::of_noises(self.noise)
        };
        let mut normal = DMatrix::from_diagonal(&self.prior());
        let mut right = DVector::zeros(normal.nrows());
        let mut squares = 0.0;
        for press in self.presses {
            let inverse = press.covariance(&errors, self.off.drift)?.inverse();
            squares += press.add_to(&mut normal, &mut right, &inverse);
        }
        let normal = normal.cholesky()?;
        let found = normal.solve(&right);
        squares -= found.dot(&right);
        let sound = squares.is_finite() && found.iter().all(|v| v.is_finite());
        sound.then_some(CalibrationFit {
            found,
            normal,
            squares,
        })
    }

    /// One over the variance of every unknown before anything is read.
    fn prior(&self) -> DVector<f64> {
        /// Nothing is known better than this (shares, millimetres, degrees).
        const SURE: f64 = 1e-6;
        let gauge = covariance(&gluing_covariance(&self.off.gluing)).diagonal();
        let channels = self.noise.len();
        let variance = |k: usize| {
            if k == PER_GAUGE * channels {
                self.off.stiffness.powi(2)
            } else {
                gauge[k % PER_GAUGE]
            }
        };
        DVector::from_fn(PER_GAUGE * channels + 1, |k, _| {
            variance(k).max(SURE * SURE).recip()
        })
    }

    /// The share of the readings that the model leaves: where residuals are as large as they ought to be.
    fn share_left(&self) -> f64 {
        let read = self.presses.iter().flat_map(|p| &p.read);
        let readings = read.filter(|r| **r).count() as f64;
        let estimated = self.off.elements.max(LEAST);
        let excess = |relative: f64| {
            let squares = self.fit(relative).map_or(readings, |fit| fit.squares);
            squares - readings + BEFORE * ((estimated / relative).powi(2) - 1.0)
        };
        zero_of(excess)
    }
}

impl CalibrationFit {
    /// How each gauge is glued, with the factor that all share.
    fn glued(&self) -> Vec<AsGlued> {
        let common = 1.0 + self.found[self.found.len() - 1];
        let gauges = self.found.as_slice().chunks_exact(PER_GAUGE);
        let glued = |g: &[f64]| AsGlued::from([1.0 + g[0], g[1], g[2], g[3]]).times(common);
        gauges.map(glued).collect()
    }

    /// What is not known of each gauge.
    fn doubts(&self, channels: usize) -> Vec<GluingCovariance> {
        let all = self.normal.inverse();
        let of = |c: usize| -> Matrix4<f64> {
            let first = PER_GAUGE * c;
            all.fixed_view::<PER_GAUGE, PER_GAUGE>(first, first)
                .into_owned()
        };
        (0..channels).map(|c| upper_triangle(&of(c))).collect()
    }
}

/// Where a falling function is zero, between what is never trusted and all.
fn zero_of(excess: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (LEAST, 1.0);
    if excess(low) <= 0.0 {
        return low;
    }
    for _ in 0..30 {
        let middle = f64::sqrt(low * high);
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The share of a reading that may be left of any limb that somebody presses where he says.
const MOST_LEFT: f64 = 0.5;

impl Calibration {
    /// Whether the touches are of this limb and of these places, as far as what is left of their readings tells.
    #[must_use]
    pub fn explains(&self) -> bool {
        self.relative < MOST_LEFT
    }

    /// The same gauges on a part that is so many times as soft as the one they were compared with.
    #[must_use]
    pub fn on_softer(mut self, factor: f64) -> Self {
        for glued in &mut self.glued {
            *glued = glued.times(factor.recip());
        }
        self
    }
}

impl AsDrawn {
    /// As the gauges really are.
    #[must_use]
    pub fn calibrated(&self, calibration: &Calibration) -> ResponseMap {
        self.glued(&calibration.glued)
    }
}

#[cfg(test)]
mod tests;
