//! One filter at one place, told a reading of that very place: what the filters side by side do, said plainly.

use nalgebra::SMatrix;

use super::filters::MOST;
use super::unknowns::{Unknowns, row, thought, within};
use crate::placement::expected_error::scene::{Report, ScenePlace, TouchScene};

type PlaceCovariance = SMatrix<f64, MOST, MOST>;

/// What is thought of a touch around a place.
pub(super) struct Single {
    pub covariance: PlaceCovariance,
    pub estimate: Unknowns,
    pub cost: f64,
}

impl Single {
    /// Nothing was read yet.
    pub fn at_rest(scene: &TouchScene, place: &ScenePlace) -> Self {
        let known = within(scene, place.reach);
        Self {
            covariance: PlaceCovariance::from_diagonal(&known.component_mul(&known)),
            estimate: thought(if scene.hardest.is_some() { 0.0 } else { 1.0 }),
            cost: -place.mass.max(1e-12).ln(),
        }
    }

    /// Takes into account what a site reads (in units of the noise), as it would a touch of some force (N) around the
    /// place of a number.
    pub fn correct(
        &mut self,
        scene: &TouchScene,
        (here, place): (&Report, usize),
        (force, reading): (f64, f64),
    ) {
        let (row, variance) = row(scene, here, place, force);
        let spread = self.covariance * row;
        // Never less than the noise: rounding would take more.
        let predicted = (1.0 + row.dot(&spread)).max(1.0);
        let off = reading / variance.sqrt() - row.dot(&self.estimate);
        self.cost += off * off / (2.0 * predicted) + 0.5 * (predicted * variance).ln();
        self.covariance -= spread * spread.transpose() / predicted;
        self.estimate += spread * (off / predicted);
    }

    /// What a touch costs that would have to pull, beside what it costs already.
    pub fn cost_without_pulls(&self) -> f64 {
        let variance = self.covariance[(2, 2)];
        let pulls = if variance > 0.0 {
            (self.estimate[2] / variance.sqrt()).min(0.0)
        } else {
            0.0
        };
        self.cost + 0.5 * pulls * pulls
    }
}
