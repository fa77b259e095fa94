//! A shell's wall as the solid that it is: what leaving out the thickness costs can then be measured.

use std::sync::Arc;

use glam::DVec3;

use super::Inputs;
use crate::mesh::TriMesh;
use crate::project::{Masks, PartModel, SupportKeys};

/// The same part with its wall as a closed solid, its mid-surface where the shell was. Nothing for what is a solid
/// already.
#[must_use]
pub fn walled(inputs: &Inputs) -> Option<Inputs> {
    if inputs.project.part.model == PartModel::Solid {
        return None;
    }
    let thickness = inputs.project.part.thickness();
    let mut project = inputs.project.clone();
    project.part.model = PartModel::Solid;
    for support in &mut project.supports {
        reach_through(support, &inputs.part, thickness / 2.0);
        // Both faces of the wall stand on what held its middle.
        support.bedding_n_per_mm3 = support.bedding_n_per_mm3.map(|b| b / 2.0);
    }
    // Both faces have the vertices of the middle, the outer ones first.
    let twice = |mask: &Arc<Vec<bool>>| Arc::new([mask.as_slice(), mask.as_slice()].concat());
    let masks = inputs.masks.iter();
    let masks: Masks = masks.map(|(name, m)| (name.clone(), twice(m))).collect();
    Some(Inputs {
        part: Arc::new(inputs.part.thickened(thickness)),
        painted: inputs.painted.as_ref().map(twice),
        masks,
        project,
    })
}

/// Widens a box across the wall that it holds, and not along it.
fn reach_through(support: &mut SupportKeys, part: &TriMesh, half: f64) {
    let Some(mut region) = support.oriented_box() else {
        return;
    };
    let held = part.positions().iter().zip(part.vertex_normals());
    let reach = held
        .filter(|(p, _)| region.contains(**p, 0.0))
        .map(|(_, n)| region.stance.coordinates(*n).abs() * half)
        .fold(DVec3::ZERO, DVec3::max);
    // A little more, so that the faces themselves lie within.
    region.lower -= reach * 1.001;
    region.upper += reach * 1.001;
    support.set_box(&region);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::opening;

    #[test]
    fn the_bundled_limb_is_held_through_its_wall() {
        let inputs = opening::bundled().unwrap().inputs;
        let solid = walled(&inputs).unwrap();
        assert_eq!(solid.project.part.model, PartModel::Solid);
        assert!(walled(&solid).is_none());
        let count = inputs.part.positions().len();
        assert_eq!(solid.part.positions().len(), 2 * count);
        let within = |inputs: &Inputs, at: DVec3| {
            inputs.project.supports.iter().any(|s| {
                let [a, b] = s.box_mm.unwrap().map(|p| DVec3::from_array(p) * 1e-3);
                let (lower, upper) = (a.min(b) - 1e-9, a.max(b) + 1e-9);
                at.cmpge(lower).all() && at.cmple(upper).all()
            })
        };
        let mut held = 0;
        for (v, &p) in inputs.part.positions().iter().enumerate() {
            if within(&inputs, p) {
                held += 1;
                assert!(
                    within(&solid, solid.part.positions()[v]),
                    "outer face at {p}"
                );
                assert!(
                    within(&solid, solid.part.positions()[v + count]),
                    "inner face at {p}"
                );
            }
        }
        assert!(held > 50, "{held}");
    }
}
