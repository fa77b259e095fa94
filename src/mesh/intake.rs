//! A raw surface taken in: checked, welded, one body of it, of one orientation.

use glam::DVec3;

use super::bodies::keep_body;
use super::numbers::{NumberMap, NumberSet};
use super::orientation::{orient, turn_outward};
use super::repair::{self, Repair, has_no_area};
use super::report::RepairReport;
use super::topology::Sides;
use super::{MeshError, TriMesh};

/// A surface that was taken in, with what was changed and where its vertices went.
#[derive(Clone, Debug)]
pub struct TakenIn {
    /// The surface (m).
    pub mesh: TriMesh,
    /// What was changed.
    pub repairs: RepairReport,
    /// For each vertex that was given its number in the mesh; nothing where it is no part of it.
    pub vertices: Vec<Option<u32>>,
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
        let (mut numbers, points) = weld(positions, repair, &mut report);
        let renumbered = triangles.iter().map(|t| t.map(|v| numbers[v as usize]));
        let mut whole = drop_degenerate(&points, renumbered, &mut report)?;
        report.joined_vertices += repair::join_rounded(&points, &mut whole, &mut numbers);
        let kept = keep_body(&points, &whole, body, &mut report)?;
        let mut mesh = Self::of_body(kept.positions, kept.triangles, repair, &mut report);
        if report.boundary_edges > 0 {
            // Of the whole file: what is torn lies apart.
            let torn = repair::torn(&points, &whole);
            report.closes_within = torn.filter(|t| t.closes).map(|t| t.within);
            report.torn = (torn.filter(|t| !t.closes)).map(|t| (t.within, t.sides));
            mesh.closes_within = report.closes_within;
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
        repair::fill_holes(&mut positions, &mut triangles, repair, report);
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

fn drop_degenerate(
    positions: &[DVec3],
    triangles: impl ExactSizeIterator<Item = [u32; 3]>,
    report: &mut RepairReport,
) -> Result<Vec<[u32; 3]>, MeshError> {
    let mut seen: NumberSet<(u32, u32, u32)> = NumberSet::default();
    seen.reserve(triangles.len());
    let mut kept = Vec::with_capacity(triangles.len());
    for tri in triangles {
        if has_no_area(positions, tri) {
            report.degenerate_triangles += 1;
            continue;
        }
        let mut corners = tri;
        corners.sort_unstable();
        if seen.insert(corners.into()) {
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
