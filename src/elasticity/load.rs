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
    /// Which of the places of a row the tip may reach: all that it does, and few others. The row goes from `start` by
    /// `step` a place.
    fn over_row(&self, start: DVec3, step: DVec3, count: usize) -> Range<usize> {
        let off = self.centre - start;
        let nearest = off.dot(step) / step.length_squared();
        if !nearest.is_finite() {
            return 0..count;
        }
        let aside = off.distance(step * nearest);
        if aside > self.radius {
            return 0..0;
        }
        let half = (self.radius * self.radius - aside * aside).sqrt() / step.length();
        // A place more on either side, for what rounding takes. Below nothing, `as` is nothing.
        let (first, end) = (nearest - half - 1.0, nearest + half + 2.0);
        (first as usize).min(count)..(end as usize).min(count)
    }

    /// Tells of the places that it may reach of a triangle with so many steps a side: each by its steps along two of these
    /// from the first corner, and where it is (m).
    fn over(&self, ends: &[DVec3; 3], steps: usize, mut tell: impl FnMut([usize; 2], DVec3)) {
        let [across, along] = [1, 2].map(|k| (ends[k] - ends[0]) / steps as f64);
        for a in 0..=steps {
            let start = ends[0] + across * a as f64;
            for b in self.over_row(start, along, steps - a + 1) {
                tell([a, b], start + along * b as f64);
            }
        }
    }
}

/// Tells of the pressure on a piece of a facet, split into equal triangles with the three-point rule on each, at the middles
/// of its sides: no more of them a side than are taken at once. Corners and middles together are a lattice of twice as many
/// steps, in which those are the corners that have even numbers.
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
    let steps = 2 * n;
    tip.over(&ends, steps, |[a, b], place| {
        let r2 = place.distance_squared(tip.centre) / tip.radius.powi(2);
        let is_corner = a % 2 == 0 && b % 2 == 0;
        if is_corner || r2 >= 1.0 {
            return;
        }
        let [u, v] = [a, b].map(|k| k as f64 / steps as f64);
        let at = SurfacePoint {
            triangle: t,
            barycentric: within(piece, &[(1.0 - u - v).max(0.0), u, v]),
        };
        // But for those at the rim, a side is one of two triangles.
        let is_rim = a == 0 || b == 0 || a + b == steps;
        let sides = if is_rim { 1.0 } else { 2.0 };
        tell(at, sides * (1.0 - r2).powi(2) * share);
    });
}

/// Coordinates in the facet of a point given by those in a piece of it.
fn within(piece: &FacetPiece, zeta: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| zeta[k] * piece[k][i]).sum())
}

/// The n² equal triangles of a split facet, by the barycentric coordinates of their corners.
pub(super) fn pieces(n: usize) -> impl Iterator<Item = FacetPiece> {
    let at = move |i: usize, j: usize| {
        let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
        [1.0 - u - v, u, v]
    };
    let places = (0..n).flat_map(move |i| (0..n - i).map(move |j| (i, j)));
    places.flat_map(move |(i, j)| {
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
        const A_SIDE: usize = 128;
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
                let place = |[a, b]: [usize; 2]| {
                    let [u, v] = [a, b].map(|k| k as f64 / A_SIDE as f64);
                    ends[0] * (1.0 - u - v) + ends[1] * u + ends[2] * v
                };
                let lattice = (0..=A_SIDE).flat_map(|a| (0..=A_SIDE - a).map(move |b| [a, b]));
                let reached = |at: &[usize; 2]| place(*at).distance(tip.centre) < tip.radius;
                let all: Vec<[usize; 2]> = lattice.filter(reached).collect();
                let mut looked_at = Vec::new();
                tip.over(&ends, A_SIDE, |at, is| looked_at.push((at, is)));
                for (at, is) in &looked_at {
                    assert!(place(*at).distance(*is) < 1e-12, "{third:?} {turn}");
                }
                let found = looked_at.iter().map(|(at, _)| *at).filter(reached);
                assert_eq!(found.collect::<Vec<_>>(), all, "{third:?} {turn}");
                let few = all.len() + 4 * A_SIDE;
                assert!(looked_at.len() < few, "{} {few}", looked_at.len());
            }
        }
    }

    /// The pressure over a whole tip in the middle of a facet is what its integral says: q ∝ (1 - r²/a²)² has π a²/3.
    #[test]
    fn pressure_adds_up_to_its_integral() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        for grain in [0.05, 0.025, 0.0125] {
            let tip = StandingTip {
                centre: DVec3::new(0.3, 0.3, 0.0),
                radius: 0.2,
                grain,
            };
            let (mut total, mut middle) = (0.0, DVec3::ZERO);
            integrate(&mesh, 0, &WHOLE, &tip, AT_ONCE, &mut |at, share| {
                total += share;
                middle += share * mesh.point(at);
            });
            let exact = std::f64::consts::PI * 0.2_f64.powi(2) / 3.0;
            let off = (total / exact - 1.0).abs();
            assert!(off < 3.0 * (grain / 0.2).powi(4), "{grain}: {off}");
            assert!((middle / total).distance(tip.centre) < 1e-3 * grain);
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
