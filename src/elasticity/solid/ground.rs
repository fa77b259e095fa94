//! A closed part ready to be computed as a solid: its faces told apart, and cells sized for its walls.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::SolidModel;
use super::immersed::{Fineness, Immersed};
use crate::budget::{Elements, Watch, report};
use crate::elasticity::estimate::{self, Discretization, Sample};
use crate::elasticity::grade::{CHECKED, PLACES, even_size, sample, spread};
use crate::elasticity::load::Touch;
use crate::elasticity::model::{ElasticError, LoadCheck, Model as _};
use crate::elasticity::{Freedoms, Material, Support};
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::remesh::remesh;
use crate::mesh::surface::Surface;
use crate::mesh::volume::VolumeMesh;
use crate::mesh::walls::{Side, Walls};
use crate::mesh::{TriMesh, components};

/// A closed part with its faces.
pub struct SolidGround {
    immersed: Immersed,
    surface: Surface,
    /// Even triangles all over the part: what is pressed on and read.
    pub whole: Arc<TriMesh>,
    pub walls: Walls,
    /// Its faces: where gauges go and where touches land.
    pub inside: Arc<TriMesh>,
    pub outside: Arc<TriMesh>,
    /// What is held at the vertices of the inside.
    pub inside_held: Vec<Freedoms>,
}

/// The cells, with the model built on them.
pub struct SolidGraded {
    pub fineness: Fineness,
    pub model: SolidModel,
    pub estimate: Discretization,
    /// The worst balance over the sample of the loads.
    pub balance: LoadCheck,
    pub models: u64,
    pub solves: u64,
}

/// Vertices of the even triangles, about.
const VERTICES: usize = 9000;
/// Size of the first cells in thicknesses of the wall, and of each next ones over the last.
const FIRST: f64 = 2.5;
const FINER: f64 = 1.0 / 1.5;
/// Cells that are not at least this much smaller are not worth a model.
const WORTH: f64 = 0.85;
/// Unknowns of quadratic cells for a surface, times the squared size over its area (measured on tubes and
/// shins, walls half as thick as the cells).
const UNKNOWNS: f64 = 24.0;
/// Unknowns that are allowed for each vertex that a shell may have.
const UNKNOWNS_A_VERTEX: f64 = 16.0;
/// Unknowns that are never asked for, whatever the quality: those of the truth, which are more than twice as many,
/// still fit into memory.
const MOST_UNKNOWNS: f64 = 300_000.0;
/// Own tetrahedra of fewer unknowns are halved to judge them.
const MOST_TO_HALVE: usize = 60_000;
/// The error is an estimate: stop at this share of the tolerance.
const SAFETY: f64 = 0.8;

