//! Touches by place: what is one touch, pressed again, is one reading.

use glam::DVec3;

use crate::regression::folds::number_of;
use crate::regression::places::{points, repeats};

/// Touches by place, with one reading for each, per newton where forces are known.
///
/// On a flat skin presses of several depths lie at one place, and read otherwise: where forces say how much, they are
/// repeats; where nothing does, each depth is a place of its own.
pub(super) struct Merged {
    /// mm.
    pub positions: Vec<DVec3>,
    /// For each place the touches there, with what each weighs in a reading.
    pub touches: Vec<Vec<(usize, f64)>>,
    /// Places of the same group differ by depth alone: none tells how another would have been guessed.
    pub groups: Vec<usize>,
}

impl Merged {
    /// Merges touches by their places (mm), weighted by their forces (N) where these are known.
    pub fn new(targets: &[[f64; 3]], forces: Option<&[f64]>) -> Self {
        let along_the_skin = repeats(targets);
        let places = if forces.is_some() {
            along_the_skin.clone()
        } else {
            points(targets)
        };
        let mut members = vec![Vec::new(); number_of(&places)];
        for (touch, &place) in places.iter().enumerate() {
            members[place].push(touch);
        }
        let force = |t: usize| forces.map_or(1.0, |f| f[t]);
        let weighed = |touches: &Vec<usize>| {
            let squares: f64 = touches.iter().map(|&t| force(t).powi(2)).sum();
            let weight = |&t: &usize| (t, force(t) / squares.max(f64::MIN_POSITIVE));
            touches.iter().map(weight).collect()
        };
        Self {
            positions: (members.iter())
                .map(|m| DVec3::from_array(targets[m[0]]))
                .collect(),
            groups: members.iter().map(|m| along_the_skin[m[0]]).collect(),
            touches: members.iter().map(weighed).collect(),
        }
    }

    /// Number of places.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// The reading at a place, from those of all touches.
    pub fn value(&self, readings: &[f64], place: usize) -> f64 {
        let touches = self.touches[place].iter();
        touches.map(|&(t, weight)| weight * readings[t]).sum()
    }

    /// Places all of whose touches are among some, which rise. Where there are none, places with one of them; and
    /// where there are none of these either, all: something has to be looked at.
    pub fn among(&self, some: Option<&[usize]>) -> Vec<usize> {
        let all = || 0..self.len();
        let Some(some) = some else {
            return all().collect();
        };
        let one = |(t, _): &(usize, f64)| some.binary_search(t).is_ok();
        let mut found: Vec<usize> = all().filter(|&k| self.touches[k].iter().all(one)).collect();
        if found.is_empty() {
            found = all().filter(|&k| self.touches[k].iter().any(one)).collect();
        }
        if found.is_empty() {
            found = all().collect();
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [9.0, 0.0, 0.0],
        [0.0, 9.0, 0.0],
        [0.0, 0.0, 1.0],
        [9.0, 0.0, 0.0],
    ];

    #[test]
    fn depths_are_repeats_only_where_forces_tell_them_apart() {
        let by_force = Merged::new(&SKIN, Some(&[1.0, 1.0, 1.0, 3.0, 1.0]));
        assert_eq!(by_force.len(), 3);
        assert_eq!(by_force.groups, [0, 1, 2]);
        // Per newton: (1 · 2 + 3 · 6) / (1 + 9).
        let value = by_force.value(&[2.0, 0.0, 0.0, 6.0, 0.0], 0);
        assert!((value - 2.0).abs() < 1e-12, "{value}");
        let as_they_are = Merged::new(&SKIN, None);
        assert_eq!(as_they_are.len(), 4);
        assert_eq!(as_they_are.groups, [0, 1, 2, 0]);
    }

    #[test]
    fn some_places_are_always_left() {
        let merged = Merged::new(&SKIN, None);
        assert_eq!(merged.among(None), [0, 1, 2, 3]);
        assert_eq!(merged.among(Some(&[0, 1, 4])), [0, 1]);
        assert_eq!(merged.among(Some(&[1])), [1]);
        assert_eq!(merged.among(Some(&[])), [0, 1, 2, 3]);
    }
}
