//! What a touch leaves of a reading because the model is off, and not because the rest is: it goes with the force, and stays
//! as long as the touch stays where it is.

use glam::DVec3;

/// Metres within which a touch is where it was, and how much harder it may become before it is looked at again.
const STAYS: f64 = 6e-3;
const HARDER: f64 = 1.25;
/// How far what is left goes with the force, and a wide stretch of places with the reading; and for how many blocks such an
/// error stays the same: as one of that many it counts.
const DOUBT: f64 = 0.1;
const BLOCKS: f64 = 50.0;

/// What was left when the touch came to where it is.
#[derive(Default)]
pub(super) struct Misfit {
    found: Option<(DVec3, f64, Vec<f64>)>,
}

impl Misfit {
    /// What has come to what is left of a touch (m, N, strain) since it came to where it is, and how far that is in doubt
    /// (strain², a channel); nothing while it comes.
    pub fn beyond(
        &mut self,
        place: DVec3,
        force: f64,
        left: &[f64],
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let stays = |(at, of, _): &&(DVec3, f64, Vec<f64>)| {
            at.distance(place) < STAYS && force < HARDER * of
        };
        let Some((_, of, was)) = self.found.as_ref().filter(stays) else {
            self.found = Some((place, force, left.to_vec()));
            return None;
        };
        let share = force / of;
        let beyond = left.iter().zip(was).map(|(x, w)| x - share * w);
        Some((
            beyond.collect(),
            was.iter().map(|w| doubt(share * w)).collect(),
        ))
    }

    /// The touch is over.
    pub fn forget(&mut self) {
        self.found = None;
    }
}

/// Of what is left of a wide stretch of places, whose touch reads so much (strain).
pub(super) fn doubt_of(reading: &[f64]) -> Vec<f64> {
    let squares: f64 = reading.iter().map(|x| x * x).sum();
    vec![doubt((squares / reading.len().max(1) as f64).sqrt()); reading.len()]
}

fn doubt(strain: f64) -> f64 {
    BLOCKS * (DOUBT * strain).powi(2)
}
