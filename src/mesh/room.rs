//! How large a ball gets from outside to a place of a part, whichever way it takes.
//!
//! Distances to the surface on a grid say how large a ball has room at each node; of all ways from outside to a
//! node, the widest is found as a shortest one is (M. Pollack 1960). Two nodes are joined only where their balls
//! overlap, so that no way leads through a wall, however thin.

use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use super::locate::SurfaceIndex;
use crate::budget::{Cancelled, Watch, report};

/// Nodes of the grid, about: a megabyte for a hundred thousand.
const NODES: f64 = 5e5;
/// Nor is a cell smaller than this share of the part.
const FINEST: f64 = 1.0 / 400.0;
/// Cells around the part that are outside in any case.
const MARGIN: f64 = 2.0;
/// Half-cells of the smallest and of the largest ball that is tried.
const TRIED: std::ops::RangeInclusive<u32> = 2..=32;
/// Balls overlap where their radii are this many times as long as they are apart: beyond rounding.
const OVERLAP: f64 = 1.0 + 1e-6;
/// A ball lies on a surface that is no nearer to its centre than this share of its radius.
const LIES: f64 = 0.9;

/// Room around a part.
pub struct Room<'a> {
    index: &'a SurfaceIndex,
    lower: DVec3,
    cell: f64,
    counts: [usize; 3],
    /// Radius of the largest ball that gets to each node (m); 0 where none does.
    widest: Vec<f64>,
}

