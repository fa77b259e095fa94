//! Quadratic tetrahedra whose edges are bent so far that they are turned inside out somewhere are mended as other
//! codes mend them: by straight edges.
//!
//! The determinant of the map is a cubic over the tetrahedron. It is nowhere less than the least of its Bernstein
//! coefficients, and those at the corners are its values there (A. Johnen, J.-F. Remacle and C. Geuzaine, Geometrical
//! validity of curvilinear finite elements, J. Comput. Phys. 233, 2013).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{DMat3, DVec3};

use super::{EDGES, VolumeError, VolumeMesh, jacobian, node_place};
use crate::plain;
use crate::units;

/// What was straightened.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Straightened {
    /// Tetrahedra that were turned inside out somewhere, before or when an edge of theirs was straightened.
    pub tetrahedra: usize,
    /// Edges that were straightened.
    pub edges: usize,
    /// The farthest that a node was moved (m), and from where.
    pub largest: f64,
    /// Where that node was (m).
    pub place: DVec3,
}

impl Straightened {
    /// What was done, as a sentence without a stop; nothing where nothing was.
    #[must_use]
    pub fn in_words(&self) -> Option<String> {
        (self.edges > 0).then(|| {
            format!(
                "{} turned inside out by bent edges: {} straightened, which moved nodes by {} at most (near {:.2} mm; part.straighten_mm is the limit)",
                plain::either(self.tetrahedra, "tetrahedron was", "tetrahedra were"),
                plain::either(self.edges, "edge was", "edges were"),
                plain::length(self.largest),
                units::mm(self.place)
            )
        })
    }

    fn add(&mut self, bend: &BentEdge) {
        self.edges += 1;
        if bend.shift > self.largest {
            (self.largest, self.place) = (bend.shift, bend.from);
        }
    }
}

/// An edge that is not straight.
struct BentEdge {
    /// Its node, where that is and where it would be (m).
    node: u32,
    from: DVec3,
    to: DVec3,
    shift: f64,
}

impl VolumeMesh {
    /// Straightens edges until no tetrahedron is turned inside out anywhere: of each that is the edge that helps most,
    /// then what that turns over in its neighbours. Neither the order of the tetrahedra nor that of their nodes matters.
    ///
    /// # Errors
    /// [`VolumeError::Folded`] where a node would have to move by more than `most` (m).
    pub fn straighten(&mut self, most: f64) -> Result<Straightened, VolumeError> {
        let mut done = Straightened::default();
        let mut mended: BTreeSet<usize> = BTreeSet::new();
        let mut suspects: Vec<usize> = (0..self.tetrahedra.len()).collect();
        let mut around: Option<HashMap<u32, Vec<usize>>> = None;
        loop {
            suspects.retain(|&element| self.is_inside_out(element));
            mended.extend(&suspects);
            let bends = self.worst_bends(&suspects, most)?;
            if bends.is_empty() {
                break;
            }
            let around = around.get_or_insert_with(|| self.around_middles());
            let mut touched: BTreeSet<usize> = BTreeSet::new();
            for (node, bend) in &bends {
                self.nodes[*node as usize] = bend.to;
                done.add(bend);
                touched.extend(around.get(node).into_iter().flatten());
            }
            suspects = touched.into_iter().collect();
        }
        done.tetrahedra = mended.len();
        Ok(done)
    }

    /// The edge to straighten of each of some tetrahedra, by its node.
    fn worst_bends(
        &self,
        elements: &[usize],
        most: f64,
    ) -> Result<BTreeMap<u32, BentEdge>, VolumeError> {
        let mut bends = BTreeMap::new();
        for &element in elements {
            let Some(bend) = self.worst_bend(element) else {
                continue;
            };
            if bend.shift > most {
                return Err(VolumeError::Folded {
                    element,
                    place: bend.from,
                    shift: bend.shift,
                    most,
                });
            }
            bends.insert(bend.node, bend);
        }
        Ok(bends)
    }

