//! Points spread over a surface: uniformly at random, or evenly.
//!
//! Even spreading is weighted sample elimination (C. Yuksel, "Sample elimination for generating Poisson
//! disk sample sets", Computer Graphics Forum 34 (2015)): it gives exactly the count asked for.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{SurfacePoint, TriMesh};

/// How many random points each even one is chosen from.
const OVERSAMPLING: usize = 5;
/// Draws allowed for each point wanted before a region counts as empty.
const ATTEMPTS: usize = 400;

/// `count` points, uniform by area, where `accept` says yes; fewer when it hardly ever does.
#[must_use]
pub fn random(
    mesh: &TriMesh,
    count: usize,
    seed: u64,
    accept: impl Fn(SurfacePoint) -> bool,
) -> Vec<SurfacePoint> {
    random_among(mesh, &|_| true, count, seed, accept)
}

/// As [`random`], drawing only from some triangles: where what is accepted is small and known.
#[must_use]
pub fn random_among(
    mesh: &TriMesh,
    among: &dyn Fn(u32) -> bool,
    count: usize,
    seed: u64,
    accept: impl Fn(SurfacePoint) -> bool,
) -> Vec<SurfacePoint> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let cumulative: Vec<f64> = (0..mesh.triangles().len() as u32)
        .scan(0.0, |sum, t| {
            if among(t) {
                *sum += mesh.facet_area(t);
            }
            Some(*sum)
        })
        .collect();
    let total = cumulative.last().copied().unwrap_or(0.0);
    if total <= 0.0 {
        return Vec::new();
    }
    let mut points = Vec::with_capacity(count);
    let mut attempts = count.saturating_mul(ATTEMPTS);
    while points.len() < count && attempts > 0 {
        attempts -= 1;
        let target = rng.random::<f64>() * total;
        let triangle = cumulative.partition_point(|&c| c <= target);
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        let root = u.sqrt();
        let point = SurfacePoint {
            triangle: triangle.min(cumulative.len() - 1) as u32,
            barycentric: [1.0 - root, root * (1.0 - v), root * v],
        };
        if accept(point) {
            points.push(point);
        }
    }
    points
}

/// `count` points, spread evenly over the part of the surface where `accept` says yes.
#[must_use]
pub fn even(
    mesh: &TriMesh,
    count: usize,
    seed: u64,
    accept: impl Fn(SurfacePoint) -> bool,
) -> Vec<SurfacePoint> {
    even_among(mesh, &|_| true, count, seed, accept)
}

/// As [`even`], drawing only from some triangles.
#[must_use]
pub fn even_among(
    mesh: &TriMesh,
    among: &dyn Fn(u32) -> bool,
    count: usize,
    seed: u64,
    accept: impl Fn(SurfacePoint) -> bool,
) -> Vec<SurfacePoint> {
    let many = count.saturating_mul(OVERSAMPLING);
    let pool = random_among(mesh, among, many, seed, accept);
    if pool.len() <= count {
        return pool;
    }
    let positions: Vec<DVec3> = pool.iter().map(|&p| mesh.point(p)).collect();
    // The share of the surface that was accepted is not known in closed form; all that was drawn from is an
    // upper bound that only makes the weights reach a little further.
    let triangles = 0..mesh.triangles().len() as u32;
    let area: f64 = triangles
        .filter(|&t| among(t))
        .map(|t| mesh.facet_area(t))
        .sum();
    let radius = (area / (2.0 * 3f64.sqrt() * count as f64)).sqrt();
    let kept = eliminate(&positions, count, radius);
    kept.into_iter().map(|i| pool[i]).collect()
}

