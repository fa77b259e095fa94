//! A touch: a force pressed onto the surface by a tip that spreads it smoothly.

use std::ops::Range;

use glam::DVec3;

use crate::mesh::{SurfacePoint, TriMesh};

/// One applied force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Where the tip's axis meets the surface (m).
    pub position: DVec3,
    /// Outward unit normal: the force pushes along its opposite.
    pub normal: DVec3,
    /// Magnitude (N).
    pub force: f64,
    /// Radius over which the tip spreads the force, q ∝ (1 - r²/a²)² (m).
    pub tip_radius: f64,
}

/// A touch whose force need not push straight in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Where the tip is, and how it spreads what it carries.
    pub touch: Touch,
    /// The force on the part (N).
    pub force: DVec3,
}

impl From<Touch> for Push {
    /// Straight in.
    fn from(touch: Touch) -> Self {
        Self {
            touch,
            force: -touch.normal * touch.force,
        }
    }
}

impl From<&Touch> for Push {
    fn from(touch: &Touch) -> Self {
        Self::from(*touch)
    }
}

/// Forces on the nodes: vertex and force (N); they sum to the touch's force to rounding.
pub type NodalForces = Vec<(u32, DVec3)>;

/// A facet within reach of the tip is integrated with at least this many pieces along the tip's radius.
const PIECES_PER_RADIUS: f64 = 4.0;
/// Facets turned further than this away from the touched one belong to another wall (cos 75°).
const SAME_WALL: f64 = 0.26;

/// A tip smaller than this share of a facet's coordinates is lost in their rounding: quartering would never end.
const FINEST: f64 = 1e-12;

/// The largest coordinate of a facet (m).
fn farthest(corners: &[DVec3; 3]) -> f64 {
    corners
        .iter()
        .map(|p| p.abs().max_element())
        .fold(0.0, f64::max)
}

/// The nodal forces of a touch, by quadrature of the tip's pressure with the linear shape functions.
#[must_use]
pub fn nodal_forces(mesh: &TriMesh, touch: &Touch) -> NodalForces {
    pushed(mesh, &touch.into())
}

/// As [`nodal_forces`], of a force that may have any direction.
#[must_use]
pub fn pushed(mesh: &TriMesh, push: &Push) -> NodalForces {
    let mut shares: Vec<(u32, f64)> = Vec::new();
    let mut total = 0.0;
    // What the corners of a facet take is added up there: a facet has hundreds of points under a tip.
    let mut facet = (u32::MAX, [0.0; 3]);
    let corners = |(t, sums): (u32, [f64; 3])| {
        let corners = mesh.triangles()[t as usize].into_iter().zip(sums);
        corners.filter(|(_, sum)| *sum > 0.0)
    };
    let at = each_point(mesh, &push.touch, f64::INFINITY, |at, share| {
        if at.triangle != facet.0 {
            if facet.0 != u32::MAX {
                shares.extend(corners(facet));
            }
            facet = (at.triangle, [0.0; 3]);
        }
        for (sum, weight) in facet.1.iter_mut().zip(at.barycentric) {
            *sum += weight * share;
        }
        total += share;
    });
    if total == 0.0 {
        (facet, total) = ((at.triangle, at.barycentric), 1.0);
    }
    shares.extend(corners(facet));
    let shares = merge(shares).into_iter();
    shares.map(|(v, w)| (v, push.force * (w / total))).collect()
}

/// Points under the tip with their shares of its force; they sum to one. `apart` (m) is how far from each other
/// they may be for the elements that feel them.
#[must_use]
pub fn pressure(mesh: &TriMesh, touch: &Touch, apart: f64) -> Vec<(SurfacePoint, f64)> {
    let mut shares: Vec<(SurfacePoint, f64)> = Vec::new();
    let at = each_point(mesh, touch, apart, |at, share| shares.push((at, share)));
    let total: f64 = shares.iter().map(|s| s.1).sum();
    if total == 0.0 {
        return vec![(at, 1.0)];
    }
    for (_, share) in &mut shares {
        *share /= total;
    }
    shares
}

