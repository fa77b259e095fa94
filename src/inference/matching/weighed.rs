//! Readings under their covariance: weighted sums, and what they say of force and place.
//!
//! Channels are off each for itself, but for what all of them feel together: a drift, and of a touch of force f its
//! nuisances (a tip of another size, a force along the surface). So C = D + U Uᵀ with a diagonal D and a column of U for
//! each of these, a standard deviation long. With W = D⁻¹ and L Lᵀ = 1 + Uᵀ W U (M. A. Woodbury, Princeton Statist.
//! Research Group Memo. 42, 1950), and P = L⁻¹ Uᵀ W,
//!
//! ```text
//! aᵀ C⁻¹ b = aᵀ W b - (P a)·(P b)        ln |C| = ln |D| + 2 ln |L|
//! ```
//!
//! so that every sum stays one pass over the channels. What is left over of a reading, r, says that the shared errors
//! were L⁻ᵀ P r of their deviations, with (L Lᵀ)⁻¹ for a covariance.

use std::borrow::Cow;
use std::f64::consts::TAU;

use nalgebra::{Matrix3, Matrix4, Matrix4x3, Vector3, Vector4};

use super::ReadingErrors;
use super::sums::{Product, WeightedSums, fit};
use crate::inference::deviation::{MOST, Nuisance, TouchDoubts};
use crate::inference::map::Slope;

/// Errors that all channels may share: a drift, and as many nuisances as a place has at most.
const SHARED: usize = 1 + MOST;
const _: () = assert!(
    SHARED == 4,
    "as many as the vectors of four that are used for them"
);

/// What channels are off by together.
#[derive(Clone)]
struct SharedErrors {
    /// Columns of P, a channel each; none where nothing is shared.
    pull: Vec<Vector4<f64>>,
    /// L⁻¹.
    whitening: Matrix4<f64>,
    /// ln |L|.
    log: f64,
}

impl SharedErrors {
    /// By a variance of the drift (strain²) and the nuisances of a force (N), for weights `w`.
    fn of(drift: f64, nuisances: &[Nuisance], force: f64, w: &[f64]) -> Self {
        // Thousands of templates are weighed one by one.
        if drift == 0.0 && nuisances.is_empty() {
            return Self {
                pull: Vec::new(),
                whitening: Matrix4::identity(),
                log: 0.0,
            };
        }
        let drift = drift.sqrt();
        let column = |(c, w): (usize, &f64)| {
            let mut u = Vector4::new(drift, 0.0, 0.0, 0.0);
            for (k, nuisance) in nuisances.iter().enumerate() {
                u[k + 1] = force * nuisance.reading[c];
            }
            (u, u * *w)
        };
        let columns: Vec<_> = w.iter().enumerate().map(column).collect();
        let mut inner = Matrix4::identity();
        for (u, weighted) in &columns {
            inner += u * weighted.transpose();
        }
        let (whitening, log) = whitening(&inner);
        Self {
            pull: (columns.iter())
                .map(|(_, weighted)| whitening * weighted)
                .collect(),
            whitening,
            log,
        }
    }

    fn pulled(&self, values: &[f64]) -> Vector4<f64> {
        let pairs = self.pull.iter().zip(values);
        pairs.fold(Vector4::zeros(), |sum, (p, v)| sum + p * *v)
    }
}

