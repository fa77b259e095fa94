//! How large the cells of a solid may be, and how small a budget lets them become.

use crate::budget::ElementBudget;

/// Each next cells over the last.
pub const FINER: f64 = 1.0 / 1.5;
/// The first cells in thicknesses of the wall: quadratic ones bend a wall that they are larger than.
const WALLS: f64 = 2.5;
/// The first cells over the second longest side of the part, which they would not bend as it does, over the
/// radius of a tip, and over the distance between a touch and what is held.
const ACROSS: f64 = 1.0 / 2.5;
const TIPS: f64 = 2.5;
const AWAY: f64 = 1.5;
/// Grids that are compared: two could share a fault, the third shows it.
pub const LEAST_GRIDS: i32 = 3;
/// Cells that are not at least this much smaller are not worth a model.
const WORTH: f64 = 0.85;
/// Unknowns of a quadratic cell that has neighbours all around, and the share of a cell that the surface cuts,
/// each `size²` of it.
const UNKNOWNS: f64 = 24.0;
const CUT: f64 = 0.75;
/// Unknowns that are allowed for each vertex that a shell may have.
const UNKNOWNS_A_VERTEX: f64 = 16.0;
/// Unknowns that are never asked for, whatever the quality: those of the truth, which are more than twice as many,
/// still fit into memory.
const MOST_UNKNOWNS: f64 = 300_000.0;

/// What the size of cells hangs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMeasures {
    /// Of the surface (m²), and of what it encloses (m³).
    pub area: f64,
    /// Of what the surface encloses (m³).
    pub volume: f64,
    /// Thickness that cells are sized by (m).
    pub wall: f64,
    /// Second longest side of the box around the part (m).
    pub across: f64,
}

impl PartMeasures {
    /// Of a wall (m) with two faces of an area (m²) together.
    #[must_use]
    pub fn of_wall(wall: f64, area: f64) -> Self {
        Self {
            area,
            volume: area / 2.0 * wall,
            wall,
            across: f64::INFINITY,
        }
    }

    /// Unknowns with cells of a size (m), about.
    #[must_use]
    pub fn unknowns(&self, size: f64) -> f64 {
        UNKNOWNS * (self.volume / size.powi(3) + CUT * self.area / size.powi(2))
    }

    /// Size of cells (m) for about so many unknowns.
    #[must_use]
    pub fn size_for(&self, unknowns: f64) -> f64 {
        // Unknowns fall with the size: between the size for the surface alone and that for both, twice over.
        let surface = (UNKNOWNS * CUT * self.area / unknowns).sqrt();
        let inner = (UNKNOWNS * self.volume / unknowns).cbrt();
        let (mut lower, mut upper) = (surface.max(inner), 2.0 * (surface + inner));
        for _ in 0..60 {
            let middle = f64::midpoint(lower, upper);
            if self.unknowns(middle) > unknowns {
                lower = middle;
            } else {
                upper = middle;
            }
        }
        upper
    }

    /// Size of the smallest cells (m) that a budget allows for so many touches.
    #[must_use]
    pub fn least(&self, aim: &ElementBudget, touches: usize) -> f64 {
        let allowed = UNKNOWNS_A_VERTEX * aim.most_for(touches) as f64;
        self.size_for(allowed.min(MOST_UNKNOWNS))
    }

    /// Size of the first cells (m): they resolve the wall, the part, the tips and how far touches are from what is
    /// held (`tip` and `away`, m), unless the least that is allowed is too large for that; from there on there are
    /// [`LEAST_GRIDS`] sizes at least.
    #[must_use]
    pub fn first(&self, tip: f64, away: f64, least: f64) -> f64 {
        (WALLS * self.wall)
            .min(ACROSS * self.across)
            .min(TIPS * tip)
            .min(AWAY * away.max(tip))
            .max(least / FINER.powi(LEAST_GRIDS - 1))
    }
}

/// The size (m) after one, if there is one to be had.
#[must_use]
pub fn next(size: f64, least: f64) -> Option<f64> {
    let next = (size * FINER).max(least);
    (next < WORTH * size).then_some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_for_unknowns_has_so_many() {
        let cube = PartMeasures {
            area: 6.0 * 0.02 * 0.02,
            volume: 8e-6,
            wall: 0.02,
            across: 0.02,
        };
        for shape in [cube, PartMeasures::of_wall(1e-3, 0.06)] {
            for unknowns in [1e2, 1e4, 1e6] {
                let size = shape.size_for(unknowns);
                assert!((shape.unknowns(size) / unknowns - 1.0).abs() < 1e-6);
            }
        }
        // Twenty cells of a cube and the layer that its faces cut.
        assert!((cube.unknowns(1e-3) / (3.0 * 41f64.powi(3)) - 1.0).abs() < 0.2);
    }

    #[test]
    fn the_first_cells_resolve_what_there_is() {
        let cube = PartMeasures {
            area: 6.0 * 0.02 * 0.02,
            volume: 8e-6,
            wall: 0.02,
            across: 0.02,
        };
        assert!(cube.first(3e-3, 0.01, 1e-3) <= 0.008);
        assert!(cube.first(1e-3, 0.01, 1e-3) <= 2.5e-3);
        assert!(cube.first(3e-3, 0.004, 1e-3) <= 6e-3);
        // Three sizes fit where they can be had.
        let first = cube.first(1e-5, 0.01, 1e-3);
        let second = next(first, 1e-3).unwrap();
        assert!(next(second, 1e-3).is_some());
    }
}
