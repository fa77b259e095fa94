//! The simulated board of a project: what it is like, where it is touched, and the truth that it reads.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::presses::{self, Press};
use super::{DesignError, Inputs, PRESS_SEED, Sensing, Workshop};
use crate::as_made::as_made;
use crate::board::{
    BoardOptions, Disturbances, Faults, HardestUse, PressScript, SimulatedBoard, fitting_gain,
};
use crate::budget::Watch;
use crate::draw::normal;
use crate::elasticity::respond;
use crate::elasticity::sensitivity::Sensitivity;
use crate::elasticity::{Push, Touch};
use crate::inference::calibration::noise_of_mean;
use crate::inference::{Chain, KnownPress};

/// In which what all channels drift by comes and goes (s).
const WANDER_S: f64 = 10.0;

/// What a simulated board of a project is like where nothing else is asked for.
#[must_use]
pub fn options(inputs: &Inputs, channels: usize) -> BoardOptions {
    BoardOptions {
        seed: inputs.project.budget.seed,
        rate_hz: 1000,
        chain: Chain::default(),
        channels,
        noise: inputs.project.gauge.noise(),
        drift: 0.1e-6,
        offset: 100e-6,
        disturbances: wandering(inputs.project.uncertainty().drift),
        tip_n: None,
        name: "Simulated board".into(),
    }
}

/// What all channels drift by together, as it comes and goes.
fn wandering(drift: f64) -> Disturbances {
    Disturbances {
        wander: (drift > 0.0).then_some((drift, WANDER_S)),
        ..Disturbances::default()
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

/// How long a board goes on whose end nobody has said, as far as its gain is to suit what drifts (s).
pub const LASTS_S: f64 = 600.0;

/// A simulated board as it is asked for.
pub struct BoardRequest {
    /// How its gauges are glued.
    pub workshop: Workshop,
    /// Who presses, and where.
    pub script: PressScript,
    /// What its gain is to suit; absent where the gain of the options stays.
    pub hardest: Option<HardestUse>,
    /// What it is like.
    pub options: BoardOptions,
    /// What goes wrong on the wire.
    pub faults: Faults,
}

/// The board that is asked for.
///
/// # Errors
/// As [`Sensing::reference`].
pub fn simulated(
    inputs: &Inputs,
    sensing: &Sensing,
    asked: BoardRequest,
    watch: Watch,
) -> Result<SimulatedBoard, DesignError> {
    let BoardRequest {
        workshop,
        script,
        hardest,
        mut options,
        faults,
    } = asked;
    let seed = inputs.project.budget.seed;
    let (reference, gains) =
        sensing.reference(inputs, &workshop.of(inputs.project.gluing()), seed, watch)?;
    let typical: Vec<Touch> = places(inputs, sensing, seed)?
        .into_iter()
        .take(300)
        .collect();
    if let Some(hardest) = hardest {
        let measured = (&options.chain, &options.disturbances);
        options.chain.gain = fitting_gain((&reference, &gains), &typical, hardest, measured);
    }
    Ok(SimulatedBoard::new(
        reference, gains, script, options, faults,
    ))
}

/// How far the part gives way under a tip at each of these touches (m/N), on the model that the simulated board reads.
///
/// # Errors
/// [`DesignError`] as for a simulation.
pub fn gives_way(
    inputs: &Inputs,
    sensing: &Sensing,
    touches: &[Touch],
    watch: Watch,
) -> Result<Vec<f64>, DesignError> {
    let model = sensing.model(inputs, watch)?;
    let gives = respond::gives_way(&*model, touches)
        .into_iter()
        .zip(touches);
    Ok(gives.map(|(give, touch)| give / touch.force).collect())
}

/// The known presses that are proposed, made by hand on such a board, as they are read: what the judge foresees of a
/// calibration. `truth` and `gains` are those of its gauges, and the seed is of the hand and the noise.
#[must_use]
pub fn pressed_by_hand(
    sensing: &Sensing,
    (truth, gains): (&Sensitivity, &[f64]),
    seed: u64,
) -> Vec<KnownPress> {
    let surface = &sensing.drawn.map.mesh;
    let (asked, off) = (sensing.proposed.clone(), &sensing.off);
    let noise = noise_of_mean(&vec![off.of_channel(); gains.len()]);
    let seed = seed.wrapping_add(PRESS_SEED);
    let presses = presses::by_hand(surface, asked, &off.pressing, seed);
    let made: Vec<Touch> = presses.iter().map(|press| press.made).collect();
    let made = as_made(&made, &off.making_of_presses(), seed.wrapping_add(1));
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(2));
    let mut known = |(press, push): (&Press, &Push)| {
        let read = truth.read_push(push).into_iter().zip(gains).zip(&noise);
        KnownPress {
            at: surface.index().nearest(press.asked.position).0,
            force: press.asked.force,
            reading: (read.map(|((x, gain), noise)| x * gain + noise * normal(&mut rng))).collect(),
        }
    };
    presses.iter().zip(&made).map(&mut known).collect()
}
