//! Where the theory of thin shells itself is off, whatever the mesh: said, not hidden.

use super::ShellSection;
use crate::mesh::bends::bends;
use crate::mesh::surface::Surface;
use crate::mesh::{Edge, TriMesh};
use crate::plain;
use crate::units;

/// Beyond this the wall is no thin shell: thickness over radius of curvature, and over width.
const THICK_FOR_RADIUS: f64 = 0.1;
const THICK_FOR_WIDTH: f64 = 0.25;
/// Share of the surface from which it is worth a word.
const WORTH: f64 = 0.02;

/// What a reader must know about a part of this section pressed by a tip of this radius (m).
#[must_use]
pub fn cautions(surface: &Surface, section: &ShellSection, tip_radius: f64) -> Vec<String> {
    let mesh = &surface.mesh;
    let t = section.thickness;
    let mut notes = Vec::new();
    let curved = tightly_curved(surface, t / THICK_FOR_RADIUS);
    if curved > WORTH {
        notes.push(format!(
            "On {:.0} % of the surface the radius of curvature is below ten wall thicknesses ({:.1} mm): thin-shell theory is several percent off there, strains of the inside face most.",
            100.0 * curved,
            units::mm(t / THICK_FOR_RADIUS)
        ));
    }
    let rim: f64 = mesh.boundary_edges().map(|e| length(mesh, e)).sum();
    let width = 2.0 * mesh.area() / rim.max(f64::MIN_POSITIVE);
    if width < t / THICK_FOR_WIDTH {
        notes.push(format!(
            "The part is made of strips about {:.1} mm wide, less than four wall thicknesses ({:.1} mm): a shell is the wrong model for bars.",
            units::mm(width),
            units::mm(t / THICK_FOR_WIDTH)
        ));
    }
    let joints: f64 = mesh
        .edges()
        .iter()
        .zip(&surface.features)
        .filter(|(e, feature)| **feature && is_joint(mesh, e))
        .map(|(e, _)| length(mesh, e))
        .sum();
    if joints * 2.0 * t > WORTH * mesh.area() {
        notes.push(format!(
            "Walls meet at an angle along {:.0} mm: within about {:.1} mm of such joints the real strain is that of a solid corner and not of two shells.",
            units::mm(joints),
            units::mm(2.0 * t)
        ));
    }
    if tip_radius < t {
        notes.push(format!(
            "The tip (radius {} mm) is smaller than the wall is thick ({} mm): the dent right under it is not in a shell model.",
            plain::digits(units::mm(tip_radius)),
            plain::digits(units::mm(t))
        ));
    }
    notes
}

fn length(mesh: &TriMesh, edge: &Edge) -> f64 {
    mesh.positions()[edge.a as usize].distance(mesh.positions()[edge.b as usize])
}

/// Whether walls meet there at more than a crease's angle.
fn is_joint(mesh: &TriMesh, edge: &Edge) -> bool {
    match edge.triangles[..] {
        [_] => false,
        [s, t] => mesh.facet_normal(s).dot(mesh.facet_normal(t)) < 0.866,
        _ => true,
    }
}

/// Share of the area whose radius of curvature between feature lines is below `radius` (m).
fn tightly_curved(surface: &Surface, radius: f64) -> f64 {
    /// Share of that radius over which it is measured.
    const REACH: f64 = 0.2;
    let mesh = &surface.mesh;
    let facets: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
    let bends = bends(mesh, &facets, REACH * radius, |e| surface.features[e]);
    let tight = bends.iter().filter(|b| b.curvature * radius > 1.0);
    tight.map(|b| b.area).sum::<f64>() / mesh.area()
}