impl<'a> Room<'a> {
    /// Measures the room in and around a surface.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(mesh: &'a TriMesh, watch: Watch) -> Result<Self, Cancelled> {
        let (lower, upper) = mesh.bounds();
        let sides = upper - lower;
        let cell = (sides.element_product() / NODES)
            .cbrt()
            .max(FINEST * sides.length());
        let counts = (sides / cell + 2.0 * MARGIN)
            .ceil()
            .to_array()
            .map(|n| n as usize + 1);
        let mut room = Self {
            index: mesh.index(),
            lower: lower - DVec3::splat(MARGIN * cell),
            cell,
            counts,
            widest: Vec::new(),
        };
        let own = room.distances(watch)?;
        room.widest = room.widest_ways(&own);
        Ok(room)
    }

    /// Radius of the largest ball (m) that can be brought from outside to lie on a point of the surface (m) that
    /// looks in a direction: 0 where none gets there, endless where the largest that was tried does.
    #[must_use]
    pub fn at(&self, place: DVec3, normal: DVec3) -> f64 {
        let lies = |&half: &u32| {
            let radius = f64::from(half) / 2.0 * self.cell;
            let ball = place + normal * radius;
            let widest = self.widest_near(ball);
            // The grid sees a way as narrower by up to a cell.
            widest > 0.0
                && widest >= radius - self.cell
                && self.index.nearest(ball).1 >= LIES * radius
        };
        match TRIED.rev().find(lies) {
            Some(half) if half == *TRIED.end() => f64::INFINITY,
            Some(half) => f64::from(half) / 2.0 * self.cell,
            None => 0.0,
        }
    }

    /// How far each node is from the surface (m); what is farther than the largest ball that is tried counts as a cell
    /// farther than that.
    fn distances(&self, watch: Watch) -> Result<Vec<f64>, Cancelled> {
        const ROWS: usize = 256;
        let [along, ..] = self.counts;
        let rows = self.counts[1] * self.counts[2];
        let mut distances = Vec::with_capacity(rows * along);
        for first in (0..rows).step_by(ROWS) {
            report(watch, "Measuring room", first, rows)?;
            let some = first..rows.min(first + ROWS);
            distances.par_extend(some.into_par_iter().flat_map_iter(|row| self.along(row)));
        }
        Ok(distances)
    }

    /// Along a row of nodes: each is no farther from the surface than the one before it and a cell.
    fn along(&self, row: usize) -> impl Iterator<Item = f64> {
        /// Beyond rounding.
        const WIDER: f64 = 1.0 + 1e-9;
        let [along, ..] = self.counts;
        let most = (f64::from(*TRIED.end()) / 2.0 + 1.0) * self.cell;
        let nodes = row * along..(row + 1) * along;
        nodes.scan(most, move |before, node| {
            let within = ((*before + self.cell) * WIDER).min(most);
            let distance = self.index.distance_within(self.node(node), within);
            *before = distance.unwrap_or(most);
            Some(*before)
        })
    }

    /// The least distance on the best way from outside to each node (m).
    fn widest_ways(&self, own: &[f64]) -> Vec<f64> {
        let mut widest = vec![0.0; own.len()];
        // Positive numbers in double precision are in the order of their bits.
        let mut open: BinaryHeap<(u64, usize)> = BinaryHeap::new();
        for node in (0..own.len()).filter(|&n| self.is_outermost(n)) {
            widest[node] = f64::INFINITY;
            open.push((f64::INFINITY.to_bits(), node));
        }
        while let Some((bits, node)) = open.pop() {
            let width = f64::from_bits(bits);
            if width < widest[node] {
                continue;
            }
            for other in self.beside(node) {
                let narrower = width.min(own[other]);
                let joined = own[node] + own[other] > OVERLAP * self.cell;
                if joined && narrower > widest[other] {
                    widest[other] = narrower;
                    open.push((narrower.to_bits(), other));
                }
            }
        }
        widest
    }

    fn place(&self, node: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [node % nx, node / nx % ny, node / (nx * ny)]
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.counts;
        i + nx * (j + ny * k)
    }

    fn node(&self, node: usize) -> DVec3 {
        let place = self.place(node).map(|i| i as f64);
        self.lower + self.cell * DVec3::from_array(place)
    }

    fn is_outermost(&self, node: usize) -> bool {
        let place = self.place(node);
        (0..3).any(|a| place[a] == 0 || place[a] + 1 == self.counts[a])
    }

    /// The nodes one cell away.
    fn beside(&self, node: usize) -> impl Iterator<Item = usize> {
        let place = self.place(node);
        (0..6).filter_map(move |k| {
            let (axis, up) = (k / 2, k % 2 == 1);
            let mut other = place;
            other[axis] = if up {
                place[axis] + 1
            } else {
                place[axis].checked_sub(1)?
            };
            (other[axis] < self.counts[axis]).then(|| self.number(other))
        })
    }

    /// The largest ball that gets to a node around a place (m); any gets to what is off the grid.
    fn widest_near(&self, place: DVec3) -> f64 {
        let at = ((place - self.lower) / self.cell).floor().to_array();
        let on_grid = |a: usize| at[a] >= 0.0 && at[a] + 1.0 < self.counts[a] as f64;
        if !(0..3).all(on_grid) {
            return f64::INFINITY;
        }
        let first = at.map(|x| x as usize);
        let corner = |k: usize| {
            let node = std::array::from_fn(|a| first[a] + (k >> a & 1));
            self.widest[self.number(node)]
        };
        (0..8).map(corner).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::winding::tests::ball;
    use super::*;
    use crate::budget::unwatched;

    /// A ball of radius 1, without what lies higher than this, as a wall with an inside and an outside.
    fn bowl(height: f64) -> TriMesh {
        let mesh = ball(4);
        let low = mesh.part_of(|t| mesh.corners(t).iter().all(|p| p.z < height));
        low.unwrap().0.thickened(0.05)
    }

    #[test]
    fn what_is_closed_has_no_way_in_and_an_opening_lets_its_own_size_through() {
        let inside = |mesh: &TriMesh| {
            let room = Room::of(mesh, &unwatched).unwrap();
            let below = room.at(DVec3::new(0.0, 0.0, -1.025), DVec3::NEG_Z);
            assert!(below.is_infinite(), "{below}");
            room.at(DVec3::new(0.0, 0.0, -0.975), DVec3::Z)
        };
        let closed = inside(&bowl(2.0));
        assert!(closed <= 0.0, "{closed}");
        // An opening of radius 0.6 lets any ball through that is tried, one of about 0.2 its own.
        assert!(inside(&bowl(0.8)).is_infinite());
        let narrow = inside(&bowl(0.98));
        assert!((0.1..0.34).contains(&narrow), "{narrow}");
    }
}
