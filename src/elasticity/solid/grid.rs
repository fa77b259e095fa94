//! Planes that cut space into boxes, laid so that supports end on them.

use glam::DVec3;

use super::cut::Cell;

/// The number of a cell, or of a corner, along the three axes.
pub type CellIndex = [u32; 3];

/// Planes along x, y and z (m), rising.
#[derive(Clone, Debug, PartialEq)]
pub struct CellGrid {
    planes: [Vec<f64>; 3],
}

/// Wanted planes nearer to each other than this share of a cell are one.
const TOGETHER: f64 = 1e-3;

impl CellGrid {
    /// Cells of at most `size` (m) around a part, with planes where they are `wanted` (m, by axis) inside of it.
    #[must_use]
    pub fn new(bounds: (DVec3, DVec3), size: f64, wanted: &[Vec<f64>; 3]) -> Self {
        let planes = std::array::from_fn(|axis| {
            let (lower, upper) = (bounds.0[axis], bounds.1[axis]);
            // Room around the part, uneven, so that no face of it lies along a plane by accident.
            let (lower, upper) = (lower - 0.0137 * size, upper + 0.0171 * size);
            let mut marks: Vec<f64> = (wanted[axis].iter().copied())
                .filter(|w| *w > lower && *w < upper)
                .chain([lower, upper])
                .collect();
            marks.sort_by(f64::total_cmp);
            marks.dedup_by(|b, a| *b - *a < TOGETHER * size);
            let mut planes = vec![marks[0]];
            for pair in marks.windows(2) {
                let count = ((pair[1] - pair[0]) / size).ceil().max(1.0) as usize;
                let step = (pair[1] - pair[0]) / count as f64;
                planes.extend((1..count).map(|k| pair[0] + step * k as f64));
                planes.push(pair[1]);
            }
            planes
        });
        Self { planes }
    }

    /// Cells along each axis.
    #[must_use]
    pub fn counts(&self) -> CellIndex {
        std::array::from_fn(|axis| self.planes[axis].len() as u32 - 1)
    }

    /// The largest side of a cell (m).
    #[must_use]
    pub fn largest_side(&self) -> f64 {
        let steps = self.planes.iter().flat_map(|p| p.windows(2));
        steps.map(|p| p[1] - p[0]).fold(0.0, f64::max)
    }

    /// The box of a cell.
    #[must_use]
    pub fn cell(&self, at: CellIndex) -> Cell {
        self.span(at, at.map(|i| i + 1))
    }

    /// The box from the lower corner of one cell to that of another.
    #[must_use]
    pub fn span(&self, from: CellIndex, to: CellIndex) -> Cell {
        let corner = |at: CellIndex| {
            let side = |axis: usize| self.planes[axis][at[axis] as usize];
            DVec3::new(side(0), side(1), side(2))
        };
        let lower = corner(from);
        Cell {
            lower,
            sides: corner(to) - lower,
        }
    }

    /// The cell that a point lies in; one beside the grid belongs to the last cell.
    #[must_use]
    pub fn place(&self, point: DVec3) -> CellIndex {
        std::array::from_fn(|axis| {
            let planes = &self.planes[axis];
            let beyond = planes.partition_point(|&p| p <= point[axis]);
            beyond.clamp(1, planes.len() - 1) as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_lie_where_they_are_wanted() {
        let wanted = [vec![0.25, 7.0], vec![], vec![0.5, 0.5 + 1e-9]];
        let grid = CellGrid::new((DVec3::ZERO, DVec3::ONE), 0.3, &wanted);
        assert!(grid.planes[0].contains(&0.25) && !grid.planes[0].contains(&7.0));
        assert_eq!(
            grid.planes[2]
                .iter()
                .filter(|p| (**p - 0.5).abs() < 1e-6)
                .count(),
            1
        );
        for planes in &grid.planes {
            assert!(
                planes
                    .windows(2)
                    .all(|p| p[1] > p[0] && p[1] - p[0] <= 0.3 + 1e-12)
            );
        }
        let at = grid.place(DVec3::new(0.26, 0.99, 0.5));
        let cell = grid.cell(at);
        assert!(cell.lower.x >= 0.25 - 1e-12 && cell.lower.z >= 0.5 - 1e-12);
        assert_eq!(grid.place(DVec3::splat(9.0)), grid.counts().map(|c| c - 1));
    }
}
