//! Where and how the shell is held.

use std::sync::Arc;

use glam::DVec3;

use crate::mesh::cut::{ON_PLANE, cut_by_boxes};
use crate::mesh::{Edge, SurfacePoint, TriMesh};

/// The held ones among the six freedoms of a node: displacement x, y, z, rotation x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Freedoms(pub u8);

impl Freedoms {
    pub const ALL: Self = Self(0b11_1111);
    pub const DISPLACEMENTS: Self = Self(0b00_0111);

    /// Held freedoms by index, 0–5.
    #[must_use]
    pub fn of(indices: &[usize]) -> Self {
        Self(indices.iter().fold(0, |mask, i| mask | 1 << i))
    }

    #[must_use]
    pub fn holds(self, index: usize) -> bool {
        self.0 >> index & 1 == 1
    }

    /// A mirror plane normal to axis 0, 1 or 2: no displacement through it, no rotation within it.
    #[must_use]
    pub fn symmetry(axis: usize) -> Self {
        let in_plane = (0..3).filter(|&a| a != axis).map(|a| a + 3);
        Self(in_plane.fold(1 << axis, |mask, i| mask | 1 << i))
    }
}

/// Where a support holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// Every point of the part inside a box (m).
    Box { lower: DVec3, upper: DVec3 },
    /// Every point between vertices of the part that are set (one value a vertex): a painted mask or a
    /// group of the mesh file.
    Vertices(Arc<Vec<bool>>),
}

/// A region in which some freedoms are held.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    pub region: Region,
    pub held: Freedoms,
}

/// A part with its supports, cut so that what is held has edges of the mesh for its border.
#[derive(Clone, Debug)]
pub struct HeldPart {
    pub mesh: Arc<TriMesh>,
    /// For each vertex.
    pub held: Vec<Freedoms>,
}

impl HeldPart {
    /// Cuts the part along its support boxes.
    #[must_use]
    pub fn new(part: &Arc<TriMesh>, supports: &[Support]) -> Self {
        let boxes: Vec<(DVec3, DVec3)> = supports
            .iter()
            .filter_map(|s| match s.region {
                Region::Box { lower, upper } => Some((lower, upper)),
                Region::Vertices(_) => None,
            })
            .collect();
        let (mesh, parents) = cut_by_boxes(part, &boxes);
        let mut held = held_freedoms(part, supports);
        // A cut between two held vertices is held as they are; a cut at a box's face by that box.
        let (lower, upper) = part.bounds();
        let slack = ON_PLANE * (upper - lower).length();
        for (k, &(a, b, _)) in parents.iter().enumerate() {
            let p = mesh.positions()[part.positions().len() + k];
            let between = held[a as usize].0 & held[b as usize].0;
            held.push(Freedoms(between | held_at(p, supports, slack).0));
        }
        let mesh = if parents.is_empty() {
            Arc::clone(part)
        } else {
            Arc::new(mesh)
        };
        Self { mesh, held }
    }

    /// The part as it is: what is held ends somewhere between its vertices.
    #[must_use]
    pub fn uncut(part: &Arc<TriMesh>, supports: &[Support]) -> Self {
        Self {
            mesh: Arc::clone(part),
            held: held_freedoms(part, supports),
        }
    }

    /// What is held at a point of the (cut) part: what all the corners it lies between have in common.
    #[must_use]
    pub fn held_at(&self, at: SurfacePoint) -> Freedoms {
        let tri = self.mesh.triangles()[at.triangle as usize];
        let among = tri.into_iter().zip(at.barycentric);
        Freedoms(
            among
                .filter(|(_, w)| *w > 1e-7)
                .fold(Freedoms::ALL.0, |mask, (v, _)| {
                    mask & self.held[v as usize].0
                }),
        )
    }

    /// Whether an edge is the border of something held: more is held on it than beside it.
    #[must_use]
    pub fn is_border(&self, edge: &Edge) -> bool {
        let on = self.held[edge.a as usize].0 & self.held[edge.b as usize].0;
        edge.triangles.iter().any(|&t| {
            let tri = self.mesh.triangles()[t as usize];
            on & !tri
                .iter()
                .fold(on, |mask, &v| mask & self.held[v as usize].0)
                != 0
        })
    }

