//! The soft shadow of a part on the floor below it.

use glam::DVec3;

use crate::lanes::wide;
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;

/// Cells of the map along each side: the shadow is soft everywhere.
pub const CELLS: usize = 48;
/// Pieces of the surface that it is summed over, at most.
const PIECES: usize = 2400;

/// How much of the sky the part takes from the floor it stands on, as a square map.
pub struct FloorShadow {
    /// Of the map, on the floor (m).
    pub middle: DVec3,
    /// Half of a side of the map (m).
    pub half: f64,
    /// The map's columns go to the right, its rows to the front.
    pub stance: Stance,
    /// Of each cell, row by row, 0 for none to 255 for all.
    pub dark: Vec<u8>,
}

/// Pieces of the surface that are summed side by side.
const ABREAST: usize = 8;

/// Some pieces, in the floor's own frame: from its middle to the right, to the front and up (m).
#[derive(Clone)]
struct PieceBlock {
    at: [[f32; ABREAST]; 3],
    /// Their normals times their areas (m²).
    facing: [[f32; ABREAST]; 3],
    /// From near by a piece is a disc of its area, over π (m²).
    disc: [f32; ABREAST],
}

impl PieceBlock {
    /// Pieces of no area.
    const NOTHING: Self = Self {
        at: [[0.0; ABREAST], [0.0; ABREAST], [1.0; ABREAST]],
        facing: [[0.0; ABREAST]; 3],
        disc: [1.0; ABREAST],
    };
}

impl FloorShadow {
    /// Of a part that stands on its lowest point.
    #[must_use]
    pub fn of(mesh: &TriMesh, stance: Stance) -> Self {
        /// Of the map beyond the part, and of the gap below it, over the part's width.
        const BEYOND: f64 = 0.9;
        const GAP: f64 = 0.015;
        let axes = [stance.right(), stance.front(), stance.up()];
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in mesh.positions() {
            for (k, axis) in axes.iter().enumerate() {
                low[k] = low[k].min(p.dot(*axis));
                high[k] = high[k].max(p.dot(*axis));
            }
        }
        let wide = (high[0] - low[0]).max(high[1] - low[1]);
        let size = wide.max(0.3 * (high[2] - low[2])).max(f64::MIN_POSITIVE);
        let middle = axes[0] * f64::midpoint(low[0], high[0])
            + axes[1] * f64::midpoint(low[1], high[1])
            + axes[2] * (low[2] - GAP * size);
        let half = (0.5 + BEYOND) * size;
        let pieces = pieces(mesh, middle, axes);
        let taken = |cell: usize| {
            let way = |k: usize| (2.0 * (k as f64 + 0.5) / CELLS as f64 - 1.0) * half;
            let (x, y) = (way(cell % CELLS), way(cell / CELLS));
            let sky = f64::from(sky_taken(&pieces, [x as f32, y as f32]));
            // Walls count once in front and once behind; nothing is darker than dark.
            // It fades out before the map ends.
            let rim = (1.0 - (x * x + y * y) / (half * half)).max(0.0).powi(2);
            ((1.0 - (-0.5 * sky).exp()) * rim * 255.0).round() as u8
        };
        Self {
            dark: (0..CELLS * CELLS).map(taken).collect(),
            middle,
            half,
            stance,
        }
    }
}

wide! {
    /// The share of a floor's light that comes from the sky behind all pieces, at a place of it (view factors from a point to
    /// small pieces).
    fn sky_taken<'p>(pieces: &'p [PieceBlock], place: [f32; 2]) -> f32 {
        let mut taken = [0.0; ABREAST];
        for block in pieces {
            for k in 0..ABREAST {
                let way = [
                    block.at[0][k] - place[0],
                    block.at[1][k] - place[1],
                    block.at[2][k],
                ];
                let squared = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
                let towards = block.facing[0][k] * way[0]
                    + block.facing[1][k] * way[1]
                    + block.facing[2][k] * way[2];
                taken[k] += towards.abs() * way[2].max(0.0) / (squared * (squared + block.disc[k]));
            }
        }
        taken.iter().sum::<f32>() / std::f32::consts::PI
    }
}

/// Pieces of about the same area, in the order of the triangles.
fn pieces(mesh: &TriMesh, middle: DVec3, axes: [DVec3; 3]) -> Vec<PieceBlock> {
    let count = mesh.triangles().len() as u32;
    let share = mesh.area() / PIECES as f64;
    let (mut blocks, mut number) = (Vec::with_capacity(PIECES / ABREAST + 1), 0);
    let mut waiting = 0.0;
    for triangle in 0..count {
        waiting += mesh.facet_area(triangle);
        if waiting < share {
            continue;
        }
        let parts = ((waiting / share) as usize).min(PIECES);
        let facing = mesh.facet_normal(triangle) * (waiting / parts as f64);
        for at in evenly(mesh.corners(triangle), parts) {
            let slot = number % ABREAST;
            if slot == 0 {
                blocks.push(PieceBlock::NOTHING);
            }
            if let Some(block) = blocks.last_mut() {
                for (k, axis) in axes.iter().enumerate() {
                    block.at[k][slot] = (at - middle).dot(*axis) as f32;
                    block.facing[k][slot] = facing.dot(*axis) as f32;
                }
                block.disc[slot] = (facing.length() / std::f64::consts::PI) as f32;
            }
            number += 1;
        }
        waiting = 0.0;
    }
    blocks
}

/// So many places over a triangle (M. Roberts' sequence, folded over the diagonal).
fn evenly([a, b, c]: [DVec3; 3], parts: usize) -> impl Iterator<Item = DVec3> {
    (0..parts).map(move |k| {
        let [mut u, mut v] = [0.754_877_666, 0.569_840_296].map(|g| (0.5 + g * k as f64).fract());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        a + (b - a) * u + (c - a) * v
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A level square of a side of 20 mm.
    fn plate() -> TriMesh {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let positions = corners.map(|[x, y]| DVec3::new(x, y, 0.0) * 0.01);
        TriMesh::new(&positions, &[[0, 1, 2], [0, 2, 3]], 0)
            .unwrap()
            .0
    }

    #[test]
    fn pieces_take_what_the_view_factor_of_a_square_says() {
        for below in [0.004, 0.01, 0.02] {
            let middle = DVec3::Z * -below;
            let pieces = pieces(&plate(), middle, [DVec3::X, DVec3::Y, DVec3::Z]);
            let taken = f64::from(sky_taken(&pieces, [0.0, 0.0]));
            // Of a square of half a side a, over its middle at a distance h.
            let ratio: f64 = 0.01 / below;
            let slant = ratio / (1.0 + ratio * ratio).sqrt();
            let factor = 4.0 / std::f64::consts::PI * slant * slant.atan();
            assert!((taken / factor - 1.0).abs() < 0.03, "{taken} {factor}");
        }
    }

    #[test]
    fn it_is_dark_below_a_part_and_not_beside_it() {
        let shadow = FloorShadow::of(&plate(), Stance::about(DVec3::Z));
        let at = |x: usize, y: usize| shadow.dark[y * CELLS + x];
        let middle = CELLS / 2;
        assert!(at(middle, middle) > 60, "{}", at(middle, middle));
        assert!(at(0, 0) == 0 && at(middle, 2) < at(middle, middle) / 4);
    }
}
