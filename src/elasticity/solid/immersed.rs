//! A closed part ready to be immersed in grids of any size.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::cells::FiniteCells;
use super::cut::Cutting;
use super::dissection::Dissection;
use super::grid::CellGrid;
use super::grip::{Grip, HeldSurface};
use super::piece::TetrahedraPiece;
use super::tetrahedra::OrderedTetrahedra;
use super::{Elements, SolidModel};
use crate::bounds::Bounds;
use crate::budget::Watch;
use crate::elasticity::error::ElasticError;
use crate::elasticity::support::{HeldPart, HeldRegion};
use crate::elasticity::{DofSet, Material, Support};
use crate::mesh::TriMesh;
use crate::mesh::cut::ON_PLANE;
use crate::mesh::inside::SignedDistance;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::stance::Stance;
use crate::mesh::volume::VolumeMesh;

/// A part, its material and its supports.
pub struct Immersed {
    /// The part, cut along its support boxes.
    pub held: HeldPart,
    /// What it is made of.
    pub material: Material,
    part: Arc<TriMesh>,
    supports: Vec<Support>,
    surface: SignedDistance,
    /// Of the part's own tetrahedra, as they are.
    dissection: Arc<OnceLock<Dissection>>,
}

/// How fine a grid is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Largest side of a cell (m).
    pub size: f64,
    /// Order of the shape functions, 1 to 4; of a part's own tetrahedra to 5.
    pub order: usize,
    /// How far the surface may be from where it is taken to be, in cells.
    pub tolerance: f64,
    /// The smallest box that a cell is halved into to find it (m).
    pub least: f64,
    /// How often the tetrahedra of a part that has them are halved, instead of all that.
    pub halvings: u32,
    /// Of what displacements changed from the order before to this one, the share that is still to come
    /// ([`crate::elasticity::model::Coarser`]); nothing where they are taken as they are.
    pub carried_on: f64,
}

impl Fineness {
    /// Quadratic cells of a size (m) for walls of this thickness (m).
    #[must_use]
    pub fn of(size: f64, wall: f64) -> Self {
        /// Boxes at an edge of the part lose about a box's section along it: they are small beside wall and cell.
        const OF_WALL: f64 = 6.0;
        const OF_CELL: f64 = 24.0;
        Self {
            size,
            order: 2,
            tolerance: 3e-3,
            least: (wall / OF_WALL).min(size / OF_CELL),
            halvings: 0,
            carried_on: 0.0,
        }
    }

    /// What displacements are carried on from: the same of one order less.
    #[must_use]
    pub fn before(&self) -> Option<Self> {
        (self.carried_on > 0.0).then_some(Self {
            order: self.order - 1,
            carried_on: 0.0,
            ..*self
        })
    }

    fn depth(&self) -> u32 {
        const MOST: f64 = 10.0;
        (self.size / self.least).log2().ceil().clamp(1.0, MOST) as u32
    }
}

impl Immersed {
    /// Prepares a closed part to be cut by cells.
    #[must_use]
    pub fn new(part: &Arc<TriMesh>, material: Material, supports: &[Support]) -> Self {
        Self {
            held: HeldPart::new(part, supports),
            material,
            part: Arc::clone(part),
            supports: supports.to_vec(),
            surface: SignedDistance::new(part),
            dissection: Arc::default(),
        }
    }

    /// The tetrahedra that the part came with.
    #[must_use]
    pub fn own(&self) -> Option<&VolumeMesh> {
        self.part.volume().map(|v| &**v)
    }

    /// Whether a point (m) lies in the material.
    #[must_use]
    pub fn is_inside(&self, point: DVec3) -> bool {
        self.surface.inside(point)
    }

    /// The cells that the part is in.
    ///
    /// # Errors
    /// [`ElasticError::Cancelled`].
    pub fn cells(&self, fineness: &Fineness, watch: Watch) -> Result<FiniteCells, ElasticError> {
        let mut planes: [Vec<f64>; 3] = Default::default();
        let stance = self.stance();
        for support in &self.supports {
            if let Some((lower, upper)) = along_planes(support, stance) {
                for axis in 0..3 {
                    planes[axis].extend([lower[axis], upper[axis]]);
                }
            }
        }
        let mesh = &self.held.mesh;
        let places = mesh.positions().iter().map(|&p| stance.coordinates(p));
        let Bounds { lower, upper } = Bounds::around(places);
        let grid = CellGrid::new((lower, upper), fineness.size, &planes);
        let cutting = Cutting {
            tolerance: fineness.tolerance * fineness.size,
            depth: fineness.depth(),
        };
        let order = fineness.order;
        Ok(FiniteCells::new(
            grid,
            stance,
            order,
            &self.surface,
            cutting,
            watch,
        )?)
    }

