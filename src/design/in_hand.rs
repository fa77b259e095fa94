//! Gauges in somebody's hand: what a simulation is asked about them again with every move, made ready once.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

use super::known::{FINE, KnownSimulation};
use super::{Inputs, Simulated};
use crate::budget::{Cancelled, Watch, report};
use crate::memory;
use crate::mesh::scatter::Scatter;
use crate::placement::expected_error::{
    Detail, GaugeInHand, Mistaken, MistakenPair, NUISANCES, TouchScene, blind, least_helpful,
    most_helpful, taken_for, worst_pairs,
};
use crate::units;

/// A scene of all sites of a simulation, and how it lies on the part. Sets are numbers of sites of the dataset.
pub struct InHand {
    simulated: Arc<Simulated>,
    scene: TouchScene,
    /// Where the presses are (m).
    presses: Vec<DVec3>,
    /// The presses of each force, and what they weigh on the surface that was computed.
    carriers: Vec<(Range<usize>, Scatter)>,
    /// Of the touches that may be blind or mistaken (N).
    pub force_n: f64,
    /// The lightest and the hardest touch that the error is expected over (N).
    pub forces_n: [f64; 2],
}

/// What is expected of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedInHand {
    /// Over where touches come, how hard they are and what is off.
    pub error_mm: f64,
    /// The same over the touches that are not blind; absent where all are.
    pub sighted_mm: Option<f64>,
    /// Share of the touches that move no gauge so far that it is told from noise.
    pub blind: f64,
    /// The error (mm) a vertex of the part.
    pub map_mm: Vec<f64>,
    /// How much of what lies around each vertex is blind, 0–1.
    pub blind_map: Vec<f64>,
}

impl InHand {
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn new(
        inputs: &Inputs,
        simulated: Arc<Simulated>,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let scene = scene(inputs, &simulated, watch)?;
        report(watch, "Laying presses on the part", 1, 2)?;
        let presses: Vec<DVec3> = scene.presses_mm().into_iter().map(units::from_mm).collect();
        let places: Vec<(DVec3, DVec3)> = (presses.iter())
            .map(|&p| (p, normal_at(&simulated, p)))
            .collect();
        let some = |range: &Range<usize>| !range.is_empty();
        let carriers = scene.by_force().into_iter().filter(some).map(|range| {
            let carrier = Scatter::new(&simulated.mesh, &places[range.clone()]);
            (range, carrier)
        });
        let project = &inputs.project;
        Ok(Self {
            carriers: carriers.collect(),
            presses,
            force_n: project.touch.force_n,
            forces_n: project.touch.forces_n,
            scene,
            simulated,
        })
    }