/// L⁻¹ and ln |L| of a matrix L Lᵀ that is no smaller than the identity; of one that holds no numbers the identity's.
/// Row by row, by Cholesky's recurrence carried over to the inverse: most of a touch's time would go into the general one.
fn whitening(inner: &Matrix4<f64>) -> (Matrix4<f64>, f64) {
    let mut lower = Matrix4::zeros();
    let mut inverse = Matrix4::zeros();
    let mut product = 1.0;
    for i in 0..SHARED {
        for j in 0..i {
            let inside: f64 = (0..j).map(|k| lower[(i, k)] * lower[(j, k)]).sum();
            lower[(i, j)] = (inner[(i, j)] - inside) / lower[(j, j)];
        }
        let squares: f64 = (0..i).map(|k| lower[(i, k)] * lower[(i, k)]).sum();
        let pivot = (inner[(i, i)] - squares).sqrt();
        if !pivot.is_finite() || pivot <= 0.0 {
            return (Matrix4::identity(), 0.0);
        }
        (lower[(i, i)], inverse[(i, i)]) = (pivot, pivot.recip());
        for j in 0..i {
            let inside: f64 = (j..i).map(|k| lower[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = -inside / pivot;
        }
        product *= pivot;
    }
    (inverse, product.ln())
}

/// A reading with its weights, ready to be compared.
pub(in crate::inference) struct WeighedReading<'a> {
    x: &'a [f64],
    w: &'a [f64],
    shared: &'a SharedErrors,
    /// P x.
    pulled: Vector4<f64>,
    /// Weighted squares of a reading without a touch.
    pub squares: f64,
}

impl<'a> WeighedReading<'a> {
    /// A reading by these weights.
    pub fn of(weighed: &'a WeighedTouch, x: &'a [f64]) -> Self {
        Self::new(x, &weighed.w, &weighed.shared)
    }

    /// With one over the variance of each channel, and what all are off by together.
    fn new(x: &'a [f64], w: &'a [f64], shared: &'a SharedErrors) -> Self {
        let pulled = shared.pulled(x);
        let squares: f64 = x.iter().zip(w).map(|(x, w)| w * x * x).sum();
        Self {
            squares: squares - pulled.norm_squared(),
            x,
            w,
            shared,
            pulled,
        }
    }

    /// Best force and half the squares left over at a place with these readings per newton.
    pub fn fit(&self, g: &[f64], most_force: f64) -> (f64, f64) {
        let (s, d) = self.products(g);
        fit([s, d, self.squares], most_force)
    }

    /// Weighted product of the reading with those of a newton, and the squares of these.
    pub fn products(&self, g: &[f64]) -> (f64, f64) {
        let (mut s, mut d) = (0.0, 0.0);
        for ((x, w), g) in self.x.iter().zip(self.w).zip(g) {
            s += w * x * g;
            d += w * g * g;
        }
        let pulled = self.shared.pulled(g);
        (s - pulled.dot(&self.pulled), d - pulled.norm_squared())
    }

    /// Normal equations of place (two directions) and force, and their right side.
    pub fn equations(&self, slope: &Slope, force: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let (mut pulled_rows, mut pulled_left) = (Matrix4x3::zeros(), Vector4::zeros());
        for (c, (x, w)) in self.x.iter().zip(self.w).enumerate() {
            let change = slope.change[c] * force;
            let row = Vector3::new(change.x, change.y, slope.reading[c]);
            let left = x - force * slope.reading[c];
            normal += row * row.transpose() * *w;
            right += row * (w * left);
            if let Some(pull) = self.shared.pull.get(c) {
                pulled_rows += pull * row.transpose();
                pulled_left += pull * left;
            }
        }
        normal -= pulled_rows.transpose() * pulled_rows;
        right -= pulled_rows.transpose() * pulled_left;
        (normal, right)
    }

    /// What is in that which a touch of a force leaves over: `nuisances` are those of the place. And the standard
    /// deviation of the force along the surface (N), in the mean over both directions.
    pub fn about(&self, g: &[f64], force: f64, nuisances: &[Nuisance]) -> (TouchDoubts, f64) {
        let left = self.pulled - self.shared.pulled(g) * force;
        let shares = self.shared.whitening.transpose() * left;
        let (mut about, mut variance) = (TouchDoubts::default(), 0.0);
        for (k, nuisance) in nuisances.iter().enumerate() {
            about.aside += nuisance.force * shares[k + 1];
            about.tip += nuisance.tip * shares[k + 1];
            // The inverse of L Lᵀ is what is left of the unit variances.
            let of_share = self.shared.whitening.column(k + 1).norm_squared();
            variance += nuisance.force.length_squared() * force * force * of_share / 2.0;
        }
        (about, variance.sqrt())
    }
}

/// A reading, and what is known of its errors wherever the touch was.
pub(in crate::inference) struct Observation<'a> {
    /// A channel that reads no strain is left out, and stands here as zero.
    x: Cow<'a, [f64]>,
    /// Absent where it is the reading.
    sizes: Option<Vec<f64>>,
    /// One over the variance of every channel, without gluing.
    pub w: Vec<f64>,
    /// Weighted squares of a reading without a touch.
    pub squares: f64,
    /// Variance of what all channels have drifted by together.
    pub drift: f64,
    /// What they have so, where gluing does not count.
    shared: SharedErrors,
}

