//! Where and how the shell is held.

use std::sync::Arc;

use glam::DVec3;

use crate::mesh::canonical::Canonical;
use crate::mesh::cut::{ON_PLANE, cut_by_boxes};
use crate::mesh::mount::Mount;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::{Edge, SurfacePoint, TriMesh};

/// The held ones among the six degrees of freedom of a node: displacement x, y, z, rotation x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DofSet(pub u8);

impl DofSet {
    /// All six: clamped.
    pub const ALL: Self = Self(0b11_1111);
    /// The three displacements: pinned.
    pub const DISPLACEMENTS: Self = Self(0b00_0111);

    /// Held degrees of freedom by index, 0–5.
    #[must_use]
    pub fn of(indices: &[usize]) -> Self {
        Self(indices.iter().fold(0, |mask, i| mask | 1 << i))
    }

    /// Whether the degree of freedom of this index, 0–5, is held.
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
pub enum HeldRegion {
    /// Every point of the part inside a box.
    Box(OrientedBox),
    /// Every point between vertices of the part that are set (one value a vertex): a painted mask or a
    /// group of the mesh file.
    Vertices(Arc<Vec<bool>>),
}

/// A region in which some degrees of freedom are held.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// Where.
    pub region: HeldRegion,
    /// What.
    pub held: DofSet,
    /// Of a support that gives way: the traction that it takes to move its surface (Pa/m). Nothing moves one without.
    pub bedding: Option<f64>,
}

impl Support {
    /// The same support of the part in the order of its canonical form, where it lies.
    #[must_use]
    pub fn in_order(&self, part: &Canonical) -> Self {
        let region = match &self.region {
            HeldRegion::Box(held) => HeldRegion::Box(*held),
            HeldRegion::Vertices(mask) => HeldRegion::Vertices(Arc::new(part.in_order(mask))),
        };
        Self { region, ..*self }
    }

    /// The same support of the part in its canonical form.
    #[must_use]
    pub fn canonical(&self, part: &Canonical) -> Self {
        let region = match &self.region {
            HeldRegion::Box(held) => HeldRegion::Box(part.frame.snapped_box(held)),
            HeldRegion::Vertices(mask) => HeldRegion::Vertices(Arc::new(part.in_order(mask))),
        };
        Self { region, ..*self }
    }
}

/// What elements are laid on, with its supports: the part as it was given, or, where a support was painted on vertices
/// that came from halving its edges, the part with these.
#[must_use]
pub fn geometry(part: &Arc<TriMesh>, supports: &[Support]) -> (Arc<TriMesh>, Vec<Support>) {
    let given = |support: &Support| {
        let region = match &support.region {
            HeldRegion::Box(held) => HeldRegion::Box(*held),
            HeldRegion::Vertices(mask) => HeldRegion::Vertices(Arc::new(part.given_mask(mask)?)),
        };
        Some(Support { region, ..*support })
    };
    match supports.iter().map(given).collect() {
        Some(supports) => (Arc::clone(part.as_given()), supports),
        None => (Arc::clone(part), supports.to_vec()),
    }
}

/// Supports that a vertex belongs to, one bit each.
type SupportBits = u128;
/// The most supports a part may have.
pub const MOST: usize = SupportBits::BITS as usize;

/// A part with its supports, cut so that what is held has edges of the mesh for its border.
#[derive(Clone, Debug)]
pub struct HeldPart {
    /// The part, cut along the boxes of its supports (m).
    pub mesh: Arc<TriMesh>,
    /// For each vertex what is held there.
    pub held: Vec<DofSet>,
    /// For each vertex the supports it belongs to: what lies between vertices is held by a support only
    /// when all of them belong to that very one.
    members: Vec<SupportBits>,
    kinds: Vec<DofSet>,
    /// See [`Support::bedding`], of each support.
    bedding: Vec<Option<f64>>,
}

impl HeldPart {
    /// Cuts the part along its support boxes.
    #[must_use]
    pub fn new(part: &Arc<TriMesh>, supports: &[Support]) -> Self {
        let boxes: Vec<OrientedBox> = supports
            .iter()
            .filter_map(|s| match s.region {
                HeldRegion::Box(held) => Some(held),
                HeldRegion::Vertices(_) => None,
            })
            .collect();
        let (mesh, parents) = cut_by_boxes(part, &boxes);
        let mut members = members(part, supports);
        let slack = slack(part);
        for (k, &(a, b, _)) in parents.iter().enumerate() {
            let p = mesh.positions()[part.positions().len() + k];
            let between = members[a as usize] & members[b as usize];
            members.push(between | in_boxes(p, supports, slack));
        }
        let mesh = if parents.is_empty() {
            Arc::clone(part)
        } else {
            Arc::new(mesh)
        };
        Self::with(mesh, members, supports)
    }

    /// The part as it is: what is held ends somewhere between its vertices.
    #[must_use]
    pub fn uncut(part: &Arc<TriMesh>, supports: &[Support]) -> Self {
        Self::with(Arc::clone(part), members(part, supports), supports)
    }

