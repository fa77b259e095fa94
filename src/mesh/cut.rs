//! Cuts triangles along the faces of boxes, so that a region given by a box has an edge of the mesh for
//! its border. No point of the surface moves.

use std::collections::HashMap;

use glam::DVec3;

use super::TriMesh;
use super::oriented_box::OrientedBox;
use super::stance::Stance;
use crate::bounds::Bounds;

/// Points within this share of the part's size of a plane lie on it: files round their numbers, and people
/// draw boxes a hair too large.
pub const ON_PLANE: f64 = 1e-4;

/// The mesh with every triangle that reaches through a face of a box cut there. Old vertices keep
/// their numbers; of each new one, the two old ones between which it lies and how far it is along.
#[must_use]
pub fn cut_by_boxes(mesh: &TriMesh, boxes: &[OrientedBox]) -> (TriMesh, Vec<(u32, u32, f64)>) {
    let (lower, upper) = mesh.bounds();
    let slack = ON_PLANE * (upper - lower).length();
    let mut cut = MeshCutter {
        positions: mesh.positions().to_vec(),
        triangles: mesh.triangles().to_vec(),
        parents: Vec::new(),
        places: Vec::new(),
        slack,
    };
    for region in boxes {
        cut.by_box(region);
    }
    if cut.parents.is_empty() {
        return (mesh.clone(), cut.parents);
    }
    (
        TriMesh::from_checked(cut.positions, cut.triangles),
        cut.parents,
    )
}

struct MeshCutter {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    parents: Vec<(u32, u32, f64)>,
    /// The positions in the coordinates of the box that is cut along.
    places: Vec<DVec3>,
    slack: f64,
}

impl MeshCutter {
    fn by_box(&mut self, region: &OrientedBox) {
        let places = self.positions.iter();
        self.places = places.map(|&p| region.stance.coordinates(p)).collect();
        let Bounds { lower, upper } = Bounds::around(self.places.iter().copied());
        for axis in 0..3 {
            for value in [region.lower[axis], region.upper[axis]] {
                if value > lower[axis] + self.slack && value < upper[axis] - self.slack {
                    self.by_face(axis, value, region);
                }
            }
        }
    }

    fn by_face(&mut self, axis: usize, value: f64, region: &OrientedBox) {
        let side: Vec<f64> = self
            .places
            .iter()
            .map(|p| {
                let d = p[axis] - value;
                if d.abs() <= self.slack { 0.0 } else { d }
            })
            .collect();
        // An edge is cut when any triangle on it reaches the face, so that neighbours agree.
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let reaching: Vec<bool> = self
            .triangles
            .iter()
            .map(|t| self.reaches(t, axis, region))
            .collect();
        for (tri, _) in self
            .triangles
            .clone()
            .iter()
            .zip(&reaching)
            .filter(|(_, r)| **r)
        {
            for i in 0..3 {
                let (p, q) = (tri[i], tri[(i + 1) % 3]);
                if side[p as usize] * side[q as usize] < 0.0 {
                    self.cut_edge([p.min(q), p.max(q)], &side, &mut middles, region.stance);
                }
            }
        }
        if middles.is_empty() {
            return;
        }
        self.triangles = self
            .triangles
            .iter()
            .flat_map(|&tri| divided(tri, &middles))
            .collect();
    }

    fn reaches(&self, tri: &[u32; 3], axis: usize, region: &OrientedBox) -> bool {
        (0..3).filter(|&a| a != axis).all(|a| {
            let x = tri.map(|v| self.places[v as usize][a]);
            let (least, most) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
            least <= region.upper[a] + self.slack && most >= region.lower[a] - self.slack
        })
    }

    fn cut_edge(
        &mut self,
        [a, b]: [u32; 2],
        side: &[f64],
        middles: &mut HashMap<(u32, u32), u32>,
        stance: Stance,
    ) {
        let next = self.positions.len() as u32;
        if *middles.entry((a, b)).or_insert(next) != next {
            return;
        }
        let (x, y) = (side[a as usize], side[b as usize]);
        let along = x / (x - y);
        let (p, q) = (self.positions[a as usize], self.positions[b as usize]);
        let middle = p.lerp(q, along);
        self.positions.push(middle);
        self.places.push(stance.coordinates(middle));
        self.parents.push((a, b, along));
    }
}

/// A triangle divided at those of its edges that have a middle: at none, one or two of them.
fn divided(tri: [u32; 3], middles: &HashMap<(u32, u32), u32>) -> Vec<[u32; 3]> {
    let middle = |i: usize| {
        let (p, q) = (tri[i], tri[(i + 1) % 3]);
        middles.get(&(p.min(q), p.max(q))).copied()
    };
    match [middle(0), middle(1), middle(2)] {
        [None, None, None] => vec![tri],
        // A plane meets at most two edges away from their ends; turn the triangle to one case of each.
        [Some(m), None, None] => vec![[tri[0], m, tri[2]], [m, tri[1], tri[2]]],
        [None, Some(_), _] => divided([tri[1], tri[2], tri[0]], middles),
        [_, None, Some(_)] => divided([tri[2], tri[0], tri[1]], middles),
        [Some(m), Some(n), _] => vec![[tri[0], m, n], [m, tri[1], n], [tri[0], n, tri[2]]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_gets_a_border_and_the_surface_stays() {
        let p = [
            DVec3::ZERO,
            DVec3::new(10.0, 0.0, 0.0),
            DVec3::new(10.0, 8.0, 0.0),
            DVec3::new(0.0, 8.0, 0.0),
        ];
        let (mesh, _) = TriMesh::new(&p, &[[0, 1, 2], [0, 2, 3]], 0).unwrap();
        let (low, high) = (DVec3::new(2.0, 1.0, -1.0), DVec3::new(5.0, 4.0, 1.0));
        let (cut, _) = cut_by_boxes(&mesh, &[OrientedBox::of_file(low, high)]);
        assert!((cut.area() - 80.0).abs() < 1e-12);
        // No crack: the free rim is as long as it was.
        let rim: f64 = cut
            .boundary_edges()
            .map(|e| cut.positions()[e.a as usize].distance(cut.positions()[e.b as usize]))
            .sum();
        assert!((rim - 36.0).abs() < 1e-9, "{rim}");
        // No triangle lies on both sides of the border, and those inside have the box's area.
        let within = |p: DVec3| p.cmpge(low - 1e-9).all() && p.cmple(high + 1e-9).all();
        let inside: f64 = (0..cut.triangles().len() as u32)
            .filter(|&t| cut.corners(t).into_iter().all(within))
            .map(|t| cut.facet_area(t))
            .sum();
        assert!((inside - 9.0).abs() < 1e-9, "{inside}");
    }

    #[test]
    fn what_no_box_reaches_is_left_alone() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&p, &[[0, 1, 2]], 0).unwrap();
        let cube = |low, high| OrientedBox::of_file(DVec3::splat(low), DVec3::splat(high));
        let (cut, parents) = cut_by_boxes(&mesh, &[cube(5.0, 6.0), cube(-1.0, 9.0)]);
        assert_eq!((cut.triangles(), parents.len()), (mesh.triangles(), 0));
    }
}
