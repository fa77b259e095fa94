//! A closed part ready to be computed as a solid: its faces told apart, and cells sized for its walls.

mod foresee;
mod foreseen;
mod graded;
mod own;
mod solved;

pub use self::foreseen::Foreseen;
pub use self::solved::SolidGraded;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::SolidModel;
use super::immersed::{Fineness, Immersed};
use super::orders;
use super::simplex::HIGHEST;
use super::sizing::{FINER, PartMeasures};
use crate::budget::{Cancelled, Watch, report};
use crate::elasticity::error::ElasticError;
use crate::elasticity::grade::even_size;
use crate::elasticity::load::Touch;
use crate::elasticity::support::geometry;
use crate::elasticity::{DofSet, Material, Support};
use crate::mesh::canonical::Canonical;
use crate::mesh::reach::{FINGERTIP, Reach};
use crate::mesh::remesh::remesh;
use crate::mesh::room::Room;
use crate::mesh::surface::Surface;
use crate::mesh::walls::{WallSide, Walls};
use crate::mesh::{SurfacePoint, TriMesh, components};
use crate::units;

/// The part and its supports as if its file had numbered it in an order of its own; tetrahedra that came with it keep
/// their numbers.
fn in_order(part: &Arc<TriMesh>, supports: &[Support]) -> (Arc<TriMesh>, Vec<Support>) {
    if part.volume().is_some() {
        return (Arc::clone(part), supports.to_vec());
    }
    let own = Canonical::of(part);
    let supports = supports.iter().map(|s| s.in_order(&own)).collect();
    (own.where_it_lies(part), supports)
}

/// A closed part with its faces.
pub struct SolidGround {
    immersed: Immersed,
    surface: Surface,
    /// Even triangles all over the part: what is pressed on and read.
    pub whole: Arc<TriMesh>,
    /// Which side of which wall each facet of `whole` is on.
    pub walls: Walls,
    /// What a fingertip of this radius (m) reaches of it.
    pub reach: Reach,
    /// Radius of that fingertip (m).
    pub fingertip: f64,
    /// Its faces: what faces inward, and where touches land.
    pub inside: Arc<TriMesh>,
    /// Where touches land (m).
    pub outside: Arc<TriMesh>,
    /// What is held at the vertices of the inside.
    pub inside_held: Vec<DofSet>,
    /// Whether its facets are the back of a wall that touches come to.
    inside_backs: Vec<bool>,
    /// Places of the surface that are held (m).
    held: Vec<DVec3>,
}

/// Vertices of the even triangles, about.
const VERTICES: usize = 9000;
/// Of the distances between touches and what is held, this share may be left unresolved.
const NEAREST: f64 = 0.1;
/// The facets whose side is declared, by their middles.
fn declared_sides(
    mesh: &TriMesh,
    declared: &dyn Fn(DVec3) -> Option<WallSide>,
) -> impl Iterator<Item = (u32, WallSide)> {
    (0..mesh.triangles().len() as u32).filter_map(move |t| {
        let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        Some((t, declared(middle)?))
    })
}

impl SolidGround {
    /// Tells the faces of a part apart that fingertips touch; `declared` says what the user has said of a place.
    ///
    /// # Errors
    /// [`ElasticError::Open`] for a surface that encloses nothing, [`ElasticError::Cancelled`].
    pub fn new(
        part: &Arc<TriMesh>,
        material: Material,
        supports: &[Support],
        declared: &dyn Fn(DVec3) -> Option<WallSide>,
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        Self::touched_by(FINGERTIP, part, material, supports, declared, watch)
    }

