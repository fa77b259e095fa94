//! The two estimators that learn: regression on the readings as they are, as in the paper, and on their
//! direction alone.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::dataset::SignalMatrix;
use crate::draw::normal;
use crate::regression::predictor::Predictor;
use crate::regression::{Hyper, SvrParams};
use crate::units;

/// What a machine is trained on: readings (channels × touches, strain), places (mm) and forces (N).
pub struct LiveLessons<'a> {
    /// Readings, channels × touches (strain).
    pub x: &'a SignalMatrix,
    /// Where each touch was (mm).
    pub places_mm: &'a [[f64; 3]],
    /// How hard each was (N).
    pub forces: &'a [f64],
    /// Channels that are trusted; the others are not looked at.
    pub used: &'a [bool],
    /// Standard deviation of the noise (strain), and of what gains are off by, that are added.
    pub noise: f64,
    /// Standard deviation of what gains are off by, as a share.
    pub jitter: f64,
    /// Of the noise.
    pub seed: u64,
}

/// How readings become features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Features {
    /// The readings themselves; places and the force are learned from them.
    Raw,
    /// The readings over their norm; the force is the norm over what one newton gives there, which is learned.
    Normalized,
}

/// A trained estimator of place and force.
pub struct TrainedLive {
    features: Features,
    channels: Vec<usize>,
    predictor: Predictor,
}

/// Tolerance of the fits: mm for places, N for forces, a ratio for logarithms.
const TOLERANCE: f64 = 0.02;
const STEPS: usize = 2_000_000;

impl TrainedLive {
    /// Trains with the settings that a search found for places; the force's tube is as wide in its own unit.
    #[must_use]
    pub fn train(features: Features, lessons: &LiveLessons, hyper: &Hyper) -> Self {
        let channels: Vec<usize> = (0..lessons.used.len())
            .filter(|&c| lessons.used[c])
            .collect();
        let noisy = disturbed(lessons, &channels);
        let columns = lessons.x.columns();
        let norms: Vec<f64> = (0..columns)
            .map(|t| norm(noisy.iter().map(|row| row[t])))
            .collect();
        let value = |row: &Vec<f64>, t: usize| match features {
            Features::Raw => row[t],
            Features::Normalized => row[t] / norms[t],
        };
        let values = noisy
            .iter()
            .flat_map(|row| (0..columns).map(move |t| value(row, t)))
            .collect();
        let x = SignalMatrix::new(columns, values);
        let mut targets: Vec<Vec<f64>> = (0..3)
            .map(|axis| lessons.places_mm.iter().map(|p| p[axis]).collect())
            .collect();
        let place = SvrParams {
            c: hyper.c,
            epsilon: hyper.epsilon,
            tolerance: TOLERANCE,
            max_steps: STEPS,
        };
        let last = match features {
            Features::Raw => {
                targets.push(lessons.forces.to_vec());
                SvrParams {
                    epsilon: 0.05,
                    ..place
                }
            }
            Features::Normalized => {
                // ln of the force that one microstrain stands for.
                let log = |(f, n): (&f64, &f64)| (f / units::microstrain(*n)).ln();
                targets.push(lessons.forces.iter().zip(&norms).map(log).collect());
                SvrParams {
                    c: hyper.c / 10.0,
                    epsilon: 0.005,
                    tolerance: 1e-3,
                    ..place
                }
            }
        };
        let predictor = Predictor::train(&x, &targets, &[place, place, place, last], hyper.gamma);
        Self {
            features,
            channels,
            predictor,
        }
    }

    /// Place (mm) and force (N) for a reading (strain, all channels).
    #[must_use]
    pub fn find(&self, reading: &[f64]) -> ([f64; 3], f64) {
        let mut sample: Vec<f64> = self.channels.iter().map(|&c| reading[c]).collect();
        let size = norm(sample.iter().copied());
        if self.features == Features::Normalized {
            for v in &mut sample {
                *v /= size.max(f64::MIN_POSITIVE);
            }
        }
        let out = self.predictor.predict(&sample);
        let force = match self.features {
            Features::Raw => out[3],
            Features::Normalized => units::microstrain(size) * out[3].exp(),
        };
        ([out[0], out[1], out[2]], force)
    }

    /// Touches that the regression kept.
    #[must_use]
    pub fn support_vectors(&self) -> usize {
        self.predictor.support_vectors()
    }
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|v| v * v).sum::<f64>().sqrt()
}

/// The used channels by rows, each sample with noise and gains of its own.
fn disturbed(lessons: &LiveLessons, channels: &[usize]) -> Vec<Vec<f64>> {
    let row = |&c: &usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(lessons.seed);
        rng.set_stream(c as u64);
        let disturb = move |x: &f64| {
            let (gain, noise) = (normal(&mut rng), normal(&mut rng));
            x * (1.0 + lessons.jitter * gain) + lessons.noise * noise
        };
        lessons.x.row(c).iter().map(disturb).collect()
    };
    channels.iter().map(row).collect()
}
