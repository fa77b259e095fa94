//! What is known of the signals of a simulation beside their values: noise, gluing, and what its elements leave.

use super::{HEARD_SEED, Inputs, Simulated};
use crate::dataset::Signal;
use crate::placement::expected_error::{Knowledge, Variance};
use crate::uncertainty::Gluing;

/// What a choice by expected error is told of a simulation.
pub(super) struct Known<'a> {
    simulated: &'a Simulated,
    gluing: Gluing,
    /// Force of each touch (N).
    forces: Vec<f64>,
    /// Variance of every signal that the elements leave, touch by touch.
    elements: Vec<f64>,
    noise: f64,
    range: [f64; 2],
    seed: u64,
}

impl<'a> Known<'a> {
    pub fn new(inputs: &Inputs, simulated: &'a Simulated, gluing: &Gluing) -> Self {
        let project = &inputs.project;
        let dataset = &simulated.dataset;
        let estimate = &simulated.discretization;
        let share = match (dataset.signal, estimate.strain_percent.is_nan()) {
            (Signal::Strain, false) => estimate.strain_percent / 100.0,
            _ => 0.0,
        };
        let mut largest = vec![0.0_f64; dataset.touches.len()];
        for site in 0..dataset.x.rows() {
            for (most, x) in largest.iter_mut().zip(dataset.x.row(site)) {
                *most = most.max(x.abs());
            }
        }
        Self {
            simulated,
            gluing: *gluing,
            forces: dataset.touches.iter().map(|t| t.force).collect(),
            elements: largest.iter().map(|x| (share * x).powi(2)).collect(),
            noise: match dataset.signal {
                Signal::Strain => project.gauge.noise_microstrain * 1e-6,
                Signal::Displacement | Signal::NormalDisplacement => 0.0,
            },
            range: project.touch.forces_n,
            seed: project.budget.seed.wrapping_add(HEARD_SEED),
        }
    }

    /// What gluing and elements put on the signal of a site (as numbered in the dataset) under a touch.
    pub fn variance(&self, site: usize, touch: usize) -> f64 {
        let reading = self.simulated.dataset.x.row(site)[touch];
        let slopes = self.simulated.dataset.slopes.as_ref();
        let column = slopes.and_then(|s| s.touches().binary_search(&touch).ok());
        let glued = match (slopes, column) {
            (Some(slopes), Some(column)) => slopes.variance(site, column, reading, &self.gluing),
            _ => 0.0,
        };
        glued + self.elements[touch]
    }

    /// For a pool with this variance of its rows.
    pub fn knowledge<'b>(&'b self, variance: Variance<'b>) -> Knowledge<'b> {
        Knowledge {
            noise: self.noise,
            variance: Some(variance),
            among: (self.simulated.dataset.slopes.as_ref()).map(|s| s.touches()),
            forces: Some((&self.forces, self.range)),
            seed: self.seed,
        }
    }
}
