//! Walls of a closed part: how thick they are, and which of their faces is the outside.
//!
//! Touches land outside, where a surface sees much of the open; gauges go inside, on the other face of the same
//! wall. What closes a wall at its end is neither.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::locate::SurfaceIndex;
use super::{SurfacePoint, TriMesh};
use crate::budget::{Cancelled, Watch, report};

/// Which side of its wall a facet is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WallSide {
    /// Where touches land.
    Outside,
    /// Where gauges go.
    Inside,
    /// The end of a wall.
    Rim,
    /// A face that no touch comes to, and that is not the back of one that touches come to.
    Frame,
}

/// What is known of a part's walls, one value a facet.
#[derive(Clone, Debug)]
pub struct Walls {
    /// The side that each facet is on.
    pub sides: Vec<WallSide>,
    /// Through the material to the facing surface (m); NaN where there is none.
    pub thickness: Vec<f64>,
    /// Through the open to a facing surface (m); infinite where there is none.
    pub gaps: Vec<f64>,
    /// The facet on the other face of the wall, where there is one.
    pub facing: Vec<Option<u32>>,
}

/// Directions that a facet looks in.
const LOOKS: usize = 64;
/// A surface faces another one when their normals are opposite to this (cos 120°).
const FACING: f64 = -0.5;
/// Faces of a wall see alike when what they see differs by less than this.
const ALIKE: f64 = 0.05;
/// A facet has no wall behind it, but its end, when material reaches farther than this many thicknesses of the
/// walls while beside the facet it does not reach one.
const END: f64 = 1.6;
/// Rounds of asking neighbours.
const ROUNDS: usize = 3;

impl Walls {
    /// Looks at every facet of a closed surface.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(mesh: &TriMesh, watch: Watch) -> Result<Self, Cancelled> {
        const CHUNK: usize = 512;
        let looks = looks();
        let all: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
        let mut facets: Vec<FacetSight> = Vec::with_capacity(all.len());
        for chunk in all.chunks(CHUNK) {
            report(watch, "Measuring walls", facets.len(), all.len())?;
            facets.par_extend(chunk.par_iter().map(|&t| FacetSight::of(mesh, t, &looks)));
        }
        let thickness: Vec<f64> = facets.iter().map(|f| f.thickness).collect();
        let typical = middle(&thickness, mesh);
        let sides = (0u32..)
            .zip(&facets)
            .map(|(t, facet)| facet.side(mesh, t, typical))
            .collect();
        let gaps = facets.iter().map(|f| f.gap).collect();
        let facing = facets.iter().map(|f| f.facing).collect();
        let mut walls = Self {
            sides,
            thickness,
            gaps,
            facing,
        };
        for _ in 0..ROUNDS {
            walls.ask_neighbours(mesh);
        }
        Ok(walls)
    }

    /// The thickness that half of the walls' area is thinner than (m); NaN where there are no walls.
    #[must_use]
    pub fn typical(&self, mesh: &TriMesh) -> f64 {
        middle(&self.thickness, mesh)
    }

    /// The thickness that this share of the walls' area is thinner than (m).
    #[must_use]
    pub fn thinner_than(&self, mesh: &TriMesh, share: f64) -> f64 {
        share_of(&self.thickness, mesh, share)
    }

    /// Share of the surface that faces another across less than this (m).
    #[must_use]
    pub fn nearer_than(&self, mesh: &TriMesh, gap: f64) -> f64 {
        let near = (0u32..).zip(&self.gaps).filter(|(_, g)| **g < gap);
        near.map(|(t, _)| mesh.facet_area(t)).sum::<f64>() / mesh.area()
    }

    /// A facet whose neighbours all lie on one other side goes over to them.
    fn ask_neighbours(&mut self, mesh: &TriMesh) {
        let old = self.sides.clone();
        for (t, edges) in mesh.triangle_edges().iter().enumerate() {
            let beside = |e: u32| {
                let all = &mesh.edges()[e as usize].triangles;
                let other = all.iter().find(|&&o| o as usize != t)?;
                let flat = mesh.facet_normal(*other).dot(mesh.facet_normal(t as u32)) > 0.7;
                (all.len() == 2 && flat).then(|| old[*other as usize])
            };
            let votes: Vec<WallSide> = edges.iter().filter_map(|&e| beside(e)).collect();
            let other = votes.iter().find(|&&s| s != old[t]);
            if let Some(&other) = other
                && votes.iter().filter(|&&s| s == other).count() >= 2
            {
                self.sides[t] = other;
            }
        }
    }
}

/// Looks begin so far off a facet, over the size of the part.
const OFF: f64 = 1e-6;

/// What one facet sees.
struct FacetSight {
    /// Share of the open that it sees, and that the facet behind its wall sees.
    open: f64,
    open_behind: f64,
    /// m.
    thickness: f64,
    /// How far material reaches under 45° to all sides (m), the least.
    beside: f64,
    /// m.
    gap: f64,
    /// The facet behind its wall.
    facing: Option<u32>,
}

