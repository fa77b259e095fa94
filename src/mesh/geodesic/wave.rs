//! How a wave goes on from two vertices to a third.

use glam::{DVec2, DVec3};

use crate::mesh::TriMesh;

/// A triangle laid flat: A at the origin, B at (c, 0), the target at (x, y) with y > 0.
#[derive(Clone, Copy, Debug)]
pub struct Unfolded {
    c: f64,
    x: f64,
    y: f64,
}

impl Unfolded {
    /// Lays the triangle of three points in space (m) flat.
    #[must_use]
    pub fn new(a: DVec3, b: DVec3, target: DVec3) -> Self {
        let c = a.distance(b);
        let e = (b - a) / c;
        let x = (target - a).dot(e);
        Self {
            c,
            x,
            y: ((target - a) - e * x).length(),
        }
    }

    /// The same from points in a plane.
    fn flat(a: DVec2, b: DVec2, target: DVec2) -> Self {
        let at = |p: DVec2| p.extend(0.0);
        Self::new(at(a), at(b), at(target))
    }

    /// With A and B exchanged.
    fn turned(self) -> Self {
        Self {
            x: self.c - self.x,
            ..self
        }
    }

    /// Through a virtual source below the side AB, at the distances given from A and B.
    #[must_use]
    pub fn circular(&self, da: f64, db: f64) -> Option<f64> {
        let sx = (da * da - db * db + self.c * self.c) / (2.0 * self.c);
        let below = da * da - sx * sx;
        if below < 0.0 {
            return None;
        }
        let sy = -below.sqrt();
        let crossing = sx + (self.x - sx) * (-sy) / (self.y - sy);
        (0.0..=self.c)
            .contains(&crossing)
            .then(|| (self.x - sx).hypot(self.y - sy))
    }

    /// A plane wave whose value is `da` at A and `db` at B, if it enters through the side AB.
    #[must_use]
    pub fn straight(&self, da: f64, db: f64) -> Option<f64> {
        let gx = (db - da) / self.c;
        let rest = 1.0 - gx * gx;
        if rest <= 0.0 {
            return None;
        }
        let gy = rest.sqrt();
        let crossing = self.x - self.y * gx / gy;
        (0.0..=self.c)
            .contains(&crossing)
            .then_some(da + gx * self.x + gy * self.y)
    }
}

/// A vertex that another one helps to reach.
#[derive(Clone, Copy, Debug)]
pub struct Help {
    /// Number of the vertex that is reached.
    pub target: u32,
    /// From the helping vertex straight to the target (m).
    pub straight: f64,
    /// The second vertex of a triangle with both, which the wave may cross between the two.
    pub other: u32,
    /// That triangle laid flat, the helping vertex at its origin.
    pub triangle: Unfolded,
}

/// For every vertex whom it helps, and with whom. A triangle with an obtuse corner gets no wave that is
/// on time: triangles beyond its opposite side are unfolded into its plane, until a vertex divides the
/// corner into two acute ones (R. Kimmel and J. Sethian, 1998, section 4).
#[must_use]
pub fn helps(mesh: &TriMesh) -> Vec<Vec<Help>> {
    let mut helps = vec![Vec::new(); mesh.positions().len()];
    for (number, triangle) in (0..).zip(mesh.triangles()) {
        for corner in 0..3 {
            let target = triangle[corner];
            let (a, b) = (triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]);
            let flat = Corner::new(mesh, target, a, b);
            let mut add = |a: (u32, DVec2), b: (u32, DVec2)| {
                let triangle = Unfolded::flat(a.1, b.1, DVec2::ZERO);
                helps[a.0 as usize].push(Help {
                    target,
                    straight: a.1.length(),
                    other: b.0,
                    triangle,
                });
                helps[b.0 as usize].push(Help {
                    target,
                    straight: b.1.length(),
                    other: a.0,
                    triangle: triangle.turned(),
                });
            };
            add((a, flat.a), (b, flat.b));
            if let Some(between) = flat.divided(mesh, number, corner) {
                add((a, flat.a), between);
                add(between, (b, flat.b));
            }
        }
    }
    helps
}

