//! How readings change around each place: what its neighbours weigh in the two slopes along the surface, and in what
//! would be guessed there without it.

use crate::bounds::Bounds;
use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

/// Neighbours that slopes are taken from.
const NEIGHBOURS: usize = 9;

/// Finds the neighbours of places, which stand in the order of one coordinate for that.
pub(super) struct Around<'a> {
    positions: &'a [DVec3],
    /// Places of one group are no neighbours of each other.
    groups: &'a [usize],
    axis: usize,
    order: Vec<usize>,
    /// Where each place stands in that order.
    ranks: Vec<usize>,
}

/// A neighbour, and what it weighs.
pub(super) struct PlaceNeighbour {
    pub place: usize,
    /// In both slopes (1/mm), of the difference to it.
    pub slopes: [f64; 2],
    /// In what would be guessed from the neighbours alone.
    pub guess: f64,
}

/// A place's neighbours, and the two directions (of unit length) that slopes are along.
pub(super) struct PlaceSurroundings {
    pub plane: [DVec3; 2],
    pub neighbours: Vec<PlaceNeighbour>,
}

impl<'a> Around<'a> {
    /// Sorts places (mm) along the longest side of their bounds; `groups` has the group of each.
    pub fn new(positions: &'a [DVec3], groups: &'a [usize]) -> Self {
        let axis = longest(Bounds::around(positions.iter().copied()).size());
        let mut order: Vec<usize> = (0..positions.len()).collect();
        order.sort_by(|&a, &b| positions[a][axis].total_cmp(&positions[b][axis]));
        let mut ranks = vec![0; order.len()];
        for (rank, &place) in order.iter().enumerate() {
            ranks[place] = rank;
        }
        Self {
            positions,
            groups,
            axis,
            order,
            ranks,
        }
    }

    /// What lies around a place; no neighbours where it is alone.
    pub fn of(&self, at: usize) -> PlaceSurroundings {
        let near = self.nearest(at);
        let offsets: Vec<DVec3> = (near.iter())
            .map(|&k| self.positions[k] - self.positions[at])
            .collect();
        if offsets.is_empty() {
            return PlaceSurroundings {
                plane: [DVec3::X, DVec3::Y],
                neighbours: Vec::new(),
            };
        }
        let plane = plane(&offsets);
        let flat: Vec<[f64; 2]> = (offsets.iter())
            .map(|o| plane.map(|axis| o.dot(axis)))
            .collect();
        let weights = slope_weights(&flat).into_iter().zip(guess_weights(&flat));
        let neighbours = near.iter().zip(weights);
        PlaceSurroundings {
            plane,
            neighbours: neighbours
                .map(|(&place, (slopes, guess))| PlaceNeighbour {
                    place,
                    slopes,
                    guess,
                })
                .collect(),
        }
    }

    /// The nearest others, the nearest first: along the one coordinate to both sides, until nothing nearer can come.
    fn nearest(&self, at: usize) -> Vec<usize> {
        let centre = self.positions[at];
        let along = |place: usize| self.positions[place][self.axis];
        let gap = |rank: usize| (along(self.order[rank]) - along(at)).abs();
        let (mut below, mut above) = (self.ranks[at], self.ranks[at] + 1);
        let mut near: Vec<(f64, usize)> = Vec::with_capacity(NEIGHBOURS + 1);
        loop {
            let down = below.checked_sub(1).map(&gap);
            let up = (above < self.order.len()).then(|| gap(above));
            let downwards = down.is_some_and(|d| up.is_none_or(|u| d <= u));
            let Some(nearer) = (if downwards { down } else { up }) else {
                break;
            };
            let full = near.len() == NEIGHBOURS;
            if full && near.last().is_some_and(|far| nearer * nearer > far.0) {
                break;
            }
            let rank = if downwards {
                below -= 1;
                below
            } else {
                above += 1;
                above - 1
            };
            let place = self.order[rank];
            if self.groups[place] == self.groups[at] {
                continue;
            }
            let away = self.positions[place].distance_squared(centre);
            let nearer = |n: &(f64, usize)| n.0.total_cmp(&away).then(n.1.cmp(&place)).is_lt();
            near.insert(near.partition_point(nearer), (away, place));
            near.truncate(NEIGHBOURS);
        }
        near.into_iter().map(|(_, place)| place).collect()
    }
}

