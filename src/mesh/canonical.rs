//! The canonical form of a part: a frame of its own, and an order of its own for vertices and triangles.
//!
//! Elements are laid by decisions (which edge is split first, which facet is nearest) that rounding takes one way or
//! the other wherever two choices are as good as each other, and on regular meshes they are everywhere. In canonical
//! form the numbers are the same to the last bit, however the file orders its vertices and triangles, wherever it puts
//! the part and in whatever unit it is written: the same part gets the same elements.

use std::cmp::Ordering;
use std::sync::Arc;

use glam::DVec3;

use super::TriMesh;
use super::oriented_box::OrientedBox;

/// Vertices of the part are rounded to its size over this power of two: far above the rounding of files and shifts in
/// double precision, far below what any part is made to. Files in single precision round parts far from their origin to more
/// than this: such a part, moved, is another one.
const PART: i32 = 28;
/// What is laid on it is rounded to this one: it only has to survive the way to where the part lies and back.
const REMESHED: i32 = 40;
/// Facets that rounding would turn further than this are finer than its steps (cos 8°).
const UNTURNED: f64 = 0.99;

/// Where a part lies, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanonicalFrame {
    /// The lower corner of the box around it (m).
    origin: DVec3,
    /// The power of two that is nearest to its longest side (m), so that steps have no rounding of their own.
    size: f64,
}

impl CanonicalFrame {
    /// The frame of a part.
    #[must_use]
    pub fn of(part: &TriMesh) -> Self {
        let (lower, upper) = part.bounds();
        let longest = (upper - lower).max_element();
        Self {
            origin: lower,
            size: 2f64.powi(longest.log2().round() as i32),
        }
    }

    /// A place that a file gives, such as a vertex of the part (m), in the frame.
    #[must_use]
    pub fn snapped(&self, place: DVec3) -> DVec3 {
        self.rounded(place - self.origin, PART)
    }

    /// A box that a file gives, in the frame.
    #[must_use]
    pub fn snapped_box(&self, given: &OrientedBox) -> OrientedBox {
        let origin = given.stance.coordinates(self.origin);
        OrientedBox {
            stance: given.stance,
            lower: self.rounded(given.lower - origin, PART),
            upper: self.rounded(given.upper - origin, PART),
        }
    }

    /// A vertex that was laid on the part (m), in the frame: exactly what [`Self::outward`] was given.
    #[must_use]
    pub fn inward(&self, place: DVec3) -> DVec3 {
        self.rounded(place - self.origin, REMESHED)
    }

    /// Where a place in the frame lies (m).
    #[must_use]
    pub fn outward(&self, place: DVec3) -> DVec3 {
        self.origin + self.rounded(place, REMESHED)
    }

    fn rounded(&self, place: DVec3, power: i32) -> DVec3 {
        let step = self.size / 2f64.powi(power);
        (place / step).round() * step
    }
}

/// A part in its frame, its vertices in the order of their places.
#[derive(Clone, Debug)]
pub struct Canonical {
    /// The part in that frame and order (m).
    pub mesh: Arc<TriMesh>,
    /// From the file's coordinates and back.
    pub frame: CanonicalFrame,
    /// For each vertex its number in the part.
    pub numbers: Vec<u32>,
}

impl Canonical {
    /// The canonical form of a part.
    #[must_use]
    pub fn of(part: &TriMesh) -> Self {
        let frame = CanonicalFrame::of(part);
        let given = part.positions();
        let snapped: Vec<DVec3> = given.iter().map(|&p| frame.snapped(p)).collect();
        let mut numbers: Vec<u32> = (0..given.len() as u32).collect();
        numbers.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|v| v as usize);
            by_place(snapped[a], snapped[b]).then_with(|| by_place(given[a], given[b]))
        });
        let places = if keeps_facets(part, &snapped) {
            snapped
        } else {
            given.iter().map(|&p| p - frame.origin).collect()
        };
        let positions = numbers.iter().map(|&v| places[v as usize]).collect();
        let mesh = TriMesh::from_checked(positions, renumbered(part.triangles(), &numbers));
        Self {
            mesh: Arc::new(mesh),
            frame,
            numbers,
        }
    }

    /// The part where it lies, in the order of its canonical form: what is laid or drawn on it by chance does not
    /// depend on how its file numbers it.
    #[must_use]
    pub fn where_it_lies(&self, part: &TriMesh) -> Arc<TriMesh> {
        let given = |&v: &u32| part.positions()[v as usize];
        let positions = self.numbers.iter().map(given).collect();
        let triangles = self.mesh.triangles().to_vec();
        let mut mesh = TriMesh::from_checked(positions, triangles);
        mesh.closes_within = part.closes_within;
        Arc::new(mesh)
    }

    /// A mask of the part's vertices in the order of these.
    #[must_use]
    pub fn in_order(&self, mask: &[bool]) -> Vec<bool> {
        let set = |&v: &u32| mask.get(v as usize) == Some(&true);
        self.numbers.iter().map(set).collect()
    }
}