/// Whether a shortest way may bend around each vertex: only at a rim, or where there is more surface around
/// it than in a plane.
#[must_use]
pub fn bends(mesh: &TriMesh) -> Vec<bool> {
    /// A flat vertex has a full turn, to rounding.
    const FLAT: f64 = 1e-6;
    let mut angles = vec![0.0; mesh.positions().len()];
    for triangle in mesh.triangles() {
        let p = triangle.map(|v| mesh.positions()[v as usize]);
        for k in 0..3 {
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            angles[triangle[k] as usize] += a.angle_between(b);
        }
    }
    (mesh.boundary_vertices().iter().zip(angles))
        .map(|(&rim, angle)| rim || angle > std::f64::consts::TAU + FLAT)
        .collect()
}

/// A corner of a triangle laid flat, itself at the origin.
struct Corner {
    a: DVec2,
    b: DVec2,
}

impl Corner {
    fn new(mesh: &TriMesh, target: u32, a: u32, b: u32) -> Self {
        let p = |v: u32| mesh.positions()[v as usize];
        let (to_a, to_b) = (p(a) - p(target), p(b) - p(target));
        let angle = to_a.angle_between(to_b);
        Self {
            a: DVec2::new(to_a.length(), 0.0),
            b: DVec2::from_angle(angle) * to_b.length(),
        }
    }

    /// A vertex beyond the opposite side that divides an obtuse corner into two acute ones, with its place
    /// in the corner's plane; none where the surface ends or turns away first.
    fn divided(&self, mesh: &TriMesh, triangle: u32, corner: usize) -> Option<(u32, DVec2)> {
        /// Triangles that are unfolded at most.
        const MOST: usize = 24;
        if self.a.dot(self.b) >= 0.0 {
            return None;
        }
        let own = mesh.triangles()[triangle as usize];
        let mut sides = [
            (own[(corner + 1) % 3], self.a),
            (own[(corner + 2) % 3], self.b),
        ];
        let mut edge = mesh.triangle_edges()[triangle as usize][corner];
        let mut from = triangle;
        for _ in 0..MOST {
            let beyond = &mesh.edges()[edge as usize].triangles;
            let [one, two] = beyond[..] else {
                return None;
            };
            from = if one == from { two } else { one };
            let corners = mesh.triangles()[from as usize];
            let apex = (0..3).find(|&k| sides.iter().all(|s| s.0 != corners[k]))?;
            let place = apart(mesh, corners[apex], sides);
            if place.dot(self.a) > 0.0 && place.dot(self.b) > 0.0 {
                return Some((corners[apex], place));
            }
            // The wave comes from the directions that are acute to both sides; the apex lies to one side
            // of them, and what is beyond the other edge comes next.
            let kept = usize::from(place.dot(self.b) <= 0.0);
            let dropped = 1 - kept;
            let leaving = (0..3).find(|&k| corners[k] == sides[dropped].0)?;
            sides[dropped] = (corners[apex], place);
            edge = mesh.triangle_edges()[from as usize][leaving];
        }
        None
    }
}

/// Where a vertex lies in the plane of an edge whose ends are known, on the side away from the origin.
fn apart(mesh: &TriMesh, vertex: u32, [(a, at_a), (b, at_b)]: [(u32, DVec2); 2]) -> DVec2 {
    let p = |v: u32| mesh.positions()[v as usize];
    let flat = Unfolded::new(p(a), p(b), p(vertex));
    let along = (at_b - at_a) / flat.c;
    let across = along.perp();
    let away = if across.dot(at_a) < 0.0 {
        -across
    } else {
        across
    };
    at_a + along * flat.x + away * flat.y
}