#[derive(PartialEq)]
struct Crowded {
    weight: f64,
    index: usize,
}
impl Eq for Crowded {}
impl Ord for Crowded {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight
            .total_cmp(&other.weight)
            .then(other.index.cmp(&self.index))
    }
}
impl PartialOrd for Crowded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Removes the most crowded point again and again until `count` are left; their indices, rising.
fn eliminate(positions: &[DVec3], count: usize, radius: f64) -> Vec<usize> {
    let reach = 2.0 * radius;
    let mut neighbours = neighbours_within(positions, reach);
    for (_, d) in neighbours.iter_mut().flatten() {
        // From here on not the distance but how much it crowds.
        *d = (1.0 - *d / reach).powi(8);
    }
    let mut weight: Vec<f64> = neighbours
        .iter()
        .map(|list| list.iter().map(|n| n.1).sum())
        .collect();
    let mut alive = vec![true; positions.len()];
    let mut heap: BinaryHeap<Crowded> = weight
        .iter()
        .enumerate()
        .map(|(index, &weight)| Crowded { weight, index })
        .collect();
    let mut left = positions.len();
    while left > count {
        let Some(Crowded { weight: w, index }) = heap.pop() else {
            break;
        };
        if w.to_bits() != weight[index].to_bits() {
            // From before a neighbour was removed: weights only fall, so it waits its turn.
            heap.push(Crowded {
                weight: weight[index],
                index,
            });
            continue;
        }
        alive[index] = false;
        left -= 1;
        for &(other, crowding) in &neighbours[index] {
            if alive[other] {
                weight[other] -= crowding;
            }
        }
    }
    (0..positions.len()).filter(|&i| alive[i]).collect()
}

/// For each point the others within `reach`, with their distances, by a hash grid.
pub(crate) fn neighbours_within(positions: &[DVec3], reach: f64) -> Vec<Vec<(usize, f64)>> {
    neighbours_of(positions, &|_| true, reach)
}

/// As [`neighbours_within`] for some of the points; the lists of the others stay empty.
pub(crate) fn neighbours_of(
    positions: &[DVec3],
    of: &dyn Fn(usize) -> bool,
    reach: f64,
) -> Vec<Vec<(usize, f64)>> {
    // Wide numbers: a part far from the origin must not fall into one cell.
    let cell = |p: DVec3| (p / reach).floor().to_array().map(|x| x as i64);
    let mut grid: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (i, &p) in positions.iter().enumerate() {
        grid.entry(cell(p)).or_default().push(i);
    }
    let mut near = vec![Vec::new(); positions.len()];
    for (&home, members) in &grid {
        let asked: Vec<usize> = members.iter().copied().filter(|&i| of(i)).collect();
        if asked.is_empty() {
            continue;
        }
        let around: Vec<usize> = (0..27)
            .filter_map(|k| {
                let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let key: [i64; 3] = std::array::from_fn(|a| home[a].wrapping_add(step[a]));
                grid.get(&key)
            })
            .flatten()
            .copied()
            .collect();
        for i in asked {
            for &j in &around {
                let d = positions[i].distance(positions[j]);
                if j != i && d < reach {
                    near[i].push((j, d));
                }
            }
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> TriMesh {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y];
        TriMesh::new(&p, &[[0, 1, 2]], 0).unwrap().0
    }

    fn closest_pair(mesh: &TriMesh, points: &[SurfacePoint]) -> f64 {
        let p: Vec<DVec3> = points.iter().map(|&s| mesh.point(s)).collect();
        let mut best = f64::INFINITY;
        for i in 0..p.len() {
            for j in 0..i {
                best = best.min(p[i].distance(p[j]));
            }
        }
        best
    }

    #[test]
    fn even_points_keep_their_distance() {
        let mesh = triangle();
        let even_gap = closest_pair(&mesh, &even(&mesh, 200, 7, |_| true));
        let random_gap = closest_pair(&mesh, &random(&mesh, 200, 7, |_| true));
        let ideal = 2.0 * (0.5 / (2.0 * 3f64.sqrt() * 200.0)).sqrt();
        assert!(even_gap > 0.5 * ideal, "{even_gap} of {ideal}");
        assert!(random_gap < 0.3 * ideal);
    }

    #[test]
    fn the_seed_decides() {
        let mesh = triangle();
        assert_eq!(even(&mesh, 50, 1, |_| true), even(&mesh, 50, 1, |_| true));
        assert_ne!(even(&mesh, 50, 1, |_| true), even(&mesh, 50, 2, |_| true));
    }

    #[test]
    fn an_empty_region_gives_nothing_and_ends() {
        assert!(even(&triangle(), 50, 1, |_| false).is_empty());
    }
}
