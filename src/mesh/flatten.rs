//! A part laid flat: a tube is unrolled about its axis, a plate is looked at from above.

use glam::{DVec2, DVec3};

use super::locate::SurfaceIndex;
use super::stance::Stance;
use super::stretch::{SeenFacets, Stretch};
use super::unroll::Unrolling;
use super::{SurfacePoint, TriMesh};

/// How points of the part become points of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    Tube(Unrolling),
    /// Seen along a normal.
    Plate {
        origin: DVec3,
        right: DVec3,
        up: DVec3,
    },
}

/// The part in the plane (m). Where walls lie over each other the outermost is on top.
pub struct Flat {
    rule: Rule,
    /// In the plane, the third coordinate telling what is on top; vertices at the seam of a tube are there
    /// once for each side.
    pub positions: Vec<DVec3>,
    /// The triangles of the part, in their order.
    pub triangles: Vec<[u32; 3]>,
    /// The part's vertex that each vertex is.
    pub vertices: Vec<u32>,
    /// Lower corner of its box (m).
    pub lower: DVec2,
    /// Upper corner (m).
    pub upper: DVec2,
    /// What became of lengths.
    pub stretch: Stretch,
    index: SurfaceIndex,
}

impl Flat {
    /// Unrolls a part about its axis, at the radius that keeps lengths on most of what is seen; a part whose
    /// normals mostly agree is a plate and seen from above.
    #[must_use]
    pub fn of(mesh: &TriMesh, stance: Stance) -> Self {
        let mut rule = rule(mesh, stance);
        let flat = Self::by(rule, mesh);
        let seen = SeenFacets::of(mesh, &flat.positions, &flat.triangles, &flat.index);
        let factor = match &mut rule {
            Rule::Tube(unrolling) => {
                let factor = seen.best_factor();
                unrolling.radius *= factor;
                factor
            }
            Rule::Plate { .. } => 1.0,
        };
        let flat = if rule == flat.rule {
            flat
        } else {
            Self::by(rule, mesh)
        };
        Self {
            stretch: seen.stretch(factor),
            ..flat
        }
    }

    fn by(rule: Rule, mesh: &TriMesh) -> Self {
        let mut positions: Vec<DVec3> = mesh.positions().iter().map(|&p| rule.lay(p)).collect();
        let mut vertices: Vec<u32> = (0..positions.len() as u32).collect();
        let mut triangles = mesh.triangles().to_vec();
        if let Rule::Tube(unrolling) = &rule {
            let around = unrolling.circumference();
            cut_at_the_seam(&mut positions, &mut vertices, &mut triangles, around);
        }
        let flat = || positions.iter().map(|p| p.truncate());
        let lower = flat().fold(DVec2::INFINITY, DVec2::min);
        let upper = flat().fold(DVec2::NEG_INFINITY, DVec2::max);
        Self {
            index: SurfaceIndex::of(positions.clone(), &triangles),
            stretch: Stretch::default(),
            rule,
            positions,
            triangles,
            vertices,
            lower,
            upper,
        }
    }

    /// How far lengths are off around each vertex, as a share: the mean over what is seen there.
    #[must_use]
    pub fn stretch_at_vertices(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.positions.len()];
        for (tri, &off) in self.triangles.iter().zip(&self.stretch.facets) {
            let [a, b, c] = tri.map(|v| self.positions[v as usize].truncate());
            let area = (b - a).perp_dot(c - a).abs();
            for &v in tri.iter().filter(|_| off > 0.0) {
                let (sum, weight) = &mut sums[v as usize];
                *sum += area * off;
                *weight += area;
            }
        }
        let mean = |(sum, weight): (f64, f64)| if weight > 0.0 { sum / weight } else { 0.0 };
        sums.into_iter().map(mean).collect()
    }

    /// A point of the axis that a tube is unrolled about (m); a plate has none.
    #[must_use]
    pub fn axis_point(&self) -> Option<DVec3> {
        match &self.rule {
            Rule::Tube(unrolling) => Some(unrolling.origin),
            Rule::Plate { .. } => None,
        }
    }

    /// Once around a tube, in the plane (m); a plate has no such way.
    #[must_use]
    pub fn around(&self) -> Option<f64> {
        match &self.rule {
            Rule::Tube(unrolling) => Some(unrolling.circumference()),
            Rule::Plate { .. } => None,
        }
    }

    /// Where a point of the part (m) is in the plane.
    #[must_use]
    pub fn place(&self, p: DVec3) -> DVec2 {
        self.rule.lay(p).truncate()
    }

    /// The point of the part that is on top at a place of the plane, if there is one.
    #[must_use]
    pub fn lift(&self, place: DVec2) -> Option<SurfacePoint> {
        let high = 4.0 * (self.upper - self.lower).length();
        let hit = self.index.ray(place.extend(high), DVec3::NEG_Z)?;
        Some(hit.0)
    }

    /// A direction at a point of the part, in the plane; not of unit length.
    #[must_use]
    pub fn turn(&self, p: DVec3, direction: DVec3) -> DVec2 {
        let size = (self.upper - self.lower).length();
        let step = 1e-5 * size;
        let mut across = self.place(p + direction * step) - self.place(p - direction * step);
        if let Rule::Tube(unrolling) = &self.rule {
            // Over the seam the two ends are a whole turn apart.
            let around = unrolling.circumference();
            across.x -= (across.x / around).round() * around;
        }
        across / (2.0 * step)
    }
}