    /// As [`Self::new`], for tips of another radius (m).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn touched_by(
        fingertip: f64,
        part: &Arc<TriMesh>,
        material: Material,
        supports: &[Support],
        declared: &dyn Fn(DVec3) -> Option<WallSide>,
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        report(watch, "Measuring walls", 0, 1)?;
        let (part, supports) = geometry(part, supports);
        let (part, supports) = &in_order(&part, &supports);
        let immersed = Immersed::new(part, material, supports);
        encloses(part, &immersed)?;
        let held = &immersed.held;
        let surface = Surface::new(&held.mesh, |e| held.is_border(e), |v| held.is_spot(v));
        let size = even_size(held.mesh.area(), 0.0, VERTICES);
        let remeshed = remesh(&surface, &|_| size);
        let whole = remeshed.mesh;
        let mut walls = Walls::of(&whole, watch)?;
        let mounts = held.mounts(supports.len());
        let mut reach = Reach::of(&whole, &walls, fingertip, &mounts, watch)?;
        for (t, side) in declared_sides(&whole, declared) {
            walls.sides[t as usize] = side;
            reach.tell(t, side);
        }
        let inward: Vec<bool> = walls.sides.iter().map(|&s| s == WallSide::Inside).collect();
        let (inside, vertices) = whole
            .part_of(|t| inward[t as usize])
            .ok_or(ElasticError::NoFace { face: "inside" })?;
        let (outside, _) = whole
            .part_of(|t| reach.touched[t as usize])
            .ok_or(ElasticError::NoFace { face: "outside" })?;
        let facets = inward.iter().zip(&reach.backs);
        let inside_backs = facets.filter(|(i, _)| **i).map(|(_, &back)| back).collect();
        walls.sides = reach.sides(&walls.sides);
        let at = |&v: &u32| held.held_at(remeshed.places[v as usize]);
        let is_held = |v: &u32| at(v).0 != 0;
        let all = 0..whole.positions().len() as u32;
        Ok(Self {
            held: (all.filter(is_held))
                .map(|v| whole.positions()[v as usize])
                .collect(),
            inside_held: vertices.iter().map(at).collect(),
            inside: Arc::new(inside),
            inside_backs,
            outside: Arc::new(outside),
            reach,
            fingertip,
            walls,
            whole,
            surface,
            immersed,
        })
    }

    /// Whether the part came with tetrahedra, which are computed on in place of cells.
    #[must_use]
    pub fn has_tetrahedra(&self) -> bool {
        self.immersed.own().is_some()
    }

    /// Whether points of the inside lie on the back of a wall that touches come to.
    #[must_use]
    pub fn behind(&self, points: &[SurfacePoint]) -> Vec<bool> {
        let is_back = |at: &SurfacePoint| self.inside_backs[at.triangle as usize];
        points.iter().map(is_back).collect()
    }

    /// How large a pad (m) can be brought to points of the inside, as [`Room::at`] says.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn room(&self, points: &[SurfacePoint], watch: Watch) -> Result<Vec<f64>, Cancelled> {
        let room = Room::of(&self.whole, watch)?;
        let at = |&at: &SurfacePoint| {
            room.at(self.inside.point(at), self.inside.facet_normal(at.triangle))
        };
        Ok(points.par_iter().map(at).collect())
    }

    /// Thickness that cells are sized by (m): thinner than three quarters of the walls; of a part without
    /// walls half its least side.
    #[must_use]
    pub fn wall(&self) -> f64 {
        let thin = self.walls.thinner_than(&self.whole, 0.25);
        if thin.is_finite() {
            return thin;
        }
        let (lower, upper) = self.whole.bounds();
        (upper - lower).min_element() / 2.0
    }

    /// A mesh of about one edge length (m) on the outside.
    #[must_use]
    pub fn outside_of_size(&self, size: f64) -> Arc<TriMesh> {
        let remeshed = remesh(&self.surface, &|_| size).mesh;
        let index = self.whole.index();
        let outside = remeshed.part_of(|t| {
            let middle = remeshed.corners(t).iter().sum::<DVec3>() / 3.0;
            self.walls.sides[index.nearest(middle).0.triangle as usize] == WallSide::Outside
        });
        outside.map_or_else(|| Arc::clone(&self.outside), |(mesh, _)| Arc::new(mesh))
    }

    /// The model on cells of a fineness.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn model(&self, fineness: &Fineness, watch: Watch) -> Result<SolidModel, ElasticError> {
        self.immersed.model(&self.whole, fineness, watch)
    }

    /// Finer cells or tetrahedra of a higher order, to judge others by.
    #[must_use]
    pub fn finer(&self, fineness: &Fineness) -> Fineness {
        if self.immersed.own().is_none() {
            return Fineness {
                size: fineness.size * FINER,
                ..*fineness
            };
        }
        // A part's own tetrahedra gain most by their order.
        let raised = fineness.order < HIGHEST;
        let order = fineness.order + usize::from(raised);
        Fineness {
            order,
            carried_on: orders::usually_left(order, orders::DISPLACEMENT),
            halvings: fineness.halvings + u32::from(!raised),
            ..*fineness
        }
    }

    /// Quadratic cells of a size (m) for this part's walls.
    #[must_use]
    pub fn fineness(&self, size: f64) -> Fineness {
        Fineness::of(size, self.wall())
    }

    /// What the size of its cells hangs on.
    #[must_use]
    pub fn measures(&self) -> PartMeasures {
        let (lower, upper) = self.whole.bounds();
        let mut sides = (upper - lower).to_array();
        sides.sort_by(f64::total_cmp);
        PartMeasures {
            area: self.whole.area(),
            volume: self.whole.volume_enclosed(),
            wall: self.wall(),
            across: sides[1],
        }
    }

    /// Radius of the smallest tip, and how far all touches but the nearest ones are from what is held (m).
    fn nearest(&self, touches: &[Touch]) -> (f64, f64) {
        let tip = touches
            .iter()
            .map(|t| t.tip_radius)
            .fold(f64::INFINITY, f64::min);
        let distance = |t: &Touch| {
            (self.held.iter())
                .map(|h| h.distance(t.position))
                .fold(f64::INFINITY, f64::min)
        };
        let mut away: Vec<f64> = touches.iter().map(distance).collect();
        away.sort_by(f64::total_cmp);
        let nearest = (away.len() as f64 * NEAREST) as usize;
        (tip, away.get(nearest).copied().unwrap_or(f64::INFINITY))
    }

    /// Error of the displacement under a touch (%) with cells of a size (m) for a wall, or a tip that is smaller (m):
    /// between the slotted tube (1 % of cells as large as the wall) and printed shins (3 %); it falls with the square
    /// of the size.
    #[must_use]
    pub fn error_percent(size: f64, wall: f64) -> f64 {
        const OF_ONE_WALL: f64 = 1.75;
        OF_ONE_WALL * (size / wall).powi(2)
    }

    /// Size of cells (m) for about so many unknowns.
    #[must_use]
    pub fn size_for(&self, unknowns: f64) -> f64 {
        self.measures().size_for(unknowns)
    }

    /// A word on supports that have no area: no displacement of an elastic solid under them is finite.
    fn held_thinly(&self) -> Vec<String> {
        let numbers = self.immersed.held_without_area();
        let said = numbers.iter().map(|k| {
            format!(
                "Support {} holds the part along lines or at single points only: the smaller the elements are, the more gives way beside them. Hold a face, where that matters, or where it is to give way.",
                k + 1
            )
        });
        said.collect()
    }

    /// What is worth a word about the cells of a model.
    #[must_use]
    pub fn cautions(&self, fineness: &Fineness) -> Vec<String> {
        /// Cells larger than this many walls do not bend as they should.
        const LARGE: f64 = 3.0;
        /// Gaps narrower than this share of a cell join what they part, and the share of the surface at them
        /// from which it is worth a word.
        const NARROW: f64 = 0.5;
        const WORTH: f64 = 0.01;
        let mut notes = self.held_thinly();
        if let Some(own) = self.immersed.own() {
            if own.from_linear {
                notes.push("The mesh's linear tetrahedra were given nodes at the middles of their edges: as they are they would be several times too stiff.".into());
            }
            return notes;
        }
        let ratio = fineness.size / self.wall();
        if ratio > LARGE {
            notes.push(format!(
                "The cells ({:.2} mm) are {ratio:.1} times as large as thin walls are thick ({:.2} mm): choose a higher quality, or fewer touches.",
                units::mm(fineness.size),
                units::mm(self.wall())
            ));
        }
        let narrow = NARROW * fineness.size;
        let near = self.walls.nearer_than(&self.whole, narrow);
        if near > WORTH {
            notes.push(format!(
                "On {:.0} % of the surface there is less than {:.2} mm to what faces it, half a cell: there, what a gap parts moves nearly as one. Choose a higher quality, or take the body that matters alone (part.body).",
                100.0 * near,
                units::mm(narrow)
            ));
        }
        notes
    }
}

