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
    /// The repeats of a place: told by how near they are for the size of what was touched, and where touches lie in
    /// [`clumps`], each of them.
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
            Self::Place => clumps(targets).map_or_else(
                || repeats(targets),
                |clumps| places(targets, clumps.apart_mm),
            ),
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

/// The place of each touch that is repeated as exactly as a machine does (positions in mm), numbered as they first appear:
/// as [`Grouping::Place`], but of what is found again less exactly nothing is taken for one. Such touches may be averaged.
#[must_use]
pub fn repeats(targets: &[[f64; 3]]) -> Vec<usize> {
    places(targets, SAME * largest(extents(targets)))
}

/// Touches that lie in clumps which are far apart for their size, as repeats of a place do that is found again to some
/// tenths of a millimetre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clumps {
    /// How many there are.
    pub count: usize,
    /// A distance (mm) between that of touches in a clump and that of the clumps.
    pub apart_mm: f64,
}

/// Whether touches (positions in mm) lie in clumps: joined from the nearest pair on, hardly a distance is between those
/// within and those between, and no clump is as large as the gap. Of more touches than can be compared with each other
/// nothing is said.
#[must_use]
pub fn clumps(targets: &[[f64; 3]]) -> Option<Clumps> {
    /// Touches that are compared with each other.
    const MOST: usize = 8000;
    /// Joins that are exact but for so many times what counts as the same place.
    const NEARLY: f64 = 20.0;
    /// Fewer clumps than this may be anything; and a quarter of the touches at least repeat a place.
    const LEAST: usize = 4;
    /// Of so many groups one may be more, or less, than there are joins left: a place that another one is near, or a touch
    /// beside its place.
    const STRAY: usize = 10;
    let mut apart: Vec<[f64; 3]> = Vec::new();
    let same = points(targets);
    for (k, &point) in same.iter().enumerate() {
        if point == apart.len() {
            apart.push(targets[k]);
        }
    }
    let count = apart.len();
    if !(4 * LEAST..=MOST).contains(&count) {
        return None;
    }
    let joins = nearest_joins(&apart);
    // Where most repeats are exact, those that just missed it count with them: near that distance, and not any two
    // places that happen to be the nearest of all.
    let exact = targets.len() - count;
    let nearly = NEARLY * SAME * largest(extents(targets));
    let is_enough = |below: usize, at: f64| {
        below >= count / 4 || (below + exact >= targets.len() / 4 && at <= nearly)
    };
    let within = gap(&joins, LEAST, is_enough)?;
    let joined = joins.partition_point(|&join| join < within);
    let groups = places(&apart, within);
    let clumps = groups.iter().max().map_or(0, |most| most + 1);
    // Lines of a scan are joined by short steps too, but are long: their parts are more places than there are joins left.
    let left = count - joined;
    let is_compact = clumps.abs_diff(left) <= left / STRAY;
    is_compact.then_some(Clumps {
        count: clumps,
        apart_mm: within,
    })
}

/// The middle of the widest gap in lengths that rise, across which they leap: next to none of them lie in it, at least
/// `least` lie above, and `is_enough` says so of how many lie below and of the last of them.
fn gap(joins: &[f64], least: usize, is_enough: impl Fn(usize, f64) -> bool) -> Option<f64> {
    /// By how much the lengths leap: of few touches the nearest ones do so by chance.
    const LEAP: [f64; 2] = [4.0, 2.5];
    const MANY: usize = 100;
    /// One of so many may lie in the gap. Lengths between touches at random fill it: a quarter of them below it is not
    /// far enough from the few above.
    const WITHIN: usize = 50;
    let few = joins.len() / WITHIN;
    let least_leap = LEAP[usize::from(joins.len() >= MANY)];
    let ends: Vec<usize> = (0..joins.len())
        .filter(|&k| is_enough(k + 1, joins[k]))
        .collect();
    // The fewer lie in it the better: one more may only where none is wide enough.
    (0..=few).find_map(|strays| {
        let across = |&k: &usize| {
            let next = k + 1 + strays;
            (next + least <= joins.len()).then(|| (joins[k], joins[next]))
        };
        let leap = |(from, to): (f64, f64)| to / from.max(f64::MIN_POSITIVE);
        let gaps = ends.iter().filter_map(across);
        let widest = gaps.max_by(|&a, &b| leap(a).total_cmp(&leap(b)))?;
        (leap(widest) >= least_leap).then(|| (widest.0 * widest.1).sqrt())
    })
}

