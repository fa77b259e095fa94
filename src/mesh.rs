//! A surface that has been checked: finite, indexed, welded, of one orientation, with its neighbourhoods.
//!
//! Positions are in metres. Everything after this layer may index without checking again.

pub mod cut;
pub mod flatten;
pub mod geodesic;
pub mod inside;
pub mod locate;
mod numbers;
pub mod remesh;
pub mod repair;
pub mod sample;
pub mod scatter;
pub mod surface;
mod thicken;
pub mod unroll;
pub mod volume;
pub mod walls;
pub mod winding;

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use numbers::{NumberMap, NumberSet};
use repair::Repair;
use volume::VolumeMesh;

/// Why a mesh was refused, with the place and the remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error("the mesh has no triangles: export it as a triangulated surface")]
    Empty,
    #[error(
        "vertex {vertex} of the mesh is not a finite point: repair the mesh in the program that wrote it"
    )]
    NotFinite { vertex: usize },
    #[error(
        "triangle {triangle} refers to vertex {vertex}, but the mesh has {count} vertices: the file is damaged"
    )]
    BadIndex {
        triangle: usize,
        vertex: u64,
        count: usize,
    },
    #[error(
        "every triangle of the mesh has zero area: check the unit and the export of the mesh file, and that part.weld_mm is small beside the part"
    )]
    AllDegenerate,
    #[error("the mesh has {count} separate bodies, so body {body} does not exist: choose 0 to {}", count - 1)]
    NoSuchBody { body: usize, count: usize },
    #[error(
        "the mesh has {triangles} triangles, more than the {limit} this version handles: decimate it first"
    )]
    TooLarge { triangles: usize, limit: usize },
}

/// What was changed while a mesh was taken in; all zero for a clean one.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Vertices merged because their positions were equal to the bit.
    pub welded_vertices: usize,
    /// Vertices merged because they were nearer than the tolerance asked for.
    pub joined_vertices: usize,
    pub degenerate_triangles: usize,
    pub duplicate_triangles: usize,
    /// Triangles turned over so that neighbours agree on the outside.
    pub flipped_triangles: usize,
    /// Separate bodies found, of which one was kept.
    pub bodies: usize,
    /// Edges shared by more than two triangles: kept, the shell is joined there.
    pub non_manifold_edges: usize,
    /// Edges with a triangle on one side only: free rims.
    pub boundary_edges: usize,
    /// Holes that were filled because that was asked for.
    pub filled_holes: usize,
    /// Triangles thinner than a hundredth of their length: kept; graded elements do not have them.
    pub slivers: usize,
    /// The mesh is open, but closes where vertices within so much (m) of each other are joined.
    pub closes_within: Option<f64>,
    /// What the file holds that was left out, or that its reader does not know: whole sentences without a stop.
    pub notes: Vec<String>,
}

impl RepairReport {
    /// What was done and found, in words; nothing for a clean mesh.
    #[must_use]
    pub fn in_words(&self, body: usize) -> Option<String> {
        let mut parts = Vec::new();
        if self.bodies > 1 {
            parts.push(format!(
                "body {body} of {} is used (0 to {}, by falling area; the part's body setting picks another)",
                self.bodies,
                self.bodies - 1
            ));
        }
        let mut count = |n: usize, what: &str| {
            if n > 0 {
                parts.push(format!("{n} {what}"));
            }
        };
        count(self.joined_vertices, "near vertices joined");
        count(self.degenerate_triangles, "triangles without area dropped");
        count(self.duplicate_triangles, "duplicate triangles dropped");
        count(self.flipped_triangles, "triangles turned over");
        count(self.filled_holes, "holes filled");
        count(
            self.non_manifold_edges,
            "edges join more than two triangles",
        );
        count(self.slivers, "slivers");
        if let Some(within) = self.closes_within {
            let mm = significant(within * 1e3);
            parts.push(format!(
                "{} edges are open, and the mesh closes when vertices within {mm} mm are joined (part.weld_mm = {mm})",
                self.boundary_edges
            ));
        }
        let changed = (!parts.is_empty()).then(|| parts.join(", "));
        let said: Vec<String> = changed.into_iter().chain(self.notes.clone()).collect();
        (!said.is_empty()).then(|| said.join("; "))
    }
}