    /// Along which a grid stands: the axes of the file, or of the first box that holds the part where all are turned.
    fn stance(&self) -> Stance {
        let boxes = || {
            (self.supports.iter()).filter_map(|support| match &support.region {
                HeldRegion::Box(held) => Some(held),
                HeldRegion::Vertices(_) => None,
            })
        };
        let upright = boxes().any(|held| held.along_axes().is_some());
        let turned = boxes().next().filter(|_| !upright);
        turned.map_or_else(Stance::default, |held| held.stance)
    }

    /// The model on cells of a fineness, pressed and read on `surface`.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn model(
        &self,
        surface: &Arc<TriMesh>,
        fineness: &Fineness,
        watch: Watch,
    ) -> Result<SolidModel, ElasticError> {
        if let Some(elements) = self.tetrahedra(fineness) {
            let model = self.on_own(surface, elements, fineness, watch)?;
            let Some(before) = fineness.before() else {
                return Ok(model);
            };
            let coarser = self.model(surface, &before, watch)?;
            return Ok(model.carried_on(coarser, fineness.carried_on));
        }
        self.on_cells(surface, self.cells(fineness, watch)?, fineness, watch)
    }

    /// The model on cells of a fineness that were cut.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn on_cells(
        &self,
        surface: &Arc<TriMesh>,
        cells: FiniteCells,
        fineness: &Fineness,
        watch: Watch,
    ) -> Result<SolidModel, ElasticError> {
        if cells.count() == 0 {
            return Err(ElasticError::NoMaterial {
                size: fineness.size,
            });
        }
        let grip = self.grip(&cells, fineness.size);
        SolidModel::new(surface, Box::new(cells), self.material, grip, watch)
    }

    /// The part's own tetrahedra, halved as often as `fineness` says, with displacements of its order.
    #[must_use]
    pub fn tetrahedra(&self, fineness: &Fineness) -> Option<OrderedTetrahedra> {
        let mut mesh = Arc::clone(self.part.volume()?);
        if fineness.halvings == 0 {
            let elements = OrderedTetrahedra::dissected(&mesh, fineness.order, &self.dissection);
            return Some(elements);
        }
        for _ in 0..fineness.halvings {
            mesh = Arc::new(mesh.refined());
        }
        Some(OrderedTetrahedra::new(&mesh, fineness.order))
    }

    /// The model on the part's own tetrahedra.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn on_own(
        &self,
        surface: &Arc<TriMesh>,
        elements: OrderedTetrahedra,
        fineness: &Fineness,
        watch: Watch,
    ) -> Result<SolidModel, ElasticError> {
        let mut grip = Grip::new(&elements);
        for (number, support) in self.supports.iter().enumerate() {
            if !hold_box(&mut grip, &elements, support, fineness) {
                let held = displacements(support);
                let on = self.held_surface(&elements, fineness.size);
                self.spring(&mut grip, &on, number, held);
            }
        }
        SolidModel::new(surface, Box::new(elements), self.material, grip, watch)
    }

    /// The model on a piece of the part's own tetrahedra, held where it was cut out and by boxes.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn on_piece(
        &self,
        surface: &Arc<TriMesh>,
        piece: &TetrahedraPiece,
        fineness: &Fineness,
        watch: Watch,
    ) -> Result<SolidModel, ElasticError> {
        let elements = OrderedTetrahedra::new(&piece.mesh, fineness.order);
        let mut grip = Grip::new(&elements);
        for node in elements.nodes_on(&piece.cut) {
            grip.nodes[node as usize].0 |= DofSet::DISPLACEMENTS.0;
        }
        for support in &self.supports {
            hold_box(&mut grip, &elements, support, fineness);
        }
        SolidModel::new(surface, Box::new(elements), self.material, grip, watch)
    }

    fn held_surface<'a>(&'a self, elements: &'a dyn Elements, size: f64) -> HeldSurface<'a> {
        HeldSurface {
            elements,
            mesh: &self.held.mesh,
            material: &self.material,
            size,
        }
    }

    /// Holds the facets of a support with springs, and its lines and single points where it has no facets: a deck may
    /// hold an edge, or three corners.
    fn spring(&self, grip: &mut Grip, on: &HeldSurface, number: usize, held: DofSet) {
        let bedding = self.supports[number].bedding.unwrap_or(on.firm());
        for facet in 0..on.mesh.triangles().len() as u32 {
            if self.held.facet_belongs(facet, number) {
                grip.hold_facet(on, facet, held, bedding);
            }
        }
        // What gives way is not pinned by an edge or a corner that belongs to it beside its faces.
        if self.supports[number].bedding.is_some() && self.has_area(number) {
            return;
        }
        for edge in self.held.lines_of(number) {
            grip.hold_edge(on, edge, held);
        }
        for vertex in self.held.spots_of(number) {
            grip.hold_vertex(on, vertex, held);
        }
    }

    /// Holds the faces of the part that lie in the border of a support's box (m, in the stance of the cells), with all of
    /// the part beyond it: no element within the box has them.
    fn spring_on_border(
        &self,
        grip: &mut Grip,
        on: &FiniteCells,
        number: usize,
        planes: Option<(DVec3, DVec3)>,
        size: f64,
    ) {
        let Some((lower, upper)) = planes else {
            return;
        };
        let mesh = &self.held.mesh;
        let (least, most) = mesh.bounds();
        let slack = ON_PLANE * (most - least).length();
        let lies_in = |facet: u32, plane: DVec3| {
            let corners = mesh.corners(facet).map(|p| on.stance().coordinates(p));
            let off = corners.map(|p| (p - plane).abs());
            (0..3).any(|axis| off.iter().all(|off| off[axis] <= slack))
        };
        for facet in 0..mesh.triangles().len() as u32 {
            let in_border = || lies_in(facet, lower) || lies_in(facet, upper);
            if self.held.facet_belongs(facet, number) && in_border() {
                let held = displacements(&self.supports[number]);
                let on = self.held_surface(on, size);
                grip.hold_facet(&on, facet, held, on.firm());
            }
        }
    }

    /// The supports, by number, that hold the part along lines or at points only.
    #[must_use]
    pub fn held_without_area(&self) -> Vec<usize> {
        let holds_some = |&k: &usize| {
            self.held.lines_of(k).next().is_some() || self.held.spots_of(k).next().is_some()
        };
        let supports = 0..self.supports.len();
        supports
            .filter(|&k| !self.has_area(k) && holds_some(&k))
            .collect()
    }

    /// Whether a support has facets.
    fn has_area(&self, support: usize) -> bool {
        let mut facets = 0..self.held.mesh.triangles().len() as u32;
        facets.any(|t| self.held.facet_belongs(t, support))
    }

    fn grip(&self, cells: &FiniteCells, size: f64) -> Grip {
        let mut grip = Grip::new(cells);
        for (number, support) in self.supports.iter().enumerate() {
            let held = displacements(support);
            let is_volume = support.bedding.is_none() && held == DofSet::DISPLACEMENTS && {
                let planes = along_planes(support, cells.stance());
                let inside = |p: DVec3| match planes {
                    Some((lower, upper))
                        if (Bounds { lower, upper }).contains(cells.stance().coordinates(p)) =>
                    {
                        held
                    }
                    _ => DofSet::default(),
                };
                let any = (0..cells.count()).any(|c| inside(cells.centre(c)).0 != 0);
                if any {
                    grip.hold_elements(cells, inside);
                    self.spring_on_border(&mut grip, cells, number, planes, size);
                }
                any
            };
            if is_volume {
                continue;
            }
            self.spring(&mut grip, &self.held_surface(cells, size), number, held);
            if let (HeldRegion::Box(region), DofSet::DISPLACEMENTS, None) =
                (&support.region, held, support.bedding)
            {
                self.spring_across(&mut grip, cells, region, size);
            }
        }
        grip
    }

    /// Holds the part where the faces of a box go through it, however the cells stand: with the surface in the box they
    /// are the border of all that it holds.
    fn spring_across(&self, grip: &mut Grip, on: &FiniteCells, held: &OrientedBox, size: f64) {
        let on = self.held_surface(on, size);
        let pieces = held.pieces_across(on.mesh, size / PIECES_OF_CELL);
        for piece in pieces.into_iter().filter(|p| self.surface.inside(p.0)) {
            grip.hold_piece(&on, piece, DofSet::DISPLACEMENTS);
        }
    }
}

