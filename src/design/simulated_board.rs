//! The simulated board of a project: what it is like, where it is touched, and the truth that it reads.

use super::{DesignError, Inputs, Sensing, Workshop};
use crate::board::{Faults, Options, Script, SimulatedBoard, fitting_gain};
use crate::budget::Watch;
use crate::elasticity::Touch;
use crate::inference::Chain;

/// What a simulated board of a project is like where nothing else is asked for.
#[must_use]
pub fn options(inputs: &Inputs, channels: usize) -> Options {
    Options {
        seed: inputs.project.budget.seed,
        rate_hz: 1000,
        chain: Chain::default(),
        channels,
        noise: inputs.project.gauge.noise_microstrain * 1e-6,
        drift: 0.1e-6,
        offset: 100e-6,
        name: "Simulated board".into(),
    }
}

/// Places that random touches come to: off the nodes, with a seed that no training uses.
///
/// # Errors
/// As [`Sensing::touches`].
pub fn places(inputs: &Inputs, sensing: &Sensing, seed: u64) -> Result<Vec<Touch>, DesignError> {
    const PLACES: usize = 2000;
    const SEED: u64 = 0x70c4;
    sensing.touches(inputs, PLACES, seed.wrapping_add(SEED), false)
}

/// A board whose gain suits touches up to a force (N).
///
/// # Errors
/// As [`Sensing::reference`].
#[allow(clippy::too_many_arguments)]
pub fn simulated(
    inputs: &Inputs,
    sensing: &Sensing,
    workshop: Workshop,
    script: Script,
    most_force: f64,
    mut options: Options,
    faults: Faults,
    watch: Watch,
) -> Result<SimulatedBoard, DesignError> {
    let seed = inputs.project.budget.seed;
    let (reference, gains) =
        sensing.reference(&workshop.of(inputs.project.gluing()), seed, watch)?;
    let typical: Vec<Touch> = places(inputs, sensing, seed)?
        .into_iter()
        .take(300)
        .collect();
    options.chain.gain = fitting_gain(&reference, &gains, &typical, most_force, &options.chain);
    Ok(SimulatedBoard::new(
        reference, gains, script, options, faults,
    ))
}