    /// The bent edge without whose bend the tetrahedron has most volume where it has least; nothing where all are
    /// straight.
    fn worst_bend(&self, element: usize) -> Option<BentEdge> {
        let tet = self.tetrahedra[element];
        let p = tet.map(|n| self.nodes[n as usize]);
        let bends = EDGES.iter().enumerate().filter_map(|(k, &[a, b])| {
            let (from, to) = (p[4 + k], (p[a] + p[b]) / 2.0);
            let mut mended = p;
            mended[4 + k] = to;
            let bend = BentEdge {
                node: tet[4 + k],
                from,
                to,
                shift: from.distance(to),
            };
            (from != to).then(|| (least_determinant(&mended), bend))
        });
        let best = bends.max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, bend)| bend)
    }

    /// Whether the map of a tetrahedron turns over somewhere, or so nearly that strains read there mean nothing.
    fn is_inside_out(&self, element: usize) -> bool {
        /// Least share of the volume of straight edges: other codes refuse a map that varies a thousandfold.
        const LEAST: f64 = 1e-3;
        let p = self.tetrahedra[element].map(|n| self.nodes[n as usize]);
        let is_straight = |(k, &[a, b]): (usize, &[usize; 2])| p[4 + k] == (p[a] + p[b]) / 2.0;
        if EDGES.iter().enumerate().all(is_straight) {
            return false;
        }
        let straight = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
        least_determinant(&p) <= LEAST * straight
    }

    /// The tetrahedra around each node in the middle of an edge.
    fn around_middles(&self) -> HashMap<u32, Vec<usize>> {
        let mut around: HashMap<u32, Vec<usize>> = HashMap::new();
        for (element, tet) in self.tetrahedra.iter().enumerate() {
            for &middle in &tet[4..] {
                around.entry(middle).or_default().push(element);
            }
        }
        around
    }
}

/// The least Bernstein coefficient of the determinant of a tetrahedron's map (m³).
fn least_determinant(p: &[DVec3; 10]) -> f64 {
    // The map is quadratic, its derivatives are linear: those at the corners say all.
    let at: [DMat3; 4] = std::array::from_fn(|corner| jacobian(p, node_place(corner)));
    let of = |i: usize, j: usize, k: usize| at[i].x_axis.cross(at[j].y_axis).dot(at[k].z_axis);
    let mut least = f64::INFINITY;
    for i in 0..4 {
        for j in i..4 {
            for k in j..4 {
                let even = of(i, j, k) + of(j, k, i) + of(k, i, j);
                let odd = of(i, k, j) + of(k, j, i) + of(j, i, k);
                least = least.min((even + odd) / 6.0);
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra on one face, with nodes between their corners.
    fn pair() -> VolumeMesh {
        let nodes = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::splat(-1.0),
        ];
        VolumeMesh::of_linear(nodes.to_vec(), &[[0, 1, 2, 3], [0, 2, 1, 4]])
            .checked()
            .unwrap()
    }

    #[test]
    fn the_bound_is_exact_at_corners_and_below_the_rest() {
        let mut mesh = pair();
        for (node, k) in (5..).zip(0..6) {
            let angle = f64::from(k);
            mesh.nodes[node] += DVec3::new(angle.sin(), angle.cos(), 0.3) * 0.1;
        }
        let p = mesh.tetrahedra[0].map(|n| mesh.nodes[n as usize]);
        let least = least_determinant(&p);
        let mut sampled = f64::INFINITY;
        for (i, j, k) in (0..11 * 11 * 11).map(|n| (n % 11, n / 11 % 11, n / 121)) {
            if i + j + k <= 10 {
                let at = DVec3::new(f64::from(i), f64::from(j), f64::from(k)) / 10.0;
                sampled = sampled.min(jacobian(&p, at).determinant());
            }
        }
        assert!(least <= sampled + 1e-12, "{least} {sampled}");
        let straight = pair();
        let p = straight.tetrahedra[0].map(|n| straight.nodes[n as usize]);
        assert!((least_determinant(&p) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn only_what_turns_over_is_straightened() {
        let mut mesh = pair();
        let [bent, slight] = [mesh.tetrahedra[0][4], mesh.tetrahedra[0][9]];
        // So near to the corner that the way there turns back.
        mesh.nodes[bent as usize] = DVec3::new(0.2, 0.0, 0.0);
        mesh.nodes[slight as usize] += DVec3::splat(0.02);
        let kept = mesh.nodes[slight as usize];
        let done = mesh.straighten(1.0).unwrap();
        assert_eq!((done.tetrahedra, done.edges), (2, 1));
        assert!((done.largest - 0.3).abs() < 1e-12);
        assert_eq!(mesh.nodes[bent as usize], DVec3::new(0.5, 0.0, 0.0));
        assert_eq!(mesh.nodes[slight as usize], kept);
        assert_eq!(mesh.straighten(1.0).unwrap(), Straightened::default());
        assert_eq!(Straightened::default().in_words(), None);
    }

    #[test]
    fn the_limit_is_kept() {
        let mut mesh = pair();
        let bent = mesh.tetrahedra[0][4] as usize;
        mesh.nodes[bent] = DVec3::new(0.2, 0.0, 0.0);
        let before = mesh.clone();
        let said = mesh.straighten(0.1).unwrap_err();
        assert!(matches!(said, VolumeError::Folded { element: 0, .. }));
        assert!(said.to_string().contains("part.straighten_mm"), "{said}");
        assert_eq!(mesh, before);
    }
}