impl SolidGround {
    /// Tells the faces of a part apart; `told` says what the user has said of a place.
    ///
    /// # Errors
    /// [`ElasticError::Open`] for a surface that encloses nothing, [`ElasticError::Cancelled`].
    pub fn new(
        part: &Arc<TriMesh>,
        material: Material,
        supports: &[Support],
        told: &dyn Fn(DVec3) -> Option<Side>,
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        report(watch, "Measuring walls", 0, 1)?;
        let immersed = Immersed::new(part, material, supports);
        encloses(part, &immersed)?;
        let held = &immersed.held;
        let surface = Surface::new(&held.mesh, |e| held.is_border(e), |v| held.is_spot(v));
        let size = even_size(held.mesh.area(), 0.0, VERTICES);
        let laid = remesh(&surface, &|_| size);
        let whole = laid.mesh;
        let mut walls = Walls::of(&whole, &SurfaceIndex::new(&whole), watch)?;
        for (t, side) in (0u32..).zip(&mut walls.sides) {
            let middle = whole.corners(t).iter().sum::<DVec3>() / 3.0;
            *side = told(middle).unwrap_or(*side);
        }
        let face = |side: Side| whole.part_of(|t| walls.sides[t as usize] == side);
        let (inside, vertices) =
            face(Side::Inside).ok_or(ElasticError::NoFace { face: "inside" })?;
        let (outside, _) = face(Side::Outside).ok_or(ElasticError::NoFace { face: "outside" })?;
        let at = |&v: &u32| held.held_at(laid.places[v as usize]);
        Ok(Self {
            inside_held: vertices.iter().map(at).collect(),
            inside: Arc::new(inside),
            outside: Arc::new(outside),
            walls,
            whole,
            surface,
            immersed,
        })
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
        let laid = remesh(&self.surface, &|_| size).mesh;
        let index = SurfaceIndex::new(&self.whole);
        let outside = laid.part_of(|t| {
            let middle = laid.corners(t).iter().sum::<DVec3>() / 3.0;
            self.walls.sides[index.nearest(middle).0.triangle as usize] == Side::Outside
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

    /// Finer cells, to judge coarser ones by.
    #[must_use]
    pub fn finer(&self, fineness: &Fineness) -> Fineness {
        let own = self.immersed.own().is_some();
        Fineness {
            size: fineness.size * if own { 1.0 } else { FINER },
            halvings: fineness.halvings + u32::from(own),
            ..*fineness
        }
    }

    /// Quadratic cells of a size (m) for this part's walls.
    #[must_use]
    pub fn fineness(&self, size: f64) -> Fineness {
        Fineness::of(size, self.wall())
    }

    /// Size of the smallest cells (m) that a budget allows for so many touches.
    #[must_use]
    pub fn size_allowed(&self, aim: &Elements, touches: usize) -> f64 {
        self.size_for(unknowns_allowed(aim, touches))
    }

    /// Unknowns with cells of a size (m) for a surface of an area (m²), about.
    #[must_use]
    pub fn unknowns(area: f64, size: f64) -> f64 {
        UNKNOWNS * area / (size * size)
    }

    /// Error of the displacement under a touch (%) with cells of a size (m) for a wall (m): between the slotted
    /// tube (1 % of cells as large as the wall) and printed shins (3 %); it falls with the square of the size.
    #[must_use]
    pub fn error_percent(size: f64, wall: f64) -> f64 {
        const OF_ONE_WALL: f64 = 1.75;
        OF_ONE_WALL * (size / wall).powi(2)
    }

    /// Sizes of the cells (m), one after the other, that [`Self::grade`] would come to for a wall (m) and a
    /// surface of an area (m²), were the error as on other parts.
    #[must_use]
    pub fn foreseen(wall: f64, area: f64, aim: &Elements, touches: usize) -> Vec<f64> {
        let least_size = size_for(area, unknowns_allowed(aim, touches));
        let first = (FIRST * wall).max(least_size / FINER);
        let mut sizes = vec![first, first * FINER];
        while let Some(&size) = sizes.last()
            && Self::error_percent(size, wall) > SAFETY * aim.displacement_percent
            && let Some(next) = next_size(size, least_size)
        {
            sizes.push(next);
        }
        sizes
    }

    /// Size of cells (m) for about so many unknowns.
    #[must_use]
    pub fn size_for(&self, unknowns: f64) -> f64 {
        size_for(self.whole.area(), unknowns)
    }

    /// Makes cells smaller until the error under these touches is small enough or the most unknowns are
    /// spent. `places` (m) are where strains matter.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn grade(
        &self,
        touches: &[Touch],
        places: &[DVec3],
        aim: &Elements,
        watch: Watch,
    ) -> Result<SolidGraded, ElasticError> {
        if let Some(own) = self.immersed.own() {
            return self.as_given(own, touches, places, watch);
        }
        let least_size = self.size_allowed(aim, touches.len());
        let touches = sample(touches);
        let places: Vec<DVec3> = spread(places, PLACES);
        let mut size = (FIRST * self.wall()).max(least_size / FINER);
        let mut coarse = Solved::new(self, size, &touches, &places, watch)?;
        let (mut models, mut solves) = (1, touches.len() as u64);
        let mut next = size * FINER;
        let mut estimate;
        loop {
            // Errors fall with the square of the size: what changed, over what is left.
            let change = (size / next).powi(2) - 1.0;
            size = next;
            let fine = Solved::new(self, size, &touches, &places, watch)?;
            models += 1;
            solves += touches.len() as u64;
            let (before, after) = (&coarse.sample, &fine.sample);
            estimate = estimate::left(before, after, &touches, &places, change);
            let excess = (estimate.displacement_percent / aim.displacement_percent)
                .max(estimate.strain_percent / aim.strain_percent)
                / SAFETY;
            coarse = fine;
            match next_size(size, least_size) {
                Some(finer) if excess > 1.0 => next = finer,
                _ => break,
            }
        }
        let checked = spread(&coarse.solutions, CHECKED);
        Ok(SolidGraded {
            balance: coarse.model.check_all(&spread(&touches, CHECKED), &checked),
            fineness: coarse.fineness,
            model: coarse.model,
            estimate,
            models,
            solves,
        })
    }

    /// The part's own tetrahedra, judged by their halves where those fit into memory.
    fn as_given(
        &self,
        own: &VolumeMesh,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<SolidGraded, ElasticError> {
        /// Errors of quadratic elements fall with the square of their size and better.
        const CHANGE: f64 = 3.0;
        let touches = sample(touches);
        let places: Vec<DVec3> = spread(places, PLACES);
        let size = own.mean_edge();
        let given = Solved::new(self, size, &touches, &places, watch)?;
        let fine = Fineness {
            halvings: 1,
            ..given.fineness
        };
        let small = given.model.system().dimension() < MOST_TO_HALVE;
        let halved = small
            .then(|| Solved::with(self, fine, &touches, &places, watch))
            .transpose();
        let halved = match halved {
            Err(error) if error.is_memory() => None,
            other => other?,
        };
        let unknown = Discretization {
            displacement_mm: f64::NAN,
            displacement_percent: f64::NAN,
            strain_percent: f64::NAN,
            loads: touches.len(),
            places: places.len(),
        };
        let estimate = halved.as_ref().map_or(unknown, |halved| {
            let (given, halved) = (&given.sample, &halved.sample);
            estimate::left(given, halved, &touches, &places, CHANGE / (1.0 + CHANGE))
        });
        Ok(SolidGraded {
            balance: given.model.check_all(
                &spread(&touches, CHECKED),
                &spread(&given.solutions, CHECKED),
            ),
            fineness: given.fineness,
            model: given.model,
            estimate,
            models: 1 + u64::from(halved.is_some()),
            solves: touches.len() as u64 * (1 + u64::from(halved.is_some())),
        })
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
        if let Some(own) = self.immersed.own() {
            let what = if own.from_linear {
                "The mesh's linear tetrahedra were given nodes at the middles of their edges: as they are they would be several times too stiff."
            } else {
                return Vec::new();
            };
            return vec![what.into()];
        }
        let ratio = fineness.size / self.wall();
        let mut notes = Vec::new();
        if ratio > LARGE {
            notes.push(format!(
                "The cells ({:.2} mm) are {ratio:.1} times as large as thin walls are thick ({:.2} mm): choose a higher quality, or fewer touches.",
                fineness.size * 1e3,
                self.wall() * 1e3
            ));
        }
        let narrow = NARROW * fineness.size;
        let near = self.walls.nearer_than(&self.whole, narrow);
        if near > WORTH {
            notes.push(format!(
                "On {:.0} % of the surface there is less than {:.2} mm to what faces it, half a cell: there, what a gap parts moves nearly as one. Choose a higher quality, or take the body that matters alone (part.body).",
                100.0 * near,
                narrow * 1e3
            ));
        }
        notes
    }
}

/// A model with the sample loads solved on it.
struct Solved {
    fineness: Fineness,
    model: SolidModel,
    solutions: Vec<Vec<f64>>,
    sample: Sample,
}

impl Solved {
    fn new(
        ground: &SolidGround,
        size: f64,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        Self::with(ground, ground.fineness(size), touches, places, watch)
    }

    fn with(
        ground: &SolidGround,
        fineness: Fineness,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<Self, ElasticError> {
        let model = ground.model(&fineness, watch)?;
        let loads: Vec<_> = touches.iter().map(|t| model.load(t)).collect();
        let solutions = model.system().solve_loads(&loads);
        Ok(Self {
            sample: Sample::of(&model, touches, &solutions, places),
            fineness,
            model,
            solutions,
        })
    }
}

fn unknowns_allowed(aim: &Elements, touches: usize) -> f64 {
    (UNKNOWNS_A_VERTEX * aim.most_for(touches) as f64).min(MOST_UNKNOWNS)
}

/// The size (m) after one, if there is one to be had.
fn next_size(size: f64, least: f64) -> Option<f64> {
    let next = (size * FINER).max(least);
    (next < WORTH * size).then_some(next)
}

/// Size of cells (m) of a surface of an area (m²) for about so many unknowns.
fn size_for(area: f64, unknowns: f64) -> f64 {
    (UNKNOWNS * area / unknowns).sqrt()
}

/// Whether a surface encloses anything: its holes are small, and just behind most of it there is material.
fn encloses(part: &TriMesh, immersed: &Immersed) -> Result<(), ElasticError> {
    /// Share of the area with material behind it, and of the area that holes may have.
    const MOST: f64 = 0.9;
    const HOLES: f64 = 0.02;
    let (lower, upper) = part.bounds();
    let off = 1e-5 * (upper - lower).length();
    let count = part.triangles().len() as u32;
    let has_behind = |t: u32| {
        let middle = part.corners(t).iter().sum::<DVec3>() / 3.0;
        immersed.is_inside(middle - part.facet_normal(t) * off)
    };
    let has: Vec<bool> = (0..count).into_par_iter().map(has_behind).collect();
    let areas = (0..count)
        .filter(|&t| has[t as usize])
        .map(|t| part.facet_area(t));
    let behind: f64 = areas.sum();
    if behind < MOST * part.area() || hole_area(part) > HOLES * part.area() {
        let rims = part.boundary_edges().count();
        return Err(ElasticError::Open { rims });
    }
    Ok(())
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