/// A positive number of one significant digit, without the zeros that binary fractions trail.
fn significant(x: f64) -> String {
    let decimals = (-x.log10().floor()).max(0.0) as usize;
    format!("{x:.decimals$}")
}

/// A surface that was taken in, with what was changed and where its vertices went.
#[derive(Clone, Debug)]
pub struct TakenIn {
    pub mesh: TriMesh,
    pub repairs: RepairReport,
    /// For each vertex that was given its number in the mesh; nothing where it is no part of it.
    pub vertices: Vec<Option<u32>>,
}

/// An edge between two vertices (`a < b`) and the triangles on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edge {
    pub a: u32,
    pub b: u32,
    pub triangles: Vec<u32>,
}

/// A validated triangle surface with its topology. Positions in metres; normals point outward as the
/// triangles wind.
#[derive(Clone, Debug)]
pub struct TriMesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    /// Index into `edges` of the edge opposite each corner.
    triangle_edges: Vec<[u32; 3]>,
    vertex_triangles: Vec<Vec<u32>>,
    vertex_normals: Vec<DVec3>,
    /// Sizes of the whole, which are asked for again and again.
    bounds: (DVec3, DVec3),
    area: f64,
    mean_edge: f64,
    /// The tetrahedra that it is the surface of, where it came with them.
    volume: Option<Arc<VolumeMesh>>,
}

const MAX_TRIANGLES: usize = 4_000_000;

impl TriMesh {
    /// Checks and takes in a raw surface: positions in metres, triangles by vertex index.
    ///
    /// Vertices equal to the bit are welded, triangles without area and repeated ones dropped,
    /// orientation made consistent within the chosen body (`body` 0 is the one with the largest area).
    ///
    /// # Errors
    /// [`MeshError`] for anything that cannot be a surface.
    pub fn new(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        body: usize,
    ) -> Result<(Self, RepairReport), MeshError> {
        Self::repaired(positions, triangles, body, &Repair::default())
    }

    /// As [`Self::new`], with the repairs that are asked for.
    ///
    /// # Errors
    /// [`MeshError`] for anything that cannot be a surface.
    pub fn repaired(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        body: usize,
        repair: &Repair,
    ) -> Result<(Self, RepairReport), MeshError> {
        let taken = Self::taken_in(positions, triangles, body, repair)?;
        Ok((taken.mesh, taken.repairs))
    }

    /// As [`Self::repaired`], with the way from the vertices given to those of the mesh.
    ///
    /// # Errors
    /// [`MeshError`] for anything that cannot be a surface.
    pub fn taken_in(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        body: usize,
        repair: &Repair,
    ) -> Result<TakenIn, MeshError> {
        check_raw(positions, triangles)?;
        let mut report = RepairReport::default();
        let (numbers, points) = weld(positions, repair, &mut report);
        let renumbered = triangles.iter().map(|t| t.map(|v| numbers[v as usize]));
        let whole = drop_degenerate(&points, renumbered, &mut report)?;
        let kept = keep_body(&points, &whole, body, &mut report)?;
        let mesh = Self::of_body(kept.positions, kept.triangles, repair, &mut report);
        if report.boundary_edges > 0 {
            // Of the whole file: what is torn lies apart.
            report.closes_within = repair::closing_weld(&points, &whole, mesh.mean_edge);
        }
        Ok(TakenIn {
            mesh,
            repairs: report,
            vertices: (numbers.iter())
                .map(|&v| kept.numbers[v as usize])
                .collect(),
        })
    }

