//! Long edges halved, so that there are vertices to paint on and to show fields at.
//!
//! CAD programs write a wall with as few triangles as its shape needs: a tube is a ring of strips from rim to rim, a plate
//! two triangles. What is painted, and what is shown of a field, has a value a vertex, and on such a mesh there are
//! none between the rims. Halving edges leaves the surface where it is. The longest edge of all is always the next one
//! (M.-C. Rivara 1984, bisection of the longest edge), so that neighbours stay joined and no angle becomes smaller than
//! half of the smallest before. Elements are laid on the mesh as it was given ([`TriMesh::as_given`]).

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};
use std::sync::Arc;

use glam::{DVec3, I64Vec3};

use super::TriMesh;

/// No more triangles are made than this.
const MOST: usize = 150_000;
/// Of the part's diagonal: how long edges may be where nobody says it.
const USUAL: f64 = 1.0 / 50.0;

/// How long edges may be (m) on a part whose triangles are large beside it; nothing where they are not.
#[must_use]
pub fn longest_wanted(mesh: &TriMesh) -> Option<f64> {
    /// Triangles with a side of so many usual ones are large.
    const LARGE: f64 = 3.0;
    /// Share of the area that may lie in them.
    const SHARE: f64 = 0.05;
    /// Area of a triangle over the square of the longest side allowed, at least on the mean.
    const FULL: f64 = 0.2;
    let (lower, upper) = mesh.bounds();
    let usual = USUAL * (upper - lower).length();
    let large: f64 = (0..mesh.triangles().len() as u32)
        .filter(|&t| mesh.longest_side(t) > LARGE * usual)
        .map(|t| mesh.facet_area(t))
        .sum();
    let affordable = (mesh.area() / (FULL * MOST as f64)).sqrt();
    (large > SHARE * mesh.area()).then(|| usual.max(affordable))
}

impl TriMesh {
    /// The same surface with all edges halved that are longer than this (m), until none is.
    #[must_use]
    pub fn with_long_edges_halved(self, longest: f64) -> Self {
        let mut triangles = 0..self.triangles.len() as u32;
        if triangles.len() >= MOST || !triangles.any(|t| self.longest_side(t) > longest) {
            return self;
        }
        let mut halving = Halving::new(&self, longest);
        while halving.triangles.len() < MOST {
            let Some(Long { edge, .. }) = halving.longest.pop() else {
                break;
            };
            halving.halve(edge);
        }
        let mut fine = Self::from_checked(halving.positions, halving.triangles);
        fine.closes_within = self.closes_within;
        fine.given = Some(Arc::new(self));
        fine.parents = halving.parents;
        fine
    }

    /// The mesh before its long edges were halved; itself where none was.
    #[must_use]
    pub fn as_given(self: &Arc<Self>) -> &Arc<Self> {
        self.given.as_ref().unwrap_or(self)
    }

    /// As [`Self::as_given`], of one that nobody shares yet.
    #[must_use]
    pub fn before_halving(&self) -> &Self {
        self.given.as_deref().unwrap_or(self)
    }

    /// A mask of this mesh from one of it, or of it before its long edges were halved: what was added belongs to it
    /// where that mask is mostly set ([`TriMesh::mostly_in`]). Nothing for a mask of another length.
    #[must_use]
    pub fn mask_of(&self, mask: Vec<bool>) -> Option<Vec<bool>> {
        if let Some(given) = &self.given
            && mask.len() == given.positions.len()
        {
            let mut shares: Vec<f64> = mask.iter().map(|&m| f64::from(u8::from(m))).collect();
            for &[a, b] in &self.parents {
                shares.push(f64::midpoint(shares[a as usize], shares[b as usize]));
            }
            return Some(shares.into_iter().map(|share| share >= 0.5).collect());
        }
        (mask.len() == self.positions.len()).then_some(mask)
    }

    /// The mask of the mesh before its long edges were halved that this one comes from; nothing where more was painted
    /// than that has vertices for.
    #[must_use]
    pub fn given_mask(&self, mask: &[bool]) -> Option<Vec<bool>> {
        let Some(given) = &self.given else {
            return Some(mask.to_vec());
        };
        let before = mask.get(..given.positions.len())?.to_vec();
        let again = self.mask_of(before.clone());
        (again.as_deref() == Some(mask)).then_some(before)
    }
}