    /// A set of which one gauge moves.
    #[must_use]
    pub fn hand(&self, set: &[usize], moves: usize) -> GaugeInHand<'_> {
        GaugeInHand::around(&self.scene, set, moves)
    }

    /// What is expected of a set of which one gauge is in hand.
    #[must_use]
    pub fn expected(&self, hand: &GaugeInHand, set: &[usize], moves: usize) -> ExpectedInHand {
        let errors = hand.errors_with(set[moves]);
        let blind = blind(&self.scene, set, self.force_n);
        let share: Vec<f64> = blind.iter().map(|&b| f64::from(u8::from(b))).collect();
        let mean = |of: &[f64]| self.scene.mean_among(of, |_| true).unwrap_or(0.0);
        ExpectedInHand {
            error_mm: mean(&errors),
            sighted_mm: self.scene.mean_among(&errors, |k| !blind[k]),
            blind: mean(&share),
            map_mm: self.map(&errors),
            blind_map: self.map(&share),
        }
    }

    /// Something known of each press, a vertex of the part: the mean over the forces.
    fn map(&self, of_presses: &[f64]) -> Vec<f64> {
        let mesh = &self.simulated.mesh;
        let mut computed = vec![0.0; mesh.positions().len()];
        for (range, carrier) in &self.carriers {
            let carried = carrier.carry(&of_presses[range.clone()]);
            for (sum, value) in computed.iter_mut().zip(carried) {
                *sum += value / self.carriers.len() as f64;
            }
        }
        let part = self.simulated.carried.iter();
        part.map(|&at| mesh.interpolate(&computed, at)).collect()
    }

    /// The press nearest to a place (m), and where it is (m); nothing where there are none.
    #[must_use]
    pub fn press_near(&self, at: DVec3) -> Option<(usize, DVec3)> {
        let presses = self.presses.iter().copied().enumerate();
        presses.min_by(|a, b| {
            let away = |p: &(usize, DVec3)| p.1.distance_squared(at);
            away(a).total_cmp(&away(b))
        })
    }

    /// What a press could be taken for, the likeliest first.
    #[must_use]
    pub fn taken_for(&self, set: &[usize], press: usize) -> Vec<Mistaken> {
        taken_for(&self.scene, set, press, self.force_n)
    }

    /// The confusions that cost most, the worst first.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn worst_pairs(&self, set: &[usize], watch: Watch) -> Result<Vec<MistakenPair>, Cancelled> {
        worst_pairs(&self.scene, set, self.force_n, watch)
    }

    /// The site of some open ones that helps a set most, and the error (mm) that is expected with it.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn most_helpful(
        &self,
        set: &[usize],
        open: &[usize],
        watch: Watch,
    ) -> Result<Option<(usize, f64)>, Cancelled> {
        most_helpful(&self.scene, set, open, watch)
    }

    /// The gauge of a set (its number from zero) that helps it least, and the error (mm) that is expected without it.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for a stop.
    pub fn least_helpful(
        &self,
        set: &[usize],
        watch: Watch,
    ) -> Result<Option<(usize, f64)>, Cancelled> {
        least_helpful(&self.scene, set, watch)
    }
}

fn scene(inputs: &Inputs, simulated: &Simulated, watch: Watch) -> Result<TouchScene, Cancelled> {
    let known = KnownSimulation::new(inputs, simulated);
    let variance = |site: usize, touch: usize| known.variance(site, touch);
    let felt = |site: usize, touch: usize| known.felt(site, touch);
    let dataset = &simulated.dataset;
    TouchScene::new(
        &dataset.x,
        &dataset.targets_mm(),
        &known.knowledge(&variance, &known.shared(&felt)),
        detail(dataset.sites.len()),
        watch,
    )
}

/// As a few sites are judged by, or less where what all of them report of it would take too much memory.
fn detail(sites: usize) -> Detail {
    /// Of what may be taken.
    const SHARE: f64 = 0.05;
    /// Of one site at one place: four numbers in single precision, and one for each nuisance.
    const BYTES: f64 = 4.0 * (4 + NUISANCES) as f64;
    let needed = BYTES * (sites * (FINE.places + FINE.presses)) as f64;
    let share = (SHARE * memory::allowed() / needed.max(1.0)).min(1.0);
    let part = |of: usize| ((share * of as f64) as usize).max(1);
    Detail {
        places: part(FINE.places),
        presses: part(FINE.presses),
    }
}

/// The outward normal where a touch of the simulation comes nearest to a place (m).
fn normal_at(simulated: &Simulated, at: DVec3) -> DVec3 {
    let away = |t: &&crate::elasticity::Touch| t.position.distance_squared(at);
    let touches = simulated.dataset.touches.iter();
    let nearest = touches.min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.map_or(DVec3::Z, |t| t.normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_sites_are_looked_at_in_less_detail() {
        assert_eq!(detail(3000), FINE);
        let many = detail(50_000);
        assert!(many.places < FINE.places && many.presses < FINE.presses);
        let bytes = 28.0 * 50_000.0 * (many.places + many.presses) as f64;
        assert!(bytes <= 0.05 * memory::USUAL as f64);
        assert_eq!(detail(0), FINE);
    }
}