/// Whether a surface encloses anything: its holes are small, and just behind most of it there is material.
fn encloses(part: &TriMesh, immersed: &Immersed) -> Result<(), ElasticError> {
    /// Share of the area with material behind it, and of the area that holes may have.
    const MOST: f64 = 0.9;
    const HOLES: f64 = 0.02;
    let behind = share_behind(part, |place| immersed.is_inside(place));
    if behind < MOST || hole_area(part) > HOLES * part.area() {
        return Err(ElasticError::Open {
            rims: part.boundary_edges().count(),
            closes_within: part.closes_within(),
        });
    }
    Ok(())
}

/// Share of a surface's area with material just behind it, looked at behind so many facets at most, evenly over the
/// area: of a million facets each one costs as much as all the rest of what is asked of them.
fn share_behind(part: &TriMesh, is_inside: impl Fn(DVec3) -> bool + Sync) -> f64 {
    /// The share is right to a hundredth.
    const LOOKS: f64 = 20_000.0;
    let (lower, upper) = part.bounds();
    let off = 1e-5 * (upper - lower).length();
    let each = part.area() / LOOKS;
    let mut before = 0.0_f64;
    let mut looks = Vec::new();
    for t in 0..part.triangles().len() as u32 {
        let after = before + part.facet_area(t) / each;
        let steps = after.floor() - before.floor();
        if steps > 0.0 {
            looks.push((t, steps));
        }
        before = after;
    }
    let behind = |&(t, steps): &(u32, f64)| {
        let middle = part.corners(t).iter().sum::<DVec3>() / 3.0;
        let inside = is_inside(middle - part.facet_normal(t) * off);
        if inside { steps } else { 0.0 }
    };
    // Whole numbers: the order of their sum does not matter.
    let found: f64 = looks.par_iter().map(behind).sum();
    found / looks.iter().map(|(_, steps)| steps).sum::<f64>()
}