    /// One body, turned and filled where it has to be.
    fn of_body(
        mut positions: Vec<DVec3>,
        mut triangles: Vec<[u32; 3]>,
        repair: &Repair,
        report: &mut RepairReport,
    ) -> Self {
        let mut sides = Sides::of(&triangles);
        let mut turned = orient(&mut triangles, &sides, report);
        fill_holes(&mut positions, &mut triangles, repair, report);
        if report.filled_holes > 0 {
            sides = Sides::of(&triangles);
            turned = false;
        }
        if sides.edges.iter().all(|e| e.triangles.len() == 2) {
            turned |= turn_outward(&positions, &mut triangles, report);
        }
        // The numbers of edges follow the winding.
        if turned {
            sides = Sides::of(&triangles);
        }
        let mesh = Self::with_sides(positions, triangles, sides);
        report.non_manifold_edges = mesh.edges.iter().filter(|e| e.triangles.len() > 2).count();
        report.boundary_edges = mesh.boundary_edges().count();
        report.slivers = (0..mesh.triangles.len() as u32)
            .filter(|&t| mesh.thinness(t) < 0.01)
            .count();
        mesh
    }

    /// Builds the neighbourhoods of a surface that is known to be sound.
    pub(crate) fn from_checked(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let sides = Sides::of(&triangles);
        Self::with_sides(positions, triangles, sides)
    }