impl FacetSight {
    fn of(mesh: &TriMesh, t: u32, looks: &[DVec3]) -> Self {
        let index = mesh.index();
        let (lower, upper) = mesh.bounds();
        let off = OFF * (upper - lower).length();
        let normal = mesh.facet_normal(t);
        let at = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        let behind = index.ray(at - normal * off, -normal);
        let faces =
            |(hit, _): &(SurfacePoint, f64)| mesh.facet_normal(hit.triangle).dot(normal) < FACING;
        let facing = behind.filter(faces);
        let ahead = index.ray(at + normal * off, normal).filter(faces);
        let frame = frame(normal);
        let beside = (0..8)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                let into = frame * DVec3::new(cos, sin, -1.0).normalize();
                index
                    .ray(at - normal * off, into)
                    .map_or(f64::INFINITY, |h| h.1)
            })
            .fold(f64::INFINITY, f64::min);
        Self {
            open: openness(index, at + normal * off, &frame, looks),
            open_behind: facing.map_or(0.0, |(hit, _)| {
                let away = mesh.facet_normal(hit.triangle);
                openness(
                    index,
                    mesh.point(hit) + away * off,
                    &self::frame(away),
                    looks,
                )
            }),
            thickness: facing.map_or(f64::NAN, |(_, distance)| distance + off),
            gap: ahead.map_or(f64::INFINITY, |(_, distance)| distance + off),
            beside,
            facing: facing.map(|(hit, _)| hit.triangle),
        }
    }

    fn side(&self, mesh: &TriMesh, t: u32, typical: f64) -> WallSide {
        let deep = self.thickness.is_nan() || self.thickness > END * typical;
        if deep && self.beside < typical {
            return WallSide::Rim;
        }
        let more = if self.thickness.is_nan() {
            self.open - 0.5
        } else {
            self.open - self.open_behind
        };
        if more.abs() > ALIKE {
            return if more > 0.0 {
                WallSide::Outside
            } else {
                WallSide::Inside
            };
        }
        // A flat plate looks the same from both sides: what faces up is taken for the outside.
        let normal = mesh.facet_normal(t);
        let first = [normal.z, normal.y, normal.x];
        let up = first
            .into_iter()
            .find(|c| c.abs() > 0.5)
            .unwrap_or(normal.z);
        if up >= 0.0 {
            WallSide::Outside
        } else {
            WallSide::Inside
        }
    }
}

/// Axes with the third along a normal.
pub(super) fn frame(normal: DVec3) -> DMat3 {
    let x = normal.any_orthonormal_vector();
    DMat3::from_cols(x, normal.cross(x), normal)
}

/// Directions over the half-space of z, as many to a side as a matt surface sees it (a spiral of golden angles).
fn looks() -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..LOOKS)
        .map(|k| {
            let radius = ((k as f64 + 0.5) / LOOKS as f64).sqrt();
            let (sin, cos) = (golden * k as f64).sin_cos();
            DVec3::new(radius * cos, radius * sin, (1.0 - radius * radius).sqrt())
        })
        .collect()
}

/// Share of what a point sees that is open.
fn openness(index: &SurfaceIndex, at: DVec3, frame: &DMat3, looks: &[DVec3]) -> f64 {
    let open = looks
        .iter()
        .filter(|&&l| index.ray(at, *frame * l).is_none());
    open.count() as f64 / looks.len() as f64
}

/// Of the thicknesses, weighted by area, the middle one.
pub(super) fn middle(thickness: &[f64], mesh: &TriMesh) -> f64 {
    share_of(thickness, mesh, 0.5)
}

fn share_of(thickness: &[f64], mesh: &TriMesh, share: f64) -> f64 {
    let mut walls: Vec<(f64, f64)> = (0u32..)
        .zip(thickness)
        .filter(|(_, t)| t.is_finite())
        .map(|(f, &t)| (t, mesh.facet_area(f)))
        .collect();
    walls.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = walls.iter().map(|w| w.1).sum();
    let mut sum = 0.0;
    for (t, area) in walls {
        sum += area;
        if sum >= share * total {
            return t;
        }
    }
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::limb::LimbSpec;

    #[test]
    fn the_faces_of_a_thick_limb_are_told_apart() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let solid = mesh.thickened(3e-3);
        let walls = Walls::of(&solid, &unwatched).unwrap();
        assert!((walls.typical(&solid) - 3e-3).abs() < 1e-4);
        let mut wrong = 0.0;
        let mut found = [0.0; 3];
        for (t, side) in (0u32..).zip(&walls.sides) {
            let middle = solid.corners(t).iter().sum::<DVec3>() / 3.0;
            let radial = solid.facet_normal(t).dot(middle.with_z(0.0).normalize());
            let truth = match radial {
                r if r > 0.9 => WallSide::Outside,
                r if r < -0.9 => WallSide::Inside,
                _ => WallSide::Rim,
            };
            let area = solid.facet_area(t);
            found[*side as usize] += area;
            if *side != truth {
                wrong += area;
            }
        }
        assert!(
            wrong < 0.02 * solid.area(),
            "{wrong} of {}: {found:?}",
            solid.area()
        );
    }
}