fn by_place(a: DVec3, b: DVec3) -> Ordering {
    let by = |axis: usize| a[axis].total_cmp(&b[axis]);
    by(0).then_with(|| by(1)).then_with(|| by(2))
}

/// Triangles by the new numbers of their vertices (`numbers` has the old ones), each from its least one on, in rising
/// order.
fn renumbered(triangles: &[[u32; 3]], numbers: &[u32]) -> Vec<[u32; 3]> {
    let mut new = vec![0; numbers.len()];
    for (number, &old) in (0u32..).zip(numbers) {
        new[old as usize] = number;
    }
    let mut triangles: Vec<[u32; 3]> = triangles
        .iter()
        .map(|tri| least_first(tri.map(|v| new[v as usize])))
        .collect();
    triangles.sort_unstable();
    triangles
}

fn least_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if b < a && b < c {
        [b, c, a]
    } else if c < a && c < b {
        [c, a, b]
    } else {
        [a, b, c]
    }
}

/// Whether every facet of the part looks the same way when its corners are at other places.
fn keeps_facets(part: &TriMesh, places: &[DVec3]) -> bool {
    (0u32..).zip(part.triangles()).all(|(t, tri)| {
        let [a, b, c] = tri.map(|v| places[v as usize]);
        let turned = (b - a).cross(c - a).normalize_or_zero();
        turned.dot(part.facet_normal(t)) > UNTURNED
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::LimbSpec;

    fn limb() -> TriMesh {
        LimbSpec::default().build().unwrap().0
    }

    /// The same part: vertices and triangles the other way round, corners one further, somewhere else.
    fn elsewhere(part: &TriMesh, shift: DVec3) -> TriMesh {
        let last = part.positions().len() as u32 - 1;
        let positions: Vec<DVec3> = part.positions().iter().rev().map(|&p| p + shift).collect();
        let turned = part.triangles().iter().rev();
        let triangles: Vec<[u32; 3]> = turned
            .map(|&[a, b, c]| [b, c, a].map(|v| last - v))
            .collect();
        TriMesh::new(&positions, &triangles, 0).unwrap().0
    }

    #[test]
    fn order_and_place_leave_the_canonical_form_alone() {
        let part = limb();
        let here = Canonical::of(&part);
        for shift in [DVec3::ZERO, DVec3::new(1.25, -0.7, 3.0)] {
            let there = Canonical::of(&elsewhere(&part, shift));
            assert_eq!(here.mesh.positions(), there.mesh.positions());
            assert_eq!(here.mesh.triangles(), there.mesh.triangles());
            let back = |v: &u32| part.positions().len() as u32 - 1 - v;
            assert_eq!(
                here.numbers,
                there.numbers.iter().map(back).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn a_part_keeps_its_place_and_its_facets() {
        let part = limb();
        let own = Canonical::of(&part);
        for (&p, &v) in own.mesh.positions().iter().zip(&own.numbers) {
            assert!(own.frame.outward(p).distance(part.positions()[v as usize]) < 1e-9);
            assert_eq!(own.frame.inward(own.frame.outward(p)), p);
        }
        assert!((own.mesh.area() / part.area() - 1.0).abs() < 1e-7);
    }

    #[test]
    fn what_is_finer_than_the_steps_is_not_rounded_away() {
        let p = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(0.5, 3e-10, 0.0),
            DVec3::new(0.5, -1.0, 0.0),
        ];
        let (part, _) = TriMesh::new(&p, &[[0, 1, 2], [0, 3, 1]], 0).unwrap();
        let own = Canonical::of(&part);
        assert!((0..2).all(|t| own.mesh.facet_area(t) > 1e-10));
    }
}