    fn with_sides(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, sides: Sides) -> Self {
        let Sides {
            edges,
            of_triangles: triangle_edges,
        } = sides;
        let mut vertex_triangles = vec![Vec::new(); positions.len()];
        for (t, tri) in triangles.iter().enumerate() {
            for &v in tri {
                vertex_triangles[v as usize].push(t as u32);
            }
        }
        let vertex_normals = vertex_normals(&positions, &triangles);
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let area = |t| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a).length() / 2.0
        };
        let length = |e: &Edge| positions[e.a as usize].distance(positions[e.b as usize]);
        Self {
            bounds: positions
                .iter()
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, u), &p| {
                    (l.min(p), u.max(p))
                }),
            area: triangles.iter().map(area).sum(),
            mean_edge: edges.iter().map(length).sum::<f64>() / edges.len() as f64,
            positions,
            triangles,
            edges,
            triangle_edges,
            vertex_triangles,
            vertex_normals,
            volume: None,
        }
    }

    /// The same surface, known to be that of tetrahedra.
    #[must_use]
    pub fn around(self, volume: VolumeMesh) -> Self {
        Self {
            volume: Some(Arc::new(volume)),
            ..self
        }
    }

    /// The tetrahedra that it is the surface of, where it came with them.
    #[must_use]
    pub fn volume(&self) -> Option<&Arc<VolumeMesh>> {
        self.volume.as_ref()
    }

    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }
    #[must_use]
    pub fn triangle_edges(&self) -> &[[u32; 3]] {
        &self.triangle_edges
    }
    #[must_use]
    pub fn vertex_triangles(&self) -> &[Vec<u32>] {
        &self.vertex_triangles
    }
    /// Unit normals, averaged by corner angle.
    #[must_use]
    pub fn vertex_normals(&self) -> &[DVec3] {
        &self.vertex_normals
    }

    /// The same surface with its inside out.
    #[must_use]
    pub fn turned_over(&self) -> Self {
        let turned = self.triangles.iter().map(|&[a, b, c]| [a, c, b]);
        Self::from_checked(self.positions.clone(), turned.collect())
    }

    /// The triangles that are kept, with their vertices' numbers in this mesh; nothing where none is.
    #[must_use]
    pub fn part_of(&self, keep: impl Fn(u32) -> bool) -> Option<(Self, Vec<u32>)> {
        let mut number = vec![u32::MAX; self.positions.len()];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (_, tri) in (0u32..).zip(&self.triangles).filter(|(t, _)| keep(*t)) {
            triangles.push(tri.map(|v| {
                if number[v as usize] == u32::MAX {
                    number[v as usize] = vertices.len() as u32;
                    vertices.push(v);
                }
                number[v as usize]
            }));
        }
        let positions = vertices
            .iter()
            .map(|&v| self.positions[v as usize])
            .collect();
        (!triangles.is_empty()).then(|| (Self::from_checked(positions, triangles), vertices))
    }

    /// The three corners of a triangle (m).
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Unit normal of a facet.
    #[must_use]
    pub fn facet_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Area of a facet (m²).
    #[must_use]
    pub fn facet_area(&self, triangle: u32) -> f64 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() / 2.0
    }

    /// The longest side of a facet (m).
    #[must_use]
    pub fn longest_side(&self, triangle: u32) -> f64 {
        let p = self.corners(triangle);
        let side = |i: usize| p[i].distance(p[(i + 1) % 3]);
        (0..3).map(side).fold(0.0, f64::max)
    }

    /// A point of the surface at each vertex, in order.
    #[must_use]
    pub fn vertex_points(&self) -> Vec<SurfacePoint> {
        let at = |(v, around): (usize, &Vec<u32>)| {
            let triangle = around.first().copied().unwrap_or(0);
            let corners = self.triangles[triangle as usize];
            SurfacePoint {
                triangle,
                barycentric: corners.map(|c| f64::from(u8::from(c as usize == v))),
            }
        };
        self.vertex_triangles.iter().enumerate().map(at).collect()
    }

    /// Height of a facet over its longest side.
    #[must_use]
    pub fn thinness(&self, triangle: u32) -> f64 {
        let p = self.corners(triangle);
        let longest = (0..3)
            .map(|i| p[i].distance_squared(p[(i + 1) % 3]))
            .fold(0.0, f64::max);
        2.0 * self.facet_area(triangle) / longest
    }

    /// Area of the whole surface (m²).
    #[must_use]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// What a closed surface encloses (m³).
    #[must_use]
    pub fn volume_enclosed(&self) -> f64 {
        let origin = self.bounds().0;
        let cone = |t: u32| {
            let [a, b, c] = self.corners(t).map(|p| p - origin);
            a.dot(b.cross(c))
        };
        let sum: f64 = (0..self.triangles.len() as u32).map(cone).sum();
        sum.abs() / 6.0
    }

    /// Mean edge length (m): the element size that figures are quoted for.
    #[must_use]
    pub fn mean_edge(&self) -> f64 {
        self.mean_edge
    }

    /// Lower and upper corner of the axis-aligned box around the surface (m).
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// Edges with a triangle on one side only: the free rims of the surface.
    pub fn boundary_edges(&self) -> impl Iterator<Item = &Edge> {
        self.edges.iter().filter(|e| e.triangles.len() == 1)
    }

    /// Vertices on a free rim.
    #[must_use]
    pub fn boundary_vertices(&self) -> Vec<bool> {
        let mut boundary = vec![false; self.positions.len()];
        for edge in self.boundary_edges() {
            boundary[edge.a as usize] = true;
            boundary[edge.b as usize] = true;
        }
        boundary
    }

    /// The position at barycentric coordinates of a triangle (m).
    #[must_use]
    pub fn point(&self, at: SurfacePoint) -> DVec3 {
        let corners = self.corners(at.triangle);
        (0..3).map(|i| corners[i] * at.barycentric[i]).sum()
    }

    /// The smoothed unit normal at a point, from the vertex normals; at a vertex on a crease the facet's own.
    #[must_use]
    pub fn normal(&self, at: SurfacePoint) -> DVec3 {
        /// Vertex normals turned further than this from the facet belong to a crease (cos 30°).
        const CREASE: f64 = 0.866;
        let tri = self.triangles[at.triangle as usize];
        let own = self.facet_normal(at.triangle);
        let blend: DVec3 = (0..3)
            .map(|i| {
                let smooth = self.vertex_normals[tri[i] as usize];
                let normal = if smooth.dot(own) < CREASE {
                    own
                } else {
                    smooth
                };
                normal * at.barycentric[i]
            })
            .sum();
        blend
            .try_normalize()
            .unwrap_or_else(|| self.facet_normal(at.triangle))
    }

    /// Whether a point lies where a mask (one value a vertex) is mostly set.
    #[must_use]
    pub fn mostly_in(&self, mask: &[bool], at: SurfacePoint) -> bool {
        let corners = self.triangles[at.triangle as usize];
        let set = |(v, w): (u32, f64)| if mask[v as usize] { w } else { 0.0 };
        corners
            .into_iter()
            .zip(at.barycentric)
            .map(set)
            .sum::<f64>()
            >= 0.5
    }

    /// Linear interpolation of a value given at the vertices.
    #[must_use]
    pub fn interpolate(&self, values: &[f64], at: SurfacePoint) -> f64 {
        let tri = self.triangles[at.triangle as usize];
        (0..3)
            .map(|i| values[tri[i] as usize] * at.barycentric[i])
            .sum()
    }
}

