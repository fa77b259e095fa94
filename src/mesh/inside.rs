//! Inside and outside of a closed surface, and how far it is.
//!
//! What is inside is said by the winding number, which gaps, overlaps and touching bodies leave alone. It is
//! asked once for each small piece of the surface; where that piece parts inside from outside, as it does
//! nearly everywhere, the side on which a point lies of it is enough (J. A. Bærentzen and H. Aanæs 2005). Points
//! nearest to a corner are few, and ask for themselves.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use glam::DVec3;

use super::winding::Winding;
use super::{SurfacePoint, TriMesh};

/// Distance to a surface, negative inside of it.
pub struct SignedDistance {
    mesh: Arc<TriMesh>,
    winding: Winding,
    /// How each triangle is split.
    splits: Vec<FacetSplit>,
    /// What is known of each piece: a pure function of the surface, filled as it is asked for.
    pieces: Vec<AtomicU8>,
}

/// A triangle in rows along its shortest side, and each row in columns: of one that is long and narrow there are no more pieces
/// than it is long.
struct FacetSplit {
    /// The corner opposite the shortest side.
    apex: usize,
    rows: u32,
    columns: u32,
    /// Number of the first piece.
    first: u32,
}

impl FacetSplit {
    /// Of a triangle with sides opposite its corners (m), in pieces of some size (m).
    fn new(opposite: [f64; 3], across: f64, first: u32) -> Self {
        let shorter = |a: &usize, b: &usize| opposite[*a].total_cmp(&opposite[*b]);
        let apex = (0..3).min_by(shorter).unwrap_or(0);
        let count = |length: f64| (length / across).ceil().max(1.0) as u32;
        Self {
            apex,
            rows: count(opposite.into_iter().fold(0.0, f64::max)),
            columns: count(opposite[apex]),
            first,
        }
    }

    fn pieces(&self) -> u32 {
        self.rows * self.columns
    }

    /// Row and column of a point.
    fn piece(&self, barycentric: [f64; 3]) -> [u32; 2] {
        let up = barycentric[self.apex];
        let along = barycentric[(self.apex + 1) % 3] / (1.0 - up).max(f64::MIN_POSITIVE);
        let within = |share: f64, count: u32| ((share * f64::from(count)) as u32).min(count - 1);
        [within(up, self.rows), within(along, self.columns)]
    }

    /// The point at these shares of a row and of a column.
    fn point(&self, [row, column]: [u32; 2], [up, along]: [f64; 2]) -> [f64; 3] {
        let up = (f64::from(row) + up) / f64::from(self.rows);
        let along = (f64::from(column) + along) / f64::from(self.columns) * (1.0 - up);
        let mut barycentric = [0.0; 3];
        barycentric[self.apex] = up;
        barycentric[(self.apex + 1) % 3] = along;
        barycentric[(self.apex + 2) % 3] = 1.0 - up - along;
        barycentric
    }
}

/// Pieces are about this share of the whole across.
const PIECE: f64 = 0.02;
/// Just outside a piece that parts outside from inside the surface winds less than this, and just inside as
/// nearly once.
const PARTS: f64 = 0.3;
/// Seen under a flatter angle than this a point has no clear side.
const FLAT: f64 = 1e-3;
/// A coordinate of the nearest point below this puts it on an edge.
const ON_EDGE: f64 = 1e-9;

const UNKNOWN: u8 = 0;
const PARTING: u8 = 1;
const UNCLEAR: u8 = 2;

