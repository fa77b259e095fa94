//! A piece of a mesh of tetrahedra, cut out around a place.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use crate::mesh::volume::VolumeMesh;

/// Tetrahedra of a piece: their models are small, and what they are cut along is far from the middle, in walls too.
const TETRAHEDRA: usize = 2500;

/// Some of a mesh's tetrahedra.
pub struct TetrahedraPiece {
    /// These tetrahedra as a mesh of their own (m).
    pub mesh: Arc<VolumeMesh>,
    /// The faces it was cut along, by their corners in rising order.
    pub cut: HashSet<[u32; 3]>,
    centre: DVec3,
    /// Of the farthest tetrahedron (m).
    radius: f64,
}

impl TetrahedraPiece {
    /// The tetrahedra that are nearest to a place (m).
    #[must_use]
    pub fn around(whole: &VolumeMesh, centre: DVec3) -> Self {
        let away = |tet: &[u32; 10]| {
            let middle: DVec3 = (tet[..4].iter())
                .map(|&n| whole.nodes[n as usize])
                .sum::<DVec3>()
                / 4.0;
            middle.distance(centre)
        };
        let distances: Vec<f64> = whole.tetrahedra.iter().map(away).collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().min(TETRAHEDRA);
        let radius = last.checked_sub(1).map_or(0.0, |last| sorted[last]);
        let taken = |element: usize| distances[element] <= radius;
        let (mesh, numbers) = part(whole, taken);
        let renumbered = |face: [u32; 3]| {
            let mut face = face.map(|n| numbers[&n]);
            face.sort_unstable();
            face
        };
        Self {
            cut: cut(whole, taken).into_iter().map(renumbered).collect(),
            mesh: Arc::new(mesh),
            centre,
            radius,
        }
    }

    /// The places (m) that lie well within.
    #[must_use]
    pub fn within(&self, places: &[DVec3]) -> Vec<DVec3> {
        /// Share of the radius: nearer to the cut, that is what is felt.
        const WELL: f64 = 0.6;
        let near = |p: &&DVec3| p.distance(self.centre) < WELL * self.radius;
        places.iter().filter(near).copied().collect()
    }
}

/// Some of the tetrahedra with nodes of their own, and the new number of each old one.
fn part(whole: &VolumeMesh, taken: impl Fn(usize) -> bool) -> (VolumeMesh, HashMap<u32, u32>) {
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut nodes = Vec::new();
    let mut tetrahedra = Vec::new();
    for (_, tet) in (whole.tetrahedra.iter().enumerate()).filter(|(e, _)| taken(*e)) {
        tetrahedra.push(tet.map(|n| {
            *numbers.entry(n).or_insert_with(|| {
                nodes.push(whole.nodes[n as usize]);
                nodes.len() as u32 - 1
            })
        }));
    }
    let mesh = VolumeMesh {
        nodes,
        tetrahedra,
        from_linear: whole.from_linear,
    };
    (mesh, numbers)
}

/// Faces between a tetrahedron that is taken and one that is not, by their corners.
fn cut(whole: &VolumeMesh, taken: impl Fn(usize) -> bool) -> Vec<[u32; 3]> {
    let mut sides: HashMap<[u32; 3], [bool; 2]> = HashMap::new();
    for (element, tet) in whole.tetrahedra.iter().enumerate() {
        let [a, b, c, d] = [tet[0], tet[1], tet[2], tet[3]];
        for mut face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
            face.sort_unstable();
            sides.entry(face).or_default()[usize::from(taken(element))] = true;
        }
    }
    let both = sides.into_iter().filter(|(_, sides)| sides[0] && sides[1]);
    both.map(|(face, _)| face).collect()
}