/// A point of the surface: a triangle and the weights of its corners (they sum to one).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    pub triangle: u32,
    pub barycentric: [f64; 3],
}

fn check_raw(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    if triangles.len() > MAX_TRIANGLES {
        return Err(MeshError::TooLarge {
            triangles: triangles.len(),
            limit: MAX_TRIANGLES,
        });
    }
    // Beyond this, squared lengths leave the range in which areas and stiffnesses mean anything.
    if let Some(vertex) = positions
        .iter()
        .position(|p| !p.is_finite() || p.abs().max_element() > 1e9)
    {
        return Err(MeshError::NotFinite { vertex });
    }
    for (triangle, tri) in triangles.iter().enumerate() {
        if let Some(&vertex) = tri.iter().find(|&&v| v as usize >= positions.len()) {
            return Err(MeshError::BadIndex {
                triangle,
                vertex: u64::from(vertex),
                count: positions.len(),
            });
        }
    }
    Ok(())
}

/// For each position the number of the point it became, and the points: those equal to the bit are one, and those
/// as near as is asked for.
fn weld(positions: &[DVec3], repair: &Repair, report: &mut RepairReport) -> (Vec<u32>, Vec<DVec3>) {
    let mut index: NumberMap<[u64; 3], u32> = NumberMap::default();
    let mut points = Vec::new();
    let mut numbers: Vec<u32> = positions
        .iter()
        .map(|p| {
            // Adding zero makes -0.0 and 0.0 one point.
            let key = (*p + DVec3::ZERO).to_array().map(f64::to_bits);
            *index.entry(key).or_insert_with(|| {
                points.push(*p);
                (points.len() - 1) as u32
            })
        })
        .collect();
    report.welded_vertices = positions.len() - points.len();
    if repair.weld > 0.0 {
        let (joined, kept) = repair::join_near(&points, repair.weld);
        report.joined_vertices = points.len() - kept.len();
        for number in &mut numbers {
            *number = joined[*number as usize];
        }
        points = kept;
    }
    (numbers, points)
}

/// Whether the height of a triangle is below 1e-10 of its longest side: relative, so that it does not depend on the
/// unit.
fn has_no_area(positions: &[DVec3], tri: [u32; 3]) -> bool {
    let [a, b, c] = tri.map(|v| positions[v as usize]);
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    (b - a).cross(c - a).length() <= 1e-10 * longest
}

fn drop_degenerate(
    positions: &[DVec3],
    triangles: impl ExactSizeIterator<Item = [u32; 3]>,
    report: &mut RepairReport,
) -> Result<Vec<[u32; 3]>, MeshError> {
    let mut seen: NumberSet<[u32; 3]> = NumberSet::default();
    let mut kept = Vec::with_capacity(triangles.len());
    for tri in triangles {
        if has_no_area(positions, tri) {
            report.degenerate_triangles += 1;
            continue;
        }
        let mut key = tri;
        key.sort_unstable();
        if seen.insert(key) {
            kept.push(tri);
        } else {
            report.duplicate_triangles += 1;
        }
    }
    if kept.is_empty() {
        return Err(MeshError::AllDegenerate);
    }
    Ok(kept)
}

/// One body of several.
struct Kept {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Of each vertex of the whole.
    numbers: Vec<Option<u32>>,
}

