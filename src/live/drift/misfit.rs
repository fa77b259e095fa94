//! What a touch leaves of a reading because the model is off, and not because the rest is: it goes with the force, and stays
//! as long as the touch stays where it is.

use glam::DVec3;

use crate::inference::{SeveralTouches, TouchKind};

/// Metres within which a touch is where it was, and how much harder it may become before it is looked at again.
const STAYS: f64 = 6e-3;
const HARDER: f64 = 1.25;
/// How far what is left goes with the force, and a wide stretch of places with the reading; and for how many blocks such an
/// error stays the same: as one of that many it counts.
const DOUBT: f64 = 0.1;
const BLOCKS: f64 = 50.0;
/// The share of a reading by which a finger that stands and rolls a little comes to read otherwise than any touch would.
const ROLLS: f64 = 0.02;

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
    read: Vec<f64>,
    /// The ways in which it may be another one, and with them those of the touch that it was before.
    own: Vec<Vec<f64>>,
    ways: Vec<Vec<f64>>,
}

/// What may have come to the rest since a touch came to where it is.
pub(super) struct Beyond {
    /// Where it stands still: what is read is another than then by this (strain), but for the ways in which the touch may be
    /// another one.
    pub standing: Vec<f64>,
    /// Where it moves: what it leaves is another by this (strain).
    pub moving: Vec<f64>,
    /// How far that is in doubt (strain², a channel).
    pub doubt: Vec<f64>,
    /// The ways in which the touch may be another one (strain).
    pub ways: Vec<Vec<f64>>,
    /// Whether it is estimated to be where it was, and whether it has become harder.
    pub stays: bool,
    pub harder: bool,
}

/// A touch as it is estimated (m, N), and what it leaves of what is read (strain, both since the rest).
#[derive(Clone, Copy)]
pub(super) struct EstimatedTouch<'a> {
    pub place: DVec3,
    pub force: f64,
    pub is_area: bool,
    pub left: &'a [f64],
    pub read: &'a [f64],
}

impl<'a> EstimatedTouch<'a> {
    /// Of touches that leave so much of what is read (strain); nothing where they are several, or where one is is not known.
    pub fn of(touches: &SeveralTouches, [left, read]: [&'a [f64]; 2]) -> Option<Self> {
        let [touch] = &touches.contacts[..] else {
            return None;
        };
        touch.narrow.then_some(Self {
            place: touch.position,
            force: touch.force,
            is_area: matches!(touches.kind, TouchKind::Area(_)),
            left,
            read,
        })
    }
}

impl Misfit {
    /// What has come to what is read and left since a touch came to where it is; nothing while it comes.
    ///
    /// The ways in which it may be another one are those of when it came: taken anew as its estimate wanders, they would
    /// together leave no direction free, and the filter would be sure of what nobody has seen (first-estimate Jacobians:
    /// G. P. Huang, A. I. Mourikis and S. I. Roumeliotis, Int. J. Robotics Research 29, 2010). For the same reason a touch may
    /// stand still whatever its estimate does: that wanders with what is wrong with the rest, and what it then leaves would be
    /// taken for more of the same.
    pub fn beyond(
        &mut self,
        touch: EstimatedTouch<'_>,
        ways: impl FnOnce() -> Vec<Vec<f64>>,
    ) -> Option<Beyond> {
        let Some(found) = self.found.as_ref().filter(|f| f.is_area == touch.is_area) else {
            self.came(touch, ways());
            return None;
        };
        let share = touch.force / found.force;
        let was = || found.left.iter().map(|w| share * w);
        let since = |now: &[f64], then: &[f64]| now.iter().zip(then).map(|(x, w)| x - w).collect();
        Some(Beyond {
            standing: since(touch.read, &found.read),
            moving: touch.left.iter().zip(was()).map(|(x, w)| x - w).collect(),
            doubt: was().map(doubt).collect(),
            ways: found.ways.clone(),
            stays: found.place.distance(touch.place) < STAYS,
            harder: touch.force >= HARDER * found.force,
        })
    }

    /// A touch has come to where it is, with the ways in which it may be another one.
    pub fn came(&mut self, touch: EstimatedTouch<'_>, own: Vec<Vec<f64>>) {
        // What a drift puts into a touch makes it another one little by little: the ways of the one before stay free.
        let before = self.found.take().map_or_else(Vec::new, |before| before.own);
        // What the model lacks goes with the force.
        let harder = touch.left.iter().map(|w| (HARDER - 1.0) * w).collect();
        self.found = Some(FoundTouch {
            place: touch.place,
            force: touch.force,
            is_area: touch.is_area,
            left: touch.left.to_vec(),
            read: touch.read.to_vec(),
            ways: [own.clone(), before, vec![harder]].concat(),
            own,
        });
    }

    /// What a touch as hard as this (N) reads (strain) where it came to, by its estimate then; nothing of one that has become so
    /// much harder that it is another one: beside what is held a newton that is hardly felt may be fifty the next moment.
    pub fn reading(&self, force: f64) -> Option<Vec<f64>> {
        let found = (self.found.as_ref()).filter(|f| f.force > 0.0 && force < HARDER * f.force)?;
        let share = force / found.force;
        let pairs = found.read.iter().zip(&found.left);
        Some(pairs.map(|(read, left)| share * (read - left)).collect())
    }

    /// The touch is over.
    pub fn forget(&mut self) {
        self.found = None;
    }
}

/// How far what each channel reads of touches may be beside what their model says (strain, a standard deviation): of a single one
/// whose place is known a share of its load, as far as it may have become another one since it came; of others a share of what
/// they are thought to read or of what is read, whichever is more.
pub(super) fn off_by(
    touches: &SeveralTouches,
    load: &[f64],
    [reading, read]: [&[f64]; 2],
) -> Vec<f64> {
    if matches!(&touches.contacts[..], [touch] if touch.narrow) {
        return load.iter().map(|x| ROLLS * x.abs()).collect();
    }
    let pairs = reading.iter().zip(read);
    pairs.map(|(r, x)| DOUBT * r.abs().max(x.abs())).collect()
}

/// Of what is left of a wide stretch of places, whose touch reads so much (strain).
pub(super) fn doubt_of(reading: &[f64]) -> Vec<f64> {
    let squares: f64 = reading.iter().map(|x| x * x).sum();
    vec![doubt((squares / reading.len().max(1) as f64).sqrt()); reading.len()]
}

fn doubt(strain: f64) -> f64 {
    BLOCKS * (DOUBT * strain).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_reads_no_more_than_it_may_have_become_harder() {
        let mut misfit = Misfit::default();
        let touch = EstimatedTouch {
            place: DVec3::ZERO,
            force: 0.5,
            is_area: false,
            left: &[0.0, 1e-6],
            read: &[20e-6, 3e-6],
        };
        misfit.came(touch, Vec::new());
        let lighter = misfit.reading(0.25).expect("the same touch");
        assert!((lighter[0] - 10e-6).abs() < 1e-12 && (lighter[1] - 1e-6).abs() < 1e-12);
        assert!(misfit.reading(0.6).is_some());
        assert_eq!(misfit.reading(30.0), None);
    }
}