/// Tells of the points under a tip with their shares of its force, facet by facet, times the same unknown number; none
/// where the tip is smaller than the quadrature can see: a point force. The point of the surface that the tip is at.
fn each_point(
    mesh: &TriMesh,
    touch: &Touch,
    apart: f64,
    mut tell: impl FnMut(SurfacePoint, f64),
) -> SurfacePoint {
    let grain = apart.min(touch.tip_radius / PIECES_PER_RADIUS);
    let index = mesh.index();
    let (at, _) = index.nearest(touch.position);
    let tip = StandingTip {
        centre: mesh.point(at),
        radius: touch.tip_radius,
        grain,
    };
    for t in index.triangles_near(tip.centre, tip.radius) {
        let seen = touch.tip_radius > FINEST * farthest(&mesh.corners(t));
        if seen && mesh.facet_normal(t).dot(touch.normal) > SAME_WALL {
            integrate(mesh, t, &WHOLE, &tip, AT_ONCE, &mut tell);
        }
    }
    at
}

/// A part of a facet, by the barycentric coordinates of its corners.
type FacetPiece = [[f64; 3]; 3];
const WHOLE: FacetPiece = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// A facet is split into this many pieces a side at once; larger ones are quartered first, down to this many: a tip
/// covers so little of them that most quarters are left out.
const AT_ONCE: f64 = 64.0;
const OF_A_QUARTER: f64 = 8.0;

/// A tip where it stands (m).
struct StandingTip {
    centre: DVec3,
    radius: f64,
    /// How far from each other its points may be.
    grain: f64,
}

impl StandingTip {
    /// Which of the pieces of a row the tip may reach: all that it does, and few others. The row goes from `start` by
    /// `step` a piece, and is so `wide` (m).
    fn over_row(&self, start: DVec3, step: DVec3, wide: f64, count: usize) -> Range<usize> {
        let (off, reach) = (self.centre - start, self.radius + wide);
        let nearest = off.dot(step) / step.length_squared();
        if !nearest.is_finite() {
            return 0..count;
        }
        let aside = off.distance(step * nearest);
        if aside > reach {
            return 0..0;
        }
        let half = (reach * reach - aside * aside).sqrt() / step.length();
        // A piece more on either side, for what rounding takes. Below nothing, `as` is nothing.
        let (first, end) = (nearest - half - 1.0, nearest + half + 2.0);
        (first as usize).min(count)..(end as usize).min(count)
    }

    /// The pieces that it may reach of a triangle split into `n` a side.
    fn over(&self, ends: &[DVec3; 3], n: usize) -> impl Iterator<Item = FacetPiece> {
        let [across, along] = [1, 2].map(|k| (ends[k] - ends[0]) / n as f64);
        (0..n).flat_map(move |i| {
            let start = ends[0] + across * i as f64;
            let reached = self.over_row(start, along, across.length(), n - i);
            row(n, i, reached)
        })
    }
}

/// Tells of the pressure on a piece of a facet, split into equal pieces with the three-point rule on each: no more of
/// them a side than are taken at once.
fn integrate(
    mesh: &TriMesh,
    t: u32,
    piece: &FacetPiece,
    tip: &StandingTip,
    at_once: f64,
    tell: &mut impl FnMut(SurfacePoint, f64),
) {
    let corners = mesh.corners(t);
    let point = |zeta: &[f64; 3]| -> DVec3 { (0..3).map(|i| corners[i] * zeta[i]).sum() };
    let ends = piece.each_ref().map(point);
    let longest = (0..3)
        .map(|i| ends[i].distance(ends[(i + 1) % 3]))
        .fold(0.0, f64::max);
    let n = (longest / tip.grain).ceil().max(1.0);
    if n > at_once {
        if ends[0].distance(tip.centre) < tip.radius + longest {
            for quarter in pieces(2) {
                let quarter = quarter.each_ref().map(|zeta| within(piece, zeta));
                integrate(mesh, t, &quarter, tip, OF_A_QUARTER, tell);
            }
        }
        return;
    }
    let n = n as usize;
    let area = (ends[1] - ends[0]).cross(ends[2] - ends[0]).length() / 2.0;
    let share = area / (n * n) as f64 / 3.0;
    for small in tip.over(&ends, n) {
        for k in 0..3 {
            let middle = std::array::from_fn(|i| f64::midpoint(small[k][i], small[(k + 1) % 3][i]));
            let zeta = within(piece, &middle);
            let r2 = point(&zeta).distance_squared(tip.centre) / tip.radius.powi(2);
            if r2 < 1.0 {
                let at = SurfacePoint {
                    triangle: t,
                    barycentric: zeta,
                };
                tell(at, (1.0 - r2).powi(2) * share);
            }
        }
    }
}