impl<'a> Observation<'a> {
    /// A reading with the weights that it has where gluing does not count.
    pub fn new(reading: &'a [f64], errors: &ReadingErrors, used: &[bool]) -> Self {
        Self::sized(reading, None, errors, used)
    }

    /// The same where channels are off by shares of something else than the whole reading (strain).
    pub fn sized(
        reading: &'a [f64],
        sizes: Option<Vec<f64>>,
        errors: &ReadingErrors,
        used: &[bool],
    ) -> Self {
        if reading.iter().all(|&x| is_a_strain(x)) {
            return Self::of(Cow::Borrowed(reading), sizes, errors, used);
        }
        let trusted = |(x, used): (&f64, &bool)| *used && is_a_strain(*x);
        let used: Vec<bool> = reading.iter().zip(used).map(trusted).collect();
        let read = |&x: &f64| if is_a_strain(x) { x } else { 0.0 };
        let reading: Vec<f64> = reading.iter().map(read).collect();
        Self::of(Cow::Owned(reading), sizes, errors, &used)
    }

    fn of(
        x: Cow<'a, [f64]>,
        sizes: Option<Vec<f64>>,
        errors: &ReadingErrors,
        used: &[bool],
    ) -> Self {
        let w = errors.weights(sizes.as_deref().unwrap_or(&x), used);
        let drift = errors.drift * errors.drift;
        let shared = SharedErrors::of(drift, &[], 0.0, &w);
        Self {
            squares: WeighedReading::new(&x, &w, &shared).squares,
            shared,
            x,
            sizes,
            w,
            drift,
        }
    }

    /// What channels are off by shares of (strain).
    pub fn sizes(&self) -> &[f64] {
        self.sizes.as_deref().unwrap_or(&self.x)
    }

    /// Strain of every channel (a ratio), zero for channels that read none.
    pub fn reading(&self) -> &[f64] {
        &self.x
    }

    /// Logarithm of the density of a reading that is just what was expected, without gluing. Channels that are left
    /// out have none.
    pub fn log_density(&self) -> f64 {
        let trusted = self.w.iter().filter(|w| **w > 0.0);
        trusted.map(|w| 0.5 * (w / TAU).ln()).sum::<f64>() - self.shared.log
    }

    /// What a drift takes from weighted sums where it is all that channels share (κ = δ² / (1 + δ² 1ᵀ W 1)), and the
    /// weighted sum of the reading.
    pub fn drifted(&self) -> [f64; 2] {
        let all: f64 = self.w.iter().sum();
        let sum = self.w.iter().zip(self.x.iter()).map(|(w, x)| w * x).sum();
        [self.drift / (1.0 + self.drift * all), sum]
    }

    /// The weights for a touch of a force, where gauges glued otherwise would read so much else (a newton), and with the
    /// nuisances of the place.
    pub fn weighed(
        &self,
        gluing_deviation: Option<&[f64]>,
        nuisances: &[Nuisance],
        force: f64,
    ) -> WeighedTouch {
        let mut product = Product::default();
        let weight = |(c, w): (usize, &f64)| {
            let off = gluing_deviation.map_or(0.0, |deviation| force * deviation[c]);
            let wider = 1.0 + w * off * off;
            product.times(wider);
            w / wider
        };
        let w: Vec<f64> = self.w.iter().enumerate().map(weight).collect();
        let shared = SharedErrors::of(self.drift, nuisances, force, &w);
        WeighedTouch {
            log: 0.5 * product.ln() + shared.log - self.shared.log,
            shared,
            w,
        }
    }