/// The lengths of the edges of the shortest tree that joins all points (Prim's algorithm), rising.
fn nearest_joins(points: &[[f64; 3]]) -> Vec<f64> {
    let squared =
        |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum() };
    let mut joins = Vec::with_capacity(points.len());
    // To the tree, of those that are not in it.
    let mut waiting: Vec<([f64; 3], f64)> = (points.iter().skip(1))
        .map(|&p| (p, squared(p, points[0])))
        .collect();
    while let Some(next) = (0..waiting.len()).min_by(|&a, &b| waiting[a].1.total_cmp(&waiting[b].1))
    {
        let (joined, distance) = waiting.swap_remove(next);
        joins.push(distance.sqrt());
        for (point, nearest) in &mut waiting {
            *nearest = nearest.min(squared(*point, joined));
        }
    }
    joins.sort_by(f64::total_cmp);
    joins
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
    let mut known = FoundPlaces {
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
struct FoundPlaces {
    reach: f64,
    /// The first touch of each place.
    firsts: Vec<[f64; 3]>,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl FoundPlaces {
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
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::draw::normal;

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
        // On a skin that is not flat depths are at one place where they are near each other for how far places are apart.
        let round = pressed(|x, y| 0.02 * x * y, 1.5);
        let wanted: Vec<usize> = (0..75).map(|k| k % 25).collect();
        assert_eq!(Grouping::Place.of(&round), wanted);
        let deep = pressed(|x, y| 0.02 * x * y, 4.0);
        assert_eq!(Grouping::Place.of(&deep), Grouping::Touch.of(&deep));
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

    /// Ten presses at each of forty places of a tube, found again to so many millimetres.
    fn again(off: f64) -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let places: Vec<[f64; 3]> = (0..40)
            .map(|k| {
                let (a, z) = (f64::from(k) * 2.4, 100.0 * rng.random::<f64>());
                [30.0 * a.cos(), 30.0 * a.sin(), z]
            })
            .collect();
        (0..400)
            .map(|k| places[k % 40].map(|x| x + off * normal(&mut rng)))
            .collect()
    }

    #[test]
    fn presses_that_find_a_place_again_to_some_tenths_are_told() {
        for off in [0.02, 0.1] {
            let found = clumps(&again(off)).unwrap();
            assert_eq!(found.count, 40);
            assert!((3.0 * off..8.0).contains(&found.apart_mm), "{found:?}");
            let grouped = Grouping::Within(found.apart_mm).of(&again(off));
            assert_eq!(grouped.iter().max(), Some(&39));
        }
    }

    /// Presses of a probe that finds a place again to 0.2 mm, at 160 places of which some are 2 mm apart: neither the
    /// farthest repeats nor the nearest places leave a gap that nothing lies in.
    #[test]
    fn a_few_places_that_others_are_near_hide_no_clumps() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut places: Vec<[f64; 3]> = Vec::new();
        while places.len() < 160 {
            let at = [0, 1, 2].map(|axis| {
                let extent = if axis == 2 { 3.0 } else { 80.0 };
                extent * rng.random::<f64>()
            });
            let far = |p: &[f64; 3]| (0..3).map(|k| (p[k] - at[k]).powi(2)).sum::<f64>() > 4.0;
            if places.iter().all(far) {
                places.push(at);
            }
        }
        let touches: Vec<[f64; 3]> = (0..800)
            .map(|k| places[k % 160].map(|x| x + 0.2 * normal(&mut rng)))
            .collect();
        let found = clumps(&touches).unwrap();
        assert!((130..=176).contains(&found.count), "{found:?}");
        let groups = Grouping::Place.of(&touches);
        let apart = (160..800).filter(|&k| groups[k] != groups[k % 160]).count();
        assert!(apart < 32, "{apart}");
    }

    #[test]
    fn presses_of_a_place_are_one_group_however_exactly_it_is_found_again() {
        for off in [0.0, 2e-4, 1e-3, 5e-3, 0.05] {
            let groups = Grouping::Place.of(&again(off));
            let wanted: Vec<usize> = (0..400).map(|k| k % 40).collect();
            assert_eq!(groups, wanted, "{off}");
        }
    }

    #[test]
    fn touches_all_over_scans_and_exact_repeats_are_no_clumps() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let all: Vec<[f64; 3]> = (0..500)
            .map(|_| [0, 1, 2].map(|_| 100.0 * rng.random::<f64>()))
            .collect();
        assert_eq!(clumps(&all), None);
        let scan: Vec<[f64; 3]> = (0..500)
            .map(|k| [f64::from(k % 50), 8.0 * f64::from(k / 50), 0.0])
            .collect();
        assert_eq!(clumps(&scan), None);
        assert_eq!(clumps(&again(0.0)), None);
        // The two nearest of many places that are each pressed twice may lie close by chance.
        for seed in 0..40 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let once: Vec<[f64; 3]> = (0..100)
                .map(|_| {
                    [
                        100.0 * rng.random::<f64>(),
                        100.0 * rng.random::<f64>(),
                        0.0,
                    ]
                })
                .collect();
            assert_eq!(clumps(&[&once[..], &once].concat()), None, "{seed}");
        }
        // Touches drawn at random, along a line, all over a skin or all through a body.
        for seed in 0..60 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let extents = [[100.0, 1.0, 0.0], [100.0, 60.0, 0.0], [100.0, 80.0, 60.0]];
            let count = 40 + 12 * seed as usize;
            let drawn = |extent: f64, rng: &mut ChaCha8Rng| extent * rng.random::<f64>();
            let touches: Vec<[f64; 3]> = (0..count)
                .map(|_| extents[seed as usize % 3].map(|extent| drawn(extent, &mut rng)))
                .collect();
            assert_eq!(clumps(&touches), None, "{seed}");
        }
        assert_eq!(clumps(&[[1.0; 3]; 30]), None);
    }
}