/// Coordinates in the facet of a point given by those in a piece of it.
fn within(piece: &FacetPiece, zeta: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| zeta[k] * piece[k][i]).sum())
}

/// The n² equal triangles of a split facet, by the barycentric coordinates of their corners.
pub(super) fn pieces(n: usize) -> impl Iterator<Item = FacetPiece> {
    (0..n).flat_map(move |i| row(n, i, 0..n - i))
}

/// Those of them in one row, at some places of it.
fn row(n: usize, i: usize, places: Range<usize>) -> impl Iterator<Item = FacetPiece> {
    let at = move |i: usize, j: usize| {
        let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
        [1.0 - u - v, u, v]
    };
    places.flat_map(move |j| {
        let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
        let down = [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        std::iter::once(up).chain((i + j + 1 < n).then_some(down))
    })
}

/// Shares of vertices or nodes, those of the same one added up, in rising order.
pub(super) fn merge(mut shares: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    shares.sort_by_key(|w| w.0);
    let mut merged: Vec<(u32, f64)> = Vec::new();
    for (v, w) in shares {
        match merged.last_mut() {
            Some(last) if last.0 == v => last.1 += w,
            _ => merged.push((v, w)),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;

    /// Facets of all shapes, a tip at their edge or in the middle: what it reaches is all there, in its order, and what
    /// is looked at for that follows the tip and not the facet.
    #[test]
    fn what_a_tip_reaches_of_a_facet_is_found_without_looking_at_all_of_it() {
        const A_SIDE: usize = 64;
        let tall = |x: f64, y: f64| DVec3::new(x, y, 0.01 * x);
        for third in [(0.0, 64.0), (60.0, 0.5), (32.0, 1e-9), (-500.0, 20.0)] {
            let mut ends = [tall(0.0, 0.0), tall(64.0, 0.0), tall(third.0, third.1)];
            for turn in 0..9 {
                ends.rotate_left(1);
                let share = f64::from(turn) / 8.0;
                let tip = StandingTip {
                    centre: ends[0].lerp(ends[1], share) * 0.9 + ends[2] * 0.1,
                    radius: 4.0,
                    grain: 1.0,
                };
                let point = |zeta: &[f64; 3]| -> DVec3 { (0..3).map(|i| ends[i] * zeta[i]).sum() };
                let reached = |piece: &FacetPiece| {
                    (0..3).any(|k| point(&piece[k]).distance(tip.centre) < tip.radius)
                };
                let looked_at: Vec<FacetPiece> = tip.over(&ends, A_SIDE).collect();
                let found: Vec<FacetPiece> = looked_at.iter().copied().filter(reached).collect();
                let all: Vec<FacetPiece> = pieces(A_SIDE).filter(reached).collect();
                assert_eq!(found, all, "{third:?} {turn}");
                let few = 3 * all.len() + 6 * A_SIDE;
                assert!(looked_at.len() < few, "{} {few}", looked_at.len());
            }
        }
    }

    #[test]
    fn a_touch_keeps_its_force_and_its_place() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let position = mesh.corners(700).iter().sum::<DVec3>() / 3.0;
        let normal = position.with_z(0.0).normalize();
        for tip_radius in [1e-23, 1e-6, 1e-3, 5e-3, 0.5] {
            let touch = Touch {
                position,
                normal,
                force: 10.0,
                tip_radius,
            };
            let forces = nodal_forces(&mesh, &touch);
            let sum: DVec3 = forces.iter().map(|f| f.1).sum();
            assert!(sum.distance(-normal * 10.0) < 1e-12);
            if tip_radius < 2e-3 {
                let middle: DVec3 = forces
                    .iter()
                    .map(|&(v, f)| mesh.positions()[v as usize] * f.length() / 10.0)
                    .sum();
                assert!(middle.distance(position) < 3e-4, "{tip_radius}");
            }
        }
    }
}