    /// Whether more is held at a vertex than along any edge to it.
    #[must_use]
    pub fn is_spot(&self, vertex: u32) -> bool {
        let own = self.held[vertex as usize].0;
        own != 0
            && self.mesh.vertex_triangles()[vertex as usize]
                .iter()
                .flat_map(|&t| self.mesh.triangles()[t as usize])
                .filter(|&w| w != vertex)
                .all(|w| self.held[w as usize].0 & own != own)
    }
}

/// What each vertex of the part has held, from all supports together.
#[must_use]
pub fn held_freedoms(mesh: &TriMesh, supports: &[Support]) -> Vec<Freedoms> {
    let (lower, upper) = mesh.bounds();
    let slack = ON_PLANE * (upper - lower).length();
    let mut held: Vec<Freedoms> = mesh
        .positions()
        .iter()
        .map(|&p| held_at(p, supports, slack))
        .collect();
    for support in supports {
        if let Region::Vertices(mask) = &support.region {
            for (h, _) in held.iter_mut().zip(mask.iter()).filter(|(_, m)| **m) {
                h.0 |= support.held.0;
            }
        }
    }
    held
}

/// What the boxes hold at a point.
fn held_at(p: DVec3, supports: &[Support], slack: f64) -> Freedoms {
    let mask = supports.iter().fold(0, |mask, s| match s.region {
        Region::Box { lower, upper }
            if p.cmpge(lower - slack).all() && p.cmple(upper + slack).all() =>
        {
            mask | s.held.0
        }
        _ => mask,
    });
    Freedoms(mask)
}

/// Vertices with anything held.
#[must_use]
pub fn supported_vertices(held: &[Freedoms]) -> Vec<u32> {
    (0..held.len() as u32)
        .filter(|&v| held[v as usize].0 != 0)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip() -> Arc<TriMesh> {
        let p: Vec<DVec3> = (0..=4)
            .flat_map(|i| [0.0, 1.0].map(|y| DVec3::new(f64::from(i), y, 0.0)))
            .collect();
        let t: Vec<[u32; 3]> = (0..4)
            .flat_map(|i| {
                [
                    [2 * i, 2 * i + 2, 2 * i + 1],
                    [2 * i + 1, 2 * i + 2, 2 * i + 3],
                ]
            })
            .collect();
        Arc::new(TriMesh::new(&p, &t, 0).unwrap().0)
    }

    #[test]
    fn a_box_holds_exactly_what_it_covers() {
        let support = Support {
            region: Region::Box {
                lower: DVec3::splat(-1.0),
                upper: DVec3::new(1.3, 2.0, 1.0),
            },
            held: Freedoms::ALL,
        };
        let part = HeldPart::new(&strip(), &[support]);
        let held: f64 = (0..part.mesh.triangles().len() as u32)
            .filter(|&t| {
                let middle = SurfacePoint {
                    triangle: t,
                    barycentric: [1.0 / 3.0; 3],
                };
                part.held_at(middle) == Freedoms::ALL
            })
            .map(|t| part.mesh.facet_area(t))
            .sum();
        assert!((held - 1.3).abs() < 1e-12, "{held}");
        let border = part
            .mesh
            .edges()
            .iter()
            .filter(|e| part.is_border(e))
            .count();
        assert!((1..=3).contains(&border), "{border}");
    }

    #[test]
    fn a_mask_holds_its_vertices() {
        let mut mask = vec![false; 10];
        mask[9] = true;
        let support = |mask| Support {
            region: Region::Vertices(Arc::new(mask)),
            held: Freedoms::DISPLACEMENTS,
        };
        let spot = HeldPart::new(&strip(), &[support(mask.clone())]);
        assert!(spot.is_spot(9) && !spot.is_spot(8));
        mask[8] = true;
        let line = HeldPart::new(&strip(), &[support(mask)]);
        assert!(!line.is_spot(9));
        let borders: Vec<_> = line
            .mesh
            .edges()
            .iter()
            .filter(|e| line.is_border(e))
            .collect();
        assert_eq!(borders.len(), 1);
        assert_eq!((borders[0].a, borders[0].b), (8, 9));
    }
}