/// Area of the holes in a surface (m²): that of the flattest film across each of its rims.
fn hole_area(part: &TriMesh) -> f64 {
    let p = part.positions();
    let edges: Vec<[u32; 3]> = part.boundary_edges().map(|e| [e.a, e.b, e.b]).collect();
    let labels = components(p.len(), &edges);
    let mut films: BTreeMap<u32, DVec3> = BTreeMap::new();
    for edge in part.boundary_edges() {
        let tri = part.triangles()[edge.triangles[0] as usize];
        let along = (0..3).any(|i| tri[i] == edge.a && tri[(i + 1) % 3] == edge.b);
        let (a, b) = if along {
            (edge.a, edge.b)
        } else {
            (edge.b, edge.a)
        };
        let label = labels[a as usize];
        let origin = p[label as usize];
        let film = (p[a as usize] - origin).cross(p[b as usize] - origin) / 2.0;
        *films.entry(label).or_default() += film;
    }
    films.values().map(|film| film.length()).sum()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn behind_many_facets_is_looked_as_often_as_behind_fewer() {
        const SIDE: u32 = 150;
        // Columns that grow wider from left to right.
        let at = |i: u32, j: u32| {
            let across = |k: u32| f64::from(k) / f64::from(SIDE);
            DVec3::new(across(i).powi(2), across(j), 0.0)
        };
        let places = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| (i, j)));
        let positions = places.map(|(i, j)| at(i, j)).collect();
        let squares = (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| j * (SIDE + 1) + i));
        let halves = |a: u32| {
            let c = a + SIDE + 2;
            [[a, a + 1, c], [a, c, c - 1]]
        };
        let part = TriMesh::from_checked(positions, squares.flat_map(halves).collect());
        let asked = AtomicUsize::new(0);
        let share = share_behind(&part, |place| {
            asked.fetch_add(1, Ordering::Relaxed);
            place.x < 0.25
        });
        assert!((share - 0.25).abs() < 0.01, "{share}");
        let asked = asked.into_inner();
        assert!((10_000..=20_000).contains(&asked), "{asked}");
    }
}