    fn with(mesh: Arc<TriMesh>, members: Vec<SupportBits>, supports: &[Support]) -> Self {
        let kinds: Vec<DofSet> = supports.iter().map(|s| s.held).collect();
        Self {
            held: members.iter().map(|&m| together(m, &kinds)).collect(),
            mesh,
            members,
            kinds,
            bedding: supports.iter().map(|s| s.bedding).collect(),
        }
    }

    /// What is held at a point of the (cut) part: by the supports that all the corners it lies between
    /// belong to.
    #[must_use]
    pub fn held_at(&self, at: SurfacePoint) -> DofSet {
        together(self.members_at(at), &self.kinds)
    }

    /// What is held there by supports that do not give way.
    #[must_use]
    pub fn held_firmly_at(&self, at: SurfacePoint) -> DofSet {
        together(self.members_at(at) & self.firm_supports(), &self.kinds)
    }

    /// What supports that do not give way hold at each vertex of the (cut) part.
    #[must_use]
    pub fn firm(&self) -> Vec<DofSet> {
        let firm = self.firm_supports();
        let of = |&members: &SupportBits| together(members & firm, &self.kinds);
        self.members.iter().map(of).collect()
    }

    fn firm_supports(&self) -> SupportBits {
        let firm = |(k, bedding): (usize, &Option<f64>)| match bedding {
            None => 1 << k,
            Some(_) => 0,
        };
        let bits = self.bedding.iter().enumerate().take(MOST).map(firm);
        bits.fold(0, |all, bit: SupportBits| all | bit)
    }

    /// Supports that give way: their number, what they hold, and their bedding (Pa/m).
    pub fn beds(&self) -> impl Iterator<Item = (usize, DofSet, f64)> {
        let beds = self.bedding.iter().zip(&self.kinds).enumerate();
        beds.filter_map(|(k, (bedding, &held))| Some((k, held, (*bedding)?)))
    }

    /// Whether a point of the (cut) part belongs to a support, by its number.
    #[must_use]
    pub fn belongs(&self, at: SurfacePoint, support: usize) -> bool {
        self.members_at(at) >> support & 1 == 1
    }

    /// The supports that all the corners belong to that a point lies between.
    fn members_at(&self, at: SurfacePoint) -> SupportBits {
        let tri = self.mesh.triangles()[at.triangle as usize];
        tri.into_iter()
            .zip(at.barycentric)
            .filter(|(_, w)| *w > 1e-7)
            .fold(SupportBits::MAX, |all, (v, _)| {
                all & self.members[v as usize]
            })
    }

    /// Whether a facet of the (cut) part belongs to a support, by its number.
    #[must_use]
    pub fn facet_belongs(&self, facet: u32, support: usize) -> bool {
        let tri = self.mesh.triangles()[facet as usize];
        tri.iter()
            .all(|&v| self.members[v as usize] >> support & 1 == 1)
    }

    /// Edges of the (cut) part that belong to a support beside no facet that does.
    pub fn lines_of(&self, support: usize) -> impl Iterator<Item = &Edge> {
        let belongs = move |v: u32| self.members[v as usize] >> support & 1 == 1;
        let beside = move |edge: &Edge| {
            let mut facets = edge.triangles.iter();
            facets.any(|&t| self.facet_belongs(t, support))
        };
        let edges = self.mesh.edges().iter();
        edges.filter(move |edge| belongs(edge.a) && belongs(edge.b) && !beside(edge))
    }

    /// Vertices of the (cut) part that belong to a support as none of their neighbours does.
    pub fn spots_of(&self, support: usize) -> impl Iterator<Item = u32> {
        let vertices = 0..self.mesh.positions().len() as u32;
        vertices.filter(move |&v| self.alone(v) >> support & 1 == 1)
    }

    /// What so many supports fasten the (cut) part to by a flat face.
    #[must_use]
    pub fn mounts(&self, supports: usize) -> Vec<Mount> {
        let facets = |support: usize| -> Vec<u32> {
            let all = 0..self.mesh.triangles().len() as u32;
            all.filter(|&t| self.facet_belongs(t, support)).collect()
        };
        let mount = |support| Mount::behind(&self.mesh, &facets(support));
        (0..supports).filter_map(mount).collect()
    }

    /// Whether an edge is the border of a support: it belongs to one that a facet beside it does not.
    #[must_use]
    pub fn is_border(&self, edge: &Edge) -> bool {
        let on = self.members[edge.a as usize] & self.members[edge.b as usize];
        edge.triangles.iter().any(|&t| {
            let tri = self.mesh.triangles()[t as usize];
            let beside = tri
                .iter()
                .fold(on, |all, &v| all & self.members[v as usize]);
            on & !beside != 0
        })
    }

    /// Whether a vertex belongs to a support that none of its neighbours does.
    #[must_use]
    pub fn is_spot(&self, vertex: u32) -> bool {
        self.alone(vertex) != 0
    }

