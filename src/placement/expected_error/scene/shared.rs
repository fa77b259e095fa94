//! What all sites feel of a touch together, beside its place and force: how its tip and its push are made, and what all
//! channels have drifted by. Enough gauges tell that apart from the place, which a variance of each cannot say.

use super::places::draws;

/// Nuisances that a touch may have: a tip of another size, and a force along the surface in two directions.
pub const NUISANCES: usize = 3;
/// Beyond the draws of the gauges' noise.
const MADE_SEED: u64 = 0x5ab1e;

/// What is felt together.
pub struct SharedUnknowns<'a> {
    /// What a site reads (site, touch) where each nuisance is off by the deviation that the estimator allows for, in the
    /// signal's unit and at the force of the touch.
    pub felt: &'a (dyn Fn(usize, usize) -> [f64; NUISANCES] + Sync),
    /// How far off each of them really is, over what is allowed for; absent where it is not off at all.
    pub nuisances: [Option<f64>; NUISANCES],
    /// Standard deviation of what all channels have drifted by, in the signal's unit.
    pub drift: f64,
}

/// Something to be found of a touch beside place and force, of unit deviation for whoever looks for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::placement::expected_error) enum TouchUnknown {
    /// A nuisance of the touch, which grows with its force: its number, and how far off it really is.
    OfTouch(usize, f64),
    /// What every channel has drifted by (in units of readings), whatever touches.
    Drift(f64),
}

impl TouchUnknown {
    /// Its number, of what grows with the touch.
    pub fn of_touch(self) -> Option<usize> {
        match self {
            Self::OfTouch(nuisance, _) => Some(nuisance),
            Self::Drift(_) => None,
        }
    }

    /// What every channel reads of one deviation, of what does not.
    pub fn drift(self) -> Option<f64> {
        match self {
            Self::Drift(reading) => Some(reading),
            Self::OfTouch(..) => None,
        }
    }

    /// Standard deviation of what it really is, over the one that it is thought to have.
    pub fn made(self) -> f64 {
        match self {
            Self::OfTouch(_, made) => made,
            Self::Drift(_) => 1.0,
        }
    }
}

impl SharedUnknowns<'_> {
    /// What there is to find, those of the touch first; readings are multiplied by `unit`.
    pub(super) fn unknowns(&self, unit: f64) -> Vec<TouchUnknown> {
        let nuisances = self.nuisances.iter().enumerate();
        let mut all: Vec<TouchUnknown> = nuisances
            .filter_map(|(k, made)| Some(TouchUnknown::OfTouch(k, (*made)?)))
            .collect();
        all.extend((self.drift > 0.0).then_some(TouchUnknown::Drift(self.drift * unit)));
        all
    }
}

/// What each unknown of each press really is: unknowns × presses.
pub(super) fn made(unknowns: &[TouchUnknown], presses: usize, seed: u64) -> Vec<f32> {
    let drawn = draws(unknowns.len(), presses, seed.wrapping_add(MADE_SEED));
    let scaled = drawn.chunks_exact(presses.max(1)).zip(unknowns);
    scaled
        .flat_map(|(row, unknown)| row.iter().map(|d| d * unknown.made() as f32))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_allowed_for_and_does_not_come_is_to_be_found_and_is_nothing() {
        let shared = SharedUnknowns {
            felt: &|_, _| [1.0; NUISANCES],
            nuisances: [None, Some(0.0), Some(0.5)],
            drift: 3.0,
        };
        let unknowns = shared.unknowns(2.0);
        let wanted = [
            TouchUnknown::OfTouch(1, 0.0),
            TouchUnknown::OfTouch(2, 0.5),
            TouchUnknown::Drift(6.0),
        ];
        assert_eq!(unknowns, wanted);
        let made = made(&unknowns, 4000, 7);
        let spread = |of: &[f32]| (of.iter().map(|v| v * v).sum::<f32>() / 4000.0).sqrt();
        let spreads: Vec<f32> = made.chunks_exact(4000).map(spread).collect();
        assert!(
            spreads[0] == 0.0 && (spreads[1] - 0.5).abs() < 0.02 && (spreads[2] - 1.0).abs() < 0.04
        );
    }
}
