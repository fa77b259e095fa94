//! Values known at scattered places of a surface, carried to its vertices.

use glam::DVec3;

use super::TriMesh;

/// Places that share in a vertex's value.
const NEAREST: usize = 8;

/// What values at some places weigh at the vertices of a surface: found once, for values that change often.
pub struct Scatter {
    /// Of each vertex the places that share in its value, and their weights; none where there are no places.
    shares: Vec<Vec<(usize, f64)>>,
}

impl Scatter {
    /// Places are positions (m) with outward unit normals. Those on the same side of the wall share in a vertex's
    /// value, weighed by a Gaussian as wide as half of them lie apart (E. Nadaraya, Theory Probab. Appl. 9, 1964).
    #[must_use]
    pub fn new(mesh: &TriMesh, places: &[(DVec3, DVec3)]) -> Self {
        let share = |(&position, &normal): (&DVec3, &DVec3)| {
            let near = nearest(places, position, normal);
            let width = (near.get(near.len() / 2)).map_or(1.0, |n| n.0.max(f64::MIN_POSITIVE));
            let weighed = |(squared, place): (f64, usize)| (place, (-0.5 * squared / width).exp());
            near.into_iter().map(weighed).collect()
        };
        Self {
            shares: (mesh.positions().iter().zip(mesh.vertex_normals()))
                .map(share)
                .collect(),
        }
    }

    /// One value a vertex, from one a place: the weighed mean of those that share in it; zero where none do.
    #[must_use]
    pub fn carry(&self, values: &[f64]) -> Vec<f64> {
        let mean = |shares: &Vec<(usize, f64)>| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for &(place, w) in shares {
                sum += w * values[place];
                weight += w;
            }
            if weight > 0.0 { sum / weight } else { 0.0 }
        };
        self.shares.iter().map(mean).collect()
    }
}

/// One value a vertex, from values at places as [`Scatter::new`] takes them.
#[must_use]
pub fn to_vertices(mesh: &TriMesh, places: &[(DVec3, DVec3)], values: &[f64]) -> Vec<f64> {
    Scatter::new(mesh, places).carry(values)
}

/// Squared distances and numbers of the nearest places, rising. Those on the other side of the wall
/// count only where there are no others.
fn nearest(places: &[(DVec3, DVec3)], position: DVec3, normal: DVec3) -> Vec<(f64, usize)> {
    let with = |same_side: bool| -> Vec<(f64, usize)> {
        places
            .iter()
            .enumerate()
            .filter(|(_, (_, n))| !same_side || n.dot(normal) > 0.0)
            .map(|(k, (p, _))| (p.distance_squared(position), k))
            .collect()
    };
    let mut all = with(true);
    if all.is_empty() {
        all = with(false);
    }
    let by_distance = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if all.len() > NEAREST {
        all.select_nth_unstable_by(NEAREST - 1, by_distance);
        all.truncate(NEAREST);
    }
    all.sort_by(by_distance);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate() -> TriMesh {
        let at = |i: u32, j: u32| i * 11 + j;
        let positions: Vec<DVec3> = (0..11)
            .flat_map(|i| (0..11).map(move |j| DVec3::new(f64::from(i), f64::from(j), 0.0)))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..10)
            .flat_map(|i| {
                (0..10).flat_map(move |j| {
                    [
                        [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                        [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]
                })
            })
            .collect();
        TriMesh::new(&positions, &triangles, 0).unwrap().0
    }

    #[test]
    fn a_map_follows_what_it_was_made_from_and_not_the_other_side() {
        let mesh = plate();
        let up = DVec3::Z * mesh.vertex_normals()[0].z.signum();
        let mut places = Vec::new();
        let mut values = Vec::new();
        for k in 0..150 {
            let p = DVec3::new(
                10.0 * (0.618 * f64::from(k)).fract(),
                10.0 * (0.382 * f64::from(k * k)).fract(),
                0.0,
            );
            places.push((p, up));
            values.push(p.x);
            // What lies under the plate says something else.
            places.push((p, -up));
            values.push(1000.0);
        }
        for (p, v) in mesh
            .positions()
            .iter()
            .zip(to_vertices(&mesh, &places, &values))
        {
            assert!((v - p.x).abs() < 2.0, "{v} at {}", p.x);
        }
        let flat = to_vertices(&mesh, &places[..2], &[3.0, 7.0]);
        assert!(flat.iter().all(|v| (v - 3.0).abs() < 1e-12));
    }
}
