//! How sharply a surface is bent, whatever the size of its triangles: the curvature measure of a neighbourhood
//! (Cohen-Steiner & Morvan, "Restricted Delaunay triangulations and normal cycle", Symposium on Computational Geometry 2003).
//!
//! Every edge turns the surface by its dihedral angle. The turns of all edges within a reach, over the area there,
//! are the mean curvature tensor of that place: many small turns of fine triangles weigh as much as the few large
//! ones of coarse triangles. Both are weighted by ρ² − r², which is smooth at the rim of the neighbourhood.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{Edge, TriMesh};

/// A neighbourhood reaches over at least so many heights of the triangles in it: fewer columns of a coarse
/// cylinder would be counted, not measured.
const COLUMNS: f64 = 3.0;
/// And no farther than this share of the part where its triangles are fine, which bounds the work.
const FARTHEST: f64 = 0.05;
/// Places that are looked at; of fewer facets it is each of them.
const PLACES: usize = 4001;
/// Of more facets than this fewer places do, but no fewer than these: each neighbourhood holds the more of them.
const MANY: usize = 200_000;
const FEWEST: usize = 501;

/// A place's share of the area looked at (m²), and its largest curvature (1/m).
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    /// Share of the area (m²).
    pub area: f64,
    /// Largest curvature (1/m).
    pub curvature: f64,
}

/// The largest curvature at places spread evenly over some facets, in neighbourhoods of a radius (m) that end at
/// sharp edges.
#[must_use]
pub fn bends(
    mesh: &TriMesh,
    facets: &[u32],
    reach: f64,
    sharp: impl Fn(usize) -> bool + Sync,
) -> Vec<Bend> {
    let (lower, upper) = mesh.bounds();
    // `min` leaves out a reach that is not known.
    let reach = reach.min(FARTHEST * (upper - lower).length());
    let angles = dihedrals(mesh);
    let measured = |near: &mut NearFacets, (facet, area): (u32, f64)| Bend {
        area,
        curvature: near.curvature(mesh, facet, reach, &sharp),
    };
    places(mesh, facets)
        .into_par_iter()
        .map_init(|| NearFacets::over(mesh, &angles), measured)
        .collect()
}

/// By how much the surface turns at each edge between two facets (rad): neighbourhoods overlap, and ask for it many times.
fn dihedrals(mesh: &TriMesh) -> Vec<f64> {
    let p = mesh.positions();
    let between = |edge: &Edge| {
        let [here, there] = edge.triangles[..] else {
            return 0.0;
        };
        let ends = [edge.a, edge.b];
        let ahead = |t: u32| {
            let corners = mesh.triangles()[t as usize];
            (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == ends)
        };
        // Where one facet lies inside out, neither tells which way the surface turns.
        if ahead(here) == ahead(there) {
            return 0.0;
        }
        let ends = ends.map(|v| p[v as usize]);
        let [from, to] = if ahead(here) {
            ends
        } else {
            [ends[1], ends[0]]
        };
        let along = (to - from).normalize_or_zero();
        let (here, there) = (mesh.facet_normal(here), mesh.facet_normal(there));
        here.cross(there).dot(along).atan2(here.dot(there))
    };
    mesh.edges().par_iter().map(between).collect()
}

/// Facets to look at, each with the area that it stands for (m²).
fn places(mesh: &TriMesh, facets: &[u32]) -> Vec<(u32, f64)> {
    let areas = facets.iter().map(|&t| (t, mesh.facet_area(t)));
    if facets.len() <= PLACES {
        return areas.collect();
    }
    let places = (PLACES * MANY / facets.len()).clamp(FEWEST, PLACES);
    let step = areas.clone().map(|a| a.1).sum::<f64>() / places as f64;
    let mut sum = 0.0;
    let stands_for = |(facet, area): (u32, f64)| {
        let before = (sum / step).round();
        sum += area;
        let steps = (sum / step).round() - before;
        (steps > 0.0).then_some((facet, steps * step))
    };
    areas.filter_map(stands_for).collect()
}

/// The facets around a place, and room to find them in.
struct NearFacets<'a> {
    /// By how much the surface turns at each edge (rad).
    angles: &'a [f64],
    /// The number of the search that met each facet last.
    met: Vec<u32>,
    search: u32,
    facets: Vec<u32>,
    /// What the ball weighs on each of them (m⁴).
    weights: Vec<f64>,
}