/// What a support holds of displacements.
fn displacements(support: &Support) -> DofSet {
    DofSet(support.held.0 & DofSet::DISPLACEMENTS.0)
}

/// Where a box stands otherwise than the cells, its faces are held at so many points a side of a cell.
const PIECES_OF_CELL: f64 = 4.0;

/// The box (m) of a support where planes of a grid that stands so can lie along its faces. One that stands otherwise holds
/// the surface in it, and where its faces go through the part, by springs: cells that it goes through would hold a staircase.
fn along_planes(support: &Support, stance: Stance) -> Option<(DVec3, DVec3)> {
    match &support.region {
        HeldRegion::Box(held) => held.along(stance),
        HeldRegion::Vertices(_) => None,
    }
}

/// Holds the nodes in a support's box; whether there are any. What gives way is held by its surface alone.
fn hold_box(
    grip: &mut Grip,
    elements: &OrderedTetrahedra,
    support: &Support,
    fineness: &Fineness,
) -> bool {
    /// Of the cells: a node on the box's side is held.
    const ON_THE_SIDE: f64 = 1e-9;
    let (HeldRegion::Box(held), None) = (&support.region, support.bedding) else {
        return false;
    };
    let slack = ON_THE_SIDE * fineness.size;
    grip.hold_nodes(elements, displacements(support), |p| {
        held.contains(p, slack)
    })
}
