//! How much a simulated board's amplifier gains: what is asked of it has to stay within the converter's range.

use super::Disturbances;
use crate::elasticity::Touch;
use crate::elasticity::sensitivity::Sensitivity;
use crate::inference::Chain;

/// Of the half of the range, what a touch fills of it where nothing else is read.
const FILLED: f64 = 0.8;
/// An amplifier has no less, and no more.
const LEAST: f64 = 1.0;
const MOST: f64 = 5000.0;

/// What a gain is to suit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardestUse {
    /// The hardest touch (N).
    pub force: f64,
    /// How long channels drift before the board is tared again (s).
    pub seconds: f64,
}

/// A gain (of the amplifier) with which most touches at these places stay within the range, as hard as they may be, and
/// however far channels are off beside them.
#[must_use]
pub fn fitting_gain(
    (sensitivity, gains): (&Sensitivity, &[f64]),
    touches: &[Touch],
    hardest: HardestUse,
    (chain, disturbances): (&Chain, &Disturbances),
) -> f64 {
    /// Of the touches.
    const MOST_TOUCHES: f64 = 0.95;
    let largest = |t: &Touch| {
        let force = hardest.force;
        let read = sensitivity.read(&Touch { force, ..*t });
        let felt = read.iter().zip(gains).map(|(s, g)| (s * g).abs());
        felt.fold(0.0_f64, f64::max)
    };
    let mut strains: Vec<f64> = touches.iter().map(largest).collect();
    strains.sort_by(f64::total_cmp);
    let at = (strains.len() as f64 * MOST_TOUCHES) as usize;
    let strain = strains.get(at).copied().unwrap_or(1e-3);
    gain_for(strain, disturbances.most(hardest.seconds), chain)
}

/// Of a strain that is felt, and how far channels are off beside it.
fn gain_for(strain: f64, off: f64, chain: &Chain) -> f64 {
    let half_range = f64::from(chain.highest_count()) / 2.0;
    let needed = (strain.max(1e-6) / FILLED).max(strain + off);
    let unit = Chain {
        gain: 1.0,
        ..*chain
    };
    (half_range / (needed * unit.counts_per_strain()))
        .clamp(LEAST, MOST)
        .floor()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a strain makes of the half of the range.
    fn filled(strain: f64, chain: Chain, gain: f64) -> f64 {
        let counts = strain * Chain { gain, ..chain }.counts_per_strain();
        2.0 * counts / f64::from(chain.highest_count())
    }

    #[test]
    fn what_drifts_until_the_end_leaves_room_for_the_hardest_touch() {
        let chain = Chain {
            bits: 16,
            ..Chain::default()
        };
        let (touch, still) = (500e-6, gain_for(500e-6, 0.0, &chain));
        assert!((filled(touch, chain, still) - FILLED).abs() < 0.01);
        let warming = Disturbances {
            warming: -2e-6,
            ..Disturbances::default()
        };
        // A minute's drift fits beside it anyway; ten minutes' take a lower gain, and no lower than they need.
        assert_eq!(gain_for(touch, warming.most(60.0), &chain), still);
        let lower = gain_for(touch, warming.most(600.0), &chain);
        let all = filled(touch + 2e-6 * 600.0, chain, lower);
        assert!((0.98..=1.0).contains(&all), "{all}");
    }

    #[test]
    fn what_is_drawn_may_be_larger_than_its_deviation() {
        let drawn = Disturbances {
            warming_apart: 1e-6,
            wander: Some((20e-6, 30.0)),
            hum: Some((5e-6, 50.0)),
            ..Disturbances::default()
        };
        assert!((drawn.most(100.0) - (5e-6 + 3.0 * 120e-6)).abs() < 1e-12);
    }
}