    /// The supports that a vertex belongs to and none of its neighbours does.
    fn alone(&self, vertex: u32) -> SupportBits {
        let own = self.members[vertex as usize];
        let near = self.mesh.vertex_triangles()[vertex as usize]
            .iter()
            .flat_map(|&t| self.mesh.triangles()[t as usize])
            .filter(|&w| w != vertex)
            .fold(0, |any, w| any | self.members[w as usize]);
        own & !near
    }
}

/// What several supports hold together.
fn together(members: SupportBits, kinds: &[DofSet]) -> DofSet {
    let mine = kinds
        .iter()
        .enumerate()
        .filter(|(k, _)| members >> k & 1 == 1);
    DofSet(mine.fold(0, |mask, (_, held)| mask | held.0))
}

fn slack(mesh: &TriMesh) -> f64 {
    let (lower, upper) = mesh.bounds();
    ON_PLANE * (upper - lower).length()
}

/// The supports that each vertex of the part belongs to.
fn members(mesh: &TriMesh, supports: &[Support]) -> Vec<SupportBits> {
    let slack = slack(mesh);
    let mut members: Vec<SupportBits> = mesh
        .positions()
        .iter()
        .map(|&p| in_boxes(p, supports, slack))
        .collect();
    for (k, support) in supports.iter().enumerate().take(MOST) {
        if let HeldRegion::Vertices(mask) = &support.region {
            for (m, _) in members.iter_mut().zip(mask.iter()).filter(|(_, set)| **set) {
                *m |= 1 << k;
            }
        }
    }
    members
}

/// The boxes that a point lies in.
fn in_boxes(p: DVec3, supports: &[Support], slack: f64) -> SupportBits {
    let boxes = supports.iter().enumerate().take(MOST);
    boxes.fold(0, |members, (k, s)| match s.region {
        HeldRegion::Box(held) if held.contains(p, slack) => members | 1 << k,
        _ => members,
    })
}

/// What each vertex of the part has held, from all supports together.
#[must_use]
pub fn held_freedoms(mesh: &TriMesh, supports: &[Support]) -> Vec<DofSet> {
    let kinds: Vec<DofSet> = supports.iter().map(|s| s.held).collect();
    let members = members(mesh, supports);
    members.iter().map(|&m| together(m, &kinds)).collect()
}

/// Vertices with anything held.
#[must_use]
pub fn supported_vertices(held: &[DofSet]) -> Vec<u32> {
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
            region: HeldRegion::Box(OrientedBox::of_file(
                DVec3::splat(-1.0),
                DVec3::new(1.3, 2.0, 1.0),
            )),
            held: DofSet::ALL,
            bedding: None,
        };
        let part = HeldPart::new(&strip(), &[support]);
        let held: f64 = (0..part.mesh.triangles().len() as u32)
            .filter(|&t| {
                let middle = SurfacePoint {
                    triangle: t,
                    barycentric: [1.0 / 3.0; 3],
                };
                part.held_at(middle) == DofSet::ALL
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
    fn two_supports_leave_free_what_lies_between_them() {
        // Two triangles from end to end: the wall between the clamps is free all the same.
        let p = [
            DVec3::ZERO,
            DVec3::new(10.0, 0.0, 0.0),
            DVec3::new(10.0, 1.0, 0.0),
            DVec3::new(0.0, 1.0, 0.0),
        ];
        let part = Arc::new(TriMesh::new(&p, &[[0, 1, 2], [0, 2, 3]], 0).unwrap().0);
        let clamp = |from: f64, to: f64| Support {
            region: HeldRegion::Box(OrientedBox::of_file(
                DVec3::new(from, -1.0, -1.0),
                DVec3::new(to, 2.0, 1.0),
            )),
            held: DofSet::ALL,
            bedding: None,
        };
        let held = HeldPart::new(&part, &[clamp(-1.0, 1.0), clamp(9.0, 11.0)]);
        let area: f64 = (0..held.mesh.triangles().len() as u32)
            .filter(|&t| {
                let middle = SurfacePoint {
                    triangle: t,
                    barycentric: [1.0 / 3.0; 3],
                };
                held.held_at(middle) == DofSet::ALL
            })
            .map(|t| held.mesh.facet_area(t))
            .sum();
        assert!((area - 2.0).abs() < 1e-9, "{area}");
        // The borders at x = 1 and x = 9, of one metre each.
        let border: f64 = held
            .mesh
            .edges()
            .iter()
            .filter(|e| held.is_border(e))
            .map(|e| {
                held.mesh.positions()[e.a as usize].distance(held.mesh.positions()[e.b as usize])
            })
            .sum();
        assert!((border - 2.0).abs() < 1e-9, "{border}");
    }

    #[test]
    fn a_mask_holds_its_vertices() {
        let mut mask = vec![false; 10];
        mask[9] = true;
        let support = |mask| Support {
            region: HeldRegion::Vertices(Arc::new(mask)),
            held: DofSet::DISPLACEMENTS,
            bedding: None,
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