/// The coordinate that reaches farthest.
pub(super) fn longest(extent: DVec3) -> usize {
    let most = extent.max_element();
    (0..3).find(|&a| extent[a] >= most).unwrap_or(0)
}

/// The two directions in which neighbours lie most.
fn plane(offsets: &[DVec3]) -> [DVec3; 2] {
    let mut spread = Matrix3::zeros();
    for o in offsets {
        let o = nalgebra::Vector3::new(o.x, o.y, o.z);
        spread += o * o.transpose();
    }
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    [order[0], order[1]].map(|k| {
        let v = eigen.eigenvectors.column(k);
        DVec3::new(v[0], v[1], v[2])
    })
}

/// What the differences to neighbours weigh in the slopes, by least squares; nothing in a direction that no
/// neighbour lies in.
fn slope_weights(flat: &[[f64; 2]]) -> Vec<[f64; 2]> {
    /// Over the larger spread.
    const RIDGE: f64 = 1e-4;
    let sum = |i: usize, j: usize| flat.iter().map(|p| p[i] * p[j]).sum::<f64>();
    let ridge = RIDGE * (sum(0, 0) + sum(1, 1));
    let (a, b, c) = (sum(0, 0) + ridge, sum(0, 1), sum(1, 1) + ridge);
    let determinant = (a * c - b * b).max(f64::MIN_POSITIVE);
    (flat.iter())
        .map(|[x, y]| [(c * x - b * y) / determinant, (a * y - b * x) / determinant])
        .collect()
}

/// What neighbours weigh in a linear function through them, by least squares, in the middle that they lie around.
fn guess_weights(flat: &[[f64; 2]]) -> Vec<f64> {
    let share = (flat.len() as f64).recip();
    let mean = [0, 1].map(|i| share * flat.iter().map(|p| p[i]).sum::<f64>());
    let centred: Vec<[f64; 2]> = (flat.iter())
        .map(|p| [p[0] - mean[0], p[1] - mean[1]])
        .collect();
    (slope_weights(&centred).iter())
        .map(|w| share - w[0] * mean[0] - w[1] * mean[1])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(count: u32) -> Vec<DVec3> {
        let at = |k: u32| {
            let k = f64::from(k);
            DVec3::new(
                60.0 * (k * 0.754_877).fract(),
                110.0 * (k * 0.569_840).fract(),
                3.0 * (k * 0.381_966).fract(),
            )
        };
        (1..=count).map(at).collect()
    }

    #[test]
    fn neighbours_are_the_nearest_of_other_groups() {
        let positions = scattered(300);
        let groups: Vec<usize> = (0..300).map(|k| k / 2).collect();
        let around = Around::new(&positions, &groups);
        for at in [0, 17, 131, 299] {
            let mut wanted: Vec<usize> = (0..300).filter(|k| groups[*k] != groups[at]).collect();
            let away = |k: &usize| positions[*k].distance_squared(positions[at]);
            wanted.sort_by(|a, b| away(a).total_cmp(&away(b)));
            assert_eq!(around.nearest(at), wanted[..NEIGHBOURS]);
        }
        let alone = Around::new(&positions[..4], &[0; 4]).of(2);
        assert!(alone.neighbours.is_empty());
    }

    #[test]
    fn what_is_linear_is_guessed_and_has_its_slopes() {
        let mut positions = scattered(200);
        for p in &mut positions {
            p.z = 2.0;
        }
        let groups: Vec<usize> = (0..200).collect();
        let around = Around::new(&positions, &groups);
        let slope = DVec3::new(0.3, -0.2, 0.0);
        let value = |k: usize| 5.0 + positions[k].dot(slope);
        for at in [0, 60, 199] {
            let PlaceSurroundings { plane, neighbours } = around.of(at);
            let guessed: f64 = neighbours.iter().map(|n| n.guess * value(n.place)).sum();
            // To the ridge.
            assert!((guessed - value(at)).abs() < 0.02, "{guessed}");
            for (k, axis) in plane.into_iter().enumerate() {
                let rise = |n: &PlaceNeighbour| n.slopes[k] * (value(n.place) - value(at));
                let found: f64 = neighbours.iter().map(rise).sum();
                assert!((found - slope.dot(axis)).abs() < 1e-3, "{found}");
            }
        }
    }
}
