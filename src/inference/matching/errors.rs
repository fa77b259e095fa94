//! What is off with readings, as matching weighs it.

use crate::inference::Deviations;
use crate::uncertainty::Uncertainty;

/// No reading is taken to be better than this (strain).
const LEAST_NOISE: f64 = 1e-9;

/// What is known of the readings' errors.
#[derive(Clone)]
pub struct ReadingErrors {
    /// Standard deviation of each channel's noise (strain).
    pub noise: Vec<f64>,
    /// Standard deviation of what gains, places and model are off by, over the reading: half of it from the
    /// channel's own reading, half from the mean square of all.
    pub relative: f64,
    /// What gluing and the way touches are made put on readings, on the mesh of the readings; absent where gauges are
    /// known to be glued as the readings say, and touches to be made as they are said to be.
    pub deviations: Option<Deviations>,
    /// Standard deviation of what all channels have drifted by together (strain).
    pub drift: f64,
    /// Standard deviation of the factor by which the part is stiffer or softer than its model: of every force.
    pub stiffness: f64,
}

impl ReadingErrors {
    /// The same noise (strain) on every channel, and nothing else.
    #[must_use]
    pub fn of_noise(noise: f64, channels: usize) -> Self {
        Self::of_noises(&vec![noise; channels])
    }

    /// Noise of each channel, and nothing else.
    #[must_use]
    pub fn of_noises(noise: &[f64]) -> Self {
        Self {
            noise: noise.to_vec(),
            relative: 0.0,
            deviations: None,
            drift: 0.0,
            stiffness: 0.0,
        }
    }

    /// As the project describes what is off, for so many channels that may be off as `deviations` say.
    #[must_use]
    pub fn known(off: &Uncertainty, channels: usize, deviations: Option<Deviations>) -> Self {
        Self {
            relative: off.elements,
            deviations,
            drift: off.drift,
            stiffness: off.stiffness,
            ..Self::of_noise(off.of_channel().max(LEAST_NOISE), channels)
        }
    }

    /// Standard deviation of the force along the surface in either of two directions, over the force that presses.
    pub(super) fn usual_drag(&self) -> f64 {
        let nuisances = self.deviations.as_ref().and_then(|d| d.nuisances.as_ref());
        let dragging = nuisances.filter(|n| n.axes.is_some());
        dragging.map_or(0.0, |n| n.making.along_either())
    }

    /// The same, of one channel so many times what they are where it has such a weight.
    pub(in crate::inference) fn worse_at(&self, channel: usize, times: f64, weight: f64) -> Self {
        let mut worse = self.clone();
        let more = (times * times - 1.0) / weight;
        worse.noise[channel] = worse.noise[channel].hypot(more.sqrt());
        worse
    }

    /// One over the variance of every channel for this reading; zero for a channel that is left out.
    #[must_use]
    pub fn weights(&self, reading: &[f64], used: &[bool]) -> Vec<f64> {
        let count = used.iter().filter(|u| **u).count().max(1) as f64;
        let squares = reading
            .iter()
            .zip(used)
            .filter(|(_, u)| **u)
            .map(|(x, _)| x * x);
        let mean = squares.sum::<f64>() / count;
        let weight = |((x, u), n): ((&f64, &bool), &f64)| {
            let off = self.relative.powi(2) * f64::midpoint(x * x, mean);
            if *u { (n * n + off).recip() } else { 0.0 }
        };
        reading
            .iter()
            .zip(used)
            .zip(&self.noise)
            .map(weight)
            .collect()
    }
}
