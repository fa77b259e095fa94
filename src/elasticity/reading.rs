//! What an observer reads of the solutions of a model.

use glam::DVec3;

use super::model::Model;
use super::observe::Observer;
use super::solver::BLOCK;

impl Observer {
    /// Strain tensors (xx, yy, 2xy) at each point for a single solution (6 × vertices degrees of freedom).
    #[must_use]
    pub fn strain_of(&self, model: &dyn Model, displacement: &[f64]) -> Vec<[f64; 3]> {
        self.strain(&model.system().widened(&[displacement]))
            .chunks_exact(3 * BLOCK)
            .map(|s| [s[0], s[BLOCK], s[2 * BLOCK]])
            .collect()
    }

    /// As [`Self::strain_of`] for several solutions.
    #[must_use]
    pub fn strains_of(&self, model: &dyn Model, solutions: &[Vec<f64>]) -> Vec<Vec<[f64; 3]>> {
        let mut all = Vec::with_capacity(solutions.len());
        for chunk in solutions.chunks(BLOCK) {
            let strain = self.strain(&model.system().widened(chunk));
            for k in 0..chunk.len() {
                let points = strain.chunks_exact(3 * BLOCK);
                all.push(
                    points
                        .map(|s| [s[k], s[BLOCK + k], s[2 * BLOCK + k]])
                        .collect(),
                );
            }
        }
        all
    }

    /// Displacements (m) at each point for a single solution, as its own elements have them: nothing is carried on.
    #[must_use]
    pub fn displacement_of(&self, model: &dyn Model, displacement: &[f64]) -> Vec<DVec3> {
        self.displacement(&model.system().widened(&[displacement]))
            .chunks_exact(3 * BLOCK)
            .map(|s| DVec3::new(s[0], s[BLOCK], s[2 * BLOCK]))
            .collect()
    }
}
