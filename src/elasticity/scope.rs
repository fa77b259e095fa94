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
    let curvatures = curvatures(mesh, |e| surface.features[e]);
    let tight = |t: &usize| curvatures[*t] * radius > 1.0;
    let curved = (0..curvatures.len()).filter(tight);
    curved.map(|t| mesh.facet_area(t as u32)).sum::<f64>() / mesh.area()
}

/// Largest curvature (1/m) across the edges of each facet but those that are sharp.
fn curvatures(mesh: &TriMesh, sharp: impl Fn(usize) -> bool) -> Vec<f64> {
    /// Smaller angles are rounding.
    const LEAST: f64 = 0.02;
    let mut curvatures = vec![0.0_f64; mesh.triangles().len()];
    for (_, edge) in (mesh.edges().iter().enumerate()).filter(|(e, _)| !sharp(*e)) {
        let [s, t] = edge.triangles[..] else { continue };
        // The angle between two facets spreads over half of either's height over the edge.
        let angle = mesh.facet_normal(s).angle_between(mesh.facet_normal(t));
        let across = (mesh.facet_area(s) + mesh.facet_area(t)) / length(mesh, edge);
        if angle > LEAST {
            for facet in [s, t] {
                let curvature = &mut curvatures[facet as usize];
                *curvature = curvature.max(angle / across);
            }
        }
    }
    curvatures
}

/// Radius of curvature (m) that a tenth and half of the area of these facets are bent tighter than, across
/// edges that are no creases; infinite where they are flat.
#[must_use]
pub fn radii(mesh: &TriMesh, facets: &[u32]) -> [f64; 2] {
    let curvatures = curvatures(mesh, |e| is_joint(mesh, &mesh.edges()[e]));
    let mut bent: Vec<(f64, f64)> = (facets.iter())
        .map(|&t| (curvatures[t as usize], mesh.facet_area(t)))
        .collect();
    bent.sort_by(|a, b| b.0.total_cmp(&a.0));
    let total: f64 = bent.iter().map(|b| b.1).sum();
    [0.1, 0.5].map(|share| {
        let mut sum = 0.0;
        let tight = bent.iter().find(|b| {
            sum += b.1;
            sum >= share * total
        });
        tight.map_or(f64::INFINITY, |b| 1.0 / b.0)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::elasticity::Material;

    #[test]
    fn the_radius_of_a_limb_is_found() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let facets: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
        let [_, half] = radii(&mesh, &facets);
        assert!((half / 31.831e-3 - 1.0).abs() < 0.25, "{half}");
    }
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