impl<'a> NearFacets<'a> {
    fn over(mesh: &TriMesh, angles: &'a [f64]) -> Self {
        Self {
            angles,
            met: vec![0; mesh.triangles().len()],
            search: 0,
            facets: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// The largest curvature at the middle of a facet (1/m).
    fn curvature(
        &mut self,
        mesh: &TriMesh,
        facet: u32,
        reach: f64,
        sharp: &impl Fn(usize) -> bool,
    ) -> f64 {
        let centre = mesh.corners(facet).iter().sum::<DVec3>() / 3.0;
        let mut ball = Ball {
            centre,
            radius: reach,
        };
        self.find(mesh, facet, &ball, sharp);
        let enough = COLUMNS * self.height(mesh);
        if enough > ball.radius {
            ball.radius = enough;
            self.find(mesh, facet, &ball, sharp);
        }
        let weight = Matrix3::from_diagonal_element(self.weights.iter().sum());
        let turned = weight - self.unturned(mesh, &ball, sharp);
        largest(self.turns(mesh, &ball, sharp), turned)
    }

    /// What is connected with a facet inside the ball without crossing a sharp edge.
    fn find(&mut self, mesh: &TriMesh, facet: u32, ball: &Ball, sharp: &impl Fn(usize) -> bool) {
        self.search += 1;
        self.facets.clear();
        self.facets.push(facet);
        self.met[facet as usize] = self.search;
        let mut next = 0;
        while let Some(&t) = self.facets.get(next) {
            next += 1;
            for side in smooth_sides(mesh, t, ball, sharp) {
                if self.met[side.beyond as usize] != self.search {
                    self.met[side.beyond as usize] = self.search;
                    self.facets.push(side.beyond);
                }
            }
        }
        self.weights.clear();
        let of = |&t: &u32| ball.of_facet(mesh.corners(t));
        self.weights.extend(self.facets.iter().map(of));
    }

    /// The height that half of what is in the ball is lower than (m).
    fn height(&self, mesh: &TriMesh) -> f64 {
        let of = |(&t, &weight): (&u32, &f64)| {
            let height = mesh.thinness(t) * mesh.longest_side(t);
            (height, weight)
        };
        let mut heights: Vec<(f64, f64)> = self.facets.iter().zip(&self.weights).map(of).collect();
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = heights.iter().map(|h| h.1).sum::<f64>() / 2.0;
        let mut sum = 0.0;
        let middle = heights.iter().find(|h| {
            sum += h.1;
            sum >= half
        });
        middle.map_or(0.0, |h| h.0)
    }

    /// Sum of the turns over the edges in the ball, along them.
    fn turns(&self, mesh: &TriMesh, ball: &Ball, sharp: &impl Fn(usize) -> bool) -> Matrix3<f64> {
        let mut turns = Matrix3::zeros();
        for &t in &self.facets {
            for FacetSide {
                edge, ends, weight, ..
            } in smooth_sides(mesh, t, ball, sharp)
            {
                let along = (ends[1] - ends[0]).normalize_or_zero();
                // Either facet of an edge has half of it.
                turns += onto(along) * (0.5 * self.angles[edge] * weight);
            }
        }
        turns
    }

    /// The strips along rims and sharp edges, half a facet wide, which no edge turns the surface for.
    fn unturned(
        &self,
        mesh: &TriMesh,
        ball: &Ball,
        sharp: &impl Fn(usize) -> bool,
    ) -> Matrix3<f64> {
        let mut strips = Matrix3::zeros();
        for &t in &self.facets {
            for (corner, &edge) in mesh.triangle_edges()[t as usize].iter().enumerate() {
                let edge = edge as usize;
                if mesh.edges()[edge].triangles.len() == 2 && !sharp(edge) {
                    continue;
                }
                let (from, to) = side(mesh, t, corner);
                let along = (to - from).normalize_or_zero();
                // A height is twice the area over the side.
                let half = mesh.facet_area(t) / from.distance(to);
                strips += onto(along) * (half * ball.of_edge(from, to));
            }
        }
        strips
    }
}

/// The projection onto a direction.
fn onto(along: DVec3) -> Matrix3<f64> {
    let along = Vector3::new(along.x, along.y, along.z);
    along * along.transpose()
}

/// The ends of the side opposite a corner, as the triangle goes round.
fn side(mesh: &TriMesh, facet: u32, corner: usize) -> (DVec3, DVec3) {
    let p = mesh.corners(facet);
    (p[(corner + 1) % 3], p[(corner + 2) % 3])
}

/// A side of a facet that reaches into a ball and is not sharp.
struct FacetSide {
    edge: usize,
    /// As the facet goes round (m).
    ends: [DVec3; 2],
    /// The facet beyond it.
    beyond: u32,
    /// What the ball weighs along it (m³).
    weight: f64,
}

/// Those sides of a facet.
fn smooth_sides(
    mesh: &TriMesh,
    facet: u32,
    ball: &Ball,
    sharp: &impl Fn(usize) -> bool,
) -> impl Iterator<Item = FacetSide> {
    let edges = mesh.triangle_edges()[facet as usize];
    (0..3).filter_map(move |corner| {
        let edge = edges[corner] as usize;
        let [s, t] = mesh.edges()[edge].triangles[..] else {
            return None;
        };
        if sharp(edge) {
            return None;
        }
        let (from, to) = side(mesh, facet, corner);
        let weight = ball.of_edge(from, to);
        (weight > 0.0).then_some(FacetSide {
            edge,
            ends: [from, to],
            beyond: if s == facet { t } else { s },
            weight,
        })
    })
}

/// A neighbourhood, weighted by the square of its radius less that of the distance.
struct Ball {
    centre: DVec3,
    /// m.
    radius: f64,
}

impl Ball {
    /// The weight along an edge (m³).
    fn of_edge(&self, from: DVec3, to: DVec3) -> f64 {
        let Some(along) = (to - from).try_normalize() else {
            return 0.0;
        };
        let (start, end) = (from - self.centre, to - self.centre);
        let off = start - along * start.dot(along);
        // Of the chord that the ball cuts from the line.
        let square = (self.radius * self.radius - off.length_squared()).max(0.0);
        let chord = square.sqrt();
        let until = |s: f64| {
            let s = s.clamp(-chord, chord);
            square * s - s.powi(3) / 3.0
        };
        until(end.dot(along)) - until(start.dot(along))
    }

    /// The weight over a facet (m⁴): what the ball cuts from it is summed as sectors from the centre's foot on its
    /// plane, one for each side.
    fn of_facet(&self, corners: [DVec3; 3]) -> f64 {
        let [first, second, third] = corners;
        let Some(normal) = (second - first).cross(third - first).try_normalize() else {
            return 0.0;
        };
        let off = (first - self.centre).dot(normal);
        let square = self.radius * self.radius - off * off;
        if square <= 0.0 {
            return 0.0;
        }
        let flat = corners.map(|p| p - self.centre - normal * off);
        let sum: f64 = (0..3)
            .map(|i| sector(flat[i], flat[(i + 1) % 3], normal, square))
            .sum();
        sum.max(0.0)
    }
}

/// The integral of `square` − r² over the triangle of the origin and a side, as far as that is positive; negative
/// where the side goes round the other way.
fn sector(from: DVec3, to: DVec3, normal: DVec3, square: f64) -> f64 {
    let Some(along) = (to - from).try_normalize() else {
        return 0.0;
    };
    let height = from.cross(along).dot(normal);
    let chord = (square - height * height).max(0.0).sqrt();
    let [start, end] = [from, to].map(|p| p.dot(along));
    let [first, last] = [start, end].map(|s| s.clamp(-chord, chord));
    let within =
        |s: f64| square * height * s / 2.0 - (height.powi(3) * s + height * s.powi(3) / 3.0) / 4.0;
    // Most sides of a fine mesh lie within the ball as a whole.
    if [first, last] == [start, end] {
        return within(last) - within(first);
    }
    let angle = |s: f64| height.signum() * s.atan2(height.abs());
    let beyond = (angle(end) - angle(last)) - (angle(start) - angle(first));
    within(last) - within(first) + square * square / 4.0 * beyond
}

/// The largest curvature (1/m), whichever way it bends: turns over the weight of what is turned, by direction.
fn largest(turns: Matrix3<f64>, turned: Matrix3<f64>) -> f64 {
    /// Of narrow strips next to nothing is left between their rims: no less than this share of the rest.
    const LEAST: f64 = 0.25;
    if !turns.iter().chain(turned.iter()).all(|v| v.is_finite()) {
        return 0.0;
    }
    let weights = turned.symmetric_eigen();
    let least = (LEAST * weights.eigenvalues.max()).max(f64::MIN_POSITIVE);
    let roots = weights.eigenvalues.map(|w| w.max(least).sqrt().recip());
    let scale = weights.eigenvectors * Matrix3::from_diagonal(&roots);
    let tensor = scale.transpose() * turns * scale;
    tensor.symmetric_eigen().eigenvalues.amax()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weight of a disc is πρ⁴/2, however it is cut into triangles.
    #[test]
    fn what_a_ball_cuts_from_facets_is_summed_exactly() {
        let ball = Ball {
            centre: DVec3::new(0.1, 0.2, 0.5),
            radius: 1.0,
        };
        let rim = [(-9.0, -8.0), (8.0, -9.0), (9.0, 8.0), (-8.0, 9.0)];
        let rim = rim.map(|(x, y)| DVec3::new(x, y, 0.0));
        let middle = DVec3::new(0.3, 0.1, 0.0);
        let facets = (0..4).map(|i| [rim[i], rim[(i + 1) % 4], middle]);
        let sum: f64 = facets.map(|f| ball.of_facet(f)).sum();
        // A disc of the square radius 1 − ¼.
        let truth = std::f64::consts::PI * 0.75 * 0.75 / 2.0;
        assert!((sum / truth - 1.0).abs() < 1e-12, "{sum} of {truth}");
        let small = [DVec3::ZERO, DVec3::X * 1e-3, DVec3::Y * 1e-3];
        let weight = ball.of_facet(small) / (5e-7 * (1.0 - 0.3));
        assert!((weight - 1.0).abs() < 1e-2, "{weight}");
        let length = ball.of_edge(DVec3::new(-9.0, 0.2, 0.5), DVec3::new(9.0, 0.2, 0.5));
        assert!((length - 4.0 / 3.0).abs() < 1e-12, "{length}");
    }
}
