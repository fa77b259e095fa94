//! Where the theory of thin shells itself is off, whatever the mesh: said, not hidden.

use super::Section;
use crate::mesh::surface::Surface;
use crate::mesh::{Edge, TriMesh};

/// Beyond this the wall is no thin shell: thickness over radius of curvature, and over width.
const THICK_FOR_RADIUS: f64 = 0.1;
const THICK_FOR_WIDTH: f64 = 0.25;
/// Share of the surface from which it is worth a word.
const WORTH: f64 = 0.02;

/// What a reader must know about a part of this section pressed by a tip of this radius (m).
#[must_use]
pub fn cautions(surface: &Surface, section: &Section, tip_radius: f64) -> Vec<String> {
    let mesh = &surface.mesh;
    let t = section.thickness;
    let mm = |x: f64| x * 1000.0;
    let mut notes = Vec::new();
    let curved = tightly_curved(surface, t / THICK_FOR_RADIUS);
    if curved > WORTH {
        notes.push(format!(
            "On {:.0} % of the surface the radius of curvature is below ten wall thicknesses ({:.1} mm): thin-shell theory is several percent off there, strains of the inside face most.",
            100.0 * curved,
            mm(t / THICK_FOR_RADIUS)
        ));
    }
    let rim: f64 = mesh.boundary_edges().map(|e| length(mesh, e)).sum();
    let width = 2.0 * mesh.area() / rim.max(f64::MIN_POSITIVE);
    if width < t / THICK_FOR_WIDTH {
        notes.push(format!(
            "The part is made of strips about {:.1} mm wide, less than four wall thicknesses ({:.1} mm): a shell is the wrong model for bars.",
            mm(width),
            mm(t / THICK_FOR_WIDTH)
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
            mm(joints),
            mm(2.0 * t)
        ));
    }
    if tip_radius < t {
        notes.push(format!(
            "The tip (radius {:.2} mm) is smaller than the wall is thick ({:.2} mm): the dent right under it is not in a shell model.",
            mm(tip_radius),
            mm(t)
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

/// Share of the area whose radius of curvature across smooth edges is below `radius` (m).
fn tightly_curved(surface: &Surface, radius: f64) -> f64 {
    let mesh = &surface.mesh;
    let mut curved = vec![false; mesh.triangles().len()];
    for (edge, _) in mesh
        .edges()
        .iter()
        .zip(&surface.features)
        .filter(|(_, f)| !**f)
    {
        let [s, t] = edge.triangles[..] else { continue };
        // The angle between two facets spreads over half of either's height over the edge.
        let angle = mesh.facet_normal(s).angle_between(mesh.facet_normal(t));
        let across = (mesh.facet_area(s) + mesh.facet_area(t)) / length(mesh, edge);
        if angle * radius > across && angle > 0.02 {
            curved[s as usize] = true;
            curved[t as usize] = true;
        }
    }
    let area = |keep: &dyn Fn(usize) -> bool| -> f64 {
        (0..curved.len())
            .filter(|&t| keep(t))
            .map(|t| mesh.facet_area(t as u32))
            .sum()
    };
    area(&|t| curved[t]) / area(&|_| true)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::elasticity::Material;
    use crate::limb::LimbSpec;

    fn notes(thickness: f64, tip: f64) -> Vec<String> {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let surface = Surface::new(&Arc::new(mesh), |_| false, |_| false);
        let section = Section {
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