/// Radius of curvature (m) that a tenth and half of the area of these facets are bent tighter than, between
/// creases; infinite where they are flat. Walls of this thickness (m) bend over two of them and more.
#[must_use]
pub fn radii(mesh: &TriMesh, facets: &[u32], wall: f64) -> [f64; 2] {
    /// Over so many of its own lengths a surface is flat.
    const FLAT: f64 = 50.0;
    let (lower, upper) = mesh.bounds();
    let flat = FLAT * (upper - lower).length();
    let joint = |e: usize| is_joint(mesh, &mesh.edges()[e]);
    let mut bends = bends(mesh, facets, 2.0 * wall, joint);
    bends.sort_by(|a, b| b.curvature.total_cmp(&a.curvature));
    let total: f64 = bends.iter().map(|b| b.area).sum();
    [0.1, 0.5].map(|share| {
        let mut sum = 0.0;
        let tight = bends.iter().find(|b| {
            sum += b.area;
            sum >= share * total
        });
        let radius = tight.map_or(f64::INFINITY, |b| b.curvature.recip());
        if radius > flat { f64::INFINITY } else { radius }
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::elasticity::Material;
    use crate::limb::LimbSpec;

    fn of_all(mesh: &TriMesh) -> [f64; 2] {
        let facets: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
        radii(mesh, &facets, 1.5e-3)
    }

    #[test]
    fn the_radius_of_a_limb_is_found() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let half = of_all(&mesh)[1];
        assert!((half / 31.831e-3 - 1.0).abs() < 0.1, "{half}");
    }

    /// A tube of 30 mm radius and 60 mm length.
    fn tube(columns: usize, rows: usize) -> TriMesh {
        let at = |i: usize, j: usize| {
            let turn = std::f64::consts::TAU * i as f64 / columns as f64;
            let z = 60e-3 * j as f64 / rows as f64;
            DVec3::new(30e-3 * turn.cos(), 30e-3 * turn.sin(), z)
        };
        let places = (0..=rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let positions: Vec<DVec3> = places.map(|(i, j)| at(i, j)).collect();
        let corner = |i: usize, j: usize| (j * columns + i % columns) as u32;
        let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let triangles: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| {
                let [here, beside] = [corner(i, j), corner(i + 1, j)];
                let [across, above] = [corner(i + 1, j + 1), corner(i, j + 1)];
                [[here, beside, across], [here, across, above]]
            })
            .collect();
        TriMesh::new(&positions, &triangles, 0).unwrap().0
    }

    /// The radius is the same whatever the triangles, long ones too.
    #[test]
    fn the_radius_does_not_hang_on_the_size_of_triangles() {
        for (columns, rows) in [(48, 15), (48, 1), (200, 60), (200, 3), (400, 20), (400, 2)] {
            let tube = tube(columns, rows);
            for radius in of_all(&tube) {
                let off = radius / 30e-3 - 1.0;
                assert!(off.abs() < 0.05, "{columns} × {rows}: {radius}");
            }
            let surface = Surface::new(&Arc::new(tube), |_| false, |_| false);
            assert!(tightly_curved(&surface, 15e-3) < 1e-3, "{columns} × {rows}");
            assert!(tightly_curved(&surface, 40e-3) > 0.99, "{columns} × {rows}");
        }
    }

    #[test]
    fn what_is_flat_has_no_radius() {
        let corners = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)];
        let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
        let plate = TriMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]], 0)
            .unwrap()
            .0;
        assert!(of_all(&plate).into_iter().all(f64::is_infinite));
    }

    fn notes(thickness: f64, tip: f64) -> Vec<String> {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let surface = Surface::new(&Arc::new(mesh), |_| false, |_| false);
        let section = ShellSection {
            material: Material {
                youngs_modulus: 1.7e9,
                poissons_ratio: 0.35,
            },
            thickness,
        };
        cautions(&surface, &section, tip)
    }

    #[test]
    fn a_thin_limb_is_in_scope_and_a_thick_one_is_not() {
        assert!(notes(1.5e-3, 5e-3).is_empty(), "{:?}", notes(1.5e-3, 5e-3));
        let thick = notes(5e-3, 5e-3).join(" ");
        assert!(
            thick.contains("radius of curvature") && thick.contains("strips"),
            "{thick}"
        );
        assert!(notes(1.5e-3, 1e-3)[0].contains("tip"));
    }
}