/// Keeps one connected body (joined at least at a vertex), by falling area, and only the vertices it uses.
fn keep_body(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    body: usize,
    report: &mut RepairReport,
) -> Result<Kept, MeshError> {
    let labels = components(positions.len(), triangles);
    let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
    for tri in triangles {
        let [a, b, c] = tri.map(|v| positions[v as usize]);
        *areas.entry(labels[tri[0] as usize]).or_default() += (b - a).cross(c - a).length();
    }
    let mut by_area: Vec<(u32, f64)> = areas.into_iter().collect();
    by_area.sort_by(|x, y| y.1.total_cmp(&x.1).then(x.0.cmp(&y.0)));
    let hollows = hollows(positions, triangles, &labels, &by_area);
    by_area.retain(|(label, _)| !hollows.contains_key(label));
    report.bodies = by_area.len();
    let &(label, _) = by_area.get(body).ok_or(MeshError::NoSuchBody {
        body,
        count: by_area.len(),
    })?;
    let mut used = vec![false; positions.len()];
    let mut chosen: Vec<[u32; 3]> = Vec::new();
    let belongs = |l: u32| l == label || hollows.get(&l) == Some(&label);
    for tri in triangles.iter().filter(|t| belongs(labels[t[0] as usize])) {
        for &v in tri {
            used[v as usize] = true;
        }
        chosen.push(*tri);
    }
    // In their old order, so that a mesh that needs no repair keeps its numbers.
    let mut renumber = vec![0; positions.len()];
    let mut kept = Vec::new();
    for v in (0..positions.len()).filter(|&v| used[v]) {
        renumber[v] = kept.len() as u32;
        kept.push(positions[v]);
    }
    for tri in &mut chosen {
        *tri = tri.map(|v| renumber[v as usize]);
    }
    let numbers = renumber.into_iter().zip(used);
    Ok(Kept {
        positions: kept,
        triangles: chosen,
        numbers: numbers.map(|(v, used)| used.then_some(v)).collect(),
    })
}

/// One of several surfaces.
struct Enclosing<'t> {
    triangles: Vec<&'t [u32; 3]>,
    lower: DVec3,
    upper: DVec3,
    /// Six times the volume it encloses (m³), negative where it faces inward.
    volume: f64,
}

impl<'t> Enclosing<'t> {
    const NOTHING: Self = Self {
        triangles: Vec::new(),
        lower: DVec3::INFINITY,
        upper: DVec3::NEG_INFINITY,
        volume: 0.0,
    };

    fn add(&mut self, tri: &'t [u32; 3], positions: &[DVec3], origin: DVec3) {
        let corners = tri.map(|v| positions[v as usize]);
        for p in corners {
            self.lower = self.lower.min(p);
            self.upper = self.upper.max(p);
        }
        let [a, b, c] = corners.map(|p| p - origin);
        self.volume += a.dot(b.cross(c));
        self.triangles.push(tri);
    }

    /// Whether it faces outward and a point lies within it.
    fn surrounds(&self, positions: &[DVec3], point: DVec3) -> bool {
        let within = point.cmpge(self.lower).all() && point.cmple(self.upper).all();
        self.volume > 0.0 && within && {
            let seen =
                |t: &&[u32; 3]| winding::solid_angle(&t.map(|v| positions[v as usize]), point);
            self.triangles.iter().map(seen).sum::<f64>() > 2.0 * std::f64::consts::PI
        }
    }
}

/// Surfaces that face inward and lie within another one bound a hollow of it: by their labels, that of the
/// surface around them.
fn hollows(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    labels: &[u32],
    by_area: &[(u32, f64)],
) -> HashMap<u32, u32> {
    let mut found = HashMap::new();
    if by_area.len() < 2 {
        return found;
    }
    let places: NumberMap<u32, usize> = by_area.iter().map(|b| b.0).zip(0..).collect();
    let mut surfaces: Vec<Enclosing> = by_area.iter().map(|_| Enclosing::NOTHING).collect();
    for tri in triangles {
        let label = labels[tri[0] as usize];
        surfaces[places[&label]].add(tri, positions, positions[label as usize]);
    }
    for (k, &(inner, _)) in by_area.iter().enumerate() {
        if surfaces[k].volume >= 0.0 {
            continue;
        }
        let point = positions[inner as usize];
        let around = surfaces[..k]
            .iter()
            .position(|outer| outer.surrounds(positions, point));
        if let Some(outer) = around {
            found.insert(inner, by_area[outer].0);
        }
    }
    found
}