    /// The sums of [`Self::weighed`] without nuisances: thousands of templates are looked at one by one for a single
    /// reading, and no list is kept for any of them.
    pub fn sums(&self, g: &[f64], gluing_deviation: Option<&[f64]>, force: f64) -> WeightedSums {
        let mut sums = WeightedSums::default();
        let (mut all, mut of_x, mut of_g) = (0.0, 0.0, 0.0);
        let mut wider = Product::default();
        for (c, ((x, w), g)) in self.x.iter().zip(&self.w).zip(g).enumerate() {
            let off = gluing_deviation.map_or(0.0, |deviation| force * deviation[c]);
            let by = 1.0 + w * off * off;
            wider.times(by);
            let w = w / by;
            sums.squares += w * x * x;
            sums.s += w * x * g;
            sums.d += w * g * g;
            (all, of_x, of_g) = (all + w, of_x + w * x, of_g + w * g);
        }
        let inner = 1.0 + self.drift * all;
        let taken = self.drift / inner;
        sums.squares -= taken * of_x * of_x;
        sums.s -= taken * of_x * of_g;
        sums.d -= taken * of_g * of_g;
        wider.times(inner);
        sums.log = 0.5 * wider.ln() - self.shared.log;
        sums
    }

    /// The reading under these weights, as it is compared with templates.
    pub fn measured<'b>(&'b self, weighed: &'b WeighedTouch) -> WeighedReading<'b> {
        WeighedReading::of(weighed, &self.x)
    }

    /// The force that fits best where all channels are off alike: where each has variances of its own, one begins
    /// here.
    pub fn first_force(&self, g: &[f64]) -> f64 {
        let trusted = || (self.x.iter().zip(g).zip(&self.w)).filter(|(_, w)| **w > 0.0);
        let s: f64 = trusted().map(|((x, g), _)| x * g).sum();
        let d: f64 = trusted().map(|((_, g), _)| g * g).sum();
        if d > 0.0 { s / d } else { 0.0 }
    }
}

/// Whether a reading is one at all: a number, and none that the squares of single precision would not hold.
fn is_a_strain(x: f64) -> bool {
    x.abs() <= 1e6
}

/// The weights of a reading for a touch at one place, of one force.
pub(in crate::inference) struct WeighedTouch {
    w: Vec<f64>,
    shared: SharedErrors,
    /// Half the logarithm of the covariance's determinant, over that without gluing.
    pub log: f64,
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use nalgebra::{DMatrix, DVector};

    use super::*;

    const X: [f64; 4] = [3.0, -1.0, 2.0, 0.5];
    const G: [f64; 4] = [1.0, -0.5, 0.25, 0.2];

    fn errors(drift: f64) -> ReadingErrors {
        ReadingErrors {
            drift,
            ..ReadingErrors::of_noises(&[0.5, 1.0, 2.0, 0.25])
        }
    }

    /// One over the covariance, and its determinant, the long way.
    fn dense(variances: &[f64], shared: &[Vec<f64>]) -> (DMatrix<f64>, f64) {
        let mut covariance = DMatrix::from_diagonal(&DVector::from_column_slice(variances));
        for column in shared {
            let column = DVector::from_column_slice(column);
            covariance += &column * column.transpose();
        }
        let determinant = covariance.determinant();
        (covariance.try_inverse().unwrap(), determinant)
    }

    fn nuisances() -> Vec<Nuisance> {
        let of = |force: DVec3, reading: [f64; 4]| Nuisance {
            force,
            tip: if force == DVec3::ZERO { 1e-3 } else { 0.0 },
            reading: reading.to_vec(),
        };
        vec![
            of(DVec3::ZERO, [0.4, -0.1, 0.3, 0.2]),
            of(DVec3::X * 0.2, [0.1, 0.6, -0.2, 0.5]),
            of(DVec3::Y * 0.2, [-0.5, 0.2, 0.2, 0.1]),
        ]
    }

