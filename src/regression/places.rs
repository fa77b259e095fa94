//! Which touches are repeats of one place.
//!
//! A model that has learned from one press and is judged on the next at the same place is asked for what it was
//! told. Whoever splits touches between learning and judging therefore keeps the repeats of a place together.

use std::collections::HashMap;

use serde::Serialize;

/// What stays whole when touches are split between learning and judging.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grouping {
    /// Each touch by itself.
    Touch,
    /// The repeats of a place, told by how near they are for the size of what was touched.
    #[default]
    Place,
    /// Touches no farther apart than this (mm).
    Within(f64),
}

impl Grouping {
    /// As on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Place | Self::Within(_) => "place",
        }
    }

    /// The group of each touch (positions in mm), numbered as they first appear.
    #[must_use]
    pub fn of(self, targets: &[[f64; 3]]) -> Vec<usize> {
        match self {
            Self::Touch => (0..targets.len()).collect(),
            Self::Place => places(targets, SAME * largest(extents(targets))),
            Self::Within(mm) => places(targets, mm),
        }
    }
}

/// The point that each touch lies at (positions in mm), numbered as they first appear: as [`Grouping::Place`], but
/// presses of several depths are apart, on a flat skin too. Only those that are not may be averaged.
#[must_use]
pub fn points(targets: &[[f64; 3]]) -> Vec<usize> {
    grouped(targets, SAME * largest(extents(targets)), None)
}

/// Touches nearer than this share of the extent of all lie at one place. A probing machine comes back to a place
/// to a few millionths of its reach; thousands of touches drawn at random come no nearer by chance.
const SAME: f64 = 1e-5;
/// Touches are those of a flat skin where their thinnest extent is at most this share of the next.
const FLAT: f64 = 0.25;

/// The place of each touch: the first whose first touch is no farther than `reach` (mm). On a flat skin presses of
/// several depths are at one place.
fn places(targets: &[[f64; 3]], reach: f64) -> Vec<usize> {
    grouped(targets, reach, depth(extents(targets)))
}

/// The group of each touch: the first whose first touch is no farther than `reach` (mm), whatever its place along
/// the axis that does not count.
fn grouped(targets: &[[f64; 3]], reach: f64, without: Option<usize>) -> Vec<usize> {
    let mut known = Known {
        reach,
        firsts: Vec::new(),
        cells: HashMap::new(),
    };
    let along_the_skin = |target: &[f64; 3]| {
        let mut at = *target;
        if let Some(axis) = without {
            at[axis] = 0.0;
        }
        at
    };
    targets
        .iter()
        .map(|target| known.place(along_the_skin(target)))
        .collect()
}

/// Largest less smallest value of each coordinate.
fn extents(targets: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|a| {
        let values = targets.iter().map(|t| t[a]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        (high - low).max(0.0)
    })
}

fn largest(extents: [f64; 3]) -> f64 {
    extents.into_iter().fold(0.0, f64::max)
}

/// The axis across a flat skin, along which it is pressed.
fn depth(extents: [f64; 3]) -> Option<usize> {
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extents[a].total_cmp(&extents[b]));
    (extents[axes[0]] <= FLAT * extents[axes[1]]).then_some(axes[0])
}

/// The places found so far, in cells as wide as their reach: what is near lies in a cell or beside it.
struct Known {
    reach: f64,
    /// The first touch of each place.
    firsts: Vec<[f64; 3]>,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl Known {
    /// The place of a touch; a new one where none is near.
    fn place(&mut self, at: [f64; 3]) -> usize {
        let cell = at.map(|v| (v / self.reach).floor() as i64);
        if let Some(place) = self.nearby(cell, at) {
            return place;
        }
        self.firsts.push(at);
        let place = self.firsts.len() - 1;
        self.cells.entry(cell).or_default().push(place);
        place
    }

    fn nearby(&self, cell: [i64; 3], at: [f64; 3]) -> Option<usize> {
        let near = |place: &usize| {
            let first = self.firsts[*place];
            let squared: f64 = (0..3).map(|a| (first[a] - at[a]).powi(2)).sum();
            squared <= self.reach * self.reach
        };
        (0..27)
            .filter_map(|k| {
                let beside = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1];
                let cell = [0, 1, 2].map(|a| cell[a].saturating_add(beside[a]));
                let places = self.cells.get(&cell)?;
                places.iter().copied().filter(near).min()
            })
            .min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Touches on a grid of a round skin and of a flat one, each pressed three times.
    fn pressed(height: impl Fn(f64, f64) -> f64, depth: f64) -> Vec<[f64; 3]> {
        let grid = (0..25).map(|k| (f64::from(k / 5) * 10.0, f64::from(k % 5) * 10.0));
        let grid: Vec<[f64; 3]> = grid.map(|(x, y)| [x, y, height(x, y)]).collect();
        let press = |turn: usize| {
            let off = turn as f64 * 2e-5;
            let deeper = turn as f64 * depth;
            grid.iter().map(move |p| [p[0] + off, p[1], p[2] + deeper])
        };
        (0..3).flat_map(press).collect()
    }

    #[test]
    fn presses_of_one_place_are_one_group_and_others_are_not() {
        for touches in [pressed(|x, y| 0.02 * x * y, 0.0), pressed(|_, _| 0.0, 1.5)] {
            let groups = Grouping::Place.of(&touches);
            let wanted: Vec<usize> = (0..75).map(|k| k % 25).collect();
            assert_eq!(groups, wanted);
        }
        // Depth is a place of its own where the skin is not flat.
        let round = pressed(|x, y| 0.02 * x * y, 1.5);
        assert_eq!(Grouping::Place.of(&round), Grouping::Touch.of(&round));
        // And where they are to be averaged, on a flat skin too.
        let flat = pressed(|_, _| 0.0, 1.5);
        assert_eq!(points(&flat), Grouping::Touch.of(&flat));
        let repeated = pressed(|_, _| 0.0, 0.0);
        assert_eq!(points(&repeated), Grouping::Place.of(&repeated));
        let coarse = Grouping::Within(15.0).of(&round);
        assert!(*coarse.iter().max().unwrap() < 12);
    }

    #[test]
    fn touches_at_random_are_groups_of_their_own() {
        let touches: Vec<[f64; 3]> = (1..=4000)
            .map(|k| {
                let k = f64::from(k);
                let x = 60.0 * (k * 0.754_877).fract();
                let y = 110.0 * (k * 0.569_840).fract();
                [x, y, 9.0]
            })
            .collect();
        assert_eq!(Grouping::Place.of(&touches), Grouping::Touch.of(&touches));
        let same = vec![[1.0, 2.0, 3.0]; 50];
        assert_eq!(Grouping::Place.of(&same), vec![0; 50]);
    }
}