fn fill_holes(
    positions: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    repair: &Repair,
    report: &mut RepairReport,
) {
    if repair.fill_holes <= 0.0 {
        return;
    }
    for rim in repair::holes(positions, triangles, repair.fill_holes) {
        let before = positions.len();
        let filling = repair::fill(positions, &rim).unwrap_or_else(|| fan(positions, &rim));
        // A seam of points in a line has no area to fill: it stays open, as what is said of open edges tells.
        if filling.iter().any(|&tri| has_no_area(positions, tri)) {
            positions.truncate(before);
            continue;
        }
        triangles.extend(filling);
        report.filled_holes += 1;
    }
}

/// A filling for rims that are too long for the best one: a fan round a new vertex in the middle.
fn fan(positions: &mut Vec<DVec3>, rim: &[u32]) -> Vec<[u32; 3]> {
    let middle = rim.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / rim.len() as f64;
    let centre = positions.len() as u32;
    positions.push(middle);
    (0..rim.len())
        .map(|i| [rim[i], rim[(i + 1) % rim.len()], centre])
        .collect()
}

/// The representative of a vertex in a union-find forest, with its path halved.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

/// For each vertex the smallest vertex index it is connected to.
pub(crate) fn components(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    for tri in triangles {
        let first = root(&mut parent, tri[0]);
        let low = tri[1..].iter().fold(first, |low, &v| {
            let other = root(&mut parent, v);
            let (low, high) = (low.min(other), low.max(other));
            parent[high as usize] = low;
            low
        });
        parent[first as usize] = low;
    }
    (0..vertices as u32).map(|v| root(&mut parent, v)).collect()
}

/// Turns triangles over until neighbours across every two-triangle edge agree, following the first
/// triangle of the body, on the side that most were on. Whether any was turned.
fn orient(triangles: &mut [[u32; 3]], sides: &Sides, report: &mut RepairReport) -> bool {
    let runs = |tri: [u32; 3], a: u32, b: u32| (0..3).any(|i| tri[i] == a && tri[(i + 1) % 3] == b);
    let mut visited = vec![false; triangles.len()];
    let mut flipped = vec![false; triangles.len()];
    for start in 0..triangles.len() {
        if visited[start] {
            continue;
        }
        visited[start] = true;
        let mut members = vec![start];
        let mut queue = VecDeque::from([start]);
        while let Some(t) = queue.pop_front() {
            for e in sides.of_triangles[t] {
                let edge = &sides.edges[e as usize];
                if edge.triangles.len() != 2 {
                    continue;
                }
                let other = edge.triangles[usize::from(edge.triangles[0] as usize == t)] as usize;
                if visited[other] {
                    continue;
                }
                visited[other] = true;
                if runs(triangles[t], edge.a, edge.b) == runs(triangles[other], edge.a, edge.b) {
                    triangles[other].swap(1, 2);
                    flipped[other] = true;
                }
                members.push(other);
                queue.push_back(other);
            }
        }
        // The first triangle is as likely to be the wrong one: keep the side that most were on.
        if 2 * members.iter().filter(|&&t| flipped[t]).count() > members.len() {
            for &t in &members {
                triangles[t].swap(1, 2);
                flipped[t] = !flipped[t];
            }
        }
    }
    report.flipped_triangles = flipped.iter().filter(|&&f| f).count();
    report.flipped_triangles > 0
}

/// A closed body encloses a positive volume when its triangles face outward; an open one has no outside
/// of its own and stays as its file says. Whether it was turned.
fn turn_outward(
    positions: &[DVec3],
    triangles: &mut [[u32; 3]],
    report: &mut RepairReport,
) -> bool {
    let origin = positions[0];
    let volume: f64 = triangles
        .iter()
        .map(|tri| {
            let [a, b, c] = tri.map(|v| positions[v as usize] - origin);
            a.dot(b.cross(c))
        })
        .sum();
    if volume < 0.0 {
        for tri in triangles.iter_mut() {
            tri.swap(1, 2);
        }
        report.flipped_triangles = triangles.len() - report.flipped_triangles;
    }
    volume < 0.0
}