    #[test]
    fn what_all_channels_share_is_a_covariance_of_low_rank() {
        let errors = errors(3.0);
        let observed = Observation::new(&X, &errors, &[true; 4]);
        let gluing_deviation = [0.3, 0.1, 0.0, 0.7];
        let force = 2.0;
        let variances: Vec<f64> = (errors.noise.iter().zip(gluing_deviation))
            .map(|(n, s)| n * n + f64::powi(force * s, 2))
            .collect();
        let drift = vec![3.0; 4];
        let squares: Vec<f64> = errors.noise.iter().map(|n| n * n).collect();
        let (plain, without) = dense(&squares, std::slice::from_ref(&drift));
        let (x, g) = (
            DVector::from_column_slice(&X),
            DVector::from_column_slice(&G),
        );
        assert!((observed.squares - x.dot(&(&plain * &x))).abs() < 1e-12);
        for nuisances in [Vec::new(), nuisances()] {
            let felt = nuisances
                .iter()
                .map(|n| n.reading.iter().map(|r| force * r).collect());
            let shared: Vec<Vec<f64>> = std::iter::once(drift.clone()).chain(felt).collect();
            let (inverse, determinant) = dense(&variances, &shared);
            let weighed = observed.weighed(Some(&gluing_deviation), &nuisances, force);
            let measured = observed.measured(&weighed);
            let (s, d) = measured.products(&G);
            assert!((s - x.dot(&(&inverse * &g))).abs() < 1e-12);
            assert!((d - g.dot(&(&inverse * &g))).abs() < 1e-12);
            assert!((measured.squares - x.dot(&(&inverse * &x))).abs() < 1e-12);
            assert!((weighed.log - 0.5 * (determinant / without).ln()).abs() < 1e-12);
            if nuisances.is_empty() {
                let sums = observed.sums(&G, Some(&gluing_deviation), force);
                assert!((sums.s - s).abs() < 1e-12 && (sums.d - d).abs() < 1e-12);
                assert!((sums.squares - measured.squares).abs() < 1e-12);
                assert!((sums.log - weighed.log).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_force_along_the_surface_is_what_its_normal_distribution_says() {
        let errors = errors(0.0);
        let observed = Observation::new(&X, &errors, &[true; 4]);
        let (nuisances, force) = (nuisances(), 2.0);
        let weighed = observed.weighed(None, &nuisances, force);
        let (about, deviation) = observed.measured(&weighed).about(&G, force, &nuisances);
        // Mean and covariance of u in x - f g = U u + n, by the covariance of the readings.
        let felt: Vec<Vec<f64>> = (nuisances.iter())
            .map(|n| n.reading.iter().map(|r| force * r).collect())
            .collect();
        let squares: Vec<f64> = errors.noise.iter().map(|n| n * n).collect();
        let (inverse, _) = dense(&squares, &felt);
        let left = DVector::from_fn(4, |c, _| X[c] - force * G[c]);
        let pulled = &inverse * left;
        let (mut aside, mut tip, mut variance) = (DVec3::ZERO, 0.0, 0.0);
        for (nuisance, felt) in nuisances.iter().zip(&felt) {
            let felt = DVector::from_column_slice(felt);
            aside += nuisance.force * felt.dot(&pulled);
            tip += nuisance.tip * felt.dot(&pulled);
            let share = 1.0 - felt.dot(&(&inverse * &felt));
            variance += nuisance.force.length_squared() * force * force * share / 2.0;
        }
        assert!(about.aside.distance(aside) < 1e-12, "{about:?} {aside}");
        assert!((about.tip - tip).abs() < 1e-15, "{about:?} {tip}");
        assert!((deviation - variance.sqrt()).abs() < 1e-12);
    }

    /// The force that fits best where gluing does not count.
    fn fit(observed: &Observation) -> f64 {
        let weighed = observed.weighed(None, &[], 0.0);
        observed.measured(&weighed).fit(&G, 100.0).0
    }

    #[test]
    fn what_all_channels_share_says_nothing_where_they_may_have_drifted() {
        let (still, drifting) = (errors(0.0), errors(1e6));
        let shifted = X.map(|x| x + 5.0);
        let force = |errors: &ReadingErrors, x: &[f64]| {
            let observed = Observation::new(x, errors, &[true; 4]);
            fit(&observed)
        };
        assert!((force(&drifting, &shifted) - force(&drifting, &X)).abs() < 1e-6);
        assert!((force(&still, &shifted) - force(&still, &X)).abs() > 0.1);
    }

    #[test]
    fn a_channel_that_reads_no_number_is_one_that_is_not_there() {
        let errors = errors(0.3);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
            let reading = [X[0], bad, X[2], X[3]];
            let observed = Observation::new(&reading, &errors, &[true; 4]);
            let without = Observation::new(&X, &errors, &[true, false, true, true]);
            let fits = [&observed, &without].map(|h| fit(h));
            assert_eq!(fits[0], fits[1]);
        }
    }
}