impl Rule {
    /// Into the plane; the third coordinate rises outwards.
    fn lay(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Tube(unrolling) => {
                let r = p - unrolling.origin;
                let out = (r - unrolling.axis * r.dot(unrolling.axis)).length();
                unrolling.flat(p).extend(out - unrolling.radius)
            }
            Self::Plate { origin, right, up } => {
                let r = p - *origin;
                DVec3::new(r.dot(*right), r.dot(*up), r.dot(right.cross(*up)))
            }
        }
    }
}

fn rule(mesh: &TriMesh, stance: Stance) -> Rule {
    /// The mean of all unit normals: none on a tube, one on a plate.
    const AGREE: f64 = 0.8;
    let areas: DVec3 = (0..mesh.triangles().len() as u32)
        .map(|t| mesh.facet_normal(t) * mesh.facet_area(t))
        .sum();
    if areas.length() < AGREE * mesh.area() {
        return Rule::Tube(Unrolling::of(mesh, stance));
    }
    let normal = areas.normalize();
    let aim = if stance.up().dot(normal).abs() > 0.9 {
        stance.right()
    } else {
        stance.up()
    };
    let up = (aim - normal * aim.dot(normal)).normalize();
    let (lower, upper) = mesh.bounds();
    Rule::Plate {
        origin: (lower + upper) / 2.0,
        right: up.cross(normal),
        up,
    }
}

/// Triangles that reach over the seam get their own vertices on its far side.
fn cut_at_the_seam(
    positions: &mut Vec<DVec3>,
    vertices: &mut Vec<u32>,
    triangles: &mut [[u32; 3]],
    around: f64,
) {
    let mut beyond = std::collections::BTreeMap::new();
    for triangle in triangles {
        let s = triangle.map(|v| positions[v as usize].x);
        let (low, high) = (
            s.into_iter().fold(f64::MAX, f64::min),
            s.into_iter().fold(f64::MIN, f64::max),
        );
        if high - low < 0.5 * around {
            continue;
        }
        for (v, s) in triangle.iter_mut().zip(s) {
            if s < 0.5 * around {
                *v = *beyond.entry(*v).or_insert_with(|| {
                    let p = positions[*v as usize];
                    positions.push(p + DVec3::X * around);
                    vertices.push(vertices[*v as usize]);
                    positions.len() as u32 - 1
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tube() -> TriMesh {
        let (around, high) = (24, 6);
        let p: Vec<DVec3> = (0..=high)
            .flat_map(|j| {
                (0..around).map(move |i| {
                    let a = f64::from(i) / f64::from(around) * std::f64::consts::TAU;
                    DVec3::new(0.03 * a.cos(), 0.03 * a.sin(), 0.01 * f64::from(j))
                })
            })
            .collect();
        let at = |i: i32, j: i32| (j * around + i % around) as u32;
        let t: Vec<[u32; 3]> = (0..high)
            .flat_map(|j| {
                (0..around).flat_map(move |i| {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    [[a, b, c], [a, c, d]]
                })
            })
            .collect();
        TriMesh::new(&p, &t, 0).unwrap().0
    }

    #[test]
    fn a_tube_unrolls_without_tearing_its_triangles() {
        let mesh = tube();
        let flat = Flat::of(&mesh, Stance::about(DVec3::Z));
        let size = flat.upper - flat.lower;
        assert!(
            (size.y - 0.06).abs() < 1e-9 && size.x > 0.9 * std::f64::consts::TAU * 0.03,
            "{size}"
        );
        for (t, tri) in flat.triangles.iter().enumerate() {
            let [a, b, c] = tri.map(|v| flat.positions[v as usize]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(longest < 0.014, "triangle {t}: {longest}");
            let own = tri.map(|v| flat.vertices[v as usize]);
            assert_eq!(own, mesh.triangles()[t]);
            assert!(
                (b - a).cross(c - a).z > 0.0,
                "seen from outside, triangle {t}"
            );
        }
        // There and back.
        for t in 0..mesh.triangles().len() as u32 {
            let at = SurfacePoint {
                triangle: t,
                barycentric: [0.2, 0.3, 0.5],
            };
            let p = mesh.point(at);
            let place = flat.place(p);
            let back = flat.lift(place).map(|at| mesh.point(at));
            assert!(
                back.is_none_or(|b| b.distance(p) < 1e-3),
                "{place} {back:?} {p}"
            );
        }
    }

    #[test]
    fn a_direction_is_kept_across_the_seam() {
        let flat = Flat::of(&tube(), Stance::about(DVec3::Z));
        let turned = flat.turn(DVec3::new(-0.03, 0.0, 0.02), DVec3::NEG_Y);
        assert!(turned.distance(DVec2::X) < 0.01, "{turned}");
    }

    #[test]
    fn a_plate_is_seen_from_above() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let mesh = TriMesh::new(&p, &[[0, 1, 2], [0, 2, 3]], 0).unwrap().0;
        let flat = Flat::of(&mesh, Stance::about(DVec3::Z));
        assert!(((flat.upper - flat.lower) - DVec2::ONE).length() < 1e-9);
        let at = flat.lift(flat.place(DVec3::new(0.3, 0.6, 0.0))).unwrap();
        assert!(mesh.point(at).distance(DVec3::new(0.3, 0.6, 0.0)) < 1e-9);
        let turned = flat.turn(DVec3::new(0.5, 0.5, 0.0), DVec3::X);
        assert!((turned.length() - 1.0).abs() < 1e-6);
    }
}