/// The edges of triangles.
struct Sides {
    edges: Vec<Edge>,
    /// The edge opposite each corner.
    of_triangles: Vec<[u32; 3]>,
}

impl Sides {
    fn of(triangles: &[[u32; 3]]) -> Self {
        let mut index: NumberMap<(u32, u32), u32> = NumberMap::default();
        index.reserve(triangles.len() * 3 / 2);
        let mut edges: Vec<Edge> = Vec::with_capacity(triangles.len() * 3 / 2);
        let of_triangles = triangles
            .iter()
            .enumerate()
            .map(|(t, tri)| {
                std::array::from_fn(|corner| {
                    let (p, q) = (tri[(corner + 1) % 3], tri[(corner + 2) % 3]);
                    let (a, b) = (p.min(q), p.max(q));
                    let e = *index.entry((a, b)).or_insert_with(|| {
                        edges.push(Edge {
                            a,
                            b,
                            triangles: Vec::with_capacity(2),
                        });
                        (edges.len() - 1) as u32
                    });
                    edges[e as usize].triangles.push(t as u32);
                    e
                })
            })
            .collect();
        Self {
            edges,
            of_triangles,
        }
    }
}

fn vertex_normals(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for tri in triangles {
        let p = tri.map(|v| positions[v as usize]);
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for i in 0..3 {
            let (u, v) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
            normals[tri[i] as usize] += normal * u.angle_between(v);
        }
    }
    normals.iter().map(|n| n.normalize_or_zero()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        (
            vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)],
            vec![[0, 1, 2], [0, 2, 3]],
        )
    }

    #[test]
    fn a_clean_surface_needs_no_repair() {
        let (p, t) = square();
        let (mesh, report) = TriMesh::new(&p, &t, 0).unwrap();
        assert_eq!(
            report,
            RepairReport {
                bodies: 1,
                boundary_edges: 4,
                ..Default::default()
            }
        );
        assert!((mesh.area() - 1.0).abs() < 1e-15);
        assert_eq!(mesh.boundary_edges().count(), 4);
    }

    #[test]
    fn repairs_are_counted() {
        let (mut p, mut t) = square();
        p.push(p[2]); // a duplicate vertex …
        t[1] = [0, 3, 4]; // … on a triangle that winds the other way
        t.push([0, 0, 1]);
        t.push([1, 2, 0]);
        t.push([0, 1, 2]);
        let (mesh, report) = TriMesh::new(&p, &t, 0).unwrap();
        assert_eq!(
            (report.welded_vertices, report.degenerate_triangles),
            (1, 1)
        );
        assert_eq!(
            (report.duplicate_triangles, report.flipped_triangles),
            (2, 1)
        );
        assert!(mesh.facet_normal(0).dot(mesh.facet_normal(1)) > 0.99);
    }

    #[test]
    fn a_closed_body_faces_outward() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let inward = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        let (mesh, report) = TriMesh::new(&p, &inward, 0).unwrap();
        assert_eq!(report.flipped_triangles, 4);
        let centre = DVec3::splat(0.25);
        for t in 0..4 {
            let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
            assert!(mesh.facet_normal(t).dot(middle - centre) > 0.0);
        }
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let (p, t) = square();
        assert_eq!(TriMesh::new(&p, &[], 0).unwrap_err(), MeshError::Empty);
        let mut bad = p.clone();
        bad[3].x = f64::NAN;
        assert_eq!(
            TriMesh::new(&bad, &t, 0).unwrap_err(),
            MeshError::NotFinite { vertex: 3 }
        );
        assert!(matches!(
            TriMesh::new(&p, &[[0, 1, 9]], 0).unwrap_err(),
            MeshError::BadIndex { vertex: 9, .. }
        ));
        assert_eq!(
            TriMesh::new(&[p[0]; 3], &[[0, 1, 2]], 0).unwrap_err(),
            MeshError::AllDegenerate
        );
        assert!(matches!(
            TriMesh::new(&p, &t, 1).unwrap_err(),
            MeshError::NoSuchBody { count: 1, .. }
        ));
    }
}