/// An edge that is too long, the longest first. Lengths and places are rounded, so that neither the file's numbers
/// nor where the part lies decide between edges that are as long as each other.
#[derive(PartialEq, Eq)]
struct Long {
    length: i64,
    middle: [i64; 3],
    edge: [u32; 2],
}

impl Ord for Long {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |long: &Self| (long.length, long.middle, long.edge);
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for Long {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Halving {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    parents: Vec<[u32; 2]>,
    /// The triangles at each edge, which is named by its lower vertex and its higher one.
    around: HashMap<[u32; 2], Vec<u32>>,
    longest: BinaryHeap<Long>,
    /// How long edges may be (m).
    limit: f64,
    lower: DVec3,
}

impl Halving {
    fn new(mesh: &TriMesh, limit: f64) -> Self {
        let mut halving = Self {
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.clone(),
            parents: Vec::new(),
            around: HashMap::new(),
            longest: BinaryHeap::new(),
            limit,
            lower: mesh.bounds.0,
        };
        for edge in &mesh.edges {
            let ends = named(edge.a, edge.b);
            halving.around.insert(ends, edge.triangles.clone());
            halving.look_at(ends);
        }
        halving
    }

    fn look_at(&mut self, edge: [u32; 2]) {
        /// Steps of the rounding in the length that is allowed.
        const STEPS: f64 = 1e6;
        let [a, b] = edge.map(|v| self.positions[v as usize]);
        if a.distance(b) > self.limit {
            let rounded = |x: f64| (x / self.limit * STEPS).round() as i64;
            let middle: I64Vec3 = ((a.midpoint(b) - self.lower) / self.limit * STEPS)
                .round()
                .as_i64vec3();
            self.longest.push(Long {
                length: rounded(a.distance(b)),
                middle: middle.to_array(),
                edge,
            });
        }
    }

    /// Halves an edge, unless a triangle at it is so thin that its halves might have no area.
    fn halve(&mut self, [a, b]: [u32; 2]) {
        let Some(triangles) = self.around.get(&[a, b]) else {
            return;
        };
        if triangles.iter().any(|&t| self.is_thin(t)) {
            return;
        }
        let between = self.positions[a as usize].midpoint(self.positions[b as usize]);
        let middle = self.positions.len() as u32;
        self.positions.push(between);
        self.parents.push([a, b]);
        let triangles = self.around.remove(&[a, b]).unwrap_or_default();
        for &t in &triangles {
            self.part(t, [a, b], middle);
        }
        for end in [a, b] {
            self.look_at(named(end, middle));
        }
    }

    /// Whether rounding moves the corners of a triangle by a noticeable part of its height.
    fn is_thin(&self, t: u32) -> bool {
        /// Of its longest side. Halves of halves may be a hundred times as thin, and places are rounded to 1e-16.
        const HEIGHT: f64 = 1e-6;
        let [a, b, c] = self.triangles[t as usize].map(|v| self.positions[v as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (b - a).cross(c - a).length() < HEIGHT * longest * longest
    }

    /// Divides a triangle from the middle of one of its edges to the corner opposite; it keeps the half at the first
    /// end of that edge.
    fn part(&mut self, t: u32, [a, b]: [u32; 2], middle: u32) {
        let whole = self.triangles[t as usize];
        let Some(&apex) = whole.iter().find(|&&v| v != a && v != b) else {
            return;
        };
        let other = self.triangles.len() as u32;
        let half = |gone: u32| whole.map(|v| if v == gone { middle } else { v });
        self.triangles[t as usize] = half(b);
        self.triangles.push(half(a));
        if let Some(beside) = self.around.get_mut(&named(b, apex)) {
            for of in beside.iter_mut().filter(|of| **of == t) {
                *of = other;
            }
        }
        self.around.entry(named(a, middle)).or_default().push(t);
        self.around.entry(named(b, middle)).or_default().push(other);
        self.around.insert(named(apex, middle), vec![t, other]);
        self.look_at(named(apex, middle));
    }
}

fn named(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::SurfacePoint;

    /// A tube of strips from rim to rim (m), as CAD programs write it, its vertices turned by so many numbers.
    fn strips(turn: u32) -> TriMesh {
        const SIDES: u32 = 24;
        let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(SIDES);
        let positions: Vec<DVec3> = (0..2 * SIDES)
            .map(|v| {
                let (i, top) = ((v + turn) % (2 * SIDES) / 2, (v + turn) % 2);
                DVec3::new(
                    0.03 * angle(i).cos(),
                    0.03 * angle(i).sin(),
                    0.1 * f64::from(top),
                )
            })
            .collect();
        let number = |i: u32, top: u32| (2 * (i % SIDES) + top + 2 * SIDES - turn) % (2 * SIDES);
        let triangles: Vec<[u32; 3]> = (0..SIDES)
            .flat_map(|i| {
                let [a, b, c, d] =
                    [(i, 0), (i + 1, 0), (i + 1, 1), (i, 1)].map(|(i, top)| number(i, top));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        TriMesh::new(&positions, &triangles, 0).unwrap().0
    }

    #[test]
    fn strips_become_triangles_of_the_length_and_the_surface_stays() {
        let given = strips(0);
        let wanted = longest_wanted(&given).unwrap();
        let (area, edges) = (given.area(), given.boundary_edges().count());
        let fine = Arc::new(given.with_long_edges_halved(wanted));
        let longest = (0..fine.triangles().len() as u32)
            .map(|t| fine.longest_side(t))
            .fold(0.0, f64::max);
        assert!(longest <= wanted, "{longest} {wanted}");
        assert!((fine.area() / area - 1.0).abs() < 1e-12);
        assert!(fine.edges().iter().all(|e| e.triangles.len() <= 2));
        assert!(fine.boundary_edges().count() >= edges);
        let thinnest = (0..fine.triangles().len() as u32).map(|t| fine.thinness(t));
        // Strips of 8 × 100 mm: half of their smallest angle.
        assert!(thinnest.fold(f64::INFINITY, f64::min) > 0.035);
        // Normals still point outward, and what was given is there.
        let at = |t| SurfacePoint {
            triangle: t,
            barycentric: [1.0 / 3.0; 3],
        };
        for t in 0..fine.triangles().len() as u32 {
            let p = fine.point(at(t));
            assert!(fine.facet_normal(t).dot(p.with_z(0.0)) > 0.0);
        }
        assert_eq!(fine.as_given().triangles().len(), 48);
        assert!(longest_wanted(&fine).is_none());
    }

    #[test]
    fn masks_of_what_was_given_reach_as_far_as_they_did() {
        let fine = strips(0).with_long_edges_halved(0.005);
        let given = fine.before_halving().positions().to_vec();
        let below = |p: &DVec3| p.z < 0.05;
        let mask = fine.mask_of(given.iter().map(below).collect()).unwrap();
        for (p, &set) in fine.positions().iter().zip(&mask) {
            assert_eq!(set, p.z < 0.05 + 1e-9, "{p}");
        }
        let before = fine.given_mask(&mask).unwrap();
        assert_eq!(before.len(), given.len());
        let mut painted = mask.clone();
        painted[given.len()] ^= true;
        assert_eq!(fine.given_mask(&painted), None);
        assert_eq!(fine.mask_of(mask.clone()), Some(mask));
        assert_eq!(fine.mask_of(vec![true; 7]), None);
    }

    #[test]
    fn the_order_of_a_file_does_not_decide() {
        let places = |mesh: &TriMesh| {
            let mut places: Vec<[i64; 3]> = (mesh.positions().iter())
                .map(|p| (*p * 1e9).round().as_i64vec3().to_array())
                .collect();
            places.sort_unstable();
            places
        };
        let [one, other] = [0, 10].map(|turn| places(&strips(turn).with_long_edges_halved(0.004)));
        assert_eq!(one, other);
    }

    #[test]
    fn slivers_keep_their_area() {
        // Beside a square a triangle whose height is a few roundings.
        let far = 1.0;
        let points = [
            DVec3::new(far, 0.0, 0.0),
            DVec3::new(far + 0.1, 0.0, 0.0),
            DVec3::new(far + 0.1, 0.1, 0.0),
            DVec3::new(far, 0.1, 0.0),
            DVec3::new(far + 0.05, -3e-11, 0.0),
        ];
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 4, 1]];
        let fine = TriMesh::new(&points, &triangles, 0)
            .unwrap()
            .0
            .with_long_edges_halved(0.002);
        assert!(fine.triangles().len() > 1000);
        for t in 0..fine.triangles().len() as u32 {
            assert!(fine.facet_normal(t).z > 0.9, "{t}");
        }
    }

    #[test]
    fn a_mesh_that_is_fine_enough_is_left() {
        let fine = strips(0).with_long_edges_halved(0.003);
        let count = fine.triangles().len();
        assert!(longest_wanted(&fine).is_none());
        let again = Arc::new(fine.with_long_edges_halved(1.0));
        assert_eq!(again.triangles().len(), count);
    }
}
