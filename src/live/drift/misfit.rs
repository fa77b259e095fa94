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
    found: Option<FoundTouch>,
}

/// A touch as it came to where it is.
struct FoundTouch {
    place: DVec3,
    force: f64,
    is_area: bool,
    left: Vec<f64>,
    /// The ways in which it may be another one, and with them those of the touch that it was before.
    own: Vec<Vec<f64>>,
    ways: Vec<Vec<f64>>,
}

/// What has come to what a touch leaves (strain), how far that is in doubt (strain², a channel), and the ways in which the
/// touch may be another one (strain).
type Beyond = (Vec<f64>, Vec<f64>, Vec<Vec<f64>>);

impl Misfit {
    /// What has come to what is left (strain) of a touch (m, N, whether it is an area) since it came to where it is; nothing
    /// while it comes.
    ///
    /// The ways in which it may be another one are those of when it came: taken anew as its estimate wanders, they would
    /// together leave no direction free, and the filter would be sure of what nobody has seen (first-estimate Jacobians:
    /// G. P. Huang, A. I. Mourikis and S. I. Roumeliotis, Int. J. Robotics Research 29, 2010).
    pub fn beyond(
        &mut self,
        (place, force, is_area): (DVec3, f64, bool),
        left: &[f64],
        ways: impl FnOnce() -> Vec<Vec<f64>>,
    ) -> Option<Beyond> {
        let stays = |f: &&FoundTouch| {
            f.is_area == is_area && f.place.distance(place) < STAYS && force < HARDER * f.force
        };
        let Some(found) = self.found.as_ref().filter(stays) else {
            let own = ways();
            // What a drift puts into a touch makes it another one little by little: the ways of the one before stay free.
            let before = self.found.take().map_or_else(Vec::new, |before| before.own);
            self.found = Some(FoundTouch {
                place,
                force,
                is_area,
                left: left.to_vec(),
                ways: [own.clone(), before].concat(),
                own,
            });
            return None;
        };
        let share = force / found.force;
        let was = || found.left.iter().map(|w| share * w);
        Some((
            left.iter().zip(was()).map(|(x, w)| x - w).collect(),
            was().map(doubt).collect(),
            found.ways.clone(),
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