impl SignedDistance {
    /// Prepares distances to a closed mesh.
    #[must_use]
    pub fn new(mesh: &Arc<TriMesh>) -> Self {
        let (lower, upper) = mesh.bounds();
        let across = PIECE * (upper - lower).length();
        let mut first = 0;
        let splits: Vec<FacetSplit> = (0..mesh.triangles().len() as u32)
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                let opposite = [b.distance(c), c.distance(a), a.distance(b)];
                let split = FacetSplit::new(opposite, across, first);
                first += split.pieces();
                split
            })
            .collect();
        Self {
            winding: Winding::new(mesh),
            mesh: Arc::clone(mesh),
            splits,
            pieces: (0..first).map(|_| AtomicU8::new(UNKNOWN)).collect(),
        }
    }

    /// Whether a point lies inside: more around than not.
    #[must_use]
    pub fn inside(&self, point: DVec3) -> bool {
        self.at(point) < 0.0
    }

    /// Signed distance (m).
    #[must_use]
    pub fn at(&self, point: DVec3) -> f64 {
        self.signed(point, self.mesh.index().nearest(point))
    }

    /// Signed distance (m) at a point of a ball, with what [`Self::nearby`] says of that ball.
    #[must_use]
    pub fn among(&self, nearby: Option<&[u32]>, point: DVec3) -> f64 {
        match nearby {
            Some(triangles) => self.signed(point, self.mesh.index().nearest_of(triangles, point)),
            None => self.at(point),
        }
    }

    /// The triangles that can be nearest to points of a ball (m), of those that can be for a larger ball around it, where
    /// they are known; `distance` (m) is that of its centre. Nothing where they are more than are worth looking through.
    #[must_use]
    pub fn nearby(
        &self,
        of: Option<&[u32]>,
        (centre, radius): (DVec3, f64),
        distance: f64,
    ) -> Option<Vec<u32>> {
        /// A tree is faster than a list from about here on.
        const MOST: usize = 48;
        /// Over all rounding.
        const SLACK: f64 = 1.0 + 1e-9;
        // No point of the ball is farther from the surface than this one, and the way from its centre, and back.
        let reach = (distance.abs() + 2.0 * radius) * SLACK;
        let within = self.mesh.index().within(of, centre, reach, MOST);
        within.filter(|triangles| !triangles.is_empty())
    }

    fn signed(&self, point: DVec3, (at, distance): (SurfacePoint, f64)) -> f64 {
        let away = point - self.mesh.point(at);
        let inside = match self.normal(at) {
            Some(normal) if normal.dot(away).abs() > FLAT * distance => normal.dot(away) < 0.0,
            _ => self.winding.at(point) > 0.5,
        };
        if inside { -distance } else { distance }
    }

    /// The direction outward at a point of the surface, where it parts inside from outside: that of the
    /// facet, or of both facets at its edge.
    fn normal(&self, at: SurfacePoint) -> Option<DVec3> {
        let t = at.triangle;
        if !self.parts(at) {
            return None;
        }
        let mut small = (0..3).filter(|&i| at.barycentric[i] < ON_EDGE);
        let Some(corner) = small.next() else {
            return Some(self.mesh.facet_normal(t));
        };
        if small.next().is_some() {
            return None;
        }
        let edge = &self.mesh.edges()[self.mesh.triangle_edges()[t as usize][corner] as usize];
        let [a, b] = edge.triangles[..] else {
            return None;
        };
        let other = if a == t { b } else { a };
        let beyond = self.seen_from(other, at);
        (self.parts(beyond)).then(|| self.mesh.facet_normal(t) + self.mesh.facet_normal(other))
    }

    /// A point on an edge of a triangle, as a point of the other triangle at that edge.
    fn seen_from(&self, other: u32, at: SurfacePoint) -> SurfacePoint {
        let own = self.mesh.triangles()[at.triangle as usize];
        let of = |v: u32| {
            (0..3)
                .find(|&i| own[i] == v)
                .map_or(0.0, |i| at.barycentric[i])
        };
        SurfacePoint {
            triangle: other,
            barycentric: self.mesh.triangles()[other as usize].map(of),
        }
    }

    /// Whether the piece around a point parts inside from outside.
    fn parts(&self, at: SurfacePoint) -> bool {
        let split = &self.splits[at.triangle as usize];
        let piece @ [row, column] = split.piece(at.barycentric);
        let known = &self.pieces[(split.first + row * split.columns + column) as usize];
        let state = match known.load(Ordering::Relaxed) {
            UNKNOWN => {
                let state = self.look(at.triangle, piece);
                known.store(state, Ordering::Relaxed);
                state
            }
            state => state,
        };
        state == PARTING
    }

    fn look(&self, triangle: u32, piece: [u32; 2]) -> u8 {
        /// Points looked at in a piece: its middle, and near its corners and the side nearest to the apex. Behind it the
        /// middle says enough: what has no thickness has none anywhere.
        const LOOKS: [[f64; 2]; 4] = [[0.5, 0.5], [0.05, 0.05], [0.05, 0.95], [0.95, 0.5]];
        /// How far outside, in sizes of the piece.
        const OFF: f64 = 1e-4;
        let split = &self.splits[triangle as usize];
        let longest = self.mesh.longest_side(triangle);
        let off = self.mesh.facet_normal(triangle) * (OFF * longest / f64::from(split.rows));
        let place = |share: [f64; 2]| {
            self.mesh.point(SurfacePoint {
                triangle,
                barycentric: split.point(piece, share),
            })
        };
        let clear = LOOKS
            .iter()
            .all(|share| self.winding.at(place(*share) + off).abs() < PARTS)
            && (self.winding.at(place(LOOKS[0]) - off) - 1.0).abs() < PARTS;
        if clear { PARTING } else { UNCLEAR }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::winding::tests::ball;
    use super::*;

    /// Long ones too, whichever corner is opposite the shortest side.
    #[test]
    fn every_point_of_a_triangle_is_in_the_piece_it_is_a_point_of() {
        for opposite in [
            [1.0, 1.0, 1.0],
            [0.1, 3.0, 3.0],
            [3.0, 0.4, 2.8],
            [2.0, 2.1, 0.3],
        ] {
            let split = FacetSplit::new(opposite, 0.25, 7);
            let mut pieces = std::collections::BTreeSet::new();
            for row in 0..split.rows {
                for column in 0..split.columns {
                    for share in [[0.5, 0.5], [0.01, 0.99], [0.99, 0.01]] {
                        let point = split.point([row, column], share);
                        assert!((point.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                        assert!(point.iter().all(|w| (0.0..=1.0).contains(w)), "{point:?}");
                        assert_eq!(split.piece(point), [row, column]);
                        pieces.insert(split.piece(point));
                    }
                }
            }
            assert_eq!(pieces.len(), split.pieces() as usize);
            let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            for [row, column] in corners.map(|corner| split.piece(corner)) {
                assert!(row < split.rows && column < split.columns);
            }
        }
        // Twelve rows of one column, not twelve times twelve.
        assert_eq!(FacetSplit::new([0.1, 3.0, 3.0], 0.25, 0).pieces(), 12);
    }

    /// The sign is that of the winding number everywhere but within rounding of the surface.
    fn agrees(mesh: &Arc<TriMesh>) -> usize {
        let distance = SignedDistance::new(mesh);
        let mut inside = 0;
        for k in 0..4000 {
            let k = f64::from(k);
            let p = DVec3::new(
                (k * 0.754).fract(),
                (k * 0.569).fract(),
                (k * 0.341).fract(),
            );
            let p = (p - 0.5) * 3.6;
            let expected = distance.winding.at(p) > 0.5;
            let signed = distance.at(p);
            assert!(
                signed.abs() < 1e-6 || expected == (signed < 0.0),
                "{p} {signed}"
            );
            inside += usize::from(expected);
        }
        inside
    }

    /// However balls are taken within balls, what is near says the same as the whole surface.
    #[test]
    fn the_triangles_near_a_ball_say_all_of_it() {
        let mesh = Arc::new(ball(3));
        let distance = SignedDistance::new(&mesh);
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut within = |radius: f64| {
            let mut drawn = || (2.0 * rng.random::<f64>() - 1.0) * radius;
            DVec3::new(drawn(), drawn(), drawn())
        };
        let (mut narrowed, mut looked) = (0, 0);
        for _ in 0..400 {
            let (mut centre, mut radius) = (within(1.2), 0.3);
            let mut nearby: Option<Vec<u32>> = None;
            for _ in 0..4 {
                let before = nearby.as_ref().map(Vec::len);
                nearby = distance
                    .nearby(nearby.as_deref(), (centre, radius), distance.at(centre))
                    .or(nearby);
                narrowed += usize::from(nearby.as_ref().map(Vec::len) < before);
                for _ in 0..8 {
                    // A box's corner lies on its ball: as far as points are asked for.
                    let point = centre + within(radius / 3f64.sqrt());
                    let (found, whole) =
                        (distance.among(nearby.as_deref(), point), distance.at(point));
                    assert!((found - whole).abs() < 1e-12, "{found} {whole}");
                    looked += usize::from(nearby.is_some());
                }
                centre += within(radius / 4.0);
                radius /= 2.0;
            }
        }
        assert!(narrowed > 100 && looked > 5000, "{narrowed} {looked}");
    }

    /// A ball with a fin that has two sides and nothing between them, outside and in its middle.
    #[test]
    fn sheets_without_thickness_do_no_harm() {
        let mesh = ball(3);
        let mut positions = mesh.positions().to_vec();
        let mut triangles = mesh.triangles().to_vec();
        for x in [0.9, -0.3] {
            let first = positions.len() as u32;
            positions.extend([
                DVec3::new(x, -0.3, 0.0),
                DVec3::new(x + 0.7, -0.3, 0.1),
                DVec3::new(x, 0.4, 0.0),
            ]);
            triangles.push([first, first + 1, first + 2]);
            triangles.push([first, first + 2, first + 1]);
        }
        let fins = Arc::new(TriMesh::from_checked(positions, triangles));
        let inside = agrees(&fins);
        assert!(inside.abs_diff(agrees(&Arc::new(mesh))) < 3);
    }

    #[test]
    fn holes_and_overlaps_do_no_harm() {
        let mesh = ball(3);
        // Without a cap the inside is still inside.
        let open: Vec<[u32; 3]> = (mesh.triangles().iter().enumerate())
            .filter(|(t, _)| mesh.corners(*t as u32)[0].z < 0.9)
            .map(|(_, t)| *t)
            .collect();
        let (open, report) = TriMesh::new(mesh.positions(), &open, 0).unwrap();
        assert!(report.boundary_edges > 0);
        let open = Arc::new(open);
        agrees(&open);
        let distance = SignedDistance::new(&open);
        assert!(distance.inside(DVec3::ZERO) && distance.inside(DVec3::new(0.0, 0.0, 0.7)));
        assert!(!distance.inside(DVec3::new(0.0, 0.0, 1.3)));
        assert!((distance.at(DVec3::X * 0.5) + 0.5).abs() < 0.01);
        // Two balls that overlap are one body, and the walls inside part nothing.
        let mut positions = mesh.positions().to_vec();
        positions.extend(mesh.positions().iter().map(|p| *p + DVec3::X * 0.7));
        let count = mesh.positions().len() as u32;
        let mut triangles = mesh.triangles().to_vec();
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + count)));
        let both = Arc::new(TriMesh::from_checked(positions, triangles));
        let inside = agrees(&both);
        assert!(inside > agrees(&Arc::new(mesh)));
        let distance = SignedDistance::new(&both);
        assert!(distance.inside(DVec3::X * 0.29) && distance.inside(DVec3::X * 0.31));
    }
}
